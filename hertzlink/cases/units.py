"""Numbers with units: SI, or a text such as "2.29 mm", converted exactly before it is rounded."""

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from structures.checks import short

if TYPE_CHECKING:
    import pint

NUMBER = re.compile(r"\s*([-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*(.*?)\s*", re.DOTALL)

UNIT_TEXT = re.compile(r"[A-Za-zµμΩ°][\w µμΩ°·*/^²³⁴⁻¹-]{0,40}")
"""Units are letters with powers, products and quotients; nothing else is given to the parser."""

DEGREES = ("deg", "degree", "degrees", "°")
"""Converted as Python's math.radians does, to the last bit."""

LARGEST_POWER = re.compile(r"(\*\*|\^)\s*-?\d{2,}|\d{3,}")
"""Powers of two digits: no unit has them."""


def fault(message: str) -> PydanticCustomError:
    """An error of validation with a message of our own."""
    return PydanticCustomError("case", "{message}", {"message": message})


@cache
def _registry() -> "pint.UnitRegistry[Any]":
    import pint

    return pint.UnitRegistry(non_int_type=Decimal, cache_folder=None, autoconvert_offset_to_baseunit=False)


@cache
def factor(text: str, unit: str) -> Decimal:
    """How many of `unit` a unit given as text is; a ValueError that says why it is none."""
    import pint

    registry = _registry()
    if not UNIT_TEXT.fullmatch(text) or LARGEST_POWER.search(text):
        raise ValueError(f'"{text}" is no unit')
    try:
        found = registry.parse_units(text)
        wanted = registry.parse_units(unit) if unit else registry.parse_units("dimensionless")
        return Decimal(registry.Quantity(Decimal(1), found).to(wanted).magnitude)
    except pint.DimensionalityError:
        raise ValueError(f'"{text}" is no unit of this quantity') from None
    except (pint.PintError, AttributeError, ArithmeticError, KeyError, TypeError, ValueError):
        raise ValueError(f'"{text}" is no unit') from None


def in_si(text: str) -> float:
    """The number in SI units that a text such as "2.29 mm" means; NaN for a text that means none."""
    import pint

    found = NUMBER.fullmatch(text)
    if found is None or not UNIT_TEXT.fullmatch(found[2] or "m") or LARGEST_POWER.search(found[2]):
        return math.nan
    registry = _registry()
    try:
        quantity = registry.Quantity(Decimal(found[1].replace("_", "")), registry.parse_units(found[2]))
        return float(quantity.to_base_units().magnitude)
    except (pint.PintError, AttributeError, ArithmeticError, KeyError, TypeError, ValueError):
        return math.nan


@dataclass(frozen=True)
class Unit:
    """The annotation of a number: its SI unit, what it is, and an example of a text."""

    unit: str
    what: str
    example: str

    @property
    def hint(self) -> str:
        """What to write."""
        if not self.unit:
            return f"give {self.what}, such as {self.example}"
        return f'give {self.what}, such as "{self.example}", or a number in {self.unit}'

    @cached_property
    def _words(self) -> str:
        return f"must be {self.what}, such as {self.example}" + (f", or a number in {self.unit}" if self.unit else "")

    def read(self, given: Any) -> float:
        """The number in the SI unit; a validation error for anything else."""
        if isinstance(given, int | float) and not isinstance(given, bool):
            if not math.isfinite(given):
                raise fault(f"{given} is not finite; {self._words}")
            return float(given)
        if not isinstance(given, str):
            raise fault(f"{shown(given)} {self._words}")
        found = NUMBER.fullmatch(given)
        if found is None or found[2].startswith(","):
            comma = "; write a decimal point" if re.search(r"\d,\d", given) else ""
            raise fault(f'"{given}" {self._words}{comma}')
        number, unit = Decimal(found[1].replace("_", "")), found[2]
        if not unit:
            raise fault(f'"{given}" has no unit; {self._words}') if self.unit else fault(f'"{given}" {self._words}')
        try:
            degrees = self.unit == "rad" and unit in DEGREES
            value = math.radians(float(number)) if degrees else float(number * factor(unit, self.unit))
        except ValueError as error:
            raise fault(f'"{given}": {error}; {self._words}') from None
        if not math.isfinite(value):
            raise fault(f'"{given}" is not finite; {self._words}')
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        words = f"{self.what}: a number in {self.unit}, or a text such as {self.example}" if self.unit else self.what
        return {"type": ["number", "string"], "description": words}


def shown(value: Any) -> str:
    """A value as TOML writes it, in short."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"' if len(value) < 60 else f'"{value[:60]}…"'
    if isinstance(value, dict):
        return "a table"
    return short(value)
