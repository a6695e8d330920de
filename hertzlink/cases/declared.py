"""The way from a described class or function to its table in a case, and to the object that the table means."""

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from inspect import getdoc, isclass
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

import numpy as np
from pydantic import Discriminator, Field, create_model

from coupling.black_box import Scheme
from hertzlink import _described as _described  # for what they describe
from hertzlink._rooms import ROOMS
from hertzlink.cases.entry_paths import Path
from hertzlink.cases.parts import Part, Round, World, either, file_of, made
from hertzlink.cases.units import Unit
from particles.bead import ATTRIBUTES, Bead
from particles.dissipation import Dissipation
from particles.excitation import Excitation
from particles.laws.law import ContactLaw
from particles.laws.yielding import YieldingLaw
from structures.checks import MOST
from structures.damping import Viscous
from structures.described import Described, Parameter, description, noted, of_family, registered
from structures.quantities import Asks, Count, InFile, OneOf, Quantity

Data = dict[str, Any]

EMPTY: Mapping[Any, Any] = {}

MOST_BEADS = 100_000


@dataclass(frozen=True)
class Form:
    """The form of a value in a case: the type of its entry, and the argument that an entry means.

    build takes the entry, the case around it and its path.
    """

    entry: Any
    build: Callable[[Any, World, Path], Any] = lambda value, world, path: value


TAGS: Mapping[type, str] = {Bead: "shape"}
"""The entry that says which of a family a table is, where it is not `kind`."""

SPECIAL: dict[Any, type["Declared"]] = {}
"""What a table has in addition to the parameters of some classes and functions; the modules of the tables fill it."""

FORMS: dict[Any, Form] = {}
"""The forms of types that a case spells in several ways; the modules of the tables fill it."""

FAMILIES = (Bead, ContactLaw, Dissipation, Excitation, Scheme, Viscous, YieldingLaw)


class Declared(Part):
    """A table whose entries are the parameters of what is described.

    optional: parameters that a table may leave out though they are required, and what a message says of them. without:
    those that have no entry, because others stand for them. apart: those whose entries `make` reads itself. named_so:
    the table's name in the schema, where it is not that of what is described.
    """

    of: ClassVar[Described]
    named_so: ClassVar[str] = ""
    apart: ClassVar[tuple[str, ...]] = ()
    optional: ClassVar[Mapping[str, str]] = EMPTY
    without: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def others(cls) -> Data:
        """Further entries, whose types follow from what is described when the table is made."""
        return {}

    def make(self, world: World) -> Any:
        return self.of.target(**self.arguments(world))

    def arguments(self, world: World) -> Data:
        """Return the arguments that the entries mean."""
        entries = self.given()
        if isinstance(self, Round):
            entries["radius"] = self.its_radius()
        if "until" in self.of.parameters:
            entries.setdefault("until", world.until)  # a structure that serves runs of a limited length
        forms = {name: form for name, form in forms_of(self.of).items() if name in entries and name not in self.apart}
        return {name: form.build(entries[name], world, (name,)) for name, form in forms.items()}


class Counted(Declared):
    """A bead; `count` of them in a list of beads."""

    count: Annotated[int, Field(ge=1, le=MOST_BEADS)] = 1


@cache
def table_of(of: Described, tag: str = "", base: type[Declared] = Declared) -> type[Part]:
    """Return the model of the table. tag: the entry that says what it is, "kind" or "shape"; base: what it has in
    addition."""
    fields: dict[str, Any] = {tag: (Literal[(of.kind, *of.also)], ...)} if tag else {}
    hidden = {*base.model_fields, *base.without} - {*base.optional}
    fields |= {name: field_of(parameter) for name, parameter in of.parameters.items() if name not in hidden}
    fields |= base.others()
    bases: tuple[type[Part], ...] = (base,)
    for name, asks in base.optional.items():
        fields[name] = (fields[name][0] | None, Field(None, description=asks or None))
    radius = of.parameters.get("radius")
    if radius is not None and radius.required:
        bases, _ = (*bases, Round), fields.pop("radius", None)
    first_sentence = " ".join((getdoc(of.target) or "").partition("\n\n")[0].split())
    texts = (base.named_so, base.__doc__) if base.named_so else (of.name, first_sentence)
    model: Any = create_model(texts[0], __base__=bases, __doc__=texts[1], __module__=__name__, **fields)
    model.of = of
    model_of_table: type[Part] = model
    return model_of_table


def members(family: type) -> list[Described]:
    """Return what is described and may stand where one of a family is asked for."""
    if family is not Bead:
        return list(of_family(family))
    classes = [entry for entry in registered() if isclass(entry.target)]
    return [entry for entry in classes if {*ATTRIBUTES} <= {*dir(entry.target), *entry.parameters}]


def union_of(*families: type) -> Any:
    """Return the type of an entry that holds one of some families with the same tag."""
    tag, base = TAGS.get(families[0], "kind"), Counted if Bead in families else Declared
    return union(tables_of([entry for family in families for entry in members(family)], tag, base), tag)


def union(tables: Iterable[type[Part]], tag: str = "kind") -> Any:
    """Return the type of an entry that holds one of some tables, and says by its tag which."""
    return Annotated[Union[tuple(tables)], Discriminator(tag)]  # noqa: UP007


def tables_of(many: Iterable[Described], tag: str = "kind", base: type[Declared] = Declared) -> list[type[Part]]:
    """Return the models of parts that stand at one place; raise a ValueError where a user's has the kind of one of
    hertzlink's.

    Of two parts of the same kind that a user described the last one counts. base: what the tables have in addition,
    other than those that SPECIAL names.
    """
    by_kind: dict[str, Described] = {}
    for described in many:
        first = by_kind.get(described.kind)
        if first is not None and str(first.target.__module__).partition(".")[0] in ROOMS:
            place = getattr(sys.modules.get(described.target.__module__), "__file__", described.target.__module__)
            raise ValueError(f"{described.name} of {place}: hertzlink has this kind; give it another name")
        by_kind[described.kind] = described
    return [table_of(by_kind[kind], tag, SPECIAL.get(by_kind[kind].target, base)) for kind in sorted(by_kind)]


def forget_tables() -> None:
    """Forget tables that may hold others: what is described since may stand in them too."""
    table_of.cache_clear()
    forms_of.cache_clear()


def quantity_of(target: Any, name: str) -> Unit:
    """Return the unit of a parameter, for an entry that stands for it."""
    quantity = described_by(target).parameters[name].quantity
    assert quantity is not None
    return Unit.of(quantity)


def described_by(target: Any) -> Described:
    """Return the description of what has one."""
    of = description(target)
    assert of is not None
    return of


def field_of(parameter: Parameter) -> tuple[Any, Any]:
    """Return the entry of a parameter. A number other than zero that a case leaves out is for the builder to choose."""
    entry = _form(parameter.type, parameter.notes, int(parameter.required)).entry
    asks = next((note.text for note in parameter.notes if isinstance(note, Asks)), None)
    if parameter.required:
        return entry, Field(description=asks) if asks else ...
    if isinstance(parameter.default, str | bool) or parameter.default == 0.0:
        return entry, Field(parameter.default, description=asks)
    if parameter.default == ():
        return entry, Field(default_factory=list, description=asks)
    return entry | None, Field(None, description=asks)


@cache
def forms_of(of: Described) -> dict[str, Form]:
    """Return the forms of all parameters."""
    return {name: _form(parameter.type, parameter.notes) for name, parameter in of.parameters.items()}


def _form(kind: Any, notes: Sequence[Any] = (), least: int = 0) -> Form:
    # least: entries of a list.
    for note in notes:
        if isinstance(note, Quantity):
            return Form(Annotated[float, Unit.of(note)])
        if isinstance(note, OneOf):
            return Form(Literal[note.words])
        if isinstance(note, Count):
            most = note.most if note.most < MOST else None
            return Form(Annotated[int, Field(ge=note.least, le=most)])
        if isinstance(note, InFile):
            return Form(str, lambda value, world, path: file_of(value, world, str(path[-1])))
    if kind is float:
        return Form(Annotated[float, Unit.of(Quantity())])
    if kind in FORMS:
        return FORMS[kind]
    if kind in FAMILIES:
        return Form(union_of(kind), made)
    if get_origin(kind) is Union:
        return _either([noted(member) for member in get_args(kind)], notes)
    of, origin = description(kind) if isclass(kind) else None, get_origin(kind)
    if of is not None:
        return Form(table_of(of), made)
    if isclass(origin) and issubclass(origin, Sequence):
        return _list(kind, least)
    # NDArray is an alias, whose origin is the alias itself from NumPy 2.5 on.
    if np.ndarray in (origin, get_origin(getattr(origin, "__value__", None))):
        return Form(list[list[float]])
    if isclass(origin) and issubclass(origin, Mapping):
        inner = _form(*noted(get_args(kind)[1]))
        return Form(
            dict[str, inner.entry],  # type: ignore[name-defined]
            lambda value, world, path: {name: inner.build(item, world, (*path, name)) for name, item in value.items()},
        )
    return Form(kind)


def _either(members: Sequence[tuple[Any, Any]], notes: Sequence[Any]) -> Form:
    """Return of a union: one of several tables, a word or a table, or else the first member that a case can hold."""
    families = [kind for kind, _ in members if kind in FAMILIES]
    if len({TAGS.get(family, "kind") for family in families}) == 1:
        return Form(union_of(*families), made)
    kinds = [description(kind) if isclass(kind) and kind not in FORMS else None for kind, _ in members]
    if all(kinds):
        return Form(union(tables_of(filter(None, kinds))), made)
    table = next(filter(None, kinds), None)
    listed = next((kind for kind, _ in members if get_origin(kind) is Sequence), None)
    if listed is not None and members[0][0] in (float, int):
        return Form(either(one=(object, _form(*members[0]).entry), many=(list, _list(listed, 1).entry)))
    words = next((notes for _, notes in members if any(isinstance(note, OneOf) for note in notes)), None)
    if words is None or table is None:
        plain = all(kind in (str, int) for kind, _ in members)
        return Form(Union[tuple(kind for kind, _ in members)]) if plain else _form(*members[0])  # noqa: UP007
    choices = [word for note in words if isinstance(note, OneOf) for word in note.words]
    model = table_of(table)
    asks = next((note.text for note in notes if isinstance(note, Asks)), f"{', '.join(map(repr, choices))} or a table")
    return Form(
        either(f"must be {asks}", word=(str, Literal[tuple(choices)]), table=(dict | Part, model)),
        lambda value, world, path: value if isinstance(value, str) else made(value, world, path),
    )


def _list(kind: Any, least: int) -> Form:
    """Return of a sequence: any number of entries, or of a tuple as many as it has."""
    members = [member for member in get_args(kind) if member is not ...]
    inner = _form(*noted(members[0]))
    count = len(members) if get_origin(kind) is tuple and ... not in get_args(kind) else None

    def build(value: Any, world: World, path: Path) -> Any:
        items = [inner.build(item, world, (*path, i)) for i, item in enumerate(value)]
        return tuple(items) if get_origin(kind) is tuple else items

    return Form(
        Annotated[list[inner.entry], Field(min_length=count or least, max_length=count)],  # type: ignore[name-defined]
        build,
    )
