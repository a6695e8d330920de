"""The parts of a run's input as sections of a case."""

from collections.abc import Mapping
from itertools import groupby
from typing import Any

from hertzlink.cases.bodies import structure_tables
from hertzlink.cases.chains import CHAIN
from hertzlink.cases.declared import DESCRIBE, data_of, described_by, fields_of, members, refused
from particles.bead import Bead
from particles.excitation import Excitation
from structures.checks import short
from structures.damping import Viscous
from structures.described import description
from structures.moving import STEPPERS
from structures.reduction import reduce

Data = dict[str, Any]


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
    data["striker"] = _striker(inputs["striker"])
    if data["striker"] == data.get("bead"):
        data["striker"] = "bead"
    rest = {name: value for name, value in inputs.items() if name not in ("beads", "striker", "vibrations")}
    return data | fields_of(rest, CHAIN, "chain")


def _striker(inputs: Any) -> Any:
    return "none" if inputs is None else data_of(inputs, "chain.striker", Bead, Excitation)


def structure_data(inputs: Any) -> tuple[Data, bool | Data]:
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
    stepper = _stepper(data.pop("stepper", None))
    reduction = _reduction(data.pop("reduction", None))
    damping = [
        _damping(damping_input, f"structure.damping[{i}]") for i, damping_input in enumerate(data.pop("damping", []))
    ]
    table = built[data["kind"]]
    data = {"kind": table.of.kind, **table.entries(data)}
    return data | stepper | ({"damping": damping} if damping else {}), reduction


def _stepper(inputs: Any) -> Data:
    """Return the entry `stepper`; none for the usual one."""
    if inputs is None:
        return {}
    stepper = {"name": inputs} if isinstance(inputs, str) else inputs
    of = None if not isinstance(stepper, Mapping) else description(STEPPERS.get(str(stepper.get("name"))))
    if of is None:
        raise refused("structure.stepper", "a stepper of your own", f"use one of {', '.join(STEPPERS)}")
    return {"stepper": {"kind": of.kind, **fields_of(stepper, of, "structure.stepper")}}


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
