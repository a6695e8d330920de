"""Thousands of runs in memory, in threads, of chains that face linear structures or nothing."""

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from typing import Any, TypeAlias

import joblib
import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.engine import fill, is_compiled
from coupling.plan import Adaptive, Plan, warn_if_coarse
from coupling.recording.frames import Frames, Kept, kept_at
from coupling.results.findings import gathered, kind, one_of_each, warn, with_warnings
from coupling.results.provenance import provenance
from coupling.results.schema import OF_RUNS, run_coordinates, variable
from coupling.run_checks import check_before, checked
from coupling.sweeps.points import POINT_ERRORS
from coupling.sweeps.store import ERROR_VARIABLE, Failure
from coupling.sweeps.sweep import axis_labels, built_at, check_build
from structures.caution import collected
from structures.checks import count_of, function, instance, listed, positive, whole
from structures.linear_algebra.one_thread import one_thread

Measure: TypeAlias = Callable[[xr.Dataset], xr.Dataset | xr.DataArray]
Columns: TypeAlias = dict[str, list[Any]]

FRAMES_PER_CONTACT = 32
"""Least number of saved times in the shortest contact: half an interval from its peak a half-sine is lower by 0.1 %."""

LARGEST_RESULT = 2e8
"""Largest number of runs × saved times × contacts and beads: 1.6 GB."""

LARGEST_MEASURED = 2e7
"""The same for the runs that are measured together: 160 MB."""


@one_thread
def batch(
    build: Callable[..., CoSimulation],
    until: float,
    save_every: float | None = None,
    sensors: Iterable[int] | None = None,
    threads: int | None = None,
    measure: Measure | None = None,
    **parameters: Any,
) -> xr.Dataset:
    """Run chains with the same number of beads in threads, and keep the forces at the sensors, or measures of them.

    The result of a run depends neither on the other runs nor on the number of threads.

    Parameters
    ----------
    build : callable
        Returns the CoSimulation of a run from its parameters; it is called for each run, in any thread.
    until : float
        Length of each record, s.
    save_every : float, optional
        Time between saved samples, s; by default at most 1/32 of the shortest contact of the runs at the ends of each
        parameter.
    sensors : sequence of int, optional
        Numbers of the beads to keep, each with its two contacts; by default all.
    threads : int, optional
        Number of threads; by default one for each core.
    measure : callable, optional
        Takes the Dataset of some hundred runs and returns what to keep, over the dimension "run", such as
        ``lambda runs: hl.amplitude_ratio(runs, sensor=7)``. Only these runs are then in memory at a time.
    **parameters : array_like
        The arguments of build, each one value for all runs or a list with a value for each run.

    Returns
    -------
    xarray.Dataset
        Contact forces (N) and velocities (m/s) like those of a run, with a first dimension "run" that has the
        parameters as coordinates; or what `measure` keeps. A failed run is NaN, and the variable `error` holds the
        reason. The attribute `warnings` holds the first finding of each kind.

    Raises
    ------
    ValueError
        If the runs differ in length, have several chains or structures of the user's own, or the result is too large.
    RuntimeError
        If all runs fail.

    Notes
    -----
    Every run has windows and steps that suit its own contacts. If all runs should change smoothly with the parameters,
    give the CoSimulations the same `window` and `dt`.

    Examples
    --------
    >>> bead = hl.Sphere(2.38e-3, hl.STEEL_440C)
    >>> rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.05, 9.525e-3)]), until=2e-4)
    >>> def tap(speed):
    ...     return hl.CoSimulation(hl.Chain([bead] * 8, bead, impact_speed=speed), rod)
    >>> taps = hl.batch(tap, until=2e-4, sensors=[5], speed=[0.1, 0.2, 0.4])
    >>> [round(force) for force in taps.contact_force.sel(contact=5).max("time").values.tolist()]
    [3, 7, 16]
    """
    until = positive("until", until, "s")
    if measure is not None:
        function("measure", measure, 1, "a function of a Dataset of runs")
    columns = _columns(build, parameters)
    try:
        with collected() as said:
            known = _first_and_ends(build, columns)
    finally:  # also before an error, which often follows from a finding, such as a length in mm
        said = one_of_each(said)
        warn(said)
    first = next(iter(known.values()))
    beads, count = len(first.chain.chain.beads), len(next(iter(columns.values())))
    kept = kept_at(sensors, beads)
    if save_every is None:  # a number of whole windows of the run with the shortest contact
        shortest = min(known.values(), key=lambda simulation: simulation.interface.contact_time)
        wanted, window = shortest.interface.contact_time / FRAMES_PER_CONTACT, shortest.longest_window
        save_every = min(until, wanted, max(1, int(wanted / window)) * window)
    interval = positive("save_every", save_every, "s")
    size = (until / interval + 1.0) * (len(kept.contacts) + len(kept.bodies))
    if size * (count if measure is None else 1) > LARGEST_RESULT:
        raise ValueError(
            f"until = {until!r}, save_every = {interval!r}: {size * count:.3g} numbers are too many to keep; "
            "give sensors, measure, or a longer save_every"
        )
    _plan(first.for_run(until), until, interval)
    before = check_before([first.chain], until)
    warn(before)
    before = [*said, *before]
    cores = joblib.cpu_count() if threads is None else min(whole("threads", threads), joblib.cpu_count())
    together = count if measure is None else max(1, int(LARGEST_MEASURED / size))
    parts, findings, reasons = list[xr.Dataset](), list[list[str]](), list[str]()
    for begin in range(0, count, together):
        some = {name: values[begin : begin + together] for name, values in columns.items()}
        built = {place - begin: simulation for place, simulation in known.items()}
        runs = Records(build, some, until, interval, kept, beads, built, before)
        runs.fill(cores)
        findings += runs.findings
        reasons += [str(failure or "") for failure in runs.failures]
        parts.append(runs.dataset() if measure is None else as_measures(measure(runs.dataset()), runs.count))

    data = parts[0] if len(parts) == 1 else xr.concat(parts, "run", data_vars="minimal", coords="minimal")
    said = gathered({f"run {i}": lines for i, lines in enumerate(findings) if lines}, count, "runs")
    failed = sum(map(bool, reasons))
    if failed == count:
        raise RuntimeError(f"all {count_of(count, 'run')} failed; the first with {reasons[0]}")
    if failed:
        said.append(f"batch: {failed} of {count_of(count, 'run')} failed, see the variable error")
    warn(said)
    data[ERROR_VARIABLE] = "run", reasons, {"long_name": "why the run failed, empty where it did not"}
    inputs = {"first": first.describe(), "count": count, "until": until}
    return with_warnings(data.assign_attrs(provenance({"batch": inputs})), [*before, *said])


def _columns(build: Callable[..., Any], parameters: Mapping[str, Any]) -> Columns:
    """Return the values of each parameter, one for each run, or raise a ValueError that names the parameter."""
    check_build(build, parameters, "parameters", "impact_speed=[0.1, 0.2]")
    if used := sorted(set(parameters) & (OF_RUNS | {"run", ERROR_VARIABLE})):
        raise ValueError(f"{used[0]}: is a name that every run uses; rename this argument of build")
    columns: Columns = {}
    for name, given in parameters.items():
        values = given.tolist() if isinstance(given, np.ndarray | xr.DataArray) else given
        if isinstance(values, Iterable) and not isinstance(values, str):
            columns[name] = listed(name, values, object, "values, one for each run")
    if len({len(column) for column in columns.values()}) > 1:
        lengths = ", ".join(f"{name} {len(column)}" for name, column in columns.items())
        raise ValueError(f"parameters: have different numbers of values ({lengths}); must have one for each run")
    count = len(next(iter(columns.values()), [None]))
    return {name: columns.get(name) or [given] * count for name, given in parameters.items()}


def _made(build: Callable[..., CoSimulation], columns: Columns, i: int, beads: int) -> CoSimulation:
    """Return the CoSimulation of a run; a ValueError if a batch cannot run it. beads: of a chain, 0 if unknown."""
    built = built_at(build, {name: values[i] for name, values in columns.items()})
    if beads and len(built.chain.chain.beads) != beads:
        raise ValueError(f"build(...): has another number of beads than the first run, which has {beads}")
    return built


def _first_and_ends(build: Callable[..., CoSimulation], columns: Columns) -> dict[int, CoSimulation]:
    """Return the first run that can be built, and those at the ends of each parameter, by their numbers."""
    numbers = [column for column in columns.values() if all(isinstance(value, int | float) for value in column)]
    ends = {column.index(end) for column in numbers for end in (min(column), max(column))}
    known, errors, beads = dict[int, CoSimulation](), list[Exception](), 0
    for i in range(len(next(iter(columns.values())))):
        try:
            if not known or i in ends:
                known[i] = _made(build, columns, i, beads)
                beads = len(known[i].chain.chain.beads)
        except POINT_ERRORS as error:
            errors.append(error)
    if not known:
        raise errors[0]
    return known


def _plan(simulation: CoSimulation, until: float, interval: float) -> Plan:
    """Return the plan of a run, or raise a ValueError if its times do not fit, or the compiled loop cannot run it."""
    plan = simulation.plan(until, interval)
    if not is_compiled(simulation.interface, simulation.scheme):
        raise ValueError(
            f"build(...) = {simulation!r}: cannot run in the compiled loop; a batch needs Condensed() and small linear "
            "structures; use reduce, or sweep"
        )
    return plan


class Records:
    """Runs that are in memory together: contact forces, N, and velocities, m/s, over runs × times × contacts or bodies,
    NaN for a failed run; static forces, N, centres, m, and impact energies, J. known: runs that have been built, by
    their numbers. before: findings that the user has seen; findings: of each run. failures: why a run failed, None if
    it did not."""

    def __init__(
        self, build: Callable[..., CoSimulation], columns: Columns, until: float, interval: float, kept: Kept,
        beads: int, known: Mapping[int, CoSimulation] | None = None, before: Sequence[str] = (),
    ) -> None:  # fmt: skip
        self.build, self.columns, self.beads, self.known, self.before = build, columns, beads, known or {}, before
        self.until, self.interval, self.kept = until, interval, kept
        self.count, rows = len(next(iter(columns.values()))), int(until / interval * (1.0 + 1e-9)) + 1
        self.force = np.full((self.count, rows, len(kept.contacts)), np.nan)
        self.velocity = np.full((self.count, rows, len(kept.bodies)), np.nan)
        self.static = np.full((self.count, len(kept.contacts)), np.nan)
        self.centre = np.full((self.count, len(kept.bodies)), np.nan)
        self.energy, self.yields = np.full(self.count, np.nan), False
        self.failures: list[Failure | None] = [None] * self.count
        self.findings = [list[str]() for _ in range(self.count)]

    def fill(self, threads: int) -> None:
        """Run all. An error that does not concern one run alone ends this."""
        numbers, together = range(self.count), max(1, min(16, self.count // (4 * threads)))
        if threads == 1:
            for i in numbers:
                self._run(i)
        else:
            joblib.Parallel(threads, require="sharedmem", batch_size=together)(map(joblib.delayed(self._run), numbers))

    def _run(self, i: int) -> None:
        """Build a run, run it, check it, and fill its rows; keep its warnings, and the error if it fails."""
        found = list[str]()
        with collected() as messages:
            try:
                built = self.known.get(i) or _made(self.build, self.columns, i, self.beads)
                simulation = built.for_run(self.until)
                interface, plan = simulation.interface, _plan(simulation, self.until, self.interval)
                found += check_before(interface.chains, self.until)
                found += warn_if_coarse(plan, interface, isinstance(simulation.window, Adaptive))
                found = [line for line in found if line not in self.before]
                frames = Frames(interface, plan.rows, self.kept)
                fill(frames, interface, simulation.scheme, simulation.window, plan)
                with collected():  # the checks also return their warnings
                    found += checked(interface, frames, self.interval)
                (contacts, bodies), chain, saved = self.kept, interface.chains[0], frames.chains[0]
                self.yields = self.yields or bool(chain.yielding)
                self.static[i] = chain.static_force[contacts]
                self.centre[i] = chain.once("centres", lambda chain: chain.chain.centres)[bodies]
                self.force[i], self.velocity[i] = saved.force[:, contacts], saved.velocity
                self.energy[i] = chain.chain.impact_energy
            except POINT_ERRORS as error:
                self.failures[i] = Failure(type(error).__name__, str(error))
        earlier = set(map(kind, self.before))
        found += [message for message in messages if kind(message) not in earlier]
        self.findings[i] = [*dict.fromkeys(found)]

    def dataset(self) -> xr.Dataset:
        """Return the runs, with their parameters as coordinates."""
        (contacts, bodies), times = self.kept, self.interval * np.arange(float(self.force.shape[1]))
        coordinates = run_coordinates(times, bodies, contacts, self.centre, self.static, self.energy, ["run"])
        coordinates |= {name: ("run", axis_labels(values)) for name, values in self.columns.items()}
        data = {
            "contact_force": variable("contact_force", self.force.swapaxes(0, 1), "run"),
            "velocity": variable("velocity", self.velocity.swapaxes(0, 1), "run"),
        }
        yielding = {"yielding": 1} if self.yields else {}
        return xr.Dataset(data, coordinates, {"beads": self.beads, **yielding}).transpose("run", "time", ...)


def as_measures(values: Any, count: int, taken: Container[Any] = ()) -> xr.Dataset:
    """Return a measure of some runs as a Dataset. An array with no name, or a name in `taken`, is called "measure"."""
    if isinstance(values, xr.DataArray):
        values = values.to_dataset(name="measure" if not values.name or values.name in taken else values.name)
    measures = instance("measure(runs)", values, xr.Dataset, "a Dataset or a DataArray")
    if measures.sizes.get("run") != count:
        raise ValueError(f"measure(runs): has the dimensions {dict(measures.sizes)}; must keep run: {count}")
    return measures
