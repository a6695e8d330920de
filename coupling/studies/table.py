"""The table that a study prints: quantity, thesis, hertzlink, difference, reason."""

from collections.abc import Sequence
from textwrap import wrap
from typing import NamedTuple

REASON_WIDTH = 58


class Row(NamedTuple):
    """One comparison. Numbers are in `unit`; a text stands for what is not a number."""

    quantity: str
    thesis: float | str
    ours: float | str
    unit: str = ""
    reason: str = ""


def text(rows: Sequence[Row]) -> str:
    """The rows as a plain table, reasons wrapped."""
    head = ("quantity", "thesis", "hertzlink", "difference", "reason")
    cells = [(_with_unit(row), _number(row.thesis), _number(row.ours), _difference(row), row.reason) for row in rows]
    widths = [max(len(line[i]) for line in [head, *cells]) for i in range(4)]
    lines = [_line(head, widths), "-" * (sum(widths) + 8 + REASON_WIDTH)]
    for *columns, reason in cells:
        first, *more = wrap(reason, REASON_WIDTH) or [""]
        lines.append(_line((*columns, first), widths))
        lines.extend(" " * (sum(widths) + 8) + line for line in more)
    return "\n".join(line.rstrip() for line in lines)


def _line(columns: Sequence[str], widths: Sequence[int]) -> str:
    quantity, *numbers, reason = columns
    aligned = [number.rjust(width) for number, width in zip(numbers, widths[1:], strict=True)]
    return "  ".join([quantity.ljust(widths[0]), *aligned, reason])


def _with_unit(row: Row) -> str:
    return f"{row.quantity}, {row.unit}" if row.unit else row.quantity


def _number(value: float | str) -> str:
    return value if isinstance(value, str) else f"{value:.4g}"


def _difference(row: Row) -> str:
    if isinstance(row.thesis, str) or isinstance(row.ours, str) or row.thesis == 0.0:
        return ""
    return f"{100.0 * (row.ours / row.thesis - 1.0):+.1f} %"
