"""Messages fit the terminal, with whole paths; redirected output has one line for each."""

import sys
from io import StringIO
from pathlib import Path

import pytest
from command import ended

from hertzlink import output as terminal
from structures.caution import HertzlinkWarning


class Terminal(StringIO):
    """A terminal that keeps what is printed."""

    def isatty(self) -> bool:
        return True


def on_terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Standard output and error on a terminal of 60 columns; in the test itself, as pytest sets them before it."""
    stream = Terminal()
    monkeypatch.setenv("COLUMNS", "60")
    monkeypatch.setattr(sys, "stdout", stream)
    monkeypatch.setattr(sys, "stderr", stream)
    return stream


LONG = "record: ends too early " + "and this is why, " * 8 + "so record longer"


def test_messages_are_wrapped_with_an_indent(monkeypatch: pytest.MonkeyPatch) -> None:
    shown = on_terminal(monkeypatch)
    terminal.complain(LONG)
    lines = shown.getvalue().splitlines()
    assert max(map(len, lines)) <= 60
    assert [line.startswith("  ") for line in lines] == [False] + [True] * (len(lines) - 1)
    assert " ".join(shown.getvalue().split()) == f"hertzlink: {LONG}"


def test_a_file_gets_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = StringIO()
    monkeypatch.setattr(sys, "stderr", stream)
    terminal.complain(LONG)
    assert stream.getvalue() == f"hertzlink: {LONG}\n"


def test_a_path_is_not_broken(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Neither at its blanks nor at its hyphens, also if it is longer than a line."""
    shown = on_terminal(monkeypatch)
    folder = tmp_path / ("taps of the second-day " * 3).strip()
    terminal.deliver(folder, lambda into: (into / "results.nc").touch(), False, "done")
    assert any(f"{folder.resolve()}:" in line for line in shown.getvalue().splitlines())


def test_a_faulty_command_is_wrapped(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    shown = on_terminal(monkeypatch)
    monkeypatch.chdir(tmp_path)
    assert ended("run", "nofile.toml") == 2
    lines = shown.getvalue().splitlines()
    assert lines[0].startswith("nofile.toml: there is no such file")
    assert len(lines) == 2
    assert max(map(len, lines)) <= 60


def test_warnings_of_others_keep_their_form(monkeypatch: pytest.MonkeyPatch) -> None:
    on_terminal(monkeypatch)
    own = terminal.format_warning(HertzlinkWarning(LONG), HertzlinkWarning, "file.py", 7)
    assert own.startswith("hertzlink: warning: record")
    assert max(map(len, own.splitlines())) <= 60
    other = terminal.format_warning(UserWarning("other"), UserWarning, "file.py", 7)
    assert other.startswith("file.py:7: UserWarning: other")
