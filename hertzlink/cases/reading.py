"""A case file and what it extends, as one tree of data, with the place of each entry."""

import os
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from math import isclose, isnan, nan
from pathlib import Path as File
from typing import Any

from coupling.files.loading import read_text
from hertzlink.cases.entry_paths import Path, entry, has, parsed, put, written
from hertzlink.cases.faults import CaseError, Fault
from hertzlink.cases.lines import lines_of
from hertzlink.cases.parts import names_file
from structures.checks import short
from structures.units import in_si

DEEPEST = 10
"""Files that extend each other."""

LARGEST = 1_000_000
"""B of a file; the longest force history fits."""

KINDS = ("kind", "shape")
"""Entries that say what a table is: one of another kind replaces the whole table of the file that is extended."""


CHANGE = "--set"
"""The place of an entry that the command line changes."""

SECTIONS_OF_RANGES: tuple[Path, ...] = (("sweep",), ("identify", "unknowns"))
"""Sections that give values to entries, by their paths."""


@dataclass
class Source:
    """The data of a case, and where they come from.

    name: the file, as the user typed it. places: path → what a message begins with, such as "case.toml:12", or CHANGE.
    """

    data: dict[str, Any]
    name: str
    folder: File
    places: dict[Path, str] = field(default_factory=dict)

    def error(self, fault: Fault) -> CaseError:
        """Return the fault with its place, that of the deepest entry on its path, and with the value as the user typed
        it."""
        path, reason = self._typed(fault)
        at = path
        while at and at not in self.places:
            at = at[:-1]
        place = self.places.get(at, self.name) if at else self.name
        return CaseError(f"{place}{' ' if place == CHANGE else ': '}{Fault(path, reason)}")

    def _typed(self, fault: Fault) -> tuple[Path, str]:
        """Return where the user typed the value, and the reason with what was typed: at the path, or else as one of the
        values that a sweep or a fit gives this path."""
        value, words = _number(fault.value), fault.reason.removeprefix(fault.value)
        for path in (fault.path, *self._ranges(fault.path)):
            text = entry(self.data, path) if has(self.data, path) else None
            if isinstance(text, str) and isclose(value, in_si(text), rel_tol=1e-9):
                return path, f'"{text}"{words}'
        return fault.path, fault.reason

    def _ranges(self, path: Path) -> Iterator[Path]:
        """Yield the paths of values that sections give to a path."""
        for section in SECTIONS_OF_RANGES:
            ranges = entry(self.data, section) if has(self.data, section) else {}
            for key, values in ranges.items() if isinstance(ranges, dict) else ():
                if key == written(path):
                    names = (
                        values if isinstance(values, dict) else range(len(values) if isinstance(values, list) else 0)
                    )
                    yield from ((*section, key, name) for name in names)


QUOTED = re.compile(r""""(?:[^"\\]|\\.)*"|'[^']*'""")

MEASURED = re.compile(r"(?<![\w.])[-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)? ?[A-Za-zµμΩ°][\wµμΩ°·*/^²³⁴]*")
"""A number with a unit."""

COMMA = re.compile(r"= *([-+]?\d+,\d+(?:[eE][-+]?\d+)?) *$")
"""A number with a decimal comma."""

WORD = re.compile(r"= *(?!true\b|false\b|inf\b|nan\b)([A-Za-z_][\w .-]*?) *(?=$|[,}\]])")
"""A text."""


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return nan


def read_source(path: str | File, changes: Iterable[str] = ()) -> Source:
    """Read a case file with what it extends, and apply changes of the form path=value; a CaseError for faults."""
    source = _read(str(path), File(path), ())
    for change in changes:
        _apply(source, change)
    return source


def _read(name: str, path: File, above: tuple[File, ...]) -> Source:
    text = _text(name, path)
    try:
        data = tomllib.loads(text)
    except RecursionError:
        raise CaseError(f"{name}: is nested too deeply") from None
    except ValueError as error:  # of what is no TOML, or of a number with thousands of digits
        raise CaseError(_syntax(name, str(error), text)) from None
    data = _with_whole_paths(data, path.resolve().parent)
    places = {at: f"{name}:{line}" for at, line in lines_of(text).items()}
    source = Source(data, name, path.resolve().parent, places)
    if "extends" not in data:
        return source
    base, without = data.pop("extends"), data.pop("without", [])
    if not isinstance(base, str) or not base:
        raise source.error(Fault(("extends",), 'must be the name of a case file, such as "plate.toml"'))
    file = path.parent / base
    if len(above) >= DEEPEST or file.resolve() in (*above, path.resolve()):
        raise source.error(Fault(("extends",), f'"{base}" leads back to this file; a case cannot extend itself'))
    if not file.is_file():
        raise source.error(Fault(("extends",), f'there is no file "{base}" in {path.parent}'))
    shown = str(File(name).parent / base)
    below = _read(shown, file, (*above, path.resolve()))
    for i, name in enumerate(without if isinstance(without, list) else [without]):
        if not isinstance(name, str) or not _removed(below, name):
            raise source.error(Fault(("without", i), f'{short(name)} is no entry of "{base}", such as "sweep"'))
    return Source(_merged(below.data, data), name, below.folder, _kept(below.places, below.data, data) | places)


def _removed(source: Source, name: str) -> bool:
    """Remove an entry of a table, and return whether there was one."""
    try:
        path = parsed(name)
        table = entry(source.data, path[:-1])
        del table[str(path[-1])]
    except (KeyError, TypeError, ValueError):  # also for an entry of a list, which is written again as a whole
        return False
    source.places = {at: place for at, place in source.places.items() if at[: len(path)] != path}
    return True


def _text(name: str, path: File) -> str:
    try:
        if path.is_dir():
            raise CaseError(f"{name}: is a folder; give a case file")
        text = read_text(path, LARGEST)
    except FileNotFoundError:
        raise CaseError(f"{name}: there is no such file; `hertzlink new rod case.toml` writes a first one") from None
    except OSError as error:
        raise CaseError(f"{name}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise CaseError(f"{name}: is no text in UTF-8; is it a case file?") from None
    if text is None:
        raise CaseError(f"{name}: has more than {LARGEST:.0e} bytes; is it a case file?")
    return text


def _with_whole_paths(data: dict[str, Any], folder: File) -> dict[str, Any]:
    """Return same with the full paths of files: a case that extends this one, or a result, may lie in another folder.

    A file that is not there yet is reported where it is used; one whose name is no UTF-8 cannot stand in results.
    """

    def whole(value: Any, name: str) -> Any:
        if isinstance(value, dict):
            # The entry of a sweep is a path, such as "structure.mesh".
            return {key: whole(item, key.rpartition(".")[2]) for key, item in value.items()}
        if isinstance(value, list):
            return [whole(item, name) for item in value]
        if not names_file(name, value):
            return value
        path = os.path.abspath(os.path.join(folder, os.path.expanduser(value)))
        if os.fsencode(path).decode("utf-8", "replace") != path:
            raise CaseError(f"{path}: is no name in UTF-8, so results could not hold it; give the file another name")
        return path

    moved: dict[str, Any] = whole(data, "")
    return moved


def _syntax(name: str, message: str, text: str) -> str:
    """Return what tomllib says, with its line where lines stand, and what to write where a value was typed without
    quotes."""
    words, _, place = message.partition(" (at line ")
    line = place.split(",")[0]
    if not line.isdigit():
        return f"{name}: {words}; is no TOML"
    typed = QUOTED.sub("", (text.splitlines() or [""])[int(line) - 1]).partition("#")[0]
    return f"{name}:{line}: {_cure(typed) or f'{words}; is no TOML'}"


def _cure(line: str) -> str:
    """Return what to write for a value that is no TOML, in a line without what stands in quotes; empty where none
    is."""
    if comma := COMMA.search(line):
        return f"{comma[1]} is no number; write {comma[1].replace(',', '.')}"
    if word := WORD.search(line):
        right = word[1].lower() if word[1] in ("True", "False") else f'"{word[1]}" in quotes'
        return f"{word[1]} is no value of TOML; write {right}"
    for match in MEASURED.finditer(line):
        if not isnan(in_si(match[0])):
            return f'{match[0]} is no value of TOML; write "{match[0]}" in quotes'
    return ""


def _replaces(base: Any, above: Any) -> bool:
    """Return whether an entry replaces the one of the file below, instead of adding to it."""
    if not isinstance(base, Mapping) or not isinstance(above, Mapping):
        return True
    return any(name in above and above[name] != base.get(name) for name in KINDS)


def _merged(base: dict[str, Any], above: Mapping[str, Any]) -> dict[str, Any]:
    merged = deepcopy(base)
    for name, value in above.items():
        merged[name] = deepcopy(value) if _replaces(merged.get(name), value) else _merged(merged[name], value)
    return merged


def _kept(places: Mapping[Path, str], base: Any, above: Mapping[str, Any]) -> dict[Path, str]:
    """Return the places of the file below, without those of entries that are replaced."""
    kept_places = dict(places)
    for name, value in above.items():
        if name not in base:
            continue
        inner = {at[1:]: place for at, place in kept_places.items() if at[:1] == (name,)}
        kept_places = {at: place for at, place in kept_places.items() if at[:1] != (name,)}
        if not _replaces(base[name], value):
            kept_places |= {(name, *at): place for at, place in _kept(inner, base[name], value).items()}
    return kept_places


def _apply(source: Source, change: str) -> None:
    """Apply path=value, as given to --set."""
    name, equals, text = change.partition("=")
    place = f"{CHANGE} {change}"
    if not equals:
        raise CaseError(f'{place}: has no "="; write --set structure.thickness="1 mm"')
    try:
        path = parsed(name.strip())
    except ValueError as error:
        raise CaseError(f"{place}: {error}") from None
    try:
        value = tomllib.loads(f"value = {text.strip()}")["value"] if "\n" not in text else text
    except (KeyError, ValueError):
        value = text.strip()  # as a shell leaves it of "1 mm"
    value = _with_whole_paths({str(path[-1]): value}, File.cwd())[str(path[-1])]
    if path == ("extends",):
        raise CaseError(f"{place}: a change cannot extend another case")
    try:
        put(source.data, path, value)
    except ValueError as error:
        raise CaseError(f"{place}: {error}") from None
    for at in [at for at in source.places if at[: len(path)] == path]:
        del source.places[at]
    source.places[path] = CHANGE
