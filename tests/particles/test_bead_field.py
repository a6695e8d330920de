"""Fields of pressed beads: Hertz's stresses, approach, sections, symmetry, the modes' part, bad input."""

from math import pi

import numpy as np
import pytest
from scipy.integrate import simpson

import hertzlink as hl
from particles.deformable.bead_field import BeadField, Push
from structures.structure import Vector

STEEL = hl.STEEL_316
SPHERE = hl.Sphere(2.38e-3, STEEL)
SHELL = hl.HollowSphere(9.525e-3, 0.8 * 9.525e-3, hl.ALUMINIUM_6061)
PROLATE = hl.Ellipsoid(2.36e-3, 10.16e-3, STEEL, axis="along")
FORCE, NONE = 20.0, Push(0.0, 0.0)


def pressed(bead: hl.Sphere | hl.HollowSphere | hl.Ellipsoid, force: float = FORCE) -> Push:
    """Pressed by an equal bead: Hertz's radius (3 F R/4 E*)^(1/3) (Johnson, Contact Mechanics, equation 4.22)."""
    modulus = bead.material.youngs_modulus / (2.0 * (1.0 - bead.material.poisson_ratio**2))
    return Push(force, (0.75 * force / (2.0 * bead.surface.curvature) / modulus) ** (1.0 / 3.0))


def squeezed(bead: hl.Sphere | hl.HollowSphere | hl.Ellipsoid, modes: int = 0) -> tuple[BeadField, Vector, Vector]:
    push = pressed(bead)
    field = BeadField(bead, modes, push.radius)
    return field, *field.at(push, push, field.at_rest(push, push))


def poles(field: BeadField) -> tuple[int, int]:
    """Numbers of the struck pole and of the other one."""
    r, _, z = field.grid.points.T
    axis = np.flatnonzero(r == 0.0)
    return int(axis[z[axis].argmax()]), int(axis[z[axis].argmin()])


def through_section(field: BeadField, stress: Vector) -> float:
    """Force through the mid-plane, N, positive where it presses."""
    r, _, z = field.grid.points.T
    nodes = np.flatnonzero(abs(z) < 1e-9 * z.max())
    nodes = nodes[np.argsort(r[nodes])]
    return float(-2.0 * pi * simpson(r[nodes] * stress[nodes, 2], x=r[nodes]))


def test_stresses_below_the_contact_are_hertzs() -> None:
    """On the axis (Johnson, equation 3.45): σ_z, σ_r, and the greatest shear, 0.31 p₀ at 0.48 a for ν = 0.3."""
    field, _, stress = squeezed(SPHERE)
    radius, nu = pressed(SPHERE).radius, STEEL.poisson_ratio
    assert nu == 0.3
    pressure = 1.5 * FORCE / (pi * radius**2)
    r, _, z = field.grid.points.T
    axis = np.flatnonzero((r == 0.0) & (z > SPHERE.radius - 3.0 * radius))
    depth = (SPHERE.radius - z[axis]) / radius
    across, hoop, along = stress[axis, :3].T / pressure
    assert along == pytest.approx(-1.0 / (1.0 + depth**2), abs=0.01)
    turn = np.arctan2(1.0, depth)
    expected = -(1.0 + nu) * (1.0 - depth * turn) + 0.5 / (1.0 + depth**2)
    assert across == pytest.approx(expected, abs=0.01)
    assert hoop == pytest.approx(expected, abs=0.01)
    shear = 0.5 * abs(along - across)
    assert shear.max() == pytest.approx(0.31, abs=0.005)
    assert depth[shear.argmax()] == pytest.approx(0.48, abs=0.07)


@pytest.mark.thorough
@pytest.mark.parametrize("bead", [SPHERE, SHELL, PROLATE])
def test_a_squeezed_bead_is_its_own_mirror_image(bead: hl.Sphere) -> None:
    """Its mid-plane bears the force, without shear."""
    field, displacement, stress = squeezed(bead, 6)
    points = np.round(field.grid.points / bead.radius, 9) + 0.0
    order, image = np.lexsort(points.T), np.lexsort((points * [1.0, 1.0, -1.0]).T)
    inner = abs(points[order]).max(axis=1) > 0.0
    order, image = order[inner], image[inner]
    assert displacement[order] == pytest.approx(displacement[image] * [1.0, 1.0, -1.0], abs=1e-17)
    turned = stress[image] * [1.0, 1.0, 1.0, 1.0, -1.0, -1.0]
    assert stress[order] == pytest.approx(turned, abs=1e-9 * abs(stress).max())
    assert through_section(field, stress) == pytest.approx(FORCE, rel=3e-3)


@pytest.mark.parametrize("bead", [SPHERE, SHELL])
def test_a_bead_pushed_at_one_pole_carries_half_the_force(bead: hl.Sphere) -> None:
    """Accelerated evenly: half its mass lies behind the mid-plane. Turned around, it is the same bead."""
    push = pressed(bead)
    field = BeadField(bead, 0, push.radius)
    ahead, behind = (field.at(*pair, np.zeros(0)) for pair in ((push, NONE), (NONE, push)))
    forces = [through_section(field, stress) for _, stress in (ahead, behind)]
    assert forces[0] == pytest.approx(0.5 * FORCE, rel=3e-3)
    assert forces[1] == pytest.approx(forces[0], rel=1e-9)
    struck, far = poles(field)
    assert ahead[0][struck, 2] == -behind[0][far, 2]
    assert ahead[0][far, 2] == pytest.approx(-behind[0][struck, 2], rel=1e-9)
