"""Elastic vibrations of a free bead pushed at its two poles along its axis, and the residual compliance of the poles.

Half a bead is computed twice: with poles that move in opposite directions, and with poles that move together. Under
unit forces on both poles these move by u_s in the first case and by u_t in the second, relative to the centre of mass.
A unit force at one pole then moves the other by b = (u_t − u_s)/2.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from math import ceil, pi, sqrt
from typing import Any, NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, eigsh

from particles.laws.axisymmetric_mesh import Spheroid, Whole, body_of, cells, motions
from structures.bodies.elasticity import body_matrices, shear_speed
from structures.linear_algebra.factor import factorise
from structures.material import Material
from structures.structure import Vector

# Cells per radius, for up to TYPICAL modes. The frequencies of a sphere are then 2e-5 too high, or 7e-5 for a Poisson's
# ratio of 0.45; with 12 cells, three times as much. Meshes for more modes are finer in proportion.
CELLS, TYPICAL = 16, 10
BENDING_CELLS, FEWEST = 11, 2  # cells per √(radius × wall), the bending length of a thin wall, and through a wall


@dataclass(frozen=True, eq=False)
class Vibration:
    """Axisymmetric elastic vibrations of a free bead, lowest first, and the residual compliance of its poles.

    Under forces F and F′ along the chain on the two poles, the amplitude q, √kg·m, obeys q″ + ω² q = struck F + far F′.
    The poles move by the sums of struck q and far q, and by the rigid motion.
    """

    frequencies: Vector  # ω, rad/s, without the rigid motion
    struck: Vector  # motion of the struck pole along the chain per unit amplitude, 1/√kg, ≥ 0
    far: Vector  # that of the other pole: −struck if the mode is symmetric about the mid-plane, else +struck
    # Σ 2 struck²/ω² of the symmetric modes, m/N: their contribution to the inward motion of a pole under unit forces.
    compression: float
    # The static motion of one pole relative to the centre of mass under a unit force at the other, without these modes,
    # m/N. In shells it is inversely proportional to their number. In solid beads, where surface waves meet at the other
    # pole, it keeps changing its sign, at about 2 % of `compression`.
    cross: float
    # Momentum of the struck half along the chain per unit rate of the amplitude, √kg; 0 if the mode is not symmetric.
    # If contacts push with F and F′, the force through the mid-plane is (F + F′)/2 − Σ section q″.
    section: Vector


@lru_cache(maxsize=64)
def vibration(bead: Any, modes: int) -> Vibration:
    """Return the lowest elastic modes of a free Sphere, HollowSphere or Ellipsoid along the chain, mass-normalised. The
    finite elements make the frequencies at most 1e-4 too high. The error of b is 1e-4.
    """
    body: Any = body_of(bead, 1.0, "bead")
    longest = max(body.radius, body.half) / mode_spacing(body, modes) * (1.0 - 1e-9)
    rows, columns = max(ceil(longest * (1.0 - body.hollow)), FEWEST), max(ceil(0.5 * pi * longest), FEWEST)

    # Cells of uniform size on each circle about the centre, whose depth is 1.
    across, down = np.linspace(0.0, 0.5 * pi, columns + 1), np.linspace(0.0, 1.0 - body.hollow, rows + 1)
    size = np.array([[body.radius], [-body.half]])
    mesh = cells(across, down, lambda angle, depth: size * (1.0 - depth) * [np.sin(angle), np.cos(angle)])
    opposite, together, _ = halves(*mesh, body.material, bead.mass)

    # For each mode: ω², motion of the pole, momentum, and the sign of the other pole's motion.
    found = []
    for half, rigid, sign in ((opposite, 0, -1.0), (together, 1, 1.0)):
        squares, shapes = lowest_modes(half, modes + rigid, body)
        of_half = np.column_stack([squares, shapes[half.pole], half.weight @ shapes, np.full_like(squares, sign)])
        found += [*of_half[rigid:]]
    square, struck, momentum, same = np.array(sorted(found, key=lambda mode: mode[0])[:modes]).reshape(-1, 4).T

    # Compliances. In the frame of the pole, the force on it does no work, and the bead hangs in a uniform acceleration.
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
    """Return the size of elements, m, for the wavelength: ∝ modes^(−1/2) in solid beads, ∝ 1/modes in walls."""
    many, across = max(modes / TYPICAL, 1.0), sqrt(body.radius * body.half)
    if body.hollow == 0.0:
        return across / CELLS / sqrt(many)
    return min(across / CELLS / (1.0 + body.hollow), across * sqrt(1.0 - body.hollow) / BENDING_CELLS) / many


class Half(NamedTuple):
    """The n free degrees of freedom of half a bead: mass, kg, and stiffness, N/m, n × n."""

    mass: sparse.csr_array
    stiffness: sparse.csr_array
    along: Vector  # 1 for motions along the chain, else 0
    weight: Vector  # momentum along the chain for unit rates, kg
    pole: int  # the number of the pole's motion along the chain
    spread: sparse.csr_array  # from these to all degrees of freedom of the half


def halves(mesh: Any, angle: Vector, depth: Vector, material: Material, mass: float) -> tuple[Half, Half, Whole]:
    """Return the struck half with poles that move in opposite directions, and with poles that move together. In the
    first case the mid-plane slides sideways. The third result numbers all motions along the chain. mesh: the half-plane
    (r, z); z runs along the chain from the mid-plane. angle, depth: positions of the nodes, from 0 at the pole; depth 1
    is the centre. mass: of the whole bead, kg.
    """
    basis, across, along = motions(mesh)
    unscaled, stiffness = body_matrices(basis, [material], np.zeros(mesh.nelements, dtype=np.int64))
    scaled = unscaled * (0.5 * mass / unscaled[along][:, along].sum())
    axis, centre, middle = angle == 0.0, depth == 1.0, angle == angle.max()
    # All nodes at the centre of a solid bead are at the same place, so they move together.
    joined = np.arange(scaled.shape[0])
    joined[along[centre]] = along[centre].min(initial=joined.size)
    found = []
    for held in (along[middle | centre], across[middle]):
        free = np.setdiff1d(joined, np.append(across[axis | centre], held))
        moving = np.flatnonzero(np.isin(joined, free))
        places = np.searchsorted(free, joined[moving])
        spread = sparse.csr_array((np.ones(moving.size), (moving, places)), shape=(joined.size, free.size))
        # From the whole mass matrix, because nodes of the mid-plane that are held carry momentum of moving cells.
        weight = spread.T @ scaled[:, along].sum(axis=1)
        pole = int(np.searchsorted(free, along[axis & (depth == 0.0)][0]))
        of_mass, of_stiffness = (spread.T @ matrix @ spread for matrix in (scaled, stiffness))
        found.append(Half(of_mass, of_stiffness, np.isin(free, along).astype(float), weight, pole, spread))
    return found[0], found[1], along


def lowest_modes(half: Half, count: int, body: Spheroid) -> tuple[Vector, Vector]:
    """Return ω² of the lowest modes of the bead, and their shapes in this half, with poles that move inwards."""
    if count == 0:
        return np.zeros(0), np.zeros((half.along.size, 0))
    shift = (shear_speed(body.material) / body.half) ** 2  # makes the matrix regular in spite of the rigid motion
    inverse = LinearOperator(half.mass.shape, matvec=factorise(half.stiffness + shift * half.mass), dtype=float)
    start = np.random.default_rng(0).normal(size=half.mass.shape[0])
    squares, shapes = eigsh(half.stiffness, count, half.mass, sigma=-shift, OPinv=inverse, v0=start)
    rising = np.argsort(squares)
    squares, shapes = squares[rising], shapes[:, rising]
    # eigsh normalises with the mass of the half; the whole bead has twice as much.
    shapes *= np.where(shapes[half.pole] < 0.0, -1.0, 1.0) / sqrt(2.0)
    return squares, shapes


def hung(half: Half) -> Callable[[Vector], Vector]:
    """Return a function from a load that accelerates the bead uniformly to the motion about the centre of mass."""
    held = np.delete(np.arange(half.along.size), half.pole)
    solve, weight = factorise(half.stiffness[held][:, held]), half.weight
    mass = float(half.along @ weight)

    def motion(load: Vector) -> Vector:
        balanced, moved = load - weight * float(half.along @ load) / mass, np.zeros(half.along.size)
        moved[held] = solve(balanced[held])
        return moved - half.along * float(weight @ moved) / mass

    return motion
