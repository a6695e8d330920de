"""Plots of results, pictures and animations of the motion inside bodies, ParaView files, and reports of one page."""

from coupling.views.bead_motion import bead_motion as bead_motion
from coupling.views.identified import correlation as correlation
from coupling.views.identified import fit as fit
from coupling.views.identified import intervals as intervals
from coupling.views.identified import residual as residual
from coupling.views.motion import structure_motion as structure_motion
from coupling.views.paraview import write_vtu as write_vtu
from coupling.views.pictures import animation as animation
from coupling.views.pictures import picture as picture
from coupling.views.setup import setup as setup
from coupling.views.swept import swept as swept
from coupling.views.traces import contact_map as contact_map
from coupling.views.traces import energy as energy
from coupling.views.traces import spectrum as spectrum
from coupling.views.traces import traces as traces
from hertzlink.reports.of_results import report as report
