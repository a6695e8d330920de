"""Reports: whole pages that load nothing, with words for every figure, escaped text, and named faults."""

import json
import stat
import warnings
from collections.abc import Callable
from dataclasses import asdict, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from page_parser import check_page

import hertzlink as hl
from coupling.inference.identification import Identification
from coupling.results.provenance import as_text, stored
from hertzlink.reports import setup_in_words
from hertzlink.reports.page import Line, Page, Section, Table, html

EVIL = "<script>alert('x')</script> & \"$\\frac$\" --> <!-- $_{"
"""A name that breaks pages which do not escape it, and figures that read it as a formula."""

STEEL = replace(hl.STEEL_440C, name=EVIL)
BEAD = hl.Sphere(4.76e-3, STEEL)


@cache
def run() -> xr.Dataset:
    rod = hl.rod([hl.Layer(STEEL, 6.35e-3, 9.5e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.5e-3)], elements=20)
    return hl.CoSimulation(hl.Chain([BEAD] * 14, BEAD, 0.3), rod).run(until=8e-4)


def build(modulus: float, speed: float) -> hl.CoSimulation:
    return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, speed), hl.half_space(hl.Material(modulus, 0.3, 2000.0)))


@cache
def signal() -> xr.Dataset:
    tap = build(3e9, 0.3).run(5e-4)
    noise = np.random.default_rng(1).normal(0.0, 0.2, (2, tap.time.size))
    return hl.as_signal(tap.time, {n: hl.sensor_force(tap, n).values + x for n, x in zip((4, 6), noise, strict=True)})


@cache
def found() -> Identification:
    guess = {"modulus": 3e9, "speed": 0.3}
    ranges = {"modulus": (1e9, 10e9), "speed": (0.2, 0.4)}
    return hl.identify(signal(), build, noise=0.2, nuisances=["gain"], guess=guess, **ranges)


@cache
def runs() -> xr.Dataset:
    return hl.sweep(build, until=4e-4, jobs=1, modulus=[1e8, 3e9, 2e11], speed=[0.1, 0.3])


def made(tmp_path: Path, result: Any, **given: Any) -> str:
    return hl.plots.report(result, tmp_path / "report.html", **given).read_text("utf-8")


def cells(page: Any) -> list[str]:
    return [" ".join(text.split()) for tag in ("td", "th") for text in page.text[tag]]


def test_report_of_a_run(tmp_path: Path) -> None:
    page = check_page(made(tmp_path, run(), title=EVIL, sensors=[6, 7], took=12.34))
    assert page.text["h1"] == [EVIL]
    waves = hl.reflections(run(), 7)
    shown = cells(page)
    assert f"{waves.primary.amplitude_ratio:.4f}" in shown
    assert f"{1e6 * waves.primary.time_of_flight:.2f}" in shown
    assert any(EVIL.split()[0] in one for one in shown)  # the material
    assert page.text["p"][0].startswith(f"At bead 6 the primary wave has AR {hl.amplitude_ratio(run(), 6):.3f} and TOF")
    assert page.text["p"][1].startswith("AR, the amplitude ratio, is")
    assert page.text["figcaption"][0] == "The set-up to scale."
    assert page.text["figcaption"][1] == "Force at beads 6, 7, and its waves."
    assert {"Chain", "Structure", "Run"} <= set(page.text["summary"])  # tables that are folded
    assert page.tags.count("svg") == 5
    assert "12.3 s" in page.text["dd"]
    assert any("hertzlink" in one for one in page.text["dd"])
    assert any("base: fixed" in one for one in page.text["title"])
    assert '"impact_speed": 0.3' in page.text["pre"][0]


def test_warnings_of_a_result_and_of_its_measures_are_listed(tmp_path: Path) -> None:
    short = run().sel(time=slice(None, 1.5e-4)).assign_attrs(warnings="yield: real <b>beads</b> would be dented")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        page = check_page(made(tmp_path, short, sensors=2))
    listed = [one for one in page.text["li"] if ":" in one]
    assert "yield: real <b>beads</b> would be dented" in listed
    assert any("sensor = 2" in one for one in listed)
    assert any(one.startswith("none; ") for one in cells(page))


def test_report_of_a_sweep_shows_each_run(tmp_path: Path) -> None:
    page = check_page(made(tmp_path, runs(), sensors=5))
    ratios = hl.amplitude_ratio(runs(), 5).values.ravel()
    shown = cells(page)
    assert "modulus (GPa)" in shown
    for ratio in ratios[np.isfinite(ratios)]:
        assert f"{ratio:.4g}" in shown
    assert np.isnan(ratios).any()
    assert "none" in shown
    assert any("no primary wave" in one for one in page.text["title"])
    assert page.text["p"][0].startswith("6 runs over modulus (0.1 to 200 GPa); speed (0.1 to 0.3 m/s): AR")
    assert any("varied, drawn is the first run: modulus, " in one for one in page.text["title"])
    assert {"Varied", "Chain of the first run"} <= {*page.text["caption"], *page.text["summary"]}


def test_report_of_a_batch_and_of_a_signal(tmp_path: Path) -> None:
    chains = [hl.Chain([BEAD] * 12, BEAD, speed) for speed in (0.1, 0.2)]
    batch = hl.batch(chains, until=5e-4, sensors=[6], structure=hl.half_space(hl.PTFE))
    assert "2 runs over run: no run has a primary wave." in check_page(made(tmp_path, batch, sensors=6)).text["p"][0]
    page = check_page(made(tmp_path, signal(), setup=build(3e9, 0.3)))
    assert page.text["h1"] == ["Measured signal"]
    assert any("half-space" in one for one in page.text["title"])


def test_report_of_an_identification_and_of_its_file(tmp_path: Path) -> None:
    found().save(tmp_path / "found.nc")
    with xr.open_dataset(tmp_path / "found.nc") as saved:
        for given in (found(), saved.load()):
            page = check_page(made(tmp_path, given))
            shown = cells(page)
            for one in found().unknowns.values():
                assert set(one.row()) <= set(shown)
            assert page.tags.count("svg") == 6  # two for the unknowns, two for each sensor
            assert any("explains the signal" in one for one in page.text["p"])


def test_report_of_an_identification_by_features(tmp_path: Path) -> None:
    tap = hl.CoSimulation(hl.Chain([BEAD] * 14, BEAD, 0.3), hl.half_space(hl.PTFE)).run(until=8e-4)

    def build14(speed: float) -> hl.CoSimulation:
        return hl.CoSimulation(hl.Chain([BEAD] * 14, BEAD, speed), hl.half_space(hl.PTFE))

    result = hl.identify(tap, build14, sensors=[7], compare="features", guess={"speed": 0.3}, speed=(0.2, 0.4))
    page = check_page(made(tmp_path, result))
    assert page.tags.count("svg") == 4
    assert any("value / measured value" in one for one in page.text["title"])


def test_report_of_two_chains_shows_each(tmp_path: Path) -> None:
    rod = hl.rod([hl.Layer(hl.PTFE, 0.05, 0.01)], base="contact", elements=8)
    chains = [hl.Chain([BEAD] * count, BEAD, 0.3) for count in (4, 6)]
    two = hl.CoSimulation(chains, [hl.ContactPoint(rod, 0), hl.ContactPoint(rod, 1)]).run(until=1e-4)
    page = check_page(made(tmp_path, two, sensors=2))
    assert {"Waves of chain 0", "Waves of chain 1", "Record and energy", "Set-up"} <= set(page.text["h2"])
    assert page.tags.count("svg") == 8
    with pytest.raises(ValueError, match="choose one chain with"):
        hl.plots.traces(two, 2)


@pytest.mark.parametrize(
    ("beads", "rows"),
    [
        (["a"] * 20, [{"count": 20, "bead": "a"}]),
        (["a", "b", "b", "a"], ["a", {"count": 2, "bead": "b"}, "a"]),
        ([{"radius": 0.0}, {"radius": -0.0}], [{"radius": 0.0}, {"radius": -0.0}]),
        ([{"radius": 1}, {"radius": 1.0}], [{"radius": 1}, {"radius": 1.0}]),
        (
            [{"class": "Mine", "count": 3, "bead": 1}] * 2,
            [{"count": 2, "bead": {"class": "Mine", "count": 3, "bead": 1}}],
        ),
        ([], []),
    ],
)
def test_equal_neighbours_stand_once_in_the_input(beads: list[Any], rows: list[Any]) -> None:
    given = {"chains": [{"beads": beads, "gravity": 0.0}], "until": 1e-3}
    text = as_text(given)
    assert json.loads(text)["chains"][0]["beads"] == rows
    assert repr(stored(text)) == repr(given)
    assert stored(json.dumps(given)) == given  # as earlier versions wrote it


def test_a_page_lists_equal_beads_once_and_a_file_cannot_ask_for_endless_ones(tmp_path: Path) -> None:
    text = made(tmp_path, run(), sensors=[7])
    assert text.count("&#34;class&#34;: &#34;Sphere&#34;") <= 4
    endless = {"chain": {"beads": [{"count": 10**6, "bead": 1}, {"count": 1, "bead": 2}]}}
    assert stored(json.dumps(endless)) == {}


def test_input_is_told_with_units_and_equal_beads_once() -> None:
    coupled = hl.CoSimulation(hl.Chain([hl.Sphere(4.76e-3, hl.PTFE)] * 3, None, 0.3), None)
    tables = setup_in_words.input_tables(coupled.describe())
    assert tables[0].rows[0].cells == (
        "beads", "3 × Sphere: radius 4.76 mm; material PTFE (E 1.53 GPa, ν 0.46, ρ 2151 kg/m³)",
    )  # fmt: skip
    assert Line(("impact speed", "0.3 m/s")) in tables[0].rows
    assert Line(("inclination", "90 °")) in tables[0].rows
    given = {"kind": "plate", "thickness": 2.29e-3, "at": [0.06, 0.457], "highest_frequency": 8e4, "until": 1.5e-3}
    sensor = asdict(hl.PointMass(0.1, 0.1, 2e-3))
    assert dict(setup_in_words.rows_of({"largest": 600, "pulse": 2.5e-5, "additions": [sensor]})) == {
        "largest": "600", "pulse": "25 µs", "additions": "x 100 mm; y 100 mm; mass 2 g",
    }  # fmt: skip
    assert dict(setup_in_words.rows_of(given)) == {
        "kind": "plate", "thickness": "2.29 mm", "at": "60, 457 mm", "highest frequency": "80 kHz",
        "until": "1.5 ms",
    }  # fmt: skip


def test_page_escapes_all_text_and_leaves_out_empty_sections() -> None:
    table = Table(EVIL, (EVIL,), [Line((EVIL,), EVIL)])
    full = Section(EVIL, [EVIL], [EVIL], [table], [], [(EVIL, EVIL)])
    text = html(Page(EVIL, [EVIL], [full, Section("nothing")], [(EVIL, EVIL)], EVIL))
    page = check_page(text)
    assert page.text["h2"] == [EVIL]
    assert "<script" not in text
    assert "prefers-color-scheme: dark" in text


def test_a_report_replaces_an_earlier_one_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "report.html"
    file.write_text("earlier")
    file.chmod(0o640)
    made(tmp_path, signal())
    assert stat.S_IMODE(file.stat().st_mode) == 0o640
    whole = file.read_text("utf-8")
    assert whole.rstrip().endswith("</html>")

    def fails(page: Page) -> str:
        raise FloatingPointError

    monkeypatch.setattr("hertzlink.reports.report.html", fails)
    with pytest.raises(FloatingPointError):
        made(tmp_path, signal())
    assert file.read_text("utf-8") == whole
    assert [one.name for one in tmp_path.iterdir()] == ["report.html"]


BAD: dict[str, tuple[Callable[[Path], Any], type[Exception], str]] = {
    "nothing": (lambda p: hl.plots.report(None, p / "a.html"), ValueError, "result = None"),
    "empty": (lambda p: hl.plots.report(xr.Dataset(), p / "a.html"), ValueError, "must be a run, a sweep"),
    "sensor": (lambda p: hl.plots.report(run(), p / "a.html", sensors=99), ValueError, "sensor = 99"),
    "title": (lambda p: hl.plots.report(run(), p / "a.html", title=5), ValueError, "title = 5"),
    "path": (lambda p: hl.plots.report(run(), 5), ValueError, "path = 5"),
    "no path": (lambda p: hl.plots.report(run(), ""), ValueError, "path = ''"),
    "took": (lambda p: hl.plots.report(run(), p / "a.html", took=-1.0), ValueError, "took = -1.0"),
    "setup": (lambda p: hl.plots.report(signal(), p / "a.html", setup=BEAD), ValueError, "setup = Sphere"),
    "folder": (lambda p: hl.plots.report(signal(), p / "no" / "a.html"), OSError, "a.html"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_named_and_writes_nothing(name: str, tmp_path: Path) -> None:
    call, kind, message = BAD[name]
    with pytest.raises(kind, match=message):
        call(tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_new_parts_are_in_words_with_units() -> None:
    """Plies each in a row, orthotropic sheets by name, and units of what is neither a length nor a material."""
    carbon = {f"youngs_modulus_{way}": value for way, value in (("along", 135e9), ("across", 9e9))} | {"name": "carbon"}
    plate = {"material": {"plies": [{"material": carbon, "thickness": 0.25e-3, "angle": 0.0}], "surface": None}}
    assert dict(setup_in_words.rows_of(plate)) == {
        "ply 1": "material carbon (E 135 GPa along, 9 GPa across); thickness 250 µm; angle 0 °"
    }
    beam = {"kind": "beam", "bending_stiffness": 1.5, "mass_per_length": 0.08, "axial_force": -300.0}
    beam |= {"damping": {"time": 2e-5}}
    assert dict(setup_in_words.rows_of(beam)) == {
        "kind": "beam", "bending stiffness": "1.5 N m²", "mass per length": "0.08 kg/m", "axial force": "-300 N",
        "damping": "time 20 µs",
    }  # fmt: skip
