"""Maps of a structure: taps at the points of a grid, each identified, or read for AR and TOF, by itself."""

import csv
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.stats import chi2
from scipy.stats import t as student

from coupling.inference.features import correlated, memory_of
from coupling.inference.identification import AT_END, BLIND, NOT_TRUSTED, NUISANCE, Identification
from coupling.inference.measured import estimated
from coupling.results.ar_and_tof import of_signals
from coupling.results.findings import findings_of, gathered, warn, with_warnings
from coupling.results.reading import Reading
from coupling.results.sensor_trace import interpolated_over_gaps, noise_level
from coupling.sweeps.points import Outcome, Task, run_points
from coupling.sweeps.store import Failure, Point, Store
from coupling.sweeps.sweep import outcomes_kept
from structures.caution import collected
from structures.checks import count_of, function, instance, short
from structures.units import NUMBER, factor, in_si

TABLE = "points.csv"
"""The table of a folder of taps."""

HEAD = re.compile(r"\s*(?P<name>[^/=(]+?)\s*(=\s*(?P<entry>[^/(]+?)\s*)?(/\s*(?P<unit>.+?)\s*|\((?P<in>.+?)\)\s*)?")
"""The head of a column: a name, perhaps an entry that it sets as well, and a unit, such as "x = entry / mm"."""

FAILED, MEASURED = "failed", "measured"
"""Verdicts of a point without an answer, and of AR and TOF, which no model explains."""

WORST = (FAILED, BLIND, AT_END)
"""Verdicts that a point has as soon as one of its taps has them, the worst first."""

DRAWS = 60
"""Draws of noise from which the scatter of AR and TOF of a single tap follows, to 9 %."""

NUMERICAL = 1e-4
"""Part of AR and TOF to which they are read."""

NORMAL = 1.96
"""Standard deviations in half of a 95 % interval."""

OF_UNKNOWNS = ("value", "low", "high")


@dataclass(frozen=True)
class Grid:
    """The points of a table: each holds x and y (m), its files, and the values of the further columns by name.

    units: those of x and y, as the table has them.
    """

    points: list[Point]
    units: tuple[str, str] = ("m", "m")


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
        A table in CSV, or the folder in which it is points.csv: a head such as ``x / mm, y / mm, file``, then a line
        for each tap. Lines with the same x and y are taps of one point. Files lie beside the table. Or mappings with
        x and y (m), files (paths), and what else `answer` needs.
    read : callable
        Takes the path of a file and returns its signal, such as `read_signal` with its sensors.
    answer : callable, optional
        Takes the signal and the point, a mapping with x, y and the further columns (SI units), and returns what
        `identify` found. Without it AR and TOF are read.
    jobs : int, optional
        Number of processes; by default one for each core.
    store : path, optional
        A folder that keeps each answer, so that a map that was interrupted continues, as in `sweep`.

    Returns
    -------
    Dataset
        Over `point` and `unknown`: value, low and high (the 95 % interval), verdict; over `point`: x and y (m), taps,
        misfit (residual over noise), files, and error, why the point failed. `plots.mapped` draws it.

    Raises
    ------
    ValueError
        For a table without x, y and file, or with what is no number; if all points fail.

    Warns
    -----
    HertzlinkWarning
        For points that failed, taps that were left out, and what `read` and `answer` warn of.

    Notes
    -----
    Each tap of a point is answered by itself. The value of a point is their mean, weighted by their intervals. Where
    they scatter more than these intervals allow (χ², 5 %), it is the plain mean, with Student's interval of the
    scatter, and a warning. Taps that the model does not fit are left out where it fits others.

    The interval of AR and TOF of a tap comes from draws of noise like that of its quiet lead. It does not hold what
    differs from tap to tap.

    Examples
    --------
    >>> import hertzlink as hl
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
    grid = read_grid(points) if isinstance(points, str | os.PathLike) else Grid(_checked(points))
    function("read", read, 1, "a function of a file's path")
    if answer is not None:
        function("answer", answer, 2, "a function of a signal and its point")
    kept = None if store is None else Store(store, answer or read, read)
    return mapped_taps(grid, Taps(answer or read, 0.0, read, kept, asked=answer is not None), jobs)


def read_grid(path: str | os.PathLike[str], convert: Callable[[str, str, str], Any] | None = None) -> Grid:
    """Return the points of a table. convert: takes name, text and unit of a further column and returns its value."""
    file = Path(path) / TABLE if Path(path).is_dir() else Path(path)
    if not file.is_file():
        raise ValueError(f"{file}: there is no such file; give a table with the columns x / mm, y / mm and file")
    try:
        text = file.read_text(encoding="utf-8-sig")
        semicolons = ";" in text.partition("\n")[0]
        lines = [*csv.reader(text.splitlines(), delimiter=";" if semicolons else ",", skipinitialspace=True)]
        rows = [(n, line) for n, line in enumerate(lines, 1) if any(cell.strip() for cell in line)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{file}: is no table of text in UTF-8 ({error})") from None
    heads = [HEAD.fullmatch(cell) for cell in (rows[0][1] if rows else [])]
    names = [head["name"].strip() if head else "" for head in heads]
    units = [((head["unit"] or head["in"] or "").strip(" ()") if head else "") for head in heads]
    for name in ("x", "y", "file"):
        if names.count(name) != 1:
            raise ValueError(f"{file}: has the columns {short(names)}, must have one {name}: x / mm, y / mm, file")
    shown = units[names.index("x")], units[names.index("y")]
    for name, unit in zip("xy", shown, strict=True):
        try:
            factor(unit, "m")
        except ValueError:
            raise ValueError(
                f'{file}: column {name} has the unit "{unit}", must have one of length: {name} / mm'
            ) from None
    points: dict[tuple[Any, ...], dict[str, Any]] = {}
    line_of = dict[str, int]()
    for number, row in rows[1:]:
        if len(row) > len(names):
            raise ValueError(
                f"{file}:{number}: has {count_of(len(row), 'cell')} under {count_of(len(names), 'column')}"
            )
        cells = [cell.strip() for cell in row] + [""] * (len(names) - len(row))
        point: dict[str, Any] = {}
        tap = ""
        for name, unit, head, cell in zip(names, units, heads, cells, strict=False):
            text = cell.replace(",", ".") if semicolons and name != "file" else cell
            try:
                if name == "file":
                    tap = cell
                elif name in ("x", "y"):
                    point[name] = _length(text, unit)
                else:
                    point[name] = (convert or _si)(name, text, unit)
                if head and head["entry"]:
                    point[head["entry"]] = (convert or _si)(head["entry"], text, unit)
            except ValueError as error:
                raise ValueError(f"{file}:{number}: column {name}: {error}") from None
        if not tap:
            raise ValueError(f"{file}:{number}: names no file")
        if tap in line_of:
            raise ValueError(f"{file}:{number}: names {tap!r} again, as line {line_of[tap]} does; a tap counts once")
        line_of[tap] = number
        key = tuple(point.items())
        points.setdefault(key, {**point, "files": []})["files"].append(str(file.parent / tap))
    if not points:
        raise ValueError(f"{file}: has no points below its head")
    return Grid(list(points.values()), shown)


def _length(text: str, unit: str) -> float:
    match = NUMBER.fullmatch(text)
    if match is None or match[2]:
        raise ValueError(f"{short(text)} is no number")
    return in_si(f"{text} {unit}")


def _si(name: str, text: str, unit: str) -> Any:
    """Return a cell in SI units; text that is no number as it is."""
    value = in_si(f"{text} {unit}".strip())
    if unit and np.isnan(value):
        raise ValueError(f"{short(text)} is no number with the unit {unit}")
    return text if np.isnan(value) else value


def _checked(points: Any) -> list[Point]:
    if not isinstance(points, Sequence) or not points:
        raise ValueError(f"points = {short(points)}: must be a path, or mappings with x, y and files")
    for k, point in enumerate(points):
        if not isinstance(point, Mapping) or not {"x", "y", "files"} <= point.keys():
            raise ValueError(f"points[{k}] = {short(point)}: must hold x and y (m) and files")
    return [{**point, "files": [str(file) for file in point["files"]]} for point in points]


@dataclass(frozen=True)
class Taps(Task):
    """The work at each point: `measure` reads a file, and `build` answers, or AR and TOF are read."""

    build: Callable[..., Any]
    measure: Callable[[Any], xr.Dataset] | None = None
    asked: bool = True

    def run(self, point: Point) -> xr.Dataset:
        """Return the answer at a point, with all warnings in its attributes; a ValueError where no tap has one."""
        assert self.measure is not None
        others = {name: value for name, value in point.items() if name not in ("files", "key", "sums")}
        answers: list[xr.Dataset] = []
        refused: list[ValueError] = []
        with collected() as messages:
            for name in point["files"]:
                try:
                    if not Path(name).is_file():
                        raise ValueError(f"{name}: there is no such file")
                    signal = self.measure(Path(name))
                    answers.append(self._identified(signal, others) if self.asked else _waves(signal))
                except ValueError as error:
                    refused.append(error)
        if not answers:
            raise refused[0]
        fitting = [answer for answer in answers if NOT_TRUSTED not in answer.verdict.values]
        data, findings = _together(fitting or answers)
        findings += [f"tap left out: {error}" for error in refused]
        findings += ["tap left out: the model does not fit it"] * (len(answers) - len(fitting or answers))
        return with_warnings(
            data, [*findings, *(line for answer in answers for line in findings_of(answer)), *messages]
        )

    def _identified(self, signal: xr.Dataset, others: Mapping[str, Any]) -> xr.Dataset:
        answer = instance("answer(...)", self.build(signal, others), Identification, "an Identification")
        return answer.to_dataset()[[*OF_UNKNOWNS, "verdict", "unit", "unit_size"]]

    def outcome(self, point: Point) -> Outcome:
        """Return a failure at a point also without a store: no point may cost the others."""
        return self.attempt(point) if self.store is None else super().outcome(point)


def _together(taps: Sequence[xr.Dataset]) -> tuple[xr.Dataset, list[str]]:
    """Return the answer of all taps of a point, with warnings: means weighted by the intervals of the taps.

    Where their scatter exceeds what these allow (χ², 5 %), Student's interval of the plain mean takes their place.
    """
    first, findings = taps[0].assign_attrs(taps=len(taps)), list[str]()
    if len(taps) == 1:
        return first, findings
    value, low, high = (np.stack([tap[name].values for tap in taps]) for name in OF_UNKNOWNS)
    verdicts = np.stack([tap.verdict.values for tap in taps])
    free = len(taps) - 1
    weight = 1.0 / np.maximum(high - low, 1e-12 * abs(value) + 1e-300) ** 2
    mean = (weight * value).sum(axis=0) / weight.sum(axis=0)
    half = 0.5 / np.sqrt(weight.sum(axis=0))
    apart = ((2.0 * NORMAL) ** 2 * weight * (value - mean) ** 2).sum(axis=0) > chi2.ppf(0.95, free)
    spread = student.ppf(0.975, free) * value.std(axis=0, ddof=1) / np.sqrt(len(taps))
    mean, half = np.where(apart, value.mean(axis=0), mean), np.where(apart, spread, half)
    verdict = [next((word for word in WORST if word in column), column[0]) for column in verdicts.T.tolist()]
    findings += [
        f"taps of {name}: scatter by {100.0 * value[:, k].std(ddof=1) / abs(mean[k]):.2g} %, more than their intervals"
        for k, name in enumerate(first.unknown.values.tolist()) if apart[k] and verdict[k] != NUISANCE
    ]  # fmt: skip
    columns = {"value": mean, "low": mean - half, "high": mean + half, "verdict": verdict}
    misfit = float(np.sqrt(np.mean([tap.attrs.get("misfit", np.nan) ** 2 for tap in taps])))
    return first.assign({name: ("unknown", column) for name, column in columns.items()}).assign_attrs(
        misfit=misfit
    ), findings


def _waves(signal: xr.Dataset) -> xr.Dataset:
    """Return AR and TOF of the primary wave at each sensor; their 95 % intervals are those of draws of noise."""
    sensors = signal.sensor.values.tolist()
    value = np.array([float(one) for sensor in sensors for one in of_signals(Reading(signal), sensor)])
    if np.isnan(value).all():
        raise ValueError("no reflected wave stands out of the noise")
    draws = [of_signals(Reading(_drawn(signal, sensor)), sensor) for sensor in sensors]
    scatter = [float(np.nanstd(values)) for both in draws for values in both]
    half = NORMAL * np.hypot(scatter, NUMERICAL * abs(value))
    return xr.Dataset(
        {
            "value": ("unknown", value), "low": ("unknown", value - half), "high": ("unknown", value + half),
            "verdict": ("unknown", [FAILED if np.isnan(one) else MEASURED for one in value]),
            "unit": ("unknown", ["", "µs"] * len(sensors)), "unit_size": ("unknown", [1.0, 1e-6] * len(sensors)),
        },
        {"unknown": [f"{what} at bead {sensor}" for sensor in sensors for what in ("AR", "TOF")]},
    )  # fmt: skip


def _drawn(signal: xr.Dataset, sensor: int) -> xr.Dataset:
    """Return a signal with draws of noise like that of its lead added, over `draw`."""
    force = interpolated_over_gaps(np.asarray(signal.sensor_force.sel(sensor=sensor).values, dtype=float))
    size = estimated(force)
    random = np.random.default_rng(sensor)
    white = random.normal(size=(DRAWS, force.size))
    noise = (
        size * correlated(white, memory_of(np.full(DRAWS, noise_level(force) / size))) if size > 0.0 else 0.0 * white
    )
    return signal.sel(sensor=[sensor]).assign(sensor_force=(("draw", "time", "sensor"), (force + noise)[..., None]))


def mapped_taps(grid: Grid, work: Taps, jobs: int | None = None, key: str = "") -> xr.Dataset:
    """Return the map of all points. key: what else an answer in the store depends on."""
    points = grid.points
    if work.store is not None:
        points = [{**point, "key": key, "sums": [_sum_of(Path(name)) for name in point["files"]]} for point in points]
    if work.store is None:
        outcomes = run_points(work, points, jobs, label="map")
    else:
        outcomes = outcomes_kept(work, work.store, points, jobs, label="map")
    data = _combined(grid, outcomes)
    warn(findings_of(data))
    return data


def _sum_of(file: Path) -> str:
    return sha256(file.read_bytes()).hexdigest() if file.is_file() else ""


def where(data: xr.Dataset, point: int) -> str:
    """Return the place of a point, as the table has it."""
    return ", ".join(
        f"{name} = {data[name].values[point] / data[name].attrs['size']:g} {data[name].attrs['unit']}" for name in "xy"
    )


def _combined(grid: Grid, outcomes: Sequence[Outcome]) -> xr.Dataset:
    """Return the map; a point that failed holds NaN and its error."""
    answers = {k: outcome for k, outcome in enumerate(outcomes) if isinstance(outcome, xr.Dataset)}
    errors = [
        "" if k in answers else
        outcome.message if isinstance(outcome, Failure) and outcome.kind == "ValueError" else str(outcome)
        for k, outcome in enumerate(outcomes)
    ]  # fmt: skip
    if not answers:
        raise ValueError(f"all {count_of(len(errors), 'point')} failed, the first one with: {errors[0]}")
    first = next(iter(answers.values()))
    names = list(dict.fromkeys(str(name) for answer in answers.values() for name in answer.unknown.values))
    shape = len(outcomes), len(names)
    numbers = {name: np.full(shape, np.nan) for name in OF_UNKNOWNS}
    verdict = np.full(shape, FAILED, dtype=object)
    units, sizes = dict.fromkeys(names, ""), dict.fromkeys(names, 1.0)
    for k, answer in answers.items():
        for i, name in enumerate(answer.unknown.values.tolist()):
            column = names.index(name)
            for what, table in numbers.items():
                table[k, column] = float(answer[what][i])
            verdict[k, column] = str(answer.verdict.values[i])
            units[name], sizes[name] = str(answer.unit.values[i]), float(answer.unit_size[i])
    data = xr.Dataset(
        {name: (("point", "unknown"), table) for name, table in numbers.items()},
        {"unknown": names},
        {name: value for name, value in first.attrs.items() if name in ("input", "versions")},
    )
    data["verdict"] = ("point", "unknown"), verdict.astype(str)
    data["unit"], data["unit_size"] = ("unknown", list(units.values())), ("unknown", list(sizes.values()))
    for name, unit in zip("xy", grid.units, strict=True):
        place = {"units": "m", "unit": unit, "size": float(factor(unit, "m"))}
        data[name] = "point", [float(point[name]) for point in grid.points], place
    data["taps"] = "point", [int(answers[k].attrs["taps"]) if k in answers else 0 for k in range(len(outcomes))]
    data["misfit"] = (
        "point",
        [float(answers[k].attrs.get("misfit", np.nan)) if k in answers else np.nan for k in range(len(outcomes))],
    )
    data["files"] = "point", ["; ".join(Path(name).name for name in point["files"]) for point in grid.points]
    data["error"] = "point", errors
    said = {where(data, k): findings_of(answer) for k, answer in answers.items() if findings_of(answer)}
    failed = [f"failed: {where(data, k)}: {error}" for k, error in enumerate(errors) if error]
    return with_warnings(data, [*failed, *gathered(said, len(outcomes))])
