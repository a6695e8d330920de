"""The entries of a table, from the annotations of the function or class that it calls."""

import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, is_dataclass, replace
from functools import cache
from importlib import import_module
from math import inf
from pkgutil import resolve_name
from typing import Any, NamedTuple, get_args, get_origin

import numpy as np

from hertzlink._names import HOME, ROOMS, listed_in, namespaces
from particles.bead import ATTRIBUTES, Bead
from plates.laminate import OrthotropicMaterial
from structures.described import Described, Parameter, description, noted, registered
from structures.material import Material
from structures.quantities import Asks, Quantity

# Classes whose objects a text may name. Their tables, and other tables in their place, differ by their entries.
OF_MATERIAL = (Material, OrthotropicMaterial)


class Family(NamedTuple):
    """A class with several kinds of tables, its members.

    tag: the entry that names the member. common: entries of all members that are not arguments; the table around reads
    them. others: members that do not return the class; they lack the common entries.
    """

    tag: str = "kind"
    common: Mapping[str, Parameter] = {}
    others: Mapping[str, Any] = {}


# What `parts` declares.
FAMILIES: dict[Any, Family] = {}
SPECIAL: dict[Any, tuple[Callable[..., Any], Sequence[str], Sequence[Callable[..., Any]]]] = {}


def in_cases(
    target: Any, without: Sequence[str] = (), also: Sequence[Callable[..., Any]] = ()
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function that makes the tables of a target from their entries; its parameters are entries too.

    without: parameters of the target that have no entry. also: functions whose parameters are entries as well.
    """

    def register(make: Callable[..., Any]) -> Callable[..., Any]:
        SPECIAL[target] = make, without, also
        return make

    return register


@dataclass(frozen=True)
class Of:
    """A note in an annotation: a table whose entries are the arguments of a function, or of that at "module:name"."""

    target: Any


@dataclass(frozen=True, eq=False)
class Form:
    """The entries of a table, and the function that takes them. common: entries that are not arguments."""

    target: Any
    make: Callable[..., Any]
    kind: str
    tag: str
    entries: dict[str, Parameter]
    common: Mapping[str, Parameter]


@cache
def form_of(target: Any, family: Any = None, kind: str = "") -> Form:
    """Return the form of the tables of a target, alone or in a family. kind: that of a member of `others`."""
    of = description(target) or Described(target)
    make, without, also = SPECIAL.get(target) or (target, (), ())
    entries = {name.rstrip("_"): parameter for name, parameter in of.parameters.items()}
    for one in also:
        entries |= Described(one).parameters
    if make is not target:
        own = {name: one for name, one in Described(make).parameters.items() if name != "others"}
        for name, parameter in own.items():
            if parameter.type is Any and not parameter.notes and name in entries:
                own[name] = replace(entries[name], default=parameter.default)
        entries = own | {name: one for name, one in entries.items() if name not in (*own, *without)}
    radius = entries.get("radius")
    if radius is not None and radius.required:
        # The valid range is that of the radius.
        notes = (replace(one, low=0.0, high=inf) if isinstance(one, Quantity) else one for one in radius.notes)
        entries["radius"] = replace(radius, default=None)
        entries["diameter"] = replace(radius, name="diameter", default=None, notes=tuple(notes))
    of_family = FAMILIES[family] if family else Family(tag="")
    common = {} if kind else of_family.common
    return Form(target, make, kind or of.kind, of_family.tag, entries | dict(common), common)


@cache
def members(family: type, all_described: tuple[Described, ...]) -> dict[str, Form]:
    """Return the forms of a family by their kinds."""
    if family is Bead:
        classes = [of for of in all_described if inspect.isclass(of.target)]
        many = [of for of in classes if {*ATTRIBUTES} <= {*dir(of.target), *of.parameters}]
    else:
        builders = [of for of in all_described if of.builds and inspect.isclass(of.makes)]
        many = [of for of in builders if family in of.makes.__mro__ and not inspect.isabstract(of.makes)]
    found: dict[str, Described] = {}
    for of in many:
        first = found.setdefault(of.kind, of)
        if first is not of and str(first.target.__module__).partition(".")[0] in ROOMS:
            place = getattr(sys.modules.get(of.target.__module__), "__file__", of.target.__module__)
            raise ValueError(f"{of.name} of {place}: hertzlink has this kind; give it another name")
        found[of.kind] = of
    forms = {kind: form_of(target, family, kind) for kind, target in FAMILIES[family].others.items()}
    for kind in sorted(found):
        forms |= dict.fromkeys((kind, *found[kind].also), form_of(found[kind].target, family))
    return forms


def entry_of(hint: Any, default: Any = inspect.Parameter.empty) -> Parameter:
    """Return what an annotation asks for, as a parameter without a name."""
    return Parameter("", *noted(hint), default, False)


class Row(NamedTuple):
    """A list, or a table with any names, that an annotation allows: its type, its items, and their number if fixed."""

    make: type
    item: Parameter
    length: int | None = None


class Allowed(NamedTuple):
    """What an annotation allows: tables by their tag ("" without one) and kind, lists, and values with their notes."""

    tables: dict[str, dict[str, Form]]
    rows: list[Row]
    values: list[tuple[Any, tuple[Any, ...]]]


def allowed(parameter: Parameter) -> Allowed:
    """Return what the annotation of a parameter allows."""
    tables, rows, values = found = Allowed({}, [], [])
    for kind, notes in parameter.members or [(parameter.type, parameter.notes)]:
        origin, arguments = get_origin(kind), [one for one in get_args(kind) if one is not ...]
        of = next((note.target for note in notes if isinstance(note, Of)), None)
        if kind in FAMILIES:
            forms, before = members(kind, registered()), tables.setdefault(FAMILIES[kind].tag, {})
            if twice := sorted(forms.keys() & before.keys()):
                raise ValueError(f"{twice[0]}: hertzlink has this kind; give yours another name")
            before.update(forms)
        elif of or (inspect.isclass(kind) and (is_dataclass(kind) or description(kind))):
            form = form_of(resolve_name(of) if isinstance(of, str) else of or kind)
            tables.setdefault("", {})[form.kind] = form
        # NDArray is an alias, whose origin is the alias itself from NumPy 2.5 on.
        elif np.ndarray in (origin, get_origin(getattr(origin, "__value__", None))):
            rows.append(Row(list, entry_of(Any, None)))
        elif inspect.isclass(origin) and issubclass(origin, Sequence):
            fixed = len(arguments) if origin is tuple and ... not in get_args(kind) else None
            rows.append(Row(tuple if origin is tuple else list, entry_of(arguments[-1], None), fixed))
        elif inspect.isclass(origin) and issubclass(origin, Mapping):
            rows.append(Row(dict, entry_of(arguments[-1])))
        if kind in (float, int, str, bool, Any, *OF_MATERIAL):
            values.append((kind, notes))
    plain = tables.get("", {})
    if len(plain) > 1 and not any(form.target in OF_MATERIAL for form in plain.values()):
        tables["kind"] = {kind: replace(form, tag="kind") for kind, form in tables.pop("").items()}
    return found


def asked(parameter: Parameter) -> str:
    """Return the words that ask for an entry."""
    return next((note.text for note in parameter.notes if isinstance(note, Asks)), "")


def hint_of(parameter: Parameter) -> str:
    """Return a hint on what to write for an entry, from its annotation."""
    if asks := asked(parameter):
        return f"give {asks}"
    if Material in (parameter.type, *(kind for kind, _ in parameter.members)):
        return 'give a material, such as "aluminium 6061"'
    if (quantity := parameter.quantity) is None:
        return "give it"
    unit, example = quantity.unit_in_files, example_of(quantity)
    return f'give {quantity.noun}, such as "{example}", or a number in {unit}' if unit else f"give {quantity.noun}"


def example_of(quantity: Quantity) -> str:
    """Return a number as a case writes it; a quantity of a user's own may have no example."""
    plain = quantity.example == Quantity.example
    return f"{quantity.example} {quantity.unit_in_files}".strip() if plain else quantity.example


# Importing a module describes its parts. The names are read from stub files: importing all would load all.
for _file in (HOME / "__init__.pyi", *(HOME / f"{name}.py" for name in namespaces())):
    for _module in sorted(set(listed_in(_file).values())):
        if _module.partition(".")[0] in ROOMS[:3]:
            import_module(_module)
