"""The base of all parts of a case: a strict table that makes an object of hertzlink's; lengths."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path as File
from typing import Annotated, Any, ClassVar, Union

from pydantic import BaseModel, ConfigDict, Discriminator, Tag

from hertzlink.cases.entry_paths import Path
from hertzlink.cases.faults import Fault, fault_of
from hertzlink.cases.units import Unit
from plates.laminate import OrthotropicMaterial
from structures import quantities
from structures.caution import caution, collected
from structures.checks import positive
from structures.material import Material

FILES = ("mesh",)
"""Entries that name files."""

PERHAPS_FILES = ("mass", "stiffness", "damping_matrix", "contact", "frequencies", "response")
"""Entries that name files where their text ends as a file's name does: "plate.mas", but not "2.5 g"."""

OWNER = re.compile(r"^.* (?=[\w\[\]-]+ = )")
"""What stands before the argument in a warning about its value: "Section thickness = 2: is read as 2 m"."""

ENDING = re.compile(r"\.[A-Za-z]\w*$")

Length = Annotated[float, Unit.noted(quantities.Length)]
Duration = Annotated[float, Unit.noted(quantities.Time)]
Frequency = Annotated[float, Unit.noted(quantities.Frequency)]
Number = Annotated[float, Unit("", "a number", "0.02")]


@dataclass(frozen=True)
class World:
    """The case around parts, as far as they need it.

    materials: its own, by name, and sheets: those that are orthotropic. folder: that of its file. until: the length of
    its runs, s. bead: that of the chain around.
    """

    materials: Mapping[str, Material] = field(default_factory=dict)
    folder: File = field(default_factory=File)
    until: float = 1e-3
    sheets: Mapping[str, OrthotropicMaterial] = field(default_factory=dict)
    bead: Any = None


class Part(BaseModel):
    """A table of a case. Entries that it does not know are refused, and texts are not taken for numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)

    named: ClassVar[Mapping[str, Path]] = {}
    """Names in messages of hertzlink that are written otherwise in a case, and their paths."""

    def names(self) -> dict[str, Path]:
        """Return all names in messages of hertzlink, and their paths."""
        return {name: (name,) for name in type(self).model_fields} | dict(self.named)

    def fault(self, message: str) -> Fault:
        """Return the fault of this part that a message of hertzlink's is about."""
        return fault_of(message, self.names())

    def make(self, world: World) -> Any:
        """Return the object of hertzlink's."""
        raise NotImplementedError

    def given(self, *without: str) -> dict[str, Any]:
        """Return the entries that have a value, by name, without some."""
        values = ((name, getattr(self, name)) for name in type(self).model_fields if name not in without)
        return {name: value for name, value in values if value is not None}


def made(part: Part, world: World, path: Path) -> Any:
    """Return what a part makes; raise a Fault where hertzlink refuses it, as `located` does."""
    return located(part, path, lambda: part.make(world))


class Remark(str):
    """A warning about an entry of a case, as text, with the fault that it would be."""

    fault: Fault


def located(part: Part, path: Path, make: Callable[[], Any]) -> Any:
    """Return what a function makes of a part; raise a Fault at its path, or at the entry that the message names.

    Warnings about an argument name its entry too.
    """

    def at(inner: Fault) -> Fault:
        return Fault((*path, *inner.path), inner.reason, inner.value)

    said: list[str] = []
    try:
        with collected() as said:
            return make()
    except ValueError as error:
        raise at(error if isinstance(error, Fault) else part.fault(str(error))) from error
    finally:
        for message in said:
            fault = message.fault if isinstance(message, Remark) else part.fault(OWNER.sub("", message))
            if fault.path:
                message = Remark(at(fault))
                message.fault = at(fault)
            caution(message)


def hint_of(model: type[BaseModel], name: str) -> str:
    """Return what to write for an entry, from its annotation."""
    field = model.model_fields[name]
    if field.description:
        return f"give {field.description}"
    units = [note for note in notes_of(field) if isinstance(note, Unit)]
    return units[0].hint if units else "give it"


def notes_of(field: Any) -> list[Any]:
    """Return what is noted on a field, and on the members of its type."""
    return [*field.metadata, *_inner_notes(field.annotation)]


def _inner_notes(annotation: Any) -> list[Any]:
    notes = []
    for inner in getattr(annotation, "__args__", ()):
        notes += [*getattr(inner, "__metadata__", ()), *_inner_notes(inner)]
    return notes


def forms(tell: Callable[[Any], str | None], message: str) -> Discriminator:
    """Return the entry that tells the forms apart; the message says which there are."""
    return Discriminator(tell, custom_error_type="form", custom_error_message=message)


def either(message: str = "", **members: tuple[Any, Any]) -> Any:
    """Return the type of an entry that has one of several forms, told apart by the types of their values.

    members: these types, and the type of the entry, by the name of the form; the last that suits counts. message: what
    is said of a value that has none of them.
    """

    def tell(value: Any) -> str | None:
        # True and False are no whole numbers.
        types = {name: kinds for name, (kinds, _) in members.items() if (kinds, type(value)) != (int, bool)}
        return next((name for name in reversed(types) if isinstance(value, types[name])), None)

    entries = tuple(Annotated[entry, Tag(name)] for name, (_, entry) in members.items())
    return Annotated[Union[entries], forms(tell, message)]  # noqa: UP007


class Round(Part):
    """A part with a radius, which may be given by its diameter."""

    radius: Length | None = None
    diameter: Length | None = None

    def fault(self, message: str) -> Fault:
        """Return the fault; of a radius at the diameter, where that stands in the case."""
        fault = super().fault(message)
        if self.diameter is None or fault.path != ("radius",):
            return fault
        reason = f"{self.diameter!r}: half of it{fault.reason.removeprefix(fault.value)}"
        return Fault(("diameter",), reason, repr(self.diameter))

    def its_radius(self) -> float:
        """Return m."""
        if (self.radius is None) == (self.diameter is None):
            name = "radius" if self.radius is None else "diameter"
            what = "is missing; give a radius or a diameter" if self.radius is None else "give radius or diameter alone"
            raise Fault((name,), f'{what}, such as diameter = "4.76 mm"')
        return self.radius if self.radius is not None else 0.5 * positive("diameter", float(self.diameter or 0.0), "m")


def names_file(entry: str, value: Any) -> bool:
    """Return whether the text of an entry names a file, relative to the file in which it stands."""
    if not isinstance(value, str):
        return False
    return entry in FILES or (entry in PERHAPS_FILES and ENDING.search(value) is not None)


def file_of(name: str, world: World, entry: str = "mesh") -> str:
    """Return the path of a file that a case names, relative to the case; raise a ValueError if it does not exist."""
    path = world.folder / File(name)
    if not path.is_file():
        raise ValueError(f'{entry}: there is no file "{path}"')
    return str(path)
