"""What a signal can determine, before it is measured: Fisher information and Cramér–Rao bounds."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from math import inf

import numpy as np

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import BLIND, DEVIATIONS, HALF, IDENTIFIED, NUISANCE, Printed, as_text
from coupling.inference.identify import nuisances_of
from coupling.inference.measured import Measured, Sensor
from coupling.inference.misfit import GAIN, OFFSET, TIME_ZERO, Misfit, steps_for, unit_covariance
from coupling.inference.prediction import MOST_SAMPLES, Prediction, Range, length_of
from coupling.results.ar_and_tof import reflections
from coupling.results.findings import warn
from coupling.results.waves import ReflectedWave
from coupling.signals.signals import as_signal
from structures.caution import collected
from structures.checks import finite, listed, one_of, positive, whole
from structures.linear_algebra.one_thread import one_thread
from structures.quantities import Likely
from structures.structure import Vector


@dataclass(frozen=True, repr=False)
class Information(Printed):
    """What a signal can determine at best; returned by `identifiability`.

    Parameters
    ----------
    values : dict
        The values of the unknowns.
    bounds : dict
        Least standard deviation of each unknown and nuisance, in its unit; for gains it is relative to 1.
    warnings : list of str
        Warnings for the user.
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
        return BLIND if DEVIATIONS * self.relative[one_of("name", name, self.values)] > HALF else IDENTIFIED

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
    """Return the least errors with which a signal can determine unknowns. No signal is needed: use it to design a test.

    Parameters
    ----------
    build : callable
        Takes the unknowns by name and returns the CoSimulation of one chain, as for `identify`.
    noise : float
        Standard deviation of a sample, as a part of the greatest force at each sensor.
    sensors, until, nuisances
        As for `identify`; by default bead 7 is the sensor.
    sample_every : float
        Time between samples, s. White noise averages out: half the time makes bounds smaller by √2.
    compare : {"waveform", "features"}
        Whether all samples are compared, or only AR and TOF of the primary wave at each sensor.
    **values : float
        The values of the unknowns at which the bounds hold; none of them may be zero.

    Returns
    -------
    Information
        The bound of each unknown and nuisance; ``print`` shows a table.

    Raises
    ------
    ValueError
        For values that are zero, unknowns that `build` does not take, and sensors that the chain does not have.

    Examples
    --------
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus, impact_speed):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 10, bead, impact_speed), wall)
    >>> known = hl.identifiability(build, sensors=[5], until=5e-4, modulus=3e9, impact_speed=0.31)
    >>> known.verdict("modulus"), 0.0005 < known.relative["modulus"] < 0.01
    ('identified', True)
    """
    one_of("compare", compare, ("waveform", "features"))
    values = {name: finite(name, value) for name, value in values.items()}
    if zero := [name for name, value in values.items() if value == 0.0]:
        raise ValueError(f"{zero[0]} = 0: must not be zero, because bounds are relative to the value")
    step, noise = positive("sample_every", sample_every, "s"), positive("noise", noise)
    Likely.NOISE.warn("identifiability", "noise", noise)
    Likely.SAMPLE.warn("identifiability", "sample_every", step)
    beads = sorted({whole("sensors", n) for n in listed("sensors", sensors, object, "one bead number or more")})
    ranges = [Range(name, v - 0.5 * abs(v), v + 0.5 * abs(v)) for name, v in values.items()]
    until = length_of(build, ranges, until, "thickness=2e-3")
    if until / step > MOST_SAMPLES:
        raise ValueError(f"sample_every = {step!r} s: makes more than {MOST_SAMPLES:.0e} samples of a trace")

    # A signal without noise at the given values.
    prediction, places = Prediction(build, ranges, beads, until), np.full(len(ranges), 0.5)
    asked, time = nuisances_of(nuisances, values), np.arange(0.0, until, step)
    rows = [
        Sensor(bead, np.interp(time, prediction.time, trace), noise * max(float(trace.max()), 1e-300))
        for bead, trace in zip(beads, prediction.trace(places), strict=True)
    ]
    misfit, names = Misfit(prediction, Measured(time, rows), {OFFSET} & {*asked}), [*values]
    if compare == "waveform":
        names += [*[TIME_ZERO] * (TIME_ZERO in asked), *[f"{GAIN} {bead}" for bead in beads if GAIN in asked]]

    def columns(steps: Vector) -> Vector:
        """Return the derivatives of the compared quantities over their errors, with these steps of the unknowns."""
        if compare == "features":
            return _features(misfit, places, steps)
        point = misfit.at(places, steps)
        own = np.hstack([point.fit.slope[:, None], point.fit.gain_columns])
        return np.hstack([point.columns, own[:, [TIME_ZERO in asked, *[GAIN in asked] * len(beads)]]])

    def bounds(found: Vector) -> Vector:
        """Return the error of each parameter, infinite if it changes nothing, or if there are too few quantities."""
        there = found[np.isfinite(found).all(axis=1)]
        none = ~there.any(axis=0) | (there.shape[0] < there.shape[1])
        return np.where(none, inf, np.sqrt(np.diag(unit_covariance(there))))

    # If steps are too wide for the curvature of the model, or so narrow that rounding counts, unknowns seem easier to
    # tell apart than they are. So the largest bound is the best, with a note if the next one differs by a tenth.
    narrow, narrower = (bounds(columns(np.full(places.size, step))) for step in (1e-3, 1e-4))
    steps = steps_for(narrow[: places.size])
    compared = columns(steps)
    second, errors = np.sort([narrower, narrow, bounds(compared), bounds(columns(0.5 * steps))], axis=0)[2:]
    ratio = np.divide(second, errors, out=np.ones(errors.size), where=np.isfinite(errors))
    notes, away = [*prediction.warnings.values()], abs(ratio - 1.0)[: places.size]
    warn(notes)
    if (unsure := (away > 0.1) & (DEVIATIONS * errors[: places.size] <= HALF)).any():
        shown = ", ".join(name for name, is_unsure in zip(values, unsure, strict=True) if is_unsure)
        notes.append(f"bounds of {shown} are accurate to {100.0 * away[unsure].max():.0f} % only")
    if missing := int(np.isnan(compared[:, 0]).sum()):
        notes.append(f"{missing} of {len(compared)} features are missing, because no such wave is found")
    unit = {TIME_ZERO: misfit.unit} | {name: abs(value) for name, value in values.items()}
    found = {name: error * unit.get(name, 1.0) for name, error in zip(names, errors.tolist(), strict=True)}
    return Information(values, found, notes)


def _features(misfit: Misfit, places: Vector, steps: Vector, draws: int = 64) -> Vector:
    """Return the derivatives of AR and TOF at all sensors over their errors in noisy draws, feature × unknown; NaN if
    a wave is missing. With 64 draws the errors are accurate to 9 %."""
    prediction, sensors, random = misfit.prediction, misfit.measured.sensors, np.random.default_rng(0)
    moving = prediction.first.chain
    hop = moving.transit_time / (count := len(moving.chain.beads))

    def primaries(time: Vector, forces: Vector) -> Vector:
        features = list[float]()
        with collected():
            signal = as_signal(time, dict(zip(prediction.sensors, forces, strict=True)))
            for n in prediction.sensors:
                # A wave is back after 0.86 or more of the theoretical time in compressed chains. Earlier peaks belong
                # to the tail of the incident wave.
                wave = reflections(signal, n, earliest=0.8 * 2.0 * (count - n) * hop).primary
                found = isinstance(wave, ReflectedWave)
                features += [wave.amplitude_ratio, wave.time_of_flight] if found else [np.nan] * 2
        return np.array(features)

    clean, noise = np.stack([one.force for one in sensors]), np.array([[one.noise] for one in sensors])
    noisy = [primaries(misfit.measured.time, clean + random.normal(size=clean.shape) * noise) for _ in range(draws)]
    spread, moved = np.std(noisy, axis=0), np.eye(places.size) * steps
    traces = prediction.traces([*(places + moved), *(places - moved)])
    above, below = np.reshape([primaries(prediction.time, trace) for trace in traces], (2, places.size, -1))
    slopes: Vector = (above - below).T / (2.0 * steps)
    return slopes / np.where(spread > 0.0, spread, np.nan)[:, None]
