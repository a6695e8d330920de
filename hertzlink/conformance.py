"""Checks of a participant of your own. Each raises an AssertionError that says what fails; `check_structure` runs all.

A participant is a structure (start, advance(state, mean force, window) → (state, displacement)) or a MovingChain
(advance(state, surface at start and end, window) → (state, mean force)). Only answers are compared, never states,
whose form is the participant's own.

All checks take the window (s) and the size of the drive: N for a structure, m for the surface that a chain faces.
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
from particles.moving import MovingChain

Answers = NDArray[np.float64]

# s, N, m: a thirtieth of a contact of 9.5 mm beads, and what a drop of 10 mm brings.
WINDOW, FORCE, MOTION, WINDOWS = 1e-6, 10.0, 2e-6, 48
STRONG = 30.0  # Times these forces are those of heavy beads. A structure must bear them, too.
SHORT = 1e-7  # Window whose halves are compared with it, s.
HELD = 4e-4  # Time for which a force is held that shows the compliance, s.
MARGIN = 3.0  # Factor to which the user need know a mass or a stiffness; a wrong unit is off by a thousand.
# Force over motion of what draws energy out of a structure, in units of what fed it. From 0.5 on it no longer draws
# out all of it.
WITHDRAWAL = 0.2


class Trial:
    """A participant with its drives: forces on the contact points, windows × points; of a chain the surface at the
    start and the end of each window, windows × 2 × points."""

    def __init__(self, participant: Any, window: float, size: float | None = None) -> None:
        self.participant, self.window, self.start = participant, window, participant.start
        self.is_chain = isinstance(participant, MovingChain)
        if self.is_chain:
            self.points = 1 if participant.behind is None else 2
        else:
            with as_assertions():
                takes_part("structure", participant)
                self.checked = CheckedParticipant(participant)
            self.points = self.checked.contacts
        self.size = size if size is not None else MOTION if self.is_chain else FORCE

    def advance(self, state: Any, drive: Answers, window: float | None = None) -> tuple[Any, Answers]:
        """Return the new state and the answer, checked as in a run. The state may be changed."""
        window = self.window if window is None else window
        if not self.is_chain:
            with as_assertions():
                return self.checked.move(state, drive, window)
        state, force = self.participant.advance(state, tuple(drive if self.points == 2 else drive[:, 0]), window)
        return state, np.atleast_1d(force)

    def run(self, drives: Iterable[Answers], parts: int = 1) -> Answers:
        """Return the answers, windows × points, from the start. Each window is cut into parts under the same drive."""
        state, answers = self.start(), []
        for drive in drives:
            pieces, of_window = [drive] * parts, []
            if self.is_chain:
                ends = drive[0] + np.linspace(0.0, 1.0, parts + 1)[:, None] * (drive[1] - drive[0])
                pieces = [ends[i : i + 2] for i in range(parts)]
            for piece in pieces:
                state, answer = self.advance(deepcopy(state), piece, self.window / parts)
                of_window.append(answer)
            answers.append(np.mean(of_window, axis=0) if self.is_chain else of_window[-1])
        return np.array(answers)

    def drives(self, values: Answers) -> Answers:
        """Return the drives of windows; values: windows × points, of a chain the places between windows."""
        return self.size * (np.stack([values[:-1], values[1:]], axis=1) if self.is_chain else values)

    def random(self, seed: int) -> Answers:
        """Return random drives; a chain starts where it touches the surface."""
        values = np.random.default_rng(seed).normal(size=(WINDOWS + self.is_chain, self.points))
        values[0] *= not self.is_chain
        return self.drives(values)

    def pulse(self) -> Answers:
        """Return a smooth push and its end."""
        times = np.arange(WINDOWS + 1) if self.is_chain else np.arange(WINDOWS) + 0.5
        return self.drives(np.outer(np.sin(np.pi * times / WINDOWS) ** 2, np.ones(self.points)))


def check_repeatable(participant: Any, window: float = WINDOW, size: float | None = None) -> None:
    """Check that a window from one state, twice, gives one answer, then and later: the old state is left as it was."""
    trial = Trial(participant, window, size)
    state = trial.start()
    for drive in trial.random(1):
        first, answer = trial.advance(state, drive)
        second, again = trial.advance(state, drive)
        require(same(answer, again), f"advance gave {answer!r}, and from the same state {again!r}")
        ahead = [trial.advance(deepcopy(end), drive)[1] for end in (first, second)]
        require(same(*ahead), f"after a repeated window advance gave {ahead[1]!r} instead of {ahead[0]!r}")
        state = first


def check_independent(participant: Any, window: float = WINDOW, size: float | None = None) -> None:
    """Check that two histories through one instance, window by window in turn, are what each is alone."""
    trial = Trial(participant, window, size)
    histories = [trial.random(seed) for seed in (2, 3)]
    alone = [trial.run(history) for history in histories]
    states, turns = [trial.start(), trial.start()], np.empty_like(alone)
    for i, drives in enumerate(zip(*histories, strict=True)):
        for n, drive in enumerate(drives):
            states[n], turns[n][i] = trial.advance(deepcopy(states[n]), drive)
    require(same(alone, turns), "a history changes where another is advanced in between: advance keeps a state")


def check_deterministic(make: Callable[[], Any], window: float = WINDOW, size: float | None = None) -> None:
    """Check that a new instance, which `make` returns, gives the same bits."""
    first, second = (trial.run(trial.random(4)) for trial in (Trial(make(), window, size) for _ in range(2)))
    require(same(first, second), "two instances give different answers to the same forces")


def check_pickles(participant: Any, window: float = WINDOW, size: float | None = None) -> None:
    """Check that a state which was written and read goes on to the same bits."""
    trial = Trial(participant, window, size)
    state = trial.start()
    for drive in trial.random(5)[:8]:
        written = pickle.dumps(state)
        state, answer = trial.advance(deepcopy(state), drive)
        require(same(answer, trial.advance(pickle.loads(written), drive)[1]), "a pickled state goes on otherwise")


def check_splits(
    participant: Any, window: float = SHORT, size: float | None = None, order: float = 2.0, rounding: float = 1e-9
) -> None:
    """Check a window against two halves of it under the same drive: the difference falls by 2^order with the window.

    Take windows in which the fastest motion hardly turns: a mesh shows its order there only. More than three quarters
    of the order are asked for, and none where the difference is below `rounding` of the answers (root mean square).
    """
    trial = Trial(participant, window, size)
    undivided, halves, quarters = (trial.run(trial.pulse(), parts) for parts in (1, 2, 4))
    coarse, fine, least = (mean_square(x) for x in (undivided - halves, halves - quarters, rounding * quarters))
    words = f"halves differ from windows by {coarse:.3g}, quarters from halves by {fine:.3g}: not of order {order:g}"
    require(not (fine > least and fine > coarse / 2.0 ** (0.75 * order)), words)


def check_finite(participant: Any, window: float = WINDOW, size: float | None = None) -> None:
    """Check that every answer is a finite number, also under strong forces."""
    trial = Trial(participant, window, size)
    for factor in (1.0,) if trial.is_chain else (1.0, STRONG):
        finite = np.isfinite(trial.run(factor * trial.random(7))).all(axis=1)
        require(bool(finite.all()), f"not finite in window {int(np.argmin(finite))}")


def check_starts_at_rest(participant: Any, window: float = WINDOW, rounding: float = 1e-12) -> None:
    """Check that without force the contact points of a structure stay where they are, within `rounding` m."""
    trial = Trial(participant, window)
    greatest = abs(trial.run(np.zeros((WINDOWS, trial.points)))).max()
    require(not greatest > rounding, f"moves to {greatest:.3g} m without a force")


def check_passive(participant: Any, window: float = WINDOW, size: float | None = None, tolerance: float = 1e-9) -> None:
    """Check that from rest the work Σ F̄ (w₁ − w₀) on a structure never falls below −tolerance times its maximum.

    Random forces feed it; then forces against its motion draw out what they can. The first window goes without force,
    so that a displacement at rest counts for nothing.
    """
    trial = Trial(participant, window, size)
    state, place = trial.advance(trial.start(), np.zeros(trial.points))
    forces, moves = [*trial.random(8)], list[Answers]()
    for n in range(8 * WINDOWS):
        if n >= WINDOWS:
            share = mean_square(np.array(forces[:WINDOWS])) / (mean_square(np.array(moves[:WINDOWS])) or 1.0)
            forces.append(-WITHDRAWAL * share * moves[-1])
        state, end = trial.advance(deepcopy(state), forces[n])
        moves.append(end - place)
        place = end
    work = np.cumsum(np.sum(np.array(forces) * moves, axis=1))
    words = f"gives back more than it was given: {work.min():.3g} J, of {abs(work).max():.3g} J at most"
    require(not work.min() < -tolerance * abs(work).max(), words)


def check_units(
    participant: Any, window: float = WINDOW, size: float | None = None, mass: float | None = None,
    stiffness: float | None = None,
) -> tuple[float, float]:  # fmt: skip
    """Check that a structure moves as in N, m and s, when a constant force pushes all its points.

    Return its inertia, kg, that of a mass which would move as far as the first point in the first SHORT s, and its
    compliance, m/N, the mean displacement of that point over HELD s, over the force. mass (kg) moves first at the
    contact point; stiffness (N/m) is the static one there. Each need only be right to a factor of MARGIN. Without them,
    only what moves more easily than a foil is wrong.
    """
    trial = Trial(participant, window, size)
    free, pushed = np.zeros(trial.points), np.full(trial.points, trial.size)
    begin, end = (float(trial.advance(trial.start(), force, SHORT)[1][0]) for force in (free, pushed))
    inertia = trial.size * SHORT**2 / (2.0 * (end - begin)) if end != begin else np.inf
    places = trial.run([pushed] * max(1, round(HELD / window)))[:, 0] - begin
    compliance = float(places.mean()) / trial.size

    moves, why = f"moves in the first {SHORT:g} s like {inertia:.3g} kg", "check the units: N, m, s, and a displacement"
    require(not 0.0 <= inertia / SHORT < LEAST_RESISTANCE, f"{moves}, more easily than a foil; {why}")
    right = mass is None or 1.0 / MARGIN <= inertia / mass <= MARGIN
    require(right, f"{moves}, not {mass} kg; {why}")
    right = stiffness is None or 1.0 / MARGIN <= compliance * stiffness <= MARGIN
    require(right, f"yields by {compliance:.3g} m/N over {HELD:g} s, not 1/{stiffness} m/N; {why}")
    return inertia, compliance


def check_structure(
    make: Callable[[], Any], window: float = WINDOW, size: float | None = None, mass: float | None = None,
    stiffness: float | None = None,
) -> None:  # fmt: skip
    """Run all checks for a structure; mass and stiffness as in `check_units`. `make` returns a new participant."""
    for check in (check_repeatable, check_independent, check_pickles, check_finite, check_passive):
        check(make(), window, size)
    check_deterministic(make, window, size)
    check_starts_at_rest(make(), window)
    check_splits(make(), min(window, SHORT), size)
    check_units(make(), window, size, mass, stiffness)


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
