"""Thesis section 6.1.2: clamped steel cylinders of 6 to 610 mm return the same wave, except for a few percent."""

from dataclasses import replace

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies import struck_cylinders as struck
from hertzlink.studies.table import MEASURED, Row, Rows
from structures.structure import Vector

row = Rows("rod_length")
RADIUS = 9.53e-3
LENGTHS = tuple(np.geomspace(6.35e-3, 101.6e-3, 25)) + tuple(np.geomspace(101.6e-3, 609.6e-3, 17)[1:])
SOLID_LENGTHS = (6.35e-3, 12.7e-3, 25.4e-3, 50.8e-3, 76.2e-3, 101.6e-3, 152.4e-3, 304.8e-3, 609.6e-3)


class Cylinders(struck.OverLength):
    """Steel cylinders."""

    def stack(self, length: float) -> list[hl.Layer]:
        """Return the cylinder."""
        return [hl.Layer(hl.STEEL_440C, length, RADIUS)]

    def expected(self, lengths: Vector) -> xr.Dataset:
        """Return TOF, s, by equation 6.20, without losses and preload; it is the same for all lengths."""
        flight = float(self.time_of_flight(self.wall(hl.STEEL_440C)))
        return xr.Dataset({"time_of_flight": ("length", np.full(len(lengths), flight))})

    def theory_length(self) -> float:
        """Return the characteristic length c T_c/2, m, with T_c of one bead at the striker's speed (equation 6.8)."""
        return float(hl.theory.characteristic_length(hl.STEEL_440C.bar_speed, self.contact_time(hl.STEEL_440C)))


THESIS = Cylinders()


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR, TOF and the force at the sensors over the length of a cylinder. quick: every fourth length."""
    few = LENGTHS[::4], (SOLID_LENGTHS[0], 101.6e-3, SOLID_LENGTHS[-1])
    return struck.over_lengths(THESIS, quick, jobs, *(few if quick else (LENGTHS, SOLID_LENGTHS)))


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of section 6.1.2 and figure 6.8, compared with those of hertzlink."""
    return [*_amplitudes(data), *_flights(data), *_others(data)]


def _amplitudes(data: xr.Dataset) -> list[Row]:
    ratios = data.amplitude_ratio.sel(wave="primary")
    low, middle, high = (ratios.sel(dashpot=dashpot) for dashpot in struck.DASHPOTS)
    others = "; ".join(f"{struck.interval(part)} for γ = {d:g}" for part, d in ((low, 4.0), (high, 6.0)))
    rows = [row("AR, all lengths", struck.interval(middle), others, otherwise=struck.over_dashpots(ratios))]
    for name, place in (("AR, short cylinder", 0), ("AR, long cylinder", -1)):
        end = ratios.isel(length=place, drop=True)
        said = struck.sensitivity(end)
        rows.append(row(name, float(middle[place]), said, otherwise=struck.over_dashpots(end)))
    lost = f"{struck.lost(middle):.1f} %"
    return [*rows, row("AR lost over the lengths", lost, struck.lost(low), struck.lost(high))]


def _flights(data: xr.Dataset) -> list[Row]:
    flights = data.time_of_flight.sel(wave="primary")
    middle, shortest = flights.sel(dashpot=struck.DASHPOT), struck.sensitivity(flights.isel(length=0), 1e6)
    at = data.sensor_force.sel(sensor=struck.SENSOR).isel(length=0)
    incident = float(at.time[int(at.where(at.time < 3e-4, 0.0).values.argmax())]) * 1e6
    arrival = incident + float(middle[0]) * 1e6
    foot = {"read at the foot of the pulse": _foot(at, arrival)}
    heavier = Cylinders(bead_material=replace(hl.STEEL_440C, density=8000.0)).theory_length() * 1e3
    length, of_heavier = THESIS.theory_length() * 1e3, {"beads of 8000 kg/m³": heavier}
    return [
        row("TOF, all lengths", struck.interval(middle, 1e6), shortest, struck.undamped(data)),
        row("characteristic length c T_c/2", length, otherwise=of_heavier),
        row("arrival of the primary wave, from impact", arrival, incident, otherwise=foot),
    ]


def _foot(force: xr.DataArray, peak: float) -> float:
    """Return the time, µs, at which the pulse that peaks at a time, µs, rises above 5 % of its peak."""
    time, values = force.time.values * 1e6, force.values
    top = int(np.searchsorted(time, peak))
    low = np.flatnonzero(values[:top] < 0.05 * values[top])
    return float(time[low[-1]]) if low.size else float("nan")


def _others(data: xr.Dataset) -> list[Row]:
    """Return the secondary wave, and axisymmetric cylinders."""
    secondary = float(data.amplitude_ratio.sel(wave="secondary", dashpot=struck.DASHPOT).max())
    first, last = data.solid_amplitude_ratio.sel(wave="primary").values[[0, -1]].tolist()
    apart = float(abs(struck.beyond_rod(data, "amplitude_ratio")).max())
    return [
        row("secondary wave", f"AR {secondary:.2g} or less", holds=secondary < MEASURED),
        row("AR, axisymmetric", f"{first:.3f} to {last:.3f}", apart, holds=first - last < MEASURED * first),
        row("TOF, axisymmetric less 1-D", float(struck.beyond_rod(data, "time_of_flight").mean()) * 1e6),
    ]


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR and TOF over the length (figure 6.8), and the force-intensity map (figure 6.7)."""
    label = "length of the steel cylinder (mm)"
    figure, axes = draw.panels(2, width=3.9, height=3.4, sharey=False)
    struck.against_length(axes[0], data, "time_of_flight", "primary", "TOF (µs)", label)
    struck.against_length(axes[1], data, "amplitude_ratio", "primary", "AR", label)
    ends = np.array([data.length.min(), data.length.max()]) * 1e3
    theory = np.full(2, THESIS.time_of_flight(THESIS.wall(hl.STEEL_440C)) * 1e6)
    draw.theory_line(axes[0], ends, theory, "theory of contact times")
    for axis in axes:
        draw.marked(axis, THESIS.theory_length() * 1e3, "$c\\,T_c/2$")
        # Opaque, as the dotted line may lie below it.
        axis.legend(frameon=True, framealpha=1.0, edgecolor="none", loc="lower left")
    axes[0].set_ylim(430.0, 490.0)
    axes[1].set_ylim(0.6, 0.85)
    return {"length": figure, "force_intensity": struck.force_intensity(data, label)}
