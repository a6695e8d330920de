"""Arrays that state a unit, a mask or an imaginary part: understood, or refused by name."""

import numpy as np
import pint
import pytest
import xarray as xr

import hertzlink as hl
from coupling.results.waves import Wave

NS = 1000 * np.arange(601)
TIME = 1e-9 * NS
FORCE = 50.0 * np.exp(-(((TIME - 1e-4) / 1e-5) ** 2)) + 30.0 * np.exp(-(((TIME - 4e-4) / 1e-5) ** 2))
UNITS = pint.UnitRegistry()


@pytest.mark.parametrize(
    ("time", "force"),
    [
        (NS.astype("m8[ns]"), FORCE),
        (np.datetime64("2024-03-01T10:00:00", "ns") + NS.astype("m8[ns]"), FORCE),
        (xr.DataArray(NS.astype("m8[ns]"), dims="t"), FORCE),
        (xr.DataArray(1e3 * TIME, dims="t", attrs={"units": "ms"}), FORCE),
        (TIME, xr.DataArray(1e3 * FORCE, dims="t", attrs={"units": "mN"})),
        (TIME, xr.DataArray(FORCE, dims="t", attrs={"units": "N"})),
        (UNITS.Quantity(1e6 * TIME, "us"), UNITS.Quantity(1e-3 * FORCE, "kN")),
        (TIME, np.ma.masked_array(FORCE)),
    ],
)
def test_arrays_with_units(time: object, force: object) -> None:
    waves = hl.reflections(hl.as_signal(time, {7: force}), 7)
    assert waves.incident == Wave(pytest.approx(50.0, rel=1e-3), pytest.approx(1e-4, abs=1e-8))
    assert waves.primary.time_of_flight == pytest.approx(3e-4, abs=1e-8)


@pytest.mark.parametrize(
    ("time", "force", "message"),
    [
        (TIME, np.ma.masked_greater(FORCE, 40.0), r"forces\[7\]\[96\] = nan: must be a finite number"),
        (TIME, FORCE + 0j, r"forces\[7\]: must be an array of real numbers.*complex128"),
        (TIME, FORCE.astype(str), r"forces\[7\]: must be .* holds <U32"),
        (TIME, xr.DataArray(FORCE, attrs={"units": "V"}), r"forces\[7\]: must be .* in N .*V"),
        (UNITS.Quantity(TIME, "m"), FORCE, "time: must be .* in s .*meter"),
        (TIME, NS.astype("m8[ns]"), r"forces\[7\]: must be .* holds timedelta64\[ns\]"),
        (NS.astype("m8"), FORCE, r"time: must be .* holds timedelta64"),
        (np.where(NS == 5000, np.timedelta64("NaT", "ns"), NS.astype("m8[ns]")), FORCE, r"time\[5\] = nan: must be"),
        ([[1.0], [1.0, 2.0]], FORCE, "time: must be an array of real numbers"),
    ],
)
def test_arrays_that_are_refused(time: object, force: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.as_signal(time, {7: force})


@pytest.mark.parametrize("order", [slice(None, None, -1), np.random.default_rng(1).permutation(601)])
def test_a_run_whose_times_do_not_increase(order: object) -> None:
    signal = hl.as_signal(TIME, {7: FORCE})
    for measure in (hl.amplitude_ratio, hl.time_of_flight, hl.reflections):
        with pytest.raises(ValueError, match="run: must hold saved times that increase"):
            measure(signal.isel(time=order), 7)
