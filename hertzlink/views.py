"""Pictures, animations and ParaView files of the motion inside bodies."""

from coupling.views.bead_motion import bead_motion
from coupling.views.motion import structure_motion
from coupling.views.paraview import write_vtu
from coupling.views.pictures import animation, picture

__all__ = ["animation", "bead_motion", "picture", "structure_motion", "write_vtu"]
