"""What a signal can determine before it is measured: Fisher information and Cramér–Rao bounds."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from math import inf

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import BLIND, DEVIATIONS, HALF, IDENTIFIED, NUISANCE, Printed, as_text
from coupling.inference.identify import nuisances_of
from coupling.inference.measured import Measured, Sensor
from coupling.inference.misfit import GAIN, OFFSET, TIME_ZERO, Misfit, inverse, steps_for
from coupling.inference.prediction import MOST_SAMPLES, Prediction, Range, length_of
from coupling.results.ar_and_tof import reflections
from coupling.results.findings import warn
from coupling.results.waves import ReflectedWave
from coupling.signals.signals import as_signal
from structures.caution import collected
from structures.checks import finite, listed, one_of, positive, short, whole
from structures.linear_algebra.one_thread import one_thread
from structures.quantities import Likely
from structures.structure import Vector


@dataclass(frozen=True, repr=False)
class Information(Printed):
    """What a signal determines at best; returned by `identifiability`.

    Parameters
    ----------
    values : dict
        The unknowns.
    bounds : dict
        Least standard deviation of each unknown and nuisance, in its unit; those of gains are relative to 1.
    warnings : list of str
        What the user must know.
    """

    values: dict[str, float]
    bounds: dict[str, float]
    warnings: list[str] = field(default_factory=list)

    @property
    def relative(self) -> dict[str, float]:
        """Bounds of the unknowns as parts of their values."""
        return {name: self.bounds[name] / abs(value) for name, value in self.values.items()}

    def verdict(self, name: str) -> str:
        """Return "identified", or "blind" if ± 1.96 bounds exceed half of the value."""
        if name not in self.values:
            raise ValueError(f"name = {short(name)}: must be one of {', '.join(self.values)}")
        return BLIND if DEVIATIONS * self.relative[name] > HALF else IDENTIFIED

    def __str__(self) -> str:
        rows = [("unknown", "value", "95 % at best", "verdict")]
        for name, bound in self.bounds.items():
            if name in self.values:
                verdict, part = self.verdict(name), f"± {100.0 * DEVIATIONS * self.relative[name]:.2g} %"
                rows.append((name, f"{self.values[name]:.4g}", part if verdict == IDENTIFIED else "-", verdict))
            else:
                rows.append((name, "", f"± {DEVIATIONS * bound:.2g}", NUISANCE))
        return as_text(rows, [f"note: {warning}" for warning in self.warnings])


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
    derivatives = design.waveform if compare == "waveform" else design.features

    # Steps that suit the errors, and a warning where half of them change an error that is not blind by a tenth.
    first = np.array([*bounds_of(derivatives(1e-3))[0].values()])[: len(values)]
    steps = steps_for(first)
    columns = derivatives(steps)
    bounds, halved = bounds_of(columns)[0], bounds_of(derivatives(0.5 * steps))[0]
    notes, away = [*design.prediction.warnings.values()], {n: abs(halved[n] / bounds[n] - 1.0) for n in values}
    warn(notes)
    if unsure := [name for name in values if away[name] > 0.1 and DEVIATIONS * bounds[name] <= HALF]:
        largest = 100.0 * max(away[name] for name in unsure)
        notes.append(f"bounds of {', '.join(unsure)} are exact to {largest:.0f} % only")
    if missing := int(columns[..., 0].isnull().sum()):
        notes.append(f"{missing} of {columns[..., 0].size} features have no wave to be measured of")
    unit = {TIME_ZERO: design.misfit.unit} | {name: abs(value) for name, value in design.values.items()}
    return Information(design.values, {name: bound * unit.get(name, 1.0) for name, bound in bounds.items()}, notes)


class Design:
    """A noise-free signal at the values, and the derivatives of what is compared, each over its error: DataArrays over
    "parameter", the unknowns, changed by parts of their values, and nuisances."""

    def __init__(
        self, build: Callable[..., CoSimulation], values: Mapping[str, float], sensors: Iterable[int],
        until: float | None, nuisances: Iterable[str], noise: float, sample_every: float,
    ) -> None:  # fmt: skip
        if not values:
            raise ValueError("values: name at least one unknown of the builder, such as thickness=2e-3")
        self.values = {name: finite(name, value) for name, value in values.items()}
        if zero := [name for name, value in self.values.items() if value == 0.0]:
            raise ValueError(f"{zero[0]} = 0: bounds are relative to the value, which must not be zero")
        step, noise = positive("sample_every", sample_every, "s"), positive("noise", noise)
        Likely.NOISE.warn("identifiability", "noise", noise)
        Likely.SAMPLE.warn("identifiability", "sample_every", step)
        ranges = [Range(name, v - 0.5 * abs(v), v + 0.5 * abs(v)) for name, v in self.values.items()]
        beads = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "one bead number or more")})
        until = length_of(build, ranges, until)
        if until / step > MOST_SAMPLES:
            raise ValueError(f"sample_every = {step!r} s: makes more than {MOST_SAMPLES:.0e} samples of a trace")
        self.prediction, self.places = Prediction(build, ranges, beads, until), np.full(len(ranges), 0.5)
        self.nuisances, time = nuisances_of(nuisances, values), np.arange(0.0, until, step)
        rows = [
            Sensor(bead, np.interp(time, self.prediction.time, trace), noise * max(float(trace.max()), 1e-300))
            for bead, trace in zip(beads, self.prediction.trace(self.places), strict=True)
        ]
        self.misfit = Misfit(self.prediction, Measured(time, rows), {OFFSET} & {*self.nuisances})

    def waveform(self, steps: Vector | float = 1e-3) -> xr.DataArray:
        """Return the derivatives of all samples, sensor × time × parameter; of the unknowns over twice these steps."""
        point, beads = self.misfit.at(self.places, np.broadcast_to(steps, self.places.shape)), self.prediction.sensors
        gains = [f"{GAIN} {bead}" for bead in beads]
        columns = np.hstack([point.columns, point.fit.slope[:, None], point.fit.gain_columns])
        names, time = [*self.values, TIME_ZERO, *gains], self.misfit.measured.time
        axes = {"sensor": beads, "time": time, "parameter": names}
        data = xr.DataArray(columns.reshape(len(beads), -1, len(names)), axes, tuple(axes))
        free = [*self.values, *[TIME_ZERO] * (TIME_ZERO in self.nuisances), *gains * (GAIN in self.nuisances)]
        return data.sel(parameter=free)

    def features(
        self, steps: Vector | float = 1e-3, sensors: Sequence[int] | None = None, until: float = inf, draws: int = 64
    ) -> xr.DataArray:
        """Return the derivatives of AR and TOF at sensors, feature × parameter, over their errors in noisy draws; NaN
        where a wave is missing. until: the end of the record, s; 64 draws are exact to 9 %."""
        beads, random = sensors or self.prediction.sensors, np.random.default_rng(0)
        moving = self.prediction.first.chain
        hop = moving.transit_time / (count := len(moving.chain.beads))

        def primaries(time: Vector, forces: Vector) -> Vector:
            features = list[float]()
            with collected():
                signal = as_signal(time, dict(zip(beads, forces, strict=True)))
                for n in beads:
                    # A wave is back after 0.86 or more of the time that theory gives, in compressed chains; what comes
                    # earlier is the tail of the incident one.
                    wave = reflections(signal, n, earliest=0.8 * 2.0 * (count - n) * hop).primary
                    found = isinstance(wave, ReflectedWave)
                    features += [wave.amplitude_ratio, wave.time_of_flight] if found else [np.nan] * 2
            return np.array(features)

        measured, rows = self.misfit.measured, [self.prediction.sensors.index(n) for n in beads]
        time, early = measured.time[measured.time <= until], self.prediction.time <= until
        clean = np.stack([measured.sensors[row].force[: time.size] for row in rows])
        noise = np.array([measured.sensors[row].noise for row in rows])[:, None]
        noisy = [primaries(time, clean + random.normal(size=clean.shape) * noise) for _ in range(draws)]
        spread = np.std(noisy, axis=0)
        moved = np.eye(self.places.size) * steps
        traces = self.prediction.traces([*(self.places + moved), *(self.places - moved)])
        found = [primaries(self.prediction.time[early], trace[rows][:, early]) for trace in traces]
        above, below = np.reshape(found, (2, self.places.size, -1))
        changes = (above - below).T / (2.0 * np.diag(moved)) / np.where(spread > 0.0, spread, np.nan)[:, None]
        return xr.DataArray(changes, {"parameter": [*self.values]}, ("feature", "parameter"))


def bounds_of(derivatives: xr.DataArray, known: Iterable[str] = ()) -> tuple[dict[str, float], xr.DataArray]:
    """Return the bound of each parameter but those that are known, and the correlations of the estimates; a bound is
    infinite where there is less to compare than to find, or where nothing changes."""
    columns = derivatives.drop_sel(parameter=list(known))
    names, rows = columns.parameter.values.tolist(), columns.values.reshape(-1, columns.sizes["parameter"])
    rows = rows[np.isfinite(rows).all(axis=1)]
    covariance = inverse(rows)
    errors = np.sqrt(np.diag(covariance))
    none = ~rows.any(axis=0) | (rows.shape[0] < rows.shape[1])
    bounds = dict(zip(names, np.where(none, inf, errors).tolist(), strict=True))
    return bounds, xr.DataArray(covariance / np.outer(errors, errors), {"unknown": names, "other": names})
