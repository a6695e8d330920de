"""Thesis section 6.1.3: a steel cylinder on one of PTFE. Thicker steel weakens the secondary wave."""

from collections.abc import Callable, Iterator

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Number
from structures.structure import Vector

RADIUS, LOWER = 9.525e-3, 25.4e-3
# m; eight steps double the thickness, and 25.4 mm is one of the values.
UPPERS = tuple(np.geomspace(6.35e-3, 101.6e-3, 33))
SOLID_UPPERS = tuple(6.35e-3 * 2.0 ** (i / 2.0) for i in range(9))
WEAK = 0.1  # AR of a secondary wave that figure 6.11 still shows.


def layers(upper: float, lower: float) -> list[hl.Layer]:
    return [hl.Layer(hl.STEEL_440C, upper, RADIUS), hl.Layer(hl.PTFE, lower, RADIUS)]


def theory(upper: Vector, lower: Vector | float) -> xr.Dataset:
    """Return equations 6.24 with 6.26, 6.29, and 6.34 with and without the lower mass, over `length`."""
    heavy, light = (layer.material.density * layer.area for layer in layers(1.0, 1.0))
    mass, below = heavy * np.asarray(upper), light * np.asarray(lower)
    restitution = hl.theory.layer_restitution(shared.BEAD.mass, mass)
    primary = shared.time_of_flight(shared.wall_stiffness(shared.BEAD, hl.STEEL_440C), restitution)
    spring = hl.PTFE.youngs_modulus * np.pi * RADIUS**2 / np.asarray(lower)
    delay, heavier = (hl.theory.secondary_delay(mass, lower_mass, spring) for lower_mass in (0.0, below))
    values = {
        "amplitude_ratio": restitution**1.2, "time_of_flight": primary,
        "secondary": primary + delay, "secondary_with_mass": primary + heavier,
    }  # fmt: skip
    size = np.broadcast(mass, below).shape
    return xr.Dataset({name: ("length", np.broadcast_to(value, size)) for name, value in values.items()})


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF over the thickness of the upper layer. quick: every fourth thickness."""
    uppers, solids = (UPPERS[::4], SOLID_UPPERS[::4]) if quick else (UPPERS, SOLID_UPPERS)
    return shared.over_lengths(lambda upper: layers(upper, LOWER), uppers, solids, jobs)


def numbers(data: xr.Dataset) -> Iterator[Number]:
    expected, solid = theory(data.length.values, LOWER), data.isel(solid_length=0)
    wide_ratio = float(solid.solid_amplitude_ratio.sel(wave="primary"))
    wide_flight = 1e6 * float(solid.solid_time_of_flight.sel(wave="secondary"))
    for place, upper, readings in ((0, "6.35 mm", {"axisymmetric": wide_ratio}), (-1, "101.6 mm", {})):
        first, second = (data.amplitude_ratio.isel(length=place).sel(wave=wave) for wave in shared.WAVES)
        said = f"equation 6.24: {float(expected.amplitude_ratio[place]):.3f}"
        yield Number(f"AR, primary, {upper}", shared.over_dashpots(first) | readings, said)
        yield Number(f"AR, secondary, {upper}", shared.over_dashpots(second))

    # The thickness beyond which no secondary wave exceeds WEAK, interpolated.
    curve = data.amplitude_ratio.sel(wave="secondary", dashpot=shared.DASHPOT).fillna(0.0).values
    last = int(np.flatnonzero(curve > WEAK)[-1])
    thinnest = np.interp(-WEAK, -curve[last : last + 2], data.length.values[last : last + 2])
    yield Number("thinnest upper layer without SSW", 1e3 * float(thinnest))

    primary, secondary = (data.time_of_flight.sel(wave=wave, dashpot=shared.DASHPOT) * 1e6 for wave in shared.WAVES)
    said = f"equation 6.29: {shared.lost(expected.time_of_flight):.2f} %"
    yield Number("TOF, primary, shorter by", shared.lost(primary), said)
    yield Number("TOF, primary", shared.ends(primary))
    printed, heavier = 1e6 * expected.secondary.values, 1e6 * float(expected.secondary_with_mass[0])
    thin = data.time_of_flight.isel(length=0).sel(wave="secondary")
    cases = shared.over_dashpots(thin, 1e6) | {"equation 6.34": float(printed[0]), "axisymmetric": wide_flight}
    yield Number("TOF, secondary, 6.35 mm", cases, f"a third of the lower mass makes equation 6.34 {heavier:.0f} µs")
    followed = secondary.dropna("length")
    said = f"the last one is at {1e3 * float(followed.length[-1]):.0f} mm, {float(followed[-1]):.0f} µs"
    yield Number("TOF, secondary, 101.6 mm", {"": "none", "equation 6.34": float(printed[-1])}, said)
    yield Number("TOF, secondary, longer by", 100.0 * float(followed[-1] / followed[0] - 1.0), said)


def figures(
    data: xr.Dataset, expected: Callable[[Vector], xr.Dataset] = lambda upper: theory(upper, LOWER),
    material: str = "steel",
) -> dict[str, draw.Figure]:  # fmt: skip
    """Return TOF (figures 6.10, 6.13) and AR (6.11, 6.14) of both waves over the thickness of a layer, with theory."""
    drawn, xlabel = {}, f"thickness of the {material} layer (mm)"
    lengths = np.geomspace(float(data.length.min()), float(data.length.max()), 200)
    theory = expected(lengths)
    lines = {
        "primary": {"theory of impact on the layer": "-"},
        "secondary": {"theory: layer on a spring": "-", "the same, spring with mass": "--"},
    }
    curves = {
        (shared.FLIGHT, "primary"): (shared.FLIGHT,), (shared.RATIO, "primary"): (shared.RATIO,),
        (shared.FLIGHT, "secondary"): ("secondary", "secondary_with_mass"), (shared.RATIO, "secondary"): (),
    }  # fmt: skip
    for name, label, factor in ((shared.FLIGHT, "TOF (µs)", 1e6), (shared.RATIO, "AR", 1.0)):
        drawn[name], axes = draw.panels(2, width=3.9, height=3.4)
        for axis, wave in zip(axes, shared.WAVES, strict=True):
            shared.against_length(axis, data, name, wave, f"{label}, {wave} wave", xlabel)
            for variable, (words, style) in zip(curves[name, wave], lines[wave].items(), strict=False):
                draw.theory_line(axis, lengths * 1e3, factor * theory[variable], words, style)
            if name == shared.RATIO:
                axis.set_ylim(bottom=0.0)
            axis.legend()
    return drawn
