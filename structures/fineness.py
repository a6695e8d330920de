"""How much finer than asked for discretisations are, within a context in which their error is estimated."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import NamedTuple


class Fineness(NamedTuple):
    """The factor of the number of cells in each direction, and that of the tolerance of reductions."""

    cells: int = 1
    tolerance: float = 1.0


AS_ASKED = Fineness()

_FINENESS: ContextVar[Fineness] = ContextVar("fineness", default=AS_ASKED)


def fineness() -> Fineness:
    """Return by how much meshes and reductions that are made now must be finer than their arguments say."""
    return _FINENESS.get()


@contextmanager
def finer(cells: int = 1, tolerance: float = 1.0) -> Iterator[None]:
    """Make meshes and reductions within it finer by these factors."""
    before = _FINENESS.set(Fineness(cells, tolerance))
    try:
        yield
    finally:
        _FINENESS.reset(before)
