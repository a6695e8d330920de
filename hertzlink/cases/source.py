"""A case file and what it extends, as one tree of data, with the line of each entry."""

import os
import re
import tomllib
from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import dataclass
from itertools import count
from math import isnan
from pathlib import Path as File
from typing import Any

from hertzlink.cases.paths import CaseError, Fault, Path, entry, parsed, put
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

FILES = ("mesh",)
"""Entries that name files."""

PERHAPS_FILES = ("mass", "stiffness", "damping_matrix", "contact", "frequencies", "response")
"""Entries that name files where their text ends as a file's name does: "plate.mtx", but not "2.5 g"."""

WORD = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}(?!")'
    r"|'''.*?'{3,5}(?!')"
    r'|"(?:\\.|[^"\\])*"'
    r"|'[^']*'"
    r"|[\[\]{},=.\n]|[^\s\[\]{},=.#\"']+"
    r"|(?P<none>[^\S\n]+|#[^\n]*)",
    re.DOTALL,
)
"""Of TOML: a text, a mark, a line break, or a piece of a key or a value; nothing for blanks and comments."""


@dataclass
class Source:
    """The data of a case, and where they come from.

    name: the file, as the user typed it. places: path → what a message begins with, such as "case.toml:12", or CHANGE.
    """

    data: dict[str, Any]
    name: str
    folder: File
    places: dict[Path, str]

    def error(self, fault: Fault) -> CaseError:
        """Return the fault with its place, that of the deepest entry on its path."""
        at = fault.path
        while at and at not in self.places:
            at = at[:-1]
        place = self.places.get(at, self.name)
        return CaseError(f"{place}{' ' if place == CHANGE else ': '}{fault}")


def read_source(path: str | File, changes: Iterable[str] = ()) -> Source:
    """Read a case file with what it extends, and apply changes of the form path=value; a CaseError for faults."""
    source = _read(str(path), File(path), ())
    for change in changes:
        _apply(source, change)
    return source


def _read(name: str, path: File, above: tuple[File, ...]) -> Source:
    text, folder = _text(name, path), path.resolve().parent
    try:
        data = _with_whole_paths(tomllib.loads(text), folder, "")
    except RecursionError:
        raise CaseError(f"{name}: is nested too deeply") from None
    except tomllib.TOMLDecodeError as error:
        raise CaseError(_syntax(name, str(error), text)) from None
    except CaseError:
        raise
    except ValueError as error:  # of a number with thousands of digits
        raise CaseError(f"{name}: {error}; is no TOML") from None
    source = Source(data, name, folder, {at: f"{name}:{line}" for at, line in lines_of(text).items()})
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
    below = _read(str(File(name).parent / base), file, (*above, path.resolve()))
    for i, left_out in enumerate(without if isinstance(without, list) else [without]):
        if not isinstance(left_out, str) or not _removed(below, left_out):
            raise source.error(Fault(("without", i), f'{short(left_out)} is no entry of "{base}", such as "sweep"'))
    places = below.places.copy()
    merged = _merged(below.data, data, places, ())
    return Source(merged, name, below.folder, places | source.places)


def _removed(source: Source, name: str) -> bool:
    """Remove an entry of a table, and return whether there was one."""
    try:
        path = parsed(name)
        del entry(source.data, path[:-1])[str(path[-1])]
    except (KeyError, TypeError, ValueError):  # also for an entry of a list, which is written again as a whole
        return False
    _forget(source.places, path)
    return True


def _forget(places: dict[Path, str], path: Path) -> None:
    """Remove the places of an entry and of all inside it."""
    for at in [at for at in places if at[: len(path)] == path]:
        del places[at]


def _text(name: str, path: File) -> str:
    try:
        if path.is_dir():
            raise CaseError(f"{name}: is a folder; give a case file")
        with path.open("rb") as file:
            data = file.read(LARGEST + 1)  # a device, such as /dev/zero, has no end
        if len(data) > LARGEST:
            raise CaseError(f"{name}: has more than {LARGEST:.0e} bytes; is it a case file?")
        return data.decode("utf-8-sig")
    except FileNotFoundError:
        raise CaseError(f"{name}: there is no such file; `hertzlink new rod case.toml` writes a first one") from None
    except OSError as error:
        raise CaseError(f"{name}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise CaseError(f"{name}: is no text in UTF-8; is it a case file?") from None


def names_file(name: str, value: Any) -> bool:
    """Return whether the text of an entry names a file, relative to the file in which it stands."""
    looks_so = isinstance(value, str) and re.search(r"\.[A-Za-z]\w*$", value)
    return isinstance(value, str) and (name in FILES or (name in PERHAPS_FILES and bool(looks_so)))


def _with_whole_paths(value: Any, folder: File, name: str) -> Any:
    """Return data with the full paths of files: a case that extends this one, or a result, may lie in another folder.

    A file that is not there yet is reported where it is used; one whose name is no UTF-8 cannot stand in results.
    """
    if isinstance(value, dict):
        # The entry of a sweep is a path, such as "structure.mesh".
        return {key: _with_whole_paths(item, folder, key.rpartition(".")[2]) for key, item in value.items()}
    if isinstance(value, list):
        return [_with_whole_paths(item, folder, name) for item in value]
    if not names_file(name, value):
        return value
    path = os.path.abspath(os.path.join(folder, os.path.expanduser(value)))
    if os.fsencode(path).decode("utf-8", "replace") != path:
        raise CaseError(f"{path}: is no name in UTF-8, so results could not hold it; give the file another name")
    return path


def _syntax(name: str, message: str, text: str) -> str:
    """Return what tomllib says, with its line where lines stand, and what to write for a value without quotes."""
    words, _, place = message.partition(" (at line ")
    line = place.split(",")[0]
    if not line.isdigit():
        return f"{name}: {words}; is no TOML"
    # Outside of quotes and comments.
    typed = re.sub(r""""(?:[^"\\]|\\.)*"|'[^']*'""", "", (text.splitlines() or [""])[int(line) - 1]).partition("#")[0]
    cure = ""
    if words.startswith(("Cannot overwrite", "Cannot declare")):
        return f"{name}:{line}: this entry or section is given twice; keep one of them"
    number = r"[-+]?(?:\d[\d_]*\.?\d*|\.\d+)(?:[eE][-+]?\d+)?"
    if comma := re.search(r"= *([-+]?\d+,\d+(?:[eE][-+]?\d+)?) *$", typed):
        cure = f"{comma[1]} is no number; write {comma[1].replace(',', '.')}"
    elif word := re.search(r"= *(?!true\b|false\b|inf\b|nan\b)([A-Za-z_][\w .-]*?) *(?=$|[,}\]])", typed):
        right = word[1].lower() if word[1] in ("True", "False") else f'"{word[1]}" in quotes'
        cure = f"{word[1]} is no value of TOML; write {right}"
    else:
        for match in re.finditer(rf"(?<![\w.]){number} ?[A-Za-zµμΩ°][\wµμΩ°·*/^²³⁴]*", typed):
            if not isnan(in_si(match[0])):
                cure = f'{match[0]} is no value of TOML; write "{match[0]}" in quotes'
                break
    return f"{name}:{line}: {cure or f'{words}; is no TOML'}"


def _merged(base: dict[str, Any], above: Mapping[str, Any], places: dict[Path, str], at: Path) -> dict[str, Any]:
    """Return the data of a file with those that extend it; places of what is replaced are forgotten."""
    merged = deepcopy(base)
    for name, value in above.items():
        old = merged.get(name)
        alike = isinstance(old, dict) and isinstance(value, dict)
        if alike and all(value.get(kind, merged[name].get(kind)) == merged[name].get(kind) for kind in KINDS):
            merged[name] = _merged(merged[name], value, places, (*at, name))
        else:
            merged[name] = deepcopy(value)
            _forget(places, (*at, name))
    return merged


def _apply(source: Source, change: str) -> None:
    """Apply path=value, as given to --set."""
    name, equals, text = change.partition("=")
    place = f"{CHANGE} {change}"
    if not equals:
        raise CaseError(f'{place}: has no "="; write --set structure.thickness="1 mm"')
    try:
        value = tomllib.loads(f"value = {text.strip()}")["value"] if "\n" not in text else text
    except (KeyError, ValueError):
        value = text.strip()  # as a shell leaves it of "1 mm"
    except RecursionError:
        raise CaseError(f"{CHANGE} {name}: is nested too deeply") from None
    try:
        path = parsed(name.strip())
        if path == ("extends",):
            raise CaseError(f"{place}: a change cannot extend another case")
        put(source.data, path, _with_whole_paths({str(path[-1]): value}, File.cwd(), "")[str(path[-1])])
    except CaseError:
        raise
    except ValueError as error:
        raise CaseError(f"{place}: {error}") from None
    _forget(source.places, path)
    source.places[path] = CHANGE


def lines_of(text: str) -> dict[Path, int]:
    """Return the line, counted from 1, on which each entry of valid TOML stands, by its path: tomllib gives none."""
    lines: dict[Path, int] = {}
    words: list[tuple[str, int]] = []
    line = 1
    for match in WORD.finditer(text):
        if not match["none"]:
            words.append((match[0], line))
        line += match[0].count("\n")
    words.reverse()

    def begins() -> bool:
        """Pass line breaks; whether anything follows."""
        while words and words[-1][0] == "\n":
            words.pop()
        return bool(words)

    def note(path: Path, line: int) -> None:
        for end in range(1, len(path) + 1):
            lines.setdefault(path[:end], line)

    def names_until(end: str) -> list[str]:
        """Return the names up to a mark, without quotes and what stands between them, and pass it."""
        names = []
        while words and (word := words.pop()[0]) != end:
            if word not in (".", "[", "]"):
                names.append(word[1:-1] if word[0] in "\"'" else word)
        return names

    def pair(table: Path) -> None:
        line = words[-1][1]
        path = (*table, *names_until("="))
        note(path, line)
        value(path)

    def value(path: Path) -> None:
        """Pass a value, and note what stands in it."""
        word = words.pop()[0]
        if word not in "[{":
            while words and words[-1][0] not in (",", "]", "}", "\n"):
                words.pop()
            return
        number = count()
        while begins() and words[-1][0] not in "]}":
            if words[-1][0] == ",":
                words.pop()
            elif word == "{":
                pair(path)
            else:
                item = (*path, next(number))
                note(item, words[-1][1])
                value(item)
        words.pop()

    counts: dict[Path, int] = {}
    table: Path = ()
    while begins():
        if words[-1][0] != "[":
            pair(table)
            continue
        line = words.pop()[1]
        several = words[-1][0] == "["
        table = ()
        for name in names_until("\n"):
            # Of an array of tables the last one is meant.
            table = (*table, counts[table] - 1, name) if table in counts else (*table, name)
        note(table, line)
        if several:
            counts[table] = counts.get(table, 0) + 1
        if table in counts:
            table = (*table, counts[table] - 1)
            note(table, line)
    return lines
