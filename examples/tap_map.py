"""A map of a plate from taps on a grid: its thickness and the distance of its edge, point by point, with intervals.

The files are simulated as a scope of 8 bits and 2 MHz writes them, with hum of 50 Hz and noise. The plate has a thin
spot; the fit knows neither speed nor gain nor time zero. `python tap_map.py 5` makes the grid of docs/maps.md.
"""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl

UNTIL, PLATE = 1.2e-3, hl.Material(68.9e9, 0.33, 2693.0)  # aluminium; it yields nowhere
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)


def build(thickness: float, distance: float, impact_speed: float) -> hl.CoSimulation:
    plate = hl.half_plane(thickness, PLATE, "clamped", distance, until=UNTIL)
    return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, impact_speed), plate)


def thickness_at(x: float, y: float) -> float:
    """3 mm, with a spot of 2.7 mm around (35, 40) mm."""
    return float(3e-3 - 0.3e-3 * np.exp(-(((x - 35e-3) / 15e-3) ** 2) - ((y - 40e-3) / 25e-3) ** 2))


def write_tap(file: str, x: float, y: float, random: np.random.Generator) -> None:
    run = build(thickness_at(x, y), x, 0.31 * random.uniform(0.9, 1.1)).run(UNTIL)
    time = np.arange(-45e-3, UNTIL, 0.5e-6)  # a lead of two periods of the mains
    force = np.interp(time - random.uniform(0.0, 5e-7), run.time, hl.sensor_force(run, 7), left=0.0)
    peak = force.max()
    force += 0.02 * peak * np.sin(2.0 * np.pi * 50.0 * time + random.uniform(0.0, 2.0 * np.pi))
    force += 0.004 * peak * random.normal(size=time.size)
    bit = 2.4 * peak / 2**8
    volts = np.round(force / bit) * bit / 25.0
    np.savetxt(file, np.stack([time, volts], axis=1), ["%.7f", "%.4f"], ",", header="time (s),force (V)", comments="")


def read(file: Path) -> xr.Dataset:
    return hl.clean_signal(hl.read_signal(file, {7: 1}, calibration=25.0), mains=50.0)


def answer(signal: xr.Dataset, point: Any) -> Any:
    nuisances = ["impact_speed", "gain", "time_zero"]
    return hl.identify(
        signal, build, nuisances, until=UNTIL, thickness=(1e-3, 6e-3), distance=(5e-3, 0.1), impact_speed=(0.2, 0.5)
    )


side = int(sys.argv[1]) if len(sys.argv) > 1 and sys.argv[1].isdigit() else 2
random, points = np.random.default_rng(5), list[dict[str, Any]]()
for i, x in enumerate(np.linspace(15e-3, 55e-3, side)):
    for j, y in enumerate(np.linspace(0.0, 80e-3, side)):
        write_tap(f"tap-{i}{j}.csv", x, y, random)
        points.append({"x": x, "y": y, "files": [f"tap-{i}{j}.csv"]})

taps = hl.map_taps(points, read, answer, jobs=1)
for point, there in zip(points, taps.transpose("point", ...).sel(unknown=["thickness", "distance"]).value, strict=True):
    truth = thickness_at(point["x"], point["y"]), point["x"]
    found = ", ".join(f"{1e3 * one:.2f} mm" for one in there.values)
    print(f"x = {1e3 * point['x']:.0f} mm, y = {1e3 * point['y']:.0f} mm: {found}; the truth {1e3 * truth[0]:.2f} mm")
for unknown in ("thickness", "distance"):
    hl.plots.mapped(taps, unknown, "error")
