"""Results of identification: values with intervals and verdicts, and how well the model explains the signal."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.results.findings import as_attribute
from coupling.results.provenance import provenance
from structures.checks import short

IDENTIFIED, BLIND, AT_END, NUISANCE = "identified", "blind", "at the end of its range", "nuisance"
NOT_TRUSTED = "not trusted: the model does not fit"  # Where the model does not explain the signal.
HALF = 0.5  # An unknown is blind if half of its interval exceeds this part of its value, or it this part of its range.
LINE = 80  # Characters of a line.
DEVIATIONS = 1.959964  # Standard deviations in half of a 95 % interval.


class Printed:
    """A result that Python's prompt and a notebook show as `print` does."""

    def __repr__(self) -> str:
        return str(self)


@dataclass(frozen=True)
class Unknown:
    """One unknown after an identification: an argument of the builder, or a nuisance of the sensors.

    Parameters
    ----------
    name, value, interval
        The best value and the ends of its 95 % interval, in the unit of the argument.
    verdict : str
        "identified", "blind", "at the end of its range", "nuisance" or "not trusted: the model does not fit".
    unit, unit_size
        The unit in which tables and figures show it, and one of these in the unit of the argument.
    """

    name: str
    value: float
    interval: tuple[float, float]
    verdict: str
    unit: str = ""
    unit_size: float = 1.0

    @property
    def identifiable(self) -> bool:
        """True if the signal determines it, by a model that explains the signal."""
        return self.verdict not in (BLIND, NOT_TRUSTED)

    @property
    def error(self) -> float:
        """Half of the interval."""
        return 0.5 * (self.interval[1] - self.interval[0])

    @property
    def head(self) -> str:
        """Name and unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name

    def row(self) -> tuple[str, str, str, str]:
        """Name with the unit, value and interval in this unit, and verdict, as text."""
        value, low, high, error = (number / self.unit_size for number in (self.value, *self.interval, self.error))
        if self.verdict == BLIND:
            return self.head, "-", f"{low:.4g} to {high:.4g}", f"blind; best fit {value:.3g}"
        # Of a time zero or an offset near zero a percentage means nothing.
        small = self.error > HALF * abs(self.value)
        part = f"{error:.2g} {self.unit}".rstrip() if small else f"{100.0 * self.error / abs(self.value):.2g} %"
        interval = " to ".join(_rounded(end, error) for end in (low, high))
        # An error of a model that does not fit means nothing; what follows a colon is the last line of the table.
        verdict = NOT_TRUSTED.partition(":")[0] if self.verdict == NOT_TRUSTED else f"{self.verdict} (± {part})"
        return self.head, _rounded(value, error), interval, verdict


@dataclass(frozen=True, repr=False)
class Identification(Printed):
    """What `identify` found; print it for a table.

    Parameters
    ----------
    unknowns : dict
        Name → Unknown, the builder's unknowns first, then the nuisances of the sensors.
    correlation : DataArray
        Correlations of the unknowns at the best fit.
    data : Dataset
        Over time (s) and sensor: `measured`, `fitted` and `residual`, N, NaN where samples do not count; `baseline`, N:
        hum and drift in `fitted`, where the lead shows some; `noise`, N, over sensor.
    misfit, explained
        Residual over noise, root mean square: 1 if the model explains the signal; and whether it does. If not, no value
        can be trusted, and the model should be mended first.
    modes : list of dict
        Values of the unknowns at all fits that the noise does not exclude, the best first.
    runs : int
        The number of runs.
    warnings : list of str
        What the user must know.
    input : dict
        What was asked for.
    """

    unknowns: dict[str, Unknown]
    correlation: xr.DataArray
    data: xr.Dataset
    misfit: float
    explained: bool
    modes: list[dict[str, float]]
    runs: int
    warnings: list[str] = field(default_factory=list)
    input: dict[str, Any] = field(default_factory=dict)

    @property
    def identified(self) -> bool:
        """True if every unknown that is no nuisance is identified, by a model that explains the signal."""
        return self.explained and all(unknown.verdict in (IDENTIFIED, NUISANCE) for unknown in self.unknowns.values())

    def __getitem__(self, name: str) -> Unknown:
        if name not in self.unknowns:
            raise KeyError(f"{short(name)}: must be one of {', '.join(self.unknowns)}")
        return self.unknowns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.unknowns)

    def __str__(self) -> str:
        said = "the model explains the signal" if self.explained else "the model does NOT explain the signal"
        notes = [f"{said}: its residual is {self.misfit:.3g} times the noise; {self.runs} runs"]
        for mode in self.modes[1:]:
            others = [(self.unknowns[name], value) for name, value in mode.items()]
            also = (f"{one.name} = {value / one.unit_size:.4g} {one.unit}".rstrip() for one, value in others)
            notes.append(f"fits as well: {', '.join(also)}")
        notes += [f"note: {warning}" for warning in self.warnings]
        head = ("unknown", "value", "95 % interval", "verdict")
        return as_text([head, *(one.row() for one in self.unknowns.values())], notes)

    def to_dataset(self) -> xr.Dataset:
        """Return everything as a Dataset: values, intervals, correlation, traces and residual.

        Over the dimension `unknown`: value, low, high, verdict; the unit of tables, and its size in that of the values;
        over `mode` as well: the values of all fits, NaN for the nuisances of the sensors.
        """
        names, every = list(self.unknowns), self.unknowns.values()
        columns = {name: [getattr(one, name) for one in every] for name in ("value", "verdict", "unit", "unit_size")}
        columns |= {name: [one.interval[end] for one in every] for end, name in enumerate(("low", "high"))}
        data = self.data.assign_coords(unknown=names).assign({name: ("unknown", c) for name, c in columns.items()})
        fits = [[fit.get(name, np.nan) for name in names] for fit in self.modes]
        data["modes"] = ("mode", "unknown"), np.reshape(fits, (len(fits), len(names)))
        data["correlation"] = self.correlation
        about = as_attribute(self.warnings) | provenance({"identify": self.input})
        return data.assign_attrs(misfit=self.misfit, explained=int(self.explained), runs=self.runs, **about)


def as_text(rows: Sequence[Sequence[str]], notes: Sequence[str], are_numbers: bool = False) -> str:
    """Return a table with notes below it; its cells but the first of a row may be numbers, aligned to the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    sides = [str.ljust, *[str.rjust if are_numbers else str.ljust] * (len(widths) - 1)]
    cells = ([side(*one) for side, one in zip(sides, zip(row, widths, strict=True), strict=True)] for row in rows)
    lines = ["  ".join(row).rstrip() for row in cells]
    return "\n".join([*lines, *(fill(note, LINE, subsequent_indent="  ") for note in notes)])


def unknowns_of(data: xr.Dataset) -> list[Unknown]:
    """Return the unknowns in the Dataset of an identification."""
    names = ("unknown", "value", "low", "high", "verdict", "unit", "unit_size")
    rows = zip(*(data[name].values.tolist() for name in names), strict=True)
    return [Unknown(name, value, (low, high), *others) for name, value, low, high, *others in rows]


def _rounded(value: float, error: float) -> str:
    """Return a value with the digits that its error allows: to the second digit of the error."""
    if not (error > 0.0 and np.isfinite(error)) or value == 0.0:
        return f"{value:.4g}"
    count = np.floor(np.log10(abs(value))) - np.floor(np.log10(error)) + 2.0
    text = f"{value:#.{int(min(max(count, 2.0), 8.0))}g}".rstrip(".")
    return f"{float(text):.0f}" if "e+0" in text else text
