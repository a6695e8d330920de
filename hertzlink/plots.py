"""Plots of results on matplotlib's axes, from traces to identifications, and reports of one HTML page."""

from coupling.views.identified import correlation, fit, intervals, residual
from coupling.views.setup import setup
from coupling.views.swept import swept
from coupling.views.traces import contact_map, energy, spectrum, traces
from hertzlink.reports.of_results import report

__all__ = [
    "contact_map", "correlation", "energy", "fit", "intervals", "report", "residual", "setup", "spectrum", "swept",
    "traces",
]  # fmt: skip
