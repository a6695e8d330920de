"""Thousands of runs in memory, on all cores: of chains, or of chains on linear structures."""

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Set
from concurrent.futures import FIRST_EXCEPTION, ThreadPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from math import ceil
from threading import local
from typing import Any, NamedTuple, TypeAlias

import joblib
import numpy as np
import xarray as xr
from joblib.externals.loky.process_executor import TerminatedWorkerError

from coupling.cosimulation import CoSimulation
from coupling.engine import StructureWindows, fill, is_compiled
from coupling.interface import Interface
from coupling.plan import Adaptive, Plan, warn_if_coarse
from coupling.recording.frames import Frames, Kept, kept_at
from coupling.results.findings import gathered, kind, one_of_each, warn, with_warnings
from coupling.results.provenance import provenance
from coupling.results.schema import OF_RUNS, variable
from coupling.run_checks import check_before, checked
from coupling.sweeps.processes import ENVIRONMENT_ERRORS, in_parallel
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

MOST_SAVED = 2e8
"""Upper limit for runs × saved times × contacts and beads: 1.6 GB."""

PARTS_OF_PROCESS = 4
"""Parts of the runs for each process: the first that ends takes the next."""

AT_ONCE, NUMBERS_AT_ONCE, MORE_KEPT = 128, 2e6, 8
"""Runs that a thread builds, runs and checks together, and the numbers that they may keep until then: 16 MB. Checks
need some more contacts and bodies than are kept."""

MEASURED_AT_ONCE = 2e7
"""The same for the runs that are measured together: 160 MB."""


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
    jobs: int = 1,
    **parameters: Any,
) -> xr.Dataset:
    """Run many chains of equally many beads in threads, and keep the forces at the sensors, or measures of them.

    The result of a run does not depend on the other runs, nor on the numbers of threads and processes.

    Parameters
    ----------
    runs : sequence of Chain or CoSimulation, or callable
        What to run. A function returns it from the parameters; but for the runs that choose `save_every`, it is called
        for each when its turn comes, in any thread.
    until : float
        Length of each record, s.
    structure : Structure, optional
        What the chains of a sequence of chains face; by default nothing.
    save_every : float, optional
        Time between saved samples, s. By default at most 1/32 of the shortest contact, in whole windows: of all runs;
        of a function, of those with the least and the greatest value of each parameter. A run with a shorter contact
        has windows half as long.
    sensors : sequence of int, optional
        Numbers of the beads to keep, each with its two contacts; by default all. The last bead's second contact is that
        on the structure.
    dt : float, optional
        Time step of chains, s; by default each chain has its own. A CoSimulation has its own.
    threads : int, optional
        Number of threads of a process; by default one for each core, with several processes one.
    measure : callable, optional
        Takes the Dataset of some hundred runs and returns the Dataset or DataArray to keep, with the dimension "run",
        such as ``lambda runs: hl.amplitude_ratio(runs, sensor=7)``. Then only these runs are in memory at a time.
    jobs : int
        Number of processes. The threads of one process wait for each other where Python builds and checks a run;
        processes do not, but each needs some seconds to begin, so they pay from thousands of runs. Within
        ``joblib.parallel_config("dask")`` they are the workers of a cluster.
    **parameters : array_like
        The arguments of the function, each one value for all runs or a list or array with a value for each run.

    Returns
    -------
    xarray.Dataset
        Contact forces (N) and velocities (m/s) as in the Dataset of a run, with a first dimension "run" that has the
        parameters as coordinates; or what `measure` keeps. Measures that need only these, such as `amplitude_ratio`,
        work on it. A run that fails is NaN, and the variable `error` holds the reason; it is empty for the others. The
        attribute `warnings` holds the first finding of each kind.

    Raises
    ------
    ValueError
        If the runs differ in length, a run has several chains or a structure of the user's own, the shapes of the
        parameters do not fit together, or the result is too large.
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
    if size * (family.number if measure is None else 1) > MOST_SAVED:
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
    cores, jobs = joblib.cpu_count(), whole("jobs", jobs)
    many = family.number if measure is None else max(1, int(MEASURED_AT_ONCE / size))
    if jobs > 1:
        many = min(many, ceil(family.number / (PARTS_OF_PROCESS * jobs)))
    at_once = min(cores if jobs == 1 else 1, cores) if threads is None else min(whole("threads", threads), cores)
    begins = range(0, family.number, many)
    parts = (_Part(family.cut(begin, begin + many), until, interval, rows, selection, before) for begin in begins)
    outcomes = list(_in_processes(parts, at_once, measure, min(jobs, len(begins))))
    done = [run for _, ends in outcomes for run in ends]
    return _together(family, [data for data, _ in outcomes], done, until, before)


class Records(NamedTuple):
    """What many runs leave as arrays: contact forces, N, and velocities, m/s, runs × times × contacts or bodies, NaN of
    a run that fails; static forces, N, centres, m, and impact energies, J; all findings, and why some runs failed.
    """

    force: Vector
    velocity: Vector
    static: Vector
    centre: Vector
    energy: Vector
    findings: list[str]
    failures: list[str]


def records(
    build: Callable[..., CoSimulation], until: float, interval: float, kept: Kept, beads: int, columns: dict[str, Any]
) -> Records:
    """Return the runs of a function one after the other, without labels and checks of its arguments, which take as long
    as a run."""
    number, rows = len(next(iter(columns.values()))), int(until / interval * (1.0 + 1e-9)) + 1
    part = _Part(_Family(number, beads, {}, build, columns), until, interval, rows, kept, ())
    runs, done = part.done(1)
    failures = [str(run.failure) for run in done if run.failure]
    findings = [finding for run in done for finding in run.findings]
    return Records(runs.force, runs.velocity, runs.static, runs.centre, runs.energy, findings, failures)


def _in_processes(
    parts: "Iterator[_Part]", threads: int, measure: Measure | None, jobs: int
) -> Iterator[tuple[xr.Dataset, "list[_Done]"]]:
    """Yield the runs of each part, in this process or in others."""
    if jobs == 1:
        yield from (part.run(threads, measure) for part in parts)
        return
    try:
        yield from in_parallel(jobs, (joblib.delayed(part.run)(threads, measure) for part in parts))
    except TerminatedWorkerError as error:
        raise RuntimeError("a process of the batch died; perhaps memory ran out; take fewer jobs") from error
    except BrokenProcessPool:
        raise ValueError(
            f"jobs = {jobs!r}: other processes cannot load the function or what it holds; define it in a module that "
            "they can import, or take jobs=1"
        ) from None


class _Done(NamedTuple):
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
        if self.beads and _beads(simulation) != self.beads:
            raise ValueError(f"runs(...): has another number of beads than the {self.beads} of the first run")
        return simulation


def _beads(simulation: CoSimulation) -> int:
    return len(simulation.chain.chain.beads)


def _family(runs: Runs, structure: Structure | None, dt: float | None, parameters: Mapping[str, Any]) -> _Family:
    if not callable(runs):
        if parameters:
            raise ValueError(f"{', '.join(parameters)}: parameters need a function in the place of runs")
        entries = listed("runs", runs, object, "one Chain or CoSimulation or more")
        simulations = [_simulation("runs", entry, structure, dt) for entry in entries]
        lengths = set(map(_beads, simulations))
        if len(lengths) > 1:
            raise ValueError(f"runs: hold {sorted(lengths)} beads; must have equally many")
        return _Family(len(simulations), lengths.pop(), dict(enumerate(simulations)), None, {})
    for name, value in (("structure", structure), ("dt", dt)):
        if value is not None:
            raise ValueError(f"{name} = {short(value)}: belongs into the function that makes the runs")
    values = _columns(runs, parameters)
    count = len(next(iter(values.values())))
    family = _Family(count, 0, {}, runs, values)
    place, first = _first(family)
    family = family._replace(beads=_beads(first), known={place: first})
    numbers = (column for column in values.values() if all(isinstance(value, int | float) for value in column))
    ends = {column.index(end) for column in numbers for end in (min(column), max(column))}
    family.known.update((i, made) for i in sorted(ends) if isinstance(made := _made(family, i), CoSimulation))
    return family


def _first(family: "_Family") -> tuple[int, CoSimulation]:
    """Return the first run that can be built, and its place; if none can, raise the error of the very first."""
    reasons = list[Exception]()
    for i in range(family.number):
        made = _made(family, i)
        if isinstance(made, CoSimulation):
            return i, made
        reasons.append(made)
    raise reasons[0]


def _made(family: "_Family", i: int) -> CoSimulation | Exception:
    """Return a run, or why it cannot be built."""
    try:
        return family.make(i)
    except ENVIRONMENT_ERRORS:
        raise
    except Exception as error:  # noqa: BLE001 - the user's own code, as in `_Rows.do`
        return error


def _columns(build: Callable[..., Any], parameters: Mapping[str, Any]) -> dict[str, list[Any]]:
    """Return a value of each parameter for each run, or raise a ValueError that names the parameter."""
    if not parameters:
        raise ValueError("parameters: name at least one argument of the function, such as impact_speed=[0.1, 0.2]")
    check_build(build, parameters, "runs", "parameters")
    if used := sorted(set(parameters) & (OF_RUNS | {"run", ERROR_VARIABLE})):
        raise ValueError(f"{used[0]}: is a name that every run uses; rename the function's argument")
    columns = {name: _column(name, value) for name, value in parameters.items()}
    lengths = {name: len(column) for name, column in columns.items() if column is not None}
    if len(set(lengths.values())) > 1:
        shown = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise ValueError(f"parameters: have different numbers of values ({shown}); must have one for each run")
    count = next(iter(lengths.values()), 1)
    return {name: [parameters[name]] * count if column is None else column for name, column in columns.items()}


def _column(name: str, given: Any) -> list[Any] | None:
    """Return the values of a parameter as they are, None for one value; raise a ValueError for what is neither."""
    if isinstance(given, Mapping | Set):
        raise ValueError(f"{name} = {short(given)}: has no order; must be one value, or a list with one for each run")
    single = isinstance(given, str) or not isinstance(given, Iterable)
    if isinstance(given, np.ndarray | xr.DataArray):
        if given.ndim > 1:
            raise ValueError(f"{name}: has the shape {given.shape}; must be one value, or a list with one for each run")
        values, single = np.ravel(given).tolist(), given.ndim == 0
    else:
        values = [given] if single else list(given)
    if not values:
        raise ValueError(f"{name}: is empty; must be one value, or a list with one for each run")
    for place, value in enumerate(values):
        if isinstance(value, list):
            raise ValueError(f"{name}[{place}] = {short(value)}: must be one value of a run; a tuple is one")
        if isinstance(value, float | np.floating) and not np.isfinite(value):
            raise ValueError(f"{name}: is {value} for run {place}; must be finite")
    return None if single else values


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


def _plan(simulation: CoSimulation, until: float, interval: float) -> Plan:
    """Return the plan of a run, with all checks of its times."""
    plan = simulation.plan(until, interval)
    if not is_compiled(simulation.interface, simulation.scheme):
        raise ValueError(
            f"runs: holds {simulation!r}, which the compiled loop cannot run; a batch needs Condensed(), and "
            "linear structures that are small; use reduce, or sweep"
        )
    return plan


class _Part(NamedTuple):
    """Some runs, which are in memory together."""

    family: _Family
    until: float
    interval: float
    rows: int
    kept: Kept
    known: Sequence[str]

    def run(self, threads: int, measure: Measure | None) -> tuple[xr.Dataset, list[_Done]]:
        """Return what is kept of the runs, and how each ended."""
        rows, done = self.done(threads)
        data = rows.dataset()
        return data if measure is None else _measured(measure, data), done

    def done(self, threads: int) -> "tuple[_Rows, list[_Done]]":
        """Return all runs, and how each ended; after an error those that have not begun are not run."""
        rows, number = _Rows(self), self.family.number
        size = self.rows * (len(self.kept.contacts) + len(self.kept.bodies) + MORE_KEPT)
        many = max(1, min(AT_ONCE, int(NUMBERS_AT_ONCE / size), number // (PARTS_OF_PROCESS * threads)))
        left = iter([range(begin, min(begin + many, number)) for begin in range(0, number, many)])
        done = dict[int, _Done]()

        def some() -> None:
            for numbers in left:
                done.update(rows.do(numbers))

        if threads == 1:
            some()
        else:
            with ThreadPoolExecutor(threads) as pool:
                tasks = [pool.submit(some) for _ in range(threads)]
                try:
                    wait(tasks, return_when=FIRST_EXCEPTION)
                finally:
                    deque(left, maxlen=0)
            for task in tasks:
                task.result()
        return rows, [done[i] for i in range(number)]


class _Ready(NamedTuple):
    """A run that is built: its number, what it has in common with runs that are checked together, and findings."""

    number: int
    alike: Any
    interface: Interface
    frames: Frames
    fill: Callable[[], None]
    findings: list[str]


class _Rows:
    """The kept values of the runs of a part."""

    def __init__(self, part: _Part) -> None:
        self.part, self.windows, self.last = part, StructureWindows(), local()
        count, contacts, bodies = part.family.number, len(part.kept.contacts), len(part.kept.bodies)
        self.force = np.full((count, part.rows, contacts), np.nan)
        self.velocity = np.full((count, part.rows, bodies), np.nan)
        self.static, self.centre = np.full((count, contacts), np.nan), np.full((count, bodies), np.nan)
        self.energy, self.yields = np.full(count, np.nan), False

    def do(self, numbers: Sequence[int]) -> dict[int, _Done]:
        """Return how some runs ended; their errors are returned, those of the environment are raised.

        All are built, then all are run, then all are checked: so the processor finds its code in its caches, and the
        checks see the runs of a chain at once.
        """
        messages, findings = {i: list[str]() for i in numbers}, {i: list[str]() for i in numbers}
        earlier = set(map(kind, self.part.known))
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
        return {i: _Done(failures.get(i), [*dict.fromkeys(findings[i] + messages[i])]) for i in numbers}

    def _ready(self, i: int, place: int) -> "_Ready":
        """Build a run. place: among those that are done together."""
        family, until, interval, _, selection, earlier = self.part
        simulation = family.make(i).for_run(until)
        interface = simulation.interface
        plan = _plan(simulation, until, interval)
        findings = check_before(interface.chains, until) if family.build else []
        findings += warn_if_coarse(plan, interface, isinstance(simulation.window, Adaptive))
        alike = id(interface.chains[0].model), plan.rows, len(interface.structures)
        # This thread's last frames in this place serve again if they were of the same chain.
        last: dict[int, Any] = vars(self.last).setdefault("runs", {})
        if place in last and last[place][0] == alike:
            frames = last[place][2].clear()
        else:
            frames = Frames(interface, plan.rows, selection)
            # With the chain: another one could get its number when it is gone.
            last[place] = alike, interface.chains[0], frames
        filled = partial(fill, frames, interface, simulation.scheme, simulation.window, plan, self.windows)
        return _Ready(i, alike, interface, frames, filled, [finding for finding in findings if finding not in earlier])

    def _checked(self, runs: "Sequence[_Ready]") -> dict[int, list[str]]:
        """Check runs of one chain, fill their rows, and return the findings of each."""
        interfaces, frames = [run.interface for run in runs], [run.frames for run in runs]
        with collected():  # what it returns, of all runs
            after = checked(interfaces, frames, self.part.interval)
        numbers, (contacts, bodies), chain = [run.number for run in runs], self.part.kept, interfaces[0].chains[0]
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
        family, selection, interval = self.part.family, self.part.kept, self.part.interval
        coordinates |= {name: ("run", axis_labels(values)) for name, values in family.parameters.items()}
        data = forces_of_runs(selection, interval, self.force, self.velocity, coordinates)
        return data.assign_attrs(beads=family.beads, **({"yielding": 1} if self.yields else {}))


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


def _together(
    family: _Family, parts: list[xr.Dataset], done: list[_Done], until: float, before: list[str]
) -> xr.Dataset:
    data = parts[0] if len(parts) == 1 else xr.concat(parts, "run", data_vars="minimal", coords="minimal")
    inputs = {"first": next(iter(family.known.values())).describe(), "count": family.number, "until": until}
    findings = gathered({f"run {i}": run.findings for i, run in enumerate(done) if run.findings}, len(done), "runs")
    reasons = [str(run.failure or "") for run in done]
    failed, of = sum(map(bool, reasons)), count_of(len(reasons), "run")
    if failed == len(reasons):
        raise RuntimeError(f"all {count_of(failed, 'run')} failed; the first with {reasons[0]}")
    data[ERROR_VARIABLE] = "run", reasons, {"long_name": "why the run failed, empty where it did not"}
    if failed:
        findings = [*findings, f"batch: {failed} of {of} failed, see the variable error"]
    warn(findings)
    return with_warnings(data.assign_attrs(provenance({"batch": inputs})), [*before, *findings])
