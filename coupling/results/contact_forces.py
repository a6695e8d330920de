"""The contacts between chains and structures, read back from the Dataset of a run."""

from typing import NamedTuple

import numpy as np
import xarray as xr

from coupling.results.schema import LAST, Contact
from structures.checks import instance
from structures.structure import Vector

OF_CONTACTS = ("contact_force", "surface_displacement")


class ContactForces(NamedTuple):
    """The K contacts; their forces on the structures (N, time × K), preload included, and their preloads (N, K)."""

    contacts: list[Contact]
    force: Vector
    static: Vector


def contact_forces(given: object) -> ContactForces:
    """Of one run. Raises ValueError for signals, sweeps, and for one chain of several."""
    run = instance("run", given, xr.Dataset, "the Dataset of a run")
    if not set(OF_CONTACTS) <= set(run.data_vars):
        raise ValueError(f"run: holds no {' and '.join(OF_CONTACTS)}; must be the Dataset of a run")
    known = {"time", "contact", "chain", "interface"}
    for name in OF_CONTACTS:
        if axes := [str(axis) for axis in run[name].dims if axis not in known]:
            raise ValueError(f"run: has the axes {', '.join(axes)}; choose one run with run.isel({axes[0]}=0)")
    contacts = _contacts(run)
    check_whole(run, "chain")
    forces = [_of(run.contact_force, contact) for contact in contacts]
    statics = [_of(run.static_force, contact) for contact in contacts]
    return ContactForces(contacts, np.stack(forces, axis=-1), np.array(statics))


def check_whole(run: xr.Dataset, *names: str) -> None:
    """A ValueError where a run of several chains or structures has lost some of them. names: by default both."""
    for name in names or ("chain", "structure"):
        told = f"interface_{name}"
        count = 1 + int(run[told].max()) if told in run.coords else 1
        if name in run.coords and run[name].size < count:
            raise ValueError(
                f"run: holds {run[name].size} of its {count} {name}s; give the whole run, with all of them"
            )


def _contacts(run: xr.Dataset) -> list[Contact]:
    if "interface_chain" not in run.coords:
        return [Contact(0, LAST, 0, 0)]
    told = [np.atleast_1d(run[f"interface_{name}"].values) for name in Contact._fields]
    return [
        Contact(int(chain), LAST if end == "last bead" else 1 - LAST, int(structure), int(point))
        for chain, end, structure, point in zip(*told, strict=True)
    ]


def _of(values: xr.DataArray, contact: Contact) -> Vector:
    """Of all contacts along a chain that one at its end."""
    chain = values.isel(chain=contact.chain) if "chain" in values.dims else values
    if contact.end != LAST:
        return np.asarray(chain.isel(contact=0))
    # Chains shorter than the longest are filled up with NaN.
    return np.asarray(chain.dropna("contact", how="all").isel(contact=-1))
