"""Stress in a plate, a strip and a rail: what it changes in the returned wave, and how well one trace gives it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.sweeps.progress import watched
from hertzlink.studies import draw
from hertzlink.studies.pressure import NOISE, bound
from hertzlink.studies.table import Row
from particles.bead import Sphere
from particles.chain import Chain
from plates.beam import beam
from plates.builders import kirchhoff_plate
from plates.prestress import Prestress
from plates.support import Supports
from structures.caution import collected
from structures.material import ALUMINIUM_6061, STEEL_440C, Material
from structures.reduction import reduce
from structures.structure import Structure

SENSOR, BEADS, IMPACT_SPEED = 10, 20, 0.31
HAMMER = 2.8
"""K: the error of the neutral temperature of rails that is reported for tests with a hammer."""


TOLERANCE = 1e-4
"""Of reductions: with the usual one the basis changes with the stress by so much that bounds change by 50 %."""

BLIND = 1000.0
"""K, an error beyond which a trace holds nothing of the temperature."""


@dataclass(frozen=True)
class Body:
    """A body under stress. stress_of_kelvin: Pa of a fall by 1 K where it is held. near: stress of the bound, Pa."""

    name: str
    diameter: float
    until: float
    stresses: tuple[float, ...]
    stress_of_kelvin: float
    near: float
    make: Callable[[float, float], Structure]
    """Of the stress, Pa, and of a factor of the bending stiffness, which is not known either."""


def _plate(stress: float, factor: float) -> Structure:
    """An aluminium membrane of 80 × 80 × 1 mm, clamped all around."""
    thickness = 1e-3
    held = Supports("clamped", "clamped", "clamped", "clamped")
    inside = Prestress(xx=stress * thickness, yy=stress * thickness)
    material = _stiffer(ALUMINIUM_6061, factor)
    whole = kirchhoff_plate(0.08, 0.08, thickness, material, held, additions=[inside], highest_frequency=5e4)
    return reduce(whole.at(0.04, 0.04), until=PLATE_RECORD, tolerance=TOLERANCE)


def _strip(stress: float, factor: float) -> Structure:
    """An aluminium strip of 60 × 10 × 3 mm, clamped at both ends."""
    area, inertia = 10e-3 * 3e-3, 10e-3 * 3e-3**3 / 12.0
    bending = factor * ALUMINIUM_6061.youngs_modulus * inertia
    heavy = ALUMINIUM_6061.density * area
    whole = beam(0.06, bending, heavy, ALUMINIUM_6061, 0.03, ("clamped", "clamped"), stress * area)
    return reduce(whole, until=PLATE_RECORD, tolerance=TOLERANCE)


RAIL_AREA, RAIL_INERTIA, RAIL_MASS = 76.7e-4, 512.3e-8, 60.2
"""m², m⁴ (sideways) and kg/m of the profile 60E1 of EN 13674-1."""

RAIL_SPAN = 3.0
"""m of rail between ends that are held far away; its waves do not return from there within the record."""

PLATE_RECORD, RAIL_RECORD = 1.2e-3, 4e-3
"""s."""


def _rail(stress: float, factor: float) -> Structure:
    """A rail struck sideways with large beads, on 20 MN/m² of elastic ground."""
    bending = factor * RAIL_STEEL.youngs_modulus * RAIL_INERTIA
    whole = beam(
        RAIL_SPAN, bending, RAIL_MASS, RAIL_STEEL, 0.5 * RAIL_SPAN, ("clamped", "clamped"), stress * RAIL_AREA, 2e7,
        2e4,
    )  # fmt: skip
    return reduce(whole, until=RAIL_RECORD, tolerance=TOLERANCE)


RAIL_STEEL = Material(210e9, 0.3, 7850.0, "rail steel", 5e8)
EXPANSIONS = {"aluminium": 23.6e-6, "steel": 11.5e-6}
"""1/K."""

MEGA = 1e6
BODIES = (
    Body(
        "plate 80 × 80 × 1 mm",
        4.76e-3,
        PLATE_RECORD,
        tuple(MEGA * np.array([-30.0, -20.0, -10.0, 0.0, 10.0, 20.0])),
        ALUMINIUM_6061.youngs_modulus * EXPANSIONS["aluminium"] / (1.0 - ALUMINIUM_6061.poisson_ratio),
        10e6,
        _plate,
    ),
    Body(
        "strip 60 × 10 × 3 mm",
        4.76e-3,
        PLATE_RECORD,
        tuple(MEGA * np.array([-30.0, -20.0, -10.0, 0.0, 10.0, 20.0])),
        ALUMINIUM_6061.youngs_modulus * EXPANSIONS["aluminium"],
        10e6,
        _strip,
    ),
    Body(
        "rail 60E1",
        19.05e-3,
        RAIL_RECORD,
        tuple(MEGA * np.array([-100.0, -50.0, 0.0, 50.0, 100.0])),
        RAIL_STEEL.youngs_modulus * EXPANSIONS["steel"],
        50e6,
        _rail,
    ),
)


def _stiffer(material: Material, factor: float) -> Material:
    return Material(factor * material.youngs_modulus, material.poisson_ratio, material.density, material.name)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """AR and TOF over the stress, and the least error of a stress that is read from one trace.

    quick: three stresses of each body. jobs: always one process.
    """
    with collected():  # that aluminium yields under steel beads is the study of yield's
        return xr.concat([_measured(one, quick) for one in watched(BODIES)], "body").assign_coords(
            body=[one.name for one in BODIES]
        )


def _measured(body: Body, quick: bool) -> xr.Dataset:
    bead = Sphere(0.5 * body.diameter, STEEL_440C)

    def at(stress: float, bending: float, impact_speed: float) -> CoSimulation:
        return CoSimulation(Chain([bead] * BEADS, bead, impact_speed), body.make(stress, bending))

    stresses = body.stresses[::2] if quick else body.stresses
    runs = [at(stress, 1.0, IMPACT_SPEED).run(body.until) for stress in stresses]
    ratio = [float(amplitude_ratio(one, SENSOR)) for one in runs]
    flight = [float(time_of_flight(one, SENSOR)) for one in runs]
    bounds = [bound(at, body.near, part, body.until, SENSOR, IMPACT_SPEED) for part in (1.0, 0.5)]
    kelvin = np.array(stresses) / body.stress_of_kelvin
    most = max(len(one.stresses) for one in BODIES)
    pad = [np.nan] * (most - len(stresses))
    return xr.Dataset(
        {
            "stress": ("case", [*stresses, *pad], {"units": "Pa"}),
            "colder_by": ("case", [*kelvin, *pad], {"units": "K"}),
            "amplitude_ratio": ("case", [*ratio, *pad], {"units": "1"}),
            "time_of_flight": ("case", [*flight, *pad], {"units": "s"}),
            "deviation": ((), bounds[1], {"units": "Pa", "long_name": "least standard deviation"}),
            "deviation_by_twice_the_step": ((), bounds[0], {"units": "Pa"}),
            "stress_of_kelvin": ((), body.stress_of_kelvin, {"units": "Pa/K"}),
        }
    )


def table(data: xr.Dataset) -> list[Row]:
    """The thesis names neither stress nor temperature."""
    rows = []
    for one in BODIES:
        found = data.sel(body=one.name).dropna("case")
        low, high = float(found.stress[0]) / MEGA, float(found.stress[-1]) / MEGA
        ratio, flight = found.amplitude_ratio.values, 1e6 * found.time_of_flight.values
        sigma, other = float(found.deviation), float(found.deviation_by_twice_the_step)
        kelvin = sigma / one.stress_of_kelvin
        reach = "less" if kelvin < HAMMER else "more"
        blind = kelvin > BLIND
        rows += [
            Row(f"AR, {one.name}", "", f"{ratio[0]:.3f} to {ratio[-1]:.3f}", "", f"from {low:.0f} to {high:.0f} MPa; "
                f"between {ratio.min():.3f} and {ratio.max():.3f} on the way"),
            Row(f"TOF, {one.name}", "", f"{flight[0]:.1f} to {flight[-1]:.1f}", "µs", "over the same stresses"),
            Row(f"least 1 σ of the stress, {one.name}", "", "blind" if blind else sigma / MEGA, "MPa",
                f"of one trace at bead {SENSOR} with {100 * NOISE:.0f} % of noise, at {one.near / MEGA:.0f} MPa, where "
                f"bending stiffness, impact speed, gain and time zero are not known either; {other / MEGA:.3g} by "
                "twice the step"),
            Row(f"the same as a temperature, {one.name}", "", f"above {BLIND:.0f}" if blind else kelvin, "K",
                f"1 K is {one.stress_of_kelvin / MEGA:.3g} MPa; {reach} than the {HAMMER} K that are reported for the "
                "neutral temperature of rails by hammer tests. A bound of a perfect model, not of a test"),
        ]  # fmt: skip
    return rows


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """AR and TOF, less their values without stress, over the stress."""
    figure, axes = draw.panels(2, width=3.7, height=3.4, sharey=False)
    for one in BODIES:
        found = data.sel(body=one.name).dropna("case")
        stress = found.stress.values / MEGA
        for axis, name, factor in zip(axes, ("amplitude_ratio", "time_of_flight"), (1.0, 1e6), strict=True):
            values = factor * found[name].values
            without = np.interp(0.0, stress, values)
            change = values - without
            axis.plot(stress, change, label=one.name)
    for axis, words in zip(axes, ("AR − AR without stress", "TOF − TOF without stress (µs)"), strict=True):
        axis.set(xlabel="stress, tension positive (MPa)", ylabel=words)
        axis.set_yscale("symlog", linthresh=1e-3 if words.startswith("AR") else 0.1)
    axes[1].legend(loc="lower left")
    return {"stress": figure}
