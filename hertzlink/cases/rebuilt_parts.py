"""The parts of a run's input as sections of a case."""

from collections.abc import Mapping
from itertools import groupby
from typing import Any

from hertzlink.cases.bodies import structure_tables
from hertzlink.cases.chains import CHAIN
from hertzlink.cases.declared import data_of, described_by, fields_of, members, refused
from particles.bead import Bead
from particles.excitation import Excitation
from structures.checks import short
from structures.damping import Viscous
from structures.described import description
from structures.moving import STEPPERS
from structures.reduction import reduce

Data = dict[str, Any]


def chain_data(given: Mapping[str, Any]) -> Data:
    """Return the section [chain]."""
    if unknown := sorted(set(given) - set(CHAIN.parameters)):
        raise refused(f"chain.{unknown[0]}", "an entry that no chain of a case has")
    if "vibration" not in str(given.get("vibrations", "vibration")):
        raise refused("chain.vibrations", "vibrations of your own")
    beads = [data_of(one, f"chain.beads[{i}]", Bead) for i, one in enumerate(given["beads"])]
    rows = [{**one, "count": len(list(many))} for one, many in groupby(beads)]
    if len(rows) == 1:
        count = rows[0].pop("count")
        data: Data = {"beads": count, "bead": rows[0]}
    else:
        data = {"beads": [{name: v for name, v in one.items() if (name, v) != ("count", 1)} for one in rows]}
    data["striker"] = _striker(given["striker"])
    if data["striker"] == data.get("bead"):
        data["striker"] = "bead"
    rest = {name: value for name, value in given.items() if name not in ("beads", "striker", "vibrations")}
    return data | fields_of(rest, CHAIN, "chain")


def _striker(given: Any) -> Any:
    return "none" if given is None else data_of(given, "chain.striker", Bead, Excitation)


def structure_data(given: Any) -> tuple[Data, bool | Data]:
    """Return the section [structure], and the entry `reduce` of [run]."""
    if given is None:
        return {"kind": "nothing"}, False
    built = {table.of.called: table for table in structure_tables()}
    if not isinstance(given, Mapping) or given.get("kind") not in built:
        what = given.get("kind", "a structure of your own") if isinstance(given, Mapping) else given
        raise refused(
            "structure", f"{short(what)}, which no builder of structures made; --with FILE.py brings one of your own"
        )
    data: Data = {name: value for name, value in given.items() if value is not None}
    if "scaled_from" in data:
        raise refused("structure.scaled_from", "a scaled plate; build the plate with its own thickness and material")
    stepper = _stepper(data.pop("stepper", None))
    reduction = _reduction(data.pop("reduction", None))
    damping = [_damping(one, f"structure.damping[{i}]") for i, one in enumerate(data.pop("damping", []))]
    table = built[data["kind"]]
    data = {"kind": table.of.kind, **table.entries(data)}
    return data | stepper | ({"damping": damping} if damping else {}), reduction


def _stepper(given: Any) -> Data:
    """Return the entry `stepper`; none for the usual one."""
    if given is None:
        return {}
    own = {"name": given} if isinstance(given, str) else given
    of = None if not isinstance(own, Mapping) else description(STEPPERS.get(str(own.get("name"))))
    if of is None:
        raise refused("structure.stepper", "a stepper of your own")
    return {"stepper": {"kind": of.kind, **fields_of(own, of, "structure.stepper")}}


def _reduction(given: Any) -> bool | Data:
    if given is None:
        return False
    if "shared" in given:
        raise refused("structure.reduction.shared", "a ReducedPlate")
    return fields_of(given, described_by(reduce), "structure.reduction")


def _damping(given: Mapping[str, Any], path: str) -> Data:
    of = next((one for one in members(Viscous) if one.called == given.get("kind")), None)
    if of is None or given.get("part"):
        raise refused(path, f"{short(dict(given))}, which is neither of the whole structure nor of a layer")
    return {"kind": of.kind, **fields_of(given, of, path), **({"layer": given["layer"]} if "layer" in given else {})}
