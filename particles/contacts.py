"""The contacts of a chain: the two bodies of each, its law, and the tables that the compiled loops take for it."""

from collections.abc import Callable, Sequence
from math import inf
from typing import Any, TypeVar

import numpy as np

from particles.bead import Bead
from particles.kernels.laws import NEVER, Hertz, Mixed, Tabulated, Yielding
from particles.laws.axisymmetric import ComputedLaw, force_by_formula
from particles.laws.law import ContactLaw, PowerLaw, TabulatedLaw, filled
from particles.laws.yielding import YieldingContact
from structures.structure import Vector
from structures.surface import Surface
from structures.units import readable

T = TypeVar("T")
Pair = tuple[Bead, Bead | Surface]
Laws = Sequence[ContactLaw | None]
Groups = dict[ContactLaw, Vector]  # each different law, and the numbers from zero of the contacts that have it


def once_per_pair(pairs: Sequence[Pair | None], of: Callable[[Pair, int], T]) -> list[T | None]:
    """Return of(pair, contact) of each contact, found once for those of the same two bodies; None where nothing is."""
    found: dict[tuple[int, int], T] = {}
    for i, pair in enumerate(pairs):
        if pair is not None and (id(pair[0]), id(pair[1])) not in found:
            found[id(pair[0]), id(pair[1])] = of(pair, i)
    return [None if pair is None else found[id(pair[0]), id(pair[1])] for pair in pairs]


def grouped(laws: Laws) -> Groups:
    """Return the different laws and their contacts."""
    groups: dict[ContactLaw, list[int]] = {}
    for i, law in enumerate(laws):
        if law is not None:
            groups.setdefault(law, []).append(i)
    return {law: np.array(contacts) for law, contacts in groups.items()}


def kernel_laws(laws: Laws) -> Any:
    """Return the contact laws as a piece of the compiled loops: Hertz's, tables, and the pieces that laws bring."""
    others = [None if law is None or law.piece is not None else law for law in laws]
    stiffness = np.array([law.kernel[0] if law else 0.0 for law in others])
    joined: Any = Hertz(stiffness)

    # Equal laws have one table, and some that differ share theirs; those with Hertz's shape have none.
    table_of = {law: law.kernel[1] for law in dict.fromkeys(others) if law is not None and law.kernel[1] is not None}
    if table_of:
        tables = list({id(table): table for table in table_of.values()}.values())
        starts = dict(zip(map(id, tables), np.cumsum([0, *map(len, tables)]), strict=False))
        first = np.array([starts[id(table_of[law])] if law in table_of else -1 for law in others])
        tabulated = Tabulated(stiffness, first, np.concatenate(tables))
        joined = tabulated if (first >= 0).all() else Mixed(tabulated, joined, first >= 0)  # type: ignore[arg-type]

    for piece in dict.fromkeys(law.piece for law in laws if law is not None and law.piece is not None):
        chosen = [law if law is not None and law.piece is piece else None for law in laws]
        where = np.array([law is not None for law in chosen])
        joined = filled(piece, chosen) if where.all() else Mixed(filled(piece, chosen), joined, where)
    return joined


def kernel_yielding(contacts: Sequence[YieldingContact | None], stiffness: Vector) -> Yielding:
    """Return the contacts that yield as a piece of the compiled loops."""
    yields = [contact if contact is not None and contact.overlap < inf else None for contact in contacts]
    different = list(dict.fromkeys(contact for contact in yields if contact is not None))
    tables = [table for contact in different for table in contact.tables] or [np.zeros((1, 6))]
    starts = np.cumsum([0, *map(len, tables)])
    first = [0 if contact is None else 2 * different.index(contact) for contact in yields]
    return Yielding(
        stiffness,
        np.array([NEVER if contact is None else contact.overlap for contact in yields]),
        np.array([0.0 if contact is None else contact.yield_force for contact in yields]),
        starts[first],
        starts[np.add(first, 1)],
        np.concatenate(tables),
        *np.zeros((3, 0)),
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


def cautions(pairs: Sequence[Pair | None], groups: Groups, deepest: Vector) -> tuple[list[str], list[str]]:
    """Return the laws' own cautions, and those where the greatest approaches, m, are beyond what a law is good for."""
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
            approach, theirs = law.approaches[-1], [pairs[i] for i in contacts]
            forces = once_per_pair(theirs, lambda pair, _, approach=approach: force_by_formula(pair, approach))  # type: ignore[misc]
            ratios = np.array([law.formula if force is None else force for force in forces]) / law.formula
            if (others := np.flatnonzero(abs(ratios - 1.0) > 0.01)).size:
                beyond.append(
                    f"contact law: that of contact {contacts[others[0]] + 1} ({law.name}) was computed for other "
                    f"bodies; by formulas the force is {ratios[others[0]]:.3g} times theirs there; give the law of its "
                    "bodies, or a function of two bodies"
                )
        if not isinstance(law, PowerLaw | TabulatedLaw) and not law.piece and law.table_error > 1e-4:
            beyond.append(
                f"contact law: the table of {law.name} differs by {100.0 * law.table_error:.2g} % from its force; "
                "give a law that is smooth, at least over a thirtieth of its approach"
            )
    return list(remarks), beyond
