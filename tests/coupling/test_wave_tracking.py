"""Waves followed through the chain: directions, speeds, where they begin and end, and what is no wave."""

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.results.wave_tracking import Track

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
STEEL_ON_PTFE = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]


def struck(structure: hl.Structure | None, until: float = 1.2e-3, dashpot: float = 5.0, beads: int = 20) -> xr.Dataset:
    loss = hl.LinearDashpot(dashpot) if dashpot else None
    chain = hl.Chain([BEAD] * beads, BEAD, hl.drop_speed(0.01), dissipation=loss)
    return hl.CoSimulation(chain, structure).run(until)


def test_one_wave_runs_down_a_free_chain_at_its_speed() -> None:
    """Mid chain at the speed between two sensors; a free chain sends nothing back."""
    run = struck(None, 9e-4, 0.0, 40)
    (wave,) = [one for one in hl.follow_waves(run) if one.towards_structure]
    assert (wave.contacts[0], wave.contacts[-1]) == (1, 40)
    assert (wave.begins, wave.ends) == ("struck end", "structure")
    assert wave.speed(run) == pytest.approx(hl.wave_speed(run, 10, 30), rel=0.01)
    assert [one for one in hl.follow_waves(run) if not one.towards_structure] == []


def test_reflected_waves_arrive_when_the_sensors_say() -> None:
    run = struck(hl.rod(STEEL_ON_PTFE))
    waves = hl.reflections(run, 7)
    assert waves.primary
    assert waves.secondary
    back = [one for one in hl.follow_waves(run) if not one.towards_structure and np.isfinite(one.arrival(7))]
    assert [one.begins for one in back[:2]] == ["structure", "structure"]
    found = [one.arrival(7) for one in back[:2]]
    assert found == pytest.approx([waves.primary.arrival, waves.secondary.arrival], abs=1e-6)


def test_the_tail_of_a_wave_is_no_wave_of_the_structure() -> None:
    """On a steel half-space beads that rattle behind the primary wave make a small one that begins in the chain."""
    run = struck(hl.half_space(hl.STEEL_440C), dashpot=0.0)
    back = [one for one in hl.follow_waves(run) if not one.towards_structure]
    assert [one.begins for one in back if one.forces[0] > 5.0] == ["structure"]
    assert all(one.begins == "chain" for one in back if one.forces[0] < 5.0)


@pytest.mark.thorough
def test_third_waves_are_listed_and_lost_ones_end_in_the_chain() -> None:
    """A PTFE rod sends several; the last ones fade below 1 % before they reach the striker."""
    run = struck(hl.rod([hl.Layer(hl.PTFE, 76.2e-3, 19.1e-3)]), 1.5e-3)
    back = [one for one in hl.follow_waves(run) if not one.towards_structure]
    assert sum(one.begins == "structure" for one in back) >= 3
    assert back[0].ends == "struck end"
    assert back[-1].ends == "chain"
    assert np.isnan(back[-1].arrival(7))
    assert all(np.all(np.diff(one.times) > 0.0) for one in back)


@pytest.mark.thorough
def test_a_sweep_has_a_continuous_secondary_branch() -> None:
    """The longer the lower layer, the later the second wave from the structure, with no jumps."""
    arrivals = []
    for length in np.linspace(20e-3, 60e-3, 9):
        layers = [STEEL_ON_PTFE[0], hl.Layer(hl.PTFE, float(length), 9.525e-3)]
        back = [
            one
            for one in hl.follow_waves(struck(hl.rod(layers)))
            if not one.towards_structure and one.begins == "structure"
        ]
        arrivals.append(back[1].arrival(10))
    steps = np.diff(arrivals)
    assert np.all(steps > 0.0)
    assert steps.max() < 2.0 * steps.min()


def passes(track: Track, sensor: int, time: float) -> bool:
    """Whether the force at the sensor peaks then between the peaks of its two contacts, give or take 2 µs."""
    around = [at for contact, at in zip(track.contacts, track.times, strict=True) if contact in (sensor, sensor + 1)]
    return len(around) == 2 and min(around) - 2e-6 < time < max(around) + 2e-6


@pytest.mark.thorough
@pytest.mark.parametrize("lower", [76.2e-3, 90e-3, 99e-3, 101.6e-3, 120e-3, 152.4e-3])
def test_tracks_and_reflections_find_the_same_wave(lower: float) -> None:
    """A small wave ahead of the secondary one must not take its beginning from it."""
    run = struck(hl.rod([STEEL_ON_PTFE[0], hl.Layer(hl.PTFE, lower, 9.525e-3)]), 1.5e-3)
    secondary = hl.reflections(run, 7).secondary
    assert secondary
    (track,) = [one for one in hl.follow_waves(run) if not one.towards_structure and passes(one, 7, secondary.arrival)]
    assert track.begins == secondary.begins == "structure"
