"""The substructured chain against an explicit finite-element chain, which shares nothing with it but the material."""

from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl

THOROUGH_FIXTURES = ("explicit",)

BEAD, SPEED, UNTIL = hl.Sphere(2.38e-3, hl.STEEL_316), 0.5, 32e-6
CELLS = 16e-6
"""m. With 12 µm peaks are 0.2 % closer, for three times the time; impulses and arrivals hardly change."""


@pytest.fixture(scope="module")
def explicit() -> xr.Dataset:
    """Forces on the mean of each saved interval, so that nodes that close one by one matter less."""
    chain = hl.Chain([BEAD] * 3, BEAD, SPEED)
    return hl.explicit_chain(chain, UNTIL, spacing=CELLS, save_every=0.1e-6)


def substructured(modes: int) -> xr.Dataset:
    chain = hl.DeformableChain([BEAD] * 3, BEAD, SPEED, modes=modes)
    return hl.CoSimulation(chain, None).run(until=UNTIL, save_every=0.1e-6)


def passages(run: xr.Dataset, contacts: int = 3) -> tuple[Any, Any, Any]:
    """Of the first contacts: impulse, the time of the force's centroid, and its peak by a parabola over 3 µs."""
    force, time = run.contact_force.values[:, :contacts], run.time.values
    impulse = np.trapezoid(force, time, axis=0)
    arrival = np.trapezoid(force * time[:, None], time, axis=0) / impulse
    peaks = []
    for one in force.T:
        near = abs(time - time[one.argmax()]) < 1.5e-6
        a, b, c = np.polyfit(1e6 * (time[near] - time[one.argmax()]), one[near], 2)
        peaks.append(c - b**2 / (4.0 * a))
    return impulse, arrival, np.array(peaks)


@pytest.mark.thorough
def test_two_beads_collide_alike() -> None:
    """Impulse and time of the contact within 0.1 %, its peak within 0.5 %, by cells of 16 µm."""
    theirs = hl.explicit_chain(hl.Chain([BEAD], BEAD, SPEED), 18e-6, spacing=CELLS, save_every=0.1e-6)
    chain = hl.DeformableChain([BEAD], BEAD, SPEED, modes=8)
    modal = hl.CoSimulation(chain, None).run(until=18e-6, save_every=0.1e-6)
    for found, expected, close in zip(passages(modal, 1), passages(theirs, 1), (1e-3, 1e-3, 5e-3), strict=True):
        assert found == pytest.approx(expected, rel=close)
    assert modal.velocity[-1].values == pytest.approx(theirs.velocity[-1].values, abs=2e-5 * SPEED)


@pytest.mark.thorough
def test_waves_pass_alike(explicit: xr.Dataset) -> None:
    """Impulses, arrivals and the beads' last speeds within 0.1 %, as rigid beads' are not; and peaks, which the
    explicit chain's nodes shake as they close one by one, within the 0.5 % that its cells of 16 µm leave them. The time
    from the first contact to the third agrees to 0.05 %."""
    expected = passages(explicit)
    for modes in (3, 8):
        run = substructured(modes)
        found = passages(run)
        assert found[0] == pytest.approx(expected[0], rel=1e-3)
        assert found[1] == pytest.approx(expected[1], rel=1e-3)
        assert found[1][2] - found[1][0] == pytest.approx(expected[1][2] - expected[1][0], rel=5e-4)
        assert found[2] == pytest.approx(expected[2], rel=5e-3)
        last = (run.velocity[-1] - explicit.velocity[-1]).values
        assert last == pytest.approx(np.zeros(4), abs=1.2e-3 * SPEED)
    rigid = passages(substructured(1))
    assert abs(rigid[0] / expected[0] - 1.0).max() > 3e-3
    assert abs(rigid[1] / expected[1] - 1.0).max() > 3e-3


@pytest.mark.thorough
def test_beads_vibrate_alike(explicit: xr.Dataset) -> None:
    """What the force through the central section has beyond the contacts' mean, over 0.9 µs, as nodes close faster."""
    run, smooth = substructured(8), np.ones(9) / 9.0
    for bead in (0, 1):
        ringing = []
        for one in (run, explicit):
            contacts = one.contact_force.values
            mean = 0.5 * (contacts[:, bead] + (contacts[:, bead - 1] if bead else 0.0))
            ringing.append(np.convolve(one.section_force.values[:, bead] - mean, smooth, "valid"))
        assert np.corrcoef(*ringing)[0, 1] > 0.8
        assert ringing[0].std() == pytest.approx(ringing[1].std(), rel=0.5)


@pytest.mark.thorough
def test_what_stays_in_vibration_is_alike(explicit: xr.Dataset) -> None:
    """After the striker has left, its own vibration: small, and of one size in both."""
    run = substructured(12)
    kept = [float(one.vibration_energy.sel(bead=0)[-1] / one.impact_energy) for one in (run, explicit)]
    assert 0.0 < kept[0] < 1e-4
    assert 0.0 < kept[1] < 1e-3
