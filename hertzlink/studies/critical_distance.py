"""Beyond section 6.2.2: AR near an edge depends on λ and d/ℓ only; the law for the critical distance that follows."""

from collections.abc import Iterator
from itertools import product

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.compare import Number
from hertzlink.studies.edge_cases import MAIN, OTHER_PAIRS, SAME_MATERIALS, measure
from plates.critical_distance import DECAYING, edge_difference, last_crossing, scaled_critical_distance
from plates.half_plane import EDGES
from structures.structure import Vector

DISTANCES = (*(round(0.1 * i, 1) for i in range(1, 36)), *(0.5 * i for i in range(8, 19)))  # d/ℓ.
QUICK_PARAMETERS, QUICK_DISTANCES = (0.12, 0.34, 0.75), (0.2, 0.6, 1.0, 1.4, 1.8, 2.2, 2.6, 3.4)
OTHER_PARAMETERS, OTHER_DISTANCES = (0.12, 0.34, 0.75), (0.6, 1.0, 1.4, 1.8, 2.4)
# λ; none of these values is a node of the law's table.
PARAMETERS = (0.06, 0.12, 0.17, 0.24, 0.34, 0.48, 0.63, 0.75, 0.95, 1.2, 1.6, 1.95)
LAW_PARAMETERS = np.geomspace(0.05, 2.0, 200)
# Allowed differences of AR from its far value beyond the critical distance; the one in the figures.
TOLERANCES, SHOWN = (0.01, 0.02, 0.05), 0.02
LINES, PANEL = ["A0 Lamb", "Rayleigh"], draw.Look(width=3.3, height=3.5)
SHOWN_PARAMETERS = (0.06, 0.12, 0.24, 0.34, 0.48, 0.75, 1.2)  # λ in the figure of the collapse, if it was simulated.


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR over edge, λ and d/ℓ; of other pairs; the law compared with both. quick: fewer."""
    parameters, distances = (QUICK_PARAMETERS, QUICK_DISTANCES) if quick else (PARAMETERS, DISTANCES)

    def near(edge: str, inelasticity: float, scaled_distance: float) -> hl.CoSimulation:
        return MAIN.coupled(MAIN.struck(edge, inelasticity, scaled_distance))

    def away(inelasticity: float) -> hl.CoSimulation:
        return near("free", inelasticity, np.inf)

    runs = hl.sweep(near, MAIN.record, jobs, measure, edge=EDGES, inelasticity=parameters, scaled_distance=distances)
    far = hl.sweep(away, MAIN.record, 1, measure, inelasticity=parameters)
    data = xr.Dataset({"amplitude_ratio": runs.amplitude_ratio, "far_ratio": far.amplitude_ratio})

    # The values of the law's table, and the critical distances over ℓ.
    difference = data.amplitude_ratio - data.far_ratio
    data["table_error"] = tabulated(difference, MAIN.stiffness_ratio) - difference
    data = data.assign_coords(within=list(TOLERANCES))
    data["simulated"] = xr.apply_ufunc(
        crossing, difference, data.within, input_core_dims=[["scaled_distance"], []],
        kwargs={"distances": data.scaled_distance.values}, vectorize=True,
    )  # fmt: skip
    others = other_pairs(list(OTHER_PAIRS)[::3] if quick else list(OTHER_PAIRS), quick, jobs)
    return data.merge(others).merge(law())


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
    """Return c(λ) and its bounds for the materials of MAIN, and the thesis's two lines."""
    plates = map(MAIN.plate, LAW_PARAMETERS)
    bounds = np.array([hl.critical_distance_bounds(MAIN.bead, plate, MAIN.speed) for plate in plates])
    lines = bounds / np.array([MAIN.length(p) for p in LAW_PARAMETERS])[:, None]
    axes = {"edge": list(EDGES), "law_inelasticity": LAW_PARAMETERS, "within": list(TOLERANCES)}
    estimates = [by_law(edge, LAW_PARAMETERS) for edge in EDGES]
    return xr.Dataset(
        {
            "law": ((*axes, "estimate"), estimates, {"units": "1", "long_name": "critical distance / ℓ"}),
            "scaled_line": (("law_inelasticity", "line"), lines, {"units": "1", "long_name": "equation 6.41, L / ℓ"}),
        },
        {**axes, "estimate": ["value", "low", "high"], "line": LINES},
    )


def by_law(edge: str, parameters: Vector) -> Vector:
    """Return the critical distances over ℓ by the law for MAIN, over λ and tolerance: value, lower and upper bound."""
    ratio = MAIN.stiffness_ratio
    return np.array([[scaled_critical_distance(edge, ratio, p, t) for t in TOLERANCES] for p in parameters])


def numbers(data: xr.Dataset) -> Iterator[Number]:
    for name in data.pair.values:
        case = data.sel(pair=name)
        moved, error = (float(abs(case[what]).max()) for what in ("material_deviation", "other_error"))
        said = f"ratio of the contacts' stiffnesses {float(case.stiffness_ratio):.3f}, of steel on aluminium "
        said += f"{MAIN.stiffness_ratio:.3f}; from the table for its own ratio at most {error:.4f}"
        yield Number(f"AR at equal λ, d/ℓ: largest deviation, {name}", moved, said)

    for edge, (low, high) in product(EDGES, ((0.05, DECAYING), (DECAYING, 2.0))):
        part = data.sel(edge=edge, inelasticity=(data.inelasticity > low) & (data.inelasticity <= high))
        if part.inelasticity.size == 0:
            continue
        simulated = part.simulated.transpose("inelasticity", "within").values
        value, least, most = np.moveaxis(by_law(edge, part.inelasticity.values), -1, 0)
        # Both are 0 if AR is within the tolerance at all distances.
        errors = 100.0 * np.abs(value - simulated) / np.maximum(simulated, 1e-9)
        held = (simulated >= least - 0.005) & (simulated <= most + 0.005) & np.isfinite(simulated)
        said = f"of d_c at {np.isfinite(simulated).sum()} pairs of λ and tolerance; median {np.nanmedian(errors):.2f} %"
        said += f"; {held.sum()} lie within the law's bounds. AR: at most {float(abs(part.table_error).max()):.4f}"
        yield Number(f"law's largest error, {edge} edge, λ {low:g} to {high:g}", float(np.nanmax(errors)), said, "%")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    return {"collapse": collapse(data), "critical_distance": by_parameter(data)}


def collapse(data: xr.Dataset) -> draw.Figure:
    """Return AR against d/ℓ for each edge: lines of constant λ, and markers for other beads and speeds, if any."""
    from matplotlib import colormaps

    labels = draw.Look(xlabel="distance from the edge, d / ℓ", xlim=(0.0, 3.5), ylim=(0.0, 1.0))
    figure, panels = draw.each(data, "edge", "{} edge".format, ylabels=["amplitude ratio AR"], **PANEL, **labels)
    parameters = [p for p in data.inelasticity.values if p in SHOWN_PARAMETERS]
    same = [name for name in SAME_MATERIALS if name in data.pair]
    look, first = draw.Look(markersize=4.5, markerfacecolor="none"), panels[0][0]
    for axis, edge in panels:
        for i, parameter in enumerate(parameters):
            colour, case = colormaps["viridis"](0.85 * i / len(parameters)), edge.sel(inelasticity=parameter)
            axis.plot(data.scaled_distance, case.amplitude_ratio, "-", color=colour, label=f"λ = {parameter:g}")
            for marker, name in zip(draw.MARKERS, same, strict=False):
                if parameter in data.other_inelasticity.values:
                    other = case.other_difference.sel(pair=name, other_edge=case.edge, other_inelasticity=parameter)
                    axis.plot(data.other_distance, other + case.far_ratio, marker, color=colour, **look)
    for marker, name in zip(draw.MARKERS, same, strict=False):
        first.plot([], [], marker, color="black", label=str(name), **look)
    draw.legend_above(figure, first, 5)
    return figure


def by_parameter(data: xr.Dataset) -> draw.Figure:
    """Return c against λ by the law, with its bounds, simulated values, and the thesis's two lines."""
    labels = draw.Look(xlabel="inelasticity parameter λ", xscale="log", ylim=(0.0, 6.0))
    label = f"critical distance c = $d_c$ / ℓ (AR ± {SHOWN})"
    figure, panels = draw.each(data, "edge", "{} edge".format, ylabels=[label], **PANEL, **labels)
    x = data.law_inelasticity
    for axis, edge in panels:
        at = edge.sel(within=SHOWN)
        ends = at.law.sel(estimate="low"), at.law.sel(estimate="high")
        axis.fill_between(x, *ends, color=draw.COLOURS[5], alpha=0.35, linewidth=0.0, label="bounds of the law")
        axis.plot(x, at.law.sel(estimate="value"), "-", label="law")
        axis.plot(data.inelasticity, at.simulated, "o", color="black", markerfacecolor="none", label="simulated")
        for line, style in zip(data.line.values, ("--", "-."), strict=True):
            words = f"path of the {line} wave during a contact"
            draw.theory_line(axis, x, data.scaled_line.sel(line=line), words, style)
        draw.log_x(axis)
    draw.legend_above(figure, panels[0][0], 5)
    return figure
