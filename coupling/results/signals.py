"""Measured signals: the Dataset of a run's sensors, made from arrays or read from an oscilloscope's file."""

from collections.abc import Callable, Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from coupling.results.provenance import provenance
from coupling.results.schema import variable
from coupling.results.scope_file import read_table
from coupling.results.sensor import FEWEST_SAMPLES, bridged, quiet_lead, trace
from structures.caution import caution
from structures.checks import duration, finite, instance, not_negative, one_of, whole
from structures.structure import Vector

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}

VOLTS = {"V": 1.0, "mV": 1e-3}

Where = Callable[[int], str]


def as_signal(
    time: ArrayLike,
    forces: Mapping[int, ArrayLike],
    positions: Mapping[int, float] | None = None,
    baseline: float | str = 0.0,
) -> xr.Dataset:
    """The Dataset of a measured signal from arrays, for `reflections` and the other measures.

    Parameters
    ----------
    time : array_like
        Evenly spaced times, s, n numbers. Moments of datetime64 count from the first.
    forces : mapping
        Sensor number → force at the bead's centre, N, n numbers. Where an array of either states another unit, as a
        DataArray or a quantity of pint does, it is converted.
    positions : mapping, optional
        Sensor number → distance along the chain, m; `wave_speed` needs it.
    baseline : float or "lead"
        The zero of the force: its median over the first so many seconds, or over the quiet lead before the first wave.
        0 leaves the force as it is.

    Returns
    -------
    Dataset
        sensor_force, N, over time and sensor.

    Raises
    ------
    ValueError
        For times with gaps, numbers that are not finite, masked or complex, units of something else, and a force that
        is constant.

    Examples
    --------
    >>> import hertzlink as hl
    >>> import numpy as np
    >>> time = np.linspace(0.0, 6e-4, 6001)
    >>> pulse = lambda peak, at: peak * np.exp(-(((time - at) / 1e-5) ** 2))
    >>> signal = hl.as_signal(time, {7: pulse(50.0, 1e-4) + pulse(30.0, 4e-4)})
    >>> print(f"AR = {float(hl.amplitude_ratio(signal, sensor=7)):.2f}")
    AR = 0.60
    """
    instance("forces", forces, Mapping, "a mapping such as {7: force}")
    if not forces:
        raise ValueError("forces = {}: must hold at least one sensor, such as {7: force}")
    moments = trace("time", time, "s")
    rows = {whole("sensor", sensor): trace(f"forces[{sensor}]", force, "N") for sensor, force in forces.items()}
    for sensor, row in rows.items():
        if row.size != moments.size:
            raise ValueError(f"forces[{sensor}]: holds {row.size} numbers, must be as many as time, {moments.size}")
    given = {"signal": "arrays", "sensors": sorted(rows), "baseline": baseline}
    return _dataset(moments, rows, positions, baseline, given, lambda i: f"sample {i}")


def read_signal(
    path: str | Path,
    sensors: Mapping[int, int],
    time_column: int = 0,
    time_unit: str | None = None,
    unit: str | None = None,
    calibration: float | Mapping[int, float] | None = None,
    baseline: float | str = "lead",
    positions: Mapping[int, float] | None = None,
) -> xr.Dataset:
    """The Dataset of a measured signal from an oscilloscope's text file, for `reflections` and the other measures.

    Parameters
    ----------
    path : path
        The file: lines of any kind, then one line for each sample. Commas, semicolons, tabs or blanks separate the
        columns; numbers have decimal points, or decimal commas unless commas separate unquoted columns. Trigger
        times below zero are allowed. Samples beyond the scope's range (inf, -∞, OVER) become NaN, with a warning.
    sensors : mapping
        Sensor number → column, counted from 0.
    time_column : int
        The column of the time, counted from 0.
    time_unit : {"s", "ms", "us", "ns"}, optional
        The unit of the time; by default what the header names, such as "(ms)", else "s".
    unit : {"V", "mV", "N"}, optional
        The unit of the columns; by default what the header names, such as "(mV)", else "V".
    calibration : float or mapping, optional
        κ, N/V, for voltages: one for all sensors, or sensor number → κ; negative for a sensor that is wired the other
        way round. `calibration_factor` measures it.
    baseline : float or "lead"
        The zero of the force: its median over the first so many seconds, or over the quiet lead before the first wave.
        0 leaves the force as it is.
    positions : mapping, optional
        Sensor number → distance along the chain, m; `wave_speed` needs it.

    Returns
    -------
    Dataset
        sensor_force, N, over time and sensor.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If there is no such file; with the line, if it is truncated or garbled, has gaps, numbers that are not finite,
        times that do not increase, or a constant column; if a unit differs from the one that the header names.

    Warns
    -----
    HertzlinkWarning
        If samples are beyond the scope's range.

    Examples
    --------
    >>> import hertzlink as hl
    >>> import numpy as np
    >>> time = np.linspace(0.0, 6e-4, 6001)
    >>> volts = 0.5 * np.exp(-(((time - 1e-4) / 1e-5) ** 2)) + 0.3 * np.exp(-(((time - 4e-4) / 1e-5) ** 2))
    >>> np.savetxt("scope.csv", np.column_stack([time, volts]), delimiter=",", header="time, channel 1")
    >>> signal = hl.read_signal("scope.csv", sensors={7: 1}, calibration=100.0)
    >>> print(f"{hl.reflections(signal, sensor=7).incident.amplitude:.1f} N")
    50.0 N
    """
    instance("path", path, str | Path, "the name of a file")  # type: ignore[arg-type]
    instance("sensors", sensors, Mapping, "a mapping from sensor number to column, such as {7: 1}")
    if not sensors:
        raise ValueError("sensors = {}: must name at least one sensor, such as {7: 1}")
    column_of = {whole("sensor", sensor): whole(f"sensors[{sensor}]", column, 0) for sensor, column in sensors.items()}
    time_column = whole("time_column", time_column, 0)
    if time_column in column_of.values():
        raise ValueError(f"sensors = {dict(sensors)!r}: column {time_column} is the time column")
    if len(set(column_of.values())) < len(column_of):
        raise ValueError(f"sensors = {dict(sensors)!r}: two of them read the same column")
    for name, given_unit, known in (("time_unit", time_unit, SECONDS), ("unit", unit, (*VOLTS, "N"))):
        if given_unit is not None:
            one_of(name, given_unit, known)
    if unit is not None:
        _newtons(unit, calibration, list(column_of))
    if not Path(path).is_file():
        raise ValueError(f"path = {str(path)!r}: must be the name of a file that exists")
    table, lines, named = read_table(Path(path), [time_column, *column_of.values()])
    _check_order(f"{path}, ", table, lines, time_column, list(column_of.values()))
    second = SECONDS[_agreed(str(path), "time_unit", time_unit, named[0], time_column) or "s"]
    rows = {}
    for k, (sensor, column) in enumerate(column_of.items(), start=1):
        its = _agreed(str(path), "unit", unit, named[k], column) or "V"
        rows[sensor] = _without_saturated(
            _newtons(its, calibration, [sensor])[sensor] * table[:, k], f"{path}: sensor {sensor}"
        )
    given = {
        "signal": str(path), "sensors": column_of, "time_column": time_column, "time_unit": time_unit, "unit": unit,
        "calibration": calibration, "baseline": baseline, "units_of_header": named,
    }  # fmt: skip
    return _dataset(
        second * table[:, 0], rows, positions, baseline, given, lambda i: f"{path}, line {lines[i]}", f"{path}: "
    )


def _agreed(path: str, name: str, given: str | None, named: str | None, column: int) -> str | None:
    """The unit that was given or that the header names, or a ValueError where they differ."""
    if given is not None and named is not None and given != named:
        raise ValueError(
            f"{path}: {name} = {given!r}, but the header gives {named!r} for column {column}; leave {name} out to use "
            "that, or correct the header"
        )
    return given or named


def _without_saturated(force: Vector, where: str) -> Vector:
    """The force with NaN for samples that the scope printed as beyond its range, and a warning."""
    beyond = np.isinf(force)
    count = int(beyond.sum())
    if force.size - count < FEWEST_SAMPLES:
        raise ValueError(f"{where}: only {force.size - count} of {force.size} samples are within the scope's range")
    if count:
        caution(f"{where}: {count} samples are beyond the scope's range, and are NaN; choose a wider range")
    return np.where(beyond, np.nan, force)


def _newtons(unit: str, calibration: float | Mapping[int, float] | None, sensors: list[int]) -> dict[int, float]:
    """Newtons for each sensor's unit."""
    if one_of("unit", unit, [*VOLTS, "N"]) == "N":
        if calibration is not None:
            raise ValueError(f"calibration = {calibration!r}: must be None where the unit is N")
        return dict.fromkeys(sensors, 1.0)
    factors = {}
    for sensor in sensors:
        factor = calibration.get(sensor) if isinstance(calibration, Mapping) else calibration
        if factor is None or finite("calibration", factor, "N/V") == 0.0:
            raise ValueError(
                f"calibration = {calibration!r}: must give κ for sensor {sensor}, a number of N/V, not zero"
            )
        factors[sensor] = VOLTS[unit] * float(factor)
    return factors


def _check_order(where: str, table: Vector, lines: list[int], time_column: int, columns: list[int]) -> None:
    """A ValueError where it is not the time column that increases."""
    wrong = np.flatnonzero(np.diff(table[:, 0]) <= 0.0)
    if not wrong.size:
        return
    i = int(wrong[0]) + 1
    text = f"{where}line {lines[i]}: time {table[i, 0]:g} after {table[i - 1, 0]:g}, must increase"
    for k, column in enumerate(columns, start=1):
        if (np.diff(table[:, k]) > 0.0).all():
            text += f"; time_column = {time_column!r}: are the columns swapped? Column {column} increases"
    raise ValueError(text)


def _dataset(
    time: Vector,
    forces: Mapping[int, Vector],
    positions: Mapping[int, float] | None,
    baseline: float | str,
    given: Mapping[str, Any],
    where: Where,
    name: str = "",
) -> xr.Dataset:
    """The Dataset of forces over time; `where` names the place of a sample, and `name` that of all."""
    even = _even(time, where)
    columns = []
    for sensor, force in forces.items():
        known = bridged(force)
        if np.ptp(known) == 0.0:
            raise ValueError(f"{name}sensor {sensor}: the signal is constant, {known[0]:g} N: must hold a wave")
        columns.append(force - _baseline(even, known, baseline, f"{name}sensor {sensor}"))
    data = xr.Dataset(
        {"sensor_force": variable("sensor_force", np.stack(columns, axis=1))},
        coords={"time": ("time", even, {"units": "s"}), "sensor": ("sensor", list(forces))},
        attrs=provenance(given),
    )
    if positions is None:
        return data
    instance("positions", positions, Mapping, "a mapping from sensor number to position, such as {7: 0.062}")
    for sensor in forces:
        if sensor not in positions:
            raise ValueError(f"positions = {dict(positions)!r}: must hold sensor {sensor}, a position in m")
    places = [finite(f"positions[{sensor}]", positions[sensor], "m") for sensor in forces]
    along = [place for _, place in sorted(zip(forces, places, strict=True))]
    if any(after <= before for before, after in pairwise(along)):
        raise ValueError(f"positions = {dict(positions)!r}: must increase with the number of the sensor")
    return data.assign_coords(centre=("sensor", places, {"units": "m", "long_name": "position along the chain"}))


def _even(time: Vector, where: Where) -> Vector:
    """Exactly even times, close to those given, or a ValueError where these have gaps."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    bad = np.flatnonzero((steps <= 0.0) | (steps > 1.5 * usual))
    if bad.size:
        i = int(bad[0])
        what = "times must increase" if steps[i] <= 0.0 else f"a gap; the usual step is {usual:.3g} s"
        raise ValueError(f"{where(i + 1)}: time {time[i + 1]:.9g} s after {time[i]:.9g} s: {what}")
    even = np.linspace(time[0], time[-1], time.size)
    off = np.abs(time - even)
    if off.max() > usual:
        raise ValueError(f"{where(int(off.argmax()))}: times must be evenly spaced, as one sampling rate gives them")
    return even


def _baseline(time: Vector, force: Vector, baseline: float | str, where: str) -> float:
    if isinstance(baseline, str):
        one_of("baseline", baseline, ["lead"])
        try:
            return float(np.median(force[: quiet_lead(f"{where}, baseline = {baseline!r}", force)]))
        except ValueError as error:
            lasts = duration(float(time[-1] - time[0]))
            raise ValueError(f"{error}; the record lasts {lasts}, {time.size} samples") from None
    seconds = not_negative("baseline", baseline, "s")
    if seconds == 0.0:
        return 0.0
    if seconds > time[-1] - time[0]:
        raise ValueError(f"baseline = {baseline!r}: must be shorter than the signal, {time[-1] - time[0]:g} s")
    return float(np.median(force[time <= time[0] + seconds]))
