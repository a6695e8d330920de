"""Chains that face a structure with both ends, or start by themselves: mirrors, closed forms, ledgers, orders."""

from collections.abc import Callable
from math import pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

import hertzlink as hl
from hertzlink.stepping import MovingChain
from particles.dissipation import Dissipation
from particles.kernels import motion as kernels
from particles.moving import ChainState
from structures.surface import hertz_stiffness

Vector = NDArray[np.float64]
Motion = Callable[[float], Vector]
"""Displacements (m) of the two surfaces over time (s), the last end's first."""

STEEL = hl.STEEL_316
BEAD = hl.Sphere(2.38e-3, STEEL)
LARGE = hl.Sphere(4.76e-3, hl.BRASS_360)
FLAT, SOFT = hl.Surface(STEEL), hl.Surface(hl.PTFE)
CURVED = hl.Surface(STEEL, 1.0 / BEAD.radius)
"""As curved as the bead, so that it is pressed like a bead."""

LOSSES = [None, hl.Restitution(0.9)]
"""Time of Hertz's collision over deepest approach and speed (Johnson, Contact Mechanics, section 11.4): 2.94."""


def still(time: float) -> Vector:
    return np.zeros(2)


def waving(time: float) -> Vector:
    """Both surfaces move by a few micrometres, and not equally."""
    return np.array([2e-6 * np.sin(3e4 * time), -3e-6 * np.sin(5e4 * time)])


def run(
    moving: MovingChain, motion: Motion, window: float, count: int, state: ChainState | None = None
) -> tuple[list[ChainState], Vector]:
    """States at all windows' ends, the start first, and the mean forces of all windows."""
    states, forces = [state or moving.start()], []
    for i in range(count):
        state, force = moving.advance(states[-1], (motion(i * window), motion((i + 1) * window)), window)
        states.append(state)
        forces.append(force)
    return states, np.array(forces)


def energy(moving: MovingChain, state: ChainState, surfaces: Vector) -> float:
    work = np.zeros((kernels.WORK_ROWS, state.position.size))
    return float(sum(kernels.energies_of_chain(moving.model, 0, state.position, state.velocity, surfaces[0], work)))


def moving_chain(
    chain: hl.Chain, dt: float | None = 2e-8, flexibilities: tuple[float, float] = (0.0, 0.0)
) -> MovingChain:
    return MovingChain(chain, SOFT, flexibilities[0], dt, FLAT, flexibilities[1])


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("flexibilities", [(0.0, 0.0), (2e-9, 5e-8), (-1e-9, -1e-9)])
def test_moving_walls_do_the_work_that_the_chain_gets(
    loss: Dissipation | None, flexibilities: tuple[float, float]
) -> None:
    """Work is mean force times distance on both surfaces, with static forces; momentum is the impulse of both."""
    chain = hl.Chain([BEAD, LARGE, BEAD], None, 0.3, preload=2.0, dissipation=loss)
    moving = moving_chain(chain, 5e-9, flexibilities)
    window = 1e-6
    states, forces = run(moving, waving, window, 200)
    total = forces + moving.static_force[[-1, 0]]
    ways = np.array([waving((i + 1) * window) - waving(i * window) for i in range(200)])
    given_away = (total * ways).sum(axis=1).cumsum()
    balance = [energy(moving, state, waving(i * window)) + state.lost for i, state in enumerate(states)]
    assert abs(given_away).max() > 0.05 * chain.impact_energy
    assert balance[1:] + given_away == pytest.approx(np.full(200, balance[0]), abs=2e-6 * chain.impact_energy)
    momentum = np.array([(moving.mass[1:] * state.velocity[1:]).sum() for state in states])
    impulse = window * (total[:, 1] - total[:, 0])
    assert np.diff(momentum) == pytest.approx(impulse, abs=1e-12 * momentum[0])
    assert all(state.driven == 0.0 for state in states)


beads = st.builds(
    hl.Sphere, radius=st.floats(1e-3, 1e-2), material=st.sampled_from([STEEL, hl.BRASS_360, hl.PTFE, hl.ALUMINIUM_6061])
)
surfaces = st.builds(hl.Surface, st.sampled_from([STEEL, hl.PTFE, hl.ALUMINIUM_6061]), st.floats(0.0, 100.0))
losses = st.one_of(
    st.none(), st.builds(hl.LinearDashpot, st.floats(0.1, 5.0)), st.builds(hl.Restitution, st.floats(0.5, 1.0)),
    st.builds(hl.KuwabaraKono, st.floats(1e-7, 1e-6)),
    st.builds(hl.PowerDashpot, st.floats(0.1, 2.0), st.just(1.5)),
    st.builds(hl.MassProportional, st.floats(1.0, 1e4)),
)  # fmt: skip


@settings(max_examples=60)
@given(
    st.lists(st.tuples(beads, st.floats(-1.0, 1.0)), min_size=1, max_size=5),
    st.tuples(surfaces, surfaces),
    st.tuples(st.floats(-1e-10, 1e-7), st.floats(-1e-10, 1e-7)),
    losses,
    st.sampled_from([0.0, 3.0]),
)
def test_a_chain_turned_around_moves_as_its_mirror_image(
    row: list[tuple[hl.Sphere, float]], walls: tuple[hl.Surface, hl.Surface], flexibilities: tuple[float, float],
    loss: Dissipation | None, preload: float,
) -> None:  # fmt: skip
    ends = []
    for turned in (False, True):
        order = row[::-1] if turned else row
        (last, behind), (spring, spring_behind) = ((pair[::-1] if turned else pair) for pair in (walls, flexibilities))
        chain = hl.Chain([bead for bead, _ in order], None, 0.3, 0.0, loss, preload)
        moving = MovingChain(chain, last, spring, 5e-8, behind, spring_behind)
        start = moving.start()
        speeds = np.array([0.0, *(speed for _, speed in order)]) * (-1.0 if turned else 1.0)
        path: Motion = (lambda time: waving(time)[::-1]) if turned else waving
        states, forces = run(moving, path, 1e-6, 100, start._replace(velocity=speeds))
        ends.append((states[-1].position[1:] - moving.rest[1:], states[-1].velocity[1:], forces, states[-1].lost))
    (place, velocity, forces, lost), (place_too, velocity_too, forces_too, lost_too) = ends
    assert place_too[::-1] == pytest.approx(-place, abs=1e-13)
    assert velocity_too[::-1] == pytest.approx(-velocity, abs=1e-8)
    assert forces_too[:, ::-1] == pytest.approx(forces, abs=1e-7 * abs(forces).max())
    assert lost_too == pytest.approx(lost, rel=1e-8)


@pytest.mark.parametrize("mode", [1, 3, 5])
def test_modes_of_a_preloaded_chain_between_two_walls(mode: int) -> None:
    """ω = 2√(k_t/m) sin(jπ/(2(N + 1))) with k_t = 3/2 k^(2/3) F₀^(1/3): a mode swings back after its period."""
    count, preload = 5, 20.0
    chain = hl.Chain([BEAD] * count, None, preload=preload)
    moving = MovingChain(chain, CURVED, behind=CURVED)
    stiffness = 1.5 * hertz_stiffness(BEAD.surface, BEAD.surface) ** (2 / 3) * preload ** (1 / 3)
    period = 2.0 * pi / (2.0 * (stiffness / BEAD.mass) ** 0.5 * np.sin(mode * pi / (2.0 * (count + 1))))
    shape = 1e-12 * np.sin(mode * pi * np.arange(count + 1) / (count + 1))
    start = moving.start()
    states, _ = run(moving, still, period / 8.0, 8, start._replace(position=moving.rest + shape))
    found = [(state.position - moving.rest) @ shape / (shape @ shape) for state in states]
    assert found == pytest.approx(np.cos(2.0 * pi * np.arange(9) / 8.0), abs=2e-4)


@pytest.mark.parametrize("loss", [None, hl.KuwabaraKono(1e-6)])
def test_order_two_between_moving_walls(loss: Dissipation | None) -> None:
    """All contacts stay closed, so that forces are smooth; springs behind both ends; one window."""

    def after(dt: float) -> Vector:
        chain = hl.Chain([BEAD] * 4, None, 1e-2, preload=20.0, dissipation=loss)
        moving = moving_chain(chain, dt, (1e-8, 2e-8))
        states, forces = run(moving, lambda time: np.array([0.03, -0.02]) * time, 2e-5, 1)
        return np.concatenate([states[-1].position[1:] - moving.rest[1:], forces[0] * 1e-8])

    exact = after(1e-8)
    errors = [abs(after(dt) - exact).max() for dt in (5e-7, 2.5e-7, 1.25e-7)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.2)
