"""Thesis section 6.2.1: the reflected wave at the centre of thin plates, against bead diameter over plate thickness."""

from collections.abc import Iterable, Iterator
from itertools import product

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.on_plates import (
    BEADS,
    DIAMETERS,
    IMPACT_SPEED,
    MATERIAL,
    SENSOR,
    SIDE,
    THICKNESSES,
    UNTIL,
    chain,
    plate,
    sphere,
    theirs,
)  # fmt: skip
from hertzlink.studies.results import scalars, with_units
from hertzlink.studies.table import Row, Rows
from hertzlink.studies.verdicts import printed
from hertzlink.studies.waves import returned
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from plates.impact import THESIS_IMPACT

row = Rows("aspect_ratio")
BODIES = ("plate", "infinite plate", "half-space")
REDUCTION = 0.02  # Tolerance of the reduction, tighter than that of the boundary study.
RATIOS = tuple(np.geomspace(0.4, 10.0, 49))  # D/t of the theory lines.
OF_FIGURE = ", as in figure 6.18, whose values are not printed"


# v_in of equation 6.37, m/s, as the striker's speed, and as the beads' in the wave, which the thesis names.
SPEEDS = (IMPACT_SPEED, PARTICLE_TO_STRIKER_SPEED * IMPACT_SPEED)


def theory(ratio: float, speed: float) -> tuple[float, float]:
    """Return AR = e^{6/5} (equation 6.24) and TOF/D (6.39), s/m, at D/t; the result does not depend on D."""
    bead = sphere(DIAMETERS[1])
    impact = hl.theory.PlateImpact(bead, plate(DIAMETERS[1] / ratio), speed)
    return impact.amplitude_ratio, impact.time_of_flight(BEADS - SENSOR, IMPACT_SPEED) / bead.size


def structure(body: str, thickness: float) -> hl.Structure:
    """Return the thesis's plate struck at its centre, or a body without edges."""
    if body == "half-space":
        return hl.half_space(MATERIAL)
    if body == "infinite plate":
        return hl.infinite_plate(thickness, MATERIAL)
    return hl.reduce(plate(thickness).at(SIDE / 2.0, SIDE / 2.0), UNTIL, REDUCTION)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR, TOF, contact time and force at the sensor for every plate and bead, at the centre of the plate.

    body: the thesis's plate, the infinite plate by its point impedance, and a half-space. quick: the same, because it
    takes seconds.
    """
    jobs = 1 if quick and jobs is None else jobs

    def build(body: str, thickness: float, diameter: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain(diameter), structure(body, thickness))

    def measure(run: xr.Dataset) -> xr.Dataset:
        contact = scalars(contact_time=(hl.contact_time(run), "s", "last bead's contact with the plate"))
        return returned(run, SENSOR).merge(contact).assign(sensor_force=hl.sensor_force(run, SENSOR))

    data = hl.sweep(build, UNTIL, jobs, measure, body=BODIES, thickness=THICKNESSES, diameter=DIAMETERS)
    lines = np.array([[theory(ratio, speed) for speed in SPEEDS] for ratio in RATIOS])
    data = data.assign_coords(ratio=("ratio", list(RATIOS)), speed=("speed", list(SPEEDS), {"units": "m/s"}))
    data["theory_amplitude_ratio"] = (("ratio", "speed"), lines[..., 0], {"units": "1"})
    data["theory_time_of_flight"] = (("ratio", "speed"), lines[..., 1], {"units": "s/m"})
    return with_units(data, thickness="m", diameter="m")


def table(data: xr.Dataset) -> list[Row]:
    """Return λ, contact times and e printed in section 6.2; AR and TOF/D compared with Zener's theory."""
    return [*_printed(data), *_extremes(), *_amplitudes(data), *_flights(data)]


def _printed(data: xr.Dataset) -> Iterator[Row]:
    for diameter, thickness in product(DIAMETERS, THICKNESSES):
        label = f"D {diameter * 1e3:.2f}, t {thickness * 1e3:.2f}"
        if f"λ, {label}" not in row.entries:
            continue
        again = _thesis_parameter(diameter, thickness)
        said = IMPACT_SPEED, THESIS_IMPACT.bead_speed, again
        impact = hl.theory.PlateImpact(sphere(diameter), plate(thickness), IMPACT_SPEED)
        yield row(
            f"λ, {label}",
            impact.inelasticity,
            *said,
            otherwise={_with_their(f"{THESIS_IMPACT.bead_speed:.3g} m/s", diameter): again},
        )
        if f"contact time, {label}" in row.entries:
            contact = impact.contact_time * 1e6
            in_chain = float(data.contact_time.sel(body="plate", diameter=diameter, thickness=thickness)) * 1e6
            single = _thesis_contact_time(diameter, thickness, again)
            # The times for the λ that would be printed as this one (0.29 for the misprint 0.2).
            shown = float(row.entries[f"λ, {label}"].value)
            digits = _ends(0.29 if shown == 0.2 else shown)
            ends = sorted(_thesis_contact_time(diameter, thickness, end) for end in digits)
            others = {_with_their("the thesis's λ", diameter): f"{ends[0]:.6g} to {ends[-1]:.6g}"}
            yield row(f"contact time, {label}", contact, single, in_chain, otherwise=others)


def _with_their(first: str, diameter: float) -> str:
    """Return the condition under which section 6.2.1's numbers follow, with its data of the bead."""
    other_size = theirs(diameter).radius != sphere(diameter).radius
    return f"{first}, 19.1 mm and 8000 kg/m³" if other_size else f"{first} and 8000 kg/m³"


def _ends(shown: float) -> Iterable[float]:
    """Return the least and the greatest number that would be printed as this one."""
    digits = printed(shown)
    assert digits is not None
    return digits


def _thesis_parameter(diameter: float, thickness: float) -> float:
    """Return λ with the thesis's data."""
    impact = hl.theory.PlateImpact(theirs(diameter), plate(thickness), THESIS_IMPACT.bead_speed)
    return float(impact.inelasticity)


def _thesis_contact_time(diameter: float, thickness: float, parameter: float) -> float:
    """Return T_c, µs, for a λ, with the thesis's data."""
    speed = THESIS_IMPACT.striker_speed
    return 1e6 * float(hl.theory.PlateImpact(theirs(diameter), plate(thickness), speed, parameter).contact_time)


def _extremes() -> list[Row]:
    """Return the statements of section 6.2 about the smallest beads, the largest beads, and the thinnest plate."""
    small, large = sphere(min(DIAMETERS)), max(DIAMETERS)
    times = [1e6 * float(hl.theory.PlateImpact(small, plate(t), IMPACT_SPEED).contact_time) for t in THICKNESSES]
    again = [_thesis_contact_time(min(DIAMETERS), t, _thesis_parameter(min(DIAMETERS), t)) for t in THICKNESSES]
    ranges = [f"{min(part):.1f} to {max(part):.1f}" for part in (times, again)]
    thinnest = hl.theory.PlateImpact(sphere(large), plate(min(THICKNESSES)), IMPACT_SPEED).inelasticity
    ours, with_theirs = (hl.theory.zener_restitution(p) for p in (thinnest, _thesis_parameter(large, min(THICKNESSES))))
    thickest, with_speed = max(THICKNESSES), f"{THESIS_IMPACT.bead_speed:.3g} m/s"
    speed, speed_and_size = (_with_their(with_speed, diameter) for diameter in (min(DIAMETERS), large))
    return [
        row("contact time, D 4.76, all plates", *ranges, otherwise={speed: f"{min(again):.4g} to {max(again):.4g}"}),
        row("e, D 19.05, t 2.29", ours, with_theirs, otherwise={speed_and_size: float(with_theirs)}),
        row("D/t, largest bead, thickest plate", large / thickest, otherwise={"19.1 mm": 19.1e-3 / thickest}),
    ]


def _amplitudes(data: xr.Dataset) -> Iterator[Row]:
    """Return AR over D/t. A wave below a hundredth of the incident one counts as none."""
    first = f"theory: e^(6/5) with the striker's speed, one bead for the chain{OF_FIGURE}; "
    for diameter, thickness, at in _by_ratio(data):
        ratios = at.amplitude_ratio.sel(body=list(BODIES[:2])).values
        finite, infinite = (round(float(ratio), 4) if np.isfinite(ratio) else "below 0.01" for ratio in ratios)
        striker, wave = (theory(diameter / thickness, speed)[0] for speed in SPEEDS)
        yield row("AR", finite, first, wave, infinite, theory=striker, ratio=diameter / thickness)
        first = ""


def _flights(data: xr.Dataset) -> Iterator[Row]:
    first = "theory: equation 6.39, with e^(−1/5) and the striker's speed; "
    for diameter, thickness, at in _by_ratio(data):
        flight = 1e3 * float(at.time_of_flight.sel(body="plate")) / diameter
        striker, wave = (1e3 * theory(diameter / thickness, speed)[1] for speed in SPEEDS)
        seen = flight if np.isfinite(flight) else "no wave"
        yield row("TOF/D", seen, first, wave, theory=striker, ratio=diameter / thickness)
        first = ""


def _by_ratio(data: xr.Dataset) -> list[tuple[float, float, xr.Dataset]]:
    """Return the diameter, thickness (m) and results of all combinations, in order of D/t."""
    pairs = sorted(product(data.diameter.values, data.thickness.values), key=lambda pair: pair[0] / pair[1])
    return [(d, t, data.sel(diameter=d, thickness=t)) for d, t in pairs]


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR (figure 6.18), TOF and TOF/D (6.19) against D/t with Zener's theory, and the forces (6.16)."""
    ratios, (axis,) = draw.panels(1, width=4.6, height=3.6)
    _points(axis, data, data.amplitude_ratio)
    missing = data.amplitude_ratio.sel(body="plate").isnull()
    if bool(missing.any()):
        places = (data.diameter / data.thickness).where(missing).values
        draw.mark_missing(axis, places[np.isfinite(places)], 0, color="dimgrey", label="no wave came back")
    _lines(axis, data, data.theory_amplitude_ratio)
    axis.set(ylabel="amplitude ratio AR", ylim=(0.0, 1.0))
    flights, axes = draw.panels(2, width=4.0, height=3.6, sharey=False)
    normalised = data.time_of_flight / data.diameter * 1e3
    _points(axes[0], data, data.time_of_flight * 1e6)
    _points(axes[1], data, normalised)
    _lines(axes[1], data, data.theory_time_of_flight * 1e3)
    axes[0].set(ylabel="time of flight (µs)")
    axes[1].set(ylabel="time of flight / D (µs/mm)", ylim=(0.0, 1.6 * float(normalised.max())))
    for drawn in (axis, *axes):
        drawn.legend()
    return {"amplitude_ratio": ratios, "time_of_flight": flights, "forces": _forces(data)}


def _points(axis: draw.Axes, data: xr.Dataset, values: xr.DataArray) -> None:
    """Draw filled markers for the thesis's plates, hollow ones for infinite plates."""
    for i, diameter in enumerate(data.diameter.values):
        label, ratio = f"D = {diameter * 1e3:.2f} mm", diameter / data.thickness.values
        look = draw.Look(color=draw.COLOURS[i], marker=draw.MARKERS[i], linestyle="none", clip_on=False, zorder=3.0)
        finite, infinite = (values.sel(diameter=diameter, body=body) for body in BODIES[:2])
        axis.plot(ratio, finite, markersize=4.5, label=label, **look)
        axis.plot(ratio, infinite, markersize=8.0, fillstyle="none", label=f"{label}, infinite plate", **look)
    axis.set(xlabel="D/t", xlim=(0.0, 9.0))


def _lines(axis: draw.Axes, data: xr.Dataset, values: xr.DataArray) -> None:
    for speed, style, name in zip(data.speed.values, ("-", "--"), ("striker's", "wave's"), strict=True):
        draw.theory_line(axis, data.ratio, values.sel(speed=speed), f"Zener, the {name} speed", style)


def _forces(data: xr.Dataset) -> draw.Figure:
    """Return the force at the sensor on the thinnest and the thickest plate, for the middle bead."""
    figure, (axis,) = draw.panels(1, width=4.8, height=3.4)
    diameter = DIAMETERS[1]
    force = data.sensor_force.sel(body="plate", diameter=diameter, thickness=[THICKNESSES[0], THICKNESSES[-1]])
    draw.lines(axis, force, "time", "thickness", draw.thick, 1e6, "-")
    axis.set(xlabel="time (µs)", ylabel="force at the sensor (N)", title=f"D = {diameter * 1e3:.2f} mm")
    axis.set_xlim(0.0, 1500.0)
    axis.legend()
    return figure
