"""Unknowns of a structure from measured signals: a global search, least squares, intervals and verdicts."""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import (
    AT_END,
    BLIND,
    DEVIATIONS,
    HALF,
    IDENTIFIED,
    NOT_TRUSTED,
    NUISANCE,
    Identification,
    Unknown,
)
from coupling.inference.measured import Sensor, measured_signal, with_memory
from coupling.inference.misfit import GAIN, OF_SENSORS, TIME_ZERO, Fit, Misfit, unit_covariance
from coupling.inference.plates import on_modes
from coupling.inference.prediction import Prediction, Range, length_of
from coupling.inference.search import MANY, UNLIKELY, Search
from coupling.results.ar_and_tof import reflections
from coupling.results.findings import findings_of, warn
from coupling.results.waves import NoWave
from coupling.sweeps.points import progress
from structures.caution import collected
from structures.checks import count_of, finite, not_negative, short, whole, within
from structures.linear_algebra.one_thread import one_thread
from structures.quantities import Count, Interval, Quantity
from structures.structure import Vector
from structures.units import readable

AT_ONE_END = 1e-6  # A place at most so far from 0 or 1 is at an end of its range.


@one_thread
def identify(
    signal: xr.Dataset,
    build: Callable[..., CoSimulation],
    nuisances: Iterable[str] = (GAIN, TIME_ZERO),
    sensors: Iterable[int] | None = None,
    until: Interval | None = None,
    noise: Annotated[float, Quantity("N", "a force", "0.2 N")] | None = None,
    seed: Annotated[int, Count(0)] = 0,
    guess: Mapping[str, float] | None = None,
    discrepancy: Annotated[float, Quantity(or_zero=True)] = 0.0,
    **ranges: Any,
) -> Identification:
    """Find unknowns of a structure, or of the chain, from a measured or simulated signal, with 95 % intervals.

    Parameters
    ----------
    signal : Dataset
        A signal of `read_signal` or `as_signal`, or a run.
    build : callable
        Takes the unknowns by name and returns the CoSimulation of one chain.
    nuisances : sequence of str
        Unknowns of no interest: "gain", "offset" (N) and "time_zero" (s) of the sensors, or names of `ranges`.
    sensors : sequence of int, optional
        Beads whose traces are compared; by default all of a signal. They must be given for a run.
    until : float, optional
        Time after the impact, s, up to which samples count; by default four times that of a wave through the chain.
    noise : float, optional
        Standard deviation of a sample, N; by default `noise` of the signal, or an estimate.
    seed : int
        Seed of the scan's points.
    guess : mapping, optional
        A value of each unknown near the truth. Least squares start from it instead of a scan.
    discrepancy : float
        Standard deviation of the model's error, as a part of the greatest force at each sensor, such as 0.005.
    **ranges : tuple of float
        Each unknown as (lowest, highest) value. Over more than a factor of ten the search is logarithmic.

    Returns
    -------
    Identification
        Values, intervals, verdicts, correlation, residuals; ``print`` shows a table.

    Warns
    -----
    HertzlinkWarning
        If the model does not explain the signal, several fits are as good, or contacts yield.

    Raises
    ------
    ValueError
        For sensors that the chain does not have, unknowns that `build` does not take, and records too short or coarse.

    Examples
    --------
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
    wanted = list[Range]()
    for name, ends in ranges.items():
        pair = isinstance(ends, tuple | list) and len(ends) == 2
        low, high = (finite(name, end) for end in ends) if pair else (0.0, 0.0)
        if not low < high:
            raise ValueError(f"{name} = {short(ends)}: must be the lowest and the highest value, such as (1e-3, 6e-3)")
        wanted.append(Range(name, low, high))
    measured = measured_signal(signal, sensors, noise)
    record = float(measured.time[-1] - measured.time[0])
    length = length_of(build, wanted, until, "thickness=(1e-3, 6e-3)", record)
    start = None
    if guess is not None:
        if not isinstance(guess, Mapping) or sorted(guess) != sorted(ranges):
            raise ValueError(f"guess = {short(guess)}: must give a value for each of {', '.join(ranges)}")
        for name, low, high in wanted:
            within(f"guess[{name!r}]", guess[name], low, high, or_zero=low <= 0.0 <= high)
        start = np.array([unknown.place(guess[unknown.name]) for unknown in wanted])
    modes = on_modes(build, {unknown.name: (unknown.low, unknown.high) for unknown in wanted}, length)
    prediction = Prediction(modes or build, wanted, [sensor.bead for sensor in measured.sensors], length)

    # The signal may be too coarse or too short, perhaps because its unit of time is wrong.
    contact, wave = prediction.contact_time, prediction.first.chain.transit_time
    if (coarsest := 0.25 * contact) < measured.step:
        units = (("ms", "ms", 1e-3), ("us", "µs", 1e-6))
        fits = [one for one in units if one[2] * measured.step <= coarsest and one[2] * record >= 0.5 * wave]
        doubt = ", or are its times in {}? Then give time_unit = '{}' to read_signal, or times in s to as_signal"
        raise ValueError(
            f"signal: has a sample every {readable(measured.step, 's', 4)}, too coarse for contacts of "
            f"{readable(contact, 's', 4)}; sample at {1e-6 / coarsest:.2g} MHz or more"
            + "".join(doubt.format(shown, unit) for unit, shown, _ in fits[:1])
        )
    if (longest := min(record, length)) < 0.5 * wave:
        raise ValueError(
            f"signal: {readable(longest, 's', 4)} are compared, but a wave needs about {readable(wave, 's', 4)} "
            "through the chain; record longer, or give a longer until"
        )

    lines = [k for k, unknown in enumerate(wanted) if unknown.name not in names] or list(range(len(wanted)))
    search = Search(Misfit(prediction, measured, names), whole("seed", seed, 0), start, lines)
    inputs = {"unknowns": dict(ranges), "nuisances": names, "until": length, "seed": seed}
    if "sensor_force" in signal:
        conditioning = str(signal.attrs.get("conditioning", "")).splitlines()
        inputs["signal"] = json.loads(str(signal.attrs.get("input", "{}"))) | {"conditioning": conditioning}
    with progress(0, "identify", "run") as prediction.progress:
        return _identification(search, not_negative("discrepancy", discrepancy), names, inputs)


def nuisances_of(nuisances: Iterable[str], ranges: Mapping[str, Any]) -> list[str]:
    """Return the names of nuisances as a list, or raise a ValueError for a wrong name."""
    names = [nuisances] if isinstance(nuisances, str) else list(nuisances)
    if wrong := [name for name in names if name not in (*OF_SENSORS, *ranges)]:
        raise ValueError(f"nuisances = {short(wrong[0])}: must be {', '.join(OF_SENSORS)}, or an unknown with a range")
    return names


def _identification(
    search: Search, discrepancy: float, nuisances: Sequence[str], inputs: dict[str, Any]
) -> Identification:
    """Search for the best fit, and judge it. discrepancy: the model's error, as a part of each peak."""
    misfit, prediction, minima = search.misfit, search.misfit.prediction, search.minima()
    best, point, beside = search.settled(minima[0])
    if any(sensor.memory.size for sensor in misfit.measured.sensors):
        # The residual of this fit shows the memory of the noise. With it each sample has another weight: fit again.
        residuals, sensors = misfit.data(best).residual.transpose("sensor", "time").values, list[Sensor]()
        for sensor, residual in zip(misfit.measured.sensors, residuals, strict=True):
            sensors.append(with_memory(sensor, residual) if sensor.memory.size else sensor)
        rivals = [fit.places for fit in minima if fit.misfit < best.misfit + 10.0 * UNLIKELY]
        misfit.count(misfit.measured._replace(sensors=sensors), best.time_zero)
        minima = [search.solved(places) for places in rivals]
        best, point, beside = search.settled(search.solved(best.places))

    covariance, size, explained = misfit.covariance(point, discrepancy)
    modes, intervals = _modes_and_intervals(
        search, best, [*minima, *beside], covariance, unit_covariance(point.columns)
    )
    unknowns = _unknowns(search, best, intervals, covariance, explained, nuisances)
    notes = _notes(search, best, modes, unknowns, size, explained)
    deviations, names = np.sqrt(np.diag(covariance)), misfit.names
    correlation = xr.DataArray(covariance / np.outer(deviations, deviations), {"unknown": names, "other": names})
    values = [prediction.values(mode.places) for mode in modes]
    return Identification(
        unknowns, correlation, misfit.data(best), size, explained, values, prediction.runs, notes, inputs
    )


def _modes_and_intervals(
    search: Search, best: Fit, minima: Iterable[Fit], covariance: Vector, of_unit_noise: Vector
) -> tuple[list[Fit], Vector]:
    """Return the different fits that the noise does not exclude, the best first, and the 95 % intervals of the unknowns
    as places, unknowns × ends, which contain all these fits."""
    variances = np.diag(covariance)[: search.size]
    deviations = np.sqrt(variances)
    inflation = np.maximum(variances / np.diag(of_unit_noise)[: search.size], 1e-6)
    intervals = np.array([search.interval(best, k, covariance, factor) for k, factor in enumerate(inflation.tolist())])

    # Fits within this distance are the same. A valley may be narrower than its curvature says, with another one beside
    # it, so that the distance is short where the interval is.
    reach = np.minimum(3.0 * deviations, 1.5 * abs(intervals - best.places[:, None]).max(axis=1))
    modes = [best]
    for fit in sorted(minima, key=lambda one: one.misfit):
        rise = (fit.misfit - best.misfit) / (UNLIKELY * inflation)  # of χ², in units of an unlikely rise
        different = all((abs(fit.places - mode.places) > reach).any() for mode in modes)
        if rise.min() < 1.0 and different:
            modes.append(fit)
            # The intervals contain it, with its own interval.
            half = DEVIATIONS * deviations * np.sqrt(np.maximum(1.0 - rise, 0.0))
            low, high = np.clip([fit.places - half, fit.places + half], 0.0, 1.0)
            intervals = np.stack([np.minimum(intervals[:, 0], low), np.maximum(intervals[:, 1], high)], axis=1)
    return modes, intervals


def _unknowns(
    search: Search, best: Fit, intervals: Vector, covariance: Vector, explained: bool, nuisances: Sequence[str]
) -> dict[str, Unknown]:
    """Return the builder's unknowns, and the parameters of the sensors, with their intervals and verdicts."""
    misfit, unknowns = search.misfit, dict[str, Unknown]()
    for unknown, place, ends in zip(search.ranges, best.places.tolist(), intervals, strict=True):
        value, low, high = unknown.value(place), unknown.value(ends[0]), unknown.value(ends[1])
        if unknown.name in nuisances:
            verdict = NUISANCE
        elif not explained:
            verdict = NOT_TRUSTED
        elif high - low > HALF * min(2.0 * abs(value), unknown.high - unknown.low):
            verdict = BLIND
        else:
            verdict = AT_END if min(place, 1.0 - place) < AT_ONE_END else IDENTIFIED
        unknowns[unknown.name] = Unknown(unknown.name, value, (low, high), verdict)

    halves = DEVIATIONS * np.sqrt(np.diag(covariance))[search.size :]
    gains = iter(best.gains.tolist())
    for name, half in zip(misfit.names[search.size :], halves.tolist(), strict=True):
        if name == TIME_ZERO:
            late, error = best.time_zero, half * misfit.unit
            unknowns[name] = Unknown(name, late, (late - error, late + error), NUISANCE, "µs", 1e-6)
        else:
            gain = next(gains)
            unknowns[name] = Unknown(name, gain, (gain - half, gain + half), NUISANCE)
    return unknowns


def _notes(
    search: Search, best: Fit, modes: Sequence[Fit], unknowns: Mapping[str, Unknown], size: float, explained: bool
) -> list[str]:
    """Return the notes for the user: those of the runs, and those of the fit, which are also warnings. size: of the
    residual, in units of the noise."""
    misfit, prediction, notes = search.misfit, search.misfit.prediction, list[str]()
    if not explained:
        words = "the model lacks something, and values may be wrong by more than their intervals; correct the model"
        notes += [f"the residual is {size:.3g} times the noise: {words}", *misfit.measured.doubts]

    # Runs of the search may warn of yielding; what counts is the run of the best fit.
    of_runs = [one for one in prediction.warnings.values() if not one.startswith("yield: ")]
    if len(of_runs) < len(prediction.warnings):
        with collected():
            run = prediction.made(**prediction.values(best.places)).run(prediction.until)
        notes += [finding for finding in findings_of(run) if finding.startswith("yield: ")]

    # If the record shows no reflected wave, that is why an unknown is blind.
    if any(one.verdict == BLIND for one in unknowns.values()):
        with collected():
            end = min(float(misfit.measured.time[-1]) - best.time_zero, prediction.until)
            run = prediction.made(**prediction.values(best.places)).run(max(end, prediction.contact_time))
            primary = reflections(run, max(prediction.sensors)).primary
        if isinstance(primary, NoWave):
            of_runs = [one for one in of_runs if not one.startswith("record: ")]
            notes.append(f"blind: {primary.reason}")
    for unknown, place in zip(search.ranges, best.places.tolist(), strict=True):
        if min(place, 1.0 - place) < AT_ONE_END:
            notes.append(f"{unknown.name}: {AT_END}; widen it")

    for name, one in unknowns.items():
        if name.startswith(f"{GAIN} ") and one.interval[1] < 0.0:
            notes.append(
                f"{name} is negative: this sensor's sign is reversed; give it a negative calibration, or swap its wires"
            )
    for row, sensor in enumerate(misfit.measured.sensors):
        if sensor.drifts:
            baseline = misfit.data(best).baseline.values[row][misfit.used[row]]
            part = 50.0 * np.ptp(baseline) / float(abs(best.fitted[row]).max())
            shows = f"the quiet lead shows hum or drift; ± {part:.2g} % of the peak was fitted"
            notes.append(f"sensor {sensor.bead}: {shows}")
        if sensor.memory.size:
            notes.append(
                f"sensor {sensor.bead}: its noise is correlated from sample to sample, as the quiet lead shows, and "
                f"was fitted with a memory of {count_of(sensor.memory.size, 'sample')}"
            )

    if prediction.failed:
        notes.append(f"{prediction.failed} of {prediction.runs} runs failed and were left out")
    if len(modes) > 1:
        notes.append(f"{len(modes)} different fits are as good; the intervals contain all of them")
    if explained and search.guess is None and search.size >= MANY:
        notes.append(
            f"identify: without a guess a fit of {MANY} unknowns or more may end at a wrong minimum that explains the "
            "signal; fit again with another seed and compare"
        )
    warn(notes)
    return [*of_runs, *notes]
