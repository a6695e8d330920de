"""A map of a plate with an edge, from 25 taps as a scope of 8 bits and 2 MHz records them, with hum of 50 Hz.

The plate has a thin spot. Its traces are simulated, with speeds, gains and times of impact that the fit does not know.
One file is lost, and one begins too late to show the hum. `hertzlink map` answers in the folder; then the intervals of
points that are identified are compared with the truth.

    python benchmarks/tap_map.py [folder]
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pandas as pd

import hertzlink as hl

CASE = """
[chain]
beads = 20
bead = { shape = "sphere", diameter = "9.52 mm", material = "steel 440C" }
striker = "bead"
impact_speed = "0.31 m/s"

[materials.elastic]
youngs_modulus = "68.9 GPa"
poisson_ratio = 0.33
density = 2693.0

[structure]
kind = "half_plane"
thickness = "3 mm"
material = "elastic"
edge = "clamped"
distance = "50 mm"

[run]
until = "1.2 ms"

[identify]
sensors = { 7 = 1 }
calibration = "25 N/V"
mains = "50 Hz"
unknowns = { "structure.thickness" = ["1 mm", "6 mm"], "structure.distance" = ["5 mm", "100 mm"] }
nuisances = ["chain.impact_speed", "gain", "time_zero"]
"""

X, Y = np.linspace(15e-3, 55e-3, 5), np.linspace(0.0, 80e-3, 5)
LOST, LATE = (3, 1), (1, 3)
LEAD, SHORT_LEAD, UNTIL, STEP = 45e-3, 0.2e-3, 1.2e-3, 0.5e-6
NOISE, HUM = 0.004, 0.02
"""In parts of the peak."""


def thickness(x: float, y: float) -> float:
    """Return that of the plate at a place, m: 3 mm, with a spot of 2.7 mm around (35, 40) mm."""
    return float(3e-3 - 0.3e-3 * np.exp(-(((x - 35e-3) / 15e-3) ** 2) - ((y - 40e-3) / 25e-3) ** 2))


def recorded(x: float, y: float, lead: float, random: np.random.Generator) -> np.ndarray:
    """Return what the scope writes of a tap: time, s, and V."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    aluminium = hl.Material(68.9e9, 0.33, 2693.0)
    chain = hl.Chain([bead] * 20, bead, 0.31 * random.uniform(0.9, 1.1))
    run = hl.CoSimulation(chain, hl.half_plane(thickness(x, y), aluminium, "clamped", x, UNTIL)).run(UNTIL)
    time = np.arange(-lead, UNTIL, STEP)
    volts = np.interp(time - random.uniform(0.0, STEP), run.time, hl.sensor_force(run, 7), left=0.0) / 25.0
    peak = volts.max()
    volts += peak * HUM * np.sin(2.0 * np.pi * 50.0 * time + random.uniform(0.0, 2.0 * np.pi))
    volts += peak * NOISE * random.normal(size=time.size)
    bit = 2.4 * peak / 2**8
    return np.stack([time, np.round(volts / bit) * bit], axis=1)


def write_scan(folder: Path) -> None:
    """Write the files of all taps, and the table of points."""
    random, lines = np.random.default_rng(5), ["x / mm, y / mm, file"]
    folder.mkdir(exist_ok=True)
    for i, x in enumerate(X):
        for j, y in enumerate(Y):
            trace = recorded(x, y, SHORT_LEAD if (i, j) == LATE else LEAD, random)
            if (i, j) != LOST:
                np.savetxt(
                    folder / f"tap-{i}{j}.csv", trace, ["%.7f", "%.4f"], ",", header="time (s),force (V)", comments=""
                )
            lines.append(f"{1e3 * x:g}, {1e3 * y:g}, tap-{i}{j}.csv")
    (folder / "points.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")


def main() -> None:
    """Write, answer, and count the intervals that hold the truth."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(sys.argv[1] if len(sys.argv) > 1 else temporary)
        folder.mkdir(exist_ok=True)
        (folder / "plate.toml").write_text(CASE, encoding="utf-8")
        write_scan(folder / "scan")
        # The exit code 3 says that some points have no answer.
        subprocess.run([sys.executable, "-m", "hertzlink", "map", "plate.toml", "scan", "--force"], cwd=folder)
        answers = pd.read_csv(folder / "plate-map" / "map.csv")
    identified = answers[answers.verdict == "identified"]
    for unknown, rows in identified.groupby("unknown"):
        truth = rows["x (m)"] if unknown == "structure.distance" else map(thickness, rows["x (m)"], rows["y (m)"])
        inside = sum(low <= true <= high for low, true, high in zip(rows.low, truth, rows.high, strict=True))
        print(f"{unknown}: {len(rows)} points identified, the truth inside {inside} of their intervals")


if __name__ == "__main__":
    main()
