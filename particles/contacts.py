"""The contacts of a chain: the two bodies of each, its law, and the table that the compiled loops take for it."""

from collections.abc import Callable, Sequence
from functools import lru_cache
from itertools import pairwise
from math import inf, pi, sqrt
from typing import Any, TypeVar

import numpy as np

from particles.bead import Bead, Cylinder
from particles.chain import Chain
from particles.kernels.laws import NEVER, Hertz, Mixed, Tabulated, Yielding
from particles.laws.axisymmetric import ComputedLaw, force_by_formula
from particles.laws.law import ContactLaw, PowerLaw, TabulatedLaw, check_contact_law, filled, unchanging
from particles.laws.yielding import YieldingContact, YieldingLaw
from structures.structure import Vector
from structures.surface import Surface, hertz_pressure, relative_curvatures, yield_pressure
from structures.units import readable

T = TypeVar("T")
Pair = tuple[Bead, Bead | Surface]
Laws = Sequence[ContactLaw | None]
Groups = dict[ContactLaw, Vector]
"""Each different law, and the numbers from zero of the contacts that have it."""

TABLE_ERROR, OTHER_BODIES = 1e-4, 0.01
"""Relative error of the table of a user's law, above which a run warns; AR then changes by about as much. Relative
difference of two forces by formulas, above which a computed law is that of other bodies."""

OF_HERTZ = 1.0 / 3.0
"""Power of the force in the pressure of a round or elliptic contact."""


def pairs_of(chain: Chain, surface: Surface | None, behind: Surface | None) -> tuple[Pair | None, ...]:
    """Return the bodies that touch at each contact; None where a force replaces it, or nothing is there."""
    first: Pair | None = None
    faced = behind if behind is not None else chain.excitation.faces(chain.beads[0])
    if chain.body is not None:
        first = chain.body, chain.beads[0]
    elif faced is not None:
        first = chain.beads[0], faced
    return (first, *pairwise(chain.beads), None if surface is None else (chain.beads[-1], surface))


def once_per_pair(pairs: Sequence[Pair | None], of: Callable[[Pair, int], T]) -> list[T | None]:
    """Return of(pair, contact) of each contact, found once for those of the same two bodies; None where nothing is."""
    found: dict[tuple[int, int], T] = {}
    for i, pair in enumerate(pairs):
        if pair is not None and (id(pair[0]), id(pair[1])) not in found:
            found[id(pair[0]), id(pair[1])] = of(pair, i)
    return [None if pair is None else found[id(pair[0]), id(pair[1])] for pair in pairs]


def laws_of(
    chain: Chain, pairs: Sequence[Pair | None], law_between: Callable[[Bead, Bead | Surface], ContactLaw]
) -> tuple[ContactLaw | None, ...]:
    """Return the law of each contact: the user's, or that of `law_between` where there is none."""
    # A contact that yields is elastic at first.
    given = None if isinstance(chain.law, YieldingLaw) else chain.law
    # Keeps what a function returned, or another object could get the same id.
    copies: dict[int, tuple[ContactLaw, ContactLaw]] = {}

    def between(pair: Pair, _: int) -> ContactLaw:
        if given is None or (isinstance(given, ContactLaw) and isinstance(pair[1], Surface)):
            return law_between(*pair)
        if isinstance(given, ContactLaw):
            return given
        what = "a function that returns a contact law such as PowerLaw(k, n)"
        law = check_contact_law("law", given(*pair), what)
        return copies.setdefault(id(law), (law, unchanging(law)))[1]

    return tuple(once_per_pair(pairs, between))


def yielding_of(chain: Chain, pairs: Sequence[Pair | None], laws: Laws) -> tuple[YieldingContact | None, ...] | None:
    """Return how each contact yields, None for one that does not; None for a chain whose law is no YieldingLaw."""
    chain_law = chain.law
    if not isinstance(chain_law, YieldingLaw):
        return None
    yielding = once_per_pair(pairs, lambda pair, i: chain_law.contact(*pair, laws[i]))
    if not any(yielding):
        raise ValueError(
            f"law = {chain_law!r}: no material of the chain has a yield strength; give Material(..., yield_strength=) "
            "or the law's own yield_strength"
        )
    return tuple(yielding)


def kernel_yielding(contacts: Sequence[YieldingContact | None], stiffness: Vector) -> Yielding:
    """Return the contacts that yield as a piece of the compiled loops."""
    yields = [contact if contact is not None and contact.overlap < inf else None for contact in contacts]
    different = list(dict.fromkeys(contact for contact in yields if contact is not None))
    tables = [table for contact in different for table in contact.tables] or [np.zeros((1, 6))]
    starts = np.cumsum([0, *map(len, tables)])
    first = [0 if contact is None else 2 * different.index(contact) for contact in yields]
    memory = np.zeros(0)
    return Yielding(
        stiffness,
        np.array([NEVER if contact is None else contact.overlap for contact in yields]),
        np.array([0.0 if contact is None else contact.yield_force for contact in yields]),
        starts[first],
        starts[np.add(first, 1)],
        np.concatenate(tables),
        *(memory, memory, memory),
    )


def unloading(contacts: Sequence[YieldingContact | None], stiffness: Vector, overlaps: Vector) -> Vector:
    """Return what contacts that were pressed so far (m) remember, one array after the other; see `Yielding`."""
    limit, hard, dent = np.full(stiffness.size, NEVER), stiffness.copy(), np.zeros(stiffness.size)
    for i, contact in enumerate(contacts):
        if contact is not None and contact.overlap < inf:
            limit[i] = max(contact.overlap, overlaps[i])
            if overlaps[i] > contact.overlap:
                dent[i] = contact.dent(overlaps[i])
                hard[i] = contact.force(overlaps[i]) / (overlaps[i] - dent[i]) ** 1.5
    return np.concatenate([limit, hard, dent])


def grouped(laws: Laws) -> Groups:
    """Return the different laws and their contacts."""
    # By identity first: the hash of a law takes longer than a step of the chain.
    places: dict[int, list[int]] = {}
    for i, law in enumerate(laws):
        places.setdefault(id(law), []).append(i)
    groups: dict[ContactLaw, list[int]] = {}
    for same in places.values():
        law = laws[same[0]]
        if law is not None:
            groups.setdefault(law, []).extend(same)
    return {law: np.array(sorted(contacts)) for law, contacts in groups.items()}


def kernel_laws(laws: Laws) -> Any:
    """Return the contact laws as a piece of the compiled loops: Hertz's, tables, and the pieces that laws bring."""
    brought = dict.fromkeys(law.piece for law in laws if law is not None and law.piece is not None)
    others = [None if law is None or law.piece is not None else law for law in laws]
    stiffness = np.array([law.kernel[0] if law else 0.0 for law in others])
    # Equal laws have one table, and some that differ share theirs; those with Hertz's shape have none.
    table_of = {law: law.kernel[1] for law in dict.fromkeys(others) if law is not None and law.kernel[1] is not None}
    parts: list[tuple[Any, Any]] = []
    if table_of:
        tables = list({id(table): table for table in table_of.values()}.values())
        starts = dict(zip(map(id, tables), np.cumsum([0, *map(len, tables)]), strict=False))
        first = np.array([starts[id(table_of[law])] if law in table_of else -1 for law in others])
        parts.append((Tabulated(stiffness, first, np.concatenate(tables)), first >= 0))
    for piece in brought:
        chosen = [law if law is not None and law.piece is piece else None for law in laws]
        parts.append((filled(piece, chosen), np.array([law is not None for law in chosen])))
    joined: Any = Hertz(stiffness)
    for part, where in parts:
        joined = part if where.all() else Mixed(part, joined, where)
    return joined


def cautions(pairs: Sequence[Pair | None], groups: Groups, deepest: Vector) -> tuple[list[str], list[str]]:
    """Return what a user must know of the laws: their own cautions; and where a run went beyond what a law is good for.

    deepest: the greatest approach of each contact, m.
    """
    remarks = {f"contact law: {law.caution}": None for law in groups if law.caution}
    beyond = []
    for law, contacts in groups.items():
        worst = contacts[int(deepest[contacts].argmax())]
        if deepest[worst] > law.largest:
            beyond.append(
                f"contact law: the approach of {readable(float(deepest[worst]), 'm')} at contact {worst + 1} is beyond "
                f"{readable(law.largest, 'm')}, up to which its law ({law.name}) is trusted"
            )
        if isinstance(law, ComputedLaw) and law.formula > 0.0:
            some = [(i, pair) for i in contacts[::-1].tolist() if (pair := pairs[i]) is not None]
            for first in sorted({(id(one), id(other)): i for i, (one, other) in some}.values()):
                ratio = force_by_formula(pairs[first], law.approaches[-1]) / law.formula  # type: ignore[arg-type]
                if abs(ratio - 1.0) > OTHER_BODIES:
                    beyond.append(
                        f"contact law: that of contact {first + 1} ({law.name}) was computed for other bodies; by "
                        f"formulas the force is {ratio:.3g} times theirs there; give the law of its bodies, or a "
                        "function of two bodies"
                    )
                    break
        if not isinstance(law, PowerLaw | TabulatedLaw) and not law.piece and law.table_error > TABLE_ERROR:
            beyond.append(
                f"contact law: the table of {law.name} differs by {100.0 * law.table_error:.2g} % from its force; "
                "give a law that is smooth, at least over a thirtieth of its approach"
            )
    return list(remarks), beyond


def yield_pressures(pairs: Sequence[Pair | None]) -> Vector:
    """Return unit, power and limit of each contact, 3 × contacts: the greatest pressure is p₀ = unit · F^power, Pa, and
    the weaker body yields from the limit on, which is infinite where nothing is known."""

    def of(pair: Pair, _: int) -> tuple[float, float, float]:
        surface, facing = (side if isinstance(side, Surface) else side.surface for side in pair)
        return _yield_pressure(surface, facing, min((s.length for s in pair if isinstance(s, Cylinder)), default=inf))

    return np.array([pressure or UNKNOWN for pressure in once_per_pair(pairs, of)]).T


UNKNOWN = 0.0, 1.0, inf


@lru_cache(maxsize=256)  # thousands of runs have the same beads
def _yield_pressure(surface: Surface, facing: Surface, length: float) -> tuple[float, float, float]:
    limit = min(yield_pressure(surface.material), yield_pressure(facing.material))
    if limit == inf:
        return UNKNOWN
    try:
        flat, sharp = relative_curvatures(surface, facing)
    except ValueError:
        return UNKNOWN  # bodies that conform have a law of the user's own
    if flat > 1e-12 * sharp:
        return hertz_pressure(surface, facing, 1.0), OF_HERTZ, limit
    modulus = 1.0 / (1.0 / surface.material.contact_modulus + 1.0 / facing.material.contact_modulus)
    return sqrt(modulus * sharp / (pi * length)), 0.5, limit
