"""Chain and structure that are advanced window by window, and time steppers of structures."""

from particles.moving import MovingChain as MovingChain
from structures.moving import MovingStructure as MovingStructure
from structures.stepping import CentralDifference as CentralDifference
from structures.stepping import GeneralisedAlpha as GeneralisedAlpha
from structures.stepping import Newmark as Newmark
from structures.stepping import Step as Step
from structures.stepping import StructureState as StructureState
