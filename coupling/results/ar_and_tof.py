"""AR and TOF at a sensor: the incident wave, the waves that come back, their amplitude ratio and time of flight."""

import json
from collections.abc import Sequence
from math import inf, nan
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from coupling.results.missing_waves import short_record, warn_of_ends, why_missing
from coupling.results.reading import Reading
from coupling.results.signal_waves import SignalWaves, doubts_of_sensors
from coupling.results.wave_finder import Found, find_waves
from coupling.results.waves import ABOVE_ONE, NoWave, ReflectedWave, Reflections, Wave
from structures.caution import caution
from structures.checks import not_negative, one_of, positive, whole
from structures.structure import Vector
from structures.units import readable

# Waves below this part of the incident one are not reported: beads that rattle after a wave make such peaks.
SMALLEST_WAVE = 0.01

WAVES = ("primary", "secondary", "third")

# The attributes of a run with its uncertainty budgets (text and rows of a table) and numerical errors, as JSON by
# sensor.
UNCERTAINTY, NUMERICAL_ERROR = "uncertainty", "numerical_error"


def reflections(run: xr.Dataset, sensor: int, smallest: float = SMALLEST_WAVE, earliest: float = 0.0) -> Reflections:
    """Return the incident wave at a sensor bead, and the first two waves that come back.

    docs/theory.md says what a wave is (thesis, sections 1.5 and 6.1.1). AR and TOF jump if a small change of a
    parameter makes another push the greatest, or another pulse the first that can have come from the structure. A
    warning says if a run is near such a jump.

    Parameters
    ----------
    run : Dataset
        One run, or a measured signal (`read_signal`, `as_signal`). For sweeps see `amplitude_ratio`.
    sensor : int
        Number of the bead, 1 to N from the struck end.
    smallest : float
        A peak that is lower than this part of the incident amplitude, or rises by less, is not a wave.
    earliest : float
        For a signal: peaks less than this time, s, after the incident wave are its tail, as in a compressed chain. A
        reflected wave is back only after it has run to the structure and returned.

    Returns
    -------
    Reflections
        The tuple (incident, primary, secondary). A missing wave is a `NoWave`, which is false and holds the reason.

    Warns
    -----
    HertzlinkWarning
        If the sensor is near an end of the chain, the record ends too early, or a signal may mislead.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> hl.reflections(run, sensor=8).primary
    ReflectedWave(49.11 N at 436.36 µs, AR = 0.9904, TOF = 290.80 µs)
    """
    smallest, reading = positive("smallest", smallest), Reading(run)
    earliest = not_negative("earliest", earliest, "s")
    if earliest and not reading.is_signal:
        raise ValueError(f"earliest = {earliest!r}: must be 0 for a run, whose contacts show where waves go")
    seen = _of_one(reading, sensor, smallest, range(3), earliest)
    _warn_of_doubts(reading, seen, sensor, 3)
    end = float(reading.time[-1])
    count, ends = int(np.isfinite(seen.peaks[0, :, 0]).sum()), readable(end, "s", 4)
    if not count:
        words = "rises above the signal's noise" if reading.is_signal else f"runs over bead {sensor} to the structure"
        reason = f"no wave {words} within the record, {ends}"
        return Reflections(*(NoWave(name, reason) for name in Reflections._fields))

    (amplitude, arrival), *later = seen.peaks[0, :count].tolist()
    _warn_above_one(max((force / amplitude for force, _ in later), default=0.0), sensor)
    margins = json.loads(run.attrs.get(NUMERICAL_ERROR, "{}")).get(str(sensor), {}).get("margins", {})
    back = list[ReflectedWave | NoWave]()
    for (force, time), prefix in zip(later, ("", "secondary_"), strict=False):
        names = [f"{prefix}amplitude_ratio", f"{prefix}time_of_flight"]
        errors = tuple(margins[name] for name in names if name in margins) or None
        back.append(ReflectedWave(force, time, force / amplitude, time - arrival, errors))
    if len(back) < 2:
        reason, until = "", nan
        if not reading.is_signal:
            reason, until = why_missing(reading.time, seen.runs[0], smallest, sensor)
        elif seen.signals[0].ends_rising():
            reason, until = short_record(end, f"bead {sensor}", within=True), inf
        if until > end:
            caution(f"record: {reason}")
            reason = f"the record {reason}"
        which = "second reflected wave" if back else "reflected wave"
        reason = reason or f"no {which} above {100.0 * smallest:.3g} % of the incident one is in the record"
        back += [NoWave(name, reason) for name in ("primary", "secondary")[len(back) :]]
    return Reflections(Wave(amplitude, arrival), *back)


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

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), hl.half_space(hl.STEEL_440C)).run(until=6e-4)
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

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), hl.half_space(hl.STEEL_440C)).run(until=6e-4)
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

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), None).run(until=4e-4)
    >>> print(f"{hl.wave_speed(run, 6, 10):.0f} m/s")
    564 m/s
    """
    if whole("first", first) == whole("second", second):
        raise ValueError(f"second = {second!r}: must be another sensor than first")
    reading = Reading(run)
    start, end = (
        _of_one(reading, bead, SMALLEST_WAVE, [0], 0.0, name).peaks[0, 0, 1]
        for name, bead in (("first", first), ("second", second))
    )
    return (reading.position(second) - reading.position(first)) / float(end - start)


class _Seen(NamedTuple):
    """The waves at a sensor, in runs or signals."""

    peaks: Vector  # runs or signals × waves × (amplitude, N; arrival, s), the incident wave first; NaN if missing
    template: xr.DataArray | None  # a variable over the axes; None for one run or signal
    runs: Sequence[Found] = ()  # the waves of each run
    signals: Sequence[SignalWaves] = ()  # the waves of each signal


def _waves(
    reading: Reading, sensor: int, smallest: float, places: Sequence[int], earliest: float = 0.0, name: str = "sensor"
) -> _Seen:
    """Return the waves at a sensor in each run or signal. places: numbers of the waves that are needed; the incident
    wave is 0. name: the argument that gave the sensor."""
    most = 1 + max(places)
    if not reading.is_signal:
        peaks, found, template = find_waves(reading, sensor, smallest, most, name)
        return _Seen(peaks, template, found)
    forces = reading.measured(sensor, name).transpose(..., "time")
    template = forces.isel(time=0).reset_coords(drop=True) if forces.ndim > 1 else None
    rows = forces.values.reshape(-1, reading.time.size)
    signals = [SignalWaves(reading.time, force, smallest, earliest) for force in rows]
    peaks = np.full((len(rows), most, 2), np.nan)
    for own, signal in zip(peaks, signals, strict=True):
        signal.check_peaks(places, sensor)
        for k, peak in enumerate(signal.peaks[:most]):
            own[k] = peak
    return _Seen(peaks, template, signals=signals)


def _of_one(*wanted: Any) -> _Seen:
    """Return the `_waves` of one run or signal; raise a ValueError for several."""
    seen = _waves(*wanted)
    if seen.template is not None:
        axis = seen.template.dims[0]
        raise ValueError(
            f"run: has the axis {axis}; use amplitude_ratio and time_of_flight, or choose one run with "
            f"run.isel({axis}=0)"
        )
    return seen


def _over_axes(run: xr.Dataset, sensor: int, wave: str, what: str, units: str, label: str) -> xr.DataArray:
    """Return AR or TOF of a run or signal, or over the axes of many, and warn once of what may mislead in them."""
    reading, place = Reading(run), 1 + WAVES.index(one_of("wave", wave, WAVES))
    seen = _waves(reading, sensor, SMALLEST_WAVE, (0, place))
    amplitude, arrival = np.moveaxis(seen.peaks, -1, 0)
    is_ratio, template = what == "amplitude_ratio", seen.template
    values = amplitude[:, place] / amplitude[:, 0] if is_ratio else arrival[:, place] - arrival[:, 0]
    result = xr.DataArray(values[0]) if template is None else template.copy(data=values.reshape(template.shape))
    if seen.runs or template is None:
        _warn_of_doubts(reading, seen, sensor, 1 + place)

    # A record may end before the wanted wave can be back, or within this wave.
    missing = [one for one in seen.runs if 0 < len(one.samples) <= place]
    reasons = [why_missing(reading.time, one, SMALLEST_WAVE, sensor)[::-1] for one in missing]
    if late := [(until, reason) for until, reason in reasons if until > reading.time[-1]]:
        several = f", in {len(late)} of {len(values)} runs" if len(values) > 1 else ""
        caution(f"record: {max(late)[1]}{several}")
    if is_ratio:
        _warn_above_one(float(np.nanmax(values, initial=0.0)), sensor)
    result.attrs = {"units": units, "long_name": f"{label}, bead {sensor}"}
    named: xr.DataArray = result.rename(what)
    return named


def _warn_above_one(ratio: float, sensor: int) -> None:
    """Warn if a reflected wave is higher than the incident one, as at the light beads of a dimer chain."""
    if ratio > 1.0:
        caution(f"AR at bead {sensor}: {ratio:.4g} is {ABOVE_ONE}; compare other sensors")


def _warn_of_doubts(reading: Reading, seen: _Seen, sensor: int, wanted: int) -> None:
    """Warn of what may mislead in the first `wanted` waves of runs, with one warning for all; or in one signal."""
    if reading.is_signal:
        for doubt in [*seen.signals[0].doubts(sensor), *doubts_of_sensors(reading)]:
            caution(doubt)
        return
    warn_of_ends(int(sensor), reading.beads)
    doubts = [
        note if note.startswith("a pulse") else f"the {name} wave {note}"
        for one in seen.runs
        for name, note in zip(("incident", *WAVES)[:wanted], one.notes, strict=False)
        if note
    ]
    several = f" (in {len(doubts)} of {len(seen.runs)} runs)" if len(seen.runs) > 1 else ""
    for doubt in doubts[: 1 if several else None]:
        caution(f"wave at bead {sensor}: {doubt}{several}")
