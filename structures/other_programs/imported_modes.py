"""Structures from the modes of other programs, and of tests."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from scipy import sparse

from structures.caution import caution
from structures.checks import each, not_negative, whole
from structures.described import described_as
from structures.linear_algebra.factor import numbers
from structures.material import Material
from structures.other_programs.imported import ALONG_Z, MEMORY, Direction, Residual, source_of_argument
from structures.other_programs.modal_files import Modes, read_modes
from structures.quantities import Asks, Component, Curvature, InFile, Scale
from structures.structure import Structure, Vector
from structures.surface import Surface

LACKS = (
    "these modes lack the compliance of all higher ones, at the contact most of all; state residual_flexibility: the "
    "static compliance, without what Hertz's law contains, minus the sum of φ²/ω²; or 0.0 where modes hold all"
)


@described_as(also=("modes",))
def from_modes(
    frequencies: Annotated[Any, InFile("modes", "modes.csv")],
    material: Material,
    shapes: Annotated[Any, Asks("the shapes at the contact")] | None = None,
    node: Annotated[int | Sequence[int], Asks("the number of the node that is struck, or a list")] | None = None,
    direction: Direction = ALONG_Z,
    damping_ratios: float | Sequence[Component] | None = None,
    residual_flexibility: Residual | None = None,
    curvature: Curvature = 0.0,
    scale: Scale = 1.0,
) -> Structure:
    """A body whose modes come from another program or from a test.

    Parameters
    ----------
    frequencies : array, str or Path
        Natural frequencies, Hz, n; zero for rigid motions. Or a file: a table (.csv, .txt) with the columns frequency
        (Hz, kHz or rad/s), shape (1/√kg or 1/√t) and, if you like, damping ratio (1 or %), in any order if heads name
        them, and in the first of these units if the heads name none; CalculiX (.frd), I-DEAS (.unv, .uff;
        `hertzlink[uff]`), Nastran (.op2; `hertzlink[nastran]`), Ansys (.rst; `hertzlink[ansys]`).
    material : Material
        The material at the contact, for Hertz's law.
    shapes : array, optional
        Displacement of the contact in each mode along the push, for unit modal mass, 1/√kg: n, or n × p for p contacts.
        Needed if `frequencies` are numbers.
    node : int or sequence of int, optional
        Number of the node that is struck, or of several, in a file that has nodes.
    direction : sequence of float
        The direction of the push at `node`.
    damping_ratios : float or sequence of float, optional
        Part of the critical damping, one for all modes or one for each; by default those of the file, or zero.
    residual_flexibility : float, optional
        Compliance at the contact, m/N, that the modes lack; without it a warning says how to get it.
    curvature : float
        Curvature of the surface at the contact, 1/m, for Hertz's law.
    scale : float
        m per unit of length of the file: 1e-3 for mm, N, s and t.

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
    nodes = [] if node is None else [whole("node", n) for n in (node if isinstance(node, Sequence) else [node])]
    if isinstance(frequencies, str | Path):
        if shapes is not None:
            raise ValueError("shapes: the file of the modes holds them; leave shapes out")
        modes = read_modes("frequencies", Path(frequencies), nodes, scale)
        axes, size = np.zeros(6), float(np.linalg.norm(direction))
        if size == 0.0:
            raise ValueError(f"direction = {tuple(direction)!r}: must have a length")
        axes[:3] = np.asarray(direction) / size
        vector = modes.shapes @ (axes if nodes else np.abs(np.eye(6)[2]))
    else:
        if nodes:
            raise ValueError(f"node = {nodes[0]}: is for files; shapes are those at the contact already")
        columns = numbers("shapes", shapes if shapes is not None else [])
        vector = np.sqrt(scale) * (columns.reshape(-1, 1) if columns.ndim < 2 else columns)
        modes = Modes(np.atleast_1d(numbers("frequencies", frequencies)), vector, None)
    count = modes.frequencies.size
    if modes.frequencies.ndim != 1 or not count or len(vector) != count:
        raise ValueError(f"shapes has shape {vector.shape}: must have a row for each of {count} frequencies")
    stated = damping_ratios if damping_ratios is not None else 0.0 if modes.ratios is None else modes.ratios
    ratios = np.atleast_1d(numbers("damping_ratios", stated)).ravel()
    loss = (
        np.broadcast_to(each(not_negative, "damping_ratios", ratios), (count,)) if ratios.size in (1, count) else None
    )
    if loss is None:
        raise ValueError(f"damping_ratios: must be one number, or {count}, one for each mode")
    if residual_flexibility is None:
        caution(f"frequencies: {LACKS}")
    highest = float(modes.frequencies.max())
    origin = {
        "frequencies": source_of_argument(frequencies),
        "shapes": None if isinstance(frequencies, str | Path) else MEMORY,
        "modes": count,
        "damping_ratios": None if damping_ratios is None else np.asarray(damping_ratios).tolist(),
        "highest_frequency": highest,
    }
    omega = 2.0 * np.pi * each(not_negative, "frequencies", modes.frequencies, "Hz")
    return oscillators(omega, loss, vector, residual_flexibility or 0.0, Surface(material, curvature), origin)


def oscillators(
    omega: Vector, ratios: Vector, vector: Vector, flexibility: float, surface: Surface, origin: dict[str, Any]
) -> Structure:
    """Return a structure of one oscillator for each angular frequency, 1/s; vector: n × p."""
    contacts = vector.shape[1]
    damping = 2.0 * ratios * omega
    return Structure(
        sparse.csr_array(sparse.eye_array(omega.size)),
        sparse.csr_array(sparse.diags_array(omega**2)),
        sparse.csr_array(sparse.diags_array(damping)) if damping.any() else None,
        vector if contacts > 1 else vector.reshape(-1),
        flexibility if contacts == 1 else [flexibility] * contacts,
        surface if contacts == 1 else [surface] * contacts,
        origin,
    )
