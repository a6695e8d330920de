"""One run and many have the same waves, and peaks and splines are those of scipy."""

import numpy as np
import pytest
import xarray as xr
from numba import typeof
from scipy.interpolate import CubicSpline
from scipy.signal import find_peaks

import hertzlink as hl
from coupling.results import wave_kernels
from coupling.results.peaks import interpolated
from coupling.results.reading import Reading
from coupling.results.waves_of_runs import find_waves, series_of

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


def test_missing_waves_are_nan_and_counted(runs: xr.Dataset) -> None:
    reading = Reading(runs)
    waves = find_waves(reading.time, series_of(reading, SENSOR), 0.01, 3)
    assert waves.found[1] == 0
    assert np.isnan(waves.amplitude[1]).all()
    assert np.isnan(waves.amplitude_ratio[3]).all()
    with pytest.warns(hl.HertzlinkWarning, match="record: ends at .* in 1 of 4 runs"):
        assert np.isnan(hl.amplitude_ratio(runs, SENSOR)[[1, 3]]).all()


def test_axes_may_come_in_any_order(runs: xr.Dataset) -> None:
    turned = runs.transpose("contact", "bead", "time", "run")
    assert hl.amplitude_ratio(turned.isel(run=[0, 2]), SENSOR).identical(
        hl.amplitude_ratio(runs.isel(run=[0, 2]), SENSOR)
    )


def test_a_bead_that_was_not_kept_is_named() -> None:
    chain = hl.Chain([BEAD] * 12, BEAD, impact_speed=0.4)
    kept = hl.batch([chain], until=1e-4, sensors=[6, 8])
    with pytest.raises(ValueError, match=r"sensor = 7: must be a bead that was kept: 6, 8"):
        hl.amplitude_ratio(kept, 7)


@pytest.mark.parametrize("seed", range(20))
def test_peaks_are_those_of_scipy(seed: int) -> None:
    """With plateaus, and peaks of equal height."""
    random = np.random.default_rng(seed)
    force = np.round(random.normal(size=300).cumsum(), 0)
    least = max(0.3 * float(np.abs(force).max()), 1.0)
    found = np.empty(force.size, dtype=np.int64)
    count = wave_kernels.peaks_of(force, least, found)
    assert found[:count].tolist() == find_peaks(force, height=least, prominence=least)[0].tolist()


@pytest.mark.parametrize("samples", [3, 4, 9, 50])
def test_a_spline_is_that_of_scipy(samples: int) -> None:
    time = np.linspace(0.0, 1.0, samples)
    force = np.exp(-(((time - 0.47) / 0.3) ** 2))
    peak = int(force.argmax())
    near = slice(max(0, peak - wave_kernels.NEAR), peak + wave_kernels.NEAR + 1)
    spline = CubicSpline(time[near], force[near])
    roots = spline.derivative().roots(extrapolate=False)
    best = max(roots, key=spline)
    assert interpolated(time, force, peak) == pytest.approx((float(spline(best)), best), rel=1e-12)


@pytest.mark.parametrize("times", [np.linspace(0.0, 1.0, 9), np.linspace(0.0, 1.0, 17)[::2], np.arange(9)])
def test_kernels_are_compiled_for_one_type_of_array(times: np.ndarray) -> None:
    """Times of a run cannot be written, every second one is not contiguous, and counts are integers."""
    times.flags.writeable = False
    assert typeof(wave_kernels.plain(times)) == typeof(np.zeros(9))
    assert np.array_equal(wave_kernels.plain(times), times)
