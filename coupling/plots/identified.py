"""Plots of an identification: the fit over the data, its residual, intervals and correlations."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from coupling.inference.identification import AT_END, BLIND, HALF, IDENTIFIED, NUISANCE, Identification, unknowns_of
from coupling.plots.canvas import COLOURS, INK, PALE, SMALL, axes_for, legend_below, plain, styled
from structures.checks import one_of, short, whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes

SHOWN = ("fit", "residual", "intervals", "correlation")
NARROWEST = 1e-4  # %; narrower intervals are drawn with this width, so that they can be seen on a logarithmic axis

VERDICTS = {IDENTIFIED: COLOURS[2], BLIND: COLOURS[1], AT_END: COLOURS[4], NUISANCE: COLOURS[5]}
"""The colour of each verdict; PALE for values that are not trusted."""


def identified(found: object, show: str = "fit", sensor: int | None = None, ax: "Axes | None" = None) -> "Axes":
    """Draw an identification: its fit, the residual, how well each unknown is known, or the correlations.

    Parameters
    ----------
    found : Identification or Dataset
        The result of `identify`, or the Dataset that was saved from it.
    show : {"fit", "residual", "intervals", "correlation"}
        What to draw; see Returns.
    sensor : int, optional
        The sensor for "fit" and "residual"; by default the first.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        "fit": force over time, samples as points. "residual": the residual over the noise; a band holds 95 % of white
        noise. "intervals": half of the 95 % interval of each unknown in percent of its value, green if it is
        identified, grey if the model does not fit; unknowns of value 0 have no bar. "correlation": the matrix of
        correlations; unknowns with a correlation near ±1 cannot be told apart.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 10, bead, 0.3), wall)
    >>> found = hl.identify(build(3e9).run(5e-4), build, sensors=[5], nuisances=[], modulus=(1e9, 10e9))
    >>> [line.get_label() for line in hl.plots.identified(found).lines]
    ['measured at bead 5', 'fitted']
    """
    one_of("show", show, SHOWN)
    data = found.to_dataset() if isinstance(found, Identification) else found
    if not isinstance(data, xr.Dataset) or "verdict" not in data:
        raise ValueError(f"found = {short(found)}: must be the result of identify, or the Dataset saved from it")
    if show in ("intervals", "correlation"):
        if sensor is not None:
            raise ValueError(f"sensor = {sensor!r}: must be None for {show!r}, which concerns all sensors")
        return _intervals(data, ax) if show == "intervals" else _correlation(data, ax)
    sensors = [int(number) for number in np.atleast_1d(data.sensor.values)]
    number = sensors[0] if sensor is None else whole("sensor", sensor)
    if number not in sensors:
        raise ValueError(f"sensor = {sensor!r}: must be one that was compared: {', '.join(map(str, sensors))}")
    one = data.sel(sensor=number) if "sensor" in data.dims else data
    ax, time = axes_for(ax), 1e6 * one.time.values
    if show == "fit":
        ax.plot(time, one.measured, ".", color=PALE, markersize=2.5, label=f"measured at bead {number}")
        ax.plot(time, one.fitted, color=COLOURS[1], linewidth=1.1, label="fitted")
        styled(ax, "time (µs)", "force (N)")
        ax.legend(frameon=False, markerscale=3.0)
    else:
        left = (one.residual / one.noise).values
        size = float(np.sqrt(np.nanmean(left**2)))
        label = f"residual at bead {number}, {size:.3g} times the noise (root mean square)"
        ax.axhspan(-1.96, 1.96, color=COLOURS[0], alpha=0.12, linewidth=0.0, label="95 % of white noise")
        ax.plot(time, left, ".", color=INK, markersize=2.5, label=label)
        styled(ax, "time (µs)", "residual / noise")
        legend_below(ax)
    ax.margins(x=0.0)
    return ax


def _intervals(data: xr.Dataset, ax: "Axes | None") -> "Axes":
    """Draw half of the 95 % interval of each unknown in percent of its value."""
    unknowns = unknowns_of(data)
    parts = [100.0 * one.error / abs(one.value) if one.value else np.nan for one in unknowns]
    wide = np.maximum(parts, NARROWEST)
    ax = axes_for(ax, height=1.4 + 0.45 * len(unknowns))
    # On a logarithmic axis the bars begin to the left of the shortest one's end.
    start = 10.0 ** (np.floor(np.log10(np.nanmin(wide, initial=1.0))) - 1.0)
    words = []
    for row, (one, end) in enumerate(zip(unknowns, wide, strict=True)):
        length = end - start if np.isfinite(end) else 0.0
        ax.barh(row, length, left=start, height=0.5, color=VERDICTS.get(one.verdict, PALE))
        # The interval may be asymmetric, and a blind unknown has no value.
        value, low, high = (f"{number / one.unit_size:.4g}" for number in (one.value, *one.interval))
        text = f"{value}, " * (one.verdict != BLIND) + f"{low} to {high} {one.unit}".rstrip()
        words.append(f"{plain(one.name)}\n{text}, {one.verdict}")
    ax.axvline(100.0 * HALF, color=INK, linestyle=":", linewidth=0.9, label="wider than this: blind")
    ax.set_xscale("log")
    ax.set_xlim(start, 3.0 * max(100.0 * HALF, float(np.nanmax(wide, initial=1.0))))
    ax.xaxis.set_major_formatter("{x:g}")
    ax.set_yticks(range(len(words)), words, fontsize=SMALL)
    ax.set_ylim(len(words) - 0.4, -0.6)
    styled(ax, "half of the 95 % interval,\n% of the value", "")
    ax.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=SMALL)
    return ax


def _correlation(data: xr.Dataset, ax: "Axes | None") -> "Axes":
    """Draw the correlations of the unknowns at the best fit as a matrix."""
    matrix = data.correlation
    names = [plain(str(name)) for name in matrix[matrix.dims[0]].values]
    side = 2.4 + 0.5 * len(names)
    ax = axes_for(ax, side + 1.0, side)
    image = ax.imshow(matrix.values, cmap="RdBu_r", vmin=-1.0, vmax=1.0)
    for (row, column), value in np.ndenumerate(matrix.values):
        ink = "white" if abs(value) > 0.7 else INK
        ax.text(column, row, f"{value:.2f}", ha="center", va="center", color=ink, fontsize="small")
    ax.set_xticks(range(len(names)), names, rotation=40, ha="right", rotation_mode="anchor")
    ax.set_yticks(range(len(names)), names)
    ax.get_figure().colorbar(image, ax=ax, label="correlation", shrink=0.8)  # type: ignore[union-attr]
    return ax
