"""What a Structure refuses: matrices that no elastic body has."""

import numpy as np
import pytest
from scipy import sparse

import hertzlink as hl
from structures.linear_algebra.factor import Matrices

STEEL = hl.Surface(hl.STEEL_440C)
SPRING = np.array([[2e7, -1e7], [-1e7, 1e7]])
MASS = np.diag([0.01, 0.02])
NO_NEGATIVE = "must have no negative eigenvalue"


def made(mass: object = MASS, stiffness: object = SPRING, damping: object = None, contact: object = (0.0, 1.0)) -> None:
    hl.Structure(mass, stiffness, damping, contact, 0.0, STEEL)  # type: ignore[arg-type]


def test_a_negative_eigenvalue_that_no_entry_shows() -> None:
    """All entries obey |Kᵢⱼ| ≤ √(Kᵢᵢ Kⱼⱼ)."""
    stiffness = 1e6 * np.array([[1.0, 0.9, -0.9], [0.9, 1.0, 0.9], [-0.9, 0.9, 1.0]])
    assert np.linalg.eigvalsh(stiffness)[0] == pytest.approx(-8e5)
    with pytest.raises(ValueError, match=f"stiffness: {NO_NEGATIVE}, but has an eigenvalue of about -8e\\+05 N/m"):
        made(np.eye(3), stiffness, contact=np.ones(3))


def test_what_bodies_may_have() -> None:
    """A floating body, degrees of freedom without mass, and none at all."""
    made(stiffness=[[1e7, -1e7], [-1e7, 1e7]])
    made(mass=[[0.01, 0.0], [0.0, 0.0]], damping=[[0.0, 0.0], [0.0, 3.0]])
    made(stiffness=np.zeros((2, 2)))
    assert hl.half_space(hl.PTFE).size == 0


def line(count: int, weak: float) -> sparse.csr_array:
    """The stiffness of masses in a row, held at one end, with a spring of −weak N/m added in the middle."""
    diagonal = np.full(count, 2e7)
    diagonal[-1] = 1e7
    diagonal[count // 2] -= weak
    return sparse.csr_array(sparse.diags_array([diagonal, np.full(count - 1, -1e7), np.full(count - 1, -1e7)],
                                               offsets=[0, 1, -1]))  # fmt: skip


def test_large_matrices_are_examined_when_they_are_used() -> None:
    """Reduced or run; the check costs a factorisation there, and nothing where the structure is made."""
    contact, mass = np.eye(600)[0], sparse.csr_array(sparse.eye_array(600, format="csr") * 1e-3)
    for weak, fine in ((0.0, True), (1e7, False)):
        structure = hl.Structure(mass, line(600, weak), None, np.roll(contact, 300), 0.0, STEEL)
        for use in (lambda one: hl.stepping.MovingStructure(one).step(1e-6), lambda one: hl.reduce(one, until=1e-3)):
            if fine:
                use(structure)
            else:
                with pytest.raises(ValueError, match=f"stiffness: {NO_NEGATIVE}"):
                    use(structure)


def test_large_damping_is_examined_when_it_is_used() -> None:
    """Entries obey |Cᵢⱼ| ≤ √(Cᵢᵢ Cⱼⱼ); a damping that dissipates, and one made by rayleigh, are taken."""
    mass = sparse.csr_array(sparse.eye_array(600, format="csr") * 1e-3)
    push = np.roll(np.eye(600)[0], 300)
    fine = hl.Structure(mass, line(600, 0.0), line(600, 0.0) * 1e-6, push, 0.0, STEEL)
    wrong = np.eye(3) + 0.9 * np.array([[0, 1, -1], [1, 0, 1], [-1, 1, 0]])
    damping = sparse.csr_array(sparse.block_diag([sparse.csr_array(wrong), sparse.eye_array(597)]))
    for one in (fine, hl.damping.damped(fine, hl.damping.Rayleigh(1.0))):
        hl.stepping.MovingStructure(one).step(1e-6)
    bad = hl.Structure(mass, line(600, 0.0), damping, push, 0.0, STEEL)
    with pytest.raises(ValueError, match=f"damping: {NO_NEGATIVE}, but has an eigenvalue of about -0.8 N s/m"):
        hl.stepping.MovingStructure(bad).step(1e-6)


def test_matrices_are_shared_by_those_who_are_given_them() -> None:
    """Structures that differ only in damping or contact share them, too."""
    shared = Matrices(MASS, SPRING)
    one, other = (
        hl.Structure(shared.mass, shared.stiffness, None, b, 0.0, STEEL, matrices=shared) for b in ([0, 1], [1, 0])
    )
    assert one.matrices is other.matrices is shared
    assert one.matrices.shifted_solve(1e4) is other.matrices.shifted_solve(1e4)
    damped = hl.damping.damped(one, hl.damping.Rayleigh(1.0, 1e-7))
    assert damped.matrices is shared
    stiffer = hl.Structure(MASS, 2.0 * SPRING, None, [0, 1], 0.0, STEEL, matrices=shared)  # type: ignore[arg-type]
    assert stiffer.matrices is not shared
    assert stiffer.stiffness.toarray() == pytest.approx(2.0 * SPRING)


def test_a_factorisation_goes_with_its_plate() -> None:
    import weakref

    plate = hl.kirchhoff_plate(0.1, 0.1, 2e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"), cells=(3, 3))
    structure = plate.at(0.05, 0.05)
    kept = weakref.ref(structure.matrices.shifted_solve(1e4))
    assert plate.at(0.02, 0.05).matrices.shifted_solve(1e4) is kept()
    del structure
    assert kept() is not None
    del plate
    assert kept() is None
