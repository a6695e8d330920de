"""The Dataset of a run: named dimensions, units, and the full input and the versions in its attributes."""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import xarray as xr

from coupling.interface import Interface
from coupling.recording.frames import Frames
from coupling.results.findings import as_attribute
from coupling.results.provenance import provenance
from coupling.results.schema import END_NAMES, LAST, VARIABLES, Contact, run_coordinates, variable
from particles.deformable.deformable_chain import MovingDeformableChain
from structures.structure import Vector


def dataset(
    interface: Interface, frames: Frames, interval: float, inputs: Mapping[str, Any], findings: Sequence[str] = ()
) -> xr.Dataset:
    """Return the Dataset of one run, with views of its frames. Shorter chains are padded with NaN; see `reading`.
    inputs: the input of the run. findings: the lines of the attribute `warnings`."""
    chains, selection = interface.chains, frames.kept
    bodies, size = [*range(max(chain.mass.size for chain in chains))], len(chains)
    contacts = bodies
    if selection is None:
        of_chains = [_of_chain(interface, frames, number) for number in range(size)]
        values: dict[str, Any] = _of_both_sides(interface, frames)
        more: dict[str, Any] = {}
    else:
        contacts, bodies = selection
        of_chains = [{"contact_force": part.force[:, contacts], "velocity": part.velocity} for part in frames.chains]
        beads = [len(chain.chain.beads) for chain in chains]
        values, more = {}, {"beads": beads if size > 1 else beads[0]}
    for name in dict.fromkeys(name for of_chain in of_chains for name in of_chain):
        arrays = [of_chain.get(name) for of_chain in of_chains]
        long = len(bodies) if selection is None and VARIABLES[name].bodies else 0
        values[name] = arrays[0] if size == 1 else np.stack(_filled(arrays, long), axis=1)
    values = {name: values[name] for name in VARIABLES if name in values}

    layout = tuple((name, array.shape) for name, array in values.items())
    ends = () if interface.single else tuple(interface.contacts)
    run = _empty(interval, frames.rows, tuple(bodies), tuple(contacts), size, len(interface.structures), ends, layout)
    run = run.copy(data=values)
    centre, static_force = ([chain.chain.centres for chain in chains], [chain.static_force for chain in chains])
    energies = [chain.chain.impact_energy for chain in chains]
    for name, many, places in (("centre", centre, bodies), ("static_force", static_force, contacts)):
        along = many[0] if size == 1 else np.stack(_filled([one[None] for one in many], 0), axis=1)[0]
        run.variables[name].data = along[..., places]
    run.variables["impact_energy"].data = energies[0] if size == 1 else np.array(energies)
    if any(chain.yielding for chain in chains):
        more["yielding"] = 1
    run.attrs = provenance(inputs) | as_attribute(findings) | more
    return run


@lru_cache(maxsize=16)
def _empty(
    interval: float,
    rows: int,
    bodies: tuple[int, ...],
    contacts: tuple[int, ...],
    chains: int,
    structures: int,
    ends: tuple[Contact, ...],
    layout: tuple[tuple[str, tuple[int, ...]], ...],
) -> xr.Dataset:
    """Return a Dataset without numbers, of which results with the same names and shapes are copies: xarray's checks of
    names and shapes take as long as a run, and a copy takes a quarter of this time. layout: the variables and their
    shapes. ends: the contacts with structures; empty for a single contact."""
    several = ["chain"] if chains > 1 else []
    size = (chains,) if several else ()
    centres, forces, energy = np.zeros((*size, len(bodies))), np.zeros((*size, len(contacts))), np.zeros(size)
    coordinates = run_coordinates(interval * np.arange(rows), bodies, contacts, centres, forces, energy, several)
    if several:
        coordinates["chain"] = ("chain", np.arange(chains))
    if len(ends) > 1:
        coordinates["interface"] = ("interface", np.arange(len(ends)))
    for name in Contact._fields if ends else ():
        numbers = [getattr(contact, name) for contact in ends]
        words = [END_NAMES[end] for end in numbers] if name == "end" else numbers
        coordinates[f"interface_{name}"] = ("interface", words) if len(ends) > 1 else words[0]
    if structures > 1:
        coordinates["structure"] = ("structure", np.arange(structures))
    variables = {}
    for name, shape in layout:
        schema = VARIABLES[name]
        owner = [schema.owner] if len(shape) > 1 + len(schema.bodies) else []
        variables[name] = variable(name, np.broadcast_to(np.nan, shape), *owner)
    return xr.Dataset(variables, coordinates)


def _of_chain(interface: Interface, frames: Frames, number: int) -> dict[str, Vector]:
    """Return the variables of one chain. The contact energy includes the work of static forces on the surfaces."""
    chain, of_chain = interface.chains[number], frames.chains[number]
    bodies, energy = chain.mass.size, of_chain.energy
    potential = energy["potential"].copy()
    for k in interface.of_chain[number]:
        potential += interface.static[k] * frames.saved.work["surface"][k]
    deformed = {}
    if isinstance(chain, MovingDeformableChain):
        deformed = {
            "section_force": chain.section_force(of_chain.force, of_chain.position, of_chain.velocity),
            "vibration_energy": chain.vibration_energy(of_chain.position, of_chain.velocity),
            "vibration_amplitude": chain.amplitudes(of_chain.position),
        }
    if chain.yielding is not None:
        deformed = {"dent": of_chain.position[:, 3 * bodies :]}  # the memory of the contacts ends with their dents
    return {
        **deformed,
        "displacement": of_chain.position[:, :bodies] - chain.rest[:bodies],
        "velocity": of_chain.velocity[:, :bodies],
        "contact_force": of_chain.force,
        "kinetic_energy": energy["kinetic"],
        "contact_energy": potential - potential[0],
        "dissipated_energy": energy["lost"],
        "excitation_work": energy["driven"],
    }


def _of_both_sides(interface: Interface, frames: Frames) -> dict[str, Vector]:
    """Return the variables of the contacts, the structures and the run, over saved times."""
    contact, structure, time = frames.saved.work, frames.saved.structure, frames.saved.time
    gaps = np.full((interface.size, frames.rows), np.nan)
    for k, (number, end, *_) in enumerate(interface.contacts):
        chain = interface.chains[number]
        struck, far = chain.poles(frames.chains[number].position)
        if end != LAST:
            gaps[k] = struck[:, 1] - far[:, 0]
        elif chain.surface is not None:
            gaps[k] = contact["surface"][k] - far[:, -1]
    energy = structure["kinetic"] + structure["elastic"]
    work = np.stack([contact["work"][places].sum(axis=0) for places in interface.touching])
    of_contacts = {
        "surface_displacement": contact["surface"],
        "gap": gaps,
        "interface_work": contact["work"],
        "interface_work_of_chain": contact["given"],
        "interface_mismatch": contact["given"] - contact["work"],
        "interface_impulse": contact["impulse"],
    }
    of_structures = {
        "structure_work": work,
        "structure_kinetic_energy": structure["kinetic"],
        "structure_elastic_energy": structure["elastic"],
        "structure_energy": energy,
        "structure_dissipated_energy": structure["taken"],
        "structure_numerical_loss": work - energy - structure["taken"],
    }
    both = {**of_contacts, **of_structures}
    return {name: many[0] if len(many) == 1 else many.T for name, many in both.items()} | {
        name: time[name] for name in time.dtype.names or ()
    }


def _filled(arrays: Sequence[Vector | None], bodies: int) -> list[Vector]:
    """Return arrays of equal shape: NaN stands for bodies and modes that a chain does not have."""
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
