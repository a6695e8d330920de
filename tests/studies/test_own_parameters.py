"""Studies with a user's own parameters: what is read, what is refused, and results that are known from elsewhere."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from hertzlink.cli import main
from hertzlink.studies import ABOUT, STUDIES, rod_length, rod_stiffness, study
from hertzlink.studies.conditions import DIFFERS, OWN, Conditions, WrongValue
from hertzlink.studies.table import Row, text

FIXED = {"contact-law", "symmetry", "deformable-chain"}
"""Studies that check a method in fixed cases."""


def hertzlink(*words: str) -> int:
    """The exit code of a command."""
    with pytest.raises(SystemExit) as end:
        main(words)
    return int(end.value.code or 0)


def values(rows: Sequence[Row]) -> dict[str, Row]:
    return {row.quantity: row for row in rows}


BAD: list[tuple[str, str]] = [
    ("rod-length --length -1", "--length -1: must be from 0.0001 to 10 m"),
    ("rod-length --length 0", "--length 0: must be from 0.0001 to 10 m"),
    ("rod-length --length nan", "--length nan: must be from"),
    ("rod-length --length 1e-2,,five", "--length five: must be a number of m, as 0.001 or 1e-3"),
    ("rod-length --length ,", "--length ,: give at least one value"),
    ("rod-length --material unobtainium", "--material unobtainium: no such material; "),
    ("rod-length --material brasss", "did you mean brass 360?"),
    ("rod-length --material steel", "--material steel: there are steel 316 and steel 440C; give the whole name"),
    ("rod-length --material ''", "no such material"),
    ("rod-length --impact-speed 1 --drop-height 2", "--impact-speed 1: give it or the drop height, not both"),
    ("rod-length --bead 9.52", "--bead 9.52: must be from 0.0001 to 0.5 m"),
    ("rod-length --dashpot -5", "--dashpot -5: must be more than 0 and at most 1e+06 N s/m"),
    ("rod-stiffness --thickness 1e-3", "no such option --thickness; parameters: --bead,"),
    ("rod-stiffness --modulus 200", "--modulus 200: must be from 100000 to 1e+13 Pa"),
    ("rod-stiffness --material brass,golden", "golden"),
    ("symmetry --bead 1e-3", "symmetry: no such option --bead; parameters: none"),
]


@pytest.mark.parametrize(("words", "message"), BAD)
def test_bad_input_is_one_line_before_any_run(
    words: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(hl.CoSimulation, "run", lambda *_, **__: pytest.fail("a run was started"))
    assert hertzlink("study", *[word.replace("''", "") for word in words.split()]) == 2
    out, said = capsys.readouterr()
    assert message in said
    assert said.count("\n") == 1
    assert out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", STUDIES)
def test_help_lists_each_parameter_with_unit_and_default(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert hertzlink("study", name, "--help") == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "--quick" in said
    assert " ".join(ABOUT[name].split()[:5]) in said
    options = getattr(study(name), "Conditions", Conditions).options()
    assert (not options) == ("nothing of it can be changed" in said)
    assert FIXED.isdisjoint({name}) or not options
    for one, option in options.items():
        assert f"--{one.replace('_', '-')} " in said
        assert option.says in said


def test_help_of_all_studies_loads_none(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hertzlink.study_options.study", lambda name: pytest.fail(f"{name} was loaded"))
    assert hertzlink("study", "--help") == 0
    said = capsys.readouterr().out
    assert all(name in said for name in STUDIES)
    assert list(ABOUT) == list(STUDIES)


def test_values_are_read_from_texts_numbers_and_lists() -> None:
    read = rod_length.Conditions.of
    assert read({"length": "0.2,0.1"}).length == read({"length": ("0.1", "0.2")}).length == (0.1, 0.2)
    assert read({"length": np.array([0.2, 0.1])}).length == read({"length": [0.1, "2e-1"]}).length == (0.1, 0.2)
    for name in ("brass", "BRASS 360", hl.BRASS_360):
        assert read({"material": name}).material == hl.BRASS_360
    assert read({"material": "Aluminum"}).material == hl.ALUMINIUM_6061
    with pytest.raises(WrongValue, match=r"lenght = 1: no parameter of this study; did you mean length\?"):
        read({"lenght": 1})
    with pytest.raises(WrongValue, match="must be a number of m"):
        read({"length": object()})


def test_the_thesis_s_own_values_differ_in_nothing() -> None:
    given = rod_length.Conditions.of({"bead": "0.00952", "material": "steel 440C", "dashpot": "6,4,5"})
    assert not given.own
    assert given.remark() == ""
    assert given.until == 1.5e-3
    assert given.length == rod_length.LENGTHS


def test_results_say_what_differs_and_are_read_again() -> None:
    """Also for a material that no table holds."""
    glass = hl.Material(70e9, 0.22, 2500.0)
    given = rod_length.Conditions.of({"material": glass, "length": 0.1})
    data = given.marked(xr.Dataset())
    assert rod_length.Conditions.read(data) == given
    assert json.loads(data.attrs[OWN])["length"] == [0.1]
    assert "length 0.1 m (not 41 values from 0.00635 to 0.6096 m)" in data.attrs[DIFFERS]
    assert "E 70 GPa" in data.attrs[DIFFERS]


def test_a_long_rod_is_a_dashpot() -> None:
    """Without its echo a rod is the dashpot ρ c A: AR is that of a short rod whose far end lets waves leave."""
    own: dict[str, Any] = {"material": "brass", "length": 0.7, "bead": 6e-3, "dashpot": 2.0, "impact_speed": 0.3}
    of = rod_length.Conditions.of(own)
    data = rod_length.run(True, 1, **own)
    absorbing = hl.rod([hl.Layer(hl.BRASS_360, 0.1, of.radius)], base="absorbing")
    run = hl.CoSimulation(of.chain(2.0), absorbing).run(until=0.7e-3)
    (found,) = data.amplitude_ratio.sel(wave="primary").values.ravel()
    assert found == pytest.approx(hl.amplitude_ratio(run, 7).item(), rel=2e-3)
    rows = values(rod_length.table(data))
    assert rows["AR, rod of 700 mm"].computed == pytest.approx(found)
    assert all(row.thesis == "" for row in rows.values())
    table = text(list(rows.values()), thesis=False)
    assert "thesis" not in table
    assert "*" not in table
    assert set(rod_length.figures(data)) == {"length", "force_intensity"}


@pytest.mark.thorough
def test_times_scale_with_the_bead() -> None:
    """Hertz without gravity's preload: all lengths times s at the same speed give all times times s, γ times s²."""
    own = {"material": "brass", "modulus": 5e9, "radius": 0.02, "length": 0.05, "impact_speed": 15.0}
    first = rod_stiffness.run(True, 1, bead=8e-3, dashpot=4.0, **own)
    half = own | {"radius": 0.01, "length": 0.025}
    second = rod_stiffness.run(True, 1, bead=4e-3, dashpot=1.0, **half)
    one, other = (data.sel(wave="primary").squeeze() for data in (first, second))
    assert float(other.material_amplitude_ratio) == pytest.approx(float(one.material_amplitude_ratio), rel=5e-3)
    assert float(other.material_time_of_flight) == pytest.approx(0.5 * float(one.material_time_of_flight), rel=5e-3)
    rows = values(rod_stiffness.table(first))
    assert rows["TOF, brass 360"].theory == pytest.approx(rows["TOF, brass 360"].computed, rel=0.05)
    assert set(rod_stiffness.figures(first)) == {"stiffness", "force_intensity", "force_histories", "displacements"}
