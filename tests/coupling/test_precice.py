"""The chain in preCICE, against a double of its Python bindings: the order of calls, numbers, bad input.

The double does what a live preCICE 3.4.1 was seen to do: it divides as Aitken's formula does, counts data below 1e-14
as zero, accepts a window after max-iterations without a message, and leaves the other participant waiting if this one
does not end the coupling.
"""

import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import xarray as xr
from numpy.typing import NDArray

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=0.31, gravity=9.81)
SURFACE = hl.Surface(hl.ACRYLIC)
ROD = hl.reduce(hl.rod([hl.Layer(hl.ACRYLIC, 0.0762, 0.0191)]), until=8e-4)
WINDOW = 1e-6
ZERO, STILL = 1e-14, 1e-22
"""N, rounding of the static force; and m, the motion that such a force causes in a window."""
MOVING = hl.stepping.MovingChain(CHAIN, SURFACE)


class OutOfOrder(RuntimeError):
    """preCICE stops with an error of its own."""


class Double:
    """A preCICE 3 participant whose partner is a structure, and which stops a caller that leaves the documented order.

    (Documentation of the Python bindings 3, and of preCICE, "couple your code".) Displacements are linear over a window
    and the last written force counts, as with waveform-degree 1 and 0. Implicit: the window is repeated, with
    Aitken's relaxation of the force, until the force changes by less than the tolerance. With the chain first, the
    displacement is relaxed, until force and displacement change by less than that part of themselves (`relative`).
    """

    def __init__(self, name: str, configuration: str, rank: int, size: int) -> None:
        assert (name, rank, size) == (self.called[0], 0, 1)
        assert Path(configuration).is_file()
        self.calls = ["Participant"]
        self.state, self.elapsed, self.windows = "made", 0.0, 0
        self.wrote = self.asked_to_write = self.asked_to_read = self.must_read = False
        self.structure = hl.stepping.MovingStructure(ROD)
        self.before, self.surface, self.used, self.factor, self.last = self.structure.start(), 0.0, 0.0, 0.5, 0.0
        self.force, self.count, self.before_last = 0.0, 0, 0.0
        assert self.tolerance > ZERO, "limits of 1e-14 and below are refused"
        self.moved, self.end = self.structure.advance(self.before, 0.0, self.window)
        type(self).latest = self

    # What a test chooses.
    implicit, dimensions, until, tolerance, initial, axis = True, 3, 8e-4, 1e-11 * MOVING.scales[0], False, 2
    called: tuple[str, ...] = ("Chain", "Chain-Mesh", "Displacement", "Force")
    sizes = (1, 1)
    most, scale, window, always_complete = 50, 1.0, WINDOW, False
    relative: float | None = None
    latest: "Double"

    def _call(self, name: str, *states: str) -> None:
        self.calls.append(name)
        if self.state not in states:
            raise OutOfOrder(f"{name} is not allowed now: {self.state}")
        if self.must_read and not self.asked_to_read and name != "requires_reading_checkpoint":
            raise OutOfOrder(f"{name} before requires_reading_checkpoint")

    def get_mesh_dimensions(self, mesh: str) -> int:
        self._call("get_mesh_dimensions", "made", "running")
        assert mesh == self.called[1]
        return self.dimensions

    def get_data_dimensions(self, mesh: str, data: str) -> int:
        self._call("get_data_dimensions", "made", "running")
        assert mesh == self.called[1]
        return self.sizes[self.called.index(data) - 2]

    def set_mesh_vertices(self, mesh: str, positions: NDArray[np.float64]) -> NDArray[np.int32]:
        self._call("set_mesh_vertices", "made")
        assert positions.shape == (1, self.dimensions)
        self.positions = positions
        return np.array([7], dtype=np.int32)

    def requires_initial_data(self) -> bool:
        self._call("requires_initial_data", "made")
        return self.initial

    def initialize(self) -> None:
        self._call("initialize", "made")
        if not hasattr(self, "positions"):
            raise OutOfOrder("initialize before set_mesh_vertices")
        if self.initial and not self.wrote:
            raise OutOfOrder("initialize without initial data")
        self.state, self.wrote = "running", False

    def is_coupling_ongoing(self) -> bool:
        self._call("is_coupling_ongoing", "running", "over")
        return self.state == "running"

    def requires_writing_checkpoint(self) -> bool:
        self._call("requires_writing_checkpoint", "running")
        self.asked_to_write = True
        return self.implicit and self.elapsed == 0.0 and self.count == 0

    def requires_reading_checkpoint(self) -> bool:
        self._call("requires_reading_checkpoint", "running", "over")
        self.asked_to_read = True
        return self.must_read

    def is_time_window_complete(self) -> bool:
        self._call("is_time_window_complete", "running", "over")
        return self.always_complete or (self.elapsed == 0.0 and self.count == 0)

    def get_max_time_step_size(self) -> float:
        self._call("get_max_time_step_size", "running")
        return self.window - self.elapsed

    def read_data(self, mesh: str, data: str, ids: NDArray[np.int32], time: float) -> NDArray[np.float64]:
        self._call("read_data", "running")
        assert (mesh, data, ids.tolist()) == (*self.called[1:3], [7])
        if not 0.0 <= time <= (self.window - self.elapsed) * (1.0 + 1e-12):
            raise OutOfOrder(f"read_data at {time} s, beyond the window")
        value = self.scale * (self.surface + (self.end - self.surface) * (self.elapsed + time) / self.window)
        if self.sizes[0] == 1:
            return np.array([value])
        vector = np.zeros((1, self.dimensions))
        vector[0, self.axis] = -value
        return vector

    def write_data(self, mesh: str, data: str, ids: NDArray[np.int32], values: NDArray[np.float64]) -> None:
        self._call("write_data", "made", "running")
        assert (mesh, data, ids.tolist()) == (self.called[1], self.called[3], [7])
        vector = self.sizes[1] > 1
        assert np.shape(values) == ((1, self.dimensions) if vector else (1,))
        self.force, self.wrote = float(-values[0, self.axis] if vector else values[0]), True

    def advance(self, step: float) -> None:
        self._call("advance", "running")
        if not self.wrote:
            raise OutOfOrder("advance without data")
        if self.implicit and not self.asked_to_write and self.elapsed == 0.0 and self.count == 0:
            raise OutOfOrder("advance before requires_writing_checkpoint")
        assert 0.0 < step <= (self.window - self.elapsed) * (1.0 + 1e-12)
        self.elapsed += step
        self.wrote = self.asked_to_write = self.asked_to_read = self.must_read = False
        if self.elapsed > self.window * (1.0 - 1e-9):
            self.elapsed = 0.0
            self._iterate() if self.implicit else self._accept()

    def _iterate(self) -> None:
        self.count += 1
        assert self.count <= 50
        if self.relative is None:
            self._relax_force()
        else:
            self._relax_displacement(self.relative)
        self.must_read = self.count != 0

    def _relax_force(self) -> None:
        residual = self.force - self.used
        if abs(residual) <= self.tolerance or self.count == self.most:
            self._accept()
            return
        if self.count > 1:
            self._aitken(residual)
        self.used, self.last = self.used + self.factor * residual, residual
        self.moved, self.end = self.structure.advance(self.before, self.used, self.window)

    def _relax_displacement(self, relative: float) -> None:
        felt = self.force if abs(self.force) > ZERO else 0.0
        self.moved, end = self.structure.advance(self.before, felt, self.window)
        residual, change, self.before_last = end - self.end, self.force - self.before_last, self.force
        # preCICE's absolute-or-relative measure: a motion by the rounding of a force has no correct digits.
        still = abs(residual) <= max(relative * abs(end), STILL)
        if still and abs(change) <= max(relative * abs(self.force), ZERO):
            self._accept()
            return
        if self.count > 1:
            self._aitken(residual)
        self.end, self.last = self.end + self.factor * residual, residual

    def _aitken(self, residual: float) -> None:
        """Aitken's factor; where nothing changes it is 0/0."""
        with np.errstate(invalid="ignore", divide="ignore"):
            self.factor = float(-self.factor * np.divide(self.last, residual - self.last))

    def _accept(self) -> None:
        """The next window begins with the force of this one, or with the displacement at its end."""
        self.before, self.surface, self.used, self.factor, self.count = self.moved, self.end, self.force, 0.5, 0
        if self.relative is None:
            self.moved, self.end = self.structure.advance(self.before, self.used, self.window)
        self.windows += 1
        if self.windows == round(self.until / self.window):
            self.state = "over"

    def finalize(self) -> None:
        self._call("finalize", "made", "running", "over")
        self.state = "finalized"


CONFIGURATION = """<precice-configuration>
  <coupling-scheme:serial-implicit>
    <participants first="Fluid" second="Solid" /> <max-iterations value="1" />
  </coupling-scheme:serial-implicit>
  <coupling-scheme:serial-implicit>
    <participants first="Structure" second="Chain" />
    <!-- <max-iterations value="1" /> -->
    <max-iterations value="{}" />
  </coupling-scheme:serial-implicit>
</precice-configuration>
"""


@pytest.fixture
def double(monkeypatch: pytest.MonkeyPatch) -> type[Double]:
    """A fresh kind of double, as the module `precice`."""
    kind = type("Participant", (Double,), {})
    module = ModuleType("precice")
    module.Participant = kind  # type: ignore[attr-defined]
    module.get_version_information = lambda: b"3.4.1;revision;"  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "precice", module)
    return kind


@pytest.fixture
def configuration(tmp_path: Path) -> Path:
    path = tmp_path / "precice-config.xml"
    path.write_text("<precice-configuration/>")
    return path


@pytest.fixture(scope="module")
def cosimulation() -> xr.Dataset:
    return hl.CoSimulation(CHAIN, ROD, scheme=hl.Aitken(tolerance=1e-11), window=WINDOW).run(8e-4)


def check_same(run: xr.Dataset, expected: xr.Dataset, tolerance: float) -> None:
    for name in ("displacement", "velocity", "contact_force", "surface_displacement"):
        scale = float(abs(expected[name]).max())
        assert run[name].values == pytest.approx(expected[name].values, abs=tolerance * scale)


def test_implicit_coupling_gives_what_cosimulation_gives(
    double: type[Double], configuration: Path, cosimulation: xr.Dataset
) -> None:
    run = hl.run_in_precice(CHAIN, configuration, SURFACE)
    assert double.latest.state == "finalized"
    assert run.time.values == pytest.approx(cosimulation.time.values, rel=1e-12, abs=1e-15)
    check_same(run, cosimulation, 1e-9)
    for sensor in (7, 12):
        coupled, theirs = (hl.reflections(one, sensor) for one in (run, cosimulation))
        assert coupled.primary
        assert theirs.primary
        assert coupled.primary.amplitude_ratio == pytest.approx(theirs.primary.amplitude_ratio, rel=1e-9)
        assert coupled.primary.arrival == pytest.approx(theirs.primary.arrival, rel=1e-9)
    assert double.latest.calls.count("advance") > 1.5 * double.latest.windows


@pytest.mark.thorough
def test_shorter_steps_than_the_window_of_precice_change_nothing(double: type[Double], configuration: Path) -> None:
    """A quarter of the window or less: the same line of the surface, the same impulse over the window."""
    dt = WINDOW / 60
    run = hl.run_in_precice(CHAIN, configuration, SURFACE, window=0.26e-6, dt=dt)
    expected = hl.CoSimulation(CHAIN, ROD, scheme=hl.Aitken(tolerance=1e-11), window=WINDOW, dt=dt).run(8e-4)
    assert np.diff(run.time.values) == pytest.approx(WINDOW / 4, rel=1e-6)
    check_same(run.isel(time=slice(None, None, 4)), expected, 1e-7)


@pytest.mark.parametrize("sizes", [(3, 3), (1, 3)])
def test_vectors_are_taken_along_the_direction(
    double: type[Double], configuration: Path, cosimulation: xr.Dataset, sizes: tuple[int, int]
) -> None:
    """The data have other names; the chain pushes down, z points up. A displacement may be a scalar beside a force."""
    double.called, double.sizes, double.until = ("Beads", "Tip", "w", "F"), sizes, 4e-4
    names = {"participant": "Beads", "mesh": "Tip", "displacement": "w", "force": "F"}
    given = {"direction": (0, 0, -2.0), "positions": [(0.1, 0.2, 0.0)]}
    run = hl.run_in_precice(CHAIN, configuration, SURFACE, names, **given)
    check_same(run, cosimulation.isel(time=slice(401)), 1e-9)
    assert double.latest.positions.tolist() == [[0.1, 0.2, 0.0]]


def test_relative_measures_with_the_chain_first(
    double: type[Double], configuration: Path, cosimulation: xr.Dataset
) -> None:
    """At rest the rounding of the force, 4e-16 N, would change by 100 %, and Aitken's factor would be NaN."""
    double.relative, double.until = 1e-12, 4e-4
    run = hl.run_in_precice(CHAIN, configuration, SURFACE)
    check_same(run, cosimulation.isel(time=slice(401)), 1e-9)
    assert (run.contact_force.isel(time=slice(1, 3), contact=-1) == run.static_force[-1]).all()


def test_windows_that_do_not_converge_are_counted(
    double: type[Double], configuration: Path, cosimulation: xr.Dataset
) -> None:
    """preCICE accepts them without a message after max-iterations; AR is then off by 5e-4."""
    double.most = 2
    configuration.write_text(CONFIGURATION.format(2))
    with pytest.warns(hl.HertzlinkWarning, match=r"^max-iterations = 2: \d{3} of 800 windows used all of them and"):
        run = hl.run_in_precice(CHAIN, configuration, SURFACE)
    assert "max-iterations" in run.attrs["warnings"]
    assert run.evaluations.max() == 2
    wrong, right = (float(hl.amplitude_ratio(one, sensor=7)) for one in (run, cosimulation))
    assert abs(wrong / right - 1.0) > 2e-4
    double.most = 50
    configuration.write_text(CONFIGURATION.format(50))
    run = hl.run_in_precice(CHAIN, configuration, SURFACE)
    assert "max-iterations" not in run.attrs["warnings"]
    assert run.evaluations.sum() == double.latest.calls.count("advance")
    assert 0.0 < run.residual.max() < 1e-4 * MOVING.scales[0]
    for name in ("interface_work", "interface_impulse"):
        scale = float(abs(cosimulation[name]).max())
        assert run[name].values == pytest.approx(cosimulation[name].values, abs=1e-9 * scale)


def test_a_coarse_window_is_reported(double: type[Double], configuration: Path) -> None:
    """As in CoSimulation, it is one of fewer than eight in a contact. The chain's steps in it are 1/64 of a contact."""
    double.window, double.until = 1e-5, 2e-4
    with pytest.warns(hl.HertzlinkWarning, match=r"time-window-size = 10 µs: is coarse .* take at most 4\.63 µs"):
        run = hl.run_in_precice(CHAIN, configuration, SURFACE)
    assert np.diff(run.time.values).max() <= MOVING.contact_time / 64
    assert run.evaluations.values[1:18].tolist() == [0.0] * 17


def test_the_chain_chooses_the_window_where_precice_leaves_it(double: type[Double], configuration: Path) -> None:
    """With the method first-participant, preCICE gives the time that is left."""
    double.implicit, double.until, double.window = False, 4e-4, 4e-4
    double.always_complete = True
    run = hl.run_in_precice(CHAIN, configuration, SURFACE)
    assert np.diff(run.time.values) == pytest.approx(MOVING.contact_time / 64, rel=0.02)
    assert "coarse" not in run.attrs["warnings"]


def test_a_partner_that_creates_energy_is_reported(double: type[Double], configuration: Path) -> None:
    """It moves against the force."""
    double.scale, double.implicit = -1.0, False
    with pytest.warns(hl.HertzlinkWarning, match="energy: the structure gave back more than it was given"):
        run = hl.run_in_precice(CHAIN, configuration, SURFACE)
    assert run.attrs["precice"] == "preCICE 3.4.1, pyprecice not installed"


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning", "ignore:invalid:RuntimeWarning")
def test_an_error_of_the_chain_ends_the_partner_too(double: type[Double], configuration: Path) -> None:
    double.scale = -1e118
    with pytest.raises(FloatingPointError, match="is no longer finite"):
        hl.run_in_precice(CHAIN, configuration, SURFACE)
    assert double.latest.state == "finalized"


def test_explicit_coupling_answers_one_window_later(double: type[Double], configuration: Path) -> None:
    """Each window the structure moves under the force of the window before."""
    double.implicit, double.until = False, 2e-4
    run = hl.run_in_precice(CHAIN, configuration, SURFACE)
    structure = hl.stepping.MovingStructure(ROD)
    chain, body, surface, force = MOVING.start(), structure.start(), 0.0, 0.0
    for _ in range(200):
        body, end = structure.advance(body, force, WINDOW)
        chain, force = MOVING.advance(chain, (surface, end), WINDOW)
        surface = end
    assert run.velocity.values[-1] == pytest.approx(chain.velocity, rel=1e-12, abs=1e-15)
    assert run.surface_displacement.values[-1] == pytest.approx(surface, rel=1e-12)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"body": None}, "body = None: must be a Chain or a Structure"),
        ({"surface": None}, "surface = None: must be a Surface"),
        ({"surface": "steel"}, "surface = 'steel': must be a Surface"),
        ({"configuration": "none.xml"}, "configuration = 'none.xml': there is no such file"),
        ({"configuration": 3}, "configuration = 3: must be the name of a file"),
        ({"names": {"mehs": "A"}}, r"names = 'mehs': must be one of .* \(did you mean 'mesh'\?\)"),
        ({"names": {"mesh": 1}}, r"names\['mesh'\] = 1: must be a name in the configuration"),
        ({"names": "Chain"}, "names = 'Chain': must be a mapping"),
        ({"positions": [(0.0, 1.0)]}, r"positions\[0\] = \(0.0, 1.0\): must hold 3 numbers"),
        ({"direction": (0, 0, -1)}, r"direction = \(0, 0, -1\): must be None, since displacement and force"),
        ({"window": 0.0}, "window = 0.0: must be a positive number"),
        ({"sizes": (3, 3)}, "direction = None: must be 3 numbers, not all zero, because the data are vectors"),
        ({"sizes": (3, 3), "direction": (0.0, 1.0)}, r"direction = \(0.0, 1.0\): must hold 3 numbers"),
        ({"sizes": (3, 3), "direction": (0.0, 0.0, 0.0)}, r"direction = .*: must be 3 numbers, not all zero"),
        ({"sizes": (3, 3), "direction": (0.0, np.nan, 0.0)}, "direction = nan: must be a finite number"),
    ],
)
def test_bad_input(double: type[Double], configuration: Path, changed: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"body": CHAIN, "surface": SURFACE, "configuration": configuration, **changed}
    double.sizes = given.pop("sizes", (1, 1))
    with pytest.raises(ValueError, match=message):
        hl.run_in_precice(**given)
    if hasattr(double, "latest"):  # a partner that waits for the connection gets it, and then its end
        assert double.latest.calls[-2:] == ["initialize", "finalize"]
        assert double.latest.state == "finalized"


def test_missing_and_old_bindings_are_named(monkeypatch: pytest.MonkeyPatch, configuration: Path) -> None:
    monkeypatch.setitem(sys.modules, "precice", None)
    with pytest.raises(ImportError, match=r'install preCICE 3, then pip install "hertzlink\[precice\]"'):
        hl.run_in_precice(CHAIN, configuration, SURFACE)
    monkeypatch.setitem(sys.modules, "precice", ModuleType("precice"))
    with pytest.raises(ImportError, match="version 3"):
        hl.run_in_precice(CHAIN, configuration, SURFACE)
