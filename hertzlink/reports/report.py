"""Reports of runs, signals, sweeps, identifications and maps."""

import json
from collections.abc import Iterable, Sequence
from contextlib import nullcontext, suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import xarray as xr

from coupling.files.writing import write_whole
from coupling.inference.identification import Identification
from coupling.plots import identified, setup
from coupling.plots.swept import varied, words_of
from coupling.results.findings import findings_of, one_of_each
from coupling.results.provenance import folded, stored
from coupling.results.schema import BATCH, RUN, SIGNAL, SWEEP, kind_of
from hertzlink.reports import in_a_sentence, setup_in_words
from hertzlink.reports.of_identifications import of_identification
from hertzlink.reports.of_maps import of_map
from hertzlink.reports.of_runs import of_many, of_one
from hertzlink.reports.page import Page, Section, Table, html, table, usual_facts
from hertzlink.reports.svg import drawn
from structures.caution import collected
from structures.checks import not_negative, short

WANTED = "must be a run, a sweep, a signal, or what identify or map_taps returned, or a Dataset of these"


def report(
    result: Any,
    path: str | Path,
    title: str | None = None,
    sensors: int | Iterable[int] | None = None,
    setup: Any = None,
    took: float | None = None,
) -> Path:
    """Write a report of a result: one HTML page with its input, figures, tables, warnings and versions.

    The page holds everything: it loads nothing, runs no scripts, and suits screens from 400 pixels on, light and dark.

    Parameters
    ----------
    result : Dataset or Identification
        A run, a sweep, a batch, a measured signal, what `identify` returned or saved, or a map of `map_taps`.
    path : path
        The file; one that exists is replaced, completely or not at all.
    title : str, optional
        By default what the result is.
    sensors : int or sequence of int, optional
        Beads, 1 to N from the struck end; by default the middle bead, all of a signal.
    setup : CoSimulation, optional
        What to sketch, for a signal or an identification, which do not hold it.
    took : float, optional
        Time that the computation took, s.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ValueError
        For anything else, and for sensors that the result does not hold.
    OSError
        If the file cannot be written.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.3)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.PTFE)).run(until=8e-4)
    >>> hl.plots.report(run, "tap.html", title="Tap on PTFE").name
    'tap.html'
    """
    if not isinstance(path, str | Path) or not str(path):
        raise ValueError(f"path = {short(path)}: must be the name of a file")
    if title is not None and not isinstance(title, str):
        raise ValueError(f"title = {short(title)}: must be text")
    seconds = None if took is None else not_negative("took", took, "s")
    # Measures that warn of what the result says already must not warn again.
    with collected() as said:
        page = page_of(result, title, sensors, setup, seconds, said)
    file = Path(path)
    write_whole(file, html(page).encode("utf-8", "replace"))
    return file


def page_of(
    result: Any, title: str | None, sensors: Any, sketched: Any, took: float | None, said: Sequence[str] = (),
    yielded: xr.Dataset | None = None,
) -> Page:  # fmt: skip
    """Return the page of a result. said: what its measures warned of, known when all are done. yielded: the same run
    with a law of yielding."""
    if isinstance(result, xr.Dataset) and "taps" in result.data_vars:
        data = result
        name, summary, sections = "Map", *of_map(data)
    elif isinstance(result, Identification) or (isinstance(result, xr.Dataset) and "verdict" in result):
        data = identified.dataset_of(result)
        name, summary, sections = "Identification", *of_identification(data)
    else:
        data = result
        kind = kind_of(data) if isinstance(data, xr.Dataset) else ""
        if kind not in (RUN, SIGNAL, SWEEP, BATCH):
            raise ValueError(f"result = {short(result)}: {WANTED}")
        single = kind in (RUN, SIGNAL)
        name = {RUN: "Run", SIGNAL: "Measured signal", SWEEP: "Sweep", BATCH: "Batch"}[kind]
        summary, sections = of_one(data, sensors, yielded) if single else of_many(data, sensors)
        summary = [*summary, in_a_sentence.DEFINED]
    warnings = one_of_each([*findings_of(data), *said])
    parts = with_setup(sections, data, sketched, warnings)
    return Page(title or name, summary, parts, usual_facts(took, data.attrs))


def with_setup(
    sections: Sequence[Section],
    data: xr.Dataset,
    sketched: Any = None,
    warnings: Sequence[str] = (),
    first: bool = True,
) -> list[Section]:
    """Return all sections: warnings, the results, among whose first pictures is a sketch of the set-up, and the input.

    sketched: what to sketch where the Dataset does not hold it. first: whether the sketch comes before other pictures.
    """
    source = data if sketched is None else sketched
    inputs: dict[str, Any] = {}
    with nullcontext() if sketched is not None else suppress(ValueError):
        inputs = setup.described_input(source, "setup")
    results, *others = sections
    tables: list[Table] = []
    if inputs:
        sketch = drawn("setup", "The set-up to scale.", lambda ax: setup.setup(source, ax))
        pictures = [sketch, *results.pictures] if first else [*results.pictures, sketch]
        results = replace(results, pictures=pictures)
        rows = [(words_of(data[name]), values) for name, values in varied(data).items()]
        tables = [table("Varied", ("parameter", "values"), rows)] if rows else []
        tables += setup_in_words.input_tables(inputs, " of the first run" if rows else "")
    return [Section("Warnings", warnings=warnings), results, *others, Section("Set-up", tables=tables), of_input(data)]


def of_input(data: xr.Dataset) -> Section:
    """Return the whole input as it is in the Dataset."""
    inputs = stored(data.attrs.get("input"))
    text = json.dumps(folded(inputs), indent=1, ensure_ascii=False)
    return Section("Input", folded=[("The whole input, as the result holds it", text)] if inputs else [])
