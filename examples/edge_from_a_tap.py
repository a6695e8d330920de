"""The thickness of a plate and the distance of its clamped edge from one tap, whose gain and time zero are unknown.

The signal is simulated, with 1 % noise, so that the truth is known. `hl.identifiability` says beforehand which sensors
can see the edge; `hl.identify` finds it. AR and TOF alone cannot.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import hertzlink as hl

BEAD, UNTIL = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C), 1.2e-3


def build(thickness: float, distance: float, impact_speed: float) -> hl.CoSimulation:
    """Twenty beads on an aluminium plate with one clamped edge."""
    plate = hl.half_plane(thickness, hl.ALUMINIUM_6061, "clamped", distance, until=UNTIL, highest_frequency=60e3)
    return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, impact_speed), plate)


THICKNESS, DISTANCE, SPEED = 4.83e-3, 0.06, 0.31  # the truth, which the fit does not know

for compare in ("features", "waveform"):
    known = hl.identifiability(
        build, 0.01, [7], UNTIL, compare=compare, thickness=THICKNESS, distance=DISTANCE, impact_speed=SPEED
    )
    print(f"{compare}: the distance is {known.verdict('distance')}")

run = build(THICKNESS, DISTANCE, SPEED).run(UNTIL, save_every=2.5e-7)
time, random = np.arange(0.0, UNTIL + 1e-4, 1e-6), np.random.default_rng(5)
force = 1.25 * np.interp(time - 1e-4, run.time, hl.sensor_force(run, 7), left=0.0)
signal = hl.as_signal(time, {7: force + random.normal(0.0, 0.01 * force.max(), time.size)})

found = hl.identify(
    signal,
    build,
    nuisances=["gain", "time_zero", "impact_speed"],
    until=UNTIL,
    thickness=(2e-3, 8e-3),
    distance=(0.01, 0.2),
    impact_speed=(0.2, 0.5),
)
print(f"distance {found['distance'].value * 1e3:.1f} mm, thickness {found['thickness'].value * 1e3:.2f} mm")
print(found)

figure, (above, below) = plt.subplots(
    2, sharex=True, figsize=(7.0, 5.0), height_ratios=[2.5, 1.0], layout="constrained"
)
milliseconds = found.data.time * 1e3
above.plot(milliseconds, found.data.measured.sel(sensor=7), color="0.6", label="measured")
above.plot(milliseconds, found.data.fitted.sel(sensor=7), color="C0", label="fitted")
above.set(ylabel="force at bead 7, N", title="Thickness and edge distance from one tap")
above.legend(frameon=False)
below.plot(milliseconds, found.data.residual.sel(sensor=7), color="0.4", linewidth=0.7)
below.axhspan(*(sign * 2.0 * float(found.data.noise[0]) for sign in (-1.0, 1.0)), color="C0", alpha=0.15, linewidth=0.0)
below.set(xlabel="time, ms", ylabel="residual, N")
below.annotate("± 2 standard deviations of the noise", (0.01, 0.04), xycoords="axes fraction", fontsize=8)
figure.savefig(Path("edge_from_a_tap.png"), dpi=150)
