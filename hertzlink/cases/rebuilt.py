"""The way from the input in a result's attributes back to a case, which runs again to the same bits."""

import ast
import json
import re
from collections.abc import Iterator, Mapping
from itertools import groupby, product
from typing import Any

import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.plan import ACCURACIES
from coupling.results.provenance import as_text, stored, unfolded
from coupling.schemes.scheme import Scheme
from hertzlink.cases.bodies import structure_tables
from hertzlink.cases.case import Case
from hertzlink.cases.chains import CHAIN
from hertzlink.cases.declared import DESCRIBE, Data, data_of, described_by, fields_of, members, refused
from hertzlink.cases.entry_paths import written
from hertzlink.cases.faults import Fault
from hertzlink.cases.parts import World
from particles.bead import Bead
from particles.excitation import Excitation
from structures.checks import short
from structures.damping import Viscous
from structures.reduction import reduce

SAME, SAME_ESTIMATE = 1e-9, 1e-2
"""Relative differences of numbers that the builders compute, and of an estimated error, on another processor."""

ENTRIES = {
    "chain", "structure", "chains", "structures", "contacts", "scheme", "until", "window", "substeps", "save_every",
    "steps", "waveform", "most_steps",
}  # fmt: skip
"""Entries of the input of a run: of one chain on one structure, or of several with their contacts."""

CHANGED = "give the builder what differs; what is changed after it is not rebuilt"
ESTIMATES = re.compile(r"structures?(\[\d+\])?\.reduction\.(error_estimate|shorter_pulses)")


def from_input(given: str | Mapping[str, Any] | xr.Dataset) -> Case:
    """Return the case of a run, from the input in its attributes: it builds and runs the same again.

    One chain or several, of all bodies, losses and laws of hertzlink's, on what its builders of structures return,
    reduced or not. What a case cannot hold, such as a law of your own, is refused, and so is an input that these
    builders do not reproduce.

    Parameters
    ----------
    given : str or mapping or Dataset
        The attribute `input` of a run, or the run itself.

    Returns
    -------
    Case
        `case.run()` gives the same numbers, `case.simulation()` the CoSimulation, `case.until` the length of the record
        (s), and `case.to_toml()` the text of a case file for `hertzlink run`.

    Raises
    ------
    ValueError
        For what is no input of one run, and for what cannot be rebuilt; the message names it.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 10, striker=bead, impact_speed=0.3)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.PTFE)).run(until=4e-4)
    >>> case = hl.from_input(run.attrs["input"])
    >>> print(case.to_toml().splitlines()[2])
    bead = { shape = "sphere", radius = 0.00476, material = "steel 440C" }
    >>> case.run().equals(run)
    True
    """
    data = _plain(given)
    several = {"chains", "structures", "contacts"} <= set(data)
    if not (several or {"chain", "structure"} <= set(data)) or "until" not in data:
        raise ValueError('given: is not the input of a run; take run.attrs["input"]')
    if unknown := sorted(set(data) - ENTRIES):
        raise refused(unknown[0], "an entry that a case does not have", 'take run.attrs["input"] as it is')
    if several:
        sections, reduction = _several(data)
    else:
        structure, reduction = structure_data(data["structure"])
        sections = {"chain": chain_data(data["chain"]), "structure": structure}
    run: Data = {"until": data["until"], "reduce": reduction}
    if (scheme := _scheme(str(data["scheme"]))) != {"kind": "condensed", "tolerance": 1e-11}:
        run["scheme"] = scheme
    if data["waveform"] != "linear":
        run["waveform"] = data["waveform"]
    if "most_steps" in data:
        run["most_steps"] = data["most_steps"]
    return _planned(sections, run, data)


def _several(data: Mapping[str, Any]) -> tuple[Data, Any]:
    """Return the sections of several chains, structures or contacts, and the entry `reduce` of [run]."""
    parts = [structure_data(structure) for structure in data["structures"]]
    reductions = [reduction for (part, reduction) in parts if part["kind"] not in ("nothing", "half_space")]
    alike = all(reduction == reductions[0] for reduction in reductions)
    apart = [{} if alike or part["kind"] == "nothing" else {"reduce": reduction} for part, reduction in parts]
    structures = [{**part, **more} for (part, _), more in zip(parts, apart, strict=True)]
    chains = [chain_data(chain) for chain in data["chains"]]
    for chain, end, structure, point in data["contacts"]:
        chains[chain]["behind" if end else "on"] = {"structure": structure, "point": point}
    sections = {"chain": chains if len(chains) > 1 else chains[0], "structure": structures}
    return sections, reductions[0] if reductions and alike else False


def _plain(inputs: Any) -> Data:
    if isinstance(inputs, xr.Dataset):
        inputs = inputs.attrs.get("input")
    if isinstance(inputs, str):
        try:
            inputs = json.loads(inputs)
        except (ValueError, RecursionError):
            raise ValueError('given: is no JSON; take run.attrs["input"]') from None
    if not isinstance(inputs, Mapping):
        raise ValueError('given: must be the input of a run, run.attrs["input"], or the run')
    return dict(unfolded(inputs))


def chain_data(inputs: Mapping[str, Any]) -> Data:
    """Return the section [chain]."""
    if unknown := sorted(set(inputs) - set(CHAIN.parameters)):
        raise refused(f"chain.{unknown[0]}", "an entry that no chain of a case has", "build the chain in Python")
    if "vibration" not in str(inputs.get("vibrations", "vibration")):
        raise refused("chain.vibrations", "vibrations of your own", "leave them to hl.DeformableChain")
    beads = [data_of(bead, f"chain.beads[{i}]", Bead) for i, bead in enumerate(inputs["beads"])]
    rows = [{**bead, "count": len(list(many))} for bead, many in groupby(beads)]
    if len(rows) == 1:
        count = rows[0].pop("count")
        data: Data = {"beads": count, "bead": rows[0]}
    else:
        data = {"beads": [{name: v for name, v in row.items() if (name, v) != ("count", 1)} for row in rows]}
    striker = inputs["striker"]
    data["striker"] = "none" if striker is None else data_of(striker, "chain.striker", Bead, Excitation)
    if data["striker"] == data.get("bead"):
        data["striker"] = "bead"
    rest = {name: value for name, value in inputs.items() if name not in ("beads", "striker", "vibrations")}
    return data | fields_of(rest, CHAIN, "chain")


def structure_data(inputs: Any) -> tuple[Data, Any]:
    """Return the section [structure], and the entry `reduce` of [run]."""
    if inputs is None:
        return {"kind": "nothing"}, False
    built = {table.of.called: table for table in structure_tables()}
    if not isinstance(inputs, Mapping) or inputs.get("kind") not in built:
        what = inputs.get("kind", "a structure of your own") if isinstance(inputs, Mapping) else inputs
        raise refused("structure", f"{short(what)}, which no builder of structures made", DESCRIBE)
    data: Data = {name: value for name, value in inputs.items() if value is not None}
    if "scaled_from" in data:
        raise refused("structure.scaled_from", "a scaled plate", "build the plate with its own thickness and material")
    reduction = _reduction(data.pop("reduction", None))
    damping = [
        _damping(damping_input, f"structure.damping[{i}]") for i, damping_input in enumerate(data.pop("damping", []))
    ]
    table = built[data["kind"]]
    data = {"kind": table.of.kind, **table.entries(data)}
    return data | ({"damping": damping} if damping else {}), reduction


def _reduction(inputs: Any) -> bool | Data:
    if inputs is None:
        return False
    if "shared" in inputs:
        raise refused("structure.reduction.shared", "a ReducedPlate", "use hl.reduce(plate.at(x, y), until)")
    return fields_of(inputs, described_by(reduce), "structure.reduction")


def _damping(inputs: Mapping[str, Any], path: str) -> Data:
    of = next((entry for entry in members(Viscous) if entry.called == inputs.get("kind")), None)
    if of is None or inputs.get("part"):
        raise refused(path, f"{short(dict(inputs))}, neither of all the structure nor of a layer", "use hl.damped")
    return {"kind": of.kind, **fields_of(inputs, of, path), **({"layer": inputs["layer"]} if "layer" in inputs else {})}


def _scheme(text: str) -> Data:
    """Return a scheme from its repr."""
    name, values = _called(text.rpartition("<locals>.")[2])
    return data_of({"class": name, **values}, "scheme", Scheme)


def _called(text: str) -> tuple[str, Data]:
    """Name and arguments of a repr such as Aitken(tolerance=1e-9)."""
    try:
        call = ast.parse(text, mode="eval").body
        if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name):
            raise ValueError
        return call.func.id, {str(keyword.arg): ast.literal_eval(keyword.value) for keyword in call.keywords}
    except (SyntaxError, ValueError):
        raise refused("scheme", text, DESCRIBE) from None


def _planned(sections: Data, run: Data, data: Mapping[str, Any]) -> Case:
    """Return the case whose runs have the same windows, steps and saved times."""
    wanted = {name: data[name] for name in ("window", "substeps", "save_every", "steps") if name in data}
    choices: list[Data] = [{} if accuracy == "default" else {"accuracy": accuracy} for accuracy in ACCURACIES]
    if isinstance(wanted.get("window"), str):
        choices = [{"adaptive": _called(wanted["window"])[1]}]
    elif "window" in wanted:
        window = {"window": wanted["window"], "substeps": wanted["substeps"]}
        choices += [window if wanted["substeps"] != 1 else {"window": wanted["window"]}]
        # A longest step of all chains, by which the least of their counts follows.
        step = wanted["window"] / wanted["substeps"] / min(wanted["steps"]) if wanted["steps"] else None
        choices += [{**choice, "dt": step} for choice in choices[:1] + choices[-1:] if step]
    simulation = _built(Case({**sections, "run": {**run, **choices[0]}}))
    _compare(data, simulation.describe())
    for choice, saved in product(choices, ({}, {"save_every": wanted.get("save_every")})):
        case = Case({**sections, "run": {**run, **choice, **saved}})
        try:
            candidate = _like(simulation, case)
            plan = candidate.plan(case.until, case.model.run.save_every).describe(candidate.interface, candidate.window)
        except ValueError:
            continue  # these windows do not suit this run
        if all(_same(wanted[name], plan[name]) for name in wanted):
            return case
    raise refused("window", "windows or steps that no entry of [run] gives", "run with a window or an accuracy alone")


def _built(case: Case) -> CoSimulation:
    try:
        return case.simulation()
    except Fault as fault:
        raise refused(written(fault.path), fault.reason, "mend this entry of `given`") from fault


def _like(first: CoSimulation, case: Case) -> CoSimulation:
    """Return the same simulation with other windows; structures are not built again."""
    defaults = {"window": None, "dt": None, "substeps": None}
    return first.replace(**{**defaults, **case.model.run.make(World())})


def _compare(inputs: Mapping[str, Any], rebuilt: Mapping[str, Any]) -> None:
    """Refuse a case that does not describe itself as the run did."""
    rebuilt_inputs = stored(as_text(rebuilt))
    for name in ("chain", "structure", "chains", "structures", "contacts"):
        if (name in inputs) != (name in rebuilt_inputs):
            raise refused(name, "an input of another form", CHANGED)
        if name not in inputs:
            continue
        for path, there, here in _differences(inputs[name], rebuilt_inputs[name], name):
            limit = SAME_ESTIMATE if ESTIMATES.match(path) else SAME
            if not _same(there, here, limit):
                raise refused(path, f"{there!r}, which a case builds as {here!r}", CHANGED)


def _differences(there: Any, here: Any, path: str) -> Iterator[tuple[str, Any, Any]]:
    if isinstance(there, dict) and isinstance(here, dict):
        for name in dict.fromkeys([*there, *here]):
            yield from _differences(there.get(name), here.get(name), f"{path}.{name}")
    elif isinstance(there, list) and isinstance(here, list) and len(there) == len(here):
        for i, (first, second) in enumerate(zip(there, here, strict=True)):
            yield from _differences(first, second, f"{path}[{i}]")
    elif there != here:
        yield path, there, here


def _same(there: Any, here: Any, limit: float = 1e-12) -> bool:
    if isinstance(there, list) and isinstance(here, list):
        return len(there) == len(here) and all(_same(*pair, limit) for pair in zip(there, here, strict=True))
    numbers = isinstance(there, int | float) and isinstance(here, int | float)
    return there == here or (numbers and abs(there - here) <= limit * max(abs(there), abs(here)))
