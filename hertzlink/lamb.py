"""Lamb waves in plates, and Rayleigh waves: frequencies and speeds."""

from plates.theory.lamb import cutoff_frequency, frequency, group_speed, phase_speed, rayleigh_speed

__all__ = ["cutoff_frequency", "frequency", "group_speed", "phase_speed", "rayleigh_speed"]
