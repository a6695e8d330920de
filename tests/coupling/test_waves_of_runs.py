"""One run and many have the same waves."""

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
