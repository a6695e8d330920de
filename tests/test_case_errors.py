"""Wrong case files: one line that names file, line, path and cure; exit code 2; nothing written."""

import os
import tomllib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import skfem
from command import ended
from skfem.io.meshio import to_meshio

from hertzlink.cases.case import read
from hertzlink.cases.tasks import task_of

ROD = """\
[chain]
beads = 8
bead = { shape = "sphere", diameter = "9.53 mm", material = "steel 440C" }
striker = "bead"
impact_speed = "0.3 m/s"

[structure]
kind = "rod"
layers = [
    { material = "steel 440C", length = "20 mm", radius = "9.5 mm" },
    { material = "PTFE", length = "20 mm", radius = "9.5 mm" },
]

[run]
until = "0.1 ms"
"""

PLATE = """\
[chain]
beads = 20
bead = { shape = "sphere", diameter = "4.76 mm", material = "steel 440C" }
impact_speed = "0.31 m/s"

[structure]
kind = "kirchhoff_plate"
length = "300 mm"
width = "200 mm"
thickness = "2 mm"
material = "aluminium 6061"
supports = { left = "clamped" }
at = ["60 mm", "100 mm"]

[run]
until = "0.5 ms"

[sweep]
"structure.thickness" = ["2 mm", "3 mm"]
"structure.at[0]" = { from = "20 mm", to = "60 mm", step = "20 mm" }

[measure]
sensor = 7
critical_distance = { along = "structure.at[0]", tolerance = 0.02 }

[identify]
sensors = { 7 = 1, 13 = 2 }
calibration = "25 N/V"
unknowns = { "structure.thickness" = ["1 mm", "6 mm"] }
nuisances = ["chain.impact_speed", "gain", "time_zero"]
"""

WRONG_RODS = [
    # TOML itself.
    ('until = "0.1 ms"', 'until = "0.1 ms', 15, "TOML"),
    ("beads = 8", "beads = 8\nbeads = 9", 3, "is given twice"),
    ("[run]", "[run", 14, "TOML"),
    # Names of sections and entries.
    ("[structure]", "[strucutre]", 7, "strucutre: is not an entry here; did you mean structure?"),
    ("beads = 8", "bead_count = 8", 2, "chain.bead_count: is not an entry here"),
    ("[run]", "[run]\nend = 1", 15, "run.end: is not an entry here"),
    ('radius = "9.5 mm" },\n]', 'raduis = "9.5 mm" },\n]', 11, "structure.layers[1].raduis: is not an entry here; did you mean radius?"),
    ("impact_speed", "velocity", 5, "chain.velocity: is not an entry here; must be one of "),
    ('"9.53 mm"', '"9.53 Mm"', 3, 'chain.bead.diameter: "9.53 Mm": half of it must lie between 1e-15 and 1 Mm'),
    # What is missing.
    ('[run]\nuntil = "0.1 ms"\n', "", None, 'run: is missing; give a section: [run] with until = "1.5 ms"'),
    ('until = "0.1 ms"', "", 14, 'run.until: is missing; give a time, such as "1.5 ms", or a number in s'),
    ("beads = 8", "", 1, "chain.beads: is missing; give a whole number of beads, such as 20"),
    ('impact_speed = "0.3 m/s"', "", 1, 'chain.impact_speed: is missing; give a speed, such as "0.31 m/s", or a drop_height'),
    ('bead = { shape = "sphere", diameter = "9.53 mm", material = "steel 440C" }', "", 1, "chain.bead: is missing; give a bead"),
    ('shape = "sphere", ', "", 3, "chain.bead.shape: is missing; must be one of cylinder, "),
    ('diameter = "9.53 mm", ', "", 3, "chain.bead.radius: is missing; give a radius or a diameter"),
    (', material = "steel 440C" }', " }", 3, 'chain.bead.material: is missing; give a material, such as "aluminium 6061"'),
    ('kind = "rod"', "", 7, "structure.kind: is missing; must be one of nothing"),
    ('material = "PTFE", length = "20 mm"', 'material = "PTFE"', 11, "structure.layers[1].length: is missing; give a length"),
    # Materials.
    ('"PTFE"', '"PFTE"', 11, 'structure.layers[1].material: "PFTE" is not a material; did you mean PTFE?'),
    ('"PTFE"', '"steal"', 11, '"steal" is not a material; did you mean steel 316 or steel 440C?'),
    ('"PTFE"', '"unobtainium"', 11, '"unobtainium" is not a material; must be one of steel 316, steel 440C'),
    ('"PTFE"', "7", 11, "structure.layers[1].material: 7 must be the name of a material"),
    ('"PTFE"', "{ youngs_modulus = 1e9 }", 11, "structure.layers[1].material.poisson_ratio: is missing; give a number"),
    ('"PTFE"', '{ like = "PTFE", poisson_ratio = 0.6 }', 11, "material.poisson_ratio: 0.6 must lie between -1 and 0.5"),
    ('"PTFE"', '{ like = "PTFE", yungs_modulus = 1e9 }', 11, "material.yungs_modulus: is not an entry here; did you mean youngs_modulus?"),
    ("[chain]", "[materials.glue]\nyoungs_modulus = 1e9\n[chain]", 1, "materials.glue.poisson_ratio: is missing"),
    # Units.
    ('"9.53 mm"', '"9.53 mn"', 3, 'chain.bead.diameter: "9.53 mn": "mn" is not a unit'),
    ('"9.53 mm"', '"9.53 kg"', 3, '"kg" is not a unit of this quantity; must be a length, such as 2.29 mm, or a number in m'),
    ('"9.53 mm"', '"9.53"', 3, 'chain.bead.diameter: "9.53" has no unit; must be a length'),
    ('"9.53 mm"', '"9,53 mm"', 3, '"9,53 mm" must be a length, such as 2.29 mm, or a number in m; write a decimal point'),
    ('"9.53 mm"', '"about 9 mm"', 3, '"about 9 mm" must be a length'),
    ('"9.53 mm"', "nan", 3, "chain.bead.diameter: nan is not finite"),
    ('"9.53 mm"', "true", 3, "chain.bead.diameter: true must be a length"),
    # Kinds.
    ('kind = "rod"', 'kind = "rood"', 8, 'structure.kind: "rood" is not a kind; did you mean rod?'),
    ('kind = "rod"', "kind = 7", 8, "structure.kind"),
    ('kind = "rod"', 'kind = "rod"\nbase = "fix"', 9, 'structure.base: "fix" is not possible; did you mean fixed?'),
    ("beads = 8", 'beads = 8\ndissipation = { kind = "dashpot", coefficient = 5 }', 3, 'chain.dissipation.kind: "dashpot" is not a kind; did you mean'),
    ("beads = 8", 'beads = 8\nlaw = "jackson_green"', 3, 'chain.law: "jackson_green" must be a table; write law = { kind = "jackson_green" }'),
    ("beads = 8", "beads = 8\ndissipation = 5", 3, "chain.dissipation: 5 must be a table"),
    ("beads = 8", 'beads = 8\nlaw = { kind = "power_law" }', 3, "chain.law.stiffness: is missing; give a number"),
    # Types.
    ("beads = 8", 'beads = "8"', 2, 'chain.beads: "8" must be a whole number of beads, such as 20, or a list of beads'),
    ("beads = 8", "beads = 8\nrepeat = 100000000", 3, "chain.repeat: 100000000 must be at most"),
    ("beads = 8", "beads = 5000\nrepeat = 50000", 3, "chain.repeat: 50000 makes 250000000 beads"),
    ("beads = 8", "beads = [7]", 2, "chain.beads[0]: 7 must be a table"),
    ('striker = "bead"', "striker = 3", 4, 'chain.striker: 3 must be "bead", "none"'),
    ('striker = "bead"', 'striker = { kind = "spring" }', 4, 'chain.striker.kind: "spring" is not a kind; did you mean spring_loaded?'),
    # What hertzlink's objects refuse.
    ('"9.53 mm"', '"-9.53 mm"', 3, 'chain.bead.diameter: "-9.53 mm" must be a positive number of m'),
    ('diameter = "9.53 mm"', 'diameter = 0.01, radius = 0.005', 3, "chain.bead.diameter: give radius or diameter, not both"),
    ('shape = "sphere", diameter = "9.53 mm"', 'shape = "hollow_sphere", radius = "4 mm", inner_radius = "5 mm"', 3, 'chain.bead.inner_radius: "5 mm" must be less than the radius, 4 mm'),
    ('"0.3 m/s"', '"0.3 m/s"\ndrop_height = "1 cm"', 6, "chain.drop_height: gives the impact speed; leave out impact_speed"),
    ("beads = 8", 'beads = 8\ninclination = 45', 3, "chain.inclination: 45.0 must lie between -2π and 2π"),
    ("beads = 8", 'beads = 8\ndissipation = { kind = "restitution", coefficient = 1.2 }', 3, "chain.dissipation.coefficient: 1.2 must lie between 0.01 and 1"),
    ('striker = "bead"\nimpact_speed = "0.3 m/s"', 'striker = { kind = "spring_loaded", stiffness = -2, compression = "1 mm" }', 4, "chain.striker.stiffness: -2.0 must be a positive number of N/m"),
    ('kind = "rod"', 'kind = "rod"\nelements = 10000000', 9, "structure.elements: 20000000 in the rod are too many"),
    ('kind = "rod"', 'kind = "rod"\ndamping = [{ kind = "modal", ratio = 0.01 }]', 9, "structure.damping[0]: structure: must consist of modes"),
    ('until = "0.1 ms"', 'until = "-1 ms"', 15, 'run.until: "-1 ms" must be a positive number of s'),
    ('until = "0.1 ms"', 'until = "0.1 ms"\nsave_every = "1 s"', 16, 'run.save_every: "1 s" must not be longer than the run'),
    ('until = "0.1 ms"', 'until = "0.1 ms"\nscheme = { kind = "explicit", reuse = 2 }', 16, "run.scheme.reuse: is not an entry here; must be one of kind, predictor"),
    ('until = "0.1 ms"', 'until = "0.1 ms"\nwindow = "1 us"\nadaptive = { tolerance = 1e-4 }', 17, "run.adaptive: sets the windows; leave out window"),
    ('until = "0.1 ms"', 'until = "0.1 ms"\nreduce = "yes"', 16, 'run.reduce: "yes" must be true, false, or a table'),
    # What does not fit together.
    ("[run]", "[measure]\nsensor = 9\n[run]", 15, "measure.sensor: 9 is not a bead of a chain of 8; beads are counted from the struck end"),
    ("[run]", "[measure]\nsensor = 0\n[run]", 15, "measure.sensor: 0 must be at least 1"),
    ("[run]", "[measure]\nsensors = [3, 9]\n[run]", 15, "measure.sensors[1]: 9 is not a bead"),
    ("[run]", "[measure]\nsensors = [3, 3]\n[run]", 15, "measure.sensors: names a bead twice"),
    ("[chain]", 'extends = "none.toml"\n[chain]', 1, 'extends: there is no file "none.toml"'),
    ("[chain]", 'extends = "case.toml"\n[chain]', 1, 'extends: "case.toml" leads back to this file'),
    ("[chain]", "extends = 3\n[chain]", 1, "extends: must be the name of a case file"),
    # Uncertainties.
    ("[run]", '[sensitivities]\n"structure.layers[1].length" = "2 N"\n[run]', 15, '"2 N": "N" is not a unit of this quantity; must be a length'),
    ("[run]", '[sensitivities]\n"structure.layers[1].length" = "-1 %"\n[run]', 15, '"-1 %" must be a standard uncertainty, such as "0.02 mm"'),
    ("[run]", '[sensitivities]\n"chain.beads" = "1 %"\n[run]', 15, "8 must be a number other than zero, and not a count"),
    ("[run]", '[sensitivities]\n"chain.gravity" = "1 %"\n[run]', 15, "is not written in the case; give its value there first"),
    ("[run]", '[sensitivities]\nchain.bead.diameter = "0.02 mm"\n[run]', 15, 'sensitivities.chain: a table must be a standard uncertainty after a path in quotes, as "structure.thickness"'),
    ("[run]", '[sensitivities]\n"run.until" = "1 %"\n[run]', 15, '"run.until" cannot be varied'),
    ("[run]", '[sweep]\n"chain.impact_speed" = [0.2, 0.3]\n[sensitivities]\n"chain.impact_speed" = "1 %"\n[run]', 16, "is for a single run; leave out [sweep]"),
]  # fmt: skip

WRONG_PLATES = [
    ('"aluminium 6061"', '{ plies = [], thickness = "2 mm" }', 11, "structure.material.thickness: is not an entry here; must be one of plies, surface"),
    ('"aluminium 6061"', '{ plies = [{ material = "PTFE", thickness = "1 kg" }] }', 11, 'structure.material.plies[0].thickness: "1 kg": "kg" is not a unit'),
    ('"aluminium 6061"', '{ plies = [{ material = "PTFE", thickness = "1 mm" }], surface = "PTFF" }', 11, 'structure.material.surface: "PTFF" is not a material; did you mean PTFE?'),
    ('left = "clamped"', 'left = "glued"', 12, 'structure.supports.left: "glued" is not possible; must be one of clamped, simple'),
    ('at = ["60 mm", "100 mm"]', 'at = ["60 mm", "400 mm"]', 13, 'structure.at[1]: "400 mm" must lie on the plate, between 0 and 200 mm'),
    ('at = ["60 mm", "100 mm"]', 'at = ["60 mm"]', 13, "structure.at: ['60 mm'] has 1 entry; must have 2"),
    ('at = ["60 mm", "100 mm"]', 'at = "middle"', 13, 'structure.at: "middle" must be the point that is struck, such as'),
    ('at = ["60 mm", "100 mm"]', "", 6, "structure.at: is missing; give the point that is struck"),
    ('thickness = "2 mm"', 'thickness = "2 mm"\nadditions = [{ kind = "point_mass", at = [9, 9], mass = "1 g" }]', 11, "structure.additions: PointMass(x=9.0, y=9.0, mass=0.001) must lie on the plate"),
    ('thickness = "2 mm"', 'thickness = "2 mm"\ncells = [10, 0]', 11, "structure.cells[1]: 0 must be at least 1"),
    ('["2 mm", "3 mm"]', "[2, 3]", 19, "3.0 must not exceed the shorter side, 0.2 m; did you mean \"3 mm\"?"),
    ('thickness = "2 mm"', 'thickness = "2 mm"\nedge = "free"', 11, "structure.edge: is not an entry here; did you mean supports?"),
    ('kind = "kirchhoff_plate"', 'kind = "plate"', 7, '"plate" is not a kind; did you mean'),
    # Sweeps.
    ('"structure.thickness" = ["2 mm", "3 mm"]', '"structure.thicknes" = ["2 mm", "3 mm"]', 19, "sweep.\"structure.thicknes\": is not an entry here; did you mean thickness?"),
    ('["2 mm", "3 mm"]', '["2 mm", "3 mn"]', 19, 'sweep."structure.thickness"[1]: "3 mn": "mn" is not a unit'),
    ('["2 mm", "3 mm"]', '["2 mm", "2 mm"]', 19, 'sweep."structure.thickness"[1]: "2 mm" is given twice'),
    ('["2 mm", "3 mm"]', "[]", 19, 'sweep."structure.thickness": [] has 0 entries; must have at least 1'),
    ('["2 mm", "3 mm"]', '"2 mm"', 19, 'sweep."structure.thickness": "2 mm" must be a list of values'),
    ('"structure.thickness" =', '"run.until" =', 19, 'sweep."run.until": "run.until" cannot be varied'),
    ('"structure.thickness" =', '"structure.layers[0].length" =', 19, "sweep"),
    (', step = "20 mm" }', " }", 20, 'sweep."structure.at[0]": needs a step, such as step = "10 mm", or else a count'),
    ('step = "20 mm" }', 'step = "-20 mm" }', 20, 'sweep."structure.at[0]".step: "-20 mm" must be a positive number of m'),
    ('step = "20 mm" }', 'step = "1 nm" }', 20, 'step: "1 nm" makes 40000001 values, more than 100000'),
    ('to = "60 mm"', 'to = "10 mm"', 20, 'sweep."structure.at[0]".to: "10 mm" must be above the first value'),
    ('from = "20 mm", ', "", 20, 'sweep."structure.at[0]".from: is missing; give the first value'),
    ('until = "0.5 ms"', 'until = "0.5 ms"\nsave_every = 1e-6', 17, "run.save_every: is chosen by a sweep; leave it out"),
    ('along = "structure.at[0]"', 'along = "structure.at[1]"', 24, 'measure.critical_distance.along: "structure.at[1]" is not an axis of [sweep]; take one of them: structure.thickness'),
    ('along = "structure.at[0]", ', "", 24, "measure.critical_distance.along: is missing; give the path of an axis"),
    ('step = "20 mm"', 'step = "40 mm"', 24, "has too few distances in [sweep]; give 3 or more"),
]  # fmt: skip

WRONG_QUESTIONS = [
    ("7 = 1", "seven = 1", 27, 'identify.sensors.seven: "seven" is not a bead from 1 to 20; write { 7 = 1 }'),
    ("{ 7 = 1, 13 = 2 }", "{}", 27, "identify.sensors: a table has 0 entries; must have at least 1; give a table of beads and columns, such as { 7 = 1 }"),
    ('"25 N/V"', '"25 V/N"', 28, 'identify.calibration: "25 V/N": "V/N" is not a unit of this quantity'),
    ("13 = 2", "13 = 1", 27, "identify.sensors: two of them read the same column; give each its own"),
    ("13 = 2", "13 = 5", 27, "identify.sensors: trace.csv has no column 5; its columns are 0 to 2"),
    ('calibration = "25 N/V"', "", 26, "identify.calibration: is missing; give a number of N/V for sensor 7, not zero, such as calibration = 25"),
    ('["1 mm", "6 mm"]', '["6 mm", "1 mm"]', 29, 'identify.unknowns."structure.thickness": must have two numbers, the lowest and the highest value; the order is wrong: give [\'1 mm\', \'6 mm\']'),
    ('["1 mm", "6 mm"]', '["1 mm"]', 29, 'identify.unknowns."structure.thickness": [\'1 mm\'] has 1 entry; must have 2; give a range, such as ["1 mm", "6 mm"]'),
    ('["1 mm", "6 mm"]', '["1 mm", "6 s"]', 29, 'identify.unknowns."structure.thickness"[1]: "6 s": "s" is not a unit of this quantity'),
    ('"structure.thickness" = ["1', '"structure.at" = ["1', 29, '"structure.at"[0]: "1 mm" must be the point that is struck'),
    ('"structure.thickness" = ["1', '"structure.layers[0].length" = ["1', 29, 'structure.layers is not a list, so it has no entry [0]'),
    ('"structure.thickness" = ["1 mm", "6 mm"]', '"structure.width" = ["1 mm", "2 mm"], "structure.length" = ["a", "b"]', 29, "must be a length"),
    ('"structure.thickness" = ["1 mm", "6 mm"]', '"structure.material" = ["PTFE", "nylon"]', 29, '"structure.material": material is not a number and cannot be fitted; run one fit for each value'),
    ('"gain"', '"gains"', 30, 'identify.nuisances[1]: "gains" is not a nuisance; take gain, offset, time_zero'),
    ('"gain"', '"chain.drop_height"', 30, '"chain.drop_height" has no value in the case; give it a range'),
    ("[identify]", "[identification]", 26, "identification: is not an entry here; did you mean identify?"),
]  # fmt: skip


@pytest.fixture
def complaint(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., str]:
    """The message of a command that fails in an empty folder. It prints nothing else, and writes nothing."""
    monkeypatch.chdir(tmp_path)

    def said(*arguments: str) -> str:
        before = sorted(os.listdir())
        code = ended(*arguments)
        out, err = capsys.readouterr()
        assert (code, out, err.count("\n")) == (2, "", 1), err
        assert len(err) < 500
        assert sorted(os.listdir()) == before
        return err.strip()

    return said


@pytest.mark.parametrize(
    ("base", "command", "good", "wrong", "line", "words"),
    [(ROD, "run", *one) for one in WRONG_RODS]
    + [(PLATE, "run", *one) for one in WRONG_PLATES]
    + [(PLATE, "identify", *one) for one in WRONG_QUESTIONS],
)
def test_a_wrong_case_is_one_line(
    complaint: Callable[..., str], base: str, command: str, good: str, wrong: str, line: int | None, words: str
) -> None:
    assert good in base
    Path("case.toml").write_text(base.replace(good, wrong, 1))
    Path("trace.csv").write_text(
        "time,volt\n" + "".join(f"{1e-6 * i},{0.1 * (i % 7)},{0.2 * (i % 5)}\n" for i in range(99))
    )
    said = complaint(command, "case.toml", *(["trace.csv"] if command == "identify" else ["--jobs", "1"]))
    assert said.startswith("case.toml:" if line is None else f"case.toml:{line}: "), said
    assert words in said


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("structure.layers[5].length=1", "structure.layers has 2 entries, counted from 0 as structure.layers[0]; there is no [5]"),
        ("structure[0]=1", "structure is not a list"),
        ("nonsense", 'has no "="'),
        ("=3", '"" is not the path of an entry'),
        ("chain.bead.diameter='9 mm", "a quote is not closed"),
        ("plate.until=1 ms", "plate.until: is not an entry; did you mean run.until?"),
        ("extends=x", "a change cannot extend another case"),
        ("run.until=1 parsec", 'run.until: "1 parsec": "parsec" is not a unit of this quantity'),
        ("chain.impact_speed=-3 m/s", 'chain.impact_speed: "-3 m/s" must be zero or a positive number of m/s'),
        ("run.until=1" + "0" * 5000, "has no unit; must be a time, such as 1.5 ms"),
        ("run.until=150 s", 'run.until: "150 s": takes 6.'),
        ("chain.bead.diameter=9.53e6", "4765000.0: half of it must lie between 1e-09 and 1e+06 m"),
        ("structure.layers[0].radius=1e9", "structure.layers[0].radius: "),
        ("chain.bead.contact_angle=9 deg", "chain.bead.contact_angle: is not an entry here"),
    ],
)  # fmt: skip
def test_a_wrong_change_is_one_line(complaint: Callable[..., str], change: str, words: str) -> None:
    Path("case.toml").write_text(ROD)
    said = complaint("run", "case.toml", "--set", change)
    assert said.startswith("--set "), said
    assert words in said
    assert said.count(words.split(":")[0]) == 1


UNQUOTED = [
    ("at = [10 mm, 20 mm]", '10 mm is not a value of TOML; write "10 mm" in quotes'),
    ('layers = [{ material = "PTFE", length = 9.5 mm }]', '9.5 mm is not a value of TOML; write "9.5 mm" in quotes'),
    ("material = steel 440C", 'steel 440C is not a value of TOML; write "steel 440C" in quotes'),
    ("adaptive = True", "True is not a value of TOML; write true"),
    ("radius = 4,76e-3", "4,76e-3 is not a number; write 4.76e-3"),
    ('a = "300 mm" 2', "Expected newline or end of document after a statement; this is not valid TOML"),
    ("a = 3 # first\na = 4", "a is given twice; keep one of them"),
    ("[run]\n[run]", "[run] is given twice; keep one of them"),
    ("[chain]\n[chain]", "[chain] is given twice; keep one of them, or write [[chain]] above each"),
    ("a = 1" + "0" * 5000, "Exceeds the limit"),
    ('mesh = "C:\\dir\\me.msh"', 'a backslash begins an escape in "..."; write / in paths, or single quotes'),
    ("a = “2 mm”", '“ is not a quotation mark of TOML; write "'),
    ("a = [1, 2\n[run]", "a list or table that begins here is not closed"),
]


@pytest.mark.parametrize(("line", "words"), UNQUOTED)
def test_a_value_without_quotes_is_shown_with_them(complaint: Callable[..., str], line: str, words: str) -> None:
    Path("case.toml").write_text(f"# a case\n{line}\n")
    said = complaint("check", "case.toml")
    last = 2 + (line.count("\n") if "twice" in words else 0)
    assert said.startswith((f"case.toml:{last}: " if "Exceeds" not in words else "case.toml: ") + words)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("none.toml", "there is no such file"),
        ("folder", "cannot be read (Is a directory)"),
        ("binary.toml", "binary.toml:1: is not text in UTF-8; if it is a case file, save it as UTF-8"),
        ("tap.csv", "this is not valid TOML; is this a case? The case file comes first"),
        ("inside.toml", 'extends: "folder" is a folder'),
        ("/dev/zero", "has more than 1e+06 bytes"),
    ],
)
def test_a_file_that_cannot_be_read_is_one_line(complaint: Callable[..., str], name: str, words: str) -> None:
    Path("folder").mkdir()
    Path("binary.toml").write_bytes(b"\xff\xfe\x00case")
    Path("tap.csv").write_text("0,1\n")
    Path("inside.toml").write_text('extends = "folder"')
    for command in ("run", "check"):
        said = complaint(command, name)
        assert said.startswith(f"{name}:")
        assert words in said


def samples(count: int, step: str = "e-6", begins: int = 0) -> str:
    """A file with a wave of 40 samples after 60 quiet ones, in columns 1 and 2."""
    pulse = [max(0.0, 1.0 - abs(i - 80) / 20.0) for i in range(begins, count)]
    return "time\n" + "".join(f"{i}{step},{one:.3f},{one:.3f}\n" for i, one in enumerate(pulse))


SIGNALS = [
    (None, "trace.csv: there is no such file"),
    ("hello\nworld\n", "trace.csv: holds 2 lines and no number, must hold 16 samples or more"),
    ("a,b,c\n" * 40, "trace.csv: must hold a line for each sample, with numbers in columns 1, 2, counted from 0; a"),
    (samples(900, begins=70), "trace.csv: sensor 3, baseline = 'lead': has no quiet lead to take the baseline from, "),
    (samples(900, ""), "trace.csv: the times count the samples, or their unit is missing; give time_unit="),
    (
        samples(900, "").replace("time", "time (s),a,b"),
        "trace.csv: has a sample every 1 s, too coarse for contacts of ",
    ),
]
"""Contents of a file, and how the message begins."""


@pytest.mark.parametrize(("content", "words"), SIGNALS)
def test_a_wrong_signal_is_one_line(complaint: Callable[..., str], content: str | None, words: str) -> None:
    """It names the file, what was found and what would be right."""
    asked = """
        [identify]
        sensors = { 3 = 1, 6 = 2 }
        calibration = 1
        unknowns = { "structure.layers[1].length" = ["15 mm", "30 mm"] }
    """
    Path("case.toml").write_text(ROD + asked.replace("        ", ""))
    if content is not None:
        Path("trace.csv").write_text(content)
    said = complaint("identify", "case.toml", "trace.csv")
    assert said.startswith(f"hertzlink: {words}"), said
    Path("points.csv").write_text("x / mm, y / mm, file\n0, 0, trace.csv\n")
    assert "trace.csv" in complaint("map", "case.toml", "points.csv", "--jobs", "1") or "too coarse" in said
    assert ("are its times in µs? Then give time_unit = 'us'" in said) == ("too coarse" in said)


def test_faults_of_the_file_below_are_named_there(complaint: Callable[..., str]) -> None:
    Path("base.toml").write_text(ROD.replace('"PTFE"', '"PFTE"'))
    Path("case.toml").write_text('extends = "base.toml"\n[chain]\nbeads = 9\n')
    assert complaint("run", "case.toml").startswith("base.toml:11: structure.layers[1].material: ")
    Path("base.toml").write_text(ROD)
    Path("case.toml").write_text('extends = "base.toml"\n\n[chain]\nbeads = -9\n')
    assert complaint("run", "case.toml").startswith("case.toml:4: chain.beads: -9 ")
    Path("case.toml").write_text('extends = "base.toml"\n[structure]\nkind = "wall"\n')
    assert complaint("run", "case.toml") == (
        'case.toml:2: structure.material: is missing; give a material, such as "aluminium 6061"'
    )


def test_a_case_leaves_out_what_the_file_below_has(complaint: Callable[..., str]) -> None:
    """Sections and entries of any depth, by their paths; what is not there is refused by its line."""
    Path("base.toml").write_text(
        ROD + '\n[measure]\nsensor = 3\ntraces = true\n[sweep]\n"chain.gravity" = [0.0, 9.81]\n'
    )
    Path("case.toml").write_text('extends = "base.toml"\nwithout = ["sweep", "measure.traces"]\n')
    case, _ = read("case.toml")
    assert case.data == tomllib.loads(ROD) | {"measure": {"sensor": 3}}
    for name in ("sweeps", "structure.layers[0]", "chain.beads.count", "measure.", 3):
        Path("case.toml").write_text(f'extends = "base.toml"\nwithout = ["sweep", {name!r}]\n')
        said = f'case.toml:2: without[1]: {name!r} is not an entry of "base.toml", such as "sweep"'
        assert complaint("check", "case.toml") == said
    Path("case.toml").write_text(f'without = ["sweep"]\n{ROD}')
    assert complaint("check", "case.toml").endswith(
        "without[0]: 'sweep' is not an entry of another case; give extends as well"
    )


def test_a_value_of_a_sweep_is_refused_where_it_stands(complaint: Callable[..., str]) -> None:
    """The value that is refused stands in [sweep], not at its path; save_every is refused by the plan of the run."""
    Path("case.toml").write_text(ROD + '\n[sweep]\n"structure.layers[0].length" = ["-20 mm", "30 mm"]\n')
    place = 'case.toml:18: sweep."structure.layers[0].length"[0]'
    assert complaint("check", "case.toml") == f'{place}: "-20 mm" must be a positive number of m'
    Path("case.toml").write_text(PLATE.replace('to = "60 mm"', 'to = "600 mm"'))
    place = 'case.toml:20: sweep."structure.at[0]"'
    for command in ("check", "run"):
        assert complaint(command, "case.toml") == f"{place}: 0.6 must lie on the plate, between 0 and 0.3 m"
    Path("case.toml").write_text(ROD.replace('"0.1 ms"', '"0.1 ms"\nsave_every = "3 ms"'))
    for command in ("run", "check"):
        said = complaint(command, "case.toml")
        assert said.startswith('case.toml:16: run.save_every: "3 ms" must not be longer than the run')


def test_new_writes_no_file_twice(complaint: Callable[..., str]) -> None:
    Path("rod.toml").write_text("mine")
    assert "exists already; give another PATH" in complaint("new", "rod")
    assert Path("rod.toml").read_text() == "mine"
    assert "did you mean rod?" in complaint("new", "rodd")
    words = "cannot be written in the folder /proc (No such file or directory); give another folder; nothing was"
    assert words in complaint("new", "rod", "/proc/place.toml")
    assert "the folder no/such does not exist; nothing was changed" in complaint("new", "rod", "no/such/place.toml")


BASE = """\
chain = { beads = 8, bead = { shape = "sphere", radius = 4.76e-3, material = "steel 440C" }, impact_speed = 0.3 }
structure = { kind = "solid", mesh = "m.vtu", material = "nylon", contact = [0.01, 0.01, 0.02], patch_radius = 8e-3 }
run = { until = 2e-4, reduce = false }
"""


def mesh_of(path: Path, points: int) -> None:
    """A cube of 20 mm, with so many points along an edge."""
    line = np.linspace(0.0, 0.02, points)
    to_meshio(skfem.MeshHex.init_tensor(line, line, line)).write(path)


@pytest.mark.parametrize(
    ("text", "changes", "here"),
    [
        ('extends = "base/b.toml"\n[structure]\nmesh = "m.vtu"\n', [], True),
        ('extends = "base/b.toml"\n', [], False),
        ('extends = "base/b.toml"\n', ["structure.mesh=m.vtu"], True),
        ('extends = "base/b.toml"\n[structure]\nmesh = "base/m.vtu"\n', [], False),
        ('extends = "base/b.toml"\n[sweep]\n"structure.mesh" = ["m.vtu", "base/m.vtu"]\n', [], True),
    ],
)
def test_a_file_is_sought_where_its_name_is_written(
    complaint: Callable[..., str], monkeypatch: pytest.MonkeyPatch, text: str, changes: list[str], here: bool
) -> None:
    """Next to the file that names it; after --set in the current folder. The result's case runs in any folder."""
    Path("base").mkdir()
    Path("base/b.toml").write_text(BASE)
    mesh_of(Path("base/m.vtu"), 5)
    mesh_of(Path("m.vtu"), 6)
    Path("mine.toml").write_text(text)
    case, _ = read("mine.toml", changes)
    first = task_of(case).first
    unknowns = first.simulation().interface.structures[0].structure.size
    assert unknowns == 3 * (11 if here else 9) ** 3
    Path("elsewhere").mkdir()
    monkeypatch.chdir("elsewhere")
    Path("case.toml").write_text(first.to_toml())
    assert read("case.toml")[0].simulation().interface.structures[0].structure.size == unknowns


def test_a_pipe_is_no_file_to_extend(complaint: Callable[..., str]) -> None:
    os.mkfifo("pipe")
    Path("case.toml").write_text('extends = "pipe"\n')
    assert 'there is no file "pipe"' in complaint("check", "case.toml")


def test_what_a_file_says_is_no_command_for_terminal_or_shell(
    complaint: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Neither the title of a case nor a name in a message is a command."""
    Path("case.toml").write_text(f'title = "a\\u001b[31mred"\n{ROD}')
    ended("run", "case.toml")
    assert capsys.readouterr().out.startswith("a\\x1b[31mred\n")
    assert Path("case/table.txt").read_text().startswith("a\\x1b[31mred\n")
    assert "\x1b" not in complaint("check", "\x1b[2Jcase.toml")


def test_a_case_whose_name_is_not_in_utf_8_runs(
    complaint: Callable[..., str], capsys: pytest.CaptureFixture[str]
) -> None:
    """A mesh of such a name is refused before any work: results could not hold it."""
    name = os.fsdecode(b"rod\xff.toml")
    Path(name).write_text(ROD)
    assert ended("run", name) == 0
    assert "rod\\udcff" in capsys.readouterr().out
    assert Path(os.fsdecode(b"rod\xff"), "report.html").is_file()
    Path(name).write_text(BASE)
    os.mkdir(b"folder\xff")
    Path(os.fsdecode(b"folder\xff"), "b.toml").write_text(BASE)
    Path(os.fsdecode(b"folder\xff"), "m.vtu").touch()
    assert "is not a name in UTF-8" in complaint("run", os.fsdecode(b"folder\xff/b.toml"))
