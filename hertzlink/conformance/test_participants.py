"""Tests of what every participant owes, asked of hertzlink's own or, with `--participant module:function`, of a user's.

The function makes a new participant each time. Each check can be called from Python too: see checks.py.
"""

from collections.abc import Callable, Mapping
from typing import Any

import pytest

from hertzlink.conformance import checks

Make = Callable[[], Any]


def _of_made(check: Callable[[Any], None]) -> Callable[[Make], None]:
    return lambda make: check(make())


COMMON: dict[str, Callable[[Make], None]] = {
    "repeatable": _of_made(checks.check_repeatable),
    "independent": _of_made(checks.check_independent),
    "pickles": _of_made(checks.check_pickles),
    "finite": _of_made(checks.check_finite),
    "deterministic": checks.check_deterministic,
}

OF_STRUCTURES = {
    **COMMON,
    "splits": _of_made(checks.check_splits),
    "passive": _of_made(checks.check_passive),
    "at rest": _of_made(checks.check_starts_at_rest),
}


def _splits_as_a_chain(make: Make) -> None:
    """Steps shorter than windows differ by as much as fills a window with whole ones. Dashpots set in at once where
    beads meet, which steps see to first order."""
    lossy = make().chain.dissipation is not None
    checks.check_splits(make(), checks.WINDOW, rounding=2e-3 if lossy else 1e-5)


OF_CHAINS = {**COMMON, "splits": _splits_as_a_chain}


def _participants(config: pytest.Config) -> tuple[Mapping[str, Make], Mapping[str, Make]]:
    """Return the structures and chains, by name."""
    if config.getoption("participant", None):
        from hertzlink_pytest import PARTICIPANT

        name, make = config.stash[PARTICIPANT]
        return {name: make}, {}
    from hertzlink.conformance.built_in import CHAINS, PARTICIPANTS

    return PARTICIPANTS, CHAINS


def _units(config: pytest.Config) -> Callable[[Make], None]:
    """Return the check that knows what the user expects, and whose findings are shown at the end."""
    from hertzlink_pytest import PUSHED

    expected = {what: config.getoption(what) for what in ("mass", "stiffness")}

    def check(make: Make) -> None:
        inertia, compliance = checks.check_units(make(), **expected)
        config.stash[PUSHED] = (
            f"moves in the first {1e9 * checks.SHORT:.0f} ns like {inertia:.3g} kg, and has a compliance of "
            f"{compliance:.3g} m/N over {1e6 * checks.HELD:.0f} µs; a steel bead of 9.5 mm has 0.0035 kg"
        )

    return check


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    structures, chains = _participants(metafunc.config)
    config = metafunc.config
    by_user = config.getoption("participant", None) is not None
    owed_by_structures = OF_STRUCTURES | ({"units": _units(config)} if by_user else {})
    cases = [
        pytest.param(make, check, id=f"{name}-{what}")
        for makers, owed in ((structures, owed_by_structures), (chains, OF_CHAINS))
        for name, make in makers.items()
        for what, check in owed.items()
    ]
    metafunc.parametrize(("make", "check"), cases)


def test_it_keeps_what_it_owes(make: Make, check: Callable[[Make], None]) -> None:
    check(make)
