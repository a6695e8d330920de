"""Beams under an axial force: closed forms of frequencies and of buckling loads, statics on elastic ground, energy."""

from math import pi

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import eigsh

import hertzlink as hl

beam = hl.beam

LENGTH, STIFFNESS, MASS = 0.8, 120.0, 1.5
EULER = pi**2 * STIFFNESS / LENGTH**2


def frequencies(structure: hl.Structure, count: int) -> np.ndarray:
    """Lowest angular frequencies, rad/s; with unit diagonals, which keep the digits."""
    scale = sparse.diags_array(1.0 / np.sqrt(structure.stiffness.diagonal()))
    stiffness, mass = (sparse.csc_array(scale @ one @ scale) for one in (structure.stiffness, structure.mass))
    return np.sqrt(np.sort(eigsh(stiffness, count, M=mass, sigma=0.0, return_eigenvectors=False)))


def strip(**given: object) -> hl.Structure:
    return beam(LENGTH, STIFFNESS, MASS, hl.STEEL_316, **{"at": 0.31, **given})


@pytest.mark.parametrize("force", [-0.9, 0.0, 3.0])
@pytest.mark.parametrize("ground", [0.0, 1e4])
def test_frequencies_of_a_simple_beam(force: float, ground: float) -> None:
    """m ω² = EI k⁴ + N k² + foundation with k = nπ/L."""
    k = pi * np.arange(1, 6) / LENGTH
    exact = np.sqrt((STIFFNESS * k**4 + force * EULER * k**2 + ground) / MASS)
    found = frequencies(strip(axial_force=force * EULER, foundation=ground, highest_frequency=5e5), 5)
    assert found == pytest.approx(exact, rel=1e-6)


@pytest.mark.parametrize(
    ("supports", "factor"),
    [
        (("simple", "simple"), 1.0), (("clamped", "clamped"), 4.0), (("clamped", "free"), 0.25),
        (("clamped", "simple"), 2.04575), (("clamped", "symmetry"), 1.0),
    ],
)  # fmt: skip
def test_a_beam_that_buckles_is_refused(supports: tuple[str, str], factor: float) -> None:
    """Euler's cases, in π² EI/L²."""
    strip(axial_force=-0.99 * factor * EULER, supports=supports)
    with pytest.raises(ValueError, match="must be less compressive, as it buckles the beam"):
        strip(axial_force=-1.01 * factor * EULER, supports=supports)


def test_buckling_on_ground() -> None:
    """A simple beam: least (EI k² + foundation/k²) over k = nπ/L; a long one: 2 √(EI · foundation)."""
    k, ground = pi * np.arange(1, 30) / LENGTH, 3e6
    exact = float((STIFFNESS * k**2 + ground / k**2).min())
    long = 2.0 * np.sqrt(STIFFNESS * ground)
    for length, load in ((LENGTH, exact), (20.0, long)):
        beam(length, STIFFNESS, MASS, hl.STEEL_316, 0.31, axial_force=-0.995 * load, foundation=ground)
        with pytest.raises(ValueError, match="must be less compressive, as it buckles the beam"):
            beam(length, STIFFNESS, MASS, hl.STEEL_316, 0.31, axial_force=-1.005 * load, foundation=ground)


def test_long_beam_on_ground_sinks_as_winkler_says() -> None:
    """F/8 EI β³, 4 EI β⁴ = foundation."""
    ground = 1e7
    beta = (ground / 4.0 / STIFFNESS) ** 0.25
    long = beam(4.0, STIFFNESS, MASS, hl.STEEL_316, 2.0, ("free", "free"), foundation=ground)
    sinking = long.contact @ np.linalg.solve(long.stiffness.toarray(), long.contact)
    assert sinking == pytest.approx(1.0 / (8.0 * STIFFNESS * beta**3), rel=1e-3)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"at": 0.9}, r"at = 0\.9: must lie between 0 and 0\.8 m"),
        ({"supports": ("simple", "fixed")}, r"supports = \('simple', 'fixed'\): must be two words, each one of"),
        ({"supports": "simple"}, "supports = 'simple': must be two words"),
        ({"axial_force": "much"}, "axial_force = 'much'"),
        ({"axial_force": -2.0 * EULER}, r"axial_force = .*: must be less compressive, as it buckles the beam"),
        ({"axial_force": -1.0, "supports": ("free", "free")}, "must be less compressive, as it buckles the beam"),
        ({"axial_force": -0.01 * EULER, "supports": ("free", "simple")}, "must be less compressive, as it buckles the"),
        ({"foundation": -1.0}, r"foundation = -1\.0"),
        ({"highest_frequency": 1e15}, "requires more than 50000 nodes"),
    ],
)
def test_bad_input(given: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        strip(**given)
