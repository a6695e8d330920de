"""A mobility as a sum of damped modes with positive masses: vector fitting finds them, least squares sharpens them.

Such a sum is stable and passive by its form. scikit-rf's vector fitting takes 8 to 54 s where this takes 1 to 4 s (1600
frequencies, 40 to 70 modes), and it weighs antiresonances, where a contact feels the body most, far less.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares, nnls
from scipy.signal import find_peaks

from structures.linear_algebra.one_thread import one_thread

Vector = NDArray[np.float64]
Complex = NDArray[np.complex128]

RELOCATIONS = 12
"""Times that vector fitting moves the poles."""

FIRST_RATIO, LEAST_RATIO, LARGEST_RATIO = 0.01, 1e-5, 0.5
"""Damping ratios: of the poles at the start, and between which those of modes lie."""

LOWEST, HIGHEST = 0.3, 1.5
"""Modes may lie outside of the band by these factors of its ends: they stand for what lies beyond."""

FEWEST_MODES, GROWTH, PATIENCE = 4, 1.25, 2
"""The least number of poles; by what it grows; and how often in vain once the fit is fair."""

PROMINENCE = 0.7
"""A resonance rises by this above its surroundings, in the logarithm of the mobility."""

FAIR, BETTER = 0.2, 0.9
"""The error of a fair fit; and the part to which one must fall to count as smaller."""

SMALLEST = 1e-4
"""Part of the largest mobility below which all numbers weigh as much."""

SHARPENINGS = 60
"""Most evaluations of the final least squares."""


class ModalFit(NamedTuple):
    """Modes of a mobility: ω, 1/s; damping ratios; φ², 1/kg; the compliance beyond them, m/N; 1/mass of a rigid motion,
    1/kg; and the root mean square of the relative error."""

    omega: Vector
    ratios: Vector
    square: Vector
    compliance: float
    rigid: float
    error: float

    def mobility(self, omega: Vector) -> Complex:
        """Return the mobility, m/(N s), at angular frequencies, 1/s."""
        resonant = _resonances(omega, self.omega, self.ratios) @ self.square
        return np.asarray(resonant + self.rigid / (1j * omega) + 1j * omega * self.compliance)


@one_thread
def fit_modes(omega: Vector, mobility: Complex, tolerance: float, most: int) -> ModalFit:
    """Return the modes of a mobility, at most about `most`, as many as its relative error needs to reach a tolerance or
    to fall no further."""
    top, size = float(omega.max()), np.abs(mobility)
    w, weight = omega / top, 1.0 / np.maximum(size, SMALLEST * size.max())
    peaks, _ = find_peaks(np.log(np.maximum(size, SMALLEST * size.max())), prominence=PROMINENCE)
    best, count, vain = None, min(max(FEWEST_MODES, peaks.size), most), 0
    while best is None or (best.error > tolerance and vain < PATIENCE and count <= min(most, w.size // 4)):
        fit = _fit(w, mobility, weight, count)
        vain = vain + 1 if best is not None and BETTER * best.error < fit.error and best.error < FAIR else 0
        best = fit if best is None or fit.error < best.error else best
        count = int(np.ceil(GROWTH * count))
    return best._replace(
        omega=top * best.omega, square=top * best.square, compliance=best.compliance / top, rigid=top * best.rigid
    )


def _fit(w: Vector, mobility: Complex, weight: Vector, count: int) -> ModalFit:
    """Return the fit by this number of poles; w: frequencies as parts of the highest."""
    poles = np.linspace(w[0], w[-1], count) * (1j - FIRST_RATIO)
    for _ in range(RELOCATIONS):
        moved = _relocated(w, mobility, weight, poles)
        if not moved.size:
            break
        poles = moved
    omega = np.abs(poles)
    poles = poles[(omega > LOWEST * w[0]) & (omega < HIGHEST)]
    omega, ratios = np.abs(poles), np.clip(-poles.real / np.abs(poles), 2.0 * LEAST_RATIO, LARGEST_RATIO)
    matrix = _terms(w, omega, ratios) * weight[:, None]
    scale = np.linalg.norm(matrix, axis=0)
    parts, _ = nnls(_real(matrix / scale), _real(mobility * weight), maxiter=50 * scale.size)
    used = np.append(parts[:-2] > 0.0, [True, True])
    return _sharpened(w, mobility, weight, omega[used[:-2]], ratios[used[:-2]], (parts / scale)[used])


def _relocated(w: Vector, mobility: Complex, weight: Vector, poles: Complex) -> Complex:
    """Return the zeros of σ where σ times the mobility has the given poles, as σ has, by relaxed vector fitting.

    Gustavsen, IEEE Trans. Power Deliv. 21 (2006) 1587; unstable zeros are mirrored, real ones dropped.
    """
    s, n = 1j * w[:, None], 2 * poles.size
    pair = [1.0 / (s - poles), 1.0 / (s - poles.conj())]
    fractions = np.stack([pair[0] + pair[1], 1j * (pair[0] - pair[1])], axis=2).reshape(w.size, n)
    unknown = np.hstack([fractions, s, 1.0 / s, -mobility[:, None] * fractions, -mobility[:, None]]) * weight[:, None]
    # σ must not vanish: the sum of its real parts is that of ones.
    relaxed, size = np.zeros(unknown.shape[1]), float(np.linalg.norm(weight * mobility)) / w.size
    relaxed[n + 2 : 2 * n + 2], relaxed[-1] = size * fractions.sum(axis=0).real, size * w.size
    matrix = np.vstack([_real(unknown), relaxed])
    right = np.zeros(len(matrix))
    right[-1] = size * w.size
    scale = np.linalg.norm(matrix, axis=0)
    solution = np.linalg.lstsq(matrix / scale, right, rcond=None)[0] / scale
    residues, constant = solution[n + 2 : 2 * n + 2], float(solution[-1])
    constant = constant if abs(constant) > 1e-8 else 1e-8
    state, drive = np.zeros((n, n)), np.zeros(n)
    for k, pole in enumerate(poles):
        state[2 * k : 2 * k + 2, 2 * k : 2 * k + 2] = [[pole.real, pole.imag], [-pole.imag, pole.real]]
        drive[2 * k] = 2.0
    zeros = np.linalg.eigvals(state - np.outer(drive, residues) / constant)
    upper = zeros[zeros.imag > 1e-9 * np.abs(zeros)]
    return np.asarray(1j * upper.imag - np.abs(upper.real))


def _sharpened(w: Vector, mobility: Complex, weight: Vector, omega: Vector, ratios: Vector, parts: Vector) -> ModalFit:
    """Return the modes after least squares in the logarithms of ω and ζ and the roots of all parts."""
    n = omega.size

    def unpacked(x: Vector) -> tuple[Vector, Vector, Vector]:
        return np.exp(np.clip(x[:n], -20.0, 1.0)), LEAST_RATIO + np.exp(np.minimum(x[n : 2 * n], 0.0)), x[2 * n :]

    def difference(x: Vector) -> Vector:
        at, damping, roots = unpacked(x)
        return _real(((_terms(w, at, damping) @ roots**2 - mobility) * weight)[:, None]).reshape(-1)

    def slopes(x: Vector) -> Vector:
        at, damping, roots = unpacked(x)
        terms, s = _terms(w, at, damping), 1j * w[:, None]
        pull = -(terms[:, :n] ** 2) / s * roots[:n] ** 2
        by_frequency, by_damping = (
            pull * (2.0 * at + 2.0 * damping * s) * at,
            pull * 2.0 * at * s * (damping - LEAST_RATIO),
        )
        return _real(np.hstack([by_frequency, by_damping, 2.0 * terms * roots]) * weight[:, None])

    start = np.concatenate([np.log(omega), np.log(ratios - LEAST_RATIO), np.sqrt(parts)])
    found = least_squares(difference, start, slopes, x_scale="jac", max_nfev=SHARPENINGS)
    at, damping, roots = unpacked(found.x)
    error = float(np.sqrt(2.0 * found.cost / w.size))
    return ModalFit(at, damping, roots[:n] ** 2, float(roots[-1] ** 2), float(roots[-2] ** 2), error)


def _resonances(w: Vector, omega: Vector, ratios: Vector) -> Complex:
    """Return the mobilities of modes of φ = 1, frequencies × modes."""
    s = 1j * w[:, None]
    return np.asarray(s / (omega**2 + s**2 + 2.0 * ratios * omega * s))


def _terms(w: Vector, omega: Vector, ratios: Vector) -> Complex:
    """Return the mobilities of modes, of a rigid motion, and of a spring."""
    s = 1j * w[:, None]
    return np.hstack([_resonances(w, omega, ratios), 1.0 / s, s])


def _real(matrix: Any) -> Vector:
    """Return real parts above imaginary parts."""
    return np.concatenate([matrix.real, matrix.imag])
