"""Windows: their default length, and those whose length follows their error."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from hard_cases import CASES, REFERENCE, SENSOR, chain, oscillator
from smooth_cases import STRUCTURES, UNTIL, reference

import hertzlink as hl


class Whole(hl.stepping.MovingStructure):
    """Stands for a structure that the compiled engine cannot take."""

    compact = False


def ratio(run: xr.Dataset) -> float:
    return float(hl.amplitude_ratio(run, SENSOR))


@pytest.mark.parametrize("scheme", [hl.Condensed(), hl.Aitken(), hl.Explicit()], ids=repr)
def test_windows_are_as_many_as_the_scheme_needs(scheme: Any) -> None:
    """A given window has one exchange, however long it is."""
    simulation = hl.CoSimulation(chain(), oscillator(1.0, 1e6), scheme)
    contact, plan = simulation.chain.contact_time, simulation.plan(1e-4)
    assert contact / 2.0 < scheme.windows_per_contact * plan.length <= contact
    given = simulation.replace(window=2e-6)
    assert given.plan(1e-4)[:2] == (2e-6, 1)
    assert given.run(1e-4).windows.values.tolist() == [0.0, *[1.0] * 50]


@pytest.mark.thorough
@pytest.mark.parametrize("case", ["rod", "layered rod", "plate", "chattering", "light"])
def test_amplitude_ratios_are_within_three_tolerances(case: str) -> None:
    """Tolerances go from 1e-3 to 1e-6; at the end the chain's own steps decide, by 2e-6."""
    if case in CASES:
        struck, body, until, exact = *(one[0] for one in CASES[case]()[:2]), CASES[case]().until, REFERENCE[case][0]
    else:
        struck, body, until, exact = chain(), STRUCTURES[case], UNTIL, ratio(reference(case))
    for tolerance in (1e-3, 1e-4, 1e-5, 1e-6):
        error = ratio(hl.CoSimulation(struck, body, window=hl.Adaptive(tolerance)).run(until)) - exact
        assert abs(error) < 3.0 * tolerance + 2e-6


@pytest.mark.thorough
def test_adaptive_windows_are_fewer_for_the_same_error() -> None:
    """Compared with windows of one length; errors of these fall with the square of it."""
    body, given = STRUCTURES["layered rod"], {"until": UNTIL, "save_every": 1e-6}
    exact = ratio(hl.CoSimulation(chain(), body, window=6.25e-8).run(**given))
    run = hl.CoSimulation(chain(), body, window=hl.Adaptive(1e-5)).run(UNTIL)
    other = hl.CoSimulation(chain(), body, window=5e-7).run(**given)
    needed = float(other.windows.sum()) * np.sqrt(abs(ratio(other) - exact) / abs(ratio(run) - exact))
    assert run.windows.sum() < 0.65 * needed


@pytest.mark.parametrize(
    ("structure", "settings"),
    [
        (STRUCTURES["rod"], {"scheme": hl.Aitken()}),
        (STRUCTURES["rod"], {"scheme": hl.Explicit()}),
        (Whole(STRUCTURES["rod"]), {}),
    ],
    ids=["Aitken", "explicit", "a structure that is large"],
)
def test_adaptive_windows_are_of_the_compiled_engine_alone(structure: Any, settings: dict[str, Any]) -> None:
    simulation = hl.CoSimulation(chain(), structure, window=hl.Adaptive(), **settings)
    with pytest.raises(ValueError, match=r"window = Adaptive\(.*\): needs the compiled engine, .* give a window in s"):
        simulation.run(1e-5)


@pytest.mark.thorough
def test_adaptive_windows_follow_saved_times() -> None:
    run = hl.CoSimulation(chain(), STRUCTURES["rod"], window=hl.Adaptive()).run(3e-4, save_every=1e-6)
    assert run.time.values == pytest.approx(1e-6 * np.arange(301))


@pytest.mark.thorough
def test_adaptive_windows_keep_the_energy() -> None:
    run = hl.CoSimulation(chain(), STRUCTURES["layered rod"], window=hl.Adaptive(1e-6)).run(UNTIL)
    assert hl.energy_error(run) < 1e-6
    assert abs(run.interface_mismatch).max() < 1e-8 * float(run.impact_energy)


@pytest.mark.parametrize("tolerance", [0.0, -1e-5, float("nan"), "small"])
def test_bad_tolerances(tolerance: Any) -> None:
    with pytest.raises(ValueError, match="tolerance = "):
        hl.Adaptive(tolerance)
