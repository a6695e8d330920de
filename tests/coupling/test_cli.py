"""The command line: whole folders or none, one line and exit code 2 for bad input."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import xarray as xr

from coupling.cli import write_folder
from coupling.studies.table import Row, text


def hertzlink(*arguments: str, cwd: Path) -> "subprocess.CompletedProcess[str]":
    command = [sys.executable, "-c", "from hertzlink import main; main()", *arguments]
    return subprocess.run(command, cwd=cwd, capture_output=True, text=True, timeout=300)


def test_quick_study_writes_everything(tmp_path: Path) -> None:
    done = hertzlink("study", "rod-stiffness", "--quick", "--jobs", "1", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "rod-stiffness"
    assert {path.name for path in folder.iterdir()} == {
        "rod-stiffness.nc", "table.txt", "files.txt", "stiffness.png", "force_intensity.png",
        "force_histories.png", "displacements.png",
    }  # fmt: skip
    assert "AR, steel" in done.stdout
    assert (folder / "table.txt").read_text().strip() in done.stdout
    with xr.open_dataset(folder / "rod-stiffness.nc") as data:
        assert json.loads(data.attrs["input"])["study"] == "rod-stiffness"
        assert data.amplitude_ratio.sizes["youngs_modulus"] == 11
    assert [path.name for path in tmp_path.iterdir()] == ["rod-stiffness"]

    again = hertzlink("study", "rod-stiffness", "--quick", cwd=tmp_path)
    assert again.returncode == 2
    assert "exists already" in again.stderr
    forced = hertzlink("study", "rod-stiffness", "--quick", "--force", "--jobs", "1", cwd=tmp_path)
    assert forced.returncode == 0, forced.stderr
    assert [path.name for path in tmp_path.iterdir()] == ["rod-stiffness"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["study", "rod-stifness"], "'rod-stifness' is not one of"),
        (["study"], "Missing argument 'NAME'"),
        (["study", "plate-boundary", "--jobs", "0"], "--jobs"),
        (["study", "plate-boundary", "--output", "no/such/place"], "parent folder does not exist"),
        (["study", "plate-boundary", "--output", "file"], "is a file"),
        (["study", "plate-boundary", "--sideways"], "--sideways"),
        (["plot"], "No such command 'plot'"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(tmp_path: Path, arguments: list[str], message: str) -> None:
    (tmp_path / "file").write_text("mine")
    done = hertzlink(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


def test_info_and_help(tmp_path: Path) -> None:
    info = hertzlink("info", cwd=tmp_path)
    assert info.returncode == 0
    for word in ("python", "numba", "threads", "installed in"):
        assert word in info.stdout
    assert "study" in hertzlink("--help", cwd=tmp_path).stdout
    nothing = hertzlink(cwd=tmp_path)
    assert nothing.returncode == 2
    assert "Commands:\n" in nothing.stderr


@pytest.mark.parametrize("output", [".", "..", "", "mine", "link", "flat"])
def test_force_never_deletes_what_it_did_not_write(tmp_path: Path, output: str) -> None:
    """Neither the current folder, nor one around it, nor one with other files in it."""
    inner = tmp_path / "inner"
    (inner / "mine").mkdir(parents=True)
    (inner / "mine" / "thesis.tex").write_text("years of work")
    (inner / "link").symlink_to(inner / "mine")
    (inner / "flat").mkdir()
    for name in ("table.txt", "holiday.png", "experiment.nc"):
        (inner / "flat" / name).write_text("mine")
    done = hertzlink("study", "rod-stiffness", "--quick", "--force", "--output", output, cwd=inner)
    assert done.returncode == 2
    assert done.stderr.startswith("hertzlink: --output")
    assert done.stderr.count("\n") == 1
    assert (inner / "mine" / "thesis.tex").read_text() == "years of work"
    assert len(list((inner / "flat").iterdir())) == 3


@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGKILL])
def test_a_stopped_study_leaves_nothing(tmp_path: Path, sent: signal.Signals) -> None:
    command = [sys.executable, "-c", "from hertzlink import main; main()", "study", "plate-boundary", "--jobs", "1"]
    running = subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, start_new_session=True)
    time.sleep(6.0)
    for _ in range(3):
        os.killpg(running.pid, sent)
        try:
            running.communicate(timeout=30)
            break
        # Where a callback of the compiler's swallowed it, a user presses the keys again.
        except subprocess.TimeoutExpired:
            continue
    assert running.returncode not in (None, 0)
    assert list(tmp_path.iterdir()) == []


def test_a_failed_write_keeps_the_old_folder(tmp_path: Path) -> None:
    folder = tmp_path / "results"
    folder.mkdir()
    (folder / "files.txt").write_text("files.txt")

    def fail(into: Path) -> None:
        (into / "half").write_text("half")
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        write_folder(folder, fail, force=True)
    assert [path.name for path in tmp_path.iterdir()] == ["results"]
    assert [path.name for path in folder.iterdir()] == ["files.txt"]


def test_table_shows_differences_and_wraps_reasons() -> None:
    lines = text([Row("speed", 560.0, 569.1, "m/s", "reason " * 20), Row("wave", "none", 0.0)]).splitlines()
    assert "speed, m/s" in lines[2]
    assert "+1.6 %" in lines[2]
    assert max(map(len, lines)) < 120
    assert "none" in lines[-1]
