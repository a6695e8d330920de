"""A case as an object: data that build a co-simulation, and that are written as TOML."""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path as File
from typing import Any

import xarray as xr

from coupling.cosimulation import CoSimulation
from hertzlink.cases.building import simulation_of
from hertzlink.cases.checking import checked
from hertzlink.cases.entry_paths import parsed, put
from hertzlink.cases.faults import Fault, fault_of
from hertzlink.cases.model import CaseModel, run_entries
from hertzlink.cases.reading import Source, read_source
from hertzlink.cases.toml import as_toml
from hertzlink.cases.with_parts import load, names_of


@dataclass(frozen=True)
class Case:
    """One case: the data of its TOML file, and what they build.

    Parameters
    ----------
    data : dict
        The sections, as tomllib reads them.
    folder : Path
        The folder from which files that the case names are found.
    parts : tuple of Path
        Files of Python that describe parts which the case uses.
    """

    data: dict[str, Any]
    folder: File = field(default_factory=File)
    parts: tuple[File, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        # Another process makes its own tables: those of described parts have no module to be found in.
        return Case, (self.data, self.folder, self.parts)

    @cached_property
    def model(self) -> CaseModel:
        """The checked case; a Fault where it is wrong."""
        load(self.parts)
        return checked(self.data)

    @property
    def until(self) -> float:
        """Length of the record, s."""
        return self.model.run.until

    def simulation(self) -> CoSimulation:
        """Return the co-simulation; raise a ValueError that names the entry which is refused."""
        return simulation_of(self.model, self.folder)

    def run(self) -> xr.Dataset:
        """Run it, without its sweep."""
        return run_once(self, self.simulation())

    def changed(self, changes: Mapping[Any, Any]) -> "Case":
        """Return the same case with other values, by their paths as text or parts: {"structure.thickness": "1 mm"}."""
        data = deepcopy(self.data)
        for name, value in changes.items():
            put(data, parsed(name) if isinstance(name, str) else name, deepcopy(value))
        return replace(self, data=data)

    def to_toml(self) -> str:
        """Return the text of a case file, whose first lines name the files of parts of the user's own."""
        return "".join(f"# --with {name}\n" for name in names_of(self.parts)) + as_toml(self.data)


def run_once(case: Case, simulation: CoSimulation) -> xr.Dataset:
    """Run a simulation as the section [run] wants it."""
    run = case.model.run
    with of_run():
        return simulation.run(run.until, run.save_every)


@contextmanager
def of_run() -> Iterator[None]:
    """Turn messages that name an entry of the section [run] into its Faults."""
    try:
        yield
    except ValueError as error:
        fault = fault_of(str(error), run_entries())
        if fault.path:
            raise fault from error
        raise


def read(path: str | File, changes: Iterable[str] = (), parts: tuple[File, ...] = ()) -> tuple[Case, Source]:
    """Return a case from a file, with changes of the form path=value, and where its entries stand.

    parts: files of Python that describe parts which the case uses; their code runs.
    """
    source = read_source(path, changes)
    case = Case(source.data, source.folder, parts)
    try:
        _ = case.model
    except Fault as fault:
        raise source.error(fault) from None
    return case, source
