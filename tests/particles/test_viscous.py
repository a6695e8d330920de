"""Losses inside deformable beads: closed forms of one mode, limits, orders, energy, collisions, bad input."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import hertzlink as hl
from particles.deformable.deformable_chain import MovingDeformableChain
from particles.deformable.vibration import vibration
from particles.kernels.motion import WORK_ROWS, energies_of_chain
from particles.laws.axisymmetric import computed_law
from particles.moving import ChainState

BEAD = hl.Sphere(4.76e-3, hl.PTFE)
SURFACE = hl.Surface(hl.STEEL_316)
LOSSES = {"modal": hl.damping.Modal(0.03), "Rayleigh": hl.damping.Rayleigh(2e3, 1e-7)}
LAW = hl.contact_law(BEAD, BEAD)


def chain(loss: Any = None, count: int = 3, modes: int = 3, **more: Any) -> hl.DeformableChain:
    return hl.DeformableChain([BEAD] * count, BEAD, 0.3, modes=modes, law=hl.contact_law, damping=loss, **more)


def free_mode(loss: hl.damping.Viscous, until: float, steps: int) -> tuple[complex, float]:
    """Amplitude q + i q′/ω of a bead's lowest mode that swings freely from 1 nm √kg; and the energy's error.

    The beads are too far apart to touch.
    """
    made = chain(loss)
    side = MovingDeformableChain(made, SURFACE, dt=until / steps)
    bodies, elastic = side.mass.size, made.modes - 1
    position, velocity = np.zeros_like(side.rest), np.zeros_like(side.rest)
    position[:bodies] = 1e-3 * (np.arange(bodies) - bodies)
    first = bodies + elastic  # of bead 1
    position[first] = 1e-9
    state = ChainState(position, velocity)
    stored = [float(sum(_energies(side, state)))]
    state, _ = side.advance(state, (0.0, 0.0), until)
    stored.append(float(sum(_energies(side, state))))
    rate = state.velocity[first] / float(vibration(BEAD, 1).frequencies[0])
    return complex(state.position[first], rate), abs(stored[0] - stored[1] - state.lost) / stored[0]


def _energies(side: MovingDeformableChain, state: ChainState) -> tuple[float, float]:
    work = np.zeros((WORK_ROWS, state.position.size))
    kinetic, potential = energies_of_chain(side.model, 0, state.position, state.velocity, 0.0, work)
    return float(kinetic), float(potential)


def exact(loss: hl.damping.Viscous, until: float) -> complex:
    """The same by the exponential of a matrix, which knows no steps."""
    frequency = vibration(BEAD, 2).frequencies[:1]
    omega, rate = float(frequency[0]), float(loss.of_modes(frequency)[0])
    end = expm(np.array([[0.0, 1.0], [-(omega**2), -rate]]) * until) @ np.array([1e-9, 0.0])
    return complex(end[0], end[1] / omega)


@pytest.mark.parametrize("name", LOSSES)
def test_a_mode_swings_as_the_exponential_says(name: str) -> None:
    until = 5.0 * 2.0 * np.pi / float(vibration(BEAD, 1).frequencies[0])
    errors = [
        abs(free_mode(LOSSES[name], until, steps)[0] - exact(LOSSES[name], until)) / 1e-9 for steps in (800, 1600)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert errors[1] < 1e-3


def test_a_damping_ratio_is_that_of_the_logarithmic_decrement() -> None:
    """A mode falls by e^(−2πζ/√(1 − ζ²)) in a period."""
    frequency = float(vibration(BEAD, 1).frequencies[0])
    period = 2.0 * np.pi / (frequency * np.sqrt(1.0 - 0.03**2))
    after = free_mode(LOSSES["modal"], 5.0 * period, 4000)[0].real
    assert np.log(1e-9 / after) / 5.0 == pytest.approx(2.0 * np.pi * 0.03 / np.sqrt(1.0 - 0.03**2), rel=1e-3)


@pytest.mark.parametrize("name", LOSSES)
def test_energy_that_is_lost_is_counted(name: str) -> None:
    until = 5.0 * 2.0 * np.pi / float(vibration(BEAD, 1).frequencies[0])
    errors = [free_mode(LOSSES[name], until, steps)[1] for steps in (400, 800)]
    assert errors[1] < 1e-3
    assert np.log2(errors[0] / errors[1]) > 1.7


@pytest.mark.thorough
@pytest.mark.parametrize("name", LOSSES)
def test_energy_and_momentum_of_a_wave(name: str) -> None:
    run = hl.CoSimulation(chain(LOSSES[name], count=6), hl.half_space(hl.STEEL_316)).run(until=4e-4)
    assert abs(hl.energy_error(run)) < 1e-4
    lost = run.dissipated_energy.values
    assert (np.diff(lost) >= -1e-12 * lost[-1]).all()
    assert lost[-1] > 0.0


@pytest.mark.thorough
def test_a_loss_of_your_own() -> None:
    class Constant(hl.damping.Viscous):
        def of_modes(self, frequencies: Any) -> Any:
            return np.full_like(frequencies, 5e3)

    run = hl.CoSimulation(chain(Constant()), None).run(until=2e-4)
    same = hl.CoSimulation(chain(hl.damping.Rayleigh(5e3)), None).run(until=2e-4)
    assert np.array_equal(run.velocity, same.velocity)


@pytest.mark.thorough
def test_a_loss_in_proportion_to_the_stiffness_is_that_of_the_whole_bead() -> None:
    """Slow beads follow their loads; then modes and contacts with the same time lose what one viscoelastic law does."""
    law = computed_law(BEAD, max_force=10.0)
    more: dict[str, Any] = {"law": lambda one, other: law, "dissipation": hl.KuwabaraKono(5e-7)}
    beads = hl.DeformableChain([BEAD], BEAD, 0.02, modes=4, damping=hl.damping.Rayleigh(0.0, 5e-7), **more)
    bare = hl.DeformableChain([BEAD], BEAD, 0.02, modes=4, **more)
    point = hl.Chain([BEAD], BEAD, 0.02, **more)
    lost = [float(hl.CoSimulation(one, None).run(until=8e-4).dissipated_energy[-1]) for one in (beads, bare, point)]
    assert lost[0] == pytest.approx(lost[2], rel=5e-3)
    assert lost[1] < 0.992 * lost[2]


BAD = [
    (lambda: hl.damping.Modal(-0.1), "ratio = -0.1"),
    (lambda: chain(hl.damping.Modal(1.0)), "ratio = 1.0: must be below 1 in beads"),
    (lambda: hl.damping.Modal(np.nan), "ratio = nan: must be a finite number"),
    (lambda: hl.damping.Rayleigh(-1.0), "mass_rate = -1.0"),
    (lambda: hl.damping.Rayleigh(0.0, -1e-6), "stiffness_time"),
    (lambda: chain(hl.damping.StandardLinearSolid(0.4, 4e-6)), "damping = Standard.*: .* acts on structures only"),
    (lambda: chain(0.02), "damping = 0.02: must be"),
    (lambda: hl.DeformableChain([BEAD] * 3, BEAD, 0.3, modes=1, damping=hl.damping.Modal(0.1)), "modes = 1"),
    (lambda: chain(lambda bead: 0.1), "damping = <function .*must be"),
]


@pytest.mark.parametrize(("call", "message"), BAD)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
