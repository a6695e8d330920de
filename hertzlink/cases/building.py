"""The way from a checked case to objects of hertzlink's."""

from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path as File
from typing import Any

from coupling.cosimulation import CoSimulation
from coupling.interface import ContactPoint
from hertzlink.cases.bodies import Body, Built, Nothing, Reduction, damped, is_early
from hertzlink.cases.chains import Seat
from hertzlink.cases.entry_paths import Path, written
from hertzlink.cases.faults import Fault, fault_of
from hertzlink.cases.model import CaseModel, RunPart, run_entries
from hertzlink.cases.parts import World, located, made, names_file
from plates.laminate import OrthotropicMaterial
from structures.fineness import fineness
from structures.material import Material
from structures.moving import MovingStructure
from structures.reduction import reduce
from structures.structure import Structure
from structures.unmeshed import is_unmeshed

STORED = 8
"""Structures that are kept for the next run: those of a sweep often differ in the chain alone."""

_STRUCTURES: OrderedDict[str, Any] = OrderedDict()


def world_of(model: CaseModel, folder: File) -> World:
    """Return the materials, the folder and the record of a case."""
    materials: dict[str, Material] = {}
    sheets: dict[str, OrthotropicMaterial] = {}
    for name, material_part in model.materials.items():
        material = made(material_part, World(materials), ("materials", name))
        # The name under which the user knows it, not that of the material it is like.
        material = material if material_part.name else replace(material, name=name)
        (sheets if isinstance(material, OrthotropicMaterial) else materials)[name] = material
    return World(materials, folder, model.run.until, sheets)


def simulation_of(
    model: CaseModel, folder: File, structures: Mapping[str, Structure | None] | None = None
) -> CoSimulation:
    """Return the co-simulation of a case. structures: those that are known already, by "structure" and "behind"."""
    world = world_of(model, folder)
    described = dict(structures or {})
    many = isinstance(model.chain, list)
    paths: list[Path] = [("chain", i) for i in range(len(model.chains))] if many else [("chain",)]
    chains = [made(part, world, path) for part, path in zip(model.chains, paths, strict=True)]
    bodies = Bodies(model, world, described)
    facing = [bodies.facing(i, path) for i, path in enumerate(paths)]
    behind = [bodies.behind(i, path) for i, path in enumerate(paths)]
    settings = made(model.run, world, ("run",))
    ends = (facing, behind) if many else (facing[0], behind[0])
    try:
        return CoSimulation(chains if many else chains[0], ends[0], behind=ends[1], **settings)
    except ValueError as error:
        raise _fault(str(error), model) from error


class Bodies:
    """The structures of a case, each built once, and the points that chains face."""

    def __init__(self, model: CaseModel, world: World, structures: dict[str, Any]) -> None:
        self._model, self._world, self._known = model, world, structures
        self._taken: set[tuple[int, int]] = set()
        many = isinstance(model.structure, list)
        self._parts: list[Body] = [*model.structure] if isinstance(model.structure, list) else [model.structure]
        self._paths: list[Path] = [("structure", i) for i in range(len(self._parts))] if many else [("structure",)]
        if model.behind is not None and (many or isinstance(model.chain, list)):
            raise Fault(("behind",), "belongs to one [chain] on one [structure]; else give the chain behind = {...}")

    def facing(self, number: int, path: Path) -> Any:
        """Return what the last bead of a chain faces."""
        chain, count = self._model.chains[number], len(self._model.chains)
        if chain.on is not None:
            return self._seat(chain.on, (*path, "on"))
        if len(self._parts) not in (1, count):
            hint = f"is missing; there are {len(self._parts)} structures, so give one, such as {{ structure = 0 }}"
            raise Fault((*path, "on"), hint)
        index = number if len(self._parts) == count else 0
        points = self._parts[index].contacts
        if points > 1 and (len(self._parts) > 1 or count != points):
            hint = f"is missing; the structure has {points} contact points, so give one, such as {{ point = 0 }}"
            raise Fault((*path, "on"), hint)
        shared = len(self._parts) == 1 and count > 1
        return self._at(index, number if shared else 0, (*path, "on"))

    def behind(self, number: int, path: Path) -> Any:
        """Return what the first bead of a chain faces with its struck side."""
        chain = self._model.chains[number]
        if chain.behind is not None:
            if self._model.behind is not None:
                raise Fault((*path, "behind"), "is given by the section [behind] as well; leave out one")
            return self._seat(chain.behind, (*path, "behind"))
        return self._of("behind", self._model.behind, ("behind",)) if self._model.behind is not None else None

    def _seat(self, seat: Seat, path: Path) -> Any:
        if seat.structure >= len(self._parts):
            count = len(self._parts)
            raise Fault((*path, "structure"), f"{seat.structure} is no structure of {count}, counted from 0")
        return self._at(seat.structure, seat.point, path)

    def _at(self, structure: int, point: int, path: Path) -> Any:
        points = self._parts[structure].contacts
        if point >= points:
            raise Fault(
                (*path, "point"), f"{point} is no contact point of {points}, counted from 0; give the structure more"
            )
        if (structure, point) in self._taken and not isinstance(self._parts[structure], Nothing):
            raise Fault(path, "is the contact point of another chain; give each its own, as in at = [[...], [...]]")
        self._taken.add((structure, point))
        name = written(self._paths[structure])
        body = self._of(name, self._parts[structure], self._paths[structure])
        return body if points == 1 or body is None else ContactPoint(body, point)

    def _of(self, name: str, part: Body, path: Path) -> Any:
        if name not in self._known:
            self._known[name] = structure_of(part, self._model.run, self._world, path)
        return self._known[name]


def _fault(message: str, model: CaseModel) -> Fault:
    """Return what a message of CoSimulation is about; of the chain, where it names nothing else."""
    sections: dict[str, Path] = {name: (name,) for name in ("structure", "behind")}
    chain: dict[str, Path] = {name: ("chain", name) for name in type(model.chains[0]).model_fields}
    fault = fault_of(message, {**sections, **chain, **run_entries()})
    return fault if fault.path else Fault(("chain",), message)


def structure_of(body: Body, run: RunPart, world: World, path: Path) -> Any:
    """Return the structure, reduced where it is large; the last ones are kept."""
    materials = sorted(world.materials.items()), sorted(world.sheets.items())
    # Two equal structures of one case are two bodies.
    names = [name for name in type(body).model_fields if names_file(name, getattr(body, name))]
    files = [world.folder / getattr(body, name) for name in names]
    written_at = [file.stat().st_mtime_ns for file in files if file.is_file()]
    key = "\n".join(map(repr, (path, body, run.until, run.reduce, materials, fineness(), written_at)))
    if getattr(body, "mesh", None) is not None or is_unmeshed():
        return _structure(body, run, world, path)
    if key not in _STRUCTURES:
        _STRUCTURES[key] = _structure(body, run, world, path)
        while len(_STRUCTURES) > STORED:
            _STRUCTURES.popitem(last=False)
    _STRUCTURES.move_to_end(key)
    return _STRUCTURES[key]


def _structure(body: Body, run: RunPart, world: World, path: Path) -> Any:
    structure: Structure | None = made(body, world, path)
    if structure is None or not isinstance(body, Built):
        return structure
    structure = _damped(body, structure, world, path, early=True)
    run_of_body = run if body.reduce is None else run.model_copy(update={"reduce": body.reduce})
    structure = reduced(structure, run_of_body, ("run",) if body.reduce is None else path)
    return _damped(body, structure, world, path, early=False)


def _damped(body: Built, structure: Structure, world: World, path: Path, early: bool) -> Structure:
    """The structure with the dampings that act before it is reduced, or after."""
    for i, damping in enumerate(body.damping):
        if is_early(damping) == early:
            structure = located(damping, (*path, "damping", i), partial(damped, damping, structure, world))
    return structure


def reduced(structure: Structure, run: RunPart, path: Path) -> Structure:
    """Return the structure as `[run] reduce` wants it; small ones stay as they are."""
    if run.reduce is False or is_unmeshed() or not structure.size:
        return structure
    reduction = run.reduce if isinstance(run.reduce, Reduction) else None
    if reduction is None and (structure.valid_until < float("inf") or _compact(structure)):
        return structure
    settings = {"until": run.until, **({} if reduction is None else reduction.given())}
    try:
        return reduce(structure, **settings)
    except ValueError as error:
        names: dict[str, Path] = {name: (*path, "reduce", name) for name in settings}
        if reduction is None or reduction.until is None:
            names["until"] = ("run", "until")
        fault = fault_of(str(error), names)
        raise (fault if fault.path else Fault((*path, "reduce"), str(error))) from error


def _compact(structure: Structure) -> bool:
    return bool(MovingStructure(structure).compact)
