"""The modes of a rectangular plate in place of the mesh of each run, for what builds and strikes many such plates.

While a builder runs, whether Python or a case file describes it, modes answer for the plate that it strikes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from coupling.cosimulation import CoSimulation
from plates.contacts import Contact
from plates.modal import ModalPlate, is_modal
from plates.plate import Plate, answered_by
from plates.section import homogeneous_section
from structures.caution import collected
from structures.structure import Structure, half_space

# Hz, of the modes at least. With 40 kHz traces of small thin plates, which hold many echoes, are off by 0.5 %.
FREQUENCY = 60e3

Build = Callable[..., CoSimulation]


@dataclass(frozen=True)
class OnModes:
    """Builds co-simulations on the modes of their plate; slowest: of the plate with the slowest waves, the shortest."""

    slowest: ModalPlate

    def structure(self, plate: Plate, contacts: list[Contact]) -> Structure | None:
        """Return the oscillators of a plate where it is struck; None where they do not serve."""
        if not is_modal(plate) or len(contacts) != 1:
            return None
        modes, known = self.slowest, self.slowest.plate
        if (plate.length, plate.width, plate.supports) != (known.length, known.width, known.supports):
            # Another rectangle has other modes.
            modes = ModalPlate(replace(plate, highest_frequency=known.highest_frequency), modes.until)
        return modes.at(contacts[0].x, contacts[0].y, plate.thickness, plate.section.struck)

    def __call__(self, build: Build, **values: Any) -> CoSimulation:
        with answered_by(self.structure):
            return build(**values)


def modes_of(builds: Sequence[Build], until: float) -> OnModes | None:
    """Return what builds a co-simulation on the modes of its plate, of functions that make and strike such plates; None
    where modes do not serve, as where not one plate is struck at one place. until: of the longest run, s.

    The modes are those of the plate with the slowest waves, so the shortest, between the plate of the first
    co-simulation and those of the others, which differ from it by one quantity each.
    """
    plates = list[Plate]()

    def noted(plate: Plate, contacts: list[Contact]) -> Structure:
        if not is_modal(plate) or len(contacts) != 1:
            raise ValueError("plate: its modes do not serve")
        plates.append(plate)
        return half_space(plate.section.struck)  # it never moves, and needs no mesh

    try:
        with collected(), answered_by(noted):  # the runs repeat what holds for their values
            for build in builds:
                build()
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return None  # it needs the mesh; what else is wrong shows in its own runs
    if len(plates) != len(builds):
        return None
    first, speeds = plates[0], np.array([plate.section.bending[0, 0] / plate.section.mass for plate in plates]) ** 0.5
    slower = float(np.minimum(speeds / speeds[0], 1.0).prod())
    section = homogeneous_section(slower * first.thickness, first.section.struck)
    known = replace(first, section=section, highest_frequency=max(FREQUENCY, first.highest_frequency))
    return OnModes(ModalPlate(known, until))


def on_modes(build: Build, ranges: Mapping[str, tuple[float, float]], until: float) -> Build | None:
    """Return a builder of the same co-simulations on the modes of their plates; None where modes do not serve them."""
    middle = {name: 0.5 * (low + high) for name, (low, high) in ranges.items()}
    changes = [{}, *({name: end} for name, ends in ranges.items() for end in ends)]
    simulation = modes_of([partial(build, **(middle | change)) for change in changes], until)
    return None if simulation is None else partial(simulation, build)
