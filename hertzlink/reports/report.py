"""The report of a result: its answer in a sentence, the set-up, figures, tables, warnings and the input."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import xarray as xr

from coupling.inference.identification import Identification
from coupling.results.findings import findings_of, one_of_each
from coupling.results.schema import BATCH, RUN, SIGNAL, SWEEP, kind_of
from hertzlink.output import write_file
from hertzlink.reports import Page, html, sketch_and_input, usual_facts
from hertzlink.reports.results import critical_page, identification_page, map_page, run_page, sweep_page
from structures.caution import collected
from structures.checks import short


def report(
    result: Any, path: str | Path, title: str | None = None, sensors: int | Iterable[int] | None = None,
    setup: Any = None,
) -> Path:  # fmt: skip
    """Write a report of a result: one HTML page with its answer, figures, tables, warnings, input and versions.

    The page loads nothing, runs no scripts, and suits screens from 400 pixels on, light and dark.

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

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.3), hl.half_space(hl.PTFE)).run(until=8e-4)
    >>> hl.plots.report(run, "tap.html", title="Tap on PTFE").name
    'tap.html'
    """
    if not isinstance(path, str | Path) or not str(path):
        raise ValueError(f"path = {short(path)}: must be the name of a file")
    if Path(path).is_dir() or not Path(path).parent.is_dir():
        raise ValueError(f"path = {str(path)!r}: must be a file in a folder that exists")
    if title is not None and not isinstance(title, str):
        raise ValueError(f"title = {short(title)}: must be text")
    write_file(Path(path), html(page_of(result, title, sensors, setup)).encode("utf-8", "replace"))
    return Path(path)


def page_of(
    result: Any, title: str | None = None, sensors: Any = None, setup: Any = None, took: float | None = None,
    yielded: xr.Dataset | None = None,
) -> Page:  # fmt: skip
    """Return the page of a result. took: s. yielded: the same with contacts that yield."""
    data = result.to_dataset() if isinstance(result, Identification) else result
    if not isinstance(data, xr.Dataset):
        data = xr.Dataset()  # which is refused below
    # Measures warn of what the result says already, or what its page will say.
    with collected() as said:
        if "taps" in data:
            page = map_page(data)
        elif "verdict" in data:
            page = identification_page(data)
        elif "bracket" in data:
            page = critical_page(data, yielded)
        elif "amplitude_ratio" in data or kind_of(data) in (SWEEP, BATCH):
            page = sweep_page(data, sensors)
        elif kind_of(data) in (RUN, SIGNAL):
            page = run_page(data, sensors, yielded)
        else:
            has_cure = hasattr(result, "noted_in")  # a budget, which a run can hold
            what = f"is of {type(result).__name__}" if has_cure else f"= {short(result)}"
            cure = "the run that it is of, budget.noted_in(run, ...)" if has_cure else "a run, a sweep, a signal"
            raise ValueError(f"result {what}: must be {cure}, or what identify or map_taps returned, as a Dataset too")
        sketch, page.texts = sketch_and_input(data, setup)
    page.title = title or page.title
    page.pictures[:0] = sketch
    page.warnings = one_of_each([*findings_of(data), *said])
    page.facts = usual_facts(None if "taps" in data else took, data.attrs)  # a map may continue an earlier one
    return page
