"""A message is one line, and a path in it is whole, so that both can be copied and searched."""

from pathlib import Path

import pytest

from hertzlink import output
from structures.caution import HertzlinkWarning

LONG = "record: ends too early " + "and this is why, " * 8 + "so record longer"


def test_a_message_is_one_line_and_a_path_is_whole(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    output.complain(LONG.replace(", ", ",\n"))
    assert capsys.readouterr().err == f"hertzlink: {LONG}\n"
    folder = tmp_path / ("taps of the second-day " * 3).strip()
    output.deliver(folder, lambda into: (into / "results.nc").touch(), False, "done")
    assert capsys.readouterr().out == f"done\n\nwritten to {folder.resolve()}:\nfiles.txt, results.nc\n"


def test_warnings_of_others_keep_their_form() -> None:
    own = output.format_warning(HertzlinkWarning(LONG), HertzlinkWarning, "file.py", 7)
    assert own == f"hertzlink: warning: {LONG}\n"
    other = output.format_warning(UserWarning("other"), UserWarning, "file.py", 7)
    assert other.startswith("file.py:7: UserWarning: other")
