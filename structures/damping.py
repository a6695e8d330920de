"""Damping: functions that take a Structure and return it with damping. The damping that they add never supplies
energy.
"""

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from structures.checks import each, finite, instance, not_negative, one_of, positive
from structures.factor import symmetric
from structures.material import Material
from structures.plausible import likely
from structures.rod import Layer, rod_parts
from structures.structure import Structure, Vector, known_field
from structures.symmetric import check_definite

MODULI = ("relaxed", "instantaneous")

RIGID_PIVOT = 1e-6
"""A pivot below this fraction of its diagonal entry belongs to a rigid motion. In plates of 6 000 degrees of freedom
such pivots are below 6e-9, and all others above 2e-4.
"""


def rayleigh(structure: Structure, mass_rate: float = 0.0, stiffness_time: float = 0.0) -> Structure:
    """Add Rayleigh damping α M + β K to a structure.

    A mode of angular frequency ω then has the damping ratio α/2ω + βω/2.

    Parameters
    ----------
    structure : Structure
        The structure to damp.
    mass_rate : float
        α, 1/s, zero or more.
    stiffness_time : float
        β, s, zero or more.

    Returns
    -------
    Structure
        The structure with α M + β K added to its damping matrix.

    Raises
    ------
    ValueError
        If α or β is negative, or if β is given for a structure with Maxwell arms: call `rayleigh` first.

    References
    ----------
    Bathe, Finite Element Procedures, section 9.3.3.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bar = hl.rod([hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3)])
    >>> damped = hl.damping.rayleigh(bar, stiffness_time=1e-7)
    >>> round(float(damped.damping[0, 0] / bar.stiffness[0, 0]), 12)
    1e-07
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
    """Add modal damping to a structure of oscillators: 2 ζ ω for each oscillator.

    Parameters
    ----------
    structure : Structure
        A structure of oscillators, as `reduce` returns.
    ratio : float or array_like
        Damping ratio ζ, zero or more: one number, or one for each oscillator. ζ = 1 is critical damping. A rigid motion
        (ω = 0) stays undamped.

    Returns
    -------
    Structure
        The structure with the added damping.

    Raises
    ------
    ValueError
        If a ratio is negative, or the structure does not consist of oscillators.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bar = hl.rod([hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3)])
    >>> damped = hl.damping.modal(hl.reduce(bar, until=1e-3), 0.02)
    >>> rate, square = damped.damping[0, 0], damped.stiffness[0, 0]
    >>> round(float(rate / (2.0 * square**0.5)), 6)
    0.02
    """
    instance("structure", structure, Structure, "a Structure")
    if not structure.is_modal:
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
    likely("ratio", "modal", "ratio", float(ratios.max(initial=0.0)))
    rates = 2.0 * ratios * np.sqrt(structure.stiffness.diagonal())
    if not rates.any():
        return structure
    return _damped(structure, sparse.diags_array(rates), kind="modal", ratio=ratios.tolist())


def loss_factor(structure: Structure, factor: float) -> Structure:
    """Add the modal damping ζ = η/2 that corresponds to a structural loss factor η.

    At its resonance each oscillator loses as much energy as with the complex stiffness K(1 + iη); below resonance it
    loses less, above it more. A loss that is the same at all frequencies cannot be represented in time: a force that is
    independent of frequency and out of phase with the displacement would act before its cause.

    Parameters
    ----------
    structure : Structure
        A structure of oscillators, as `reduce` returns.
    factor : float
        η, 0 to 1: the energy lost in a cycle over 2π times the largest stored energy.

    Returns
    -------
    Structure
        The structure with the added damping.

    Raises
    ------
    ValueError
        If η lies outside 0 to 1, or the structure does not consist of oscillators.

    References
    ----------
    Crandall, J. Sound Vib. 11 (1970) 3.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bar = hl.rod([hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3)])
    >>> damped = hl.damping.loss_factor(hl.reduce(bar, until=1e-3), 0.04)
    >>> damped.origin["damping"][0]["ratio"]
    0.02
    """
    number = not_negative("factor", factor)
    if number > 1.0:
        raise ValueError(f"factor = {factor!r}: must be at most 1; it is η = 2ζ, not a percentage")
    return modal(structure, number / 2.0)


def standard_linear_solid(
    structure: Structure,
    share: float,
    time: float,
    part: sparse.sparray | ArrayLike | None = None,
    modulus: str = "relaxed",
) -> Structure:
    """Add a Maxwell arm (a spring and a dashpot in series) in parallel to the stiffness or to a part of it.

    The modulus becomes E(ω) = E + E₁ iωτ / (1 + iωτ), Zener's standard linear solid. Its loss is largest at ω = 1/(τ√(1
    + E₁/E)), see `loss_tangent`. Call the function again for each further layer or arm. For a large body of one
    material, reduce it first: then each mode takes the same arm, exactly and at no cost.

    Parameters
    ----------
    structure : Structure
        The structure to damp.
    share : float
        E₁ of the arm, in units of the modulus with which the structure was made.
    time : float
        Relaxation time τ, s: the time constant with which the stress of the arm decays at constant strain.
    part : matrix, optional
        The stiffness matrix, N/m, of the layer that the arm belongs to: one of rod_parts(…) or
        stiffness_parts(structure). By default the whole of K.
    modulus : {"relaxed", "instantaneous"}
        Which modulus the structure was made with. "relaxed": that of slow loads; the arm makes the structure stiffer
        under sudden loads. "instantaneous": that of sudden loads; the fraction `share` < 1 of it relaxes, as in Prony
        series.

    Returns
    -------
    Structure
        The structure with additional, massless degrees of freedom q, in √J: one for each independent deformation of the
        part. With RᵀR the stiffness of the arm, its stored energy is |R u − q|²/2 and its loss τ|q̇|². So M, C and K
        stay symmetric and positive semidefinite.

    Raises
    ------
    ValueError
        If the part is not positive semidefinite, or if `share` times the part exceeds K (instantaneous modulus).

    References
    ----------
    Zener, Elasticity and Anelasticity of Metals (1948).

    Examples
    --------
    >>> import hertzlink as hl
    >>> layers = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
    >>> bar = hl.rod(layers)
    >>> damped = hl.damping.standard_linear_solid(bar, share=0.1, time=5e-6, part=hl.damping.rod_parts(layers)[1])
    >>> damped.size > bar.size
    True
    """
    instance("structure", structure, Structure, "a Structure")
    share, time = positive("share", share), positive("time", time, "s")
    likely("time", "standard_linear_solid", "time", time)
    likely("share", "standard_linear_solid", "share", share)
    one_of("modulus", modulus, MODULI)
    if modulus == "instantaneous" and share >= 1.0:
        raise ValueError(f"share = {share!r}: must be below 1 of the instantaneous modulus")
    if structure.size == 0:
        return structure
    added = share * _part(structure, part)
    root = _root(added)
    arm = {"kind": "standard linear solid", "share": share, "time": time, "modulus": modulus}
    arm |= {} if part is None else _named(structure, part)
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
    """The contribution of each layer of a cylinder, or of each material of a solid or a shell, to its stiffness.

    With these matrices a single layer can be damped:
    standard_linear_solid(body, share, time, part=stiffness_parts(body)[1]).

    Parameters
    ----------
    structure : Structure
        A structure with a field. A reduced structure has one if it was made with keep_field=True. For rods see
        `rod_parts`.

    Returns
    -------
    list of scipy.sparse.csr_array
        n × n matrices, N/m, in the order of the layers or materials. Their sum is K without elastic foundations,
        prestress and gas.

    Raises
    ------
    ValueError
        If the structure has no field.

    Examples
    --------
    >>> import hertzlink as hl
    >>> layers = [hl.Layer(hl.STEEL_440C, 10e-3, 9.525e-3), hl.Layer(hl.PTFE, 10e-3, 9.525e-3)]
    >>> body = hl.layered_cylinder(layers, patch_radius=3e-3, cells=1)
    >>> steel, ptfe = hl.damping.stiffness_parts(body)
    >>> bool(abs(steel + ptfe - body.stiffness).max() < 1e-9 * abs(body.stiffness).max())
    True
    """
    parts = known_field(structure).stiffness_parts()
    for part in parts:
        part.resize((structure.size,) * 2)  # the gas in a shell has degrees of freedom of its own, after the others
    return parts


def part_of_layer(structure: Structure, layer: int) -> sparse.csr_array:
    """The stiffness of one layer of a rod or a cylinder, or of the wall of a spherical shell, N/m."""
    parts = _parts(structure)
    if not parts:
        raise ValueError(
            "layer: only a layer of a rod or a cylinder, and the wall of a spherical shell (0), can be damped alone"
        )
    if not 0 <= layer < len(parts):
        raise ValueError(f"layer = {layer!r}: must be below {len(parts)}; layers are counted from 0")
    return parts[layer]


def _parts(structure: Structure) -> list[sparse.csr_array]:
    """The stiffnesses of the layers of a structure that is not reduced; none where they are not known."""
    origin = structure.origin
    if "reduction" in origin:
        return []
    if origin.get("kind") == "rod":
        layers = [Layer(**{**one, "material": Material(**one["material"])}) for one in origin["layers"]]
        counts = set(origin["elements"])
        return rod_parts(layers, origin["base"], counts.pop() if len(counts) == 1 else None)
    known = "layers" in origin or origin.get("kind") == "spherical shell"
    return stiffness_parts(structure) if known and structure.field is not None else []


def _named(structure: Structure, part: Any) -> dict[str, Any]:
    """How the note of an arm names a part: by its layer, where it is one."""
    for i, one in enumerate(_parts(structure)):
        if sparse.issparse(part) and one.shape == part.shape and abs(one - part).max() == 0.0:
            return {"layer": i}
    return {"part": "given"}


def with_arms(structure: Structure, root: sparse.csr_array, time: float, stiffness: Any = None) -> Structure:
    """The structure with one arm for each row of R (√J/m), their relaxation time (s), and K for arms that cannot relax.

    R may lack the columns of earlier arms. The default K + RᵀR keeps the structure's own K for slow loads.
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
    """Loss tangent of a standard linear solid, tan δ = g ωτ / (1 + (1 + g) ω²τ²).

    Its maximum, g / 2√(1 + g), lies at ωτ = 1/√(1 + g).

    Parameters
    ----------
    share : float
        g: the modulus of the arm in units of the relaxed modulus.
    time : float
        Relaxation time τ, s.
    frequency : float or array_like
        Frequency, Hz.

    Returns
    -------
    float or numpy.ndarray
        tan δ, in the shape of `frequency`.

    Raises
    ------
    ValueError
        If `share` or `time` is not positive.

    Examples
    --------
    >>> import hertzlink as hl
    >>> round(float(hl.damping.loss_tangent(0.1, 5e-6, 30e3)), 4)
    0.0477
    """
    share, time = positive("share", share), positive("time", time, "s")
    phase = 2.0 * np.pi * each(finite, "frequency", frequency, "Hz") * time  # type: ignore[arg-type]
    return share * phase / (1.0 + (1.0 + share) * phase**2)


class MaxwellArms(NamedTuple):
    """Massless degrees of freedom, as standard_linear_solid makes them: |R u − q|²/2 is stored, τ|q̇|² is lost.

    body: the degrees of freedom u that have mass. coupling: R, a row for each q. time: τ of each q, s.
    """

    body: NDArray[np.intp]
    coupling: sparse.csr_array
    time: Vector


def maxwell_arms(structure: Structure) -> MaxwellArms | None:
    """The Maxwell arms of a structure, or None where it has none."""
    if structure.damping is None:
        return None
    massless, damped = (abs(one).sum(axis=0).ravel() for one in (structure.mass, structure.damping))
    # What is massless and undamped, such as the volumes of a gas, belongs to the body.
    is_arm = (massless == 0.0) & (damped > 0.0)
    if not is_arm.any():
        return None
    arms, body = np.flatnonzero(is_arm), np.flatnonzero(~is_arm)
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
    """The part of the stiffness that an arm belongs to, in the size of the structure."""
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
    """R with RᵀR = matrix and as many rows as its rank; a ValueError if the matrix is not positive semidefinite."""
    used = np.flatnonzero(abs(matrix).sum(axis=0))
    if _is_diagonal(matrix) and (matrix.diagonal() >= 0.0).all():
        rows = np.arange(used.size)
        return sparse.csr_array((np.sqrt(matrix.diagonal()[used]), (rows, used)), (used.size, matrix.shape[0]))
    lower, pivots = _factored(matrix[used][:, used])
    if pivots.min() < -RIGID_PIVOT:
        raise ValueError("part: must be positive semidefinite, as the stiffness of a body is")
    kept = pivots > RIGID_PIVOT
    root = sparse.diags_array(np.sqrt(pivots[kept])) @ sparse.csc_array(lower)[:, kept].T
    spread = sparse.csr_array((np.ones(used.size), (np.arange(used.size), used)), (used.size, matrix.shape[0]))
    return sparse.csr_array(root @ spread)


def _factored(matrix: sparse.sparray) -> tuple[sparse.sparray, Vector]:
    """L and the diagonal of D in matrix = L D Lᵀ, rows of L in the matrix's order; D in units of its own diagonal."""
    diagonal = matrix.diagonal()
    if not (diagonal > 0.0).all():
        raise ValueError("part: must be positive semidefinite, as the stiffness of a body is")
    scale = 1.0 / np.sqrt(diagonal)
    # Rigid motions leave pivots of exactly zero, at which SuperLU fails. Rounding changes pivots by more than 1e-15.
    scaled = sparse.diags_array(scale) @ matrix @ sparse.diags_array(scale) + 1e-15 * sparse.eye_array(scale.size)
    factor = splu(
        sparse.csc_array(scaled), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
    )
    lower = sparse.diags_array(1.0 / scale) @ sparse.csr_array(factor.L)[factor.perm_r]
    return lower, factor.U.diagonal()


def _is_diagonal(matrix: sparse.sparray) -> bool:
    return bool(abs(matrix).sum() == abs(matrix.diagonal()).sum())
