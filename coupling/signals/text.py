"""The reader of texts with columns of numbers, by pandas: encoding, delimiter, decimal mark, head, samples."""

import re
import warnings
from collections.abc import Collection, Sequence
from io import StringIO
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd  # type: ignore[import-untyped]

from coupling.results.sensor_trace import FEWEST_SAMPLES
from coupling.signals.channels import FEW, FEW_SHARE, Channel, Recording, Sampling
from coupling.signals.heads import FORCE, TIME, Head, Unit
from structures.checks import count_of

DELIMITERS = (";", "\t", "|", ",", r"\s+")
MOST_COLUMNS = 256
HUGE = 1e30  # Scopes print 9.9E+37 and the like for a sample beyond their range.
TRIED = 200  # Number of lines in the middle of a file that show the delimiter and the decimal mark.
HEAD = 60  # Number of lines at the beginning in which a unit may be stated.
WINDOW = 40  # Number of lines, at each of three places, in which a column of times increases.
SHOWN = 80  # Characters of a line in a message.

# Signs and blanks of typeset numbers, and marks at the end of a file.
TYPESET = str.maketrans({**dict.fromkeys("−–‐‑﹣－", "-"), **dict.fromkeys("\xa0\u202f", " "), "\0": "", "\x1a": ""})
CLOCK = re.compile(r"\d{1,2}:\d\d:\d\d")


def read_text(path: Path, content: bytes, columns: Collection[int] | None, asked: Sampling) -> Recording:
    """Return columns of a text (None: all except times). A ValueError names the line and the cure."""
    # The text is in UTF-16 with a byte order mark, in UTF-8, or else in the code page of Western Windows.
    try:
        is_utf_16 = content[:2] in (b"\xff\xfe", b"\xfe\xff")
        text = content.decode("utf-16", errors="replace") if is_utf_16 else content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")
    text = text.translate(TYPESET).replace("\r\n", "\n").replace("\r", "\n")
    lines, notes = pd.Series(text.split("\n")), list[str]()
    lines.index += 1  # the numbers of the lines in the file
    lines = lines[(lines.index > asked.skip) & (lines.str.strip() != "")]
    if len(lines) < FEWEST_SAMPLES:
        wordy = len(lines) > 0 and not lines.str.contains(r"\d").any()
        held = count_of(len(lines), "line") + " and no number" * wordy
        raise ValueError(f"{path}: holds {held}, must hold {FEWEST_SAMPLES} samples or more")
    if text[-1:] != "\n" and len(lines.iloc[-1]) < lines.iloc[-20:-1].str.len().min():
        notes.append(f"the last line, {lines.iloc[-1][:SHOWN]!r}, is cut off and was left out")
        lines = lines.iloc[:-1]
    # An open quote would swallow the lines that follow, so it is removed.
    lines = lines.where(lines.str.count('"') % 2 == 0, lines.str.replace('"', ""))

    # The numbers in all columns, NaN for words.
    given = [] if asked.time_column is None else [asked.time_column]
    wanted = sorted({*(columns or ()), *given})
    delimiter, decimal = form_of(path, lines, wanted)
    cells = split(path, lines, delimiter)
    held = split(path, lines, form_of(path, lines, [])[0]).shape[1]
    if 1 < held <= max(wanted, default=0):
        entry = "time_column" if wanted[-1] in given else "sensors"
        raise ValueError(f"{entry}: {path} has no column {wanted[-1]}; its columns are 0 to {held - 1}")
    filled = np.flatnonzero((cells.iloc[len(cells) // 3 :] != "").mean() > 0.5)
    width = 1 + max([*wanted, *filled], default=0)
    table = cells.reindex(columns=range(width), fill_value="")
    numbers = table.apply(numbers_in, decimal=decimal)
    for column in numbers:
        if numbers[column].isna().mean() > 0.5 and table[column].str.contains(CLOCK).mean() > 0.5:
            numbers[column] = clock(table[column])

    # The column of times for a sensor is the nearest increasing one to its left.
    rising = given or [column for column in numbers if asked.interval is None and rises(numbers[column])]
    chosen = [column for column in numbers if column not in rising] if columns is None else sorted(columns)
    falls = not rising and asked.interval is None and [column for column in numbers if rises(-numbers[column])]
    if falls:
        raise ValueError(f"{path}: column {falls[0]} decreases from line to line; if it is the time, it must increase")
    if swapped := [column for column in chosen if rises(numbers[column])]:
        entry, cure = "sensors", ": are the columns swapped? They are counted from 0; the time is time_column"
        if columns is None:
            entry, cure = "interval", "; leave interval out, which is for a file without times"
        raise ValueError(f"{entry}: {path}: column {swapped[0]} increases from line to line, as a time does{cure}")
    time_of = {column: max([c for c in rising if c < column], default=min(rising, default=None)) for column in chosen}
    timed_by = sorted({column for column in time_of.values() if column is not None})
    samples, left_out = samples_in(path, lines, table, numbers, timed_by, chosen)
    notes += left_out

    # The lines above the samples, and the samples.
    rows = cells.to_numpy().tolist()
    if delimiter == r"\s+":
        # Blanks do not separate a name from its unit in brackets.
        rows = [re.sub(r"\s+(?=[(\[/])|(?<=/)\s+|^\s*[#%]+\s*", "", line).split() for line in lines]
    above = rows[: lines.index.get_loc(samples[0])]
    head = Head(above, width, rows[:HEAD])
    table, numbers = table.loc[samples], numbers.loc[samples]
    check_marks(path, table[sorted({*chosen, *timed_by})], delimiter, decimal, above, width)
    channels = dict[int, Channel]()
    for column in chosen:
        words = dict.fromkeys(cell or "an empty cell" for cell in table[column][numbers[column].isna()][:100])
        values, unit = numbers[column].to_numpy(), head.unit(column, FORCE)
        channel = Channel(head.name(column), values, unit, None, lines=samples, words=tuple(words))
        if (timer := time_of[column]) is not None:
            time, first = numbers[timer].to_numpy(), table[timer].iloc[0]
            unit = Unit("s", "s") if first.count(":") > 1 else head.unit(timer, TIME)
            # Seconds since 1970 have too few digits left for the steps between them.
            if np.spacing(np.abs(time).max()) > 1e-3 * np.median(np.abs(np.diff(time))) > 0.0:
                time = time - time[0]
                if (note := f"times count from the first sample, {first}") not in notes:
                    notes.append(note)
            channel = channel._replace(time=time, time_unit=unit)
        channels[column] = channel
    return Recording("a text", channels, notes)


def form_of(path: Path, lines: pd.Series, wanted: Sequence[int]) -> tuple[str, str]:
    """Return the delimiter and decimal mark that give most numbers in middle lines, and in all wanted columns."""
    middle = lines.iloc[len(lines) // 2 :][:TRIED]
    best, form = 0.0, (",", ".")
    for delimiter in DELIMITERS:
        cells = split(path, middle, delimiter)
        if wanted and wanted[-1] >= cells.shape[1]:
            continue
        filled = (cells != "").sum(axis=1).clip(lower=1)
        for decimal in ".,":
            are_numbers = cells.apply(numbers_in, decimal=decimal).notna()
            # The part of the cells that are numbers, weighted by the part of the wanted columns that are.
            held = are_numbers[wanted].mean(axis=1) if wanted else are_numbers.any(axis=1)
            score = float((held * are_numbers.sum(axis=1) / filled).mean())
            if score > 1.01 * best:
                best, form = score, (delimiter, decimal)
    return form


def split(path: Path, lines: pd.Series, delimiter: str) -> pd.DataFrame:
    """Return the cells of lines as text without blanks around it, "" beyond the end of a short line."""
    counts = lines.str.split().str.len() if delimiter == r"\s+" else 1 + lines.str.count(re.escape(delimiter))
    if (width := int(counts.max())) > MOST_COLUMNS:
        raise ValueError(f"{path}: has a line of {width} columns, must have at most {MOST_COLUMNS}")
    cells = pd.read_csv(
        StringIO("\n".join(lines)), sep=delimiter, header=None, names=range(width), dtype=str, na_filter=False,
        skip_blank_lines=False, skipinitialspace=True, index_col=False,
    )  # fmt: skip
    if len(cells) != len(lines):
        raise ValueError(f"{path}: has quotes that are not closed; export it without quotes")
    return cells.set_index(lines.index).fillna("").apply(lambda column: column.str.strip(' "\t'))


def numbers_in(cells: pd.Series, decimal: str) -> pd.Series:
    """Return the numbers in cells, NaN for words and for marks of samples beyond the range."""
    values = pd.to_numeric(cells.str.replace(decimal, ".", regex=False), errors="coerce").astype(float)
    return values.where(values.abs() < HUGE)


def samples_in(
    path: Path, lines: pd.Series, cells: pd.DataFrame, numbers: pd.DataFrame, timed_by: list[int], chosen: list[int]
) -> tuple[pd.Index, list[str]]:
    """Return the lines that are samples, and a note on lines that were left out; a ValueError if these are many. A
    sample has a number in each column of times; without such columns it is any line, even if a number is missing."""
    begins = is_sample = numbers[timed_by].notna().all(axis=1).to_numpy()
    if not timed_by:
        is_sample = numbers[chosen].notna().any(axis=1).to_numpy()
        # A line with a word, or with fewer cells than usual, belongs to the head.
        full = (cells != "").to_numpy()
        words = (full & numbers.isna().to_numpy()).any(axis=1)
        begins = is_sample & ~words & (full.sum(axis=1) == np.median(full.sum(axis=1)))
    three = begins[:-2] & begins[1:-1] & begins[2:]
    if not three.any() or numbers[chosen].isna().all().any():
        raise ValueError(
            f"{path}: must hold a line for each sample, with numbers in columns {', '.join(map(str, chosen))}, counted "
            f"from 0; a line is {lines.iloc[len(lines) // 2][:SHOWN]!r}; columns are separated by ; | tabs or "
            "blanks, or by commas if decimals have points; a file without times needs interval="
        )
    first, end = int(three.argmax()), int(np.flatnonzero(is_sample)[-1]) + 1
    is_sample = is_sample[first:] if timed_by else np.arange(first, len(lines)) < end
    lost, samples = lines.iloc[first:][~is_sample], lines.index[first:][is_sample]
    if len(lost) > max(FEW, FEW_SHARE * len(samples)):
        raise ValueError(
            f"{path}, line {lost.index[0]}: {lost.iloc[0][:SHOWN]!r} must hold {numbers.shape[1]} columns, with "
            f"numbers in {sorted({*chosen, *timed_by})}"
        )
    if len(samples) < FEWEST_SAMPLES:
        raise ValueError(f"{path}: holds {count_of(len(samples), 'sample')}, must hold {FEWEST_SAMPLES} or more")
    left_out = count_of(len(lost), "line that is not a sample was left out", "lines that are not samples were left out")
    named = ", ".join(f"line {number} {line[:SHOWN]!r}" for number, line in lost[:3].items())
    return samples, [f"{left_out}: {named}"] if len(lost) else []


def check_marks(path: Path, cells: pd.DataFrame, sep: str, decimal: str, above: list[list[str]], width: int) -> None:
    """Raise a ValueError if a mark may be a decimal mark or stand between thousands, or if commas split numbers."""
    for (_, column), mark in product(cells.items(), ",."):
        marked = column[column.str.fullmatch(rf"[-+]?[\d.,]*\d\{mark}\d[\d.,]*")]
        # A mark between thousands has three digits behind it in all cells with the mark; some cells may not have one.
        is_unclear = len(marked) < len(column) or sep == mark
        thousands = marked.str.fullmatch(rf"[-+]?[1-9]\d{{0,2}}(\{mark}\d{{3}})+([.,]\d*)?")
        if len(marked) and (mark != decimal or (is_unclear and thousands.all())):
            one, beside = marked.iloc[0], f", beside numbers with {decimal!r}" * (mark != decimal)
            raise ValueError(
                f"{path}: {one!r} may be {one.replace(mark, '.')} or {one.replace(mark, '')}{beside}; export the trace "
                "with one decimal mark, and without marks between thousands"
            )
    # Signs of split numbers: twice as many columns as names, or cells that hold only decimals.
    named = [list(filter(None, row)) for row in above]
    named = [row for row in named if len(row) > 1 and not any(map(str.isdigit, row))][-1:]
    are_decimals = any(cells[column].str.fullmatch(r"0\d+").any() for column in cells)
    if sep == "," and width % 2 == 0 and (are_decimals or any(2 * len(row) == width for row in named)):
        raise ValueError(
            f"{path}: commas seem to separate both columns and decimals: {width} columns; export the trace with "
            "decimal points, or with semicolons between columns"
        )


def rises(values: pd.Series) -> bool:
    """Return whether numbers increase evenly from line to line, perhaps rounded, at two or more of three places."""
    count = 0
    for place in np.linspace(0, max(0, values.size - WINDOW), 5)[1:-1].astype(int):
        near = values.iloc[place : place + WINDOW].dropna().to_numpy()
        if near.size >= min(WINDOW, values.size) // 2:
            steps, off = np.diff(near), np.abs(near - np.linspace(near[0], near[-1], near.size))
            count += bool((steps >= 0.0).all() and near[-1] > near[0] and off.max() <= 1.01 * steps.max())
    return count >= 2


def clock(cells: pd.Series) -> pd.Series:
    """Return times of day, such as "10:23:11.000005", perhaps with a date, as s after the first; NaN for other text."""
    bare = cells.str.replace(",", ".", regex=False)
    day = "1 January 2000 " if bare.str.match(CLOCK.pattern + r"(\.\d+)?( [AP]M)?$").mean() > 0.5 else ""
    middle = day + bare.iloc[len(bare) // 2]
    with warnings.catch_warnings():  # pandas warns of dates such as 11/28/2026
        warnings.simplefilter("ignore")
        form = pd.tseries.api.guess_datetime_format(middle, dayfirst=not re.match(r"\d{4}", middle))
    moments = pd.to_datetime(day + bare, format=form or "mixed", dayfirst=not form, errors="coerce", utc=True)
    return (moments - moments.min()) / pd.Timedelta(1, "s")
