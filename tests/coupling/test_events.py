"""When contacts open and close: Hertz's collision, a bead between walls, the reference's gaps, and coarse sampling."""

import warnings
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hard_cases import BEAD, chattering, oscillator
from monolithic import monolithic
from scipy.special import gamma

import hertzlink as hl

SPEED = 0.31
SENT = hl.Chain([BEAD], striker=None, impact_speed=SPEED)
ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.03, 0.01)], elements=4)


def wall() -> hl.Structure:
    return hl.half_space(hl.STEEL_440C)


def hertz_time() -> float:
    """2.943 (m²/(k²v))^(1/5) with k of F = k δ^1.5 in ½ m v² = 2/5 k δ^2.5 (Johnson, Contact Mechanics, 11.24)."""
    stiffness = hl.contact_law(BEAD, hl.Surface(hl.STEEL_440C)).kernel[0]
    deepest = (1.25 * BEAD.mass * SPEED**2 / stiffness) ** 0.4
    return float(deepest / SPEED * 2.0 * sqrt(pi) * gamma(1.4) / gamma(0.9))


def times(events: xr.Dataset, kind: str) -> Any:
    return events.time.values[events.kind.values == kind]


def test_a_bead_leaves_a_wall_in_hertzs_time() -> None:
    """It touches at time zero, which is no event."""
    events = hl.contact_events(hl.CoSimulation(SENT, wall()).run(1.5 * hertz_time()))
    assert events.kind.values.tolist() == ["opens"]
    assert times(events, "opens") == pytest.approx([hertz_time()], rel=1e-6)
    assert events.time.attrs["units"] == "s"


def test_the_error_falls_with_save_every_to_the_power_of_three_and_a_half() -> None:
    """As the force goes with δ^1.5; mean over many places of the opening between 8 to 32 saved times in a contact."""
    errors = []
    for parts in (8, 16, 32):
        wrong = []
        for shift in np.linspace(0.0, 1.0, 17)[:-1]:
            interval = hertz_time() / (parts + shift)
            run = hl.CoSimulation(SENT, wall()).run(hertz_time() + 3.0 * interval, save_every=interval)
            wrong.append(times(hl.contact_events(run), "opens")[0] / hertz_time() - 1.0)
        errors.append(np.sqrt(np.mean(np.square(wrong))))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(3.5, abs=0.2)
    assert errors[0] < 1e-3


def test_a_bead_between_two_walls() -> None:
    """Each collision takes Hertz's time, and the one wall is left as the other is met."""
    run = hl.CoSimulation(SENT, wall(), behind=wall()).run(6.5 * hertz_time(), save_every=hertz_time() / 40.3)
    events = hl.contact_events(run)
    after_the_first = events.isel(event=slice(1, None))
    assert events.time.values[0] == 0.0, "the wall behind is left at once"
    assert after_the_first.time.values == pytest.approx(hertz_time() * np.repeat(np.arange(1, 7), 2), rel=1e-5)
    for kind, end, first in (("opens", "last bead", 1), ("closes", "first bead", 1), ("opens", "first bead", 2)):
        chosen = after_the_first.isel(event=(after_the_first.kind == kind) & (after_the_first.end == end))
        assert chosen.time.values == pytest.approx(hertz_time() * np.arange(first, 7, 2), rel=1e-5)


@pytest.mark.thorough
def test_six_gaps_of_the_chattering_case() -> None:
    """Each within 0.1 µs of the reference's, though saved every 4 µs only."""
    case = chattering()
    run = hl.CoSimulation(case.chains[0], case.structures[0], window=2.5e-7).run(case.until, save_every=4e-6)
    moments = np.linspace(0.0, case.until, 3201)
    reference = monolithic(case.chains, case.structures, case.contacts, moments, 1e-12)[0]
    gap = reference.surface_displacement.values - reference.displacement.values[:, -1]
    apart = gap > 0.0
    expected = {
        "opens": moments[1:][apart[1:] & ~apart[:-1] & (moments[1:] > 1e-4)],
        "closes": moments[1:][~apart[1:] & apart[:-1] & (moments[1:] > 1e-4)],
    }
    assert len(expected["opens"]) == 6
    events = hl.contact_events(run)
    for kind, at in expected.items():
        assert times(events, kind) == pytest.approx(at, abs=2.5e-7)


@pytest.mark.parametrize("number", [1, 2])
def test_static_indentation_counts(number: int) -> None:
    """Beads that a static force holds leave where the force comes to zero, not where the dynamic one does."""
    held = hl.Chain([BEAD] * 3, BEAD, SPEED, gravity=9.81, preload=float(number))
    run = hl.CoSimulation(held, oscillator(3.0, 1e6)).run(8e-4, save_every=1e-6)
    events = hl.contact_events(run)
    opens = times(events, "opens")
    assert opens.size
    force = run.contact_force.isel(contact=-1)
    assert float(run.gap[0]) < 0.0
    for at, kind in zip(events.time.values, events.kind.values, strict=True):
        near = force.sel(time=slice(at - 2e-6, at + 2e-6)).values
        apart = near[-1 if kind == "opens" else 0]
        assert apart == 0.0
        assert near.max() > 0.0


def test_a_contact_between_saved_times_is_warned_of() -> None:
    """The impulse shows it; the bead is on its way back at the next saved time."""
    case = chattering()
    run = hl.CoSimulation(case.chains[0], case.structures[0]).run(case.until, save_every=1e-6)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert hl.contact_events(run).sizes["event"] == 11
    opened = run.gap.values > 0.0
    rows = np.flatnonzero(opened | (run.time.values < 2.9e-4) | (run.time.values > 3.6e-4))
    with pytest.warns(hl.HertzlinkWarning) as caught:
        seen = hl.contact_events(run.isel(time=rows))
    assert seen.sizes["event"] == 9
    (message,) = [str(one.message) for one in caught]
    assert "interface 0 closes and opens again between saved times, first after t = 302 µs" in message
    assert message.endswith("save the run more often")
