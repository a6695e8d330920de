"""The command that couples a case by preCICE: it writes the configuration, or runs one of the two ends."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from hertzlink.commands.case_commands import FORCE, of_case, output_option
from hertzlink.terminal import show, written

if TYPE_CHECKING:
    from xarray import Dataset

    from coupling.cosimulation import CoSimulation
    from hertzlink.cases.case import Case

CONFIGURATION = "precice-config.xml"


@click.command("precice", short_help="Couple a case by preCICE: write its configuration, or run one end.")
@of_case
@click.option(
    "--participant", type=click.Choice(["Chain", "Structure"]),
    help=f"Run this end of the coupling. {CONFIGURATION} lies beside CASE.toml.",
)  # fmt: skip
@output_option("CASE-precice, or CASE-Chain and CASE-Structure")
@FORCE
def precice_case(name: str, case: "Case", participant: str | None, output: Path | None, force: bool) -> None:
    """Couple chain and structure of a case by preCICE, each in a process of its own.

    Without --participant a folder gets preCICE's configuration and the case; with it one of the two runs there. Either
    may be replaced by another program that takes part in preCICE.
    """
    from coupling.results.provenance import provenance
    from hertzlink.output_folder import check_output, write_folder

    folder = output or Path(f"{Path(name).stem}-{participant or 'precice'}")
    check_output(folder, force)
    simulation, toml = _single(case), case.to_toml()
    if participant is None:
        files = {CONFIGURATION: _configuration(case, simulation).encode(), "case.toml": toml.encode()}
        lines = [f"In two terminals, in the folder {folder}:"]
        lines += [f"    hertzlink precice case.toml --participant {end}" for end in ("Structure", "Chain")]
    else:
        configuration, beside = Path(name).with_name(CONFIGURATION), Path(f"{Path(name).stem}-precice")
        if not configuration.is_file():
            cure = f"cd {beside}" if (beside / CONFIGURATION).is_file() else f"hertzlink precice {name} writes it"
            raise ValueError(f"{configuration}: there is no such file; {cure}")
        try:
            run, lines = _run(case, simulation, participant, configuration)
        except ImportError as error:
            raise click.ClickException(str(error)) from error
        data = run.assign_attrs(provenance({"case": toml, "participant": participant}))
        files = {"results.nc": bytes(data.to_netcdf(engine="h5netcdf"))}

    def write(into: Path) -> None:
        for file, content in files.items():
            (into / file).write_bytes(content)

    write_folder(folder, write, force)
    show("\n".join(lines))
    written(folder)


def _single(case: "Case") -> "CoSimulation":
    """Return the co-simulation of a case of one run, in which one chain touches one structure."""
    from hertzlink.cases.faults import Fault
    from hertzlink.cases.running import task_of
    from structures.moving import MovingStructure

    task = task_of(case)
    if task.kind != "run":
        raise Fault(("sweep",), "preCICE couples a single run; leave this section out")
    simulation = case.simulation()
    interface = simulation.interface
    if len(interface.chains) != 1 or not interface.single or not isinstance(interface.structures[0], MovingStructure):
        raise Fault(("chain",), "preCICE couples one chain and one structure, at the chain's last bead")
    return simulation


def _configuration(case: "Case", simulation: "CoSimulation") -> str:
    """Return the text of preCICE's configuration."""
    from coupling.ports.precice import precice_configuration

    side = simulation.interface.chains[0]
    assert side.surface is not None
    return precice_configuration(side.chain, side.surface, case.model.run.until, side.flexibility)


def _run(case: "Case", simulation: "CoSimulation", participant: str, file: Path) -> tuple["Dataset", list[str]]:
    """Return the run of one end, and what is printed of it."""
    from coupling.ports.precice import run_in_precice
    from coupling.results.ar_and_tof import reflections
    from hertzlink.cases.running import task_of
    from structures.moving import MovingStructure

    side, body = simulation.interface.chains[0], simulation.interface.structures[0]
    assert side.surface is not None
    assert isinstance(body, MovingStructure)
    if participant == "Structure":
        data = run_in_precice(body.structure, file)
        return data, [f"The structure took {float(data.interface_work[-1]):.4g} J."]
    data = run_in_precice(side.chain, file, side.surface, flexibility=side.flexibility, dt=side.dt)
    return data, [str(reflections(data, sensor)) for sensor in task_of(case).sensors]
