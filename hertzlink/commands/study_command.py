"""`hertzlink study NAME`: one command for each study, with options for its own parameters."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from hertzlink.studies import STUDIES, study
from hertzlink.studies.conditions import Conditions, Option, WrongValue
from hertzlink.studies.writing import FORMATS
from structures.checks import did_you_mean

OWN_NOTE = """A number without a unit is in SI units; with a unit it is written as "1 mm". Several values are separated
by commas, or the option is repeated. Brackets hold the defaults, which are the values of the thesis. If a value differs
from the thesis, the table has no column of the thesis, and table, figures and netCDF say what differs."""


def folder_options(default: str) -> tuple[click.Parameter, ...]:
    """Return where a study's results go, and in which format its figures. default: the folder, in words."""
    words = f"Folder for the results; by default {default}."
    formats = click.Choice(list(FORMATS))
    return (
        click.Option(["--output"], metavar="FOLDER", type=click.Path(path_type=Path), help=words),
        click.Option(["--force"], is_flag=True, help="Replace the output folder if it holds an earlier study."),
        click.Option(["--figures", "form"], type=formats, default="png", help="Format of the figures; by default png."),
    )


def common_options() -> list[click.Parameter]:
    """Return the options of every study."""
    output, force, form = folder_options("named as the study")
    quick = click.Option(["--quick"], is_flag=True, help="A coarse version that runs in seconds.")
    words = "Number of processes; by default a suitable number."
    jobs = click.Option(["--jobs"], metavar="NUMBER", type=click.IntRange(min=1), help=words)
    return [quick, output, force, jobs, form]


class Studies(click.Group):
    """The studies, each a command that is made when it is asked for: help of one does not load the others.

    run: called with the name, quick, output, force, jobs, form and the parameters that the user gave.
    """

    def __init__(self, name: str, run: Callable[..., None]) -> None:
        about = "Run a study of the thesis, or one beyond it: netCDF, figures, a table and a report."
        short, words = "Run a study of the thesis, or one beyond it.", "NAME [OPTIONS]"
        super().__init__(name, help=about, short_help=short, subcommand_metavar=words, no_args_is_help=False)
        self.run = run

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the studies."""
        return list(STUDIES)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of one study; its module is loaded here."""
        return StudyCommand(cmd_name, self.run) if cmd_name in STUDIES else None

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the studies with what they show, without loading them."""
        with formatter.section("Studies"):
            formatter.write_dl([(name, entry.about) for name, entry in STUDIES.items()])
        formatter.write_paragraph()
        formatter.write_text("hertzlink study NAME --help lists what can be changed in a study.")

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Options may stand before the name."""
        if ctx.resilient_parsing:  # as a shell completes what is typed so far
            return super().parse_args(ctx, args)
        if not args:
            raise click.UsageError(f"Missing argument 'NAME': one of {', '.join(STUDIES)}")
        place = next((i for i, word in enumerate(args) if word in STUDIES and args[max(0, i - 1)] != "--output"), 0)
        return super().parse_args(ctx, [args[place], *args[:place], *args[place + 1 :]])

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        """Return the command, or a message with the nearest names."""
        if args[0] not in STUDIES and not ctx.resilient_parsing:
            meant = did_you_mean(args[0], STUDIES, str) or f"there are {', '.join(STUDIES)}"
            raise click.UsageError(f"study {args[0]!r} is not one of the studies; {meant}")
        return super().resolve_command(ctx, args)


class StudyCommand(click.Command):
    """One study. Its options are those of all studies, and its own parameters."""

    def __init__(self, name: str, run: Callable[..., None]) -> None:
        self.conditions: type[Conditions] = getattr(study(name), "Conditions", Conditions)
        self.own = self.conditions.options()
        options = [_option(parameter, option) for parameter, option in self.own.items()]
        super().__init__(name, params=[*options, *common_options()], callback=self._run, help=STUDIES[name].about)
        self._study = run

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Return an option that does not exist leads to a message with the parameters of the study."""
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            names = ", ".join(map(_typed, self.own)) or "none"
            raise click.UsageError(f"{self.name}: no such option {error.option_name}; parameters: {names}") from error

    def _run(self, quick: bool, output: Path | None, force: bool, jobs: int | None, form: str, **options: Any) -> None:
        stated = {name: value for name, value in options.items() if value not in (None, ())}
        try:
            values = {name: self.own[name].read(name, value) for name, value in stated.items()}
            self.conditions.of(values)
        except WrongValue as error:
            raise click.UsageError(f"{_typed(error.name)} {_given(error.value)}: {error.cure}") from error
        self._study(str(self.name), quick, output, force, jobs, form, stated)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the study's own parameters, with unit and default, then the options of all studies."""
        if self.own:
            with formatter.section("Parameters of this study"):
                formatter.write_dl([_line(self.conditions, name, option) for name, option in self.own.items()])
            formatter.write_paragraph()
            formatter.write_text(OWN_NOTE)
        else:
            formatter.write_paragraph()
            formatter.write_text("This study checks a method in fixed cases: nothing of it can be changed.")
        records = [record for option in common_options() if (record := option.get_help_record(ctx))]
        with formatter.section("Options of all studies"):
            formatter.write_dl([*records, ("-h, --help", "Show this message.")])


def _option(name: str, option: Option) -> click.Parameter:
    return click.Option([_typed(name)], multiple=option.several, metavar=_metavar(option))


def _typed(name: str) -> str:
    return f"--{name.replace('_', '-')}"


def _given(value: object) -> str:
    if isinstance(value, tuple | list):
        return ",".join(map(_given, value))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _metavar(option: Option) -> str:
    if option.kind is None:
        return "MATERIAL"
    return "WORD" if option.choices else "NUMBER"


def _line(conditions: type[Conditions], name: str, option: Option) -> tuple[str, str]:
    default, words = conditions.thesis(name), f" One of {', '.join(option.choices)}." if option.choices else ""
    shown = f" [{option.shown(default)}]" if default is not None else ""
    return f"{_typed(name)} {_metavar(option)}", f"{option.says}.{words}{shown}"
