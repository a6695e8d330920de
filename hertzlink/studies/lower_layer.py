"""Thesis section 6.1.4: PTFE below a thin steel cylinder. A thicker PTFE layer delays the secondary wave."""

from collections.abc import Iterator

import numpy as np
import xarray as xr

from hertzlink.studies import draw, shared, upper_layer
from hertzlink.studies.compare import Number
from hertzlink.studies.shared import DASHPOT, DASHPOTS
from hertzlink.studies.upper_layer import layers, theory
from structures.structure import Vector

UPPER = 6.35e-3  # m; section 6.1.4 also says 6.25 mm.
LOWERS = tuple(sorted([*np.geomspace(9.52e-3, 152.4e-3, 33), 25.4e-3, 50.8e-3]))
SOLID_LOWERS = (9.52e-3, 12.7e-3, 19.05e-3, 25.4e-3, 50.8e-3, 76.2e-3, 101.6e-3, 152.4e-3)
ECHOLESS = 25.4e-3  # m; for thicker layers the primary wave has left before the echo of the base returns.


def expected(lengths: Vector) -> xr.Dataset:
    return theory(np.full(len(lengths), UPPER), lengths)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF over the thickness of the lower layer. quick: a few thicknesses."""
    few = tuple(sorted({*LOWERS[::6], ECHOLESS, 50.8e-3, LOWERS[-1]}))
    lengths, solids = (few, SOLID_LOWERS[::3]) if quick else (LOWERS, SOLID_LOWERS)
    return shared.over_lengths(lambda lower: layers(UPPER, lower), lengths, solids, jobs)


def numbers(data: xr.Dataset) -> Iterator[Number]:
    """Yield the numbers of the primary wave; the thesis prints none of the secondary one."""
    ratios, flights = (data[name].sel(wave="primary") for name in (shared.RATIO, shared.FLIGHT))
    middle, flight = ratios.sel(dashpot=DASHPOT), 1e6 * flights.sel(dashpot=DASHPOT)
    low, high = (shared.ends(ratios.sel(dashpot=dashpot)) for dashpot in (DASHPOTS[0], DASHPOTS[-1]))
    said = f"{low[0]:.3f} to {low[1]:.3f} for γ = 4, {high[0]:.3f} to {high[1]:.3f} for γ = 6 N s/m"
    yield Number("AR, primary", shared.ends(middle), said)
    thick = middle.where(data.length >= ECHOLESS * (1.0 - 1e-9))
    said = "AR {:.4g} to {:.4g}".format(*shared.ends(thick))
    yield Number("AR, primary, from 25.4 mm on", shared.lost(thick), said)
    by_theory = 1e6 * float(expected(np.array([ECHOLESS])).time_of_flight[0])
    yield Number("TOF, primary", shared.ends(flight), f"equation 6.29: {by_theory:.4g}")
    yield Number("TOF, primary, varies by", shared.lost(flight))


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    return upper_layer.figures(data, expected, "PTFE")
