"""New places of the public names that moved, and what a name that hertzlink does not have may mean, for messages."""

import sys
from importlib.util import find_spec

from hertzlink._hints import meant
from hertzlink._names import PUBLIC, namespaces

IMPORTER = "importlib._bootstrap"
"""The module whose frame asks for an attribute in `from hertzlink import name`."""

MOVED = {
    "Panel": "Plate",
    "MovingChain": "stepping.MovingChain",
    "MovingStructure": "stepping.MovingStructure",
    "ActiveSetNotConverged": "laws.ActiveSetNotConverged",
    "CentralDifference": "stepping.CentralDifference",
    "ComputedLaw": "laws.ComputedLaw",
    "CriticalDistance": "results.CriticalDistance",
    "Fit": "results.Fit",
    "GeneralisedAlpha": "stepping.GeneralisedAlpha",
    "Laminate": "laminates.Laminate",
    "Newmark": "stepping.Newmark",
    "NoWave": "results.NoWave",
    "NoWaveError": "results.NoWaveError",
    "OrthotropicMaterial": "laminates.OrthotropicMaterial",
    "Ply": "laminates.Ply",
    "PowerLaw": "laws.PowerLaw",
    "PressuresNotConverged": "laws.PressuresNotConverged",
    "ReflectedWave": "results.ReflectedWave",
    "Reflections": "results.Reflections",
    "Section": "laminates.Section",
    "Step": "stepping.Step",
    "THESIS_IMPACT": "impact.THESIS_IMPACT",
    "TabulatedLaw": "laws.TabulatedLaw",
    "Track": "results.Track",
    "Wave": "results.Wave",
    "angular_frequency": "solitary.angular_frequency",
    "animation": "views.animation",
    "axial_stiffness": "layers.axial_stiffness",
    "bead_motion": "views.bead_motion",
    "calibration_factor": "results.calibration_factor",
    "characteristic_length": "layers.characteristic_length",
    "contact_law_bem": "laws.half_spaces",
    "contact_law_fem": "laws.axisymmetric",
    "contact_law_plane": "laws.plane",
    "contact_law_solid": "laws.solid",
    "contact_time_half_space": "layers.contact_time",
    "contact_to_sensor_ratio": "results.contact_to_sensor_ratio",
    "critical_modulus": "layers.critical_modulus",
    "cutoff_frequency": "solitary.cutoff_frequency",
    "cylinder": "layered_cylinder",
    "fit_power_law": "laws.fit_power_law",
    "follow_waves": "results.follow_waves",
    "hertz_pressure": "hertz.pressure",
    "hertz_stiffness": "hertz.stiffness",
    "homogeneous": "laminates.homogeneous",
    "indentation_modulus": "laminates.indentation_modulus",
    "inelasticity_parameter": "impact.inelasticity_parameter",
    "lamb_cutoff_frequency": "lamb.cutoff_frequency",
    "lamb_frequency": "lamb.frequency",
    "lamb_group_speed": "lamb.group_speed",
    "lamb_phase_speed": "lamb.phase_speed",
    "loss_factor": "damping.loss_factor",
    "loss_tangent": "damping.loss_tangent",
    "midplane_correction": "laws.midplane_correction",
    "modal_damping": "damping.modal",
    "normalised_time_of_flight": "impact.normalised_time_of_flight",
    "orthotropic_stiffness": "laminates.orthotropic_stiffness",
    "peak_force_from_particle_speed": "solitary.peak_force_from_particle_speed",
    "picture": "views.picture",
    "plate_amplitude_ratio": "impact.amplitude_ratio",
    "plate_contact_time": "impact.contact_time",
    "point_impedance": "impact.point_impedance",
    "primary_amplitude_ratio": "layers.amplitude_ratio",
    "primary_time_of_flight": "layers.time_of_flight",
    "rayleigh": "damping.rayleigh",
    "rayleigh_speed": "lamb.rayleigh_speed",
    "rod_parts": "damping.rod_parts",
    "run_in_precice": "ports.run_in_precice",
    "secondary_delay": "layers.secondary_delay",
    "solitary_strain": "solitary.strain",
    "sound_speed": "solitary.sound_speed",
    "standard_linear_solid": "damping.standard_linear_solid",
    "stiffness_parts": "damping.stiffness_parts",
    "structure_motion": "views.structure_motion",
    "tangent_stiffness": "solitary.tangent_stiffness",
    "transit_time": "solitary.transit_time",
    "transit_time_from_striker": "solitary.transit_time_from_striker",
    "upper_layer_restitution": "layers.restitution",
    "upper_layer_speed": "layers.upper_speed",
    "wave_speed_from_force": "solitary.wave_speed_from_force",
    "wave_speed_from_particle_speed": "solitary.wave_speed_from_particle_speed",
    "wave_width": "solitary.width",
    "write_fmu": "ports.write_fmu",
    "write_vtu": "views.write_vtu",
    "yield_pressure": "hertz.yield_pressure",
    "zener_contact_time": "zener.contact_time",
    "zener_restitution": "zener.restitution",
}

OTHER_NAMES = {
    "AR": "amplitude_ratio",
    "TOF": "time_of_flight",
    "animate": "views.animation",
    "bead": "Sphere",
    "cosim": "CoSimulation",
    "energy": "energy_error",
    "force": "sensor_force",
    "invert": "identify",
    "plate": "kirchhoff_plate",
    "plot": "plots.traces",
    "read_csv": "read_signal",
    "read_trace": "read_signal",
    "run": "CoSimulation",
    "save_plot": "plots.report",
    "simulate": "CoSimulation",
    "trace": "plots.traces",
    "wall": "half_space",
}
"""What users call a public name."""

ELSEWHERE = {
    "load": 'a saved run is opened with xarray.load_dataset("run.nc")',
    "save": 'a run is saved with run.to_netcdf("run.nc")',
    "read_case": "a case file is run with `hertzlink run case.toml`; hertzlink.from_input makes a case of a run",
}
ELSEWHERE |= dict.fromkeys(("open", "read", "load_run", "open_run", "read_run", "load_dataset"), ELSEWHERE["load"])
ELSEWHERE |= dict.fromkeys(("write", "save_run", "to_netcdf", "export", "dump"), ELSEWHERE["save"])
ELSEWHERE |= dict.fromkeys(("load_case", "open_case", "case", "run_case", "from_toml"), ELSEWHERE["read_case"])
"""What hertzlink leaves to others, and how it is done."""


def missing(name: str, space: str = "") -> Exception:
    """The error for a name that hertzlink, or a namespace of it, does not have.

    `from hertzlink import name` replaces an AttributeError by an ImportError without its message, so it gets an
    ImportError; unless a module of this name can still be imported.
    """
    hint, module = _hint(name, space), f"hertzlink.{space}".rstrip(".")
    importing = sys._getframe(2).f_globals.get("__name__") == IMPORTER
    if importing and not name.startswith("__") and find_spec(f"{module}.{name}") is None:
        return ImportError(f"cannot import name {name!r} from {module!r}{hint}", name=module)
    # Without `obj` Python would add a suggestion of its own, which may be another name.
    return AttributeError(f"module {module!r} has no attribute {name!r}{hint}", name=name, obj=None)


def _hint(name: str, space: str) -> str:
    """Where the name is now, what is meant by it, or the nearest one; upper and lower case count the same."""
    if name.startswith("_"):
        return ""
    inner = meant(name, namespaces()[space], {}) if space else []
    if inner:
        return f"; did you mean hertzlink.{space}.{inner[0]}?"
    if name in MOVED:
        return f"; it is now hertzlink.{MOVED[name]}"
    if name.lower() in ELSEWHERE:
        return f"; {ELSEWHERE[name.lower()]}"
    places = {old.lower(): place for old, place in MOVED.items()}
    for outer, names in namespaces().items():
        places |= {known.lower(): f"{outer}.{known}" for known in names}
    places |= {public.lower(): public for public in PUBLIC}
    places |= {usual.lower(): place for usual, place in OTHER_NAMES.items()}
    found = meant(name, places, {})
    return f"; did you mean hertzlink.{places[found[0]]}?" if found else ""
