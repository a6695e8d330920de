"""Processor time of the whole search of the boundary study: critical distances from a clamped edge, on one basis.

The thesis's square plate, three thicknesses and three beads; 27 distances, then refined to 0.2 mm for three tolerances
of AR and one in units of the far value. Run it twice: the first time compiles. `boundary_search.py FILE` also keeps the
samples.
"""

import sys
from functools import lru_cache, partial
from time import process_time

import numpy as np

import hertzlink as hl
from hertzlink.studies import plate_boundary as study
from hertzlink.studies.on_plates import DIAMETERS, SENSOR, SIDE, THICKNESSES, UNTIL, chain, plate
from structures.caution import collected


@lru_cache(maxsize=1)
def basis() -> hl.ModalPlate:
    """Return the basis of all places and thicknesses."""
    return hl.ModalPlate(plate(THICKNESSES[0]), UNTIL)


@lru_cache(maxsize=256)
def struck(thickness: float, distance: float) -> hl.Structure:
    """Return the plate struck on its centre line; for all beads."""
    return basis().at(distance, SIDE / 2.0, thickness)


def build(thickness: float, distance: float, diameter: float) -> hl.CoSimulation:
    """Return a chain of 20 beads on the plate."""
    return hl.CoSimulation(chain(diameter), struck(thickness, distance))


def main() -> None:
    """Search, and print the processor time and the critical distances."""
    begin = process_time()
    basis().at(SIDE / 4.0, SIDE / 2.0)
    prepared = process_time()
    find = partial(
        hl.critical_distance_search, build, UNTIL, SENSOR, study.DISTANCES,
        bracket=study.BRACKET, jobs=1, thickness=THICKNESSES, diameter=DIAMETERS,
    )  # fmt: skip
    with collected():
        first = find(tolerance=study.TOLERANCES)
        relative = find(tolerance=study.RELATIVE_TOLERANCE, relative=True, known=first)
    spent, runs = process_time() - begin, int(np.isfinite(relative.amplitude_ratio).sum())
    print(f"{spent:.1f} s of processor time, {prepared - begin:.1f} s of it for the basis; {runs} samples with a wave")
    print("critical distance, mm, where AR differs by 0.02 from its far value")
    print((1e3 * first.critical_distance.sel(within=study.TOLERANCE)).to_pandas().round(2))
    if len(sys.argv) > 1:
        relative.drop_vars("within").to_netcdf(sys.argv[1])


if __name__ == "__main__":
    main()
