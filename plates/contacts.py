"""Contacts between plates and chains: places and faces of one contact or of several."""

from collections.abc import Sequence
from math import isclose
from typing import Any, NamedTuple, TypeAlias

from structures.checks import finite, listed, one_of, several
from structures.structure import Vector

Places: TypeAlias = Sequence[float] | Vector  # One coordinate of each contact, m
FACES = ("front", "back")
SAME = 1e-6  # Contacts whose coordinates differ by a smaller fraction are at the same place


class Contact(NamedTuple):
    """A point of a plate, m, and the face on which a chain strikes it."""

    x: float
    y: float
    face: str


def contacts_at(x: Any, y: Any, face: Any) -> list[Contact]:
    """Return the contacts at x and y, m; face: one for all, or one for each.

    Raise a ValueError if the numbers of x, y and face differ, or if two contacts coincide.
    """
    if not (several(x) or several(y)):
        return [Contact(finite("x", x, "m"), finite("y", y, "m"), one_of("face", face, FACES))]
    xs, ys = (listed(name, given, object, "numbers in m, one for each contact") for name, given in (("x", x), ("y", y)))
    faces = [face] * len(xs) if isinstance(face, str) else listed("face", face, str, "faces, one for each contact")
    if not len(xs) == len(ys) == len(faces):
        raise ValueError(f"x, y, face: must have equal lengths, not {len(xs)}, {len(ys)} and {len(faces)}")
    contacts: list[Contact] = []
    for i, place in enumerate(zip(xs, ys, faces, strict=True)):
        one_x, one_y = (finite(f"{name}[{i}]", value, "m") for name, value in zip("xy", place, strict=False))
        contact = Contact(one_x, one_y, one_of(f"face[{i}]", place[2], FACES))
        for j, other in enumerate(contacts):
            same = isclose(one_x, other.x, rel_tol=SAME) and isclose(one_y, other.y, rel_tol=SAME)
            if same and other.face == contact.face:
                raise ValueError(f"x, y: contacts {j} and {i} must not be at the same place on the {contact.face}")
        contacts.append(contact)
    return contacts


def contacts_data(contacts: Sequence[Contact]) -> dict[str, Any]:
    """Return the contacts as plain data."""
    if len(contacts) == 1:
        (only,) = contacts
        return {"at": [only.x, only.y], **({} if only.face == "front" else {"face": only.face})}
    return {"at": [[c.x for c in contacts], [c.y for c in contacts]], "face": [c.face for c in contacts]}


def one_or_all(values: list[Any]) -> Any:
    """Return the value of the only contact, or the values of several."""
    return values[0] if len(values) == 1 else values
