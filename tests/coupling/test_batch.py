"""Batches: each chain as if it ran alone, whatever its neighbours and the number of threads."""

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from particles.dissipation import Dissipation
from structures.caution import collected

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
WALL, STONE = hl.half_space(hl.STEEL_440C), hl.half_space(hl.STEEL_440C)


def chain(speed: float = 0.44, loss: Dissipation | None = None, **keywords: object) -> hl.Chain:
    return hl.Chain([BEAD] * 20, BEAD, speed, dissipation=loss, **keywords)  # type: ignore[arg-type]


SMALL = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.05, 9.525e-3)]), until=4e-4)


def tap(speed: float, loss: float = 0.0) -> hl.CoSimulation:
    return hl.CoSimulation(chain(speed, hl.LinearDashpot(loss) if loss else None), SMALL)


def test_a_batch_on_a_structure_is_its_runs() -> None:
    """The same bits, for parameters of all sorts, and with the sampling of the first run."""
    speeds, losses = [0.3, 0.44], [0.0, 5.0]
    runs = hl.batch(tap, until=4e-4, save_every=1e-6, speed=speeds, loss=losses)
    for i, (speed, loss) in enumerate(zip(speeds, losses, strict=True)):
        alone = tap(speed, loss).run(until=4e-4, save_every=1e-6)
        for name in ("contact_force", "velocity"):
            assert np.array_equal(runs[name][i].values, alone[name].values)
    assert runs.speed.values.tolist() == speeds
    assert runs.speed.dims == ("run",)
    everywhere = hl.batch(tap, until=4e-4, save_every=1e-6, speed=speeds, loss=5.0)
    assert np.array_equal(everywhere.contact_force[1].values, runs.contact_force[1].values)


MIXED = [
    chain(0.3),
    chain(0.44, hl.LinearDashpot(5.0), gravity=9.81),
    chain(0.44, preload=2.0),
    hl.Chain([hl.Sphere(3e-3, hl.BRASS_360)] * 20, hl.SpringLoaded(BEAD, 1e3, 1e-3, 5e-4)),
]


def mixed(number: int) -> hl.CoSimulation:
    return hl.CoSimulation(MIXED[number], WALL, dt=2e-8)


ALL = list(range(len(MIXED)))


def test_a_batch_of_all_sorts_is_its_runs() -> None:
    """CoSimulation with the same steps gives the same numbers, to rounding."""
    runs = hl.batch(mixed, until=2e-4, save_every=2e-6, number=ALL)
    for i in ALL:
        alone = mixed(i).run(until=2e-4, save_every=2e-6)
        scale = float(alone.contact_force.max())
        assert runs.contact_force[i].values == pytest.approx(alone.contact_force.values, abs=1e-9 * scale)
        assert runs.velocity[i].values == pytest.approx(alone.velocity.values, abs=1e-9)
        assert runs.static_force[i].values == pytest.approx(alone.static_force.values)


@pytest.mark.usefixtures("cores")
def test_threads_and_neighbours_change_no_bit() -> None:
    one = hl.batch(mixed, until=1e-4, threads=1, number=ALL)
    two = hl.batch(mixed, until=1e-4, threads=2, number=ALL)
    assert one.identical(two)
    alone = hl.batch(mixed, until=1e-4, save_every=float(one.time[1]), number=[3])
    assert np.array_equal(alone.contact_force[0].values, one.contact_force[3].values)


def test_a_failing_run_does_not_lose_the_others() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="batch: 1 of 3 runs failed"):
        runs = hl.batch(tap, until=2e-4, sensors=[7], save_every=1e-6, speed=[0.3, -1.0, 0.44])
    assert "impact_speed = -1.0" in runs.error.values[1]
    assert runs.error.values[[0, 2]].tolist() == ["", ""]
    assert np.isnan(runs.contact_force[1]).all()
    assert np.isfinite(runs.contact_force[[0, 2]]).all()
    assert "batch: 1 of 3 runs failed" in runs.attrs["warnings"]
    with pytest.warns(hl.HertzlinkWarning, match="batch: 1 of 2 runs failed"):
        late = hl.batch(tap, until=1e-4, save_every=1e-6, speed=[-1.0, 0.3])
    assert np.isnan(late.contact_force[0]).all()
    assert np.isfinite(late.contact_force[1]).all()


def improbable(radius: float) -> hl.CoSimulation:
    striker = hl.Sphere(radius, hl.STEEL_440C)
    if radius > 2.0:
        raise ValueError("too heavy")
    return hl.CoSimulation(hl.Chain([BEAD] * 20, striker, 1e-3), SMALL)


def test_findings_on_the_input_of_runs_are_said_once() -> None:
    """Findings of the runs at the ends of the parameters, which also choose the interval, and of other runs."""
    with collected() as said:
        runs = hl.batch(improbable, until=2e-6, sensors=[7], radius=[1.0, 0.7, 0.5])
    (striker,) = [line for line in said if line.startswith("Sphere")]
    assert striker.startswith("Sphere radius = 1: is read as 1 m, which is improbable")
    assert runs.attrs["warnings"].splitlines().count(striker) == 1
    with collected() as said:
        runs = hl.batch(lambda k: improbable([4e-3, 1.0, 4e-3][k]), until=2e-6, sensors=[7], k=[0, 1, 2])
    (striker,) = [line for line in said if line.startswith("Sphere")]
    assert striker.endswith("did you mean 1 mm? (at run 1; reported at 1 of 3 runs)")
    assert striker in runs.attrs["warnings"].splitlines()
    with collected() as said, pytest.raises(ValueError, match="too heavy"):
        hl.batch(improbable, until=2e-6, radius=[3.0])
    assert [line.split(":")[0] for line in said] == ["Sphere radius = 3"]


def test_a_batch_of_which_every_run_fails_raises(monkeypatch: pytest.MonkeyPatch) -> None:
    def failing(*_: object) -> None:
        raise FloatingPointError("no")

    monkeypatch.setattr("coupling.sweeps.batch.fill", failing)
    with pytest.raises(RuntimeError, match="all 2 runs failed; the first with FloatingPointError: no"):
        hl.batch(tap, 1e-4, save_every=1e-6, speed=[0.3, 0.4])


def test_a_measure_is_all_that_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs that are measured two at a time give the same as all at once."""
    speeds = [0.3, 0.33, 0.36, 0.4, 0.44]
    whole = hl.batch(tap, until=4e-4, save_every=1e-6, sensors=[7], speed=speeds)
    monkeypatch.setattr("coupling.sweeps.batch.LARGEST_MEASURED", 401 * 4 * 2.5)
    sizes = []

    def peak(runs: xr.Dataset) -> xr.Dataset:
        sizes.append(runs.sizes["run"])
        return runs.contact_force.max("time").to_dataset()

    kept = hl.batch(tap, until=4e-4, save_every=1e-6, sensors=[7], measure=peak, speed=speeds)
    assert sizes == [2, 2, 1]
    assert np.array_equal(kept.contact_force.values, whole.contact_force.max("time").values)
    assert kept.speed.values.tolist() == speeds


def test_a_measure_may_be_an_array_and_values_stay_what_they_are() -> None:
    """AR as it is returned; tuples, text and numbers reach the function as they were given."""
    given = []

    def run(what: object) -> hl.CoSimulation:
        given.append(what)
        return tap(0.3)

    kept = hl.batch(run, 4e-4, save_every=1e-6, threads=1, measure=lambda runs: runs.velocity.max("time"),
                    what=[(0.1, 1), "0.2", True, 3])  # fmt: skip
    assert kept.velocity.sizes["run"] == 4
    assert given == [(0.1, 1), "0.2", True, 3]
    assert kept.error.values.tolist() == [""] * 4


def against(speed: float) -> hl.CoSimulation:
    return hl.CoSimulation(chain(speed), WALL)


def test_what_was_not_kept_is_named() -> None:
    runs = hl.batch(against, until=2e-4, sensors=[6, 7], save_every=1e-6, speed=[0.44])
    with pytest.raises(ValueError, match="sensor = 4: was not kept; must be one of 6, 7"):
        hl.amplitude_ratio(runs, 4)


def test_materials_are_parameters() -> None:
    runs = hl.batch(
        lambda material: hl.CoSimulation(chain(), hl.half_space(material)),
        until=1e-4,
        material=[hl.PTFE, hl.MATERIALS["nylon"]],
    )
    assert runs.material.values.tolist() == ["PTFE", "nylon"]


def test_measures_work_on_a_batch() -> None:
    """AR and TOF of the LAMMPS chain, from a batch that keeps one sensor."""
    runs = hl.batch(against, until=1e-3, sensors=[7], speed=[hl.drop_speed(0.01), 0.2])
    assert dict(runs.sizes) == {"run": 2, "time": runs.sizes["time"], "contact": 3, "bead": 1}
    assert float(hl.amplitude_ratio(runs, 7)[0]) == pytest.approx(48.9536 / 49.9881, rel=1e-4)
    assert float(hl.time_of_flight(runs, 7)[0]) == pytest.approx(458.937e-6, rel=1e-4)
    assert runs.contact_force.attrs["units"] == "N"
    assert '"count": 2' in runs.attrs["input"]


def of_count(count: int) -> hl.CoSimulation:
    return hl.CoSimulation(hl.Chain([BEAD] * count, BEAD, 0.3), WALL)


def explicitly(speed: float) -> hl.CoSimulation:
    return hl.CoSimulation(chain(speed), WALL, hl.Explicit())


def of_two(speed: float) -> hl.CoSimulation:
    return hl.CoSimulation([chain(speed), chain(speed)], [WALL, hl.half_space(hl.PTFE)])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"build": 3}, "build = 3: must be a function that returns a CoSimulation"),
        ({"build": lambda speed: chain(speed)}, r"build\(...\) = Chain.*: must be a CoSimulation"),
        ({"build": explicitly}, r"build\(...\) = CoSimulation.*: cannot run .* a batch needs Condensed"),
        ({"build": of_two}, r"build\(\.\.\.\) = .*: must be the CoSimulation of one chain"),
        ({"build": of_count}, "build = .*: takes count, but the parameters are speed"),
        ({"speeds": [0.1]}, "build = .*: takes speed, but the parameters are speed, speeds"),
        ({"speed": [0.1, 0.2], "dt": 1e-8}, "build = .*: takes speed, but the parameters are speed, dt"),
        ({"speed": []}, r"speed = \[\]: must be a list of values"),
        ({"speed": [np.nan]}, "impact_speed = nan: must be a finite number"),
        ({"build": lambda a, b: tap(a + b), "speed": None, "a": [0.1, 0.2], "b": [0.1] * 3}, r"values \(a 2, b 3\)"),
        ({"build": lambda time: tap(time), "speed": None, "time": [0.1]}, "time: is a name that every run uses"),
        ({"until": -1.0}, r"until = -1\.0"),
        ({"until": 1e3}, "until = 1000.0, save_every = .*: .* numbers are too many to keep"),
        ({"sensors": [21]}, r"sensors = \[21\]: must be beads from 1 to 20"),
        ({"sensors": []}, r"sensors = \[\]"),
        ({"sensors": 3}, "sensors = 3: must be a list of one bead number or more"),
        ({"measure": [1]}, r"measure = \[1\]: must be a function of a Dataset of runs"),
        ({"measure": lambda: None}, "measure = .*: must be a function of a Dataset of runs"),
        ({"measure": lambda runs: runs.isel(run=[])}, "measure.runs.: has the dimensions"),
        ({"threads": 0}, "threads = 0"),
        ({"save_every": 1.0}, r"save_every = 1\.0: must not be longer than the run"),
        ({"save_every": 0.0}, r"save_every = 0\.0"),
    ],
)
def test_bad_input(given: dict[str, object], message: str) -> None:
    everything = {"build": against, "until": 1e-4, "speed": [0.44], **given}
    with pytest.raises(ValueError, match=message):
        hl.batch(**{name: value for name, value in everything.items() if value is not None})  # type: ignore[arg-type]


def test_parameters_are_named() -> None:
    with pytest.raises(ValueError, match="parameters: name at least one argument of build"):
        hl.batch(lambda: against(0.3), until=1e-4)
    with pytest.warns(hl.HertzlinkWarning, match="1 of 2 runs failed"):
        unlike = hl.batch(of_count, until=1e-5, count=[3, 4])
    assert (
        unlike.error.values[1] == "ValueError: build(...): has another number of beads than the first run, which has 3"
    )
