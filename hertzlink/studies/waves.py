"""Waves in chains: speed, peak contact force and width (thesis, chapter 5), over strikers and kinds of particles."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.optimize import minimize_scalar
from scipy.signal import peak_widths

import hertzlink as hl
from hertzlink.studies import draw
from particles.chain import LawOfPair
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from structures.structure import Vector

# Fractions of the peak between which a width is read. The thesis does not say which it used.
LEVELS = (0.01, 0.001)
# Forces, as parts of the least and the greatest peak, over which a power law is fitted to the contact law.
RANGE = (0.1, 2.0)
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
    force = hl.sensor_force(run, second).values
    before = max(0, int(np.searchsorted(run.time.values, arrival)) - 1)
    peak = before + int(force[before : before + 2].argmax())
    widths = [speed * duration(run.time.values, force, peak, level * force[peak]) for level in LEVELS]
    return xr.Dataset(
        {
            "wave_speed": ((), speed, {"units": "m/s", "long_name": "wave speed between the sensors"}),
            "peak_force": ((), float(between.max()), {"units": "N", "long_name": "peak contact force between them"}),
            "width": ("level", widths, {"units": "m", "long_name": "width of the wave at the second sensor"}),
        },
        coords={"level": ("level", list(LEVELS), {"units": "1", "long_name": "part of the peak"})},
    )


def returned(run: xr.Dataset, sensor: int) -> xr.Dataset:
    """Return AR and TOF of the primary wave."""
    measures = {"amplitude_ratio": hl.amplitude_ratio(run, sensor), "time_of_flight": hl.time_of_flight(run, sensor)}
    return xr.Dataset(measures)


def sensor_forces(run: xr.Dataset, sensors: Sequence[int]) -> xr.DataArray:
    """Return the force over time, N, at several sensors."""
    force = xr.concat([hl.sensor_force(run, sensor) for sensor in sensors], "sensor")
    label = {"units": "N", "long_name": "force at the sensor, above the preload"}
    return force.assign_coords(sensor=list(sensors)).assign_attrs(label)


def duration(time: Vector, force: Vector, peak: int, least: float) -> float:
    """Return the time, s, for which the pulse with a peak at this sample exceeds a force; NaN without rise or fall."""
    if not (force[:peak] < least).any() or not (force[peak:] < least).any():
        return float("nan")
    # A peak's prominence is how far below its top peak_widths goes; then the samples between which it may go.
    prominence_data = np.array([force[peak] - least]), np.array([0]), np.array([force.size - 1])
    ends = np.concatenate(peak_widths(force, [peak], 1.0, prominence_data)[2:])
    return float(np.diff(np.interp(ends, np.arange(time.size), time))[0])


def of_mass(bead: Any, mass: float) -> Any:
    """Return the bead of a material that gives it this mass, kg."""
    material = replace(bead.material, density=bead.material.density * mass / bead.mass, name="")
    return replace(bead, material=material)


def long_waves(bead: hl.Bead, stiffness: float | None = None, exponent: float = 1.5) -> hl.theory.UniformChain:
    """Return the theory of long waves in a chain of these beads, by Hertz's law unless its k, N/mⁿ, and n are given."""
    if stiffness is None:
        stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    return hl.theory.UniformChain(bead.size, bead.mass, stiffness, exponent)


def wall_stiffness(bead: hl.Bead, wall: hl.Material) -> float:
    """Return k of a bead on a half-space, N/m^1.5."""
    return hl.theory.hertz_stiffness(bead.surface, hl.Surface(wall))


def contact_time(bead: hl.Bead, wall: hl.Material, speed: float) -> float:
    """Return T_c, s, of a bead that hits a half-space at this speed, m/s (equation 6.8)."""
    return float(hl.theory.hertz_contact_time(bead.mass, wall_stiffness(bead, wall), speed))


def widths(width_0_1_percent: float) -> dict[str, float]:
    """Return the other readings of the width of a wave in a Hertzian chain, in sizes of the beads, by their names."""
    of_theory = hl.theory.UniformChain(1.0, 1.0, 1.0).width + 1.0
    return {
        "read from 0.1 % to 0.1 % of the peak": width_0_1_percent,
        "equation 5.13, and one bead more at a sensor": of_theory,
    }


def striker_speed(force: float, bead: hl.Bead, stiffness: float | None = None, exponent: float = 1.5) -> float:
    """Return the speed, m/s, of a striker, equal to the beads, for about this force, N, by equations 6.12 and 6.16.

    These are for long waves: in a Hertzian chain the force is 0.886 of theirs (see
    `UniformChain.peak_force_from_particle_speed`).
    """
    overlap = (force / long_waves(bead, stiffness).stiffness) ** (1.0 / exponent)
    return float(np.sqrt(2.0 * force * overlap / ((exponent + 1.0) * bead.mass))) / PARTICLE_TO_STRIKER_SPEED


def speed_at(curve: xr.Dataset, force: float) -> float:
    """Return the wave speed, m/s, at a peak force, N, interpolated as a power law; NaN outside the simulated forces."""
    order = np.argsort(curve.peak_force.values)
    forces, speed = np.log(curve.peak_force.values[order]), np.log(curve.wave_speed.values[order])
    return float(np.exp(np.interp(np.log(force), forces, speed, left=np.nan, right=np.nan)))


def exponent(curve: xr.Dataset) -> float:
    """Return the slope of ln V over ln F, by least squares: (n − 1)/(2n) for F = k δⁿ (thesis, equation 5.12)."""
    return power_exponent(curve.peak_force.values, curve.wave_speed.values)


def power_exponent(x: Vector, y: Vector) -> float:
    """Return the exponent p of the line y ∝ xᵖ, by least squares of the logarithms."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


class PowerFit(NamedTuple):
    """The power law F = k δⁿ nearest to another one: k, N/mⁿ; n; the largest relative deviation of the force."""

    stiffness: float
    exponent: float
    misfit: float


def power_fit(law: hl.ContactLaw, lowest: float, highest: float, weighting: str = "relative") -> PowerFit:
    """Return the power law nearest to a law between two approaches, m.

    weighting: "relative", least squares of ln F at even steps of ln δ; "absolute", of F at even steps of δ.
    """
    logarithms, end = np.linspace(np.log(lowest / highest), 0.0, FITTED), float(law.force(np.array(highest)))
    # In parts of the range's end, so that k of any unit comes out of numbers near one.
    parts = np.exp(logarithms) if weighting == "relative" else np.linspace(lowest / highest, 1.0, FITTED)
    forces = law.force(parts * highest) / end
    if weighting == "relative":
        exponent, logarithm = np.polyfit(logarithms, np.log(forces), 1)
        factor = np.exp(logarithm)
    else:

        def factor_of(n: float) -> float:
            return float(parts**n @ forces / (parts**n @ parts**n))

        def squares(n: float) -> float:
            return float(np.sum((factor_of(n) * parts**n - forces) ** 2))

        exponent = minimize_scalar(squares, bounds=(0.5, 10.0), method="bounded", options={"xatol": 1e-10}).x
        factor = factor_of(exponent)
    misfit = float(np.abs(factor * parts**exponent / forces - 1.0).max())
    return PowerFit(float(factor * end / highest**exponent), float(exponent), misfit)


@dataclass(frozen=True)
class Curve:
    """A chain of two particles in turn and its contact law, for several strikers.

    law: of the theory; of_pair: of the chain, by default Hertz's. forces: approximate peaks, N; speeds: of the striker,
    m/s; one of both is given. striker: by default a bead as the first.
    """

    label: str
    pair: tuple[hl.Bead, hl.Bead]
    law: hl.ContactLaw
    of_pair: LawOfPair | hl.ContactLaw | None = None
    forces: tuple[float, ...] = ()
    speeds: tuple[float, ...] = ()
    striker: hl.Bead | None = None

    def fit(self, least: float, most: float) -> PowerFit:
        """Return the power law nearest to the contact law between these forces, N."""
        ends = self.law.approach(np.array([least, most]))
        return power_fit(self.law, float(ends[0]), float(ends[1]))

    def theory(self, fit: PowerFit) -> hl.theory.UniformChain:
        """Return the theory of long waves for a fitted power law."""
        return long_waves(self.pair[0], fit.stiffness, fit.exponent)

    def strikers(self) -> tuple[float, ...]:
        """Return the speeds of the strikers, m/s."""
        if self.speeds:
            return self.speeds
        fit = self.fit(RANGE[0] * self.forces[0], RANGE[1] * self.forces[-1])
        return tuple(striker_speed(force, self.pair[0], fit.stiffness, fit.exponent) for force in self.forces)


def run_curves(
    curves: Sequence[Curve], beads: int, first: int, second: int, jobs: int,
    until: float, approach: np.ndarray | None = None,
) -> xr.Dataset:  # fmt: skip
    """Return speed, peak force and width between two sensors, over curves and strikers; theory and contact laws.

    until: length of the records, s. approach: m, at which the laws are given.
    """
    by_label = {curve.label: curve for curve in curves}
    count = len(curves[0].forces or curves[0].speeds)

    def build(curve: str, striker: int) -> hl.CoSimulation:
        curve_data = by_label[curve]
        chain = [curve_data.pair[i % 2] for i in range(beads)]
        speed = curve_data.strikers()[striker]
        return hl.CoSimulation(
            hl.Chain(chain, curve_data.striker or curve_data.pair[0], speed, law=curve_data.of_pair), None
        )

    measure = partial(passage, first=first, second=second)
    data = hl.sweep(build, until, jobs, measure, curve=list(by_label), striker=range(count))
    forces = data.peak_force.values
    fits = [curve.fit(*_ends(peaks)) for curve, peaks in zip(curves, forces, strict=True)]
    if approach is None:
        least, most = curves[0].law.approach(np.array(_ends(forces))).tolist()
        approach = np.geomspace(least, most, 21)
    data = data.assign_coords(approach=("approach", approach, {"units": "m"}))
    over, each = ("curve", "striker"), list(zip(curves, fits, forces, strict=True))
    speeds = [curve.theory(fit).wave_speed_from_force(peaks) for curve, fit, peaks in each]
    data["theory"] = (over, speeds, {"units": "m/s", "long_name": "wave speed, equation 5.12"})
    data["striker_speed"] = (over, [curve.strikers() for curve in curves], {"units": "m/s"})
    data["force"] = (("curve", "approach"), [curve.law.force(approach) for curve in curves], {"units": "N"})
    return data


def _ends(forces: np.ndarray) -> tuple[float, float]:
    return RANGE[0] * float(np.nanmin(forces)), RANGE[1] * float(np.nanmax(forces))


def line(curve: xr.Dataset, label: str) -> draw.Line:
    """Return the wave speeds over peak forces, simulated and by theory, for `draw.compared`."""
    return label, curve.peak_force.values, curve.wave_speed.values, curve.theory.values
