"""Chapter 1 and the coefficients of chapter 6: closed forms, and a long discrete chain for those that need one."""

from functools import lru_cache
from math import pi, sqrt

import numpy as np
from scipy.special import beta

from . import waves
from .line import Flight, Numbers, hertzian, row
from .materials import STEEL_440C, between_spheres, sphere_mass
from .values import Chapter, Effort, Variants

chapter = Chapter("theory_constants")

STEEL = STEEL_440C
RADIUS = 4.76e-3
MASS, CONTACT = sphere_mass(RADIUS, STEEL), between_spheres(RADIUS, STEEL)
STRIKER = 0.3
BEADS, FAR = 60, (40, 50)
"""A long chain, and the contacts between which its wave is steady."""

BEYOND, BEFORE_ECHOES = 150, 3.4e-3
"""A contact 30 beyond the middle of 240 beads, and a time, s, by which nothing has come back to it from the end."""

V_P = 0.682
"""Of the striker's speed, equation 6.16 as printed."""

CONTACT_TIME = 2.0 * (5.0 / 4.0) ** 0.4 * 0.4 * float(beta(0.4, 0.5))
"""2∫dx/√(1 − 4x^{5/2}/5) from 0 to the root: with s = 4x^{5/2}/5 it is a beta function (equation 6.8)."""

INCIDENT_SPEED = 2.0 * (16.0 / 25.0) ** 0.2
"""V_in/R over (v_p A²/m²)^{1/5}: equation 6.12."""

TRANSIT = 2.0 / (INCIDENT_SPEED * V_P**0.2)
"""2R/V_in over (m²/v)^{1/5} A^{−2/5}, from equations 6.13 and 6.16."""

"""m^{2/5} A_w^{−2/5}/D with m = πρD³/6 and A_w = (4/3)√(D/2)/(θ_s + θ_p), over (ρ(θ_s + θ_p))^{2/5}."""

BEAD_CONTACT = (pi / 2.0) ** 0.4
"""The same for two beads: A_c = √D/(3θ_s), over (ρ θ_s)^{2/5}."""


def force_scale(force: float) -> float:
    """(2E/(aρ^{3/2}(1 − ν²)))^{1/3} F^{1/6} of equation 1.10, m/s."""
    return (2.0 / (2.0 * RADIUS * STEEL.density**1.5 * STEEL.compliance)) ** (1.0 / 3.0) * force ** (1.0 / 6.0)


@lru_cache
def long_chain(tolerance: float) -> Flight:
    """A striker against a long chain without gravity."""
    line = hertzian(*row(BEADS, MASS, CONTACT, CONTACT))
    return line.strike(STRIKER, 1.15e-3, tolerance)


def contact_peak(flight: Flight, link: int) -> waves.Peak:
    """The first peak of a contact's force."""
    return waves.peaks(flight.contact(link), flight.until)[0]


def wave_speed(tolerance: float) -> tuple[float, float]:
    """Speed, m/s, and highest contact force, N, of the steady wave."""
    first, second = (contact_peak(long_chain(tolerance), link) for link in FAR)
    return 2.0 * RADIUS * (FAR[1] - FAR[0]) / (second.time - first.time), second.height


@chapter.entry("hertz_exponent", "1.5", "1", "equation 1.1; parabolas pressed together, by the half-space's integral")
def hertz_exponent(_: Effort) -> Variants:
    """F = 2E*∫(δ − x²/R)dx over |x| < √(δR) (Popov and Heß, Method of dimensionality reduction, equation 2.6)."""
    points, weights = np.polynomial.legendre.leggauss(8)
    forces = []
    for approach in (1e-6, 1.1e-6):
        half = sqrt(approach * RADIUS)
        forces.append(half * float(np.sum(weights * (approach - (half * points) ** 2 / RADIUS))))
    return {"closed form": float(np.log(forces[1] / forces[0]) / np.log(1.1))}


@chapter.entry("lwa_speed_coeff_precompressed", "0.9314", "1", "equation 1.9")
def lwa_speed_coeff_precompressed(_: Effort) -> Variants:
    """At F_d → 0 the brackets of 1.9 tend to 1, and V_s to the sound speed 2R√(1.5 k δ₀^{1/2}/m) of a linear chain."""
    preload = 3.0
    sound = 2.0 * RADIUS * sqrt(1.5 * CONTACT ** (2.0 / 3.0) * preload ** (1.0 / 3.0) / MASS)
    scale = 4.0 * preload / ((2.0 * RADIUS) ** 2 * STEEL.density**3 * STEEL.compliance**2)
    return {"closed form": sound / scale ** (1.0 / 6.0)}


@chapter.entry(
    "lwa_speed_coeff", "0.6802", "1", "equation 1.10; a discrete chain with the same coefficient's definition"
)
def lwa_speed_coeff(effort: Effort) -> Variants:
    """Equation 5.11 with 1.1, and what the discrete chain gives for V_s over the same scale of the force."""
    force = 20.0
    long_wave = 2.0 * RADIUS * sqrt(0.8 * CONTACT ** (2.0 / 3.0) / MASS) * force ** (1.0 / 6.0)
    speed, peak = wave_speed(effort.tolerance)
    return {"closed form": long_wave / force_scale(force), "discrete chain": speed / force_scale(peak)}


@chapter.entry("lwa_width_spheres_D", "5", "D", "equations 1.8 and 5.13; a discrete chain's sensor force above a share")
def lwa_width_spheres_D(effort: Effort) -> Variants:
    """ξ of 1.8 vanishes at ±(π/2)·5a/√10; a discrete wave has no end."""
    flight, (speed, _) = long_chain(effort.tolerance), wave_speed(effort.tolerance)
    found = {"closed form": pi * sqrt(10.0) / 2.0}
    for share in (0.01, 0.05, 0.1):
        found[f"discrete chain above {share:.0%}"] = waves.width(flight, 45, share, speed, 2.0 * RADIUS)
    return found


@lru_cache
def collision(beads: int, tolerance: float) -> tuple[float, float]:
    """Two equal waves meet in the middle: how high the follower is over its wave, by contact force and bead speed."""
    mass, stiffness = row(beads + 1, MASS, CONTACT, CONTACT)
    speeds: Numbers = np.zeros(beads + 2)
    speeds[0], speeds[-1] = STRIKER, -STRIKER
    flight = hertzian(mass, stiffness).strike(speeds, BEFORE_ECHOES, tolerance)
    # First the wave from the far striker passes, then the one that crossed it, then the follower.
    _, wave, follower, *_ = waves.peaks(flight.contact(BEYOND), flight.until, prominence=0.004)
    fastest = [
        waves.refined(lambda t: flight.speeds(t)[..., BEYOND], one.time, 10e-6).height for one in (wave, follower)
    ]
    return follower.height / wave.height, fastest[1] / fastest[0]


@chapter.entry(
    "secondary_wave_ratio_after_collision", "0.02", "1",
    "two waves of equal strikers meet; the first follower over its wave, 30 contacts beyond; no amplitude is named",
)  # fmt: skip
def secondary_wave_ratio_after_collision(effort: Effort) -> Variants:
    found = {}
    for place, beads in (("at a contact", 240), ("at a bead", 241)):
        force, speed = collision(beads, effort.tolerance)
        found |= {f"{place}, force": force, f"{place}, speed of a bead": speed}
    return found


@chapter.entry("contact_time_const", "3.218", "1", "equation 6.8; one ball on a wall, integrated")
def contact_time_const(effort: Effort) -> Variants:
    mass, stiffness, speed = 1.3, 2.7, 0.8
    scale = (mass**2 / (speed * stiffness**2)) ** 0.2
    ball = hertzian(np.array([mass]), np.array([stiffness])).strike(speed, 5.0 * scale, effort.tolerance)
    ends = waves.crossings(lambda t: ball.places(t)[..., 0], 0.0, 5.0 * scale, 0.01 * scale)
    return {"closed form": CONTACT_TIME, "integrated": max(ends) / scale}


@chapter.entry("vp_over_vstriker", "0.682", "1", "equation 6.16; highest speed of a bead far from the striker")
def vp_over_vstriker(effort: Effort) -> Variants:
    flight = long_chain(effort.tolerance)
    return {"discrete chain": waves.peaks(lambda t: flight.speeds(t)[..., 45], flight.until)[0].height / STRIKER}


@chapter.entry("coeff_6_13", "1.829", "1", "equation 6.13 from 6.12")
def coeff_6_13(_: Effort) -> Variants:
    return {"closed form": INCIDENT_SPEED}


@chapter.entry("coeff_6_17", "1.180", "1", "equation 6.17 from 6.13 and 6.16")
def coeff_6_17(_: Effort) -> Variants:
    return {"closed form": TRANSIT}


@chapter.entry("coeff_6_20", "2.361", "1", "equation 6.20: twice that of 6.17")
def coeff_6_20(_: Effort) -> Variants:
    return {"closed form": 2.0 * TRANSIT}


@chapter.entry("coeff_6_39_Tt", "1.414", "1", "equation 6.39, first coefficient")
def coeff_6_39_Tt(_: Effort) -> Variants:
    return {"closed form": TRANSIT * BEAD_CONTACT}
