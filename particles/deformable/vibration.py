"""Elastic vibrations of a free bead pushed at its two poles along its axis, and the poles' compliance beyond them.

Half a bead does, once with poles that move oppositely, once with poles that move together. Under a unit force at one
pole the other moves by b = (u_t − u_s)/2, relative to the centre of mass, where both poles move by u_s under unit
forces against each other, and by u_t under those the same way.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh

from particles.laws.axisymmetric_mesh import Spheroid, body_of, cells, motions
from structures.bodies.elasticity import body_matrices, shear_speed
from structures.linear_algebra.factor import factorise
from structures.material import Material
from structures.structure import Vector

# Cells over the radius, for up to TYPICAL modes: of a sphere, these come out 2e-5 too high, 7e-5 for a Poisson's ratio
# of 0.45; with 12 cells, three times as much. Meshes for more modes are finer in proportion.
CELLS, TYPICAL = 16, 10
BENDING_CELLS, FEWEST = 11, 2  # cells over √(radius × wall), the reach of a thin wall's bending, and through a wall


@dataclass(frozen=True, eq=False)
class Vibration:
    """Elastic free vibrations of a bead about its axis, lowest first, and the compliance of its poles beyond them.

    The amplitude q, √kg·m, obeys q″ + ω² q = struck F + far F′ under forces F and F′ along the chain on the two poles,
    which move by the sums of struck q and far q, and by the rigid motion.
    """

    frequencies: Vector  # ω, rad/s, without the rigid motion
    struck: Vector  # motion of the struck pole along the chain per unit amplitude, 1/√kg, never negative
    far: Vector  # that of the other pole; −struck where the mode is symmetric about the mid-plane, +struck else
    # Σ 2 struck²/ω² of the symmetric modes, m/N: what they let each pole move inwards under unit forces on both.
    compression: float
    # By what a unit force at one pole moves the other at rest relative to the centre of mass, beyond these modes, m/N.
    # In shells it falls as one over their number; in solid beads, where waves along the surface meet again at the other
    # pole, it goes on to change sign, at some 2 % of `compression`.
    cross: float
    # Momentum along the chain of the struck half per unit rate of the amplitude, √kg, 0 for modes not symmetric. Under
    # contacts that push with F and F′, the force through the mid-plane is (F + F′)/2 − Σ section q″.
    section: Vector


@lru_cache(maxsize=64)
def vibration(bead: Any, modes: int) -> Vibration:
    """Return the lowest elastic modes of a free Sphere, HollowSphere or Ellipsoid along the chain, mass-normalised.

    The elements leave the frequencies 1e-4 or less too high, and b 1e-4 off.
    """
    body: Any = body_of(bead, 1.0, "bead")
    longest = max(body.radius, body.half) / mode_spacing(body, modes) * (1.0 - 1e-9)
    rows, columns = max(ceil(longest * (1.0 - body.hollow)), FEWEST), max(ceil(0.5 * pi * longest), FEWEST)

    def place(angle: Vector, depth: Vector) -> Vector:
        """Cells of even size on each circle about the centre, whose depth is 1."""
        return np.stack([body.radius * (1.0 - depth) * np.sin(angle), -body.half * (1.0 - depth) * np.cos(angle)])

    across, down = np.linspace(0.0, 0.5 * pi, columns + 1), np.linspace(0.0, 1.0 - body.hollow, rows + 1)
    section = Section(*cells(across, down, place), body.material, bead.mass)
    opposite, together = section.half(opposite=True), section.half(opposite=False)

    # ω², motion of the pole, momentum, and whether the other pole moves oppositely, of each mode.
    found = []
    for half, rigid, sign in ((opposite, 0, -1.0), (together, 1, 1.0)):
        squares, shapes = lowest_modes(half, modes + rigid, body)
        of_half = np.column_stack([squares, shapes[half.pole], half.weight @ shapes, np.full_like(squares, sign)])
        found += [*of_half[rigid:]]
    square, struck, momentum, same = np.array(sorted(found, key=lambda mode: mode[0])[:modes]).reshape(-1, 4).T

    # Compliances: in the frame of the pole, the force on it does nothing, and the bead hangs in an even acceleration.
    push = np.zeros(opposite.along.size)
    push[opposite.pole] = 1.0
    squeezed = factorise(opposite.stiffness)(push)[opposite.pole]
    held, weight = np.delete(np.arange(together.along.size), together.pole), together.weight
    sag = factorise(together.stiffness[held][:, held])(weight[held])
    drifted = weight[held] @ sag / weight.sum() ** 2
    return Vibration(
        np.sqrt(square),
        struck,
        same * struck,
        compression=float(np.sum((1.0 - same) * struck**2 / square)),
        cross=float(0.5 * (drifted - squeezed) - np.sum(same * struck**2 / square)),
        section=np.where(same < 0.0, momentum, 0.0),
    )


def mode_spacing(body: Spheroid, modes: int) -> float:
    """Return the size of elements, m: waves shorten with the root of the number of modes, in walls with the number."""
    many, across = max(modes / TYPICAL, 1.0), sqrt(body.radius * body.half)
    if body.hollow == 0.0:
        return across / CELLS / sqrt(many)
    return min(across / CELLS / (1.0 + body.hollow), across * sqrt(1.0 - body.hollow) / BENDING_CELLS) / many


class Half(NamedTuple):
    """The part of half a bead that the supports leave free: mass, kg, and stiffness, N/m, n × n."""

    mass: sparse.csr_array
    stiffness: sparse.csr_array
    along: Vector  # 1 for motions along the chain, else 0
    weight: Vector  # momentum along the chain by unit rates, kg
    pole: int  # which of the n is the pole's motion along the chain
    spread: sparse.csr_array  # what gives all degrees of freedom of the half from these


class Section:
    """The half-plane (r, z) of the struck half of a bead of a mass, kg: z runs along the chain from the mid-plane.

    angle, depth: of the nodes, from 0 at the pole; depth 1 is the centre.
    """

    def __init__(self, mesh: Any, angle: Vector, depth: Vector, material: Material, mass: float) -> None:
        self.angle = angle
        basis, self.across, self.along = motions(mesh)
        self.centre, self.pole = depth == 1.0, int(np.flatnonzero((angle == 0.0) & (depth == 0.0))[0])
        unscaled, self.stiffness = body_matrices(basis, [material], np.zeros(mesh.nelements, dtype=np.int64))
        self.mass = unscaled * (0.5 * mass / unscaled[self.along][:, self.along].sum())

    def half(self, opposite: bool) -> Half:
        """Return the half whose poles move oppositely, with a mid-plane that slides sideways, or together."""
        axis, middle = self.angle == 0.0, self.angle == self.angle.max()
        held = [self.across[axis | self.centre], self.along[middle | self.centre] if opposite else self.across[middle]]
        # All nodes at the centre of a solid bead share one place, and so one motion.
        joined = np.arange(self.mass.shape[0])
        joined[self.along[self.centre]] = self.along[self.centre].min(initial=joined.size)
        free = np.setdiff1d(joined, np.concatenate(held))
        moving = np.flatnonzero(np.isin(joined, free))
        places = np.searchsorted(free, joined[moving])
        spread = sparse.csr_array((np.ones(moving.size), (moving, places)), shape=(joined.size, free.size))
        # Taken before the mid-plane is held: its nodes carry momentum of cells that move.
        weight = spread.T @ self.mass[:, self.along].sum(axis=1)
        pole = int(np.searchsorted(free, self.along[self.pole]))
        mass, stiffness = (spread.T @ matrix @ spread for matrix in (self.mass, self.stiffness))
        return Half(mass, stiffness, np.isin(free, self.along).astype(float), weight, pole, spread)


def lowest_modes(half: Half, count: int, body: Spheroid) -> tuple[Vector, Vector]:
    """Return ω² of the lowest modes of the bead, and their shapes in this half; poles move inwards."""
    if count == 0:
        return np.zeros(0), np.zeros((half.along.size, 0))
    shift = (shear_speed(body.material) / body.half) ** 2  # so that the rigid motion does not stop the factorisation
    inverse = LinearOperator(half.mass.shape, matvec=factorise(half.stiffness + shift * half.mass), dtype=float)
    start = np.random.default_rng(0).normal(size=half.mass.shape[0])
    squares, shapes = eigsh(half.stiffness, count, half.mass, sigma=-shift, OPinv=inverse, v0=start)
    rising = np.argsort(squares)
    squares, shapes = squares[rising], shapes[:, rising]
    # The whole bead has twice the mass of the half that eigsh normalises.
    shapes *= np.where(shapes[half.pole] < 0.0, -1.0, 1.0) / sqrt(2.0)
    return squares, shapes


def hung(half: Half) -> Callable[[Vector], Vector]:
    """Return the motion about the centre of mass under a load that accelerates the bead evenly."""
    held = np.delete(np.arange(half.along.size), half.pole)
    solve, weight = factorise(half.stiffness[held][:, held]), half.weight
    mass = float(half.along @ weight)

    def motion(load: Vector) -> Vector:
        balanced, moved = load - weight * float(half.along @ load) / mass, np.zeros(half.along.size)
        moved[held] = solve(balanced[held])
        return moved - half.along * float(weight @ moved) / mass

    return motion
