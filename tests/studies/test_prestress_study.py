"""The study of stress: bounds that do not depend on the step, and their size where a closed form gives it."""

import numpy as np
import pytest
import xarray as xr

from hertzlink.studies import prestress as study

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True)


@pytest.mark.thorough
def test_bounds_do_not_depend_on_the_step(quick: xr.Dataset) -> None:
    found = quick.isel(body=[0, 1])
    assert found.deviation.values == pytest.approx(found.deviation_by_twice_the_step.values, rel=0.05)


@pytest.mark.thorough
def test_a_stiffer_plate_answers_earlier(quick: xr.Dataset) -> None:
    """Tension raises all frequencies, so the wave comes back earlier."""
    for body in quick.body.values[:2]:
        assert (np.diff(quick.time_of_flight.sel(body=body).dropna("case")) < 0.0).all()


@pytest.mark.thorough
def test_a_rail_is_blind_as_its_bending_is_stiff(quick: xr.Dataset) -> None:
    """At the wavenumber of 5 kHz, 100 MPa change N k² + EI k⁴ by 0.3 %: AR changes by less than 1e-3."""
    rail = quick.sel(body="rail 60E1").dropna("case")
    bending = study.RAIL_STEEL.youngs_modulus * study.RAIL_INERTIA
    wavenumber = (study.RAIL_MASS * (2.0 * np.pi * 5e3) ** 2 / bending) ** 0.25
    assert 100e6 * study.RAIL_AREA / (bending * wavenumber**2) == pytest.approx(3.0e-3, rel=0.02)
    assert np.ptp(rail.amplitude_ratio.values) < 1e-3
    rows = {row.quantity: row for row in study.table(quick)}
    assert rows["the same as a temperature, rail 60E1"].computed == "above 1000"


@pytest.mark.thorough
def test_figure_has_units(quick: xr.Dataset) -> None:
    (figure,) = study.figures(quick).values()
    assert all("(MPa)" in axis.get_xlabel() for axis in figure.axes)
