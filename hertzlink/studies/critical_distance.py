"""Beyond section 6.2.2: AR near an edge depends on λ and d/ℓ only; the law for the critical distance that follows."""

from collections.abc import Iterable
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

import hertzlink as hl
from hertzlink.studies import corner, draw, edge_shear
from hertzlink.studies.edge_cases import MAIN, OTHER_PAIRS, SAME_MATERIALS, Pair, measure
from hertzlink.studies.on_plates import DIAMETERS, SENSOR, THICKNESSES
from hertzlink.studies.results import over, with_units
from hertzlink.studies.table import Named, Row, Rows
from plates.critical_distance import DECAYING, edge_difference, last_crossing, scaled_critical_distance
from plates.half_plane import EDGES
from structures.caution import collected
from structures.structure import Vector

row = Rows("critical_distance")
DISTANCES = (*(round(0.1 * i, 1) for i in range(1, 36)), *(0.5 * i for i in range(8, 19)))  # d/ℓ.
QUICK_PARAMETERS, QUICK_DISTANCES = (0.12, 0.34, 0.75), (0.2, 0.6, 1.0, 1.4, 1.8, 2.2, 2.6, 3.4)
OTHER_PARAMETERS, OTHER_DISTANCES = (0.12, 0.34, 0.75), (0.6, 1.0, 1.4, 1.8, 2.4)
# Allowed differences of AR from its far value beyond the critical distance; the dimension "within" of the results.
TOLERANCES = (0.01, 0.02, 0.05)
LAW_PARAMETERS = np.geomspace(0.05, 2.0, 200)
SCAN = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.2, 2.5, 2.8, 3.2, 4.0, 6.0)  # d/ℓ of the first scan of a search.
LINES = ["A0 Lamb", "Rayleigh"]
# λ; none of these values is a node of the law's table.
PARAMETERS = (0.06, 0.12, 0.17, 0.24, 0.34, 0.48, 0.63, 0.75, 0.95, 1.2, 1.6, 1.95)
FIGURE_TOLERANCE = 0.02  # Tolerance of AR in the figures.
SHOWN_PARAMETERS = (0.06, 0.12, 0.24, 0.34, 0.48, 0.75, 1.2)  # λ in the figure of the collapse, if it was simulated.
JUMP_PARAMETERS = (0.2, 0.25, 0.3, 0.4)  # λ around the value at which c of a simply supported edge jumps.


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR over edge, λ and d/ℓ; of other pairs; the law compared with both; shear; corners. quick: fewer."""
    parameters, distances = (QUICK_PARAMETERS, QUICK_DISTANCES) if quick else (PARAMETERS, DISTANCES)
    data = main_map(parameters, distances, jobs)
    data = data.merge(other_pairs(list(OTHER_PAIRS)[::3] if quick else list(OTHER_PAIRS), quick, jobs))
    data = data.merge(law()).merge(thesis_plates(quick, jobs)).merge(edge_shear.run(quick, jobs))
    return data.merge(corner.run(quick, jobs))


def main_map(parameters: Iterable[float], distances: Iterable[float], jobs: int | None) -> xr.Dataset:
    """Return AR of MAIN by edge and far away, the values of the law's table, and the critical distances over ℓ."""

    def near(edge: str, inelasticity: float, scaled_distance: float) -> hl.CoSimulation:
        return MAIN.coupled(MAIN.struck(edge, inelasticity, scaled_distance))

    def away(inelasticity: float) -> hl.CoSimulation:
        return MAIN.coupled(MAIN.struck("free", inelasticity, np.inf))

    runs = hl.sweep(near, MAIN.record, jobs, measure, edge=EDGES, inelasticity=parameters, scaled_distance=distances)
    far = hl.sweep(away, MAIN.record, 1, measure, inelasticity=parameters)
    data = xr.Dataset({"amplitude_ratio": runs.amplitude_ratio, "far_ratio": far.amplitude_ratio})
    difference = data.amplitude_ratio - data.far_ratio
    data["table_error"] = tabulated(difference, MAIN.stiffness_ratio) - difference
    data = data.assign_coords(within=list(TOLERANCES))
    data["simulated"] = xr.apply_ufunc(
        crossing, difference, data.within, input_core_dims=[["scaled_distance"], []],
        kwargs={"distances": data.scaled_distance.values}, vectorize=True,
    )  # fmt: skip
    return data


def crossing(difference: Vector, tolerance: float, distances: Vector) -> float:
    """Return the last crossing of samples, interpolated with PCHIP; NaN if AR has not settled at the last sample."""
    if abs(difference[-1]) >= tolerance:
        return float("nan")
    fine = np.linspace(distances[0], distances[-1], 4000)
    return last_crossing(fine, PchipInterpolator(distances, difference)(fine), tolerance)


def tabulated(difference: xr.DataArray, stiffness_ratio: float | xr.DataArray) -> xr.DataArray:
    """Return the values of the law's table for simulated differences over edge, λ and d/ℓ."""
    distances = difference.scaled_distance.values
    differences: xr.DataArray = xr.apply_ufunc(
        lambda edge, ratio, parameter: np.interp(distances, *edge_difference(str(edge), ratio, parameter)),
        difference.edge, stiffness_ratio, difference.inelasticity,
        output_core_dims=[["scaled_distance"]], vectorize=True,
    )  # fmt: skip
    return differences


def other_pairs(names: list[str], quick: bool, jobs: int | None) -> xr.Dataset:
    """Return AR of other pairs minus its far value; how far it is from that of MAIN and from the table for them."""

    def near(pair: str, edge: str, inelasticity: float, scaled_distance: float) -> hl.CoSimulation:
        case = OTHER_PAIRS[pair]
        return case.coupled(case.struck(edge, inelasticity, scaled_distance))

    runs = hl.sweep(
        near, min(OTHER_PAIRS[name].record for name in names), jobs, measure, pair=names, edge=EDGES,
        inelasticity=OTHER_PARAMETERS[1:2] if quick else OTHER_PARAMETERS, scaled_distance=(*OTHER_DISTANCES, np.inf),
    ).amplitude_ratio  # fmt: skip
    difference = runs.isel(scaled_distance=slice(None, -1)) - runs.isel(scaled_distance=-1, drop=True)
    ratio = xr.DataArray([OTHER_PAIRS[name].stiffness_ratio for name in names], dims="pair", coords={"pair": names})
    data = xr.Dataset({
        "other_difference": difference,
        "stiffness_ratio": ratio,
        "material_deviation": difference - tabulated(difference, MAIN.stiffness_ratio),
        "other_error": tabulated(difference, ratio) - difference,
    })  # fmt: skip
    axes = {"edge": "other_edge", "inelasticity": "other_inelasticity", "scaled_distance": "other_distance"}
    return data.rename({name: new for name, new in axes.items() if name in data.dims})


def law() -> xr.Dataset:
    """Return c(λ) and its bounds for the materials of MAIN."""
    estimates = [_estimates(edge, LAW_PARAMETERS, TOLERANCES) for edge in EDGES]
    bounds = np.array([hl.critical_distance_bounds(MAIN.bead, MAIN.plate(p), MAIN.speed) for p in LAW_PARAMETERS])
    lines = bounds / np.array([MAIN.length(p) for p in LAW_PARAMETERS])[:, None]
    axes = {"edge": list(EDGES), "law_inelasticity": LAW_PARAMETERS, "within": list(TOLERANCES)}
    return xr.Dataset(
        {
            "law": ((*axes, "estimate"), estimates, {"units": "1", "long_name": "critical distance / ℓ"}),
            "scaled_line": (("law_inelasticity", "line"), lines, {"units": "1", "long_name": "equation 6.41, L / ℓ"}),
        },
        {**axes, "estimate": ["value", "low", "high"], "line": LINES},
    )


def _estimates(edge: str, parameters: Vector, tolerances: Iterable[float]) -> Vector:
    """Return the critical distances over ℓ by the law for MAIN, over λ and tolerance: value, lower and upper bound."""
    within = list(tolerances)
    ratio = MAIN.stiffness_ratio
    return np.array([[scaled_critical_distance(edge, ratio, p, t) for t in within] for p in parameters])


def thesis_plates(quick: bool, jobs: int | None) -> xr.Dataset:
    """Return critical distances, m, of the thesis's beads and plates, clamped: law, search on half-planes, two lines.

    The law and the search are NaN if λ lies outside the range of the law. quick: one search.
    """
    clamped, none, metres = hl.Supports("clamped", "clamped"), [np.nan] * 3, {"units": "m"}

    def of_plate(diameter: float, thickness: float) -> xr.Dataset:
        pair = Pair(hl.Sphere(diameter / 2.0, hl.STEEL_440C), hl.ALUMINIUM_6061, MAIN.speed)
        wall = hl.kirchhoff_plate(0.914, 0.914, thickness, hl.ALUMINIUM_6061, clamped)
        parameter = float(hl.theory.PlateImpact(pair.bead, wall, pair.speed).inelasticity)
        holds = parameter <= LAW_PARAMETERS[-1]
        sought = holds and (not quick or (diameter, thickness) == (DIAMETERS[0], THICKNESSES[0]))
        with collected():  # the study compares elastic runs
            expected = hl.critical_distance_law(pair.bead, wall, pair.speed) if holds else none
        return xr.Dataset(
            {
                "thesis_inelasticity": parameter,
                "thesis_law": ("estimate", list(expected), metres),
                "searched": ("estimate", list(search(pair, parameter, jobs) if sought else none), metres),
                "bound": ("line", list(hl.critical_distance_bounds(pair.bead, wall, pair.speed)), metres),
            },
            {"line": LINES, "estimate": ["value", "low", "high"]},
        )

    return with_units(over(of_plate, diameter=DIAMETERS, thickness=THICKNESSES), diameter="m", thickness="m")


def search(pair: Pair, inelasticity: float, jobs: int | None) -> tuple[float, float, float]:
    """Return the critical distance from a clamped edge, m, and its bracket, by runs around the last crossing."""
    length = pair.length(inelasticity)

    def build(distance: float) -> hl.CoSimulation:
        return pair.coupled(pair.struck("clamped", inelasticity, distance / length))

    scan = [distance * length for distance in SCAN]
    result = hl.critical_distance_search(build, pair.record, SENSOR, scan, jobs=jobs)
    return float(result.critical_distance), *result.bracket.values.tolist()


def table(data: xr.Dataset) -> list[Row]:
    """Return the collapse, the law and its error, the thesis's two lines, and the limit of Kirchhoff's theory."""
    return [*_collapse(data), *_law(data), *_thesis(data), *edge_shear.table(data), *corner.table(data)]


def _collapse(data: xr.Dataset) -> Iterable[Row]:
    for name in data.pair.values:
        case = data.sel(pair=name)
        moved, error = (float(abs(case[what]).max()) for what in ("material_deviation", "other_error"))
        yield row("collapse", moved, float(case.stiffness_ratio), MAIN.stiffness_ratio, error, pair=name)


def _law(data: xr.Dataset) -> Iterable[Row]:
    for edge, (low, high) in product(EDGES, ((0.05, DECAYING), (DECAYING, 2.0))):
        part = data.sel(edge=edge, inelasticity=(data.inelasticity > low) & (data.inelasticity <= high))
        if part.inelasticity.size == 0:
            continue
        simulated = part.simulated.transpose("inelasticity", "within").values
        value, least, most = np.moveaxis(_estimates(edge, part.inelasticity.values, part.within.values), -1, 0)
        # Both are 0 if AR is within the tolerance at all distances.
        errors = np.abs(value - simulated) / np.maximum(simulated, 1e-9)
        held = (simulated >= least - 0.005) & (simulated <= most + 0.005)
        finite = np.isfinite(simulated)
        apart = float(part.scaled_distance.diff("scaled_distance").min())
        counts = int(finite.sum()), apart, 100.0 * np.nanmedian(errors), int((held & finite).sum())
        said = *counts, float(abs(part.table_error).max())
        yield row("law", 100.0 * float(np.nanmax(errors)), *said, edge=edge, low=low, high=high)


def _thesis(data: xr.Dataset) -> Iterable[Row]:
    for diameter, thickness in product(data.diameter.values, data.thickness.values):
        case = data.sel(diameter=diameter, thickness=thickness)
        lines = " to ".join(f"{1e3 * line:.1f}" for line in case.bound.values)
        parameter = float(case.thesis_inelasticity)
        (value, *bounds), (searched, *ends) = 1e3 * case.thesis_law.values, 1e3 * case.searched.values
        named = Named(theory=lines, diameter=1e3 * diameter, thickness=1e3 * thickness)
        if not np.isfinite(value):
            yield row("beyond the law", "none", parameter, **named)
        elif np.isfinite(searched):
            yield row("searched", float(value), parameter, *bounds, searched, *ends, **named)
        else:
            yield row("clamped", float(value), parameter, *bounds, **named)


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the collapse, the law, its jumps, shear, and corners."""
    return {
        "collapse": collapse(data),
        "critical_distance": critical_distance(data),
        "jumps": jumps(data),
        "materials": materials(data),
        "shear": edge_shear.figure(data),
        "corner": corner.figure(data),
    }


def _by_edge(
    data: xr.Dataset, ylabel: str, width: float = 3.3, **labels: Any
) -> tuple[draw.Figure, list[tuple[draw.Axes, xr.Dataset]]]:
    """Return a panel for each edge, and the data there."""
    return draw.each(data, "edge", "{} edge".format, width=width, height=3.5, ylabels=[ylabel], **labels)


SCALED = draw.Look(xlabel="distance from the edge, d / ℓ", xlim=(0.0, 3.5), ylim=(0.0, 1.0))


def collapse(data: xr.Dataset) -> draw.Figure:
    """Return AR against d/ℓ for each edge: lines of constant λ, and markers for other beads and speeds, if any."""
    from matplotlib import colormaps

    figure, edges = _by_edge(data, "amplitude ratio AR", **SCALED)
    parameters = [p for p in data.inelasticity.values if p in SHOWN_PARAMETERS] or list(data.inelasticity.values)
    same = [name for name in SAME_MATERIALS if "pair" in data and name in data.pair]
    hollow, first = draw.Look(markersize=4.5, markerfacecolor="none"), edges[0][0]
    for axis, edge in edges:
        for i, parameter in enumerate(parameters):
            colour = colormaps["viridis"](0.85 * i / max(1, len(parameters) - 1))
            case = edge.sel(inelasticity=parameter)
            axis.plot(data.scaled_distance, case.amplitude_ratio, "-", color=colour, label=f"λ = {parameter:g}")
            for k, name in enumerate(same):
                if parameter in data.other_inelasticity.values:
                    other = case.other_difference.sel(pair=name, other_edge=case.edge, other_inelasticity=parameter)
                    axis.plot(data.other_distance, other + case.far_ratio, draw.MARKERS[k], color=colour, **hollow)
    for k, name in enumerate(same):
        first.plot([], [], draw.MARKERS[k], color="black", label=str(name), **hollow)
    draw.legend_above(figure, first, 5)
    return figure


def critical_distance(data: xr.Dataset) -> draw.Figure:
    """Return c against λ by the law, with its bounds, simulated values, and the thesis's two lines."""
    label = f"critical distance c = $d_c$ / ℓ (AR ± {FIGURE_TOLERANCE})"
    figure, edges = _by_edge(data, label, xlabel="inelasticity parameter λ", xscale="log", ylim=(0.0, 6.0))
    x = data.law_inelasticity
    for axis, edge in edges:
        at = edge.sel(within=FIGURE_TOLERANCE)
        _bounds(axis, x, at.law, 5, 0.35, "bounds of the law")
        axis.plot(x, at.law.sel(estimate="value"), "-", label="law")
        axis.plot(data.inelasticity, at.simulated, "o", color="black", markerfacecolor="none", label="simulated")
        for line, style in zip(data.line.values, ("--", "-."), strict=True):
            path = f"path of the {line} wave during a contact"
            draw.theory_line(axis, x, data.scaled_line.sel(line=line), path, style)
        _plain_ticks(axis)
    draw.legend_above(figure, edges[0][0], 5)
    return figure


def jumps(data: xr.Dataset) -> draw.Figure:
    """Return AR less its far value at a simple edge, where an oscillation exceeds the tolerance; and c over λ there."""
    labels = ("AR minus AR far away", "c, simple edge")
    figure, (left, right) = draw.panels(2, width=3.6, sharey=False, ylabels=labels)
    for parameter in JUMP_PARAMETERS:
        left.plot(*edge_difference("simple", MAIN.stiffness_ratio, parameter), "-", label=f"λ = {parameter:g}")
    for sign in (-1.0, 1.0):
        left.axhline(sign * FIGURE_TOLERANCE, color="black", linewidth=0.8, linestyle=":")
    left.set(xlim=(0.6, 2.6), ylim=(-0.04, 0.06), xlabel="distance from a simple edge, d / ℓ")
    left.legend()
    for i, within in enumerate(data.within.values):
        law = data.law.sel(edge="simple", within=within)
        right.plot(data.law_inelasticity, law.sel(estimate="value"), "-", label=f"± {within:g}")
        _bounds(right, data.law_inelasticity, law, i, 0.2)
    right.set(xscale="log", xlim=(0.05, 0.9), ylim=(0.0, 2.2), xlabel="inelasticity parameter λ")
    _plain_ticks(right)
    right.legend(title="tolerance")
    return figure


def _bounds(axis: draw.Axes, x: xr.DataArray, law: xr.DataArray, number: int, alpha: float, label: str = "") -> None:
    """Draw the law's bounds as a band."""
    ends = law.sel(estimate="low"), law.sel(estimate="high")
    axis.fill_between(x, *ends, color=draw.COLOURS[number], alpha=alpha, linewidth=0.0, label=label)


def materials(data: xr.Dataset) -> draw.Figure:
    """Return the difference that is left at equal λ and d/ℓ, over the ratio of contact stiffnesses."""
    labels = draw.Look(xlabel="stiffness, bead on plate / bead on bead", yscale="log", ylim=(1e-5, 0.2))
    shown = data.drop_dims(["edge"]).rename(other_edge="edge")
    figure, edges = _by_edge(shown, "largest deviation of AR, d ≥ 0.6 ℓ", 3.0, **labels)
    for axis, edge in edges:
        for i, parameter in enumerate(data.other_inelasticity.values):
            part = abs(edge.sel(other_inelasticity=parameter)).max("other_distance")
            for values, hollow, label in (
                (part.material_deviation, False, "from steel on aluminium"),
                (part.other_error, True, "from the table for its own ratio"),
            ):
                draw.points(axis, data.stiffness_ratio.values, values.values, i, f"λ = {parameter:g}, {label}", hollow)
    draw.legend_above(figure, edges[0][0], 2)
    return figure


def _plain_ticks(axis: draw.Axes) -> None:
    """Write numbers, not powers, on an axis of λ."""
    ticks = [tick for tick in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0) if tick <= axis.get_xlim()[1]]
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_xticks([], minor=True)
