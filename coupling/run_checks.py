"""The checks before a run and after it: each finding is a line of `warnings`, and a warning to the user."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from coupling.interface import Interface
from coupling.recording.frames import Frames, Motion, greatest, middle_of
from coupling.results.ar_and_tof import SMALLEST_WAVE
from coupling.results.findings import warn
from coupling.results.missing_waves import RECORD, end_of_push, short_record
from coupling.structure_checks import check_structures
from coupling.yield_check import yields
from particles.kernels.drives import MOVED, PUSHED
from particles.moving import MovingChain
from structures.structure import Vector
from structures.units import readable

LARGE = 1e-3
"""Part of the impact energy that a run may create or lose without a warning."""

LONG = 200.0
"""A record is too long if a wave could run to the structure and back so many times."""

ROUNDING = 4.0 * float(np.finfo(float).eps)
"""Part of a stored energy that each contact may add to the rounding of their sum, with some margin."""

MOST_OF_A_RUN = 1e9
"""Steps of beads in a run that nobody asked for: some minutes."""

SHORTER = (1e-3, 1e-6)
"""What `until` is multiplied by where ms or µs may be meant."""

SUDDEN = 50.0
"""A loss is too strong if it would stop a contact in this part of the contact's time: no wave passes. The loss of a
restitution of 0.01 takes a 38th of that time, a dashpot of 5 N s/m between beads of 10 mm ten times as long."""

MANY_STEPS = 1e7
"""Steps of a short chain in some 10 s. A strong loss inside beads stops no wave, but it needs short steps."""

SILENT = 0.01
"""Part of the incident wave's force that a reflected one has at least in mid chain."""


def check_before(chains: Sequence[MovingChain], until: float) -> list[str]:
    """Return the findings before a run: a record that is too long, a loss that is too strong."""
    return [*_of_length(chains, until), *_of_losses(chains, until)]


def check_effort(chains: Sequence[MovingChain], until: float, most: float) -> None:
    """Raise a ValueError for a run of more than so many steps of beads, which names what makes them many."""
    steps = float(sum(chain.steps(until) * chain.mass.size for chain in chains))
    if steps <= most:
        return
    losses = [chain.strongest_loss[0] for chain in chains if chain.dt is None and _is_sudden(chain)]
    step = chains[0].dt
    name = [*losses, f"until = {until!r}" if step is None else f"dt = {step!r}"][0]
    asked = f"give most_steps = {float(f'{1.1 * steps:.1e}'):g} if it is meant"
    raise ValueError(f"{name}: takes {steps:.2g} steps of beads; {asked}{_meant(chains, until)}")


def _meant(chains: Sequence[MovingChain], until: float) -> str:
    """Return the question whether a record that is far too long is in another unit; empty for another one."""
    scale = max(_there_and_back(chains), *(chain.chain.excitation.duration for chain in chains))
    meant = [factor * until for factor in SHORTER if factor * until <= LONG * scale < until]
    return f"; did you mean until = {meant[0]:.4g} ({readable(meant[0], 's', 4)})?" if meant else ""


def _there_and_back(chains: Sequence[MovingChain]) -> float:
    """Return the time that a wave takes through the longest chain and back, s."""
    return max(2.0 * chain.transit_time + chain.contact_time for chain in chains)


def _is_sudden(chain: MovingChain) -> bool:
    """Return whether a loss ends motion so soon that its coefficient may be in another unit; it then sets the step."""
    return chain.contact_time > SUDDEN * chain.damping_time


def _of_losses(chains: Sequence[MovingChain], until: float) -> list[str]:
    """Return a finding for each loss so strong that its coefficient may be in another unit."""
    findings = dict[str, None]()
    for chain in chains:
        if not _is_sudden(chain):
            continue
        name, in_contact = chain.strongest_loss
        steps, ratio = until / chain.longest_step, chain.contact_time / chain.damping_time
        if in_contact:
            words = f"1/{ratio:.0f} of the contact's time, so no wave passes and the run takes {steps:.2g} steps"
            findings[f"{name}: would stop a contact in {words}; check its unit"] = None
        elif steps > MANY_STEPS:
            words = f"1/{ratio:.0f} of a contact's time, so the run takes {steps:.2g} steps"
            findings[f"{name}: would stop a vibration in {words}; check its unit, or take fewer modes"] = None
    return list(findings)


def _of_length(chains: Sequence[MovingChain], until: float) -> list[str]:
    """Return a finding before the run where it is so long that another unit may be meant."""
    once = _there_and_back(chains)
    if until <= LONG * max(once, *(chain.chain.excitation.duration for chain in chains)):
        return []
    return [
        f"until = {until:g} s: is {until / once:.2g} times the {readable(once, 's', 4)} that a "
        f"wave takes through the chain and back{_meant(chains, until)}"
    ]


def checked(interface: Interface, frames: Frames, interval: float) -> list[str]:
    """Return the findings of all checks after a run saved every `interval` s; the user is warned of each.

    A contact law warned of its own limits when it was made; here they are findings only.
    """
    laws, findings, motions = list[str](), list[str](), frames.motions(interface)
    for chain, motion in zip(interface.chains, motions, strict=True):
        remarks, deep = chain.cautions(motion.deepest)
        laws += remarks
        findings += deep
    findings += _of_energy(interface, frames)
    times = interval * np.arange(frames.rows, dtype=float)
    for number, (chain, motion) in enumerate(zip(interface.chains, motions, strict=True)):
        where = "mid chain" if len(motions) == 1 else f"the middle of chain {number}"
        findings += _of_record(chain, motion, times, where)
    findings += yields(interface.chains, motions, times)
    findings += check_structures(interface, motions, frames.sensors.highest, interval)
    findings += [finding for box in interface.boxes for finding in box.findings()]
    warn(findings)
    return laws + findings


def check_guest(chain: MovingChain, contact_force: Vector, velocity: Vector, work: Vector, times: Vector) -> list[str]:
    """Return the findings on a chain that another program ran: contact forces, N, velocities, m/s, work on the surface,
    J."""
    peaks = greatest(contact_force)
    motion = Motion(range(peaks.size), contact_force, velocity[:, middle_of(chain)], peaks, chain.approach(peaks))
    laws, deep = chain.cautions(motion.deepest)
    findings = [*check_before([chain], float(times[-1])), *laws, *deep, *_of_passivity(work, chain.energy)]
    return [*findings, *_of_record(chain, motion, times, "mid chain"), *yields([chain], [motion], times)]


def _of_passivity(work: Vector, scale: float) -> list[str]:
    """Return a finding if a structure gave back more work, J, than it was given: then it creates energy. scale, J."""
    if not work.min() < -LARGE * scale:
        return []
    return [
        f"energy: the structure gave back more than it was given, by {-100.0 * work.min() / scale:.2g} % of the impact "
        "energy; check the units of its displacement and force, and its time stepping"
    ]


def _of_energy(interface: Interface, frames: Frames) -> list[str]:
    """Return a finding if the run created or lost energy, as in `energy_error`, with the part of the run that did."""
    structure, contact = frames.ledger.structure, frames.ledger.contact
    energies, damped = structure["kinetic"] + structure["elastic"], structure["taken"]
    work = np.stack([contact["work"][interface.touching[place]].sum(axis=0) for place in range(len(energies))])
    total_energy = np.where(np.isnan(energies), work, energies + damped).sum(axis=0)
    for number, chain_frames in enumerate(frames.chains):
        energy = chain_frames.energy
        total_energy = total_energy + energy["kinetic"] + energy["potential"] + energy["lost"] - energy["driven"]
        for k in interface.of_chain[number]:
            total_energy = total_energy + interface.static[k] * contact["surface"][k]
    total = _worst(total_energy - total_energy[0], interface)
    if not total > LARGE:
        return []
    # A faint wave in a pressed chain: no step would save what rounding takes from the energy that the preload stores.
    stored = max(
        chain_frames.deepest.size * float(abs(chain_frames.energy["potential"]).max()) for chain_frames in frames.chains
    )
    rounding = ROUNDING * stored / interface.impact_energy
    if total < LARGE + rounding:
        return [
            "energy: cannot be checked; rounding of the energy that the preload stores is up to "
            f"{100.0 * rounding:.2g} % of the impact energy"
        ]
    exchange, stepper = contact["given"] - contact["work"], work - energies - damped
    parts = {
        "the exchange, see interface_mismatch; take shorter windows, or a scheme that iterates": exchange,
        "the structure's stepper, see structure_numerical_loss; take shorter windows, or the midpoint": stepper,
    }
    errors = {words: _worst(np.nan_to_num(part).sum(axis=0), interface) for words, part in parts.items()}
    culprit = max(errors, key=lambda words: errors[words])
    if errors[culprit] < 0.5 * total:
        culprit = "the chain's steps; take a shorter dt"
    return [f"energy: the run created or lost {100.0 * total:.2g} % of the impact energy, most of it in {culprit}"]


def _worst(energy: Vector, interface: Interface) -> float:
    """Return the greatest of energies, J, in units of the impact energy."""
    return float(abs(energy).max()) / interface.impact_energy


def _of_record(chain: MovingChain, motion: Motion, times: Any, where: str) -> list[str]:
    """Return a finding if a record ends before a reflected wave can be back in mid chain; for a struck chain."""
    driven = chain.chain.excitation.drive.kind in (PUSHED, MOVED)
    if chain.surface is None or chain.behind is not None or driven or not chain.chain.speed > 0.0:
        return []
    last, middle = chain.mass.size - 1, middle_of(chain)
    force = motion.at(middle) - chain.static_force[middle]
    top = float(force.max())
    first = int((force >= 0.5 * top).argmax()) if top > 0.0 else 0
    silent = np.flatnonzero(force[first:] < SILENT * top)
    if silent.size and (force[first + silent[0] :] > SILENT * top).any():
        return []
    # The wave is at mid chain when half of the way is behind it; before that, by theory.
    reached = float(times[first]) * last / middle if silent.size and first else chain.transit_time
    hop = reached / last
    push = motion.at(last) - chain.static_force[-1]
    leaves = end_of_push(times, push, 0.05 * max(top, 0.0), reached + 3.0 * hop)
    slower = SMALLEST_WAVE ** (-1.0 / 6.0)
    if times[-1] >= leaves + slower * (reached - float(times[first]) if silent.size else 0.5 * reached):
        return []
    needed = leaves + slower * reached
    return [f"record: {short_record(float(times[-1]), needed, where).removeprefix(RECORD)}"]
