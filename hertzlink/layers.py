"""Closed forms for the impact of chains on half-spaces, rods and layered rods (Khatri's thesis, section 6.1)."""

from structures.layers import (
    amplitude_ratio,
    axial_stiffness,
    characteristic_length,
    contact_time,
    critical_modulus,
    restitution,
    secondary_delay,
    time_of_flight,
    upper_speed,
)

__all__ = [
    "amplitude_ratio",
    "axial_stiffness",
    "characteristic_length",
    "contact_time",
    "critical_modulus",
    "restitution",
    "secondary_delay",
    "time_of_flight",
    "upper_speed",
]
