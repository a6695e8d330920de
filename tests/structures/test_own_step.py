"""A user's Step: what it returns is checked once for each window, and each error names the member."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from structures.stepping import ImplicitMidpoint

ROD = hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)], elements=4)
N = ROD.size
State = hl.stepping.StructureState


def own(**members: Any) -> Any:
    """A stepper: the midpoint with other members. `response` and `free` change the right answer."""

    class Own(ImplicitMidpoint):
        def __init__(self, structure: hl.Structure, window: float) -> None:
            super().__init__(structure, window)
            if "response" in members:
                self.response = members["response"](self.response)

    if "free" in members:
        Own.free = lambda self, state: members["free"](ImplicitMidpoint.free(self, state))  # type: ignore[method-assign]
    if "energies" in members:
        Own.energies = lambda self, state, load: members["energies"]  # type: ignore[attr-defined]
    if "methods" in members:
        for name, method in members["methods"].items():
            setattr(Own, name, method)
    return Own


def spoiled(state: Any) -> Any:
    state.velocity[:] = 0.0
    return state


def changing(self: Any, state: Any) -> Any:
    return spoiled(state)


WRONG: list[tuple[Callable[[Any], Any], str]] = [
    (lambda right: None, r" = None: must be a StructureState\(displacement, velocity\)"),
    (lambda right: "x", " = 'x': must be a StructureState"),
    (lambda right: right[0], rf" holds {N}.* numbers \(float64\): must be a StructureState"),
    (lambda right: State(None, None), rf"\.displacement = None: must be {N} real numbers"),  # type: ignore[arg-type]
    (
        lambda right: State(right[0][1:], right[1]),
        rf"\.displacement holds {N - 1}.* numbers \(float64\): must be {N} r",
    ),
    (lambda right: State(right[0], right[1] * 1j), rf"\.velocity holds {N}.* numbers \(complex128\): must be {N} real"),
    (lambda right: State(right[0], np.nan * right[1]), r"\.velocity: must hold finite numbers"),
]
"""Wrong states that a function makes of the right one."""


@pytest.mark.parametrize(
    ("stepper", "message"),
    [
        (lambda structure, window: None, "stepper = <function.*: returned None; must return a Step"),
        (lambda structure, window: "x", "stepper = <function.*: returned 'x'; must return a Step"),
        (lambda structure: None, "stepper = <function.*: must be a function of a structure and a window"),
        *[(own(response=wrong), rf"Own\.response{words}") for wrong, words in WRONG],
        (
            own(response=lambda right: State(-right[0], right[1])),
            r"Own\.response\.displacement: 1 N moves its contact by -",
        ),
        *[(own(free=wrong), rf"Own\.free\(state\){words}") for wrong, words in WRONG],
        (own(methods={"free": None}), r"Own\.free = None: must be a method, Own\.free\(state\)"),
        (own(methods={"free": lambda self: None}), r"Own\.free: must be a method, Own\.free\(state\)"),
        (own(methods={"free": changing}), r"Own\.free\(state\) changes the state that it takes"),
        (own(energies=None), r"Own\.energies\(state, load\) = None: must be 2 real numbers"),
        (own(energies="x"), r"Own\.energies\(state, load\) = 'x': must be 2"),
        (own(energies=(1.0,)), r"Own\.energies\(state, load\) = \(1\.0,\): must be 2"),
        (own(energies=(1.0, np.nan)), r"Own\.energies\(state, load\): must hold finite numbers"),
    ],
)
def test_a_step_that_is_none_is_named(stepper: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.stepping.MovingStructure(ROD, stepper).advance(hl.stepping.MovingStructure(ROD).start(), 1.0, 1e-7)


@pytest.mark.parametrize("stepper", [own(), own(response=lambda right: tuple(part[:, 0] for part in right[:2]))])
def test_a_step_that_is_one_moves_like_the_midpoint(stepper: Any) -> None:
    """K columns, or the numbers of one contact."""
    both = [hl.stepping.MovingStructure(ROD, one) for one in (stepper, "midpoint")]
    places = [one.advance(one.start(), 1.0, 1e-7)[1] for one in both]
    assert places[0] == places[1] > 0.0


def test_an_error_in_a_users_step_says_where() -> None:
    moving = hl.stepping.MovingStructure(ROD, own(free=lambda right: 1 / 0))
    with pytest.raises(ZeroDivisionError) as error:
        moving.advance(moving.start(), 1.0, 1e-7)
    assert error.value.__notes__ == ["raised by Own.free(state)"]
