"""Thesis section 6.2.1: the reflected wave at the centre of thin plates, against bead diameter over plate thickness."""

from dataclasses import dataclass
from functools import partial
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, on_plates
from hertzlink.studies.expected import Named, Rows
from hertzlink.studies.on_plates import IMPACT_SPEED, OnPlate, theirs
from hertzlink.studies.table import Row
from hertzlink.studies.verdicts import printed
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from plates.theory.impact import THESIS_IMPACT

row = Rows("aspect_ratio")
BODIES = ("plate", "infinite plate", "half-space")
REDUCTION = 0.02  # Tolerance of the reduction, tighter than that of the boundary study.
RATIOS = tuple(np.geomspace(0.4, 10.0, 49))  # D/t of the theory lines.
# Stands before the reason of the first AR.
FIRST = "theory: e^(6/5) with the striker's speed, one bead for the chain{}; "
THEIRS = f"{THESIS_IMPACT.bead_speed:.3g} m/s and 8000 kg/m³"  # The condition under which section 6.2.1's λ follow.


@dataclass(frozen=True)
class Conditions(OnPlate):
    """Parameters that can be changed."""

    @property
    def speeds(self) -> tuple[float, float]:
        """m/s; v_in of equation 6.37 as the speed of the striker, and as that of the beads in the wave, which the
        thesis names.
        """
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
        bead, plate = self.sphere(diameter), self.plate(diameter / ratio)
        flight = hl.theory.plate_normalised_time_of_flight(
            self.beads - self.sensor, bead, plate, self.impact_speed, speed
        )
        return hl.theory.plate_amplitude_ratio(hl.theory.plate_inelasticity(bead, plate, speed)), flight


THESIS = Conditions()


def run(quick: bool = False, jobs: int | None = None, **parameters: Any) -> xr.Dataset:
    """Return AR, TOF, contact time and force at the sensor for every plate and bead, at the centre of the plate.

    body: the thesis's plate, the infinite plate by its point impedance, and a half-space. quick: the same, because it
    takes seconds.
    """

    of = Conditions.of(parameters)

    def build(body: str, thickness: float, diameter: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(diameter), _structure(of, body, thickness))

    data = hl.sweep(
        build, of.until, 1 if quick and jobs is None else jobs, partial(measure, sensor=of.sensor),
        body=BODIES, thickness=of.thickness, diameter=of.bead,
    )  # fmt: skip
    for name in ("thickness", "diameter"):
        data[name].attrs["units"] = "m"
    lines = [[of.theory(ratio, speed) for speed in of.speeds] for ratio in of.ratios()]
    data = data.assign_coords(ratio=("ratio", list(of.ratios())), speed=("speed", list(of.speeds), {"units": "m/s"}))
    for i, (name, units) in enumerate((("theory_amplitude_ratio", "1"), ("theory_time_of_flight", "s/m"))):
        data[name] = (("ratio", "speed"), [[pair[i] for pair in row] for row in lines], {"units": units})
    return of.marked(data)


def _structure(of: Conditions, body: str, thickness: float) -> hl.Structure:
    if body == "half-space":
        return hl.half_space(of.material)
    if body == "infinite plate":
        return hl.infinite_plate(thickness, of.material)
    centre = of.side / 2.0
    return hl.reduce(of.plate(thickness).at(centre, centre), of.until, REDUCTION, pulse=of.pulse)


def measure(run: xr.Dataset, sensor: int = on_plates.SENSOR) -> xr.Dataset:
    """Return the part of a run that the study keeps."""
    return xr.Dataset(
        {
            "amplitude_ratio": hl.amplitude_ratio(run, sensor),
            "time_of_flight": hl.time_of_flight(run, sensor),
            "contact_time": (
                (),
                hl.contact_time(run),
                {"units": "s", "long_name": "last bead's contact with the plate"},
            ),
            "sensor_force": hl.sensor_force(run, sensor),
        }
    )


def table(data: xr.Dataset) -> list[Row]:
    """Return λ, contact times and e printed in section 6.2; AR and TOF/D compared with Zener's theory."""
    of = Conditions.read(data)
    first = _contacts(data, of) if of.own else [*_printed(data), *_extremes()]
    return [*first, *_amplitudes(data, of), *_flights(data, of)]


def _contacts(data: xr.Dataset, of: Conditions) -> list[Row]:
    """Return the contact times of other beads and plates."""
    rows = []
    for diameter, thickness, _ in _by_ratio(data):
        bead, plate = of.sphere(diameter), of.plate(thickness)
        simulated = float(data.contact_time.sel(body="plate", diameter=diameter, thickness=thickness)) * 1e6
        said = hl.theory.plate_inelasticity(bead, plate, of.impact_speed), of.contact_time(diameter) * 1e6
        expected = float(hl.theory.plate_contact_time(bead, plate, of.impact_speed)) * 1e6
        named = Named(diameter=diameter * 1e3, thickness=thickness * 1e3)
        rows.append(row("contact time of a chain", simulated, *said, theory=expected, **named))
    return rows


def _printed(data: xr.Dataset) -> list[Row]:
    rows = []
    for diameter, thickness in product(on_plates.DIAMETERS, on_plates.THICKNESSES):
        label = f"D {diameter * 1e3:.2f}, t {thickness * 1e3:.2f}"
        if f"λ, {label}" not in row.entries:
            continue
        plate, bead = THESIS.plate(thickness), THESIS.sphere(diameter)
        parameter, again = (
            hl.theory.plate_inelasticity(bead, plate, IMPACT_SPEED),
            _thesis_parameter(diameter, thickness),
        )
        speeds = IMPACT_SPEED, THESIS_IMPACT.bead_speed
        rows.append(row(f"λ, {label}", parameter, *speeds, again, otherwise={THEIRS: again}))
        if f"contact time, {label}" in row.entries:
            contact = hl.theory.plate_contact_time(bead, plate, IMPACT_SPEED) * 1e6
            chain = float(data.contact_time.sel(body="plate", diameter=diameter, thickness=thickness)) * 1e6
            theirs = _of_printed(diameter, thickness, float(row.entries[f"λ, {label}"].value))
            single = _thesis_contact_time(diameter, thickness)
            rows.append(row(f"contact time, {label}", contact, single, chain, otherwise=theirs))
    return rows


def _thesis_parameter(diameter: float, thickness: float) -> float:
    """Return λ with the thesis's data."""
    return float(hl.theory.plate_inelasticity(theirs(diameter), THESIS.plate(thickness), THESIS_IMPACT.bead_speed))


def _thesis_contact_time(diameter: float, thickness: float) -> float:
    """Return T_c, µs, with the thesis's data."""
    parameter, plate = _thesis_parameter(diameter, thickness), THESIS.plate(thickness)
    return 1e6 * float(hl.theory.plate_contact_time(theirs(diameter), plate, THESIS_IMPACT.striker_speed, parameter))


def _of_printed(diameter: float, thickness: float, parameter: float) -> dict[str, str]:
    """Return T_c, µs, for the λ that would be printed as this one (0.29 for the misprint 0.2), with the thesis's
    density."""
    plate, speed = THESIS.plate(thickness), THESIS_IMPACT.striker_speed
    digits = printed(0.29 if parameter == 0.2 else parameter)
    assert digits is not None
    times = [1e6 * float(hl.theory.plate_contact_time(theirs(diameter), plate, speed, ratio)) for ratio in digits]
    return {"the thesis's λ and 8000 kg/m³": f"{min(times):.6g} to {max(times):.6g}"}


def _extremes() -> list[Row]:
    """Return the statements of section 6.2 about the smallest beads, the largest beads, and the thinnest plate."""
    small, large = min(on_plates.DIAMETERS), max(on_plates.DIAMETERS)
    thin, thick = min(on_plates.THICKNESSES), max(on_plates.THICKNESSES)
    plates = [THESIS.plate(thickness) for thickness in on_plates.THICKNESSES]
    times = [1e6 * float(hl.theory.plate_contact_time(THESIS.sphere(small), plate, IMPACT_SPEED)) for plate in plates]
    theirs = [_thesis_contact_time(small, thickness) for thickness in on_plates.THICKNESSES]
    parameter = hl.theory.plate_inelasticity(THESIS.sphere(large), THESIS.plate(thin), IMPACT_SPEED)
    again = hl.theory.zener_restitution(_thesis_parameter(large, thin))
    ranges = [f"{min(part):.1f} to {max(part):.1f}" for part in (times, theirs)]
    return [
        row("contact time, D 4.76, all plates", *ranges, otherwise={THEIRS: f"{min(theirs):.4g} to {max(theirs):.4g}"}),
        row("e, D 19.05, t 2.29", hl.theory.zener_restitution(parameter), again, otherwise={THEIRS: float(again)}),
        row("D/t, largest bead, thickest plate", large / thick, otherwise={"19.1 mm": 19.1e-3 / thick}),
    ]


def _amplitudes(data: xr.Dataset, of: Conditions) -> list[Row]:
    rows: list[Row] = []
    for diameter, thickness, ratio in _by_ratio(data):
        ratios = data.amplitude_ratio.sel(diameter=diameter, thickness=thickness)
        plate, infinite = (_shown(ratios.sel(body=body)) for body in BODIES[:2])
        striker, wave = (of.theory(ratio, speed)[0] for speed in of.speeds)
        first = "" if rows else FIRST.format("" if of.own else ", as in figure 6.18, whose values are not printed")
        rows.append(row("AR", plate, first, wave, infinite, theory=striker, ratio=ratio))
    return rows


def _shown(ratio: xr.DataArray) -> float | str:
    """Return AR with four digits; a wave below a hundredth of the incident one counts as none."""
    return round(float(ratio), 4) if np.isfinite(ratio) else "below 0.01"


def _flights(data: xr.Dataset, of: Conditions) -> list[Row]:
    rows: list[Row] = []
    for diameter, thickness, ratio in _by_ratio(data):
        flight_per_size = (
            float(data.time_of_flight.sel(body="plate", diameter=diameter, thickness=thickness)) / diameter
        )
        striker, wave = (of.theory(ratio, speed)[1] * 1e3 for speed in of.speeds)
        first = "" if rows else "theory: equation 6.39, with e^(−1/5) and the striker's speed; "
        flight = flight_per_size * 1e3 if np.isfinite(flight_per_size) else "no wave"
        rows.append(row("TOF/D", flight, first, wave, theory=striker, ratio=ratio))
    return rows


def _by_ratio(data: xr.Dataset) -> list[tuple[float, float, float]]:
    """Return the diameter, thickness (m) and D/t of all combinations, in order of D/t."""
    pairs = [(d, t, d / t) for d in data.diameter.values for t in data.thickness.values]
    return sorted(pairs, key=lambda pair: pair[2])


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR (figure 6.18), TOF and TOF/D (6.19) against D/t with Zener's theory, and the forces (6.16)."""
    figures_by_name = {}
    figure, (axis,) = draw.panels(1, width=4.6, height=3.6)
    _points(axis, data, data.amplitude_ratio)
    _without_wave(axis, data)
    _lines(axis, data, data.theory_amplitude_ratio)
    axis.set(ylabel="amplitude ratio AR", ylim=(0.0, 1.0))
    axis.legend()
    figures_by_name["amplitude_ratio"] = figure
    figure, axes = draw.panels(2, width=4.0, height=3.6, sharey=False)
    _points(axes[0], data, data.time_of_flight * 1e6)
    axes[0].set(ylabel="time of flight (µs)")
    _points(axes[1], data, data.time_of_flight / data.diameter * 1e3)
    _lines(axes[1], data, data.theory_time_of_flight * 1e3)
    longest = float((data.time_of_flight / data.diameter).max()) * 1e3
    axes[1].set(ylabel="time of flight / D (µs/mm)", ylim=(0.0, 1.6 * longest))
    for axis in axes:
        axis.legend()
    figures_by_name["time_of_flight"] = figure
    figures_by_name["forces"] = _forces(data)
    return figures_by_name


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


def _without_wave(axis: draw.Axes, data: xr.Dataset) -> None:
    """Crosses just above the axis where no wave came back within the record."""
    ratios = (data.diameter / data.thickness).broadcast_like(data.amplitude_ratio.isel(body=0, drop=True))
    missing = data.amplitude_ratio.sel(body="plate", drop=True).isnull()
    if bool(missing.any()):
        places = ratios.values[missing.transpose(*ratios.dims).values]
        axis.plot(places, np.full(places.size, 0.02), "x", color="dimgrey", markersize=5.0, label="no wave came back")


def _lines(axis: draw.Axes, data: xr.Dataset, values: xr.DataArray) -> None:
    for speed, style, name in zip(data.speed.values, ("-", "--"), ("striker's", "wave's"), strict=True):
        draw.theory_line(axis, data.ratio, values.sel(speed=speed), f"Zener, the {name} speed", style)


def _forces(data: xr.Dataset) -> draw.Figure:
    """Return the force at the sensor on the thinnest and the thickest plate, for the middle bead."""
    figure, (axis,) = draw.panels(1, width=4.8, height=3.4)
    of = Conditions.read(data)
    diameter = of.bead[len(of.bead) // 2]
    middle = data.sensor_force.sel(body="plate", diameter=diameter)
    for thickness in dict.fromkeys((of.thickness[0], of.thickness[-1])):
        axis.plot(data.time * 1e6, middle.sel(thickness=thickness), "-", label=draw.thick(thickness))
    axis.set(xlabel="time (µs)", ylabel="force at the sensor (N)", title=f"D = {diameter * 1e3:.2f} mm")
    axis.set_xlim(0.0, of.until * 1e6 if of.own else 1500.0)
    axis.legend()
    return figure
