"""Reduction: the same answer at the contact with far fewer unknowns, and an estimate of the error that holds."""

import numpy as np
import pytest
from numpy.typing import NDArray

import hertzlink as hl
from structures import reduction

SUPPORTS = hl.Supports("clamped", "clamped", "free", "free")
PLATE = hl.kirchhoff_plate(0.3, 0.3, 2e-3, hl.ALUMINIUM_6061, SUPPORTS, cells=(20, 20))


def answer(
    structure: hl.Structure, until: float = 5e-4, window: float = 1e-6, pulse: float = 40e-6
) -> NDArray[np.float64]:
    """Displacement after a raised-cosine pulse."""
    moving = hl.stepping.MovingStructure(structure)
    state, found = moving.start(), []
    for step in range(round(until / window)):
        time = (step + 0.5) * window
        force = 0.5 * (1.0 - np.cos(2.0 * np.pi * time / pulse)) if time < pulse else 0.0
        state, surface = moving.advance(state, force, window)
        found.append(surface)
    return np.array(found)


@pytest.mark.parametrize("tolerance", [1e-1, 1e-2, 1e-3])
def test_reduced_plate_answers_like_the_full_one(tolerance: float) -> None:
    full = PLATE.at(0.11, 0.14)
    reduced = hl.reduce(full, until=5e-4, tolerance=tolerance)
    report = reduced.origin["reduction"]
    fading = np.exp(-4.0 * np.arange(500) / 500.0)
    exact = answer(full)
    error = np.linalg.norm(fading * (answer(reduced) - exact)) / np.linalg.norm(fading * exact)
    assert report["error_estimate"] <= tolerance
    assert error < 2.0 * tolerance
    assert reduced.size == report["size"] < full.size / 5


def test_long_pulses_on_soft_bodies_need_few_vectors() -> None:
    """A rubber rod that is pressed for 2 ms; the point that suits steel beads takes three times as many vectors."""
    rubber = hl.Material(youngs_modulus=4e6, poisson_ratio=0.49, density=1100.0)
    rod = hl.rod([hl.Layer(rubber, 0.1, 0.01)], elements=200)
    reduced = hl.reduce(rod, until=10e-3, tolerance=1e-3, pulse=2e-3)
    exact = answer(rod, 10e-3, 1e-5, 2e-3)
    assert answer(reduced, 10e-3, 1e-5, 2e-3) == pytest.approx(exact, abs=2e-3 * exact.max())
    assert reduced.size <= 30


def test_small_structures_are_reduced_exactly() -> None:
    """A Krylov space that is the whole space: the same frequencies, no error."""
    rod = hl.rod([hl.Layer(hl.STEEL_440C, 0.5, 0.01)], elements=5)
    reduced = hl.reduce(rod, until=1e-3, tolerance=1e-9)
    exact = np.linalg.eigvals(np.linalg.solve(rod.mass.toarray(), rod.stiffness.toarray()))
    assert np.sort(reduced.stiffness.diagonal()) == pytest.approx(np.sort(exact.real), rel=1e-8)


def test_contact_points_of_one_mesh_share_the_factorisation(monkeypatch: pytest.MonkeyPatch) -> None:
    from structures.linear_algebra import factor

    made = []
    original = factor.factorise
    monkeypatch.setattr(factor, "factorise", lambda matrix: made.append(1) or original(matrix))
    plate = hl.kirchhoff_plate(0.3, 0.3, 2e-3, hl.ALUMINIUM_6061, SUPPORTS, cells=(8, 8))
    for x in (0.05, 0.1, 0.15):
        hl.reduce(plate.at(x, 0.14), until=5e-4)
    assert len(made) == 1


def test_a_reduction_serves_no_longer_run() -> None:
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    simulation = hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.3), hl.reduce(PLATE.at(0.1, 0.1), until=1e-4))
    with pytest.raises(ValueError, match=r"until = 0\.0002: the structure was reduced for runs of at most 0\.0001 s"):
        simulation.run(2e-4)


def test_too_few_vectors_are_reported() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="40 vectors leave an error of 3"):
        hl.reduce(PLATE.at(0.1, 0.1), until=5e-4, tolerance=1e-2, largest=40)


def test_the_error_is_known_for_half_a_quarter_and_an_eighth_of_the_pulse() -> None:
    """Shorter pulses excite more of what was left out."""
    report = hl.reduce(PLATE.at(0.1, 0.1), until=5e-4, tolerance=1e-3, pulse=4e-5).origin["reduction"]
    pulses, errors = zip(*report["shorter_pulses"], strict=True)
    assert pulses == pytest.approx((2e-5, 1e-5, 5e-6))
    assert report["error_estimate"] < errors[0] < errors[1] < errors[2]


def answer_of(structure: hl.Structure) -> float:
    """What a slow force moves, m/N, by the whole structure or by oscillators."""
    return float(structure.contact @ structure.matrices.shifted_solve(2e4)(structure.contact))


def test_an_equal_structure_is_reduced_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """An equal structure gives the same; another place, support, damping or setting is reduced again; few are kept."""
    made = list[object]()
    krylov = reduction.Krylov
    monkeypatch.setattr(reduction, "Krylov", lambda *given: made.append(given) or krylov(*given))
    monkeypatch.setattr(reduction, "_RECENT", {})

    def rod(thickness: float = 0.1, base: str = "free") -> hl.Structure:
        return hl.rod([hl.Layer(hl.STEEL_440C, thickness, 0.01)], elements=60, base=base)

    first = hl.reduce(rod(), 3e-4)
    spoiled = hl.reduce(rod(), 3e-4)
    spoiled.contact[:] = 0.0
    again = hl.reduce(rod(), 3e-4)
    assert len(made) == 1
    assert np.array_equal(again.contact, first.contact)
    assert again.origin == first.origin
    damped = hl.damping.damped(rod(), hl.damping.Rayleigh(1e3))
    others = [
        (rod(0.11), 3e-4, 1e-2), (rod(base="fixed"), 3e-4, 1e-2), (damped, 3e-4, 1e-2),
        (rod(), 2e-4, 1e-2), (rod(), 3e-4, 1e-3),
    ]  # fmt: skip
    for number, (one, until, tolerance) in enumerate(others):
        reduced = hl.reduce(one, until, tolerance)
        assert len(made) == 2 + number
        assert reduced.valid_until == until
        assert answer_of(reduced) == pytest.approx(answer_of(one), rel=0.03)
    for step in range(20):
        hl.reduce(rod(), 3e-4 + 1e-9 * step)
    assert len(reduction._RECENT) == reduction.MOST_KEPT
    with pytest.warns(hl.HertzlinkWarning, match="leave an error"):
        hl.reduce(PLATE.at(0.1, 0.1), 5e-4, 1e-6, 40)
    with pytest.warns(hl.HertzlinkWarning, match="leave an error"):
        hl.reduce(PLATE.at(0.1, 0.1), 5e-4, 1e-6, 40)
