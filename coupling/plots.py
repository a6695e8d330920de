"""Figures of the studies; imports matplotlib, so import it only where figures are drawn."""

from collections.abc import Iterable

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
MARKERS = ("o", "s", "^", "D", "v", "P")


def panels(count: int, width: float = 3.4, height: float = 3.2, sharey: bool = True) -> tuple[Figure, list[Axes]]:
    """A row of panels in one style."""
    figure = Figure(figsize=(width * count + 0.6, height), layout="constrained", dpi=200)
    axes = figure.subplots(1, count, sharey=sharey, squeeze=False)[0]
    for axis in axes:
        axis.grid(alpha=0.25, linewidth=0.5)
    return figure, list(axes)


def against_distance(values: xr.DataArray, label: str, factor: float) -> Figure:
    """One panel for each bead, one curve for each plate; missing waves leave gaps. A ratio has a factor of 1."""
    figure, axes = panels(values.sizes["diameter"], sharey=factor == 1.0)
    for axis, diameter in zip(axes, values.diameter.values, strict=True):
        for i, thickness in enumerate(values.thickness.values):
            curve = values.sel(diameter=diameter, thickness=thickness)
            axis.plot(
                curve.distance * 1e3, curve * factor, MARKERS[i], color=COLOURS[i], linestyle="-", markersize=3.5,
                linewidth=1.0, label=f"t = {thickness * 1e3:.2f} mm",
            )  # fmt: skip
        axis.set(title=f"D = {diameter * 1e3:.2f} mm", xlabel="distance from the clamped edge (mm)")
        if factor == 1.0:
            axis.set_ylim(0.0, 1.0)
        if values.sel(diameter=diameter).isnull().any():
            note = "no marker: no wave in the record"
            axis.text(0.97, 0.03, note, transform=axis.transAxes, ha="right", fontsize="small")
    axes[0].set_ylabel(label)
    curves = axes[0].get_legend_handles_labels()
    figure.legend(*curves, loc="outside upper center", ncols=values.sizes["thickness"], frameon=False)
    return figure


def critical_distances(data: xr.Dataset) -> Figure:
    """Critical distances against the bead diameter, between the A0 and the Rayleigh line."""
    figure, (axis,) = panels(1, width=4.6, height=3.6)
    diameters = data.diameter.values * 1e3
    for line, style in zip(data.line.values, ("--", "-"), strict=True):
        speed = "c = 0.2" if line == "A0 Lamb" else "c = 0.57"
        axis.plot(
            diameters, data.bound.sel(line=line) * 1e3, style, color="black", linewidth=1.0,
            label=f"equation 6.42, {line}, {speed} √(E/ρ)",
        )  # fmt: skip
    for i, thickness in enumerate(data.thickness.values):
        found = data.critical_distance.sel(thickness=thickness, within=0.02) * 1e3
        axis.plot(
            diameters + 0.2 * (i - 1), found, MARKERS[i], color=COLOURS[i], linestyle="none",
            label=f"t = {thickness * 1e3:.2f} mm",
        )  # fmt: skip
    axis.set(xlabel="bead diameter D (mm), markers set apart", ylabel="critical distance (mm)")
    axis.set_ylim(bottom=0.0)
    axis.legend(frameon=False, fontsize="small")
    return figure


def curves(axis: Axes, x: np.ndarray, lines: Iterable[tuple[str, np.ndarray, str]], xlabel: str, ylabel: str) -> None:
    """Labelled lines over a logarithmic x; a line's style is matplotlib's short form."""
    for i, (label, y, style) in enumerate(lines):
        axis.plot(x, y, style, color=COLOURS[i % len(COLOURS)], markersize=4.0, linewidth=1.2, label=label)
    axis.set(xscale="log", xlabel=xlabel, ylabel=ylabel)
    axis.xaxis.set_major_formatter("{x:g}")


def intensity_map(time: np.ndarray, modulus: np.ndarray, force: np.ndarray) -> Figure:
    """Force at a sensor over time (s) and Young's modulus (Pa); rows of `force` belong to moduli."""
    figure, (axis,) = panels(1, width=5.0, height=3.6)
    mesh = axis.pcolormesh(time * 1e6, modulus * 1e-9, force, cmap="inferno", shading="nearest", rasterized=True)
    axis.grid(visible=False)
    axis.set(yscale="log", xlabel="time (µs)", ylabel="Young's modulus of the rod (GPa)")
    axis.yaxis.set_major_formatter("{x:g}")
    figure.colorbar(mesh, ax=axis, label="force at the sensor (N)")
    return figure
