"""Studies of the thesis and beyond it, a script each, with three functions.

`run(quick, jobs)` simulates and returns a Dataset; `quick` is a coarse version that takes seconds. `numbers(data)`
yields hertzlink's values of the numbers that the thesis prints, and a few more. `figures(data)` returns the figures by
file name. `printed.csv` holds the printed numbers, and `compare` says whether they agree. `captions.csv` holds the
captions of the figures.
"""

import csv
from importlib import import_module
from pathlib import Path
from types import ModuleType

STUDIES = {
    "thesis": "The whole thesis: a verdict on each of its numbers, and each corrected equation with a check.",
    "aspect-ratio": "The wave that the centre of a plate reflects, over bead diameter / thickness (section 6.2.1).",
    "plate-boundary": "The distance beyond which a plate's edge no longer changes the reflected wave (section 6.2.2).",
    "critical-distance": "The law for this distance: for which beads, edges and plates it holds.",
    "rod-stiffness": "The waves that a rod reflects, over its Young's modulus and for given materials (section 6.1.1).",
    "rod-length": "The waves that a rod reflects, over its length (section 6.1.2).",
    "upper-layer": "A stiff layer on a soft one: the waves over the upper layer's thickness (section 6.1.3).",
    "lower-layer": "A stiff layer on a soft one: the waves over the lower layer's thickness (section 6.1.4).",
    "ellipsoids": "Waves in chains of ellipsoids, lying and standing, and of spheres (section 5.3.1).",
    "cylinders": "Waves in chains of crossed cylinders, over their angle (section 5.3.2).",
    "hollow-spheres": "Waves in chains of hollow spheres, over the thickness of their walls (section 5.3.3).",
    "dissipation": "How a wave decays along a chain with losses (chapter 4).",
    "deformable-chain": "Beads that deform and vibrate, compared with point masses (sections 3.3 and 3.4).",
    "contact-law": "Contact laws by finite elements, compared with formulas (sections 3.3.1 and 5.3).",
}
"""What each study shows. Sections and chapters are those of the thesis."""


def study(name: str) -> ModuleType:
    """Return the module of a study, imported here."""
    return import_module(f"hertzlink.studies.{name.replace('-', '_')}")


def captions(name: str) -> dict[str, str]:
    """Return what the figures of a study show, by file name."""
    with Path(__file__).with_name("captions.csv").open(encoding="utf-8", newline="") as file:
        return {row["figure"]: row["caption"] for row in csv.DictReader(file) if row["study"] == name}
