"""The study of pressure: what a tap sees of it, where a closed form says so, bounds."""

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from hertzlink.studies import pressure as study

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True)


@pytest.mark.thorough
def test_the_wave_comes_back_earlier(quick: xr.Dataset) -> None:
    """As on tennis balls (Nasrollahi, Rizzo, Orak 2018)."""
    assert (quick.time_of_flight.diff("case") < 0.0).all()


@pytest.mark.thorough
def test_a_soft_ball_answers_as_its_stiffness_says(quick: xr.Dataset) -> None:
    """The last bead rebounds from the ball, lighter than the bead, as from a spring: in a time that goes as k^(−½)."""
    ball = study.SHELLS[0]
    found = quick.sel(shell="ball")
    sphere = hl.theory.ThinSphere(ball.radius, ball.thickness, ball.material)
    stiffness = [sphere.point_stiffness(one) for one in found.pressure.values]
    ratio = found.time_of_flight.values / float(found.time_of_flight[0])
    assert ratio == pytest.approx(np.sqrt(stiffness[0] / np.array(stiffness)), rel=0.05)


@pytest.mark.thorough
def test_bounds_do_not_depend_on_the_step(quick: xr.Dataset) -> None:
    vessel = study.coarser(study.SHELLS[2])
    assert vessel.bound(1.0) == pytest.approx(float(quick.sel(shell=vessel.name).deviation), rel=0.05)


@pytest.mark.thorough
def test_the_thinner_the_wall_the_better_the_bound(quick: xr.Dataset) -> None:
    """In units of the buckling pressure all bounds are of one order, so a thick vessel hides its pressure."""
    relative = (quick.deviation / quick.buckling_pressure).values
    assert relative.max() / relative.min() < 5.0
    near = np.array([one.near for one in study.SHELLS])
    assert (quick.deviation.values / near)[:2].max() < 0.03 < 0.2 < quick.deviation.values[2] / near[2]


@pytest.mark.thorough
def test_figure_has_units(quick: xr.Dataset) -> None:
    (figure,) = study.figures(quick).values()
    assert [axis.get_ylabel() for axis in figure.axes] == ["AR − AR without pressure", "change of TOF (%)"]
