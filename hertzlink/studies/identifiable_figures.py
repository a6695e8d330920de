"""Figures of the study of identifiability: maps of half-widths, blind regions hatched."""

import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, NullLocator

from hertzlink.studies import draw
from hertzlink.studies import identifiable_cases as cases

COLOURS = "viridis"
LIMITS = LogNorm(1e-3, cases.BLIND)  # 0.1 to 50 %: above, the map is blind; below, it has the colour of 0.1 %.
TICKS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
GREY, HATCH = "0.85", "////"


def distances(data: xr.Dataset) -> draw.Figure:
    """Draw half-widths of the distance over distance and thickness, by way to measure and bead; data: of one record."""
    figure = draw.blank(figsize=(11.5, 4.6), dpi=150)
    axes = figure.subplots(data.diameter.size, len(cases.MEASURED), sharex=True, sharey=True, squeeze=False)
    for place, (row, diameter) in enumerate(zip(axes, data.diameter.values, strict=True)):
        for axis, what in zip(row, cases.MEASURED, strict=True):
            free = "distance" if what == cases.FEATURES else "all"
            errors = data.edge_error.sel(diameter=diameter, measured=what, free=free, unknown="distance")
            _map(axis, data.distance.values * 1e3, errors.transpose("thickness", "distance").values)
            axis.set_yticks(range(data.thickness.size), [f"{1e3 * t:.2f}" for t in data.thickness.values])
            if place == 0:
                axis.set_title(f"{what}\n(distance alone unknown)" if what == cases.FEATURES else what, fontsize=10)
            if place == len(axes) - 1:
                axis.set_xlabel("distance (mm)")
            _log_axis(axis, (5, 10, 20, 50, 100, 200))
        row[0].set_ylabel(f"beads of {diameter * 1e3:.2f} mm\nplate (mm)")
    _legend(figure, axes, "95 % half-width\nof the distance")
    record = float(data.record) * 1e3
    figure.suptitle(f"Clamped edge of an aluminium plate; record of {record:.1f} ms, white noise of 1 %", fontsize=11)
    return figure


def bonds(data: xr.Dataset) -> draw.Figure:
    """Draw half-widths of the bond over stiffness and the upper layer's thickness, by material and what is measured."""
    figure = draw.blank(figsize=(9.5, 6.2), dpi=150)
    axes = figure.subplots(data.upper.size, data.bond_measured.size, sharex=True, sharey=True, squeeze=False)
    for place, (row, upper) in enumerate(zip(axes, data.upper.values, strict=True)):
        for axis, what in zip(row, data.bond_measured.values, strict=True):
            errors = data.bond_error.sel(
                upper=upper, bond_measured=what, bond_free="all", bond_unknown="bond_stiffness"
            ).transpose("upper_thickness", "bond_stiffness")
            _map(axis, data.bond_stiffness.values * 1e-12, errors.values)
            thickness = data.upper_thickness.values
            axis.set_yticks(range(thickness.size), [f"{1e3 * t:.3g}" for t in thickness])
            upper_stiffness = cases.UPPERS[str(upper)].youngs_modulus / thickness * 1e-12
            for colour, width, label in (("white", 3.5, None), ("firebrick", 1.8, "stiffness of the layer, E/L")):
                axis.plot(upper_stiffness, range(thickness.size), "-", color=colour, linewidth=width, label=label)
            axis.set_xlim(*_ends(data.bond_stiffness.values * 1e-12)[[0, -1]])
            axis.set_title(f"{upper} on steel, {what}", fontsize=10)
            if place == len(axes) - 1:
                axis.set_xlabel("stiffness of the bond (N/µm/mm²)")
            _log_axis(axis, (0.1, 1.0, 10.0, 100.0))
        row[0].set_ylabel("thickness of the\nupper layer (mm)")
    _legend(figure, axes, "95 % half-width of the bond's stiffness")
    return figure


def _map(axis: draw.Axes, across: np.ndarray, errors: np.ndarray) -> None:
    """Draw cells; hatched grey where blind. Rows are equally high."""
    edges, rows = _ends(across), np.arange(errors.shape[0] + 1) - 0.5
    axis.set(facecolor=GREY, xscale="log")
    axis.pcolormesh(edges, rows, np.where(errors <= cases.BLIND, errors, np.nan), cmap=COLOURS, norm=LIMITS, zorder=1.5)
    axis.patch.set(hatch=HATCH, edgecolor="0.55")
    axis.grid(visible=False)


def _ends(centres: np.ndarray) -> np.ndarray:
    """Ends of cells around centres, on a logarithmic axis."""
    logs = np.log(centres)
    middle = 0.5 * (logs[1:] + logs[:-1])
    ends: np.ndarray = np.exp(np.concatenate([[2.0 * logs[0] - middle[0]], middle, [2.0 * logs[-1] - middle[-1]]]))
    return ends


def _log_axis(axis: draw.Axes, ticks: tuple[float, ...]) -> None:
    axis.xaxis.set_major_locator(FixedLocator(ticks))
    axis.xaxis.set_minor_locator(NullLocator())
    axis.xaxis.set_major_formatter("{x:g}")


def _legend(figure: draw.Figure, axes: np.ndarray, label: str) -> None:
    bar = figure.colorbar(
        ScalarMappable(LIMITS, COLOURS), ax=axes.ravel().tolist(), extend="min", ticks=TICKS, pad=0.01
    )
    bar.ax.yaxis.set_minor_locator(NullLocator())
    bar.ax.set_yticklabels([f"{100.0 * tick:g} %" for tick in TICKS])
    bar.set_label(label)
    blind = Patch(facecolor=GREY, hatch=HATCH, edgecolor="0.55", label="blind: more than ± 50 %")
    others = axes[0, 0].get_legend_handles_labels()[0]
    figure.legend(handles=[blind, *others], loc="outside lower center", ncols=2)
