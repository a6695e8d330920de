"""Verdicts on numbers of the thesis follow from the numbers, and cannot be fooled."""

from math import inf, nan

import pytest

from hertzlink.studies.table import INPUT, MEASURED, SIMULATED, Row
from hertzlink.studies.verdicts import (
    CONDITION,
    DIFFERS,
    INPUT_ONLY,
    MISPRINT,
    NOT_GIVEN,
    REPRODUCED,
    UNDEFINED,
    counted,
    exact,
    printed,
    verdict,
)

GAMMA = f"γ, {NOT_GIVEN}"

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


SPREAD = "no farther than theory, simulation and experiment of one author, 490 to 529"
CASES = [
    # By its digits.
    (Row("rounded", 3.218, 3.2184), REPRODUCED, ""),
    (
        Row("not rounded, in another steel", 27.7, 27.49, otherwise={"in this steel": 27.773}),
        CONDITION,
        "in this steel; the last digit is cut off, not rounded",
    ),
    (Row("not rounded", 3.218, 3.2186), CONDITION, "the last digit is cut off, not rounded"),
    (Row("another number", 3.218, 3.2191), DIFFERS, "by +0.034 %"),
    (Row("below", 3.218, 3.2174), DIFFERS, "by -0.019 %"),
    # By what scatters.
    (Row("simulated", 635.0, 641.0, within=SIMULATED), REPRODUCED, "within 1 %"),
    (Row("simulated, too far", 635.0, 643.0, within=SIMULATED), DIFFERS, "by +1.3 %"),
    (Row("measured", 0.77, 0.74, within=MEASURED), REPRODUCED, "within 5 %"),
    (Row("measured, too far", 0.77, 0.71, within=MEASURED), DIFFERS, "by -7.8 %"),
    (Row("band", "559 ± 28", 586.0), REPRODUCED, ""),
    # Under another condition.
    (Row("gravity", 529.0, 500.0, within=SIMULATED, otherwise={"gravity": 529.5}), CONDITION, "gravity"),
    (Row("first that agrees", 1.0, 2.0, otherwise={"a": 3.0, "b": 1.0, "c": 1.0}), CONDITION, "b"),
    (Row("range of a parameter", 0.42, 0.3, otherwise={"γ": "0.41 to 0.5"}), CONDITION, "γ"),
    (Row("range that does not reach", 0.42, 0.3, otherwise={"γ": "0.43 to 0.5"}), DIFFERS, "by -29 %"),
    (Row("condition is not needed", 1.0, 1.0, otherwise={"a": 1.0}), REPRODUCED, ""),
    (Row("none, but elsewhere", 821.0, "none", otherwise={"equation": 821.2}), CONDITION, "equation"),
    # Several numbers.
    (Row("range within range", "0.40 to 0.46", "0.41 to 0.45"), REPRODUCED, ""),
    (Row("far beyond about", "about 100", 116.7, within=MEASURED), DIFFERS, "by +17 %"),
    (Row("twice as large", 1.0, 2.1), DIFFERS, "by +110 %"),
    (
        Row(
            "for one value of what is not given",
            0.42,
            0.42,
            within=MEASURED,
            otherwise={f"γ, {NOT_GIVEN}": "0.37 to 0.49"},
        ),
        CONDITION,
        f"γ, {NOT_GIVEN}",
    ),
    (
        Row(
            "for all values of what is not given",
            0.42,
            0.42,
            within=MEASURED,
            otherwise={f"γ, {NOT_GIVEN}": "0.419 to 0.421"},
        ),
        REPRODUCED,
        "",
    ),
    (Row("cut, but declared a misprint", 0.2, 0.288, corrected="0.29"), MISPRINT, "corrected: 0.29"),
    (Row("range beyond range", "0.40 to 0.46", "0.30 to 0.45"), DIFFERS, "by -25 %"),
    (Row("one number for several cases", 28.5, "27.8 to 29.3"), CONDITION, "within the range of the cases"),
    # Statements.
    (Row("holds", "slower", 0.86, holds=True), REPRODUCED, ""),
    (Row("does not hold", "increases", "440, 467", holds=False), DIFFERS, ""),
    (Row("statement without a test", "very good", 1.01), DIFFERS, ""),
    (
        Row("conditional", "no mass", "M/3", holds=False, provided="light", corrected="x"),
        CONDITION,
        "light",
    ),
    # Misprints: the corrected form must agree with ours, or pass its check.
    (Row("misprint", 7.5, 9.52, corrected="9.5"), MISPRINT, "corrected: 9.5"),
    (Row("no misprint, for it is not ours either", 7.5, 8.5, corrected="9.5"), DIFFERS, "by +13 %"),
    (Row("right as printed", 9.5, 9.52, corrected="7.5"), REPRODUCED, ""),
    (Row("equation", "G = 2μ", "G = μ", holds=False, corrected="G = μ"), MISPRINT, "corrected: G = μ"),
    # What the text leaves open, and what one author's models and experiment leave open.
    (
        Row("not defined", 241.0, "no run", missing="the level at which it is read"),
        UNDEFINED,
        "missing: the level at which it is read",
    ),
    (
        Row("not given, but no value gives it", 241.0, 497.0, missing="the level", otherwise={"at half": 118.0}),
        DIFFERS,
        "by +106 %",
    ),
    (
        Row("not given, and a value gives it", 241.0, 497.0, missing="the level", otherwise={"at a third": 241.2}),
        CONDITION,
        "at a third",
    ),
    (
        Row("against another printed number", 0.32, 0.295, otherwise={"0.43 m/s": 0.3201}, against="0.31 m/s"),
        CONDITION,
        "0.43 m/s; contradicts the printed 0.31 m/s",
    ),
    (Row("nothing to contradict", 0.32, 0.32, against="0.31 m/s"), REPRODUCED, ""),
    (Row("words", "similar", 1.015, holds=True), REPRODUCED, "within 2 %"),
    (Row("nearly nine", "about 100", 109.4), REPRODUCED, "within 10 %"),
    (
        Row("a range within the scatter", 0.769, 0.7, within=MEASURED, otherwise={"γ": "0.668 to 0.742"}),
        CONDITION,
        "γ; within 5 %",
    ),
    (Row("not defined, but it agrees", 241.0, 241.2, missing="the level at which it is read"), REPRODUCED, ""),
    (Row("between two of the thesis", 490.0, 525.0, spread="490 to 529"), CONDITION, SPREAD),
    (Row("beyond all of the thesis", 490.0, 535.0, spread="490 to 529"), DIFFERS, "by +9.2 %"),
    # Nothing to compare.
    (Row("input", 7800.0, 7800.0, within=INPUT), INPUT_ONLY, ""),
    (Row("input that differs", 7800.0, 1.0, within=INPUT), INPUT_ONLY, ""),
    (Row("not computed", 1.11, ""), DIFFERS, ""),
    (Row("nothing where there should be something", 0.05, "none"), DIFFERS, ""),
    (Row("no number of ours", 1.0, nan), DIFFERS, ""),
    (Row("no number elsewhere", 1.0, 2.0, otherwise={"a": nan}), DIFFERS, "by +100 %"),
]


@pytest.mark.parametrize(("row", "word", "condition"), CASES, ids=[row.quantity for row, _, _ in CASES])
def test_verdict(row: Row, word: str, condition: str) -> None:
    assert verdict(row) == (word, condition)


def test_verdicts_are_counted() -> None:
    counts = counted(verdict(row) for row, _, _ in CASES)
    assert sum(counts.values()) == sum(word != INPUT_ONLY for _, word, _ in CASES)
    assert counts[CONDITION] == sum(word == CONDITION for _, word, _ in CASES)
