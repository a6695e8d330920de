"""AR near a corner of two edges: against images where they are exact, and against the edges by themselves."""

import numpy as np
import pytest
import xarray as xr
from scipy import sparse
from scipy.special import j0

import hertzlink as hl
from hertzlink.studies import corner as study
from hertzlink.studies.table import text
from structures.surface import Surface

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True, jobs=1)


def images(x: float, y: float) -> hl.Structure:
    """A corner of two simple edges, exact by images: Re Y = (1 − J₀(2kx) − J₀(2ky) + J₀(2k√(x² + y²)))/8√(Dm).

    As oscillators: Gauss points over the wavenumber up to 100 kHz, and the compliance of the infinite plate above.
    """
    plate = study.plate("free-free")
    diffusion, impedance = (plate.rigidity / plate.mass_per_area) ** 0.5, plate.point_impedance
    highest = (2.0 * np.pi * 100e3 / diffusion) ** 0.5
    ends = np.sqrt(np.linspace(0.0, highest**2, 60))
    places, weights = np.polynomial.legendre.leggauss(16)
    half, middle = np.diff(ends)[:, None] / 2.0, (ends[1:] + ends[:-1])[:, None] / 2.0
    k, width = (middle + half * places).ravel(), (half * weights).ravel()
    real = 1.0 - j0(2.0 * k * x) - j0(2.0 * k * y) + j0(2.0 * k * np.hypot(x, y))
    square = 2.0 / np.pi * real / impedance * 2.0 * diffusion * k * width
    return hl.Structure(
        sparse.csr_array(sparse.eye_array(k.size)),
        sparse.csr_array(sparse.diags_array((diffusion * k**2) ** 2)),
        None,
        np.sqrt(square),
        2.0 / (np.pi * impedance * diffusion * highest**2),
        Surface(study.MATERIAL),
        {"kind": "corner of two simple edges"},
    )


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.5), (0.7, 1.3), (1.5, 1.5)])
def test_corner_of_simple_edges_against_images(x: float, y: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The study's mesh, reduction and side, on the one corner that is known exactly."""
    monkeypatch.setitem(study.CORNERS, "simple-simple", ("simple", "simple"))
    x, y = x * study.unit(), y * study.unit()
    ratios = [
        float(study.measure(hl.CoSimulation(study.CHAIN, structure).run(study.UNTIL)).amplitude_ratio)
        for structure in (study.at_corner("simple-simple", x, y), images(x, y))
    ]
    assert ratios[0] == pytest.approx(ratios[1], abs=2e-3)


@pytest.mark.thorough
def test_far_from_one_edge_the_corner_is_the_other(quick: xr.Dataset) -> None:
    for corner, (first, second) in study.CORNERS.items():
        one = quick.corner_ratio.sel(corner=corner)
        np.testing.assert_allclose(one.sel(y=3.0), quick.corner_edge_ratio.sel(corner_edge=first), atol=5e-3)
        np.testing.assert_allclose(one.sel(x=3.0), quick.corner_edge_ratio.sel(corner_edge=second), atol=5e-3)


@pytest.mark.thorough
def test_two_like_edges_are_symmetric(quick: xr.Dataset) -> None:
    for corner in ("clamped-clamped", "free-free"):
        one = quick.corner_ratio.sel(corner=corner).values
        np.testing.assert_allclose(one, one.T, atol=1e-4)


@pytest.mark.thorough
def test_superposition_holds_away_from_the_corner(quick: xr.Dataset) -> None:
    """From 1.5 ℓ on two edges add up to 0.02; at half an ℓ from two clamped edges they do not to 0.1."""
    assert all(study.worst(quick, corner, 1.5) < 0.02 for corner in study.CORNERS)
    assert study.worst(quick, "clamped-clamped", 0.5) > 0.1


@pytest.mark.thorough
def test_table_and_figure(quick: xr.Dataset) -> None:
    rows = study.table(quick)
    assert [row.thesis for row in rows] == [""] * len(study.CORNERS)
    assert "corner clamped-free" in text(rows).replace("\n", " ")
    figure = study.figure(quick)
    assert sum("x/ℓ" in axis.get_xlabel() for axis in figure.axes) == len(study.CORNERS)
