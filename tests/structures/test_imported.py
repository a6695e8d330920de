"""Structures from matrices of other programs, and what damaged files do."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.io
from scipy import sparse
from scipy.linalg import eigh

import hertzlink as hl

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


def test_millimetres_and_tonnes_change_nothing() -> None:
    rod = hl.rod([hl.Layer(hl.STEEL_316, length=0.1, radius=0.01)], elements=4)
    # In t, mm, N and s mass and stiffness have a thousandth of their numbers in SI units.
    small = hl.from_matrices(1e-3 * rod.mass, 1e-3 * rod.stiffness, hl.STEEL_316, contact=rod.contact, scale=1e-3)
    np.testing.assert_allclose(frequencies(small), frequencies(rod), rtol=1e-9)
    assert static(small) == pytest.approx(static(rod), rel=1e-9)


def test_a_beam_of_abaqus_deflects_as_beams_do() -> None:
    """The lines of docs/meshes.md read the file that Abaqus wrote."""
    rows = np.array([line.split(",") for line in CANTILEVER.split("\n") if line], dtype=float)
    labels, place = np.unique(rows[:, :4].astype(int).reshape(-1, 2), axis=0, return_inverse=True)
    i, j = place.reshape(-1, 2).T
    stiffness = np.zeros((len(labels), len(labels)))
    stiffness[i, j] = stiffness[j, i] = rows[:, 4]
    free = stiffness.diagonal() < 1e36
    contact = ((labels == (2, 3)).all(axis=1)).astype(float)[free]
    beam = hl.from_matrices(np.eye(8), stiffness[free][:, free], hl.STEEL_316, contact=contact)
    assert static(beam) == pytest.approx(1.0 / (3.0 * 1.5), rel=1e-12)  # L³/3EI


def test_matrix_market_holds_what_scipy_wrote(tmp_path: Path) -> None:
    rod = hl.rod([hl.Layer(hl.STEEL_316, length=0.1, radius=0.01)], elements=4)
    paths = [tmp_path / "mass.mtx", tmp_path / "stiffness.mtx", tmp_path / "damping.mtx"]
    for path, matrix in zip(paths, (rod.mass, rod.stiffness, 1e-7 * rod.stiffness), strict=True):
        scipy.io.mmwrite(path, sparse.coo_matrix(matrix), symmetry="symmetric", precision=17)
    np.savetxt(tmp_path / "contact.txt", rod.contact, header="force on each row")
    read = hl.from_matrices(*paths[:2], hl.STEEL_316, contact=tmp_path / "contact.txt", damping=paths[2])
    for name in ("mass", "stiffness"):
        np.testing.assert_allclose(getattr(read, name).toarray(), getattr(rod, name).toarray(), rtol=1e-14)
    np.testing.assert_allclose(read.damping.toarray(), 1e-7 * rod.stiffness.toarray(), rtol=1e-15)
    np.testing.assert_array_equal(read.contact, rod.contact)


BAD_FILES = [
    ("a.mtx", b"", "Missing banner"),
    ("a.mtx", b"1,1, 1,1, 2.0\n", "Not a Matrix Market file"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate real general\n9 9 4000000000\n1 1 1\n", "Unable to allocate"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 1 0\n", "must hold finite, real numbers"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate real general\n1 1 1\n1 1 nan\n", "must hold finite, real numbers"),
    ("a.mtx", b"%%MatrixMarket matrix coordinate real general\n1 1 2\n1 1 -1E", "Truncated file"),
    ("a.op4", b"\x00" * 9, "Not a Matrix Market file"),
]


def test_mass_and_stiffness_the_other_way_round_are_refused() -> None:
    with pytest.raises(ValueError, match=r"mass: must be the mass matrix, but is larger than the stiffness"):
        hl.from_matrices([[1.7e7]], [[0.0141]], hl.PTFE, contact=[1.0])
    assert hl.from_matrices([[0.5]], [[0.0]], hl.PTFE, contact=[1.0]).size == 1  # a free block


@pytest.mark.parametrize(("name", "content", "message"), BAD_FILES)
def test_bad_files_are_refused(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(ValueError, match=message) as caught:
        hl.from_matrices([[1.0]], tmp_path / name, hl.PTFE, contact=[1.0])
    assert str(caught.value).startswith("stiffness")


def test_what_does_not_fit_is_refused() -> None:
    mass, stiffness, contact = np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]]), [1.0, 0.0]
    for arguments, message in [
        ({"contact": [1.0]}, r"mass has shape \(2, 2\): must be \(1, 1\), as contact has 1 entries"),
        ({"contact": "none.txt"}, "contact = 'none.txt': there is no such file"),
        ({"mass": np.eye(3)}, r"mass has shape \(3, 3\): must be \(2, 2\)"),
        ({"stiffness": stiffness[:1]}, r"stiffness has shape \(1, 2\): must be square"),
        ({"mass": np.zeros((2, 2))}, "mass: must be the mass matrix, but is zero everywhere"),
        ({"mass": 1j * mass}, "mass = .*: must be a number or an array of numbers"),
        ({"mass": np.diag([1.0, np.nan])}, "mass = nan: must be a finite number"),
        ({"mass": Path(__file__).parent}, "mass = .*: is a folder; give a file in it"),
    ]:
        given = {"mass": mass, "stiffness": stiffness, "contact": contact, **arguments}
        with pytest.raises(ValueError, match=message):
            hl.from_matrices(material=hl.PTFE, **given)
