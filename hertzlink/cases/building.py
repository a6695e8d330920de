"""From a checked case to objects of hertzlink's."""

from collections import OrderedDict
from collections.abc import Mapping
from pathlib import Path as File
from typing import Any

from coupling.cosimulation import CoSimulation
from hertzlink.cases.bodies import Body, Rayleigh
from hertzlink.cases.chains import ChainPart
from hertzlink.cases.faults import Fault, fault_of
from hertzlink.cases.model import CaseModel, Reduction, RunPart
from hertzlink.cases.parts import World, made
from hertzlink.cases.paths import Path
from structures.material import Material
from structures.moving import MovingStructure
from structures.reduction import reduce
from structures.structure import Structure

KEPT = 8
"""Structures that are kept for the next run: those of a sweep often differ in the chain alone."""

_KEPT: OrderedDict[str, Structure | None] = OrderedDict()


def world_of(model: CaseModel, folder: File) -> World:
    """The materials, the folder and the record of a case."""
    own: dict[str, Material] = {}
    for name, one in model.materials.items():
        material: Material = made(one, World(own), ("materials", name))
        own[name] = material if material.name else Material(**{**vars(material), "name": name})
    return World(own, folder, model.run.until)


def simulation_of(
    model: CaseModel, folder: File, structures: Mapping[str, Structure | None] | None = None
) -> CoSimulation:
    """The co-simulation of a case. structures: those that are known already, by "structure" and "behind"."""
    world = world_of(model, folder)
    known = dict(structures or {})
    chain = made(model.chain, world, ("chain",))
    for name in ("structure", "behind"):
        body = getattr(model, name)
        if name not in known:
            known[name] = None if body is None else structure_of(body, model.run, world, (name,))
    run = model.run
    window = run.window if run.adaptive is None else made(run.adaptive, world, ("run", "adaptive"))
    scheme = None if run.scheme is None else made(run.scheme, world, ("run", "scheme"))
    try:
        return CoSimulation(
            chain, known["structure"], scheme, window, substeps=run.substeps, waveform=run.waveform,
            behind=known["behind"], accuracy=run.accuracy,
        )  # fmt: skip
    except ValueError as error:
        raise _fault(str(error)) from error


def _fault(message: str) -> Fault:
    """What a message of CoSimulation is about; of the chain, where it names nothing else."""
    sections: dict[str, Path] = {name: (name,) for name in ("structure", "behind")}
    for section, part in (("chain", ChainPart), ("run", RunPart)):
        sections |= {name: (section, name) for name in part.model_fields}
    fault = fault_of(message, sections)
    return fault if fault.path else Fault(("chain",), message)


def structure_of(body: Body, run: RunPart, world: World, path: Path) -> Structure | None:
    """The structure, reduced where it is large; the last ones are kept."""
    key = "\n".join(map(repr, (body, run.until, run.reduce, sorted(world.materials.items()))))
    if getattr(body, "mesh", None) is not None:
        return _structure(body, run, world, path)
    if key not in _KEPT:
        _KEPT[key] = _structure(body, run, world, path)
        while len(_KEPT) > KEPT:
            _KEPT.popitem(last=False)
    _KEPT.move_to_end(key)
    return _KEPT[key]


def _structure(body: Body, run: RunPart, world: World, path: Path) -> Structure | None:
    structure: Structure | None = made(body, world, path)
    if structure is None:
        return None
    early = [isinstance(one, Rayleigh) for one in body.damping]
    for i, one in enumerate(body.damping):
        if early[i]:
            structure = _damped(one, structure, (*path, "damping", i))
    structure = reduced(structure, run, ("run",))
    for i, one in enumerate(body.damping):
        if not early[i]:
            structure = _damped(one, structure, (*path, "damping", i))
    return structure


def _damped(damping: Any, structure: Structure, path: Path) -> Structure:
    try:
        damped: Structure = damping.damped(structure)
        return damped
    except ValueError as error:
        raise Fault(path, str(error)) from error


def reduced(structure: Structure, run: RunPart, path: Path) -> Structure:
    """The structure as `[run] reduce` wants it; small ones stay as they are."""
    if run.reduce is False or not structure.size:
        return structure
    settings = run.reduce.given("until") if isinstance(run.reduce, Reduction) else {}
    until = run.reduce.until if isinstance(run.reduce, Reduction) and run.reduce.until else run.until
    if not isinstance(run.reduce, Reduction) and (structure.valid_until < float("inf") or _compact(structure)):
        return structure
    try:
        return reduce(structure, until, **settings)
    except ValueError as error:
        raise Fault((*path, "reduce"), str(error)) from error


def _compact(structure: Structure) -> bool:
    return bool(MovingStructure(structure).compact)
