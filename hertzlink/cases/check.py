"""What `hertzlink check` says: the work of a case, and about how long it takes, measured on a part of it."""

from math import prod
from time import perf_counter

import joblib

from coupling.inference.plates import on_modes
from coupling.participant import CheckedParticipant
from hertzlink.cases.identification import prepared, question_of
from hertzlink.cases.tasks import Task
from structures.caution import collected
from structures.checks import count_of
from structures.moving import MovingStructure
from structures.units import readable

PART = 10
"""The trial runs this part of the record."""

REFINED = 8
"""Runs that refine a critical distance, roughly: a scan of 10 mm down to 0.2 mm."""


def outlook(task: Task) -> str:
    """Return the lines of text: runs, chain, structure, mesh, record, time. Builds the first structure, and those at
    the ends of each axis; raises what they raise."""
    first = task.first
    with collected() as warnings:
        began = perf_counter()
        simulation = first.simulation()
        building = perf_counter() - began
        with first.located():
            save_every = first.tree.entries["run"].entries.get("save_every")
            plan = simulation.plan(first.until, None if task.axes else save_every)
        for axis in task.axes:
            for value in [min(axis.values), max(axis.values)] if axis.is_number else axis.values:
                if value != axis.values[0]:
                    first.changed({axis.path: value}).simulation()
    with collected():  # Of a short run warnings mean little.
        began = perf_counter()
        simulation.run(first.until / PART)  # compiles what is not compiled yet
        middle = perf_counter()
        simulation.run(first.until / PART)
        part = perf_counter() - middle
    starting, running = max(0.0, middle - began - part), PART * part

    runs = prod(len(axis.values) for axis in task.axes)
    built = prod(len(axis.values) for axis in task.axes if axis.path[0] != "chain")
    refined = REFINED * prod(len(axis.values) for axis in task.others) if task.along is not None else 0
    jobs = min(joblib.cpu_count(), runs)
    seconds = starting + ((built + refined) * building + (runs + refined) * running) / jobs
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
    total, start, build, run = (readable(time, "s", 2) for time in (seconds, starting, building, running))
    lines.append(f"time: about {total} (measured: {start} to start, {build} to build a structure,")
    lines.append(f"  {run} for a run, from a tenth of one; {count_of(jobs, 'process', 'processes')})")
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
    of = origin["reduction"]["full_size"] if "reduction" in origin else 0
    words = f"a mesh of {of} unknowns, reduced to {count_of(size, 'oscillator')}" if of else count_of(size, "unknown")
    return f"{origin.get('kind', 'nothing')}, {words}"
