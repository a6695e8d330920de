"""The header of an oscilloscope's file, the lines above the samples: units, interval, start, and number of samples."""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import cache
from math import isfinite
from typing import NamedTuple

from structures.units import factor, is_unit

TIME, FORCE, OTHER, UNKNOWN = "time", "voltage or force", "other", "unknown"

SI = {"s": TIME, "V": FORCE, "N": FORCE}
"""The SI units that columns are read in."""

NAMES_OF_LINES = 3
"""Lines directly above the samples that may name columns and their units."""

INTERVALS, RATES, STARTS, COUNTS, TIME_UNITS, FORCE_UNITS = (
    set(words.split())
    for words in (
        """
        increment xinc xincr xincrement timeincrement deltax dx deltat dt hresolution sampleinterval samplinginterval
        sampleperiod samplingperiod sampletime samplingtime timestep timeinterval tinterval wfincrement horizinterval
        horizontalinterval tinc timebaseinterval timeresolution
        """,
        """
        abtastrate abtastfrequenz samplerate samplingrate samplefrequency samplingfrequency samplingfreq fs sampfreq
        """,
        "start xzero x0 xorigin xorg xstart hoffset starttime horizoffset horizontaloffset timestart tstart t0",
        """
        recordlength segmentsize memorylength blocksize samplecount numberofsamples samples points npoints
        numberofpoints numpoints recordsize noofsamples noofpoints
        """,
        "horizontalunits horizontalunit xunits xunit xaxisunit hunit timeunit timeunits xunitlabel",
        "verticalunits verticalunit yunits yunit yaxisunit vunit yunitlabel amplitudeunit signalunit unit units",
    )
)
KEYS = INTERVALS | RATES | STARTS | COUNTS | TIME_UNITS | FORCE_UNITS
"""Words of lines such as "Sample Interval,5e-07", without blanks and signs."""

COUNTERS = {"sample", "samples", "sampleno", "samplenumber", "index", "no", "nr", "n", "point", "count", "sequence"}
"""Names of columns that count samples."""

NUMBER_AND_UNIT = re.compile(r"\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)\s*(\S*)\s*")
"""A value such as "2 MSa/s"."""

BETWEEN_WORDS = re.compile(r"[\s,;:]+")

FACTOR = re.compile(r"\bx\s*1[0eE]\S*\s+\S|\w\s*[×*·]\s*\d|\d\s*[×*·]")
"""A factor beside a name or a unit, as in "t*1000 (s)"."""

RATE = re.compile(r"(?:\b|[\dkMG])(?:samples?|sa|s|points?|pts?)\s*/\s*s(?:ec|econd)?\b", re.IGNORECASE)
"""A rate of samples, such as "2 MSa/s", which is no unit of a column."""

SECOND = re.compile(r"(se[ck](unde|onde?)?[ns]?\.?)$", re.IGNORECASE)
"""Seconds as people abbreviate and translate them."""


class Unit(NamedTuple):
    """A unit as a header writes it, its quantity, the SI unit, its size in that, and its full name."""

    text: str
    quantity: str
    si: str = ""
    size: float = 1.0
    name: str = ""

    @property
    def of_table(self) -> tuple[str, float]:
        return self.si, self.size


class Stated(NamedTuple):
    """An entry such as "Sample Rate,2 MSa/s": its name, its text, and its value in SI, None if not understood."""

    name: str
    text: str
    value: float | None


class Header:
    """The lines above the samples, and entries such as "Vertical Units,V" above or beside these, cell by cell."""

    def __init__(self, rows: Sequence[Sequence[str]], first: Sequence[Sequence[str]], columns: int) -> None:
        """Hold the rows above the samples; first: the first of the file; columns: the number of cells of a sample."""
        self._rows = [_cells(row, columns) for row in rows]
        self._first = [_cells(row, 0, join=False) for row in first]
        self._columns = columns

    def unit(self, column: int, wanted: str) -> Unit | None:
        """Return the unit of a column; a Unit of another quantity where the header states one."""
        near = [row for row in self._rows if any(row) and key_of(row[0]) not in KEYS][-NAMES_OF_LINES:]
        near_units = [
            _stated(row[column], wanted, _is_row_of_units(row)) for row in reversed(near) if len(row) > column
        ]
        keyed = [*self._keyed(TIME_UNITS if wanted == TIME else FORCE_UNITS, column)]
        stated = [unit for unit in [*near_units, *keyed] if unit is not None]
        if not stated:  # cells that do not stand above the columns
            cells = [cell for row in near if len(row) != self._columns for cell in row]
            units = [_stated(cell, wanted, False) for cell in cells]
            loose = {unit for unit in units if unit is not None and unit.quantity == wanted}
            stated = [*loose] if len({unit.of_table for unit in loose}) == 1 else []
        if len({unit.of_table for unit in stated}) > 1:
            texts = " and ".join(dict.fromkeys(repr(unit.text) for unit in stated))
            return Unit(texts, UNKNOWN)
        return stated[0] if stated else None

    def name(self, column: int) -> str:
        """Return what the lines above the samples call a column; "" where they do not."""
        cells = (row[column] for row in reversed(self._rows[-NAMES_OF_LINES:]) if len(row) > column)
        named = [cell for cell in cells if cell and not _is_number(cell)]
        words = (cell for cell in named if not _first_unit(cell.strip("()[] "), FORCE).name)
        return next(words, named[0] if named else "")

    def counts_samples(self, column: int) -> bool:
        """Return whether a column is named as the number of the sample."""
        return any(len(row) > column and key_of(row[column]) in COUNTERS for row in self._rows[-NAMES_OF_LINES:])

    def intervals(self) -> list[Stated]:
        """Return the intervals between samples, s, that entries state, also as rates."""
        rates = [rate._replace(value=1.0 / rate.value if rate.value else None) for rate in self._entries(RATES, _hertz)]
        every = [*self._entries(INTERVALS, self._second), *rates]
        return [
            interval if interval.value and interval.value > 0.0 else interval._replace(value=None) for interval in every
        ]

    def starts(self) -> list[Stated]:
        """Return the times of the first sample, s, that entries state."""
        return [*self._entries(STARTS, self._second)]

    def count(self) -> int | None:
        """Return the number of samples."""
        counts = (entry.value for entry in self._entries(COUNTS, lambda _: 1.0))
        return next((int(value) for value in counts if value is not None and value >= 1.0), None)

    def _second(self, text: str) -> float | None:
        """Return the size of a unit of time, s; of no text that of "Horizontal Units". None of other text."""
        keyed = next(iter(self._keyed(TIME_UNITS, 1)), None)
        unit = _unit_of(text, TIME) if text else keyed
        fits = unit is not None and unit.quantity == TIME
        return unit.size if unit is not None and fits else None if text else 1.0

    def _keyed(self, names: set[str], column: int) -> Iterator[Unit]:
        """Yield the units of lines such as "Vertical Units,V"."""
        wanted = TIME if names is TIME_UNITS else FORCE
        for row in self._first:
            if not row or key_of(row[0]) not in names:
                continue
            if (rest := re.split(r"[:=]", row[0], maxsplit=1)[1:]) and rest[0].strip():
                row = [row[0], rest[0].strip(), *row[1:]]
            values = [cell for cell in row[1:] if cell and not _is_number(cell)]
            of_column = row[column : column + 1] if 0 < column < len(row) else values[:1]
            texts = values if len(set(values)) == 1 else of_column
            texts = [re.sub(r"^\w+\s*:\s*", "", text).strip("()[] ") for text in texts]  # "CH1:V"
            yield from (_unit_of(text, wanted) or Unit(text, UNKNOWN) for text in texts[:1] if text)

    def _entries(self, names: set[str], size_of: Callable[[str], float | None]) -> Iterator[Stated]:
        """Yield each entry with one of these names, whose value stands in the next cell, or in the line below.

        A unit that is attached to the name or the value, or that stands alone after these, must be one.
        """
        for row, below in zip(self._first, [*self._first[1:], []], strict=True):
            for k, cell in enumerate(row):
                word, _, rest = re.sub(r"[:=]", "\0", cell, count=1).partition("\0")
                if key_of(word) not in names:
                    continue
                beside, under = [*row, "", ""][k + 1 : k + 3], [*below, *[""] * (k + 2)][k : k + 2]
                aside = "" if key_of(beside[0]) in KEYS else beside[0]
                alone = sum(map(bool, row)) <= len(("name", "value", "unit"))
                for text, after in ((rest, ""), beside, *([under] if k or not aside else [])):
                    value = NUMBER_AND_UNIT.fullmatch(text.replace(",", "."))
                    if value and _is_number(value[1]):
                        unit = value[2] or _bracketed(word)
                        later = "" if unit or _is_number(after.replace(",", ".")) else after
                        size = size_of(unit or later)
                        if size is None and later and not (alone and text is beside[0]):
                            size = size_of("")
                        shown = f"{text} {later}".strip()
                        yield Stated(word.strip(), shown, None if size is None else size * float(value[1]))
                        break
                else:
                    yield Stated(word.strip(), rest.strip() or aside or (under[0] if k else ""), None)


def quantity_of(text: str, wanted: str) -> Unit | None:
    """Return a unit of a quantity, as an argument gives it; None where it is none."""
    unit = _unit_of(text, wanted)
    return unit if unit is not None and unit.quantity == wanted else None


def _cells(row: Sequence[str], columns: int, join: bool = True) -> list[str]:
    """Return the cells without comment signs and quotes; a cell that only holds a unit joins the name before it if
    there are too many cells."""
    cells = [cell.strip().strip('"').strip() for cell in row]
    if cells:
        cells[0] = cells[0].lstrip("#%/* ").strip()
    if join and cells and not cells[0] and len(cells) > columns:
        cells = cells[1:]
    while cells and not cells[-1]:
        cells.pop()
    if not join or len(cells) <= columns or any(map(_is_number, cells)):
        return cells
    joined: list[str] = []
    bracketed = any(re.fullmatch(r"[(\[].*[)\]]", cell) for cell in cells)
    for cell in cells:
        bare = cell.strip("()[] ")
        is_unit_of_name = bare != cell if bracketed else bool(joined) and _unit_of(joined[-1], TIME) is None
        if joined and is_unit_of_name and _unit_of(bare, TIME) is not None:
            joined[-1] += f" ({bare})"
        else:
            joined.append(cell)
    return joined if len(joined) == columns else cells


def key_of(cell: str) -> str:
    return re.sub(r"[^a-z0-9]", "", re.split(r"[(\[:=]", cell.lower())[0])


def _is_number(cell: str) -> bool:
    """Return whether a cell is a finite number."""
    try:
        return isfinite(float(cell))
    except ValueError:
        return False


def _hertz(text: str) -> float | None:
    """Return Hz, kHz, MSa/s, or nothing, in Hz; None of other text."""
    rate = re.sub(r"(samples?|sa|s)(/s(ec)?|ps)$", "Hz", text.strip(), flags=re.IGNORECASE)
    try:
        return float(factor(rate, "Hz")) if rate else 1.0
    except ValueError:
        return None


def _bracketed(cell: str) -> str:
    match = re.search(r"[(\[<{]([^()\[\]<>{}]*)[)\]>}]", cell)
    return match[1].strip() if match else ""


def _is_row_of_units(row: Iterable[str]) -> bool:
    """Return whether each cell is a unit, and one of them a time: "s,V" or "second,Volt"."""
    units = [_unit_of(cell.strip("()[] "), TIME) for cell in row if cell]
    return len(units) > 1 and all(units) and any(unit and re.fullmatch(r"[a-z]*second", unit.name) for unit in units)


def _stated(cell: str, wanted: str, in_row_of_units: bool) -> Unit | None:
    """Return the unit that a cell states: "(ms)", "Time [ms]", "Time in ms", "t/ms", "time_ms", "Time ms", "timeMs",
    "ms"."""
    if not cell or _is_number(cell) or RATE.search(cell):
        return None
    if FACTOR.search(cell):
        return Unit(cell, UNKNOWN)
    if brackets := re.findall(r"[(\[<{]\s*([^()\[\]<>{}]+?)\s*[)\]>}]", cell):
        candidates = [_first_unit(text, wanted) for text in brackets]
        fitting = [unit for unit in candidates if unit.quantity == wanted] or candidates[-1:]
        return fitting[0] if len({unit.of_table for unit in fitting}) == 1 else Unit(cell, UNKNOWN)
    if word := re.search(r"\bin\s+(\S+)$", cell):
        return _unit_of(word[1], wanted) or Unit(word[1], UNKNOWN)
    if in_row_of_units:
        return _unit_of(cell, wanted)
    if (word := re.search(r"\w\s*/\s*([^/\s]+)$", cell)) and cell.lower() != "n/a":
        return _unit_of(word[1], wanted)
    words = [word for word in re.split(r"[\s,;:=_.-]+|(?<=[a-z]{2})(?=[UMN]s$)", cell) if word]
    if words and words[-1].startswith("dB"):
        return Unit(words[-1], UNKNOWN)
    units = [unit for word in (*words[-1:], *words[:1]) if (unit := _unit_of(word, wanted))]
    return next((unit for unit in units if _is_sure(unit, wanted)), None)


def _first_unit(text: str, wanted: str) -> Unit:
    """Return the unit in brackets: one word, or the only unit among words without digits."""
    if unit := _unit_of(text, wanted):
        return unit
    words = [word for word in BETWEEN_WORDS.split(text) if word]
    units = [
        unit for unit in (_unit_of(word, wanted) for word in words) if unit is not None and unit.quantity == wanted
    ]
    return units[0] if len(units) == 1 and not re.search(r"\d", text) else Unit(text, UNKNOWN)


def _is_sure(unit: Unit, wanted: str) -> bool:
    """Return whether a word without brackets is surely a unit: "Channel A" holds no ampere, and "max/min" no minute."""
    names = r".*(second|volt|newton|force_\w+|dyne)$" if unit.quantity == wanted else "(milli|micro|nano|pico|kilo)"
    return unit.quantity in (wanted, OTHER) and re.match(names, unit.name) is not None


@cache
def _unit_of(text: str, wanted: str) -> Unit | None:
    """Return a unit by its name; of several readings, such as S for siemens and seconds, that which is wanted."""
    word = SECOND.sub("second", text.strip().strip(".").replace("Âµ", "µ"))
    if not word or _is_number(word):
        return None
    words = dict.fromkeys([word, word.lower(), word[:-1].lower() + word[-1].upper()])
    units = [
        Unit(text, quantity, si, size, is_unit(w))
        for w in words
        for si, quantity in SI.items()
        if (size := _size(w, si))
    ]
    if best := [unit for unit in units if unit.quantity == wanted]:
        return best[0]
    if (name := is_unit(word)) and not (units and units[0].name == name):
        return Unit(text, OTHER, name=name)
    return units[0] if units else None


def _size(word: str, si: str) -> float:
    try:
        return float(factor(word, si))
    except ValueError:
        return 0.0
