"""Plots of AR and TOF over a parameter of a sweep, with the reasons for missing values."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from coupling.plots.canvas import COLOURS, axes_for, from_zero, in_words, legend_below, mark_missing, plain, styled
from coupling.results.ar_and_tof import WAVES, amplitude_ratio, reflections, time_of_flight
from coupling.results.findings import NUMBER
from coupling.results.reading import Reading
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
    runs: xr.Dataset,
    sensor: int | None = None,
    measure: str = "amplitude_ratio",
    over: str | None = None,
    wave: str = "primary",
    ax: "Axes | None" = None,
) -> "Axes":
    """Draw AR or TOF over a parameter of a sweep; the reasons for missing values stand in the legend.

    Parameters
    ----------
    runs : Dataset
        What `sweep` or `batch` returned, over one or two parameters; or a Dataset with the variable `amplitude_ratio`
        or `time_of_flight`, such as a sweep with `measure=`.
    sensor : int, optional
        A bead, 1 to N from the struck end. Runs need it.
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
        A cross at the bottom marks each point without such a wave; no such point is drawn as 0.

    Raises
    ------
    ValueError
        For one run, more than two parameters or more than six curves, and a sensor that the Dataset does not hold.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 14, bead, impact_speed=0.1)
    >>> def against(modulus):
    ...     return hl.CoSimulation(chain, hl.half_space(hl.Material(modulus, 0.3, 2000.0)))
    >>> runs = hl.sweep(against, until=1.2e-3, jobs=1, modulus=[2e9, 5e9, 20e9])
    >>> print(hl.plots.swept(runs, sensor=7).get_xlabel())
    modulus (GPa)
    """
    name, factor, _ = MEASURES[one_of("measure", measure, MEASURES)]
    sensor = sensor if sensor is None else whole("sensor", sensor)
    values = _values(runs, sensor, measure, one_of("wave", wave, WAVES))
    axes = [str(axis) for axis in values.dims]
    if not 1 <= len(axes) <= 2:
        raise ValueError(
            f"runs: has the parameters {', '.join(axes) or 'none'}; must have one or two, choose others with runs.sel"
        )
    along = axes[0] if over is None else one_of("over", over, axes)
    curves = [axis for axis in axes if axis != along]
    if curves and values.sizes[curves[0]] > MOST_CURVES:
        raise ValueError(
            f"runs: {curves[0]} has {values.sizes[curves[0]]} values, which make as many curves; choose at most "
            f"{MOST_CURVES} with runs.sel, or take over={curves[0]!r}"
        )
    missing = _reasons(runs, values, sensor, wave)
    ax = axes_for(ax)
    x, label = _places(values[along])
    for number, (words, curve, places) in enumerate(_curves(values, along, curves)):
        style = "-" if values[along].dtype.kind in "iuf" else "none"
        ax.plot(
            x, factor * curve, MARKERS[number], linestyle=style, color=COLOURS[number], markersize=4.0, linewidth=1.1,
            label=words or (f"{wave} wave at bead {sensor}" if sensor else f"{wave} wave"),
        )  # fmt: skip
        gaps = [place for place in places if place in missing]
        if gaps:
            mark_missing(
                ax, [x[place[axes.index(along)]] for place in gaps], number, label=_counted(gaps, missing, wave)
            )
    if values[along].dtype.kind not in "iuf":
        ax.set_xticks(x, [plain(str(value)) for value in values[along].values])
    elif len(x) > 2 and np.all(x > 0.0) and x.max() > 20.0 * x.min():
        ax.set_xscale("log")
        ax.xaxis.set_major_formatter("{x:g}")
    if not np.isfinite(values.values).any():
        ax.set_yticks([])
    elif measure == "amplitude_ratio":
        from_zero(ax)
    styled(ax, label, name)
    legend_below(ax, f"{wave} wave" if curves else "")
    return ax


def words_of(values: xr.DataArray) -> str:
    """Return what a parameter is, in words: its attribute `long_name`, or its name."""
    return plain(str(values.attrs.get("long_name") or in_words(str(values.name))))


def label_of(values: xr.DataArray) -> str:
    """Return the label of an axis for a parameter, or the head of a column: words and unit."""
    unit = parameter(values)[1]
    return f"{words_of(values)} ({unit})" if unit else words_of(values)


def varied(runs: xr.Dataset) -> dict[str, str]:
    """Return the parameters of a sweep by name, each with its values in words, such as "5 to 125 mm"."""
    shown = next((name for name in ("contact_force", *MEASURES) if name in runs), None)
    texts = {}
    for name in axes_of(runs[shown]) if shown else []:
        if name not in runs.coords or name == "wave":
            continue
        values = runs[name]
        factor, unit = parameter(values)
        if values.dtype.kind in "iuf" and values.size > 1:
            low, high = factor * values.values.min(), factor * values.values.max()
            texts[name] = f"{low:.6g} to {high:.6g} {unit}".rstrip()
        elif values.dtype.kind not in "iuf":
            texts[name] = ", ".join(map(str, values.values))
    return texts


def parameter(values: xr.DataArray) -> tuple[float, str]:
    """Return the factor of a parameter and its unit in handy form, from its attribute or from its name."""
    unit = str(values.attrs.get("units", "")) or unit_of(str(values.name))
    return handy(values.values, unit) if values.dtype.kind in "iuf" else (1.0, "")


def _places(values: xr.DataArray) -> tuple[np.ndarray, str]:
    """Return where points lie on the horizontal axis, and its label; names lie at 0, 1, 2."""
    if values.dtype.kind not in "iuf":
        return np.arange(values.size, dtype=float), words_of(values)
    return parameter(values)[0] * values.values.astype(float), label_of(values)


def _values(runs: Any, sensor: int | None, measure: str, wave: str) -> xr.DataArray:
    """Return the measure over the parameters."""
    data = instance("runs", runs, xr.Dataset, "the Dataset of a sweep")
    if f"{wave}_{measure}" in data:  # as cases keep the secondary wave
        return data[f"{wave}_{measure}"].reset_coords(drop=True)
    if measure in data:
        values = data[measure]
        if "wave" in values.dims:
            waves = values["wave"].values.tolist()
            values = values.sel(wave=one_of("wave", wave, waves))
        elif wave != "primary":
            raise ValueError(f"wave = {wave!r}: runs holds {measure} of one wave only")
        return values.reset_coords(drop=True)
    if not kind_of(data):
        raise ValueError(f"runs: holds neither forces nor {measure}; must be the Dataset of a sweep")
    if sensor is None:
        raise ValueError("sensor = None: must be a bead of the runs, 1 to N from the struck end")
    return MEASURES[measure][2](data, sensor, wave)


def _curves(values: xr.DataArray, along: str, others: list[str]) -> Iterator[tuple[str, Any, list[tuple[int, ...]]]]:
    """Yield the words, values and places of each curve."""
    axes = [str(axis) for axis in values.dims]
    count = values.sizes[along]
    if not others:
        yield "", values.values, [(i,) for i in range(count)]
        return
    factor, unit = parameter(values[others[0]])
    for number, name in enumerate(values[others[0]].values):
        words = f"{words_of(values[others[0]])} {factor * name:.4g} {unit}" if np.isreal(name) else str(name)
        places: list[tuple[int, ...]] = [(i, number) if axes[0] == along else (number, i) for i in range(count)]
        yield words.strip(), values.isel({others[0]: number}).values, places


def _reasons(runs: xr.Dataset, values: xr.DataArray, sensor: int | None, wave: str) -> dict[tuple[int, ...], str]:
    """Return why a wave is missing, by the place of the point."""
    reasons: dict[tuple[int, ...], str] = {}
    for at in zip(*np.nonzero(np.isnan(values.values)), strict=True):
        place = tuple(int(i) for i in at)
        point = runs.isel(dict(zip(map(str, values.dims), place, strict=True)))
        reasons[place] = _reason(point, sensor, wave)
    return reasons


def _reason(point: xr.Dataset, sensor: int | None, wave: str) -> str:
    for name in ("error", "reason"):
        if name in point and str(point[name].values):
            return str(point[name].values)
    if sensor is None or not kind_of(point) or axes_of(point.contact_force) or Reading(point).time.size < 2:
        return "no such wave was found"
    waves = reflections(point, sensor)
    missing = getattr(waves, wave, waves.secondary)
    return str(missing.reason) if isinstance(missing, NoWave) else "no such wave was found"


def _counted(gaps: list[tuple[int, ...]], missing: Mapping[tuple[int, ...], str], wave: str) -> str:
    """Return the reasons of missing values in words, each kind once, with the number of its points.

    Of reasons that differ in numbers only, the one with the greatest last number is shown: the longest record.
    """
    kinds: dict[str, list[str]] = {}
    for place in gaps:
        kinds.setdefault(NUMBER.sub("#", missing[place]), []).append(missing[place])
    texts = []
    for reasons in kinds.values():
        shown = max(reasons, key=lambda reason: [float(number[0]) for number in NUMBER.finditer(reason)][-1:])
        texts.append(f"{shown} ({count_of(len(reasons), 'point')})")
    return f"no {wave} wave: " + "; ".join(texts)
