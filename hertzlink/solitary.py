"""Closed forms for solitary and linear waves in chains (Khatri's thesis, chapters 1, 5 and 6)."""

from particles.solitary import (
    angular_frequency,
    cutoff_frequency,
    peak_force_from_particle_speed,
    sound_speed,
    strain,
    tangent_stiffness,
    transit_time,
    transit_time_from_striker,
    wave_speed_from_force,
    wave_speed_from_particle_speed,
    width,
)

__all__ = [
    "angular_frequency",
    "cutoff_frequency",
    "peak_force_from_particle_speed",
    "sound_speed",
    "strain",
    "tangent_stiffness",
    "transit_time",
    "transit_time_from_striker",
    "wave_speed_from_force",
    "wave_speed_from_particle_speed",
    "width",
]
