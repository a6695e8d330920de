"""Damping: functions that take a Structure and return it damped. What they add only ever takes energy."""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from structures.checks import instance, not_negative, one_of, positive
from structures.factor import symmetric
from structures.oscillators import is_modal
from structures.plausible import likely
from structures.structure import Structure, Vector, known_field
from structures.symmetric import check_definite

MODULI = ("relaxed", "instantaneous")

NO_PIVOT = 1e-6
"""A pivot below this part of its diagonal entry belongs to a rigid motion. In plates of 6 000 degrees of freedom these
are below 6e-9, all others above 2e-4."""


def rayleigh(structure: Structure, mass_rate: float = 0.0, stiffness_time: float = 0.0) -> Structure:
    """The structure with α M + β K added to its damping; mass_rate α in 1/s, stiffness_time β in s.

    A mode of angular frequency ω then has the damping ratio α/2ω + βω/2 (Bathe, Finite Element Procedures, section
    9.3.3). Raises ValueError for negative ones, and for β on a structure that has Maxwell arms: damp it first.
    """
    instance("structure", structure, Structure, "a Structure")
    mass_rate = not_negative("mass_rate", mass_rate, "1/s")
    stiffness_time = not_negative("stiffness_time", stiffness_time, "s")
    likely("time", "rayleigh", "stiffness_time", stiffness_time)
    if stiffness_time > 0.0 and maxwell_arms(structure) is not None:
        raise ValueError(
            f"stiffness_time = {stiffness_time!r}: the structure has Maxwell arms; call rayleigh before "
            "standard_linear_solid"
        )
    if structure.size == 0 or mass_rate == stiffness_time == 0.0:
        return structure
    matrix = mass_rate * structure.mass + stiffness_time * structure.stiffness
    return _damped(structure, matrix, kind="Rayleigh", mass_rate=mass_rate, stiffness_time=stiffness_time)


def modal(structure: Structure, ratio: ArrayLike) -> Structure:
    """A structure of oscillators, as `reduce` makes them, with 2 ζ ω added to the damping of each.

    ratio ζ: of critical damping, one number or one for each oscillator; 1 is the aperiodic limit, and a rigid motion
    (ω = 0) stays free. Raises ValueError where it is negative, or the structure is not one of oscillators.
    """
    instance("structure", structure, Structure, "a Structure")
    if not is_modal(structure):
        raise ValueError(
            f"structure: its {structure.size} degrees of freedom are not modes (M = I; K, C diagonal); reduce it first"
        )
    try:
        ratios = np.asarray(ratio, dtype=float)
        bad = not (np.isfinite(ratios).all() and (ratios >= 0.0).all())
    except (TypeError, ValueError):
        bad = True
    if bad or ratios.shape not in ((), (structure.size,)):
        raise ValueError(f"ratio = {ratio!r}: must be zero or positive, one number or {structure.size}")
    rates = 2.0 * ratios * np.sqrt(structure.stiffness.diagonal())
    if not rates.any():
        return structure
    return _damped(structure, sparse.diags_array(rates), kind="modal", ratio=ratios.tolist())


def loss_factor(structure: Structure, factor: float) -> Structure:
    """A structure of oscillators, as `reduce` makes them, that loses as K(1 + iη) does: modal damping ζ = η/2.

    factor η: energy lost in a cycle over 2π times the greatest stored one, 0 to 1. At its resonance each oscillator
    loses just that; below it less, above it more, since a force that is the same at all frequencies and out of phase
    with the displacement would be felt before its cause (Crandall, J. Sound Vib. 11 (1970) 3).
    Raises ValueError where η lies elsewhere, or the structure is not one of oscillators.
    """
    number = not_negative("factor", factor)
    if number > 1.0:
        raise ValueError(f"factor = {factor!r}: must be at most 1; it is η = 2ζ, and not in per cent")
    return modal(structure, number / 2.0)


def standard_linear_solid(
    structure: Structure,
    share: float,
    time: float,
    part: sparse.sparray | ArrayLike | None = None,
    modulus: str = "relaxed",
) -> Structure:
    """The structure with a Maxwell arm (a spring and a dashpot in series) beside its stiffness, or beside a part of it.

    E(ω) = E + E₁ iωτ / (1 + iωτ): Zener's standard linear solid (Elasticity and Anelasticity of Metals, 1948), whose
    loss peaks at ω = 1/(τ√(1 + E₁/E)), see loss_tangent.
    share: E₁ of the arm in units of the modulus that the structure was made with. time: τ in s, in which the arm's
    stress fades at constant strain. part: the stiffness matrix of the layer that the arm stands beside, one of
    rod_parts(…) or stiffness_parts(structure); by default all of K. Call again for each further layer or arm.
    A large body of one material is better reduced first: its modes take the same arm each, exactly, at no cost.
    modulus: what the structure was made with: "relaxed", its E is that of slow loads, and the arm stiffens it at once;
    or "instantaneous", its E is that of sudden loads, and the arm's share < 1 of it fades, as in Prony series.

    The arm's springs in series with dashpots become degrees of freedom q without mass, as many as the part has ways
    to stretch: with RᵀR the arm's stiffness, its energy is |R u − q|²/2 and its loss τ|q̇|², so M, C and K stay
    symmetric and positive. q is in √J. Raises ValueError where the part is not positive, or, of
    the instantaneous modulus, where share times it exceeds K.
    """
    instance("structure", structure, Structure, "a Structure")
    share, time = positive("share", share), positive("time", time, "s")
    likely("time", "standard_linear_solid", "time", time)
    one_of("modulus", modulus, MODULI)
    if modulus == "instantaneous" and share >= 1.0:
        raise ValueError(f"share = {share!r}: must be below 1 of the instantaneous modulus")
    if structure.size == 0:
        return structure
    added = share * _part(structure, part)
    root = _root(added)
    arm = {"kind": "standard linear solid", "share": share, "time": time, "modulus": modulus}
    structure = replace(structure, origin=_noted(structure, arm))
    if modulus == "relaxed":
        return with_arms(structure, root, time, structure.stiffness + added)
    try:
        left = symmetric("stiffness", structure.stiffness - added)
        check_definite("stiffness", left)
    except ValueError as error:
        raise ValueError(f"part: {share} of it is more than the structure's stiffness") from error
    return with_arms(structure, root, time, structure.stiffness)


def stiffness_parts(structure: Structure) -> list[sparse.csr_array]:
    """What each layer of a cylinder, or each material of a solid, adds to its stiffness, n × n, N/m.

    In the order of the layers, or of the materials. With it a layer gets damping of its own:
    standard_linear_solid(body, share, time, part=stiffness_parts(body)[1]). Their sum is K without elastic foundations.
    A reduced structure tells them where its field was kept. Raises ValueError where the structure has no field; for
    rods see `rod_parts`.
    """
    return known_field(structure).stiffness_parts()


def with_arms(structure: Structure, root: sparse.csr_array, time: float, stiffness: Any = None) -> Structure:
    """The structure with an arm for each row of R (√J/m), their relaxation time (s), and K with the arms held fast.

    R may lack the columns of earlier arms. By default K + RᵀR, so that the structure's own K remains for slow loads.
    """
    count = root.shape[0]
    root = sparse.csr_array((root.data, root.indices, root.indptr), (count, structure.size))
    held = structure.stiffness + root.T @ root if stiffness is None else stiffness
    own = sparse.csr_array(structure.mass.shape) if structure.damping is None else structure.damping
    return replace(
        structure,
        mass=sparse.csr_array(sparse.block_diag([structure.mass, sparse.csr_array((count, count))])),
        stiffness=sparse.csr_array(sparse.block_array([[held, -root.T], [-root, sparse.eye_array(count)]])),
        damping=sparse.csr_array(sparse.block_diag([own, time * sparse.eye_array(count)])),
        contact=np.concatenate([structure.contact, np.zeros((count, *structure.contact.shape[1:]))]),
    )


def loss_tangent(share: float, time: float, frequency: ArrayLike) -> Any:
    """tan δ = g ωτ / (1 + (1 + g) ω²τ²) of a standard linear solid at `frequency` in Hz; a number or an array.

    share g: the arm's modulus in units of the relaxed one. The greatest, at ωτ = 1/√(1 + g), is g / 2√(1 + g).
    """
    share, time = positive("share", share), positive("time", time, "s")
    phase = 2.0 * np.pi * np.asarray(frequency, dtype=float) * time
    return share * phase / (1.0 + (1.0 + share) * phase**2)


class MaxwellArms(NamedTuple):
    """Degrees of freedom without mass, as standard_linear_solid makes them: |R u − q|²/2 is stored, τ|q̇|² lost.

    body: the degrees of freedom u that have mass. coupling: R, a row for each q. time: τ of each q, s.
    """

    body: NDArray[np.intp]
    coupling: sparse.csr_array
    time: Vector


def maxwell_arms(structure: Structure) -> MaxwellArms | None:
    """The Maxwell arms of a structure, or None where it has none."""
    massless = np.asarray(abs(structure.mass).sum(axis=0)).ravel() == 0.0
    if structure.damping is None or not massless.any():
        return None
    arms, body = np.flatnonzero(massless), np.flatnonzero(~massless)
    losses, springs = structure.damping[arms], structure.stiffness[arms]
    alone = abs(losses).sum() == abs(losses[:, arms].diagonal()).sum()
    if not (alone and _is_diagonal(springs[:, arms]) and (springs[:, arms].diagonal() > 0.0).all()):
        return None
    scale = 1.0 / np.sqrt(springs[:, arms].diagonal())
    coupling = sparse.csr_array(sparse.diags_array(-scale) @ springs[:, body])
    return MaxwellArms(body, coupling, scale**2 * losses[:, arms].diagonal())


def _damped(structure: Structure, matrix: sparse.sparray, **note: Any) -> Structure:
    total = matrix if structure.damping is None else structure.damping + matrix
    return replace(structure, damping=sparse.csr_array(total), origin=_noted(structure, note))


def _noted(structure: Structure, note: dict[str, Any]) -> dict[str, Any]:
    return {**structure.origin, "damping": [*structure.origin.get("damping", []), note]}


def _part(structure: Structure, part: sparse.sparray | ArrayLike | None) -> sparse.csr_array:
    """The part of the stiffness that an arm stands beside, as large as the structure's."""
    arms = maxwell_arms(structure)
    if part is None:
        if arms is not None:
            raise ValueError(
                "part: the structure has Maxwell arms already; give the part of K that this one belongs to"
            )
        return structure.stiffness
    body = np.arange(structure.size) if arms is None else arms.body
    try:
        matrix = sparse.csr_array(part if sparse.issparse(part) else np.atleast_2d(np.asarray(part, dtype=float)))
    except (TypeError, ValueError) as error:
        raise ValueError(f"part = {part!r}: must be a matrix, such as one of rod_parts(...)") from error
    if matrix.shape != (body.size, body.size):
        raise ValueError(f"part has shape {matrix.shape}: must be ({body.size}, {body.size}), as the stiffness has")
    if not np.isfinite(matrix.data).all() or abs(matrix - matrix.T).max() > 1e-9 * abs(matrix).max():
        raise ValueError("part: must be symmetric and hold finite numbers")
    spread = sparse.csr_array((np.ones(body.size), (body, np.arange(body.size))), (structure.size, body.size))
    return sparse.csr_array(spread @ matrix @ spread.T)


def _root(matrix: sparse.csr_array) -> sparse.csr_array:
    """R with RᵀR = matrix and as many rows as its rank; a ValueError where it is not positive semidefinite."""
    used = np.flatnonzero(abs(matrix).sum(axis=0))
    if _is_diagonal(matrix) and (matrix.diagonal() >= 0.0).all():
        rows = np.arange(used.size)
        return sparse.csr_array((np.sqrt(matrix.diagonal()[used]), (rows, used)), (used.size, matrix.shape[0]))
    lower, pivots = _factored(matrix[used][:, used])
    if pivots.min() < -NO_PIVOT:
        raise ValueError("part: must be positive semidefinite, as the stiffness of a body is")
    kept = pivots > NO_PIVOT
    root = sparse.diags_array(np.sqrt(pivots[kept])) @ sparse.csc_array(lower)[:, kept].T
    spread = sparse.csr_array((np.ones(used.size), (np.arange(used.size), used)), (used.size, matrix.shape[0]))
    return sparse.csr_array(root @ spread)


def _factored(matrix: sparse.sparray) -> tuple[sparse.sparray, Vector]:
    """L and the diagonal of D in matrix = L D Lᵀ, rows of L in the matrix's order; D in units of its own diagonal."""
    diagonal = matrix.diagonal()
    if not (diagonal > 0.0).all():
        raise ValueError("part: must be positive semidefinite, as the stiffness of a body is")
    scale = 1.0 / np.sqrt(diagonal)
    # A pivot of exactly zero, as rigid motions leave, would stop SuperLU; rounding moves pivots by more than this.
    scaled = sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale) + 1e-15 * sparse.eye_array(scale.size)
    factor = splu(
        sparse.csc_array(scaled), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    lower = sparse.diags_array(1.0 / scale) @ sparse.csr_array(factor.L)[factor.perm_r]
    return lower, factor.U.diagonal()


def _is_diagonal(matrix: sparse.sparray) -> bool:
    return bool(abs(matrix).sum() == abs(matrix.diagonal()).sum())
