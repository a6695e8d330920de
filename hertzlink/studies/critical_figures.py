"""Figures of the study critical-distance."""

from typing import Any

import numpy as np
import xarray as xr

from hertzlink.studies import draw, edge_shear
from hertzlink.studies.edge_cases import MAIN, SAME_MATERIALS
from plates.critical_distance import edge_difference

FIGURE_TOLERANCE = 0.02  # Tolerance of AR in the figures.
SHOWN_PARAMETERS = (0.06, 0.12, 0.24, 0.34, 0.48, 0.75, 1.2)  # λ in the figure of the collapse, if it was simulated.
JUMP_PARAMETERS = (0.2, 0.25, 0.3, 0.4)  # λ around the value at which c of a simply supported edge jumps.


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the figures by file name."""
    return {
        "collapse": collapse(data),
        "critical_distance": critical_distance(data),
        "jumps": jumps(data),
        "materials": materials(data),
        "shear": edge_shear.figure(data),
    }


def _by_edge(data: xr.Dataset, ylabel: str, width: float = 3.3, **labels: Any) -> tuple[draw.Figure, list[draw.Axes]]:
    """Return a panel for each edge."""
    figure, axes = draw.panels(data.sizes["edge"], width=width, height=3.5)
    for axis, edge in zip(axes, data.edge.values, strict=True):
        axis.set(title=f"{edge} edge", **labels)
    axes[0].set_ylabel(ylabel)
    return figure, axes


SCALED = draw.Look(xlabel="distance from the edge, d / ℓ", xlim=(0.0, 3.5), ylim=(0.0, 1.0))


def of_pair(data: xr.Dataset) -> draw.Figure:
    """Return AR of a user's own beads and plates against d/ℓ for each edge and λ."""
    from matplotlib import colormaps

    figure, axes = _by_edge(data, "amplitude ratio AR", 3.6, **SCALED)
    colours = colormaps["viridis"](np.linspace(0.0, 0.95, max(2, data.sizes["inelasticity"])))
    for axis, edge in zip(axes, data.edge.values, strict=True):
        for colour, inelasticity in zip(colours, data.inelasticity.values, strict=False):
            curve = data.amplitude_ratio.sel(edge=edge, inelasticity=inelasticity)
            axis.plot(data.scaled_distance, curve, ".-", color=colour, label=f"λ = {inelasticity:g}")
    axes[0].legend()
    return figure


def collapse(data: xr.Dataset) -> draw.Figure:
    """Return AR against d/ℓ for each edge: lines of constant λ, and markers for other beads and speeds."""
    from matplotlib import colormaps

    figure, axes = _by_edge(data, "amplitude ratio AR", **SCALED)
    parameters = [p for p in data.inelasticity.values if p in SHOWN_PARAMETERS] or list(data.inelasticity.values)
    same = [name for name in data.pair.values if name in SAME_MATERIALS]
    hollow = draw.Look(markersize=4.5, markerfacecolor="none")
    for axis, edge in zip(axes, data.edge.values, strict=True):
        for i, parameter in enumerate(parameters):
            colour = colormaps["viridis"](0.85 * i / max(1, len(parameters) - 1))
            case = data.sel(edge=edge, inelasticity=parameter)
            axis.plot(data.scaled_distance, case.amplitude_ratio, "-", color=colour, label=f"λ = {parameter:g}")
            for k, name in enumerate(same):
                if parameter in data.other_inelasticity.values:
                    other = data.other_difference.sel(pair=name, other_edge=edge, other_inelasticity=parameter)
                    axis.plot(data.other_distance, other + case.far_ratio, draw.MARKERS[k], color=colour, **hollow)
    for k, name in enumerate(same):
        axes[0].plot([], [], draw.MARKERS[k], color="black", label=str(name), **hollow)
    draw.legend_above(figure, axes[0], 5)
    return figure


def critical_distance(data: xr.Dataset) -> draw.Figure:
    """Return c against λ by the law, with its bounds, simulated values, and the thesis's two lines."""
    label = f"critical distance c = $d_c$ / ℓ (AR ± {FIGURE_TOLERANCE})"
    figure, axes = _by_edge(data, label, xlabel="inelasticity parameter λ", xscale="log", ylim=(0.0, 6.0))
    x = data.law_inelasticity
    for axis, edge in zip(axes, data.edge.values, strict=True):
        at = data.sel(edge=edge, within=FIGURE_TOLERANCE)
        _bounds(axis, x, at.law, 5, 0.35, "bounds of the law")
        axis.plot(x, at.law.sel(estimate="value"), "-", label="law")
        axis.plot(data.inelasticity, at.simulated, "o", color="black", markerfacecolor="none", label="simulated")
        for line, style in zip(data.line.values, ("--", "-."), strict=True):
            path = f"path of the {line} wave during a contact"
            draw.theory_line(axis, x, data.scaled_line.sel(line=line), path, style)
        _plain_ticks(axis)
    draw.legend_above(figure, axes[0], 5)
    return figure


def jumps(data: xr.Dataset) -> draw.Figure:
    """Return AR minus its far value near a simply supported edge, where an oscillation exceeds the tolerance; and c
    over λ there."""
    figure, (left, right) = draw.panels(2, width=3.6, height=3.2, sharey=False)
    for parameter in JUMP_PARAMETERS:
        left.plot(*edge_difference("simple", MAIN.stiffness_ratio, parameter), "-", label=f"λ = {parameter:g}")
    for sign in (-1.0, 1.0):
        left.axhline(sign * FIGURE_TOLERANCE, color="black", linewidth=0.8, linestyle=":")
    left.set(xlim=(0.6, 2.6), ylim=(-0.04, 0.06))
    left.set(xlabel="distance from a simple edge, d / ℓ", ylabel="AR minus AR far away")
    left.legend()
    for i, within in enumerate(data.within.values):
        law = data.law.sel(edge="simple", within=within)
        right.plot(data.law_inelasticity, law.sel(estimate="value"), "-", label=f"± {within:g}")
        _bounds(right, data.law_inelasticity, law, i, 0.2)
    right.set(xscale="log", xlim=(0.05, 0.9), ylim=(0.0, 2.2))
    right.set(xlabel="inelasticity parameter λ", ylabel="c, simple edge")
    _plain_ticks(right)
    right.legend(title="tolerance")
    return figure


def _bounds(axis: draw.Axes, x: xr.DataArray, law: xr.DataArray, number: int, alpha: float, label: str = "") -> None:
    """Draw the law's bounds as a band."""
    ends = law.sel(estimate="low"), law.sel(estimate="high")
    axis.fill_between(x, *ends, color=draw.COLOURS[number], alpha=alpha, linewidth=0.0, label=label)


def materials(data: xr.Dataset) -> draw.Figure:
    """Return the remaining difference at equal λ and d/ℓ: deviation from steel on aluminium over the ratio of contact
    stiffnesses."""
    labels = draw.Look(xlabel="stiffness, bead on plate / bead on bead", yscale="log", ylim=(1e-5, 0.2))
    shown = data.drop_dims(["edge"]).rename(other_edge="edge")
    figure, axes = _by_edge(shown, "largest deviation of AR, d ≥ 0.6 ℓ", 3.0, **labels)
    for axis, edge in zip(axes, shown.edge.values, strict=True):
        for i, parameter in enumerate(data.other_inelasticity.values):
            part = abs(shown.sel(edge=edge, other_inelasticity=parameter)).max("other_distance")
            for values, hollow, label in (
                (part.material_deviation, False, "from steel on aluminium"),
                (part.other_error, True, "from the table for its own ratio"),
            ):
                draw.points(axis, data.stiffness_ratio.values, values.values, i, f"λ = {parameter:g}, {label}", hollow)
    draw.legend_above(figure, axes[0], 2)
    return figure


def _plain_ticks(axis: draw.Axes) -> None:
    """Write numbers, not powers, on an axis of λ."""
    ticks = [tick for tick in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0) if tick <= axis.get_xlim()[1]]
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_xticks([], minor=True)
