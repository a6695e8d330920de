"""The line of each entry of a TOML text, which tomllib does not give. The text must be valid TOML."""

from hertzlink.cases.entry_paths import Path

BARE_ENDS = ",]}\n\r#"


def lines_of(text: str) -> dict[Path, int]:
    """Return the line, counted from 1, on which each entry stands, by its path."""
    return _Scanner(text).lines


class _Scanner:
    def __init__(self, text: str) -> None:
        self.text, self.at = text, 0
        self.lines: dict[Path, int] = {}
        self.counts: dict[Path, int] = {}
        table: Path = ()
        while self._skip(newlines=True):
            if self.text.startswith("[[", self.at):
                self.at += 2
                table = self._header()
                count = self.counts.get(table, 0)
                self.counts[table] = count + 1
                table = (*table, count)
                self._note(table)
                self.at += 2
            elif self.text[self.at] == "[":
                self.at += 1
                table = self._header()
                self.at += 1
            else:
                self._pair(table)

    def _note(self, path: Path) -> None:
        line = self.text.count("\n", 0, self.at) + 1
        for i in range(1, len(path) + 1):
            self.lines.setdefault(path[:i], line)

    def _skip(self, newlines: bool) -> bool:
        """Pass blanks and comments; whether anything follows."""
        while self.at < len(self.text):
            letter = self.text[self.at]
            if letter == "#":
                end = self.text.find("\n", self.at)
                self.at = len(self.text) if end < 0 else end
            elif letter in " \t" or (newlines and letter in "\r\n"):
                self.at += 1
            else:
                return True
        return False

    def _header(self) -> Path:
        """Return the path of a header; parts that are arrays of tables mean their last table."""
        path: Path = ()
        parts = self._key()
        for i, part in enumerate(parts):
            path = (*path, part)
            if i + 1 < len(parts) and path in self.counts:
                path = (*path, self.counts[path] - 1)
        self._note(path)
        return path

    def _key(self) -> list[str]:
        parts = []
        while True:
            self._skip(newlines=False)
            if self.text[self.at] in "\"'":
                parts.append(self._string())
            else:
                start = self.at
                while self.text[self.at] not in " \t.=]":
                    self.at += 1
                parts.append(self.text[start : self.at])
            self._skip(newlines=False)
            if self.text[self.at] != ".":
                return parts
            self.at += 1

    def _pair(self, table: Path) -> None:
        start = self.at
        path = (*table, *self._key())
        end, self.at = self.at, start
        self._note(path)
        self.at = end + 1  # the equals sign
        self._value(path)

    def _value(self, path: Path) -> None:
        self._skip(newlines=True)
        letter = self.text[self.at]
        if letter in "\"'":
            self._string()
        elif letter == "[":
            self._many("]", path, pairs=False)
        elif letter == "{":
            self._many("}", path, pairs=True)
        else:
            while self.at < len(self.text) and self.text[self.at] not in BARE_ENDS:
                self.at += 1

    def _many(self, closing: str, path: Path, pairs: bool) -> None:
        self.at += 1
        count = 0
        while self._skip(newlines=True) and self.text[self.at] != closing:
            if self.text[self.at] == ",":
                self.at += 1
            elif pairs:
                self._pair(path)
            else:
                self._note((*path, count))
                self._value((*path, count))
                count += 1
        self.at += 1

    def _string(self) -> str:
        """Return the content of a string, as it is written."""
        quote = self.text[self.at]
        closing = 3 * quote if self.text.startswith(3 * quote, self.at) else quote
        start = self.at = self.at + len(closing)
        while not self.text.startswith(closing, self.at):
            self.at += 2 if quote == '"' and self.text[self.at] == "\\" else 1
        end = self.at
        self.at += len(closing)
        # Of four or five quotes at the end the first belong to the text.
        while len(closing) == 3 and self.text.startswith(quote, self.at):
            self.at += 1
        return self.text[start:end]
