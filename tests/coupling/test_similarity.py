"""Similarity: without gravity and losses with a time, lengths and times that are n times as large change no ratio.

Stress, speed and force/length² stay; nothing in a builder, a reduction or a run may contain a length or a time.
"""

import pickle
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import skfem
import skfem.io.meshio

import hertzlink as hl
from hertzlink.damping import damped

STEEL, PTFE, ALLOY = hl.STEEL_440C, hl.PTFE, hl.ALUMINIUM_6061
CLAMPED = hl.Supports("clamped", "clamped", "clamped", "clamped")
PULSE, UNTIL, FREQUENCY = 40e-6, 6e-4, 30e3
RUBBER = hl.Material(4e6, 0.49, 1100.0)


def layers(n: float) -> list[hl.Layer]:
    return [hl.Layer(STEEL, 6e-3 * n, 9e-3 * n), hl.Layer(PTFE, 10e-3 * n, 9e-3 * n)]


def up_to(n: float) -> dict[str, float]:
    return {"highest_frequency": FREQUENCY / n}


def rectangle(n: float, additions: list[Any] | None = None, supports: hl.Supports = CLAMPED) -> hl.Structure:
    plate = hl.kirchhoff_plate(0.1 * n, 0.08 * n, 2e-3 * n, ALLOY, supports, additions=additions or [], **up_to(n))
    return plate.at(0.04 * n, 0.03 * n)


def cross_ply(n: float) -> hl.Structure:
    carbon = hl.OrthotropicMaterial(135e9, 9e9, 0.3, 5e9, 5e9, 3.2e9, 1560.0)
    wall = hl.Laminate([hl.Ply(carbon, 0.5e-3 * n, angle) for angle in (0.0, 1.5, 1.5, 0.0)])
    return hl.kirchhoff_plate(0.1 * n, 0.08 * n, None, wall, CLAMPED, **up_to(n)).at(0.04 * n, 0.03 * n)


def disc(n: float) -> hl.Structure:
    outline = hl.Outline(hl.circle(0.04 * n), edges=("rim",) * 96)
    made = hl.mindlin_panel(outline, 3e-3 * n, ALLOY, {"rim": "clamped"}, **up_to(n)).at(0.01 * n, 0.0)
    assert isinstance(made, hl.Structure)
    return made


def cube(n: float) -> hl.Structure:
    line = np.linspace(0.0, 20e-3 * n, 7)
    mesh = skfem.io.meshio.to_meshio(skfem.MeshHex.init_tensor(line, line, line))
    return hl.solid(mesh, hl.ACRYLIC, contact=(10e-3 * n, 10e-3 * n, 20e-3 * n), patch_radius=6e-3 * n, scale=1.0)


BUILDERS: dict[str, Callable[[float], Any]] = {
    "half-space": lambda n: hl.half_space(PTFE),
    "rod": lambda n: hl.rod(layers(n), elements=20),
    "viscous rod": lambda n: damped(hl.rod(layers(n), elements=12), hl.damping.StandardLinearSolid(0.4, 2e-5 * n)),
    "damped rod": lambda n: damped(hl.rod(layers(n), elements=20), hl.damping.Rayleigh(100.0 / n, 1e-7 * n)),
    "cylinder": lambda n: hl.layered_cylinder(layers(n), **up_to(n)),
    "solid": cube,
    "thin plate": rectangle,
    "plate with additions": lambda n: rectangle(
        n,
        [
            hl.PointMass(0.06 * n, 0.06 * n, 0.02 * n**3),
            hl.Weakened((0.01 * n, 0.03 * n, 0.01 * n, 0.02 * n), 0.5),
            hl.Stiffener((0.02 * n, 0.05 * n), (0.08 * n, 0.05 * n), 10.0 * n**4, 2.0 * n**4, 0.1 * n**2),
            hl.Prestress(xx=5e4 * n),
        ],
    ),
    "elastic edges": lambda n: rectangle(n, supports=hl.Supports(hl.ElasticEdge(1e6, 1e2 * n**2), "simple", "free")),
    "laminate": cross_ply,
    "thick plate": lambda n: hl.mindlin_plate(0.1 * n, 0.08 * n, 4e-3 * n, ALLOY, CLAMPED, **up_to(n)).at(
        0.04 * n, 0.03 * n
    ),
    "panel": disc,
    "any position": lambda n: hl.ModalPlate(
        hl.kirchhoff_plate(0.1 * n, 0.08 * n, 2e-3 * n, ALLOY, CLAMPED, **up_to(n)), UNTIL * n
    ).at(0.042 * n, 0.03 * n),
    "half-plane": lambda n: hl.half_plane(2e-3 * n, ALLOY, "clamped", 0.03 * n, UNTIL * n, **up_to(n)),
    "infinite plate": lambda n: hl.infinite_plate(2e-3 * n, ALLOY),
    "beam": lambda n: hl.beam(
        0.1 * n, 0.9 * n**4, 0.05 * n**2, ALLOY, 0.04 * n, axial_force=200.0 * n**2, foundation=1e5, **up_to(n)
    ),
}  # fmt: skip

TIES = {"panel"}
"""Rounding decides which of two equal triangles is made, or which of two equal directions is left out: only for powers
of two are their numbers those of another size."""


LONG = {*TIES, "solid", "thick plate", "any position"}
LONG |= {"cylinder on ground", "viscous rod"}


def ratios(build: Callable[[float], Any], n: float) -> list[float]:
    """AR, TOF/n, and of the force at a sensor, over n²: largest value, mean and middle."""
    body = build(n)
    if isinstance(body, hl.Structure) and body.size > 100:
        body = hl.reduce(body, UNTIL * n, pulse=PULSE * n)
    bead = hl.Sphere(4e-3 * n, STEEL)
    chain = hl.Chain([bead] * 10, bead, impact_speed=0.2, gravity=9.81 / n, dissipation=hl.LinearDashpot(2.0 * n**2))
    run = hl.CoSimulation(chain, body).run(UNTIL * n)
    force = hl.sensor_force(run, 5).values / n**2
    middle = float(force @ np.linspace(0.0, 1.0, force.size) / force.sum())
    wave = hl.reflections(run, sensor=5).primary
    found = [wave.amplitude_ratio, wave.time_of_flight / n] if wave else [0.0, 0.0]
    return [*found, float(force.max()), float(force.mean()), middle]


@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.thorough] if name in LONG else []) for name in BUILDERS]
)
def test_all_lengths_and_times_multiplied(name: str) -> None:
    expected = ratios(BUILDERS[name], 1.0)
    for n in (1.0 / 16.0, 16.0) if name in TIES else (0.1, 10.0):
        assert ratios(BUILDERS[name], n) == pytest.approx(expected, rel=1e-7)


def ply_plate(n: float) -> hl.Structure:
    carbon = hl.OrthotropicMaterial(135e9, 9e9, 0.3, 5e9, 5e9, 3.2e9, 1560.0)
    wall = hl.Laminate([hl.Ply(carbon, 0.5e-3 * n, angle) for angle in (0.0, 1.5, 1.5, 0.0)])
    return hl.kirchhoff_plate(0.12 * n, 0.1 * n, None, wall, CLAMPED).at(0.04 * n, 0.03 * n)


DEFAULTS: dict[str, Callable[[float], hl.Structure]] = {
    "half-space": lambda n: hl.half_space(PTFE),
    "rod": lambda n: hl.rod([hl.Layer(STEEL, 0.5 * n, 9e-3 * n)]),
    "cylinder": lambda n: hl.layered_cylinder(layers(n)),
    "beam": lambda n: hl.beam(0.3 * n, 333.0 * n**4, 1.57 * n**2, STEEL, 0.1 * n),
    "thin plate": lambda n: hl.kirchhoff_plate(0.12 * n, 0.1 * n, 2e-3 * n, ALLOY, CLAMPED).at(0.04 * n, 0.03 * n),
    "thick plate": lambda n: hl.mindlin_plate(0.12 * n, 0.1 * n, 4e-3 * n, ALLOY, CLAMPED).at(0.04 * n, 0.03 * n),
    "laminate": ply_plate,
    "solid": cube,
    "half-plane": lambda n: hl.half_plane(2e-3 * n, ALLOY, "clamped", 0.03 * n, 1.2e-3 * n),
}


def primary(n: float, body: hl.Structure) -> float:
    """AR of 12 steel beads of 4.76 mm radius, times n."""
    bead = hl.Sphere(4.76e-3 * n, STEEL)
    run = hl.CoSimulation(hl.Chain([bead] * 12, bead, 0.3), body).run(1.2e-3 * n)
    return float(hl.amplitude_ratio(run, 6))


@pytest.mark.filterwarnings("error:(mesh|reduction)::hertzlink", "ignore::hertzlink.HertzlinkWarning")
@pytest.mark.parametrize(
    "name",
    [
        pytest.param(
            name, marks=[pytest.mark.thorough] if name in LONG | {"cylinder", "laminate", "thin plate"} else []
        )
        for name in DEFAULTS
    ],
)
def test_default_meshes_and_reductions_follow_the_contact(name: str) -> None:
    build = DEFAULTS[name]
    wanted = primary(1.0, build(1.0))
    for n in (0.1, 10.0):
        assert primary(n, build(n)) == pytest.approx(wanted, rel=5e-3)
    if build(1.0).valid_until == np.inf:
        assert primary(0.1, hl.reduce(build(0.1), 1.2e-4)) == pytest.approx(wanted, rel=5e-3)


def test_what_an_argument_says_stays_and_a_warning_says_how_wrong() -> None:
    """A mesh for 40 kHz under beads of 0.476 mm."""
    plate = hl.kirchhoff_plate(0.012, 0.01, 2e-4, ALLOY, CLAMPED, highest_frequency=4e4).at(4e-3, 3e-3)
    with pytest.warns(hl.HertzlinkWarning, match="mesh: it resolves .* AR may be wrong by ") as said:
        found = primary(0.1, plate)
    words = next(str(one.message) for one in said if str(one.message).startswith("mesh: "))
    error = float(words.split("AR may be wrong by ")[1].split(",")[0])
    assert 1e-3 < abs(found - primary(1.0, DEFAULTS["thin plate"](1.0))) < error


def test_a_structure_is_made_once_for_short_contacts() -> None:
    """Damping and reduction are repeated, one structure with two contacts stays one, and large bodies are left."""
    bar = hl.damping.damped(hl.rod([hl.Layer(STEEL, 0.5, 9e-3)], base="contact"), hl.damping.Rayleigh(100.0))
    small = hl.reduce(bar, 1e-3)
    fine = small.for_contacts(4)
    assert fine is small.for_contacts(4) is fine.for_contacts(4) is not small is small.for_contacts(1)
    assert pickle.loads(pickle.dumps(small)).for_contacts(4).size == fine.size
    assert fine.origin["elements"][0] == pytest.approx(4 * bar.origin["elements"][0], abs=4)
    assert fine.origin["damping"] == small.origin["damping"]
    assert fine.origin["reduction"]["pulse"] == 25e-6 / 4.0
    large = hl.rod([hl.Layer(STEEL, 200.0, 9e-3)])
    assert large.for_contacts(2) is large
    assert replace(bar, flexibility=1e-9).for_contacts(4).flexibilities.tolist() == [1e-9, 1e-9]


@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
@pytest.mark.parametrize("name", ["half-space", "rod", "infinite plate"])
def test_all_moduli_and_densities_multiplied(name: str) -> None:
    """At √(E/ρ) times the speed, times go as √(ρ/E), forces as E, gravity as E/ρ, and dashpots as √(E ρ)."""

    def seen(modulus: float, density: float) -> tuple[float, np.ndarray]:
        def other(one: hl.Material) -> hl.Material:
            return replace(one, youngs_modulus=modulus * one.youngs_modulus, density=density * one.density, name="")

        swift, rod = np.sqrt(modulus / density), [replace(one, material=other(one.material)) for one in layers(1.0)]
        bodies = {
            "half-space": lambda: hl.half_space(other(PTFE)),
            "rod": lambda: hl.rod(rod, elements=20),
            "infinite plate": lambda: hl.infinite_plate(2e-3, other(ALLOY)),
        }
        bead = hl.Sphere(4e-3, other(STEEL))
        loss = hl.LinearDashpot(2.0 * np.sqrt(modulus * density))
        chain = hl.Chain([bead] * 10, bead, 0.2 * swift, gravity=9.81 * modulus / density, dissipation=loss)
        run = hl.CoSimulation(chain, bodies[name]()).run(UNTIL / swift, UNTIL / swift / 600.0)
        return float(run.time[-1]) * swift, run.contact_force.values / modulus

    (until, expected), *others = (seen(*of) for of in ((1.0, 1.0), (3.0, 1.0), (1.0, 0.2), (0.1, 7.0)))
    for ends, found in others:
        assert ends == pytest.approx(until, rel=1e-12)
        assert found == pytest.approx(expected, abs=1e-8 * expected.max())


@pytest.mark.parametrize("body", [None, hl.half_space(PTFE)], ids=["alone", "on a half-space"])
def test_a_faster_striker_is_another_scale_of_hertzian_chains(body: Any) -> None:
    """Without gravity and losses forces go as v^(6/5), times as v^(−1/5), whatever the form of the wave."""
    bead = hl.Sphere(4e-3, STEEL)

    def seen(faster: float) -> np.ndarray:
        until = UNTIL * faster**-0.2
        run = hl.CoSimulation(hl.Chain([bead] * 10, bead, 0.1 * faster), body).run(until, until / 600.0)
        force: np.ndarray = run.contact_force.values / faster**1.2
        return force

    expected = seen(1.0)
    for faster in (0.01, 2.0, 30.0):
        assert seen(faster) == pytest.approx(expected, abs=1e-7 * expected.max())
