"""Thousands of runs in memory, in threads: of chains, or of chains on linear structures."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from functools import partial
from threading import local
from typing import Any, NamedTuple, TypeAlias

import joblib
import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.engine import StructureWindows, fill, is_compiled
from coupling.interface import Interface
from coupling.plan import Adaptive, warn_if_coarse
from coupling.recording.frames import Frames, Kept, kept_at
from coupling.results.findings import gathered, kind, one_of_each, warn, with_warnings
from coupling.results.provenance import provenance
from coupling.results.schema import OF_RUNS, variable
from coupling.run_checks import check_before, checked
from coupling.sweeps.points import ENVIRONMENT_ERRORS
from coupling.sweeps.store import ERROR_VARIABLE, Failure
from coupling.sweeps.sweep import axis_labels, check_build
from particles.chain import Chain
from structures.caution import collected
from structures.checks import count_of, function, instance, listed, positive, short, whole
from structures.linear_algebra.one_thread import one_thread
from structures.structure import Structure, Vector

Runs: TypeAlias = Sequence[Chain | CoSimulation] | Callable[..., Chain | CoSimulation]

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
    runs: Runs,
    until: float,
    structure: Structure | None = None,
    save_every: float | None = None,
    sensors: Iterable[int] | None = None,
    dt: float | None = None,
    threads: int | None = None,
    measure: Measure | None = None,
    **parameters: Any,
) -> xr.Dataset:
    """Run many chains of equally many beads in threads, and keep the forces at the sensors, or measures of them.

    The result of a run does not depend on the other runs, nor on the number of threads.

    Parameters
    ----------
    runs : sequence of Chain or CoSimulation, or callable
        What to run. A function returns it from the parameters; it is called for each run in its turn, in any thread.
    until : float
        Length of each record, s.
    structure : Structure, optional
        What the chains of a sequence of chains face; by default nothing.
    save_every : float, optional
        Time between saved samples, s; by default at most 1/32 of the shortest contact of all runs, or of those at the
        ends of each parameter.
    sensors : sequence of int, optional
        Numbers of the beads to keep, each with its two contacts; by default all.
    dt : float, optional
        Time step of chains, s; by default each has its own.
    threads : int, optional
        Number of threads; by default one for each core.
    measure : callable, optional
        Takes the Dataset of some hundred runs and returns what to keep over the dimension "run", such as
        ``lambda runs: hl.amplitude_ratio(runs, sensor=7)``. Then only these runs are in memory at a time.
    **parameters : array_like
        The arguments of the function, each one value for all runs or a list with a value for each run.

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
    >>> dict(taps.contact_force.sizes)["run"]
    3
    >>> [round(force) for force in taps.contact_force.sel(contact=5).max("time").values.tolist()]
    [3, 7, 16]
    """
    until = positive("until", until, "s")
    if measure is not None:
        function("measure", measure, 1, "a function of a Dataset of runs")
    try:
        with collected() as said:
            family = _family(runs, structure, dt, parameters)
    finally:  # an error often follows from what they say, such as a length in mm
        said = one_of_each(said)
        warn(said)
    selection = kept_at(sensors, family.beads)
    if save_every is None:
        save_every = min(family.save_every, until)
    interval = positive("save_every", save_every, "s")
    if interval > until:
        raise ValueError(f"save_every = {save_every!r}: must not be longer than the run, until = {until!r} s")
    rows = int(until / interval * (1.0 + 1e-9)) + 1
    size = rows * float(len(selection.contacts) + len(selection.bodies))
    if size * (family.number if measure is None else 1) > LARGEST_RESULT:
        raise ValueError(
            f"until = {until!r}, save_every = {interval!r}: {size * family.number:.3g} numbers are too many to keep; "
            "give sensors, measure, or a longer save_every"
        )
    # Of a function the first run stands for all.
    first = [*family.known.values()][: 1 if family.build else None]
    for simulation in first:
        _plan(simulation.for_run(until), until, interval)
    before = check_before([simulation.chain for simulation in first], until)
    warn(before)
    before = [*said, *before]
    count = joblib.cpu_count() if threads is None else min(whole("threads", threads), joblib.cpu_count())
    together = family.number if measure is None else max(1, int(LARGEST_MEASURED / size))
    parts, ends = list[xr.Dataset](), list[_End]()
    for begin in range(0, family.number, together):
        part = Records(family.cut(begin, begin + together), until, interval, selection, before)
        part.fill(count)
        ends += part.ends
        parts.append(part.dataset() if measure is None else _measured(measure, part.dataset()))
    return _joined(family, parts, ends, until, before)


def records(
    build: Callable[..., CoSimulation], until: float, interval: float, kept: Kept, beads: int, columns: dict[str, Any]
) -> "Records":
    """Return the runs of a function one after the other, without labels and checks of its arguments, which take as long
    as a run."""
    runs = Records(_Family(len(next(iter(columns.values()))), beads, {}, build, columns), until, interval, kept, ())
    runs.fill(1)
    return runs


class _End(NamedTuple):
    """The end of a run: why it failed, None where it did not, and its findings."""

    failure: Failure | None
    findings: list[str]


class _Family(NamedTuple):
    """All runs: those that exist already, by their place, and the function that makes the others from parameters."""

    number: int
    beads: int
    """In each chain; 0 while not known."""
    known: dict[int, CoSimulation]
    build: Callable[..., Chain | CoSimulation] | None
    parameters: dict[str, list[Any]]

    @property
    def save_every(self) -> float:
        """The time between saved samples, s: whole windows of the run with the shortest contact."""
        shortest = min(self.known.values(), key=lambda simulation: simulation.interface.contact_time)
        wanted, window = shortest.interface.contact_time / FRAMES_PER_CONTACT, shortest.longest_window
        return min(wanted, max(1, int(wanted / window)) * window)

    def cut(self, begin: int, end: int) -> "_Family":
        """Return some of the runs, one after the other."""
        values = {name: column[begin:end] for name, column in self.parameters.items()}
        simulations = {i - begin: simulation for i, simulation in self.known.items() if begin <= i < end}
        return self._replace(number=min(end, self.number) - begin, known=simulations, parameters=values)

    def make(self, i: int) -> CoSimulation:
        """Return a run, or raise a ValueError for one that a batch does not do."""
        if self.build is None or i in self.known:
            return self.known[i]
        built = self.build(**{name: values[i] for name, values in self.parameters.items()})
        simulation = _simulation("runs(...)", built, None, None)
        if self.beads and len(simulation.chain.chain.beads) != self.beads:
            raise ValueError(f"runs(...): has another number of beads than the {self.beads} of the first run")
        return simulation


def _family(runs: Runs, structure: Structure | None, dt: float | None, parameters: Mapping[str, Any]) -> _Family:
    if not callable(runs):
        if parameters:
            raise ValueError(f"{', '.join(parameters)}: parameters need a function in the place of runs")
        entries = listed("runs", runs, object, "one Chain or CoSimulation or more")
        simulations = [_simulation("runs", entry, structure, dt) for entry in entries]
        lengths = {len(simulation.chain.chain.beads) for simulation in simulations}
        if len(lengths) > 1:
            raise ValueError(f"runs: hold {sorted(lengths)} beads; must have equally many")
        return _Family(len(simulations), lengths.pop(), dict(enumerate(simulations)), None, {})
    for name, value in (("structure", structure), ("dt", dt)):
        if value is not None:
            raise ValueError(f"{name} = {short(value)}: belongs into the function that makes the runs")
    columns = _columns(runs, parameters)
    family = _Family(len(next(iter(columns.values()))), 0, {}, runs, columns)
    # The first run that can be built, which tells the number of beads, and those at the ends of each parameter.
    numbers = [column for column in columns.values() if all(isinstance(value, int | float) for value in column)]
    ends = {column.index(end) for column in numbers for end in (min(column), max(column))}
    errors = list[Exception]()
    for place in range(family.number):
        if family.known and place not in ends:
            continue
        try:
            simulation = family.make(place)
        except ENVIRONMENT_ERRORS:
            raise
        except Exception as error:  # noqa: BLE001 - the user's own code may raise any error
            errors.append(error)
            continue
        family.known[place] = simulation
        family = family._replace(beads=len(simulation.chain.chain.beads))
    if not family.known:
        raise errors[0]
    return family


def _columns(build: Callable[..., Any], parameters: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return a value of each parameter for each run, or raise a ValueError that names the parameter."""
    if not parameters:
        raise ValueError("parameters: name at least one argument of the function, such as impact_speed=[0.1, 0.2]")
    check_build(build, parameters, "runs", "parameters")
    if used := sorted(set(parameters) & (OF_RUNS | {"run", ERROR_VARIABLE})):
        raise ValueError(f"{used[0]}: is a name that every run uses; rename the function's argument")
    one_for_all = "must be one value, or a list with one for each run"
    columns = dict[str, list[Any]]()
    for name, given in parameters.items():
        if isinstance(given, Mapping | Set):
            raise ValueError(f"{name} = {short(given)}: has no order; {one_for_all}")
        if getattr(given, "ndim", 1) > 1:
            raise ValueError(f"{name}: has the shape {given.shape}; {one_for_all}")
        values = given.tolist() if isinstance(given, np.ndarray | xr.DataArray) else given
        if isinstance(values, str) or not isinstance(values, Iterable):
            continue
        columns[name] = list(values)
        if not columns[name]:
            raise ValueError(f"{name}: is empty; {one_for_all}")
        for place, value in enumerate(columns[name]):
            if isinstance(value, list):
                raise ValueError(f"{name}[{place}] = {short(value)}: must be one value of a run; a tuple is one")
            if isinstance(value, float | np.floating) and not np.isfinite(value):
                raise ValueError(f"{name}: is {value} for run {place}; must be finite")
    if len({len(column) for column in columns.values()}) > 1:
        lengths = ", ".join(f"{name} {len(column)}" for name, column in columns.items())
        raise ValueError(f"parameters: have different numbers of values ({lengths}); must have one for each run")
    count = len(next(iter(columns.values()), [None]))
    return {name: columns.get(name) or [given] * count for name, given in parameters.items()}


def _simulation(name: str, run: Any, structure: Structure | None, dt: float | None) -> CoSimulation:
    """Return a run of one chain on linear structures, or raise a ValueError."""
    if isinstance(run, Chain):
        run = CoSimulation(run, structure, dt=dt)
    elif structure is not None or dt is not None:
        which = "structure" if structure is not None else "dt"
        raise ValueError(f"{which}: a CoSimulation has its own; must be None")
    simulation = instance(name, run, CoSimulation, "a Chain or a CoSimulation")
    if len(simulation.interface.chains) > 1:
        raise ValueError(f"{name}: holds a CoSimulation of several chains; use sweep")
    return simulation


def _plan(simulation: CoSimulation, until: float, interval: float) -> Any:
    """Return the plan of a run, with all checks of its times."""
    plan = simulation.plan(until, interval)
    if not is_compiled(simulation.interface, simulation.scheme):
        raise ValueError(
            f"runs: holds {simulation!r}, which the compiled loop cannot run; a batch needs Condensed(), and "
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

    def __init__(self, family: _Family, until: float, interval: float, kept: Kept, before: Sequence[str]) -> None:
        self.family, self.until, self.interval, self.kept, self.before = family, until, interval, kept, before
        count, rows = family.number, int(until / interval * (1.0 + 1e-9)) + 1
        contacts, bodies = len(kept.contacts), len(kept.bodies)
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
        """Run all; after an error of the environment the rest is not run."""
        number = self.family.number
        # The checks need some more contacts and bodies than are kept.
        size = self.force.shape[1] * (self.force.shape[2] + self.velocity.shape[2] + 8)
        many = min(LARGEST_GROUP, int(LARGEST_GROUP_NUMBERS / size), number // (GROUPS_PER_THREAD * threads))
        groups = iter([range(number)[begin : begin + max(1, many)] for begin in range(0, number, max(1, many))])
        ends = dict[int, _End]()

        def work() -> None:
            for group in groups:
                ends.update(self._group(group))

        if threads == 1:
            work()
        else:
            with ThreadPoolExecutor(threads) as pool:
                tasks = [pool.submit(work) for _ in range(threads)]
                try:
                    wait(tasks, return_when=FIRST_EXCEPTION)
                finally:
                    deque(groups, maxlen=0)
            for task in tasks:
                task.result()
        self.ends = [ends[i] for i in range(number)]

    def _group(self, numbers: Sequence[int]) -> dict[int, _End]:
        """Build some runs, then run all, then check all: so the processor finds its code in its caches, and the checks
        see the runs of a chain at once. Errors of runs are returned, those of the environment are raised."""
        messages, findings = {i: list[str]() for i in numbers}, {i: list[str]() for i in numbers}
        earlier = set(map(kind, self.before))
        failures, alike = dict[int, Failure](), dict[Any, list[_Ready]]()

        def tried(runs: Sequence[int], step: Callable[..., Any], *arguments: Any) -> Any:
            """Return what a step of these runs returns; None where it raises an error, of which they fail."""
            with collected() as more:
                answer = None
                try:
                    answer = step(*arguments)
                except ENVIRONMENT_ERRORS:
                    raise
                # The function is the user's own code, which may raise any error; no run may lose the others.
                except Exception as error:  # noqa: BLE001 - see above
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
        return {i: _End(failures.get(i), [*dict.fromkeys(findings[i] + messages[i])]) for i in numbers}

    def _ready(self, i: int, place: int) -> "_Ready":
        """Build a run. place: its place in the group."""
        simulation = self.family.make(i).for_run(self.until)
        interface = simulation.interface
        plan = _plan(simulation, self.until, self.interval)
        findings = check_before(interface.chains, self.until) if self.family.build else []
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

    def _checked(self, runs: "Sequence[_Ready]") -> dict[int, list[str]]:
        """Check runs of one chain, fill their rows, and return the findings of each."""
        interfaces, frames = [run.interface for run in runs], [run.frames for run in runs]
        with collected():  # what it returns, of all runs
            after = checked(interfaces, frames, self.interval)
        numbers, (contacts, bodies), chain = [run.number for run in runs], self.kept, interfaces[0].chains[0]
        self.yields = self.yields or bool(chain.yielding)
        self.static[numbers] = chain.static_force[contacts]
        self.centre[numbers] = chain.once("centres", lambda: chain.chain.centres)[bodies]
        for i, interface, saved in zip(numbers, interfaces, frames, strict=True):
            self.force[i] = saved.chains[0].force[:, : len(contacts)]
            self.velocity[i] = saved.chains[0].velocity[:, : len(bodies)]
            self.energy[i] = interface.chains[0].chain.impact_energy
        return {run.number: run.findings + more for run, more in zip(runs, after, strict=True)}

    def dataset(self) -> xr.Dataset:
        """Return the runs."""
        coordinates: dict[str, Any] = {
            "centre": (("run", "bead"), self.centre, {"units": "m"}),
            "static_force": (("run", "contact"), self.static, {"units": "N"}),
            "impact_energy": ("run", self.energy, {"units": "J"}),
        }
        coordinates |= {name: ("run", axis_labels(values)) for name, values in self.family.parameters.items()}
        data = forces_of_runs(self.kept, self.interval, self.force, self.velocity, coordinates)
        return data.assign_attrs(beads=self.family.beads, **({"yielding": 1} if self.yields else {}))


def forces_of_runs(
    selection: Kept, interval: float, force: Vector, velocity: Vector, coordinates: dict[str, Any]
) -> xr.Dataset:
    """Return the forces and velocities, runs × times × contacts or beads, as a Dataset. interval: between saved times,
    s."""
    measures: dict[str, Any] = {
        "time": ("time", interval * np.arange(float(force.shape[1])), {"units": "s"}),
        "bead": ("bead", selection.bodies),
        "contact": ("contact", [index + 1 for index in selection.contacts]),
    }
    data = {
        "contact_force": variable("contact_force", force.swapaxes(0, 1), "run"),
        "velocity": variable("velocity", velocity.swapaxes(0, 1), "run"),
    }
    return xr.Dataset(data, measures | coordinates).transpose("run", "time", ...)


def _measured(measure: Measure, data: xr.Dataset) -> xr.Dataset:
    measured = measure(data)
    if isinstance(measured, xr.DataArray):
        measured = measured.to_dataset(name=measured.name or "measure")
    result = instance("measure(runs)", measured, xr.Dataset, "a Dataset or a DataArray")
    if result.sizes.get("run") != data.sizes["run"]:
        raise ValueError(f"measure(runs): has the dimensions {dict(result.sizes)}; must keep run: {data.sizes['run']}")
    return result


def _joined(family: _Family, parts: list[xr.Dataset], ends: list[_End], until: float, before: list[str]) -> xr.Dataset:
    data = parts[0] if len(parts) == 1 else xr.concat(parts, "run", data_vars="minimal", coords="minimal")
    inputs = {"first": next(iter(family.known.values())).describe(), "count": family.number, "until": until}
    findings = gathered({f"run {i}": run.findings for i, run in enumerate(ends) if run.findings}, len(ends), "runs")
    reasons = [str(run.failure or "") for run in ends]
    failed, of = sum(map(bool, reasons)), count_of(len(reasons), "run")
    if failed == len(reasons):
        raise RuntimeError(f"all {count_of(failed, 'run')} failed; the first with {reasons[0]}")
    data[ERROR_VARIABLE] = "run", reasons, {"long_name": "why the run failed, empty where it did not"}
    if failed:
        findings = [*findings, f"batch: {failed} of {of} failed, see the variable error"]
    warn(findings)
    return with_warnings(data.assign_attrs(provenance({"batch": inputs})), [*before, *findings])
