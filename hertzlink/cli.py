"""The command line: cases, `hertzlink study NAME`, `hertzlink draw FILE` and `hertzlink info`."""

import errno
import hashlib
import re
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from time import perf_counter
from typing import Any

import click
import joblib

from coupling.files.writing import check_place, whole_folder
from coupling.results.findings import one_of_each, warn, with_warnings
from coupling.results.provenance import provenance, versions
from coupling.state import NotConverged
from coupling.sweeps.progress import one_bar
from hertzlink.cases.faults import CaseError
from hertzlink.commands.case_commands import COMMANDS
from hertzlink.commands.explore_command import explore_case
from hertzlink.studies import STUDIES, LongStudy, study
from hertzlink.studies.conditions import DIFFERS
from hertzlink.studies.writing import FORMATS, QUICK, Written, read_study
from hertzlink.study_options import Studies
from hertzlink.terminal import complain, set_up, show, written
from structures.caution import collected

WRONG_INPUT, FAILED, STOPPED = 2, 1, 130
"""Exit codes: for input that cannot be used, for a computation that failed, and after Ctrl-C. A command may return one
of its own, as `hertzlink identify` does."""

LISTING = "files.txt"
"""The file that lists all others in a folder of results with their SHA-256, as the program sha256sum does.

Only a folder that holds nothing but these files, unchanged, may be replaced.
"""

LISTED = re.compile(r"([0-9a-f]{64})  (.+)")
"""A line of the listing."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line. Bad input leads to one line on standard error and exit code 2.

    `arguments` are the words after the name of the program, by default those of the process.
    """
    for name in ("SIGTERM", "SIGHUP"):
        # One that is ignored stays so, as after nohup.
        if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) is not signal.SIG_IGN:
            signal.signal(getattr(signal, name), signal.default_int_handler)
    set_up()
    try:
        code = cli.main(arguments, prog_name="hertzlink", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help() if error.ctx else "", err=True)
        code = WRONG_INPUT
    except click.ClickException as error:
        complain(error.format_message())
        code = WRONG_INPUT
    except CaseError as error:
        # It begins with the line of a case file, where editors and terminals look for it.
        complain(str(error), "")
        code = WRONG_INPUT
    except OSError as error:
        complain(_in_words(error))
        code = WRONG_INPUT
    except ValueError as error:
        complain(str(error))
        code = WRONG_INPUT
    except (FloatingPointError, NotConverged) as error:
        complain(str(error))
        code = FAILED
    except (click.Abort, KeyboardInterrupt) as error:
        # click wraps an interrupt, which may say what was kept.
        complain(str(error.__cause__ or error) or "stopped; nothing was written")
        code = STOPPED
    sys.exit(code)


def _in_words(error: OSError) -> str:
    """What could not be used, and why, without the number of the error."""
    if error.strerror is None:
        return str(error)
    # What is printed has no name; a full disk under a file of results does, see `whole_folder`.
    of_print = error.errno == errno.ENOSPC and error.filename is None
    place = "standard output" if of_print else error.filename
    return error.strerror if place is None else f"{place}: {error.strerror}"


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(versions()["hertzlink"], prog_name="hertzlink")
def cli() -> None:
    """Solitary waves in chains of beads that touch a structure, and their reflections.

    Begin with `hertzlink new plate`, which writes plate.toml, then `hertzlink run plate.toml`.
    """


for _command in (*COMMANDS, explore_case):
    cli.add_command(_command)


def run_study(
    name: str, quick: bool, output: Path | None, force: bool, jobs: int | None, form: str, parameters: Mapping[str, Any]
) -> None:
    """Run a study of the thesis: netCDF, figures, a table and a report.

    form: of the figures; parameters: those that the user gave.
    """
    folder = output or Path(name)
    check_output(folder, force)
    chosen = study(name)
    parts = folder.with_name(f"{folder.name}.parts")
    keep = {"keep": parts} if isinstance(chosen, LongStudy) else {}
    findings: list[str] = []
    try:
        with collected() as findings, one_bar(name, 0 if parameters else STUDIES[name].runs[not quick]):
            begin = perf_counter()
            data = chosen.run(quick, jobs, **parameters, **keep)
            remark = "\n".join(part for part in (QUICK if quick else "", data.attrs.get(DIFFERS, "")) if part)
            data = data.assign_attrs(quick=int(quick), time_taken=perf_counter() - begin)
            found = Written(name, chosen, data.assign_attrs({"comment": remark} if remark else {}), form)
    finally:
        warn(one_of_each(findings))
    inputs = {"study": name, "quick": quick, "first_run": data.attrs.get("input", "")}
    attributes = provenance(inputs | ({"own": dict(parameters)} if parameters else {}))
    data = with_warnings(found.data.assign_attrs(attributes), findings)
    write_folder(folder, lambda into: found.write(into, data), force)
    if isinstance(chosen, LongStudy):
        chosen.forget(parts)
    show(found.shown)
    written(folder)


cli.add_command(Studies("study", run_study))


@cli.command("draw", short_help="Draw a study again from its netCDF file.")
@click.argument("store", metavar="FILE", type=click.Path(path_type=Path))
@click.option(
    "--output",
    metavar="FOLDER",
    type=click.Path(path_type=Path),
    help="Folder for the results; by default STUDY-drawn.",
)
@click.option("--force", is_flag=True, help="Replace the output folder if it holds an earlier study.")
@click.option(
    "--figures", "form", type=click.Choice(list(FORMATS)), default="png", help="Format of the figures; by default png."
)
def draw_study(store: Path, output: Path | None, force: bool, form: str) -> None:
    """Draw a study again, without a run: figures, table and report, from the netCDF FILE that the study wrote."""
    name, data = read_study(store)
    folder = output or Path(f"{name}-drawn")
    check_output(folder, force)
    found = Written(name, study(name), data, form)
    write_folder(folder, found.write_again, force)
    show(found.shown)
    written(folder)


@cli.command()
def info() -> None:
    """Show the versions, threads and folders of this installation."""
    from numba import config, get_num_threads

    for package, version in versions().items():
        click.echo(f"{package:14s} {version}")
    click.echo(f"{'processes':14s} {joblib.cpu_count()}")
    click.echo(f"{'threads':14s} {get_num_threads()} (numba)")
    click.echo(f"{'installed in':14s} {Path(__file__).resolve().parent.parent}")
    click.echo(
        f"{'kernel cache':14s} {getattr(config, 'CACHE_DIR', '') or '__pycache__, in the folders of the kernels'}"
    )


def check_output(folder: Path, force: bool) -> None:
    """Raise a ValueError if the folder cannot be written, before any computation.

    With --force only a folder that holds the listed files of an earlier study, unchanged, and no others, is replaced.
    """
    try:
        with suppress(FileNotFoundError, NotADirectoryError):
            folder.stat()  # fails on a link that leads to itself, which newer Pythons resolve without an error
        path = folder.resolve()
        _check_place(folder, path, force)
        check_place(path)
    except OSError as error:
        raise ValueError(
            f"--output {folder}: cannot be written ({error.strerror or error}); give another folder"
        ) from error


def _check_place(folder: Path, full_path: Path, force: bool) -> None:
    """Raise a ValueError if the folder, whose `full_path` is resolved, holds something else or has no parent."""
    if full_path.exists() and not full_path.is_dir():
        raise ValueError(f"--output {folder}: is a file; give a folder")
    if full_path == Path.cwd() or full_path in Path.cwd().parents:
        raise ValueError(f"--output {folder}: contains the current folder; give another one")
    if full_path.exists() and not force:
        raise ValueError(f"--output {folder}: exists already; give another folder, or use --force to replace it")
    if full_path.exists():
        is_ours = _own_files(full_path)
        foreign = sorted(path.name for path in full_path.iterdir() if not is_ours(path))
        if foreign or not (full_path / LISTING).is_file():
            raise ValueError(
                f"--output {folder}: contains {', '.join(foreign[:1]) or 'nothing'}, which no earlier command wrote, "
                "or which was changed since; move it away, or give another folder"
            )
    if not full_path.parent.is_dir():
        raise ValueError(f"--output {folder}: its parent folder does not exist")


def _own_files(folder: Path) -> Callable[[Path], bool]:
    """Whether an earlier study wrote a file of the folder, and nobody changed it since."""
    sums: dict[str, str] = {}
    if (folder / LISTING).is_file() and not (folder / LISTING).is_symlink():
        lines = (folder / LISTING).read_text(encoding="utf-8", errors="replace").splitlines()
        matches = [LISTED.fullmatch(line) for line in lines]
        if lines and all(matches):
            sums = {match[2]: match[1] for match in matches if match}

    def own(path: Path) -> bool:
        if path.is_symlink() or not path.is_file() or not sums:
            return False
        return path.name == LISTING or _sum_of(path) == sums.get(path.name)

    return own


def _sum_of(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def write_folder(folder: Path, write: Callable[[Path], None], force: bool) -> None:
    """Write all files into a temporary folder, then rename it. The folder thus appears complete, or not at all.

    The folder was checked before the work. Where something has come to lie there since, it gets another name: an
    OSError says so.
    """
    folder = folder.resolve()
    with whole_folder(folder, _own_files(folder) if force else lambda path: False) as temporary:
        write(temporary)
        lines = [f"{_sum_of(path)}  {path.name}\n" for path in sorted(temporary.iterdir())]
        (temporary / LISTING).write_text("".join(lines), encoding="utf-8")
