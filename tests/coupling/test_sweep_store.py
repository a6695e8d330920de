"""Sweeps with a store: nothing lost, nothing run twice, failing points apart, changes noticed; and on a cluster."""

import importlib
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import joblib
import numpy as np
import psutil
import pytest
import xarray as xr

import hertzlink as hl
from coupling.sweeps.points import Task, _begin
from coupling.sweeps.store import Store, identity
from structures.kernels import compiling

UNTIL = 1e-4
RADII = [2e-3, 3e-3, 4e-3]
MATERIALS = [hl.PTFE, hl.ACRYLIC]
called: list[tuple[str, float]] = []
"""Points that were run in this process."""


def note(point: tuple[str, float]) -> None:
    sys.modules[__name__].called.append(point)  # type: ignore[attr-defined]


def build(material: hl.Material, radius: float) -> hl.CoSimulation:
    note((material.name, radius))
    bead = hl.Sphere(radius, hl.STEEL_440C)
    return hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.3, gravity=9.81), hl.half_space(material))


def largest(run: xr.Dataset) -> xr.Dataset:
    """Measures of every kind that a file can keep."""
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
    usual = {"build": build, "until": UNTIL, "jobs": 1, "material": MATERIALS, "radius": RADII, "store": store}
    return hl.sweep(**{**usual, **changes})  # type: ignore[arg-type]


@pytest.fixture(autouse=True)
def _forget_calls() -> None:
    called.clear()


def unwarned(runs: xr.Dataset) -> xr.Dataset:
    """A sweep without its attribute of warnings, which counts points and names one by its axes in their order."""
    return runs.assign_attrs(warnings="")


@pytest.mark.parametrize("measure", [None, largest])
def test_a_store_changes_no_bit(tmp_path: Path, measure: object) -> None:
    """Straight without a store, straight with it, and read back."""
    plain = swept(measure=measure)
    kept, resumed = (swept(tmp_path / "store", measure=measure) for _ in range(2))
    assert len(called) == 12
    for runs in (kept, resumed):
        xr.testing.assert_identical(runs, plain)
        for name in plain.variables:
            assert runs[name].values.tobytes() == plain[name].values.tobytes() or runs[name].dtype == object
    assert len(list((tmp_path / "store").iterdir())) == 6


def test_longer_axes_run_the_new_points_alone(tmp_path: Path) -> None:
    swept(tmp_path, radius=RADII[1:], material=MATERIALS[:1])
    called.clear()
    grown = swept(tmp_path)
    assert called == [("PTFE", 2e-3), *(("acrylic", radius) for radius in RADII)]
    turned = hl.sweep(build, UNTIL, jobs=1, store=tmp_path, radius=np.array(RADII), material=MATERIALS)
    assert len(called) == 4
    swept(tmp_path, measure=largest)
    assert len(called) == 10
    assert unwarned(turned.transpose(*grown.dims)).identical(unwarned(grown))


@pytest.mark.thorough
def test_results_of_other_sources_of_hertzlink_are_run_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    swept(tmp_path)
    monkeypatch.setattr("coupling.sweeps.store.own_sources", lambda: "others")
    swept(tmp_path)
    assert len(called) == 12


def test_failing_points_stand_apart(tmp_path: Path) -> None:
    radii = [-1.0, 2e-3, 3e-3]
    with pytest.warns(hl.HertzlinkWarning, match="2 of 6 points failed"):
        runs = swept(tmp_path, measure=largest, radius=radii)
    assert runs.warnings.startswith("sweep: 2 of 6 points failed, see the variable error")
    assert runs.error.dims == ("material", "radius")
    assert runs.error.sel(radius=-1.0).str.startswith("ValueError: radius = -1.0").all()
    assert (runs.error.sel(radius=RADII[:2]) == "").all()
    good = swept(measure=largest, radius=RADII[:2])
    found = runs.sel(radius=RADII[:2])
    for name in ("force", "frames", "single", "missing"):
        assert np.array_equal(found[name].values, good[name].values, equal_nan=True)
        assert runs[name].sel(radius=-1.0).isnull().all()
    assert (runs.label.sel(radius=-1.0) == "").all()
    called.clear()
    assert swept(tmp_path, measure=largest, radius=radii).identical(runs)
    assert called == []
    swept(tmp_path, measure=largest, radius=radii, retry=True)
    assert called == [("PTFE", -1.0), ("acrylic", -1.0)]
    with pytest.raises(RuntimeError, match=r"all 2 points failed.*retry=True.*ValueError: radius = -1"):
        swept(tmp_path, radius=[-1.0])


def with_a_function(run: xr.Dataset) -> xr.Dataset:
    return xr.Dataset({"a": ((), 1.0, {"known": len})})


def reserved(run: xr.Dataset) -> xr.Dataset:
    return xr.Dataset({"error": ((), 1.0)})


@pytest.mark.parametrize(
    ("measure", "message"), [(with_a_function, "what a netCDF file cannot hold"), (reserved, "must not return 'error'")]
)
def test_what_a_file_cannot_keep_fails(tmp_path: Path, measure: object, message: str) -> None:
    with pytest.raises(RuntimeError, match=message):
        swept(tmp_path, measure=measure)
    assert not list(tmp_path.glob(".*"))


def lacking(folder: str, radius: float) -> hl.CoSimulation:
    """The run at 3 mm finds the disk full until a file is there."""
    if radius == 3e-3 and not (Path(folder) / "mended").exists():
        raise OSError(28, "No space left")
    return build(hl.PTFE, radius)


def test_a_failure_of_the_environment_is_not_kept(tmp_path: Path) -> None:
    """It ends the sweep; what is finished stays, and the next sweep runs the point again."""
    with pytest.raises(OSError, match="No space left") as caught:
        hl.sweep(lacking, UNTIL, jobs=1, store=tmp_path / "store", folder=[str(tmp_path)], radius=RADII)
    assert "radius = 0.003" in " ".join(caught.value.__notes__)
    (tmp_path / "mended").touch()
    called.clear()
    runs = hl.sweep(lacking, UNTIL, jobs=1, store=tmp_path / "store", folder=[str(tmp_path)], radius=RADII)
    assert "error" not in runs
    assert [radius for _, radius in called] == RADII[1:]


@pytest.mark.parametrize("cut", [True, False])
def test_a_damaged_file_is_named_and_left(tmp_path: Path, cut: bool) -> None:
    swept(tmp_path, measure=largest, material=[hl.PTFE], radius=[2e-3])
    (path,) = tmp_path.iterdir()
    broken = path.read_bytes()[:1000] if cut else b"\0" * 1000
    path.write_bytes(broken)
    with pytest.raises(ValueError, match=f"{path.name} is damaged .*delete it"):
        swept(tmp_path, measure=largest, material=[hl.PTFE], radius=[2e-3])
    assert path.read_bytes() == broken


@pytest.mark.parametrize("error", [PermissionError(13, "Permission denied"), OSError(5, "Input/output error")])
def test_a_file_that_may_not_be_read_is_not_called_damaged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: OSError
) -> None:
    swept(tmp_path, material=[hl.PTFE], radius=[2e-3])

    def refused(self: Path, mode: str) -> None:
        raise error

    monkeypatch.setattr(Path, "open", refused)
    with pytest.raises(ValueError, match=rf"cannot be read \({error.strerror}\)"):
        swept(tmp_path, material=[hl.PTFE], radius=[2e-3])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"material": [(part for part in "ab")]}, "store: cannot tell whether"),
        ({"build": eval("lambda material, radius: None")}, "store: the source of .* cannot be read"),
        ({"store": "file/store"}, r"store = '.*store': must be a writable folder; Not a directory"),
        ({"store": "none/store"}, r"store = '.*store': must be a writable folder; No such file"),
        ({"lenght": [1.0]}, r"build = .*: takes material, radius, but the axes are .*lenght \(got an unexpected"),
        ({"retry": 1}, "retry = 1"),
        ({"retry": True, "store": None}, "retry = True: needs the store"),
        ({"error": [1.0]}, "error is a name"),
    ],
)
def test_bad_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, changes: dict[str, object], message: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(ValueError, match=message):
        swept(**{"store": tmp_path / "store", **changes})  # type: ignore[arg-type]
    assert called == []


@dataclass(frozen=True)
class Case:
    name: str
    sizes: tuple[float, ...]


def test_objects_are_told_apart() -> None:
    """They differ by class and by everything that builds them."""
    bead = hl.Sphere(2e-3, hl.PTFE)
    values = [bead, hl.Sphere(2e-3, hl.ACRYLIC), hl.HollowSphere(2e-3, 1e-3, hl.PTFE), hl.Chain([bead] * 2, bead, 0.3)]
    values += [hl.Chain([bead] * 2, bead, 0.4), Case("a", (1.0,)), {"name": "a", "sizes": [1.0]}, ["a", [1.0]]]
    values += [np.arange(3.0), np.arange(3), partial(build, hl.PTFE), partial(build, hl.MATERIALS["nylon"])]
    values += [hl.rod([hl.Layer(hl.PTFE, 0.1, 0.01)])]
    assert len({repr(identity(value)) for value in values}) == len(values)


OUTSIDE = (
    "EXTRA = 0.0\ndef own(value):\n    return value\n",
    "import further\ndef extra():\n    return further.own(further.EXTRA)\n",
    "LATE = 1.0\n",
    """
from functools import cache
import hertzlink as hl
import numpy as np
import settings

SPEED, TABLE, LEVELS, PART = 0.3, {"wall": [hl.PTFE]}, np.linspace(0.0, 1.0, 50), 0.5


class Scaled:
    @property
    def scale(self):
        return doubled(1.0)


class Part(Scaled):

    def bead(self, radius=1e-3):
        return hl.Sphere(radius * self.scale, hl.STEEL_440C)


def doubled(number):
    return 2.0 * number


@cache
def half(number, *, part=PART):
    return part * number


def factory(preload):
    def build(length):
        from late import LATE
        bead = Part().bead(half(2e-3) + settings.extra())
        chain = hl.Chain([bead] * 3, bead, SPEED * LATE + 0.0 * LEVELS[0], preload=preload)
        return hl.CoSimulation(chain, hl.half_space(TABLE["wall"][0]))
    return build


build = factory(1.0)
""",
)
"""The modules `further`, `settings`, `late`, which a function imports, and `outside`."""


def test_what_a_builder_uses_from_outside_counts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Each change gives another file; the same sources give the same."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setattr(sys, "dont_write_bytecode", True)  # Python takes edits within a second for the same file

    def named(change: tuple[str, str] = ("", "")) -> str:
        for name, text in zip(("further", "settings", "late", "outside"), OUTSIDE, strict=True):
            (tmp_path / f"{name}.py").write_text(text.replace(*change) if change[0] else text)
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        outside = importlib.import_module("outside")
        return Store(tmp_path / "store", outside.build, UNTIL).path({"length": 1.0}).name

    before = named()
    assert named() == before
    changes = [
        ("PART = 0.3", "PART = 0.31"), ("[hl.PTFE]", "[hl.ACRYLIC]"),
        ("0.0, 1.0, 50", "0.0, 1.1, 50"), ("doubled(1.0)", "doubled(1.1)"), ("2.0 * number", "2.1 * number"),
        ("radius=1e-3", "radius=2e-3"),
        ("50), 0.5", "50), 0.6"), ("factory(1.0)", "factory(1.5)"), ("[bead] * 3", "[bead] * 4"),
        ("return value", "return 2.0 * value"), ("EXTRA = 0.0", "EXTRA = 1e-4"),
        ("LATE = 1.0", "LATE = 2.0"),
    ]  # fmt: skip
    assert len({before, *map(named, changes)}) == len(changes) + 1


SCRIPT = """
import time
import hertzlink as hl

def build(material, radius):
    with open("runs", "a") as file:
        file.write(f"{material.name} {radius}\\n")
    time.sleep(0.03)
    if radius == 5e-3:
        raise ValueError("five")
    bead = hl.Sphere(radius, hl.STEEL_440C)
    return hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.3, gravity=9.81), hl.half_space(material))

def forces(run):
    return run[["contact_force"]]

def run(jobs, store, radii=[1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3]):
    materials = [hl.PTFE, hl.ACRYLIC, hl.MATERIALS["nylon"], hl.MATERIALS["copper"], hl.STEEL_316]
    return hl.sweep(build, 1e-4, jobs=jobs, store=store, measure=forces, material=materials, radius=radii)
"""


@pytest.mark.thorough
def test_killed_sweeps_resume(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Killed at random moments, in one process and in two: a finished point is never run again, and no bit differs."""
    (tmp_path / "swept_script.py").write_text(SCRIPT)
    monkeypatch.chdir(tmp_path)
    monkeypatch.syspath_prepend(tmp_path)
    import swept_script  # type: ignore[import-not-found]

    store, chance = tmp_path / "store", random.Random(1)
    for jobs in (1, 1, 2):
        target = len(list(store.glob("*.nc"))) + chance.randint(2, 6)
        command = [sys.executable, "-c", f"import swept_script; swept_script.run({jobs}, 'store')"]
        with subprocess.Popen(command, env={**os.environ, "PYTHONPATH": os.pathsep.join([".", *sys.path])}) as process:
            while len(list(store.glob("*.nc"))) < target:
                assert process.poll() is None
                time.sleep(0.01)
            time.sleep(chance.uniform(0.0, 0.1))
            workers = psutil.Process(process.pid).children(recursive=True)
            process.send_signal(signal.SIGKILL)
            process.wait()
        # Its other processes end, too.
        assert not psutil.wait_procs(workers, timeout=60)[1]
    resumed = swept_script.run(1, store)
    runs = Counter((tmp_path / "runs").read_text().splitlines())
    assert len(runs) == 30
    # Each kill loses the running points; two processes have two more in the queue of each.
    assert sum(runs.values()) <= 30 + 1 + 1 + 6
    assert (resumed.error.sel(radius=5e-3) == "ValueError: five").all()
    radii = [1e-3, 2e-3, 3e-3, 4e-3, 6e-3]
    straight = swept_script.run(1, None, radii)
    assert unwarned(resumed.sel(radius=radii).drop_vars("error")).identical(unwarned(straight))


@pytest.mark.thorough
def test_kernels_that_are_compiled_are_said_once(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """The process that starts the others says it; those do not."""
    monkeypatch.setattr(compiling, "EMPTY", True)
    compiling.say.cache_clear()
    swept(jobs=2, radius=RADII[:1])
    assert caplog.text.count("compiling kernels") == 1
    _begin(0)
    assert not compiling.EMPTY


@pytest.fixture
def cluster() -> Iterator[None]:
    distributed = pytest.importorskip("distributed")
    local = {"n_workers": 2, "threads_per_worker": 1, "host": "127.0.0.1", "dashboard_address": None}
    with distributed.LocalCluster(**local) as cluster, distributed.Client(cluster), joblib.parallel_config("dask"):
        yield


@pytest.mark.thorough
@pytest.mark.usefixtures("cluster")
def test_a_cluster_changes_nothing(tmp_path: Path) -> None:
    """Functions of a test are sent too; workers with other sources are refused."""

    def here(material: hl.Material, radius: float) -> hl.CoSimulation:
        bead = hl.Sphere(radius, hl.STEEL_440C)
        return hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.3), hl.half_space(material))

    plain = swept(build=here)
    assert swept(build=here, jobs=None).identical(plain)
    assert swept(tmp_path / "store", build=here, jobs=None).identical(plain)
    assert len(list((tmp_path / "store").glob("*.nc"))) == 6


def test_workers_with_other_sources_are_refused() -> None:
    with pytest.raises(RuntimeError, match="a worker has other sources of hertzlink"):
        Task(build, UNTIL, sources="of another commit").outcomes([])
