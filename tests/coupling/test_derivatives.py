"""Exact derivatives of runs, against complex steps of a twin and against differences of runs."""

from dataclasses import replace
from functools import cache
from math import atan, cos, exp, log, sin, sqrt, tanh

import numpy as np
import pytest
from numba import njit

import hertzlink as hl
from coupling.inference import derivatives
from coupling.inference.derivatives import differentiate, numbers_of
from coupling.recording.frames import Frames, kept_at
from particles.kernels.laws import hertz
from structures.kernels.duals import WIDTHS, Eight, as_duals, without_small
from structures.kernels.kernel_cache import entry

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
BEADS, SENSOR = 6, 4
WINDOW, STEPS = 2e-7, 10
WINDOWS = 2000
STEP = 1e-40
"""Of complex steps: no digit of a value is lost."""


def clamped(plate):
    return plate.at(0.05, 0.04)


def layers(depth, modulus):
    soft = replace(hl.PTFE, youngs_modulus=modulus)
    return [hl.Layer(soft, depth, 9.525e-3), hl.Layer(hl.STEEL_440C, 0.02, 9.525e-3)]


def metal(modulus):
    return replace(hl.ALUMINIUM_6061, youngs_modulus=modulus)


SUPPORTS = hl.Supports(left="clamped")

LATE = ", late"

QUICK = "half-space", "mass on a spring and a soft layer", "layered rod", f"layered rod{LATE}"

STRUCTURES = {
    "half-space": (lambda depth, modulus: hl.half_space(metal(modulus)), 0.01, 7e10),
    "mass on a spring": (
        lambda depth, modulus: hl.Structure([[depth]], [[modulus]], None, [1.0], 0.0, hl.Surface(hl.STEEL_316)),
        0.02, 1e7,
    ),
    "mass on a spring and a soft layer": (
        lambda depth, modulus: hl.Structure([[0.02]], [[modulus]], None, [1.0], depth, hl.Surface(hl.STEEL_316)),
        1e-8, 1e7,
    ),
    "rod": (lambda depth, modulus: hl.rod(layers(depth, modulus)[:1]), 0.05, 5e8),
    "layered rod": (lambda depth, modulus: hl.rod(layers(depth, modulus)), 0.01, 5e8),
    "cylinder": (lambda depth, modulus: hl.layered_cylinder(layers(depth, modulus)[:1], cells=2), 0.03, 5e8),
    "plate": (
        lambda depth, modulus: clamped(hl.kirchhoff_plate(0.1, 0.1, depth, metal(modulus), SUPPORTS)), 3e-3, 7e10,
    ),
    "thick plate": (
        lambda depth, modulus: clamped(hl.mindlin_plate(0.1, 0.1, depth, metal(modulus), SUPPORTS)), 3e-3, 7e10,
    ),
    "beam": (
        lambda depth, modulus: hl.beam(
            0.2, modulus * 0.02 * depth**3 / 12.0, 54.0 * depth, metal(modulus), 0.08, ("clamped", "free")
        ),
        3e-3, 7e10,
    ),
    "long rod": (lambda depth, modulus: hl.rod([hl.Layer(metal(modulus), 0.5, depth)]), 9e-3, 7e10),
}  # fmt: skip


@cache
def structure_of(name, depth, modulus):
    made = STRUCTURES[name][0](depth, modulus)
    return hl.reduce(made, until=4e-4) if made.size > 1 else made


def builder(name):
    """Return a function of six parameters: two of the structure, four of the chain.

    Of a name that ends with "late" those of the chain belong to the last bead, and one does nothing.
    """
    name, late = name.removesuffix(LATE), name.endswith(LATE)

    def build(depth, modulus, impact_speed, radius, density, youngs_modulus):
        changed = replace(BEAD.material, density=density, youngs_modulus=youngs_modulus)
        first, rest, speed = hl.Sphere(radius, BEAD.material), hl.Sphere(4.76e-3, changed), impact_speed
        last = rest
        if late:
            first, rest, last, speed = BEAD, BEAD, hl.Sphere(radius, changed), 0.4
        chain = hl.Chain([*[rest] * (BEADS - 1), last], first, speed)
        return hl.CoSimulation(
            chain, structure_of(name, depth, modulus), hl.Condensed(tolerance=1e-14), WINDOW, WINDOW / STEPS, substeps=1
        )

    depth, modulus = STRUCTURES[name][1:]
    values = {"depth": depth, "modulus": modulus, "impact_speed": 0.4, "radius": 4.5e-3}
    return build, values | {"density": BEAD.material.density, "youngs_modulus": BEAD.material.youngs_modulus}


@njit(cache=True)
def twin(windows, inverse_mass, stiffness, spring, rows, response, contact, compliance, y, v):  # pragma: no cover
    """Return the forces at the sensor's two contacts of the coupled run, in complex numbers, after each window.

    It is written for this test alone: one loop, one contact, the secant method in complex numbers. Numba compiles loops
    in half the time that it takes for sums of arrays.
    """
    bodies, size, dt = y.size, contact.size, WINDOW / STEPS
    state, force, surface = np.zeros(2 * size, np.complex128), 0j, 0j
    saved = np.zeros((windows, 2), np.complex128)
    trial_y, trial_v = y.copy(), v.copy()
    for number in range(windows):
        free = np.zeros(2 * size, np.complex128)
        for i in range(size):
            free[i] = rows[0, i] * state[i] + rows[1, i] * state[size + i]
            free[size + i] = rows[2, i] * state[i] + rows[3, i] * state[size + i]
        at_rest, last_force, last_residual, slope = 0j, 0j, 0j, -1.0 + 0j
        for i in range(size):
            at_rest += contact[i] * free[i]
        close = 0
        for trial in range(60):
            for i in range(bodies):
                trial_y[i], trial_v[i] = y[i], v[i]
            place, impulse = at_rest + compliance * force, 0j
            for step in range(STEPS + 1):
                kick = dt if 0 < step < STEPS else 0.5 * dt
                behind, last = 0j, 0j
                for i in range(bodies):
                    wall = surface + (place - surface) * step / STEPS
                    approach = trial_y[i] - (trial_y[i + 1] if i + 1 < bodies else wall)
                    ahead = 0j
                    if approach.real > 1e-60:
                        overlap = approach
                        if i == bodies - 1 and spring != 0.0:
                            for _ in range(50):
                                root = np.sqrt(overlap)
                                change = (overlap + spring * stiffness[i] * overlap * root - approach) / (
                                    1.0 + 1.5 * spring * stiffness[i] * root
                                )
                                overlap -= change
                                if abs(change) < 1e-17 * abs(overlap):
                                    break
                        ahead = stiffness[i] * overlap * np.sqrt(overlap)
                    trial_v[i] += kick * inverse_mass[i] * (behind - ahead)
                    behind, last = ahead, ahead
                impulse += kick * last
                for i in range(bodies if step < STEPS else 0):
                    trial_y[i] += dt * trial_v[i]
            answer = impulse / WINDOW
            residual = answer - force
            if compliance == 0.0 or close == 4:
                force = answer
                break
            # The slope of trials that hardly differ is rounding; with the last one the imaginary part converges, too.
            if abs(residual) <= 1e-8 * abs(answer):
                close += 1
            elif trial > 0:
                slope = (residual - last_residual) / (force - last_force)
            last_force, last_residual = force, residual
            force -= residual / slope
        for i in range(bodies):
            y[i], v[i] = trial_y[i], trial_v[i]
        for i in range(2 * size):
            state[i] = free[i] + response[i] * force
        surface = at_rest + compliance * force
        for j in range(2):
            approach = y[SENSOR - 1 + j] - y[SENSOR + j]
            if approach.real > 1e-60:
                saved[number, j] = stiffness[SENSOR - 1 + j] * approach * np.sqrt(approach)
    return saved


def gathered(simulation, around, length):
    """Return the numbers of a run with those of runs around, and the signs of the first."""
    runs = [numbers_of(run, length, simulation) for run in (simulation, *around)]
    numbers = derivatives.gathered(runs, [""] * len(around), [])
    derivatives.align(numbers.structure)
    return numbers


def slope(number, step, weights=derivatives.WEIGHTS):
    """Return the derivative of a number; what is the same object in all runs has none."""
    if not isinstance(number, derivatives.Column):
        return np.zeros(np.shape(number))
    return (weights @ derivatives.changes_of(number.rows)).reshape(np.shape(number.value)) / step


def numbers_with_step(numbers, step):
    """Return what the twin takes, moved by a complex step along derivatives."""
    chain, structure, compliance = numbers.chains[0], numbers.structure, numbers.compliance
    parts = [
        chain.inverse_mass, chain.law.stiffness, chain.springs[1], structure.rows, structure.response,
        structure.contact, compliance, numbers.y, numbers.v,
    ]  # fmt: skip
    moved = [getattr(part, "value", part) + 1j * STEP * slope(part, step) for part in parts]
    return [*moved[:4], moved[4][0], moved[5][0], moved[6][0, 0], *moved[7:]]


def test_what_a_run_is_made_of_has_the_derivatives_of_closed_forms():
    """Of a mass on a spring ω² = k/m and the shape 1/√m; of the first sphere its mass and Hertz's stiffness."""
    build, values = builder("mass on a spring")
    simulation, mass, spring, radius = build(**values), values["depth"], values["modulus"], values["radius"]
    usual, rates = numbers_of(simulation, WINDOW), {}
    for name, around, step in derivatives.parameters_around(build, values):
        numbers = gathered(simulation, around, WINDOW)
        chain, squares = numbers.chains[0], numbers.structure.squares
        parts = squares, numbers.structure.contact, chain.inverse_mass, chain.law.stiffness, numbers.v
        rates[name] = [slope(part, step).flat[0] for part in parts]
        assert abs(slope(squares, step, derivatives.DOUBTS)) <= 1e-6 * usual.structure.squares / values[name]
        if name == "modulus":
            assert not slope(chain.inverse_mass, step).any()
    law, inverse = usual.chains[0].law.stiffness[0], usual.chains[0].inverse_mass[0]
    expected = [
        (rates["depth"][0], -spring / mass**2),
        (rates["modulus"][0], 1.0 / mass),
        (rates["depth"][1], -0.5 * usual.structure.contact[0, 0] / mass),
        (rates["radius"][2], -3.0 * inverse / radius),
        (rates["radius"][3], 0.5 * law * 4.76e-3 / (radius * (radius + 4.76e-3))),
        (rates["impact_speed"][4], 1.0),
    ]
    for carried, exact in expected:
        assert carried == pytest.approx(exact, rel=1e-9)


def test_signs_of_modes_are_those_here():
    """Modes of two contacts whose signs jump change nothing that moves."""

    def build(stiffness, jump):
        sign = jump if stiffness > 1e7 else 1.0
        contact = np.array([[1.0, -0.5], [0.3, 2.0]]) * [[1.0], [sign]]
        wall = hl.Structure(np.eye(2), np.diag([stiffness, 3.0 * stiffness]), None, contact, 0.0, hl.Surface(hl.PTFE))
        pushed = hl.Chain([BEAD] * BEADS, hl.PushedBead([0.0, 2e-5, 4e-5], [0.0, 50.0, 0.0]))
        return hl.CoSimulation(pushed, hl.ContactPoint(wall, 0), behind=hl.ContactPoint(wall, 1))

    def slopes(jump):
        values = {"stiffness": 1e7, "jump": jump}
        (_, around, step), _ = derivatives.parameters_around(build, values)
        structure = gathered(build(**values), around, WINDOW).structure
        return [slope(number, step) for number in (structure.contact, structure.response, structure.rows)]

    usual, flipped = slopes(1.0), slopes(-1.0)
    assert usual[1].shape == (2, 4)
    assert abs(usual[1]).max() > 0.0
    for here, other in zip(usual, flipped, strict=True):
        assert other.tolist() == here.tolist()


@pytest.mark.parametrize(
    ("parameter", "settings", "begin"),
    [
        ("radius", {}, 3), ("density", {}, 4), ("depth", {}, BEADS), ("impact_speed", {}, -1), ("exponent", {}, -1),
        ("density", {"preload": 5.0}, -1),
    ],
)  # fmt: skip
def test_derivatives_wait_for_the_wave_where_a_parameter_acts(parameter, settings, begin):
    """The radius of bead 4 changes the contact that body 3 is behind; others change the start, or all contacts."""

    def build(radius, density, impact_speed, exponent, depth):
        beads = [BEAD] * BEADS
        beads[3] = hl.Sphere(radius, replace(BEAD.material, density=density))
        law = hl.laws.PowerLaw(1e9, exponent) if parameter == "exponent" else None
        struck = hl.Chain(beads, BEAD, impact_speed, law=law, **settings)
        return hl.CoSimulation(struck, structure_of("rod", depth, 5e8))

    usual = {"radius": 4.5e-3, "density": 7800.0, "impact_speed": 0.4, "exponent": 1.4, "depth": 0.05}
    simulation = build(**usual)
    plan = simulation.plan(1e-4)
    around = [runs for runs in derivatives.parameters_around(build, usual) if runs.name == parameter]
    frames = Frames(simulation.interface, plan.rows, kept_at([SENSOR], BEADS))
    engine = derivatives.TangentEngine(simulation, simulation, plan, frames, around)
    engine.recorder_of(plan.length)
    assert engine.begin == begin


@pytest.mark.parametrize(
    "name",
    [*QUICK, *(pytest.param(name, marks=pytest.mark.thorough) for name in STRUCTURES if name not in QUICK)],
)
def test_derivatives_agree_with_complex_steps_over_20_000_steps(name, monkeypatch):
    """Differentiate a run by six parameters, and compare each derivative with a complex step of the twin.

    The run that divides the doubt among them, in narrower dual numbers, would be compiled for some structures.
    """
    monkeypatch.setattr(derivatives, "NEGLIGIBLE", np.inf)
    build, values = builder(name)
    simulation = build(**values)
    plan = simulation.plan(WINDOWS * WINDOW, WINDOW)
    assert (plan.length, simulation.chain.steps(plan.length)) == (WINDOW, STEPS)
    _, rates = differentiate(simulation, build, values, plan, kept_at([SENSOR], BEADS))
    for parameter, around, difference in derivatives.parameters_around(build, values):
        numbers = gathered(simulation, around, plan.length)
        step = twin(WINDOWS, *numbers_with_step(numbers, difference)).imag / STEP
        carried = rates.force[parameter][1:, :2]
        without = ("half-space", "depth"), (QUICK[-1], "impact_speed")
        assert abs(step).max() > 0.0 or (name, parameter) in without
        assert abs(carried - step).max() <= 1e-10 * abs(step).max(), parameter


@entry
def of_duals(memory, other, made, width):
    """Fill two dual numbers with what kernels do to numbers."""
    x, a, result = as_duals(memory, 0, width), as_duals(other, 0, width), as_duals(made, 0, width)
    total = 0.0
    for i in range(x.size):
        overlap = x[i] - a[i]
        closed = overlap if overlap > 1e-60 else 0.0
        total += a[i] * closed * sqrt(closed) / (1.0 + x[i]) - 2 * abs(-x[i]) ** a[i] + exp(-(x[i] ** 2))
        total += max(x[i] - 1.5, a[i]) - min(0.5 * x[i], a[i]) + hertz(a[i], x[i]) + hertz(2.0, x[i])
        total += sin(x[i]) * cos(a[i]) + tanh(x[i]) + atan(a[i]) + log(1.0 + x[i])
    result[0] = total
    result[1] = without_small(result[1] + 3.0, 1.0)


@pytest.mark.parametrize("width", WIDTHS)
def test_dual_numbers_follow_the_chain_rule(width):
    rng, entries = np.random.default_rng(1), WIDTHS[width]
    numbers = 1.0 + rng.random((1, 5, entries)), rng.random((1, 5, entries)), np.ones((1, 2, entries))
    numbers[2][0, 1, -1] = 1e-200
    of_duals(*numbers, width())
    (x, a), directions = [part[0, :, 0] for part in numbers[:2]], range(1, entries)

    def total(x, a):
        value = 0.0
        for x_i, a_i in zip(x, a, strict=True):
            value += a_i * (x_i - a_i) ** 1.5 / (1.0 + x_i) - 2.0 * x_i**a_i + np.exp(-(x_i**2))
            value += max(x_i - 1.5, a_i, key=np.real) - min(0.5 * x_i, a_i, key=np.real)
            value += (a_i + 2.0) * x_i**1.5
            value += np.sin(x_i) * np.cos(a_i) + np.tanh(x_i) + np.arctan(a_i) + np.log(1.0 + x_i)
        return value

    steps = [total(x + 1j * STEP * numbers[0][0, :, d], a + 1j * STEP * numbers[1][0, :, d]) for d in directions]
    assert numbers[2][0, 0, 0] == pytest.approx(total(x, a).real, rel=1e-14)
    assert numbers[2][0, 0, 1:] == pytest.approx(np.imag(steps) / STEP, rel=1e-13)
    assert numbers[2][0, 1].tolist() == [4.0] + [1.0] * (entries - 2) + [0.0]


def test_a_function_of_zero_that_has_no_slope_has_the_one_of_an_open_contact():
    made = np.zeros((1, 2, 8))
    of_duals(np.zeros((1, 1, 8)), np.zeros((1, 1, 8)), made, Eight())
    assert np.isfinite(made).all()


def chain(impact_speed=0.4, radius=4.76e-3, **settings):
    bead = hl.Sphere(radius, BEAD.material)
    return hl.Chain([bead] * BEADS, bead, impact_speed, **settings)


def coupled(beads, structure, **settings):
    return hl.CoSimulation(beads, structure, hl.Condensed(tolerance=1e-13), 4e-7, 4e-8, substeps=1, **settings)


def damped_pair(coefficient, stiffness):
    matrix = [[stiffness, -0.5 * stiffness], [-0.5 * stiffness, stiffness]]
    damping = [[coefficient, 0.0], [0.0, 0.0]]
    return hl.Structure([[0.05, 0.0], [0.0, 0.02]], matrix, damping, [1.0, 0.0], 1e-9, hl.Surface(hl.STEEL_316))


def viscoelastic(depth, share):
    rod = hl.rod([hl.Layer(hl.PTFE, depth, 9.5e-3), hl.Layer(hl.STEEL_440C, 0.02, 9.5e-3)], elements=30)
    return hl.reduce(hl.damped(rod, hl.damping.StandardLinearSolid(share=share, time=20e-6), part=0), until=4e-4)


def softer(n):
    return hl.laws.PowerLaw(1e9 * 1e-5 ** (1.5 - n), n)


OTHERS = {
    "damping that couples, a loss, curved surfaces, an exponent": (
        lambda k, v, share, n: coupled(chain(v, dissipation=hl.Tsuji(share), law=softer(n)), damped_pair(5.0, k)),
        {"k": 2e6, "v": 0.4, "share": 0.05, "n": 1.5}, 1e-6, 5e-4,
    ),
    "arms of a viscoelastic layer": (
        lambda depth, share, loss, k: coupled(
            chain(dissipation=hl.Tsuji(loss), law=hl.laws.PowerLaw(k, 1.45)), viscoelastic(depth, share)
        ),
        {"depth": 5e-3, "share": 0.4, "loss": 0.05, "k": 5e8}, 3e-4, 1e-3,
    ),
    "yield, a surface behind, a preload, a quadratic waveform": (
        lambda radius, density, preload: coupled(
            hl.Chain(
                [hl.Sphere(radius, replace(BEAD.material, density=density))] * BEADS,
                hl.PushedBead([0.0, 2e-5, 4e-5], [0.0, 50.0, 0.0]), law=hl.laws.JacksonGreen(), preload=preload,
            ),
            hl.half_space(hl.STEEL_316), behind=hl.half_space(hl.PTFE), waveform="quadratic",
        ),
        {"radius": 4.7e-3, "density": 7800.0, "preload": 5.0}, 1e-6, 2e-6,
    ),
}  # fmt: skip
"""A function of parameters, where to differentiate, and the difference: its step, as a part of the value, and error.

Features share runs: each kind of chain is compiled twice, in dual numbers and in plain ones, for 10 s to 20 s.
"""


@pytest.mark.thorough
@pytest.mark.parametrize("name", OTHERS)
def test_derivatives_agree_with_differences_of_runs(name):
    build, values, part, error = OTHERS[name]
    simulation = build(**values)
    plan = simulation.plan(3e-4, None)
    _, rates = differentiate(simulation, build, values, plan, kept_at([SENSOR], BEADS))
    for parameter, value in values.items():
        step, forces = part * value, []
        for place in derivatives.PLACES:
            run = build(**values | {parameter: value + place * step}).run(3e-4, sensors=[SENSOR])
            forces.append(run.contact_force.values)
        difference = np.tensordot(derivatives.WEIGHTS, np.array(forces), 1) / step
        carried = rates.force[parameter][:, :2]
        assert abs(difference).max() > 0.0
        assert abs(carried - difference).max() < error * abs(difference).max(), parameter
