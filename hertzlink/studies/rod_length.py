"""Thesis section 6.1.2: clamped steel cylinders of 6 to 610 mm return the same wave, except for a few percent."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, striking
from hertzlink.studies import struck_cylinders as struck
from hertzlink.studies.conditions import LENGTH
from hertzlink.studies.expected import Rows
from hertzlink.studies.striking import Striking
from hertzlink.studies.table import MEASURED, Row

row = Rows("rod_length")
RADIUS = 9.53e-3
LENGTHS = tuple(np.geomspace(6.35e-3, 101.6e-3, 25)) + tuple(np.geomspace(101.6e-3, 609.6e-3, 17)[1:])
SOLID_LENGTHS = (6.35e-3, 12.7e-3, 25.4e-3, 50.8e-3, 76.2e-3, 101.6e-3, 152.4e-3, 304.8e-3, 609.6e-3)
ECHOLESS_LENGTH = 0.2  # m; the echo of longer rods returns after the bead has left.


@dataclass(frozen=True)
class Conditions(Striking):
    """Parameters that can be changed."""

    material: Annotated[hl.Material, "Material of the cylinder"] = hl.STEEL_440C
    radius: Annotated[float, LENGTH, "Radius of the cylinder"] = RADIUS
    length: Annotated[tuple[float, ...], LENGTH, "Length of the cylinder"] = LENGTHS

    def layers(self, length: float) -> list[hl.Layer]:
        """Return the cylinder."""
        return [hl.Layer(self.material, length, self.radius)]

    def stacks(self) -> Iterable[Sequence[hl.Layer]]:
        """Return the longest cylinder."""
        return [self.layers(max(self.length))]

    def theory_length(self) -> float:
        """Return the characteristic length c T_c/2, m, with T_c of one bead at the striker's speed (equation 6.8)."""
        return float(hl.theory.characteristic_length(self.material.bar_speed, self.contact_time(self.material)))


def run(quick: bool = False, jobs: int | None = None, **parameters: Any) -> xr.Dataset:
    """Return AR, TOF and the force at the sensors over the length of a cylinder. quick: every fourth length."""
    of = Conditions.of(parameters)
    few = [SOLID_LENGTHS[0], 101.6e-3, SOLID_LENGTHS[-1]]
    lengths = of.few("length", LENGTHS[::4] if quick else LENGTHS)
    solid_lengths = struck.chosen(lengths) if lengths == of.length != LENGTHS else few if quick else SOLID_LENGTHS
    # Starting processes would take longer than the quick runs.
    return of.marked(struck.over_lengths(of.layers, lengths, solid_lengths, 1 if quick and jobs is None else jobs, of))


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of section 6.1.2 and figure 6.8, compared with those of hertzlink."""
    of = Conditions.read(data)
    return _own(data, of) if of.own else _thesis(data)


def _own(data: xr.Dataset, of: Conditions) -> list[Row]:
    """Return AR and TOF of other rods, compared with theory."""

    def theory(length: float) -> tuple[float, float | str, str]:
        return float(of.time_of_flight(of.wall(of.material))), "", "equation 6.20, without losses and preload"

    return [*struck.own_rows(data, "rod of", theory), row("own characteristic length", of.theory_length() * 1e3)]


def _thesis(data: xr.Dataset) -> list[Row]:
    primary = data.sel(wave="primary")
    middle = primary.sel(dashpot=struck.DASHPOT)
    ratios, flights = middle.amplitude_ratio, middle.time_of_flight
    drops = [struck.lost(primary.amplitude_ratio.sel(dashpot=dashpot)) for dashpot in striking.DASHPOTS]
    first, last = (primary.amplitude_ratio.isel(length=i, drop=True) for i in (0, -1))
    at = data.sensor_force.sel(sensor=struck.SENSOR).isel(length=0)
    incident = float(at.time[int(at.where(at.time < 3e-4, 0.0).values.argmax())]) * 1e6
    return [
        row("AR, all lengths", struck.interval(ratios),
            "; ".join(f"{struck.interval(primary.amplitude_ratio.sel(dashpot=d))} for γ = {d:g}" for d in (4.0, 6.0)),
            otherwise=struck.over_dashpots(primary.amplitude_ratio)),
        row("AR, short cylinder", float(first.sel(dashpot=struck.DASHPOT)), struck.sensitivity(first),
            otherwise=struck.over_dashpots(first)),
        row("AR, long cylinder", float(last.sel(dashpot=struck.DASHPOT)), struck.sensitivity(last),
            otherwise=struck.over_dashpots(last)),
        row("AR lost over the lengths", f"{drops[1]:.1f} %", drops[0], drops[2]),
        row("TOF, all lengths", struck.interval(flights, 1e6),
            struck.sensitivity(primary.time_of_flight.isel(length=0), 1e6), otherwise=struck.undamped(data)),
        row("characteristic length c T_c/2", Conditions().theory_length() * 1e3,
            otherwise={"beads of 8000 kg/m³": _heavier_length() * 1e3}),
        row("arrival of the primary wave, from impact", incident + float(flights[0]) * 1e6, incident,
            otherwise={"read at the foot of the pulse": _foot(at, incident + float(flights[0]) * 1e6)}),
        row("secondary wave", _secondary(data),
            holds=float(data.amplitude_ratio.sel(wave="secondary", dashpot=struck.DASHPOT).max()) < MEASURED),
        *_axisymmetric(data),
    ]  # fmt: skip


def _heavier_length() -> float:
    """Return the characteristic length, m, with beads of the density that section 6.2.1 uses."""
    return Conditions(bead_material=replace(hl.STEEL_440C, density=8000.0)).theory_length()


def _foot(force: xr.DataArray, peak: float) -> float:
    """Return the time, µs, at which the pulse that peaks at a time, µs, rises above 5 % of its peak."""
    time, values = force.time.values * 1e6, force.values
    top = int(np.searchsorted(time, peak))
    low = np.flatnonzero(values[:top] < 0.05 * values[top])
    return float(time[low[-1]]) if low.size else float("nan")


def _secondary(data: xr.Dataset) -> str:
    return f"AR {float(data.amplitude_ratio.sel(wave='secondary', dashpot=struck.DASHPOT).max()):.2g} or less"


def _axisymmetric(data: xr.Dataset) -> list[Row]:
    wide = [float(data.solid_amplitude_ratio.sel(wave="primary")[i]) for i in (0, -1)]
    apart = float(abs(struck.beyond_rod(data, "amplitude_ratio")).max())
    later = float(struck.beyond_rod(data, "time_of_flight").mean()) * 1e6
    return [
        row("AR, axisymmetric", f"{wide[0]:.3f} to {wide[1]:.3f}", apart, holds=wide[0] - wide[1] < 0.001),
        row("TOF, axisymmetric less 1-D", later),
    ]  # fmt: skip


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR and TOF over the length (figure 6.8), and the force-intensity map (figure 6.7)."""
    of = Conditions.read(data)
    label = f"length of the {of.material.name if of.own else 'steel'} cylinder (mm)"
    figure, axes = draw.panels(2, width=3.9, height=3.4, sharey=False)
    struck.against_length(axes[0], data, "time_of_flight", "primary", "TOF (µs)", label)
    struck.against_length(axes[1], data, "amplitude_ratio", "primary", "AR", label)
    ends = np.array([data.length.min(), data.length.max()]) * 1e3
    draw.theory_line(
        axes[0], ends, np.full(2, of.time_of_flight(of.wall(of.material)) * 1e6), "theory of contact times"
    )
    for axis in axes:
        draw.marked(axis, of.theory_length() * 1e3, "$c\\,T_c/2$")
    if not of.own:
        axes[0].set_ylim(430.0, 490.0)
        axes[1].set_ylim(0.6, 0.85)
    for axis in axes:
        # Opaque, as the dotted line may lie below it.
        axis.legend(frameon=True, framealpha=1.0, edgecolor="none", loc="lower left" if not of.own else "best")
    force = data.sensor_force.sel(sensor=struck.SENSOR).transpose("length", "time").values
    return {
        "length": figure,
        "force_intensity": draw.intensity_map(data.time.values, data.length.values, force, label, 1e3),
    }
