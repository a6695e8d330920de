"""Frequencies of rectangular plates: six pairs of edges, orthotropic, angle-ply, elastic edges; turned by 90°."""

from dataclasses import replace
from itertools import product
from math import pi

import numpy as np
import pytest
from independent.plates import Numbers, frequencies, levy, ritz
from scipy.optimize import brentq

import hertzlink as hl
from hertzlink import Ply
from plates.section import homogeneous_section
from structures.linear_algebra.factor import factorise

MATERIAL = hl.Material(1.0e9, 0.3, 1000.0)
CARBON = hl.OrthotropicMaterial(140e9, 10e9, 0.3, 5e9, 5e9, 3.6e9, 1600.0)
SKEW = hl.Laminate([hl.Ply(CARBON, 1e-3, 0.6)])


def plate(*edges: str | hl.ElasticEdge, cells: int = 20, **more: object) -> hl.Plate:
    given = {"length": 1.0, "width": 1.0, "thickness": 0.01, "material": MATERIAL, **more}
    return hl.kirchhoff_plate(supports=hl.Supports(*edges), cells=(cells, cells), **given)


def graded_for(frequency: float, one: hl.Plate) -> hl.Plate:
    """The plate on meshes of its own for each contact, for waves up to a frequency in Hz."""
    return replace(one, shape=replace(one.shape, cells=None), highest_frequency=frequency)


def parameters(one: hl.Plate, count: int) -> Numbers:
    """ω a² √(ρt/D)."""
    return frequencies(one, count) * one.length**2 * (one.mass_per_area / one.rigidity) ** 0.5


@pytest.mark.parametrize(
    ("edge", "published"),
    [("simple", [19.7392, 49.3480]), ("clamped", [28.9509, 54.7431]), ("free", [9.6314, 16.1348])],
)
def test_two_simple_edges(edge: str, published: list[float]) -> None:
    """Levy's closed form, solved here; its first two are in Leissa, J. Sound Vib. 31 (1973) 257, for ν = 0.3."""
    exact = np.sort(np.concatenate([levy(1.0, edge, m, 130.0) for m in (1, 2, 3)]))[:6]
    assert exact[:2] == pytest.approx(published, rel=1e-5)
    found = parameters(plate("simple", "simple", edge, edge), 6)
    assert found == pytest.approx(exact, rel=1e-4)
    assert np.all(found > exact * (1.0 - 1e-8))


@pytest.mark.parametrize(
    ("edges", "published"),
    [
        (("clamped",) * 4, [35.985, 73.394, 73.394, 108.22]),
        (("free",) * 4, [0.0, 0.0, 0.0, 13.468, 19.596, 24.270]),
        (("clamped", "clamped", "free", "free"), [22.17, 26.40, 43.6, 61.2]),
    ],
)
def test_other_pairs(edges: tuple[str, ...], published: list[float]) -> None:
    """A Ritz method with 16 × 16 polynomials; its converged values are well known."""
    section = homogeneous_section(0.01, MATERIAL)
    unit = (section.mass / section.bending[0, 0]) ** 0.5
    exact = ritz(section.bending, section.mass, (1.0, 1.0), edges)[:8] * unit
    assert exact[: len(published)] == pytest.approx(published, rel=1e-3, abs=1e-3)
    assert parameters(plate(*edges), 8) == pytest.approx(exact, rel=2e-4, abs=1e-3)


@pytest.mark.parametrize("edges", [("clamped",) * 4, ("simple", "simple", "clamped", "clamped")])
def test_order_of_convergence(edges: tuple[str, ...]) -> None:
    """Cubic elements gain h⁴ in frequencies."""
    section = homogeneous_section(0.01, MATERIAL)
    unit = (section.mass / section.bending[0, 0]) ** 0.5
    exact = ritz(section.bending, section.mass, (1.0, 1.0), edges, terms=20)[0] * unit
    errors = [parameters(plate(*edges, cells=n), 1)[0] / exact - 1.0 for n in (10, 20, 40)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([4.0, 4.0], abs=0.2)


def orthotropic_modes(section: object, length: float, width: float) -> Numbers:
    """ρt ω² = D₁₁(mπ/a)⁴ + 2(D₁₂ + 2D₆₆)(mπ/a)²(nπ/b)² + D₂₂(nπ/b)⁴, all edges simple."""
    d = section.bending  # type: ignore[attr-defined]
    square = [
        d[0, 0] * x**4 + 2.0 * (d[0, 1] + 2.0 * d[2, 2]) * x**2 * y**2 + d[1, 1] * y**4
        for x, y in product(pi * np.arange(1, 12) / length, pi * np.arange(1, 12) / width)
    ]
    return np.sqrt(np.sort(square) / section.mass)  # type: ignore[attr-defined]


def test_orthotropic_and_simply_supported() -> None:
    cross = hl.Laminate([hl.Ply(CARBON, 0.25e-3, angle) for angle in (0.0, pi / 2, pi / 2, 0.0)])
    one = plate(*["simple"] * 4, length=0.5, width=0.3, thickness=None, material=cross)
    assert frequencies(one, 6) == pytest.approx(orthotropic_modes(one.section, 0.5, 0.3)[:6], rel=1e-4)


@pytest.mark.parametrize("edges", [("simple",) * 4, ("clamped", "free", "simple", "free"), ("free",) * 4])
def test_angle_ply(edges: tuple[str, ...]) -> None:
    """Fibres at 0.6 rad: D₁₆ and D₂₆ are as large as the others. The Ritz method has its own integrals and sums."""
    one = plate(*edges, length=0.5, width=0.3, thickness=None, material=SKEW, cells=24)
    section = one.section
    assert abs(section.bending[:2, 2]).min() > 0.1 * section.bending[1, 1]
    exact = ritz(section.bending, section.mass, (0.5, 0.3), edges)
    rigid = 3 if edges[0] == "free" else 0
    assert frequencies(one, 7)[rigid:] == pytest.approx(exact[rigid:7], rel=1e-3)


@pytest.mark.parametrize(("translation", "rotation"), [(50.0, 0.0), (200.0, 3.0), (1e3, 20.0)])
@pytest.mark.parametrize("turned", [False, True])
def test_elastic_edges_of_a_strip(translation: float, rotation: float, turned: bool) -> None:
    """Held at both ends by springs, it is a beam: Y = A cosh βx + B cos βx, D Y″ + R Y′ = 0, D Y‴ = T Y at x = L/2."""

    def condition(beta: float) -> float:
        h, r = beta / 2.0, rotation / beta
        bend = [beta**2 * (np.cosh(h) + r * np.sinh(h)), -(beta**2) * (np.cos(h) + r * np.sin(h))]
        pull = [beta**3 * np.sinh(h) - translation * np.cosh(h), beta**3 * np.sin(h) - translation * np.cos(h)]
        return bend[0] * pull[1] - bend[1] * pull[0]

    grid = np.linspace(0.5, 12.0, 500)
    values = [condition(one) for one in grid]
    signs = np.flatnonzero(np.diff(np.sign(values)))
    exact = np.array([brentq(condition, grid[i], grid[i + 1]) for i in signs])[:2] ** 2
    d = plate().rigidity
    edge = hl.ElasticEdge(translation * d, rotation * d)
    ends = ("symmetry", "symmetry", edge, edge) if turned else (edge, edge, "symmetry", "symmetry")
    width, length, cells = (1.0, 0.2, (4, 30)) if turned else (0.2, 1.0, (30, 4))
    strip = hl.kirchhoff_plate(length, width, 0.01, MATERIAL, hl.Supports(*ends), cells=cells)
    # The even modes of the beam are among those of the strip; others are odd, or vary across it.
    found = parameters(strip, 6) / length**2
    for one in exact:
        assert abs(found / one - 1.0).min() < 1e-5


@pytest.mark.parametrize(
    "more",
    [
        {"thickness": None, "material": SKEW},
        {"additions": [hl.PointMass(0.3, 0.4, 5.0)]},
        {"additions": [hl.Weakened((0.0, 0.4, 0.0, 1.0), 0.1)]},
        {"additions": [hl.Weakened((0.0, 0.4, 0.0, 1.0), 0.1), hl.Weakened((0.6, 1.0, 0.0, 1.0), 0.5)]},
        {"additions": [hl.Weakened((0.4, 0.6, 0.4, 0.6), 0.1), hl.PointMass(0.3, 0.4, 5.0)]},
        {"additions": [hl.Stiffener((0.1, 0.0), (0.1, 1.0), 1e3)]},
    ],
    ids=["laminate", "mass", "weak", "one side weaker", "weak middle, mass", "stiffener"],
)
def test_symmetry_is_not_used_where_the_plate_has_none(more: dict[str, object]) -> None:
    """At the centre and slightly off it: the same answer, which half the plate would not give."""
    one = graded_for(1.5e3, plate(*["simple"] * 4, **more))
    plain = replace(one, section=homogeneous_section(0.01, MATERIAL), material=MATERIAL, additions=())
    centre, nearby = one.at(0.5, 0.5), one.at(0.5 + 1e-7, 0.5 + 1e-7)
    assert receptance(centre, 2.0 * pi * 100.0) == pytest.approx(receptance(nearby, 2.0 * pi * 100.0), rel=1e-5)
    assert plain.at(0.5, 0.5).size < 0.3 * plain.at(0.5 + 1e-7, 0.5 + 1e-7).size


def receptance(structure: hl.Structure, shift: float = 2.0 * pi * 300.0) -> float:
    return float(structure.contact @ structure.matrices.shifted_solve(shift)(structure.contact))


@pytest.mark.parametrize("cells", [(8, 6), None])
def test_a_quarter_turn_of_everything_changes_nothing(cells: tuple[int, int] | None) -> None:
    """(x, y) → (b − y, x): supports, fibres, additions and contact turn with the plate."""
    a, b = 0.5, 0.4
    spring = hl.ElasticEdge(3e5, 40.0)
    one = hl.kirchhoff_plate(
        a, b, None, hl.Laminate([Ply(CARBON, 1e-3, 0.3), Ply(MATERIAL, 2e-3), Ply(CARBON, 1e-3, 1.2)]),
        hl.Supports("clamped", "free", spring, "simple"), cells, 3e3,
        [hl.PointMass(0.1, 0.3, 0.2), hl.Weakened((0.05, 0.22, 0.11, 0.3), 0.2),
         hl.Stiffener((0.1, 0.17), (0.45, 0.17), 20.0, 5.0, 0.3),
         hl.Stiffener((0.31, 0.4), (0.31, 0.1), 9.0, 2.0, 0.1)],
    )  # fmt: skip
    turn = pi / 2.0
    other = hl.kirchhoff_plate(
        b, a, None,
        hl.Laminate([Ply(CARBON, 1e-3, 0.3 + turn), Ply(MATERIAL, 2e-3), Ply(CARBON, 1e-3, 1.2 + turn)]),
        hl.Supports("simple", spring, "clamped", "free"), cells and cells[::-1], 3e3,
        [hl.PointMass(b - 0.3, 0.1, 0.2), hl.Weakened((b - 0.3, b - 0.11, 0.05, 0.22), 0.2),
         hl.Stiffener((b - 0.17, 0.1), (b - 0.17, 0.45), 20.0, 5.0, 0.3),
         hl.Stiffener((0.0, 0.31), (b - 0.1, 0.31), 9.0, 2.0, 0.1)],
    )  # fmt: skip
    for shift in (10.0, 2e3, 2e4):
        assert receptance(one.at(0.23, 0.31), shift) == pytest.approx(
            receptance(other.at(b - 0.31, 0.23), shift), rel=1e-7
        )


def test_frequencies_of_the_thesis_plate() -> None:
    """Bracketed by two other programs to 2e-5: 14.9235 … 53.6884 Hz for 914 × 914 × 2.29 mm (ν = 0.33)."""
    supports = hl.Supports("clamped", "clamped", "free", "free")
    one = hl.kirchhoff_plate(0.914, 0.914, 2.29e-3, hl.ALUMINIUM_6061, supports, cells=(48, 48))
    expected = [14.9235, 17.6864, 29.2286, 41.1913, 45.0977, 53.6884]
    assert frequencies(one, 6) / 2.0 / pi == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("place", [(0.5, 0.5), (0.37, 0.5)])
def test_point_load_on_a_simply_supported_plate(place: tuple[float, float]) -> None:
    """Navier's series (Timoshenko, Theory of Plates and Shells, section 34), on a line of symmetry and off it."""
    plate = hl.kirchhoff_plate(1.0, 1.0, 0.01, MATERIAL, hl.Supports(*["simple"] * 4), highest_frequency=3e3)
    structure = plate.at(*place)
    found = structure.contact @ factorise(structure.stiffness)(structure.contact)
    m, n = np.meshgrid(np.arange(1, 801), np.arange(1, 801))
    shape = (np.sin(np.pi * m * place[0]) * np.sin(np.pi * n * place[1])) ** 2
    exact = 4.0 / (np.pi**4 * plate.rigidity) * (shape / (m**2 + n**2) ** 2).sum()
    assert found == pytest.approx(exact, rel=5e-4)
