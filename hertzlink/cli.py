"""The command line: `hertzlink study NAME` and `hertzlink info`."""

import logging
import os
import shutil
import signal
import sys
import tempfile
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
import joblib

from coupling.results.findings import one_of_each, warn, with_warnings
from coupling.results.provenance import provenance, versions
from coupling.state import NotConverged
from hertzlink.studies import STUDIES, study
from hertzlink.studies.table import text
from structures.caution import HertzlinkWarning, collected

PLAIN_FORMAT = warnings.formatwarning

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WRONG_INPUT = 2
TABLE = "table.txt"
QUICK = "quick run (--quick), for a first look only"
"""What every table, figure and Dataset of a run with --quick says."""

STRIP = 0.2
"""Inches, below a figure, for these words."""

LISTING = "files.txt"
"""The names of all files in a folder of results: only a folder with these and no others may be replaced."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line; bad input ends with one line on standard error and exit code 2.

    arguments: those after the program's name; by default those of the process.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    logging.basicConfig(format="hertzlink: %(message)s", level=logging.WARNING)
    warnings.formatwarning = _format_warning
    # Behind the filters that the user gave.
    warnings.simplefilter("once", HertzlinkWarning, append=True)
    try:
        code = cli.main(arguments, prog_name="hertzlink", standalone_mode=False)
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.ctx.get_help() if error.ctx else "", err=True)
        code = WRONG_INPUT
    except click.ClickException as error:
        code = _complain(error.format_message(), WRONG_INPUT)
    except (ValueError, OSError) as error:
        code = _complain(str(error), WRONG_INPUT)
    except (FloatingPointError, NotConverged) as error:
        code = _complain(str(error), 1)
    except (click.Abort, KeyboardInterrupt):
        code = _complain("stopped; nothing was written", 130)
    sys.exit(code)


def _format_warning(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
) -> str:
    """Ours on one line, without the place in the code, which is not the user's here."""
    if issubclass(category, HertzlinkWarning):
        return "hertzlink: warning: " + " ".join(str(message).split()) + "\n"
    return PLAIN_FORMAT(message, category, filename, lineno, line)


def _complain(message: str, code: int) -> int:
    click.echo("hertzlink: " + " ".join(message.split()), err=True)
    return code


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(versions()["hertzlink"], prog_name="hertzlink")
def cli() -> None:
    """Chains of beads against structures: what the reflected waves tell."""


@cli.command("study", help=f"Run a study of the thesis: netCDF, figures and a table. NAME: {', '.join(STUDIES)}.")
@click.argument("name", metavar="NAME", type=click.Choice(list(STUDIES)))
@click.option("--quick", is_flag=True, help="A coarse version, in seconds.")
@click.option("--output", type=click.Path(path_type=Path), help="Folder for the results; by default named NAME.")
@click.option("--force", is_flag=True, help="Replace the output folder if it holds an earlier study.")
@click.option("--jobs", type=click.IntRange(min=1), help="Processes; by default as many as pay.")
def run_study(name: str, quick: bool, output: Path | None, force: bool, jobs: int | None) -> None:
    """Run a study of the thesis: netCDF, figures and a table."""
    folder = output or Path(name)
    check_output(folder, force)
    chosen = study(name)
    findings: list[str] = []
    try:
        with collected() as findings:
            data = chosen.run(quick, jobs).assign_attrs(quick=int(quick), **({"comment": QUICK} if quick else {}))
            table = (f"{QUICK}\n\n" if quick else "") + text(chosen.table(data))
            figures = chosen.figures(data)
    finally:
        warn(one_of_each(findings))
    given = {"study": name, "quick": quick, "first_run": data.attrs.get("input", "")}
    data = with_warnings(data.assign_attrs(provenance(given)), findings)

    def write(into: Path) -> None:
        data.to_netcdf(into / f"{name}.nc", engine="h5netcdf")
        (into / TABLE).write_text(table + "\n", encoding="utf-8")
        for title, figure in figures.items():
            if quick:
                stamp(figure, QUICK)
            figure.savefig(into / f"{title}.png", metadata={"Comment": QUICK} if quick else None)

    write_folder(folder, write, force)
    click.echo(table)
    click.echo(f"\nwritten to {folder.resolve()}: " + ", ".join(sorted(path.name for path in folder.iterdir())))


def stamp(figure: "Figure", words: str) -> None:
    """Write words into a strip of their own below a figure."""
    from matplotlib.layout_engine import ConstrainedLayoutEngine

    strip, layout = STRIP / figure.get_figheight(), figure.get_layout_engine()
    if isinstance(layout, ConstrainedLayoutEngine):
        layout.set(rect=(0.0, strip, 1.0, 1.0 - strip))
    figure.text(0.99, 0.3 * strip, words, ha="right", va="bottom", color="firebrick", fontsize="small")


@cli.command()
def info() -> None:
    """Versions, threads, and where things lie."""
    from numba import config, get_num_threads

    for package, version in versions().items():
        click.echo(f"{package:14s} {version}")
    click.echo(f"{'processes':14s} {joblib.cpu_count()}")
    click.echo(f"{'threads':14s} {get_num_threads()} (numba)")
    click.echo(f"{'installed in':14s} {Path(__file__).resolve().parent.parent}")
    click.echo(f"{'kernel cache':14s} {getattr(config, 'CACHE_DIR', '') or 'beside the kernels, in __pycache__'}")


def check_output(folder: Path, force: bool) -> None:
    """Raise ValueError where the folder cannot be written, before any work is done.

    With --force only a folder that holds the listed files of an earlier study, and nothing else, is replaced.
    """
    whole = folder.resolve()
    if whole.exists() and not whole.is_dir():
        raise ValueError(f"--output {folder}: is a file; name a folder")
    if whole == Path.cwd() or whole in Path.cwd().parents:
        raise ValueError(f"--output {folder}: holds the current folder; name another")
    if whole.exists() and not force:
        raise ValueError(f"--output {folder}: exists already; name another folder, or --force to replace it")
    if whole.exists():
        listed = (whole / LISTING).read_text(encoding="utf-8").split() if (whole / LISTING).is_file() else []
        foreign = sorted(path.name for path in whole.iterdir() if path.name not in listed)
        if foreign or not listed:
            raise ValueError(
                f"--output {folder}: holds {', '.join(foreign[:1]) or 'nothing'}, so it is no earlier study"
            )
    if not whole.parent.is_dir():
        raise ValueError(f"--output {folder}: its parent folder does not exist")
    if not os.access(whole.parent, os.W_OK):
        raise ValueError(f"--output {folder}: its parent folder cannot be written")


def write_folder(folder: Path, write: Callable[[Path], None], force: bool) -> None:
    """Write all files into a folder beside, then rename it: the folder is there whole, or not at all."""
    check_output(folder, force)
    folder = folder.resolve()
    beside = Path(tempfile.mkdtemp(prefix=f".{folder.name}-", dir=folder.parent))
    try:
        beside.chmod(0o755)
        write(beside)
        (beside / LISTING).write_text("\n".join([LISTING, *sorted(path.name for path in beside.iterdir())]) + "\n")
        old = beside.with_name(beside.name + "-old")
        if folder.exists():
            folder.rename(old)
        beside.rename(folder)
        shutil.rmtree(old, ignore_errors=True)
    finally:
        shutil.rmtree(beside, ignore_errors=True)
