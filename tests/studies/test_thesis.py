"""The study of the whole thesis: each part is judged, counts stand where readers look, equations pass their checks."""

import json
from pathlib import Path

import pytest

from hertzlink.studies import draw, equations, thesis
from hertzlink.studies.compare import VERDICTS, counts, printed, table

ROOT = Path(__file__).parents[2]
COUNTS = json.loads(Path(__file__).with_name("thesis_counts.json").read_text(encoding="utf-8"))
"""Verdicts of the last whole run, by part, in the order of VERDICTS."""

SMALL = ("closed-forms",)


@pytest.mark.thorough
def test_each_corrected_equation_passes_its_check_and_the_printed_one_does_not() -> None:
    found = {equation: (before, after) for equation, before, after in equations.checks()}
    assert set(found) == set(printed("equations"))
    assert [equation for equation, (before, after) in found.items() if before or not after] == []


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Parts that take no time."""
    monkeypatch.setattr(thesis, "PARTS", SMALL)


@pytest.mark.usefixtures("small")
def test_the_table_has_counts_at_the_top_and_each_row_below_its_part() -> None:
    data = thesis.run(quick=True, jobs=1)
    rows = thesis.table(data)
    assert rows[0].hertzlink == "11 agree"
    assert [row.number for row in rows if row.number.isupper()] == [part.upper() for part in SMALL]
    assert max(map(len, table(rows).splitlines())) <= 80
    with draw.style():
        bars = thesis.figures(data)["verdicts"].axes[0].patches
    assert sum(bar.get_width() for bar in bars) == 11
    text = thesis.summary(data)
    assert text.startswith("11 numbers and statements of the thesis")
    assert "- 11 agree" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize(
    "part",
    # The equations run a chain of a loss whose loop no other test compiles.
    [pytest.param(part, marks=[pytest.mark.thorough] * (part == "equations")) for part in thesis.CHECKED],
)
def test_counts_of_parts_without_runs(part: str) -> None:
    assert [*counts(thesis.rows_of(part, quick=False)).values()] == COUNTS.get(part, [0] * len(VERDICTS))


@pytest.mark.parametrize("page", ["README.md", "docs/trust.md"])
def test_pages_have_the_counts_of_the_run(page: str) -> None:
    agree, differ, misprints = (sum(column) for column in zip(*COUNTS.values(), strict=True))
    text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
    total = agree + differ + misprints
    said = f"Of {total} numbers and statements {agree} agree, {differ} differ, {misprints} are misprints"
    assert said in text
