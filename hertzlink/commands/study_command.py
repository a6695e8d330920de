"""`hertzlink study NAME`: the studies and their options."""

from pathlib import Path

import click

from hertzlink.studies import STUDIES
from hertzlink.studies.writing import FORMATS
from structures.checks import did_you_mean


def folder_options(default: str) -> tuple[click.Parameter, ...]:
    """Return where a study's results go, and in which format its figures. default: the folder, in words."""
    words = f"Folder for the results; by default {default}."
    formats = click.Choice(list(FORMATS))
    return (
        click.Option(["--output"], metavar="FOLDER", type=click.Path(path_type=Path), help=words),
        click.Option(["--force"], is_flag=True, help="Replace the output folder if it holds an earlier study."),
        click.Option(["--figures", "form"], type=formats, default="png", help="Format of the figures; by default png."),
    )


def study_options() -> list[click.Parameter]:
    """Return the name of a study and the options of every study."""
    output, force, form = folder_options("named as the study")
    quick = click.Option(["--quick"], is_flag=True, help="A coarse version that runs in seconds.")
    words = "Number of processes; by default a suitable number."
    jobs = click.Option(["--jobs"], metavar="NUMBER", type=click.IntRange(min=1), help=words)
    return [click.Argument(["name"], type=StudyName(), metavar="NAME"), quick, output, force, jobs, form]


class StudyName(click.Choice[str]):
    """The name of a study; a wrong one leads to a message with the nearest names."""

    def __init__(self) -> None:
        super().__init__(list(STUDIES))

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the name."""
        if value not in STUDIES:
            meant = did_you_mean(value, STUDIES, str) or f"there are {', '.join(STUDIES)}"
            raise click.UsageError(f"study {value!r} is not one of the studies; {meant}")
        return value


class StudyCommand(click.Command):
    """The command, whose help lists the studies with what they show, without loading them."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the studies."""
        with formatter.section("Studies"):
            formatter.write_dl([(name, entry.about) for name, entry in STUDIES.items()])
