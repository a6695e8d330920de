# mypy: disable-error-code="arg-type, misc"
"""Bad input to structures: each error names the argument and its value, in one line.

Ranges of annotations have a row of each kind, as one function checks them; the searches of test_fuzz try all arguments.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from structures.bodies import layers as theory
from structures.damping import Modal, Rayleigh, StandardLinearSolid

FLAT = hl.Surface(hl.PTFE)
BALL = hl.Sphere(4.76e-3, hl.STEEL_440C)
LYING = hl.Cylinder(2e-3, 4e-3, hl.STEEL_316)
M, K = BALL.mass, hl.theory.hertz_stiffness(BALL.surface, BALL.surface)
BAD_SIZES = (0.0, -1.0, math.nan)

LAYERS = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
COATED = [hl.Layer(hl.STEEL_440C, 0.3e-3, 9.5e-3), hl.Layer(hl.PTFE, 25e-3, 9.5e-3)]
STEEL = hl.Layer(hl.STEEL_440C, length=76.2e-3, radius=19.1e-3)
BAR = hl.rod([hl.Layer(hl.PTFE, 0.05, 0.01)], elements=1)
STRUCK = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], elements=6)
TWO = hl.rod(LAYERS, base="contact", elements=6)
BLOCK = hl.Structure(np.eye(1), np.eye(1), None, np.ones(1), 0.0, FLAT)
MOVING, TWO_MOVING = hl.stepping.MovingStructure(STRUCK), hl.stepping.MovingStructure(TWO)

SPRING = np.array([[2e7, -1e7], [-1e7, 1e7]])
MASS = np.diag([0.01, 0.02])
NO_NEGATIVE = "must have no negative eigenvalue"

Made = tuple[Callable[..., object], Mapping[str, Any]]
ROD: Made = (hl.rod, {})
CYLINDER: Made = (hl.layered_cylinder, {})
AT_TWO_POINTS: Made = (lambda **changes: replace(TWO, **changes), {})
BODY: Made = (
    hl.Structure,
    {"mass": MASS, "stiffness": SPRING, "damping": None, "contact": (0.0, 1.0), "flexibility": 0.0, "surface": FLAT},
)


@pytest.mark.parametrize(
    ("builder", "changes", "message"),
    [
        (ROD, {"layers": []}, "layers"),
        (ROD, {"layers": [STEEL], "base": "fix"}, r"base = 'fix'.*did you mean 'fixed'"),
        (ROD, {"layers": [STEEL], "elements": 0}, "elements = 0"),
        (
            CYLINDER,
            {"layers": [STEEL, hl.Layer(hl.PTFE, 0.02, 0.01)]},
            r"layers: have radii \[0\.0191, 0\.01\] m.*rod\(\)",
        ),
        (
            CYLINDER,
            {"layers": [STEEL], "patch_radius": 0.02},
            r"patch_radius = 0\.02: must not exceed the cylinder's radius, 0\.0191 m",
        ),
        (CYLINDER, {"layers": [STEEL], "highest_frequency": 1e12}, "highest_frequency, cells: must make"),
        (
            CYLINDER,
            {"layers": COATED, "patch_radius": 2e-3},
            r"patch_radius = 0\.002: must not exceed the first layer's length, 0\.0003 m",
        ),
        (AT_TWO_POINTS, {"contact": np.ones((3, 2))}, r"mass has shape .*: must be \(3, 3\), as contact has 3 entries"),
        (AT_TWO_POINTS, {"contact": np.ones((TWO.size, 2, 2))}, r"contact has shape .*: must be \(n,\), or \(n, p\)"),
        (AT_TWO_POINTS, {"flexibility": [0.0, 1e-9, 0.0]}, "flexibility, surface: must be one for all contacts, or 2"),
        (AT_TWO_POINTS, {"surface": [FLAT]}, "flexibility, surface: must be one for all contacts, or 2"),
        (BODY, {"stiffness": -SPRING}, f"stiffness: {NO_NEGATIVE}, but entry \\(0, 0\\) is -2e\\+07"),
        (
            BODY,
            {"stiffness": [[1e7, -2e7], [-2e7, 1e7]]},
            f"stiffness: {NO_NEGATIVE}, but has an eigenvalue of about -1e\\+07 N/m",
        ),
        (BODY, {"stiffness": [[0.0, 1e7], [1e7, 1e7]]}, f"stiffness: {NO_NEGATIVE}, but has an eigenvalue of about"),
        (
            BODY,
            {"stiffness": [[2e7, -1e7], [0.0, 1e7]]},
            r"stiffness: must be symmetric, but entries \(0, 1\) and \(1, 0\) differ",
        ),
        (BODY, {"mass": [[0.01, 0.0], [0.0, -0.01]]}, f"mass: {NO_NEGATIVE}, but entry \\(1, 1\\) is -0.01"),
        (BODY, {"mass": [[0.01, 0.01], [0.01, 0.01]]}, "mass: must be positive definite, but has an eigenvalue"),
        (BODY, {"damping": [[5.0, 0.0], [0.0, -5.0]]}, f"damping: {NO_NEGATIVE}, but entry \\(1, 1\\) is -5"),
        (BODY, {"damping": [[0.0, 5.0], [-5.0, 0.0]]}, "damping: must be symmetric"),
        (BODY, {"contact": [0.0, 0.0]}, r"contact has shape \(2,\): must be .* and not be zero"),
        (BODY, {"mass": np.diag([0.0, 1.0]), "stiffness": np.diag([0.0, 1e7])}, "degree of freedom 0 must have one"),
        (BODY, {"stiffness": np.ones((2, 3))}, r"stiffness has shape \(2, 3\): must be square"),
        (BODY, {"contact": [1.0, 0.0, 0.0]}, r"mass has shape \(2, 2\): must be \(3, 3\)"),
        (BODY, {"contact": [0.0, np.nan]}, "contact = nan: must be a finite number"),
        (BODY, {"surface": "flat"}, "surface = 'flat': must be a Surface"),
        (BODY, {"valid_until": 0.0}, r"valid_until = 0\.0: must be a positive number of s"),
    ],
)
def test_bad_arguments(builder: Made, changes: dict[str, Any], message: str) -> None:
    make, given = builder
    with pytest.raises(ValueError, match=message) as error:
        make(**{**given, **changes})
    assert "\n" not in str(error.value)


@pytest.mark.filterwarnings("error::numpy.exceptions.ComplexWarning")
@pytest.mark.parametrize(
    ("call", "message"),
    [
        # Anisotropy
        (
            lambda: hl.theory.orthotropic_stiffness((1e9, 1e9), (0.3,) * 3, (4e8,) * 3),
            r"moduli = .*must be three numbers above 1 Pa",
        ),
        (
            lambda: hl.theory.orthotropic_stiffness((1e9,) * 3, (0.3,) * 3, (4e8, 0.0, 4e8)),
            r"shear_moduli = .*three numbers above 1 Pa",
        ),
        (
            lambda: hl.theory.orthotropic_stiffness((1e9,) * 3, (0.6,) * 3, (4e8,) * 3),
            r"poisson_ratios = \(0\.6, .*must be smaller",
        ),
        *[
            (lambda bad=bad: hl.theory.indentation_modulus(bad), "stiffness: must be a symmetric, positive definite")
            for bad in (np.eye(3), np.eye(6) + np.eye(6, k=1), -np.eye(6))
        ],
        # Damping
        (
            lambda: hl.damping.damped(BAR, Rayleigh(-1.0)),
            r"mass_rate = -1\.0: must be zero or a positive number of 1/s",
        ),
        (
            lambda: hl.damping.damped(hl.damping.damped(BAR, StandardLinearSolid(1.0, 1.0)), Rayleigh(0.0, 1.0)),
            "add Rayleigh before StandardLinearSolid",
        ),
        (lambda: hl.damping.damped(BAR, Modal(0.1)), r"structure: must consist of modes; reduce it first"),
        (lambda: StandardLinearSolid(0.0, 1e-6), "share"),
        (lambda: StandardLinearSolid(0.1, 0.0), "time"),
        (lambda: StandardLinearSolid(0.1, 1e-6, "slow"), "modulus"),
        (
            lambda: hl.damping.damped(BAR, StandardLinearSolid(1.0, 1e-5, modulus="instantaneous")),
            r"share = 1\.0: must be below 1",
        ),
        (
            lambda: hl.damping.damped(
                hl.damping.damped(BAR, StandardLinearSolid(1.0, 1e-5)), StandardLinearSolid(1.0, 1e-5)
            ),
            "part: the structure has Maxwell arms already",
        ),
        (lambda: hl.damping.damped(BAR, 0.1), r"damping = 0\.1: must be hl\.damping\.Rayleigh, Modal or"),
        (
            lambda: hl.damping.damped(BAR, Rayleigh(1.0), part=0),
            r"damping = Rayleigh\(.*: must be a StandardLinearSolid, which alone acts on a part",
        ),
        (
            lambda: hl.damping.damped(hl.reduce(BAR, 1e-3), StandardLinearSolid(1.0, 1e-5), part=0),
            "this rod lost its field in the reduction",
        ),
        (
            lambda: hl.damping.damped(hl.rod(LAYERS), StandardLinearSolid(1.0, 1e-5), part=9),
            "part = 9: must be .* at most 1",
        ),
        # Moving structures
        *[
            (
                lambda force=force: TWO_MOVING.advance(TWO_MOVING.start(), force, 1e-6),
                "force = .*: must be 2 numbers in N",
            )
            for force in (1.0, [1.0], [1.0, 2.0, 3.0], [[1.0, 2.0]], None, "ab")
        ],
        *[
            (lambda bad=bad: MOVING.step(bad), f"window = {bad!r}: must be a ")
            for bad in (0.0, -1e-6, math.nan, None, "x")
        ],
        # Theory of layers
        (lambda: theory.contact_time(M, K, 0.0), "^speed = 0.0: must be a positive number of m/s"),
        (lambda: theory.time_of_flight(13, 1.0, 1.0, 1.0, 1.0, 1.01), "^restitution = 1.01: must lie between 0 and 1"),
        (lambda: theory.restitution(M, M), "^upper_mass = .*: must be greater than mass = "),
        (lambda: theory.restitution(1.0, np.array([3.0, 0.5])), r"^upper_mass = 0\.5: must be greater than mass"),
        (lambda: theory.secondary_delay(1.0, 0.0, 0.0), "^lower_stiffness = 0.0: must be a positive number of N/m"),
        # Rods
        (lambda: hl.Layer(hl.STEEL_440C, 25.4, 9.525), r"radius = 9\.525: must lie between 0 and 5 m"),
        (lambda: hl.rod([hl.Layer(hl.STEEL_440C, 0.1, 9.5e-3)], elements=10**9), "elements: 1000000000 in the rod are"),
        # Materials and surfaces
        *[
            (lambda bad=bad: hl.Material(bad, 0.3, 1e3), "youngs_modulus = ")
            for bad in (*BAD_SIZES, math.inf, "soft", None)
        ],
        *[
            (lambda bad=bad: hl.Material(1e9, bad, 1e3), "poisson_ratio = .* between -1 and 0.5")
            for bad in (0.5, -1.0, 0.7)
        ],
        (lambda: hl.theory.hertz_stiffness(FLAT, FLAT), "curvature"),
        (lambda: hl.theory.hertz_pressure(LYING.surface, FLAT, 1.0), "touch along a line"),
        (lambda: hl.theory.layer_restitution(0.5 + 0j, 1.0), "mass = .*: must be a number or an array"),
    ],
)
def test_bad_calls(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message) as error:
        call()
    assert "\n" not in str(error.value)


def test_an_origin_of_a_users_own_is_never_taken_for_ours() -> None:
    """Names that structures of hertzlink use in an origin may hold anything."""
    names = ("thickness", "section", "supports", "reduction", "cells", "highest_frequency", "kind")
    block = replace(BLOCK, origin=dict.fromkeys(names, "own"))
    bead = hl.Sphere(4.76e-3, hl.STEEL_316)
    run = hl.CoSimulation(hl.Chain([bead] * 3, bead, 0.1), block).run(5e-5)
    assert '"thickness": "own"' in run.attrs["input"]
