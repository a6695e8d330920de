"""Panels and curves that the figures of several studies share."""

from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from itertools import cycle
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from coupling.plots.canvas import COLOURS as COLOURS
from coupling.plots.canvas import mark_missing as mark_missing

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure as Figure
else:
    # Studies name these types; a process that draws nothing does not load matplotlib.
    Axes = Figure = Any

Line = tuple[str, np.ndarray, np.ndarray, np.ndarray]  # Label, x, simulated values and those of a theory.
Look = dict[str, Any]  # Settings of matplotlib for lines, markers, axes or legends.
FEW = 6  # Curves of fewer points have markers.
MARKERS = ("o", "s", "^", "D", "v", "P")
# Settings of matplotlib for all figures of studies.
STYLE = {"lines.linewidth": 1.2, "lines.markersize": 4.0, "legend.frameon": False, "legend.fontsize": "small"}


def style() -> AbstractContextManager[None]:
    """Draw figures in STYLE."""
    from matplotlib import rc_context

    return rc_context(STYLE)  # type: ignore[arg-type]


def blank(figsize: tuple[float, float], dpi: int) -> Figure:
    """Return an empty figure, in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=figsize, layout="constrained", dpi=dpi)


def panels(
    count: int, width: float = 3.4, height: float = 3.2, sharey: bool = True,
    titles: Iterable[str] = (), ylabels: Iterable[str] = (), **labels: Any,
) -> tuple[Figure, list[Axes]]:  # fmt: skip
    """Return a row of panels. The curves of a panel take COLOURS and MARKERS in order; the style "-" has no marker.

    titles, ylabels: of the first panels; labels: of all, as of `Axes.set`.
    """
    figure = blank(figsize=(width * count + 0.6, height), dpi=200)
    axes = figure.subplots(1, count, sharey=sharey, squeeze=False)[0]
    for axis in axes:
        axis.grid(alpha=0.25, linewidth=0.5)
        axis.set_prop_cycle(color=COLOURS, marker=MARKERS)
        axis.set(**labels)
    for name, texts in (("title", titles), ("ylabel", ylabels)):
        for axis, text in zip(axes, texts, strict=False):
            axis.set(**{name: text})
    return figure, list(axes)


def each(
    data: xr.Dataset, name: str, title: Callable[[Any], str], **how: Any
) -> tuple[Figure, list[tuple[Axes, xr.Dataset]]]:
    """Return a panel for each value of a coordinate, under a title, with the data there. how: as of `panels`."""
    values = data[name].values
    figure, axes = panels(len(values), titles=map(title, values), **how)
    return figure, [(axis, data.sel({name: value})) for axis, value in zip(axes, values, strict=True)]


def lines(
    axis: Axes, values: xr.DataArray, over: str, by: str, label: str | Callable[[Any], str] = "{}",
    factor: float = 1.0, styles: Iterable[str] = (), **look: Any,
) -> None:  # fmt: skip
    """Draw a variable over one of its coordinates, a line for each value of another one.

    label: of a line, with the place of the value or as a function of it. factor: of the coordinate, such as 1e6 for µs.
    styles: of the lines, in turn; look: of all.
    """
    name = label.format if isinstance(label, str) else label
    formats = cycle([(style,) for style in styles] or [()])
    for value, style in zip(values[by].values, formats, strict=False):
        axis.plot(factor * values[over], values.sel({by: value}), *style, label=name(value), **look)


def legend_above(figure: Figure, axis: Axes, columns: int) -> None:
    """Put the legend of one panel above all panels."""
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper center", ncols=columns)


def over_distance(
    data: xr.Dataset, ylabel: str, tolerance: float, sharey: bool = True
) -> tuple[Figure, list[tuple[Axes, xr.Dataset]]]:
    """Return a figure over the distance from the edge, and its panels with the data of each bead."""
    labels = Look(xlabel="distance from the clamped edge (mm)", ylabels=[ylabel])
    at = data.sel(within=tolerance)
    return each(at, "diameter", lambda d: f"D = {d * 1e3:.2f} mm", sharey=sharey, **labels)


def thick(thickness: float) -> str:
    """Return the name of a plate in figures. thickness: m."""
    return f"t = {thickness * 1e3:.2f} mm"


def against_distance(data: xr.Dataset, name: str, label: str, tolerance: float, factor: float = 1.0) -> Figure:
    """Return a variable over the distance: one panel for each bead, one curve for each plate; missing waves leave gaps.

    Bands are the brackets of the critical distances for a tolerance, open triangles their lower bounds. A ratio has a
    factor of 1.
    """
    ratio = factor == 1.0
    figure, beads = over_distance(data, label, tolerance, sharey=ratio)
    for axis, bead in beads:
        log_x(axis)
        for i, thickness in enumerate(data.thickness.values):
            case = bead.sel(thickness=thickness)
            curve, (low, high) = case[name].isel(distance=case.sampled.values) * factor, case.bracket.values * 1e3
            axis.plot(curve.distance * 1e3, curve, markersize=2.5, label=thick(thickness))
            if case.lower_bound:
                look = Look(markersize=6.0, transform=axis.get_xaxis_transform(), clip_on=False, zorder=3.0)
                axis.plot(low, 0.03, ">", color=COLOURS[i], markerfacecolor="white", **look)
            elif case.critical_distance.notnull():
                axis.axvspan(low, high, color=COLOURS[i], alpha=0.35, linewidth=0.0)
        if ratio:
            axis.set_ylim(0.0, 1.0)
    first = beads[0][0]
    first.fill_between([], [], color="grey", alpha=0.35, linewidth=0.0, label="critical distance")
    first.plot([], [], ">", color="grey", markersize=5.0, markerfacecolor="white", label="its lower bound")
    if bool((data.sampled & data[name].isnull()).any()):
        first.plot([], [], " ", label="no marker: no wave in the record")
    legend_above(figure, first, 2 * len(beads))
    return figure


def critical_distances(data: xr.Dataset, tolerance: float) -> Figure:
    """Return the critical distances against the bead diameter, with the A0 and the Rayleigh line.

    Bars are brackets; an open marker with an arrow is a lower bound.
    """
    figure, (axis,) = panels(1, width=4.6, height=4.6)
    diameters, plates = data.diameter.values * 1e3, data.sizes["thickness"]
    apart = 0.25 / 19.05 * diameters.max()
    # The lines of a single bead are level.
    ends = diameters if diameters.size > 1 else diameters * np.array([0.9, 1.1])
    for line, style in zip(data.line.values, ("--", "-"), strict=True):
        speed = "c = 0.2" if line == "A0 Lamb" else "c = 0.57"
        bound = np.broadcast_to(data.bound.sel(line=line) * 1e3, ends.shape)
        theory_line(axis, ends, bound, f"path of the {line} wave during a contact, {speed} √(E/ρ)", style)
    for i, thickness in enumerate(data.thickness.values):
        at = data.sel(thickness=thickness, within=tolerance)
        x = diameters + apart * (i - 0.5 * (plates - 1))
        low, high = (at.bracket.sel(end=end).values * 1e3 for end in ("low", "high"))
        open_ended = at.lower_bound.values
        # The value between two runs is no better than their distance, so the middle stands for both.
        middle = np.where(open_ended, np.nan, 0.5 * (low + high))
        look = Look(fmt=MARKERS[i], color=COLOURS[i], linewidth=0.8)
        axis.errorbar(x, middle, np.where(open_ended, 0.0, high - middle), capsize=5.0, label=thick(thickness), **look)
        axis.errorbar(x[open_ended], low[open_ended], 8.0, lolims=True, markerfacecolor="white", capsize=2.5, **look)
    axis.errorbar([], [], [], lolims=True, fmt="o", color="grey", markerfacecolor="white", label="lower bound")
    axis.set(xlabel="bead diameter D (mm), markers set apart", ylabel=f"critical distance (mm), AR ± {tolerance:g}")
    axis.set_ylim(bottom=0.0)
    figure.legend(*axis.get_legend_handles_labels(), loc="outside upper left")
    return figure


def refinement(data: xr.Dataset, tolerance: float) -> Figure:
    """Return AR's distance from its far value around the last crossing: samples, brackets, first scan interpolated."""
    figure, beads = over_distance(data, "|AR − far value|", tolerance)
    scan, first = data.sampled.all(["thickness", "diameter"]), beads[0][0]
    for axis, bead in beads:
        farthest = 0.0
        for i, thickness in enumerate(data.thickness.values):
            case = bead.sel(thickness=thickness)
            if not case.lower_bound:
                away = abs(case.amplitude_ratio - case.far_value).isel(distance=case.sampled.values)
                coarse = case.amplitude_ratio.isel(distance=scan.values)
                fine = np.linspace(float(coarse.distance[0]), float(coarse.distance[-1]), 4000)
                between = abs(np.interp(fine, coarse.distance, coarse) - float(case.far_value))
                axis.plot(fine * 1e3, between, "--", color=COLOURS[i], linewidth=0.8)
                look = Look(color=COLOURS[i], marker=MARKERS[i], linewidth=0.8, label=thick(thickness))
                axis.plot(away.distance * 1e3, away, **look)
                low, high = case.bracket.values * 1e3
                axis.axvspan(low, high, color=COLOURS[i], alpha=0.5, linewidth=0.0)
                farthest = max(farthest, high)
        axis.axhline(tolerance, color="black", linewidth=0.8)
        axis.set(yscale="log", ylim=(2e-3, 1.0), xlim=(0.0, 2.0 * farthest if farthest else 100.0))
    first.plot([], [], "--", color="grey", linewidth=0.8, label="first scan, AR interpolated")
    first.fill_between([], [], color="grey", alpha=0.5, linewidth=0.0, label="bracket")
    legend_above(figure, first, 2 * len(beads))
    first.annotate(f"tolerance {tolerance:g}", (0.0, tolerance), (3, 3), textcoords="offset points", fontsize="small")
    return figure


def intensity_map(
    time: np.ndarray, values: np.ndarray, force: np.ndarray,
    label: str = "Young's modulus of the rod (GPa)", factor: float = 1e-9,
) -> Figure:  # fmt: skip
    """Return the force at a sensor over time (s) and Young's modulus (Pa), or another value, one for each row."""
    figure, (axis,) = panels(1, width=5.0, height=3.6)
    mesh = axis.pcolormesh(time * 1e6, values * factor, force, cmap="inferno", shading="nearest", rasterized=True)
    axis.grid(visible=False)
    axis.set(yscale="log", xlabel="time (µs)", ylabel=label)
    _plain_numbers(axis.yaxis)
    figure.colorbar(mesh, ax=axis, label="force at the sensor (N)")
    return figure


def points(
    axis: Axes, x: np.ndarray, y: np.ndarray, number: int, label: str = "", hollow: bool = False, size: float = 4.0
) -> None:
    """Draw markers without a line, in the marker and colour of this number."""
    face = "white" if hollow else COLOURS[number]
    axis.plot(x, y, MARKERS[number], color=COLOURS[number], markerfacecolor=face, markersize=size, label=label)


def logarithmic(axis: Axes) -> None:
    """Make both axes logarithmic, with plain numbers at 1, 2 and 5 of each decade, or more on an axis within one."""
    axis.set(xscale="log", yscale="log")
    for axis_ in (axis.xaxis, axis.yaxis):
        _plain_numbers(axis_)


def beside_theory(
    axis: Axes, lines: Iterable[Line], xlabel: str, ylabel: str,
    theory: str = "theory of long waves", simulation: str = "simulation",
) -> None:  # fmt: skip
    """Draw curves of (label, x, simulated, theory): markers for what was simulated, a line for the theory.

    x increases and is positive, as is the theory, whose line runs between its points as a power law. Axes that are not
    logarithmic begin at zero.
    """
    for i, (label, x, simulated, expected) in enumerate(lines):
        fine = np.geomspace(x[0], x[-1], 200)
        between = np.exp(np.interp(np.log(fine), np.log(x), np.log(expected)))
        axis.plot(fine, between, "-", color=COLOURS[i], linewidth=1.0)
        points(axis, x, simulated, i, label)
    axis.plot([], [], "-", color="grey", linewidth=1.0, label=theory)
    axis.plot([], [], "o", color="grey", label=simulation)
    axis.set(xlabel=xlabel, ylabel=ylabel)
    if axis.get_xscale() == "linear":
        axis.set_xlim(left=0.0)
        axis.set_ylim(bottom=0.0)
    axis.legend()


SPEED_OVER_FORCE = ("peak contact force (N)", "wave speed (m/s)")
FORCE_OVER_APPROACH = ("approach (µm)", "contact force (N)")


def compared(
    lines: Iterable[Line], labels: tuple[str, str] = SPEED_OVER_FORCE,
    log: bool = False, height: float = 3.8, **names: str,
) -> Figure:  # fmt: skip
    """Return a figure of curves beside theory. log: both axes logarithmic; names: of theory and simulation."""
    figure, (axis,) = panels(1, width=4.6, height=height)
    if log:
        logarithmic(axis)
    beside_theory(axis, lines, *labels, **names)
    return figure


def against_angle(
    angle: np.ndarray, lines: Iterable[tuple[str, np.ndarray]], theory: xr.DataArray, trusted: float, ylabel: str
) -> Figure:
    """Return points over the angle between cylinders, in degrees from zero, compared with a theory over its own angles.

    Below the smallest angle at which the theory is valid, markers are hollow and its line is dashed. The first point is
    for parallel cylinders, which follow another law.
    """
    figure, (axis,) = panels(1, width=4.6, height=3.6)
    beyond = (angle > 0.0) & (angle < trusted)
    for i, (label, y) in enumerate(lines):
        size = 7.5 - 2.0 * i  # the points of most angles lie on one another
        points(axis, angle[~beyond], y[~beyond], i, label, size=size)
        points(axis, angle[beyond], y[beyond], i, hollow=True, size=size)
        if i == 0:
            first = (angle[0], y[0])
            axis.annotate("line contact", first, (8, 0), textcoords="offset points", va="center", fontsize="small")
    far, near = theory.sel(angle=slice(trusted, None)), theory.sel(angle=slice(None, trusted))
    theory_line(axis, far.angle, far, "theory of long waves, any force")
    theory_line(axis, near.angle, near, "", "--")
    label = f"below {trusted:.0f}°: beyond half-space theory"
    axis.plot([], [], "o--", color="black", linewidth=0.9, markerfacecolor="white", label=label)
    axis.set(xlabel="angle between neighbours (°)", ylabel=ylabel, xticks=[0, 10, 30, 45, 60, 75, 90])
    axis.set_ylim(bottom=0.0)
    axis.legend()
    return figure


def contact_laws(force: xr.DataArray, by: str, label: str | Callable[[Any], str] = "{}") -> Figure:
    """Return the force (N) over approach (m), both logarithmic, a line for each law. by, label: as of `lines`."""
    labels = Look(xscale="log", yscale="log", xlabel="approach (µm)", ylabel="contact force (N)")
    figure, (axis,) = panels(1, width=4.6, height=3.6, **labels)
    lines(axis, force, "approach", by, label, 1e6, "-")
    for side in (axis.xaxis, axis.yaxis):
        side.set_major_formatter("{x:g}")
    axis.legend()
    return figure


def banded(axis: Axes, x: np.ndarray, values: xr.DataArray, middle: float, label: str) -> None:
    """Draw a curve over x for the middle dashpot (N s/m), and a band that covers all dashpots."""
    between = f"γ = {float(values.dashpot.min()):g} to {float(values.dashpot.max()):g} N s/m"
    band = values.min("dashpot"), values.max("dashpot")
    axis.fill_between(x, *band, color=COLOURS[0], alpha=0.15, linewidth=0.0, label=between)
    axis.plot(x, values.sel(dashpot=middle), "o-" if len(x) < FEW else "-", color=COLOURS[0], label=label)


def theory_line(axis: Axes, x: Any, y: Any, label: str, style: str = "-") -> None:
    """Draw a thin black line of a closed form."""
    axis.plot(x, y, style, color="black", linewidth=0.9, label=label)


def marked(axis: Axes, x: float, text: str, left: bool = False) -> None:
    """Draw a dotted vertical line with a small text to its right, or left."""
    axis.axvline(x, color="grey", linestyle=":", linewidth=0.9)
    axis.annotate(
        text, (x, 0.2), (-3 if left else 3, 0), xycoords=("data", "axes fraction"), textcoords="offset points",
        fontsize="x-small", color="dimgrey", ha="right" if left else "left",
    )  # fmt: skip


def displacements(axis: Axes, displacement: xr.DataArray, thick: int) -> None:
    """Draw displacements (m, drawn in µm) of striker and beads over time (µs): one bead thick, the last one red."""
    time, last = displacement.time.values * 1e6, int(displacement.bead[-1])
    for bead in displacement.bead.values:
        colour, width = {thick: (COLOURS[0], 1.8), last: (COLOURS[1], 1.8)}.get(int(bead), ("grey", 0.5))
        label = f"bead {bead}" if bead in (thick, last) else None
        axis.plot(time, displacement.sel(bead=bead) * 1e6, "-", color=colour, linewidth=width, label=label)
    axis.set(xlabel="time (µs)", xlim=(0.0, 1000.0))


def histories(axis: Axes, force: xr.DataArray) -> None:
    """Draw force (N) over time (µs) at each sensor."""
    lines(axis, force, "time", "sensor", "at bead {}", 1e6, "-")
    axis.set(xlabel="time (µs)", xlim=(0.0, 1000.0))


def log_x(axis: Axes) -> None:
    """Make x logarithmic with plain numbers at 1, 2 and 5 of each decade."""
    axis.set_xscale("log")
    _plain_numbers(axis.xaxis)


def _plain_numbers(axis: "Axis") -> None:
    from matplotlib.ticker import LogLocator, NullFormatter

    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter("{x:g}")
    axis.set_minor_formatter(NullFormatter())
