"""Section 6.2: Zener's equation, the numbers that follow from it, and waves from the contact to the plate's edge."""

from dataclasses import dataclass
from functools import lru_cache
from math import pi, sqrt, tanh
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from .materials import ALUMINIUM, STEEL_440C, on_half_space
from .theory import CONTACT_TIME, V_P
from .values import Chapter, Effort, Variants

aspect = Chapter("plates_aspect_ratio")

PLATE, BALL = ALUMINIUM, STEEL_440C
THICKNESSES = (2.29, 3.18, 4.83)
"""mm."""
SPEED = 0.31
SIDE = 0.914
THIN, THICK = 2.29, 4.83


@dataclass(frozen=True)
class Convention:
    """Which velocity, m/s, and which density of the beads, kg/m³, enter equations 6.37 and 6.38."""

    speed: float = SPEED
    density: float = BALL.density


CONVENTIONS = {
    "v = 0.31, rho = 7800": Convention(),
    "v = 0.31, rho = 8000": Convention(SPEED, 8000.0),
    "v = 0.682 x 0.31, rho = 7800": Convention(V_P * SPEED),
}


def inelasticity(diameter: float, thickness: float, given: Convention) -> float:
    """λ of equation 6.37; lengths in mm."""
    moduli = PLATE.compliance / BALL.compliance
    return float(
        pi**0.6 / (4.0 * sqrt(3.0)) * (diameter / thickness) ** 2 * (given.density / PLATE.density) ** 0.6
        * (given.speed**2 * PLATE.density * PLATE.compliance) ** 0.1 * (1.0 + 1.0 / moduli) ** -0.4
    )  # fmt: skip


def elastic_contact(diameter: float, given: Convention) -> float:
    """T_c,0 of equation 6.38 with τ_c = 3.218, s; diameter in mm."""
    mass = given.density * pi / 6.0 * (diameter * 1e-3) ** 3
    stiffness = on_half_space(diameter * 0.5e-3, BALL, PLATE)
    return CONTACT_TIME * float((mass**2 / (given.speed * stiffness**2)) ** 0.2)


@lru_cache
def bounce(factor: float, tolerance: float) -> tuple[float, float]:
    """τ_c and e of equation 6.35 at λ: with q = σ′ + λσ^{3/2}, σ′ = q − λσ^{3/2} and q′ = −σ^{3/2}."""

    def rate(_: float, state: Any) -> list[float]:
        pressed = max(state[0], 0.0) ** 1.5
        return [state[1] - factor * pressed, -pressed]

    def returned(_: float, state: Any) -> float:
        return float(state[0])

    event: Any = returned
    event.terminal, event.direction = True, -1.0
    solved = solve_ivp(
        rate, (0.0, 1e4), [0.0, 1.0], "DOP853", events=event, rtol=tolerance, atol=1e-4 * tolerance, max_step=1.0
    )
    return float(solved.t_events[0][0]), -float(solved.y_events[0][0][1])


def contact(diameter: float, factor: float, given: Convention, tolerance: float) -> float:
    """T_c of equation 6.38, s."""
    return elastic_contact(diameter, given) * bounce(factor, tolerance)[0] / CONTACT_TIME


def speed_of(diameter: float, thickness: float, factor: float, density: float) -> float:
    """The velocity that makes λ of 6.37 what is printed, m/s."""
    return SPEED * (factor / inelasticity(diameter, thickness, Convention(SPEED, density))) ** 5.0


def factor_of(diameter: float, duration: float, tolerance: float) -> float:
    """λ by a printed T_c, s, with T_c,0 of v = 0.31 m/s and 8000 kg/m³, as the printed ones."""
    wanted = duration / elastic_contact(diameter, PRINTED_CONTACTS) * CONTACT_TIME
    return float(brentq(lambda factor: bounce(factor, tolerance)[0] - wanted, 1e-3, 10.0, xtol=1e-9))


PRINTED_CONTACTS = Convention(SPEED, 8000.0)
IMPLIED = speed_of(19.1, THIN, factor_of(19.1, 1435.17e-6, 1e-11), 8000.0)
"""m/s, by the printed number of the most digits."""
BY_CONTACT = "v by the printed T_c = 1435.17, rho = 8000"
ALL = CONVENTIONS | {BY_CONTACT: Convention(IMPLIED, 8000.0)}


def _factor_entry(diameter: float, name: str, printed: str, conditions: str) -> None:
    @aspect.entry(name, printed, "1", conditions)
    def factors(_: Effort) -> Variants:
        return {key: [inelasticity(diameter, t, given) for t in THICKNESSES] for key, given in ALL.items()}


_factor_entry(4.76, "lambda_D4p76", "0.32 0.166 0.072", "equation 6.37; t = 2.29, 3.18, 4.83 mm")
_factor_entry(9.53, "lambda_D9p53", "1.28 - 0.2", "equation 6.37; t = 2.29, 3.18, 4.83 mm; no number for 3.18 mm")
_factor_entry(19.1, "lambda_D19p1", "5.15 - 1.16", "equation 6.37; t = 2.29, 3.18, 4.83 mm; no number for 3.18 mm")


"""D and t, mm, and the printed λ."""


def contacts(diameter: float, thicknesses: tuple[float, ...], tolerance: float, printed: tuple[float, ...]) -> Variants:
    """Contact times, µs, by convention, and with the printed λ and T_c,0 of 8000 kg/m³."""
    found: dict[str, list[float]] = {
        key: [contact(diameter, inelasticity(diameter, t, one), one, tolerance) * 1e6 for t in thicknesses]
        for key, one in ALL.items()
    }
    implied = [inelasticity(diameter, t, ALL[BY_CONTACT]) for t in thicknesses]
    for name, factors in (("by the printed T_c = 1435.17", implied), ("as printed", printed)):
        found[f"T_c0 with v = 0.31, rho = 8000; lambda {name}"] = [
            contact(diameter, one, PRINTED_CONTACTS, tolerance) * 1e6 for one in factors
        ]
    return found


@aspect.entry("T_c_D9p53", "87.81 59.1", "us", "equations 6.35 and 6.38; t = 2.29, 4.83 mm; 0.2 read as 0.29")
def contacts_middle(effort: Effort) -> Variants:
    return contacts(9.53, (THIN, THICK), effort.tolerance, (1.28, 0.29))


def rayleigh_over_shear(poisson_ratio: float) -> float:
    """Root x = c_R/c_s of x⁶ − 8x⁴ + (24 − 16κ)x² − 16(1 − κ) = 0, κ = (1 − 2ν)/(2 − 2ν) (Achenbach, section 5.11)."""
    ratio = (1.0 - 2.0 * poisson_ratio) / (2.0 - 2.0 * poisson_ratio)
    squares = np.roots([1.0, -8.0, 24.0 - 16.0 * ratio, -16.0 * (1.0 - ratio)])
    real = squares[np.abs(squares.imag) < 1e-9].real
    return float(np.sqrt(real[(real > 0.0) & (real < 1.0)][0]))


SHEAR = PLATE.bar_speed / sqrt(2.0 * (1.0 + PLATE.poisson_ratio))
DILATATION = SHEAR * sqrt((2.0 - 2.0 * PLATE.poisson_ratio) / (1.0 - 2.0 * PLATE.poisson_ratio))


def flexural_frequency(wavenumber: float, thickness: float) -> float:
    """ω, 1/s, of the mode A0: the root of tanh(Qh)/tanh(Ph) = (k² + Q²)²/(4k²PQ) below the Rayleigh wave's.

    P² = k² − ω²/c_l², Q² = k² − ω²/c_s², h half the thickness (Lamb 1917; Achenbach, section 6.7).
    """
    half = thickness / 2.0

    def mismatch(squared: float) -> float:
        long = sqrt(wavenumber**2 - squared / DILATATION**2)
        short = sqrt(wavenumber**2 - squared / SHEAR**2)
        left = 4.0 * wavenumber**2 * long * short * tanh(short * half)
        return left - (wavenumber**2 + short**2) ** 2 * tanh(long * half)

    kirchhoff = (
        wavenumber**4 * PLATE.youngs_modulus * thickness**2 / (12.0 * (1.0 - PLATE.poisson_ratio**2) * PLATE.density)
    )
    highest = min(kirchhoff, (rayleigh_over_shear(PLATE.poisson_ratio) * SHEAR * wavenumber) ** 2)
    return sqrt(brentq(mismatch, 1e-3 * highest, highest * (1.0 - 1e-12), xtol=1e-12 * highest, rtol=1e-14))


def group_speed(wavenumber: float, thickness: float) -> float:
    """dω/dk of the mode A0, m/s, by a central difference of fourth order."""
    step = 1e-3 * wavenumber
    near, far = (
        flexural_frequency(wavenumber + n * step, thickness) - flexural_frequency(wavenumber - n * step, thickness)
        for n in (1, 2)
    )
    return (8.0 * near - far) / (12.0 * step)
