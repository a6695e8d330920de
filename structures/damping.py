"""Damping of structures, and losses inside beads that vibrate. Added damping never supplies energy."""

from dataclasses import replace
from typing import Annotated

import numpy as np
from scipy import sparse

from structures.bodies.rod import Layer, layer_matrices
from structures.checks import instance, whole
from structures.described import described, described_as, description
from structures.material import Material
from structures.maxwell import maxwell_arms, root_of, with_arms
from structures.quantities import Likely, Quantity, Rate, RelaxationTime, Share, Time, WhichModulus
from structures.structure import Structure, Vector, known_field


class Viscous:
    """The base class of damping in structures or deformable beads: Modal, Rayleigh, StandardLinearSolid, your own.

    Examples
    --------
    >>> isinstance(hl.damping.Modal(0.02), hl.damping.Viscous)
    True
    """

    def of_modes(self, frequencies: Vector) -> Vector:
        """Return the rates c of the losses c q′ of modes inside beads, 1/s, from their angular frequencies, rad/s."""
        raise ValueError(f"damping = {self!r}: must not be inside beads; it acts on structures only")

    def of_structure(self, structure: Structure) -> Structure:
        """Return the structure with this damping."""
        raise ValueError(f"damping = {self!r}: must not be on a structure; it acts inside beads only")


@described
class Modal(Viscous):
    """The same damping ratio ζ for all modes: each vibration loses the fraction 4πζ of its energy in a period.

    A structure must consist of oscillators, such as `reduce` returns. A structural loss factor η means ζ = η/2: at its
    resonance each oscillator loses as much as with the stiffness K(1 + iη) (Crandall, J. Sound Vib. 11 (1970) 3).

    Parameters
    ----------
    ratio : float
        Damping ratio ζ, zero or more; 1 is critical damping. In beads ζ must be below 1.

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
            raise ValueError("structure: must consist of modes; reduce it first")
        rates = 2.0 * self.ratio * np.sqrt(structure.stiffness.diagonal())
        return _damped(structure, sparse.diags_array(rates)) if rates.any() else structure


@described
def loss_factor(factor: Annotated[float, Quantity(high=1.0, or_zero=True)]) -> Modal:
    """Modal damping with a structural loss factor η = 2ζ, which is not a percentage."""
    return Modal(factor / 2.0)


@described_as(called="Rayleigh")
class Rayleigh(Viscous):
    """Damping in proportion to mass and stiffness, α M + β K: ζ = α/2ω + βω/2 for a mode of angular frequency ω.

    Inside a bead it damps only the vibrations; `dissipation=hl.KuwabaraKono(β)` is the same loss in the contacts.

    Parameters
    ----------
    mass_rate : float
        α, 1/s, zero or more. The rigid motion of a bead stays undamped.
    stiffness_time : float
        β, s, zero or more. Add it to a structure before any StandardLinearSolid.

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
        """Return the structure with α M + β K added to its damping."""
        alpha, beta = self.mass_rate, self.stiffness_time
        if beta > 0.0 and maxwell_arms(structure) is not None:
            raise ValueError(f"stiffness_time = {beta!r}: add Rayleigh before StandardLinearSolid")
        if structure.size == 0 or alpha == beta == 0.0:
            return structure
        return _damped(structure, alpha * structure.mass + beta * structure.stiffness)


@described_as(called="standard linear solid")
class StandardLinearSolid(Viscous):
    """A viscoelastic solid (Zener): a Maxwell arm (spring and dashpot in series) parallel to the elastic stiffness.

    The modulus E(ω) = E + E₁ iωτ / (1 + iωτ) relaxes from E + E₁ under sudden loads to E under slow loads. It acts on
    structures, not in beads. Reduce a large body of one material first: each mode then has the same arm, exactly.

    Parameters
    ----------
    share : float
        E₁ of the arm, as a fraction of the modulus of the material.
    time : float
        Relaxation time τ of the stress in the arm at constant strain, s.
    modulus : {"relaxed", "instantaneous"}
        Meaning of the material's modulus: that for slow loads, or that for sudden loads, of which `share` < 1 relaxes.

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
            raise ValueError(f"share = {self.share!r}: must be below 1 for an instantaneous modulus")

    def of_structure(self, structure: Structure, part: int | None = None) -> Structure:
        """Return the structure with arms in parallel to its stiffness, or to the contribution of one layer."""
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
            raise ValueError("part: the structure has Maxwell arms already; must be the layer of the new ones")
        added = self.share * added
        held = structure.stiffness + added if self.modulus == "relaxed" else structure.stiffness
        return with_arms(structure, root_of(added), self.time, held)


def damped(structure: Structure, damping: Viscous, part: int | None = None) -> Structure:
    """Add damping to a structure.

    Parameters
    ----------
    structure : Structure
        The structure to damp. Call the function again for each further damping.
    damping : Rayleigh, Modal or StandardLinearSolid
        The damping to add; it never supplies energy.
    part : int, optional
        The layer of a rod or a cylinder, or the material of a solid, on which a StandardLinearSolid acts, from 0.

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
    if part is None:
        instance("damping", damping, Viscous, "hl.damping.Rayleigh, Modal or StandardLinearSolid")
    else:
        instance("damping", damping, StandardLinearSolid, "a StandardLinearSolid, which alone acts on a part")
    made = damping.of_structure(structure, *([] if part is None else [part]))
    if made is structure:
        return structure
    entry = description(type(damping))
    note = {"kind": type(damping).__name__ if entry is None else entry.called, **vars(damping)}
    notes = [*structure.origin.get("damping", []), note if part is None else {**note, "layer": part}]
    made = replace(made, origin={**structure.origin, "damping": notes})
    return made.made_from(structure, damped, damping, part)


def stiffness_parts(structure: Structure) -> list[sparse.csr_array]:
    """Return the contribution of each layer of a rod or a cylinder, or each material of a solid, to K, N/m."""
    origin = structure.origin
    if origin.get("kind") != "rod" or "reduction" in origin:
        return known_field(structure).stiffness_parts()
    layers = [Layer(**{**layer, "material": Material(**layer["material"])}) for layer in origin["layers"]]
    _, springs = layer_matrices(layers, origin["elements"])
    free = np.delete(np.arange(springs[0].shape[0]), [sum(origin["elements"])] if origin["base"] == "fixed" else [])
    return [part[free][:, free] for part in springs]


def _damped(structure: Structure, matrix: sparse.sparray) -> Structure:
    total = matrix if structure.damping is None else structure.damping + matrix
    return replace(structure, damping=sparse.csr_array(total))
