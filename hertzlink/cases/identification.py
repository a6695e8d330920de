"""The section [identify] of a case: its question, its measured signal, the fit, and what is written of it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path as File
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.identification import Identification
from coupling.inference.identify import identify
from coupling.inference.misfit import OF_SENSORS
from coupling.inference.prediction import FROM_IMPACT
from coupling.signals.conditioning import clean_signal
from coupling.signals.signals import read_signal
from hertzlink.cases.case import Build, Case, of_case
from hertzlink.cases.parts import Identify
from hertzlink.cases.reader import Call
from hertzlink.cases.source import Fault, Path, parsed, written
from hertzlink.cases.tables import Answer, Table
from hertzlink.cases.tasks import path_of, sensors_of, si_value, unit_at
from structures.caution import collected
from structures.material import Material

WIDE = 2.0
"""The range of a nuisance without one: from its value over this factor to its value times it."""

MOST_NAMES = 20
"""Paths that a message lists."""

MOST_ELEMENTS = 400
"""Elements of a layer whose mesh is the same for all values."""

NOT_IDENTIFIED = 3
"""Exit code where results are written, but an unknown is not identified."""


@dataclass(frozen=True)
class Question:
    """A question: the unknowns by path, their ranges (SI), units of tables and sizes; nuisances; sensors."""

    case: Case
    asked: Identify
    ranges: dict[str, tuple[float, float]]
    units: dict[str, tuple[str, float]]
    nuisances: list[str]
    columns: dict[int, int]

    @property
    def build(self) -> Build:
        """What builds the case with values at the paths of the unknowns, for `identify`."""
        return Build(self.case, {name: parsed(name) for name in self.ranges})


def question_of(case: Case) -> Question:
    """Return the section [identify], checked; a Fault for what does not fit."""
    asked = case.identify
    if asked is None:
        raise Fault(("identify",), "is missing; add a section [identify] with sensors and unknowns")
    case.only_chain("an identification")
    sensors, unknowns = "{ 7 = 1 } for bead 7 in column 1", '{ "structure.thickness" = ["1 mm", "6 mm"] }'
    for section, example in (("sensors", sensors), ("unknowns", unknowns)):
        if not getattr(asked, section):
            raise Fault(("identify", section), f"is empty; write {example}")
    for name in asked.sensors:
        place: Path = ("identify", "sensors", name)
        if not name.isdigit():
            raise Fault(place, f'"{name}" is no bead; write {sensors}')
        try:
            sensors_of(case.changed({"measure": {"sensor": int(name)}}), case)
        except Fault as fault:
            raise Fault(place, fault.reason) from None

    ranges: dict[str, tuple[float, float]] = {}
    units: dict[str, tuple[str, float]] = {}
    nuisances = []
    for key, texts in asked.unknowns.items():
        place = ("identify", "unknowns", key)
        path = path_of(key, place)
        held, parameter = case.value(path), case.parameter(path)
        not_given = held is None and parameter is not None and parameter.name == path[-1]
        if not isinstance(held, int | float) and not not_given:
            section = str(path[0])
            names = [written(one) for one in _numbers(case.tree.entries.get(section), (section,))]
            more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
            listed = f"[{section}] has {', '.join(names[:MOST_NAMES]) or 'none'}{more}"
            raise Fault(place, f'"{written(path)}" is no number of this case; {listed}')
        low, high = (si_value(case, path, text, (*place, i)) for i, text in enumerate(texts))
        if not isinstance(low, int | float) or not isinstance(high, int | float) or low >= high:
            raise Fault(place, "the lowest value comes first, and the highest must be above it")
        if written(path) in ranges:
            raise Fault(place, f'"{key}" is given twice')
        ranges[written(path)], units[written(path)] = (float(low), float(high)), unit_at(case, path, texts)[:2]
    for i, key in enumerate(asked.nuisances):
        place = ("identify", "nuisances", i)
        if key not in OF_SENSORS and "." not in key:
            choices = ", ".join(OF_SENSORS)
            raise Fault(place, f'"{key}" is none; take {choices}, or a path such as chain.impact_speed')
        nuisances.append(key if key in OF_SENSORS else written(path := path_of(key, place)))
        if nuisances[-1] not in (*OF_SENSORS, *ranges):
            value = case.value(path)
            if not isinstance(value, int | float) or not value > 0.0:
                raise Fault(place, f'"{key}" has no value in the case; give it a range in identify.unknowns')
            ranges[written(path)], units[written(path)] = (value / WIDE, value * WIDE), unit_at(case, path, ())[:2]
    columns = {int(name): column for name, column in asked.sensors.items()}
    return Question(case, asked, ranges, units, nuisances, columns)


def _numbers(value: Any, path: Path) -> Iterator[Path]:
    """Yield the paths of the numbers, other than counts, that a checked section holds."""
    if isinstance(value, float):
        yield path
    elif isinstance(value, Material) or (isinstance(value, Call) and value.path != path):  # one that is named
        yield from ((*path, name) for name in ("youngs_modulus", "poisson_ratio", "density"))
    elif isinstance(value, Call | Mapping):
        for name, inner in (value.entries if isinstance(value, Call) else value).items():
            yield from _numbers(inner, (*path, name))
    elif isinstance(value, list | tuple):
        for number, inner in enumerate(value):
            yield from _numbers(inner, (*path, number))


def signal_of(question: Question, file: File) -> xr.Dataset:
    """Return the measured signal, conditioned; a Fault, or raise a ValueError that names the file."""
    if not file.is_file():
        what = "is a folder" if file.is_dir() else "there is no such file"
        raise ValueError(f"{file}: {what}; give the trace of an oscilloscope as text, such as CSV")
    asked = question.asked
    calibration: Any = asked.calibration
    if isinstance(calibration, Mapping):
        calibration = {int(name): value for name, value in calibration.items() if name.isdigit()}
    try:
        signal = read_signal(
            file, question.columns, asked.time_column, asked.time_unit, asked.unit, calibration, "lead", None,
            asked.interval, asked.start, asked.segment,
        )  # fmt: skip
        # The lead is short; identify estimates the noise from all samples.
        return clean_signal(signal, asked.mains).drop_vars("noise") if asked.condition else signal
    except ValueError as error:
        call = question.case.tree.entries["identify"]
        fault = call.fault(str(error))
        raise fault if fault.path != call.path else error from error


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
        if file is None or not str(error).startswith("signal: "):
            raise
        raise ValueError(f"{file}{str(error).removeprefix('signal')}") from None
    shown = dict(found.unknowns)
    for name, (unit, size) in question.units.items():
        shown[name] = replace(shown[name], unit=unit, unit_size=size)
    return replace(found, unknowns=shown)


def prepared(question: Question, record: float = inf) -> tuple[Question, float]:
    """Return the question of a case whose runs are as long as its signal counts, and that length, s. record: s.

    A rod gets the same mesh at all values.
    """
    until = question.asked.until
    ends = [{name: both[end] for name, both in question.ranges.items()} for end in (0, 1)]
    if until is None:
        with collected():
            middle = {name: 0.5 * sum(both) for name, both in question.ranges.items()}
            until = min(record, FROM_IMPACT * question.build(**middle).chain.transit_time)
    question = replace(question, case=question.case.changed({"run.until": until, "run.accuracy": "default"}))
    body = question.case.all("structure")[0]
    varies = any(name.startswith("structure") for name in question.ranges)
    if body.form.kind == "rod" and "elements" not in body.entries and varies:
        meshes = [question.build(**at).structure.structure.origin["elements"] for at in ends]
        elements = min(max(map(max, meshes)), MOST_ELEMENTS)
        question = replace(question, case=question.case.changed({"structure.elements": elements}))
    return question, until


def answer_of(question: Question, found: Identification) -> Answer:
    """Return what was found: tables, the case with the values found, and a simulation to sketch."""
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
    result = found.to_dataset().assign_attrs(case=question.case.to_toml())
    code = 0 if found.identified else NOT_IDENTIFIED
    notes = str(in_case).splitlines()[1 + len(found.unknowns) :]
    return Answer(result, [table, fitted], notes, sketched=question.build(**values), others=best, code=code)
