"""Thesis section 6.2.1: the reflected wave at the centre of thin plates, against bead diameter over plate thickness."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.on_plates import DIAMETERS, IMPACT_SPEED, THICKNESSES, OnPlate, theirs
from hertzlink.studies.results import scalars, with_units
from hertzlink.studies.table import Named, Row, Rows
from hertzlink.studies.verdicts import printed
from hertzlink.studies.waves import returned
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from plates.theory.impact import THESIS_IMPACT

row = Rows("aspect_ratio")
BODIES = ("plate", "infinite plate", "half-space")
REDUCTION = 0.02  # Tolerance of the reduction, tighter than that of the boundary study.
RATIOS = tuple(np.geomspace(0.4, 10.0, 49))  # D/t of the theory lines.
OF_FIGURE = ", as in figure 6.18, whose values are not printed"
# The condition under which section 6.2.1's λ follow.
THEIRS = f"{THESIS_IMPACT.bead_speed:.3g} m/s and 8000 kg/m³"


@dataclass(frozen=True)
class Conditions(OnPlate):
    """Parameters that can be changed."""

    @property
    def speeds(self) -> tuple[float, float]:
        """v_in of equation 6.37, m/s, as the striker's speed, and as the beads' in the wave, which the thesis names."""
        return self.impact_speed, PARTICLE_TO_STRIKER_SPEED * self.impact_speed

    def ratios(self) -> tuple[float, ...]:
        """Return D/t of the theory lines."""
        if not self.own:
            return RATIOS
        least, most = min(self.bead) / max(self.thickness), max(self.bead) / min(self.thickness)
        return tuple(np.geomspace(0.5 * least, 1.3 * most, len(RATIOS)))

    def theory(self, ratio: float, speed: float) -> tuple[float, float]:
        """Return AR = e^{6/5} (equation 6.24) and TOF/D (6.39), s/m, at D/t; the result does not depend on D."""
        diameter = self.bead[len(self.bead) // 2]
        bead, plate, behind = self.sphere(diameter), self.plate(diameter / ratio), self.beads - self.sensor
        impact = hl.theory.PlateImpact(bead, plate, speed)
        return impact.amplitude_ratio, impact.time_of_flight(behind, self.impact_speed) / bead.size

    def structure(self, body: str, thickness: float) -> hl.Structure:
        """Return the thesis's plate struck at its centre, or a body without edges."""
        if body == "half-space":
            return hl.half_space(self.material)
        if body == "infinite plate":
            return hl.infinite_plate(thickness, self.material)
        centre = self.side / 2.0
        return hl.reduce(self.plate(thickness).at(centre, centre), self.until, REDUCTION, pulse=self.pulse)


THESIS = Conditions()


def run(quick: bool = False, jobs: int | None = None, **parameters: Any) -> xr.Dataset:
    """Return AR, TOF, contact time and force at the sensor for every plate and bead, at the centre of the plate.

    body: the thesis's plate, the infinite plate by its point impedance, and a half-space. quick: the same, because it
    takes seconds.
    """
    of, jobs = Conditions.of(parameters), 1 if quick and jobs is None else jobs

    def build(body: str, thickness: float, diameter: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(diameter), of.structure(body, thickness))

    def measure(run: xr.Dataset) -> xr.Dataset:
        contact = scalars(contact_time=(hl.contact_time(run), "s", "last bead's contact with the plate"))
        return returned(run, of.sensor).merge(contact).assign(sensor_force=hl.sensor_force(run, of.sensor))

    data = hl.sweep(build, of.until, jobs, measure, body=BODIES, thickness=of.thickness, diameter=of.bead)
    lines = np.array([[of.theory(ratio, speed) for speed in of.speeds] for ratio in of.ratios()])
    data = data.assign_coords(ratio=("ratio", list(of.ratios())), speed=("speed", list(of.speeds), {"units": "m/s"}))
    data["theory_amplitude_ratio"] = (("ratio", "speed"), lines[..., 0], {"units": "1"})
    data["theory_time_of_flight"] = (("ratio", "speed"), lines[..., 1], {"units": "s/m"})
    return of.marked(with_units(data, thickness="m", diameter="m"))


def table(data: xr.Dataset) -> list[Row]:
    """Return λ, contact times and e printed in section 6.2; AR and TOF/D compared with Zener's theory."""
    of = Conditions.read(data)
    first = _contacts(data, of) if of.own else [*_printed(data), *_extremes()]
    return [*first, *_amplitudes(data, of), *_flights(data, of)]


def _contacts(data: xr.Dataset, of: Conditions) -> Iterator[Row]:
    """Return the contact times of other beads and plates."""
    for diameter, thickness, at in _by_ratio(data):
        bead, plate = of.sphere(diameter), of.plate(thickness)
        impact = hl.theory.PlateImpact(bead, plate, of.impact_speed)
        said, expected = (impact.inelasticity, of.contact_time(diameter) * 1e6), impact.contact_time * 1e6
        named = Named(theory=expected, diameter=diameter * 1e3, thickness=thickness * 1e3)
        yield row("contact time of a chain", float(at.contact_time.sel(body="plate")) * 1e6, *said, **named)


def _printed(data: xr.Dataset) -> Iterator[Row]:
    for diameter, thickness in product(DIAMETERS, THICKNESSES):
        label = f"D {diameter * 1e3:.2f}, t {thickness * 1e3:.2f}"
        if f"λ, {label}" not in row.entries:
            continue
        plate, bead = THESIS.plate(thickness), THESIS.sphere(diameter)
        again = _thesis_parameter(diameter, thickness)
        said = IMPACT_SPEED, THESIS_IMPACT.bead_speed, again
        impact = hl.theory.PlateImpact(bead, plate, IMPACT_SPEED)
        yield row(f"λ, {label}", impact.inelasticity, *said, otherwise={THEIRS: again})
        if f"contact time, {label}" in row.entries:
            contact = impact.contact_time * 1e6
            chain = float(data.contact_time.sel(body="plate", diameter=diameter, thickness=thickness)) * 1e6
            single = _thesis_contact_time(diameter, thickness, again)
            # The times for the λ that would be printed as this one (0.29 for the misprint 0.2).
            shown = float(row.entries[f"λ, {label}"].value)
            digits = _ends(0.29 if shown == 0.2 else shown)
            ends = sorted(_thesis_contact_time(diameter, thickness, end) for end in digits)
            others = {"the thesis's λ and 8000 kg/m³": f"{ends[0]:.6g} to {ends[-1]:.6g}"}
            yield row(f"contact time, {label}", contact, single, chain, otherwise=others)


def _ends(shown: float) -> Iterable[float]:
    """Return the least and the greatest number that would be printed as this one."""
    digits = printed(shown)
    assert digits is not None
    return digits


def _thesis_parameter(diameter: float, thickness: float) -> float:
    """Return λ with the thesis's data."""
    impact = hl.theory.PlateImpact(theirs(diameter), THESIS.plate(thickness), THESIS_IMPACT.bead_speed)
    return float(impact.inelasticity)


def _thesis_contact_time(diameter: float, thickness: float, parameter: float) -> float:
    """Return T_c, µs, for a λ, with the thesis's data."""
    plate, speed = THESIS.plate(thickness), THESIS_IMPACT.striker_speed
    return 1e6 * float(hl.theory.PlateImpact(theirs(diameter), plate, speed, parameter).contact_time)


def _extremes() -> list[Row]:
    """Return the statements of section 6.2 about the smallest beads, the largest beads, and the thinnest plate."""
    small, large = THESIS.sphere(min(DIAMETERS)), max(DIAMETERS)
    times = [1e6 * float(hl.theory.PlateImpact(small, THESIS.plate(t), IMPACT_SPEED).contact_time) for t in THICKNESSES]
    again = [_thesis_contact_time(min(DIAMETERS), t, _thesis_parameter(min(DIAMETERS), t)) for t in THICKNESSES]
    ranges = [f"{min(part):.1f} to {max(part):.1f}" for part in (times, again)]
    thinnest = hl.theory.PlateImpact(THESIS.sphere(large), THESIS.plate(min(THICKNESSES)), IMPACT_SPEED).inelasticity
    ours, with_theirs = (hl.theory.zener_restitution(p) for p in (thinnest, _thesis_parameter(large, min(THICKNESSES))))
    thickest = max(THICKNESSES)
    return [
        row("contact time, D 4.76, all plates", *ranges, otherwise={THEIRS: f"{min(again):.4g} to {max(again):.4g}"}),
        row("e, D 19.05, t 2.29", ours, with_theirs, otherwise={THEIRS: float(with_theirs)}),
        row("D/t, largest bead, thickest plate", large / thickest, otherwise={"19.1 mm": 19.1e-3 / thickest}),
    ]


def _amplitudes(data: xr.Dataset, of: Conditions) -> Iterator[Row]:
    """Return AR over D/t. A wave below a hundredth of the incident one counts as none."""
    first = f"theory: e^(6/5) with the striker's speed, one bead for the chain{'' if of.own else OF_FIGURE}; "
    for diameter, thickness, at in _by_ratio(data):
        ratios = at.amplitude_ratio.sel(body=list(BODIES[:2])).values
        plate, infinite = (round(float(ratio), 4) if np.isfinite(ratio) else "below 0.01" for ratio in ratios)
        striker, wave = (of.theory(diameter / thickness, speed)[0] for speed in of.speeds)
        yield row("AR", plate, first, wave, infinite, theory=striker, ratio=diameter / thickness)
        first = ""


def _flights(data: xr.Dataset, of: Conditions) -> Iterator[Row]:
    first = "theory: equation 6.39, with e^(−1/5) and the striker's speed; "
    for diameter, thickness, at in _by_ratio(data):
        flight = 1e3 * float(at.time_of_flight.sel(body="plate")) / diameter
        striker, wave = (1e3 * of.theory(diameter / thickness, speed)[1] for speed in of.speeds)
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
        plate, infinite = (values.sel(diameter=diameter, body=body) for body in BODIES[:2])
        axis.plot(ratio, plate, markersize=4.5, label=label, **look)
        axis.plot(ratio, infinite, markersize=8.0, fillstyle="none", label=f"{label}, infinite plate", **look)
    largest = float((data.diameter / data.thickness).max())
    axis.set(xlabel="D/t", xlim=(0.0, 1.15 * largest if Conditions.read(data).own else 9.0))


def _lines(axis: draw.Axes, data: xr.Dataset, values: xr.DataArray) -> None:
    for speed, style, name in zip(data.speed.values, ("-", "--"), ("striker's", "wave's"), strict=True):
        draw.theory_line(axis, data.ratio, values.sel(speed=speed), f"Zener, the {name} speed", style)


def _forces(data: xr.Dataset) -> draw.Figure:
    """Return the force at the sensor on the thinnest and the thickest plate, for the middle bead."""
    figure, (axis,) = draw.panels(1, width=4.8, height=3.4)
    of = Conditions.read(data)
    diameter = of.bead[len(of.bead) // 2]
    ends = list(dict.fromkeys((of.thickness[0], of.thickness[-1])))
    force = data.sensor_force.sel(body="plate", diameter=diameter, thickness=ends)
    draw.lines(axis, force, "time", "thickness", draw.thick, 1e6, "-")
    axis.set(xlabel="time (µs)", ylabel="force at the sensor (N)", title=f"D = {diameter * 1e3:.2f} mm")
    axis.set_xlim(0.0, of.until * 1e6 if of.own else 1500.0)
    axis.legend()
    return figure
