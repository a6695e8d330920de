"""What a user waits for before the first result: the import, a short script, and the first run with an empty cache.

Each figure is the median of processor times of new processes, so other work on the machine counts little. The first
run compiles kernels; it is measured once for each kind of chain, and followed by the kernels that took longest.
"""

import json
import os
import subprocess
import sys
from statistics import median
from tempfile import TemporaryDirectory
from typing import Any

REPEATS = 5

SCRIPT = """
import hertzlink as hl
bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=0.1, dissipation={loss})
hl.CoSimulation(chain, {structure}).run(until=1e-3)
"""

HALF_SPACE = "hl.half_space(hl.STEEL_440C)"
PLATE = "hl.reduce(hl.kirchhoff_plate(0.3, 0.3, 4.83e-3, hl.ALUMINIUM_6061).at(0.06, 0.15), until=1e-3)"

RUNS = {
    "chain on a half-space": SCRIPT.format(loss=None, structure=HALF_SPACE),
    "chain on a reduced plate": SCRIPT.format(loss=None, structure=PLATE),
    "chain with dashpots on a reduced plate": SCRIPT.format(loss="hl.LinearDashpot(4.0)", structure=PLATE),
}

COMPILATIONS = """
import json, time
from numba.core import event

class Times(event.Listener):
    running, own = [], {}
    def on_start(self, event):
        self.running.append([time.process_time(), 0.0])
    def on_end(self, event):
        begin, inner = self.running.pop()
        taken = time.process_time() - begin
        if self.running:
            self.running[-1][1] += taken
        name = event.data["dispatcher"].py_func.__name__
        self.own[name] = self.own.get(name, 0.0) + taken - inner

times = Times()
event.register("numba:compile", times)
"""


def seconds(code: str, folder: str) -> float:
    """Processor time of a new process that runs the code, with the folder as the cache of kernels."""
    return float(run(f"{code}\nimport time; print(time.process_time())", folder))


def run(code: str, folder: str) -> Any:
    """The JSON that is the last line of what a new process prints."""
    settings = {**os.environ, "NUMBA_CACHE_DIR": folder, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    # As in a user's shell: with it, Python would compile hertzlink's sources in each process.
    settings.pop("PYTHONDONTWRITEBYTECODE", None)
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], env=settings, check=True, capture_output=True, text=True
    )
    return json.loads(done.stdout.splitlines()[-1])


def main() -> None:
    """Print all figures, with ratios to the import of numpy and scipy.sparse.linalg."""
    with TemporaryDirectory() as folder:
        theirs = median(seconds("import numpy, scipy.sparse.linalg", folder) for _ in range(REPEATS))
        print(f"import numpy, scipy.sparse.linalg           {theirs:6.2f} s")
        for name, code in {
            "import hertzlink": "import hertzlink",
            "the same, and the names of a short script": "import hertzlink as hl; hl.Sphere, hl.Chain, hl.CoSimulation",
        }.items():
            found = median(seconds(code, folder) for _ in range(REPEATS))
            print(f"{name:43} {found:6.2f} s, {found / theirs:.2f} times theirs")
        for name, code in RUNS.items():
            print(f"\n{name}")
            with TemporaryDirectory() as empty:
                print(f"    process, empty cache                    {seconds(code, empty):6.1f} s")
                again = median(seconds(code, empty) for _ in range(REPEATS))
                print(f"    process, kernels in the cache           {again:6.2f} s, {again / theirs:.2f} times theirs")
            with TemporaryDirectory() as empty:
                own = run(f"{COMPILATIONS}{code}\nprint(json.dumps(times.own))", empty)
            slowest = sorted(own.items(), key=lambda one: -one[1])[:6]
            print(f"    compilation                             {sum(own.values()):6.1f} s, {len(own)} functions;")
            print("    " + ", ".join(f"{kernel} {taken:.1f}" for kernel, taken in slowest))


if __name__ == "__main__":
    main()
