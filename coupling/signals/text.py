"""The text of an oscilloscope as columns of numbers, by pandas: encoding, delimiter, decimal mark, head, samples."""

import csv
import re
from collections.abc import Collection, Sequence
from decimal import Decimal
from io import StringIO
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pandas as pd  # type: ignore[import-untyped]
from numpy.typing import NDArray

from coupling.results.sensor_trace import FEWEST_SAMPLES
from coupling.signals.heads import FORCE, TIME, Head, NotUnderstood, Unit
from coupling.signals.recordings import TEXT, Channel, Recording
from coupling.signals.sampling import FEW, FEW_SHARE, Rows
from structures.checks import count_of
from structures.structure import Vector

DELIMITERS = (";", "\t", "|", ",", r"\s+")
MOST_BYTES, MOST_COLUMNS = 50_000_000, 256
HUGE = 1e30  # Scopes print 9.9E+37 and the like for a sample beyond their range.
TRIED = 200  # Lines in the middle of a file from which the delimiter and the decimal mark are found.
HEAD = 60  # Lines at the beginning in which a unit may be stated.
WINDOW = 40  # Lines at three places in which a column of times increases.
SHOWN = 80  # Characters of a line in a message.

# Signs and blanks of typeset numbers, and marks of the end of a file.
TYPESET = str.maketrans({**dict.fromkeys("−–‐‑﹣－", "-"), **dict.fromkeys("\xa0\u202f", " "), "\0": "", "\x1a": ""})
THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2}(,\d{3})+(\.\d*)?")
CLOCK = re.compile(r"\d{1,2}:\d\d:\d\d")


class Table(NamedTuple):
    """The lines of a text that are not blank: their numbers in the file, their text, their cells, and the numbers in
    these by column, NaN for words."""

    places: NDArray[np.int64]
    texts: list[str]
    cells: pd.DataFrame
    numbers: dict[int, Vector]
    delimiter: str
    decimal: str
    is_cut: bool


def read_text(
    path: Path, content: bytes, columns: Collection[int] | None, time_column: int | None, timed: bool, skip: int
) -> Recording:
    """Return columns of a text. columns: None for all that hold no times; timed: False if times are not to be read.

    A ValueError names the file, the line, and the way out.
    """
    table = table_of(path, content, sorted({*(columns or ()), *([] if time_column is None else [time_column])}), skip)
    cells, numbers = table.cells, table.numbers

    # Which columns hold times: of each sensor the nearest one to its left that increases.
    rising = [column for column, values in numbers.items() if timed and rises(values)]
    if time_column is not None:
        rising = [time_column]
    chosen = [column for column in numbers if column not in rising] if columns is None else sorted(columns)
    if swapped := [column for column in chosen if rises(numbers[column])]:
        raise ValueError(
            f"{path}: column {swapped[0]} increases from line to line, as a time does: are the columns swapped? "
            "sensors = {bead: column}, counted from 0; the time is time_column"
        )
    time_of = {column: max([c for c in rising if c < column], default=min(rising, default=None)) for column in chosen}
    timed_by = sorted({column for column in time_of.values() if column is not None})
    first, rows, notes = sample_rows(path, table, timed_by, chosen)

    # What the lines above the samples say, and the samples.
    above = [head_cells(line, table.delimiter) for line in table.texts[:first]]
    head = Head(above, len(numbers), [head_cells(line, table.delimiter) for line in table.texts[:HEAD]])
    read = [cells[column].iloc[rows] for column in sorted({*chosen, *timed_by})]
    check_commas(path, read, table.delimiter, above, len(numbers))
    times = dict[int, tuple[Vector, Unit | NotUnderstood | None]]()
    for column in timed_by:
        since, begins = time_in(numbers[column][rows], cells[column].iloc[rows], table.decimal)
        is_clock = cells[column].iloc[rows[0]].count(":") > 1
        times[column] = since, Unit("s", "s", 1.0) if is_clock else head.unit(column, TIME)
        notes += [f"times count from the first sample, {begins}"] if begins else []
    channels = {}
    for column in chosen:
        values, of_time = numbers[column][rows], time_of[column]
        missing = cells[column].iloc[rows[~np.isfinite(values)][:100]]
        words = tuple(dict.fromkeys(cell.strip() or "an empty cell" for cell in missing))
        time, time_unit = (None, None) if of_time is None else times[of_time]
        unit, lines = head.unit(column, FORCE), table.places[rows]
        channels[column] = Channel(head.name(column), values, unit, time, time_unit, lines, words)
    return Recording(TEXT, channels, notes)


def table_of(path: Path, content: bytes, wanted: Sequence[int], skip: int) -> Table:
    """Return the cells of a text and the numbers in them. wanted: columns that must hold numbers."""
    if len(content) > MOST_BYTES:
        raise ValueError(f"{path}: is a text of more than {MOST_BYTES:.2g} bytes; cut it, or save arrays (.npz)")
    text = decoded(content).translate(TYPESET).replace("\r\n", "\n").replace("\r", "\n")
    lines = [(number, line) for number, line in enumerate(text.split("\n"), 1) if line.strip() and number > skip]
    if len(lines) < FEWEST_SAMPLES:
        raise ValueError(f"{path}: holds {count_of(len(lines), 'line')}, must hold {FEWEST_SAMPLES} samples or more")
    places, texts = np.array([number for number, _ in lines]), [line for _, line in lines]
    delimiter, decimal = form_of(path, texts, wanted)
    cells = split(path, texts, delimiter)
    body = cells.iloc[len(cells) // 3 :]
    filled = [column for column in cells if (body[column].str.strip() != "").mean() > 0.5]
    width = 1 + max([*wanted, *filled], default=0)
    numbers = {column: numbers_in(cells[column], decimal) for column in range(width)}
    for column, values in numbers.items():
        if np.isnan(values).mean() > 0.5 and cells[column].str.contains(CLOCK).mean() > 0.5:
            numbers[column] = clock(cells[column])
    is_cut = text[-1:] != "\n" and len(texts[-1]) < min(map(len, texts[-20:-1]))
    return Table(places, texts, cells, numbers, delimiter, decimal, is_cut)


def sample_rows(
    path: Path, table: Table, timed_by: Sequence[int], chosen: Sequence[int]
) -> tuple[int, Rows, list[str]]:
    """Return the first row of the samples, the rows of all, and what was left out. A ValueError where that is much.

    timed_by: the columns of times; a sample has a number in each. Without them each line is one, though a number is
    missing.
    """
    size = len(table.texts)
    finite = np.isfinite([table.numbers[column] for column in timed_by or chosen])
    filled = np.asarray(finite.all(axis=0) if timed_by else finite.any(axis=0))
    begins = filled.copy()
    if not timed_by:
        # A line with a word, or with fewer cells than usual, belongs to the head.
        full = np.array([table.cells[column].str.strip() != "" for column in table.numbers])
        words = (full & ~np.isfinite([*table.numbers.values()])).any(axis=0)
        begins &= ~words & (full.sum(axis=0) == np.median(full.sum(axis=0)))
    three = begins[:-2] & begins[1:-1] & begins[2:]
    if not three.any():
        raise no_samples(path, timed_by or chosen, table.texts[size // 2])
    first, last = int(three.argmax()), size - int(filled[::-1].argmax())
    last -= table.is_cut and last == size
    if not timed_by:
        filled[first:last] = True
    rows = first + np.flatnonzero(filled[first:last])
    lost = [row for row in range(first, size) if row >= last or not filled[row]]
    named = [f"line {table.places[row]} {table.texts[row][:SHOWN]!r}" for row in lost[:3]]
    if len(lost) > max(FEW, FEW_SHARE * rows.size):
        line = f"line {table.places[lost[0]]}: {table.texts[lost[0]][:SHOWN]!r}"
        wanted = sorted({*chosen, *timed_by})
        raise ValueError(f"{path}, {line} must hold {len(table.numbers)} columns, with numbers in {wanted}")
    if rows.size < FEWEST_SAMPLES:
        raise ValueError(f"{path}: holds {count_of(rows.size, 'sample')}, must hold {FEWEST_SAMPLES} or more")
    left_out = count_of(len(lost), "line that is no sample was left out", "lines that are no samples were left out")
    return first, rows, [f"{left_out}: {', '.join(named)}"] if lost else []


def decoded(content: bytes) -> str:
    """Return text in UTF-8 or UTF-16, with or without a byte order mark, else in the code page of Western Windows."""
    beginning = content[:200]
    if beginning[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    if beginning.count(0) > len(beginning) // 3:
        big = beginning[::2].count(0) > beginning[1::2].count(0)
        return content.decode("utf-16-be" if big else "utf-16-le", errors="replace")
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def split(path: Path, lines: Sequence[str], delimiter: str) -> pd.DataFrame:
    """Return the cells of lines as text, "" where a line is short."""
    spaced = delimiter == r"\s+"
    width = max(len(line.split()) if spaced else line.count(delimiter) + 1 for line in lines)
    if width > MOST_COLUMNS:
        raise ValueError(f"{path}: has a line of {width} columns, must have at most {MOST_COLUMNS}")
    for quoting in (csv.QUOTE_MINIMAL, csv.QUOTE_NONE):  # a quote may open that is not closed
        try:
            cells = pd.read_csv(
                StringIO("\n".join(lines)), sep=delimiter, header=None, names=range(width), dtype=str, na_filter=False,
                skip_blank_lines=False, skipinitialspace=True, index_col=False, quoting=quoting,
            )  # fmt: skip
        except pd.errors.ParserError:
            continue
        if len(cells) == len(lines):
            return cells.fillna("")
    raise ValueError(f"{path}: has quotes that are not closed; export it without quotes")


def head_cells(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line above the samples, where blanks do not part a name from its unit in brackets."""
    if delimiter == r"\s+":
        return re.sub(r"\s+(?=[(\[/])|(?<=/)\s+|^\s*[#%]+\s*", "", line).split()
    return next(csv.reader([line if line.count('"') % 2 == 0 else line.replace('"', "")], delimiter=delimiter))


def numbers_in(cells: pd.Series, decimal: str) -> Vector:
    """Return the numbers in cells, NaN for words and for marks of a sample beyond the range."""
    bare = cells.str.strip(' "\t')
    plain = bare if decimal == "." else bare.str.replace(decimal, ".", regex=False)
    values = pd.to_numeric(plain, errors="coerce").to_numpy(float)
    return np.where(np.abs(values) < HUGE, values, np.nan)


def form_of(path: Path, lines: Sequence[str], wanted: Sequence[int]) -> tuple[str, str]:
    """Return the delimiter and the decimal mark with which lines in the middle hold most numbers."""
    middle = lines[len(lines) // 2 :][:TRIED]
    best, form = 0.0, (",", ".")
    for delimiter in DELIMITERS:
        if delimiter != r"\s+" and delimiter not in "".join(middle) and any(column > 0 for column in wanted):
            continue
        cells = split(path, middle, delimiter)
        if wanted and wanted[-1] >= cells.shape[1]:
            continue
        for decimal in ".,":
            numbers = np.isfinite([numbers_in(cells[column], decimal) for column in cells])
            filled = np.array([cells[column].str.strip() != "" for column in cells])
            # The part of cells that are numbers, of lines with a number in one of the wanted columns.
            held = numbers[wanted].mean(axis=0) if wanted else numbers.any(axis=0)
            score = float((held * numbers.sum(axis=0) / np.maximum(filled.sum(axis=0), 1)).mean())
            if score > 1.01 * best:
                best, form = score, (delimiter, decimal)
    if not best:
        raise no_samples(path, wanted, middle[0])
    return form


def no_samples(path: Path, columns: Sequence[int], line: str) -> ValueError:
    """Return the error for a text without lines of numbers in some columns. line: one of it."""
    where = f"columns {', '.join(map(str, columns))}, counted from 0" if columns else "columns"
    return ValueError(
        f"{path}: must hold a line for each sample, with numbers in {where}; a line is {line[:SHOWN]!r}; decimal "
        "commas need another delimiter between columns, and a file without times needs interval="
    )


def check_commas(
    path: Path, cells: Sequence[pd.Series], delimiter: str, above: Sequence[Sequence[str]], width: int
) -> None:
    """Raise a ValueError where commas may stand before decimals or between thousands, or cut numbers in two."""
    for column in cells:
        bare = column.str.strip(' "')
        with_comma = bare[bare.str.contains(",")]
        is_unclear = with_comma.size and (delimiter == "," or with_comma.size < bare.size)
        if is_unclear and with_comma.str.fullmatch(THOUSANDS).all():
            one = with_comma.iloc[0]
            raise ValueError(
                f"{path}: {one!r} may be {one.replace(',', '.')} or {one.replace(',', '')}; export the trace with "
                "decimal points, and without commas in numbers"
            )
    named = [row for row in above if len(row) > 1 and not any(cell.strip().isdigit() for cell in row)][-1:]
    are_halves = any(2 * len(row) == width for row in named)
    are_decimals = any(column.str.fullmatch(r"\s*0\d+\s*").any() for column in cells)
    if delimiter == "," and width % 2 == 0 and (are_halves or are_decimals):
        raise ValueError(
            f"{path}: commas part columns and decimals alike, as it seems: {width} columns; export the trace with "
            "decimal points, or with semicolons between columns"
        )


def rises(values: Vector) -> bool:
    """Return whether numbers increase evenly from line to line, perhaps rounded, at two of three places or more."""
    count = 0
    for place in np.linspace(0, max(0, values.size - WINDOW), 5)[1:-1].astype(int):
        near = values[place : place + WINDOW]
        near = near[np.isfinite(near)]
        if near.size < min(WINDOW, values.size) // 2:
            continue
        steps, line = np.diff(near), np.linspace(near[0], near[-1], near.size)
        count += bool((steps >= 0.0).all() and near[-1] > near[0] and np.abs(near - line).max() <= 1.01 * steps.max())
    return count >= 2


def clock(cells: pd.Series) -> Vector:
    """Return times of day, such as "10:23:11.000005" or a date with it, s after the first; NaN for other text."""
    bare = cells.str.strip(' "').str.replace(",", ".", regex=False).str.replace(r"\s*[AP]M$", "", regex=True)
    if bare.str.fullmatch(r"\d{1,2}:\d\d:\d\d(\.\d+)?").mean() > 0.5:
        spans = pd.to_timedelta(bare.where(bare.str.match(CLOCK)), errors="coerce")
    else:
        form = pd.tseries.api.guess_datetime_format(bare.iloc[len(bare) // 2], dayfirst=True)
        if form is None:
            return np.full(len(bare), np.nan)
        moments = pd.to_datetime(bare, format=form, errors="coerce", utc=True)
        spans = moments - moments.min()
    seconds = spans / pd.Timedelta(1, "s")
    return np.asarray(seconds - seconds.dropna().min(), dtype=float)


def time_in(values: Vector, cells: pd.Series, decimal: str) -> tuple[Vector, str]:
    """Return a column of times; those with too many digits for a float from the first sample on, with that as text."""
    step = abs(float(np.median(np.diff(values))))
    if not np.spacing(np.abs(values).max()) > 1e-3 * step > 0.0:
        return values, ""
    texts = [Decimal(text) for text in cells.str.strip(' "').str.replace(decimal, ".", regex=False)]
    return np.array([float(text - texts[0]) for text in texts]), str(texts[0])
