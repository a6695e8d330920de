"""Bodies, laws, losses and excitations of a user's own: they run, are checked and described like those built in."""

import json
import re
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from coupling.results.provenance import stored
from particles.excitation import Drive
from particles.kernels import drives
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
    """A user's body that is not a dataclass, and changes."""

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
    first = stored(own.attrs["input"])["chain"]["beads"][0]
    assert first.get("mass", BALL.mass) == BALL.mass
    assert hl.SpringLoaded(body, 200.0, 2e-3).body is body
    assert hl.contact_law(body, body) == hl.contact_law(BALL, BALL)


def test_the_law_of_a_body_that_changes_is_not_remembered() -> None:
    body = Plain(BALL.mass, BALL.size, BALL.surface)
    before = hl.contact_law(body, BALL)
    body.surface = hl.Surface(STEEL, 500.0)
    assert hl.contact_law(body, BALL).force(np.array(1e-6)) < before.force(np.array(1e-6))


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (SimpleNamespace(mass=1.0, surface=BALL.surface), r"beads\[1\] = .*: must be a bead, .* size"),
        (SimpleNamespace(mass=-1.0, size=1e-2, surface=BALL.surface), r"beads\[1\]: mass = -1\.0: must be a positive"),
        (SimpleNamespace(mass=1.0, size=0.0, surface=BALL.surface), r"beads\[1\]: size = 0\.0: must be a positive"),
        (SimpleNamespace(mass=1.0, size=1.0, surface=STEEL), r"beads\[1\]: surface = .*: must be a Surface"),
        (3.0, r"beads\[1\] = 3\.0: must be a bead, such as a Sphere"),
        (hl.half_space(STEEL), r"beads\[1\].*: must be"),
    ],
)
def test_bodies_that_are_no_beads(body: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.Chain([BALL, body], BALL, 0.3)  # type: ignore[list-item]


@pytest.mark.parametrize(
    ("body", "message"),
    [
        (Plain(BALL.mass, 9.52, BALL.surface), r"Plain size = 9\.52: is read as 9\.52 m, .* mean \S+ mm\?"),
        (Plain(1e-3 * BALL.mass, BALL.size, BALL.surface), r"Plain mass / size³ = 4\.1.*kg/m³, .* mean \S+ g/cm³\?"),
        (Plain(1e3 * BALL.mass, BALL.size, BALL.surface), r"Plain mass / size³ = 4\.1.*kg/m³, .* mean \S+ g/m³\?"),
    ],
)
def test_a_users_body_in_other_units_is_doubted(body: hl.Bead, message: str) -> None:
    """Once for each body, wherever it is."""
    for make in (
        lambda: hl.Chain([body] * 3, BALL, 0.3),
        lambda: hl.Chain([body] * 3, body, 0.3),
        lambda: hl.Chain([BALL], body, 0.3),
        lambda: hl.SpringLoaded(body, 200.0, 2e-3),
        lambda: hl.CoSimulation(hl.Chain([body] * 3, BALL, 0.3), hl.half_space(hl.PTFE)),
    ):
        with pytest.warns(hl.HertzlinkWarning, match=message) as found:
            make()
        assert [one.filename for one in found if re.search(message, str(one.message))] == [__file__]


@dataclass(frozen=True)
class OwnLaw(hl.laws.ContactLaw):
    """Hertz's law, as a user writes it: the force alone."""

    stiffness: float

    def force(self, approach: Vector) -> Vector:
        return self.stiffness * np.asarray(approach) ** 1.5


@pytest.mark.thorough
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


class Kinked(hl.laws.ContactLaw):
    """Two slopes, which no smooth table follows at the kink."""

    name = "kinked"

    def force(self, approach: Vector) -> Vector:
        return np.where(approach < 1.01e-6, 1e6 * approach, 1.01 + 1.6e6 * (approach - 1.01e-6))


def test_a_run_warns_of_a_law_that_its_table_does_not_follow() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="the table of kinked differs by .* % from its force"):
        run = hl.CoSimulation(hl.Chain([BALL] * 2, BALL, 0.1, law=Kinked()), None).run(5e-5)
    assert "kinked" in run.attrs["warnings"]


@dataclass(frozen=True)
class OwnDashpot(hl.Dissipation):
    """LinearDashpot, as a user writes it."""

    viscosity: float
    piece = "dashpot"

    def coefficients(self, mass: Vector) -> Vector:
        return np.full_like(mass, self.viscosity)


class OwnPush(hl.Excitation):
    """A constant force on the first bead, from the two members that an excitation must have."""

    duration = 1e-3

    @property
    def drive(self) -> Drive:
        return Drive(drives.PUSHED, np.array([[0.0, self.duration], [20.0, 20.0], [0.0, 0.0]]))

    def energy(self, mass: float, gravity: float) -> float:
        return 0.5 * (20.0 * self.duration) ** 2 / mass


@pytest.mark.thorough
def test_a_users_loss_and_excitation_are_those_built_in() -> None:
    force, own_force = (
        hl.CoSimulation(hl.Chain([BALL] * 5, striker, dissipation=loss), hl.half_space(STEEL)).run(1e-4).contact_force
        for striker, loss in (
            (hl.PushedBead([0.0, 1e-3], [20.0, 20.0]), hl.LinearDashpot(5.0)),
            (OwnPush(), OwnDashpot(5.0)),
        )
    )
    np.testing.assert_array_equal(own_force.values, force.values)


class Changing(hl.laws.ContactLaw):
    """A user's law that is not a dataclass, and changes."""

    def __init__(self, *stiffness: float) -> None:
        self.stiffness, self.also = stiffness[0], list(stiffness)

    def force(self, approach: Vector) -> Vector:
        return self.also[0] * np.asarray(approach) ** 1.5


def test_a_law_that_changes_is_never_stale() -> None:
    """Each simulation takes the law as it was when the simulation was made, and saves its parameters."""
    law = Changing(1e10)
    chain = hl.Chain([BALL] * 4, BALL, 0.4, law=law)

    def peak(simulation: hl.CoSimulation) -> float:
        return float(simulation.run(5e-5).contact_force[:, 1].max())

    first = hl.CoSimulation(chain, None)
    soft = peak(first)
    law.also[0] = 2e10
    assert peak(first) == soft
    fresh = hl.CoSimulation(hl.Chain([BALL] * 4, BALL, 0.4, law=Changing(2e10)), None)
    assert peak(hl.CoSimulation(chain, None)) == peak(fresh) > 1.1 * soft
    assert law.energy(np.array(1e-5)) == pytest.approx(hl.laws.PowerLaw(2e10).energy(np.array(1e-5)), rel=1e-6)
    law.stiffness, law.also = 1.0, [1e10]
    assert law.energy(np.array(1e-5)) == pytest.approx(hl.laws.PowerLaw(1e10).energy(np.array(1e-5)), rel=1e-6)
    laws = [json.loads(one.run(1e-5).attrs["input"])["chain"]["law"] for one in (first, fresh)]
    assert laws == [{"class": "Changing", "stiffness": k, "also": [k]} for k in (1e10, 2e10)]


def push(**members: Any) -> hl.Excitation:
    """OwnPush with other members; those that a call gives are functions of self and more."""
    kind: Any = type("Own", (OwnPush,), members)
    return kind()  # type: ignore[no-any-return]


def drive(*given: Any, **more: Any) -> hl.Excitation:
    return push(drive=property(lambda self: Drive(*given, **more)))


STEADY_PUSH = np.array([[0.0, 1e-3], [20.0, 20.0], [0.0, 0.0]])


@pytest.mark.parametrize(
    ("excitation", "message"),
    [
        (drive("push"), r"Drive\('push', .*: must have a valid kind"),
        (drive(drives.PUSHED, STEADY_PUSH[:2]), "a history of 3 × n"),
        (drive(drives.PUSHED, np.nan * STEADY_PUSH), "a history of 3 × n"),
        (drive(drives.PUSHED, 1.0 + STEADY_PUSH), "a history of 3 × n"),
        (drive(drives.PUSHED, -STEADY_PUSH), "a history of 3 × n"),
        (drive(drives.FREE), "striker = .*: must have a body if its drive is FREE"),
        (drive(drives.MOVED, STEADY_PUSH), "striker = .*: must have .* a surface if MOVED"),
        (push(energy=lambda self, *given: 0.0), "striker = .*: must have a positive energy"),
        (push(energy=lambda self, *given: np.nan), "striker = .*: must have a positive energy"),
    ],
)
def test_an_excitation_that_is_none_is_named(excitation: hl.Excitation, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.Chain([BALL] * 3, striker=excitation)


def own_loss(**members: Any) -> hl.Dissipation:
    """A dashpot of a user's own with other members."""
    kind: Any = type("Own", (OwnDashpot,), {"piece": "dashpot", **members})
    return kind(5.0)  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("loss", "message"),
    [
        (own_loss(coefficients=lambda self, mass: mass * np.nan), r"Own\.coefficients = .*: must be 5 finite numbers"),
        (own_loss(coefficients=lambda self, mass: -mass), r"Own\.coefficients = .*of zero or more"),
        (own_loss(coefficients=lambda self, mass: 5.0), r"Own\.coefficients = 5\.0: must be 5 finite numbers"),
        (own_loss(coefficients=lambda self, mass: None), r"Own\.coefficients = None"),
        (own_loss(coefficients=lambda self, mass: mass + 1j), r"Own\.coefficients = array"),
        (own_loss(piece=99), r"Own\.piece = 99: must be dashpot, tangent"),
        (own_loss(piece="dashpots"), r"Own\.piece = 'dashpots': must be dashpot"),
    ],
)
def test_a_loss_that_is_none_is_named(loss: hl.Dissipation, message: str) -> None:
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    with pytest.raises(ValueError, match=message):
        hl.CoSimulation(hl.Chain([bead] * 4, bead, 0.3, dissipation=loss), None).run(1e-5)
