"""Refinement of a curve of amplitude ratios: next samples, until the bracket of its last crossing is short enough."""

from math import inf

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from coupling.results.critical_distance import LABEL, crossed_level, far_value, last_crossing
from structures.structure import Vector

SAMPLE_OFFSET = 0.45
"""The crossing is expected midway between two samples, each this fraction of the bracket's length away from it."""

SPLINE_NEIGHBOURS = 3
"""Number of samples on each side of the bracket through which a cubic spline predicts the crossing."""

Curve = dict[float, tuple[float, float]]
"""AR and TOF (s) of the samples of one curve, by their distances (m)."""


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
