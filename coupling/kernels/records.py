"""The state of a run in the compiled loop, and the work space of a window."""

from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from structures.structure import Vector

Records: TypeAlias = NDArray[Any]
"""An array of records with named fields: few arrays compile faster than many."""

REMEMBERED = 3
"""Number of windows whose forces predict those of the next one."""


def record_type(*names: str) -> Any:
    """Return the type of a record of numbers with these names."""
    return np.dtype([(name, float) for name in names])


CONTACT = record_type("surface", "slope", "work", "given", "impulse", "pending")
"""Displacement (m) of a surface; first slope of Newton's method; since the start, the work (J) of the contact's force
on the structure, the work (J) that the chain gave, and the impulse (N s); the mean force (N) over the last window, if
the structure's state does not include the response to it yet."""

NODE = record_type("surface", "force")
"""Displacement (m) of a surface at the end of a window, and mean force (N) that the chain answered."""

WINDOW = record_type("middle", "length")
"""Time of a window's middle, and its length, s."""

TOTALS = np.dtype([*((name, np.int64) for name in ("remembered", "tried", "windows")), ("residual", float)])
"""Number of windows remembered; trials, windows and greatest residual (N) since the last saved time."""


class Run(NamedTuple):
    """The state of a run at the end of a window: arrays that the loop changes in place. K contacts, C chains."""

    y: Vector  # positions of all chains, one after the other
    v: Vector  # velocities of all chains
    body: Vector  # the states of all structures
    contact: Records  # K records CONTACT
    chain: Records  # C records MOVED, since the start
    node: Records  # REMEMBERED × K records NODE, newest first
    window: Records  # REMEMBERED records WINDOW
    totals: Records  # one record TOTALS


class Trial(NamedTuple):
    """The result of the last trial of a window, and work space."""

    y: Vector
    v: Vector
    free: Vector  # state of the structures at the window's end if no force acts
    contact: Records  # K records TRIED
    chain: Records  # C records MOVED
    work: Vector  # rows of work space for the chains
    rows: Vector  # 4 + K rows of K numbers of work space


class Search(NamedTuple):
    """The limits of Newton's method."""

    tolerance: float  # of the force, N
    still: float  # a smaller motion of a surface gives no slope, m
    most: int  # number of trials, after which a window is halved
