"""Damping of structures by functions, of deformable beads by classes: Rayleigh, modal and viscoelastic damping."""

from particles.deformable.viscous import Modal as Modal
from particles.deformable.viscous import Rayleigh as Rayleigh
from particles.deformable.viscous import StandardLinearSolid as StandardLinearSolid
from particles.deformable.viscous import Viscous as Viscous
from structures.damping import loss_factor as loss_factor
from structures.damping import loss_tangent as loss_tangent
from structures.damping import modal as modal
from structures.damping import rayleigh as rayleigh
from structures.damping import standard_linear_solid as standard_linear_solid
from structures.damping import stiffness_parts as stiffness_parts
from structures.rod import rod_parts as rod_parts
