"""Numbers of the thesis, computed again without hertzlink: what an entry is, and the file that keeps them all.

`values.json` lies next to this file. `python -m tests.independent.thesis` computes it again. It maps an entry to

    {"printed": [...], "unit": "...", "conditions": "...", "values": {variant: {"value": ..., "error": ...}}}

entry       "group/id": a number of the thesis, for example "theory_constants/lwa_speed_coeff". The groups are theory
            (theory_constants), geometry (chapter 2), fem_validation (3), dissipation_table_4_1 (4), nonspherical and
            hollow_table_5_1 (5), rods_set1_modulus, rods_set2_length, layers_set3_upper and plates_aspect_ratio (6).
printed     what the thesis prints, as texts with all their digits, in `unit`. An empty list: the thesis prints none.
variant     the conditions that the thesis leaves open, in words: "g = 0", "g = 9.81", "v = 0.31, rho = 7800".
value       a number, or a list of numbers in the order that `conditions` gives.
error       an estimate of the numerical error, of the same shape: the difference from the same computation with a
            hundred times the tolerance and half as many cells, at least rounding. It contains no error of the model.

**To compare a program with these values**, let it return a mapping from "group/id" to a mapping from variant to
value, in the units of this file, with any selection of entries and variants. `differences` compares it with the file.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Value = float | Sequence[float]
Variants = Mapping[str, Value]

FILE = Path(__file__).with_name("values.json")
ROUNDING = 1e-10
"""Digits kept in the file, in parts of the value."""


@dataclass(frozen=True)
class Effort:
    """How exactly to compute: the tolerance of integrators in time, and the length of a rod's cells in mm."""

    tolerance: float = 1e-10
    cell: float = 2.0


FINE, COARSE = Effort(), Effort(1e-8, 4.0)


@dataclass(frozen=True)
class Entry:
    """A number of the thesis and the function that computes it again."""

    name: str
    printed: tuple[str, ...]
    unit: str
    conditions: str
    compute: Callable[[Effort], Variants]

    def record(self) -> dict[str, Any]:
        """What `values.json` keeps of this entry."""
        fine, coarse = self.compute(FINE), self.compute(COARSE)
        return {
            "printed": list(self.printed),
            "unit": self.unit,
            "conditions": self.conditions,
            "values": {variant: _with_error(fine[variant], coarse[variant]) for variant in fine},
        }


class Chapter:
    """Collects the entries of a module: `@chapter.entry(id, printed, unit, conditions)` above each function."""

    def __init__(self, group: str) -> None:
        self.group = group
        self.entries: list[Entry] = []

    def entry(
        self, name: str, printed: str, unit: str, conditions: str
    ) -> Callable[[Callable[[Effort], Variants]], Callable[[Effort], Variants]]:
        """printed: the thesis's numbers with spaces between them."""

        def keep(compute: Callable[[Effort], Variants]) -> Callable[[Effort], Variants]:
            self.entries.append(Entry(f"{self.group}/{name}", tuple(printed.split()), unit, conditions, compute))
            return compute

        return keep


def numbers(value: Value) -> list[float]:
    """A value as a list."""
    return [float(one) for one in value] if isinstance(value, Sequence) else [float(value)]


def agrees(printed: str, value: float) -> bool:
    """True where the value rounds to what is printed: it lies within half a unit of the last printed digit."""
    mantissa, _, exponent = printed.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    half = 0.5 * 10.0 ** (int(exponent or 0) - decimals)
    return abs(value - float(printed)) <= half * (1.0 + 1e-9)


def agreement(printed: Sequence[str], value: Value) -> str:
    """Whether a value is what is printed: "yes", "no", "2 of 3"; "-" and a lack of numbers are not compared.

    As many numbers as are printed are compared one by one; otherwise two printed numbers are a range.
    """
    mine = numbers(value)
    if len(printed) == len(mine):
        fits = [agrees(text, one) for text, one in zip(printed, mine, strict=True) if text != "-"]
    elif len(printed) == 2:
        low, high = sorted(printed, key=float)
        fits = [float(low) <= one <= float(high) or agrees(low, one) or agrees(high, one) for one in mine]
    else:
        return ""
    return "yes" if all(fits) else f"{sum(fits)} of {len(fits)}" if any(fits) else "no"


def load() -> dict[str, dict[str, Any]]:
    """What `values.json` holds."""
    return dict(json.loads(FILE.read_text(encoding="utf-8")))


def differences(found: Mapping[str, Variants], relative: float, absolute: float = 0.0) -> Iterator[str]:
    """A line for each value that differs from the file's by more than the tolerances and the file's error.

    found: "group/id" to variant to value, in the units of the file. An entry or variant that the file lacks is a line.
    """
    known = load()
    for name, variants in found.items():
        for variant, value in variants.items():
            one = known.get(name, {"values": {}})["values"].get(variant)
            if one is None:
                yield f"{name}, {variant}: not in {FILE.name}"
                continue
            mine, errors, theirs = numbers(one["value"]), numbers(one["error"]), numbers(value)
            if len(mine) != len(theirs):
                yield f"{name}, {variant}: {len(theirs)} numbers, {len(mine)} in {FILE.name}"
                continue
            for independent, error, given in zip(mine, errors, theirs, strict=True):
                # A value that is not a number is a difference as well.
                if not abs(given - independent) <= relative * abs(independent) + absolute + error:
                    yield f"{name}, {variant}: {given:.8g}, independently {independent:.8g} ± {error:.1g}"


def _with_error(fine: Value, coarse: Value) -> dict[str, Any]:
    """The value, rounded, and how far the coarse one lies from it."""
    pairs = list(zip(numbers(fine), numbers(coarse), strict=True))
    values = [float(f"{one:.10g}") for one, _ in pairs]
    errors = [float(f"{max(abs(one - other), ROUNDING * abs(one)):.1e}") for one, other in pairs]
    return (
        {"value": values, "error": errors} if isinstance(fine, Sequence) else {"value": values[0], "error": errors[0]}
    )
