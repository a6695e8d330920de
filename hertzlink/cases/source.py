"""A case file and what it extends, as one tree of data with the line of each entry; paths of entries, and faults."""

import json
import math
import os
import re
import tomllib
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path as File
from typing import Any

from structures.checks import count_of, short
from structures.units import in_si

Path = tuple[str | int, ...]

PART = re.compile(r"""(?:^|\.)(?:([A-Za-z0-9_-]+)|"([^"]*)")|\[(\d+)\]""")

# Files that extend each other; bytes of a file, so that the longest force history fits; letters of a list in one line.
DEEPEST, LARGEST, WIDTH = 10, 1_000_000, 110

CHANGE = "--set"
"""The place of an entry that the command line changes."""

NAME = re.compile(r"""[A-Za-z0-9_-]+|"(?:\\.|[^"\\\n])*"|'[^'\n]*'""")

NAMES = rf"(?:{NAME.pattern})(?:[ \t]*\.[ \t]*(?:{NAME.pattern}))*"

TOKEN = re.compile(
    rf"^[ \t]*(?P<open>\[\[?)[ \t]*(?P<section>{NAMES})[ \t]*\]\]?(?=[ \t]*(?:\#|$))"
    rf"|(?P<key>{NAMES})[ \t]*="
    r'|"""(?:\\.|[^\\])*?"{3,5}(?!")'
    r"|'''.*?'{3,5}(?!')"
    r'|"(?:\\.|[^"\\])*"'
    r"|'[^']*'"
    r"|[\[\]{},]"
    r"|(?P<comment>\#[^\n]*)"
    r"|[^\s\[\]{},#\"']+",
    re.DOTALL | re.MULTILINE,
)
"""Of TOML: the head of a section, a key, a text, a mark, a comment, or a number."""


class Fault(ValueError):
    """A fault at a path of a case."""

    def __init__(self, path: Path, reason: str) -> None:
        super().__init__(path, reason)
        self.path, self.reason = path, " ".join(reason.split())

    def __str__(self) -> str:
        return f"{written(self.path)}: {self.reason}" if self.path else self.reason


class CaseError(ValueError):
    """A fault with its place: `case.toml:12: structure.thickness: must be ...`, complete as it stands."""


def parsed(text: str) -> Path:
    """Return the path that a text names; raise a ValueError for a text that is none."""
    parts = list(PART.finditer(text))
    if not parts or parts[0][3] or "".join(part[0] for part in parts) != text:
        raise ValueError(f'"{text}" is no path of an entry; write it as structure.layers[1].material')
    return tuple(int(part[3]) if part[3] else part[2] if part[1] is None else part[1] for part in parts)


def written(path: Sequence[str | int]) -> str:
    """Return the path as text."""
    parts = (f"[{part}]" if isinstance(part, int) else f".{_key(part)}" for part in path)
    return "".join(parts).removeprefix(".")


def entry(data: Any, path: Sequence[str | int]) -> Any:
    """Return the entry at a path; None where there is none."""
    for part in path:
        inside = isinstance(data, Mapping) and part in data
        if not inside and not (isinstance(data, list) and isinstance(part, int) and part < len(data)):
            return None
        data = data[part]
    return data


def put(data: dict[str, Any], path: Path, value: Any) -> None:
    """Set the entry at a path, in tables that are made where they are missing; a ValueError where that is impossible.

    The name of a material becomes a table like it, so that one of its properties can be set.
    """
    at: Any = data
    for i, part in enumerate(path):
        before, number = written(path[:i]), isinstance(part, int)
        fits = isinstance(at, list) if number else isinstance(at, dict)
        if not fits:
            raise ValueError(f"{before} is no {'list' if number else 'table'}, so it has no entry {written((part,))}")
        if isinstance(part, int) and part >= len(at):
            raise ValueError(f"{before} has {count_of(len(at), 'entry')}, counted from 0, so no entry [{part}]")
        if i + 1 == len(path):
            at[part] = value
        elif isinstance(part, int):
            at = at[part]
        else:
            if part == "material" and isinstance(at.get(part), str):
                at[part] = {"like": at[part]}
            at = at.setdefault(part, {})


def shown(value: Any) -> str:
    """Return a value as TOML writes it, in short."""
    if isinstance(value, bool | dict):
        return "a table" if isinstance(value, dict) else str(value).lower()
    if isinstance(value, str):
        return f'"{value}"' if len(value) < 60 else f'"{value[:60]}…"'
    return short(value)


def as_toml(data: Mapping[str, Any]) -> str:
    """Return the text of a case: one section for each table at the top, tables inside them in braces."""
    tables = {name: table for name, table in data.items() if isinstance(table, Mapping)}
    lines = _pairs({name: value for name, value in data.items() if name not in tables})
    for name, table in tables.items():
        lines += ["", f"[{_key(name)}]", *_pairs(table)]
    return "\n".join(lines).strip() + "\n"


def _pairs(table: Mapping[str, Any]) -> list[str]:
    return [f"{_key(name)} = {_value(value)}" for name, value in table.items() if value is not None]


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else json.dumps(name, ensure_ascii=False)


def _value(value: Any) -> str:
    """Return a value as text. Numbers keep all their digits."""
    if isinstance(value, Mapping):
        return f"{{ {', '.join(_pairs(value))} }}" if value else "{}"
    if isinstance(value, list | tuple):
        items = [_value(item) for item in value if item is not None]
        text = f"[{', '.join(items)}]"
        return text if len(text) <= WIDTH else "[\n    " + ",\n    ".join(items) + ",\n]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    # TOML has the escapes of JSON; DEL is the one letter that JSON leaves as it is and TOML refuses.
    return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")


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

    def forget(self, path: Path) -> None:
        """Remove the places of an entry and of all inside it."""
        for at in [at for at in self.places if at[: len(path)] == path]:
            del self.places[at]

    def without(self, name: Any) -> bool:
        """Remove an entry of a table, and return whether there was one."""
        try:
            path = parsed(name)
            del entry(self.data, path[:-1])[str(path[-1])]
        except (KeyError, TypeError, ValueError):  # also for an entry of a list, which is written again as a whole
            return False
        self.forget(path)
        return True

    def merge(self, above: Mapping[str, Any], path: Path = ()) -> None:
        """Put the data of a file that extends this one over its own: tables entry by entry, all else as a whole."""
        table = entry(self.data, path)
        for name, value in above.items():
            old = table.get(name)
            # A table of another kind replaces the whole table.
            same = isinstance(old, dict) and isinstance(value, dict)
            if same and all(value.get(tag, old.get(tag)) == old.get(tag) for tag in ("kind", "shape")):
                self.merge(value, (*path, name))
            else:
                table[name] = deepcopy(value)
                self.forget((*path, name))

    def change(self, change: str) -> None:
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
                raise ValueError("a change cannot extend another case")
            put(self.data, path, _with_whole_paths(value, File.cwd()) if path[1:] else value)
        except ValueError as error:
            raise error if isinstance(error, CaseError) else CaseError(f"{place}: {error}") from None
        self.forget(path)
        self.places[path] = CHANGE


def read_source(path: str | File, changes: Iterable[str] = ()) -> Source:
    """Read a case file with what it extends, and apply changes of the form path=value; a CaseError for faults."""
    source = _read(str(path), File(path), ())
    for change in changes:
        source.change(change)
    return source


def _read(name: str, path: File, above: tuple[File, ...]) -> Source:
    try:
        with path.open("rb") as opened:
            content = opened.read(LARGEST + 1)  # a device, such as /dev/zero, has no end
        text = content.decode("utf-8-sig")
    except FileNotFoundError:
        raise CaseError(f"{name}: there is no such file; `hertzlink new rod case.toml` writes a first one") from None
    except OSError as error:
        raise CaseError(f"{name}: cannot be read ({error.strerror})") from None
    except UnicodeDecodeError:
        raise CaseError(f"{name}: is no text in UTF-8; is it a case file?") from None
    if len(content) > LARGEST:
        raise CaseError(f"{name}: has more than {LARGEST:.0e} bytes; is it a case file?")
    folder = path.resolve().parent
    try:
        data = tomllib.loads(text)
        # A title, or the file that is extended, stays as it is.
        inside = {key: value for key, value in data.items() if isinstance(value, dict | list)}
        data |= _with_whole_paths(inside, folder)
    except RecursionError:
        raise CaseError(f"{name}: is nested too deeply") from None
    except ValueError as error:  # also of a number with thousands of digits
        raise error if isinstance(error, CaseError) else CaseError(_syntax(name, str(error), text)) from None
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
        if not below.without(left_out):
            raise source.error(Fault(("without", i), f'{short(left_out)} is no entry of "{base}", such as "sweep"'))
    below.merge(data)
    return Source(below.data, name, below.folder, below.places | source.places)


def _with_whole_paths(value: Any, folder: File) -> Any:
    """Return data with the full paths of files: a case that extends this one, or a result, may lie in another folder.

    A text names a file if it ends as one and the file is there: "plate.mtx", but not "2.5 g".
    """
    if isinstance(value, dict):
        return {name: _with_whole_paths(item, folder) for name, item in value.items()}
    if isinstance(value, list):
        return [_with_whole_paths(item, folder) for item in value]
    if not isinstance(value, str) or not re.search(r"\.[A-Za-z]\w*$", value):
        return value
    path = os.path.abspath(os.path.join(folder, os.path.expanduser(value)))
    if not os.path.isfile(path):
        return value
    if os.fsencode(path).decode("utf-8", "replace") != path:
        raise CaseError(f"{path}: is no name in UTF-8, so results could not hold it; give the file another name")
    return path


def _syntax(name: str, message: str, text: str) -> str:
    """Return what tomllib says, with its line where lines stand, and what to write for a value without quotes."""
    words, _, place = message.partition(" (at line ")
    number = place.split(",")[0]
    if not number.isdigit():
        return f"{name}: {words}; is no TOML"
    rows, line = text.splitlines() or [""], int(number)
    # Outside of quotes and comments.
    row = re.sub(r""""(?:[^"\\]|\\.)*"|'[^']*'""", "", rows[line - 1]).partition("#")[0]
    reason = f"{words}; is no TOML"
    if words.startswith(("Cannot overwrite", "Cannot declare")):
        same = [i for i, other in enumerate(rows[: line - 1], 1) if other.split("=")[0] == rows[line - 1].split("=")[0]]
        first = f", first in line {same[-1]}" if same else ""
        reason = f"this entry or section is given twice{first}; keep one of them"
    elif comma := re.search(r"= *([-+]?\d+,\d+(?:[eE][-+]?\d+)?) *$", row):
        reason = f"{comma[1]} is no number; write {comma[1].replace(',', '.')}"
    elif word := re.search(r"= *(?!true\b|false\b|inf\b|nan\b)([A-Za-z_][\w .-]*?) *(?=$|[,}\]])", row):
        right = word[1].lower() if word[1] in ("True", "False") else f'"{word[1]}" in quotes'
        reason = f"{word[1]} is no value of TOML; write {right}"
    else:
        quantities = re.findall(r"(?<![\w.])[-+]?[\d_.]+(?:[eE][-+]?\d+)? ?[A-Za-zµμΩ°][\wµμΩ°·*/^²³⁴]*", row)
        typed = next((one for one in quantities if not math.isnan(in_si(one))), None)
        if typed is not None:
            reason = f'{typed} is no value of TOML; write "{typed}" in quotes'
    return f"{name}:{line}: {reason}"


def lines_of(text: str) -> dict[Path, int]:
    """Return the line, counted from 1, on which each entry of valid TOML stands, by its path: tomllib gives none."""
    lines: dict[Path, int] = {}
    counts: dict[Path, int] = {}  # of sections in double brackets
    section: Path = ()
    value: Path = ()  # the entry whose value stands at a token
    around: list[tuple[Path, list[int]]] = []  # the lists and tables in braces around it; the place in a list
    line, at = 1, 0

    def note(path: Path) -> None:
        for end in range(1, len(path) + 1):
            lines.setdefault(path[:end], line)

    for match in TOKEN.finditer(text):
        line += text.count("\n", at, match.start())
        at, token = match.start(), match[0]
        names = [name.strip("\"'") for name in NAME.findall(match["section"] or match["key"] or "")]
        path, place = around[-1] if around else (section, [])
        if match["comment"]:
            continue
        if match["section"] and not around:
            section = ()
            for name in names:  # of sections in double brackets the last one is meant
                section = (*section, counts[section] - 1, name) if section in counts else (*section, name)
            note(section)
            if match["open"] == "[[":
                counts[section] = counts.get(section, 0) + 1
            if section in counts:
                section = (*section, counts[section] - 1)
                note(section)
        elif match["key"]:
            value = (*path, *names)
            note(value)
        elif token in ("]", "}"):
            around.pop()
        elif token == ",":
            place[:] = [number + 1 for number in place]
        else:
            if place:
                value = (*path, *place)
                note(value)
            if token in ("[", "{"):
                around.append((value, [0] if token == "[" else []))
    return lines
