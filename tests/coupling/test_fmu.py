"""The chain as an FMU, run by FMPy: its description, a coupled run with rollback, what it refuses, bad input."""

import ctypes
import importlib.metadata
import importlib.util
import subprocess
import sys
import zipfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.ports.fmu import pack, unpack

fmpy = pytest.importorskip("fmpy")
pytest.importorskip("pythonfmu")
pytest.importorskip("pythonfmu3")

from fmpy import fmi2, fmi3  # noqa: E402
from fmpy.fmi1 import FMICallException  # noqa: E402
from fmpy.validation import validate_fmu  # noqa: E402

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=0.31, gravity=9.81, dissipation=hl.LinearDashpot(5.0))
ROD = hl.reduce(hl.rod([hl.Layer(hl.ACRYLIC, 0.0762, 0.0191)]), until=8e-4)
SURFACE = hl.Surface(hl.ACRYLIC)
UNTIL, WINDOW = 8e-4, 1e-6
DISCARD = 2


def softer(one: Any, other: Any) -> hl.laws.PowerLaw:
    """A law of one's own, in a module."""
    return hl.laws.PowerLaw(4e9, 1.5)


@pytest.fixture(scope="module", params=[2, 3], ids=["fmi2", "fmi3"])
def written(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return hl.write_fmu(CHAIN, SURFACE, tmp_path_factory.mktemp("fmu") / "a chain.fmu", fmi=request.param)


class Slave3(fmi3.FMU3Slave):  # type: ignore[misc]
    """FMPy's unit of FMI 3.0 by the names of FMI 2.0."""

    begin = 0.0
    getReal, setReal = fmi3.FMU3Slave.getFloat64, fmi3.FMU3Slave.setFloat64
    getInteger, setInteger = fmi3.FMU3Slave.getUInt64, fmi3.FMU3Slave.setInt32
    getFMUstate, setFMUstate = fmi3.FMU3Slave.getFMUState, fmi3.FMU3Slave.setFMUState
    freeFMUstate, serializeFMUstate = fmi3.FMU3Slave.freeFMUState, fmi3.FMU3Slave.serializeFMUState
    deSerializeFMUstate = fmi3.FMU3Slave.deserializeFMUState

    def setupExperiment(self, startTime: float) -> None:
        self.begin = startTime

    def enterInitializationMode(self) -> None:
        super().enterInitializationMode(startTime=self.begin)


class Unit:
    """What a program that opens an FMU does, by FMPy, with the names of variables and the messages on the log."""

    def __init__(self, path: Path, folder: Path) -> None:
        description = fmpy.read_model_description(str(path))
        self.references = {variable.name: variable.valueReference for variable in description.modelVariables}
        fmpy.extract(str(path), unzipdir=str(folder))
        self.log: list[tuple[int, str]] = []
        # Kept, or ctypes would free what the library still calls.
        self.callbacks = fmi2.fmi2CallbackFunctions()
        self.callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(self._told)
        self.callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
        self.callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
        self.told3 = fmi3.fmi3LogMessageCallback(lambda *said: self._told(None, b"", *said[1:]))
        named = {"unzipDirectory": str(folder), "instanceName": folder.name}
        named |= {"guid": description.guid, "modelIdentifier": description.coSimulation.modelIdentifier}
        if description.fmiVersion == "3.0":
            self.fmu = Slave3(**named)
            self.fmu.instantiate(loggingOn=True, logMessage=self.told3)
        else:
            self.fmu = fmi2.FMU2Slave(**named)
            self.fmu.instantiate(callbacks=self.callbacks, loggingOn=True)

    def _told(self, component: Any, name: bytes, status: int, category: bytes, message: bytes) -> None:
        self.log.append((status, message.decode()))

    def begin(self, **parameters: float) -> None:
        self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        for name, value in parameters.items():
            self.set(name, value)
        self.fmu.exitInitializationMode()

    def set(self, name: str, value: float) -> None:
        self.fmu.setReal([self.references[name]], [value])

    def get(self, name: str) -> float:
        return float(self.fmu.getReal([self.references[name]])[0])

    def step(self, time: float, window: float, surface: float) -> float:
        """The mean force over a step, while the surface moves to a displacement."""
        self.set("surface_displacement", surface)
        self.fmu.doStep(currentCommunicationPoint=time, communicationStepSize=window)
        return self.get("mean_contact_force")


@contextmanager
def opened(path: Path, folder: Path, **parameters: float) -> Iterator[Unit]:
    unit = Unit(path, folder)
    try:
        unit.begin(**parameters)
        yield unit
        unit.fmu.terminate()
    finally:
        unit.fmu.freeInstance()


@pytest.fixture
def unit(written: Path, tmp_path: Path) -> Iterator[Unit]:
    with opened(written, tmp_path / "unit") as one:
        yield one


def coupled(
    unit: Unit, structure: hl.stepping.MovingStructure, windows: int, tolerance: float
) -> dict[str, list[float]]:
    """A secant on the mean force of each window: both sides are taken back to its start as often as it needs."""
    found: dict[str, list[float]] = {"contact_force": [], "sensor_force[7]": [], "surface": []}
    before, force, surface = structure.start(), 0.0, 0.0
    for window in range(windows):
        saved, tried, last = unit.fmu.getFMUstate(), force, (np.nan, np.nan)
        for _ in range(30):
            moved, surface = structure.advance(before, tried, WINDOW)
            unit.fmu.setFMUstate(saved)
            force = unit.step(window * WINDOW, WINDOW, surface)
            residual = force - tried
            if abs(residual) <= tolerance:
                break
            slope = (residual - last[1]) / (tried - last[0])
            last, tried = (tried, residual), tried - residual / (slope if slope < -0.5 else -1.0)
        else:
            raise AssertionError(f"window {window}: residual {residual:.3g} N")
        unit.fmu.freeFMUstate(saved)
        before = moved
        for name in ("contact_force", "sensor_force[7]"):
            found[name].append(unit.get(name))
        found["surface"].append(surface)
    return found


def ratio(time: Any, force: Any) -> float:
    return float(hl.amplitude_ratio(hl.as_signal(time, {7: force}), sensor=7))


def check_same_as_cosimulation(found: dict[str, list[float]], run: xr.Dataset) -> None:
    contact = (run.contact_force - run.static_force).isel(contact=-1).values[1:]
    sensor = hl.sensor_force(run, 7).values[1:]
    scale = contact.max()
    assert np.array(found["contact_force"]) == pytest.approx(contact, abs=1e-9 * scale)
    assert np.array(found["sensor_force[7]"]) == pytest.approx(sensor, abs=1e-9 * scale)
    assert np.array(found["surface"]) == pytest.approx(
        run.surface_displacement.values[1:], abs=1e-9 * abs(run.surface_displacement).max().item()
    )
    time = run.time.values[1:]
    assert ratio(time, found["sensor_force[7]"]) == pytest.approx(ratio(time, sensor), rel=1e-9)
    assert ratio(time, sensor) == pytest.approx(hl.amplitude_ratio(run, sensor=7).item(), abs=0.01)


def test_with_rollback_it_runs_as_cosimulation_does(unit: Unit) -> None:
    """FMPy and a secant against our structure, CoSimulation with Aitken's iteration: the same to 1e-9."""
    run = hl.CoSimulation(CHAIN, ROD, scheme=hl.Aitken(tolerance=1e-11), window=WINDOW, substeps=1).run(UNTIL)
    tolerance = 1e-11 * hl.stepping.MovingChain(CHAIN, SURFACE).force_scale
    check_same_as_cosimulation(coupled(unit, hl.stepping.MovingStructure(ROD), round(UNTIL / WINDOW), tolerance), run)


def test_fmpy_finds_no_fault_in_it(written: Path) -> None:
    """FMPy's checks: the standard's schema, names, start values, the model's structure, units."""
    assert validate_fmu(str(written)) == []
    description = fmpy.read_model_description(str(written))
    assert description.coSimulation.canGetAndSetFMUstate
    assert description.coSimulation.canSerializeFMUstate
    assert description.coSimulation.canHandleVariableCommunicationStepSize
    units = {variable.name: variable.unit for variable in description.modelVariables}
    assert units["surface_displacement"] == "m"
    assert units["impact_speed"] == "m/s"
    assert {units[f"sensor_force[{bead}]"] for bead in range(1, 21)} == {"N"}


def test_the_description_says_what_is_calculated(written: Path) -> None:
    """Outputs depend on the parameter, also at the start."""
    description = fmpy.read_model_description(str(written))
    outputs = [one.variable.name for one in description.outputs]
    assert len(outputs) == 22
    assert [one.variable.name for one in description.initialUnknowns] == outputs
    initial = {one.name: (one.initial, one.start is None) for one in description.modelVariables}
    assert {initial[name] for name in outputs} == {("calculated", True)}
    assert initial["impact_speed"] == ("exact", False)
    experiment, moving = description.defaultExperiment, hl.stepping.MovingChain(CHAIN, SURFACE)
    assert float(experiment.stopTime) == pytest.approx(4.0 * moving.transit_time, rel=0.05)
    assert 0.0 < float(experiment.tolerance) <= 1e-3
    with zipfile.ZipFile(written) as archive:
        assert b"surface_displacement" in archive.read("documentation/index.html")


def test_fmpy_runs_it_alone(written: Path) -> None:
    """Against a surface that stands still, with FMPy's own loop and the step that the FMU proposes."""
    found = fmpy.simulate_fmu(str(written), stop_time=3e-4, output=["sensor_force[7]"])
    moving = hl.stepping.MovingChain(CHAIN, SURFACE)
    exact = hl.CoSimulation(CHAIN, hl.half_space(hl.ACRYLIC), window=moving.contact_time / 64, substeps=1).run(3e-4)
    assert found["sensor_force[7]"].max() == pytest.approx(hl.reflections(exact, 7).incident.amplitude, rel=1e-4)  # type: ignore[union-attr]


@pytest.mark.skipif(sys.platform == "darwin", reason="the libraries are for Linux and Windows")
def test_ecos_gets_the_same_forces(written: Path) -> None:
    """Ecos, a program in C++ with an FMI library of its own, moves the chain against a surface that stands still."""
    for file in importlib.metadata.files("tbb") if importlib.util.find_spec("ecospy") else ():
        if file.name in ("libtbb.so.12", "tbb12.dll"):
            ctypes.CDLL(str(file.locate()), ctypes.RTLD_GLOBAL)  # Ecos is linked with it, and its package lacks it
    ecos = pytest.importorskip("ecospy")
    structure = ecos.EcosSimulationStructure()
    structure.add_model("chain", str(written))
    moving = hl.stepping.MovingChain(CHAIN, SURFACE)
    state, forces, exact = moving.start(), [], []
    with ecos.EcosSimulation(structure=structure, step_size=1e-6) as simulation:
        simulation.init()
        for _ in range(400):
            simulation.step(1)
            forces.append(simulation.get_real("chain::mean_contact_force"))
            state, force = moving.advance(state, (0.0, 0.0), 1e-6)
            exact.append(force)
    assert max(exact) > 10.0
    assert forces == pytest.approx(exact, rel=1e-9, abs=1e-9 * max(exact))


def test_steps_may_differ_in_length(unit: Unit) -> None:
    """The surface moves on one line, so a step and its parts come to the same, and so do their impulses."""
    start = unit.fmu.getFMUstate()
    whole = unit.step(0.0, 4e-6, 2e-7)
    end = [unit.get(f"sensor_force[{bead}]") for bead in range(1, 21)]
    unit.fmu.setFMUstate(start)
    parts = [(0.0, 1e-6, 0.5e-7), (1e-6, 2.5e-6, 1.75e-7), (3.5e-6, 0.5e-6, 2e-7)]
    impulse = sum(unit.step(*part) * part[1] for part in parts)
    assert impulse == pytest.approx(whole * 4e-6, rel=1e-5)
    assert [unit.get(f"sensor_force[{bead}]") for bead in range(1, 21)] == pytest.approx(end, rel=1e-5, abs=1e-6)


def test_a_state_survives_as_bytes_in_another_instance(unit: Unit, written: Path, tmp_path: Path) -> None:
    unit.step(0.0, 1e-5, 1e-7)
    saved = unit.fmu.getFMUstate()
    text = unit.fmu.serializeFMUstate(saved)
    expected = unit.step(1e-5, 1e-6, 2e-7)
    with opened(written, tmp_path / "other") as other:
        other.fmu.setFMUstate(other.fmu.deSerializeFMUstate(text))
        assert other.get("surface_displacement") == 1e-7
        assert other.step(1e-5, 1e-6, 2e-7) == expected


def test_a_state_carries_the_parameter(unit: Unit, written: Path, tmp_path: Path) -> None:
    """In a unit with another impact speed the chain goes on as before, and so do its steps."""
    with opened(written, tmp_path / "fast", impact_speed=0.9) as fast:
        fast.step(0.0, 1e-5, 0.0)
        text = fast.fmu.serializeFMUstate(fast.fmu.getFMUstate())
        expected = fast.step(1e-5, 1e-4, 1e-7), fast.get("sensor_force[3]")
    unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(text))
    assert unit.get("impact_speed") == 0.9
    assert (unit.step(1e-5, 1e-4, 1e-7), unit.get("sensor_force[3]")) == expected


@pytest.mark.parametrize("text", [b"", b"{}\n", b"another program's state"])
def test_bytes_that_are_no_state_are_refused(unit: Unit, text: bytes) -> None:
    unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(text))
    assert any(status == 3 and message.startswith("state: ") for status, message in unit.log)
    with pytest.raises(FMICallException) as refused:
        unit.step(0.0, 1e-6, 0.0)
    assert refused.value.status == DISCARD


def test_a_state_of_another_chain_is_refused(unit: Unit, tmp_path: Path) -> None:
    short = hl.write_fmu(hl.Chain([BEAD] * 3, BEAD, impact_speed=0.5), SURFACE, tmp_path / "short.fmu")
    with opened(short, tmp_path / "short") as other:
        text = other.fmu.serializeFMUstate(other.fmu.getFMUstate())
    good = unit.fmu.getFMUstate()
    unit.fmu.setFMUstate(unit.fmu.deSerializeFMUstate(text))
    assert any("state: is none of this chain" in message for _, message in unit.log)
    assert unit.get("impact_speed") == 0.31
    unit.fmu.setFMUstate(good)
    unit.step(0.0, 1e-6, 0.0)


@pytest.mark.parametrize("start", [0.0, 1.0])
@pytest.mark.parametrize("rest", [5e-20, 1e-18])
def test_a_rest_of_rounding_is_no_step(written: Path, tmp_path: Path, start: float, rest: float) -> None:
    """The opening program's clock ends a little beside its stop time, and the unit's own elsewhere."""
    with opened(written, tmp_path / "unit") as unit:
        unit.fmu.reset()
        unit.fmu.setupExperiment(startTime=start)
        unit.fmu.enterInitializationMode()
        unit.fmu.exitInitializationMode()
        for n in range(30):
            last = unit.step(start + n * 1e-7, 1e-7, 1e-9 * n)
        assert unit.step(start + 30 * 1e-7, rest, 5e-8) == last
        assert np.isfinite(unit.step(start + 30 * 1e-7 + rest, 1e-7, 6e-8))


def test_two_units_and_a_reset_do_not_disturb_each_other(unit: Unit, tmp_path: Path) -> None:
    """Of different chains, in one process, where Python holds their module once."""
    long = hl.Chain([BEAD] * 3, striker=BEAD, impact_speed=1.0)
    first = unit.step(0.0, 1e-5, 0.0), unit.get("sensor_force[1]")
    with opened(hl.write_fmu(long, SURFACE, tmp_path / "three.fmu"), tmp_path / "three") as other:
        other.step(0.0, 1e-5, 0.0)
        assert other.get("sensor_force[1]") > 2.0 * first[1]
    unit.fmu.reset()
    unit.begin()
    assert (unit.step(0.0, 1e-5, 0.0), unit.get("sensor_force[1]")) == first


def test_the_impact_speed_is_a_parameter(written: Path, tmp_path: Path) -> None:
    faster = hl.CoSimulation(
        hl.Chain([BEAD] * 20, BEAD, 0.5, gravity=9.81, dissipation=hl.LinearDashpot(5.0)),
        hl.half_space(hl.ACRYLIC),
        window=1e-5,
        dt=1e-8,
    ).run(until=1e-5)
    with opened(written, tmp_path / "unit", impact_speed=0.5) as unit:
        unit.step(0.0, 1e-5, 0.0)
        assert unit.get("sensor_force[1]") == pytest.approx(hl.sensor_force(faster, 1).values[-1], rel=1e-4)


REFUSED: dict[str, Callable[[Unit], Any]] = {
    "surface displacement = nan: must be a finite number": lambda unit: unit.step(1e-7, 1e-6, np.nan),
    "window = -1e-06: must be a positive number": lambda unit: unit.step(1e-7, -1e-6, 0.0),
    "current_time = 0.001: must be where the last step ended": lambda unit: unit.step(1e-3, 1e-6, 0.0),
    "is no longer finite": lambda unit: unit.step(1e-7, 1e-6, -1e99),
}


@pytest.mark.parametrize("message", REFUSED)
@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning", "ignore:invalid:RuntimeWarning")
def test_a_step_that_cannot_be_is_refused_and_changes_nothing(unit: Unit, message: str) -> None:
    unit.step(0.0, 1e-7, 0.0)
    with pytest.raises(FMICallException) as refused:
        REFUSED[message](unit)
    assert refused.value.status == DISCARD
    assert any(status == 3 and message in text for status, text in unit.log)
    assert unit.get("mean_contact_force") == 0.0
    unit.step(1e-7, 1e-5, 0.0)
    assert unit.get("sensor_force[1]") > 1.0


def test_a_parameter_that_cannot_be_is_told_and_refuses_all_steps(written: Path, tmp_path: Path) -> None:
    message = "impact_speed = -1.0: must be a positive number"
    with opened(written, tmp_path / "unit", impact_speed=-1.0) as unit:
        assert any(status == 3 and message in text for status, text in unit.log)
        unit.log.clear()
        with pytest.raises(FMICallException) as refused:
            unit.step(0.0, 1e-6, 0.0)
        assert refused.value.status == DISCARD
        assert any(message in text for _, text in unit.log)
        unit.fmu.reset()
        unit.begin(impact_speed=1.0)
        unit.step(0.0, 1e-6, 0.0)
        assert unit.get("sensor_force[1]") > 0.0


ILLEGAL: dict[str, Callable[[Unit], Any]] = {
    "impact_speed = 0.9: is fixed once the unit is initialised": lambda unit: unit.set("impact_speed", 0.9),
    "contact_force = 1.0: cannot be set": lambda unit: unit.set("contact_force", 1.0),
    "sensor_force[7] = 1.0: cannot be set": lambda unit: unit.set("sensor_force[7]", 1.0),
    "variable 99 = 1.0: cannot be set": lambda unit: unit.fmu.setReal([99], [1.0]),
    "variable 99: is none of this unit": lambda unit: unit.fmu.getReal([99]),
    "variable 0: is no int": lambda unit: unit.fmu.setInteger([0], [1]),
    "variable 98: is no": lambda unit: unit.fmu.getInteger([98]),
    "variable 0: is no boolean": lambda unit: unit.fmu.getBoolean([0]),
    "variable 3: is no string": lambda unit: unit.fmu.setString([3], ["1"]),
}


@pytest.mark.parametrize("message", ILLEGAL)
def test_what_cannot_be_set_is_refused_and_no_step_follows(unit: Unit, message: str) -> None:
    """Nothing changes; a state from before ends it."""
    before, force = unit.fmu.getFMUstate(), unit.get("contact_force")
    ILLEGAL[message](unit)
    assert any(status == 3 and message in text for status, text in unit.log)
    assert (unit.get("impact_speed"), unit.get("contact_force")) == (0.31, force)
    with pytest.raises(FMICallException) as refused:
        unit.step(0.0, 1e-6, 0.0)
    assert refused.value.status == DISCARD
    unit.fmu.setFMUstate(before)
    unit.step(0.0, 1e-6, 0.0)


def test_outputs_follow_the_parameter_during_the_initialisation(written: Path, tmp_path: Path) -> None:
    unit = Unit(written, tmp_path / "unit")
    unit.fmu.setupExperiment(startTime=0.0)
    unit.fmu.enterInitializationMode()
    first = unit.get("sensor_force[1]")
    unit.set("impact_speed", 1.0)
    assert unit.get("sensor_force[1]") > 2.0 * first > 0.0
    unit.fmu.exitInitializationMode()
    unit.fmu.freeInstance()


@pytest.mark.parametrize("name", ["ü", "50 %", "it's", "a#b", 'a"b', "日本"])
def test_folders_in_which_it_cannot_be_unpacked_are_named(tmp_path: Path, name: str) -> None:
    folder = tmp_path / name
    folder.mkdir()
    with pytest.warns(hl.HertzlinkWarning, match="a program that unpacks the FMU in this folder crashes") as caught:
        hl.write_fmu(CHAIN, SURFACE, folder / "chain.fmu")
    assert str(caught[0].message).startswith(repr(str(folder.resolve())))


def test_with_fmi_3_any_folder_serves(tmp_path: Path) -> None:
    (tmp_path / "ü").mkdir()
    with opened(hl.write_fmu(CHAIN, SURFACE, tmp_path / "ü" / "chain.fmu", fmi=3), tmp_path / "ü" / "50 %") as unit:
        unit.step(0.0, 1e-5, 0.0)
        assert unit.get("sensor_force[1]") > 1.0


def test_the_folder_of_temporary_files_counts_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ü").mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path / "ü"))
    with pytest.warns(hl.HertzlinkWarning, match="a program that unpacks the FMU in this folder crashes"):
        hl.write_fmu(CHAIN, SURFACE, tmp_path / "chain.fmu")


@pytest.mark.thorough
def test_another_version_of_hertzlink_is_told(tmp_path: Path) -> None:
    """In a process of its own: nothing may follow a failed start."""
    script = (
        "import importlib.metadata, fmpy, hertzlink as hl\n"
        "bead = hl.Sphere(4.76e-3, hl.STEEL_440C)\n"
        "hl.write_fmu(hl.Chain([bead] * 2, bead, 1.0), hl.Surface(hl.PTFE), 'chain.fmu')\n"
        "importlib.metadata.version = lambda name: '99.0'\n"
        "fmpy.simulate_fmu('chain.fmu', debug_logging=True)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert "not 99.0: write the FMU again" in done.stdout
    assert "Failed to instantiate" in done.stderr


def test_laws_of_ones_own_and_other_excitations_go_along(tmp_path: Path) -> None:
    chain = hl.Chain([BEAD] * 5, hl.PushedBead([0.0, 1e-5, 2e-5], [0.0, 50.0, 0.0]), law=softer)
    path = hl.write_fmu(chain, SURFACE, tmp_path / "pushed.fmu", flexibility=1e-9, dt=2e-8)
    moving = hl.stepping.MovingChain(chain, SURFACE, 1e-9, 2e-8)
    _, force = moving.advance(moving.start(), (0.0, 1e-7), 2e-4)
    with opened(path, tmp_path / "unit") as unit:
        assert "impact_speed" not in unit.references
        assert unit.step(0.0, 2e-4, 1e-7) == force
    assert force > 0.1


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the library for Linux")
def test_its_library_brings_no_python(written: Path, tmp_path: Path) -> None:
    """It takes that of the program that opens it, so it fits any, and cannot be loaded where there is none."""
    with zipfile.ZipFile(written) as archive:
        name = next(name for name in archive.namelist() if name.endswith(".so"))
        library = archive.extract(name, tmp_path)
    needed = subprocess.run(["ldd", library], capture_output=True, text=True, check=True).stdout
    assert "libc.so" in needed
    assert "libpython3" not in needed
    assert hasattr(ctypes.PyDLL(library), "fmi3DoStep" if "x86_64-linux" in name else "fmi2DoStep")


def test_writing_leaves_nothing_behind(tmp_path: Path) -> None:
    path, modules = sys.path.copy(), set(sys.modules)
    target = tmp_path / "chain.fmu"
    target.write_text("an older file")
    assert hl.write_fmu(CHAIN, SURFACE, str(target)) == target
    assert [one.name for one in tmp_path.iterdir()] == ["chain.fmu"]
    assert zipfile.is_zipfile(target)
    assert sys.path == path
    assert not any("hertzlink_chain" in name for name in set(sys.modules) - modules)


def test_a_path_of_the_users_own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("HOME", str(tmp_path))
    assert hl.write_fmu(CHAIN, SURFACE, "~/chain.fmu") == tmp_path / "chain.fmu"
    assert zipfile.is_zipfile(tmp_path / "chain.fmu")


def test_a_failure_leaves_the_older_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(*_: Any, **__: Any) -> None:
        raise OSError("disk full")

    target = tmp_path / "chain.fmu"
    target.write_text("an older file")
    monkeypatch.setattr("zipfile.ZipFile", fails)
    with pytest.raises(OSError, match="disk full"):
        hl.write_fmu(CHAIN, SURFACE, target)
    assert [one.name for one in tmp_path.iterdir()] == ["chain.fmu"]
    assert target.read_text() == "an older file"


class Local(hl.Sphere):
    """A bead of a class of one's own."""


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"path": "chain.zip"}, "path = 'chain.zip': must be the name of a file that ends in .fmu"),
        ({"path": 3}, "path = 3: must be the name of a file"),
        ({"path": "none/chain.fmu"}, "path = 'none/chain.fmu': its folder does not exist"),
        ({"path": "null\0.fmu"}, r"path = 'null\\x00\.fmu': must be the name of a file"),
        ({"path": "/proc/chain.fmu"}, "path = '/proc/chain.fmu': its folder (cannot be written|does not exist)"),
        ({"path": "folder.fmu"}, "path = 'folder.fmu': is a folder"),
        ({"chain": [BEAD]}, "chain = .*: must be a Chain"),
        ({"surface": ROD}, r"surface = Structure[\s\S]*: must be a Surface"),
        ({"dt": 1.0}, "dt = 1.0: too large for a stable step"),
        ({"flexibility": np.nan}, "flexibility = nan: must be a finite number"),
        ({"chain": hl.Chain([Local(4.76e-3, hl.PTFE)], BEAD, 1.0)}, "chain: does not fit into an FMU"),
        ({"trust": 1}, "trust = 1: must be True or False"),
        ({"fmi": 4}, "fmi = 4: must be 2 or 3, for FMI 2.0 or 3.0"),
        ({"fmi": 2.0}, "fmi = 2.0: must be 2 or 3"),
    ],
)
def test_bad_input(changed: dict[str, Any], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder.fmu").mkdir()
    with pytest.raises(ValueError, match=message):
        hl.write_fmu(**{"chain": CHAIN, "surface": SURFACE, "path": "chain.fmu", **changed})
    assert [one.name for one in tmp_path.iterdir()] == ["folder.fmu"]


@dataclass(frozen=True)
class Heavier(hl.Sphere):
    """A bead of a class of one's own."""


OWN = replace(CHAIN, beads=[Heavier(4.76e-3, hl.STEEL_440C)] * 3)


def test_classes_of_ones_own_need_trust(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"does not fit into an FMU: it holds at \['chain'\].*Heavier.*trust=True"):
        hl.write_fmu(OWN, SURFACE, tmp_path / "chain.fmu")
    assert not list(tmp_path.iterdir())
    path = hl.write_fmu(OWN, SURFACE, tmp_path / "chain.fmu", trust=True)
    moving = hl.stepping.MovingChain(OWN, SURFACE)
    with opened(path, tmp_path / "unit") as unit:
        assert unit.step(0.0, 1e-4, 1e-7) == moving.advance(moving.start(), (0.0, 1e-7), 1e-4)[1]


@pytest.mark.thorough
def test_a_class_of_the_script_itself_is_refused(tmp_path: Path) -> None:
    """Another Python would not find it: there, __main__ is another script. A law is no problem: it is data."""
    script = (
        "import hertzlink as hl\n"
        "class Own(hl.Sphere): pass\n"
        "def law(one, other): return hl.laws.PowerLaw(4e9, 1.5)\n"
        "bead = hl.Sphere(4.76e-3, hl.STEEL_440C)\n"
        "hl.write_fmu(hl.Chain([bead] * 2, bead, 1.0, law=law), hl.Surface(hl.PTFE), 'law.fmu')\n"
        "own = Own(4.76e-3, hl.STEEL_440C)\n"
        "hl.write_fmu(hl.Chain([own] * 2, own, 1.0), hl.Surface(hl.PTFE), 'chain.fmu', trust=True)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], cwd=tmp_path, capture_output=True, text=True)
    assert "ValueError: chain: a class of your own must be defined in a module" in done.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["law.fmu"]


def test_every_kind_of_chain_is_data() -> None:
    """Beads, losses, excitations and laws of all kinds are read back as they were."""
    steel, table = hl.STEEL_440C, hl.laws.TabulatedLaw([1e-6, 1e-5, 2e-5], [10.0, 316.2, 894.0])
    beads = [BEAD, hl.HollowSphere(4e-3, 3e-3, hl.BRASS_360), hl.Cylinder(5e-3, 9e-3, steel, angle=0.5)]
    beads += [hl.Ellipsoid(4e-3, 5e-3, steel)]
    losses = [hl.PowerDashpot(5.0, 1.5), hl.MassProportional(10.0), hl.KuwabaraKono(1e-6), hl.Tsuji(0.1)]
    chains = [hl.Chain([BEAD] * 2, BEAD, 0.3, dissipation=loss) for loss in (*losses, hl.Restitution(0.9), None)]
    chains += [hl.Chain(beads, BEAD, 0.3, 9.81, integrator="rk4", preload=1.0, inclination=0.1)]
    chains += [hl.Chain(beads, hl.SpringLoaded(BEAD, 1e3, 1e-3)), hl.Chain(beads, hl.Piston((0.0, 1.0), (0.0, 1e-6)))]
    chains += [hl.Chain([BEAD] * 2, BEAD, 0.3, law=law) for law in (table, hl.laws.PowerLaw(1e9, 1.6))]
    chains += [hl.DeformableChain([BEAD] * 2, BEAD, 0.3, modes=3)]
    for chain in chains:
        read, facing = unpack(pack(chain, SURFACE, 1e-9, 1e-8, trust=False), trust=False)
        assert read == chain
        assert type(read) is type(chain)
        assert facing == {"surface": SURFACE, "flexibility": 1e-9, "dt": 1e-8}


def test_every_described_part_of_a_chain_is_read_back() -> None:
    """A bead, loss, excitation, law or damping that is declared later needs no line here."""
    script = (
        "from coupling.ports.fmu import TYPES\n"
        "import hertzlink._described\n"
        "from structures.described import registered\n"
        "parts = [of.target for of in registered() if isinstance(of.target, type)]\n"
        "homes = 'particles.', 'structures.damping'\n"
        "of_chains = [part.__name__ for part in parts if part.__module__.startswith(homes)]\n"
        "print(len(of_chains) > 20, *sorted({*of_chains} - {*TYPES}), *sorted({*TYPES} - {*of_chains}))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    # A theory of waves is no part of a chain.
    assert done.stdout.split() == ["True", "UniformChain", "KnownLaws", "Material", "Surface"]


@pytest.mark.parametrize(("fmi", "kit"), [(2, "pythonfmu"), (3, "pythonfmu3")])
def test_a_missing_pythonfmu_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, fmi: int, kit: str) -> None:
    monkeypatch.setitem(sys.modules, kit, None)
    with pytest.raises(ImportError, match=rf'needs {kit} .*pip install "hertzlink\[fmu\]"'):
        hl.write_fmu(CHAIN, SURFACE, tmp_path / "chain.fmu", fmi=fmi)


@pytest.mark.parametrize(("law", "said"), [(None, 1), (hl.laws.JacksonGreen(), 0), (hl.laws.Thornton(), 0)])
def test_metals_that_yield(law: Any, said: int, tmp_path: Path, recwarn: pytest.WarningsRecorder) -> None:
    """An elastic unit warns with the law that cures it, and a unit takes that law as data."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 6, bead, 0.31, law=law)
    assert hl.write_fmu(chain, hl.Surface(hl.BRASS_360), tmp_path / "chain.fmu").is_file()
    found = [str(one.message) for one in recwarn if "yield" in str(one.message)]
    assert ["brass 360 to about 5.6 times" in one and "JacksonGreen()" in one for one in found] == [True] * said
