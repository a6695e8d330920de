"""Reports of studies, the formats of their figures, and studies drawn again from their netCDF files."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import xarray as xr
from command import ended
from matplotlib.figure import Figure
from page_parser import check_page

import hertzlink as hl
from hertzlink.studies import STUDIES, captions, draw, study
from hertzlink.studies.command import QUICK
from hertzlink.studies.compare import Number

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)

Command = Callable[..., tuple[int, str]]


class Small:
    """A study that takes a moment."""

    def run(self, quick: bool = False, jobs: int | None = None) -> xr.Dataset:
        first = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3), hl.half_space(hl.PTFE)).run(until=2e-5)
        return xr.Dataset({"ratio": ("length", [0.5, 0.6])}, {"length": [0.1, 0.2]}, {"input": first.attrs["input"]})

    def numbers(self, data: xr.Dataset) -> list[Number]:
        return [Number("AR & TOF", data.ratio.values[0], "a <reason>"), Number("contact with steel", 99.0)]

    def figures(self, data: xr.Dataset) -> dict[str, Figure]:
        figure, (axis,) = draw.panels(1)
        axis.plot(data.length, data.ratio, label="curve")
        axis.set(xlabel="length (m)", ylabel="AR")
        axis.legend()
        return {"stiffness": figure}


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> Command:
    """The command line in this process, in a folder of its own: exit code and standard error."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("hertzlink.studies.command.study", lambda name: Small())

    def run(*arguments: str) -> tuple[int, str]:
        return ended(*arguments), capsys.readouterr().err

    return run


def names(folder: str) -> set[str]:
    return {path.name for path in Path(folder).iterdir()}


def test_a_study_writes_a_report(command: Command) -> None:
    assert command("study", "rod-stiffness", "--quick") == (0, "")
    page = check_page(Path("rod-stiffness/report.html").read_text("utf-8"))
    assert page.text["h1"] == ["Study rod-stiffness"]
    assert page.text["p"][:2] == ["Numbers of the thesis: 1 differs.", STUDIES["rod-stiffness"]]
    assert QUICK in page.text["p"]
    assert "a <reason>" in page.text["td"]
    assert {"AR & TOF", "0.5", "85", "differs"} <= set(page.text["th"] + page.text["td"])
    assert page.text["figcaption"][0] == captions("rod-stiffness")["stiffness"]
    assert any("AR over length (m); curve" in one for one in page.images)
    assert any("half-space" in one for one in page.images)  # the sketch of the first run
    assert "time taken" in page.text["dt"]
    assert names("rod-stiffness") == {"files.txt", "rod-stiffness.nc", "report.html", "stiffness.png", "table.txt"}
    with xr.open_dataset("rod-stiffness/rod-stiffness.nc") as data:
        assert json.loads(data.attrs["input"])["study"] == "rod-stiffness"
        assert (data.attrs["quick"], data.attrs["comment"]) == (1, QUICK)
    # An earlier study is replaced only by force.
    assert Path("rod-stiffness/table.txt").read_text().startswith(QUICK)
    assert "exists already" in command("study", "rod-stiffness")[1]
    assert command("study", "rod-stiffness", "--force") == (0, "")
    assert QUICK not in Path("rod-stiffness/table.txt").read_text()
    assert names(".") == {"rod-stiffness"}


MARKS = {"png": b"\x89PNG", "svg": b"<?xml", "pdf": b"%PDF"}


@pytest.mark.parametrize("form", MARKS)
def test_figures_in_each_format_are_marked_if_quick(command: Command, form: str) -> None:
    assert command("study", "rod-stiffness", "--quick", "--figures", form)[0] == 0
    content = Path(f"rod-stiffness/stiffness.{form}").read_bytes()
    assert content.startswith(MARKS[form])
    assert QUICK.encode() in content or QUICK.replace("(", r"\(").replace(")", r"\)").encode() in content
    assert command("study", "rod-stiffness", "--figures", form, "--force")[0] == 0
    assert b"quick" not in Path(f"rod-stiffness/stiffness.{form}").read_bytes()


def test_a_study_is_drawn_again_without_a_run(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    assert command("study", "rod-stiffness", "--quick")[0] == 0

    def runs(*_: Any) -> None:
        raise AssertionError

    monkeypatch.setattr(Small, "run", runs)
    assert command("draw", "rod-stiffness/rod-stiffness.nc", "--figures", "svg") == (0, "")
    assert names("rod-stiffness-drawn") == {"files.txt", "report.html", "stiffness.svg", "table.txt"}
    for name in ("table.txt", "report.html"):
        first, again = (Path(folder, name).read_text("utf-8") for folder in ("rod-stiffness", "rod-stiffness-drawn"))
        # The layout of a figure may differ in the last digits.
        made = re.compile(r"<dt>report made</dt><dd>[^<]*</dd>|<img [^>]*>")
        assert made.sub("", first) == made.sub("", again)
    # An earlier drawing is replaced only by force.
    assert command("draw", "rod-stiffness/rod-stiffness.nc")[0] == 2
    assert command("draw", "rod-stiffness/rod-stiffness.nc", "--force")[0] == 0
    assert names("rod-stiffness-drawn") == {"files.txt", "report.html", "stiffness.png", "table.txt"}


def test_what_no_study_wrote_is_not_drawn(command: Command) -> None:
    Path("text.nc").write_text("no netCDF")
    xr.Dataset({"x": 1.0}).to_netcdf("other.nc", engine="h5netcdf")
    xr.Dataset(attrs={"input": json.dumps({"study": "none"})}).to_netcdf("none.nc", engine="h5netcdf")
    xr.Dataset(attrs={"input": "[1, 2"}).to_netcdf("broken.nc", engine="h5netcdf")
    before = names(".")
    for file, message in {
        "missing.nc": "there is no such file",
        "text.nc": "is not an HDF5 file that can be read",
        "other.nc": "was not written by a study",
        "none.nc": "was not written by a study",
        "broken.nc": "was not written by a study",
    }.items():
        code, said = command("draw", file)
        assert code == 2
        assert said.startswith(f"hertzlink: {file}: {message}")
        assert said.count("\n") == 1
    code, said = command("study", "rod-stiffness", "--figures", "bmp")
    assert code == 2
    assert "'bmp' is not one of" in said
    assert names(".") == before


def test_captions_need_no_other_text() -> None:
    for name in STUDIES:
        for figure, words in captions(name).items():
            assert not re.search(r"equation|thesis|chapter|section \d|figure \d|Table", words), (name, figure)


@pytest.mark.thorough
def test_figures_of_a_study_can_be_read_without_the_thesis(command: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file of a study holds all that its table and figures need."""
    name = "rod-length"
    monkeypatch.setattr("hertzlink.studies.command.study", study)
    assert command("study", name, "--quick", "--jobs", "1", "--output", "ran")[0] == 0
    assert command("draw", f"ran/{name}.nc", "--output", "drawn") == (0, "")
    assert names("drawn") == names("ran") - {f"{name}.nc"}
    assert Path("ran/table.txt").read_text("utf-8") == Path("drawn/table.txt").read_text("utf-8")
    page = check_page(Path("drawn/report.html").read_text("utf-8"))
    words = [*page.text["figcaption"], *page.images]
    assert not [one for one in words if re.search(r"equation|Table \d|chapter|section \d", one)]
    assert set(captions(name).values()) == set(page.text["figcaption"][: len(captions(name))])
