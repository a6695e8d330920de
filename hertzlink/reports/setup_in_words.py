"""The input of a run as a table: what a user gave, in words and with units."""

from collections.abc import Iterator, Mapping
from math import pi
from typing import Any

from coupling.cosimulation import CoSimulation
from coupling.plots.canvas import in_words
from hertzlink import _described as _described  # for what they describe
from hertzlink.reports.page import Table, table
from structures.described import description, registered
from structures.reduction import reduce
from structures.units import handy

UNITS = {"impedance": "N s/m", "region": "m"}
"""Units of numbers that are no parameter of what is described."""

LEFT_OUT = ("beads", "section", "steps", "shorter_pulses")
"""What the table does not show; the full input is below it."""

MOST_ITEMS = 12
"""Lists of more items are given by their number."""


def input_tables(inputs: Mapping[str, Any], of: str = "") -> list[Table]:
    """Return the tables of the chains, the structures and the rest. of: whose they are, where a result has several
    runs."""
    rest = {name: value for name, value in inputs.items() if name not in ("chain", "chains", "structure", "structures")}
    groups: list[tuple[str, Any]] = []
    for single, many in (("chain", "chains"), ("structure", "structures")):
        if single in inputs:
            groups.append((single.capitalize(), inputs[single]))
        groups += [(f"{single.capitalize()} {i}", part) for i, part in enumerate(inputs.get(many, []))]
    groups = [(title, list(rows_of(part))) for title, part in [*groups, ("Run", rest)] if part is not None]
    return [table(title + of, ("argument", "value"), rows, folded=True) for title, rows in groups if rows]


def rows_of(part: Any) -> Iterator[tuple[str, str]]:
    """Yield the names and values of a chain, a structure or a law."""
    if not isinstance(part, Mapping):
        yield "kind", str(part)
        return
    if beads := part.get("beads"):
        yield "beads", ", ".join(counted([_in_words(bead) for bead in beads]))
    for name, value in part.items():
        if name in LEFT_OUT or value is None or value == []:
            continue
        if name == "vibrations" and str(value).startswith("<function vibration"):
            continue  # those of every chain whose beads deform
        if name == "layers":
            for i, layer in enumerate(value, start=1):
                yield f"layer {i}", _in_words(layer)
        elif name == "material" and isinstance(value, Mapping) and "plies" in value:
            for i, ply in enumerate(value["plies"], start=1):
                yield f"ply {i}", _in_words(ply)
        else:
            yield in_words(name), _value(name, value, _units(part))


def _units(given: Mapping[str, Any]) -> dict[str, str]:
    """Return units by the names of arguments: those of what is described, by its class, or by its kind as a structure.

    Of a part whose class is not noted, such as a chain, the units on which all parameters of a name agree.
    """
    every = [*registered(), *filter(None, map(description, (CoSimulation.__init__, CoSimulation.run, reduce)))]
    all_units = [pair for one in every for pair in one.units.items()]
    units = UNITS | dict(all_units)
    units |= {name: "" for name, unit in all_units if units[name] != unit}
    names = given.get("class"), given.get("kind")
    of = next((one for one in every if one.name == names[0] or one.called == names[1]), None)
    # Of additions and plies only the arguments are noted.
    of = of or next((one for one in every if one.parameters.keys() == given.keys()), None)
    return units if of is None else units | of.units


def counted(texts: list[str]) -> list[str]:
    """Return equal texts once, with their number."""
    return [f"{texts.count(text)} × {text}" if texts.count(text) > 1 else text for text in dict.fromkeys(texts)]


def _value(name: str, value: Any, units: Mapping[str, str]) -> str:
    if isinstance(value, bool) or value is None:
        return str(value)
    unit = "" if isinstance(value, int) else units.get(name, "")  # checks make floats of all but counts
    if isinstance(value, int | float):
        return _numbers(unit, [value])
    if isinstance(value, Mapping):
        return _in_words(value)
    if isinstance(value, list):
        if len(value) > MOST_ITEMS:
            return f"{len(value)} values"
        if value and all(isinstance(number, int | float) and not isinstance(number, bool) for number in value):
            return _numbers(unit, value)
        return ", ".join(_value(name, item, units) for item in value)
    return str(value)


def _numbers(unit: str, values: list[float]) -> str:
    """Return the numbers in one handy unit; angles in degrees."""
    factor, unit = (180.0 / pi, "°") if unit == "rad" else handy(values, unit)
    return " ".join(filter(None, (", ".join(f"{factor * number:.6g}" for number in values), unit)))


def _in_words(part: Any) -> str:
    """Return a bead, a layer, a material or a law on one line."""
    if not isinstance(part, Mapping):
        return str(part)
    if "youngs_modulus" in part:
        return _material(part)
    if part.get("name") and "youngs_modulus_along" in part:
        moduli = (_numbers("Pa", [part[f"youngs_modulus_{direction}"]]) for direction in ("along", "across"))
        return f"{part['name']} (E {' along, '.join(moduli)} across)"
    stated = {name: value for name, value in part.items() if value is not None and name not in ("class", *LEFT_OUT)}
    units = _units(part)
    parts = "; ".join(f"{name.replace('_', ' ')} {_value(name, value, units)}" for name, value in stated.items())
    return ": ".join(filter(None, (str(part.get("class", "")), parts))) or "nothing"


def _material(data: Mapping[str, Any]) -> str:
    modulus, ratio, density = (data.get(name) for name in ("youngs_modulus", "poisson_ratio", "density"))
    constants = f"E {1e-9 * float(modulus or 0.0):.4g} GPa, ν {ratio}, ρ {density:.6g} kg/m³"
    return f"{data['name']} ({constants})" if data.get("name") else constants
