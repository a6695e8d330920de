"""Studies with a user's own parameters: what is read, what is refused, and results that are known from elsewhere."""

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from hertzlink.cli import main
from hertzlink.studies import (
    STUDIES,
    aspect_ratio,
    critical_distance,
    cylinders,
    dissipation,
    ellipsoids,
    hollow_spheres,
    identifiability,
    plate_boundary,
    rod_length,
    rod_stiffness,
    study,
    upper_layer,
)
from hertzlink.studies.conditions import DIFFERS, OWN, Conditions, WrongValue
from hertzlink.studies.table import Row, text

FIXED = {"contact-law", "deformable-chain", "yield"}
"""Studies that check a method in fixed cases."""


def hertzlink(*words: str) -> int:
    """The exit code of a command."""
    with pytest.raises(SystemExit) as end:
        main(words)
    return int(end.value.code or 0)


def values(rows: Sequence[Row]) -> dict[str, Row]:
    return {row.quantity: row for row in rows}


BAD: list[tuple[str, str]] = [
    ("rod-length --length -1", "--length -1: must be a positive number of m"),
    ("rod-length --length 0", "--length 0: must be a positive number of m"),
    ("rod-length --length nan", "--length nan: must be a finite number of m"),
    ("rod-length --length 1e-2,,five", "--length five: must be a number of m, as 0.001, 1e-3 or with its unit"),
    ("rod-length --length ,", "--length ,: give at least one value"),
    ("rod-length --material unobtainium", "--material unobtainium: no such material; "),
    ("rod-length --material brasss", "did you mean brass 360?"),
    ("rod-length --material steel", "--material steel: there are steel 316 and steel 440C; give the whole name"),
    ("rod-length --material ''", "no such material"),
    ("rod-length --impact-speed 1 --drop-height 2", "--impact-speed 1: give it or the drop height, not both"),
    ("rod-length --bead 9.52", "--bead 9.52: must lie between 0.0001 and 0.5 m"),
    ("rod-length --dashpot -5", "--dashpot -5: must be a positive number of N s/m"),
    ("rod-length --length 10 --radius 5 --bead 1e-4", "bead = 0.0001: makes too fine a mesh"),
    ("rod-stiffness --thickness 1e-3", "no such option --thickness; parameters: --bead,"),
    ("rod-stiffness --modulus 200", "--modulus 200: must lie between 100000 and 1e+13 Pa"),
    ("rod-stiffness --material brass,golden", "golden"),
    ("plate-boundary --thickness 0.5", "--thickness 0.5: must lie between 1e-05 and 0.1 m"),
    ("plate-boundary --support glued", "--support glued: must be one of 'clamped', 'simple', 'free'"),
    ("plate-boundary --sensor 20", "--sensor 20: must be less than the number of beads, 20"),
    ("plate-boundary --sensor 7.5", "--sensor 7.5: must be a whole number"),
    ("plate-boundary --side 0.01", "--side 0.01: must be 0.229 m or more"),
    ("plate-boundary --thickness 2e-5", "--thickness 2e-05: needs a mesh of"),
    ("plate-boundary --bead 1e-3,2e-3,3e-3,4e-3,5e-3,6e-3,7e-3", "give at most 6 values"),
    ("plate-boundary --impact-speed 0", "--impact-speed 0: must be a positive number of m/s"),
    ("ellipsoids --major 4e-3", "--major 0.004: must be more than the minor diameter, 0.00472 m"),
    ("hollow-spheres --ratio 0.99", "--ratio 0.99: must lie between 0 and 0.95"),
    ("cylinders --angle 91", "--angle 91: must lie between 0 and 90 degrees"),
    ("cylinders --angle 0,10,20,30,40,50,60", "give at most 6 values"),
    ("dissipation --beads 5", "--beads 5: must be a whole number, 20 or more"),
    ("critical-distance --inelasticity 3", "--inelasticity 3: must lie between 0.05 and 2"),
    ("critical-distance --material PTFE --bead-material steel440C", "--material PTFE: with these beads:"),
    ("critical-distance --edge loose", "--edge loose: must be one of 'clamped', 'simple', 'free'"),
    ("identifiability --noise 0", "--noise 0: must be a positive number"),
    ("identifiability --distance '2 kg'", "is no unit"),
    ("rod-length --length '3 kg'", '--length 3 kg: "kg" is no unit of this quantity; must be a number of m'),
    ("contact-law --bead 1e-3", "contact-law: no such option --bead; parameters: none"),
]


@pytest.mark.parametrize(("words", "message"), BAD)
def test_bad_input_is_one_line_before_any_run(
    words: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(hl.CoSimulation, "run", lambda *_, **__: pytest.fail("a run was started"))
    assert hertzlink("study", *shlex.split(words)) == 2
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
    assert " ".join(STUDIES[name].about.split()[:5]) in said
    options = getattr(study(name), "Conditions", Conditions).options()
    assert (not options) == ("nothing of it can be changed" in said)
    assert FIXED.isdisjoint({name}) or not options
    assert options.keys().isdisjoint({"quick", "output", "force", "jobs", "form", "figures"})
    for one, option in options.items():
        assert f"--{one.replace('_', '-')} " in said
        assert option.says in said


def test_help_of_all_studies_loads_none(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("hertzlink.commands.study_command.study", lambda name: pytest.fail(f"{name} was loaded"))
    assert hertzlink("study", "--help") == 0
    said = capsys.readouterr().out
    assert all(name in said for name in STUDIES)


def test_values_are_read_from_texts_numbers_and_lists() -> None:
    read = rod_length.Conditions.of
    assert read({"length": "0.2,0.1"}).length == read({"length": ("0.1", "0.2")}).length == (0.1, 0.2)
    assert read({"length": np.array([0.2, 0.1])}).length == read({"length": [0.1, "2e-1"]}).length == (0.1, 0.2)
    assert read({"length": "10 cm, 0.2", "bead": "6mm"}) == read({"length": (0.1, 0.2), "bead": 6e-3})
    for name in ("brass", "BRASS 360", hl.BRASS_360):
        assert read({"material": name}).material == hl.BRASS_360
    assert read({"material": "Aluminum"}).material == hl.ALUMINIUM_6061
    with pytest.raises(WrongValue, match=r"lenght = 1: no parameter of this study; did you mean length\?"):
        read({"lenght": 1})
    with pytest.raises(WrongValue, match="must be a finite number of m"):
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
    assert data.attrs[DIFFERS].startswith("own parameters: ")
    assert "length 100 mm (thesis: 41 values from 6.35 to 609.6 mm)" in data.attrs[DIFFERS]
    assert "E 70 GPa" in data.attrs[DIFFERS]


def test_a_long_rod_is_a_dashpot() -> None:
    """Without its echo a rod is the dashpot ρ c A: AR is that of a short rod whose far end lets waves leave."""
    own: dict[str, Any] = {"material": "brass", "length": 0.4, "bead": 6e-3, "dashpot": 2.0, "impact_speed": 0.3}
    of = rod_length.Conditions.of(own)
    data = rod_length.run(True, 1, **own)
    absorbing = hl.rod([hl.Layer(hl.BRASS_360, 0.1, of.radius)], base="absorbing")
    run = hl.CoSimulation(of.chain(2.0), absorbing).run(until=0.7e-3)
    (found,) = data.amplitude_ratio.sel(wave="primary").values.ravel()
    assert found == pytest.approx(hl.amplitude_ratio(run, 7).item(), rel=2e-3)
    rows = values(rod_length.table(data))
    assert rows["AR, rod of 400 mm"].computed == pytest.approx(found)
    assert all(row.thesis == "" for row in rows.values())
    table = text(list(rows.values()), column="")
    assert "thesis" not in table.splitlines()[0]
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


def test_layers_of_other_materials() -> None:
    """Without losses a bead leaves a thin layer on a soft one as it leaves a free mass, e = (M − m)/(M + m)."""
    own = {"lower_material": "PTFE", "upper": 12e-3, "lower": 0.05, "dashpot": 0.01, "bead": 5e-3, "impact_speed": 0.1}
    data = upper_layer.run(True, 1, upper_material="aluminium", **own)
    rows = values(upper_layer.table(data))
    ratio = rows["AR, upper layer 12 mm"]
    sphere, layer = np.pi / 6.0 * 5e-3**3 * 7800.0, np.pi * 9.525e-3**2 * 12e-3 * 2693.0
    restitution = (layer - sphere) / (layer + sphere)
    assert ratio.theory == pytest.approx(restitution**1.2, rel=1e-6)
    assert ratio.computed == pytest.approx(ratio.theory, abs=0.05)
    assert "steel" not in upper_layer.figures(data)["amplitude_ratio"].axes[0].get_xlabel()


def on_plate(scale: float) -> dict[str, Any]:
    """A thin brass plate and small beads, all lengths times the scale."""
    return {"material": "brass", "thickness": scale * 1e-3, "bead": scale * 2.38e-3, "side": scale * 0.06}


@pytest.fixture(scope="module")
def brass() -> xr.Dataset:
    return plate_boundary.run(True, 1, **on_plate(1.0))


def test_the_critical_distance_scales_with_all_lengths(brass: xr.Dataset) -> None:
    """At the same speed nothing but the unit of length and time changes: meshes, records and scans follow too.

    What is left is the error of the reductions, whose tolerance is 10 %.
    """
    twice = plate_boundary.run(True, 1, **on_plate(2.0))
    assert twice.amplitude_ratio.values == pytest.approx(brass.amplitude_ratio.values, rel=3e-3)
    assert twice.critical_distance.values == pytest.approx(2.0 * brass.critical_distance.values, rel=5e-3)


def test_the_critical_distance_is_that_of_the_law(brass: xr.Dataset) -> None:
    """The law was computed with an exact half-plane, this is a meshed plate."""
    of = plate_boundary.Conditions.read(brass)
    assert of.material == hl.BRASS_360
    bead, plate = of.sphere(of.bead[0]), of.plate(of.thickness[0])
    law = hl.critical_distance_law(bead, plate, of.impact_speed, "clamped", 0.02)
    low, high = brass.bracket.sel(within=0.02).values.ravel()
    assert low <= law.value <= high
    row = values(plate_boundary.table(brass))["critical distance, D 2.38, t 1.00"]
    assert row.theory == pytest.approx(1e3 * law.value)
    for name, figure in plate_boundary.figures(brass).items():
        figure.draw_without_rendering()
        where = figure.axes[0].get_xlabel()
        assert "clamped edge (mm)" in where or name == "critical_distance"


def test_far_from_edges_a_plate_is_the_infinite_one() -> None:
    """Lossless small beads on a thick plate: AR of the plate, of the infinite plate, and Zener's."""
    own = {"material": "steel 440C", "thickness": 6e-3, "bead": 5e-3, "bead_material": "steel 440C", "side": 0.3}
    data = aspect_ratio.run(True, 1, **own)
    plate, infinite, space = data.amplitude_ratio.squeeze().values
    assert plate == pytest.approx(infinite, rel=2e-3)
    assert 0.9 < infinite < space < 1.01
    rows = values(aspect_ratio.table(data))
    assert rows["AR, D/t 0.83"].theory == pytest.approx(infinite, abs=0.03)
    assert all(row.thesis == "" for row in rows.values())
    assert set(aspect_ratio.figures(data)) == {"amplitude_ratio", "time_of_flight", "forces"}


def test_a_wave_follows_its_contact_law() -> None:
    """Speed over force as (n − 1)/(2n), and the speed of long waves within 1.5 %: ellipsoids, shells, crossed rods."""
    shapes = ellipsoids.run(True, 1, material="brass", minor=5e-3, major=8e-3, peak_force="10,40")
    walls = hollow_spheres.run(True, 1, material="steel 316", radius=5e-3, ratio="0.7", peak_force="10,20")
    crossed = cylinders.run(True, 1, material="aluminium", radius=2e-3, angle="45", impact_speed="0.2,0.5")
    for module, data, exponent in (
        (ellipsoids, shapes, 1 / 6),
        (hollow_spheres, walls, 0.15),
        (cylinders, crossed, 1 / 6),
    ):
        for label in data.curve.values:
            rows = values(module.table(data))
            slope = rows[f"exponent of speed over force, {label}"]
            assert slope.computed == pytest.approx(slope.theory, rel=0.01)
            assert slope.theory == pytest.approx(exponent, abs=0.01)
            speeds = [row for name, row in rows.items() if name.startswith(f"wave speed, {label}")]
            assert len(speeds) == 2
            assert all(row.computed == pytest.approx(row.theory, rel=0.015) for row in speeds)
        assert set(module.figures(data)) == {"speed_force", "laws"}


def test_losses_of_other_beads() -> None:
    """A solitary wave without losses keeps its form; losses that are hardly there take hardly anything."""
    data = dissipation.run(True, 1, material="brass", bead=6e-3, beads=30, impact_speed=1.0, coefficient=1e-6)
    rows = values(dissipation.table(data))
    assert rows["speed of the undamped wave"].computed == pytest.approx(
        rows["speed of the undamped wave"].theory, rel=0.015
    )
    kept = [row.computed for name, row in rows.items() if name.startswith("F(23)/F(9)")]
    assert kept == pytest.approx([1.0] * 3, abs=1e-3)
    more = dissipation.run(True, 1, material="brass", bead=6e-3, beads=30, impact_speed=1.0, coefficient=5.0)
    left = more.peak.sel(sensor=23) / more.peak.sel(sensor=9)
    assert float(left.sel(law="thesis")) < float(left.sel(law="pairwise")) < 0.95
    assert set(dissipation.figures(data)) == {"decay"}


def test_another_pair_lies_on_the_law() -> None:
    """Between the stiffness ratios of the law's table: small beads on copper, within the law's own bounds."""
    own = {"material": "copper", "bead": "3 mm", "inelasticity": 0.3, "edge": "clamped"}
    data = critical_distance.run(True, 1, **own)
    row = values(critical_distance.table(data))["c, clamped edge, λ 0.3, AR ± 0.02"]
    law = hl.critical_distance_law(
        hl.Sphere(1.5e-3, hl.STEEL_440C), critical_distance.Conditions.read(data).pair.plate(0.3), 0.31
    )
    length = critical_distance.Conditions.read(data).pair.length(0.3)
    assert row.theory == pytest.approx(law.value / length)
    assert law.low - 0.01 * length <= row.computed * length <= law.high + 0.01 * length
    assert set(critical_distance.figures(data)) == {"collapse"}


@pytest.mark.thorough
def test_half_widths_grow_with_the_noise() -> None:
    """In proportion, and where nothing else differs they are those of the study."""
    own = {"thickness": 4.83e-3, "bead": 9.53e-3, "distance": 0.06, "record": "1.4e-3"}
    one, two = (identifiability.run(True, 1, noise=noise, **own).edge_error for noise in (0.01, 0.02))
    at = {"unknown": "distance", "free": "all", "measured": "bead 7"}
    assert float(two.sel(at).squeeze()) == pytest.approx(2.0 * float(one.sel(at).squeeze()), rel=1e-6)
    known = identifiability.cases.edge_errors(9.53e-3, 0.06, 4.83e-3).half_width.isel(step=0, record=0)
    assert float(one.sel(at).squeeze()) == pytest.approx(float(known.sel(at)), rel=1e-3)


@pytest.mark.parametrize("name", STUDIES)
def test_the_page_of_studies_lists_what_can_be_changed(name: str) -> None:
    page = (Path(__file__).parents[2] / "docs" / "studies.md").read_text("utf-8")
    (line,) = [line for line in page.splitlines() if line.startswith(f"| `{name}` |")]
    options = getattr(study(name), "Conditions", Conditions).options()
    assert STUDIES[name].about.rstrip(".") in line
    listed = [part.split("`")[1].replace("-", "_") for part in line.split("|")[3].split(",") if "`" in part]
    assert listed == list(options)
