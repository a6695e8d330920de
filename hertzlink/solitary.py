"""Solitary and linear waves in chains, in closed form (thesis, chapters 1 and 5)."""

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
