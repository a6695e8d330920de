"""Studies of the thesis and beyond it, one module each: run(quick, jobs, **own), table(data), figures(data)."""

from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import xarray as xr

from hertzlink.studies.conditions import Conditions
from hertzlink.studies.draw import Figure
from hertzlink.studies.table import Row

STUDIES = {
    "thesis": "thesis",
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
    "yield": "yielding",
    "prestress": "prestress",
    "cracks": "cracks",
    "pressure": "pressure",
}

ABOUT = {
    "thesis": "The whole thesis: a verdict on each of its numbers, and each corrected equation with a check.",
    "aspect-ratio": (
        "What plates send back to a chain at their centre, over bead diameter / thickness (thesis, section 6.2.1)."
    ),
    "plate-boundary": (
        "From which distance on a plate's edge no longer changes what it sends back (thesis, section 6.2.2)."
    ),
    "critical-distance": "The law for this distance: how far it holds, for other beads, plates and corners.",
    "rod-stiffness": "What a rod sends back, over its Young's modulus and for given materials (thesis, section 6.1.1).",
    "rod-length": "What a rod sends back, over its length (thesis, section 6.1.2).",
    "upper-layer": "A stiff layer on a soft one: the waves over the upper layer's thickness (thesis, section 6.1.3).",
    "lower-layer": "A stiff layer on a soft one: the waves over the lower layer's thickness (thesis, section 6.1.4).",
    "ellipsoids": "Waves in chains of ellipsoids, lying and standing, and of spheres (thesis, section 5.3.1).",
    "cylinders": "Waves in chains of crossed cylinders, over their angle (thesis, section 5.3.2).",
    "hollow-spheres": "Waves in chains of hollow spheres, over the thickness of their walls (thesis, section 5.3.3).",
    "dissipation": "How a wave decays along a chain with losses (thesis, chapter 4).",
    "deformable-chain": "Beads that deform and vibrate, compared with point masses (thesis, sections 3.3 and 3.4).",
    "contact-law": (
        "Contact laws by finite and boundary elements, compared with formulas (thesis, sections 3.3.1 and 5.3)."
    ),
    "symmetry": "Whether a quarter of a plate or chain gives what the whole one does (thesis, section 3.5).",
    "identifiability": "What a trace determines of a plate's edge or a rod's bond, and what it is blind to.",
    "yield": "Which impacts of the thesis make beads yield, and what that changes (thesis, chapter 7).",
    "prestress": "What stress in a plate, a strip and a rail changes, and how well one trace gives the temperature.",
    "cracks": "At which amplitude a tap sees a crack or a delamination open, and where linear models hold.",
    "pressure": "What pressure in a ball, a tank and a vessel changes, and how well one trace gives it.",
}
"""What each study shows, in a line."""

RUNS = {
    "thesis": (16, 16),
    "aspect-ratio": (27, 27),
    "plate-boundary": (118, 442),
    "critical-distance": (263, 2443),
    "rod-stiffness": (23, 108),
    "rod-length": (36, 132),
    "upper-layer": (33, 111),
    "lower-layer": (27, 113),
    "ellipsoids": (26, 68),
    "cylinders": (28, 76),
    "hollow-spheres": (16, 40),
    "dissipation": (35, 45),
    "deformable-chain": (4, 16),
    "contact-law": (20, 20),
    "symmetry": (3, 3),
    "identifiability": (24, 182),
    "yield": (13, 13),
    "prestress": (3, 3),
    "cracks": (2, 2),
    "pressure": (3, 3),
}
"""About how many runs a quick study and a whole one take, so that the remaining time can be estimated; not for a
user's own parameters.
"""

__all__ = ["ABOUT", "RUNS", "STUDIES", "LongStudy", "Study", "study"]


def __dir__() -> list[str]:
    return sorted(__all__)


class Study(Protocol):
    """What the command line uses of a study."""

    Conditions: type[Conditions]
    """The parameters that can be changed."""

    def run(self, quick: bool = False, jobs: int | None = None, **own: Any) -> xr.Dataset:
        """Simulate; `quick` runs a coarse version in seconds. own: values of the Conditions, the others are the
        thesis's.
        """
        ...

    def table(self, data: xr.Dataset) -> list[Row]:
        """The thesis's numbers compared with those of hertzlink."""
        ...

    def figures(self, data: xr.Dataset) -> dict[str, Figure]:
        """Figures by file name."""
        ...


@runtime_checkable
class LongStudy(Study, Protocol):
    """A study that keeps its parts as they are finished, and whose table is too long for a terminal."""

    def run(self, quick: bool = False, jobs: int | None = None, keep: Path | None = None, **own: Any) -> xr.Dataset:
        """As a Study. keep: a folder for the parts; a later run takes those that it finds there."""
        ...

    def forget(self, folder: Path) -> None:
        """Remove the kept parts."""
        ...

    def summary(self, data: xr.Dataset) -> str:
        """What the terminal shows in place of the table."""
        ...


def study(name: str) -> Study:
    """The study of this name; its module is imported at this call."""
    return import_module(f"hertzlink.studies.{STUDIES[name]}")  # type: ignore[return-value]
