"""The checks before and after a run. Each finding is a warning to the user and a line of the attribute `warnings`."""

from collections.abc import Sequence

import numpy as np

from coupling.interface import Interface
from coupling.recording.frames import Frames, Motion
from coupling.results.ar_and_tof import SMALLEST_WAVE
from coupling.results.findings import warn
from coupling.results.missing_waves import PUSH, short_record
from coupling.structure_checks import check_structures
from coupling.yield_check import yields
from particles.contacts import cautions
from particles.kernels.drives import MOVED, PUSHED
from particles.moving import MovingChain
from structures.structure import Vector
from structures.units import readable

LARGE = 1e-3  # part of the impact energy that a run may create or lose without a warning
LONG = 200.0  # a record is too long if a wave could run to the structure and back this many times
ROUNDING = 4.0 * float(np.finfo(float).eps)  # part of a stored energy that each contact may add to their sum's rounding
MOST_OF_A_RUN = 1e9  # steps of beads in a run, by default at most; they take some minutes
SHORTER = (1e-3, 1e-6)  # factors of `until` if ms or µs may be meant
MANY_STEPS = 1e7  # steps that take a short chain some 10 s; a strong loss inside beads lets waves pass, but needs many
SILENT = 0.01  # part of the incident wave's force; a reflected wave in mid chain has more

SUDDEN = 50.0
"""A loss is too strong if it would stop a contact within 1/SUDDEN of the contact's time, and no wave would pass. The
loss of a restitution of 0.01 takes 1/38 of that time, a dashpot of 5 N s/m between 10 mm beads ten times as long."""


def check_before(chains: Sequence[MovingChain], until: float) -> list[str]:
    """Return the findings before a run: a record that is so long, or a loss so strong, that its unit may be wrong."""
    findings, (once, is_long, question) = dict[str, None](), _too_long(chains, until)
    if is_long:
        times = f"{until / once:.2g} times the {readable(once, 's', 4)} that a wave takes through the chain and back"
        findings[f"until = {until:g} s: is {times}{question}"] = None
    for chain in filter(_is_sudden, chains):
        name, in_contact, time = chain.strongest_loss
        steps, part = until / chain.longest_step, f"1/{chain.contact_time / time:.0f}"
        if in_contact:
            words = f"a contact in {part} of the contact's time, so no wave passes and the run takes {steps:.2g} steps"
            findings[f"{name}: would stop {words}; check its unit"] = None
        elif steps > MANY_STEPS:
            words = f"a vibration in {part} of a contact's time, so the run takes {steps:.2g} steps"
            findings[f"{name}: would stop {words}; check its unit, or take fewer modes"] = None
    return list(findings)


def check_effort(chains: Sequence[MovingChain], until: float, most: float) -> None:
    """Raise a ValueError for a run of more than `most` steps of beads; it names the argument that makes them many."""
    steps = float(sum(chain.steps(until) * chain.mass.size for chain in chains))
    if steps <= most:
        return
    losses = [chain.strongest_loss.argument for chain in chains if chain.dt is None and _is_sudden(chain)]
    step = chains[0].dt
    name = [*losses, f"until = {until!r}" if step is None else f"dt = {step!r}"][0]
    asked = f"give most_steps = {float(f'{1.1 * steps:.1e}'):g} if it is meant"
    raise ValueError(f"{name}: takes {steps:.2g} steps of beads; {asked}{_too_long(chains, until)[2]}")


def _too_long(chains: Sequence[MovingChain], until: float) -> tuple[float, bool, str]:
    """Return the time of a wave through the longest chain and back, s; whether a record is far longer than this or the
    history that drives a chain; and a question if it may be given in ms or µs, empty if not."""
    once = max(2.0 * chain.transit_time + chain.contact_time for chain in chains)
    longest = max(once, *(float(chain.chain.excitation.drive.history[0, -1]) for chain in chains))
    meant = [factor * until for factor in SHORTER if factor * until <= LONG * longest < until]
    question = f"; did you mean until = {meant[0]:.4g} ({readable(meant[0], 's', 4)})?" if meant else ""
    return once, until > LONG * longest, question


def _is_sudden(chain: MovingChain) -> bool:
    """Return whether a loss ends motion so soon that its unit may be wrong; such a loss determines the step."""
    return chain.contact_time > SUDDEN * chain.strongest_loss.time


def checked(interface: Interface, frames: Frames, interval: float) -> list[str]:
    """Return the findings of all checks after a run that was saved every `interval` s, and warn of each. The limits of
    contact laws are findings only, because each law warned of them when it was made."""
    chains, of_chains, motions = interface.chains, frames.chains, list[Motion]()
    laws, found, times = list[str](), list[str](), interval * np.arange(frames.rows, dtype=float)
    for chain, part in zip(chains, of_chains, strict=True):
        deepest = part.deepest.copy()
        deepest[-1] -= chain.flexibility * part.force[:, -1].max()
        motions.append(Motion(part.force.T, deepest))
        remarks, deep = cautions(chain.groups, deepest)
        laws += remarks
        found += deep
    found += _energy_findings(interface, frames)
    for number, (chain, motion) in enumerate(zip(chains, motions, strict=True)):
        place = "mid chain" if len(chains) == 1 else f"the middle of chain {number}"
        found += _record_findings(chain, motion, times, place)
    found += yields(chains, motions)
    found += check_structures(interface, motions, frames.saved.surface[2], interval)
    found += [words for body in interface.black_boxes for words in body.findings]
    warn(found)
    return laws + found


def check_guest(chain: MovingChain, contact_force: Vector, work: Vector, times: Vector) -> list[str]:
    """Return the findings on a chain that another program ran: contact forces, N, and work on the surface, J."""
    motion = Motion(contact_force.T, chain.approach(contact_force.max(axis=0)))
    laws, deep = cautions(chain.groups, motion.deepest)
    findings = [*check_before([chain], float(times[-1])), *laws, *deep]
    if (back := -float(work.min())) > LARGE * chain.energy:
        findings.append(
            f"energy: the structure gave back more than it was given, by {100.0 * back / chain.energy:.2g} % of the "
            "impact energy; check the units of its displacement and force, and its time stepping"
        )
    return [*findings, *_record_findings(chain, motion, times, "mid chain"), *yields([chain], [motion])]


def _energy_findings(interface: Interface, frames: Frames) -> list[str]:
    """Return a finding if a run created or lost energy (see `energy_error`), with the likely cause."""
    structure, contact, scale = frames.saved.structure, frames.saved.work, interface.impact_energy
    energies = structure["kinetic"] + structure["elastic"] + structure["taken"]
    for place in np.flatnonzero(np.isnan(energies[:, 0])).tolist():  # the work replaces the energy of a black box
        energies[place] = contact["work"][interface.touching[place]].sum(axis=0)
    total, stored = energies.sum(axis=0), 0.0
    for k in np.flatnonzero(interface.static).tolist():
        total += interface.static[k] * contact["surface"][k]
    for chain in frames.chains:
        energy = chain.energy
        total += energy["kinetic"] + energy["potential"] + energy["lost"] - energy["driven"]
        stored = max(stored, chain.deepest.size * float(abs(energy["potential"]).max()))
    error = float(abs(total - total[0]).max()) / scale
    # A faint wave in a pressed chain: rounding of the energy that the preload stores is larger than the wave's energy.
    rounding = ROUNDING * stored / scale
    if not error > LARGE:
        return []
    if error < LARGE + rounding:
        return [
            "energy: cannot be checked; rounding of the energy that the preload stores is up to "
            f"{100.0 * rounding:.2g} % of the impact energy"
        ]
    culprit = "the exchange, see interface_mismatch; take shorter windows, or a scheme that iterates"
    if abs((contact["given"] - contact["work"]).sum(axis=0)).max() / scale < 0.5 * error:
        culprit = "the chain's steps; take a shorter dt"
    lost = f"the run created or lost {100.0 * error:.2g} % of the impact energy"
    return [f"energy: {lost}, most of it in {culprit}"]


def _record_findings(chain: MovingChain, motion: Motion, times: Vector, where: str) -> list[str]:
    """Return a finding if the record of a struck chain ends before a reflected wave can be back in mid chain."""
    driven = chain.chain.excitation.drive.kind in (PUSHED, MOVED)
    if chain.surface is None or chain.behind is not None or driven or not chain.chain.speed > 0.0:
        return []
    last, middle = chain.mass.size - 1, (len(chain.chain.beads) + 1) // 2
    force = motion.force[middle] - chain.static_force[middle]
    top = max(float(force.max()), 0.0)
    begin = int((force >= 0.5 * top).argmax()) if top > 0.0 else 0
    silent = begin + np.flatnonzero(force[begin:] < SILENT * top)
    loud, passed, began = np.flatnonzero(force > SILENT * top), silent.size > 0, float(times[begin])
    # A wave is back if the bead in mid chain is loud again after it was silent.
    if passed and loud.size and loud[-1] > silent[0]:
        return []
    # When the wave reaches the last bead: twice its time to mid chain, or by theory if it has not passed that.
    reached = began * last / middle if passed and begin else chain.transit_time
    push = motion.force[last] - chain.static_force[-1]
    greatest, leaves = float(push.max(initial=0.0)), reached + PUSH * reached / last
    if greatest > 0.0 and greatest >= 0.05 * top:
        touches = int((push > SILENT * greatest).argmax())
        over = np.flatnonzero(push[touches:] <= SILENT * greatest)
        leaves = float(times[touches + over[0]] if over.size else times[-1])
        # It is also back if the force rises again, and did so before nearer to the structure: with a strong loss inside
        # beads the bead is never silent.
        after = [motion.force[place, int(push.argmax()) :] for place in (middle, (middle + last) // 2)]
        here, nearer = (part - np.minimum.accumulate(part) for part in after)
        if here.max() > SILENT * top and here.size - 1 > here.argmax() > nearer.argmax():
            return []
    slower = SMALLEST_WAVE ** (-1.0 / 6.0)
    if times[-1] >= leaves + slower * (reached - began if passed else 0.5 * reached):
        return []
    needed = leaves + slower * reached
    return [f"record: {short_record(float(times[-1]), where, needed)}"]
