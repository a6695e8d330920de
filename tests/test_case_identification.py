"""What a case asks beyond runs: uncertainties, contacts that yield, unknowns of a measured signal, and maps of taps."""

import csv
import re
import warnings
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from command import case_of
from page_parser import check_page

import hertzlink as hl
from coupling.inference.identification import unknowns_of
from coupling.inference.tap_maps import points_of
from coupling.results.critical_distance import SWALLOWED
from coupling.results.findings import findings_of
from hertzlink.cases import Fault, parsed
from hertzlink.cases.case import Case, read
from hertzlink.cases.identification import grid_of, map_table, question_of
from hertzlink.cases.tasks import budget_of, run_both, task_of
from hertzlink.cases.templates import template

SHORT_WALL = template("wall").replace("beads = 20", "beads = 10").replace("1.5 ms", "0.6 ms").replace("= 7", "= 5")

MODULUS = "structure.material.youngs_modulus"


def test_a_case_has_an_uncertainty_budget(command: Callable[..., str], tmp_path: Path) -> None:
    """TOF ∝ v^(−1/5), so 5 % of the speed are 1 % of TOF. The wall's delay ∝ E^(−2/5) is a part of TOF."""
    (tmp_path / "wall.toml").write_text("""
        chain = { beads = 10, bead = { shape = "sphere", radius = "4.76 mm", material = "steel 440C" }, impact_speed = 0.3 }
        structure.kind = "half_space"
        structure.material = { youngs_modulus = "3 GPa", poisson_ratio = 0.3, density = 2000 }
        run.until = "0.5 ms"
        measure.sensor = 5
        [sensitivities]
        "chain.impact_speed" = "15 mm/s"
        "structure.material.youngs_modulus" = "1 %"
    """)
    said = command("run", "wall.toml", "--output", "out")
    line = next(line for line in said.splitlines() if line.startswith("time_of_flight = "))
    value, spread = (float(part.split()[0]) for part in line.split("=")[1].split("±"))
    assert 0.96**0.5 * spread == pytest.approx(0.01 * value, rel=0.02)
    assert " 96 %  chain.impact_speed = 0.3 m/s ± 0.015 m/s" in said
    assert " 4 %  structure.material.youngs_modulus = 3 GPa ± 30 MPa" in said
    assert "chain.impact_speed 96 %, structure.material.youngs_modulus 4 %" in (
        tmp_path / "out" / "report.html"
    ).read_text(encoding="utf-8")


@pytest.mark.parametrize(("path", "modulus"), [
    ("chain.bead.material.youngs_modulus", 200e9),
    ("materials.hull.youngs_modulus", 200e9),
    ("structure.material.youngs_modulus", 1.53e9),
])  # fmt: skip
def test_the_uncertainty_of_a_material_that_is_named(path: str, modulus: float) -> None:
    """Moduli of table 2.1 of the thesis: steel 440C and PTFE."""
    text = f"""
        [materials.hull]
        like = "steel 440C"
        [chain]
        beads = 3
        bead = {{ shape = "sphere", diameter = "9.52 mm", material = "hull" }}
        striker = "bead"
        impact_speed = "0.3 m/s"
        [structure]
        kind = "half_space"
        material = "PTFE"
        [run]
        until = "0.5 ms"
        [sensitivities]
        "{path}" = "2 %"
    """
    task, inputs = budget_of(case_of(text))
    assert inputs == {path: (modulus, pytest.approx(0.02 * modulus))}
    moduli = set(re.findall(r"'youngs_modulus': ([\d.]+)", str(task(**{path: 3e9}).describe())))
    assert set(map(float, moduli)) == {200e9, 1.53e9} - {modulus} | {3e9}
    with pytest.raises(Fault, match=r"is not an entry here; did you mean youngs_modulus\?"):
        budget_of(case_of(text.replace("youngs_modulus", "modulus")))


def test_what_yielding_changes_is_said_of_the_sensor_asked_for() -> None:
    text = """
        chain = { beads = 6, bead = { shape = "sphere", radius = "4.76 mm", material = "steel 440C" }, impact_speed = 0.5 }
        structure = { kind = "half_space", material = "brass 360" }
        run = { until = "0.4 ms" }
        measure = { sensor = 2 }
    """
    data, yielded = run_both(task_of(case_of(text)), 1)
    (said,) = [one for one in findings_of(data) if one.startswith("yield: ")]
    assert yielded is not None
    assert said.endswith('yields; the rows "fresh spot" include it, by Jackson and Green\'s law')


def rows_of(path: str) -> list[list[str]]:
    """The rows of a CSV file, without their head."""
    with Path(path).open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))[1:]


@pytest.mark.thorough
def test_a_run_on_brass_says_what_yielding_changes(tmp_path: Path, command: Callable[..., str]) -> None:
    """Distances of independent runs with the law: 24.87 mm instead of 19.46; AR 0.068 instead of 0.181."""
    (tmp_path / "brass.toml").write_text(BRASS, encoding="utf-8")
    table = command("run", "brass.toml")
    ratios = {row[6]: float(row[4]) for row in map(str.split, table.splitlines()) if row[1:2] == ["primary"]}
    assert ratios == {"elastic": pytest.approx(0.181, abs=5e-4), "fresh": pytest.approx(0.068, abs=5e-4)}
    assert "fresh spot: the metal yields there; computed with law" in table
    page = Path("brass/report.html").read_text(encoding="utf-8")
    assert "On a fresh spot, where the metal yields, the primary wave has AR 0.068" in page
    assert "bead 7, primary, fresh spot" in page
    with xr.open_dataset(tmp_path / "brass" / "results.nc") as data:
        (said,) = [one for one in findings_of(data) if one.startswith("yield: ")]
    assert 'the rows "fresh spot" include it' in said
    # The CSV files hold both; the traces, whose times differ, are two files.
    ratios = {row[-1]: float(row[4]) for row in rows_of("brass/waves.csv") if row[1] == "primary"}
    assert ratios == {"elastic": pytest.approx(0.181, abs=5e-4), "Jackson-Green": pytest.approx(0.068, abs=5e-4)}
    traces = [np.loadtxt(f"brass/traces{end}.csv", delimiter=",", skiprows=1) for end in ("", "_yielding")]
    elastic, yielded = (one[one[:, 0] > 3e-4, 1].max() / one[:, 1].max() for one in traces)
    assert (elastic, yielded) == (pytest.approx(0.181, abs=5e-4), pytest.approx(0.068, abs=5e-4))
    (tmp_path / "critical.toml").write_text(BRASS + CRITICAL, encoding="utf-8")
    command("run", "critical.toml")
    distances = [(row[-1], 1e3 * float(row[0])) for row in rows_of("critical/critical_distance.csv")]
    assert distances == [("elastic", pytest.approx(19.46, abs=0.1)), ("Jackson-Green", pytest.approx(24.87, abs=0.1))]
    assert {row[-1] for row in rows_of("critical/points.csv")} == {"elastic", "Jackson-Green"}
    page = Path("critical/report.html").read_text(encoding="utf-8")
    assert re.search(r"Beyond 19.4\d mm \(19.* mm\) the edge .* on elastic contacts, and beyond 24.8\d mm \(24", page)


def test_warnings_of_fresh_spots_name_their_spot(tmp_path: Path, command: Callable[..., str]) -> None:
    """10 mm from a free edge two peaks of the wave on a fresh spot are nearly equal; from 5 mm no wave returns."""
    free = BRASS.replace("clamped", "free").replace("40 mm", "10 mm")
    (tmp_path / "one.toml").write_text(free, encoding="utf-8")
    command("run", "one.toml")
    page = Path("one/report.html").read_text(encoding="utf-8")
    assert page.count("wave at bead 7: the primary wave has peaks") == 1
    assert "fresh spot, wave at bead 7: the primary wave has peaks" in page
    short = CRITICAL.replace('{ from = "10 mm", to = "60 mm", step = "10 mm" }', '["5 mm", "10 mm", "15 mm"]')
    (tmp_path / "short.toml").write_text(free + short, encoding="utf-8")
    table = command("run", "short.toml")
    assert table.count("< 10 ") == 2
    assert table.count("0.1677 ?") == 1
    assert "? : it is not known whether AR has settled at the greatest distance" in table
    with xr.open_dataset(tmp_path / "short" / "results.nc") as data:
        heads = {one.split(":")[0] for one in findings_of(data)}
    assert heads >= {"waves", "critical distance", "far value", "fresh spot, far value", "fresh spot, wave at bead 7"}
    page = Path("short/report.html").read_text(encoding="utf-8")
    assert "From the smallest distance with a wave on, 10.00 mm" in page
    assert "0.1677, perhaps not settled" in page
    # The wave of heavy beads on a thin plate does not come back.
    thin = (free + short).replace('"2 mm"', '"1 mm"').replace('"15 mm"', '"90 mm"')
    (tmp_path / "thin.toml").write_text(thin, encoding="utf-8")
    table = command("run", "thin.toml")
    assert f"unknown: {SWALLOWED}; take smaller beads" in " ".join(table.split())
    assert not re.search("> 0|nan|beyond the critical", table)


BRASS = """
chain = { beads = 20, bead = { shape = "sphere", radius = "4.76 mm", material = "steel 440C" }, impact_speed = 0.31 }
structure = { kind = "half_plane", thickness = "2 mm", material = "brass 360", edge = "clamped", distance = "40 mm" }
run.until = "2 ms"
[measure]
sensor = 7
"""
CRITICAL = """
critical_distance = { along = "structure.distance" }
[sweep]
"structure.distance" = { from = "10 mm", to = "60 mm", step = "10 mm" }
"""


def trace(case: Case, noise: float, seed: int, lead: float, gains: dict[int, float]) -> str:
    """A file of an oscilloscope: a run with noise, gains and a time zero."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = case.run()
    time, random = np.arange(0.0, float(run.time[-1]), 0.5e-6), np.random.default_rng(seed)
    columns = [time]
    for sensor, gain in gains.items():
        force = gain * np.interp(time - lead, run.time, hl.sensor_force(run, sensor), left=0.0)
        columns.append((force + random.normal(0.0, noise * abs(force).max(), time.size)) / 25.0)
    rows = "\n".join(",".join(f"{one:.7e}" for one in row) for row in np.column_stack(columns))
    return "time (s),1 (V),2 (V)\n" + rows + "\n"


def intervals(folder: Path) -> dict[str, tuple[float, float, float]]:
    rows = [line.split(",") for line in (folder / "unknowns.csv").read_text().splitlines()[1:]]
    return {row[0]: (float(row[1]), float(row[2]), float(row[3])) for row in rows}


def test_identify_finds_a_rods_modulus(tmp_path: Path, command: Callable[..., str]) -> None:
    text = (
        template("rod")
        .replace("1.5 ms", "1 ms")
        .replace('material = "steel 440C", length', 'material = "brass", length')
        + """
        [identify]
        sensors = { 7 = 1, 13 = 2 }
        calibration = { 7 = "25 N/V", 13 = 25 }
        unknowns = { "structure.layers[0].material.youngs_modulus" = ["50 GPa", "150 GPa"] }
        nuisances = ["gain"]
    """.replace("        ", "")
    )
    Path("rod.toml").write_text(text)
    true = case_of(text).changed({"structure.layers[0].material.youngs_modulus": "98 GPa"})
    Path("rod.csv").write_text(trace(true, 0.01, 4, 0.0, {7: 1.1, 13: -0.9}))
    said = command("identify", "rod.toml", "rod.csv")
    found = intervals(tmp_path / "rod-found")["structure.layers[0].material.youngs_modulus"]
    assert found[0] == pytest.approx(98e9, rel=0.03)
    assert found[1] - 0.5e9 < 98e9 < found[2] + 0.5e9
    assert "youngs_modulus, GPa" in said
    again = read(tmp_path / "rod-found" / "identified.toml")[0]
    assert again.value(parsed("structure.layers[0].material.youngs_modulus")) == found[0]
    # The report holds the table of the terminal, its notes, and a sketch of what was found.
    page = check_page(Path("rod-found/report.html").read_text())
    shown = [one.strip() for one in page.text["th"] + page.text["td"]]
    with xr.open_dataset("rod-found/results.nc") as data:
        for one in unknowns_of(data):
            assert set(one.row()) <= set(shown)
            assert all(cell in said for cell in one.row()[1:])
    assert any("youngs_modulus, GPa" in one for one in shown)
    assert page.text["h1"] == ["Identification: rod.csv"]
    assert any("samples of rod.csv, whose columns were converted to V." in words for words in page.text["p"])
    notes = [" ".join(one.split()) for one in page.text["li"]]
    of_reading = "signal: the waves of sensor 13 are negative"
    for words in ("at which it yields", "gain 13 is negative: this sensor's sign is reversed", of_reading):
        assert any(words in one for one in notes)
        assert words in " ".join(said.split())
    assert "The set-up to scale." in page.text["figcaption"]


@pytest.mark.thorough
def test_a_model_that_does_not_fit_is_identified_nowhere(command: Callable[..., str]) -> None:
    """In the table, the CSV file, the report, the files' names and the exit code; the truth is below the range."""
    asked = f"""
[identify]
sensors = {{ 5 = 1 }}
unit = "N"
unknowns = {{ "{MODULUS}" = ["6 GPa", "10 GPa"] }}
nuisances = ["gain", "chain.impact_speed"]
"""
    Path("wall.toml").write_text(SHORT_WALL + asked)
    true = case_of(SHORT_WALL).changed({MODULUS: "3 GPa"})
    Path("tap.csv").write_text(trace(true, 0.01, 4, 0.0, {5: 1.0}).replace("(V)", ""))
    said = command("identify", "wall.toml", "tap.csv", code=3)
    rows = [line.split(",") for line in Path("wall-found/unknowns.csv").read_text().splitlines()]
    verdicts = {row[0]: row[4] for row in rows[1:]}
    shown = said + Path("wall-found/report.html").read_text()
    assert verdicts.pop("chain.impact_speed") == verdicts.pop("gain 5") == "nuisance"
    assert list(verdicts.values()) == ["not trusted: the model does not fit"]
    assert "identified (" not in shown
    assert "not trusted" in shown
    assert "best_fit.toml" in said
    assert float(rows[1][5]) > 1.5


def test_a_nuisance_may_be_an_entry_of_a_material_that_is_named() -> None:
    """Its range is a factor around the value of that material."""
    asked = """
[identify]
sensors = { 7 = 1 }
unknowns = { "structure.material.youngs_modulus" = ["10 GPa", "50 GPa"] }
nuisances = ["chain.bead.material.youngs_modulus"]
"""
    question = question_of(case_of(template("wall") + asked))
    low, high = question.ranges["chain.bead.material.youngs_modulus"]
    assert low < hl.STEEL_440C.youngs_modulus < high
    assert low * high == pytest.approx(hl.STEEL_440C.youngs_modulus**2)
    simulation = question(**{name: ends[1] for name, ends in question.ranges.items()})
    assert simulation.chain.chain.beads[0].material.youngs_modulus == pytest.approx(high)


@pytest.mark.thorough
def test_a_map_has_a_row_for_each_point(tmp_path: Path, command: Callable[..., str]) -> None:
    """Two moduli of a wall, of which one is tapped twice, and a file without samples."""
    text = SHORT_WALL
    asked = """
        [identify]
        sensors = { 5 = 1 }
        unit = "N"
        unknowns = { "structure.material.youngs_modulus" = ["2 GPa", "5 GPa"] }
    """
    Path("wall.toml").write_text(text + asked.replace("        ", ""))
    Path("scan").mkdir()
    taps = {"a": ("2.6 GPa", 0.3), "c": ("3.7 GPa", 0.4), "d": ("3.7 GPa", 0.4)}
    for seed, (name, (modulus, speed)) in enumerate(taps.items()):
        changes = {"structure.material.youngs_modulus": modulus, "chain.impact_speed": speed}
        signal = trace(case_of(text).changed(changes), 0.004, seed, 40e-6, {5: 1.0})
        Path(f"scan/{name}.csv").write_text(signal.replace("(V)", ""))
    Path("scan/lost.csv").touch()
    Path("scan/points.csv").write_text(
        "x / mm, y / mm, file, chain.impact_speed / m/s, by\n"
        "0, 0, a.csv, 0.3, Eva\n0, 25, c.csv, 0.4, Eva\n0, 25, d.csv, 0.4, Eva\n"
        "25, 25, lost.csv, 0.3, Eva\n"
    )
    said = command("map", "wall.toml", "scan", "--jobs", "1", code=3)
    assert max(map(len, said.split("\n\n")[0].splitlines())) <= 80
    assert "3 points: 2 identified, 1 failed" in said
    with Path("wall-map/map.csv").open(newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["unknown"].endswith("modulus")]
    assert [row["verdict"] for row in rows] == ["identified"] * 2 + ["failed"]
    assert [row["taps"] for row in rows] == ["1", "2", "0"]
    for row, true in zip(rows, (2.6e9, 3.7e9), strict=False):
        slack = 0.5 * (float(row["high"]) - float(row["low"]))  # four standard deviations in all
        assert float(row["low"]) - slack < true < float(row["high"]) + slack
        assert slack < 0.1 * true
    assert "lost.csv: holds 0 lines" in " ".join(rows[2]["reason"].split())
    page = check_page(Path("wall-map/report.html").read_text())
    assert any("3 points: 2 identified, 1 failed" in words for words in page.text["p"])
    assert {path.name for path in Path("wall-map").glob("*.png")} >= {"structure-material-youngs_modulus-value.png"}
    # The same command again reads the lost file alone.
    Path("scan/lost.csv").write_text(Path("scan/a.csv").read_text())
    kept = {path.name: path.stat().st_mtime_ns for path in Path("wall-map.parts").glob("*.nc")}
    command("map", "wall.toml", "scan", "--jobs", "1", "--force")
    assert len(kept) == 3
    assert not Path("wall-map.parts").exists()
    assert "3 points: 3 identified" in Path("wall-map/table.txt").read_text()


@pytest.mark.thorough
def test_a_map_without_unknowns_reads_ar_and_tof(command: Callable[..., str]) -> None:
    """A run that goes through a file has its own values."""
    Path("wall.toml").write_text(SHORT_WALL)
    Path("tap.csv").write_text(trace(case_of(SHORT_WALL), 0.002, 1, 40e-6, {5: 1.0}))
    Path("points.csv").write_text("x / mm, y / mm, file\n0, 0, tap.csv\n")
    said = command("map", "wall.toml", "points.csv", "--jobs", "1")
    rows = {row["unknown"]: row for row in csv.DictReader(Path("wall-map/map.csv").read_text().splitlines())}
    run = case_of(SHORT_WALL).run()
    for name, value in (("AR", hl.amplitude_ratio(run, 5)), ("TOF", hl.time_of_flight(run, 5))):
        row = rows[f"{name} at bead 5"]
        assert float(row["value (SI)"]) == pytest.approx(float(value), rel=0.01)
        assert row["verdict"] == "measured"
    assert "1 point: 1 measured" in said
    assert re.search(r" 0\.\d+ \(0\.\d+ to 0\.\d+\) ", said)
    with xr.open_dataset("wall-map/results.nc") as data:
        several = data.assign(fits=data.fits + 1)
        assert map_table(several, points_of(several)).shown.verdict[0] == "measured*"


@pytest.mark.parametrize(
    ("head", "message"),
    [
        ("x / mm, y / mm, file", "file: tap.csv: there is no such file"),
        ("x = structure.distance / mm, y / mm, file", "column x: structure.distance"),
        ("x = chain.impact_speed / mm, y / mm, file", "column x: chain.impact_speed"),
        (f"x / mm, y / mm, file, {MODULUS} / GPa", f"column {MODULUS}: is an unknown of [identify] as well"),
    ],
)
def test_a_table_that_does_not_fit_the_case_is_refused(
    head: str, message: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """It is refused before any fit."""
    monkeypatch.chdir(tmp_path)
    asked = f'\n[identify]\nsensors = {{ 7 = 1 }}\nunit = "N"\nunknowns = {{ "{MODULUS}" = ["2 GPa", "5 GPa"] }}\n'
    Path("points.csv").write_text(f"{head}\n0, 0, tap.csv{', 3' if MODULUS in head else ''}\n")
    with pytest.raises(ValueError, match=re.escape(f"points.csv:2: {message}")):
        grid_of(case_of(template("wall") + asked), Path("points.csv"))
