"""Data that the thesis uses without a source: beads, chains, sensors, specimens, plates.

Nothing in the thesis confirms or refutes these numbers. Where a study takes one over, the table shows the study's.
"""

from collections.abc import Sequence
from typing import Any

from hertzlink.studies import (
    cylinders,
    dissipation,
    ellipsoids,
    hollow_spheres,
    lower_layer,
    on_plates,
    rod_length,
    rod_stiffness,
    struck_cylinders,
    upper_layer,
)
from hertzlink.studies.table import Row, Rows

row = Rows("thesis_inputs")


def table() -> list[Row]:
    """Return chapter 2, and the set-ups of chapters 3 to 6."""
    ours = _ours()
    return [row(name, ours.get(name)) for name in row.entries]


def _listed(values: object, factor: float = 1.0) -> str:
    return ", ".join(f"{factor * value:.4g}" for value in values)  # type: ignore[attr-defined]


def _range(lengths: Sequence[float]) -> str:
    return f"{1e3 * min(lengths):.4g} to {1e3 * max(lengths):.4g}"


def _set_up(study: Any) -> str:
    return f"{study.BEADS}, {study.FIRST} and {study.SECOND}, {study.IMPACT_SPEED:g}"


def _ours() -> dict[str, float | str]:
    """Return what the studies use, by the name of the quantity."""
    return {
        "radii of spheres, section 2.1": _listed((2.38, 4.76, 9.53)),
        "diameters, figure 5.1": _listed(ellipsoids.DIAMETERS, 1e3),
        "axes of ellipsoids, section 2.1": _listed((ellipsoids.MINOR, ellipsoids.MAJOR), 1e3),
        "radius and length of cylinders, section 2.1": _listed((cylinders.RADIUS, cylinders.LENGTH), 1e3),
        "hollow spheres: outer radius and Ri/Ro": _listed((1e3 * hollow_spheres.RADIUS, hollow_spheres.THIN)),
        "time constant of the sensors, section 2.2": 1e6 * rod_stiffness.TIME_CONSTANT,
        "chain of chapter 4: beads, speed in m/s": _listed((dissipation.BEADS, dissipation.IMPACT_SPEED)),
        "its sensors": _listed(dissipation.SENSORS),
        "chain of ellipsoids: beads, sensors, m/s": _set_up(ellipsoids),
        "dissipative ellipsoids: beads, sensors": "50; " + _listed(dissipation.ELLIPSOID_SENSORS),
        "chain of cylinders: beads, sensors, m/s": _set_up(cylinders),
        "chain of hollow spheres: beads, sensors, m/s": _set_up(hollow_spheres),
        "chain of section 6.1: beads, sensors": f"{struck_cylinders.BEADS}, 7 and 16",
        "drop of the striker": 1e3 * struck_cylinders.DROP_HEIGHT,
        "speed of the striker, section 6.2": on_plates.IMPACT_SPEED,
        "cylinders of section 6.1.1: radius, length": _listed((rod_stiffness.RADIUS, rod_stiffness.LENGTH), 1e3),
        "cylinders of section 6.1.2: radius, lengths": f"9.53, {_range(rod_length.LENGTHS)}",
        "layers of section 6.1.3: upper, lower": f"{_range(upper_layer.UPPERS)}, {1e3 * upper_layer.LOWER:.4g}",
        "layers of section 6.1.4: upper, lower": f"{1e3 * lower_layer.UPPER:.4g}, {_range(lower_layer.LOWERS)}",
        "side of the plates": 1e3 * on_plates.SIDE,
        "thicknesses of the plates": _listed(on_plates.THICKNESSES, 1e3),
        "diameters on plates": _listed(on_plates.DIAMETERS, 1e3),
    }
