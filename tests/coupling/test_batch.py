"""Batches: each chain as if it ran alone, whatever its neighbours and the number of threads."""

import numpy as np
import pytest

import hertzlink as hl
from particles.dissipation import Dissipation

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
WALL = hl.half_space(hl.STEEL_440C)


def chain(speed: float = 0.44, loss: Dissipation | None = None, **keywords: object) -> hl.Chain:
    return hl.Chain([BEAD] * 20, BEAD, speed, dissipation=loss, **keywords)  # type: ignore[arg-type]


MIXED = [
    chain(0.3),
    chain(0.44, hl.LinearDashpot(5.0), gravity=9.81),
    chain(0.44, hl.PowerDashpot(5.0, 1.7)),
    chain(0.44, integrator="rk4"),
    chain(0.44, law=hl.laws.PowerLaw(1e8, 1.25)),
    chain(0.44, law=hl.laws.TabulatedLaw([1e-7, 1e-6, 1e-5], [0.1, 3.0, 100.0]), preload=2.0),
    hl.Chain([hl.Sphere(3e-3, hl.BRASS_360)] * 20, hl.SpringLoaded(BEAD, 1e3, 1e-3, 5e-4)),
]


def test_a_batch_of_all_sorts_is_its_runs() -> None:
    """Against CoSimulation with the same steps: the same numbers, to rounding."""
    runs = hl.batch(MIXED, until=2e-4, structure=WALL, save_every=2e-6, dt=2e-8)
    for i, one in enumerate(MIXED):
        alone = hl.CoSimulation(one, WALL, window=2e-6, dt=2e-8, substeps=1).run(until=2e-4)
        scale = float(alone.contact_force.max())
        assert runs.contact_force[i].values == pytest.approx(alone.contact_force.values, abs=1e-9 * scale)
        assert runs.velocity[i].values == pytest.approx(alone.velocity.values, abs=1e-9)
        assert runs.static_force[i].values == pytest.approx(alone.static_force.values)


def test_threads_and_neighbours_change_no_bit() -> None:
    one = hl.batch(MIXED, until=1e-4, structure=WALL, threads=1)
    two = hl.batch(MIXED, until=1e-4, structure=WALL, threads=2)
    assert one.identical(two)
    alone = hl.batch(MIXED[3:4], until=1e-4, structure=WALL, save_every=float(one.time[1]))
    assert np.array_equal(alone.contact_force[0].values, one.contact_force[3].values)


def test_measures_work_on_a_batch() -> None:
    """AR and TOF of the LAMMPS chain, from a batch that keeps one sensor."""
    runs = hl.batch([chain(hl.drop_speed(0.01)), chain(0.2)], until=1e-3, structure=WALL, sensors=[7])
    assert dict(runs.sizes) == {"chain": 2, "time": runs.sizes["time"], "contact": 2, "bead": 1}
    assert float(hl.amplitude_ratio(runs, 7)[0]) == pytest.approx(48.9536 / 49.9881, rel=1e-4)
    assert float(hl.time_of_flight(runs, 7)[0]) == pytest.approx(458.937e-6, rel=1e-4)
    assert runs.contact_force.attrs["units"] == "N"
    assert '"count": 2' in runs.attrs["input"]


def test_what_a_batch_did_not_keep_is_not_measured() -> None:
    runs = hl.batch([chain()], until=4e-4, structure=WALL, sensors=[7])
    with pytest.raises(ValueError, match="run: is a batch that kept contacts up to 8; keep the last bead"):
        hl.contact_time(runs)
    with pytest.raises(ValueError, match="run: holds no energies"):
        hl.energy_error(runs)
    whole = hl.contact_time(hl.batch([chain()], until=8e-4, structure=WALL))
    last = hl.contact_time(hl.batch([chain()], until=8e-4, structure=WALL, sensors=[20]))
    assert float(whole[0]) == pytest.approx(float(last[0]), rel=1e-9)  # type: ignore[index]


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"chains": []}, "chains = "),
        ({"chains": [BEAD]}, "chains = "),
        ({"chains": [chain(), hl.Chain([BEAD], BEAD, 0.3)]}, r"chains: hold \[1, 20\] beads; must have equally many"),
        ({"chains": [hl.Chain([BEAD], hl.Piston([0.0, 1e-5], [0.0, 1e-6]))]}, "chains: with a PushedBead"),
        ({"until": -1.0}, r"until = -1\.0"),
        ({"sensors": [21]}, r"sensors = \[21\]: must be beads from 1 to 20"),
        ({"sensors": []}, r"sensors = \[\]"),
        ({"structure": hl.rod([hl.Layer(hl.PTFE, 0.05, 0.01)])}, "structure: a batch faces nothing or a half-space"),
        ({"structure": "steel"}, "structure = 'steel'"),
        ({"threads": 0}, "threads = 0"),
        ({"sensors": 3}, "sensors = 3: must be a list of one bead number or more"),
        ({"save_every": 1.0}, r"save_every = 1\.0: must not be longer than the run"),
        ({"dt": 1e-20}, r"dt = 1e-20: takes .* steps in .* s; give a longer dt"),
        ({"save_every": 0.0}, r"save_every = 0\.0"),
        ({"until": 1e3}, "until: .* numbers are too many to keep"),
        ({"dt": 1e-4}, r"dt = 0\.0001: too large for a stable step"),
    ],
)
def test_bad_input(keywords: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.batch(**{"chains": [chain()], "until": 1e-4, **keywords})  # type: ignore[arg-type]
