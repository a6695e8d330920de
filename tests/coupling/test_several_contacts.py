"""Several chains, and several contacts of one chain, against the monolithic reference, symmetries and balances."""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
import xarray as xr
from hard_cases import BEAD
from monolithic import Contact, monolithic
from numpy.typing import NDArray

import hertzlink as hl

SENSOR = 5
CHAIN = hl.Chain([BEAD] * 10, BEAD, 0.31)
QUIET = hl.Chain([BEAD] * 6, striker=None)
SUPPORTS = hl.Supports("clamped", "clamped", "free", "free")
ACRYLIC_ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.03, 0.01)], elements=4)
PTFE_ROD = hl.rod([hl.Layer(hl.PTFE, 0.03, 0.01)], elements=4)
STUD = hl.rod([hl.Layer(hl.ACRYLIC, 0.02, 0.008)], base="contact", elements=4)
BAR = hl.rod([hl.Layer(hl.BRASS_360, 0.02, 0.008)], base="contact", elements=4)
FRAME = hl.Structure(
    np.diag([3.0, 20.0, 5.0]) * BEAD.mass,
    1e7 * np.array([[1.0, -1.0, 0.0], [-1.0, 4.0, -3.0], [0.0, -3.0, 3.0]]),
    None,
    np.array([[-1.0, 0.0], [0.0, 0.0], [0.0, 1.0]]),
    np.zeros(2),
    (hl.Surface(hl.STEEL_440C), hl.Surface(hl.STEEL_440C)),
)
"""Two jaws on a beam in the air: contact 0 faces forwards, contact 1 backwards, and a chain fits in between."""


def plate(x: list[float], y: list[float], face: Any = "front", until: float = 5e-4) -> hl.Structure:
    """Aluminium, 60 × 60 × 1 mm, clamped along two edges, as oscillators."""
    whole = hl.kirchhoff_plate(0.06, 0.06, 1e-3, hl.ALUMINIUM_6061, SUPPORTS, cells=(6, 6))
    return hl.reduce(whole.at(x, y, face=face), until=until)


class System(NamedTuple):
    """What CoSimulation takes, and the same for the reference. measured: a chain and a sensor with a reflection."""

    chain: Any
    facing: Any
    behind: Any
    structures: list[Any]
    contacts: list[Contact]
    until: float
    measured: int = 0

    @property
    def chains(self) -> list[hl.Chain]:
        return self.chain if isinstance(self.chain, list) else [self.chain]

    def run(self, scheme: Any = None, **numbers: Any) -> xr.Dataset:
        simulation = hl.CoSimulation(self.chain, self.facing, scheme, behind=self.behind, **numbers)
        return simulation.run(self.until, save_every=1e-6)


def two_on_a_plate() -> System:
    body = plate([0.02, 0.04], [0.03, 0.03])
    slow = hl.Chain([BEAD] * 10, BEAD, 0.2)
    return System([CHAIN, slow], body, None, [body], [Contact(0, "last", 0, 0), Contact(1, "last", 0, 1)], 5e-4)


def between_rods() -> System:
    """The first bead moves at time zero, and strikes the rod behind when it is thrown back."""
    struck = hl.Chain([BEAD] * 10, striker=None, impact_speed=0.31)
    contacts = [Contact(0, "last", 0), Contact(0, "first", 1)]
    return System(struck, ACRYLIC_ROD, PTFE_ROD, [ACRYLIC_ROD, PTFE_ROD], contacts, 6e-4)


def through_a_plate() -> System:
    """Chain, plate, chain, rod: the second chain stands on the plate's back."""
    body = plate([0.03, 0.03], [0.03, 0.03], ["front", "back"])
    contacts = [Contact(0, "last", 0, 0), Contact(1, "last", 1), Contact(1, "first", 0, 1)]
    facing, behind = [hl.ContactPoint(body, 0), ACRYLIC_ROD], [None, hl.ContactPoint(body, 1)]
    return System([CHAIN, QUIET], facing, behind, [body, ACRYLIC_ROD], contacts, 5e-4)


def between_plates() -> System:
    """A striking chain, a plate, a quiet chain, and a second plate, of unlike bead counts."""
    near, far = plate([0.03, 0.03], [0.03, 0.03], ["front", "back"]), plate([0.02], [0.03])
    contacts = [Contact(0, "last", 0, 0), Contact(1, "last", 1), Contact(1, "first", 0, 1)]
    facing, behind = [hl.ContactPoint(near, 0), far], [None, hl.ContactPoint(near, 1)]
    return System([CHAIN, QUIET], facing, behind, [near, far], contacts, 5e-4)


def stud_between_chains() -> System:
    """A free rod with a chain on either end, the second one's last bead free to leave its wall."""
    facing, behind = [hl.ContactPoint(STUD, 0), BAR_WALL], [None, hl.ContactPoint(STUD, 1)]
    contacts = [Contact(0, "last", 0, 0), Contact(1, "last", 1), Contact(1, "first", 0, 1)]
    return System([CHAIN, QUIET], facing, behind, [STUD, BAR_WALL], contacts, 5e-4)


def in_a_frame() -> System:
    """Both ends of a chain on one structure."""
    struck = hl.Chain([BEAD] * 10, striker=None, impact_speed=0.31)
    contacts = [Contact(0, "last", 0, 1), Contact(0, "first", 0, 0)]
    return System(struck, hl.ContactPoint(FRAME, 1), hl.ContactPoint(FRAME, 0), [FRAME], contacts, 6e-4)


def with_losses() -> System:
    """Dashpots, gravity and preload; two chains of unlike length on a light frame, which chatters between them."""
    loss = hl.LinearDashpot(5.0)
    one = hl.Chain([BEAD] * 10, BEAD, 0.31, gravity=9.81, preload=0.2, dissipation=loss)
    other = hl.Chain([BEAD] * 4, BEAD, 0.2, gravity=9.81, dissipation=loss)
    body = plate([0.02, 0.04], [0.03, 0.03])
    return System([one, other], body, None, [body], [Contact(0, "last", 0, 0), Contact(1, "last", 0, 1)], 5e-4)


BAR_WALL = hl.rod([hl.Layer(hl.BRASS_360, 0.02, 0.008)], elements=4)
SYSTEMS = {
    "two chains on a plate": two_on_a_plate,
    "chain between rods": between_rods,
    "chain, plate, chain, rod": through_a_plate,
    "chain between plates": between_plates,
    "rod between chains": stud_between_chains,
    "both ends on one frame": in_a_frame,
    "losses, gravity, preload": with_losses,
}
