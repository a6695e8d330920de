"""Beads that deform by modes against curves of explicit finite elements, which share only their material."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid

import hertzlink as hl

FILE = Path(__file__).parents[1] / "reference" / "explicit_chain.csv"
BEAD, SPEED = hl.Sphere(2.38e-3, hl.STEEL_316), 0.5
LAST_SPEEDS = (-0.0341497, -0.0141508, 0.0665622, 0.481738)
"""Of the explicit chain at its end, m/s; see the head of its file."""


def passages(time: Any, force: Any) -> tuple[Any, Any, Any]:
    """The impulse of each contact, the time of its force's centroid, and its peak by a parabola over 3 µs."""
    impulse = trapezoid(force, time, axis=0)
    arrival = trapezoid(force * time[:, None], time, axis=0) / impulse
    peaks = []
    for one in force.T:
        near = abs(time - time[one.argmax()]) < 1.5e-6
        a, b, c = np.polyfit(1e6 * (time[near] - time[one.argmax()]), one[near], 2)
        peaks.append(c - b**2 / (4.0 * a))
    return impulse, arrival, np.array(peaks)


def ringing(force: Any, section: Any) -> Any:
    """The force through the sections of striker and first bead minus the contacts' mean, averaged over 1 µs: nodes of
    the explicit chain close one by one and shake it faster."""
    mean = 0.5 * np.column_stack([force[:, 0], force[:, 0] + force[:, 1]])
    return np.array([np.convolve(one, np.ones(5) / 5.0, "valid") for one in (section - mean).T])


@pytest.mark.thorough
def test_waves_pass_and_beads_vibrate_as_in_explicit_elements() -> None:
    """Impulses, arrivals and last speeds within 0.04 %, as those of rigid beads are not; peaks within 0.3 %."""
    columns = np.loadtxt(FILE, delimiter=",")
    time, force, section = 1e-6 * columns[:, 0], columns[:, 1:4], columns[:, 4:]
    expected = passages(time, force)
    found = {}
    for modes in (1, 3, 8):
        chain = hl.DeformableChain([BEAD] * 3, BEAD, SPEED, modes=modes)
        run = hl.CoSimulation(chain, None).run(until=float(time[-1]), save_every=float(time[1]))
        found[modes] = passages(run.time.values, run.contact_force.values[:, :3])
        if modes == 1:
            continue
        for one, other, close in zip(found[modes], expected, (4e-4, 4e-4, 3e-3), strict=True):
            assert one == pytest.approx(other, rel=close)
        assert run.velocity[-1].values == pytest.approx(LAST_SPEEDS, abs=4e-4 * SPEED)
    assert min(abs(found[1][i] / expected[i] - 1.0).max() for i in range(2)) > 3e-3
    own = ringing(run.contact_force.values, run.section_force.values[:, :2])
    for one, other in zip(own, ringing(force, section), strict=True):
        assert np.corrcoef(one, other)[0, 1] > 0.8
        assert one.std() == pytest.approx(other.std(), rel=0.5)
