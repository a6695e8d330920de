"""The measured signal of the section [identify], from its file."""

from collections.abc import Mapping
from pathlib import Path as File
from typing import Any

import xarray as xr

from coupling.results.conditioning import clean_signal
from coupling.results.signals import read_signal
from hertzlink.cases.entry_paths import Path
from hertzlink.cases.faults import Fault, fault_of
from hertzlink.cases.questions import Question
from structures.caution import collected
from structures.units import readable

NAMES: dict[str, Path] = {
    name: ("identify", name)
    for name in ("calibration", "time_unit", "unit", "time_column", "sensors", "interval", "start", "segment")
}
"""Arguments of read_signal that are entries of a case."""


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
