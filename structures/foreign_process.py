"""Reads a file by a library: `python -P foreign_process.py FILE SECONDS BYTES ROLE`, as `mesh_process.py` does.

It writes arrays by name to standard output as a pickle, for the process that started it.
"""

import os
import pickle
import sys
from pathlib import Path
from typing import Any


def main(path: str, seconds: str, memory: str, role: str) -> int:
    """Writes the arrays, or leaves the reason as the last line of the standard error."""
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
    from structures.mesh_process import limit

    answer = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # libraries print
    limit(int(seconds), int(memory))
    try:
        read = READERS[Path(path).suffix.lower(), role in ("mass", "stiffness", "damping")](path, role)
    except ModuleNotFoundError:
        return 3
    with answer:
        pickle.dump(read, answer)
    return 0


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


READERS = {(".op4", True): op4, (".pch", True): punch, (".full", True): full}
"""The functions that read, by ending and whether a matrix is meant."""

if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
