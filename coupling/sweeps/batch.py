"""Thousands of runs in memory, in threads: of chains that face nothing or linear structures."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from threading import local
from typing import Any, NamedTuple, TypeAlias

import joblib
import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.engine import StructureWindows, fill, is_compiled
from coupling.interface import Interface
from coupling.plan import Adaptive, Plan, warn_if_coarse
from coupling.recording.frames import Frames, Kept, kept_at
from coupling.results.findings import gathered, kind, one_of_each, warn, with_warnings
from coupling.results.provenance import provenance
from coupling.results.schema import OF_RUNS, variable
from coupling.run_checks import check_before, checked
from coupling.sweeps.points import POINT_ERRORS
from coupling.sweeps.store import ERROR_VARIABLE, Failure
from coupling.sweeps.sweep import axis_labels, check_build
from structures.caution import collected
from structures.checks import count_of, function, instance, listed, positive, whole
from structures.linear_algebra.one_thread import one_thread
from structures.structure import Vector

Measure: TypeAlias = Callable[[xr.Dataset], xr.Dataset | xr.DataArray]

FRAMES_PER_CONTACT = 32
"""Saved times in the shortest contact, or more: half an interval off its peak, a half-sine is lower by 0.1 %."""

LARGEST_RESULT = 2e8
"""Upper limit for runs × saved times × contacts and beads: 1.6 GB."""

LARGEST_MEASURED = 2e7
"""The same for the runs that are measured together: 160 MB."""

LARGEST_GROUP, LARGEST_GROUP_NUMBERS, GROUPS_PER_THREAD = 128, 2e6, 4
"""Runs that a thread builds, runs and checks together, the numbers that they may keep until then (16 MB), and how many
groups each thread gets at least."""


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
    """Run chains of equally many beads in threads, and keep the forces at the sensors, or measures of them.

    The result of a run depends neither on the other runs nor on the number of threads.

    Parameters
    ----------
    build : callable
        Returns the CoSimulation of a run from its parameters; called for each run, in any thread.
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
        Takes the Dataset of some hundred runs and returns what to keep over the dimension "run", such as
        ``lambda runs: hl.amplitude_ratio(runs, sensor=7)``. Then only these runs are in memory at a time.
    **parameters : array_like
        The arguments of build, each one value for all runs or a list with a value for each run.

    Returns
    -------
    xarray.Dataset
        Contact forces (N) and velocities (m/s) as of a run, with a first dimension "run" that has the parameters as
        coordinates; or what `measure` keeps. A run that fails is NaN, and the variable `error` holds the reason. The
        attribute `warnings` holds the first finding of each kind.

    Raises
    ------
    ValueError
        If the runs differ in length, have several chains or structures of the user's own, or the result is too large.
    RuntimeError
        If all runs fail.

    Notes
    -----
    Every run has the windows and steps of its own contacts. Give the CoSimulation of a family a `window` and `dt`, and
    their results change smoothly with the parameters.

    Examples
    --------
    >>> import hertzlink as hl
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
            family = _family(build, columns)
    finally:  # an error often follows from what they say, such as a length in mm
        said = one_of_each(said)
        warn(said)
    kept, first = kept_at(sensors, family.beads), next(iter(family.known.values()))
    if save_every is None:  # whole windows of the run with the shortest contact
        shortest = min(family.known.values(), key=lambda simulation: simulation.interface.contact_time)
        wanted, window = shortest.interface.contact_time / FRAMES_PER_CONTACT, shortest.longest_window
        save_every = min(until, wanted, max(1, int(wanted / window)) * window)
    interval = positive("save_every", save_every, "s")
    if interval > until:
        raise ValueError(f"save_every = {save_every!r}: must not be longer than the run, until = {until!r} s")
    count, size = family.number, _rows(until, interval) * float(len(kept.contacts) + len(kept.bodies))
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
    parts, ends = list[xr.Dataset](), list[_End]()
    for begin in range(0, count, together):
        part = Records(family, range(begin, min(begin + together, count)), until, interval, kept, before)
        part.fill(cores)
        ends += part.ends
        parts.append(part.dataset() if measure is None else _measured(measure, part.dataset()))

    data = parts[0] if len(parts) == 1 else xr.concat(parts, "run", data_vars="minimal", coords="minimal")
    findings = gathered({f"run {i}": run.findings for i, run in enumerate(ends) if run.findings}, count, "runs")
    reasons = [str(run.failure or "") for run in ends]
    failed = sum(map(bool, reasons))
    if failed == count:
        raise RuntimeError(f"all {count_of(count, 'run')} failed; the first with {reasons[0]}")
    if failed:
        findings.append(f"batch: {failed} of {count_of(count, 'run')} failed, see the variable error")
    warn(findings)
    data[ERROR_VARIABLE] = "run", reasons, {"long_name": "why the run failed, empty where it did not"}
    inputs = {"first": first.describe(), "count": count, "until": until}
    return with_warnings(data.assign_attrs(provenance({"batch": inputs})), [*before, *findings])


def records(
    build: Callable[..., CoSimulation], until: float, interval: float, kept: Kept, beads: int, columns: dict[str, Any]
) -> "Records":
    """Return the runs of a function one after the other, without labels and checks of its arguments, which take as long
    as a run."""
    family = _Family(build, columns, {}, beads)
    runs = Records(family, range(family.number), until, interval, kept, ())
    runs.fill(1)
    return runs


def _rows(until: float, interval: float) -> int:
    return int(until / interval * (1.0 + 1e-9)) + 1


class _End(NamedTuple):
    """The end of a run: why it failed, None where it did not, and its findings."""

    failure: Failure | None
    findings: list[str]


class _Family(NamedTuple):
    """All runs: the function that makes them, the values of its parameters, those that exist already, by their number,
    and the number of beads in each chain, 0 while not known."""

    build: Callable[..., CoSimulation]
    columns: dict[str, list[Any]]
    known: dict[int, CoSimulation]
    beads: int

    @property
    def number(self) -> int:
        return len(next(iter(self.columns.values())))

    def make(self, i: int) -> CoSimulation:
        """Return a run, or raise a ValueError for one that a batch does not do."""
        if i in self.known:
            return self.known[i]
        built = self.build(**{name: values[i] for name, values in self.columns.items()})
        instance("build(...)", built, CoSimulation, "a CoSimulation")
        if len(built.interface.chains) > 1:
            raise ValueError("build(...): is a CoSimulation of several chains; use sweep")
        if self.beads and len(built.chain.chain.beads) != self.beads:
            raise ValueError(f"build(...): has another number of beads than the {self.beads} of the first run")
        return built


def _family(build: Callable[..., CoSimulation], columns: dict[str, list[Any]]) -> _Family:
    """Return the runs, of which the first that can be built, and those at the ends of each parameter, are built."""
    family = _Family(build, columns, {}, 0)
    numbers = [column for column in columns.values() if all(isinstance(value, int | float) for value in column)]
    ends = {column.index(end) for column in numbers for end in (min(column), max(column))}
    errors = list[Exception]()
    for place in range(family.number):
        if family.known and place not in ends:
            continue
        try:
            family.known[place] = family.make(place)
        except POINT_ERRORS as error:
            errors.append(error)
        else:
            family = family._replace(beads=len(family.known[place].chain.chain.beads))
    if not family.known:
        raise errors[0]
    return family


def _columns(build: Callable[..., Any], parameters: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return a value of each parameter for each run, or raise a ValueError that names the parameter."""
    if not parameters:
        raise ValueError("parameters: name at least one argument of build, such as impact_speed=[0.1, 0.2]")
    check_build(build, parameters, names="parameters")
    if used := sorted(set(parameters) & (OF_RUNS | {"run", ERROR_VARIABLE})):
        raise ValueError(f"{used[0]}: is a name that every run uses; rename the function's argument")
    columns = dict[str, list[Any]]()
    for name, given in parameters.items():
        values = given.tolist() if isinstance(given, np.ndarray | xr.DataArray) else given
        if isinstance(values, Iterable) and not isinstance(values, str):
            columns[name] = listed(name, values, object, "values, one for each run")
    if len({len(column) for column in columns.values()}) > 1:
        lengths = ", ".join(f"{name} {len(column)}" for name, column in columns.items())
        raise ValueError(f"parameters: have different numbers of values ({lengths}); must have one for each run")
    count = len(next(iter(columns.values()), [None]))
    return {name: columns.get(name) or [given] * count for name, given in parameters.items()}


def _plan(simulation: CoSimulation, until: float, interval: float) -> Plan:
    """Return the plan of a run, with all checks of its times."""
    plan = simulation.plan(until, interval)
    if not is_compiled(simulation.interface, simulation.scheme):
        raise ValueError(
            f"build(...) = {simulation!r}: cannot run in the compiled loop; a batch needs Condensed(), and "
            "linear structures that are small; use reduce, or sweep"
        )
    return plan


class _Ready(NamedTuple):
    """A run that is built: its number, what it has in common with runs that are checked together, and findings."""

    number: int
    alike: Any
    interface: Interface
    frames: Frames
    fill: Callable[[], None]
    findings: list[str]


class Records:
    """Runs that are in memory together: contact forces, N, and velocities, m/s, runs × times × contacts or bodies, NaN
    of a run that fails; static forces, N, centres, m, and impact energies, J.

    before: findings that the user knows already. ends: how the runs ended.
    """

    def __init__(
        self, family: _Family, numbers: range, until: float, interval: float, kept: Kept, before: Sequence[str]
    ) -> None:
        self.family, self.numbers, self.before = family, numbers, before
        self.until, self.interval, self.kept = until, interval, kept
        count, rows, contacts, bodies = len(numbers), _rows(until, interval), len(kept.contacts), len(kept.bodies)
        self.force = np.full((count, rows, contacts), np.nan)
        self.velocity = np.full((count, rows, bodies), np.nan)
        self.static, self.centre = np.full((count, contacts), np.nan), np.full((count, bodies), np.nan)
        self.energy, self.yields = np.full(count, np.nan), False
        self.windows, self.of_thread, self.ends = StructureWindows(), local(), list[_End]()

    @property
    def columns(self) -> tuple[Vector, ...]:
        """The arrays, in the order above."""
        return self.force, self.velocity, self.static, self.centre, self.energy

    @property
    def failures(self) -> list[str]:
        """Why some runs failed."""
        return [str(end.failure) for end in self.ends if end.failure]

    @property
    def findings(self) -> list[str]:
        """All findings."""
        return [finding for end in self.ends for finding in end.findings]

    def fill(self, threads: int) -> None:
        """Run all; after an error that is not of a run the rest is not run."""
        # The checks need some more contacts and bodies than are kept.
        size = self.force.shape[1] * (self.force.shape[2] + self.velocity.shape[2] + 8)
        most = len(self.numbers) // (GROUPS_PER_THREAD * threads)
        many = max(1, min(LARGEST_GROUP, int(LARGEST_GROUP_NUMBERS / size), most))
        groups = [self.numbers[begin : begin + many] for begin in range(0, len(self.numbers), many)]
        if threads == 1:
            ends = map(self._group, groups)
        else:
            ends = joblib.Parallel(threads, require="sharedmem", batch_size=1)(map(joblib.delayed(self._group), groups))
        self.ends = [end for of_group in ends for end in of_group]

    def _group(self, numbers: range) -> list[_End]:
        """Build some runs, then run all, then check all: so the processor finds its code in its caches, and the checks
        see the runs of a chain at once. Errors of runs are returned, all others are raised."""
        messages, findings = {i: list[str]() for i in numbers}, {i: list[str]() for i in numbers}
        earlier = set(map(kind, self.before))
        failures, alike = dict[int, Failure](), dict[Any, list[_Ready]]()

        def tried(runs: Sequence[int], step: Callable[..., Any], *arguments: Any) -> Any:
            """Return what a step of these runs returns; None where it raises an error, of which they fail."""
            with collected() as more:
                answer = None
                try:
                    answer = step(*arguments)
                except POINT_ERRORS as error:
                    failures.update(dict.fromkeys(runs, Failure(type(error).__name__, str(error))))
            for i in runs:
                messages[i] += [message for message in more if kind(message) not in earlier]
            return answer

        ready = [tried([i], self._ready, i, place) for place, i in enumerate(numbers)]
        for run in filter(None, ready):
            tried([run.number], run.fill)
            if run.number not in failures:
                alike.setdefault(run.alike, []).append(run)
        for runs in alike.values():
            findings.update(tried([run.number for run in runs], self._checked, runs) or {})
        return [_End(failures.get(i), [*dict.fromkeys(findings[i] + messages[i])]) for i in numbers]

    def _ready(self, i: int, place: int) -> _Ready:
        """Build a run. place: its place in the group."""
        simulation = self.family.make(i).for_run(self.until)
        interface = simulation.interface
        plan = _plan(simulation, self.until, self.interval)
        findings = check_before(interface.chains, self.until)
        findings += warn_if_coarse(plan, interface, isinstance(simulation.window, Adaptive))
        alike = id(interface.chains[0].model), plan.rows, len(interface.structures)
        # This thread's last frames in this place serve again if they were of the same chain.
        last: dict[int, Any] = vars(self.of_thread).setdefault("runs", {})
        if place in last and last[place][0] == alike:
            frames = last[place][2].clear()
        else:
            frames = Frames(interface, plan.rows, self.kept)
            # With the chain: another one could get its number when it is gone.
            last[place] = alike, interface.chains[0], frames
        filled = partial(fill, frames, interface, simulation.scheme, simulation.window, plan, self.windows)
        return _Ready(i, alike, interface, frames, filled, [line for line in findings if line not in self.before])

    def _checked(self, runs: Sequence[_Ready]) -> dict[int, list[str]]:
        """Check runs of one chain, fill their rows, and return the findings of each."""
        interfaces, frames = [run.interface for run in runs], [run.frames for run in runs]
        with collected():  # what it returns, of all runs
            after = checked(interfaces, frames, self.interval)
        (contacts, bodies), chain = self.kept, interfaces[0].chains[0]
        rows = [run.number - self.numbers.start for run in runs]
        self.yields = self.yields or bool(chain.yielding)
        self.static[rows] = chain.static_force[contacts]
        self.centre[rows] = chain.once("centres", lambda: chain.chain.centres)[bodies]
        for row, interface, saved in zip(rows, interfaces, frames, strict=True):
            self.force[row] = saved.chains[0].force[:, : len(contacts)]
            self.velocity[row] = saved.chains[0].velocity[:, : len(bodies)]
            self.energy[row] = interface.chains[0].chain.impact_energy
        return {run.number: run.findings + more for run, more in zip(runs, after, strict=True)}

    def dataset(self) -> xr.Dataset:
        """Return the runs, with their parameters as coordinates."""
        rows = slice(self.numbers.start, self.numbers.stop)
        coordinates: dict[str, Any] = {
            "time": ("time", self.interval * np.arange(float(self.force.shape[1])), {"units": "s"}),
            "bead": ("bead", self.kept.bodies),
            "contact": ("contact", [index + 1 for index in self.kept.contacts]),
            "centre": (("run", "bead"), self.centre, {"units": "m"}),
            "static_force": (("run", "contact"), self.static, {"units": "N"}),
            "impact_energy": ("run", self.energy, {"units": "J"}),
        }
        coordinates |= {name: ("run", axis_labels(values[rows])) for name, values in self.family.columns.items()}
        data = {
            "contact_force": variable("contact_force", self.force.swapaxes(0, 1), "run"),
            "velocity": variable("velocity", self.velocity.swapaxes(0, 1), "run"),
        }
        yielding = {"yielding": 1} if self.yields else {}
        attributes = {"beads": self.family.beads, **yielding}
        return xr.Dataset(data, coordinates, attributes).transpose("run", "time", ...)


def _measured(measure: Measure, data: xr.Dataset) -> xr.Dataset:
    measured = measure(data)
    if isinstance(measured, xr.DataArray):
        measured = measured.to_dataset(name=measured.name or "measure")
    result = instance("measure(runs)", measured, xr.Dataset, "a Dataset or a DataArray")
    if result.sizes.get("run") != data.sizes["run"]:
        raise ValueError(f"measure(runs): has the dimensions {dict(result.sizes)}; must keep run: {data.sizes['run']}")
    return result
