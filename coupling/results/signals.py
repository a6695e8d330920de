"""Measured signals: the Dataset of a run's sensors, made from arrays or read from an oscilloscope's file."""

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from coupling.results.provenance import provenance
from coupling.results.schema import variable
from coupling.results.sensor_trace import checked_trace, interpolated_over_gaps, is_inverted, quiet_lead, smoothed
from coupling.results.signal_file import Sampling, on_one_time, read_trace
from coupling.results.text_header import FORCE, TIME, quantity_of
from structures.caution import caution, collected
from structures.checks import existing, finite, instance, not_negative, one_of, positive, short, whole
from structures.quantities import Likely
from structures.structure import Vector
from structures.units import readable


def as_signal(
    time: ArrayLike,
    forces: Mapping[int, ArrayLike],
    positions: Mapping[int, float] | None = None,
    baseline: float | str = 0.0,
) -> xr.Dataset:
    """Return the Dataset of a measured signal from arrays, for `reflections` and the other measures.

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
        The zero of the force: its median over this time, s, from the start on, or over the quiet lead,
        which is before the first wave. 0 leaves the force as it is.

    Returns
    -------
    Dataset
        sensor_force, N, over time and sensor.

    Raises
    ------
    ValueError
        For times with gaps, numbers that are not finite, masked or complex, units of something else, and a force that
        is constant.

    Warns
    -----
    HertzlinkWarning
        If all waves are negative, or times and forces are so large or small that a unit may be wrong.

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
    moments = checked_trace("time", time, "s")
    rows = {whole("sensor", n): checked_trace(f"forces[{n}]", force, "N", moments.size) for n, force in forces.items()}
    inputs = {"signal": "arrays", "sensors": sorted(rows), "baseline": baseline}
    data = _dataset(_even(moments), rows, positions, baseline, inputs)
    for doubt in _doubts(data, "change the sign of the forces"):
        caution(f"forces: {doubt}")
    return data


def read_signal(
    path: str | Path | Mapping[int, str | Path],
    sensors: Mapping[int, int],
    time_column: int | None = None,
    time_unit: str | None = None,
    unit: str | None = None,
    calibration: float | Mapping[int, float] | None = None,
    baseline: float | str = "lead",
    positions: Mapping[int, float] | None = None,
    interval: float | None = None,
    start: float | None = None,
    segment: int | None = None,
) -> xr.Dataset:
    """Read a measured signal from the file of an oscilloscope or recorder, for `reflections` and others.

    Parameters
    ----------
    path : path or mapping
        The file, or sensor number → file of a recorder that writes one for each channel. Lines of any kind, then one
        line for each sample. Commas, semicolons, tabs or blanks separate the columns; numbers have decimal points or
        commas. Trigger times below zero are allowed. What is no number (9.9E+37, OVER, an empty cell) becomes NaN, and
        lines that are no samples are left out, each with a warning. Or a binary file of Tektronix, LeCroy, Keysight,
        Rigol, Siglent, Rohde & Schwarz, Yokogawa, LabVIEW or MATLAB, WAV, HDF5, UFF 58, xlsx or Parquet, for most of
        which ``hertzlink[recorders]`` must be installed.
    sensors : mapping
        Sensor number → column, counted from 0; of a binary file the channel, counted from 1.
    time_column : int, optional
        The column of the time, counted from 0; by default, for each sensor, the nearest column to the left that
        increases from line to line.
    time_unit : str, optional
        The unit of the time, such as "us"; by default what the header names, such as "(ms)", else "s".
    unit : str, optional
        The unit of the columns, a voltage or a force, such as "mV" or "N"; by default what the header names, else "V".
    calibration : float or mapping, optional
        κ, N/V, for voltages: one for all sensors, or sensor number → κ; negative for a sensor that is wired the other
        way round. `calibration_factor` measures it.
    baseline : float or "lead"
        The zero of the force: its median over this time, s, from the start on, or over the quiet lead,
        which is before the first wave. 0 leaves the force as it is.
    positions : mapping, optional
        Sensor number → distance along the chain, m; `wave_speed` needs it.
    interval : float, optional
        Time from sample to sample, s, of a file without a column of times; a column of times is then not read. By
        default what the header states, such as "Increment".
    start : float, optional
        Time of the first sample, s; by default as the column of times, or else the header, states it, and 0 without
        either.
    segment : int, optional
        Which segment of a sequence to read, counted from 1.

    Returns
    -------
    Dataset
        sensor_force, N, over time and sensor. The attribute ``reading`` holds what was left out or assumed, one
        sentence a line.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If there is no such file; if it is no text, with its format; with the line, if many lines are garbled, times do
        not increase or have gaps; for a constant column; if a unit is not understood, or differs from the one that the
        header names; for a sequence, if no segment is chosen.

    Warns
    -----
    HertzlinkWarning
        If lines were left out, samples are missing or beyond the scope's range, times have too few digits, all waves
        are negative, or times and forces are so large or small that a unit may be wrong.

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
    if isinstance(path, list | tuple):
        raise ValueError(
            f"path = {short(path)}: must be one file, or {{sensor: file}} for files of one channel each; for taps, "
            "average_taps([read_signal(file, …) for file in files])"
        )
    instance("path", path, str | Path | Mapping, "the name of a file, or {sensor: file}")  # type: ignore[arg-type]
    instance("sensors", sensors, Mapping, "a mapping from sensor number to column, such as {7: 1}")
    if not sensors:
        raise ValueError("sensors = {}: must name at least one sensor, such as {7: 1}")
    column_of = {whole("sensor", sensor): whole(f"sensors[{sensor}]", column, 0) for sensor, column in sensors.items()}
    sampling = _sampling(time_column, time_unit, interval, start, segment)
    if sampling.column in column_of.values():
        raise ValueError(f"sensors = {dict(sensors)!r}: column {sampling.column} is the time column")
    files = dict.fromkeys(column_of, path) if isinstance(path, str | Path) else dict(path)
    if files.keys() != column_of.keys():
        raise ValueError(f"path = {short(path)}: must hold a file for each of sensors {', '.join(map(str, column_of))}")
    for sensor, file in files.items():
        instance(f"path[{sensor}]", file, str | Path, "the name of a file")  # type: ignore[arg-type]
    if len({(str(files[sensor]), column) for sensor, column in column_of.items()}) < len(column_of):
        raise ValueError(f"sensors = {dict(sensors)!r}: two of them read the same column")
    if unit is not None:
        _newtons(_si("unit", unit, FORCE), calibration, list(column_of))
    traces = {
        file: read_trace(existing(f"path = {str(file)!r}", Path(file)), its, sampling, unit)
        for file in dict.fromkeys(files.values())
        for its in [{n: column_of[n] for n in files if files[n] == file}]
    }
    notes = [f"{file}: {note}" for file, read in traces.items() for note in read.notes]
    units = {sensor: unit for read in traces.values() for sensor, unit in read.units.items()}
    pieces = {file: (read.time, read.columns) for file, read in traces.items()}
    time, columns = on_one_time(f"path: {', '.join(map(str, pieces))}", pieces, notes)
    rows = {n: _newtons(units[n], calibration, [n])[n] * columns[n] for n in column_of}
    names = str(path) if isinstance(path, str | Path) else {n: str(file) for n, file in files.items()}
    inputs = {
        "signal": names, "sensors": column_of, "time_column": time_column, "time_unit": time_unit, "unit": unit,
        "calibration": calibration, "baseline": baseline, "interval": interval, "start": start, "segment": segment,
        "units_of_columns": units,
    }  # fmt: skip
    where = f"{', '.join(map(str, pieces))}: "
    data = _dataset(time, rows, positions, baseline, inputs, where)
    notes += [f"{where}{doubt}" for doubt in _doubts(data, "give a negative calibration")]
    for note in notes:
        caution(note)
    return data.assign_attrs(reading="\n".join(note.removeprefix(where) for note in notes))


def _sampling(
    column: int | None, unit: str | None, interval: float | None, start: float | None, segment: int | None
) -> Sampling:
    """Return the arguments of read_signal on the time, checked."""
    if unit is not None:
        _si("time_unit", unit, TIME)
    if interval is not None and column is not None:
        raise ValueError(f"interval = {interval!r}: is for a file without times; leave out time_column or interval")
    return Sampling(
        None if column is None else whole("time_column", column, 0), unit,
        None if interval is None else positive("interval", interval, "s"),
        None if start is None else finite("start", start, "s"),
        None if segment is None else whole("segment", segment),
    )  # fmt: skip


def _si(name: str, unit: str, wanted: str) -> str:
    """Return the SI unit of a unit of time, or of a voltage or force; raise a ValueError for other text."""
    unit_found = quantity_of(unit, wanted) if isinstance(unit, str) else None
    if unit_found is None:
        such = (
            "a time, such as 's', 'ms' or 'us'" if wanted == TIME else "a voltage or a force, such as 'V', 'mV' or 'N'"
        )
        raise ValueError(f"{name} = {short(unit)}: must be a unit of {such}")
    return unit_found.si


def _doubts(data: xr.Dataset, upright: str) -> list[str]:
    """Return what suggests a wrong unit, or sensors that are wired the other way round; upright: what mends these."""
    doubts: list[str] = []
    negative = []
    step = float(data.time[1] - data.time[0])
    for sensor, row in zip(data.sensor.values.tolist(), data.sensor_force.values.T, strict=True):
        force = interpolated_over_gaps(row)
        if is_inverted(force):
            negative.append(sensor)
        _, _, width = smoothed(-force if is_inverted(force) else force)
        with collected() as said:
            Likely.MEASURED_FORCE.warn(f"sensor {sensor}:", "greatest force", float(np.abs(force).max()))
            Likely.WAVE.warn(f"sensor {sensor}:", "width of a wave", width * step)
        doubts += said
    if negative:
        whose = "all sensors" if len(negative) == data.sensor.size else f"sensor {', '.join(map(str, negative))}"
        doubts.append(f"the waves of {whose} are negative: the polarity is reversed; {upright}")
    return doubts


def _newtons(unit: str, calibration: float | Mapping[int, float] | None, sensors: list[int]) -> dict[int, float]:
    """Return how many N a unit of each sensor's column is."""
    if unit == "N":
        if calibration is not None:
            raise ValueError(f"calibration = {calibration!r}: must be left out where the unit is N")
        return dict.fromkeys(sensors, 1.0)
    factors = {}
    for sensor in sensors:
        factor = calibration.get(sensor) if isinstance(calibration, Mapping) else calibration
        if factor is None or finite("calibration", factor, "N/V") == 0.0:
            raise ValueError(
                f"calibration = {calibration!r}: must give κ for sensor {sensor}, a number of N/V, not zero"
            )
        factors[sensor] = float(factor)
    return factors


def _dataset(
    time: Vector,
    forces: Mapping[int, Vector],
    positions: Mapping[int, float] | None,
    baseline: float | str,
    inputs: Mapping[str, Any],
    name: str = "",
) -> xr.Dataset:
    """Return the Dataset of forces over even times; `name` is the place of all."""
    columns = []
    for sensor, force in forces.items():
        filled = interpolated_over_gaps(force)
        if np.ptp(filled) == 0.0:
            raise ValueError(f"{name}sensor {sensor}: the signal is constant, {filled[0]:g} N: must hold a wave")
        columns.append(force - _baseline(time, filled, baseline, f"{name}sensor {sensor}"))
    data = xr.Dataset(
        {"sensor_force": variable("sensor_force", np.stack(columns, axis=1))},
        coords={"time": ("time", time, {"units": "s"}), "sensor": ("sensor", list(forces))},
        attrs=provenance(inputs),
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


def _even(time: Vector) -> Vector:
    """Return the exactly even times, close to those given, or raise a ValueError where these have gaps."""
    steps = np.diff(time)
    usual = float(np.median(steps))
    bad = np.flatnonzero((steps <= 0.0) | (steps > 1.5 * usual))
    if bad.size:
        i = int(bad[0])
        what = "times must increase" if steps[i] <= 0.0 else f"a gap; the usual step is {usual:.3g} s"
        raise ValueError(f"sample {i + 1}: time {time[i + 1]:.9g} s after {time[i]:.9g} s: {what}")
    even = np.linspace(time[0], time[-1], time.size)
    off = np.abs(time - even)
    if off.max() > usual:
        raise ValueError(f"sample {off.argmax()}: times must be evenly spaced, as one sampling rate gives them")
    return even


def _baseline(time: Vector, force: Vector, baseline: float | str, where: str) -> float:
    if isinstance(baseline, str):
        one_of("baseline", baseline, ["lead"])
        try:
            upright = -force if is_inverted(force) else force
            return float(np.median(force[: quiet_lead(f"{where}, baseline = {baseline!r}", upright)]))
        except ValueError as error:
            lasts = readable(float(time[-1] - time[0]), "s", 4)
            raise ValueError(f"{error}; the record lasts {lasts}, {time.size} samples") from None
    seconds = not_negative("baseline", baseline, "s")
    if seconds == 0.0:
        return 0.0
    if seconds > time[-1] - time[0]:
        raise ValueError(f"baseline = {baseline!r}: must be shorter than the signal, {time[-1] - time[0]:g} s")
    return float(np.median(force[time <= time[0] + seconds]))
