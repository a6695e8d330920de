"""The moving figure of the front page: beads of a run, coloured by their forces, as an SVG without scripts."""

import sys
from pathlib import Path

import numpy as np

import hertzlink as hl

FRAMES, SECONDS, COUNT = 90, 8.0, 16


def write(path: Path) -> None:
    """Run a chain against a layered rod, and draw each bead with its force over time."""
    bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    chain = hl.Chain([bead] * COUNT, striker=bead, impact_speed=0.3)
    rod = hl.rod([hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)])
    run = hl.CoSimulation(chain, rod).run(until=1.1e-3)
    times = np.linspace(0.0, 1.1e-3, FRAMES)
    force = [np.interp(times, run.time, hl.sensor_force(run, sensor=n)) for n in range(1, COUNT + 1)]
    strongest = max(map(np.max, force))
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {40 * COUNT + 116} 84" role="img" '
        'aria-label="A wave runs down a chain of beads, meets a rod of steel and PTFE, and two waves come back">'
    ]
    for n, trace in enumerate(force):
        shares = np.clip(trace / strongest, 0.0, 1.0) ** 0.6
        fills = ";".join(f"rgb({120 + 105 * s:.0f},{150 - 70 * s:.0f},{180 - 150 * s:.0f})" for s in shares)
        lines.append(
            f'<circle cx="{22 + 40 * n}" cy="42" r="19" fill="#7896b4"><animate attributeName="fill" values="{fills}" '
            f'dur="{SECONDS}s" repeatCount="indefinite"/></circle>'
        )
    lines.append(f'<rect x="{40 * COUNT + 2}" y="6" width="24" height="72" fill="#64748b"/>')
    lines.append(f'<rect x="{40 * COUNT + 26}" y="6" width="84" height="72" fill="#a8b5c4"/></svg>\n')
    path.write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    write(Path(sys.argv[1]))
