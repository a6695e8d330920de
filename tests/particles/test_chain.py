"""The chain: an independent code's numbers, conservation, orders, preload, dashpots, mixed beads, bad input."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import hertzlink as hl
from particles.moving import ChainState

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
SPEED = hl.drop_speed(0.01)


def uniform(**keywords: object) -> hl.Chain:
    return hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=SPEED, **keywords)  # type: ignore[arg-type]


def test_steel_half_space_matches_lammps() -> None:
    """LAMMPS gives bead 7 of this chain 49.9881 N at 128.525 µs and 48.9536 N at 587.462 µs (eight equal digits)."""
    run = hl.CoSimulation(uniform(), hl.half_space(hl.STEEL_440C)).run(until=1e-3)
    waves = hl.reflections(run, sensor=7)
    assert waves.incident
    assert waves.primary
    found = [waves.incident.amplitude, waves.incident.arrival, waves.primary.amplitude, waves.primary.arrival]
    assert found == pytest.approx([49.9881, 128.525e-6, 48.9536, 587.462e-6], rel=1e-5)


def test_wave_speed_and_force_of_the_thesis_chain() -> None:
    """316 steel, R = 2.38 mm, v = 0.5 m/s: 569.1 m/s and 20.55 N at contact 15–16 (section 3.4, recomputed)."""
    bead = hl.Sphere(2.38e-3, hl.STEEL_316)
    run = hl.CoSimulation(hl.Chain([bead] * 20, bead, 0.5), hl.half_space(hl.STEEL_316)).run(until=2.5e-4)
    assert hl.wave_speed(run, 10, 15) == pytest.approx(569.1, rel=2e-3)
    before_reflection = run.contact_force.sel(contact=16, time=slice(0.0, 1.6e-4))
    assert float(before_reflection.max()) == pytest.approx(20.55, rel=1e-3)


def advanced(chain: hl.Chain, dt: float, until: float, start: ChainState | None = None) -> NDArray[np.float64]:
    moving = hl.stepping.MovingChain(chain, hl.Surface(hl.STEEL_440C), dt=dt)
    state, _ = moving.advance(start or moving.start(), (0.0, 0.0), until)
    return state.position - moving.rest


def test_verlet_with_dashpots_has_order_two() -> None:
    lossy = uniform(dissipation=hl.LinearDashpot(4.0), gravity=9.81)
    exact = advanced(lossy, 5e-9, 6e-5)
    errors = [abs(advanced(lossy, dt, 6e-5) - exact).max() for dt in (4e-7, 2e-7, 1e-7)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.2)


beads = st.builds(
    hl.Sphere,
    radius=st.floats(1e-3, 2e-2),
    material=st.sampled_from([hl.STEEL_440C, hl.BRASS_360, hl.PTFE, hl.ALUMINIUM_6061]),
)


@pytest.mark.thorough
@settings(max_examples=25)
@given(st.lists(beads, min_size=1, max_size=6), beads, st.floats(0.05, 2.0))
def test_any_free_chain_keeps_momentum_and_energy(row: list[hl.Sphere], striker: hl.Sphere, speed: float) -> None:
    simulation = hl.CoSimulation(hl.Chain(row, striker, speed), None)
    run = simulation.run(until=20.0 * simulation.chain.contact_time)
    momentum = (simulation.chain.mass * run.velocity.values).sum(axis=1)
    assert momentum == pytest.approx(np.full(momentum.size, striker.mass * speed), rel=1e-12)
    assert hl.energy_error(run) < 2e-6


@settings(max_examples=25)
@given(st.lists(beads, min_size=1, max_size=6), st.floats(0.1, 20.0), st.floats(0.0, 20.0))
def test_dashpots_take_energy_and_never_pull(row: list[hl.Sphere], coefficient: float, gravity: float) -> None:
    chain = hl.Chain(row, row[0], 0.3, gravity=gravity, dissipation=hl.LinearDashpot(coefficient))
    simulation = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C))
    run = simulation.run(until=20.0 * simulation.chain.contact_time)
    energy = (run.kinetic_energy + run.contact_energy).values
    assert np.all(np.diff(energy) <= 1e-6 * chain.impact_energy)
    assert np.all(run.contact_force.values >= 0.0)
    assert hl.energy_error(run) < 1e-4


@pytest.mark.parametrize("wall", [hl.half_space(hl.PTFE), hl.half_plane(2e-3, hl.PTFE, "clamped", 0.02, until=1e-3)])
def test_gravity_preload_is_static(wall: hl.Structure) -> None:
    """Contact n carries the weight of the beads above it, and nothing moves until the wave comes."""
    chain = hl.Chain([BEAD] * 10, BEAD, 1e-9, gravity=9.81)
    run = hl.CoSimulation(chain, wall).run(until=1e-3)
    weights = np.arange(11) * BEAD.mass * 9.81
    assert run.static_force.values == pytest.approx(weights, rel=1e-12)
    assert run.contact_force.isel(time=0).values == pytest.approx(weights, rel=1e-9)
    first = run.displacement.sel(bead=slice(5, 10), time=slice(0.0, 1e-5))
    assert abs(first).max() < 1e-13


def test_the_striker_arrives_free() -> None:
    """Under gravity a striker that touches gently falls on: its acceleration is g, not zero."""
    chain = hl.Chain([BEAD] * 2, BEAD, 1e-9, gravity=9.81)
    run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=1e-6)
    assert float(run.velocity.isel(time=-1).sel(bead=0)) == pytest.approx(9.81e-6, rel=0.02)


def test_unlike_spheres_collide_as_hertz_says() -> None:
    """Two free spheres: the collision lasts 3.218 (m²/k²v)^(1/5) with the reduced mass, and keeps relative speed."""
    small, large = hl.Sphere(3e-3, hl.BRASS_360), hl.Sphere(7e-3, hl.PTFE)
    run = hl.CoSimulation(hl.Chain([large], small, 0.4), None).run(until=6e-4)
    reduced = small.mass * large.mass / (small.mass + large.mass)
    stiffness = hl.theory.hertz_stiffness(small.surface, large.surface)
    touching = run.time.values[run.contact_force.sel(contact=1).values > 0.0]
    assert touching[-1] == pytest.approx(3.2180655 * (reduced**2 / (stiffness**2 * 0.4)) ** 0.2, rel=0.01)
    first, second = run.velocity.isel(time=-1).values
    assert second - first == pytest.approx(0.4, rel=1e-6)


@pytest.mark.parametrize("flexibility", [2e-7, 1e-6])
def test_a_loss_sees_the_contacts_own_part_of_the_approach(flexibility: float) -> None:
    """A bead on Hertz's contact with a dashpot, and a massless spring behind both: δ = δ_h + f F, integrated exactly.

    F = k δ_h^1.5 + γ dδ_h/dt and F = (δ − δ_h)/f give dδ_h/dt, a third equation in addition to the bead's two.
    """
    dashpot, speed = 5.0, 0.3
    chain = hl.Chain([BEAD], BEAD, speed, dissipation=hl.LinearDashpot(dashpot))
    soft = replace(hl.half_space(hl.PTFE), flexibility=flexibility)
    simulation = hl.CoSimulation(chain, soft)
    k_bead, k_wall = simulation.chain.stiffness
    mass = BEAD.mass

    def rates(_: float, state: NDArray[np.float64]) -> list[float]:
        y0, v0, y1, v1, own = state
        on_wall = max((y1 - own) / flexibility, 0.0)
        gap, rate = y0 - y1, v0 - v1
        between = max(k_bead * max(gap, 0.0) ** 1.5 + (dashpot * rate if gap >= 0.0 else 0.0), 0.0)
        own_rate = (on_wall - k_wall * max(own, 0.0) ** 1.5) / dashpot
        return [v0, -between / mass, v1, (between - on_wall) / mass, own_rate]

    run = simulation.run(until=1.2e-4)
    exact = solve_ivp(
        rates,
        (0.0, 1.2e-4),
        [0.0, speed, 0.0, 0.0, 0.0],
        "LSODA",
        run.time.values,
        rtol=1e-9,
        atol=1e-14,
        max_step=2e-8,
    )
    moved = run.displacement.sel(bead=1).values
    assert abs(moved - exact.y[2]).max() < 1e-3 * moved.max()


def test_runs_that_would_not_end_are_refused() -> None:
    with pytest.raises(ValueError, match=r"dt = 1e-16: takes .* steps in 0\.0001 s; must take fewer"):
        hl.CoSimulation(uniform(), hl.half_space(hl.STEEL_440C), dt=1e-16).run(until=1e-4)
    for loss in (hl.LinearDashpot(1e30), hl.MassProportional(1e15)):
        with pytest.raises(ValueError, match=r"dissipation = .* must take fewer"):
            hl.CoSimulation(uniform(dissipation=loss), hl.half_space(hl.STEEL_440C)).run(until=1e-4)
