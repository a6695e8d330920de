"""AR and TOF at a sensor: the incident wave, the waves that come back, their amplitude ratio and time of flight."""

import json
from collections.abc import Sequence

import numpy as np
import xarray as xr

from coupling.results.missing_waves import RECORD, cut_record, warn_of_ends, why_missing
from coupling.results.reading import Reading
from coupling.results.sensor_trace import interpolated_over_gaps
from coupling.results.signal_waves import check_peaks, doubts_of_signal, ends_rising, waves_back
from coupling.results.wave_finder import Traces, Waves, find_waves
from coupling.results.waves import NoWave, ReflectedWave, Reflections, Wave
from structures.caution import caution
from structures.checks import not_negative, one_of, positive, whole
from structures.structure import Vector
from structures.units import readable

# Waves below this part of the incident one are not reported: beads that rattle after a wave make such peaks.
SMALLEST_WAVE = 0.01

WAVES = ("primary", "secondary", "third")

# The attributes of a run that hold, as JSON by sensor, its uncertainty budgets (text and rows of a table) and its
# numerical errors.
UNCERTAINTY, NUMERICAL_ERROR = "uncertainty", "numerical_error"

_MARGINS = ("amplitude_ratio", "time_of_flight")


def reflections(run: xr.Dataset, sensor: int, smallest: float = SMALLEST_WAVE, earliest: float = 0.0) -> Reflections:
    """Return the incident wave at a sensor bead, and the first two waves that come back.

    docs/theory.md says what a wave is (thesis, sections 1.5 and 6.1.1). AR and TOF jump where a small change of a
    parameter makes another push the greatest, or another pulse the first that can have come from the structure; a
    warning says where that is near.

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

    Warns
    -----
    HertzlinkWarning
        If the sensor is near an end of the chain, the record ends too early, or something in a signal misleads.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> hl.reflections(run, sensor=8).primary.begins
    'structure'
    """
    smallest, reading = positive("smallest", smallest), Reading(run)
    earliest = not_negative("earliest", earliest, "s")
    if earliest and not reading.is_signal:
        raise ValueError(f"earliest = {earliest!r}: must be 0 for a run, whose contacts show where waves go")
    (peaks,), waves, _ = _peaks(reading, sensor, smallest, range(3), earliest, one=True)
    _warn_of_doubts(reading, waves, sensor, 3, smallest, earliest)
    ends, count = readable(float(reading.time[-1]), "s", 4), int(np.isfinite(peaks[:, 0]).sum())
    if not count:
        words = "stands out of the signal's noise" if reading.is_signal else f"runs over bead {sensor} to the structure"
        return Reflections(*(NoWave(name, f"none {words} within the record, {ends}") for name in Reflections._fields))

    (amplitude, arrival), *later = peaks[:count].tolist()
    margins = json.loads(run.attrs.get(NUMERICAL_ERROR, "{}")).get(str(sensor), {}).get("margins", {})
    back, begins = list[ReflectedWave | NoWave](), "unknown" if reading.is_signal else "structure"
    for (force, time), prefix in zip(later, ("", "secondary_"), strict=False):
        errors = tuple(margins[prefix + name] for name in _MARGINS if prefix + name in margins) or None
        back.append(ReflectedWave(force, time, force / amplitude, time - arrival, begins, errors))
    if len(back) < 2:
        reason = ""
        if waves is not None:
            reason, _ = why_missing(reading.time, waves.found[0], smallest, sensor, int(waves.hops[0]))
        elif ends_rising(interpolated_over_gaps(reading.measured(sensor).values), amplitude, smallest):
            reason = cut_record(float(reading.time[-1]), f"bead {sensor}")
        if reason.startswith(RECORD):
            caution(f"record: {reason.removeprefix(RECORD)}")
        which = "second one" if back else "one"
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
    beads = {"first": whole("first", first), "second": whole("second", second)}
    if beads["first"] == beads["second"]:
        raise ValueError(f"second = {second!r}: must be another sensor than first")
    reading, arrivals = Reading(run), []
    for name, bead in beads.items():
        peaks, *_ = _peaks(reading, bead, SMALLEST_WAVE, [0], name=name, one=True)
        arrivals.append(float(peaks[0, 0, 1]))
    start, end = (reading.position(bead) for bead in beads.values())
    return (end - start) / (arrivals[1] - arrivals[0])


def _over_axes(run: xr.Dataset, sensor: int, wave: str, what: str, units: str, label: str) -> xr.DataArray:
    """Return AR or TOF of a run or a signal, or over the axes of many, and warn once of what misleads in them."""
    reading, place = Reading(run), 1 + WAVES.index(one_of("wave", wave, WAVES))
    peaks, waves, template = _peaks(reading, sensor, SMALLEST_WAVE, (0, place))
    amplitude, arrival = np.moveaxis(peaks, -1, 0)
    is_ratio = what == "amplitude_ratio"
    values = amplitude[:, place] / amplitude[:, 0] if is_ratio else arrival[:, place] - arrival[:, 0]
    result = xr.DataArray(values[0]) if template is None else template.copy(data=values.reshape(template.shape))
    if waves is not None or template is None:
        _warn_of_doubts(reading, waves, sensor, 1 + place, SMALLEST_WAVE)

    # Records that end before the wanted wave can be back, or within it.
    late = list[tuple[float, str]]()
    for found, hops in zip(waves.found, waves.hops, strict=True) if waves is not None else ():
        if 0 < len(found.samples) <= place:
            reason, until = why_missing(reading.time, found, SMALLEST_WAVE, sensor, int(hops))
            late += [(until, reason.removeprefix(RECORD))] if until > reading.time[-1] else []
    if late:
        several = f", in {len(late)} of {len(peaks)} runs" if len(peaks) > 1 else ""
        caution(f"record: {max(late)[1]}{several}")
    result.attrs = {"units": units, "long_name": f"{label}, bead {sensor}"}
    named: xr.DataArray = result.rename(what)
    return named


def _peaks(
    reading: Reading, sensor: int, smallest: float, places: Sequence[int], earliest: float = 0.0, name: str = "sensor",
    one: bool = False,
) -> tuple[Vector, Waves | None, xr.DataArray | None]:  # fmt: skip
    """Return what passes a sensor in each of some runs or signals.

    The first result is runs × waves × (amplitude, N, and arrival, s), NaN where there is no wave; the second, of runs,
    what is known of their waves; the third a variable over the axes, None for one run.

    places: of the waves that are needed, the incident one first. name: the user's, of the sensor. one: whether a
    ValueError refuses several.
    """
    time, most, waves = reading.time, 1 + max(places), None
    if reading.is_signal:
        signals = reading.measured(sensor, name).transpose(..., "time")
        template = signals.isel(time=0).reset_coords(drop=True) if signals.ndim > 1 else None
    else:
        traces, template = traces_of(reading, sensor, name)
    if one and template is not None:
        axis = template.dims[0]
        raise ValueError(
            f"run: holds several over {axis}; use amplitude_ratio and time_of_flight, or choose one with "
            f"run.isel({axis}=0)"
        )
    if not reading.is_signal:
        waves = find_waves(time, traces, smallest, most)
        return np.stack([waves.amplitude, waves.arrival], axis=-1), waves, template
    rows = signals.values.reshape(-1, time.size)
    peaks = np.full((len(rows), most, 2), np.nan)
    for force, own in zip(rows, peaks, strict=True):
        found = waves_back(time, force, smallest, earliest)
        check_peaks(time, force, found, places, sensor)
        for k, peak in enumerate(found[:most]):
            own[k] = peak
    return peaks, waves, template


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


def _warn_of_doubts(
    reading: Reading, waves: Waves | None, sensor: int, wanted: int, smallest: float, earliest: float = 0.0
) -> None:
    """Warn of what may mislead in the first `wanted` waves of runs, once of all; or in one signal."""
    time = reading.time
    if waves is None:
        forces = {int(n): np.asarray(reading.measured(n).values) for n in reading.data.sensor.values.tolist()}
        first = {n: found[0][1] for n, force in forces.items() if (found := waves_back(time, force, 0.5))}
        if np.isfinite(forces[int(sensor)]).any():
            peaks = waves_back(time, forces[int(sensor)], smallest, earliest)
            for doubt in doubts_of_signal(time, interpolated_over_gaps(forces[int(sensor)]), peaks, sensor, first):
                caution(doubt)
        return
    warn_of_ends(int(sensor), reading.beads)
    doubts = [
        f"the {name} wave {note}" if note.startswith(("has", "is")) else note
        for one in waves.found
        for name, note in zip(("incident", *WAVES)[:wanted], one.notes, strict=False)
        if note
    ]
    if doubts:
        several = f" (in {len(doubts)} of {len(waves.found)} runs)" if len(waves.found) > 1 else ""
        caution(f"wave at bead {sensor}: {doubts[0]}{several}")
