"""The substructured chain against an explicit finite-element chain, which shares nothing with it but the material."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl

BEAD, SPEED, UNTIL = hl.Sphere(2.38e-3, hl.STEEL_316), 0.5, 32e-6


@pytest.fixture(scope="module")
def explicit() -> xr.Dataset:
    """Forces on the mean of each saved interval, so that nodes that close one by one tell less."""
    chain = hl.Chain([BEAD] * 3, BEAD, SPEED)
    return hl.explicit_chain(chain, UNTIL, spacing=12e-6, save_every=0.1e-6)


def substructured(modes: int) -> xr.Dataset:
    chain = hl.DeformableChain([BEAD] * 3, BEAD, SPEED, modes=modes)
    return hl.CoSimulation(chain, None).run(until=UNTIL, save_every=0.1e-6)


def passages(run: xr.Dataset) -> tuple[Any, Any, Any]:
    """Of the three contacts: impulse, the time of the force's centroid, and its peak by a parabola over 3 µs."""
    force, time = run.contact_force.values[:, :3], run.time.values
    impulse = np.trapezoid(force, time, axis=0)
    arrival = np.trapezoid(force * time[:, None], time, axis=0) / impulse
    peaks = []
    for one in force.T:
        near = abs(time - time[one.argmax()]) < 1.5e-6
        a, b, c = np.polyfit(1e6 * (time[near] - time[one.argmax()]), one[near], 2)
        peaks.append(c - b**2 / (4.0 * a))
    return impulse, arrival, np.array(peaks)


@pytest.mark.thorough
def test_waves_pass_alike(explicit: xr.Dataset) -> None:
    """Impulses, arrivals, peaks and the beads' last speeds within 0.1 %; a chain of rigid beads is 0.5 % off."""
    expected = passages(explicit)
    for run, tolerance in ((substructured(8), 1e-3), (substructured(3), 1e-3)):
        found = passages(run)
        assert found[0] == pytest.approx(expected[0], rel=tolerance)
        assert found[1] == pytest.approx(expected[1], rel=tolerance)
        assert found[2] == pytest.approx(expected[2], rel=2.0 * tolerance)
        last = (run.velocity[-1] - explicit.velocity[-1]).values
        assert last == pytest.approx(np.zeros(4), abs=tolerance * SPEED)
    rigid = passages(substructured(1))
    assert abs(rigid[1] / expected[1] - 1.0).max() > 3e-3


@pytest.mark.thorough
def test_beads_vibrate_alike(explicit: xr.Dataset) -> None:
    """The force through the central section rings as the explicit beads' does, once the fast tremble is averaged."""
    run = substructured(12)
    for bead in (1, 2):
        ours, theirs = (one.section_force.sel(bead=bead).values for one in (run, explicit))
        mean = hl.sensor_force(run, bead).values
        smooth = np.ones(5) / 5.0
        error, ringing = (np.convolve(theirs - other, smooth, "same") for other in (ours, mean))
        assert abs(error).max() < 0.02 * ours.max()
        assert np.sqrt((error**2).mean()) < 0.5 * np.sqrt((ringing**2).mean())


@pytest.mark.thorough
def test_what_stays_in_vibration_is_alike(explicit: xr.Dataset) -> None:
    """After the striker has left, its own vibration: small, and of one size in both."""
    run = substructured(12)
    kept = [float(one.vibration_energy.sel(bead=0)[-1] / one.impact_energy) for one in (run, explicit)]
    assert 0.0 < kept[0] < 1e-4
    assert 0.0 < kept[1] < 1e-3
