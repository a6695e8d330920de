"""Thesis section 6.2.1: the reflected wave at the centre of thin plates, against bead diameter over plate thickness."""

from collections.abc import Iterator
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Case, Number, printed, rounded
from hertzlink.studies.plate_boundary import theirs
from hertzlink.studies.shared import DIAMETERS, THICKNESSES
from particles.solitary import PARTICLE_TO_STRIKER_SPEED

BODIES = ("plate", "infinite plate")
UNTIL = 3.5e-3  # Length of the record, s.
REDUCTION = 0.02  # Tolerance of the reduction.
RATIOS = np.geomspace(0.4, 10.0, 49)  # D/t of the theory lines.
# v_in of equation 6.37, m/s: as the striker's speed, and as the beads' speed in the wave, which the thesis names.
SPEEDS = (shared.PLATE_SPEED, PARTICLE_TO_STRIKER_SPEED * shared.PLATE_SPEED)


def theory(ratio: float, speed: float) -> tuple[float, float]:
    """Return AR = e^{6/5} (equation 6.24) and TOF/D (6.39), s/m, at D/t; the result does not depend on D."""
    bead = shared.sphere(DIAMETERS[1])
    impact = hl.theory.PlateImpact(bead, shared.plate(DIAMETERS[1] / ratio), speed)
    return impact.amplitude_ratio, impact.time_of_flight(shared.BEADS - shared.SENSOR, shared.PLATE_SPEED) / bead.size


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR, TOF and contact time for every plate and bead, at the centre of the plate.

    body: the thesis's plate, or the infinite plate by its point impedance. quick: the same, because it takes seconds.
    """

    def build(body: str, thickness: float, diameter: float) -> hl.CoSimulation:
        structure = hl.infinite_plate(thickness, shared.ALUMINIUM)
        if body == "plate":
            plate, centre = shared.plate(thickness, highest_frequency=shared.HIGHEST_FREQUENCY), shared.SIDE / 2.0
            structure = hl.reduce(plate.at(centre, centre), UNTIL, REDUCTION)
        return hl.CoSimulation(shared.plate_chain(diameter), structure)

    contact = "s", "last bead's contact with the plate"
    data = hl.sweep(
        build, UNTIL, jobs,
        lambda run: shared.returned(run).merge(shared.scalars(contact_time=(hl.contact_time(run), *contact))),
        body=BODIES, thickness=THICKNESSES, diameter=DIAMETERS,
    )  # fmt: skip
    lines = np.array([[theory(ratio, speed) for speed in SPEEDS] for ratio in RATIOS])
    data = data.assign_coords(ratio=RATIOS, speed=list(SPEEDS))
    data["theory_amplitude_ratio"] = (("ratio", "speed"), lines[..., 0], {"units": "1"})
    data["theory_time_of_flight"] = (("ratio", "speed"), lines[..., 1], {"units": "s/m"})
    return shared.with_units(data, thickness="m", diameter="m", ratio="1", speed="m/s")


def ours(diameter: float, thickness: float) -> hl.theory.PlateImpact:
    return hl.theory.PlateImpact(shared.sphere(diameter), shared.plate(thickness), shared.PLATE_SPEED)


def of_thesis(diameter: float, thickness: float, parameter: float | None = None) -> hl.theory.PlateImpact:
    """Return the impact with the thesis's bead: at the speed in the wave, or, for a given λ, at the striker's speed."""
    speed = shared.THEIR_BEAD_SPEED if parameter is None else shared.THEIR_STRIKER_SPEED
    return hl.theory.PlateImpact(theirs(diameter), shared.plate(thickness), speed, parameter)


def with_theirs(first: str, diameter: float) -> str:
    """Return a condition, with section 6.2.1's data of the bead, under which its numbers follow."""
    return f"{first}, 19.1 mm and 8000 kg/m³" if diameter == DIAMETERS[-1] else f"{first} and 8000 kg/m³"


def numbers(data: xr.Dataset) -> Iterator[Number]:
    lines, speed = printed("aspect-ratio"), f"{shared.THEIR_BEAD_SPEED:.3g} m/s"
    for diameter, thickness in product(DIAMETERS, THICKNESSES):
        label, impact = f"D {diameter * 1e3:.2f}, t {thickness * 1e3:.2f}", ours(diameter, thickness)
        if f"λ, {label}" not in lines:
            continue
        again = float(of_thesis(diameter, thickness).inelasticity)
        yield Number(f"λ, {label}", {"": impact.inelasticity, with_theirs(speed, diameter): again})
        if f"contact time, {label}" in lines:
            # For the numbers that would be printed as the thesis's λ.
            digits = lines[f"λ, {label}"].corrected or lines[f"λ, {label}"].low
            by_digits = (of_thesis(diameter, thickness, end) for end in rounded(digits, digits))
            low, high = (1e6 * float(one.contact_time) for one in by_digits)
            condition = with_theirs("the thesis's λ", diameter)
            cases: dict[str, Case] = {"": 1e6 * impact.contact_time, condition: (low, high)}
            in_chain = 1e6 * float(data.contact_time.sel(body="plate", diameter=diameter, thickness=thickness))
            said = f"Zener, one bead; the last bead of a chain {in_chain:.0f}"
            yield Number(f"contact time, {label}", cases, said)

    # The smallest beads, the largest beads, and the thinnest plate.
    small, large, thinnest, thickest = DIAMETERS[0], DIAMETERS[-1], THICKNESSES[0], THICKNESSES[-1]
    times = [1e6 * ours(small, t).contact_time for t in THICKNESSES]
    their_times = list[float]()
    for thickness in THICKNESSES:
        parameter = float(of_thesis(small, thickness).inelasticity)
        their_times.append(1e6 * float(of_thesis(small, thickness, parameter).contact_time))
    cases = {"": (min(times), max(times)), with_theirs(speed, small): (min(their_times), max(their_times))}
    yield Number("contact time, D 4.76, all plates", cases)
    parameters = (float(impact(large, thinnest).inelasticity) for impact in (ours, of_thesis))
    plain, again = (float(hl.theory.zener_restitution(parameter)) for parameter in parameters)
    yield Number("e, D 19.05, t 2.29", {"": plain, with_theirs(speed, large): again})
    yield Number("D/t, largest bead, thickest plate", {"": large / thickest, "19.1 mm": 19.1e-3 / thickest})


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR (figure 6.18), TOF and TOF/D (6.19) against D/t with Zener's theory."""
    ratios, (axis,) = draw.panels(ylabel="amplitude ratio AR")
    missing = data.amplitude_ratio.sel(body="plate").isnull()
    places = (data.diameter / data.thickness).where(missing).values
    draw.mark_missing(axis, places[np.isfinite(places)], 0, color="dimgrey", label="no wave came back")
    over_ratio(axis, data, data.amplitude_ratio, data.theory_amplitude_ratio)
    axis.set_ylim(0.0, 1.0)

    labels = ("time of flight (µs)", "time of flight / D (µs/mm)")
    flights, axes = draw.panels(2, width=4.0, ylabels=labels)
    normalised = data.time_of_flight / data.diameter * 1e3
    over_ratio(axes[0], data, data.time_of_flight * 1e6)
    over_ratio(axes[1], data, normalised, data.theory_time_of_flight * 1e3)
    axes[1].set_ylim(0.0, 1.6 * float(normalised.max()))

    return {"amplitude_ratio": ratios, "time_of_flight": flights}


def over_ratio(axis: draw.Axes, data: xr.Dataset, values: xr.DataArray, theory: xr.DataArray | None = None) -> None:
    """Draw filled markers for the thesis's plates, hollow ones for infinite plates, and lines of Zener's theory."""
    for i, diameter in enumerate(data.diameter.values):
        label, ratio = f"D = {diameter * 1e3:.2f} mm", diameter / data.thickness.values
        look: dict[str, Any] = {"color": draw.COLOURS[i], "marker": draw.MARKERS[i], "ls": "none", "clip_on": False}
        finite, infinite = (values.sel(diameter=diameter, body=body) for body in BODIES)
        axis.plot(ratio, finite, markersize=4.5, label=label, **look)
        axis.plot(ratio, infinite, markersize=8.0, fillstyle="none", label=f"{label}, infinite plate", **look)
    if theory is not None:
        for speed, style, name in zip(theory.speed.values, ("-", "--"), ("striker's", "wave's"), strict=True):
            draw.theory_line(axis, theory.ratio, theory.sel(speed=speed), f"Zener, the {name} speed", style)
    axis.set(xlabel="D/t", xlim=(0.0, 9.0))
    axis.legend()
