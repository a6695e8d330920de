"""The section [sensitivities] of a case: what the uncertainties of its entries do to AR and TOF."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from inspect import Parameter, Signature
from math import isnan
from typing import Any

from coupling.cosimulation import CoSimulation
from coupling.inference.uncertainty import Uncertainty, uncertainty
from hertzlink.cases.axes import name_of, named_property, path_of, si_value, unit_at
from hertzlink.cases.case import Case, of_run
from hertzlink.cases.entry_paths import Path, entry, has
from hertzlink.cases.faults import Fault
from hertzlink.cases.units import shown
from structures.caution import caution, collected
from structures.units import NUMBER, PARTS, factor, spread_of

SECTION = "sensitivities"


@dataclass(frozen=True)
class Budget:
    """Entries of a case, by name, with their paths, values and standard uncertainties (SI), and with units by path."""

    case: Case
    paths: dict[str, Path]
    values: dict[str, float]
    spreads: dict[str, Any]
    written: dict[str, str]
    """Each path as the user writes it."""
    units: dict[str, str]

    @property
    def __signature__(self) -> Signature:
        """The parameters of a call, whose default values are those of the case."""
        return Signature([Parameter(name, Parameter.KEYWORD_ONLY, default=v) for name, v in self.values.items()])

    def __call__(self, **values: float) -> CoSimulation:
        """Return the co-simulation with other values, reduced."""
        changed = self.case.changed({self.paths[name]: float(value) for name, value in values.items()})
        return changed.simulation().reduced(self.case.until)

    def of_sensor(self, sensor: int, findings: Collection[str] = ()) -> Uncertainty:
        """Return the budget of AR and TOF at a sensor, without the findings that the run has already."""
        with of_run(), collected() as said:
            budget = uncertainty(self, self.case.until, sensor, **self.spreads)
        budget = replace(
            budget,
            inputs={self.written[name]: numbers for name, numbers in budget.inputs.items()},
            shares={self.written[name]: share for name, share in budget.shares.items()},
            units=budget.units | self.units,
            warnings=[warning for warning in budget.warnings if warning not in findings],
        )
        for message in said:
            if message not in findings:
                caution(message)
        return budget


def budget_of(case: Case) -> Budget | None:
    """Return what the section [sensitivities] asks for, if a case has it; a Fault for what does not fit."""
    entries = case.model.sensitivities
    if entries is None:
        return None
    case.model.only_chain("an uncertainty budget")
    if case.model.sweep:
        raise Fault((SECTION,), "is that of one run; leave out [sweep], or this section")
    budget = Budget(case, {}, {}, {}, {}, {})
    for key, text in entries.items():
        place = (SECTION, key)
        path = path_of(key, place)
        stated = entry(case.data, path) if has(case.data, path) else named_property(case, path)
        if stated is None:
            raise Fault(place, "is not written in the case; give its value there first")
        value = si_value(case, path, stated, place)
        if not isinstance(value, float) or value == 0.0:
            raise Fault(place, f"{shown(value)} must be a number other than zero, and no count")
        name = name_of(path, budget.paths)
        budget.paths[name], budget.values[name] = path, value
        budget.written[name], budget.units[key] = key, unit_at(case, path, value, ())[2]
        budget.spreads[name] = _spread(text, value, budget.units[key], place)
    return budget


def _spread(text: float | str, value: float, unit: str, place: Path) -> float:
    """Return a standard uncertainty in SI units; a Fault for a text that means none."""
    match = NUMBER.fullmatch(text) if isinstance(text, str) else None
    if match and match[2] and match[2] not in PARTS:
        try:
            factor(match[2], unit)
        except ValueError as error:
            raise Fault(place, f"{shown(text)}: {error}; the entry is in {unit or 'no unit'}") from None
    spread = spread_of(str(text), value)
    if isnan(spread):
        raise Fault(place, f'{shown(text)} must be a standard uncertainty, such as "0.02 mm" or "2 %"')
    return spread
