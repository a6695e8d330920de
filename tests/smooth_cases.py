"""A rod, a layered rod and a plate with few and bounded frequencies, on which windows show their order.

Chain, length of the run and sensor are those of the hard cases.
"""

from functools import cache

import numpy as np
import xarray as xr
from hard_cases import chain
from monolithic import Contact, monolithic
from scipy.linalg import eigh

import hertzlink as hl

UNTIL = 8e-4
INTERVAL = 2e-6
"""s, between saved times: a whole number of all windows."""

HIGHEST_FREQUENCY = 1e5
"""Hz, of the plate's modes."""

LAYERS = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
SUPPORTS = hl.Supports("clamped", "clamped", "free", "free")
PLATE = hl.kirchhoff_plate(0.1, 0.1, 2.29e-3, hl.ALUMINIUM_6061, SUPPORTS, cells=(8, 8))


def bounded(structure: hl.Structure) -> hl.Structure:
    """The structure in its modes below HIGHEST_FREQUENCY."""
    square, modes = eigh(structure.stiffness.toarray(), structure.mass.toarray())
    slow = square < (2.0 * np.pi * HIGHEST_FREQUENCY) ** 2
    contact = modes[:, slow].T @ structure.contact
    return hl.Structure(np.eye(slow.sum()), np.diag(square[slow]), None, contact, 0.0, structure.surface)


STRUCTURES = {
    "rod": hl.rod([hl.Layer(hl.ACRYLIC, 0.0762, 0.0191)], elements=8),
    "layered rod": hl.rod(LAYERS, elements=4),
    "plate": bounded(PLATE.at(0.04, 0.05)),
}


@cache
def reference(name: str) -> xr.Dataset:
    """The monolithic run against one of STRUCTURES, every INTERVAL."""
    times = np.linspace(0.0, UNTIL, round(UNTIL / INTERVAL) + 1)
    return monolithic([chain()], [STRUCTURES[name]], [Contact(0, "last", 0)], times, 1e-11)[0]
