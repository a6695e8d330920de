"""AR and TOF at a sensor: the incident wave, the waves that come back, their amplitude ratio and time of flight."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import repeat
from typing import Any
from weakref import ref

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.results.missing_waves import RECORD, cut_record, warn_of_ends, why_missing
from coupling.results.reading import Reading
from coupling.results.sensor_trace import interpolated_over_gaps
from coupling.results.signal_doubts import TAIL, doubts_of_signal, swapped, without_tail
from coupling.results.wave_finder import Peak, Traces, Waves, ends_rising, find_waves, waves_of_signal
from coupling.results.waves import NoWave, ReflectedWave, Reflections, Wave
from structures.caution import caution
from structures.checks import count_of, not_negative, one_of, positive, whole
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

    Parameters
    ----------
    run : Dataset
        One run, or a measured signal (`read_signal`, `as_signal`). For sweeps see `amplitude_ratio`.
    sensor : int
        Number of the bead, 1 to N from the struck end.
    smallest : float
        A peak lower than this part of the incident amplitude, or one that rises by less, is no wave.
    earliest : float
        Of a signal: what comes less than this time after the incident wave is its tail, s. A compressed chain makes
        such tails. Nothing that was reflected is back before a wave has run to the structure and returned.

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
        If the sensor is fewer than five beads from an end of the chain, or if the record ends before a reflected wave
        can be back, or within one; if a small change would make another wave the primary one; if the primary wave of a
        signal is much weaker than a later one, so that it may be the tail of the incident wave.

    Notes
    -----
    The incident wave is the first pulse of power F v towards the structure, a reflected wave a pulse of power away from
    it. Its amplitude and arrival are those of the peak of the force at the bead's centre, the mean of its two contact
    forces; AR and TOF are peak to peak. A pulse that is back too early for its strength to have come from the structure
    was turned back inside the chain and is no reflected wave; the primary wave is the first that began at the
    structure. Where beads rattle, or have drifted apart, they pass one wave on as several pushes within the time that
    a wave takes; the greatest one counts. Of a signal, which shows no direction, all waves after the first count.

    AR and TOF jump where a small change of a parameter makes another push the greatest, or another pulse the first that
    can have come from the structure; a warning says where that is near. docs/theory.md has the rules.

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
    incident, back, record = _of_one(reading, sensor, smallest, len(Reflections._fields), earliest)
    if isinstance(record, Waves):
        back = _with_margins(back, run, sensor)
        warn_of_ends(int(sensor), reading.beads)
    if incident is None:
        if not isinstance(record, Waves) and np.isfinite(record).any():
            _warn_of_signal(reading, interpolated_over_gaps(record), [], sensor)
        where = "stands out of the signal's noise" if reading.is_signal else f"runs over bead {sensor} to the structure"
        none = f"none {where} within the record, {readable(reading.time[-1], 's', 4)}"
        return Reflections(NoWave("incident", none), NoWave("primary", none), NoWave("secondary", none))
    if isinstance(record, Waves):
        _warn_of_doubts(record, sensor, 3)
    if not isinstance(record, Waves):
        _warn_of_signal(reading, interpolated_over_gaps(record), [incident, *back], sensor)
    if len(back) > 1:
        return Reflections(incident, back[0], back[1])
    second = "second " if back else ""
    reason = f"no {second}one above {100.0 * smallest:.3g} % of the incident one is in the record"
    if isinstance(record, Waves):
        reason = why_missing(reading.time, record.found[0], smallest, sensor, int(record.hops[0]))[0] or reason
    elif ends_rising(interpolated_over_gaps(record), incident.amplitude, smallest):
        reason = cut_record(float(reading.time[-1]), float("nan"), f"bead {sensor}")
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
    """Return the time of flight, TOF: from the peak of the incident wave's force at a sensor to that of the reflected
    wave.

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
        TOF, s, without dimension for a run, over the axes of a sweep; NaN if there is no such wave. `reflections`
        states which peak counts if a wave has two.

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
    first, second = whole("first", first), whole("second", second)
    if first == second:
        raise ValueError(f"second = {second!r}: must be another sensor than first")
    reading = Reading(run)
    ends = (("first", first), ("second", second))
    start, end = (_of_one(reading, sensor, SMALLEST_WAVE, 1, name=name)[0] for name, sensor in ends)
    if start is None or end is None:
        return float("nan")
    return (reading.position(second) - reading.position(first)) / (end.arrival - start.arrival)


def _over_axes(run: xr.Dataset, sensor: int, wave: str, what: str, units: str, label: str) -> xr.DataArray:
    one_of("wave", wave, WAVES)
    reading, place = Reading(run), WAVES.index(wave)
    if reading.is_signal:
        values_of_signal = of_signals(reading, sensor, place)[what == "time_of_flight"]
        if values_of_signal.ndim == 0:
            force = interpolated_over_gaps(np.asarray(reading.measured(sensor).values))
            incident, back = _of_signal(reading.time, force, SMALLEST_WAVE, (), sensor)
            _warn_of_signal(reading, force, [incident, *back] if incident else [], sensor)
    else:
        traces, template = traces_of(reading, sensor)
        many = _found(reading, traces, 2 + place)
        values = (many.amplitude_ratio if what == "amplitude_ratio" else many.time_of_flight)[:, place]
        values_of_signal = (
            xr.DataArray(values.reshape(())) if template is None else template.copy(data=values.reshape(template.shape))
        )
        warn_of_ends(int(sensor), reading.beads)
        _warn_of_doubts(many, sensor, 2 + place)
        _warn_of_short_record(reading, sensor, many, 2 + place)
    values_of_signal.attrs = {"units": units, "long_name": f"{label}, bead {sensor}"}
    result: xr.DataArray = values_of_signal.rename(what)
    return result


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
        back = _of_signal(reading.time, force, SMALLEST_WAVE, (0, 1 + place), sensor)[1]
        nothing = float("nan"), float("nan")
        return (back[place].amplitude_ratio, back[place].time_of_flight) if len(back) > place else nothing

    signals, one_value = reading.measured(sensor), list[str]()
    values: tuple[xr.DataArray, xr.DataArray] = xr.apply_ufunc(
        one, signals, input_core_dims=[["time"]], output_core_dims=[one_value, one_value], vectorize=True
    )
    return values


def _of_one(
    reading: Reading, sensor: int, smallest: float, most: int, earliest: float = 0.0, name: str = "sensor"
) -> tuple[Wave | None, list[ReflectedWave], Waves | Vector]:
    """Return the incident wave of one run or signal, those that came back, and what shows them.

    most: as many waves of a run are read, and of a signal none of them may be clipped. name: the user's, of the sensor.
    """
    if reading.is_signal:
        signal = reading.measured(sensor, name)
        _check_one([str(axis) for axis in signal.dims if axis != "time"])
        force = np.asarray(signal.values)
        return *_of_signal(reading.time, force, smallest, range(most), sensor, earliest), force
    traces, template = traces_of(reading, sensor, name)
    _check_one([] if template is None else [str(axis) for axis in template.dims])
    waves = find_waves(reading.time, traces, smallest, most)
    peaks = zip(waves.amplitude[0].tolist(), waves.arrival[0].tolist(), strict=True)
    return *_as_waves([*peaks][: len(waves.found[0].samples)], repeat("structure")), waves


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


def _of_signal(
    time: Vector, force: Vector, smallest: float, needed: Sequence[int], sensor: int, earliest: float = 0.0
) -> tuple[Wave | None, list[ReflectedWave]]:
    """Return the incident wave of a signal, and all that come so much later, s; raise a ValueError where a needed one
    is clipped."""
    unknown = ~np.isfinite(force)
    if unknown.all():
        return None, []
    filled = interpolated_over_gaps(force)
    peaks = waves_of_signal(time, filled, smallest)
    peaks = [*peaks[:1], *(peak for peak in peaks[1:] if peak[1] >= peaks[0][1] + earliest)]
    peaks = without_tail(filled, time, peaks)
    if unknown.any():
        for place in needed:
            if place < len(peaks):
                _check_peak(time, filled, unknown, peaks[place], sensor)
    return _as_waves(peaks, repeat("unknown"))


def _warn_of_signal(reading: Reading, force: Vector, waves: Sequence[Wave], sensor: int) -> None:
    """Warn of what may mislead in a signal: its zero, its lead, the order of its sensors, a tail among its waves."""
    doubts = doubts_of_signal(reading.time, force, [(wave.amplitude, wave.arrival) for wave in waves], sensor)
    arrivals = dict[int, float]()
    for number in reading.data.sensor.values.tolist():
        other = np.asarray(reading.measured(number).values)
        if np.isfinite(other).any() and (found := waves_of_signal(reading.time, interpolated_over_gaps(other), 0.5)):
            arrivals[int(number)] = found[0][1]
    for doubt in [*doubts, *swapped(arrivals)]:
        caution(doubt)
    back = [wave for wave in waves if isinstance(wave, ReflectedWave)]
    strongest = max(back, key=lambda wave: wave.amplitude, default=None)
    if strongest is not None and strongest.amplitude > TAIL * back[0].amplitude:
        caution(
            f"sensor {sensor}: the first wave after the incident one, AR = {back[0].amplitude_ratio:.3g} after "
            f"{readable(back[0].time_of_flight, 's', 4)}, is weaker than a later one, AR = "
            f"{strongest.amplitude_ratio:.3g} after {readable(strongest.time_of_flight, 's', 4)}; in a compressed "
            "chain it may be the tail of the incident wave, which reflections(..., earliest=...) leaves out"
        )


def _check_peak(time: Vector, filled: Vector, unknown: NDArray[np.bool_], peak: Peak, sensor: int) -> None:
    """Raise a ValueError where samples of the upper half of a peak were clipped."""
    amplitude, arrival = peak
    at = int(np.clip(np.searchsorted(time, arrival), 0, time.size - 1))
    low = np.flatnonzero(filled < 0.5 * amplitude)
    before, after = low[low < at], low[low > at]
    upper = slice(int(before[-1]) if before.size else 0, int(after[0]) if after.size else time.size)
    if count := int(unknown[upper].sum()):
        raise ValueError(
            f"run: sensor {sensor}: the peak at {1e6 * arrival:.4g} µs has {count_of(count, 'clipped sample')} "
            "(NaN), so its height is unknown; record it with a wider range"
        )


def _with_margins(waves: list[ReflectedWave], run: xr.Dataset, sensor: int) -> list[ReflectedWave]:
    """Return the waves with the margins of AR and TOF that the run holds for the sensor."""
    margins = json.loads(run.attrs.get(NUMERICAL_ERROR, "{}")).get(str(sensor), {}).get("margins", {})
    names = [(f"{prefix}amplitude_ratio", f"{prefix}time_of_flight") for prefix in ("", "secondary_")]
    return [
        replace(wave, margins=(margins[ratio], margins[flight])) if ratio in margins else wave
        for wave, (ratio, flight) in zip(waves, names, strict=False)
    ]


def _as_waves(peaks: Sequence[Peak], begins: Iterable[str]) -> tuple[Wave | None, list[ReflectedWave]]:
    if not peaks:
        return None, []
    incident = Wave(*peaks[0])
    return incident, [
        ReflectedWave(amplitude, arrival, amplitude / incident.amplitude, arrival - incident.arrival, origin)
        for (amplitude, arrival), origin in zip(peaks[1:], begins, strict=False)
    ]


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


def _warn_of_short_record(reading: Reading, sensor: int, waves: Waves, wanted: int) -> None:
    """Warn once of all runs whose record ends before a wave that is wanted can be back, or within it."""
    late = list[tuple[float, str]]()
    for found, hops in zip(waves.found, waves.hops, strict=True):
        if 0 < len(found.samples) < wanted:
            reason, until = why_missing(reading.time, found, SMALLEST_WAVE, sensor, int(hops))
            if until > reading.time[-1]:
                late.append((until, reason.removeprefix(RECORD)))
    if late:
        several = f", in {len(late)} of {len(waves.found)} runs" if len(waves.found) > 1 else ""
        caution(f"record: {max(late)[1]}{several}")
