"""Results are read without a simulator, by one schema and one reader."""

import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import xarray as xr

import hertzlink as hl
from coupling.results.schema import COORDINATES, VARIABLES, kind_of

ROOT = Path(__file__).resolve().parents[2]
RESULTS = sorted(path.stem for path in (ROOT / "coupling/results").glob("[!_]*.py"))
SIMULATOR = ["skfem", "particles.chain", "particles.kernels", "plates", "coupling.interface", "coupling.cosimulation"]


@pytest.mark.thorough
def test_reading_a_result_imports_no_simulator() -> None:
    code = f"""
import sys
from importlib import import_module
for name in {RESULTS}:
    import_module("coupling.results." + name)
print([name for name in {SIMULATOR} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


BEAD = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)


def run_of(*counts: int) -> xr.Dataset:
    """Chains of so many beads, each on a half-space of its own."""
    chains = [hl.Chain([BEAD] * count, BEAD, 0.44) for count in counts]
    return hl.CoSimulation(chains, [hl.half_space(hl.PTFE) for _ in counts]).run(until=1e-4)


def test_the_kind_of_a_dataset_is_known() -> None:
    run = run_of(3)
    kinds = {
        "run": run,
        "sweep": xr.concat([run, run], "speed"),
        "batch": hl.batch(lambda n: hl.CoSimulation(hl.Chain([BEAD] * n, BEAD, 0.44), None), until=1e-4, n=[3]),
        "signal": hl.as_signal(run.time, {2: hl.sensor_force(run, 2)}),
        "": run.drop_vars("contact_force"),
    }
    assert {name: kind_of(data) for name, data in kinds.items()} == {name: name for name in kinds}


def test_every_variable_of_a_run_is_in_the_schema() -> None:
    run = run_of(3)
    for name, values in run.data_vars.items():
        assert values.attrs == {"units": VARIABLES[name].units, "long_name": VARIABLES[name].description}
        assert values.dims == ("time", *VARIABLES[name].bodies)
    assert set(run.coords) <= set(COORDINATES)


RUN = cache(lambda: run_of(3))


def sweep() -> xr.Dataset:
    return xr.concat([RUN(), RUN()], "speed")


def signal() -> xr.Dataset:
    return hl.as_signal(RUN().time, {2: hl.sensor_force(RUN(), 2)})


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hl.energy_error(None), "run = None: must be the Dataset of a run, a sweep or a signal"),
        (lambda: hl.energy_error(RUN().drop_vars("kinetic_energy")), "run: holds no kinetic_energy; must be"),
        (lambda: hl.contact_time(None), "run = None: must be the Dataset of a run, a sweep or a signal"),
        (lambda: hl.contact_time(RUN().drop_vars("contact_force")), "run: holds no contact_force; must be the Dataset"),
        (lambda: hl.contact_time(signal()), "run: is a measured signal"),
        (lambda: hl.sensor_force(signal(), 3), "sensor = 3: must be one that was measured: 2"),
        (lambda: hl.wave_speed(RUN(), 2, 2), "second = 2: must be another sensor than first"),
        (lambda: hl.wave_speed(RUN(), 2000, 2), "first = 2000: must be a bead from 1 to 3"),
        (lambda: hl.wave_speed(RUN(), 2, 1.5), r"second = 1\.5"),
        (lambda: hl.wave_speed(signal(), 2, 3), "second = 3: must be one that was measured: 2"),
        (lambda: hl.time_of_flight(RUN(), 2, wave="fourth"), "wave = 'fourth': must be one of 'primary'"),
        (lambda: hl.reflections(3, 1), "run = 3: must be the Dataset of a run, a sweep or a signal"),
        (lambda: hl.reflections(RUN(), 2, smallest=-1.0), r"smallest = -1\.0"),
        (lambda: hl.reflections(sweep(), 2), "run: has the axis speed"),
        *((lambda sensor=sensor: hl.reflections(RUN(), sensor), f"sensor = {sensor}") for sensor in (0, -1, 4, 1.5)),
    ],
)
def test_what_cannot_be_read_is_named(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def test_a_run_of_one_contact_has_no_sensor() -> None:
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    run = hl.CoSimulation(hl.Chain([bead] * 4, bead, 0.3), None).run(1e-4)
    for some in (run.isel(contact=[0]), run.isel(contact=[3])):
        with pytest.raises(ValueError, match="run: must hold the forces of both contacts"):
            hl.sensor_force(some, sensor=2)
