"""Maps of a structure by taps at the points of a grid. At each point unknowns are identified, or AR and TOF read."""

import csv
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import scipy
import xarray as xr

from coupling.inference.identification import AT_END, BLIND, DEVIATIONS, NOT_TRUSTED, NUISANCE, Identification
from coupling.inference.measured import estimated
from coupling.inference.prediction import NUMERICAL
from coupling.results.ar_and_tof import SMALLEST_WAVE, amplitude_ratio, time_of_flight
from coupling.results.findings import findings_of, gathered, warn, with_warnings
from coupling.results.sensor_trace import noise_level
from coupling.results.signal_waves import SignalWaves
from coupling.sweeps.points import Task, run_points
from coupling.sweeps.store import Failure, Point, Store
from coupling.sweeps.sweep import outcomes_kept
from structures.caution import collected
from structures.checks import count_of, existing, function, instance, short
from structures.units import NUMBER, factor, in_si

# The head of a column: a name, optionally an entry that the column also sets, and a unit, such as "x = entry / mm".
HEAD = re.compile("([^/=(]*)(?:=([^/(]*))?(?:[/(](.*))?")

FAILED, MEASURED = "failed", "measured"  # Verdicts of points without an answer, and of AR and TOF, which need no model.
NONE = {"value": np.nan, "low": np.nan, "high": np.nan, "verdict": FAILED}  # An unknown at a point without an answer.


class Grid(NamedTuple):
    """The points of a table."""

    points: list[Point]  # each with x and y (m), its files, and the values of the further columns by name
    units: tuple[str, str] = ("m", "m")  # of x and y in the table


def map_taps(
    points: str | os.PathLike[str] | Sequence[Mapping[str, Any]],
    read: Callable[[Path], xr.Dataset],
    answer: Callable[[xr.Dataset, Mapping[str, Any]], Identification] | None = None,
    jobs: int | None = None,
    store: str | os.PathLike[str] | None = None,
) -> xr.Dataset:
    """Identify the unknowns, or read AR and TOF, at each point of a grid of taps.

    Parameters
    ----------
    points : path or sequence of mapping
        A table in CSV, or a folder that holds it as points.csv. Its header is, for example, ``x / mm, y / mm, file``;
        each line below is a tap. Lines with the same x and y are taps of one point. The files lie in the folder of the
        table. Or a list of mappings with x and y (m), files (paths), and what else `answer` needs.
    read : callable
        Takes the path of a file and returns its signal, such as `read_signal` with its sensors.
    answer : callable, optional
        Takes the signal and the point, a mapping with x, y and the further columns (SI units), and returns the result
        of `identify`. Without it AR and TOF are read.
    jobs : int, optional
        Number of processes; by default one for each core.
    store : path, optional
        A folder that keeps each answer, so that an interrupted map can be continued, as in `sweep`.

    Returns
    -------
    Dataset
        Over `point` and `unknown`: value, low and high (the 95 % interval), verdict. Over `point`: x and y (m), taps,
        fits (how many are as good), misfit (residual over noise), files, and error (why the point failed).
        `plots.mapped` draws it.

    Raises
    ------
    ValueError
        For a table without x, y and file, or with text instead of a number; and if all points fail.

    Examples
    --------
    >>> import numpy as np
    >>> time = np.arange(0.0, 6e-4, 1e-6)
    >>> def read(file):
    ...     pulse = lambda at: 50.0 * np.exp(-(((time - at) / 1.5e-5) ** 2))
    ...     return hl.as_signal(time, {7: pulse(2e-4) + float(file.read_text()) * pulse(4e-4)})
    >>> for name, ratio in (("left", 0.4), ("right", 0.6)):
    ...     _ = open(name, "w").write(str(ratio))
    >>> taps = [{"x": 0.0, "y": 0.0, "files": ["left"]}, {"x": 0.1, "y": 0.0, "files": ["right"]}]
    >>> hl.map_taps(taps, read, jobs=1).value.sel(unknown="AR at bead 7").values.round(2).tolist()
    [0.4, 0.6]
    """
    if isinstance(points, str | os.PathLike):
        grid = read_grid(points)
    else:
        for k, point in enumerate(points):
            if not isinstance(point, Mapping) or not {"x", "y", "files"} <= point.keys():
                raise ValueError(f"points[{k}] = {short(point)}: must hold x and y (m) and files")
        grid = Grid([{**point, "files": [str(file) for file in point["files"]]} for point in points])
    function("read", read, 1, "a function of a file's path")
    asked = measured_waves if answer is None else function("answer", answer, 2, "a function of a signal and its point")
    return mapped_taps(grid, Taps(asked, 0.0, read, None if store is None else Store(store, asked, read)), jobs)


def _si(name: str, text: str, unit: str) -> Any:
    """Return a cell in SI units. Text that is not a number stays text, except in x, y and columns with a unit."""
    value, match = in_si(f"{text} {unit}".strip()), NUMBER.fullmatch(text)
    if (name in ("x", "y") and (match is None or match[2])) or (unit and np.isnan(value)):
        raise ValueError(f"{short(text)} is not a number with the unit {unit}")
    return text if np.isnan(value) else value


def read_grid(path: str | os.PathLike[str], convert: Callable[[str, str, str], Any] = _si) -> Grid:
    """Return the points of a table. convert: takes name, text and unit of a cell and returns its value."""
    file = Path(path) / "points.csv" if Path(path).is_dir() else Path(path)
    existing(str(file), file)
    try:
        text = file.read_text(encoding="utf-8-sig")
        semicolons = ";" in text.partition("\n")[0]
        rows = csv.reader(text.splitlines(), delimiter=";" if semicolons else ",", skipinitialspace=True)
        cells = [[cell.strip() for cell in row] for row in rows]
    except (ValueError, csv.Error) as error:  # the file is not a text in UTF-8, or not a table
        raise ValueError(f"{file}: is not a table with the columns x / mm, y / mm and file ({error})") from None
    heads = [[part.strip(" ()") for part in HEAD.findall(cell)[0]] for cell in (cells or [[]])[0]]
    names, units = [name for name, *_ in heads], {name: unit for name, _, unit in heads}
    for name in ("x", "y", "file"):
        if names.count(name) != 1:
            has = f"has the columns {', '.join(filter(None, names))}" if any(names) else "has no columns"
            raise ValueError(f'{file}: {has}; must have one column "{name}", as in x / mm, y / mm, file')
        try:
            factor(units[name] if name != "file" else "m", "m")
        except ValueError:
            has = f'has the unit "{units[name]}"' if units[name] else "has no unit"
            raise ValueError(f"{file}: column {name} {has}; write one of length: {name} / mm") from None

    points, line_of = dict[tuple[Any, ...], dict[str, Any]](), dict[str, int]()
    for number, row in enumerate(cells[1:], 2):
        if not any(row):
            continue
        if len(row) > len(names):
            cure = "" if semicolons else "; decimal commas need semicolons between columns"
            raise ValueError(f"{file}:{number}: {len(row)} entries for {len(names)} columns{cure}")
        row += [""] * (len(names) - len(row))
        line, tap, point = f"{file}:{number}", row[names.index("file")], dict[str, Any]()
        for (name, entry, unit), cell in zip(heads, row, strict=True):
            decimal = cell.replace(",", ".") if semicolons else cell
            try:
                if name != "file":
                    point[name] = (_si if name in ("x", "y") else convert)(name, decimal, unit)
                if entry:
                    point[entry] = convert(entry, decimal, unit)
            except ValueError as error:
                raise ValueError(f"{line}: column {name}: {error}") from None
        if not tap or tap in line_of:
            again = f"names {tap!r} again, as line {line_of[tap]} does; a tap counts once" if tap else "names no file"
            raise ValueError(f"{line}: {again}")
        if not (file.parent / tap).resolve().is_relative_to(file.parent.resolve()):
            raise ValueError(f"{line}: {tap!r} is not in the table's folder; move it there")
        existing(f"{line}: file: {tap}", file.parent / tap)
        line_of[tap] = number
        points.setdefault(tuple(point.items()), {**point, "files": []})["files"].append(str(file.parent / tap))
    if not points:
        raise ValueError(f"{file}: has no points below its head")
    return Grid(list(points.values()), (units["x"], units["y"]))


@dataclass(frozen=True)
class Taps(Task):
    """The work at each point: `measure` reads a file, and `build` gives the answer for its signal and point."""

    build: Callable[..., Any]
    measure: Callable[[Any], xr.Dataset] | None = None

    goes_on = True

    def run(self, point: Point) -> xr.Dataset:
        """Return the answer at a point, with all warnings in its attributes; a ValueError if no tap has an answer."""
        assert self.measure is not None
        others = {name: value for name, value in point.items() if name not in ("files", "sums")}
        answers, refused = list[xr.Dataset](), list[ValueError]()
        with collected() as messages:
            for name in point["files"]:
                try:
                    answer: Any = self.build(self.measure(existing(name, Path(name))), others)
                    if self.build is not measured_waves:
                        answer = instance("answer(...)", answer, Identification, "an Identification").to_dataset()
                    answers.append(answer[[*NONE, "unit", "unit_size"]].assign_attrs(fits=answer.sizes.get("mode", 1)))
                except ValueError as error:
                    refused.append(error)
        if not answers:
            raise refused[0]
        fitting = [answer for answer in answers if NOT_TRUSTED not in answer.verdict.values] or answers
        data, findings = _mean_of_taps(fitting)
        findings += [f"tap left out: {error}" for error in refused]
        findings += ["tap left out: the model does not fit it"] * (len(answers) - len(fitting))
        findings += [line for answer in answers for line in findings_of(answer)]
        return with_warnings(data, [*findings, *messages])


def _mean_of_taps(taps: Sequence[xr.Dataset]) -> tuple[xr.Dataset, list[str]]:
    """Return the answer of all taps of a point, the means weighted by the taps' intervals, and warnings. If taps
    scatter more than their intervals allow (χ² test, 5 %), the interval follows from Student's distribution."""
    first, count = taps[0].assign_attrs(taps=len(taps), fits=max(tap.attrs.get("fits", 1) for tap in taps)), len(taps)
    if count == 1:
        return first, []
    value, low, high = (np.stack([tap[name].values for tap in taps]) for name in ("value", "low", "high"))
    weight = (2.0 * DEVIATIONS / np.maximum(high - low, 1e-12 * abs(value) + 1e-300)) ** 2
    mean = (weight * value).sum(axis=0) / weight.sum(axis=0)
    excess = (weight * (value - mean) ** 2).sum(axis=0)
    apart = excess > scipy.stats.chi2.ppf(0.95, count - 1)
    scale = np.where(apart, scipy.stats.t.ppf(0.975, count - 1) * np.sqrt(excess / (count - 1)), DEVIATIONS)
    half = scale / np.sqrt(weight.sum(axis=0))
    # A point has the worst verdict of its taps.
    columns = np.stack([tap.verdict.values for tap in taps], axis=1).tolist()
    verdict = [next((word for word in (FAILED, BLIND, AT_END) if word in column), column[0]) for column in columns]
    findings = [
        f"taps of {name}: scatter by {100.0 * value[:, k].std(ddof=1) / abs(mean[k]):.2g} %, more than their intervals"
        for k, name in enumerate(first.unknown.values.tolist())
        if apart[k] and verdict[k] != NUISANCE
    ]
    answer = {"value": mean, "low": mean - half, "high": mean + half, "verdict": verdict}
    misfit = float(np.sqrt(np.mean([tap.attrs.get("misfit", np.nan) ** 2 for tap in taps])))
    return first.assign({n: ("unknown", column) for n, column in answer.items()}).assign_attrs(misfit=misfit), findings


def measured_waves(signal: xr.Dataset, point: Mapping[str, Any]) -> xr.Dataset:
    """Return AR and TOF of the primary wave at each sensor; the point does not matter. The 95 % intervals come from 60
    draws of noise, which scatter and shift the values."""
    rows = dict[str, tuple[Any, ...]]()
    for sensor in signal.sensor.values.tolist():
        trace = signal.sensor_force.sel(sensor=sensor)
        force = np.asarray(trace.interpolate_na("time", fill_value="extrapolate").values, dtype=float)
        # Noise of low frequency is correlated from sample to sample, by m. This makes the variance of third differences
        # smaller than that of white noise, and so gives m.
        size, memory = estimated(force), np.linspace(0.0, 0.999, 1000)
        smaller = (noise_level(force) / size) ** 2 if size > 0.0 else 1.0
        m = float(np.interp(-smaller, -(1.0 - 1.5 * memory + 0.6 * memory**2 - 0.1 * memory**3), memory))
        white = np.random.default_rng(sensor).normal(size=(60, force.size))
        white[:, 1:] *= np.sqrt(1.0 - m**2)
        noise = size * scipy.signal.lfilter([1.0], [1.0, -m], white, axis=-1)
        drawn = np.full((len(noise), 2), np.nan)
        for draw, noisy in zip(drawn, force + noise, strict=True):
            (top, arrival), *back = SignalWaves(signal.time.values, noisy, SMALLEST_WAVE).peaks or [(np.nan, np.nan)]
            if back:
                draw[:] = back[0][0] / top, back[0][1] - arrival
        measures = ("AR", amplitude_ratio, ("", 1.0)), ("TOF", time_of_flight, ("µs", 1e-6))
        for (name, measure, unit), values in zip(measures, drawn.T, strict=True):
            here = float(measure(signal, sensor))
            scatter = float(np.sqrt(np.nanmean((values - here) ** 2)))
            half = DEVIATIONS * np.hypot(scatter, NUMERICAL * abs(here))
            verdict = FAILED if np.isnan(here) else MEASURED
            rows[f"{name} at bead {sensor}"] = here, here - half, here + half, verdict, *unit
    if all(row[3] == FAILED for row in rows.values()):
        raise ValueError("no reflected wave rises above the noise")
    columns = zip((*NONE, "unit", "unit_size"), zip(*rows.values(), strict=True), strict=True)
    return xr.Dataset({name: ("unknown", list(column)) for name, column in columns}, {"unknown": list(rows)})


def mapped_taps(grid: Grid, work: Taps, jobs: int | None = None) -> xr.Dataset:
    """Return the map of all points. A store identifies an answer by the content of its files."""
    points = list[Point]()
    for point in grid.points:
        files = [Path(name) for name in point["files"]]
        sums = [sha256(file.read_bytes()).hexdigest() if file.is_file() else "" for file in files]
        points.append({**point, "sums": sums})
    if work.store is None:
        outcomes = run_points(work, points, jobs, label="map")
    else:
        outcomes = outcomes_kept(work, work.store, points, jobs, label="map")
    answers, errors = dict[int, xr.Dataset](), dict[int, str]()
    for k, outcome in enumerate(outcomes):
        if not isinstance(outcome, Failure):
            answers[k] = outcome
        else:
            errors[k] = outcome.message if outcome.kind == "ValueError" else str(outcome)
    if not answers:
        # A map without an answer leaves nothing in its store.
        for path in map(work.store.path, points) if work.store else ():
            path.unlink(missing_ok=True)
        raise ValueError(f"all {count_of(len(errors), 'point')} failed, the first one with: {errors[0]}")

    data, first = _map(grid, answers), answers[min(answers)]
    data.attrs = {name: value for name, value in first.attrs.items() if name in ("input", "versions")}
    data["error"] = "point", [errors.get(k, "") for k in range(len(points))]
    said = {where(data, k): findings_of(answer) for k, answer in answers.items() if findings_of(answer)}
    findings = [f"failed: {where(data, k)}: {error}" for k, error in errors.items()] + gathered(said, len(points))
    warn(findings)
    return with_warnings(data, findings)


def _map(grid: Grid, answers: Mapping[int, xr.Dataset]) -> xr.Dataset:
    """Return the answers, given by the numbers of their points, over all points and all unknowns."""
    unknowns = dict[str, tuple[str, float]]()  # unit, and its size in SI units
    for answer in answers.values():
        columns = (answer[name].values.tolist() for name in ("unknown", "unit", "unit_size"))
        unknowns |= {name: (unit, size) for name, unit, size in zip(*columns, strict=True)}
    names = list(unknowns)
    none = xr.Dataset({name: ("unknown", [value] * len(names)) for name, value in NONE.items()}, {"unknown": names})
    every = [answers.get(k, none) for k in range(len(grid.points))]
    rows = [answer[list(NONE)].reindex(unknown=names, fill_value=NONE) for answer in every]
    data = xr.concat(rows, "point", combine_attrs="drop")
    data["verdict"] = data.verdict.astype(str)
    data["unit"] = "unknown", [unit for unit, _ in unknowns.values()]
    data["unit_size"] = "unknown", [size for _, size in unknowns.values()]

    for name, unit in zip("xy", grid.units, strict=True):
        place = {"units": "m", "unit": unit, "size": float(factor(unit, "m"))}
        data[name] = "point", [float(point[name]) for point in grid.points], place
    data["taps"] = "point", [int(answer.attrs.get("taps", 0)) for answer in every]
    data["fits"] = "point", [int(answer.attrs.get("fits", 0)) for answer in every]
    data["misfit"] = "point", [float(answer.attrs.get("misfit", np.nan)) for answer in every]
    data["files"] = "point", ["; ".join(Path(name).name for name in point["files"]) for point in grid.points]
    return data


def where(data: xr.Dataset, point: int) -> str:
    """Return the place of a point in words, in the units of the table."""
    return ", ".join(
        f"{name} = {data[name].values[point] / data[name].attrs['size']:g} {data[name].attrs['unit']}" for name in "xy"
    )


def points_of(data: xr.Dataset) -> list[xr.Dataset]:
    """Return the points of a map, without its nuisances."""
    names = [name for name in data.unknown.values if NUISANCE not in data.verdict.sel(unknown=name).values]
    return [data.sel(unknown=names).isel(point=k) for k in range(data.sizes["point"])]


def place_of(point: xr.Dataset) -> list[str]:
    """Return x and y of one point, in the units of the table."""
    return [f"{float(point[name]) / point[name].attrs['size']:g}" for name in "xy"]


def verdict_of(point: xr.Dataset) -> str:
    """Return the verdict that all unknowns of one point share, or all their verdicts."""
    return ", ".join(dict.fromkeys(verdict.partition(":")[0] for verdict in point.verdict.values.tolist()))
