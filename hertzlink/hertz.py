"""Hertz's contact between two surfaces: stiffness, peak pressure and pressure at first yield."""

from structures.surface import hertz_pressure as pressure
from structures.surface import hertz_stiffness as stiffness
from structures.surface import yield_pressure

__all__ = ["pressure", "stiffness", "yield_pressure"]
