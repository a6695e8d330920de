"""The head of a text: the names and units of columns in the lines above the samples."""

import re
from collections.abc import Sequence
from functools import cache
from typing import NamedTuple

from structures.units import factor, is_unit

TIME, FORCE = ("s",), ("V", "N")  # The SI units of columns: of times, and of voltages or forces.
WHAT = {TIME: "a time, such as 's', 'ms' or 'us'", FORCE: "a voltage or a force, such as 'V', 'mV' or 'N'"}

NEAREST = 3  # Lines directly above the samples that may name columns and units.

# Abbreviations and translations of seconds; a factor beside a name or a unit, such as "t*1000 (s)".
SECOND = re.compile(r"(se[ck](unde|onde?)?[ns]?\.?)$", re.IGNORECASE)
MULTIPLIED = re.compile(r"\bx\s*1[0eE]\S*\s+\S|\w\s*[×*·]\s*\d|\d\s*[×*·]")
BRACKETS = re.compile(r"[(\[<{]\s*([^()\[\]<>{}]+?)\s*[)\]>}]")
NUMBER = re.compile(r"[-+.:/ ]*\d[-+\d.:/eE ]*")


class Unit(NamedTuple):
    """A unit that a file states."""

    text: str = ""  # in the words of the file; "" if it states none
    si: str = ""  # the SI unit of the same quantity; "" if the text is not a unit
    size: float = 1.0  # in the SI unit


@cache
def read_unit(text: str, kind: tuple[str, ...]) -> Unit:
    """Return the unit of a time (TIME), or of a voltage or force (FORCE)."""
    word = SECOND.sub("second", text.strip().strip(".").replace("Âµ", "µ"))
    for spelling in (word, word.lower(), word[:-1].lower() + word[-1:].upper()) if len(word) > 1 else (word,):
        for si in kind:
            try:
                return Unit(text, si, float(factor(spelling, si))) if spelling else Unit(text)
            except ValueError:
                continue
    return Unit(text)


class Head:
    """The cells above the samples. width: the number of columns. first: the first lines of the file; they may also hold
    entries such as "Vertical Units,V" beside the samples."""

    def __init__(self, rows: Sequence[Sequence[str]], width: int, first: Sequence[Sequence[str]]) -> None:
        # A row with a number is an entry, such as "Points,1000", or a date; it does not name columns.
        near = [row for row in map(_bare, rows[-NEAREST:]) if row and not any(map(NUMBER.fullmatch, row))]
        self._names = [row for row in reversed(near) if len(row) == width]
        self._beside = [row for row in near if len(row) != width]
        self._entries = [row for row in map(_bare, first) if row and "unit" in row[0].lower()]

    def name(self, column: int) -> str:
        """Return the name of a column in the head, "" if it has none."""
        names = [c for row in self._names if (c := row[column]) and not read_unit(c.strip("()[]"), FORCE).si]
        return re.split(r"\s*[(\[](?!\d+\])", names[0])[0] if names else ""

    def unit(self, column: int, kind: tuple[str, ...]) -> Unit:
        """Return the unit that the head states of a column."""
        units = list[Unit]()
        for row in self._names:
            # A row may hold only units, the first of them that of a time: "s,V" or "second,Volt".
            bare = [cell.strip("()[] ") for cell in row]
            are_units = len(bare) > 1 and bool(
                read_unit(bare[0], TIME).si and all(is_unit(SECOND.sub("s", c)) for c in bare)
            )
            units += [unit] if not units and (unit := stated_unit(row[column], kind, are_units)).text else []
        for name, *cells in self._entries:
            if (re.match(r"\W*(x|h|t)", name, re.IGNORECASE) is not None) == (kind == TIME):
                units += [read_unit(cell.strip("()[] "), kind) for cell in cells if cell and not NUMBER.fullmatch(cell)]
        if units:
            is_one = len({unit[1:] if unit.si else unit for unit in units}) == 1
            return units[0] if is_one else Unit(" and ".join(unit.text for unit in units))
        # Cells that are not above the columns cannot be attributed to them, except if they state the usual unit.
        for row in self._beside:
            units = [unit for cell in row if (unit := stated_unit(cell, kind, True)).text]
            of_others = [bool(read_unit(unit.text, FORCE if kind == TIME else TIME).si) for unit in units]
            if any(unit[1:] != (kind[0], 1.0) and not other for unit, other in zip(units, of_others, strict=True)):
                return Unit(", ".join(row))
        return Unit()


def _bare(row: Sequence[str]) -> list[str]:
    """Return cells without quotes, marks of comments and empty cells at the end; "Units: V" becomes two cells."""
    first, *others = (cell.strip(' "\t') for cell in row)
    begin = [cell.strip() for cell in re.split("[:=]", first)] if "unit" in first.lower() else [first]
    cells = [begin[0].lstrip("#%/* "), *begin[1:], *others]
    while cells and not cells[-1]:
        cells.pop()
    return cells


def stated_unit(cell: str, kind: tuple[str, ...], is_alone: bool) -> Unit:
    """Return the unit in "Time (ms)", "Time in ms", "t/ms", "time_ms" or "Time ms", with is_alone also in "ms"."""
    if MULTIPLIED.search(cell):
        return Unit(cell)
    if brackets := BRACKETS.findall(cell):
        units = {unit for text in brackets if (unit := read_unit(text, kind)).si}
        return units.pop() if len(units) == 1 else Unit(cell if units else brackets[-1])
    text, must_be_one = cell, is_alone and bool(is_unit(cell))
    if marked := re.search(r"\bin\s+(\S+)$|[\w.]\s*/\s*([^/\s]+)$", cell):
        text, must_be_one = marked[1] or marked[2], bool(marked[1])
    elif not is_alone:
        text = re.split(r"[\s_.,-]+|(?<=[a-z]{2})(?=[UMN]s$)", cell)[-1]
        if len(text) < 2 and kind == FORCE:
            return Unit()  # "Channel A", "bead N"
        # A unit of another quantity.
        must_be_one = text.startswith("dB") or bool(re.match("(milli|micro|nano|pico|kilo)", is_unit(text)))
    unit = read_unit(text, kind)
    return unit if unit.si or must_be_one else Unit()
