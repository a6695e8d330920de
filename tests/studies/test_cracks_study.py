"""The study of cracks: its limits, and that the state of a gap depends on the amplitude."""

import numpy as np
import pytest
import xarray as xr

from hertzlink.studies import cracks as study

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True)


@pytest.mark.thorough
def test_a_closed_gap_is_what_the_linear_model_says(quick: xr.Dataset) -> None:
    linear = quick.limit_amplitude_ratio.sel(limit="closed")
    assert float(abs(quick.amplitude_ratio.sel(opening=0.0) - linear).max()) < 5e-4


@pytest.mark.thorough
def test_faster_taps_close_wider_gaps(quick: xr.Dataset) -> None:
    """From open to closed with the speed, and from closed to open with the opening."""
    open_, closed = (quick.limit_amplitude_ratio.sel(limit=name) for name in ("open", "closed"))
    part = ((quick.amplitude_ratio - open_) / (closed - open_)).transpose("body", "opening", "impact_speed").values
    assert (np.diff(part, axis=2) > -0.02).all()
    assert (np.diff(part, axis=1) < 0.02).all()
    assert part.min() > -0.02
    assert part.max() < 1.02


@pytest.mark.thorough
def test_table_and_figure(quick: xr.Dataset) -> None:
    rows = study.table(quick)
    assert not any("half-way" in row.quantity for row in rows)
    (figure,) = study.figures(quick).values()
    assert all("(m/s)" in axis.get_xlabel() for axis in figure.axes)
