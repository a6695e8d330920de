"""One run and many have the same waves."""

import warnings

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
SENSOR = 7


@pytest.fixture(scope="module")
def runs() -> xr.Dataset:
    """A batch whose last run is too slow for a reflected wave, and whose second one failed."""

    def tap(speed: float) -> hl.CoSimulation:
        if speed == 0.2:
            raise ValueError("no such run")
        return hl.CoSimulation(hl.Chain([BEAD] * 14, BEAD, impact_speed=speed), hl.half_space(hl.PTFE))

    with pytest.warns(hl.HertzlinkWarning):
        return hl.batch(tap, until=8e-4, speed=[0.4, 0.2, 0.6, 0.01])


@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
@pytest.mark.parametrize("measure", [hl.amplitude_ratio, hl.time_of_flight])
@pytest.mark.parametrize("wave", ["primary", "secondary"])
def test_many_runs_have_the_measures_of_each(runs: xr.Dataset, measure, wave: str) -> None:
    many = measure(runs, SENSOR, wave)
    assert many.dims == ("run",)
    for run in (0, 2, 3):
        one = runs.isel(run=run)
        single = getattr(hl.reflections(one, SENSOR), wave)
        assert np.array_equal(many[run], measure(one, SENSOR, wave), equal_nan=True)
        assert np.array_equal(many[run], getattr(single, measure.__name__, np.nan), equal_nan=True)
    assert np.isfinite(hl.amplitude_ratio(runs, SENSOR)[[0, 2]]).all()


def test_axes_may_come_in_any_order(runs: xr.Dataset) -> None:
    turned = runs.transpose("contact", "bead", "time", "run")
    assert hl.amplitude_ratio(turned.isel(run=[0, 2]), SENSOR).identical(
        hl.amplitude_ratio(runs.isel(run=[0, 2]), SENSOR)
    )


def struck_block(heavy: float, stiffness: float, beads: list[hl.Bead], speed: float) -> xr.Dataset:
    """A run on a mass on a spring; heavy: the mass in bead masses."""
    block = hl.Structure([[heavy * BEAD.mass]], [[stiffness]], None, [1.0], 0.0, hl.Surface(hl.STEEL_440C))
    return hl.CoSimulation(hl.Chain(beads, BEAD, speed), block).run(2.2e-3)


def test_two_waves_that_follow_each_other_closely_are_two_at_each_bead() -> None:
    """The power between both peaks falls below 0.3 of the weaker one's at some beads only; the peaks are 60 to 75 µs
    apart, and the incident wave lasts 39 µs. Where they overlap, a warning says so."""
    run = struck_block(3.0, 1e7, [BEAD] * 29, 0.1)
    waves = {}
    for sensor in range(13, 18):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            waves[sensor] = hl.reflections(run, sensor)
        if sensor == 14:
            assert "the primary wave overlaps the next wave, of AR = 0.69" in str(caught[0].message)
    ratios = [one.primary.amplitude_ratio for one in waves.values()]
    assert ratios == pytest.approx([0.41, 0.40, 0.39, 0.385, 0.38], abs=0.01)
    assert [one.secondary.amplitude_ratio for one in waves.values()] == pytest.approx(
        [0.67, 0.69, 0.70, 0.71, 0.71], abs=0.01
    )


@pytest.mark.parametrize(
    ("run", "sensor", "said"),
    [
        (lambda: struck_block(1.0, 1e6, [BEAD, hl.Sphere(2.4e-3, hl.STEEL_440C)] * 11, 0.3), 16, "lasts 0.1"),
        (lambda: struck_block(3.0, 1e7, [BEAD, hl.Sphere(2.4e-3, hl.STEEL_440C)] * 11, 0.3), 7, "lasts 2.6"),
    ],
)
def test_what_lasts_no_longer_or_shorter_than_a_single_wave_is_warned_of(run, sensor: int, said: str) -> None:
    """Light beads between heavy ones: a rattle of 1 % before the wave, and two waves in one pulse."""
    with pytest.warns(hl.HertzlinkWarning, match=f"the primary wave {said}.* times as long as a single wave"):
        hl.reflections(run(), sensor)
