"""Zener's impact of a sphere on an infinite thin plate, in units of Hertz's collision."""

from plates.theory.zener import contact_time, restitution

__all__ = ["contact_time", "restitution"]
