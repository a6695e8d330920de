"""Thesis section 6.1.4: PTFE below a thin steel cylinder. A thicker PTFE layer delays the secondary wave."""

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies import struck_cylinders as struck
from hertzlink.studies.table import MEASURED, Row, Rows
from hertzlink.studies.upper_layer import TwoLayers, layers_figures
from structures.structure import Vector

row = Rows("lower_layer")
UPPER = 6.35e-3  # m; section 6.1.4 also says 6.25 mm.
LOWERS = tuple(sorted([*np.geomspace(9.52e-3, 152.4e-3, 33), 25.4e-3, 50.8e-3]))
SOLID_LOWERS = (9.52e-3, 12.7e-3, 19.05e-3, 25.4e-3, 50.8e-3, 76.2e-3, 101.6e-3, 152.4e-3)
ECHOLESS_LENGTH = 25.4e-3  # m; for thicker layers the primary wave has left before the echo of the base returns.


class LowerLayers(TwoLayers):
    """Cylinders over the thickness of the lower layer."""

    def stack(self, length: float) -> list[hl.Layer]:
        """Return the cylinder with this thickness of the lower layer, m."""
        return self.layers(UPPER, length)

    def expected(self, lengths: Vector) -> xr.Dataset:
        """Return theory over the thickness of the lower layer, m."""
        return self.theory(np.full(len(lengths), UPPER), lengths)


THESIS = LowerLayers()


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR, TOF and the force at the sensors over the thickness of the lower layer. quick: a few thicknesses."""
    few = sorted({*LOWERS[::6], 25.4e-3, 50.8e-3, LOWERS[-1]}), SOLID_LOWERS[::3]
    return struck.over_lengths(THESIS, quick, jobs, *(few if quick else (LOWERS, SOLID_LOWERS)))


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of section 6.1.4, compared with ours, and the secondary wave's delay, with theory."""
    middle, primary = data.sel(dashpot=struck.DASHPOT), data.sel(wave="primary")
    ratios, flights = middle.amplitude_ratio.sel(wave="primary"), middle.time_of_flight.sel(wave="primary") * 1e6
    thick = ratios.where(data.length >= ECHOLESS_LENGTH * (1.0 - 1e-9))
    lost, doubt = struck.lost(thick), struck.sensitivity(primary.time_of_flight.isel(length=-1), 1e6)
    others = [struck.interval(primary.amplitude_ratio.sel(dashpot=dashpot)) for dashpot in (4.0, 6.0)]
    expected = float(THESIS.theory(np.array([UPPER]), ECHOLESS_LENGTH).time_of_flight[0]) * 1e6
    wide, apart = struck.ratio(data.solid_amplitude_ratio[0]), struck.beyond_rod(data, "amplitude_ratio").values
    return [
        row("AR, primary", struck.interval(ratios), *others),
        row("AR, primary, from 25.4 mm on", struck.interval(thick), lost, holds=lost < 100.0 * MEASURED),
        row("TOF, primary", struck.interval(flights), expected, doubt, struck.undamped(data)),
        row("TOF, primary, varies by", struck.lost(flights)),
        *[_delay(data, length) for length in (9.52e-3, 25.4e-3, 50.8e-3, 152.4e-3)],
        row("AR, secondary", struck.interval(middle.amplitude_ratio.sel(wave="secondary"))),
        row("AR, primary, 9.52 mm, axisymmetric", wide, apart[0], apart[-1]),
    ]


def _delay(data: xr.Dataset, length: float) -> Row:
    """Return the delay of the secondary wave after the primary one; the thesis prints no number."""
    flights = data.time_of_flight.sel(dashpot=struck.DASHPOT).sel(length=length, method="nearest")
    expected = THESIS.theory(np.array([UPPER]), length) * 1e6
    cylinder = data.sel(solid_length=length, method="nearest").solid_time_of_flight
    same = abs(float(cylinder.solid_length) - length) < 1e-6
    wide = f", axisymmetric {struck.flight(cylinder, 'secondary'):.0f}" if same else ""
    said = float(expected.delay_with_lower_mass[0]), struck.flight(flights, "secondary"), wide
    return row("delay", struck.delay(flights), *said, theory=float(expected.delay[0]), length=length * 1e3)


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return TOF (figure 6.13) and AR (6.14) over the thickness of the lower layer, and the force map (6.12)."""
    return layers_figures(data, THESIS, "PTFE")
