"""Results of identification: values with intervals and verdicts, and how well the model explains the signal."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.results.findings import as_attribute
from coupling.results.provenance import provenance
from structures.checks import html_table, short

IDENTIFIED, BLIND, AT_END, NUISANCE = "identified", "blind", "at the end of its range", "nuisance"

NOT_TRUSTED = "not trusted: the model does not fit"
"""The verdict of every unknown where the model does not explain the signal."""

HALF = 0.5
"""An unknown is blind if half of its 95 % interval exceeds this part of its value, or it this part of its range."""

LINE = 80
"""Characters of a line."""


@dataclass(frozen=True)
class Unknown:
    """One unknown after an identification.

    Parameters
    ----------
    name : str
        The argument of the builder, or the nuisance.
    value : float
        The best value, in the unit of the argument.
    interval : tuple of float
        95 % interval.
    verdict : str
        "identified"; "blind": the interval is wider than ± half of the value, or than half of the range, so that the
        value means little and the interval is what is known; "at the end of its range": the range may be too narrow;
        "nuisance": it was said to be of no interest; "not trusted: the model does not fit": no value can be trusted,
        whatever its interval.
    range : tuple of float, optional
        The range that was searched.
    unit : str
        The unit in which tables and figures show it.
    unit_size : float
        One of these in the unit of the argument.

    Examples
    --------
    >>> from coupling.inference.identification import Unknown
    >>> edge = Unknown("distance", 0.06, (0.0595, 0.0605), "identified", (0.01, 0.3), "mm", 1e-3)
    >>> edge.identifiable, round(edge.error, 4), edge.row()[:3]
    (True, 0.0005, ('distance, mm', '60.00', '59.50 to 60.50'))
    """

    name: str
    value: float
    interval: tuple[float, float]
    verdict: str
    range: tuple[float, float] | None = None
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
        digits = _digits(error)
        interval = " to ".join(_rounded(x, digits) for x in (low, high))
        # An error of a model that does not fit means nothing; what follows a colon is the last line of the table.
        verdict = NOT_TRUSTED.partition(":")[0] if self.verdict == NOT_TRUSTED else f"{self.verdict} (± {part})"
        return self.head, _rounded(value, digits), interval, verdict


@dataclass(frozen=True)
class Identification:
    """What `identify` found; print it for a table.

    Parameters
    ----------
    unknowns : dict
        Name → Unknown, the builder's unknowns first, then the nuisances of the sensors.
    correlation : DataArray
        Correlations of the unknowns at the best fit.
    data : Dataset
        Over time (s) and sensor: `measured`, `fitted` and `residual`, N, NaN where samples do not count; `baseline`, N:
        hum and drift in `fitted`, where some were fitted; `noise`, N, over sensor.
    misfit : float
        Residual over noise, root mean square: 1 if the model explains the signal.
    explained : bool
        Whether the residual is noise. If not, the intervals allow for a residual that is correlated in time, and the
        model should be mended first.
    modes : list of dict
        Values of the unknowns at all fits that the noise does not exclude, the best first.
    converged : bool
        Whether least squares ended at a minimum, not at their limit of runs.
    runs : int
        The number of runs.
    warnings : list of str
        What the user must know.
    input : dict
        What was asked for.
    remarks : list of str
        How a plate was searched, and how accurate its model is.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 10, bead, 0.3), wall)
    >>> found = hl.identify(build(3e9).run(5e-4), build, sensors=[5], nuisances=[], modulus=(1e9, 10e9))
    >>> found["modulus"].verdict, f"{found['modulus'].value:.3g}"
    ('identified', '3e+09')
    """

    unknowns: dict[str, Unknown]
    correlation: xr.DataArray
    data: xr.Dataset
    misfit: float
    explained: bool
    modes: list[dict[str, float]]
    converged: bool
    runs: int
    warnings: list[str] = field(default_factory=list)
    input: dict[str, Any] = field(default_factory=dict)
    _draws: Callable[[int, int], xr.Dataset] | None = field(default=None, repr=False, compare=False)
    remarks: list[str] = field(default_factory=list)

    @property
    def identified(self) -> bool:
        """True if every unknown that is no nuisance is identified, by a model that explains the signal."""
        return self.explained and all(unknown.verdict in (IDENTIFIED, NUISANCE) for unknown in self.unknowns.values())

    def posterior(self, runs: int = 20_000, seed: int = 0) -> xr.Dataset:
        """Draws of the unknowns from their posterior distribution, by an ensemble of walkers (emcee).

        It shows what an interval does not: skewed, curved and separate regions. Every value within a range counts the
        same before the measurement, or every factor for a range that is searched by its logarithm. Gains and offsets
        have their best values at each draw. Where the model does not explain the signal, or with a discrepancy, the
        likelihood is flattened as the intervals are widened. Requires ``pip install "hertzlink[posterior]"``.

        Parameters
        ----------
        runs : int
            The number of runs, of all walkers together.
        seed : int
            Of the walkers.

        Returns
        -------
        Dataset
            Over `draw`: each unknown of the builder, time zero and time constant. Attributes: `acceptance`,
            `autocorrelation_time` in steps, `warnings`.

        Raises
        ------
        ValueError
            For so few runs that no walker moves, and after a file was read, which holds no builder.

        Warns
        -----
        HertzlinkWarning
            If the chain is shorter than 50 autocorrelation times.

        References
        ----------
        Foreman-Mackey et al., Publ. Astron. Soc. Pac. 125 (2013) 306. Goodman and Weare, Comm. App. Math. Comp. Sci. 5
        (2010) 65.
        """
        if self._draws is None:
            raise ValueError("posterior: needs the builder; call it on what identify returned")
        return self._draws(runs, seed)

    def __getitem__(self, name: str) -> Unknown:
        if name not in self.unknowns:
            raise KeyError(f"{short(name)}: must be one of {', '.join(self.unknowns)}")
        return self.unknowns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.unknowns)

    def __str__(self) -> str:
        head = ("unknown", "value", "95 % interval", "verdict")
        rows = [head, *(unknown.row() for unknown in self.unknowns.values())]
        widths = [max(len(row[k]) for row in rows) for k in range(3)]
        lines = [
            "  ".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[3]]) for row in rows
        ]
        said = "the model explains the signal" if self.explained else "the model does NOT explain the signal"
        lines.append(f"{said}: its residual is {self.misfit:.3g} times the noise; {self.runs} runs")
        for other in self.modes[1:]:
            also = ", ".join(self._in_words(name, value) for name, value in other.items())
            lines.append(fill(f"fits as well: {also}", LINE, subsequent_indent="  "))
        notes = [*(f"note: {warning}" for warning in self.warnings), *self.remarks]
        lines += [fill(note, LINE, subsequent_indent="  ") for note in notes]
        return "\n".join(line.rstrip() for line in lines)

    def __repr__(self) -> str:
        texts = [f"{row[0]} = {row[1]} ({row[3]})" for unknown in self.unknowns.values() if (row := unknown.row())]
        return f"Identification({'; '.join(texts)})"

    def _in_words(self, name: str, value: float) -> str:
        """Return another value of an unknown, in its unit."""
        unknown = self.unknowns[name]
        return f"{name} = {value / unknown.unit_size:.4g} {unknown.unit}".rstrip()

    def _repr_html_(self) -> str:
        rows = [
            (row[0], f"{row[1]}; {row[2]}; {row[3]}") for unknown in self.unknowns.values() if (row := unknown.row())
        ]
        return html_table("Identification", [*rows, ("residual over noise", f"{self.misfit:.3g}")])

    def to_dataset(self) -> xr.Dataset:
        """Return everything as a Dataset: values, intervals, correlation, traces and residual.

        Returns
        -------
        Dataset
            The data, and over the dimension `unknown`: value, low, high, verdict; the unit of tables, and its size in
            that of the values; over `mode` as well: the values of all fits, NaN for the nuisances of the sensors.
        """
        names, all_of = list(self.unknowns), list(self.unknowns.values())
        data = self.data.assign_coords(unknown=names)
        data["value"] = "unknown", [unknown.value for unknown in all_of]
        data["low"] = "unknown", [unknown.interval[0] for unknown in all_of]
        data["high"] = "unknown", [unknown.interval[1] for unknown in all_of]
        data["verdict"] = "unknown", [unknown.verdict for unknown in all_of]
        data["unit"] = "unknown", [unknown.unit for unknown in all_of]
        data["unit_size"] = "unknown", [unknown.unit_size for unknown in all_of]
        fits = [[fit.get(name, np.nan) for name in names] for fit in self.modes]
        data["modes"] = ("mode", "unknown"), np.reshape(fits, (len(fits), len(names)))
        data["correlation"] = self.correlation
        return data.assign_attrs(
            misfit=self.misfit, explained=int(self.explained), runs=self.runs, **as_attribute(self.warnings),
            **provenance({"identify": self.input}),
        )  # fmt: skip

    def save(self, path: str | Path) -> None:
        """Write the Dataset of `to_dataset` to a netCDF file.

        Parameters
        ----------
        path : path
            The file; one that exists is replaced.
        """
        self.to_dataset().to_netcdf(path, engine="h5netcdf")


def unknowns_of(data: xr.Dataset) -> list[Unknown]:
    """Return the unknowns in the Dataset of an identification."""
    names = [str(name) for name in data.unknown.values]
    values, low, high, verdicts = (data[name].values.tolist() for name in ("value", "low", "high", "verdict"))
    units, sizes = data.unit.values.tolist(), data.unit_size.values.tolist()
    return [
        Unknown(name, value, ends, str(verdict), unit=str(unit), unit_size=size)
        for name, value, ends, verdict, unit, size in zip(
            names, values, zip(low, high, strict=True), verdicts, units, sizes, strict=True
        )
    ]


def verdict_of(value: float, interval: tuple[float, float], ends: tuple[float, float]) -> str:
    """Return the verdict where the model explains the signal."""
    if is_blind(value, interval, ends):
        return BLIND
    return AT_END if is_at_end(value, ends) else IDENTIFIED


def is_blind(value: float, interval: tuple[float, float], ends: tuple[float, float]) -> bool:
    """Return whether half of an interval exceeds a part of the value, or the interval that part of the range."""
    half = 0.5 * (interval[1] - interval[0])
    return half > HALF * abs(value) or 2.0 * half > HALF * (ends[1] - ends[0])


def is_at_end(value: float, ends: tuple[float, float]) -> bool:
    """Return whether a value is at an end of its range."""
    return min(value - ends[0], ends[1] - value) < 1e-6 * (ends[1] - ends[0])


def _digits(error: float) -> float:
    """Return the place of the second digit of an error."""
    return 10.0 ** (np.floor(np.log10(error)) - 1.0) if error > 0.0 and np.isfinite(error) else 0.0


def _rounded(value: float, digit: float) -> str:
    """Return a value with as many digits as its error allows."""
    if digit == 0.0 or value == 0.0:
        return f"{value:.4g}"
    count = int(min(max(np.floor(np.log10(abs(value))) - np.log10(digit) + 1.0, 2.0), 8.0))
    return f"{value:#.{count}g}".rstrip(".")
