"""The length study compared with numbers that were recomputed independently, at γ = 5 N s/m."""

import pytest
import xarray as xr
from printed import check

from hertzlink.studies import rod_length as study

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True, jobs=1)


def test_amplitude_ratio_falls_about_the_characteristic_length(quick: xr.Dataset) -> None:
    """0.747 for short rods, 0.715 at 101.6 mm, 0.707 beyond 200 mm."""
    ratios = quick.amplitude_ratio.sel(wave="primary", dashpot=5.0)
    short, long = ratios.sel(length=slice(None, 0.03)), ratios.sel(length=slice(0.2, None))
    assert min(short.size, long.size) > 1
    assert short.values == pytest.approx(0.747, abs=0.005)
    assert ratios.sel(length=0.1016, method="nearest").item() == pytest.approx(0.715, abs=0.005)
    assert long.values == pytest.approx(0.707, abs=0.005)
    assert 0.1016 in quick.length.values.round(6)


def test_time_of_flight_hardly_changes(quick: xr.Dataset) -> None:
    """460.8 to 462.6 µs."""
    flights = quick.time_of_flight.sel(wave="primary", dashpot=5.0) * 1e6
    assert flights.min().item() == pytest.approx(460.8, abs=1.0)
    assert flights.max().item() == pytest.approx(462.6, abs=1.0)


def test_axisymmetric_cylinder_is_the_rod(quick: xr.Dataset) -> None:
    rods = quick.sel(dashpot=5.0, wave="primary").interp(length=quick.solid_length)
    solids = quick.sel(wave="primary")
    assert solids.solid_amplitude_ratio.values == pytest.approx(rods.amplitude_ratio.values, abs=1e-3)
    assert (solids.solid_time_of_flight * 1e6).values == pytest.approx((rods.time_of_flight * 1e6).values, abs=0.3)


def test_theory(quick: xr.Dataset) -> None:
    """Recomputed in facts.yaml: 100.2 mm with Table 2.1."""
    assert study.THESIS.theory_length() == pytest.approx(100.2e-3, abs=1e-4)


def test_table_and_figures(quick: xr.Dataset) -> None:
    rows = study.table(quick)
    check("rod-length", rows)
    assert any("γ is not given" in row.reason for row in rows)
    assert set(study.figures(quick)) == {"length", "force_intensity"}
