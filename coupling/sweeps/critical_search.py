"""The critical distance of a builder's runs: a scan over distances, then refinement of the last crossing."""

from collections.abc import Callable, Iterable
from functools import partial
from itertools import pairwise, product
from math import inf
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.critical_distance import FEWEST, LABEL, crossed_level, far_value, last_crossing
from coupling.results.findings import findings_of, gathered, warn, with_warnings
from coupling.results.schema import OF_RUNS
from coupling.sweeps.points import Task, run_points, shown
from coupling.sweeps.store import Point
from coupling.sweeps.sweep import axis_labels, axis_values, check_build
from structures.checks import each, finite, instance, listed, not_negative, positive, short, whole, within
from structures.structure import Vector
from structures.units import readable

DEFAULT_BRACKET = 0.2e-3
"""m. Between samples this close, linear interpolation of AR is far more accurate than any measured distance."""

SHORTEST_BRACKET = 1e-6
"""m. A mesh that moves with the contact makes AR scatter by about 1e-5, which corresponds to a few µm of distance."""

MEASURED_QUANTITIES = ("amplitude_ratio", "time_of_flight")
"""The quantities that are read from each run."""

OWN_DIMENSIONS = {"distance", "within", "end"}
"""Names of the result's own dimensions."""

SAMPLE_OFFSET = 0.45
"""The crossing is expected midway between two samples, each this fraction of the bracket's length away from it."""

SPLINE_NEIGHBOURS = 3
"""Number of samples on each side of the bracket through which a cubic spline predicts the crossing."""

Curve = dict[float, tuple[float, float]]
"""AR and TOF (s) of the samples of one curve, by their distances (m)."""


def critical_distance_search(
    build: Callable[..., CoSimulation],
    until: float,
    sensor: int,
    distances: Iterable[float],
    tolerance: float | Iterable[float] = 0.02,
    bracket: float = DEFAULT_BRACKET,
    relative: bool = False,
    jobs: int | None = None,
    known: xr.Dataset | None = None,
    far: float | xr.DataArray | None = None,
    **axes: Iterable[Any],
) -> xr.Dataset:
    """Find the distance beyond which AR stays within a tolerance of its far value, by refinement.

    Runs `build(distance=…)` at all distances of the scan. Then it adds distances around the last crossing of far value
    ± tolerance, until the bracket of the crossing is short enough.

    Parameters
    ----------
    build : callable
        Returns the CoSimulation for a distance (m) and for one value of each of the axes, by their names.
    until : float
        Length of the record, s. It must contain the wave that returns at the largest distance.
    sensor : int
        Bead whose force is read, counted from the struck end.
    distances : sequence of float
        The first scan, m, three or more. AR oscillates with the distance, so the scan must be dense enough to resolve
        the last crossing.
    tolerance : float or sequence of float
        Allowed difference of AR from its far value, in units of the incident amplitude, or with `relative` in units of
        the far value. Several tolerances share their samples.
    bracket : float
        Largest length of the bracket, m.
    relative : bool
        Whether the tolerance is relative to the far value.
    jobs : int, optional
        Number of processes; by default one for each core.
    known : xarray.Dataset, optional
        An earlier result for the same build, until, sensor and axes, for example with other tolerances: its samples are
        not run again.
    far : float or xarray.DataArray over the axes, optional
        The far value, if it is known: that of an infinite plate, or 0 if all waves fade. By default AR at the largest
        distance.
    **axes : sequence
        Further arguments of build, such as diameter=[4.76e-3, 9.53e-3]: one curve for each combination. Curves that
        share all but the last axis run in one process at the same distance, one after the other, so that build may keep
        the reduced structure for the next bead (`functools.lru_cache`).

    Returns
    -------
    xarray.Dataset
        Over the axes: `critical_distance` (m; over "within", the tolerances, if there are several) and its `bracket`
        (m; "end": low, high); `lower_bound`, true if the far value is unknown or not reached, so that critical_distance
        is NaN and the low end of the bracket is a lower bound; `far_value`. All samples: `amplitude_ratio`,
        `time_of_flight` (s) and `sampled` over "distance". NaN at a sampled distance means that no wave returned within
        the record. See `critical_distance` for the effect of NaN on the far value.

    Raises
    ------
    ValueError
        If an argument is of the wrong kind or out of its range, or build does not accept its arguments.

    Warns
    -----
    HertzlinkWarning
        If AR is within the tolerance at all distances, so that the smallest one is an upper bound.

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
    scan = _distances(distances)
    many = listed("tolerance", tolerance, object, "numbers") if isinstance(tolerance, Iterable) else [tolerance]
    tolerances = [positive("tolerance", value) for value in many]
    instance("relative", relative, bool, "True or False")
    bracket = within("bracket", bracket, SHORTEST_BRACKET, inf, "m")
    values = axis_values(axes, OF_RUNS | OWN_DIMENSIONS) if axes else {}
    check_build(build, {"distance": scan, **values})
    task = Task(build, until, partial(_measured, sensor=sensor))
    search = _Search(task, values, None if jobs is None else whole("jobs", jobs))
    if known is not None:
        search.recall(instance("known", known, xr.Dataset, "the Dataset of an earlier critical_distance_search"))
        for name, value in (("until", until), ("sensor", sensor)):
            if known.attrs.get(name) != value:
                raise ValueError(f"known: was found with {name} = {known.attrs.get(name)!r}, must be {value!r} as here")
    search.sample(
        [(i, distance) for i, curve in enumerate(search.curves) for distance in scan if distance not in curve]
    )
    refinement = Refinement(tolerances, relative, bracket, _far_values(far, values))
    while wanted := [(i, d) for i, curve in enumerate(search.curves) for d in refinement.wanted(i, curve)]:
        search.sample(wanted)
    distances_found = refinement.found(search.curves, tuple(map(len, values.values())), list(values))
    data = search.samples().merge(
        distances_found if isinstance(tolerance, Iterable) else distances_found.squeeze("within")
    )
    findings = search.findings() + _upper_bound(distances_found, scan[0])
    warn(findings)
    return with_warnings(data, findings).assign_attrs(until=until, sensor=sensor)


def _far_values(far: float | xr.DataArray | None, values: dict[str, list[Any]]) -> Vector:
    """Return the far value of each curve; NaN if it is not known; or a ValueError."""
    shape = tuple(map(len, values.values()))
    if far is None:
        return np.full(shape, np.nan).ravel()
    each(finite, "far", far.values if isinstance(far, xr.DataArray) else far)
    if not isinstance(far, xr.DataArray):
        return np.broadcast_to(finite("far", far), shape).ravel()
    if set(far.dims) != set(values) or far.transpose(*values).shape != shape:
        raise ValueError(f"far: must be a number, or a DataArray over {', '.join(values) or 'no axes'}")
    return np.asarray(far.transpose(*values).values, dtype=float).ravel()


def _distances(distances: Iterable[float]) -> list[float]:
    """Return the first scan in increasing order, or raise a ValueError."""
    scan = sorted(
        not_negative("distances", value, "m") for value in listed("distances", distances, object, "numbers, m")
    )
    if len(scan) < FEWEST:
        raise ValueError(f"distances = {scan}: must be three or more")
    if twice := [distance for distance, following in pairwise(scan) if distance == following]:
        raise ValueError(f"distances: must not hold {twice[0]:g} twice")
    return scan


def _measured(run: xr.Dataset, sensor: int) -> xr.Dataset:
    """Return the part of a run that is kept."""
    return xr.Dataset({"amplitude_ratio": amplitude_ratio(run, sensor), "time_of_flight": time_of_flight(run, sensor)})


class _Search:
    """The samples of all curves, one for each combination of the axes' values, and the runs that produce them."""

    def __init__(self, task: Task, values: dict[str, list[Any]], jobs: int | None) -> None:
        self.task, self.values, self.jobs = task, values, jobs
        self.points: list[Point] = [dict(zip(values, point, strict=True)) for point in product(*values.values())]
        self.curves: list[Curve] = [{} for _ in self.points]
        self.together = len(values[list(values)[-1]]) if values else 1
        self.labels: dict[str, dict[str, str]] = {}
        self.attrs: dict[str, Any] = {}
        self.found: dict[str, list[str]] = {}
        self.earlier: list[str] = []

    def recall(self, earlier: xr.Dataset) -> None:
        """Take over the samples of an earlier result."""
        names = list(self.values)
        if not {"sampled", *MEASURED_QUANTITIES} <= set(earlier) or {*earlier.sampled.dims} != {*names, "distance"}:
            raise ValueError(
                f"known: must be a result of critical_distance_search over {', '.join(names) or 'no axes'}"
            )
        for name, axis in self.values.items():
            if earlier[name].values.tolist() != axis_labels(axis):
                raise ValueError(f"known: holds other values of {name} than {short(axis)}")
        ordered = earlier[["sampled", *MEASURED_QUANTITIES]].transpose(*names, "distance")
        sampled, *columns = (ordered[name].values.reshape(len(self.curves), -1) for name in ordered)
        distances = earlier.distance.values.tolist()
        for curve, there, *values in zip(self.curves, sampled, *columns, strict=True):
            rows = zip(distances, *(value.tolist() for value in values), strict=True)
            curve.update({row[0]: (row[1], row[2]) for row, present in zip(rows, there, strict=True) if present})
        self.earlier = findings_of(earlier)
        self.attrs, self.labels = earlier.attrs, {name: earlier[name].attrs for name in MEASURED_QUANTITIES}

    def sample(self, wanted: list[tuple[int, float]]) -> None:
        """Run curves at distances; those that share the distance and all but the last axis, in one process."""
        ordered = sorted(set(wanted), key=lambda place: (place[0] // self.together, place[1], place[0]))
        points = [self._point(*place) for place in ordered]
        runs = run_points(self.task, points, self.jobs, self.together, "critical distance")
        for (curve, distance), point, run in zip(ordered, points, runs, strict=True):
            assert isinstance(run, xr.Dataset)  # errors are raised, as there is no store
            self.curves[curve][distance] = (run.amplitude_ratio.item(), run.time_of_flight.item())
            if lines := findings_of(run):
                self.found[shown(point)] = lines
            if not self.labels:
                self.attrs = run.attrs
                self.labels = {str(name): run[name].attrs for name in run.data_vars}

    def _point(self, curve: int, distance: float) -> Point:
        return {**self.points[curve], "distance": distance}

    def findings(self) -> list[str]:
        """Return the findings of the runs, the first of each kind."""
        return self.earlier + gathered(self.found, sum(map(len, self.curves)))

    def samples(self) -> xr.Dataset:
        """Return all samples, on the union of the distances of all curves."""
        distances = sorted(set().union(*self.curves))
        empty = (np.nan, np.nan)
        measured = np.array([[curve.get(d, empty) for d in distances] for curve in self.curves])
        sampled = np.array([[d in curve for d in distances] for curve in self.curves])
        names, shape = [*self.values, "distance"], (*map(len, self.values.values()), len(distances))
        variables: dict[str, Any] = {
            name: (names, measured[..., i].reshape(shape), self.labels[name])
            for i, name in enumerate(MEASURED_QUANTITIES)
        }
        variables["sampled"] = (names, sampled.reshape(shape), {"long_name": "whether there is a run"})
        coordinates: dict[str, Any] = {name: (name, axis_labels(axis)) for name, axis in self.values.items()}
        coordinates["distance"] = ("distance", distances, {"units": "m"})
        return xr.Dataset(variables, coordinates, self.attrs)


class Refinement:
    """The next distances for each curve and tolerance, until all brackets are short enough."""

    def __init__(self, tolerances: list[float], relative: bool, bracket: float, far: Vector) -> None:
        self.tolerances, self.relative, self.bracket, self.far = tolerances, relative, bracket, far
        self.before: dict[tuple[int, float], float] = {}

    def wanted(self, number: int, curve: Curve) -> set[float]:
        """Return the further distances for the curve of this number."""
        distances, ratios = as_arrays(curve)
        wanted: set[float] = set()
        for tolerance in self.tolerances:
            _, low, high = last_crossing(distances, ratios, tolerance, self.relative, self.far[number])
            if low not in curve or not self.bracket < high - low < inf:
                continue
            slow = high - low > 0.5 * self.before.get((number, tolerance), inf)
            self.before[number, tolerance] = high - low
            level = crossed_level(curve[low][0], far_value(ratios, self.far[number]), tolerance, self.relative)
            wanted.update(next_distances(distances, ratios, low, high, level, self.bracket, bisect=slow))
        return {round(distance, 9) for distance in wanted}

    def found(self, curves: list[Curve], shape: tuple[int, ...], names: list[str]) -> xr.Dataset:
        """Return the crossings of all curves for all tolerances."""
        arrays = [(*as_arrays(curve), far) for curve, far in zip(curves, self.far, strict=True)]
        crossings = np.array(
            [
                [last_crossing(d, r, tolerance, self.relative, far) for tolerance in self.tolerances]
                for d, r, far in arrays
            ]
        ).reshape(*shape, len(self.tolerances), 3)
        metres, over = {"units": "m"}, [*names, "within"]
        label = "tolerance of AR, relative to the far value" if self.relative else "tolerance of AR"
        far = np.array([far_value(ratios, far_ratio) for _, ratios, far_ratio in arrays]).reshape(shape)
        bound = {"long_name": f"whether the {LABEL} is beyond the bracket's low end"}
        return xr.Dataset(
            {
                "critical_distance": (over, crossings[..., 0], {**metres, "long_name": LABEL}),
                "bracket": ([*over, "end"], crossings[..., 1:], {**metres, "long_name": f"bracket of the {LABEL}"}),
                "lower_bound": (over, np.isinf(crossings[..., 2]), bound),
                "far_value": (names, far, {"units": "1", "long_name": "far value of the amplitude ratio"}),
            },
            {"within": ("within", self.tolerances, {"units": "1", "long_name": label}), "end": ["low", "high"]},
        )


def next_distances(
    distances: Vector, ratios: Vector, low: float, high: float, level: float, bracket: float, bisect: bool = False
) -> list[float]:
    """Return where to sample between low and high for a bracket of this length, or shorter, around AR = level. All in
    m.

    The midpoint if it is sufficient, or if `bisect` is true. Otherwise two samples close to the crossing of a cubic
    spline through the neighbours, or one if the other would lie outside the bracket.
    """
    reach = SAMPLE_OFFSET * bracket
    if bisect or high - low <= 2.0 * bracket:
        return [0.5 * (low + high)]
    valid = ~np.isnan(ratios)
    x, y = distances[valid], ratios[valid]
    first, last = int(np.searchsorted(x, low)), int(np.searchsorted(x, high))
    near = slice(max(0, first - SPLINE_NEIGHBOURS + 1), last + SPLINE_NEIGHBOURS)
    spline = CubicSpline(x[near], y[near])
    crossing = brentq(lambda d: spline(d) - level, low, high)
    return [place for place in (crossing - reach, crossing + reach) if low < place < high]


def as_arrays(curve: Curve) -> tuple[Vector, Vector]:
    distances = sorted(curve)
    return np.array(distances), np.array([curve[distance][0] for distance in distances])


def _upper_bound(data: xr.Dataset, smallest: float) -> list[str]:
    """Return a finding if AR is within the tolerance at all distances."""
    if smallest == 0.0 or not bool((data.bracket.sel(end="low") == 0.0).any()):
        return []
    return [
        f"{LABEL}: AR is within the tolerance at all distances, so the smallest, {readable(smallest, 'm', 6)}, "
        "is an upper bound; give smaller distances"
    ]
