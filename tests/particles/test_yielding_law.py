"""Contacts that yield: restitution in closed form, published curves, energy, limits, memory, orders, bad input."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from particles.laws.yielding import RoundContact, YieldingContact, YieldingLaw

SOFT = hl.Sphere(4.76e-3, hl.STEEL_316)
HARD = hl.Sphere(4.76e-3, hl.STEEL_440C)
WALL = hl.half_space(hl.STEEL_316)
LAWS = [hl.laws.Thornton(), hl.laws.JacksonGreen()]
NEVER = 1.5e10
"""Pa, a yield strength that no contact of these tests reaches, but whose overlap is within Hertz's law."""


def contact(law: YieldingLaw, first: hl.Bead = SOFT, second: hl.Bead | hl.Surface = SOFT) -> YieldingContact:
    found = law.contact(first, second)
    assert found is not None
    return found


def chain(law: Any, beads: int = 8, bead: hl.Bead = SOFT, speed: float = 0.4, **more: Any) -> hl.Chain:
    return hl.Chain([bead] * beads, bead, speed, law=law, **more)


def fitted_steel() -> YieldingContact:
    steel = hl.Material(2.0 * 219.8e9 * (1.0 - 0.32**2), 0.32, 7800.0, "soft", 0.21e9)
    return contact(hl.laws.JacksonGreen(), hl.Sphere(2e-3, steel), hl.Sphere(2e-3, steel))


def rebound(law: YieldingLaw, speed: float, bead: hl.Sphere = SOFT, **more: Any) -> float:
    """The speed of a bead after it struck a wall, over that before."""
    moving = hl.stepping.MovingChain(hl.Chain([bead], None, speed, law=law, **more), hl.Surface(hl.STEEL_316))
    state, _ = moving.advance(moving.start(), (0.0, 0.0), 4.0 * moving.contact_time)
    return -float(state.velocity[1]) / speed


def thornton_1997(ratio: float) -> float:
    """Restitution at a speed over that of the first yield (Thornton 1997, equation 29)."""
    r = 1.0 / ratio
    return float(
        (6.0 * np.sqrt(3.0) / 5.0) ** 0.5
        * (1.0 - r**2 / 6.0) ** 0.5
        * (r / (r + 2.0 * np.sqrt(1.2 - 0.2 * r**2))) ** 0.25
    )


def yield_speed(bodies: RoundContact, mass: float) -> float:
    """v_y = 3.194 √(p_y⁵R³/(E*⁴m)), Thornton 1997."""
    return 3.194 * float(np.sqrt(bodies.pressure**5 * bodies.radius**3 / (bodies.modulus**4 * mass)))


@pytest.mark.parametrize("ratio", [1.02, 2.0, 10.0, 100.0])
def test_restitution_on_a_wall_by_thorntons_closed_form(ratio: float) -> None:
    bodies = contact(hl.laws.Thornton(), SOFT, hl.Surface(hl.STEEL_316)).bodies
    speed = ratio * yield_speed(bodies, SOFT.mass)
    assert rebound(hl.laws.Thornton(), speed) == pytest.approx(thornton_1997(ratio), rel=2e-4)


def test_thorntons_curve() -> None:
    """F_y = π³R²p_y³/6E*², the straight line, and R_p F* = R F_e with the residual overlap that follows."""
    found = contact(hl.laws.Thornton())
    radius, modulus, pressure = found.bodies.radius, found.bodies.modulus, found.bodies.pressure
    assert (radius, pressure) == (pytest.approx(2.38e-3), pytest.approx(331e6, rel=2e-3))
    assert found.yield_force == pytest.approx(np.pi**3 * radius**2 * pressure**3 / (6.0 * modulus**2), rel=1e-9)
    most = 20.0 * found.overlap
    force = found.yield_force + np.pi * pressure * radius * (most - found.overlap)
    assert float(found.force(most)) == pytest.approx(force, rel=1e-9)
    hertz = 4.0 / 3.0 * modulus * np.sqrt(radius) * most**1.5
    flatter = radius * hertz / force
    left = most - (0.75 * force / (modulus * np.sqrt(flatter))) ** (2.0 / 3.0)
    assert float(found.dent(most)) == pytest.approx(left, rel=1e-9)
    middle = 0.5 * (left + most)
    back = 4.0 / 3.0 * modulus * np.sqrt(flatter) * (middle - left) ** 1.5
    assert float(found.force(middle, most)) == pytest.approx(back, rel=1e-9)


# ν = 0.32, E* = 219.8 GPa, S = 0.21 GPa, steel as in Jackson and Green (2005): y and F/F_c.
@pytest.mark.parametrize(
    ("y", "force"), [(1.0, 1.0), (1.5, 1.8371), (10.0, 25.7477), (100.0, 461.720), (400.0, 2238.30)]
)
def test_jackson_and_greens_curve(y: float, force: float) -> None:
    """The dent is that of Jackson, Green and Marghitu, Nonlinear Dyn. 60 (2010) 217."""
    found = fitted_steel()
    critical = np.pi * 1.295 * np.exp(0.736 * 0.32) * 0.21e9 / (2.0 * 219.8e9)
    assert found.overlap == pytest.approx(critical**2 * 1e-3, rel=1e-9)
    assert float(found.force(y * found.overlap)) / found.yield_force == pytest.approx(force, rel=1e-5)
    left = 1.02 * (1.0 - ((y + 5.9) / 6.9) ** -0.54)
    assert float(found.dent(y * found.overlap)) / (y * found.overlap) == pytest.approx(left, abs=1e-9)


@pytest.mark.parametrize("y", [2.0, 5.0, 10.0, 30.0, 100.0])
def test_other_finite_elements_give_the_same_force(y: float) -> None:
    """Kogut and Etsion, J. Appl. Mech. 69 (2002) 657: 1.03 y^1.425 up to y = 6, 1.40 y^1.263 up to 110."""
    theirs = 1.03 * y**1.425 if y < 6.0 else 1.40 * y**1.263
    found = fitted_steel()
    assert float(found.force(y * found.overlap)) / found.yield_force == pytest.approx(theirs, rel=0.06)


@pytest.mark.parametrize("modulus", [30e9, 40e9, 200e9])
def test_jackson_and_greens_curve_rises_under_a_hard_bead_on_a_soft_wall(modulus: float) -> None:
    """At S/E* = 0.07 the fit begins below Hertz's force, which it must not leave by a fall."""
    wall = hl.half_space(hl.Material(modulus, 0.2, 2400.0))
    contact = hl.laws.JacksonGreen(1.9e9).contact(hl.Sphere(4.76e-3, hl.STEEL_440C), wall.surface)
    force = contact.force(contact.overlap * np.linspace(0.5, 50.0, 2000))
    assert np.all(np.diff(force) > 0.0)
    assert np.diff(force).max() < 0.1 * force[40]


MORE = [
    pytest.param({}, id="plain"),
    pytest.param({"gravity": 9.81}, id="gravity"),
    pytest.param({"preload": 5.0}, id="preload", marks=pytest.mark.thorough),
    pytest.param({"dissipation": hl.LinearDashpot(4.0)}, id="dashpot", marks=pytest.mark.thorough),
]


@pytest.mark.parametrize("more", MORE)
@pytest.mark.parametrize("law", LAWS, ids=["Thornton", "Jackson and Green"])
def test_the_ledger_closes(law: YieldingLaw, more: dict[str, Any]) -> None:
    run = hl.CoSimulation(chain(law, **more), hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=3e-4)).run(
        3e-4
    )
    assert hl.energy_error(run) < 2e-6
    assert np.all(np.diff(run.dissipated_energy.values) >= -1e-16 * float(run.impact_energy))
    assert float(run.dissipated_energy[-1]) > 0.5 * float(run.impact_energy)
    assert np.all(np.diff(run.dent.values, axis=0) >= -1e-9 * float(run.dent.max()))
    assert np.all(run.contact_force.values >= 0.0)
    assert not any(line.startswith("yield") for line in run.attrs.get("warnings", "").splitlines())


def same(one: xr.Dataset, other: xr.Dataset) -> None:
    """Energies are sums whose order depends on the law."""
    for name in set(one.data_vars) & set(other.data_vars):
        if "energy" in str(name) or "loss" in str(name):
            assert other[name].values == pytest.approx(one[name].values, abs=1e-14 * float(one.impact_energy)), name
        else:
            assert np.array_equal(one[name].values, other[name].values, equal_nan=True), name


@pytest.mark.parametrize("kind", [hl.laws.Thornton, hl.laws.JacksonGreen])
@pytest.mark.parametrize("structure", ["wall", "rod", "nothing"])
def test_a_chain_that_never_yields_is_hertzian_to_the_bit(kind: Callable[[float], YieldingLaw], structure: str) -> None:
    facing = {
        "wall": hl.half_space(hl.STEEL_316),
        "rod": hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.1, 9.525e-3)]), until=3e-4),
        "nothing": None,
    }[structure]
    elastic, strong = (
        hl.CoSimulation(chain(law, bead=HARD, gravity=9.81 if facing else 0.0), facing).run(3e-4)
        for law in (None, kind(NEVER))
    )
    same(elastic, strong)
    assert float(abs(strong.dent).max()) == 0.0


@pytest.mark.parametrize("law", LAWS)
def test_order_of_convergence(law: YieldingLaw) -> None:
    """Two, as forces are continuous although their slopes are not."""
    ends = [velocities(chain(law, 2), 1e-7 / 2**i) for i in range(9)]
    errors = [abs(end - ends[-1]).max() for end in ends[:6]]
    assert -np.polyfit(np.arange(6), np.log2(errors), 1)[0] == pytest.approx(2.0, abs=0.2)


def velocities(made: hl.Chain, dt: float) -> Any:
    """The velocities after an impact, m/s."""
    moving = hl.stepping.MovingChain(made, hl.Surface(hl.STEEL_316), dt=dt)
    return moving.advance(moving.start(), (0.0, 0.0), 8e-5)[0].velocity


@pytest.mark.thorough
def test_static_loads_beyond_yield_are_on_the_loading_curve() -> None:
    moving = hl.stepping.MovingChain(chain(LAWS[0], 3, preload=20.0), hl.Surface(hl.STEEL_316))
    found = contact(LAWS[0])
    _, most, _, dents = np.split(moving.start().position, 4)
    assert most[0] == found.overlap
    assert dents[1] > dents[0] == 0.0
    assert np.all(found.force(most[1:3]) == pytest.approx(20.0, rel=1e-9))
    resting = hl.Chain([SOFT] * 3, None, law=LAWS[0], preload=20.0)
    run = hl.CoSimulation(resting, WALL).run(1e-4)
    assert float(abs(run.displacement).max()) < 1e-14


NAMELESS = hl.Material(200e9, 0.3, 7800.0)
CYLINDER = hl.Cylinder(5e-3, 1e-2, hl.STEEL_316)
BAD: dict[str, tuple[Callable[[], Any], str]] = {
    "zero": (lambda: hl.laws.Thornton(0.0), "yield_strength = 0.0: must be a positive number of Pa"),
    "text": (lambda: hl.laws.JacksonGreen("soft"), "yield_strength = 'soft'"),  # type: ignore[arg-type]
    "class": (lambda: chain(hl.laws.Thornton), "law = .*Thornton"),
    "unknown strength": (
        lambda: hl.CoSimulation(chain(LAWS[0], bead=hl.Sphere(5e-3, NAMELESS)), hl.half_space(NAMELESS)),
        "must have a yield_strength, as no material",
    ),
    "line": (lambda: hl.CoSimulation(chain(LAWS[0], bead=CYLINDER), WALL), "with a round contact"),
    "hollow": (
        lambda: hl.CoSimulation(chain(LAWS[1], bead=hl.HollowSphere(5e-3, 4e-3, hl.STEEL_316)), WALL),
        "must be for solid bodies",
    ),
    "deformable": (
        lambda: hl.DeformableChain([SOFT] * 3, SOFT, 0.1, law=LAWS[0]),
        "must not yield in a DeformableChain",
    ),
}


@pytest.mark.parametrize(("make", "message"), BAD.values(), ids=BAD)
def test_bad_input(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


@dataclass(frozen=True)
class Straight(YieldingLaw):
    """A law of a user's own: Thornton's curve with a dent of half the overlap beyond yield."""

    def overlap(self, bodies: RoundContact) -> float:
        return hl.laws.Thornton().overlap(bodies)

    def loading(self, bodies: RoundContact, x: Any) -> Any:
        return 1.5 * x

    def dent(self, bodies: RoundContact, x: Any) -> Any:
        return 0.5 * x**2 / (1.0 + x)


@dataclass(frozen=True)
class Impossible(Straight):
    def dent(self, bodies: RoundContact, x: Any) -> Any:
        return 3.0 * x


def test_a_law_of_a_users_own() -> None:
    run = hl.CoSimulation(chain(Straight()), WALL).run(2e-4)
    assert hl.energy_error(run) < 2e-6
    assert float(run.dent[-1, 0]) > 0.0
    with pytest.raises(ValueError, match=r"law: Impossible.dent must be less than the overlap"):
        hl.CoSimulation(chain(Impossible()), WALL).run(1e-5)
