"""Contact laws as pieces: the force of a contact as a function of its overlap, its slope and its energy."""

from math import sqrt
from typing import Any, NamedTuple

import numpy as np

from structures.kernels.compiling import inner
from structures.kernels.pieces import by_type
from structures.structure import Vector

# m. The front of a solitary wave decays doubly exponentially. Smaller overlaps would become subnormal numbers, which
# are slow.
NEGLIGIBLE = 1e-60
NEVER = 1e300  # m, the yield overlap of a contact that does not yield
# Cubics per octave of the overlap; tables begin at 2^-60 m and end after 57 octaves, at 2^-3 m.
BUCKETS, LOWEST, OCTAVES = 32, -60, 57
ROWS = np.arange(BUCKETS * OCTAVES + 1)
EDGES: Vector = np.ldexp(1.0 + ROWS % BUCKETS / BUCKETS, LOWEST + ROWS // BUCKETS)  # limits of the cubics, m
EDGES.setflags(write=False)
MOST_ITERATIONS = 50  # of Newton's method for a contact on a spring, which needs three to five


@by_type
def force(law: Any, i: int, overlap: float) -> float:
    """Return the elastic force of contact i, N; zero if it is open."""
    raise NotImplementedError


@by_type
def slope(law: Any, i: int, overlap: float) -> float:
    """Return dF/dδ of contact i, N/m."""
    raise NotImplementedError


@by_type
def energy(law: Any, i: int, overlap: float) -> float:
    """Return the energy that contact i returns as it opens, J."""
    raise NotImplementedError


@by_type
def elastic_overlap(law: Any, i: int, overlap: float) -> float:
    """Return the elastic part of the overlap of contact i, m; negative if its faces are apart."""
    return overlap


@by_type
def with_memory(law: Any, y: Vector) -> Any:
    """Return the law with the memory of its contacts, which is at the end of the coordinates."""
    return law


@by_type
def force_of_step(law: Any, i: int, overlap: float) -> float:
    """Return the force at the overlap of contact i at the end of a step, and remember this overlap."""
    return force(law, i, overlap)


@by_type
def lost_to_yielding(law: Any, before: Any, first: int, last: int) -> float:
    """Return the energy that the contacts from first to last have lost by yielding since the state `before`, J."""
    return 0.0


@by_type
def overlap_on_spring(law: Any, i: int, approach: float, flexibility: float) -> float:
    """Return the contact's own part δ_h of an approach shared with a linear spring: δ = δ_h + f F(δ_h)."""
    overlap = approach
    if approach <= NEGLIGIBLE:
        return overlap
    for _ in range(MOST_ITERATIONS):
        excess = overlap + flexibility * force(law, i, overlap) - approach
        change = excess / (1.0 + flexibility * slope(law, i, overlap))
        overlap -= change
        if not abs(change) > 1e-15 * overlap:
            break
    return overlap


@inner()
def hertz_on_spring(scale: float, approach: float) -> float:
    """Return δ_h of δ = δ_h + scale δ_h^1.5: with g = √(δ_h/δ) and z = scale √δ, g² + z g³ = 1."""
    if approach <= NEGLIGIBLE:
        return approach
    z = scale * sqrt(approach)
    # The first step of Newton's method from g = 1. A few more steps suffice if the spring is stiffer than the contact.
    part = 1.0 - z / (2.0 + 3.0 * z)
    for _ in range(MOST_ITERATIONS):
        change = (part * part * (1.0 + z * part) - 1.0) / (part * (2.0 + 3.0 * z * part))
        part -= change
        # Convergence is quadratic: after so small a change the next one would be rounding.
        if not abs(change) > 1e-9 * part:
            break
    return part * part * approach


@inner(forceinline=True)
def hertz(stiffness: float, overlap: float) -> tuple[float, float, float]:
    """Return F = k δ^1.5, its slope dF/dδ and its integral ∫F dδ; zeros for an open contact."""
    closed = overlap if overlap > NEGLIGIBLE else 0.0
    root = sqrt(closed)
    return stiffness * closed * root, 1.5 * stiffness * root, stiffness * (0.4 * closed * closed * root)


class Hertz(NamedTuple):
    """F = k δ^1.5."""

    stiffness: Vector  # k of each contact, N/m^1.5; zero without a contact

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        return hertz(law.stiffness[i], overlap)[0]

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        return hertz(law.stiffness[i], overlap)[1]

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        return hertz(law.stiffness[i], overlap)[2]

    @staticmethod
    def overlap_on_spring(law: Any, i: int, approach: float, flexibility: float) -> float:
        return hertz_on_spring(law.stiffness[i] * flexibility, approach)


@inner(forceinline=True)
def bucket(overlap: float) -> int:
    """Return the number of the cubic for an overlap, from the exponent and the leading five bits of the float."""
    bits: Any = np.float64(overlap).view(np.int64) >> (52 - 5)
    return min(max(bits - ((1023 + LOWEST) << 5), 0), BUCKETS * OCTAVES - 1)


@inner(forceinline=True)
def cubic(rows: Vector, row: int, overlap: float) -> tuple[float, float, float]:
    """Return the value of a cubic of a table, its slope, and the integral of the table from zero."""
    t = overlap - rows[row, 0]
    value, first, second, third = rows[row, 1], rows[row, 2], rows[row, 3], rows[row, 4]
    integral = rows[row, 5] + t * (value + t * (first / 2.0 + t * (second / 3.0 + t * third / 4.0)))
    return value + t * (first + t * (second + t * third)), first + t * (2.0 * second + t * 3.0 * third), integral


class Tabulated(NamedTuple):
    """F = k f(δ), where f is a table of cubics."""

    stiffness: Vector  # k of each contact
    first: Vector  # the first row of each contact's table
    rows: Vector  # rows of δ₀, f, f′, c₂, c₃ and ∫f dδ; see particles.laws.law.kernel_table

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        if overlap <= NEGLIGIBLE:
            return 0.0
        return law.stiffness[i] * cubic(law.rows, law.first[i] + bucket(overlap), overlap)[0]

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        if overlap <= NEGLIGIBLE:
            return 0.0
        return law.stiffness[i] * cubic(law.rows, law.first[i] + bucket(overlap), overlap)[1]

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        if overlap <= NEGLIGIBLE:
            return 0.0
        return law.stiffness[i] * cubic(law.rows, law.first[i] + bucket(overlap), overlap)[2]


class Mixed(NamedTuple):
    """One piece for some contacts, and another, which does not yield, for the others."""

    own: Any
    others: Any
    is_own: Vector  # whether a contact has the first piece

    @staticmethod
    def with_memory(law: Any, y: Vector) -> Any:
        return Mixed(with_memory(law.own, y), law.others, law.is_own)

    @staticmethod
    def lost_to_yielding(law: Any, before: Any, first: int, last: int) -> float:
        return lost_to_yielding(law.own, before.own, first, last)


def of_contact(function: Any) -> Any:
    """Return a function of Mixed: it calls `function` for the piece of contact i."""

    def call(law: Any, i: int, *more: float) -> float:
        return function(law.own, i, *more) if law.is_own[i] else function(law.others, i, *more)

    return staticmethod(call)


for of_piece in (force, slope, energy, overlap_on_spring, elastic_overlap, force_of_step):
    setattr(Mixed, of_piece.__name__, of_contact(of_piece))


class Yielding(NamedTuple):
    """Contacts that yield; see particles.laws.yielding. Their memory is at the end of the coordinates."""

    stiffness: Vector  # of the first loading, which is elastic, N/m^1.5
    begin: Vector  # the overlap at which each contact yields, m, or NEVER
    yield_force: Vector  # the force at that overlap, N
    loading: Vector  # the first row in `rows` of the force above yield_force, over the overlap above begin
    indentation: Vector  # the first row of the dent, m, over the largest overlap above begin
    rows: Vector
    limit: Vector  # memory: the overlaps beyond which the contacts yield further, m
    hard: Vector  # memory: the stiffnesses of unloading, N/m^1.5
    dent: Vector  # memory: the permanent dents, m

    @staticmethod
    def with_memory(law: Any, y: Vector) -> Any:
        n, end = law.begin.size, y.size
        return Yielding(
            law.stiffness, law.begin, law.yield_force, law.loading, law.indentation, law.rows,
            y[end - 3 * n : end - 2 * n], y[end - 2 * n : end - n], y[end - n : end],
        )  # fmt: skip

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        if overlap > law.limit[i]:
            return loading(law, i, overlap)[0]
        return hertz(law.hard[i], overlap - law.dent[i])[0]

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        """Return the slope of unloading, N/m, on which losses depend."""
        hard, dent = unloading(law, i, overlap, law.limit[i])
        return hertz(hard, overlap - dent)[1]

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        hard, dent = unloading(law, i, overlap, law.limit[i])
        return hertz(hard, overlap - dent)[2]

    @staticmethod
    def elastic_overlap(law: Any, i: int, overlap: float) -> float:
        return overlap - unloading(law, i, overlap, law.limit[i])[1]

    @staticmethod
    def force_of_step(law: Any, i: int, overlap: float) -> float:
        pressed = force(law, i, overlap)
        if overlap > law.limit[i]:
            law.hard[i], law.dent[i] = unloading(law, i, overlap, law.limit[i])
            law.limit[i] = overlap
        return pressed

    @staticmethod
    def lost_to_yielding(law: Any, before: Any, first: int, last: int) -> float:
        lost = 0.0
        for i in range(first, last + 1):
            if law.limit[i] > before.limit[i]:
                lost += max(plastic_work(law, i, law.limit[i]) - plastic_work(law, i, before.limit[i]), 0.0)
        return lost

    @staticmethod
    def overlap_on_spring(law: Any, i: int, approach: float, flexibility: float) -> float:
        overlap = law.dent[i] + hertz_on_spring(law.hard[i] * flexibility, approach - law.dent[i])
        if not overlap > law.limit[i]:
            return overlap
        overlap = approach
        for _ in range(MOST_ITERATIONS):
            pressed, rise, _ = loading(law, i, overlap)
            change = (overlap + flexibility * pressed - approach) / (1.0 + flexibility * rise)
            overlap = max(overlap - change, law.begin[i])
            if not abs(change) > 1e-15 * overlap:
                break
        return overlap


@inner(forceinline=True)
def loading(law: Any, i: int, overlap: float) -> tuple[float, float, float]:
    """Return the force at an overlap that is the largest so far, its slope, and the work of its part above F_y."""
    depth = overlap - law.begin[i]
    above, rise, work = cubic(law.rows, law.loading[i] + bucket(depth), depth)
    return law.yield_force[i] + above, rise, work


@inner(forceinline=True)
def unloading(law: Any, i: int, overlap: float, limit: float) -> tuple[float, float]:
    """Return the unloading stiffness, N/m^1.5, and the dent, m: the remembered ones up to `limit`, else new ones."""
    if not overlap > limit:
        return law.hard[i], law.dent[i]
    depth = overlap - law.begin[i]
    dent = cubic(law.rows, law.indentation[i] + bucket(depth), depth)[0]
    return loading(law, i, overlap)[0] / ((overlap - dent) * sqrt(overlap - dent)), dent


@inner(forceinline=True)
def plastic_work(law: Any, i: int, largest: float) -> float:
    """Return the energy that a contact with this largest overlap has lost, J."""
    begin = law.begin[i]
    if not largest > begin:
        return 0.0
    hard, dent = unloading(law, i, largest, begin)
    loaded = hertz(law.stiffness[i], begin)[2] + law.yield_force[i] * (largest - begin) + loading(law, i, largest)[2]
    return max(loaded - hertz(hard, largest - dent)[2], 0.0)
