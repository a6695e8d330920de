"""Damping of structures by functions, of deformable beads by classes: Rayleigh, modal and viscoelastic damping."""

from particles.deformable.viscous import Modal, Rayleigh, StandardLinearSolid, Viscous
from structures.damping import loss_factor, loss_tangent, modal, rayleigh, standard_linear_solid, stiffness_parts
from structures.rod import rod_parts

__all__ = [
    "loss_factor",
    "loss_tangent",
    "modal",
    "Modal",
    "rayleigh",
    "Rayleigh",
    "rod_parts",
    "standard_linear_solid",
    "StandardLinearSolid",
    "stiffness_parts",
    "Viscous",
]
