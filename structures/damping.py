"""Damping of structures, and losses inside beads that vibrate. Damping that is added never supplies energy."""

from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from scipy import sparse

from structures.bodies.rod import Layer, rod_parts
from structures.checks import instance, whole
from structures.described import described, described_as, description
from structures.fineness import fineness
from structures.material import Material
from structures.maxwell import maxwell_arms, root_of, with_arms
from structures.quantities import Likely, Quantity, Rate, RelaxationTime, Share, Time, WhichModulus
from structures.structure import Structure, Vector, known_field


class Viscous:
    """Damping of structures, or inside deformable beads: the base of Modal, Rayleigh, StandardLinearSolid, and yours.

    Examples
    --------
    >>> isinstance(hl.damping.Modal(0.02), hl.damping.Viscous)
    True
    """

    def of_modes(self, frequencies: Vector) -> Vector:
        """Return the rates c of the loss c q′ of modes inside beads, 1/s, from their angular frequencies, rad/s."""
        raise ValueError(f"damping = {self!r}: acts on structures only")

    def of_structure(self, structure: Structure) -> Structure:
        """Return the structure with this damping."""
        raise ValueError(f"damping = {self!r}: acts inside beads only")


@described
class Modal(Viscous):
    """A damping ratio that all modes have: each vibration loses the part 4πζ of its energy in a period.

    A structure must consist of oscillators, as `reduce` returns. A structural loss factor η is ζ = η/2: at its
    resonance each oscillator loses as much as with the stiffness K(1 + iη) (Crandall, J. Sound Vib. 11 (1970) 3).

    Parameters
    ----------
    ratio : float
        Damping ratio ζ, zero or more; 1 is critical damping, and ζ of beads is below it.

    Examples
    --------
    >>> hl.damping.Modal(0.02)
    Modal(ratio=0.02)
    """

    ratio: Annotated[float, Likely.RATIO]

    def of_modes(self, frequencies: Vector) -> Vector:
        """Return c = 2 ζ ω."""
        if self.ratio >= 1.0:
            raise ValueError(f"ratio = {self.ratio!r}: must be below 1 in beads; 1 is critical damping")
        return 2.0 * self.ratio * frequencies

    def of_structure(self, structure: Structure) -> Structure:
        """Return 2 ζ ω for each oscillator."""
        if not structure.is_modal:
            raise ValueError(f"structure: its {structure.size} degrees of freedom are not modes; reduce it first")
        rates = 2.0 * self.ratio * np.sqrt(structure.stiffness.diagonal())
        return _damped(structure, sparse.diags_array(rates), self) if rates.any() else structure


@described
def loss_factor(factor: Annotated[float, Quantity(or_zero=True)]) -> Modal:
    """Modal damping with a structural loss factor η = 2ζ."""
    if factor > 1.0:
        raise ValueError(f"factor = {factor!r}: must lie between 0 and 1; it is η = 2ζ, not a percentage")
    return Modal(factor / 2.0)


@described_as(called="Rayleigh")
class Rayleigh(Viscous):
    """Damping in proportion to mass and stiffness, α M + β K: ζ = α/2ω + βω/2 of a mode of the frequency ω.

    Inside a bead it damps the vibrations alone; `dissipation=hl.KuwabaraKono(β)` is the same loss in its contacts.

    Parameters
    ----------
    mass_rate : float
        α, 1/s, zero or more. The rigid motion of a bead stays undamped.
    stiffness_time : float
        β, s, zero or more. A structure takes it before it gets Maxwell arms.

    Examples
    --------
    >>> hl.damping.Rayleigh(stiffness_time=1e-7)
    Rayleigh(mass_rate=0.0, stiffness_time=1e-07)
    """

    mass_rate: Rate = 0.0
    stiffness_time: Time = 0.0

    def of_modes(self, frequencies: Vector) -> Vector:
        """Return c = α + β ω²."""
        return self.mass_rate + self.stiffness_time * frequencies**2

    def of_structure(self, structure: Structure) -> Structure:
        """Return α M + β K added to the damping."""
        alpha, beta = self.mass_rate, self.stiffness_time
        if beta > 0.0 and maxwell_arms(structure) is not None:
            raise ValueError(f"stiffness_time = {beta!r}: add Rayleigh before StandardLinearSolid")
        if structure.size == 0 or alpha == beta == 0.0:
            return structure
        return _damped(structure, alpha * structure.mass + beta * structure.stiffness, self)


@described_as(called="standard linear solid")
class StandardLinearSolid(Viscous):
    """A viscoelastic solid (Zener): a Maxwell arm, spring and dashpot in series, in parallel to its stiffness.

    Its modulus E(ω) = E + E₁ iωτ / (1 + iωτ) relaxes from E + E₁ under sudden loads to E under slow ones. Reduce a
    large body of one material first: each mode then takes the same arm, exactly. It acts on structures, not in beads.

    Parameters
    ----------
    share : float
        E₁ of the arm, in units of the modulus of the material.
    time : float
        Relaxation time τ of the stress in the arm at constant strain, s.
    modulus : {"relaxed", "instantaneous"}
        Which modulus the material has: that of slow loads, or that of sudden ones, of which `share` < 1 relaxes.

    Examples
    --------
    >>> bar = hl.rod([hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3)])
    >>> hl.damping.damped(bar, hl.damping.StandardLinearSolid(share=0.1, time=2e-6)).size == 2 * bar.size
    True
    """

    share: Share
    time: RelaxationTime
    modulus: WhichModulus = "relaxed"

    def __post_init__(self) -> None:
        if self.modulus == "instantaneous" and self.share >= 1.0:
            raise ValueError(f"share = {self.share!r}: must be below 1 of the instantaneous modulus")

    def of_structure(self, structure: Structure, part: int | None = None) -> Structure:
        """Return the structure with arms in parallel to its stiffness, or to the part of a layer in it."""
        if structure.size == 0:
            return structure
        arms = maxwell_arms(structure)
        if part is not None:
            parts = stiffness_parts(structure)
            layer = parts[whole("part", part, 0, len(parts) - 1)]
            earlier = structure.size - layer.shape[0]  # degrees of freedom of other arms, behind those of the body
            added = sparse.csr_array(sparse.block_diag([layer, sparse.csr_array((earlier, earlier))]))
        elif arms is None:
            added = structure.stiffness
        else:
            raise ValueError("part: the structure has Maxwell arms already; give the layer on which this one acts")
        added = self.share * added
        structure = replace(structure, origin=_noted(structure, self, **({} if part is None else {"layer": part})))
        held = structure.stiffness + added if self.modulus == "relaxed" else structure.stiffness
        return with_arms(structure, root_of(added), self.time, held)


def damped(structure: Structure, damping: Viscous, part: int | None = None) -> Structure:
    """Add damping to a structure; it never supplies energy.

    Parameters
    ----------
    structure : Structure
        The structure to damp. Call the function again for each further damping.
    damping : Rayleigh, Modal or StandardLinearSolid
        What is added.
    part : int, optional
        The layer of a rod or a cylinder, or the material of a solid, from 0, on which a StandardLinearSolid acts alone.

    Returns
    -------
    Structure
        The structure with the added damping.

    Examples
    --------
    >>> bar = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)])
    >>> hl.damping.damped(bar, hl.damping.StandardLinearSolid(share=0.1, time=5e-6), part=1).size > bar.size
    True
    """
    instance("structure", structure, Structure, "a Structure")
    instance("damping", damping, Viscous, "hl.damping.Rayleigh, Modal or StandardLinearSolid")
    if part is None:
        made = damping.of_structure(structure)
    elif isinstance(damping, StandardLinearSolid):
        made = damping.of_structure(structure, part)
    else:
        raise ValueError(f"part: only a StandardLinearSolid acts on a part, not {damping!r}")
    return made if made is structure else made.made_from(structure, damped, damping, part)


def stiffness_parts(structure: Structure) -> list[sparse.csr_array]:
    """Return the part of each layer of a rod or a cylinder, or each material of a solid, in its stiffness, N/m."""
    origin = structure.origin
    if origin.get("kind") != "rod" or "reduction" in origin:
        return known_field(structure).stiffness_parts()
    layers = [Layer(**{**layer, "material": Material(**layer["material"])}) for layer in origin["layers"]]
    counts = set(origin["elements"])
    return rod_parts(layers, origin["base"], counts.pop() // fineness().cells if len(counts) == 1 else None)


def _damped(structure: Structure, matrix: sparse.sparray, damping: Viscous) -> Structure:
    total = matrix if structure.damping is None else structure.damping + matrix
    return replace(structure, damping=sparse.csr_array(total), origin=_noted(structure, damping))


def _noted(structure: Structure, damping: Viscous, **where: Any) -> dict[str, Any]:
    entry = description(type(damping))
    note = {"kind": type(damping).__name__ if entry is None else entry.called, **vars(damping), **where}
    return {**structure.origin, "damping": [*structure.origin.get("damping", []), note]}
