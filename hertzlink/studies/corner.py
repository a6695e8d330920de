"""AR beyond section 6.2.2, near a corner of two straight edges, and its prediction from the two single edges."""

from functools import lru_cache, partial

import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.on_plates import IMPACT_SPEED, SENSOR, chain, measure
from hertzlink.studies.table import Row, Rows, bracketed
from plates.critical_distance import edge_length

row = Rows("corner")
BEAD = hl.Sphere(2.38e-3, hl.STEEL_440C)
THICKNESS, MATERIAL = 2.29e-3, hl.ALUMINIUM_6061
UNTIL, CHAIN = 0.7e-3, chain(2.0 * BEAD.radius)
SIDE = 0.24  # m, side of the square plate: the echoes of its other edges return after the end of the record.
# Tolerance of the reduction, and the frequency that the mesh resolves, Hz.
REDUCTION, HIGHEST_FREQUENCY = 0.02, 40.0e3
# The edges x = 0 and y = 0.
CORNERS = {
    "clamped-clamped": ("clamped", "clamped"),
    "clamped-free": ("clamped", "free"),
    "free-free": ("free", "free"),
}
EDGES = ["clamped", "free"]  # The edges of the corners, each alone.
# Distances from the two edges, in units of ℓ.
SCALED, QUICK_SCALED = (0.4, 0.7, 1.0, 1.3, 1.6, 1.9, 2.4, 3.0), (0.5, 1.0, 1.5, 3.0)
# First scan along the diagonal and from a single edge, in units of ℓ.
SCAN, QUICK_SCAN = (0.5, 0.75, 1.0, 1.25, 1.5, 1.75, 2.0, 2.5, 3.0, 4.0, 6.0), (*QUICK_SCALED, 6.0)
TOLERANCE = 0.02  # Difference of AR from its far value, as in the boundary study.
REPORTED_FROM = (1.0, 1.5)  # ℓ; the error of superposition is reported from these distances on.


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR over corner and distances x, y; AR of the single edges; critical distances along x = y.

    quick: four distances instead of eight, which the scan for critical distances shares, and brackets of 2 mm.
    """
    length, scaled = unit(), QUICK_SCALED if quick else SCALED

    def near(corner: str, x: float, y: float) -> hl.CoSimulation:
        return hl.CoSimulation(CHAIN, at_corner(corner, x * length, y * length))

    def alone(corner_edge: str, x: float) -> hl.CoSimulation:
        return from_edge(corner_edge, x * length)

    ratio = hl.sweep(near, UNTIL, jobs, measure, corner=list(CORNERS), x=scaled, y=scaled).amplitude_ratio
    single = hl.sweep(alone, UNTIL, 1, measure, corner_edge=EDGES, x=scaled).amplitude_ratio
    far = measure(hl.CoSimulation(CHAIN, hl.infinite_plate(THICKNESS, MATERIAL)).run(UNTIL)).amplitude_ratio
    data = xr.Dataset({"corner_ratio": ratio.fillna(0.0), "corner_edge_ratio": single.fillna(0.0)})
    data = data.assign(corner_far_ratio=far)
    data = data.merge(crossings(length, QUICK_SCAN if quick else SCAN, 2e-3 if quick else 0.2e-3, jobs))
    data["corner_superposed"] = superposed(data)
    for name in ("x", "y"):
        data[name].attrs.update(units="1", long_name=f"distance from the edge {name} = 0 over ℓ")
    return data.assign(corner_length=((), length, {"units": "m", "long_name": "ℓ = (T_c √(D/m))^½"}))


def crossings(length: float, scaled: tuple[float, ...], bracket: float, jobs: int | None) -> xr.Dataset:
    """Return the critical distances (m) along the diagonals of the corners, and from each single edge.

    length: ℓ, m. scaled: the first scan, in units of ℓ. bracket: m.
    """

    def diagonal(corner: str, distance: float) -> hl.CoSimulation:
        return hl.CoSimulation(CHAIN, at_corner(corner, distance, distance))

    find = partial(
        hl.critical_distance_search, until=UNTIL, sensor=SENSOR, distances=[distance * length for distance in scaled],
        tolerance=TOLERANCE, bracket=bracket,
    )  # fmt: skip
    by_corner = find(diagonal, jobs=jobs, corner=list(CORNERS))
    by_edge = find(from_edge, jobs=1, corner_edge=EDGES)
    return xr.Dataset(
        {
            f"{name}_{what}": searched[what].drop_vars("within")
            for name, searched in (("corner", by_corner), ("corner_edge", by_edge))
            for what in ("critical_distance", "bracket")
        }
    )


def from_edge(corner_edge: str, distance: float) -> hl.CoSimulation:
    """Return the chain at a distance, m, from a single edge."""
    return hl.CoSimulation(CHAIN, hl.half_plane(THICKNESS, MATERIAL, corner_edge, distance, UNTIL))


def unit() -> float:
    """Return ℓ, m."""
    return edge_length(BEAD, plate("free-free"), IMPACT_SPEED)


def plate(corner: str) -> hl.Plate:
    """Return the square plate with these two edges, the others free."""
    left, bottom = CORNERS[corner]
    supports = hl.Supports(left=left, bottom=bottom)
    return hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, MATERIAL, supports, highest_frequency=HIGHEST_FREQUENCY)


@lru_cache(maxsize=256)  # as some places lie on the diagonal too
def at_corner(corner: str, x: float, y: float) -> hl.Structure:
    """Return the reduced plate, struck at distances x and y (m) from the two edges."""
    return hl.reduce(plate(corner).at(x, y), UNTIL, REDUCTION)


def superposed(data: xr.Dataset) -> xr.DataArray:
    """Return AR by superposition of the two edges: the far value plus the contribution of each single edge."""
    along_x = data.corner_edge_ratio - data.corner_far_ratio
    along_y = along_x.rename(x="y")
    both = [
        data.corner_far_ratio + along_x.sel(corner_edge=first, drop=True) + along_y.sel(corner_edge=second, drop=True)
        for first, second in CORNERS.values()
    ]
    superposition: xr.DataArray = xr.concat(both, data.corner)
    return superposition.assign_attrs(units="1", long_name="amplitude ratio, two edges superposed")


def worst(data: xr.Dataset, corner: str, nearest: float) -> float:
    """Return the largest error of superposition for distances of `nearest` (in ℓ) or more."""
    corner_data = data.sel(corner=corner, x=slice(nearest, None), y=slice(nearest, None))
    return float(abs(corner_data.corner_ratio - corner_data.corner_superposed).max())


def table(data: xr.Dataset) -> list[Row]:
    """Return the critical distances along the diagonal of each corner, and those of its edges."""
    rows, length = [], float(data.corner_length)
    for corner, edges in CORNERS.items():
        alone = data.corner_edge_critical_distance.sel(corner_edge=list(edges)) / length
        low, high = data.corner_bracket.sel(corner=corner).values / length
        said = [part for nearest in REPORTED_FROM for part in (worst(data, corner, nearest), nearest)]
        rows.append(row("diagonal", bracketed(low, high), *said, theory=float(alone.max()), corner=corner))
    return rows


def figure(data: xr.Dataset) -> draw.Figure:
    """Return AR minus its far value over x/ℓ and y/ℓ, one panel for each corner, with the contours of the tolerance."""
    from matplotlib.colors import TwoSlopeNorm

    drawn, axes = draw.panels(data.sizes["corner"], width=2.9, height=3.6)
    levels = [-0.2, -0.1, -0.05, -TOLERANCE, TOLERANCE, 0.05, 0.1, 0.2, 0.4]
    norm = TwoSlopeNorm(0.0, -levels[-1], levels[-1])
    lines = (("corner_ratio", "-", 1.2, ""), ("corner_superposed", "--", 1.0, ", the two edges superposed"))
    for axis, corner in zip(axes, data.corner.values, strict=True):
        away = data.sel(corner=corner).transpose("y", "x", ...) - data.corner_far_ratio
        shown = axis.contourf(data.x, data.y, away.corner_ratio, levels, cmap="RdBu_r", norm=norm, extend="both")
        for name, style, width, _ in lines:
            band = draw.Look(levels=[-TOLERANCE, TOLERANCE], colors="black", linewidths=width, linestyles=style)
            axis.contour(data.x, data.y, away[name], **band)
        first, second = CORNERS[str(corner)]
        axis.set(xlabel=f"distance from the {first} edge, x/ℓ", ylabel=f"from the {second} edge, y/ℓ", aspect="equal")
        axis.tick_params(labelleft=True)
    for _, style, width, what in lines:
        axes[0].plot([], [], style, color="black", linewidth=width, label=f"± {TOLERANCE:g}{what}")
    drawn.colorbar(shown, ax=axes, label="AR − far value", ticks=levels, fraction=0.02)
    draw.legend_above(drawn, axes[0], 2)
    return drawn
