"""Krylov reduction: a large structure becomes a few hundred oscillators with the same response at the contact."""

from collections.abc import Callable, Mapping
from copy import deepcopy
from dataclasses import replace
from functools import partial
from hashlib import sha256
from typing import Annotated, Any

import numpy as np
from scipy import sparse
from scipy.linalg import eigh

from structures.caution import caution
from structures.checks import instance
from structures.described import checked_call
from structures.field import Field
from structures.fineness import fineness
from structures.krylov import DEFAULT_PULSE, Krylov, Modes, expansion_point
from structures.linear_algebra.one_thread import one_thread
from structures.maxwell import with_arms
from structures.quantities import Likely, Quantity, Several
from structures.structure import Structure, Vector, known_field
from structures.unmeshed import is_left_out

PULSE_RANGE = (1e-12, 1e3)
"""Shortest and longest pulse, s: the numbers in between are far from the limits of floating point."""

PULSE_HALVINGS = 3
"""The error is also estimated for a half, a quarter and an eighth of the pulse length: runs interpolate between them.
"""

WEIGHT_DECAY = 4.0
"""The error is weighted with e^(−4 t/until) in time: the contact meets the first echoes, not the last ones."""

VECTORS_PER_BLOCK = 10
"""Vectors for each contact between two estimates of the error: few enough not to overshoot the size that is needed."""

LEAST_ARM_STIFFNESS = 1e-14
"""A direction gets no arm if the stiffness of the arm there is below this fraction of its largest stiffness."""

MOST_VECTORS, MOST_KEPT = 600, 8
"""Default limit of the basis: dense matrices of this size are diagonalised in about a second. And the number of
structures whose oscillators are kept: a fit comes back to the latest."""


@checked_call
@one_thread
def reduce(
    structure: Structure,
    until: Annotated[float, Likely.TIME],
    tolerance: Annotated[float, Quantity()] = 1e-2,
    largest: Several = MOST_VECTORS,
    keep_field: bool = False,
    pulse: Annotated[float, replace(Likely.TIME, low=PULSE_RANGE[0], high=PULSE_RANGE[1])] | None = None,
) -> Structure:
    """Reduce a structure to oscillators (M = I, K diagonal) with the same motion of the contact points.

    The basis holds Lanczos vectors of (K + s²M)⁻¹M, started from (K + s²M)⁻¹b and M-orthogonalised twice; each contact
    starts a vector of its own. Damping that is no sum of M and K takes second-order Arnoldi vectors instead. K is
    projected on the basis and diagonalised, and a damping matrix is projected on the same basis. Rayleigh damping stays
    diagonal, so each oscillator has its own damping. Maxwell arms are kept, for each relaxation time at most as many as
    there are oscillators; they are massless, and K couples them to the oscillators.
    A structure that equals one of the latest is not reduced again, so a fit of the chain reduces its plate once.

    Parameters
    ----------
    structure : Structure
        The structure to reduce. A structure without mass has no oscillators and is returned unchanged.
    until : float
        Length of the longest run, s. The reduced structure is valid up to this time only: later its waves differ from
        those of the full structure.
    tolerance : float
        Relative error of the contact's displacement after a force pulse, in the mean square over time with the weight
        e^(−4 t/until). With several contacts the error of each pair counts, in units of the geometric mean of the two
        direct responses, and the largest decides. The error is estimated by the change over the last ten vectors (for
        each contact); the estimate determines the size and is stored in `origin["reduction"]["error_estimate"]`.
    largest : int
        Largest number of vectors. A warning is issued if they do not reach the tolerance.
    keep_field : bool
        Keep the data from which displacement and stress of the whole body are recovered, for `motion`: 8
        bytes for each degree of freedom and oscillator.
    pulse : float, optional
        Length of the pulse, s: a contact time. By default 25 µs, which suits steel beads of 4 mm diameter or more; for
        contacts below 10 µs a run reduces the structure anew, by a shorter pulse, if hertzlink built it. A run
        looks up the error for its own contact time, and warns if it exceeds twice the tolerance.

    Returns
    -------
    Structure
        The oscillators, and their Maxwell arms after them.

    Raises
    ------
    ValueError
        If an argument is out of range, the structure has already been reduced for shorter runs, or it has no field
        although keep_field is True.

    Notes
    -----
    Amplitude ratios converge much earlier (tests): a tolerance of 1e-2 leaves them within 0.01 % of those without
    reduction. If only some layers have arms, an estimate below 1e-3 may be too small by a factor of five.

    References
    ----------
    Bai, Appl. Numer. Math. 43 (2002) 9; with damping: Bai and Su, SIAM J. Matrix Anal. Appl. 26 (2005) 640.

    Examples
    --------
    >>> import hertzlink as hl
    >>> plate = hl.kirchhoff_plate(0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> full = plate.at(0.1, 0.1)
    >>> small = hl.reduce(full, until=0.5e-3)
    >>> small.size < 150 < full.size, small.valid_until
    (True, 0.0005)
    """
    if is_left_out(instance("structure", structure, Structure, "a Structure")):
        return structure
    arguments = until, tolerance, largest, keep_field, pulse
    pulse = DEFAULT_PULSE / fineness().shorter if pulse is None else pulse
    if (part := fineness().tolerance) < 1.0:
        tolerance, largest = part * tolerance, max(largest, MOST_VECTORS)
    if until > structure.valid_until:
        raise ValueError(f"until = {until!r}: the structure was reduced for runs of at most {structure.valid_until} s")
    field = known_field(structure) if keep_field else None
    if structure.mass.count_nonzero() == 0:
        return structure
    if field is None:
        modes, report = _latest(structure, until, tolerance, largest, pulse)
    else:
        modes, report, krylov = _computed(structure, until, tolerance, largest, pulse)
        field = field.in_basis(krylov.shapes(modes))
    if (estimate := report["error_estimate"]) > tolerance:
        caution(f"reduction: {largest} vectors leave an error of {estimate:.1e}; raise largest or tolerance")
    reduced = _made_of(modes, structure, report, until, field)
    return reduced if structure.again is None else reduced.made_by(partial(_reduced_again, structure.again, arguments))


def _reduced_again(again: Callable[[], Structure], arguments: tuple[Any, ...]) -> Structure:
    return reduce(again(), *arguments)


_LATEST: dict[bytes, tuple["Modes", dict[str, Any]]] = {}
"""The oscillators of the latest structures, and what results hold of them, by all numbers on which they depend."""


def _latest(
    structure: Structure, until: float, tolerance: float, largest: int, pulse: float
) -> tuple["Modes", dict[str, Any]]:
    """Return the oscillators of a structure and the report: those of an equal one that was reduced lately."""
    content = sha256(f"{until} {tolerance} {largest} {pulse} {structure.contacts}".encode())
    for matrix in (structure.mass, structure.stiffness, structure.damping):
        for part in () if matrix is None else (matrix.indptr, matrix.indices, matrix.data):
            content.update(f"{part.size} {part.dtype}".encode())
            content.update(part.tobytes())
    content.update(structure.contact.tobytes())
    key = content.digest()
    if (known := _LATEST.get(key)) is None:
        modes, report, _ = _computed(structure, until, tolerance, largest, pulse)
        known = modes._replace(vectors=np.empty((0, 0))), report
        for old in list(_LATEST)[: 1 - MOST_KEPT]:
            _LATEST.pop(old, None)  # another thread may have forgotten it meanwhile
        _LATEST[key] = known
    return known[0], deepcopy(known[1])


def _computed(
    structure: Structure, until: float, tolerance: float, largest: int, pulse: float
) -> tuple["Modes", dict[str, Any], "Krylov"]:
    """Return the oscillators, what results hold of the reduction, and the basis."""
    krylov = Krylov(structure, min(largest, structure.size), expansion_point(pulse))
    before, modes, estimate = None, None, np.inf
    while estimate > tolerance and krylov.grow(VECTORS_PER_BLOCK * structure.contacts):
        before, modes = modes, krylov.oscillators()
        if before is not None:
            estimate = _estimate(before, modes, until, pulse)
        if krylov.exhausted:
            estimate = 0.0
    modes = krylov.oscillators() if modes is None else modes
    report: dict[str, Any] = {"full_size": structure.size, "until": until, "tolerance": tolerance, "pulse": pulse}
    report |= {"largest": largest, "error_estimate": estimate}
    if before is not None and estimate > 0.0:
        shorter = [pulse / 2.0**i for i in range(1, PULSE_HALVINGS + 1)]
        report["shorter_pulses"] = [(length, _estimate(before, modes, until, length)) for length in shorter]
    return modes, report, krylov


def _made_of(modes: Modes, full: Structure, report: dict[str, Any], until: float, field: Field | None) -> Structure:
    """Return the reduced structure: oscillators, followed by their Maxwell arms."""
    roots = [_root(stretch) for _, stretch in modes.arms]
    size = modes.square.size + sum(root.shape[0] for root in roots)
    reduced = Structure(
        sparse.csr_array(sparse.eye_array(modes.square.size)),
        sparse.csr_array(sparse.diags_array(modes.square)),
        None if modes.damping is None else _matrix(modes.damping),
        modes.contact.reshape(-1, *full.contact.shape[1:]).copy(),
        full.flexibility,
        full.surface,
        {**full.origin, "reduction": {"size": size, **report}},
        until,
        field,
    )
    for (time, _), root in zip(modes.arms, roots, strict=True):
        reduced = with_arms(reduced, root, time)
    return reduced


def _matrix(values: Vector) -> sparse.csr_array:
    return sparse.csr_array(sparse.diags_array(values) if values.ndim == 1 else values)


def _root(stretch: Vector) -> sparse.csr_array:
    """Return R with RᵀR = stretch, one row for each direction with stiffness."""
    values, vectors = (stretch, np.eye(stretch.size)) if stretch.ndim == 1 else eigh(stretch)
    positive = values > LEAST_ARM_STIFFNESS * values.max()
    return sparse.csr_array(np.sqrt(values[positive])[:, None] * vectors[:, positive].T)


def change(previous: Vector, answer: Vector) -> float:
    """Return the largest change of the responses, p × p × frequencies, each in units of the direct responses of its two
    contacts."""
    sizes = [np.linalg.norm(answer[i, i]) for i in range(len(answer))]
    pairs = [(i, j) for i in range(len(answer)) for j in range(i + 1)]
    return max(float(np.linalg.norm(answer[i, j] - previous[i, j]) / np.sqrt(sizes[i] * sizes[j])) for i, j in pairs)


def error_for_pulse(report: Mapping[str, Any], length: float) -> float:
    """Return the estimated error for a force pulse of a length, s, from `origin["reduction"]` of a reduced structure.

    Between the pulses of the estimates the error is a power of the length; beyond them the nearest counts.
    """
    first = report["pulse"], report["error_estimate"]
    lengths, errors = np.array(sorted(map(tuple, [first, *report.get("shorter_pulses", [])]))).T
    if length <= lengths[0]:
        return float(errors[0])
    return float(np.exp(np.interp(np.log(length), np.log(lengths), np.log(np.maximum(errors, 1e-300)))))


def _estimate(before: Modes, modes: Modes, until: float, length: float) -> float:
    """Return the change of the displacement after a pulse of a length, s, from fewer vectors to more."""
    return change(*(pulse_answer(basis, until, length) for basis in (before, modes)))


def pulse_answer(modes: Modes, until: float, length: float) -> Vector:
    """Return the Laplace transform, at σ + iω, of the displacements of the contacts after a raised-cosine pulse of a
    length, s, on each.

    By Parseval's theorem its norm is that of e^(−σt) w(t) over time.
    """
    s = WEIGHT_DECAY / until + 1j * np.linspace(0.0, 8.0 * np.pi / length, 500)
    turn = 2.0 * np.pi / length
    pulse = (1.0 - np.exp(-s * length)) * turn**2 / (s * (s**2 + turn**2))
    answer: Vector = _receptance(modes, s) * pulse
    return answer


def _receptance(modes: Modes, s: Any) -> Any:
    """Return the displacement of each contact for a unit force on each, p × p × the complex frequencies s, m/N."""
    terms = [] if modes.damping is None else [(s, modes.damping)]
    terms += [(s * time / (1.0 + s * time), stretch) for time, stretch in modes.arms]
    columns = modes.contact.T
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
