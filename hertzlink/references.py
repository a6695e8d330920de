"""Regression tests of your own models: their waves are compared with a file that an earlier version wrote."""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import one_of_each, warn
from coupling.results.measures import sensor_force
from coupling.results.provenance import differences, unfolded, version_of, versions
from coupling.results.reading import Reading, force_of_last
from hertzlink.output_folder import write_file
from structures.caution import collected
from structures.checks import count_of, instance, listed, not_negative, one_of, short, whole
from structures.meshes.hdf5 import check_hdf5
from structures.structure import Vector

FORMAT, VERSION = "hertzlink reference", 1

UPDATE = "HERTZLINK_UPDATE_REFERENCES"
"""The environment variable with which references are written."""

MOST_INPUTS = 8
"""So many differences of the input are listed."""

WAVES = ("primary", "secondary")

LAST_CONTACT = "force at the last contact"

RATIO, FLIGHT, FORCE = "amplitude_ratio", "time_of_flight", "force"
"""The kinds of quantities, each of which may have tolerances of its own."""

KINDS = (RATIO, FLIGHT, FORCE)

MICRO = 1e6
"""Times of flight are shown in µs."""

SAME_TIMES = 1e-9
"""Saved times that differ by less than this part of the record are the same."""

Tolerance = float | Mapping[str, float]


def assert_same_waves(
    run: xr.Dataset,
    reference: str | os.PathLike[str],
    rtol: float | Mapping[str, float] = 1e-5,
    atol: float | Mapping[str, float] = 0.0,
    sensors: Sequence[int] | None = None,
    update: bool | None = None,
) -> None:
    """Compare the waves of a result with a reference that was saved, for a regression test.

    Parameters
    ----------
    run : Dataset
        A run, a sweep, a batch or a measured signal.
    reference : path
        The netCDF file of the reference.
    rtol : float or mapping
        Relative tolerance. A mapping gives it by kind: "amplitude_ratio", "time_of_flight", "force"; kinds that it
        does not name have 1e-5.
    atol : float or mapping
        Absolute tolerance, which is added: for AR a number, for TOF in s, for a force in N. By kind as `rtol`; kinds
        that it does not name have 0.
    sensors : list of int, optional
        Numbers of the beads whose waves count. By default those of the reference; where it is written, the bead in the
        middle of the chain, or all sensors of a signal.
    update : bool, optional
        True writes the reference, whole or not at all, and compares nothing. By default the environment variable
        HERTZLINK_UPDATE_REFERENCES decides.

    Returns
    -------
    None
        Where all quantities agree.

    Raises
    ------
    AssertionError
        If a quantity differs by more than atol + rtol · |reference|. The message lists the quantities that differ, and
        whether input or versions differ.
    ValueError
        If the reference is missing or is none, or an argument is wrong.

    Notes
    -----
    What is compared: AR and TOF of the primary and the secondary wave at each sensor, and the forces over time at the
    sensors and at the last contact of the chain. Of forces the root mean square of the difference is compared with that
    of the reference. If the saved times differ, forces are interpolated. A wave that only one of them has is a
    difference. In a sweep or a batch the worst run counts.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> hl.testing.assert_same_waves(run, "wall.nc", update=True)
    >>> hl.testing.assert_same_waves(run, "wall.nc", rtol=1e-6)
    """
    # pytest shows the table of differences, not this code.
    __tracebackhide__ = True
    if not isinstance(reference, str | os.PathLike) or not os.fspath(reference):
        raise ValueError(f"reference = {short(reference)}: must be the path of a netCDF file")
    path = Path(reference).expanduser()
    relative, absolute = _by_kind("rtol", rtol, 1e-5), _by_kind("atol", atol, 0.0)
    write = os.environ.get(UPDATE, "") not in ("", "0")
    if update is not None:
        write = instance("update", update, bool, "True, False or None")
    _check(run)
    old = None if write else _read(path)
    listed_sensors = None if old is None else [int(number) for number in np.atleast_1d(old.attrs["sensors"])]
    chosen = _sensors(sensors) or listed_sensors or _default_sensors(run)
    with collected() as findings:
        now = _kept_waves(run, chosen)
    warn(one_of_each(findings))
    if old is None:
        inputs = {name: str(run.attrs[name]) for name in ("input", "versions") if name in run.attrs}
        origin = {"format": FORMAT, "format_version": VERSION, "hertzlink": versions()["hertzlink"], "sensors": chosen}
        _write(path, now.assign_attrs(**origin, **inputs))
        return
    complaint = _complaint(old, now, run, (relative, absolute))
    if complaint:
        raise AssertionError(f"the waves differ from those in {path}:\n" + "\n".join(complaint))


def _check(run: object) -> None:
    """Raise a ValueError for what has no forces over increasing times."""
    data = Reading(run).data
    times = data["time"].values if "time" in data.coords else np.empty(0)
    if times.dtype.kind not in "iuf" or times.size < 2 or not (np.diff(times) > 0.0).all():
        raise ValueError("run: must have two or more saved times, in increasing order")
    for name in ("contact_force", "sensor_force"):
        if name in data and data[name].dtype.kind not in "iuf":
            raise ValueError(f"run: {name} must be real numbers")


def _complaint(old: xr.Dataset, now: xr.Dataset, run: xr.Dataset, tolerances: Any) -> list[str]:
    """Return the lines of the message; none where all agrees."""
    lines, record = _shapes(old, now), _records(old, now)
    if not lines:
        rows = list(_rows(old, now, *tolerances))
        fails = [row for row in rows if row.fails]
        ends = [line for line in record if "ends" in line]
        if not fails and not ends:
            return []
        if fails:
            lines = _table(fails)
        if len(fails) < len(rows):
            lines.append(f"{len(rows) - len(fails)} of {len(rows)} quantities agree")
    return [f"  {line}" for line in [*lines, *record]] + [
        _who_wrote(old, run),
        _input(old, run),
        f"If the change is meant, write the reference again: update=True, or {UPDATE}=1.",
    ]


def _who_wrote(old: xr.Dataset, run: xr.Dataset) -> str:
    """Return whether another version wrote the reference, or ran."""
    writer, here = str(old.attrs["hertzlink"]), version_of("hertzlink")
    this = "and is the version here" if writer == here else f"this is {here}"
    first = f"hertzlink {writer} wrote the reference; {this}"
    there, now = (_json(data.attrs.get("versions", "")) for data in (old, run))
    if there == now:
        return f"versions: the same; {first}"
    return f"versions: {first}; " + "; ".join(differences(there, now))


def _input(old: xr.Dataset, run: xr.Dataset) -> str:
    there, now = (_json(data.attrs.get("input", "")) for data in (old, run))
    changes = list(differences(there, now))
    if not changes:
        return "input: the same"
    more = [f"and {len(changes) - MOST_INPUTS} more"] if len(changes) > MOST_INPUTS else []
    return "input: " + "; ".join([*changes[:MOST_INPUTS], *more])


def _json(text: object) -> Any:
    try:
        return unfolded(json.loads(str(text))) if text else None
    except (ValueError, RecursionError):
        return str(text)


def _write(path: Path, waves: xr.Dataset) -> None:
    packed = {
        name: {"zlib": True, "shuffle": True, "_FillValue": None} if variable.ndim else {"_FillValue": None}
        for name, variable in waves.variables.items()
    }
    content = bytes(waves.to_netcdf(engine="h5netcdf", encoding=packed))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_file(path, content)


def _read(path: Path) -> xr.Dataset:
    if not path.is_file():
        raise ValueError(f"reference: {path} does not exist; write it with update=True, or with {UPDATE}=1")
    content = BytesIO(path.read_bytes())
    check_hdf5(content, f"reference: {path}")
    try:
        with xr.open_dataset(content, engine="h5netcdf", decode_times=False, mask_and_scale=False) as file:
            data = file.load().drop_encoding()
    except (OSError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise ValueError(f"reference: {path} cannot be read ({error}); write it again") from error
    whole_one = {"sensors", "hertzlink"} <= set(data.attrs) and "time" in data.coords
    kinds = {variable.attrs.get("kind") for variable in data.data_vars.values()}
    if data.attrs.get("format") != FORMAT or not whole_one or not kinds <= set(KINDS):
        raise ValueError(
            f"reference: {path} was not written by assert_same_waves; give another file, or write it again"
        )
    if int(data.attrs.get("format_version", 0)) > VERSION:
        raise ValueError(
            f"reference: {path} was written by hertzlink {data.attrs['hertzlink']}, in a form that this version does "
            "not know; update hertzlink, or write it again"
        )
    return data


def _by_kind(name: str, tolerance: Tolerance, default: float) -> dict[str, float]:
    if isinstance(tolerance, Mapping):
        for kind in tolerance:
            one_of(name, kind, KINDS)
        return {kind: not_negative(f"{name}[{kind!r}]", tolerance.get(kind, default)) for kind in KINDS}
    return dict.fromkeys(KINDS, not_negative(name, tolerance))


def _sensors(sensors: Sequence[int] | None) -> list[int]:
    numbers = [] if sensors is None else listed("sensors", sensors, object, "numbers of beads")
    return list(dict.fromkeys(whole("sensors", number) for number in numbers))


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


def _default_sensors(run: xr.Dataset) -> list[int]:
    """Return all sensors of a signal; of a run the bead in the middle of those whose contacts were kept."""
    reading = Reading(run)
    if reading.is_signal:
        return [int(number) for number in np.atleast_1d(run.sensor.values)]
    if not reading.whole_beads:
        raise ValueError("run: must hold the forces of both contacts of a bead")
    return [reading.whole_beads[len(reading.whole_beads) // 2]]


def _kept_waves(run: xr.Dataset, sensors: Sequence[int]) -> xr.Dataset:
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
            force_of_last, force, input_core_dims=[["contact", "time"]], output_core_dims=[["time"]], vectorize=True
        )
        waves[LAST_CONTACT] = _trace(last)
    return xr.Dataset({name: values.reset_coords(drop=True).rename(None) for name, values in waves.items()})


def _rows(
    reference: xr.Dataset, now: xr.Dataset, rtol: Mapping[str, float], atol: Mapping[str, float]
) -> Iterator[Row]:
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
        axes = [axis for axis in old.dims if axis != "time"]
        words = ", ".join(f"{axis} = {old[axis].values[at]}" for axis, at in zip(axes, worst, strict=True))
        where = f" at {words}" if words else ""
        yield Row(name + where, kind, *(float(values[worst]) for values in (first, second, gap, allowed)))


def _shapes(reference: xr.Dataset, now: xr.Dataset) -> list[str]:
    """Return why two results cannot be compared number by number: other axes, or values along them."""
    changes = []
    for axis in dict.fromkeys(str(name) for data in (reference, now) for name in data.dims if name != "time"):
        there, here = (_values_along(data, axis) for data in (reference, now))
        if there != here:
            changes.append(f"{axis} = {there} there and {here} here")
    return changes


def _records(reference: xr.Dataset, now: xr.Dataset) -> list[str]:
    """Return how the saved times differ, in words; a record of another length is not comparable beyond its end."""
    old, new = reference["time"].values, now["time"].values
    step = (old[-1] - old[0]) / max(1, old.size - 1)
    if abs(old[-1] - new[-1]) > 1.5 * step:
        return [f"the record ends at {MICRO * old[-1]:.6g} µs there and {MICRO * new[-1]:.6g} µs here"]
    return [] if _same_times(old, new) else [f"{old.size} saved times there and {new.size} here; forces interpolated"]


def _table(rows: Sequence[Row]) -> list[str]:
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


def _rms(values: Vector) -> Vector:
    """Return the root of the mean square over time, without what is not a number."""
    finite = np.isfinite(values)
    total: Vector = np.where(finite, values, 0.0) ** 2
    mean: Vector = total.sum(axis=-1) / np.maximum(1, finite.sum(axis=-1))
    return np.sqrt(mean)


def _same_times(first: Vector, second: Vector) -> bool:
    return first.shape == second.shape and bool(
        np.allclose(first, second, rtol=0.0, atol=SAME_TIMES * (first[-1] - first[0]))
    )


def _on_times(values: Vector, times: Vector, wanted: Vector) -> Vector:
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
    return data[axis].values.tolist() if axis in data.coords else count_of(data.sizes[axis], "value")
