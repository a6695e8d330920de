"""Sparse symmetric factorisations by SuperLU, in an order that leaves few entries in the factors."""

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import breadth_first_order, connected_components, maximum_bipartite_matching, shortest_path
from scipy.sparse.linalg import SuperLU, splu

Indices = NDArray[np.int64]

FEW = 3_000
"""Unknowns that minimum degree orders well enough."""

PART = 2_000
"""Unknowns of a part that is cut no further: minimum degree orders it."""

PARTS = (0.3, 0.4, 0.5, 0.6, 0.7)
"""Fractions of the unknowns on one side of a cut that are tried."""

TIE = 1e-3
"""Of the other distance, where the first is the same."""

SURFACE = 5.0
"""At the middle distance from a rim, a plane mesh of n nodes has up to 3.7 √n of them, solids have 6 √n or more."""


def decomposition(matrix: sparse.sparray) -> tuple[SuperLU, Indices | None]:
    """Return L U of a symmetric matrix, n × n, without pivoting; and the order of its rows and columns, None for their
    own.

    Raises RuntimeError if a pivot is zero.
    """
    order, mode = elimination_order(matrix), {"SymmetricMode": True}
    if order is None:
        return splu(sparse.csc_array(matrix), "MMD_AT_PLUS_A", 0.0, options=mode), None
    ordered = sparse.csc_array(sparse.csr_array(matrix)[order][:, order])
    return splu(ordered, "NATURAL", 0.0, options=mode), order


def elimination_order(matrix: sparse.sparray) -> Indices | None:
    """Return order that leaves few entries in the factors of a symmetric matrix, n places; None: minimum degree does.

    Nested dissection: a cut through the graph of the matrix is eliminated last, after the two sides that it separates;
    each side is ordered alike. Minimum degree, SuperLU's own, is as good in a plane mesh. By it solids of 25 000 to
    40 000 unknowns, flat and compact ones, take 0.9 to 1.8 times as long (`benchmarks/factorisation.py`).

    References
    ----------
    George, SIAM J. Numer. Anal. 10 (1973) 345 (nested dissection); Pothen and Fan, ACM Trans. Math. Softw. 16 (1990)
    303 (the least cut by a matching).
    """
    if matrix.shape[0] <= FEW:
        return None
    graph, unknowns = _nodes(matrix)
    component = connected_components(graph, directed=False)[1]
    largest = np.flatnonzero(component == np.bincount(component).argmax())
    from_rim = _from_rim(_among(graph, largest))
    at_middle = np.count_nonzero(from_rim == np.median(from_rim))
    return None if at_middle < SURFACE * sqrt(largest.size) else _dissection(graph, unknowns)


def _dissection(graph: sparse.csr_array, unknowns: Indices) -> Indices:
    """Return the order of the unknowns, n places; unknowns: the node of each in the graph."""
    sizes = np.bincount(unknowns)
    ordered = np.concatenate(_dissected(graph, sizes, np.arange(sizes.size)))
    place = np.empty_like(ordered)
    place[ordered] = np.arange(sizes.size)
    return np.argsort(place[unknowns], kind="stable")


def _nodes(matrix: sparse.sparray) -> tuple[sparse.csr_array, Indices]:
    """Return graph of the nodes, whose unknowns have the same neighbours; and the node of each unknown, n numbers."""
    rows = sparse.csr_array(matrix)
    pattern = sparse.csr_array((np.ones(rows.nnz), rows.indices, rows.indptr), rows.shape)
    # Two rows with the same places have the same sum of numbers drawn for these places; whole numbers, so it is exact.
    sums = pattern @ np.random.default_rng(0).integers(1, 2**40, rows.shape[0]).astype(float)
    _, first, unknowns = np.unique(sums, return_index=True, return_inverse=True)
    graph = pattern[first][:, first]
    graph.setdiag(0.0)
    graph.eliminate_zeros()
    return _with_short_indices(graph), unknowns


def _dissected(graph: sparse.csr_array, sizes: Indices, nodes: Indices) -> list[Indices]:
    """Return the nodes of a part of the graph in groups, in the order of their elimination."""
    if sizes[nodes].sum() <= PART:
        return [nodes[_minimum_degree(_among(graph, nodes))]]
    here = _among(graph, nodes)
    count, component = connected_components(here, directed=False)
    if count > 1:
        by_component = np.split(nodes[np.argsort(component, kind="stable")], np.cumsum(np.bincount(component))[:-1])
        return [group for each in by_component for group in _dissected(graph, sizes, each)]
    side = _cut(here, sizes[nodes])
    if side is None:
        return [nodes]
    before, after, cut = nodes[side < 0], nodes[side > 0], nodes[side == 0]
    return [*_dissected(graph, sizes, before), *_dissected(graph, sizes, after), cut]


def _among(graph: sparse.csr_array, nodes: Indices) -> sparse.csr_array:
    """Return the edges between some of the nodes."""
    return _with_short_indices(graph[nodes][:, nodes])


def _with_short_indices(matrix: Any) -> sparse.csr_array:
    """Return the matrix with 32-bit indices: csgraph of scipy 1.12 takes no others."""
    short = (matrix.data, matrix.indices.astype(np.int32), matrix.indptr.astype(np.int32))
    return sparse.csr_array(short, matrix.shape)


def _cut(graph: sparse.csr_array, sizes: Indices) -> Indices | None:
    """Return side of each node of a connected graph, −1 or 1, and 0 on the cut between them; None where there is none.

    Nodes are sorted by their distance from a rim, or by how much nearer they are to it than to the other rim, and
    divided at several places. The division that the fewest unknowns cover is the cut.
    """
    near = _from_rim(graph)
    far = _distances(graph, int(np.argmax(near)))
    sides = []
    for along in (near - TIE * far, near - far + TIE * (near + far)):
        ascending = np.argsort(along, kind="stable")
        share = np.cumsum(sizes[ascending]) / sizes.sum()
        for part in PARTS:
            before = np.zeros(sizes.size, dtype=bool)
            before[ascending[: np.searchsorted(share, part)]] = True
            side = np.where(before, -1, 1)
            side[_cover(graph, before)] = 0
            if side.min() < 0 < side.max():
                sides.append(side)
    return min(sides, key=lambda side: int(sizes[side == 0].sum()), default=None)


def _from_rim(graph: sparse.csr_array) -> NDArray[np.float64]:
    """Return the distance of each node of a connected graph from one at its rim, in edges."""
    rim = 0
    for _ in range(2):
        rim = int(breadth_first_order(graph, rim, directed=False, return_predecessors=False)[-1])
    return _distances(graph, rim)


def _distances(graph: sparse.csr_array, node: int) -> NDArray[np.float64]:
    distances: NDArray[np.float64] = shortest_path(graph, "D", directed=False, indices=node, unweighted=True)
    return distances


def _cover(graph: sparse.csr_array, before: NDArray[np.bool_]) -> Indices:
    """Return the fewest nodes that touch every edge from a node `before` to one that is not (König's theorem)."""
    left, right = np.flatnonzero(before), np.flatnonzero(~before)
    edges = _with_short_indices(graph[left][:, right])
    partner = maximum_bipartite_matching(edges, perm_type="column")
    partner_of_right = np.full(right.size, -1)
    partner_of_right[partner[partner >= 0]] = np.flatnonzero(partner >= 0)
    # Nodes that a path of edges without and with partners, in turn, joins to a node without a partner.
    new = partner < 0
    ours, theirs = new.copy(), np.zeros(right.size, dtype=bool)
    while new.any():
        reached = (edges.T @ new.astype(float) > 0.0) & ~theirs
        theirs |= reached
        new = np.zeros(left.size, dtype=bool)
        new[partner_of_right[reached]] = True
        new &= ~ours
        ours |= new
    return np.concatenate([left[~ours], right[theirs]])


def _minimum_degree(graph: sparse.csr_array) -> Indices:
    """Return nodes in SuperLU's order by minimum degree; it gives it with factors only, here those of a Laplacian."""
    laplacian = sparse.diags_array(1.0 + graph.sum(axis=1)) - graph
    return np.argsort(splu(sparse.csc_array(laplacian), "MMD_AT_PLUS_A", 0.0, options={"SymmetricMode": True}).perm_c)
