"""Case files (docs/cases.md): a file and what it extends as one tree of data, paths of entries, and faults with lines.

pint is loaded with the other modules of this package, so only by the commands that read cases.
"""

import json
import math
import os
import re
import tomllib
from bisect import bisect_left
from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, field
from pathlib import Path as File
from typing import Any

from structures.checks import count_of, short

Path = tuple[str | int, ...]

PART = re.compile(r"""(?:^|\.)(?:([A-Za-z0-9_-]+)|"([^"]*)")|\[(\d+)\]""")

# The most bytes of a file, enough for the longest force history; the most characters of a list on one line.
LARGEST, WIDTH = 1_000_000, 110

# A value without quotes, such as 2.29 mm or steel 440C, that is neither a number nor a word of TOML.
END = r" *(?:$|[,}\]])"
WORD = re.compile(
    rf"(?:^|[=\[,]) *(?!(?:true|false|[-+]?(?:inf|nan|[\d._]+(?:[eE][-+]?\d+)?)){END})"
    rf"""([^\s"'=\[\]{{}},][^"'=\[\]{{}},]*?){END}"""
)

CHANGE = "--set"

ENDS = ("", "\n]", "\n]]", "\n]}", "\n]}]", '"""', "'''")
"""Texts that complete the first lines of a file: only lists and long texts continue over several lines."""


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
    """Return the path that a text names; raise a ValueError for any other text."""
    parts = list(PART.finditer(text))
    if not parts or parts[0][3] or "".join(part[0] for part in parts) != text:
        raise ValueError(f'"{text}" is not the path of an entry; write it as structure.layers[1].material')
    return tuple(int(part[3]) if part[3] else part[2] if part[1] is None else part[1] for part in parts)


def written(path: Sequence[str | int]) -> str:
    """Return the path as text."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{_key(part)}" for part in path).removeprefix(".")


def entry(data: Any, path: Sequence[str | int]) -> Any:
    """Return the entry at a path; None where there is none."""
    for part in path:
        inside = isinstance(data, Mapping) and part in data
        if not inside and not (isinstance(data, list) and isinstance(part, int) and part < len(data)):
            return None
        data = data[part]
    return data


def put(data: dict[str, Any], path: Path, value: Any) -> None:
    """Set the entry at a path, in tables that are made where they are missing."""
    at: Any = data
    for i, part in enumerate(path):
        before, this = written(path[:i]), written((part,))
        if isinstance(at, list):
            if not isinstance(part, int) or part >= len(at):
                many = count_of(len(at), "entry")
                raise ValueError(f"{before} has {many}, counted from 0 as {before}[0]; there is no {this}")
        elif isinstance(part, int) or not isinstance(at, dict):
            kind = "list" if isinstance(part, int) else "table"
            raise ValueError(f"{before} is not a {kind}, so it has no entry {this}")
        if i + 1 == len(path):
            at[part] = value
            return
        if part == "material" and isinstance(at.get(part), str):  # one property of a material that is named
            at[part] = {"like": at[part]}
        at = at[part] if isinstance(part, int) else at.setdefault(part, {})


def shown(value: Any) -> str:
    """Return a value as TOML writes it, shortened."""
    if isinstance(value, dict):
        return "a table"
    if isinstance(value, str):
        return f'"{value}"' if len(value) < 60 else f'"{value[:60]}…"'
    return str(value).lower() if isinstance(value, bool) else short(value)


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
    """The data of a case; name and text of its file and of each that it extends; and paths set by the command line."""

    data: dict[str, Any]
    texts: list[tuple[str, str]]
    changed: list[Path] = field(default_factory=list)

    def error(self, fault: Fault) -> CaseError:
        """Return the fault with its place: that of the deepest entry on its path."""
        if any(fault.path[: len(path)] == path for path in self.changed):
            return CaseError(f"{CHANGE} {fault}")
        for depth in range(len(fault.path), 0, -1):
            at = fault.path[:depth]
            for name, text in self.texts if entry(self.data, at) is not None else ():
                if line := line_of(text, at):
                    return CaseError(f"{name}:{line}: {fault}")
        for path in self.changed:  # a section that no file has
            if fault.path and path[: len(fault.path)] == fault.path:
                others = [(name, path[-1]) for name in self.data if name != path[0]]
                meant = [written(other) for other in others if entry(self.data, other) is not None]
                words = f"is not an entry; did you mean {meant[0]}?" if meant else str(fault)
                return CaseError(f"{CHANGE} {written(path)}: {words}")
        return CaseError(f"{self.texts[0][0]}: {fault}")

    def change(self, change: str) -> None:
        """Apply path=value, as given to --set."""
        name, equals, text = change.partition("=")
        if not equals:
            raise CaseError(f'{CHANGE} {change}: has no "="; write --set structure.thickness="1 mm"')
        value: Any = text.strip()  # also without quotes, which a shell removes from "1 mm"
        try:
            value = tomllib.loads(f"value = {value}")["value"] if "\n" not in text else text
        except RecursionError:
            raise CaseError(f"{CHANGE} {name}: is nested too deeply") from None
        except (KeyError, ValueError):  # a text without quotes
            if value[:1] in ("'", '"'):
                raise CaseError(f"{CHANGE} {change}: a quote is not closed") from None
        try:
            path = parsed(name.strip())
            if path == ("extends",):
                raise ValueError("a change cannot extend another case")
            put(self.data, path, _with_whole_paths(value, File.cwd()) if path[1:] else value)
        except ValueError as error:
            raise error if isinstance(error, CaseError) else CaseError(f"{CHANGE} {change}: {error}") from None
        self.changed.append(path)


def read_source(path: str | File, changes: Iterable[str] = ()) -> Source:
    """Read a case file and those that it extends, and apply changes path=value; faults raise a CaseError."""
    files = [_read(str(path), File(path))]
    while (base := files[-1].data.get("extends")) is not None:
        folder, words = File(files[-1].texts[0][0]).parent, ""
        below = folder / str(base)
        if not isinstance(base, str) or not base:
            words = 'must be the name of a case file, such as "plate.toml"'
        elif not below.is_file():
            words = f'"{base}" is a folder' if below.is_dir() else f'there is no file "{base}" in {folder}'
        elif below.resolve() in [File(one.texts[0][0]).resolve() for one in files]:
            words = f'"{base}" leads back to this file; a case cannot extend itself'
        if words:
            raise files[-1].error(Fault(("extends",), words))
        files.append(_read(str(below), below))

    data: dict[str, Any] = {}
    for one in reversed(files):
        without = one.data.get("without", [])
        for i, left_out in enumerate(without if isinstance(without, list) else [without]):
            try:
                at = parsed(left_out)
                del entry(data, at[:-1])[str(at[-1])]
            except (KeyError, TypeError, ValueError):  # also for an entry of a list, which is written again as a whole
                base = one.data.get("extends")
                of = f'of "{base}", such as "sweep"' if base else "of another case; give extends as well"
                raise one.error(Fault(("without", i), f"{short(left_out)} is not an entry {of}")) from None
        _merge(data, {key: value for key, value in one.data.items() if key not in ("extends", "without")})
    source = Source(data, [text for one in files for text in one.texts])
    for change in changes:
        source.change(change)
    return source


def _merge(below: dict[str, Any], above: Mapping[str, Any]) -> None:
    """Put the data of a file over those of one that it extends: tables entry by entry, all else as a whole."""
    for name, value in above.items():
        old: Any = below.get(name)
        # A table of another kind replaces the whole table.
        same = isinstance(old, dict) and isinstance(value, dict)
        if same and all(value.get(tag, old.get(tag)) == old.get(tag) for tag in ("kind", "shape")):
            _merge(old, value)
        else:
            below[name] = deepcopy(value)


def _read(name: str, path: File) -> Source:
    """Read one file."""
    content, text, data, fault = b"", "", dict[str, Any](), ""
    try:
        with path.open("rb") as opened:
            content = opened.read(LARGEST + 1)  # a device, such as /dev/zero, has no end
        if len(content) > LARGEST:
            fault = f": has more than {LARGEST:.0e} bytes; is it a case file?"
        else:
            text = content.decode("utf-8-sig")
            data = tomllib.loads(text)
    except FileNotFoundError:
        fault = ": there is no such file; `hertzlink new rod case.toml` writes a first one"
    except OSError as error:
        fault = f": cannot be read ({error.strerror})"
    except UnicodeDecodeError as error:
        line = content[: error.start].count(b"\n") + 1
        fault = f":{line}: is not text in UTF-8; if it is a case file, save it as UTF-8"
    except RecursionError:
        fault = ": is nested too deeply"
    except ValueError as error:  # for example for a number with thousands of digits
        other = "" if path.suffix == ".toml" else "; is this a case? The case file comes first, then other files"
        fault = _syntax(str(error), text) + other
    if fault:
        raise CaseError(name + fault)
    # A title, or the file that is extended, stays as it is.
    inside = {key: value for key, value in data.items() if isinstance(value, dict | list)}
    return Source(data | _with_whole_paths(inside, path.resolve().parent), [(name, text)])


def _with_whole_paths(value: Any, folder: File) -> Any:
    """Return data with full paths of files: a case that extends this one, or a result, may be in another folder."""
    if isinstance(value, dict):
        return {name: _with_whole_paths(item, folder) for name, item in value.items()}
    if isinstance(value, list):
        return [_with_whole_paths(item, folder) for item in value]
    # A text names a file if it has the ending of one and the file exists: "plate.mtx", but not "2.5 g".
    if not isinstance(value, str) or not re.search(r"\.[A-Za-z]\w*$", value):
        return value
    path = os.path.abspath(os.path.join(folder, os.path.expanduser(value)))
    if not os.path.isfile(path):
        return value
    if os.fsencode(path).decode("utf-8", "replace") != path:
        raise CaseError(f"{path}: is not a name in UTF-8, so results could not hold it; give the file another name")
    return path


def line_of(text: str, path: Path) -> int:
    """Return the last line, from 1, of the shortest beginning of valid TOML that holds an entry; 0 if none does."""
    rows = text.split("\n")

    def holds(count: int) -> bool:
        for fewer in range(count, 0, -1):
            for end in ENDS:
                try:
                    return entry(tomllib.loads("\n".join(rows[:fewer]) + end), path) is not None
                except ValueError:
                    continue
        return False

    line = bisect_left(range(len(rows) + 1), True, key=holds)
    return line if line <= len(rows) else 0


def _syntax(message: str, text: str) -> str:
    """Return tomllib's message with its line, or instead of the message the cure of a common mistake."""
    words, _, place = message.partition(" (at ")
    if words.startswith("Exceeds"):
        return f": {words}"
    rows, number = text.split("\n"), re.match(r"line (\d+)", place)
    line = int(number[1]) if number else len(rows)
    # The line without quoted texts and comments.
    row = re.sub(r""""(?:[^"\\]|\\.)*"|'[^']*'""", "", rows[line - 1]).partition("#")[0]
    reason = f"{words}; this is not valid TOML"
    if words.startswith(("Cannot overwrite", "Cannot declare", "Duplicate")):
        key = re.search("key '(.*)'", words) or re.match(r"""([\w."' -]+?) *(?==)|\[.*\]$""", rows[line - 1].strip())
        reason = f"{(key[1] or key[0]) if key else 'this entry or section'} is given twice; keep one of them"
        if row.strip() in ("[chain]", "[structure]"):
            reason += f", or write [{row.strip()}] above each"
    elif "Unescaped '\\'" in words or "Invalid hex" in words:
        reason = r'a backslash begins an escape in "..."; write / in paths, or single quotes'
    elif curly := re.search("[“”„‘’]", row):
        reason = f'{curly[0]} is not a quotation mark of TOML; write "'
    elif comma := re.search(r"= *([-+]?\d+,\d+(?:[eE][-+]?\d+)?) *$", row):
        reason = f"{comma[1]} is not a number; write {comma[1].replace(',', '.')}"
    elif (word := WORD.search(row)) and not row.startswith("["):
        right = word[1].lower() if word[1] in ("True", "False") else f'"{word[1]}" in quotes'
        reason = f"{word[1]} is not a value of TOML; write {right}"
    elif words.startswith("Unclosed") or (words, number) == ("Invalid value", None):
        line = max((i for i, other in enumerate(rows[:line], 1) if re.search(r"=\s*[\[{]", other)), default=line)
        reason = "a list or table that begins here is not closed"
    return f":{line}: {reason}"
