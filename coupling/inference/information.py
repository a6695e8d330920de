"""What a signal can determine before it is measured: Fisher information and Cramér–Rao bounds."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, product
from math import inf
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import BLIND, HALF, IDENTIFIED, LINE
from coupling.inference.identify import COMPARE, nuisances_of
from coupling.inference.misfit import GAIN, TIME_ZERO, Measured, Misfit
from coupling.inference.prediction import Curves, Prediction, Range, check_samples, usual_length
from coupling.inference.search import inverse
from coupling.results.findings import as_attribute
from structures.caution import caution
from structures.checks import finite, html_table, listed, one_of, positive, short, whole
from structures.linear_algebra.one_thread import one_thread
from structures.quantities import Likely
from structures.structure import Vector

STEP = 1e-3
"""Half the distance of runs for a derivative, as a part of the value."""

DRAWS, SEED = 64, 0
"""Noisy traces from which the errors of AR and TOF are taken: exact to 9 %."""

REACH = 1.959964
"""Standard deviations of a 95 % interval."""

SURE = 0.1
"""The user is warned where half the distance changes a bound by more than this part."""


@dataclass(frozen=True)
class Information:
    """What a signal determines at best; returned by `identifiability`.

    Parameters
    ----------
    values : dict
        The unknowns.
    bounds : dict
        Cramér–Rao bound of each unknown and nuisance: the least standard deviation of an unbiased estimate, in its
        unit; gains are relative to 1.
    correlation : DataArray
        Correlations of the estimates.
    warnings : list of str
        What the user must know.

    Examples
    --------
    >>> from coupling.inference.information import Information
    >>> known = Information({"thickness": 2e-3}, {"thickness": 1e-5}, None)
    >>> known.relative["thickness"], known.verdict("thickness")
    (0.005, 'identified')
    """

    values: dict[str, float]
    bounds: dict[str, float]
    correlation: xr.DataArray | None = field(default=None, repr=False)
    warnings: list[str] = field(default_factory=list)

    @property
    def relative(self) -> dict[str, float]:
        """Bounds of the unknowns as parts of their values."""
        return {name: self.bounds[name] / abs(value) for name, value in self.values.items()}

    def verdict(self, name: str) -> str:
        """Return "identified", or "blind" if ± 1.96 bounds exceed half of the value."""
        if name not in self.values:
            raise ValueError(f"name = {short(name)}: must be one of {', '.join(self.values)}")
        return BLIND if REACH * self.relative[name] > HALF else IDENTIFIED

    def __str__(self) -> str:
        rows = [("unknown", "value", "95 % at best", "verdict")]
        for name, value in self.values.items():
            identified = self.verdict(name) == IDENTIFIED
            part = f"± {100.0 * REACH * self.relative[name]:.2g} %" if identified else "-"
            rows.append((name, f"{value:.4g}", part, self.verdict(name)))
        for name, bound in self.bounds.items():
            if name not in self.values:
                rows.append((name, "", f"± {REACH * bound:.2g}", "nuisance"))
        widths = [max(len(row[k]) for row in rows) for k in range(3)]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, (*widths, 0), strict=True)) for row in rows]
        lines += [fill(f"note: {warning}", LINE, subsequent_indent="  ") for warning in self.warnings]
        return "\n".join(line.rstrip() for line in lines)

    def _repr_html_(self) -> str:
        parts = self.relative
        rows = [(name, f"± {100.0 * REACH * parts[name]:.2g} %, {self.verdict(name)}") for name in self.values]
        return html_table("Information", rows)


@one_thread
def identifiability(
    build: Callable[..., CoSimulation],
    noise: float = 0.01,
    sensors: Iterable[int] = (7,),
    until: float | None = None,
    nuisances: Iterable[str] = (GAIN, TIME_ZERO),
    sample_every: float = 1e-6,
    compare: str = "waveform",
    **values: float,
) -> Information:
    """Return the least errors with which a signal determines unknowns, without measuring it: the tool to design a test.

    Parameters
    ----------
    build : callable
        Takes the unknowns by name and returns the CoSimulation of one chain, as for `identify`.
    noise : float
        Standard deviation of a sample, as a part of the greatest force at each sensor.
    sensors : sequence of int
        Beads that are measured.
    until : float, optional
        Length of the record after the impact, s; by default four times what a wave takes through the chain.
    nuisances : sequence of str
        What else is not known, as for `identify`: "gain", "time_zero", "offset", "time_constant".
    sample_every : float
        Time between samples, s. White noise averages out: half the time makes bounds smaller by √2.
    compare : {"waveform", "features"}
        Whether all samples are compared, or only AR and TOF of the primary wave at each sensor.
    **values : float
        The unknowns, not zero, at which the bounds hold.

    Returns
    -------
    Information
        The bound of each unknown and nuisance; ``print`` shows a table.

    Raises
    ------
    ValueError
        For values that are zero, unknowns that the builder does not take, and sensors that are not in the chain.

    Warns
    -----
    HertzlinkWarning
        Of what its runs warn of, such as a contact beyond yield; `best_sensors` does, too.

    References
    ----------
    Kay, Fundamentals of Statistical Signal Processing: Estimation Theory (1993), equation 3.31.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus, impact_speed):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 10, bead, impact_speed), wall)
    >>> known = hl.identifiability(build, sensors=[5], until=5e-4, modulus=3e9, impact_speed=0.31)
    >>> known.verdict("modulus"), 0.0005 < known.relative["modulus"] < 0.01
    ('identified', True)
    """
    one_of("compare", compare, COMPARE)
    design = Design(build, values, sensors, until, nuisances, positive("noise", noise), sample_every)
    information = design.features() if compare == "features" else design.waveform()
    for message in design.prediction.warnings:
        caution(message)
    return information


@one_thread
def best_sensors(
    build: Callable[..., CoSimulation],
    unknown: str,
    count: int = 1,
    noise: float = 0.01,
    candidates: Iterable[int] | None = None,
    until: float | None = None,
    nuisances: Iterable[str] = (GAIN, TIME_ZERO),
    sample_every: float = 1e-6,
    choices: Mapping[str, Iterable[Any]] | None = None,
    **values: float,
) -> xr.Dataset:
    """Rank sets of sensors, and of beads or other choices, by the bound of one unknown.

    Parameters
    ----------
    build : callable
        As for `identifiability`; it takes the choices as well.
    unknown : str
        The unknown that matters.
    count : int
        Number of sensors.
    noise, until, nuisances, sample_every
        As for `identifiability`.
    candidates : sequence of int, optional
        Beads that may be sensors; by default all but the last.
    choices : mapping, optional
        Other arguments of the builder that the experimenter chooses, name → values, such as the radius of the beads.
    **values : float
        The unknowns.

    Returns
    -------
    Dataset
        Over `rank`, the best first: `bound`, `relative` to the value, `sensors` as text, and each choice.

    Raises
    ------
    ValueError
        As `identifiability`, and for an unknown that has no value.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 8, bead, 0.3), wall)
    >>> ranking = hl.best_sensors(build, "modulus", until=4e-4, candidates=[3, 5, 7], modulus=3e9)
    >>> sorted(ranking.sensors.values.tolist())
    ['3', '5', '7']
    """
    if not isinstance(unknown, str) or unknown not in values:
        raise ValueError(
            f"unknown = {short(unknown)}: has no value; must be one of {', '.join(values) or 'the unknowns'}"
        )
    if choices is not None and not isinstance(choices, Mapping):
        raise ValueError(f"choices = {short(choices)}: must be a mapping such as {{'radius': [2.4e-3, 4.8e-3]}}")
    named = {
        name: listed(f"choices[{name!r}]", values, object, "one value or more")
        for name, values in (choices or {}).items()
    }
    rows, messages = list[tuple[float, str, tuple[Any, ...]]](), dict[str, None]()
    size = whole("count", count)
    given = None if candidates is None else listed("candidates", candidates, object, "one bead number or more")
    given = None if given is None else [whole("candidates", n) for n in given]
    if not callable(build):
        raise ValueError(f"build = {short(build)}: must be a function that returns a CoSimulation")
    for chosen in product(*named.values()):
        fixed = dict(zip(named, chosen, strict=True))
        builder = _with(build, fixed)
        beads = given
        if beads is None:
            first = Design(builder, values, [1], until, nuisances, positive("noise", noise), sample_every)
            beads = list(range(1, len(first.prediction.first.chain.chain.beads)))
        if size > len(beads):
            raise ValueError(f"count = {count}: is more than the {len(beads)} candidates")
        design = Design(builder, values, beads, until, nuisances, positive("noise", noise), sample_every)
        for sensors, bound in design.of_sets(unknown, size).items():
            rows.append((bound, ", ".join(map(str, sensors)), chosen))
        messages.update(dict.fromkeys(design.prediction.warnings))
    for message in messages:
        caution(message)
    rows.sort(key=lambda row: row[0])
    data: dict[str, Any] = {
        "bound": ("rank", [row[0] for row in rows]),
        "relative": ("rank", [row[0] / abs(values[unknown]) for row in rows]),
        "sensors": ("rank", [row[1] for row in rows]),
    }
    for k, name in enumerate(named):
        data[name] = "rank", [row[2][k] for row in rows]
    return xr.Dataset(data, {"rank": np.arange(1, len(rows) + 1)}, as_attribute([*messages]))


def _with(build: Callable[..., CoSimulation], fixed: Mapping[str, Any]) -> Callable[..., CoSimulation]:
    def made(**values: Any) -> CoSimulation:
        return build(**values, **fixed)

    return made


class Design:
    """Derivatives of noise-free signals at the values."""

    def __init__(
        self,
        build: Callable[..., CoSimulation],
        values: Mapping[str, float],
        sensors: Iterable[int],
        until: float | None,
        nuisances: Iterable[str],
        noise: float,
        sample_every: float,
    ) -> None:
        if not values:
            raise ValueError("values: name at least one unknown of the builder, such as thickness=2e-3")
        self.values = {name: finite(name, value) for name, value in values.items()}
        if zero := [name for name, value in self.values.items() if value == 0.0]:
            raise ValueError(f"{zero[0]} = 0: bounds are relative to the value, which must not be zero")
        ranges = [Range(name, v - 0.5 * abs(v), v + 0.5 * abs(v)) for name, v in self.values.items()]
        numbers = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "one bead number or more")})
        if until is None:
            until = usual_length(build, ranges)
        self.prediction = Prediction(build, ranges, numbers, positive("until", until, "s"))
        Likely.NOISE.warn("identifiability", "noise", noise)
        self.noise, self.step = noise, positive("sample_every", sample_every, "s")
        Likely.SAMPLE.warn("identifiability", "sample_every", self.step)
        self.names = nuisances_of(nuisances, values)
        self.places = np.full(len(ranges), 0.5)
        self.here = self.prediction.traces([self.places])[0]
        if not np.isfinite(self.here).all():
            at = ", ".join(f"{n} = {v:.4g}" for n, v in self.values.items())
            raise ValueError(f"build: its run fails at {at}: {self.prediction.reason}")
        peaks = self.here.max(axis=-1)
        check_samples("sample_every", self.step, self.prediction.until / self.step)
        time = np.arange(0.0, self.prediction.until, self.step)
        moments = self.prediction.interval * np.arange(self.here.shape[-1])
        force = np.stack([np.interp(time, moments, trace) for trace in self.here])
        self.measured = Measured(time, force, numbers, noise * np.maximum(peaks, 1e-300))
        self.misfit = Misfit(self.prediction, self.measured, self.names, self.prediction.until)

    def _columns(self, steps: Vector) -> Vector:
        # The high-pass of the sensor, where it is not known, is known to be slow.
        p = self.misfit.start_at(self.places)
        return self.misfit.at(p, steps).columns

    def _sure(self, errors: Callable[[Vector], Vector]) -> tuple[Vector, list[str]]:
        """Return the errors with steps that suit them, and a warning where half the steps change them."""
        first = errors(np.full(self.places.size, STEP))
        steps = np.clip(0.3 * first[: self.places.size], 1e-5, 2e-2)
        full, half = errors(steps), errors(0.5 * steps)
        away = abs(half - full)[: self.places.size] / full[: self.places.size]
        # The size of a bound that makes an unknown blind does not matter.
        parts = zip(self.values, full, away, strict=False)
        unsure = {name: part for name, error, part in parts if part > SURE and REACH * error <= HALF}
        if not unsure:
            return full, []
        notes = [f"bounds of {', '.join(unsure)} are exact to {100.0 * max(unsure.values()):.0f} % only"]
        return full, notes

    def waveform(self) -> Information:
        """Return the bounds from all samples."""
        covariances: list[Vector] = []

        def errors(steps: Vector) -> Vector:
            covariance = inverse(self._columns(steps))
            covariances.append(covariance)
            return np.sqrt(np.diag(covariance))

        full_errors, notes = self._sure(errors)
        return self._information(full_errors, covariances[1], self.misfit.names, notes)

    def features(self) -> Information:
        """Return the bounds from AR and TOF alone."""
        numbers = self.prediction.sensors
        moments = self.prediction.interval * np.arange(self.here.shape[-1])
        draws = np.random.default_rng(SEED)
        # Noise is white at the sampling of the record.
        grid = np.arange(0.0, self.prediction.until, self.step)
        clean = np.stack([np.interp(grid, moments, trace) for trace in self.here])
        noisy = [
            self.prediction.primaries(
                grid, clean + draws.normal(size=clean.shape) * self.measured.noise[:, None], numbers
            )
            for _ in range(DRAWS)
        ]
        here = self.prediction.primaries(grid, clean, numbers)
        spread = np.nanstd(np.array(noisy), axis=0)
        usable = np.isfinite(here) & np.isfinite(spread) & (spread > 0.0)

        def at(places: Vector) -> Vector:
            trace = self.prediction.traces([places])[0]
            return self.prediction.primaries(moments, trace, numbers)

        covariances: list[Vector] = []

        def errors(steps: Vector) -> Vector:
            columns = np.zeros((int(usable.sum()), self.places.size))
            for k, step in enumerate(steps):
                shift = step * np.eye(self.places.size)[k]
                change = (at(self.places + shift) - at(self.places - shift)) / (2.0 * step)
                columns[:, k] = np.nan_to_num(change[usable] / spread[usable])
            covariance = inverse(columns)
            covariances.append(covariance)
            return np.sqrt(np.diag(covariance))

        full_errors, notes = self._sure(errors)
        missing = int((~usable).sum())
        if missing:
            notes.append(f"{missing} of {usable.size} features have no wave to be measured of")
        return self._information(full_errors, covariances[1], list(self.values), notes)

    def _information(self, errors: Vector, covariance: Vector, names: list[str], notes: list[str]) -> Information:
        unit = dict.fromkeys(names, 1.0)
        unit |= {unknown.name: unknown.high - unknown.low for unknown in self.prediction.ranges}
        unit[TIME_ZERO] = self.misfit.unit
        root = np.sqrt(np.diag(covariance))
        correlation = xr.DataArray(
            covariance / np.outer(root, root), dims=("unknown", "other"), coords={"unknown": names, "other": names}
        )
        bounds = {name: float(error) * unit[name] for name, error in zip(names, errors, strict=True)}
        return Information(self.values, bounds, correlation, [*self.prediction.warnings, *notes])

    def of_sets(self, unknown: str, count: int) -> dict[tuple[int, ...], float]:
        """Return the bound of one unknown for each set of sensors."""
        sensitivities, size = Sensitivities(self), abs(self.values[unknown])
        chosen = combinations(self.prediction.sensors, count)
        return {sensors: size * sensitivities.waveform(sensors)[unknown] for sensors in chosen}


class Sensitivities:
    """The change of the signals of a design with the unknowns, from one batch of runs, of which any part can be taken.

    Bounds that it gives are parts of the values. step: half the distance of runs for a derivative, as such a part.
    """

    def __init__(self, design: Design, step: float = STEP) -> None:
        self.design = design
        steps = np.full(design.places.size, step)
        self.slopes = design.prediction.slopes(design.places, design.here, steps)
        if not np.isfinite(self.slopes).all():
            raise FloatingPointError("a run beside the values failed")
        point = design.misfit.point(design.misfit.start_at(design.places), design.here, self.slopes)
        names = design.misfit.names
        self.columns = point.columns.reshape(len(design.prediction.sensors), -1, len(names))

    def part(self, sensors: Sequence[int], until: float = inf, unknowns: Iterable[str] | None = None) -> Vector:
        """Return the columns of the unknowns that are not known otherwise, and of the nuisances of these sensors."""
        names, numbers = self.design.misfit.names, {str(n) for n in sensors}
        free = self._free(unknowns)
        used = [
            k for k, name in enumerate(names)
            if name in free or (name not in self.design.values and (" " not in name or name.split(" ")[1] in numbers))
        ]  # fmt: skip
        rows = [self.design.prediction.sensors.index(n) for n in sensors]
        inside = self.design.measured.time <= until
        return self.columns[rows][:, inside].reshape(-1, len(names))[:, used]

    def waveform(
        self, sensors: Sequence[int], until: float = inf, unknowns: Iterable[str] | None = None
    ) -> dict[str, float]:
        """Return the bounds from all samples up to a time, s; `unknowns`: the others are known."""
        return self._bounds(self.part(sensors, until, unknowns), self._free(unknowns))

    def features(
        self, sensors: Sequence[int], until: float = inf, draws: int = DRAWS
    ) -> Callable[[Iterable[str] | None], dict[str, float]]:
        """Return a function of the unknowns that gives bounds from AR and TOF, whose errors come from noisy draws."""
        design = self.design
        rows = [design.prediction.sensors.index(n) for n in sensors]
        moments = design.prediction.interval * np.arange(design.here.shape[-1])
        early, time = moments <= until, design.measured.time
        grid = time[time <= until]
        here = design.here[rows]
        spread = spread_of_features(design.prediction, grid, Curves(here, design.prediction.interval).at(grid), sensors,
                                    design.measured.noise[rows], draws)  # fmt: skip
        columns = np.zeros((spread.size, design.places.size))
        # Traces that change in proportion are exact enough for derivatives, and need no runs.
        for k, slope in enumerate(self.slopes[:, rows]):
            ends = [
                design.prediction.primaries(moments[early], (here + step * slope)[:, early], sensors)
                for step in (STEP, -STEP)
            ]
            columns[:, k] = (ends[0] - ends[1]) / (2.0 * STEP) / spread
        columns = columns[np.isfinite(columns).all(axis=1)]
        names = list(design.values)

        def bounds(unknowns: Iterable[str] | None = None) -> dict[str, float]:
            free = self._free(unknowns)
            return self._bounds(columns[:, [names.index(name) for name in free]], free)

        return bounds

    def _free(self, unknowns: Iterable[str] | None) -> list[str]:
        wanted = set(self.design.values if unknowns is None else unknowns)
        return [name for name in self.design.values if name in wanted]

    @staticmethod
    def _bounds(columns: Vector, free: Sequence[str]) -> dict[str, float]:
        """Return the infinite where there is less to compare than to find, or where a wave is missing."""
        if columns.shape[0] < columns.shape[1]:
            return dict.fromkeys(free, inf)
        covariance = inverse(columns)
        unseen = [not column.any() for column in columns.T]
        return {name: inf if unseen[k] else float(np.sqrt(covariance[k, k])) for k, name in enumerate(free)}


def spread_of_features(
    prediction: Prediction, time: Vector, clean: Vector, sensors: Sequence[int], noise: Vector, draws: int
) -> Vector:
    """Return the standard deviations of AR and TOF at each sensor; NaN where a draw has no wave."""
    random = np.random.default_rng(SEED)
    sized = clean.shape
    noisy = [
        prediction.primaries(time, clean + random.normal(size=sized) * noise[:, None], sensors) for _ in range(draws)
    ]
    features = np.array(noisy)
    with np.errstate(invalid="ignore"):
        spread = features.std(axis=0)
    return np.where(spread > 0.0, spread, np.nan)
