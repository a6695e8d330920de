"""The study of the whole thesis: nothing is left out, each verdict can be repeated, finished parts are kept."""

import json
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import pytest
from matplotlib import pyplot

import hertzlink as hl
from coupling.sweeps.progress import Stopped
from hertzlink.output_folder import forget
from hertzlink.studies import STUDIES, LongStudy, corrected_equations, rod_stiffness, study, thesis
from hertzlink.studies.table import Row, Rows, expected
from hertzlink.studies.verdicts import INPUT_ONLY, READING, REPRODUCED, VERDICTS, counted, verdict

THESIS = study("thesis")

SMALL = {"set-ups (chapter 2)": "thesis_inputs", "closed forms (chapters 1 and 6)": "closed_forms"}


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two parts, so that a run takes no time."""
    monkeypatch.setattr(thesis, "PARTS", tuple(SMALL))


FACTS = {
    "closed_forms": (
        "exponent of Hertz's law",
        "factor of the speed with preload",
        "factor of the speed without preload",
        "width of the wave, equation 1.8",
        "factor of the contact time, equation 6.8",
        "speed of particles over the striker's",
        "factor of the wave's speed, equation 6.13",
        "factor of the transit time, equation 6.17",
        "factor of the transit there and back",
        "factor of τ_t",
        "smallest dimensionless contact time",
        "speed of the striker after a drop",
    ),
    "table_2_1": ("density", "Young's modulus", "Poisson's ratio"),
    "thesis_inputs": (
        "radii of spheres",
        "diameters, figure 5.1",
        "axes of ellipsoids",
        "radius and length of cylinders",
        "hollow spheres:",
        "ring around the sensor",
        "Kapton film",
        "time constant of the sensors",
        "scatter of the striker's speed",
        "tilt of",
        "diameter of the actuator's bead",
        "chain of chapter 4",
        "its sensors",
        "chain of section 3.3",
        "sensors of section 3.5",
        "chain of ellipsoids",
        "dissipative ellipsoids",
        "chain of cylinders",
        "chain of hollow spheres",
        "chain of section 6.1",
        "drop of the striker",
        "speed of the striker, section 6.2",
        "cylinders of section 6.1.1",
        "cylinders of section 6.1.2",
        "layers of section 6.1.3",
        "layers of section 6.1.4",
        "side of the plates",
        "thicknesses of the plates",
        "diameters on plates",
        "steps of the distance",
    ),
    "deformable_chain": (
        "wave speed at 0.63 m/s, discrete",
        "wave speed at 0.63 m/s, finite",
        "wave speed at 0.63 m/s, experiment",
        "peak force, discrete",
        "peak force, finite",
        "wave speed, discrete",
        "wave speed, finite",
        "time with modes",
        "fastest motion over",
        "kinetic over potential",
    ),
    "contact_law": (
        "exponent n, steel spheres",
        "k, major axes",
        "angle above which Hertz's law holds",
        "exponent n, Ri/Ro",
        "k, Ri/Ro",
    ),
    "dissipation": (
        "mass, {name}",
        "α and γ, {name}",
        "α₁, steel 316",
        "exponent of speed over force",
        "γ of ellipsoids",
        "speed from which beads yield",
        "secondary wave after waves meet",
        "beads to form a solitary wave",
    ),
    "ellipsoids": (
        "larger radius of curvature",
        "mass of an ellipsoid",
        "k, along the major axis",
        "k, along the minor axis",
        "k, equivalent sphere",
        "wave speed, discrete",
        "wave speed, finite",
        "wave speed, experiment",
        "wave speed, striker D",
        "width, in minor diameters",
    ),
    "cylinders": (
        "mass of a cylinder",
        "wave speed at 90°, discrete",
        "wave speed at 90°, finite",
        "wave speed at 90°, experiment",
        "width at 90°",
        "wave speed at 90°, 40 N",
        "speed gained at 45°",
        "speed gained at 30°",
        "exponent n of parallel",
        "exponent n, Harris",
        "width at 0°",
        "wave speed at 0° over 90°",
        "speed at 5° over 90°, at 10, 40, 80 N",
    ),
    "hollow_spheres": (
        "mass of a hollow sphere",
        "k, Ri/Ro 0",
        "exponent n, Ri/Ro",
        "exponent n, Pauchard",
        "wave speed, discrete",
        "wave speed, finite",
        "wave speed, experiment",
        "width, by equation 5.13",
        "width, experiment",
        "wave speed over force, exponent",
    ),
    "rod_stiffness": (
        "definition of AR",
        "definition of TOF",
        "largest displacement of bead 20, steel",
        "contact with steel",
        "largest displacement of bead 20, PTFE",
        "contact with PTFE",
        "first collision",
        "second collision",
        "bead 20 deepest in PTFE",
        "AR, steel",
        "AR, PTFE",
        "TOF, steel",
        "TOF, PTFE",
        "TOF, PTFE over steel",
        "SSW after PSW",
        "energy that becomes potential, steel",
        "energy that becomes potential, PTFE",
        "E below which SSW",
        "modulus below which SSW",
        "SSW there",
        "reflected wave slower",
        "incident wave at sensor 7",
        "steel stiffer than PTFE",
    ),
    "rod_length": (
        "AR, all lengths",
        "TOF, all lengths",
        "characteristic length",
        "AR, short cylinder",
        "AR, long cylinder",
        "AR lost over the lengths",
        "arrival of the primary wave",
        "secondary wave",
    ),
    "upper_layer": (
        "AR, primary, 6.35 mm",
        "AR, secondary, 101.6 mm",
        "TOF, primary, shorter",
        "TOF, primary",
        "TOF, secondary, 6.35",
        "TOF, secondary, 101.6",
        "TOF, secondary, longer",
        "upper layer with no secondary wave",
    ),
    "lower_layer": ("AR, primary", "TOF, primary", "TOF, primary, varies by"),
    "aspect_ratio": (
        "λ, D 4.76",
        "contact time, D 9.53",
        "contact time, D 4.76, all plates",
        "e, D 19.05, t 2.29",
        "D/t, largest bead",
    ),
    "plate_boundary": (
        "contact time, half-space",
        "AR at the centre, D 19.05",
        "factor of τ_c, equation 6.39",
        "factor of the critical distance, equation 6.42",
    ),
    "plate_waves": (
        "k of the Rayleigh wave",
        "speed of the Rayleigh wave",
        "Rayleigh wave, centre to edge",
        "k of the A0 Lamb wave",
        "speed of the A0 Lamb wave",
        "A0 Lamb wave, centre to edge",
    ),
}
"""The rows in which the thesis's numbers stand, by part; a row with several materials or plates holds several."""


def test_no_number_of_the_thesis_is_left_out() -> None:
    assert sum(map(len, FACTS.values())) >= 140
    for part, quantities in FACTS.items():
        known = [entry.quantity or name for name, entry in Rows(part).entries.items()]
        module = {"table_2_1": "rod_stiffness", "plate_waves": "plate_boundary"}.get(part, part)
        source = Path(import_module(f"hertzlink.studies.{module}").__file__ or "").read_text(encoding="utf-8")
        missing = [one for one in quantities if f'"{one}' not in source and not any(x.startswith(one) for x in known)]
        assert missing == [], part


EQUATIONS = (
    *(
        "1.3",
        "1.5",
        "1.6",
        "1.9",
        "2.1",
        "3.1",
        "3.2",
        "3.6",
        "4.1",
        "R′",
        "5.3",
        "5.8",
        "5.12",
        "6.2",
        "6.10",
        "6.17",
        "6.19",
    ),
    *("6.32", "6.38", "6.39", "6.2.2", "Table 4.1"),
)


def test_each_corrected_equation_passes_its_check_and_the_printed_one_does_not() -> None:
    named = " ".join(corrected_equations.CHECKS)
    assert [one for one in EQUATIONS if one not in named] == []
    for equation, passes in corrected_equations.CHECKS.items():
        before, after = passes()
        assert after, equation
        assert not before, equation


def test_each_part_can_be_repeated() -> None:
    assert set(thesis.STUDIED.values()) < set(STUDIES)
    assert all(import_module(f"hertzlink.studies.{name}").table() for name in thesis.CHECKED.values())
    assert set(thesis.LONGEST_FIRST) < set(thesis.PARTS)
    assert isinstance(THESIS, LongStudy)


def test_what_is_not_reproduced_has_a_reason() -> None:
    """Of the parts without runs."""
    for part in thesis.CHECKED:
        for row in thesis.rows_of(part, quick=True):
            assert row.reason or verdict(row).word in (REPRODUCED, INPUT_ONLY), row.quantity


@pytest.mark.usefixtures("small")
def test_counts_stand_at_the_top_and_each_entry_has_a_verdict() -> None:
    data = THESIS.run(quick=True, jobs=1)
    assert set(data.verdict.values) <= {*VERDICTS, INPUT_ONLY}
    counts = {word: int((data.verdict == word).sum()) for word in VERDICTS}
    rows = THESIS.table(data)
    assert rows[0].quantity == f"{sum(counts.values())} numbers and statements"
    assert rows[0].reason.startswith(", ".join(f"{count} {word}" for word, count in counts.items() if count))
    for row, word in zip((row for row in rows if row.thesis != ""), data.verdict.values, strict=True):
        assert row.reason.startswith(str(word).upper())
    text = thesis.summary(data)
    assert max(map(len, text.splitlines())) <= 80
    assert text.startswith(f"{sum(counts.values())} numbers and statements")
    assert f"{int((data.verdict == INPUT_ONLY).sum())} inputs" in text


@pytest.mark.usefixtures("small")
def test_figures_show_all_entries() -> None:
    data = THESIS.run(quick=True, jobs=1)
    drawn = THESIS.figures(data)
    widths = sum(bar.get_width() for bar in drawn["verdicts"].axes[0].patches)
    assert widths == int((data.verdict != INPUT_ONLY).sum())
    longest = max(bar.get_x() + bar.get_width() for bar in drawn["verdicts"].axes[0].patches)
    assert drawn["verdicts"].axes[0].get_xlim()[1] > 1.02 * longest
    for figure in drawn.values():
        pyplot.close(figure)


@pytest.mark.usefixtures("small")
def test_finished_parts_are_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C after the first part; the next run computes the second one alone, and forgets both."""
    keep, asked, computed = tmp_path / "thesis.parts", list[str](), thesis.rows_of

    def watched(part: str, quick: bool) -> list[Row]:
        asked.append(part)
        if len(asked) == 2:
            raise KeyboardInterrupt
        return computed(part, quick)

    monkeypatch.setattr(thesis, "rows_of", watched)
    with pytest.raises(Stopped, match=r"^1 of 2 points kept in .*thesis.parts; run again to continue$"):
        THESIS.run(quick=True, jobs=1, keep=keep)
    data = THESIS.run(quick=True, jobs=1, keep=keep)
    assert asked == [*SMALL, list(SMALL)[1]]
    assert data.identical(THESIS.run(quick=True, jobs=1))
    asked.clear()
    asked.append("a quick part is none of a whole run")
    with pytest.raises(Stopped, match=r"^0 of 2 points"):
        THESIS.run(quick=False, jobs=1, keep=keep)
    forget(keep)
    assert not keep.exists()


@pytest.mark.usefixtures("small")
def test_a_damaged_part_is_named(tmp_path: Path) -> None:
    keep = tmp_path / "kept"
    THESIS.run(quick=True, jobs=1, keep=keep)
    file = next(iter(sorted(keep.glob("*.nc"))))
    file.write_bytes(file.read_bytes()[:50])
    with pytest.raises(ValueError, match=r"is damaged .*delete it, and its point is run again"):
        THESIS.run(quick=True, jobs=1, keep=keep)


def test_a_row_travels_through_a_file() -> None:
    row = Row("TOF", "about 0.1", float("nan"), "µs", "why", "1/6", 0.01, {"γ": "1 to 2"}, True)
    again = Row(**json.loads(json.dumps(thesis._plain(row))))
    assert repr(again) == repr(row._replace(otherwise={"γ": "1 to 2"}))


def test_readings_of_one_number_are_one_entry() -> None:
    """The first row of a number takes what the others give as conditions; the rest are not counted."""
    rows = [Row("a", 524.0, 340.0, number="speed"), Row("b", 524.0, 524.2, number="speed"), Row("c", 1.0, 1.0)]
    merged, said = thesis.judge([("part", row) for row in rows])
    assert [one.word for one in said] == ["reproduced under a condition", READING, "reproduced"]
    assert said[0].detail == "b"
    assert len(merged) == 3
    assert sum(counted(said).values()) == 2


def test_the_spread_of_one_quantity_is_that_of_theory_simulation_and_experiment() -> None:
    rows = [
        Row("experiment", "490 ± 25", 525.0, of="speed"),
        Row("simulation", 529.0, 525.0, of="speed"),
        Row("theory", 500.0, 525.0, theory=531.0, of="speed"),
        Row("other", 1.0, 525.0),
    ]
    merged, _ = thesis.judge([("part", row) for row in rows])
    assert [row.spread for _, row in merged] == ["490 to 531"] * 3 + [""]


def test_the_head_lists_all_that_is_far_off_and_counts_what_is_near(monkeypatch: pytest.MonkeyPatch) -> None:
    """Numbers and ranges alike, one that is zero too; a condition against a printed number is counted."""
    rows = [
        Row("contact", 241.0, 497.0), Row("wave", 0.05, 0.0), Row("angle", "30", "5.9 to 8.2"),
        Row("range", "430 to 470", "463 to 479"), Row("near", 100.0, 104.9), Row("off", 100.0, 120.0),
        Row("λ", 0.32, 0.29, otherwise={"0.43 m/s": 0.32}, against="0.31 m/s"),
        Row("words", "faster", "1", holds=False),
    ]  # fmt: skip
    monkeypatch.setattr(thesis, "PARTS", ("part",))
    data = thesis._dataset([("part", row) for row in rows])
    head = thesis.in_short(data)
    listed = [line.strip() for line in head if " for " in line and "%:" in line]
    assert listed == [
        "+106 %: contact, 497 for 241.0",
        "-100 %: wave, 0 for 0.05",
        "-80 %: angle, 5.9 to 8.2 for 30",
        "+20 %: off, 120 for 100.0",
        "+4.9 %: near, 104.9 for 100.0",
    ]
    assert "- 7 differ, 2 of them by at most 5 %." in head
    assert "  1 of these need an input that contradicts another printed one." in head
    assert not any("quick" in line for line in head)
    assert any("quick" in line for line in thesis.in_short(data.assign_attrs(quick=1)))


def test_one_number_of_one_section_has_one_verdict() -> None:
    """Rows of the same number, unit and section are readings of it, apart from those that are of several things."""
    several = {450.0, 0.17}
    numbers: dict[tuple[object, ...], set[str]] = {}
    for part in expected("thesis.toml").values():
        for name, entry in part.items():
            if entry.scatter != "input" and isinstance(entry.value, float) and entry.value not in several:
                numbers.setdefault((entry.value, entry.unit, entry.source), set()).add(entry.number or name)
    assert {key: names for key, names in numbers.items() if len(names) > 1} == {}


COUNTS = json.loads(Path(__file__).with_name("thesis_counts.json").read_text(encoding="utf-8"))
"""Verdicts of the last whole run, by part, in the order of VERDICTS."""
TOTAL = [sum(column) for column in zip(*COUNTS.values(), strict=True)]
ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize("page", ["README.md", "docs/studies.md", "docs/validation.md"])
def test_pages_have_the_counts_of_the_run(page: str) -> None:
    text = " ".join((ROOT / page).read_text(encoding="utf-8").split())
    agree, condition, differ, misprints, undefined = TOTAL
    assert (
        f"Of {sum(TOTAL)} numbers and statements it reproduces {agree}, and {condition} more under a named condition; "
        f"{differ} differ, {misprints} are misprints, {undefined} are not defined"
    ) in text


@pytest.mark.parametrize("part", list(thesis.CHECKED))
def test_counts_of_parts_without_runs(part: str) -> None:
    _, said = thesis.judge([(part, row) for row in thesis.rows_of(part, quick=False)])
    assert [*counted(said).values()] == COUNTS.get(part, [0] * len(VERDICTS))


@pytest.mark.parametrize(("gravity", "dashpot"), [(0.0, 0.0), (0.0, 5.0), (9.81, 0.0), (9.81, 5.0)])
def test_the_last_bead_stays_on_ptfe_for_longer_than_the_thesis_says(gravity: float, dashpot: float) -> None:
    """So 241 µs is no whole contact, whatever the losses are; 320 µs before the second collision the wave arrives."""
    of = rod_stiffness.THESIS
    chain = replace(of.chain(dashpot), gravity=gravity)
    run = hl.CoSimulation(chain, of.slender(rod_stiffness.layers(hl.PTFE))).run(until=rod_stiffness.UNTIL)
    assert float(hl.contact_time(run)) > 400e-6
    moved = run.displacement.sel(bead=rod_stiffness.BEADS)
    begin = float(run.time[int((moved > 0.01 * moved.max()).values.argmax())])
    assert begin == pytest.approx(561e-6 - 241e-6, rel=0.03)
