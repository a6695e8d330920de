"""Case files give the numbers of the same Python; results turn into cases again."""

import csv
import json
import re
import tomllib
from collections.abc import Callable
from math import radians
from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest
import xarray as xr
from command import case_of
from page_parser import check_page

import hertzlink as hl
from coupling.results.findings import findings_of
from coupling.results.provenance import as_text
from hertzlink.cases import as_toml, line_of, parsed, written
from hertzlink.cases.case import Case, read
from hertzlink.cases.forms import example_of
from hertzlink.cases.reader import number
from hertzlink.cases.schema import schema
from hertzlink.cases.tables import Table
from hertzlink.cases.tasks import run_task, task_of
from hertzlink.cases.templates import KINDS, template
from structures.described import registered

BOUNDARY = """\
[chain]
beads = 20
bead = { shape = "sphere", diameter = "4.76 mm", material = "steel 440C" }
striker = "bead"
impact_speed = "0.31 m/s"

[structure]
kind = "kirchhoff_plate"
length = "914 mm"
width = "914 mm"
thickness = "2.29 mm"
material = "aluminium 6061"
supports = { left = "clamped", right = "clamped", bottom = "free", top = "free" }
at = ["60 mm", "457 mm"]

[run]
until = "3.5 ms"

[sweep]
"structure.thickness" = ["2.29 mm", "3.18 mm", "4.83 mm"]
"structure.at[0]" = { from = "10 mm", to = "200 mm", step = "10 mm" }

[measure]
sensor = 7
critical_distance = { along = "structure.at[0]", tolerance = "2 %" }
"""


def test_a_layered_rod_is_that_of_python() -> None:
    """Materials of the case's own, millimetres, and a drop height."""
    text = """
        [materials.resin]
        youngs_modulus = "3.2 GPa"
        poisson_ratio = 0.38
        density = "1.18 g/cm^3"
        [chain]
        beads = 16
        bead = { shape = "sphere", radius = "4.76 mm", material = "Steel-440c" }
        drop_height = "10 mm"
        gravity = 9.81
        dissipation = { kind = "linear_dashpot", coefficient = "5 N s/m" }
        [structure]
        kind = "rod"
        layers = [
            { material = "steel 440C", length = "6.35 mm", diameter = "19.05 mm" },
            { material = "resin", length = 0.0254, radius = "9.525 mm" },
        ]
        [run]
        until = "600 µs"
    """
    resin = hl.Material(3.2e9, 0.38, 1180.0, "resin")
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 16, bead, hl.drop_speed(0.01), gravity=9.81, dissipation=hl.LinearDashpot(5.0))
    rod = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(resin, 25.4e-3, 9.525e-3)])
    assert case_of(text).run().identical(hl.CoSimulation(chain, rod).run(600e-6))


def test_a_mixed_chain_is_that_of_python() -> None:
    """All shapes, angles in degrees, a spring, a preload, a law of its own and other windows."""
    text = """
        [chain]
        beads = [
            { shape = "sphere", diameter = "9.53 mm", material = "steel 316", count = 3 },
            { shape = "hollow_sphere", radius = "9.525 mm", inner_radius = "8.655 mm", material = "aluminium 6061" },
            { shape = "ellipsoid", radius = "4.76 mm", length = "15 mm", material = "steel 316", axis = "along" },
            { shape = "cylinder", radius = "4.76 mm", length = "9.52 mm", material = "PTFE", angle = "45 deg" },
        ]
        repeat = 2
        striker = { kind = "spring_loaded", stiffness = "0.2 N/mm", compression = "2 mm" }
        preload = "2 N"
        inclination = "30 deg"
        dissipation = { kind = "restitution", coefficient = 0.97 }
        [structure]
        kind = "wall"
        material = { like = "nylon", density = 1150 }
        [run]
        until = "0.2 ms"
        accuracy = "screening"
        scheme = { kind = "aitken", tolerance = 1e-8 }
        save_every = "1 us"
    """
    ball = hl.Sphere(9.53e-3 / 2, hl.STEEL_316)
    beads = [
        ball, ball, ball, hl.HollowSphere(9.525e-3, 8.655e-3, hl.ALUMINIUM_6061),
        hl.Ellipsoid(4.76e-3, 15e-3, hl.STEEL_316, "along"), hl.Cylinder(4.76e-3, 9.52e-3, hl.PTFE, radians(45)),
    ]  # fmt: skip
    chain = hl.Chain(
        beads * 2, hl.SpringLoaded(ball, 200.0, 2e-3), preload=2.0, inclination=radians(30),
        dissipation=hl.Restitution(0.97),
    )  # fmt: skip
    wall = hl.half_space(hl.Material(6.52e9, 0.40, 1150.0, "like nylon"))
    case, simulation = case_of(text), hl.CoSimulation(chain, wall, hl.Aitken(1e-8), accuracy="screening")
    assert case.simulation().chain.chain == chain
    assert as_text(case.simulation().describe()) == as_text(simulation.describe())
    assert (case.until, case.tree.entries["run"].entries["save_every"]) == (0.2e-3, 1e-6)


def boundary(tmp_path: Path, *changes: str) -> Case:
    (tmp_path / "plate-boundary.toml").write_text(BOUNDARY)
    return read(tmp_path / "plate-boundary.toml", changes)[0]


def test_a_plate_is_that_of_python_and_comes_back(tmp_path: Path) -> None:
    case = boundary(tmp_path, "run.until=0.4 ms", "structure.length=200 mm", "structure.width=150 mm",
                    "structure.at=['60 mm', '75 mm']")  # fmt: skip
    supports = hl.Supports(left="clamped", right="clamped")
    plate = hl.kirchhoff_plate(0.2, 0.15, 2.29e-3, hl.ALUMINIUM_6061, supports)
    bead = hl.Sphere(2.38e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 20, bead, 0.31)
    run = hl.CoSimulation(chain, hl.reduce(plate.at(0.06, 0.075), 0.4e-3)).run(0.4e-3)
    assert case.run().identical(run)
    assert case_of(case.to_toml()).run().identical(run)
    assert case.simulation().structure.structure is case.simulation().structure.structure, "is built once"


def test_a_run_from_the_command_line(tmp_path: Path, command: Callable[..., str]) -> None:
    Path("rod.toml").write_text(template("rod").replace("1.5 ms", "0.8 ms"))
    said = command("run", "rod.toml", "--set", "chain.impact_speed=0.2 m/s", "--set", "measure.sensor=8")
    assert max(map(len, said.split("\n\n")[0].splitlines())) <= 80
    assert "peak, N  arrival, µs      AR  TOF, µs" in said
    folder = tmp_path / "rod"
    names = {"case.toml", "files.txt", "report.html", "results.nc", "table.txt", "traces.csv", "waves.csv"}
    assert {path.name for path in folder.iterdir()} == names
    assert (folder / "table.txt").read_text().strip() in said
    page = (folder / "report.html").read_text()
    assert "bead 8" in page
    assert "bead 10" not in page
    with xr.open_dataset(folder / "results.nc") as data:
        waves = hl.reflections(data.load(), sensor=8)
        assert case_of(data.attrs["case"]).run().contact_force.equals(data.contact_force)
        assert json.loads(data.attrs["input"])["chain"]["impact_speed"] == 0.2
    rows = (folder / "waves.csv").read_text().splitlines()
    assert float(rows[2].split(",")[4]) == waves.primary.amplitude_ratio
    assert len((folder / "traces.csv").read_text().splitlines()) == data.sizes["time"] + 1
    # The case in the folder, and the result, run again.
    command("run", "rod/case.toml", "--output", "again", "--figures", "png")
    pictures = {f"{name}.png" for name in ("setup", "traces", "map", "energy")}
    assert {path.name for path in Path("again").iterdir()} == names | pictures
    assert all(Path("again", name).read_bytes().startswith(b"\x89PNG") for name in pictures)
    assert Path("again/waves.csv").read_text() == (folder / "waves.csv").read_text()


def test_a_sweep_from_the_command_line(tmp_path: Path, command: Callable[..., str]) -> None:
    text = template("sweep").replace("1.5 ms", "0.9 ms").replace('"steel 440C", "acrylic", "PTFE"', '"acrylic", "PTFE"')
    Path("mine.toml").write_text(text + "traces = true\n")
    said = command("run", "mine.toml", "--jobs", "1", "--output", "out")
    assert " ".join(said.splitlines()[0].split()) == "material length, mm bead AR TOF, µs AR, 2nd TOF, µs"

    def build(material: hl.Material, length: float) -> hl.CoSimulation:
        bead = hl.Sphere(9.53e-3 / 2, hl.STEEL_440C)
        chain = hl.Chain([bead] * 20, bead, 0.34)
        return hl.CoSimulation(chain, hl.rod([hl.Layer(material, length, 19.05e-3 / 2)]))

    runs = hl.sweep(build, 0.9e-3, jobs=1, material=[hl.ACRYLIC, hl.PTFE], length=[0.05, 0.075, 0.1])
    with xr.load_dataset("out/results.nc") as data:
        np.testing.assert_array_equal(data.amplitude_ratio.sel(sensor=7), hl.amplitude_ratio(runs, 7))
        np.testing.assert_array_equal(data.sensor_force.sel(sensor=7), hl.sensor_force(runs, 7))
        assert data.length.attrs == {
            "path": "structure.layers[0].length", "units": "m", "long_name": "layer 1 length"
        }  # fmt: skip
    first = Path("out/points.csv").read_text().splitlines()[1].split(",")
    assert float(first[3]) == hl.amplitude_ratio(runs, 7).values[0, 0]
    force = data.sensor_force.isel(material=0, length=0).sel(sensor=7).values
    with Path("out/traces.csv").open() as file:
        head, *rows = csv.reader(file)
    assert head[:2] == ["time (s)", "force at bead 7, material acrylic, length, mm 50 (N)"]
    np.testing.assert_array_equal([float(row[1]) for row in rows], force)
    page = Path("out/report.html").read_text()
    assert page.count("<figure") == 5  # the set-up; AR and TOF of the primary and the secondary wave
    assert "acrylic" in page
    cells = check_page(page)
    assert {f"{float(first[3]):.5g}", f"{1e6 * float(first[4]):.5g}"} <= set(cells.text["td"])


def test_a_critical_distance_from_the_command_line(tmp_path: Path, command: Callable[..., str]) -> None:
    text = template("critical-distance").replace('["1 mm", "2 mm"]', '["2 mm"]').replace("0.7 ms", "0.5 ms")
    Path("mine.toml").write_text(
        text.replace('from = "5 mm", to = "60 mm", step = "5 mm"', 'from = "8 mm", to = "48 mm", count = 5')
    )
    said = command("run", "mine.toml", "--jobs", "1")

    def at(distance: float) -> hl.CoSimulation:
        bead = hl.Sphere(2.38e-3, hl.STEEL_440C)
        plate = hl.half_plane(2e-3, hl.BRASS_360, "clamped", distance, until=0.5e-3)
        return hl.CoSimulation(hl.Chain([bead] * 20, bead, 0.31), plate)

    scan = [0.008, 0.018, 0.028, 0.038, 0.048]
    found = hl.critical_distance_search(at, 0.5e-3, 7, scan, jobs=1)
    row = Path("mine/critical_distance.csv").read_text().splitlines()[1].split(",")
    assert float(row[1]) == found.critical_distance.item()
    assert f"{1e3 * found.critical_distance.item():.4g}" in said
    assert "beyond the critical distance AR stays within ± 0.02 of AR far away" in said
    assert row[-2:] == ["0.02", "elastic"]
    with xr.open_dataset("mine/results.nc") as data:
        np.testing.assert_array_equal(data.amplitude_ratio.values[0], found.amplitude_ratio)
    page = Path("mine/report.html").read_text()
    low, high = 1e3 * found.bracket.values
    assert f"critical, on elastic contacts: {low:.4g} to {high:.4g} mm" in page
    assert f"<td>{1e3 * float(row[1]):.2f}</td>" in page


def test_a_ratio_above_one_is_remarked(command: Callable[..., str]) -> None:
    """In the table too, not in the report alone. Beyond a soft bead the incident wave is weak, and waves merge."""
    bead = '{ shape = "sphere", diameter = "9.53 mm", material = "%s", count = %d }'
    beads = ", ".join(bead % one for one in (("steel 440C", 10), ("PTFE", 1), ("steel 440C", 9)))
    Path("case.toml").write_text(template("rod").replace("beads = 20", f"beads = [{beads}]"))
    said = " ".join(command("run", "case.toml", "--set", "measure.sensor=14").split())
    rows = Path("case/waves.csv").read_text().splitlines()[1:]
    assert any(float(row.split(",")[4] or 0.0) > 1.0 for row in rows)
    assert "AR above 1: the beads on the two sides of the sensor differ" in said


def test_check_says_what_would_run(tmp_path: Path, command: Callable[..., str]) -> None:
    boundary(tmp_path)
    given = ["structure.length=200 mm", "structure.width=200 mm", "structure.at[1]=100 mm", "run.until=0.5 ms"]
    given += ['sweep."structure.at[0]".to=100 mm']
    said = command("check", "plate-boundary.toml", *(word for one in given for word in ("--set", one)))
    runs = ("a critical distance from 30 runs", "thickness, mm: 3 values, 2.29 to 4.83", "x, mm: 10 values, 10 to 100")
    for words in (*runs, "Chain(20 Sphere", "a mesh of", "record: 0.5 ms"):
        assert words in said
    assert "identify" not in said
    assert [path.name for path in tmp_path.iterdir()] == ["plate-boundary.toml"]


@pytest.mark.parametrize(
    ("head", "row", "lines"),
    [
        (["bead", "AR"], ["7", "0.3"], ["bead   AR", "---------", "   7  0.3"]),
        ([40 * "a", 40 * "b", 41 * "c"], ["1", "2", "3"], [f"{40 * 'a'}: 1;", f"  {40 * 'b'}: 2;", f"  {41 * 'c'}: 3"]),
    ],
)  # fmt: skip
def test_a_table_fits_the_terminal(head: list[str], row: list[str], lines: list[str]) -> None:
    """Each row of a wide table is a sentence."""

    def table(rows: list[list[str]]) -> Table:
        return Table("points.csv", pd.DataFrame(), pd.DataFrame(rows, columns=head))

    shown = "\n".join(table([row]).lines()).splitlines()
    assert shown == lines
    assert max(map(len, shown)) <= 80
    assert table([row] * 50).lines()[-1] == "... and 10 more in points.csv"


def test_text_of_a_user_is_no_formula_of_a_spreadsheet() -> None:
    rows = pd.DataFrame({"material": ["=cmd|'/c calc'!A1", "PTFE"], "AR": [-0.5, float("nan")]})
    assert Table("points.csv", rows).csv() == "material,AR\n'=cmd|'/c calc'!A1,-0.5\nPTFE,\n"


def test_check_looks_at_all_values_of_a_sweep(command: Callable[..., str]) -> None:
    """It looks not only at the first value: a later one was given in mm."""
    sweep = '[sweep]\n"chain.bead.diameter" = ["4.76 mm", "9.53 mm", 19.05]\n'
    Path("case.toml").write_text(template("wall").replace("[run]", f"{sweep}[run]").replace("1.5 ms", "0.1 ms"))
    said = command("check", "case.toml")
    assert "warning: Sphere diameter = 19.05: is read as 19.05 m, which is improbable; did you mean 19.05 mm?" in said
    assert said.count("did you mean") == 1


def test_a_point_without_a_wave_says_why() -> None:
    """A thin plate without edges takes the wave of heavy beads."""
    plate = '[structure]\nkind = "infinite_plate"\nthickness = "1 mm"\nmaterial = "brass 360"\n\n'
    sweep = '[sweep]\n"structure.thickness" = ["1 mm", "4 mm"]\n'
    text = template("half-plane").replace("4.76", "9.53").replace("0.8 ms", "2 ms") + sweep
    data = run_task(task_of(case_of(re.sub(r"(?s)\[structure\].*?\n\n", plate, text))), 1)
    (said,) = [one for one in findings_of(data) if "waves at bead 7: no wave above 1 % of" in one]
    assert said.endswith("(at thickness = 1 mm; reported at 1 of 2 points)")


def test_the_distance_of_an_edge_keeps_its_name() -> None:
    """In results and in warnings, as the distance of a critical distance has it."""
    swept = '\n[sweep]\n"structure.distance" = { from = "5 mm", to = "15 mm", step = "5 mm" }\n'
    case = case_of(template("half-plane") + swept)
    found = case.changed({"measure.critical_distance": {"along": "structure.distance"}})
    assert [task_of(one).axes[0].name for one in (case, found)] == ["distance", "distance"]


def test_check_knows_what_identify_takes(command: Callable[..., str]) -> None:
    Path("chain.toml").write_text(template("chain"), encoding="utf-8")
    assert "structure: nothing" in command("check", "chain.toml")
    Path("i.toml").write_text(template("identify"), encoding="utf-8-sig")
    said = command("check", "i.toml", "--set", "run.until=0.1 ms")
    assert "too short: a wave takes about 400 µs to the structure and back" in said
    assert "identify: 2 unknowns, 3 nuisances" in said


@pytest.mark.parametrize("kind", KINDS)
def test_templates_are_cases(kind: str) -> None:
    """Commented, as short as a page, and each runs: here those that are quick, over a short record and unswept."""
    text = template(kind)
    assert text.startswith("# ")
    assert len(text.splitlines()) < 50
    assert set(re.findall(r"hard steel \((.*?)\)", text)) <= {"yield strength 0.9 GPa"}
    case = case_of(text)
    jsonschema.validate(case.data, schema())
    if kind not in ("chain", "cylinder", "deformable", "plate", "thick-plate"):
        short = case.changed({"run.until": "30 us"})
        run = short.run()
        assert np.isfinite(run.velocity).any("bead").all()
        assert np.isfinite(hl.energy_error(run))


@pytest.mark.thorough
@pytest.mark.parametrize("kind", [one for one in KINDS if one != "identify"])  # whose page runs it
def test_templates_run_as_they_stand(kind: str, command: Callable[..., str]) -> None:
    command("new", kind, "case.toml")
    said = command("run", "case.toml")
    assert "written to" in said
    with xr.open_dataset("case/results.nc") as data:
        # Weak second waves, and those on a fresh spot, often have two peaks of one height.
        doubts = "fresh spot, |.*the secondary wave has peaks of nearly the same height"
        found = [one for one in findings_of(data) if not re.match(doubts, one)]
    # Of brass and aluminium, which yield, the template says so, and the run says what that changes and the cure.
    assert ["yields; " in one for one in found] == [True] * ("it yields" in template(kind))


@pytest.mark.parametrize("kind", [one for one in KINDS if "\n# law = " in template(one)])
def test_the_law_in_a_template_needs_only_its_comment_removed(kind: str) -> None:
    for call in case_of(template(kind).replace("\n# law = ", "\nlaw = ")).all("chain"):
        assert isinstance(call.made.law, hl.laws.JacksonGreen) or call.entries["striker"] == "none"


def test_the_schema_is_one() -> None:
    found = schema()
    jsonschema.Draft202012Validator.check_schema(found)
    valid = jsonschema.Draft202012Validator(found)
    assert valid.is_valid(tomllib.loads(BOUNDARY))
    assert valid.is_valid(tomllib.loads(f'extends = "plate.toml"\n{template("identify")}'))
    assert not valid.is_valid(tomllib.loads(BOUNDARY.replace("thickness =", "thicknes =")))
    assert not valid.is_valid(tomllib.loads(BOUNDARY.replace("kirchhoff_plate", "kirchoff_plate")))


def test_text_of_a_case_keeps_everything() -> None:
    data = tomllib.loads(BOUNDARY) | {
        "title": 'a "quoted" title\n\x7f',
        "materials": {"my glue": {"density": 0.1 + 0.2}},
    }
    assert tomllib.loads(as_toml(data)) == data


def test_lines_are_found_in_all_forms_of_toml() -> None:
    text = '''# a comment
title = """two
lines = 3"""
a.b."c d" = 1 # [x]

[[list]]
x = [1,
  { y = "]", z = [ 'a', "\\"b" ] },
]
[[list]]
[list.inner]
"k=v" = 2
[empty]
'''
    found = {
        ("title",): 2, ("a", "b", "c d"): 4, ("list", 0, "x", 1, "z", 1): 8, ("list", 1): 10,
        ("list", 1, "inner", "k=v"): 12, ("empty",): 13, ("none",): 0,
    }  # fmt: skip
    assert {path: line_of(text, path) for path in found} == found


def test_paths_are_read_and_written() -> None:
    for text in ("structure.layers[1].material", 'a."b c"[0][2].d', "x"):
        assert written(parsed(text)) == text


def test_what_messages_recommend_for_a_quantity_can_be_read() -> None:
    own = hl.quantities.Quantity("s", "a time")
    assert example_of(own) == "0.02 s"
    found = [one.quantity for of in registered() for one in of.parameters.values()]
    # A unit with an exponent of its own, as N/m^n, has none to write.
    known = [one for one in found if one is not None and one.unit_in_files and not one.example.endswith("e10")]
    assert len(known) > 50
    assert all(np.isfinite(number(example_of(one), one)) for one in known)
