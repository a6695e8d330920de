"""The fields of plates: waves that run over them, and the mirrored half."""

import numpy as np
import pytest

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
UNTIL = 2.5e-4
SIDE, THICKNESS = 0.16, 2e-3
PLATE = hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped"))


def moved(structure: hl.Structure) -> tuple[object, object]:
    run = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.4), structure).run(UNTIL)
    return run, hl.plots.motion(run, structure, np.linspace(5e-5, UNTIL, 5))


def test_symmetric_halves_show_the_whole_plate() -> None:
    """Struck at the centre a quarter is kept, slightly off it the whole: the same deflection everywhere."""
    quarter = hl.reduce(PLATE.at(SIDE / 2.0, SIDE / 2.0), UNTIL, keep_field=True)
    whole = hl.reduce(PLATE.at(SIDE / 2.0 + 1e-6, SIDE / 2.0 + 1e-6), UNTIL, keep_field=True)
    (_, one), (_, other) = moved(quarter), moved(whole)
    for motion in (one, other):
        assert motion.position.values.max(axis=0)[:2] == pytest.approx([SIDE, SIDE])
        assert motion.position.values.min(axis=0)[:2] == pytest.approx([0.0, 0.0])
    deepest = [motion.displacement.sel(component="z").min("point").values for motion in (one, other)]
    assert deepest[0] == pytest.approx(deepest[1], rel=1e-3)
    swung = one.displacement.sel(component="z").values
    place = one.position.values[:, :2]
    turned = [np.flatnonzero(np.allclose(place, [SIDE, SIDE] - at, atol=1e-9)) for at in place[:1]]
    assert len(turned) == 1
    mirror = np.array([np.argmin(((place - ([SIDE, SIDE] - at)) ** 2).sum(axis=1)) for at in place[::7]])
    assert swung[:, mirror] == pytest.approx(swung[:, ::7], abs=1e-9 * abs(swung).max())


def test_the_contact_and_the_clamped_edge() -> None:
    """The contact's point moves as the run says; clamped edges stay, free ones swing."""
    structure = hl.reduce(PLATE.at(0.05, SIDE / 2.0), UNTIL, keep_field=True)
    run, motion = moved(structure)
    place, sunk = motion.position.values, -motion.displacement.sel(component="z").values
    at = np.argmin(((place[:, :2] - [0.05, SIDE / 2.0]) ** 2).sum(axis=1))
    expected = run.surface_displacement.sel(time=motion.time).values
    assert sunk[:, at] == pytest.approx(expected, abs=2e-3 * abs(expected).max())
    assert abs(sunk[:, (place[:, 0] < 1e-9) | (place[:, 0] > SIDE - 1e-9)]).max() < 1e-9 * sunk.max()
    assert abs(sunk[-1, place[:, 1] < 1e-9]).max() > 0.05 * sunk[-1].max()


def test_a_plate_bends_like_a_cylinder_under_its_moment_and_twists() -> None:
    """w = x²: the moments D (1, ν) · 2, and 6 M/t² at the struck face. w = xy: the shear stress G t there."""
    free = hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, hl.ALUMINIUM_6061, hl.Supports(), cells=(4, 4)).at(0.05, 0.07)
    assert free.field is not None
    x = np.linspace(0.0, SIDE, 5)
    u = np.kron(np.c_[x**2, 2.0 * x].ravel(), np.tile([1.0, 0.0], 5))
    stress, nu = free.field.stress(u), hl.ALUMINIUM_6061.poisson_ratio
    moment = 2.0 * PLATE.rigidity
    assert stress[:, 0] == pytest.approx(6.0 * moment / THICKNESS**2, rel=1e-9)
    assert stress[:, 1] == pytest.approx(6.0 * nu * moment / THICKNESS**2, rel=1e-9)
    assert abs(stress[:, 3]).max() < 1e-6 * stress.max()
    twisted = np.kron(np.c_[x, np.ones(5)].ravel(), np.c_[x, np.ones(5)].ravel())
    shear = hl.ALUMINIUM_6061.youngs_modulus / (2.0 * (1.0 + nu)) * THICKNESS
    assert free.field.stress(twisted)[:, 3] == pytest.approx(shear, rel=1e-9)
