"""The sliders of a case: the axes of its sweep, or the entries that usually vary; the impact speed; and the sensor."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from decimal import Decimal
from math import ceil, floor, inf, log10
from typing import Any, get_args

from hertzlink.cases import Path, entry, put, written
from hertzlink.cases.axes import unit_at, words_of
from hertzlink.cases.case import Case, points_of
from hertzlink.cases.reader import Call
from hertzlink.cases.tasks import Task, count_of_beads
from structures.material import Material
from structures.units import factor

STEPS = 50  # Steps of a slider from zero to its first value; there may be up to ten times as many.
LAYERS = 3  # Number of layers of a rod that get sliders.
# Ranges, as parts of the value in the case. Those of meshed plates are shorter, so that one basis serves them.
WIDE, HALVES, NEAR, NEARER = (0.25, 3.0), (0.5, 2.0), (0.5, 1.5), (0.75, 1.25)
PREFERRED = {"m": "mm", "Pa": "GPa"}  # Units of values that a case gives as plain numbers.
SENSOR: Path = ("measure", "sensor")
NUMBER = re.compile(r"-?\d{1,15}(\.\d{1,15})?([eE][-+]?\d{1,2})?")


@dataclass(frozen=True)
class Slider:
    """A slider that a user moves: an entry of the case, its range and first value in a unit; or choices by their texts.

    label: what it moves, in words.
    """

    path: Path
    label: str
    unit: str
    low: Decimal
    high: Decimal
    start: Decimal | str
    step: Decimal = Decimal(1)
    size: Decimal = Decimal(1)
    whole: bool = False
    choices: Mapping[str, Any] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return written(self.path)

    def read(self, text: str) -> Any:
        """Return the entry of the case that a text from the page means; raise a ValueError for any other text."""
        allowed, fault = f"{plain(self.low)} to {plain(self.high)} {self.unit}".strip(), ""
        if text in self.choices:
            return self.choices[text]
        if self.choices:
            fault = f"{text[:40]!r} is not a choice; take one of {', '.join(self.choices)}"
        elif not NUMBER.fullmatch(text) or (self.whole and not text.lstrip("-").isdigit()):
            fault = f"{text[:40]!r} is not a {'whole number' if self.whole else 'number'}; give one from {allowed}"
        elif not self.low <= Decimal(text) <= self.high:
            fault = f"{f'{text} {self.unit}'.rstrip()} is outside of {allowed}"
        if fault:
            raise ValueError(f"{self.label}: {fault}")
        if self.unit:
            return f"{text} {self.unit}"
        return int(text) if self.whole else float(text)

    def for_page(self) -> dict[str, Any]:
        """Return what the page needs to draw it."""
        numbers = {name: getattr(self, name) for name in ("start", "low", "high", "step")}
        texts = {name: plain(one) if isinstance(one, Decimal) else one for name, one in numbers.items()}
        own = {"name": self.name, "label": self.label, "unit": self.unit, "whole": self.whole}
        return own | texts | {"choices": list(self.choices)}


def plain(value: Decimal) -> str:
    return f"{value.normalize():f}"


def start_of(task: Task) -> Case:
    """Return the case without its sweep. An entry within its axis stays; any other gets the first value of its axis."""
    data = {name: part for name, part in task.case.data.items() if name not in ("sweep", "identify", "sensitivities")}
    case = replace(task.case, data=data).changed({})
    for axis in task.axes:
        value = entry(task.case.data, axis.path)
        # What the file gives may be a text with a unit: the checked value counts.
        number = None if value is None else task.first.changed({axis.path: value}).value(axis.path)
        inside = value in axis.values
        if axis.is_number and isinstance(number, int | float):
            inside = min(axis.values) <= number <= max(axis.values)
        if not inside:
            put(case.data, axis.path, axis.values[0])
    case.data["measure"] = {"sensor": task.sensors[0]}
    return case


def sliders_of(task: Task, start: Case) -> list[Slider]:
    """Return the sliders of a case, the first ones of its structure. start: what `start_of` returns."""
    start.only_chain("the page")
    sliders = list[Slider]()
    for axis in task.axes:
        value = start.value(axis.path)
        if len(axis.values) > 1 and axis.is_number:
            low, high, first = (digits(one / axis.size) for one in (min(axis.values), max(axis.values), value))
            whole = all(isinstance(one, int) for one in axis.values)
            by = Decimal(1) if whole else step(float(high - low) / STEPS, low)
            size = Decimal(repr(axis.size))
            sliders.append(Slider(axis.path, axis.words, axis.unit, low, high, first, by, size, whole))
        elif len(axis.values) > 1:  # a list of words
            texts = {str(one): one for one in axis.values}
            word = str(value) if str(value) in texts else next(iter(texts))
            sliders.append(Slider(axis.path, axis.words, "", Decimal(0), Decimal(0), word, choices=texts))

    # Numbers that no axis varies.
    (chain,) = start.all("chain")
    numbers = [] if task.axes else list(stated(start, start.tree.entries["structure"]))
    numbers += stated(start, chain)
    if isinstance(losses := chain.entries.get("dissipation"), Call):
        numbers += stated(start, losses)
    if drop := chain.entries.get("drop_height"):
        numbers.append((("chain", "drop_height"), drop, WIDE, inf))
    varied = [axis.path for axis in task.axes]
    sliders += [around(start, *number) for number in numbers if number[0] not in varied]
    if SENSOR not in varied:
        sensor, last = Decimal(start.data["measure"]["sensor"]), Decimal(count_of_beads(start, 0))
        sliders.append(Slider(SENSOR, "sensor", "", Decimal(1), last, sensor, whole=True))
    return sliders


def stated(case: Case, body: Call) -> Iterator[tuple[Path, float, tuple[float, float], float]]:
    """Yield the numbers of a part that usually vary: path, value (SI), range in parts of it, and the greatest value.

    These are the positive numbers that the case states, and Young's moduli of materials; of layers, lengths and moduli;
    of plates, the distance from the left edge and the thickness. Frequencies and times are left out: they say how
    finely, and for how long, it is computed.
    """
    plate = "at" in body.form.common
    if plate and points_of(body) == 1 and "width" in body.entries and body.entries["at"][0] > 0.0:
        yield (*body.path, "at", 0), body.entries["at"][0], NEAR, body.entries["length"]
    for layer in body.entries.get("layers", [])[:LAYERS]:
        modulus = (*layer.path, "material", "youngs_modulus")
        yield (*layer.path, "length"), layer.entries["length"], WIDE, inf
        yield modulus, case.value(modulus), WIDE, inf
    for name, parameter in body.form.entries.items():
        at, value, quantity = (*body.path, name), body.entries.get(name), parameter.quantity
        if value is None or name in (*body.form.common, "drop_height") or (plate and name != "thickness"):
            continue
        if Material in (parameter.type, *get_args(parameter.type)):
            modulus = (*at, "youngs_modulus")
            yield modulus, case.value(modulus), HALVES, inf
        elif quantity and quantity.unit not in ("Hz", "s") and isinstance(value, float) and value > 0.0:
            near = NEARER if plate else HALVES
            yield at, value, near if name == "thickness" else WIDE, quantity.high


def around(case: Case, path: Path, value: float, parts: tuple[float, float], most: float) -> Slider:
    """Return a slider around the value (SI) in the case, in the unit that the case gives. most: the greatest value."""
    unit, number, si = unit_at(case, path, [entry(case.data, path)])
    if unit == si and unit in PREFERRED:
        unit, number = PREFERRED[unit], float(factor(PREFERRED[unit], si))
    first = digits(value / number)
    size = step(float(first) / STEPS, first)
    top = first * Decimal(parts[1])
    if most < inf:
        top = min(top, Decimal(most / number))
    low, high = ceil(first * Decimal(parts[0]) / size) * size, max(floor(top / size) * size, first)
    return Slider(path, words_of(case, path), unit, min(low, first), high, first, size, Decimal(repr(number)))


def digits(value: float) -> Decimal:  # unit conversions leave rounding errors
    return Decimal(f"{value:.9g}")


def step(wanted: float, value: Decimal) -> Decimal:
    """Return a power of ten up to `wanted`, of which the value is a whole multiple if it has few digits."""
    last = value.normalize().as_tuple().exponent
    power = floor(log10(wanted))
    return Decimal(1).scaleb(max(power - 2, min(power, last if isinstance(last, int) else power)))
