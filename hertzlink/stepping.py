"""Chain and structure that are advanced window by window, and time steppers of structures."""

from particles.moving import MovingChain
from structures.closing import Closing, ClosingState
from structures.moving import MovingStructure
from structures.stepping import CentralDifference, GeneralisedAlpha, Newmark, Step, StructureState

__all__ = [
    "CentralDifference",
    "Closing",
    "ClosingState",
    "GeneralisedAlpha",
    "MovingChain",
    "MovingStructure",
    "Newmark",
    "Step",
    "StructureState",
]
