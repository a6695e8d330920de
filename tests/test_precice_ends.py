"""Both ends of a preCICE coupling, from a case file: a double of preCICE couples two threads of this process."""

import re
import subprocess
import sys
import warnings
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import Queue
from types import ModuleType

import numpy as np
import pytest
import xarray as xr
from command import ended
from numpy.typing import NDArray

import hertzlink as hl
from coupling.ports.precice import STEPS_PER_CONTACT
from hertzlink.cases.case import read

CASE = """
run.until = "0.5 ms"
measure.sensor = 6

[chain]
beads = 12
bead = { shape = "sphere", radius = "4.76 mm", material = "steel 440C" }
impact_speed = 0.3

[structure]
kind = "rod"
layers = [{ material = "acrylic", length = "30 mm", radius = "9.525 mm" }]
"""

PATIENCE = 60.0
"""s, after which a test fails if its other end does not answer."""


class Coupling:
    """What preCICE does between a structure and a chain: serial-implicit, the structure first, Aitken's relaxation."""

    def __init__(self, window: float, until: float) -> None:
        self.window, self.windows = window, round(until / window)
        self.to_chain, self.to_structure = Queue[float](), Queue[tuple[bool, float]]()


class End:
    """A participant, whose mesh has one vertex and scalar data."""

    coupling: Coupling

    def __init__(self, name: str, configuration: str, rank: int, size: int) -> None:
        assert Path(configuration).name == "precice-config.xml"
        self.name, self.done, self.repeats, self.used, self.factor, self.last = name, 0, False, 0.0, 0.5, 0.0
        self.surface, self.end, self.value, self.count = 0.0, 0.0, 0.0, 0

    def get_mesh_dimensions(self, mesh: str) -> int:
        assert mesh == f"{self.name}-Mesh"
        return 3

    def get_data_dimensions(self, mesh: str, data: str) -> int:
        return 1

    def set_mesh_vertices(self, mesh: str, places: NDArray[np.float64]) -> NDArray[np.int32]:
        assert places.shape == (1, 3)
        return np.array([0], dtype=np.int32)

    def requires_initial_data(self) -> bool:
        return False

    def initialize(self) -> None:
        if self.name == "Chain":
            self.end = self.coupling.to_chain.get(timeout=PATIENCE)

    def is_coupling_ongoing(self) -> bool:
        return self.done < self.coupling.windows

    def requires_writing_checkpoint(self) -> bool:
        return self.count == 0

    def get_max_time_step_size(self) -> float:
        return self.coupling.window

    def read_data(self, mesh: str, data: str, ids: NDArray[np.int32], time: float) -> NDArray[np.float64]:
        assert data == ("Displacement" if self.name == "Chain" else "Force")
        if self.name == "Structure":
            return np.array([self.used])
        return np.array([self.surface + (self.end - self.surface) * time / self.coupling.window])

    def write_data(self, mesh: str, data: str, ids: NDArray[np.int32], values: NDArray[np.float64]) -> None:
        assert data == ("Force" if self.name == "Chain" else "Displacement")
        self.value = float(values[0])

    def advance(self, step: float) -> None:
        assert step == self.coupling.window
        self.count += 1
        if self.name == "Structure":
            self.coupling.to_chain.put(self.value)
            accepted, self.used = self.coupling.to_structure.get(timeout=PATIENCE)
        else:
            accepted = self._relax()
            self.coupling.to_structure.put((accepted, self.used))
            if accepted:
                self.surface = self.end
            if self.done + accepted < self.coupling.windows:
                self.end = self.coupling.to_chain.get(timeout=PATIENCE)
        self.repeats = not accepted
        self.done, self.count = self.done + accepted, 0 if accepted else self.count

    def _relax(self) -> bool:
        residual = self.value - self.used
        if abs(residual) <= 1e-9:
            self.used = self.value
            return True
        self.factor = -self.factor * self.last / (residual - self.last) if self.count > 1 else 0.5
        self.used, self.last = self.used + self.factor * residual, residual
        return False

    def requires_reading_checkpoint(self) -> bool:
        return self.repeats

    def is_time_window_complete(self) -> bool:
        return not self.repeats

    def finalize(self) -> None:
        self.done = self.coupling.windows


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder that the command writes for a case."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "tap.toml").write_text(CASE)
    assert ended("precice", "tap.toml") == 0
    return tmp_path / "tap-precice"


def value_of(folder: Path, tag: str, name: str = "value") -> list[float]:
    text = (folder / "precice-config.xml").read_text("utf-8")
    return [float(number) for number in re.findall(rf'<{tag}\b[^>]*\b{name}="([^"]+)"', text)]


def test_the_configuration_is_that_of_the_case(folder: Path) -> None:
    """Its record, a window of 1/64 of a contact, and limits above those that preCICE refuses."""
    side = read(str(folder / "case.toml"))[0].simulation().interface.chains[0]
    assert value_of(folder, "max-time") == [5e-4]
    assert value_of(folder, "time-window-size") == pytest.approx([side.contact_time / STEPS_PER_CONTACT])
    assert min(value_of(folder, "absolute-or-relative-convergence-measure", "abs-limit")) > 1e-14


def test_precice_finds_no_fault_in_the_configuration(folder: Path) -> None:
    """preCICE's own checker of configurations."""
    pytest.importorskip("preciceconfigcheck")
    check = [sys.executable, "-m", "preciceconfigcheck.cli", str(folder / "precice-config.xml")]
    done = subprocess.run(check, capture_output=True, text=True, check=False)
    assert (done.returncode, "No issues found" in done.stdout) == (0, True), done.stdout


def test_both_ends_together_are_the_run_of_the_case(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The force of both ends is that of the co-simulation with the same windows."""
    simulation = read(str(folder / "case.toml"))[0].simulation()
    side, (window,) = simulation.interface.chains[0], value_of(folder, "time-window-size")
    module = ModuleType("precice")
    module.Participant = type("Participant", (End,), {"coupling": Coupling(window, 5e-4)})  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "precice", module)
    assert side.surface is not None
    with warnings.catch_warnings(action="ignore"), ThreadPoolExecutor(1) as threads:
        chain = threads.submit(hl.run_in_precice, side.chain, folder / "precice-config.xml", side.surface)
        assert ended("precice", str(folder / "case.toml"), "--participant", "Structure", "--output", "end") == 0
        run = chain.result(timeout=PATIENCE)
        expected = simulation.replace(scheme=hl.Aitken(1e-11), window=window).run(float(run.time[-1]))
    with xr.open_dataset("end/results.nc") as end:
        peak = float(abs(expected.contact_force).max())
        assert run.contact_force.values == pytest.approx(expected.contact_force.values, abs=1e-9 * peak)
        place = expected.surface_displacement.values.ravel()
        assert end.surface_displacement.values.ravel() == pytest.approx(place, abs=1e-8 * abs(place).max())
        assert float(end.interface_work[-1]) == pytest.approx(float(run.interface_work[-1]), rel=1e-8)


@pytest.mark.parametrize(
    ("change", "reason"),
    [('chain.bead.radius=["4 mm", "5 mm"]', "chain.bead.radius"), ("measure.sensor=40", "40 is not a bead")],
)
def test_a_case_that_cannot_be_coupled(
    folder: Path, change: str, reason: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert ended("precice", str(folder / "case.toml"), "--set", change) == 2
    assert reason in capsys.readouterr().err


def test_a_sweep_is_refused(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (folder / "sweep.toml").write_text(CASE + '\n[sweep]\n"chain.impact_speed" = [0.2, 0.3]\n')
    assert ended("precice", str(folder / "sweep.toml"), "--output", "other") == 2
    assert "preCICE couples a single run" in capsys.readouterr().err
    assert not Path("other").exists()


def test_an_end_outside_its_folder_says_where_to_go(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    Path("rod.toml").write_text(CASE)
    for cure in ("hertzlink precice rod.toml writes it", "cd rod-precice"):
        assert ended("precice", "rod.toml", "--participant", "Chain") == 2
        assert f"precice-config.xml: there is no such file; {cure}" in capsys.readouterr().err
        Path("rod-precice").mkdir(exist_ok=True)
        Path("rod-precice/precice-config.xml").write_text("")


def test_several_contacts_need_their_places() -> None:
    edges = hl.Supports("clamped", "clamped", "clamped", "clamped")
    plate = hl.kirchhoff_plate(0.2, 0.15, 3e-3, hl.ALUMINIUM_6061, edges).at([0.05, 0.15], [0.07, 0.07])
    with pytest.raises(ValueError, match="positions = None: must hold 2 positions, one for each contact"):
        hl.run_in_precice(plate, __file__)
