"""Deformable beads on one core: a law of finite elements, and a chain of a few modes.

    python benchmarks/deformable_chain.py

Laws are those of two hollow spheres, by default and in 120 load steps, with their errors from two coarser meshes.
The chain is a striker and 20 beads of 316 steel, R = 2.38 mm, 0.5 m/s, over 200 µs (thesis, section 3.4); point masses
give 20.55 N at contacts 15 and 16, and 569.1 m/s. Its set-up, law and modes, runs first, so that no cache helps it; all
later work uses compiled kernels. Times are processor times, s.
"""

import resource
import sys
from statistics import median

import numpy as np
import xarray as xr
from coupled_plate import one_thread, timed, verdict

import hertzlink as hl
from coupling.results.wave_finder import placed
from particles.laws.axisymmetric import ELEMENTS

RADIUS, HOLLOW = 9.525e-3, (0.5, 0.75, 0.908)
"""Radius of the thesis's hollow spheres, m, and their ratios of inner to outer radius."""

APPROACH, LOAD_STEPS = 20e-6, 120
"""m, the largest approach of the thesis's hollow spheres, and the number of steps."""

BEAD = hl.Sphere(2.38e-3, hl.STEEL_316)
RIGID = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=0.5)
DEFORMABLE = hl.DeformableChain([BEAD] * 20, striker=BEAD, impact_speed=0.5)
UNTIL = 200e-6  # s

SENSORS = (7, 16)
CONTACTS = (15, 16)
ROUNDS = 15

LONGEST_LAW, LONGEST_SETUP, LONGEST_RUN, MOST_MEMORY = 3.0, 5.0, 0.1, 2e9


def laws() -> None:
    """Print the times for the laws of the thesis's hollow spheres."""
    print(f"contact of two hollow spheres up to {APPROACH * 1e6:.0f} µm")
    for ratio in HOLLOW:
        shell = hl.HollowSphere(RADIUS, ratio * RADIUS, hl.ALUMINIUM_6061)
        widest = widest_contact(shell)
        print(f"  Ri/Ro {ratio:.3g}, by default {of_law(shell, widest / ELEMENTS)}")
        print(f"    with finer cells {of_law(shell, widest / LOAD_STEPS, target=True)}")


def widest_contact(shell: hl.HollowSphere) -> float:
    """Radius, m, of the contact at the largest approach, by the forces of the analytic law."""
    force = hl.contact_law(shell, shell).force(np.array(APPROACH))
    hertz = hl.laws.PowerLaw(hl.theory.hertz_stiffness(shell.surface, shell.surface))
    return float(np.sqrt(0.5 * shell.radius * hertz.approach(force)))


def of_law(shell: hl.HollowSphere, spacing: float, target: bool = False) -> str:
    """The time for a law with cells of this size, m, and for the two coarser meshes from which its error is
    estimated.
    """
    spent, law = timed(lambda: hl.laws.computed_law(shell, max_approach=APPROACH, spacing=spacing))
    steps = np.count_nonzero(np.array(law.approaches) >= law.smallest)
    met = f" (≤ {LONGEST_LAW:.0f}, {verdict(spent <= LONGEST_LAW)})" if target else ""
    return f"{steps} load steps, each at a corner of the mesh, error {law.error:.1%}: {spent:.2f} s{met}"


def by_modes() -> None:
    """Print set-up and run of the chain of a few modes."""
    setup, simulation = timed(hl.CoSimulation, DEFORMABLE, None)
    first, run = timed(simulation.run, UNTIL)
    seconds = median(timed(simulation.run, UNTIL)[0] for _ in range(ROUNDS))
    setup += first - seconds
    print(f"chain of {len(RIGID.beads) + 1} beads, {DEFORMABLE.modes} modes each, over {UNTIL * 1e6:.0f} µs")
    print(f"  set-up {setup:.2f} s (≤ {LONGEST_SETUP:.0f}, {verdict(setup <= LONGEST_SETUP)})")
    print(f"  run {seconds * 1e3:.1f} ms (≤ {LONGEST_RUN * 1e3:.0f}, {verdict(seconds <= LONGEST_RUN)})")
    print(f"  {measures(run)}", flush=True)


def with_losses() -> None:
    """Print what losses inside the beads cost, over none, in turn."""
    losses = {
        "none": None,
        "modal": hl.damping.Modal(0.02),
        "standard linear solid": hl.damping.StandardLinearSolid(0.2, 1e-6),
    }
    chains = {name: hl.DeformableChain([BEAD] * 20, BEAD, 0.5, damping=loss) for name, loss in losses.items()}
    simulations = {name: hl.CoSimulation(chain, None) for name, chain in chains.items()}
    for one in simulations.values():
        one.run(UNTIL)
    rounds = [{name: timed(one.run, UNTIL)[0] for name, one in simulations.items()} for _ in range(ROUNDS)]
    for name in list(losses)[1:]:
        ratio = median(spent[name] / spent["none"] for spent in rounds)
        print(f"  with losses inside the beads, {name}: {ratio:.2f} times the time", flush=True)


def peak(run: xr.Dataset, contact: int) -> float:
    """Greatest force of a contact, N."""
    force = run.contact_force.sel(contact=contact).values
    return float(placed(run.time.values, force[None], np.array([0]), np.array([force.argmax()]))[0][0])


def momentum_error(run: xr.Dataset) -> float:
    """Greatest change of the momentum, in units of the striker's."""
    total = run.velocity.sum("bead")
    return float(abs(total - total[0]).max() / total[0])


def measures(run: xr.Dataset) -> str:
    """Peak forces, speed and errors in a line."""
    peaks = ", ".join(f"{peak(run, contact):.3f} N at contact {contact}" for contact in CONTACTS)
    speed = hl.wave_speed(run, *SENSORS)
    return f"{peaks}, {speed:.2f} m/s, energy to {hl.energy_error(run):.0e}, momentum to {momentum_error(run):.0e}"


def main() -> None:
    """Print everything."""
    one_thread()
    # Kernels of a chain of other beads, with laws by formulas.
    other = hl.Sphere(3e-3, hl.PTFE)
    hl.CoSimulation(hl.DeformableChain([other], other, 1.0, law=hl.contact_law, modes=2), None).run(1e-5)
    by_modes()
    with_losses()
    laws()
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    print(f"memory, greatest {most / 1e9:.2f} GB (≤ {MOST_MEMORY / 1e9:.0f}, {verdict(most <= MOST_MEMORY)})")


if __name__ == "__main__":
    main()
