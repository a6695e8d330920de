"""A case file and what it extends, as one tree of data, with the place of each entry."""

import tomllib
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path as File
from typing import Any

from hertzlink.cases.faults import CaseError, Fault
from hertzlink.cases.lines import lines_of
from hertzlink.cases.paths import Path, parsed, put, written

DEEPEST = 10
"""Files that extend each other."""

LARGEST = 1_000_000
"""B of a file; the longest force history fits."""

KINDS = ("kind", "shape")
"""Entries that say what a table is: one of another kind replaces the whole table of the file that is extended."""


@dataclass
class Source:
    """The data of a case, and where they come from.

    name: the file, as the user typed it. places: path → what a message begins with, such as "case.toml:12".
    """

    data: dict[str, Any]
    name: str
    folder: File
    places: dict[Path, str] = field(default_factory=dict)

    def error(self, fault: Fault) -> CaseError:
        """The fault with its place: that of the deepest entry on its path."""
        path = fault.path
        while path and path not in self.places:
            path = path[:-1]
        place = self.places.get(path, self.name) if path else self.name
        return CaseError(f"{place}: {fault}")


def read_source(path: str | File, changes: Iterable[str] = ()) -> Source:
    """Read a case file with what it extends, and apply changes of the form path=value; a CaseError for faults."""
    source = _read(str(path), File(path), ())
    for change in changes:
        _apply(source, change)
    return source


def _read(name: str, path: File, above: tuple[File, ...]) -> Source:
    try:
        if path.is_dir():
            raise CaseError(f"{name}: is a folder; give a case file")
        if path.stat().st_size > LARGEST:
            raise CaseError(f"{name}: has more than {LARGEST:.0e} bytes; is it a case file?")
        text = path.read_text(encoding="utf-8")
        data = tomllib.loads(text)
    except FileNotFoundError:
        raise CaseError(f"{name}: there is no such file; `hertzlink new rod case.toml` writes a first one") from None
    except OSError as error:
        raise CaseError(f"{name}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise CaseError(f"{name}: is no text in UTF-8; is it a case file?") from None
    except tomllib.TOMLDecodeError as error:
        raise CaseError(_syntax(name, str(error))) from None
    except RecursionError:
        raise CaseError(f"{name}: is nested too deeply") from None
    places = {at: f"{name}:{line}" for at, line in lines_of(text).items()}
    own = Source(data, name, path.resolve().parent, places)
    if "extends" not in data:
        return own
    base = data.pop("extends")
    if not isinstance(base, str) or not base:
        raise own.error(Fault(("extends",), 'must be the name of a case file, such as "plate.toml"'))
    file = path.parent / base
    if len(above) >= DEEPEST or file.resolve() in (*above, path.resolve()):
        raise own.error(Fault(("extends",), f'"{base}" leads back to this file; a case cannot extend itself'))
    if not file.is_file():
        raise own.error(Fault(("extends",), f'there is no file "{base}" in {path.parent}'))
    shown = str(File(name).parent / base)
    below = _read(shown, file, (*above, path.resolve()))
    return Source(_merged(below.data, data), name, below.folder, _kept(below.places, below.data, data) | places)


def _syntax(name: str, message: str) -> str:
    """What tomllib says, with its line where lines stand."""
    words, _, place = message.partition(" (at line ")
    line = place.split(",")[0]
    return f"{name}:{line}: {words}; is no TOML" if line.isdigit() else f"{name}: {words}; is no TOML"


def _replaces(base: Any, own: Any) -> bool:
    """Whether an entry replaces the one of the file below, instead of adding to it."""
    if not isinstance(base, Mapping) or not isinstance(own, Mapping):
        return True
    return any(name in own and own[name] != base.get(name) for name in KINDS)


def _merged(base: dict[str, Any], own: Mapping[str, Any]) -> dict[str, Any]:
    found = deepcopy(base)
    for name, value in own.items():
        found[name] = deepcopy(value) if _replaces(found.get(name), value) else _merged(found[name], value)
    return found


def _kept(places: Mapping[Path, str], base: Any, own: Mapping[str, Any]) -> dict[Path, str]:
    """The places of the file below, without those of entries that are replaced."""
    kept = dict(places)
    for name, value in own.items():
        if name not in base:
            continue
        inner = {at[1:]: place for at, place in kept.items() if at[:1] == (name,)}
        kept = {at: place for at, place in kept.items() if at[:1] != (name,)}
        if not _replaces(base[name], value):
            kept |= {(name, *at): place for at, place in _kept(inner, base[name], value).items()}
    return kept


def _apply(source: Source, change: str) -> None:
    """Apply path=value, as given to --set."""
    name, equals, text = change.partition("=")
    place = f"--set {change}"
    if not equals:
        raise CaseError(f'{place}: has no "="; write --set structure.thickness="1 mm"')
    try:
        path = parsed(name.strip())
    except ValueError as error:
        raise CaseError(f"{place}: {error}") from None
    try:
        value = tomllib.loads(f"value = {text.strip()}")["value"] if "\n" not in text else text
    except (tomllib.TOMLDecodeError, KeyError):
        value = text.strip()  # as a shell leaves it of "1 mm"
    if path == ("extends",):
        raise CaseError(f"{place}: a change cannot extend another case")
    try:
        put(source.data, path, value)
    except ValueError as error:
        raise CaseError(f"{place}: {error}") from None
    for at in [at for at in source.places if at[: len(path)] == path]:
        del source.places[at]
    source.places[path] = f"--set {written(path)}"
