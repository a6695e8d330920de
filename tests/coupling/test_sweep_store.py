"""Sweeps with a store: nothing lost, nothing run twice, failing points apart, files that are not theirs left alone."""

import json
import logging
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzlink as hl
from coupling.sweeps.progress import Progress, Stopped, labelled, one_bar, watched
from coupling.sweeps.store import _read, describe_point

UNTIL = 1e-4
RADII = [2e-3, 3e-3, 4e-3]
MATERIALS = [hl.PTFE, hl.ACRYLIC]
called: list[tuple[str, float]] = []
"""Points that were run in this process."""


def build(material: hl.Material, radius: float) -> hl.CoSimulation:
    called.append((material.name, radius))
    bead = hl.Sphere(radius, hl.STEEL_440C)
    return hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.3, gravity=9.81), hl.half_space(material))


def other(material: hl.Material, radius: float) -> hl.CoSimulation:
    return build(material, radius)


def largest(run: xr.Dataset) -> xr.Dataset:
    """Of every kind that a file keeps."""
    force = float(run.contact_force.max())
    return xr.Dataset(
        {
            "force": ((), force, {"units": "N", "limit": float("nan"), "note": ""}),
            "single": ((), np.float32(force)),
            "frames": ((), run.sizes["time"]),
            "large": ((), force > 10.0),
            "label": ((), f"{force:.0f} N"),
            "missing": ("contact", np.where(run.contact > 2, np.nan, 1.0)),
        },
        {"contact": run.contact, "where": ("contact", ["first", "", "third", "wänd"])},
    )


def swept(store: Path | None = None, **changes: object) -> xr.Dataset:
    given = {
        "build": build,
        "until": UNTIL,
        "jobs": 1,
        "material": MATERIALS,
        "radius": RADII,
        "store": store,
        **changes,
    }
    return hl.sweep(**given)  # type: ignore[arg-type]


@pytest.fixture(autouse=True)
def _forget_calls() -> None:
    called.clear()


def unwarned(runs: xr.Dataset) -> xr.Dataset:
    """Without the attribute that counts points, and names one by its axes in their order."""
    return runs.assign_attrs(warnings="")


def contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.thorough
@pytest.mark.parametrize("measure", [None, largest])
def test_a_store_changes_no_bit(tmp_path: Path, measure: object) -> None:
    """Straight without a store, straight with it, and read back."""
    plain = swept(measure=measure)
    kept, resumed = (swept(tmp_path / "store", measure=measure) for _ in range(2))
    assert len(called) == 12
    assert kept.identical(plain)
    assert resumed.identical(plain)
    for name in plain.variables:
        assert resumed[name].dtype == plain[name].dtype
        assert resumed[name].values.tobytes() == plain[name].values.tobytes()
    assert not list((tmp_path / "store").glob(".*"))


@pytest.mark.thorough
def test_longer_axes_run_the_new_points_alone(tmp_path: Path) -> None:
    swept(tmp_path, radius=RADII[1:], material=MATERIALS[:1])
    called.clear()
    grown = swept(tmp_path)
    assert called == [("PTFE", 2e-3), *(("acrylic", radius) for radius in RADII)]
    turned = hl.sweep(build, UNTIL, jobs=1, store=tmp_path, radius=np.array(RADII), material=MATERIALS)
    assert len(called) == 4
    assert unwarned(turned.transpose(*grown.dims)).identical(unwarned(grown))


def test_a_point_is_one_file_of_about_its_numbers(tmp_path: Path) -> None:
    """Names, dimensions, units and the point's description take some kilobytes."""
    runs = swept(tmp_path, material=[hl.PTFE], radius=[2e-3])
    (path,) = tmp_path.glob("*.point")
    assert path.stat().st_size < runs.nbytes + 20_000
    described, point = _read(path)
    assert json.loads(described)["radius"] == 2e-3
    assert isinstance(point, xr.Dataset)
    assert point.contact_force.identical(runs.contact_force.isel(material=0, radius=0, drop=True))


def test_failing_points_stand_apart(tmp_path: Path) -> None:
    radii = [-1.0, 2e-3, 3e-3]
    with pytest.warns(hl.HertzlinkWarning, match="2 of 6 points failed") as caught:
        runs = swept(tmp_path, measure=largest, radius=radii)
    assert any(str(tmp_path) in str(one.message) for one in caught)
    assert runs.error.dims == ("material", "radius")
    assert runs.error.sel(radius=-1.0).str.startswith("ValueError: radius = -1.0").all()
    assert (runs.error.sel(radius=RADII[:2]) == "").all()
    good = swept(measure=largest, radius=RADII[:2])
    found = runs.sel(radius=RADII[:2])
    for name in good.data_vars:
        assert np.array_equal(found[name].values, good[name].values, equal_nan=name == "missing")
    for name in ("force", "frames", "single", "missing"):
        assert runs[name].sel(radius=-1.0).isnull().all()
    assert (runs.label.sel(radius=-1.0) == "").all()
    called.clear()
    assert swept(tmp_path, measure=largest, radius=radii).identical(runs)
    assert called == []
    swept(tmp_path, measure=largest, radius=radii, retry=True)
    assert called == [("PTFE", -1.0), ("acrylic", -1.0)]


@pytest.mark.thorough
def test_coordinates_of_failing_points_are_missing(tmp_path: Path) -> None:
    runs = swept(tmp_path, radius=[-1.0, *RADII])
    assert runs.static_force.sel(radius=-1.0).isnull().all()
    assert runs.static_force.sel(radius=RADII).notnull().all()
    assert runs.time.dims == ("time",)


def with_errors(material: hl.Material, radius: float) -> hl.CoSimulation:
    if str(radius) not in os.environ["ALLOWED"]:
        raise KeyError("not yet")
    return build(material, radius)


@pytest.mark.thorough
def test_a_point_that_failed_may_run_later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ALLOWED", str(RADII[:1]))
    assert set(swept(tmp_path, build=with_errors).error.values.ravel()) == {"", "KeyError: 'not yet'"}
    monkeypatch.setenv("ALLOWED", str(RADII))
    runs = swept(tmp_path, build=with_errors, retry=True)
    assert "error" not in runs
    assert runs.identical(swept())


def test_all_points_failing_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(RuntimeError, match=r"all 2 points failed.*ValueError: radius = -1.*retry=True"):
        swept(tmp_path, radius=[-1.0])


def unfit(run: xr.Dataset) -> xr.Dataset:
    if run.impact_energy > 5e-5:
        raise ZeroDivisionError("too heavy")
    return xr.Dataset({"force": run.contact_force.max()})


def test_errors_of_measure_count(tmp_path: Path) -> None:
    runs = swept(tmp_path, measure=unfit)
    assert runs.error.sel(radius=4e-3).values.tolist() == ["ZeroDivisionError: too heavy"] * 2
    with pytest.raises(ZeroDivisionError) as caught:
        swept(measure=unfit)
    assert "radius" in caught.value.__notes__[0]


class OwnError(Exception):
    """No kind of error that Python knows."""


def own_error(material: hl.Material, radius: float) -> hl.CoSimulation:
    if radius == 3e-3:
        raise OwnError("three")
    return build(material, radius)


@pytest.mark.thorough
def test_errors_of_any_kind_count(tmp_path: Path) -> None:
    runs = swept(tmp_path, build=own_error)
    assert (runs.error.sel(radius=3e-3) == "OwnError: three").all()
    assert (runs.error.sel(radius=[2e-3, 4e-3]) == "").all()
    with pytest.raises(OwnError) as caught:
        swept(build=own_error)
    assert "radius = 3 mm" in caught.value.__notes__[0]


def stopping(material: hl.Material, radius: float) -> hl.CoSimulation:
    raise KeyboardInterrupt


def test_an_interrupt_ends_the_sweep(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        swept(tmp_path, build=stopping)
    assert [path.name for path in tmp_path.iterdir()] == ["sweep.json"]


def of_many_kinds(run: xr.Dataset) -> xr.Dataset:
    data = xr.Dataset({"when": ((), np.datetime64("2020-01-01", "ns")), "span": ((), np.timedelta64(3, "s"))})
    data["words"] = "x", np.array(["one", "", "zwölf"], object), {"nothing": None, "nested": [{"a": (1, 2.5)}]}
    data["wave"] = ("x", "y"), np.arange(6).reshape(3, 2, order="F") * 1j
    data["empty"] = "z", np.zeros(0)
    data["column"] = ("x", "y"), np.arange(6.0).reshape(2, 3).T
    return data.assign_coords(time=("x", [0.0, 1.0, 2.0]), bytes=("x", np.array([b"a", b"bc", b""])))


def test_what_numpy_holds_survives_a_store(tmp_path: Path) -> None:
    plain = swept(measure=of_many_kinds)
    for _ in range(2):
        kept = swept(tmp_path, measure=of_many_kinds)
        assert kept.identical(plain)
        assert [kept[name].dtype for name in kept.variables] == [plain[name].dtype for name in kept.variables]


def with_an_object(run: xr.Dataset) -> xr.Dataset:
    return xr.Dataset({"a": ((), hl.PTFE)})


def with_a_function(run: xr.Dataset) -> xr.Dataset:
    return xr.Dataset({"a": ((), 1.0, {"known": len})})


def reserved(run: xr.Dataset) -> xr.Dataset:
    return xr.Dataset({"error": ((), 1.0)})


@pytest.mark.parametrize(
    ("measure", "message"),
    [
        (with_an_object, r"measure: its result holds at .*\['a'\].*; return numbers and text only"),
        (with_a_function, "measure: its result holds at .*'known'.*; return numbers and text only"),
        (reserved, "must not return 'error'"),
    ],
)
def test_what_a_file_cannot_keep_fails(tmp_path: Path, measure: object, message: str) -> None:
    with pytest.raises(RuntimeError, match=message):
        swept(tmp_path, measure=measure)
    assert {_read(path)[1].kind for path in tmp_path.glob("*.point")} == {"ValueError"}
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"build": other}, "build = 'test_sweep_store.build', now it is 'test_sweep_store.other'"),
        ({"until": 2e-4}, r"until = 0\.0001, now it is 0\.0002"),
        ({"measure": largest}, "measure = None, now it is 'test_sweep_store.largest'"),
    ],
)
def test_the_store_of_another_sweep(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    swept(tmp_path, material=[hl.PTFE], radius=[2e-3])
    before = contents(tmp_path)
    with pytest.raises(ValueError, match=message):
        swept(tmp_path, **changes)
    assert contents(tmp_path) == before


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A store of a good point, one that failed, and a manifest."""
    folder = tmp_path_factory.mktemp("finished")
    swept(folder, measure=largest, material=[hl.PTFE], radius=[2e-3, -1.0])
    return folder


@pytest.mark.thorough
@settings(max_examples=60)
@given(place=st.floats(0.0, 1.0, exclude_max=True), flip=st.integers(1, 255), cut=st.booleans())
@pytest.mark.parametrize("suffix", ["point", "failure", "manifest"])
def test_damaged_files_are_told_and_left(finished: Path, suffix: str, place: float, flip: int, cut: bool) -> None:
    points = {isinstance(_read(path)[1], xr.Dataset): path for path in finished.glob("*.point")}
    path = {"point": points[True], "failure": points[False], "manifest": finished / "sweep.json"}[suffix]
    whole = path.read_bytes()
    at = int(place * (len(whole) - 1))
    broken = whole[:at] if cut else whole[:at] + bytes([whole[at] ^ flip]) + whole[at + 1 :]
    if suffix == "manifest" and same_json(whole, broken):
        return
    try:
        path.write_bytes(broken)
        before = contents(finished)
        with pytest.raises(ValueError, match=path.name):
            swept(finished, measure=largest, material=[hl.PTFE], radius=[2e-3, -1.0, 3e-3])
        assert contents(finished) == before
    finally:
        path.write_bytes(whole)


def same_json(whole: bytes, broken: bytes) -> bool:
    """Blanks between a record's items may change."""
    try:
        return bool(json.loads(whole) == json.loads(broken))
    except ValueError:
        return False


@pytest.mark.thorough
def test_another_points_file_is_told(tmp_path: Path) -> None:
    swept(tmp_path, material=[hl.PTFE], radius=[2e-3, 3e-3])
    first, second = sorted(tmp_path.glob("*.point"))
    first.write_bytes(second.read_bytes())
    with pytest.raises(ValueError, match=first.name):
        swept(tmp_path, material=[hl.PTFE], radius=[2e-3, 3e-3])


@pytest.mark.parametrize("name", ["notes.txt", "sweep.json", "0123456789abcdef0123456789abcdef.point"])
def test_foreign_folders_are_left_alone(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_text('{"mine": 1}')
    before = contents(tmp_path)
    with pytest.raises(ValueError, match=name if name.startswith("n") else r"sweep\.json"):
        swept(tmp_path)
    assert contents(tmp_path) == before


def test_a_foreign_file_in_a_store(tmp_path: Path) -> None:
    swept(tmp_path, material=[hl.PTFE], radius=[2e-3])
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(ValueError, match=r"notes\.txt"):
        swept(tmp_path)


def test_folders_that_cannot_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("mine")
    for path in (tmp_path / "file", tmp_path / "file" / "store"):
        with pytest.raises(ValueError, match="must be a writable folder"):
            swept(path)
    assert contents(tmp_path) == {tmp_path / "file": b"mine"}
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(ValueError, match="must be a writable folder"):
        swept(tmp_path / "store")
    assert called == []


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ("", "store = '': must be the path of a folder"),
        ("null\0", r"store = 'null\\x00': must be the path of a folder"),
        (b"store", "store = b'store': must be the path of a folder"),
        ("none/a/b", r"store = 'none/a/b': must be a writable folder; .*none.a is not a folder"),
        ("~nobody of that name/store", "store = '~nobody of that name/store': must be the path of a folder"),
    ],
)
def test_paths_that_cannot_be(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, path: str, message: str) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message):
        hl.sweep(build, UNTIL, jobs=1, store=path, material=[hl.PTFE], radius=[2e-3])
    assert list(tmp_path.iterdir()) == []


def test_a_store_in_the_users_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    hl.sweep(build, UNTIL, jobs=1, store="~/kept", material=[hl.PTFE], radius=[2e-3])
    assert len(list((tmp_path / "kept").glob("*.point"))) == 1


def test_a_newer_format_is_told(tmp_path: Path) -> None:
    swept(tmp_path, material=[hl.PTFE], radius=[2e-3])
    path = tmp_path / "sweep.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "version": 3}))
    with pytest.raises(ValueError, match="version = 3, now it is 2"):
        swept(tmp_path)


def test_half_written_files_go_when_they_are_old(tmp_path: Path) -> None:
    """A younger one may be another sweep's."""
    swept(tmp_path, material=[hl.PTFE], radius=[2e-3])
    old, young = tmp_path / ".old.part", tmp_path / ".young.part"
    for path in (old, young):
        path.write_text("half")
    os.utime(old, (0.0, 0.0))
    swept(tmp_path, material=[hl.PTFE], radius=[2e-3])
    assert not old.exists()
    assert young.exists()


@dataclass(frozen=True)
class Case:
    name: str
    sizes: tuple[float, ...]


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"radius": [2e-3, len]}, "radius = <built-in function len>: must be a number"),
        ({"material": [object()]}, "material = <object"),
        ({"radius": [1j]}, "radius = 1j"),
        (
            {"material": [hl.half_space(hl.PTFE)], "radius": [hl.rod([hl.Layer(hl.PTFE, 0.1, 0.01)])]},
            "must be a number",
        ),
        ({"build": lambda material, radius: build(material, radius)}, "build = .*must have a name"),
        ({"measure": lambda run: run}, "measure = .*must have a name"),
        ({"store": 3}, "store = 3"),
        ({"lenght": [1.0]}, r"build = .*: takes material, radius, but the axes are .*lenght \(got an unexpected"),
        ({"retry": 1}, "retry = 1"),
        ({"retry": True, "store": None}, "retry = True: needs the store"),
        ({"error": [1.0]}, "error is a name"),
    ],
)
def test_bad_input_leaves_no_folder(tmp_path: Path, changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        swept(**{"store": tmp_path / "store", **changes})  # type: ignore[arg-type]
    assert not (tmp_path / "store").exists()


numbers = st.one_of(st.booleans(), st.integers(), st.floats(allow_nan=False), st.text(max_size=3), st.none())


@pytest.mark.thorough
@given(numbers, numbers)
def test_points_are_told_apart(one: object, two: object) -> None:
    same = type(one) is type(two) and repr(one) == repr(two)
    assert (describe_point({"a": one}) == describe_point({"a": two})) is same
    assert (describe_point({"a": Case("", (one,))}) == describe_point({"a": Case("", (two,))})) is same  # type: ignore[arg-type]


@given(st.floats(allow_nan=False), st.integers(-(2**60), 2**60))
def test_numpy_numbers_are_numbers(number: float, count: int) -> None:
    plain = describe_point({"a": number, "b": count, "c": [number, number], "d": True})
    numpy = {"d": np.bool_(True), "c": np.array([number] * 2), "b": np.int64(count), "a": np.float64(number)}
    assert describe_point(numpy) == plain


def test_objects_are_told_apart() -> None:
    """By class and by everything that builds them."""
    bead = hl.Sphere(2e-3, hl.PTFE)
    values = [bead, hl.Sphere(2e-3, hl.ACRYLIC), hl.HollowSphere(2e-3, 1e-3, hl.PTFE), hl.Chain([bead] * 2, bead, 0.3)]
    values += [hl.Chain([bead] * 2, bead, 0.4), Case("a", (1.0,)), {"name": "a", "sizes": [1.0]}, ["a", [1.0]]]
    assert len({describe_point({"a": value}) for value in values}) == len(values)


def test_progress_estimates_the_time_left(caplog: pytest.LogCaptureFixture) -> None:
    """Ten points were there, four take 3 s each, sixteen are left: 48 s; a line every ten seconds at most."""
    now = [0.0]
    with caplog.at_level(logging.INFO, "hertzlink.sweep"), Progress(30, 10, 1, clock=lambda: now[0]) as progress:
        assert np.isnan(progress.left())
        for number in range(4):
            now[0] += 3.0
            progress.advance(failed=number == 2)
        assert progress.left() == pytest.approx(48.0)
        assert [record.getMessage() for record in caplog.records] == [
            "sweep: 14 of 30 points, 2 failed, about 00:48 left"
        ]
        for _ in range(9):
            now[0] += 1.0
            progress.advance()
    assert len(caplog.records) == 1


@pytest.mark.parametrize(
    ("times", "left"),
    [
        ([39.0], None),  # of 25 points; the first one compiled for 39 s, so the others take nothing like 24 times that
        ([39.0, 41.0, 43.0, 45.0], None),  # it is not yet steady
        ([39.0 + 2.0 * i for i in range(21)], 4 * 2.0),
        ([10.0, 10.0, 10.0, 10.1, 10.1], None),  # four processes, each with its first point
        ([10.0, 10.0, 10.0, 10.1, 20.0, 20.0, 20.0, 20.1], 10.1 * 17 / 7),
        ([1.0 * i for i in range(1, 26)], None),  # nothing is left
    ],
)
def test_time_left_is_not_stated_before_points_come_steadily(times: list[float], left: float | None) -> None:
    now = [0.0]
    with Progress(25, clock=lambda: now[0]) as progress:
        for now[0] in times:
            progress.advance()
        assert progress.left() == pytest.approx(left, rel=1e-9) if left else np.isnan(progress.left())
        assert ("left" in progress.text()) == (left is not None)


def test_a_total_that_is_only_likely_is_left_out_once_it_is_passed() -> None:
    with one_bar("plates", 6), Progress(2, label="fit", likely=True) as progress:
        progress.stage("search")
        assert progress.text() == "fit: search 0 of about 2 runs"
        for _ in range(3):
            progress.advance()
        progress.stage("intervals")
        assert progress.text() == "fit: intervals 3 runs"
    with labelled("contacts that yield"), Progress(2, label="fit") as progress:
        assert progress.text() == "fit, contacts that yield: 0 of 2 points"


def test_sweeps_of_one_task_share_its_bar(capsys: pytest.CaptureFixture[str]) -> None:
    """Three points more than were expected make the total larger; those that an earlier sweep left count as done."""
    with one_bar("plates", 6):
        with Progress(4, done=1) as first:
            for _ in range(3):
                first.advance()
            whole = first._whole
        assert whole is not None
        assert (whole.done, whole.total) == (4, 6)
        assert list(watched("abcde")) == list("abcde")
        assert (whole.done, whole.total) == (9, 9)
        assert list(watched(iter("ab"), 2)) == ["a", "b"]
    with Progress(1) as other:
        assert other._whole is None


def test_a_task_that_is_redirected_reports_in_lines(caplog: pytest.LogCaptureFixture) -> None:
    now = [0.0]
    with (
        caplog.at_level(logging.INFO, "hertzlink.sweep"),
        Progress(4, label="plates", clock=lambda: now[0]) as progress,
    ):
        now[0] = 20.0
        progress.advance()
    assert [record.getMessage() for record in caplog.records] == ["plates: 1 of 4 points"]


def stopping_late(material: hl.Material, radius: float) -> hl.CoSimulation:
    """Ctrl-C once a point is finished."""
    if list(Path("store").glob("*.point")):
        raise KeyboardInterrupt
    return build(material, radius)


def test_a_stopped_script_ends_with_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is an interrupt to those who catch one, and an exit with a message to the interpreter."""
    monkeypatch.chdir(tmp_path)
    with pytest.raises(Stopped) as caught:
        swept(Path("store"), build=stopping_late)
    assert isinstance(caught.value, KeyboardInterrupt)
    assert isinstance(caught.value, SystemExit)
    assert caught.value.code == str(caught.value)
    assert str(caught.value).startswith("1 of ")
    assert str(caught.value).endswith(f"points kept in {tmp_path / 'store'}; run again to continue")


def spoiling(material: hl.Material, radius: float) -> hl.CoSimulation:
    """Takes away the points that were finished before it."""
    for path in Path("store").glob("*.point"):
        path.unlink()
    return build(material, radius)


@pytest.mark.thorough
def test_points_that_are_taken_away_are_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(RuntimeError, match=r"removed from .*store"):
        swept(tmp_path / "store", build=spoiling)


SCRIPT = """
import sys, time
import hertzlink as hl

def build(material, radius):
    with open("runs", "a") as file:
        file.write(f"{material.name} {radius}\\n")
    time.sleep(0.05)
    if radius == 5e-3:
        raise ValueError("five")
    bead = hl.Sphere(radius, hl.STEEL_440C)
    return hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.3, gravity=9.81), hl.half_space(material))

def forces(run):
    return run[["contact_force"]]

def run(jobs, store, radii=[1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3]):
    materials = [hl.PTFE, hl.ACRYLIC, hl.NYLON, hl.COPPER, hl.STEEL_316]
    return hl.sweep(build, 1e-4, jobs=jobs, store=store, measure=forces, material=materials, radius=radii)
"""


@pytest.mark.thorough
def test_killed_sweeps_resume(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed at chance moments, in one process and in two: a finished point is never run again, and no bit differs."""
    (tmp_path / "swept_script.py").write_text(SCRIPT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    import swept_script  # type: ignore[import-not-found]

    store, chance = tmp_path / "store", random.Random(1)
    seen: dict[str, int] = {}
    for jobs in (1, 1, 2):
        target = len(list(store.glob("*"))) + chance.randint(3, 6)
        command = [sys.executable, "-c", f"import swept_script; swept_script.run({jobs}, 'store')"]
        with subprocess.Popen(command, env={**os.environ, "PYTHONPATH": os.pathsep.join([".", *sys.path])}) as process:
            while len(list(store.glob("*"))) < target:
                assert process.poll() is None
                time.sleep(0.01)
            time.sleep(chance.uniform(0.0, 0.1))
            process.send_signal(signal.SIGKILL)
            process.wait()
        for one, count in counted(store).items():
            assert seen.setdefault(one, count) == count
    resumed = swept_script.run(1, store)
    runs = Counter((tmp_path / "runs").read_text().splitlines())
    assert len(runs) == 30
    assert all(runs[one] == count for one, count in seen.items())
    # Processes of a sweep that was killed must begin nothing, or points would be run twice.
    assert sum(runs.values()) <= 30 + 1 + 1 + 2
    assert (resumed.error.sel(radius=5e-3) == "ValueError: five").all()
    radii = [1e-3, 2e-3, 3e-3, 4e-3, 6e-3]
    straight = swept_script.run(1, None, radii)
    assert unwarned(resumed.sel(radius=radii).drop_vars("error")).identical(unwarned(straight))


def counted(store: Path) -> dict[str, int]:
    """How often each point was run that is now in the store."""
    runs = Counter(Path("runs").read_text().splitlines())
    found = {}
    for path in store.glob("*.point"):
        point = json.loads(_read(path)[0])
        one = f"{point['material']['name']} {point['radius']}"
        found[one] = runs[one]
    return found


def deadly(folder: str, radius: float) -> hl.CoSimulation:
    """3 mm kill their process."""
    with (Path(folder) / "runs").open("a") as file:
        file.write(f"{radius}\n")
    if radius == 3e-3:
        os.kill(os.getpid(), signal.SIGKILL)
    return build(hl.PTFE, radius)


@pytest.mark.thorough
def test_a_process_that_dies_ends_its_own_point_alone(tmp_path: Path) -> None:
    radii = [1e-3, 2e-3, 3e-3, 4e-3, 5e-3]
    runs = hl.sweep(deadly, UNTIL, jobs=2, store=tmp_path / "store", folder=[str(tmp_path)], radius=radii).squeeze()
    assert runs.error.sel(radius=3e-3).item().startswith("TerminatedWorkerError: the process that ran it was killed")
    good = [radius for radius in radii if radius != 3e-3]
    assert (runs.error.sel(radius=good) == "").all()
    straight = swept(material=[hl.PTFE], radius=good).squeeze()
    assert np.array_equal(runs.contact_force.sel(radius=good).values, straight.contact_force.values)
    counts = Counter((tmp_path / "runs").read_text().split())
    assert counts["0.003"] == 2
    assert sum(counts.values()) <= len(radii) + 2, "what was finished must not be run again"


@pytest.mark.thorough
def test_a_full_disk_ends_a_sweep_and_loses_no_point(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The message names the file; what was finished stays, and the next sweep runs the others alone."""
    store, count, real = tmp_path / "store", 0, os.fsync

    def full(handle: int) -> None:
        nonlocal count
        count += 1
        # Each file is synced, and then its folder; the first file is the manifest.
        if count == 5:
            raise OSError(28, "No space left on device")
        real(handle)

    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", full)
        with pytest.raises(OSError, match=r"No space left on device; nothing was changed: '.*\.point'"):
            swept(store, measure=largest, material=[hl.PTFE])
    kept = contents(store)
    assert sorted(path.suffix for path in kept) == [".json", ".point"]
    called.clear()
    swept(store, measure=largest, material=[hl.PTFE])
    assert called == [("PTFE", radius) for radius in RADII[1:]]
    assert {path: content for path, content in contents(store).items() if path in kept} == kept


def lacking(folder: str, kind: str, radius: float) -> hl.CoSimulation:
    """3 mm need what this machine lacks, until it is there."""
    if radius == 3e-3 and not (Path(folder) / "mended").exists():
        raise {"package": ImportError("no gmsh"), "memory": MemoryError(), "disk": OSError(28, "No space left")}[kind]
    return build(hl.PTFE, radius)


@pytest.mark.parametrize(
    ("kind", "error", "jobs"),
    [
        ("package", ImportError, 1),
        ("memory", MemoryError, 1),
        ("disk", OSError, 1),
        pytest.param("disk", OSError, 2, marks=pytest.mark.thorough),
    ],
)
def test_a_failure_of_the_environment_is_not_kept(tmp_path: Path, kind: str, error: type[Exception], jobs: int) -> None:
    """It ends the sweep; what is finished stays, and the next sweep runs the point again."""
    store, axes = tmp_path / "store", {"folder": [str(tmp_path)], "kind": [kind], "radius": RADII}
    with pytest.raises(error) as caught:
        hl.sweep(lacking, UNTIL, jobs=jobs, store=store, **axes)  # type: ignore[arg-type]
    label = " ".join(caught.value.__notes__)
    assert "radius = 3 mm" in label
    assert "not recorded as failed" in label
    assert [path.name for path in store.glob("*.json")] == ["sweep.json"]
    (tmp_path / "mended").touch()
    runs = hl.sweep(lacking, UNTIL, jobs=jobs, store=store, **axes)  # type: ignore[arg-type]
    assert "error" not in runs
    assert runs.squeeze().contact_force.notnull().all()
