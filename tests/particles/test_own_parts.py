"""Bodies, laws, losses and excitations of a user's own: they run, are checked and described like those built in."""

import json
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from particles import kernels
from particles.excitation import Drive
from structures.structure import Vector

STEEL = hl.STEEL_316
BALL = hl.Sphere(4.76e-3, STEEL)


@dataclass(frozen=True)
class Drilled:
    """A user's body: a ball with less mass."""

    ball: hl.Sphere
    lighter: float = 1.0

    @property
    def mass(self) -> float:
        return self.lighter * self.ball.mass

    @property
    def size(self) -> float:
        return self.ball.size

    @property
    def surface(self) -> hl.Surface:
        return self.ball.surface


class Plain:
    """A user's body that is no dataclass, and changes."""

    def __init__(self, mass: float, size: float, surface: hl.Surface) -> None:
        self.mass, self.size, self.surface = mass, size, surface

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        return self is other


@pytest.mark.parametrize("body", [Drilled(BALL), Plain(BALL.mass, BALL.size, BALL.surface)], ids=["frozen", "plain"])
def test_a_users_body_like_a_sphere_is_one(body: hl.Bead) -> None:
    """In the chain and as a striker, with the bits of a Sphere's run, its checks and its description."""
    beads = [body, BALL, body, body, BALL, body]
    own, usual = (
        hl.CoSimulation(hl.Chain(some, some[0], 0.4, gravity=9.81), hl.half_space(hl.STEEL_316)).run(1e-4)
        for some in (beads, [BALL] * 6)
    )
    np.testing.assert_array_equal(own.contact_force.values, usual.contact_force.values)
    assert own.attrs["warnings"] == usual.attrs["warnings"]
    assert "yield" in own.attrs["warnings"]
    first = json.loads(own.attrs["input"])["chain"]["beads"][0]
    assert first.get("mass", BALL.mass) == BALL.mass
    assert hl.SpringLoaded(body, 200.0, 2e-3).body is body
    assert hl.contact_law(body, body) == hl.contact_law(BALL, BALL)


def test_the_law_of_a_body_that_changes_is_not_remembered() -> None:
    body = Plain(BALL.mass, BALL.size, BALL.surface)
    before = hl.contact_law(body, BALL)
    body.surface = hl.Surface(STEEL, 500.0)
    assert hl.contact_law(body, BALL).force(np.array(1e-6)) < before.force(np.array(1e-6))


def test_a_users_body_brings_the_compliance_of_its_wall() -> None:
    shell = hl.HollowSphere(9.525e-3, 8.655e-3, STEEL)
    body = Plain(shell.mass, shell.size, shell.surface)
    body.shell_flexibility = shell.shell_flexibility  # type: ignore[attr-defined]
    assert hl.contact_law(body, body) == hl.contact_law(shell, shell)


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (SimpleNamespace(mass=1.0, surface=BALL.surface), r"beads\[1\] = .*: has no size; must be a bead"),
        (SimpleNamespace(mass=-1.0, size=1e-2, surface=BALL.surface), r"beads\[1\]: mass = -1\.0: must be a positive"),
        (SimpleNamespace(mass=1.0, size=0.0, surface=BALL.surface), r"beads\[1\]: size = 0\.0: must be a positive"),
        (SimpleNamespace(mass=1.0, size=1.0, surface=STEEL), r"beads\[1\]: surface = .*: must be a Surface"),
        (3.0, r"beads = .*: must be a list of one bead"),
        (hl.half_space(STEEL), r"beads\[1\] = .*: must be a bead"),
    ],
)
def test_bodies_that_are_no_beads(body: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.Chain([BALL, body], BALL, 0.3)  # type: ignore[list-item]


@dataclass(frozen=True)
class OwnLaw(hl.ContactLaw):
    """Hertz's law, as a user writes it: the force alone."""

    stiffness: float

    def force(self, approach: Vector) -> Vector:
        return self.stiffness * np.asarray(approach) ** 1.5


def test_a_users_law_needs_its_force_only() -> None:
    """Slope, energy and inverse follow from it, and the run agrees with that of PowerLaw."""
    own, usual = OwnLaw(1e10), hl.laws.PowerLaw(1e10)
    approach = np.geomspace(1e-9, 1e-4, 20)
    assert own.tangent(approach) == pytest.approx(usual.tangent(approach), rel=1e-8)
    assert own.energy(approach) == pytest.approx(usual.energy(approach), rel=1e-7)
    assert own.approach(usual.force(approach)) == pytest.approx(approach, rel=1e-9)
    assert own.table_error < 1e-7
    runs = [hl.CoSimulation(hl.Chain([BALL] * 6, BALL, 0.4, law=law), None).run(1e-4) for law in (own, usual)]
    scale = float(runs[1].contact_force.max())
    assert runs[0].contact_force.values == pytest.approx(runs[1].contact_force.values, abs=1e-6 * scale)


class Kinked(hl.ContactLaw):
    """Two slopes, which no smooth table follows at the kink."""

    name = "kinked"

    def force(self, approach: Vector) -> Vector:
        return np.where(approach < 1.01e-6, 1e6 * approach, 1.01 + 1.6e6 * (approach - 1.01e-6))


def test_a_run_warns_of_a_law_that_its_table_does_not_follow() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="the table of kinked differs by .* % from its force"):
        run = hl.CoSimulation(hl.Chain([BALL] * 2, BALL, 0.1, law=Kinked()), None).run(5e-5)
    assert "kinked" in run.attrs["warnings"]


def test_laws_that_chains_refuse() -> None:
    for law, message in (
        (OwnLaw, "law = <class .*must be None, a law"),
        (lambda one: one, "law = <function .*two bodies"),
    ):
        with pytest.raises(ValueError, match=message):
            hl.Chain([BALL], BALL, 0.3, law=law)  # type: ignore[arg-type]

    class NoKey(hl.ContactLaw):
        __hash__ = None  # type: ignore[assignment]

        def force(self, approach: Vector) -> Vector:
            return approach

    with pytest.raises(ValueError, match="must be hashable; make NoKey a frozen dataclass"):
        hl.Chain([BALL], BALL, 0.3, law=NoKey())


@dataclass(frozen=True)
class OwnDashpot(hl.Dissipation):
    """LinearDashpot, as a user writes it."""

    viscosity: float
    kind = kernels.DASHPOT

    def coefficients(self, mass: Vector) -> Vector:
        return np.full_like(mass, self.viscosity)


class OwnPush(hl.Excitation):
    """A constant force on the first bead, from the two members that an excitation must have."""

    duration = 1e-3

    @property
    def drive(self) -> Drive:
        return Drive(kernels.PUSHED, np.array([[0.0, self.duration], [20.0, 20.0], [0.0, 0.0]]))

    def energy(self, mass: float, gravity: float) -> float:
        return 0.5 * (20.0 * self.duration) ** 2 / mass


def test_a_users_loss_and_excitation_are_those_built_in() -> None:
    force, own_force = (
        hl.CoSimulation(hl.Chain([BALL] * 5, striker, dissipation=loss), hl.half_space(STEEL)).run(1e-4).contact_force
        for striker, loss in (
            (hl.PushedBead([0.0, 1e-3], [20.0, 20.0]), hl.LinearDashpot(5.0)),
            (OwnPush(), OwnDashpot(5.0)),
        )
    )
    np.testing.assert_array_equal(own_force.values, force.values)


def test_parts_without_what_they_need_cannot_be_made() -> None:
    for kind in (hl.ContactLaw, hl.Dissipation, hl.Excitation):
        with pytest.raises(TypeError, match="abstract"):
            kind()  # type: ignore[abstract]


@pytest.mark.parametrize(
    ("kind", "coefficients", "message"),
    [
        (kernels.DASHPOT, lambda mass: mass * np.nan, r"Own\.coefficients: must be finite and not negative.*nan"),
        (kernels.DASHPOT, lambda mass: -5.0 + 0.0 * mass, r"Own\.coefficients: .*not np.float64\(-5\.0\)|not -5\.0"),
        (kernels.DASHPOT, lambda mass: 5.0, r"Own\.coefficients: must return \d+ numbers"),
        (kernels.DASHPOT, lambda mass: None, r"Own\.coefficients: must return \d+ numbers"),
        (kernels.DASHPOT, lambda mass: mass + 1j, r"Own\.coefficients: must return \d+ numbers"),
        (kernels.DASHPOT, lambda mass: mass[:-1], r"Own\.coefficients: must return \d+ numbers"),
        (99, lambda mass: mass, r"Own\.kind = 99: must be DASHPOT, TANGENT"),
        ("dashpot", lambda mass: mass, r"Own\.kind = 'dashpot': must be DASHPOT"),
        (None, lambda mass: mass, r"Own\.kind = None: must be DASHPOT"),
    ],
)
def test_a_loss_that_is_none_is_named(kind: Any, coefficients: Any, message: str) -> None:
    class Own(hl.Dissipation):
        def coefficients(self, mass: Any) -> Any:
            return coefficients(mass)

    Own.kind = kind
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    with pytest.raises(ValueError, match=message):
        hl.CoSimulation(hl.Chain([bead] * 4, bead, 0.3, dissipation=Own()), None).run(1e-4)
