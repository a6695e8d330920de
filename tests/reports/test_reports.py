"""Reports: whole pages that load nothing, with words for every figure, escaped text, and named faults."""

import re
import stat
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
import pytest
import xarray as xr
from page_parser import check_page

import hertzlink as hl
from coupling.inference.identification import Identification
from coupling.inference.uncertainty import Uncertainty
from hertzlink.reports import Page, Table, html, page_of
from hertzlink.reports.results import FIRST_TAP, FRESH_SPOT, SMALLER_BEADS, SWALLOWED, UNSETTLED, WHICH_DISTANCE

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
    return hl.sweep(build, until=5e-4, jobs=1, modulus=[1e8, 3e9, 2e11], speed=[0.1, 0.3])


def made(tmp_path: Path, result: Any, **given: Any) -> str:
    return hl.plots.report(result, tmp_path / "report.html", **given).read_text("utf-8")


def cells(page: Any) -> list[str]:
    return [" ".join(text.split()) for tag in ("td", "th") for text in page.text[tag]]


def test_report_of_a_run(tmp_path: Path) -> None:
    page = check_page(made(tmp_path, run(), title=EVIL, sensors=[6, 7]))
    assert page.text["h1"] == [EVIL]
    waves = hl.reflections(run(), 7)
    assert set(waves.primary.texts) <= set(cells(page))
    ratio, flight = hl.reflections(run(), 6).primary.texts
    assert page.text["p"][0].startswith(f"At bead 6 the primary wave has AR {ratio} and TOF {flight} µs")
    assert page.text["p"][1].startswith("AR, the amplitude ratio, is")
    # Set-up, forces, map; folded is the energy.
    shown = [" ".join(words.split()) for words in page.text["figcaption"]]
    assert shown[:2] == ["The set-up to scale.", "Force at beads 6, 7, and its waves."]
    assert len(shown) == 4
    assert any("base: fixed" in words and EVIL.split()[0] in words for words in page.images)
    assert any("hertzlink" in one for one in page.text["dd"])
    assert '"impact_speed": 0.3' in page.text["pre"][0]


def test_report_of_a_run_on_a_fresh_spot(tmp_path: Path) -> None:
    """Both contact laws stand in the sentences, in the figure and in the table."""
    page = page_of(run(), sensors=[7], yielded=run())
    assert page.sentences[1].startswith("On a fresh spot, where the metal yields, the primary wave has AR ")
    assert FRESH_SPOT in page.sentences
    axes = page.pictures[1].figure.axes[0]
    colours = {
        line.get_color() for line in axes.lines if "force at bead 7" in line.get_label() or "fresh" in line.get_label()
    }
    assert len(colours) == 2
    assert [row[0] for row in page.tables[0].rows if "primary" in row[0]] == [
        "bead 7, primary", "bead 7, primary, fresh spot",
    ]  # fmt: skip


def test_warnings_of_a_result_and_of_its_measures_are_listed(tmp_path: Path) -> None:
    short = run().sel(time=slice(None, 1.5e-4)).assign_attrs(warnings="yield: real <b>beads</b> would be dented")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        page = check_page(made(tmp_path, short, sensors=2))
    assert "yield: real <b>beads</b> would be dented" in page.text["li"]
    assert any("sensor = 2" in one for one in page.text["li"])
    assert any(one.startswith("none; ") for one in cells(page))


def test_report_of_a_sweep_shows_each_run(tmp_path: Path) -> None:
    page = check_page(made(tmp_path, runs().assign_attrs(warnings="yield: at 3 points"), sensors=5))
    ratios = hl.amplitude_ratio(runs(), 5).values.ravel()
    assert np.isnan(ratios).any()
    assert {"none", *(f"{ratio:.5g}" for ratio in ratios[np.isfinite(ratios)])} <= set(cells(page))
    least, most = np.nanmin(ratios), np.nanmax(ratios)
    words = f"AR of the primary wave at bead 5 lies between {least:.3f} (modulus "
    assert page.text["p"][0].startswith(words)
    assert re.search(rf"and {most:.3f} \(modulus 200 GPa, speed .*\){FIRST_TAP}; 3 runs", page.text["p"][0])
    assert "Varied: modulus (0.1 to 200 GPa); speed (0.1 to 0.3 m/s)." in page.text["p"]
    assert any("no primary wave" in one for one in page.images)
    same = page_of(runs().isel(modulus=[2]), sensors=5)  # whose AR differs by less than its digits
    assert same.sentences[0].startswith(f"AR of the primary wave at bead 5 is {most:.3f}.")
    assert any("drawn: modulus 0.1 GPa, the first of 0.1 to 200 GPa" in one for one in page.images)


def test_report_of_a_critical_distance_shows_both_contact_laws() -> None:
    """The first sentence is the answer with its brackets, and both curves are drawn."""
    distance, sampled = np.array([0.01, 0.02, 0.03]), [True] * 3
    elastic, yielding = (
        xr.Dataset(
            {
                "critical_distance": critical, "bracket": ("end", bracket), "far_value": 0.5, "settled": True,
                "amplitude_ratio": ("distance", [0.7, 0.52, 0.5]), "sampled": ("distance", sampled), "short_record": 1,
            },
            {"distance": ("distance", distance, {"units": "m"}), "within": 0.02},
            {"sensor": 7},
        )
        for critical, bracket in ((0.01946, [0.0194, 0.0195]), (0.02488, [0.0248, 0.0249]))
    )  # fmt: skip
    page = page_of(elastic, yielded=yielding)
    assert page.pictures[0].caption.startswith("AR at bead 7 over ")
    assert page.sentences[:3] == [
        "Beyond 19.46 mm (19.40 to 19.50 mm) the edge changes AR by less than 0.02 on elastic contacts, "
        "and beyond 24.88 mm (24.80 to 24.90 mm) on a fresh spot.",
        WHICH_DISTANCE,
        FRESH_SPOT,
    ]
    (axes,) = page.pictures[0].figure.axes
    assert "far away ± 0.02" in [text.get_text() for text in axes.get_legend().get_texts()]
    assert len({line.get_color() for line in axes.lines}) == 2
    assert [row[:2] for row in page.tables[0].rows] == [["on elastic contacts", "19.46"], ["on a fresh spot", "24.88"]]
    # One result alone, whose law is the user's own, is not called elastic.
    alone = page_of(elastic)
    assert "elastic" not in " ".join([*alone.sentences, *alone.tables[0].head, *alone.tables[0].rows[0]])
    assert not any("elastic" in text.get_text() for text in alone.pictures[0].figure.axes[0].get_legend().get_texts())
    # Where AR does not settle, where it is settled at all distances, and where the record is too short.
    late = "At 30.00 mm the edge changes AR by more than 0.02; the record ends before the wave comes back"
    for bracket, far, words in (
        ([0.03, np.inf], 0.5, "At 30.00 mm the edge changes AR by more than 0.02; greater distances are needed"),
        (
            [np.nan, np.nan],
            0.5,
            "The influence of the edge is not known, because a wave returns from the greatest distance only",
        ),
        (
            [0.0, 0.01],
            0.5,
            "From the smallest distance with a wave on, 10.00 mm, the edge changes AR by less than 0.02",
        ),
        ([0.03, np.inf], np.nan, late),
    ):
        edge = elastic.assign(bracket=("end", bracket), critical_distance=0.005, far_value=far)
        page = page_of(edge)
        assert (page.tables[0].rows[0][0] == "more than 30.00") is (bracket == [0.03, np.inf])
        assert page.sentences[0] == f"{words}."
        assert UNSETTLED not in page.sentences
    taken = edge.assign(bracket=("end", [np.nan] * 2), critical_distance=np.nan, short_record=False)
    page = page_of(taken, yielded=taken)
    assert page.sentences[0].endswith(f"because {SWALLOWED} on elastic contacts and on a fresh spot.")
    assert page.sentences[1:3] == [SMALLER_BEADS, FRESH_SPOT]
    page = page_of(elastic.assign(settled=False))
    assert page.sentences[1] == UNSETTLED
    assert page.tables[0].rows[0][-1] == "0.5000, perhaps not settled"


def test_report_of_a_batch_and_of_a_signal(tmp_path: Path) -> None:
    def tap(speed: float) -> hl.CoSimulation:
        return hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, speed), hl.half_space(hl.PTFE))

    batch = hl.batch(tap, until=5e-4, sensors=[6], speed=[0.1, 0.2])
    assert "No run has a primary wave at bead 6." in check_page(made(tmp_path, batch, sensors=6)).text["p"]
    page = check_page(made(tmp_path, signal(), setup=build(3e9, 0.3)))
    assert page.text["h1"] == ["Measured signal"]
    assert any("half-space" in one for one in page.images)


def test_report_of_an_identification_and_of_its_file(tmp_path: Path) -> None:
    found().to_dataset().to_netcdf(tmp_path / "found.nc")
    with xr.open_dataset(tmp_path / "found.nc") as saved:
        for given in (found(), saved.load()):
            page = check_page(made(tmp_path, given))
            for one in found().unknowns.values():
                assert set(one.row()) <= set(cells(page))
            low, high = (1e-9 * end for end in found()["modulus"].interval)
            said = re.match(r"Modulus ([\d.]+) GPa \(([\d.]+) to ([\d.]+)\), speed [\d.]+ m/s \(", page.text["p"][0])
            value = 1e-9 * found()["modulus"].value
            assert [float(number) for number in said.groups()] == pytest.approx([value, low, high], abs=1e-4)
            assert page.text["p"][1].startswith("The model explains the signal")
            assert page.tags.count("img") == 6  # two for the unknowns, two for each sensor
    doubtful = found().to_dataset().assign_attrs(explained=0, misfit=3.21)
    assert page_of(doubtful).sentences[0].startswith("No value can be trusted: the model does not explain the signal")


def test_report_of_two_chains_shows_each(tmp_path: Path) -> None:
    rod = hl.rod([hl.Layer(hl.PTFE, 0.05, 0.01)], base="contact", elements=8)
    chains = [hl.Chain([BEAD] * count, BEAD, 0.3) for count in (4, 6)]
    two = hl.CoSimulation(chains, [hl.ContactPoint(rod, 0), hl.ContactPoint(rod, 1)]).run(until=1e-4)
    page = check_page(made(tmp_path, two, sensors=2))
    assert {f"AR and TOF at the sensors of chain {i}" for i in (0, 1)} <= set(page.text["caption"])
    assert page.tags.count("img") == 6
    with pytest.raises(ValueError, match="choose one chain with"):
        hl.plots.traces(two, 2)


def map_of(thicknesses: list[float], half: float = 0.02e-3) -> xr.Dataset:
    """A map of identified thicknesses along a line."""
    value = np.array(thicknesses)[:, None]
    points, attrs = len(thicknesses), {"unit": "mm", "size": 1e-3}
    return xr.Dataset(
        {
            "value": (("point", "unknown"), value), "low": (("point", "unknown"), value - half),
            "high": (("point", "unknown"), value + half), "misfit": ("point", np.ones(points)),
            "verdict": (("point", "unknown"), np.full((points, 1), "identified", object)),
            "taps": ("point", np.ones(points, int)), "files": ("point", [f"{i}.csv" for i in range(points)]),
            "error": ("point", [""] * points), "x": ("point", 0.01 * np.arange(points), attrs),
            "y": ("point", np.zeros(points), attrs), "unit": ("unknown", ["mm"]), "unit_size": ("unknown", [1e-3]),
        },
        {"unknown": ["structure.thickness"]},
    )  # fmt: skip


def test_report_of_a_map_says_which_points_differ() -> None:
    even = [3.0e-3, 3.01e-3, 2.99e-3, 3.0e-3, 3.0e-3, 2.99e-3, 3.01e-3, 3.0e-3, 3.0e-3, 3.0e-3]
    page = page_of(map_of([*even, 2.6e-3, 2.6e-3]))
    places = "x = 100 mm, y = 0 mm; x = 110 mm, y = 0 mm"
    assert page.sentences[0] == f"2 of 12 points ({places}) are 0.4 mm thinner than the median thickness of 3 mm."
    assert page.sentences[1] == "12 points: 12 identified."
    assert page.tables[0].rows[-1][:4] == ["110", "0", "1", "2.600 (2.580 to 2.620)"]
    one = page_of(map_of([*even, 2.7e-3])).sentences[0]
    assert one.startswith("1 of 11 points (x = 100 mm, y = 0 mm) is 0.3 mm thinner than")
    assert page_of(map_of(even)).sentences[0].startswith("All 10 points agree in thickness: 3 mm")
    # Where points vary by more than their intervals, they do not agree, however great their scatter.
    varied = [1e-3 * value for value in (14.98, 15.01, 14.99, 24.99, 25.03, 24.97, 35.04, 35.01)]
    assert page_of(map_of(varied)).sentences[0] == "Thickness varies from 14.98 to 35.04 mm over 8 points."
    page = page_of(map_of([12.0, 4.0, 24.0], 30.0).assign(unit=("unknown", [""]), unit_size=("unknown", [1.0])))
    assert page.sentences[0] == "All 3 points agree in thickness: 12, with a scatter of 10."
    assert page.tables[0].head[3] == "structure.thickness"


def test_page_escapes_all_text() -> None:
    table = Table(EVIL, (EVIL,), [(EVIL,)], [EVIL])
    text = html(Page(EVIL, [EVIL], [], [table], [EVIL], [(EVIL, EVIL)], [(EVIL, EVIL)], EVIL))
    page = check_page(text)
    assert page.text["h1"] == page.text["pre"] == page.text["li"] == page.text["caption"] == [EVIL]
    assert "<script" not in text
    assert "prefers-color-scheme: dark" in text


def test_a_style_of_the_user_does_not_reach_a_report(tmp_path: Path) -> None:
    """The style needs LaTeX."""
    with matplotlib.rc_context({"text.usetex": True, "svg.fonttype": "none"}):
        page = check_page(made(tmp_path, signal()))
    assert page.tags.count("img") == 1


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

    monkeypatch.setattr("hertzlink.reports.html", fails)
    with pytest.raises(FloatingPointError):
        made(tmp_path, signal())
    assert file.read_text("utf-8") == whole
    assert [one.name for one in tmp_path.iterdir()] == ["report.html"]


BUDGET = Uncertainty({}, {}, {}, {}, {})
BAD: dict[str, tuple[Callable[[Path], Any], type[Exception], str]] = {
    "nothing": (lambda p: hl.plots.report(None, p / "a.html"), ValueError, "result = None"),
    "empty": (lambda p: hl.plots.report(xr.Dataset(), p / "a.html"), ValueError, "must be a run, a sweep"),
    "sensor": (lambda p: hl.plots.report(run(), p / "a.html", sensors=99), ValueError, "sensor = 99"),
    "title": (lambda p: hl.plots.report(run(), p / "a.html", title=5), ValueError, "title = 5"),
    "path": (lambda p: hl.plots.report(run(), 5), ValueError, "path = 5"),
    "no path": (lambda p: hl.plots.report(run(), ""), ValueError, "path = ''"),
    "a folder": (lambda p: hl.plots.report(signal(), p), ValueError, "must be a file in a folder that exists"),
    "budget": (lambda p: hl.plots.report(BUDGET, p / "a.html"), ValueError, r"^result of type Uncertainty: .*noted_in"),
    "setup": (lambda p: hl.plots.report(signal(), p / "a.html", setup=BEAD), ValueError, "setup = Sphere"),
    "folder": (lambda p: hl.plots.report(signal(), p / "no" / "a.html"), ValueError, "a.html': must be"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_named_and_writes_nothing(name: str, tmp_path: Path) -> None:
    call, kind, message = BAD[name]
    with pytest.raises(kind, match=message):
        call(tmp_path)
    assert list(tmp_path.iterdir()) == []
