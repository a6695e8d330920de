"""Bad input that new users gave to what finds, or predicts, critical distances: one line that names the argument."""

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl

BEAD = hl.Sphere(2.38e-3, hl.STEEL_440C)
PLATE = hl.kirchhoff_plate(0.9, 0.9, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
PLY = ((138e9, 9e9, 9e9), (0.4, 0.3, 0.3), (3.2e9, 6.9e9, 6.9e9))


def curve(distances: Any, ratios: Any = (0.9, 0.6, 0.5, 0.5)) -> xr.DataArray:
    return xr.DataArray(list(ratios), dims="distance", coords={"distance": list(distances)})


def near(distance: float) -> hl.CoSimulation:
    plate = hl.half_plane(2.29e-3, hl.ALUMINIUM_6061, "clamped", distance, until=1e-4)
    return hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3), plate)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hl.critical_distance(curve([np.nan, 0.02, 0.03, 0.1])), "distance = "),
        (lambda: hl.critical_distance(curve([-1.0, 0.02, 0.03, 0.1])), "none of them negative"),
        (lambda: hl.critical_distance(curve([0.01, 0.02, 0.03, np.inf])), "must be finite numbers of m"),
        (lambda: hl.critical_distance(curve([0.01, 0.01, 0.03, 0.1])), "must not hold a distance twice"),
        (lambda: hl.critical_distance(curve(["a", "b", "c", "d"])), "must be finite numbers of m"),
        (lambda: hl.critical_distance(curve([1, 2, 3, 4], "abcd")), "ratio: must hold real numbers"),
        (lambda: hl.critical_distance(curve([1, 2, 3, 4], [1j, 0, 0, 0])), "ratio: must hold real numbers"),
        (lambda: hl.half_plane(1e300, hl.ALUMINIUM_6061, "clamped", 0.02), "thickness = 1e+300: must be at most"),
        (lambda: hl.half_plane(1e-3, hl.ALUMINIUM_6061, "clamped", 1e-300), "distance = 0.0: must be a positive"),
        (lambda: hl.half_plane(1e-3, hl.ALUMINIUM_6061, "clamped", 0.0), "distance = 0.0: must be a positive"),
        (
            lambda: hl.half_plane(1e-3, hl.ALUMINIUM_6061, "free", 0.02, highest_frequency=1e-300),
            "highest_frequency = 1e-300: must be a positive number",
        ),
        (lambda: hl.critical_distance_law(BEAD, PLATE, impact_speed=[]), "impact_speed = []: must be a finite number"),
        (lambda: hl.critical_distance_law(BEAD, PLATE, impact_speed=1e300), "impact_speed = 1e+300: must be at most"),
        (lambda: hl.reduce(near(0.02).structure.structure, 1e-4, pulse=1e-300), "pulse = 1e-300: must be a"),
        (lambda: hl.theory.yield_pressure(None), "material = None: must be a Material"),
        (lambda: hl.theory.indentation_modulus("x"), "stiffness: must hold finite numbers"),
        (lambda: hl.theory.indentation_modulus(hl.ALUMINIUM_6061), "stiffness: must hold finite numbers"),
        (lambda: hl.theory.indentation_modulus(1j * np.eye(6)), "stiffness: must hold finite numbers"),
        (lambda: hl.theory.orthotropic_stiffness((1j, 1, 1), *PLY[1:]), "moduli: must hold finite numbers"),
        (lambda: hl.theory.orthotropic_stiffness(PLY[0], [[1, 2], [3]], PLY[2]), "poisson_ratios: must hold finite"),
        (lambda: hl.theory.orthotropic_stiffness(PLY[0], PLY[1], {}), "shear_moduli: must hold finite numbers"),
    ],
)
def test_it_is_named(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        call()
    assert "\n" not in str(caught.value)
