"""Structures from the mass and stiffness matrices of other programs."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy import sparse
from scipy.spatial import cKDTree
from skfem import ElementHex1, ElementHex2, ElementHexS2, ElementTetP1, ElementTetP2

from structures.bodies.body_mesh import IGNORED_CELL_TYPES, BodyMesh
from structures.bodies.solid import PATCH_DIVISOR, Patch, patch_compliance, point_of
from structures.caution import caution, collected
from structures.checks import count_of, short, whole
from structures.described import described_as
from structures.linear_algebra.factor import numbers
from structures.material import Material
from structures.meshes.abaqus_file import NODE_NUMBERS
from structures.meshes.mesh_files import read_mesh
from structures.meshes.mesh_reading import points_of
from structures.other_programs.matrix_files import HELD, Numbers, in_order_of, matrix_of, numbers_in
from structures.quantities import Asks, Component, Coordinate, Curvature, InFile, Length, Quantity, Scale
from structures.structure import Structure, Vector
from structures.surface import Surface

Direction = tuple[Component, Component, Component]
Residual = Annotated[float, Quantity("m/N", "a compliance", "2e-9 m/N", -np.inf)]

ALONG_Z = (0.0, 0.0, 1.0)

TRACES = {
    "tetra": ElementTetP1, "tetra10": ElementTetP2, "hexahedron": ElementHex1, "hexahedron20": ElementHexS2,
    "hexahedron27": ElementHex2,
}  # fmt: skip
"""For each of meshio's cell types the element whose shape functions the cell has in other programs."""

MEMORY = "in memory"
"""What an origin says of an argument that was no file."""

LEAST_PART = 1e-9
"""The part of a force along a direction in which a node is held that counts as zero."""

POINT_FORCE = (
    "a point force indents a solid the more the finer its mesh is, and Hertz's law contains the indentation already; "
    "give mesh, point and patch_radius, or state residual_flexibility (0.0 for shells, whose nodes may lack rotations)"
)

SAME_PLACE = 1e-3
"""Nodes of the mesh and of an element coincide if they are closer than this part of the patch's radius."""


@described_as(also=("matrices",))
def from_matrices(
    mass: Annotated[Any, InFile("a mass matrix", "plate.mas")],
    stiffness: Annotated[Any, InFile("a stiffness matrix", "plate.sti")],
    material: Material,
    contact: Annotated[Any, InFile("a contact vector", "contact.csv")] | None = None,
    node: Annotated[int | Sequence[int], Asks("the number of the node that is struck, or a list")] | None = None,
    direction: Direction = ALONG_Z,
    mesh: Annotated[Any, InFile("the mesh of the matrices", "body.inp")] | None = None,
    point: tuple[Coordinate, Coordinate, Coordinate] | None = None,
    patch_radius: Length | None = None,
    damping: Annotated[Any, InFile("a damping matrix", "plate.mtx")] | None = None,
    residual_flexibility: Residual | None = None,
    curvature: Curvature = 0.0,
    scale: Scale = 1.0,
) -> Structure:
    """A body whose mass and stiffness come from another finite-element program.

    All motions that the matrices have are in it; `reduce` makes it small. What is struck is stated by one of `contact`,
    `node`, and `mesh` with `point`.

    Parameters
    ----------
    mass, stiffness : matrix, str or Path
        Sparse or dense, n × n; or a file: Matrix Market and Abaqus (.mtx), CalculiX (.mas, .sti; the .dof beside them),
        Nastran (.op4, .pch; `hertzlink[nastran]`), Ansys (.full; `hertzlink[ansys]`). Held rows are left out.
    material : Material
        The material at the contact, for Hertz's law.
    contact : array, str or Path, optional
        b, n numbers, or n × p for p contacts; or a file with a number for each row, or with lines "node, weight", which
        spreads the force over nodes along `direction`.
    node : int or sequence of int, optional
        Number of the node that is struck, or of several. The file must state the nodes of its rows.
    direction : sequence of float
        The direction of the push at `node`.
    mesh : str, Path or meshio.Mesh, optional
        The mesh of the matrices, with the numbers of its nodes (.inp without instances, .bdf, .msh).
    point : sequence of float, optional
        The point of `mesh` that is struck, m. On a solid the force is spread over a patch, as by `solid`, along the
        inward normal; on shells the nearest node is struck along `direction`.
    patch_radius : float, optional
        Radius of the patch, m; by default the shortest side of the bounding box divided by 12.
    damping : matrix, str or Path, optional
        The damping matrix; `damped` adds other losses.
    residual_flexibility : float, optional
        Local compliance, m/N, that the matrices lack (positive), or that they have although Hertz's law contains it
        (negative). By default that of the patch is taken away, and zero for other contacts.
    curvature : float
        Curvature of the surface at the contact, 1/m, for Hertz's law.
    scale : float
        m per unit of length of the matrices: 1e-3 for those in mm, N, s and t.

    Returns
    -------
    Structure
        The body.

    Raises
    ------
    ValueError
        If a file cannot be read, the matrices do not fit each other, or the contact is none of theirs.

    Notes
    -----
    A point force on a node of a solid indents it by an amount that grows as the mesh is refined, and that Hertz's law
    contains already: a warning says so. A plate of shells has no such indentation. What frequencies the mesh resolves
    is not known, so no run checks it.

    Examples
    --------
    >>> import hertzlink as hl
    >>> spring = hl.from_matrices([[0.0141]], [[1.7e7]], hl.PTFE, contact=[1.0])
    >>> spring.size, spring.origin["kind"]
    (1, 'from_matrices')
    """
    first = matrix_of("stiffness", stiffness)
    inertia = in_order_of("mass", matrix_of("mass", mass), first, isinstance(mass, str | Path))
    if not abs(inertia).sum() > 0.0:
        raise ValueError("mass: all its numbers are zero; must be the mass matrix, kg")
    losses = None
    if damping is not None:
        losses = in_order_of("damping", matrix_of("damping", damping), first, isinstance(damping, str | Path))
    weight = abs(first.matrix).sum(axis=0) + abs(inertia).sum(axis=0)
    free = np.flatnonzero((first.matrix.diagonal() < 0.99 * HELD) & (weight > 0.0))
    rows = _Rows(first.labels, free, first.matrix.shape[0])
    stated = {"contact": contact, "node": node, "point": point}
    if len(both := [name for name, value in stated.items() if value is not None]) != 1:
        instead = f", not by {' and '.join(both)}" if both else ""
        raise ValueError(f"contact: state what is struck by one of contact, node, and mesh with point{instead}")
    local = 0.0
    if node is not None:
        listed: Sequence[Any] = node if isinstance(node, Sequence) else [node]
        many = [whole("node", number) for number in listed]
        vector = np.column_stack([rows.push("node", [number], [1.0], direction) for number in many])
        if residual_flexibility is None and rows.is_solid:
            caution(f"node = {short(node)}: {POINT_FORCE}")
    elif point is not None:
        vector, local = _at_point(mesh, point_of("point", point), patch_radius, rows, direction, scale, material)
    else:
        vector = _as_vector(contact, rows, direction)
    count = vector.shape[1] if vector.ndim > 1 else 1
    flexibility, surface = local + (residual_flexibility or 0.0), Surface(material, curvature)
    files = {"mass": mass, "stiffness": stiffness, "contact": contact, "mesh": mesh}
    origin = {name: source_of_argument(value) for name, value in files.items() if value is not None}
    notes = {} if damping is None else {"damping_matrix": source_of_argument(damping)}
    return Structure(
        scale * inertia[free][:, free],
        scale * first.matrix[free][:, free],
        None if losses is None else scale * losses[free][:, free],
        scale * (vector if count > 1 else vector.reshape(-1)),
        flexibility if count == 1 else [flexibility] * count,
        surface if count == 1 else [surface] * count,
        {**origin, "damping": None, **notes, **rows.total_mass(scale * inertia, scale)},
    )


class _Rows:
    """The rows of the matrices of a file that move: their nodes and directions, and their places in the file."""

    def __init__(self, labels: Numbers | None, free: Numbers, count: int) -> None:
        self.labels, self.free, self.count = labels, free, count
        self.rows_of: dict[tuple[int, ...], list[int]] = {}
        for row, label in enumerate(() if labels is None else map(tuple, labels[free].tolist())):
            self.rows_of.setdefault(label, []).append(row)

    @property
    def is_solid(self) -> bool:
        """Whether no node rotates. CalculiX expands shells to solids, whose nodes share the label of the shell's."""
        return max(axis for _, axis in self.rows_of) <= 3 and len(self.rows_of) == self.free.size

    def push(self, what: str, nodes: Any, weights: Any, direction: Vector | Direction) -> Vector:
        """Return b of forces on nodes in one direction; raise a ValueError where a node does not move so."""
        if self.labels is None:
            raise ValueError(f"{what}: the file of the stiffness does not state the nodes of its rows; give contact")
        size = float(np.linalg.norm(direction))
        if size == 0.0:
            raise ValueError(f"direction = {tuple(direction)!r}: must have a length")
        vector = np.zeros(self.free.size)
        for node, weight in zip(nodes, weights, strict=True):
            for axis, part in enumerate(np.asarray(direction) / size, 1):
                rows = self.rows_of.get((int(node), axis), [])
                if not rows and abs(part) > LEAST_PART:
                    moving = {label[0] for label in self.rows_of}
                    held = f"is held in direction {axis}"
                    why = held if node in moving else f"is none of the {len(moving)} nodes that move"
                    raise ValueError(f"{what} = {int(node)}: {why}")
                vector[rows] += weight * part / max(len(rows), 1)
        return vector

    def total_mass(self, mass: sparse.csr_array, scale: float) -> dict[str, float]:
        """Return the mass that moves along each axis, kg, for the user to compare; none without labels."""
        if self.labels is None:
            return {}
        along = [(self.labels[:, 1] == axis).astype(float) / scale for axis in (1, 2, 3)]
        return {"moving_mass": max(float(axis @ (mass @ axis)) for axis in along)}


def _as_vector(contact: Any, rows: _Rows, direction: Direction) -> Vector:
    """Return b that the user states, as numbers, as a file of them, or as a file of nodes and weights."""
    if isinstance(contact, str | Path):
        _, table = numbers_in(f"contact = {str(contact)!r}", Path(contact), (1, 2))
        if table.shape[1] == 2:
            return rows.push("contact: node", table[:, 0].astype(np.int64), table[:, 1], direction)
        contact = table[:, 0]
    vector = numbers("contact", contact)
    if vector.ndim not in (1, 2) or len(vector) != rows.count:
        raise ValueError(
            f"contact has shape {vector.shape}: must have {count_of(rows.count, 'row')}, as the stiffness has"
        )
    if np.count_nonzero(vector[rows.free]) < np.count_nonzero(vector):
        raise ValueError("contact: acts on a row that is held")
    return np.asarray(vector[rows.free])


def _at_point(
    mesh: Any, point: Vector, radius: float | None, rows: _Rows, direction: Direction, scale: float, material: Material
) -> tuple[Vector, float]:
    """Return b of a force at a point of the mesh, and the flexibility, m/N, that takes away what Hertz's law
    contains."""
    if mesh is None:
        raise ValueError("mesh: point needs the mesh of the matrices, with the numbers of its nodes")
    read = read_mesh(mesh)
    if NODE_NUMBERS not in read.point_data:
        raise ValueError(
            f"mesh = {source_of_argument(mesh)!r}: does not state the numbers of its nodes; give node or contact"
        )
    nodes, places = np.asarray(read.point_data[NODE_NUMBERS]), scale * points_of(read)
    if all(block.type in IGNORED_CELL_TYPES for block in read.cells):
        nearest = int(nodes[np.linalg.norm(places - point, axis=1).argmin()])
        return rows.push("mesh: node", [nearest], [1.0], direction), 0.0
    with collected() as messages:
        body = BodyMesh(read, None if scale == 1.0 else scale)
    for message in messages:
        if "hexahedron20" not in message:  # their midpoints count here
            caution(message)
    patch = Patch(body, point, None, body.shortest_side / PATCH_DIVISOR if radius is None else radius)
    at, weights = patch.weights(body, TRACES[body.kind]())
    away, nearest_of = cKDTree(places).query(at)
    if away.max() > SAME_PLACE * patch.radius:
        raise ValueError(f"mesh: a point of its {body.kind} cells at the contact, as they are understood, is no node")
    vector = rows.push("mesh: node", nodes[nearest_of], weights, -patch.normal)
    return vector, -patch_compliance(material, patch.radius)


def source_of_argument(value: Any) -> str:
    """Return what an origin says of an argument: the file, or that it was in memory."""
    return str(Path(value).absolute()) if isinstance(value, str | Path) else MEMORY
