"""Short HTML tables by which notebooks show chains, structures, plates, waves and laws."""

from collections.abc import Sequence
from html import escape

LEFT = ' style="text-align: left"'
"""Notebooks align the cells of tables to the right, which suits numbers but not words."""

CAPTION = ' style="text-align: left; font-weight: bold; white-space: nowrap"'


def html_table(title: str, rows: Sequence[tuple[str, str]]) -> str:
    """Return a table of names and values under a title."""
    cells = "".join(f"<tr><th{LEFT}>{escape(name)}</th><td{LEFT}>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table><caption{CAPTION}>{escape(title)}</caption><tbody>{cells}</tbody></table>"
