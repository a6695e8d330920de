"""Figures of the study critical-distance."""

import xarray as xr

from hertzlink.studies import draw, edge_shear
from hertzlink.studies.critical_distance import MAIN, SAME_MATERIALS
from plates.critical_distance import edge_difference

FIGURE_TOLERANCE = 0.02
"""Tolerance of AR in the figures."""

SHOWN_PARAMETERS = (0.06, 0.12, 0.24, 0.34, 0.48, 0.75, 1.2)
"""λ in the figure of the collapse, if it was simulated."""

JUMP_PARAMETERS = (0.2, 0.25, 0.3, 0.4)
"""λ around the value at which c of a simply supported edge jumps."""


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """By file name."""
    return {
        "collapse": collapse(data),
        "critical_distance": critical_distance(data),
        "jumps": jumps(data),
        "materials": materials(data),
        "shear": edge_shear.figure(data),
    }


def collapse(data: xr.Dataset) -> draw.Figure:
    """AR against d/ℓ for each edge: lines of constant λ, and markers for other beads and speeds."""
    from matplotlib import colormaps

    figure, axes = draw.panels(data.sizes["edge"], width=3.3, height=3.6)
    parameters = [p for p in data.inelasticity.values if p in SHOWN_PARAMETERS] or list(data.inelasticity.values)
    same = [name for name in data.pair.values if name in SAME_MATERIALS]
    for axis, edge in zip(axes, data.edge.values, strict=True):
        for i, parameter in enumerate(parameters):
            colour = colormaps["viridis"](0.85 * i / max(1, len(parameters) - 1))
            one = data.sel(edge=edge, inelasticity=parameter)
            label = f"λ = {parameter:g}"
            axis.plot(data.scaled_distance, one.amplitude_ratio, color=colour, linewidth=1.2, label=label)
            for k, name in enumerate(same):
                if parameter in data.other_inelasticity.values:
                    other = data.other_difference.sel(pair=name, other_edge=edge, other_inelasticity=parameter)
                    axis.plot(
                        data.other_distance, other + one.far_ratio, draw.MARKERS[k], color=colour, markersize=4.5,
                        markerfacecolor="none", linestyle="none",
                    )  # fmt: skip
        axis.set(title=f"{edge} edge", xlabel="distance from the edge, d / ℓ", xlim=(0.0, 3.5), ylim=(0.0, 1.0))
    axes[0].set_ylabel("amplitude ratio AR")
    for k, name in enumerate(same):
        axes[0].plot([], [], draw.MARKERS[k], color="black", markerfacecolor="none", linestyle="none", label=str(name))
    _legend(figure, axes[0], 5)
    return figure


def critical_distance(data: xr.Dataset) -> draw.Figure:
    """c against λ by the law, with its bounds, simulated values, and the thesis's two lines."""
    figure, axes = draw.panels(data.sizes["edge"], width=3.3, height=3.4)
    for axis, edge in zip(axes, data.edge.values, strict=True):
        law = data.law.sel(edge=edge, within=FIGURE_TOLERANCE)
        axis.fill_between(
            data.law_inelasticity, law.sel(estimate="low"), law.sel(estimate="high"), color=draw.COLOURS[5],
            alpha=0.35, linewidth=0.0, label="bounds of the law",
        )  # fmt: skip
        axis.plot(data.law_inelasticity, law.sel(estimate="value"), color=draw.COLOURS[0], linewidth=1.2, label="law")
        axis.plot(
            data.inelasticity, data.simulated.sel(edge=edge, within=FIGURE_TOLERANCE), "o", color="black",
            markersize=4.0, markerfacecolor="none", linestyle="none", label="simulated",
        )  # fmt: skip
        for line, style in zip(data.line.values, ("--", "-."), strict=True):
            axis.plot(
                data.law_inelasticity, data.scaled_line.sel(line=line), style, color="black", linewidth=0.9,
                label=f"path of the {line} wave during a contact",
            )  # fmt: skip
        axis.set(title=f"{edge} edge", xlabel="inelasticity parameter λ", xscale="log", ylim=(0.0, 6.0))
        _plain_ticks(axis)
    axes[0].set_ylabel(f"critical distance c = $d_c$ / ℓ (AR ± {FIGURE_TOLERANCE})")
    _legend(figure, axes[0], 5)
    return figure


def jumps(data: xr.Dataset) -> draw.Figure:
    """AR minus its far value near a simply supported edge, where an oscillation exceeds the tolerance; and c over λ
    there.
    """
    figure, (left, right) = draw.panels(2, width=3.6, height=3.2, sharey=False)
    for i, parameter in enumerate(JUMP_PARAMETERS):
        curve = edge_difference("simple", MAIN.stiffness_ratio, parameter)
        left.plot(*curve, color=draw.COLOURS[i], linewidth=1.2, label=f"λ = {parameter:g}")
    for sign in (-1.0, 1.0):
        left.axhline(sign * FIGURE_TOLERANCE, color="black", linewidth=0.8, linestyle=":")
    left.set(xlim=(0.6, 2.6), ylim=(-0.04, 0.06))
    left.set(xlabel="distance from a simple edge, d / ℓ", ylabel="AR minus AR far away")
    left.legend(frameon=False, fontsize="small")
    for i, within in enumerate(data.within.values):
        law = data.law.sel(edge="simple", within=within)
        value = law.sel(estimate="value")
        right.plot(data.law_inelasticity, value, color=draw.COLOURS[i], linewidth=1.2, label=f"± {within:g}")
        right.fill_between(
            data.law_inelasticity, law.sel(estimate="low"), law.sel(estimate="high"), color=draw.COLOURS[i], alpha=0.2,
            linewidth=0.0,
        )  # fmt: skip
    right.set(
        xscale="log", xlim=(0.05, 0.9), ylim=(0.0, 2.2), xlabel="inelasticity parameter λ", ylabel="c, simple edge"
    )
    _plain_ticks(right)
    right.legend(frameon=False, fontsize="small", title="tolerance")
    return figure


def materials(data: xr.Dataset) -> draw.Figure:
    """The remaining difference at equal λ and d/ℓ: deviation from steel on aluminium over the ratio of contact
    stiffnesses.
    """
    figure, axes = draw.panels(data.sizes["other_edge"], width=3.0, height=3.0)
    for axis, edge in zip(axes, data.other_edge.values, strict=True):
        for i, parameter in enumerate(data.other_inelasticity.values):
            part = data.sel(other_edge=edge, other_inelasticity=parameter)
            for what, face, label in (
                ("material_deviation", draw.COLOURS[i], "from steel on aluminium"),
                ("other_error", "none", "from the table for its own ratio"),
            ):
                axis.plot(
                    data.stiffness_ratio, abs(part[what]).max("other_distance"), draw.MARKERS[i], linestyle="none",
                    color=draw.COLOURS[i], markerfacecolor=face, markersize=4.5, label=f"λ = {parameter:g}, {label}",
                )  # fmt: skip
        axis.set(title=f"{edge} edge", xlabel="stiffness, bead on plate / bead on bead", yscale="log", ylim=(1e-5, 0.2))
    axes[0].set_ylabel("largest deviation of AR, d ≥ 0.6 ℓ")
    _legend(figure, axes[0], 2)
    return figure


def _legend(figure: draw.Figure, axis: draw.Axes, columns: int) -> None:
    """One legend above all panels."""
    handles = axis.get_legend_handles_labels()
    figure.legend(*handles, loc="outside upper center", ncols=columns, frameon=False, fontsize="small")


def _plain_ticks(axis: draw.Axes) -> None:
    """Numbers, not powers, on an axis of λ."""
    ticks = [tick for tick in (0.05, 0.1, 0.2, 0.5, 1.0, 2.0) if tick <= axis.get_xlim()[1]]
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set_xticks([], minor=True)
