"""The entries of a table, from the annotations of the function or class that it calls."""

import inspect
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from functools import cache
from importlib import import_module
from pkgutil import resolve_name
from types import NoneType
from typing import Any, NamedTuple, get_args, get_origin

import numpy as np

from coupling.black_box import Scheme
from hertzlink._names import HOME, ROOMS, listed_in, namespaces
from hertzlink.cases import Path
from particles.bead import ATTRIBUTES, Bead
from particles.dissipation import Dissipation
from particles.excitation import Excitation
from particles.laws.law import ContactLaw
from particles.laws.yielding import YieldingLaw
from plates.laminate import Laminate, OrthotropicMaterial
from plates.plate import Plate
from plates.section import Section
from structures.damping import Viscous
from structures.described import Described, Parameter, description, noted, of_family, registered
from structures.material import Material
from structures.quantities import Asks, Quantity
from structures.structure import Structure

TAGS: dict[type, str] = {Bead: "shape"} | dict.fromkeys(
    (Structure, ContactLaw, Dissipation, Excitation, Scheme, Viscous, YieldingLaw), "kind"
)
"""The families of which a table is one member, and the entry that says which."""

OF_MATERIAL = (Material, OrthotropicMaterial)
"""Classes of which a text names one."""

BY_ENTRIES = (*OF_MATERIAL, Laminate, Section)
"""Classes of which a table says by its entries which one is meant, without a kind."""

PLACES: dict[str, Path] = {"x": ("at", 0), "y": ("at", 1), "x, y": ("at",), "x, y, face": ("face",)}
"""Names in messages about a point, and the entries to which they belong."""

SPECIAL: dict[Any, "Special"] = {}
"""What a table has besides the arguments of its target; `parts` fills it, and what follows."""

EXTRA: dict[type, dict[str, Any]] = {}
"""Members of families that are not found by what they make, by their kinds."""

COMMON: dict[type, dict[str, Parameter]] = {}
"""Entries of all that makes an object of a class, which are no arguments: they are read where the table stands."""


@dataclass(frozen=True)
class Of:
    """A note of an annotation: a table whose entries are the arguments of a function, or of one by "module:name"."""

    target: Any


class Special(NamedTuple):
    """How a table differs from the call of its target.

    make: takes the entries; its parameters are entries too. without: parameters of the target that have no entry.
    named: paths of entries to which names in messages belong. also: functions whose parameters are entries too.
    """

    make: Callable[..., Any]
    without: tuple[str, ...] = ()
    named: Mapping[str, Path] = PLACES
    also: tuple[Callable[..., Any], ...] = ()


def in_cases(*targets: Any, **settings: Any) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function as what makes the tables of some targets; settings are those of `Special`."""

    def register(make: Callable[..., Any]) -> Callable[..., Any]:
        SPECIAL.update(dict.fromkeys(targets, Special(make, **settings)))
        return make

    return register


@dataclass(frozen=True, eq=False)
class Form:
    """The entries of a table, and how what it means is made. common: entries that are no arguments."""

    target: Any
    kind: str
    tag: str
    entries: dict[str, Parameter]
    common: frozenset[str]
    special: Special | None


@cache
def form_of(target: Any, family: Any = None, kind: str = "") -> Form:
    """Return the form of the tables of a function or a class, by itself or as a member of a family."""
    of = description(target) or Described(target)
    entries = {name.rstrip("_"): parameter for name, parameter in of.parameters.items()}
    special = SPECIAL.get(target)
    if special is not None:
        for one in special.also:
            entries |= Described(one).parameters
        own = {name: one for name, one in Described(special.make).parameters.items() if name != "others"}
        for name, parameter in own.items():
            if parameter.type is Any and not parameter.notes and name in entries:
                own[name] = replace(entries[name], default=parameter.default)
        entries = own | {name: p for name, p in entries.items() if name not in (*own, *special.without)}
    radius = entries.get("radius")
    if radius is not None and radius.required:
        radius = replace(radius, default=None)
        entries |= {"radius": radius, "diameter": replace(radius, name="diameter")}
    bases = () if family is None or of.makes is NoneType else (family, *getattr(of.makes, "__mro__", ()))
    common = {name: one for base in COMMON if base in bases for name, one in COMMON[base].items()}
    tag = "" if family is None else TAGS[family]
    return Form(target, kind or of.kind, tag, entries | common, frozenset(common), special)


def members(family: type) -> dict[str, Form]:
    """Return the forms of a family by their kinds."""
    return _members(family, registered())


@cache
def _members(family: type, all_described: tuple[Described, ...]) -> dict[str, Form]:
    if family is Bead:
        targets = [of for of in all_described if inspect.isclass(of.target)]
        many = [of for of in targets if {*ATTRIBUTES} <= {*dir(of.target), *of.parameters}]
    elif family is Structure:
        many = [of for base in (Structure, Plate) for of in of_family(base) if of.builds]
    else:
        many = [*of_family(family)]
    found: dict[str, Described] = {}
    for of in many:
        first = found.get(of.kind)
        if first is not None and str(first.target.__module__).partition(".")[0] in ROOMS:
            place = getattr(sys.modules.get(of.target.__module__), "__file__", of.target.__module__)
            raise ValueError(f"{of.name} of {place}: hertzlink has this kind; give it another name")
        found[of.kind] = of
    forms = {kind: form_of(target, family, kind) for kind, target in EXTRA.get(family, {}).items()}
    for kind in sorted(found):
        forms |= dict.fromkeys((kind, *found[kind].also), form_of(found[kind].target, family))
    return forms


def entry_of(hint: Any, default: Any = inspect.Parameter.empty) -> Parameter:
    """Return what an annotation asks for, as a parameter without a name."""
    return Parameter("", *noted(hint), default, False)


class Row(NamedTuple):
    """A list that an annotation allows: what it becomes, its items (None: any numbers), and how many, if fixed."""

    make: type
    item: Parameter | None
    length: int | None


@dataclass
class Allowed:
    """What an annotation allows: tables with and without a kind, lists, tables of any names, and single values."""

    tagged: dict[str, dict[str, Form]] = field(default_factory=dict)
    plain: list[Form] = field(default_factory=list)
    lists: list[Row] = field(default_factory=list)
    mappings: list[Parameter] = field(default_factory=list)
    single: list[tuple[Any, tuple[Any, ...]]] = field(default_factory=list)


def allowed(parameter: Parameter) -> Allowed:
    """Return what the annotation of a parameter allows."""
    found = Allowed()
    for kind, notes in parameter.members or [(parameter.type, parameter.notes)]:
        origin, of = get_origin(kind), next((note.target for note in notes if isinstance(note, Of)), None)
        items = [entry_of(item, None) for item in get_args(kind) if item is not ...]
        if inspect.isclass(kind) and kind in TAGS:
            found.tagged.setdefault(TAGS[kind], {}).update(members(kind))
        elif of or (inspect.isclass(kind) and (is_dataclass(kind) or description(kind))):
            found.plain.append(form_of(resolve_name(of) if isinstance(of, str) else of or kind))
        # NDArray is an alias, whose origin is the alias itself from NumPy 2.5 on.
        if np.ndarray in (origin, get_origin(getattr(origin, "__value__", None))):
            found.lists.append(Row(list, None, None))
        elif inspect.isclass(origin) and issubclass(origin, Sequence):
            fixed = origin is tuple and ... not in get_args(kind)
            found.lists.append(Row(tuple if origin is tuple else list, items[-1], len(items) if fixed else None))
        elif inspect.isclass(origin) and issubclass(origin, Mapping) and not of:
            found.mappings.append(items[-1])
        elif kind in (float, int, str, bool, Any, *OF_MATERIAL):
            found.single.append((kind, notes))
    if len(found.plain) > 1 and not {form.target for form in found.plain} <= {*BY_ENTRIES}:
        found.tagged.setdefault("kind", {}).update({form.kind: replace(form, tag="kind") for form in found.plain})
        found.plain.clear()
    return found


def asked(parameter: Parameter) -> str:
    """Return the words that ask for an entry."""
    return next((note.text for note in parameter.notes if isinstance(note, Asks)), "")


def hint_of(parameter: Parameter) -> str:
    """Return what to write for an entry, from its annotation."""
    if asks := asked(parameter):
        return f"give {asks}"
    if Material in (parameter.type, *(kind for kind, _ in parameter.members)):
        return 'give a material, such as "aluminium 6061"'
    if (quantity := parameter.quantity) is None:
        return "give it"
    unit, example = quantity.unit_in_files, example_of(quantity)
    return f'give {quantity.noun}, such as "{example}", or a number in {unit}' if unit else f"give {quantity.noun}"


def example_of(quantity: Quantity) -> str:
    """Return a number as a case has it; a quantity of a user's own may have no example."""
    plain = quantity.example == Quantity.example
    return f"{quantity.example} {quantity.unit_in_files}".strip() if plain else quantity.example


# To import a module describes its parts. Names are read from the files of type checkers: to import all would load all.
for _file in (HOME / "__init__.pyi", *(HOME / f"{name}.py" for name in namespaces())):
    for _module in sorted(set(listed_in(_file).values())):
        if _module.partition(".")[0] in ROOMS[:3]:
            import_module(_module)
