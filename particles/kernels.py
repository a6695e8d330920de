"""All compiled loops of the chain, in one file: numba's cache does not notice an edited callee in another.

Arrays, with N beads behind the striker:
    y, v     N + 1   positions (m) and velocities of striker and beads; y is measured from touching, unloaded beads,
                     so the approach of a contact is δᵢ = yᵢ₋₁ − yᵢ, and that of the last one y_N − w
    m⁻¹      N + 1   inverse masses
    k, γ     N + 1   stiffness and dashpot of the contacts 1 … N + 1, stored from 0; the last one is with the structure
    g                gravity along the chain; f the structure's flexibility
The structure's surface is at w and moves at a constant rate during a window.
"""

from math import sqrt

import numpy as np
from numba import njit

VERLET, DASHPOT_VERLET, RK4 = 0, 1, 2

NEGLIGIBLE = 1e-60
"""m. The front of a solitary wave falls off doubly exponentially; below this it would end in slow subnormal numbers."""

OK, NON_FINITE, NOT_CONVERGED = 0, 1, 2


@njit(cache=True, inline="always")
def _hertz(stiffness, approach):
    overlap = approach if approach > NEGLIGIBLE else 0.0
    return stiffness * overlap * sqrt(overlap)


@njit(cache=True)
def _hertz_on_spring(stiffness, approach, flexibility):
    """Force of Hertz's contact in series with a linear spring: δ = δ_h + f k δ_h^1.5, by Newton."""
    if approach <= NEGLIGIBLE or flexibility == 0.0:
        return _hertz(stiffness, approach)
    overlap = approach
    for _ in range(50):
        root = stiffness * flexibility * sqrt(overlap)
        change = (overlap + root * overlap - approach) / (1.0 + 1.5 * root)
        overlap -= change
        if not abs(change) > 1e-15 * overlap:
            break
    return _hertz(stiffness, overlap)


@njit(cache=True, fastmath={"contract"}, inline="always")
def _kick_drift(y, v, inverse_mass, stiffness, gravity, wall_force, kick, drift):
    """v += kick · a(y); y += drift · v, in one pass that the compiler turns into vector instructions."""
    last = y.size - 1
    behind = 0.0
    for i in range(last):
        approach = y[i] - y[i + 1]
        overlap = approach if approach > NEGLIGIBLE else 0.0
        ahead = stiffness[i] * overlap * sqrt(overlap)
        v[i] += kick * (inverse_mass[i] * (behind - ahead) + gravity)
        y[i] += drift * v[i]
        behind = ahead
    v[last] += kick * (inverse_mass[last] * (behind - wall_force) + gravity)
    y[last] += drift * v[last]


@njit(cache=True, fastmath={"contract"})
def _verlet(y, v, inverse_mass, stiffness, gravity, flexibility, wall, rate, dt, steps):
    """Velocity Verlet over one window, its inner half-kicks joined. Returns the impulse on the structure."""
    last = y.size - 1
    impulse = 0.0
    for step in range(steps + 1):
        kick = dt if 0 < step < steps else 0.5 * dt
        # Before the pass: after it, the scalar load would wait for the pass's vector stores.
        wall_force = _hertz_on_spring(stiffness[last], y[last] - (wall + step * dt * rate), flexibility)
        impulse += kick * wall_force
        _kick_drift(y, v, inverse_mass, stiffness, gravity, wall_force, kick, dt if step < steps else 0.0)
    return impulse


@njit(cache=True)
def _accelerate(y, v, inverse_mass, stiffness, dashpot, gravity, flexibility, wall, rate, a):
    """Accelerations into a. Returns the force on the structure and the power that the dashpots take."""
    last = y.size - 1
    behind = 0.0
    power = 0.0
    for i in range(last + 1):
        if i < last:
            approach, approach_rate = y[i] - y[i + 1], v[i] - v[i + 1]
            elastic = _hertz(stiffness[i], approach)
        else:
            approach, approach_rate = y[i] - wall, v[i] - rate
            elastic = _hertz_on_spring(stiffness[i], approach, flexibility)
        ahead = elastic
        if approach >= 0.0:  # a striker that just touches pushes its dashpot at once
            ahead = max(elastic + dashpot[i] * approach_rate, 0.0)
            power += (ahead - elastic) * approach_rate
        a[i] = inverse_mass[i] * (behind - ahead) + gravity
        behind = ahead
    return behind, power


@njit(cache=True)
def _dashpot_verlet(y, v, inverse_mass, stiffness, dashpot, gravity, flexibility, wall, rate, dt, steps):
    """Velocity Verlet whose dashpots see the velocity foretold for the step's end: second order."""
    a, half = np.empty_like(y), np.empty_like(y)
    force, power = _accelerate(y, v, inverse_mass, stiffness, dashpot, gravity, flexibility, wall, rate, a)
    impulse, lost = 0.5 * dt * force, 0.5 * dt * power
    for step in range(1, steps + 1):
        for i in range(y.size):
            half[i] = v[i] + 0.5 * dt * a[i]
            v[i] = half[i] + 0.5 * dt * a[i]
            y[i] += dt * half[i]
        at = wall + step * dt * rate
        force, power = _accelerate(y, v, inverse_mass, stiffness, dashpot, gravity, flexibility, at, rate, a)
        for i in range(y.size):
            v[i] = half[i] + 0.5 * dt * a[i]
        weight = dt if step < steps else 0.5 * dt
        impulse += weight * force
        lost += weight * power
    return impulse, lost


@njit(cache=True)
def _rk4(y, v, inverse_mass, stiffness, dashpot, gravity, flexibility, wall, rate, dt, steps):
    """The classical Runge–Kutta method of order four; impulse and loss are integrated with the same weights."""
    a, sum_a, sum_v = np.empty_like(y), np.empty_like(y), np.empty_like(y)
    stage_y, stage_v = np.empty_like(y), np.empty_like(y)
    impulse, lost = 0.0, 0.0
    for step in range(steps):
        stage_y[:], stage_v[:] = y, v
        sum_a[:], sum_v[:] = 0.0, 0.0
        for stage in range(4):
            ahead = (0.0, 0.5, 0.5, 1.0)[stage] * dt
            weight = (1.0, 2.0, 2.0, 1.0)[stage] * dt / 6.0
            if stage > 0:
                for i in range(y.size):
                    stage_y[i] = y[i] + ahead * stage_v[i]
                    stage_v[i] = v[i] + ahead * a[i]
            at = wall + (step * dt + ahead) * rate
            force, power = _accelerate(
                stage_y, stage_v, inverse_mass, stiffness, dashpot, gravity, flexibility, at, rate, a
            )
            impulse += weight * force
            lost += weight * power
            for i in range(y.size):
                sum_v[i] += weight * stage_v[i]
                sum_a[i] += weight * a[i]
        for i in range(y.size):
            y[i] += sum_v[i]
            v[i] += sum_a[i]
    return impulse, lost


@njit(cache=True)
def advance(y, v, chain, method, steps, window, wall_start, wall_end):
    """Moves y, v on by one window in place. Returns the mean force on the structure and the energy lost.

    chain = (m⁻¹, k, γ, g, f)."""
    inverse_mass, stiffness, dashpot, gravity, flexibility = chain
    dt, rate = window / steps, (wall_end - wall_start) / window
    lost = 0.0
    if method == VERLET:
        impulse = _verlet(y, v, inverse_mass, stiffness, gravity, flexibility, wall_start, rate, dt, steps)
    elif method == DASHPOT_VERLET:
        impulse, lost = _dashpot_verlet(
            y, v, inverse_mass, stiffness, dashpot, gravity, flexibility, wall_start, rate, dt, steps
        )
    else:
        impulse, lost = _rk4(y, v, inverse_mass, stiffness, dashpot, gravity, flexibility, wall_start, rate, dt, steps)
    return impulse / window, lost


@njit(cache=True)
def advance_condensed(y, v, chain, method, steps, window, wall_start, wall_free, compliance, static, guess, tolerance):
    """One window against a linear structure whose surface ends at w = wall_free + compliance · (F̄ − static).

    The secant method on F̄ from guess = (F̄ − static, slope), which is updated: the residual falls at least as fast as F̄
    rises, so its slope is −1 or steeper and nothing is divided by zero, an open gap included. y, v in place.
    Returns the mean force, the energy lost, the evaluations and the residual.
    """
    start_y, start_v = y.copy(), v.copy()
    tried, slope = guess[0] + static, guess[1]
    last_tried, last_residual, residual = 0.0, 0.0, np.inf
    for count in range(1, 31):
        if count > 1:
            y[:], v[:] = start_y, start_v
        wall_end = wall_free + compliance * (tried - static)
        force, lost = advance(y, v, chain, method, steps, window, wall_start, wall_end)
        residual = force - tried
        if not abs(residual) > tolerance or compliance == 0.0:
            break
        if count > 1:
            slope = min((residual - last_residual) / (tried - last_tried), -1.0)
        last_tried, last_residual = tried, residual
        tried -= residual / slope
    guess[0], guess[1] = force - static, slope
    return force, lost, count, 0.0 if compliance == 0.0 else residual


@njit(cache=True)
def contact_forces(y, v, chain, wall, rate, out):
    """Instantaneous forces of all contacts into out."""
    _, stiffness, dashpot, _, flexibility = chain
    last = y.size - 1
    for i in range(last + 1):
        approach = y[i] - (y[i + 1] if i < last else wall)
        approach_rate = v[i] - (v[i + 1] if i < last else rate)
        out[i] = _hertz_on_spring(stiffness[i], approach, flexibility if i == last else 0.0)
        if approach >= 0.0:
            out[i] = max(out[i] + dashpot[i] * approach_rate, 0.0)


@njit(cache=True)
def energies(y, v, chain, wall):
    """Kinetic energy, and the potential energy of contacts and gravity, J."""
    inverse_mass, stiffness, _, gravity, flexibility = chain
    last = y.size - 1
    kinetic, potential = 0.0, 0.0
    for i in range(last + 1):
        kinetic += 0.5 * v[i] * v[i] / inverse_mass[i]
        approach = y[i] - (y[i + 1] if i < last else wall)
        spring = flexibility if i == last else 0.0
        force = _hertz_on_spring(stiffness[i], approach, spring)
        overlap = approach - spring * force
        potential += 0.4 * force * max(overlap, 0.0) + 0.5 * spring * force * force - gravity * y[i] / inverse_mass[i]
    return kinetic, potential


@njit(cache=True)
def first_bad(y, v, wall):
    """Index of the first bead whose state is not finite; N + 1 where only the surface is not; −1 where all is well."""
    for i in range(y.size):
        if not (np.isfinite(y[i]) and np.isfinite(v[i])):
            return i
    return -1 if np.isfinite(wall) else y.size


@njit(cache=True)
def run_on_oscillators(y, v, chain, method, steps, window, static, tolerance, stride, modes, frames):
    """The whole window loop of a chain on oscillators, one frame every `stride` windows.

    modes = (rows, response u, response v, b, ω²), see structures.stepping.Oscillators.
    frames = (y, v, contact forces, w, kinetic, potential, structure, lost, work, evaluations), row 0 the start.
    Returns (OK, …), or what went wrong, in which window, and the bead or the residual.
    """
    rows, response_u, response_v, contact, square = modes
    out_y, out_v, out_force, out_wall, out_kinetic, out_potential, out_structure, out_lost, out_work, out_count = frames
    n = contact.size
    u, p = np.zeros(n), np.zeros(n)
    compliance = 0.0
    for i in range(n):
        compliance += contact[i] * response_u[i]
    guess = np.array([0.0, -1.0])
    wall, total_lost, work, evaluations = 0.0, 0.0, 0.0, 0
    for done in range(1, (out_wall.size - 1) * stride + 1):
        wall_free = 0.0
        for i in range(n):
            at, rate = u[i], p[i]
            u[i] = rows[0, i] * at + rows[1, i] * rate
            p[i] = rows[2, i] * at + rows[3, i] * rate
            wall_free += contact[i] * u[i]
        force, lost, count, residual = advance_condensed(
            y, v, chain, method, steps, window, wall, wall_free, compliance, static, guess, tolerance
        )
        before, wall = wall, 0.0
        for i in range(n):
            u[i] += (force - static) * response_u[i]
            p[i] += (force - static) * response_v[i]
            wall += contact[i] * u[i]
        bad = first_bad(y, v, wall)
        if bad >= 0:
            return NON_FINITE, done, float(bad)
        if abs(residual) > tolerance:
            return NOT_CONVERGED, done, residual
        total_lost += lost
        work += (force - static) * (wall - before)
        evaluations += count
        if done % stride == 0:
            row = done // stride
            out_y[row], out_v[row], out_wall[row] = y, v, wall
            contact_forces(y, v, chain, wall, (wall - before) / window, out_force[row])
            out_kinetic[row], out_potential[row] = energies(y, v, chain, wall)
            for i in range(n):
                out_structure[row] += 0.5 * (p[i] * p[i] + square[i] * u[i] * u[i])
            out_lost[row], out_work[row], out_count[row] = total_lost, work, evaluations
            evaluations = 0
    return OK, 0, 0.0
