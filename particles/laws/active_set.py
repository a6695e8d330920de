"""Contact without pull of two surfaces that face each other node by node: a primal-dual active set, no penalty."""

import numpy as np
from numpy.typing import NDArray

from structures.structure import Vector

MOST_CHANGES = 100
"""Of the set of nodes in contact, at one approach; ten are many."""

ROUNDING = 1e-10
"""Of forces and overlaps. A node on the contact's edge, whose force and gap are both zero, may be of either kind."""

Nodes = NDArray[np.bool_]


class ContactNotConverged(RuntimeError):
    """The nodes in contact, or the pressures, were not found. approach, m: where."""

    def __init__(self, message: str, approach: float) -> None:
        super().__init__(message)
        self.approach = approach


def contact_forces(compliance: Vector, gap: Vector, approach: float, touching: Nodes) -> tuple[Vector, Nodes]:
    """Return the forces of the m nodes, N, at an approach, m, and which of them touch.

    compliance: of both bodies together, m × m, m/N; gap: between the undeformed surfaces, m numbers, m; touching: which
    nodes to begin with, best those of an approach nearby. No node pulls, none overlaps (Hintermüller, Ito and Kunisch,
    SIAM J. Optim. 13 (2002) 865).
    Raises ContactNotConverged.
    """
    for _ in range(MOST_CHANGES):
        forces = np.zeros(gap.size)
        overlap = approach - gap
        forces[touching] = np.linalg.solve(compliance[np.ix_(touching, touching)], overlap[touching])
        free_overlap = overlap - compliance @ forces
        pushed, overlapped = -ROUNDING * np.abs(forces).max(), ROUNDING * abs(approach)
        changed = np.where(touching, forces >= pushed, free_overlap > overlapped)
        if np.array_equal(changed, touching):
            return forces, touching
        touching = changed
    raise ContactNotConverged(
        f"approach = {approach:.4g} m: the set of nodes in contact still changed after {MOST_CHANGES} trials; "
        "try another spacing",
        approach,
    )


def forces_of_steps(compliance: Vector, gap: Vector, approaches: Vector) -> Vector:
    """Return the force at each of ascending approaches, N, m; each active set begins with the last.

    Raises ContactNotConverged.
    """
    touching, total = gap < 0.5 * approaches[0], []
    touching[0] = True
    for approach in approaches:
        forces, touching = contact_forces(compliance, gap, float(approach), touching)
        total.append(forces.sum())
    return np.array(total)


def edge_approach(compliance: Vector, gap: Vector, last: int) -> float:
    """Return the approach, m, at which the edge of a round contact is the node `last`: its force is then just zero."""
    inside = slice(0, last + 1)
    right = np.stack([gap[inside], np.ones(last + 1)], axis=1)
    by_gap, by_approach = np.linalg.solve(compliance[inside, inside], right)[last]
    return float(by_gap / by_approach)
