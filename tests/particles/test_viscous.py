"""Losses inside deformable beads: closed forms of one mode, limits, orders, energy, collisions, bad input."""

from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import hertzlink as hl
from particles.bead import Bead
from particles.deformable.deformable_chain import MovingDeformableChain, moving_chain
from particles.deformable.vibration import Vibration, vibration
from particles.kernels.motion import energies_of_chain
from particles.laws.axisymmetric import computed_law
from particles.moving import ChainState
from structures.damping import ModeLoss

BEAD = hl.Sphere(4.76e-3, hl.PTFE)
SURFACE = hl.Surface(hl.STEEL_316)
LOSSES = {
    "modal": hl.damping.Modal(0.03),
    "Rayleigh": hl.damping.Rayleigh(2e3, 1e-7),
    "relaxed": hl.damping.StandardLinearSolid(0.4, 4e-6),
    "instantaneous": hl.damping.StandardLinearSolid(0.4, 4e-6, "instantaneous"),
}
LAW = hl.contact_law(BEAD, BEAD)


def soft(one: Any, other: Any) -> Any:
    """Hertz's law, which modes need not share."""
    return hl.contact_law(one, other)


def stiff(bead: Bead, count: int) -> Vibration:
    """The bead's own modes, which take no part of a contact's flexibility."""
    own = vibration(bead, count)
    return Vibration(own.frequencies, own.struck, own.far, 0.0, 0.0, own.section)


def chain(loss: Any = None, count: int = 3, modes: int = 3, **more: Any) -> hl.DeformableChain:
    return hl.DeformableChain([BEAD] * count, BEAD, 0.3, modes=modes, law=soft, vibrations=stiff, damping=loss, **more)


def free_mode(loss: hl.damping.Viscous, until: float, steps: int) -> tuple[complex, float]:
    """Amplitude q + i q′/ω of a bead's lowest mode that swings freely from 1 nm √kg with its arm at rest; and the
    energy's error.

    The beads are too far apart to touch.
    """
    made = chain(loss)
    side = MovingDeformableChain(made, SURFACE, dt=until / steps)
    bodies, elastic = side.mass.size, made.modes - 1
    position, velocity = np.zeros_like(side.rest), np.zeros_like(side.rest)
    position[:bodies] = 1e-3 * (np.arange(bodies) - bodies)
    first = bodies + elastic  # of bead 1
    position[first] = 1e-9
    if side.vibrations.arm.size:
        velocity[first + bodies * elastic] = 1e-9 * side.vibrations.relaxation[1, 0]
    state = ChainState(position, velocity)
    stored = [float(sum(_energies(side, state)))]
    state, _ = side.advance(state, (0.0, 0.0), until)
    stored.append(float(sum(_energies(side, state))))
    rate = state.velocity[first] / float(vibration(BEAD, 1).frequencies[0])
    return complex(state.position[first], rate), abs(stored[0] - stored[1] - state.lost) / stored[0]


def _energies(side: MovingDeformableChain, state: ChainState) -> tuple[float, float]:
    kinetic, potential = energies_of_chain(side.model, 0, state.position, state.velocity, 0.0, side.work_space())
    return float(kinetic), float(potential)


def exact(loss: hl.damping.Viscous, until: float) -> complex:
    """The same by the exponential of a matrix, which knows neither steps nor differentiated arms."""
    given = loss.of_modes(vibration(BEAD, 2).frequencies)
    square, rate, arm, relaxation = (float(one[0]) for one in given)
    matrix = np.array([[0.0, 1.0, 0.0], [-square - arm, -rate, arm], [relaxation, 0.0, -relaxation]])
    end = expm(matrix * until) @ np.array([1e-9, 0.0, 0.0])
    return complex(end[0], end[1] / float(vibration(BEAD, 1).frequencies[0]))


@pytest.mark.parametrize("name", LOSSES)
def test_a_mode_swings_as_the_exponential_says(name: str) -> None:
    until = 5.0 * 2.0 * np.pi / float(vibration(BEAD, 1).frequencies[0])
    errors = [
        abs(free_mode(LOSSES[name], until, steps)[0] - exact(LOSSES[name], until)) / 1e-9 for steps in (800, 1600)
    ]
    assert np.log2(errors[0] / errors[1]) == pytest.approx(2.0, abs=0.2)
    assert errors[1] < 1e-3


@pytest.mark.parametrize("name", LOSSES)
def test_energy_that_is_lost_is_counted(name: str) -> None:
    until = 5.0 * 2.0 * np.pi / float(vibration(BEAD, 1).frequencies[0])
    errors = [free_mode(LOSSES[name], until, steps)[1] for steps in (400, 800)]
    assert errors[1] < 1e-3
    assert np.log2(errors[0] / errors[1]) > 1.7


def test_modal_damping_has_the_logarithmic_decrement_of_textbooks() -> None:
    omega = float(vibration(BEAD, 1).frequencies[0])
    period = 2.0 * np.pi / (omega * np.sqrt(1.0 - 0.03**2))
    first, second = (free_mode(LOSSES["modal"], n * period, 8000 * n)[0].real for n in (1, 2))
    assert np.log(first / second) == pytest.approx(2.0 * np.pi * 0.03 / np.sqrt(1.0 - 0.03**2), rel=1e-5)


def test_no_loss_is_the_lossless_chain() -> None:
    runs = [
        hl.CoSimulation(chain(loss), hl.half_space(hl.STEEL_316)).run(until=2e-4)
        for loss in (None, hl.damping.Modal(0.0), lambda bead: None)
    ]
    for run in runs[1:]:
        for name in runs[0].data_vars:
            assert np.array_equal(run[name], runs[0][name], equal_nan=True), name


@pytest.mark.parametrize(
    ("time", "modulus", "factor"),
    [
        (1e-3, "relaxed", 1.2),
        (1e-3, "instantaneous", 1.0),
        (2e-9, "instantaneous", 0.8),
        pytest.param(2e-9, "relaxed", 1.0, marks=pytest.mark.thorough),
    ],
)
def test_an_arm_slower_or_faster_than_the_wave_is_a_spring_or_nothing(time: float, modulus: str, factor: float) -> None:
    """Slower than all vibrations an arm keeps the modulus of sudden loads, faster than all that of slow ones."""

    def harder(bead: Bead, count: int) -> Vibration:
        own = stiff(bead, count)
        return Vibration(np.sqrt(factor) * own.frequencies, *(getattr(own, n) for n in Vibration.__match_args__[1:]))

    made = chain(hl.damping.StandardLinearSolid(0.2, time, modulus), count=2, modes=2)
    limit = hl.DeformableChain([BEAD] * 2, BEAD, 0.3, modes=2, law=soft, vibrations=harder)
    runs = [hl.CoSimulation(one, hl.half_space(hl.STEEL_316)).run(until=1.5e-4) for one in (made, limit)]
    for name, share in (("contact_force", 5e-3), ("vibration_energy", 2e-2)):
        one, other = (run[name].values for run in runs)
        assert np.abs(one - other).max() < share * other.max()


@pytest.mark.parametrize("name", ["modal", "relaxed"])
def test_the_force_through_a_section_is_the_momentum_of_a_half(name: str) -> None:
    """By differences of the saved amplitudes, which know of no loss."""
    strong = {"modal": hl.damping.Modal(0.3), "relaxed": hl.damping.StandardLinearSolid(1.0, 4e-6)}[name]
    run = hl.CoSimulation(chain(strong), None).run(until=1.2e-4, save_every=2e-8)
    amplitude, section = run.vibration_amplitude.values[:, 1], stiff(BEAD, 2).section
    step = float(run.time[1] - run.time[0])
    acceleration = (amplitude[2:] - 2.0 * amplitude[1:-1] + amplitude[:-2]) / step**2
    mean = 0.5 * (run.contact_force.values[1:-1, 0] + run.contact_force.values[1:-1, 1])
    expected = mean - acceleration @ section
    found = run.section_force.values[1:-1, 1]
    assert np.abs(found - expected).max() < 1e-3 * expected.max()


@pytest.mark.parametrize("name", LOSSES)
def test_energy_and_momentum_of_a_wave(name: str) -> None:
    run = hl.CoSimulation(chain(LOSSES[name], count=6), hl.half_space(hl.STEEL_316)).run(until=4e-4)
    assert abs(hl.energy_error(run)) < 1e-4
    lost = run.dissipated_energy.values
    assert (np.diff(lost) >= -1e-12 * lost[-1]).all()
    assert lost[-1] > 0.0


@pytest.mark.parametrize("name", ["modal", "relaxed"])
def test_in_a_batch_it_moves_by_the_same_bits(name: str) -> None:
    rod = hl.reduce(hl.rod([hl.Layer(hl.PTFE, 30e-3, 5e-3)]), until=4e-4)
    simulation = hl.CoSimulation(chain(LOSSES[name]), rod)
    alone = hl.batch([simulation], until=3e-4)
    both = hl.batch([simulation, hl.CoSimulation(chain(None), rod)], until=3e-4)
    for variable in alone.data_vars:
        assert both[variable].isel(run=0).equals(alone[variable].isel(run=0))


def test_static_rest_is_that_of_relaxed_beads() -> None:
    """Under gravity nothing moves: the arms are relaxed."""
    made = hl.DeformableChain([BEAD] * 3, None, 0.0, modes=3, gravity=9.81, law=soft, vibrations=stiff,
                              damping=LOSSES["relaxed"])  # fmt: skip
    side = moving_chain(made, SURFACE)
    state = side.start()
    state = state._replace(velocity=np.zeros_like(state.velocity))
    after, force = side.advance(state, (0.0, 0.0), 1e-4)
    assert after.position == pytest.approx(state.position, rel=1e-8, abs=1e-16)
    assert abs(force) < 1e-8 * float(side.static_force[-1])


def test_each_bead_may_have_its_own() -> None:
    steel = hl.Sphere(4.76e-3, hl.STEEL_440C)

    def of(bead: Bead) -> Any:
        return LOSSES["modal"] if bead == BEAD else None

    mixed = hl.DeformableChain([steel, BEAD, steel], steel, 0.3, modes=3, law=soft, vibrations=stiff, damping=of)
    rate = moving_chain(mixed, SURFACE).vibrations.rate  # type: ignore[union-attr]
    assert (rate[2] > 0.0).all()
    assert not rate[[0, 1, 3]].any()


def test_a_loss_of_your_own() -> None:
    class Constant(hl.damping.Viscous):
        def of_modes(self, frequencies: Any) -> ModeLoss:
            none = np.zeros_like(frequencies)
            return ModeLoss(frequencies**2, none + 5e3, none, none)

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


@pytest.mark.thorough
def test_a_relaxation_time_is_identified() -> None:
    """From the force at two beads, with noise, the modulus that relaxes is within its interval."""

    def build(share: float) -> hl.CoSimulation:
        loss = hl.damping.StandardLinearSolid(share, 2e-5)
        return hl.CoSimulation(hl.DeformableChain([BEAD] * 12, BEAD, 0.3, modes=3, damping=loss), None)

    run = build(0.3).run(until=1.4e-3)
    time, noise = run.time.values, np.random.default_rng(3)
    traces = {n: hl.sensor_force(run, n).values + noise.normal(0.0, 0.02, time.size) for n in (5, 10)}
    signal = hl.as_signal(time, traces)
    found = hl.identify(signal, build, ["time_zero"], until=1.4e-3, noise=0.02, share=(0.05, 0.8))
    assert found["share"].value == pytest.approx(0.3, abs=3.3 / 1.96 * found["share"].error)
    assert found["share"].error < 0.1


BAD = [
    (lambda: hl.damping.Modal(-0.1), "ratio = -0.1"),
    (lambda: chain(hl.damping.Modal(1.0)), "ratio = 1.0: must be below 1 in beads"),
    (lambda: hl.damping.Modal(np.nan), "ratio = nan: must be a finite number"),
    (lambda: hl.damping.Rayleigh(-1.0), "mass_rate = -1.0"),
    (lambda: hl.damping.Rayleigh(0.0, -1e-6), "stiffness_time"),
    (lambda: hl.damping.StandardLinearSolid(0.0, 1e-6), "share"),
    (lambda: hl.damping.StandardLinearSolid(0.1, 0.0), "time"),
    (lambda: hl.damping.StandardLinearSolid(1.0, 1e-6, "instantaneous"), "share = 1.0: must be below 1"),
    (lambda: hl.damping.StandardLinearSolid(0.1, 1e-6, "slow"), "modulus"),
    (lambda: chain(0.02), "damping = 0.02: must be"),
    (lambda: hl.DeformableChain([BEAD] * 3, BEAD, 0.3, modes=1, damping=hl.damping.Modal(0.1)), "modes = 1"),
    (lambda: hl.CoSimulation(chain(lambda bead: 0.1), None), "damping: gives 0.1"),
]


@pytest.mark.parametrize(("call", "message"), BAD)
def test_bad_input(call: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()
