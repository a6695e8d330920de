"""The critical distance from an edge, read from amplitude ratios over distances, and the bracket that holds it."""

from math import inf, nan

import numpy as np
import xarray as xr

from coupling.results.reading import number_or_array
from structures.checks import instance, positive, short
from structures.structure import Vector

FEWEST = 3  # Least number of distances.

LABEL = "critical distance"
SWALLOWED = "no wave above 1 % of the incident one returns from the greatest distance"


def critical_distance(ratio: xr.DataArray, tolerance: float = 0.02) -> float | xr.DataArray:
    """Return the distance, m, beyond which AR stays within a tolerance of its far value, AR at the greatest distance.

    It is interpolated between the last sample outside the tolerance and the next one. It is known no better than this
    bracket, because AR oscillates: on samples 10 mm apart it was up to 29 % off. `critical_distance_search` refines the
    bracket (thesis, section 6.2.2).

    Parameters
    ----------
    ratio : DataArray
        AR over "distance" (m; or over the only dimension), and over any others. NaN means unknown: no wave came back
        within the record. If that means AR = 0, pass ``ratio.fillna(0.0)``.
    tolerance : float
        Largest difference of AR from its far value, in units of the incident amplitude.

    Returns
    -------
    float or DataArray
        A float for one curve. NaN if the far value is unknown or not reached. The smallest distance, as an upper bound,
        if AR is within the tolerance at all distances.

    Examples
    --------
    >>> import xarray as xr
    >>> ratio = xr.DataArray([0.9, 0.6, 0.5, 0.5], dims="distance", coords={"distance": [0.01, 0.02, 0.03, 0.1]})
    >>> print(f"{hl.critical_distance(ratio, tolerance=0.05):.4f} m")
    0.0250 m
    """
    positive("tolerance", tolerance)
    instance("ratio", ratio, xr.DataArray, "a DataArray of amplitude ratios over distances")
    dimension = "distance" if "distance" in ratio.dims else str(next(iter(ratio.dims), ""))
    if ratio.sizes.get(dimension, 0) < FEWEST or ratio.dtype.kind not in "fiu":
        count = ratio.sizes.get(dimension, 0)
        raise ValueError(f"ratio: must hold real numbers at three distances or more, not {ratio.dtype} at {count}")
    ordered = ratio.sortby(dimension)
    distances = ordered[dimension].values
    rises = distances.dtype.kind in "fiu" and np.isfinite(distances).all() and (np.diff(distances) > 0.0).all()
    if not rises or distances[0] < 0.0:
        raise ValueError(f"distance = {short(distances)}: must be finite numbers of m, none of them negative or twice")
    found = xr.apply_ufunc(
        lambda curve: last_crossing(distances.astype(float), curve, tolerance)[0], ordered,
        input_core_dims=[[dimension]], vectorize=True,
    )  # fmt: skip
    return number_or_array(found, "m", LABEL)


def last_crossing(distances: Vector, curve: Vector, tolerance: float) -> tuple[float, float, float]:
    """Return the critical distance and its bracket, the last sample outside the tolerance and the next one, for one
    curve over rising distances, m. If the far value is not reached, low is a lower bound and high is infinite; so it is
    if the far value is unknown, but AR leaves the tolerance of no wave. If there is no wave, or none that leaves it,
    all three are NaN. If AR never leaves the tolerance of a far value, low is 0."""
    # AR at the greatest distance is the far value itself, so it cannot show that this value is reached.
    usable = np.flatnonzero(~np.isnan(curve[:-1]))
    if usable.size == 0:
        return nan, nan, nan
    level, x, y = float(curve[-1]), distances[usable], curve[usable]
    outside = np.flatnonzero(np.abs(y - np.nan_to_num(level)) > tolerance)
    if np.isnan(level):
        return (nan, float(x[outside[-1]]), inf) if outside.size else (nan, nan, nan)
    if outside.size == 0:
        return float(x[0]), 0.0, float(x[0])
    i = int(outside[-1])
    if i + 1 == x.size:
        return nan, float(x[i]), inf
    crossed = level + float(np.copysign(tolerance, y[i] - level))  # the edge of the tolerance on the side of the sample
    share = (y[i] - crossed) / (y[i] - y[i + 1])
    return float(x[i] + share * (x[i + 1] - x[i])), float(x[i]), float(x[i + 1])
