"""Plates with several contacts: Navier's series, faces, meshes fine at each contact, symmetry, bad input."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import quad

import hertzlink as hl

Array = NDArray[np.float64]

LENGTH, WIDTH, THICKNESS = 0.4, 0.3, 2e-3
SIMPLE = hl.Supports("simple", "simple", "simple", "simple")
RIM = hl.Outline([(0.0, 0.0), (LENGTH, 0.0), (LENGTH, WIDTH), (0.0, WIDTH)], edges="rim")
PLATES: dict[str, Callable[[], hl.Plate]] = {
    "kirchhoff_plate": partial(
        hl.kirchhoff_plate, LENGTH, WIDTH, THICKNESS, hl.ALUMINIUM_6061, SIMPLE, highest_frequency=2e4
    ),
    "uniform": partial(hl.kirchhoff_plate, LENGTH, WIDTH, THICKNESS, hl.ALUMINIUM_6061, SIMPLE, cells=(24, 18)),
    "mindlin_plate": partial(
        hl.mindlin_plate, LENGTH, WIDTH, THICKNESS, hl.ALUMINIUM_6061, SIMPLE, patch_radius=4e-3, highest_frequency=2e3
    ),
    "mindlin_panel": partial(
        hl.mindlin_panel, RIM, THICKNESS, hl.ALUMINIUM_6061, {"rim": "simple"}, patch_radius=2e-3, highest_frequency=2e3
    ),
}
X, Y = [0.11, 0.26, 0.31], [0.2, 0.07, 0.21]


def receptance(structure: hl.Structure, shift: float) -> Array:
    """bᵀ(K + s²M)⁻¹b and the contacts' own flexibility, p × p, m/N."""
    contact = structure.contact.reshape(structure.size, -1)
    solve = structure.matrices.shifted_solve(shift)
    found = contact.T @ np.column_stack([solve(column) for column in contact.T])
    return np.asarray(found + np.diag(np.broadcast_to(structure.flexibility, len(found))))


@cache
def three(name: str) -> hl.Structure:
    return PLATES[name]().at(X, Y)


def navier(x: list[float], y: list[float], shift: float, terms: int = 700) -> Array:
    """Navier's double series for a simply supported plate, w = 4/ab Σ φ(x, y) φ(ξ, η) / (D k⁴ + ρt s²)."""
    metal = hl.ALUMINIUM_6061
    rigidity = metal.youngs_modulus * THICKNESS**3 / 12.0 / (1.0 - metal.poisson_ratio**2)
    m, n = np.arange(1, terms + 1)[:, None] * np.pi / LENGTH, np.arange(1, terms + 1) * np.pi / WIDTH
    stiffness = rigidity * (m**2 + n**2) ** 2 + metal.density * THICKNESS * shift**2
    shapes = [np.sin(m * one) * np.sin(n * other) for one, other in zip(x, y, strict=True)]
    pairs = [[(one * other / stiffness).sum() for other in shapes] for one in shapes]
    return np.asarray(4.0 / (LENGTH * WIDTH) * np.array(pairs))


@pytest.mark.parametrize("shift", [0.0, 2.0 * np.pi * 400.0], ids=["static", "dynamic"])
@pytest.mark.parametrize(
    ("name", "own", "cross"),
    [
        ("kirchhoff_plate", 1e-4, 2e-5), ("uniform", 1e-2, 2e-4), ("mindlin_plate", 2e-3, 1e-3),
        ("mindlin_panel", 2e-3, 1e-3),
    ],
)  # fmt: skip
def test_three_contacts_move_each_other_as_in_naviers_series(name: str, own: float, cross: float, shift: float) -> None:
    """A force on one moves each, reciprocally (Maxwell). Mindlin's plate also shears, 0.05 % at this thickness."""
    found = receptance(three(name), shift)
    exact = navier(X, Y, shift)
    apart = ~np.eye(3, dtype=bool)
    assert found == pytest.approx(found.T, rel=1e-9)
    assert found[apart] == pytest.approx(exact[apart], abs=cross * exact.max())
    assert found.diagonal() == pytest.approx(exact.diagonal(), rel=own)


@pytest.mark.parametrize("name", PLATES)
def test_front_and_back_at_one_place_move_as_one(name: str) -> None:
    plate = PLATES[name]()
    body = plate.at([0.1, 0.1], [0.2, 0.2], face=["front", "back"])
    assert np.array_equal(body.contact[:, 1], -body.contact[:, 0])
    one = plate.at(0.1, 0.2)
    assert np.array_equal(body.contact[:, 0], one.contact)
    assert (body.stiffness - one.stiffness).count_nonzero() == 0
    reduced = hl.reduce(body, until=3e-4, tolerance=0.1)
    moving = hl.stepping.MovingStructure(reduced)
    state, _ = moving.advance(moving.start(), np.array([3.0, 1.0]), 1e-5)
    state, moved = moving.advance(state, np.array([2.0, 2.0]), 1e-5)
    assert moved[0] > 0.0
    assert moved[1] == pytest.approx(-moved[0], rel=1e-12)
    _, squeezed = moving.advance(moving.start(), np.array([2.0, 2.0]), 1e-5)
    assert abs(squeezed).max() < 1e-12 * moved[0]


@pytest.mark.parametrize("name", PLATES)
def test_a_contact_on_the_back_is_one_on_the_front_turned_over(name: str) -> None:
    plate = PLATES[name]()
    front, back = plate.at(0.1, 0.2), plate.at(0.1, 0.2, face="back")
    assert np.array_equal(back.contact, -front.contact)
    assert back.contacts == 1
    assert back.flexibility == front.flexibility
    assert back.origin == {**front.origin, "face": "back"}


@pytest.mark.parametrize(("patch", "bound"), [(0.5, 0.05), (0.25, 0.4), (2.0, 1.4)])
def test_what_front_and_back_of_a_thick_plate_lack_of_each_other(patch: float, bound: float) -> None:
    """In three dimensions they differ by the wall's squeeze minus Hertz's, (1 − ν²)/πEt ∫ (ch x − 1)/(sh x + x) − 1 dx.

    (Timoshenko and Goodier, section 24: the part of their solution that is symmetric about the middle surface.)
    """
    metal = hl.ALUMINIUM_6061
    plate = hl.mindlin_plate(
        LENGTH, WIDTH, THICKNESS, metal, SIMPLE, patch_radius=patch * THICKNESS, highest_frequency=2e3
    )
    found = receptance(plate.at([0.1, 0.1], [0.2, 0.2], ["front", "back"]), 0.0)
    squeeze = quad(lambda x: (np.cosh(x) - 1.0) / (np.sinh(x) + x) - 1.0, 1e-9, 50.0)[0] / np.pi
    lacking = (found[0, 0] + found[0, 1]) * metal.youngs_modulus * THICKNESS - (1.0 - metal.poisson_ratio**2) * squeeze
    assert 0.5 * bound < abs(lacking) < bound


@pytest.mark.parametrize("make", [hl.kirchhoff_plate, hl.mindlin_plate])
def test_contacts_on_a_symmetry_edge_strike_the_whole_plate_once(make: Callable[..., hl.Plate]) -> None:
    half_supports = hl.Supports("symmetry", "free", "clamped", "free")
    half = make(0.15, 0.2, 2e-3, hl.ALUMINIUM_6061, half_supports, highest_frequency=4e3)
    whole = make(
        0.3, 0.2, 2e-3, hl.ALUMINIUM_6061, hl.Supports("free", "free", "clamped", "free"), highest_frequency=4e3
    )
    s, ys = 2.0 * np.pi * 1e3, [0.1, 0.17]
    one, other = receptance(half.at([0.0, 0.0], ys), s), receptance(whole.at([0.15, 0.15], ys), s)
    assert one == pytest.approx(other, rel=1e-6)
    with pytest.raises(ValueError, match=r"x, y = .*: must all lie on a symmetry edge or all inside"):
        half.at([0.0, 0.07], ys)


def test_each_contact_sees_the_ply_that_it_touches() -> None:
    """Steel in front, PTFE behind: each contact has its own ply in Hertz's law and in the remaining indentation."""
    wall = hl.Laminate([hl.Ply(hl.STEEL_440C, 1e-3), hl.Ply(hl.PTFE, 1e-3)])
    for make in (hl.kirchhoff_plate, hl.mindlin_plate):
        plate = make(0.2, 0.2, None, wall, SIMPLE, highest_frequency=4e3)
        body = plate.at([0.1, 0.1], [0.1, 0.1], ["front", "back"])
        assert [one.material for one in body.surface] == [hl.STEEL_440C, hl.PTFE]
        assert plate.at(0.1, 0.1, "back").surface.material == hl.PTFE
    assert body.flexibility[0] != body.flexibility[1]
    assert not np.allclose(body.contact[:, 0], -body.contact[:, 1], rtol=1e-6, atol=0.0)
    given_surface = hl.kirchhoff_plate(0.2, 0.2, None, replace(wall, surface=hl.MATERIALS["copper"]), SIMPLE)
    assert given_surface.at(0.1, 0.1, "back").surface.material == hl.MATERIALS["copper"]


@pytest.mark.parametrize("name", ["kirchhoff_plate", "mindlin_plate"])
@pytest.mark.parametrize(
    ("x", "y", "face", "message"),
    [
        ([0.1, 0.2], [0.1], "front", "x, y, face: must have equal lengths, not 2, 1 and 2"),
        ([0.1, 0.2], 0.1, "front", r"y = 0\.1: must be a list of numbers in m"),
        ([], [], "front", r"x = \[\]: must be a list of numbers in m"),
        ([[0.1], [0.2]], [0.1, 0.2], "front", r"x\[0\] = \[0\.1\]: must be a finite number of m"),
        ([0.1, float("nan")], [0.1, 0.2], "front", r"x\[1\] = nan: must be a finite number of m"),
        ([0.1, [0.2, 0.3]], [0.1, 0.2], "front", r"x\[1\] = \[0\.2, 0\.3\]: must be a finite number of m"),
        ([0.1, None], [0.1, 0.2], "front", r"x\[1\] = None: must be a finite number of m"),
        ("0.1", 0.2, "front", r"x = '0\.1': must be a finite number of m"),
        ([0.1, 0.1], [0.2, 0.2], "front", r"x, y: contacts 0 and 1 must not be at the same place on the front"),
        ([0.1, 0.3, 0.1], [0.2, 0.2, 0.2], ["back", "back", "back"], "x, y: contacts 0 and 2 must not be at the same"),
        ([0.1, 0.2], [0.1, 0.2], ["front"], "x, y, face: must have equal lengths, not 2, 2 and 1"),
        ([0.1, 0.2], [0.1, 0.2], ["front", "bak"], r"face\[1\] = 'bak': must be one of.*did you mean 'back'"),
        ([0.1, 0.2], [0.1, 0.2], None, "face = None: must be a list of faces"),
        (0.1, 0.2, "top", "face = 'top': must be one of 'front', 'back'"),
        (0.1, 0.2, ["front", "back"], r"face = \['front', 'back'\]: must be one of 'front', 'back'"),
    ],
)
def test_bad_contacts(name: str, x: object, y: object, face: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        PLATES[name]().at(x, y, face)  # type: ignore[arg-type]


def test_contacts_that_cannot_be_struck_are_named() -> None:
    plate = PLATES["kirchhoff_plate"]()
    with pytest.raises(ValueError, match=r"x\[1\] = 0\.41: must lie on the plate"):
        plate.at([0.1, 0.41], [0.1, 0.2])
    with pytest.raises(ValueError, match=r"x, y = 0\.3, 0: must not lie on a simple edge, which cannot move"):
        plate.at([0.1, 0.2, 0.3], [0.1, 0.2, 0.0])
    with pytest.raises(ValueError, match=r"patch_radius = 0\.004: must be at most 0\.0002 m at \(0\.0002, 0\.2\)"):
        PLATES["mindlin_plate"]().at([0.1, 0.0002], [0.1, 0.2])
    with pytest.raises(ValueError, match=r"x\[1\] = 0\.5: must lie on the plate"):
        PLATES["mindlin_plate"]().at([0.1, 0.5], [0.1, 0.2])
    with pytest.raises(ValueError, match=r"x, y = 0\.5, 0\.2: must lie"):
        PLATES["mindlin_panel"]().at([0.1, 0.5], [0.1, 0.2])
