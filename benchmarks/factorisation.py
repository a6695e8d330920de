"""Solids by finite elements: their assembly and answers to unit forces, compared with plainer ways.

    python benchmarks/factorisation.py

Bodies of quadratic tetrahedra, meshed by gmsh (pip install -e ".[mesh]"). Assembly is compared with scikit-fem's forms,
and unit forces that are solved together with single ones. These times are of one processor. Last, on the clock, a plate
is reduced while other processes keep all cores busy, by one thread of linear algebra and by one for each core.
"""

import inspect
import os
import subprocess
import sys
from collections.abc import Callable
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import gmsh
import numpy as np
from coupled_plate import one_thread, timed
from skfem import Basis, BilinearForm, ElementVector
from skfem.helpers import ddot, div, dot, sym_grad
from threadpoolctl import threadpool_limits

import hertzlink as hl
from structures.bodies.body_mesh import BodyMesh
from structures.bodies.elasticity import body_matrices, first_lame_parameter, shear_modulus
from structures.linear_algebra.factor import AT_ONCE, Solve, Vector, compliance_at, factorise

STEEL = hl.STEEL_440C
SHIFT = 2.0 * np.pi * 35e3
"""1/s; K + shift² M is factorised, as for a reduction."""

FORCES, ROUNDS = 4 * AT_ONCE, 10

BODIES: dict[str, tuple[Callable[..., int], tuple[float, ...], float]] = {
    "bar": (lambda *sides: gmsh.model.occ.addBox(0.0, 0.0, 0.0, *sides), (0.06, 0.015, 0.015), 2.2e-3),
    "plate": (lambda *sides: gmsh.model.occ.addBox(0.0, 0.0, 0.0, *sides), (0.1, 0.1, 0.01), 5e-3),
    "cube": (lambda *sides: gmsh.model.occ.addBox(0.0, 0.0, 0.0, *sides), (0.02, 0.02, 0.02), 1.8e-3),
    "ball": (lambda radius: gmsh.model.occ.addSphere(0.0, 0.0, 0.0, radius), (0.0095,), 1.5e-3),
}
"""What adds it to gmsh, its sizes, and the size of its cells, m."""


@BilinearForm
def inertia(u: Any, v: Any, _: Any) -> Any:
    """Of a density of one."""
    return dot(u, v)


@BilinearForm
def strain(u: Any, v: Any, w: Any) -> Any:
    """Energy of two motions."""
    return w.lame * div(u) * div(v) + 2.0 * w.shear * ddot(sym_grad(u), sym_grad(v))


def meshed(name: str) -> Basis:
    """Shape functions of the displacement on the body."""
    add, sizes, cell = BODIES[name]
    gmsh.initialize(interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    add(*sizes)
    gmsh.model.occ.synchronize()
    for option in ("Mesh.MeshSizeMin", "Mesh.MeshSizeMax"):
        gmsh.option.setNumber(option, cell)
    gmsh.model.mesh.generate(3)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "body.msh"
        gmsh.write(str(path))
        gmsh.finalize()
        body = BodyMesh(path)
    return Basis(body.mesh, ElementVector(body.element()), intorder=body.order)


def plain(basis: Basis) -> Any:
    """Mass and stiffness by scikit-fem's forms."""
    ones = np.ones_like(basis.dx)
    lame, shear = first_lame_parameter(STEEL) * ones, shear_modulus(STEEL) * ones
    return inertia.assemble(basis) * STEEL.density, strain.assemble(basis, lame=lame, shear=shear)


def one_by_one(solve: Solve, units: Vector) -> list[Vector]:
    """The answers to unit forces."""
    return [solve(one) for one in units]


def beside_other_work() -> None:
    """Print how long a reduction takes while every core is busy."""
    plate = hl.kirchhoff_plate(0.3, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    struck, cores = plate.at(0.1, 0.1), os.cpu_count() or 1
    without_limit, lengths = inspect.unwrap(hl.reduce), count(1)  # an equal reduction would be remembered
    others = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(cores)]
    try:
        spent = []
        for reduce in (hl.reduce, without_limit):
            with threadpool_limits(cores, "blas"):
                reduce(struck, until=1e-3 + 1e-9 * next(lengths))
                begin = perf_counter()
                for _ in range(ROUNDS):
                    reduce(struck, until=1e-3 + 1e-9 * next(lengths))
            spent.append((perf_counter() - begin) / ROUNDS)
    finally:
        for other in others:
            other.kill()
    print(
        f"{struck.size} unknowns beside {cores} busy processes: reduced in {spent[0]:.3f} s by one thread, in "
        f"{spent[1]:.3f} s by {cores}: {spent[1] / spent[0]:.1f} times as long"
    )


def main() -> None:
    """Print the table."""
    one_thread()
    print(f"{'':8}{'unknowns':>9}{'assembly':>10}{'':>10}{FORCES:4d} unit forces")
    print(f"{'':17}{'s':>10}{'gain':>10}{'s':>7}{'gain':>7}")
    for name in BODIES:
        basis = meshed(name)
        owner = np.zeros(basis.mesh.nelements, dtype=np.int64)
        spent, (mass, stiffness) = timed(body_matrices, basis, [STEEL], owner)
        slower, _ = timed(plain, basis)
        matrix = stiffness + SHIFT**2 * mass
        places = np.linspace(0, basis.N - 1, FORCES).astype(np.int64)
        together, _ = timed(compliance_at, matrix, places)
        once, solve = timed(factorise, matrix)
        units = np.zeros((FORCES, basis.N))
        units[np.arange(FORCES), places] = 1.0
        alone, _ = timed(one_by_one, solve, units)
        print(
            f"{name:8}{basis.N:9d}{spent:10.2f}{slower / spent:10.1f}"
            f"{together - once:7.2f}{alone / (together - once):7.1f}",
            flush=True,
        )
    beside_other_work()


if __name__ == "__main__":
    main()
