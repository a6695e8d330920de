"""Studies of the thesis and beyond it, one module each: run(quick, jobs), table(data), figures(data)."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Protocol, runtime_checkable

import xarray as xr

from hertzlink.studies.draw import Figure
from hertzlink.studies.table import Row


@dataclass(frozen=True)
class Entry:
    """An entry of `studies.toml`. runs: of a quick one and of a whole one; figures: captions by file name."""

    about: str
    runs: tuple[int, int]
    figures: Mapping[str, str]
    module: str = ""


STUDIES = {
    name: Entry(**entry)
    for name, entry in tomllib.loads(Path(__file__).with_name("studies.toml").read_text(encoding="utf-8")).items()
}

__all__ = ["STUDIES", "Entry", "LongStudy", "Study", "study"]


def __dir__() -> list[str]:
    return sorted(__all__)


class Study(Protocol):
    """A study, as the command line uses it."""

    def run(self, quick: bool = False, jobs: int | None = None) -> xr.Dataset:
        """Simulate; `quick` runs a coarse version in seconds."""
        ...

    def table(self, data: xr.Dataset) -> list[Row]:
        """Return the thesis's numbers compared with those of hertzlink."""
        ...

    def figures(self, data: xr.Dataset) -> dict[str, Figure]:
        """Return the figures by file name."""
        ...


@runtime_checkable
class LongStudy(Study, Protocol):
    """A study that keeps its parts as they are finished, and whose table is too long for a terminal."""

    def run(self, quick: bool = False, jobs: int | None = None, keep: Path | None = None) -> xr.Dataset:
        """Run as a Study. keep: a folder for the parts; a later run takes those that it finds there."""
        ...

    def summary(self, data: xr.Dataset) -> str:
        """Return what the terminal shows in place of the table."""
        ...


def study(name: str) -> Study:
    """Return the study of this name; its module is imported at this call."""
    module = STUDIES[name].module or name.replace("-", "_")
    return import_module(f"hertzlink.studies.{module}")  # type: ignore[return-value]
