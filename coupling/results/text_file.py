"""An oscilloscope's text file as columns of numbers: encodings, delimiters, decimal commas, words in their place."""

import csv
import re
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from decimal import Decimal, InvalidOperation
from functools import partial
from itertools import compress
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from coupling.results.binary_formats import refuse_binary
from coupling.results.sensor_trace import FEWEST_SAMPLES
from coupling.results.text_header import Header
from structures.checks import count_of
from structures.structure import Vector

DELIMITERS = (";", "\t", "|", ",", None)

MINUS = str.maketrans({"−": "-", "–": "-", "‐": "-", "‑": "-", "﹣": "-", "－": "-", "\xa0": " ", "\u202f": " "})
"""Signs and blanks of typeset numbers."""

HUGE = 1e30
"""Scopes print 9.9E+37 and the like for a sample beyond their range."""

LONGEST_LINE = 80
"""Characters of a line in a message."""

PIECE = 1000
"""Lines that are read at once, unless one of them holds something else than plain numbers."""

BARE = '" \t'
"""What may stand around a number."""

TRIED = 400
"""Lines that the delimiter is found from."""

MOST_KEYS = 60
"""Lines at the beginning that may state something."""

WINDOW, WINDOWS = 40, 3
"""Lines at some places in which a column of times increases."""

FEW, FEW_SHARE = 20, 0.01
"""So many damaged lines, or this part of all, are left out; a file with more is refused."""

OF_NUMBER = re.compile(r"[-+\d.,eE]+")
COMMA_GROUPS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?")
DECIMAL_COMMA = re.compile(r"[-+]?(\d{1,3}([. '’]\d{3})+|\d*),\d*([eE][-+]?\d+)?")
BLANK_GROUPS = re.compile(r"(?<=\d)[ '’](?=\d{3})")
"""Thousands."""

LETTER = re.compile(r"[^\W\dDEde_]")
"""One that no number has."""

LOOSE_NUMBER = re.compile(r"[-+]?([1-9]\d{0,2}([.,' ])\d{3}(\2\d{3})*|\d*)([.,]\d*)?([eE][-+]?\d+)?")
"""A number, whatever its commas mean."""

DATE_OR_CLOCK = re.compile(
    r"(?:.*[ T])?(\d{1,2}):(\d\d):(\d\d(?:[.,]\d+)?)\s*(?:Z|UTC|([AP])M|[-+]\d\d:?\d\d)?$", re.IGNORECASE
)

SHIFTED = re.compile("[\u3000\u3100\u3200\u3300\u3400\u3500\u3600\u3700\u3800\u3900]")
"""What the digits of UTF-16 become where a byte is missing before them: signs that hardly occur in a text."""

MOST_SHIFTED = 5


class Samples(NamedTuple):
    """Numbers by column, NaN for what is no number, with the place and line of each, and the lines that are none."""

    header: Header
    columns: dict[int, Vector]
    places: NDArray[np.int64]
    lines: NDArray[np.int64]
    no_samples: list[tuple[int, str]]
    blank: int


class ScopeFile:
    """The text of a file: its lines that are not blank, and how cells are separated."""

    def __init__(self, path: Path, columns: Sequence[int], content: bytes) -> None:
        """Hold the file's bytes; columns: those that are asked for. A ValueError where no line holds numbers there."""
        self.path = path
        refuse_binary(path, content)
        text = decoded(content)
        if len(SHIFTED.findall(text)) > MOST_SHIFTED:
            raise ValueError(f"{path}: is text in UTF-16 that lost or gained a byte; export it again, as UTF-8")
        text = text if text.isascii() else text.translate(MINUS)
        text = text.replace("\r\n", "\n").replace("\r", "\n").replace("\0", "")
        every = (re.sub(r"(?<=[^\n])\x1a", "\n\x1a", text) if "\x1a" in text else text).split("\n")
        self.numbers = [*compress(range(1, len(every) + 1), map(str.strip, every))]
        self.lines = [every[i - 1] for i in self.numbers]
        self._is_cut = bool(every[-1].strip())
        self._quoted, self._doubled = '"' in text, False
        tried = self._spread(TRIED)
        scores = [sum(_share(_split(line, d), columns) for line in tried) for d in DELIMITERS]
        if not max(scores):
            raise ValueError(f"{path}: {self._unreadable(columns)}")
        self.delimiter = DELIMITERS[int(np.argmax(scores))]
        rows = [_split(line, self.delimiter) for line in tried]
        self.width = Counter(len(row) for row in rows if _holds(row, columns)).most_common(1)[0][0]
        self._doubled = self.delimiter == "," and self._halves(rows)
        if self._doubled:
            self.width //= 2
        self._with_decimal_commas = {c for c in range(self.width) if self._has_decimal_commas(rows, c)}
        begins = Counter(_is_word(row[0]) for row in rows if _holds(row, columns))
        self._begins_with_words = begins[True] > begins[False]
        self._with_grouping_commas: dict[int, bool] = {}

    @property
    def states_interval(self) -> bool:
        """True if one of the first lines states the interval between samples."""
        return bool(self._header(0).intervals())

    @property
    def increasing(self) -> list[int]:
        """The columns that increase from line to line, as times and numbers of samples do."""
        places = np.linspace(0, max(0, len(self.lines) - WINDOW), WINDOWS + 2).astype(int)[1:-1]
        windows = [self._rows(self.lines[place : place + WINDOW]) for place in places]
        rising = []
        for column in range(self.width):
            pieces = [_column(rows, column) for rows in windows]
            numbers = [_in_range(_or_clocks(_numbers(cells, self._commas_group), cells)) for cells in pieces]
            rises = [rise for column in numbers if (rise := _rise(column[np.isfinite(column)])) > 0.0]
            if sum(rise < 1.5 * min(rises) for rise in rises) >= WINDOWS - 1:  # lost lines may lie in a window
                rising.append(column)
        return rising

    def samples(self, columns: Sequence[int], times: Sequence[int]) -> Samples:
        """Return the numbers in these columns. times: those of them that hold times: a sample has a number there."""
        values = self._values(columns)
        for column in times:
            if np.isnan(values[column]).sum() > 0.5 * len(self.lines):
                values[column] = _or_clocks(values[column], self.texts(column))
        values = {column: _in_range(values_of_column) for column, values_of_column in values.items()}
        self._forget_damaged_cells(values, columns)
        filled: NDArray[np.bool_] = np.any(np.isfinite(np.stack([values[c] for c in (times or columns)])), axis=0)
        first, last = (int(filled.argmax()), filled.size - int(filled[::-1].argmax())) if filled.any() else (0, 0)
        if not times:
            first = self._after_entries(first)
            filled[:first] = False
            # Without times each line is a sample, also where its numbers are missing.
            filled[first:last] = True
        lost = (first + np.flatnonzero(~filled[first:])).tolist()
        inside = [i for i in lost if i < last]
        if len(inside) > max(FEW, FEW_SHARE * (last - first)):
            wanted = f"must hold {self.width} columns, with numbers in {sorted(columns)}"
            raise ValueError(
                f"{self.path}, line {self.numbers[inside[0]]}: {self.lines[inside[0]][:LONGEST_LINE]!r} {wanted}"
            )
        if int(filled.sum()) < FEWEST_SAMPLES:
            raise ValueError(
                f"{self.path}: holds {count_of(int(filled.sum()), 'sample')}, must hold {FEWEST_SAMPLES} or more"
            )
        lines = np.array(self.numbers)
        header = self._header(first)
        kept_rows = filled.nonzero()[0]
        return Samples(
            header, {c: column[kept_rows] for c, column in values.items()}, kept_rows, lines[kept_rows],
            [(self.numbers[i], self.lines[i]) for i in lost],
            int(lines[last - 1] - lines[first] + 1 - (last - first)),
        )  # fmt: skip

    def _after_entries(self, place: int) -> int:
        """Return the first line, from this one on, that is no entry of the header such as "Points,1000"."""
        if not self._begins_with_words:
            for k, row in enumerate(self._rows(self.lines[place : place + MOST_KEYS])):
                if not _is_word(row[0]):
                    return place + k
        return place

    def texts(self, column: int, places: Iterable[int] | None = None) -> list[str]:
        """Return the cells of a column: of lines at some places, or of all."""
        lines = self.lines if places is None else [self.lines[i] for i in places]
        pieces = (lines[first : first + PIECE] for first in range(0, len(lines), PIECE))
        return [cell for piece in pieces for cell in _column(self._rows(piece), column)]

    def _values(self, columns: Sequence[int]) -> dict[int, Vector]:
        """Return the numbers in these columns: of plain lines at once, of others cell by cell."""
        values = {column: np.empty(len(self.lines)) for column in columns}
        for first in range(0, len(self.lines), PIECE):
            piece = self.lines[first : first + PIECE]
            numbers = self._plain_numbers(piece, columns)
            if numbers is None:
                rows = self._rows(piece)
                numbers = {c: _numbers(_column(rows, c), partial(self._group, c)) for c in columns}
            for column, read in numbers.items():
                values[column][first : first + PIECE] = read
        return values

    def _plain_numbers(self, lines: list[str], columns: Sequence[int]) -> dict[int, Vector] | None:
        """Return the numbers in these columns, None where a line holds something else."""
        if self._doubled:
            return None
        numbers: dict[int, Vector] = {}
        for its in (set(columns) & self._with_decimal_commas, set(columns) - self._with_decimal_commas):
            if not its:
                continue
            pointed = [line.replace(",", ".") for line in lines] if its <= self._with_decimal_commas else lines
            try:
                rows = np.loadtxt(pointed, delimiter=self.delimiter, comments=None, usecols=[*its], ndmin=2)
            except ValueError:
                return None
            if len(rows) < len(lines):
                return None
            numbers |= zip(its, rows.T, strict=True)
        return numbers

    def _header(self, above: int) -> Header:
        """Return what the lines above the samples state, and the first ones."""
        first = [_header_cells(line, self.delimiter) for line in self.lines[: max(above, MOST_KEYS)]]
        return Header(first[:above], first[:MOST_KEYS], self.width)

    def _forget_damaged_cells(self, values: dict[int, Vector], columns: Sequence[int]) -> None:
        """Replace by NaN the last cell of a line that is cut off, of few short lines and of a last line without end;
        and the cells of few lines with numbers beyond the others' width, where a line break was lost."""
        widths = np.array(self._widths())
        few = max(FEW, FEW_SHARE * widths.size)
        short = (widths < self.width) & (widths > 0)
        if short.sum() <= few:
            for column in columns:
                values[column][short & (widths == column + 1)] = np.nan
        longer = [i for i in np.flatnonzero(widths > self.width).tolist() if i >= MOST_KEYS]
        if 0 < len(longer) <= few:
            usual = Counter(max(_with_numbers(row), default=-1) for row in self._rows(self._spread(TRIED)))
            beyond = usual.most_common(1)[0][0] + 1
            rows = self._rows([self.lines[i] for i in longer])
            joined = [
                i for i, row in zip(longer, rows, strict=True) if np.isfinite([*map(_loose_number, row[beyond:])]).any()
            ]
            for column in columns:
                values[column][joined] = np.nan
        before = [len(line) for line in self.lines[-20:-1]]
        if self._is_cut and before and len(self.lines[-1]) < min(before):
            for column_values in values.values():
                column_values[-1] = np.nan

    def _widths(self) -> list[int]:
        """Return the number of cells of each line."""
        if self.delimiter is not None and not self._quoted and not self._doubled:
            return [line.count(self.delimiter) + 1 for line in self.lines]
        pieces = (self.lines[first : first + PIECE] for first in range(0, len(self.lines), PIECE))
        return [len(row) for piece in pieces for row in self._rows(piece)]

    def _rows(self, lines: Sequence[str]) -> list[list[str]]:
        """Return the cells of each line."""
        rows = _quoted(lines, self.delimiter) if self._quoted else [line.split(self.delimiter) for line in lines]
        return [_joined(row) for row in rows] if self._doubled else rows

    def _spread(self, most: int) -> list[str]:
        """Return some lines, from all over the file."""
        last = len(self.lines) - 1
        return [self.lines[i] for i in sorted({*np.linspace(0, last, most).astype(int).tolist()}) if last >= 0]

    def _halves(self, rows: list[list[str]]) -> bool:
        """Return whether decimal commas have cut each number of unquoted columns in two, such as "-100,0,0,0540"."""
        if self.width % 2 or self._quoted:
            return False
        full = [row for row in rows if len(row) == self.width and len(_with_numbers(row)) == self.width]
        ends = [cell.strip() for row in full for cell in row[1::2]]
        if (
            not full
            or any("." in cell for row in full for cell in row)
            or not all(re.fullmatch(r"\s*[-+]?\d+\s*", row[0]) for row in full)
            or not all(re.fullmatch(r"\d+([eE][-+]?\d+)?", e) for e in ends)
        ):
            return False
        heads = [row for row in rows[:3] if len(_with_numbers(row)) < len(row)]
        return any(2 * len(row) == self.width for row in heads[-1:]) or any(len(e) > 1 and e[0] == "0" for e in ends)

    def plain(self, cells: list[str]) -> list[str]:
        """Return cells with decimal points, and without commas, points, blanks and apostrophes between thousands."""
        return _plain(cells, self._commas_group(cells))

    def _has_decimal_commas(self, rows: list[list[str]], column: int) -> bool:
        """Return whether one of these cells shows that commas of this column stand before decimals."""
        bare = [cell.strip(BARE) for cell in _column(rows, column) if "," in cell]
        return any(OF_NUMBER.fullmatch(cell) and not COMMA_GROUPS.fullmatch(cell) for cell in bare)

    def _group(self, column: int, cells: list[str]) -> bool:
        """Return whether commas of this column separate thousands, which matters to these cells of it."""
        if column in self._with_decimal_commas or not any("," in cell and not LETTER.search(cell) for cell in cells):
            return False
        if column not in self._with_grouping_commas:
            self._with_grouping_commas[column] = self._commas_group(self.texts(column))
        return self._with_grouping_commas[column]

    def _commas_group(self, cells: list[str]) -> bool:
        """Return whether commas separate thousands: "1,048" among "54". A ValueError where nothing shows it."""
        bare = [cell.strip(BARE) for cell in cells if "," in cell]
        with_commas = [cell for cell in bare if OF_NUMBER.fullmatch(cell)]
        if not with_commas or not all(COMMA_GROUPS.fullmatch(cell) for cell in with_commas):
            return False
        if any("." in cell or cell.count(",") > 1 for cell in with_commas):
            return True
        if any("," not in cell and np.isfinite(_number(cell)) for cell in cells):
            return True
        if self.delimiter == ",":
            raise ValueError(
                f"{self.path}: {with_commas[0]!r} may be {with_commas[0].replace(',', '.')} or "
                f"{with_commas[0].replace(',', '')}; export the trace with decimal points and no commas in numbers"
            )
        return False

    def _unreadable(self, columns: Sequence[int]) -> str:
        """Return what a file holds, of which no line has numbers in the columns, and what it must hold."""
        wanted = f"must hold a line for each sample, with numbers in columns {', '.join(map(str, sorted(columns)))}"
        if not self.lines:
            return f"is empty; {wanted}, counted from 0"
        first = self.lines[:40]
        place = max(range(len(first)), key=lambda k: len(_columns(first[k])))
        line, numbers = first[place], _columns(first[place])
        i, shown = self.numbers[place], repr(line[:LONGEST_LINE])
        if not numbers:
            return f"holds no numbers, but text such as {shown} in line {i}; {wanted}, counted from 0"
        comma = (
            "; where decimals have commas, columns need another delimiter" if "," in line and "." not in line else ""
        )
        delimiter = _delimiter(line)
        width = len(_split(line, delimiter))
        beyond = sorted({column for column in columns if column >= width})
        if beyond:
            above = [_split(cells, delimiter) for cells in first[:place] if not _columns(cells)]
            header = Header([row for row in above if len(row) == width], (), width)
            names = ", ".join(filter(None, map(header.name, range(width))))
            last = f"columns 0 to {width - 1}" if width > 1 else "column 0 only"
            named = f" ({names[:LONGEST_LINE]})" if names else ""
            values = [_loose_number(_split(cells, delimiter)[0]) for cells in first[place:]]
            way_out = "" if _rise(np.array(values)) else "; without times give interval=, and sensors from 0 on"
            return f"has {last}{named}, counted from 0, and no column {beyond[0]}; line {i} is {shown}{comma}{way_out}"
        readable_columns = f"column{'s' * (len(numbers) > 1)} {', '.join(map(str, numbers))}"
        return f"line {i}, {shown}, has numbers in {readable_columns} only; {wanted}, counted from 0{comma}"


def from_first(cells: list[str], finite: NDArray[np.bool_]) -> tuple[Vector, str]:
    """Return the times less the first one, subtracted as decimals, and the text of the first."""
    first = cells[int(finite.argmax())]
    try:
        zero = Decimal(first.strip())
        return np.array(
            [float(Decimal(c.strip()) - zero) if k else np.nan for c, k in zip(cells, finite, strict=True)]
        ), first
    except InvalidOperation:
        values = np.array([_number(cell) for cell in cells])
        return values - values[finite][0], first


def decoded(content: bytes) -> str:
    """Return text in UTF-8 or UTF-16, with or without a byte order mark, else in the code page of Western Windows."""
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    beginning = content[:200]
    if beginning.count(0) > len(beginning) // 3:
        big = beginning[::2].count(0) > beginning[1::2].count(0)
        return content.decode("utf-16-be" if big else "utf-16-le", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def _split(line: str, delimiter: str | None) -> list[str]:
    return _quoted([line], delimiter)[0] if '"' in line else line.split(delimiter)


def _header_cells(line: str, delimiter: str | None) -> list[str]:
    """Return the cells of a line above the samples, which may have another delimiter than these."""
    if delimiter is None or delimiter not in line:
        delimiter = next((mark for mark in DELIMITERS if mark and mark in line), None) or delimiter
    return _split(line, delimiter)


def _quoted(lines: Sequence[str], delimiter: str | None) -> list[list[str]]:
    """Return the cells of lines with quotes; of a line where one opens and is not closed without them."""
    if delimiter is None:
        return [line.split() for line in lines]
    closed = [line if line.count('"') % 2 == 0 else line.replace('"', "") for line in lines]
    try:
        rows = [*csv.reader(closed, delimiter=delimiter, skipinitialspace=True)]
    except csv.Error:
        rows = []
    return rows if len(rows) == len(lines) else [line.replace('"', "").split(delimiter) for line in lines]


def _plain(cells: list[str], groups: bool) -> list[str]:
    """Return cells with decimal points, and without marks between thousands; groups: whether commas are such marks."""
    bare = [cell.strip(BARE) for cell in cells]
    pointed = [cell.replace(",", "") if groups else _with_point(cell) for cell in bare]
    return [BLANK_GROUPS.sub("", cell) for cell in pointed]


def _with_point(cell: str) -> str:
    """Return a number with a decimal point for its comma, without points between thousands."""
    return cell.replace(".", "").replace(",", ".") if "," in cell and DECIMAL_COMMA.fullmatch(cell) else cell


def _joined(cells: list[str]) -> list[str]:
    """Return the pairs of cells as numbers with decimal points; a header stays as it is."""
    if len(cells) % 2 or not re.fullmatch(r"\s*[-+]?\d+\s*", cells[0]):
        return cells
    return [f"{a.strip()}.{b.strip()}" for a, b in zip(cells[::2], cells[1::2], strict=True)]


def _holds(cells: Sequence[str], columns: Sequence[int]) -> bool:
    """Return whether a line has numbers in these columns."""
    return all(column < len(cells) and np.isfinite(_loose_number(cells[column])) for column in columns)


def _share(cells: Sequence[str], columns: Sequence[int]) -> float:
    """Return the part of cells that are numbers, of a line that has numbers in these columns."""
    if not _holds(cells, columns):
        return 0.0
    filled = [cell for cell in cells if cell.strip(BARE)]
    return sum(bool(np.isfinite(_loose_number(cell))) for cell in filled) / len(filled)


def _is_word(cell: str) -> bool:
    return bool(cell.strip(BARE)) and not np.isfinite(_loose_number(cell))


def _delimiter(line: str) -> str | None:
    """Return the one that gives the most numbers."""
    return max(DELIMITERS, key=lambda delimiter: len(_with_numbers(_split(line, delimiter))))


def _columns(line: str) -> list[int]:
    """Return the columns of a line that hold numbers; none of a line of words."""
    return _with_numbers(_split(line, _delimiter(line)))


def _with_numbers(cells: Sequence[str]) -> list[int]:
    """Return which cells are numbers; none among words."""
    numbers = [k for k, cell in enumerate(cells) if np.isfinite(_loose_number(cell))]
    return numbers if 2 * len(numbers) >= len(cells) else []


def _rise(values: Vector) -> float:
    """Return the step of numbers that increase evenly, perhaps rounded; 0 for others."""
    if values.size < WINDOW // 4:
        return 0.0
    steps, rise = np.diff(values), float(values[-1] - values[0]) / (values.size - 1)
    off = np.abs(values - values[0] - rise * np.arange(values.size))
    return rise if (steps >= 0.0).all() and off.max() <= 1.01 * steps.max() else 0.0


def _column(rows: list[list[str]], column: int) -> list[str]:
    """Return the cells one above the other, empty where a line is too short."""
    return [row[column] if len(row) > column else "" for row in rows]


def _numbers(cells: list[str], group: Callable[[list[str]], bool]) -> Vector:
    """Return the numbers, NaN for what is none. group: whether commas of such cells separate thousands."""
    try:
        return np.array([*map(float, cells)])
    except ValueError:  # a header, a word, or commas
        return np.array([_number(cell) for cell in _plain(cells, group(cells))])


def _or_clocks(values: Vector, cells: list[str]) -> Vector:
    """Return the times of day in place of numbers, if most of these are none."""
    return np.array([_clock(cell) for cell in cells]) if np.isnan(values).sum() > 0.5 * values.size else values


def _in_range(values: Vector) -> Vector:
    """Return the numbers without marks of a sample beyond the range."""
    return np.where(np.abs(values) < HUGE, values, np.nan)


def _number(cell: str) -> float:
    """Return a number with a decimal point, or NaN."""
    try:
        return float(cell)
    except ValueError:
        if re.fullmatch(r"[-+]?[\d.]+[dD][-+]?\d+", cell):  # as Fortran writes exponents
            return float(cell.upper().replace("D", "E")) if cell.count(".") < 2 else np.nan
        return np.nan


def _loose_number(cell: str) -> float:
    """Return a number, whatever its commas mean, or NaN."""
    bare = cell.strip().strip('"').strip()
    value = _number(bare)
    if np.isnan(value) and LOOSE_NUMBER.fullmatch(bare):
        return _number(re.sub(r"[.,' ]", "", bare))
    return value if not np.isnan(value) else _clock(cell)


def _clock(cell: str) -> float:
    """Return a time of day, s: of "10:23:11.000005" or a date with it; NaN for other text."""
    match = DATE_OR_CLOCK.match(cell.strip().strip('"'))
    if not match:
        return np.nan
    hours, minutes, seconds, half = match.groups()
    hour = int(hours) % 12 + 12 * (half.upper() == "P") if half else int(hours)
    return float(3600 * hour + 60 * int(minutes) + Decimal(seconds.replace(",", ".")))
