"""All compiled loops of the chain, in one file: numba's cache does not notice an edited callee in another.

Arrays, with N beads behind body 0, the striker:
    y, v     N + 1   positions (m) and velocities of the bodies; y is measured from touching, unloaded beads,
                     so the approach of a contact is δᵢ = yᵢ₋₁ − yᵢ, and that of the last one y_N − w; behind them,
                     where beads vibrate, the m amplitudes q (m √kg) of each body's modes, and their rates; behind
                     those, where modes have Maxwell arms, the amplitudes z of the m arms of each body; or, where
                     contacts yield, three numbers of each contact, see Yielding, and zeros
The structure's surface is at w and moves at a constant rate during a window. Where a structure is behind the chain too,
body 0 is its surface, and moves on at the speed that it has as a window starts. Contacts 1 … N + 1 are stored from 0;
the last one is with the structure. `chain` is a Constants.
"""

from math import sqrt
from typing import NamedTuple

import numpy as np

from particles.kernel_cache import njit

VERLET, DRIVEN_VERLET, VISCOUS_VERLET, LOSSY_VERLET, RK4, YIELDING_VERLET = 0, 1, 2, 3, 4, 5
"""How a window is advanced. VERLET: Hertz's contacts, free striker; DRIVEN_VERLET: all but losses; VISCOUS_VERLET: as
VERLET, with losses that are linear in the approach rate; YIELDING_VERLET: as VERLET, with contacts that yield; the
others: all."""

NO_LOSS, DASHPOT, TANGENT, SECANT, GLOBAL, DRAG = 0, 1, 2, 3, 4, 5
"""What a loss grows with: see _damped, and for the last two, which are no contact forces, _lose_on_bodies."""

FREE, PUSHED, MOVED, STEADY = 0, 1, 2, 3
"""What body 0 is, and what history the chain is driven by. FREE: a striker, none; MOVED: it moves by a history; else it
moves on at its speed, PUSHED with a history of the force on bead 1, STEADY with none."""

NEGLIGIBLE = 1e-60
"""m. The front of a solitary wave falls off doubly exponentially; below this it would end in slow subnormal numbers."""

NEVER = 1e300
"""m, the overlap at which a contact yields that does not."""

BUCKETS, LOWEST, OCTAVES = 32, -60, 57
"""Cubics in an octave of the approach, and where tables begin and end: 2^-60 m to 2^-3 m."""

BUCKET_BITS = 5
MANTISSA_BITS, EXPONENT_BIAS = 52, 1023

OK, NON_FINITE, NOT_CONVERGED = 0, 1, 2

STILL = 1e-14
"""Of the greatest approach, a way of a surface that gives no slope."""

SETTLED = 1e-13
"""Of the greatest contact force, how far forces that beads pass on to each other may still change."""

MOST_SWEEPS = 200

PIECES = 4
"""Straight pieces that replace a parabola of the surface over a window."""

NEWTON, FIXED_POINT, AITKEN, LEAST_SQUARES = range(4)
"""How a scheme chooses the next forces."""


class Numbers(NamedTuple):
    """Scalars that do not change during a run."""

    loss: int
    exponent: float
    """Of the approach rate in the loss."""
    gravity: float
    """Along the chain, m/s²."""
    flexibility: float
    """The structure's, m/N: a massless spring behind the last contact."""
    flexibility_behind: float
    """The same of the structure behind the chain, at contact 1."""
    preload: float
    """A dead load on bead 1, N."""
    spring: float
    """N/m, a spring that pushes body 0 until it is at `spring_end`."""
    spring_end: float
    drive: int


class Vibrations(NamedTuple):
    """Of the bodies, see particles.deformable.vibration: N + 1 rows, a column for each of the m modes."""

    stiffness: np.ndarray
    """Squares of the angular frequencies, 1/s²."""
    struck: np.ndarray
    """Motion of the pole on the struck side, 1/√kg."""
    far: np.ndarray
    """Motion of the other one."""
    cross: np.ndarray
    """N + 1 numbers, m/N: what a force at one pole moves the other at once."""
    rate: np.ndarray
    """c of the loss c q′, 1/s. No rows where no mode of the chain has a loss; so for the next two without arms."""
    arm: np.ndarray
    """g ω² of an arm's force g ω² (q − z), 1/s²."""
    relaxation: np.ndarray
    """1/τ in z′ = (q − z)/τ, 1/s."""


class Yielding(NamedTuple):
    """Of contacts that yield, N + 1 of each; empty where none of the chain does. See particles.laws.yielding.

    A contact follows Hertz's law up to the overlap at which it yields, then a loading curve. Unloaded, it is Hertz's
    again, with another stiffness and from the dent on that is left; both depend on the largest overlap so far. What it
    remembers lies behind the positions: N + 1 overlaps (m) beyond which the contacts yield further, then N + 1 of these
    stiffnesses (N/m^1.5), then N + 1 dents (m).
    """

    begin: np.ndarray
    """Overlap at which it yields, m; NEVER where it does not."""
    force: np.ndarray
    """There, N."""
    loading: np.ndarray
    """First row in `rows` of the force above that one over the overlap beyond that one."""
    dent: np.ndarray
    """First row of the dent, m, over the largest overlap beyond that one."""


class Constants(NamedTuple):
    """All that does not change during a run. Only the outermost loops take it: unpacking costs more than a contact."""

    inverse_mass: np.ndarray
    """N + 1, 1/kg; zero for a body with a prescribed motion."""
    stiffness: np.ndarray
    """N + 1, of the contacts."""
    table: np.ndarray
    """N + 1, integers: the contact's first row in `rows`; −1 for Hertz's δ√δ."""
    rows: np.ndarray
    """See particles.laws.formulas.kernel_table."""
    damping: np.ndarray
    """N + 1, the coefficient of each contact's (GLOBAL, DRAG: each body's) loss."""
    history: np.ndarray
    """3 × ·, of the drive: times (s), values (N or m) and rates. Cubic between times, constant outside."""
    vibrations: Vibrations | None
    """None for rigid bodies: then nothing is compiled for vibrations."""
    yielding: Yielding | None
    """None where no contact yields: then nothing is compiled for that."""
    numbers: Numbers


class Chains(NamedTuple):
    """The Constants of C chains, of each field one array after the other, flattened."""

    inverse_mass: np.ndarray
    stiffness: np.ndarray
    table: np.ndarray
    rows: np.ndarray
    """The tables of all chains; `table` counts from the first row."""
    damping: np.ndarray
    history: np.ndarray
    squares: np.ndarray | None
    """The fields of Vibrations, None where all bodies are rigid; so are the next six."""
    struck: np.ndarray | None
    far: np.ndarray | None
    cross: np.ndarray | None
    rate: np.ndarray | None
    arm: np.ndarray | None
    relaxation: np.ndarray | None
    yielding: Yielding | None
    """None where no chain yields."""
    numbers: np.ndarray
    """C × the fields of Numbers."""
    layout: np.ndarray
    """C + 1 rows: where the coordinates, the bodies, the numbers of the history, those of the modes, of their losses,
    of their arms, and the contacts that may yield of each chain begin."""
    method: np.ndarray | None
    """None where it is VERLET for all chains: then nothing else is compiled."""
    rest: np.ndarray
    """m, where body 0 of each chain is at rest."""


class Structures(NamedTuple):
    """The structures.moving.Propagators of S structures, flattened in the same way."""

    spread: np.ndarray
    response: np.ndarray
    contact: np.ndarray
    stiffness: np.ndarray
    mass: np.ndarray
    layout: np.ndarray
    """S + 1 rows: where the state of each begins, and its numbers in `contact`, `stiffness`, `mass`, `spread` and
    `response`; then the number of rows of its `spread`, and of its displacements."""


class Span(NamedTuple):
    """A window of a structure with gaps, or a part of one; see structures.moving.Propagator."""

    length: float
    spread: np.ndarray
    response: np.ndarray
    softness: np.ndarray
    """G × G, m/(N s): the velocity of each gap at the end after 1 N across each from rest."""


class Gaps(NamedTuple):
    """Of a structure whose gaps close, see structures.closing. Its last G contacts are the gaps."""

    whole: Span
    """A window."""
    part: Span
    parts: int
    """So many make a window in which a gap closes."""
    place: np.ndarray
    """G rows: the width of each gap, from the displacements; and its rate, from the velocities."""
    rate: np.ndarray
    opening: np.ndarray
    """G, m; and N."""
    preload: np.ndarray
    damping: np.ndarray
    """C, of the displacements; one row if it is diagonal, none without damping."""


class Seats(NamedTuple):
    """The K contacts, ordered by chain."""

    chain: np.ndarray
    behind: np.ndarray
    """Whether it is that of the first bead."""
    structure: np.ndarray
    point: np.ndarray
    """Its number among the contact points of its structure."""
    static: np.ndarray
    """Static force, N."""
    own: np.ndarray
    """C: the first contact of each chain."""


class Run(NamedTuple):
    """What a run is at the end of a window, all of it arrays; see coupling.state.CoupledState."""

    y: np.ndarray
    """Of all chains, one after the other; so is v."""
    v: np.ndarray
    body: np.ndarray
    """The states of all structures."""
    surface: np.ndarray
    """K, m."""
    guess: np.ndarray
    """See advance_condensed, for one contact."""
    slope: np.ndarray
    """K, N/m: the secants of Newton's method, for several."""
    node_time: np.ndarray
    """The last three substeps, newest first: end (s), length (s), surfaces (m) and mean forces (N), K each."""
    node_length: np.ndarray
    node_surface: np.ndarray
    node_force: np.ndarray
    lost: np.ndarray
    """C, J; so is the next one."""
    driven: np.ndarray
    work: np.ndarray
    """K, J; so is the next one; and N s."""
    given: np.ndarray
    impulse: np.ndarray
    counts: np.ndarray
    """Nodes so far, at most three; and since the last saved time windows of chains, and substeps."""
    residual: np.ndarray
    """One number, N: the greatest since then."""
    memory: np.ndarray
    """Of least squares: differences of residuals and of answers, N, as rows for each window, newest first."""
    remembered: np.ndarray
    """For each of these windows how many rows it has, and its length, s."""
    pressed: np.ndarray
    """G, N: the mean force across each gap over the last window, zero where it is open at its end."""
    taken: np.ndarray
    """One number, J: what damping and the closing of gaps have taken from a structure with gaps."""


class Search(NamedTuple):
    """How the forces of a window are found; see coupling.schemes."""

    kind: int
    """NEWTON, or one of the iterated schemes."""
    tolerance: float
    """N."""
    still: float
    """m: a way of a surface that gives no slope; for iterated schemes, one that is no motion."""
    most: int
    """Trials, after which a window is halved."""
    relaxation: float
    filtering: float
    """Of least squares: a difference that adds less than this part is dropped."""


class Saved(NamedTuple):
    """Arrays of a run: a row for each saved time, or a column where they begin with chains, contacts or structures."""

    position: np.ndarray
    """Of all chains, one after the other; so are the next two."""
    velocity: np.ndarray
    contact_force: np.ndarray
    kinetic: np.ndarray
    """C × saved times, energies of the chains, J; so are the next three."""
    potential: np.ndarray
    lost: np.ndarray
    driven: np.ndarray
    surface: np.ndarray
    """K × saved times, displacement of the surfaces, m."""
    work: np.ndarray
    """Work on the structures, J."""
    given: np.ndarray
    """Work of the chains, J."""
    impulse: np.ndarray
    structure_kinetic: np.ndarray
    """S × saved times, energies of the structures, J; so is the next one."""
    structure_elastic: np.ndarray
    evaluations: np.ndarray
    """Windows of the chains that were tried since the last saved time."""
    substeps: np.ndarray
    residual: np.ndarray
    """Greatest residual since then, N."""
    taken: np.ndarray
    """S × saved times: what the damping of structures and the closing of their gaps took, J; NaN where not known."""


def table_edges() -> np.ndarray:
    """Where the cubics of a table begin and end, m."""
    i = np.arange(BUCKETS * OCTAVES + 1)
    return 2.0 ** (LOWEST + i // BUCKETS) * (1.0 + (i % BUCKETS) / BUCKETS)


@njit(cache=True)
def _copy(source, target):
    """What `target[:] = source` does: that compiles the text of an error for arrays of unequal shapes, for seconds."""
    for i in range(target.size):
        target[i] = source[i]


@njit(cache=True, inline="always")
def _row(approach):
    """Which cubic holds an approach: exponent and leading bits of a float count the buckets."""
    bits = np.float64(approach).view(np.int64) >> (MANTISSA_BITS - BUCKET_BITS)
    return min(max(bits - ((EXPONENT_BIAS + LOWEST) << BUCKET_BITS), 0), BUCKETS * OCTAVES - 1)


@njit(cache=True, inline="always")
def _hertz(stiffness, approach):
    overlap = approach if approach > NEGLIGIBLE else 0.0
    return stiffness * overlap * sqrt(overlap)


@njit(cache=True, inline="always")
def _shape(table, rows, approach):
    """Force of a contact of stiffness one."""
    if approach <= NEGLIGIBLE:
        return 0.0
    if table < 0:
        return approach * sqrt(approach)
    row = table + _row(approach)
    t = approach - rows[row, 0]
    return rows[row, 1] + t * (rows[row, 2] + t * (rows[row, 3] + t * rows[row, 4]))


@njit(cache=True)
def _shape_tangent(table, rows, approach):
    if approach <= NEGLIGIBLE:
        return 0.0
    if table < 0:
        return 1.5 * sqrt(approach)
    row = table + _row(approach)
    t = approach - rows[row, 0]
    return rows[row, 2] + t * (2.0 * rows[row, 3] + t * 3.0 * rows[row, 4])


@njit(cache=True)
def _shape_energy(table, rows, approach):
    if approach <= NEGLIGIBLE:
        return 0.0
    if table < 0:
        return 0.4 * approach * approach * sqrt(approach)
    row = table + _row(approach)
    t = approach - rows[row, 0]
    return rows[row, 5] + t * (
        rows[row, 1] + t * (rows[row, 2] / 2.0 + t * (rows[row, 3] / 3.0 + t * rows[row, 4] / 4.0))
    )


@njit(cache=True)
def _overlap_on_spring(stiffness, table, rows, approach, flexibility):
    """The contact's own part δ_h of an approach shared with a linear spring: δ = δ_h + f F(δ_h), by Newton."""
    if approach <= NEGLIGIBLE or flexibility == 0.0:
        return approach
    if table < 0:
        return _hertz_on_spring(stiffness * flexibility, approach)
    overlap, scale = approach, stiffness * flexibility
    for _ in range(50):
        excess = overlap + scale * _shape(table, rows, overlap) - approach
        change = excess / (1.0 + scale * _shape_tangent(table, rows, overlap))
        overlap -= change
        if not abs(change) > 1e-15 * overlap:
            break
    return overlap


@njit(cache=True)
def _hertz_on_spring(scale, approach):
    """The same for Hertz's law, δ = δ_h + scale δ_h^1.5: with g = √(δ_h/δ) and z = scale √δ, g² + z g³ = 1."""
    z = scale * sqrt(approach)
    # Newton's first step from g = 1; its sequence ends in a few more for a spring stiffer than the contact.
    part = 1.0 - z / (2.0 + 3.0 * z)
    for _ in range(50):
        change = (part * part * (1.0 + z * part) - 1.0) / (part * (2.0 + 3.0 * z * part))
        part -= change
        # It converges quadratically: after a change so small the next would be rounding.
        if not abs(change) > 1e-9 * part:
            break
    return part * part * approach


@njit(cache=True, inline="always")
def _loading(i, rows, yielding, largest):
    """Force of a contact that is being pressed further than ever, beyond the overlap at which it yields."""
    depth = largest - yielding.begin[i]
    row = yielding.loading[i] + _row(depth)
    t = depth - rows[row, 0]
    return yielding.force[i] + (rows[row, 1] + t * (rows[row, 2] + t * (rows[row, 3] + t * rows[row, 4])))


@njit(cache=True, inline="always")
def _unloading(i, rows, yielding, largest):
    """Stiffness (N/m^1.5) and dent (m) of a contact after its largest overlap, beyond that at which it yields."""
    depth = largest - yielding.begin[i]
    row = yielding.dent[i] + _row(depth)
    t = depth - rows[row, 0]
    dent = rows[row, 1] + t * (rows[row, 2] + t * (rows[row, 3] + t * rows[row, 4]))
    return _loading(i, rows, yielding, largest) / ((largest - dent) * sqrt(largest - dent)), dent


@njit(cache=True)
def _loaded_on_spring(i, rows, yielding, approach, flexibility):
    """The contact's own part of an approach shared with a linear spring as it yields, by Newton."""
    overlap = approach
    if flexibility == 0.0:
        return overlap
    for _ in range(50):
        row = yielding.loading[i] + _row(overlap - yielding.begin[i])
        t = overlap - yielding.begin[i] - rows[row, 0]
        slope = rows[row, 2] + t * (2.0 * rows[row, 3] + t * 3.0 * rows[row, 4])
        excess = overlap + flexibility * _loading(i, rows, yielding, overlap) - approach
        change = excess / (1.0 + flexibility * slope)
        overlap = max(overlap - change, yielding.begin[i])
        if not abs(change) > 1e-15 * overlap:
            break
    return overlap


@njit(cache=True)
def _yielded(i, rows, yielding, y, approach, flexibility):
    """Stiffness and elastic overlap of a contact of Hertz's shape with this force, and its whole overlap.

    They are those that the contact remembers, or where it is pressed further those after this overlap.
    """
    bodies = yielding.begin.size
    hard, dent = y[2 * bodies + i], y[3 * bodies + i]
    elastic = approach - dent
    if flexibility != 0.0 and elastic > NEGLIGIBLE:
        elastic = _hertz_on_spring(hard * flexibility, elastic)
    overlap = elastic + dent
    if overlap > y[bodies + i]:
        overlap = _loaded_on_spring(i, rows, yielding, approach, flexibility)
        hard, dent = _unloading(i, rows, yielding, overlap)
        elastic = overlap - dent
    return hard, elastic if elastic > NEGLIGIBLE else 0.0, overlap


@njit(cache=True)
def _plastic_work(i, stiffness, rows, yielding, largest):
    """Energy that a contact has lost after its largest overlap, J: the work of loading less what unloading returns."""
    begin = yielding.begin[i]
    if not largest > begin:
        return 0.0
    depth = largest - begin
    row = yielding.loading[i] + _row(depth)
    t = depth - rows[row, 0]
    beyond = rows[row, 5] + t * (
        rows[row, 1] + t * (rows[row, 2] / 2.0 + t * (rows[row, 3] / 3.0 + t * rows[row, 4] / 4.0))
    )
    hard, dent = _unloading(i, rows, yielding, largest)
    elastic = largest - dent
    loaded = stiffness * (0.4 * begin * begin * sqrt(begin)) + yielding.force[i] * depth + beyond
    return max(loaded - hard * (0.4 * elastic * elastic * sqrt(elastic)), 0.0)


@njit(cache=True)
def _plastic_loss(stiffness, rows, yielding, before, limit, first, end):
    """Energy lost in some contacts as the overlaps beyond which they yield further grew, J."""
    lost = 0.0
    for i in range(first, end):
        if limit[i] > before[i]:
            more = _plastic_work(i, stiffness[i], rows, yielding, limit[i])
            lost += max(more - _plastic_work(i, stiffness[i], rows, yielding, before[i]), 0.0)
    return lost


@njit(cache=True)
def _yields(yielding):
    """Whether contacts of a chain may yield."""
    if yielding is None:
        return False
    return yielding.begin.size > 0


@njit(cache=True)
def _limits(y, bodies, yielding):
    """A copy of the overlaps beyond which contacts yield further; nothing where none yields."""
    return y[bodies : 2 * bodies].copy() if _yields(yielding) else y[:0].copy()


@njit(cache=True)
def _remember_overlaps(y, wall, rows, yielding, numbers):
    """Put what contacts remember behind the positions in y."""
    if yielding is None:
        return
    bodies = yielding.begin.size
    for i in range(bodies):
        approach = y[i] - (y[i + 1] if i < bodies - 1 else wall)
        if approach > yielding.begin[i]:
            flexibility = numbers.flexibility if i == bodies - 1 else numbers.flexibility_behind if i == 0 else 0.0
            _, _, overlap = _yielded(i, rows, yielding, y, approach, flexibility)
            if overlap > y[bodies + i]:
                y[bodies + i] = overlap
                y[2 * bodies + i], y[3 * bodies + i] = _unloading(i, rows, yielding, overlap)


@njit(cache=True)
def _loss_of_yielding(y, stiffness, rows, yielding, before):
    """Energy lost since the contacts had the limits `before`, J."""
    if yielding is None:
        return 0.0
    return _plastic_loss(stiffness, rows, yielding, before, y[before.size :], 0, before.size)


@njit(cache=True)
def _value(history, t):
    """Value and rate of the drive's history at a time; its last value holds on."""
    times, values, rates = history
    if t < times[0] or t >= times[-1]:
        return values[0 if t < times[0] else times.size - 1], 0.0
    i, after = np.int64(0), times.size
    while after - i > 1:  # np.searchsorted takes numba half a second to compile
        middle = (i + after) // 2
        if times[middle] > t:
            after = middle
        else:
            i = middle
    step = times[i + 1] - times[i]
    s = (t - times[i]) / step
    start_rate, end_rate = step * rates[i], step * rates[i + 1]
    rise = values[i + 1] - values[i]
    second, third = 3.0 * rise - 2.0 * start_rate - end_rate, start_rate + end_rate - 2.0 * rise
    value = values[i] + s * (start_rate + s * (second + s * third))
    return value, (start_rate + s * (2.0 * second + 3.0 * s * third)) / step


@njit(cache=True)
def _outer_forces(numbers, history, place, t):
    """Outer forces on body 0 and on bead 1, without gravity, and the history's part of the latter, N."""
    push = _value(history, t)[0] if numbers.drive == PUSHED else 0.0
    return numbers.spring * max(numbers.spring_end - place, 0.0), push + numbers.preload, push


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


@njit(cache=True, fastmath={"contract"}, inline="always")
def _table_kick_drift(y, v, inverse_mass, stiffness, table, rows, gravity, behind, wall_force, kick, drift):
    """The same for contacts of any kind, and for bodies that a force pushes from behind."""
    last = y.size - 1
    for i in range(last):
        ahead = stiffness[i] * _shape(table[i], rows, y[i] - y[i + 1])
        v[i] += kick * (inverse_mass[i] * (behind - ahead) + gravity)
        y[i] += drift * v[i]
        behind = ahead
    v[last] += kick * (inverse_mass[last] * (behind - wall_force) + gravity)
    y[last] += drift * v[last]


@njit(cache=True)
def _mean_rate(history, t, step):
    """Of the drive's history over a step; at its start where the step is zero."""
    value, rate = _value(history, t)
    return (_value(history, t + step)[0] - value) / step if step > 0.0 else rate


@njit(cache=True, fastmath={"contract"})
def _verlet(y, v, inverse_mass, stiffness, gravity, flexibility, wall, rate, dt, steps):
    """Velocity Verlet over one window for Hertz's contacts alone, its inner half-kicks joined. Returns the impulse."""
    last = y.size - 1
    impulse = 0.0
    for step in range(steps + 1):
        kick = dt if 0 < step < steps else 0.5 * dt
        # Before the pass: after it, the scalar load would wait for the pass's vector stores.
        overlap = y[last] - (wall + step * dt * rate)
        if flexibility != 0.0 and overlap > NEGLIGIBLE:
            overlap = _hertz_on_spring(stiffness[last] * flexibility, overlap)
        wall_force = _hertz(stiffness[last], overlap)
        impulse += kick * wall_force
        _kick_drift(y, v, inverse_mass, stiffness, gravity, wall_force, kick, dt if step < steps else 0.0)
    return impulse


@njit(cache=True, fastmath={"contract"}, inline="always")
def _press(y, limit, stiffness, dent, force):
    """Forces of contacts of Hertz's shape from their dents on, but the last one.

    Returns the first and the last one that are pressed beyond their limits; where none is, the last comes first.
    """
    low, high = force.size, -1
    for i in range(force.size):
        approach = y[i] - y[i + 1]
        low = min(low, i if approach > limit[i] else force.size)
        high = max(high, i if approach > limit[i] else -1)
        overlap = approach - dent[i]
        overlap = overlap if overlap > NEGLIGIBLE else 0.0
        force[i] = stiffness[i] * overlap * sqrt(overlap)
    return low, high


@njit(cache=True, fastmath={"contract"}, inline="always")
def _pushed_drift(y, v, inverse_mass, force, gravity, wall_force, kick, drift):
    """What `_kick_drift` does with forces that are known."""
    last = force.size
    v[0] += kick * (inverse_mass[0] * (0.0 - force[0]) + gravity)
    y[0] += drift * v[0]
    for i in range(1, last):
        v[i] += kick * (inverse_mass[i] * (force[i - 1] - force[i]) + gravity)
        y[i] += drift * v[i]
    v[last] += kick * (inverse_mass[last] * (force[last - 1] - wall_force) + gravity)
    y[last] += drift * v[last]


@njit(cache=True, fastmath={"contract"})
def _yielding_verlet(y, v, inverse_mass, stiffness, rows, yielding, gravity, flexibility, wall, rate, dt, steps):
    """`_verlet` for contacts that yield, with its bits where none does. Returns the impulse and the energy lost."""
    if yielding is None:
        return 0.0, 0.0
    bodies = inverse_mass.size
    last = bodies - 1
    place, speed = y[:bodies], v[:bodies]
    limit, hard, dent = y[bodies : 2 * bodies], y[2 * bodies : 3 * bodies], y[3 * bodies :]
    before, force = limit.copy(), np.empty(last)
    impulse, low, high = 0.0, last, 0
    for step in range(steps + 1):
        kick = dt if 0 < step < steps else 0.5 * dt
        approach = place[last] - (wall + step * dt * rate)
        overlap = approach - dent[last]
        if flexibility != 0.0 and overlap > NEGLIGIBLE:
            overlap = _hertz_on_spring(hard[last] * flexibility, overlap)
        if overlap + dent[last] > limit[last]:
            limit[last] = _loaded_on_spring(last, rows, yielding, approach, flexibility)
            hard[last], dent[last] = _unloading(last, rows, yielding, limit[last])
            overlap, high = limit[last] - dent[last], bodies
        wall_force = _hertz(hard[last], overlap)
        impulse += kick * wall_force
        first, end = _press(place, limit, hard, dent, force)
        if first <= end:
            low, high = min(low, first), max(high, end + 1)
            for i in range(first, end + 1):
                approach = place[i] - place[i + 1]
                if approach > limit[i]:
                    limit[i] = approach
                    force[i] = _loading(i, rows, yielding, approach)
                    hard[i], dent[i] = _unloading(i, rows, yielding, approach)
        drift = dt if step < steps else 0.0
        _pushed_drift(place, speed, inverse_mass, force, gravity, wall_force, kick, drift)
    return impulse, _plastic_loss(stiffness, rows, yielding, before, limit, low, high)


@njit(cache=True, fastmath={"contract"})
def _driven_verlet(y, v, chain, t, wall, rate, dt, steps):
    """The same for contacts and drives of any kind. Returns the impulses on the structure and on body 0 where it is no
    striker, and the drive's work.

    The drive works on body 0 if that is moved, else on bead 1; a step's work is its force times half the way
    before and after it.
    """
    inverse_mass, stiffness, table, rows, _, history, _, _, numbers = chain
    last = y.size - 1
    # The pass moves body 0 only where that is a striker.
    first = 0 if numbers.drive == FREE else 1
    some_y, some_v, some_masses, some_stiffness, some_tables = (
        y[first:], v[first:], inverse_mass[first:], stiffness[first:], table[first:],
    )  # fmt: skip
    driven = numbers.drive != FREE or numbers.spring > 0.0 or numbers.preload > 0.0
    source = 0 if numbers.drive == MOVED else 1
    impulse, impulse_behind, work, push, before, behind = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for step in range(steps + 1):
        kick = dt if 0 < step < steps else 0.5 * dt
        drift = dt if step < steps else 0.0
        now = t + step * dt
        overlap = y[last] - (wall + step * dt * rate)
        if numbers.flexibility != 0.0:
            overlap = _overlap_on_spring(stiffness[last], table[last], rows, overlap, numbers.flexibility)
        wall_force = stiffness[last] * _shape(table[last], rows, overlap)
        impulse += kick * wall_force
        if driven:
            before = dt * v[source] if step > 0 else 0.0
            on_striker, on_bead, push = _outer_forces(numbers, history, y[0], now)
            v[0] += kick * inverse_mass[0] * on_striker
            v[1] += kick * inverse_mass[1] * on_bead
        if first == 1:
            overlap = y[0] - y[1]
            if numbers.flexibility_behind != 0.0:
                overlap = _overlap_on_spring(stiffness[0], table[0], rows, overlap, numbers.flexibility_behind)
            behind = stiffness[0] * _shape(table[0], rows, overlap)
            impulse_behind += kick * behind
            if numbers.drive == MOVED:
                v[0], push = _mean_rate(history, now, drift), behind
            y[0] += drift * v[0]
        _table_kick_drift(
            some_y, some_v, some_masses, some_stiffness, some_tables, rows, numbers.gravity, behind, wall_force, kick,
            drift,
        )  # fmt: skip
        if driven:
            work += 0.5 * push * (before + drift * v[source])
    return impulse, impulse_behind, work


@njit(cache=True)
def _damped(elastic, tangent, overlap, approach_rate, loss, damping, exponent):
    """Force of a closed contact with its loss, never a pull.

    The loss grows with the approach rate to a power, and with nothing else, with dF/dδ, or with √[(dF/dδ + F/δ)/2].
    """
    power = approach_rate
    if exponent != 1.0:
        power = np.sign(approach_rate) * abs(approach_rate) ** exponent
    if loss == TANGENT:
        damping *= tangent
    elif loss == SECANT:
        damping *= sqrt(0.5 * (tangent + elastic / overlap)) if overlap > NEGLIGIBLE else 0.0
    return max(elastic + damping * power, 0.0)


@njit(cache=True, inline="always")
def _lossy(elastic, tangent, overlap, approach_rate, flexibility, loss, damping, exponent):
    """The same in front of a massless spring, which is the structure's at the wall; 0 m/N where there is none.

    The loss acts on the contact's own part of the approach rate, and the spring yields to the loss: to first order.
    """
    share = 1.0 / (1.0 + flexibility * tangent) if flexibility != 0.0 else 1.0
    force = _damped(elastic, tangent, overlap, share * approach_rate, loss, damping, exponent)
    return max(elastic + share * (force - elastic), 0.0)


@njit(cache=True)
def _laplacian(i, y, v, wall, rate, stiffness):
    """Difference of the approach rates of the contacts behind and ahead of a body; an open one has none."""
    last = y.size - 1
    behind = v[i - 1] - v[i] if i > 0 and y[i - 1] >= y[i] and stiffness[i - 1] > 0.0 else 0.0
    beyond, beyond_rate = (y[i + 1], v[i + 1]) if i < last else (wall, rate)
    ahead = v[i] - beyond_rate if y[i] >= beyond and stiffness[i] > 0.0 else 0.0
    return behind - ahead


@njit(cache=True)
def _lose_on_bodies(y, v, wall, rate, inverse_mass, stiffness, damping, numbers, a):
    """Add to the accelerations the losses that act on bodies, not between them. Returns the power that they take."""
    power = 0.0
    if numbers.loss == DRAG:
        for i in range(y.size):
            if inverse_mass[i] > 0.0:
                a[i] -= damping[i] * v[i]
                power += damping[i] * v[i] * v[i] / inverse_mass[i]
        return power
    force = np.zeros_like(y)
    for i in range(y.size):
        difference = _laplacian(i, y, v, wall, rate, stiffness)
        if inverse_mass[i] > 0.0 and difference != 0.0:
            force[i] = damping[i] * np.sign(difference) * abs(difference) ** numbers.exponent
            power -= force[i] * v[i]
    # In a chain that moves as a whole this law could feed energy; then it is left out.
    if power <= 0.0:
        return 0.0
    for i in range(y.size):
        a[i] += inverse_mass[i] * force[i]
    return power


@njit(cache=True, inline="always")
def _accelerate_rigid(
    y, v, wall, rate, on_striker, on_bead, inverse_mass, stiffness, table, rows, damping, numbers, a, forces
):
    """`_accelerate` for rigid bodies."""
    last = y.size - 1
    first_overlap, wall_overlap = y[0] - y[1], y[last] - wall
    if numbers.flexibility_behind != 0.0:
        first_overlap = _overlap_on_spring(stiffness[0], table[0], rows, first_overlap, numbers.flexibility_behind)
    if numbers.flexibility != 0.0:
        wall_overlap = _overlap_on_spring(stiffness[last], table[last], rows, wall_overlap, numbers.flexibility)
    power, behind = 0.0, on_striker
    for i in range(last + 1):
        approach = y[i] - (y[i + 1] if i < last else wall)
        approach_rate = v[i] - (v[i + 1] if i < last else rate)
        overlap = approach if i < last else wall_overlap
        if i == 0:
            overlap = first_overlap
        elastic, slope = 0.0, 0.0
        # Written out: handing `rows` to a function for every contact would cost more than the contact.
        if overlap > NEGLIGIBLE and table[i] < 0:
            slope = stiffness[i] * sqrt(overlap)
            elastic, slope = slope * overlap, 1.5 * slope
        elif overlap > NEGLIGIBLE:
            row = table[i] + _row(overlap)
            t = overlap - rows[row, 0]
            elastic = stiffness[i] * (rows[row, 1] + t * (rows[row, 2] + t * (rows[row, 3] + t * rows[row, 4])))
            slope = stiffness[i] * (rows[row, 2] + t * (2.0 * rows[row, 3] + t * 3.0 * rows[row, 4]))
        ahead = elastic
        # A striker that just touches pushes its dashpot at once.
        if approach >= 0.0 and stiffness[i] > 0.0 and NO_LOSS < numbers.loss < GLOBAL:
            flexibility = numbers.flexibility if i == last else numbers.flexibility_behind if i == 0 else 0.0
            ahead = _lossy(
                elastic, slope, overlap, approach_rate, flexibility, numbers.loss, damping[i], numbers.exponent
            )
            power += (ahead - elastic) * approach_rate
        a[i] = inverse_mass[i] * (behind - ahead) + numbers.gravity
        forces[i] = ahead
        behind = ahead
    a[1] += inverse_mass[1] * on_bead
    if numbers.drive != FREE:
        a[0] = 0.0
    if numbers.loss >= GLOBAL:
        power += _lose_on_bodies(y, v, wall, rate, inverse_mass, stiffness, damping, numbers, a)
    return power


@njit(cache=True)
def _accelerate_yielding(
    y, v, wall, rate, on_striker, on_bead, inverse_mass, stiffness, rows, damping, yielding, numbers, a, forces
):
    """`_accelerate` for rigid bodies whose contacts yield. Losses see the stiffness of unloading."""
    bodies = inverse_mass.size
    last = bodies - 1
    power, behind, dent = 0.0, on_striker, y[3 * bodies :]
    for i in range(bodies):
        approach = y[i] - (y[i + 1] if i < last else wall)
        approach_rate = v[i] - (v[i + 1] if i < last else rate)
        flexibility = numbers.flexibility if i == last else numbers.flexibility_behind if i == 0 else 0.0
        hard, overlap = y[2 * bodies + i], approach - dent[i]
        # Written out: handing arrays to a function for every contact would cost more than the contact.
        if approach > y[bodies + i] or flexibility != 0.0:
            hard, overlap, _ = _yielded(i, rows, yielding, y, approach, flexibility)
        overlap = overlap if overlap > NEGLIGIBLE else 0.0
        slope = hard * sqrt(overlap)
        ahead = elastic = slope * overlap
        # A dent that is not touched any more has no loss.
        touches = overlap > 0.0 or (approach >= 0.0 and dent[i] == 0.0)
        if touches and stiffness[i] > 0.0 and NO_LOSS < numbers.loss < GLOBAL:
            ahead = _lossy(
                elastic, 1.5 * slope, overlap, approach_rate, flexibility, numbers.loss, damping[i], numbers.exponent
            )
            power += (ahead - elastic) * approach_rate
        a[i] = inverse_mass[i] * (behind - ahead) + numbers.gravity
        forces[i] = ahead
        behind = ahead
    a[1] += inverse_mass[1] * on_bead
    if numbers.drive != FREE:
        a[0] = 0.0
    if numbers.loss >= GLOBAL:
        power += _lose_on_bodies(
            y[:bodies], v[:bodies], wall, rate, inverse_mass, stiffness, damping, numbers, a[:bodies]
        )
    return power


@njit(cache=True)
def _poles(y, vibrations, wall, out):
    """Approaches of the contacts between the poles of vibrating bodies into out; of rates their rates."""
    struck, far = vibrations.struck, vibrations.far
    bodies, modes = struck.shape
    for i in range(bodies):
        behind, ahead = y[i], y[i]
        for k in range(modes):
            amplitude = y[bodies + i * modes + k]
            behind += struck[i, k] * amplitude
            ahead += far[i, k] * amplitude
        if i > 0:
            out[i - 1] -= behind
        out[i] = ahead
    out[bodies - 1] -= wall


@njit(cache=True)
def _settle(approach, cross, stiffness, table, rows, numbers, forces, overlap):
    """Elastic forces of contacts, and their own parts of the approach, into forces and overlap.

    What moves a pole at once, beyond a body's modes, is in its contacts' laws; but a force also moves the other pole,
    whose contact it presses. Contacts have no mass, so all of that settles at once: by Gauss–Seidel sweeps, which
    begin with what is in `forces` and converge by the ratio of `cross` to the contacts' own flexibility.
    """
    last = approach.size - 1
    for _ in range(MOST_SWEEPS):
        change, largest = 0.0, 0.0
        for i in range(last + 1):
            shared = approach[i]
            if i > 0:
                shared += cross[i] * forces[i - 1]
            if i < last:
                shared += cross[i + 1] * forces[i + 1]
            if i == last and numbers.flexibility != 0.0:
                shared = _overlap_on_spring(stiffness[i], table[i], rows, shared, numbers.flexibility)
            elif i == 0 and numbers.flexibility_behind != 0.0:
                shared = _overlap_on_spring(stiffness[i], table[i], rows, shared, numbers.flexibility_behind)
            force = stiffness[i] * _shape(table[i], rows, shared)
            change, largest = max(change, abs(force - forces[i])), max(largest, force)
            overlap[i], forces[i] = shared, force
        if not change > SETTLED * largest:
            break


@njit(cache=True)
def _accelerate_vibrating(
    y, v, wall, rate, on_striker, on_bead, inverse_mass, stiffness, table, rows, damping, vibrations, numbers, a, forces
):
    """`_accelerate` for bodies that vibrate. Losses in a contact see the rate at which the poles approach."""
    square, struck, far, cross, _, _, _ = vibrations
    bodies, modes = struck.shape
    last = bodies - 1
    approach, approach_rate, overlap = np.empty(bodies), np.empty(bodies), np.empty(bodies)
    _poles(y, vibrations, wall, approach)
    _settle(approach, cross, stiffness, table, rows, numbers, forces, overlap)
    power = 0.0
    if NO_LOSS < numbers.loss < GLOBAL:
        _poles(v, vibrations, rate, approach_rate)
        for i in range(bodies):
            if approach[i] < 0.0 or stiffness[i] == 0.0:
                continue
            elastic, slope = forces[i], stiffness[i] * _shape_tangent(table[i], rows, overlap[i])
            flexibility = numbers.flexibility if i == last else numbers.flexibility_behind if i == 0 else 0.0
            forces[i] = _lossy(
                elastic, slope, overlap[i], approach_rate[i], flexibility, numbers.loss, damping[i], numbers.exponent
            )
            power += (forces[i] - elastic) * approach_rate[i]
    behind = 0.0
    for i in range(bodies):
        ahead = forces[i]
        a[i] = inverse_mass[i] * (behind - ahead) + numbers.gravity
        for k in range(modes):
            place = bodies + i * modes + k
            a[place] = struck[i, k] * behind - far[i, k] * ahead - square[i, k] * y[place]
        behind = ahead
    a[0] += inverse_mass[0] * on_striker
    a[1] += inverse_mass[1] * on_bead
    if numbers.drive != FREE:
        a[0] = 0.0
    if numbers.loss >= GLOBAL:
        power += _lose_on_bodies(
            y[:bodies], v[:bodies], wall, rate, inverse_mass, stiffness, damping, numbers, a[:bodies]
        )
    if numbers.loss == DRAG:
        for i in range(bodies):
            for place in range(bodies + i * modes, bodies + (i + 1) * modes):
                a[place] -= damping[i] * v[place]
                power += damping[i] * v[place] * v[place]
    if vibrations.rate.size > 0:
        power += _lose_in_modes(y, v, bodies, vibrations, a)
    return power


@njit(cache=True)
def _lose_in_modes(y, v, bodies, vibrations, a):
    """Add to the accelerations the losses of the modes themselves. Returns the power that they take.

    An arm has no mass: z′ = (q − z)/τ. Its derivative, z″ = (q′ − z′)/τ, is integrated like all other motions.
    """
    rate, arm, relaxation = vibrations.rate.ravel(), vibrations.arm.ravel(), vibrations.relaxation.ravel()
    power, behind = 0.0, bodies + rate.size
    for k in range(rate.size):
        q = bodies + k
        a[q] -= rate[k] * v[q]
        power += rate[k] * v[q] * v[q]
    for k in range(arm.size):
        q, z = bodies + k, behind + k
        held = arm[k] * (y[q] - y[z])
        a[q] -= held
        a[z] = relaxation[k] * (v[q] - v[z])
        power += held * v[z]
    return power


@njit(cache=True, forceinline=True)
def _accelerate(
    y, v, wall, rate, on_striker, on_bead, inverse_mass, stiffness, table, rows, damping, vibrations, yielding, numbers,
    a, forces,
):  # fmt: skip
    """Accelerations and contact forces into a, forces, with what acts on body 0 and bead 1 from outside.

    forces: from where to begin with settling those of vibrating bodies. Returns the power that is lost.
    """
    if yielding is not None and yielding.begin.size > 0:
        return _accelerate_yielding(
            y, v, wall, rate, on_striker, on_bead, inverse_mass, stiffness, rows, damping, yielding, numbers, a, forces
        )
    if vibrations is not None and y.size > inverse_mass.size:
        return _accelerate_vibrating(
            y, v, wall, rate, on_striker, on_bead, inverse_mass, stiffness, table, rows, damping, vibrations, numbers,
            a, forces,
        )  # fmt: skip
    return _accelerate_rigid(
        y, v, wall, rate, on_striker, on_bead, inverse_mass, stiffness, table, rows, damping, numbers, a, forces
    )


@njit(cache=True)
def _lossy_verlet(y, v, chain, t, wall, rate, dt, steps):
    """Velocity Verlet whose losses depend on the velocity predicted for the step's end: second order."""
    inverse_mass, stiffness, table, rows, damping, history, vibrations, yielding, numbers = chain
    a, half, forces = np.zeros_like(y), v.copy(), np.zeros_like(inverse_mass)
    limits = _limits(y, inverse_mass.size, yielding)
    driven = numbers.drive != FREE or numbers.spring > 0.0 or numbers.preload > 0.0
    on_striker, on_bead, push = 0.0, 0.0, 0.0
    impulse, impulse_behind, lost, work = 0.0, 0.0, 0.0, 0.0
    for step in range(steps + 1):
        place, before = y[0], forces[0]
        if step > 0:
            for i in range(y.size):
                half[i] = v[i] + 0.5 * dt * a[i]
                v[i] = half[i] + 0.5 * dt * a[i]
                y[i] += dt * half[i]
        if driven:
            if numbers.drive == MOVED:
                y[0], v[0] = _value(history, t + step * dt)
                half[0] = v[0]
            on_striker, on_bead, push = _outer_forces(numbers, history, y[0], t + step * dt)
        place_of_wall = wall + step * dt * rate
        power = _accelerate(
            y, v, place_of_wall, rate, on_striker, on_bead, inverse_mass, stiffness, table, rows, damping, vibrations,
            yielding, numbers, a, forces,
        )  # fmt: skip
        _remember_overlaps(y, place_of_wall, rows, yielding, numbers)
        if step > 0:
            for i in range(y.size):
                v[i] = half[i] + 0.5 * dt * a[i]
        weight = dt if 0 < step < steps else 0.5 * dt
        impulse += weight * forces[-1]
        impulse_behind += weight * forces[0]
        lost += weight * power
        if numbers.drive == MOVED and step > 0:
            # By its way, not its speed, which may jump at the history's ends.
            work += 0.5 * (before + forces[0]) * (y[0] - place)
        work += weight * push * v[1]
    return impulse, impulse_behind, lost + _loss_of_yielding(y, stiffness, rows, yielding, limits), work


@njit(cache=True, inline="always")
def _viscosity(loss, damping, slope):
    """Loss over approach rate, N s/m, in a contact with F = kδ√δ; slope = k√δ."""
    if loss == TANGENT:
        return damping * 1.5 * slope
    if loss == SECANT:
        return damping * sqrt(1.25 * slope)
    return damping


@njit(cache=True, fastmath={"contract"}, inline="always")
def _viscous_kick_drift(y, v, half, lost, inverse_mass, stiffness, damping, loss, gravity, wall_force, dt, kick, drift):
    """half += kick · a(y, v); y += drift · half; v predicted for a step's end, and the power of each contact's loss."""
    last = y.size - 1
    behind = 0.0
    for i in range(last):
        approach, rate = y[i] - y[i + 1], v[i] - v[i + 1]
        overlap = approach if approach > NEGLIGIBLE else 0.0
        slope = stiffness[i] * sqrt(overlap)
        elastic = slope * overlap
        # A striker that just touches pushes its dashpot at once. The two together never pull.
        push = max(_viscosity(loss, damping[i], slope) * rate, -elastic) if approach >= 0.0 else 0.0
        lost[i] += kick * push * rate
        ahead = elastic + push
        a = inverse_mass[i] * (behind - ahead) + gravity
        half[i] += kick * a
        y[i] += drift * half[i]
        v[i] = half[i] + 0.5 * dt * a
        behind = ahead
    a = inverse_mass[last] * (behind - wall_force) + gravity
    half[last] += kick * a
    y[last] += drift * half[last]
    v[last] = half[last] + 0.5 * dt * a


@njit(cache=True, fastmath={"contract"})
def _viscous_verlet(y, v, inverse_mass, stiffness, damping, loss, gravity, flexibility, wall, rate, dt, steps):
    """_lossy_verlet for Hertz's contacts, losses that are linear in the approach rate, and a free striker.

    Its passes are joined into one that the compiler turns into vector instructions. Returns the impulse and the loss.
    """
    last = y.size - 1
    half, lost = v.copy(), np.zeros_like(y)
    impulse = 0.0
    for step in range(steps + 1):
        kick, drift = dt if 0 < step < steps else 0.5 * dt, dt if step < steps else 0.0
        approach, approach_rate = y[last] - (wall + step * dt * rate), v[last] - rate
        overlap = approach
        if flexibility != 0.0 and approach > NEGLIGIBLE:
            overlap = _hertz_on_spring(stiffness[last] * flexibility, approach)
        wall_force = elastic = _hertz(stiffness[last], overlap)
        if approach >= 0.0 and stiffness[last] > 0.0:
            slope = 1.5 * stiffness[last] * sqrt(overlap if overlap > NEGLIGIBLE else 0.0)
            wall_force = _lossy(elastic, slope, overlap, approach_rate, flexibility, loss, damping[last], 1.0)
            lost[last] += kick * (wall_force - elastic) * approach_rate
        impulse += kick * wall_force
        _viscous_kick_drift(
            y, v, half, lost, inverse_mass, stiffness, damping, loss, gravity, wall_force, dt, kick, drift
        )
    _copy(half, v)
    return impulse, lost.sum()


@njit(cache=True)
def _rk4(y, v, chain, t, wall, rate, dt, steps):
    """The classical Runge–Kutta method of order four; impulse, loss and work are integrated with the same weights."""
    inverse_mass, stiffness, table, rows, damping, history, vibrations, yielding, numbers = chain
    a, sum_a, sum_v = np.zeros_like(y), np.empty_like(y), np.empty_like(y)
    limits = _limits(y, inverse_mass.size, yielding)
    stage_y, stage_v, forces = np.empty_like(y), np.empty_like(y), np.zeros_like(inverse_mass)
    driven = numbers.drive != FREE or numbers.spring > 0.0 or numbers.preload > 0.0
    on_striker, on_bead, push = 0.0, 0.0, 0.0
    impulse, impulse_behind, lost, work = 0.0, 0.0, 0.0, 0.0
    for step in range(steps):
        _copy(y, stage_y)
        _copy(v, stage_v)
        sum_a[:], sum_v[:] = 0.0, 0.0
        place, impulse_before = y[0], impulse_behind
        for stage in range(4):
            ahead = (0.0, 0.5, 0.5, 1.0)[stage] * dt
            weight = (1.0, 2.0, 2.0, 1.0)[stage] * dt / 6.0
            if stage > 0:
                for i in range(y.size):
                    stage_y[i] = y[i] + ahead * stage_v[i]
                    stage_v[i] = v[i] + ahead * a[i]
            passed = step * dt + ahead
            if numbers.drive == MOVED:
                stage_y[0], stage_v[0] = _value(history, t + passed)
            if driven:
                on_striker, on_bead, push = _outer_forces(numbers, history, stage_y[0], t + passed)
            power = _accelerate(
                stage_y, stage_v, wall + passed * rate, rate, on_striker, on_bead, inverse_mass, stiffness, table, rows,
                damping, vibrations, yielding, numbers, a, forces,
            )  # fmt: skip
            impulse += weight * forces[-1]
            lost += weight * power
            work += weight * push * stage_v[1]
            impulse_behind += weight * forces[0]
            for i in range(y.size):
                sum_v[i] += weight * stage_v[i]
                sum_a[i] += weight * a[i]
        for i in range(y.size):
            y[i] += sum_v[i]
            v[i] += sum_a[i]
        if numbers.drive == MOVED:
            y[0], v[0] = _value(history, t + (step + 1) * dt)
            work += (impulse_behind - impulse_before) / dt * (y[0] - place)
        _remember_overlaps(y, wall + (step + 1) * dt * rate, rows, yielding, numbers)
    return impulse, impulse_behind, lost + _loss_of_yielding(y, stiffness, rows, yielding, limits), work


@njit(cache=True)
def _advance_any(y, v, chain, method, t, wall_start, rate, dt, steps):
    """A window by any other method. Returns impulses, the energy lost and the drive's work."""
    impulse_behind, lost, work = 0.0, 0.0, 0.0
    if method == DRIVEN_VERLET:
        impulse, impulse_behind, work = _driven_verlet(y, v, chain, t, wall_start, rate, dt, steps)
    elif method == VISCOUS_VERLET:
        numbers = chain.numbers
        impulse, lost = _viscous_verlet(
            y, v, chain.inverse_mass, chain.stiffness, chain.damping, numbers.loss, numbers.gravity,
            numbers.flexibility, wall_start, rate, dt, steps,
        )  # fmt: skip
    elif method == YIELDING_VERLET:
        numbers = chain.numbers
        impulse, lost = _yielding_verlet(
            y, v, chain.inverse_mass, chain.stiffness, chain.rows, chain.yielding, numbers.gravity, numbers.flexibility,
            wall_start, rate, dt, steps,
        )  # fmt: skip
    elif method == LOSSY_VERLET:
        impulse, impulse_behind, lost, work = _lossy_verlet(y, v, chain, t, wall_start, rate, dt, steps)
    else:
        impulse, impulse_behind, lost, work = _rk4(y, v, chain, t, wall_start, rate, dt, steps)
    if chain.numbers.drive == FREE:
        impulse_behind = 0.0
    return impulse, impulse_behind, lost, work


@njit(cache=True)
def advance(y, v, chain, method, steps, t, window, wall_start, wall_end):
    """Moves y, v on by one window from time t in place. method: None is VERLET, and compiles nothing else.

    Returns the mean forces on the structure and on body 0 where it is no striker (else zero), the energy lost and the
    drive's work.
    """
    dt, rate = window / steps, (wall_end - wall_start) / window
    if method is not None and method != VERLET:
        impulse, impulse_behind, lost, work = _advance_any(y, v, chain, method, t, wall_start, rate, dt, steps)
        return impulse / window, impulse_behind / window, lost, work
    numbers = chain.numbers
    impulse = _verlet(
        y, v, chain.inverse_mass, chain.stiffness, numbers.gravity, numbers.flexibility, wall_start, rate, dt, steps
    )
    return impulse / window, 0.0, 0.0, 0.0


@njit(cache=True)
def advance_condensed(
    start_y, start_v, y, v, chain, method, steps, t, window, wall_start, wall_free, compliance, static, guess, tolerance
):
    """One window against a linear structure whose surface ends at w = wall_free + compliance · (F̄ − static).

    The secant method on F̄ from the parabola through those of the last three windows; guess = (F̄ − static, slope, the
    two before), which is updated. The residual falls at least as fast as F̄ rises, so its slope is −1 or steeper and
    nothing is divided by zero, an open gap included. Where a loss makes the force jump as the contact opens there may
    be no root: the interval that holds the jump is halved. y, v: the end, from start_y, start_v.
    Returns the mean force, the energy lost, the drive's work, the evaluations and the residual.
    """
    tried, slope = max(3.0 * (guess[0] - guess[2]) + guess[3] + static, 0.0), guess[1]
    last_tried, last_residual, residual = 0.0, 0.0, np.inf
    low, high, halved = -np.inf, np.inf, False
    for count in range(1, 61):
        _copy(start_y, y)
        _copy(start_v, v)
        wall_end = wall_free + compliance * (tried - static)
        force, _, lost, driven = advance(y, v, chain, method, steps, t, window, wall_start, wall_end)
        residual = force - tried
        if not abs(residual) > tolerance or compliance == 0.0:
            break
        if residual > 0.0:
            low = max(low, tried)
        else:
            high = min(high, tried)
        # A loss that jumps as the contact opens leaves no root, but a jump over zero.
        if high - low <= tolerance:
            residual = 0.0
            break
        # Alike where the tolerance is below rounding.
        if count > 1 and not halved and tried != last_tried:
            slope = min((residual - last_residual) / (tried - last_tried), -1.0)
        last_tried, last_residual = tried, residual
        tried -= residual / slope
        halved = count > 8 and high < np.inf and low > -np.inf
        if halved:
            tried = 0.5 * (low + high)
    guess[0], guess[1], guess[2], guess[3] = force - static, slope, guess[0], guess[2]
    return force, lost, driven, count, 0.0 if compliance == 0.0 else residual


@njit(cache=True)
def _hertz_forces(y, stiffness, flexibility, wall, out):
    """Instantaneous forces of Hertz's contacts without losses, with the bits of `_accelerate`."""
    last = y.size - 1
    overlap = y[last] - wall
    if flexibility != 0.0 and overlap > NEGLIGIBLE:
        overlap = _hertz_on_spring(stiffness[last] * flexibility, overlap)
    for i in range(last + 1):
        approach = overlap if i == last else y[i] - y[i + 1]
        # Multiplied in the order of `_accelerate_rigid`: the same bits.
        out[i] = stiffness[i] * sqrt(approach) * approach if approach > NEGLIGIBLE else 0.0


@njit(cache=True)
def contact_forces(y, v, chain, t, wall, rate, out):
    """Instantaneous forces of all contacts into out; a force history stands for contact 1 where there is none."""
    inverse_mass, stiffness, table, rows, damping, history, vibrations, yielding, numbers = chain
    a = np.empty_like(y)
    out[:] = 0.0
    _accelerate(
        y, v, wall, rate, 0.0, 0.0, inverse_mass, stiffness, table, rows, damping, vibrations, yielding, numbers, a, out
    )
    if numbers.drive == PUSHED and stiffness[0] == 0.0:
        out[0] = _value(history, t)[0]


@njit(cache=True)
def _vibration_energies(y, v, stiffness, table, rows, vibrations, numbers, wall, potential, overlaps, forces):
    """Kinetic energy of vibrations, and a potential energy with theirs; the contacts' overlaps and forces in place."""
    if vibrations is None:
        return 0.0, potential
    last, kinetic = stiffness.size - 1, 0.0
    _poles(y, vibrations, wall, overlaps)
    _settle(overlaps.copy(), vibrations.cross, stiffness, table, rows, numbers, forces, overlaps)
    squares, arm = vibrations.stiffness.ravel(), vibrations.arm.ravel()
    for k in range(squares.size):
        place = last + 1 + k
        kinetic += 0.5 * v[place] * v[place]
        potential += 0.5 * squares[k] * y[place] * y[place]
    for k in range(arm.size):
        potential += 0.5 * arm[k] * (y[last + 1 + k] - y[last + 1 + arm.size + k]) ** 2
    for i in range(1, last + 1):
        potential -= vibrations.cross[i] * forces[i - 1] * forces[i]
    return kinetic, potential


@njit(cache=True)
def _yielding_energies(y, v, inverse_mass, rows, yielding, numbers, wall, potential):
    """Kinetic energy, and a potential energy with what contacts that yield would return."""
    kinetic = 0.0
    if yielding is None:
        return kinetic, potential
    bodies = yielding.begin.size
    for i in range(bodies):
        if inverse_mass[i] > 0.0:
            kinetic += 0.5 * v[i] * v[i] / inverse_mass[i]
            potential -= numbers.gravity * y[i] / inverse_mass[i]
        approach = y[i] - (y[i + 1] if i < bodies - 1 else wall)
        flexibility = numbers.flexibility if i == bodies - 1 else numbers.flexibility_behind if i == 0 else 0.0
        hard, elastic = y[2 * bodies + i], approach - y[3 * bodies + i]
        if approach > y[bodies + i] or flexibility != 0.0:
            hard, elastic, _ = _yielded(i, rows, yielding, y, approach, flexibility)
        if elastic > NEGLIGIBLE:
            force = hard * (elastic * sqrt(elastic))
            potential += 0.5 * flexibility * force * force
            potential += hard * (0.4 * elastic * elastic * sqrt(elastic))
    return kinetic, potential


@njit(cache=True)
def energies(y, v, chain, wall):
    """Kinetic energy, and the potential energy of contacts, gravity, dead load and the striker's spring, J."""
    inverse_mass, stiffness, table, rows, _, _, vibrations, yielding, numbers = chain
    last = inverse_mass.size - 1
    overlaps, forces = np.zeros(last + 1), np.zeros(last + 1)
    kinetic = 0.0
    potential = 0.5 * numbers.spring * max(numbers.spring_end - y[0], 0.0) ** 2 - numbers.preload * y[1]
    if _yields(yielding):
        return _yielding_energies(y, v, inverse_mass, rows, yielding, numbers, wall, potential)
    vibrating = y.size > last + 1
    if vibrating:
        kinetic, potential = _vibration_energies(
            y, v, stiffness, table, rows, vibrations, numbers, wall, potential, overlaps, forces
        )
    for i in range(last + 1):
        if inverse_mass[i] > 0.0:
            kinetic += 0.5 * v[i] * v[i] / inverse_mass[i]
            potential -= numbers.gravity * y[i] / inverse_mass[i]
        overlap = overlaps[i] if vibrating else y[i] - (y[i + 1] if i < last else wall)
        flexibility = numbers.flexibility if i == last else numbers.flexibility_behind if i == 0 else 0.0
        if flexibility != 0.0:
            if not vibrating:
                overlap = _overlap_on_spring(stiffness[i], table[i], rows, overlap, flexibility)
            force = stiffness[i] * _shape(table[i], rows, overlap)
            potential += 0.5 * flexibility * force * force
        potential += stiffness[i] * _shape_energy(table[i], rows, overlap)
    return kinetic, potential


@njit(cache=True)
def frame(y, v, chain, t, wall, rate, out):
    """What is saved of an instant: contact_forces into out, and energies, in one call."""
    contact_forces(y, v, chain, t, wall, rate, out)
    return energies(y, v, chain, wall)


@njit(cache=True)
def _table_energies(rows, approach, out):
    for i in range(approach.size):
        out[i] = _shape_energy(0, rows, approach[i])


def table_energies(rows: np.ndarray, approach: np.ndarray) -> np.ndarray:
    """∫F dδ of a tabulated contact, J, at approaches of any shape."""
    flat = np.ascontiguousarray(approach, dtype=float).reshape(-1)
    out = np.empty_like(flat)
    _table_energies(rows, flat, out)
    return out.reshape(np.shape(approach))


@njit(cache=True)
def first_bad(y, v, wall):
    """Index of the first bead whose state is not finite; N + 1 where only the surface is not; −1 where all is well."""
    for i in range(y.size):
        if not (np.isfinite(y[i]) and np.isfinite(v[i])):
            return i
    return -1 if np.isfinite(wall) else y.size


@njit(cache=True)
def _propagate(spread, state, out):
    """The state at a window's end where no force acts, see structures.moving.Propagator."""
    parts = spread.shape[0]
    count = spread.shape[1] // parts
    if parts == 2 and count > 1:
        # Modes, displacement and velocity: one pass that the compiler turns into vector instructions.
        for k in range(count):
            u, v = state[k], state[count + k]
            out[k] = spread[0, k] * u + spread[1, k] * v
            out[count + k] = spread[0, count + k] * u + spread[1, count + k] * v
        return
    out[:] = 0.0
    for j in range(parts):
        if count == 1:
            for i in range(parts):
                out[i] += spread[j, i] * state[j]
        else:
            for i in range(parts):
                for k in range(count):
                    out[i * count + k] += spread[j, i * count + k] * state[j * count + k]


@njit(cache=True, fastmath={"contract", "reassoc"})
def _dot(a, b):
    """Of the first entries of b, as many as a has."""
    total = 0.0
    for i in range(a.size):
        total += a[i] * b[i]
    return total


@njit(cache=True)
def _square(matrix, x):
    """½ xᵀ M x; a matrix of one row holds its diagonal."""
    total = 0.0
    for i in range(x.size):
        total += x[i] * (matrix[0, i] * x[i] if matrix.shape[0] == 1 else _dot(matrix[i], x))
    return 0.5 * total


@njit(cache=True)
def _vibrations(squares, chains, c):
    """The Vibrations of the bodies of one chain. Only of an argument Numba knows beforehand that it is None."""
    if squares is None:
        return None
    _, first, _, modes, lossy, arms, _ = chains.layout[c]
    _, last, _, last_mode, last_lossy, last_arm, _ = chains.layout[c + 1]
    shape = (last - first, (last_mode - modes) // (last - first))
    return Vibrations(
        squares[modes:last_mode].reshape(shape), chains.struck[modes:last_mode].reshape(shape),
        chains.far[modes:last_mode].reshape(shape), chains.cross[first:last],
        _table(chains.rate[lossy:last_lossy], last - first), _table(chains.arm[arms:last_arm], last - first),
        _table(chains.relaxation[arms:last_arm], last - first),
    )  # fmt: skip


@njit(cache=True)
def _table(numbers, rows):
    """Numbers of bodies as rows."""
    return numbers.reshape((rows, numbers.size // rows))


@njit(cache=True)
def _yielding(yielding, first, last):
    """The Yielding of one chain."""
    if yielding is None:
        return None
    return Yielding(
        yielding.begin[first:last], yielding.force[first:last], yielding.loading[first:last], yielding.dent[first:last]
    )


@njit(cache=True)
def _method(methods, c):
    """How one chain is advanced."""
    return None if methods is None else methods[c]


@njit(cache=True)
def _constants(chains, c):
    """The Constants of one chain."""
    first, times, contacts = chains.layout[c, 1], chains.layout[c, 2], chains.layout[c, 6]
    last, last_time, last_contact = chains.layout[c + 1, 1], chains.layout[c + 1, 2], chains.layout[c + 1, 6]
    given = chains.numbers[c]
    numbers = Numbers(
        int(given[0]), given[1], given[2], given[3], given[4], given[5], given[6], given[7], int(given[8])
    )
    history = chains.history[times:last_time]
    return Constants(
        chains.inverse_mass[first:last], chains.stiffness[first:last], chains.table[first:last], chains.rows,
        chains.damping[first:last], history.reshape((3, history.size // 3)),
        _vibrations(chains.squares, chains, c), _yielding(chains.yielding, contacts, last_contact), numbers,
    )  # fmt: skip


@njit(cache=True)
def _let_go(structures, body, free):
    """The states of all structures at a window's end where no force acts."""
    for s in range(structures.layout.shape[0] - 1):
        now, then = structures.layout[s], structures.layout[s + 1]
        state, parts = body[now[0] : then[0]], now[6]
        _propagate(structures.spread[now[4] : then[4]].reshape((parts, state.size)), state, free[now[0] : then[0]])


@njit(cache=True)
def _read(structures, seats, states, out):
    """The displacements of the contacts in states of the structures."""
    for k in range(out.size):
        now = structures.layout[seats.structure[k]]
        size = now[7]
        first = now[1] + seats.point[k] * size
        out[k] = _dot(structures.contact[first : first + size], states[now[0] : now[0] + size])


@njit(cache=True)
def _push(structures, seats, force, body):
    """Add what mean forces on the contacts add to the states of the structures in a window."""
    for k in range(force.size):
        s = seats.structure[k]
        now, size = structures.layout[s], structures.layout[s + 1, 0] - structures.layout[s, 0]
        first = now[5] + seats.point[k] * size
        for i in range(size):
            body[now[0] + i] += force[k] * structures.response[first + i]


@njit(cache=True)
def _end(structures, seats, force, free, body):
    """The states of the structures at a window's end, from those where no force acts and the mean forces."""
    _copy(free, body)
    _push(structures, seats, force, body)
    for i in range(body.size):
        body[i] = body[i] if abs(body[i]) >= NEGLIGIBLE**3 else 0.0


@njit(cache=True)
def _add(force, response, free, body):
    """The same for one contact."""
    nothing = 0.0
    for i in range(body.size):
        value = free[i] + force * response[i]
        body[i] = value if abs(value) >= NEGLIGIBLE**3 else nothing


@njit(cache=True)
def _compliance(structures, seats):
    """The displacement of each contact for 1 N of mean force on each, K × K, m/N."""
    count = seats.structure.size
    found, column = np.zeros((count, count)), np.empty(count)
    for k in range(count):
        body, force = np.zeros(structures.layout[-1, 0]), np.zeros(count)
        force[k] = 1.0
        _push(structures, seats, force, body)
        _read(structures, seats, body, column)
        _copy(column, found[:, k])
    return found


@njit(cache=True)
def _predict(run, at, out):
    """The parabola through the last three mean forces, or what fewer give, at another time."""
    count = min(max(run.counts[0], 0), 3)
    out[:] = 0.0
    for i in range(count):
        weight, place = 1.0, run.node_time[i] - run.node_length[i] / 2.0
        for j in range(count):
            if j != i:
                other = run.node_time[j] - run.node_length[j] / 2.0
                weight *= (at - other) / (place - other)
        for k in range(out.size):
            out[k] += weight * run.node_force[i, k]


@njit(cache=True)
def _corners(run, quadratic, surface, window):
    """Displacements of the surfaces between which they move straight, at equal times of a window.

    A parabola through the node before is replaced by PIECES straight pieces.
    """
    if not quadratic or run.counts[0] == 0:
        found = np.empty((2, surface.size))
        _copy(run.surface, found[0])
        _copy(surface, found[1])
        return found
    found, last = np.empty((PIECES + 1, surface.size)), run.node_length[0]
    for k in range(surface.size):
        before, end = run.surface[k], surface[k]
        earlier = run.node_surface[1, k] if run.counts[0] > 1 else 0.0
        bend = 2.0 * ((end - before) / window - (before - earlier) / last) / (window + last)
        for i in range(PIECES + 1):
            part = i / PIECES
            found[i, k] = before + part * (end - before) + 0.5 * bend * window**2 * part * (part - 1.0)
    return found


@njit(cache=True)
def _follow(y, v, chain, method, steps, rest, t, window, corners, behind, static, force, work):
    """One chain against surfaces that move from corner to corner; one or two contacts. y, v in place.

    steps: in a window, and in a piece of it. Adds the mean forces above the static ones and their works. Returns the
    energy lost and the drive's work.
    """
    pieces = corners.shape[0] - 1
    part, lost, driven = window / pieces, 0.0, 0.0
    count = steps[0] if pieces == 1 else steps[1]
    for p in range(pieces):
        ahead, back = 0, -1
        for k in range(force.size):
            if behind[k]:
                back = k
            else:
                ahead = k
        if back >= 0:
            y[0] = rest - corners[p, back]
            v[0] = (corners[p, back] - corners[p + 1, back]) / part
        front, rear, loss, drive = advance(
            y, v, chain, method, count, t + p * part, part, corners[p, ahead], corners[p + 1, ahead]
        )
        if back >= 0:
            y[0] = rest - corners[p + 1, back]
        lost += loss
        driven += drive
        for k in range(force.size):
            push = (rear if behind[k] else front) - static[k]
            force[k] += push / pieces
            work[k] += push * (corners[p + 1, k] - corners[p, k])
    return lost, driven


@njit(cache=True)
def _solve(matrix, right):
    """The solution of a few linear equations, in place, by Gauss's elimination with pivots."""
    size = right.size
    for i in range(size):
        pivot = i
        for j in range(i + 1, size):
            if abs(matrix[j, i]) > abs(matrix[pivot, i]):
                pivot = j
        if pivot != i:
            for j in range(size):
                matrix[i, j], matrix[pivot, j] = matrix[pivot, j], matrix[i, j]
            right[i], right[pivot] = right[pivot], right[i]
        for j in range(i + 1, size):
            factor = matrix[j, i] / matrix[i, i]
            for k in range(i, size):
                matrix[j, k] -= factor * matrix[i, k]
            right[j] -= factor * right[i]
    for i in range(size - 1, -1, -1):
        for j in range(i + 1, size):
            right[i] -= matrix[i, j] * right[j]
        right[i] /= matrix[i, i]


@njit(cache=True, inline="always")
def _reach(before, after):
    """The part of the way from one force to another on which it pushes."""
    if after > 0.0:
        return 1.0
    return before / (before - after) if before > 0.0 else 0.0


@njit(cache=True)
def _separate(softness, rate, near, pressed):
    """Λ ≥ 0 with rate + softness · Λ ≥ 0, and zero where Λ > 0, into pressed; zero for gaps that are not near.

    Lawson and Hanson's active set. It starts with the gaps that would close, which mostly is the answer.
    """
    size, scale = rate.size, 0.0
    pressed[:] = 0.0
    active, unit = np.zeros(size, dtype=np.bool_), np.empty(size)
    for g in range(size):
        unit[g] = sqrt(softness[g, g])
        active[g] = near[g] and rate[g] < 0.0
        if near[g]:
            scale = max(scale, abs(rate[g]) / unit[g])
    for _ in range(3 * size):
        share = 0.0
        while share < 1.0:
            chosen = np.flatnonzero(active)
            matrix, force, share = np.empty((chosen.size, chosen.size)), np.empty(chosen.size), 1.0
            for i in range(chosen.size):
                force[i] = -rate[chosen[i]]
                for j in range(chosen.size):
                    matrix[i, j] = softness[chosen[i], chosen[j]]
            _solve(matrix, force)
            # Go towards this solution until the first force vanishes; such a gap opens.
            for i in range(chosen.size):
                share = min(share, _reach(pressed[chosen[i]], force[i]))
            for i in range(chosen.size):
                g = chosen[i]
                if force[i] <= 0.0 and _reach(pressed[g], force[i]) <= share:
                    active[g], pressed[g] = False, 0.0
                else:
                    pressed[g] += share * (force[i] - pressed[g])
        worst, most = -1, SETTLED
        for g in range(size):
            if near[g] and not active[g]:
                closing = -(rate[g] + _dot(softness[g], pressed)) / unit[g]
                if closing > most * scale:
                    worst, most = g, closing / scale
        if worst < 0:
            return
        active[worst] = True


@njit(cache=True)
def _leap(gaps, span, body, before, free, force, after, pressed):
    """A step of the implicit midpoint rule, in which each gap is open or presses; see structures.closing.

    body, before: state and forces of the gaps at its beginning; after, pressed: at its end. free: the state at the end
    where no force acts. force: of the contacts before the gaps. Returns the energy that damping and gaps took.
    """
    size, count = gaps.place.shape[1], gaps.opening.size
    points = span.response.shape[0] - count
    near, rate, any_near = np.zeros(count, dtype=np.bool_), np.zeros(count), False
    _copy(free, after)
    for k in range(span.response.shape[0]):
        push = force[k] if k < points else -gaps.preload[k - points]
        if push != 0.0 or k < points:
            _add(push, span.response[k], after, after)
    for g in range(count):
        speed = _dot(gaps.rate[g], body[size:])
        middle = gaps.opening[g] + _dot(gaps.place[g], body) + 0.5 * span.length * speed
        near[g] = before[g] > 0.0 or (middle <= 0.0 and speed <= 0.0)
        any_near = any_near or near[g]
    pressed[:] = 0.0
    if any_near:
        for g in range(count):
            rate[g] = _dot(gaps.rate[g], after[size:])
        _separate(span.softness, rate, near, pressed)
    taken = 0.0
    for g in range(count):
        if pressed[g] > 0.0:
            _add(pressed[g], span.response[points + g], after, after)
    for g in range(count):
        if pressed[g] > 0.0:
            taken -= pressed[g] * (_dot(gaps.place[g], after) - _dot(gaps.place[g], body))
    if gaps.damping.shape[0] > 0:
        # The midpoint's mean velocity is the way over the time, also of what has no mass.
        taken += 2.0 * _square(gaps.damping, after[:size] - body[:size]) / span.length
    return taken


@njit(cache=True)
def _switched(gaps, before, after, pressed):
    """Whether a gap closed on the way, or should have closed."""
    size = gaps.place.shape[1]
    for g in range(pressed.size):
        if pressed[g] > 0.0:
            if before[g] == 0.0:
                return True
        elif gaps.opening[g] + _dot(gaps.place[g], after) < 0.0 and _dot(gaps.rate[g], after[size:]) < 0.0:
            return True
    return False


@njit(cache=True)
def _close(gaps, body, before, free, force, after, pressed):
    """The same over a window, which is divided into parts if a gap closes in it."""
    taken = _leap(gaps, gaps.whole, body, before, free, force, after, pressed)
    if not _switched(gaps, before, after, pressed):
        return taken
    taken, state, now, alone, mean = 0.0, body.copy(), before.copy(), np.empty_like(body), np.zeros(pressed.size)
    for _ in range(gaps.parts):
        _propagate(gaps.part.spread, state, alone)
        taken += _leap(gaps, gaps.part, state, now, alone, force, after, pressed)
        _copy(after, state)
        _copy(pressed, now)
        for g in range(pressed.size):
            mean[g] += pressed[g] / gaps.parts
    for g in range(pressed.size):
        # What opened again is open: its faces move apart.
        pressed[g] = mean[g] if pressed[g] > 0.0 else 0.0
    return taken


@njit(cache=True)
def _move_gaps(gaps, structures, seats, run, free, force, after, pressed, surface):
    """The only structure, whose gaps close, at a window's end, and its surfaces. Returns the energy taken."""
    push = np.zeros(gaps.whole.response.shape[0])
    for k in range(force.size):
        push[seats.point[k]] = force[k]
    taken = _close(gaps, run.body, run.pressed, free, push, after, pressed)
    _read(structures, seats, after, surface)
    return taken


@njit(cache=True)
def _agree(
    run, y, v, chains, structures, gaps, seats, steps, t, window, free, at_rest, compliance, quadratic, search, found,
    own, after, pressed,
):  # fmt: skip
    """Repeat a window until r(F) = G(w_free + C F) − F vanishes, where G are the chains' mean forces.

    Where gaps close, the surfaces follow from the forces in another way, and the structure's state at the end is
    `after`, with `pressed`. free: the states at the end where no force acts.

    Fills y, v (at the window's end), and found: rows of mean forces, of the chains' answers, of their works, of
    surfaces, and of the chains' losses and their drives' works. own: 2 × trials × K, for the differences of least
    squares. Returns the evaluations, the greatest residual, which is infinite where surfaces still move, and the energy
    that gaps and damping took where gaps close.
    """
    force, answer, work, surface = found[0], found[1], found[2], found[3]
    count, slope, residual, rigid = force.size, run.slope.copy(), np.inf, not compliance.any()
    _predict(run, t + window / 2.0, force)
    for k in range(count):
        force[k] = max(force[k], -seats.static[k])
    last_surface, last_answer, last_gap = at_rest.copy(), force.copy(), np.zeros(count)
    matrix, change, gap = np.empty((count, count)), np.empty(count), np.empty(count)
    # A literal 0 would be a type of its own, for which numba compiles what is called once more.
    factor, rows, taken = search.relaxation, np.int64(0), 0.0
    for tried in range(1, search.most + 1):
        if gaps is None:
            for k in range(count):
                surface[k] = at_rest[k]
                for j in range(count):
                    surface[k] += compliance[k, j] * force[j]
        else:
            taken = _move_gaps(gaps, structures, seats, run, free, force, after, pressed, surface)
        corners = _corners(run, quadratic, surface, window)
        _copy(run.y, y)
        _copy(run.v, v)
        answer[:], work[:] = 0.0, 0.0
        for c in range(chains.rest.size):
            first, last = chains.layout[c, 0], chains.layout[c + 1, 0]
            begin, end = seats.own[c], seats.own[c + 1]
            found[4, c], found[5, c] = _follow(
                y[first:last], v[first:last], _constants(chains, c), _method(chains.method, c), steps[c],
                chains.rest[c], t, window, corners[:, begin:end], seats.behind[begin:end], seats.static[begin:end],
                answer[begin:end], work[begin:end],
            )  # fmt: skip
        residual, moved = 0.0, 0.0
        for k in range(count):
            if rigid:
                force[k] = answer[k]
            residual = max(residual, abs(answer[k] - force[k]))
            moved = max(moved, abs(surface[k] - last_surface[k]))
            gap[k] = answer[k] - force[k]
        if not residual > search.tolerance:
            if search.kind == NEWTON or tried == 1 or not moved > search.still:
                _copy(slope, run.slope)
                _remember(run, own, rows, window)
                break
            residual = np.inf
        if search.kind == NEWTON:
            for k in range(count):
                change[k] = gap[k]
                way = surface[k] - last_surface[k]
                if tried > 1 and abs(way) > search.still:
                    slope[k] = min((answer[k] - last_answer[k]) / way, 0.0)
                for j in range(count):
                    matrix[k, j] = (1.0 if j == k else 0.0) - slope[k] * compliance[k, j]
            _solve(matrix, change)
        elif search.kind == LEAST_SQUARES:
            if tried > 1:
                for k in range(count):
                    own[0, rows, k], own[1, rows, k] = gap[k] - last_gap[k], answer[k] - last_answer[k]
                rows += 1
            _quasi_newton(run, own, rows, gap, window, search, change)
        else:
            if search.kind == AITKEN and tried > 1:
                along, square = 0.0, 0.0
                for k in range(count):
                    along += last_gap[k] * (gap[k] - last_gap[k])
                    square += (gap[k] - last_gap[k]) ** 2
                if square > 0.0:
                    factor *= -along / square
            for k in range(count):
                change[k] = factor * gap[k]
        _copy(surface, last_surface)
        _copy(answer, last_answer)
        _copy(gap, last_gap)
        for k in range(count):
            force[k] += change[k]
    return tried, residual, taken


@njit(cache=True)
def _quasi_newton(run, own, rows, gap, window, search, change):
    """The change of forces that cancels the residual, as far as differences of this window and of others allow.

    They are taken newest first; one that adds too little to those before it is dropped.
    """
    size, kept = gap.size, 0
    directions, changes, upper = np.empty((size, size)), np.empty((size, size)), np.empty((size, size))
    rest, factors = np.empty(size), np.empty(size)
    for place in range(-1, run.remembered.shape[0]):
        if place >= 0 and run.remembered[place, 1] != window:
            continue
        many = rows if place < 0 else int(run.remembered[place, 0])
        for row in range(many - 1, -1, -1):
            if kept == size:
                break
            _copy(own[0, row] if place < 0 else run.memory[place, 0, row], rest)
            whole = sqrt(_dot(rest, rest))
            for i in range(kept):
                upper[i, kept] = 0.0
            for _ in range(2):
                for i in range(kept):
                    part = _dot(directions[i], rest)
                    upper[i, kept] += part
                    for k in range(size):
                        rest[k] -= part * directions[i, k]
            length = sqrt(_dot(rest, rest))
            if length > search.filtering * whole:
                for k in range(size):
                    directions[kept, k] = rest[k] / length
                upper[kept, kept] = length
                _copy(own[1, row] if place < 0 else run.memory[place, 1, row], changes[kept])
                kept += 1
    for k in range(size):
        change[k] = gap[k] if kept > 0 else search.relaxation * gap[k]
    for i in range(kept - 1, -1, -1):
        right = -_dot(directions[i], gap)
        for j in range(i + 1, kept):
            right -= upper[i, j] * factors[j]
        factors[i] = right / upper[i, i]
        for k in range(size):
            change[k] += factors[i] * changes[i, k]


@njit(cache=True)
def _remember(run, own, rows, window):
    """Put the differences of a window before those of others, of which only those of the same length stay."""
    most, left = run.remembered.shape[0], np.int64(0)
    if most == 0:
        return
    for place in range(most):
        if run.remembered[place, 0] > 0 and run.remembered[place, 1] == window:
            _move(run.memory, run.remembered, place, left)
            left += 1
    for place in range(left, most):
        run.remembered[place, 0], run.remembered[place, 1] = 0.0, 0.0
    if rows == 0:
        return
    for place in range(min(left, most - 1), 0, -1):
        _move(run.memory, run.remembered, place - 1, place)
    for row in range(rows):
        for which in range(2):
            _copy(own[which, row], run.memory[0, which, row])
    run.remembered[0, 0], run.remembered[0, 1] = rows, window


@njit(cache=True)
def _move(memory, remembered, place, target):
    """What is remembered of a window, into another place."""
    if place != target:
        _copy(memory[place].reshape(-1), memory[target].reshape(-1))
        _copy(remembered[place], remembered[target])


@njit(cache=True, nogil=True)
def save(run, chains, structures, gaps, seats, t, row, saved):
    """Put the end of a window into a row; what lies in arrays without rows is left out."""
    whole = saved.kinetic.shape[1] > 0
    _copy(run.v, saved.velocity[row])
    _copy(run.surface, saved.surface[:, row])
    for c in range(chains.rest.size):
        first, last = chains.layout[c, 0], chains.layout[c + 1, 0]
        body, last_body = chains.layout[c, 1], chains.layout[c + 1, 1]
        y, v, k = run.y[first:last], run.v[first:last], seats.own[c]
        forces, chain = saved.contact_force[row, body:last_body], _constants(chains, c)
        rate = (run.surface[k] - run.node_surface[1, k]) / run.node_length[0] if run.counts[0] > 0 else 0.0
        contact_forces(y, v, chain, t, run.surface[k], rate, forces)
        if whole:
            saved.kinetic[c, row], saved.potential[c, row] = energies(y, v, chain, run.surface[k])
            saved.lost[c, row], saved.driven[c, row] = run.lost[c], run.driven[c]
    if whole:
        _save_ledger(run, structures, row, saved)
        if gaps is not None:
            saved.taken[0, row] = run.taken[0]
            for g in range(gaps.preload.size):
                saved.structure_elastic[0, row] += gaps.preload[g] * _dot(gaps.place[g], run.body)


@njit(cache=True)
def _save_ledger(run, structures, row, saved):
    """Positions, energies of the structures, works and impulses of the contacts, and the counts."""
    _copy(run.y, saved.position[row])
    for s in range(structures.layout.shape[0] - 1):
        now, then = structures.layout[s], structures.layout[s + 1]
        size, state = now[7], run.body[now[0] : then[0]]
        stiffness, mass = structures.stiffness[now[2] : then[2]], structures.mass[now[3] : then[3]]
        if size > 0:
            saved.structure_elastic[s, row] = _square(stiffness.reshape((stiffness.size // size, size)), state[:size])
        moving = state.size - size  # displacements without mass have no velocity
        if moving > 0:
            saved.structure_kinetic[s, row] = _square(mass.reshape((mass.size // moving, moving)), state[size:])
    for k in range(run.work.size):
        saved.work[k, row], saved.given[k, row], saved.impulse[k, row] = run.work[k], run.given[k], run.impulse[k]
    saved.evaluations[row], saved.substeps[row], saved.residual[row] = run.counts[1], run.counts[2], run.residual[0]
    run.counts[1:], run.residual[0] = 0, 0.0


@njit(cache=True, nogil=True)
def run_coupled(run, chains, structures, gaps, seats, steps, window, quadratic, search, windows, stride, saved):
    """The window loop of chains on linear structures, over the windows (first one, last one) from 1 on.

    gaps: of the only structure where its gaps close, else None; then nothing is compiled for them.
    run: a Run, in place. steps: C rows, of each chain in a window, and in a piece of it. stride: windows of a saved
    time; 0 saves nothing. quadratic: None for one contact whose surface moves linearly and whose force Newton's method
    finds; then what others need is not compiled.
    A window that fails leaves the run as it began. Returns how it ended, OK or what went wrong;
    the window; the chain, or the residual; and the body that is no longer finite.

    A tuple without names: Numba makes a named one in Python, where a signal that came meanwhile ends the process.
    """
    count, bodies = seats.static.size, run.body.size
    free, at_rest, push = np.zeros(bodies), np.empty(count), np.zeros(count)
    found, own = np.zeros((6, count)), np.empty((2, search.most, count))
    y, v, guess = run.y.copy(), run.v.copy(), run.guess.copy()
    after, pressed = run.body.copy(), run.pressed.copy()
    compliance, chain = _compliance(structures, seats), _constants(chains, np.int64(0))
    # Most runs of a batch: to pass all groups of arrays to `save` would take longer than a window.
    plain = chains.method is None and chains.rest.size == count == 1 and saved.kinetic.shape[1] == 0
    run_y, run_v, velocities, surfaces, forces = run.y, run.v, saved.velocity, saved.surface, saved.contact_force
    # Views of the only structure and its only contact: to make them in each window would take longer than its motion.
    only = structures.layout.shape[0] == 2 and count == 1
    parts, points = structures.layout[0, 6] if only else 1, structures.layout[0, 7] if only else 0
    spread = structures.spread[: parts * bodies if only else 0].reshape((parts, -1))
    contact = structures.contact[seats.point[0] * points :][:points]
    response = structures.response[seats.point[0] * bodies :][:bodies]
    for done in range(windows[0], windows[1] + 1):
        t = (done - 1) * window
        if only:
            _propagate(spread, run.body, free)
            at_rest[0] = _dot(contact, free)
        else:
            _let_go(structures, run.body, free)
            _read(structures, seats, free, at_rest)
        if quadratic is None:
            _copy(run.guess, guess)
            static, before, softness = seats.static[0], run.surface[0], compliance[0, 0]
            force, lost, driven, tried, residual = advance_condensed(
                run.y, run.v, y, v, chain, _method(chains.method, 0), steps[0, 0], t, window, before, at_rest[0],
                softness, static, guess, search.tolerance,
            )  # fmt: skip
            push[0] = force - static
            found[1, 0], found[4, 0], found[5, 0] = push[0], lost, driven
            found[3, 0] = at_rest[0] + softness * push[0]
            # The chain moved against the surface where the force before its last answer would have brought it.
            found[2, 0] = push[0] * (found[3, 0] - softness * residual - before)
        else:
            tried, residual, taken = _agree(
                run, y, v, chains, structures, gaps, seats, steps, t, window, free, at_rest, compliance, quadratic,
                search, found, own, after, pressed,
            )  # fmt: skip
            _copy(found[0], push)
        run.counts[1] += tried
        for c in range(chains.rest.size):
            first, last = chains.layout[c, 0], chains.layout[c + 1, 0]
            bad = first_bad(y[first:last], v[first:last], found[3, seats.own[c]])
            if bad >= 0:
                return NON_FINITE, done, float(c), bad
        if abs(residual) > search.tolerance:
            return NOT_CONVERGED, done, residual, 0
        _copy(y, run.y)
        _copy(v, run.v)
        # The rest of an old motion that damping leaves would end in subnormal numbers, which are slow: it becomes zero.
        if gaps is not None:
            _copy(after, run.body)
            _copy(pressed, run.pressed)
            run.taken[0] += taken
        elif only:
            _add(push[0], response, free, run.body)
        else:
            _end(structures, seats, push, free, run.body)
        for c in range(chains.rest.size):
            run.lost[c] += found[4, c]
            run.driven[c] += found[5, c]
        for i in range(2, 0, -1):
            run.node_time[i], run.node_length[i] = run.node_time[i - 1], run.node_length[i - 1]
            _copy(run.node_surface[i - 1], run.node_surface[i])
            _copy(run.node_force[i - 1], run.node_force[i])
        run.node_time[0], run.node_length[0] = done * window, window
        for k in range(count):
            run.work[k] += push[k] * (found[3, k] - run.surface[k])
            run.given[k] += found[2, k]
            run.impulse[k] += push[k] * window
            run.surface[k] = found[3, k]
            run.node_surface[0, k], run.node_force[0, k] = found[3, k], found[1, k]
        run.counts[0] = min(run.counts[0] + 1, 3)
        run.counts[2] += 1
        run.residual[0] = max(run.residual[0], abs(residual))
        if stride == 0 or done % stride != 0:
            continue
        if plain:
            row = done // stride
            for i in range(run_y.size):
                velocities[row, i] = run_v[i]
            surfaces[0, row] = run.surface[0]
            _hertz_forces(run_y, chain.stiffness, chain.numbers.flexibility, run.surface[0], forces[row])
        else:
            save(run, chains, structures, gaps, seats, done * window, done // stride, saved)
    return OK, 0, 0.0, 0
