"""Averaged taps: noise falls with the root of their number, and neither AR nor the shape changes."""

import numpy as np
import pytest

import hertzlink as hl

STEP = 2e-7


def force(time: np.ndarray, at: float, height: float = 50.0) -> np.ndarray:
    return sum(height * a * np.exp(-(((time - at - t) / 2e-5) ** 2)) for a, t in ((1.0, 0.0), (0.6, 3e-4)))


def several(count: int, level: float = 1.0, **heights: float) -> list:
    random, time = np.random.default_rng(3), STEP * np.arange(4000)
    return [
        hl.as_signal(time, {7: force(time, 2e-4 + random.uniform(0, 5e-5), **heights) + random.normal(0, level, 4000)})
        for _ in range(count)
    ]


def test_noise_of_the_average() -> None:
    """The variable noise against the true error of the average, known here."""
    for count in (4, 25):
        mean = hl.average_taps(several(count))
        error = mean.sensor_force.sel(sensor=7).values - force(mean.time.values, 0.0)
        assert mean.attrs["taps"] == count
        # Linear interpolation between samples averages neighbours: the noise is below 1 N / √count, to √(2/3) of it.
        assert 0.75 / np.sqrt(count) < float(mean.noise[0]) < 1.05 / np.sqrt(count)
        assert float(mean.noise[0]) == pytest.approx(error.std(), rel=0.15)
        assert float(hl.amplitude_ratio(mean, 7)) == pytest.approx(0.6, abs=0.02)


def test_noise_below_a_step_of_the_digitiser_is_that_of_rounding() -> None:
    assert float(hl.average_taps([tap.round() for tap in several(9, 0.01)]).noise[0]) >= 12.0**-0.5


def test_unequal_taps_get_a_warning() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="incident peaks scatter by"):
        hl.average_taps([*several(2), *several(1, height=40.0)])


def test_a_clipped_tap_leaves_a_gap() -> None:
    taps = several(3, 0.2)
    taps[1] = taps[1].where(abs(taps[1].time - 5.2e-4) > 5e-6)
    mean = hl.average_taps(taps)
    assert 45 < int(np.isnan(mean.sensor_force).sum()) < 60


def test_bad_input() -> None:
    taps = several(2)
    for call, message in (
        (lambda: hl.average_taps(taps[0]), "signals"),
        (lambda: hl.average_taps(taps[:1]), "hold 1 tap, must hold 2 or more"),
        (lambda: hl.average_taps([]), "signals = "),
        (lambda: hl.average_taps(taps, sensor=8), "sensor = 8: must be one that was measured: 7"),
        (lambda: hl.average_taps([taps[0], taps[1].isel(time=slice(None, None, 2))]), "with a sample every 4e-07 s"),
        (lambda: hl.average_taps([taps[0], taps[1].assign_coords(sensor=[9])]), "has sensors .9. .*, must have .* .7."),
    ):
        with pytest.raises(ValueError, match=message):
            call()
