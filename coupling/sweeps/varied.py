"""Quantities of a simulation that vary as arrays, and the numbers of all runs that follow from them.

Nothing is built for a run. Its masses, stiffnesses and oscillators are columns of arrays, by the formulas that serve
one run too.
"""

from collections.abc import Mapping
from copy import copy
from dataclasses import fields, is_dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any, NamedTuple

import numpy as np

from coupling.cosimulation import CoSimulation
from coupling.schemes.halving import Adaptive
from coupling.sweeps.entry_paths import Path, parsed
from particles.bead import Sphere
from particles.chain import Chain
from particles.dissipation import coefficients_of, kernel_loss
from particles.kernels.losses import NoLoss
from plates.scaling import factors, scalable, scaled
from structures.checks import count_of, instance, short
from structures.kernels.linear import Oscillators
from structures.material import Material
from structures.moving import MovingStructure
from structures.oscillators import propagators
from structures.structure import Structure, Vector
from structures.surface import Surface, round_stiffness

MOST_QUANTITIES = 8
"""Quantities that may vary: each doubles the corners of their ranges, which are built and run on their own."""

PLATE: dict[Path, str] = {
    ("structure", "thickness"): "thickness",
    ("structure", "material", "youngs_modulus"): "youngs_modulus",
    ("structure", "material", "density"): "density",
}
"""What may vary of a structure: the scaling of Kirchhoff's plates is exact."""

BODIES = "bead", "beads", "striker"

CHAIN = "impact_speed", *BODIES, "dissipation"
"""What may vary of a chain: the speed, bodies, and the numbers of the loss."""

IN_GENERAL = "; give a function that builds the simulation to `batch` instead"


class Model(NamedTuple):
    """Arrays of the compiled loop with a last axis for the runs; None where all runs have the same."""

    stiffness: Vector | None
    """Of the contacts, N/m^1.5."""
    inverse_mass: Vector | None
    coefficient: Vector | None
    """Of the loss."""
    flexibility: Vector | None
    """Of the structure, m/N."""
    speed: Vector | None
    """Of the body that moves at time zero, m/s."""
    structure: Oscillators | None


class Varied:
    """A simulation, and values of its quantities for each of many runs.

    simulation: what the quantities belong to. columns: their values by path, as many for each.
    """

    def __init__(self, simulation: CoSimulation, columns: Mapping[str, Vector]) -> None:
        self.simulation, self.columns = simulation, dict(columns)
        self.paths: dict[str, Path] = {name: _checked_path(name) for name in columns}
        self.count = len(next(iter(self.columns.values())))
        self._check()

    @cached_property
    def corners(self) -> list[CoSimulation]:
        """The simulations at the corners of the ranges. What suits all of them suits the runs between."""
        ends = [sorted({float(column.min()), float(column.max())}) for column in self.columns.values()]
        return [self._with(dict(zip(self.columns, values, strict=True))) for values in product(*ends)]

    def at(self, run: int) -> CoSimulation:
        """Return the simulation of one run."""
        return self._with({name: float(column[run]) for name, column in self.columns.items()})

    def cut(self, first: int, last: int) -> "Varied":
        """Return the runs with numbers from `first` to before `last`."""
        part = copy(self)
        for cached in ("_plate", "_bodies", "_masses", "_factors"):
            vars(part).pop(cached, None)
        part.columns = {name: column[first:last] for name, column in self.columns.items()}
        part.count = len(next(iter(part.columns.values())))
        return part

    def model(self, window: float) -> Model:
        """Return the arrays that differ between runs, whose structures move over a window, s."""
        heads = {path[:2] for path in self.paths.values()}
        bodies = any(path[0] == "chain" and path[1] in BODIES for path in heads)
        modulus = ("structure", "material", "youngs_modulus") in self.paths.values()
        mass = self._masses if bodies else None
        return Model(
            self._stiffness() if bodies or modulus else None,
            None if mass is None else 1.0 / mass,
            self._coefficients(mass) if bodies or ("chain", "dissipation") in heads else None,
            self._flexibility() if self._plate else None,
            self._column(("chain", "impact_speed")),
            self._oscillators(window) if self._plate else None,
        )

    @property
    def _chain(self) -> Chain:
        chain: Chain = self.simulation.interface.chains[0].chain
        return chain

    @cached_property
    def _plate(self) -> dict[str, Vector]:
        """The values of the plate's quantities that vary, by name."""
        return {PLATE[path]: self.columns[name] for name, path in self.paths.items() if path in PLATE}

    def _column(self, path: Path) -> Vector | None:
        return next((self.columns[name] for name, place in self.paths.items() if place == path), None)

    def _with(self, values: Mapping[str, float]) -> CoSimulation:
        """Return the simulation with these values, by path."""
        chain, plate = self._chain, dict[str, float]()
        for name, value in values.items():
            path = self.paths[name]
            if path in PLATE:
                plate[PLATE[path]] = value
                continue
            try:
                chain = _changed_chain(chain, path[1:], value)
            except ValueError as error:
                raise ValueError(f"quantities: {name} = {value!r}: {error}") from None
        changes: dict[str, Any] = {"chain": chain}
        if plate:
            old: Any = self.simulation.structure.structure
            material = Material(**old.origin["material"])
            moduli: dict[str, Any] = {name: plate[name] for name in ("youngs_modulus", "density") if name in plate}
            changes["structure"] = scaled(old, plate.get("thickness"), replace(material, **moduli))
        return self.simulation.replace(**changes)

    def _check(self) -> None:
        """Raise a ValueError for what no run, or not each, could have."""
        simulation = self.simulation
        if len(simulation.interface.chains) > 1 or type(self._chain) is not Chain:
            raise ValueError(f"simulation = {simulation!r}: quantities vary of one chain of rigid beads{IN_GENERAL}")
        if simulation.interface.black_boxes or isinstance(simulation.window, Adaptive):
            raise ValueError(
                f"simulation = {simulation!r}: quantities vary of linear structures and in equal windows{IN_GENERAL}"
            )
        if len(self.columns) > MOST_QUANTITIES:
            raise ValueError(f"quantities: has {len(self.columns)} quantities; at most {MOST_QUANTITIES}")
        if self._plate:
            moving = instance("structure", simulation.structure, MovingStructure, "a Structure")
            scalable("structure", moving.structure.origin, moving.structure.damping is not None)
            if not isinstance(moving.window(1.0), Oscillators) or moving.structure.contacts > 1:
                raise ValueError(
                    "structure: has no oscillators, or several contacts; use reduce(plate.at(x, y), until)"
                )
        first = self.corners[0].interface.chains[0]
        changes_rest = [name for name, path in self.paths.items() if path[1] not in ("impact_speed", "dissipation")]
        if changes_rest and first.rest[: first.mass.size].any():
            raise ValueError(
                f"quantities: {changes_rest[0]}: cannot vary where a preload or gravity presses the chain and its "
                f"equilibrium changes{IN_GENERAL}"
            )

    @property
    def _usual(self) -> list[Any]:
        """Striker (or None), beads and the surface at the end (or None)."""
        pairs = self.simulation.interface.chains[0].pairs
        return [self._chain.body, *self._chain.beads, None if pairs[-1] is None else pairs[-1][1]]

    @cached_property
    def _bodies(self) -> list[Any]:
        """The bodies with arrays where their quantities vary."""
        chain, bodies = self._chain, self._usual
        for name, path in self.paths.items():
            column = self.columns[name]
            if path[0] == "chain" and path[1] in BODIES:
                places = _places(chain, path)
                rest = path[3:] if path[1] == "beads" else path[2:]
                changed = _with_arrays(bodies[places[0]], rest, column)
                for place in places:
                    bodies[place] = changed
            elif PLATE.get(path) == "youngs_modulus":
                bodies[-1] = _with_arrays(bodies[-1], ("material", "youngs_modulus"), column)
        return bodies

    @cached_property
    def _masses(self) -> Vector:
        """Masses of the bodies, kg, bodies × runs; infinite for a body 0 that is none."""
        masses = [np.inf if body is None else body.mass for body in self._bodies[:-1]]
        return np.array([np.broadcast_to(mass, self.count) for mass in masses])

    def _stiffness(self) -> Vector:
        """Return the stiffnesses of the contacts, contacts × runs."""
        moving, bodies, usual = self.simulation.interface.chains[0], self._bodies, self._usual
        rows = [np.full(self.count, value) for value in moving.model.law.stiffness]
        stiffness: dict[tuple[int, int], Vector] = {}
        for i in range(len(rows)):
            pair, law = (bodies[i], bodies[i + 1]), moving.laws[i]
            if law is None or (pair[0] is usual[i] and pair[1] is usual[i + 1]):
                continue
            if self._chain.law is not None or law.kernel[1] is not None:
                raise ValueError(f"law: of contact {i + 1} does not follow from the bodies alone{IN_GENERAL}")
            if (id(pair[0]), id(pair[1])) not in stiffness:
                stiffness[id(pair[0]), id(pair[1])] = _contact_stiffness(*pair)
            rows[i] = stiffness[id(pair[0]), id(pair[1])]
        return np.array([np.broadcast_to(row, self.count) for row in rows])

    def _coefficients(self, mass: Vector | None) -> Vector | None:
        """Return the coefficients of the loss, contacts (or bodies) × runs; mass: of the bodies where it varies, kg."""
        moving = self.simulation.interface.chains[0]
        loss: Any = self._chain.dissipation
        base = moving.reduced_mass
        if loss is None or isinstance(moving.model.loss, NoLoss):
            return None
        if type(loss).coefficients.__module__ != kernel_loss.__module__:
            raise ValueError(f"dissipation = {short(loss)}: a loss of your own cannot vary{IN_GENERAL}")
        present = np.array([law is not None for law in moving.laws])
        columns = {str(path[2]): self.columns[name] for name, path in self.paths.items() if path[1] == "dissipation"}
        losses = [loss]
        places = np.zeros(self.count, dtype=np.int64)
        if columns:
            values, places = np.unique(np.array(list(columns.values())), axis=1, return_inverse=True)
            losses = [replace(loss, **dict(zip(columns, map(float, column), strict=True))) for column in values.T]
        pieces = np.array([kernel_loss(loss, base, present).coefficient for loss in losses]).T[:, places.ravel()]
        if mass is None:
            return pieces
        inverse = np.append(1.0 / mass, np.zeros((1, self.count)), axis=0)
        reduced = 1.0 / (inverse[:-1] + inverse[1:])
        # All losses of ours are a number times a function of the mass.
        strongest = max(losses, key=lambda loss: float(coefficients_of(loss, base).max()))
        scaled_up: Vector = pieces * strongest.coefficients(reduced) / strongest.coefficients(base)[:, None]
        return scaled_up

    @cached_property
    def _factors(self) -> tuple[Vector, Vector]:
        """The factors of mass and stiffness of the plates."""
        structure: Structure = self.simulation.structure.structure
        wall = scalable("structure", structure.origin, False)
        usual = {
            "thickness": wall.thickness,
            "youngs_modulus": wall.struck.youngs_modulus,
            "density": wall.struck.density,
        }
        return factors(wall, **{**usual, **self._plate})

    def _flexibility(self) -> Vector:
        flexibility = self.simulation.structure.structure.flexibility / self._factors[1]
        return np.array(np.broadcast_to(flexibility, self.count))

    def _oscillators(self, window: float) -> Oscillators:
        """Return the oscillators of all plates over a window, s."""
        structure: Structure = self.simulation.structure.structure
        heavier, stiffer = self._factors
        square = structure.stiffness.diagonal()[:, None] * np.broadcast_to(stiffer / heavier, self.count)
        rows, lag, push, _ = propagators(square, np.zeros_like(square), window)
        contact = structure.contact_vectors.T[:, :, None] * np.broadcast_to(heavier**-0.5, self.count)
        response = np.concatenate([lag * contact, push * contact], axis=1)
        return Oscillators(rows, response, contact, square, np.zeros((0, self.count)), np.array([0, structure.size]))


def _checked_path(name: str) -> Path:
    """Return the path that a name states, or raise a ValueError for what cannot vary."""
    try:
        path = parsed(name)
    except ValueError as error:
        raise ValueError(f"quantities: {error}") from None
    if len(path) < 2 or path[0] not in ("chain", "structure"):
        raise ValueError(
            f'vary: "{name}" cannot vary; name an entry of the chain or the structure, as chain.impact_speed'
        )
    if path[0] == "structure" and path not in PLATE:
        varying = ", ".join(".".join(map(str, path)) for path in PLATE)
        raise ValueError(f'quantities: "{name}" cannot vary; of a structure {varying} can{IN_GENERAL}')
    if path[0] == "chain" and path[1] not in CHAIN:
        raise ValueError(
            f'vary: "{name}" cannot vary; of a chain impact_speed, bead, beads[i], striker, dissipation can'
        )
    if path[1] == "beads" and (len(path) < 4 or not isinstance(path[2], int)):
        raise ValueError(f'quantities: "{name}" names no bead; write it as chain.beads[3].radius, counted from 0')
    return path


def _places(chain: Chain, path: Path) -> list[int]:
    """Return the bodies that a path names: 0 is the striker, 1 the first bead."""
    if path[1] == "striker":
        if chain.body is None or chain.body is not chain.striker:
            raise ValueError(f"{short(chain.striker)} is no bead")
        return [0]
    if path[1] == "beads":
        number = path[2]
        if not isinstance(number, int) or number >= len(chain.beads):
            raise ValueError(f"the chain has {count_of(len(chain.beads), 'bead')}, counted from 0")
        return [1 + number]
    if any(bead != chain.beads[0] for bead in chain.beads):
        raise ValueError("the beads differ; name one of them, such as chain.beads[0]")
    # As in a case: a striker like the beads is the bead.
    return [0] * (chain.striker == chain.beads[0]) + list(range(1, len(chain.beads) + 1))


def _changed_chain(chain: Chain, path: Path, value: float) -> Chain:
    """Return the chain with another value at a path."""
    if path[0] in ("impact_speed", "dissipation"):
        changed: Chain = _changed(chain, path, value)
        return changed
    places, beads, striker = _places(chain, ("chain", *path)), list(chain.beads), chain.striker
    rest = path[2:] if path[0] == "beads" else path[1:]
    body = _changed(striker if places[0] == 0 else beads[places[0] - 1], rest, value)
    for place in places:
        if place == 0:
            striker = body
        else:
            beads[place - 1] = body
    return replace(chain, beads=beads, striker=striker)


def _changed(thing: Any, path: Path, value: Any) -> Any:
    """Return a dataclass with another value at a path of fields."""
    if not path:
        return value
    return replace(thing, **{str(path[0]): _changed(_field(thing, path[0]), path[1:], value)})


def _field(thing: Any, name: str | int) -> Any:
    """Return a field of a dataclass, or raise a ValueError that lists them."""
    names = [field.name for field in fields(thing)] if is_dataclass(thing) else []
    if name not in names:
        listed = f"has {', '.join(names)}" if names else "has no entries"
        raise ValueError(f"{type(thing).__name__} has no {name}; it {listed}")
    return getattr(thing, str(name))


def _with_arrays(thing: Any, path: Path, column: Vector) -> Any:
    """Return a copy of a dataclass with an array at a path of its fields, in which its formulas hold for all runs."""
    if type(thing) not in (Sphere, Material, Surface):
        raise ValueError(f"{type(thing).__name__}: only Spheres vary{IN_GENERAL}")
    copied, name, rest = copy(thing), str(path[0]), path[1:]
    object.__setattr__(copied, name, _with_arrays(getattr(thing, name), rest, column) if rest else column)
    return copied


def _contact_stiffness(first: Any, second: Any) -> Any:
    """Return the stiffnesses of a contact of spheres, or of a sphere and a flat, N/m^1.5."""
    curvature, compliance = 0.0, 0.0
    for body in (first, second):
        if not isinstance(body, Sphere | Surface) or (
            isinstance(body, Surface) and body.curvature != body.second_curvature
        ):
            raise ValueError(f"{short(body)}: quantities vary of round contacts only{IN_GENERAL}")
        curvature = curvature + (1.0 / body.radius if isinstance(body, Sphere) else body.curvature)
        compliance = compliance + 1.0 / body.material.contact_modulus
    return round_stiffness(curvature, compliance)
