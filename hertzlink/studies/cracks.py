"""Cracks and delaminations that close: at which amplitude a tap sees them open, and where linear models hold."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import brentq

import hertzlink as hl
from coupling.sweeps.progress import watched
from hertzlink.studies import draw, waves
from hertzlink.studies.results import named, over, with_units
from hertzlink.studies.table import Named, Row, Rows, span
from plates.additions import Addition
from structures.caution import collected

row = Rows("cracks")
BEADS, SENSOR = 20, 12
SPEEDS = (0.05, 0.1, 0.2, 0.4, 0.8)  # m/s.
measure = partial(waves.returned, sensor=SENSOR)
OPENINGS = (3e-8, 1e-7, 3e-7, 1e-6, 3e-6)  # m.
WIDE = 1e-3  # m, an opening that no tap closes.
ERROR = 0.02  # Relative error to which the opening is found that lies half-way.


class Body(NamedTuple):
    """A body with a gap. gaps: points at which it closes. until: s. linear: the body with the gap held closed."""

    name: str
    flaw: str
    bonded: str
    diameter: float
    until: float
    gaps: int
    cut: Callable[[], hl.Structure]
    linear: Callable[[], hl.Structure]


LAYERS = [hl.Layer(hl.ALUMINIUM_6061, length, 6e-3) for length in (0.05, 0.15)]
# m; in units of the thickness. At this depth both parts move alike where they touch, so that `Weakened` is exact.
REGION, DEPTH = (0.04, 0.06, 0.04, 0.06), 0.5


def _plate(flaw: Addition) -> hl.Structure:
    held = hl.Supports("clamped", "clamped", "clamped", "clamped")
    return hl.kirchhoff_plate(0.1, 0.1, 2e-3, hl.ALUMINIUM_6061, held, additions=[flaw]).at(0.05, 0.05)


BODIES = (
    Body("rod", "crack", "bonded", 9.52e-3, 1.2e-3, 1, partial(hl.rod, LAYERS, cracks=(0,)), partial(hl.rod, LAYERS)),
    Body(
        "plate", "delamination", "Weakened", 4.76e-3, 8e-4, 9, partial(_plate, hl.Delamination(REGION, DEPTH)),
        partial(_plate, hl.Weakened(REGION, DEPTH**3 + (1.0 - DEPTH) ** 3)),
    ),
)  # fmt: skip


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF over impact speed and opening, and the opening whose AR is half-way between linear limits.

    quick: two speeds, three openings, and none half-way. jobs: always one process.
    """
    with collected():  # that aluminium yields under steel beads is the study of yield's
        bodies = {body.name: body for body in BODIES}
        speeds, openings = (SPEEDS[::4], OPENINGS[::2]) if quick else (SPEEDS, OPENINGS)
        return over(lambda body: _measured(bodies[body], speeds, openings, quick), body=list(bodies))


def _measured(body: Body, speeds: tuple[float, ...], openings: tuple[float, ...], quick: bool) -> xr.Dataset:
    cut, linear = hl.reduce(body.cut(), body.until), hl.reduce(body.linear(), body.until)
    bead = hl.Sphere(0.5 * body.diameter, hl.STEEL_440C)

    def split(opening: float, impact_speed: float) -> hl.CoSimulation:
        gaps = hl.stepping.Closing(cut, [opening] * body.gaps)
        return hl.CoSimulation(hl.Chain([bead] * BEADS, bead, impact_speed), gaps)

    def at_limit(limit: str, impact_speed: float) -> hl.CoSimulation:
        if limit == "open":
            return split(WIDE, impact_speed)
        return hl.CoSimulation(hl.Chain([bead] * BEADS, bead, impact_speed), linear)

    def half_way(speed: float, middle: float) -> float:
        def beyond(exponent: float) -> float:
            return float(hl.amplitude_ratio(split(10.0**exponent, speed).run(body.until), SENSOR)) - middle

        return float(10.0 ** brentq(beyond, -8.3, -5.0, xtol=np.log10(1.0 + ERROR)))

    limits = hl.sweep(at_limit, body.until, 1, measure, limit=["open", "closed"], impact_speed=speeds)
    data = hl.sweep(split, body.until, 1, measure, opening=[0.0, *openings], impact_speed=speeds)
    middles = list(zip(speeds, limits.amplitude_ratio.mean("limit").values.tolist(), strict=True))
    half = [np.nan] * len(speeds) if quick else [half_way(*of_speed) for of_speed in watched(middles)]
    data["half_way"] = ("impact_speed", half, {"units": "m", "long_name": "opening whose AR lies half-way"})
    return with_units(data.merge(named(limits, "limit")), impact_speed="m/s", opening="m")


def table(data: xr.Dataset) -> list[Row]:
    """Compare gaps with linear models; the thesis names no crack."""
    rows, taps = [], data.impact_speed.values
    ends = taps[0], taps[-1]
    for body in BODIES:
        at, named = data.sel(body=body.name), Named(body=body.name, flaw=body.flaw, linear=body.bonded)
        ratio, (open_, closed) = at.amplitude_ratio, at.limit_amplitude_ratio.values
        late = 1e6 * (at.time_of_flight - at.limit_time_of_flight.sel(limit="closed"))
        rows += [
            row("open", span(open_), *ends, **named),
            row("linear", span(closed), *ends, **named),
            row("closed", f"{abs(ratio.sel(opening=0.0).values - closed).max():.0e}", **named),
        ]
        for opening in data.opening.values[1:]:
            ratios, delay = ratio.sel(opening=opening).values, late.sel(opening=opening).values
            part, latest = 100.0 * (ratios - open_) / (closed - open_), int(abs(delay).argmax())
            said = round(part[0]) + 0, round(part[-1]) + 0, body.bonded, *ends, delay[latest], taps[latest]
            rows.append(row("gap", span(ratios), *said, opening=1e6 * opening, **named))
        half = 1e6 * at.half_way.values
        if np.isfinite(half).all():
            slope = waves.power_exponent(taps, half)
            rows.append(row("half-way", span(half, ".2f"), *ends, 100 * ERROR, slope, **named))
    return rows


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR over the impact speed, one line for each opening, between the lines of the linear limits."""
    figure, axes = draw.panels(2, width=3.7, height=3.6, sharey=False)
    for axis, body in zip(axes, BODIES, strict=True):
        at = data.sel(body=body.name)
        speeds = at.impact_speed.values
        for name, style in (("closed", "--"), ("open", ":")):
            limit = at.limit_amplitude_ratio.sel(limit=name)
            axis.plot(speeds, limit, style, color="0.3", label=f"linear, {name}")
        openings = at.amplitude_ratio.isel(opening=slice(1, None))
        draw.lines(axis, openings, "impact_speed", "opening", lambda opening: f"{1e6 * opening:g} µm")
        axis.set_xscale("log")
        axis.set_xticks(SPEEDS, [f"{speed:g}" for speed in SPEEDS])
        axis.minorticks_off()
        axis.set(xlabel="impact speed (m/s)", ylabel="AR", title=f"{body.name} with a {body.flaw}")
    axes[1].legend(loc="center left", bbox_to_anchor=(1.0, 0.5))
    return {"amplitude": figure}
