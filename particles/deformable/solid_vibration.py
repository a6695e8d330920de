"""Elastic modes of a free sphere by three-dimensional finite elements, to compare with those of `vibration`."""

from math import sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from particles.bead import Sphere
from particles.deformable.vibration import Vibration, drift, nearest_modes, of_modes, squeeze
from particles.laws.solid import QUARTERS
from particles.laws.solid_mesh import MIDPLANES, Eighth, SolidEighth, even_eighth, supported, turning
from structures.bodies.elasticity import shear_speed
from structures.checks import instance, positive, whole

CELLS = 5
"""Over the radius of a sphere that vibrates."""

CHANGED = 2.0
"""What a turn changes, `solid_mesh.turning`, halfway from nothing to the least that modes of another order have, 4."""

HIGHEST = 0.95
"""Of the highest frequency found, up to which all modes are."""

RIGID = 1e-3
"""ω², over the square of shear waves' rate across a radius, below which the motion is the rigid one."""

EIGHTHS = 8.0
"""Of the bead."""

Rows = NDArray[np.float64]


def vibration_of_solid(bead: Sphere, modes: int, spacing: float | None = None) -> Vibration:
    """Return the lowest elastic modes of a free sphere about the chain's axis, as `vibration` gives them, in three
    dimensions.

    spacing, m: size of the cells; by default a fifth of the radius, which leaves the six lowest frequencies of a steel
    sphere 0.4 % too high at most, and what moves the poles by 1 % off, but where two frequencies nearly meet.
    An eighth of a sphere has other modes too, at the same frequencies, and the mesh mixes them. So all the modes found
    are turned among themselves into those that a turn about the axis leaves alone and those that it changes
    (`solid_mesh.turning`), which are dropped.
    Raises ValueError for other beads, and where the mesh has fewer modes or too many cells.
    """
    bead = instance("bead", bead, Sphere, "a Sphere")
    modes, size = whole("modes", modes, 0), bead.radius / CELLS
    part = even_eighth(bead, size if spacing is None else positive("spacing", spacing, "m"))
    opposite, together = (supported(part, midplane) for midplane in MIDPLANES)
    pole = int(np.flatnonzero(part.box.max(axis=0) == 0.0)[0])
    between = drift(together.stiffness, together.weight, together.motions[2, pole])
    between -= squeeze(opposite.stiffness, opposite.motions[2, pole])
    return of_modes(_lowest_round(part, opposite, together, pole, modes), 0.5 * between / QUARTERS)


def _lowest_round(part: Eighth, opposite: SolidEighth, together: SolidEighth, pole: int, modes: int) -> Rows:
    """Return the lowest modes about the axis, modes × 4: ω², motion of the pole, momentum of the half, and −1 or 1."""
    shift = (shear_speed(part.bead.material) / part.bead.radius) ** 2
    turned, count = turning(part), 4 * modes + 8
    while modes:
        if count > opposite.weight.size // 3:
            raise ValueError(f"modes = {modes}: too many for so large cells; must be fewer, or spacing smaller")
        halves = [
            (*_round(half, turned, pole, count, shift), sign) for half, sign in ((opposite, -1.0), (together, 1.0))
        ]
        # Beyond the lesser of both highest, modes of the other half, or of the same frequency, may be missing.
        limit = HIGHEST**2 * min(highest for _, highest, _ in halves)
        rows = np.concatenate([np.column_stack([half, np.full(len(half), sign)]) for half, _, sign in halves])
        rows = rows[(rows[:, 0] < limit) & (rows[:, 0] > RIGID * shift)]
        if len(rows) >= modes:
            return rows[np.argsort(rows[:, 0])][:modes]
        count *= 2
    return np.empty((0, 4))


def _round(half: SolidEighth, turned: Any, pole: int, count: int, shift: float) -> tuple[Rows, float]:
    """Return ω², motion of the pole and momentum of the half of the modes about the axis among the lowest; and the
    highest ω².

    shift, 1/s²: taken off ω², so that the rigid motion does not stop the factorisation.
    """
    squares, shapes = nearest_modes(half.mass, half.stiffness, count, shift)
    changes, turns = np.linalg.eigh(shapes.T @ (turned[half.kept][:, half.kept] @ shapes))
    round_ones = turns[:, changes < CHANGED]
    squares_of_rings, mixture = np.linalg.eigh(round_ones.T @ (squares[:, None] * round_ones))
    # The whole bead has eight times the mass of the eighth that eigsh normalises.
    shapes = shapes @ round_ones @ mixture / sqrt(EIGHTHS)
    shapes *= np.where(shapes[half.motions[2, pole]] < 0.0, -1.0, 1.0)
    momenta = QUARTERS * (half.weight @ shapes)
    return np.stack([squares_of_rings, shapes[half.motions[2, pole]], momenta], axis=1), float(squares.max())
