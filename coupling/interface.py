"""The contacts of a co-simulation: which end of which chain faces which structure."""

from collections.abc import Callable, Iterable, Sequence
from typing import Annotated, Any, TypeAlias

import numpy as np

from coupling.participant import CheckedParticipant, Participant
from coupling.results.schema import FIRST, LAST, Contact
from particles.chain import Chain
from particles.contacts import coordinates, joined
from particles.deformable.deformable_chain import moving_chain
from particles.moving import ChainState, MovingChain
from structures.described import described
from structures.moving import MovingStructure
from structures.quantities import Count
from structures.structure import Structure, Vector, half_space, surfaces_of

NAMES = ("structure", "behind")  # the arguments of CoSimulation, for the last bead and for the first
PARTICIPANTS = "a Structure (for a plate: plate.at(x, y)), None, or an object with surface, start and advance"


@described
class ContactPoint:
    """One of the contact points of a structure that has several.

    Parameters
    ----------
    structure : Structure, MovingStructure or Participant
        The structure.
    number : int
        The number of the contact point, counted from 0.

    Examples
    --------
    >>> edges = hl.Supports("clamped", "clamped", "clamped", "clamped")
    >>> plate = hl.kirchhoff_plate(0.2, 0.15, 3e-3, hl.ALUMINIUM_6061, edges)
    >>> hl.ContactPoint(plate.at([0.05, 0.15], [0.07, 0.07]), 1).number
    1
    """

    structure: Any
    number: Annotated[int, Count(0)]

    def __post_init__(self) -> None:
        takes_part("structure", self.structure)
        count = len(surfaces_of(self.structure))
        if self.number >= count:
            raise ValueError(f"number = {self.number!r}: must be below {count}, the structure's number of contacts")


Facing: TypeAlias = Structure | MovingStructure | Participant | ContactPoint | None
"""What a bead can face at an end of a chain; None for nothing."""


class Interface:
    """Chains, structures, and the K contacts between them, by chain; the last bead's contact precedes the first's.
    facing, behind: what the last bead of each chain faces, and what the struck side of its first bead faces: a
    Structure, a Participant, a ContactPoint, or None for nothing. The forces of all contacts are an array of K numbers,
    and so are the displacements of the contact points."""

    def __init__(
        self,
        chains: Sequence[Chain],
        facing: Sequence[Any],
        behind: Sequence[Any],
        dt: float | None = None,
        fineness: float = 1.0,
    ) -> None:
        self.structures: list[Any] = []
        self.contacts: list[Contact] = []
        self._given: list[Any] = []
        for number, ends in enumerate(zip(facing, behind, strict=True)):
            for end, faced in zip((LAST, FIRST), ends, strict=True):
                if faced is not None or end == LAST:
                    where = NAMES[end] if len(chains) == 1 else f"{NAMES[end]}[{number}]"
                    place, point = self._seat(where, faced, chains[number])
                    self.contacts.append(Contact(number, end, place, point))
        self.size = len(self.contacts)
        self.single = self.size == 1 and len(self.structures[0].surfaces) == 1
        self.of_chain = [[k for k, c in enumerate(self.contacts) if c.chain == i] for i in range(len(chains))]
        self.touching = [
            [k for k, contact in enumerate(self.contacts) if contact.structure == place]
            for place in range(len(self.structures))
        ]
        """The contacts of each structure."""
        self.of_structure = [np.full(len(structure.surfaces), -1, dtype=np.intp) for structure in self.structures]
        """The contact at each point of each structure; −1 where nothing touches."""
        for k, contact in enumerate(self.contacts):
            self.of_structure[contact.structure][contact.point] = k
        energy = max(chain.impact_energy for chain in chains) if len(chains) > 1 else None
        settings = {"impact_energy": energy, "dt": dt, "fineness": fineness}
        moving = list[MovingChain]()
        for number, chain in enumerate(chains):
            # The surfaces that the ends face, and the flexibilities in series with them, m/N.
            sides: list[Any] = []
            for _, _, place, point in (self.contacts[k] for k in self.of_chain[number]):
                body = self.structures[place]
                spring = float(body.structure.flexibilities[point]) if isinstance(body, MovingStructure) else 0.0
                sides += [body.surfaces[point], spring]
            surface, flexibility, back, spring = [*sides, None, 0.0][:4]
            if facing[number] is None:
                surface, flexibility = None, 0.0
            moving.append(moving_chain(chain, surface, flexibility, behind=back, behind_flexibility=spring, **settings))
        self.chains = tuple(moving)
        alone = len(self.chains) == 1
        self.model = self.chains[0].model if alone else joined(self.chains)
        """All chains, in the form that the compiled loops take."""
        self.places, self.coordinates = coordinates(self.chains, self.model)
        """The slice of each chain in the array of all coordinates, and the size of this array."""
        self.bodies = [slice(striker, last + 1) for striker, last, *_ in self.model.ends.tolist()]
        """The slice of each chain in the array of all bodies."""
        self.static = np.array([float(self.chains[c.chain].static_force[c.end - 1]) for c in self.contacts])
        self.force_scale = max(chain.scales[0] for chain in self.chains)
        self.indentation_scale = max(chain.scales[1] for chain in self.chains)
        self.contact_time = min(chain.contact_time for chain in self.chains)
        self.impact_energy = sum(chain.chain.impact_energy for chain in self.chains)
        self.black_boxes = [structure for structure in self.structures if isinstance(structure, CheckedParticipant)]
        self.damped = [
            place
            for place, structure in enumerate(self.structures)
            if isinstance(structure, MovingStructure) and structure.structure.damping is not None
        ]

    def together(self, states: Sequence[ChainState]) -> tuple[Vector, Vector]:
        """Return the positions and the velocities of all chains, one after the other."""
        y, v = np.zeros((2, self.coordinates))
        for place, state in zip(self.places, states, strict=True):
            y[place], v[place] = state.position, state.velocity
        return y, v

    def _seat(self, where: str, facing: Any, chain: Chain) -> tuple[int, int]:
        """Return the number of the structure that a chain end faces, added if it is new, and the contact point's."""
        facing = half_space(chain.beads[-1].surface.material) if facing is None else facing
        whole_one, point = (facing.structure, facing.number) if isinstance(facing, ContactPoint) else (facing, None)
        takes_part(where, whole_one)
        count = len(surfaces_of(whole_one))
        if point is None and count > 1:
            raise ValueError(
                f"{where}: has {count} contact points; choose one of them by ContactPoint(structure, number)"
            )
        place = next((i for i, structure in enumerate(self._given) if structure is whole_one), len(self._given))
        if place == len(self._given):
            self._given.append(whole_one)
            ready = isinstance(whole_one, MovingStructure)
            kind = MovingStructure if isinstance(whole_one, Structure) else CheckedParticipant
            self.structures.append(whole_one if ready else kind(whole_one))
            bodies = [structure.structure for structure in self.structures if isinstance(structure, MovingStructure)]
            if len({id(body) for body in bodies}) < len(bodies):
                raise ValueError(
                    f"{where}: is in two MovingStructures, which move independently; use one MovingStructure for both"
                )
        if any(contact[2:] == (place, point or 0) for contact in self.contacts):
            raise ValueError(
                f"{where}: another end of a chain faces that contact point; give the structure a contact point for "
                "each end, such as plate.at([x1, x2], [y1, y2]), or give each end its own structure"
            )
        return place, point or 0


def facing_of_each(name: str, facing: Any, count: int, several: bool) -> list[Any]:
    """Return a list of what each of `count` chains faces, from a list, one structure with as many points, or None."""
    if not several:
        return [facing]
    if facing is None:
        return [None] * count
    entries = list[Any]()
    if isinstance(facing, Structure | Participant):
        points = len(surfaces_of(facing))
        entries = [ContactPoint(facing, number) for number in range(points)] if points > 1 else [facing]
    elif isinstance(facing, Iterable) and not isinstance(facing, str | ContactPoint):
        entries = list(facing)
    if len(entries) == count:
        return entries
    raise ValueError(
        f"{name}: must be a list of {count}, or one structure with {count} contact points, such as "
        "plate.at([x1, x2], [y1, y2])"
    )


def changed(facing: Any, change: Callable[[Any], Any]) -> Any:
    """Return what one end faces, or each of several, with the body replaced by change(body)."""
    if isinstance(facing, list):
        return [changed(one, change) for one in facing]
    if isinstance(facing, ContactPoint):
        return ContactPoint(changed(facing.structure, change), facing.number)
    return change(facing)


def takes_part(where: str, facing: Any) -> None:
    """Raise a ValueError for an object that is neither a structure nor a participant."""
    lacking = [name for name in ("surface", "start", "advance") if not hasattr(facing, name)]
    if isinstance(facing, type):
        fault = f"the class {facing.__name__}: must be an instance, such as {facing.__name__}(…)"
    elif isinstance(facing, Structure) or not lacking:
        return
    else:
        lacks = f"lacks {' and '.join(lacking)}; " if len(lacking) < 3 else ""
        fault = f"{type(facing).__name__}: {lacks}must be {PARTICIPANTS}"
    raise ValueError(f"{where} = {fault}")


def check_finite(interface: Interface, chains: Sequence[tuple[Vector, Vector]], surface: Vector, time: float) -> None:
    """Raise a FloatingPointError that names the first body, or the surface, whose motion is no longer finite."""
    for number, (y, v) in enumerate(chains):
        faced = np.isfinite(surface[interface.of_chain[number][0]])
        bad = np.flatnonzero(~np.append(np.isfinite(y) & np.isfinite(v), faced))
        if bad.size:
            chain, bead = interface.chains[number].chain, int(bad[0])
            first = "the striker (bead 0)" if chain.body else "what moves the first bead (bead 0)"
            what = first if bead == 0 else f"bead {bead}" if bead <= len(chain.beads) else "the structure's surface"
            of = f" of chain {number}" if len(interface.chains) > 1 else ""
            raise FloatingPointError(f"{what}{of} is no longer finite at t = {time:.6g} s; check dt and the structure")
