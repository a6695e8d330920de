"""A plate of Kratos Multiphysics as the structure, window by window, compared with our own plate.

    pip install KratosMultiphysics KratosStructuralMechanicsApplication
    python benchmarks/kratos_plate.py [cells along a side]

The participant holds triangular thin shells, which Kratos moves by the trapezoidal rule. Its state is the motion of the
nodes, so that a window can be repeated. Printed: AR, TOF, processor time and energy error of our plate, of Kratos' mass
and stiffness through `from_matrices`, which tells the error of the mesh, and of Kratos itself, which tells that of the
coupling.
"""

import sys
import warnings
from time import process_time
from typing import Any

import KratosMultiphysics as kratos
import KratosMultiphysics.StructuralMechanicsApplication as mechanics
import numpy as np
from KratosMultiphysics.python_linear_solver_factory import ConstructSolver
from scipy import sparse

import hertzlink as hl

SIDE, THICKNESS, MATERIAL = 0.2, 6e-3, hl.ALUMINIUM_6061
WINDOW, UNTIL, SENSOR = 2e-6, 1.2e-3, 5
MOTION = (
    kratos.DISPLACEMENT, kratos.ROTATION, kratos.VELOCITY, kratos.ANGULAR_VELOCITY, kratos.ACCELERATION,
    kratos.ANGULAR_ACCELERATION,
)  # fmt: skip
OTHERS = (kratos.REACTION, kratos.REACTION_MOMENT, kratos.VOLUME_ACCELERATION, mechanics.POINT_LOAD)
BENDING = {"DISPLACEMENT_Z": 2, "ROTATION_X": 3, "ROTATION_Y": 4}
"""The degrees of freedom of bending among the six of a node."""
SOLVER = '{"solver_type": "skyline_lu_factorization"}'

State = tuple[float, list[np.ndarray]]


class KratosPlate:
    """A square plate of thin shells, clamped at two edges and struck at its centre."""

    surface = hl.Surface(MATERIAL)

    def __init__(self, cells: int) -> None:
        kratos.Logger.GetDefaultOutput().SetSeverity(kratos.Logger.Severity.WARNING)
        self.model, self.utilities = kratos.Model(), kratos.VariableUtils()
        self.part = self.model.CreateModelPart("plate", 2)
        for variable in (*MOTION, *OTHERS):
            self.part.AddNodalSolutionStepVariable(variable)
        self.part.ProcessInfo[kratos.DOMAIN_SIZE] = 3
        self._mesh(cells, self._shell())
        self._hold()
        self.strategy = kratos.ResidualBasedLinearStrategy(
            self.part, kratos.ResidualBasedBossakDisplacementScheme(0.0),
            kratos.ResidualBasedEliminationBuilderAndSolver(ConstructSolver(kratos.Parameters(SOLVER))),
            False, False, False, False,
        )  # fmt: skip
        # The matrix of all windows is the same.
        self.strategy.SetRebuildLevel(0)
        self.strategy.Initialize()

    def _shell(self) -> Any:
        shell = self.part.CreateNewProperties(1)
        shell[kratos.YOUNG_MODULUS], shell[kratos.POISSON_RATIO] = MATERIAL.youngs_modulus, MATERIAL.poisson_ratio
        shell[kratos.DENSITY], shell[kratos.THICKNESS] = MATERIAL.density, THICKNESS
        shell[kratos.CONSTITUTIVE_LAW] = mechanics.LinearElasticPlaneStress2DLaw()
        return shell

    def _mesh(self, cells: int, shell: Any) -> None:
        """Two triangles in each square; diagonals alternate, so that the mesh is symmetric about the centre."""
        row = cells + 1
        for j in range(row):
            for i in range(row):
                self.part.CreateNewNode(1 + i + j * row, SIDE * i / cells, SIDE * j / cells, 0.0)
        for j in range(cells):
            for i in range(cells):
                first = 1 + i + j * row
                square = (first, first + 1, first + row + 1, first + row)
                for half in range(2):
                    nodes = [square[((i + j) % 2 + 2 * half + n) % 4] for n in range(3)]
                    self.part.CreateNewElement("ShellThinElement3D3N", 1 + 2 * (i + j * cells) + half, nodes, shell)
        self.centre = self.part.Nodes[1 + cells // 2 * (row + 1)]
        self.part.CreateNewCondition("PointLoadCondition3D1N", 1, [self.centre.Id], shell)

    def _hold(self) -> None:
        """Clamp two edges. In-plane motion, which bending does not excite, is held everywhere."""
        for axis in "XYZ":
            for motion, reaction in (("DISPLACEMENT", "REACTION"), ("ROTATION", "REACTION_MOMENT")):
                variable = getattr(kratos, f"{motion}_{axis}")
                kratos.VariableUtils().AddDof(variable, getattr(kratos, f"{reaction}_{axis}"), self.part)
                for node in self.part.Nodes:
                    if self._held(node, variable.Name()):
                        node.Fix(variable)

    @staticmethod
    def _held(node: Any, name: str) -> bool:
        return min(node.X, SIDE - node.X) < 1e-9 or name not in BENDING

    def start(self) -> State:
        return 0.0, [np.zeros(3 * self.part.NumberOfNodes()) for _ in MOTION]

    def advance(self, state: State, force: float, window: float) -> tuple[State, float]:
        """Advance by one step of the trapezoidal rule, in which the mean of the loads at both ends is the force."""
        load, motion = 2.0 * force - state[0], state[1]
        for variable, values in zip(MOTION, motion, strict=True):
            for step in (0, 1):
                self._set(variable, values, step)
        self.part.ProcessInfo[kratos.DELTA_TIME] = window
        self.centre.SetSolutionStepValue(mechanics.POINT_LOAD, [0.0, 0.0, load])
        self.strategy.InitializeSolutionStep()
        self.strategy.Predict()
        # Kratos' scheme integrates the displacements alone. Rotations are predicted to stay, with this acceleration.
        _, angle, _, spin, _, acceleration = motion
        rest = -4.0 / window * spin - acceleration
        self._set(kratos.ANGULAR_ACCELERATION, rest, 0)
        self.strategy.SolveSolutionStep()
        self.strategy.FinalizeSolutionStep()
        end = [np.array(self.utilities.GetSolutionStepValuesVector(self.part.Nodes, one, 0, 3)) for one in MOTION]
        end[5] = rest + 4.0 / window**2 * (end[1] - angle)
        end[3] = spin + 0.5 * window * (acceleration + end[5])
        return (load, end), self.centre.GetSolutionStepValue(kratos.DISPLACEMENT_Z)

    def matrices(self) -> tuple[sparse.csr_matrix, sparse.csr_matrix, np.ndarray]:
        """Return mass, stiffness and contact vector of the degrees of freedom that move."""
        rows, columns, entries = [], [], ([], [])
        matrix, vector, info = kratos.Matrix(), kratos.Vector(), self.part.ProcessInfo
        for element in self.part.Elements:
            of_element = np.concatenate([6 * (node.Id - 1) + np.arange(6) for node in element.GetNodes()])
            rows.append(np.repeat(of_element, len(of_element)))
            columns.append(np.tile(of_element, len(of_element)))
            element.CalculateMassMatrix(matrix, info)
            entries[0].append(np.array(matrix).ravel())
            element.CalculateLocalSystem(matrix, vector, info)
            entries[1].append(np.array(matrix).ravel())
        place = np.concatenate(rows), np.concatenate(columns)
        nodes = [(node, 6 * (node.Id - 1)) for node in self.part.Nodes]
        free = [first + dof for node, first in nodes for name, dof in BENDING.items() if not self._held(node, name)]
        mass, stiffness = (sparse.csr_matrix((np.concatenate(one), place))[free][:, free] for one in entries)
        return mass, stiffness, np.equal(free, 6 * (self.centre.Id - 1) + 2).astype(float)

    def _set(self, variable: Any, values: np.ndarray, step: int) -> None:
        self.utilities.SetSolutionStepValuesVector(self.part.Nodes, variable, kratos.Vector(values), step)


def main() -> None:
    """Print a row for our own plate, one for Kratos' matrices, and one for Kratos."""
    cells = int(sys.argv[1]) if len(sys.argv) > 1 else 32
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    bead = hl.Sphere(9.53e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 10, bead, impact_speed=0.3)
    edges = hl.Supports(left="clamped", right="clamped")
    own = hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, MATERIAL, edges, highest_frequency=80e3).at(SIDE / 2.0, SIDE / 2.0)
    plate = KratosPlate(cells)
    mass, stiffness, contact = plate.matrices()
    structures = {
        "hertzlink": own,
        f"matrices of Kratos, {cells} cells": hl.from_matrices(mass, stiffness, MATERIAL, contact=contact),
        f"Kratos, {cells} cells": plate,
    }
    for name, structure in structures.items():
        begin = process_time()
        run = hl.CoSimulation(chain, structure, window=WINDOW, scheme=hl.IQN_ILS()).run(UNTIL)
        seconds, wave = process_time() - begin, hl.reflections(run, SENSOR).primary
        ratio, flight = wave.amplitude_ratio, 1e6 * wave.time_of_flight
        print(f"{name:30s} AR {ratio:.5f}  TOF {flight:.2f} µs  {seconds:6.1f} s  energy {hl.energy_error(run):.1e}")


if __name__ == "__main__":
    main()
