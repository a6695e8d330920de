"""Displacement and stress of elastic solids from their degrees of freedom: bodies of revolution and 3-D bodies."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import Basis, ElementHex1, ElementHex2, ElementQuad1, ElementQuad2, ElementTetP1, ElementTetP2, ElementVector
from skfem.assembly import Dofs

from structures.bodies.elasticity import first_lame_parameter, part_stiffnesses, shear_modulus
from structures.field import Grid, Numbers, Whole
from structures.material import Material

# Two points along each side of a quadratic cell (four in a tetrahedron). Stress is one order more accurate there than
# elsewhere (Barlow, Int. J. Numer. Meth. Eng. 10 (1976) 243), and no point lies on the axis, where u_r/r is singular.
GAUSS_ORDER = 2

# For each element of the displacement: the element of its stress, one order lower, and meshio's name of the cell
CELL_ELEMENTS: dict[type, tuple[type, str]] = {
    ElementQuad2: (ElementQuad1, "quad9"),
    ElementTetP2: (ElementTetP1, "tetra10"),
    ElementHex2: (ElementHex1, "hexahedron27"),
}

# The order of a cell's points that turns it inside out, and the corners next to the first one. scikit-fem accepts
# cells of both orientations, VTK does not.
MIRRORED_CELLS: dict[str, tuple[tuple[int, ...], tuple[int, int, int]]] = {
    "tetra10": ((1, 0, 2, 3, 4, 6, 5, 8, 7, 9), (1, 2, 3)),
    "hexahedron27": (
        (*range(4, 8), *range(4), *range(12, 16), *range(8, 12), *range(16, 24), 25, 24, 26), (1, 3, 4),
    ),
}  # fmt: skip

# Positions of the entries of a stress tensor in VTK's order
VTK_STRESS_INDEX = {(0, 0): 0, (1, 1): 1, (2, 2): 2, (0, 1): 3, (1, 2): 4, (0, 2): 5}


class ElasticSampler:
    """Displacement and stress at the nodes of quadratic elements; a plane mesh is the half-plane (r, z), z inwards.

    A node where materials meet appears once for each material. Stress is extrapolated from the Gauss points to the
    nodes of each cell, and averaged over the cells of one material. element: the element of one displacement component.
    order: the integration order of the stiffness. kept: the degrees of freedom that the structure has. owner: the index
    of the material of each cell.
    """

    def __init__(
        self, mesh: Any, element: type, order: int, kept: NDArray[Any], materials: Sequence[Material], owner: Whole
    ) -> None:
        self.mesh, self.element, self.integration_order, self.materials = mesh, element, order, materials
        self.kept, self.owner = kept, owner
        self.lame = np.array([first_lame_parameter(material) for material in materials])[owner, None]
        self.shear = np.array([shear_modulus(material) for material in materials])[owner, None]
        self.revolution = mesh.dim() == 2
        linear, kind = CELL_ELEMENTS[element]
        dofs = Dofs(mesh, ElementVector(element()))
        nodes = Dofs(mesh, element()).element_dofs.T
        self.size, cells, shapes = int(dofs.N), nodes.shape[0], nodes.shape[1]
        self.dofs = dofs.element_dofs.T.reshape(cells, shapes, mesh.dim())
        pairs = nodes + owner[:, None] * (nodes.max() + 1)
        _, first, number = np.unique(pairs, return_index=True, return_inverse=True)
        number = number.reshape(cells, shapes)
        places = np.moveaxis(np.asarray(mesh.mapping().F(element.doflocs.T)), 0, -1).reshape(-1, mesh.dim())  # type: ignore[attr-defined]
        from skfem.io.meshio import HEX_MAPPING  # loads meshio

        vtk = HEX_MAPPING if kind == "hexahedron27" else slice(None)
        self.point_dofs = self.dofs.reshape(-1, mesh.dim())[first]
        points, corners = self._in_space(places[first]), number[:, vtk]
        if kind in MIRRORED_CELLS:
            order_of_mirrored, next_corners = MIRRORED_CELLS[kind]
            at = points[corners[:, [0, *next_corners]]]
            inverted = np.linalg.det(at[:, 1:] - at[:, :1]) < 0.0
            corners = np.where(inverted[:, None], corners[:, order_of_mirrored], corners)
        self.grid = Grid(points, corners, kind, owner, self.revolution)

        # The matrix that extrapolates stress from the Gauss points to the nodes.
        self.gauss = Basis(mesh, ElementVector(element()), intorder=GAUSS_ORDER)
        gauss = self.gauss.dx.shape[1]
        functions = linear()
        at_nodes, at_gauss = (
            np.stack([functions.lbasis(x, i)[0] * np.ones(x.shape[1]) for i in range(functions.doflocs.shape[0])])
            for x in (element.doflocs.T, self.gauss.X)  # type: ignore[attr-defined]
        )
        carry = at_nodes.T @ np.linalg.pinv(at_gauss.T)
        rows = np.broadcast_to(number[:, :, None], (cells, shapes, gauss))
        columns = np.broadcast_to(np.arange(cells * gauss).reshape(cells, 1, gauss), rows.shape)
        weights = carry / np.bincount(number.ravel())[number][:, :, None]
        self.mean = sparse.csr_array(sparse.coo_array((weights.ravel(), (rows.ravel(), columns.ravel()))))

    def displacement(self, u: Numbers) -> Numbers:
        """Return the displacement at the nodes, p × 3, m."""
        return self._in_space(self._full(u)[self.point_dofs])

    def stress(self, u: Numbers) -> Numbers:
        """Return the stress at the nodes, p × 6, Pa: extrapolated from the Gauss points of each cell."""
        moved = self.gauss.interpolate(self._full(u))
        gradient = np.moveaxis(np.asarray(moved.grad), (0, 1), (2, 3))
        strain = np.zeros((*gradient.shape[:2], 3, 3))
        if self.revolution:
            # In the mesh z points into the body, in space out of it. r, hoop and z take the places of x, y and z.
            turned = np.array([1.0, -1.0])
            strain[:, :, ::2, ::2] = gradient * turned[:, None] * turned
            strain[:, :, 1, 1] = np.asarray(moved)[0] / np.asarray(self.gauss.global_coordinates())[0]
        else:
            strain[...] = gradient
        strain = 0.5 * (strain + np.swapaxes(strain, 2, 3))
        volume = np.trace(strain, axis1=2, axis2=3)
        stress = np.empty((*volume.shape, 6))
        for (i, j), place in VTK_STRESS_INDEX.items():
            stress[..., place] = 2.0 * self.shear * strain[..., i, j] + (self.lame * volume if i == j else 0.0)
        return np.asarray(self.mean @ stress.reshape(-1, 6))

    def stiffness_parts(self) -> list[sparse.csr_array]:
        """Return the contribution of each material to the stiffness, N/m."""
        basis = Basis(self.mesh, ElementVector(self.element()), intorder=self.integration_order)
        parts = part_stiffnesses(basis, self.materials, self.owner)
        return [part[self.kept][:, self.kept] for part in parts]

    def _full(self, u: Numbers) -> Numbers:
        """Return all degrees of freedom, with zeros for those that supports hold."""
        full = np.zeros(self.size)
        full[self.kept] = u
        return full

    def _in_space(self, vectors: Numbers) -> Numbers:
        """Return vectors in space from vectors in the mesh: (r, z) becomes (r, 0, −z)."""
        if not self.revolution:
            return vectors
        return np.column_stack([vectors[:, 0], np.zeros(len(vectors)), -vectors[:, 1]])
