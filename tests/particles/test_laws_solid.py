"""Three dimensions: Johnson's line contact, axisymmetric laws and modes, the mid-plane's correction, Lamb's sphere."""

from math import pi
from typing import Any

import numpy as np
import pytest
from scipy.special import spherical_jn
from skfem import Basis, ElementTetP2, ElementVector

import hertzlink as hl
from particles.deformable.solid_vibration import vibration_of_solid
from particles.deformable.vibration import Vibration, vibration
from particles.laws.axisymmetric import contact_law_fem
from particles.laws.computed import ComputedLaw
from particles.laws.solid import _by_curvature, contact_law_solid, midplane_correction
from particles.laws.solid_mesh import contact_eighth, supported
from structures.bodies.elasticity import pressure_speed, shear_speed
from structures.structure import Vector

STEEL = hl.STEEL_316
RADIUS = 2.38e-3
SPHERE = hl.Sphere(RADIUS, STEEL)
CYLINDER = hl.Cylinder(RADIUS, 4.76e-3, STEEL)


@pytest.fixture(scope="module")
def parallel() -> ComputedLaw:
    return contact_law_solid(CYLINDER, CYLINDER, max_approach=0.76e-6, spacing=4e-6)


@pytest.mark.parametrize(("bead", "reach"), [(CYLINDER, 25e-6), (SPHERE, 100e-6)])
def test_volume_and_arc(bead: hl.Cylinder | hl.Sphere, reach: float) -> None:
    """The eighth has an eighth of the bead's mass, surface nodes on the arc, mid-side ones too, and no cell is flat."""
    part = contact_eighth(bead, reach, 0.1 * reach)
    basis = Basis(part.mesh, ElementVector(ElementTetP2()), intorder=5)
    assert float(basis.dx.sum()) * STEEL.density == pytest.approx(bead.mass / 8.0, rel=3e-4)
    volumes = basis.mapping.detDF(basis.quadrature[0])
    flat = np.cross(*(part.box[:, part.mesh.t[i]].T - part.box[:, part.mesh.t[0]].T for i in (1, 2)))
    sixth = np.einsum("ij,ij->i", flat, part.box[:, part.mesh.t[3]].T - part.box[:, part.mesh.t[0]].T)
    assert np.all(volumes * -np.sign(sixth)[:, None] > 0.0)
    x, y, z = part.mesh.doflocs[:, part.box[2] == 0.0]
    distance = np.hypot(x, z) if bead is CYLINDER else np.sqrt(x**2 + y**2 + z**2)
    assert distance == pytest.approx(RADIUS, rel=1e-13)
    nodes = part.touching(reach)
    assert part.drop(nodes) == pytest.approx(RADIUS - part.mesh.doflocs[2, nodes], abs=1e-17)


def test_even_pull_is_even() -> None:
    """The patch test: u = (−νx, −νy, z) strains evenly: no node inside feels a force; the energy is that of σ = E."""
    part = contact_eighth(SPHERE, 100e-6, 50e-6, coarser=2.0)
    body = supported(part)
    motion, free = np.zeros(body.stiffness.shape[0]), body.motions >= 0
    motion[body.motions[free]] = (np.array([[-0.3], [-0.3], [1.0]]) * part.mesh.doflocs)[free]
    felt = body.stiffness @ motion
    outside = (part.box[2] == 0.0) | (part.box[:2].max(axis=0) == part.box[0].max())
    assert np.abs(felt[body.motions[free & ~outside]]).max() < 1e-10 * np.abs(felt).max()
    volume = 4.0 / 3.0 * pi * RADIUS**3
    assert float(motion @ felt) == pytest.approx(STEEL.youngs_modulus * volume / 8.0, rel=2e-3)


@pytest.mark.thorough
def test_parallel_cylinders(parallel: ComputedLaw) -> None:
    """Errata: exponent 1.07 to 1.08 over 1 to 100 N. Ends that are free make them softer than in plane strain, and the
    middle stiffer than in plane stress, by no more than 1 − ν²."""
    one, hundred = (float(parallel.approach(np.array(force))) for force in (1.0, 100.0))
    assert hl.laws.fit_power_law(parallel, one, hundred).exponent == pytest.approx(1.075, abs=0.005)
    approaches = np.geomspace(one, hundred, 50)
    ratio = parallel.force(approaches) / hl.contact_law(CYLINDER, CYLINDER).force(approaches)
    assert np.all(ratio < 1.0)
    assert np.all(ratio > 1.0 - 0.3**2)
    assert parallel.error < 0.015
    assert parallel.caution == ""


@pytest.mark.thorough
def test_long_cylinders() -> None:
    """Johnson's plane strain, but for ends that are free: the mean of σ_y = ν σ_z across the section, −2νF*/πR, is not
    there, which lets the mid-planes come closer by 4ν²F*/πE, 1.7 % of the approach. The rest is 0.6 %."""
    long = hl.Cylinder(RADIUS, 50.0 * RADIUS, STEEL)
    law = contact_law_solid(long, max_approach=0.5e-6, spacing=5e-6)
    forces = np.geomspace(float(law.force(np.array(law.smallest))), float(law.force(np.array(law.largest))), 10)
    closer = 4.0 * STEEL.poisson_ratio**2 * forces / (pi * STEEL.youngs_modulus * long.length)
    assert law.approach(forces) == pytest.approx(hl.contact_law(long, long).approach(forces) + closer, rel=0.006)


@pytest.mark.thorough
def test_finer_cells_say_the_same(parallel: ComputedLaw) -> None:
    """A quarter of the size: within 0.5 %, where the coarse law is computed and where it is carried on to 1 N."""
    fine = contact_law_solid(CYLINDER, max_force=100.0)
    assert float(fine.force(np.array(fine.largest))) == pytest.approx(100.0, rel=1e-9)
    approaches = np.geomspace(fine.smallest, fine.largest, 50)
    assert parallel.force(approaches) == pytest.approx(fine.force(approaches), rel=0.005)


@pytest.mark.thorough
def test_sphere_is_that_of_the_axisymmetric_law() -> None:
    """The same physics on another mesh and by other elements: within 1 %, the scatter included."""
    law = contact_law_solid(SPHERE, max_approach=10e-6, spacing=20e-6)
    assert law.formula == pytest.approx(float(hl.contact_law(SPHERE, SPHERE).force(np.array(law.approaches[-1]))))
    approaches = np.geomspace(4e-6, 10e-6, 20)
    assert law.force(approaches) == pytest.approx(
        contact_law_fem(SPHERE, max_approach=10e-6).force(approaches), rel=0.01
    )


def axisymmetric_correction(radius: float) -> float:
    """c of the sphere, m/N, by the axisymmetric law at a contact of a radius, m."""
    approach = 2.0 * radius**2 / RADIUS
    force = contact_law_fem(SPHERE, max_approach=approach).force(np.array(approach))
    return float((hl.contact_law(SPHERE, SPHERE).approach(force) - approach) / (2.0 * force))


@pytest.mark.thorough
def test_midplane_correction_of_a_sphere() -> None:
    """The axisymmetric law's at contacts of 0.03 radii, of another mesh and method, within 8 %."""
    assert midplane_correction(SPHERE) == pytest.approx(axisymmetric_correction(0.03 * RADIUS), rel=0.08)


@pytest.mark.thorough
def test_correction_grows_with_the_logarithm_of_the_contact() -> None:
    """From 0.002 to 0.02 radii by the axisymmetric law, where the arc is still a parabola."""
    gain = axisymmetric_correction(0.02 * RADIUS) - axisymmetric_correction(0.002 * RADIUS)
    assert gain == pytest.approx(_by_curvature(SPHERE) * np.log(10.0), rel=0.1)


@pytest.mark.thorough
def test_midplane_correction_of_cylinders() -> None:
    """By 1/ER; little by the length of long ones; somewhat more than the sphere's."""
    cylinder, sphere = midplane_correction(CYLINDER), midplane_correction(SPHERE)
    large = hl.Cylinder(1.0, 2.0, hl.Material(1e9, 0.3, 1000.0))
    scale = STEEL.youngs_modulus * RADIUS / 1e9
    assert midplane_correction(large) == pytest.approx(scale * cylinder, rel=1e-6)
    assert sphere < cylinder < 1.5 * sphere
    assert midplane_correction(hl.Cylinder(RADIUS, 10 * RADIUS, STEEL)) == pytest.approx(cylinder, rel=0.1)


@pytest.fixture(scope="module")
def modes() -> Vibration:
    return vibration_of_solid(SPHERE, 6, RADIUS / 4.0)


def lambs_frequencies(order: int) -> Vector:
    """ω, rad/s, of the sphere's spheroidal modes of an order: zeros of what the free surface asks (Sato and Usami,
    Geophysical Magazine 31 (1962) 15; Lamb's for order 0), times both Bessel functions, which has no poles."""
    y = np.linspace(0.5, 6.0, 20_000)
    x = y * shear_speed(STEEL) / pressure_speed(STEEL)
    (p, p_next), (s, s_next) = ((spherical_jn(order, z), z * spherical_jn(order + 1, z)) for z in (x, y))
    rest, other = (order - 1) * (order + 2), (order - 1) * (2 * order + 1)
    asked = 2.0 * p_next * (y**2 * s + rest * (s_next - (order + 1) * s))
    asked += p * ((other * y**2 - 0.5 * y**4) * s + (y**2 - 2.0 * order * rest) * s_next)
    if order == 0:
        asked = (1.0 - 0.25 * y**2) * np.sin(x) - x * np.cos(x)
    zeros = np.flatnonzero(asked[1:] * asked[:-1] < 0.0)
    found: Vector = y[zeros] * shear_speed(STEEL) / RADIUS
    return found


def test_lambs_sphere(modes: Vibration) -> None:
    """The six lowest spheroidal modes of all orders, within 1 %; what does not move along the axis is left out."""
    exact = np.sort(np.concatenate([lambs_frequencies(order) for order in range(7)]))[:6]
    assert modes.frequencies == pytest.approx(exact, rel=0.01)
    assert np.all(modes.frequencies > exact)


def test_modes_are_the_axisymmetric_ones(modes: Vibration) -> None:
    """Pole motions, momenta and compliances of another mesh and other elements; poorer where two modes are close."""
    same = vibration(SPHERE, 6)
    assert modes.struck[:4] == pytest.approx(same.struck[:4], rel=0.04)
    assert modes.struck[5] == pytest.approx(same.struck[5], rel=0.04)
    assert np.sign(modes.far) == pytest.approx(np.sign(same.far))
    assert np.abs(modes.far) == pytest.approx(modes.struck, rel=1e-12)
    assert modes.section == pytest.approx(same.section, abs=0.01 * np.abs(same.section).max())
    assert modes.compression == pytest.approx(same.compression, rel=0.02)
    assert modes.cross == pytest.approx(same.cross, rel=0.05)


@pytest.mark.thorough
def test_frequencies_converge() -> None:
    """By the size of the cells to 3.4; to 4 where no cell were flattened, as they are at the edges of the box."""
    coarse, fine = (vibration_of_solid(SPHERE, 3, RADIUS / cells).frequencies for cells in (3, 6))
    off = [frequencies / vibration(SPHERE, 3, RADIUS / 32.0).frequencies - 1.0 for frequencies in (coarse, fine)]
    assert np.log2(off[0] / off[1]) == pytest.approx(3.4, abs=0.2)


@pytest.mark.parametrize(
    ("first", "second", "asked", "words"),
    [
        (CYLINDER, None, {}, "max_force = None, max_approach = None"),
        (CYLINDER, None, {"max_force": 1.0, "max_approach": 1e-6}, "max_force = 1.0, max_approach = 1e-06"),
        (CYLINDER, None, {"max_approach": -1e-6}, "max_approach"),
        (CYLINDER, None, {"max_force": 0.0}, "max_force"),
        (CYLINDER, None, {"max_approach": 1e-6, "spacing": 20e-6}, "spacing = 2e-05 m: leaves"),
        (CYLINDER, None, {"max_approach": 1e-6, "spacing": 1e-9}, "spacing"),
        (SPHERE, None, {"max_approach": 2e-3}, "max_approach = 0.002: must lie between"),
        (SPHERE, None, {"max_approach": 1.1e-3}, "max_approach: the contact is wider"),
        (CYLINDER, hl.Cylinder(RADIUS, 2e-3, STEEL), {"max_approach": 1e-6}, "second"),
        (CYLINDER, hl.Cylinder(RADIUS, 4.76e-3, STEEL, 0.5), {"max_approach": 1e-6}, "second"),
        (SPHERE, CYLINDER, {"max_approach": 1e-6}, "second"),
        (hl.HollowSphere(RADIUS, 1e-3, STEEL), None, {"max_approach": 1e-6}, "first"),
        (SPHERE, None, {"max_approach": 1e-30}, "max_approach = 1e-30: must lie between"),
        (SPHERE, None, {"max_force": 1e12}, "max_force = 1000000000000.0: must lie between"),
        (SPHERE, None, {"max_force": 1.0, "spacing": "fine"}, "spacing = 'fine'"),
        (CYLINDER, None, {"max_approach": 1e-6, "spacing": 1e-8}, "spacing = 1e-08 m: .* nodes may touch"),
        ("ball", None, {"max_approach": 1e-6}, "first"),
    ],
)
def test_bad_input(first: object, second: object, asked: dict[str, object], words: str) -> None:
    """A ValueError names what is wrong."""
    with pytest.raises(ValueError, match=words):
        contact_law_solid(first, second, **asked)  # type: ignore[arg-type]


def test_bad_beads_have_no_correction() -> None:
    """Other bodies, and cylinders too short for a contact."""
    with pytest.raises(ValueError, match="bead"):
        midplane_correction(hl.Ellipsoid(2e-3, 5e-3, STEEL))  # type: ignore[arg-type]
    with pytest.raises(ValueError, match=r"length = 0\.001"):
        midplane_correction(hl.Cylinder(RADIUS, 1e-3, STEEL))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ((CYLINDER, 3), "bead"),
        ((SPHERE, -1), "modes = -1"),
        ((SPHERE, 400, RADIUS / 2.0), "modes = 400"),
        ((SPHERE, 3, 0.0), "spacing"),
        ((SPHERE, 3, RADIUS / 50.0), "spacing"),
    ],
)
def test_bad_vibrations(arguments: tuple[Any, ...], words: str) -> None:
    """Other beads, and meshes too coarse or too fine."""
    with pytest.raises(ValueError, match=words):
        vibration_of_solid(*arguments)


def test_cautions() -> None:
    """Coarse meshes and large strains are named by the law, and warned of."""
    with pytest.warns(hl.HertzlinkWarning, match="contact law: ") as caught:
        law = contact_law_solid(SPHERE, max_approach=0.2e-3, spacing=0.24e-3)
    assert "small strains" in law.caution
    assert "leave the force off" in law.caution
    assert f"contact law: {law.caution}" in [str(one.message) for one in caught]
