# mypy: disable-error-code="arg-type, misc"
"""Bad input to chains, bodies, contact laws and losses: each error names the argument and its value, in one line.

Parts of a user's own are in test_own_parts.
"""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from math import pi
from types import SimpleNamespace
from typing import Any

import pytest

import hertzlink as hl
from hertzlink.stepping import MovingChain
from particles import solitary
from particles.deformable.bead_field import BeadField
from particles.deformable.vibration import vibration

STEEL = hl.STEEL_316
BALL, RADIUS = hl.Sphere(4.76e-3, hl.STEEL_440C), 2.38e-3
BEAD = hl.Sphere(RADIUS, STEEL)
SHELL = hl.HollowSphere(9.525e-3, 8.655e-3, STEEL)
LYING = hl.Cylinder(RADIUS, 4.76e-3, STEEL)
FLAT = hl.Surface(STEEL)
D, M, K = 2.0 * RADIUS, BEAD.mass, hl.theory.hertz_stiffness(BEAD.surface, BEAD.surface)

LONG = hl.Chain([BALL] * 20, BALL, 0.31)
STICKY = replace(LONG, dissipation=hl.LinearDashpot(2e4))
HANGING = hl.Chain([BEAD] * 5, BEAD, 0.3, gravity=9.81, inclination=-pi / 2.0)
WEAK = hl.SpringLoaded(BEAD, 1.0, 1e-4, travel=0.1)

Made = tuple[Callable[..., object], Mapping[str, Any]]
STRUCK = {"beads": [BALL] * 3, "striker": BALL, "impact_speed": 0.3}
CHAIN: Made = (hl.Chain, STRUCK)
DEFORMABLE: Made = (hl.DeformableChain, STRUCK)
COMPUTED_LAW: Made = (hl.laws.computed_law, {})


def body(**attributes: Any) -> SimpleNamespace:
    """A user's body with some attributes changed."""
    return SimpleNamespace(**({"mass": BALL.mass, "size": BALL.size, "surface": BALL.surface} | attributes))


def crossing(degrees: float = 0.0) -> hl.Cylinder:
    return hl.Cylinder(RADIUS, 4.76e-3, STEEL, math.radians(degrees))


@pytest.mark.parametrize(
    ("builder", "changes", "message"),
    [
        (CHAIN, {"beads": []}, "beads = "),
        (CHAIN, {"beads": ["steel"]}, r"beads\[0\] = 'steel': must be a bead"),
        (CHAIN, {"beads": [body(mass=None)]}, r"beads\[0\]: mass = None: must be a finite number of kg"),
        (CHAIN, {"beads": [body(surface=None)]}, r"beads\[0\]: surface = None: must be a Surface"),
        (CHAIN, {"beads": [body(shell_flexibility=-1e-9)]}, r"beads\[0\]: shell_flexibility = -1e-09: must be"),
        (CHAIN, {"dissipation": 4.0}, r"dissipation = 4\.0: must be None or a loss such as LinearDashpot"),
        (CHAIN, {"striker": hl.Piston([0.0, 1.0], [0.0, 1e-3])}, r"impact_speed = 0\.3: must be omitted"),
        (CHAIN, {"inclination": 90.0}, r"inclination = 90\.0: must lie between -2π and 2π, in rad"),
        (CHAIN, {"striker": hl.PushedBead([0.0, 1.0], [0.0, 0.0]), "impact_speed": None}, "have a positive energy"),
        (CHAIN, {"law": 3}, r"law = 3: must be None, a law such as PowerLaw"),
        (DEFORMABLE, {"beads": [hl.Cylinder(2e-3, 4e-3, STEEL)]}, re.escape("beads[0] = Cylinder")),
        (DEFORMABLE, {"beads": [BALL, hl.Ellipsoid(2e-3, 6e-3, STEEL, "across")]}, re.escape("beads[1] = Ellipsoid")),
        (DEFORMABLE, {"striker": hl.Cylinder(2e-3, 4e-3, STEEL)}, re.escape("striker = Cylinder")),
        (
            DEFORMABLE,
            {"law": lambda one: None},
            re.escape("must be a function of two bodies, law(body, next body or Surface) (too many"),
        ),
        (COMPUTED_LAW, {"first": 3.0, "max_force": 1.0}, r"first = 3\.0: must be a Sphere"),
        (COMPUTED_LAW, {"first": BALL, "second": "wall", "max_force": 1.0}, "second = 'wall': must be a Sphere"),
        (COMPUTED_LAW, {"first": BALL}, "max_force = None, max_approach = None: must be one of them"),
        (COMPUTED_LAW, {"first": BALL, "second": LYING, "max_force": 1.0}, "second = Cylinder.*along the chain"),
    ],
)
def test_bad_arguments(builder: Made, changes: dict[str, Any], message: str) -> None:
    make, given = builder
    with pytest.raises(ValueError, match=message) as error:
        make(**{**given, **changes})
    assert "\n" not in str(error.value)


@pytest.mark.filterwarnings("ignore:overflow:RuntimeWarning")
@pytest.mark.parametrize(
    ("call", "message"),
    [
        # Bodies and laws
        (lambda: hl.HollowSphere(1e-3, 1e-3, STEEL), r"inner_radius = 0\.001: must be less than the radius"),
        (lambda: hl.laws.TabulatedLaw([1e-6], [1.0]), r"approaches = \[1e-06\], forces: must be equally many"),
        (lambda: hl.laws.TabulatedLaw([1e-6, 2e-6, 3e-6], [1.0, 3.0, 2.0]), "that increase from zero"),
        (lambda: hl.contact_law(3.0, crossing()), r"first = 3\.0: must be a body"),
        (lambda: hl.contact_law(hl.Sphere(1e-2, STEEL), hl.Surface(STEEL, -200.0)), "curvature"),
        *[(lambda bad=bad: hl.Sphere(bad, hl.PTFE), "radius = ") for bad in (0.0, -1e-3, math.inf, "wide", None)],
        (lambda: BeadField(hl.Sphere(2.38e-3, STEEL), 3, 2e-3), r"widest = 0\.002: must be at most 0\.00119 m"),
        # Chains and their ends
        (lambda: hl.Chain([BEAD], "none"), r"striker = 'none': must be .* or None"),
        (lambda: MovingChain(hl.Chain([BEAD], BEAD, 0.3), FLAT, behind=FLAT), r"striker = Sphere.*: must be None or a"),
        (
            lambda: MovingChain(hl.Chain([BEAD], None, 0.3), FLAT, behind=FLAT, behind_flexibility=-1e-6),
            r"behind_flexibility = -1e-06: must be less negative, as this contact is wider",
        ),
        (lambda: MovingChain(hl.Chain([BEAD], None), None), "beads: must have a contact; a single bead"),
        (lambda: MovingChain(LONG, FLAT, flexibility=-1e-3), r"flexibility = -0\.001: must be less negative"),
        (lambda: MovingChain(LONG, FLAT, dt=1e-4), r"dt = 0\.0001: must be below .* for a stable step"),
        (lambda: MovingChain(STICKY, FLAT, dt=2e-6), "dt = 2e-06: must be below"),
        (lambda: hl.CoSimulation(replace(LONG, gravity=9.81), None), r"gravity = 9\.81: must be 0 for a chain that"),
        (lambda: hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3, preload=5.0), None), r"preload = 5\.0: must be 0 for"),
        (lambda: hl.CoSimulation(HANGING, hl.half_space(STEEL)), r"preload = 0\.0: must be at least 0\.02216 N to"),
        (
            lambda: hl.CoSimulation(hl.Chain([BEAD], hl.PushedBead([0.0, 1e-5], [1.0, 2.0])), None),
            "beads: must have a contact; a single bead without a striker faces nothing",
        ),
        (lambda: replace(HANGING, striker=WEAK, impact_speed=None, preload=1.0), "must be larger, as the striker does"),
        # Excitations
        (lambda: hl.SpringLoaded(3.0, 1e3, 1e-3), r"striker = 3\.0"),
        (lambda: hl.PushedBead([0.0, 1.0], [1.0]), "with one time for each force"),
        (lambda: hl.PushedBead([0.0, 0.0], [1.0, 2.0]), "time = .*: must increase from 0 s"),
        (lambda: hl.Piston([0.0, 1.0], [1e-6, 2e-6]), r"displacement\[0\] = .*: must be 0 m"),
        # Losses
        (lambda: hl.LinearDashpot(-1.0), r"coefficient = -1\.0: must be zero or a positive number of N s/m"),
        # Solitary waves
        (lambda: solitary.UniformChain(D, M, K).wave_speed_from_force(1.0, -1.0), "^preload = -1.0"),
        (lambda: solitary.UniformChain(D, M, K, 1.0).wave_speed_from_force(1.0), "^exponent = 1.0: must be greater"),
        (lambda: solitary.UniformChain(D, M, K).wave_speed_from_particle_speed(-0.1), "^particle_speed = -0.1"),
        # Vibrations
        (lambda: vibration(hl.Ellipsoid(RADIUS, RADIUS, STEEL), 3), "bead = Ellipsoid"),
    ],
)
def test_bad_calls(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message) as error:
        call()
    assert "\n" not in str(error.value)
