"""Exact derivatives of a run by the parameters of the function that builds it.

A parameter changes the numbers that a run is made of: masses, stiffnesses, oscillators. These are smooth functions of
it, so differences of order four give their derivatives to eight digits or more. The run's own derivative, through
thousands of steps and through contacts that open and close, is exact: dual numbers carry it along with the run.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from math import ceil, inf, prod
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from scipy import sparse

from coupling.compiled_run import Engine, StructureWindows
from coupling.cosimulation import CoSimulation
from coupling.kernels.records import Run
from coupling.kernels.tangents import Model, Moving, Tangents
from coupling.plan import Plan
from coupling.recording.frames import Frames, Kept
from coupling.run_loop import UNBROKEN, is_compiled
from coupling.schemes.halving import Adaptive
from particles.kernels.laws import Hertz, Partly
from particles.kernels.losses import NoLoss
from particles.kernels.motion import WORK_ROWS, Verlet
from structures.checks import instance
from structures.kernels.duals import WIDTHS, Lane, Lanes
from structures.kernels.linear import Oscillators
from structures.moving import MovingStructure
from structures.structure import Vector
from structures.units import readable

Build: TypeAlias = Callable[..., CoSimulation]
"""A function of parameters; it may have `units`, the SI units of these by name, for messages."""

STEP = 1e-4
"""Of a parameter, of its value: the step of the differences."""

PLACES = (-2.0, -1.0, 1.0, 2.0)
"""Of the differences, in steps."""

WEIGHTS = np.array([1.0, -8.0, 8.0, -1.0]) / 12.0
"""Of the differences of order four."""

DOUBTS = WEIGHTS + [-0.5, 2.5, 1.5, -0.5]
"""Of how much these differ from differences of order two, and of how much the two sides differ beyond what a smooth
curve, whose second difference grows with the step, explains: so a kink, a jump or chance shows."""

SMOOTH = 0.1
"""Part by which the ratio of a smooth curve's second differences, over two steps and over one, differs from four."""

NUDGE = 1e-9
"""Part of its value by which a parameter is moved that gives a run of another kind at this value alone."""

NEGLIGIBLE = 1e-3
"""Part of a force's range by which doubts, of parameters by as much as they are, do not matter. On a plate's line of
symmetry, where derivatives vanish, a reduction that bends there leaves doubts of 1e-8 to 3e-4."""

SHARED = 7
"""What a group of directions takes to compute values, in entries of dual numbers: measured."""

LINE = 64
"""Bytes of a line of the cache."""

ROUNDING = 1e-12
"""Part of a number by which it changes without reason."""


class Numbers(NamedTuple):
    """What a run is made of: pieces of its chains, of its structures over a window, and its start."""

    chains: tuple[Any, ...]
    structure: Any
    compliance: Vector
    static: Vector
    y: Vector
    v: Vector


class _Parameter(NamedTuple):
    """The numbers of runs at the places around a parameter's value, and the step between them."""

    name: str
    around: list[CoSimulation]
    step: float


class Derivatives(NamedTuple):
    """Derivatives of what was kept, for each parameter."""

    force: dict[str, Vector]
    """Saved times × contacts, N per unit of the parameter."""
    velocity: dict[str, Vector]
    """Saved times × bodies, m/s per unit."""
    facts: dict[str, dict[str, Vector]]
    """Of static forces (N), of the beads' centres (m) and of the impact energy (J)."""
    doubt: dict[str, float]
    """Part of the largest derivative of a force by which differences of lower order change it, where that matters."""


def differentiate(
    simulation: CoSimulation, build: Build, parameters: Mapping[str, float], plan: Plan, kept: Kept
) -> tuple[Frames, Derivatives]:
    """Do a run and return its frames, and their derivatives by the parameters of the function that builds it."""
    check_differentiable(simulation)
    around = parameters_around(build, parameters)
    nudged = {
        name: value * (1.0 + NUDGE) if _kinds(runs.around[0]) != _kinds(simulation) else value
        for (name, value), runs in zip(parameters.items(), around, strict=True)
    }
    usual = simulation
    if nudged != parameters:
        # A law that is Hertz's at this value only is a table next to it, for all parameters.
        usual, around = build(**nudged), parameters_around(build, nudged)
    frames = Frames(simulation.interface, plan.rows, kept)
    engine = TangentEngine(simulation, usual, plan, frames, around)
    _do(engine)
    force, velocity = engine.by_direction()
    slopes, doubt = dict(zip(parameters, force, strict=False)), dict.fromkeys(parameters, 0.0)
    enough = NEGLIGIBLE * float(np.ptp(frames.sensors.force, axis=0).max())
    if abs(force[-1]).max() > enough:
        engine = TangentEngine(simulation, usual, plan, Frames(simulation.interface, plan.rows, kept), around, True)
        _do(engine)
        for (name, slope), change in zip(slopes.items(), engine.by_direction()[0], strict=True):
            size, most = float(abs(slope).max()), float(abs(change).max())
            if abs(parameters[name]) * most > enough:
                doubt[name] = most / size if size > 0.0 else inf
    facts = {runs.name: _rates_of_facts(runs, kept) for runs in around}
    return frames, Derivatives(slopes, dict(zip(parameters, velocity, strict=False)), facts, doubt)


def _rates_of_facts(runs: _Parameter, kept: Kept) -> dict[str, Vector]:
    """Return the derivatives of what measures use in addition to forces and velocities."""
    chains = [simulation.interface.chains[0] for simulation in runs.around]
    facts = {
        "static_force": [chain.static_force[kept.contacts] for chain in chains],
        "centre": [chain.chain.centres[kept.bodies] for chain in chains],
        "impact_energy": [np.asarray(chain.chain.impact_energy) for chain in chains],
    }
    return {name: np.tensordot(WEIGHTS, np.array(values), 1) / runs.step for name, values in facts.items()}


def _do(engine: "TangentEngine") -> None:
    """Do the run of an engine from its start to its end; now and then Python can stop it."""
    plan, run, row = engine.plan, engine.start(), 0
    effort = sum(chain.steps(plan.length) * chain.rest.size for chain in engine.interface.chains)
    rows = max(1, int(UNBROKEN / effort / (1 + len(engine.groups))) // plan.stride)
    while row < plan.rows - 1:
        last = min(row + rows, plan.rows - 1)
        engine.advance(run, row * engine.stride, last * engine.stride)
        row = last
    engine.frames.count_damping(engine.interface)


def _kinds(simulation: CoSimulation) -> list[str]:
    """Return the kinds of pieces of which the chains of a run are made."""
    return [repr(_types(chain.model)) for chain in simulation.interface.chains]


def _types(piece: Any) -> Any:
    return type(piece), tuple(map(_types, piece)) if isinstance(piece, tuple) else ()


def check_differentiable(simulation: Any) -> None:
    """Raise a ValueError for a co-simulation whose derivatives dual numbers do not carry."""
    simulation = instance("build(...)", simulation, CoSimulation, "a CoSimulation")
    if isinstance(simulation.window, Adaptive):
        raise ValueError("build(...): has adaptive windows, which jump with a parameter; give a window in s, or none")
    if not is_compiled(simulation.interface, simulation.scheme):
        raise ValueError(
            f"build(...) = {simulation!r}: has no derivatives; it needs Condensed(), and structures that are linear "
            "and small (use reduce)"
        )


def parameters_around(build: Build, parameters: Mapping[str, float]) -> list[_Parameter]:
    """Return the co-simulations around the value of each parameter, by which the numbers of runs are differentiated."""
    around = []
    for name, value in parameters.items():
        step = STEP * abs(value)
        runs = [_built(build, {**parameters, name: value + place * step}, name) for place in PLACES]
        around.append(_Parameter(name, runs, step))
    return around


def _built(build: Build, parameters: Mapping[str, float], name: str) -> CoSimulation:
    """Return a run near the value of a parameter; errors say that it is near."""
    try:
        run: CoSimulation = instance("build(...)", build(**parameters), CoSimulation, "a CoSimulation")
    except (ArithmeticError, ValueError) as error:
        value = readable(parameters[name], units_of(build).get(name, ""), 6)
        raise ValueError(f"{name}: build fails at {value}, which a derivative by differences needs: {error}") from None
    return run


def units_of(build: Build) -> dict[str, str]:
    """Return the SI units of a builder's parameters, by name, as far as it states them."""
    return dict(getattr(build, "units", {}))


def numbers_of(
    simulation: CoSimulation, length: float, usual: CoSimulation | None = None, windows: StructureWindows | None = None
) -> Numbers:
    """Return what a run with windows of a length, s, is made of, with the signs of the modes of a usual one."""
    interface, structures = simulation.interface, list(simulation.interface.structures)
    if usual is not None:
        structures = list(map(_with_signs, structures, usual.interface.structures))
    starts = [chain.start() for chain in interface.chains]
    return Numbers(
        tuple(chain.model for chain in interface.chains),
        *(windows or StructureWindows()).of(interface, structures, length),
        interface.static,
        np.concatenate([state.position for state in starts]),
        np.concatenate([state.velocity for state in starts]),
    )


def _with_signs(moving: Any, usual: Any) -> Any:
    """Return a reduced structure with the signs of another in its modes and, by what couples them, in its arms."""
    structure, other = moving.structure, usual.structure
    alone = structure is other or structure.is_modal or structure.contact.shape != other.contact.shape
    if alone or "reduction" not in structure.origin:
        return moving
    contact = structure.contact_vectors
    sign = np.where((contact * other.contact_vectors).sum(axis=1) < 0.0, -1.0, 1.0)
    modes = contact.any(axis=1)
    coupling = (structure.stiffness.multiply(other.stiffness)).toarray()
    sign[~modes] = np.where(coupling[np.ix_(~modes, modes)] @ sign[modes] < 0.0, -1.0, 1.0)
    flip = sparse.diags_array(sign)
    changes: dict[str, Any] = {
        name: None if matrix is None else sparse.csr_array(flip @ matrix @ flip)
        for name in ("mass", "stiffness", "damping")
        for matrix in [getattr(structure, name)]
    }
    changes["contact"] = structure.contact * (sign if structure.contact.ndim == 1 else sign[:, None])
    return MovingStructure(replace(structure, **changes, matrices=None))


class Column:
    """A number of a run with those in its place in other runs, and what it becomes."""

    def __init__(self, values: Sequence[Any], begin: int) -> None:
        self.value, rows = values[0], np.array(values)
        self.dual, self.rows = self.value, rows.reshape(len(rows), rows.size // len(rows))
        self.place = slice(begin, begin + self.rows.shape[1])


def gathered(runs: Sequence[Any], names: Sequence[str], columns: list[Column]) -> Any:
    """Return a piece of the first of some runs with columns, which it adds to a list, in place of the numbers.

    What is the same object in all runs stays as it is. names: the parameters that the other runs change. Raises a
    ValueError that names one if pieces differ in more than numbers.
    """
    here = runs[0]
    if len({*map(id, runs)}) == 1:
        return here
    kinds = list(map(type if hasattr(here, "_fields") else _kind, runs))
    if kinds.count(kinds[0]) < len(kinds):
        name = next(name for name, kind in zip(names, kinds[1:], strict=True) if kind != kinds[0])
        raise ValueError(
            f"{name}: what the run is made of changes its kind or its size near this value, as a mesh or a reduction "
            "may; fix the mesh (cells), reduce with another tolerance, or go 1 % off a line of symmetry"
        )
    if isinstance(here, tuple):
        return _like(here, [gathered(parts, names, columns) for parts in zip(*runs, strict=True)])
    if not _is_number(here):
        return here
    columns.append(Column(runs, columns[-1].place.stop if columns else 0))
    return columns[-1]


def align(structure: Any) -> None:
    """Give gathered oscillators the signs of those of the first run: the sign of a mode is arbitrary."""
    modal = isinstance(structure, Oscillators)
    if modal and isinstance(structure.contact, Column):
        shape = len(structure.contact.rows), *structure.contact.value.shape
        contact = structure.contact.rows.reshape(shape)
        sign = np.copysign(1.0, (contact * contact[0]).sum(axis=1, keepdims=True))
        contact *= sign
        response = structure.response.rows.reshape(*shape[:2], 2, shape[2])
        response *= sign[:, :, None]


def _filled(piece: Any) -> Any:
    """Return a piece with what the columns in it became."""
    if isinstance(piece, tuple):
        return _like(piece, map(_filled, piece))
    return piece.dual if isinstance(piece, Column) else piece


def _like(piece: Any, parts: Iterable[Any]) -> Any:
    return type(piece)(*parts) if hasattr(piece, "_fields") else tuple(parts)


def _is_number(leaf: Any) -> bool:
    return isinstance(leaf, float) or (isinstance(leaf, np.ndarray) and leaf.dtype == float)


def _kind(piece: Any) -> Any:
    """Return in what the pieces of runs must agree."""
    if isinstance(piece, tuple):
        return type(piece), len(piece)
    if _is_number(piece):
        return getattr(piece, "shape", ())
    return piece.tobytes() if isinstance(piece, np.ndarray) else piece


def changes_of(rows: Vector) -> Vector:
    """Return by how much rows at the places around each parameter differ from the first one; rounding is none.

    WEIGHTS and DOUBTS of the four rows of a parameter, over its step, are derivatives and the doubts about them.
    """
    changes = (rows[1:] - rows[0]).reshape(len(rows) // len(PLACES), len(PLACES), rows.shape[1])
    moves = (abs(changes) > ROUNDING * abs(rows[0])).any(axis=1, keepdims=True)
    near, far = changes[:, 1] + changes[:, 2], changes[:, 0] + changes[:, 3]
    smooth = abs(4.0 * near - far) < SMOOTH * abs(near)
    # A second difference that grows to four times over twice the step is no doubt; WEIGHTS do not see this change.
    changes[:, ::3] += np.where(smooth, 0.5 * (4.0 * near - far), 0.0)[:, None]
    return np.where(moves, changes, 0.0).reshape(len(rows) - 1, rows.shape[1])


def _changed_bodies(chains: Sequence[Any], columns: Sequence[Column], moves: Vector) -> tuple[int, int]:
    """Return the range of bodies whose masses, or contacts ahead, parameters change; −1 twice if they change more.

    columns: of the chains. moves: whether parameters change each number.
    """
    (chain, *others), bodies = chains, list[int]()
    for column in (column for column in columns if column.dual is not column.value):
        of_bodies = column.value is chain.inverse_mass or column.value is getattr(chain.law, "stiffness", None)
        bodies.extend(np.flatnonzero(moves[column.place]) if of_bodies else [-1])
    if others or -1 in bodies:
        return -1, -1
    return min(bodies, default=chain.inverse_mass.size - 1), max(bodies, default=-1) + 1


def zeros(*shape: int) -> Vector:
    """Return numbers that are zero from the begin of a line of the cache on: dual numbers take half the time then."""
    count = prod(shape)
    memory = np.zeros(count + LINE // 8)
    start = -memory.ctypes.data % LINE // memory.itemsize
    return memory[start : start + count].reshape(shape)


def width_for(directions: int) -> Any:
    """Return the type of the dual numbers that carry directions in the least time."""
    return min(WIDTHS, key=lambda width: ceil(directions / (WIDTHS[width] - 1)) * (SHARED + WIDTHS[width]))


class TangentEngine(Engine):
    """The compiled loop with a recorder that carries derivatives along.

    Its directions are the parameters, and the doubt about all of these together. doubts: instead, that about each.
    """

    def __init__(
        self, simulation: CoSimulation, usual: CoSimulation, plan: Plan, frames: Frames,
        parameters: list[_Parameter], doubts: bool = False,
    ) -> None:  # fmt: skip
        scheme: Any = simulation.scheme
        super().__init__(simulation.interface, scheme, plan, frames.saved)
        self.simulation, self.parameters, self.frames, self.doubts = usual, parameters, frames, doubts
        self.directions = self.interface.size + len(parameters) + (not doubts)
        self.width = width_for(self.directions)
        self.entries = WIDTHS[self.width]
        self.groups = range(ceil(self.directions / (self.entries - 1)))
        # The group and the entry of each direction that is not that of a surface.
        self.group, entry = np.divmod(np.arange(self.interface.size, self.directions), self.entries - 1)
        self.entry = 1 + entry
        self._recorders: dict[float, Tangents] = {}
        self._numbers: dict[float, Numbers] = {}
        count, steps = len(parameters), np.array([parameter.step for parameter in parameters])
        weights, each = np.zeros((count + (not doubts), count, len(PLACES))), np.arange(count)
        weights[count:] = DOUBTS / STEP
        weights[each, each] = (DOUBTS if doubts else WEIGHTS) / steps[:, None]
        self.weights = weights.reshape(len(weights), -1)
        """Of the changes around all parameters in the derivatives of each direction."""
        self.moving = self._moving(self._dual(self.length))
        rows, groups = plan.rows, len(self.groups)
        self.force = self._zeros(groups, rows, frames.sensors.force.shape[1])
        self.velocity = self._zeros(groups, rows, frames.sensors.velocity.shape[1])

    def _zeros(self, *shape: int) -> Vector:
        """Return dual numbers that are zero, as plain numbers."""
        return zeros(*shape, self.entries)

    def _dual(self, length: float) -> Numbers:
        """Return the numbers of the run as dual ones; what no parameter changes stays plain in pieces."""
        if length in self._numbers:
            return self._numbers[length]
        names = [name for name, runs, _ in self.parameters for _ in runs]
        around = [
            numbers_of(run, length, self.simulation, self.windows) for _, runs, _ in self.parameters for run in runs
        ]
        usual, columns = numbers_of(self.simulation, length, None, self.windows), list[Column]()
        chains, structures, *others = zip(usual, *around, strict=True)
        pieces, of_chains = [gathered(chains, names, columns)], columns.copy()
        pieces += [gathered(values, names, columns) for values in (structures, *others)]
        align(pieces[1])
        rows = np.concatenate([column.rows for column in columns], axis=1)
        directions: Any = self.weights @ changes_of(rows)
        moves, lanes = directions.any(axis=0), self._zeros(len(self.groups), rows.shape[1])
        lanes[..., 0], lanes[self.group, :, self.entry] = rows[0], directions
        for column in columns:
            if np.count_nonzero(moves[column.place]):
                column.dual = self._lanes(column.value, lanes[:, column.place])
        (moved, *more), *rest = map(_filled, pieces)
        (first, end), chain = _changed_bodies(usual.chains, of_chains, moves), usual.chains[0]
        self.begin = first if chain.quiet and not any(isinstance(piece, Lanes) for piece in rest[2:]) else -1
        elastic = isinstance(chain.scheme, Verlet) and isinstance(chain.loss, NoLoss)
        if end > 0 and elastic and isinstance(chain.law, Hertz):
            stiffness, inverse_mass = map(self._lanes, (moved.law.stiffness, moved.inverse_mass))
            law = Partly(stiffness, chain.law, chain.inverse_mass, first, end)
            moved = moved._replace(law=law, inverse_mass=inverse_mass)
        self._numbers[length] = Numbers((moved, *more), rest[0], *map(self._lanes, rest[1:]))
        return self._numbers[length]

    def _lanes(self, value: Any, entries: Vector | None = None) -> Any:
        """Return a number as a dual one, if it is not; entries: groups × size × entries, by default without slopes."""
        if isinstance(value, Lanes):
            return value
        lanes = self._zeros(len(self.groups), *(np.shape(value) or (1,)))
        if entries is None:
            lanes[..., 0] = value
        else:
            lanes[...] = entries.reshape(lanes.shape)
        return (Lanes if np.ndim(value) else Lane)(lanes, self.width())

    def _moving(self, numbers: Any) -> Moving:
        """Return the start of the run in dual numbers."""
        groups, contacts, coordinates = len(self.groups), self.interface.size, self.interface.begin[-1, 0]
        return Moving(
            numbers.y.values,
            numbers.v.values,
            self._zeros(groups, 2, self.trial.free.size),
            np.zeros(groups, dtype=int),
            self._zeros(groups, 3, contacts),
            self._zeros(groups, 2, contacts),
            self._zeros(1, WORK_ROWS, coordinates),
            np.zeros(groups, dtype=bool),
            np.zeros(1, dtype=bool),
        )

    def recorder_of(self, length: float) -> Tangents:
        """Return the recorder for windows of a length, s."""
        if length not in self._recorders:
            numbers: Any = self._dual(length)
            model = Model(*numbers[:4])
            contacts, (_, plan) = self.interface.size, self.of_length(length)
            plan = self.contacts(plan.compliance, plan.steps, alone=False)
            self._recorders[length] = Tangents(
                self.frames.saved, self.frames.sensors, plan, model, self.moving, np.zeros((contacts, contacts)),
                self.force, self.velocity, self.width(), self.begin,
            )  # fmt: skip
        return self._recorders[length]

    def _move(self, run: Run, length: float, windows: tuple[int, int, int, int]) -> Any:
        pieces = run, self.chains, *self.of_length(length), self.search, self.recorder_of(length), self.trial
        return self.kernel(*pieces, self.interface.begin, length, windows)

    def by_direction(self) -> tuple[list[Vector], list[Vector]]:
        """Return the derivatives of forces and velocities in each direction."""
        force, velocity = (
            [kept[group, ..., entry] for group, entry in zip(self.group, self.entry, strict=True)]
            for kept in (self.force, self.velocity)
        )
        return force, velocity
