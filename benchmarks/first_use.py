"""What a user waits for before the first result: the import, a short script, and the first run, which compiles.

    python benchmarks/first_use.py

Each figure is processor time of new processes, which other work on the machine hardly changes, and the median of five.
Only the first run, with an empty cache of kernels, is made once for each kind of chain.
"""

import os
import subprocess
import sys
from statistics import median
from tempfile import TemporaryDirectory

REPEATS = 5

SCRIPT = """
import hertzlink as hl
bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=0.1, dissipation={loss})
hl.CoSimulation(chain, {structure}).run(until=1e-3)
"""
PLATE = "hl.reduce(hl.kirchhoff_plate(0.3, 0.3, 4.83e-3, hl.ALUMINIUM_6061).at(0.06, 0.15), until=1e-3)"

RUNS = {
    "chain on a half-space": SCRIPT.format(loss=None, structure="hl.half_space(hl.STEEL_440C)"),
    "chain on a reduced plate": SCRIPT.format(loss=None, structure=PLATE),
    "chain with dashpots on a reduced plate": SCRIPT.format(loss="hl.LinearDashpot(4.0)", structure=PLATE),
}


def seconds(code: str, folder: str) -> float:
    """Processor time of a new process that runs the code, with the folder as the cache of kernels."""
    settings = {**os.environ, "NUMBA_CACHE_DIR": folder, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    # As in a user's shell: with this variable, Python would compile hertzlink's sources in each process.
    settings.pop("PYTHONDONTWRITEBYTECODE", None)
    timed = f"{code}\nimport time; print(time.process_time())"
    command = [sys.executable, "-W", "ignore", "-c", timed]
    done = subprocess.run(command, env=settings, check=True, capture_output=True, text=True)
    return float(done.stdout.splitlines()[-1])


def main() -> None:
    """Print all figures, with ratios to the import of numpy and scipy.sparse.linalg."""
    with TemporaryDirectory() as folder:
        theirs = median(seconds("import numpy, scipy.sparse.linalg", folder) for _ in range(REPEATS))
        print(f"import numpy, scipy.sparse.linalg           {theirs:6.2f} s")
        own = median(seconds("import hertzlink", folder) for _ in range(REPEATS))
        print(f"import hertzlink                            {own:6.2f} s, {own / theirs:.2f} times that")
        for name, code in RUNS.items():
            with TemporaryDirectory() as empty:
                first = seconds(code, empty)
                again = median(seconds(code, empty) for _ in range(REPEATS))
            print(f"{name:43} {first:6.2f} s at first, then {again:.2f} s, {again / theirs:.2f} times that")


if __name__ == "__main__":
    main()
