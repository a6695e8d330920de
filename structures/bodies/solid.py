"""Solids of any shape from a mesh file: three-dimensional linear elasticity with quadratic displacements."""

from collections.abc import Mapping
from dataclasses import asdict
from functools import partial
from itertools import combinations
from math import pi, sqrt
from typing import Annotated, Any

import numpy as np
from skfem import Basis, ElementVector, FacetBasis, LinearForm

from structures.bodies.body_mesh import BodyMesh
from structures.bodies.elastic_field import ElasticSampler
from structures.bodies.elasticity import body_matrices, shear_speed
from structures.caution import caution
from structures.checks import coordinates
from structures.described import described
from structures.field import Field
from structures.material import Material
from structures.meshes.mesh_files import source_of
from structures.meshes.mesh_reading import Tag
from structures.quantities import Asks, Component, Coordinate, Curvature, InFile, Length, Scale
from structures.structure import Structure, Vector
from structures.surface import Surface
from structures.units import readable

Point = tuple[Coordinate, Coordinate, Coordinate]

PATCH_RADIUS_PER_EDGE = 1.5  # The edges of facets under a patch must be shorter than its radius by this factor

LEAST_NORMAL_COSINE = 0.5  # A facet whose normal has a smaller cosine to the normal belongs to another side of the body


@described
def solid(
    mesh: Annotated[Any, InFile("a mesh", "body.msh")],
    material: Material | Mapping[Tag, Material],
    contact: Annotated[Point, Asks('the point that is struck, such as ["0 mm", "0 mm", "25 mm"]')],
    normal: tuple[Component, Component, Component] | None = None,
    fixed: Tag | None = None,
    patch_radius: Length | None = None,
    scale: Scale | None = None,
    curvature: Curvature = 0.0,
    tags: Annotated[str, Asks("the data of the mesh that number its cells")] | None = None,
) -> Structure:
    """A body of tetrahedra or hexahedra, struck at a point of its surface along the inward normal.

    Linear elasticity, quadratic displacements, consistent mass.

    Parameters
    ----------
    mesh : str, Path or meshio.Mesh
        A file (.msh of gmsh, .med, .vtu, .vtk, .xdmf) or a mesh; see docs/meshes.md.
    material : Material or mapping
        One material, or a mapping from tags of cells to materials. A tag is the name or the number of a physical group,
        or a value of the data that `tags` names.
    contact : sequence of float
        Contact point: three coordinates, m, at most a tenth of `patch_radius` away from the surface.
    normal : sequence of float, optional
        Outward normal at the contact; by default the normal of the surface.
    fixed : str or int, optional
        Tag of facets, or of a set of points, that are held in all directions; None leaves the body free.
    patch_radius : float, optional
        Radius a, m, of the circle on one face that carries the force with the pressure 2 (1 − r²/a²)/π a²; it must be
        wider than the contact. The default is the shortest side of the bounding box divided by 12. The displacement of
        the contact is the mean with the same weights, minus that of a half-space, which Hertz's law contains.
    scale : float, optional
        m per unit of the mesh. None means 1, and a mesh that is probably in millimetres is then refused.
    curvature : float
        Mean curvature of the surface at the contact for Hertz's law, 1/m: 1/R for a sphere.
    tags : str, optional
        Name of the cell data whose whole numbers are the tags, such as "part"; needed if the file has several.

    Returns
    -------
    Structure
        The body, with a field for displacements and stresses.

    Notes
    -----
    With 10 000 degrees of freedom, amplitude ratios agree with those of `layered_cylinder` within 0.03 % (steel) and
    0.1 % (PTFE).

    Examples
    --------
    >>> import numpy, skfem.io.meshio
    >>> line = numpy.linspace(0.0, 20e-3, 5)
    >>> mesh = skfem.io.meshio.to_meshio(skfem.MeshHex.init_tensor(line, line, line))
    >>> body = hl.solid(mesh, hl.ALUMINIUM_6061, contact=(10e-3, 10e-3, 20e-3), patch_radius=8e-3)
    >>> round(float(body.mass.sum()) / 3.0 * 1e3, 2)  # g; each of the three directions has the whole mass
    21.54
    """
    body = BodyMesh(mesh, scale, tags)
    materials, owner = body.materials(material)
    # This is a sixth of the radius of a long cylinder. Such a patch acts like the uniform pressure on an eighth of the
    # radius in `layered_cylinder`.
    radius = body.shortest_side / 12.0 if patch_radius is None else patch_radius
    place = np.array(coordinates("contact", contact, "xyz"))
    outward = None if normal is None else np.array(coordinates("normal", normal, "xyz"))
    patch = Patch(body, place, outward, radius)
    patch.check_curvature(curvature)
    basis = Basis(body.mesh, ElementVector(body.element()), intorder=body.order)
    mass, stiffness = body_matrices(basis, materials, owner)
    spread, held, support = patch.spread(body), np.zeros(0, dtype=int), {}
    if fixed is not None:
        facets = body.facets.of("fixed", fixed)
        held = basis.get_dofs(facets).all()
        support = {"fixed_facets": facets.size, "fixed_area": body.area(facets)}
        if np.any(spread[held] != 0.0):
            raise ValueError(f"fixed = {fixed!r}: must not hold part of the patch about the contact {patch.place} m")
    free = np.setdiff1d(np.arange(basis.N), held)
    origin = {
        "mesh": source_of(mesh),
        "material": None,
        "cells": body.mesh.nelements,
        "contact": list(patch.place),
        "normal": patch.normal.tolist(),
        **support,
        "patch_radius": radius,
        "scale": body.scale,
        "highest_frequency": min(map(shear_speed, materials)) / (4.0 * body.longest_edge),  # four edges per wavelength
        "materials": [asdict(material) for material in materials],
    }
    struck = materials[owner[patch.cell]]
    # The mean displacement of a half-space under the patch, weighted by the pressure: ∫ p̂(k)² dk · (1 − ν²)/πE from
    # k = 0, with the Hankel transform p̂ = 8 J₂(ka)/(ka)² of the pressure.
    half_space = 2048.0 / (315.0 * pi**2 * struck.contact_modulus * radius)
    return Structure(
        mass[free][:, free],
        stiffness[free][:, free],
        None,
        spread[free],
        -half_space,
        Surface(struck, curvature),
        origin,
        field=Field(partial(ElasticSampler, body.mesh, body.element, body.order, free, materials, owner), free.size),
    )


class Patch:
    """The circle that carries the force: the point of the surface nearest to the contact, and the facets around it."""

    def __init__(self, body: BodyMesh, contact: Vector, normal: Vector | None, radius: float) -> None:
        self.radius, facets = radius, body.mesh.boundary_facets()
        corners = body.mesh.p[:, body.mesh.facets[:, facets]].transpose(2, 1, 0)
        nearest, away = _nearest(corners, contact)
        facet = int(np.argmin(away))
        self.place, self.cell = tuple(map(float, nearest[facet])), int(body.mesh.f2t[0, facets[facet]])
        if away[facet] > 0.1 * radius:
            raise ValueError(f"contact = {_text(contact)} m: must lie on the surface, such as {_text(nearest[facet])}")

        faces = FacetBasis(body.mesh, body.element(), facets=facets, intorder=2)
        outward = np.asarray(faces.normals).mean(axis=2).T
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        near = away < radius
        surface = outward[near & (outward @ outward[facet] > LEAST_NORMAL_COSINE)].mean(axis=0)
        self.normal = surface = surface / np.linalg.norm(surface)
        if normal is not None:
            size = float(np.linalg.norm(normal))
            if normal @ surface < LEAST_NORMAL_COSINE * size or size == 0.0:
                raise ValueError(f"normal = {_text(normal)}: must point outward, as {_text(surface)} does")
            self.normal = normal / size
        near &= outward @ self.normal > LEAST_NORMAL_COSINE
        self.struck, self.corners = facets[near], np.unique(corners[near].reshape(-1, 3), axis=0)

        first, second = np.array(list(combinations(range(corners.shape[1]), 2))).T
        longest = np.linalg.norm(corners[near][:, first] - corners[near][:, second], axis=2).max()
        if corners.shape[1] == 4:  # diagonals count too
            longest /= sqrt(2.0)
        if longest > radius / PATCH_RADIUS_PER_EDGE:
            fine, wide = radius / PATCH_RADIUS_PER_EDGE, PATCH_RADIUS_PER_EDGE * longest
            raise ValueError(f"mesh: edges at the contact must be below {fine:.3g} m, or patch_radius above {wide:.3g}")

    def spread(self, body: BodyMesh) -> Vector:
        """Return b for all degrees of freedom, for the pressure 2 (1 − r²/a²)/π a² of a unit force, 1/m²."""
        faces = FacetBasis(body.mesh, ElementVector(body.element()), facets=self.struck, intorder=12)
        offset = np.asarray(faces.global_coordinates()) - np.array(self.place)[:, None, None]
        along = np.einsum("i,ifq->fq", self.normal, offset)
        square = ((offset**2).sum(axis=0) - along**2) / self.radius**2
        pressure = 2.0 / (pi * self.radius**2) * np.maximum(1.0 - square, 0.0)
        pressure *= np.einsum("i,ifq->fq", self.normal, np.asarray(faces.normals))
        total = float((pressure * faces.dx).sum())
        if abs(total - 1.0) > 0.02:  # facets are flat, and quadrature is not exact
            raise ValueError(
                f"patch_radius = {self.radius!r}: must fit on the face, which carries {total:.0%} of the patch"
            )
        x, y, z = self.normal
        return np.asarray(_push.assemble(faces, pressure=pressure / total, normal_x=x, normal_y=y, normal_z=z))

    def check_curvature(self, curvature: float) -> None:
        """Warn if the mesh has another mean curvature: that of a paraboloid through the corners at the contact."""
        offset = self.corners - np.array(self.place)
        along = offset @ self.normal
        x, y = (offset @ np.linalg.svd(self.normal[None])[2][1:].T).T / self.radius  # along two tangents
        columns = np.column_stack([-0.5 * (x**2 + y**2), x, y, np.ones_like(x), x * y, x**2 - y**2])
        # Few corners do not determine a saddle.
        columns = columns[:, : 6 if len(x) > 6 else 4]
        fitted = float(np.linalg.lstsq(columns, along, rcond=None)[0][0]) / self.radius**2
        mesh_curvature = round(fitted, 3) + 0.0  # no -0
        # A curvature of 5 1/m changes Hertz's force on a bead of radius 10 mm by 2.5 %.
        if abs(mesh_curvature - curvature) > max(5.0, 0.25 * abs(mesh_curvature), 0.25 * abs(curvature)):
            shapes = [f"radius {readable(1.0 / one, 'm')}" if one else "flat" for one in (curvature, mesh_curvature)]
            given, found = f"{curvature:.3g} 1/m ({shapes[0]})", f"{mesh_curvature:.3g} 1/m ({shapes[1]})"
            caution(f"solid curvature = {given}: the surface of the mesh has {found} at the contact; state that")


@LinearForm
def _push(v: Any, w: Any) -> Any:
    return -w.pressure * (w.normal_x * v[0] + w.normal_y * v[1] + w.normal_z * v[2])


def _nearest(corners: Vector, point: Vector) -> tuple[Vector, Vector]:
    """Return the nearest point of each facet, f × 3, and its distance, m; corners: f × 3 × 3 or f × 4 × 3."""
    nearest, distance = corners[:, 0].copy(), np.full(len(corners), np.inf)

    def offer(places: Vector, allowed: Any) -> None:
        away = np.where(allowed, np.linalg.norm(places - point, axis=1), np.inf)
        better = away < distance
        nearest[better], distance[better] = places[better], away[better]

    for i, j in combinations(range(corners.shape[1]), 2):
        start, edge = corners[:, i], corners[:, j] - corners[:, i]
        part = np.einsum("fi,fi->f", point - start, edge) / (edge**2).sum(axis=1)
        offer(start + np.clip(part, 0.0, 1.0)[:, None] * edge, True)
    for three in combinations(range(corners.shape[1]), 3):
        start, first, second = corners[:, three[0]], *(corners[:, i] - corners[:, three[0]] for i in three[1:])
        frame = np.stack([first, second, np.cross(first, second)], axis=2)
        u, v, _ = np.linalg.solve(frame, (point - start)[:, :, None])[:, :, 0].T
        offer(start + u[:, None] * first + v[:, None] * second, (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0))
    return nearest, distance


def _text(values: Vector) -> str:
    return f"({', '.join(f'{value:.4g}' for value in values)})"
