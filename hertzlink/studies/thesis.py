"""The whole thesis: a verdict on each of its numbers and statements, with the study or check that shows it.

It runs the studies of its chapters, and judges their rows by the rules of `verdicts`.
"""

import json
import warnings
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from textwrap import fill
from typing import Any

import joblib
import numpy as np
import xarray as xr
from joblib.externals.loky import get_reusable_executor

from coupling.files.writing import write_whole
from coupling.results.provenance import versions
from coupling.sweeps.progress import Stopped, watched
from hertzlink.studies import draw, study
from hertzlink.studies.conditions import Conditions
from hertzlink.studies.table import WIDTH, Row
from hertzlink.studies.verdicts import CONDITION, RULE, UNKNOWN, VERDICTS, Verdict, counted, verdict
from structures.caution import collected
from structures.checks import whole

__all__ = ["Conditions", "figures", "run", "summary", "table"]
# Parts that are tables of a module: its name.
CHECKED = {
    "set-ups (chapter 2)": "thesis_inputs",
    "closed forms (chapters 1 and 6)": "closed_forms",
    "corrected equations": "corrected_equations",
}
# Parts that are studies, in the order of the thesis.
STUDIED = {
    "deformable chain (3.3, 3.4)": "deformable-chain",
    "contact laws (3.3.1, 5.3)": "contact-law",
    "symmetry (3.5)": "symmetry",
    "dissipation (4)": "dissipation",
    "ellipsoids (5.3.1)": "ellipsoids",
    "cylinders (5.3.2)": "cylinders",
    "hollow spheres (5.3.3)": "hollow-spheres",
    "rod stiffness (6.1.1)": "rod-stiffness",
    "rod length (6.1.2)": "rod-length",
    "upper layer (6.1.3)": "upper-layer",
    "lower layer (6.1.4)": "lower-layer",
    "aspect ratio of plates (6.2.1)": "aspect-ratio",
    "edges of plates (6.2.2)": "plate-boundary",
}
PARTS = (*CHECKED, *STUDIED)
# These parts start first, so that no process waits for them at the end.
LONGEST_FIRST = ("edges of plates (6.2.2)", "deformable chain (3.3, 3.4)", "contact laws (3.3.1, 5.3)")
NOTHING = ("", "not given", "figure only")  # What a row says where the thesis prints no number.
HEADS = {"confirmed": "confirmed", CONDITION: "conditional", "refuted": "refuted", UNKNOWN: "unknown"}  # in a terminal
SHADES = {"confirmed": draw.COLOURS[0], CONDITION: draw.COLOURS[2], "refuted": draw.COLOURS[1], UNKNOWN: "0.75"}
LIMITS = (0.5, 2.0)  # Ends of the axis of ratios.


def run(quick: bool = False, jobs: int | None = None, keep: Path | None = None, **parameters: Any) -> xr.Dataset:
    """Return the rows of all parts, and a verdict on each number of the thesis.

    quick: the quick versions of the studies. keep: a folder in which each finished part is kept, and from which a later
    run of the same version takes it.
    """
    Conditions.of(parameters)
    finished = {name: rows for name in PARTS if (rows := _kept(keep, name, quick)) is not None}
    order = sorted((name for name in PARTS if name not in finished), key=lambda name: name not in LONGEST_FIRST)
    try:
        for name, rows in watched(_in_processes(order, quick, jobs), len(order)):
            finished[name] = rows
            _keep(keep, name, quick, rows)
    except KeyboardInterrupt:
        if keep is None or not finished:
            raise
        raise Stopped(f"{len(finished)} of {len(PARTS)} parts kept in {keep}; run again to continue") from None
    return _dataset([(name, row) for name in PARTS for row in finished[name]])


def _in_processes(parts: list[str], quick: bool, jobs: int | None) -> Iterator[tuple[str, list[Row]]]:
    """Yield each part and its rows, as they are finished."""
    count = joblib.cpu_count() if jobs is None else whole("jobs", jobs)
    parallel = joblib.Parallel(min(count, len(PARTS)), return_as="generator_unordered")
    done = parallel(joblib.delayed(lambda part: (part, rows_of(part, quick)))(part) for part in parts)
    try:
        yield from done
    except BaseException:
        with warnings.catch_warnings():
            # joblib warns of tasks that it cancels, which is what is wanted here.
            warnings.simplefilter("ignore")
            done.close()
            get_reusable_executor().shutdown(wait=True, kill_workers=True)
        raise


def rows_of(part: str, quick: bool) -> list[Row]:
    """Return the rows of one part in which the thesis prints something."""
    with collected():  # each study warns by itself
        if part in CHECKED:
            rows = import_module(f"hertzlink.studies.{CHECKED[part]}").table()
        else:
            chosen = study(STUDIED[part])
            rows = chosen.table(chosen.run(quick, 1))
    return [row for row in rows if row.thesis not in NOTHING]


def source(part: str) -> str:
    """Return the command that repeats a part."""
    return f"hertzlink study {STUDIED.get(part, 'thesis')}"


def _kept(folder: Path | None, part: str, quick: bool) -> list[Row] | None:
    """Return the rows of a part that an earlier run of this version kept."""
    if folder is None or not (file := _file(folder, part)).is_file():
        return None
    try:
        data = json.loads(file.read_text(encoding="utf-8"))
        return [Row(**values) for values in data["rows"]] if data["made"] == _made(part, quick) else None
    except (ValueError, KeyError, TypeError):
        return None  # what is damaged is computed again


def _keep(folder: Path | None, part: str, quick: bool, rows: list[Row]) -> None:
    if folder is not None:
        folder.mkdir(exist_ok=True)
        data = {"made": _made(part, quick), "rows": [_plain(row) for row in rows]}
        write_whole(_file(folder, part), json.dumps(data, ensure_ascii=False).encode())


def forget(folder: Path) -> None:
    """Remove the kept parts, and the folder if nothing else lies in it."""
    for part in PARTS:
        _file(folder, part).unlink(missing_ok=True)
    if folder.is_dir() and not any(folder.iterdir()):
        folder.rmdir()


def _file(folder: Path, part: str) -> Path:
    words = "".join(letter if letter.isalnum() else " " for letter in part.partition("(")[0]).split()
    return folder / f"{'-'.join(words)}.json"


def _made(part: str, quick: bool) -> dict[str, Any]:
    return {"part": part, "quick": quick, "versions": versions()}


def _plain(row: Row) -> dict[str, Any]:
    return row._asdict() | {"otherwise": dict(row.otherwise)}


def _dataset(rows: list[tuple[str, Row]]) -> xr.Dataset:
    """Return one entry for each row of each part."""
    said = [verdict(row) for _, row in rows]
    columns = {
        "part": [part for part, _ in rows],
        "quantity": [row.quantity for _, row in rows],
        "unit": [row.unit for _, row in rows],
        "thesis": [str(row.thesis) for _, row in rows],
        "hertzlink": [str(row.computed) for _, row in rows],
        "verdict": [verdict.word for verdict in said],
        "condition": [verdict.condition for verdict in said],
        "reason": [row.reason for _, row in rows],
        "shown_by": [source(part) for part, _ in rows],
        "row": [json.dumps(_plain(row), ensure_ascii=False) for _, row in rows],
    }
    return xr.Dataset({name: ("entry", np.array(values, dtype=object)) for name, values in columns.items()})


def judged(data: xr.Dataset) -> Iterator[tuple[str, Row, Verdict]]:
    """Yield the part, row and verdict of each entry."""
    columns = (data[name].values for name in ("part", "row", "verdict", "condition"))
    for part, text, word, condition in zip(*columns, strict=True):
        yield str(part), Row(**json.loads(str(text))), Verdict(str(word), str(condition))


def _counts(data: xr.Dataset, part: str = "") -> dict[str, int]:
    """Return the number of verdicts of each kind in a part, or in all."""
    return counted(said for name, _, said in judged(data) if part in ("", name))


def table(data: xr.Dataset) -> list[Row]:
    """Return the counts, then each part under its name; a row's reason begins with its verdict."""
    rules = f"{_in_words(_counts(data))}. {' '.join(RULE.split())}"
    rows = [Row(f"{data.sizes['entry']} numbers and statements", "", "", reason=rules)]
    for part in PARTS:
        rows.append(Row(part.upper(), "", "", reason=f"{_in_words(_counts(data, part))}; {source(part)}"))
        for name, row, said in judged(data):
            if name == part:
                verdict = said.word.upper() + (f" ({said.condition})" if said.condition else "")
                rows.append(row._replace(reason=verdict + (f": {row.reason}" if row.reason else "")))
    return rows


def _in_words(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {word}" for word, count in counts.items() if count)


def summary(data: xr.Dataset) -> str:
    """Return the counts of each part, for the terminal."""
    width = max(map(len, PARTS)) + 2
    lines = [" " * width + "".join(f"{HEADS[word]:>{len(HEADS[word]) + 2}}" for word in VERDICTS), "-" * WIDTH]
    for part in (*PARTS, ""):
        counts = _counts(data, part)
        cells = "".join(f"{counts[word] or '':>{len(HEADS[word]) + 2}}" for word in VERDICTS)
        lines.append(f"{part or 'all':<{width}}{cells}".rstrip())
    more = "table.txt and report.html hold each number, its verdict and the reason."
    return "\n".join([*lines, "", *fill(RULE, WIDTH).splitlines(), "", more])


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return how many verdicts of each kind every part has; and ours over the thesis's number, by part."""
    bars, (axis,) = draw.panels(1, width=7.0, height=4.6)
    counts, left = [_counts(data, part) for part in PARTS], np.zeros(len(PARTS))
    for word in VERDICTS:
        widths = [of_part[word] for of_part in counts]
        axis.barh(range(len(PARTS)), widths, left=left, color=SHADES[word], label=word, height=0.7)
        left += widths
    axis.set_axisbelow(True)
    axis.set(xlabel="numbers and statements")
    ratios, (scale,) = draw.panels(1, width=7.0, height=4.6)
    for word in VERDICTS[:-1]:
        entries = [(PARTS.index(part), _ratio(row)) for part, row, said in judged(data) if said.word == word]
        points = [(place, ratio) for place, ratio in entries if ratio is not None]
        if points:
            places, values = zip(*points, strict=True)
            scale.plot(np.clip(values, *LIMITS), places, "o", color=SHADES[word], alpha=0.7, label=word)
    scale.axvline(1.0, color="0.4", linewidth=0.8, zorder=0)
    scale.set(xlabel="hertzlink / thesis; beyond the ends at the ends", xscale="log")
    ticks = (0.5, 0.7, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0)
    scale.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    scale.minorticks_off()
    for drawn, columns in ((axis, 4), (scale, 3)):
        drawn.set_ylim(len(PARTS) - 0.4, -0.6)
        drawn.set_yticks(range(len(PARTS)), PARTS, fontsize="small")
        drawn.legend(ncols=columns, loc="lower center", bbox_to_anchor=(0.4, 1.0))
    return {"verdicts": bars, "ratios": ratios}


def _ratio(row: Row) -> float | None:
    """Return ours over the thesis's, where both are single numbers."""
    try:
        ours, printed = float(row.computed), float(row.thesis)
    except ValueError:
        return None
    return ours / printed if printed and ours / printed > 0.0 else None
