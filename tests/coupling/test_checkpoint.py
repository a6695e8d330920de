"""Checkpoints: a run that was killed or broken off, and resumed, is the run at one go, to the bit."""

import json
import logging
import math
import multiprocessing
import os
import signal
import stat
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.context import ForkServerContext
from pathlib import Path
from time import sleep
from typing import Any, NamedTuple
from unittest.mock import patch

import numpy as np
import pytest
import xarray as xr
from interrupted import (
    BEAD,
    CASES,
    CHAIN,
    DAMPED,
    ROD,
    UNTIL,
    SpringMass,
    counted,
    fine,
    fine_and_often,
    often,
    run,
    victim,
)

import hertzlink as hl
from coupling import run_loop
from coupling.files import plain
from coupling.recording import checkpoint
from coupling.results.provenance import as_text
from structures.stepping import GeneralisedAlpha

KILLS = 3

IMPORTED = (
    "coupling.cosimulation",
    "coupling.run_loop",
    "coupling.kernels.loop",
    "plates.builders",
    "structures.damping",
    "xarray",
    "pint",
    "dask.array",
)
"""What a run imports, some of it by way of xarray where it is installed."""


@pytest.fixture(scope="module")
def nursery() -> ForkServerContext:
    """Where processes come from that have imported everything already."""
    if not hasattr(signal, "SIGKILL"):
        pytest.skip("nothing kills like SIGKILL here")
    context = multiprocessing.get_context("forkserver")
    # hertzlink itself loads its modules when they are first used, which would be in each process.
    context.set_forkserver_preload([*IMPORTED, "hertzlink"])
    return context


def check_same(one: xr.Dataset, other: xr.Dataset) -> None:
    assert one.identical(other)
    for name, variable in one.variables.items():
        assert variable.values.tobytes() == other[name].values.tobytes()


@pytest.mark.thorough
@pytest.mark.parametrize("name", CASES)
def test_a_checkpoint_changes_no_number(name: str, tmp_path: Path) -> None:
    """And a run that is finished is there at once, its file as it was."""
    straight, path = run(name), tmp_path / "kept"
    check_same(run(name, path), straight)
    before, date = path.read_bytes(), path.stat().st_mtime_ns
    check_same(run(name, path), straight)
    assert (path.read_bytes(), path.stat().st_mtime_ns) == (before, date)
    assert os.listdir(tmp_path) == ["kept"]


@pytest.mark.thorough
@pytest.mark.parametrize("name", CASES)
def test_killed_at_random_moments_and_resumed(name: str, tmp_path: Path, nursery: ForkServerContext) -> None:
    """SIGKILL between any two calls or returns of functions, those of the checkpoint's writing included."""
    straight, path, random = run(name), tmp_path / "kept", np.random.default_rng(len(name))
    calls = counted(lambda: run(name, tmp_path / "whole"))
    (tmp_path / "whole").unlink()
    codes = []
    for part in random.uniform(0.05, 0.5, KILLS):
        killed = nursery.Process(target=victim, args=(name, path, int(part * calls)))
        killed.start()
        killed.join()
        codes.append(killed.exitcode)
        assert all(file.name == "kept" or file.suffix in (".part", ".lock") for file in tmp_path.iterdir())
    assert codes[0] == -signal.SIGKILL
    check_same(run(name, path), straight)


@pytest.mark.thorough
def test_killed_in_the_midst_of_writing(tmp_path: Path, nursery: ForkServerContext) -> None:
    """From outside and at any time: nearly all of it goes into writing files of some megabytes."""
    path, random = tmp_path / "kept", np.random.default_rng(5)
    straight = fine(None)
    for _ in range(10):
        for left in tmp_path.glob(".*.part"):
            left.unlink()
        killed = nursery.Process(target=fine_and_often, args=(path,))
        killed.start()
        while not list(tmp_path.glob(".*.part")) and killed.is_alive():
            sleep(0.001)
        sleep(random.uniform(0.0, 0.1))
        killed.kill()
        killed.join()
    check_same(fine(path), straight)


class Breaks(SpringMass):
    """Raises at one of its calls, the first time that it comes there."""

    calls = 0
    last = 0
    error: type[BaseException] = RuntimeError

    def advance(self, state: Any, force: float, window: float) -> Any:
        Breaks.calls += 1
        if Breaks.calls == Breaks.last:
            raise Breaks.error("once")
        return super().advance(state, force, window)


@pytest.mark.parametrize("error", [RuntimeError, KeyboardInterrupt, MemoryError])
@pytest.mark.parametrize("part", [0.05, 0.3, 0.95])
def test_broken_off_and_resumed(error: type[BaseException], part: float, tmp_path: Path) -> None:
    """Nothing is lost and nothing done twice: the participant is called as often as without the break, and
    for the window that broke, the six tries at the start and the answer by which it is known again."""
    simulation = hl.CoSimulation(CHAIN, Breaks(), hl.Explicit(tolerance=1.0), 6e-7, substeps=1)
    Breaks.calls, Breaks.last, Breaks.error = 0, 0, error
    with often():
        straight = simulation.run(UNTIL)
        calls = Breaks.calls
        Breaks.calls, Breaks.last = 0, int(part * calls)
        with pytest.raises(error, match="once"):
            simulation.run(UNTIL, checkpoint=tmp_path / "kept")
        assert os.listdir(tmp_path) == ["kept"]
        check_same(simulation.run(UNTIL, checkpoint=tmp_path / "kept"), straight)
    assert Breaks.calls == calls + 1 + 6 + 2


@pytest.mark.parametrize("stage", ["plain.write", "os.fsync", "os.replace"])
def test_broken_off_while_writing(stage: str, tmp_path: Path) -> None:
    """The checkpoint before is whole, and no other file is left."""
    straight, path, seen = run("full order"), tmp_path / "kept", []
    module, name = stage.split(".")
    real: Callable[..., Any] = getattr({"plain": plain, "os": os}[module], name)

    def breaks(*given: Any, **keywords: Any) -> Any:
        seen.append(path.read_bytes() if path.exists() else b"")
        if len(seen) == 101:
            raise KeyboardInterrupt
        return real(*given, **keywords)

    with often(), patch.object({"plain": plain, "os": os}[module], name, breaks), pytest.raises(KeyboardInterrupt):
        CASES["full order"][0]().run(UNTIL, checkpoint=path)
    assert os.listdir(tmp_path) == ["kept"]
    assert path.read_bytes() == seen[-1] != b""
    check_same(run("full order", path), straight)


def small(path: Any, **changed: Any) -> xr.Dataset:
    """A short run; with `changed` something of it is another."""
    keywords = {"until": 2e-5, "save_every": 2e-6, "chain": CHAIN, "structure": ROD, "window": 2e-6} | changed
    times = {name: keywords.pop(name) for name in ("until", "save_every")}
    times["trust"] = keywords.pop("trust", False)
    return hl.CoSimulation(**keywords).run(**times, checkpoint=path)


def bumped(structure: hl.Structure) -> hl.Structure:
    """With one number another, which its description does not contain."""
    stiffness = structure.stiffness.copy()
    stiffness.data[-1] *= 1.0 + 1e-15
    return replace(structure, stiffness=stiffness)


BOX = {"structure": SpringMass(), "scheme": hl.Aitken()}
HEAVIER = {"structure": SpringMass(mass=0.0142), "scheme": hl.Aitken()}
MOVING = hl.stepping.MovingStructure(ROD, partial(GeneralisedAlpha, spectral_radius=0.8))
OTHER = hl.stepping.MovingStructure(ROD, lambda *given: GeneralisedAlpha(*given, spectral_radius=0.7))
STEEL, SOFTER = (replace(CHAIN, law=lambda *_, k=k: hl.laws.PowerLaw(k, 1.5)) for k in (1e10, 0.9999e10))


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        ({}, {"until": 4e-5}, "until = 2e-05 there and 4e-05 here; name another file"),
        ({}, {"save_every": 4e-6}, "save_every = 2e-06 there and 4e-06 here; name another file"),
        ({}, {"window": 1e-6}, "window = 2e-06 there and 1e-06 here"),
        ({}, {"substeps": 16}, r"substeps = 8 there and 16 here"),
        ({}, {"dt": 3e-8}, "dt = None there and 3e-08 here"),
        ({}, {"waveform": "quadratic"}, "waveform = 'linear' there and 'quadratic' here; name another file"),
        ({}, {"scheme": hl.Aitken()}, r"scheme = 'Condensed\(tolerance=1e-11\)' there and 'Aitken"),
        ({}, {"chain": replace(CHAIN, impact_speed=0.32)}, r"chain\.impact_speed = 0\.31 there and 0\.32 here"),
        ({}, {"chain": replace(CHAIN, beads=[BEAD] * 5)}, r"chain\.beads has \d+ entries there and 5 here"),
        ({}, {"behind": DAMPED, "chain": replace(CHAIN, striker=None)}, "contacts = None there"),
        (
            {"chain": STEEL},
            {"chain": SOFTER},
            "another run: numbers of chains not the same, of which only a checksum is stored, ",
        ),
        (
            {},
            {"structure": bumped(ROD)},
            "another run: numbers of structures not the same, of which only a checksum is stored; name",
        ),
        (
            {},
            {"structure": hl.stepping.MovingStructure(ROD, "newmark")},
            "structure.stepper = None there and 'newmark' here",
        ),
        ({"structure": MOVING}, {"structure": OTHER}, "structure.stepper"),
        (BOX, HEAVIER, "another run: numbers of the structures' first answer not the same"),
        ({}, BOX, "structure"),
    ],
)
def test_a_checkpoint_of_another_run(
    first: dict[str, Any], second: dict[str, Any], message: str, tmp_path: Path
) -> None:
    path = tmp_path / "kept"
    small(path, **first)
    before = path.read_bytes()
    with pytest.raises(ValueError, match=rf"checkpoint = '.*kept': belongs to .*{message}"):
        small(path, **second)
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["kept"]
    small(path, **first)


def test_a_checkpoint_of_other_versions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    small(tmp_path / "kept")
    monkeypatch.setattr(checkpoint, "versions", lambda: {**json.loads(small(None).versions), "numpy": "0.1"})
    with pytest.raises(
        ValueError, match=r"another run: versions\.numpy = '.*' there and '0\.1' here; name another file"
    ):
        small(tmp_path / "kept")


def test_what_has_an_address_is_known_again(tmp_path: Path) -> None:
    """A law that is a function, and a stepper, print where they lie in memory, which no other process repeats."""

    def chain() -> hl.Chain:
        return replace(CHAIN, law=lambda one, other: hl.contact_law(one, other))

    def stepper(*given: Any) -> Any:
        return GeneralisedAlpha(*given)

    first = small(tmp_path / "kept", chain=chain(), structure=hl.stepping.MovingStructure(ROD, stepper))
    assert " at 0x" not in first.attrs["input"]
    check_same(small(tmp_path / "kept", chain=chain(), structure=hl.stepping.MovingStructure(ROD, stepper)), first)


@pytest.mark.thorough
def test_damage_anywhere_is_told(tmp_path: Path) -> None:
    """One byte another, anywhere: the file is refused and left as it is."""
    path = tmp_path / "kept"
    small(path)
    whole = path.read_bytes()
    sums = len(checkpoint.HEAD)
    body = sums + checkpoint.SUM
    for place in [*range(body + 3), *range(body, len(whole), 61), len(whole) - 1]:
        damaged = bytearray(whole)
        damaged[place] ^= 0x10
        path.write_bytes(damaged)
        with pytest.raises(ValueError, match="is no checkpoint of this" if place < sums else "is damaged; remove it"):
            small(path)
        assert path.read_bytes() == damaged
    for data in [*(whole[:end] for end in (0, 1, sums - 1, sums, sums + 9, body, body + 1, -1)), whole + b"\n"]:
        path.write_bytes(data)
        with pytest.raises(ValueError, match=r"kept': is (no checkpoint of|damaged; remove)"):
            small(path)
        assert path.read_bytes() == data
    path.write_bytes(whole)
    small(path)


def test_foreign_files_are_left_alone(tmp_path: Path) -> None:
    names = [tmp_path / name for name in ("run.nc", "notes.txt", "folder", "fifo", "link")]
    small(None).to_netcdf(names[0])
    names[1].write_text("hertzlink checkpoint 9\n")
    names[2].mkdir()
    os.mkfifo(names[3])
    names[4].symlink_to("notes.txt")
    contents = [names[number].read_bytes() for number in (0, 1)]
    for path in (*names, str(names[0]), "/dev/null"):
        with pytest.raises(ValueError, match=r"checkpoint = '.*': is no (regular file|checkpoint of this version)"):
            small(path)
    assert [names[number].read_bytes() for number in (0, 1)] == contents
    assert sorted(os.listdir(tmp_path)) == sorted(path.name for path in names)


@pytest.mark.parametrize(
    ("path", "message"),
    [
        (3, "checkpoint = 3: must be the path of a file"),
        (True, "checkpoint = True: must be the path"),
        (b"kept", "checkpoint = b'kept': must be the path"),
        ("a\0b", "must be the path of a file"),
        ("", "checkpoint = '': is no regular file"),
        ("nowhere/kept", "checkpoint = 'nowhere/kept': its folder does not exist"),
        ("/proc/kept", r"checkpoint = '/proc/kept': cannot be written \(.*\); name a file in a folder"),
        ("k" * 256, r"cannot be (read|written) \(.*too long"),
    ],
)
def test_bad_paths(path: Any, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ValueError, match=message):
        small(path)
    assert os.listdir(tmp_path) == []


def test_what_a_killed_run_left_is_deleted(tmp_path: Path) -> None:
    """No other run uses this checkpoint; another name is of another file."""
    left, other = (tmp_path / f".{name}.0123456789abcdef.part" for name in ("kept", "other"))
    for path in (left, other):
        path.write_bytes(b"half")
    small(tmp_path / "kept")
    assert {path.name for path in tmp_path.iterdir()} == {"kept", other.name}


def test_the_file_has_the_rights_of_any_other(tmp_path: Path) -> None:
    small(tmp_path / "kept")
    (tmp_path / "other").touch()
    assert stat.S_IMODE((tmp_path / "kept").stat().st_mode) == stat.S_IMODE((tmp_path / "other").stat().st_mode)


def test_a_link_stays_one_and_a_relative_path_means_the_folder_at_the_start(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "link").symlink_to("kept")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)

    class Wanders(SpringMass):
        def advance(self, state: Any, force: float, window: float) -> Any:
            os.chdir("/")
            return super().advance(state, force, window)

    small("link", structure=Wanders(), scheme=hl.Aitken())
    assert sorted(os.listdir(tmp_path)) == ["elsewhere", "kept", "link"]
    assert (tmp_path / "link").is_symlink()


class Unkept(SpringMass):
    """Its state cannot be pickled."""

    def start(self) -> Any:
        return lambda: super(Unkept, self).start()

    def advance(self, state: Any, force: float, window: float) -> Any:
        end, place = super().advance(state(), force, window)
        return lambda: end, place


def test_a_state_that_cannot_be_kept_is_refused_at_the_start(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"checkpoint = .*: the state of Unkept holds <function .*say trust=True"):
        small(tmp_path / "kept", structure=Unkept(), scheme=hl.Aitken())
    with pytest.raises(ValueError, match=r"checkpoint = .*: the state of this run cannot be pickled either"):
        small(tmp_path / "kept", structure=Unkept(), scheme=hl.Aitken(), trust=True)
    assert os.listdir(tmp_path) == []


class Motion(NamedTuple):
    """A state of a named tuple of one's own."""

    x: Any
    v: Any
    note: str = "moves"


@dataclass
class Mixed:
    """A state of a dataclass of one's own, with all kinds of plain data."""

    motion: Motion
    matrix: Any
    seen: dict[Any, Any]


class Rich(SpringMass):
    """Its state is plain data of types of its own."""

    def start(self) -> Any:
        kept = {"big": 2**80, 3: [math.inf, -0.0, None, b"raw"], (1, 2): {1.5, "a"}, "complex": 1j, "flag": np.True_}
        return Mixed(Motion(np.float64(0.0), 0.0), np.asfortranarray([[1.0, 2.0], [3.0, 4.0]]), kept)

    def advance(self, state: Any, force: float, window: float) -> Any:
        assert state.matrix.flags.f_contiguous
        assert not state.matrix.flags.c_contiguous
        assert type(state.motion.x) in (float, np.float64)
        assert state.seen == self.start().seen
        end, place = super().advance(tuple(state.motion[:2]), force, window)
        return Mixed(Motion(*end), np.asfortranarray(state.matrix), state.seen), place


class BreaksOnce(Rich):
    """Raises at one of its calls."""

    left = 0

    def advance(self, state: Any, force: float, window: float) -> Any:
        BreaksOnce.left -= 1
        if BreaksOnce.left == 0:
            raise RuntimeError("once")
        return super().advance(state, force, window)


def test_named_tuples_and_dataclasses_of_ones_own_are_plain(tmp_path: Path) -> None:
    """They are rebuilt because the participant makes them, not because the file names them."""
    simulation = hl.CoSimulation(CHAIN, BreaksOnce(), hl.Explicit(tolerance=1.0), 6e-7, substeps=1)
    straight = simulation.run(UNTIL)
    BreaksOnce.left = 150
    with often():
        with pytest.raises(RuntimeError, match="once"):
            simulation.run(UNTIL, checkpoint=tmp_path / "kept")
        assert b"pickle" not in (tmp_path / "kept").read_bytes()
        check_same(simulation.run(UNTIL, checkpoint=tmp_path / "kept"), straight)


class Place(tuple[float, float]):
    """A state of a class of its own."""


class Placed(SpringMass):
    def start(self) -> Any:
        return Place((0.0, 0.0))

    def advance(self, state: Any, force: float, window: float) -> Any:
        end, place = super().advance(state, force, window)
        return Place(end), place


def test_a_state_whose_class_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {"structure": Placed(), "scheme": hl.Aitken(), "trust": True}
    with pytest.raises(ValueError, match=r"state of Placed holds \(0\.0, 0\.0\) \(Place\), which is no plain data"):
        small(tmp_path / "kept", **given | {"trust": False})
    assert os.listdir(tmp_path) == []
    small(tmp_path / "kept", **given)
    gone = Place
    monkeypatch.delitem(globals(), "Place")
    monkeypatch.setattr(Placed, "start", lambda self: (0.0, 0.0))
    monkeypatch.setattr(Placed, "advance", SpringMass.advance)
    before = (tmp_path / "kept").read_bytes()
    with pytest.raises(ValueError, match=r"holds a participant's state that this program cannot read \(.*Place"):
        small(tmp_path / "kept", **given)
    assert (tmp_path / "kept").read_bytes() == before
    assert gone.__name__ == "Place"


def test_a_participant_that_cannot_go_back_is_told(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="participant that cannot repeat a window cannot continue from an old state"):
        small(tmp_path / "kept", structure=SpringMass(), scheme=hl.Explicit(tolerance=None))
    small(tmp_path / "kept", scheme=hl.Explicit(tolerance=None))
    assert os.listdir(tmp_path) == ["kept"]


def test_a_full_disk_leaves_the_checkpoint_before(tmp_path: Path) -> None:
    count = 0

    def full(_: int) -> None:
        nonlocal count
        count += 1
        if count > 50:
            raise OSError(28, "No space left on device")

    message = pytest.raises(ValueError, match=r"cannot be written \(\[Errno 28\] No space left")
    with often(), patch("os.fsync", full), message:
        CASES["full order"][0]().run(UNTIL, checkpoint=tmp_path / "kept")
    assert os.listdir(tmp_path) == ["kept"]
    check_same(run("full order", tmp_path / "kept"), run("full order"))


def writings(monkeypatch: pytest.MonkeyPatch, interval: float, each: float, work: Callable[[], Any]) -> list[float]:
    """When checkpoints were written, s, if writing takes `each` s and looking at the clock one."""
    now, written = 0.0, []

    def clock() -> float:
        nonlocal now
        now += 1.0
        return now

    def replace_file(*_: object) -> None:
        nonlocal now
        written.append(now)
        now += each

    monkeypatch.setattr(checkpoint, "INTERVAL", interval)
    monkeypatch.setattr(checkpoint, "monotonic", clock)
    monkeypatch.setattr(checkpoint.Keeper, "_replace", replace_file)
    work()
    return written


def test_checkpoints_are_apart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By the interval where writing is quick, by ten times what it takes where that is longer."""

    def work() -> None:
        hl.CoSimulation(CHAIN, ROD).run(UNTIL, checkpoint=tmp_path / "kept")

    quick = np.diff(writings(monkeypatch, 20.0, 0.0, work))
    assert quick[:-1] == pytest.approx(22.0, abs=1.0)
    slow = np.diff(writings(monkeypatch, 20.0, 5.0, work))
    assert slow[:-1] == pytest.approx(5.0 + 62.0, abs=1.0)


def test_the_compiled_loop_looks_at_the_clock(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Every 64 windows, or where saved times are further apart, at each of them."""
    monkeypatch.setattr(run_loop, "CHUNK", 64)
    monkeypatch.setattr(checkpoint, "PAUSE", 0.0)
    reduced = hl.reduce(DAMPED, until=UNTIL)
    for stride, looks in ((2, 5), (16, 5), (80, 4)):
        simulation = hl.CoSimulation(CHAIN, reduced, window=5e-7, substeps=1)
        work = partial(simulation.run, UNTIL, stride * 5e-7, checkpoint=tmp_path / "kept")
        assert len(writings(monkeypatch, 0.0, 0.0, work)) == 1 + looks


def test_going_on_is_logged(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "hertzlink"):
        small(tmp_path / "kept")
        assert "goes on" not in caplog.text
        small(tmp_path / "kept")
    assert "kept': continues after saved time 10 of 10" in caplog.text


def test_input_is_strict_json() -> None:
    """Which knows neither NaN nor infinity."""

    def refused(word: str) -> None:
        raise AssertionError(word)

    text = as_text({"law": {"order": math.nan, "largest": math.inf, "error": 1e-3}})
    assert json.loads(text, parse_constant=refused)["law"] == {"order": "NaN", "largest": "Infinity", "error": 1e-3}
