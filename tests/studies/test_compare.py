"""Printed numbers compared with hertzlink's: one rule, three verdicts."""

from math import inf

import pytest

from hertzlink.studies import STUDIES
from hertzlink.studies.compare import (
    NOT_JUDGED,
    TOLERANCE,
    Number,
    Ours,
    Printed,
    bracketed,
    compare,
    counts,
    printed,
    table,
    verdict,
)

PARTS = ("closed-forms", "equations", *STUDIES)


def line(low: str = "", high: str = "", kind: str = "equation", **others: str) -> Printed:
    given = {"study": "own", "number": "x", "low": low, "high": high or low, "words": "", "unit": "", "source": "here"}
    return Printed(**(given | {"kind": kind, "corrected": "", "span": "", "remark": ""} | others))


@pytest.mark.parametrize(
    ("printed", "ends"),
    [
        (line("0.31"), (0.305, 0.315)),
        (line("1.180"), (1.1795, 1.1805)),
        (line("3.759e9"), (3.7585e9, 3.7595e9)),
        (line("1/6"), (1.0 / 6.0, 1.0 / 6.0)),
        (line("-1/3", kind="simulation"), (-0.337, -0.329666667)),
        (line("559", kind="experiment"), (558.5 * 0.949, 559.5 * 1.051)),
        (line("5", kind="about"), (4.445, 5.555)),
        (line("", "5", kind="words"), (-inf, 5.0)),
        (line("0.98", "1.02", kind="words"), (0.98, 1.02)),
    ],
)
def test_what_printed_digits_stand_for(printed: Printed, ends: tuple[float, float]) -> None:
    """All numbers that round to them, and the tolerance of the kind."""
    assert printed.ranges[0] == pytest.approx(ends, rel=1e-6)


@pytest.mark.parametrize(
    ("printed", "ours", "word"),
    [
        (line("524", kind="simulation"), 525.2, "agrees"),
        (line("524", kind="simulation"), 531.0, "differs"),
        (line("0.9314"), 0.93146, "agrees"),
        (line("0.73", "0.78", kind="equation"), (0.74, 0.77), "agrees"),
        (line("0.73", "0.78", kind="equation"), (0.70, 0.77), "differs"),
        (line("0.2"), (0.12, 0.33), "agrees"),
        (line("0.77"), {"": 0.74, "another loss": (0.7, 0.78)}, "agrees"),
        (line("0.77"), {"": (0.7, 0.765), "another loss": 0.75}, "differs"),
        (line("0.3", kind="experiment"), {"": 0.402, "another loss": (0.390, 0.416)}, "differs"),
        (line("27.7", kind="simulation"), {"": 28.9, "another contact": 27.77}, "agrees"),
        (line("7.5", corrected="9.5"), 9.52, "misprint"),
        (line("7.5", corrected="9.5"), 9.7, "differs"),
        (line("7.5", corrected="9.5"), 7.5, "agrees"),
        (line("490", kind="experiment", span="490 to 529"), 525.0, "agrees"),
        (line("490", kind="experiment", span="490 to 529"), 530.0, "differs"),
        (line(kind="words", words="as printed"), True, "agrees"),
        (line(kind="words", words="as printed"), False, "differs"),
        (line(kind="misprint", words="2μ", corrected="μ"), True, "misprint"),
        (line(kind="misprint", words="2μ", corrected="μ"), False, "differs"),
        (line("821"), "none", "differs"),
        (line("821"), float("nan"), "differs"),
        *((line("1", kind=kind), 2.0, "") for kind in NOT_JUDGED),
    ],
)
def test_verdicts(printed: Printed, ours: Ours, word: str) -> None:
    assert verdict(printed, ours)[0] == word


def test_a_condition_is_named_with_its_number() -> None:
    assert verdict(line("529"), {"": 525.2, "gravity": 529.4})[1] == "with gravity: 529.4"


def test_a_table_has_each_number_with_its_verdict_and_remark() -> None:
    numbers = [Number("wave speed, experiment", 525.2), Number("own", (1.0, 2.0), "beyond the thesis", "m")]
    rows = compare("ellipsoids", numbers)
    assert [row.verdict for row in rows] == ["agrees", ""]
    assert rows[1].cells == ("own, m", "", "1 to 2", "")
    assert counts(rows) == {"agrees": 1, "differs": 0, "misprint": 0}
    text = table(rows)
    assert max(map(len, text.splitlines())) <= 80
    assert "beyond the thesis" in text
    assert "490 to 529" in text


@pytest.mark.parametrize(
    ("ends", "text"),
    [((4.52, 5.42), "4.5 to 5.4"), ((5.262, 5.319), "5.26 to 5.32"), ((60.4, 65.4), "60 to 65"), ((0.0, 5.4), "< 5")],
)
def test_a_value_between_two_runs_is_printed_as_its_bracket(ends: tuple[float, float], text: str) -> None:
    assert bracketed(*ends) == text


def test_each_printed_number_says_where_it_stands_and_what_it_comes_from() -> None:
    lines = [one for part in PARTS for one in printed(part).values()]
    assert len(lines) == 178
    for one in lines:
        assert one.source.startswith(("section", "equation", "table", "figure", "chapter", "above", "below")), one
        assert one.kind in {*TOLERANCE, *NOT_JUDGED, "words", "misprint"}, one
        assert one.words or one.low, one
        if one.kind in TOLERANCE:
            assert one.ranges[0][0] < one.ranges[0][1], one
