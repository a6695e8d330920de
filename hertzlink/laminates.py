"""Laminates of orthotropic plies, and sections of plate walls."""

from plates.laminate import Laminate, OrthotropicMaterial, Ply
from plates.section import Section, homogeneous
from structures.anisotropy import indentation_modulus, orthotropic_stiffness

__all__ = [
    "homogeneous",
    "indentation_modulus",
    "Laminate",
    "orthotropic_stiffness",
    "OrthotropicMaterial",
    "Ply",
    "Section",
]
