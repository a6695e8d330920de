"""Processor time of the boundary study in one process: its search for critical distances, and its margins.

    python benchmarks/boundary_search.py [FILE]

The thesis's square plate, three thicknesses and three beads; 27 distances, then refined to 0.2 mm for three tolerances
of AR and one in units of the far value. Run it twice: the first time compiles. FILE keeps the data.
"""

import sys
from time import process_time

import numpy as np

from hertzlink.studies import plate_boundary as study
from hertzlink.studies.shared import SIDE
from structures.caution import collected


def main() -> None:
    """Print the processor time and the critical distances."""
    begin = process_time()
    study.modes().at(SIDE / 4.0, SIDE / 2.0)
    prepared = process_time() - begin
    with collected():
        data = study.run(jobs=1)
    spent, runs = process_time() - begin, int(data.sampled.sum())
    print(f"{spent:.1f} s of processor time, {prepared:.1f} s of it for the modes; {runs} runs")
    print("critical distance, mm, where AR differs by 0.02 from its far value; its numerical error")
    for values in (data.critical_distance.sel(within=study.TOLERANCE), data.margin.sel(within=study.TOLERANCE)):
        print((1e3 * values).transpose("thickness", "diameter").to_pandas().round(3))
    waves = int(np.isfinite(data.amplitude_ratio).sum())
    print(f"{waves} runs have a wave")
    if len(sys.argv) > 1:
        data.to_netcdf(sys.argv[1], engine="h5netcdf")


if __name__ == "__main__":
    main()
