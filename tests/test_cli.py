"""The command line: whole folders or none, one line and exit code 2 for bad input."""

import errno
import os
import re
import signal
import subprocess
import sys
import warnings
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from click.shell_completion import ShellComplete

from coupling.sweeps.points import Stopped
from hertzlink.cases.templates import KINDS
from hertzlink.cli import cli, main
from hertzlink.output import check_output, complain, delivered
from hertzlink.studies import thesis
from structures.kernels.compiling import FOLDER


class Done(NamedTuple):
    """The outcome of a command."""

    returncode: int
    stdout: str
    stderr: str


Command = Callable[..., Done]


@pytest.fixture
def hertzlink(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Iterator[Command]:
    """The command line in this process: its arguments, and the folder that it runs in."""

    def run(*arguments: str, cwd: Path) -> Done:
        monkeypatch.chdir(cwd)
        with warnings.catch_warnings(), pytest.raises(SystemExit) as end:
            main(arguments)
        return Done(int(end.value.code or 0), *capsys.readouterr())

    handler, form = signal.getsignal(signal.SIGTERM), warnings.formatwarning
    yield run
    signal.signal(signal.SIGTERM, handler)
    warnings.formatwarning = form


TAP = """
chain = { beads = 4, bead = { shape = "sphere", radius = "2.38 mm", material = "steel 440C" }, impact_speed = 0.1 }
structure = { kind = "half_space", material = "steel 440C" }
run.until = "0.1 ms"
"""


@pytest.mark.thorough
def test_files_beside_a_case_neither_run_nor_redirect(tmp_path: Path) -> None:
    """Neither modules named like libraries, in this process and in those of a sweep, nor settings of libraries."""
    (tmp_path / "tap.toml").write_text(TAP + '[sweep]\n"chain.impact_speed" = [0.1, 0.2]\n')
    for name in ("joblib", "numpy", "scipy", "click", "numba"):
        (tmp_path / f"{name}.py").write_text("open('ran', 'w')\nraise SystemExit('this ran')\n")
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: theirs\n")
    (tmp_path / "matplotlibrc").write_text("text.usetex: true\n")
    # The usual folder of kernels is found without NUMBA_CACHE_DIR.
    (tmp_path / "caches").mkdir()
    (tmp_path / "caches" / "hertzlink").symlink_to(FOLDER.parent)
    settings = {name: value for name, value in os.environ.items() if name not in ("NUMBA_CACHE_DIR", "PYTHONPATH")}
    settings["XDG_CACHE_HOME"] = str(tmp_path / "caches")
    words = [sys.executable, "-m", "hertzlink", "run", "tap.toml", "--jobs", "2"]
    done = subprocess.run(words, cwd=tmp_path, env=settings, capture_output=True, text=True, check=False)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    assert not (tmp_path / "ran").exists()
    assert not (tmp_path / "theirs").exists()
    assert "<img" in (tmp_path / "tap" / "report.html").read_text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["deep.toml"], "deep.toml: is nested too deeply"),
        (["loop.toml"], "loop.toml: cannot be read (Too many levels of symbolic links)"),
        (["tap.toml", "--set", "title=" + 900 * "["], "--set title: is nested too deeply"),
    ],
)
def test_a_case_without_end_is_one_line(tmp_path: Path, hertzlink: Command, words: list[str], message: str) -> None:
    (tmp_path / "tap.toml").write_text(TAP)
    (tmp_path / "deep.toml").write_text("a = " + 900 * "[" + 900 * "]")
    (tmp_path / "loop.toml").symlink_to("loop.toml")
    done = hertzlink("check", *words, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (2, "", f"{message}\n")


def test_a_figure_that_fails_leaves_the_numbers(
    tmp_path: Path, hertzlink: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object, **__: object) -> None:
        raise RuntimeError("latex could not be found")

    (tmp_path / "tap.toml").write_text(TAP)
    monkeypatch.setattr("hertzlink.reports.page_of", fails)
    done = hertzlink("run", "tap.toml", cwd=tmp_path)
    assert done.returncode == 0
    assert "warning: the report is not complete: latex could not be found" in done.stderr
    names = {path.name for path in (tmp_path / "tap").iterdir()}
    assert {"results.nc", "table.txt", "waves.csv", "case.toml"} <= names


def test_a_picture_of_a_signal_replaces_only_one_of_hertzlinks(
    tmp_path: Path, hertzlink: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    time = np.arange(0.0, 1e-3, 1e-6)
    np.savetxt(tmp_path / "tap.csv", np.c_[time, np.exp(-(((time - 4e-4) / 2e-5) ** 2))], delimiter=",")
    (tmp_path / "keep.png").write_bytes(b"a photograph")
    (tmp_path / "link.png").symlink_to("keep.png")
    for name in ("keep.png", "link.png"):
        done = hertzlink("signal", "tap.csv", "--picture", name, cwd=tmp_path)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith(f"hertzlink: --picture {name}: exists already, and hertzlink did not write it")
    assert (tmp_path / "keep.png").read_bytes() == b"a photograph"
    assert "must end with .png" in hertzlink("signal", "tap.csv", "--picture", "a.bmp", cwd=tmp_path).stderr
    np.savetxt(tmp_path / "bare.csv", np.exp(-(((time - 4e-4) / 2e-5) ** 2)))
    for interval in ("1 us", "1e-6"):
        done = hertzlink("signal", "bare.csv", "--interval", interval, "--picture", "tap-signal.png", cwd=tmp_path)
        assert "one every 1 µs" in done.stdout
    for unit in ("V", "N"):  # its own is replaced
        assert hertzlink("signal", "tap.csv", "--time-unit", "s", "--unit", unit, cwd=tmp_path).returncode == 0
    picture = (tmp_path / "tap-signal.png").read_bytes()

    # On a full disk the earlier picture stays, and the message names it.
    def full(self: Path, content: bytes) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(Path, "write_bytes", full)
    done = hertzlink("signal", "tap.csv", cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr == "hertzlink: tap-signal.png: No space left on device; nothing was changed\n"
    assert (tmp_path / "tap-signal.png").read_bytes() == picture


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["study", "rod-stifness"], "'rod-stifness' is not one of the studies; did you mean rod-stiffness"),
        (["study"], "Missing argument 'NAME'"),
        (["study", "plate-boundary", "--jobs", "0"], "--jobs"),
        (["study", "plate-boundary", "--output", "no/such/place"], "parent folder does not exist"),
        (["study", "plate-boundary", "--output", "file"], "is a file"),
        (["study", "plate-boundary", "--sideways"], "--sideways"),
        (["signal", "tap.toml"], "tap.toml: is a case; give the file of a scope or recorder"),
        (["signal", "file", "--interval", "1 kg"], '--interval: "1 kg": "kg" is not a unit of this quantity'),
        (["identify", "case.toml"], "Missing argument 'TRACE'. Usage: hertzlink identify [OPTIONS] CASE.toml TRACE"),
        (["plot"], "No such command 'plot'"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    tmp_path: Path, hertzlink: Command, arguments: list[str], message: str
) -> None:
    (tmp_path / "file").write_text("mine")
    done = hertzlink(*arguments, cwd=tmp_path)
    assert done.returncode == 2
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize(
    ("output", "message"),
    [
        pytest.param(
            "/proc/results",
            "cannot be written",
            marks=pytest.mark.skipif(not Path("/proc").is_dir(), reason="no /proc"),
        ),
        ("file/results", "its parent folder does not exist"),
        ("loop", "cannot be written"),
        ("loop/results", "cannot be written"),
        ("long" * 100, "cannot be written"),
    ],
)
def test_a_folder_that_cannot_be_written_is_refused_before_the_study(
    tmp_path: Path, hertzlink: Command, monkeypatch: pytest.MonkeyPatch, output: str, message: str
) -> None:
    ran = []
    monkeypatch.setattr("hertzlink.studies.command.study", ran.append)
    (tmp_path / "file").write_text("mine")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    done = hertzlink("study", "rod-stiffness", "--quick", "--output", output, cwd=tmp_path)
    assert done.returncode == 2
    assert done.stderr.startswith(f"hertzlink: --output {output}: ")
    assert message in done.stderr
    assert done.stderr.count("\n") == 1
    assert not ran
    assert sorted(path.name for path in tmp_path.iterdir()) == ["file", "loop"]


@pytest.mark.parametrize("command", ["", *cli.commands])
def test_help_fits_a_terminal(
    tmp_path: Path, hertzlink: Command, command: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is cut off, and every section of the thesis is named as one."""
    monkeypatch.setenv("COLUMNS", "80")
    said = hertzlink(*filter(None, [command]), "--help", cwd=tmp_path).stdout
    assert max(map(len, said.splitlines())) <= 80
    assert "..." not in re.sub(r"(\[ARGS\]|FILE)\.\.\.", "", said)
    assert not re.search(r"\(\d+\.\d", said)


def test_info_and_help(tmp_path: Path, hertzlink: Command) -> None:
    info = hertzlink("info", cwd=tmp_path)
    assert info.returncode == 0
    for word in ("python", "numba", "threads", "installed in"):
        assert word in info.stdout
    assert "study" in hertzlink("--help", cwd=tmp_path).stdout
    assert "by default CASE-found" in " ".join(hertzlink("identify", "--help", cwd=tmp_path).stdout.split())
    listed = hertzlink("new", "--help", cwd=tmp_path).stdout
    assert all(kind in listed for kind in KINDS)
    suggested = ShellComplete(cli, {}, "hertzlink", "_HERTZLINK_COMPLETE").get_completions(["study"], "rod")
    assert [one.value for one in suggested] == ["rod-stiffness", "rod-length"]
    nothing = hertzlink(cwd=tmp_path)
    assert nothing.returncode == 2
    assert "Commands:\n" in nothing.stderr


@pytest.mark.parametrize("output", [".", "..", "", "mine", "link", "flat"])
def test_force_never_deletes_what_it_did_not_write(tmp_path: Path, hertzlink: Command, output: str) -> None:
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


REPORTING = """
import signal

from coupling.cosimulation import CoSimulation
from hertzlink.cli import main

run = CoSimulation.run

def reporting(*given, **named):
    print("running", flush=True)
    return run(*given, **named)

CoSimulation.run = reporting
# A process that a shell started in the background ignores SIGINT, and so do those that it starts.
signal.signal(signal.SIGINT, signal.default_int_handler)
main()
"""
"""The command line, which reports on its standard output when a run begins."""


@pytest.mark.thorough
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGKILL])
def test_a_stopped_study_leaves_nothing(tmp_path: Path, sent: signal.Signals) -> None:
    """Stopped in the middle of its runs."""
    command = [sys.executable, "-c", REPORTING, "study", "rod-stiffness", "--jobs", "1"]
    pipe = subprocess.PIPE
    running = subprocess.Popen(command, cwd=tmp_path, stdout=pipe, stderr=pipe, start_new_session=True)
    assert running.stdout is not None
    assert running.stdout.readline() == b"running\n"
    for _ in range(10):
        os.killpg(running.pid, sent)
        try:
            running.communicate(timeout=30)
            break
        # Where a callback of the compiler's swallowed it, a user presses the keys again.
        except subprocess.TimeoutExpired:
            continue
    assert running.returncode not in (None, 0)
    assert list(tmp_path.iterdir()) == []


def write_old(folder: Path) -> None:
    with delivered(folder, False, "") as into:
        (into / "table.txt").write_text("old")


def test_a_message_is_one_line_and_a_path_is_whole(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Both can therefore be copied and searched."""
    long = "record: ends too early " + "and this is why, " * 8 + "so record longer"
    complain(long.replace(", ", ",\n"))
    assert capsys.readouterr().err == f"hertzlink: {long}\n"
    folder = tmp_path / ("taps of the second-day " * 3).strip()
    with delivered(folder, False, "done") as into:
        (into / "results.nc").touch()
    assert capsys.readouterr().out == f"done\n\nwritten to {folder.resolve()}:\nfiles.txt, results.nc\n"


def test_a_failed_write_keeps_the_old_folder(tmp_path: Path) -> None:
    folder = tmp_path / "results"
    write_old(folder)

    def fail() -> None:
        with delivered(folder, True, "") as into:
            (into / "half").write_text("half")
            raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        fail()
    assert [path.name for path in tmp_path.iterdir()] == ["results"]
    assert sorted(path.name for path in folder.iterdir()) == ["files.txt", "table.txt"]
    assert (folder / "table.txt").read_text() == "old"


def test_force_deletes_only_what_an_earlier_study_wrote(tmp_path: Path) -> None:
    """Neither a file that was added or changed, nor a link, nor one that the listing names but no study wrote."""
    folder = tmp_path / "results"

    def refused(named: str) -> None:
        before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
        with pytest.raises(ValueError, match=f"contains {named}, which no earlier command wrote, or which was changed"):
            check_output(folder, force=True)
        assert {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} == before

    write_old(folder)
    (folder / "notes.txt").write_text("mine")
    refused("notes.txt")
    (folder / "notes.txt").unlink()
    (folder / "table.txt").write_text("edited by hand")
    refused("table.txt")
    (folder / "table.txt").unlink()
    (folder / "table.txt").symlink_to(tmp_path / "thesis.tex")
    (tmp_path / "thesis.tex").write_text("old")
    refused("table.txt")
    (folder / "table.txt").unlink()
    (folder / "table.txt").mkdir()
    refused("table.txt")
    (folder / "table.txt").rmdir()
    (folder / "files.txt").write_text("files.txt\nmine.tex\n")
    (folder / "mine.tex").write_text("as an earlier version listed its files")
    refused("files.txt")
    assert (tmp_path / "thesis.tex").read_text() == "old"
    assert sorted(os.listdir(tmp_path)) == ["results", "thesis.tex"]


@pytest.mark.parametrize("force", [True, False])
def test_what_comes_while_a_study_writes_is_kept(tmp_path: Path, force: bool) -> None:
    """A file of the user's in the folder that is replaced, or the folder of another study."""
    folder = tmp_path / "results"
    if force:
        write_old(folder)

    def write() -> None:
        with delivered(folder, force, "") as into:
            (into / "table.txt").write_text("new")
            if not force:
                write_old(folder)
            (folder / "notes.txt").write_text("mine")

    words = r"that would be deleted; nothing was changed; the new folder is .*results-2"
    with pytest.raises(OSError, match=words):
        write()
    assert (folder / "table.txt").read_text() == "old"
    assert (folder / "notes.txt").read_text() == "mine"
    assert (tmp_path / "results-2" / "table.txt").read_text() == "new"


def test_an_interrupt_that_kept_something_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Although click wraps it."""

    def stopped(*_: object, **__: object) -> None:
        raise Stopped("3 of 16 parts kept in thesis.parts; run again to continue")

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(thesis, "run", stopped)
    with pytest.raises(SystemExit) as ended:
        main(["study", "thesis", "--quick"])
    assert ended.value.code == 130
    assert capsys.readouterr().err.strip() == "hertzlink: 3 of 16 parts kept in thesis.parts; run again to continue"


@pytest.mark.parametrize("name", ["SIGTERM", "SIGHUP"])
@pytest.mark.parametrize("ignored", [False, True])
def test_a_signal_to_end_is_as_ctrl_c_unless_it_is_ignored(
    hertzlink: Command, tmp_path: Path, name: str, ignored: bool
) -> None:
    """A terminal that closes sends SIGHUP; nohup ignores it."""
    number = getattr(signal, name)
    before = signal.signal(number, signal.SIG_IGN if ignored else signal.SIG_DFL)
    try:
        assert hertzlink("--version", cwd=tmp_path).returncode == 0
        assert (signal.getsignal(number) is signal.SIG_IGN) == ignored
        if not ignored:
            with pytest.raises(KeyboardInterrupt):
                signal.raise_signal(number)
    finally:
        signal.signal(number, before)


IN_A_SERVICE = """
import os
from hertzlink.__main__ import main
try:
    main(["info"])
finally:
    with open("said", "w") as file:
        print(file.fileno() > 2, [os.fstat(handle).st_size for handle in range(3)], os.environ["MPLBACKEND"], file=file)
"""


@pytest.mark.parametrize("closed", [pytest.param("", marks=pytest.mark.thorough), "012"])
def test_closed_streams_and_the_backend_of_a_notebook_do_no_harm(tmp_path: Path, closed: str) -> None:
    """What is printed has a place, no file gets the number of a stream, and figures are drawn into files."""
    (tmp_path / "script.py").write_text(IN_A_SERVICE)
    settings = {**os.environ, "MPLBACKEND": "module://no_such.backend"}
    command = f'"{sys.executable}" script.py <&0' + "".join(f" {handle}>&-" for handle in closed)
    shell = ["sh", "-c", command]
    done = subprocess.run(shell, cwd=tmp_path, env=settings, input="", capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert ("hertzlink" in done.stdout) == ("1" not in closed)
    assert (tmp_path / "said").read_text() == "True [0, 0, 0] Agg\n"
