"""The matrix of a body from those of its cells."""

import numpy as np
from numpy.typing import NDArray
from scipy import sparse


def sum_of_cells(dofs: NDArray[np.int64], blocks: NDArray[np.float64], size: int) -> sparse.csr_array:
    """Return the matrix, size × size, of cells whose d degrees of freedom, cells × d, have blocks, cells × d × d."""
    rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :])
    entries = blocks.ravel(), (rows.ravel(), columns.ravel())
    return sparse.csr_array(sparse.coo_array(entries, shape=(size, size)))
