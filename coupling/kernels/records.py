"""The state of a run in the compiled loop, and the work space of a window."""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from structures.structure import Vector

Records: TypeAlias = NDArray[Any]
"""An array of records with named fields: few arrays compile faster than many."""

REMEMBERED = 3
"""Windows whose forces predict those of the next one."""


def record_type(*names: str) -> Any:
    """Return the type of a record of numbers with these names."""
    return np.dtype([(name, float) for name in names])


CONTACT = record_type("surface", "slope", "work", "given", "impulse", "pending")
"""Displacement (m) of a surface; slope that Newton's method starts from; since the start the work (J) of the contact's
force on the structure, that given by the chain, and the impulse (N s); the mean force (N) over the last window whose
response is not in the structure's state yet."""

NODE = record_type("surface", "force")
"""Displacement (m) of a surface at the end of a window, and mean force (N) that the chain answered."""

WINDOW = record_type("middle", "length")
"""Of a window, s."""

TOTALS = np.dtype([*((name, np.int64) for name in ("remembered", "tried", "windows")), ("residual", float)])
"""Windows remembered; since the last saved time trials of windows, windows, and the greatest residual (N)."""


class Run(NamedTuple):
    """The state of a run at the end of a window: arrays that the loop changes in place. K contacts, C chains."""

    y: Vector  # positions of all chains, one after the other; and velocities
    v: Vector
    body: Vector  # the states of all structures
    contact: Records  # K records CONTACT
    chain: Records  # C records MOVED: since the start
    node: Records  # REMEMBERED × K records NODE, newest first
    window: Records  # REMEMBERED records WINDOW
    totals: Records  # one record TOTALS


class Trial(NamedTuple):
    """What the last trial of a window gave, and work space."""

    y: Vector
    v: Vector
    free: Vector  # state of the structures at the window's end where no force acts
    contact: Records  # K records TRIED
    chain: Records  # C records MOVED
    work: Vector  # rows of work space of chains
    rows: Vector  # 4 + K rows of K numbers of work space


class Search(NamedTuple):
    """The end of Newton's method."""

    tolerance: float  # of the force, N
    still: float  # m: a way of a surface that gives no slope
    most: int  # trials, after which a window is halved
