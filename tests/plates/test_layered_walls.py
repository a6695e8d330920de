"""Laminates against solids in three dimensions: frequencies, the tap, and the closed forms of their shear."""

from math import pi

import numpy as np
import pytest
from scipy.sparse.linalg import eigsh

import hertzlink as hl
from plates.elements.indentation import remaining_flexibility
from plates.section import homogeneous_section
from tests.independent.layered_solid import frequencies, struck

ALUMINIUM, STEEL = hl.ALUMINIUM_6061, hl.STEEL_316
GLUE, FOAM = hl.Material(3e9, 0.35, 1200.0, "glue"), hl.Material(250e6, 0.32, 200.0, "foam")
CARBON = hl.OrthotropicMaterial(135e9, 9e9, 0.3, 5e9, 5e9, 3.2e9, 1560.0, "carbon")
LENGTH, WIDTH = 0.14, 0.12


def walls() -> dict[str, tuple[list[tuple[object, float]], list[int], float]]:
    """Materials and thicknesses, mm; cells through each in three dimensions; radius of the beads, mm."""
    crossed = [(angle, 1.0) for angle in (0.0, pi / 2, pi / 2, 0.0)]
    return {
        "plain": ([(ALUMINIUM, 1.0), (ALUMINIUM, 2.0)], [2, 2], 4.76),
        "bimetal": ([(STEEL, 1.0), (ALUMINIUM, 2.0)], [2, 2], 4.76),
        "glue": ([(STEEL, 1.0), (GLUE, 0.25), (STEEL, 1.0)], [2, 1, 1], 4.76),
        "soft core": ([(ALUMINIUM, 1.0), (hl.PTFE, 4.0), (ALUMINIUM, 1.0)], [2, 2, 1], 4.76),
        "foam core": ([(ALUMINIUM, 1.0), (FOAM, 4.0), (ALUMINIUM, 1.0)], [2, 2, 1], 4.76),
        "carbon": (crossed, [2, 1, 1, 1], 4.76),
    }


def laminate(layers: list[tuple[object, float]]) -> hl.Laminate:
    return hl.Laminate([
        hl.Ply(CARBON, 1e-3 * t, one) if isinstance(one, float) else hl.Ply(one, 1e-3 * t) for one, t in layers
    ])  # fmt: skip


@pytest.mark.thorough
@pytest.mark.parametrize("name", walls())
def test_against_a_solid(name: str) -> None:
    """The first three frequencies, and the amplitude ratio of a tap in the middle; docs/trust.md has the table."""
    layers, parts, radius = walls()[name]
    wall, bead = laminate(layers), hl.Sphere(1e-3 * radius, hl.STEEL_440C)
    coarse = hl.mindlin_plate(LENGTH, WIDTH, None, wall, hl.Supports(), cells=(10, 9)).at(LENGTH / 2, WIDTH / 2)
    square = eigsh(coarse.stiffness, 7, coarse.mass, sigma=-1e6, return_eigenvectors=False)
    found = np.sqrt(np.sort(np.abs(square))[3:6]) / 2.0 / pi
    solid = frequencies(LENGTH, WIDTH, wall.plies, [max(1, part // 2) for part in parts])
    plate = hl.mindlin_plate(LENGTH, WIDTH, None, wall, hl.Supports()).at(LENGTH / 2, WIDTH / 2)
    ratios = []
    for body in (plate, struck(LENGTH, WIDTH, wall, parts, 1.2e-3)):
        until = 1.2e-3
        chain = hl.Chain([bead] * 16, bead, 0.31, gravity=9.81)
        run = hl.CoSimulation(chain, hl.reduce(body, until, tolerance=1e-3)).run(until)
        ratios.append(hl.amplitude_ratio(run, 8).item())
    assert found == pytest.approx(solid, rel=1e-2)
    assert ratios[0] == pytest.approx(ratios[1], abs=1.5e-2 if name == "soft core" else 1e-2)


def sandwich_compliance(material: hl.Material, thickness: float, core: hl.Material, middle: float) -> float:
    """1/S of a symmetric sandwich of equal ν: ∫ τ²/G dz with τ(z) = Q ∫ E z dz/D, by the trapezoidal rule."""
    outer = thickness + middle / 2.0
    z = np.linspace(-outer, outer, 400_001)
    modulus = np.where(abs(z) < middle / 2.0, core.youngs_modulus, material.youngs_modulus) / (1.0 - 0.33**2)
    step = z[1] - z[0]
    stress = np.cumsum(modulus * z) * step / (modulus * z**2).sum() / step
    return float((stress**2 / (modulus * (1.0 - 0.33) / 2.0)).sum() * step)


@pytest.mark.parametrize("modulus", [69e9, 3e9, 0.5e9])
def test_shear_stiffness_of_a_symmetric_sandwich(modulus: float) -> None:
    """With a soft core it is nearly G d²/c, with the distance d of the faces' middles and the core's thickness c."""
    face, core = hl.Material(69e9, 0.33, 2700.0), hl.Material(modulus, 0.33, 2000.0)
    section = hl.Laminate([hl.Ply(face, 1e-3), hl.Ply(core, 4e-3), hl.Ply(face, 1e-3)]).section()
    assert section.shear == pytest.approx(np.eye(2) / sandwich_compliance(face, 1e-3, core, 4e-3), rel=1e-4, abs=1.0)
    if modulus < 1e9:
        assert section.shear[0, 0] == pytest.approx(modulus / 2.66 * 25e-6 / 4e-3, rel=0.03)


def test_indentation_of_equal_layers_is_that_of_one() -> None:
    """Elements through the thickness give the same as the closed form."""
    layers = hl.Laminate([hl.Ply(ALUMINIUM, 1e-3), hl.Ply(ALUMINIUM, 2e-3)]).section()
    for radius in (0.8e-3, 1.5e-3):
        expected = remaining_flexibility(homogeneous_section(3e-3, ALUMINIUM), radius)
        assert remaining_flexibility(layers, radius) == pytest.approx(expected, rel=1e-3)


def test_kirchhoff_warns_where_shear_matters() -> None:
    """In the result, too; a homogeneous plate of the same thickness does not warn."""
    wall, bead = laminate([(ALUMINIUM, 1.0), (hl.PTFE, 4.0), (ALUMINIUM, 1.0)]), hl.Sphere(4.76e-3, hl.STEEL_440C)
    for material, warns in ((wall, True), (ALUMINIUM, False)):
        body = hl.kirchhoff_plate(LENGTH, WIDTH, 6e-3, material, hl.Supports(), cells=(12, 10)).at(0.07, 0.06)
        run = hl.CoSimulation(hl.Chain([bead] * 6, bead, 0.05), hl.reduce(body, 2e-4, tolerance=0.05))
        assert ("shear: " in run.run(2e-4).attrs["warnings"]) is warns
