"""Plots of AR and TOF over a parameter of a sweep, with the reasons for missing values."""

from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from coupling.plots.canvas import COLOURS, axes_for, from_zero, in_words, legend_below, mark_missing, plain, styled
from coupling.results.ar_and_tof import WAVES, amplitude_ratio, reflections, time_of_flight
from coupling.results.findings import NUMBER
from coupling.results.schema import axes_of, kind_of, unit_of
from coupling.results.waves import NoWave
from structures.checks import count_of, instance, one_of, whole
from structures.units import handy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MEASURES = {
    "amplitude_ratio": ("amplitude ratio AR", 1.0, amplitude_ratio),
    "time_of_flight": ("time of flight TOF (µs)", 1e6, time_of_flight),
}
MARKERS = ("o", "s", "^", "D", "v", "P")
MOST_CURVES = len(COLOURS)


def swept(
    runs: xr.Dataset, sensor: int | None = None, measure: str = "amplitude_ratio", over: str | None = None,
    wave: str = "primary", ax: "Axes | None" = None,
) -> "Axes":  # fmt: skip
    """Draw AR or TOF over a parameter of a sweep. The legend gives the reasons for missing values.

    Parameters
    ----------
    runs : Dataset
        The result of `sweep` or `batch` over one or two parameters, with forces or the variable that `measure` names.
    sensor : int, optional
        A bead, 1 to N from the struck end; needed where the Dataset holds forces.
    measure : {"amplitude_ratio", "time_of_flight"}
        What to draw.
    over : str, optional
        The parameter on the horizontal axis; by default the first. The other one makes the curves.
    wave : {"primary", "secondary", "third"}
        Which of the reflected waves.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        A cross at the bottom marks each point without such a wave; it is not drawn as 0.

    Examples
    --------
    >>> chain = hl.Chain([hl.Sphere(4.76e-3, hl.STEEL_440C)] * 14, hl.Sphere(4.76e-3, hl.STEEL_440C), 0.1)
    >>> def against(modulus):
    ...     return hl.CoSimulation(chain, hl.half_space(hl.Material(modulus, 0.3, 2000.0)))
    >>> runs = hl.sweep(against, until=1.2e-3, jobs=1, modulus=[2e9, 5e9, 20e9])
    >>> print(hl.plots.swept(runs, sensor=7).get_xlabel())
    modulus (GPa)
    """
    data = instance("runs", runs, xr.Dataset, "the Dataset of a sweep")
    sensor = sensor if sensor is None else whole("sensor", sensor)
    name, factor, read = MEASURES[one_of("measure", measure, MEASURES)]
    kept = f"{wave}_" * (one_of("wave", wave, WAVES) != "primary") + measure  # as cases keep the secondary wave
    if kept not in data and not kind_of(data):
        raise ValueError(f"runs: holds neither forces nor {kept}; must be the Dataset of a sweep")
    values = data[kept].reset_coords(drop=True) if kept in data else read(data, sensor, wave)  # type: ignore[arg-type]
    axes = [str(axis) for axis in values.dims]
    if not 1 <= len(axes) <= 2:
        raise ValueError(
            f"runs: has the parameters {', '.join(axes) or 'none'}; must have one or two, choose others with runs.sel"
        )
    along = axes[0] if over is None else one_of("over", over, axes)
    other = next((axis for axis in axes if axis != along), "")
    count = values.sizes[other] if other else 1
    if count > MOST_CURVES:
        raise ValueError(
            f"runs: {other} has {count} values, which make as many curves; choose at most {MOST_CURVES} with "
            f"runs.sel, or take over={other!r}"
        )

    is_number = values[along].dtype.kind in "iuf"
    x = parameter(values[along])[0] * values[along].values if is_number else np.arange(values.sizes[along])
    ax = axes_for(ax)
    for number in range(count):
        at = {other: number} if other else {}
        curve = factor * values.isel(at).values
        label = f"{wave} wave" + f" at bead {sensor}" * bool(sensor)
        if other:
            value, (scale, unit) = values[other].values[number], parameter(values[other])
            label = f"{words_of(values[other])} {scale * value:.4g} {unit}".rstrip() if np.isreal(value) else str(value)
        style, colour = MARKERS[number] + "-" * is_number, COLOURS[number]
        ax.plot(x, curve, style, color=colour, markersize=4.0, linewidth=1.1, label=label)
        gaps = np.flatnonzero(np.isnan(curve))
        if gaps.size:
            reasons = dict[str, list[str]]()  # those that differ only in numbers are together
            for gap in gaps:
                point = data.isel({along: int(gap), **at})
                said = [str(point[key].values) for key in ("error", "reason") if key in point]
                waves = reflections(point, sensor) if sensor and not any(said) and kind_of(point) else None
                missing = getattr(waves, wave, waves and waves.secondary)
                why = missing.reason if isinstance(missing, NoWave) else "no such wave was found"
                why = next(filter(None, said), why)
                reasons.setdefault(NUMBER.sub("#", why), []).append(why)
            texts = [f"{many[-1]} ({count_of(len(many), 'point')})" for many in reasons.values()]
            mark_missing(ax, x[gaps], number, label=f"no {wave} wave: {'; '.join(texts)}")
    if not is_number:
        ax.set_xticks(x, [plain(str(value)) for value in values[along].values])
    elif len(x) > 2 and np.all(x > 0.0) and x.max() > 20.0 * x.min():
        ax.set_xscale("log")
        ax.xaxis.set_major_formatter("{x:g}")
    if not np.isfinite(values.values).any():
        ax.set_yticks([])
    elif measure == "amplitude_ratio":
        from_zero(ax)
    styled(ax, label_of(values[along]), name)
    legend_below(ax, f"{wave} wave" if other else "")
    return ax


def words_of(values: xr.DataArray) -> str:
    """Return the name of a parameter in words."""
    return plain(str(values.attrs.get("long_name") or in_words(str(values.name))))


def label_of(values: xr.DataArray) -> str:
    """Return the label of an axis for a parameter, or the head of a column: words and unit."""
    unit = parameter(values)[1]
    return f"{words_of(values)} ({unit})" if unit else words_of(values)


def varied(runs: xr.Dataset) -> dict[str, str]:
    """Return the parameters of a sweep by name, each with its values in words, such as "5 to 125 mm"."""
    shown = next((name for name in ("contact_force", *MEASURES) if name in runs), None)
    texts = {}
    for name in [axis for axis in axes_of(runs[shown]) if axis in runs.coords] if shown else ():
        values, (factor, unit) = runs[name], parameter(runs[name])
        if values.dtype.kind not in "iuf":
            texts[name] = ", ".join(map(str, values.values))
        elif values.size > 1:
            low, high = factor * values.values.min(), factor * values.values.max()
            texts[name] = f"{low:.6g} to {high:.6g} {unit}".rstrip()
    return texts


def parameter(values: xr.DataArray) -> tuple[float, str]:
    """Return the factor of a parameter and its unit in handy form, from its attribute or from its name."""
    unit = str(values.attrs.get("units", "")) or unit_of(str(values.name))
    return handy(values.values, unit) if values.dtype.kind in "iuf" else (1.0, "")
