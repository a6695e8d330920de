"""The same taps by programs that people write in an afternoon: SciPy's solve_ivp, and scikit-fem with Newmark's method.

    python benchmarks/peers.py

A chain of 20 beads strikes a rod of PTFE, and a clamped plate. The rod and its chain are one system of equations for
solve_ivp (DOP853), with the same mass and stiffness as hertzlink's rod. The plate is meshed by scikit-fem's
Bogner–Fox–Schmit elements; Newmark's method (average acceleration) moves it, velocity Verlet the chain, and the contact
force of the last step drives both. Times are processor times, without compilation.
"""

import os
import sys
import warnings
from time import process_time
from typing import Any

import numpy as np
import skfem
from scipy.integrate import solve_ivp
from scipy.sparse.linalg import splu
from skfem.helpers import dd, ddot, eye, trace

import hertzlink as hl

SENSOR, BEADS, SPEED = 7, 20, 0.3
BEAD = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
BETWEEN = hl.theory.hertz_stiffness(BEAD.surface, BEAD.surface)


def forces(position: np.ndarray, surface: float, last: float) -> np.ndarray:
    """All contact forces; `last` is Hertz's stiffness of the contact on the structure."""
    overlap = np.maximum(position - np.append(position[1:], surface), 0.0)
    return np.append(np.full(BEADS, BETWEEN), last) * overlap * np.sqrt(overlap)


def waves(times: np.ndarray, contact_force: np.ndarray) -> str:
    """AR and TOF, read from the forces as from a measured signal."""
    force = 0.5 * (contact_force[:, SENSOR - 1] + contact_force[:, SENSOR])
    found = hl.reflections(hl.as_signal(times, {SENSOR: force}), sensor=SENSOR).primary
    return f"AR {found.amplitude_ratio:.5f}, TOF {1e6 * found.time_of_flight:.2f} µs"


def by_hertzlink(structure: hl.Structure, until: float) -> str:
    simulation = hl.CoSimulation(hl.Chain([BEAD] * BEADS, BEAD, SPEED), structure)
    simulation.run(until)
    begin = process_time()
    run = simulation.run(until)
    seconds = process_time() - begin
    found = hl.reflections(run, sensor=SENSOR).primary
    return f"{seconds:8.3f} s, AR {found.amplitude_ratio:.5f}, TOF {1e6 * found.time_of_flight:.2f} µs"


def by_solve_ivp(rod: hl.Structure, until: float) -> str:
    """Chain and rod as one system; the state holds displacements and velocities of beads and of the rod's unknowns."""
    mass, stiffness = rod.mass.toarray(), rod.stiffness.toarray()
    inverse, contact = np.linalg.inv(mass), rod.contact.ravel()
    last = hl.theory.hertz_stiffness(BEAD.surface, rod.surface)
    half = BEADS + 1 + contact.size

    def rates(_: float, state: np.ndarray) -> np.ndarray:
        position, body = state[: BEADS + 1], state[BEADS + 1 : half]
        force = forces(position, contact @ body, last)
        bead = (np.append(0.0, force[:-1]) - force) / BEAD.mass
        return np.concatenate([state[half:], bead, inverse @ (contact * force[-1] - stiffness @ body)])

    start = np.zeros(2 * half)
    start[half] = SPEED
    times = np.arange(0.0, until, 5e-7)
    begin = process_time()
    found = solve_ivp(rates, (0.0, until), start, "DOP853", t_eval=times, rtol=1e-8, atol=1e-12)
    seconds = process_time() - begin
    kept = [forces(state[: BEADS + 1], contact @ state[BEADS + 1 : half], last) for state in found.y.T]
    return f"{seconds:8.3f} s, {waves(times, np.array(kept))}"


def by_scikit_fem(side: float, thickness: float, metal: hl.Material, until: float, cells: int, step: float) -> str:
    """A square plate with its left edge clamped, struck at a quarter of its length."""
    nodes = np.linspace(0.0, side, cells + 1)
    basis = skfem.Basis(skfem.MeshQuad.init_tensor(nodes, nodes), skfem.ElementQuadBFS())
    nu, rigidity = metal.poisson_ratio, metal.youngs_modulus * thickness**3 / 12.0 / (1.0 - metal.poisson_ratio**2)

    @skfem.BilinearForm
    def bending(u: Any, v: Any, _: Any) -> Any:
        moment = (1.0 - nu) * dd(u) + nu * eye(trace(dd(u)), 2)
        return rigidity * ddot(moment, dd(v))

    @skfem.BilinearForm
    def inertia(u: Any, v: Any, _: Any) -> Any:
        return metal.density * thickness * u * v

    begin = process_time()
    free = basis.complement_dofs(basis.get_dofs(lambda x: x[0] < 1e-9))
    stiffness, mass = (form.assemble(basis)[free][:, free].tocsc() for form in (bending, inertia))
    node = np.abs(basis.mesh.p - [[side / 4.0], [side / 2.0]]).sum(axis=0).argmin()
    struck = int(np.searchsorted(free, basis.nodal_dofs[0, node]))
    solver = splu(mass + 0.25 * step**2 * stiffness)
    last = hl.theory.hertz_stiffness(BEAD.surface, hl.Surface(metal))
    u, v, a = np.zeros((3, free.size))
    x, speeds, kept = np.zeros(BEADS + 1), np.zeros(BEADS + 1), []
    speeds[0] = SPEED
    force = forces(x, 0.0, last)
    for _ in range(round(until / step)):
        acceleration = (np.append(0.0, force[:-1]) - force) / BEAD.mass
        speeds += 0.5 * step * acceleration
        x += step * speeds
        guess = u + step * v + 0.25 * step**2 * a
        load = -(stiffness @ guess)
        load[struck] += force[-1]
        v += 0.5 * step * a
        a = solver.solve(load)
        u, v = guess + 0.25 * step**2 * a, v + 0.5 * step * a
        force = forces(x, u[struck], last)
        speeds += 0.5 * step * (np.append(0.0, force[:-1]) - force) / BEAD.mass
        kept.append(force)
    seconds = process_time() - begin
    return f"{seconds:8.3f} s, {waves(step * np.arange(1, len(kept) + 1), np.array(kept))}"


def main() -> None:
    if os.environ.get("OMP_NUM_THREADS") != "1":
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], {**os.environ, "OMP_NUM_THREADS": "1"})
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    rod, until = hl.rod([hl.Layer(hl.PTFE, length=0.05, radius=9.525e-3)], elements=40), 1.2e-3
    print(f"rod of {rod.size} unknowns, {1e3 * until:g} ms\n    hertzlink              {by_hertzlink(rod, until)}")
    print(f"    solve_ivp, DOP853      {by_solve_ivp(rod, until)}", flush=True)

    side, thickness, until = 0.3, 4.83e-3, 1e-3
    plate = hl.kirchhoff_plate(side, side, thickness, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    reduced = hl.reduce(plate.at(side / 4.0, side / 2.0), until)
    print(f"plate, {1e3 * until:g} ms\n    hertzlink              {by_hertzlink(reduced, until)}")
    for cells in (24, 48):
        found = by_scikit_fem(side, thickness, hl.ALUMINIUM_6061, until, cells, 2e-7)
        print(f"    scikit-fem, {cells} cells    {found}", flush=True)


if __name__ == "__main__":
    main()
