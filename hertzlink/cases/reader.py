"""A table of a case as the call of a public function or class, read and checked by the annotations of its signature.

`read` turns a value of the file into what an annotation asks for: a number in SI units, a word, a material, a list, or
a `Call` for a table. It builds nothing; `Call.made` does.
"""

import inspect
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from pathlib import Path as File
from typing import Any, get_args, get_origin

from hertzlink.cases.forms import (
    OF_MATERIAL,
    Form,
    alternatives,
    asked,
    example_of,
    forms_at,
    hint_of,
    is_array,
    is_list,
    items_of,
)
from hertzlink.cases.paths import Fault, Path, entry, shown
from plates.laminate import OrthotropicMaterial
from structures.caution import caution, collected
from structures.checks import MOST, count_of, nearest
from structures.described import Parameter, noted
from structures.material import MATERIALS, name_key
from structures.quantities import Count, InFile, OneOf, Quantity
from structures.units import NUMBER, factor

OWNER = re.compile(r"^.* (?=[\w\[\]-]+ = )")
"""What stands before the argument in a warning about its value: "Section thickness = 2: is read as 2 m"."""

DEGREES = ("deg", "degree", "degrees", "°")
"""Converted as Python's math.radians does, to the last bit."""

A_MATERIAL = 'the name of a material, such as "PTFE", or a table of its properties'


@dataclass
class Context:
    """What surrounds the tables of a case: its materials by name, its folder, and the length of its runs, s."""

    folder: File
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
        reason = in_unit_of(typed, reason)
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


def in_unit_of(typed: Any, reason: str) -> str:
    """Return a reason that names a range, "between 0 and 0.3 m", in the unit of what the user wrote."""
    unit = match[2] if isinstance(typed, str) and (match := NUMBER.fullmatch(typed)) else ""
    stated = re.search(r"between (\S+) and (\S+) (m|s|N)\b", reason)
    if not unit or stated is None:
        return reason
    low, high = (f"{float(end) / float(factor(unit, stated[3])):.6g}" for end in stated.groups()[:2])
    return reason.replace(stated[0], f"between {low} and {high} {unit}")


def made(value: Any) -> Any:
    """Return a checked value in which all tables are what they make."""
    if isinstance(value, Call):
        return value.made
    if isinstance(value, list | tuple):
        return type(value)(made(item) for item in value)
    return {name: made(item) for name, item in value.items()} if isinstance(value, dict) else value


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
