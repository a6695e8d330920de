"""The waves that a regression test keeps, and how two of these differ: AR, TOF, and the traces of force in norm."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.measures import sensor_force
from coupling.results.reading import Reading

WAVES = ("primary", "secondary")

LAST_CONTACT = "force at the last contact"

RATIO, FLIGHT, FORCE = "amplitude_ratio", "time_of_flight", "force"
"""The kinds of quantities, each of which may have tolerances of its own."""

KINDS = (RATIO, FLIGHT, FORCE)

MICRO = 1e6
"""Times of flight are shown in µs."""

SAME_TIMES = 1e-9
"""Saved times that differ by less than this part of the record are the same."""


class Row(NamedTuple):
    """A quantity of the reference and now, their difference and how much it may be; in SI, for AR 1.

    Of a trace the numbers are root mean squares, and the difference is that of the traces, not of the numbers.
    """

    quantity: str
    kind: str
    reference: float
    now: float
    difference: float
    tolerance: float

    @property
    def fails(self) -> bool:
        """True beyond the tolerance, also where only one of them has a wave."""
        return not self.difference <= self.tolerance


def default_sensors(run: xr.Dataset) -> list[int]:
    """Return all sensors of a signal; of a run the bead in the middle of those whose contacts were kept."""
    reading = Reading(run)
    if reading.is_signal:
        return [int(number) for number in np.atleast_1d(run.sensor.values)]
    whole_beads = [n for n in sorted(reading.kept) if n > 0 and n + 1 in reading.kept]
    if not whole_beads:
        raise ValueError("run: must hold the forces of both contacts of a bead")
    return [whole_beads[len(whole_beads) // 2]]


def kept_waves(run: xr.Dataset, sensors: Sequence[int]) -> xr.Dataset:
    """Return the quantities of a result, by their names: of each sensor AR, TOF and force, and the force at the last
    contact.

    The time is the last dimension of forces; what comes before it are chains and the axes of a sweep.
    """
    reading = Reading(run)
    waves: dict[str, xr.DataArray] = {}
    for sensor in sensors:
        for wave in WAVES:
            waves[f"AR at bead {sensor}, {wave} wave"] = amplitude_ratio(run, sensor, wave).assign_attrs(kind=RATIO)
            waves[f"TOF at bead {sensor}, {wave} wave"] = time_of_flight(run, sensor, wave).assign_attrs(kind=FLIGHT)
        waves[f"force at bead {sensor}"] = _trace(sensor_force(run, sensor))
    if not reading.is_signal:
        force = reading.dynamic_force().reset_coords(drop=True)
        last = xr.apply_ufunc(
            _last, force, input_core_dims=[["contact", "time"]], output_core_dims=[["time"]], vectorize=True
        )
        waves[LAST_CONTACT] = _trace(last)
    return xr.Dataset({name: values.reset_coords(drop=True).rename(None) for name, values in waves.items()})


def rows(reference: xr.Dataset, now: xr.Dataset, rtol: Mapping[str, float], atol: Mapping[str, float]) -> Iterator[Row]:
    """Yield each quantity of either; of several runs the one that differs most. rtol, atol: tolerances by kind."""
    times = reference["time"].values
    for name in dict.fromkeys([*map(str, reference.data_vars), *map(str, now.data_vars)]):
        if name not in now or name not in reference:
            kind = str((now if name in now else reference)[name].attrs["kind"])
            yield Row(name, kind, float("nan"), float("nan"), float("inf"), 0.0)
            continue
        kind = str(reference[name].attrs["kind"])
        old, new = reference[name], now[name].transpose(*reference[name].dims)
        if kind == FORCE:
            values = _on_times(new.values, now["time"].values, times)
            first, second, gap = (_rms(trace) for trace in (old.values, values, values - old.values))
            gap = np.where((np.isnan(values) != np.isnan(old.values)).any(axis=-1), np.inf, gap)
        else:
            first, second = np.asarray(old.values, float), np.asarray(new.values, float)
            gap = abs(second - first)
            gap = np.where(np.isnan(first) & np.isnan(second), 0.0, np.where(np.isnan(gap), np.inf, gap))
        allowed = atol[kind] + rtol[kind] * np.nan_to_num(abs(first))
        worst = np.unravel_index(int(np.argmax(gap - allowed)), gap.shape) if gap.ndim else ()
        where = _where(old, [int(index) for index in worst])
        yield Row(name + where, kind, *(float(values[worst]) for values in (first, second, gap, allowed)))


def shapes(reference: xr.Dataset, now: xr.Dataset) -> list[str]:
    """Return why two results cannot be compared number by number: other axes, or values along them."""
    changes = []
    for axis in dict.fromkeys(str(name) for data in (reference, now) for name in data.dims if name != "time"):
        there, here = (_values_along(data, axis) for data in (reference, now))
        if there != here:
            changes.append(f"{axis} = {there} there and {here} here")
    return changes


def records(reference: xr.Dataset, now: xr.Dataset) -> list[str]:
    """Return how the saved times differ, in words; a record of another length is not comparable beyond its end."""
    old, new = reference["time"].values, now["time"].values
    step = (old[-1] - old[0]) / max(1, old.size - 1)
    if abs(old[-1] - new[-1]) > 1.5 * step:
        return [f"the record ends at {MICRO * old[-1]:.6g} µs there and {MICRO * new[-1]:.6g} µs here"]
    return [] if _same_times(old, new) else [f"{old.size} saved times there and {new.size} here; forces interpolated"]


def table(rows: Sequence[Row]) -> list[str]:
    """Return the rows as lines of aligned columns, with a heading."""
    head = ("quantity", "reference", "now", "difference", "tolerance")
    cells = [head, *(_cells(row) for row in rows)]
    widths = [max(len(row[column]) for row in cells) for column in range(len(head))]
    return [
        "  ".join([row[0].ljust(widths[0]), *(cell.rjust(w) for cell, w in zip(row[1:], widths[1:], strict=True))])
        for row in cells
    ]


def _cells(row: Row) -> tuple[str, ...]:
    scale, unit = {RATIO: (1.0, ""), FLIGHT: (MICRO, " µs"), FORCE: (1.0, " N rms")}[row.kind]

    def value(number: float) -> str:
        none = "none" if row.kind == FORCE else "no wave"
        return none if np.isnan(number) else f"{scale * number:.7g}{unit}"

    difference = "-" if np.isinf(row.difference) else f"{scale * row.difference:.2g}{unit}"
    return row.quantity, value(row.reference), value(row.now), difference, f"{scale * row.tolerance:.2g}{unit}"


def _trace(force: xr.DataArray) -> xr.DataArray:
    return force.transpose(..., "time").assign_attrs(kind=FORCE, units="N")


def _last(forces: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the force of the last contact that a chain has, contacts × time: a shorter chain is padded."""
    there = forces[~np.isnan(forces).all(axis=1)]
    last: NDArray[np.float64] = there[-1] if len(there) else forces[-1]
    return last


def _rms(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the root of the mean square over time, without what is not a number."""
    finite = np.isfinite(values)
    total: NDArray[np.float64] = np.where(finite, values, 0.0) ** 2
    mean: NDArray[np.float64] = total.sum(axis=-1) / np.maximum(1, finite.sum(axis=-1))
    return np.sqrt(mean)


def _same_times(first: NDArray[np.float64], second: NDArray[np.float64]) -> bool:
    return first.shape == second.shape and bool(
        np.allclose(first, second, rtol=0.0, atol=SAME_TIMES * (first[-1] - first[0]))
    )


def _on_times(
    values: NDArray[np.float64], times: NDArray[np.float64], wanted: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the traces at other times, by cubic splines: straight lines would differ by 1e-4 between samples."""
    if _same_times(times, wanted):
        return values
    from scipy.interpolate import CubicSpline

    rough = np.isnan(values).any(axis=-1, keepdims=True)
    spline: Any = CubicSpline(times, np.where(rough, 0.0, values), axis=-1)
    return np.where(rough, np.nan, spline(np.clip(wanted, times[0], times[-1])))


def _values_along(data: xr.Dataset, axis: str) -> Any:
    if axis not in data.dims:
        return "none"
    return data[axis].values.tolist() if axis in data.coords else f"{data.sizes[axis]} values"


def _where(values: xr.DataArray, place: Sequence[int]) -> str:
    """Return the place along chains and axes, in words."""
    axes = [axis for axis in values.dims if axis != "time"]
    words = [f"{axis} = {values[axis].values[at]}" for axis, at in zip(axes, place, strict=True)]
    return f" at {', '.join(words)}" if words else ""
