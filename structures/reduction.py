"""Krylov reduction: a large structure becomes at most a few hundred oscillators with the same contact response."""

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from structures.caution import caution
from structures.checks import instance
from structures.described import checked_call
from structures.fineness import fineness
from structures.krylov import DEFAULT_PULSE, Krylov, Modes
from structures.linear_algebra.one_thread import one_thread
from structures.maxwell import with_arms
from structures.quantities import Likely, Quantity, Several
from structures.structure import Structure, Vector, known_field, oscillators

MOST_VECTORS = 600  # Default limit of the basis: dense matrices of this size are diagonalised in about a second

MOST_KEPT = 8  # The oscillators of this number of structures are kept, because a fit returns to recent ones

# The oscillators of recent structures and the reports on their reduction, by a hash of all that determines them
_RECENT: dict[str, tuple[Modes, dict[str, Any]]] = {}

Pulse = Annotated[float, replace(Likely.TIME, low=1e-12, high=1e3)]


@checked_call
@one_thread
def reduce(
    structure: Structure,
    until: Annotated[float, Likely.TIME],
    tolerance: Annotated[float, Quantity()] = 1e-2,
    largest: Several = MOST_VECTORS,
    keep_field: bool = False,
    pulse: Pulse | None = None,
) -> Structure:
    """Reduce a structure to oscillators (M = I, K diagonal) with the same motion of the contact points.

    K is projected on Krylov vectors of (K + s²M)⁻¹M that start at the contacts (Bai, Appl. Numer. Math. 43 (2002) 9),
    and diagonalised. If the damping is not a sum of M and K, the vectors are those of the second-order Arnoldi method
    (Bai and Su, SIAM J. Matrix Anal. Appl. 26 (2005) 640). Rayleigh damping stays diagonal, other damping is projected,
    and Maxwell arms are kept. A structure equal to a recently reduced one is not reduced again.

    Parameters
    ----------
    structure : Structure
        The structure to reduce. A structure without mass is returned unchanged.
    until : float
        Length of the longest run, s. Later the waves differ from those of the full structure.
    tolerance : float
        Relative error of the contact's displacement after a force pulse: the root mean square over time with the weight
        e^(−4 t/until), estimated by the change due to the last ten vectors for each contact. With 1e-2, amplitude
        ratios are within 0.01 % of those without reduction.
    largest : int
        Largest number of vectors. If they do not reach the tolerance, a warning says so.
    keep_field : bool
        Keep the field, for displacement and stress of the body: 8 bytes for each degree of freedom and oscillator.
    pulse : float, optional
        Length of the pulse, s: a contact time. The default, 25 µs, suits steel beads of 4 mm diameter or more. For
        contacts below 10 µs a run reduces the structure anew. It warns if its own error exceeds twice the tolerance.

    Returns
    -------
    Structure
        The oscillators, followed by their Maxwell arms.

    Examples
    --------
    >>> small = hl.reduce(hl.rod([hl.Layer(hl.PTFE, length=0.1, radius=9.525e-3)]), until=0.5e-3)
    >>> small.is_modal, small.valid_until
    (True, 0.0005)
    """
    instance("structure", structure, Structure, "a Structure")
    arguments = until, tolerance, largest, keep_field, pulse
    pulse = DEFAULT_PULSE / fineness().shorter if pulse is None else pulse
    if (part := fineness().tolerance) < 1.0:
        tolerance, largest = part * tolerance, max(largest, MOST_VECTORS)
    if until > structure.valid_until:
        raise ValueError(f"until = {until!r}: must be at most {structure.valid_until} s, for which it was reduced")
    field = known_field(structure) if keep_field else None
    if structure.mass.count_nonzero() == 0:
        return structure

    if field is None:  # an equal structure is not reduced again
        import joblib  # here, because a run without a reduction does not need it

        matrices = [matrix for matrix in (structure.mass, structure.stiffness, structure.damping) if matrix is not None]
        arrays = [(matrix.indptr, matrix.indices, matrix.data) for matrix in matrices]
        key = joblib.hash([until, tolerance, largest, pulse, structure.contact, arrays])
        if (known := _RECENT.get(key)) is None:
            modes, report, _ = _projected(structure, until, tolerance, largest, pulse)
            known = modes._replace(vectors=np.empty((0, 0))), report
            for old in list(_RECENT)[: 1 - MOST_KEPT]:
                _RECENT.pop(old, None)  # another thread may have removed it meanwhile
            _RECENT[key] = known
        modes, report = known[0], deepcopy(known[1])
    else:
        modes, report, krylov = _projected(structure, until, tolerance, largest, pulse)
        basis = krylov.basis[: krylov.size].T @ modes.vectors
        field = replace(field, basis=basis if field.basis is None else field.basis @ basis)
    if (estimate := report["error_estimate"]) > tolerance:
        caution(f"reduction: {largest} vectors leave an error of {estimate:.1e}; increase largest or tolerance")

    roots = []  # of Maxwell arms: R with RᵀR = stretch, a row for each direction with stiffness
    for _, stretch in modes.arms:
        values, vectors = (stretch, np.eye(stretch.size)) if stretch.ndim == 1 else eigh(stretch)
        stiff = values > 1e-14 * values.max()
        roots.append(sparse.csr_array(np.sqrt(values[stiff])[:, None] * vectors[:, stiff].T))
    size = modes.square.size + sum(root.shape[0] for root in roots)
    contact = modes.contact.reshape(-1, *structure.contact.shape[1:]).copy()
    origin = {**structure.origin, "reduction": {"size": size, **report}}
    rest = structure.flexibility, structure.surface, origin, report["until"], field
    reduced = oscillators(modes.square, modes.damping, contact, *rest)
    for (time, _), root in zip(modes.arms, roots, strict=True):
        reduced = with_arms(reduced, root, time)
    return reduced.made_from(structure, reduce, *arguments)


def _projected(
    structure: Structure, until: float, tolerance: float, largest: int, pulse: float
) -> tuple[Modes, dict[str, Any], Krylov]:
    """Return the oscillators, the report on the reduction for results, and the basis."""
    krylov = Krylov(structure, min(largest, structure.size), pulse)
    before, modes, estimate = None, None, np.inf
    while estimate > tolerance and krylov.grow(10 * structure.contacts):
        before, modes = modes, krylov.oscillators()
        if before is not None:
            estimate = _change(before, modes, until, pulse)
        if krylov.exhausted:
            estimate = 0.0
    modes = krylov.oscillators() if modes is None else modes
    report: dict[str, Any] = {"full_size": structure.size, "until": until, "tolerance": tolerance, "pulse": pulse}
    report |= {"largest": largest, "error_estimate": estimate}
    if before is not None and estimate > 0.0:
        shorter = [pulse / 2.0, pulse / 4.0, pulse / 8.0]
        report["shorter_pulses"] = [(length, _change(before, modes, until, length)) for length in shorter]
    return modes, report, krylov


def error_for_pulse(report: Mapping[str, Any], length: float) -> float:
    """Return the estimated error for a pulse length, s, from `origin["reduction"]`, by logarithmic interpolation."""
    first = report["pulse"], report["error_estimate"]
    lengths, errors = np.array(sorted(map(tuple, [first, *report.get("shorter_pulses", [])]))).T
    if length <= lengths[0]:
        return float(errors[0])
    return float(np.exp(np.interp(np.log(length), np.log(lengths), np.log(np.maximum(errors, 1e-300)))))


def _change(before: Modes, modes: Modes, until: float, length: float) -> float:
    """Return the relative change of the displacements after a raised-cosine pulse, from fewer vectors to more.

    The largest change of all pairs of contacts counts, relative to the direct responses of the two. By Parseval's
    theorem the norm of the Laplace transform at σ + iω is that of e^(−σt) w(t) over time.
    """
    # The weight is e^(−4 t/until), because the first echoes matter at the contact, not the last ones.
    s = 4.0 / until + 1j * np.linspace(0.0, 8.0 * np.pi / length, 500)
    turn = 2.0 * np.pi / length
    pulse = (1.0 - np.exp(-s * length)) * turn**2 / (s * (s**2 + turn**2))
    previous, answer = receptance(before, s) * pulse, receptance(modes, s) * pulse
    sizes = [np.linalg.norm(answer[i, i]) for i in range(len(answer))]
    pairs = [(i, j) for i in range(len(answer)) for j in range(i + 1)]
    return max(float(np.linalg.norm(answer[i, j] - previous[i, j]) / np.sqrt(sizes[i] * sizes[j])) for i, j in pairs)


def receptance(modes: Modes, s: Any) -> Any:
    """Return the displacement of each contact for a unit force on each, m/N, p × p × complex frequencies s."""
    terms = [] if modes.damping is None else [(s, modes.damping)]
    terms += [(s * time / (1.0 + s * time), stretch) for time, stretch in modes.arms]
    columns: Vector = modes.contact.T
    if all(matrix.ndim == 1 for _, matrix in terms):
        dynamic = modes.square + s[:, None] ** 2
        for factor, diagonal in terms:
            dynamic = dynamic + factor[:, None] * diagonal
        return (columns[:, None] * columns) @ (1.0 / dynamic).T
    shapes, inertia = np.empty((s.size, *modes.contact.shape), dtype=complex), s**2
    for i in range(s.size):
        matrix = np.diag(modes.square + inertia[i])
        for factor, part in terms:
            matrix = matrix + factor[i] * (part if part.ndim == 2 else np.diag(part))
        shapes[i] = np.linalg.solve(matrix, modes.contact)
    return np.array([[shapes[:, :, i] @ column for i in range(len(columns))] for column in columns])
