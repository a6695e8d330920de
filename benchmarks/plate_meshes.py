"""Rectangular plates: the speed of their assembly, and the mesh that gives amplitude ratios in the least time.

    python benchmarks/plate_meshes.py [--quick]

First, a plate of 100 000 unknowns, compared with scikit-fem's plain assembly of the same elements at a smaller size
(quick) or the same size. Second, points of the boundary study on meshes graded towards the contact, compared with
uniform meshes that all points share, whose missing flexibility under a point force is added: by Navier's series,
computed once for each place in a cell. Errors are those of AR above 0.03, against a much finer graded mesh. All times
are of one processor.
"""

import argparse
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from coupled_plate import one_thread, timed, verdict, warm_up
from numpy.typing import NDArray
from skfem import Basis, BilinearForm, ElementQuadBFS, MeshQuad
from skfem.helpers import dd, ddot, trace

import hertzlink as hl
from hertzlink.studies import plate_boundary as study
from plates.shapes.rectangle import Rectangle
from structures.linear_algebra.factor import factorise

LONGEST = 2.0
"""Target: assembly of 100 000 unknowns, s."""

WORST = 5e-3
"""Target: error of AR."""

CELLS, FEWER = 157, 60

SMALLEST_RATIO = 0.03

FINE = 100.0e3
"""Hz; the mesh of the reference resolves flexural waves up to it."""

DISTANCES, QUICK = (0.01, 0.02, 0.05, 0.15, 0.457), (0.02, 0.15)

Strike = Callable[[float, float], hl.Structure]
"""The plate of a thickness, struck at a distance from its clamped edge, m."""


class Outcome(NamedTuple):
    """Mean seconds of assembly and reduction, mean unknowns, and AR by plate point and diameter."""

    seconds: float
    unknowns: float
    ratios: NDArray[np.float64]


def plain_assembly(cells: int) -> int:
    """K and M by scikit-fem's own element and loops; returns the number of unknowns."""
    axis = np.linspace(0.0, 1.0, cells + 1)
    basis = Basis(MeshQuad.init_tensor(axis, axis), ElementQuadBFS(), intorder=6)
    _bending.assemble(basis)
    _inertia.assemble(basis)
    return int(basis.N)


@BilinearForm
def _bending(u: Any, v: Any, _: Any) -> Any:
    return 0.7 * ddot(dd(u), dd(v)) + 0.3 * trace(dd(u)) * trace(dd(v))


@BilinearForm
def _inertia(u: Any, v: Any, _: Any) -> Any:
    return u * v


def report_assembly(quick: bool) -> None:
    """Print the times of both."""

    def own(cells: int) -> int:
        plate = hl.kirchhoff_plate(1.0, 1.0, 1e-3, hl.ALUMINIUM_6061, hl.Supports(), cells=(cells, cells))
        return plate.at(0.5, 0.5).size

    own(4)
    plain_assembly(4)
    print("assembly of M and K, free square plate")
    rates = {}
    for name, work, cells in (
        ("tensor product", own, CELLS), ("scikit-fem, ElementQuadBFS", plain_assembly, FEWER if quick else CELLS),
    ):  # fmt: skip
        seconds, unknowns = timed(work, cells)
        target = f" (≤ {LONGEST:.0f} s, {verdict(seconds <= LONGEST)})" if work is own else ""
        rates[name] = seconds / unknowns
        print(f"  {name:28}{unknowns:8d} unknowns{seconds:8.2f} s{target}")
    fast, slow = rates.values()
    print(f"  time of a plain unknown over one of hertzlink {slow / fast:.0f} times\n", flush=True)


def graded(hertz: float) -> Strike:
    """Meshes graded towards each point."""

    def at(thickness: float, distance: float) -> hl.Structure:
        return replace(study.THESIS.plate(thickness), highest_frequency=hertz).at(distance, study.THESIS.side / 2.0)

    return at


def uniform(cells_per_wavelength: float) -> Strike:
    """Half the plate in equal cells, symmetry along its centre line; one mesh, one factorisation for a thickness."""

    @lru_cache(maxsize=1)
    def shared(thickness: float) -> hl.Plate:
        whole = study.THESIS.plate(thickness)
        cells = round(study.THESIS.side / 2.0 / whole.shortest_wavelength * cells_per_wavelength)
        supports = hl.Supports("clamped", "clamped", top="symmetry")
        half = Rectangle(study.THESIS.side, study.THESIS.side / 2.0, cells=(2 * cells, cells))
        return replace(whole, shape=half, supports=supports)

    def at(thickness: float, distance: float) -> hl.Structure:
        plate = shared(thickness)
        size = study.THESIS.side / plate.shape.cells[0]
        lacking = lack(round(distance / size % 1.0, 6)) * size**2 / plate.rigidity
        return replace(plate.at(distance, plate.width), flexibility=lacking)

    return at


@lru_cache
def lack(place: float) -> float:
    """c of the flexibility c h²/D that square cells are missing at a place along a cell's edge, 0 to 1."""
    cells, waves = 16, np.arange(1, 2001)
    plate = hl.kirchhoff_plate(1.0, 1.0, 1e-2, hl.ALUMINIUM_6061, hl.Supports(*["simple"] * 4), cells=(cells, cells))
    x, y = 0.5 + place / cells, 0.5
    structure = plate.at(x, y)
    found = float(structure.contact @ factorise(structure.stiffness)(structure.contact)) * plate.rigidity
    m, n = np.meshgrid(waves, waves)
    series = (np.sin(np.pi * m * x) * np.sin(np.pi * n * y)) ** 2 / (m**2 + n**2) ** 2
    return (4.0 / np.pi**4 * float(series.sum()) - found) * cells**2


def outcome(strike: Strike, distances: tuple[float, ...]) -> Outcome:
    """All thicknesses, distances and diameters on one kind of mesh."""
    seconds, unknowns, ratios = [], [], []
    for thickness in study.THESIS.thickness:
        for distance in distances:
            assembly, full = timed(strike, thickness, distance)
            reduction, reduced = timed(hl.reduce, full, study.THESIS.until, study.REDUCTION)
            seconds.append(assembly + reduction)
            unknowns.append(full.size)
            runs = [hl.CoSimulation(study.THESIS.chain(d), reduced).run(study.THESIS.until) for d in study.THESIS.bead]
            ratios.append([float(hl.amplitude_ratio(run, study.THESIS.sensor)) for run in runs])
    return Outcome(float(np.mean(seconds)), float(np.mean(unknowns)), np.array(ratios))


def report_meshes(quick: bool) -> None:
    """Print time and error of each kind of mesh."""
    distances = QUICK if quick else DISTANCES
    reference = outcome(graded(FINE), distances)
    counted = reference.ratios > SMALLEST_RATIO
    print(f"AR at {counted.sum()} points of the boundary study; reference: {reference.unknowns:.0f} unknowns")
    print(f"  {'mesh':34}{'unknowns':>10}{'s a point':>11}{'largest error':>15}{'mean error':>12}")
    kinds: dict[str, Strike] = {f"graded, up to {hertz:.0f} kHz": graded(hertz * 1e3) for hertz in (40.0, 30.0, 20.0)}
    kinds |= {f"uniform, {n:g} cells a wave, corrected": uniform(n) for n in (3.0, 2.0, 1.5)}
    for name, strike in kinds.items():
        found = outcome(strike, distances)
        error = abs(found.ratios / reference.ratios - 1.0)[counted]
        target = f"  (≤ {WORST:.1%}, {verdict(error.max() <= WORST)})" if "40" in name else ""
        print(
            f"  {name:34}{found.unknowns:10.0f}{found.seconds:11.2f}{error.max():15.2%}{error.mean():12.2%}{target}",
            flush=True,
        )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer points, scikit-fem's assembly at a smaller size")
    options = parser.parse_args()
    one_thread()
    report_assembly(options.quick)
    warm_up(study.THESIS.plate(study.THESIS.thickness[-1]).at(0.1, study.THESIS.side / 2.0), window=1e-6)
    report_meshes(options.quick)


if __name__ == "__main__":
    main()
