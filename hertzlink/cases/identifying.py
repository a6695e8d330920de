"""Unknowns of a case from a measured signal: the section [identify]."""

from dataclasses import replace
from math import inf
from textwrap import fill
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import Identification
from coupling.inference.prediction import FROM_IMPACT
from coupling.sweeps.batch import batch
from hertzlink.cases.bodies import LayeredCylinder, Rod
from hertzlink.cases.case import Case
from hertzlink.cases.faults import of_case
from hertzlink.cases.plate_accuracy import Fit, frequency_of
from hertzlink.cases.plate_models import edge_of
from hertzlink.cases.plate_search import by_one_edge
from hertzlink.cases.questions import Builder, Question, identified, texts
from hertzlink.cases.report import WIDTH, csv_text, table
from structures.caution import collected

MOST_ELEMENTS = 400
"""Elements of a layer whose mesh is the same for all values."""

OF_UNKNOWNS = ("unknown", "value (SI)", "low", "high", "verdict", "residual over noise")
"""The columns of unknowns.csv; the last is that of the fit, the same in all rows."""


def answer(question: Question, signal: xr.Dataset) -> tuple[Identification, list[str]]:
    """What the signal says about the unknowns, in the units of the case, and remarks on how it was found."""
    found, remarks = _found(question, signal)
    shown = dict(found.unknowns)
    for name, (unit, size) in question.units.items():
        shown[name] = replace(shown[name], unit=unit, unit_size=size)
    return replace(found, unknowns=shown), remarks


def prepared(question: Question, record: float = inf) -> tuple[Question, float]:
    """The question of a case whose runs are as long as its signal counts, and that length, s. record: s."""
    until = question.part.until
    if until is None:
        with collected():
            chain = Builder(question)(**question.middle).chain
        until = min(record, FROM_IMPACT * chain.transit_time)
    data = question.case.changed({"run.until": until, "run.accuracy": "default"})
    return replace(question, case=Case(_same_mesh(data, question), question.case.folder)), until


def has_edge(question: Question) -> bool:
    """Whether a plate with one edge stands for the structure."""
    edge = edge_of(question.case.changed(texts(question, question.middle)).model)
    return edge is not None and bool(question.of_structure)


def _found(question: Question, signal: xr.Dataset) -> tuple[Identification, list[str]]:
    question, until = prepared(question, float(signal.time[-1] - signal.time[0]))
    common = {"until": until}
    if question.part.search != "full" and has_edge(question):
        return by_one_edge(question, signal, common)
    # The first batch loads compiled code, which identify would count as the time of a run.
    rows: dict[str, Any] = {name: [value] for name, value in question.middle.items()}
    with collected():
        batch(Builder(question), until, threads=1, sensors=list(question.columns), **rows)
    found = identified(question, signal, Builder(question), common)
    fit = Fit(question, found, Builder(question), frequency_of(question.case)) if has_edge(question) else None
    return found, fit.remarks() if fit else []


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
    plain = [[name, one.value, *one.interval, one.verdict, found.misfit] for name, one in found.unknowns.items()]
    head = ["unknown", "value", "95 % interval", "verdict"]
    lines = table(head, [one.row() for one in found.unknowns.values()], "unknowns.csv")
    in_case = replace(found, warnings=[of_case(one) for one in found.warnings])
    notes = str(in_case).splitlines()[1 + len(found.unknowns) :]
    remarks = [fill(one, WIDTH, subsequent_indent="  ") for one in remarks]
    text = "\n".join([*lines, *notes, *remarks])
    values = {name: found[name].value for name in question.ranges}
    return text, {
        "unknowns.csv": csv_text(OF_UNKNOWNS, plain),
        "fit.csv": _fit(found.data),
        "identified.toml" if found.explained else "best_fit.toml": question.case.changed(
            texts(question, values)
        ).to_toml(),
    }


def _fit(data: xr.Dataset) -> str:
    """What was measured and what is fitted: traces, or values of AR and TOF."""
    what = ("measured", "fitted")
    if "feature" in data.dims:
        rows = zip(data.feature.values, *(data[one].values for one in what), strict=True)
        return csv_text(["AR, or TOF (s)", *what], [list(row) for row in rows])
    names = [f"{one} at bead {bead} (N)" for bead in data.sensor.values for one in what]
    columns = [data[one].sel(sensor=bead).values for bead in data.sensor.values for one in what]
    return csv_text(["time (s)", *names], np.column_stack([data.time.values, *columns]).tolist())


def simulation_of(question: Question, found: Identification) -> CoSimulation:
    """What was found, as a simulation, for a sketch."""
    return Builder(question)(**{name: found[name].value for name in question.ranges})
