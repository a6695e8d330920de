"""What a signal can determine before it is measured: Fisher information and Cramér–Rao bounds."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import BLIND, HALF, IDENTIFIED, NUISANCE, as_text
from coupling.inference.identify import nuisances_of
from coupling.inference.measured import Measured, Sensor
from coupling.inference.misfit import GAIN, TIME_ZERO, Misfit, inverse
from coupling.inference.prediction import Curves, Prediction, Range, check_samples, usual_length
from coupling.inference.settings import SETTINGS
from coupling.results.ar_and_tof import reflections
from coupling.results.findings import warn
from coupling.results.waves import ReflectedWave
from coupling.signals.signals import as_signal
from structures.caution import collected
from structures.checks import finite, html_table, listed, one_of, positive, short, whole
from structures.linear_algebra.one_thread import one_thread
from structures.quantities import Likely
from structures.structure import Vector

STEP = 1e-3
"""Half the distance of runs for a derivative, as a part of the value."""

DRAWS, SEED = 64, 0
"""Noisy traces from which the errors of AR and TOF are taken: exact to 9 %."""

SURE = 0.1
"""The user is warned where half the distance changes a bound by more than this part."""

EARLY = 0.8
"""A wave comes back after this part of the time that theory gives: in compressed chains after 0.86 or more."""


@dataclass(frozen=True)
class Information:
    """What a signal determines at best; returned by `identifiability`.

    Parameters
    ----------
    values : dict
        The unknowns.
    bounds : dict
        Least standard deviation of each unknown and nuisance, in its unit; those of gains are relative to 1.
    correlation : DataArray
        Correlations of the estimates.
    warnings : list of str
        What the user must know.
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
        return BLIND if SETTINGS.deviations * self.relative[name] > HALF else IDENTIFIED

    def __str__(self) -> str:
        rows = [("unknown", "value", "95 % at best", "verdict")]
        for name, bound in self.bounds.items():
            if name in self.values:
                verdict, part = self.verdict(name), f"± {100.0 * SETTINGS.deviations * self.relative[name]:.2g} %"
                rows.append((name, f"{self.values[name]:.4g}", part if verdict == IDENTIFIED else "-", verdict))
            else:
                rows.append((name, "", f"± {SETTINGS.deviations * bound:.2g}", NUISANCE))
        return as_text(rows, [f"note: {warning}" for warning in self.warnings])

    def _repr_html_(self) -> str:
        rows = [(name, f"{value:.4g}, {self.verdict(name)}") for name, value in self.values.items()]
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
    sensors, until, nuisances
        As for `identify`.
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
    one_of("compare", compare, ("waveform", "features"))
    design = Design(build, values, sensors, until, nuisances, noise, sample_every)
    beads, size, notes = design.prediction.sensors, len(values), list[str]()

    def covariance(steps: Vector | float) -> tuple[Vector, int]:
        changes = Sensitivities(design, steps)
        columns = changes.part(beads) if compare == "waveform" else changes.of_features(beads)
        usable = np.isfinite(columns).all(axis=1)
        return inverse(columns[usable]), int((~usable).sum())

    # Steps that suit the errors, and a warning where half of them change an error that is not blind anyway.
    first = np.sqrt(np.diag(covariance(STEP)[0]))[:size]
    steps = np.clip(0.3 * first, 1e-5, 2e-2)
    (full, missing), (halved, _) = covariance(steps), covariance(0.5 * steps)
    errors, half = np.sqrt(np.diag(full)), np.sqrt(np.diag(halved))[:size]
    parts = dict(zip(values, abs(half - errors[:size]) / errors[:size], strict=True))
    unsure = [name for k, name in enumerate(values) if parts[name] > SURE and SETTINGS.deviations * errors[k] <= HALF]
    if unsure:
        largest = 100.0 * max(parts[name] for name in unsure)
        notes.append(f"bounds of {', '.join(unsure)} are exact to {largest:.0f} % only")
    names = design.misfit.names if compare == "waveform" else list(values)
    if missing:
        notes.append(f"{missing} of {2 * len(beads)} features have no wave to be measured of")
    unit = dict.fromkeys(names, 1.0) | {name: abs(value) for name, value in design.values.items()}
    unit[TIME_ZERO] = design.misfit.unit
    bounds = {name: float(error) * unit[name] for name, error in zip(names, errors, strict=True)}
    correlation = xr.DataArray(full / np.outer(errors, errors), {"unknown": names, "other": names})
    warn(design.prediction.warnings)
    return Information(design.values, bounds, correlation, [*design.prediction.warnings, *notes])


class Design:
    """A noise-free signal at the values, and what it is compared by."""

    def __init__(
        self, build: Callable[..., CoSimulation], values: Mapping[str, float], sensors: Iterable[int],
        until: float | None, nuisances: Iterable[str], noise: float, sample_every: float,
    ) -> None:  # fmt: skip
        if not values:
            raise ValueError("values: name at least one unknown of the builder, such as thickness=2e-3")
        self.values = {name: finite(name, value) for name, value in values.items()}
        if zero := [name for name, value in self.values.items() if value == 0.0]:
            raise ValueError(f"{zero[0]} = 0: bounds are relative to the value, which must not be zero")
        self.noise, step = positive("noise", noise), positive("sample_every", sample_every, "s")
        Likely.NOISE.warn("identifiability", "noise", noise)
        Likely.SAMPLE.warn("identifiability", "sample_every", step)
        ranges = [Range(name, v - 0.5 * abs(v), v + 0.5 * abs(v)) for name, v in self.values.items()]
        beads = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "one bead number or more")})
        until = usual_length(build, ranges) if until is None else positive("until", until, "s")
        check_samples("sample_every", step, until / step)
        self.prediction, self.places = Prediction(build, ranges, beads, until), np.full(len(ranges), 0.5)
        names, self.here = nuisances_of(nuisances, values), self.prediction.traces([self.places])[0]
        if not np.isfinite(self.here).all():
            at = ", ".join(f"{n} = {v:.4g}" for n, v in self.values.items())
            raise ValueError(f"build: its run fails at {at}: {self.prediction.reason}")
        time = np.arange(0.0, until, step)
        rows = [
            Sensor(bead, np.interp(time, self.prediction.time, trace), noise * max(float(trace.max()), 1e-300))
            for bead, trace in zip(beads, self.here, strict=True)
        ]
        self.misfit = Misfit(self.prediction, Measured(time, rows), names, until)

    def primaries(self, time: Vector, forces: Vector, sensors: Sequence[int]) -> Vector:
        """Return AR and TOF (s) of the primary wave, sensor by sensor; NaN where it is missing.

        What comes before a wave can have run to the structure and back is the tail of the incident one.
        """
        moving, features = self.prediction.first.chain, list[float]()
        hop = moving.transit_time / (beads := len(moving.chain.beads))
        with collected():
            signal = as_signal(time, dict(zip(sensors, forces, strict=True)))
            for n in sensors:
                wave = reflections(signal, n, earliest=EARLY * 2.0 * (beads - n) * hop).primary
                found = isinstance(wave, ReflectedWave)
                features += [wave.amplitude_ratio, wave.time_of_flight] if found else [np.nan] * 2
        return np.array(features)


class Sensitivities:
    """The change of the signals of a design with the unknowns, from one batch of runs, of which any part can be taken.

    Bounds that it gives are parts of the values. step: half the distance of runs for a derivative, as such a part.
    """

    def __init__(self, design: Design, step: Vector | float = STEP) -> None:
        self.design, self.steps = design, np.broadcast_to(step, design.places.shape)
        slopes = design.prediction.slopes(design.places, design.here, self.steps)
        if not np.isfinite(slopes).all():
            raise FloatingPointError("a run beside the values failed")
        p = np.append(design.places, 0.0) if TIME_ZERO in design.misfit.free else design.places
        point = design.misfit.point(p, design.here, slopes)
        self.columns = point.columns.reshape(len(design.prediction.sensors), -1, len(design.misfit.names))

    def part(self, sensors: Sequence[int], until: float = inf, unknowns: Iterable[str] | None = None) -> Vector:
        """Return the columns of the unknowns that are not known otherwise, and of the nuisances of these sensors."""
        names, numbers = self.design.misfit.names, {str(n) for n in sensors}
        free = self._free(unknowns)
        used = [
            k for k, name in enumerate(names)
            if name in free or (name not in self.design.values and (" " not in name or name.split(" ")[1] in numbers))
        ]  # fmt: skip
        rows = [self.design.prediction.sensors.index(n) for n in sensors]
        inside = self.design.misfit.measured.time <= until
        return self.columns[rows][:, inside].reshape(-1, len(names))[:, used]

    def waveform(
        self, sensors: Sequence[int], until: float = inf, unknowns: Iterable[str] | None = None
    ) -> dict[str, float]:
        """Return the bounds from all samples up to a time, s; `unknowns`: the others are known."""
        return _bounds(self.part(sensors, until, unknowns), self._free(unknowns))

    def of_features(self, sensors: Sequence[int], until: float = inf, draws: int = DRAWS) -> Vector:
        """Return the changes of AR and TOF with the unknowns over their errors, which come from noisy draws."""
        design, random = self.design, np.random.default_rng(SEED)
        rows = [design.prediction.sensors.index(n) for n in sensors]
        time, moments = design.misfit.measured.time, design.prediction.time
        grid, early = time[time <= until], moments <= until
        clean = Curves(design.here[rows], design.prediction.interval).at(grid)
        noise = np.array([design.misfit.measured.sensors[row].noise for row in rows])[:, None]
        noisy = [design.primaries(grid, clean + random.normal(size=clean.shape) * noise, sensors) for _ in range(draws)]
        spread = np.array(noisy).std(axis=0)
        spread = np.where(spread > 0.0, spread, np.nan)

        def moved(k: int, step: float) -> Vector:
            unit = np.arange(design.places.size) == k
            traces = design.prediction.trace(np.where(unit, design.places + step, design.places))
            return design.primaries(moments[early], traces[rows][:, early], sensors)

        # The runs of the derivatives of traces serve again.
        changes = [(moved(k, step) - moved(k, -step)) / (2.0 * step) for k, step in enumerate(self.steps.tolist())]
        return np.stack(changes, axis=1) / spread[:, None]

    def features(
        self, sensors: Sequence[int], until: float = inf, draws: int = DRAWS
    ) -> Callable[[Iterable[str] | None], dict[str, float]]:
        """Return a function of the unknowns that gives their bounds from AR and TOF alone."""
        columns, names = self.of_features(sensors, until, draws), list(self.design.values)
        columns = columns[np.isfinite(columns).all(axis=1)]

        def bounds(unknowns: Iterable[str] | None = None) -> dict[str, float]:
            free = self._free(unknowns)
            return _bounds(columns[:, [names.index(name) for name in free]], free)

        return bounds

    def _free(self, unknowns: Iterable[str] | None) -> list[str]:
        return [name for name in self.design.values if unknowns is None or name in unknowns]


def _bounds(columns: Vector, free: Sequence[str]) -> dict[str, float]:
    """Return the bounds; infinite where there is less to compare than to find, or where a wave is missing."""
    if columns.shape[0] < columns.shape[1]:
        return dict.fromkeys(free, inf)
    errors = np.sqrt(np.diag(inverse(columns)))
    return {name: float(errors[k]) if columns[:, k].any() else inf for k, name in enumerate(free)}
