"""Participants that fail in the middle of a sweep with a store: only their points are lost, until the next sweep."""

import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
UNTIL = 1e-4
FAULTS = ("raises", "hangs", "none", "grows", "is not finite", "sound too")
FOLDER = "FAULTY_PARTICIPANTS"
"""The environment variable with the folder for marks: arguments would be axes of the sweep."""


class SpringMass:
    """A mass on a spring by the implicit midpoint, which fails as it is first pushed by more than 5 N."""

    surface = hl.Surface(hl.STEEL_440C)
    mass, stiffness = 0.0141, 1.7e7

    def __init__(self, fault: str) -> None:
        self.fault = fault

    def start(self) -> tuple[float, float]:
        return 0.0, 0.0

    def advance(self, state: tuple[float, float], force: float, window: float) -> tuple[Any, float]:
        if force > 5.0:
            self.fail()
        u, v = state
        middle = (self.mass * v + window / 2.0 * (force - self.stiffness * u)) / (
            self.mass + window**2 / 4.0 * self.stiffness
        )
        place = u + window * middle
        if force > 5.0 and self.fault == "grows":
            place += 1.0
        if force > 5.0 and self.fault == "is not finite":
            place = np.nan
        return (place, 2.0 * middle - v), place

    def fail(self) -> None:
        """Raise, or wait until a mark allows to go on."""
        if self.fault == "raises":
            raise RuntimeError("the solver lost its licence")
        folder = Path(os.environ[FOLDER])
        while self.fault == "hangs" and not (folder / "go on").exists():
            time.sleep(0.02)


def build(fault: str) -> hl.CoSimulation:
    with (Path(os.environ[FOLDER]) / "begun").open("a") as file:
        file.write(fault + "\n")
    chain = hl.Chain([BEAD] * 3, striker=BEAD, impact_speed=0.31)
    return hl.CoSimulation(chain, SpringMass(fault), hl.Aitken(), window=1e-6)


def swept(jobs: int = 1, **changes: Any) -> xr.Dataset:
    store = Path(os.environ[FOLDER]) / "store"
    return hl.sweep(build, UNTIL, **{"jobs": jobs, "store": store, "fault": list(FAULTS), **changes})


def stored(folder: Path, count: int, process: "subprocess.Popen[bytes]") -> None:
    """Wait until a store holds so many points, while the sweep's process lives."""
    while len([path for path in folder.glob("store/*") if path.name[0] != "." and path.name != "sweep.json"]) < count:
        assert process.poll() is None
        time.sleep(0.05)


@pytest.mark.thorough
def test_faults_cost_their_own_points_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """One hangs, so its process is killed. The next sweep runs that point alone, and no bit differs."""
    monkeypatch.setenv(FOLDER, str(tmp_path))
    paths = os.pathsep.join([str(Path(__file__).parent), *sys.path])
    command = [sys.executable, "-c", "import test_faulty_participants as test; test.swept(jobs=2)"]
    with subprocess.Popen(command, env={**os.environ, "PYTHONPATH": paths}) as process:
        stored(tmp_path, len(FAULTS) - 1, process)
        process.kill()
    (tmp_path / "go on").touch()
    runs = swept()
    begun = (tmp_path / "begun").read_text().splitlines()
    assert sorted(begun) == sorted([*FAULTS, "hangs"])
    for fault, message in {
        "raises": "RuntimeError: the solver lost its licence",
        "grows": "NotConverged: window",
        "is not finite": "SpringMass.advance returned",
    }.items():
        assert message in runs.error.sel(fault=fault).item()
    good = ["none", "hangs", "sound too"]
    assert (runs.error.sel(fault=good) == "").all()
    straight = swept(store=None, fault=good)
    assert np.array_equal(runs.contact_force.sel(fault=good), straight.contact_force)
