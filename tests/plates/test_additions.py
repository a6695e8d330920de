"""Point masses, stiffeners, weakened regions on a rectangle: closed forms, and what reaches the contact."""

from math import pi

import numpy as np
import pytest
from independent.plates import frequencies
from scipy.optimize import brentq

import hertzlink as hl

MATERIAL = hl.Material(1.0e9, 0.3, 1000.0)
LENGTH, WIDTH = 1.0, 0.7


def simple_plate(*additions: object, cells: int = 24, **more: object) -> hl.Plate:
    return hl.kirchhoff_plate(
        LENGTH, WIDTH, 0.01, MATERIAL, hl.Supports(*["simple"] * 4), cells=(cells, cells), additions=additions, **more
    )


def wave_numbers(count: int) -> tuple[np.ndarray, np.ndarray]:
    return np.meshgrid(pi * np.arange(1, count + 1) / LENGTH, pi * np.arange(1, count + 1) / WIDTH)


def test_point_mass() -> None:
    """1 = ω² m Σ φ²/(ω_n² − ω²), the receptance of Navier's series at the mass; anywhere in a cell."""
    plain, (x, y), mass = simple_plate(), (0.317, 0.22), 3.0
    p, q = wave_numbers(1500)
    square = plain.rigidity / plain.mass_per_area * (p**2 + q**2) ** 2
    shape = 4.0 / (plain.mass_per_area * LENGTH * WIDTH) * (np.sin(p * x) * np.sin(q * y)) ** 2

    def condition(omega: float) -> float:
        return float(omega**2 * mass * (shape / (square - omega**2)).sum() - 1.0)

    first, second = np.sqrt(np.sort(square.ravel())[:2])
    exact = [brentq(condition, 1.0, first * (1 - 1e-9)), brentq(condition, first * (1 + 1e-9), second * (1 - 1e-9))]
    found = frequencies(simple_plate(hl.PointMass(x, y, mass)), 2)
    assert exact[0] < 0.8 * first
    assert found == pytest.approx(exact, rel=1e-3)
    finer = frequencies(simple_plate(hl.PointMass(x, y, mass), cells=48), 2)
    assert np.all(abs(finer - exact) < 0.5 * abs(found - exact))


@pytest.mark.parametrize("along_x", [True, False])
def test_stiffener(along_x: bool) -> None:
    """A stiffener from edge to edge couples the sines across it by two numbers, its deflection and its twist."""
    stiff, twist, mass, place, k = 900.0, 60.0, 2.0, 0.31, pi
    rows = (1.0, 0.7) if along_x else (0.7, 1.0)
    d, m = simple_plate().rigidity, simple_plate().mass_per_area
    q = pi * np.arange(1, 4000) / 0.7
    square = d / m * (k**2 + q**2) ** 2
    shapes = np.array([np.sin(q * place), q * np.cos(q * place)]) * np.sqrt(2.0 / (m * 0.7))

    def condition(omega: float) -> float:
        added = np.diag([stiff * k**4 - omega**2 * mass, twist * k**2])
        return float(np.linalg.det(np.eye(2) + added @ (shapes / (square - omega**2) @ shapes.T)))

    ends = ((0.0, place), (1.0, place)) if along_x else ((place, 1.0), (place, 0.0))
    one = hl.kirchhoff_plate(
        *rows, 0.01, MATERIAL, hl.Supports(*["simple"] * 4), cells=(40, 40),
        additions=[hl.Stiffener(*ends, stiff, twist, mass)],
    )  # fmt: skip
    found = frequencies(one, 1)[0]
    exact = brentq(condition, 0.98 * found, 1.02 * found)
    assert abs(exact / np.sqrt(square[0]) - 1.0) > 0.02
    assert found == pytest.approx(exact, rel=1e-3)
    assert found > exact


def test_a_plate_weakened_everywhere() -> None:
    """Frequencies scale by √factor; in parts side by side as in one, also where they cross cells."""
    whole = frequencies(simple_plate(cells=8), 5)
    parts = [hl.Weakened((0.0, 0.43, 0.0, WIDTH), 0.36), hl.Weakened((0.43, LENGTH, 0.0, WIDTH), 0.36)]
    for regions in ([hl.Weakened((0.0, LENGTH, 0.0, WIDTH), 0.36)], parts):
        assert frequencies(simple_plate(*regions, cells=8), 5) == pytest.approx(0.6 * whole, rel=1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize(("place", "changed"), [((0.12, 0.2), False), ((0.2, 0.2), True)], ids=["far", "under"])
def test_only_a_defect_near_the_contact_changes_the_reflected_wave(place: tuple[float, float], changed: bool) -> None:
    """Waves to the far defect and back, 160 mm, take longer than the contact of a 4.76 mm bead lasts."""
    bead = hl.Sphere(2.38e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 15, bead, impact_speed=0.31)
    ratios = []
    for additions in ([], [hl.Weakened((0.19, 0.21, 0.19, 0.21), 0.3)]):
        plate = hl.kirchhoff_plate(0.4, 0.4, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports("clamped"), additions=additions)
        run = hl.CoSimulation(chain, hl.reduce(plate.at(*place), 0.6e-3)).run(0.6e-3)
        ratios.append(hl.amplitude_ratio(run, sensor=6).item())
    change = abs(ratios[1] / ratios[0] - 1.0)
    assert change > 0.05 if changed else change < 1e-3
