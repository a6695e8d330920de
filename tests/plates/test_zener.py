"""Zener's impact against direct integration, expansions, a finite-element plate and the thesis's numbers."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

import hertzlink as hl
from plates.impact import zener_contact_time

SUPPORTS = hl.Supports("clamped", "clamped", "free", "free")
DIAMETERS, THICKNESSES = (4.76e-3, 9.53e-3, 19.1e-3), (2.29e-3, 3.18e-3, 4.83e-3)


def plate_of(thickness: float, material: hl.Material = hl.ALUMINIUM_6061) -> hl.Plate:
    return hl.kirchhoff_plate(0.914, 0.914, thickness, material, SUPPORTS)


BEAD, PLATE = hl.Sphere(DIAMETERS[1] / 2.0, hl.STEEL_440C), plate_of(THICKNESSES[0])


def integrated(inelasticity: float) -> tuple[float, float]:
    """e and τ_c by integration of q = σ′ + λσ^{3/2}, q′ = −σ^{3/2} over time, to the return to σ = 0."""

    def rates(_: float, state: np.ndarray) -> list[float]:
        force = max(state[0], 0.0) ** 1.5
        return [state[1] - inelasticity * force, -force]

    def back(time: float, state: np.ndarray) -> float:
        return state[0] if time > 0.0 else 1.0

    back.terminal, back.direction = True, -1.0  # type: ignore[attr-defined]
    small = 1e-14 / max(1.0, inelasticity) ** 5
    path = solve_ivp(rates, (0.0, 1e4), [0.0, 1.0], method="DOP853", rtol=1e-12, atol=small, events=back)
    return -float(path.y_events[0][0][1]), float(path.t_events[0][0])


@pytest.mark.parametrize("inelasticity", [0.072, 0.25, 1.0, 2.2, 3.99, 4.01, 5.15, 11.0, 25.0])
def test_direct_integration(inelasticity: float) -> None:
    """Another form of the equation, on either side of the places where one fit hands over to another."""
    restitution, time = integrated(inelasticity)
    assert hl.theory.zener_restitution(inelasticity) == pytest.approx(restitution, rel=1e-9)
    assert zener_contact_time(inelasticity) == pytest.approx(time, rel=1e-9)


def test_elastic_impact() -> None:
    """λ = 0: Hertz's collision, 2 ∫ dσ / √(1 − (4/5) σ^{5/2}); with (4/5) σ^{5/2} = sin²θ nothing diverges in it."""
    half, _ = quad(lambda angle: 0.8 * 1.25**0.4 * np.sin(angle) ** -0.2, 0.0, np.pi / 2.0)
    assert zener_contact_time(0.0) == pytest.approx(2.0 * half, rel=1e-8)
    assert zener_contact_time(0.0) == pytest.approx(3.2180655, abs=5e-8)
    assert hl.theory.zener_restitution(0.0) == pytest.approx(1.0, abs=1e-10)


def test_large_losses() -> None:
    """e λ⁵ is constant but for exp(−4.5 λ^{5/3}), and τ_c/λ = 5 ln λ + const + 3 λ^{−5/3} + …

    λ⁴σ, λ⁵q and τ/λ obey equations without λ, so impacts differ by the start, λ⁵q = λ⁵, only. The 3:
    the slow motion σ^{3/2} = q + (2/3) q^{2/3} gives 2, the start off it 1.
    """
    number = np.array([4.5, 10.0, 50.0, 1e3, 1e6])
    constant = integrated(8.0)[0] * 8.0**5
    assert hl.theory.zener_restitution(number) * number**5 == pytest.approx(np.full(5, constant), rel=1e-9)
    small = np.array([4e-3, 2e-3, 1e-3, 5e-4])
    excess = zener_contact_time(small**-0.6) * small**0.6 + 3.0 * np.log(small) - 3.0 * small
    changes = np.diff(excess)
    assert np.log2(changes[:-1] / changes[1:]) == pytest.approx([2.0, 2.0], abs=0.2)


@pytest.mark.parametrize("materials", [(hl.STEEL_440C, hl.ALUMINIUM_6061), (hl.PTFE, hl.BRASS_360)])
def test_equation_6_37(materials: tuple[hl.Material, hl.Material]) -> None:
    """The parameter of spheres as the thesis prints it."""
    sphere, wall = materials
    speed, ratio = np.array([0.1, 0.31, 2.0]), 9.53 / 3.18
    walls = (1.0 - wall.poisson_ratio**2) / wall.youngs_modulus
    spheres = (1.0 - sphere.poisson_ratio**2) / sphere.youngs_modulus
    printed = np.pi**0.6 / (4.0 * np.sqrt(3.0)) * ratio**2 * (sphere.density / wall.density) ** 0.6
    printed = printed * (speed**2 * wall.density * walls) ** 0.1 * (1.0 + spheres / walls) ** -0.4
    found = hl.theory.PlateImpact(hl.Sphere(9.53e-3 / 2.0, sphere), plate_of(3.18e-3, wall), speed).inelasticity
    assert found == pytest.approx(printed, rel=1e-12)


@pytest.mark.thorough
@pytest.mark.parametrize(("diameter", "thickness"), [(4.76e-3, 2.29e-3), (9.53e-3, 4.83e-3)])
def test_a_bead_on_a_finite_element_plate(diameter: float, thickness: float) -> None:
    """A plate too wide for an echo, and a bead integrated against it: rebound to 1e-3, time to a window."""
    plate = hl.kirchhoff_plate(1.0, 1.0, thickness, hl.ALUMINIUM_6061, SUPPORTS, highest_frequency=100e3)
    bead, speed = hl.Sphere(diameter / 2.0, hl.STEEL_440C), 0.31
    stiffness = hl.theory.hertz_stiffness(bead.surface, hl.Surface(plate.material))
    expected = hl.theory.PlateImpact(bead, plate, speed).contact_time
    moving = hl.stepping.MovingStructure(hl.reduce(plate.at(0.5, 0.5), until=1.2 * expected, tolerance=1e-4))
    window, state, place, velocity, surface, force = expected / 150.0, moving.start(), 0.0, speed, 0.0, 0.0
    steps = 0
    while place >= surface and steps < 300:
        steps += 1
        for _ in range(5):
            _, moved = moving.advance(state, force, window)
            travel = window * (velocity - force * window / (2.0 * bead.mass))
            force = stiffness * max(place + travel / 2.0 - (surface + moved) / 2.0, 0.0) ** 1.5
        state, surface = moving.advance(state, force, window)
        place, velocity = place + travel, velocity - force * window / bead.mass
    restitution = hl.theory.zener_restitution(hl.theory.PlateImpact(bead, plate, speed).inelasticity)
    assert -velocity / speed == pytest.approx(restitution, rel=1e-3)
    assert steps * window == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hl.theory.zener_restitution(-0.1), r"inelasticity = -0\.1: must be zero or a positive number"),
        (lambda: hl.theory.zener_restitution(float("nan")), "inelasticity = nan"),
        (lambda: zener_contact_time(np.array([1.0, np.inf])), "inelasticity = inf"),
        (lambda: zener_contact_time("thin"), "inelasticity = 'thin'"),  # type: ignore[type-var]
        (
            lambda: hl.theory.PlateImpact(BEAD, PLATE, 0.0).inelasticity,
            r"impact_speed = 0\.0: must be a positive number of m/s",
        ),
        (lambda: hl.theory.PlateImpact(None, PLATE, 0.3).inelasticity, "bead = None"),  # type: ignore[arg-type]
        (lambda: hl.theory.PlateImpact(BEAD, 2e-3, 0.3).inelasticity, r"plate = 0\.002: must be a Plate"),  # type: ignore[arg-type]
        (lambda: hl.theory.PlateImpact(BEAD, PLATE, np.array([0.3, -0.3])).contact_time, r"impact_speed = -0\.3"),
        (lambda: hl.theory.PlateImpact(BEAD, PLATE, 0.3, inelasticity=-1.0).contact_time, r"inelasticity = -1\.0"),
        (lambda: hl.theory.PlateImpact(BEAD, PLATE, 0.3).time_of_flight(0), "beads = 0"),
        (lambda: hl.theory.PlateImpact(BEAD, PLATE, 0.3).time_of_flight(13, float("nan")), "striker_speed = nan"),
        (lambda: hl.theory.PlateImpact(BEAD, PLATE, 0.0).time_of_flight(13, 0.3), r"impact_speed = 0\.0"),
    ],
)
def test_bad_input(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
