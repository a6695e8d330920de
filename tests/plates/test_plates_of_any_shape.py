"""Panels of any shape against Bessel's circles, one theory against the other, outlines against files; bad input."""

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from frequencies import parameters
from scipy.optimize import brentq
from scipy.special import ive, jv
from skfem import MeshQuad, MeshTri
from skfem.io.meshio import to_meshio

import hertzlink as hl
from plates.elements.mindlin import MindlinSpace
from structures.linear_algebra.factor import factorise

MATERIAL = hl.Material(1.0e9, 0.3, 1000.0)
NU = 0.3


def found(panel: hl.Plate, count: int, place: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """√(ω² ρt/D) of the lowest modes, 1/m²."""
    return parameters(panel.at(*place), count, panel.section.bending[0, 0] / panel.section.mass)


def circle_roots(edge: str, order: int, guess: float) -> float:
    """(kR)² of the mode with `order` nodal diameters whose kR lies within 0.4 of the guess.

    w = (A Jₙ(kr) + B Iₙ(kr)) cos nθ (Leissa, Vibration of Plates, NASA SP-160, chapter 2); I is scaled, by any factor.
    """

    def determinant(k: float) -> float:
        rows = []
        for shape, sign in ((jv, -1.0), (ive, 1.0)):
            value = shape(order, k)
            # I scaled by e^-k: its derivatives are those of I, scaled equally.
            before = shape(order - 1, k) if order else sign * shape(1, k)
            slope = before - order / k * value if order else before
            curvature = sign * value - slope / k + order**2 / k**2 * value
            turned = slope - order**2 * value / k
            if edge == "clamped":
                rows.append((value, slope))
            elif edge == "simple":
                rows.append((value, curvature + NU * (slope / k - order**2 / k**2 * value)))
            else:
                moment = curvature + NU * turned / k
                shear = sign * slope - (1.0 - NU) * order**2 / k**2 * (slope - value / k)
                rows.append((moment, shear))
        return float(rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0])

    return float(brentq(determinant, guess - 0.4, guess + 0.4)) ** 2


CIRCLES = {
    "clamped": [(0, 3.2), (1, 4.6), (1, 4.6), (2, 5.9), (2, 5.9), (0, 6.3)],
    "simple": [(0, 2.2), (1, 3.7), (1, 3.7), (2, 5.06), (2, 5.06), (0, 5.45)],
    "free": [(2, 2.3), (2, 2.3), (0, 3.0), (3, 3.5), (3, 3.5), (1, 4.5)],
}


def exact_circle(edge: str) -> list[float]:
    return [circle_roots(edge, order, guess) for order, guess in CIRCLES[edge]]


@pytest.mark.parametrize("edge", CIRCLES)
def test_circles(edge: str) -> None:
    """A polygon of 96 corners, at simple edges without Babuška's paradox: without `curve` 4.935 is 5.00."""
    pytest.importorskip("gmsh")
    outline, rigid = hl.Outline(hl.circle(1.0), edges="rim"), 3 if edge == "free" else 0
    panel = hl.mindlin_panel(outline, 0.005, MATERIAL, {"rim": edge}, highest_frequency=80.0)
    modes = found(panel, rigid + 6)
    assert modes[:rigid] == pytest.approx(np.zeros(rigid), abs=1e-3)
    assert modes[rigid:] == pytest.approx(exact_circle(edge), rel=2e-3)


def l_shape(edges: Any = ()) -> hl.Outline:
    return hl.Outline([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], edges=edges)


def grid(cells: int, turn: float = 0.0, quads: bool = False, edges: bool = True) -> meshio.Mesh:
    """The unit square as a file would hold it, sides named, turned about the origin, cells in mixed order."""
    nodes = np.linspace(0.0, 1.0, cells + 1)
    mesh = MeshQuad.init_tensor(nodes, nodes) if quads else MeshTri.init_tensor(nodes, nodes)
    lines, sets = [], {}
    x, y = mesh.p[:, mesh.facets].mean(axis=1)
    for name, on in (("left", x == 0.0), ("right", x == 1.0), ("bottom", y == 0.0), ("top", y == 1.0)):
        sets[name] = [np.zeros(0, dtype=int), np.arange(len(lines), len(lines) + on.sum())]
        lines += mesh.facets[:, on].T.tolist()
    cosine, sine = np.cos(turn), np.sin(turn)
    points = np.column_stack([(np.array([[cosine, -sine], [sine, cosine]]) @ mesh.p).T, np.zeros(mesh.p.shape[1])])
    corners = anticlockwise(points, mesh.t.T)
    # Each cell begins elsewhere, so that sides run both ways.
    corners = np.array([np.roll(cell, i) for i, cell in enumerate(corners)])
    cells_of = [("quad" if quads else "triangle", corners), ("line", np.array(lines))]
    return meshio.Mesh(points, cells_of, cell_sets=sets if edges else {})


def anticlockwise(points: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """scikit-fem sorts the corners of triangles; a file keeps their order."""
    one, other = (points[cells[:, i]] - points[cells[:, 0]] for i in (1, -1))
    clockwise = one[:, 0] * other[:, 1] < one[:, 1] * other[:, 0]
    return np.where(clockwise[:, None], cells[:, ::-1], cells)


SUPPORTS = {"left": "clamped", "bottom": "simple", "top": hl.ElasticEdge(3.0, 2.0)}


@pytest.mark.parametrize("turn", [0.4, 2.1])
def test_turning_the_model_changes_nothing(turn: float) -> None:
    """Oblique edges are held by turned slopes, not by penalties: to 1e-9, the patch's quadrature to 1e-6."""
    one = hl.mindlin_panel(grid(4), 0.02, MATERIAL, SUPPORTS)
    other = hl.mindlin_panel(grid(4, turn), 0.02, MATERIAL, SUPPORTS)
    place = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]]) @ [0.6, 0.45]
    assert found(other, 6, tuple(place)) == pytest.approx(found(one, 6, (0.6, 0.45)), rel=1e-9)
    answers = [s.contact @ factorise(s.stiffness)(s.contact) for s in (one.at(0.6, 0.45), other.at(*place))]
    assert answers[1] == pytest.approx(answers[0], rel=1e-6)


def test_points_of_two_coordinates_and_cells_of_both_turns() -> None:
    mesh, plane = grid(4), grid(4)
    mesh.points = mesh.points[:, :2]
    mesh.cells[0].data[:5] = mesh.cells[0].data[:5, ::-1]
    with pytest.warns(hl.HertzlinkWarning, match="5 of 32 cells are numbered clockwise"):
        panel = hl.mindlin_panel(mesh, 0.1, MATERIAL)
    assert found(panel, 3, (0.4, 0.4)) == pytest.approx(found(hl.mindlin_panel(plane, 0.1, MATERIAL), 3, (0.4, 0.4)))


def test_quadrilaterals_in_any_order() -> None:
    """Cells that begin at any corner fit together: as `mindlin_plate`."""
    panel = hl.mindlin_panel(grid(4, quads=True), 0.1, MATERIAL, {"left": "clamped", "top": "simple"})
    plate = hl.mindlin_plate(1.0, 1.0, 0.1, MATERIAL, hl.Supports(left="clamped", top="simple"), cells=(4, 4))
    assert found(panel, 5, (0.4, 0.4)) == pytest.approx(found(plate, 5, (0.4, 0.4)), rel=1e-9)


def test_outline_and_file(tmp_path: Path) -> None:
    """gmsh's mesh of an outline, written to a file and read again."""
    pytest.importorskip("gmsh")
    outline = l_shape(["a", "b", "c", "d", "e", "f"])
    panel = hl.mindlin_panel(outline, 0.05, MATERIAL, {"a": "clamped", "d": "simple"}, highest_frequency=50.0)
    mesh, edges = outline.mesh(0.5, 0.5, panel._cells)
    lines = np.concatenate([mesh.facets[:, on].T for on in edges.values()])
    numbers = np.repeat(np.arange(len(edges)) + 7, [on.size for on in edges.values()])
    data = {"gmsh:physical": [np.zeros(mesh.nelements, dtype=int), numbers]}
    names = {name: np.array([7 + i, 1]) for i, name in enumerate(edges)}
    points = np.column_stack([mesh.p.T, np.zeros(mesh.nvertices)])
    file = meshio.Mesh(
        1e3 * points, [("triangle", anticlockwise(points, mesh.t.T)), ("line", lines)], cell_data=data, field_data=names
    )
    path = tmp_path / "panel.vtu"
    file.write(path)
    # .vtu keeps the numbers; a meshio.Mesh the names.
    for source, tags in ((path, (7, 10)), (file, ("a", "d"))):
        held = {tags[0]: "clamped", tags[1]: "simple"}
        read = hl.mindlin_panel(source, 0.05, MATERIAL, held, highest_frequency=50.0, scale=1e-3)
        assert found(read, 4, (0.5, 0.5)) == pytest.approx(found(panel, 4, (0.5, 0.5)), rel=1e-9)


def test_additions() -> None:
    """Closed forms: a mass on a rigid free plate; a whole plate weakened; a bar that bends as its stiffener does."""
    free = hl.mindlin_panel(grid(2), 0.05, MATERIAL).at(0.5, 0.5)
    loaded = hl.mindlin_panel(grid(2), 0.05, MATERIAL, additions=[hl.PointMass(0.3, 0.6, 2.0)]).at(0.5, 0.5)
    lift = np.zeros(free.size)
    lift[0::3] = 1.0
    assert lift @ (loaded.mass - free.mass) @ lift == pytest.approx(2.0)
    held = dict.fromkeys(("left", "right", "bottom", "top"), "clamped")
    plain = found(hl.mindlin_panel(grid(4), 0.001, MATERIAL, held), 3, (0.5, 0.5))
    weak = hl.mindlin_panel(grid(4), 0.001, MATERIAL, held, additions=[hl.Weakened((0, 1, 0, 1), 0.25)])
    assert found(weak, 3, (0.5, 0.5)) == pytest.approx(0.5 * plain, rel=1e-3)


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_stiffener(turn: float) -> None:
    """Across the middle of a soft plate, aslant: the energy of w = (x·t)²/2 along it is EI/2 for each m, of xy GJ/2."""
    rotation = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    ends = [tuple(map(float, rotation @ end)) for end in ([0.05, 0.1], [0.85, 0.7])]
    rib = hl.Stiffener(ends[0], ends[1], 3.0, 5.0, 7.0)
    plain, ribbed = (hl.mindlin_panel(grid(3, turn), 0.05, MATERIAL, additions=rest) for rest in ([], [rib]))
    one, other = plain.at(*rotation @ [0.5, 0.5]), ribbed.at(*rotation @ [0.5, 0.5])
    along = rotation @ [0.8, 0.6]
    mesh = ribbed.shape.mesh(0.5, 0.5, ribbed._cells).mesh
    space = MindlinSpace(mesh, ribbed.section)
    nodes = np.asarray(mesh.mapping().F(space.functions.element.doflocs.T))
    places = np.zeros((space.functions.size, 2))
    places[space.functions.of_cells] = nodes.transpose(1, 2, 0)
    reach = places @ along
    bent, twisted, lifted = (np.zeros(one.size) for _ in range(3))
    bent[0::3] = reach**2 / 2.0
    bent[1::3], bent[2::3] = (reach[:, None] * along).T
    # Slopes that turn about the stiffener's axis as one goes along it.
    twisted[1::3], twisted[2::3] = (reach[:, None] * np.array([-along[1], along[0]])).T
    lifted[0::3] = 1.0
    extra = other.stiffness - one.stiffness
    assert bent @ extra @ bent == pytest.approx(3.0 * 1.0)
    assert twisted @ extra @ twisted == pytest.approx(5.0 * 1.0)
    assert lifted @ (other.mass - one.mass) @ lifted == pytest.approx(7.0 * 1.0)
    # Any motion: the line is integrated cell by cell.
    any_motion, part = np.random.default_rng(1).normal(size=one.size), (np.arange(20000) + 0.5) / 20000
    deflected = space.deflection(np.array(ends[0]) + part[:, None] * (np.array(ends[1]) - ends[0])) @ any_motion
    assert any_motion @ (other.mass - one.mass) @ any_motion == pytest.approx(7.0 * np.mean(deflected**2), rel=1e-5)


def test_field_of_a_cylinder_bend() -> None:
    """A strip between two clamped ends under a slow force: the grid's deflection is the contact's where it is struck,
    and the stress at the struck face 6 M/t² is a beam's, F L/8 in the middle and at the ends."""
    panel = hl.mindlin_panel(grid(16), 0.05, hl.Material(1.0e9, 0.0, 1000.0), {"left": "clamped", "right": "clamped"})
    structure = panel.at(0.5, 0.5)
    u = factorise(structure.stiffness)(structure.contact)
    field = structure.field
    assert field is not None
    place, moved, stress = field.grid.points, field.displacement(u), field.stress(u)
    middle = np.linalg.norm(place[:, :2] - 0.5, axis=1).argmin()
    assert moved[middle, 2] == pytest.approx(-structure.contact @ u, rel=0.05)
    assert np.all(moved[:, :2] == 0.0)
    assert np.ptp(field.grid.points[:, 2]) == 0.0
    # Pushed down in the middle, the struck face is stretched at the ends.
    ends = np.isclose(place[:, 0], 0.0)
    assert stress[ends, 0].mean() == pytest.approx(6.0 / 0.05**2 / 8.0, rel=0.15)
    assert field.grid.kind == "quad9"


FLAT = grid(2)


def changed(**changes: Any) -> meshio.Mesh:
    mesh = grid(2)
    points, cells = mesh.points.copy(), [(block.type, block.data.copy()) for block in mesh.cells]
    if "point" in changes:
        number, place = changes["point"]
        points[number] = place
    if "turned" in changes:
        cells[0][1][changes["turned"]] = cells[0][1][changes["turned"], ::-1]
    if "kind" in changes:
        cells = [(changes["kind"], np.array([[0, 1, 2, 3]]))]
        return meshio.Mesh(points, cells)
    if "lines" in changes:
        cells = cells[1:]
    if "mixed" in changes:
        cells.append(("quad", np.array([[0, 1, 4, 3]])))
    if "twice" in changes:
        cells[0] = (cells[0][0], np.concatenate([cells[0][1], cells[0][1][:1]]))
    return meshio.Mesh(points * changes.get("times", 1.0), cells)


@pytest.mark.parametrize(
    ("mesh", "message"),
    [
        (changed(times=1e3), r"in millimetres\? Give scale=1e-3"),
        (changed(point=(4, (2.0, 2.0, 0.0))), "cells lie on the same side of a facet"),
        (changed(point=(4, (0.5, 0.5, 0.1))), r"its box is 1 × 1 × 0\.1 m; must be flat, in the plane of x and y"),
        (changed(point=(4, (np.nan, 0.5, 0.0))), "must be finite"),
        (changed(kind="tetra"), "must have triangles or quadrilaterals, not 'tetra'; see solid"),
        (changed(lines=True), "must have triangles or quadrilaterals, not only lines"),
        ("no_such_file.msh", "there is no such file"),
        (3.0, "must be the path of a file, or a meshio.Mesh"),
    ],
)
def test_bad_meshes(mesh: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.mindlin_panel(mesh, 0.02, MATERIAL)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"thickness": 0.0}, r"thickness = 0\.0"),
        ({"thickness": 2.0}, r"thickness = 2\.0: must not exceed"),
        ({"supports": {"lft": "clamped"}}, r"supports = 'lft'.*'left'"),
        ({"supports": {"left": "glued"}}, r"supports\['left'\] = 'glued'"),
        ({"supports": "clamped"}, "supports = 'clamped': must be a dictionary"),
        ({"material": None}, "material = None"),
        ({"scale": 0.0}, r"scale = 0\.0"),
        ({"highest_frequency": np.nan}, "highest_frequency = nan"),
        ({"additions": [hl.Stiffener]}, "additions"),
        ({"additions": [hl.Weakened((0, 1, 0, 1), 0.5)] * 2}, r"additions\[1\] = .*must not overlap an earlier region"),
        ({"shape": hl.Outline([(0, 0), (1, 0), (0, 1)]), "scale": 1e-3}, "must be None for an Outline"),
        ({"shape": hl.Outline([(0, 0), (1, 0), (0, 1)]), "thickness": 3.0}, r"thickness = 3\.0: must not exceed"),
    ],
)
def test_bad_panels(changes: dict[str, Any], message: str) -> None:
    given: dict[str, Any] = {"shape": FLAT, "thickness": 0.02, "material": MATERIAL}
    with pytest.raises(ValueError, match=message):
        hl.mindlin_panel(**(given | changes)).at(0.5, 0.5)


@pytest.mark.parametrize(
    ("place", "radius", "message"),
    [
        ((1.2, 0.5), None, "must lie on the plate, not outside or in a hole"),
        ((np.nan, 0.5), None, "x = nan"),
        ((0.0, 0.5), None, "must not lie on a clamped edge"),
        ((0.5, 0.01), 0.02, "must be at most 0.01 m"),
        ((0.5, 0.5), 0.7, r"patch_radius = 0\.7: must lie between 0 and 0\.04 m"),
        ((0.5, 0.5), -1.0, "patch_radius = -1"),
    ],
)
def test_bad_contacts(place: tuple[float, float], radius: float | None, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.mindlin_panel(FLAT, 0.02, MATERIAL, {"left": "clamped"}, patch_radius=radius).at(*place)


def test_cells_too_large_for_the_patch(recwarn: pytest.WarningsRecorder) -> None:
    hl.mindlin_panel(FLAT, 0.3, MATERIAL).at(0.5, 0.5)
    assert not any("at the contact" in str(one.message) for one in recwarn)
    with pytest.warns(hl.HertzlinkWarning, match=r"cells of 707 mm at the contact are too large"):
        hl.mindlin_panel(FLAT, 0.1, MATERIAL).at(0.5, 0.5)


def test_a_round_edge_of_quadrilaterals_cannot_be_simple() -> None:
    """It would be clamped; a straight edge of the same half ring may be simple, and the rim clamped."""
    disc = to_meshio(MeshQuad.init_tensor(np.linspace(0.5, 1.0, 5), np.linspace(0.0, 2.0, 9)))
    r, angle = disc.points[:, 0].copy(), disc.points[:, 1].copy()
    disc.points = np.column_stack([r * np.cos(angle), r * np.sin(angle), 0.0 * r])
    disc.point_sets = {"rim": np.flatnonzero(np.isclose(r, 1.0)), "end": np.flatnonzero(angle == 0.0)}
    place = 0.75 * np.array([np.cos(1.0), np.sin(1.0)])
    for kind in ("simple", "soft simple"):
        with pytest.raises(ValueError, match=r"supports\['rim'\]: must be straight or of triangles"):
            hl.mindlin_panel(disc, 0.05, MATERIAL, {"rim": kind}).at(*place)
    assert hl.mindlin_panel(disc, 0.05, MATERIAL, {"rim": "clamped", "end": "simple"}).at(*place).size > 0


def test_triangles_and_quadrilaterals() -> None:
    """The left half of quadrilaterals, which are split: the same triangles as in the other half."""
    mesh = grid(2, quads=True)
    quads = mesh.cells[0].data
    left = mesh.points[quads].mean(axis=1)[:, 0] < 0.5
    halves = np.concatenate([quads[~left][:, three] for three in ([0, 1, 2], [0, 2, 3])])
    none = [[], [], []]
    sets = {name: [*none[:2], parts[1]] for name, parts in mesh.cell_sets.items()}
    mixed = meshio.Mesh(mesh.points, [("quad", quads[left]), ("triangle", halves), mesh.cells[1]], cell_sets=sets)
    with pytest.warns(hl.HertzlinkWarning, match="2 quadrilaterals are split, because the mesh has triangles as well"):
        panel = hl.mindlin_panel(mixed, 0.02, MATERIAL, {"left": "clamped"})
    assert panel.shape.area == pytest.approx(1.0)
    assert panel.at(0.5, 0.5).origin["cells"] == 8


@pytest.mark.thorough
def test_an_outline_of_a_thin_plate_against_the_rectangle() -> None:
    """1 mm of aluminium. Under beads of 4.76 mm AR is Kirchhoff's to 0.001. Under beads of 2.38 mm it is 0.431, that of
    Mindlin's rectangle, for 0.440 without shear."""
    pytest.importorskip("gmsh")
    sides, held = (0.16, 0.12), hl.Supports("clamped", "clamped", "clamped", "clamped")
    rim = hl.Outline([(0.0, 0.0), (sides[0], 0.0), sides, (0.0, sides[1])], edges="rim")
    panel = hl.mindlin_panel(rim, 1e-3, hl.ALUMINIUM_6061, {"rim": "clamped"})
    thin, thick = (make(*sides, 1e-3, hl.ALUMINIUM_6061, held) for make in (hl.kirchhoff_plate, hl.mindlin_plate))
    for radius, rectangle, within in ((2.38e-3, thin, 1e-3), (1.19e-3, thick, 5e-4)):
        bead = hl.Sphere(radius, hl.STEEL_440C)
        waves = []
        for plate in (panel, rectangle):
            body = hl.reduce(plate.at(0.06, 0.05), 5e-4)
            run = hl.CoSimulation(hl.Chain([bead] * 14, bead, 0.31), body).run(5e-4)
            waves.append(hl.reflections(run, 7).primary)
        found, wanted = waves
        assert found.amplitude_ratio == pytest.approx(wanted.amplitude_ratio, abs=within)
        assert found.time_of_flight == pytest.approx(wanted.time_of_flight, rel=1e-3)
