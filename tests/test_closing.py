"""Cracks that close: d'Alembert's solution, the bilinear oscillator, the bonded and the cut rod, and the energy."""

import dataclasses
from functools import cache
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid
from scipy.optimize import nnls

import hertzlink as hl
from coupling.run_loop import is_compiled
from hertzlink.conformance import checks
from hertzlink.stepping import Closing
from structures.closing import ClosingState, _separating
from structures.kernels.gaps import separate
from structures.kernels.kernel_cache import entry

STEEL = hl.STEEL_440C
HALF = hl.Layer(STEEL, length=0.1, radius=5e-3)
IMPEDANCE = STEEL.density * STEEL.bar_speed * HALF.area
PULSE = 20e-6  # s
FORCE = 1000.0  # N
OPENED = FORCE * PULSE / IMPEDANCE
"""Twice the displacement of the wave, m: how far it moves a free face."""
ALUMINIUM = dataclasses.replace(hl.ALUMINIUM_6061, yield_strength=None)
"""So that `identify` makes no fit again with contacts that yield."""
NEAR, FAR = hl.Layer(ALUMINIUM, 0.05, 6e-3), hl.Layer(ALUMINIUM, 0.15, 6e-3)
BEAD = hl.Sphere(radius=4.76e-3, material=STEEL)


def push(time: Any) -> Any:
    """A pulse of force, N."""
    return np.where((time > 0.0) & (time < PULSE), FORCE * np.sin(pi * time / PULSE) ** 2, 0.0)


def tapped(
    body: Closing, window: float, until: float, scale: float = 1.0
) -> tuple[list[ClosingState], np.ndarray, float]:
    """The states after each window of a push on the face, and the work, J."""
    state, place, work, states, forces = body.start(), 0.0, 0.0, [], []
    for k in range(int(until / window)):
        force = scale * float(push((k + 0.5) * window))
        state, moved = body.advance(state, force, window)
        work += force * (moved - place)
        place = moved
        states.append(state)
        forces.append(state.pressed)
    return states, np.array(forces), work


@cache
def transmitted(opening: float, elements: int) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Times since the wave reached the crack, its force, the window, and the lost part of the work."""
    body = hl.rod([HALF, HALF], base="free", elements=elements, cracks=[0])
    window = 0.25 * HALF.length / elements / STEEL.bar_speed
    states, forces, work = tapped(Closing(body, [opening]), window, 50e-6)
    times = (np.arange(len(states)) + 0.5) * window - HALF.length / STEEL.bar_speed
    return times, forces[:, 0], window, states[-1].lost / work


def exact(times: Any, opening: float) -> Any:
    """d'Alembert: a free face moves 2 ∫ F/Z; from the contact on both faces move as the wave, with its whole force."""
    turned = np.clip(times, 0.0, PULSE)
    impulse = FORCE * (turned / 2.0 - PULSE / (4.0 * pi) * np.sin(2.0 * pi * turned / PULSE))
    return np.where(2.0 * impulse / IMPEDANCE >= opening, push(times), 0.0)


@pytest.mark.parametrize(("part", "error"), [(0.0, 1e-4), (0.4, 1e-3), (0.8, 2e-3), (1.05, 0.0)])
def test_impulse_through_a_crack_in_a_long_rod(part: float, error: float) -> None:
    _, force, window, _ = transmitted(part * OPENED, 100)
    times = np.linspace(0.0, PULSE, 200_001)
    expected = trapezoid(exact(times, part * OPENED), times)
    assert force.sum() * window == pytest.approx(expected, abs=error * FORCE * PULSE / 2.0)
    assert (expected == 0.0) == (part > 1.0)


def test_force_of_a_crack_that_is_closed() -> None:
    """The force is the wave's; its error falls at least as the size of the cells."""
    errors = []
    for elements in (50, 100, 200):
        times, force, window, _ = transmitted(0.0, elements)
        errors.append(abs(force - exact(times, 0.0)).sum() * window / (FORCE * PULSE / 2.0))
    assert np.log2(errors[0] / errors[2]) / 2.0 > 1.0
    assert errors[2] < 3e-4


def test_force_of_a_crack_that_closes_under_way() -> None:
    """The force jumps, so that its error in the mean is of order ½."""
    errors = []
    for elements in (50, 100, 200):
        times, force, window, _ = transmitted(0.4 * OPENED, elements)
        errors.append(abs(force - exact(times, 0.4 * OPENED)).sum() * window)
    assert np.log2(errors[0] / errors[2]) / 2.0 == pytest.approx(0.5, abs=0.2)


def test_shorter_windows_change_little() -> None:
    """AR by the default windows is within 5e-4 of that by windows of a tenth."""
    cut = hl.reduce(hl.rod([NEAR, FAR], cracks=[0]), until=6e-4)

    def found(**more: Any) -> float:
        run = hl.CoSimulation(hl.Chain([BEAD] * 6, BEAD, 0.2), Closing(cut, [3e-7]), **more).run(until=4e-4)
        return float(hl.amplitude_ratio(run, sensor=3))

    assert found() == pytest.approx(found(window=3.6e-8), abs=5e-4)


def test_loss_at_closing_is_of_first_order_in_the_mesh() -> None:
    lost = [transmitted(0.4 * OPENED, elements)[3] for elements in (50, 100, 200)]
    assert np.log2(lost[0] / lost[2]) / 2.0 == pytest.approx(1.0, abs=0.2)
    assert lost[2] < 0.003


def spring_and_stop(stiffness: float, mass: float = 1e-5) -> hl.Structure:
    """1 kg on a spring of 1 N/m, and a light spring that it meets at rest: contacts of the mass and the gap."""
    surface = hl.Surface(STEEL)
    return hl.Structure(
        np.diag([1.0, mass]), np.diag([1.0, stiffness]), None, [[1.0, -1.0], [0.0, 1.0]], 0.0, [surface] * 2
    )


@pytest.mark.parametrize("stiffness", [0.5, 3.0, 24.0])
def test_period_of_the_bilinear_oscillator(stiffness: float) -> None:
    """Half a period on one spring and half on both (Shaw and Holmes, J. Sound Vib. 90 (1983) 129)."""
    body = Closing(spring_and_stop(stiffness), [0.0])
    window = 1e-3
    state, place = body.advance(body.start(), 1.0 / window, window)  # an impulse of 1 N s
    crossings, time, before = [], window, place
    while len(crossings) < 2:
        state, place = body.advance(state, 0.0, window)
        if before < 0.0 <= place:
            crossings.append(time + window * before / (before - place))
        before, time = place, time + window
    period = crossings[1] - crossings[0]
    assert period == pytest.approx(pi + pi / sqrt(1.0 + stiffness), rel=1e-4)


@pytest.mark.parametrize("base", ["fixed", "free", "absorbing", "contact"])
def test_a_pressed_crack_is_a_bond(base: str) -> None:
    """As long as the preload exceeds the tension of all waves."""
    whole, cut = (hl.rod([HALF, HALF], base, elements=20, cracks=cracks) for cracks in ([], [0]))
    bonded, closed = hl.stepping.MovingStructure(whole), Closing(cut, [0.0], [10.0 * FORCE])
    state, other = bonded.start(), closed.start()
    rest = np.zeros(1) if base == "contact" else None
    for k in range(400):
        force: Any = float(push(k * 2e-7))
        force = force if rest is None else np.array([force, 0.0])
        state, place = bonded.advance(state, force, 2e-7)
        other, moved = closed.advance(other, force, 2e-7)
        assert moved == pytest.approx(place, abs=1e-12)
    assert abs(closed.widths(other)[0]) < 1e-15
    assert other.lost < 1e-15 or base == "absorbing"


def test_an_open_crack_ends_the_rod() -> None:
    """The layers behind a wide crack never move."""
    short = hl.stepping.MovingStructure(hl.rod([HALF], "free", elements=20))
    wide = Closing(hl.rod([HALF, HALF], "fixed", elements=20, cracks=[0]), [1e-3])
    state, other = short.start(), wide.start()
    for k in range(400):
        state, place = short.advance(state, float(push(k * 2e-7)), 2e-7)
        other, moved = wide.advance(other, float(push(k * 2e-7)), 2e-7)
        assert moved == pytest.approx(place, abs=1e-12)
    assert not other.pressed.any()


@pytest.mark.parametrize("reduced", [False, True])
@pytest.mark.parametrize(("opening", "preload"), [(0.0, 0.0), (1e-6, 0.0), (0.0, 100.0)])
def test_energy(reduced: bool, opening: float, preload: float) -> None:
    """Work = energy + loss in every window; no window gains from a gap."""
    thirds = [hl.Layer(STEEL, length=0.05, radius=5e-3)] * 3
    body = hl.rod(thirds, base="free", elements=20, cracks=[0, 1])
    body = hl.reduce(body, until=2e-4) if reduced else body
    closing = Closing(body, [opening, 0.0], [preload, 0.0])
    states, forces, work = tapped(closing, 1e-7, 2e-4)
    lost = np.array([state.lost for state in states])
    assert closing.energy(states[-1]) + lost[-1] == pytest.approx(work, rel=1e-9)
    assert np.diff(lost).min() > -1e-12 * work
    assert (forces >= 0.0).all()
    assert forces.max() > 0.1 * FORCE
    assert lost[-1] < 0.2 * work
    widths = np.array([closing.widths(state) for state in states])
    assert widths.min() > -0.02 * max(opening, OPENED)
    assert widths.max() > 0.1 * OPENED


@pytest.mark.parametrize("base", ["free", "absorbing"])
def test_the_ledger_of_a_run(base: str) -> None:
    """Work = kinetic + elastic + lost energy of the structure in a co-simulation, to the scheme's tolerance."""
    cut = hl.reduce(hl.rod([NEAR, FAR], base, cracks=[0]), until=4e-4)
    run = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3), Closing(cut, [3e-7])).run(until=4e-4)
    energy = float(run.impact_energy)
    assert abs(run.structure_numerical_loss).max() < 1e-9 * energy
    lost = run.structure_dissipated_energy.values
    assert np.diff(lost).min() > -1e-12 * energy
    assert lost[-1] > 1e-6 * energy


def test_reduced_keeps_the_gaps() -> None:
    layers = [hl.Layer(hl.ALUMINIUM_6061, 3.0, 6e-3)] * 2
    run = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3), Closing(hl.rod(layers, cracks=[0]), [1e-7]))
    small = run.reduced(until=1e-4)
    assert small.structure.structure.size < 100 < run.structure.structure.size
    assert small.structure.closing.opening.tolist() == [1e-7]
    with pytest.raises(ValueError, match=r"was reduced for runs of at most 0\.0001 s"):
        small.run(until=2e-4)


def test_a_contact_with_flexibility_stays_flexible() -> None:
    body = hl.rod([NEAR, FAR], cracks=[0])
    soft = Closing(dataclasses.replace(body, flexibility=[1e-8, 0.0]), [0.0])
    assert hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3), soft).structure.flexibilities.tolist() == [1e-8]


def test_without_gap_and_preload_the_answer_is_proportional_to_the_force() -> None:
    body = Closing(hl.rod([HALF, HALF], "free", elements=20, cracks=[0]), [0.0])
    once, twice = (tapped(body, 2e-7, 1e-4, scale)[1] for scale in (1.0, 2.0))
    assert twice == pytest.approx(2.0 * once, abs=1e-6 * FORCE)


def test_several_gaps_press_together() -> None:
    """Two gaps in a row of three masses: momentum is kept, and the first mass stops as the last one leaves."""
    count, surface = 3, hl.Surface(STEEL)
    gaps = np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [0.0, 0.0, 1.0]])
    loose = hl.Structure(np.eye(count), 1e-9 * np.eye(count), None, gaps, 0.0, [surface] * 3)
    body = Closing(loose, [0.0, 0.0])
    state, _ = body.advance(body.start(), 3.0, 1.0)
    assert state.body.velocity == pytest.approx([1.0, 1.0, 1.0], abs=1e-6)
    assert state.pressed == pytest.approx([2.0, 1.0], abs=1e-6)


UNTIL = 1e-3  # s


def ratio(body: Any, speed: float) -> float:
    """AR of a chain on a body."""
    chain = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=speed)
    return float(hl.amplitude_ratio(hl.CoSimulation(chain, body).run(until=UNTIL), sensor=12))


def test_the_amplitude_decides_whether_a_crack_looks_open_or_bonded() -> None:
    """A closed crack is a bond for the first wave, a wide one the end of the rod, and one of 0.5 µm lies between."""
    bonded = hl.reduce(hl.rod([NEAR, FAR]), until=UNTIL)
    ended = hl.reduce(hl.rod([NEAR], base="free"), until=UNTIL)
    cut = hl.reduce(hl.rod([NEAR, FAR], cracks=[0]), until=UNTIL)
    closed, narrow, wide = (Closing(cut, [opening]) for opening in (0.0, 0.5e-6, 1e-4))
    between = []
    for speed in (0.1, 0.3, 1.0):
        low, high = ratio(ended, speed), ratio(bonded, speed)
        assert ratio(wide, speed) == pytest.approx(low, abs=5e-4)
        assert ratio(closed, speed) == pytest.approx(high, abs=5e-4)
        between.append((ratio(narrow, speed) - low) / (high - low))
    assert 0.1 < between[0] < 0.35
    assert 0.5 < between[1] < 0.7
    assert 0.75 < between[2] < 0.9


THIRDS = hl.rod([NEAR, NEAR, FAR], cracks=[0, 1])
ALONE: dict[str, Any] = {
    "several gaps, one with a preload": Closing(hl.reduce(THIRDS, until=3e-4), [0.0, 1e-7], [5.0, 0.0]),
    "not reduced": Closing(hl.rod([NEAR, FAR], cracks=[0]), [1e-7]),
    "coupled by damping": Closing(hl.rod([NEAR, FAR], "absorbing", elements=12, cracks=[0]), [1e-7]),
    "without mass": Closing(
        hl.damped(hl.rod([NEAR, FAR], elements=12, cracks=[0]), hl.damping.StandardLinearSolid(0.3, 2e-5)), [1e-7]
    ),
}


@pytest.mark.parametrize("name", ALONE)
def test_the_compiled_loop_does_what_the_structure_does_alone(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same energy, loss, motion and force to rounding, by other trials: of one contact it brackets the force."""
    simulation = hl.CoSimulation(hl.Chain([BEAD] * 4, BEAD, 0.3), ALONE[name])
    assert is_compiled(simulation.interface, simulation.scheme)
    compiled = simulation.run(1.5e-4)
    monkeypatch.setattr("coupling.run_loop.is_compiled", lambda *_: False)
    other = simulation.run(1.5e-4)
    assert float(other.structure_dissipated_energy[-1]) > 1e-6 * float(other.impact_energy)
    for one in set(other.data_vars) - {"residual", "evaluations"}:
        size = float(other.impact_energy) if other[one].attrs["units"] == "J" else float(abs(other[one]).max())
        assert compiled[one].values == pytest.approx(other[one].values, rel=0.0, abs=1e-11 * size), one


def masses(lighter: float) -> Closing:
    """Three masses in a row, the first and the second struck, with a gap between these two."""
    stiffness = 2e6 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]])
    contact = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
    mass = lighter * np.diag([0.01, 0.02, 0.015])
    return Closing(hl.Structure(mass, stiffness, None, contact, 0.0, [hl.Surface(STEEL)] * 3), [2e-7])


LONG: dict[str, Any] = {"window": 8e-6, "substeps": 1}


@pytest.mark.parametrize("contacts", [1, 2])
@pytest.mark.parametrize(
    ("lighter", "how", "trials"),
    [
        (1.0, LONG, 4.0),
        (0.01, LONG, 15.0),
        (0.01, {}, 3.5),
        pytest.param(1.0, {}, 2.0, marks=pytest.mark.thorough),
        pytest.param(0.01, {"waveform": "quadratic"}, 3.5, marks=pytest.mark.thorough),
    ],
)
def test_newtons_method_converges_where_gaps_close(
    contacts: int, lighter: float, how: dict[str, Any], trials: float
) -> None:
    """No window is halved, with masses down to that of a tenth of a bead; an iteration in Python finds the same motion.

    A gap that closes only makes the structure stiffer than the compliance by which the next force is found.
    """
    body = masses(lighter)
    chains = [hl.Chain([BEAD] * 4, BEAD, speed) for speed in (0.3, 0.1)[:contacts]]
    simulation = hl.CoSimulation(chains, [hl.ContactPoint(body, k) for k in range(contacts)], **how)
    assert is_compiled(simulation.interface, simulation.scheme)
    run, other = simulation.run(2e-4), simulation.replace(scheme=hl.Aitken(1e-13)).run(2e-4)
    substeps = float(run.substeps.sum())
    assert substeps == simulation.plan(2e-4).total
    assert float(run.evaluations.sum()) < trials * substeps
    assert float(run.residual.max()) <= 1e-11 * simulation.interface.force_scale
    assert float(run.structure_dissipated_energy[-1].sum()) > 3e-4 * float(run.impact_energy.sum())
    assert run.velocity.values == pytest.approx(other.velocity.values, abs=1e-9 * float(other.velocity.max()))


def test_forces_of_many_gaps_are_those_of_least_squares() -> None:
    """Also where some gaps open because others press, which a first guess does not know."""
    random, several, alone = np.random.default_rng(3), 0, entry(separate.py_func)
    for count in (2, 5, 9, 25):
        for _ in range(40):
            root = random.normal(size=(count, count)) + 0.5
            softness, rate = root @ root.T + 0.1 * np.eye(count), random.normal(size=count)
            near = random.random(count) < 0.8
            near[0] = True
            expected, found, lower = np.zeros(count), np.empty(count), np.linalg.cholesky(softness[np.ix_(near, near)])
            expected[near] = nnls(lower.T, -np.linalg.solve(lower, rate[near]))[0]
            alone(softness, rate, near.astype(float), found, np.zeros((2 + count, count)))
            scale = abs(rate).max() / softness.diagonal().min()
            assert found == pytest.approx(expected, abs=1e-10 * scale)
            assert _separating(softness[np.ix_(near, near)], rate[near]) == pytest.approx(
                expected[near], abs=1e-10 * scale
            )
            several += not np.array_equal(found > 0.0, near & (rate < 0.0))
    assert several > 40


def test_a_batch_takes_gaps() -> None:
    """Each run of a batch is that of the run alone."""
    cut = hl.reduce(hl.rod([NEAR, FAR], cracks=[0]), until=3e-4)

    def tap(micrometres: float) -> hl.CoSimulation:
        return hl.CoSimulation(hl.Chain([BEAD] * 4, BEAD, 0.3), Closing(cut, [1e-6 * micrometres]))

    taps = hl.batch(tap, until=2e-4, save_every=1e-6, micrometres=[0.1, 0.5])
    for i, opening in enumerate((0.1, 0.5)):
        alone = tap(opening).run(2e-4, save_every=1e-6)
        assert np.array_equal(taps.contact_force[i].values, alone.contact_force.transpose(*taps.contact_force.dims[1:]))


CUT = hl.rod([HALF, HALF], elements=2, cracks=[0])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"opening": [-1e-6]}, r"opening\[0\] = -1e-06: must lie between 0 and 0.01 m"),
        ({"opening": [float("nan")]}, r"opening = nan"),
        ({"opening": [1.0]}, r"opening\[0\] = 1.0: must lie between 0 and 0.01 m"),
        ({"opening": []}, "opening = "),
        ({"opening": 1e-6}, "opening = 1e-06: must be a list"),
        ({"opening": [0.0, 0.0]}, "opening: has 2 numbers, must have fewer than the structure's 2 contacts"),
        ({"preload": [-1.0]}, r"preload\[0\] = -1.0: must lie between"),
        ({"preload": [1.0, 1.0]}, "preload: has 2 numbers, must have 1"),
        ({"opening": [1e-6], "preload": [1.0]}, r"preload\[0\] = 1: must be 0 where the gap is open"),
        ({"structure": spring_and_stop(1.0, mass=0.0)}, "structure: has a gap at a degree of freedom without mass"),
        ({"structure": None}, "structure = None: must be a Structure"),
    ],
)
def test_bad_input(change: dict[str, Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        Closing(**{"structure": CUT, "opening": [0.0], **change})


@pytest.mark.parametrize(
    ("cracks", "message"),
    [
        ([1], "1 must be below 1"),
        ([-1], r"cracks\[0\] = -1"),
        ([0, 0], "must name each layer once"),
        (0, "cracks = 0: must be a list of layers"),
        ("0", "must be a list of layers"),
        ([0.5], r"cracks\[0\] = 0.5"),
    ],
)
def test_bad_cracks(cracks: Any, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.rod([HALF, HALF], cracks=cracks)


def cracked(micrometres: float) -> hl.CoSimulation:
    return hl.CoSimulation(
        hl.Chain([BEAD] * 6, BEAD, 0.2),
        Closing(hl.reduce(hl.rod([NEAR, FAR], cracks=[0]), until=6e-4), [1e-6 * micrometres]),
    )


@pytest.mark.thorough
def test_an_opening_is_identified() -> None:
    run = cracked(0.3).replace(accuracy="reference").run(until=4e-4, save_every=5e-7)
    force = hl.sensor_force(run, 3).values
    noise = 0.01 * force.max() * np.random.default_rng(1).normal(size=force.size)
    signal = hl.as_signal(run.time.values, {3: force + noise})
    near = {"micrometres": 0.33}
    found = hl.identify(signal, cracked, until=3e-4, guess=near, micrometres=(0.1, 0.8))["micrometres"]
    # Of a thousand errors one exceeds 3.3 standard deviations.
    assert found.value == pytest.approx(0.3, abs=3.3 / 1.96 * found.error)
    assert found.error < 0.05


def test_a_gap_that_no_tap_closes_leaves_no_trace_of_its_width() -> None:
    narrow, wide = (
        hl.identifiability(cracked, 0.01, sensors=[3], until=5e-4, micrometres=one).bounds["micrometres"]
        for one in (0.3, 500.0)
    )
    assert narrow < 0.05
    assert wide > 1e3


@pytest.mark.parametrize(("opening", "preload"), [(0.0, 5.0), (1e-7, 0.0)])
def test_a_closing_structure_keeps_what_a_participant_owes(opening: float, preload: float) -> None:
    """Repeatable, independent, deterministic, picklable, finite, at rest, passive, and of second order in between."""
    body = hl.reduce(hl.rod([NEAR, FAR], cracks=[0]), until=1e-3)
    checks.check_structure(lambda: Closing(body, [opening], [preload]))
