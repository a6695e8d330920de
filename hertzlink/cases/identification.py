"""The section [identify] of a case: its question, its measured signal, the fit, and what is written of it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path as File
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import Identification
from coupling.inference.identify import identify
from coupling.inference.misfit import OF_SENSORS
from coupling.inference.prediction import FROM_IMPACT
from coupling.signals.conditioning import clean_signal
from coupling.signals.signals import read_signal
from hertzlink.cases.axes import path_of, si_value, unit_at
from hertzlink.cases.case import Case
from hertzlink.cases.parts import Identify
from hertzlink.cases.paths import Fault, Path, of_case, written
from hertzlink.cases.tables import Answer, Table
from hertzlink.cases.tasks import sensors_of
from hertzlink.terminal import printable
from structures.caution import collected
from structures.units import readable

WIDE = 2.0
"""The range of a nuisance without one: from its value over this factor to its value times it."""

MOST_NAMES = 20
"""Paths that a message lists."""

MOST_ELEMENTS = 400
"""Elements of a layer whose mesh is the same for all values."""

NOT_IDENTIFIED = 3
"""Exit code where results are written, but an unknown is not identified."""

TRACE = "trace"
"""The attribute of an identification that names the file of its signal."""


@dataclass(frozen=True)
class Question:
    """A question: the unknowns by path, their ranges (SI), units of tables and sizes; nuisances; sensors."""

    case: Case
    asked: Identify
    ranges: dict[str, tuple[float, float]]
    units: dict[str, tuple[str, float]]
    nuisances: list[str]
    columns: dict[int, int]

    def build(self, **values: float) -> CoSimulation:
        """Return the case with values at the paths of the unknowns, for `identify`."""
        return self.case.changed({name: float(value) for name, value in values.items()}).simulation()

    @property
    def middle(self) -> dict[str, float]:
        """The middle of each range."""
        return {name: 0.5 * sum(ends) for name, ends in self.ranges.items()}


def question_of(case: Case) -> Question:
    """Return the section [identify], checked; a Fault for what does not fit."""
    asked = case.identify
    if asked is None:
        raise Fault(("identify",), "is missing; add a section [identify] with sensors and unknowns")
    case.only_chain("an identification")
    for section, example in (
        ("sensors", "{ 7 = 1 } for bead 7 in column 1"),
        ("unknowns", '{ "structure.thickness" = ["1 mm", "6 mm"] }'),
    ):
        if not getattr(asked, section):
            raise Fault(("identify", section), f"is empty; write {example}")
    columns = {}
    for name, column in asked.sensors.items():
        place = ("identify", "sensors", name)
        if not name.isdigit():
            raise Fault(place, f'"{name}" is no bead; write {{ 7 = 1 }} for bead 7 in column 1')
        columns[int(name)] = column
        try:
            sensors_of(case.changed({"measure": {"sensor": int(name)}}), case)
        except Fault as fault:
            raise Fault(place, fault.reason) from None

    ranges: dict[str, tuple[float, float]] = {}
    units: dict[str, tuple[str, float]] = {}
    for key, (low, high) in asked.unknowns.items():
        place = ("identify", "unknowns", key)
        path = path_of(key, place)
        ends = _number(case, path, low, (*place, 0), place), _number(case, path, high, (*place, 1), place)
        if not ends[0] < ends[1]:
            raise Fault(place, "the lowest value comes first, and the highest must be above it")
        if written(path) in ranges:
            raise Fault(place, f'"{key}" is given twice')
        ranges[written(path)] = ends
        units[written(path)] = unit_at(case, path, ends[0], (low, high))[:2]
    nuisances = []
    for i, key in enumerate(asked.nuisances):
        where: Path = ("identify", "nuisances", i)
        if key in OF_SENSORS:
            nuisances.append(key)
            continue
        if "." not in key:
            choices = ", ".join(OF_SENSORS)
            raise Fault(where, f'"{key}" is none; take {choices}, or a path such as chain.impact_speed')
        path = path_of(key, where)
        nuisances.append(written(path))
        if written(path) not in ranges:
            value = case.value(path)
            if not isinstance(value, int | float) or not value > 0.0:
                raise Fault(where, f'"{key}" has no value in the case; give it a range in identify.unknowns')
            ranges[written(path)] = value / WIDE, value * WIDE
            units[written(path)] = unit_at(case, path, value / WIDE, ())[:2]
    return Question(case, asked, ranges, units, nuisances, columns)


def _number(case: Case, path: Path, value: Any, at: Path, place: Path) -> float:
    """Return a number (SI) of a range; a Fault lists the numbers of a section for a path that is none."""
    try:
        number = si_value(case, path, value, at)
    except Fault:
        names = [written(path) for path in case.numbers(str(path[0]))]
        held = case.value(path)
        parameter = case.parameter(path[:-1] if isinstance(path[-1], int) else path)
        is_entry = isinstance(held, int | float | str) or (
            held is None and parameter is not None and path[-1] == parameter.name
        )
        if written(path) in names or is_entry:
            raise
        more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
        words = f"[{path[0]}] has {', '.join(names[:MOST_NAMES]) or 'none'}{more}"
        raise Fault(place, f'"{written(path)}" is no number of this case; {words}') from None
    if not isinstance(number, int | float):
        raise Fault(at, f"{number!r} is no number; only numbers can be unknown")
    return float(number)


def signal_of(question: Question, file: File) -> xr.Dataset:
    """Return the measured signal, conditioned; a Fault, or raise a ValueError that names the file."""
    if not file.is_file():
        what = "is a folder" if file.is_dir() else "there is no such file"
        raise ValueError(f"{file}: {what}; give the trace of an oscilloscope as text, such as CSV")
    try:
        signal = _read(question, file, "lead")
        # The lead is short; identify estimates the noise from all samples.
        return clean_signal(signal, question.asked.mains).drop_vars("noise") if question.asked.condition else signal
    except ValueError as error:
        call = question.case.tree.entries["identify"]
        fault = call.fault(str(error))
        if fault.path != call.path:
            raise fault from error
        if reason := _too_short(question, file):
            raise ValueError(f"{file}: {reason}") from error
        raise


def _read(question: Question, file: File, baseline: float | str) -> xr.Dataset:
    asked = question.asked
    calibration: Any = asked.calibration
    if isinstance(calibration, Mapping):
        calibration = {int(name): value for name, value in calibration.items() if name.isdigit()}
    return read_signal(
        file, question.columns, asked.time_column, asked.time_unit, asked.unit, calibration, baseline, None,
        asked.interval, asked.start, asked.segment,
    )  # fmt: skip


def _too_short(question: Question, file: File) -> str:
    """Return, where the record is too short for the wave that comes back to the first sensor, how long that takes."""
    with collected():
        try:
            time = _read(question, file, 0.0).time
            moving = question.build(**question.middle).chain
        except ValueError:
            return ""  # what is wrong with these has been said
    record, bead, beads = float(time[-1] - time[0]), min(question.columns), len(moving.chain.beads)
    needed = (2.0 - bead / beads) * moving.transit_time + moving.contact_time
    if record >= needed:
        return ""
    return (
        f"its record of {readable(record, 's', 4)} is too short: the wave is back at bead {bead} about "
        f"{readable(needed, 's', 4)} after the impact; record longer, from before the impact on"
    )


def fit(question: Question, signal: xr.Dataset, file: File | None = None) -> Identification:
    """Return what the signal of a file says about the unknowns, in the units of the case."""
    asked = question.asked
    question, until = prepared(question, float(signal.time[-1] - signal.time[0]))
    settings: dict[str, Any] = dict(question.ranges)
    try:
        found = identify(
            signal, question.build, question.nuisances, until=until, noise=asked.noise, starts=asked.starts,
            seed=asked.seed, discrepancy=asked.discrepancy, **settings,
        )  # fmt: skip
    except ValueError as error:
        head, colon, rest = str(error).partition(": ")
        if file is None or head != "signal":
            raise
        raise ValueError(f"{file}{colon}{rest}") from None
    shown = dict(found.unknowns)
    for name, (unit, size) in question.units.items():
        shown[name] = replace(shown[name], unit=unit, unit_size=size)
    return replace(found, unknowns=shown)


def prepared(question: Question, record: float = inf) -> tuple[Question, float]:
    """Return the question of a case whose runs are as long as its signal counts, and that length, s. record: s.

    A rod gets the same mesh at all values.
    """
    until = question.asked.until
    if until is None:
        with collected():
            chain = question.build(**question.middle).chain
        until = min(record, FROM_IMPACT * chain.transit_time)
    case = question.case.changed({"run.until": until, "run.accuracy": "default"})
    body = case.tree.entries["structure"]
    of_structure = any(name.startswith("structure") for name in question.ranges)
    if body.kind == "rod" and "elements" not in body.entries and of_structure:
        builds: list[Callable[..., CoSimulation]] = [replace(question, case=case).build] * 2
        ends = [{name: both[end] for name, both in question.ranges.items()} for end in (0, 1)]
        counts = [
            max(build(**at).structure.structure.origin["elements"]) for build, at in zip(builds, ends, strict=True)
        ]
        case = case.changed({"structure.elements": min(max(counts), MOST_ELEMENTS)})
    return replace(question, case=case), until


def answer_of(question: Question, found: Identification, file: File) -> Answer:
    """Return what was found from a file: tables, the case with the values found, and a simulation to sketch."""
    head = ["unknown", "value", "95 % interval", "verdict"]
    columns = ["unknown", "value (SI)", "low", "high", "verdict", "residual over noise"]
    unknowns = found.unknowns.items()
    rows = [[name, one.value, *one.interval, one.verdict, found.misfit] for name, one in unknowns]
    table = Table("unknowns.csv", columns, rows, head, [[*one.row()] for one in found.unknowns.values()])

    data, what = found.data, ("measured", "fitted")
    names = [f"{quantity} at bead {bead} (N)" for bead in data.sensor.values for quantity in what]
    traces = [data[quantity].sel(sensor=bead).values for bead in data.sensor.values for quantity in what]
    fitted = Table("fit.csv", ["time (s)", *names], np.column_stack([data.time.values, *traces]).tolist())

    in_case = replace(found, warnings=[of_case(warning) for warning in found.warnings])
    values = {name: found[name].value for name in question.ranges}
    best = {"identified.toml" if found.explained else "best_fit.toml": question.case.changed(values).to_toml()}
    result = found.to_dataset().assign_attrs(case=question.case.to_toml(), **{TRACE: printable(str(file.absolute()))})
    code = 0 if found.identified else NOT_IDENTIFIED
    notes = str(in_case).splitlines()[1 + len(found.unknowns) :]
    return Answer(result, [table, fitted], notes, sketched=question.build(**values), others=best, code=code)
