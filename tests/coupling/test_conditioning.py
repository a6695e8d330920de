"""Conditioning: offset, hum, clipped samples and noise are found where they are known, and nothing is invented."""

import warnings

import numpy as np
import pytest

import hertzlink as hl
from coupling.results.sensor_trace import quiet_lead, smoothed

TIME = 2e-7 * np.arange(4000)


def waves(time: np.ndarray = TIME, start: float = 2e-4) -> np.ndarray:
    return sum(a * np.exp(-(((time - start - at) / 2e-5) ** 2)) for a, at in ((50.0, 0.0), (30.0, 3e-4)))


def signal(force: np.ndarray, time: np.ndarray = TIME) -> "hl.xr.Dataset":  # type: ignore[name-defined]
    return hl.as_signal(time, {7: force})


def noise(level: float, size: int = TIME.size, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).normal(0.0, level, size)


def test_offset_and_noise() -> None:
    found = hl.clean_signal(signal(waves() + 4.0 + noise(0.5)))
    assert float(found.noise.sel(sensor=7)) == pytest.approx(0.5, rel=0.15)
    assert found.noise.dims == ("sensor",)
    assert float(found.sensor_force.isel(time=slice(0, 200)).mean()) == pytest.approx(0.0, abs=0.15)
    assert float(hl.amplitude_ratio(found, 7)) == pytest.approx(0.6, abs=0.02)
    assert found.conditioning.startswith("Sensor 7: the offset, ")
    assert "offset" not in hl.clean_signal(found).conditioning  # what is left is rounding


@pytest.mark.parametrize("frequency", [50.0, 60.0])
def test_hum_is_removed_where_the_lead_supports_it(frequency: float) -> None:
    time = 1e-6 * np.arange(120_000)
    phase = 2 * np.pi * frequency * time
    hum = 3.0 * np.sin(phase + 0.4) + 1.0 * np.cos(3 * phase)
    clean = waves(time, 0.115)
    found = hl.clean_signal(signal(clean + hum + 2.0 + noise(0.2, time.size), time), mains=frequency)
    assert np.abs(found.sensor_force.sel(sensor=7).values - clean).std() < 0.21
    assert float(found.noise[0]) == pytest.approx(0.2, rel=0.02)
    assert f"mains hum of {frequency:g} Hz with 5 harmonics" in found.conditioning


def test_a_short_lead_leaves_the_hum() -> None:
    with pytest.warns(hl.HertzlinkWarning, match=r"mains hum of 50 Hz was not removed: .* one period, 20 ms"):
        found = hl.clean_signal(signal(waves() + noise(0.2)), mains=50.0)
    assert "was not removed" in found.conditioning


@pytest.mark.parametrize("level", [0.0, 0.3])
@pytest.mark.parametrize("step", [0.0, 0.25])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_clipped_samples(level: float, step: float, sign: float) -> None:
    force = np.minimum(waves() + noise(level), 40.0)
    force = np.round(force / step) * step if step else force
    with pytest.warns(hl.HertzlinkWarning, match="sensor 7: .* samples are clipped at -?(40|39)"):
        found = hl.clean_signal(signal(sign * force))
    gone = np.isnan(found.sensor_force.sel(sensor=7).values)
    assert 80 < gone.sum() <= (force >= 40.0).sum()
    if sign > 0.0:
        with pytest.raises(ValueError, match=r"the peak at .* has .* clipped samples"):
            hl.amplitude_ratio(found, 7)


@pytest.mark.parametrize("step", [0.0, 0.2, 0.5, 1.0])
@pytest.mark.parametrize("level", [0.0, 0.1, 0.5])
def test_a_quantised_top_is_not_clipped(step: float, level: float) -> None:
    """A record of exact zeros is not clipped at its lowest level either."""
    force = np.maximum(waves(), 0.0) + noise(level)
    force = np.round(force / step) * step if step else force
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = hl.clean_signal(signal(force))
    assert np.isfinite(found.sensor_force).all()
    assert float(found.noise[0]) >= step / np.sqrt(12.0) * (1.0 - 1e-12)


def test_no_quiet_lead() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="sensor 7: there is no quiet lead, so the offset was left"):
        found = hl.clean_signal(signal((waves() + noise(0.3))[1000:], TIME[1000:]))
    assert float(found.noise[0]) == pytest.approx(0.3, rel=0.1)


def test_the_smoothed_trace_and_its_lead() -> None:
    """The noise that smoothing leaves, where it is far from the pulse; a lead that ends before the pulse."""
    noisy = 0.4 + waves() + noise(1.0)
    smooth, left, width = smoothed(noisy)
    assert width == pytest.approx(2.0 * np.sqrt(np.log(2.0)) * 100, rel=0.1)
    assert np.std(smooth[:700]) == pytest.approx(left, rel=0.3)
    assert 300 < quiet_lead(noisy) < 900
    assert quiet_lead(noisy[1000:]) == 0


def test_bad_input() -> None:
    good = signal(waves())
    for arguments, message in (
        ((3,), "signal = 3: must be a signal"),
        ((good.drop_vars("sensor_force"),), "signal: must be one measured signal"),
        ((good, -50.0), "mains = -50.0"),
        ((good.where(good.time < 1e-6),), "sensor 7 has 5 samples without clipping, must have 16"),
    ):
        with pytest.raises(ValueError, match=message) as caught:
            hl.clean_signal(*arguments)
        assert "\n" not in str(caught.value)
