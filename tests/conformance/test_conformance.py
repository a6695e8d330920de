"""What every participant owes, asked of hertzlink's own or, with `--participant module:function`, of a user's.

The function makes a new participant each time. Each check can be called from Python too: see participant_checks.py.
"""

from collections.abc import Callable
from typing import Any

import participant_checks as checks
import pytest
from our_participants import CHAINS, PARTICIPANTS

COMMON = [checks.check_repeatable, checks.check_independent, checks.check_pickles, checks.check_finite]
OF_STRUCTURES = [checks.check_splits, checks.check_passive, checks.check_starts_at_rest]


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    named = metafunc.config.getoption("participant", None)
    structures, chains = ({named[0]: named[1]}, {}) if named else (PARTICIPANTS, CHAINS)
    if "make" in metafunc.fixturenames:
        found = {**structures, **(chains if "chains" in metafunc.function.__name__ else {})}
        metafunc.parametrize("make", list(found.values()), ids=list(found))
    elif "chain" in metafunc.fixturenames:
        metafunc.parametrize("chain", list(chains.values()), ids=list(chains))


@pytest.mark.parametrize("check", COMMON, ids=lambda check: check.__name__)
def test_structures_and_chains(make: Callable[[], Any], check: Callable[[Any], None]) -> None:
    check(make())


@pytest.mark.thorough
def test_new_instances_of_structures_and_chains(make: Callable[[], Any]) -> None:
    checks.check_deterministic(make)


@pytest.mark.parametrize("check", OF_STRUCTURES, ids=lambda check: check.__name__)
def test_structures(make: Callable[[], Any], check: Callable[[Any], None]) -> None:
    check(make())


def test_windows_of_a_chain_split(chain: Callable[[], Any]) -> None:
    """Steps shorter than windows differ by as much as fills a window with whole ones. Dashpots set in at once where
    beads meet, which steps see to first order."""
    lossy = chain().chain.dissipation is not None
    checks.check_splits(chain(), checks.WINDOW, rounding=2e-3 if lossy else 1e-5)
