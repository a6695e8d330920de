"""Plots of results on matplotlib's axes: traces with their waves, maps, sweeps, set-ups, energies, identifications."""

from coupling.views.identified import correlation, fit, intervals, residual
from coupling.views.setup import setup
from coupling.views.swept import swept
from coupling.views.traces import contact_map, energy, spectrum, traces

__all__ = [
    "contact_map", "correlation", "energy", "fit", "intervals", "residual", "setup", "spectrum", "swept", "traces",
]  # fmt: skip
