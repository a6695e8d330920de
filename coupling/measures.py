"""What is read from a run: every measure is a function of the Dataset, over any axes of a sweep."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.signal import find_peaks, peak_widths

from structures.checks import instance, one_of, positive, whole
from structures.structure import Vector

SMALLEST_WAVE = 0.01
"""Waves below this part of the incident one are not reported: beads that rattle after a wave make such peaks."""

FIRST_WAVE = 0.05
"""The incident wave rises by at least this part of the greatest force: waves of a heavy striker pile up later."""

TOGETHER = 0.2
"""Contact peaks nearer than this part of their width do not tell a direction."""

WAVES = ("primary", "secondary")


@dataclass(frozen=True)
class Wave:
    """A wave's passage over a sensor: amplitude (N, above the preload) and arrival (s) of its peak."""

    amplitude: float
    arrival: float


@dataclass(frozen=True)
class ReflectedWave(Wave):
    """A wave that came back, beside the incident one: amplitude ratio AR, and time of flight TOF (s)."""

    amplitude_ratio: float
    time_of_flight: float


class Reflections(NamedTuple):
    """The incident wave, and the first and second that came back; None where there is none."""

    incident: Wave | None
    primary: ReflectedWave | None
    secondary: ReflectedWave | None


def sensor_force(run: xr.Dataset, sensor: int) -> xr.DataArray:
    """Force at the centre of bead `sensor` (1 … N from the struck end), N, above the preload.

    The mean of the bead's two contact forces (thesis, section 3.1). Raises ValueError for a sensor outside 1 … N.
    """
    above, below = _contact_pair(run, sensor)
    return (0.5 * (above + below)).assign_attrs(units="N", long_name=f"force at bead {int(sensor)}")


def _contact_pair(run: xr.Dataset, sensor: int) -> tuple[xr.DataArray, xr.DataArray]:
    """Forces of a bead's two contacts, the struck side first, above the preload."""
    instance("run", run, xr.Dataset, "the Dataset of a run or a sweep")
    beads, number = run.sizes["contact"] - 1, whole("sensor", sensor)
    if number > beads:
        raise ValueError(f"sensor = {sensor!r}: must be a bead from 1 to {beads}, counted from the struck end")
    dynamic = run.contact_force - run.static_force
    above, below = (dynamic.sel(contact=n).reset_coords(drop=True) for n in (number, number + 1))
    return above, below


def reflections(run: xr.Dataset, sensor: int, smallest: float = SMALLEST_WAVE) -> Reflections:
    """The waves that pass a sensor bead of one run.

    A wave is a peak of both contact forces of the bead, and its amplitude the peak of their mean, placed between
    samples by a cubic spline. Which contact it passes first tells its direction: the incident wave is the first that
    goes on, reflected ones are those that come back. A heavy striker sends a train; its first wave is the incident one.
    smallest: a peak that is lower than this part of the incident amplitude, or rises by less, is no wave. Small
    secondary waves of 1 to 3 % are real: every collision of a wave with a wall leaves some (thesis, section 1.5).
    A solitary wave is five beads long: nearer than that to either end of the chain, or to a bead unlike the others,
    incident and reflected waves merge, and amplitudes mean little. The reflected waves of a striker much heavier than
    a bead ride on its train, and may be larger than the incident one.
    """
    above, below = _contact_pair(run, sensor)
    if above.ndim != 1:
        raise ValueError("run: holds a sweep; use amplitude_ratio and time_of_flight, or select one point first")
    velocity = run.velocity.sel(bead=int(sensor)).values
    return _reflections(run.time.values, above.values, below.values, velocity, positive("smallest", smallest))


def amplitude_ratio(run: xr.Dataset, sensor: int, wave: str = "primary") -> xr.DataArray:
    """AR = reflected amplitude / incident amplitude at a sensor (thesis, section 6.1.1); NaN where no wave came.

    A run gives a number, a sweep an array over its axes. wave: "primary" or "secondary".
    """
    return _over_axes(run, sensor, wave, "amplitude_ratio", "1", f"amplitude ratio, {wave} wave")


def time_of_flight(run: xr.Dataset, sensor: int, wave: str = "primary") -> xr.DataArray:
    """TOF, s: from the incident peak to the reflected one at a sensor (thesis, section 6.1.1); NaN where no wave came.

    A run gives a number, a sweep an array over its axes. wave: "primary" or "secondary".
    """
    return _over_axes(run, sensor, wave, "time_of_flight", "s", f"time of flight, {wave} wave")


def wave_speed(run: xr.Dataset, first: int, second: int) -> float:
    """Speed, m/s, of the incident wave between the peaks at two sensors of one run; NaN where it did not pass both."""
    first, second = whole("first", first), whole("second", second)
    if first == second:
        raise ValueError(f"second = {second!r}: must be another sensor than first")
    waves = [reflections(run, sensor).incident for sensor in (first, second)]
    if waves[0] is None or waves[1] is None:
        return float("nan")
    distance = float(run.centre.sel(bead=second) - run.centre.sel(bead=first))
    return distance / (waves[1].arrival - waves[0].arrival)


def contact_time(run: xr.Dataset, threshold: float = 0.01) -> float | xr.DataArray:
    """Time, s, that the last bead first pushes the structure.

    From where the force above the preload first exceeds `threshold` of its greatest value to where it falls below
    it again, placed by linear interpolation; NaN where it does not. A float for a run, an array for a sweep.
    """
    instance("run", run, xr.Dataset, "the Dataset of a run or a sweep")
    if not 0.0 < positive("threshold", threshold) < 1.0:
        raise ValueError(f"threshold = {threshold!r}: must lie between 0 and 1")
    time = run.time.values

    def one(force: Vector) -> float:
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

    force = (run.contact_force - run.static_force).isel(contact=-1).reset_coords(drop=True)
    result = xr.apply_ufunc(one, force, input_core_dims=[["time"]], vectorize=True)
    return _number_or_array(result, "s", "contact of the last bead")


def energy_error(run: xr.Dataset) -> float | xr.DataArray:
    """Greatest change of the total energy over a run, in units of the striker's energy.

    The total holds beads, contacts, gravity, what the dashpots took, and the structure's energy. Where that is not
    known (a damped structure, a black box) the work done on the structure stands for it. A float for a run, an array
    for a sweep.
    """
    instance("run", run, xr.Dataset, "the Dataset of a run or a sweep")
    total = run.kinetic_energy + run.contact_energy + run.dissipated_energy
    total = total + run.structure_energy.fillna(run.interface_work)
    change = abs(total - total.isel(time=0)).max("time") / run.impact_energy
    return _number_or_array(change.reset_coords(drop=True), "1", "energy error")


def _number_or_array(values: xr.DataArray, units: str, label: str) -> float | xr.DataArray:
    if values.ndim == 0:
        return float(values)
    values.attrs = {"units": units, "long_name": label}
    return values


def critical_distance(ratio: xr.DataArray, tolerance: float = 0.02) -> float | xr.DataArray:
    """The distance, m, beyond which AR stays within `tolerance` of its far value, AR at the greatest distance.

    ratio: AR over a dimension "distance" (or over its only one), and over any others. tolerance is absolute, in
    units of the incident amplitude. The last crossing of far ± tolerance is interpolated linearly between the
    samples. NaN where AR is out of tolerance up to the last sample but one: the far value is then not reached. The
    smallest distance where AR is within tolerance everywhere. A missing wave (NaN) counts as AR = 0.
    Returns a float for one curve, else a DataArray.
    """
    positive("tolerance", tolerance)
    instance("ratio", ratio, xr.DataArray, "a DataArray of amplitude ratios over distances")
    dimension = "distance" if "distance" in ratio.dims else str(ratio.dims[0])
    if ratio.sizes[dimension] < 3:
        raise ValueError(f"ratio: must hold three distances or more, not {ratio.sizes[dimension]}")
    ordered = ratio.sortby(dimension).fillna(0.0)
    distances = ordered[dimension].values.astype(float)

    def last_crossing(curve: Vector) -> float:
        excess = np.abs(curve - curve[-1]) - tolerance
        outside = np.flatnonzero(excess > 0.0)
        if outside.size == 0:
            return float(distances[0])
        i = int(outside[-1])
        if i + 1 == distances.size - 1:
            return float("nan")
        share = excess[i] / (excess[i] - excess[i + 1])
        return float(distances[i] + share * (distances[i + 1] - distances[i]))

    if ordered.ndim == 1:
        return last_crossing(ordered.values)
    result: xr.DataArray = xr.apply_ufunc(last_crossing, ordered, input_core_dims=[[dimension]], vectorize=True)
    result.attrs = {"units": "m", "long_name": "critical distance"}
    return result


def _over_axes(run: xr.Dataset, sensor: int, wave: str, what: str, units: str, label: str) -> xr.DataArray:
    one_of("wave", wave, WAVES)

    def one(above: Vector, below: Vector, velocity: Vector) -> float:
        found = getattr(_reflections(time, above, below, velocity, SMALLEST_WAVE), wave)
        return float("nan") if found is None else float(getattr(found, what))

    inputs = (*_contact_pair(run, sensor), run.velocity.sel(bead=int(sensor)).reset_coords(drop=True))
    time = run.time.values
    result: xr.DataArray = xr.apply_ufunc(one, *inputs, input_core_dims=[["time"]] * 3, vectorize=True)
    result.attrs = {"units": units, "long_name": f"{label}, bead {sensor}"}
    return result.rename(what)


def _reflections(time: Vector, above: Vector, below: Vector, velocity: Vector, smallest: float) -> Reflections:
    """Passages over a bead in order of time, from the dynamic forces of its two contacts; see `reflections`."""
    force = 0.5 * (above + below)
    top = force.max(initial=0.0)
    if not top > 0.0:
        return Reflections(None, None, None)
    forward = [passage for passage in _passages(above, below, velocity, FIRST_WAVE * top) if passage.goes_on]
    if not forward:
        return Reflections(None, None, None)
    incident = Wave(*_refined(time, force, forward[0].peak))
    later = [p for p in _passages(above, below, velocity, smallest * incident.amplitude) if p.start > forward[0].end]
    back = [_refined(time, force, passage.peak) for passage in later if not passage.goes_on]
    found = [
        ReflectedWave(amplitude, arrival, amplitude / incident.amplitude, arrival - incident.arrival)
        for amplitude, arrival in back[:2]
    ]
    return Reflections(incident, found[0] if found else None, found[1] if len(found) > 1 else None)


class _Passage(NamedTuple):
    """A wave over a bead, in samples: its first and last contact peak, the peak of the mean, and whether it goes on."""

    start: int
    end: int
    peak: int
    goes_on: bool


def _passages(above: Vector, below: Vector, velocity: Vector, least: float) -> list[_Passage]:
    """Waves over a bead in order of time.

    A wave is a peak in each contact force, each the other's nearest; the contact that it passes first tells where it
    goes. Between beads that have drifted apart a weak wave is two collisions, and still one wave. Where a bead moves
    as one with a neighbour, as in a dimer, both contacts peak together, and the bead's velocity tells the direction.
    """
    peaks = [find_peaks(force, height=least, prominence=least)[0] for force in (above, below)]
    if not (peaks[0].size and peaks[1].size):
        return []
    apart = np.abs(peaks[0][:, None] - peaks[1][None, :])
    nearest_below, nearest_above = apart.argmin(axis=1), apart.argmin(axis=0)
    widths = peak_widths(above, peaks[0])[0]
    force, found = above + below, []
    for i, first in enumerate(peaks[0]):
        other = int(peaks[1][nearest_below[i]])
        if nearest_above[nearest_below[i]] != i:
            continue
        start, end = sorted((int(first), other))
        begin = max(0, start - 3)
        peak = begin + int(force[begin : end + 4].argmax())
        together = end - start < TOGETHER * widths[i]
        goes_on = bool(velocity[peak] > 0.0) if together else bool(first < other)
        if 0.5 * force[peak] >= least:
            found.append(_Passage(start, end, peak, goes_on))
    return found


def _refined(time: Vector, force: Vector, peak: int) -> tuple[float, float]:
    """Amplitude and time of the peak of a cubic spline through the samples around a sampled peak."""
    near = slice(max(0, peak - 4), peak + 5)
    spline = CubicSpline(time[near], force[near])
    inside = [t for t in spline.derivative().roots(extrapolate=False) if abs(t - time[peak]) <= time[1] - time[0]]
    best = max(inside, key=spline, default=time[peak])
    return float(spline(best)), float(best)
