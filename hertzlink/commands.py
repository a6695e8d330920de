"""The commands that are rarely used: signals, the explorer, and coupling by preCICE."""

import threading
import webbrowser
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hertzlink.cli import FORCE, of_case, output_option
from hertzlink.output import REMARKS, check_output, delivered, say, write_file
from structures.checks import existing
from structures.quantities import Likely
from structures.units import NUMBER

if TYPE_CHECKING:
    from hertzlink.cases.case import Case

CONFIGURATION = "precice-config.xml"


@click.command("signal", short_help="Show what a file of a scope or recorder holds.")
@click.argument("file", metavar="FILE", type=click.Path(path_type=Path))
@click.option("--interval", metavar="TIME", help='Time between samples, such as "0.5 us", of a file without times.')
@click.option("--time-unit", type=click.Choice(["s", "ms", "us", "ns"]), help="Unit of the times.")
@click.option("--unit", type=click.Choice(["V", "mV", "N", "kN"]), help="Unit of the channels.")
@click.option(
    "--picture", metavar="PICTURE", type=click.Path(path_type=Path), help="The picture; by default FILE-signal.png."
)
def show_signal(
    file: Path, interval: str | None, time_unit: str | None, unit: str | None, picture: Path | None
) -> None:
    """Show what a file of a scope or recorder holds: channels, units, sampling, range, clipping, noise and hum.

    A picture of the channels is written to the current folder. Nothing is fitted; `hertzlink identify` does that.
    """
    from coupling.signals.channels import Sampling
    from coupling.signals.overview import overview
    from hertzlink.cases.reader import number
    from hertzlink.channels import OURS, as_options, drawn, table

    if file.suffix == ".toml":
        raise ValueError(f"{file}: is a case; give the file of a scope or recorder")
    name = picture or Path(f"{file.stem}-signal.png")
    if name.is_symlink() or (name.exists() and OURS.encode() not in name.read_bytes()):
        raise ValueError(f"--picture {name}: exists already, and hertzlink did not write it; give another name")
    if name.suffix[1:] not in REMARKS:
        raise ValueError(f"--picture {name}: must end with .{', .'.join(REMARKS)}")
    plain = NUMBER.fullmatch(interval or "")
    text = f"{interval} s" if plain and not plain[2] else interval
    seconds = None if interval is None else number(text, Likely.TIME, ("--interval",))
    try:
        seen = overview(existing(str(file), file), Sampling(time_unit=time_unit, unit=unit, interval=seconds))
    except ValueError as error:
        raise ValueError(as_options(str(error))) from error
    say(table(seen))
    write_file(name, drawn(seen, name.suffix[1:]))
    say(f"written: {name}")


@click.command("explore", short_help="Open a page with sliders for a case, in the browser.")
@of_case
@click.option(
    "--port", metavar="NUMBER", type=click.IntRange(0, 65535), default=0,
    help="Port of the page; by default a free one.",
)  # fmt: skip
@click.option("--no-browser", is_flag=True, help="Print the address of the page without opening a browser.")
def explore_case(name: str, case: "Case", port: int, no_browser: bool) -> None:
    """Open a page with sliders for a case, in the browser.

    It shows at once how the force at a sensor, the amplitude ratio (AR) and the time of flight (TOF) of the reflected
    waves change. The sliders are the axes of [sweep] (without it, the usual parameters of the structure), the impact
    speed and the sensor. Only this computer can open the page. Ctrl-C ends the command.
    """
    from hertzlink.cases.tasks import task_of
    from hertzlink.explore.answers import Explorer, modes_for
    from hertzlink.explore.server import Server
    from hertzlink.explore.sliders import sliders_of, start_of

    task = task_of(case)
    start = start_of(task)
    start.simulation()  # raises an error for a wrong case, before sliders are made
    explorer, notes = Explorer(start, sliders_of(task, start)), list[str]()
    # The first answer also loads compiled code, and its errors appear before any page opens.
    own = explorer.answer({})["waves"]["primary"].get("amplitude_ratio")
    explorer.modes = modes_for(start, explorer.sliders)
    if explorer.modes is not None:
        say("preparing the plate for all values of its sliders: this takes some seconds, once ...")
        notes = ["All plates come from one set of modes."]
        of_modes = explorer.answer({})["waves"]["primary"].get("amplitude_ratio")
        if own is not None and of_modes is not None:
            notes[0] += f" At the first values AR differs by {abs(of_modes - own):.1e} from that of `hertzlink run`."
        say(notes[0])
    try:
        server = Server(explorer, case.title or Path(name).stem, notes, port)
    except OSError as error:
        raise ValueError(
            f"--port {port}: cannot be used ({error.strerror}); give another one, or leave it out"
        ) from error
    with server:
        say(f"open {server.address}\nCtrl-C ends it")
        if not no_browser:
            # In a thread: a browser may wait for the page.
            threading.Thread(target=webbrowser.open, args=(server.address,), daemon=True).start()
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            # Waits for the running answer; later ones never begin. A thread that computes must not outlive the program.
            explorer.one_at_a_time.acquire()
            say("ended")


@click.command("precice", short_help="Couple a case by preCICE: write its configuration, or run one participant.")
@of_case
@click.option(
    "--participant", type=click.Choice(["Chain", "Structure"]),
    help=f"Run this participant. {CONFIGURATION} must lie beside CASE.toml.",
)  # fmt: skip
@output_option("CASE-precice, or CASE-Chain and CASE-Structure, for CASE.toml")
@FORCE
def precice_case(name: str, case: "Case", participant: str | None, output: Path | None, force: bool) -> None:
    """Couple chain and structure of a case by preCICE, each in a process of its own.

    Without --participant, a folder is written with preCICE's configuration and the case. There, run the command with
    --participant twice, once for each participant. Another preCICE participant may replace either.
    """
    from coupling.ports.precice import precice_configuration, run_in_precice
    from coupling.results.ar_and_tof import reflections
    from coupling.results.provenance import provenance
    from hertzlink.cases import Fault
    from hertzlink.cases.tasks import task_of
    from structures.moving import MovingStructure

    folder = output or Path(f"{Path(name).stem}-{participant or 'precice'}")
    check_output(folder, force)
    task = task_of(case)
    if task.kind != "run":
        raise Fault(("sweep",), "preCICE couples a single run; leave this section out")
    interface = case.simulation().interface
    side, body = interface.chains[0], interface.structures[0]
    if len(interface.chains) != 1 or not interface.single or not isinstance(body, MovingStructure):
        raise Fault(("chain",), "preCICE couples one chain and one structure, at the chain's last bead")
    assert side.surface is not None  # of a chain that touches a structure

    if participant is None:
        text = precice_configuration(side.chain, side.surface, case.until, side.flexibility)
        files = {CONFIGURATION: text.encode(), "case.toml": case.to_toml().encode()}
        start = "    hertzlink precice case.toml --participant"
        lines = [f"In two terminals, in the folder {folder}:", f"{start} Structure", f"{start} Chain"]
    else:
        file, beside = Path(name).with_name(CONFIGURATION), Path(f"{Path(name).stem}-precice")
        if not file.is_file():
            cure = f"cd {beside}" if (beside / CONFIGURATION).is_file() else f"hertzlink precice {name} writes it"
            raise ValueError(f"{file}: there is no such file; {cure}")
        try:
            if participant == "Structure":
                run = run_in_precice(body.structure, file)
                lines = [f"The structure took {float(run.interface_work[-1]):.4g} J."]
            else:
                run = run_in_precice(side.chain, file, side.surface, flexibility=side.flexibility, dt=side.dt)
                lines = [str(reflections(run, sensor)) for sensor in task.sensors]
        except ImportError as error:
            raise click.ClickException(str(error)) from error
        data = run.assign_attrs(provenance({"case": case.to_toml(), "participant": participant}))
        files = {"results.nc": bytes(data.to_netcdf(engine="h5netcdf"))}

    with delivered(folder, force, "\n".join(lines)) as into:
        for file_name, content in files.items():
            (into / file_name).write_bytes(content)
