"""Measured signals: the Dataset of a run's sensors, made from arrays or read from an oscilloscope's file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from coupling.results.provenance import provenance
from coupling.results.schema import variable
from coupling.results.sensor_trace import checked_trace, interpolated_over_gaps, is_inverted, quiet_lead, smoothed
from coupling.signals.channels import Sampling, even, even_sampling, on_one_time
from coupling.signals.heads import FORCE, TIME, WHAT, read_unit
from coupling.signals.recorders import opened
from structures.caution import caution, collected
from structures.checks import existing, finite, instance, not_negative, one_of, short, whole
from structures.described import checked_call
from structures.quantities import Count, Interval, Likely, Moment
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
        Evenly spaced times, s. Dates (datetime64) count from the first.
    forces : mapping
        Sensor number → force at the bead's centre, N. Units of a DataArray or of pint are converted.
    positions : mapping, optional
        Sensor number → distance along the chain, m; `wave_speed` needs it.
    baseline : float or "lead"
        The zero of the force is its median over this time from the start, s, or over the quiet lead before the first
        wave. 0 leaves the force unchanged.

    Returns
    -------
    Dataset
        sensor_force, N, over time and sensor.

    Warns
    -----
    HertzlinkWarning
        If all waves are negative, or times and forces are so large or small that a unit may be wrong.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.linspace(0.0, 6e-4, 6001)
    >>> force = 50.0 * np.exp(-(((time - 1e-4) / 1e-5) ** 2)) + 30.0 * np.exp(-(((time - 4e-4) / 1e-5) ** 2))
    >>> print(f"AR = {float(hl.amplitude_ratio(hl.as_signal(time, {7: force}), sensor=7)):.2f}")
    AR = 0.60
    """
    instance("forces", forces, Mapping, "a mapping such as {7: force}")
    if not forces:
        raise ValueError("forces = {}: must hold at least one sensor, such as {7: force}")
    moments = checked_trace("time", time, "s")
    rows = {whole("sensor", n): checked_trace(f"forces[{n}]", force, "N", moments.size) for n, force in forces.items()}
    moments, kept, notes = even_sampling(moments, lambda row: f"sample {row}")
    if (kept < 0).any():
        raise ValueError(f"sample {int((kept < 0).argmax())}: the times have a gap, must be evenly spaced")
    for note in notes:
        caution(f"time: {note}")
    data = _dataset(
        moments, rows, positions, baseline, {"signal": "arrays", "sensors": sorted(rows), "baseline": baseline}
    )
    for doubt in _doubts(data, "change the sign of the forces"):
        caution(f"forces: {doubt}")
    return data


@checked_call
def read_signal(
    path: str | Path | Mapping[int, str | Path],
    sensors: Mapping[int, int],
    time_column: Annotated[int, Count(0)] | None = None,
    time_unit: str | None = None,
    unit: str | None = None,
    calibration: float | Mapping[int, float] | None = None,
    baseline: float | str = "lead",
    positions: Mapping[int, float] | None = None,
    interval: Interval | None = None,
    start: Moment | None = None,
    skip: Annotated[int, Count(0)] = 0,
) -> xr.Dataset:
    """Read a measured signal from the file of an oscilloscope or recorder, for `reflections` and other measures.

    Parameters
    ----------
    path : path or mapping
        The file; or sensor number → file, if a recorder writes a file for each channel. A file is a text with a line
        for each sample, an Excel workbook, or arrays of TDMS, MATLAB, HDF5 or numpy (.npz); see docs/signals.md.
    sensors : mapping
        Sensor number → column of a text, counted from 0; for arrays the channel, counted from 1.
    time_column : int, optional
        The column of the times; by default, for each sensor, the nearest increasing column to its left.
    time_unit, unit : str, optional
        The units of the times and of the columns, such as "us" and "mV"; by default those of the header, else s and V.
    calibration : float or mapping, optional
        κ, N/V, unless the file is in N: one for all sensors, or sensor number → κ; negative for swapped wires.
    baseline, positions
        As in `as_signal`, but `baseline` is "lead" by default.
    interval : float, optional
        Time from sample to sample, s, for a file without times; times in the file are then not read.
    start : float, optional
        Time of the first sample, s; by default that in the file, or 0 for a file without times.
    skip : int
        Number of lines at the beginning that are not read.

    Returns
    -------
    Dataset
        sensor_force, N, over time and sensor; NaN for samples that are missing or beyond the range. The attribute
        ``reading`` says what was left out or assumed, one sentence in each line.

    Raises
    ------
    OSError, ValueError
        If the file cannot be read or is not understood. The message names the line and the cure.

    Warns
    -----
    HertzlinkWarning
        For each sentence in ``reading``.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.linspace(0.0, 6e-4, 6001)
    >>> volts = 0.5 * np.exp(-(((time - 1e-4) / 1e-5) ** 2)) + 0.3 * np.exp(-(((time - 4e-4) / 1e-5) ** 2))
    >>> np.savetxt("scope.csv", np.column_stack([time, volts]), delimiter=",", header="time, channel 1")
    >>> signal = hl.read_signal("scope.csv", sensors={7: 1}, calibration=100.0)
    >>> print(f"{hl.reflections(signal, sensor=7).incident.amplitude:.1f} N")
    50.0 N
    """
    instance(
        "path", path, str | Path | Mapping,  # type: ignore[arg-type]
        "one file, or {sensor: file} for files of one channel each; for taps, average_taps([read_signal(file, …) for "
        "file in files])",
    )  # fmt: skip
    instance("sensors", sensors, Mapping, "a mapping from sensor number to column, such as {7: 1}")
    column_of = {whole("sensor", sensor): whole(f"sensors[{sensor}]", column, 0) for sensor, column in sensors.items()}
    if not column_of or time_column in column_of.values():
        problem = f"column {time_column} is the time column" if column_of else "must name a sensor, such as {7: 1}"
        raise ValueError(f"sensors = {dict(sensors)!r}: {problem}")
    for name, text, kind in (("time_unit", time_unit, TIME), ("unit", unit, FORCE)):
        if text is not None and not read_unit(text, kind).si:
            raise ValueError(f"{name} = {short(text)}: must be a unit of {WHAT[kind]}")
    if interval is not None and time_column is not None:
        raise ValueError(f"interval = {interval!r}: is for a file without times; leave out interval or time_column")
    sampling = Sampling(time_column, time_unit, unit, interval, start, skip)
    named = dict(path) if isinstance(path, Mapping) else dict.fromkeys(column_of, path)
    if named.keys() != column_of.keys():
        raise ValueError(f"path = {short(path)}: must hold a file for each of sensors {', '.join(map(str, column_of))}")
    for sensor, file in named.items():
        instance(f"path[{sensor}]", file, str | Path, "the name of a file")  # type: ignore[arg-type]

    # The channel of each sensor, with times of its own.
    pieces, units, notes = dict[int, tuple[Vector, Vector]](), dict[int, str](), list[str]()
    files = dict.fromkeys(map(Path, named.values()))
    for file in files:
        columns = {sensor: column for sensor, column in column_of.items() if Path(named[sensor]) == file}
        if len(set(columns.values())) < len(columns):
            raise ValueError(f"sensors = {dict(sensors)!r}: two of them read the same column; give each its own")
        recording = opened(existing(f"path = {str(file)!r}", file), columns.values(), sampling)
        said = [*recording.notes]
        for sensor, column in columns.items():
            time, values, units[sensor], doubts = even(file, recording, column, sampling, f"sensor {sensor}")
            pieces[sensor], said = (time, values), [*said, *doubts]
        notes += [f"{file}: {note}" for note in dict.fromkeys(said)]

    # All channels over the same times, from the first sample with a value to the last, in N.
    where = ", ".join(map(str, files))
    time, forces, said = on_one_time(where, {sensor: pieces[sensor] for sensor in column_of})
    held = np.flatnonzero(np.isfinite([*forces.values()]).any(axis=0))
    cut = slice(held[0], held[-1] + 1)
    if ends := [f"the {end} {n}" for end, n in (("first", held[0]), ("last", time.size - cut.stop)) if n]:
        said.append(f"samples without values, {' and '.join(ends)}, were left out")
    notes += [f"{where}: {note}" for note in said]
    for sensor, unit_read in units.items():
        forces[sensor] = _newtons(sensor, unit_read, calibration) * forces[sensor][cut]

    names = {n: str(file) for n, file in named.items()} if isinstance(path, Mapping) else str(path)
    inputs = {"signal": names, "sensors": column_of, **sampling._asdict(), "columns_converted_to": units}
    inputs |= {"calibration": calibration, "baseline": baseline}
    data = _dataset(time[cut], forces, positions, baseline, inputs, f"{where}: ")
    notes += [f"{where}: {note}" for note in _doubts(data, "change the sign of the calibration")]
    for note in notes:
        caution(note)
    return data.assign_attrs(reading="\n".join(note.removeprefix(f"{where}: ") for note in notes))


def _newtons(sensor: int, unit: str, calibration: float | Mapping[int, float] | None) -> float:
    """Return the force, N, of one unit of a sensor's channel, V or N."""
    if unit == "N":
        if calibration is not None:
            raise ValueError(f"calibration = {calibration!r}: must be left out where the unit is N")
        return 1.0
    factor = calibration.get(sensor) if isinstance(calibration, Mapping) else calibration
    if factor is None or finite("calibration", factor, "N/V") == 0.0:
        cure = f"give a number of N/V for sensor {sensor}, not zero, such as calibration = 25"
        raise ValueError(f"calibration = {calibration!r}: {cure}")
    return factor


def _dataset(
    time: Vector, forces: Mapping[int, Vector], positions: Mapping[int, float] | None, baseline: float | str,
    inputs: Mapping[str, Any], where: str = "",
) -> xr.Dataset:  # fmt: skip
    """Return the Dataset of forces over even times. where: the beginning of messages."""
    lasts, columns = float(time[-1] - time[0]), []
    is_lead = isinstance(baseline, str) and one_of("baseline", baseline, ["lead"]) == "lead"
    if not is_lead and not not_negative("baseline", baseline, "s") <= lasts:  # type: ignore[arg-type]
        raise ValueError(f"baseline = {baseline!r}: must be shorter than the signal, {lasts:g} s")
    for sensor, force in forces.items():
        filled, zero = interpolated_over_gaps(force), 0.0
        if np.ptp(filled) == 0.0:
            raise ValueError(f"{where}sensor {sensor}: the signal is constant, {filled[0]:g} N: must hold a wave")
        if is_lead:
            lead = quiet_lead(filled)
            if not lead:
                raise ValueError(
                    f"{where}sensor {sensor}, baseline = {baseline!r}: has no quiet lead to take the baseline from, "
                    f"must begin before the first wave; the record lasts {readable(lasts, 's', 4)}, {time.size} samples"
                )
            zero = float(np.median(filled[:lead]))
        elif baseline:
            zero = float(np.median(filled[time <= time[0] + baseline]))
        columns.append(force - zero)
    data = xr.Dataset(
        {"sensor_force": variable("sensor_force", np.stack(columns, axis=1))},
        coords={"time": ("time", time, {"units": "s"}), "sensor": ("sensor", list(forces))},
        attrs=provenance(inputs),
    )
    if positions is None:
        return data
    instance("positions", positions, Mapping, "a mapping from sensor number to position, such as {7: 0.062}")
    places = {n: finite(f"positions[{n}]", positions[n], "m") for n in forces if n in positions}
    if len(places) < len(forces) or (np.diff([places[n] for n in sorted(places)]) <= 0.0).any():
        held = ", ".join(map(str, forces))
        raise ValueError(
            f"positions = {dict(positions)!r}: must hold a position in m for each of the sensors {held}, which "
            "increases with the number of the sensor"
        )
    about = {"units": "m", "long_name": "position along the chain"}
    return data.assign_coords(centre=("sensor", [*places.values()], about))


def _doubts(data: xr.Dataset, upright: str) -> list[str]:
    """Return signs of a wrong unit or of swapped wires. upright: the cure for swapped wires."""
    negative, step = list[int](), float(data.time[1] - data.time[0])
    with collected() as doubts:
        for sensor, row in zip(data.sensor.values.tolist(), data.sensor_force.values.T, strict=True):
            force = interpolated_over_gaps(row)
            if is_inverted(force):
                negative.append(sensor)
                force = -force
            Likely.MEASURED_FORCE.warn(f"sensor {sensor}:", "greatest force", float(np.abs(force).max()))
            Likely.WAVE.warn(f"sensor {sensor}:", "width of a wave", smoothed(force)[2] * step)
    if negative:
        whose = "all sensors" if len(negative) == data.sensor.size else f"sensor {', '.join(map(str, negative))}"
        doubts.append(f"the waves of {whose} are negative: the polarity is reversed; {upright}")
    return doubts
