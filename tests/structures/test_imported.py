"""Structures from other programs: matrices of CalculiX, Abaqus, Ansys and Nastran, and what damaged files do."""

import shutil
import subprocess
from itertools import permutations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from scipy import sparse
from scipy.linalg import eigh

import hertzlink as hl

DATA = Path(__file__).parent / "data" / "calculix"
ONE_CELL = str(DATA / "one_cell.mas"), str(DATA / "one_cell.sti")
FREQUENCIES = [11826.21, 15439.35]
"""Hz, that CalculiX finds itself for the same cell."""

CANTILEVER = """
-1,1, -1,1,  3.333333333333317e+01
-1,2, -1,1, -8.333333333333492e+00
1,1, -1,1,  2.500000000000002e+01
2,1, -1,1, -2.500000000000002e+01
-1,2, -1,2,  3.333333333333316e+01
1,1, -1,2,  2.500000000000003e+01
2,1, -1,2, -2.500000000000003e+01
1,1, 1,1,  1.000000000000000e+36
2,1, 1,1, -3.000000000000020e+02
1,2, 1,2,  1.000000000000000e+36
1,6, 1,2,  5.999999999999996e+00
2,2, 1,2, -1.199999999999999e+01
2,6, 1,2,  5.999999999999996e+00
1,3, 1,3,  1.000000000000000e+36
1,5, 1,3, -8.999999999999996e+00
2,3, 1,3, -1.799999999999999e+01
2,5, 1,3, -8.999999999999996e+00
1,4, 1,4,  1.000000000000000e+36
2,4, 1,4, -2.400000000000012e-01
1,5, 1,5,  1.000000000000000e+36
2,3, 1,5,  8.999999999999996e+00
2,5, 1,5,  2.999999999999990e+00
1,6, 1,6,  1.000000000000000e+36
2,2, 1,6, -5.999999999999996e+00
2,6, 1,6,  1.999999999999993e+00
2,1, 2,1,  3.000000000000020e+02
2,2, 2,2,  1.199999999999999e+01
2,6, 2,2, -5.999999999999996e+00
2,3, 2,3,  1.799999999999999e+01
2,5, 2,3,  8.999999999999996e+00
2,4, 2,4,  2.400000000000012e-01
2,5, 2,5,  6.000000000000006e+00
2,6, 2,6,  4.000000000000004e+00
"""
"""A beam of length 1 with EI 1.5 about y, held at node 1, as Abaqus wrote it (JuliaFEM's FEMBeam.jl, MIT license)."""


def frequencies(structure: hl.Structure) -> Any:
    square = eigh(structure.stiffness.toarray(), structure.mass.toarray(), eigvals_only=True)
    return np.sqrt(square) / (2.0 * np.pi)


def static(structure: hl.Structure) -> float:
    b = structure.contact
    return float(b @ np.linalg.solve(structure.stiffness.toarray(), b)) + structure.flexibility


def test_calculix_finds_the_same_frequencies() -> None:
    cell = hl.from_matrices(*ONE_CELL, hl.ALUMINIUM_6061, node=7, residual_flexibility=0.0)
    np.testing.assert_allclose(frequencies(cell)[:2], FREQUENCIES, rtol=1e-6)
    # One of eight nodes is held in x; of m, it has m/27 alone, and m/8 with the others.
    assert cell.origin["moving_mass"] == pytest.approx(2700.0 * 0.02**3 * (1.0 - 2.0 / 8.0 + 1.0 / 27.0), rel=1e-9)


def test_millimetres_and_tonnes_change_nothing() -> None:
    cell = hl.from_matrices(*ONE_CELL, hl.ALUMINIUM_6061, node=7, residual_flexibility=0.0)
    # In t, mm, N and s mass and stiffness have a thousandth of their numbers in SI units.
    scaled = [1e-3 * matrix for matrix in (cell.mass, cell.stiffness)]
    small = hl.from_matrices(*scaled, hl.ALUMINIUM_6061, contact=cell.contact, scale=1e-3)
    np.testing.assert_allclose(frequencies(small), frequencies(cell), rtol=1e-12)
    assert static(small) == pytest.approx(static(cell), rel=1e-9)


def test_a_beam_of_abaqus_deflects_as_beams_do(tmp_path: Path) -> None:
    stiffness, mass = tmp_path / "beam_STIF1.mtx", tmp_path / "beam_MASS1.mtx"
    stiffness.write_text(CANTILEVER)
    mass.write_text("".join(f"2,{axis}, 2,{axis}, {0.25}\n" for axis in range(1, 7)))
    beam = hl.from_matrices(mass, stiffness, hl.STEEL_316, node=2, residual_flexibility=0.0)
    assert beam.size == 8  # six of the tip, two inside
    assert static(beam) == pytest.approx(1.0 / (3.0 * 1.5), rel=1e-12)  # L³/3EI
    with pytest.raises(ValueError, match="node = 1: is none of the 2 nodes that move"):
        hl.from_matrices(mass, stiffness, hl.STEEL_316, node=1)


def test_matrix_market_holds_what_scipy_wrote(tmp_path: Path) -> None:
    rod = hl.rod([hl.Layer(hl.STEEL_316, length=0.1, radius=0.01)], elements=4)
    paths = [tmp_path / "mass.mtx", tmp_path / "stiffness.mtx", tmp_path / "damping.mtx"]
    for path, matrix in zip(paths, (rod.mass, rod.stiffness, 1e-7 * rod.stiffness), strict=True):
        scipy.io.mmwrite(path, sparse.coo_matrix(matrix), symmetry="symmetric", precision=17)
    np.savetxt(tmp_path / "contact.csv", rod.contact, header="force on each row")
    read = hl.from_matrices(*paths[:2], hl.STEEL_316, contact=tmp_path / "contact.csv", damping=paths[2])
    for name in ("mass", "stiffness"):
        np.testing.assert_allclose(getattr(read, name).toarray(), getattr(rod, name).toarray(), rtol=1e-14)
    np.testing.assert_allclose(read.damping.toarray(), 1e-7 * rod.stiffness.toarray(), rtol=1e-15)
    np.testing.assert_array_equal(read.contact, rod.contact)


def test_forces_on_several_nodes_and_several_contacts(tmp_path: Path) -> None:
    (tmp_path / "patch.csv").write_text("node, weight\n7, 0.75\n8, 0.25\n")
    top = {"direction": (0.0, 0.0, -2.0), "residual_flexibility": 0.0}
    both = hl.from_matrices(*ONE_CELL, hl.ALUMINIUM_6061, node=[7, 8], **top)
    spread = hl.from_matrices(*ONE_CELL, hl.ALUMINIUM_6061, contact=tmp_path / "patch.csv", **top)
    assert both.contacts == 2
    np.testing.assert_allclose(spread.contact, both.contact @ [0.75, 0.25])
    assert set(both.contact.ravel()) == {0.0, -1.0}


def test_a_point_force_on_a_solid_is_warned_of() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="a point force indents a solid the more the finer its mesh is"):
        hl.from_matrices(*ONE_CELL, hl.ALUMINIUM_6061, node=7)


def write_box(path: Path, cells: tuple[int, int, int], sides: tuple[float, float, float]) -> None:
    """Write a box of C3D10, six to each cell, and the step that stores its matrices."""
    shape = tuple(2 * count + 1 for count in cells)
    number = np.arange(np.prod(shape)).reshape(shape) + 1
    lines = [np.linspace(0.0, side, count) for side, count in zip(sides, shape, strict=True)]
    places = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
    edges, corners = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)], []
    for origin in np.ndindex(*cells):
        for order in permutations(np.eye(3, dtype=int)):
            four = 2 * (np.array(origin) + np.cumsum([np.zeros(3, dtype=int), *order], axis=0))
            turned = np.linalg.det(four[1:] - four[0]) < 0.0
            corners.append(four[[0, 2, 1, 3]] if turned else four)
    nodes = [number[tuple(np.array([*four, *((four[i] + four[j]) // 2 for i, j in edges)]).T)] for four in corners]
    metal = hl.ALUMINIUM_6061
    rows = ["*NODE, NSET=ALL", *(f"{n}, {x:.9g}, {y:.9g}, {z:.9g}" for n, (x, y, z) in enumerate(places, 1))]
    rows += ["*ELEMENT, TYPE=C3D10, ELSET=BODY", *(", ".join(map(str, (i, *ten))) for i, ten in enumerate(nodes, 1))]
    rows += ["*MATERIAL, NAME=METAL", "*ELASTIC", f"{metal.youngs_modulus!r}, {metal.poisson_ratio!r}", "*DENSITY"]
    rows += [f"{metal.density!r}", "*SOLID SECTION, ELSET=BODY, MATERIAL=METAL"]
    rows += ["*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "*END STEP", ""]
    path.write_text("\n".join(rows))


@pytest.mark.thorough
@pytest.mark.skipif(shutil.which("ccx") is None, reason="needs CalculiX")
@pytest.mark.parametrize(
    ("cells", "sides", "radius"), [((8, 8, 8), (0.04, 0.04, 0.04), 0.011), ((20, 20, 1), (0.1, 0.1, 0.008), 0.012)]
)
def test_a_block_and_a_plate_of_calculix_reflect_as_those_meshed_here(
    tmp_path: Path, cells: tuple[int, int, int], sides: tuple[float, float, float], radius: float
) -> None:
    write_box(tmp_path / "body.inp", cells, sides)
    subprocess.run(["ccx", "body"], cwd=tmp_path, check=True, capture_output=True)
    mesh, point = tmp_path / "body.inp", (sides[0] / 2.0, sides[1] / 2.0, sides[2])
    struck = {"patch_radius": radius}
    theirs = hl.from_matrices(
        tmp_path / "body.mas", tmp_path / "body.sti", hl.ALUMINIUM_6061, mesh=mesh, point=point, **struck
    )
    ours = hl.solid(mesh, hl.ALUMINIUM_6061, contact=point, **struck)
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 12, striker=bead, impact_speed=0.02)
    ratios = []
    for body in (theirs, ours):
        run = hl.CoSimulation(chain, hl.reduce(body, 9e-4)).run(until=9e-4)
        ratios.append(float(hl.reflections(run, sensor=5).primary.amplitude_ratio))
    assert ratios[0] == pytest.approx(ratios[1], rel=1e-6)


@pytest.mark.thorough
def test_ansys_file_of_its_reader() -> None:
    examples = pytest.importorskip("ansys.mapdl.reader.examples")
    file = examples.fullfile
    beam = hl.from_matrices(file, file, hl.STEEL_316, node=41, residual_flexibility=0.0)
    # The reader's manual finds these, Hz.
    np.testing.assert_allclose(frequencies(beam)[:4], [1283.200, 1283.200, 5781.975, 6919.399], rtol=1e-6)


def test_punched_matrices_of_nastran(tmp_path: Path) -> None:
    pytest.importorskip("pyNastran")
    lines = []
    for name, numbers in (("KAAX", (2.0e6, -2.0e6, 5.0e6)), ("MAAX", (0.02, 0.0, 0.05))):
        lines.append(f"{'DMIG':<8}{name:<8}{0:>8}{6:>8}{2:>8}{0:>8}")
        entries = [(11, 11, numbers[0]), (11, 12, numbers[1]), (12, 12, numbers[2])]
        for column in (11, 12):
            lines.append(f"{'DMIG*':<8}{name:<16}{column:>16}{3:>16}")
            lines += [f"{'*':<8}{row:>16}{3:>16}{value:>16.9E}" for row, c, value in entries if c == column and value]
    file = tmp_path / "model.pch"
    file.write_text("\n".join(lines) + "\n")
    pair = hl.from_matrices(file, file, hl.STEEL_316, node=12, residual_flexibility=0.0)
    # Two masses, the first one's spring to the second, and the second one's to the ground: 3e6 N/m.
    assert static(pair) == pytest.approx(1.0 / 3.0e6, rel=1e-9)


def test_output4_of_nastran(tmp_path: Path) -> None:
    """By the layout of the Quick Reference Guide. Files of pyyeti, in text and binary, are read exactly as well."""
    pytest.importorskip("pyNastran")
    lines, file = list[str](), tmp_path / "model.op4"
    for name, matrix in (("KAA", [[2.0e6, -2.0e6], [-2.0e6, 5.0e6]]), ("MAA", [[0.02, 0.0], [0.0, 0.05]])):
        lines.append(f"{2:8d}{2:8d}{6:8d}{2:8d}{name:8s}1P,3E23.16")
        for column, numbers in enumerate(matrix, 1):
            lines += [f"{column:8d}{1:8d}{2:8d}", "".join(f"{x:23.16E}" for x in numbers)]
        lines += [f"{3:8d}{1:8d}{1:8d}", f"{1.0:23.16E}"]
    file.write_text("\n".join(lines) + "\n")
    pair = hl.from_matrices(file, file, hl.STEEL_316, contact=[0.0, 1.0])
    assert static(pair) == pytest.approx(1.0 / 3.0e6, rel=1e-9)
    assert pair.mass.diagonal().tolist() == [0.02, 0.05]


def test_a_library_that_does_not_work_with_this_numpy(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "pyNastran" / "op4").mkdir(parents=True)
    (tmp_path / "pyNastran" / "op4" / "op4.py").write_text("import numpy\nnumpy.a_name_that_was_removed\n")
    (tmp_path / "model.op4").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(
        ValueError, match=r"pyNastran does not work with a numpy as new.*install hertzlink\[nastran\] in an environment"
    ):
        hl.from_matrices([[1.0]], tmp_path / "model.op4", hl.PTFE, contact=[1.0])


def test_rows_of_the_same_node_share_a_force(tmp_path: Path) -> None:
    (tmp_path / "shell.sti").write_text("1 1 2e6\n2 2 2e6\n3 3 4e6\n")
    (tmp_path / "shell.dof").write_text("5.3\n5.3\n6.3\n")  # CalculiX expands node 5 of a shell to two
    shell = hl.from_matrices(np.eye(3), tmp_path / "shell.sti", hl.STEEL_316, node=5)
    np.testing.assert_array_equal(shell.contact, [0.5, 0.5, 0.0])
    for damaged in (b"", b"5.3\n", b"5.3.1\n" * 3, b"9" * 40 + b".1\n"):
        (tmp_path / "shell.dof").write_bytes(damaged)
        with pytest.raises(ValueError, match="must have 3 lines node"):
            hl.from_matrices(np.eye(3), tmp_path / "shell.sti", hl.STEEL_316, node=5)


BAD_FILES = [
    ("a.mtx", b"", "holds no line of numbers"),
    ("a.mtx", b"\x00\xff" * 40, "holds no line of numbers"),
    ("a.sti", b"1 1 2.0\n1 2 x\n", "could not convert string 'x'"),
    ("a.sti", b"1 1 2.0\n1 2\n", "columns changed from 3 to 2"),
    ("a.sti", b"1 1 2.0 7\n", "has 4 columns of numbers: must have 3 or 5"),
    ("a.sti", b"0 0 2.0\n", "rows are counted from 1"),
    ("a.sti", b"1.5 1 2.0\n", "must be whole"),
    ("a.sti", b"1e300 1 2.0\n", "must be whole"),
    ("a.sti", b"1 1 nan\n", "must hold finite numbers"),
    ("a.sti", b"1 900000000000 1.0\n", "has 900000000000 rows; at most 2000000 fit"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate real general\n9 9 4000000000\n1 1 1\n", "more than it can hold"),
    ("a.mtx", b"%%MatrixMarket matrix array real general\n100000 100000\n1\n", "more than it can hold"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n", "holds a complex matrix"),
    ("a.mtx", b"%%MatrixMarket nonsense\n", "is no Matrix Market file"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 -1E", "is no Matrix Market file that can be"),
    ("a.op4", b"\x00" * 9, "cannot be read as a .op4 file of Nastran|needs pyNastran"),
    ("a.docx", b"PK", "must be one of .mtx"),
]


@pytest.mark.parametrize(("name", "content", "message"), BAD_FILES)
def test_bad_files_are_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(ValueError, match=message) as caught:
        hl.from_matrices([[1.0]], path, hl.PTFE, contact=[1.0])
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith("stiffness")


def test_what_does_not_fit_is_refused() -> None:
    mass, stiffness = np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]])
    for arguments, message in [
        ({}, "state what is struck by one of contact, node, and mesh"),
        ({"contact": [1.0], "node": 1}, "state what is struck by one of .*, not by contact and node"),
        ({"contact": [1.0]}, "must have 2 rows"),
        ({"contact": "none.txt"}, "contact = 'none.txt': there is no such file"),
        ({"node": 1}, "does not state the nodes of its rows"),
        ({"point": (0.0, 0.0, 0.0)}, "point needs the mesh"),
    ]:
        with pytest.raises(ValueError, match=message):
            hl.from_matrices(mass, stiffness, hl.PTFE, **arguments)
    with pytest.raises(ValueError, match="mass: has 3 rows, and the stiffness 2"):
        hl.from_matrices(np.eye(3), stiffness, hl.PTFE, contact=[1.0, 0.0])
    for wrong, message in [
        (np.eye(1), "mass: has 1 row, and the stiffness 2"), (np.zeros((2, 2)), "mass: all its numbers are zero"),
        (1j * mass, "mass: must be a matrix of real numbers"), (np.diag([1.0, np.nan]), "row 2, column 2 has nan"),
        (sparse.csr_array(np.diag([np.inf, 1.0])), "mass: must hold finite numbers; row 1, column 1 has inf"),
        (DATA, "mass = .*: is a folder; give a file in it"),
    ]:  # fmt: skip
        with pytest.raises(ValueError, match=message):
            hl.from_matrices(wrong, stiffness, hl.PTFE, contact=[1.0, 0.0])
    with pytest.raises(ValueError, match="contact: acts on a row that is held"):
        hl.from_matrices(mass, np.diag([1e36, 1.0]), hl.PTFE, contact=[1.0, 0.0])


def test_a_patch_gives_back_what_hertz_contains_as_a_solid_does(tmp_path: Path) -> None:
    """A force F on a patch of radius a sinks by a part of F/(a E*) into a half-space; the body is so much stiffer."""
    count, side, radius = 8, 0.05, 0.0125
    places = side / count * np.array([(i, j, k) for k in range(9) for j in range(9) for i in range(9)])
    corners = np.array([0, 1, 10, 9, 81, 82, 91, 90])
    cells = [i + 9 * j + 81 * k + corners + 1 for k in range(8) for j in range(8) for i in range(8)]
    lines = ["*NODE", *(f"{n + 1},{x},{y},{z}" for n, (x, y, z) in enumerate(places)), "*ELEMENT, TYPE=C3D8, ELSET=ALL"]
    lines += [",".join(map(str, [n + 1, *cell])) for n, cell in enumerate(cells)]
    mesh, rows = tmp_path / "block.inp", range(1, 3 * len(places) + 1)
    mesh.write_text("\n".join(lines) + "\n")
    for name in ("block.mas", "block.sti"):
        (tmp_path / name).write_text("".join(f"{row} {row} 1.0\n" for row in rows))
    (tmp_path / "block.dof").write_text("".join(f"{(row + 2) // 3}.{(row - 1) % 3 + 1}\n" for row in rows))
    struck: dict[str, Any] = {"mesh": str(mesh), "point": (0.025, 0.025, 0.05), "patch_radius": radius}
    body = hl.from_matrices(str(tmp_path / "block.mas"), str(tmp_path / "block.sti"), hl.ALUMINIUM_6061, **struck)
    assert -1.0 < body.flexibility * radius * hl.ALUMINIUM_6061.contact_modulus < -0.2
