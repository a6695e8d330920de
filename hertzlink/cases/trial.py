"""The work of a case, and about how long it takes, measured by building and running a part of it."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from importlib import import_module
from math import prod
from time import perf_counter, process_time
from typing import Any, TypeVar

import joblib
import numpy as np

from coupling.cosimulation import CoSimulation
from coupling.inference.identify import likely_runs, seconds_of_run
from coupling.inference.plates import on_modes
from coupling.inference.prediction import Prediction, range_of
from coupling.participant import CheckedParticipant
from hertzlink.cases.case import of_run
from hertzlink.cases.identify_fit import Question, question_of
from hertzlink.cases.identify_section import prepared
from hertzlink.cases.running import Build, Task
from structures.caution import collected
from structures.checks import count_of
from structures.moving import MovingStructure

PART = 10
"""The trial runs this part of the record."""

REFINED = 8
"""Runs that refine a critical distance, roughly: a scan of 10 mm down to 0.2 mm."""

Result = TypeVar("Result")


def trial(task: Task) -> str:
    """Return the lines of text: runs, chain, structure, mesh, record, time. Builds the first structure; raises what it
    raises."""
    # What this process did so far: load its code.
    loading = process_time() + timed(lambda: import_module("hertzlink.reports.report"))[0]
    first = task.first
    with collected() as warnings:
        building, simulation = timed(first.simulation)
        with of_run():
            plan = simulation.plan(first.until, first.model.run.save_every if not task.axes else None)
        short = first.until / PART
        for build in _at_ends(task):
            build()
    # Of a short run warnings mean little.
    with collected():
        # The first run loads code, or compiles what is not compiled yet.
        starting, _ = timed(lambda: simulation.run(short))
        part, _ = timed(lambda: simulation.run(short))
    starting, running = loading + max(0.0, starting - part), PART * part
    runs, built = prod(len(axis.values) for axis in task.axes), _structures(task)
    refined = REFINED * prod(len(axis.values) for axis in task.others) if task.along is not None else 0
    jobs = 1 if task.kind == "run" else min(joblib.cpu_count(), max(1, runs))
    # Processes start as this one does.
    seconds = (1 + (jobs > 1)) * starting + ((built + refined) * building + (runs + refined) * running) / jobs
    lines = [_what(task, runs, refined)]
    for axis in task.axes:
        ends = axis.shown(axis.values[0]), axis.shown(axis.values[-1])
        lines.append(f"  {axis.head}: {count_of(len(axis.values), 'value')}, {ends[0]} to {ends[1]}")
    chains, structures = simulation.interface.chains, simulation.interface.structures
    lines += [f"{_numbered('chain', i, chains)}: {chain.chain!r}" for i, chain in enumerate(chains)]
    lines += [
        f"{_numbered('structure', i, structures)}: {_structure(structure)}" for i, structure in enumerate(structures)
    ]
    lines.append(f"record: {1e3 * first.until:g} ms, saved every {1e6 * plan.interval:.3g} µs, {plan.rows} times")
    of = f" of chain {first.model.measure.chain}" if len(chains) > 1 else ""
    lines.append(f"sensors: bead {', '.join(map(str, task.sensors))}{of}")
    many = f", {jobs} processes" if jobs > 1 else ""
    lines.append(
        f"time: about {in_words(seconds)} (measured: {in_words(starting)} to start, {in_words(building)} to build a "
        "structure,"
    )
    lines.append(f"  {in_words(running)} for a run, from a tenth of one{many})")
    if task.case.model.identify is not None:
        lines += _identification(question_of(task.case))
    lines += [
        f"warning: {warning}"
        for warning in dict.fromkeys(warnings)
        if "record" not in warning and "until" not in warning
    ]
    return "\n".join(lines)


def _at_ends(task: Task) -> Iterator[Callable[[], CoSimulation]]:
    """Yield the builders at the least and the greatest value of each axis, at all that are no numbers, and else as the
    first."""
    build, first = Build(task.case, task.axes), {axis.name: axis.values[0] for axis in task.axes}
    for axis in task.axes:
        ends = [min(axis.values), max(axis.values)] if axis.is_number else axis.values
        for value in ends:
            if value != first[axis.name]:
                yield partial(build, **{**first, axis.name: value})


def _identification(question: Question) -> list[str]:
    """Return what `hertzlink identify` likely takes."""
    question, until = prepared(question)
    build: Callable[..., CoSimulation] = question.build
    columns = list(question.columns)
    modes = on_modes(build, question.ranges, until)
    names = [name for name in question.ranges if name not in question.nuisances]
    unknowns = len(names) or len(question.ranges)
    runs = likely_runs(unknowns, len(question.ranges) - unknowns)
    ranges = [range_of(name, ends) for name, ends in question.ranges.items()]
    with collected():
        prediction = Prediction(modes or build, ranges, columns, until)
        starting = seconds_of_run(prediction, [0.5])
        each = seconds_of_run(prediction, [0.3, 0.4, 0.6])
    return [
        f"identify: {count_of(len(ranges), 'unknown')}, likely about {runs} runs, {in_words(starting + runs * each)}",
        f"  (measured: {in_words(each)} to build and run)",
        *["  on the modes of the plate"] * (modes is not None),
    ]


def timed(do: Callable[[], Result]) -> tuple[float, Result]:
    """Return the seconds that something takes, and what it returns."""
    begin = perf_counter()
    result = do()
    return perf_counter() - begin, result


def _numbered(word: str, number: int, many: Sequence[Any]) -> str:
    """Return a word, with its number where there are several."""
    return f"{word} {number}" if len(many) > 1 else word


def _what(task: Task, runs: int, refined: int) -> str:
    if task.kind == "run":
        return "one run"
    if task.along is None:
        return f"a sweep of {count_of(runs, 'run')}"
    return f"a critical distance from {count_of(runs, 'run')}, and about {refined} more that refine it"


def _structures(task: Task) -> int:
    """Return how many different structures are built."""
    return prod(len(axis.values) for axis in task.axes if axis.path[0] != "chain")


def _structure(moving: MovingStructure | CheckedParticipant) -> str:
    if isinstance(moving, CheckedParticipant):
        return "a structure of your own"
    origin = moving.structure.origin
    kind = str(origin.get("kind", "nothing"))
    if "reduction" in origin:
        of = origin["reduction"]["full_size"]
        return f"{kind}, a mesh of {of} unknowns, reduced to {count_of(moving.structure.size, 'oscillator')}"
    return f"{kind}, {count_of(moving.structure.size, 'unknown')}" if moving.structure.size else f"{kind}, no unknowns"


def in_words(seconds: float) -> str:
    """Return a time in a unit that suits it, with two digits."""
    for limit, size, unit in ((1.0, 1e-3, "ms"), (120.0, 1.0, "s"), (7200.0, 60.0, "minutes"), (np.inf, 3600.0, "h")):
        if seconds < limit:
            return f"{float(f'{seconds / size:.2g}'):g} {unit}"
    raise AssertionError
