"""The monolithic reference: chains and structures as one system of equations, with one integrator of eighth order.

It shares with hertzlink's own runs the input and the contact laws alone, neither kernels nor steps nor windows, and
is meant for small systems: all matrices are dense. With q the displacements from static equilibrium of all bodies and
all degrees of freedom, the approach of every contact is linear in them, δ = δ_static + A q, and

    M q̈ + C q̇ + K q = loads − Aᵀ (F(δ, δ̇) − F_static).

The force of a contact with a dashpot jumps where the contact shuts. A step across a jump leaves an error that depends
on where in the step the jump lies, and so on the last bit of every number before. The integrator therefore stops at the
time at which a contact opens or closes, and every step sees a smooth force.
"""

from collections.abc import Sequence
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from scipy.integrate import DOP853, DenseOutput
from scipy.linalg import block_diag

import hertzlink as hl

Numbers = NDArray[np.float64]

TOLERANCE = 1e-12
"""Relative, of DOP853; the absolute one is so small a part of a hundredth of the excitation's speed, over 10 µs."""

LONGEST_STEP = 1e-6
"""s. Without it the integrator may step over a gap that opens and shuts."""

HALVINGS = 40
"""Of a step in which a contact opens or closes, to find out when."""

LEAST_FORCE = 1e-20
"""N. A contact that bears less counts as open: its overlap is below the rounding of displacements. Far ahead of a wave
such contacts would open and shut thousands of times."""

NEWTON_STEPS = 60


class Contact(NamedTuple):
    """The "last" or the "first" bead of a chain on a contact point of a structure, by their numbers."""

    chain: int
    end: str
    structure: int
    point: int = 0


def monolithic(
    chains: Sequence[hl.Chain], structures: Sequence[Any], contacts: Sequence[Contact], times: Numbers,
    tolerance: float = TOLERANCE,
) -> list[xr.Dataset]:  # fmt: skip
    """One Dataset for each chain, at the given times (s, from zero), as hertzlink's measures take them.

    chains: with a free striker or none. structures: M, K, C, contact (n,) or (n, p), flexibility and surface (one, or p
    of them), as a Structure or similar. A contact point moves away from its chain, backwards from a first bead.
    total_energy, J: of the whole system, with what losses took.
    """
    system = System(chains, structures, contacts)
    states, saved, time, state = np.empty((system.start.size, times.size)), 0, 0.0, system.start
    while saved < times.size:
        shut = system.pushing(state)
        solver = DOP853(
            partial(system.rate, shut), time, state, times[-1],
            rtol=tolerance, atol=tolerance * system.scale, max_step=LONGEST_STEP,
        )  # fmt: skip
        changed = False
        while saved < times.size and not changed:
            message = solver.step()
            assert solver.status != "failed", message
            time, state = solver.t, solver.y
            changed = not np.array_equal(system.pushing(state), shut)
            if not changed and time < times[saved]:
                continue
            between = solver.dense_output()
            if changed:
                time = system.switch_time(between, shut)
                state = system.switched(between(time), shut)
            passed = int(np.searchsorted(times, time, "right"))
            states[:, saved:passed], saved = between(times[saved:passed]), passed
    return system.datasets(times, states)


class System:
    """All bodies and degrees of freedom of chains and structures in one vector q, and all their contacts.

    Each chain has a row for its striker and every bead, and as many contacts: the striker's first (or that with the
    structure behind the chain), the last bead's last.
    """

    def __init__(self, chains: Sequence[hl.Chain], structures: Sequence[Any], contacts: Sequence[Contact]) -> None:
        self.chains, self.structures, self.facing = chains, structures, contacts
        self.bodies = np.cumsum([0] + [len(chain.beads) + 1 for chain in chains])
        self.freedoms = self.bodies[-1] + np.cumsum([0] + [len(body.contact) for body in structures])
        bodies, size = self.bodies[-1], self.freedoms[-1]
        masses = np.concatenate([[_striker_mass(chain), *(bead.mass for bead in chain.beads)] for chain in chains])
        self.mass = block_diag(np.diag(masses), *(_dense(body.mass) for body in structures))
        self.stiffness = block_diag(np.zeros((bodies, bodies)), *(_dense(body.stiffness) for body in structures))
        self.damping = block_diag(np.zeros((bodies, bodies)), *(_damping(body) for body in structures))
        self.law, self.spring, self.viscosity, self.static_force = (np.zeros(bodies) for _ in range(4))
        self.approach = np.zeros((bodies, size))
        self.load, self.speed = np.zeros(size), np.zeros(size)
        for chain, first in zip(chains, self.bodies, strict=False):
            self._place_chain(chain, first)
        for contact in contacts:
            self._place_contact(contact)
        assert not ((self.spring != 0.0) & (self.viscosity != 0.0)).any(), "a dashpot at a flexibility"
        law = np.maximum(self.law, 1e-300)
        self.preload = (self.static_force / law) ** (2.0 / 3.0) * (self.law > 0.0) + self.spring * self.static_force

    def _place_chain(self, chain: hl.Chain, first: int) -> None:
        count, weights = len(chain.beads), chain.gravity_along * np.array([bead.mass for bead in chain.beads])
        rows = slice(first, first + count + 1)
        self.static_force[rows] = np.append(0.0, chain.preload + np.cumsum(weights))
        if chain.striker is not None:
            self._touch(first, first, hl.contact_law(chain.striker, chain.beads[0]), chain)
            self.load[first] = chain.gravity_along * chain.striker.mass
            self.speed[first] = chain.impact_speed
        else:
            self.speed[first + 1] = chain.impact_speed or 0.0
        for i in range(1, count):
            self._touch(first + i, first + i, hl.contact_law(chain.beads[i - 1], chain.beads[i]), chain)

    def _place_contact(self, contact: Contact) -> None:
        """The surface is at w along the chain's axis beyond a last bead, and at −w before a first one."""
        chain, body = self.chains[contact.chain], self.structures[contact.structure]
        last, row = contact.end == "last", self.bodies[contact.chain]
        row += len(chain.beads) if last else 0
        surface = body.surface[contact.point] if isinstance(body.surface, tuple) else body.surface
        spread = np.asarray(body.contact).reshape(len(body.contact), -1)
        self._touch(row, None, hl.contact_law(chain.beads[-1 if last else 0], surface), chain)
        self.approach[row, row if last else row + 1] = 1.0 if last else -1.0
        self.approach[row, slice(*self.freedoms[contact.structure :][:2])] = -spread[:, contact.point]
        if not last:
            self.static_force[row] = chain.preload
        self.spring[row] = np.broadcast_to(body.flexibility, spread.shape[1])[contact.point]

    def _touch(self, row: int, body: int | None, law: hl.laws.PowerLaw, chain: hl.Chain) -> None:
        stiffness, table = law.kernel
        assert table is None, f"{law.name}: Hertz's law alone"
        assert isinstance(chain.dissipation, hl.LinearDashpot | None), "a linear dashpot or none"
        self.law[row] = stiffness
        self.viscosity[row] = chain.dissipation.coefficient if chain.dissipation else 0.0
        if body is not None:
            self.approach[row, [body, body + 1]] = 1.0, -1.0

    @cached_property
    def springs(self) -> Numbers:
        """The contacts with a spring in series."""
        return np.flatnonzero(self.spring)

    @property
    def start(self) -> Numbers:
        """q, q̇ and the energy lost, at time zero."""
        return np.concatenate([np.zeros_like(self.speed), self.speed, [0.0]])

    @property
    def scale(self) -> Numbers:
        """Scales of the entries of the state: a hundredth of the greatest speed, 10 µs of that, and of the energy."""
        fastest, ones = abs(self.speed).max(), np.ones_like(self.speed)
        return 0.01 * np.concatenate([1e-5 * fastest * ones, fastest * ones, [self.impact_energy]])

    @property
    def impact_energy(self) -> float:
        """Kinetic energy at time zero, J."""
        return 0.5 * float(self.speed @ self.mass @ self.speed)

    @cached_property
    def matrices(self) -> tuple[Numbers, Numbers, Numbers, Numbers]:
        """What `rate` takes: of q the approaches and M⁻¹K q, in one matrix; M⁻¹C; M⁻¹Aᵀ; and what is constant."""
        constant = self.load + self.approach.T @ self.static_force
        right = (self.stiffness, self.damping, self.approach.T, constant)
        stiffness, damping, contact, constant = (np.linalg.solve(self.mass, one) for one in right)
        return np.vstack([self.approach, stiffness]), damping, contact, constant

    @cached_property
    def damps(self) -> bool:
        """Whether anything damps."""
        return bool(self.damping.any() or self.viscosity.any())

    def rate(self, shut: Numbers, _time: float, state: Numbers) -> Numbers:
        """The rate of the state, while the contacts that are shut stay shut."""
        size, contacts = self.speed.size, self.law.size
        q, v = state[:size], state[size:-1]
        of_places, damping, contact, constant = self.matrices
        moved, lost = of_places @ q, 0.0
        force = self.elastic(moved[:contacts]) * shut
        acceleration = constant - moved[contacts:]
        if self.damps:
            approaching = self.approach @ v
            viscous = self.viscosity * approaching * shut
            force += viscous
            acceleration -= damping @ v
            lost = viscous @ approaching + v @ (self.damping @ v)
        acceleration -= contact @ force
        return np.concatenate([v, acceleration, [lost]])

    def pushing(self, states: Numbers) -> Numbers:
        """Which contacts are shut: they overlap, and their dashpots pull less than they push. Of one state or many."""
        elastic, viscous = self.parts(states)
        return (elastic > LEAST_FORCE) & (elastic + viscous > 0.0)

    def force(self, states: Numbers) -> Numbers:
        """The force of each contact, N; for one state or many."""
        return np.where(self.pushing(states), sum(self.parts(states)), 0.0)

    def parts(self, states: Numbers) -> tuple[Numbers, Numbers]:
        """The elastic and the viscous force of each contact, N, were it shut; of one state or many."""
        size = self.speed.size
        q, v = states[..., :size], states[..., size:-1]
        return self.elastic(q @ self.approach.T), self.viscosity * (v @ self.approach.T)

    def elastic(self, moved: Numbers) -> Numbers:
        """The elastic force of each contact, N, were it shut, from its approach since time zero; odd in the overlap."""
        overlap = self.preload + moved
        for i in self.springs:
            overlap[..., i] = _overlap_on_spring(overlap[..., i], self.law[i] * self.spring[i])
        return self.law * overlap * np.sqrt(abs(overlap))

    def switch_time(self, step: DenseOutput, shut: Numbers) -> float:
        """The time at which the first contact opens or closes in a step, at whose beginning alone `shut` holds."""
        before, after = step.t_old, step.t
        for _ in range(HALVINGS):
            middle = (before + after) / 2.0
            same = np.array_equal(self.pushing(step(middle)), shut)
            before, after = (middle, after) if same else (before, middle)
        return float(after)

    def switched(self, state: Numbers, shut: Numbers) -> Numbers:
        """The state as contacts open or shut that were so before; a dashpot opens one before all its energy is back."""
        switched = state.copy()
        switched[-1] += self.stored(state, shut) - self.stored(state, self.pushing(state))
        return switched

    def stored(self, states: Numbers, shut: Numbers) -> Numbers:
        """Elastic energy of the contacts that are shut, J; of one state or many."""
        elastic = np.where(shut, abs(self.parts(states)[0]), 0.0)
        overlap = (elastic / np.maximum(self.law, 1e-300)) ** (2.0 / 3.0)
        return (0.4 * elastic * overlap + 0.5 * self.spring * elastic**2).sum(axis=-1)

    def total_energy(self, states: Numbers) -> Numbers:
        """Energy of everything, with what the static loads and the losses took, J; of many states."""
        size = self.speed.size
        q, v = states[:, :size], states[:, size:-1]
        moving = 0.5 * (v * (v @ self.mass) + q * (q @ self.stiffness)).sum(axis=1)
        contacts = self.stored(states, self.pushing(states))
        return moving + contacts - q @ (self.load + self.static_force @ self.approach) + states[:, -1]

    def datasets(self, times: Numbers, states: Numbers) -> list[xr.Dataset]:
        """A Dataset for each chain, with the variables of hertzlink's results that measures need."""
        size = self.speed.size
        q, v = states[:size].T, states[size:-1].T
        force, energy = self.force(states.T), self.total_energy(states.T)
        return [self._dataset(n, times, q, v, force, energy) for n in range(len(self.chains))]

    def _dataset(self, n: int, times: Numbers, q: Numbers, v: Numbers, force: Numbers, energy: Numbers) -> xr.Dataset:
        rows = slice(*self.bodies[n : n + 2])
        surfaces = {"last": "surface_displacement", "first": "first_surface_displacement"}
        moved = {}
        for contact in (contact for contact in self.facing if contact.chain == n):
            body = slice(*self.freedoms[contact.structure :][:2])
            spread = np.asarray(self.structures[contact.structure].contact).reshape(body.stop - body.start, -1)
            moved[surfaces[contact.end]] = ("time", q[:, body] @ spread[:, contact.point])
        return xr.Dataset(
            {
                "displacement": (("time", "bead"), q[:, rows]),
                "velocity": (("time", "bead"), v[:, rows]),
                "contact_force": (("time", "contact"), force[:, rows]),
                "total_energy": ("time", energy),
                **moved,
            },
            coords={
                "time": ("time", times, {"units": "s"}),
                "bead": ("bead", np.arange(rows.stop - rows.start)),
                "contact": ("contact", np.arange(1, rows.stop - rows.start + 1)),
                "centre": ("bead", _centres(self.chains[n]), {"units": "m"}),
                "impact_energy": ((), self.impact_energy, {"units": "J"}),
                "static_force": ("contact", self.static_force[rows], {"units": "N"}),
            },
        )


def _overlap_on_spring(approach: Any, scale: float) -> Any:
    """Hertz's own part δ of an approach δ + scale δ√δ, by Newton's method in √δ; odd in the approach."""
    size = np.abs(approach)
    root = np.sqrt(size)
    for _ in range(NEWTON_STEPS):
        step = (root**2 + scale * root**3 - size) / (2.0 * root + 3.0 * scale * root**2 + 1e-300)
        root = root - step
        if np.all(np.abs(step) <= 1e-16 * root):
            break
    return np.sign(approach) * root**2


def _striker_mass(chain: hl.Chain) -> float:
    """1 kg that nothing touches where there is no striker."""
    return 1.0 if chain.striker is None else float(chain.striker.mass)


def _centres(chain: hl.Chain) -> Numbers:
    sizes = np.array([bead.size for bead in chain.beads])
    striker = 0.0 if chain.striker is None else chain.striker.size
    return np.concatenate([[-striker / 2.0], np.cumsum(sizes) - sizes / 2.0])


def _dense(matrix: Any) -> Numbers:
    return np.asarray(matrix.toarray() if hasattr(matrix, "toarray") else matrix, float)


def _damping(body: Any) -> Numbers:
    return np.zeros_like(_dense(body.mass)) if body.damping is None else _dense(body.damping)
