"""A table of a case as the call of a public function or class, read and checked by the annotations of its signature.

`read` turns a value of the file into what an annotation asks for: a number in SI units, a word, a material, a list, or
a `Call` for a table. It builds nothing; `Call.made` does.
"""

import math
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from decimal import Decimal
from functools import cached_property
from pathlib import Path as File
from typing import Any

from hertzlink.cases import Fault, Path, entry, shown
from hertzlink.cases.forms import OF_MATERIAL, Form, allowed, asked, example_of, hint_of
from plates.laminate import OrthotropicMaterial
from structures.caution import caution, collected
from structures.checks import MOST, count_of, near, nearest
from structures.described import Parameter
from structures.material import MATERIALS, name_key
from structures.quantities import Count, InFile, OneOf, Quantity
from structures.units import NUMBER, PARTS, factor

DEGREES = ("deg", "degree", "degrees", "°")  # converted as Python's math.radians does, to the last bit
KINDS = {int: "a whole number", bool: "true or false"}

# Names in messages about a point, and the entries to which they belong.
POINT: dict[str, Path] = {"x": ("at", 0), "y": ("at", 1), "x, y": ("at",), "x, y, face": ("face",)}


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
        """The object that the call makes; a refused argument raises a Fault."""
        own = {name: one for name, one in self.form.entries.items() if name not in self.form.common}
        arguments: dict[str, Any] = {name: None for name, one in own.items() if one.required}  # such as a thickness
        if "until" in own:
            arguments["until"] = self.context.until  # for objects that serve runs of a limited length
        if self.path[:1] == ("materials",) and "name" in own:
            arguments["name"] = str(self.path[-1])
        arguments |= {name: made(self.entries[name]) for name in own if name in self.entries}
        diameter = arguments.pop("diameter", None)
        if diameter is not None:
            arguments["radius"] = 0.5 * diameter
        with self.located(), collected() as said:
            thing = self.form.make(**arguments)
        for one in said:
            if diameter is not None and " radius = " in one:  # in the words of the case
                one = one.replace("radius", "diameter").replace(f"{0.5 * diameter:g}", f"{diameter:g}")
            caution(one)
        return thing

    def fault(self, message: str) -> Fault:
        """Return the fault of a message such as "thickness = -1: must be positive", in the words of the case."""
        head, _, reason = message.partition(": ")
        name, equals, value = (part.strip() for part in head.partition(" = "))
        name = name.split("[")[0].strip()
        half = name == "radius" and "diameter" in self.entries
        if half:
            name = "diameter"
        place = (name,) if name in self.form.entries else POINT.get(name, (name,))
        if not reason or place[0] not in self.form.entries:
            return Fault(self.path, message)
        typed = entry(self.typed, place)
        if name == "until" and typed is None:  # `until` comes from [run]
            return Fault(("run", "until"), f"{value} s{' ' if reason.startswith('must ') else ': '}{reason}")
        if not equals or typed is None or isinstance(typed, Mapping):
            reason = f"is missing; {reason}" if value == "None" else reason.rpartition("}: ")[2]
            return Fault((*self.path, *place), reason)

        # The reason in the words of the case: perhaps with another unit, and limits in the unit of the entry.
        quantity = self.form.entries[place[0]].quantity
        if quantity and isinstance(typed, int | float) and typed > quantity.likely[1]:
            reason += f'; did you mean "{typed:g} {quantity.above}"?'
        given = NUMBER.fullmatch(typed) if isinstance(typed, str) else None
        stated = re.search(r"(?:between \S+ and |, )\S+ (m|s|N)(?![\w/·²³])", reason)
        if given and given[2] and stated:
            size = float(factor(given[2], stated[1]))
            limit = re.sub(r"\d[\d.]*(e[-+]?\d+)?", lambda one: f"{float(one[0]) / size:.6g}", stated[0])
            reason = reason.replace(stated[0], limit.removesuffix(stated[1]) + given[2])
        value = shown(typed) if isinstance(typed, str) else value
        joined = ": half of it " if half else " " if reason.startswith(("must ", "exceeds ", "is ", "has ")) else ": "
        return Fault((*self.path, *place), f"{value}{joined}{reason}")

    @contextmanager
    def located(self, others: bool = True) -> Iterator[None]:
        """Turn errors into Faults of the entry that they name. others: those without a name are of the table."""
        try:
            yield
        except ValueError as error:
            fault = error if isinstance(error, Fault) else self.fault(str(error))
            raise fault if others or fault.path != self.path else error from error


def made(value: Any) -> Any:
    """Return a checked value with the object that each table makes in its place."""
    if isinstance(value, Call):
        return value.made
    if isinstance(value, dict):
        return {name: made(item) for name, item in value.items()}
    if not isinstance(value, list | tuple):
        return value
    # A bead in a list is repeated `count` times.
    beads = [isinstance(item, Call) and "count" in item.form.common for item in value]
    counts = [item.entries.get("count", 1) if bead else 1 for item, bead in zip(value, beads, strict=True)]
    return type(value)(made(item) for item, count in zip(value, counts, strict=True) for _ in range(count))


def read(value: Any, parameter: Parameter, path: Path, context: Context) -> Any:
    """Return the checked value that an annotation asks for; raise a Fault for any other value."""
    (tables, rows, values), asks = allowed(parameter), asked(parameter)
    if isinstance(value, dict) and tables:
        return _table(value, tables, path, context)
    if suited := [row for row in rows if isinstance(value, dict if row.make is dict else list)]:
        # Where a point and a list of points are allowed, a list of lists means the list of points.
        nested = bool(value) and isinstance(value, list) and isinstance(value[0], list)
        make, item, length = next((row for row in suited if bool(allowed(row.item).rows) == nested), suited[0])
        least = int(parameter.required) if length is None else length
        if not least <= len(value) <= (length or len(value)):
            many, hint = f"{'at least ' * (length is None)}{least}", hint_of(parameter)
            cure = "" if hint == "give it" else f"; {hint}"
            raise Fault(path, f"{shown(value)} has {count_of(len(value), 'entry')}; must have {many}{cure}")
        items = value.items() if isinstance(value, dict) else enumerate(value)
        done = {key: read(one, item, (*path, key), context) for key, one in items}
        return done if make is dict else make(done.values())

    fitting = [one for one in values if _fits(value, *one)]
    if fitting or (values and not asks):
        return _value(value, *(fitting or values)[-1], path, context)
    kind = isinstance(value, str) and value in tables.get("kind", {})
    what = asks or ("a list" if any(row.make is not dict for row in rows) else "a table")
    cure = f'; write {path[-1]} = {{ kind = "{value}" }}' if kind else ""
    raise Fault(path, f"{shown(value)} must be {what}{cure}")


def _table(table: dict[str, Any], tables: dict[str, dict[str, Form]], path: Path, context: Context) -> Call:
    """Return the call that a table describes."""
    tag = next((tag for tag in reversed(tables) if tag in table), next(iter(tables)))
    forms, word = tables[tag], table.get(tag)
    if not tag:
        form = max(forms.values(), key=lambda form: len({*form.entries} & {*table}))
    elif word is None:
        raise Fault((*path, tag), f"is missing; {nearest('', forms, 40)}")
    elif not isinstance(word, str) or word not in forms:
        cure = "" if near(word, forms) else "; one of your own needs --with FILE.py, which describes it"
        raise Fault((*path, tag), f"{shown(word)} is not a {tag}; {nearest(word, forms, 40)}{cure}")
    else:
        form = forms[word]
    names = [tag, *form.entries] if tag else [*form.entries]
    for name in table:
        if name not in names:
            other = {"distance": "at", "edge": "supports"}.get(name, name)  # as other plates call it
            raise Fault((*path, name), f"is not an entry here; {nearest(other if other in names else name, names, 20)}")
    given = {name: value for name, value in table.items() if value is not None and name in form.entries}
    entries = {name: read(value, form.entries[name], (*path, name), context) for name, value in given.items()}
    for name, parameter in form.entries.items():
        if parameter.required and not parameter.may_be_none and name not in entries:
            raise Fault((*path, name), f"is missing; {hint_of(parameter)}")
    if "diameter" in form.entries and len(sizes := [name for name in ("radius", "diameter") if name in entries]) != 1:
        what = "give radius or diameter, not both" if sizes else "is missing; give a radius or a diameter"
        raise Fault((*path, [*sizes, "radius"][len(sizes) // 2]), f'{what}, such as diameter = "4.76 mm"')
    call = Call(form, entries, path, table, context)
    if path[:1] == ("materials",) and len(path) == 2:
        context.materials[str(path[-1])] = call  # for all that follows
    return call


def _fits(value: Any, kind: Any, notes: Any) -> bool:
    """Return whether a value is of the kind that an annotation asks for."""
    if kind is Any and not any(isinstance(note, InFile) for note in notes):
        return True
    if isinstance(value, bool | int | float):
        return kind is type(value) or (kind is float and type(value) is int)
    return isinstance(value, str) and kind not in (int, bool)


def _value(value: Any, kind: Any, notes: tuple[Any, ...], path: Path, context: Context) -> Any:
    """Return a number, a word, a material or the path of a file."""
    if kind is float:
        any_number = Quantity(low=-math.inf)
        return number(value, next((note for note in notes if isinstance(note, Quantity)), any_number), path)
    fault, text, note_of = "", shown(value), {type(note): note for note in notes}
    if kind in OF_MATERIAL:
        # Materials of the case come before those of hertzlink.
        key, mine = name_key(value), context.materials.items()
        own = next((call for name, call in mine if name_key(name) == key), None)
        if not isinstance(value, str):
            fault = f'{text} must be the name of a material, such as "PTFE", or a table of its properties'
        elif own and own.form.target is OrthotropicMaterial and kind is not OrthotropicMaterial:
            fault = f"{text} is orthotropic; only plies take it"
        elif own or value in MATERIALS:
            return own or MATERIALS[value]
        else:
            fault = f"{text} is not a material; {nearest(value, [*context.materials, *MATERIALS])}"
    elif OneOf in note_of and value not in (words := note_of[OneOf].words):
        fault = f"{text} is not possible; {nearest(value, words)}"
    elif not _fits(value, kind, notes):
        fault = f"{text} must be {KINDS.get(kind, 'a text in quotes')}"
    elif InFile in note_of and not File(value).is_file():
        fault = f"there is no file {text} beside the file that names it"
    elif kind is int:
        count = note_of.get(Count, Count(-MOST))
        if not count.least <= value <= count.most:
            ends = f"least {count.least}" if value < count.least else f"most {count.most}"
            fault = f"{text} must be at {ends}"
    if fault:
        raise Fault(path, fault)
    return value


def number(typed: Any, quantity: Quantity, path: Path = ("",)) -> float:
    """Return a number in SI units within the range of its quantity; raise a Fault for any other."""
    unit = quantity.unit_in_files
    words = f"must be {quantity.noun}, such as {example_of(quantity)}" + (f", or a number in {unit}" if unit else "")
    match, value, fault = NUMBER.fullmatch(typed) if isinstance(typed, str) else None, math.inf, ""
    if isinstance(typed, int | float) and not isinstance(typed, bool):
        value = float(typed) if abs(typed) < 1e300 else math.inf
    elif match is None or match[2].startswith(","):
        comma = isinstance(typed, str) and re.search(r"\d,\d", typed)
        fault = f" {words}{'; write a decimal point' if comma else ''}"
    elif not match[2]:
        fault = f" {'has no unit; ' if unit else ''}{words}"
    else:
        plain = Decimal(match[1].replace("_", ""))
        try:
            if unit == "rad" and match[2] in DEGREES:
                value = math.radians(float(plain))
            elif not unit and match[2] in PARTS:
                value = float(plain * Decimal(repr(PARTS[match[2]])))
            else:
                value = float(plain * factor(match[2], unit))
        except ValueError as error:
            fault = f": {error}; {words}"
    if not math.isfinite(value):
        fault = fault or f" is not finite; {words}"
        raise Fault(path, shown(typed) + fault)
    try:
        quantity.check("", value)
    except ValueError as error:
        text = shown(typed) if isinstance(typed, str) else repr(value)
        raise Fault(path, f"{text} {str(error).partition(': ')[2]}") from None
    return value
