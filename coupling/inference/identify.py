"""Unknowns of a structure from measured signals: a global search, least squares, intervals and verdicts."""

import json
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import Identification
from coupling.inference.intervals import judged
from coupling.inference.measured import measured_signal
from coupling.inference.misfit import GAIN, OF_SENSORS, TIME_ZERO, Misfit
from coupling.inference.plates import FREQUENCY, on_modes
from coupling.inference.prediction import Prediction, range_of, usual_length
from coupling.inference.search import Search
from coupling.inference.settings import SETTINGS
from coupling.sweeps.points import progress
from coupling.sweeps.sweep import check_build
from structures.checks import finite, not_negative, positive, short, whole
from structures.linear_algebra.one_thread import one_thread
from structures.units import readable


@one_thread
def identify(
    signal: xr.Dataset,
    build: Callable[..., CoSimulation],
    nuisances: Iterable[str] = (GAIN, TIME_ZERO),
    sensors: Iterable[int] | None = None,
    until: float | None = None,
    noise: float | Mapping[int, float] | None = None,
    starts: int = 3,
    seed: int = 0,
    guess: Mapping[str, float] | None = None,
    discrepancy: float = 0.0,
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
        What is of no interest: "gain", "offset" (N) and "time_zero" (s) of the sensors, or names of `ranges`.
    sensors : sequence of int, optional
        Beads whose traces are compared; by default all of a signal. A run needs them.
    until : float, optional
        The record counts up to this time after the impact, s; by default four times a wave's way through the chain.
    noise : float or mapping, optional
        Standard deviation of a sample, N, or sensor → value; by default `noise` of the signal, or an estimate.
    starts : int
        Number of points of the scan from which least squares start.
    seed : int
        Of the scan's points.
    guess : mapping, optional
        A value of each unknown near the truth, from which least squares start instead of a scan.
    discrepancy : float
        Standard deviation of what the model lacks, as a part of the greatest force at each sensor, such as 0.005.
    **ranges : tuple of float
        Each unknown as (lowest, highest) value; over more than a factor of ten its logarithm is searched.

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
        For sensors that are not in the chain, unknowns that the builder does not take, and records that are too short
        or too coarse.

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
    measured = measured_signal(signal, sensors, noise)
    record = float(measured.time[-1] - measured.time[0])
    length = positive("until", until, "s") if until is not None else usual_length(build, wanted, record)
    check_build(build, dict(ranges), "build", "unknowns")
    start = None
    if guess is not None:
        if not isinstance(guess, Mapping) or sorted(guess) != sorted(ranges):
            raise ValueError(f"guess = {short(guess)}: must give a value for each of {', '.join(ranges)}")
        for name, low, high in wanted:
            if not low <= finite(f"guess[{name!r}]", guess[name]) <= high:
                raise ValueError(f"guess[{name!r}] = {guess[name]!r}: must be from {low:g} to {high:g}")
        start = np.array([unknown.place(guess[unknown.name]) for unknown in wanted])
    modes = on_modes(build, {unknown.name: (unknown.low, unknown.high) for unknown in wanted}, length)
    prediction = Prediction(modes or build, wanted, [sensor.bead for sensor in measured.sensors], length)
    contact, wave, longest = prediction.contact_time, prediction.first.chain.transit_time, min(record, length)
    if (coarsest := contact / SETTINGS.samples_per_contact) < measured.step:
        units = (("ms", "ms", 1e-3), ("us", "µs", 1e-6))
        fits = [one for one in units if one[2] * measured.step <= coarsest and one[2] * record >= 0.5 * wave]
        raise ValueError(
            f"signal: has a sample every {readable(measured.step, 's', 4)}, too coarse for contacts of "
            f"{readable(contact, 's', 4)}; sample at {1e-6 / coarsest:.2g} MHz or more"
            + "".join(f", or are its times in {shown}? Then give time_unit = {unit!r}" for unit, shown, _ in fits[:1])
        )
    if longest < 0.5 * wave:
        raise ValueError(
            f"signal: {readable(longest, 's', 4)} are compared, but the wave needs about {readable(wave, 's', 4)} "
            "through the chain; record longer, or give a longer until"
        )
    misfit = Misfit(prediction, measured, names, length)
    lines = [k for k, unknown in enumerate(wanted) if unknown.name not in names] or list(range(len(wanted)))
    search = Search(misfit, whole("starts", starts), whole("seed", seed, 0), start, lines)
    inputs = {"unknowns": dict(ranges), "nuisances": names, "until": length, "seed": seed}
    if "sensor_force" in signal:
        conditioning = str(signal.attrs.get("conditioning", "")).splitlines()
        inputs["signal"] = json.loads(str(signal.attrs.get("input", "{}"))) | {"conditioning": conditioning}
    with progress(0, "identify", "run") as prediction.progress:
        found = judged(search, not_negative("discrepancy", discrepancy), names, inputs)
    if modes is not None:
        found.remarks.append(
            f"whole plate: modes up to {1e-3 * FREQUENCY:g} kHz or more, for all places and thicknesses"
        )
    return found


def nuisances_of(nuisances: Iterable[str], ranges: Mapping[str, Any]) -> list[str]:
    """Return the names of nuisances."""
    names = [nuisances] if isinstance(nuisances, str) else list(nuisances)
    for name in names:
        if name not in (*OF_SENSORS, *ranges):
            raise ValueError(
                f"nuisances: {short(name)} is none; must be {', '.join(OF_SENSORS)}, or an unknown that has a range"
            )
    return names
