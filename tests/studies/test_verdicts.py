"""Verdicts on numbers of the thesis follow from the numbers, and cannot be fooled."""

from math import inf, nan

import pytest

from hertzlink.studies.table import INPUT, MEASURED, SIMULATED, Row
from hertzlink.studies.verdicts import (
    CONDITION,
    CONFIRMED,
    REFUTED,
    UNKNOWN,
    counted,
    exact,
    printed,
    verdict,
)

PRINTED = [
    (0.77, (0.765, 0.775)),
    ("0.770", (0.7695, 0.7705)),
    (483.0, (482.5, 483.5)),
    ("45 %", (44.5, 45.5)),
    ("-1/3", (-1.01 / 3.0, -0.99 / 3.0)),
    ("1/6", (0.99 / 6.0, 1.01 / 6.0)),
    ("559 ± 28", (531.0, 587.0)),
    ("0.73 to 0.78", (0.725, 0.785)),
    ("< 5 %", (-inf, 5.0)),
    ("above 30", (30.0, inf)),
    ("about 120", (108.0, 132.0)),
    ("3.31e9", (3.305e9, 3.315e9)),
    ("12 070", (12069.5, 12070.5)),
    ("−5.58", (-5.585, -5.575)),
]


@pytest.mark.parametrize(("said", "ends"), PRINTED)
def test_what_printed_digits_stand_for(said: float | str, ends: tuple[float, float]) -> None:
    assert printed(said) == pytest.approx(ends, rel=1e-12)


@pytest.mark.parametrize("said", ["good agreement", "1.81, −5.58", "", "slower", "< 1, then < 0.01"])
def test_words_are_no_numbers(said: str) -> None:
    assert printed(said) is None


@pytest.mark.parametrize(
    ("ours", "ends"), [(2.5, (2.5, 2.5)), ("0.707 to 0.747", (0.707, 0.747)), ("27.5 %", (27.5, 27.5)), ("none", None)]
)
def test_ours_as_it_stands(ours: float | str, ends: tuple[float, float] | None) -> None:
    assert exact(ours) == ends


CASES = [
    # By its digits.
    (Row("rounded", 3.218, 3.2184), CONFIRMED, ""),
    (
        Row("not rounded, in another steel", 27.7, 27.49, otherwise={"in this steel": 27.773}),
        CONDITION,
        "in this steel; the last digit is cut off, not rounded",
    ),
    (Row("not rounded", 3.218, 3.2186), CONDITION, "the last digit is cut off, not rounded"),
    (Row("another number", 3.218, 3.2191), REFUTED, ""),
    (Row("below", 3.218, 3.2174), REFUTED, ""),
    # By what scatters.
    (Row("simulated", 635.0, 641.0, within=SIMULATED), CONFIRMED, ""),
    (Row("simulated, too far", 635.0, 643.0, within=SIMULATED), REFUTED, ""),
    (Row("measured", 0.77, 0.74, within=MEASURED), CONFIRMED, ""),
    (Row("measured, too far", 0.77, 0.71, within=MEASURED), REFUTED, ""),
    (Row("band", "559 ± 28", 586.0), CONFIRMED, ""),
    # Under another condition.
    (Row("gravity", 529.0, 500.0, within=SIMULATED, otherwise={"gravity": 529.5}), CONDITION, "gravity"),
    (Row("first that agrees", 1.0, 2.0, otherwise={"a": 3.0, "b": 1.0, "c": 1.0}), CONDITION, "b"),
    (Row("range of a parameter", 0.42, 0.3, otherwise={"γ": "0.41 to 0.5"}), CONDITION, "γ"),
    (Row("range that does not reach", 0.42, 0.3, otherwise={"γ": "0.43 to 0.5"}), REFUTED, ""),
    (Row("condition is not needed", 1.0, 1.0, otherwise={"a": 1.0}), CONFIRMED, ""),
    (Row("none, but elsewhere", 821.0, "none", otherwise={"equation": 821.2}), CONDITION, "equation"),
    # Several numbers.
    (Row("range within range", "0.40 to 0.46", "0.41 to 0.45"), CONFIRMED, ""),
    (Row("range beyond range", "0.40 to 0.46", "0.30 to 0.45"), REFUTED, ""),
    (Row("one number for several cases", 28.5, "27.8 to 29.3"), CONDITION, "within the range of the cases"),
    # Statements.
    (Row("holds", "slower", 0.86, holds=True), CONFIRMED, ""),
    (Row("does not hold", "increases", "440, 467", holds=False), REFUTED, ""),
    (Row("statement without a test", "very good", 1.01), UNKNOWN, ""),
    # Nothing to compare.
    (Row("input", 7800.0, 7800.0, within=INPUT), UNKNOWN, ""),
    (Row("input that differs", 7800.0, 1.0, within=INPUT), UNKNOWN, ""),
    (Row("not computed", 1.11, ""), UNKNOWN, ""),
    (Row("nothing where there should be something", 0.05, "none"), REFUTED, ""),
    (Row("no number of ours", 1.0, nan), REFUTED, ""),
    (Row("no number elsewhere", 1.0, 2.0, otherwise={"a": nan}), REFUTED, ""),
]


@pytest.mark.parametrize(("row", "word", "condition"), CASES, ids=[row.quantity for row, _, _ in CASES])
def test_verdict(row: Row, word: str, condition: str) -> None:
    assert verdict(row) == (word, condition)


def test_verdicts_are_counted() -> None:
    counts = counted(verdict(row) for row, _, _ in CASES)
    assert sum(counts.values()) == len(CASES)
    assert counts[CONDITION] == sum(word == CONDITION for _, word, _ in CASES)
