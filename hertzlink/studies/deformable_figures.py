"""Figures of the study of deformable beads, from its Dataset; imports matplotlib, so import it only to draw."""

from collections.abc import Callable

import numpy as np
import xarray as xr

from hertzlink.studies import draw
from structures.structure import Vector

RIGID_AND_SOFT, NAMES = ("point masses", "modes"), ("point masses", "deformable beads")
LABELS = ("peak force at contact 16 (N)", "wave speed (m/s)")
SERIES = (("explicit", "spacing", "explicit elements"), ("law", "law_spacing", "modes, cells of the contact's law"))
THESIS_TIMES = {"7 min": 422.0, "19 h": 69_062.0}  # s, of the thesis's coarsest and finest mesh (section 3.4).


def section(curves: tuple[xr.DataArray, ...]) -> draw.Figure:
    """Return the force at bead 10 (figure 3.3), and the difference between the section and the mean of the contacts."""
    figure, axes = draw.panels(2, width=3.8, height=3.8, sharey=False)
    mean, section, averaged, centre = curves
    time = mean.shape_time.values * 1e6
    axes[0].plot(time, section, "-", color=draw.COLOURS[1], label="central section")
    axes[0].plot(time, mean, "--", color=draw.COLOURS[0], label="mean of the contacts")
    axes[0].plot(time, averaged, "*-k", markevery=8, linewidth=0.8, label="theory of long waves, mean of the contacts")
    draw.theory_line(axes[0], time, centre, "theory of long waves, at the centre", ":")
    axes[1].plot(time, section - mean, "-", color=draw.COLOURS[1])
    middle = float(time[int(mean.values.argmax())])
    for axis, label in zip(axes, ("force at bead 10 (N)", "central section minus mean (N)"), strict=True):
        axis.set(xlabel="time (µs)", ylabel=label, xlim=(middle - 30.0, middle + 30.0))
    draw.legend_above(figure, axes[0], 2)
    return figure


def sensors(data: xr.Dataset) -> draw.Figure:
    """Return the forces at both sensors, with the echo (figure 3.4)."""
    figure, axes = draw.panels(2, width=3.4)
    for axis, model, title in zip(axes, RIGID_AND_SOFT, NAMES, strict=True):
        for sensor, style in zip(data.sensor.values, ("-", "--"), strict=True):
            force = data.sensor_force.sel(beads=model, sensor=sensor)
            axis.plot(data.shape_time * 1e6, force, style, label=f"bead {sensor}")
        axis.set(title=title, xlabel="time (µs)")
    axes[0].set_ylabel("mean of the contacts (N)")
    draw.legend_above(figure, axes[0], 2)
    return figure


def speed_force(data: xr.Dataset, by_force: Callable[[Vector], Vector]) -> draw.Figure:
    """Return the wave speed over peak force, and relative to theory (figure 3.5)."""
    figure, axes = draw.panels(2, width=3.6, sharey=False)
    force = data.speed_peak_force
    fine = np.geomspace(float(force.min()), float(force.max()), 200)
    speeds = (data.speed_wave_speed, by_force(fine), "wave speed (m/s)")
    ratios = (data.speed_wave_speed / data.speed_theory, np.ones(fine.size), "wave speed over theory")
    for axis, (values, theory, label) in zip(axes, (speeds, ratios), strict=True):
        draw.theory_line(axis, fine, theory, "theory of long waves")
        for i, model in enumerate(RIGID_AND_SOFT):
            draw.points(axis, force.sel(beads=model).values, values.sel(beads=model).values, i, NAMES[i])
        axis.set(xlabel="peak contact force (N)", ylabel=label)
        axis.set_xlim(left=0.0)
    axes[0].set_ylim(bottom=0.0)
    draw.legend_above(figure, axes[0], 3)
    return figure


def contacts(data: xr.Dataset, marked: int) -> draw.Figure:
    """Return the forces of all contacts, one of them marked (figure 3.7)."""
    # A quick study has one mesh.
    shown = {str(model): f"{model} cells" for model in data.model.values if str(model).startswith("explicit")}
    shown = {"point masses": "point masses"} | dict(reversed(shown.items()))
    figure, axes = draw.panels(len(shown), width=2.9)
    for axis, (model, title) in zip(axes, shown.items(), strict=True):
        for contact in data.contact.values:
            force = data.contact_force.sel(model=model, contact=contact)
            colour, width = (draw.COLOURS[1], 1.2) if contact == marked else (draw.COLOURS[0], 0.6)
            axis.plot(data.time * 1e6, force, "-", color=colour, linewidth=width)
        axis.set(title=title, xlabel="time (µs)", xlim=(0.0, float(data.time[-1]) * 1e6))
    axes[0].set_ylabel("contact force (N)")
    axes[0].lines[0].set_label("each contact")
    axes[0].lines[marked - 1].set_label(f"contact {marked}, between beads {marked - 1} and {marked}")
    draw.legend_above(figure, axes[0], 2)
    return figure


def meshes(data: xr.Dataset) -> draw.Figure:
    """Return the peak force and wave speed over the size of the cells, and the error of the force over its time (figure
    3.8)."""
    figure, axes = draw.panels(3, width=3.3, height=3.6, sharey=False)
    for axis, what, label in zip(axes[:2], ("peak_force", "wave_speed"), LABELS, strict=True):
        _level(axis, data[what].sel(model="point masses"), "-", "black", "point masses")
        for kind, size, name in SERIES:
            axis.plot(data[size].values * 1e6, data[f"{kind}_{what}"].values, label=name)
        draw.log_x(axis)
        axis.invert_xaxis()
        axis.set(xlabel="cells where beads touch (µm)", ylabel=label)
    settled = float(data.modes_peak_force[-1])
    for kind, _, name in SERIES:
        off = 100.0 * abs(data[f"{kind}_peak_force"].values / settled - 1.0)
        axes[2].plot(data[f"{kind}_seconds"].values, off, label=name)
    for name, seconds in THESIS_TIMES.items():
        draw.marked(axes[2], seconds, f"thesis\n{name}")
    converged = f"peak force off that of {int(data.modes[-1])} modes (%)"
    axes[2].set(xscale="log", yscale="log", xlabel="time of the processor (s)", ylabel=converged)
    axes[2].set_xlim(right=2e6)
    axes[2].yaxis.set_major_formatter("{x:g}")
    draw.legend_above(figure, axes[0], 3)
    return figure


def _level(axis: draw.Axes, value: xr.DataArray, style: str, colour: str, label: str) -> None:
    """Draw a level line."""
    axis.axhline(float(value), color=colour, linestyle=style, linewidth=0.9, label=label)


def modes(data: xr.Dataset) -> draw.Figure:
    """Return the peak force and wave speed over the number of modes."""
    figure, axes = draw.panels(2, width=3.4, sharey=False)
    explicit = f"explicit, {float(data.spacing[-1]) * 1e6:.3g} µm cells"
    for axis, what, label in zip(axes, ("peak_force", "wave_speed"), LABELS, strict=True):
        _level(axis, data[what].sel(model="point masses"), "-", "black", "point masses")
        _level(axis, data[f"explicit_{what}"][-1], "--", "grey", explicit)
        axis.plot(data.modes, data[f"modes_{what}"], "s-", color=draw.COLOURS[1], label="deformable beads")
        axis.set_xticks([1, 2, 4, 6, 8, 12, 16])
        axis.set(xlabel="modes of a bead, with the rigid one", ylabel=label)
    draw.legend_above(figure, axes[0], 3)
    return figure
