"""What runs share, and what earlier ones leave behind, changes no bit of a run."""

import re
from collections.abc import Callable
from itertools import cycle, islice
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from particles.moving import known_facts

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
UNTIL = 2.5e-4
ROD = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.05, 9.525e-3)]), until=3e-4)
DAMPED = hl.damping.damped(ROD, hl.damping.Modal(0.1 / 2))


class Soft(hl.laws.ContactLaw):
    """A user's own law, which can change."""

    def __init__(self, stiffness: float) -> None:
        self.stiffness = stiffness

    def force(self, approach: Any) -> Any:
        return self.stiffness * np.maximum(approach, 0.0) ** 1.5


LAW = Soft(5e9)


def chain(count: int = 8, **given: Any) -> hl.Chain:
    return hl.Chain([BEAD] * count, **{"striker": BEAD, "impact_speed": 0.3} | given)


def with_law(value: float) -> hl.CoSimulation:
    """One law, whose number changes between runs."""
    LAW.stiffness = value
    return hl.CoSimulation(chain(law=LAW), ROD)


def anew(value: float) -> hl.CoSimulation:
    """Beads and structure are made anew, so that the ids of deleted objects are used again."""
    bead = hl.Sphere(4.76e-3 * value, hl.STEEL_440C)
    return hl.CoSimulation(hl.Chain([bead] * 8, bead, 0.3), hl.half_space(hl.STEEL_316))


FAMILIES: dict[str, tuple[Callable[[Any], hl.CoSimulation], list[Any]]] = {
    "speeds": (lambda value: hl.CoSimulation(chain(impact_speed=value), ROD), [0.2, 0.35, 0.5]),
    "steps": (lambda value: hl.CoSimulation(chain(), ROD, dt=value), [5e-8, 1e-7]),
    "windows": (lambda value: hl.CoSimulation(chain(), ROD, window=value), [2.5e-7, 5e-7]),
    "gravity": (lambda value: hl.CoSimulation(chain(gravity=value), ROD), [0.0, 9.81]),
    "inclination": (lambda value: hl.CoSimulation(chain(gravity=9.81, inclination=value), ROD), [0.1, 1.5]),
    "preload": (lambda value: hl.CoSimulation(chain(preload=value), ROD), [0.0, 5.0]),
    "striker": (lambda value: hl.CoSimulation(chain(striker=value), ROD), [BEAD, hl.Sphere(3e-3, hl.STEEL_440C)]),
    "faced": (lambda value: hl.CoSimulation(chain(), value), [None, ROD, hl.half_space(hl.PTFE)]),
    "damping": (lambda value: hl.CoSimulation(chain(), value), [DAMPED, ROD]),
    "behind": (lambda value: hl.CoSimulation(chain(striker=None), ROD, behind=value), [None, hl.half_space(hl.PTFE)]),
    "beads made anew": (anew, [1.0, 1.1, 0.9]),
    "losses": (lambda value: hl.CoSimulation(chain(dissipation=value), ROD), [*map(hl.LinearDashpot, (2.0, 9.0))]),
    "yield": (lambda value: hl.CoSimulation(chain(law=value), ROD), [None, hl.laws.Thornton()]),
    "a law that changes": (with_law, [5e9, 2e9]),
}  # fmt: skip


@pytest.fixture(autouse=True)
def _nothing_known() -> None:
    known_facts.cache_clear()


@pytest.mark.parametrize(
    ("name", "threads"),
    [
        pytest.param(one, threads, marks=[pytest.mark.thorough] * (one in ("yield", "losses")))
        for one in FAMILIES
        # Two threads would change the one law at once.
        for threads in ([1] if one == "a law that changes" else [1, 2])
    ],
)
@pytest.mark.usefixtures("cores")
@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
def test_runs_of_a_batch_are_runs_of_their_own(name: str, threads: int) -> None:
    build, values = FAMILIES[name]
    drawn = [*islice(cycle(values), 2 * len(values) + 1)]
    runs = hl.batch(build, UNTIL, save_every=1e-6, sensors=[5], threads=threads, value=drawn)
    assert not any(runs.error.values)
    for i, value in enumerate(drawn):
        known_facts.cache_clear()
        alone = build(value).run(UNTIL, save_every=1e-6, sensors=[5])
        np.testing.assert_array_equal(runs.contact_force[i], alone.contact_force)
        np.testing.assert_array_equal(runs.velocity[i], alone.velocity)
        np.testing.assert_array_equal(runs.static_force[i], alone.static_force)


@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
def test_a_batch_of_another_length_knows_nothing_of_the_first() -> None:
    build = FAMILIES["speeds"][0]
    for until in (1e-4, UNTIL, 1e-4):
        runs = hl.batch(build, until, save_every=1e-6, sensors=[5], threads=1, value=[0.3, 0.4])
        alone = build(0.4).run(until, save_every=1e-6, sensors=[5])
        np.testing.assert_array_equal(runs.contact_force[1], alone.contact_force)


@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
def test_findings_of_a_run_are_its_own() -> None:
    """The energy of a structure without damping must balance after runs of one that has some."""
    build = FAMILIES["damping"][0]
    runs = hl.batch(build, UNTIL, save_every=1e-6, sensors=[5], threads=1, value=[DAMPED, ROD, DAMPED, ROD])
    assert "energy" not in runs.attrs["warnings"]
    faster = hl.batch(FAMILIES["speeds"][0], UNTIL, save_every=1e-6, sensors=[5], threads=1, value=[0.1, 2.0, 0.1])
    assert re.search(r"^yield: .* \(at run 1; reported at 1 of 3 runs\)$", faster.attrs["warnings"], re.MULTILINE)
