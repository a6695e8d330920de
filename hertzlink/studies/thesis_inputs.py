"""What the thesis uses without saying where it comes from: beads, chains, sensors, specimens, plates.

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
    striking,
    upper_layer,
)
from hertzlink.studies.table import INPUT, Row


def table() -> list[Row]:
    """Chapter 2, and the set-ups of chapters 3 to 6."""
    return [*_particles(), *_chains(), *_specimens()]


def _used(quantity: str, thesis: str, ours: float | str = "", unit: str = "", reason: str = "") -> Row:
    return Row(quantity, thesis, ours, unit, reason or "used as printed" if ours != "" else reason, within=INPUT)


def _listed(values: object, factor: float = 1.0) -> str:
    return ", ".join(f"{factor * value:.4g}" for value in values)  # type: ignore[attr-defined]


def _range(lengths: Sequence[float]) -> str:
    return f"{1e3 * min(lengths):.4g} to {1e3 * max(lengths):.4g}"


def _set_up(study: Any) -> str:
    return f"{study.BEADS}, {study.FIRST} and {study.SECOND}, {study.IMPACT_SPEED:g}"


def _particles() -> list[Row]:
    return [
        _used("radii of spheres, section 2.1", "2.38, 4.76, 9.53 ± 0.01", _listed((2.38, 4.76, 9.53)), "mm"),
        _used("diameters, figure 5.1", "2.38, 4.76, 9.53, 19.1", _listed(ellipsoids.DIAMETERS, 1e3), "mm"),
        _used(
            "axes of ellipsoids, section 2.1",
            "4.72, 10.16 ± 0.01",
            _listed((ellipsoids.MINOR, ellipsoids.MAJOR), 1e3),
            "mm",
        ),
        _used(
            "radius and length of cylinders, section 2.1",
            "2.38, 4.76",
            _listed((cylinders.RADIUS, cylinders.LENGTH), 1e3),
            "mm",
        ),
        _used(
            "hollow spheres: outer radius and Ri/Ro",
            "9.525, 0.908",
            _listed((1e3 * hollow_spheres.RADIUS, hollow_spheres.THIN)),
            reason="radius in mm; the thesis also prints 9.53",
        ),
        _used(
            "ring around the sensor in hollow spheres",
            "19, 12, 0.75",
            "",
            "mm",
            "outer and inner diameter, thickness; its mass is not given, and it is left out",
        ),
        _used(
            "Kapton film at the sensors", "66", "", "µm", "its stiffness is left out: a sensor is half a bead before it"
        ),
        _used("time constant of the sensors, section 2.2", "1000", 1e6 * rod_stiffness.TIME_CONSTANT, "µs"),
        _used("scatter of the striker's speed, section 2.3", "0.45 %", "", "", "of the experiments; no run needs it"),
        _used("tilt of horizontal chains", "3", "", "°", "left out: gravity along the chain is 5 % of its own there"),
        _used("diameter of the actuator's bead", "4.76", "", "mm", "the experiments' actuator is not simulated"),
    ]


def _chains() -> list[Row]:
    return [
        _used(
            "chain of chapter 4: beads, speed in m/s",
            "70, 1.77",
            _listed((dissipation.BEADS, dissipation.IMPACT_SPEED)),
        ),
        _used("its sensors", "9, 16, 24, 31, 40, 50, 56, 63", _listed(dissipation.SENSORS)),
        _used("chain of section 3.3: beads, with the striker", "21", 21.0),
        _used("sensors of section 3.5", "7, 16", "7, 16"),
        _used("chain of ellipsoids: beads, sensors, m/s", "20, 7 and 12, 0.626", _set_up(ellipsoids)),
        _used(
            "dissipative ellipsoids: beads, sensors",
            "50; 8, 16, 28, 41",
            "50; " + _listed(dissipation.ELLIPSOID_SENSORS),
        ),
        _used("chain of cylinders: beads, sensors, m/s", "20, 7 and 13, 0.5", _set_up(cylinders)),
        _used(
            "chain of hollow spheres: beads, sensors, m/s",
            "29, 12 and 19, 0.32",
            _set_up(hollow_spheres),
            reason="in the text; the caption has 20 beads, and sensors 7 and 13",
        ),
        _used("chain of section 6.1: beads, sensors", "20, 7 and 16", f"{striking.BEADS}, 7 and 16"),
        _used("drop of the striker", "10", 1e3 * striking.DROP_HEIGHT, "mm"),
        _used("speed of the striker, section 6.2", "0.31", on_plates.IMPACT_SPEED, "m/s"),
    ]


def _specimens() -> list[Row]:
    return [
        _used(
            "cylinders of section 6.1.1: radius, length",
            "19.1, 76.2",
            _listed((rod_stiffness.RADIUS, rod_stiffness.LENGTH), 1e3),
            "mm",
        ),
        _used(
            "cylinders of section 6.1.2: radius, lengths",
            "9.53, 6.35 to 610",
            f"9.53, {_range(rod_length.LENGTHS)}",
            "mm",
        ),
        _used(
            "layers of section 6.1.3: upper, lower",
            "6.35 to 101.6, 25.4",
            f"{_range(upper_layer.UPPERS)}, {1e3 * upper_layer.LOWER:.4g}",
            "mm",
        ),
        _used(
            "layers of section 6.1.4: upper, lower",
            "6.35, 9.52 to 152.4",
            f"{1e3 * lower_layer.UPPER:.4g}, {_range(lower_layer.LOWERS)}",
            "mm",
            "section 6.1.4 also prints 6.25",
        ),
        _used("side of the plates", "914", 1e3 * on_plates.SIDE, "mm", "two opposite edges clamped, two free"),
        _used(
            "thicknesses of the plates",
            "2.29, 3.18, 4.83",
            _listed(on_plates.THICKNESSES, 1e3),
            "mm",
            "captions also print 2.28 and 9.52",
        ),
        _used(
            "diameters on plates",
            "4.76, 9.53, 19.1",
            _listed(on_plates.DIAMETERS, 1e3),
            "mm",
            "section 6.2.2 also prints 19.05",
        ),
        _used(
            "steps of the distance: up to 200 mm, then",
            "10, 20",
            "",
            "mm",
            "here critical distances are refined instead",
        ),
    ]
