"""Fineness of meshes and reductions: finer for short contacts, and finer to estimate the numerical error."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import ceil, log2
from typing import Any, NamedTuple

# Hz, the frequency that meshes resolve by default. Contacts of steel beads of 4 to 20 mm diameter last 12 to 110 µs and
# excite little above it.
HIGHEST_FREQUENCY = 40.0e3

# s. The usual defaults suit contacts of at least this length, such as those of 4 mm steel beads at up to 2.8 m/s.
USUAL_CONTACT = 10e-6

# Cycles of the highest frequency within a shorter contact: as many as for steel beads of 9.5 mm at 0.3 m/s
CYCLES = 1.5


class Fineness(NamedTuple):
    """Factors by which meshes and reductions are finer than usual."""

    cells: int = 1  # of the number of cells in each direction
    tolerance: float = 1.0  # of the tolerance of reductions
    shorter: int = 1  # of the frequency of a default mesh, and of 1/length of the pulse of a reduction


_FINENESS: ContextVar[Fineness] = ContextVar("fineness", default=Fineness())  # noqa: B039


def fineness() -> Fineness:
    """Return by how much meshes and reductions made now must be finer than their arguments say."""
    return _FINENESS.get()


def default_frequency() -> float:
    """Return the frequency that a default mesh resolves, Hz."""
    return HIGHEST_FREQUENCY * fineness().shorter


def times_shorter(contact: float) -> int:
    """Return the factor for contacts of a length, s. It is a power of two, so that meshes stay the same in a fit."""
    return 1 if contact >= USUAL_CONTACT else int(2 ** ceil(log2(CYCLES / (contact * HIGHEST_FREQUENCY))))


@contextmanager
def finer(**factors: Any) -> Iterator[None]:
    """Make meshes and reductions in this context finer by these factors of `Fineness`."""
    before = _FINENESS.set(fineness()._replace(**factors))
    try:
        yield
    finally:
        _FINENESS.reset(before)
