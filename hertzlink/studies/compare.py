"""Numbers of a study beside those that the thesis prints, which are lines of `printed.csv`: one rule for all.

A printed number stands for all numbers that are rounded or truncated to it. TOLERANCE allows for more, by kind: the
scatter between the thesis's own simulations, and that of its experiments.
"""

import csv
from collections.abc import Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from functools import cache
from itertools import zip_longest
from math import floor, inf, isnan, log10
from pathlib import Path
from textwrap import wrap
from typing import NamedTuple

Range = tuple[float, float]
Case = float | Range | bool | str
Ours = Case | Mapping[str, Case]
"""A number, a range, whether a statement holds, or words; or one of these for each condition, by its name."""

AGREES, DIFFERS, MISPRINT = VERDICTS = ("agrees", "differs", "misprint")
HEAD = {"number": 38, "thesis": 14, "hertzlink": 14, "verdict": 8}  # Columns of a table: their widths in letters.
WIDTH, INDENT = 80, "    "  # Letters in a line of a table; what a remark begins with.

SIMULATION_ERROR = 1e-3  # Error of hertzlink's runs, where a tolerance is allowed.
TOLERANCE = {"equation": 0.0, "simulation": 0.01, "experiment": 0.05, "time": 0.01, "about": 0.11}
"""Relative tolerances, by the origin of the number. Words, such as "good agreement", have a range of their own."""
NOT_JUDGED = {
    "input": "an input of the thesis, which is not judged",
    "undefined": "not defined in the thesis",
    "other": "not the quantity of the thesis",
}
"""Kinds of printed numbers without a verdict, and why."""


class Number(NamedTuple):
    """A value of a study. Of several conditions the first is the study's own; the thesis leaves the others open.

    unit: only where the thesis prints nothing; otherwise `printed.csv` has it.
    """

    name: str
    ours: Ours
    remark: str = ""
    unit: str = ""


class Printed(NamedTuple):
    """A line of `printed.csv`: what the thesis prints of a number, where, and its origin, a key of TOLERANCE.

    low, high: as printed, with all digits; equal for a single number, empty at an end that is open. words: what the
    thesis prints instead of a number. corrected: the value that follows from the same author's other numbers. span: the
    least and the greatest number that the thesis prints for the same quantity, by theory, simulation and experiment.
    """

    study: str
    number: str
    low: str
    high: str
    words: str
    unit: str
    source: str
    kind: str
    corrected: str
    span: str
    remark: str

    @property
    def ranges(self) -> tuple[Range, ...]:
        """The numbers that round to the digits, with the tolerance of the kind; those that are truncated to them."""
        low, high = exact_range(self.low, self.high)
        if self.kind not in TOLERANCE:
            return ((low, high),)
        cut_off = (low, high + last_digit(self.high))
        if self.kind != "about":
            low, high = rounded(self.low, self.high)
        share = TOLERANCE[self.kind] + (SIMULATION_ERROR if TOLERANCE[self.kind] else 0.0)
        widened = (low - share * abs(low), high + share * abs(high))
        return (widened,) if self.corrected or self.kind == "about" else (widened, cut_off)


class Row(NamedTuple):
    """A line of a table. `verdict` is empty where nothing is judged."""

    number: str
    unit: str
    thesis: str
    hertzlink: str
    verdict: str
    remark: str

    @property
    def cells(self) -> tuple[str, str, str, str]:
        return ", ".join(filter(None, (self.number, self.unit))), self.thesis, self.hertzlink, self.verdict


@cache
def printed(study: str) -> dict[str, Printed]:
    """Return what the thesis prints for a study, by the name of the number."""
    with Path(__file__).with_name("printed.csv").open(encoding="utf-8", newline="") as file:
        return {row["number"]: Printed(**row) for row in csv.DictReader(file) if row["study"] == study}


def compare(study: str, numbers: Iterable[Number]) -> list[Row]:
    """Return the numbers of a study beside those of the thesis, with verdicts."""
    rows = []
    for number in numbers:
        line, (first, *others) = printed(study).get(number.name), as_cases(number.ours).items()
        ours, conditions = shown(first[1]), [f"{name}: {shown(case)}" for name, case in others]
        if line is None:
            unit, thesis, word, remarks = number.unit, "", "", [number.remark]
        else:
            word, why = verdict(line, number.ours)
            source = line.source if word else f"{line.source}: {NOT_JUDGED[line.kind]}"
            conditions = [one for one in conditions if why != f"with {one}"]
            if line.kind == MISPRINT == word:
                ours = line.corrected
            unit, thesis = line.unit, line.words or " to ".join(dict.fromkeys((line.low, line.high)))
            remarks = [source, why, number.remark, line.remark]
        rows.append(Row(number.name, unit, thesis, ours, word, "; ".join(filter(None, [*remarks, *conditions]))))
    return rows


def verdict(line: Printed, ours: Ours) -> tuple[str, str]:
    """Return the verdict on a number, and the condition under which it agrees, the right number, or the difference.

    The range of the first condition must lie within the printed one; that of any other must overlap it.
    """
    if line.kind in NOT_JUDGED:
        return "", ""
    if line.kind == MISPRINT:  # ours: whether the printed form fails a check that the corrected one passes
        return (MISPRINT, f"corrected: {line.corrected}") if ours is True else (DIFFERS, "")
    cases = as_cases(ours)
    for place, (name, case) in enumerate(cases.items()):
        # If digits are truncated, "0.3" reaches up to 0.4: a range that begins there does not agree.
        first, *cut_off = line.ranges
        if agrees(first, case, whole=place == 0) or any(agrees(expected, case) for expected in cut_off):
            return AGREES, f"with {name}: {shown(case)}" if place else ""
    own, right = next(iter(cases.values())), rounded(line.corrected, line.corrected)
    if line.corrected and any(agrees(right, case) for case in cases.values()):
        return MISPRINT, f"corrected: {line.corrected}"
    if line.span and agrees(exact_range(*line.span.split(" to ")), own):
        return AGREES, f"within the range that the thesis prints for it, {line.span}"
    if isinstance(own, bool | str):
        return DIFFERS, ""
    # The distance of hertzlink's value from the printed number, at the end that is farther away.
    ends = zip((line.low, line.high), as_range(own), (min, max), strict=True)
    known = [(float(Fraction(end)), value, outer) for end, value, outer in ends if end]
    off = max((outer(value, end) / end - 1.0 for end, value, outer in known if end), key=abs, default=0.0)
    return DIFFERS, f"by {float(f'{100.0 * off:.2g}'):+g} %" if off else ""


def agrees(expected: Range, ours: Case, whole: bool = True) -> bool:
    """Return whether hertzlink's value lies in the expected range, as a `whole` or in part, or covers all of it."""
    if isinstance(ours, bool | str):
        return ours is True
    low, high = as_range(ours)
    if whole:
        return (expected[0] <= low and high <= expected[1]) or low <= expected[0] <= expected[1] <= high
    return expected[0] <= high and low <= expected[1]


def as_cases(ours: Ours) -> dict[str, Case]:
    """Return hertzlink's values by condition; a single one has no name."""
    return dict(ours) if isinstance(ours, Mapping) else {"": ours}


def as_range(ours: float | Range) -> Range:
    return (min(ours), max(ours)) if isinstance(ours, tuple) else (float(ours), float(ours))


def exact_range(low: str, high: str) -> Range:
    """Return the range between two texts; an empty one is an open end."""
    return float(Fraction(low)) if low else -inf, float(Fraction(high)) if high else inf


def rounded(low: str, high: str) -> Range:
    """Return the numbers that round to the digits of two texts."""
    ends = exact_range(low, high)
    return ends[0] - 0.5 * last_digit(low), ends[1] + 0.5 * last_digit(high)


def last_digit(text: str) -> float:
    """Return the size of one unit in the last digit; that of rounding errors for a fraction."""
    if not text or "/" in text:
        return 1e-9 if text else 0.0
    mantissa, _, power = text.partition("e")
    return 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))


def shown(case: Case) -> str:
    if isinstance(case, str):
        return case
    if isinstance(case, bool):
        return "holds" if case else "does not hold"
    low, high = (f"{end:.4g}" for end in as_range(case))
    return "none" if isnan(as_range(case)[0]) else low if low == high else f"{low} to {high}"


def bracketed(low: float, high: float) -> str:
    """Return what lies between two runs, with the digits of half their distance; < high where low is 0."""
    digits = max(0, -floor(log10(0.5 * (high - low))))
    return f"{low:.{digits}f} to {high:.{digits}f}" if low > 0.0 else f"< {high:.{digits}f}"


def counts(rows: Iterable[Row]) -> dict[str, int]:
    words = [row.verdict for row in rows]
    return {word: words.count(word) for word in VERDICTS}


def in_words(rows: Iterable[Row]) -> str:
    """Return how many numbers agree, differ and are misprints; empty where nothing is judged."""
    plural = {AGREES: "agree", DIFFERS: "differ", MISPRINT: "misprints"}
    found = counts(rows).items()
    return ", ".join(f"{count} {plural[word] if count > 1 else word}" for word, count in found if count)


def answer(rows: Sequence[Row]) -> str:
    """Return the answer of a study: how many numbers agree; where nothing is judged, its first number."""
    if said := in_words(rows):
        return f"Numbers of the thesis: {said}."
    return f"{rows[0].number}: {rows[0].hertzlink} {rows[0].unit}".rstrip() + "."


def table(rows: Iterable[Row]) -> str:
    """Return the rows as text, each with its remark below it."""

    def laid_out(cells: Iterable[str]) -> Iterator[str]:
        columns = [wrap(cell, width) for cell, width in zip(cells, HEAD.values(), strict=True)]
        for number, *others in zip_longest(*columns, fillvalue=""):
            right = map(str.rjust, others, [*HEAD.values()][1:])
            yield "  ".join([number.ljust(HEAD["number"]), *right]).rstrip()

    lines = [*laid_out(HEAD), "-" * WIDTH]
    for row in rows:
        lines += [*laid_out(row.cells), *wrap(row.remark, WIDTH, initial_indent=INDENT, subsequent_indent=INDENT)]
    return "\n".join(lines)
