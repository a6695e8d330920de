"""Plots of one run or signal: forces with their waves, the chain over time, and the energies."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from coupling.plots.canvas import COLOURS, INK, axes_for, legend_below, styled
from coupling.results.ar_and_tof import reflections
from coupling.results.measures import energies, energy_error, sensor_force
from coupling.results.reading import ALL_KEPT, Reading
from structures.checks import listed, whole
from structures.units import handy

if TYPE_CHECKING:
    from matplotlib.axes import Axes

WAVE_MARKERS = {"incident": "v", "primary": "o", "secondary": "s"}

MAP_COLUMNS = 1200  # most columns of a map of forces; each shows the greatest force in its time
WEAK = 0.5  # Colours of a map follow this power of the force, so that an echo of 1 % of the greatest force can be seen

ENERGIES = {  # the energies of a run, in words
    "kinetic_energy": "motion of striker and beads",
    "contact_energy": "contacts, gravity and preload of the chain",
    "dissipated_energy": "lost in the chain",
    "structure_energy": "in the structure",
    "structure_dissipated_energy": "lost in the structure's damping",
}


def traces(run: xr.Dataset, sensors: int | Iterable[int] | None = None, ax: "Axes | None" = None) -> "Axes":
    """Draw the force at sensors over time, with its waves marked, and AR and TOF in words.

    Parameters
    ----------
    run : Dataset
        One run, or a measured signal.
    sensors : int or sequence of int, optional
        Beads, 1 to N from the struck end; by default the middle bead of a run, or all sensors of a signal.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Time in µs, force in N, above a preload. A missing wave is named in the legend, with the reason.

    Examples
    --------
    >>> chain = hl.Chain([hl.Sphere(4.76e-3, hl.STEEL_440C)] * 16, None, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.PTFE)).run(until=8e-4)
    >>> axes = hl.plots.traces(run, sensors=8)
    >>> print(axes.get_xlabel(), axes.get_ylabel(), sep="; ")
    time (µs); force (N)
    """
    reading = Reading(run)
    numbers = sensors_of(reading, sensors)
    forces = [sensor_force(run, number) for number in numbers]
    reading.check_one("chain", "sensor_force" if reading.is_signal else "contact_force")
    ax = axes_for(ax)
    for place, (number, force) in enumerate(zip(numbers, forces, strict=True)):
        colour = COLOURS[place % len(COLOURS)]
        ax.plot(1e6 * force.time.values, force.values, color=colour, linewidth=1.1, label=f"force at bead {number}")
        mark_waves(ax, run, number, colour, f"bead {number}, " if len(numbers) > 1 else "")
    ax.axhline(0.0, color=INK, linewidth=0.4)
    ax.margins(x=0.0, y=0.1)
    is_preloaded = "static_force" in run and bool((run.static_force > 0.0).any())
    styled(ax, "time (µs)", "force" + " above the preload" * is_preloaded + " (N)")
    legend_below(ax)
    return ax


def contact_map(run: xr.Dataset, ax: "Axes | None" = None) -> "Axes":
    """Draw the forces of all contacts of a chain over time: each wave is an oblique line.

    Parameters
    ----------
    run : Dataset
        One run of one chain.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Time in µs, contacts from the struck end at the top to the structure at the bottom; a colour bar, N.

    Examples
    --------
    >>> chain = hl.Chain([hl.Sphere(4.76e-3, hl.STEEL_440C)] * 16, None, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.PTFE)).run(until=8e-4)
    >>> hl.plots.contact_map(run).get_ylabel()
    'contact, 1 at the struck end'
    """
    reading = Reading(run)
    reading.dynamic_force()
    reading.check_one("chain", "contact_force")
    if reading.at_sensors and len(reading.kept) <= max(reading.beads):
        raise ValueError(f"run: keeps sensors only, and not the forces of all contacts; run it {ALL_KEPT}")
    force = run.contact_force.transpose("contact", "time").sel(contact=sorted(reading.kept))
    values, time = force.values, reading.time
    every = max(1, -(-time.size // MAP_COLUMNS))
    starts = np.arange(0, time.size, every)
    from matplotlib.colors import PowerNorm
    from matplotlib.ticker import MaxNLocator

    ax = axes_for(ax)
    mesh = ax.pcolormesh(
        1e6 * time[starts], force.contact.values, np.maximum.reduceat(values, starts, axis=1), cmap="magma_r",
        shading="nearest", rasterized=True,
        norm=PowerNorm(WEAK, vmin=0.0, vmax=float(values.max()) or 1.0),
    )  # fmt: skip
    ax.invert_yaxis()
    ax.yaxis.set_major_locator(MaxNLocator(integer=True))
    styled(ax, "time (µs)", "contact, 1 at the struck end")
    ax.grid(visible=False)
    bar = ax.get_figure().colorbar(mesh, ax=ax, label="contact force (N)")  # type: ignore[union-attr]
    bar.outline.set_linewidth(0.4)  # type: ignore[operator]
    return ax


def energy(run: xr.Dataset, ax: "Axes | None" = None) -> "Axes":
    """Draw the parts of a run's energy over time, and their sum.

    Parameters
    ----------
    run : Dataset
        One run with all its chains and structures, whose energies are added.
    ax : Axes, optional
        Where to draw; by default on a new figure.

    Returns
    -------
    Axes
        Time in µs, energies in a handy unit. Work of a piston or a force history is part of the sum. Where the energy
        of a structure is unknown, the work done on it replaces it.

    Examples
    --------
    >>> chain = hl.Chain([hl.Sphere(4.76e-3, hl.STEEL_440C)] * 16, None, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.PTFE)).run(until=8e-4)
    >>> print(hl.plots.energy(run).get_ylabel())
    energy (µJ)
    """
    change, parts, reading = energy_error(run), energies(run), Reading(run)
    reading.check_one("run", "contact_force")
    complete, total = bool(run.structure_energy.notnull().all()), sum(parts.values())
    del parts["driven"]
    factor, unit = handy(np.concatenate([part.values for part in (*parts.values(), total)]), "J")
    ax = axes_for(ax)
    for place, (name, values) in enumerate(parts.items()):
        if bool(abs(values).max() > 0.0):
            words = ENERGIES[name] if complete or name != "structure_energy" else "work done on the structure"
            ax.plot(1e6 * reading.time, factor * values, color=COLOURS[place], linewidth=1.1, label=words)
    label = f"sum, which changes by {float(change):.1g} of the impact energy"
    ax.plot(1e6 * reading.time, factor * total, "--", color=INK, linewidth=1.0, label=label)
    ax.margins(x=0.0)
    styled(ax, "time (µs)", f"energy ({unit})")
    legend_below(ax)
    return ax


def mark_waves(
    ax: "Axes", run: xr.Dataset, sensor: int, colour: str, who: str, which: Iterable[str] = tuple(WAVE_MARKERS)
) -> None:
    """Mark the peak of each wave, with words in the legend. A clipped peak has no mark."""
    try:
        waves = reflections(run, sensor)
    except ValueError as error:
        ax.plot([], [], linestyle="none", label=f"{who}no AR and TOF: {error}")
        return
    for name in which:
        wave = getattr(waves, name)
        place, marker = (([1e6 * wave.arrival], [wave.amplitude]), WAVE_MARKERS[name]) if wave else (([], []), "")
        ax.plot(
            *place, marker=marker, linestyle="none", color=colour, markersize=6.0, markerfacecolor="white",
            markeredgewidth=1.2, label=f"{who}{name} wave: {waves.in_words()[name]}",
        )  # fmt: skip


def sensors_of(reading: Reading, sensors: Any) -> list[int]:
    """Return the numbers of the given sensors, or of the default ones."""
    if sensors is None:
        if reading.is_signal:
            return [int(number) for number in reading.data.sensor.values]
        reading.dynamic_force()
        return [max(1, min(reading.beads) // 2)]
    given = listed("sensors", [sensors] if np.ndim(sensors) == 0 else sensors, object, "one bead number or more")
    return list(dict.fromkeys(whole("sensors", number) for number in given))
