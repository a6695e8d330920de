"""What is read from a run, or from a measured signal: every measure is a function of the Dataset, over any axes."""

from collections.abc import Sequence
from itertools import count, takewhile

import numpy as np
import xarray as xr

from coupling.results.absence import beads_of, reason_for_none, short_record, warn_of_ends
from coupling.results.contact_forces import check_whole
from coupling.results.peaks import incident_passage, interpolated, waves_of_run, waves_of_signal
from coupling.results.waves import NoWave, ReflectedWave, Reflections, Wave
from structures.caution import caution
from structures.checks import instance, one_of, positive, whole
from structures.structure import Vector

SMALLEST_WAVE = 0.01
"""Waves below this part of the incident one are not reported: beads that rattle after a wave make such peaks."""

WAVES = ("primary", "secondary", "third")


def sensor_force(run: xr.Dataset, sensor: int) -> xr.DataArray:
    """Force at the centre of bead `sensor` (1 … N from the struck end), N, above the preload.

    Of a run the mean of the bead's two contact forces (thesis, section 3.1), of a signal what was measured. Raises
    ValueError for a sensor that is not there; of several chains those that are too short for it get NaN, and a warning.
    """
    if _is_signal(run):
        force: xr.DataArray = run.sensor_force.sel(sensor=_measured(run, sensor)).reset_coords(drop=True)
    else:
        above, below = _contact_pair(run, sensor)
        force = 0.5 * (above + below)
    return force.assign_attrs(units="N", long_name=f"force at bead {int(sensor)}")


def _is_signal(run: xr.Dataset) -> bool:
    instance("run", run, xr.Dataset, "the Dataset of a run, a sweep or a signal")
    return "sensor_force" in run.data_vars


def _measured(run: xr.Dataset, sensor: int) -> int:
    number = whole("sensor", sensor)
    known = run.sensor.values.tolist()
    if number not in known:
        raise ValueError(f"sensor = {sensor!r}: must be one that was measured: {', '.join(map(str, known))}")
    return number


def _contact_pair(run: xr.Dataset, sensor: int) -> tuple[xr.DataArray, xr.DataArray]:
    """Forces of a bead's two contacts, the struck side first, above the preload."""
    dynamic = _dynamic_force(run)
    number, kept = whole("sensor", sensor), _kept(run)
    if not {number, number + 1} <= kept:
        beads = max(kept) - 1
        raise ValueError(f"sensor = {sensor!r}: must be a bead from 1 to {beads}, counted from the struck end")
    _warn_of_shorter(run, number)
    above, below = (dynamic.sel(contact=n).reset_coords(drop=True) for n in (number, number + 1))
    return above, below


def _warn_of_shorter(run: xr.Dataset, sensor: int) -> None:
    """Of several chains, those without such a bead get NaN."""
    if "chain" in run.static_force.dims:
        there = run.static_force.sel(contact=sensor + 1).notnull()
        there = there.any([axis for axis in there.dims if axis != "chain"])
        if not there.all():
            shorter = ", ".join(map(str, there.chain.values[~there.values]))
            caution(
                f"sensor = {sensor}: lies beyond the end of chain {shorter} of the run, for which the measure is NaN"
            )


def _kept(run: xr.Dataset) -> set[int]:
    """The contacts of a run, of the longest of several chains; the others are filled up with NaN."""
    force = run.static_force
    there = force.notnull().any([axis for axis in force.dims if axis != "contact"])
    return set(run.contact.values[there.values].tolist())


def _dynamic_force(run: xr.Dataset) -> xr.DataArray:
    """Contact forces above the preload, or a ValueError for a signal, which has none."""
    if _is_signal(run) or "contact_force" not in run:
        what = "is a measured signal" if _is_signal(run) else "holds no contact forces"
        raise ValueError(f"run: {what}, must be the Dataset of a run or a sweep")
    dynamic: xr.DataArray = run.contact_force - run.static_force
    return dynamic


def reflections(run: xr.Dataset, sensor: int, smallest: float = SMALLEST_WAVE) -> Reflections:
    """The waves that pass a sensor bead of one run; a `NoWave`, which is false and knows the reason, where none came.

    A wave is a peak of both contact forces of the bead. Amplitude and arrival are those of the peak of their mean, the
    force at the bead's centre, placed between samples by a cubic spline: AR and TOF are peak to peak (thesis, section
    6.1.1). Which contact the wave passes first determines its direction: the incident wave is the first that goes on,
    reflected ones are those that come back. A heavy striker sends a train; its first wave is the incident one.
    Between beads that have drifted apart a weak wave is two collisions, and the force at the centre has two humps. The
    wave arrives with the higher one. So TOF leaps where a parameter makes the other hump the higher one, by some 20 µs
    for steel beads of 10 mm diameter. `follow_waves(run)` gives the middle between the two collisions, which varies
    without a leap. A dashpot's force jumps where a contact closes; a peak at such a jump is known to one saved
    interval.
    A reflected wave is followed back towards the structure, contact by contact, and tells where it `begins`: at the
    "structure", or in the "chain", where it parted from a wave with which it was merged, or came back from an unlike
    bead. Waves below 5 % that cannot be followed over four contacts are beads that rattle, and left out. So in a sweep
    the secondary wave stays the same wave until it fades. `follow_waves` shows those that end before the sensor.
    smallest: a peak that is lower than this part of the incident amplitude, or rises by less, is no wave. Small
    secondary waves of 1 to 3 % are real: every collision of a wave with a wall leaves some (thesis, section 1.5).
    A solitary wave is five beads long: nearer than that to either end of the chain, or to a bead unlike the others,
    incident and reflected waves merge, and amplitudes mean little. The reflected waves of a striker much heavier than
    a bead ride on its train, and may be larger than the incident one.
    A signal (`read_signal`, `as_signal`) holds the force at the bead's centre alone, which has no direction: its
    first wave is the incident one, and all later ones count as reflected, each of two humps too where the valley
    between them is deeper than `smallest`. Amplitude and arrival are those of the same peak as in a run: where the
    force at a sensor of a run is read as a signal, AR agrees within 1e-5 and TOF within 0.05 µs, without noise and
    jumps. Waves must stand out of the noise, and are placed by a polynomial: with white noise of 2 % of the incident
    peak, sampled at 10 MHz, AR is good to 0.01 and TOF to 0.5 µs for steel beads of 10 mm diameter, and in 99 of 100
    draws for 5 mm; at 2 MHz AR has a standard deviation of 0.005.
    Warns of a sensor fewer than five beads from an end, and of a record that ends before a reflected wave can be back.
    """
    smallest = positive("smallest", smallest)
    values, time = _one_run(run, sensor), run.time.values
    incident, back = _waves(time, *values, smallest=smallest)
    _warn_of_ends(run, sensor)
    if incident is None:
        where = "stands out of the signal's noise" if len(values) == 1 else f"runs over bead {sensor} to the structure"
        none = f"none {where} within the record, {time[-1]:.4g} s"
        return Reflections(NoWave("incident", none), NoWave("primary", none), NoWave("secondary", none))
    if len(back) > 1:
        return Reflections(incident, back[0], back[1])
    reason, needed = _why_none(run, sensor, values, smallest, bool(back))
    if needed > time[-1]:
        caution(f"record: {reason.removeprefix('the record ')}")
    return Reflections(incident, back[0] if back else NoWave("primary", reason), NoWave("secondary", reason))


def _one_run(run: xr.Dataset, sensor: int) -> list[Vector]:
    """What shows the waves over a bead, see `_series`, or a ValueError for a sweep."""
    series, dimensions = _series(run, sensor)
    if series[0].ndim != len(dimensions[0]):
        axis = next(axis for axis in series[0].dims if axis not in dimensions[0])
        raise ValueError(
            f"run: holds several over {axis}; use amplitude_ratio and time_of_flight, or choose one with "
            f"run.isel({axis}=0)"
        )
    return [one.transpose(*order).values for one, order in zip(series, dimensions, strict=True)]


def _why_none(
    run: xr.Dataset, sensor: int, values: Sequence[Vector], smallest: float, returned: bool
) -> tuple[str, float]:
    """Why no wave came back, or no second one, and the `until` (s) that would hold it; NaN where time is not short."""
    time = run.time.values
    if returned or len(values) == 1:
        second = "second " if returned else ""
        return f"no {second}one above {100.0 * smallest:.3g} % of the incident one is in the record", np.nan
    force = values[0][~np.isnan(values[0]).all(axis=1)]
    return reason_for_none(time, force, smallest, sensor, len(force) - 2 + sensor in beads_of(run))


def _warn_of_ends(run: xr.Dataset, sensor: int) -> None:
    """A warning for a sensor too near to an end of a chain of a run; of a signal the chain is not known."""
    if not _is_signal(run):
        for beads in beads_of(run):
            if beads >= sensor:
                warn_of_ends(int(sensor), beads)
                return


def amplitude_ratio(run: xr.Dataset, sensor: int, wave: str = "primary") -> xr.DataArray:
    """AR = reflected amplitude / incident amplitude at a sensor (thesis, section 6.1.1); NaN where no wave came.

    A run gives a number, a sweep an array over its axes. wave: "primary", "secondary" or "third".
    """
    return _over_axes(run, sensor, wave, "amplitude_ratio", "1", f"amplitude ratio, {wave} wave")


def time_of_flight(run: xr.Dataset, sensor: int, wave: str = "primary") -> xr.DataArray:
    """TOF, s: from the peak of the incident wave's force at a sensor to that of the reflected one; NaN without a wave.

    (Thesis, section 6.1.1.) `reflections` states which peak that is where a wave has two.

    A run gives a number, a sweep an array over its axes. wave: "primary", "secondary" or "third".
    """
    return _over_axes(run, sensor, wave, "time_of_flight", "s", f"time of flight, {wave} wave")


def wave_speed(run: xr.Dataset, first: int, second: int) -> float:
    """Speed, m/s, of the incident wave between the peaks at two sensors of one run; NaN where it did not pass both.

    A signal must know its sensors' positions: `read_signal(…, positions={7: 0.062, 16: 0.148})`.
    """
    first, second = whole("first", first), whole("second", second)
    if first == second:
        raise ValueError(f"second = {second!r}: must be another sensor than first")
    waves = [_waves(run.time.values, *_one_run(run, one), smallest=SMALLEST_WAVE)[0] for one in (first, second)]
    if waves[0] is None or waves[1] is None:
        return float("nan")
    if "centre" not in run.coords:
        raise ValueError("run: holds no positions of its sensors; give positions={sensor: m} where the signal is read")
    axis = "sensor" if _is_signal(run) else "bead"
    distance = float(run.centre.sel({axis: second}) - run.centre.sel({axis: first}))
    return distance / (waves[1].arrival - waves[0].arrival)


def contact_to_sensor_ratio(run: xr.Dataset, sensor: int) -> float | xr.DataArray:
    """β = greatest contact force / greatest bead-centre force of the incident wave at a bead (thesis, equation 3.2).

    Both above the preload; the greater of the bead's two contacts counts. What a gauge in the bead shows, times β and
    plus the preload, is the contact force F_m of the theory. 1.414 for equal spheres without preload, five beads or
    more from both ends. NaN where no wave came. A float for a run, an array for a sweep.
    """

    def one(above: Vector, below: Vector, velocity: Vector) -> float:
        passage = incident_passage(above, below, velocity)
        if passage is None:
            return float("nan")
        near = slice(max(0, passage.start - 3), passage.end + 4)
        contacts = [interpolated(time, f, near.start + int(f[near].argmax()))[0] for f in (above, below)]
        return max(contacts) / interpolated(time, 0.5 * (above + below), passage.peak)[0]

    series, time = _passing(run, sensor), run.time.values
    result = xr.apply_ufunc(one, *series, input_core_dims=[["time"]] * 3, vectorize=True)
    return _number_or_array(result, "1", f"contact force / bead-centre force, bead {int(sensor)}")


def contact_time(run: xr.Dataset, threshold: float = 0.01) -> float | xr.DataArray:
    """Time, s, that the last bead first pushes the structure.

    From where the force above the preload first exceeds `threshold` of its greatest value to where it falls below
    it again, placed by linear interpolation; NaN where it does not. A float for a run, an array for a sweep.
    """
    dynamic = _dynamic_force(run)
    if not 0.0 < positive("threshold", threshold) < 1.0:
        raise ValueError(f"threshold = {threshold!r}: must lie between 0 and 1")
    time = run.time.values

    def one(forces: Vector) -> float:
        # Chains shorter than the longest are filled up with NaN.
        force = forces[np.flatnonzero(~np.isnan(forces).all(axis=1))[-1]]
        level = threshold * force.max()
        above = force > level
        start = int(above.argmax())
        length = int((~above[start:]).argmax())
        if level <= 0.0 or start == 0 or length == 0:
            return float("nan")
        crossings = []
        for i in (start, start + length):
            share = (level - force[i - 1]) / (force[i] - force[i - 1])
            crossings.append(float(time[i - 1] + share * (time[i] - time[i - 1])))
        return crossings[1] - crossings[0]

    kept = int(run.contact[-1])
    if "beads" in run.attrs and kept <= int(run.attrs["beads"]):
        raise ValueError(f"run: is a batch that kept contacts up to {kept}; keep the last bead among its sensors")
    force = dynamic.reset_coords(drop=True)
    result = xr.apply_ufunc(one, force, input_core_dims=[["contact", "time"]], vectorize=True)
    return _number_or_array(result, "s", "contact of the last bead")


def energy_error(run: xr.Dataset) -> float | xr.DataArray:
    """Greatest change of the total energy over a run, in units of the striker's energy.

    The total holds beads, contacts, gravity and losses of all chains, the structures' energies and what their damping
    took, less what force histories or pistons put in. Where a structure's energy is not known (a black box) the work
    done on it stands for it. A float for a run, an array for a sweep. Raises ValueError for one chain or structure of
    several: the energy is that of all.
    """
    _dynamic_force(run)
    check_whole(run)
    if "kinetic_energy" not in run:
        raise ValueError("run: holds no energies, as of a batch; must be the Dataset of CoSimulation or sweep")
    of_chains = run.kinetic_energy + run.contact_energy + run.dissipated_energy - run.excitation_work
    of_structures = (run.structure_energy + run.structure_dissipated_energy).fillna(run.structure_work)
    total = _summed(of_chains, "chain") + _summed(of_structures, "structure")
    change = abs(total - total.isel(time=0)).max("time") / _summed(run.impact_energy, "chain")
    return _number_or_array(change.reset_coords(drop=True), "1", "energy error")


def _summed(values: xr.DataArray, dimension: str) -> xr.DataArray:
    """Over chains or structures, where a run has several."""
    return values.sum(dimension) if dimension in values.dims else values


def _number_or_array(values: xr.DataArray, units: str, label: str) -> float | xr.DataArray:
    if values.ndim == 0:
        return float(values)
    values.attrs = {"units": units, "long_name": label}
    return values


def _over_axes(run: xr.Dataset, sensor: int, wave: str, what: str, units: str, label: str) -> xr.DataArray:
    one_of("wave", wave, WAVES)

    place, time, needed = WAVES.index(wave), run.time.values, list[float]()
    series, dimensions = _series(run, sensor)
    _warn_of_ends(run, sensor)

    def one(*series: Vector) -> float:
        incident, back = _waves(time, *series, smallest=SMALLEST_WAVE)
        if incident and not back:
            needed.append(_why_none(run, sensor, series, SMALLEST_WAVE, False)[1])
        return float(getattr(back[place], what)) if len(back) > place else float("nan")

    result: xr.DataArray = xr.apply_ufunc(one, *series, input_core_dims=dimensions, vectorize=True)
    if late := [until for until in needed if until > time[-1]]:
        several = f", in {len(late)} of {result.size} runs" if result.size > 1 else ""
        reason = short_record(float(time[-1]), max(late), f"bead {sensor}")
        caution(f"record: {reason.removeprefix('the record ')}{several}")
    result.attrs = {"units": units, "long_name": f"{label}, bead {sensor}"}
    return result.rename(what)


def _series(run: xr.Dataset, sensor: int) -> tuple[tuple[xr.DataArray, ...], list[list[str]]]:
    """What tells the waves over a bead, and the dimensions of each for one run.

    Of a signal the force; of a run the dynamic forces of the bead's contacts and those beyond, and its velocity.
    """
    if _is_signal(run):
        return (sensor_force(run, sensor),), [["time"]]
    *_, velocity = _passing(run, sensor)
    number, kept = int(sensor), _kept(run)
    beyond = list(takewhile(kept.__contains__, count(number)))
    force = _dynamic_force(run).sel(contact=beyond)
    return (force.reset_coords(drop=True), velocity), [["contact", "time"], ["time"]]


def _passing(run: xr.Dataset, sensor: int) -> tuple[xr.DataArray, ...]:
    """The two contact forces of a bead of a run, above the preload, and its velocity."""
    return (*_contact_pair(run, sensor), run.velocity.sel(bead=int(sensor)).reset_coords(drop=True))


def _waves(time: Vector, *series: Vector, smallest: float) -> tuple[Wave | None, list[ReflectedWave]]:
    """The incident wave and those that came back, from a run's series or a signal's one; see `_series`."""
    if len(series) == 1:
        found = waves_of_signal(time, series[0], smallest)
        origins = ["unknown"] * (len(found) - 1)
    else:
        force, velocity = series
        # Chains shorter than the longest are filled up with NaN.
        force = force[~np.isnan(force).all(axis=1)]
        if len(force) < 2:
            return None, []
        found, origins = waves_of_run(time, force, velocity, smallest)
    if not found:
        return None, []
    incident = Wave(*found[0])
    return incident, [
        ReflectedWave(amplitude, arrival, amplitude / incident.amplitude, arrival - incident.arrival, begins)
        for (amplitude, arrival), begins in zip(found[1:], origins, strict=True)
    ]
