"""The schema of all results: the name, unit, dimensions and description of each variable, and the kinds of Datasets.

Time is the first dimension. Then come chains, interfaces or structures, if a run has several of them, and then the
bodies of a chain. Chains shorter than the longest one are padded with NaN; `coupling.results.reading` removes the
padding.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from structures.quantities import Likely

LAST, FIRST = 0, 1  # The two ends of a chain: the last bead, and the struck end.
END_NAMES = ("last bead", "first bead")  # Their names in a result.


class Contact(NamedTuple):
    """An end of a chain (LAST or FIRST) on a contact point of a structure, by their numbers in the run."""

    chain: int
    end: int
    structure: int
    point: int


class Variable(NamedTuple):
    """Unit and description; owner: "chain", "interface" or "structure"; bodies: the dimensions along a chain."""

    units: str
    description: str
    owner: str = ""
    bodies: tuple[str, ...] = ()


WORDS = {
    "distance thickness length radius diameter depth height width x y": Likely.SIDE,
    "modulus strength": Likely.MODULUS,
    "speed": Likely.SPEED,
    "preload force": Likely.PRELOAD,
    "density": Likely.DENSITY,
    "time until window": Likely.TIME,
    "frequency": Likely.FREQUENCY,
}
"""The quantity of a parameter without a stated unit, by the last word of its name. All numbers are in SI units."""

BEADS, CONTACTS, MODES = ("bead",), ("contact",), ("bead", "mode")

VARIABLES = {
    "displacement": Variable(
        "m", "displacement from static equilibrium; bead 0 is the striker or the surface behind", "chain", BEADS
    ),
    "velocity": Variable("m/s", "velocity; bead 0 is the striker or the surface behind", "chain", BEADS),
    "contact_force": Variable("N", "force between bead n - 1 and bead n, preload included", "chain", CONTACTS),
    "dent": Variable("m", "overlap that would be left of a contact without force", "chain", CONTACTS),
    "section_force": Variable(
        "N", "compressive force through the central section of a deformable bead", "chain", BEADS
    ),
    "vibration_energy": Variable(
        "J", "kinetic and elastic energy of a deformable bead's modes beyond the rigid one", "chain", BEADS
    ),
    "vibration_amplitude": Variable("m √kg", "amplitude of these modes, mass-normalised", "chain", MODES),
    "kinetic_energy": Variable("J", "kinetic energy of striker and beads", "chain"),
    "contact_energy": Variable("J", "energy of contacts, gravity, dead load and spring, from the start", "chain"),
    "dissipated_energy": Variable("J", "energy taken by losses since the start", "chain"),
    "excitation_work": Variable("J", "work of a force history or a piston since the start", "chain"),
    "surface_displacement": Variable("m", "displacement of the structure's contact point", "interface"),
    "gap": Variable(
        "m", "between bead and surface, negative where they indent; NaN where a chain faces nothing", "interface"
    ),
    "interface_work": Variable("J", "work of the dynamic contact force that the structure received", "interface"),
    "interface_work_of_chain": Variable("J", "the same work, as the chain gave it", "interface"),
    "interface_mismatch": Variable("J", "work that the chain gave minus work that was received", "interface"),
    "interface_impulse": Variable("N s", "impulse of the dynamic contact force on the structure", "interface"),
    "structure_work": Variable("J", "work of all dynamic contact forces on the structure since the start", "structure"),
    "structure_kinetic_energy": Variable("J", "kinetic energy of the structure, NaN if unknown", "structure"),
    "structure_elastic_energy": Variable("J", "elastic energy of the structure, NaN if unknown", "structure"),
    "structure_energy": Variable("J", "sum of both, in the metric of the time stepping", "structure"),
    "structure_dissipated_energy": Variable(
        "J", "energy taken by the structure's damping since the start", "structure"
    ),
    "structure_numerical_loss": Variable("J", "work minus energy and damping: the time stepping's loss", "structure"),
    "evaluations": Variable("1", "chain windows tried since the last saved time"),
    "windows": Variable("1", "windows since the last saved time; more than usual where one was halved"),
    "residual": Variable("N", "greatest disagreement on a mean force since the last saved time"),
    "sensor_force": Variable("N", "force at bead", bodies=("sensor",)),
}
"""All variables of runs, batches and signals. Those of deformable beads exist where a run has such beads."""

COORDINATES = (
    "time", "bead", "contact", "mode", "sensor", "chain", "interface", "structure", "centre", "static_force",
    "impact_energy", *(f"interface_{name}" for name in Contact._fields),
)  # fmt: skip

# Names that every run uses: no axis of a sweep may have one of them.
OF_RUNS = frozenset({*COORDINATES, *VARIABLES} - {"sensor", "sensor_force"})
# Kinds of Datasets: of one run, of measured forces, of `batch`, of runs over other axes, and of bodies in motion.
RUN, SIGNAL, BATCH, SWEEP, MOTION = "run", "signal", "batch", "sweep", "motion"


def kind_of(data: xr.Dataset) -> str:
    """RUN, SIGNAL, BATCH, SWEEP or MOTION; "" for a Dataset of another kind."""
    names = data.data_vars
    if "sensor_force" in names:
        return SIGNAL
    if "von_mises" in names:
        return MOTION
    if "contact_force" not in names:
        return ""
    if not axes_of(data.variables["contact_force"]):
        return RUN
    return BATCH if "beads" in data.attrs else SWEEP


def axes_of(values: xr.DataArray | xr.Variable) -> list[str]:
    """Return the dimensions that a variable of one run does not have: the axes of a sweep."""
    return [str(axis) for axis in values.dims if axis not in COORDINATES]


def unit_of(name: str) -> str:
    """Return the SI unit of a parameter, "" if its name does not imply one."""
    last = name.rsplit("_", 1)[-1]
    return next((what.unit for words, what in WORDS.items() if last in words.split()), "")


def run_coordinates(
    times: Any, bodies: Sequence[int], contacts: Sequence[int], centres: Any, static_force: Any,
    impact_energy: Any = None, owner: Sequence[str] = (),
) -> dict[str, Any]:  # fmt: skip
    """Return the coordinates of a run, SI units. bodies, contacts: their numbers, counted from zero. owner: "chain" if
    the run has several, or "run" for a batch."""
    coordinates: dict[str, Any] = {
        "time": ("time", times, {"units": "s"}),
        "bead": ("bead", np.array(bodies)),
        "contact": ("contact", np.array(contacts) + 1),
        "centre": ([*owner, "bead"], centres, {"units": "m", "long_name": "centre, from the struck end"}),
        "static_force": ([*owner, "contact"], static_force, {"units": "N", "long_name": "preload"}),
    }
    if impact_energy is not None:
        coordinates["impact_energy"] = owner, impact_energy, {"units": "J", "long_name": "energy of the excitation"}
    return coordinates


def variable(name: str, values: Any, *owner: str) -> tuple[list[str], Any, dict[str, str]]:
    """Return the dimensions, values and attributes of a variable. owner: the dimension of several owners, if any."""
    units, description, _, bodies = VARIABLES[name]
    return ["time", *owner, *bodies], values, {"units": units, "long_name": description}
