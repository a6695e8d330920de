"""Chain and structure that are advanced window by window."""

from particles.moving import MovingChain as MovingChain
from structures.moving import MovingStructure as MovingStructure
from structures.stepping import StructureState as StructureState
