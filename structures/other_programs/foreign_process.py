"""Reads a file by the library of its program, in a process of its own (`reading_process`)."""

from math import isqrt
from pathlib import Path
from typing import Any

MATRIX_MARKET = "Matrix Market"
"""The role of a file of this format, whatever its ending."""

MOST_ROWS = 2_000_000
"""Degrees of freedom of the largest matrix that is read."""


def read(path: str, role: str) -> dict[str, Any]:
    """Return arrays by name; role: "mass", "modes" …"""
    if role == MATRIX_MARKET:
        return matrix_market(path)
    return READERS[Path(path).suffix.lower(), role in ("mass", "stiffness", "damping")](path, role)


def matrix_market(path: str) -> dict[str, Any]:
    """Return the entries of a Matrix Market file, and its shape."""
    from scipy import sparse
    from scipy.io import mminfo, mmread

    size = Path(path).stat().st_size
    rows, columns, entries, form, field, _ = mminfo(path)
    most = min(isqrt(2 * size) if form == "array" else MOST_ROWS, MOST_ROWS)
    if rows > most or columns > most or entries > size:
        raise ValueError(f"claims {rows} × {columns} numbers, more than it can hold")
    if field in ("complex", "pattern"):
        raise ValueError(f"holds a {field} matrix, must be one of real numbers")
    matrix = sparse.coo_array(mmread(path))
    return {"rows": matrix.row, "columns": matrix.col, "values": matrix.data, "shape": matrix.shape}


def of_matrix(matrix: Any, labels: Any) -> dict[str, Any]:
    """Return a sparse matrix as plain arrays."""
    import numpy as np

    entries = matrix.tocoo()
    if np.iscomplexobj(entries.data):
        raise ValueError("a complex matrix; it must be real")
    return {
        "rows": entries.row.astype(np.int64), "columns": entries.col.astype(np.int64),
        "values": entries.data.astype(float), "size": entries.shape[0], "labels": labels,
    }  # fmt: skip


def by_role(matrices: dict[str, Any], role: str) -> Any:
    """Return the only matrix, or the one whose name begins with K, M or B, as Nastran names them."""
    letter = {"mass": "M", "stiffness": "K", "damping": "B"}[role]
    meant = [name for name in matrices if len(matrices) == 1 or name.upper().startswith(letter)]
    if len(meant) != 1:
        raise ValueError(f"the matrices {', '.join(matrices)}, of which {len(meant)} begin with {letter}; keep one")
    return matrices[meant[0]]


def op4(path: str, role: str) -> dict[str, Any]:
    """Return a matrix of Nastran's OUTPUT4, which has no labels."""
    from pyNastran.op4.op4 import read_op4
    from scipy import sparse

    matrices = {name: getattr(matrix, "data", matrix) for name, matrix in read_op4(path, debug=None).items()}
    return of_matrix(sparse.coo_array(by_role(matrices, role)), None)


def punch(path: str, role: str) -> dict[str, Any]:
    """Return a matrix of DMIG cards."""
    import numpy as np
    from pyNastran.bdf.bdf import read_bdf

    model = read_bdf(path, punch=True, xref=False, validate=False, debug=None)
    square = {name: matrix for name, matrix in model.dmigs.items() if matrix.matrix_form in (1, 6)}
    matrix, rows, _ = by_role(square, role).get_matrix(is_sparse=True, apply_symmetry=True)
    return of_matrix(matrix, np.array([rows[i] for i in range(len(rows))], dtype=np.int64))


def full(path: str, role: str) -> dict[str, Any]:
    """Return a matrix of Ansys; the file has the stiffness and the mass."""
    import numpy as np
    from ansys.mapdl import reader

    if role == "damping":
        raise ValueError("no damping that is read")
    labels, stiffness, mass = reader.read_binary(path).load_km(sort=False)
    labels = np.asarray(labels, dtype=np.int64) + np.array([0, 1])
    matrix = stiffness if role == "stiffness" else mass
    keep = np.arange(matrix.shape[0])
    return of_matrix(matrix.tocsr()[keep][:, keep], labels)


def modes_of(frequencies: Any, nodes: Any, shapes: Any, masses: Any = None, ratios: Any = None) -> dict[str, Any]:
    """Return modes as plain arrays; shapes: modes × nodes × directions, at most six."""
    import numpy as np

    shapes = np.asarray(shapes)
    if np.iscomplexobj(shapes):
        raise ValueError("complex modes; they must be real")
    wide = np.zeros((*shapes.shape[:2], 6))
    wide[:, :, : shapes.shape[2]] = shapes
    masses = np.ones(len(wide)) if masses is None else np.asarray(masses, dtype=float)
    return {
        "frequencies": np.asarray(frequencies, dtype=float), "nodes": np.asarray(nodes), "shapes": wide,
        "masses": masses, "ratios": ratios,
    }  # fmt: skip


def universal(path: str, role: str) -> dict[str, Any]:
    """Return the modes (datasets 55), or the responses (datasets 58), of a universal file."""
    import numpy as np
    import pyuff

    file = pyuff.UFF(path)
    kinds = file.get_set_types()
    sets = [file.read_sets(int(i)) for i in np.flatnonzero(np.asarray(kinds) == (55 if role == "modes" else 58))]
    if role != "modes":
        return {"sets": [{name: one.get(name) for name in RESPONSE} for one in sets]}
    normal = [one for one in sets if one["analysis_type"] == 2 and one["data_type"] == 2]
    if not normal:
        raise ValueError("no normal modes in real numbers (datasets 55)")
    shapes = [np.stack([one[f"r{i}"] for i in range(1, 7) if f"r{i}" in one], axis=-1) for one in normal]
    of_each = [[float(one[name]) for one in normal] for name in ("freq", "modal_m", "modal_damp_vis")]
    return modes_of(of_each[0], normal[0]["node_nums"], shapes, of_each[1], np.array(of_each[2]))


def op2(path: str, role: str) -> dict[str, Any]:
    """Return the modes of Nastran. Its table of eigenvalues states their masses, which are 1 only with NORM=MASS."""
    import numpy as np
    from pyNastran.op2.op2 import read_op2

    results = read_op2(path, debug=None, build_dataframe=False)
    if len(results.eigenvectors) != 1:
        raise ValueError(f"{len(results.eigenvectors)} subcases with modes; one is needed")
    if len(results.eigenvalues) != 1:
        raise ValueError(
            f"{len(results.eigenvalues)} tables of eigenvalues, which state the modal masses; one is needed"
        )
    (vectors,), (table,) = results.eigenvectors.values(), results.eigenvalues.values()
    square = np.maximum(np.asarray(vectors.eigns, dtype=float), 0.0)
    masses = table.generalized_mass[np.searchsorted(table.mode, vectors.modes)]
    return modes_of(np.sqrt(square) / (2.0 * np.pi), vectors.node_gridtype[:, 0], vectors.data, masses)


def rst(path: str, role: str) -> dict[str, Any]:
    """Return the modes of Ansys, which normalises them to unit modal mass."""
    from ansys.mapdl import reader

    result = reader.read_binary(path)
    every = [result.nodal_solution(i) for i in range(result.n_results)]
    return modes_of(result.time_values, every[0][0], [shape[:, :6] for _, shape in every])


RESPONSE = ("x", "data", "ordinate_spec_data_type", "rsp_node", "ref_node", "rsp_dir", "ref_dir", "func_type")
"""What is needed of a dataset 58."""

READERS = {
    (".op4", True): op4, (".pch", True): punch, (".full", True): full, (".unv", False): universal,
    (".uff", False): universal, (".op2", False): op2, (".rst", False): rst,
}  # fmt: skip
"""The functions that read, by ending and whether a matrix is meant."""
