"""Tables of numbers whose heads name the columns and their units; what a head leaves open is refused."""

import re
from collections.abc import Mapping, Sequence
from math import pi
from pathlib import Path
from typing import NamedTuple

from structures.checks import count_of
from structures.other_programs.matrix_files import Vector, numbers_in

SPELLINGS = (
    (r"[\[\](){}_,:;=]", " "), (r"\s*(?:sqrt|√)\s*", "√"), (r"\btonnes?\b", "t"), (r"\bper ?cent\b", "%"),
    (r"\bsec\b", "s"), (r"\b(kg|t) ?(?:\^|\*\*)? ?[-\u2212] ?(?:0\.5|½|1 ?/ ?2)", r"1/√\1"), (r"\s*/\s*", "/"),
    (r"(?<=s)(?:\^|\*\*)?2\b", "²"), (r"(?<=\w)[·*](?=\w)|\s+", " "),
    (r"/n s\b", "/s/n"),
)  # fmt: skip
"""How people write units, and how the tables below do."""

STATES_UNIT = re.compile(r"(?<!\bre)(?<!\bim)[\[({/%]|\bin\b", re.IGNORECASE)


class Head(NamedTuple):
    """The heads of a quantity: words that they have, and units with what each is worth; "" where none is stated."""

    quantity: str
    words: str
    units: Mapping[str, float]


class Column(NamedTuple):
    """The values of a column in the unit that is wanted, and the unit that its head states, or ""."""

    values: Vector
    unit: str


FREQUENCY = (
    Head("frequency", r"eigen ?values?|lambda|λ|period", {}),
    Head("frequency", r"omega|ω|angular|circular", {"rad/s": 0.5 / pi}),
    Head("frequency", r"freq|eigenf|^f$|hz$|rad/s$", {"": 1.0, "Hz": 1.0, "kHz": 1e3, "rad/s": 0.5 / pi}),
)
COUNTER = Head("", r"^(mode )?(mode|#|no|nr|n|number|index)\.?$", {"": 1.0})


def table_in(what: str, path: Path, heads: Sequence[Head], optional: Sequence[str] = ()) -> dict[str, Column]:
    """Return the columns of a text by quantity. Without heads, they stand in the order of the quantities.

    what: how messages begin. Raises ValueError for heads that are not understood, or that say what is not read.
    """
    names = list(dict.fromkeys(head.quantity for head in heads))
    needed = len(names) - len(optional)
    said = f"must be {', '.join(names)}, with heads such as {_example(heads)!r}"
    lines, table = numbers_in(what, path, tuple(range(needed, len(names) + 2)))
    cells = _cells(what, lines, table.shape[1], heads, said)
    plain = [_plain(cell) for cell in cells]
    of = [next((head for head in (COUNTER, *heads) if re.search(head.words, text)), None) for text in plain]
    left = [name for name in names if name not in {head.quantity for head in of if head}]
    columns = dict[str, Column]()
    for place, (cell, text, head) in enumerate(zip(cells, plain, of, strict=True)):
        known = head is not None
        if head is None:
            if not left:
                raise ValueError(f"{what}: has {count_of(len(cells), 'column')} of numbers: {said}")
            name = left.pop(0)
            head = next(one for one in reversed(heads) if one.quantity == name)
        unit = _unit(what, cell, text, head, "" if known else f"is of no column: {said}")
        if head.quantity in columns:
            raise ValueError(f"{what}: the head {cell!r} is a second one of {head.quantity}; keep one column of each")
        columns[head.quantity] = Column(head.units[unit] * table[:, place], unit)
    columns.pop("", None)
    if lacking := [name for name in names if name not in columns and name not in optional]:
        raise ValueError(f"{what}: has no column {lacking[0]}: {said}")
    first = columns[names[0]].values
    if not any(cells) and first.size > 1 and (first == range(1, first.size + 1)).all():
        raise ValueError(f"{what}: its first column counts 1, 2 …, and nothing says of what: {said}")
    return columns


def _example(heads: Sequence[Head]) -> str:
    units = {head.quantity: next((unit for unit in head.units if unit), "") for head in heads}
    return ", ".join(f"{name} ({unit})" if unit else name for name, unit in units.items())


def _cells(what: str, lines: Sequence[str], count: int, heads: Sequence[Head], said: str) -> list[str]:
    """Return the head of each column, from the line above the numbers, or the two, if the second holds units alone."""
    rows = [_split(line, count) for line in reversed(lines[-2:])]
    units = {unit for head in heads for unit in map(str.casefold, head.units)} | {""}
    if len(rows) == 2 and all(rows) and any(rows[0]) and all(_plain(cell) in units for cell in rows[0]):
        return [f"{name} [{unit}]" if unit else name for unit, name in zip(*rows, strict=True)]
    if rows and not rows[0] and any(re.search(head.words, _plain(lines[-1])) for head in heads):
        raise ValueError(f"{what}: the line {lines[-1][:80]!r} does not divide into heads of {count} columns: {said}")
    return rows[0] if rows and rows[0] else [""] * count


def _split(line: str, count: int) -> list[str]:
    """Return the cells of a line, if it has as many as there are columns; [] if it has not."""
    ways = (r"[,;]", r"\t", r"\s{2,}", r"\s+(?![\[(/%])", r"\s+")
    rows = ([cell.strip(" \"'\t") for cell in re.split(way, line)] for way in ways)
    return next((row for row in rows if len(row) == count), [])


def _plain(cell: str) -> str:
    text = cell.casefold()
    for spelling, ours in SPELLINGS:
        text = re.sub(spelling, ours, text).strip()
    return text


def _unit(what: str, cell: str, text: str, head: Head, unknown: str) -> str:
    """Return the unit of a head, as the table of its quantity writes it; unknown: what to say if it names none."""
    for unit in sorted(filter(None, head.units), key=len, reverse=True):
        if re.search(rf"(?:^|[\s/]){re.escape(unit.casefold())}$", text) or (unit == "%" and text.endswith("%")):
            return unit
    if not head.units:
        known = f"names no {head.quantity}; convert the column"
    elif "" in head.units and not STATES_UNIT.search(cell):
        return ""
    else:
        units = [*filter(None, head.units)]
        known = f"must state {'one of' if len(units) > 1 else 'its unit,'} {', '.join(units)}"
    raise ValueError(f"{what}: the head {cell!r} {unknown or known}")
