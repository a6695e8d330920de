"""Plots of results, pictures and animations of the motion inside bodies, ParaView files, and reports of one page."""

from coupling.plots.identified import identified as identified
from coupling.plots.mapped import mapped as mapped
from coupling.plots.motion import motion as motion
from coupling.plots.setup import setup as setup
from coupling.plots.swept import swept as swept
from coupling.plots.traces import contact_map as contact_map
from coupling.plots.traces import energy as energy
from coupling.plots.traces import traces as traces
from coupling.plots.view import picture as picture
from coupling.plots.view import write_vtu as write_vtu
from hertzlink.reports import report as report
