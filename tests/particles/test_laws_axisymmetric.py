"""Contact laws by finite elements: Hertz, thin shells, the thesis's Table 5.1, conditions of contact, bad input."""

import numpy as np
import pytest

import hertzlink as hl
from particles.laws.axisymmetric import ComputedLaw, computed_law, pressed_to
from particles.laws.axisymmetric_mesh import Body, body_of, surface_compliance
from structures.structure import Vector

ALUMINIUM, STEEL = hl.ALUMINIUM_6061, hl.STEEL_316
RADIUS = 9.525e-3
TABLE_5_1 = {0.0: (3.759e9, 1.504), 0.5: (3.193e9, 1.493), 0.75: (1.174e9, 1.423), 0.908: (4.671e7, 1.222)}
SPHERE = hl.Sphere(RADIUS, ALUMINIUM)


def bead(ratio: float) -> hl.Sphere | hl.HollowSphere:
    return hl.HollowSphere(RADIUS, ratio * RADIUS, ALUMINIUM) if ratio else SPHERE


@pytest.fixture(scope="module")
def laws() -> dict[float, ComputedLaw]:
    return {ratio: computed_law(bead(ratio), max_approach=20e-6) for ratio in TABLE_5_1}


def against_hertz(law: ComputedLaw, first: hl.Sphere, second: hl.Sphere | hl.Surface, approaches: Vector) -> Vector:
    """Relative deviation of the force."""
    return law.force(approaches) / hl.contact_law(first, second).force(approaches) - 1.0


@pytest.mark.parametrize("ratio", TABLE_5_1)
def test_hollow_spheres_of_the_thesis(laws: dict[float, ComputedLaw], ratio: float) -> None:
    """Table 5.1, Abaqus: F(δ) within 4 % from 1 to 20 µm."""
    approaches = np.geomspace(1e-6, 20e-6, 100)
    stiffness, exponent = TABLE_5_1[ratio]
    assert laws[ratio].force(approaches) == pytest.approx(stiffness * approaches**exponent, rel=0.04)
    assert laws[ratio].caution == ""
    assert laws[ratio].largest == 20e-6


def edge_law(body: Body, reach: float, cells: int, growth: float) -> hl.laws.TabulatedLaw:
    """The law of a body and its mirror image: cells up to the reach; growth compared with that of computed_law."""
    r, compliance = surface_compliance(body, reach, reach / cells / growth, growth)
    gap = 2.0 * body.drop(r)
    points = np.array([pressed_to(2.0 * compliance, gap, last) for last in range(2, gap.size, 2)])
    return hl.laws.TabulatedLaw(*points.T)  # type: ignore[arg-type]


@pytest.mark.thorough
def test_observed_order() -> None:
    """A contact much smaller than its bead is Hertz's; the error of the force falls by the square of the cells."""
    body, top = body_of(SPHERE, 1.0, "first"), 1e-12
    approaches = np.linspace(0.3, 1.0, 20) * top
    reach = 1.2 * np.sqrt(0.5 * top * RADIUS)
    errors = [
        np.abs(against_hertz(edge_law(body, reach, cells, 0.8), SPHERE, SPHERE, approaches)).mean()
        for cells in (5, 10, 20)
    ]
    assert errors[-1] < 2e-4
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(2.0, abs=0.2)


@pytest.mark.thorough
def test_error_estimate_and_smoothness(laws: dict[float, ComputedLaw]) -> None:
    """The estimate exceeds the difference from a law of half the spacing, and its tangent does not scatter."""
    law = laws[0.908]
    finer = computed_law(bead(0.908), max_approach=20e-6, spacing=3e-6)
    approaches = np.geomspace(law.smallest, law.largest, 200)
    error = np.abs(law.force(approaches) / finer.force(approaches) - 1.0).max()
    assert 0.3 * law.error < error < law.error < 0.003
    exponents = approaches * law.tangent(approaches) / law.force(approaches)
    assert np.all(np.diff(exponents) < 1e-3)
    assert exponents[0] < 1.45
    assert exponents[-1] == pytest.approx(1.17, abs=0.01)
    below = np.geomspace(1e-4, 1.0, 100) * law.smallest
    exponents = below * law.tangent(below) / law.force(below)
    assert np.all(np.diff(exponents) < 1e-3)
    assert exponents[0] == pytest.approx(1.5, abs=0.01)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("first", "second"),
    [
        (SPHERE, hl.Surface(ALUMINIUM)), (SPHERE, hl.Surface(STEEL)), (SPHERE, hl.Surface(STEEL, -50.0)),
        (SPHERE, hl.Sphere(2.38e-3, STEEL)), (hl.Sphere(2.38e-3, STEEL), SPHERE),
        (hl.Ellipsoid(2.36e-3, 10.16e-3, STEEL, axis="along"), None),
    ],
)  # fmt: skip
def test_small_contacts_are_hertzian(first: hl.Sphere, second: hl.Sphere | hl.Surface | None) -> None:
    """Within 0.3 % where the contact is some 10⁻³ of the radius: unequal bodies, flats, hollows, poles of ellipsoids"""
    law = computed_law(first, second, max_approach=1e-8, spacing=0.3e-6)
    approaches = np.geomspace(law.smallest, law.largest, 20)
    assert against_hertz(law, first, first if second is None else second, approaches) == pytest.approx(0.0, abs=0.003)


@pytest.mark.parametrize("ratio", [0.0, 0.75, 0.97])
def test_nothing_pulls_and_nothing_overlaps(ratio: float) -> None:
    """Inside the edge of the contact forces push; outside, the surfaces are apart, so that the contact is round."""
    body, ball = body_of(bead(ratio), 1.0, "first"), body_of(hl.Sphere(6e-3, STEEL), 1.0, "second")
    (r, one), (other_r, other) = (surface_compliance(each, 0.4e-3, 0.02e-3) for each in (body, ball))
    assert r == pytest.approx(other_r, abs=1e-18)
    compliance, gap = one + other, body.drop(r) + ball.drop(r)
    for last in range(6, gap.size, 2):
        approach, total = pressed_to(compliance, gap, last)
        forces = np.zeros(gap.size)
        forces[: last + 1] = np.linalg.solve(compliance[: last + 1, : last + 1], approach - gap[: last + 1])
        assert forces.sum() == pytest.approx(total, rel=1e-9)
        assert abs(forces[last]) < 1e-9 * forces.max()
        assert forces.min() >= -1e-6 * forces.max()
        assert (approach - gap - compliance @ forces)[last + 1 :].max(initial=0.0) <= 1e-9 * approach


@pytest.mark.parametrize(
    ("first", "second", "asked", "words"),
    [
        (SPHERE, None, {}, "max_force = None, max_approach = None"),
        (SPHERE, None, {"max_force": 1.0, "max_approach": 1e-6}, "max_force = 1.0, max_approach = 1e-06"),
        (SPHERE, None, {"max_approach": -1e-6}, "max_approach"),
        (SPHERE, None, {"max_force": 0.0}, "max_force"),
        (SPHERE, None, {"max_approach": 1e-6, "spacing": 1e-3}, "spacing = 0.001 m: must be smaller"),
        (SPHERE, None, {"max_approach": 1e-6, "spacing": 1e-9}, "spacing = 1e-09"),
        (SPHERE, None, {"max_approach": 8e-3}, "max_approach = 0.008: must lie between"),
        (SPHERE, None, {"max_approach": 1e-30}, "max_approach = 1e-30: must lie between"),
        (SPHERE, None, {"max_force": 1e-90}, "max_force = 1e-90: must lie between"),
        (SPHERE, None, {"max_approach": 3e-3}, "must be larger for a contact"),
        (SPHERE, None, {"max_force": 1.0, "spacing": "fine"}, "spacing = 'fine'"),
        (
            hl.HollowSphere(RADIUS, 0.9999 * RADIUS, ALUMINIUM),
            None,
            {"max_approach": 20e-6},
            "max_approach: must be smaller; the contact",
        ),
        (SPHERE, hl.Surface(STEEL, -1.0 / RADIUS), {"max_approach": 1e-6}, "curvature"),
        (SPHERE, hl.Surface(STEEL, 0.0, 50.0), {"max_approach": 1e-6}, "second"),
        (SPHERE, hl.Cylinder(1e-3, 5e-3, STEEL), {"max_approach": 1e-6}, "second"),
        (hl.Ellipsoid(2e-3, 5e-3, STEEL), None, {"max_approach": 1e-6}, "first"),
        ("ball", None, {"max_approach": 1e-6}, "first"),
    ],
)
def test_bad_input(first: object, second: object, asked: dict[str, object], words: str) -> None:
    """A ValueError names what is wrong."""
    with pytest.raises(ValueError, match=words):
        computed_law(first, second, **asked)  # type: ignore[arg-type]


@pytest.mark.thorough
def test_a_thin_shell_has_a_law_without_a_spacing() -> None:
    """Pressed by twice its wall, it touches twenty times as far as by Hertz's law; first it follows Reissner's."""
    shell, approaches = bead(0.999), np.array([1e-6, 1.5e-6, 3e-6])
    law = computed_law(shell, max_approach=20e-6)
    assert law.force(approaches) == pytest.approx(hl.contact_law(shell, shell).force(approaches), rel=0.005)
    assert law.error < 0.005


@pytest.mark.parametrize(
    ("ratio", "approach", "spacing", "words"),
    [
        (0.0, 0.25e-3, 40e-6, "small strains"),
        (0.908, 0.1e-3, 40e-6, "small angles"),
        (0.0, 20e-6, 100e-6, "make the force wrong by"),
    ],
)
def test_cautions(ratio: float, approach: float, spacing: float, words: str) -> None:
    """Large strains, large turns and coarse meshes are named by the law, and warned of."""
    with pytest.warns(hl.HertzlinkWarning, match="contact law: ") as caught:
        law = computed_law(bead(ratio), max_approach=approach, spacing=spacing)
    assert words in law.caution
    assert f"contact law: {law.caution}" in [str(one.message) for one in caught]
