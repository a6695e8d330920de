"""The text of `hertzlink check`: the runs that a case would make."""

from math import prod

from hertzlink.cases.tasks import Task
from structures.caution import collected
from structures.checks import count_of
from structures.moving import MovingStructure
from structures.units import readable


def outlook(task: Task) -> str:
    """Return the text. The structures at the first point and at the ends of each axis are built."""
    first = task.first
    with collected() as warnings:
        simulation = task(**task.start)
        with first.located():
            save_every = first.tree.entries["run"].entries.get("save_every")
            plan = simulation.plan(first.until, None if task.axes else save_every)
        for point in task.ends:
            task(**point)

    runs = count_of(prod(len(axis.values) for axis in task.axes), "run")
    refined = f"a critical distance from {runs}, and some more that refine it"
    lines = [{"run": "one run", "sweep": f"a sweep of {runs}", "critical distance": refined}[task.kind]]
    for axis in task.axes:
        ends = axis.shown(axis.values[0]), axis.shown(axis.values[-1])
        lines.append(f"  {axis.head}: {count_of(len(axis.values), 'value')}, {ends[0]} to {ends[1]}")
    chains = simulation.interface.chains
    lines += [f"chain{f' {i}' * (len(chains) > 1)}: {one.chain!r}" for i, one in enumerate(chains)]
    bodies = [one.structure for one in simulation.interface.structures if isinstance(one, MovingStructure)]
    if all(one.surface is None for one in chains):
        bodies = []
        lines.append("structure: nothing; the last bead flies off")
    for i, body in enumerate(bodies):
        size = f", {count_of(body.size, 'unknown')}" if body.size else ""
        if full := body.origin.get("reduction", {}).get("full_size"):
            size = f", a mesh of {full} unknowns, reduced to {count_of(body.size, 'oscillator')}"
        lines.append(f"structure{f' {i}' * (len(bodies) > 1)}: {body.origin.get('kind', 'of your own')}{size}")
    lines.append(f"record: {1e3 * first.until:g} ms, saved every {1e6 * plan.interval:.3g} µs, {plan.rows} times")
    if bodies and first.until < (back := 2.0 * max(one.transit_time for one in chains)):
        lines[-1] += f"; too short: a wave takes about {readable(back, 's', 2)} to the structure and back"
    of = f" of chain {first.measure.chain}" if len(chains) > 1 else ""
    lines.append(f"sensors: bead{'s' * (len(task.sensors) > 1)} {', '.join(map(str, task.sensors))}{of}")
    if task.case.identify is not None:
        from hertzlink.cases.identification import question_of

        nuisances = task.case.identify["nuisances"]
        unknowns = [name for name in question_of(task.case).ranges if name not in nuisances]
        lines.append(f"identify: {count_of(len(unknowns), 'unknown')}, {count_of(len(nuisances), 'nuisance')}")
    said = [warning for warning in dict.fromkeys(warnings) if "record" not in warning and "until" not in warning]
    return "\n".join([*lines, *(f"warning: {warning}" for warning in said)])
