"""Results of 45 short cases, to compare one state of the code with another to the last digits.

A change that moves code, or writes the same arithmetic in another place, must not change a result. Record the cases
before it and compare them after it, on the same machine, with the same libraries and as many threads:

    python tests/unchanged.py record before.json
    python tests/unchanged.py compare before.json

compare lists each case whose numbers differ by more than 1e-12 of their size, and then fails. The reference file
one, reference/unchanged.json, was recorded on one machine before the code was laid out in folders; test_unchanged.py
compares with it, with a tolerance that other processors and libraries meet.
"""

import json
import sys
import warnings
from collections.abc import Callable, Iterator
from math import pi
from pathlib import Path
from typing import Any

import numpy as np

import hertzlink as hl

TOLERANCE = 1e-12
"""The largest difference, in units of the largest number of the same kind."""

BEAD = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
CLAMPED = hl.Supports("clamped", "clamped", "clamped", "clamped")
LAYERS = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
UNTIL = 7e-4


class SpringMass:
    """A user's own structure: one mass on one spring."""

    surface = hl.Surface(hl.PTFE)

    def start(self) -> tuple[float, float]:
        return 0.0, 0.0

    def advance(self, state: tuple[float, float], force: float, window: float) -> tuple[tuple[float, float], float]:
        stiffness, omega = 1.7e7, np.sqrt(1.7e7 / 0.0141)
        rest, c, s = force / stiffness, np.cos(omega * window), np.sin(omega * window)
        x, v = state[0] - rest, state[1]
        moved = rest + x * c + v * s / omega, v * c - x * s * omega
        return moved, moved[0]


def chain(count: int = 12, **given: Any) -> hl.Chain:
    return hl.Chain([BEAD] * count, **{"striker": BEAD, "impact_speed": 0.44} | given)


def rod() -> hl.Structure:
    return hl.rod(LAYERS)


def small(structure: hl.Structure) -> hl.Structure:
    return hl.reduce(structure, until=UNTIL)


def plate(**given: Any) -> Any:
    return hl.kirchhoff_plate(0.2, 0.15, 3e-3, hl.ALUMINIUM_6061, CLAMPED, **given)


def laminate() -> hl.Laminate:
    carbon = hl.OrthotropicMaterial(135e9, 9e9, 0.3, 5e9, 5e9, 3.2e9, 1560.0)
    return hl.Laminate([hl.Ply(carbon, 0.5e-3, angle) for angle in (0.0, pi / 4, -pi / 4, pi / 2, pi / 2, 0.0)])


def facing() -> hl.CoSimulation:
    near = small(plate().at([0.1, 0.1], [0.07, 0.07], face=["front", "back"]))
    contacts = [hl.ContactPoint(near, 0), small(plate().at(0.05, 0.05))]
    return hl.CoSimulation(
        [chain(8), chain(6, striker=None, impact_speed=None)], contacts, behind=[None, hl.ContactPoint(near, 1)]
    )


def two_chains() -> hl.CoSimulation:
    body = small(plate().at([0.08, 0.12], [0.07, 0.07]))
    return hl.CoSimulation([chain(8), chain(8, gravity=9.81)], body)


def of_cubes() -> hl.Structure:
    from skfem import MeshHex
    from skfem.io.meshio import to_meshio

    grid = MeshHex.init_tensor(*3 * [np.linspace(0.0, 20e-3, 8)])
    mesh = to_meshio(grid)
    mesh.point_sets = {"table": np.flatnonzero(grid.p[2] == 0.0)}
    return hl.solid(mesh, hl.ACRYLIC, contact=(0.01, 0.01, 0.02), fixed="table", patch_radius=4.5e-3)


def mixed() -> hl.Chain:
    hollow = hl.HollowSphere(9.525e-3, 8.655e-3, hl.ALUMINIUM_6061)
    steel = hl.Sphere(9.525e-3, hl.STEEL_316)
    odd = hl.Ellipsoid(4e-3, 12e-3, hl.BRASS_360, axis="along")
    crossed = [hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316, angle=pi / 2 * (n % 2)) for n in range(3)]
    return hl.Chain([steel, hollow] * 4 + [odd] + crossed, steel, impact_speed=0.3, dissipation=hl.Restitution(0.95))


def cases() -> dict[str, Callable[[], hl.CoSimulation]]:
    """Builders of the runs, by name."""
    co, wall = hl.CoSimulation, hl.half_space(hl.STEEL_440C)
    lossy = {
        "linear dashpot": hl.LinearDashpot(4.0),
        "power dashpot": hl.PowerDashpot(50.0, 1.3),
        "thesis dashpot": hl.PowerDashpot(5.0, 1.0, form="thesis"),
        "drag": hl.MassProportional(300.0),
        "Kuwabara and Kono": hl.KuwabaraKono(1e-6),
        "Tsuji": hl.Tsuji(0.1),
        "restitution": hl.Restitution(0.9),
    }
    found: dict[str, Callable[[], hl.CoSimulation]] = {
        "wall": lambda: co(chain(), wall),
        "free end": lambda: co(chain(), None),
        "RK4": lambda: co(chain(integrator="rk4"), wall),
        "gravity and preload": lambda: co(chain(gravity=9.81, preload=2.0), wall),
        "layered rod": lambda: co(chain(gravity=9.81), rod()),
        "layered rod, reduced": lambda: co(chain(gravity=9.81), small(rod())),
        "absorbing rod": lambda: co(chain(), hl.rod(LAYERS, base="absorbing")),
        "rod with Rayleigh damping": lambda: co(chain(), hl.damped(rod(), hl.damping.Rayleigh(100.0, 1e-7))),
        "modal damping": lambda: co(chain(), hl.damped(small(rod()), hl.damping.Modal(0.02))),
        "viscous rod": lambda: co(chain(), small(hl.damped(rod(), hl.damping.StandardLinearSolid(0.5, 2e-5)))),
        "layered cylinder": lambda: co(chain(), small(hl.layered_cylinder(LAYERS))),
        "cube": lambda: co(chain(), small(of_cubes())),
        "thin plate": lambda: co(chain(), small(plate().at(0.05, 0.07))),
        "plate with additions": lambda: co(
            chain(),
            small(
                plate(
                    additions=[
                        hl.PointMass(0.1, 0.1, 0.02),
                        hl.Weakened((0.05, 0.08, 0.05, 0.08), 0.5),
                        hl.Stiffener((0.02, 0.05), (0.18, 0.05), 10.0, 2.0, 0.1),
                    ]
                ).at(0.07, 0.07)
            ),
        ),
        "laminate": lambda: co(chain(), small(hl.kirchhoff_plate(0.2, 0.15, None, laminate(), CLAMPED).at(0.06, 0.07))),
        "thick plate": lambda: co(
            chain(), small(hl.mindlin_plate(0.1, 0.1, 4e-3, hl.ALUMINIUM_6061, CLAMPED).at(0.04, 0.05))
        ),
        "elastic edges": lambda: co(
            chain(),
            small(
                hl.kirchhoff_plate(
                    0.1,
                    0.1,
                    3e-3,
                    hl.ALUMINIUM_6061,
                    hl.Supports(hl.ElasticEdge(1e6, 1e2), "simple", "free", "clamped"),
                ).at(0.03, 0.05)
            ),
        ),
        "infinite plate": lambda: co(chain(), hl.infinite_plate(2e-3, hl.ALUMINIUM_6061)),
        "plate with one edge": lambda: co(chain(), hl.half_plane(2e-3, hl.ALUMINIUM_6061, "free", 0.02, UNTIL)),
        "disc": lambda: co(
            chain(),
            small(
                hl.kirchhoff_panel(
                    hl.Outline(hl.circle(0.05), edges=("rim",) * 96),
                    3e-3,
                    hl.ALUMINIUM_6061,
                    {"rim": "clamped"},
                    highest_frequency=2e4,
                ).at(0.01, 0.0)
            ),
        ),
        "thick disc": lambda: co(
            chain(),
            small(
                hl.mindlin_panel(
                    hl.Outline(hl.circle(0.05), edges=("rim",) * 96),
                    3e-3,
                    hl.ALUMINIUM_6061,
                    {"rim": "clamped"},
                    highest_frequency=2e4,
                ).at(0.01, 0.0)
            ),
        ),
        "own structure, Aitken": lambda: co(chain(), SpringMass(), scheme=hl.Aitken()),
        "fixed point": lambda: co(chain(), small(rod()), scheme=hl.FixedPoint()),
        "IQN-ILS": lambda: co(chain(), SpringMass(), scheme=hl.IQN_ILS()),
        "explicit": lambda: co(chain(), SpringMass(), scheme=hl.Explicit(tolerance=None)),
        "adaptive windows": lambda: co(chain(6), SpringMass(), hl.Aitken(), hl.Adaptive()),
        "quadratic waveform": lambda: co(chain(6), SpringMass(), hl.Aitken(), waveform="quadratic"),
        "Newmark": lambda: co(chain(), hl.stepping.MovingStructure(rod(), hl.stepping.Newmark)),
        "generalised alpha": lambda: co(chain(), hl.stepping.MovingStructure(rod(), hl.stepping.GeneralisedAlpha)),
        "central difference": lambda: co(chain(), hl.stepping.MovingStructure(rod(), hl.stepping.CentralDifference)),
        "piston": lambda: co(chain(striker=hl.Piston([0.0, 1e-4, 1.0], [0.0, 4e-5, 4e-5]), impact_speed=None), wall),
        "pushed bead": lambda: co(
            chain(striker=hl.PushedBead([0.0, 2e-5, 4e-5, 1.0], [0.0, 50.0, 0.0, 0.0]), impact_speed=None), wall
        ),
        "spring-loaded": lambda: co(chain(striker=hl.SpringLoaded(BEAD, 200.0, 5e-3), impact_speed=None), wall),
        "mixed chain": lambda: co(mixed(), wall),
        "law from a table": lambda: co(
            chain(law=hl.laws.TabulatedLaw(np.linspace(0.0, 4e-5, 400), 1e10 * np.linspace(0.0, 4e-5, 400) ** 1.5)),
            wall,
        ),
        "deformable beads": lambda: co(hl.DeformableChain([BEAD] * 8, BEAD, 0.44, modes=3), small(rod())),
        "two chains": two_chains,
        "between two plates": facing,
    }
    return found | {
        name: lambda loss=loss: co(chain(gravity=9.81, dissipation=loss), wall)  # type: ignore[misc]
        for name, loss in lossy.items()
    }


def numbers(case: hl.CoSimulation) -> dict[str, list[float]]:
    """What a run gave: forces by their largest value, sum and sum of squares; energies; AR and TOF."""
    run = case.run(until=UNTIL)
    found = {name: _moments(run[name].values) for name in sorted(run.data_vars) if run[name].dtype.kind == "f"}
    sensor = 4
    found["sensor force"] = _moments(hl.sensor_force(run, sensor).values)
    found["AR"] = np.atleast_1d(hl.amplitude_ratio(run, sensor)).tolist()
    found["TOF"] = np.atleast_1d(hl.time_of_flight(run, sensor)).tolist()
    found["energy error"] = np.atleast_1d(hl.energy_error(run)).tolist()
    return found


def _moments(values: np.ndarray) -> list[float]:
    """The largest and the least value, the root of the mean square, the mean, and four single values."""
    flat = values[np.isfinite(values)]
    if not flat.size:
        return []
    single = flat[:: max(1, flat.size // 4)][:4]
    return [float(one) for one in (flat.max(), flat.min(), np.sqrt(np.mean(flat**2)), flat.mean(), *single)]


def results(only: list[str] | None = None) -> Iterator[tuple[str, dict[str, list[float]]]]:
    """The numbers of each case, by its name."""
    for name, build in cases().items():
        if only is None or name in only:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                yield name, numbers(build())


UNITS = {
    "interface_mismatch": "interface_work",
    "structure_numerical_loss": "interface_work",
    "residual": "contact_force",
}
"""What remains where large numbers cancel is rounding; its unit is the size of those numbers."""


def differences(before: dict[str, list[float]], after: dict[str, list[float]]) -> dict[str, float]:
    """The largest difference of each quantity, in units of its largest number; infinite where one is missing.

    The energy error is relative already: its unit is 1. How many windows were tried is work, not a result.
    """
    found = {}
    for name, old in before.items():
        if name in ("evaluations", "substeps"):
            continue
        first, second = np.asarray(old), np.asarray(after.get(name, []))
        if first.shape != second.shape or not np.array_equal(np.isnan(first), np.isnan(second)):
            found[name] = float("inf")
        elif first.size:
            sized = before[UNITS.get(name, name)]
            unit = 1.0 if name == "energy error" else np.nanmax(np.abs(sized), initial=1e-300)
            found[name] = float(np.nanmax(np.abs(first - second), initial=0.0) / unit)
    return found


def main(command: str, path: str) -> int:
    if command == "record":
        lines = [f"{json.dumps(name)}: {json.dumps(found)}" for name, found in results()]
        Path(path).write_text("{\n" + ",\n".join(lines) + "\n}\n")
        print(f"{len(lines)} cases recorded in {path}")
        return 0
    before, worst, failed = json.loads(Path(path).read_text()), 0.0, 0
    for name, after in results():
        found = differences(before[name], after)
        quantity = max(found, key=lambda one: found[one])
        worst = max(worst, found[quantity])
        if found[quantity] > TOLERANCE:
            failed += 1
            print(f"{name}: {quantity} differs by {found[quantity]:.1e}")
    print(f"{len(before)} cases, {failed} differ by more than {TOLERANCE:g}; largest difference {worst:.1e}")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1] not in ("record", "compare"):
        sys.exit("usage: python tests/unchanged.py record|compare FILE")
    sys.exit(main(*sys.argv[1:]))
