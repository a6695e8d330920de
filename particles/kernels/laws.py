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
def hertz(stiffness: float, overlap: float) -> float:
    """Return k δ^1.5; zero for an open contact."""
    closed = overlap if overlap > NEGLIGIBLE else 0.0
    return stiffness * closed * sqrt(closed)


@inner(forceinline=True)
def hertz_energy(stiffness: float, overlap: float) -> float:
    """Return ∫k δ^1.5 dδ, J; zero for an open contact."""
    closed = overlap if overlap > NEGLIGIBLE else 0.0
    return stiffness * (0.4 * closed * closed * sqrt(closed))


class Hertz(NamedTuple):
    """F = k δ^1.5."""

    stiffness: Vector  # k of each contact, N/m^1.5; zero without a contact

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        return hertz(law.stiffness[i], overlap)

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        return float(1.5 * law.stiffness[i] * sqrt(overlap if overlap > NEGLIGIBLE else 0.0))

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        return hertz_energy(law.stiffness[i], overlap)

    @staticmethod
    def overlap_on_spring(law: Any, i: int, approach: float, flexibility: float) -> float:
        return hertz_on_spring(law.stiffness[i] * flexibility, approach)


@inner(forceinline=True)
def bucket(overlap: float) -> int:
    """Return the number of the cubic for an overlap, from the exponent and the leading five bits of the float."""
    bits: Any = np.float64(overlap).view(np.int64) >> (52 - 5)
    return min(max(bits - ((1023 + LOWEST) << 5), 0), BUCKETS * OCTAVES - 1)


@inner(forceinline=True)
def cubic(rows: Vector, row: int, overlap: float) -> float:
    """Return the value of a cubic of a table."""
    t = overlap - rows[row, 0]
    return rows[row, 1] + t * (rows[row, 2] + t * (rows[row, 3] + t * rows[row, 4]))


@inner(forceinline=True)
def cubic_slope(rows: Vector, row: int, overlap: float) -> float:
    """Return the slope of a cubic of a table."""
    t = overlap - rows[row, 0]
    return rows[row, 2] + t * (2.0 * rows[row, 3] + t * 3.0 * rows[row, 4])


@inner(forceinline=True)
def cubic_integral(rows: Vector, row: int, overlap: float) -> float:
    """Return the integral of a table from zero to an overlap."""
    t = overlap - rows[row, 0]
    return rows[row, 5] + t * (
        rows[row, 1] + t * (rows[row, 2] / 2.0 + t * (rows[row, 3] / 3.0 + t * rows[row, 4] / 4.0))
    )


def table_edges() -> Vector:
    """Return the limits of the cubics of a table, m."""
    i = np.arange(BUCKETS * OCTAVES + 1)
    edges: Vector = 2.0 ** (LOWEST + i // BUCKETS) * (1.0 + (i % BUCKETS) / BUCKETS)
    return edges


class Tabulated(NamedTuple):
    """F = k f(δ), where f is a table of cubics."""

    stiffness: Vector  # k of each contact
    first: Vector  # the first row of each contact's table
    rows: Vector  # rows of δ₀, f, f′, c₂, c₃ and ∫f dδ; see particles.laws.law.kernel_table

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        if overlap <= NEGLIGIBLE:
            return 0.0
        return law.stiffness[i] * cubic(law.rows, law.first[i] + bucket(overlap), overlap)

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        if overlap <= NEGLIGIBLE:
            return 0.0
        return law.stiffness[i] * cubic_slope(law.rows, law.first[i] + bucket(overlap), overlap)

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        if overlap <= NEGLIGIBLE:
            return 0.0
        return law.stiffness[i] * cubic_integral(law.rows, law.first[i] + bucket(overlap), overlap)


class Mixed(NamedTuple):
    """One piece for some contacts, and another for the others."""

    own: Any
    others: Any
    is_own: Vector  # whether a contact has the first piece

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        return force(law.own, i, overlap) if law.is_own[i] else force(law.others, i, overlap)

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        return slope(law.own, i, overlap) if law.is_own[i] else slope(law.others, i, overlap)

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        return energy(law.own, i, overlap) if law.is_own[i] else energy(law.others, i, overlap)

    @staticmethod
    def overlap_on_spring(law: Any, i: int, approach: float, flexibility: float) -> float:
        if law.is_own[i]:
            return overlap_on_spring(law.own, i, approach, flexibility)
        return overlap_on_spring(law.others, i, approach, flexibility)

    @staticmethod
    def elastic_overlap(law: Any, i: int, overlap: float) -> float:
        return elastic_overlap(law.own, i, overlap) if law.is_own[i] else elastic_overlap(law.others, i, overlap)

    @staticmethod
    def with_memory(law: Any, y: Vector) -> Any:
        return Mixed(with_memory(law.own, y), with_memory(law.others, y), law.is_own)

    @staticmethod
    def force_of_step(law: Any, i: int, overlap: float) -> float:
        return force_of_step(law.own, i, overlap) if law.is_own[i] else force_of_step(law.others, i, overlap)

    @staticmethod
    def lost_to_yielding(law: Any, before: Any, first: int, last: int) -> float:
        return lost_to_yielding(law.own, before.own, first, last)


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
            return loading_force(law, i, overlap)
        return float(hertz(law.hard[i], overlap - law.dent[i]))

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        """Return the slope of unloading, N/m, on which losses depend."""
        hard, dent = unloading(law, i, overlap)
        return float(1.5 * hard * sqrt(overlap - dent)) if overlap - dent > NEGLIGIBLE else 0.0

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        hard, dent = unloading(law, i, overlap)
        return hertz_energy(hard, overlap - dent)

    @staticmethod
    def elastic_overlap(law: Any, i: int, overlap: float) -> float:
        return float(overlap - unloading(law, i, overlap)[1])

    @staticmethod
    def force_of_step(law: Any, i: int, overlap: float) -> float:
        if overlap > law.limit[i]:
            law.limit[i] = overlap
            law.hard[i], law.dent[i] = unloading_after(law, i, overlap)
            return loading_force(law, i, overlap)
        return float(hertz(law.hard[i], overlap - law.dent[i]))

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
            return float(overlap)
        overlap = approach
        for _ in range(MOST_ITERATIONS):
            depth = overlap - law.begin[i]
            rise = cubic_slope(law.rows, law.loading[i] + bucket(depth), depth)
            excess = overlap + flexibility * loading_force(law, i, overlap) - approach
            change = excess / (1.0 + flexibility * rise)
            overlap = max(overlap - change, law.begin[i])
            if not abs(change) > 1e-15 * overlap:
                break
        return float(overlap)


@inner(forceinline=True)
def loading_force(law: Any, i: int, overlap: float) -> float:
    """Return the force of a contact at an overlap beyond its largest one, N."""
    depth = overlap - law.begin[i]
    return law.yield_force[i] + cubic(law.rows, law.loading[i] + bucket(depth), depth)


@inner(forceinline=True)
def unloading_after(law: Any, i: int, largest: float) -> tuple[float, float]:
    """Return the unloading stiffness (N/m^1.5) and the dent (m) of a contact after an overlap beyond yield."""
    depth = largest - law.begin[i]
    dent = cubic(law.rows, law.indentation[i] + bucket(depth), depth)
    return loading_force(law, i, largest) / ((largest - dent) * sqrt(largest - dent)), dent


@inner(forceinline=True)
def unloading(law: Any, i: int, overlap: float) -> tuple[float, float]:
    """Return unloading stiffness and dent: the remembered ones, or new ones if this overlap is larger than before."""
    if overlap > law.limit[i]:
        return unloading_after(law, i, overlap)
    return law.hard[i], law.dent[i]


@inner(forceinline=True)
def plastic_work(law: Any, i: int, largest: float) -> float:
    """Return the energy that a contact with this largest overlap has lost, J."""
    begin = law.begin[i]
    if not largest > begin:
        return 0.0
    depth = largest - begin
    beyond = cubic_integral(law.rows, law.loading[i] + bucket(depth), depth)
    hard, dent = unloading_after(law, i, largest)
    loaded = hertz_energy(law.stiffness[i], begin) + law.yield_force[i] * depth + beyond
    return max(loaded - hertz_energy(hard, largest - dent), 0.0)
