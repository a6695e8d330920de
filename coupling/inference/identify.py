"""Unknowns of a structure from measured signals: a global search, least squares, intervals and verdicts."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr
from scipy.signal import medfilt

from coupling.cosimulation import CoSimulation
from coupling.inference.features import Features
from coupling.inference.identification import Identification
from coupling.inference.intervals import YIELD, Judgement
from coupling.inference.measured import measured_signal
from coupling.inference.misfit import GAIN, OF_SENSORS, OFFSET, TIME_ZERO, Measured, Misfit
from coupling.inference.plates import FREQUENCY, Build, on_modes
from coupling.inference.prediction import Prediction, Range, range_of, usual_length
from coupling.inference.search import MANY, NEARLY, RUNS_NEARBY, RUNS_OF_LINE, WELL_SCANNED, GlobalSearch
from coupling.inference.surrogate import FIRST_WAVE
from coupling.sweeps.progress import Progress
from coupling.sweeps.sweep import check_build
from structures.caution import caution
from structures.checks import finite, not_negative, one_of, positive, short, whole
from structures.linear_algebra.one_thread import one_thread
from structures.structure import Vector
from structures.units import factor, readable

SCANNED = {1: 16, 2: 32, 3: 64}
"""Points of the scan over all ranges by the number of unknowns; MOST_SCANNED for more."""

MOST_SCANNED = 128

COARSEST = 4.0
"""Samples of a contact that a signal must have."""

COMPARE = ("waveform", "features")
"""What of a signal can be compared."""

RUNS_OF_END = 10
"""Runs of a typical fit after its scan, for each unknown: fits took 0.8 to 1.3 times as many in all."""

LONG_TIME = 300.0
"""The time (s) of which the user is warned."""

OF_MANY = (
    f"identify: without a guess a fit of {MANY} unknowns or more may end at a wrong minimum that explains the signal; "
    "fit again with another seed and compare"
)


def identify(
    signal: xr.Dataset,
    build: Callable[..., CoSimulation],
    nuisances: Iterable[str] = (GAIN, TIME_ZERO),
    sensors: Iterable[int] | None = None,
    until: float | None = None,
    noise: float | Mapping[int, float] | None = None,
    starts: int = 3,
    scan: int | None = None,
    seed: int = 0,
    guess: Mapping[str, float] | None = None,
    discrepancy: float = 0.0,
    compare: str = "waveform",
    **ranges: Any,
) -> Identification:
    """Find unknowns of a structure, or of the chain, from a measured or simulated signal, with 95 % intervals.

    Parameters
    ----------
    signal : Dataset
        A signal of `read_signal` or `as_signal`, or a run.
    build : callable
        Takes the unknowns by name and returns the CoSimulation of one chain. Large structures are reduced; a builder
        that uses `half_plane` or `ModalPlate` is faster. Where a builder strikes `plate.at(x, y)` of a plate that
        `ModalPlate` covers, its modes take the place of a mesh for each run.
    nuisances : sequence of str
        What is not known either, but of no interest. Of the sensors: "gain" (of each), "time_zero" (the impact is at
        this time of the signal), "offset" (of each, N), "time_constant" (of the sensors' high-pass, s). A name of
        `ranges` may stand here, too, such as "impact_speed"; it is treated as any unknown.
    sensors : sequence of int, optional
        Beads whose traces are compared; by default all of a signal. A run needs them.
    until : float, optional
        The record counts up to this time after the impact, s; by default four times what a wave takes through the
        chain, or what the structure was made for. Later records depend on beads that rattle.
    noise : float or mapping, optional
        Standard deviation of a sample, N, of all sensors or sensor → value. By default the variable `noise` of the
        signal, else it is estimated from the quiet lead, or from differences of neighbouring samples.
    starts : int
        Number of minima that are searched to their ground.
    scan : int, optional
        Number of runs of the scan over all ranges; by default 16, 32, 64 and 128 for one, two, three and more unknowns.
        The search goes on between them, on traces that are interpolated, and a few runs check what it finds.
    seed : int
        Of the scan's points.
    guess : mapping, optional
        A value of each unknown near the truth. Least squares start there; of other minima only those within some
        hundred standard deviations of the best fit are looked for.
    discrepancy : float
        Standard deviation of what the model lacks, as a part of the greatest force at each sensor, such as 0.005 for a
        thin plate in place of a thick one. It is correlated over a part of a contact time, so it does not average out
        over the samples as noise does; intervals become wider by it. 0: the model is exact. Of features: a part of
        each AR and TOF.
    compare : {"waveform", "features"}
        Whether all samples are compared, or only AR and TOF of the primary and secondary wave at each sensor. These do
        not depend on gain and time zero.
    **ranges : tuple of float
        Each unknown that `build` takes, as (lowest, highest) value. A range over more than a factor of ten is searched
        by its logarithm.

    Returns
    -------
    Identification
        Values, intervals, verdicts, correlation, residuals; ``print`` shows a table.

    Raises
    ------
    ValueError
        For signals without samples that count, sensors that are not in the chain, ranges without width, unknowns that
        the builder does not take, records that are too short or too coarse, and where the wave reaches two sensors in
        another order than in a run, as from swapped channels.

    Warns
    -----
    HertzlinkWarning
        If the model does not explain the signal, so that no verdict stands, an unknown is at the end of its range, or
        several fits are as good.

    Notes
    -----
    The misfit is the sum of squares of (measured − gain · predicted − offset)/noise. Intervals come from its curvature;
    where they are wide, or unknowns are correlated, from its profile: the other unknowns are fitted anew at each value.
    Hum, drift, an offset and correlated noise are a part of the noise's covariance where the quiet lead shows them, and
    outliers are left out (`disturbances.py`).
    Noise that was estimated is estimated again from the residual, if that is white. If it is correlated, the model does
    not explain the signal, and no unknown is "identified". The covariance is then that of least squares under noise
    with the autocorrelation of the residual over the whole record, its quiet lead included; it is never smaller than
    for white noise.

    References
    ----------
    Golub and Pereyra, Inverse Problems 19 (2003) R1, on gains and offsets that are projected out.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> def build(modulus, impact_speed):
    ...     wall = hl.half_space(hl.Material(modulus, 0.3, 2000.0))
    ...     return hl.CoSimulation(hl.Chain([bead] * 10, bead, impact_speed), wall)
    >>> run = build(3e9, 0.31).run(5e-4)
    >>> found = hl.identify(run, build, sensors=[5], modulus=(1e9, 10e9), impact_speed=(0.2, 0.5))
    >>> round(found["modulus"].value / 1e9, 2), found["modulus"].identifiable
    (3.0, True)
    """
    names = nuisances_of(nuisances, ranges)
    wanted = [range_of(name, ends) for name, ends in ranges.items()]
    if not wanted:
        raise ValueError("ranges: name at least one unknown of the builder, such as thickness=(1e-3, 6e-3)")
    measured = measured_signal(signal, sensors, noise, OFFSET in names)
    record = float(measured.time[-1] - measured.time[0])
    length = positive("until", until, "s") if until is not None else usual_length(build, wanted, record)
    one_of("compare", compare, COMPARE)
    check_build(build, dict(ranges), "build", "unknowns")

    def fitted(build: Build, ranges: Mapping[str, Any], guess: Any) -> Identification:
        wanted = [range_of(name, ends) for name, ends in ranges.items()]
        prediction = Prediction(build, wanted, measured.sensors, length)
        _check_record(prediction, measured.step, record)
        if compare == "features":
            misfit: Misfit = Features(prediction, measured, length)
        else:
            misfit = Misfit(prediction, measured, names, length)
        count = whole("scan", scan) if scan is not None else SCANNED.get(len(wanted), MOST_SCANNED)
        lines = [k for k, unknown in enumerate(wanted) if unknown.name not in names] or list(range(len(wanted)))
        start = _guess(guess, wanted)
        points = GlobalSearch(misfit, whole("starts", starts), count, whole("seed", seed, 0), start, lines)
        judgement = Judgement(points, not_negative("discrepancy", discrepancy), names)
        runs = likely_runs(len(lines), len(wanted) - len(lines), start is not None, count)
        if start is None:
            _warn_of_time(prediction, runs)
        _check_order(prediction, measured, start)
        inputs = {"unknowns": dict(ranges), "nuisances": names, "until": length, "seed": seed, "compare": compare}
        if "sensor_force" in signal:
            inputs["signal"] = json.loads(str(signal.attrs.get("input", "{}"))) | {
                "conditioning": str(signal.attrs.get("conditioning", "")).splitlines()
            }
        with one_thread, Progress(runs, label="identify", likely=True) as prediction.progress:
            try:
                return judgement.result(inputs)
            finally:
                prediction.progress = None

    ends = {unknown.name: (unknown.low, unknown.high) for unknown in wanted}
    modes = on_modes(build, ends, length)
    identification = fitted(modes or build, ranges, guess)
    if modes is not None:
        if (
            guess is None
        ):  # a plate's many echoes make valleys near the best, which the search over all ranges passes by
            nearby = fitted(modes, ranges, {name: identification[name].value for name in ends})
            runs = identification.runs + nearby.runs
            identification = replace(min(identification, nearby, key=lambda fit: fit.misfit), runs=runs)
        remark = f"whole plate: modes up to {1e-3 * FREQUENCY:g} kHz or more, for all places and thicknesses"
        identification = replace(identification, remarks=[remark])
    for warning in identification.warnings:
        if warning.startswith(YIELD):
            caution(warning)
    if guess is None and len(wanted) >= MANY and identification.explained:
        caution(OF_MANY)
        identification = replace(identification, warnings=[*identification.warnings, OF_MANY])
    return identification


def nuisances_of(nuisances: Iterable[str], ranges: Mapping[str, Any]) -> list[str]:
    """Return the names of nuisances, or raise a ValueError."""
    if not isinstance(nuisances, str | list | tuple | set | frozenset | dict):
        raise ValueError(f"nuisances = {short(nuisances)}: must be a list of names, such as ['gain', 'time_zero']")
    names = [nuisances] if isinstance(nuisances, str) else list(nuisances)
    allowed = (*OF_SENSORS, *ranges)
    for name in names:
        if not isinstance(name, str) or name not in allowed:
            raise ValueError(
                f"nuisances: {short(name)} is none; must be {', '.join(OF_SENSORS)}, or an unknown that has a range"
            )
    return names


def likely_runs(unknowns: int, nuisances: int = 0, guess: bool = False, scan: int | None = None) -> int:
    """Runs of a typical fit; nuisances: that the model has; scan: points of the scan, if not as many as usual."""
    size = unknowns + nuisances
    if guess:
        return RUNS_NEARBY * size
    scanned = SCANNED.get(size, MOST_SCANNED) if scan is None else scan
    return scanned + RUNS_OF_END * size + (NEARLY + (RUNS_OF_LINE if size > WELL_SCANNED else 0)) * unknowns


def _warn_of_time(prediction: Prediction, runs: int) -> None:
    """Warn of builders so slow that the user would wonder."""
    if seconds_of_run(prediction, [0.5]) * runs < LONG_TIME:
        return
    # The first run loads code and fills caches; those after it say what a fit takes.
    spent = seconds_of_run(prediction, [0.3, 0.4, 0.6])
    if spent * runs > LONG_TIME:
        caution(
            f"identify: building and running take {spent:.2g} s; likely about {runs} runs, {spent * runs / 60.0:.0f} "
            "minutes. A builder with half_plane or ModalPlate is faster; guess= needs few runs"
        )


def seconds_of_run(prediction: Prediction, places: Sequence[float]) -> float:
    """Return what building and running take at these places of all ranges, s."""
    begin = perf_counter()
    prediction.traces([np.full(len(prediction.ranges), place) for place in places])
    return (perf_counter() - begin) / len(places)


def _guess(guess: Any, ranges: Sequence[Range]) -> Vector | None:
    if guess is None:
        return None
    names = [unknown.name for unknown in ranges]
    if not isinstance(guess, Mapping) or sorted(guess) != sorted(names):
        raise ValueError(f"guess = {short(guess)}: must give a value for each of {', '.join(names)}")
    for unknown in ranges:
        if not unknown.low <= finite(f"guess[{unknown.name!r}]", guess[unknown.name]) <= unknown.high:
            raise ValueError(
                f"guess[{unknown.name!r}] = {guess[unknown.name]!r}: must be from {unknown.low:g} to {unknown.high:g}"
            )
    return np.array([unknown.place(guess[unknown.name]) for unknown in ranges])


def _check_record(prediction: Prediction, step: float, record: float) -> None:
    contact, wave = prediction.contact_time, prediction.first.chain.transit_time
    if step > contact / COARSEST:
        raise ValueError(
            f"signal: has a sample every {readable(step, 's', 4)}, too coarse for contacts of "
            f"{readable(contact, 's', 4)}; "
            f"sample at {1e-6 * COARSEST / contact:.2g} MHz or more{_other_unit(step, record, contact, wave)}"
        )
    longest = min(record, prediction.until)
    if longest < 0.5 * wave:
        raise ValueError(
            f"signal: {readable(longest, 's', 4)} are compared, but the wave needs about "
            f"{readable(wave, 's', 4)} through the chain; "
            "record longer, or give a longer until"
        )


def _check_order(prediction: Prediction, measured: Measured, start: Vector | None) -> None:
    """Raise a ValueError where the wave reaches two sensors in another order than in a run."""
    if len(measured.sensors) < 2:
        return
    traces = prediction.trace(np.full(len(prediction.ranges), 0.5) if start is None else start)
    if not np.isfinite(traces).all():
        return
    there = [_rises_at(force, measured.step) for force in measured.force]
    expected = [_rises_at(force, prediction.interval) for force in traces]
    for i, j in combinations(range(len(there)), 2):
        seen, usual = there[j] - there[i], expected[j] - expected[i]
        if seen * usual < 0.0 and min(abs(seen), abs(usual)) > 0.5 * prediction.contact_time:
            first, last = (measured.sensors[k] for k in ((i, j) if usual > 0.0 else (j, i)))
            raise ValueError(
                f"signal: the wave reaches sensor {last} {readable(abs(seen), 's', 3)} before sensor {first}, but in "
                f"the chain {readable(abs(usual), 's', 3)} after it; were their channels swapped?"
            )


def _rises_at(force: Vector, step: float) -> float:
    """Return when a force first exceeds a part of its peak, s; a single sample, as an outlier, does not count."""
    smooth = medfilt(np.nan_to_num(force), 3)
    rise = abs(smooth - smooth[1])
    return step * int(np.argmax(rise > FIRST_WAVE * rise.max()))


def _other_unit(step: float, record: float, contact: float, wave: float) -> str:
    """Return the unit in which the times of a signal that is too coarse would suit the chain, as a question."""
    for unit in ("ms", "us"):
        size = float(factor(unit, "s"))
        if size * step <= contact / COARSEST and size * record >= 0.5 * wave:
            return f", or are its times in {unit.replace('u', 'µ')}? Then give time_unit = {unit!r}"
    return ""
