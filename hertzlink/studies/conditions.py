"""Parameters that can be changed in a study, with the thesis's values as defaults.

A study declares them once, as fields of a subclass of Conditions; the command line makes its options from these. The
annotation of a field holds its quantity and what it is: `Annotated[float, BEAD, "Diameter of the beads"]`.
"""

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from decimal import Decimal
from functools import cache
from typing import Any, ClassVar, Self, get_origin, get_type_hints

import xarray as xr

import hertzlink as hl
from coupling.results.provenance import stored
from structures.checks import did_you_mean, nearest, short
from structures.described import noted
from structures.quantities import Likely
from structures.units import NUMBER, factor, handy

BEAD = replace(Likely.BEAD, low=1e-4, high=0.5)
SPEED = replace(Likely.SPEED, low=1e-3, high=20.0)
HEIGHT = replace(Likely.HEIGHT, low=1e-6, high=20.0)
THICKNESS = replace(Likely.THICKNESS, low=1e-5, high=0.1)
LENGTH = replace(Likely.SIDE, low=1e-4, high=10.0)
# The quantities of studies, in the ranges for which records and meshes stay within reason.
FORCE = hl.quantities.Quantity("N", "a force", "2 N", 1e-6, 1e6)
OWN = "own_parameters"  # The attribute of results that holds, as JSON, the parameters which differ from the thesis's.
DIFFERS = "differs_from_thesis"  # The attribute that says the same in words.
MOST_COLOURED = 6  # Figures have as many colours.
LISTED = 5  # Most values that are printed one by one.


class WrongValue(ValueError):
    """A parameter of a study that cannot be used: its name, value, and what would be right."""

    def __init__(self, name: str, value: object, cure: str) -> None:
        super().__init__(f"{name} = {short(value)}: {cure}")
        self.name, self.value, self.cure = name, value, cure

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.name, self.value, self.cure)


@dataclass(frozen=True)
class Option:
    """An option: how a parameter is read, and what it changes. kind: None for a material."""

    says: str
    kind: hl.quantities.Quantity | hl.quantities.Count | hl.quantities.OneOf | None
    several: bool = False

    @classmethod
    def of(cls, hint: Any) -> Self:
        """Return the option of an annotated field."""
        kind, notes = noted(hint)
        *quantity, says = notes
        return cls(says, quantity[0] if quantity else None, get_origin(kind) is tuple)

    @property
    def choices(self) -> tuple[str, ...]:
        """The words that are allowed; none for a number or a material."""
        return self.kind.words if isinstance(self.kind, hl.quantities.OneOf) else ()

    @property
    def unit(self) -> str:
        """The SI unit of a number."""
        return self.kind.unit if isinstance(self.kind, hl.quantities.Quantity) else ""

    def read(self, name: str, value: object) -> Any:
        """Return the value from text or a number, several from a sequence of these; raise a WrongValue for others."""
        if not self.several:
            return self._one(name, value)
        items = list(_items(value))
        if not items:
            raise WrongValue(name, value, "give at least one value")
        values = dict.fromkeys(self._one(name, item) for item in items)
        return tuple(values if self.choices or self.kind is None else sorted(values))

    def shown(self, value: Any) -> str:
        """Return the value as text."""
        if value is None:
            return "none"
        values = value if self.several else (value,)
        if self.choices or self.kind is None:
            return ", ".join(_named(value) if self.kind is None else value for value in values)
        if len(values) > LISTED:
            return _printed((values[0], values[-1]), self.unit, f"{len(values)} values from {{}} to {{}}")
        return _printed(values, self.unit, ", ".join(["{}"] * len(values)))

    def _one(self, name: str, raw: object) -> Any:
        try:
            if self.kind is None:
                return _material(raw)
            if isinstance(self.kind, hl.quantities.OneOf):
                return self.kind.check(name, str(raw).strip().lower())
            value: Any = _number(raw, self.unit) if isinstance(raw, str) else raw
            return self.kind.check(name, value)
        except ValueError as error:
            said = str(error)
            cure = said.partition(": ")[2] if said.startswith(f"{name} = ") else said
            raise WrongValue(name, raw, cure) from None


@dataclass(frozen=True)
class Conditions:
    """The parameters of a study: a subclass has one field for each. Without fields, nothing can be changed.

    coloured: the parameters whose values have a colour, or a panel, each in a figure.
    """

    coloured: ClassVar[tuple[str, ...]] = ()

    def __post_init__(self) -> None:
        for name, option in self.options().items():
            stated = getattr(self, name)
            if stated is not self.thesis(name):
                object.__setattr__(self, name, option.read(name, stated))
        for name in self.coloured:
            if len(getattr(self, name)) > MOST_COLOURED and name in self.differing():
                raise WrongValue(name, getattr(self, name), f"give at most {MOST_COLOURED} values")
        self.check()

    def check(self) -> None:
        """Raise a WrongValue for parameters that do not fit each other."""

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> Self:
        """Return those with some parameters of a user's own; raise a ValueError for a name that does not exist."""
        options = cls.options()
        for name, value in parameters.items():
            if name not in options:
                meant = did_you_mean(name, options, str)
                others = f"there are {', '.join(options)}" if options else "nothing can be changed"
                raise WrongValue(name, value, f"no parameter of this study; {f'{meant} '.lstrip()}{others}")
        return cls(**parameters)

    @classmethod
    def read(cls, data: xr.Dataset) -> Self:
        """Return those with which the results were computed."""
        return cls(**stored(data.attrs.get(OWN)))

    @classmethod
    @cache
    def options(cls) -> dict[str, Option]:
        """Return how each parameter is read."""
        hints = get_type_hints(cls, include_extras=True)
        return {field.name: Option.of(hints[field.name]) for field in fields(cls)}

    @classmethod
    def thesis(cls, name: str) -> Any:
        """Return the thesis's value of a parameter."""
        return cls.__dataclass_fields__[name].default

    def differing(self) -> list[str]:
        """Return the names of the parameters that differ from the thesis's."""
        return [name for name in self.options() if getattr(self, name) != self.thesis(name)]

    @property
    def own(self) -> bool:
        """True if any differs."""
        return bool(self.differing())

    def few(self, name: str, quick: Any) -> Any:
        """Return the values of a parameter, for a quick study `quick` if they are the thesis's."""
        return getattr(self, name) if name in self.differing() else quick

    def remark(self) -> str:
        """Return what differs from the thesis, in words; empty if nothing does."""
        shown = {name: self.options()[name].shown for name in self.differing()}
        parts = [
            f"{name.replace('_', ' ')} {show(getattr(self, name))} (thesis: {show(self.thesis(name))})"
            for name, show in shown.items()
        ]
        return f"own parameters: {'; '.join(parts)}" if parts else ""

    def marked(self, data: xr.Dataset) -> xr.Dataset:
        """Return the results with the parameters that differ in their attributes."""
        if not self.own:
            return data
        values = {name: _plain(getattr(self, name)) for name in self.differing()}
        return data.assign_attrs({OWN: json.dumps(values, ensure_ascii=False), DIFFERS: self.remark()})


def _items(value: object) -> Iterable[object]:
    """Return one value, or several: in a sequence, or with commas in a text."""
    if isinstance(value, str):
        return [part.strip() for part in value.split(",") if part.strip()]
    if isinstance(value, Mapping) or not isinstance(value, Iterable):
        return [value]
    return [item for part in value for item in _items(part)]


def _plain(value: Any) -> Any:
    """Return a value for JSON: a material of the table by its name, another one by its constants."""
    if isinstance(value, tuple):
        return [_plain(item) for item in value]
    if isinstance(value, hl.Material):
        return value.name if value.name in hl.MATERIALS and hl.MATERIALS[value.name] == value else asdict(value)
    return value


def _named(value: hl.Material) -> str:
    modulus = value.youngs_modulus * 1e-9
    return value.name or f"E {modulus:.4g} GPa, ν {value.poisson_ratio:g}, ρ {value.density:g} kg/m³"


def _number(text: str, unit: str) -> float:
    """Return the number that a user typed, in the unit itself, or with one of its kind, as "1 mm"."""
    try:
        return float(text)
    except ValueError:
        what = f"a number of {unit}, as 0.001, 1e-3 or with its unit" if unit else "a number, as 0.001 or 1e-3"
        match = NUMBER.fullmatch(text) if unit else None
    if match is None:
        raise ValueError(f"must be {what}")
    try:
        return float(Decimal(match[1]) * factor(match[2], unit))
    except ValueError as error:
        raise ValueError(f"{error}; must be {what}") from None


def _material(value: object) -> hl.Material:
    """Return a material, from its constants, or that of this name, or the only one of this first word."""
    if isinstance(value, hl.Material):
        return value
    if isinstance(value, Mapping):
        return hl.Material(**value)
    meant = hl.MATERIALS.meant(str(value))
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise ValueError(f"there are {' and '.join(material.name for material in meant)}; give the whole name")
    raise ValueError(f"no such material; {nearest(str(value), list(hl.MATERIALS))}")


def _printed(values: Sequence[float], unit: str = "", words: str = "{}") -> str:
    """Return values with their unit, in the digits that a user would type. words: what stands around the numbers."""
    factor, unit = handy(values, unit)
    return f"{words.format(*(f'{factor * value:.6g}' for value in values))} {unit}".rstrip()
