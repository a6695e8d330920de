"""Spherical shells under pressure: balls and vessels, struck at a pole."""

from structures.spherical_shell import spherical_shell
from structures.thin_sphere import buckling_pressure, point_stiffness

__all__ = ["buckling_pressure", "point_stiffness", "spherical_shell"]
