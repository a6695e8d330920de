"""Columns of tables: those of the thesis hold what it prints, as listed in `printed`. Studies check their own rows."""

import re
from math import nan
from pathlib import Path

import pytest
from printed import PRINTED, check

from hertzlink.studies import STUDIES, plate_boundary
from hertzlink.studies.rod_stiffness import table_2_1
from hertzlink.studies.table import SCATTER, TIMED, Row, Rows, expected
from structures.material import MATERIALS


def test_waves_of_the_plate() -> None:
    """Recomputed: Rayleigh's 0.571 of the bar speed; A0 in 2.29 and 4.83 mm, D = 9.53 mm, 9 kHz: 895 and 1300 m/s."""
    rows = {row.quantity: row for row in plate_boundary.of_waves()}
    check("plate-waves", list(rows.values()))
    assert rows["k of the Rayleigh wave"].computed == pytest.approx(0.571, abs=1e-3)
    assert plate_boundary.impact_frequency(9.53e-3) == pytest.approx(9.0e3, rel=0.02)
    speeds = plate_boundary.group_speeds()[9.53e-3]
    assert [speeds[0], speeds[-1]] == pytest.approx([895.0, 1300.0], rel=0.05)


def test_table_2_1_is_that_of_the_materials() -> None:
    rows = table_2_1()
    assert len(rows) == 27
    assert list(dict.fromkeys(row.quantity.partition(", ")[2] for row in rows)) == list(MATERIALS)
    for row in rows:
        assert row.computed == pytest.approx(row.thesis, rel=1e-12), row.quantity


def test_each_expected_number_says_where_it_is_printed() -> None:
    places = re.compile(
        r"((above |below )?(section|equation|equations|figure|table|chapter) [\d.]+(, [\d.]+)?( and chapter 7)?)"
    )
    parts = expected("thesis.toml")
    assert sum(map(len, parts.values())) > 200
    for part, entries in parts.items():
        for name, entry in entries.items():
            assert places.fullmatch(entry.source), (part, name)
            assert entry.scatter in SCATTER, (part, name)


def test_a_row_is_what_its_entry_says(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    lines = (
        '[mine."AR, {name}"]',
        "value = 0.764",
        'source = "figure 6.8"',
        'scatter = "time"',
        'reason = "{:.1f} later"',
    )
    file.write_text("\n".join(lines), encoding="utf-8")
    row = Rows("mine", (str(file),))("AR, {name}", 0.75, 3.14159, otherwise={"no losses": 0.764}, name="steel")
    assert row == Row("AR, steel", 0.764, 0.75, "", "3.1 later", within=TIMED, otherwise={"no losses": 0.764})


def test_most_studies_are_checked() -> None:
    """All but that of the critical distance, whose lines the thesis shows in a figure only, and that of all others."""
    assert set(STUDIES) - set(PRINTED) <= {
        "critical-distance",
        "thesis",
        "yield",
    }


@pytest.mark.parametrize(
    "rows",
    [
        [Row("AR, D/t 1", 0.8726, 0.846, "", "computed, not printed")],
        [Row("k of the Rayleigh wave", 0.57, 0.5715)],
        [*plate_boundary.of_waves(), Row("AR", 0.57, 0.4)],
        [*plate_boundary.of_waves(), Row("AR", "", nan, "", "missing")],
    ],
)
def test_the_check_finds_what_is_not_honest(rows: list[Row]) -> None:
    with pytest.raises(AssertionError):
        check("plate-waves", rows)
