"""Results of about 140 short cases, to compare one state of the code with another to the last digits.

A change that moves code, or writes the same arithmetic in another place, must not change a result. Record the cases
before it and compare them after it, on the same machine, with the same libraries and as many threads:

    python tests/unchanged.py record before.json
    python tests/unchanged.py compare before.json

compare lists each case whose numbers differ by more than 1e-12 of their size, and then fails. Names after the file
choose cases by a part of their name. The reference file reference/unchanged.json holds the runs of `cases`, recorded
on one machine; test_unchanged.py compares with it, with a tolerance that other processors and libraries meet. What is
in `other_results` takes minutes, so only this script computes it.
"""

import json
import os
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import redirect_stderr, redirect_stdout, suppress
from functools import cache, partial
from io import StringIO
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.cases.case import Case
from hertzlink.cases.templates import KINDS
from hertzlink.cli import main as hertzlink
from plates.section import homogeneous_section

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
    held = {"rim": "clamped"}
    square = hl.Outline(
        ((0.0, 0.0), (0.1, 0.0), (0.1, 0.1), (0.0, 0.1)),
        holes=(tuple(reversed(hl.circle(0.01, (0.07, 0.07), 24))),),
        edges="rim",
    )
    beam = partial(hl.beam, 0.4, 300.0, 1.6, hl.STEEL_316, 0.15)
    edge = partial(hl.half_plane, 2e-3, hl.ALUMINIUM_6061, distance=0.02, until=UNTIL)
    thick = partial(hl.mindlin_plate, 0.1, 0.1, 4e-3, hl.ALUMINIUM_6061)
    return {
        "beam": beam,
        "prestressed beam": lambda: beam(supports=("clamped", "free"), axial_force=2e3, foundation=1e6),
        "free rod": lambda: small(hl.rod(LAYERS, base="free", elements=80)),
        "simple edge": lambda: edge(edge="simple"),
        "clamped edge": lambda: edge(edge="clamped"),
        "soft simple edges": lambda: small(thick(hl.Supports("soft simple", "simple")).at(0.04, 0.05)),
        "quarter of a plate": lambda: small(
            hl.kirchhoff_plate(
                0.1, 0.1, 3e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "symmetry", "clamped", "symmetry")
            ).at(0.1, 0.1)
        ),
        "plate of cells": lambda: small(plate(cells=(12, 9)).at(0.05, 0.05)),
        # Off the line of symmetry. On it, motions that the contact does not reach enter the reduction by rounding, and
        # the last vectors, with displacements to 2e-5, depend on the machine.
        "thick plate with mass": lambda: small(
            thick(hl.Supports("clamped"), additions=[hl.PointMass(0.05, 0.05, 0.05)]).at(0.04, 0.053)
        ),
        "thick laminate": lambda: small(
            hl.mindlin_plate(0.1, 0.1, None, laminate(), hl.Supports("clamped")).at(0.04, 0.05)
        ),
        "back of a panel": lambda: small(
            hl.mindlin_panel(square, 3e-3, hl.BRASS_360, held, highest_frequency=2e4).at(0.03, 0.03, face="back")
        ),
        "laminate without edges": lambda: hl.infinite_plate(None, laminate()),
        "section": lambda: small(
            hl.kirchhoff_plate(0.2, 0.15, None, homogeneous_section(2e-3, hl.MATERIALS["polycarbonate"]), CLAMPED).at(
                0.06, 0.07
            )
        ),
        "plate of modes": lambda: hl.ModalPlate(plate(), UNTIL).at(
            0.05, 0.07, thickness=4e-3, material=hl.Material(1e11, 0.33, 8500.0)
        ),
        "structural loss": lambda: hl.damped(small(rod()), hl.damping.Modal(0.025)),
    }


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
    }
    found |= {
        f"chain of {name}": lambda bead=bead: co(hl.Chain([bead] * 10, bead, 0.3), wall)  # type: ignore[misc]
        for name, bead in {
            "hollow spheres": hl.HollowSphere(9.525e-3, 8.655e-3, hl.STEEL_316),
            "ellipsoids across": hl.Ellipsoid(4e-3, 12e-3, hl.BRASS_360, angle=0.4),
            "ellipsoids along": hl.Ellipsoid(4e-3, 12e-3, hl.MATERIALS["copper"], axis="along"),
            "polymer": hl.Sphere(4.76e-3, hl.NYLON),
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
            "extrapolation": {"scheme": hl.Explicit(predictor=2, parallel=True, tolerance=None)},
            "strict condensation": {"scheme": hl.Condensed(1e-12)},
        }.items()
    }
    found |= {
        f"deformable beads with {name}": lambda loss=loss: co(  # type: ignore[misc]
            hl.DeformableChain(
                [hl.Sphere(4.76e-3, hl.PTFE)] * 6, hl.Sphere(4.76e-3, hl.PTFE), 0.3, modes=4, damping=loss
            ),
            wall,
        )
        for name, loss in {
            "modal damping": hl.damping.Modal(0.05),
            "Rayleigh damping": hl.damping.Rayleigh(100.0, 1e-8),
            "relaxation": hl.damping.StandardLinearSolid(0.4, 2e-5, "instantaneous"),
        }.items()
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


def other_numbers(values: Mapping[str, Any]) -> dict[str, list[float]]:
    """Short results as they are, long ones by moments."""
    flat = {name: np.ravel(np.asarray(value, dtype=float)) for name, value in values.items()}
    return {name: list(map(float, value)) if value.size <= 8 else _moments(value) for name, value in flat.items()}


def results(parts: Iterable[str] = ("",)) -> Iterator[tuple[str, dict[str, list[float]]]]:
    """The numbers of each case whose name has one of these parts."""
    tasks: dict[str, Callable[[], dict[str, list[float]]]] = {
        name: lambda build=build: numbers(build())  # type: ignore[misc]
        for name, build in cases().items()
    }
    tasks |= {name: lambda one=one: other_numbers(one()) for name, one in other_results().items()}  # type: ignore[misc]
    for name, task in tasks.items():
        if any(part in name for part in parts):
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                try:
                    found = task()
                except (AttributeError, TypeError, ValueError) as error:
                    print(f"{name}: {type(error).__name__}: {error}")
                    found = {}
                yield name, found


OTHERS: dict[str, Callable[[], Mapping[str, Any]]] = {}
"""Functions that compute other results than those of one run, by name."""


def other(function: Callable[[], Mapping[str, Any]]) -> Callable[[], Mapping[str, Any]]:
    OTHERS[function.__name__.replace("_", " ")] = function
    return function


@other
def closed_forms() -> Mapping[str, Any]:
    theory = hl.theory
    mass, stiffness, thin = BEAD.mass, 1e10, plate()
    row = theory.UniformChain(BEAD.size, mass, stiffness)
    return {
        "dispersion": row.angular_frequency(100.0, preload=5.0),
        "cutoff": row.cutoff_frequency(5.0),
        "sound": row.sound_speed(5.0),
        "strain": row.strain(1e-3, 1e-6, 600.0),
        "tangent": row.tangent_stiffness(5.0),
        "from striker": row.transit_time(20, 0.3, 0.9),
        "from force": row.wave_speed_from_force(50.0, preload=3.0),
        "from speed": row.wave_speed_from_particle_speed(0.3),
        "width": row.width,
        "Hertz": [
            theory.hertz_pressure(BEAD.surface, hl.Surface(hl.PTFE), 10.0),
            theory.hertz_stiffness(hl.Cylinder(2e-3, 4e-3, hl.PTFE).surface, BEAD.surface, "approximate"),
            theory.yield_pressure(hl.Material(2e11, 0.3, 7800.0, yield_strength=1e9)),
        ],
        "Zener": [theory.zener_contact_time(0.4), theory.zener_restitution(0.4)],
        "layers": [
            theory.primary_amplitude_ratio(0.6),
            theory.layer_stiffness(2e11, 1e-4, 0.05),
            theory.characteristic_length(5000.0, 4e-5),
            theory.hertz_contact_time(mass, stiffness, 0.3),
            theory.critical_modulus(hl.STEEL_440C),
            theory.layer_restitution(mass, 8e-3),
            theory.secondary_delay(8e-3, 4e-3, 1e7),
            theory.primary_time_of_flight(14, mass, stiffness, 5e9, 0.3, 0.8),
        ],
        "impact": [
            theory.primary_amplitude_ratio(theory.zener_restitution(0.3)),
            theory.PlateImpact(BEAD, thin, 0.3).contact_time,
            theory.PlateImpact(BEAD, thin, 0.3).inelasticity,
            theory.PlateImpact(BEAD, thin, 0.3).time_of_flight(14) / BEAD.size,
            thin.point_impedance,
            hl.drop_speed(0.01),
        ],
        "laminates": theory.indentation_modulus(theory.orthotropic_stiffness([9e10] * 3, [0.3] * 3, [4e9] * 3)),
        "edge": hl.critical_distance_bounds(BEAD, thin, 0.3),
        "law of the edge": hl.critical_distance_law(
            BEAD, hl.kirchhoff_plate(0.5, 0.5, 2e-3, hl.ALUMINIUM_6061, CLAMPED), 0.3
        ),
    }


@other
def laws() -> Mapping[str, Any]:
    law, ball = hl.laws.computed_law, hl.Sphere(4.76e-3, hl.PTFE)
    lying = hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316)
    computed = {
        "axisymmetric": law(ball, max_force=20.0, spacing=4e-5),
        "chosen": law(hl.HollowSphere(9.5e-3, 8.6e-3, hl.STEEL_316), max_force=10.0),
        "formula": hl.contact_law(lying, BEAD),
    }
    return {name: [law.force(x) for x in (2e-7, 5e-7, 1e-6)] for name, law in computed.items()}


@cache
def struck() -> xr.Dataset:
    """A run with noise-free waves that measures and pictures read."""
    return hl.CoSimulation(chain(14, dissipation=hl.LinearDashpot(5.0)), rod()).run(until=1.2e-3)


@cache
def noisy(seed: int = 1) -> xr.Dataset:
    """A measured tap, late and noisy."""
    run = struck()
    time, random = np.arange(0.0, 1.2e-3, 1e-6), np.random.default_rng(seed)
    force = {n: np.interp(time - 5e-5, run.time, hl.sensor_force(run, n), left=0.0) for n in (5, 9)}
    return hl.as_signal(time, {n: one + random.normal(0.0, 0.3, time.size) for n, one in force.items()})


def waves(run: xr.Dataset, sensor: int) -> list[float]:
    """The three waves at a sensor."""
    found = [one for one in hl.reflections(run, sensor) if hasattr(one, "amplitude")]
    return [float(getattr(one, name)) for one in found for name in ("amplitude", "arrival")]


@other
def measures() -> Mapping[str, Any]:
    run, tap = struck(), noisy()
    sensor = hl.SensorModel(time_constant=1e-3, bandwidth=1e5)
    return {
        "waves": [*waves(run, 5), *waves(run, 9)],
        "secondary": [hl.amplitude_ratio(run, 5, "secondary"), hl.time_of_flight(run, 5, "secondary")],
        "measured": [*waves(tap, 5), hl.amplitude_ratio(tap, 9), hl.time_of_flight(tap, 9)],
        "speed": [hl.wave_speed(run, 4, 8), hl.contact_time(run)],
        **dataset("event", hl.contact_events(run)),
        **dataset("conditioned", hl.clean_signal(tap)),
        **dataset("average", hl.average_taps([noisy(seed) for seed in (1, 2, 3)])),
        **dataset("as seen by a sensor", sensor.apply(run, [5, 9])),
        **dataset("motion", hl.plots.motion(*shown(), np.linspace(1e-4, 3e-4, 4))),
    }


def shown() -> tuple[xr.Dataset, hl.Structure]:
    """A run and a structure that keeps its field."""
    body = hl.reduce(hl.layered_cylinder(LAYERS), until=4e-4, keep_field=True)
    return hl.CoSimulation(chain(3), body).run(4e-4), body


@other
def sweeps() -> Mapping[str, Any]:
    def near(distance: float, speed: float = 0.3) -> hl.CoSimulation:
        body = hl.half_plane(2e-3, hl.ALUMINIUM_6061, "clamped", distance, 6e-4)
        return hl.CoSimulation(chain(12, impact_speed=speed), body)

    def both(run: xr.Dataset) -> xr.Dataset:
        return xr.Dataset({"AR": hl.amplitude_ratio(run, 5), "TOF": hl.time_of_flight(run, 5)})

    scan = np.linspace(5e-3, 50e-3, 6)
    swept = hl.sweep(near, 6e-4, jobs=1, measure=both, distance=scan, speed=[0.2, 0.4])
    return {
        **dataset("sweep", swept),
        "critical": hl.critical_distance(swept.AR.sel(speed=0.4)),
        **dataset("search", hl.critical_distance_search(near, 6e-4, 5, scan, jobs=1)),
        **dataset("batch", hl.batch(near, 6e-4, save_every=2e-6, distance=[0.01, 0.02])),
    }


@other
def identification() -> Mapping[str, Any]:
    def facing(modulus: float, impact_speed: float = 0.31) -> hl.CoSimulation:
        return hl.CoSimulation(chain(10, impact_speed=impact_speed), hl.half_space(hl.Material(modulus, 0.3, 2000.0)))

    run = facing(3e9, 0.3).run(5e-4, save_every=5e-7)
    time, random = np.arange(0.0, 5.8e-4, 1e-6), np.random.default_rng(3)
    force = {n: np.interp(time - 8e-5, run.time, hl.sensor_force(run, n), left=0.0) for n in (4, 7)}
    tap = hl.as_signal(time, {n: 1.3 * one + random.normal(0.0, 0.5, time.size) for n, one in force.items()})
    ranges = {"modulus": (1e9, 20e9), "impact_speed": (0.2, 0.5)}
    common = {"until": 5e-4, "scan": 16, "starts": 2, "nuisances": ["gain", "time_zero", "impact_speed"]}
    fit = hl.identify(tap, facing, **common, **ranges)
    found = {f"waveform {name}": [one.value, *one.interval] for name, one in fit.unknowns.items()}
    design = hl.identifiability(facing, 0.02, [4, 7], 5e-4, modulus=3e9, impact_speed=0.3)
    return {
        **found,
        "misfit": [fit.misfit],
        "information": [design.bounds[name] for name in sorted(design.bounds)],
    }


@other
def pictures() -> Mapping[str, Any]:
    from matplotlib import pyplot

    run, found = struck(), {}
    for name in ("traces", "contact_map", "energy", "setup"):
        ax = getattr(hl.plots, name)(run)
        lines = [np.ravel(line.get_xydata()) for line in ax.lines]
        lines += [np.ravel(one.get_offsets()) for one in ax.collections] + [[len(ax.patches), len(ax.texts)]]
        found |= {f"{name} {n}": line for n, line in enumerate(lines)}
        pyplot.close("all")
    return found


def part(kind: str, **entries: Any) -> dict[str, Any]:
    """A table of a case file with a kind."""
    return {"kind": kind, **entries}


STEEL, SQUARE = {"material": "steel 440C"}, ["40 mm", "80 mm", "50 mm", "90 mm"]
ROD = {
    "chain": {
        "beads": 10,
        "bead": {"shape": "sphere", "diameter": "9.53 mm", **STEEL},
        "impact_speed": "0.3 m/s",
    },
    "structure": part("rod", layers=[{"material": "PTFE", "length": "25.4 mm", "diameter": "19 mm"}]),
    "run": {"until": "0.8 ms"},
}
STEPS = [
    {"length": "10 mm", "diameter": "19 mm", **STEEL},
    {"length": "60 mm", "diameter": "19 mm", **STEEL},
]


def rectangle(kind: str = "kirchhoff_plate", left: Any = "clamped", **entries: Any) -> dict[str, Any]:
    """A rectangular plate of a case file."""
    size = {"length": "200 mm", "width": "150 mm", "thickness": "3 mm", "material": "brass 360"}
    return part(kind, **size, supports={"left": left, "top": "simple"}, at=["50 mm", "70 mm"], **entries)


def entries() -> dict[str, dict[str, Any]]:
    """Changes of the case ROD, by the name of what they try; None removes an entry."""
    body = {"diameter": "9.53 mm", **STEEL}
    crossed = [{"shape": "cylinder", "length": "9 mm", "angle": f"{angle} deg", **body} for angle in (0, 90) * 4]
    moved = {
        "spring": part("spring_loaded", stiffness="200 N/m", compression="5 mm"),
        "push": part("pushed_bead", time=[0.0, 2e-5, 4e-5, 1.0], force=["0 N", "50 N", "0 N", "0 N"]),
        "piston": part("piston", time=["0 s", "0.1 ms", "1 s"], displacement=["0 m", "40 um", "40 um"]),
    }
    losses = {
        "linear dashpot": part("linear_dashpot", coefficient="4 N s/m"),
        "power dashpot": part("power_dashpot", coefficient=50.0, exponent=1.3),
        "drag": part("mass_proportional", rate=300.0),
        "Kuwabara and Kono": part("kuwabara_kono", time="1 us"),
        "Tsuji": part("tsuji", coefficient=0.1),
        "restitution": part("restitution", coefficient=0.9),
    }
    table = {"approaches": ["0 m", "10 um", "20 um", "40 um"], "forces": ["0 N", "200 N", "600 N", "2 kN"]}
    laws = {
        "power law": part("power_law", stiffness=2e9, exponent=1.4),
        "table": part("tabulated_law", **table),
        "numerical law": part("numerical", max_force="200 N"),
        "Thornton": part("thornton", yield_strength="1 GPa"),
        "Jackson and Green": part("jackson_green", yield_strength="1 GPa"),
    }
    damping = {
        "Rayleigh": part("rayleigh", mass_rate=100.0, stiffness_time="0.1 us"),
        "relaxation": part("standard_linear_solid", share=0.5, time="20 us", layer=0),
    }
    modes = {"modal": part("modal", ratio=0.02), "loss factor": part("loss_factor", factor=0.05)}
    additions = {
        "mass": part("point_mass", at=["90 mm", "90 mm"], mass="20 g"),
        "rib": part("stiffener", start=["20 mm", "50 mm"], end=["180 mm", "50 mm"], bending_stiffness="10 N m^2"),
        "weak spot": part("weakened", region=SQUARE, factor=0.5),
        "stress": part("prestress", xx="20 kN/m", xy="-5 kN/m"),
    }
    bodies = {
        "half-space": part("half_space", **STEEL),
        "nothing": part("nothing"),
        "cylinder": part("layered_cylinder", layers=STEPS[:1], cells=3),
        "beam": part(
            "beam", length="0.4 m", bending_stiffness="300 N m^2", mass_per_length="1.6 kg/m", at="0.15 m",
            supports=["clamped", "free"], axial_force="2 kN", foundation="1e6 N/m^2", **STEEL,
        ),
        "plate": rectangle(),
        "elastic edge": rectangle(left={"translation": 1e6, "rotation": 1e2}),
        "thick plate": rectangle("mindlin_plate", highest_frequency="20 kHz"),
        "thick panel": part(
            "mindlin_panel", corners=[["0 m", "0 m"], ["0.1 m", "0 m"], ["0 m", "0.1 m"]], thickness="4 mm",
            at=["30 mm", "30 mm"], highest_frequency="20 kHz", **STEEL,
        ),
        "edge": part("half_plane", thickness="2 mm", edge="free", distance="20 mm", **STEEL),
        "no edge": part("infinite_plate", thickness="2 mm", **STEEL),
    }  # fmt: skip
    found: dict[str, dict[str, Any]] = {
        "repeat": {"chain.repeat": 2},
        "drop": {
            "chain.impact_speed": None, "chain.drop_height": "4 mm", "chain.gravity": 9.81,
            "chain.inclination": "40 deg",
        },
        "preload": {"chain.preload": "2 N"},
        "hollow beads": {"chain.bead": {"shape": "hollow_sphere", "inner_radius": "4 mm", **body}},
        "ellipsoids": {"chain.bead": {"shape": "ellipsoid", "length": "12 mm", "axis": "along", "angle": 0.3, **body}},
        "crossed cylinders": {"chain.beads": crossed},
        "deformable": {"chain.modes": 3, "chain.damping": part("modal", ratio=0.05)},
        "Aitken": {"run.scheme": part("aitken", tolerance=1e-10), "run.reduce": False},
        "explicit": {"run.scheme": part("explicit", predictor=1), "run.window": "62.5 ns", "run.save_every": "2 us"},
        "screening": {"run.accuracy": "screening", "run.reduce": {"tolerance": 0.1, "largest": 40}},
    }  # fmt: skip
    found |= {name: {"chain.striker": one, "chain.impact_speed": None} for name, one in moved.items()}
    found |= {name: {"chain.dissipation": one} for name, one in losses.items()}
    found |= {name: {"chain.law": one} for name, one in laws.items()}
    found |= {f"damped rod, {name}": {"structure.damping": [one]} for name, one in damping.items()}
    found |= {f"damped plate, {name}": {"structure": rectangle(damping=[one])} for name, one in modes.items()}
    found |= {f"plate with {name}": {"structure": rectangle(additions=[one])} for name, one in additions.items()}
    return found | {name: {"structure": one} for name, one in bodies.items()}


def of_case(changes: Mapping[str, Any]) -> Mapping[str, Any]:
    """A run of the case ROD with some entries changed."""
    left = {name for name, value in changes.items() if value is None}
    chain = {name: value for name, value in ROD["chain"].items() if f"chain.{name}" not in left}
    case = Case(ROD | {"chain": chain}).changed({name: one for name, one in changes.items() if name not in left})
    return dataset("", case.run())


def commanded(*lines: str) -> Mapping[str, Any]:
    """The numbers in the netCDF file that commands write into the folder out; what they print is hidden."""
    here = Path.cwd()
    with TemporaryDirectory() as folder:
        os.chdir(folder)
        try:
            for line in lines:
                with redirect_stdout(StringIO()), redirect_stderr(StringIO()), suppress(SystemExit):
                    hertzlink(line.split())
            (file,) = Path("out").glob("*.nc")
            with xr.open_dataset(file, engine="h5netcdf") as data:
                return dataset("", data.load())
        finally:
            os.chdir(here)


STUDIES = (
    "rod-length", "ellipsoids", "deformable-chain", "hollow-spheres",
    "dissipation", "yield", "cylinders", "lower-layer", "aspect-ratio", "rod-stiffness",
)  # fmt: skip
"""Studies whose quick versions take seconds."""


def other_results() -> dict[str, Callable[[], Mapping[str, Any]]]:
    """All results but those of single runs, by name."""
    found = dict(OTHERS)
    found |= {f"case: {name}": partial(of_case, changes) for name, changes in entries().items()}
    found |= {
        f"template: {kind}": partial(commanded, f"new {kind} t.toml", "run t.toml --output out")
        for kind in KINDS
        if kind != "identify"
    }
    found["template: identify"] = partial(commanded, "new identify t.toml", "identify t.toml t.csv --output out")
    return found | {
        f"study: {name}": partial(commanded, f"study {name} --quick --jobs 1 --output out") for name in STUDIES
    }


def dataset(prefix: str, data: xr.Dataset) -> dict[str, Any]:
    """The numbers of a Dataset, by name."""
    found = {f"{prefix} {name}".strip(): data[name].values for name in sorted(map(str, data.variables))}
    return {name: values for name, values in found.items() if values.dtype.kind in "fi" and "time_taken" not in name}


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
