"""The whole thesis: a verdict on each of its numbers and statements, with the study or check that shows it.

It runs the studies of its chapters, and judges their rows by the rules of `verdicts`.
"""

import json
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.results.provenance import versions
from coupling.sweeps.points import Outcome, Task, run_points
from coupling.sweeps.store import Point, Store
from coupling.sweeps.sweep import outcomes_kept
from hertzlink.studies import draw, study, verdicts
from hertzlink.studies.table import WIDTH, Row, number
from structures.caution import collected

__all__ = ["figures", "run", "summary", "table"]
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
HEADS = dict(zip(verdicts.VERDICTS, ("agrees", "condition", "differs", "misprint", "undefined"), strict=True))
SHADES = dict(zip(verdicts.VERDICTS, (*(draw.COLOURS[i] for i in (0, 2, 1)), "0.45", "0.75"), strict=True))
EQUATIONS = "corrected equations"
NEAR = 0.05  # A difference that is called small.
FARTHEST = 5  # Differences that the summary names.
LIMITS = (0.5, 2.0)  # Ends of the axis of ratios.


@dataclass(frozen=True)
class Parts(Task):
    """The work at each part: `build` returns its rows, which are kept as text."""

    build: Callable[..., Any]

    def run(self, point: Point) -> xr.Dataset:
        """Return the rows of the part."""
        rows = self.build(point["part"], point["quick"])
        texts = [json.dumps(_plain(row), ensure_ascii=False) for row in rows]
        return xr.Dataset({"row": ("entry", texts)})

    def outcome(self, point: Point) -> Outcome:
        """Keep the rows; an error ends the study."""
        rows = self.run(point)
        if self.store is not None:
            self.store.keep(point, rows)
        return rows


def run(quick: bool = False, jobs: int | None = None, keep: Path | None = None) -> xr.Dataset:
    """Return the rows of all parts, and a verdict on each number of the thesis.

    quick: the quick versions of the studies. keep: a folder in which each finished part is kept, and from which a later
    run of the same version takes it.
    """
    store = None if keep is None else Store(keep)
    task = Parts(rows_of, 0.0, store=store)
    order = sorted(PARTS, key=lambda part: part not in LONGEST_FIRST)
    points: list[Point] = [{"part": part, "quick": quick, "versions": json.dumps(versions())} for part in order]
    with warnings.catch_warnings():
        # A worker whose memory has grown is replaced between two parts; nothing is lost, so nobody need read of it.
        warnings.filterwarnings("ignore", "A worker stopped while some jobs", UserWarning)
        if store is None:
            done = run_points(task, points, jobs, label="thesis")
        else:
            done = outcomes_kept(task, store, points, jobs, label="thesis")
    texts = {part: done[i].row.values.tolist() for i, part in enumerate(order)}  # type: ignore[union-attr]
    return _dataset([(part, Row(**json.loads(text))) for part in PARTS for text in texts[part]])


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


def _plain(row: Row) -> dict[str, Any]:
    return row._asdict() | {"otherwise": dict(row.otherwise)}


def _dataset(rows: list[tuple[str, Row]]) -> xr.Dataset:
    """Return one entry for each row of each part."""
    rows, said = judge(rows)
    columns = {
        "part": [part for part, _ in rows],
        "quantity": [row.quantity for _, row in rows],
        "unit": [row.unit for _, row in rows],
        "thesis": [str(row.thesis) for _, row in rows],
        "hertzlink": [str(row.computed) for _, row in rows],
        "verdict": [verdict.word for verdict in said],
        "detail": [verdict.detail for verdict in said],
        "reason": [row.reason for _, row in rows],
        "shown_by": [source(part) for part, _ in rows],
        "row": [json.dumps(_plain(row), ensure_ascii=False) for _, row in rows],
    }
    return xr.Dataset({name: ("entry", np.array(values, dtype=object)) for name, values in columns.items()})


def judge(rows: list[tuple[str, Row]]) -> tuple[list[tuple[str, Row]], list[verdicts.Verdict]]:
    """Return the rows with what other rows say of the same number and quantity, and the verdict on each.

    The first row of a number is its entry; those of its other readings are conditions of it, without a verdict.
    """
    first = {row.number: i for i, (_, row) in reversed([*enumerate(rows)]) if row.number}
    readings = {i for i, (_, row) in enumerate(rows) if first.get(row.number, i) != i}
    whole_rows = []
    for i, (part, row) in enumerate(rows):
        others = {} if i in readings else {rows[j][1].quantity: rows[j][1].computed for j in readings
                                           if first[rows[j][1].number] == i}  # fmt: skip
        whole_rows.append((part, row._replace(otherwise={**row.otherwise, **others}, spread=spread(rows, row))))
    another = verdicts.Verdict(verdicts.READING)
    return whole_rows, [another if i in readings else verdicts.verdict(row) for i, (_, row) in enumerate(whole_rows)]


def spread(rows: list[tuple[str, Row]], row: Row) -> str:
    """Return the range of what theory, simulation and experiment give for the quantity of a row; "" of a single one."""
    alike = [value for _, other in rows if row.of and other.of == row.of for value in (other.thesis, other.theory)]
    # Of a number with a scatter its middle counts.
    plain = [value.partition("±")[0] if isinstance(value, str) else value for value in alike]
    ends = {end for value in plain for end in verdicts.exact(value) or ()}
    return f"{min(ends):g} to {max(ends):g}" if len(ends) > 1 else ""


def judged(data: xr.Dataset) -> Iterator[tuple[str, Row, verdicts.Verdict]]:
    """Yield the part, row and verdict of each entry."""
    columns = (data[name].values for name in ("part", "row", "verdict", "detail"))
    for part, text, word, detail in zip(*columns, strict=True):
        yield str(part), Row(**json.loads(str(text))), verdicts.Verdict(str(word), str(detail))


def _counts(data: xr.Dataset, part: str = "") -> dict[str, int]:
    """Return the number of verdicts of each kind in a part, or in all."""
    return verdicts.counted(said for name, _, said in judged(data) if part in ("", name))


def table(data: xr.Dataset) -> list[Row]:
    """Return the counts, then each part under its name; a row's reason begins with its verdict."""
    rules = f"{verdicts.in_words(_counts(data))}. {' '.join(verdicts.RULE.split())}"
    rows = [Row(f"{sum(_counts(data).values())} numbers and statements", "", "", reason=rules)]
    for part in PARTS:
        counts = verdicts.in_words(_counts(data, part)) or "inputs, without verdicts"
        rows.append(Row(part.upper(), "", "", reason=f"{counts}; {source(part)}"))
        for name, row, said in judged(data):
            if name == part:
                verdict = said.word.upper() + (f" ({said.detail})" if said.detail else "")
                rows.append(row._replace(reason=verdict + (f": {row.reason}" if row.reason else "")))
    return rows


def summary(data: xr.Dataset) -> str:
    """Return ten lines that say what agrees and what does not, and the counts of each part, for the terminal."""
    width = max(map(len, PARTS))
    lines = [" " * width + "".join(f"{head:>{len(head) + 2}}" for head in HEADS.values()), "-" * WIDTH]
    for part in (*PARTS, ""):
        counts = _counts(data, part)
        cells = "".join(f"{counts[word] or '':>{len(head) + 2}}" for word, head in HEADS.items())
        if not cells.strip():
            continue  # a part of inputs alone
        lines.append(f"{part or 'all':<{width}}{cells}".rstrip())
    more = "table.txt and report.html hold each number, its verdict and the reason."
    return "\n".join([*in_short(data), "", *lines, "", *fill(verdicts.RULE, WIDTH).splitlines(), "", more])


def in_short(data: xr.Dataset) -> list[str]:
    """Return what an examiner asks first, one line for each verdict and what is not counted."""
    entries, counts = list(judged(data)), _counts(data)
    differ = [(verdicts.share_off(row), row) for _, row, said in entries if said.word == verdicts.DIFFERS]
    off = sorted(differ, key=lambda entry: abs(entry[0]))
    near = sum(0.0 < abs(share) <= NEAR for share, _ in off)
    far = [
        f"{verdicts.in_percent(share)}: {row.quantity}, {number(row.computed)} for {row.thesis}" for share, row in off
    ]
    corrected = sum(said.word == verdicts.MISPRINT and part == EQUATIONS for part, _, said in entries)
    apart = sum(said.detail.startswith(verdicts.AS_FAR) for _, _, said in entries)
    against = sum(said.word == verdicts.CONDITION and verdicts.CONTRADICTS in said.detail for _, _, said in entries)
    words = [said.word for _, _, said in entries]
    quick = " (a quick run, whose coarser studies change a few verdicts)" if data.attrs.get("quick") else ""
    return [
        f"{sum(counts.values())} numbers and statements of the thesis{quick}:",
        f"- {counts[verdicts.REPRODUCED]} are reproduced, in the printed digits or within what the rules allow.",
        f"- {counts[verdicts.CONDITION]} are under a condition that is named, such as gravity or a loss.",
        f"  {apart} of these lie as far off as the thesis's own theory and experiment.",
        f"  {against} of these need an input that contradicts another printed one.",
        f"- {counts[verdicts.DIFFERS]} differ, {near} of them by at most {100.0 * NEAR:g} %.",
        *(f"  {line}" for line in reversed(far[-FARTHEST:])),
        f"- {counts[verdicts.MISPRINT]} are misprints, {corrected} of them equations; the corrected form agrees.",
        f"- {counts[verdicts.UNDEFINED]} are not defined: without an input that the text lacks, none can be computed.",
        f"{words.count(verdicts.INPUT_ONLY)} inputs and {words.count(verdicts.READING)} other readings are listed, "
        "not counted.",
    ]


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return how many verdicts of each kind every part has; and ours over the thesis's number, by part."""
    bars, (axis,) = draw.panels(1, width=7.0, height=4.6)
    counts, left = [_counts(data, part) for part in PARTS], np.zeros(len(PARTS))
    for word in verdicts.VERDICTS:
        widths = [of_part[word] for of_part in counts]
        axis.barh(range(len(PARTS)), widths, left=left, color=SHADES[word], label=word, height=0.7)
        left += widths
    axis.set_axisbelow(True)
    axis.set(xlabel="numbers and statements", xlim=(0.0, 1.04 * float(left.max())))
    ratios, (scale,) = draw.panels(1, width=7.0, height=4.6)
    for word in verdicts.VERDICTS[:-1]:
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
