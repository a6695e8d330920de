"""The modes of a rectangular plate instead of a mesh for each run, for searches that strike many such plates.

While a builder runs, in Python or from a case file, modes replace the mesh of the plate that it strikes.
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

# Least upper frequency of the modes, Hz. With 40 kHz, traces of small thin plates, with many echoes, are off by 0.5 %.
FREQUENCY = 60e3

Build = Callable[..., CoSimulation]


@dataclass(frozen=True)
class OnModes:
    """A builder of co-simulations on the modes of their plates. slowest: the plate with the slowest, shortest waves."""

    slowest: ModalPlate

    def structure(self, plate: Plate, contacts: list[Contact]) -> Structure | None:
        """Return the oscillators of a plate at its contact, or None for a plate that needs its mesh."""
        if not is_modal(plate) or len(contacts) != 1:
            return None
        modes, known = self.slowest, self.slowest.plate
        if (plate.length, plate.width, plate.supports) != (known.length, known.width, known.supports):
            # Another rectangle has other modes.
            modes = ModalPlate(replace(plate, highest_frequency=known.highest_frequency), modes.until)
        return modes.at(contacts[0].x, contacts[0].y, plate.thickness, plate.section.struck)

    def builder(self, build: Build) -> Build:
        """Return a builder of the same co-simulations on these modes, with the same units of its arguments."""
        on_modes = partial(self, build)
        vars(on_modes)["units"] = getattr(build, "units", {})
        return on_modes

    def __call__(self, build: Build, **values: Any) -> CoSimulation:
        with answered_by(self.structure):
            return build(**values)


def modes_of(builds: Sequence[Build], until: float) -> OnModes | None:
    """Return a builder on the modes of the plates that these functions strike, or None if a function needs the mesh,
    for example because it strikes two plates, or a plate at two places. until: length of the longest run, s. The modes
    are those of a plate whose waves are as slow, and so as short, as any that the functions span. Each function differs
    from the first by one quantity."""
    plates = list[Plate]()

    def noted(plate: Plate, contacts: list[Contact]) -> Structure:
        if not is_modal(plate) or len(contacts) != 1:
            raise ValueError("plate: needs its mesh")
        plates.append(plate)
        return half_space(plate.section.struck)  # it never moves, and needs no mesh

    try:
        with collected(), answered_by(noted):  # the runs will repeat the warnings for their own values
            for build in builds:
                build()
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return None  # a plate needs the mesh; other errors will show in the runs
    if len(plates) != len(builds):
        return None
    first, speeds = plates[0], np.array([plate.section.bending[0, 0] / plate.section.mass for plate in plates]) ** 0.5
    slower = float(np.minimum(speeds / speeds[0], 1.0).prod())
    section = homogeneous_section(slower * first.thickness, first.section.struck)
    known = replace(first, section=section, highest_frequency=max(FREQUENCY, first.highest_frequency))
    return OnModes(ModalPlate(known, until))


def on_modes(build: Build, ranges: Mapping[str, tuple[float, float]], until: float) -> Build | None:
    """Return a builder of the same co-simulations on the modes of their plates, or None if they need the mesh."""
    middle = {name: 0.5 * (low + high) for name, (low, high) in ranges.items()}
    changes = [{}, *({name: end} for name, ends in ranges.items() for end in ends)]
    simulation = modes_of([partial(build, **(middle | change)) for change in changes], until)
    return None if simulation is None else simulation.builder(build)
