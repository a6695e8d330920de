"""Contacts of plates with chains: places and faces, of one contact or of several."""

from collections.abc import Iterable, Sequence
from math import isclose
from typing import Any, NamedTuple, TypeAlias

from structures.checks import finite, listed, one_of
from structures.structure import Vector

Places: TypeAlias = Sequence[float] | Vector
"""One coordinate of each contact, m."""

FACES = ("front", "back")

SAME = 1e-6
"""Contacts whose coordinates differ by less than this part are at one place."""


class Contact(NamedTuple):
    """A point of a plate, m, and the face on which a chain strikes it. number: as errors show it, "[1]"."""

    x: float
    y: float
    face: str
    number: str = ""

    @property
    def sign(self) -> float:
        """The sign of the contact's displacement, positive away from its chain; the plate's, from the front."""
        return 1.0 if self.face == "front" else -1.0


def contacts_at(x: Any, y: Any, face: Any) -> list[Contact]:
    """Return one contact of two numbers in m, or as many as x and y have; face: one for all, or one for each.

    Raises ValueError where there are not as many of each, and where two contacts are one.
    """
    if not (_many(x) or _many(y)):
        return [Contact(finite("x", x, "m"), finite("y", y, "m"), one_of("face", face, FACES))]
    xs, ys = (_numbers(name, coordinates) for name, coordinates in (("x", x), ("y", y)))
    if len(xs) != len(ys):
        raise ValueError(f"x, y: {len(xs)} and {len(ys)} numbers; must be equally many, one of each for each contact")
    faces = [face] * len(xs) if isinstance(face, str) else listed("face", face, str, "faces, one for each contact")
    if len(faces) != len(xs):
        raise ValueError(f"face = {face!r}: must be one face, or {len(xs)}, as there are contacts")
    contacts: list[Contact] = []
    for i, (one_x, one_y, one_face) in enumerate(zip(xs, ys, faces, strict=True)):
        contact = Contact(one_x, one_y, one_of(f"face[{i}]", one_face, FACES), f"[{i}]" if len(xs) > 1 else "")
        for j, other in enumerate(contacts):
            same = isclose(one_x, other.x, rel_tol=SAME) and isclose(one_y, other.y, rel_tol=SAME)
            if same and other.face == contact.face:
                raise ValueError(
                    f"x, y: contacts {j} and {i} are at one place, {one_x:.6g}, {one_y:.6g} m, on the {one_face}; "
                    "must be apart, or on opposite faces"
                )
        contacts.append(contact)
    return contacts


def contacts_data(contacts: Sequence[Contact]) -> dict[str, Any]:
    """Return the contacts as plain data."""
    if len(contacts) == 1:
        only = contacts[0]
        return {"at": [only.x, only.y], **({} if only.face == "front" else {"face": only.face})}
    return {"at": [[c.x for c in contacts], [c.y for c in contacts]], "face": [c.face for c in contacts]}


def common_copies(contacts: Sequence[Contact], copies: Sequence[int]) -> int:
    """Return how many equal parts make the whole plate; raise a ValueError where this differs between the contacts."""
    if len(set(copies)) > 1:
        raise ValueError(
            f"x, y = {contacts_data(contacts)['at']}: some lie on a symmetry edge and others inside, whose mirror "
            "images would be struck too; must lie all on it or all inside, or take the whole plate"
        )
    return copies[0]


def one_or_all(values: list[Any]) -> Any:
    """Return what belongs to the only contact, or what belongs to each."""
    return values[0] if len(values) == 1 else values


def _many(values: Any) -> bool:
    return isinstance(values, Iterable) and not isinstance(values, str | bytes) and getattr(values, "ndim", 1) > 0


def _numbers(name: str, given: Any) -> list[float]:
    values = listed(name, given, object, "numbers of m, one for each contact")
    return [finite(f"{name}[{i}]", value, "m") for i, value in enumerate(values)]
