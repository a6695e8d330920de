"""Time steppers of structures, for `MovingStructure`."""

from structures.stepping import CentralDifference, GeneralisedAlpha, Newmark, Step, StructureState

__all__ = ["CentralDifference", "GeneralisedAlpha", "Newmark", "Step", "StructureState"]
