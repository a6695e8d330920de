"""Results are read without a simulator, by one schema and one reader."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
RESULTS = sorted(path.stem for path in (ROOT / "coupling/results").glob("[!_]*.py"))
SIMULATOR = ["numba", "skfem", "particles", "plates", "coupling.interface", "coupling.cosimulation"]


def test_reading_a_result_imports_no_simulator() -> None:
    code = f"""
import sys
from importlib import import_module
for name in {RESULTS}:
    import_module("coupling.results." + name)
print([name for name in {SIMULATOR} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
