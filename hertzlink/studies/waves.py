"""Waves in chains: speed, peak contact force and width (thesis, chapter 5), over strikers and kinds of particles."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.compare import Case
from hertzlink.studies.shared import long_waves, scalars
from particles.chain import LawOfPair
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from structures.structure import Vector

# Fractions of the peak between which a width is read. The thesis does not say which it used.
LEVELS = (0.01, 0.001)
OF_THEORY = {"equation 5.13, and one bead more at a sensor": hl.theory.UniformChain(1.0, 1.0, 1.0).width + 1.0}
RANGE = (0.1, 2.0)  # Parts of the least and the greatest peak force, between which the theory's power law is fitted.
FITTED = 400  # Points of a law that are fitted.


def passage(run: xr.Dataset, first: int, second: int) -> xr.Dataset:
    """Return the incident wave between two sensors: its speed, its peak contact force above the preload, its width.

    The width, m, is the speed times the duration for which the force at the second sensor exceeds a level, a fraction
    of its peak. A sensor reads the mean of its two contacts, one bead apart: its signal is one bead longer than the
    wave of equation 5.13. NaN if the wave did not pass.
    """
    speed, incident = hl.wave_speed(run, first, second), hl.reflections(run, second).incident
    arrival = incident.arrival if incident else float(run.time[0])
    between = (run.contact_force - run.static_force).sel(contact=slice(first + 1, second), time=slice(None, arrival))
    time, force = run.time.values, hl.sensor_force(run, second).values
    before = max(0, int(np.searchsorted(time, arrival)) - 1)
    peak = before + int(force[before : before + 2].argmax())
    widths = [speed * duration(time, force, peak, level * force[peak]) for level in LEVELS]
    data = scalars(
        wave_speed=(speed, "m/s", "wave speed between the sensors"),
        peak_force=(float(between.max()), "N", "peak contact force between them"),
    )
    data["width"] = ("level", widths, {"units": "m", "long_name": "width of the wave at the second sensor"})
    return data.assign_coords(level=("level", list(LEVELS), {"units": "1", "long_name": "part of the peak"}))


def duration(time: Vector, force: Vector, peak: int, least: float) -> float:
    """Return the time, s, for which the pulse with a peak at this sample exceeds a force; NaN without rise or fall."""
    below_before, below_after = np.flatnonzero(force[:peak] < least), np.flatnonzero(force[peak:] < least)
    if not below_before.size or not below_after.size:
        return float("nan")
    rise, fall = below_before[-1], peak + below_after[0]
    start = np.interp(least, force[rise : rise + 2], time[rise : rise + 2])
    end = np.interp(least, force[fall : fall - 2 : -1], time[fall : fall - 2 : -1])
    return float(end - start)


def widths(width: Vector, size: float) -> dict[str, Case]:
    """Return the widths of a wave at LEVELS, in sizes of the beads, by what they are read from."""
    words = (f"{100 * level:g} % to {100 * level:g} % of the peak" for level in LEVELS)
    return dict(zip(words, (np.asarray(width) / size).tolist(), strict=True))


def speed_at(curve: xr.Dataset, force: float) -> float:
    """Return the wave speed, m/s, at a peak force, N, interpolated as a power law; NaN outside the simulated forces."""
    order = np.argsort(curve.peak_force.values)
    forces, speed = np.log(curve.peak_force.values[order]), np.log(curve.wave_speed.values[order])
    return float(np.exp(np.interp(np.log(force), forces, speed, left=np.nan, right=np.nan)))


def power_exponent(x: Vector, y: Vector) -> float:
    """Return the exponent p of the line y ∝ xᵖ, by least squares of the logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


class PowerFit(NamedTuple):
    """The power law F = k δⁿ: k, N/mⁿ; n."""

    stiffness: float
    exponent: float


def power_fit(law: hl.laws.ContactLaw, lowest: float, highest: float, relative: bool = True) -> PowerFit:
    """Return the power law nearest to a law between two approaches, m.

    relative: least squares of ln F at even steps of ln δ; otherwise of F at even steps of δ.
    """
    # In units of the end of the range, so that numbers are near one for any unit of k.
    parts = np.linspace(lowest / highest, 1.0, FITTED)
    if relative:
        parts = np.exp(np.linspace(np.log(lowest / highest), 0.0, FITTED))
    end = float(law.force(np.array(highest)))
    forces = law.force(parts * highest) / end
    if relative:
        exponent, logarithm = np.polyfit(np.log(parts), np.log(forces), 1)
        return PowerFit(float(np.exp(logarithm) * end / highest**exponent), float(exponent))

    def factor(n: float) -> float:
        return float(parts**n @ forces / (parts**n @ parts**n))

    exponent = minimize_scalar(
        lambda n: float(np.sum((factor(n) * parts**n - forces) ** 2)),
        bounds=(0.5, 10.0), method="bounded", options={"xatol": 1e-10},
    ).x  # fmt: skip
    return PowerFit(float(factor(exponent) * end / highest**exponent), float(exponent))


class Curve(NamedTuple):
    """A chain of two particles in turn, the law of the theory, and the speeds of its strikers, m/s.

    striker: by default a bead as the first; of_pair: the law of the chain, by default Hertz's.
    """

    pair: tuple[hl.Bead, hl.Bead]
    law: hl.laws.ContactLaw
    speeds: Sequence[float]
    striker: hl.Bead | None = None
    of_pair: LawOfPair | hl.laws.ContactLaw | None = None


def striker_speeds(bead: hl.Bead, law: hl.laws.ContactLaw, forces: Vector) -> list[float]:
    """Return the speeds, m/s, of strikers like the beads for peak forces, N, by a power law: equations 6.12, 6.16.

    The equations are for long waves: in a Hertzian chain the force is 0.886 times as large.
    """
    stiffness, n = power_fit(law, *law.approach(forces[[0, -1]]).tolist())
    moved = np.sqrt(2.0 * forces * (forces / stiffness) ** (1.0 / n) / ((n + 1.0) * bead.mass))
    return [*(moved / PARTICLE_TO_STRIKER_SPEED).tolist()]


def swept(build: Callable[..., hl.CoSimulation], until: float, sensors: tuple[int, int], **axes: Any) -> xr.Dataset:
    """Return the waves over some axes, in this process: starting others takes longer than the runs."""
    return hl.sweep(build, until, 1, partial(passage, first=sensors[0], second=sensors[1]), **axes)


def run_curves(
    name: str, curves: Mapping[Any, Curve], beads: int, sensors: tuple[int, int], until: float
) -> xr.Dataset:
    """Return speed, peak force and width between two sensors, over `name` and striker, and the speed by theory.

    until: length of the records, s.
    """

    def build(curve: Any, striker: int) -> hl.CoSimulation:
        of = curves[curve]
        chain = [of.pair[i % 2] for i in range(beads)]
        return hl.CoSimulation(hl.Chain(chain, of.striker or of.pair[0], of.speeds[striker], law=of.of_pair), None)

    strikers = range(len(next(iter(curves.values())).speeds))
    data, speeds = swept(build, until, sensors, curve=list(curves), striker=strikers), []
    for curve, forces in zip(curves.values(), data.peak_force.values, strict=True):
        ends = np.array([RANGE[0] * np.nanmin(forces), RANGE[1] * np.nanmax(forces)])
        fit = power_fit(curve.law, *curve.law.approach(ends).tolist())
        speeds.append(long_waves(curve.pair[0], *fit).wave_speed_from_force(forces))
    data["theory"] = (("curve", "striker"), speeds, {"units": "m/s", "long_name": "wave speed, equation 5.12"})
    return data.rename(curve=name)


def line(curve: xr.Dataset, label: str) -> draw.Line:
    return label, curve.peak_force.values, curve.wave_speed.values, curve.theory.values
