"""The compiled loops of the explicit finite-element chain, in one file: numba's cache does not notice an edited callee.

u, v    nodes × 2 × bodies, displacements (m) at whole and velocities (m/s) at half steps, across and along the chain
Contacts 0 … N − 1 lie between body c and body c + 1; the last one, N, is with a rigid wall, if any.
"""

from typing import NamedTuple

import numpy as np

from structures.kernels.kernel_cache import njit

LANES = 8
"""Bodies that one instruction may move."""

TOGETHER = 3
"""Blocks of a row that are multiplied at once; rows hold a multiple of this number."""

FINISHED, NON_FINITE, TOO_WIDE = 0, 1, 2


class Model(NamedTuple):
    """All that does not change during a run; see particles.deformable.explicit_beads.ExplicitBead."""

    starts: np.ndarray
    columns: np.ndarray
    blocks: np.ndarray
    mass: np.ndarray
    held: np.ndarray
    struck: np.ndarray
    facing: np.ndarray
    drop: np.ndarray
    near: np.ndarray


class Saved(NamedTuple):
    """Saved arrays: times × bodies, times × contacts, or times alone. closing, J: what nodes lost as they closed."""

    displacement: np.ndarray
    velocity: np.ndarray
    contact_force: np.ndarray
    section_force: np.ndarray
    vibration: np.ndarray
    kinetic: np.ndarray
    strain: np.ndarray
    closing: np.ndarray


@njit(cache=True, fastmath={"contract"})
def run(model, u, v, step, stride, bodies, wall, saved):
    """Do all steps of a run; every `stride`-th (odd) is saved. Forces are means over the stride about the saved
    step.

    Contact forces come with zeros. Returns FINISHED, NON_FINITE or TOO_WIDE, where the outermost node touches.
    """
    rows, half = saved.closing.size, stride // 2
    pull, kick = np.empty((2, u.shape[2])), np.empty((model.mass.size, 2))
    for i in range(model.mass.size):
        kick[i, 0] = 0.0 if model.held[i] else step / model.mass[i]
        kick[i, 1] = step / model.mass[i]
    earlier, predicted = np.empty(v.shape), np.empty(v.shape)
    momentum = np.zeros(u.shape[2])
    for i in range(model.mass.size):
        for b in range(bodies):
            momentum[b] += model.near[i] * model.mass[i] * v[i, 1, b]
    gaps, awake, lost = _gaps(model, u, v, step, bodies), min(2, bodies), 0.0
    for now in range((rows - 1) * stride + half + 1):
        row, phase = (now + half) // stride, (now + half) % stride
        lanes = min((awake + LANES - 1) // LANES * LANES, u.shape[2])
        if phase == half:
            _copy(v, earlier)
        _accelerate(model.starts, model.columns, model.blocks, kick, u, v, pull, lanes)
        if phase == half:
            _copy(v, predicted)
        reached, loss = _touch(model, u, v, step, 1.0 / stride, awake, bodies, wall, gaps, saved.contact_force[row])
        if reached < 0:
            return TOO_WIDE
        lost += loss
        if phase == half:
            saved.closing[row] = lost - 0.5 * loss
            _save(model, u, earlier, predicted, v, step, row, bodies, saved)
            if not np.isfinite(saved.strain[row]):
                return NON_FINITE
        if phase == stride - 1:
            _save_section(model, v, momentum, stride * step, row, bodies, saved)
        for i in range(u.shape[0]):
            for b in range(lanes):
                u[i, 0, b] += step * v[i, 0, b]
                u[i, 1, b] += step * v[i, 1, b]
        awake = max(awake, reached)
    return FINISHED


@njit(cache=True)
def _copy(source, target):
    """Fill an array with another: Numba compiles loops sooner than it does slices."""
    for i in range(source.shape[0]):
        for d in range(source.shape[1]):
            for b in range(source.shape[2]):
                target[i, d, b] = source[i, d, b]


@njit(cache=True, fastmath={"contract"})
def _accelerate(starts, columns, blocks, kick, u, v, pull, lanes):
    """Let v −= h M⁻¹ K u, three blocks at a time: their sums are then loaded and stored a third as often."""
    across, along = pull[0], pull[1]
    for i in range(starts.size - 1):
        for b in range(lanes):
            across[b] = along[b] = 0.0
        for k in range(starts[i], starts[i + 1], TOGETHER):
            x, y, z = columns[k], columns[k + 1], columns[k + 2]
            xrr, xrz, xzr, xzz = blocks[k, 0, 0], blocks[k, 0, 1], blocks[k, 1, 0], blocks[k, 1, 1]
            yrr, yrz, yzr, yzz = blocks[k + 1, 0, 0], blocks[k + 1, 0, 1], blocks[k + 1, 1, 0], blocks[k + 1, 1, 1]
            zrr, zrz, zzr, zzz = blocks[k + 2, 0, 0], blocks[k + 2, 0, 1], blocks[k + 2, 1, 0], blocks[k + 2, 1, 1]
            for b in range(lanes):
                xr, xz, yr, yz, zr, zz = u[x, 0, b], u[x, 1, b], u[y, 0, b], u[y, 1, b], u[z, 0, b], u[z, 1, b]
                across[b] += xrr * xr + xrz * xz + yrr * yr + yrz * yz + zrr * zr + zrz * zz
                along[b] += xzr * xr + xzz * xz + yzr * yr + yzz * yz + zzr * zr + zzz * zz
        for b in range(lanes):
            v[i, 0, b] -= kick[i, 0] * across[b]
            v[i, 1, b] -= kick[i, 1] * along[b]


@njit(cache=True)
def _touch(model, u, v, step, share, awake, bodies, wall, before, forces):
    """Return the multipliers that close each predicted overlap of two nodes that face each other, and the velocities
    they leave.

    Adds their `share` to the contacts' forces. before: gaps a step ago, m. Returns how many bodies are awake, −1 where
    the outermost node touches, and what the nodes lost, J: multiplier times half the change of the gap in two steps.
    """
    reached, lost, last = awake, 0.0, model.drop.size - 1
    for c in range(min(awake, bodies if wall else bodies - 1)):
        rigid = c + 1 == bodies
        for k in range(last + 1):
            i, j = model.facing[k], model.struck[k]
            gap, rate = model.drop[k] - u[i, 1, c], -v[i, 1, c]
            compliance = 1.0 / model.mass[i]
            if not rigid:
                gap += model.drop[k] + u[j, 1, c + 1]
                rate += v[j, 1, c + 1]
                compliance += 1.0 / model.mass[j]
            overlap, earlier = -(gap + step * rate), before[c, k]
            before[c, k] = gap
            if overlap <= 0.0:
                continue
            if k == last:
                return -1, lost
            force = overlap / (step * step * compliance)
            v[i, 1, c] -= step * force / model.mass[i]
            if not rigid:
                v[j, 1, c + 1] += step * force / model.mass[j]
                reached = max(reached, min(c + 3, bodies))
            forces[c] += share * force
            lost += 0.5 * force * earlier
    return reached, lost


@njit(cache=True)
def _gaps(model, u, v, step, bodies):
    """Return the gaps between nodes that face each other, a step before the first, m; the last contact's are those of
    the wall."""
    gaps = np.empty((bodies, model.drop.size))
    for c in range(bodies):
        for k in range(model.drop.size):
            i, j = model.facing[k], model.struck[k]
            gaps[c, k] = model.drop[k] - u[i, 1, c] + step * v[i, 1, c]
            if c + 1 < bodies:
                gaps[c, k] += model.drop[k] + u[j, 1, c + 1] - step * v[j, 1, c + 1]
    return gaps


@njit(cache=True)
def _save(model, u, earlier, predicted, v, step, row, bodies, saved):
    """Return the motions and energies of each body at a whole step; products of both neighbouring half steps, as they
    are kept.

    Kinetic: the mean of v⁻M v⁻/2 and v⁺M v⁺/2. Strain: u K (u⁻ + u⁺)/4 with the displacements a step before and after.
    """
    for b in range(bodies):
        total = place = before = after = kinetic = strain = 0.0
        for i in range(model.mass.size):
            mass = model.mass[i]
            total += mass
            place += mass * u[i, 1, b]
            before += mass * earlier[i, 1, b]
            after += mass * v[i, 1, b]
            for d in range(2):
                kinetic += 0.25 * mass * (earlier[i, d, b] ** 2 + v[i, d, b] ** 2)
                elastic = mass * (earlier[i, d, b] - predicted[i, d, b]) / step
                strain += 0.5 * elastic * (u[i, d, b] + 0.5 * step * (v[i, d, b] - earlier[i, d, b]))
        rigid = 0.25 * (before**2 + after**2) / total
        saved.displacement[row, b] = place / total
        saved.velocity[row, b] = 0.5 * (before + after) / total
        saved.kinetic[row] += kinetic
        saved.strain[row] += strain
        saved.vibration[row, b] = kinetic + strain - rigid


@njit(cache=True)
def _save_section(model, v, momentum, span, row, bodies, saved):
    """Save the mean force through each mid-plane: what the contact gives the struck half, less what that keeps."""
    for b in range(bodies):
        now = 0.0
        for i in range(model.mass.size):
            now += model.near[i] * model.mass[i] * v[i, 1, b]
        pushed = saved.contact_force[row, b - 1] if b > 0 else 0.0
        saved.section_force[row, b] = pushed - (now - momentum[b]) / span
        momentum[b] = now
