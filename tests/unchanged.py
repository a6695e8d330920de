"""Results of some 60 short runs, to compare one state of the code with another to the last digits.

A change that moves code, or writes the same arithmetic in another place, must not change a result. Record the cases
before it and compare them after it, on the same machine, with the same libraries and as many threads:

    python tests/unchanged.py record before.json
    python tests/unchanged.py compare before.json

compare lists each case whose numbers differ by more than 1e-12 of their size, and then fails. Names after the file
choose cases by a part of their name. The reference file reference/unchanged.json was recorded on one machine;
test_unchanged.py compares with it, with a tolerance that other processors and libraries meet.
"""

import json
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import partial
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


def structures() -> dict[str, Callable[[], Any]]:
    """Builders of structures that one chain strikes, by name."""
    beam = partial(hl.beam, 0.4, 300.0, 1.6, hl.STEEL_316, 0.15)
    edge = partial(hl.half_plane, 2e-3, hl.ALUMINIUM_6061, distance=0.02, until=UNTIL)
    thick = partial(hl.mindlin_plate, 0.1, 0.1, 4e-3, hl.ALUMINIUM_6061)
    return {
        "beam": beam,
        "prestressed beam": lambda: beam(supports=("clamped", "free"), axial_force=2e3, foundation=1e6),
        "free rod": lambda: small(hl.rod(LAYERS, base="free", elements=80)),
        "simple edge": lambda: edge(edge="simple"),
        "clamped edge": lambda: edge(edge="clamped"),
        "plate of cells": lambda: small(plate(cells=(12, 9)).at(0.05, 0.05)),
        # Off the line of symmetry. On it, motions that the contact does not reach enter the reduction by rounding, and
        # the last vectors, with displacements to 2e-5, depend on the machine.
        "thick plate with mass": lambda: small(
            thick(hl.Supports("clamped"), additions=[hl.PointMass(0.05, 0.05, 0.05)]).at(0.04, 0.053)
        ),
        "laminate without edges": lambda: hl.infinite_plate(None, laminate()),
        "plate of modes": lambda: hl.ModalPlate(plate(), UNTIL).at(
            0.05, 0.07, thickness=4e-3, material=hl.Material(1e11, 0.33, 8500.0)
        ),
    }


def cases() -> dict[str, Callable[[], hl.CoSimulation]]:
    """Builders of the runs, by name."""
    co, wall = hl.CoSimulation, hl.half_space(hl.STEEL_440C)
    lossy = {
        "linear dashpot": hl.LinearDashpot(4.0),
        "power dashpot": hl.PowerDashpot(50.0, 1.3),
        "drag": hl.MassProportional(300.0),
        "Kuwabara and Kono": hl.KuwabaraKono(1e-6),
        "Tsuji": hl.Tsuji(0.1),
        "restitution": hl.Restitution(0.9),
    }
    found: dict[str, Callable[[], hl.CoSimulation]] = {
        "wall": lambda: co(chain(), wall),
        "free end": lambda: co(chain(), None),
        "gravity and preload": lambda: co(chain(gravity=9.81, preload=2.0), wall),
        "layered rod": lambda: co(chain(gravity=9.81), rod()),
        "layered rod, reduced": lambda: co(chain(gravity=9.81), small(rod())),
        "absorbing rod": lambda: co(chain(), hl.rod(LAYERS, base="absorbing")),
        "rod with Rayleigh damping": lambda: co(chain(), hl.damping.damped(rod(), hl.damping.Rayleigh(100.0, 1e-7))),
        "modal damping": lambda: co(chain(), hl.damping.damped(small(rod()), hl.damping.Modal(0.02))),
        "viscous rod": lambda: co(chain(), small(hl.damping.damped(rod(), hl.damping.StandardLinearSolid(0.5, 2e-5)))),
        "layered cylinder": lambda: co(chain(), small(hl.layered_cylinder(LAYERS))),
        "cube": lambda: co(chain(), small(of_cubes())),
        "thin plate": lambda: co(chain(), small(plate().at(0.05, 0.07))),
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
        "thick disc": lambda: co(
            chain(),
            small(
                hl.mindlin_panel(
                    hl.Outline(hl.circle(0.05), edges=("rim",) * 96), 3e-3, hl.ALUMINIUM_6061, {"rim": "clamped"},
                    highest_frequency=2e4,
                ).at(0.01, 0.0)
            ),
        ),
        "own structure, Aitken": lambda: co(chain(), SpringMass(), scheme=hl.Aitken()),
        "IQN-ILS": lambda: co(chain(), SpringMass(), scheme=hl.IQN_ILS()),
        "explicit": lambda: co(chain(), SpringMass(), scheme=hl.Explicit(tolerance=None)),
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
    }  # fmt: skip
    found |= {
        f"chain of {name}": lambda bead=bead: co(hl.Chain([bead] * 10, bead, 0.3), wall)  # type: ignore[misc]
        for name, bead in {
            "hollow spheres": hl.HollowSphere(9.525e-3, 8.655e-3, hl.STEEL_316),
            "ellipsoids across": hl.Ellipsoid(4e-3, 12e-3, hl.BRASS_360, angle=0.4),
            "ellipsoids along": hl.Ellipsoid(4e-3, 12e-3, hl.MATERIALS["copper"], axis="along"),
            "polymer": hl.Sphere(4.76e-3, hl.MATERIALS["nylon"]),
        }.items()
    }
    found |= {
        f"chain with {name}": lambda changes=changes: co(chain(**changes), wall)  # type: ignore[misc]
        for name, changes in {
            "power law": {"law": hl.laws.PowerLaw(2e9, 1.4)},
            "Thornton": {"law": hl.laws.Thornton(1e9)},
            "Jackson and Green": {"law": hl.laws.JacksonGreen(1e9), "impact_speed": 0.7},
            "inclination": {"gravity": 9.81, "inclination": 0.3},
            "no striker": {"striker": None},
            "soft piston": {
                "striker": hl.Piston([0.0, 1e-4, 1.0], [0.0, 2e-5, 0.0], hl.Surface(hl.PTFE, 50.0)),
                "impact_speed": None,
            },
        }.items()
    }
    found |= {
        f"plate with {name}": lambda addition=addition: co(  # type: ignore[misc]
            chain(), small(plate(additions=[addition]).at(0.07, 0.07))
        )
        for name, addition in {
            "mass": hl.PointMass(0.1, 0.1, 0.02),
            "weak spot": hl.Weakened((0.05, 0.08, 0.05, 0.08), 0.5),
            "stiffener": hl.Stiffener((0.02, 0.05), (0.18, 0.05), 10.0, 2.0, 0.1),
            "prestress": hl.Prestress(2e4, -1e4, 5e3),
        }.items()
    }
    found |= {
        f"against {name}": lambda build=build: co(chain(), build())  # type: ignore[misc]
        for name, build in structures().items()
    }
    found |= {
        f"rod by {name}": lambda changes=changes: co(chain(8), small(rod()), **changes)  # type: ignore[misc]
        for name, changes in {
            "screening": {"accuracy": "screening"},
            "reference": {"accuracy": "reference"},
            "short windows": {"window": 2.5e-7},
            "steps": {"window": 1.25e-7},
            "extrapolation": {"scheme": hl.Explicit(predictor=2, tolerance=None)},
            "strict condensation": {"scheme": hl.Condensed(1e-12)},
        }.items()
    }
    return found | {
        name: lambda loss=loss: co(chain(gravity=9.81, dissipation=loss), wall)  # type: ignore[misc]
        for name, loss in lossy.items()
    }


def numbers(case: hl.CoSimulation) -> dict[str, list[float]]:
    """The numbers of a run: forces by their largest value, sum and sum of squares; energies; AR and TOF."""
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


def results(parts: Iterable[str] = ("",)) -> Iterator[tuple[str, dict[str, list[float]]]]:
    """The numbers of each case whose name has one of these parts."""
    for name, build in cases().items():
        if any(part in name for part in parts):
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
        if name in ("evaluations", "windows"):
            continue
        first, second = np.asarray(old), np.asarray(after.get(name, []))
        if first.shape != second.shape or not np.array_equal(np.isnan(first), np.isnan(second)):
            found[name] = float("inf")
        elif first.size:
            sized = before.get(UNITS.get(name, name), old)
            unit = 1.0 if name == "energy error" else np.nanmax(np.abs(sized), initial=1e-300)
            found[name] = float(np.nanmax(np.abs(first - second), initial=0.0) / unit)
    return found


def main(command: str, path: str, *parts: str) -> int:
    if command == "record":
        lines = [f"{json.dumps(name)}: {json.dumps(found)}" for name, found in results(parts or ("",))]
        Path(path).write_text("{\n" + ",\n".join(lines) + "\n}\n")
        print(f"{len(lines)} cases recorded in {path}")
        return 0
    before, worst, count, failed = json.loads(Path(path).read_text()), 0.0, 0, 0
    for name, after in results(parts or ("",)):
        if name not in before:
            print(f"{name}: is not recorded")
            continue
        found, count = differences(before[name], after), count + 1
        quantity = max(found, key=lambda one: found[one])
        worst = max(worst, found[quantity])
        if found[quantity] > TOLERANCE:
            failed += 1
            print(f"{name}: {quantity} differs by {found[quantity]:.1e}")
    print(f"{count} cases, {failed} differ by more than {TOLERANCE:g}; largest difference {worst:.1e}")
    return 1 if failed else 0


if __name__ == "__main__":
    if len(sys.argv) < 3 or sys.argv[1] not in ("record", "compare"):
        sys.exit("usage: python tests/unchanged.py record|compare FILE [PART OF A NAME ...]")
    sys.exit(main(*sys.argv[1:]))
