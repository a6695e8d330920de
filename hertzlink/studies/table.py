"""The rows of a study: what is expected, from files of data, compared with ours, and their table as text."""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import zip_longest
from math import floor, log10
from pathlib import Path
from textwrap import wrap
from types import MappingProxyType
from typing import Any, NamedTuple

WIDTH = 80  # Columns of a table.
NUMBER_WIDTH = 14  # Largest width of a number in columns; longer text is wrapped.
GAP, INDENT = "  ", "    "
MARK = "*"
FOOTNOTE = f"{MARK} compared with theory, as the thesis prints no number"
OF_THESIS = "Numbered equations, figures, tables and sections are those of the thesis."
NUMBERED = re.compile(r"\b(equations?|figures?|sections?|[Tt]ables?) \d+\.\d")
# Allowed for the thesis's simulations: its two models of one wave differ by 0.9 and 1.3 % (sections 3.3.2 and 3.4).
SIMULATED = 0.01
# Allowed for its experiments: the scatter that it prints with its measured speeds (sections 5.3.2 and 5.3.3).
MEASURED = 0.05
TIMED = 0.01  # Allowed for its measured TOF: the scatter that it prints with it (section 6.1.2).
SIMILAR = 0.02  # Curves that differ by less lie on one another in a printed figure.
# What the thesis's words allow, relatively, or of the incident wave.
WORDS = dict.fromkeys(("similar", "good agreement", "very good agreement", "excellent agreement"), SIMILAR) | {
    "about 0": SIMILAR, "constant": MEASURED, "no significant change": MEASURED, "none": MEASURED,
}  # fmt: skip
# For numbers that the thesis uses without saying where they come from: there is nothing to reproduce.
INPUT = float("nan")


class Row(NamedTuple):
    """One comparison. Numbers are in `unit`; a text replaces a value that is not a number, or is a fraction such as
    "1/6".

    thesis: what the thesis prints, and nothing else; empty if it prints nothing. computed: what hertzlink simulated, or
    computed if the quantity is itself the result of an equation. theory: what hertzlink computed from an equation, or
    from a fit that the thesis prints. within: how far apart the thesis's number and ours may lie, relatively, apart
    from the digits that it prints: SIMULATED, MEASURED, TIMED, INPUT, or 0 for what follows from an equation.
    otherwise: ours under other conditions, by their names. holds: whether a statement without a number holds.
    corrected: what must stand there by the same author's other numbers or equations, if the printed one contradicts
    them. missing: the input that the text does not give, if the number cannot be computed without it. provided: the
    condition under which a statement holds that does not hold in general. number: common to rows that read one printed
    number in several ways. of: common to the theory, simulation and experiment of one quantity, whose printed numbers
    span `spread`. against: what the thesis prints elsewhere and the conditions contradict.
    """

    quantity: str
    thesis: float | str
    computed: float | str
    unit: str = ""
    reason: str = ""
    theory: float | str = ""
    within: float = 0.0
    otherwise: Mapping[str, float | str] = MappingProxyType({})
    holds: bool | None = None
    corrected: float | str = ""
    missing: str = ""
    provided: str = ""
    number: str = ""
    of: str = ""
    against: str = ""
    spread: str = ""


# How far a printed number and ours may lie apart, by what it comes from; none for what follows from an equation.
SCATTER = {"": 0.0, "simulation": SIMULATED, "experiment": MEASURED, "time": TIMED, "input": INPUT}
Named = dict[str, Any]  # What stands in the name of a row, and its theory, by name.


@dataclass(frozen=True)
class Expected:
    """A row of a table: a printed number or statement, or the words of what nobody printed.

    ours: what hertzlink has instead, where no study computes it. scatter: what it comes from, a key of SCATTER. source:
    where it stands. reason: why ours differs, with a place {} for each value that a run gives. quantity: its name in
    the table where it is not the key of the entry. The others: as of a Row.
    """

    value: float | str = ""
    source: str = ""
    ours: float | str = ""
    unit: str = ""
    scatter: str = ""
    reason: str = ""
    quantity: str = ""
    corrected: float | str = ""
    missing: str = ""
    provided: str = ""
    number: str = ""
    of: str = ""
    against: str = ""


@dataclass(frozen=True)
class Rows:
    """The rows of one part of files of data, which lie here or at absolute paths."""

    part: str
    files: tuple[str, ...] = ("thesis.toml", "rows.toml")

    @property
    def entries(self) -> Mapping[str, Expected]:
        """The expected numbers, by name."""
        return {name: entry for file in self.files for name, entry in expected(file).get(self.part, {}).items()}

    def __call__(
        self, name: str, computed: float | str | None, /, *said: object, theory: float | str = "",
        otherwise: Mapping[str, float | str] = MappingProxyType({}), holds: bool | None = None, **labels: object,
    ) -> Row:  # fmt: skip
        """Return the row of an entry. said: the values in its reason; labels: those in its name; the others as of a
        Row."""
        entry = self.entries[name]
        computed = entry.ours if computed is None else computed
        reason = entry.reason.format(*said) if said else entry.reason
        quantity = (entry.quantity or name).format(**labels)
        return Row(
            quantity, entry.value, computed, entry.unit, reason, theory, SCATTER[entry.scatter], otherwise, holds,
            entry.corrected, entry.missing, entry.provided, entry.number, entry.of, entry.against,
        )  # fmt: skip


@cache
def expected(file: str) -> dict[str, dict[str, Expected]]:
    """Return what a file of data holds, by part and by the name of the entry."""
    parts = tomllib.loads((Path(__file__).parent / file).read_text(encoding="utf-8"))
    return {part: {name: Expected(**entry) for name, entry in entries.items()} for part, entries in parts.items()}


def bracketed(low: float, high: float) -> str:
    """Return a value that lies between two runs, with the digits of half their distance, or < high where low is 0."""
    digits = max(0, -floor(log10(0.5 * (high - low))))
    return f"{low:.{digits}f} to {high:.{digits}f}" if low > 0.0 else f"< {high:.{digits}f}"


def span(values: Sequence[float], form: str = ".3f") -> str:
    """Return the first and the last of some values."""
    return f"{values[0]:{form}} to {values[-1]:{form}}"


def text(rows: Sequence[Row]) -> str:
    """Return the rows as a plain table of 80 columns, each with its reason below it.

    The column of theory exists only if a row has one. The difference is relative to the thesis's number, or to that of
    theory, with a mark, if the thesis prints none.
    """
    head, cells = head_and_cells(rows)
    widths = [min(NUMBER_WIDTH, max(len(line[i]) for line in (head, *cells))) for i in range(1, len(head))]
    widths = [WIDTH - sum(widths) - len(GAP) * len(widths), *widths]
    lines = [*_wrapped(head, widths), "-" * WIDTH]
    for row, line in zip(rows, cells, strict=True):
        lines += _wrapped(line, widths)
        lines += wrap(row.reason, WIDTH, initial_indent=INDENT, subsequent_indent=INDENT)
    if below := footnotes(rows):
        lines += ["", *below]
    return "\n".join(line.rstrip() for line in lines)


def footnotes(rows: Sequence[Row]) -> list[str]:
    """Return what stands below the table."""
    notes = [FOOTNOTE] if any(line[-1].endswith(MARK) for line in head_and_cells(rows)[1]) else []
    return [*notes, OF_THESIS] if any(NUMBERED.search(f"{row.quantity} {row.reason}") for row in rows) else notes


def head_and_cells(rows: Sequence[Row]) -> tuple[list[str], list[list[str]]]:
    """Return the names of the columns, and the text of each cell of each row, without reasons."""
    head = ["quantity", "thesis", "theory", "hertzlink", "difference"]
    cells = [
        [", ".join(filter(None, (r.quantity, r.unit))), number(r.thesis, 6), number(r.theory), number(r.computed)]
        + [_difference(r)]
        for r in rows
    ]
    if not any(line[2] for line in cells):
        for line in (head, *cells):
            del line[2]
    return head, cells


def _wrapped(cells: Sequence[str], widths: Sequence[int]) -> list[str]:
    """Return one row, each cell wrapped in its column: the first to the left, numbers to the right."""
    columns = [wrap(cell, width) for cell, width in zip(cells, widths, strict=True)]
    return [
        GAP.join([line[0].ljust(widths[0]), *map(str.rjust, line[1:], widths[1:])])
        for line in zip_longest(*columns, fillvalue="")
    ]


def number(value: float | str, digits: int = 4) -> str:
    """Return a number with at most `digits` digits; those of the thesis have up to six."""
    return value if isinstance(value, str) else f"{value:.{digits}g}"


def _difference(row: Row) -> str:
    printed, predicted, computed = (_amount(value) for value in (row.thesis, row.theory, row.computed))
    expected = predicted if printed is None else printed
    if not expected or computed is None:
        return ""
    percent = 100.0 * (computed / expected - 1.0)
    digits = 1 if abs(percent) >= 0.05 else 2 if abs(percent) >= 0.005 else 3
    shown = f"{percent:+z.{digits}f} %".replace("+0.000", "+0.0")
    return shown + (MARK if printed is None else "")


def _amount(value: float | str) -> float | None:
    """Return a number, a text that is one, or nothing."""
    try:
        return float(Fraction(value)) if isinstance(value, str) else float(value)
    except ValueError:
        return None
