"""A case as an object: data that build a co-simulation, and that are written as TOML."""

import sys
from collections import OrderedDict
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, field, replace
from functools import cached_property
from hashlib import sha256
from importlib.machinery import ModuleSpec, SourceFileLoader
from importlib.util import module_from_spec
from pathlib import Path as File
from typing import Any

import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.interface import ContactPoint
from hertzlink.cases.forms import form_of
from hertzlink.cases.parts import MOST, Identify, Measure, Sections, nothing
from hertzlink.cases.paths import Fault, Path, as_toml, entry, parsed, put, written
from hertzlink.cases.reader import Call, Context, step
from hertzlink.cases.reader import read as read_value
from hertzlink.cases.source import Source, read_source
from plates.plate import are_meshed
from structures.checks import count_of
from structures.damping import Rayleigh, damped
from structures.described import Parameter, noted, registered
from structures.fineness import fineness
from structures.material import Material
from structures.moving import MovingStructure
from structures.quantities import InFile
from structures.reduction import reduce
from structures.structure import Structure

SECTIONS_OF_PATHS: tuple[Path, ...] = (("sensitivities",), ("sweep",), ("identify", "unknowns"))
"""Sections whose keys are paths of entries."""

OF_MATERIALS = ("youngs_modulus", "poisson_ratio", "density")
"""Numbers of a material that a case names."""

STORED = 8
"""Structures that are kept for the next run: those of a sweep often differ in the chain alone."""

_STRUCTURES: OrderedDict[str, Any] = OrderedDict()

_LOADED: dict[str, bytes] = {}
"""Files of --with that were run, by path: one that did not change runs once in each process."""


@dataclass(frozen=True)
class Case:
    """One case: the data of its TOML file, and what they build.

    Parameters
    ----------
    data : dict
        The sections, as tomllib reads them.
    folder : Path
        The folder from which files that the case names are found.
    parts : tuple of Path
        Files of Python that describe parts which the case uses.
    """

    data: dict[str, Any]
    folder: File = field(default_factory=File)
    parts: tuple[File, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        # Another process reads it again: described parts have no module to be found in.
        return Case, (self.data, self.folder, self.parts)

    @cached_property
    def tree(self) -> Call:
        """The checked sections; a Fault where one is wrong."""
        load(self.parts)
        return tree_of(self.data, self.folder)

    @property
    def until(self) -> float:
        """Length of the record, s."""
        return float(self.tree.entries["run"].entries["until"])

    @property
    def title(self) -> str:
        """The text above the table; empty where there is none."""
        return str(self.tree.entries.get("title", ""))

    @property
    def measure(self) -> Measure:
        """What is read from runs."""
        section = self.tree.entries.get("measure")
        return Measure() if section is None else section.made  # type: ignore[no-any-return]

    @property
    def identify(self) -> Identify | None:
        """What is found from a measured signal."""
        section = self.tree.entries.get("identify")
        return None if section is None else section.made

    @property
    def chains(self) -> list[Call]:
        """All chains."""
        chains = self.tree.entries["chain"]
        return chains if isinstance(chains, list) else [chains]

    def only_chain(self, what: str) -> Call:
        """Return the only chain; a Fault where there are several, which `what` does not take."""
        if isinstance(self.tree.entries["chain"], list):
            raise Fault(("chain",), f"has {len(self.chains)} sections; {what} takes one, [chain]")
        return self.chains[0]

    def value(self, path: Path) -> Any:
        """Return the checked value (SI) at a path, or a property of a named material; None where there is none."""
        at: Any = self.tree
        for part in path:
            at = step(at, part)
        return at

    def parameter(self, path: Path) -> Parameter | None:
        """Return the parameter that the entry at a path is, or is a number of."""
        at: Any = self.tree
        parameter = None
        for part in path:
            if isinstance(at, Call | Material):
                form = at.form if isinstance(at, Call) else form_of(Material)
                parameter = form.entries.get(str(part))
            at = step(at, part)
        return parameter

    def numbers(self, section: str) -> Iterator[Path]:
        """Yield the paths of the numbers, other than counts, that a section of the case holds."""

        def walk(value: Any, path: Path) -> Iterator[Path]:
            if isinstance(value, float):
                yield path
            elif isinstance(value, Material) or (isinstance(value, Call) and value.path != path):
                yield from ((*path, name) for name in OF_MATERIALS)
            elif isinstance(value, Call | Mapping):
                entries = value.entries if isinstance(value, Call) else value
                for name, inner in entries.items():
                    yield from walk(inner, (*path, name))
            elif isinstance(value, list | tuple):
                for number, inner in enumerate(value):
                    yield from walk(inner, (*path, number))

        yield from walk(self.tree.entries.get(section), (section,))

    def simulation(self) -> CoSimulation:
        """Return the co-simulation; raise a ValueError that names the entry which is refused."""
        load(self.parts)
        return _simulation(tree_of(self.data, self.folder))

    def run(self) -> xr.Dataset:
        """Run it, without its sweep."""
        return run_once(self, self.simulation())

    def changed(self, changes: Mapping[Any, Any]) -> "Case":
        """Return the same case with other values, by their paths as text or parts: {"structure.thickness": "1 mm"}."""
        data = deepcopy(self.data)
        for name, value in changes.items():
            put(data, parsed(name) if isinstance(name, str) else name, deepcopy(value))
        return replace(self, data=data)

    def to_toml(self) -> str:
        """Return the text of a case file, whose first lines name the files of parts of the user's own."""
        sums = [sha256(_LOADED[str(file.absolute())]).hexdigest() for file in self.parts]
        lines = [f"# --with {file.name}, SHA-256 {sum_}\n" for file, sum_ in zip(self.parts, sums, strict=True)]
        return "".join(lines) + as_toml(self.data)


def run_once(case: Case, simulation: CoSimulation) -> xr.Dataset:
    """Run a simulation as the section [run] wants it."""
    run = case.tree.entries["run"]
    with of_run(case):
        return simulation.run(run.entries["until"], run.entries.get("save_every"))


@contextmanager
def of_run(case: Case) -> Iterator[None]:
    """Turn messages that name an entry of the section [run] into its Faults."""
    run: Call = case.tree.entries["run"]
    try:
        yield
    except ValueError as error:
        fault = run.fault(str(error))
        raise fault if fault.path != run.path else error from error


def read(path: str | File, changes: Iterable[str] = (), parts: tuple[File, ...] = ()) -> tuple[Case, Source]:
    """Return a case from a file, with changes of the form path=value, and where its entries stand.

    parts: files of Python that describe parts which the case uses; their code runs.
    """
    source = read_source(path, changes)
    case = Case(source.data, source.folder, parts)
    try:
        _ = case.tree
    except Fault as fault:
        raise source.error(fault) from None
    return case, source


def load(files: Iterable[File]) -> None:
    """Run files of Python, which describe parts; a ValueError for one that cannot be read or that describes none."""
    for file in files:
        place = str(file.absolute())
        try:
            content = file.read_bytes()
        except OSError as error:
            raise ValueError(f"--with {file}: cannot be read ({error.strerror})") from None
        if _LOADED.get(place) == content:
            continue
        # Without dots it is no package: pickles, and kernels that are kept in files, find their classes by this name.
        name = place.replace(".", "_")
        module = module_from_spec(ModuleSpec(name, SourceFileLoader(name, place), origin=place))
        module.__file__ = place
        # Annotations that are texts are looked up there.
        sys.modules[name] = module
        try:
            exec(compile(content, place, "exec"), vars(module))
        except SyntaxError as error:
            raise ValueError(f"--with {file}:{error.lineno}: {error.msg}") from None
        if not any(of.target.__module__ == name for of in registered()):
            raise ValueError(f"--with {file}: describes no part; write @hl.described above a class or a function")
        _LOADED[place] = content


def tree_of(data: Mapping[str, Any], folder: File) -> Call:
    """Return the sections of a case, read and checked; nothing is built."""
    for section in SECTIONS_OF_PATHS:
        keys = entry(data, section)
        for key in keys if isinstance(keys, dict) else ():
            path: Path = (key,)
            while isinstance(inner := entry(keys, path), dict) and inner and "from" not in inner:
                path = *path, next(iter(inner))
            if len(path) > 1 and "." not in key:
                raise Fault((*section, key), f'a path belongs in quotes: "{written(path)}" = …')

    context, form = Context(folder), form_of(Sections)
    materials = data.get("materials")
    inner = noted(form.entries["materials"].type.__args__[1])
    for name, table in materials.items() if isinstance(materials, dict) else ():
        if not isinstance(table, dict):
            raise Fault(("materials", name), "must be a table of the properties of a material")
        parameter = Parameter(name, *inner, None, False)
        context.materials[name] = read_value(table, parameter, ("materials", name), context)
    tree = read_value(dict(data), Parameter("", Sections, (), None, False), (), context)
    for name in ("chain", "structure"):
        if isinstance(many := tree.entries[name], list) and len(many) > MOST:
            raise Fault((name,), f"has {len(many)} sections; at most {MOST}")
    context.until = tree.entries["run"].entries["until"]
    return tree  # type: ignore[no-any-return]


def contacts_of(structure: Call) -> int:
    """Return the number of points of a structure that chains face."""
    at = structure.entries.get("at")
    return len(at) if isinstance(at, list) else 1 + (structure.entries.get("base") == "contact")


def _simulation(tree: Call) -> CoSimulation:
    """Return the co-simulation of a case: each structure is built once, and each chain gets its contact points."""
    for material in tree.context.materials.values():
        _ = material.made
    several = isinstance(tree.entries["chain"], list)
    calls: list[Call] = tree.entries["chain"] if several else [tree.entries["chain"]]
    chains = [call.made for call in calls]
    structures = tree.entries["structure"]
    bodies: list[Call] = structures if isinstance(structures, list) else [structures]
    behind: Call | None = tree.entries.get("behind")
    if behind is not None and (several or isinstance(structures, list)):
        raise Fault(("behind",), "belongs to one [chain] on one [structure]; else give the chain behind = {...}")
    run: Call = tree.entries["run"]
    built: dict[Path, Any] = {}
    taken: set[tuple[int, int]] = set()

    def of(body: Call) -> Any:
        if body.path not in built:
            built[body.path] = structure_of(body, run)
        return built[body.path]

    def contact(number: int, point: int, path: Path) -> Any:
        """Return the contact point of a structure that no other chain has; the structure where it has one point."""
        if number >= len(bodies):
            reason = f"{number} is no structure of {len(bodies)}, counted from 0"
            raise Fault((*path, "structure"), reason)
        body, points = bodies[number], contacts_of(bodies[number])
        if point >= points:
            reason = f"{point} is no contact point of {points}, counted from 0; give the structure more"
            raise Fault((*path, "point"), reason)
        if (number, point) in taken and body.target is not nothing:
            raise Fault(path, "is the contact point of another chain; give each its own, as in at = [[...], [...]]")
        taken.add((number, point))
        return of(body) if points == 1 or of(body) is None else ContactPoint(of(body), point)

    def facing(number: int, call: Call) -> Any:
        """Return what the last bead of a chain faces, by default the points of the structures in their order."""
        path, count = (*call.path, "on"), len(calls)
        if seat := call.entries.get("on"):
            return contact(seat.made.structure, seat.made.point, path)
        if len(bodies) not in (1, count):
            hint = (
                f"is missing; there are {count_of(len(bodies), 'structure')}, so give one, such as {{ structure = 0 }}"
            )
            raise Fault(path, hint)
        index = number if len(bodies) == count else 0
        points = contacts_of(bodies[index])
        if points > 1 and (len(bodies) > 1 or count != points):
            hint = f"is missing; the structure has {points} contact points, so give one, such as {{ point = 0 }}"
            raise Fault(path, hint)
        return contact(index, number if len(bodies) == 1 and count > 1 else 0, path)

    def at_struck_end(call: Call) -> Any:
        path = (*call.path, "behind")
        if seat := call.entries.get("behind"):
            if behind is not None:
                raise Fault(path, "is given by the section [behind] as well; leave out one")
            return contact(seat.made.structure, seat.made.point, path)
        return None if behind is None else of(behind)

    faced = [facing(number, call) for number, call in enumerate(calls)]
    behinds = [at_struck_end(call) for call in calls]
    settings = run.made
    try:
        if several:
            return CoSimulation(chains, faced, behind=behinds, **settings)
        return CoSimulation(chains[0], faced[0], behind=behinds[0], **settings)
    except ValueError as error:
        # What names no section is about the chain.
        head = str(error).partition(": ")[0].partition(" = ")[0]
        fault = run.fault(str(error)) if head in run.form.entries else calls[0].fault(str(error))
        raise (tree.fault(str(error)) if head in ("structure", "behind") else fault) from error


def structure_of(body: Call, run: Call) -> Any:
    """Return a structure, damped, and reduced where it is large; the last ones are kept."""
    files = [
        value
        for name, value in body.entries.items()
        if any(isinstance(n, InFile) for n in body.form.entries[name].notes)
    ]
    changed_at = [File(file).stat().st_mtime_ns for file in files]
    # Two equal structures of one case are two bodies.
    wanted = body.entries.get("reduce", run.entries.get("reduce"))
    key = "\n".join(map(repr, (body.path, body, body.context.until, wanted, fineness(), changed_at)))
    if not are_meshed():
        return _structure(body, run)
    if key not in _STRUCTURES:
        _STRUCTURES[key] = _structure(body, run)
        while len(_STRUCTURES) > STORED:
            _STRUCTURES.popitem(last=False)
    _STRUCTURES.move_to_end(key)
    return _STRUCTURES[key]


def _structure(body: Call, run: Call) -> Any:
    """Return a structure; losses in layers and of Rayleigh act on its matrices, others on the reduced structure."""
    structure: Structure | None = body.made
    if structure is None:
        return None
    losses: list[Call] = body.entries.get("damping", [])
    early = [loss for loss in losses if issubclass(loss.form.makes, Rayleigh) or "layer" in loss.entries]
    for loss in early:
        structure = _damped(structure, loss)
    structure = _reduced(structure, body if "reduce" in body.entries else run)
    for loss in losses:
        if loss not in early:
            structure = _damped(structure, loss)
    return structure


def _damped(structure: Structure, loss: Call) -> Structure:
    with loss.located():
        return damped(structure, loss.made, loss.entries.get("layer"))


def _reduced(structure: Structure, table: Call) -> Structure:
    """Return the structure as the entry `reduce` of a table wants it; by default small ones stay as they are."""
    wanted = table.entries.get("reduce", True)
    if wanted is False or not structure.size:
        return structure
    if not isinstance(wanted, Call):
        if structure.valid_until < float("inf") or MovingStructure(structure).compact:
            return structure
        with table.located():
            return reduce(structure, until=table.context.until)
    with wanted.located():
        return reduce(structure, **wanted.made)
