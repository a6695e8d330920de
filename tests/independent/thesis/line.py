"""Masses in a line: beads with one-sided contacts, then cells of rods with bonds; the last touches the ground.

The discrete particle model of equations 3.1 and 6.1, integrated by scipy's DOP853 with a tight tolerance. Mass 0 is
the striker. Link i joins masses i and i + 1, and the last link joins the last mass to the ground. The first links are
contacts, the others bonds. A rod is a row of equal springs with half a cell's mass at both ends: second order in the
length of a cell.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

Numbers = NDArray[np.float64]
Law = Callable[[Numbers], Numbers]

SHARE = 200
"""No step is longer than this part of the record."""


def power_law(stiffness: Numbers, exponent: float = 1.5) -> Law:
    """F = k δⁿ of each contact, 0 where it is open (equations 1.1 and 5.9)."""

    def force(approach: Numbers) -> Numbers:
        closed = np.maximum(approach, 0.0)
        # A square root takes a fraction of the time of a power.
        return stiffness * (closed * np.sqrt(closed) if exponent == 1.5 else closed**exponent)

    return force


@dataclass(frozen=True)
class Line:
    """Masses, kg; the law of the contacts and the approaches, m, under given forces; bonds, N/m.

    dashpot: N s/m of each contact, in closed contacts only (6.1). pulls: whether spring and dashpot of a closed contact
    may pull together, as equation 6.1 lets them; if not, the force is 0 there. drag: 1/s, −α₁ v on each mass.
    diffusion: |γ|/m and α of equation 4.1, with |γ| so that it takes energy. weight: the gravity on each mass, m/s².
    """

    mass: Numbers
    law: Law
    resting: Callable[[Numbers], Numbers]
    bonds: Numbers = field(default_factory=lambda: np.zeros(0))
    dashpot: Numbers | None = None
    pulls: bool = True
    drag: float = 0.0
    diffusion: tuple[float, float] | None = None
    weight: Numbers | None = None

    @property
    def contacts(self) -> int:
        return self.mass.size - self.bonds.size

    def static_forces(self) -> Numbers:
        """The weight that each link carries before the striker's impact, N; the striker's own is not among it."""
        if self.weight is None:
            return np.zeros(self.mass.size)
        return np.cumsum(np.concatenate([[0.0], (self.mass * self.weight)[1:]]))

    def start(self) -> Numbers:
        """Displacements in equilibrium; the striker just touches bead 1."""
        carried = self.static_forces()
        approach = np.concatenate([self.resting(carried[: self.contacts]), carried[self.contacts :] / self.bonds])
        approach[0] = 0.0
        return np.cumsum(approach[::-1])[::-1]

    def approaches(self, place: Numbers) -> Numbers:
        """How far each link is shortened, m. The last axis counts the links, here and in `link_forces`."""
        shortened = place.copy()
        shortened[..., :-1] -= place[..., 1:]
        return shortened

    def link_forces(self, place: Numbers, speed: Numbers) -> Numbers:
        """Spring and dashpot of each link, N."""
        approach, count = self.approaches(place), self.contacts
        closing = approach[..., :count]
        pressed = self.law(closing)
        if self.dashpot is not None:
            pressed = pressed + self.dashpot * self.approaches(speed)[..., :count] * (closing > 0.0)
            pressed = pressed if self.pulls else np.maximum(pressed, 0.0)
        if not self.bonds.size:
            return pressed
        return np.concatenate([pressed, self.bonds * approach[..., count:]], axis=-1)

    def acceleration(self, place: Numbers, speed: Numbers) -> Numbers:
        force = self.link_forces(place, speed)
        gained = -force
        gained[1:] += force[:-1]
        gained /= self.mass
        if self.drag:
            gained -= self.drag * speed
        if self.weight is not None:
            gained += self.weight
        if self.diffusion is not None:
            rate = self.approaches(speed) * (self.approaches(place) > 0.0)
            excess = -rate
            excess[1:] += rate[:-1]
            gained += self.diffusion[0] * np.sign(excess) * np.abs(excess) ** self.diffusion[1]
        return gained

    def strike(self, speed: float | Numbers, until: float, tolerance: float) -> "Flight":
        """The motion for `until` s, after the striker's impact at this speed, m/s, or with a speed of each mass."""
        count = self.mass.size
        given = np.asarray(speed, dtype=float)
        speeds = given if given.ndim else np.concatenate([[float(speed)], np.zeros(count - 1)])
        fastest = float(np.max(np.abs(speeds)))
        # Contacts of the model steel beads last 1e-5 s and longer: that is the scale of a displacement.
        scale = np.concatenate([np.full(count, 1e-5 * fastest), np.full(count, fastest)])

        def rate(_: float, state: Numbers) -> Numbers:
            return np.concatenate([state[count:], self.acceleration(state[:count], state[count:])])

        solved = solve_ivp(
            rate, (0.0, until), np.concatenate([self.start(), speeds]), "DOP853", dense_output=True,
            rtol=tolerance, atol=tolerance * scale, max_step=until / SHARE,
        )  # fmt: skip
        if not solved.success:
            raise ArithmeticError(solved.message)
        return Flight(self, solved.sol, until)


@dataclass(frozen=True)
class Flight:
    """The motion of a line, at any time of the record."""

    line: Line
    state: Any
    until: float

    @cached_property
    def static(self) -> Numbers:
        return self.line.static_forces()

    def places(self, time: float | Numbers) -> Numbers:
        """Displacements, m: times by masses, or masses at one time."""
        return np.asarray(self.state(time)).T[..., : self.line.mass.size]

    def speeds(self, time: float | Numbers) -> Numbers:
        return np.asarray(self.state(time)).T[..., self.line.mass.size :]

    def forces(self, time: float | Numbers) -> Numbers:
        """In all links, with the static part."""
        return self.line.link_forces(self.places(time), self.speeds(time))

    def contact(self, link: int) -> Callable[[Any], Any]:
        """The dynamic force in a link, N, as a function of time."""
        return lambda time: self.forces(time)[..., link] - self.static[link]

    def sensor(self, bead: int) -> Callable[[Any], Any]:
        """The dynamic force that a sensor in this bead reports: the mean of its two contacts (section 3.1)."""
        links, carried = slice(bead - 1, bead + 1), float(np.mean(self.static[bead - 1 : bead + 1]))
        return lambda time: np.mean(self.forces(time)[..., links], axis=-1) - carried


def hertzian(
    mass: Numbers | Sequence[Numbers], stiffness: Numbers, exponent: float = 1.5, bonds: Numbers | None = None,
    gravity: float = 0.0, dashpot: float | Numbers = 0.0, pulls: bool = True, drag: float = 0.0,
    diffusion: tuple[float, float] | None = None,
) -> Line:  # fmt: skip
    """A line whose contacts obey power laws; gravity acts on beads, one for each contact, and not on cells of rods.

    mass: of all, or of the beads and of the cells below them.
    """
    masses = mass if isinstance(mass, np.ndarray) else np.concatenate(mass)
    bonds = np.zeros(0) if bonds is None else bonds
    on_beads = np.where(np.arange(masses.size) < stiffness.size, gravity, 0.0)
    pots = np.broadcast_to(np.asarray(dashpot, dtype=float), stiffness.shape)
    return Line(
        masses, power_law(stiffness, exponent), lambda force: (force / stiffness) ** (1.0 / exponent), bonds,
        pots if pots.any() else None, pulls, drag, diffusion, on_beads if gravity else None,
    )  # fmt: skip


def row(
    count: int, bead: float, between: float, wall: float, striker: float | None = None, first: float | None = None
) -> tuple[Numbers, Numbers]:
    """Masses and contacts of a striker, `count` equal beads and a wall; the striker is a bead where not given."""
    mass = np.full(count + 1, bead)
    stiffness = np.full(count + 1, between)
    mass[0] = bead if striker is None else striker
    stiffness[0] = between if first is None else first
    stiffness[-1] = wall
    return mass, stiffness


def rod_cells(
    length: float, area: float, density: float, youngs_modulus: float, cell: float
) -> tuple[Numbers, Numbers]:
    """Masses, kg, and springs, N/m, of a rod: a mass more than springs, four cells or more, none longer than `cell`."""
    cells = max(4, int(np.ceil(length / cell - 1e-9)))
    step = length / cells
    mass = np.full(cells + 1, density * area * step)
    mass[[0, -1]] /= 2.0
    return mass, np.full(cells, youngs_modulus * area / step)


def on_rods(rods: list[tuple[Numbers, Numbers]]) -> tuple[Numbers, Numbers]:
    """Masses and bonds of glued rods, the top one first, on the ground: the last mass of all is fixed."""
    mass, bonds = rods[0]
    for next_mass, next_bonds in rods[1:]:
        mass = np.concatenate([mass[:-1], [mass[-1] + next_mass[0]], next_mass[1:]])
        bonds = np.concatenate([bonds, next_bonds])
    return mass[:-1], bonds
