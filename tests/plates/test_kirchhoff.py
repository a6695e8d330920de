"""Kirchhoff plates against the literature: frequencies, order, the infinite plate, a static deflection."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh

import hertzlink as hl
from structures.linear_algebra.factor import factorise

MATERIAL = hl.Material(1.0e9, 0.3, 1000.0)


def parameters(plate: hl.Plate, count: int) -> NDArray[np.float64]:
    """ω a² √(ρt/D) of the lowest modes, by a shifted Lanczos solver."""
    structure = plate.at(plate.length / 2.0, plate.width / 2.0)
    unit = plate.rigidity / (plate.mass_per_area * plate.length**4)
    scale = sparse.diags_array(1.0 / np.sqrt(structure.stiffness.diagonal() + unit * structure.mass.diagonal()))
    stiffness = sparse.csc_array(scale @ structure.stiffness @ scale)
    mass = sparse.csc_array(scale @ structure.mass @ scale)
    square = eigsh(stiffness, count, M=mass, sigma=-unit, return_eigenvectors=False)
    return np.sqrt(np.maximum(np.sort(square), 0.0) / unit)


def square_plate(cells: int, left: str, right: str, bottom: str, top: str) -> hl.Plate:
    return hl.kirchhoff_plate(1.0, 1.0, 0.01, MATERIAL, hl.Supports(left, right, bottom, top), cells=(cells, cells))


def test_clamped_free_clamped_free() -> None:
    """Leissa, J. Sound Vib. 31 (1973) 257, gives upper bounds by 36-term Ritz; converged, 0.6 % less."""
    found = parameters(square_plate(24, "clamped", "clamped", "free", "free"), 6)
    assert found == pytest.approx([22.17, 26.40, 43.6, 61.2, 67.2, 79.8], rel=1e-3)
    leissa = np.array([22.272, 26.529, 43.664, 61.466, 67.549, 79.904])
    assert np.all(found < leissa)
    assert found == pytest.approx(leissa, rel=6e-3)


@pytest.mark.parametrize(
    ("edges", "expected"),
    [
        (("clamped",) * 4, [35.992, 73.413, 73.413, 108.27]),
        (("free",) * 4, [0.0, 0.0, 0.0, 13.489, 19.789, 24.432]),
        (("clamped", "free", "free", "free"), [3.4917, 8.5246, 21.429, 27.331]),
    ],
)
def test_other_edges(edges: tuple[str, str, str, str], expected: list[float]) -> None:
    """Leissa, J. Sound Vib. 31 (1973) 257, tables for ν = 0.3: bounds from above; free corners cost them 1 %."""
    found = parameters(square_plate(16, *edges), len(expected))
    assert found == pytest.approx(expected, rel=1e-2, abs=2e-2)
    assert np.all(found < np.array(expected) + 2e-2 * (np.array(expected) == 0.0))


def test_simple_supports_converge_with_order_four() -> None:
    """All edges simple: ω a² √(ρt/D) = π² (m² + n²) exactly; cubic elements gain h⁴."""
    errors = [parameters(square_plate(n, *["simple"] * 4), 1)[0] / (2.0 * np.pi**2) - 1.0 for n in (3, 6, 12)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([4.0, 4.0], abs=0.2)
    assert errors[-1] < 1e-5


def test_frequencies_of_the_thesis_plate() -> None:
    """Bracketed by two other programs to 2e-5: 14.9235 … 53.6884 Hz for 914 × 914 × 2.29 mm (ν = 0.33)."""
    supports = hl.Supports("clamped", "clamped", "free", "free")
    plate = hl.kirchhoff_plate(0.914, 0.914, 2.29e-3, hl.ALUMINIUM_6061, supports, cells=(48, 48))
    unit = (plate.rigidity / plate.mass_per_area) ** 0.5 / plate.length**2 / (2.0 * np.pi)
    expected = [14.9235, 17.6864, 29.2286, 41.1913, 45.0977, 53.6884]
    assert parameters(plate, 6) * unit == pytest.approx(expected, rel=1e-4)


def test_turning_the_plate_changes_nothing() -> None:
    one = hl.kirchhoff_plate(0.5, 0.4, 3e-3, MATERIAL, hl.Supports("clamped", "free", "simple", "free"), cells=(6, 5))
    other = hl.kirchhoff_plate(0.4, 0.5, 3e-3, MATERIAL, hl.Supports("simple", "free", "clamped", "free"), cells=(5, 6))
    along, across = (np.sort(np.linalg.eigvals(_dynamic(plate)).real) for plate in (one, other))
    assert along == pytest.approx(across, rel=1e-8)


def _dynamic(plate: hl.Plate) -> NDArray[np.float64]:
    structure = plate.at(plate.length / 2.0, plate.width / 2.0)
    return np.linalg.solve(structure.mass.toarray(), structure.stiffness.toarray())


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


@pytest.mark.thorough
def test_infinite_plate_stays_where_an_impulse_left_it() -> None:
    """After an impulse I the point stays at I/(8 √(Dρt)) until the first echo; to 1e-4."""
    supports = hl.Supports("clamped", "clamped", "free", "free")
    plate = hl.kirchhoff_plate(1.5, 1.5, 2.29e-3, hl.ALUMINIUM_6061, supports)
    moving = hl.stepping.MovingStructure(hl.reduce(plate.at(0.75, 0.75), until=4e-4, tolerance=1e-4))
    pulse, window, after = 180e-6, 0.9e-6, []
    state = moving.start()
    for step in range(400):
        time = (step + 0.5) * window
        force = 1.0 - np.cos(2.0 * np.pi * time / pulse) if time < pulse else 0.0
        state, surface = moving.advance(state, force, window)
        if time > pulse:
            after.append(surface)
    assert np.array(after) * plate.point_impedance / pulse == pytest.approx(np.ones(len(after)), abs=1e-4)
