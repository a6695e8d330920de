"""Damping of structures, by `damped`, and inside deformable beads: Rayleigh, modal and viscoelastic damping."""

from structures.damping import Modal as Modal
from structures.damping import Rayleigh as Rayleigh
from structures.damping import StandardLinearSolid as StandardLinearSolid
from structures.damping import Viscous as Viscous
from structures.damping import damped as damped
