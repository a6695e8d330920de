"""Classes of results, waves along the chain, and calibration of sensors."""

from coupling.identification.fitting import Fit
from coupling.identification.found import Identification, Unknown
from coupling.identification.information import Information
from coupling.results.critical_distance import CriticalDistance
from coupling.results.measures import contact_to_sensor_ratio
from coupling.results.sensor import calibration_factor
from coupling.results.tracks import Track, follow_waves
from coupling.results.waves import NoWave, NoWaveError, ReflectedWave, Reflections, Wave

__all__ = [
    "calibration_factor",
    "contact_to_sensor_ratio",
    "CriticalDistance",
    "Fit",
    "Identification",
    "Information",
    "follow_waves",
    "NoWave",
    "NoWaveError",
    "ReflectedWave",
    "Reflections",
    "Track",
    "Unknown",
    "Wave",
]
