"""Solid cylinders of one or more bonded layers, struck on the axis: axisymmetric linear elasticity."""

from functools import partial
from itertools import pairwise
from math import ceil, isclose, pi
from typing import Annotated, Any

import numpy as np
from skfem import Basis, ElementQuad2, ElementVector, FacetBasis, LinearForm, MeshQuad
from skfem.helpers import dot

from structures.bodies.elastic_field import ElasticSampler
from structures.bodies.elasticity import body_matrices, patch_compliance, shear_speed
from structures.bodies.rod import Layer, Layers
from structures.checks import listed
from structures.described import described_as
from structures.field import Field
from structures.fineness import HIGHEST_FREQUENCY, fineness
from structures.quantities import Count, Frequency, Length, OneOf
from structures.structure import Structure, Vector
from structures.surface import Surface

INTEGRATION_ORDER = 5  # Exact for the mass matrix of rectangular quadratic elements with the weight r

MOST_CELLS = 100_000  # Upper limit for the whole mesh: about 800 000 degrees of freedom


@described_as(called="cylinder")
def layered_cylinder(
    layers: Layers,
    base: Annotated[str, OneOf("fixed", "free")] = "fixed",
    patch_radius: Length | None = None,
    highest_frequency: Frequency = HIGHEST_FREQUENCY,
    cells: Annotated[int, Count()] = 4,
) -> Structure:
    """A cylinder of bonded layers of equal radius, struck on the axis of the free face of the first layer.

    Linear elasticity of a body of revolution, consistent mass. The quadratic elements are graded towards the contact,
    the rim, the interfaces and the base.

    Parameters
    ----------
    layers : list of Layer
        The layers as in `rod`, the struck one first; all have the same radius.
    base : {"fixed", "free"}
        The support of the far end.
    patch_radius : float, optional
        Radius a of the circle over which the force is spread evenly, m; it must be wider than the contact. The default
        is an eighth of the smallest of the radius, the length of the first layer and the shear wavelength. The
        displacement of the contact is the circle's mean, minus that of a half-space, which Hertz's law contains.
    highest_frequency : float
        Hz. The mesh resolves shear waves up to this frequency.
    cells : int
        Number of elements across the radius of the patch, and per shortest shear wavelength.

    Returns
    -------
    Structure
        The cylinder, with a field for displacements and stresses.

    Notes
    -----
    Half or twice the patch radius changes amplitude ratios by less than 0.2 % (steel, PTFE, steel on PTFE), also with a
    dashpot at the contact. Doubling `cells` changes the ratio of the primary wave by less than 0.05 %.

    Examples
    --------
    >>> body = hl.layered_cylinder([hl.Layer(hl.STEEL_440C, length=20e-3, radius=9.525e-3)])
    >>> body.contacts, body.flexibility < 0.0
    (1, True)
    """
    stack = listed("layers", layers, Layer, "one Layer or more, the struck one first")
    materials, radii, first = [layer.material for layer in stack], [layer.radius for layer in stack], stack[0]
    if not all(isclose(radius, first.radius) for radius in radii):
        raise ValueError(f"layers: have radii {radii} m; a cylinder must have one radius; rod() accepts several")
    coarsest = [shear_speed(material) / highest_frequency / cells for material in materials]
    if patch_radius is None:
        patch = min(first.radius, first.length, shear_speed(first.material) / highest_frequency) / 8.0
    else:
        for limit, what in ((first.radius, "the cylinder's radius"), (first.length, "the first layer's length")):
            if patch_radius > limit * (1.0 + 1e-6):
                raise ValueError(f"patch_radius = {patch_radius!r}: must not exceed {what}, {limit} m")
        patch = first.radius if isclose(patch_radius, first.radius, rel_tol=1e-6) else patch_radius

    # The half-plane (r, z): r from the axis, z from the struck face into the body.
    depths = np.concatenate([[0.0], np.cumsum([layer.length for layer in stack])])
    mesh = MeshQuad.init_tensor(*_nodes(depths, first.radius, patch, coarsest, cells))
    element = ElementVector(ElementQuad2())
    basis = Basis(mesh, element, intorder=INTEGRATION_ORDER)
    owner = np.searchsorted(depths[1:-1], mesh.p[1, mesh.t].mean(axis=0))
    mass, stiffness = body_matrices(basis, materials, owner)
    r, z = mesh.p[:, mesh.facets].mean(axis=1)
    held = basis.get_dofs(np.flatnonzero(r == 0.0)).all(["u^1"])
    if base == "fixed":
        held = np.union1d(held, basis.get_dofs(np.flatnonzero(z == depths[-1])).all())
    free = np.setdiff1d(np.arange(basis.N), held)
    struck = np.flatnonzero((z == 0.0) & (r < patch))
    # The contact vector spreads a unit force evenly over the patch and reads its mean inward displacement.
    faces = FacetBasis(mesh, element, facets=struck, intorder=INTEGRATION_ORDER)
    area = float((faces.dx * (2.0 * pi * faces.global_coordinates()[0])).sum())
    contact = np.asarray(_inward.assemble(faces)) / area
    made = Structure(
        mass[free][:, free],
        stiffness[free][:, free],
        None,
        contact[free],
        -patch_compliance(first.material, patch),
        Surface(first.material),
        {"patch_radius": patch},
        field=Field(partial(ElasticSampler, mesh, ElementQuad2, INTEGRATION_ORDER, free, materials, owner), free.size),
    )
    return made.made_by(partial(layered_cylinder, layers, base, patch_radius, highest_frequency, cells))


@LinearForm
def _inward(v: Any, w: Any) -> Any:
    return -dot(v, w.n) * (2.0 * pi * w.x[0])


def _nodes(depths: Vector, radius: float, patch: float, coarsest: list[float], cells: int) -> tuple[Vector, Vector]:
    """Return the nodes in r and in z, m; depths: of the faces of the layers. coarsest: largest cell of each layer."""

    def graded(start: float, end: float, edge: float, corners: Vector, largest: float) -> Vector:
        """Return nodes from start to end, m, without the first, about as far apart as cells are large: equal ∫ dx/size.

        edge: the end of the patch. corners: places of singular stresses. largest: the largest cell.
        """
        near = 0.5 * np.geomspace(1e-7, 1.0, 1000)
        fine = start + (end - start) * np.concatenate([[0.0], near, 1.0 - near[-2::-1], [1.0]])
        # The pressure drops to zero at the edge: without smaller cells there the compliance is 0.2 % off.
        beyond, corner = fine - edge, np.abs(fine - corners[:, None]).min(axis=0)
        at_patch = np.minimum(patch + 1.2 * np.maximum(beyond, 0.0), patch / 4.0 + 2.0 * np.abs(beyond)) / cells
        # Stresses are singular in the corners of bonded materials (Williams, J. Appl. Mech. 19 (1952) 526): cells 16
        # times as large there make steel on a short layer of PTFE 3.6 % too stiff.
        at_corner = (radius / 16.0 + 2.0 * np.abs(corner)) / cells
        density = fineness().cells / np.minimum(np.minimum(at_patch, at_corner), largest)
        passed = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * np.diff(fine))])
        count = ceil(min(MOST_CELLS, passed[-1] * (1.0 - 1e-9)))
        nodes: Vector = np.interp(np.linspace(0.0, passed[-1], count + 1), passed, fine)
        nodes[-1] = end
        return nodes[1:]

    pieces = [(0.0, patch)] if patch == radius else [(0.0, patch), (patch, radius)]
    rings = [graded(start, end, patch, np.array([radius]), min(coarsest)) for start, end in pieces]
    layers = [
        graded(start, end, 0.0, depths[1:], largest)
        for largest, (start, end) in zip(coarsest, pairwise(depths), strict=True)
    ]
    r, z = np.concatenate([[0.0], *rings]), np.concatenate([[0.0], *layers])
    if r.size * z.size > MOST_CELLS:
        raise ValueError(f"patch_radius, highest_frequency, cells: must make at most {MOST_CELLS} elements")
    return r, z
