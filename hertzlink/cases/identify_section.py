"""The section [identify] of a case: its measured signal from a file, and the unknowns that it gives."""

from collections.abc import Mapping
from dataclasses import replace
from math import inf
from pathlib import Path as File
from typing import Any

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.identification import Identification
from coupling.inference.prediction import FROM_IMPACT
from coupling.results.conditioning import clean_signal
from coupling.results.signals import read_signal
from hertzlink.cases.bodies import Rod
from hertzlink.cases.case import Case
from hertzlink.cases.entry_paths import Path
from hertzlink.cases.faults import Fault, fault_of, of_case
from hertzlink.cases.identify_fit import Question, identified
from hertzlink.cases.tables import csv_text, table
from structures.caution import collected
from structures.units import readable

MOST_ELEMENTS = 400
"""Elements of a layer whose mesh is the same for all values."""

NAMES: dict[str, Path] = {
    name: ("identify", name)
    for name in ("calibration", "time_unit", "unit", "time_column", "sensors", "interval", "start", "segment")
}
"""Arguments of read_signal that are entries of a case."""

OF_UNKNOWNS = ("unknown", "value (SI)", "low", "high", "verdict", "residual over noise")
"""The columns of unknowns.csv; the last is that of the fit, the same in all rows."""


def signal_of(question: Question, file: File) -> xr.Dataset:
    """Return the measured signal, conditioned; a Fault, or raise a ValueError that names the file."""
    if not file.is_file():
        what = "is a folder" if file.is_dir() else "there is no such file"
        raise ValueError(f"{file}: {what}; give the trace of an oscilloscope as text, such as CSV")
    part = question.part
    try:
        signal = _read(question, file, "lead")
        # The lead is short; identify estimates the noise from all samples.
        return clean_signal(signal, part.mains).drop_vars("noise") if part.condition else signal
    except ValueError as error:
        fault = fault_of(str(error), NAMES)
        if fault.path:
            raise fault from error
        if reason := _too_short(question, file):
            raise ValueError(f"{file}: {reason}") from error
        raise


def of_file(error: ValueError, file: File) -> ValueError:
    """Return what identify says of its signal, as said of the file."""
    head, colon, rest = str(error).partition(": ")
    return ValueError(f"{file}{colon}{rest}") if head == "signal" else error


def _read(question: Question, file: File, baseline: float | str) -> xr.Dataset:
    part = question.part
    calibration: Any = part.calibration
    if isinstance(calibration, Mapping):
        calibration = {int(name): value for name, value in calibration.items() if name.isdigit()}
    return read_signal(
        file, question.columns, part.time_column, part.time_unit, part.unit, calibration, baseline, None,
        part.interval, part.start, part.segment,
    )  # fmt: skip


def _too_short(question: Question, file: File) -> str:
    """Return whether the record is too short for the wave that comes back to the first sensor, and how long that
    takes."""
    with collected():
        try:
            time = _read(question, file, 0.0).time
            moving = question.build(**question.middle).chain
        except (Fault, ValueError):
            return ""  # what is wrong with these has been said
    record, bead, beads = float(time[-1] - time[0]), min(question.columns), len(moving.chain.beads)
    needed = (2.0 - bead / beads) * moving.transit_time + moving.contact_time
    if record >= needed:
        return ""
    return (
        f"its record of {readable(record, 's', 4)} is too short: the wave is back at bead {bead} about "
        f"{readable(needed, 's', 4)} "
        "after the impact; record longer, from before the impact on"
    )


def answer(question: Question, signal: xr.Dataset) -> Identification:
    """Return what the signal says about the unknowns, in the units of the case."""
    question, until = prepared(question, float(signal.time[-1] - signal.time[0]))
    identification = identified(question, signal, until)
    shown = dict(identification.unknowns)
    for name, (unit, size) in question.units.items():
        shown[name] = replace(shown[name], unit=unit, unit_size=size)
    return replace(identification, unknowns=shown)


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
    if not isinstance(body, Rod) or body.elements or not question.of_structure:
        return case.data
    counts = []
    for end in (0, 1):
        values = {name: ends[end] for name, ends in question.ranges.items()}
        origin = replace(question, case=case).build(**values).structure.structure.origin
        counts.append(max(origin["elements"]))
    return case.changed({"structure.elements": min(max(counts), MOST_ELEMENTS)}).data


def tables(question: Question, identification: Identification) -> tuple[str, dict[str, str]]:
    """Return the text for the terminal, and files by name."""
    plain = [
        [name, unknown.value, *unknown.interval, unknown.verdict, identification.misfit]
        for name, unknown in identification.unknowns.items()
    ]
    head = ["unknown", "value", "95 % interval", "verdict"]
    lines = table(head, [unknown.row() for unknown in identification.unknowns.values()], "unknowns.csv")
    in_case = replace(identification, warnings=[of_case(warning) for warning in identification.warnings])
    notes = str(in_case).splitlines()[1 + len(identification.unknowns) :]
    text = "\n".join([*lines, *notes])
    values = {name: identification[name].value for name in question.ranges}
    return text, {
        "unknowns.csv": csv_text(OF_UNKNOWNS, plain),
        "fit.csv": _fit(identification.data),
        "identified.toml" if identification.explained else "best_fit.toml": question.case.changed(values).to_toml(),
    }


def _fit(data: xr.Dataset) -> str:
    """Return what was measured and what is fitted: traces, or values of AR and TOF."""
    what = ("measured", "fitted")
    if "feature" in data.dims:
        rows = zip(data.feature.values, *(data[quantity].values for quantity in what), strict=True)
        return csv_text(["AR, or TOF (s)", *what], [list(row) for row in rows])
    names = [f"{quantity} at bead {bead} (N)" for bead in data.sensor.values for quantity in what]
    columns = [data[quantity].sel(sensor=bead).values for bead in data.sensor.values for quantity in what]
    return csv_text(["time (s)", *names], np.column_stack([data.time.values, *columns]).tolist())


def simulation_of(question: Question, identification: Identification) -> CoSimulation:
    """Return what was identified, as a simulation, for a sketch."""
    return question.build(**{name: identification[name].value for name in question.ranges})
