"""The protocol of a plate's theory and its finite elements, and the code that elements on meshes share.

A new element is one file with one class that meets `Element`: `Plate(shape, section, supports, MyElement())` takes it
as it is. An element with shape functions on a mesh of scikit-fem need not handle supports and additions itself: it
returns `on_mesh(functions, ...)`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeAlias

import numpy as np
from scipy import sparse

from plates.additions import Addition, PointMass, Prestress, Stiffener, Weakened
from plates.elements.field import mesh_sampler
from plates.section import Section
from plates.shapes.mesh_geometry import Mirror, check_straight
from plates.shapes.shape import Cells, PlateMesh
from plates.support import ElasticEdge, Support
from structures.field import Sampler
from structures.meshes.mesh_reading import Tag
from structures.structure import Vector

Matrix: TypeAlias = sparse.csr_array
Supported: TypeAlias = Mapping[Tag, Support]


class Touch(NamedTuple):
    """One contact: its place (x, y), m; the lines of symmetry through it; the wall with the material that is struck."""

    place: Vector
    mirrors: Sequence[Mirror]
    wall: Section


@dataclass(frozen=True, eq=False)
class Assembled:
    """A plate on a mesh, in the n motions that its supports leave.

    mass, stiffness: sparse, n × n. contact: returns the n numbers that spread a unit force at a Touch and read the
    displacement there. sampler: returns what draws displacement and stress; takes the stiffness of the whole plate.
    Both must be picklable: functions of a module, methods, or partial(...) of them.
    """

    mass: Matrix
    stiffness: Matrix
    contact: Callable[[Touch], Vector]
    sampler: Callable[[Matrix], Sampler]


class Element(Protocol):
    """A theory of plates and its finite elements."""

    @property
    def name(self) -> str:
        """The theory, the first word of the plate's kind in results: "Kirchhoff"."""
        ...

    @property
    def thin(self) -> bool:
        """True if the theory neglects shear and rotary inertia, as Kirchhoff's does."""
        ...

    @property
    def patch_radius(self) -> float:
        """Radius of the disc that the contact force is spread over, m; 0 where it acts at a point."""
        ...

    @property
    def unknowns(self) -> float:
        """Degrees of freedom per square of the coarsest cell's side: an estimate, to refuse excessive meshes."""
        ...

    def described(self) -> dict[str, Any]:
        """Return the element's own parameters as plain data, for results."""
        ...

    def wavelength(self, section: Section, rigidity: float, frequency: float) -> float:
        """Return the length of flexural waves of a frequency, Hz, in a wall of a bending stiffness, N m; in m."""
        ...

    def cells(self, wavelength: float, additions: Sequence[Addition]) -> Cells:
        """Return the cells that resolve flexural waves of a length, m."""
        ...

    def objection(self, addition: Addition) -> str:
        """Return why the element cannot carry an addition; empty where it can."""
        ...

    def assemble(
        self, mesh: PlateMesh, section: Section, supports: Supported, additions: Sequence[Addition]
    ) -> Assembled:
        """Return the plate on a mesh, with all edges that are named in supports held; raise a ValueError for a mesh
        that it cannot use."""
        ...

    def flexibility(self, wall: Section) -> float:
        """Return the part of the local indentation that neither the element nor Hertz's law contains, m/N."""
        ...


def thin_wavelength(section: Section, rigidity: float, frequency: float) -> float:
    """Return the length of flexural waves in Kirchhoff's theory, 2π (D/m)^¼ / √ω, m; frequency in Hz."""
    return float(2.0 * np.pi * (rigidity / section.mass) ** 0.25 / (2.0 * np.pi * frequency) ** 0.5)


def thick_wavelength(
    mass: float, rigidity: float, frequency: float, rotary_inertia: float = 0.0, shear: float = np.inf
) -> float:
    """Return the length of flexural waves in Mindlin's theory, m; frequency in Hz, rotary inertia J in kg, shear
    stiffness in N/m.

    2π/k with the larger root k of D k⁴ − (J + m D/S) ω² k² − m ω² (1 − J ω²/S) = 0.
    """
    circular = 2.0 * np.pi * frequency
    linear = (rotary_inertia + mass * rigidity / shear) * circular**2
    constant = mass * circular**2 * (1.0 - rotary_inertia * circular**2 / shear)
    square = (linear + np.sqrt(linear**2 + 4.0 * rigidity * constant)) / (2.0 * rigidity)
    return float(2.0 * np.pi / np.sqrt(square))


def on_mesh(
    functions: Any,
    mesh: PlateMesh,
    section: Section,
    supports: Supported,
    additions: Sequence[Addition],
    force: Callable[[Matrix, Touch], Vector] | None = None,
    stiffener: Callable[[Stiffener], tuple[Matrix, Matrix]] | None = None,
) -> Assembled:
    """Return a plate of shape functions on a mesh: weakened regions, springs, point masses, prestress and held edges.

    functions: of n degrees of freedom, as MindlinFunctions. matrices(weakening) returns M and K; tension(forces)
    the stiffness ½ ∫ N_ij w,i w,j; springs(facets, edge) that of an ElasticEdge; kept(edges, supports) all n from
    those that the supports leave; deflection(points) reads w; sampled(places) w and (w_xx, w_yy, 2 w_xy) in each cell.
    force: returns the contact vector of a Touch; takes what `kept` returned as well; None for a force at a point.
    stiffener: returns M and K of a stiffener, size × size each; None for elements that object to stiffeners.
    """
    mass, stiffness = functions.matrices(weakening(additions))
    for name, support in supports.items():
        if support in ("simple", "soft simple") and mesh.mesh.t.shape[0] == 4:
            check_straight(mesh.mesh, mesh.edges[name], name)
        if isinstance(support, ElasticEdge):
            stiffness = stiffness + functions.springs(mesh.edges[name], support)
    for i, addition in enumerate(additions):
        if isinstance(addition, Prestress):
            stiffness = stiffness + functions.tension(addition.forces)
        try:
            if isinstance(addition, PointMass):
                reading = functions.deflection(np.array([[addition.x, addition.y]]))
                mass = mass + addition.mass * (reading.T @ reading)
            elif isinstance(addition, Stiffener) and stiffener is not None:
                more, stiffer = stiffener(addition)
                mass, stiffness = mass + more, stiffness + stiffer
        except ValueError as error:
            raise ValueError(f"additions[{i}] = {addition!r}: {error}") from error
    expansion = functions.kept(mesh.edges, supports)
    check_free(expansion.shape[1])
    mass, stiffness = (sparse.csr_array(expansion.T @ sparse.csr_array(m) @ expansion) for m in (mass, stiffness))
    sampler = partial(mesh_sampler, mesh.mesh, functions, expansion, section)
    at_point = partial(_point_force, functions)
    return Assembled(mass, stiffness, partial(force or at_point, expansion), sampler)


def _point_force(functions: Any, expansion: Matrix, touch: Touch) -> Vector:
    return np.asarray(functions.deflection(touch.place[None]).toarray()[0] @ expansion)


def check_free(count: int) -> None:
    """Raise a ValueError where the supports leave no degree of freedom."""
    if count == 0:
        raise ValueError("cells, mesh: too few cells, the supports hold every degree of freedom; use smaller ones")


def weakening(additions: Sequence[Addition]) -> Callable[[Vector], Vector] | None:
    """Return the factor of the bending stiffness at points 2 × …, m; None where there is no weakened region."""
    regions = [addition for addition in additions if isinstance(addition, Weakened)]

    def factor(points: Vector) -> Vector:
        (x, y), stiffness_factor = points, np.ones(points.shape[1:])
        for addition in regions:
            left, right, bottom, top = addition.region
            stiffness_factor[(x > left) & (x < right) & (y > bottom) & (y < top)] *= addition.factor
        return stiffness_factor

    return factor if regions else None
