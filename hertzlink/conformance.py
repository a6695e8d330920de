"""Checks of a participant of your own. Each raises an AssertionError that says what fails; `check_structure` runs all.

A participant is a structure with start and advance(state, mean force, window) → (state, displacement). Only the
displacements are compared, never the states, whose form is the participant's own. All checks take the window, s.
"""

import pickle
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from copy import deepcopy
from typing import Any

import numpy as np
from numpy.typing import NDArray

from coupling.interface import takes_part
from coupling.participant import LEAST_RESISTANCE, CheckedParticipant
from structures.checks import short

Answers = NDArray[np.float64]  # Or forces: windows × contact points.

# s, N: a thirtieth of a contact of 9.5 mm beads, and the force that a drop of 10 mm causes.
WINDOW, FORCE, WINDOWS = 1e-6, 10.0, 48
STRONG = 30.0  # Factor to the forces of heavy beads, which a structure must bear, too.
SHORT = 1e-7  # Window that is compared with its two halves, s.
HELD = 4e-4  # Time for which a force is held to show the compliance, s.
MARGIN = 3.0  # Factor within which a given mass or stiffness must be right; a wrong unit is a factor of 1000.
# Ratio of force to motion while forces draw energy out of a structure, in units of that ratio while they feed it. From
# 0.5 on they no longer draw out all of the energy.
WITHDRAWAL = 0.2


class Driven(CheckedParticipant):
    """A structure whose answers are checked as in a run; the errors are those of these checks."""

    def __init__(self, participant: Any) -> None:
        with as_assertions():
            takes_part("structure", participant)
            super().__init__(participant)

    def move(self, state: Any, forces: Answers, window: float) -> tuple[Any, Answers]:
        with as_assertions():
            return super().move(state, forces, window)

    def random(self, seed: int) -> Answers:
        """Return random forces."""
        return FORCE * np.random.default_rng(seed).normal(size=(WINDOWS, self.contacts))

    def run(
        self, forces: Iterable[Answers], window: float, parts: int = 1, copy: Callable[[Any], Any] = deepcopy
    ) -> Answers:
        """Return the answers from the start. Each window is cut into parts, which begin with a copy of the state."""
        state, answers = self.start(), []
        for force in forces:
            for _ in range(parts):
                state, answer = self.move(copy(state), force, window / parts)
            answers.append(answer)
        return np.array(answers)


def check_repeatable(participant: Any, window: float = WINDOW) -> None:
    """Check that a window repeated from one state gives the same answers, then and later: no old state was changed."""
    one = Driven(participant)
    state = one.start()
    for force in one.random(1):
        first, answer = one.move(state, force, window)
        second, again = one.move(state, force, window)
        require(same(answer, again), f"advance gave {answer!r}, and from the same state {again!r}")
        ahead = [one.move(deepcopy(end), force, window)[1] for end in (first, second)]
        require(same(*ahead), f"after a repeated window advance gave {ahead[1]!r} instead of {ahead[0]!r}")
        state = first


def check_independent(participant: Any, window: float = WINDOW) -> None:
    """Check that two histories that one instance advances in turn give the same answers as each history alone."""
    one = Driven(participant)
    histories = [one.random(seed) for seed in (2, 3)]
    alone = [one.run(history, window) for history in histories]
    states, turns = [one.start(), one.start()], np.empty_like(alone)
    for i, forces in enumerate(zip(*histories, strict=True)):
        for n, force in enumerate(forces):
            states[n], turns[n][i] = one.move(deepcopy(states[n]), force, window)
    require(same(alone, turns), "a history changes if another is advanced in between: advance must not keep a state")


def check_deterministic(make: Callable[[], Any], window: float = WINDOW) -> None:
    """Check that a new instance, which `make` returns, gives identical answers."""
    first, second = (one.run(one.random(4), window) for one in (Driven(make()), Driven(make())))
    require(same(first, second), "two instances give different answers to the same forces")


def check_pickles(participant: Any, window: float = WINDOW) -> None:
    """Check that a state that was written and read leads to identical answers."""
    one = Driven(participant)
    forces = one.random(5)[:8]
    written = one.run(forces, window, copy=lambda state: pickle.loads(pickle.dumps(state)))
    require(same(one.run(forces, window), written), "a state that was pickled leads to other answers")


def check_splits(participant: Any, window: float = SHORT, rounding: float = 1e-9) -> None:
    """Compare a window with its two halves under the same drive, a smooth push: the difference must be of order 2.

    Take windows in which the fastest motion hardly turns: only there does a mesh show its order. An order above 1.5 is
    enough; differences below `rounding` of the answers (root mean square) are not checked.
    """
    one = Driven(participant)
    push = FORCE * np.sin(np.pi * (np.arange(WINDOWS) + 0.5) / WINDOWS) ** 2
    forces = np.outer(push, np.ones(one.contacts))
    undivided, halves, quarters = (one.run(forces, window, parts) for parts in (1, 2, 4))
    coarse, fine, least = (mean_square(x) for x in (undivided - halves, halves - quarters, rounding * quarters))
    words = f"halves differ from windows by {coarse:.3g}, quarters from halves by {fine:.3g}: not of order 2"
    require(not (fine > least and fine > coarse / 2.0**1.5), words)


def check_finite(participant: Any, window: float = WINDOW) -> None:
    """Check that every answer is a finite number, also under strong forces."""
    one = Driven(participant)
    for factor in (1.0, STRONG):
        finite = np.isfinite(one.run(factor * one.random(7), window)).all(axis=1)
        require(bool(finite.all()), f"not finite in window {int(np.argmin(finite))}")


def check_starts_at_rest(participant: Any, window: float = WINDOW) -> None:
    """Check that without force the contact points of a structure stay where they are, within 1e-12 m."""
    one = Driven(participant)
    greatest = abs(one.run(np.zeros((WINDOWS, one.contacts)), window)).max()
    require(not greatest > 1e-12, f"moves to {greatest:.3g} m without a force")


def check_passive(participant: Any, window: float = WINDOW) -> None:
    """Check that from rest the work Σ F̄ (w₁ − w₀) on a structure never falls below −1e-9 times its maximum.

    Random forces feed it; then forces against its motion draw energy out. The first window is without force, so that a
    displacement at rest does not count.
    """
    one = Driven(participant)
    state, place = one.move(one.start(), np.zeros(one.contacts), window)
    forces, moves = [*one.random(8)], list[Answers]()
    for n in range(8 * WINDOWS):
        if n >= WINDOWS:
            share = mean_square(np.array(forces[:WINDOWS])) / (mean_square(np.array(moves[:WINDOWS])) or 1.0)
            forces.append(-WITHDRAWAL * share * moves[-1])
        state, end = one.move(deepcopy(state), forces[n], window)
        moves.append(end - place)
        place = end
    work = np.cumsum(np.sum(np.array(forces) * moves, axis=1))
    words = f"returns more energy than it received: {work.min():.3g} J, of {abs(work).max():.3g} J at most"
    require(not work.min() < -1e-9 * abs(work).max(), words)


def check_units(
    participant: Any, window: float = WINDOW, mass: float | None = None, stiffness: float | None = None
) -> tuple[float, float]:
    """Check the units N, m and s of a structure whose points are all pushed by a constant force.

    Return its inertia, kg, and its compliance, m/N. The inertia is that of a mass that moves as far as the first point
    in the first SHORT s. The compliance is the mean displacement of that point over HELD s, over the force. mass: that
    of the contact point in its first motion, kg. stiffness: the static one there, N/m. They need only be right within a
    factor of MARGIN. Without them, the check fails only for a structure that moves more easily than a foil.
    """
    one = Driven(participant)
    free, pushed = np.zeros(one.contacts), np.full(one.contacts, FORCE)
    begin, end = (float(one.move(one.start(), force, SHORT)[1][0]) for force in (free, pushed))
    inertia = FORCE * SHORT**2 / (2.0 * (end - begin)) if end != begin else np.inf
    compliance = float(np.mean(one.run([pushed] * max(1, round(HELD / window)), window)[:, 0] - begin)) / FORCE

    moves, why = f"moves in the first {SHORT:g} s like {inertia:.3g} kg", "check the units: N, m, s, and a displacement"
    require(not 0.0 <= inertia / SHORT < LEAST_RESISTANCE, f"{moves}, more easily than a foil; {why}")
    if mass is not None:
        require(1.0 / MARGIN <= inertia / mass <= MARGIN, f"{moves}, not {mass} kg; {why}")
    if stiffness is not None:
        right = 1.0 / MARGIN <= compliance * stiffness <= MARGIN
        require(right, f"yields by {compliance:.3g} m/N over {HELD:g} s, not 1/{stiffness} m/N; {why}")
    return inertia, compliance


def check_structure(
    make: Callable[[], Any], window: float = WINDOW, mass: float | None = None, stiffness: float | None = None
) -> None:
    """Run all checks for a structure; mass and stiffness as in `check_units`. `make` returns a new participant."""
    if not callable(make):
        raise ValueError(f"make = {short(make)}: must be the class, or a function that returns a new participant")
    checks = check_repeatable, check_independent, check_pickles, check_finite, check_starts_at_rest, check_passive
    for check in checks:
        check(make(), window)
    check_deterministic(make, window)
    check_splits(make(), min(window, SHORT))
    check_units(make(), window, mass, stiffness)


@contextmanager
def as_assertions() -> Iterator[None]:
    """Make the errors of a run those of these checks."""
    try:
        yield
    except (ValueError, FloatingPointError) as error:
        raise AssertionError(str(error)) from error


def require(held: bool, otherwise: str) -> None:
    """Raise what an assert would, which `python -O` leaves out."""
    if not held:
        raise AssertionError(otherwise)


def mean_square(values: Answers) -> float:
    return float(np.sqrt(np.mean(values**2)))


def same(first: Any, second: Any) -> bool:
    return np.array_equal(first, second, equal_nan=True)
