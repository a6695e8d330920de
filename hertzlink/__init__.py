"""hertzlink simulates solitary waves in chains of beads, and their reflection from structures.

A striker taps one end of a chain of beads. The other end touches a structure: a half-space, a rod or a plate. The
discrete-particle model of the chain and the finite-element model of the structure are coupled through the Hertzian
contact at the last bead. The results are the amplitude ratio (AR) and the time of flight (TOF) of the reflected waves.

This module exports the public names. A first run:

>>> import hertzlink as hl
>>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
>>> chain = hl.Chain([bead] * 20, striker=bead, impact_speed=hl.drop_speed(0.01))
>>> rod = hl.rod([hl.Layer(hl.STEEL_440C, length=0.1, radius=9.525e-3)])
>>> run = hl.CoSimulation(chain, rod).run(until=1e-3)
>>> round(float(hl.time_of_flight(run, sensor=7)) * 1e6)
461
"""

from typing import TYPE_CHECKING

from hertzlink import _rooms as _rooms  # first: it checks that the packages below are those of hertzlink

# isort: split
from coupling.cosimulation import CoSimulation
from coupling.explicit_chain import explicit_chain
from coupling.identification.fitting import fit_dissipation
from coupling.interface import ContactPoint
from coupling.participant import Participant
from coupling.results.ar_and_tof import amplitude_ratio, reflections, time_of_flight, wave_speed
from coupling.results.critical_distance import critical_distance
from coupling.results.events import contact_events
from coupling.results.measures import contact_time, energy_error, sensor_force
from coupling.results.provenance import version_of
from coupling.results.signals import as_signal, read_signal
from coupling.results.waves import NoWaveError
from coupling.schemes.condensed import Condensed
from coupling.schemes.explicit import Explicit
from coupling.schemes.iterated import IQN_ILS, Aitken, FixedPoint
from coupling.schemes.scheme import Scheme
from coupling.schemes.windows import Adaptive
from coupling.state import NotConverged
from coupling.sweeps.batch import batch
from coupling.sweeps.critical_search import find_critical_distance
from coupling.sweeps.sweep import sweep
from hertzlink import (
    damping,
    hertz,
    impact,
    lamb,
    laminates,
    laws,
    layers,
    ports,
    results,
    solitary,
    stepping,
    views,
    zener,
)
from hertzlink._help import name_for_users
from particles.bead import Bead, Cylinder, Ellipsoid, HollowSphere, Sphere, drop_speed
from particles.chain import Chain
from particles.deformable.chain import DeformableChain
from particles.dissipation import (
    Dissipation,
    KuwabaraKono,
    LinearDashpot,
    MassProportional,
    PowerDashpot,
    Restitution,
    Tsuji,
)
from particles.excitation import Excitation, Piston, PushedBead, SpringLoaded
from particles.laws.formulas import contact_law
from particles.laws.law import ContactLaw
from plates.additions import PointMass, Stiffener, Weakened
from plates.builders import kirchhoff_panel, kirchhoff_plate, mindlin_panel, mindlin_plate
from plates.critical_distance import critical_distance_law
from plates.half_plane import half_plane
from plates.infinite import infinite_plate
from plates.plate import Plate
from plates.shapes.outline import Outline, circle
from plates.support import ElasticEdge, Supports
from plates.theory.impact import critical_distance_bounds
from structures.caution import HertzlinkWarning
from structures.cylinder import layered_cylinder
from structures.elasticity import Foundation
from structures.material import (
    ACRYLIC,
    ALUMINIUM_6061,
    BRASS_360,
    COPPER,
    MATERIALS,
    NYLON,
    POLYCARBONATE,
    PTFE,
    STEEL_316,
    STEEL_440C,
    Material,
)
from structures.reduction import reduce
from structures.rod import Layer, rod
from structures.solid import solid
from structures.stepping import Step
from structures.structure import Structure, half_space
from structures.surface import Surface

__all__ = [
    "ACRYLIC",
    "Adaptive",
    "Aitken",
    "ALUMINIUM_6061",
    "amplitude_ratio",
    "as_signal",
    "batch",
    "Bead",
    "BRASS_360",
    "Chain",
    "circle",
    "Condensed",
    "contact_events",
    "contact_law",
    "contact_time",
    "ContactLaw",
    "ContactPoint",
    "COPPER",
    "CoSimulation",
    "critical_distance",
    "critical_distance_bounds",
    "critical_distance_law",
    "Cylinder",
    "damping",
    "DeformableChain",
    "Dissipation",
    "drop_speed",
    "ElasticEdge",
    "Ellipsoid",
    "energy_error",
    "Excitation",
    "Explicit",
    "explicit_chain",
    "find_critical_distance",
    "fit_dissipation",
    "FixedPoint",
    "Foundation",
    "half_plane",
    "half_space",
    "hertz",
    "HertzlinkWarning",
    "HollowSphere",
    "impact",
    "infinite_plate",
    "IQN_ILS",
    "kirchhoff_panel",
    "kirchhoff_plate",
    "KuwabaraKono",
    "lamb",
    "laminates",
    "laws",
    "Layer",
    "layered_cylinder",
    "layers",
    "LinearDashpot",
    "MassProportional",
    "Material",
    "MATERIALS",
    "mindlin_panel",
    "mindlin_plate",
    "NotConverged",
    "NoWaveError",
    "NYLON",
    "Outline",
    "Participant",
    "Piston",
    "Plate",
    "PointMass",
    "POLYCARBONATE",
    "ports",
    "PowerDashpot",
    "PTFE",
    "PushedBead",
    "read_signal",
    "reduce",
    "reflections",
    "Restitution",
    "results",
    "rod",
    "Scheme",
    "sensor_force",
    "solid",
    "solitary",
    "Sphere",
    "SpringLoaded",
    "STEEL_316",
    "STEEL_440C",
    "stepping",
    "Step",
    "Stiffener",
    "Structure",
    "Supports",
    "Surface",
    "sweep",
    "time_of_flight",
    "Tsuji",
    "views",
    "wave_speed",
    "Weakened",
    "zener",
]


__version__ = version_of("hertzlink")

if not TYPE_CHECKING:  # Else a checker would accept any name.

    def __getattr__(name: str) -> object:
        """Raise an AttributeError or ImportError, which gives the new place of a name, or the nearest name."""
        from hertzlink._moved import missing

        raise missing(name, __all__)


def __dir__() -> list[str]:
    return sorted(__all__)


name_for_users(globals(), __all__)
