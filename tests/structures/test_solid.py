"""Solids from mesh files: exact fields, the axisymmetric cylinder, hexahedra, tags, formats, bad meshes."""

from itertools import permutations
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.typing import NDArray
from skfem import Basis, ElementVector
from test_elasticity import assert_same, weak_forms

import hertzlink as hl
from structures.bodies.body_mesh import BodyMesh
from structures.bodies.cylinder import layered_cylinder as cylinder
from structures.bodies.elasticity import body_matrices, first_lame_parameter, shear_modulus
from structures.bodies.solid import solid

CYLINDER = Path(__file__).parent / "data" / "cylinder.msh"
LAYER = {"length": 50.8e-3, "radius": 9.53e-3}
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
SIDE = 0.02
TOP = (SIDE / 2.0, SIDE / 2.0, SIDE)
STRUCK = (0.0, 0.0, LAYER["length"])
KINDS = ("tetra", "hexahedron")
WIDE = 9e-3
EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]

Array = NDArray[Any]


def box(kind: str = "tetra", cells: int = 5, bent: float = 0.0) -> meshio.Mesh:
    """A cube of 20 mm, of hexahedra or of six tetrahedra for each of these; inner points moved at random by `bent`.

    Its cell sets are "lower" and "upper" halves, "base" and "top"; and the points of its base are "held".
    """
    steps = np.arange(cells + 1) * SIDE / cells
    points = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange(len(points)).reshape(3 * (cells + 1,))
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cube = np.stack([number[x : x + cells, y : y + cells, z : z + cells].ravel() for x, y, z in corners], axis=1)
    base, top = (
        side[np.isclose(points[side, 2].min(axis=1), z)] for side, z in ((cube[:, :4], 0.0), (cube[:, 4:], SIDE))
    )
    volumes, faces = ("hexahedron", cube), ("quad", base, top)
    if kind == "tetra":
        paths = [np.cumsum(np.eye(3, dtype=int)[list(order)], axis=0) for order in permutations(range(3))]
        split = [[0, *(corners.index(tuple(step)) for step in path.tolist())] for path in paths]
        turned = [four if i in (0, 3, 4) else [four[j] for j in (0, 2, 1, 3)] for i, four in enumerate(split)]
        volumes = ("tetra", np.concatenate([cube[:, four] for four in turned]))
        faces = ("triangle", *(np.concatenate([side[:, [0, 1, 2]], side[:, [0, 2, 3]]]) for side in (base, top)))
    inner = ((points > 1e-9) & (points < SIDE - 1e-9)).all(axis=1)
    points[inner] += bent * SIDE / cells * np.random.default_rng(0).uniform(-1.0, 1.0, (inner.sum(), 3))
    low = points[volumes[1], 2].mean(axis=1) < SIDE / 2.0
    none = np.zeros(0, dtype=int)
    count = len(faces[1])
    sets = {
        "lower": [np.flatnonzero(low), none],
        "upper": [np.flatnonzero(~low), none],
        "base": [none, np.arange(count)],
        "top": [none, count + np.arange(count)],
    }
    blocks = [volumes, (faces[0], np.concatenate(faces[1:]))]
    return meshio.Mesh(points, blocks, cell_sets=sets, point_sets={"held": np.flatnonzero(points[:, 2] == 0.0)})


def rigid(mesh: meshio.Mesh) -> Array:
    """Unit translations along x, y, z and rotations about them, n × 6."""
    basis = vectors(mesh)
    place, along = basis.doflocs, np.arange(basis.N) % 3
    units = np.eye(3)
    turns = [np.cross(axis, place.T)[np.arange(basis.N), along] for axis in units]
    return np.stack([*(unit[along] for unit in units), *turns], axis=1)


def vectors(mesh: meshio.Mesh) -> Basis:
    body = BodyMesh(mesh)
    return Basis(body.mesh, ElementVector(body.element()), intorder=6)


@pytest.mark.parametrize("kind", KINDS)
def test_free_solid_moves_without_cost(kind: str) -> None:
    """Translations have the mass ρV, rotations no strain, and the patch reads a translation as it is."""
    mesh = box(kind, bent=0.1)
    free, modes = solid(mesh, hl.STEEL_440C, TOP, patch_radius=WIDE), rigid(mesh)
    mass = hl.STEEL_440C.density * SIDE**3
    assert modes[:, :3].T @ free.mass @ modes[:, :3] == pytest.approx(mass * np.eye(3), abs=1e-10 * mass)
    assert abs(free.stiffness @ modes).max() < 1e-11 * abs(free.stiffness.data).max()
    assert free.contact @ modes[:, :3] == pytest.approx([0.0, 0.0, -1.0], abs=1e-12)
    assert free.contact @ modes[:, 3:] == pytest.approx([-SIDE / 2.0, SIDE / 2.0, 0.0], rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_even_strain_is_exact(kind: str) -> None:
    """Patch test: u = A x leaves no force inside the body, and has the energy ½ V (λ tr² ε + 2μ ε:ε)."""
    mesh, material = box(kind, bent=0.1), hl.ACRYLIC
    free, basis = solid(mesh, material, TOP, patch_radius=WIDE), vectors(mesh)
    gradient = np.array([[1.0, 0.3, -0.2], [0.1, -0.5, 0.4], [0.6, 0.2, 0.7]])
    field = np.einsum("ij,jn->in", gradient, basis.doflocs)[np.arange(basis.N) % 3, np.arange(basis.N)]
    force = free.stiffness @ field
    strain = (gradient + gradient.T) / 2.0
    density = first_lame_parameter(material) * np.trace(strain) ** 2 + 2.0 * shear_modulus(material) * (strain**2).sum()
    inside = np.setdiff1d(np.arange(basis.N), basis.get_dofs().all())
    assert field @ force == pytest.approx(density * SIDE**3, rel=1e-10)
    assert abs(force[inside]).max() < 1e-10 * abs(force).max()


@pytest.mark.parametrize("kind", KINDS)
def test_matrices_are_those_of_the_weak_form(kind: str) -> None:
    body, materials = BodyMesh(box(kind, cells=2, bent=0.1)), [hl.STEEL_440C, hl.PTFE]
    owner = np.isin(np.arange(body.mesh.nelements), body.cells.groups["upper"]).astype(int)
    basis = Basis(body.mesh, ElementVector(body.element()), intorder=body.order)
    assert_same(body_matrices(basis, materials, owner), weak_forms(basis, materials, owner))


def ratios(structure: hl.Structure) -> list[float]:
    """Amplitude ratios at bead 7 of the primary wave, and of the secondary one where there is one."""
    chain = hl.Chain(
        [BEAD] * 20, striker=BEAD, impact_speed=hl.drop_speed(0.01), gravity=9.81, dissipation=hl.LinearDashpot(5.0)
    )
    run = hl.CoSimulation(chain, hl.reduce(structure, until=1.5e-3)).run(1.5e-3)
    waves = hl.reflections(run, sensor=7)
    assert waves.primary
    return [wave.amplitude_ratio for wave in (waves.primary, waves.secondary) if wave]


@pytest.mark.parametrize(("material", "tolerance"), [(hl.STEEL_440C, 5e-4), (hl.PTFE, 2e-3)], ids=["steel", "PTFE"])
@pytest.mark.thorough
def test_amplitude_ratio_is_that_of_the_axisymmetric_cylinder(material: hl.Material, tolerance: float) -> None:
    """A mesh written by gmsh, 10 728 degrees of freedom: to a few 1e-4; PTFE bears the structure's own waves."""
    found = ratios(solid(CYLINDER, material, STRUCK, fixed="base"))
    assert found == pytest.approx(ratios(cylinder([hl.Layer(material, **LAYER)])), rel=tolerance)


def changed(mesh: meshio.Mesh, data: Any = None, points: Any = None, **keywords: Any) -> meshio.Mesh:
    """The volume cells of a mesh, one of both replaced."""
    kind = mesh.cells[0].type
    return meshio.Mesh(
        mesh.points if points is None else points, [(kind, mesh.cells[0].data if data is None else data)], **keywords
    )


def hexahedra(kind: str) -> meshio.Mesh:
    """The cube's hexahedra with points in the middle of edges (20), of faces and of themselves (27)."""
    mesh = box("hexahedron")
    middles = [*EDGES, (0, 4, 7, 3), (1, 2, 6, 5), (0, 1, 5, 4), (3, 7, 6, 2), (0, 3, 2, 1), (4, 5, 6, 7), range(8)]
    points, cells = mesh.points, [mesh.cells[0].data]
    for corners in middles[: int(kind[-2:]) - 8]:
        cells.append(len(points) + np.arange(len(cells[0]))[:, None])
        points = np.concatenate([points, mesh.points[mesh.cells[0].data[:, list(corners)]].mean(axis=1)])
    points, number = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    return meshio.Mesh(points, [(kind, number[np.concatenate(cells, axis=1)])])


@pytest.mark.parametrize("kind", ["hexahedron20", "hexahedron27"])
def test_hexahedra_with_midpoints(kind: str, recwarn: pytest.WarningsRecorder) -> None:
    free = [solid(mesh, hl.MATERIALS["nylon"], TOP, patch_radius=WIDE) for mesh in (hexahedra(kind), box("hexahedron"))]
    assert free[0].stiffness.trace() == pytest.approx(free[1].stiffness.trace(), rel=1e-9)
    dropped = [one for one in recwarn if "midpoints of hexahedron20 are dropped" in str(one.message)]
    assert bool(dropped) == (kind == "hexahedron20")


def test_round_faces_can_be_struck() -> None:
    """A cap of radius 30 mm, in flat facets: the normal is their mean; a millimetre off the surface is refused."""
    mesh = box("hexahedron", cells=6)
    x, y, _ = mesh.points.T
    mesh.points[:, 2] *= 1.0 - ((x - TOP[0]) ** 2 + (y - TOP[1]) ** 2) / (2.0 * 0.03 * SIDE)
    cap = solid(mesh, hl.MATERIALS["nylon"], TOP, fixed="base", patch_radius=WIDE, curvature=1.0 / 0.03)
    assert cap.origin["normal"] == pytest.approx([0.0, 0.0, 1.0], abs=1e-9)
    free = solid(mesh, hl.MATERIALS["nylon"], (*TOP[:2], SIDE + 5e-4), patch_radius=WIDE)
    assert free.origin["contact"] == pytest.approx(TOP)
    assert free.contact @ rigid(mesh)[:, 2] == pytest.approx(-1.0)
    with pytest.raises(ValueError, match=r"must lie on the surface, such as"):
        solid(mesh, hl.MATERIALS["nylon"], (*TOP[:2], SIDE + 1e-3), patch_radius=WIDE)


@pytest.mark.parametrize(
    ("bent", "given", "told"),
    [
        ((1.0, 1.0), 0.0, "33.3"), ((1.0, 1.0), -1.0 / 0.03, "33.3"), ((1.0, 1.0), 1.0 / 0.03, None),
        ((1.0, 0.0), 0.0, "16.7"), ((1.0, 0.0), 0.5 / 0.03, None), ((-1.0, -1.0), 1.0, "-33.3"),
        ((1.0, -1.0), 0.0, None), ((0.0, 0.0), 0.0, None), ((0.5, 0.5), 1.0, "16.7"), ((0.0, 0.0), 4.9, None),
        ((1.0, 1.0), 27.0, None),
    ],
)  # fmt: skip
def test_the_curvature_of_the_mesh_is_told_where_another_is_given(
    bent: tuple[float, float], given: float, told: str | None, recwarn: pytest.WarningsRecorder
) -> None:
    """Paraboloids z = −(p x² + q y²)/2R with R = 30 mm have the mean curvature (p + q)/2R."""
    mesh = box("hexahedron", cells=6)
    x, y, _ = mesh.points.T
    mesh.points[:, 2] *= 1.0 - (bent[0] * (x - TOP[0]) ** 2 + bent[1] * (y - TOP[1]) ** 2) / (2.0 * 0.03 * SIDE)
    solid(mesh, hl.MATERIALS["nylon"], TOP, patch_radius=WIDE, curvature=given)
    found = [str(one.message) for one in recwarn if "curvature" in str(one.message)]
    assert len(found) == (told is not None)
    assert all(
        f"solid curvature = {given:.3g} 1/m (" in one and f"): the surface of the mesh has {told} 1/m (" in one
        for one in found
    )


def test_one_number_may_be_a_solid_and_a_face() -> None:
    """gmsh numbers groups from 1 in each dimension; a name belongs to one dimension."""
    mesh = box()
    mesh.cell_sets = {}
    mesh.cell_data["gmsh:physical"] = [np.ones(750, dtype=int), np.repeat([1, 2], 50)]
    mesh.field_data = {"body": np.array([1, 3]), "base": np.array([1, 2]), "top": np.array([2, 2])}
    found = solid(mesh, {"body": hl.MATERIALS["nylon"]}, TOP, fixed="base", patch_radius=WIDE)
    assert found.size == solid(box(), hl.MATERIALS["nylon"], TOP, fixed="base", patch_radius=WIDE).size
    with pytest.raises(ValueError, match="fixed = 'body': must be one of 1, 2, 'base', 'top', 'held'"):
        solid(mesh, hl.MATERIALS["nylon"], TOP, fixed="body", patch_radius=WIDE)
    with pytest.raises(ValueError, match="material = 'base': must be one of 1, 'body'"):
        solid(mesh, {"base": hl.MATERIALS["nylon"]}, TOP, patch_radius=WIDE)


TETRA, HEXA = box(), box("hexahedron")
FIRST, POINTS = TETRA.cells[0].data, TETRA.points


def turned_first() -> Array:
    cells = FIRST.copy()
    cells[0] = cells[0, [0, 2, 1, 3]]
    return cells


def flattened_first() -> Array:
    cells = FIRST.copy()
    cells[0, 3] = cells[0, 2]
    return cells


def twice() -> meshio.Mesh:
    return changed(TETRA, np.concatenate([FIRST, FIRST + len(POINTS)]), np.concatenate([POINTS, POINTS + [0, 0, SIDE]]))


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (3, "mesh = 3: must be the path of a file, or a meshio.Mesh"),
        ("nowhere.msh", "mesh = 'nowhere.msh': there is no such file"),
        (Path(__file__), r"must be one of \.msh, .*; convert others by 'meshio convert"),
        (changed(TETRA, turned_first()), r"1 of 750 cells are inverted \(negative Jacobian\), the first near \("),
        (changed(TETRA, flattened_first()), "1 of 750 cells are flat or folded"),
        (changed(HEXA, HEXA.cells[0].data[:, [0, 2, 1, 3, 4, 5, 6, 7]]), "125 of 125 cells are flat or folded"),
        (changed(TETRA, points=1e3 * POINTS), r"box is 20 × 20 × 20 m.*in millimetres\? Give scale=1e-3"),
        (changed(TETRA, points=10.0 * POINTS), "its shortest edge 0.04 m: in millimetres"),
        (changed(TETRA, points=POINTS[:, :2]), r"points have shape \(216, 2\); must be finite, with three coordinates"),
        (changed(TETRA, points=np.where(POINTS == SIDE, np.nan, POINTS)), "must be finite"),
        (changed(TETRA, FIRST + 1), "has a cell with point 216, but only 216 points"),
        (meshio.Mesh(POINTS, [TETRA.cells[1]]), "has no solid cells .*; must have one type of 'tetra'"),
        (meshio.Mesh(POINTS, [("tetra20", FIRST[:, [0] * 20])]), "cells of type 'tetra20'; must have one type"),
        (twice(), "2 parts of the body share no side of a cell and have no common point"),
    ],
)
def test_bad_meshes(mesh: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        solid(mesh, hl.MATERIALS["nylon"], TOP, patch_radius=WIDE)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"material": "nylon"}, "material = 'nylon': must be a Material, or a dictionary"),
        ({"material": {"lower": hl.MATERIALS["nylon"]}}, "material: 400 of 750 cells have no material; their tags"),
        ({"material": {"lower": hl.MATERIALS["nylon"], "uper": hl.MATERIALS["nylon"]}}, "material = 'uper': .*did you"),
        ({"material": {"lower": hl.MATERIALS["nylon"], 7: hl.MATERIALS["nylon"]}}, "material = 7: must be one of"),
        ({"material": {"lower": "steel"}}, r"material\['lower'\] = 'steel': must be a Material"),
        ({"material": {}}, "material: 750 of 750 cells have no material"),
        ({"fixed": "bas"}, "fixed = 'bas': must be one of .*did you mean 'base'"),
        ({"fixed": 3}, "fixed = 3: must be one of 'base', 'top', 'held'"),
        ({"fixed": "top"}, r"fixed = 'top': must not hold part of the patch about the contact"),
        ({"contact": (0.01, 0.01, 0.03)}, r"must lie on the surface, such as \(0.01, 0.01, 0.02\)"),
        ({"contact": (0.01, 0.01, 0.01)}, "must lie on the surface"),
        ({"contact": (0.01, 0.01)}, r"must be \(x, y, z\)"),
        ({"contact": (0.01, 0.01, float("nan"))}, r"contact\[2\] = nan: must be a finite number"),
        ({"contact": (0.005, 0.01, SIDE)}, "must fit on the face, which carries 9.% of the patch"),
        ({"contact": (SIDE, SIDE, SIDE)}, "% of the patch"),
        ({"normal": (0.0, 0.0, -1.0)}, r"normal = \(0, 0, -1\): must point outward, as \("),
        ({"normal": (0.0, 0.0, 0.0)}, "normal = .*must point outward"),
        ({"normal": (0.0, 1.0)}, r"normal = .*must be \(x, y, z\)"),
        ({"patch_radius": None}, "edges at the contact .* 0.00111 m, or .* 0.00849"),
        ({"patch_radius": 0.0}, r"patch_radius = 0\.0"),
        ({"patch_radius": 0.1}, "patch_radius = 0.1: must fit on the face"),
        ({"scale": 0.0}, r"scale = 0\.0"),
        ({"curvature": float("inf")}, "curvature = inf"),
    ],
)
def test_bad_solids(keywords: dict[str, Any], message: str) -> None:
    given = {"material": hl.MATERIALS["nylon"], "contact": TOP, "patch_radius": WIDE, **keywords}
    with pytest.raises(ValueError, match=message):
        solid(TETRA, **given)
