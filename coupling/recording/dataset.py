"""A result is an xarray.Dataset: named dimensions, units, the full input and the versions in its attributes."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from coupling.interface import Interface
from coupling.participant import CheckedParticipant
from coupling.recording.frames import Frames
from coupling.results.findings import as_attribute
from coupling.results.provenance import as_text, provenance
from coupling.results.schema import END_NAMES, LAST, VARIABLES, Contact, run_coordinates, variable
from particles.deformable.deformable_chain import MovingDeformableChain
from structures.structure import Vector


def dataset(
    interface: Interface,
    frames: Frames,
    interval: float,
    inputs: Mapping[str, Any],
    findings: Sequence[str] = (),
) -> xr.Dataset:
    """Return the Dataset of one run. Shorter chains are padded with NaN, see `reading`.

    inputs: the run's input; findings: what to know of it, a line of the attribute `warnings` each.
    """
    selection = frames.kept
    bodies = max(chain.mass.size for chain in interface.chains)
    coordinates = _coordinates(interface, interval * np.arange(frames.rows), bodies)
    values: dict[str, Any] = {}
    if selection is None:
        chains = [_of_chain(interface, frames, number) for number in range(len(interface.chains))]
        values |= _of_both_sides(interface, frames)
        values["gap"] = [_gap(interface, frames, k) for k in range(interface.size)]
        more: dict[str, Any] = _of_participants(interface, frames, interval)
    else:
        contacts, sensors = map(len, selection)
        parts = frames.chains
        chains = [{"contact_force": part.force[:, :contacts], "velocity": part.velocity[:, :sensors]} for part in parts]
        places = {"contact": selection.contacts, "bead": selection.bodies}
        coordinates = {name: _at(places, value) for name, value in coordinates.items()}
        beads = [len(chain.chain.beads) for chain in interface.chains]
        more = {"beads": beads if len(beads) > 1 else beads[0]}
    for name in dict.fromkeys(name for chain in chains for name in chain):
        values[name] = [chain.get(name) for chain in chains]
    variables = {}
    for name, schema in VARIABLES.items():
        if name not in values:
            continue
        many = values[name] if schema.owner else [values[name]]
        if len(many) == 1:
            variables[name] = variable(name, many[0])
        else:
            filled = _filled(many, bodies * (selection is None and bool(schema.bodies)))
            variables[name] = variable(name, np.stack(filled, axis=1), schema.owner)
    return xr.Dataset(variables, coordinates, provenance(inputs) | as_attribute(findings) | more)


def _at(places: Mapping[str, list[int]], coordinate: Any) -> Any:
    """Return a coordinate at some places along its last dimension, if that is a dimension of these."""
    if not isinstance(coordinate, tuple) or not coordinate[0]:
        return coordinate
    dims, values, *attributes = coordinate
    last = dims if isinstance(dims, str) else dims[-1]
    return (dims, values[..., places[last]], *attributes) if last in places else coordinate


def _of_participants(interface: Interface, frames: Frames, interval: float) -> dict[str, str]:
    """Return how a user's participants moved: the inertia of each contact point from rest, and its mean compliance."""
    participants = []
    for place, body in enumerate(interface.structures):
        if not isinstance(body, CheckedParticipant) or not body.inertias:
            continue
        points = interface.touching[place]
        impulse = frames.ledger.contact["impulse"][points][:, -1]
        moved = frames.ledger.contact["surface"][points].mean(axis=1) * interval * (frames.rows - 1)
        compliance = np.divide(moved, impulse, out=np.full(impulse.size, np.nan), where=impulse != 0.0)
        participants.append({"name": body.name, "inertia (kg)": body.inertias, "compliance (m/N)": compliance.tolist()})
    return {"participants": as_text({"participants": participants})} if participants else {}


def _of_chain(interface: Interface, frames: Frames, number: int) -> dict[str, Vector]:
    """Return what belongs to one chain; contact energy with the work of the static forces on the surfaces."""
    chain, of_chain = interface.chains[number], frames.chains[number]
    bodies = chain.mass.size
    energy = {name: of_chain.energy[name].copy() for name in of_chain.energy.dtype.names or ()}
    potential = energy["potential"]
    for k in interface.of_chain[number]:
        potential += interface.static[k] * frames.ledger.contact["surface"][k]
    deformed = {}
    if isinstance(chain, MovingDeformableChain):
        deformed = {
            "section_force": chain.section_force(of_chain.force, of_chain.position, of_chain.velocity),
            "vibration_energy": chain.vibration_energy(of_chain.position, of_chain.velocity),
            "vibration_amplitude": chain.amplitudes(of_chain.position),
        }
    if chain.yielding is not None:
        deformed = {"dent": chain.dents(of_chain.position)}
    return {
        **deformed,
        "displacement": (of_chain.position - chain.rest)[:, :bodies],
        "velocity": of_chain.velocity[:, :bodies],
        "contact_force": of_chain.force,
        "kinetic_energy": energy["kinetic"],
        "contact_energy": potential - potential[0],
        "dissipated_energy": energy["lost"],
        "excitation_work": energy["driven"],
    }


def _gap(interface: Interface, frames: Frames, k: int) -> Vector:
    """Return the gap of one contact, at each saved time."""
    contact = interface.contacts[k]
    chain = interface.chains[contact.chain]
    struck, far = chain.poles(frames.chains[contact.chain].position)
    if contact.end != LAST:
        return np.asarray(struck[:, 1] - far[:, 0])
    return (
        np.asarray(frames.ledger.contact["surface"][k] - far[:, -1])
        if chain.surface is not None
        else np.full(frames.rows, np.nan)
    )


def _of_both_sides(interface: Interface, frames: Frames) -> dict[str, Vector]:
    """Return what belongs to contacts, structures and the run: contacts or structures × saved times."""
    contact, structure = (
        {name: records[name].copy() for name in records.dtype.names or ()}
        for records in (frames.ledger.contact, frames.ledger.structure)
    )
    energy, given_work = structure["kinetic"] + structure["elastic"], contact["given"]
    work = np.stack([contact["work"][interface.touching[place]].sum(axis=0) for place in range(len(energy))])
    return {
        "surface_displacement": contact["surface"],
        "interface_work": contact["work"],
        "interface_work_of_chain": given_work,
        "interface_mismatch": given_work - contact["work"],
        "interface_impulse": contact["impulse"],
        "structure_work": work,
        "structure_kinetic_energy": structure["kinetic"],
        "structure_elastic_energy": structure["elastic"],
        "structure_energy": energy,
        "structure_dissipated_energy": structure["taken"],
        "structure_numerical_loss": work - energy - structure["taken"],
        **{name: frames.ledger.time[name].copy() for name in frames.ledger.time.dtype.names or ()},
    }


def _filled(arrays: Sequence[Vector | None], bodies: int) -> list[Vector]:
    """Return the arrays of one shape: NaN replaces the bodies and modes that a chain does not have."""
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
        filled = [np.pad(array, (0, bodies - array.size), constant_values=np.nan) for array in arrays]
        return np.stack(filled) if several else filled[0]

    energy = np.array([chain.chain.impact_energy for chain in chains])
    centres, forces = joined([chain.chain.centres for chain in chains]), joined([c.static_force for c in chains])
    coordinates = run_coordinates(times, bodies, centres, forces, energy if several else float(energy[0]), several)
    if several:
        coordinates["chain"] = ("chain", np.arange(len(chains)))
    if interface.size > 1:
        coordinates["interface"] = ("interface", np.arange(interface.size))
    for name in () if interface.single else Contact._fields:
        numbers = [getattr(contact, name) for contact in interface.contacts]
        words = [END_NAMES[end] for end in numbers] if name == "end" else numbers
        coordinates[f"interface_{name}"] = ("interface", words) if interface.size > 1 else words[0]
    if len(interface.structures) > 1:
        coordinates["structure"] = ("structure", np.arange(len(interface.structures)))
    return coordinates


def summary(run: xr.Dataset) -> str:
    """Return a run in one line: substeps, chain windows tried, and what the ledger says."""
    if "substeps" not in run:
        return f"{float(run.time[-1]):.6g} s, sensors {', '.join(map(str, run.bead.values))} kept"
    substeps, tried = int(run.substeps.sum()), int(run.evaluations.sum())
    energy = float(run.impact_energy.sum())
    mismatch = float(abs(run.interface_mismatch).max()) / energy
    return (
        f"{float(run.time[-1]):.6g} s in {substeps} substeps, {tried / max(substeps, 1):.3g} chain windows each, "
        f"residual {float(run.residual.max()):.2g} N at most; of the impact energy: interface mismatch {mismatch:.1e}, "
        f"into structures {float(run.interface_work.isel(time=-1).sum()) / energy:.3g}, "
        f"lost in chains {float(run.dissipated_energy.isel(time=-1).sum()) / energy:.3g}"
    )
