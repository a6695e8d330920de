"""Elastic models of taps that yield: `identify` warns of them, and names the cure."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
JACKSON_GREEN = hl.laws.JacksonGreen()


def signal_of(run: xr.Dataset, sensor: int) -> xr.Dataset:
    """A trace with 1 % of noise, every microsecond."""
    times = np.arange(0.0, float(run.time[-1]), 1e-6)
    force = np.interp(times, run.time.values, hl.sensor_force(run, sensor).values)
    noise = np.random.default_rng(3).normal(0.0, 0.01 * force.max(), times.size)
    return hl.as_signal(times, {sensor: force + noise})


def on_wall(modulus: float, law: hl.laws.JacksonGreen | None = None, beads: int = 10) -> hl.CoSimulation:
    wall = hl.half_space(replace(hl.ALUMINIUM_6061, youngs_modulus=modulus))
    return hl.CoSimulation(hl.Chain([BEAD] * beads, BEAD, 0.3, law=law), wall)


@pytest.mark.thorough
def test_a_modulus_that_an_elastic_model_finds_of_a_wall_that_yields() -> None:
    signal = signal_of(on_wall(60e9, JACKSON_GREEN).run(6e-4), 5)
    with pytest.warns(hl.HertzlinkWarning, match=r"yield: .*; law=hl\.laws\.JacksonGreen\(\) in Chain computes it"):
        found = hl.identify(signal, on_wall, modulus=(5e9, 300e9), guess={"modulus": 40e9})
    assert abs(found["modulus"].value / 60e9 - 1.0) > 0.2
    assert len([one for one in found.warnings if one.startswith("yield: ")]) == 1


def test_nothing_is_said_of_yield_where_the_best_fit_does_not() -> None:
    """Fast strikers at the other end of the range would dent the wall, but do not count."""

    def build(impact_speed: float) -> hl.CoSimulation:
        wall = hl.half_space(hl.STEEL_440C)
        return hl.CoSimulation(hl.Chain([BEAD] * 10, BEAD, impact_speed), wall)

    found = hl.identify(signal_of(build(0.1).run(8e-4), 5), build, impact_speed=(0.05, 3.0))
    assert found["impact_speed"].value == pytest.approx(0.1, rel=0.02)
    assert not [one for one in found.warnings if "yield" in one]


def test_the_design_of_a_test_warns_of_a_wall_that_yields() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="yield: contact 11 presses aluminium 6061 to"):
        known = hl.identifiability(on_wall, sensors=[4], until=4e-4, modulus=60e9)
    assert [one for one in known.warnings if one.startswith("yield: ")]
