"""Cases in which partitioned couplings fail: very light, soft and stiff structures, and gaps that chatter.

Chains are of 14 beads of 9.52 mm, so that bead 7, the sensor, is more than five from both ends. `REFERENCE` holds their
ratios by the monolithic reference, to the digits to which it settles (see test_monolithic.py).
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
from monolithic import Contact
from numpy.typing import NDArray
from scipy.linalg import eigh

import hertzlink as hl

Numbers = NDArray[np.float64]

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
SENSOR = 7
HIGHEST_FREQUENCY = 1.5e5
"""Hz, of the plate's modes: three times the highest in a contact of 9.5 mm beads."""


class Case(NamedTuple):
    """Chains, structures, the contacts between them, and the length of the run, s."""

    chains: tuple[hl.Chain, ...]
    structures: tuple[Any, ...]
    contacts: tuple[Contact, ...]
    until: float


def chain(impact_speed: float = 0.31) -> hl.Chain:
    """14 steel beads without losses, struck by a fifteenth."""
    return hl.Chain([BEAD] * 14, striker=BEAD, impact_speed=impact_speed)


def oscillator(beads: float, stiffness: float, damping: float | None = None) -> hl.Structure:
    """A mass, in beads, on a spring (N/m), with a dashpot (N s/m)."""
    mass, spring = np.array([[beads * BEAD.mass]]), np.array([[stiffness]])
    dashpot = None if damping is None else np.array([[damping]])
    return hl.Structure(mass, spring, dashpot, np.ones(1), 0.0, hl.Surface(hl.STEEL_440C))


def light() -> Case:
    """Added mass: a hundredth of a bead on a soft spring, which longer windows throw about."""
    return _one(oscillator(1e-2, 3e5), 1.2e-3)


def lighter() -> Case:
    """A thousandth of a bead on a soft spring."""
    return _one(oscillator(1e-3, 3e5), 1.2e-3)


def soft() -> Case:
    """Ten beads on a spring of 1 kN/m, which a wave does not feel: the inertia alone sends it back."""
    return _one(oscillator(10.0, 1e3), 8e-4)


def stiff() -> Case:
    """A tenth of a bead on 100 GN/m, a thousand times stiffer than the contact; its own period is 0.4 µs."""
    return _one(oscillator(0.1, 1e11), 5e-4)


def chattering() -> Case:
    """0.7 beads on 5 MN/m: the tip swings away and back, and the wave goes over in three pushes with gaps between."""
    return _one(oscillator(0.7, 5e6), 8e-4)


def two_chains() -> Case:
    """Two chains, one struck later than the other by its lower speed, on one light plate at two points.

    Aluminium, 60 × 60 × 1 mm, 2.75 beads in all, clamped along two edges: each chain feels the other through it.
    """
    supports = hl.Supports("clamped", "clamped", "free", "free")
    plate = hl.kirchhoff_plate(0.06, 0.06, 1e-3, hl.ALUMINIUM_6061, supports, cells=(6, 6))
    body = plate.at([0.02, 0.04], [0.03, 0.03])
    square, modes = eigh(body.stiffness.toarray(), body.mass.toarray())
    slow = square < (2.0 * np.pi * HIGHEST_FREQUENCY) ** 2
    contact = modes[:, slow].T @ body.contact
    modal = hl.Structure(np.eye(slow.sum()), np.diag(square[slow]), None, contact, 0.0, body.surface)
    return Case((chain(0.31), chain(0.2)), (modal,), (Contact(0, "last", 0, 0), Contact(1, "last", 0, 1)), 1.2e-3)


def _one(structure: hl.Structure, until: float) -> Case:
    return Case((chain(),), (structure,), (Contact(0, "last", 0),), until)


CASES: dict[str, Callable[[], Case]] = {
    "light": light,
    "lighter": lighter,
    "soft": soft,
    "stiff": stiff,
    "chattering": chattering,
    "two chains": two_chains,
}

REFERENCE = {
    "light": (0.8767226,),
    "lighter": (0.8715607,),
    "soft": (0.7083072,),
    "stiff": (0.9858116,),
    "chattering": (0.7795188,),
    "two chains": (0.2793548, 0.7641386),
}
"""Amplitude ratios at the sensor, of each chain, sampled every 0.25 µs."""

RETURNED = {
    "light": 7.5e-4,
    "lighter": 7.5e-4,
    "soft": 4.5e-4,
    "stiff": 4.5e-4,
    "chattering": 5.5e-4,
    "two chains": 9.5e-4,
}
"""When the primary waves have passed the sensors on their way back, s; nothing later changes these ratios."""
