"""The distance from a straight edge beyond which the edge does not change the reflected wave: a tabulated law.

AR is the amplitude ratio of the primary reflected wave. For a pair of materials it depends on only two numbers: the
inelasticity parameter λ, and the distance from the edge over ℓ = (T_c √(D/m))^½. See docs/plate_edge.md.
"""

from functools import cache, lru_cache
from importlib.resources import files
from math import log
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import xarray as xr
from scipy.interpolate import BarycentricInterpolator, PchipInterpolator

from plates.half_plane import EDGES
from plates.impact import PlateImpact, wall_stiffness
from plates.plate import Plate
from structures.bodies.layers import contact_time as contact_time_half_space
from structures.caution import caution
from structures.checks import instance, one_of, within
from structures.material import Material
from structures.structure import Vector
from structures.surface import Surface, hertz_pressure, hertz_stiffness, yield_pressure

# AR as a function of edge, ratio of contact stiffnesses, λ and distance; computed by `benchmarks/edge_ratios.py`
TABLE = "edge_ratios.csv"
TOLERANCES = (0.01, 0.1)  # The range of the tolerance of AR. For a lower tolerance, the error of the table dominates
# λ up to which the plate returns a single wave. For larger λ an echo pushes the last bead a second time, and the two
# waves merge on their way to the sensor.
DECAYING = 0.9
# Errors of AR from the table for λ up to `DECAYING`, and for larger λ; the study critical-distance measures them.
ERROR, ERROR_MERGING = 0.002, 0.005
# Largest relative error of c halfway between two stiffness ratios of the table, where the error of AR was 0.007.
BETWEEN = 0.015
SLOWEST, FASTEST = 1e-9, 1e5  # m/s. Between these speeds no number leaves the range of floating point.
FINE = 4501  # Number of points of the interpolated AR for the search of the last crossing, linear between points
SLACK = 1e-3  # Relative tolerance of the table's ranges, for rounding of λ and the stiffness ratio


class CriticalDistanceEstimate(NamedTuple):
    """A critical distance, m, and its bounds due to the error of the law, m."""

    value: float
    low: float
    high: float


def critical_distance_law(
    bead: Any, plate: Plate, impact_speed: float, edge: str = "clamped", tolerance: float = 0.02
) -> CriticalDistanceEstimate:
    """Return the distance from an edge beyond which the amplitude ratio AR stays within a tolerance of its far value.

    d_c = ℓ c(λ, edge, tolerance) with ℓ = (T_c √(D/m))^½. c comes from a table of AR at a sensor 13 beads from the
    plate, computed with `half_plane`; see docs/plate_edge.md.

    Parameters
    ----------
    bead : Sphere
        A bead of a chain of equal beads; the striker is equal too.
    plate : Plate
        A thin plate of any shape, of one isotropic material. One edge is assumed to be straight, and all others to be
        far away.
    impact_speed : float
        Speed of the striker, m/s.
    edge : str
        "clamped", "simple" or "free".
    tolerance : float
        Absolute tolerance of AR, from 0.01 to 0.1.

    Returns
    -------
    CriticalDistanceEstimate
        The distance, m; 0 if AR is within the tolerance at all distances. AR oscillates about its far value, so the
        distance jumps if an oscillation grows beyond the tolerance; the bounds then contain both values.

    Examples
    --------
    >>> plate = hl.kirchhoff_plate(0.9, 0.9, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> law = hl.critical_distance_law(hl.Sphere(2.38e-3, hl.STEEL_440C), plate, impact_speed=0.31)
    >>> print(f"{1e3 * law.value:.1f} mm")
    14.6 mm
    """
    one_of("edge", edge, EDGES)
    within("tolerance", tolerance, *TOLERANCES)
    within("impact_speed", impact_speed, SLOWEST, FASTEST, "m/s")
    parameter = float(PlateImpact(bead, plate, impact_speed).inelasticity)
    wall: Material = instance("plate.material", plate.material, Material, "a Material: the law is for isotropic plates")
    stiffness_ratio = wall_stiffness(bead, plate) / hertz_stiffness(bead.surface, bead.surface)
    # The runs behind the law are elastic, but a bead at that speed may dent the plate (force of Hertz's impact).
    force = wall_stiffness(bead, plate) ** 0.4 * (1.25 * bead.mass * impact_speed**2) ** 0.6
    weaker = min(bead.surface.material, wall, key=yield_pressure)
    ratio = hertz_pressure(bead.surface, Surface(wall), force) / yield_pressure(weaker)
    if ratio > 1.0:
        name = weaker.name or "a body"
        caution(f"yield: the law is elastic; the bead presses {name} to about {ratio:.2g} times yield pressure")
    length = edge_length(bead, plate, impact_speed)
    scaled = scaled_critical_distance(edge, stiffness_ratio, parameter, tolerance)
    return CriticalDistanceEstimate(*(length * distance for distance in scaled))


def scaled_critical_distance(
    edge: str, stiffness_ratio: float, inelasticity: float, tolerance: float
) -> CriticalDistanceEstimate:
    """Return c = d_c/ℓ and its bounds: the last crossings of the tabulated AR with the tolerance ± the error.

    If waves merge, AR jumps along lines of λ and d/ℓ. Then the bounds include those at the neighbouring λ of the table.
    """
    error, sides, parameters = ERROR, [inelasticity], _table().parameter.values
    if inelasticity > DECAYING:
        place = int(np.clip(np.searchsorted(parameters, inelasticity), 1, parameters.size - 1))
        error, sides = ERROR_MERGING, [inelasticity, *parameters[place - 1 : place + 1].tolist()]
    curves = [edge_difference(edge, stiffness_ratio, side) for side in sides]
    low, high = ([last_crossing(*curve, tolerance + sign * error) for curve in curves] for sign in (1.0, -1.0))
    # Between two stiffness ratios of the table the error of c is at most a parabola.
    logarithms = np.log(_table().ratio.values)
    place = int(np.clip(np.searchsorted(logarithms, log(stiffness_ratio)), 1, logarithms.size - 1))
    left, right = logarithms[place - 1 : place + 1]
    part = float(np.clip((log(stiffness_ratio) - left) / (right - left), 0.0, 1.0))
    share = 4.0 * part * (1.0 - part) * BETWEEN
    return CriticalDistanceEstimate(
        last_crossing(*curves[0], tolerance), min(low) * (1.0 - share), max(high) * (1.0 + share)
    )


def edge_length(bead: Any, plate: Plate, impact_speed: float) -> float:
    """Return ℓ = (T_c √(D/m))^½, m, the unit of distances from an edge; T_c is the contact time on a half-space."""
    time = contact_time_half_space(bead.mass, wall_stiffness(bead, plate), impact_speed)
    return float((time * (plate.rigidity / plate.mass_per_area) ** 0.5) ** 0.5)


@cache
def _table() -> xr.DataArray:
    """Return AR minus its far value: edge × stiffness ratio × λ × distance over ℓ."""
    table = pd.read_csv(str(files("plates") / TABLE), index_col=[0, 1, 2]).rename_axis(["edge", "ratio", "parameter"])
    difference = table.iloc[:, 1:].sub(table.iloc[:, 0], axis=0)
    difference.columns = difference.columns.astype(float).rename("distance")
    array: xr.DataArray = difference.stack().to_xarray()
    return array


@lru_cache(maxsize=64)  # several tolerances use the same curve
def edge_difference(edge: str, stiffness_ratio: float, inelasticity: float) -> tuple[Vector, Vector]:
    """Return distances over ℓ, and AR minus its far value there, as read-only arrays.

    AR is interpolated by PCHIP in ln λ and in the distance, and by a parabola in the logarithm of the stiffness ratio.
    Parameters outside the table raise a ValueError.
    """
    table = _table().sel(edge=edge).transpose("ratio", "parameter", "distance")
    ratios, parameters, distances = (table[name].values for name in table.dims)
    named = (
        ("inelasticity parameter", inelasticity, parameters, ""),
        ("stiffness ratio", stiffness_ratio, ratios, " of the contacts bead-plate and bead-bead"),
    )
    for name, value, ends, what in named:
        if not ends[0] * (1.0 - SLACK) <= value <= ends[-1] * (1.0 + SLACK):
            raise ValueError(
                f"impact_speed, bead, plate: the {name}{what} is {value:.4g}; must lie between {ends[0]:.3g} and "
                f"{ends[-1]:.4g}, the range of the law; beyond it, use critical_distance_search with half_plane"
            )
    by_parameter = PchipInterpolator(np.log(parameters), table.values, axis=1, extrapolate=True)
    at_nodes = BarycentricInterpolator(np.log(ratios), by_parameter(log(inelasticity)))(log(stiffness_ratio))
    fine = np.linspace(0.0, distances[-1], FINE)
    difference = np.asarray(PchipInterpolator(distances, at_nodes)(fine))
    for array in (fine, difference):
        array.setflags(write=False)
    return fine, difference


def last_crossing(distances: Vector, difference: Vector, tolerance: float) -> float:
    """Return the greatest distance at which the size of a difference equals the tolerance; 0 if it never does."""
    outside = np.flatnonzero(np.abs(difference) >= tolerance)
    if outside.size == 0:
        return 0.0
    last = int(outside[-1])
    if last == distances.size - 1:
        return float(distances[-1])
    here, there = np.abs(difference[last : last + 2]) - tolerance
    return float(distances[last] + (distances[last + 1] - distances[last]) * here / (here - there))
