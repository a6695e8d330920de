"""Delaminations of plates: the two limits (parts that always touch, and never), films, symmetry, energy, bad input."""

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh, spsolve

import hertzlink as hl
from hertzlink import Delamination
from hertzlink.stepping import Closing
from plates.contacts import contacts_at

CLAMPED = hl.Supports(left="clamped", right="clamped", bottom="clamped", top="clamped")
MATERIAL = hl.ALUMINIUM_6061
THICKNESS, SIDE, FILM = 2e-3, 0.1, 0.02  # m
REGION = (0.04, 0.06, 0.04, 0.06)
UNTIL = 6e-4  # s
BEAD = hl.Sphere(radius=2.38e-3, material=hl.STEEL_440C)


def plate(*additions: object, hertz: float = 1e5, supports: hl.Supports = CLAMPED) -> hl.Plate:
    return hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, MATERIAL, supports, highest_frequency=hertz, additions=additions)


def ratio(body: Any, speed: float = 0.03) -> float:
    """AR of a chain on a body."""
    chain = hl.Chain([BEAD] * 12, striker=BEAD, impact_speed=speed)
    return float(hl.amplitude_ratio(hl.CoSimulation(chain, body).run(until=UNTIL), sensor=6))


@cache
def struck(depth: float, points: tuple[int, int] = (3, 3), face: str = "front") -> hl.Structure:
    return hl.reduce(plate(Delamination(REGION, depth, points)).at(0.05, 0.05, face), until=UNTIL)


def closing(depth: float, opening: float, points: tuple[int, int] = (3, 3), face: str = "front") -> Closing:
    return Closing(struck(depth, points, face), [opening] * (points[0] * points[1]))


def test_a_film_under_a_force() -> None:
    """0.00560 F L²/D at the centre of a clamped square plate (Timoshenko, Woinowsky-Krieger, section 44)."""
    depth = 0.02
    struck = plate(Delamination(REGION, depth), hertz=2e4).at(0.05, 0.05)
    rigidity = MATERIAL.youngs_modulus * (depth * THICKNESS) ** 3 / 12.0 / (1.0 - MATERIAL.poisson_ratio**2)
    force = struck.contact_vectors[:, 0]
    assert force @ spsolve(struck.stiffness.tocsc(), force) == pytest.approx(0.00560 * FILM**2 / rigidity, rel=4e-3)


def test_frequencies_of_a_film() -> None:
    """35.99, 73.41, 73.41 and 108.3 √(D/m)/L² of a clamped square plate (Leissa, J. Sound Vib. 31 (1973) 257)."""
    depth = 0.01
    struck = plate(Delamination(REGION, depth), hertz=1e4).at(0.05, 0.05)
    rigidity = MATERIAL.youngs_modulus * (depth * THICKNESS) ** 3 / 12.0 / (1.0 - MATERIAL.poisson_ratio**2)
    unit = np.sqrt(rigidity / (MATERIAL.density * depth * THICKNESS)) / FILM**2
    squares = eigsh(struck.stiffness.tocsc(), 4, struck.mass.tocsc(), sigma=0.0, return_eigenvectors=False)
    assert np.sqrt(np.sort(squares)) / unit == pytest.approx([35.99, 73.41, 73.41, 108.3], rel=2e-3)


@pytest.mark.parametrize("depth", [0.1, 0.5])
def test_parts_that_move_together_are_a_weakened_plate(depth: float) -> None:
    """Mass and stiffness of motions without opening."""
    split = Delamination(REGION, depth)
    free = plate(split, supports=hl.Supports())
    mesh, assembled, _, _ = free.meshed(contacts_at(0.05, 0.05, "front"))
    weak = free.element.assemble(mesh, free.section, {}, [hl.Weakened(REGION, split.factor)])
    size = weak.mass.shape[0]
    for one, other in ((assembled.mass, weak.mass), (assembled.stiffness, weak.stiffness)):
        assert abs(one[:size, :size] - other).max() < 1e-12 * abs(other).max()
    opening = assembled.stiffness[size:, size:]
    assert abs(opening - opening.T).max() <= 1e-12 * abs(opening).max()


def test_a_closed_gap_in_the_middle_is_a_weakened_plate() -> None:
    """Two equal parts that touch move alike: the linear Weakened is then the closed delamination."""
    weak = hl.reduce(plate(hl.Weakened(REGION, 0.25)).at(0.05, 0.05), until=UNTIL)
    assert ratio(closing(0.5, 0.0)) == pytest.approx(ratio(weak), abs=5e-4)


def test_front_and_back() -> None:
    """A film at the front of a plate is one at the back of the plate turned over."""
    responses = []
    for depth, face in ((0.3, "front"), (0.7, "back")):
        one = plate(Delamination(REGION, depth), hertz=2e4).at(0.05, 0.05, face)
        dynamic = (one.stiffness - (2.0 * np.pi * 5e3) ** 2 * one.mass).tocsc()
        responses.append(one.contact_vectors.T @ spsolve(dynamic, one.contact_vectors))
    assert responses[0] == pytest.approx(responses[1], rel=1e-6)
    assert ratio(closing(0.3, 2e-7)) == pytest.approx(ratio(closing(0.7, 2e-7, face="back")), abs=5e-4)


@pytest.mark.parametrize("face", ["front", "back"])
def test_a_tap_presses_the_parts_together(face: str) -> None:
    body = closing(0.5, 0.0, face=face)
    state, _ = body.advance(body.start(), 1.0, 1e-6)
    assert state.pressed[4] > 0.1  # at the centre
    assert body.widths(state)[4] == pytest.approx(0.0, abs=1e-15)


@pytest.mark.thorough
def test_more_points_change_little() -> None:
    found = [ratio(closing(0.2, 2e-7, (n, n))) for n in (3, 5)]
    assert found[0] == pytest.approx(found[1], abs=0.01)


def test_the_tap_decides_whether_a_delamination_closes() -> None:
    """AR at a slow tap is that of an open delamination, at a fast one that of a closed one."""
    position = []
    for speed in (0.005, 0.03, 0.2):
        opened, narrow, closed = (ratio(closing(0.5, opening), speed) for opening in (1e-3, 1e-7, 0.0))
        position.append((narrow - closed) / (opened - closed))
    assert position[0] == pytest.approx(1.0, abs=0.01)
    assert 0.1 < position[1] < 0.9
    assert abs(position[2]) < 0.03


def test_energy_of_a_run() -> None:
    body = closing(0.3, 2e-7)
    run = hl.CoSimulation(hl.Chain([BEAD] * 6, BEAD, 0.1), body).run(until=2e-4)
    energy = float(run.impact_energy)
    assert abs(run.structure_numerical_loss).max() < 1e-9 * energy
    assert np.diff(run.structure_dissipated_energy).min() > -1e-12 * energy
    assert run.structure_dissipated_energy[-1] > 0.0


def test_two_delaminations_and_two_chains() -> None:
    split = [Delamination((0.02, 0.04, 0.02, 0.04), 0.4, (1, 2)), Delamination((0.06, 0.08, 0.02, 0.04), 0.5, (2, 2))]
    struck = hl.reduce(plate(*split, hertz=5e4).at([0.03, 0.07], [0.03, 0.03]), until=1e-4)
    assert struck.contacts == 2 + 2 + 4
    chains = [hl.Chain([BEAD] * 3, BEAD, 0.1), hl.Chain([BEAD] * 3, BEAD, 0.2)]
    body = Closing(struck, [1e-7] * 6)
    run = hl.CoSimulation(chains, [hl.ContactPoint(body, 0), hl.ContactPoint(body, 1)]).run(until=1e-4)
    assert float(abs(run.surface_displacement).min(dim="time").max()) >= 0.0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"depth": 0.0}, r"depth = 0\.0: must be a positive number"),
        ({"depth": 1.0}, r"depth = 1\.0: must be below 1, in units of the plate's thickness"),
        ({"region": (0.06, 0.04, 0.04, 0.06)}, r"region = .*ascending"),
        ({"region": (0.06, 0.04)}, r"region = .*must be \(left, right, bottom, top\)"),
        ({"points": (0, 3)}, r"points\[0\] = 0"),
        ({"points": 3}, r"points = 3: must be a list of two numbers"),
        ({"points": (3, 3, 3)}, r"points = \(3, 3, 3\): must be \(columns, rows\)"),
        ({"points": (100, 100)}, "must be at most 400 together"),
    ],
)
def test_bad_input(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Delamination(**{"region": REGION, "depth": 0.5, **change})


@pytest.mark.parametrize(
    ("points", "x", "warned"),
    [
        ((3, 3), 0.05, False),
        ((2, 2), 0.05, True),
        ((3, 3), 0.0475, True),
        ((3, 3), 0.0452, False),
        ((2, 2), 0.03, False),
    ],
)
def test_a_chain_beside_the_points_is_said(points: tuple[int, int], x: float, warned: bool) -> None:
    """There the film passes through the plate: it is softer than where both parts move together."""
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        body = plate(Delamination(REGION, 0.1, points), hertz=2e4).at(x, 0.05)
    assert any("pass through each other there" in str(one.message) for one in said) == warned
    both = body.contact_vectors
    answer = both.T @ spsolve(body.stiffness.tocsc(), both)
    held = answer[0, 0] - answer[0, 1:] @ np.linalg.solve(answer[1:, 1:], answer[1:, 0])
    whole = plate(hl.Weakened(REGION, 0.1**3 + 0.9**3), hertz=2e4).at(x, 0.05)
    softer = held / (whole.contact @ spsolve(whole.stiffness.tocsc(), whole.contact))
    assert (softer > 1.5) == warned


def test_bad_places() -> None:
    edge = Delamination((0.0, 0.02, 0.04, 0.06), 0.5)
    with pytest.raises(ValueError, match=r"additions\[0\] = .*must end inside the plate"):
        plate(edge)
    split = Delamination(REGION, 0.5)
    with pytest.raises(ValueError, match=r"additions\[1\] = .*overlaps an earlier one"):
        plate(split, hl.Weakened(REGION, 0.5))
    with pytest.raises(ValueError, match=r"additions\[1\] = .*must not be in a plate with a Prestress"):
        plate(hl.Prestress(1.0), split)
    uniform = hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, MATERIAL, CLAMPED, cells=(7, 7), additions=[split])
    with pytest.raises(ValueError, match="must end at lines of cells; leave out cells"):
        uniform.at(0.05, 0.05)
    with pytest.raises(ValueError, match=r"additions\[0\] = .*must be in a kirchhoff_plate"):
        hl.mindlin_plate(SIDE, SIDE, THICKNESS, MATERIAL, CLAMPED, additions=[split])
    with pytest.raises(ValueError, match="plate: has a delamination"):
        hl.ReducedPlate(plate(split), 1e-4, x=0.05, y=0.05)
