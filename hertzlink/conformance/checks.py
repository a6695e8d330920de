"""Checks of what every participant owes to a co-simulation, as plain functions that raise an AssertionError.

A participant is a structure (start, advance(state, mean force, window) → (state, displacement)) or a MovingChain
(advance(state, surface at start and end, window) → (state, mean force)). With several contact points, `surface` is a
tuple (of a chain, the second is `behind`), and forces and displacements are arrays with one number for each.
Only answers are compared, never states, whose form is the participant's own. But for the one that looks for it, checks
hand every window a copy of the state, so that each fault is found by the check that is meant for it.

All take window, s, and size, the scale of the drive: N for a structure, m for what a chain faces.
"""

import pickle
from collections.abc import Callable, Sequence
from copy import deepcopy
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

import hertzlink as hl
from coupling.participant import LEAST_RESISTANCE
from structures.checks import short

Answers = NDArray[np.float64]

WINDOW, FORCE, MOTION = 1e-6, 10.0, 2e-6
"""s, N, m: a thirtieth of a contact of 9.5 mm beads, and what a drop of 10 mm brings."""

SHORT = 1e-7
"""s, of a window whose halves are compared with it."""

HELD = 4e-4
"""s, for which a force is held that shows the compliance."""

MARGIN = 3.0
"""Factor to which the user need know a mass or a stiffness; a wrong unit is off by a thousand."""

WINDOWS = 48

WITHDRAWAL = 0.2
"""Force over motion of what draws energy out of a structure, in units of that which fed it; the greater the sooner, but
from 0.5 on no longer all of it."""


def check_repeatable(participant: Any, window: float = WINDOW, size: float | None = None) -> None:
    """Check that a window from one state, twice, gives one answer, then and later: the old state is left as it was."""
    state = participant.start()
    for drive in _drives(participant, 1, size):
        first, answer = _advance(participant, state, drive, window)
        second, again = _advance(participant, state, drive, window)
        _require(_same(answer, again), f"advance gave {answer!r}, and from the same state {again!r}")
        ahead = [_one(participant, end, drive, window) for end in (first, second)]
        _require(_same(*ahead), f"after a repeated window advance gave {ahead[1]!r} instead of {ahead[0]!r}")
        state = first


def check_independent(participant: Any, window: float = WINDOW, size: float | None = None) -> None:
    """Check that two histories through one instance, window by window in turn, are what each is alone."""
    histories = [_drives(participant, seed, size) for seed in (2, 3)]
    alone = [_run(participant, history, window) for history in histories]
    states: list[Any] = [participant.start(), participant.start()]
    turns: tuple[list[Answers], list[Answers]] = ([], [])
    for drives in zip(*histories, strict=True):
        for n, drive in enumerate(drives):
            states[n], answer = _advance(participant, deepcopy(states[n]), drive, window)
            turns[n].append(np.atleast_1d(answer))
    for first, second in zip(alone, turns, strict=True):
        _require(
            _same(first, second),
            "a history changes where another is advanced in between: advance keeps a state",
        )


def check_deterministic(make: Callable[[], Any], window: float = WINDOW, size: float | None = None) -> None:
    """A new instance gives the same bits. make: what makes one."""
    first, second = (_run(make(), _drives(make(), 4, size), window) for _ in range(2))
    _require(_same(first, second), "two instances give different answers to the same forces")


def check_pickles(participant: Any, window: float = WINDOW, size: float | None = None) -> None:
    """Check that a state which was written and read goes on to the same bits."""
    state = participant.start()
    for drive in _drives(participant, 5, size)[:8]:
        written = pickle.dumps(state)
        state, answer = _advance(participant, deepcopy(state), drive, window)
        again = _one(participant, pickle.loads(written), drive, window)
        _require(_same(answer, again), "a pickled state goes on otherwise")


def check_splits(
    participant: Any, window: float = SHORT, size: float | None = None, order: float = 2.0, rounding: float = 1e-9
) -> None:
    """Check a window against two halves of it under the same force: the difference falls by 2^order with the window.

    Over a smooth pulse of WINDOWS, at their ends; a chain's answer is the mean force over them. Take windows in which
    the fastest motion hardly turns: a mesh shows its order there only. More than three quarters of the order are asked
    for, and none where the difference, in the mean square, is below `rounding` of the answers.
    """
    drives = _pulse(participant, size)
    undivided, halves, quarters = (_split(participant, drives, window, parts) for parts in (1, 2, 4))
    coarse, fine, least = (_mean_square(x) for x in (undivided - halves, halves - quarters, rounding * quarters))
    _require(
        not (fine > least and fine > coarse / 2.0 ** (0.75 * order)),
        f"halves differ from windows by {coarse:.3g}, quarters from halves by {fine:.3g}: not of order {order:g}",
    )


def check_finite(participant: Any, window: float = WINDOW, size: float | None = None) -> None:
    """Every answer is a finite number, one for each contact point."""
    answers = _run(participant, _drives(participant, 7, size), window)
    points = _points(participant)
    _require(answers.shape == (WINDOWS, points), f"{answers.shape[1:]} answers, {points} asked")
    finite = np.isfinite(answers).all(axis=1)
    _require(bool(finite.all()), f"not finite in window {int(np.argmin(finite))}")


def check_starts_at_rest(participant: Any, window: float = WINDOW, rounding: float = 1e-12) -> None:
    """Check that without force the contact points of a structure stay where they are, in m."""
    answers = _run(participant, [_shaped(participant, np.zeros(_points(participant)))] * WINDOWS, window)
    _require(not (abs(answers) > rounding).any(), f"moves to {abs(answers).max():.3g} m without a force")


def check_passive(participant: Any, window: float = WINDOW, size: float | None = None, tolerance: float = 1e-9) -> None:
    """Check that from rest the work Σ F̄ (w₁ − w₀) on a structure never falls below zero, by that part of the greatest
    work.

    Random forces feed it; then forces against its motion, which draw out again what they can. The first window goes
    without force, so that a displacement at rest counts for nothing.
    """
    rest = _shaped(participant, np.zeros(_points(participant)))
    state, place = _advance(participant, participant.start(), rest, window)
    forces = [np.atleast_1d(force) for force in _drives(participant, 8, size)]
    moves: list[Any] = []
    for n in range(8 * WINDOWS):
        if n >= WINDOWS:
            forces.append(-WITHDRAWAL * _scale(forces[:WINDOWS]) / _scale(moves[:WINDOWS]) * moves[-1])
        state, end = _advance(participant, deepcopy(state), _shaped(participant, forces[n]), window)
        moves.append(np.atleast_1d(end) - np.atleast_1d(place))
        place = end
    work = np.cumsum(np.sum(np.array(forces) * moves, axis=1))
    _require(
        not work.min() < -tolerance * abs(work).max(),
        f"gives back more than it was given: {work.min():.3g} J, of {abs(work).max():.3g} J at most",
    )


def push(participant: Any, window: float = WINDOW, size: float | None = None) -> tuple[float, float]:
    """Return the inertia (kg) and the compliance (m/N) of a structure that a constant force pushes at all its points.

    The inertia is that of a mass which would move as far as the first point in the first SHORT s. The compliance is the
    mean displacement of that point over HELD s, over the force.
    """
    force = FORCE if size is None else size
    free, drive = (_shaped(participant, np.full(_points(participant), f)) for f in (0.0, force))
    begin, end = (float(np.atleast_1d(_one(participant, participant.start(), d, SHORT))[0]) for d in (free, drive))
    first = end - begin
    places = _run(participant, [drive] * max(1, round(HELD / window)), window)[:, 0] - begin
    return (force * SHORT**2 / (2.0 * first) if first else np.inf), float(places.mean()) / force


def check_units(
    participant: Any,
    window: float = WINDOW,
    size: float | None = None,
    mass: float | None = None,
    stiffness: float | None = None,
) -> tuple[float, float]:
    """Return a structure in other units (mm, kN, ms), or with another quantity (a velocity, an impulse), moves
    otherwise.

    mass, kg, is that which moves first at the contact point; stiffness, N/m, is the static one there. Each need only be
    right to a factor of MARGIN; from it that of the participant may not differ by more. Without them only what would
    move more easily than a foil is wrong. Returns inertia and compliance, see `push`.
    """
    inertia, compliance = push(participant, window, size)
    resistance = inertia / SHORT
    _require(
        not 0.0 <= resistance < LEAST_RESISTANCE,
        f"moves in the first {SHORT:g} s like {inertia:.3g} kg, more easily than a foil; check the units of force, "
        "time and displacement, and that it returns a displacement",
    )
    units = "check the units: N, m, s"
    if mass is not None:
        _require(
            _near(inertia, mass), f"moves in the first {SHORT:g} s like {inertia:.3g} kg, not {mass:g} kg; {units}"
        )
    if stiffness is not None:
        complaint = f"has a compliance of {compliance:.3g} m/N over {HELD:g} s, not {1.0 / stiffness:.3g} m/N"
        _require(_near(compliance * stiffness, 1.0), f"{complaint}; {units}")
    return inertia, compliance


def check_structure(
    make: Callable[[], Any],
    window: float = WINDOW,
    size: float | None = None,
    mass: float | None = None,
    stiffness: float | None = None,
) -> None:
    """Run all checks for a structure; mass and stiffness as in check_units."""
    for check in (check_repeatable, check_independent, check_pickles, check_finite, check_passive):
        check(make(), window, size)
    check_deterministic(make, window, size)
    check_starts_at_rest(make(), window)
    check_splits(make(), min(window, SHORT), size)
    check_units(make(), window, size, mass, stiffness)


def _near(value: float, expected: float) -> bool:
    """Return whether it is; what is no number is not for the check of units to find."""
    return not (value < expected / MARGIN or value > expected * MARGIN)


def _require(held: bool, otherwise: str) -> None:
    """Raise what an assert would, which `python -O` leaves out."""
    if not held:
        raise AssertionError(otherwise)


def _drives(participant: Any, seed: int, size: float | None) -> list[Any]:
    """Return the random mean forces, each held over a window; for a chain, the ends of a window's motion."""
    random = np.random.default_rng(seed)
    if isinstance(participant, hl.stepping.MovingChain):
        place = (MOTION if size is None else size) * random.normal(size=(WINDOWS + 1, _points(participant)))
        place[0] = 0.0
        return list(pairwise(_shaped(participant, row) for row in place))
    forces = (FORCE if size is None else size) * random.normal(size=(WINDOWS, _points(participant)))
    return [_shaped(participant, force) for force in forces]


def _pulse(participant: Any, size: float | None) -> list[Any]:
    """A smooth push and its end."""
    if isinstance(participant, hl.stepping.MovingChain):
        place = (MOTION if size is None else size) * np.sin(np.pi * np.arange(WINDOWS + 1) / WINDOWS) ** 2
        return list(pairwise(_shaped(participant, row * np.ones(_points(participant))) for row in place))
    rise = (FORCE if size is None else size) * np.sin(np.pi * (np.arange(WINDOWS) + 0.5) / WINDOWS) ** 2
    return [_shaped(participant, force * np.ones(_points(participant))) for force in rise]


def _run(participant: Any, drives: Sequence[Any], window: float) -> Answers:
    """Return the answers, windows × contact points, from the start."""
    return _split(participant, drives, window, 1)


def _split(participant: Any, drives: Sequence[Any], window: float, parts: int) -> Answers:
    """Return the answers at whole windows that were each cut into `parts`."""
    state, answers = participant.start(), []
    for drive in drives:
        answers_of_window = []
        for piece in _pieces(drive, parts):
            state, answer = _advance(participant, deepcopy(state), piece, window / parts)
            answers_of_window.append(np.atleast_1d(np.asarray(answer, float)))
        answers.append(np.mean(answers_of_window, axis=0) if isinstance(drive, tuple) else answers_of_window[-1])
    return np.array(answers)


def _pieces(drive: Any, parts: int) -> list[Any]:
    """Return the same force in each, or the pieces of a straight motion."""
    if not isinstance(drive, tuple):
        return [drive] * parts
    ends = [drive[0] + share * (drive[1] - drive[0]) for share in np.arange(parts + 1) / parts]
    return list(pairwise(ends))


def _scale(values: Any) -> float:
    """Return the root of the mean square, one where all are zero."""
    return _mean_square(np.array(values)) or 1.0


def _mean_square(values: Answers) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _advance(participant: Any, state: Any, drive: Any, window: float) -> Any:
    """Return what it returns, a new state and the answer."""
    returned = participant.advance(state, drive, window)
    what = "mean force in N" if isinstance(participant, hl.stepping.MovingChain) else "displacement in m"
    pair = isinstance(returned, tuple | list) and len(returned) == 2
    _require(pair, f"{type(participant).__name__}.advance returned {short(returned)}: must be (state, {what})")
    return returned


def _one(participant: Any, state: Any, drive: Any, window: float) -> Any:
    return _advance(participant, deepcopy(state), drive, window)[1]


def _points(participant: Any) -> int:
    """Return the contact points of a structure; of a chain its ends that face a surface."""
    if isinstance(participant, hl.stepping.MovingChain):
        return 1 if getattr(participant, "behind", None) is None else 2
    return len(participant.surface) if isinstance(participant.surface, tuple) else 1


def _shaped(participant: Any, values: Answers) -> Any:
    """Return a number where there is one contact point, an array where there are several."""
    several = isinstance(participant.surface, tuple) or _points(participant) > 1
    return values if several else float(values[0])


def _same(first: Any, second: Any) -> bool:
    """Return whether both are equal to the bit; what is not a number is like itself."""
    return np.array_equal(np.asarray(first, float), np.asarray(second, float), equal_nan=True)
