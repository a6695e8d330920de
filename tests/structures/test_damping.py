"""Damping: decay, creep and loss against closed forms, passive whatever is combined, kept by a reduction."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.linalg import eigh, expm

import hertzlink as hl
from structures.damping import Modal, Rayleigh, StandardLinearSolid, loss_factor, stiffness_parts
from structures.maxwell import maxwell_arms

LAYERS = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
ROD = hl.rod(LAYERS)
BAR = hl.rod([hl.Layer(hl.PTFE, 0.05, 0.01)], elements=1)
STATIC_STIFFNESS = hl.PTFE.youngs_modulus * np.pi * 0.01**2 / 0.05
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=0.31)


def dynamic_stiffness(structure: hl.Structure, omega: float) -> complex:
    """The dynamic stiffness of the contact point without mass, N/m."""
    assert structure.damping is not None
    matrix = structure.stiffness.toarray() + 1j * omega * structure.damping.toarray()
    return complex(1.0 / (structure.contact @ np.linalg.solve(matrix, structure.contact)))


def test_rayleigh_damps_each_mode_by_its_ratio() -> None:
    """A mode decays with ζ = α/2ω + βω/2: its complex frequency is exact, and so is its motion in time."""
    mass_rate, time = 2000.0, 1e-6
    damped = hl.damping.damped(BAR, Rayleigh(mass_rate, time))
    square, shapes = eigh(BAR.stiffness.toarray(), BAR.mass.toarray())
    assert damped.damping is not None
    rates = shapes.T @ damped.damping.toarray() @ shapes
    ratio = mass_rate / (2.0 * np.sqrt(square)) + time * np.sqrt(square) / 2.0
    assert rates == pytest.approx(np.diag(2.0 * ratio * np.sqrt(square)), abs=1e-9 * rates.max())

    omega, zeta = np.sqrt(square[0]), ratio[0]
    moving = hl.stepping.MovingStructure(damped)
    state = moving.start()._replace(displacement=shapes[:, 0])
    for _ in range(4000):
        state, _ = moving.advance(state, 0.0, 5e-8)
    swing = omega * np.sqrt(1.0 - zeta**2)
    exact = np.exp(-zeta * omega * 2e-4) * (np.cos(swing * 2e-4) + zeta * omega / swing * np.sin(swing * 2e-4))
    assert shapes[:, 0] @ (BAR.mass @ state.displacement) == pytest.approx(exact, rel=1e-4)


def test_modal_ratios_are_those_of_the_decay() -> None:
    """Slow oscillators move exactly: u = e^(−ζωt) cos(ω_d t − φ)/cos φ; a rigid motion is left free."""
    modes = hl.reduce(hl.rod(LAYERS, base="free"), until=1e-3)
    damped = hl.damping.damped(modes, Modal(0.05))
    assert damped.is_modal
    assert loss_factor(0.1) == Modal(0.05)
    assert damped.damping is not None
    omega = np.sqrt(modes.stiffness.diagonal())
    assert damped.damping.diagonal() == pytest.approx(0.1 * omega)
    moving = hl.stepping.MovingStructure(damped)
    state, _ = moving.advance(moving.start()._replace(displacement=np.ones(modes.size)), 0.0, 1e-6)
    slow = (omega * 1e-6 < 1.0) & (omega > 1e3)
    swing = omega[slow] * np.sqrt(1.0 - 0.05**2)
    exact = np.exp(-0.05 * omega[slow] * 1e-6) * (
        np.cos(swing * 1e-6) + 0.05 * omega[slow] / swing * np.sin(swing * 1e-6)
    )
    assert state.displacement[slow] == pytest.approx(exact, rel=1e-10)


@pytest.mark.parametrize("modulus", ["relaxed", "instantaneous"])
def test_stress_relaxes_as_in_the_standard_linear_solid(modulus: str) -> None:
    """At constant strain: E (1 + g e^(−t/τ)), or from E to E (1 − g); the arms by the matrix exponential."""
    share, time = 0.6, 2e-5
    damped = hl.damping.damped(BAR, StandardLinearSolid(share, time, modulus=modulus))
    arms = maxwell_arms(damped)
    assert arms is not None
    held = np.linalg.solve(BAR.stiffness.toarray(), BAR.contact) * STATIC_STIFFNESS  # 1 m at the contact
    stretched = arms.coupling @ held
    for t in (0.0, 1e-5, 4e-5, 1e-3):
        q = (np.eye(stretched.size) - expm(-t * np.diag(1.0 / arms.time))) @ stretched
        force = BAR.contact @ (damped.stiffness[: BAR.size] @ np.append(held, q))
        share_left = share * np.exp(-t / time) if modulus == "relaxed" else -share * (1.0 - np.exp(-t / time))
        assert force == pytest.approx(STATIC_STIFFNESS * (1.0 + share_left), rel=1e-10)


def test_each_layer_has_its_own_arm() -> None:
    """Layers in series: their compliances L/(E(ω)A) add."""
    layers = [
        hl.Layer(hl.STEEL_440C, 0.01, 0.01),
        hl.Layer(hl.PTFE, 0.02, 0.01),
        hl.Layer(hl.MATERIALS["nylon"], 0.03, 0.02),
    ]
    rod, parts = hl.rod(layers), stiffness_parts(hl.rod(layers))
    assert abs(sum(parts[1:], parts[0]) - rod.stiffness).max() < 1e-12 * abs(rod.stiffness).max()
    given = {1: (0.5, 1e-5), 2: (2.0, 8e-5)}
    for layer, (share, time) in given.items():
        rod = hl.damping.damped(rod, StandardLinearSolid(share, time), layer)
    for omega in (1e3, 1e5, 1e6):
        compliance = 0.0 + 0.0j
        for i, layer in enumerate(layers):
            share, time = given.get(i, (0.0, 1.0))
            factor = 1.0 + share * 1j * omega * time / (1.0 + 1j * omega * time)
            compliance += layer.length / (layer.material.youngs_modulus * layer.area * factor)
        assert dynamic_stiffness(rod, omega) == pytest.approx(1.0 / compliance, rel=1e-8)


LAYERED = [
    hl.Layer(hl.STEEL_440C, 6e-3, 9.5e-3),
    hl.Layer(hl.PTFE, 25e-3, 9.5e-3),
    hl.Layer(hl.MATERIALS["nylon"], 9e-3, 9.5e-3),
]


def test_parts_of_a_cylinder_add_to_its_stiffness() -> None:
    """In the order of the layers: the part of PTFE is that in which its modulus shows, and no more."""
    cylinder, parts = hl.layered_cylinder(LAYERED), stiffness_parts(hl.layered_cylinder(LAYERED))
    assert abs(sum(parts[1:], parts[0]) - cylinder.stiffness).max() < 1e-12 * abs(cylinder.stiffness).max()
    # Twice as stiff and as heavy, the layer has the same waves, and so the same mesh.
    twice = replace(hl.PTFE, youngs_modulus=2.0 * hl.PTFE.youngs_modulus, density=2.0 * hl.PTFE.density)
    stiffer = [replace(layer, material=twice) if layer.material == hl.PTFE else layer for layer in LAYERED]
    change = hl.layered_cylinder(stiffer).stiffness - cylinder.stiffness
    assert abs(change - parts[1]).max() < 1e-9 * abs(parts[1]).max()


@pytest.mark.parametrize("base", ["fixed", "free", "absorbing"])
def test_arms_leave_rigid_motion_and_static_loads_alone(base: str) -> None:
    """There are as many arms as ways to stretch, and K with relaxed arms is unchanged."""
    rod = hl.rod(LAYERS, base=base)
    arms = maxwell_arms(hl.damping.damped(rod, StandardLinearSolid(0.5, 1e-5)))
    assert arms is not None
    assert arms.coupling.shape == (rod.size - (base != "fixed"), rod.size)
    stretch = 0.5 * rod.stiffness
    assert abs(arms.coupling.T @ arms.coupling - stretch).max() < 1e-9 * abs(stretch).max()


@pytest.mark.parametrize("damp", [Rayleigh(500.0, 1e-7), Rayleigh(1e3)])
@pytest.mark.parametrize("base", ["fixed", "free"])
def test_rayleigh_stays_diagonal_in_a_reduction(damp: Rayleigh, base: str) -> None:
    """A reduced structure still consists of oscillators, whose rates are α + β ω² exactly."""
    note = hl.damping.damped(ROD, damp).origin["damping"][0]
    reduced = hl.reduce(hl.damping.damped(hl.rod(LAYERS, base=base), damp), until=1e-3)
    assert reduced.is_modal
    assert reduced.damping is not None
    expected = note["mass_rate"] + note["stiffness_time"] * reduced.stiffness.diagonal()
    assert reduced.damping.diagonal() == pytest.approx(expected, rel=1e-9)


DAMPED = {
    "Rayleigh": hl.damping.damped(ROD, Rayleigh(500.0, 1e-7)),
    "arm on the PTFE": hl.damping.damped(ROD, StandardLinearSolid(0.5, 2e-5), 1),
    "strong arm": hl.damping.damped(ROD, StandardLinearSolid(3.0, 2e-5), 1),
    "arms on both": hl.damping.damped(
        hl.damping.damped(ROD, StandardLinearSolid(0.5, 2e-5), 1), StandardLinearSolid(0.1, 1e-5), 0
    ),
    "one polymer": hl.damping.damped(hl.rod([hl.Layer(hl.ACRYLIC, 0.0762, 0.0191)]), StandardLinearSolid(0.3, 3e-5)),
    "absorbing": hl.damping.damped(hl.rod(LAYERS[1:], base="absorbing"), StandardLinearSolid(0.3, 3e-5)),
}


@pytest.mark.parametrize("name", DAMPED)
def test_reduced_and_full_give_one_amplitude_ratio(name: str) -> None:
    """Both waves agree within 1e-3, and only damping takes energy."""
    reduced = hl.reduce(DAMPED[name], until=1.2e-3)
    assert reduced.size < DAMPED[name].size
    runs = [hl.CoSimulation(CHAIN, structure, reduce=False).run(1.2e-3) for structure in (DAMPED[name], reduced)]
    for run in runs:
        assert hl.energy_error(run) < 1e-6
    for wave in ("primary", "secondary"):
        one, other = (getattr(hl.reflections(run, sensor=7), wave) for run in runs)
        assert bool(one) == bool(other)
        if one:
            assert other.amplitude_ratio == pytest.approx(one.amplitude_ratio, rel=1e-3)


@pytest.mark.parametrize(("scatter", "rate"), [(0.0, 2.0), (0.3, 2.0), (0.3, 40.0)])
def test_a_reduction_meets_damping_far_from_the_contact(scatter: float, rate: float) -> None:
    """A line of masses and springs that scatter, whose far third is damped, after a pulse at its end: as the whole."""
    random, size = np.random.default_rng(0), 400
    stiffness, mass = (scale * (1.0 + scatter * random.uniform(-1.0, 1.0, size)) for scale in (6e7, 4e-5))
    inside = stiffness + np.append(stiffness[1:], 0.0)
    line = sparse.diags_array([-stiffness[1:], inside, -stiffness[1:]], offsets=[-1, 0, 1], shape=(size, size))
    damping = sparse.diags_array(np.where(np.arange(size) < size // 3, rate, 0.0))
    end = np.zeros(size)
    end[-1] = 1.0
    whole = hl.Structure(sparse.diags_array(mass), line, damping, end, 0.0, hl.Surface(hl.PTFE))
    bodies = [hl.stepping.MovingStructure(body) for body in (whole, hl.reduce(whole, until=1e-3))]
    states, window, moved = [body.start() for body in bodies], 1e-6, []
    for step in range(1000):
        force = 10.0 * np.sin(np.pi * step / 40) ** 2 if step < 40 else 0.0
        ends = [body.advance(state, force, window) for body, state in zip(bodies, states, strict=True)]
        states = [state for state, _ in ends]
        moved.append([place for _, place in ends])
    exact, reduced = np.transpose(moved)
    assert bodies[1].size < 100
    assert abs(reduced - exact).max() < 0.01 * abs(exact).max()
    energies = [body.energy(state) for body, state in zip(bodies, states, strict=True)]
    assert energies[1] == pytest.approx(energies[0], rel=0.02)
