"""The line of each entry of a TOML text, which tomllib does not give. The text must be valid TOML."""

import re
from itertools import count

from hertzlink.cases.entry_paths import Path

WORD = re.compile(
    r'"""(?:\\.|[^\\])*?"{3,5}(?!")'
    r"|'''.*?'{3,5}(?!')"
    r'|"(?:\\.|[^"\\])*"'
    r"|'[^']*'"
    r"|[\[\]{},=.\n]|[^\s\[\]{},=.#\"']+"
    r"|(?P<none>[^\S\n]+|#[^\n]*)",
    re.DOTALL,
)
"""A text, a mark, a line break, or a piece of a key or a value; nothing for blanks and comments."""


def lines_of(text: str) -> dict[Path, int]:
    """Return the line, counted from 1, on which each entry stands, by its path."""
    return _Reader(text).lines


class _Reader:
    def __init__(self, text: str) -> None:
        line, self.words = 1, list[tuple[str, int]]()
        for match in WORD.finditer(text):
            if not match["none"]:
                self.words.append((match[0], line))
            line += match[0].count("\n")
        self.words.reverse()
        self.lines: dict[Path, int] = {}
        counts: dict[Path, int] = {}
        table: Path = ()
        while self._begins():
            if self.words[-1][0] != "[":
                self._pair(table)
                continue
            line = self.words.pop()[1]
            several = self.words[-1][0] == "["
            table = ()
            for name in self._until("\n"):
                # Of an array of tables the last one is meant.
                table = (*table, counts[table] - 1, name) if table in counts else (*table, name)
            self._note(table, line)
            if several:
                counts[table] = counts.get(table, 0) + 1
                table = (*table, counts[table] - 1)
                self._note(table, line)
            elif table in counts:
                table = (*table, counts[table] - 1)

    def _note(self, path: Path, line: int) -> None:
        for end in range(1, len(path) + 1):
            self.lines.setdefault(path[:end], line)

    def _begins(self) -> bool:
        """Pass line breaks; whether anything follows."""
        while self.words and self.words[-1][0] == "\n":
            self.words.pop()
        return bool(self.words)

    def _until(self, end: str) -> list[str]:
        """Return the names up to a mark, without quotes and what stands between them, and pass it."""
        names = []
        while self.words and (word := self.words.pop()[0]) != end:
            if word not in (".", "[", "]"):
                names.append(word[1:-1] if word[0] in "\"'" else word)
        return names

    def _pair(self, table: Path) -> None:
        line = self.words[-1][1]
        path = (*table, *self._until("="))
        self._note(path, line)
        self._value(path)

    def _value(self, path: Path) -> None:
        """Pass a value, and note what stands in it."""
        word = self.words.pop()[0]
        if word not in "[{":
            while self.words and self.words[-1][0] not in (",", "]", "}", "\n"):
                self.words.pop()
            return
        number = count()
        while self._begins() and self.words[-1][0] not in "]}":
            if self.words[-1][0] == ",":
                self.words.pop()
            elif word == "{":
                self._pair(path)
            else:
                item = (*path, next(number))
                self._note(item, self.words[-1][1])
                self._value(item)
        self.words.pop()
