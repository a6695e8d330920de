"""Hertz's contact of two surfaces."""

from structures.surface import hertz_pressure as pressure
from structures.surface import hertz_stiffness as stiffness
from structures.surface import yield_pressure

__all__ = ["pressure", "stiffness", "yield_pressure"]
