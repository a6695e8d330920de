"""AR and TOF at a sensor: the incident wave, the waves that come back, their amplitude ratio and time of flight."""

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any
from weakref import ref

import numpy as np
import xarray as xr

from coupling.results.missing_waves import RECORD, cut_record, warn_of_ends, why_missing
from coupling.results.reading import Reading
from coupling.results.sensor_trace import interpolated_over_gaps
from coupling.results.signal_waves import check_peaks, doubts_of_signal, ends_rising, waves_back
from coupling.results.wave_finder import Peak, Traces, Waves, find_waves
from coupling.results.waves import NoWave, ReflectedWave, Reflections, Wave
from structures.caution import caution
from structures.checks import not_negative, one_of, positive, whole
from structures.structure import Vector
from structures.units import readable

SMALLEST_WAVE = 0.01
"""Waves below this part of the incident one are not reported: beads that rattle after a wave make such peaks."""

WAVES = ("primary", "secondary", "third")

UNCERTAINTY = "uncertainty"
"""The attribute of a run that holds uncertainty budgets by sensor, as JSON: their text and the rows of a table."""

NUMERICAL_ERROR = "numerical_error"
"""The attribute of a run that holds its numerical errors as JSON, by bead."""

_found_last = list[tuple[ref[xr.Dataset], tuple[Any, ...], Waves]]()
"""The waves that were found last and what they were found in, while that Dataset is in use."""


def reflections(run: xr.Dataset, sensor: int, smallest: float = SMALLEST_WAVE, earliest: float = 0.0) -> Reflections:
    """Return the incident wave at a sensor bead, and the first two waves that come back.

    docs/theory.md says what a wave is. AR and TOF jump where a small change of a parameter makes another push the
    greatest, or another pulse the first that can have come from the structure; a warning says where that is near.

    Parameters
    ----------
    run : Dataset
        One run, or a measured signal (`read_signal`, `as_signal`). For sweeps see `amplitude_ratio`.
    sensor : int
        Number of the bead, 1 to N from the struck end.
    smallest : float
        A peak lower than this part of the incident amplitude, or one that rises by less, is no wave.
    earliest : float
        Of a signal: what comes less than this time after the incident wave is its tail, s, as a compressed chain makes
        one. Nothing that was reflected is back before a wave has run to the structure and returned.

    Returns
    -------
    Reflections
        The tuple (incident, primary, secondary). A wave that is missing is a `NoWave`, which is false and holds the
        reason.

    Raises
    ------
    ValueError
        If the Dataset is a sweep, or does not hold that sensor.

    Warns
    -----
    HertzlinkWarning
        If the sensor is near an end of the chain, the record ends too early, or something in a signal misleads.

    References
    ----------
    Thesis, sections 1.5 and 6.1.1.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> waves = hl.reflections(run, sensor=8)
    >>> print(f"AR = {waves.primary.amplitude_ratio:.2f}, begins at the {waves.primary.begins}")
    AR = 0.99, begins at the structure
    """
    smallest, reading = positive("smallest", smallest), Reading(run)
    earliest = not_negative("earliest", earliest, "s")
    if earliest and not reading.is_signal:
        raise ValueError(f"earliest = {earliest!r}: must be 0 for a run, whose contacts show where waves go")
    ends = readable(float(reading.time[-1]), "s", 4)
    reason = "no {second}one above " + f"{100.0 * smallest:.3g} % of the incident one is in the record"
    if reading.is_signal:
        force, peaks = _of_signal(reading, sensor, smallest, range(len(Reflections._fields)), earliest)
        incident, back = as_waves(peaks, "unknown")
        if force is not None:
            _warn_of_signal(reading, force, peaks, sensor)
        if force is not None and incident and len(back) < 2 and ends_rising(force, incident.amplitude, smallest):
            reason = cut_record(float(reading.time[-1]), float("nan"), f"bead {sensor}")
        none = f"none stands out of the signal's noise within the record, {ends}"
    else:
        peaks, waves = _of_run(reading, sensor, smallest, len(Reflections._fields))
        incident, back = as_waves(peaks, "structure")
        back = _with_margins(back, run, sensor)
        warn_of_ends(int(sensor), reading.beads)
        if incident:
            _warn_of_doubts(waves, sensor, 3)
            found, hops = waves.found[0], int(waves.hops[0])
            reason = why_missing(reading.time, found, smallest, sensor, hops)[0] or reason
        none = f"none runs over bead {sensor} to the structure within the record, {ends}"
    if incident is None:
        return Reflections(NoWave("incident", none), NoWave("primary", none), NoWave("secondary", none))
    if len(back) > 1:
        return Reflections(incident, back[0], back[1])
    reason = reason.replace("{second}", "second " if back else "")
    if reason.startswith(RECORD):
        caution(f"record: {reason.removeprefix(RECORD)}")
    return Reflections(incident, back[0] if back else NoWave("primary", reason), NoWave("secondary", reason))


def amplitude_ratio(run: xr.Dataset, sensor: int, wave: str = "primary") -> xr.DataArray:
    """Return the amplitude ratio AR: reflected amplitude over incident amplitude at a sensor.

    Parameters
    ----------
    run : Dataset
        A run, a sweep, a batch or a measured signal.
    sensor : int
        Number of the bead, 1 to N from the struck end.
    wave : {"primary", "secondary", "third"}
        Which of the reflected waves, in order of arrival.

    Returns
    -------
    DataArray
        AR, without dimension for a run, over the axes of a sweep; NaN if there is no such wave.

    Raises
    ------
    ValueError
        If the Dataset does not hold that sensor, or the wave is unknown.

    References
    ----------
    Thesis, section 6.1.1.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> print(f"{float(hl.amplitude_ratio(run, sensor=8)):.2f}")
    0.99
    """
    return _over_axes(run, sensor, wave, "amplitude_ratio", "1", f"amplitude ratio, {wave} wave")


def time_of_flight(run: xr.Dataset, sensor: int, wave: str = "primary") -> xr.DataArray:
    """Return the time of flight, TOF, s: from the incident peak of the force at a sensor to that of the reflected wave.

    Parameters
    ----------
    run, sensor, wave
        As in `amplitude_ratio`.

    Returns
    -------
    DataArray
        TOF, in the form of `amplitude_ratio`.

    Raises
    ------
    ValueError
        As `amplitude_ratio`.

    References
    ----------
    Thesis, section 6.1.1.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> print(f"{1e6 * float(hl.time_of_flight(run, sensor=8)):.0f} µs")
    291 µs
    """
    return _over_axes(run, sensor, wave, "time_of_flight", "s", f"time of flight, {wave} wave")


def wave_speed(run: xr.Dataset, first: int, second: int) -> float:
    """Return the speed of the incident wave between the peaks at two sensors.

    Parameters
    ----------
    run : Dataset
        One run, or a measured signal with the positions of its sensors: `read_signal(…, positions={7: 0.062})`.
    first, second : int
        Numbers of the two beads, 1 to N from the struck end.

    Returns
    -------
    float
        The speed, m/s; NaN if the incident wave did not pass both sensors.

    Raises
    ------
    ValueError
        If both sensors are the same, the Dataset does not hold them, or a signal holds no positions.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, None).run(until=4e-4)
    >>> print(f"{hl.wave_speed(run, 6, 10):.0f} m/s")
    564 m/s
    """
    beads = {"first": whole("first", first), "second": whole("second", second)}
    if beads["first"] == beads["second"]:
        raise ValueError(f"second = {second!r}: must be another sensor than first")
    reading, arrivals = Reading(run), dict[int, float]()
    for name, bead in beads.items():
        if reading.is_signal:
            _, peaks = _of_signal(reading, bead, SMALLEST_WAVE, [0], name=name)
        else:
            peaks, _ = _of_run(reading, bead, SMALLEST_WAVE, 1, name)
        arrivals |= {bead: peaks[0][1]} if peaks else {}
    if len(arrivals) < 2:
        return float("nan")
    (start, begin), (end, finish) = arrivals.items()
    return (reading.position(end) - reading.position(start)) / (finish - begin)


def _over_axes(run: xr.Dataset, sensor: int, wave: str, what: str, units: str, label: str) -> xr.DataArray:
    """Return AR or TOF of a run or a signal, or over the axes of many, and warn once of what misleads in them."""
    one_of("wave", wave, WAVES)
    reading, place = Reading(run), WAVES.index(wave)
    if reading.is_signal:
        result = of_signals(reading, sensor, place)[what == "time_of_flight"]
        if result.ndim == 0:
            force, peaks = _of_signal(reading, sensor, SMALLEST_WAVE, [])
            if force is not None:
                _warn_of_signal(reading, force, peaks, sensor)
    else:
        traces, template = traces_of(reading, sensor)
        many = _found(reading, traces, 2 + place)
        values = (many.amplitude_ratio if what == "amplitude_ratio" else many.time_of_flight)[:, place]
        result = xr.DataArray(values[0]) if template is None else template.copy(data=values.reshape(template.shape))
        warn_of_ends(int(sensor), reading.beads)
        _warn_of_doubts(many, sensor, 2 + place)

        # Records that end before the wanted wave can be back, or within it.
        late = list[tuple[float, str]]()
        for found, hops in zip(many.found, many.hops, strict=True):
            if 0 < len(found.samples) < 2 + place:
                reason, until = why_missing(reading.time, found, SMALLEST_WAVE, sensor, int(hops))
                late += [(until, reason.removeprefix(RECORD))] if until > reading.time[-1] else []
        if late:
            several = f", in {len(late)} of {len(many.found)} runs" if len(many.found) > 1 else ""
            caution(f"record: {max(late)[1]}{several}")
    result.attrs = {"units": units, "long_name": f"{label}, bead {sensor}"}
    named: xr.DataArray = result.rename(what)
    return named


def _found(reading: Reading, traces: Traces, most: int) -> Waves:
    """Return the first waves of all runs. Who asks for AR mostly asks for TOF next, so the last ones are kept."""
    shown: tuple[Any, ...] = (reading.time.copy(), *traces, most)
    for _, before, waves in _found_last:
        if all(np.array_equal(old, new) for old, new in zip(before, shown, strict=True)):
            return waves
    waves = find_waves(reading.time, traces, SMALLEST_WAVE, most)
    _found_last[:] = [(ref(reading.data, lambda _: _found_last.clear()), shown, waves)]
    return waves


def of_signals(reading: Reading, sensor: int, place: int = 0) -> tuple[xr.DataArray, xr.DataArray]:
    """Return AR and TOF of a wave that came back, by its place in time, over the axes of a measured signal."""

    def one(force: Vector) -> tuple[float, float]:
        peaks = waves_back(reading.time, force, SMALLEST_WAVE)
        check_peaks(reading.time, force, peaks, (0, 1 + place), sensor)
        if len(peaks) < 2 + place:
            return float("nan"), float("nan")
        (first, begin), (height, end) = peaks[0], peaks[1 + place]
        return height / first, end - begin

    signals = reading.measured(sensor)
    values: tuple[xr.DataArray, xr.DataArray] = xr.apply_ufunc(
        one, signals, input_core_dims=[["time"]], output_core_dims=[[], []], vectorize=True
    )
    return values


def _of_signal(
    reading: Reading, sensor: int, smallest: float, needed: Sequence[int], earliest: float = 0.0, name: str = "sensor"
) -> tuple[Vector | None, list[Peak]]:
    """Return the force of one signal without gaps, and its waves; a ValueError where a needed one is clipped."""
    signal = reading.measured(sensor, name)
    _check_one([str(axis) for axis in signal.dims if axis != "time"])
    force = np.asarray(signal.values)
    peaks = waves_back(reading.time, force, smallest, earliest)
    check_peaks(reading.time, force, peaks, needed, sensor)
    return (interpolated_over_gaps(force) if np.isfinite(force).any() else None), peaks


def _of_run(
    reading: Reading, sensor: int, smallest: float, most: int, name: str = "sensor"
) -> tuple[list[Peak], Waves]:
    """Return the first waves over a bead of one run. name: the user's, of the bead."""
    traces, template = traces_of(reading, sensor, name)
    _check_one([] if template is None else [str(axis) for axis in template.dims])
    waves = find_waves(reading.time, traces, smallest, most)
    peaks = zip(waves.amplitude[0].tolist(), waves.arrival[0].tolist(), strict=True)
    return [*peaks][: len(waves.found[0].samples)], waves


def traces_of(reading: Reading, sensor: int, name: str = "sensor") -> tuple[Traces, xr.DataArray | None]:
    """Return what shows the waves over a bead of a run, a sweep or a batch; and a variable over the axes of the runs,
    None for one run. name: the user's, of the bead."""
    number = reading.checked_sensor(sensor, name)
    reading.check_holds(("contact_force", "velocity"))
    data, kept = reading.data, reading.data.bead.values.tolist()
    if number not in kept:
        raise ValueError(f"{name} = {sensor!r}: must be a bead that was kept: {', '.join(map(str, kept))}")
    axes = [str(axis) for axis in data.contact_force.dims if axis not in ("time", "contact")]
    contacts = data.contact.values

    def plain(variable: str, *own: str) -> Vector:
        """Return a variable as runs × its own dimensions, repeated where it is the same in all runs."""
        values = data[variable].variable
        dims = [axis for axis in axes if axis in values.dims]
        if dims not in (axes, []):
            raise ValueError(f"run: has a variable over {', '.join(dims)}, must have all of {', '.join(axes)} or none")
        array = values.transpose(*dims, *own).values
        array = array.reshape(-1, *array.shape[len(dims) :])
        return array if dims or not axes else np.broadcast_to(array, (runs, *array.shape[1:]))

    runs = int(np.prod([data.sizes[axis] for axis in axes], dtype=int))
    force, static = plain("contact_force", "time", "contact"), plain("static_force", "contact")
    velocity = plain("velocity", "time", "bead")[:, :, kept.index(number)].copy()
    place = int(np.flatnonzero(contacts == number)[0])
    # Shorter chains are padded with NaN.
    last = contacts.size - 1 - np.isfinite(static)[:, ::-1].argmax(axis=1)
    every = np.arange(len(force))
    above, below = (force[:, :, k] - static[:, k, None] for k in (place, place + 1))
    wall = force[every, :, last] - static[every, last][:, None]
    preload = 0.5 * (static[:, place] + static[:, place + 1])
    hops = contacts[last] - number
    template = data.contact_force.isel(time=0, contact=0).reset_coords(drop=True).transpose(*axes) if axes else None
    yields = bool(data.attrs.get("yielding", 0))
    return Traces(above, below, wall, velocity, preload, number, hops, yields), template


def _check_one(axes: Sequence[str]) -> None:
    """Raise a ValueError for a sweep."""
    for axis in axes[:1]:
        raise ValueError(
            f"run: holds several over {axis}; use amplitude_ratio and time_of_flight, or choose one with "
            f"run.isel({axis}=0)"
        )


def as_waves(peaks: Sequence[Peak], begins: str) -> tuple[Wave | None, list[ReflectedWave]]:
    """Return the incident wave and the reflected ones; begins: where these begin."""
    if not peaks:
        return None, []
    (first, begin), *later = peaks
    return Wave(first, begin), [ReflectedWave(top, at, top / first, at - begin, begins) for top, at in later]


def _warn_of_signal(reading: Reading, force: Vector, peaks: Sequence[Peak], sensor: int) -> None:
    """Warn of what may mislead in a signal: its zero, its lead, the order of its sensors, a tail among its waves."""
    arrivals = dict[int, float]()
    for number in reading.data.sensor.values.tolist():
        if other := waves_back(reading.time, np.asarray(reading.measured(number).values), 0.5):
            arrivals[int(number)] = other[0][1]
    for doubt in doubts_of_signal(reading.time, force, peaks, sensor, arrivals):
        caution(doubt)


def _with_margins(waves: list[ReflectedWave], run: xr.Dataset, sensor: int) -> list[ReflectedWave]:
    """Return the waves with the margins of AR and TOF that the run holds for the sensor."""
    margins = json.loads(run.attrs.get(NUMERICAL_ERROR, "{}")).get(str(sensor), {}).get("margins", {})
    for place, prefix in enumerate(("", "secondary_")[: len(waves)]):
        if (ratio := f"{prefix}amplitude_ratio") in margins:
            waves[place] = replace(waves[place], margins=(margins[ratio], margins[f"{prefix}time_of_flight"]))
    return waves


def _warn_of_doubts(waves: Waves, sensor: int, wanted: int) -> None:
    """Warn once of all runs in which AR and TOF of the wanted waves may mislead."""
    names = ("incident", *WAVES)
    doubts = [
        f"the {names[place]} wave {note}" if note.startswith(("has", "is")) else note
        for one in waves.found
        for place, note in [*enumerate(one.notes)][:wanted]
        if note
    ]
    if doubts:
        several = f" (in {len(doubts)} of {len(waves.found)} runs)" if len(waves.found) > 1 else ""
        caution(f"wave at bead {sensor}: {doubts[0]}{several}")
