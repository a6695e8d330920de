"""hertzlink: solitary waves in chains of beads, and what structures send back.

The front door: re-exports the public names, nothing else. See the README for a first run.
"""

from importlib.util import find_spec
from pathlib import Path


def _check_rooms() -> None:
    """The rooms have common names: make sure that those to be imported are the ones that stand beside this package."""
    home = Path(__file__).resolve().parent.parent
    for room in ("structures", "particles", "plates", "coupling"):
        spec = find_spec(room)
        places = [] if spec is None else [Path(place).resolve() for place in spec.submodule_search_locations or []]
        if home / room not in places:
            found = "nothing" if spec is None else str(places[0] if places else spec.origin)
            raise ImportError(
                f"hertzlink needs its own package {room!r} from {home}, but Python finds {found}; "
                "rename that one, or take its folder off the path"
            )


_check_rooms()

from coupling.cosimulation import CoSimulation  # noqa: E402
from coupling.explicit_chain import explicit_chain  # noqa: E402
from coupling.identification.fitting import Fit, fit_dissipation  # noqa: E402
from coupling.interface import ContactPoint  # noqa: E402
from coupling.participant import Participant  # noqa: E402
from coupling.ports.fmu import write_fmu  # noqa: E402
from coupling.ports.precice import run_in_precice  # noqa: E402
from coupling.results.critical_distance import CriticalDistance, critical_distance  # noqa: E402
from coupling.results.events import contact_events  # noqa: E402
from coupling.results.measures import (  # noqa: E402
    amplitude_ratio,
    contact_time,
    contact_to_sensor_ratio,
    energy_error,
    reflections,
    sensor_force,
    time_of_flight,
    wave_speed,
)
from coupling.results.sensor import calibration_factor  # noqa: E402
from coupling.results.signals import as_signal, read_signal  # noqa: E402
from coupling.results.tracks import Track, follow_waves  # noqa: E402
from coupling.results.waves import NoWave, NoWaveError, ReflectedWave, Reflections, Wave  # noqa: E402
from coupling.schemes.condensed import Condensed  # noqa: E402
from coupling.schemes.explicit import Explicit  # noqa: E402
from coupling.schemes.iterated import IQN_ILS, Aitken, FixedPoint  # noqa: E402
from coupling.schemes.windows import Adaptive  # noqa: E402
from coupling.state import NotConverged  # noqa: E402
from coupling.sweeps.batch import batch  # noqa: E402
from coupling.sweeps.critical_search import find_critical_distance  # noqa: E402
from coupling.sweeps.sweep import sweep  # noqa: E402
from coupling.views.bead_motion import bead_motion  # noqa: E402
from coupling.views.motion import structure_motion  # noqa: E402
from coupling.views.paraview import write_vtu  # noqa: E402
from coupling.views.pictures import animation, picture  # noqa: E402
from hertzlink.cli import main as main  # noqa: E402
from particles.bead import Cylinder, Ellipsoid, HollowSphere, Sphere, drop_speed  # noqa: E402
from particles.chain import Chain  # noqa: E402
from particles.deformable.chain import DeformableChain  # noqa: E402
from particles.dissipation import (  # noqa: E402
    KuwabaraKono,
    LinearDashpot,
    MassProportional,
    PowerDashpot,
    Restitution,
    Tsuji,
)
from particles.excitation import Piston, PushedBead, SpringLoaded  # noqa: E402
from particles.laws.active_set import ActiveSetNotConverged  # noqa: E402
from particles.laws.axisymmetric import contact_law_fem  # noqa: E402
from particles.laws.computed import ComputedLaw  # noqa: E402
from particles.laws.formulas import PowerLaw, TabulatedLaw, contact_law  # noqa: E402
from particles.laws.half_spaces import PressuresNotConverged, contact_law_bem  # noqa: E402
from particles.laws.plane import contact_law_plane  # noqa: E402
from particles.laws.power_fit import fit_power_law  # noqa: E402
from particles.laws.solid import contact_law_solid, midplane_correction  # noqa: E402
from particles.moving import MovingChain  # noqa: E402
from particles.solitary import (  # noqa: E402
    angular_frequency,
    cutoff_frequency,
    peak_force_from_particle_speed,
    solitary_strain,
    sound_speed,
    tangent_stiffness,
    transit_time,
    transit_time_from_striker,
    wave_speed_from_force,
    wave_speed_from_particle_speed,
    wave_width,
)
from plates.additions import PointMass, Stiffener, Weakened  # noqa: E402
from plates.critical_distance import critical_distance_law  # noqa: E402
from plates.half_plane import half_plane  # noqa: E402
from plates.infinite import infinite_plate  # noqa: E402
from plates.laminate import Laminate, OrthotropicMaterial, Ply  # noqa: E402
from plates.mindlin_plate import mindlin_plate  # noqa: E402
from plates.panel import Panel, kirchhoff_panel, mindlin_panel  # noqa: E402
from plates.plate import Plate, kirchhoff_plate  # noqa: E402
from plates.section import Section, homogeneous  # noqa: E402
from plates.shapes.outline import Outline, circle  # noqa: E402
from plates.support import ElasticEdge, Supports  # noqa: E402
from plates.theory.impact import (  # noqa: E402
    THESIS_IMPACT,
    critical_distance_bounds,
    inelasticity_parameter,
    normalised_time_of_flight,
    plate_amplitude_ratio,
    plate_contact_time,
    point_impedance,
)
from plates.theory.lamb import (  # noqa: E402
    lamb_cutoff_frequency,
    lamb_frequency,
    lamb_group_speed,
    lamb_phase_speed,
    rayleigh_speed,
)
from plates.theory.zener import zener_contact_time, zener_restitution  # noqa: E402
from structures.anisotropy import indentation_modulus, orthotropic_stiffness  # noqa: E402
from structures.caution import HertzlinkWarning  # noqa: E402
from structures.cylinder import cylinder  # noqa: E402
from structures.damping import (  # noqa: E402
    loss_factor,
    loss_tangent,
    modal_damping,
    rayleigh,
    standard_linear_solid,
    stiffness_parts,
)
from structures.elasticity import Foundation  # noqa: E402
from structures.material import (  # noqa: E402
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
from structures.moving import MovingStructure  # noqa: E402
from structures.reduction import reduce  # noqa: E402
from structures.rod import Layer, rod, rod_parts  # noqa: E402
from structures.solid import solid  # noqa: E402
from structures.stepping import CentralDifference, GeneralisedAlpha, Newmark  # noqa: E402
from structures.structure import Structure, half_space  # noqa: E402
from structures.surface import Surface, hertz_pressure, hertz_stiffness, yield_pressure  # noqa: E402
from structures.theory import (  # noqa: E402
    axial_stiffness,
    characteristic_length,
    contact_time_half_space,
    critical_modulus,
    primary_amplitude_ratio,
    primary_time_of_flight,
    secondary_delay,
    upper_layer_restitution,
    upper_layer_speed,
)

__all__ = [
    "ACRYLIC", "ALUMINIUM_6061", "ActiveSetNotConverged", "Adaptive", "Aitken", "BRASS_360", "COPPER",
    "CentralDifference", "Chain", "CoSimulation", "ComputedLaw", "Condensed", "ContactPoint", "Cylinder",
    "DeformableChain", "ElasticEdge", "Ellipsoid", "Explicit", "Fit", "FixedPoint", "Foundation", "GeneralisedAlpha",
    "HertzlinkWarning",
    "HollowSphere", "IQN_ILS", "KuwabaraKono", "Laminate", "Layer", "LinearDashpot", "MATERIALS", "MassProportional",
    "Material", "MovingChain", "MovingStructure", "NYLON", "Newmark", "NoWave", "NoWaveError",
    "NotConverged", "OrthotropicMaterial", "Outline",
    "POLYCARBONATE", "PTFE", "Panel", "Participant", "Piston", "Plate", "Ply", "PointMass", "PowerDashpot", "PowerLaw",
    "PressuresNotConverged", "PushedBead", "ReflectedWave", "Reflections", "Restitution", "STEEL_316", "STEEL_440C",
    "Section", "Sphere", "SpringLoaded", "Stiffener", "Structure", "Supports", "Surface", "THESIS_IMPACT",
    "TabulatedLaw", "Track", "Tsuji", "Wave", "Weakened", "amplitude_ratio", "angular_frequency", "animation",
    "as_signal", "axial_stiffness", "batch", "bead_motion", "calibration_factor", "characteristic_length", "circle",
    "contact_events", "contact_law", "contact_law_bem", "contact_law_fem", "contact_law_plane", "contact_law_solid",
    "contact_time", "contact_time_half_space", "contact_to_sensor_ratio", "critical_distance", "CriticalDistance",
    "critical_distance_bounds", "critical_distance_law", "critical_modulus", "cutoff_frequency", "cylinder",
    "drop_speed", "energy_error", "explicit_chain", "find_critical_distance", "fit_dissipation", "fit_power_law",
    "follow_waves", "half_plane", "half_space", "hertz_pressure", "hertz_stiffness",
    "homogeneous", "indentation_modulus", "inelasticity_parameter", "infinite_plate", "kirchhoff_panel",
    "kirchhoff_plate",
    "lamb_cutoff_frequency", "lamb_frequency", "lamb_group_speed", "lamb_phase_speed", "loss_factor", "loss_tangent",
    "midplane_correction", "mindlin_panel", "mindlin_plate", "modal_damping", "normalised_time_of_flight",
    "orthotropic_stiffness",
    "peak_force_from_particle_speed", "picture", "plate_amplitude_ratio", "plate_contact_time", "point_impedance",
    "primary_amplitude_ratio", "primary_time_of_flight", "rayleigh", "rayleigh_speed", "read_signal", "reduce",
    "reflections", "rod", "rod_parts", "run_in_precice", "secondary_delay", "sensor_force", "solid", "solitary_strain",
    "sound_speed", "standard_linear_solid", "stiffness_parts", "structure_motion", "sweep", "tangent_stiffness",
    "time_of_flight", "transit_time", "transit_time_from_striker", "upper_layer_restitution", "upper_layer_speed",
    "wave_speed", "wave_speed_from_force", "wave_speed_from_particle_speed", "wave_width", "write_fmu", "write_vtu",
    "yield_pressure", "zener_contact_time", "zener_restitution",
]  # fmt: skip
