"""The search for a rectangular plate: with its nearest edge alone, which needs no mesh; then on the whole plate.

The builder of an identification is called without a mesh (`unmeshed`), so that a fast model can take the place of the
plate that it makes, whether Python or a case file describes the plate.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import Identification, is_blind
from coupling.inference.misfit import BASELINE, GAIN, TIME_ZERO
from coupling.results.measures import sensor_force
from plates.half_plane import half_plane
from plates.plate import Plate
from plates.reduced import MOST_VECTORS, ReducedPlate, covers
from plates.scaling import wave_speed
from plates.section import homogeneous_section
from plates.shapes.rectangle import SIDES, Rectangle
from plates.support import Supports
from structures.caution import caution, collected
from structures.material import Material
from structures.reduction import reduce
from structures.structure import Structure, Vector
from structures.unmeshed import Unmeshed, unmeshed

FREQUENCY = 60e3
"""Hz, that these models resolve at least. On a mesh for 40 kHz traces of a large plate are off by 0.2 % of their peak,
those of a small thin one, which holds more echoes, by 0.6 %: `PlateFit` finds what a signal needs."""

BAND = 1.15
"""A basis serves plates whose waves are up to this factor slower or faster than at the guess."""

TOLERANCE, ROUGH = 1e-3, 1e-2
"""Of the basis, for the last fit and for those before it: 1e-2 moves an unknown by up to a standard deviation."""

AROUND = 0.05
"""Half of the range of positions of the basis, as a part of the distance from the nearest edge; and more:"""

ERRORS, CELLS, WIDEST = 3.0, 2.0, 0.3
"""This many half intervals of the guess, and this many cells; WIDEST is the greatest part of that distance."""

EDGES = {"clamped": "clamped", "simple": "simple", "soft simple": "simple", "free": "free"}
"""The edge of a half-plane that stands for each support."""

FOLLOWED = 3
"""Fits of the plate with one edge that are followed on the whole plate."""

WIDER = 0.25
"""Part of the distance from the edge, and of the position, that is searched where no fit explains the signal."""

DOUBLINGS = 2
"""How often the frequency that the mesh resolves is doubled, where that would move an unknown."""

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

SAMPLES = 2000
"""Times at which two traces are compared."""

PEAK_NOISE = 0.01
"""Noise as a part of the peak, where only features are compared and the noise of samples does not count."""

ROUNDING = 1e-9
"""Part by which waves may be slower or faster than those of a basis."""

Build = Callable[..., CoSimulation]
Fitted = Callable[..., Identification]
"""What fits a builder: fitted(build, ranges, guess)."""


class Struck(NamedTuple):
    """A co-simulation on a plate that has no mesh, and where the plate is struck."""

    simulation: CoSimulation
    plate: Plate
    place: tuple[float, float]
    face: str

    def on(self, structure: Structure) -> CoSimulation:
        """Return the co-simulation on a structure in the plate's place."""
        return self.simulation.replace(structure=structure)

    @property
    def nearest_edge(self) -> tuple[str, float] | None:
        """The support of the nearest edge, and its distance, m; None where none with one edge stands for this one."""
        plate, (x, y) = self.plate, self.place
        if not isinstance(plate.shape, Rectangle) or plate.additions or not isinstance(plate.material, Material):
            return None
        distances = dict(zip(SIDES, (x, plate.length - x, y, plate.width - y), strict=True))
        nearest = min(distances, key=lambda name: distances[name])
        held = getattr(plate.supports, nearest)
        if not isinstance(held, str) or held not in EDGES or distances[nearest] < 0.0:
            return None
        return EDGES[held], distances[nearest]

    def with_one_edge(self, until: float) -> CoSimulation:
        """Return the co-simulation on a plate with the nearest edge alone."""
        if self.nearest_edge is None:
            raise ValueError(f"build: the edge nearest to {self.place} is no straight edge of a half-plane")
        (kind, distance), plate = self.nearest_edge, self.plate
        assert isinstance(plate.material, Material)
        # On a held edge the plate does not move; nearer than a thickness no plate theory holds.
        away = distance if kind == "free" else max(distance, 0.1 * plate.thickness)
        return self.on(half_plane(plate.thickness, plate.material, kind, away, until, FREQUENCY))

    def finer(self, frequency: float) -> "Struck":
        """Return the plate with a mesh for another frequency, Hz."""
        return self._replace(plate=replace(self.plate, highest_frequency=frequency))

    def meshed(self) -> Structure:
        """Return the plate with its mesh."""
        return self.plate.at(*self.place, self.face)


def struck_by(build: Build, **values: float) -> Struck | None:
    """Return what a builder makes, without a mesh; None unless one chain strikes one plate at one place."""
    with unmeshed():
        simulation = build(**values)
    structure = simulation.faces if isinstance(simulation, CoSimulation) else None
    if not isinstance(structure, Unmeshed) or not isinstance(structure.body, Plate) or len(structure.place) != 1:
        return None
    (contact,) = structure.place
    return Struck(simulation, structure.body, (contact.x, contact.y), contact.face)


def share_modes(plates: Sequence[Struck]) -> bool:
    """Return whether one basis serves these plates: for one, waves only scale and the contact moves."""
    first = plates[0].plate
    if first.kind != "Kirchhoff plate" or first.additions or first.shape.fixed or plates[0].face != "front":
        return False
    held = [getattr(first.supports, side) for side in SIDES] if isinstance(first.supports, Supports) else [None]
    return all(isinstance(name, str) for name in held) and all(_alike(first, struck.plate) for struck in plates)


def _alike(first: Plate, second: Plate) -> bool:
    """Return whether two plates differ in thickness, Young's modulus and density alone."""
    materials = first.material, second.material
    if not all(isinstance(material, Material) for material in materials):
        return False
    (values, ratio), (others, also) = (
        (plate.data([]) | dict.fromkeys(("thickness", "material", "section")), plate.section.struck.poisson_ratio)
        for plate in (first, second)
    )
    return values == others and ratio == also


class PlateBasis:
    """Kirchhoff plates from one basis; others get a mesh and a reduction of their own.

    slowest: the plate with the slowest waves, and the frequency that all meshes resolve; faster: the fastest waves in
    units of these; until: the longest record, s; places: x and y of the contact, each a number or a range, m.
    """

    def __init__(
        self, slowest: Plate, faster: float, until: float, places: Sequence[float | tuple[float, float]],
        tolerance: float,
    ) -> None:  # fmt: skip
        self.slowest, self.faster, self.until = slowest, faster, until
        with collected() as self.warnings:
            self.reduced = ReducedPlate(slowest, until * faster, places[0], places[1], tolerance)
        self._last: tuple[Any, Structure] | None = None

    @property
    def error(self) -> float:
        """The estimated error of a displacement after a pulse."""
        return float(self.reduced.basis.errors[0][1])

    def simulation(self, struck: Struck) -> CoSimulation:
        """Return the co-simulation on the plate of the basis."""
        return struck.on(self.structure(struck))

    def structure(self, struck: Struck) -> Structure:
        """Return the plate of the basis; with a mesh of its own where the basis does not serve it."""
        plate, (x, y) = struck.plate, struck.place
        waves = wave_speed(self.slowest.section, plate.section)
        inside = covers(self.reduced.x, x) and covers(self.reduced.y, y)
        if inside and 1.0 - ROUNDING <= waves <= self.faster * (1.0 + ROUNDING):
            return self.reduced.at(x, y, thickness=plate.thickness, material=plate.section.struck)
        key = (x, y, plate.thickness, plate.section.struck)
        if self._last is None or self._last[0] != key:  # most runs change the chain alone
            fine = struck.finer(self.slowest.highest_frequency).meshed()
            self._last = key, reduce(fine, self.until)
        return self._last[1]


def basis_between(
    first: Struck, ends: Sequence[Sequence[Struck]], until: float, tolerance: float
) -> PlateBasis:  # fmt: skip
    """Return one basis for plates whose properties vary independently, each between two ends."""
    waves = [sorted(wave_speed(first.plate.section, struck.plate.section) for struck in both) for both in ends]
    slow, fast = (float(np.prod([speeds[end] for speeds in waves])) for end in (0, 1))
    # As a thinner plate, of the same material.
    slowest = thinner(first.plate, slow)
    places: list[float | tuple[float, float]] = []
    for i, side in enumerate((slowest.length, slowest.width)):
        all_of = [first.place[i], *(struck.place[i] for both in ends for struck in both)]
        low, high, margin = min(all_of), max(all_of), 0.5 * slowest.finest_cell
        places.append(low if low == high else (max(low, margin), min(high, side - margin)))
    return PlateBasis(slowest, fast / slow, until, places, tolerance)


def thinner(plate: Plate, part: float) -> Plate:
    """Return the plate with a part of its thickness."""
    assert isinstance(plate.material, Material)
    return replace(plate, section=homogeneous_section(plate.thickness * part, plate.material))


@dataclass(frozen=True)
class PlateSearch:
    """The search for the unknowns of a plate that a builder makes; until: s, of its runs."""

    build: Build
    ranges: Mapping[str, tuple[float, float]]
    nuisances: Sequence[str]
    sensors: Sequence[int]
    until: float
    fitted: Fitted

    @property
    def serves(self) -> bool:
        """True if a plate with one edge stands for what the builder makes, and an unknown changes it."""
        try:
            with collected():  # the fits repeat what holds for their values
                middle = struck_by(self.build, **self.middle)
                return middle is not None and middle.nearest_edge is not None and bool(self.moved or self.scaled)
        except (ArithmeticError, LookupError, TypeError, ValueError):
            return False  # it needs the mesh; what else is wrong shows in its own runs

    @property
    def middle(self) -> dict[str, float]:
        """The middle of each range."""
        return {name: 0.5 * (low + high) for name, (low, high) in self.ranges.items()}

    def struck(self, **values: float) -> Struck:
        """Return the plate at some values, without a mesh."""
        struck = struck_by(self.build, **values)
        if struck is None:
            raise ValueError(f"build: makes no plate that one chain strikes at {values}, as it does at other values")
        return struck

    def with_one_edge(self, **values: float) -> CoSimulation:
        """Return the builder's co-simulation on the plate with its nearest edge alone."""
        return self.struck(**values).with_one_edge(self.until)

    @cached_property
    def _ends(self) -> dict[str, list[Struck]]:
        """The plate at both ends of each range, the other values in the middle."""
        return {
            name: [self.struck(**(self.middle | {name: end})) for end in ends] for name, ends in self.ranges.items()
        }

    @cached_property
    def moved(self) -> dict[str, Vector]:
        """Change of the place, m, with each unknown that moves it."""
        slopes = {
            name: (np.array(high.place) - np.array(low.place)) / (self.ranges[name][1] - self.ranges[name][0])
            for name, (low, high) in self._ends.items()
        }
        return {name: slope for name, slope in slopes.items() if slope.any()}

    @cached_property
    def scaled(self) -> dict[str, bool]:
        """True if the modes stay, for each unknown that changes the plate itself."""
        return {
            name: share_modes(both)
            for name, both in self._ends.items()
            if both[0].plate.data([]) != both[1].plate.data([])
        }

    def run(self) -> Identification:
        """Search on the plate with its nearest edge alone, then on the whole plate from its fits."""
        with collected() as messages:
            best = self._searched()
        # Those of a fit are among its notes.
        for message in dict.fromkeys(messages):
            if not message.startswith(("identify:", "reduction:")) and message not in best.warnings:
                caution(message)
        return best

    def fit(self, identification: Identification) -> "PlateFit":
        """Return a fit of the builder itself."""
        return PlateFit(self, identification, self.build, self.struck(**self.middle).plate.highest_frequency)

    def _searched(self) -> Identification:
        first = self.fitted(self.with_one_edge, self.ranges, None)
        remarks = [f"found in {first.runs} runs on a plate with its nearest edge alone, then on the whole plate"]
        runs = first.runs
        self.warn_of_blind(first)
        shared = share_modes([self.struck(**self.middle)]) and all(self.scaled.values())
        frequency = self.struck(**self.middle).plate.highest_frequency
        if shared:
            frequency = max(FREQUENCY, frequency)
        fits = []
        for mode in first.modes[:FOLLOWED]:
            guess = {name: float(mode[name]) for name in self.ranges}
            if shared:
                fits.append(self._fit_on(self.basis(guess, self._errors(first), frequency), self.ranges, guess))
            else:
                fits.append(PlateFit(self, self.fitted(self.build, self.ranges, guess), self.build, frequency))
        runs += sum(fit.found.runs for fit in fits)
        best = min(fits, key=lambda candidate: candidate.found.misfit)
        # Hum that is fitted may make a wrong fit good enough to look like noise.
        if shared and (not best.found.explained or BASELINE in best.found.data):
            why = "hum or drift was fitted" if best.found.explained else "no fit nearby explained the signal"
            remarks.append(f"{why}; all within {100.0 * WIDER:.0f} % of the best was searched")
            fit = self._nearby(best.values, frequency)
            runs += fit.found.runs
            best = min(best, fit, key=lambda candidate: candidate.found.misfit)
        for _ in range(DOUBLINGS):
            if not shared or not best.finer():
                break
            frequency *= 2.0
            basis = self.basis(best.values, self._errors(best.found), frequency, tolerance=TOLERANCE)
            best = self._fit_on(basis, self.ranges, best.values)
            runs += best.found.runs
        if len(first.modes) > 1:
            remarks.append(f"that plate has {len(first.modes)} different fits; the best of {FOLLOWED} was taken")
        remarks += best.remarks()
        if not best.found.explained:
            remarks.append('search = "full" searches the whole plate, in some minutes')
        return replace(best.found, runs=runs, remarks=remarks)

    def warn_of_blind(self, first: Identification) -> None:
        """Say that the fits of a plate with one edge do not know where the chain stands on the whole one."""
        fits = [first[name] for name in self.moved]
        if blind := [u.name for u in fits if is_blind(u.value, u.interval, self.ranges[u.name])]:
            caution(
                f"search: the nearest edge alone does not determine {' and '.join(blind)}, so the whole plate was "
                "searched only near one guess, and intervals may be too short; measure at more beads, or take search = "
                '"full"'
            )

    def _errors(self, identification: Identification) -> Vector:
        """Return half intervals of the coordinates, m."""
        return sum((abs(slope) * identification[name].error for name, slope in self.moved.items()), np.zeros(2))

    def _fit_on(
        self, basis: PlateBasis, ranges: Mapping[str, tuple[float, float]], guess: dict[str, float] | None
    ) -> "PlateFit":
        def build(**values: float) -> CoSimulation:
            return basis.simulation(self.struck(**values))

        identification = self.fitted(build, ranges, guess)
        return PlateFit(self, identification, build, basis.slowest.highest_frequency, True, tuple(basis.warnings))

    def _nearby(self, guess: dict[str, float], frequency: float) -> "PlateFit":
        """Return a search of all positions and thicknesses around a guess, on one basis."""
        ranges = dict(self.ranges)
        for name in {**self.moved, **self.scaled}:
            part, (low, high) = WIDER if name in self.moved else BAND - 1.0, self.ranges[name]
            ranges[name] = max(low, guess[name] / (1.0 + part)), min(high, guess[name] * (1.0 + part))
        return self._fit_on(self.basis(guess, np.zeros(2), frequency, WIDER), ranges, None)

    def basis(
        self, guess: dict[str, float], errors: Vector, frequency: float, around: float = AROUND,
        tolerance: float = ROUGH,
    ) -> PlateBasis:  # fmt: skip
        """Return one basis for the plates near a guess.

        errors: half intervals of the coordinates at the guess, m; frequency: Hz, that its mesh resolves; around: half
        of the range of positions, as a part of the distance from the nearest edge.
        """
        near = self.struck(**guess).finer(frequency)
        band = BAND if self.scaled else 1.0
        slowest = thinner(near.plate, 1.0 / band)
        cell, places = slowest.finest_cell, list[float | tuple[float, float]]()
        for i, (place, side) in enumerate(zip(near.place, (slowest.length, slowest.width), strict=True)):
            if not any(slope[i] for slope in self.moved.values()):
                places.append(place)
                continue
            away = min(place, side - place)
            # Where a guess hardly knows the place, a basis for the whole plate would take minutes and not be accurate.
            half = min(max(around * away, ERRORS * errors[i], CELLS * cell), max(WIDEST * away, CELLS * cell))
            places.append((max(place - half, 0.5 * cell), min(place + half, side - 0.5 * cell)))
        return PlateBasis(slowest, band**2, self.until, places, tolerance)


@dataclass(frozen=True)
class Difference:
    """The change by another mesh: trace, root mean square, in parts of the noise; unknowns, in their deviations."""

    change: float
    shifts: dict[str, float]

    @property
    def worst(self) -> float:
        """The largest shift."""
        return max(self.shifts.values())

    def __str__(self) -> str:
        name = max(self.shifts, key=lambda key: self.shifts[key])
        return (
            f"changes the trace by {self.change:.1g} times the noise and {name} by {self.worst:.1g} standard deviations"
        )


@dataclass(frozen=True)
class PlateFit:
    """A fit of the whole plate; frequency: Hz, that its meshes resolve; basis: whether one serves all runs, with these
    warnings.
    """

    search: PlateSearch
    found: Identification
    build: Build
    frequency: float
    basis: bool = False
    warnings: tuple[str, ...] = ()

    @property
    def values(self) -> dict[str, float]:
        """Values of the unknowns."""
        return {name: self.found[name].value for name in self.search.ranges}

    @cached_property
    def struck(self) -> Struck:
        """The plate with these values, without a mesh."""
        return self.search.struck(**self.values)

    def on_mesh(self, frequency: float) -> Structure | None:
        """Return the plate on a mesh of its own for a frequency, Hz; None where that mesh is too large."""
        fine = self.struck.finer(frequency).meshed()
        return None if fine.size > MOST_UNKNOWNS else reduce(fine, self.search.until, TOLERANCE, MOST_VECTORS)

    def difference(self, structure: Structure) -> Difference:
        """Return what this structure changes, to first order."""
        trace, noise, slope = self._linear
        other = (self._read(self.struck.on(structure)) - trace) / noise
        change = float(np.sqrt(np.mean(other**2, axis=1)).max())
        moved = np.linalg.lstsq(slope, other.ravel(), rcond=None)[0]
        deviation = np.sqrt(np.diag(np.linalg.pinv(slope.T @ slope)))
        part = np.sqrt(self._samples / SAMPLES) * np.abs(moved) / deviation
        wanted = [name for name in self.values if name not in self.search.nuisances]
        return Difference(change, {name: float(part[list(self.values).index(name)]) for name in wanted})

    @cached_property
    def _linear(self) -> tuple[Vector, Vector, Vector]:
        """The trace, its noise, and the slopes of the trace over noise, samples × parameters, in unit columns: unknowns
        are of different sizes.
        """
        trace = self._trace({})
        noise = self._noise(trace)
        slopes = [((self._trace({name: 1.0}) - self._trace({name: -1.0})) / noise).ravel() for name in self.values]
        if TIME_ZERO in self.search.nuisances:
            slopes.append((np.gradient(trace, axis=1) / noise).ravel())
        if GAIN in self.search.nuisances:
            for i in range(len(trace)):
                alone = np.zeros_like(trace)
                alone[i] = (trace / noise)[i]
                slopes.append(alone.ravel())
        slope = np.stack(slopes, axis=1)
        return trace, noise, slope / np.linalg.norm(slope, axis=0)

    def _trace(self, steps: dict[str, float]) -> Vector:
        """Return the trace, with some values moved by these multiples of STEP."""
        values = {name: value * (1.0 + STEP * steps.get(name, 0.0)) for name, value in self.values.items()}
        with collected():
            return self._read(self.build(**values))

    def _read(self, simulation: CoSimulation) -> Vector:
        """Return what the sensors read, sensors × times, N."""
        # The notes of a fit hold the warnings of its runs.
        with collected():
            run = simulation.run(self.search.until)
        times = np.linspace(0.0, self.search.until, SAMPLES)
        return np.stack([np.interp(times, run.time, sensor_force(run, sensor)) for sensor in self.search.sensors])

    @property
    def _samples(self) -> float:
        """Samples of the signal in the time that is predicted."""
        if "time" not in self.found.data.dims:
            return SAMPLES
        step = float(self.found.data.time[1] - self.found.data.time[0])
        return float(self.search.until / step)

    def _noise(self, trace: Vector) -> Vector:
        """Return the noise over gain, N, of each sensor."""
        noise, sensors = PEAK_NOISE * np.abs(trace).max(axis=1), list(self.search.sensors)
        if "sensor" in self.found.data.noise.dims:
            gains = [self.found.unknowns.get(f"{GAIN} {sensor}") for sensor in sensors]
            size = np.array([1.0 if gain is None else abs(gain.value) for gain in gains])
            noise = self.found.data.noise.sel(sensor=sensors).values / size
        return np.asarray(noise)[:, None]

    @cached_property
    def _of_finer(self) -> Difference | None:
        """The change by a mesh for twice the frequency; None where that mesh is too large."""
        fine = self.on_mesh(2.0 * self.frequency)
        return None if fine is None else self.difference(fine)

    def finer(self) -> bool:
        """Return whether a finer mesh is needed, and fits."""
        return self._of_finer is not None and self._of_finer.worst > TOLERATED

    def remarks(self) -> list[str]:
        """Return how the whole plate was modelled, and how accurate that is: a warning where it is not enough."""
        shape = self.struck.plate.shape
        if isinstance(shape, Rectangle) and shape.cells is not None:
            return [f"whole plate: a mesh of {shape.cells[0]} × {shape.cells[1]} cells, as given; not checked"]
        kind = "one basis (ReducedPlate) on a mesh" if self.basis else "a mesh of its own for each run,"
        model = f"whole plate: {kind} for {1e-3 * self.frequency:g} kHz"
        difference = self._of_finer
        if difference is None:
            large = f"a finer one has more than {MOST_UNKNOWNS} unknowns, so its accuracy is not known"
            return [f"warning: {model}; {large}", *(f"warning: {remark}" for remark in self.warnings)]
        said = [f"{model}; one for {2e-3 * self.frequency:g} kHz {difference}"]
        if difference.worst > DOUBTFUL:
            # What the basis lacks is in the difference; its warnings say why.
            said = [f"warning: {said[0]}", *(f"warning: {remark}" for remark in self.warnings)]
        usual = self.struck.plate.highest_frequency
        plain = self.on_mesh(usual) if usual < self.frequency else None
        if plain is not None and (difference := self.difference(plain)).worst > TOLERATED:
            said.append(
                f"a run of this plate, on a mesh for {1e-3 * usual:g} kHz, {difference}: simulate traces with a "
                f"highest_frequency of {1e-3 * self.frequency:g} kHz"
            )
        return said
