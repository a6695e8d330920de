"""Bad input to plates: each error names the argument and its value, in one line."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from plates.laminate import section_of

MATERIAL = hl.Material(1.0e9, 0.3, 1000.0)
STEEL = hl.STEEL_316
CARBON = hl.OrthotropicMaterial(140e9, 10e9, 0.3, 5e9, 5.2e9, 3.6e9, 1600.0, "carbon-epoxy")
LAMINATE = hl.Laminate([hl.Ply(CARBON, 1e-3, 0.3), hl.Ply(CARBON, 1e-3, 1.2)])
MASS = hl.PointMass(0.1, 0.1, 1.0)
WEAK = hl.Weakened((0.1, 0.2, 0.1, 0.2), 0.5)
BEAD = hl.Sphere(1e-3, hl.PTFE)

RECTANGLE = {
    "length": 0.3, "width": 0.2, "thickness": 2e-3, "material": MATERIAL, "supports": hl.Supports("clamped"),
}  # fmt: skip
THIN = (hl.kirchhoff_plate, RECTANGLE)
THICK = (hl.mindlin_plate, RECTANGLE)
HALF_PLANE = (hl.half_plane, {"thickness": 2e-3, "material": MATERIAL, "edge": "clamped", "distance": 0.02})
INFINITE = (hl.infinite_plate, {"thickness": 2e-3, "material": MATERIAL})
PLATE = hl.kirchhoff_plate(**RECTANGLE)  # type: ignore[arg-type]


def sheet(**changes: Any) -> hl.OrthotropicMaterial:
    return replace(CARBON, **changes)


def added(*additions: Any) -> hl.Plate:
    return hl.kirchhoff_plate(1.0, 0.7, 0.01, MATERIAL, hl.Supports(), cells=(4, 4), additions=additions)


BOTH = [({name: bad}, f"{name} = ") for name in ("length", "thickness") for bad in (0.0, np.nan)] + [
    ({"thickness": 0.5}, r"thickness = 0\.5: must not exceed the shorter side, 0\.2 m"),
    ({"material": "PTFE"}, "material = 'PTFE': must be a Material or a Laminate"),
    ({"supports": "free"}, "supports = 'free'"),
    ({"cells": (1, 2, 3)}, "cells = "),
    ({"additions": ["rib"]}, r"additions = \['rib'\]: must be a list of PointMass, Stiffener, Weakened and"),
    ({"cells": "ab"}, "cells = "),
]
"""Changes of the arguments that both builders of rectangles refuse."""


@pytest.mark.parametrize(
    ("builder", "changes", "message"),
    [
        *[(builder, *row) for builder in (THIN, THICK) for row in BOTH],
        (HALF_PLANE, {"highest_frequency": 1e-4}, r"highest_frequency = 0\.0001: must lie between 0\.001 and 1e\+12"),
        (HALF_PLANE, {"edge": "clampd"}, r"edge = 'clampd'.*did you mean 'clamped'"),
        (HALF_PLANE, {"distance": 0.0}, r"distance = 0\.0: must be a positive number of m"),
        (HALF_PLANE, {"distance": -0.1, "edge": "free"}, r"distance = -0\.1: must be zero or a positive number of m"),
        (HALF_PLANE, {"until": 100.0}, r"until = 100\.0: must be about"),
        (INFINITE, {"thickness": None, "material": hl.PTFE}, "thickness = None"),
        (
            INFINITE,
            {"thickness": 1e-3, "material": LAMINATE},
            r"thickness = 0\.001: must be None or that of the laminate, 0\.002 m",
        ),
    ],
)
def test_bad_arguments(builder: tuple[Any, Mapping[str, Any]], changes: dict[str, Any], message: str) -> None:
    make, given = builder
    with pytest.raises(ValueError, match=message) as error:
        make(**(given | changes))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hl.Stiffener((0.1, 0.1), (0.1, 0.1), 1.0), "end = .*must differ from the start"),
        (lambda: hl.Stiffener(0.1, (0.1, 0.1), 1.0), r"start = 0\.1: must be \(x, y\), in m"),
        (lambda: hl.Weakened((0.1, 0.2, 0.3), 0.5), r"region = .*must be \(left, right, bottom, top\)"),
        (lambda: hl.Weakened((0.2, 0.1, 0.3, 0.4), 0.5), "region = .*ascending"),
        (lambda: hl.Weakened((0.1, 0.2, 0.3, 0.4), 30.0), r"factor = 30\.0: must lie between 0 and 1"),
        (
            lambda: added(hl.PointMass(1.1, 0.1, 1.0)),
            r"additions\[0\] = .*must lie on the plate, x 0 to 1, y 0 to 0\.7 m",
        ),
        (lambda: added(MASS, hl.Stiffener((0.1, 0.1), (0.2, 0.3), 1.0)), r"additions\[1\] = .*must be parallel"),
        (lambda: added(WEAK, hl.Weakened((0.15, 0.3, 0.0, 0.11), 0.5)), r"additions\[1\] = .*must not overlap"),
        (lambda: hl.kirchhoff_plate(1.0, 1.0, 0.01, MATERIAL, hl.Supports(), additions=MASS), "additions = PointMass"),
        (lambda: sheet(poisson_ratio=3.8), r"poisson_ratio = 3\.8: must lie between -3\.74\d+ and 3\.74"),
        (lambda: hl.Ply("carbon", 1e-3), "material = 'carbon': must be a Material or an OrthotropicMaterial"),
        (lambda: hl.Laminate([]), r"plies = \[\]: must be a list of one Ply or more"),
        (lambda: hl.Laminate([hl.Ply(sheet(shear_modulus_across=2e9), 1e-3)]), r"shear_modulus_across.*ν = 1\.5"),
        (
            lambda: hl.mindlin_plate(0.2, 0.1, None, LAMINATE, hl.Supports(), shear_correction=0.8),
            r"shear_correction = 0\.8: must be omitted for a laminate",
        ),
        (
            lambda: section_of(2e-3, hl.Laminate([hl.Ply(CARBON, 1e-3)])),
            r"thickness = 0\.002: must be None or .* 0\.001",
        ),
        (lambda: section_of(None, STEEL), "thickness = None: must be a positive number of m, unless"),
        (
            lambda: hl.kirchhoff_plate(0.3, 0.3, 1e-3, STEEL, hl.Supports("clamped", "clamped"), (1, 1)).at(0.1, 0.1),
            "the supports hold every degree of freedom",
        ),
        (lambda: hl.critical_distance_bounds(None, PLATE, 0.3), "bead = None"),  # type: ignore[arg-type]
        (lambda: hl.critical_distance_bounds(hl.half_space(MATERIAL), PLATE, 0.3), "bead = "),  # type: ignore[arg-type]
        (lambda: hl.kirchhoff_plate(300.0, 200.0, 2e-3, MATERIAL, hl.Supports()).at(150.0, 100.0), "in millimetres"),
        (
            lambda: hl.mindlin_panel(hl.Outline([(0, 0), (300, 0), (0, 200)]), 2e-3, MATERIAL).at(50.0, 50.0),
            "in millimetres",
        ),
        (lambda: hl.kirchhoff_plate(0.3, 0.2, 2.0, MATERIAL, hl.Supports()), r"thickness = 2\.0: must not exceed"),
        (
            lambda: hl.kirchhoff_plate(0.1, 0.1, 1e-3, MATERIAL, hl.Supports(), cells=(10**6, 10**6)),
            "cells = .*at most",
        ),
        (lambda: hl.circle(0.1, corners=10**9), "corners = 1000000000: must be a whole number, at most 2000"),
        (lambda: hl.Outline(hl.circle(1.0, corners=1500), [hl.circle(0.5, corners=1500)]), "in all, not 3000"),
        (lambda: hl.theory.PlateImpact(BEAD, PLATE, 0.3, [0.1, -1.0]).contact_time, "inelasticity = -1.0"),
    ],
)
def test_bad_calls(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
