"""What a run checks of itself: each finding is a line of the result's `warnings`, and a warning to the user."""

import numpy as np

from coupling.findings import warn
from coupling.frames import Frames
from coupling.interface import Interface
from structures.structure import Vector

LARGE = 0.01
"""Part of the impact energy that an exchange may make or lose without a warning."""


def checked(interface: Interface, frames: Frames) -> list[str]:
    """The findings of all checks after a run; the user is warned of each.

    What a contact law cautions of was a warning when the law was made, and is a finding only.
    """
    laws, findings = _of_laws(interface, frames)
    findings += _of_mismatch(interface, frames)
    warn(findings)
    return laws + findings


def _of_laws(interface: Interface, frames: Frames) -> tuple[list[str], list[str]]:
    """The contact laws' own cautions, and contacts that were deeper than their law is trusted."""
    own, beyond = list[str](), list[str]()
    for number, chain in enumerate(interface.chains):
        known, deep = chain.cautions(_deepest(interface, frames, number))
        own += known
        beyond += deep
    return own, beyond


def _deepest(interface: Interface, frames: Frames, number: int) -> Vector:
    """The greatest approach of each contact of a chain, m."""
    chain, own, seat = interface.chains[number], frames.chains[number], interface.of_chain[number][0]
    place = np.column_stack([own.position[:, : chain.mass.size], frames.surface[seat]])
    deepest: Vector = (place[:, :-1] - place[:, 1:]).max(axis=0)
    # The last one's without the spring behind it.
    deepest[-1] -= chain.flexibility * own.contact_force[:, -1].max()
    return deepest


def _of_mismatch(interface: Interface, frames: Frames) -> list[str]:
    """Where the exchange made or lost energy that is not small."""
    worst = float(abs((frames.given - frames.work).sum(axis=0)).max()) / interface.impact_energy
    if not worst > LARGE:
        return []
    return [
        f"energy: the exchange made or lost {100.0 * worst:.2g} % of the impact energy, see interface_mismatch; take "
        "shorter windows, or a scheme that iterates"
    ]
