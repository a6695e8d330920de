"""Runs of one simulation whose quantities vary as arrays: no Python for a run, on processors or on a GPU."""

from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any, NamedTuple

import joblib
import numba
import numpy as np
import xarray as xr

from coupling.compiled_run import Engine
from coupling.cosimulation import CoSimulation
from coupling.kernels.families import Family, do_runs
from coupling.kernels.loop import OK
from coupling.kernels.recorders import Sensors
from coupling.recording.frames import Kept, kept_at, middle_of
from coupling.results.ar_and_tof import SMALLEST_WAVE
from coupling.results.waves_of_runs import Series, find_waves
from coupling.sweeps.batch import MEASURED_AT_ONCE, MOST_SAVED, batch, count_of_runs, finished, forces_of_runs
from coupling.sweeps.progress import Progress
from coupling.sweeps.varied import Varied
from particles.moving import MovingChain
from structures.checks import instance, one_of, positive, short, whole
from structures.kernels.families import Rows
from structures.kernels.linear import Oscillators
from structures.linear_algebra.one_thread import one_thread
from structures.structure import Vector

KEEP = "waves", "forces"

DEVICES = "cpu", "gpu"

WAVES = "primary", "secondary"
"""The reflected waves that are measured."""

FILLED = "force", "velocity", "deepest", "highest"
"""What the recorder fills."""

PEAK = 48
"""Bytes of work space for each peak that a record may have, on a GPU."""


@one_thread
def vary(
    simulation: CoSimulation,
    until: float,
    quantities: Mapping[str, Any],
    sensors: Iterable[int] | None = None,
    keep: str = "waves",
    save_every: float | None = None,
    threads: int | None = None,
    device: str = "cpu",
) -> xr.Dataset:
    """Run one simulation many times while its quantities vary as arrays, without Python for each run.

    All runs have the windows and steps that the shortest contact in the ranges needs, so results are smooth functions
    of the quantities. What else would have to be built anew for each run cannot vary here: give a function to `batch`.

    Parameters
    ----------
    simulation : CoSimulation
        One chain of rigid beads on linear structures.
    until : float
        Length of each record, s.
    quantities : dict of array_like
        The values of each quantity, one for each run, by its path as in the section [sweep] of a case file:
        "chain.impact_speed"; "chain.bead.radius" of all beads where they are equal, and of a striker like them,
        "chain.beads[3].radius" and "chain.striker.radius" of one, also of "….material.youngs_modulus",
        "….material.poisson_ratio" and "….material.density"; "chain.dissipation.coefficient" or another number of the
        loss; of a reduced Kirchhoff plate "structure.thickness", "structure.material.youngs_modulus" and
        "structure.material.density". SI units. At most 8.
    sensors : sequence of int, optional
        Numbers of the beads at which waves are measured, or whose forces are kept; by default the bead in the middle.
    keep : {"waves", "forces"}
        AR and TOF of the first two waves that come back, or the forces and velocities, as `batch` keeps them.
    save_every : float, optional
        Time between saved samples, s. By default at most 1/32 of the shortest contact, in whole windows.
    threads : int, optional
        Number of threads; by default one for each core.
    device : {"cpu", "gpu"}
        Where to run: on a GPU of NVIDIA each run has a thread. It needs ``hertzlink[gpu]``.

    Returns
    -------
    Dataset
        `amplitude_ratio` and `time_of_flight` (s) over "run", "sensor" and "wave", NaN where there is no such wave; or
        the Dataset of a batch. The quantities are coordinates. A run that fails is NaN, and `error` holds the reason.
        The attribute `warnings` holds what the runs at the corners of the ranges warned of.

    Raises
    ------
    ValueError
        For quantities that cannot vary, values that no run can have, numbers of values that differ, a result that is
        too large, and for a device that is not there.

    Examples
    --------
    >>> import hertzlink as hl
    >>> import numpy as np
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> tap = hl.CoSimulation(hl.Chain([bead] * 10, bead, 0.3), hl.half_space(hl.PTFE), accuracy="screening")
    >>> waves = hl.vary(tap, 8e-4, {"chain.impact_speed": np.linspace(0.2, 0.4, 3)}, sensors=[6])
    >>> flight = waves.time_of_flight.sel(sensor=6, wave="primary")
    >>> (1e6 * flight).round(0).values.tolist()  # µs
    [372.0, 343.0, 324.0]
    """
    instance("simulation", simulation, CoSimulation, "a CoSimulation")
    until = positive("until", until, "s")
    one_of("keep", keep, KEEP)
    gpu = _gpu() if one_of("device", device, DEVICES) == "gpu" else None
    varied = Varied(simulation, _columns(quantities))
    chain = simulation.chain
    selection = kept_at([middle_of(chain)] if sensors is None else sensors, len(chain.chain.beads))
    # What the runs at the corners warn of, and their plans' checks.
    ends = batch(varied.corners, until, save_every=save_every, sensors=selection.bodies)
    interval = float(ends.time[1]) if save_every is None else save_every
    runs = FamilyRuns(varied, until, interval, selection, (1 + len(WAVES)) * (keep == "waves"), SMALLEST_WAVE)
    size = runs.plan.rows * float(sum(map(len, selection)))
    if keep == "forces" and size * varied.count > MOST_SAVED:
        raise ValueError(f'keep = "forces": {size * varied.count:.3g} numbers are too many; give a longer save_every')
    many = max(1, int(MEASURED_AT_ONCE / size)) if gpu is None else runs.at_once(gpu)
    cores = joblib.cpu_count()
    at_once = cores if threads is None else min(whole("threads", threads), cores)
    begins, parts = range(0, varied.count, many), []
    with Progress(len(begins), label="vary", unit="part") as progress:
        for begin in begins:
            part = varied.cut(begin, begin + many)
            done = runs.on_processors(part, min(at_once, part.count)) if gpu is None else runs.on_gpu(gpu, part)
            parts.append(runs.mended(done, part))
            progress.advance()
    return _dataset(runs, varied, parts, until, ends.attrs["warnings"].splitlines())


def _gpu() -> Any:
    """Return the module that runs on a GPU, or raise a ValueError that says what is missing."""
    try:
        installed = version("numba-cuda")
    except PackageNotFoundError:
        raise ValueError('device = "gpu": needs the package numba-cuda; install hertzlink[gpu]') from None
    try:
        gpu = import_module("coupling.sweeps.gpu")
        if not numba.config.ENABLE_CUDASIM:  # type: ignore[attr-defined]
            import_module("numba.cuda.np.arrayobj")  # else the first kernel would fail
    except (AttributeError, ImportError) as error:
        raise ValueError(
            f'device = "gpu": numba-cuda {installed} and numpy {np.__version__} do not work together ({error}); '
            "hertzlink[gpu] takes versions that do"
        ) from None
    if not gpu.cuda.is_available():
        raise ValueError('device = "gpu": no GPU of NVIDIA can be used here; take device = "cpu"')
    return gpu


def _columns(quantities: Mapping[str, Any]) -> dict[str, Vector]:
    """Return the values of each quantity as an array, or raise a ValueError."""
    if not isinstance(quantities, Mapping) or not quantities:
        raise ValueError(
            f'quantities = {short(quantities)}: must be values by path, such as {{"chain.impact_speed": [0.2, 0.3]}}'
        )
    columns = dict[str, Vector]()
    for name, values in quantities.items():
        where = f"quantities: {name}"
        try:
            column = np.asarray(values, dtype=float)
        except (TypeError, ValueError):
            raise ValueError(f"{where} = {short(values)}: must be numbers, one for each run, in SI units") from None
        if column.ndim != 1 or not column.size:
            raise ValueError(f"{where}: has the shape {column.shape}; must be a list of numbers, one for each run")
        if not np.isfinite(column).all():
            place = int(np.flatnonzero(~np.isfinite(column))[0])
            raise ValueError(f"{where}: is {column[place]} for run {place}; must be finite")
        columns[str(name)] = column
    count_of_runs("quantities", columns)
    return columns


class Outcome(NamedTuple):
    """The kept values of some runs."""

    runs: int
    force: Vector
    """Runs × saved times × contacts, N; no runs where waves are measured."""
    velocity: Vector
    """Runs × saved times × bodies, m/s."""
    waves: Vector
    """Runs × sensors × waves × 2: amplitude, N, and arrival, s. NaN where there is none."""
    failed: list[int]
    """The runs that the loop did not end."""
    reasons: dict[int, str] = {}  # noqa: RUF012 - never changed
    """Why runs failed that could not be mended."""


class FamilyRuns:
    """The runs of a family: windows, steps and tolerance are the strictest of all corners.

    varied: the quantities. until, interval: length of the runs and time between saved times, s. kept: contacts and
    bodies to keep. waves: how many waves are measured at each sensor; 0 keeps forces and velocities. smallest: the
    smallest wave, in units of the incident one.
    """

    def __init__(
        self, varied: Varied, until: float, interval: float, selection: Kept, waves: int, smallest: float
    ) -> None:
        corners = varied.corners
        plans = [corner.plan(until, interval) for corner in corners]
        chains = [corner.interface.chains[0] for corner in corners]
        step = min(chain.longest_step if chain.dt is None else chain.dt for chain in chains)
        shortest = int(np.argmin([plan.length for plan in plans]))
        simulation, self.plan = corners[shortest].replace(dt=step), plans[shortest]
        self.interface, self.kept, self.waves, self.smallest = simulation.interface, selection, waves, smallest
        self.until = until
        rows, contacts, bodies = self.plan.rows, len(selection.contacts), len(selection.bodies)
        self.recorder: Any = Sensors(
            np.array(selection.contacts), np.array(selection.bodies), np.array([(0, 0), (contacts, bodies)]),
            np.zeros((rows, contacts)), np.zeros((rows, bodies)),
            np.zeros(self.chain.mass.size), np.zeros(self.interface.size),
        )  # fmt: skip
        scheme: Any = simulation.scheme
        self.engine = Engine(self.interface, scheme, self.plan, self.recorder)
        # Both are in proportion to the scales of a run.
        softest, smallest_way = (
            min(getattr(corner.interface, name) / getattr(self.interface, name) for corner in corners)
            for name in ("force_scale", "indentation_scale")
        )
        search = self.engine.search
        self.search = search._replace(tolerance=search.tolerance * softest, still=search.still * smallest_way)
        self.time: Vector = self.plan.interval * np.arange(float(self.plan.rows))
        places = {contact: place for place, contact in enumerate(selection.contacts)}
        self.seats = np.array([(places[n - 1], places[n], body) for body, n in enumerate(selection.bodies) if n])

    def on_processors(self, varied: Varied, threads: int) -> Outcome:
        """Do some of the runs in threads."""
        runs = varied.count
        filled = {name: np.zeros((runs, *getattr(self.recorder, name).shape)) for name in FILLED}
        recorder = self.recorder._replace(**{name: Rows(values, 1) for name, values in filled.items()})
        family, ended = self._family(varied, _row)._replace(recorder=recorder), np.zeros(runs, np.int64)
        ends = np.linspace(0, runs, threads + 1).astype(int).tolist()

        def do(first: int, last: int) -> None:
            state = family._replace(run=self.engine.start(), trial=self.engine.work_space())
            do_runs(state, first, last, *self._rest, ended)

        with ThreadPoolExecutor(threads) as pool:
            list(pool.map(do, ends[:-1], ends[1:]))
        force, velocity = filled["force"], filled["velocity"]
        failed = np.flatnonzero(ended != OK).tolist()
        if not self.waves:
            return Outcome(runs, force, velocity, np.zeros(0), failed)
        return Outcome(runs, force[:0], velocity[:0], self._waves(force, velocity), failed)

    def on_gpu(self, gpu: Any, varied: Varied) -> Outcome:
        """Do some of the runs on a GPU."""
        runs, engine, recorder_of_run = varied.count, self.engine, self.recorder
        recorder = recorder_of_run._replace(
            **{name: gpu.columns(getattr(recorder_of_run, name), runs) for name in FILLED}
        )
        state = {"run": gpu.columns(engine.start(), runs), "trial": gpu.columns(engine.trial, runs)}
        family = gpu.on_device(self._family(varied, gpu.column)._replace(recorder=recorder, **state))
        failed = np.flatnonzero(gpu.do_runs(family, runs, self._rest) != OK).tolist()
        force, velocity = family.recorder.force, family.recorder.velocity
        if self.waves:
            peaks = gpu.waves(force, velocity, self.time, self.static, self.seats, self.smallest, self.waves)
            return Outcome(runs, np.zeros(0), np.zeros(0), peaks[..., :2], failed)
        host = [np.moveaxis(rows.values.copy_to_host(), -1, 0) for rows in (force, velocity)]
        return Outcome(runs, host[0], host[1], np.zeros(0), failed)

    def mended(self, done: Outcome, varied: Varied) -> Outcome:
        """Return the outcome with the runs that the loop did not end done alone, in windows that may be halved."""
        reasons = dict[int, str]()
        for number in done.failed:
            try:
                run = varied.at(number).run(self.until, self.plan.interval, sensors=self.kept.bodies)
            except (ValueError, RuntimeError, FloatingPointError) as error:
                reasons[number] = f"{type(error).__name__}: {error}"
                for values in (done.force, done.velocity, done.waves):
                    values[number : number + 1] = np.nan
                continue
            force, velocity = run.contact_force.values[None], run.velocity.values[None]
            if self.waves:
                done.waves[number] = self._waves(force, velocity)[0]
            else:
                done.force[number], done.velocity[number] = force[0], velocity[0]
        return done._replace(reasons=reasons)

    def at_once(self, gpu: Any) -> int:
        """Return how many runs the memory of the GPU holds at a time."""
        filled = [getattr(self.recorder, name) for name in FILLED]
        size = gpu.bytes_of((self.engine.start(), self.engine.trial, *filled))
        size += PEAK * (self.plan.rows // 2 + 1) * (self.waves > 0)
        return int(np.clip(gpu.free_memory() / (2.0 * size), gpu.THREADS, gpu.MOST_AT_ONCE))

    @property
    def chain(self) -> MovingChain:
        """The chain, but for the numbers that vary."""
        return self.interface.chains[0]

    @property
    def static(self) -> Vector:
        """The static forces of the contacts that are kept, N."""
        forces: Vector = self.chain.static_force[list(self.kept.contacts)]
        return forces

    @property
    def _rest(self) -> tuple[Any, ...]:
        """The arguments of `do_run` after the number of a run."""
        engine, chain = self.engine, self.chain.chain
        windows = 1, (self.plan.rows - 1) * engine.stride, engine.stride, 0
        return 0 if chain.body else 1, engine.interface.begin, engine.length, windows

    def _family(self, varied: Varied, layout: Callable[[Vector], Any]) -> Family:
        """Return the family of some of the runs, without state; layout: makes numbers of the runs a part of it."""
        engine, chain = self.engine, self.engine.chains[0]
        structure, contacts = engine.of_length(engine.length)
        model, start = varied.model(engine.length), self.chain.start()

        def part(values: Any, of_runs: Vector | None) -> Any:
            return layout(np.asarray(values, float)[..., None] if of_runs is None else of_runs)

        changes: dict[str, Any] = {
            "inverse_mass": part(chain.inverse_mass, model.inverse_mass),
            "springs": (chain.springs[0], part(chain.springs[1], model.flexibility)),
        }
        if hasattr(chain.law, "stiffness"):
            changes["law"] = chain.law._replace(stiffness=part(chain.law.stiffness, model.stiffness))
        if hasattr(chain.loss, "coefficient"):
            changes["loss"] = chain.loss._replace(coefficient=part(chain.loss.coefficient, model.coefficient))
        if isinstance(structure, Oscillators):
            of_runs, compliance = model.structure, None
            if of_runs is not None:
                compliance = np.zeros((*contacts.compliance.shape, varied.count))
                for i in range(of_runs.contact.shape[1]):  # a sum's order would depend on the number of runs
                    compliance += of_runs.contact[:, None, i] * of_runs.response[None, :, i]
            contacts = contacts._replace(compliance=part(contacts.compliance, compliance))
            arrays = {
                name: part(getattr(structure, name), getattr(of_runs, name, None))
                for name in ("rows", "response", "contact", "squares")
            }
            structure = structure._replace(**arrays)
        return Family(
            None, (chain._replace(**changes),), structure, contacts, self.search, None, None, start.position,
            part(start.velocity.max(), model.speed),
        )  # fmt: skip

    def _waves(self, force: Vector, velocity: Vector) -> Vector:
        """Return amplitude and arrival of the waves at the sensors, runs × sensors × waves × 2."""
        static = np.broadcast_to(self.static, (len(force), self.static.size))
        waves = np.empty((len(force), len(self.seats), self.waves, 2))
        for above, below, body in self.seats:
            contacts = slice(above, below + 1)
            series = Series(force[..., contacts], static[:, contacts], velocity[..., body])
            measured = find_waves(self.time, series, self.smallest, self.waves)
            waves[:, body] = np.stack([measured.amplitude, measured.arrival], axis=-1)
        return waves


def _row(values: Vector) -> Rows:
    """Return numbers whose last axis is that of the runs with the runs first.

    All runs may have the same: whatever varies, one loop is compiled.
    """
    return Rows(np.ascontiguousarray(np.moveaxis(values, -1, 0)), int(values.shape[-1] > 1))


def _dataset(runs: FamilyRuns, varied: Varied, parts: list[Outcome], until: float, before: list[str]) -> xr.Dataset:
    """Return the results of all parts."""
    coordinates: dict[str, Any] = {name: ("run", column) for name, column in varied.columns.items()}
    if runs.waves:
        waves = np.concatenate([part.waves for part in parts])
        coordinates |= {"sensor": list(runs.kept.bodies), "wave": list(WAVES)}
        dims = "run", "sensor", "wave"
        ratio = waves[..., 1:, 0] / waves[..., :1, 0]
        flight = waves[..., 1:, 1] - waves[..., :1, 1]
        data: dict[str, Any] = {
            "amplitude_ratio": (dims, ratio, {"units": "1", "long_name": "amplitude ratio"}),
            "time_of_flight": (dims, flight, {"units": "s", "long_name": "time of flight"}),
        }
        runs_data = xr.Dataset(data, coordinates)
    else:
        coordinates["static_force"] = "contact", runs.static, {"units": "N"}
        force, velocity = (np.concatenate([getattr(part, name) for part in parts]) for name in FILLED[:2])
        runs_data = forces_of_runs(runs.kept, runs.plan.interval, force, velocity, coordinates)
    errors = [parts[i].reasons.get(n, "") for i in range(len(parts)) for n in range(parts[i].runs)]
    inputs = {"first": varied.simulation.describe(), "quantities": list(varied.columns), "until": until}
    runs_data = runs_data.assign_attrs(beads=len(runs.chain.chain.beads))
    return finished("vary", runs_data, errors, inputs | {"count": varied.count}, before, [])
