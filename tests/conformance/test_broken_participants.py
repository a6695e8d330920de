"""Each broken participant is caught by the check that is meant for its fault, and by no other."""

import runpy
from collections.abc import Callable
from functools import cache
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from hertzlink import conformance as checks

FLAT = hl.Surface(hl.STEEL_440C)


class Sound:
    """A mass on a damped spring by the implicit midpoint: broken participants differ from it in their fault alone."""

    surface: Any = FLAT
    mass, stiffness, damping = 0.01, 2e7, 40.0

    def start(self) -> Any:
        return 0.0, 0.0

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        u, v = state
        matrix = self.mass + window / 2.0 * self.damping + window**2 / 4.0 * self.stiffness
        middle = (self.mass * v + window / 2.0 * (force - self.stiffness * u)) / matrix
        return (u + window * middle, 2.0 * middle - v), u + window * middle


class ChangesTheOldState(Sound):
    """It changes the given array in place and returns it."""

    def start(self) -> Any:
        return np.zeros(2)

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        state[:], answer = super().advance(state, force, window)
        return state, answer


class KeepsAState(Sound):
    """A solver that keeps a checkpoint of the last window only; its state is just the number of a window."""

    def start(self) -> Any:
        self.checkpoint, self.current = (0, (0.0, 0.0)), (0, (0.0, 0.0))
        return 0

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        if state == self.checkpoint[0]:
            self.current = self.checkpoint
        self.checkpoint = self.current
        end, answer = super().advance(self.current[1], force, window)
        self.current = (state + 1, end)
        return state + 1, answer


class DiffersByInstance(Sound):
    """Each instance draws a constant of its own."""

    drawn = count(1)

    def __init__(self) -> None:
        self.stiffness = 2e7 * (1.0 + 1e-9 * next(self.drawn))


class FeedsEnergy(Sound):
    """A dashpot of the wrong sign, so weak that a motion grows by a tenth in 10 ms."""

    damping = -0.2


class LiesElsewhere(Sound):
    """Displacements measured from a place other than equilibrium."""

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        end, answer = super().advance(state, force, window)
        return end, answer + 1e-6


class FirstOrder(Sound):
    """Backward Euler."""

    damping = 0.0

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        u, v = state
        v = (v + window / self.mass * (force - self.stiffness * u)) / (1.0 + window**2 * self.stiffness / self.mass)
        return (u + window * v, v), u + window * v


class EndsInNoNumber(Sound):
    """It returns NaN after 40 windows."""

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        end, answer = super().advance(state[:2], force, window)
        windows = state[2] + 1 if len(state) == 3 else 1
        return (*end, windows), answer if windows < 40 or force == 0.0 else float("nan")


class HoldsAFunction(Sound):
    """A state that cannot be pickled."""

    def start(self) -> Any:
        return lambda: (0.0, 0.0)

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        end, answer = super().advance(state(), force, window)
        return (lambda: end), answer


class TwoPoints(Sound):
    """Two sound participants side by side."""

    surface = (FLAT, FLAT)

    def start(self) -> Any:
        return np.zeros((2, 2))


@cache
def example() -> dict[str, Any]:
    return runpy.run_path(str(Path(__file__).parents[2] / "examples" / "own_structure.py"))


def of_the_gallery() -> Any:
    return example()["SpringMass"](mass=0.0141, stiffness=1.7e7)


@pytest.mark.parametrize("make", [Sound, TwoPoints, pytest.param(of_the_gallery, marks=pytest.mark.thorough)])
def test_what_is_sound_passes(make: Callable[[], Any]) -> None:
    checks.check_structure(make)


CHECKS: dict[str, Callable[[Callable[[], Any]], None]] = {
    "repeatable": lambda make: checks.check_repeatable(make()),
    "independent": lambda make: checks.check_independent(make()),
    "deterministic": checks.check_deterministic,
    "pickles": lambda make: checks.check_pickles(make()),
    "splits": lambda make: checks.check_splits(make()),
    "finite": lambda make: checks.check_finite(make()),
    "at rest": lambda make: checks.check_starts_at_rest(make()),
    "passive": lambda make: checks.check_passive(make()),
    "units": lambda make: checks.check_units(make(), mass=0.01, stiffness=2e7) and None,
}


class InMillimetres(Sound):
    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        end, answer = super().advance(state, force, window)
        return end, 1e3 * answer


class ReturnsAVelocity(Sound):
    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        end, _ = super().advance(state, force, window)
        return end, end[1]


class TakesAnImpulse(Sound):
    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        return super().advance(state, force / window, window)


WRONG_UNITS = [InMillimetres, ReturnsAVelocity, TakesAnImpulse]


@pytest.mark.parametrize("wrong", WRONG_UNITS)
def test_another_unit_or_quantity_is_caught(wrong: type) -> None:
    """A thousandth of a mass or a stiffness, or less; the user's own may be wrong by a factor of two."""
    for expected in ({"mass": 0.01}, {"mass": 0.02, "stiffness": 4e7}, {"stiffness": 1e7}):
        with pytest.raises(AssertionError, match=r"check the units"):
            checks.check_units(wrong(), **expected)
        checks.check_units(Sound(), **expected)


@pytest.mark.parametrize("wrong", [ReturnsAVelocity, TakesAnImpulse])
def test_what_moves_more_easily_than_a_foil_is_caught(wrong: type) -> None:
    """The user gives neither mass nor stiffness."""
    with pytest.raises(AssertionError, match=r"more easily than a foil; check the units"):
        checks.check_units(wrong())


BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)


def run_of(participant: Any, scheme: Any = None) -> Any:
    chain = hl.Chain([BEAD], BEAD, 0.3)
    return hl.CoSimulation(chain, participant, scheme=scheme or hl.Aitken()).run(until=2e-4)


@pytest.mark.parametrize("wrong", [ReturnsAVelocity, TakesAnImpulse])
def test_a_run_warns_of_what_moves_more_easily_than_a_foil(wrong: type) -> None:
    with pytest.warns(hl.HertzlinkWarning, match=f"units: {wrong.__name__} moves in a first window of .* than a foil"):
        run = run_of(wrong())
    assert "units: " in run.attrs["warnings"]


def test_inertia_and_compliance_are_those_of_the_mass_and_the_spring() -> None:
    inertia, compliance = checks.check_units(Sound())
    assert inertia == pytest.approx(Sound.mass, rel=1e-2)
    assert compliance == pytest.approx(1.0 / Sound.stiffness, rel=0.1)


class FailsUnderStrongForces(Sound):
    """It returns NaN above 200 N, which the forces of light beads never reach."""

    def advance(self, state: Any, force: float, window: float) -> tuple[Any, float]:
        end, answer = super().advance(state, force, window)
        return end, answer if abs(force) < 200.0 else float("nan")


FAULTS = {
    ChangesTheOldState: "repeatable", KeepsAState: "independent", DiffersByInstance: "deterministic",
    HoldsAFunction: "pickles", FirstOrder: "splits", FailsUnderStrongForces: "finite", LiesElsewhere: "at rest",
    FeedsEnergy: "passive",
}  # fmt: skip


@pytest.mark.parametrize("name", CHECKS)
@pytest.mark.parametrize("broken", FAULTS, ids=lambda broken: broken.__name__)
def test_a_fault_is_caught_by_its_own_check_alone(broken: type, name: str) -> None:
    if FAULTS[broken] == name:
        with pytest.raises((AssertionError, AttributeError)):
            CHECKS[name](broken)
    else:
        CHECKS[name](broken)


def test_an_answer_without_a_number_is_caught_in_later_windows() -> None:
    with pytest.raises(AssertionError, match="returned a displacement of nan m"):
        checks.check_finite(EndsInNoNumber())


@pytest.mark.parametrize("returned", [None, (0.0, 0.0, 0.0), (0.0, np.zeros(1))])
@pytest.mark.parametrize("name", CHECKS)
def test_what_is_no_answer_is_told_as_in_a_run(name: str, returned: Any) -> None:
    class Mute(Sound):
        def advance(self, state: Any, force: float, window: float) -> Any:
            return returned

    with pytest.raises(AssertionError, match=r"Mute\.advance returned .*: must be \(state, displacement in m\)"):
        CHECKS[name](Mute)
    with pytest.raises(ValueError, match=r"Mute\.advance returned .*: must be \(state, displacement in m\)"):
        run_of(Mute())


def test_a_participant_without_a_surface_is_told_as_in_a_run() -> None:
    class Bare:
        start, advance = Sound.start, Sound.advance

    message = "structure = Bare: lacks surface; must be a Structure"
    with pytest.raises(AssertionError, match=message):
        checks.check_structure(Bare)
    with pytest.raises(ValueError, match=message):
        run_of(Bare())


def test_an_instance_is_no_maker() -> None:
    with pytest.raises(ValueError, match=r"make = <.*: must be the class, or a function"):
        checks.check_structure(Sound())  # type: ignore[arg-type]
