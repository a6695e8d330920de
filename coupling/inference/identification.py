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
NOT_TRUSTED = "not trusted: the model does not fit"  # The verdict if the model does not explain the signal.
HALF = 0.5  # Blind: half of the interval exceeds this part of the value, or the whole interval this part of the range.
LINE = 80  # Characters of a line.
DEVIATIONS = 1.959964  # Standard deviations in half of a 95 % interval.


class Printed:
    """A result that Python's prompt and a notebook show in the form of `print`."""

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
        The unit of tables and figures, and its size in the unit of the argument.
    """

    name: str
    value: float
    interval: tuple[float, float]
    verdict: str
    unit: str = ""
    unit_size: float = 1.0

    @property
    def identifiable(self) -> bool:
        """True if the signal determines the unknown, and the model explains the signal."""
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
        # A percentage of a time zero or an offset, or of a value near zero, means nothing.
        small = self.name.startswith(("time_zero", "offset")) or self.error > HALF * abs(self.value)
        part = f"{error:.2g} {self.unit}".rstrip() if small else f"{100.0 * self.error / abs(self.value):.2g} %"
        interval = " to ".join(_rounded(end, error) for end in (low, high))
        # If the model does not fit, the error means nothing; a note below the table gives the reason.
        verdict = NOT_TRUSTED.partition(":")[0] if self.verdict == NOT_TRUSTED else f"{self.verdict} (± {part})"
        return self.head, _rounded(value, error), interval, verdict


@dataclass(frozen=True, repr=False)
class Identification(Printed):
    """The result of `identify`; ``print`` shows a table.

    Parameters
    ----------
    unknowns : dict
        Name → Unknown, the builder's unknowns first, then the nuisances of the sensors.
    correlation : DataArray
        Correlations of the unknowns at the best fit.
    data : Dataset
        `measured`, `fitted` and `residual` over time (s) and sensor, N; NaN for samples that do not count. `baseline`,
        N: hum and drift in `fitted`, if the lead shows any. `noise` over sensor, N.
    misfit, explained
        Root mean square of the residual over the noise, 1 for a model that explains the signal; and whether the model
        explains it. If not, no value can be trusted; correct the model first.
    modes : list of dict
        Values of the unknowns at all fits that the noise does not exclude, the best first.
    runs : int
        The number of runs.
    warnings : list of str
        Warnings for the user.
    input : dict
        The arguments of `identify`.
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
        """True if the model explains the signal, and every unknown that is not a nuisance is identified."""
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

        Over the dimension `unknown` it has value, low, high and verdict, and the unit of tables with its size. `modes`,
        over `mode` and `unknown`, holds the values of all fits, NaN for the nuisances of the sensors.
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
    """Return a table with notes below it. are_numbers: whether to align to the right all cells but a row's first."""
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
