"""Loss laws against collision theory: energy, momentum, restitution and powers of the speed, orders, bad input."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import beta

import hertzlink as hl
from particles.dissipation import Dissipation
from particles.moving import ChainState

STEEL = hl.Sphere(2.38e-3, hl.STEEL_316)
SMALL, LARGE = hl.Sphere(2e-3, hl.BRASS_360), hl.Sphere(6e-3, hl.PTFE)

beads = st.builds(
    hl.Sphere,
    radius=st.floats(1e-3, 2e-2),
    material=st.sampled_from([hl.STEEL_440C, hl.BRASS_360, hl.PTFE, hl.ALUMINIUM_6061]),
)
rows = st.lists(beads, min_size=1, max_size=6)
pairwise = st.one_of(
    st.builds(hl.LinearDashpot, st.floats(0.0, 20.0)),
    st.builds(hl.PowerDashpot, st.floats(0.0, 10.0), st.floats(1.0, 3.0)),
    st.builds(hl.KuwabaraKono, st.floats(0.0, 1e-5)),
    st.builds(hl.Tsuji, st.floats(0.0, 2.0)),
    st.builds(hl.Restitution, st.floats(0.1, 1.0)),
)
laws = st.one_of(
    pairwise,
    st.builds(hl.PowerDashpot, st.floats(0.0, 10.0), st.floats(1.0, 3.0), st.just("thesis")),
    st.builds(hl.MassProportional, st.floats(0.0, 1e4)),
)


@pytest.mark.thorough
@settings(max_examples=60)
@given(rows, beads, st.floats(0.05, 2.0), laws, st.sampled_from([0.0, 9.81]))
def test_every_law_takes_energy_and_never_pulls(
    row: list[hl.Sphere], striker: hl.Sphere, speed: float, law: Dissipation, gravity: float
) -> None:
    chain = hl.Chain(row, striker, speed, gravity, law)
    simulation = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C))
    run = simulation.run(until=10.0 * simulation.chain.contact_time)
    energy = (run.kinetic_energy + run.contact_energy).values
    assert np.all(np.diff(energy) <= 1e-6 * chain.impact_energy)
    assert np.all(np.diff(run.dissipated_energy.values) >= 0.0)
    assert np.all(run.contact_force.values >= 0.0)
    assert hl.energy_error(run) < 1e-4


@settings(max_examples=40)
@given(rows, beads, st.floats(0.05, 2.0), pairwise)
def test_losses_between_beads_keep_momentum(
    row: list[hl.Sphere], striker: hl.Sphere, speed: float, law: Dissipation
) -> None:
    simulation = hl.CoSimulation(hl.Chain(row, striker, speed, dissipation=law), None)
    run = simulation.run(until=10.0 * simulation.chain.contact_time)
    assert momentum(simulation, run) == pytest.approx(np.full(run.time.size, striker.mass * speed), rel=1e-12)


def momentum(simulation: hl.CoSimulation, run: object) -> NDArray[np.float64]:
    total: NDArray[np.float64] = (simulation.chain.mass * run.velocity.values).sum(axis=1)  # type: ignore[attr-defined]
    return total


def test_a_drag_takes_momentum_as_an_exponential() -> None:
    chain = hl.Chain([LARGE, SMALL, STEEL], STEEL, 0.5, dissipation=hl.MassProportional(6900.0))
    simulation = hl.CoSimulation(chain, None)
    run = simulation.run(until=3e-4)
    expected = STEEL.mass * 0.5 * np.exp(-6900.0 * run.time.values)
    assert momentum(simulation, run) == pytest.approx(expected, rel=1e-6)


@pytest.mark.thorough
def test_the_thesis_form_takes_momentum_unless_it_is_linear() -> None:
    """Approach rates 2 and 1 m/s on three beads that just touch: forces −2^α, +1, +1 times γ, so 2 − 2^α in sum."""
    window = 1e-12
    for exponent in (1.0, 1.81, 2.5):
        chain = hl.Chain([STEEL] * 2, STEEL, 3.0, dissipation=hl.PowerDashpot(5.58, exponent, "thesis"))
        moving = hl.stepping.MovingChain(chain, None)
        state, _ = moving.advance(ChainState(np.zeros(3), np.array([3.0, 1.0, 0.0])), (0.0, 0.0), window)
        push = STEEL.mass * (state.velocity - [3.0, 1.0, 0.0]) / window
        assert push == pytest.approx(5.58 * np.array([-(2.0**exponent), 1.0, 1.0]), rel=1e-4)
        assert push.sum() == pytest.approx(5.58 * (2.0 - 2.0**exponent), abs=1e-3)


def test_the_thesis_form_is_left_out_where_it_would_feed_energy() -> None:
    """Approach rates 1 and 2 m/s on beads at 10 m/s and more: forces −1, −1, 2^α times γ push them on."""
    chain = hl.Chain([STEEL] * 2, STEEL, 3.0, dissipation=hl.PowerDashpot(5.58, 1.81, "thesis"))
    start = np.array([13.0, 12.0, 10.0])
    state, _ = hl.stepping.MovingChain(chain, None).advance(ChainState(np.zeros(3), start), (0.0, 0.0), 1e-12)
    assert state.velocity == pytest.approx(start, rel=1e-14)
    assert state.lost == 0.0


def rebound(striker: hl.Sphere, bead: hl.Sphere, speed: float, law: Dissipation, contact: object = None) -> float:
    """Rebound over approach speed of two free spheres."""
    simulation = hl.CoSimulation(hl.Chain([bead], striker, speed, dissipation=law, law=contact), None)  # type: ignore[arg-type]
    run = simulation.run(until=6.0 * simulation.chain.contact_time)
    assert run.contact_force.values[-1, 0] == 0.0
    first, second = run.velocity.values[-1]
    return float(second - first) / speed


@pytest.mark.parametrize("wanted", [1.0, 0.95, 0.6, 0.2, 0.05])
@pytest.mark.parametrize(("striker", "bead"), [(STEEL, STEEL), (SMALL, LARGE), (LARGE, SMALL)])
def test_restitution_holds_at_any_speed_and_mass(striker: hl.Sphere, bead: hl.Sphere, wanted: float) -> None:
    for speed in (0.01, 0.3, 5.0):
        assert rebound(striker, bead, speed, hl.Restitution(wanted)) == pytest.approx(wanted, rel=1e-3)


@pytest.mark.parametrize("coefficient", [0.05, 0.5, 1.5])
def test_tsujis_coefficient_gives_antypovs_restitution(coefficient: float) -> None:
    """α = √5 ζ, and e = exp(−2θ/tan θ) with cos θ = ζ (Antypov and Elliott, EPL 94 (2011) 50004)."""
    angle = np.arccos(coefficient / np.sqrt(5.0))
    expected = np.exp(-2.0 * angle / np.tan(angle))
    assert rebound(SMALL, LARGE, 0.3, hl.Tsuji(coefficient)) == pytest.approx(expected, rel=1e-3)


def reduced(striker: hl.Sphere, bead: hl.Sphere) -> tuple[float, float]:
    """Reduced mass and stiffness."""
    mass = striker.mass * bead.mass / (striker.mass + bead.mass)
    return mass, hl.theory.hertz_stiffness(striker.surface, bead.surface)


def test_kuwabara_and_kono_lose_more_at_higher_speed() -> None:
    """1 − e = 1.15344 (3/2) τ (k/m)^{2/5} v^{1/5} for small losses (Ramírez et al., Phys. Rev. E 60 (1999) 4465)."""
    mass, stiffness = reduced(SMALL, LARGE)
    for time in (1e-9, 4e-9):
        for speed in (0.02, 2.0):
            lost = 1.0 - rebound(SMALL, LARGE, speed, hl.KuwabaraKono(time))
            expected = 1.15344 * 1.5 * time * (stiffness / mass) ** 0.4 * speed**0.2
            assert lost == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("exponent", [1.5, 1.81, 2.0])
def test_a_power_dashpot_loses_as_its_exponent_says(exponent: float) -> None:
    """1 − e = (4/5) B(2/5, 1 + α/2) γ v^{α−2} δ/m for small losses, so v^{α−6/5}."""
    mass, stiffness = reduced(SMALL, LARGE)
    for speed in (0.02, 2.0):
        deepest = (1.25 * mass * speed**2 / stiffness) ** 0.4
        lost = 1.0 - rebound(SMALL, LARGE, speed, hl.PowerDashpot(1e-3, exponent))
        expected = 0.8 * beta(0.4, 1.0 + exponent / 2.0) * 1e-3 * speed ** (exponent - 2.0) * deepest / mass
        assert lost == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    "law",
    [
        hl.LinearDashpot(4.0), hl.PowerDashpot(5.58, 1.81), hl.PowerDashpot(50.0, 2.5, "thesis"),
        hl.MassProportional(6900.0), hl.KuwabaraKono(1e-6), hl.Tsuji(0.3), hl.Restitution(0.7),
    ],
)  # fmt: skip
def test_order_two(law: Dissipation) -> None:
    """A preloaded chain that a wave runs through: all contacts stay closed, so every law is smooth."""

    def advanced(dt: float) -> NDArray[np.float64]:
        moving = hl.stepping.MovingChain(hl.Chain([STEEL] * 6, STEEL, 1e-3, 981.0, law), STEEL.surface, dt=dt)
        closed, _ = hl.stepping.MovingChain(moving.chain, STEEL.surface, dt=1e-8).advance(
            moving.start(), (0.0, 0.0), 1.5e-5
        )
        state, _ = moving.advance(closed, (0.0, 0.0), 1.6e-5)
        return state.position - moving.rest

    finest = advanced(5e-9)
    errors = [abs(advanced(dt) - finest).max() for dt in (4e-7, 2e-7, 1e-7)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.2)


@pytest.mark.parametrize(("mass", "coefficient"), [(1e-2, 5e3), (1e-3, 2e3)])
def test_a_force_that_jumps_as_a_contact_opens_creates_no_energy(mass: float, coefficient: float) -> None:
    """No mean force of a window is that of a bead with so strong a dashpot on so light a body: it has to be halved."""
    light = hl.Structure(np.diag([mass * STEEL.mass]), np.diag([1e5]), None, np.ones(1), 0.0, STEEL.surface)
    simulation = hl.CoSimulation(hl.Chain([STEEL], STEEL, 0.3, dissipation=hl.LinearDashpot(coefficient)), light)
    run = simulation.run(4e-5)
    assert run.windows.sum() > simulation.plan(4e-5).total
    assert hl.energy_error(run) < 1e-4
