"""Quantities in messages have the prefix in which their number is handy, and no powers of ten."""

from math import sqrt

import pytest

from structures.units import factor, readable


@pytest.mark.parametrize(
    ("value", "unit", "digits", "text"),
    [
        (0.00229, "m", 3, "2.29 mm"), (2e-5, "s", 3, "20 µs"), (1.2e-4, "s", 2, "120 µs"), (9.999e-4, "s", 3, "1 ms"),
        (1.5, "s", 4, "1.5 s"), (-2.5e5, "Pa", 6, "-250 kPa"), (73.1e9, "Pa", 3, "73.1 GPa"), (2e5, "Hz", 3, "200 kHz"),
        (0.0, "m", 3, "0 m"), (250.0, "N", 3, "250 N"), (0.31, "m/s", 3, "0.31 m/s"), (0.25, "", 3, "0.25"),
        (5e-3, "kg", 3, "5 g"), (2e-6, "kg", 3, "2 mg"), (1.5e3, "kg", 3, "1500 kg"),
    ],
)  # fmt: skip
def test_a_quantity_is_written_as_one_would_say_it(value: float, unit: str, digits: int, text: str) -> None:
    assert readable(value, unit, digits) == text


@pytest.mark.parametrize(
    ("text", "unit", "size"),
    [("1/s", "1/s", 1.0), ("1/mm", "1/m", 1e3), ("1 / ms", "Hz", 1e3), ("mm^0.5", "m^0.5", sqrt(1e-3))],
)
def test_a_reciprocal_and_a_power_are_units(text: str, unit: str, size: float) -> None:
    assert float(factor(text, unit)) == pytest.approx(size, rel=1e-12)
