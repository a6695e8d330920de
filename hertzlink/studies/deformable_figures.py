"""Figures of the study of deformable beads, from its Dataset; imports matplotlib, so import it only to draw."""

from collections.abc import Callable

import numpy as np
import xarray as xr

from hertzlink.studies import draw
from structures.structure import Vector

RIGID_AND_SOFT, NAMES = ("point masses", "modes"), ("point masses", "deformable beads")
LABELS = ("peak force at contact 16 (N)", "wave speed (m/s)")
SERIES = (("explicit", "spacing", "explicit elements"), ("law", "law_spacing", "modes, cells of the contact's law"))
THESIS_TIMES = {"7 min": 422.0, "19 h": 69_062.0}
"""s, of the thesis's coarsest and finest mesh (section 3.4)."""


def section(curves: tuple[xr.DataArray, ...]) -> draw.Figure:
    """Force at bead 10 (figure 3.3), and the difference between the section and the mean of the contacts."""
    figure, axes = draw.panels(2, width=3.8, height=3.8, sharey=False)
    mean, section, averaged, centre = curves
    time = mean.shape_time.values * 1e6
    axes[0].plot(time, section, color=draw.COLOURS[1], linewidth=1.2, label="central section")
    axes[0].plot(time, mean, "--", color=draw.COLOURS[0], linewidth=1.2, label="mean of the contacts")
    axes[0].plot(time, averaged, color="black", marker="*", markevery=8, markersize=5.0, linewidth=0.8,
                 label="theory of long waves, mean of the contacts")  # fmt: skip
    axes[0].plot(time, centre, ":", color="black", linewidth=1.0, label="theory of long waves, at the centre")
    axes[1].plot(time, section - mean, color=draw.COLOURS[1], linewidth=1.2)
    middle = float(time[int(mean.values.argmax())])
    for axis, label in zip(axes, ("force at bead 10 (N)", "central section minus mean (N)"), strict=True):
        axis.set(xlabel="time (µs)", ylabel=label, xlim=(middle - 30.0, middle + 30.0))
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)
    return figure


def sensors(data: xr.Dataset) -> draw.Figure:
    """Forces at both sensors, with the echo (figure 3.4)."""
    figure, axes = draw.panels(2, width=3.4)
    for axis, model, title in zip(axes, RIGID_AND_SOFT, NAMES, strict=True):
        for i, sensor in enumerate(data.sensor.values):
            force = data.sensor_force.sel(beads=model, sensor=sensor)
            axis.plot(data.shape_time * 1e6, force, ("-", "--")[i], color=draw.COLOURS[i], linewidth=1.2,
                      label=f"bead {sensor}")  # fmt: skip
        axis.set(title=title, xlabel="time (µs)")
    axes[0].set_ylabel("mean of the contacts (N)")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)
    return figure


def speed_force(data: xr.Dataset, by_force: Callable[[Vector], Vector]) -> draw.Figure:
    """Wave speed over peak force, and relative to theory (figure 3.5)."""
    figure, axes = draw.panels(2, width=3.6, sharey=False)
    fine = np.geomspace(float(data.speed_peak_force.min()), float(data.speed_peak_force.max()), 200)
    draw.theory_line(axes[0], fine, by_force(fine), "theory of long waves")
    draw.theory_line(axes[1], fine, np.ones(fine.size), "theory of long waves")
    for i, model in enumerate(RIGID_AND_SOFT):
        curve = data.sel(beads=model)
        label = NAMES[i]
        draw.points(axes[0], curve.speed_peak_force.values, curve.speed_wave_speed.values, i, label)
        ratio = (curve.speed_wave_speed / curve.speed_theory).values
        draw.points(axes[1], curve.speed_peak_force.values, ratio, i, label)
    for axis, label in zip(axes, ("wave speed (m/s)", "wave speed over theory"), strict=True):
        axis.set(xlabel="peak contact force (N)", ylabel=label)
        axis.set_xlim(left=0.0)
    axes[0].set_ylim(bottom=0.0)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure


def contacts(data: xr.Dataset, marked: int) -> draw.Figure:
    """Forces of all contacts, one of them marked (figure 3.7)."""
    # A quick study has one mesh.
    shown = {str(model): f"{model} cells" for model in data.model.values if str(model).startswith("explicit")}
    shown = {"point masses": "point masses"} | dict(reversed(shown.items()))
    figure, axes = draw.panels(len(shown), width=2.9)
    for axis, (model, title) in zip(axes, shown.items(), strict=True):
        for contact in data.contact.values:
            force = data.contact_force.sel(model=model, contact=contact)
            colour, width = (draw.COLOURS[1], 1.2) if contact == marked else (draw.COLOURS[0], 0.6)
            axis.plot(data.time * 1e6, force, color=colour, linewidth=width, label=f"contact {contact}")
        axis.set(title=title, xlabel="time (µs)", xlim=(0.0, float(data.time[-1]) * 1e6))
    axes[0].set_ylabel("contact force (N)")
    lines = [axes[0].lines[0], axes[0].lines[marked - 1]]
    names = ["each contact", f"contact {marked}, between beads {marked - 1} and {marked}"]
    figure.legend(lines, names, loc="outside upper center", ncols=2, frameon=False)
    return figure


def meshes(data: xr.Dataset) -> draw.Figure:
    """Peak force and wave speed over the size of the cells, and the error of the force over its time (figure 3.8)."""
    figure, axes = draw.panels(3, width=3.3, height=3.6, sharey=False)
    for axis, what, label in zip(axes[:2], ("peak_force", "wave_speed"), LABELS, strict=True):
        axis.axhline(float(data[what].sel(model="point masses")), color="black", linewidth=0.9, label="point masses")
        for i, (kind, size, name) in enumerate(SERIES):
            _joined(axis, data[size].values * 1e6, data[f"{kind}_{what}"].values, i, name)
        draw.log_x(axis)
        axis.invert_xaxis()
        axis.set(xlabel="cells where beads touch (µm)", ylabel=label)
    settled = float(data.modes_peak_force[-1])
    for i, (kind, _, name) in enumerate(SERIES):
        off = 100.0 * abs(data[f"{kind}_peak_force"].values / settled - 1.0)
        _joined(axes[2], data[f"{kind}_seconds"].values, off, i, name)
    for name, seconds in THESIS_TIMES.items():
        draw.marked(axes[2], seconds, f"thesis\n{name}")
    converged = f"peak force off that of {int(data.modes[-1])} modes (%)"
    axes[2].set(xscale="log", yscale="log", xlabel="time of the processor (s)", ylabel=converged)
    axes[2].set_xlim(right=2e6)
    axes[2].yaxis.set_major_formatter("{x:g}")
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure


def _joined(axis: draw.Axes, x: Vector, y: Vector, number: int, label: str) -> None:
    """Markers and the line between them."""
    colour = draw.COLOURS[number]
    axis.plot(x, y, draw.MARKERS[number], color=colour, linestyle="-", linewidth=1.0, markersize=4.0, label=label)


def modes(data: xr.Dataset) -> draw.Figure:
    """Peak force and wave speed over the number of modes."""
    figure, axes = draw.panels(2, width=3.4, sharey=False)
    for axis, what, label in zip(axes, ("peak_force", "wave_speed"), LABELS, strict=True):
        axis.axhline(float(data[what].sel(model="point masses")), color="black", linewidth=0.9, label="point masses")
        size = float(data.spacing[-1]) * 1e6
        axis.axhline(float(data[f"explicit_{what}"][-1]), color="grey", linestyle="--", linewidth=0.9,
                     label=f"explicit, {size:.3g} µm cells")  # fmt: skip
        _joined(axis, data.modes.values, data[f"modes_{what}"].values, 1, "deformable beads")
        axis.set_xticks([1, 2, 4, 6, 8, 12, 16])
        axis.set(xlabel="modes of a bead, with the rigid one", ylabel=label)
    figure.legend(*axes[0].get_legend_handles_labels(), loc="outside upper center", ncols=3, frameon=False)
    return figure
