"""Structures from the modes of other programs, and of tests."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy import sparse

from structures.caution import caution
from structures.checks import each, not_negative
from structures.described import described_as
from structures.linear_algebra.factor import numbers
from structures.material import Material
from structures.other_programs.imported import MEMORY, Residual, source_of_argument, table_in
from structures.quantities import Asks, Component, Curvature, InFile, Scale
from structures.structure import Structure
from structures.surface import Surface

HEADS = "frequency,shape", "frequency,shape,damping_ratio"
"""The first line of a file of modes."""

LACKS = (
    "these modes lack the compliance of all higher ones, at the contact most of all; state residual_flexibility: the "
    "static compliance, without what Hertz's law contains, minus the sum of φ²/ω²; or 0.0 where modes hold all"
)


@described_as(also=("modes",))
def from_modes(
    frequencies: Annotated[Any, InFile("modes", "modes.csv")],
    material: Material,
    shapes: Annotated[Any, Asks("the shapes at the contact")] | None = None,
    damping_ratios: float | Sequence[Component] | None = None,
    residual_flexibility: Residual | None = None,
    curvature: Curvature = 0.0,
    scale: Scale = 1.0,
) -> Structure:
    """A body whose modes come from another program or from a test.

    Parameters
    ----------
    frequencies : array, str or Path
        Natural frequencies, Hz, n; zero for rigid motions. Or a file of comma-separated numbers whose first line is
        `frequency,shape` or `frequency,shape,damping_ratio`: Hz, 1/√kg, and parts of the critical damping.
    material : Material
        The material at the contact, for Hertz's law.
    shapes : array, optional
        Displacement of the contact in each mode along the push, for unit modal mass, 1/√kg: n, or n × p for p contacts.
        Needed if `frequencies` are numbers.
    damping_ratios : float or sequence of float, optional
        Part of the critical damping, one for all modes or one for each; by default those of the file, or zero.
    residual_flexibility : float, optional
        Compliance at the contact, m/N, that the modes lack; without it a warning says how to get it.
    curvature : float
        Curvature of the surface at the contact, 1/m, for Hertz's law.
    scale : float
        m per unit of length of the shapes: 1e-3 for mm, N, s and t.

    Returns
    -------
    Structure
        One oscillator for each mode. Runs are warned of if the push is shorter than the highest frequency resolves.

    Raises
    ------
    ValueError
        If a file cannot be read, or numbers do not fit each other.

    Examples
    --------
    >>> import hertzlink as hl
    >>> plate = hl.from_modes([900.0, 2500.0], hl.PTFE, shapes=[2.1, 1.8], residual_flexibility=2e-8)
    >>> plate.size, plate.origin["highest_frequency"]
    (2, 2500.0)
    """
    in_file, stated = isinstance(frequencies, str | Path), 0.0 if damping_ratios is None else damping_ratios
    if in_file:
        if shapes is not None:
            raise ValueError("shapes: the file of the modes holds them; leave shapes out")
        table = table_in("frequencies", Path(frequencies), HEADS)
        hertz, columns = table[:, 0], table[:, 1]
        if damping_ratios is None and table.shape[1] == 3:
            stated = table[:, 2]
    else:
        hertz = np.atleast_1d(numbers("frequencies", frequencies))
        columns = numbers("shapes", shapes if shapes is not None else [])
    vector, count = np.sqrt(scale) * (columns.reshape(-1, 1) if columns.ndim < 2 else columns), hertz.size
    if hertz.ndim != 1 or not count or len(vector) != count:
        raise ValueError(f"shapes has shape {vector.shape}: must have a row for each of {count} frequencies")
    ratios = np.atleast_1d(numbers("damping_ratios", stated)).ravel()
    if ratios.size not in (1, count):
        raise ValueError(f"damping_ratios: must be one number, or {count}, one for each mode")
    if residual_flexibility is None:
        caution(f"frequencies: {LACKS}")
    origin = {
        "frequencies": source_of_argument(frequencies),
        "shapes": None if in_file else MEMORY,
        "modes": count,
        "damping_ratios": None if damping_ratios is None else np.asarray(damping_ratios).tolist(),
        "highest_frequency": float(hertz.max()),
    }
    omega = 2.0 * np.pi * each(not_negative, "frequencies", hertz, "Hz")
    damping = 2.0 * each(not_negative, "damping_ratios", ratios) * omega
    contacts, surface, flexibility = vector.shape[1], Surface(material, curvature), residual_flexibility or 0.0
    return Structure(
        sparse.csr_array(sparse.eye_array(count)),
        sparse.csr_array(sparse.diags_array(omega**2)),
        sparse.csr_array(sparse.diags_array(damping)) if damping.any() else None,
        vector if contacts > 1 else vector.reshape(-1),
        flexibility if contacts == 1 else [flexibility] * contacts,
        surface if contacts == 1 else [surface] * contacts,
        origin,
    )
