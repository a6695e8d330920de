"""Closed forms for contacts, waves in chains and rods, and impacts."""

from particles.solitary import UniformChain as UniformChain
from plates.impact import PlateImpact as PlateImpact
from plates.impact import zener_restitution as zener_restitution
from structures.bodies import layers as _layers
from structures.bodies.anisotropy import indentation_modulus as indentation_modulus
from structures.bodies.anisotropy import orthotropic_stiffness as orthotropic_stiffness
from structures.bodies.layers import secondary_delay as secondary_delay
from structures.surface import hertz_pressure as hertz_pressure
from structures.surface import hertz_stiffness as hertz_stiffness
from structures.surface import yield_pressure as yield_pressure

hertz_contact_time = _layers.contact_time
layer_restitution = _layers.restitution
primary_time_of_flight = _layers.time_of_flight
