"""The entries of a case that are numbers: SI, or a text with a unit such as "2.29 mm"."""

import math
import re
from dataclasses import dataclass
from decimal import Decimal
from functools import cached_property
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from structures.checks import short
from structures.described import noted
from structures.quantities import Quantity
from structures.units import NUMBER, factor

DEGREES = ("deg", "degree", "degrees", "°")
"""Converted as Python's math.radians does, to the last bit."""


def fault(message: str) -> PydanticCustomError:
    """Return an error of validation with a message of our own."""
    return PydanticCustomError("case", "{message}", {"message": message})


@dataclass(frozen=True)
class Unit:
    """The annotation of a number: its SI unit, what it is, and an example of a text."""

    unit: str
    what: str
    example: str

    @classmethod
    def of(cls, quantity: Quantity) -> "Unit":
        """Return that of a quantity."""
        unit, example = quantity.unit_in_files, quantity.example
        # A quantity of a user's own may have no example.
        return cls(unit, quantity.noun, f"{example} {unit}".strip() if example == Quantity.example else example)

    @classmethod
    def noted(cls, hint: Any) -> "Unit":
        """Return that of the quantity of an annotation, such as quantities.Length."""
        return cls.of(next(note for note in noted(hint)[1] if isinstance(note, Quantity)))

    @property
    def hint(self) -> str:
        """The words for a message."""
        if not self.unit:
            return f"give {self.what}, such as {self.example}"
        return f'give {self.what}, such as "{self.example}", or a number in {self.unit}'

    @cached_property
    def _words(self) -> str:
        return f"must be {self.what}, such as {self.example}" + (f", or a number in {self.unit}" if self.unit else "")

    def read(self, typed: Any) -> float:
        """Return the number in the SI unit; a validation error for anything else."""
        if isinstance(typed, int | float) and not isinstance(typed, bool):
            try:
                plain = float(typed)
            except OverflowError:
                plain = math.inf
            if not math.isfinite(plain):
                raise fault(f"{shown(typed)} is not finite; {self._words}")
            return plain
        if not isinstance(typed, str):
            raise fault(f"{shown(typed)} {self._words}")
        match = NUMBER.fullmatch(typed)
        if match is None or match[2].startswith(","):
            comma = "; write a decimal point" if re.search(r"\d,\d", typed) else ""
            raise fault(f"{shown(typed)} {self._words}{comma}")
        number, unit = Decimal(match[1].replace("_", "")), match[2]
        if not unit:
            lack = "has no unit; " if self.unit else ""
            raise fault(f"{shown(typed)} {lack}{self._words}")
        try:
            degrees = self.unit == "rad" and unit in DEGREES
            value = math.radians(float(number)) if degrees else float(number * factor(unit, self.unit))
        except ValueError as error:
            raise fault(f"{shown(typed)}: {error}; {self._words}") from None
        if not math.isfinite(value):
            raise fault(f"{shown(typed)} is not finite; {self._words}")
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.read)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        words = f"{self.what}: a number in {self.unit}, or a text such as {self.example}" if self.unit else self.what
        return {"type": ["number", "string"], "description": words}


def shown(value: Any) -> str:
    """Return a value as TOML writes it, in short."""
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        return f'"{value}"' if len(value) < 60 else f'"{value[:60]}…"'
    if isinstance(value, dict):
        return "a table"
    return short(value)
