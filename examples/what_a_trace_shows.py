"""What one trace determines of a plate's clamped edge, and what it is blind to, before anything is measured.

Thickness, impact speed, gains and the time zero are not known either; the noise is 1 % of the greatest force. Curves
are half-widths of the 95 % interval of the edge's distance at best (Cramér–Rao), as parts of the distance.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import hertzlink as hl

BEAD, THICKNESS, SPEED = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C), 4.83e-3, 0.31
RECORDS, BLIND = (1.4e-3, 2.8e-3), 50.0  # s; per cent
SENSORS = {"bead 7": [7], "bead 13": [13], "beads 7 and 13": [7, 13]}


def build(distance: float, thickness: float, impact_speed: float) -> hl.CoSimulation:
    """Twenty beads on an aluminium plate with one clamped edge."""
    plate = hl.half_plane(thickness, hl.ALUMINIUM_6061, "clamped", distance, until=max(RECORDS), highest_frequency=60e3)
    return hl.CoSimulation(hl.Chain([BEAD] * 20, BEAD, impact_speed), plate)


def half_width(distance: float, sensors: list[int], record: float, compare: str = "waveform") -> float:
    """Half of the 95 % interval of the distance, in per cent of it."""
    known = hl.identifiability(
        build, 0.01, sensors, record, compare=compare, distance=distance, thickness=THICKNESS, impact_speed=SPEED
    )
    return 196.0 * known.relative["distance"]


def shown(width: float) -> str:
    return f"± {width:.2f} %" if width < BLIND else "blind"


print(f"AR and TOF of bead 7: {shown(half_width(0.06, [7], RECORDS[0], 'features'))} at 60 mm")
distances = [0.005, 0.01, 0.02, 0.04, 0.06, 0.09, 0.16, 0.3]
figure, panels = plt.subplots(1, 2, figsize=(9.0, 4.0), sharey=True, layout="constrained")
for axes, record in zip(panels, RECORDS, strict=True):
    for (name, sensors), marker in zip(SENSORS.items(), "o^s", strict=True):
        widths = [half_width(distance, sensors, record) for distance in distances]
        near, far = (shown(widths[distances.index(place)]) for place in (0.06, 0.16))
        print(f"{1e3 * record:.1f} ms, {name}: {near} at 60 mm, {far} at 160 mm")
        axes.loglog(1e3 * np.array(distances), np.minimum(widths, 150.0), marker=marker, label=name)
    axes.axhspan(BLIND, 200.0, facecolor="0.9", hatch="//", edgecolor="0.7")
    axes.set(title=f"record of {1e3 * record:.1f} ms", xlabel="distance of the edge (mm)", ylim=(0.05, 200.0))
panels[0].set_ylabel("half-width of the distance (%); hatched: blind")
panels[0].legend(frameon=False, fontsize=8, loc="lower left")
figure.savefig(Path("what_a_trace_shows.png"), dpi=150)
