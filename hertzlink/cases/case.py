"""A case as an object: data that build a co-simulation, and that are written as TOML."""

import sys
from collections.abc import Iterable, Mapping
from contextlib import AbstractContextManager
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from math import inf
from pathlib import Path as File
from types import ModuleType
from typing import Any

import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.interface import ContactPoint
from coupling.results.missing_waves import UNTIL
from hertzlink.cases import Fault, Path, Source, as_toml, parsed, put, read_source
from hertzlink.cases.forms import OF_MATERIAL, allowed, form_of
from hertzlink.cases.parts import InLayer, Measure, Sections
from hertzlink.cases.reader import Call, Context
from hertzlink.cases.reader import read as read_value
from plates.plate import Plate, are_meshed
from structures.damping import Rayleigh, damped
from structures.described import Parameter, registered
from structures.fineness import fineness
from structures.material import Material
from structures.moving import MovingStructure
from structures.quantities import InFile, Quantity
from structures.reduction import reduce

YIELDING = 'law = { kind = "jackson_green" } for the chain'  # what a case needs for contacts that yield

# The last structures, by the text of all that determines them: runs of a sweep often differ in the chain alone.
STORED = 8
_BUILT: dict[str, Any] = {}

# Files of --with that were run, by path: an unchanged file runs once in each process.
_LOADED: dict[str, bytes] = {}


@dataclass(frozen=True)
class Case:
    """One case: the data of its TOML file, the Python files of its parts, and the objects that they build."""

    data: dict[str, Any]
    parts: tuple[File, ...] = ()

    def __reduce__(self) -> tuple[Any, ...]:
        # Another process, perhaps in another folder, reads the case again: no module holds the described parts.
        return Case, (self.data, tuple(file.absolute() for file in self.parts))

    @cached_property
    def tree(self) -> Call:
        """The checked sections; a wrong entry raises a Fault."""
        load(self.parts)
        # Materials first: other sections name them.
        data = {name: self.data[name] for name in ("materials",) if name in self.data} | self.data
        context = Context()
        tree: Call = read_value(data, Parameter("", Sections, (), None, False), (), context)
        context.until = tree.entries["run"].entries["until"]
        return tree

    @property
    def until(self) -> float:
        """Length of the record, s."""
        return float(self.tree.context.until)

    @property
    def title(self) -> str:
        """The text above the table; empty where there is none."""
        return str(self.tree.entries.get("title", ""))

    @property
    def measure(self) -> Measure:
        """The measures that are read from runs."""
        return self.tree.entries["measure"].made if "measure" in self.tree.entries else Measure()

    @property
    def identify(self) -> Any:
        """The question to a measured signal; None without a section [identify]."""
        return self.tree.entries["identify"].made if "identify" in self.tree.entries else None

    def all(self, section: str) -> list[Call]:
        """Return all sections of a name: chain or structure."""
        entries = self.tree.entries[section]
        return entries if isinstance(entries, list) else [entries]

    def only_chain(self, what: str) -> None:
        """Raise a Fault if there are several chains, because `what` takes one."""
        if isinstance(many := self.tree.entries["chain"], list):
            raise Fault(("chain",), f"has {len(many)} sections; {what} takes one, [chain]")

    def value(self, path: Path) -> Any:
        """Return the checked value (SI) at a path, or a property of a named material; None where there is none."""
        return self.look(path)[0]

    def look(self, path: Path) -> tuple[Any, Quantity | None]:
        """Return the value at a path, and the quantity that it is."""
        at: Any = self.tree
        parameter: Parameter | None = None
        for part in path:
            if isinstance(at, OF_MATERIAL):
                at, parameter = getattr(at, str(part), None), form_of(Material).entries.get(str(part))
            elif isinstance(at, Call):
                # A material takes the properties that it does not state from the material that it is like.
                inherits = at.form.target in OF_MATERIAL and part not in at.entries
                parameter = at.form.entries.get(str(part))
                at = getattr(at.made, str(part), None) if inherits else at.entries.get(str(part))
            elif isinstance(at, list | tuple):
                at = at[part] if isinstance(part, int) and part < len(at) else None
                parameter = next((row.item for row in allowed(parameter).rows), parameter) if parameter else None
            else:
                at = at.get(part) if isinstance(at, Mapping) else None
        return at, parameter.quantity if parameter else None

    def changed(self, changes: Mapping[Any, Any]) -> "Case":
        """Return the same case with other values, by their paths as text or parts: {"structure.thickness": "1 mm"}."""
        data = deepcopy(self.data)
        for name, value in changes.items():
            put(data, parsed(name) if isinstance(name, str) else name, deepcopy(value))
        return replace(self, data=data)

    def to_toml(self) -> str:
        """Return the text of a case file, whose first lines name the user's files of parts."""
        load(self.parts)
        sums = [(file.name, sha256(_LOADED[str(file.absolute())]).hexdigest()) for file in self.parts]
        return "".join(f"# --with {name}, SHA-256 {sum_}\n" for name, sum_ in sums) + as_toml(self.data)

    def located(self, section: str = "run") -> AbstractContextManager[None]:
        """Turn errors whose messages name an entry of a section into Faults of this entry."""
        call: Call = self.tree.entries[section]
        return call.located(others=False)

    def run(self, simulation: CoSimulation | None = None) -> xr.Dataset:
        """Run the case without its sweep. simulation: its co-simulation, if it has been built."""
        simulation = simulation or self.simulation()
        with self.located():
            return simulation.run(self.until, self.tree.entries["run"].entries.get("save_every"))

    def simulation(self) -> CoSimulation:
        """Return the co-simulation; raise a ValueError that names the entry which is refused."""
        new = replace(self)  # tables keep the objects that they made, and the fineness of meshes may have changed
        for material in new.tree.context.materials.values():
            _ = material.made
        calls, bodies, run = new.all("chain"), new.all("structure"), new.tree.entries["run"]
        chains = [call.made for call in calls]
        built = [structure_of(body, run) for body in bodies]
        points = [(number, point) for number, body in enumerate(bodies) for point in range(points_of(body))]
        taken = set[tuple[int, int]]()

        def seat(number: int, end: str) -> Any:
            """Return what an end of a chain touches: a contact point, or a structure with a single one."""
            stated = calls[number].entries.get(end)
            if stated is None and end == "behind":
                return None
            at, fault = None, ""
            if stated is not None:
                at = stated.made.structure, stated.made.point
            elif len(points) == len(calls):  # in their order
                at = points[number]
            if at is None or at not in points:
                what = f"there is no contact point {at[1]} of structure {at[0]}" if at else "is missing"
                every = ", ".join(f"{{ structure = {body}, point = {point} }}" for body, point in points)
                if len(points) < len(calls) and any("at" in body.entries for body in bodies):
                    every += "; a plate takes a point for each chain, as in at = [[...], [...]]"
                fault = f"{what}; take one of {every}"
            elif at in taken and built[at[0]] is not None:
                fault = "is the contact point of another chain; give each its own, as in at = [[...], [...]]"
            if at is None or fault:
                raise Fault((*calls[number].path, end), fault)
            taken.add(at)
            return ContactPoint(built[at[0]], at[1]) if points_of(bodies[at[0]]) > 1 else built[at[0]]

        on, behind = ([seat(number, end) for number in range(len(calls))] for end in ("on", "behind"))
        settings = run.made
        try:
            if isinstance(new.tree.entries["chain"], list):
                return CoSimulation(chains, on, behind=behind, **settings)
            return CoSimulation(chains[0], on[0], behind=behind[0], **settings)
        except ValueError as error:
            name = str(error).partition(": ")[0].partition(" = ")[0]
            # A message that names no section is about the chain.
            table = run if name in run.form.entries else new.tree if name == "structure" else calls[0]
            raise table.fault(str(error)) from error


def points_of(structure: Call) -> int:
    """Return the number of points of a structure that chains touch."""
    at = structure.entries.get("at")
    return len(at) if isinstance(at, list) else 1 + (structure.entries.get("base") == "contact")


def structure_of(body: Call, run: Call) -> Any:
    """Return a structure with its damping, reduced if it is large. The last structures are kept."""
    noted = [name for name, one in body.form.entries.items() if any(isinstance(note, InFile) for note in one.notes)]
    times = [File(body.entries[name]).stat().st_mtime_ns for name in noted if name in body.entries]
    # Two equal structures of one case are two bodies.
    key = repr((body.path, body, body.context.until, run.entries.get("reduce"), fineness(), times))
    if are_meshed() and key in _BUILT:
        return _BUILT[key]

    structure = body.made
    if isinstance(structure, Plate):
        at = body.entries["at"]
        x, y = zip(*at, strict=True) if isinstance(at, list) else at
        with body.located():
            structure = structure.at(x, y, body.entries.get("face", "front"))
    # Losses in layers and Rayleigh damping act on the matrices, other losses on the reduced structure.
    losses: list[Call] = body.entries.get("damping", [])
    early = [loss for loss in losses if isinstance(loss.made, Rayleigh | InLayer)]
    for loss in early:
        with loss.located():
            structure = damped(structure, *(loss.made if isinstance(loss.made, InLayer) else [loss.made]))
    wanted = run.entries.get("reduce", True)
    if structure is not None and structure.size and wanted is not False:
        with run.located():
            if isinstance(wanted, Call):
                structure = reduce(structure, **wanted.made)
            elif structure.valid_until == inf and not MovingStructure(structure).compact:
                structure = reduce(structure, until=body.context.until)
    for loss in losses:
        if loss not in early:
            with loss.located():
                structure = damped(structure, loss.made)
    if are_meshed():
        _BUILT[key] = structure
        if len(_BUILT) > STORED:
            del _BUILT[next(iter(_BUILT))]
    return structure


def read(path: str | File, changes: Iterable[str] = (), parts: tuple[File, ...] = ()) -> tuple[Case, Source]:
    """Return a case from a file, with changes of the form path=value, and the Source that knows its lines."""
    source = read_source(path, changes)
    case = Case(source.data, parts)
    try:
        _ = case.tree
    except Fault as fault:
        raise source.error(fault) from None
    return case, source


def load(files: Iterable[File]) -> None:
    """Run Python files that describe parts; raise a ValueError for one that cannot be read or describes none."""
    for file in files:
        place = str(file.absolute())
        try:
            content = file.read_bytes()
        except OSError as error:
            raise ValueError(f"--with {file}: cannot be read ({error.strerror})") from None
        if _LOADED.get(place) == content:
            continue
        # A name without dots is not a package. Pickles and cached kernels find their classes by this name.
        name = place.replace(".", "_")
        module = sys.modules[name] = ModuleType(name)  # annotations that are texts are looked up there
        module.__file__ = place
        try:
            exec(compile(content, place, "exec"), vars(module))
        except SyntaxError as error:
            raise ValueError(f"--with {file}:{error.lineno}: {error.msg}") from None
        if not any(of.target.__module__ == name for of in registered()):
            raise ValueError(f"--with {file}: describes no part; write @hl.described above a class or a function")
        _LOADED[place] = content


def of_case(finding: str) -> str:
    """Return a finding of a run, with times and laws as a case writes them."""
    return UNTIL.sub(r'until = "\1"', finding).replace("law=hl.laws.JacksonGreen() in Chain", YIELDING)
