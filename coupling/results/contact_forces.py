"""The forces between chains and structures, read from the Dataset of one run."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from coupling.results.reading import Reading, at_end
from coupling.results.schema import Contact
from structures.structure import Vector

OF_CONTACTS = ("contact_force", "surface_displacement")


class ContactForces(NamedTuple):
    """The K contacts; their forces on the structures (N, time × K), preload included, and their preloads (N, K)."""

    contacts: list[Contact]
    force: Vector
    static: Vector


def contact_forces(run: object) -> ContactForces:
    """Return the K contacts of one run. Raises ValueError for signals, sweeps, and for one chain of several."""
    reading = Reading(run, "the Dataset of a run")
    reading.check_holds(OF_CONTACTS)
    reading.check_one_run(*OF_CONTACTS)
    reading.check_whole("chain")
    force, static = reading.data.contact_force, reading.data.static_force
    return ContactForces(
        reading.contacts,
        np.stack([_of(force, contact) for contact in reading.contacts], axis=-1),
        np.array([_of(static, contact) for contact in reading.contacts]),
    )


def _of(values: xr.DataArray, contact: Contact) -> Vector:
    """Return the values at one contact between a chain and a structure."""
    chain = values.isel(chain=contact.chain) if "chain" in values.dims else values
    return at_end(chain, contact.end)
