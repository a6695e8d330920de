"""The checks before a run and after it: each finding is a line of `warnings`, and a warning to the user."""

from collections.abc import Iterator, Sequence
from itertools import chain as joined
from typing import TypeAlias

import numpy as np

from coupling.interface import Interface
from coupling.kernels.records import Records
from coupling.recording.frames import Frames, Motion, checked_contacts, middle_of, motion_of
from coupling.results.ar_and_tof import SMALLEST_WAVE
from coupling.results.findings import warn
from coupling.results.missing_waves import RECORD, end_of_push, short_record
from coupling.structure_checks import check_structures
from coupling.yield_check import yields
from particles.kernels.drives import MOVED, PUSHED
from particles.moving import MovingChain
from structures.structure import Vector
from structures.units import readable

LARGE = 1e-3  # part of the impact energy that a run may create or lose without a warning
LONG = 200.0  # a record is too long if a wave could run to the structure and back this many times
ROUNDING = 4.0 * float(np.finfo(float).eps)  # part of a stored energy that each contact may add to their sum's rounding
MOST_OF_A_RUN = 1e9  # steps of beads in a run that nobody asked for: some minutes
SHORTER = (1e-3, 1e-6)  # what `until` is multiplied by where ms or µs may be meant
MANY_STEPS = 1e7  # steps of a short chain in some 10 s; a strong loss inside beads stops no wave, but needs short steps
SILENT = 0.01  # part of the incident wave's force that a reflected one has at least in mid chain

SUDDEN = 50.0
"""A loss is too strong if it would stop a contact in this part of the contact's time: no wave passes. The loss of a
restitution of 0.01 takes a 38th of that time, a dashpot of 5 N s/m between beads of 10 mm ten times as long."""

Found: TypeAlias = Iterator[tuple[int, str]]
"""Findings on some runs, each with the number of its run."""


def check_before(chains: Sequence[MovingChain], until: float) -> list[str]:
    """Return the findings before a run: a record so long, or a loss so strong, that another unit may be meant."""
    findings, (once, longest) = dict[str, None](), _usual_times(chains)
    if until > LONG * longest:
        times = f"{until / once:.2g} times the {readable(once, 's', 4)} that a wave takes through the chain and back"
        findings[f"until = {until:g} s: is {times}{_meant(longest, until)}"] = None
    for chain in filter(_is_sudden, chains):
        name, in_contact = chain.strongest_loss
        steps, part = until / chain.longest_step, f"1/{chain.contact_time / chain.damping_time:.0f}"
        if in_contact:
            words = f"a contact in {part} of the contact's time, so no wave passes and the run takes {steps:.2g} steps"
            findings[f"{name}: would stop {words}; check its unit"] = None
        elif steps > MANY_STEPS:
            words = f"a vibration in {part} of a contact's time, so the run takes {steps:.2g} steps"
            findings[f"{name}: would stop {words}; check its unit, or take fewer modes"] = None
    return list(findings)


def check_effort(chains: Sequence[MovingChain], until: float, most: float) -> None:
    """Raise a ValueError for a run of more than `most` steps of beads, which names what makes them many."""
    steps = float(sum(chain.steps(until) * chain.mass.size for chain in chains))
    if steps <= most:
        return
    losses = [chain.strongest_loss[0] for chain in chains if chain.dt is None and _is_sudden(chain)]
    step = chains[0].dt
    name = [*losses, f"until = {until!r}" if step is None else f"dt = {step!r}"][0]
    asked = f"give most_steps = {float(f'{1.1 * steps:.1e}'):g} if it is meant"
    raise ValueError(f"{name}: takes {steps:.2g} steps of beads; {asked}{_meant(_usual_times(chains)[1], until)}")


def _usual_times(chains: Sequence[MovingChain]) -> tuple[float, float]:
    """Return the time of a wave through the longest chain and back, s, or of a longer history that drives a chain."""
    once = max(2.0 * chain.transit_time + chain.contact_time for chain in chains)
    return once, max(once, *(float(chain.chain.excitation.drive.history[0, -1]) for chain in chains))


def _meant(longest: float, until: float) -> str:
    """Return the question whether a record that is far too long is in another unit; empty for another one."""
    meant = [factor * until for factor in SHORTER if factor * until <= LONG * longest < until]
    return f"; did you mean until = {meant[0]:.4g} ({readable(meant[0], 's', 4)})?" if meant else ""


def _is_sudden(chain: MovingChain) -> bool:
    """Return whether a loss ends motion so soon that its coefficient may be in another unit; it then sets the step."""
    return chain.contact_time > SUDDEN * chain.damping_time


def checked(interfaces: Sequence[Interface], frames: Sequence[Frames], interval: float) -> list[list[str]]:
    """Return the findings of all checks after each of some runs saved every `interval` s; the user is warned of each.

    The chains of several runs differ in their speed only. A contact law warned of its own limits when it was made; here
    they are findings only.
    """
    first, numbers = interfaces[0], range(len(interfaces))
    chains = [[interface.chains[number] for interface in interfaces] for number in range(len(first.chains))]
    motions = [motion_of(of_runs[0], [run.chains[number] for run in frames]) for number, of_runs in enumerate(chains)]
    laws, findings = [list[str]() for _ in numbers], [list[str]() for _ in numbers]
    for chain, motion in zip(first.chains, motions, strict=True):
        # The deepest approaches of all runs tell whether there is anything to say.
        for run in numbers if any(chain.cautions(motion.deepest.max(axis=0))) else ():
            remarks, deep = chain.cautions(motion.deepest[run])
            laws[run] += remarks
            findings[run] += deep
    times = interval * np.arange(frames[0].rows, dtype=float)
    highest = np.array([run.saved.surface[2] for run in frames])
    found = [*_of_energy(interfaces, frames)]
    for number, motion in enumerate(motions):
        where = "mid chain" if len(motions) == 1 else f"the middle of chain {number}"
        found += _of_record(chains[number], motion, times, where)
    found += yields(chains, motions)
    found += check_structures(interfaces, motions, highest, interval)
    found += ((run, words) for run in numbers for body in interfaces[run].black_boxes for words in body.findings())
    for run, words in found:
        findings[run].append(words)
    warn([words for of_run in findings for words in of_run])
    return [remarks + of_run for remarks, of_run in zip(laws, findings, strict=True)]


def check_guest(chain: MovingChain, contact_force: Vector, work: Vector, times: Vector) -> list[str]:
    """Return the findings on a chain that another program ran: contact forces, N, and work on the surface, J."""
    peaks = contact_force.max(axis=0)
    deepest, force = chain.approach(peaks), {k: contact_force[None, :, k] for k in checked_contacts(chain)}
    laws, deep = chain.cautions(deepest)
    findings = [*check_before([chain], float(times[-1])), *laws, *deep]
    if (back := -float(work.min())) > LARGE * chain.energy:
        findings.append(
            f"energy: the structure gave back more than it was given, by {100.0 * back / chain.energy:.2g} % of the "
            "impact energy; check the units of its displacement and force, and its time stepping"
        )
    motion = Motion(force, peaks[None], deepest[None])
    after = joined(_of_record([chain], motion, times, "mid chain"), yields([[chain]], [motion]))
    return findings + [words for _, words in after]


def _of_energy(interfaces: Sequence[Interface], frames: Sequence[Frames]) -> Found:
    """Yield a finding if a run created or lost energy, as in `energy_error`, with the part of the run that did."""
    first, scale = interfaces[0], np.array([interface.impact_energy for interface in interfaces])
    structure, contact = (_stacked([getattr(run.saved, name) for run in frames]) for name in ("structure", "work"))
    energies = structure["kinetic"] + structure["elastic"] + structure["taken"]
    for place in np.flatnonzero(np.isnan(energies[0, :, 0])).tolist():  # of a black box only the work is known
        energies[:, place] = contact["work"][:, first.touching[place]].sum(axis=1)
    total_energy, stored = energies.sum(axis=1), np.zeros(len(frames))
    for k in np.flatnonzero(first.static).tolist():
        total_energy += first.static[k] * contact["surface"][:, k]
    for of_runs in zip(*(run.chains for run in frames), strict=True):
        energy = _stacked([chain.energy for chain in of_runs])
        total_energy += energy["kinetic"] + energy["potential"] + energy["lost"] - energy["driven"]
        stored = np.maximum(stored, of_runs[0].deepest.size * abs(energy["potential"]).max(axis=1))
    total = abs(total_energy - total_energy[:, :1]).max(axis=1) / scale
    # A faint wave in a pressed chain: no step would save what rounding takes from the energy that the preload stores.
    rounding = ROUNDING * stored / scale
    for run in np.flatnonzero(total > LARGE).tolist():
        if total[run] < LARGE + rounding[run]:
            yield (
                run,
                "energy: cannot be checked; rounding of the energy that the preload stores is up to "
                f"{100.0 * rounding[run]:.2g} % of the impact energy",
            )
            continue
        exchange = contact["given"][run] - contact["work"][run]
        culprit = "the exchange, see interface_mismatch; take shorter windows, or a scheme that iterates"
        if abs(exchange.sum(axis=0)).max() / scale[run] < 0.5 * total[run]:
            culprit = "the chain's steps; take a shorter dt"
        lost = f"the run created or lost {100.0 * total[run]:.2g} % of the impact energy"
        yield run, f"energy: {lost}, most of it in {culprit}"


def _stacked(records: Sequence[Records]) -> Records:
    """Return records of equal shapes as one array with a first axis for them; those of a single run as a view."""
    return records[0][None] if len(records) == 1 else np.array(records)


def _of_record(chains: Sequence[MovingChain], motion: Motion, times: Vector, where: str) -> Found:
    """Yield a finding if a record ends before a reflected wave can be back in mid chain; for a struck chain."""
    first = chains[0]
    driven = first.chain.excitation.drive.kind in (PUSHED, MOVED)
    if first.surface is None or first.behind is not None or driven:
        return
    last, middle = first.mass.size - 1, middle_of(first)
    forces = motion.force[middle] - first.static_force[middle]
    tops = forces.max(axis=1, keepdims=True)
    begins = np.where(tops[:, 0] > 0.0, (forces >= 0.5 * tops).argmax(axis=1), 0)
    silent = (forces < SILENT * tops) & (np.arange(times.size) >= begins[:, None])
    # A wave is back where it is loud after it was silent.
    loud_last = np.where(tops[:, 0] > 0.0, times.size - 1 - (forces > SILENT * tops)[:, ::-1].argmax(axis=1), -1)
    ends = np.where(silent.any(axis=1), silent.argmax(axis=1), times.size)
    for run in np.flatnonzero(loud_last < ends).tolist():
        chain, passed, begin = chains[run], bool(ends[run] < times.size), float(times[begins[run]])
        if not chain.chain.speed > 0.0:
            continue
        # The wave is at mid chain when half of the way is behind it; before that, by theory.
        reached = begin * last / middle if passed and begins[run] else chain.transit_time
        push = motion.force[last][run] - chain.static_force[-1]
        leaves = end_of_push(times, push, 0.05 * max(float(tops[run, 0]), 0.0), reached + 3.0 * reached / last)
        slower = SMALLEST_WAVE ** (-1.0 / 6.0)
        if times[-1] < leaves + slower * (reached - begin if passed else 0.5 * reached):
            needed = leaves + slower * reached
            yield run, f"record: {short_record(float(times[-1]), needed, where).removeprefix(RECORD)}"
