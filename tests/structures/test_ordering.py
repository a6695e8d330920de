"""Orders of elimination: every unknown once, few entries in the factors of solids, and the same solutions."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from structures.linear_algebra import ordering
from structures.linear_algebra.factor import compliance_at, factorise
from structures.linear_algebra.ordering import decomposition, elimination_order
from structures.linear_algebra.symmetric import check_definite

MINIMUM_DEGREE = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}


def grid(*sides: int, each: int = 1) -> sparse.csr_array:
    """Springs between neighbours, diagonal ones too, and to the ground; each mass has `each` motions that are alike."""
    lines = [sparse.diags_array([np.ones(n - 1), np.ones(n), np.ones(n - 1)], offsets=[-1, 0, 1]) for n in sides]
    near = lines[0]
    for line in lines[1:]:
        near = sparse.kron(near, line)
    near = sparse.kron(near, np.ones((each, each)))
    return sparse.csr_array(sparse.diags_array(1.0 + near.sum(axis=1)) - near)


def shuffled(matrix: sparse.csr_array) -> sparse.csr_array:
    order = np.random.default_rng(0).permutation(matrix.shape[0])
    return matrix[order][:, order]


def random_numbers(*shape: int) -> NDArray[np.float64]:
    return np.random.default_rng(1).normal(size=shape)


SOLID = shuffled(grid(14, 13, 12, each=2))
TWO_SOLIDS = shuffled(sparse.csr_array(sparse.block_diag([grid(13, 12, 11), SOLID, grid(3, 3)])))


@pytest.mark.parametrize("matrix", [SOLID, TWO_SOLIDS], ids=["one", "two and a bit"])
def test_every_unknown_is_eliminated_once(matrix: sparse.csr_array) -> None:
    # Sums of many entries have long indices, which csgraph of earlier versions of scipy refuses.
    indices, starts = matrix.indices.astype(np.int64), matrix.indptr.astype(np.int64)
    long = sparse.csr_array(matrix.shape)
    long.data, long.indices, long.indptr = matrix.data, indices, starts
    order = ordering._dissection(*ordering._nodes(long))
    assert np.array_equal(np.sort(order), np.arange(matrix.shape[0]))


def test_a_solid_has_fewer_entries_than_by_minimum_degree() -> None:
    """In a cube of 20³ masses; in the limit of large cubes dissection needs n^(4/3) entries (George, 1973)."""
    cube = shuffled(grid(20, 20, 20))
    factor, order = decomposition(cube)
    assert order is not None
    assert factor.L.nnz < 0.85 * splu(sparse.csc_array(cube), **MINIMUM_DEGREE).L.nnz


@pytest.mark.parametrize("matrix", [grid(200, 60), grid(9000), grid(400, 4, 4), grid(12, 12, 12)], ids=str)
def test_minimum_degree_orders_planes_lines_bars_and_small_bodies(matrix: sparse.csr_array) -> None:
    assert elimination_order(shuffled(matrix)) is None


@pytest.mark.parametrize("columns", [(), (3,)])
@pytest.mark.parametrize("matrix", [SOLID, TWO_SOLIDS, grid(30, 10)], ids=["solid", "two and a bit", "plane"])
def test_solutions(matrix: sparse.csr_array, columns: tuple[int, ...]) -> None:
    wanted = random_numbers(matrix.shape[0], *columns)
    assert factorise(matrix)(matrix @ wanted) == pytest.approx(wanted, abs=1e-10)


@pytest.mark.parametrize("matrix", [SOLID, grid(30, 10)], ids=["solid", "plane"])
def test_compliance_is_that_of_unit_forces(matrix: sparse.csr_array) -> None:
    places = np.random.default_rng(2).permutation(matrix.shape[0])[:37]
    units = np.eye(matrix.shape[0])[:, places]
    wanted = splu(sparse.csc_array(matrix)).solve(units)[places]
    assert compliance_at(matrix, places) == pytest.approx(wanted, rel=1e-9, abs=1e-12)


def test_a_negative_eigenvalue_of_a_solid_is_found() -> None:
    """Its sign is that of a pivot in any order of elimination (Sylvester)."""
    check_definite("stiffness", SOLID)
    weak = sparse.csr_array(SOLID - 1.5 * sparse.eye_array(SOLID.shape[0]))
    with pytest.raises(ValueError, match="stiffness: must have no negative eigenvalue"):
        check_definite("stiffness", weak)
