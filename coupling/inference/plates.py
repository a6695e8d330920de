"""The modes of a rectangular plate in place of the mesh of each run, for what builds and strikes many such plates.

While a builder runs, whether Python or a case file describes it, modes answer for the plate that it strikes.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from coupling.cosimulation import CoSimulation
from plates.contacts import Contact
from plates.modal import ModalPlate, is_modal
from plates.plate import Plate, answered_by
from plates.section import homogeneous_section
from structures.caution import collected
from structures.structure import Structure, half_space

FREQUENCY = 60e3
"""Hz, of the modes at least. With 40 kHz traces of small thin plates, which hold many echoes, are off by 0.5 %."""

Build = Callable[..., CoSimulation]


@dataclass(frozen=True)
class PlateModes:
    """Modes of the plates that one builder makes; slowest: of those with the slowest waves, so the shortest."""

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

    def simulation(self, build: Callable[[], CoSimulation]) -> CoSimulation:
        """Return the co-simulation that a function makes, on the modes of its plate."""
        with answered_by(self.structure):
            return build()


def modes_of(builds: Sequence[Callable[[], CoSimulation]], until: float) -> PlateModes | None:
    """Return the modes for the plate of the first co-simulation and what lies between it and those of the others.

    until: of the longest run, s. Each of the others differs from the first by one quantity. None where modes do not
    serve, as where not one plate is struck at one place.
    """
    plates: list[Plate] = []

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
    highest = max(FREQUENCY, first.highest_frequency)
    return PlateModes(ModalPlate(replace(first, section=section, highest_frequency=highest), until))


def on_modes(build: Build, ranges: Mapping[str, tuple[float, float]], until: float) -> Build | None:
    """Return a builder of the same co-simulations on the modes of their plates; None where modes do not serve them."""
    middle = {name: 0.5 * (low + high) for name, (low, high) in ranges.items()}
    changes = [{}, *({name: end} for name, ends in ranges.items() for end in ends)]
    modes = modes_of([partial(build, **(middle | change)) for change in changes], until)
    return None if modes is None else lambda **values: modes.simulation(partial(build, **values))
