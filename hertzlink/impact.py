"""Closed forms for the impact of chains on plates (Khatri's thesis, section 6.2)."""

from plates.theory.impact import (
    THESIS_IMPACT,
    amplitude_ratio,
    contact_time,
    inelasticity_parameter,
    normalised_time_of_flight,
    point_impedance,
)

__all__ = [
    "THESIS_IMPACT",
    "amplitude_ratio",
    "contact_time",
    "inelasticity_parameter",
    "normalised_time_of_flight",
    "point_impedance",
]
