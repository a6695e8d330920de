"""What can be changed in a study: parameters with the thesis's values as defaults.

A study declares them once, as fields of a subclass of Conditions; the command line makes its options from these.
"""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, fields
from decimal import Decimal
from math import inf, isfinite
from typing import Any, Self

import xarray as xr

from coupling.results.provenance import stored
from hertzlink._hints import nearest
from structures.checks import did_you_mean, short
from structures.material import MATERIALS, Material

OWN = "own_parameters"
"""The attribute of results that holds, as JSON, the parameters which differ from the thesis's."""

DIFFERS = "differs_from_thesis"
"""The attribute that says the same in words."""

LISTED = 5
"""Most values that are printed one by one."""


READABLE = {"m": ("mm", 1e3), "s": ("ms", 1e3), "Pa": ("GPa", 1e-9)}
"""The units in which values are printed, and how many make one of the SI unit."""

WITH_UNIT = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d{1,3})?)\s*([A-Za-zµμ°].*?)\s*")
"""A number and a unit."""


class WrongValue(ValueError):
    """A parameter of a study that cannot be used: its name, value, and what would be right."""

    def __init__(self, name: str, value: object, cure: str) -> None:
        super().__init__(f"{name} = {short(value)}: {cure}")
        self.name, self.value, self.cure = name, value, cure

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.name, self.value, self.cure)


@dataclass(frozen=True)
class Option:
    """How one parameter is read, and what it changes.

    choices: the words that are allowed; empty for a number or a material. zero: whether 0 is allowed as the least
    number. whole: whether numbers are counts.
    """

    says: str
    unit: str = ""
    several: bool = False
    low: float = 0.0
    zero: bool = False
    high: float = inf
    whole: bool = False
    choices: tuple[str, ...] = ()
    of_material: bool = False

    def read(self, name: str, given: object) -> Any:
        """The value from text, a number, or for several values a sequence of these; a WrongValue if it is not right."""
        if not self.several:
            return self._one(name, given)
        items = list(_items(given))
        if not items:
            raise WrongValue(name, given, "give at least one value")
        values = dict.fromkeys(self._one(name, item) for item in items)
        return tuple(values if self.choices or self.of_material else sorted(values))

    def shown(self, value: Any) -> str:
        """The value as text."""
        if value is None:
            return "none"
        values = value if self.several else (value,)
        if self.choices or self.of_material:
            return ", ".join(_named(one) if self.of_material else one for one in values)
        if len(values) > LISTED:
            return _printed((values[0], values[-1]), self.unit, f"{len(values)} values from {{}} to {{}}")
        return _printed(values, self.unit, ", ".join(["{}"] * len(values)))

    def _one(self, name: str, given: object) -> Any:
        if self.of_material:
            return self._material(name, given)
        if self.choices:
            return self._choice(name, given)
        try:
            number = _quantity(given, self.unit) if isinstance(given, str) else float(given)  # type: ignore[arg-type]
        except ValueError as error:
            raise WrongValue(name, given, str(error)) from None
        except TypeError:
            raise WrongValue(name, given, f"must be a number{self._unit()}") from None
        if (
            not isfinite(number)
            or not self.low <= number <= self.high
            or (number == 0.0 and not self.zero and self.low == 0.0)
        ):
            raise WrongValue(name, given, f"must be {self._range()}")
        if self.whole and number != int(number):
            raise WrongValue(name, given, "must be a whole number")
        return int(number) if self.whole else number

    def _unit(self) -> str:
        return f" of {self.unit}" if self.unit else ""

    def _range(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        if self.high == inf:
            return f"{self.low:g}{unit} or more" if self.low else f"a positive number{self._unit()}"
        from_ = f"from {self.low:g} to" if self.low or self.zero else "more than 0 and at most"
        return f"{from_} {self.high:g}{unit}"

    def _choice(self, name: str, given: object) -> str:
        word = str(given).strip().lower()
        if word not in self.choices:
            raise WrongValue(name, given, f"must be one of {', '.join(self.choices)}")
        return word

    def _material(self, name: str, given: object) -> Material:
        if isinstance(given, Material):
            return given
        if isinstance(given, Mapping):
            return Material(**given)
        try:
            return _named_material(str(given))
        except ValueError as error:
            raise WrongValue(name, given, str(error)) from None


def number(default: float | tuple[float, ...] | None, unit: str, says: str, **limits: Any) -> Any:
    """A parameter that is a positive number, or several if its default is a tuple. limits: low, high, whole."""
    return _parameter(default, Option(says, unit, isinstance(default, tuple), **limits))


def substance(default: Material | tuple[Material, ...], says: str) -> Any:
    """A parameter that is a material, or several."""
    return _parameter(default, Option(says, several=isinstance(default, tuple), of_material=True))


def choice(default: str | tuple[str, ...], choices: Iterable[str], says: str) -> Any:
    """A parameter that is a word, or several."""
    return _parameter(default, Option(says, several=isinstance(default, tuple), choices=tuple(choices)))


def _parameter(default: Any, option: Option) -> Any:
    return field(default=default, metadata={"option": option})


@dataclass(frozen=True)
class Conditions:
    """The parameters of a study: a subclass has one field for each. Without fields, nothing can be changed."""

    def __post_init__(self) -> None:
        for name, option in self.options().items():
            given = getattr(self, name)
            if given is not self.thesis(name):
                object.__setattr__(self, name, option.read(name, given))
        self.check()

    def check(self) -> None:
        """Raise a WrongValue for parameters that do not fit each other."""

    @classmethod
    def of(cls, own: Mapping[str, Any]) -> Self:
        """Those with some parameters of a user's own; a ValueError for a name that does not exist."""
        known = cls.options()
        for name, value in own.items():
            if name not in known:
                meant = did_you_mean(name, known, str)
                others = f"there are {', '.join(known)}" if known else "nothing can be changed"
                raise WrongValue(name, value, f"no parameter of this study; {f'{meant} '.lstrip()}{others}")
        return cls(**own)

    @classmethod
    def read(cls, data: xr.Dataset) -> Self:
        """Those with which the results were computed."""
        return cls(**stored(data.attrs.get(OWN)))

    @classmethod
    def options(cls) -> dict[str, Option]:
        """How each parameter is read."""
        return {one.name: one.metadata["option"] for one in fields(cls)}

    @classmethod
    def thesis(cls, name: str) -> Any:
        """The thesis's value of a parameter."""
        return cls.__dataclass_fields__[name].default

    def differing(self) -> list[str]:
        """Names of the parameters that differ from the thesis's."""
        return [name for name in self.options() if getattr(self, name) != self.thesis(name)]

    @property
    def own(self) -> bool:
        """Whether any differs."""
        return bool(self.differing())

    def few(self, name: str, quick: Any) -> Any:
        """The values of a parameter, for a quick study `quick` if they are the thesis's."""
        return getattr(self, name) if name in self.differing() else quick

    def remark(self) -> str:
        """What differs from the thesis, in words; empty if nothing does."""
        options = self.options()
        shown = {name: options[name].shown for name in self.differing()}
        parts = [
            f"{_words(name)} {show(getattr(self, name))} (thesis: {show(self.thesis(name))})"
            for name, show in shown.items()
        ]
        return f"own parameters: {'; '.join(parts)}" if parts else ""

    def marked(self, data: xr.Dataset) -> xr.Dataset:
        """The results with the parameters that differ in their attributes."""
        if not self.own:
            return data
        values = {name: _plain(getattr(self, name)) for name in self.differing()}
        return data.assign_attrs({OWN: json.dumps(values, ensure_ascii=False), DIFFERS: self.remark()})


def _items(given: object) -> Iterable[object]:
    """One value, or several: in a sequence, or with commas in a text."""
    if isinstance(given, str):
        return [part.strip() for part in given.split(",") if part.strip()]
    if isinstance(given, Mapping) or not isinstance(given, Iterable):
        return [given]
    return [item for part in given for item in _items(part)]


def _plain(value: Any) -> Any:
    """A value for JSON: a material of the table by its name, another one by its constants."""
    if isinstance(value, tuple):
        return [_plain(one) for one in value]
    if isinstance(value, Material):
        return value.name if value.name in MATERIALS and MATERIALS[value.name] == value else asdict(value)
    return value


def _named(value: Material) -> str:
    return (
        value.name or f"E {value.youngs_modulus * 1e-9:.4g} GPa, ν {value.poisson_ratio:g}, ρ {value.density:g} kg/m³"
    )


def _words(name: str) -> str:
    return name.replace("_", " ")


def _quantity(text: str, unit: str) -> float:
    """The number that a user typed, in the unit; a ValueError that says what would be right.

    All studies read their numbers here: in the unit itself, or with one of its kind, as "1 mm". unit: "m", "m/s"; empty
    for a number without one.
    """
    try:
        return float(text)
    except ValueError:
        found = WITH_UNIT.fullmatch(text) if unit else None
    what = f"a number of {unit}, as 0.001, 1e-3 or with its unit" if unit else "a number, as 0.001 or 1e-3"
    if found is None:
        raise ValueError(f"must be {what}")
    # Here: only those who type units need them.
    from structures.units import factor

    try:
        return float(Decimal(found[1]) * factor(found[2], unit))
    except ValueError as error:
        raise ValueError(f"{error}; must be {what}") from None


def _named_material(text: str) -> Material:
    """The material of this name, or the only one of this first word; a ValueError names the nearest."""
    meant = MATERIALS.meant(text)
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise ValueError(f"there are {' and '.join(one.name for one in meant)}; give the whole name")
    raise ValueError(f"no such material; {nearest(text, list(MATERIALS))}")


def _printed(values: Iterable[float], unit: str = "", words: str = "{}") -> str:
    """Values with their unit, in the digits that a user would type. words: what stands around the numbers."""
    unit, factor = READABLE.get(unit, (unit, 1.0))
    return f"{words.format(*(f'{factor * one:.6g}' for one in values))} {unit}".rstrip()
