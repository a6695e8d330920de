"""The table of the law of the critical distance, plates/edge_ratios.csv: AR over stiffness ratio, edge, λ and d/ℓ.

    python benchmarks/edge_ratios.py --output plates/edge_ratios.csv [--jobs 2]

It takes ten minutes on two idle cores. Beads of 10 mm of steel 440C at 0.3 m/s. The plates have a density of 2700 kg/m³
and Poisson's ratio 0.33, which influence the result through λ and ℓ only, and the modulus that gives the stiffness
ratio.
"""

import argparse
import csv
import sys
from itertools import product

import joblib
import numpy as np

from hertzlink.studies.critical_distance import Pair
from particles.bead import Sphere
from plates.half_plane import EDGES
from structures.material import ALUMINIUM_6061, STEEL_440C, Material

BEAD, SPEED = Sphere(5e-3, STEEL_440C), 0.3
"""Any other bead and speed with the same λ, d/ℓ and ratio of stiffnesses give the same AR."""

STIFFNESS_RATIOS = (0.35, Pair(BEAD, ALUMINIUM_6061, SPEED).stiffness_ratio, 2.0**0.5)
"""A soft laminate, aluminium, and a plate of the beads' own modulus, all under steel beads."""

PARAMETERS = (0.05, 0.07, 0.1, 0.14, 0.2, 0.28, 0.4, 0.56, 0.7, 0.8, 0.9, 1.0, 1.15, 1.3, 1.5, 1.75, 2.0)
NEAR = tuple(round(0.1 * i, 1) for i in range(36))
FAR = (*(3.5 + 0.25 * i for i in range(1, 11)), *(6.0 + 0.5 * i for i in range(1, 7)))
"""Distances over ℓ. Up to λ = 0.56 AR has settled to 1e-3 within NEAR."""

SETTLED = 0.6


def tabulated_pair(stiffness_ratio: float) -> Pair:
    """BEAD on a plate that gives the ratio: 1/E* = 1/M + 1/M_plate, M = E/(1 − ν²); pairs have half the radius."""
    modulus = STEEL_440C.contact_modulus * stiffness_ratio / (2.0 * 2.0**0.5 - stiffness_ratio)
    return Pair(BEAD, Material(modulus * (1.0 - 0.33**2), 0.33, 2700.0), SPEED)


def row(stiffness_ratio: float, edge: str, parameter: float) -> list[str]:
    """One line of the table."""
    pair = tabulated_pair(stiffness_ratio)
    distances = NEAR if parameter < SETTLED else (*NEAR, *FAR)
    far, *found = pair.ratios(edge, parameter, (np.inf, *distances))
    found += [far] * (len(NEAR) + len(FAR) - len(found))
    return [edge, f"{stiffness_ratio:.6f}", f"{parameter:g}", *(f"{one:.5f}" for one in (far, *found))]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", required=True)
    parser.add_argument("--jobs", type=int, default=2)
    given = parser.parse_args()
    lines = joblib.Parallel(given.jobs, verbose=10)(
        joblib.delayed(row)(*point) for point in product(STIFFNESS_RATIOS, EDGES, PARAMETERS)
    )
    with open(given.output, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["edge", "stiffness_ratio", "inelasticity", "far", *(f"{one:g}" for one in (*NEAR, *FAR))])
        writer.writerows(lines)


if __name__ == "__main__":
    sys.exit(main())
