"""Unknowns of a case from a measured signal: the section [identify]."""

from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import Identification
from coupling.inference.prediction import FROM_IMPACT
from hertzlink.cases.bodies import LayeredCylinder, Rod
from hertzlink.cases.case import Case
from hertzlink.cases.faults import of_case
from hertzlink.cases.questions import Question, identified
from hertzlink.cases.report import csv_text, table
from structures.caution import collected

MOST_ELEMENTS = 400
"""Elements of a layer whose mesh is the same for all values."""

OF_UNKNOWNS = ("unknown", "value (SI)", "low", "high", "verdict", "residual over noise")
"""The columns of unknowns.csv; the last is that of the fit, the same in all rows."""


def answer(question: Question, signal: xr.Dataset) -> Identification:
    """Return what the signal says about the unknowns, in the units of the case."""
    question, until = prepared(question, float(signal.time[-1] - signal.time[0]))
    found = identified(question, signal, until)
    shown = dict(found.unknowns)
    for name, (unit, size) in question.units.items():
        shown[name] = replace(shown[name], unit=unit, unit_size=size)
    return replace(found, unknowns=shown)


def prepared(question: Question, record: float = inf) -> tuple[Question, float]:
    """Return the question of a case whose runs are as long as its signal counts, and that length, s. record: s."""
    until = question.part.until
    if until is None:
        with collected():
            chain = question.build(**question.middle).chain
        until = min(record, FROM_IMPACT * chain.transit_time)
    data = question.case.changed({"run.until": until, "run.accuracy": "default"})
    return replace(question, case=replace(question.case, data=_same_mesh(data, question))), until


def _same_mesh(case: Case, question: Question) -> dict[str, Any]:
    """Return the data of the case, in which a rod has the same mesh at all values."""
    body = case.model.structure
    if not isinstance(body, Rod) or isinstance(body, LayeredCylinder) or body.elements or not question.of_structure:
        return case.data
    counts = []
    for end in (0, 1):
        values = {name: ends[end] for name, ends in question.ranges.items()}
        origin = replace(question, case=case).build(**values).structure.structure.origin
        counts.append(max(origin["elements"]))
    return case.changed({"structure.elements": min(max(counts), MOST_ELEMENTS)}).data


def tables(question: Question, found: Identification) -> tuple[str, dict[str, str]]:
    """Return the text for the terminal, and files by name."""
    plain = [[name, one.value, *one.interval, one.verdict, found.misfit] for name, one in found.unknowns.items()]
    head = ["unknown", "value", "95 % interval", "verdict"]
    lines = table(head, [one.row() for one in found.unknowns.values()], "unknowns.csv")
    in_case = replace(found, warnings=[of_case(one) for one in found.warnings])
    notes = str(in_case).splitlines()[1 + len(found.unknowns) :]
    text = "\n".join([*lines, *notes])
    values = {name: found[name].value for name in question.ranges}
    return text, {
        "unknowns.csv": csv_text(OF_UNKNOWNS, plain),
        "fit.csv": _fit(found.data),
        "identified.toml" if found.explained else "best_fit.toml": question.case.changed(values).to_toml(),
    }


def _fit(data: xr.Dataset) -> str:
    """Return what was measured and what is fitted: traces, or values of AR and TOF."""
    what = ("measured", "fitted")
    if "feature" in data.dims:
        rows = zip(data.feature.values, *(data[one].values for one in what), strict=True)
        return csv_text(["AR, or TOF (s)", *what], [list(row) for row in rows])
    names = [f"{one} at bead {bead} (N)" for bead in data.sensor.values for one in what]
    columns = [data[one].sel(sensor=bead).values for bead in data.sensor.values for one in what]
    return csv_text(["time (s)", *names], np.column_stack([data.time.values, *columns]).tolist())


def simulation_of(question: Question, found: Identification) -> CoSimulation:
    """Return what was found, as a simulation, for a sketch."""
    return question.build(**{name: found[name].value for name in question.ranges})
