"""Thesis section 6.1.2: clamped steel cylinders of 6 to 610 mm return the same wave, except for a few percent."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Number

STEEL, RADIUS = hl.STEEL_440C, 9.53e-3
LENGTHS = (*np.geomspace(6.35e-3, 101.6e-3, 25), *np.geomspace(101.6e-3, 609.6e-3, 17)[1:])
SOLID_LENGTHS = (6.35e-3, 12.7e-3, 25.4e-3, 50.8e-3, 76.2e-3, 101.6e-3, 152.4e-3, 304.8e-3, 609.6e-3)


def layers(length: float) -> list[hl.Layer]:
    return [hl.Layer(STEEL, length, RADIUS)]


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF over the length of a cylinder, and the force at bead 7 over time against the shortest one.

    quick: every fourth length.
    """
    every = 4 if quick else 1
    data = shared.over_lengths(layers, LENGTHS[::every], SOLID_LENGTHS[::every], jobs)
    shortest = hl.CoSimulation(shared.chain(), shared.rod(layers(LENGTHS[0]))).run(shared.RECORD)
    return data.assign(sensor_force=hl.sensor_force(shortest, shared.SENSOR).reset_coords(drop=True))


def characteristic_length(bead: hl.Sphere = shared.BEAD) -> float:
    """Return c T_c/2, mm, with T_c of one bead at the striker's speed (equation 6.8)."""
    return 1e3 * STEEL.bar_speed * shared.contact_time(bead, STEEL, shared.SPEED) / 2.0


def numbers(data: xr.Dataset) -> Iterator[Number]:
    ratios, flights = (data[name].sel(wave="primary") for name in (shared.RATIO, shared.FLIGHT))
    middle, flight = ratios.sel(dashpot=shared.DASHPOT), 1e6 * flights.sel(dashpot=shared.DASHPOT)
    yield Number("AR, all lengths", {"": shared.ends(middle), shared.OPEN: shared.ends(ratios)})
    yield Number("AR, short cylinder", shared.over_dashpots(ratios.isel(length=0)))
    yield Number("AR, long cylinder", shared.over_dashpots(ratios.isel(length=-1)))
    low, high = sorted(shared.lost(ratios.sel(dashpot=shared.DASHPOTS[end])) for end in (0, -1))
    yield Number("AR lost over the lengths", {"": shared.lost(middle), shared.OPEN: (low, high)})
    yield Number("TOF, all lengths", shared.ends(flight))
    heavier = hl.Sphere(shared.BEAD.radius, replace(STEEL, density=8000.0))
    lengths = {"7800 kg/m³ of Table 2.1": characteristic_length(), "8000 kg/m³": characteristic_length(heavier)}
    yield Number("characteristic length c T_c/2", lengths)

    # The pulse at the sensor: its peak, and its foot at 5 % of the peak.
    time, values = data.time.values * 1e6, data.sensor_force.values
    arrival = time[int(values[time < 300.0].argmax())] + float(flight[0])
    top = int(np.searchsorted(time, arrival))
    foot = time[np.flatnonzero(values[:top] < 0.05 * values[top])[-1]]
    yield Number("arrival of the primary wave, from impact", {"": arrival, "the foot of the pulse": float(foot)})

    secondary = float(data.amplitude_ratio.sel(wave="secondary", dashpot=shared.DASHPOT).fillna(0.0).max())
    yield Number("secondary wave", secondary)
    solids = data.solid_amplitude_ratio.sel(wave="primary").values
    lost = 100.0 * float(1.0 - solids[-1] / solids[0])
    yield Number("AR, axisymmetric", lost, f"AR {solids[0]:.3f} to {solids[-1]:.3f}")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR and TOF over the length (figure 6.8)."""
    label = "length of the steel cylinder (mm)"
    figure, axes = draw.panels(2, width=3.9, height=3.4)
    shared.against_length(axes[0], data, shared.FLIGHT, "primary", "TOF (µs)", label)
    shared.against_length(axes[1], data, shared.RATIO, "primary", "AR", label)
    theory = 1e6 * float(shared.time_of_flight(shared.wall_stiffness(shared.BEAD, STEEL)))
    draw.theory_line(axes[0], 1e3 * data.length[[0, -1]], [theory, theory], "theory of contact times")
    for axis in axes:
        axis.axvline(characteristic_length(), color="grey", linestyle=":", linewidth=0.9, label="$c\\,T_c/2$")
        axis.legend(frameon=True, framealpha=1.0, edgecolor="none", loc="lower left")
    axes[0].set_ylim(430.0, 490.0)
    axes[1].set_ylim(0.6, 0.85)
    return {"length": figure}
