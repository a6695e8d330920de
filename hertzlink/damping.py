"""Damping of structures: Rayleigh, modal and viscoelastic damping."""

from structures.damping import loss_factor, loss_tangent, modal, rayleigh, standard_linear_solid, stiffness_parts
from structures.rod import rod_parts

__all__ = ["loss_factor", "loss_tangent", "modal", "rayleigh", "rod_parts", "standard_linear_solid", "stiffness_parts"]
