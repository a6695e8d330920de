"""Checks of a user's Step: each error names the member that returns something else than a Step must."""

from typing import Any

import numpy as np

from structures.checks import short, takes
from structures.stepping import Step, StructureState
from structures.structure import Structure


def check_step(step: Any, structure: Structure, made_by: Any) -> Step:
    """Return `step`, or raise a ValueError where it lacks a member, or where one of them returns what it must not."""
    missing = [name for name in ("free", "response") if not hasattr(step, name)]
    if missing:
        lacks = f", which has no {' and no '.join(missing)}" if len(missing) == 1 else ""
        raise ValueError(f"stepper = {short(made_by)}: returned {short(step)}{lacks}; must return a Step")
    name = type(step).__name__
    pushed = _pushed(f"{name}.response", step.response, structure)
    moved = float(structure.contact_vectors[:, 0] @ pushed.displacement)
    if moved < 0.0:
        raise ValueError(f"{name}.response.displacement: 1 N moves its contact by {moved:.3g} m; must be 0 or more")
    trial = StructureState(*(part.copy() for part in pushed))
    end = _answer(f"{name}.free(state)", step.free, trial)
    if not isinstance(end, StructureState):
        raise ValueError(f"{name}.free(state) {_in_words(end)}: must be a StructureState(displacement, velocity)")
    for part in ("displacement", "velocity"):
        _check_numbers(f"{name}.free(state).{part}", getattr(end, part), (structure.size,))
    if not all(map(np.array_equal, trial, pushed)):
        raise ValueError(f"{name}.free(state) changes the state that it takes; must return a new one")
    if getattr(step, "energies", None) is not None:
        load = np.zeros(structure.size)
        energies = _answer(f"{name}.energies(state, load)", step.energies, trial, load)
        _check_numbers(f"{name}.energies(state, load)", energies, (2,))
    return step  # type: ignore[no-any-return]


def _pushed(name: str, response: Any, structure: Structure) -> StructureState:
    """Return state after 1 N on the first contact; raise a ValueError where the response is not n × K numbers twice."""
    if not isinstance(response, tuple) or len(response) not in (2, 3):
        raise ValueError(f"{name} {_in_words(response)}: must be a StructureState(displacement, velocity)")
    shapes = [(structure.size, structure.contacts)] + [(structure.size,)] * (structure.contacts == 1)
    for part, values in zip(("displacement", "velocity"), response, strict=False):
        _check_numbers(f"{name}.{part}", values, *shapes)
    columns = (np.asarray(part).reshape(-1, structure.contacts)[:, 0] for part in response if np.size(part))
    return StructureState(*columns)


def _answer(name: str, method: Any, *arguments: Any) -> Any:
    if not callable(method):
        raise ValueError(f"{name.partition('(')[0]} = {short(method)}: must be a method, {name}")
    takes(name.partition("(")[0], method, len(arguments), f"a method, {name}")
    try:
        return method(*arguments)
    except Exception as error:
        error.add_note(f"raised by {name}")
        raise


def _check_numbers(name: str, values: Any, *shapes: tuple[int, ...]) -> None:
    """Raise a ValueError unless the values are finite real numbers in an array of one of the shapes."""
    try:
        array = np.asarray(values)
    except ValueError:  # lists of different lengths
        array = np.asarray(None)
    if array.dtype.kind not in "iuf" or array.shape not in shapes:
        raise ValueError(f"{name} {_in_words(values)}: must be {' × '.join(map(str, shapes[-1]))} real numbers")
    if not np.isfinite(array).all():
        raise ValueError(f"{name}: must hold finite numbers")


def _in_words(value: Any) -> str:
    """Return the value; of an array its shape and type."""
    if isinstance(value, np.ndarray) and value.ndim:
        return f"holds {' × '.join(map(str, value.shape))} numbers ({value.dtype})"
    return f"= {short(value)}"
