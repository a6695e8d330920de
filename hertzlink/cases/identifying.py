"""Unknowns of a case from a measured signal: the section [identify]."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path as File
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.identification.found import Identification, Unknown
from coupling.identification.identify import FROM_IMPACT, identify
from coupling.identification.misfit import OF_SENSORS
from coupling.results.conditioning import condition
from coupling.results.signals import read_signal
from coupling.sweeps.batch import batch
from hertzlink.cases.axes import path_of, si_value, unit_at
from hertzlink.cases.bodies import LayeredCylinder, Rod
from hertzlink.cases.building import simulation_of, world_of
from hertzlink.cases.case import Case
from hertzlink.cases.checking import value_at
from hertzlink.cases.faults import Fault, reason_of
from hertzlink.cases.model import CaseModel, IdentifyPart
from hertzlink.cases.parts import World
from hertzlink.cases.paths import Path, put, written
from hertzlink.cases.plate_models import BAND, AroundGuess, edge_of, one_edge, scales
from hertzlink.cases.report import WIDTH, csv_text, table
from hertzlink.cases.running import sensors_of
from structures.caution import collected
from structures.structure import Structure

WIDE = 2.0
"""The range of a nuisance without one: from its value over this factor to its value times it."""

FOLLOWED = 3
"""Fits of the plate with one edge that are followed on the whole plate."""

WIDER = 0.25
"""Part of the distance from the edge, and of the position, that is searched where no fit explains the signal."""

MOST_ELEMENTS = 400
"""Elements of a layer whose mesh is the same for all values."""

OF_TIMES = {"time_zero": ("µs", 1e-6), "time_constant": ("ms", 1e-3)}
"""Units of the sensors' nuisances in tables."""

Structures = Callable[[CaseModel, World], Structure | None]


@dataclass(frozen=True)
class Question:
    """What is asked: the unknowns by path, their ranges (SI), units of tables and sizes; nuisances; sensors."""

    case: Case
    part: IdentifyPart
    ranges: dict[str, tuple[float, float]]
    paths: dict[str, Path]
    units: dict[str, tuple[str, float]]
    nuisances: list[str]
    columns: dict[int, int]

    @property
    def of_structure(self) -> set[tuple[Any, ...]]:
        """The paths within the structure."""
        return {path[1:] for path in self.paths.values() if path[0] == "structure"}


@dataclass(frozen=True)
class Builder:
    """A builder for `identify`: the case with other values; structures: what makes a faster structure."""

    question: Question
    structures: Structures | None = None

    def __call__(self, **values: Any) -> CoSimulation:
        changed = self.question.case.changed({})
        for name, value in values.items():
            put(changed.data, self.question.paths[name], float(value))
        if self.structures is None:
            return changed.simulation()
        world = world_of(changed.model, changed.folder)
        return simulation_of(changed.model, changed.folder, {"structure": self.structures(changed.model, world)})


def question_of(case: Case) -> Question:
    """The section [identify], checked; a Fault for what does not fit."""
    part = case.model.identify
    if part is None:
        raise Fault(("identify",), "is missing; add a section [identify] with sensors and unknowns")
    columns = {}
    for name, column in part.sensors.items():
        if not name.isdigit():
            raise Fault(("identify", "sensors", name), f'"{name}" is no bead; write {{ 7 = 1 }} for bead 7 in column 1')
        columns[int(name)] = column
    if not columns:
        raise Fault(("identify", "sensors"), "is empty; write { 7 = 1 } for bead 7 in column 1")
    try:
        sensors_of(case.changed({"measure": {"sensors": list(columns)}}), case)
    except Fault as fault:
        at = fault.path[-1]
        bead = list(part.sensors)[at] if isinstance(at, int) else ""
        raise Fault(("identify", "sensors", bead), fault.reason) from None
    ranges: dict[str, tuple[float, float]] = {}
    paths: dict[str, Path] = {}
    units: dict[str, tuple[str, float]] = {}

    def note(key: str, place: Path, ends: tuple[float, float], texts: list[Any]) -> str:
        path = path_of(key, place)
        name = written(path)
        if name in paths:
            raise Fault(place, f'"{key}" is given twice')
        ranges[name], paths[name] = ends, path
        units[name] = unit_at(case, path, ends[0], texts)[:2]
        return name

    for key, given in part.unknowns.items():
        place = ("identify", "unknowns", key)
        low, high = (_number(case, key, one, (*place, i), place) for i, one in enumerate(given))
        if not low < high:
            raise Fault(place, "the lowest value comes first, and the highest must be above it")
        note(key, place, (low, high), given)
    if not ranges:
        raise Fault(("identify", "unknowns"), 'is empty; write { "structure.thickness" = ["1 mm", "6 mm"] }')
    nuisances = []
    for i, key in enumerate(part.nuisances):
        where: Path = ("identify", "nuisances", i)
        if key in OF_SENSORS:
            nuisances.append(key)
            continue
        if "." not in key:
            choices = ", ".join(OF_SENSORS)
            raise Fault(where, f'"{key}" is none; take {choices}, or a path such as chain.impact_speed')
        name = written(path_of(key, where))
        if name not in paths:
            value = _value(case, key, where)
            note(key, where, (value / WIDE, value * WIDE), [])
        nuisances.append(name)
    return Question(case, part, ranges, paths, units, nuisances, columns)


def _number(case: Case, key: str, given: Any, at: Path, place: Path) -> float:
    found = si_value(case, path_of(key, place), given, at)
    if not isinstance(found, int | float):
        raise Fault(at, f"{found!r} is no number; only numbers can be unknown")
    return float(found)


def _value(case: Case, key: str, place: Path) -> float:
    """The value of a nuisance in the case, from which its range follows."""
    path = path_of(key, place)
    try:
        value = value_at(case.model, path)
    except (AttributeError, KeyError, IndexError, TypeError):
        value = None
    if not isinstance(value, int | float) or not value > 0.0:
        raise Fault(place, f'"{key}" has no value in the case; give it a range in identify.unknowns')
    return float(value)


def signal_of(question: Question, file: File) -> xr.Dataset:
    """The measured signal, conditioned; a Fault, or a ValueError that names the file."""
    part = question.part
    calibration: Any = part.calibration
    if isinstance(calibration, Mapping):
        calibration = {int(name): value for name, value in calibration.items() if name.isdigit()}
    try:
        signal = read_signal(
            file, question.columns, part.time_column, part.time_unit, part.unit, calibration
        )  # fmt: skip
        # The lead is short; identify estimates the noise from all samples.
        return condition(signal, part.mains).drop_vars("noise") if part.condition else signal
    except ValueError as error:
        names: dict[str, Path] = {
            name: ("identify", name) for name in ("calibration", "time_unit", "unit", "time_column", "sensors")
        }
        path, reason = reason_of(str(error), names)
        if path:
            raise Fault(path, reason) from error
        raise


def answer(question: Question, signal: xr.Dataset) -> tuple[Identification, list[str]]:
    """What the signal says about the unknowns, and remarks on how it was found."""
    case = question.case
    middle = {name: 0.5 * sum(ends) for name, ends in question.ranges.items()}
    until = question.part.until
    if until is None:
        with collected():
            chain = Builder(question)(**middle).chain
        record = float(signal.time[-1] - signal.time[0])
        until = min(record, FROM_IMPACT * chain.transit_time)
    data = case.changed({"run.until": until, "run.accuracy": "default"})
    question = replace(question, case=Case(_same_mesh(data, question), case.folder))
    common = {"until": until}
    edge = edge_of(Builder(question).question.case.changed(_texts(question, middle)).model)
    if question.part.search == "full" or edge is None or not question.of_structure:
        # The first batch loads compiled code, which identify would count as the time of a run.
        rows: dict[str, Any] = {name: [value] for name, value in middle.items()}
        with collected():
            batch(Builder(question), until, threads=1, sensors=list(question.columns), **rows)
        return _identified(question, signal, Builder(question), common), []
    return _by_one_edge(question, signal, common)


def _texts(question: Question, values: Mapping[str, float]) -> dict[str, float]:
    return {written(question.paths[name]): value for name, value in values.items()}


def _identified(
    question: Question, signal: xr.Dataset, build: Builder, common: dict[str, Any], guess: Any = None
) -> Identification:
    part = question.part
    settings: dict[str, Any] = dict(question.ranges)
    return identify(
        signal, build, question.nuisances, noise=part.noise, starts=part.starts, seed=part.seed, guess=guess,
        discrepancy=part.discrepancy, compare=part.compare, **common, **settings,
    )  # fmt: skip


def _by_one_edge(question: Question, signal: xr.Dataset, common: dict[str, Any]) -> tuple[Identification, list[str]]:
    """The search on the plate with its nearest edge alone, which needs no mesh; then the whole plate from its fits."""
    with collected():
        first = _identified(question, signal, Builder(question, one_edge), common)
    remarks = [f"found in {first.runs} runs on a plate with its nearest edge alone, then on the whole plate"]
    best: Identification | None = None
    for mode in first.modes[:FOLLOWED]:
        near = question.case.changed(_texts(question, mode))
        structures: Structures | None = None
        if scales(near.model, question.of_structure):
            errors = {i: first[name].error for name in mode for i in (0, 1) if question.paths[name][1:] == ("at", i)}
            structures = AroundGuess(near, errors, question.of_structure).structure
        guess = {name: float(mode[name]) for name in question.ranges}
        found = _identified(question, signal, Builder(question, structures), common, guess)
        if best is None or found.misfit < best.misfit:
            best = found
    assert best is not None
    if not best.explained and scales(question.case.model, question.of_structure):
        remarks.append(f"no fit nearby explained the signal; all within {100.0 * WIDER:.0f} % of the best was searched")
        found = _nearby(question, signal, common, {name: best[name].value for name in question.ranges})
        best = found if found.misfit < best.misfit else best
    if len(first.modes) > 1:
        remarks.append(f"that plate has {len(first.modes)} different fits; the best of {FOLLOWED} was taken")
    if not best.explained:
        remarks.append('search = "full" in [identify] searches the whole plate, in some minutes')
    return best, remarks


def _nearby(
    question: Question, signal: xr.Dataset, common: dict[str, Any], guess: Mapping[str, float]
) -> Identification:
    """A search of all positions and thicknesses around a guess, on one basis."""
    near = question.case.changed(_texts(question, guess))
    structures = AroundGuess(near, {}, question.of_structure, WIDER).structure
    ranges = dict(question.ranges)
    for name, (low, high) in question.ranges.items():
        if question.paths[name][0] == "structure":
            part = WIDER if question.paths[name][1] == "at" else BAND - 1.0
            ranges[name] = max(low, guess[name] / (1.0 + part)), min(high, guess[name] * (1.0 + part))
    inner = replace(question, case=near, ranges=ranges)
    return _identified(inner, signal, Builder(inner, structures), common)


def _same_mesh(case: Case, question: Question) -> dict[str, Any]:
    """The data of the case, in which a rod has the same mesh at all values."""
    body = case.model.structure
    if not isinstance(body, Rod) or isinstance(body, LayeredCylinder) or body.elements or not question.of_structure:
        return case.data
    counts = []
    for end in (0, 1):
        values = {name: ends[end] for name, ends in question.ranges.items()}
        origin = Builder(replace(question, case=case))(**values).structure.structure.origin
        counts.append(max(origin["elements"]))
    return case.changed({"structure.elements": min(max(counts), MOST_ELEMENTS)}).data


def tables(question: Question, found: Identification, remarks: list[str]) -> tuple[str, dict[str, str]]:
    """The text for the terminal, and files by name."""
    rows, plain = [], []
    for name, unknown in found.unknowns.items():
        unit, size = question.units.get(name, OF_TIMES.get(name, ("", 1.0)))
        shown = _in_unit(unknown, size)
        rows.append([f"{name}, {unit}" if unit else name, *shown.row()[1:]])
        plain.append([name, unknown.value, *unknown.interval, unknown.verdict])
    head = ["unknown", "value", "95 % interval", "verdict"]
    lines = table(head, rows, "unknowns.csv")
    notes = str(found).splitlines()[1 + len(found.unknowns) :]
    remarks = [fill(one, WIDTH, subsequent_indent="  ") for one in remarks]
    text = "\n".join([*lines, *notes, *remarks])
    data = found.data
    names = [f"{what} at bead {bead} (N)" for bead in data.sensor.values for what in ("measured", "fitted")]
    columns = [data[what].sel(sensor=bead).values for bead in data.sensor.values for what in ("measured", "fitted")]
    fit = np.column_stack([data.time.values, *columns]).tolist()
    values = {name: found[name].value for name in question.ranges}
    return text, {
        "unknowns.csv": csv_text(["unknown", "value (SI)", "low", "high", "verdict"], plain),
        "fit.csv": csv_text(["time (s)", *names], fit),
        "identified.toml": question.case.changed(_texts(question, values)).to_toml(),
    }


def _in_unit(unknown: Unknown, size: float) -> Unknown:
    low, high = unknown.interval
    return replace(unknown, value=unknown.value / size, interval=(low / size, high / size))
