"""Cases of several chains and structures: the numbers of the same Python, and faults that are named."""

import csv
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import hertzlink as hl
from hertzlink.cases.case import Case

UNTIL = 1.5e-4
BEAD = hl.Sphere(2.38e-3, hl.STEEL_440C)
EDGES = hl.Supports("clamped", "clamped", "clamped", "clamped")
PLATE = hl.kirchhoff_plate(0.06, 0.05, 2e-3, hl.BRASS_360, EDGES, cells=(6, 5))

TWO = """
run.until = 1.5e-4
chain = [
    { beads = 4, bead = { shape = "sphere", radius = 2.38e-3, material = "steel 440C" }, impact_speed = 0.3 },
    { beads = 4, bead = { shape = "sphere", radius = 2.38e-3, material = "steel 440C" }, impact_speed = 0.2 },
]

[structure]
kind = "kirchhoff_plate"
length = 0.06
width = 0.05
thickness = 2e-3
material = "brass 360"
supports = { left = "clamped", right = "clamped", bottom = "clamped", top = "clamped" }
at = [[0.02, 0.02], [0.04, 0.02]]
cells = [6, 5]
"""


def test_several_chains_are_those_of_python() -> None:
    """Without seats, chains take the contact points in their order."""
    second = hl.Chain([BEAD] * 4, BEAD, 0.2)
    first = hl.Chain([BEAD] * 4, BEAD, 0.3)
    expected = hl.CoSimulation([first, second], PLATE.at([0.02, 0.04], [0.02, 0.02])).run(until=UNTIL)
    assert Case(tomllib.loads(TWO) | {"run": {"until": UNTIL, "reduce": False}}).run().equals(expected)


@pytest.mark.thorough
def test_a_law_by_finite_elements_is_that_of_python() -> None:
    case = tomllib.loads(TWO)
    case["chain"] = {**case["chain"][0], "law": {"kind": "numerical", "max_force": 60.0}}
    case["structure"] = {"kind": "nothing"}
    own = hl.laws.computed_law(BEAD, BEAD, max_force=60.0)
    expected = hl.CoSimulation(hl.Chain([BEAD] * 4, BEAD, 0.3, law=own), None).run(until=UNTIL)
    assert Case(case).run().equals(expected)


WRONG: list[tuple[str, Any, str]] = [
    (
        "chain[0].on",
        {"point": 2},
        r"chain\[0\]\.on: there is no contact point 2 of structure 0; take one of { structure = 0, point = 0 }",
    ),
    ("chain[0].on", {"structure": 1}, r"chain\[0\]\.on: there is no contact point 0 of structure 1"),
    ("chain[1].on", {"point": 0}, r"chain\[1\]\.on: is the contact point of another chain"),
    ("chain[1].behind", {"point": 0}, r"chain\[1\]\.behind: is the contact point of another chain"),
    ("chain[0].damping", {"kind": "modal", "ratio": 0.1}, r"chain\[0\]\.damping: acts inside beads that deform"),
    ("structure.damping", [{"kind": "loss_factor", "factor": 5.0}], r"damping\[0\]\.factor: 5\.0 must lie between 0"),
    ("structure.damping", [{"kind": "modal", "ratio": [0.1, -0.1]}], r"damping\[0\]\.ratio: \[0\.1, -0\.1\] must be a"),
    ("structure.damping", [{"kind": "modal", "ratio": "a lot"}], r'damping\[0\]\.ratio: "a lot" must be a number'),
    ("structure.damping", [{"kind": "rayleigh", "layer": 0}], r"damping\[0\]\.layer: is not an entry here"),
    ("run.reduce", {"tolerance": -1.0}, r"run\.reduce\.tolerance: -1\.0 must be a positive number"),
    ("structure", {"kind": "nothing", "damping": []}, r"structure\.damping: is not an entry here"),
    ("chain[1].modes", 99, r"chain\[1\]\.modes: 99 must be at most 20"),
    ("structure.at", [[0.02, 0.02]], r"chain\[1\]\.on\.point: 1 is no contact point of 1|structure"),
    ("structure.face", ["front"], r"structure\.face"),
    ("structure.face", ["up", "down"], r'structure\.face\[0\]: "up" is not possible'),
    ("structure.material", {"plies": []}, r"structure\.material\.plies: \[\] has 0 entries"),
    ("structure.thickness", None, r"structure\.thickness: is missing; must be a positive number of m, unless mat"),
    (
        "structure.material",
        {"plies": [{"material": "PTFE", "thickness": 1e-3}]},
        r"structure\.thickness: 0\.002 must be None or that of the laminate, 0\.001 m",
    ),
    ("chain[0].behind", {"structure": 1}, r"chain\[0\]\.behind: there is no contact point 0 of structure 1"),
    ("measure", {"chain": 2}, r"measure\.chain: 2 is not a chain of 2"),
    ("chain", 3, r"chain: 3 must be a section: \[chain\]"),
    ("chain", [], r"chain: \[\] has 0 entries"),
    ("structure", [], r"structure: \[\] has 0 entries"),
    ("chain[0].law", {"kind": "numerical", "max_force": -1.0}, r"chain\[0\]\.law\.max_force"),
    ("materials.sheet", {"youngs_modulus_along": 1e11}, r"materials\.sheet\.youngs_modulus_across: is missing"),
]


@pytest.mark.parametrize(("path", "value", "words"), WRONG)
def test_what_is_wrong_with_several_is_named(path: str, value: Any, words: str) -> None:
    from hertzlink.cases.tasks import task_of

    with pytest.raises(ValueError, match=words):
        task_of(Case(tomllib.loads(TWO)).changed({path: value})).case.simulation()


def test_what_takes_one_chain_says_so() -> None:
    from hertzlink.cases.identification import question_of
    from hertzlink.cases.tasks import task_of

    axis = {"sweep": {"structure.at[0][0]": [0.01, 0.015, 0.02]}}
    swept = Case(tomllib.loads(TWO) | axis | {"measure": {"sensor": 2}})
    assert task_of(swept).kind == "sweep"
    critical = {"measure": {"sensor": 2, "critical_distance": {"along": "structure.at[0][0]"}}}
    with pytest.raises(ValueError, match="chain: has 2 sections; a critical distance takes one"):
        task_of(Case({**swept.data, **critical}))
    identify = {"identify": {"sensors": {"2": 1}, "unknowns": {"chain[0].impact_speed": [0.1, 0.5]}}}
    with pytest.raises(ValueError, match="chain: has 2 sections; an identification takes one"):
        question_of(Case({**swept.data, **identify}))


def test_an_orthotropic_material_is_for_plies_alone() -> None:
    data = tomllib.loads(TWO)
    sheet = {"youngs_modulus_along": 135e9, "youngs_modulus_across": 9e9, "poisson_ratio": 0.3, "shear_modulus": 5e9}
    sheet |= {"shear_modulus_along": 5e9, "shear_modulus_across": 3.2e9, "density": 1560.0}
    data["materials"] = {"carbon": sheet}
    data["structure"]["material"] = "carbon"
    with pytest.raises(ValueError, match=r'structure\.material: "carbon" is orthotropic'):
        Case(data).simulation()
    del data["structure"]["thickness"]
    data["structure"]["material"] = {"plies": [{"material": "carbn", "thickness": 1e-3}]}
    with pytest.raises(ValueError, match=r'structure\.material\.plies\[0\]\.material: "carbn" .*did you mean carbon\?'):
        Case(data).simulation()
    data["structure"]["material"] = {"plies": [{"material": "carbon", "thickness": 1e-3}]}
    carbon = hl.OrthotropicMaterial(**sheet, name="carbon")
    body = Case(data).simulation().structure.structure
    assert body.origin["material"]["plies"][0]["material"]["name"] == carbon.name


LONGER = TWO.replace("beads = 4", "beads = 12").replace("until = 1.5e-4", "until = 4e-4") + "[measure]\nsensor = 6\n"


def test_a_run_of_several_chains_shows_the_waves_of_each(command: Callable[..., str], tmp_path: Path) -> None:
    """At 0.3 and 0.2 m/s: forces go with the power 6/5 of the speed."""
    (tmp_path / "case.toml").write_text(LONGER)
    said = command("run", "case.toml")
    assert "chain  bead" in said
    with (tmp_path / "case" / "waves.csv").open() as file:
        peaks = {row["chain"]: float(row["force (N)"]) for row in csv.DictReader(file) if row["wave"] == "incident"}
    assert peaks["0"] / peaks["1"] == pytest.approx(1.5**1.2, rel=1e-3)
    with (tmp_path / "case" / "traces.csv").open() as file:
        heads, *rows = list(csv.reader(file))
    assert heads[1:] == ["force at bead 6 of chain 0 (N)", "force at bead 6 of chain 1 (N)"]
    greatest = [max(float(row[i]) for row in rows) for i in (1, 2)]
    assert greatest[0] / greatest[1] == pytest.approx(1.5**1.2, rel=5e-3)


def test_a_sweep_reads_the_chain_that_is_named(command: Callable[..., str], tmp_path: Path) -> None:
    """The wave of chain 1 comes back later, because it is slower, by the power 1/5 of the speed."""
    (tmp_path / "case.toml").write_text(LONGER)
    axis = 'sweep={"structure.thickness"=[3e-3]}'
    flights = []
    for chain in (0, 1):
        command("run", "case.toml", "--set", axis, "--set", f"measure.chain={chain}", "--output", f"of{chain}")
        with (tmp_path / f"of{chain}" / "points.csv").open() as file:
            flights.append([float(row["time of flight (s)"]) for row in csv.DictReader(file)])
    assert all(1.05 < later / sooner < 1.12 for sooner, later in zip(*flights, strict=True))


def test_a_check_names_all_chains_and_structures(command: Callable[..., str], tmp_path: Path) -> None:
    (tmp_path / "rods.toml").write_text(
        TWO.split("[structure]")[0]
        + '[[structure]]\nkind = "half_space"\nmaterial = "PTFE"\n'
        + '[[structure]]\nkind = "rod"\nlayers = [{ material = "PTFE", length = 0.02, radius = 5e-3 }]\n'
    )
    said = command("check", "rods.toml")
    assert [line.split(":")[0] for line in said.splitlines() if "Chain(" in line] == ["chain 0", "chain 1"]
    assert "structure 0: half-space" in said
    assert "structure 1: rod" in said
    assert "sensors: bead 2 of chain 0" in said
