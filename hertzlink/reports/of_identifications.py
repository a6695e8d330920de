"""Reports of identifications."""

import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from coupling.inference.identification import Unknown, unknowns_of
from coupling.plots.identified import FEATURE, identified
from hertzlink.reports.page import Section, Table, table
from hertzlink.reports.svg import WIDTH, drawn

OF_FILE = {
    "signal": "file",
    "sensors": "columns of the sensors",
    "time_column": "column of the time",
    "time_unit": "unit of the time",
    "unit": "unit of the columns",
    "units_of_columns": "units in the file",
    "calibration": "calibration, N/V",
    "baseline": "zero of the force",
    "interval": "interval, s",
    "start": "start, s",
    "segment": "segment",
}
"""What the input of a signal says of its file, and the words of the report."""


def of_identification(data: xr.Dataset) -> tuple[list[str], list[Section]]:
    """Return what was found, how far it is known, and whether the model explains the signal."""
    unknowns = unknowns_of(data)
    explained, size = bool(data.attrs["explained"]), float(data.attrs["misfit"])
    said = "The model explains the signal" if explained else "The model does not explain the signal"
    summary = [f"{said}: its residual is {size:.3g} times the noise. {int(data.attrs['runs'])} runs."]
    file = str(_read_of(data).get("signal", "arrays"))
    if file != "arrays":
        beads = np.atleast_1d(data.sensor.values).tolist() if "sensor" in data.coords else []
        at = f", at bead {' and '.join(map(str, beads))}," if beads else ""
        summary.insert(0, f"The signal of {Path(file).name}{at} was fitted by the model that is drawn below.")
    if not explained:
        summary.append("Mend the model first: a wrong model biases values by more than any interval.")
    rows = [unknown.row() for unknown in unknowns]
    values_table = table("Unknowns", ("unknown", "value", "95 % interval", "verdict"), rows)
    words = "How well each unknown is known."
    bars = drawn("intervals", words, lambda ax: identified(data, "intervals", ax=ax), 1.4 + 0.42 * len(unknowns))
    words = "Correlations: unknowns near 1 or −1 cannot be told apart."
    together = drawn("correlation", words, lambda ax: identified(data, "correlation", ax=ax), WIDTH - 1.0)
    tables = [values_table, *_other_fits(data, unknowns)]
    pictures = []
    sensors = [] if FEATURE in data.dims else np.atleast_1d(data.sensor.values).astype(int).tolist()
    if not sensors:
        words = "AR and TOF, fitted and measured, over the measured values."
        pictures.append(drawn("fit", words, lambda ax: identified(data, ax=ax)))
        words = "What the fit leaves of AR and TOF, in units of their scatter."
        pictures.append(drawn("residual", words, lambda ax: identified(data, "residual", ax=ax)))
    for number in sensors:
        for show, words in (
            ("fit", f"Fitted over measured force at bead {number}."),
            ("residual", f"What the fit leaves at bead {number}, in units of the noise."),
        ):
            pictures.append(drawn(f"{show}-{number}", words, partial(identified, data, show, number)))
    values = Section("Values", tables=tables, pictures=[bars, together])
    return summary, [values, Section("Fit", pictures=pictures), _measurement(data)]


def _measurement(data: xr.Dataset) -> Section:
    """Return from which file the signal comes, how it was read, and what was done to it; empty where that is not
    known."""
    read = _read_of(data)
    rows = [
        (words, _in_words(read[name])) for name, words in OF_FILE.items() if read.get(name) not in (None, "", {}, [])
    ]
    if rows and "time" in data.dims:
        step = float(data.time[-1] - data.time[0]) / (data.time.size - 1)
        rows.append(("samples", f"{data.time.size}, {1e-6 / step:.6g} MHz, {1e3 * step * (data.time.size - 1):.6g} ms"))
    tables = [table("The signal, and how it was read", ("", ""), rows)] if rows else []
    return Section("Measurement", tables=tables, sentences=read.get("conditioning", []))


def _read_of(data: xr.Dataset) -> dict[str, Any]:
    """Return how the signal was read; empty where that is not known."""
    read: dict[str, Any] = json.loads(str(data.attrs.get("input", "{}"))).get("identify", {}).get("signal") or {}
    return read


def _in_words(value: Any) -> str:
    """Return a value of the input; of a mapping from sensor to value all of them."""
    return ", ".join(f"{key}: {entry}" for key, entry in value.items()) if isinstance(value, dict) else str(value)


def _other_fits(data: xr.Dataset, unknowns: list[Unknown]) -> list[Table]:
    """Return the table of the fits that the noise does not exclude, but the best."""
    if data.sizes.get("mode", 0) < 2:
        return []
    fits = data.modes.values[1:]
    determined = [i for i, column in enumerate(fits.T) if np.isfinite(column).any()]
    rows = [tuple(f"{fit[i] / unknowns[i].unit_size:.4g}" for i in determined) for fit in fits]
    return [table("Other fits that the noise does not exclude", tuple(unknowns[i].head for i in determined), rows)]
