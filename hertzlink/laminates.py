"""Laminates of orthotropic plies, sections of plate walls, and forces in their plane."""

from plates.additions import Delamination
from plates.laminate import Laminate, OrthotropicMaterial, Ply
from plates.prestress import Prestress, thermal_prestress
from plates.section import Section, homogeneous
from structures.anisotropy import indentation_modulus, orthotropic_stiffness

__all__ = [
    "Delamination",
    "homogeneous",
    "indentation_modulus",
    "Laminate",
    "orthotropic_stiffness",
    "OrthotropicMaterial",
    "Ply",
    "Prestress",
    "Section",
    "thermal_prestress",
]
