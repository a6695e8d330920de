"""A table of a case as the call of a public function or class, read and checked by the annotations of its signature.

`read` turns a value of the file into what an annotation asks for: a number in SI units, a word, a material, a list, or
a `Call` for a table. It builds nothing; `Call.made` does.
"""

import inspect
import math
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, is_dataclass, replace
from decimal import Decimal
from functools import cache, cached_property
from pathlib import Path as File
from types import NoneType
from typing import Any, NamedTuple, Union, get_args, get_origin

import numpy as np

from hertzlink import _described as _described  # for what they describe
from hertzlink._rooms import ROOMS
from hertzlink.cases.paths import Fault, Path, entry, shown
from particles.bead import ATTRIBUTES, Bead
from plates.laminate import Laminate, OrthotropicMaterial
from plates.plate import Plate
from plates.section import Section
from structures.caution import caution, collected
from structures.checks import MOST, count_of, nearest
from structures.described import Described, Parameter, description, noted, of_family, registered
from structures.material import MATERIALS, Material, name_key
from structures.quantities import Asks, Count, InFile, OneOf, Quantity
from structures.structure import Structure
from structures.units import NUMBER, factor

TAGS: dict[type, str] = {Bead: "shape"}
"""The families of which a table is one member, and the entry that says which; `parts` adds the others."""

SPECIAL: dict[Any, "Special"] = {}
"""What a table has besides the arguments of its target; `parts` fills it."""

EXTRA: dict[type, dict[str, Any]] = {}
"""Members of families that are not found by what they make, by their kinds."""

COMMON: dict[type, Any] = {}
"""Functions whose parameters are entries of all members of a family, which are read where the table stands."""

OF_MATERIAL = (Material, OrthotropicMaterial)
"""Classes of which a text names one."""

BY_ENTRIES = (*OF_MATERIAL, Laminate, Section)
"""Classes of which a table says by its entries which one is meant, without a kind."""

OWNER = re.compile(r"^.* (?=[\w\[\]-]+ = )")
"""What stands before the argument in a warning about its value: "Section thickness = 2: is read as 2 m"."""

DEGREES = ("deg", "degree", "degrees", "°")
"""Converted as Python's math.radians does, to the last bit."""

A_MATERIAL = 'the name of a material, such as "PTFE", or a table of its properties'


@dataclass(frozen=True)
class Of:
    """A note of an annotation: a table whose entries are the arguments of a function."""

    target: Any


class Special(NamedTuple):
    """How a table differs from the call of its target.

    make: takes the Call and the entries; its parameters are entries too. without: parameters of the target that have no
    entry. named: paths of entries to which names in messages belong.
    """

    make: Callable[..., Any]
    without: tuple[str, ...] = ()
    named: Mapping[str, Path] = {}


def in_cases(
    *targets: Any, without: tuple[str, ...] = (), named: Mapping[str, Path] | None = None
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Register a function as what makes the tables of some targets; see `Special`."""

    def register(make: Callable[..., Any]) -> Callable[..., Any]:
        SPECIAL.update(dict.fromkeys(targets, Special(make, without, named or {})))
        return make

    return register


@dataclass
class Context:
    """What surrounds the tables of a case: its materials by name, its folder, and the length of its runs, s."""

    folder: File
    materials: dict[str, "Call"] = field(default_factory=dict)
    until: float = 1e-3


@dataclass(frozen=True, eq=False)
class Form:
    """The entries of a table, and how what it means is made. common: entries that are no arguments."""

    target: Any
    kind: str
    tag: str
    entries: dict[str, Parameter]
    common: frozenset[str]
    special: Special | None

    @property
    def names(self) -> list[str]:
        """The names of all entries."""
        return [*([self.tag] if self.tag else []), *self.entries]

    @property
    def makes(self) -> Any:
        """The class of what is made."""
        return Described(self.target).makes


@dataclass(eq=False)
class Call:
    """A table of a case: what is called, and the checked arguments, SI. typed: the table as it is written."""

    form: Form
    entries: dict[str, Any]
    path: Path
    typed: Mapping[str, Any]
    context: Context

    def __repr__(self) -> str:
        return f"{self.form.kind}({self.entries!r})"

    @property
    def target(self) -> Any:
        """The function or class."""
        return self.form.target

    @property
    def kind(self) -> str:
        """Its name in case files."""
        return self.form.kind

    @cached_property
    def made(self) -> Any:
        """What the call makes; a Fault where it is refused."""
        arguments = {name: made(value) for name, value in self.entries.items() if name not in self.form.common}
        if "diameter" in self.form.entries:
            given = [name for name in ("radius", "diameter") if name in arguments]
            if len(given) != 1:
                what = "give radius or diameter alone" if given else "is missing; give a radius or a diameter"
                raise self.refused((given or ["radius"])[-1], f'{what}, such as diameter = "4.76 mm"')
            if given == ["diameter"]:
                arguments["radius"] = 0.5 * arguments.pop("diameter")
        if "until" in self.form.entries:
            arguments.setdefault("until", self.context.until)  # of what serves runs of a limited length
        with self.located():
            if self.form.special:
                return self.form.special.make(self, **arguments)
            return self.form.target(**arguments)

    def refused(self, name: str, reason: str) -> Fault:
        """Return the fault of an entry."""
        return Fault((*self.path, name), reason)

    def fault(self, message: str) -> Fault:
        """Return the fault that a message such as "thickness = -1: must be positive" is about; of the table where it
        names no entry. It shows the value as it is written."""
        head, colon, reason = message.partition(": ")
        name, equals, value = head.partition(" = ")
        name = name.split("[")[0].strip()
        named: Mapping[str, Path] = self.form.special.named if self.form.special else {}
        if not colon or name not in [*self.form.entries, *named]:
            return Fault(self.path, message)
        half = name == "radius" and "diameter" in self.entries
        place = ("diameter",) if half else named.get(name, (name,))
        if not equals:
            return Fault((*self.path, *place), reason)
        typed = entry(self.typed, place)
        joined = " " if reason.split(" ")[0] in ("must", "exceeds", "is", "has") else ": "
        value = f"{shown(typed)}: half of it" if half else shown(typed) if isinstance(typed, str) else value
        return Fault((*self.path, *place), f"{value}{joined}{reason}")

    @contextmanager
    def located(self) -> Iterator[None]:
        """Turn errors into Faults at the entry that they name, and give warnings its path."""
        said: list[str] = []
        try:
            with collected() as said:
                yield
        except ValueError as error:
            raise error if isinstance(error, Fault) else self.fault(str(error)) from error
        finally:
            for message in said:
                fault = self.fault(OWNER.sub("", message))
                named = not isinstance(message, Remark) and fault.path != self.path
                caution(Remark(fault) if named else message)


class Remark(str):
    """A warning that names its entry."""


def made(value: Any) -> Any:
    """Return a checked value in which all tables are what they make."""
    if isinstance(value, Call):
        return value.made
    if isinstance(value, list | tuple):
        return type(value)(made(item) for item in value)
    return {name: made(item) for name, item in value.items()} if isinstance(value, dict) else value


@cache
def form_of(target: Any, family: Any = None, kind: str = "") -> Form:
    """Return the form of the tables of a function or a class, by itself or as a member of a family."""
    of = description(target) or Described(target)
    entries = {name.rstrip("_"): parameter for name, parameter in of.parameters.items()}
    special = SPECIAL.get(target)
    if special is not None:
        own = _own(special.make)
        for name, parameter in own.items():
            if parameter.type is Any and not parameter.notes and name in entries:
                own[name] = replace(entries[name], default=parameter.default)
        entries = own | {name: p for name, p in entries.items() if name not in (*own, *special.without)}
    radius = entries.get("radius")
    if radius is not None and radius.required:
        radius = replace(radius, default=None)
        entries |= {"radius": radius, "diameter": replace(radius, name="diameter")}
    common = _own(COMMON[family]) if family in COMMON and of.makes is not NoneType else {}
    tag = "" if family is None else TAGS[family]
    return Form(target, kind or of.kind, tag, entries | common, frozenset(common), special)


def _own(function: Any) -> dict[str, Parameter]:
    parameters = Described(function).parameters
    return {name: p for name, p in parameters.items() if name not in ("call", "others")}


def members(family: type) -> dict[str, Form]:
    """Return the forms of a family by their kinds."""
    return _members(family, registered())


@cache
def _members(family: type, all_described: tuple[Described, ...]) -> dict[str, Form]:
    if family is Bead:
        many = [
            of
            for of in all_described
            if inspect.isclass(of.target) and {*ATTRIBUTES} <= {*dir(of.target), *of.parameters}
        ]
    elif family is Structure:
        many = [of for of in (*of_family(Structure), *of_family(Plate)) if of.builds]
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


def forms_at(kinds: Sequence[tuple[Any, Sequence[Any]]]) -> tuple[dict[str, dict[str, Form]], list[Form]]:
    """Return the forms that a table may have, by tag and kind, and those without a kind."""
    tagged: dict[str, dict[str, Form]] = {}
    plain: list[Form] = []
    for kind, notes in kinds:
        of = next((note.target for note in notes if isinstance(note, Of)), kind)
        if inspect.isclass(kind) and kind in TAGS:
            tagged.setdefault(TAGS[kind], {}).update(members(kind))
        elif of is not kind or (inspect.isclass(kind) and (is_dataclass(kind) or description(kind))):
            plain.append(form_of(of))
    if len(plain) > 1 and not {form.target for form in plain} <= {*BY_ENTRIES}:
        tagged.setdefault("kind", {}).update({form.kind: replace(form, tag="kind") for form in plain})
        plain = []
    return tagged, plain


def alternatives(kind: Any, notes: Sequence[Any]) -> list[tuple[Any, tuple[Any, ...]]]:
    """Return the types that an annotation allows, each with its notes."""
    if get_origin(kind) is not Union:
        return [(kind, tuple(notes))]
    return [pair for member in get_args(kind) for pair in alternatives(*noted(member))]


def is_list(kind: Any) -> bool:
    """Return whether an annotation asks for a list: a sequence, a tuple or an array."""
    origin = get_origin(kind)
    # NDArray is an alias, whose origin is the alias itself from NumPy 2.5 on.
    return is_array(kind) or (inspect.isclass(origin) and issubclass(origin, Sequence))


def is_array(kind: Any) -> bool:
    """Return whether an annotation asks for an array."""
    origin = get_origin(kind)
    return np.ndarray in (origin, get_origin(getattr(origin, "__value__", None)))


def items_of(kind: Any) -> tuple[Any, int | None]:
    """Return the annotation of the entries of a list, and how many a tuple has."""
    items = [item for item in get_args(kind) if item is not ...]
    return items[0], len(items) if get_origin(kind) is tuple and ... not in get_args(kind) else None


def hint_of(parameter: Parameter) -> str:
    """Return what to write for an entry, from its annotation."""
    if asks := asked(parameter.notes):
        return f"give {asks}"
    if any(kind is Material for kind, _ in alternatives(parameter.type, parameter.notes)):
        return 'give a material, such as "aluminium 6061"'
    quantity = next((note for note in parameter.notes if isinstance(note, Quantity)), None)
    if quantity is None:
        return "give it"
    unit, example = quantity.unit_in_files, example_of(quantity)
    return f'give {quantity.noun}, such as "{example}", or a number in {unit}' if unit else f"give {quantity.noun}"


def asked(notes: Sequence[Any]) -> str:
    """Return the words that ask for an entry."""
    return next((note.text for note in notes if isinstance(note, Asks)), "")


def example_of(quantity: Quantity) -> str:
    """Return a number as a case has it; a quantity of a user's own may have no example."""
    plain = quantity.example == Quantity.example
    return f"{quantity.example} {quantity.unit_in_files}".strip() if plain else quantity.example


def read(value: Any, parameter: Parameter, path: Path, context: Context) -> Any:
    """Return the checked value that an annotation asks for; a Fault where it asks for another one."""
    kinds = alternatives(parameter.type, parameter.notes)
    tagged, plain = forms_at(kinds)
    lists = [kind for kind, _ in kinds if is_list(kind)]
    mapping = next(
        (kind for kind, _ in kinds if inspect.isclass(get_origin(kind)) and issubclass(get_origin(kind), Mapping)), None
    )
    if isinstance(value, dict) and (tagged or plain):
        return _table(value, tagged, plain, path, context)
    if isinstance(value, dict) and mapping is not None:
        inner = _parameter(get_args(mapping)[1], inspect.Parameter.empty)
        return {name: read(item, inner, (*path, name), context) for name, item in value.items()}
    if isinstance(value, list) and lists:
        # Of a point and a list of points the nested one is meant by a list of lists.
        nested = bool(value) and isinstance(value[0], list)
        kind = next((kind for kind in lists if is_list(noted(items_of(kind)[0])[0]) == nested), lists[0])
        return _list(value, kind, parameter, path, context)

    asks = asked(parameter.notes)
    plains = [(kind, notes) for kind, notes in kinds if _is_plain(kind, notes)]
    fitting = [pair for pair in plains if _fits(value, *pair)]
    if not fitting and asks and sum(map(bool, (tagged or plain, lists, plains))) > 1:
        raise Fault(path, f"{shown(value)} must be {asks}")
    if plains:
        return _plain(value, *(fitting or plains)[-1], path, context)
    if lists:
        raise Fault(path, f"{shown(value)} must be a list" + (f"; give {asks}" if asks else ""))
    if isinstance(value, str) and value in tagged.get("kind", {}):
        raise Fault(path, f'"{value}" must be a table; write {path[-1]} = {{ kind = "{value}" }}')
    raise Fault(path, f"{shown(value)} must be a table" + (f"; give {asks}" if asks else ""))


def _parameter(hint: Any, default: Any = None) -> Parameter:
    return Parameter("", *noted(hint), default, False)


def _table(
    table: dict[str, Any], tagged: dict[str, dict[str, Form]], plain: list[Form], path: Path, context: Context
) -> Call:
    """Return the call that a table means."""
    if tagged:
        tag = next((tag for tag in reversed(tagged) if tag in table), next(iter(tagged)))
        forms, word = tagged[tag], table.get(tag)
        if word is None:
            raise Fault((*path, tag), f"is missing; {nearest('', forms, 40)}")
        if not isinstance(word, str) or word not in forms:
            cure = "one of your own needs --with FILE.py that describes it"
            raise Fault((*path, tag), f"{shown(word)} is no {tag}; {nearest(word, forms, 40)}; {cure}")
        form = forms[word]
    else:
        form = max(plain, key=lambda form: len({*form.entries} & {*table}))
    for name in table:
        if name not in form.names:
            raise Fault((*path, name), f"is no entry here; {nearest(name, form.names, 20)}")
    entries = {
        name: read(value, form.entries[name], (*path, name), context)
        for name, value in table.items() if value is not None and name in form.entries
    }  # fmt: skip
    for name, parameter in form.entries.items():
        if parameter.required and name not in entries:
            raise Fault((*path, name), f"is missing; {hint_of(parameter)}")
    return Call(form, entries, path, table, context)


def _list(value: list[Any], kind: Any, parameter: Parameter, path: Path, context: Context) -> Any:
    """Return the entries of a list; of a tuple as many as it has."""
    if is_array(kind):
        return value
    item, count = items_of(kind)
    least = count if count is not None else int(parameter.required)
    if len(value) < least or (count is not None and len(value) > count):
        many = f"{'' if count is not None else 'at least '}{least}"
        hint = hint_of(parameter)
        raise Fault(
            path,
            f"{shown(value)} has {count_of(len(value), 'entry')}; must have {many}"
            + (f"; {hint}" if hint != "give it" else ""),
        )
    inner = _parameter(item)
    items = [read(one, inner, (*path, i), context) for i, one in enumerate(value)]
    return tuple(items) if get_origin(kind) is tuple else items


def _is_plain(kind: Any, notes: Sequence[Any]) -> bool:
    """Return whether an annotation asks for a number, a word or a name."""
    noted_so = any(isinstance(note, Quantity | OneOf | Count | InFile) for note in notes)
    return noted_so or kind in (float, int, str, bool, Any, *OF_MATERIAL)


def _fits(value: Any, kind: Any, notes: Sequence[Any]) -> bool:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    if kind is float:
        return is_number or isinstance(value, str)
    if kind is int:
        return is_number and isinstance(value, int)
    if kind is bool:
        return isinstance(value, bool)
    return isinstance(value, str) or (kind is Any and not notes)


def _plain(value: Any, kind: Any, notes: Sequence[Any], path: Path, context: Context) -> Any:
    """Return a number, a word, a material or the path of a file."""
    for note in notes:
        if isinstance(note, OneOf) and value not in note.words:
            raise Fault(path, f"{shown(value)} is not possible; {nearest(value, note.words)}")
        if isinstance(note, InFile) and isinstance(value, str):
            file = context.folder / File(value)
            if not file.is_file():
                raise Fault(path, f'there is no file "{file}"')
            return str(file)
        if isinstance(note, InFile):
            raise Fault(path, f"{shown(value)} must be a text in quotes; {note.text}")
    if kind is float:
        quantity = next((note for note in notes if isinstance(note, Quantity)), Quantity(low=-math.inf))
        return _number(value, quantity, path)
    if kind in OF_MATERIAL:
        return _material(value, kind, path, context)
    if kind is int:
        count = next((note for note in notes if isinstance(note, Count)), Count(-MOST))
        if not isinstance(value, int) or isinstance(value, bool):
            raise Fault(path, f"{shown(value)} must be a whole number")
        if not count.least <= value <= count.most:
            at_end = f"least {count.least}" if value < count.least else f"most {count.most}"
            raise Fault(path, f"{shown(value)} must be at {at_end}")
    elif (kind is str and not isinstance(value, str)) or (kind is bool and not isinstance(value, bool)):
        raise Fault(path, f"{shown(value)} must be {'a text in quotes' if kind is str else 'true or false'}")
    return value


def _material(name: Any, kind: Any, path: Path, context: Context) -> Any:
    """Return the material of a name, those of the case first."""
    if not isinstance(name, str):
        raise Fault(path, f"{shown(name)} must be {A_MATERIAL}")
    for own, call in context.materials.items():
        if name_key(own) == name_key(name):
            if call.target is OrthotropicMaterial and kind is not OrthotropicMaterial:
                raise Fault(path, f'"{name}" is orthotropic; only plies take it')
            return call
    if name not in MATERIALS:
        raise Fault(path, f'"{name}" is no material; {nearest(name, [*context.materials, *MATERIALS])}')
    return MATERIALS[name]


def number(typed: Any, quantity: Quantity) -> float:
    """Return a number in SI units; raise a ValueError for what is none."""
    unit = quantity.unit_in_files
    words = f"must be {quantity.noun}, such as {example_of(quantity)}" + (f", or a number in {unit}" if unit else "")
    if isinstance(typed, int | float) and not isinstance(typed, bool):
        try:
            value = float(typed)
        except OverflowError:
            value = math.inf
    else:
        match = NUMBER.fullmatch(typed) if isinstance(typed, str) else None
        if match is None or match[2].startswith(","):
            comma = isinstance(typed, str) and re.search(r"\d,\d", typed)
            raise ValueError(f"{shown(typed)} {words}{'; write a decimal point' if comma else ''}")
        plain, its_unit = Decimal(match[1].replace("_", "")), match[2]
        if not its_unit:
            raise ValueError(f"{shown(typed)} {'has no unit; ' if unit else ''}{words}")
        try:
            degrees = unit == "rad" and its_unit in DEGREES
            value = math.radians(float(plain)) if degrees else float(plain * factor(its_unit, unit))
        except ValueError as error:
            raise ValueError(f"{shown(typed)}: {error}; {words}") from None
    if not math.isfinite(value):
        raise ValueError(f"{shown(typed)} is not finite; {words}")
    return value


def _number(typed: Any, quantity: Quantity, path: Path) -> float:
    """Return a number in SI units, within the range of its quantity."""
    try:
        value = number(typed, quantity)
    except ValueError as error:
        raise Fault(path, str(error)) from None
    half = path[-1] == "diameter" and value > 0.0
    try:
        quantity.check("", 0.5 * value if half else value)
    except ValueError as error:
        text = shown(typed) if isinstance(typed, str) else repr(value)
        reason = str(error).partition(": ")[2]
        raise Fault(path, f"{text}{': half of it' if half else ''} {reason}") from None
    return value


def step(at: Any, part: str | int) -> Any:
    """Return the value at an entry, or a property of a material; None where there is none."""
    if isinstance(at, Call):
        if part in at.entries or at.target not in OF_MATERIAL:
            return at.entries.get(str(part))
        return getattr(at.made, str(part), None)
    if isinstance(at, Mapping):
        return at.get(part)
    if isinstance(at, list | tuple):
        return at[part] if isinstance(part, int) and part < len(at) else None
    return getattr(at, str(part), None) if isinstance(at, OF_MATERIAL) else None
