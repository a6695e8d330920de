"""The section [sensitivities] of a case: what the uncertainties of its entries do to AR and TOF."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from math import isnan

from coupling.cosimulation import CoSimulation
from coupling.inference.uncertainty import Uncertainty, propagated
from hertzlink.cases.axes import named_property, path_of, si_value, unit_at
from hertzlink.cases.case import Case, of_run
from hertzlink.cases.entry_paths import Path, entry, has
from hertzlink.cases.faults import Fault
from hertzlink.cases.units import shown
from structures.caution import caution, collected
from structures.units import NUMBER, PARTS, factor, spread_of

SECTION = "sensitivities"


@dataclass(frozen=True)
class Budget:
    """Entries of a case, each by its path as the user writes it: values with standard uncertainties, and SI units."""

    case: Case
    paths: dict[str, Path]
    inputs: dict[str, tuple[float, float]]
    units: dict[str, str]

    def __call__(self, **values: float) -> CoSimulation:
        """Return the co-simulation with other values."""
        changed = self.case.changed({self.paths[key]: float(value) for key, value in values.items()})
        return changed.simulation()

    def of_sensor(self, sensor: int, findings: Collection[str] = ()) -> Uncertainty:
        """Return the budget of AR and TOF at a sensor, without the findings that the run has already."""
        with of_run(), collected() as said:
            try:
                budget = propagated(self, self.case.until, sensor, self.inputs)
            except ValueError as error:
                key, _, reason = str(error).partition(": ")
                if key in self.paths:
                    raise Fault((SECTION, key), reason) from error
                raise
        for message in said:
            if message not in findings:
                caution(message)
        return replace(budget, warnings=[warning for warning in budget.warnings if warning not in findings])


def budget_of(case: Case) -> Budget | None:
    """Return what the section [sensitivities] asks for, if a case has it; a Fault for what does not fit."""
    entries = case.model.sensitivities
    if entries is None:
        return None
    case.model.only_chain("an uncertainty budget")
    if case.model.sweep:
        raise Fault((SECTION,), "is that of one run; leave out [sweep], or this section")
    budget = Budget(case, {}, {}, {})
    for key, text in entries.items():
        place = (SECTION, key)
        path = path_of(key, place)
        stated = entry(case.data, path) if has(case.data, path) else named_property(case, path)
        if stated is None:
            raise _unstated(case, path, place)
        value = si_value(case, path, stated, place)
        if not isinstance(value, float) or value == 0.0:
            raise Fault(place, f"{shown(value)} must be a number other than zero, and no count")
        budget.paths[key], budget.units[key] = path, unit_at(case, path, value, ())[2]
        budget.inputs[key] = value, _spread(text, value, budget.units[key], place)
    return budget


def _unstated(case: Case, path: Path, place: Path) -> Fault:
    """Return the fault of an entry that the case does not have: it is misspelt, or has no value."""
    try:
        si_value(case, path, 1.0, place)
    except Fault as fault:
        if "no entry" in fault.reason:
            return fault
    return Fault(place, "is not written in the case; give its value there first")


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
