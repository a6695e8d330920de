"""Numbers with units and names of materials as a user types them."""

import re
from collections.abc import Iterable
from decimal import Decimal

from hertzlink._hints import nearest
from structures.material import MATERIALS, Material

READABLE = {"m": ("mm", 1e3), "s": ("ms", 1e3), "Pa": ("GPa", 1e-9)}
"""The units in which values are printed, and how many make one of the SI unit."""

WITH_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*([A-Za-zµμ°].*?)\s*")
"""A number and a unit."""


def quantity(text: str, unit: str) -> float:
    """The number that a user typed, in the unit; a ValueError that says what would be right.

    All studies read their numbers here: in the unit itself, or with one of its kind, as "1 mm". unit: "m", "m/s"; empty
    for a number without one.
    """
    try:
        return float(text)
    except ValueError:
        found = WITH_UNIT.fullmatch(text) if unit else None
    what = f"a number of {unit}, as 0.001, 1e-3 or with its unit" if unit else "a number, as 0.001 or 1e-3"
    if found is None:
        raise ValueError(f"must be {what}")
    # Here: only those who type units need them.
    from structures.units import factor

    try:
        return float(Decimal(found[1]) * factor(found[2], unit))
    except ValueError as error:
        raise ValueError(f"{error}; must be {what}") from None


def material(text: str) -> Material:
    """The material of this name, or the only one of this first word; a ValueError names the nearest."""
    meant = MATERIALS.meant(text)
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise ValueError(f"there are {' and '.join(one.name for one in meant)}; give the whole name")
    raise ValueError(f"no such material; {nearest(text, list(MATERIALS))}")


def printed(values: Iterable[float], unit: str = "", words: str = "{}") -> str:
    """Values with their unit, in the digits that a user would type. words: what stands around the numbers."""
    unit, factor = READABLE.get(unit, (unit, 1.0))
    return f"{words.format(*(f'{factor * one:.6g}' for one in values))} {unit}".rstrip()
