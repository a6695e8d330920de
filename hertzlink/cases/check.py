"""What `hertzlink check` says: the work of a case, and about how long it takes, measured on a part of it."""

from importlib import import_module
from math import prod
from time import perf_counter, process_time

import joblib

from coupling.inference.plates import on_modes
from coupling.participant import CheckedParticipant
from hertzlink.cases.case import of_run
from hertzlink.cases.identification import prepared, question_of
from hertzlink.cases.tasks import Task
from structures.caution import collected
from structures.checks import count_of
from structures.moving import MovingStructure

PART = 10
"""The trial runs this part of the record."""

REFINED = 8
"""Runs that refine a critical distance, roughly: a scan of 10 mm down to 0.2 mm."""


def outlook(task: Task) -> str:
    """Return the lines of text: runs, chain, structure, mesh, record, time. Builds the first structure, and those at
    the ends of each axis; raises what they raise."""
    began = perf_counter()
    # What this process did so far: load its code.
    loading = process_time()
    for module in ("cases.tables", "reports.report"):
        import_module(f"hertzlink.{module}")
    loading += perf_counter() - began

    first, clock = task.first, [perf_counter()]
    with collected() as warnings:
        simulation = first.simulation()
        clock.append(perf_counter())
        with of_run(first):
            save_every = first.tree.entries["run"].entries.get("save_every")
            plan = simulation.plan(first.until, save_every if not task.axes else None)
        for axis in task.axes:
            for value in [min(axis.values), max(axis.values)] if axis.is_number else axis.values:
                if value != axis.values[0]:
                    first.changed({axis.path: value}).simulation()
    # Of a short run warnings mean little. The first one loads code, or compiles what is not compiled yet.
    with collected():
        clock.append(perf_counter())
        simulation.run(first.until / PART)
        clock.append(perf_counter())
        simulation.run(first.until / PART)
        clock.append(perf_counter())
    building, part = clock[1] - clock[0], clock[4] - clock[3]
    starting, running = loading + max(0.0, clock[3] - clock[2] - part), PART * part

    runs = prod(len(axis.values) for axis in task.axes)
    built = prod(len(axis.values) for axis in task.axes if axis.path[0] != "chain")
    refined = REFINED * prod(len(axis.values) for axis in task.others) if task.along is not None else 0
    jobs = 1 if task.kind == "run" else min(joblib.cpu_count(), max(1, runs))
    # Processes start as this one does.
    seconds = (1 + (jobs > 1)) * starting + ((built + refined) * building + (runs + refined) * running) / jobs
    many = count_of(runs, "run")
    critical = f"a critical distance from {many}, and about {refined} more that refine it"
    lines = [{"run": "one run", "sweep": f"a sweep of {many}", "critical distance": critical}[task.kind]]
    for axis in task.axes:
        ends = axis.shown(axis.values[0]), axis.shown(axis.values[-1])
        lines.append(f"  {axis.head}: {count_of(len(axis.values), 'value')}, {ends[0]} to {ends[1]}")
    chains, structures = simulation.interface.chains, simulation.interface.structures
    bodies = {"chain": [repr(one.chain) for one in chains], "structure": [_structure(one) for one in structures]}
    for word, texts in bodies.items():
        lines += [f"{word}{f' {i}' if len(texts) > 1 else ''}: {text}" for i, text in enumerate(texts)]
    lines.append(f"record: {1e3 * first.until:g} ms, saved every {1e6 * plan.interval:.3g} µs, {plan.rows} times")
    of = f" of chain {first.measure.chain}" if len(chains) > 1 else ""
    lines.append(f"sensors: bead {', '.join(map(str, task.sensors))}{of}")
    many_jobs = f", {jobs} processes" if jobs > 1 else ""
    lines.append(
        f"time: about {in_words(seconds)} (measured: {in_words(starting)} to start, {in_words(building)} to build a "
        f"structure,\n  {in_words(running)} for a run, from a tenth of one{many_jobs})"
    )
    if task.case.identify is not None:
        question, until = prepared(question_of(task.case))
        lines.append(f"identify: {count_of(len(question.ranges), 'unknown')}")
        if on_modes(question.build, question.ranges, until) is not None:
            lines.append("  on the modes of the plate")
    said = [warning for warning in dict.fromkeys(warnings) if "record" not in warning and "until" not in warning]
    return "\n".join([*lines, *(f"warning: {warning}" for warning in said)])


def _structure(moving: MovingStructure | CheckedParticipant) -> str:
    """Return a structure in a few words."""
    if isinstance(moving, CheckedParticipant):
        return "a structure of your own"
    size, origin = moving.structure.size, moving.structure.origin
    kind = str(origin.get("kind", "nothing"))
    if "reduction" in origin:
        of = origin["reduction"]["full_size"]
        return f"{kind}, a mesh of {of} unknowns, reduced to {count_of(size, 'oscillator')}"
    return f"{kind}, {count_of(size, 'unknown')}" if size else f"{kind}, no unknowns"


def in_words(seconds: float) -> str:
    """Return a time in a unit that suits it, with two digits."""
    limits = ((1.0, 1e-3, "ms"), (120.0, 1.0, "s"), (7200.0, 60.0, "minutes"), (float("inf"), 3600.0, "h"))
    size, unit = next((size, unit) for limit, size, unit in limits if seconds < limit)
    return f"{float(f'{seconds / size:.2g}'):g} {unit}"
