"""An element of a user's own: Adini, Clough and Melosh's rectangle, from its shape functions, in one class each."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi
from typing import Any, ClassVar

import numpy as np
import pytest
from frequencies import parameters
from scipy import sparse

import hertzlink as hl
from plates.elements.theory import Assembled, on_mesh, thin_wavelength
from plates.plate import Plate
from plates.section import homogeneous_section
from plates.shapes.mesh_geometry import find_cells
from plates.shapes.rectangle import Rectangle
from plates.shapes.shape import Cells
from structures.linear_algebra.factor import factorise

MATERIAL = hl.Material(1.0e9, 0.3, 1000.0)
POWERS = np.array([(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2), (3, 0), (2, 1), (1, 2), (0, 3), (3, 1), (1, 3)])
"""Of x and y: twelve polynomials; the deflection and two slopes at each corner determine their factors."""

PLACE, WEIGHT = np.polynomial.legendre.leggauss(4)


def polynomials(points: np.ndarray, dx: int = 0, dy: int = 0) -> np.ndarray:
    """Derivatives of the polynomials at points … × 2, … × 12."""
    found = np.ones((*points.shape[:-1], len(POWERS)))
    for axis, times in ((0, dx), (1, dy)):
        power = POWERS[:, axis]
        factor = np.prod([power - i for i in range(times)], axis=0) if times else np.ones(len(POWERS))
        found = found * factor * points[..., axis, None] ** np.maximum(power - times, 0)
    return found


class AdiniFunctions:
    """w, w_x and w_y at the vertices, in coordinates from the middle of each cell, in units of its size."""

    def __init__(self, mesh: Any, section: Any) -> None:
        self.mesh, self.section, self.size = mesh, section, 3 * mesh.nvertices
        self.dofs = (3 * mesh.t.T[:, :, None] + np.arange(3)).reshape(mesh.nelements, 12)
        corners = mesh.p[:, mesh.t].transpose(2, 1, 0)
        self.middle, self.extent = corners.mean(axis=1), np.ptp(corners, axis=1).max(axis=1)
        local = (corners - self.middle[:, None]) / self.extent[:, None, None]
        rows = np.stack([polynomials(local, *d) for d in ((0, 0), (1, 0), (0, 1))], axis=2)
        rows[:, :, 1:] /= self.extent[:, None, None, None]
        self.factors = np.linalg.inv(rows.reshape(-1, 12, 12))
        self.half = np.ptp(corners, axis=1) / 2.0

    def values(self, points: np.ndarray, cells: Any, dx: int = 0, dy: int = 0) -> np.ndarray:
        """Derivatives of the functions of cells at points of them, cells × points × 12."""
        local = (points - self.middle[cells][:, None]) / self.extent[cells][:, None, None]
        scale = self.extent[cells][:, None, None] ** (dx + dy)
        return polynomials(local, dx, dy) / scale @ self.factors[cells]

    def curvatures(self, points: np.ndarray, cells: Any) -> np.ndarray:
        bent = [self.values(points, cells, 2, 0), self.values(points, cells, 0, 2), self.values(points, cells, 1, 1)]
        return np.stack([bent[0], bent[1], 2.0 * bent[2]], axis=2)

    def matrices(self, weakening: Callable[[Any], Any] | None = None) -> tuple[Any, Any]:
        cells = np.arange(self.mesh.nelements)
        grid = np.stack(np.meshgrid(PLACE, PLACE), axis=-1).reshape(-1, 2)
        points = self.middle[:, None] + grid * self.half[:, None]
        weight = np.outer(WEIGHT, WEIGHT).ravel() * self.half.prod(axis=1)[:, None]
        value, bent = self.values(points, cells), self.curvatures(points, cells)
        soft = weight if weakening is None else weight * weakening(points.transpose(2, 0, 1))
        mass = self.section.mass * np.einsum("cp,cpi,cpj->cij", weight, value, value)
        stiffness = np.einsum("cp,cpmi,mn,cpnj->cij", soft, bent, self.section.bending, bent, optimize=True)
        rows, columns = np.broadcast_arrays(self.dofs[:, :, None], self.dofs[:, None, :])
        places, shape = (rows.ravel(), columns.ravel()), (self.size, self.size)
        return tuple(sparse.csr_array(sparse.coo_array((m.ravel(), places), shape)) for m in (mass, stiffness))  # type: ignore[return-value]

    def springs(self, facets: Any, edge: hl.ElasticEdge) -> Any:
        raise ValueError("supports: this element has no springs")

    def kept(self, edges: Any, supports: Any) -> Any:
        """Sides are parallel to the axes: across a vertical one the slope is w_x, along it w_y."""
        held = np.zeros((self.mesh.nvertices, 3), dtype=bool)
        for name, support in supports.items():
            ends = self.mesh.facets[:, edges[name]]
            vertical = int(np.ptp(self.mesh.p[0, ends]) > 0.0)
            across, along = 1 + vertical, 2 - vertical
            held[np.ravel(ends), across] |= support in ("clamped", "symmetry")
            if support != "symmetry":
                held[np.ravel(ends), 0] = held[np.ravel(ends), along] = True
        return sparse.csr_array(sparse.eye_array(self.size, format="csr")[:, ~held.ravel()])

    def deflection(self, points: np.ndarray) -> Any:
        cells = find_cells(self.mesh, points)
        return self.reading(self.values(points[:, None], cells), cells)

    def sampled(self, places: np.ndarray) -> tuple[Any, Any]:
        cells = np.arange(self.mesh.nelements)
        low = self.mesh.p[:, self.mesh.t].min(axis=1).T
        points = low[:, None] + places.T * 2.0 * self.half[:, None]
        bent = self.curvatures(points, cells)
        return self.reading(self.values(points, cells), cells), self.reading(bent.reshape(cells.size, -1, 12), cells)

    def reading(self, functions: np.ndarray, cells: Any) -> Any:
        rows = np.arange(functions.shape[0] * functions.shape[1]).reshape(*functions.shape[:2], 1)
        rows, columns = np.broadcast_arrays(rows, self.dofs[cells][:, None])
        shape = (functions.shape[0] * functions.shape[1], self.size)
        return sparse.csr_array(sparse.coo_array((functions.ravel(), (rows.ravel(), columns.ravel())), shape))


@dataclass(frozen=True)
class Adini:
    """Kirchhoff's theory on rectangles, not conforming."""

    name: ClassVar[str] = "Kirchhoff"
    thin: ClassVar[bool] = True
    patch_radius: ClassVar[float] = 0.0
    unknowns: ClassVar[float] = 3.0

    def described(self) -> dict[str, Any]:
        return {}

    def wavelength(self, section: Any, rigidity: float, frequency: float) -> float:
        return thin_wavelength(section, rigidity, frequency)

    def cells(self, wavelength: float, additions: Sequence[Any]) -> Cells:
        return Cells(wavelength / 24.0, 0.3, wavelength / 8.0)

    def objection(self, addition: Any) -> str:
        return "this element carries no stiffeners" if isinstance(addition, hl.Stiffener) else ""

    def assemble(self, mesh: Any, section: Any, supports: Any, additions: Any) -> Assembled:
        return on_mesh(AdiniFunctions(mesh.mesh, section), mesh, section, supports, additions)

    def flexibility(self, wall: Any) -> float:
        return 0.0


def plate(*edges: str, cells: int | None = 12, **more: Any) -> hl.Plate:
    shape = Rectangle(1.0, 1.0, None if cells is None else (cells, cells))
    return Plate(shape, homogeneous_section(0.01, MATERIAL), hl.Supports(*edges), Adini(), **more)


def modes(one: hl.Plate, count: int = 4) -> np.ndarray:
    return parameters(one.at(0.37, 0.41), count, one.rigidity / one.mass_per_area)


def test_frequencies_converge_to_the_closed_form() -> None:
    """All sides simple, (i² + j²)π²: from below, with order 2."""
    exact = np.array([2.0, 5.0, 5.0, 8.0]) * pi**2
    errors = np.array([modes(plate(*["simple"] * 4, cells=n)) / exact - 1.0 for n in (12, 24)])
    assert np.all(errors < 0.0)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(np.full(4, 2.0), abs=0.2)


def test_it_agrees_with_the_conforming_element() -> None:
    """Clamped and free sides, a point mass, a weakened region: within 1 % of Bogner, Fox and Schmit's element."""
    additions = [hl.PointMass(0.5, 0.25, 1.0), hl.Weakened((0.5, 0.75, 0.5, 0.75), 0.3)]
    supports = hl.Supports("clamped", "free", "simple")
    other = hl.kirchhoff_plate(1.0, 1.0, 0.01, MATERIAL, supports, cells=(32, 32), additions=additions)
    own = plate("clamped", "free", "simple", cells=32, additions=additions)
    assert modes(own) == pytest.approx(modes(other), rel=1e-2)


def test_all_that_a_plate_does_comes_with_the_element() -> None:
    """Halves, symmetry edges, fields, graded meshes and texts; and objections."""
    half, whole = (plate(*["clamped"] * 4, cells=None, highest_frequency=200.0).at(x, 0.3) for x in (0.5, 0.5 + 1e-7))
    assert half.size < 0.6 * whole.size
    u, full = (factorise(one.stiffness)(one.contact) for one in (half, whole))
    assert half.contact @ u == pytest.approx(whole.contact @ full, rel=1e-3)
    assert half.field is not None
    points, moved = half.field.grid.points, half.field.displacement(u)
    assert -moved[np.hypot(*(points[:, :2] - [0.5, 0.3]).T).argmin(), 2] == pytest.approx(half.contact @ u, rel=1e-9)
    assert repr(plate("clamped")).startswith(
        "<Kirchhoff plate, 1 × 1 m, 12 × 12 cells, 10 mm of a material; left clamp"
    )
    with pytest.raises(ValueError, match=r"additions\[0\] = .*carries no stiffeners"):
        plate(additions=[hl.Stiffener((0.1, 0.1), (0.2, 0.1), 1.0)])


@pytest.mark.parametrize(
    ("element", "message"),
    [
        ("thin", r"element = 'thin': must be an Element of plates\.elements\.theory; it lacks name, thin, "),
        (Adini, "element = .*Adini.*: must be .*; it is a class; give an instance"),
        (None, "element = None: must be"),
    ],
)
def test_an_element_that_is_none_is_named(element: Any, message: str) -> None:
    wall = homogeneous_section(2e-3, MATERIAL)
    with pytest.raises(ValueError, match=message):
        Plate(Rectangle(0.1, 0.1), wall, {"left": "clamped"}, element)
    with pytest.raises(ValueError, match=r"section = 0\.002: must be a Section"):
        Plate(Rectangle(0.1, 0.1), 2e-3, {}, Adini())  # type: ignore[arg-type]
