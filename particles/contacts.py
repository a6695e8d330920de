"""The contacts of chains, and all chains of a run in the arrays of the compiled loops, one after another."""

from collections.abc import Callable, Sequence
from math import inf
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from particles.bead import Bead
from particles.dissipation import kernel_losses
from particles.kernels.drives import FREE, MOVED, Drives
from particles.kernels.laws import NEVER, Hertz, Mixed, Tabulated, Yielding
from particles.kernels.losses import NoLoss
from particles.kernels.motion import ENDS, PACE, Chains, DampedVerlet, Verlet
from particles.kernels.vibrations import Vibrations
from particles.laws.law import ContactLaw, PowerLaw, TabulatedLaw, filled
from structures.structure import Vector
from structures.surface import Surface
from structures.units import readable

if TYPE_CHECKING:
    from particles.moving import MovingChain

T = TypeVar("T")
Pair = tuple[Bead, Bead | Surface]
Groups = dict[ContactLaw, Vector]  # for each different law the numbers, from zero, of its contacts


def once_per_pair(pairs: Sequence[Pair | None], of: Callable[[Pair, int], T]) -> list[T | None]:
    """Return of(pair, contact) for each contact, computed once for each pair of bodies; None without a contact."""
    found: dict[tuple[int, int], T] = {}
    for i, pair in enumerate(pairs):
        if pair is not None and (id(pair[0]), id(pair[1])) not in found:
            found[id(pair[0]), id(pair[1])] = of(pair, i)
    return [None if pair is None else found[id(pair[0]), id(pair[1])] for pair in pairs]


def grouped(laws: Sequence[ContactLaw | None]) -> Groups:
    """Return the different laws and their contacts."""
    groups: dict[ContactLaw, list[int]] = {}
    for i, law in enumerate(laws):
        if law is not None:
            groups.setdefault(law, []).append(i)
    return {law: np.array(contacts) for law, contacts in groups.items()}


def cautions(groups: Groups, deepest: Vector) -> tuple[list[str], list[str]]:
    """Return the laws' own cautions, and those for greatest approaches, m, beyond the range of a law."""
    remarks = {f"contact law: {law.caution}": None for law in groups if law.caution}
    beyond = []
    for law, contacts in groups.items():
        worst = contacts[int(deepest[contacts].argmax())]
        if deepest[worst] > law.largest:
            beyond.append(
                f"contact law: the approach of {readable(float(deepest[worst]), 'm')} at contact {worst + 1} is beyond "
                f"{readable(law.largest, 'm')}, the limit of its law ({law.name})"
            )
        if not isinstance(law, PowerLaw | TabulatedLaw) and not law.piece and law.table_error > 1e-4:
            beyond.append(
                f"contact law: the table of {law.name} differs by {100.0 * law.table_error:.2g} % from its force; "
                "give a law that is smooth over a thirtieth of its approach"
            )
    return list(remarks), beyond


def joined(chains: Sequence["MovingChain"]) -> Chains:
    """Return chains for the compiled loops. Surfaces are numbered by chain, that at the last bead first."""
    mass = np.concatenate([chain.mass for chain in chains])
    first = np.cumsum([0, *(chain.mass.size for chain in chains)])
    present = np.concatenate([[law is not None for law in chain.laws] for chain in chains])
    free = np.isfinite(mass)
    along = np.concatenate([np.full(chain.mass.size, chain.chain.gravity_along) for chain in chains])

    # The surfaces at the ends.
    has_behind = np.array([chain.behind is not None for chain in chains])
    facing = np.cumsum(1 + has_behind) - 1 - has_behind
    wall, spring = np.full(mass.size, -1), np.zeros(mass.size)
    wall[first[1:] - 1] = facing
    spring[first[:-1]] = [chain.behind_flexibility for chain in chains]
    spring[first[1:] - 1] = [chain.flexibility for chain in chains]
    ends = np.zeros(len(chains), ENDS)
    ends["striker"], ends["last"], ends["behind"] = first[:-1], first[1:] - 1, np.where(has_behind, facing + 1, -1)
    ends["rest"] = [float(chain.rest[0]) for chain in chains]
    ends["quiet"] = [not chain.rest[: chain.mass.size].any() for chain in chains]
    ends["touched"], ends["faces"] = present[first[:-1]], present[first[1:] - 1]

    # The pieces.
    losses = [(chain.chain.dissipation, chain.reduced_mass) for chain in chains]
    own = [chain.vibrations for chain in chains]
    modes = max(one.struck.shape[1] for one in own)
    # Bodies with fewer modes have additional ones that do not move.
    *of_modes, cross = zip(*own, strict=True)
    wide = ([np.pad(array, ((0, 0), (0, modes - array.shape[1]))) for array in arrays] for arrays in of_modes)
    on_bodies = any(loss is not None and loss.piece == "bodies" for loss, _ in losses)

    # The drives. The history of a piston starts at its static position.
    drives = [chain.chain.excitation.drive for chain in chains]
    kinds, springs = np.array([drive.kind for drive in drives]), np.array([float(drive.spring) for drive in drives])
    loads = np.array([chain.chain.preload - chain.static_force[0] for chain in chains])
    histories = [np.array(drive.history, dtype=float) for drive in drives]
    for history, place in zip(histories, ends["rest"] * (kinds == MOVED), strict=True):
        history[1] += place
    drive = Drives(
        (kinds != FREE) | (springs != 0.0) | (loads != 0.0),
        kinds,
        np.cumsum([0, *(history.shape[1] for history in histories)]),
        np.concatenate(histories, axis=1),
        loads,
        springs,
        ends["rest"] + [drive.left for drive in drives],
    )
    return Chains(
        DampedVerlet() if modes or on_bodies else Verlet(),
        kernel_laws(chains),
        kernel_losses(losses, present, free),
        drive,
        Vibrations(*map(np.concatenate, [*wide, cross])),
        1.0 / mass,
        np.where(free, along, 0.0),
        wall,
        spring,
        ends,
    )


def kernel_laws(chains: Sequence["MovingChain"]) -> Any:
    """Return the laws of all contacts as a piece: Hertz's law, tables, the laws' own pieces, contacts that yield."""
    laws = [None if chain.yielding is not None else law for chain in chains for law in chain.local_laws]
    others = [None if law is None or law.piece is not None else law for law in laws]
    # Equal laws have the same table, some different laws share one, and laws of Hertz's shape have none.
    kernel: dict[Any, Any] = {law: law.kernel for law in dict.fromkeys(others) if law is not None}
    stiffness, tables = zip(*(kernel.get(law, (0.0, None)) for law in others), strict=True)
    first, rows = table_rows(tables)
    piece: Any = mixed(Tabulated(np.array(stiffness), first, rows), Hertz(np.array(stiffness)), first >= 0)

    for own in dict.fromkeys(law.piece for law in laws if law is not None and law.piece is not None):
        chosen = [law if law is not None and law.piece is own else None for law in laws]
        piece = mixed(filled(own, chosen), piece, np.array([law is not None for law in chosen]))

    yields = np.concatenate([np.full(chain.mass.size, chain.yielding is not None) for chain in chains])
    return mixed(kernel_yielding(chains), piece, yields) if yields.any() else piece


def kernel_yielding(chains: Sequence["MovingChain"]) -> Yielding:
    """Return the contacts that yield as a piece; a contact whose elastic law is not trusted so far never yields."""
    given = [contact for chain in chains for contact in chain.yielding or [None] * chain.mass.size]
    contacts = [contact if contact is not None and contact.overlap < inf else None for contact in given]
    loading, dent = zip(*(contact.tables if contact else (None, None) for contact in contacts), strict=True)
    first, rows = table_rows(loading + dent)
    return Yielding(
        np.concatenate([chain.stiffness for chain in chains]),
        np.array([contact.overlap if contact else NEVER for contact in contacts]),
        np.array([contact.yield_force if contact else 0.0 for contact in contacts]),
        first[: len(contacts)],
        first[len(contacts) :],
        rows,
        *np.zeros((3, 0)),
    )


def table_rows(tables: Sequence[Vector | None]) -> tuple[Vector, Vector]:
    """Return where the table of each contact begins, or −1 without one, in the rows of all different tables."""
    different = {id(table): table for table in tables if table is not None}
    begins = np.cumsum([0, *map(len, different.values())])
    begin_of = dict(zip(different, begins, strict=False))
    first = np.array([begin_of.get(id(table), -1) for table in tables])
    return first, np.concatenate([np.zeros((0, 6)), *different.values()])


def mixed(own: Any, others: Any, is_own: Any) -> Any:
    """Return one piece for some contacts and another for the others, or the only piece that a contact has."""
    if not is_own.any():
        return others
    return own if is_own.all() else Mixed(own, others, is_own)


def pace_of(model: Chains, steps: Sequence[int], coordinates: int) -> Any:
    """Return the steps of each chain in a window, and the first body that its surface can reach, as records PACE.

    Velocity Verlet lets neighbours act on each other, so each step passes the motion of the surface on by one body. All
    trials begin with the surface at the same place, so its motion reaches the last body at the second of the steps + 1
    kicks, or at the first if losses depend on its velocity. All bodies are moved again if contacts yield, because these
    remember a trial, or if a structure stands behind the chain. A drive moves the first two bodies together.
    """
    pace = np.zeros(len(steps), PACE)
    pace["steps"], pace["reached"] = steps, model.ends["striker"]
    if isinstance(model.stepper, Verlet) and coordinates == model.inverse_mass.size:
        first = model.ends["last"] + 1 - pace["steps"] - (not isinstance(model.loss, NoLoss))
        least = model.ends["striker"] + np.where(model.drive.acts, 2, 1)
        part = (first >= least) & (model.ends["behind"] < 0)
        pace["reached"] = np.where(part, first, model.ends["striker"])
    return pace


def coordinates(chains: Sequence["MovingChain"], model: Chains) -> tuple[list[Any], int]:
    """Return the places of each chain's coordinates (see ChainState) among those of all chains, and their number. The
    coordinates of all chains are those of the bodies, then of their modes, then the memory of the contacts.
    """
    (bodies, modes), remembers = model.vibrations.struck.shape, any(chain.yielding for chain in chains)
    moving = bodies * (1 + modes)
    total = moving + 3 * bodies * remembers
    if len(chains) == 1:
        return [slice(None)], total
    places: list[Any] = []
    for chain, begin in zip(chains, model.ends["striker"].tolist(), strict=True):
        own = np.arange(begin, begin + chain.mass.size)
        of_modes = bodies + own[:, None] * modes + np.arange(chain.vibrations.struck.shape[1])
        memory = [moving + part * bodies + own for part in range(3 if chain.yielding else 0)]
        places.append(np.concatenate([own, of_modes.ravel(), *memory]))
    return places, total
