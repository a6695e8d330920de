"""A table of a case as the call of a public function or class, read and checked by the annotations of its signature.

`read` turns a value of the file into what an annotation asks for: a number in SI units, a word, a material, a list, or
a `Call` for a table. It builds nothing; `Call.made` does.
"""

import inspect
import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from decimal import Decimal
from functools import cached_property
from pathlib import Path as File
from typing import Any

from hertzlink.cases import Fault, Path, entry, shown
from hertzlink.cases.forms import OF_MATERIAL, PLACES, Allowed, Form, Row, allowed, asked, example_of, hint_of
from plates.laminate import OrthotropicMaterial
from structures.checks import MOST, count_of, nearest
from structures.described import Parameter
from structures.material import MATERIALS, name_key
from structures.quantities import Count, InFile, OneOf, Quantity
from structures.units import NUMBER, PARTS, factor

DEGREES = ("deg", "degree", "degrees", "°")
"""Converted as Python's math.radians does, to the last bit."""

ANY = Quantity(low=-math.inf)
"""The quantity of a number without a unit or a range."""


@dataclass
class Context:
    """What surrounds the tables of a case: its materials by name, and the length of its runs, s."""

    materials: dict[str, "Call"] = field(default_factory=dict)
    until: float = 1e-3


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

    @cached_property
    def made(self) -> Any:
        """What the call makes; a Fault where it is refused."""
        form = self.form
        arguments = {name: made(value) for name, value in self.entries.items() if name not in form.common}
        if "until" in form.entries:
            arguments.setdefault("until", self.context.until)  # of what serves runs of a limited length
        if self.path[:1] == ("materials",) and "name" in form.entries:
            arguments.setdefault("name", str(self.path[-1]))
        with self.located():
            if "diameter" in form.entries:
                given = [name for name in ("radius", "diameter") if name in arguments]
                if len(given) != 1:
                    what = "give radius or diameter alone" if given else "is missing; give a radius or a diameter"
                    raise ValueError(f'{(given or ["radius"])[-1]}: {what}, such as diameter = "4.76 mm"')
                if given == ["diameter"]:
                    arguments["radius"] = 0.5 * arguments.pop("diameter")
            for name, parameter in form.entries.items():
                if parameter.required and name not in form.common:
                    arguments.setdefault(name, None)  # as the thickness, which a laminate brings
            return form.special.make(**arguments) if form.special else form.target(**arguments)

    def inherits(self, name: str | int) -> bool:
        """Return whether an entry is that of the material which this one is like."""
        return self.form.target in OF_MATERIAL and name not in self.entries

    def fault(self, message: str) -> Fault:
        """Return the fault that a message such as "thickness = -1: must be positive" is about, in what a user wrote."""
        head, colon, reason = message.partition(": ")
        name, equals, value = (part.strip() for part in head.partition(" = "))
        name = name.split("[")[0].strip()
        half = name == "radius" and "diameter" in self.entries
        named = self.form.special.named if self.form.special else PLACES
        place = ("diameter",) if half else (name,) if name in self.form.entries else named.get(name, (name,))
        if not colon or place[0] not in self.form.entries:
            return Fault(self.path, message)
        typed = entry(self.typed, place)
        if not equals or typed is None:
            return Fault((*self.path, *place), f"is missing; {reason}" if equals and value == "None" else reason)

        # A limit is in the unit of what the user wrote.
        match = NUMBER.fullmatch(typed) if isinstance(typed, str) else None
        stated = re.search(r"(?:between \S+ and |, )\S+ (m|s|N)(?![\w/·²³])", reason)
        if match and match[2] and stated:
            size = float(factor(match[2], stated[1]))
            limit = re.sub(r"\d[\d.]*(e[-+]?\d+)?", lambda one: f"{float(one[0]) / size:.6g}", stated[0])
            reason = reason.replace(stated[0], limit.removesuffix(stated[1]) + match[2])
        joined = " " if reason.split(" ")[0] in ("must", "exceeds", "is", "has") else ": "
        value = f"{shown(typed)}: half of it" if half else shown(typed) if isinstance(typed, str) else value
        return Fault((*self.path, *place), f"{value}{joined}{reason}")

    @contextmanager
    def located(self) -> Iterator[None]:
        """Turn errors into Faults at the entry that they name."""
        try:
            yield
        except ValueError as error:
            raise error if isinstance(error, Fault) else self.fault(str(error)) from error


def made(value: Any) -> Any:
    """Return a checked value in which all tables are what they make."""
    if isinstance(value, Call):
        return value.made
    if isinstance(value, list | tuple):
        # A bead of a list stands for as many as its count.
        of_beads = (isinstance(item, Call) and "count" in item.form.common for item in value)
        counts = [item.entries.get("count", 1) if bead else 1 for item, bead in zip(value, of_beads, strict=True)]
        return type(value)(made(item) for item, count in zip(value, counts, strict=True) for _ in range(count))
    return {name: made(item) for name, item in value.items()} if isinstance(value, dict) else value


def read(value: Any, parameter: Parameter, path: Path, context: Context) -> Any:
    """Return the checked value that an annotation asks for; a Fault where it asks for another one."""
    may, asks = allowed(parameter), asked(parameter)
    if isinstance(value, dict) and (may.tagged or may.plain):
        return _table(value, may, path, context)
    if isinstance(value, dict) and may.mappings:
        if not value and parameter.required:
            raise Fault(path, f"is empty; {hint_of(parameter)}")
        item = replace(may.mappings[0], default=inspect.Parameter.empty)
        return {name: read(inner, item, (*path, name), context) for name, inner in value.items()}
    if isinstance(value, list) and may.lists:
        # Of a point and a list of points the nested one is meant by a list of lists.
        nested = bool(value) and isinstance(value[0], list)
        fits = (row for row in may.lists if row.item and bool(allowed(row.item).lists) == nested)
        return _list(value, next(fits, may.lists[0]), parameter, path, context)

    fitting = [pair for pair in may.single if _fits(value, *pair)]
    if not fitting and asks and sum(map(bool, (may.tagged or may.plain, may.lists, may.single))) > 1:
        raise Fault(path, f"{shown(value)} must be {asks}")
    if may.single:
        return _single(value, *(fitting or may.single)[-1], path, context)
    if not may.lists and isinstance(value, str) and value in may.tagged.get("kind", {}):
        raise Fault(path, f'"{value}" must be a table; write {path[-1]} = {{ kind = "{value}" }}')
    what = "list" if may.lists else "table"
    raise Fault(path, f"{shown(value)} must be a {what}" + (f"; give {asks}" if asks else ""))


def _table(table: dict[str, Any], may: Allowed, path: Path, context: Context) -> Call:
    """Return the call that a table means."""
    if may.tagged:
        tag = next((tag for tag in reversed(may.tagged) if tag in table), next(iter(may.tagged)))
        forms, word = may.tagged[tag], table.get(tag)
        if word is None:
            raise Fault((*path, tag), f"is missing; {nearest('', forms, 40)}")
        if not isinstance(word, str) or word not in forms:
            cure = "one of your own needs --with FILE.py that describes it"
            raise Fault((*path, tag), f"{shown(word)} is not a {tag}; {nearest(word, forms, 40)}; {cure}")
        form = forms[word]
    else:
        form = max(may.plain, key=lambda form: len({*form.entries} & {*table}))
    names = [form.tag, *form.entries] if form.tag else [*form.entries]
    for name in table:
        if name not in names:
            raise Fault((*path, name), f"is not an entry here; {nearest(name, names, 20)}")
    given = {name: value for name, value in table.items() if value is not None and name in form.entries}
    entries = {name: read(value, form.entries[name], (*path, name), context) for name, value in given.items()}
    for name, parameter in form.entries.items():
        if parameter.required and not parameter.may_be_none and name not in entries:
            raise Fault((*path, name), f"is missing; {hint_of(parameter)}")
    call = Call(form, entries, path, table, context)
    if path[:1] == ("materials",) and len(path) == 2:
        context.materials[str(path[-1])] = call  # for all that follows
    return call


def _list(value: list[Any], row: Row, parameter: Parameter, path: Path, context: Context) -> Any:
    """Return the entries of a list; of a tuple as many as it has."""
    make, item, count = row
    if item is None:
        return value
    least = int(parameter.required) if count is None else count
    if len(value) < least or (count is not None and len(value) > count):
        many, hint = f"{'at least ' if count is None else ''}{least}", hint_of(parameter)
        cure = "" if hint == "give it" else f"; {hint}"
        raise Fault(path, f"{shown(value)} has {count_of(len(value), 'entry')}; must have {many}{cure}")
    return make(read(one, item, (*path, i), context) for i, one in enumerate(value))


def _fits(value: Any, kind: Any, notes: Any) -> bool:
    """Return whether a value is of the kind that an annotation asks for."""
    if kind is Any and not notes:
        return True
    if isinstance(value, bool | int | float):
        return kind is type(value) or (kind is float and type(value) is int)
    return isinstance(value, str) and kind not in (int, bool)


def _single(value: Any, kind: Any, notes: Any, path: Path, context: Context) -> Any:
    """Return a number, a word, a material or the path of a file."""
    if kind in OF_MATERIAL:
        return _material(value, kind, path, context)
    if kind is float:
        return number(value, next((note for note in notes if isinstance(note, Quantity)), ANY), path)
    in_file = next((note for note in notes if isinstance(note, InFile)), None)
    words = next((note.words for note in notes if isinstance(note, OneOf)), None)
    if words and value not in words:
        raise Fault(path, f"{shown(value)} is not possible; {nearest(value, words)}")
    if not _fits(value, str if in_file else kind, ()):
        kinds = {int: "a whole number", bool: "true or false"}
        cure = f"; {in_file.text}" if in_file else ""
        raise Fault(path, f"{shown(value)} must be {kinds.get(kind, 'a text in quotes')}{cure}")
    if in_file and not File(value).is_file():
        raise Fault(path, f'there is no file "{value}" beside the file that names it')
    if kind is int:
        count = next((note for note in notes if isinstance(note, Count)), Count(-MOST))
        if not count.least <= value <= count.most:
            ends = f"least {count.least}" if value < count.least else f"most {count.most}"
            raise Fault(path, f"{shown(value)} must be at {ends}")
    return value


def _material(name: Any, kind: Any, path: Path, context: Context) -> Any:
    """Return the material of a name, those of the case first."""
    if not isinstance(name, str):
        words = 'must be the name of a material, such as "PTFE", or a table of its properties'
        raise Fault(path, f"{shown(name)} {words}")
    for own, call in context.materials.items():
        if name_key(own) == name_key(name):
            if call.form.target is OrthotropicMaterial and kind is not OrthotropicMaterial:
                raise Fault(path, f'"{name}" is orthotropic; only plies take it')
            return call
    if name not in MATERIALS:
        raise Fault(path, f'"{name}" is not a material; {nearest(name, [*context.materials, *MATERIALS])}')
    return MATERIALS[name]


def number(typed: Any, quantity: Quantity, path: Path = ("",)) -> float:
    """Return a number in SI units within the range of its quantity; a Fault for another one."""
    unit = quantity.unit_in_files
    words = f"must be {quantity.noun}, such as {example_of(quantity)}" + (f", or a number in {unit}" if unit else "")
    match = NUMBER.fullmatch(typed) if isinstance(typed, str) else None
    if isinstance(typed, int | float) and not isinstance(typed, bool):
        value = float(typed) if abs(typed) < 1e300 else math.inf
    elif match is None or match[2].startswith(","):
        comma = isinstance(typed, str) and re.search(r"\d,\d", typed)
        raise Fault(path, f"{shown(typed)} {words}{'; write a decimal point' if comma else ''}")
    elif not match[2]:
        raise Fault(path, f"{shown(typed)} {'has no unit; ' if unit else ''}{words}")
    else:
        plain = Decimal(match[1].replace("_", ""))
        try:
            degrees, part = unit == "rad" and match[2] in DEGREES, not unit and match[2] in PARTS
            size = Decimal(repr(PARTS[match[2]])) if part else 1 if degrees else factor(match[2], unit)
            value = math.radians(float(plain)) if degrees else float(plain * size)
        except ValueError as error:
            raise Fault(path, f"{shown(typed)}: {error}; {words}") from None
    if not math.isfinite(value):
        raise Fault(path, f"{shown(typed)} is not finite; {words}")

    half = path[-1] == "diameter" and value > 0.0
    try:
        quantity.check("", 0.5 * value if half else value)
    except ValueError as error:
        text = shown(typed) if isinstance(typed, str) else repr(value)
        raise Fault(path, f"{text}{': half of it' if half else ''} {str(error).partition(': ')[2]}") from None
    return value
