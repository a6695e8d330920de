"""A result is an xarray.Dataset: named dimensions, units, the full input and the versions in its attributes."""

import json
import platform
import re
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import Any

import numpy as np
import xarray as xr

from coupling.interface import LAST, Contact, Interface
from coupling.recording.frames import Frames
from coupling.results.findings import as_attribute
from particles.deformable.chain import MovingDeformableChain
from structures.checks import LONGEST
from structures.structure import Vector

PACKAGES = ("hertzlink", "numpy", "scipy", "numba", "scikit-fem", "xarray")

DESCRIPTIONS = {
    "displacement": (
        "chain",
        "m",
        "displacement from static equilibrium; bead 0 is the striker or the surface behind",
    ),
    "velocity": ("chain", "m/s", "velocity; bead 0 is the striker or the surface behind"),
    "contact_force": ("chain", "N", "force between bead n - 1 and bead n, preload included"),
    "section_force": ("chain", "N", "compressive force through the central section of a deformable bead"),
    "vibration_energy": ("chain", "J", "kinetic and elastic energy of a deformable bead's modes beyond the rigid one"),
    "vibration_amplitude": ("chain", "m √kg", "amplitude of these modes, mass-normalised"),
    "kinetic_energy": ("chain", "J", "kinetic energy of striker and beads"),
    "contact_energy": ("chain", "J", "energy of contacts, gravity, dead load and spring, from the start"),
    "dissipated_energy": ("chain", "J", "energy taken by losses since the start"),
    "excitation_work": ("chain", "J", "work of a force history or a piston since the start"),
    "surface_displacement": ("interface", "m", "displacement of the structure's contact point"),
    "gap": ("interface", "m", "between bead and surface, negative where they indent; NaN where a chain faces nothing"),
    "interface_work": ("interface", "J", "work of the dynamic contact force on the structure, as that felt it"),
    "interface_work_of_chain": ("interface", "J", "the same work, as the chain gave it"),
    "interface_mismatch": ("interface", "J", "work that the chain gave less work that the structure felt"),
    "interface_impulse": ("interface", "N s", "impulse of the dynamic contact force on the structure"),
    "structure_work": ("structure", "J", "work of all dynamic contact forces on the structure since the start"),
    "structure_kinetic_energy": ("structure", "J", "kinetic energy of the structure, NaN where it is not known"),
    "structure_elastic_energy": ("structure", "J", "elastic energy of the structure, NaN where it is not known"),
    "structure_energy": ("structure", "J", "both, in the time stepping's own metric"),
    "structure_dissipated_energy": ("structure", "J", "energy taken by the structure's damping since the start"),
    "structure_numerical_loss": ("structure", "J", "work less energy and damping: what the time stepping lost"),
    "evaluations": ("", "1", "chain windows tried since the last saved time"),
    "substeps": ("", "1", "substeps since the last saved time; more than usual where a window was halved"),
    "residual": ("", "N", "greatest disagreement on a mean force since the last saved time"),
}
"""What each variable belongs to, its unit, and what it is. Dimensions "chain", "interface" and "structure" are there
where a run has several of them; what tells of deformable beads is there where it has such."""

BODIES = {
    "displacement": ["bead"],
    "velocity": ["bead"],
    "contact_force": ["contact"],
    "section_force": ["bead"],
    "vibration_energy": ["bead"],
    "vibration_amplitude": ["bead", "mode"],
}
"""Dimensions of what a chain has several of."""

ADDRESS = re.compile(" at 0x[0-9a-fA-F]+")


def dataset(
    interface: Interface, frames: Frames, interval: float, given: Mapping[str, Any], findings: Sequence[str] = ()
) -> xr.Dataset:
    """The Dataset of one run. Chains shorter than the longest are filled up with NaN.

    given: the run's input; findings: what to know of it, a line of the attribute `warnings` each.
    """
    chains = [_of_chain(interface, frames, number) for number in range(len(interface.chains))]
    known = dict.fromkeys(name for chain in chains for name in chain)
    values: dict[str, Any] = {name: [chain.get(name) for chain in chains] for name in known}
    values |= _of_both_sides(interface, frames)
    values["gap"] = [_gap(interface, frames, k) for k in range(interface.size)]
    bodies = max(chain.mass.size for chain in interface.chains)
    variables = {}
    for name, (owner, _, _) in DESCRIPTIONS.items():
        if name not in values:
            continue
        many = values[name] if owner else [values[name]]
        if len(many) == 1:
            variables[name] = variable(name, many[0])
        else:
            variables[name] = variable(name, np.stack(_filled(many, bodies if name in BODIES else 0), axis=1), owner)
    coordinates = _coordinates(interface, interval * np.arange(frames.rows), bodies)
    return xr.Dataset(variables, coordinates, provenance(given) | as_attribute(findings))


def variable(name: str, values: Any, *owner: str) -> tuple[list[str], Any, dict[str, str]]:
    """Dimensions, values and attributes of a variable; owner: what it has several of."""
    _, units, text = DESCRIPTIONS[name]
    return ["time", *owner, *BODIES.get(name, [])], values, {"units": units, "long_name": text}


def _of_chain(interface: Interface, frames: Frames, number: int) -> dict[str, Vector]:
    """What belongs to one chain; contact energy with the work of the static forces on the surfaces."""
    chain, own = interface.chains[number], frames.chains[number]
    bodies = chain.mass.size
    potential = own.potential.copy()
    for k in interface.of_chain[number]:
        potential += interface.static[k] * frames.surface[k]
    deformed = {}
    if isinstance(chain, MovingDeformableChain):
        deformed = {
            "section_force": chain.section_force(own.contact_force, own.position),
            "vibration_energy": chain.vibration_energy(own.position, own.velocity),
            "vibration_amplitude": own.position[:, bodies:].reshape(frames.rows, bodies, -1),
        }
    return {
        **deformed,
        "displacement": (own.position - chain.rest)[:, :bodies],
        "velocity": own.velocity[:, :bodies],
        "contact_force": own.contact_force,
        "kinetic_energy": own.kinetic,
        "contact_energy": potential - potential[0],
        "dissipated_energy": own.lost,
        "excitation_work": own.driven,
    }


def _gap(interface: Interface, frames: Frames, k: int) -> Vector:
    """Of one contact, at each saved time."""
    contact = interface.contacts[k]
    chain = interface.chains[contact.chain]
    struck, far = chain.poles(frames.chains[contact.chain].position)
    if contact.end != LAST:
        return np.asarray(struck[:, 1] - far[:, 0])
    return np.asarray(frames.surface[k] - far[:, -1]) if chain.surface is not None else np.full(frames.rows, np.nan)


def _of_both_sides(interface: Interface, frames: Frames) -> dict[str, Vector]:
    """What belongs to contacts, structures and the run: contacts or structures × saved times."""
    energy = frames.kinetic + frames.elastic
    work = np.stack([frames.work[interface.touched_by(place)].sum(axis=0) for place in range(len(energy))])
    return {
        "surface_displacement": frames.surface,
        "interface_work": frames.work,
        "interface_work_of_chain": frames.given,
        "interface_mismatch": frames.given - frames.work,
        "interface_impulse": frames.impulse,
        "structure_work": work,
        "structure_kinetic_energy": frames.kinetic,
        "structure_elastic_energy": frames.elastic,
        "structure_energy": energy,
        "structure_dissipated_energy": frames.damped,
        "structure_numerical_loss": work - energy - frames.damped,
        "evaluations": frames.evaluations,
        "substeps": frames.substeps,
        "residual": frames.residual,
    }


def _filled(arrays: Sequence[Vector | None], bodies: int) -> list[Vector]:
    """Arrays of one shape, with NaN for what a chain has not: bodies of a longer one, modes."""
    shape = np.max([array.shape for array in arrays if array is not None], axis=0)
    if bodies:
        shape[1] = bodies
    filled = []
    for array in arrays:
        part = np.full(shape, np.nan)
        if array is not None:
            part[tuple(map(slice, array.shape))] = array
        filled.append(part)
    return filled


def _coordinates(interface: Interface, times: Any, bodies: int) -> dict[str, Any]:
    chains = interface.chains
    several = ["chain"] if len(chains) > 1 else []

    def joined(arrays: list[Vector]) -> Vector:
        filled = [np.pad(one, (0, bodies - one.size), constant_values=np.nan) for one in arrays]
        return np.stack(filled) if several else filled[0]

    energy = np.array([chain.chain.impact_energy for chain in chains])
    coordinates: dict[str, Any] = {
        "time": ("time", times, {"units": "s"}),
        "bead": ("bead", np.arange(bodies)),
        "contact": ("contact", np.arange(1, bodies + 1)),
        "centre": (
            [*several, "bead"],
            joined([chain.chain.centres for chain in chains]),
            {"units": "m", "long_name": "centre, from the struck end"},
        ),
        "impact_energy": (
            several,
            energy if several else float(energy[0]),
            {"units": "J", "long_name": "energy of the excitation"},
        ),
        "static_force": (
            [*several, "contact"],
            joined([chain.static_force for chain in chains]),
            {"units": "N", "long_name": "preload"},
        ),
    }
    if several:
        coordinates["chain"] = ("chain", np.arange(len(chains)))
    if interface.size > 1:
        coordinates["interface"] = ("interface", np.arange(interface.size))
    for name in () if interface.single else Contact._fields:
        told = [getattr(contact, name) for contact in interface.contacts]
        words = ["last bead" if end == LAST else "first bead" for end in told] if name == "end" else told
        coordinates[f"interface_{name}"] = ("interface", words) if interface.size > 1 else words[0]
    if len(interface.structures) > 1:
        coordinates["structure"] = ("structure", np.arange(len(interface.structures)))
    return coordinates


def summary(run: xr.Dataset) -> str:
    """A run in one line: substeps, chain windows tried, and what the ledger says."""
    substeps, tried = int(run.substeps.sum()), int(run.evaluations.sum())
    energy = float(run.impact_energy.sum())
    mismatch = float(abs(run.interface_mismatch).max()) / energy
    return (
        f"{float(run.time[-1]):.6g} s in {substeps} substeps, {tried / max(substeps, 1):.3g} chain windows each, "
        f"residual {float(run.residual.max()):.2g} N at most; of the impact energy: interface mismatch {mismatch:.1e}, "
        f"into structures {float(run.interface_work.isel(time=-1).sum()) / energy:.3g}, "
        f"lost in chains {float(run.dissipated_energy.isel(time=-1).sum()) / energy:.3g}"
    )


def provenance(given: Mapping[str, Any]) -> dict[str, str]:
    """Input and versions as text, for the attributes of a Dataset."""
    return {"input": as_text(given), "versions": _versions()}


def as_text(given: Mapping[str, Any]) -> str:
    """Input as JSON, the same in every process: what is no plain data by its repr, without addresses."""
    text = json.dumps(given, default=lambda value: ADDRESS.sub("", repr(value)), ensure_ascii=False)
    if "NaN" not in text and "Infinity" not in text:
        return text
    # JSON knows neither: they become text.
    return json.dumps(json.loads(text, parse_constant=str), ensure_ascii=False, allow_nan=False)


def differences(theirs: Any, mine: Any, name: str = "") -> Iterator[str]:
    """In words, where two pieces of plain data differ."""
    if isinstance(theirs, dict) and isinstance(mine, dict):
        for key in dict.fromkeys([*theirs, *mine]):
            yield from differences(theirs.get(key), mine.get(key), f"{name}.{key}" if name else key)
    elif isinstance(theirs, list) and isinstance(mine, list) and len(theirs) == len(mine):
        for number, pair in enumerate(zip(theirs, mine, strict=True)):
            yield from differences(*pair, f"{name}[{number}]")
    elif theirs != mine:
        short = len(f"{theirs}{mine}") <= LONGEST
        yield f"{name} = {theirs!r} there and {mine!r} here" if short else f"{name} differ"


@cache
def _versions() -> str:
    """Read once: the packages' metadata takes longer than many a run."""
    return json.dumps(versions())


def versions() -> dict[str, str]:
    """Versions of Python, hertzlink and what its numbers depend on."""
    found = {"python": platform.python_version()}
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "not installed"
    return found
