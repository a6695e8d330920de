"""The plate with one edge: its exact solution by another route, finite plates before other echoes, and its limits."""

from math import pi, sqrt

import numpy as np
import pytest
from independent.plates import reflected_response, reflected_transform
from scipy.special import sici

import hertzlink as hl
from plates.half_plane import EDGES, conductance

ALUMINIUM = hl.ALUMINIUM_6061
SMALL, LARGE = (hl.Sphere(diameter / 2.0, hl.STEEL_440C) for diameter in (4.76e-3, 9.53e-3))


CARBON = hl.OrthotropicMaterial(140e9, 10e9, 0.3, 5e9, 5e9, 3.6e9, 1600.0)
LAMINATE = hl.Laminate([hl.Ply(CARBON, 1e-3, 0.3), hl.Ply(CARBON, 1e-3, 1.2)])
CHAIN = hl.Chain([SMALL] * 20, SMALL, impact_speed=0.31)


def ratio(bead: hl.Sphere, wall: hl.Structure, until: float) -> float:
    chain = hl.Chain([bead] * 20, bead, impact_speed=0.31)
    return float(hl.amplitude_ratio(hl.CoSimulation(chain, wall).run(until), sensor=7))


def scales(thickness: float, material: hl.Material = ALUMINIUM) -> tuple[float, float]:
    """a = √(D/m), m²/s, and the infinite plate's impedance 8√(Dm), N s/m."""
    rigidity = material.contact_modulus * thickness**3 / 12.0
    mass = material.density * thickness
    return sqrt(rigidity / mass), 8.0 * sqrt(rigidity * mass)


def moved(plate: hl.Structure, time: float, highest: float) -> float:
    """Displacement, m, at a time after an impulse of 1 N s, without the fastest waves; a sharp cut would ring."""
    frequency = np.sqrt(plate.stiffness.diagonal())
    taper = np.exp(-18.0 * (frequency / (2.0 * pi * highest)) ** 2)
    return float((plate.contact**2 * taper * np.sin(frequency * time) / frequency).sum())


# The amplitude ratios and g of an independent solution: Fourier along the edge, Laplace in time, no finite elements.


@pytest.mark.parametrize(
    ("bead", "thickness", "edge", "distance", "expected"),
    [
        (SMALL, 2.29e-3, "clamped", 14e-3, 0.5551), (SMALL, 2.29e-3, "clamped", 20e-3, 0.5213),
        (SMALL, 2.29e-3, "free", 20e-3, 0.5179), (SMALL, 2.29e-3, "simple", 20e-3, 0.5255),
        (LARGE, 3.18e-3, "clamped", 20e-3, 0.4680),
    ],
)  # fmt: skip
def test_amplitude_ratios_are_those_of_the_exact_response(
    bead: hl.Sphere, thickness: float, edge: str, distance: float, expected: float
) -> None:
    until = 0.8e-3 if bead is SMALL else 1.6e-3
    found = ratio(bead, hl.half_plane(thickness, ALUMINIUM, edge, distance, until), until)
    assert found == pytest.approx(expected, abs=4e-4)


@pytest.mark.parametrize(
    ("edge", "time", "expected"),
    [("clamped", 1.0, -0.887), ("clamped", 3.0, -0.990), ("free", 1.0, 0.243), ("free", 10.0, 1.682)]
    + [("simple", time, 2.0 / pi * sici(1.0 / time)[0] - 1.0) for time in (0.1, 0.3, 1.0, 3.0, 10.0)]
    + [(edge, time, None) for edge in ("clamped", "free") for time in (0.1, 0.3, 2.0, 30.0)],
)
def test_the_displacement_after_an_impulse_is_that_of_the_laplace_transform(
    edge: str, time: float, expected: float | None
) -> None:
    """(1 + g(t a/d²))/Z; for a simple edge g is the sine integral."""
    diffusion, impedance = scales(2e-3)
    distance = 0.02
    seconds = time * distance**2 / diffusion
    highest = 300.0 / seconds
    plate = hl.half_plane(2e-3, ALUMINIUM, edge, distance, until=1.01 * seconds, highest_frequency=highest)
    reflected = moved(plate, seconds, highest) * impedance - 1.0
    assert reflected == pytest.approx(reflected_response(edge, 0.33, time), abs=3e-4)
    if expected is not None:
        assert reflected == pytest.approx(expected, abs=6e-4)


def test_the_quadrature_has_converged() -> None:
    """AR does not depend on the record that the oscillators serve, nor on the highest frequency."""
    usual = ratio(SMALL, hl.half_plane(2.29e-3, ALUMINIUM, "clamped", 0.014), 0.8e-3)
    short = ratio(SMALL, hl.half_plane(2.29e-3, ALUMINIUM, "clamped", 0.014, 0.8e-3), 0.8e-3)
    assert short == pytest.approx(usual, abs=5e-6)
    for highest, near in ((60e3, 2e-5), (200e3, 1e-5)):
        other = hl.half_plane(2.29e-3, ALUMINIUM, "clamped", 0.014, 0.8e-3, highest)
        assert ratio(SMALL, other, 0.8e-3) == pytest.approx(usual, abs=near)


@pytest.mark.parametrize(("edge", "distance"), [("clamped", 0.016), ("simple", 0.016), ("free", 0.016), ("free", 0.0)])
def test_a_finite_plate_agrees_before_its_other_edges_answer(edge: str, distance: float) -> None:
    """0.4 m in square, meshed for 100 kHz where it is struck; the free edge as well struck on the edge itself."""
    finite = hl.kirchhoff_plate(
        0.4, 0.4, 2.29e-3, ALUMINIUM, hl.Supports(edge, "free", "free", "free"), highest_frequency=60e3
    )
    expected = ratio(SMALL, hl.reduce(finite.at(distance, 0.2), 0.6e-3), 0.6e-3)
    assert ratio(SMALL, hl.half_plane(2.29e-3, ALUMINIUM, edge, distance, 0.6e-3), 0.6e-3) == pytest.approx(
        expected, abs=1e-3
    )


# Limits.


def test_far_from_the_edge_it_is_the_infinite_plate() -> None:
    infinite = ratio(SMALL, hl.infinite_plate(2.29e-3, ALUMINIUM), 0.6e-3)
    for edge in EDGES:
        for distance in (0.3, 3.0, 100.0):
            near = hl.half_plane(2.29e-3, ALUMINIUM, edge, distance, 0.6e-3)
            assert ratio(SMALL, near, 0.6e-3) == pytest.approx(infinite, abs=1e-4)


def test_at_a_clamped_edge_nothing_moves() -> None:
    """The compliance at rest is d²/(4πD), from the plate's Green function by images; AR is that of the half-space."""
    thickness, distance = 2.29e-3, 0.5e-3
    plate = hl.half_plane(thickness, ALUMINIUM, "clamped", distance)
    rigidity = ALUMINIUM.contact_modulus * thickness**3 / 12.0
    square = plate.stiffness.diagonal()
    assert (plate.contact**2 / square).sum() + plate.flexibility == pytest.approx(
        distance**2 / (4.0 * pi * rigidity), rel=1e-6
    )
    rigid = ratio(SMALL, hl.half_space(ALUMINIUM), 0.8e-3)
    assert ratio(SMALL, plate, 0.8e-3) == pytest.approx(rigid, abs=2e-3)


def test_on_a_free_edge_the_plate_is_a_dashpot() -> None:
    """√6 √(Dm) for ν = 0; for ν = 0.3, 2.165 √(Dm)."""
    at_edge = np.zeros(1)
    assert 8.0 / conductance(at_edge, "free", 0.0) == pytest.approx(sqrt(6.0), rel=1e-9)
    for nu in (0.1, 0.3, 0.45):
        transform = 1.0 + 1e-8 * reflected_transform("free", nu, 1e-8).real
        assert conductance(at_edge, "free", nu) == pytest.approx(transform, rel=1e-3)


def test_energy_is_kept() -> None:
    bead, plate = SMALL, hl.half_plane(2.29e-3, ALUMINIUM, "free", 0.01, 0.8e-3)
    assert plate.damping is None
    run = hl.CoSimulation(hl.Chain([bead] * 20, bead, impact_speed=0.31), plate).run(0.8e-3)
    assert abs(hl.energy_error(run)) < 1e-5


# The infinite plate: against finite plates before the first echo, and its energy.


@pytest.mark.thorough
@pytest.mark.parametrize("laminate", [LAMINATE, hl.Laminate([hl.Ply(CARBON, 2e-3, 0.7)])], ids=["two plies", "one ply"])
def test_a_laminate_stays_where_an_impulse_left_it(laminate: hl.Laminate) -> None:
    """With D₁₆ and D₂₆, reduced for B: the displacement on a large plate is I/Z, until the echo."""
    plate = hl.kirchhoff_plate(0.7, 0.7, None, laminate, hl.Supports(), highest_frequency=25e3)
    pulse, window, after = 100e-6, 1e-6, []
    moving = hl.stepping.MovingStructure(hl.reduce(plate.at(0.35, 0.35), until=1.8e-4, tolerance=1e-3))
    state = moving.start()
    for step in range(170):
        time = (step + 0.5) * window
        force = 1.0 - np.cos(2.0 * pi * time / pulse) if time < pulse else 0.0
        state, surface = moving.advance(state, force, window)
        if time > pulse:
            after.append(surface)
    impedance = hl.infinite_plate(None, laminate).damping[0, 0]
    assert impedance == pytest.approx(plate.point_impedance, rel=1e-12)
    assert np.array(after) * impedance / pulse == pytest.approx(np.ones(len(after)), abs=5e-4)
