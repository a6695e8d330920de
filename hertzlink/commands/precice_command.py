"""The command that couples a case by preCICE: it writes the configuration, or runs one of the two ends."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hertzlink.cli import FORCE, of_case, output_option
from hertzlink.output import check_output, deliver

if TYPE_CHECKING:
    from hertzlink.cases.case import Case

CONFIGURATION = "precice-config.xml"


@click.command("precice", short_help="Couple a case by preCICE: write its configuration, or run one end.")
@of_case
@click.option(
    "--participant", type=click.Choice(["Chain", "Structure"]),
    help=f"Run this end of the coupling. {CONFIGURATION} lies beside CASE.toml.",
)  # fmt: skip
@output_option("CASE-precice, or CASE-Chain and CASE-Structure, for CASE.toml")
@FORCE
def precice_case(name: str, case: "Case", participant: str | None, output: Path | None, force: bool) -> None:
    """Couple chain and structure of a case by preCICE, each in a process of its own.

    Without --participant a folder gets preCICE's configuration and the case; with it one of the two runs there. Either
    may be replaced by another program that takes part in preCICE.
    """
    from coupling.ports.precice import precice_configuration, run_in_precice
    from coupling.results.ar_and_tof import reflections
    from coupling.results.provenance import provenance
    from hertzlink.cases.source import Fault
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
        lines = [f"In two terminals, in the folder {folder}:"]
        lines += [f"    hertzlink precice case.toml --participant {end}" for end in ("Structure", "Chain")]
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

    def write(into: Path) -> None:
        for file_name, content in files.items():
            (into / file_name).write_bytes(content)

    deliver(folder, write, force, "\n".join(lines))
