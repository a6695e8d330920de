"""The modes of a rectangular plate in place of the mesh of each run, for what builds and strikes many such plates.

A builder is called without a mesh (`unmeshed`), so that `ModalPlate` can take the place of the plate that it makes,
whether Python or a case file describes the plate.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from coupling.cosimulation import CoSimulation
from plates.modal import ModalPlate, is_modal
from plates.plate import Plate
from plates.section import homogeneous_section
from structures.caution import collected
from structures.structure import Structure
from structures.unmeshed import Unmeshed, unmeshed

FREQUENCY = 60e3
"""Hz, of the modes at least. With 40 kHz traces of small thin plates, which hold many echoes, are off by 0.5 %."""

Build = Callable[..., CoSimulation]


class Struck(NamedTuple):
    """A co-simulation on a plate that has no mesh, and where the plate is struck."""

    simulation: CoSimulation
    plate: Plate
    place: tuple[float, float]


@dataclass(frozen=True)
class PlateModes:
    """Modes of the plates that one builder makes; slowest: of those with the slowest waves, so the shortest."""

    slowest: ModalPlate

    def simulation(self, struck: Struck) -> CoSimulation:
        """Return the co-simulation on the modes of its plate."""
        return struck.simulation.replace(structure=self.structure(struck))

    def structure(self, struck: Struck) -> Structure:
        """Return the oscillators of the plate where it is struck."""
        plate, modes = struck.plate, self.slowest
        known = modes.plate
        if (plate.length, plate.width, plate.supports) != (known.length, known.width, known.supports):
            # Another rectangle has other modes.
            modes = ModalPlate(replace(plate, highest_frequency=known.highest_frequency), modes.until)
        return modes.at(*struck.place, plate.thickness, plate.section.struck)


def struck_by(build: Build, **values: float) -> Struck | None:
    """Return what a builder makes, without a mesh; None unless one chain strikes one plate at one place."""
    with unmeshed():
        simulation = build(**values)
    structure = simulation.faces if isinstance(simulation, CoSimulation) else None
    if not isinstance(structure, Unmeshed) or not isinstance(structure.body, Plate) or len(structure.place) != 1:
        return None
    (contact,) = structure.place
    return Struck(simulation, structure.body, (contact.x, contact.y))


def modes_of(plates: Sequence[Struck | None], until: float) -> PlateModes | None:
    """Return the modes for the first of some plates and what lies between the others; None where modes do not serve.

    until: of the longest run, s. Each of the others differs from the first by one quantity.
    """
    known = [struck.plate for struck in plates if struck is not None and is_modal(struck.plate)]
    if not known or len(known) < len(plates):
        return None
    first, slower = known[0], 1.0
    speeds = [float(plate.section.bending[0, 0] / plate.section.mass) ** 0.5 for plate in known]
    for speed in speeds:
        slower *= min(speed / speeds[0], 1.0)
    section = homogeneous_section(slower * first.thickness, first.section.struck)
    highest = max(FREQUENCY, first.highest_frequency)
    return PlateModes(ModalPlate(replace(first, section=section, highest_frequency=highest), until))


def on_modes(build: Build, ranges: Mapping[str, tuple[float, float]], until: float) -> Build | None:
    """Return a builder of the same co-simulations on the modes of their plates; None where modes do not serve them."""
    middle = {name: 0.5 * (low + high) for name, (low, high) in ranges.items()}
    changes = [{}, *({name: end} for name, ends in ranges.items() for end in ends)]
    try:
        with collected():  # the runs repeat what holds for their values
            modes = modes_of([struck_by(build, **(middle | change)) for change in changes], until)
    except (ArithmeticError, LookupError, TypeError, ValueError):
        return None  # the builder needs the mesh; what else is wrong shows in its own runs
    if modes is None:
        return None

    def built(**values: float) -> CoSimulation:
        struck = struck_by(build, **values)
        return build(**values) if struck is None or not is_modal(struck.plate) else modes.simulation(struck)

    return built
