"""An oscilloscope's text file as numbers: encodings, delimiters, decimal commas, unit rows, saturated samples."""

import csv
import re
from collections.abc import Sequence
from itertools import chain, pairwise
from pathlib import Path
from typing import NamedTuple

import numpy as np

from coupling.results.sensor import FEWEST_SAMPLES
from structures.structure import Vector

DELIMITERS = (";", "\t", ",", None)

SATURATED = re.compile(r"([+-]?)\s*(∞|inf|infinity|over|overflow|clip|clipped)", re.IGNORECASE)
"""What scopes print for a sample beyond their range."""

UNITS = {
    "s": ("s", "sec", "second", "seconds"),
    "ms": ("ms", "millisecond", "milliseconds"),
    "us": ("us", "µs", "\u03bcs", "microsecond", "microseconds"),
    "ns": ("ns", "nanosecond", "nanoseconds"),
    "V": ("V", "volt", "volts"),
    "mV": ("mV", "millivolt", "millivolts"),
    "N": ("N", "newton", "newtons"),
}
"""Names of the units in header rows. Single words are compared without regard to case; symbols are not."""

TIME_UNITS, FORCE_UNITS = ("s", "ms", "us", "ns"), ("V", "mV", "N")

MOST_KEYS = 40
"""Lines at the beginning that may hold "Vertical Units,V" before data or within them, as Tektronix scopes write."""


LONGEST_LINE = 80
"""Characters of a line in a message."""


class ScopeTable(NamedTuple):
    """The columns asked for, time first; inf marks a saturated sample."""

    values: Vector
    lines: list[int]
    units: list[str | None]
    """What the header says, for each column; None where it says nothing."""


def read_table(path: Path, columns: Sequence[int]) -> ScopeTable:
    """The numbers of each sample, a column each, the line each stands on, and the units that the file names."""
    text = decoded(path.read_bytes()).replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    while lines and not lines[-1].strip():
        lines.pop()
    starts = ((i, d) for i, line in enumerate(lines) for d in DELIMITERS if _numbers(line, d, columns) is not None)
    first, delimiter = next(starts, (len(lines), None))
    if first == len(lines):
        raise ValueError(f"{path}: {_unreadable(lines, columns)}")
    rows, cells = [], len(_cells(lines[first], delimiter))
    for i, line in enumerate(lines[first:], start=first + 1):
        numbers = _numbers(line, delimiter, columns)
        if numbers is None or len(_cells(line, delimiter)) < cells:
            wanted = f"must hold {cells} columns, with numbers in {list(columns)}"
            raise ValueError(f"{path}, line {i}: {line[:LONGEST_LINE]!r} {wanted}")
        if np.isnan(numbers).any():
            raise ValueError(f"{path}, line {i}: {line[:LONGEST_LINE]!r} must hold finite numbers")
        rows.append(numbers)
    if len(rows) < FEWEST_SAMPLES:
        raise ValueError(f"{path}: holds {len(rows)} samples, must hold {FEWEST_SAMPLES} or more")
    if not text.endswith("\n") and len(lines[-1]) < min(map(len, lines[first:-1])):
        raise ValueError(
            f"{path}, line {len(lines)}: {lines[-1]!r} looks cut off: shorter than all others, no line end"
        )
    header = [_cells(line, delimiter) for line in lines[:first]]
    keys = [_cells(line, delimiter) for line in lines[:MOST_KEYS]]
    units = [_unit(header, keys, column, TIME_UNITS if k == 0 else FORCE_UNITS) for k, column in enumerate(columns)]
    values = np.array(rows)
    if (scale := _start_and_increment(header)) and (np.diff(values[:, 0]) >= 1.0).all():
        values[:, 0] = scale[0] + scale[1] * values[:, 0]
        units[0] = "s"
    return ScopeTable(values, list(range(first + 1, len(lines) + 1)), units)


def _unreadable(lines: list[str], columns: Sequence[int]) -> str:
    """What a file holds, of which no line has numbers in the columns, and what it must hold."""
    wanted = f"must hold a line for each sample, with numbers in columns {', '.join(map(str, sorted(columns)))}"
    kept = [(i, line) for i, line in enumerate(lines, start=1) if line.strip()]
    if not kept:
        return f"is empty; {wanted}, counted from 0"
    i, line, numbers = max(((i, line, _columns(line)) for i, line in kept[:MOST_KEYS]), key=lambda one: len(one[2]))
    if not numbers:
        return f"holds no numbers, but text such as {line[:LONGEST_LINE]!r} in line {i}; {wanted}, counted from 0"
    known = f"column{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"
    comma = "; where decimals have commas, columns need another delimiter" if "," in line and "." not in line else ""
    return f"line {i}, {line[:LONGEST_LINE]!r}, has numbers in {known} only; {wanted}, counted from 0{comma}"


def _columns(line: str) -> list[int]:
    """The columns of a line that hold numbers, with the delimiter that gives the most; none of a line of words."""
    found: list[list[int]] = [[]]
    for delimiter in DELIMITERS:
        cells = _cells(line, delimiter)
        numbers = [k for k, cell in enumerate(cells) if _is_number(cell)]
        found.append(numbers if 2 * len(numbers) >= len(cells) else [])
    return max(found, key=len)


def _is_number(cell: str) -> bool:
    try:
        _number(cell)
    except ValueError:
        return False
    return True


def decoded(content: bytes) -> str:
    """Text in UTF-8 or UTF-16, with or without a byte order mark, else in Latin-1."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    beginning = content[:200]
    if beginning.count(0) > len(beginning) // 3:
        big = beginning[::2].count(0) > beginning[1::2].count(0)
        return content.decode("utf-16-be" if big else "utf-16-le", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("latin-1")


def _cells(line: str, delimiter: str | None) -> list[str]:
    if '"' in line and delimiter is not None:
        return next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
    return line.split(delimiter)


def _numbers(line: str, delimiter: str | None, columns: Sequence[int]) -> list[float] | None:
    """The numbers in these columns, the time first; None where one of them is no number."""
    cells = _cells(line, delimiter)
    try:
        numbers = [_number(cells[column]) for column in columns]
    except (ValueError, IndexError):
        return None
    return None if np.isinf(numbers[0]) else numbers


def _number(cell: str) -> float:
    """A number with a decimal point or comma; ±inf for a sample beyond the scope's range."""
    try:
        return float(cell)
    except ValueError:
        if saturated := SATURATED.fullmatch(cell.strip()):
            return float(f"{saturated[1]}inf")
        if cell.count(",") != 1:
            raise
        return float(cell.replace(",", "."))


def _unit(header: list[list[str]], keys: list[list[str]], column: int, known: Sequence[str]) -> str | None:
    """The unit of a column: of the nearest row above the data that names one, or of a line such as Vertical Units,V."""
    key = "horizontal units" if known is TIME_UNITS else "vertical units"
    cells = (row[column] for row in reversed(header) if len(row) > column)
    named = (row[1] for row in keys if len(row) > 1 and row[0].strip().lower() == key)
    found = (_known(cell, known) for cell in chain(cells, named))
    return next((unit for unit in found if unit), None)


def _known(cell: str, known: Sequence[str]) -> str | None:
    """The unit in "(ms)", "Time [ms]" or "Second"."""
    bracketed = re.search(r"[(\[]\s*([^()\[\]]+?)\s*[)\]]\s*$", cell)
    word = bracketed[1] if bracketed else cell.strip().strip('"')
    for unit in known:
        if word in UNITS[unit] or (len(word) > 2 and word.lower() in UNITS[unit]):
            return unit
    return None


def _start_and_increment(header: list[list[str]]) -> tuple[float, float] | None:
    """First time and interval, s, of a Rigol scope's file, whose first column counts the samples."""
    for names, values in pairwise(header):
        words = [name.strip().lower() for name in names]
        if "start" in words and "increment" in words:
            try:
                start, increment = (_number(values[words.index(word)]) for word in ("start", "increment"))
            except (ValueError, IndexError):
                return None
            return start, increment
    return None
