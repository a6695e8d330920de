"""What is read from a run: every measure is a function of the Dataset, over any axes of a sweep."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.signal import find_peaks

from structures.checks import one_of, positive, whole
from structures.structure import Vector

SMALLEST_WAVE = 0.01
"""Waves below this part of the incident one are not reported: beads that rattle after a wave make such peaks."""

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
    beads = run.sizes["contact"] - 1
    if whole("sensor", sensor) > beads:
        raise ValueError(f"sensor = {sensor!r}: must be a bead from 1 to {beads}, counted from the struck end")
    pair = run.contact_force.sel(contact=[sensor, sensor + 1])
    force = (pair - run.static_force.sel(contact=[sensor, sensor + 1])).mean("contact")
    named: xr.DataArray = force.reset_coords(drop=True).assign_attrs(units="N", long_name=f"force at bead {sensor}")
    return named


def reflections(run: xr.Dataset, sensor: int, smallest: float = SMALLEST_WAVE) -> Reflections:
    """The waves that pass a sensor bead of one run.

    A wave is a peak of the bead-centre force; the incident one is the first large peak, and reflected ones are
    later peaks that move the bead back towards the striker. Peaks are placed between samples by a cubic spline.
    smallest: peaks that rise by less than this part of the incident amplitude are no waves.
    """
    if run.contact_force.ndim != 2:
        raise ValueError("run: holds a sweep; use amplitude_ratio and time_of_flight, or select one point first")
    force = sensor_force(run, sensor)
    velocity = run.velocity.sel(bead=sensor)
    return _reflections(run.time.values, force.values, velocity.values, smallest)


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
    """Speed, m/s, of the incident wave between the peaks at two sensors; NaN where it did not pass both."""
    if first == second:
        raise ValueError(f"second = {second!r}: must be another sensor than first")
    waves = [reflections(run, sensor).incident for sensor in (first, second)]
    if waves[0] is None or waves[1] is None:
        return float("nan")
    distance = float(run.centre.sel(bead=second) - run.centre.sel(bead=first))
    return distance / (waves[1].arrival - waves[0].arrival)


def contact_time(run: xr.Dataset, threshold: float = 0.01) -> float:
    """Time, s, that the last bead first pushes the structure.

    From where the force above the preload first exceeds `threshold` of its greatest value to where it falls below
    it again; NaN where it does not. The limits are placed by linear interpolation.
    """
    force = (run.contact_force - run.static_force).isel(contact=-1).values
    level = positive("threshold", threshold) * force.max()
    above = force > level
    if not above.any() or level <= 0.0:
        return float("nan")
    start = int(above.argmax())
    length = int((~above[start:]).argmax())
    if start == 0 or length == 0:
        return float("nan")
    time = run.time.values

    def crossing(i: int) -> float:
        return float(time[i - 1] + (time[i] - time[i - 1]) * (level - force[i - 1]) / (force[i] - force[i - 1]))

    return crossing(start + length) - crossing(start)


def energy_error(run: xr.Dataset) -> float:
    """Greatest change of the total energy over a run, in units of the striker's energy.

    The total holds beads, contacts, gravity, what the dashpots took, and the structure's energy. Where that is not
    known (a damped structure, a black box) the work done on the structure stands for it.
    """
    total = run.kinetic_energy + run.contact_energy + run.dissipated_energy
    total = total + (run.structure_energy if "structure_energy" in run else run.interface_work)
    return float(abs(total - total.isel(time=0)).max()) / float(run.attrs["impact_energy"])


def critical_distance(ratio: xr.DataArray, tolerance: float = 0.02) -> float | xr.DataArray:
    """The distance, m, beyond which AR stays within `tolerance` of its far value, AR at the greatest distance.

    ratio: AR over a dimension "distance" (or over its only one), and over any others. tolerance is absolute, in
    units of the incident amplitude. The last crossing of far ± tolerance is interpolated linearly between the
    samples. NaN where AR is out of tolerance up to the last sample but one: the far value is then not reached. The
    smallest distance where AR is within tolerance everywhere. A missing wave (NaN) counts as AR = 0.
    Returns a float for one curve, else a DataArray.
    """
    positive("tolerance", tolerance)
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

    def one(force: Vector, velocity: Vector) -> float:
        found = getattr(_reflections(time, force, velocity, SMALLEST_WAVE), wave)
        return float("nan") if found is None else float(getattr(found, what))

    time = run.time.values
    inputs = sensor_force(run, sensor), run.velocity.sel(bead=sensor).reset_coords(drop=True)
    result: xr.DataArray = xr.apply_ufunc(one, *inputs, input_core_dims=[["time"], ["time"]], vectorize=True)
    result.attrs = {"units": units, "long_name": f"{label}, bead {sensor}"}
    return result.rename(what)


def _reflections(time: Vector, force: Vector, velocity: Vector, smallest: float) -> Reflections:
    """Peaks in order of time; see `reflections`."""
    top = force.max(initial=0.0)
    if not top > 0.0:
        return Reflections(None, None, None)
    forward = [i for i in find_peaks(force, prominence=0.5 * top)[0] if velocity[i] > 0.0]
    if not forward:
        return Reflections(None, None, None)
    first = forward[0]
    incident = Wave(*_refined(time, force, first))
    peaks = find_peaks(force, prominence=smallest * incident.amplitude)[0]
    back = [_refined(time, force, i) for i in peaks if i > first and velocity[i] < 0.0]
    found = [
        ReflectedWave(amplitude, arrival, amplitude / incident.amplitude, arrival - incident.arrival)
        for amplitude, arrival in back[:2]
    ]
    return Reflections(incident, found[0] if found else None, found[1] if len(found) > 1 else None)


def _refined(time: Vector, force: Vector, peak: int) -> tuple[float, float]:
    """Amplitude and time of the peak of a cubic spline through the samples around a sampled peak."""
    near = slice(max(0, peak - 4), peak + 5)
    spline = CubicSpline(time[near], force[near])
    inside = [t for t in spline.derivative().roots(extrapolate=False) if abs(t - time[peak]) <= time[1] - time[0]]
    best = max(inside, key=spline, default=time[peak])
    return float(spline(best)), float(best)
