"""How far the mesh of a plate changes the traces that are compared with a signal."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from coupling.inference.identification import Identification
from coupling.results.measures import sensor_force
from hertzlink.cases.building import simulation_of, world_of
from hertzlink.cases.case import Case
from hertzlink.cases.plates import RectanglePlate
from hertzlink.cases.questions import Builder, Question, texts
from plates.reduced import MOST_VECTORS
from structures.caution import collected
from structures.reduction import reduce
from structures.structure import Structure, Vector

TOLERATED = 0.3
"""Standard deviations by which a mesh for twice the frequency may move an unknown: an interval then covers the truth in
94 instead of 95 of 100 cases. The difference of the traces does not tell: thousands of samples make a shift of seven
standard deviations of 0.1 times the noise."""

DOUBTFUL = 1.0
"""Standard deviations from which the shift is a warning."""

MOST_UNKNOWNS = 40_000
"""Unknowns of the largest mesh: a basis of 1500 vectors on half of them fills 0.5 GB."""

STEP = 1e-3
"""Part of a value by which it is moved to find the slope of the trace."""

TOLERANCE = 1e-3
"""Of the reduction that is compared with. The default, 1e-2, moves an unknown by half a standard deviation."""

SAMPLES = 2000
"""Times at which two traces are compared."""

PEAK_NOISE = 0.01
"""Noise as a part of the peak, where only features are compared and the noise of samples does not count."""


@dataclass(frozen=True)
class Difference:
    """What another mesh changes: the trace, root mean square, in parts of the noise; unknowns, in their deviations."""

    change: float
    shifts: dict[str, float]

    @property
    def worst(self) -> float:
        """The largest shift."""
        return max(self.shifts.values())

    def __str__(self) -> str:
        name = max(self.shifts, key=lambda one: self.shifts[one])
        return (
            f"changes the trace by {self.change:.1g} times the noise and {name} by {self.worst:.1g} standard deviations"
        )


@dataclass(frozen=True)
class Fit:
    """A fit of the whole plate; frequency: Hz, that its meshes resolve; basis: whether one serves all runs, with these
    warnings.
    """

    question: Question
    found: Identification
    build: Builder
    frequency: float
    basis: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """Values of the unknowns."""
        return {name: self.found[name].value for name in self.question.ranges}

    @property
    def case(self) -> Case:
        """The case with these values."""
        return self.question.case.changed(texts(self.question, self.values))

    def on_mesh(self, frequency: float) -> Structure | None:
        """The plate on a mesh of its own for a frequency, Hz; None where that mesh is too large."""
        return on_own_mesh(self.case, frequency)

    def difference(self, structure: Structure) -> Difference:
        """What this structure changes, to first order."""
        trace, noise, slope = self._linear
        other = (trace_of(self.question, self.case, structure) - trace) / noise
        change = float(np.sqrt(np.mean(other**2, axis=1)).max())
        moved = np.linalg.lstsq(slope, other.ravel(), rcond=None)[0]
        deviation = np.sqrt(np.diag(np.linalg.pinv(slope.T @ slope)))
        part = np.sqrt(self._samples / SAMPLES) * np.abs(moved) / deviation
        wanted = [name for name in self.values if name not in self.question.nuisances]
        return Difference(change, {name: float(part[list(self.values).index(name)]) for name in wanted})

    @cached_property
    def _linear(self) -> tuple[Vector, Vector, Vector]:
        """The trace, its noise, and the slopes of the trace over noise, samples × parameters, in unit columns: unknowns
        are of different sizes.
        """
        trace = self.trace({})
        noise = self._noise(trace)
        slopes = [((self.trace({name: 1.0}) - self.trace({name: -1.0})) / noise).ravel() for name in self.values]
        if "time_zero" in self.question.nuisances:
            slopes.append((np.gradient(trace, axis=1) / noise).ravel())
        if "gain" in self.question.nuisances:
            for i in range(len(trace)):
                own = np.zeros_like(trace)
                own[i] = (trace / noise)[i]
                slopes.append(own.ravel())
        slope = np.stack(slopes, axis=1)
        return trace, noise, slope / np.linalg.norm(slope, axis=0)

    def trace(self, steps: dict[str, float]) -> Vector:
        """The trace, with some values moved by so many STEP."""
        values = {name: value * (1.0 + STEP * steps.get(name, 0.0)) for name, value in self.values.items()}
        with collected():
            structure = self.build(**values).structure.structure
        return trace_of(self.question, self.question.case.changed(texts(self.question, values)), structure)

    @property
    def _samples(self) -> float:
        """Samples of the signal in the time that is predicted."""
        if "time" not in self.found.data.dims:
            return SAMPLES
        step = float(self.found.data.time[1] - self.found.data.time[0])
        return float(self.case.model.run.until / step)

    def _noise(self, trace: Vector) -> Vector:
        """Noise over gain, N, of each sensor."""
        noise = PEAK_NOISE * np.abs(trace).max(axis=1)
        if "sensor" in self.found.data.noise.dims:
            gains = [self.found.unknowns.get(f"gain {sensor}") for sensor in self.question.columns]
            size = np.array([1.0 if gain is None else abs(gain.value) for gain in gains])
            noise = self.found.data.noise.sel(sensor=list(self.question.columns)).values / size
        return np.asarray(noise)[:, None]

    @cached_property
    def of_finer(self) -> Difference | None:
        """What a mesh for twice the frequency changes; None where that mesh is too large."""
        fine = self.on_mesh(2.0 * self.frequency)
        return None if fine is None else self.difference(fine)

    def finer(self) -> bool:
        """Whether a finer mesh is needed, and fits."""
        return self.of_finer is not None and self.of_finer.worst > TOLERATED

    def remarks(self) -> list[str]:
        """How the whole plate was modelled, and how accurate that is: a warning where it is not enough."""
        body = self.case.model.structure
        assert isinstance(body, RectanglePlate)
        if body.cells is not None:
            return [f"whole plate: a mesh of {body.cells[0]} × {body.cells[1]} cells, as the case says; not checked"]
        kind = "one basis (ReducedPlate) on a mesh" if self.basis else "a mesh of its own for each run,"
        model = f"whole plate: {kind} for {1e-3 * self.frequency:g} kHz"
        difference = self.of_finer
        if difference is None:
            large = f"a finer one has more than {MOST_UNKNOWNS} unknowns, so its accuracy is not known"
            return [f"warning: {model}; {large}", *(f"warning: {one}" for one in self.warnings)]
        said = [f"{model}; one for {2e-3 * self.frequency:g} kHz {difference}"]
        if difference.worst > DOUBTFUL:
            # What the basis lacks is in the difference; its warnings say why.
            said = [f"warning: {said[0]}", *(f"warning: {one}" for one in self.warnings)]
        own = frequency_of(self.case)
        plain = self.on_mesh(own) if own < self.frequency else None
        if plain is not None and (difference := self.difference(plain)).worst > TOLERATED:
            said.append(
                f"a run of this case, on a mesh for {1e-3 * own:g} kHz, {difference}: simulate traces with "
                f'structure.highest_frequency = "{1e-3 * self.frequency:g} kHz"'
            )
        return said


def trace_of(question: Question, case: Case, structure: Structure | None) -> Vector:
    """What the sensors read on this structure, sensors × times, N."""
    until = case.model.run.until
    # The notes of a fit hold the warnings of its runs.
    with collected():
        run = simulation_of(case.model, case.folder, {"structure": structure}).run(until)
    times = np.linspace(0.0, until, SAMPLES)
    return np.stack([np.interp(times, run.time, sensor_force(run, sensor)) for sensor in question.columns])


def frequency_of(case: Case) -> float:
    """The highest frequency, Hz, of the plate of a case, given or by default."""
    body = case.model.structure
    assert isinstance(body, RectanglePlate)
    return body.plate(world_of(case.model, case.folder)).highest_frequency


def on_own_mesh(case: Case, frequency: float) -> Structure | None:
    """The plate of a case on a mesh of its own for a frequency, Hz; None where that mesh is too large."""
    body = case.model.structure
    assert isinstance(body, RectanglePlate)
    world = world_of(case.model, case.folder)
    whole = body.model_copy(update={"highest_frequency": frequency}).make(world)
    return None if whole.size > MOST_UNKNOWNS else reduce(whole, case.model.run.until, TOLERANCE, MOST_VECTORS)
