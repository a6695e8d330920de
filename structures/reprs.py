"""Short HTML tables by which notebooks show chains, structures, plates, waves and laws."""

from collections.abc import Sequence
from html import escape


def html_table(title: str, rows: Sequence[tuple[str, str]]) -> str:
    """A table of names and values under a title."""
    cells = "".join(f"<tr><th>{escape(name)}</th><td>{escape(value)}</td></tr>" for name, value in rows)
    return f"<table><caption>{escape(title)}</caption><tbody>{cells}</tbody></table>"
