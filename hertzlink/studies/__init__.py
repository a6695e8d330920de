"""Studies of the thesis and beyond it, one module each: run(quick, jobs) → Dataset, table(data), figures(data)."""

from importlib import import_module
from typing import TYPE_CHECKING, Protocol

import xarray as xr

from hertzlink.studies.table import Row

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STUDIES = {
    "aspect-ratio": "aspect_ratio",
    "plate-boundary": "plate_boundary",
    "critical-distance": "critical_distance",
    "rod-stiffness": "rod_stiffness",
    "rod-length": "rod_length",
    "upper-layer": "upper_layer",
    "lower-layer": "lower_layer",
    "ellipsoids": "ellipsoids",
    "cylinders": "cylinders",
    "hollow-spheres": "hollow_spheres",
    "dissipation": "dissipation",
    "deformable-chain": "deformable_chain",
    "contact-law": "contact_law",
    "symmetry": "symmetry",
    "identifiability": "identifiability",
}

RUNS = dict.fromkeys(STUDIES, (0, 0))
"""About how many runs a quick study and a whole one take, so that the remaining time can be estimated."""

__all__ = ["RUNS", "STUDIES", "Study", "study"]


def __dir__() -> list[str]:
    return sorted(__all__)


class Study(Protocol):
    """The functions of a study that the command line calls."""

    def run(self, quick: bool = False, jobs: int | None = None) -> xr.Dataset:
        """Simulate; `quick` runs a coarse version in seconds."""
        ...

    def table(self, data: xr.Dataset) -> list[Row]:
        """The thesis's numbers compared with those of hertzlink."""
        ...

    def figures(self, data: xr.Dataset) -> dict[str, "Figure"]:
        """Figures by file name."""
        ...


def study(name: str) -> Study:
    """The study of this name; its module is imported at this call."""
    return import_module(f"hertzlink.studies.{STUDIES[name]}")  # type: ignore[return-value]
