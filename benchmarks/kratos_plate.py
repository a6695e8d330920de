"""A plate of Kratos Multiphysics as the structure, window by window, compared with our own plate.

    pip install KratosMultiphysics KratosStructuralMechanicsApplication
    python benchmarks/kratos_plate.py [cells along a side]

The participant holds triangular thin shells, which Kratos moves by Newmark's method. Its state is the motion of the
nodes, so that a window can be repeated. Printed: AR, TOF and processor time of both.
"""

import sys
import warnings
from collections.abc import Sequence
from time import process_time
from typing import Any

import KratosMultiphysics as kratos
import KratosMultiphysics.StructuralMechanicsApplication as mechanics
import numpy as np
from KratosMultiphysics.python_linear_solver_factory import ConstructSolver

import hertzlink as hl

SIDE, THICKNESS, MATERIAL = 0.2, 6e-3, hl.ALUMINIUM_6061
WINDOW, UNTIL, SENSOR = 2e-6, 1.2e-3, 5
MOTION = (
    kratos.DISPLACEMENT, kratos.ROTATION, kratos.VELOCITY, kratos.ANGULAR_VELOCITY, kratos.ACCELERATION,
    kratos.ANGULAR_ACCELERATION,
)  # fmt: skip
OTHERS = (kratos.REACTION, kratos.REACTION_MOMENT, kratos.VOLUME_ACCELERATION, mechanics.POINT_LOAD)
BENDING = ("DISPLACEMENT_Z", "ROTATION_X", "ROTATION_Y")
SOLVER = '{"solver_type": "cg", "tolerance": 1e-11, "max_iteration": 2000, "preconditioner_type": "diagonal"}'

State = list[np.ndarray]


class KratosPlate:
    """A square plate of thin shells, clamped at two edges and struck at its centre."""

    surface = hl.Surface(MATERIAL)

    def __init__(self, cells: int) -> None:
        kratos.Logger.GetDefaultOutput().SetSeverity(kratos.Logger.Severity.WARNING)
        self.model = kratos.Model()
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
                    if node.X in (0.0, SIDE) or variable.Name() not in BENDING:
                        node.Fix(variable)

    def start(self) -> State:
        return [np.zeros(3 * self.part.NumberOfNodes()) for _ in MOTION]

    def advance(self, state: Sequence[np.ndarray], force: float, window: float) -> tuple[State, float]:
        utilities, nodes = kratos.VariableUtils(), self.part.Nodes
        for variable, values in zip(MOTION, state, strict=True):
            for step in (0, 1):
                utilities.SetSolutionStepValuesVector(nodes, variable, kratos.Vector(values), step)
        self.part.ProcessInfo[kratos.DELTA_TIME] = window
        self.centre.SetSolutionStepValue(mechanics.POINT_LOAD, [0.0, 0.0, force])
        for stage in ("InitializeSolutionStep", "Predict", "SolveSolutionStep", "FinalizeSolutionStep"):
            getattr(self.strategy, stage)()
        motion = [np.array(utilities.GetSolutionStepValuesVector(nodes, variable, 0, 3)) for variable in MOTION]
        return motion, self.centre.GetSolutionStepValue(kratos.DISPLACEMENT_Z)


def main() -> None:
    """Print a row for our own plate and one for that of Kratos."""
    cells = int(sys.argv[1]) if len(sys.argv) > 1 else 32
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    bead = hl.Sphere(9.53e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 10, bead, impact_speed=0.3)
    edges = hl.Supports(left="clamped", right="clamped")
    own = hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, MATERIAL, edges, highest_frequency=80e3).at(SIDE / 2.0, SIDE / 2.0)
    scheme = hl.Aitken()
    for name, structure in (("hertzlink", own), (f"Kratos, {cells} cells", KratosPlate(cells))):
        begin = process_time()
        run = hl.CoSimulation(chain, structure, window=WINDOW, scheme=scheme).run(UNTIL)
        seconds, wave = process_time() - begin, hl.reflections(run, SENSOR).primary
        ratio, flight = wave.amplitude_ratio, 1e6 * wave.time_of_flight
        print(f"{name:20s} AR {ratio:.4f}  TOF {flight:.2f} µs  {seconds:6.1f} s  energy {hl.energy_error(run):.1e}")


if __name__ == "__main__":
    main()
