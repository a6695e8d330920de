"""Solid cylinders of one or more bonded layers, struck on the axis: axisymmetric linear elasticity."""

from collections.abc import Callable
from functools import partial
from itertools import pairwise
from math import ceil, isclose
from operator import attrgetter
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from skfem import Basis, ElementQuad2, ElementVector, FacetBasis, MeshQuad

from structures.bodies.elastic_field import elastic_field
from structures.bodies.elasticity import (
    Foundation,
    absorbing_faces,
    body_matrices,
    foundation_springs,
    patch_compliance,
    patch_vector,
    pressure_speed,
    shear_speed,
)
from structures.bodies.rod import Layer, Layers
from structures.checks import listed
from structures.described import described_as
from structures.fineness import HIGHEST_FREQUENCY, fineness
from structures.quantities import Count, Frequency, Length, OneOf
from structures.structure import Structure, Vector
from structures.surface import Surface

INTEGRATION_ORDER = 5
"""Exact for the mass matrix of rectangular quadratic elements with the weight r."""

PATCH_DIVISOR = 8.0
"""The default radius of the patch is the shortest of radius, first layer and shear wavelength, divided by this number.
"""

DEFAULT_CELLS = 4
"""Default number of cells across the radius of the patch and in the shortest shear wavelength; twice as many change AR
by less than 0.05 % (docs/numerics.md).
"""

CELL_GROWTH, EDGE_GROWTH = 1.2, 2.0
"""Cells grow by the first over `cells` times the distance from the patch; by the second from the edge of the patch, and
from the corners of bonded layers, up to their size elsewhere.
"""

PATCH_EDGE_REFINEMENT = 4.0
"""Cells at the edge of the patch, where the pressure drops to zero, are smaller by this factor. With four cells the
compliance of the patch is then 0.03 % off; without the refinement it is 0.2 % off.
"""

CORNER_REFINEMENT = 16.0
"""Cells at the rim, the interfaces and the base are smaller than radius/cells by this factor: stresses have no bound in
the corners where two materials, or a layer and its base, are bonded (Williams, J. Appl. Mech. 19 (1952) 526). Cells of
radius/cells there make steel on a short layer of PTFE 3.6 % too stiff.
"""

MOST_CELLS = 100_000
"""Upper limit for the whole mesh: about 800 000 degrees of freedom."""


@described_as(called="cylinder")
def layered_cylinder(
    layers: Layers,
    base: Annotated[str, OneOf("fixed", "free", "absorbing", others=" or a Foundation")] | Foundation = "fixed",
    side: Annotated[str, OneOf("free", "absorbing")] = "free",
    patch_radius: Length | None = None,
    highest_frequency: Frequency = HIGHEST_FREQUENCY,
    cells: Annotated[int, Count()] = DEFAULT_CELLS,
) -> Structure:
    """A cylinder of bonded layers of equal radius, struck on the axis of the free face of the first layer.

    Linear elasticity of a body of revolution, consistent mass. The quadratic elements are graded towards the contact,
    the rim, the interfaces and the base.

    Parameters
    ----------
    layers : sequence of Layer
        The layers; the struck one comes first. All have the same radius.
    base : {"fixed", "free", "absorbing"} or Foundation
        The condition at the far end. "free": the cylinder can fly off. A Foundation holds the base elastically.
    side : {"free", "absorbing"}
        The condition on the lateral surface. Absorbing faces carry Lysmer's dashpots. A base below a free side absorbs
        the waves of a rod (ρ c_bar), a base below an absorbing side those of a large body (ρ c_p). If both absorb, a
        large cylinder acts as a half-space that radiates waves.
    patch_radius : float, optional
        Radius a of the circle over which the force is spread evenly, m. The mean displacement of the circle is that of
        the contact. The compliance of a half-space under this load, 16(1 − ν²)/3π²Ea, is subtracted in `flexibility`,
        because Hertz's law already contains it. The patch must be wider than the contact. By default a is an eighth of
        the shortest of radius, first layer and shear wavelength.
    highest_frequency : float
        Hz. The mesh resolves shear waves up to this frequency.
    cells : int
        Number of elements across the radius of the patch, and in the shortest shear wavelength.

    Returns
    -------
    Structure
        The cylinder, with a field for displacements and stresses.

    Raises
    ------
    ValueError
        If the layers differ in radius, the patch is larger than a layer, or the mesh is too large.

    Notes
    -----
    Half or twice the patch radius changes amplitude ratios by less than 0.2 % (steel, PTFE, steel on PTFE), also with a
    dashpot at the contact. Twice as many cells change the ratio of the primary wave by less than 0.05 %.

    References
    ----------
    Lysmer and Kuhlemeyer, J. Eng. Mech. Div. 95 (1969) 859 (absorbing faces).

    Examples
    --------
    >>> import hertzlink as hl
    >>> body = hl.layered_cylinder([hl.Layer(hl.STEEL_440C, length=20e-3, radius=9.525e-3)], base="absorbing")
    >>> body.contacts, body.damping is not None, body.flexibility < 0.0
    (1, True, True)
    """
    stack = listed("layers", layers, Layer, "one Layer or more, the struck one first")
    radii = [layer.radius for layer in stack]
    if not all(isclose(radius, radii[0]) for radius in radii):
        raise ValueError(f"layers: have radii {radii} m; a cylinder must have one radius, rod() accepts several")
    materials = [layer.material for layer in stack]
    depths = np.concatenate([[0.0], np.cumsum([layer.length for layer in stack])])
    patch = _patch_radius(patch_radius, stack[0], highest_frequency)
    coarsest = [shear_speed(material) / highest_frequency / cells for material in materials]
    across = _nodes_across(radii[0], patch, min(coarsest), cells)
    along = _nodes_along(depths, radii[0], patch, coarsest, cells)
    _check_size(float(across.size * along.size))

    # The half-plane (r, z): r from the axis, z from the struck face into the body.
    mesh, element = MeshQuad.init_tensor(across, along), ElementVector(ElementQuad2())
    basis = Basis(mesh, element, intorder=INTEGRATION_ORDER)
    r, z = mesh.p[:, mesh.facets].mean(axis=1)
    bottom = np.flatnonzero(z == along[-1])

    def on(facets: NDArray[np.intp]) -> Any:
        return FacetBasis(mesh, element, facets=facets, intorder=INTEGRATION_ORDER)

    def layer_at(depth: Vector) -> NDArray[np.int64]:
        return np.asarray(np.searchsorted(depths[1:-1], depth))

    owner = layer_at(mesh.p[1, mesh.t].mean(axis=0))
    mass, stiffness = body_matrices(basis, materials, owner)
    held = basis.get_dofs(np.flatnonzero(r == 0.0)).all(["u^1"])
    if isinstance(base, Foundation):
        stiffness = stiffness + foundation_springs(on(bottom), base)
    elif base == "fixed":
        held = np.union1d(held, basis.get_dofs(bottom).all())
    free = np.setdiff1d(np.arange(basis.N), held)
    absorbing = np.flatnonzero((z == along[-1]) & (base == "absorbing") | (r == across[-1]) & (side == "absorbing"))
    damping = None
    if absorbing.size:
        speed = attrgetter("bar_speed") if side == "free" else pressure_speed
        damping = absorbing_faces(on(absorbing), materials, layer_at(z[absorbing]), speed)[free][:, free]
    contact = patch_vector(on(np.flatnonzero((z == 0.0) & (r < patch))))
    made = Structure(
        mass[free][:, free],
        stiffness[free][:, free],
        damping,
        contact[free],
        -patch_compliance(materials[0], patch),
        Surface(materials[0]),
        {"patch_radius": patch},
        field=elastic_field(mesh, ElementQuad2, INTEGRATION_ORDER, free, materials, owner),
    )
    return made.made_by(partial(layered_cylinder, layers, base, side, patch_radius, highest_frequency, cells))


def _patch_radius(radius: float | None, first: Layer, frequency: float) -> float:
    if radius is None:
        return min(first.radius, first.length, shear_speed(first.material) / frequency) / PATCH_DIVISOR
    if radius > first.radius:
        raise ValueError(f"patch_radius = {radius!r}: must not exceed the cylinder's radius, {first.radius} m")
    if radius > first.length * (1.0 + 1e-6):
        raise ValueError(
            f"patch_radius = {radius!r}: must not exceed the first layer's length, {first.length} m, or the patch is "
            "no spot on a large body of its material"
        )
    return first.radius if isclose(radius, first.radius, rel_tol=1e-6) else radius


def _nodes_across(radius: float, patch: float, coarsest: float, cells: int) -> Vector:
    """Return the nodes in r, m: fine on the patch and finest at its edge, which is a node; fine at the rim."""

    def size(r: Vector) -> Vector:
        about_both = np.minimum(_about_patch(r - patch, patch, cells), _about_corner(radius - r, radius, cells))
        return np.minimum(about_both, coarsest)

    inside = _graded(0.0, patch, size)
    return inside if patch == radius else np.append(inside[:-1], _graded(patch, radius, size))


def _nodes_along(depths: Vector, radius: float, patch: float, coarsest: list[float], cells: int) -> Vector:
    """Return the nodes in z, m: fine at the struck face, the interfaces and the base, which are nodes."""
    nodes = []
    for coarse, (start, end) in zip(coarsest, pairwise(depths), strict=True):

        def size(z: Vector, coarse: float = coarse) -> Vector:
            nearest = np.abs(z - depths[1:, None]).min(axis=0)
            about_both = np.minimum(_about_patch(z, patch, cells), _about_corner(nearest, radius, cells))
            return np.minimum(about_both, coarse)

        nodes.append(_graded(start, end, size)[:-1])
    return np.append(np.concatenate(nodes), depths[-1])


def _about_patch(beyond: Vector, patch: float, cells: int) -> Vector:
    """Return the size of cells, m, at a distance beyond the patch's edge (negative inside), m."""
    on_patch = patch / cells + CELL_GROWTH / cells * np.maximum(beyond, 0.0)
    at_edge = patch / cells / PATCH_EDGE_REFINEMENT + EDGE_GROWTH / cells * np.abs(beyond)
    return np.minimum(on_patch, at_edge)


def _about_corner(beyond: Vector, radius: float, cells: int) -> Vector:
    """Return the size of cells, m, at a distance from the rim, an interface or the base, m."""
    return radius / cells / CORNER_REFINEMENT + EDGE_GROWTH / cells * np.abs(beyond)


def _graded(start: float, end: float, size: Callable[[Vector], Vector]) -> Vector:
    """Nodes from start to end, m, about `size` apart: at equal steps of ∫ dx/size."""
    near = 0.5 * np.geomspace(1e-7, 1.0, 1000)
    fine = start + (end - start) * np.concatenate([[0.0], near, 1.0 - near[-2::-1], [1.0]])
    density = fineness().cells / size(fine)
    passed = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))])
    _check_size(float(passed[-1]))
    nodes: Vector = np.interp(np.linspace(0.0, passed[-1], ceil(passed[-1] * (1.0 - 1e-9)) + 1), passed, fine)
    nodes[0], nodes[-1] = start, end
    return nodes


def _check_size(cells: float) -> None:
    if not cells <= MOST_CELLS:
        raise ValueError(
            f"patch_radius, highest_frequency, cells: need {cells:.3g} elements or more; at most {MOST_CELLS} fit"
        )
