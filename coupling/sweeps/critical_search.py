"""The search for a critical distance: a scan over distances, then refinement of the last crossing."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import product
from math import inf
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.critical_distance import FEWEST, LABEL, SWALLOWED, last_crossing
from coupling.results.findings import findings_of, gathered, warn, with_warnings
from coupling.results.schema import OF_RUNS
from coupling.sweeps.points import Task, run_points, shown
from coupling.sweeps.sweep import axis_labels, axis_values, check_build
from structures.checks import listed, not_negative, positive, short, whole, within
from structures.structure import Vector
from structures.units import readable

DEFAULT_BRACKET = 0.2e-3  # m; linear interpolation of AR in it is far more accurate than any measured distance

Curve = dict[float, xr.Dataset]  # the measures of one curve, by the distances of the runs, m


def critical_distance_search(
    build: Callable[..., CoSimulation],
    until: float,
    sensor: int,
    distances: Iterable[float],
    tolerance: float | Iterable[float] = 0.02,
    bracket: float = DEFAULT_BRACKET,
    jobs: int | None = None,
    **axes: Iterable[Any],
) -> xr.Dataset:
    """Find the distance beyond which AR stays within a tolerance of its far value, by refinement.

    Runs `build(distance=…)` at all distances of the scan. Then it adds distances around the last crossing of far value
    ± tolerance, until the bracket of the crossing is short enough. It also adds distances beyond the crossing at which
    AR may leave the tolerance again between two samples. The far value is AR at the largest distance.

    Parameters
    ----------
    build : callable
        Returns the CoSimulation for a distance (m) and one value of each axis, by their names.
    until : float
        Length of the record, s. It must contain the wave that returns at the largest distance.
    sensor : int
        Bead whose force is read, counted from the struck end.
    distances : sequence of float
        The first scan, m, three or more. AR oscillates with the distance, so the scan must be dense enough to show
        where AR turns.
    tolerance : float or sequence of float
        Allowed difference of AR from its far value, in units of the incident amplitude. Several tolerances share their
        samples.
    bracket : float
        Largest length of the bracket, m.
    jobs : int, optional
        Number of processes; by default one for each core.
    **axes : sequence
        Further arguments of build, such as diameter=[4.76e-3, 9.53e-3]: one curve for each combination. Curves that
        differ only in the last axis run at the same distance in one process, one after the other, so that build may
        keep the reduced structure for the next bead (`functools.lru_cache`).

    Returns
    -------
    xarray.Dataset
        Over the axes: `critical_distance` (m; over "within", the tolerances, if there are several) and its `bracket`
        (m; "end": low, high); `lower_bound`, true if the far value is not reached, so that critical_distance is NaN and
        the low end of the bracket is a lower bound; `far_value`, and `settled`, true if AR changes by less than half
        the tolerance over the last third of the distances; `short_record`, true if the record ends before a wave from
        the greatest distance is back. All samples: `amplitude_ratio`, `time_of_flight` (s) and `sampled` over
        "distance". NaN at a sampled distance means that no wave returned within the record.

    Raises
    ------
    ValueError
        For an argument of a wrong kind or out of its range, and one that `build` does not take.

    Warns
    -----
    HertzlinkWarning
        If the smallest distance is an upper bound; if AR may leave the tolerance between two samples, or may not have
        settled at the greatest distance; or if the result depends on the last digits of AR.

    References
    ----------
    Thesis, section 6.2.2.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 20, striker=bead, impact_speed=0.31)
    >>> def at(distance):
    ...     plate = hl.half_plane(2.29e-3, hl.ALUMINIUM_6061, "clamped", distance, until=0.7e-3)
    ...     return hl.CoSimulation(chain, plate)
    >>> found = hl.critical_distance_search(at, until=0.7e-3, sensor=7, distances=[0.01, 0.02, 0.03, 0.1], jobs=1)
    >>> low, high = found.bracket.values * 1e3
    >>> print(f"{found.critical_distance.item() * 1e3:.0f} mm, in a bracket shorter than 0.2 mm: {high - low <= 0.2}")
    15 mm, in a bracket shorter than 0.2 mm: True
    """
    until, sensor = positive("until", until, "s"), whole("sensor", sensor)
    jobs = None if jobs is None else whole("jobs", jobs)
    scan = sorted(not_negative("distances", one, "m") for one in listed("distances", distances, object, "numbers, m"))
    if len(scan) < FEWEST or len(set(scan)) < len(scan):
        raise ValueError(f"distances = {short(scan)}: must be three or more, none of them twice")
    many = listed("tolerance", tolerance, object, "numbers") if isinstance(tolerance, Iterable) else [tolerance]
    tolerances = [positive("tolerance", value) for value in many]
    # A mesh that moves with the contact makes AR scatter by about 1e-5: a few µm of distance.
    bracket = within("bracket", bracket, 1e-6, inf, "m")
    values = axis_values(axes, OF_RUNS | {"distance", "within", "end"})
    check_build(build, {"distance": scan, **values}, "axes")

    read = {"amplitude_ratio": amplitude_ratio, "time_of_flight": time_of_flight}
    task = Task(build, until, lambda run: xr.Dataset({name: of(run, sensor) for name, of in read.items()}))
    points = [dict(zip(values, point, strict=True)) for point in product(*values.values())]
    together = len(values[list(values)[-1]]) if values else 1
    curves: list[Curve] = [{} for _ in points]
    searches = [_Search(i, curve, limit, bracket) for i, curve in enumerate(curves) for limit in tolerances]
    said = dict[str, list[str]]()
    wanted = {(i, distance) for i in range(len(curves)) for distance in scan}
    while wanted:
        # Curves that differ only in the last axis run at the same distance in one process.
        places = sorted(wanted, key=lambda place: (place[0] // together, place[1], place[0]))
        at = [{**points[i], "distance": distance} for i, distance in places]
        runs = run_points(task, at, jobs, together, "critical distance")
        for (i, distance), point, run in zip(places, at, runs, strict=True):
            assert isinstance(run, xr.Dataset)  # errors are raised, as there is no store
            curves[i][distance] = run
            if lines := findings_of(run):
                said[shown(point, build, distance="m")] = lines
        wanted = {(search.number, distance) for search in searches for distance in search.next()}

    data = _dataset(searches, curves, tolerances, values)
    findings = gathered(said, sum(map(len, curves)))
    for search in searches:
        findings += [one + f" (at {shown(points[search.number], build)})" * bool(axes) for one in search.findings()]
    warn(findings)
    data = data if isinstance(tolerance, Iterable) else data.squeeze("within")
    return with_warnings(data, findings).assign_attrs(until=until, sensor=sensor)


class _Search:
    """The search for the last crossing of one curve for one tolerance, until its bracket, m, is short enough."""

    def __init__(self, number: int, curve: Curve, tolerance: float, bracket: float) -> None:
        self.number, self.curve, self.tolerance, self.bracket, self.before = number, curve, tolerance, bracket, inf

    def crossing(self) -> tuple[float, float, float]:
        """Return the crossing and its bracket, m; see `last_crossing`."""
        return last_crossing(*as_arrays(self.curve), self.tolerance)

    def next(self) -> list[float]:
        """Return the distances, m, that the search needs next: in the bracket while it is too long, then beyond it."""
        _, low, high = self.crossing()
        if not high < inf:
            return []
        if low not in self.curve or high - low <= self.bracket:
            return self._doubtful(high)

        slow, self.before = high - low > 0.5 * self.before, high - low
        if slow or high - low <= 2.0 * self.bracket:
            return [round(0.5 * (low + high), 9)]  # the midpoint suffices, or is safer

        # Two places beside the crossing of a spline through three neighbours on each side. The crossing is then
        # nearly midway between two samples whose distance is a little less than the bracket.
        x, y = self.samples()
        left, right = x.searchsorted((low, high))
        near, level = slice(max(0, left - 2), right + 3), float(np.copysign(self.tolerance, y[left]))
        spline, reach = CubicSpline(x[near], y[near]), 0.45 * self.bracket
        crossing = brentq(lambda d: spline(d) - level, low, high)
        return [round(place, 9) for place in (crossing - reach, crossing + reach) if low < place < high]

    def _doubtful(self, high: float) -> list[float]:
        """Return places beyond the bracket where AR may leave the tolerance between two samples: turns of a spline
        through all samples, near its edge or outside it; else, up to twice the crossing, middles of wide intervals."""
        x, y = self.samples()
        spline = CubicSpline(x, y)
        turns = spline.derivative().roots(extrapolate=False)
        turns = turns[(turns > high) & (turns < x[-1]) & (abs(spline(turns)) > 0.7 * self.tolerance)]
        before, after = x[x.searchsorted(turns) - 1], x[x.searchsorted(turns)]
        far = np.minimum(turns - before, after - turns) > np.maximum(0.1 * (after - before), self.bracket)
        # An echo depends on d²/t, so AR turns at distances that grow by a factor.
        wide = (x[1:] > 1.4 * x[:-1]) & (x[1:] - x[:-1] > self.bracket) & (x[:-1] >= high) & (x[:-1] < 2.0 * high)
        return [round(place, 9) for place in turns[far].tolist() or (0.5 * (x[1:] + x[:-1]))[wide].tolist()]

    def samples(self) -> tuple[Vector, Vector]:
        """Return the distances with a wave, m, and AR there minus its far value."""
        x, y = as_arrays(self.curve)
        return x[~np.isnan(y)], y[~np.isnan(y)] - y[-1]

    def change(self) -> float:
        """Return the range of AR in the last third of the distances beyond the crossing, or in the last three; infinite
        if there are fewer with a wave."""
        x, y = self.samples()
        x, y = x[x >= self.crossing()[2]], y[x >= self.crossing()[2]]
        return float(np.ptp(y[x >= min(x[-1] / 1.5, x[-FEWEST])])) if x.size >= FEWEST else inf

    def findings(self) -> Iterator[str]:
        """Yield what may mislead in the result."""
        (distances, ratios), (found, low, high) = as_arrays(self.curve), self.crossing()
        missing = [readable(d, "m", 4) for d in distances[np.isnan(ratios)].tolist() if not d < low]
        if np.isnan(ratios[-1]) or np.isinf(high):  # an unknown far value, or a lower bound, says so
            if np.isnan(ratios[-1]) and not record_is_short(self.curve):
                yield f"{LABEL}: {SWALLOWED}; take smaller beads"
            return
        if missing:
            yield f"waves: none returned at {', '.join(missing)}, so AR is not known there"
        if low == 0.0 < high:
            cure = "" if missing else "; give smaller distances"
            which = f"all distances{' with a wave' * bool(missing)}, so the smallest, {readable(high, 'm', 6)}"
            yield f"{LABEL}: AR is within the tolerance at {which}, is an upper bound{cure}"
        if not (change := self.change()) <= 0.5 * self.tolerance:
            why = f"AR changes by {change:.2g} in the last third of the distances"
            few = "fewer than three distances beyond the critical one have a wave"
            yield f"far value: AR may not have settled: {why if change < inf else few}; give greater distances"
        for factor in (0.95, 1.05):
            other = last_crossing(distances, ratios, factor * self.tolerance)[0]
            if abs(other - found) > 0.1 * found:
                yield f"tolerance: {factor} times the tolerance gives a {LABEL} of about {readable(other, 'm', 2)}"


def record_is_short(curve: Curve) -> bool:
    """Return whether the record ends before a wave from the greatest distance is back."""
    return any(finding.startswith("record: ") for finding in findings_of(curve[max(curve)]))


def as_arrays(curve: Curve) -> tuple[Vector, Vector]:
    """Return the distances of a curve, m, in rising order, and AR there."""
    distances = sorted(curve)
    return np.array(distances), np.array([curve[distance].amplitude_ratio.item() for distance in distances])


def _dataset(
    searches: Sequence[_Search], curves: Sequence[Curve], tolerances: list[float], values: dict[str, list[Any]]
) -> xr.Dataset:
    """Return all samples, on the union of the distances of all curves, and the crossings for all tolerances."""
    distances, first = sorted(set().union(*curves)), next(iter(curves[0].values()))
    shape, each, over = tuple(map(len, values.values())), [*values, "distance"], [*values, "within"]
    variables: dict[str, Any] = {}
    for name, variable in first.data_vars.items():
        of_curves = [[curve[d][name].item() if d in curve else np.nan for d in distances] for curve in curves]
        variables[str(name)] = each, np.reshape(of_curves, (*shape, -1)), variable.attrs
    sampled = [[d in curve for d in distances] for curve in curves]
    found = np.reshape([search.crossing() for search in searches], (*shape, len(tolerances), 3))
    far = np.reshape([as_arrays(curve)[1][-1] for curve in curves], shape)
    short = np.reshape([record_is_short(curve) for curve in curves], shape)
    late, metres = "whether the record ends before a wave from the greatest distance is back", {"units": "m"}
    settled = np.reshape([search.change() <= 0.5 * search.tolerance for search in searches], found.shape[:-1])
    variables |= {
        "sampled": (each, np.reshape(sampled, (*shape, -1)), {"long_name": "whether there is a run"}),
        "critical_distance": (over, found[..., 0], {**metres, "long_name": LABEL}),
        "bracket": ([*over, "end"], found[..., 1:], {**metres, "long_name": f"bracket of the {LABEL}"}),
        "lower_bound": (
            over,
            np.isinf(found[..., 2]),
            {"long_name": f"whether the {LABEL} is beyond the bracket's low end"},
        ),
        "settled": (over, settled, {"long_name": "whether AR has settled at the greatest distance"}),
        "short_record": ([*values], short, {"long_name": late}),
        "far_value": ([*values], far, {"units": "1", "long_name": "far value of the amplitude ratio"}),
    }
    coordinates: dict[str, Any] = {name: (name, axis_labels(axis)) for name, axis in values.items()}
    coordinates["distance"] = "distance", distances, metres
    coordinates["within"] = "within", tolerances, {"units": "1", "long_name": "tolerance of AR"}
    return xr.Dataset(variables, {**coordinates, "end": ["low", "high"]}, first.attrs)
