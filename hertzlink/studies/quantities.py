"""Numbers with units and names of materials as a user types them."""

import re
from decimal import Decimal
from difflib import get_close_matches

from structures.checks import short
from structures.material import MATERIALS, Material

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
    from hertzlink.cases.units import factor

    try:
        return float(Decimal(found[1]) * factor(found[2], unit))
    except ValueError as error:
        raise ValueError(f"{error}; must be {what}") from None


def material(text: str) -> Material:
    """The material of this name, or the only one whose name begins so; a ValueError names the nearest."""
    key = _key(text)
    starting = [name for name in MATERIALS if key and _key(name).startswith(key)]
    exact = [name for name in starting if _key(name) == key]
    if len(exact or starting) == 1:
        return MATERIALS[(exact or starting)[0]]
    if starting:
        raise ValueError(f"there are {' and '.join(starting)}; give the whole name")
    keys = {_key(name): name for name in MATERIALS} | {_key(name.split()[0]): name for name in MATERIALS}
    near = dict.fromkeys(keys[one] for one in get_close_matches(key, keys, n=3, cutoff=0.6))
    meant = f"did you mean {' or '.join(near)}? " if near else ""
    raise ValueError(f"no such material; {meant}Known are {', '.join(MATERIALS)}")


def printed(value: float, unit: str = "") -> str:
    """A value with its unit, in the digits that a user would type."""
    return f"{value:.6g} {unit}".rstrip()


def _key(name: str) -> str:
    return "".join(letter for letter in short(name).lower() if letter.isalnum()).replace("aluminum", "aluminium")
