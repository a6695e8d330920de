"""Damping of structures, and losses inside beads that vibrate. Damping that is added never supplies energy.

The amplitude q of a mode of a bead obeys q″ + c q′ + ω² q + g ω² (q − z) = forces, with z′ = (q − z)/τ. The rate c is
that of Rayleigh and modal damping; the spring g ω² in series with a dashpot is the Maxwell arm of a standard linear
solid.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import sparse

from structures.bodies.rod import Layer, rod_parts
from structures.checks import each, finite, instance, short
from structures.described import described, described_as, description
from structures.linear_algebra.factor import check_definite, symmetric
from structures.material import Material
from structures.maxwell import maxwell_arms, root_of, with_arms
from structures.quantities import Likely, Quantity, Rate, RelaxationTime, Share, Time, WhichModulus
from structures.structure import Structure, Vector, known_field


class ModeLoss(NamedTuple):
    """The loss of the modes of a bead, m numbers each.

    square: ω² of slow motions, 1/s². rate: c, 1/s. arm: g ω² of the arm, 1/s². relaxation: 1/τ, 1/s; zero without an
    arm.
    """

    square: Vector
    rate: Vector
    arm: Vector
    relaxation: Vector


class Viscous(ABC):
    """Damping of structures and inside deformable beads: the base of Modal, Rayleigh and StandardLinearSolid.

    Derive a class from it for a loss of your own inside beads.

    Examples
    --------
    >>> import hertzlink as hl
    >>> isinstance(hl.damping.Modal(0.02), hl.damping.Viscous)
    True
    """

    @abstractmethod
    def of_modes(self, frequencies: Vector) -> ModeLoss:
        """Return what modes lose whose angular frequencies, rad/s, are these without a loss.

        Four arrays: ω² of slow motions (1/s²), the rate c (1/s), the arm g ω² (1/s²) and its 1/τ (1/s).
        """

    def of_structure(self, structure: Structure) -> Structure:
        """Return the structure with this damping."""
        raise ValueError(f"damping = {self!r}: acts inside beads only")


@described
class Modal(Viscous):
    """A damping ratio that all modes have: each vibration loses the part 4πζ of its energy in a period.

    A structure must consist of oscillators, as `reduce` returns; the damping is 2 ζ ω for each of them. A structural
    loss factor η is ζ = η/2: at its resonance each oscillator loses as much as with the complex stiffness K(1 + iη),
    below resonance less, above it more. A loss that is the same at all frequencies would act before its cause.

    Parameters
    ----------
    ratio : float or sequence of float
        Damping ratio ζ, zero or more; 1 is critical damping, and ζ of beads is below it. For a structure also one
        number for each oscillator. A rigid motion (ω = 0) stays undamped.

    References
    ----------
    Clough and Penzien, Dynamics of Structures (1993), section 12.3; Crandall, J. Sound Vib. 11 (1970) 3.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.PTFE)
    >>> hl.DeformableChain([bead] * 10, bead, 0.3, damping=hl.damping.Modal(ratio=0.02)).damping
    Modal(ratio=0.02)
    >>> bar = hl.reduce(hl.rod([hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3)]), until=1e-3)
    >>> damped = hl.damped(bar, hl.damping.Modal(0.02))
    >>> rate, square = damped.damping[0, 0], damped.stiffness[0, 0]
    >>> round(float(rate / (2.0 * square**0.5)), 6)
    0.02
    """

    ratio: float | Sequence[float]

    def __post_init__(self) -> None:
        try:
            ratios = np.asarray(self.ratio, dtype=float)
            fine = ratios.ndim < 2 and np.isfinite(ratios).all() and (ratios >= 0.0).all()
        except (TypeError, ValueError):
            fine = False
        if not fine:
            raise ValueError(f"ratio = {short(self.ratio)}: must be zero or positive, one number or a list of numbers")
        Likely.RATIO.warn("Modal", "ratio", float(ratios.max(initial=0.0)))
        if ratios.ndim:
            object.__setattr__(self, "ratio", tuple(ratios.tolist()))

    def of_modes(self, frequencies: Vector) -> ModeLoss:
        """Return c = 2 ζ ω."""
        if isinstance(self.ratio, Sequence) or self.ratio >= 1.0:
            raise ValueError(f"ratio = {self.ratio!r}: must be one number below 1 in beads; 1 is critical damping")
        none = np.zeros_like(frequencies)
        return ModeLoss(frequencies**2, 2.0 * self.ratio * frequencies, none, none)

    def of_structure(self, structure: Structure) -> Structure:
        """Return 2 ζ ω for each oscillator."""
        if not structure.is_modal:
            raise ValueError(
                f"structure: its {structure.size} degrees of freedom are not modes (M = I; K, C diagonal); "
                "reduce it first"
            )
        ratios = np.asarray(self.ratio, dtype=float)
        if ratios.shape not in ((), (structure.size,)):
            raise ValueError(f"ratio = {short(self.ratio)}: must be one number or {structure.size}")
        rates = 2.0 * ratios * np.sqrt(structure.stiffness.diagonal())
        if not rates.any():
            return structure
        return _damped(structure, sparse.diags_array(rates), self)


@described
def loss_factor(factor: Annotated[float, Quantity(or_zero=True)]) -> Modal:
    """Modal damping with a structural loss factor η = 2ζ."""
    if factor > 1.0:
        raise ValueError(f"factor = {factor!r}: must lie between 0 and 1; it is η = 2ζ, not a percentage")
    return Modal(factor / 2.0)


@described_as(called="Rayleigh")
class Rayleigh(Viscous):
    """Damping in proportion to mass and stiffness, α M + β K: ζ = α/2ω + βω/2 of a mode of the frequency ω.

    Inside a bead it damps the vibrations alone. A loss in proportion to the stiffness of the whole bead acts in its
    contacts too: add `dissipation=hl.KuwabaraKono(β)` with the same time.

    Parameters
    ----------
    mass_rate : float
        α, 1/s, zero or more. The rigid motion of a bead stays undamped.
    stiffness_time : float
        β, s, zero or more. A structure takes it before it gets Maxwell arms.

    References
    ----------
    Bathe, Finite Element Procedures, section 9.3.3; Khatri's thesis, chapter 7.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.PTFE)
    >>> loss = hl.damping.Rayleigh(stiffness_time=1e-7)
    >>> hl.DeformableChain([bead] * 10, bead, 0.3, damping=loss, dissipation=hl.KuwabaraKono(1e-7)).damping
    Rayleigh(mass_rate=0.0, stiffness_time=1e-07)
    >>> bar = hl.rod([hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3)])
    >>> round(float(hl.damped(bar, loss).damping[0, 0] / bar.stiffness[0, 0]), 12)
    1e-07
    """

    mass_rate: Rate = 0.0
    stiffness_time: Time = 0.0

    def of_modes(self, frequencies: Vector) -> ModeLoss:
        """Return c = α + β ω²."""
        none = np.zeros_like(frequencies)
        return ModeLoss(frequencies**2, self.mass_rate + self.stiffness_time * frequencies**2, none, none)

    def of_structure(self, structure: Structure) -> Structure:
        """Return α M + β K added to the damping matrix."""
        alpha, beta = self.mass_rate, self.stiffness_time
        if beta > 0.0 and maxwell_arms(structure) is not None:
            raise ValueError(
                f"stiffness_time = {beta!r}: the structure has Maxwell arms; add Rayleigh before StandardLinearSolid"
            )
        if structure.size == 0 or alpha == beta == 0.0:
            return structure
        matrix = alpha * structure.mass + beta * structure.stiffness
        return _damped(structure, matrix, self)


@described_as(called="standard linear solid")
class StandardLinearSolid(Viscous):
    """A viscoelastic solid: a Maxwell arm (a spring and a dashpot in series) in parallel to its stiffness.

    Its modulus is E(ω) = E + E₁ iωτ / (1 + iωτ): it relaxes from E + E₁ under sudden loads to E under slow ones, with
    the time τ. The loss is largest at ω = 1/(τ√(1 + E₁/E)), see `loss_tangent`. Inside a bead it acts on the
    vibrations, and the contacts keep the modulus of the bead's material. A structure gets massless degrees of freedom
    q, in √J: one for each independent deformation of what is damped. With RᵀR the stiffness of the arm, its stored
    energy is |R u − q|²/2 and its loss τ|q̇|². So M, C and K stay symmetric and positive semidefinite. Reduce a large
    body of one material first: then each mode takes the same arm, exactly and at no cost.

    Parameters
    ----------
    share : float
        E₁ of the arm, in units of the modulus of the material.
    time : float
        Relaxation time τ, s: the time constant with which the stress of the arm decays at constant strain.
    modulus : {"relaxed", "instantaneous"}
        Which modulus the material has. "relaxed": that of slow loads; the arm makes the body stiffer under sudden
        loads. "instantaneous": that of sudden loads; the fraction `share` < 1 of it relaxes, as in Prony series.

    References
    ----------
    Zener, Elasticity and Anelasticity of Metals (1948), chapter 5.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.PTFE)
    >>> hl.DeformableChain([bead] * 10, bead, 0.3, damping=hl.damping.StandardLinearSolid(share=0.1, time=2e-6)).damping
    StandardLinearSolid(share=0.1, time=2e-06, modulus='relaxed')
    """

    share: Share
    time: RelaxationTime
    modulus: WhichModulus = "relaxed"

    def __post_init__(self) -> None:
        if self.modulus == "instantaneous" and self.share >= 1.0:
            raise ValueError(f"share = {self.share!r}: must be below 1 of the instantaneous modulus")

    def loss_tangent(self, frequency: ArrayLike) -> Any:
        """Return the loss tangent at frequencies in Hz: tan δ = g ωτ / (1 + (1 + g) ω²τ²), g the share of the relaxed
        modulus.

        Its maximum, g / 2√(1 + g), lies at ωτ = 1/√(1 + g).
        """
        share = self.share if self.modulus == "relaxed" else self.share / (1.0 - self.share)
        phase = 2.0 * np.pi * each(finite, "frequency", frequency, "Hz") * self.time  # type: ignore[arg-type]
        return share * phase / (1.0 + (1.0 + share) * phase**2)

    def of_modes(self, frequencies: Vector) -> ModeLoss:
        """Return an arm of g ω²."""
        arm = self.share * frequencies**2
        slow = frequencies**2 - (arm if self.modulus == "instantaneous" else 0.0)
        return ModeLoss(slow, np.zeros_like(arm), arm, np.full_like(arm, 1.0 / self.time))

    def of_structure(self, structure: Structure, part: Any = None) -> Structure:
        """Return an arm in parallel to the stiffness, or to a part of it: the number of a layer, or a matrix."""
        if structure.size == 0:
            return structure
        by_number = isinstance(part, int | np.integer) and not isinstance(part, bool)
        where = {} if part is None else {"layer": int(part)} if by_number else {"part": "given"}
        whole = part is None and maxwell_arms(structure) is None
        added = self.share * (structure.stiffness if whole else _part(structure, part, by_number))
        root = root_of(added)
        structure = replace(structure, origin=_noted(structure, self, **where))
        if self.modulus == "relaxed":
            return with_arms(structure, root, self.time, structure.stiffness + added)
        try:
            check_definite("stiffness", symmetric("stiffness", structure.stiffness - added))
        except ValueError as error:
            raise ValueError(f"part: {self.share} of it is more than the structure's stiffness") from error
        return with_arms(structure, root, self.time, structure.stiffness)


def damped(structure: Structure, damping: Viscous, part: Any = None) -> Structure:
    """Add damping to a structure; it never supplies energy.

    Parameters
    ----------
    structure : Structure
        The structure to damp. Call the function again for each further damping.
    damping : Rayleigh, Modal or StandardLinearSolid
        What is added.
    part : int or matrix, optional
        The part of the stiffness on which a StandardLinearSolid acts, by default the whole: the number of a layer of a
        rod or a cylinder, or of a material of a solid, counted from 0, or a stiffness matrix, N/m.

    Returns
    -------
    Structure
        The structure with the added damping.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bar = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)])
    >>> ptfe = hl.damped(bar, hl.damping.StandardLinearSolid(share=0.1, time=5e-6), part=1)
    >>> ptfe.size > bar.size
    True
    """
    instance("structure", structure, Structure, "a Structure")
    instance("damping", damping, Viscous, "hl.damping.Rayleigh, Modal or StandardLinearSolid")
    if part is not None and not isinstance(damping, StandardLinearSolid):
        raise ValueError(f"part: only a StandardLinearSolid acts on a part, not {damping!r}")
    made = damping.of_structure(structure) if part is None else damping.of_structure(structure, part)  # type: ignore[call-arg]
    # Matrices, and a ratio for each oscillator, belong to one mesh.
    sized = not (part is None or isinstance(part, int)) or isinstance(getattr(damping, "ratio", None), tuple)
    if made is structure or structure.again is None or sized:
        return made
    return made.made_by(partial(_damped_again, structure.again, damping, part))


def _damped_again(again: Callable[[], Structure], damping: Viscous, part: int | None) -> Structure:
    return damped(again(), damping, part)


def stiffness_parts(structure: Structure) -> list[sparse.csr_array]:
    """Return the contribution of each layer of a rod or a cylinder, or of each material of a solid, to its stiffness.

    Matrices of n × n, N/m, without elastic foundations, n without arms. A ValueError if the structure has no field, as
    a reduced one without keep_field=True.
    """
    origin = structure.origin
    if origin.get("kind") != "rod" or "reduction" in origin:
        return known_field(structure).stiffness_parts()
    layers = [Layer(**{**layer, "material": Material(**layer["material"])}) for layer in origin["layers"]]
    counts = set(origin["elements"])
    return rod_parts(layers, origin["base"], counts.pop() if len(counts) == 1 else None)


def _damped(structure: Structure, matrix: sparse.sparray, damping: Viscous) -> Structure:
    total = matrix if structure.damping is None else structure.damping + matrix
    return replace(structure, damping=sparse.csr_array(total), origin=_noted(structure, damping))


def _noted(structure: Structure, damping: Viscous, **where: Any) -> dict[str, Any]:
    entry = description(type(damping))
    note = {"kind": type(damping).__name__ if entry is None else entry.called, **vars(damping), **where}
    return {**structure.origin, "damping": [*structure.origin.get("damping", []), note]}


def _part(structure: Structure, part: Any, by_number: bool) -> sparse.csr_array:
    """Return the part of the stiffness that an arm belongs to, in the size of the structure."""
    if part is None:
        raise ValueError("part: the structure has Maxwell arms already; give the part of K that this one belongs to")
    if by_number:
        own_rod = structure.origin.get("kind") == "rod" and "reduction" not in structure.origin
        parts = stiffness_parts(structure) if own_rod or structure.field is not None else []
        if not parts:
            raise ValueError("part: only a layer of a rod or a cylinder, and a material of a solid can be damped alone")
        if not 0 <= part < len(parts):
            raise ValueError(f"part = {part!r}: must be below {len(parts)}; layers are counted from 0")
        part = parts[part]
    arms = maxwell_arms(structure)
    body = np.arange(structure.size) if arms is None else arms.body
    try:
        matrix = sparse.csr_array(part if sparse.issparse(part) else np.atleast_2d(np.asarray(part, dtype=float)))
    except (TypeError, ValueError) as error:
        raise ValueError(f"part = {part!r}: must be a matrix, or the number of a layer") from error
    if matrix.shape != (body.size, body.size):
        raise ValueError(f"part has shape {matrix.shape}: must be ({body.size}, {body.size}), as the stiffness has")
    if not np.isfinite(matrix.data).all() or abs(matrix - matrix.T).max() > 1e-9 * abs(matrix).max():
        raise ValueError("part: must be symmetric and hold finite numbers")
    spread = sparse.csr_array((np.ones(body.size), (body, np.arange(body.size))), (structure.size, body.size))
    return sparse.csr_array(spread @ matrix @ spread.T)
