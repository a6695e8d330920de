"""Mesh files as programs write them: what a file states is read, or refused with its line; formats give one body."""

from itertools import product
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from skfem import Basis

import hertzlink as hl
from structures.bodies.body_mesh import BodyMesh
from structures.meshes.mesh_files import FORMATS, gmsh_model, read_mesh

SIDE, CELLS = 0.02, 3
BRICK = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
LINE = np.arange(CELLS + 1) * SIDE / CELLS
POINTS = np.array(list(product(LINE, LINE, LINE)))
NUMBER = np.arange(len(POINTS)).reshape(3 * (CELLS + 1,))
BRICKS = np.array(
    [[NUMBER[tuple(np.add(first, corner))] for corner in BRICK] for first in product(range(CELLS), repeat=3)]
)
BASE = np.flatnonzero(POINTS[:, 2] == 0.0)
VOLUME, AREA, FACETS = SIDE**3, SIDE**2, CELLS**2


def volume(mesh: BodyMesh, cells: Any = None) -> float:
    return float(Basis(mesh.mesh, mesh.element(), intorder=4, elements=cells).dx.sum())


def measures(mesh: BodyMesh, name: Any) -> list[float]:
    """The volume of the body; the number and the area of the facets of a set."""
    facets = mesh.facets.of("fixed", name)
    return [volume(mesh), facets.size, mesh.area(facets)]


ORDINARY = pytest.approx([VOLUME, FACETS, AREA])


def cube() -> meshio.Mesh:
    """The cube with its base, as gmsh's physical groups number them."""
    quads = BRICKS[np.isclose(POINTS[BRICKS[:, 0], 2], 0.0)][:, :4]
    mesh = meshio.Mesh(POINTS, [("hexahedron", BRICKS), ("quad", quads)])
    mesh.cell_data = {"part": [np.full(len(BRICKS), 5), np.full(len(quads), 3)]}
    return mesh


def in_format(suffix: str, path: Path) -> Path:
    """The cube, written by meshio, or by gmsh from gmsh's own format."""
    mesh, file = cube(), path / f"cube{suffix}"
    if suffix in (".vtu", ".vtk", ".xdmf", ".xmf"):
        meshio.write(file, mesh, file_format={".xmf": "xdmf", ".vtk": "vtk42"}.get(suffix))
        return file
    numbers = mesh.cell_data.pop("part")
    mesh.cell_data = {"gmsh:physical": numbers, "gmsh:geometrical": numbers}
    meshio.write(path / "cube.msh", mesh, file_format="gmsh22", binary=False)
    if suffix != ".msh":
        gmsh = pytest.importorskip("gmsh")
        gmsh.initialize(readConfigFiles=False, interruptible=False)
        try:
            gmsh.option.setNumber("General.Terminal", 0.0)
            gmsh.merge(str(path / "cube.msh"))
            gmsh.write(str(file))
        finally:
            gmsh.finalize()
    return file


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_gives_the_same_body(suffix: str, tmp_path: Path) -> None:
    found = BodyMesh(in_format(suffix, tmp_path))
    base = next(tag for tag in (3, "3", "G_2D_3") if tag in found.facets.groups)
    assert measures(found, base) == pytest.approx([VOLUME, FACETS, AREA], rel=1e-4)
    assert [len(members) for tag, members in found.cells.groups.items() if tag in (5, "5", "G_3D_5")] == [len(BRICKS)]


@pytest.mark.parametrize("suffix", [*FORMATS, ".su2"])
def test_a_file_that_is_none(suffix: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """One line that names the file, and nothing printed; formats that the field does not use are not tried."""
    path = tmp_path / f"none{suffix}"
    path.write_bytes(b"\x00\x01 no mesh at all")
    with pytest.raises(ValueError, match=rf"^mesh = .*none\{suffix}'") as raised:
        read_mesh(path)
    assert "\n" not in str(raised.value)
    assert "Traceback" not in str(raised.value)
    assert capfd.readouterr() == ("", "")


def test_decks_of_abaqus_are_refused_with_the_way_out(tmp_path: Path) -> None:
    (tmp_path / "body.inp").write_text("*NODE\n1, 0., 0., 0.\n")
    with pytest.raises(ValueError, match=r"body\.inp': must be one of .* 'meshio convert body\.inp body\.msh'"):
        read_mesh(tmp_path / "body.inp")


def test_a_program_of_gmsh_is_not_run(tmp_path: Path) -> None:
    (tmp_path / "m.msh").write_text(f"SystemCall 'touch {tmp_path / 'gone'}';\n", encoding="utf-8")
    with pytest.raises(ValueError, match="file of gmsh, beginning with"):
        read_mesh(tmp_path / "m.msh")
    assert not (tmp_path / "gone").exists()


@pytest.mark.parametrize("all_cells", [1, 0])
def test_groups_of_msh_41(all_cells: int, tmp_path: Path) -> None:
    """A face turned over, a face in two groups, and cells of no group ("Save all")."""
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0.0)
        gmsh.model.occ.addBox(0, 0, 0, SIDE, SIDE, SIDE)
        gmsh.model.occ.synchronize()
        faces = dict(zip(("x", "", "y", "", "z"), [tag for _, tag in gmsh.model.getEntities(2)], strict=False))
        gmsh.model.addPhysicalGroup(3, [1], 1, "Körper 1")
        gmsh.model.addPhysicalGroup(2, [faces["z"], -faces["x"]], 7, "held")
        gmsh.model.addPhysicalGroup(2, [faces["x"]], 8, "side")
        gmsh.option.setNumber("Mesh.MeshSizeMin", SIDE)
        gmsh.model.mesh.generate(3)
        gmsh.option.setNumber("Mesh.SaveAll", all_cells)
        gmsh.write(str(tmp_path / "m.msh"))
    finally:
        gmsh.finalize()
    found = BodyMesh(tmp_path / "m.msh", scale=1.0)
    found_areas = [found.area(found.facets.of("fixed", name)) for name in ("held", 8)]
    assert [volume(found), *found_areas] == pytest.approx([VOLUME, 2.0 * AREA, AREA])
    assert volume(found, found.cells.of("material", "Körper 1")) == pytest.approx(VOLUME)


def test_groups_that_msh_22_loses(tmp_path: Path) -> None:
    """With SaveAll gmsh writes cells without a group, and their numbers of faces are not the user's groups."""
    pytest.importorskip("gmsh")
    with gmsh_model({"Mesh.SaveAll": 1.0, "Mesh.MshFileVersion": 2.2, "Mesh.MeshSizeMin": SIDE}) as gmsh:
        gmsh.model.occ.addBox(0, 0, 0, SIDE, SIDE, SIDE)
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(2, [5], 2, "base")
        gmsh.model.mesh.generate(3)
        gmsh.write(str(tmp_path / "m.msh"))
    for mesh in (tmp_path / "m.msh", meshio.read(tmp_path / "m.msh")):
        for tag in (2, "base"):
            with pytest.raises(ValueError, match="the mesh has no tags of this kind; gmsh wrote no physical groups"):
                BodyMesh(mesh, scale=1.0).facets.of("fixed", tag)


def test_models_of_the_users_own_stay() -> None:
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.model.add("mine")
        BodyMesh(Path(__file__).parent / "data" / "cylinder.msh")
        assert gmsh.isInitialized()
        assert (gmsh.model.getCurrent(), gmsh.model.list()[1:]) == ("mine", ["mine"])
    finally:
        gmsh.finalize()


def with_fields(**fields: Any) -> meshio.Mesh:
    return meshio.Mesh(POINTS, [("hexahedron", BRICKS)], cell_data={name: [field] for name, field in fields.items()})


ONES = np.ones(len(BRICKS), dtype=int)


@pytest.mark.parametrize(
    ("fields", "tags"),
    [
        ({"part": ONES}, None),
        ({"part": ONES[:, None]}, None),
        ({"part": ONES.astype(float)}, None),
        ({"part": ONES, "stress": ONES + 0.5}, None),
        ({"part": ONES, "temperature": 20.0 * ONES}, None),
        ({"part": ONES, "vtkOriginalCellIds": np.arange(len(BRICKS))}, "part"),
        ({"part": ONES.astype(float), "other": 2.0 * ONES}, "part"),
    ],
)
def test_numbers_of_cells(fields: Any, tags: str | None) -> None:
    mesh = with_fields(**fields)
    assert BodyMesh(mesh, tags=tags).cells.of("material", 1).size == len(BRICKS)
    if len(fields) > 1 and tags:
        with pytest.raises(ValueError, match=r"its cells are numbered by 'part', .*choose one by tags="):
            BodyMesh(mesh).cells.of("material", 1)
        with pytest.raises(ValueError, match=r"tags = 'prt': must be one of 'part'.*did you mean 'part'"):
            BodyMesh(mesh, tags="prt")


def two_cubes(gap: float, joined: list[int]) -> meshio.Mesh:
    """One on the other, with a gap, m; joined: the places, in the interface, of the points that are joined."""
    top, low = np.flatnonzero(POINTS[:, 2] == SIDE), BASE
    number = np.arange(len(POINTS)) + len(POINTS)
    number[low[joined]] = top[joined]
    points = np.concatenate([POINTS, POINTS + [0.0, 0.0, SIDE + gap]])
    return meshio.Mesh(points, [("hexahedron", np.concatenate([BRICKS, number[BRICKS]]))])


HALF = list(range(2 * (CELLS + 1)))


@pytest.mark.filterwarnings("ignore:.*belong to no cell")
@pytest.mark.parametrize(
    ("joined", "message"),
    [
        ([], r"2 parts .* and have no common point; 32 points coincide with others, .*: remove duplicate nodes"),
        ([0], r"2 parts of the body share no side of a cell and meet only at points or lines, near \(0, 0, 0\.02\) m"),
        (HALF[:4], "2 parts of the body share no side"),
    ],
)
def test_parts_that_are_not_joined(joined: list[int], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        BodyMesh(two_cubes(0.0, joined))


@pytest.mark.filterwarnings("ignore:.*belong to no cell")
def test_a_crack_is_warned_of() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="16 points coincide with others, .* are not joined: a crack"):
        assert volume(BodyMesh(two_cubes(0.0, HALF))) == pytest.approx(2.0 * VOLUME)


def test_cells_that_are_listed_twice() -> None:
    """MSH 2.2 lists the cells of a volume in two groups twice; they count once, with both tags."""
    twice = np.concatenate([BRICKS, BRICKS[::3, ::-1][:, [3, 2, 1, 0, 7, 6, 5, 4]]])
    mesh = meshio.Mesh(POINTS, [("hexahedron", twice)], cell_data={"part": [np.repeat([1, 2], [27, 9])]})
    with pytest.warns(hl.HertzlinkWarning, match="9 of 36 cells are duplicates"):
        found = BodyMesh(mesh)
    assert [found.cells.of("material", tag).size for tag in (1, 2)] == [27, 9]
    assert volume(found) == pytest.approx(VOLUME)


APEXES = 0.01 * np.array([[0.2, 0.2, 1.0], [0.3, 0.3, 0.8], [0.2, 0.2, -1.0]])


@pytest.mark.parametrize(
    ("apexes", "message"),
    [([0, 1, 2], "3 cells share a side near"), ([0, 1], "cells lie on the same side of a facet near")],
)
def test_cells_that_overlap(apexes: list[int], message: str) -> None:
    """Tetrahedra over one triangle."""
    points = np.concatenate([0.01 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), APEXES[apexes]])
    cells = [[0, 1, 2, 3 + i] if APEXES[apex, 2] > 0.0 else [0, 2, 1, 3 + i] for i, apex in enumerate(apexes)]
    with pytest.raises(ValueError, match=message):
        BodyMesh(meshio.Mesh(points, [("tetra", cells)]))


def test_groups_of_gmsh_that_meshio_read() -> None:
    """A face that is turned over has a negative number; cells of no group have 0."""
    mesh = cube()
    mesh.cell_data = {"gmsh:physical": [np.zeros(len(BRICKS), dtype=int), np.repeat([-7, 7], [4, 5])]}
    found = BodyMesh(mesh)
    assert measures(found, 7) == ORDINARY
    assert found.cells.groups == {}


@pytest.mark.parametrize("share", [1.02, 1.2])
def test_a_curved_cell_that_folds_at_a_corner(share: float) -> None:
    """A tetrahedron whose edge of length L has its midpoint at 3/4 L and beyond: the Jacobian at the far end is 0."""
    points = 0.01 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    middles = [points[[i, j]].mean(axis=0) for i, j in ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))]
    middles[0] = points[0] + 0.75 * share * (points[1] - points[0])
    mesh = meshio.Mesh(np.concatenate([points, middles]), [("tetra10", np.arange(10)[None])])
    with pytest.raises(ValueError, match=r"midpoints fold 1 cells, the first near \(0\.01, 0, 0\)"):
        BodyMesh(mesh)
    mesh.points[4, 0] = 0.0074
    assert volume(BodyMesh(mesh)) > 0.0


@pytest.mark.parametrize("kinds", [("wedge",), ("hexahedron", "wedge"), ("hexahedron", "tetra")])
def test_cells_of_other_types_and_of_several_are_refused(kinds: tuple[str, ...]) -> None:
    corners = {"wedge": 6, "hexahedron": 8, "tetra": 4}
    mesh = meshio.Mesh(POINTS, [(kind, BRICKS[:, : corners[kind]]) for kind in kinds])
    with pytest.raises(ValueError, match=r"mesh: has cells of type '.*; must have one type of 'tetra'"):
        BodyMesh(mesh)
