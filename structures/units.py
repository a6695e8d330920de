"""Units by name, and texts such as "2.29 mm". pint knows the units; conversions are exact before rounding."""

import math
import re
from collections.abc import Iterable
from contextlib import suppress
from decimal import Decimal
from functools import cache
from tokenize import TokenError
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    import pint

NUMBER = re.compile(r"\s*([-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*", re.DOTALL)

UNIT_TEXT = re.compile(r"(?:1 ?/ ?)?[A-Za-zµμΩ°](?:[\w µμΩ°·*/^²³⁴⁻¹-]|(?<=\^\d)\.\d){0,40}")
"""Letters with powers, such as m^1.5, their products and quotients. The parser gets nothing else."""

LARGEST_POWER = re.compile(r"(\*\*|\^)\s*-?\d{2,}|\d{3,}")  # units have no powers of two digits

# The exceptions of pint, in addition to its own, for a text that is not a unit.
NO_UNIT = (ArithmeticError, AssertionError, AttributeError, KeyError, SyntaxError, TokenError, TypeError, ValueError)

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))

# Units of relative uncertainties.
PARTS = {"%": 1e-2, "percent": 1e-2, "permille": 1e-3, "‰": 1e-3, "ppm": 1e-6}

WITHOUT_PREFIX = ("", "1", "rad", "N")


@cache
def _registry() -> "pint.UnitRegistry[Any]":
    import pint

    return pint.UnitRegistry(non_int_type=Decimal, cache_folder=None, autoconvert_offset_to_baseunit=False)


def _parsed(text: str, number: Decimal = Decimal(1)) -> Any:
    """Return a number of a unit as a quantity of pint; raise a ValueError if the text is not a unit."""
    import pint

    if (not text or UNIT_TEXT.fullmatch(text)) and not LARGEST_POWER.search(text):
        with suppress(pint.PintError, *NO_UNIT):
            return _registry().Quantity(number, _registry().parse_units(text))
    raise ValueError(f'"{text}" is not a unit')


@cache
def factor(text: str, unit: str) -> Decimal:
    """Return the factor from a unit given as text to `unit`; raise a ValueError if it is not a unit of this kind."""
    import pint

    one, wanted = _parsed(text), _parsed(unit)
    try:
        return Decimal(one.to(wanted.units).magnitude)
    except (pint.PintError, *NO_UNIT):
        raise ValueError(f'"{text}" is not a unit of this quantity') from None


@cache
def is_unit(text: str) -> str:
    """Return the full name of a unit, such as "microsecond" for "us", or "" for a text that is not a unit."""
    try:
        return str(_parsed(text).units) if text else ""
    except ValueError:
        return ""


def in_si(text: str) -> float:
    """Return the value in SI units of a text such as "2.29 mm"; NaN for a text that is not a quantity."""
    import pint

    match = NUMBER.fullmatch(text)
    try:
        quantity = _parsed(match[2], Decimal(match[1].replace("_", ""))) if match else None
        return math.nan if quantity is None else float(quantity.to_base_units().magnitude)
    except (pint.PintError, *NO_UNIT):
        return math.nan


def spread_of(text: str, value: float) -> float:
    """Return a standard uncertainty in SI units, also from a relative one such as "2 %"; NaN if it is not valid."""
    match = NUMBER.fullmatch(text)
    part = PARTS.get(match[2], 0.0) if match else 0.0
    number = in_si(match[1]) * part * abs(value) if part and match else in_si(text)
    # A temperature in °C is not a difference.
    shifted = match and not part and match[2] and in_si(f"0 {match[2]}") != 0.0
    return number if math.isfinite(number) and number > 0.0 and not shifted else math.nan


def handy(values: Iterable[float] | NDArray[np.float64], unit: str) -> tuple[float, str]:
    """Return the factor to, and the name of, the unit with the prefix that makes the greatest value at least 1."""
    sizes = np.abs(np.asarray(values, dtype=float))
    sizes = sizes[np.isfinite(sizes)]
    top = float(sizes.max(initial=0.0))
    # Compound units such as m/s and kg/m³ get no prefix either.
    if unit in WITHOUT_PREFIX or set("/ ²") & set(unit) or top == 0.0 or (unit == "kg" and top >= 1.0):
        return 1.0, "" if unit == "1" else unit
    grams, unit = (1e3, "g") if unit == "kg" else (1.0, unit)  # the kilogram has a prefix already
    size, letter = next((prefix for prefix in PREFIXES if grams * top >= prefix[0]), PREFIXES[-1])
    return grams / size, f"{letter}{unit}"


def readable(value: float, unit: str, digits: int = 3) -> str:
    """Return a quantity, given in SI units, for a message, with a suitable prefix: "2.29 mm"."""
    # Rounded before the prefix is chosen, so that 999.9 µs becomes 1 ms; `.6g` avoids an exponent.
    rounded = float(f"{value:.{digits}g}")
    factor, unit = handy([rounded], unit)
    return f"{factor * rounded:.6g} {unit}".rstrip()
