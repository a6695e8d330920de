"""The study critical-distance: the collapse, the law against its simulations, and shear."""

import numpy as np
import pytest
import xarray as xr

from hertzlink.studies import critical_distance as study
from hertzlink.studies import edge_shear
from hertzlink.studies.table import text

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True, jobs=1)


@pytest.mark.thorough
def test_quick_study(quick: xr.Dataset) -> None:
    """AR falls towards its far value away from an edge that is held, and rises from a free one; pairs collapse."""
    difference = quick.amplitude_ratio - quick.far_ratio
    assert (difference.sel(edge=["clamped", "simple"]).isel(scaled_distance=0) > 0.1).all()
    assert (difference.sel(edge="free").isel(scaled_distance=0) < -0.1).all()
    assert abs(difference.isel(scaled_distance=-1)).max() < 3e-3
    assert abs(quick.table_error).where(quick.scaled_distance > 0.5).max() < 2e-3
    assert abs(quick.material_deviation.sel(pair="4.76 mm beads")).max() < 5e-4
    assert abs(quick.other_error).max() < 5e-3
    rows = text(study.table(quick))
    assert "law's largest error, free" in rows
    assert max(map(len, rows.splitlines())) <= 80
    assert set(study.figures(quick)) == {"collapse", "corner", "critical_distance", "jumps", "materials", "shear"}


def test_the_last_crossing_of_samples() -> None:
    """AR that decays as e^{−x} crosses 0.02 at ln 50, and the last swing of a cosine counts; NaN where it has not."""
    distances = np.linspace(0.1, 6.0, 60)
    assert study.crossing(np.exp(-distances), 0.02, distances) == pytest.approx(np.log(50.0), abs=1e-3)
    swing = 0.03 * np.cos(distances) * (distances < 4.5)
    assert study.crossing(swing, 0.02, distances) == pytest.approx(np.pi + np.arccos(2.0 / 3.0), abs=2e-3)
    assert np.isnan(study.crossing(np.exp(-distances), 1e-3, distances))


def test_where_shear_counts() -> None:
    """A loss of AR of (t/ℓ)²/5 is 0.01 at t/ℓ = 0.2236."""
    thickness = np.array([0.1, 0.2, 0.4])
    assert edge_shear.limit(thickness, thickness**2 / 5.0) == pytest.approx(0.05**0.5)
