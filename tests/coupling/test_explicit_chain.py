"""The explicit finite-element chain: collisions compared with theory, vibrations of a sphere, balances, orders,
bad input.
"""

import warnings
from math import log2, pi, tan
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import sparse
from scipy.optimize import brentq
from scipy.sparse.linalg import eigsh

import hertzlink as hl
from particles.deformable import explicit_kernels as kernels
from particles.deformable.explicit_beads import ExplicitBead, explicit_bead
from particles.laws.axisymmetric import contact_law_fem
from structures.bodies.elasticity import pressure_speed, shear_speed
from structures.structure import Vector

THOROUGH_FIXTURES = ("slow", "fast")

BEAD = hl.Sphere(2.38e-3, hl.STEEL_316)
SHELL = hl.HollowSphere(9.525e-3, 6e-3, hl.ALUMINIUM_6061)
EGG = hl.Ellipsoid(2.36e-3, 5.08e-3, hl.STEEL_316, axis="along")
SPEED = 0.5
FAST = 20.0
"""m/s. Strains are small in the model whatever the speed, and wide contacts take few steps."""


def collision_theory(bead: hl.Sphere, speed: float) -> tuple[float, float]:
    """Greatest force, N, and duration, s, of two equal spheres that collide (Hertz 1882; Johnson, section 11.4)."""
    stiffness = hl.theory.hertz_stiffness(bead.surface, bead.surface)
    approach = (5.0 / 8.0 * bead.mass * speed**2 / stiffness) ** 0.4
    return stiffness * approach**1.5, 2.9432 * approach / speed


def collide(bead: hl.Sphere | hl.HollowSphere | hl.Ellipsoid, speed: float, until: float, spacing: float) -> xr.Dataset:
    """A bead hits its like."""
    return hl.explicit_chain(hl.Chain([bead], bead, speed), until, spacing)


def momentum(run: xr.Dataset, bead: hl.Sphere | hl.HollowSphere | hl.Ellipsoid) -> Vector:
    return np.asarray(bead.mass * run.velocity.sum("bead"))


@pytest.fixture(scope="module")
def slow() -> xr.Dataset:
    return collide(BEAD, SPEED, 20e-6, 30e-6)


@pytest.fixture(scope="module")
def fast() -> xr.Dataset:
    return collide(BEAD, FAST, 1.2 * collision_theory(BEAD, FAST)[1], 100e-6)


def test_slow_collision_is_hertz(slow: xr.Dataset) -> None:
    """Duration within 0.5 %; the force 1 % above, as spheres are stiffer than half-spaces; no energy left in them."""
    force, duration = collision_theory(BEAD, SPEED)
    touching = slow.contact_force.sel(contact=1) > 0.0
    assert float(touching.sum() * slow.time[1]) == pytest.approx(duration, rel=5e-3)
    assert 1.005 < float(slow.contact_force.max()) / force < 1.015
    left = slow.velocity.isel(time=-1)
    assert 1.0 - 1e-4 < float(left[1] - left[0]) / SPEED < 1.0


def test_slow_collision_is_that_of_the_static_law(slow: xr.Dataset) -> None:
    """The contact law by finite elements of half beads, and two point masses: within 0.5 %."""
    law = contact_law_fem(BEAD, max_force=30.0)
    greatest = law.force(law.overlap(np.array(0.25 * BEAD.mass * SPEED**2)))
    assert float(slow.contact_force.max()) == pytest.approx(float(greatest), rel=5e-3)


@pytest.mark.thorough
@pytest.mark.parametrize("which", ["slow", "fast"])
def test_balances(request: pytest.FixtureRequest, which: str) -> None:
    """Energy, with what closing nodes lose to rounding and without it to 1e-5; momentum; positions by the forces."""
    run, speed = request.getfixturevalue(which), {"slow": SPEED, "fast": FAST}[which]
    energy = run.kinetic_energy + run.contact_energy
    assert float(energy[0]) == pytest.approx(0.5 * BEAD.mass * speed**2, rel=1e-5)
    assert hl.energy_error(run) < 1e-5
    assert np.ptp((energy + run.closing_loss).values) < 1e-8 * float(run.impact_energy)
    assert float(run.closing_loss[-1]) > 1e-8 * float(run.impact_energy)
    assert momentum(run, BEAD) == pytest.approx(BEAD.mass * speed, rel=1e-9)
    impulse = float(run.contact_force.sel(contact=1).sum() * run.time[1])
    assert impulse == pytest.approx(BEAD.mass * float(run.velocity[-1, 1]), rel=1e-9)


def test_every_step_obeys_newton() -> None:
    """Saved at each step, a bead's velocity at whole steps is what the forces so far, and half of the last, gave it."""
    run = hl.explicit_chain(hl.Chain([BEAD], BEAD, FAST), 0.4e-6, 100e-6, save_every=3.87e-9)
    force, step = run.contact_force.sel(contact=1).values, float(run.time[1])
    assert run.step == pytest.approx(step)
    given = step * (np.cumsum(force) - 0.5 * force)
    assert BEAD.mass * run.velocity.sel(bead=1).values == pytest.approx(given, rel=1e-9)
    moved_on = np.diff(run.displacement.sel(bead=1).values)
    assert BEAD.mass * moved_on == pytest.approx(step * step * np.cumsum(force)[:-1], rel=1e-9)


def test_mirror_images(fast: xr.Dataset) -> None:
    """Seen from the centre of mass two equal beads that collide are mirror images."""
    striker, struck = fast.section_force.values.T
    assert striker == pytest.approx(struck, abs=1e-6 * struck.max())
    energy = float(fast.impact_energy)
    striker, struck = fast.vibration_energy.values.T
    assert striker == pytest.approx(struck, abs=1e-7 * energy)
    assert struck.min() > -1e-9 * energy


def test_section_force_is_half_of_the_contact_force(fast: xr.Dataset) -> None:
    """Of a bead whose two halves are accelerated equally: within what the contact's changes in twice the time in which
    a pressure wave comes from there, before which there is none."""
    force, section = fast.contact_force.sel(contact=1).values, fast.section_force.sel(bead=1).values
    travel = BEAD.radius / pressure_speed(BEAD.material)
    change = np.abs(np.gradient(force, fast.time.values)).max()
    assert np.abs(section - 0.5 * force).max() < change * 2.0 * travel
    early = fast.time.values < 0.9 * travel
    assert np.abs(section[early]).max() < 1e-3 * force[early].max()


def model_of(bead: ExplicitBead) -> kernels.Model:
    return kernels.Model(*(getattr(bead, name) for name in kernels.Model._fields))


def moved(
    bead: ExplicitBead, speed: float, step: float, rows: int, stride: int, wall: bool
) -> tuple[int, kernels.Saved]:
    """One body alone: how the loop ended, and what it saved."""
    displacement, velocity = np.zeros((2, bead.mass.size, 2, 1))
    velocity[:, 1, 0] = speed
    saved = kernels.Saved(*(np.zeros((rows, 1)) for _ in range(5)), *(np.zeros(rows) for _ in range(3)))
    return kernels.run(model_of(bead), displacement, velocity, step, stride, 1, wall, saved), saved


def one_body(bead: ExplicitBead, speed: float, step: float, rows: int, stride: int, wall: bool) -> kernels.Saved:
    status, saved = moved(bead, speed, step, rows, stride, wall)
    assert status == kernels.FINISHED
    return saved


@pytest.mark.parametrize("body", [BEAD, SHELL, EGG])
def test_a_bead_that_touches_nothing_moves_on(body: hl.Sphere | hl.HollowSphere | hl.Ellipsoid) -> None:
    bead = explicit_bead(body, 0.1 * body.radius, 0.05 * body.radius)
    step = 0.9 * bead.stable_step
    saved = one_body(bead, 2.0, step, 20, 51, wall=False)
    assert saved.displacement[:, 0] == pytest.approx(2.0 * 51 * step * np.arange(20), rel=1e-11)
    assert saved.velocity == pytest.approx(2.0, rel=1e-11)
    assert saved.kinetic == pytest.approx(2.0 * body.mass, rel=1e-11)
    assert np.abs(saved.strain).max() < 1e-11 * body.mass


def test_a_rigid_wall_is_a_mirror(fast: xr.Dataset) -> None:
    """A bead that hits it at half the speed feels what two beads that collide feel; and leaves as fast as it came."""
    bead = explicit_bead(BEAD, fast.reach, fast.spacing)
    stride = round(float(fast.time[1]) / fast.step)
    saved = one_body(bead, 0.5 * FAST, fast.step, fast.time.size, stride, wall=True)
    top = float(fast.contact_force.max())
    assert saved.contact_force[:, 0] == pytest.approx(fast.contact_force[:, 0].values, abs=1e-7 * top)
    assert saved.velocity[-1, 0] == pytest.approx(-0.5 * FAST, rel=2e-3)


def frequencies(body: hl.Sphere, cells: int) -> tuple[Vector, float]:
    """The lowest angular frequencies of a free bead, rad/s, by an eigensolver; and its stable step, s."""
    bead = explicit_bead(body, 0.3 * body.radius, 0.3 * body.radius / cells)
    free = np.column_stack([~bead.held, np.ones(bead.held.size, dtype=bool)]).ravel()
    stiffness = sparse.csr_array(sparse.bsr_array((bead.blocks, bead.columns, bead.starts)))[free][:, free]
    mass = sparse.diags_array(np.repeat(bead.mass, 2)[free])
    shift = -1e-3 * (hl.STEEL_316.youngs_modulus / body.material.density) / body.radius**2
    lowest = eigsh(stiffness, 7, mass, sigma=shift, return_eigenvectors=False)
    return np.sqrt(np.sort(np.abs(lowest))), bead.stable_step


def test_vibrations_of_a_sphere() -> None:
    """Breathing: tan x = x/(1 − (c_p/2c_s)² x²), x = ωR/c_p, of fourth order in the cells; the lowest, oblate and
    prolate in turn: ωR/c_s = 0.840 π for ν = 1/4 (Lamb, Proc. London Math. Soc. 13 (1882) 189)."""
    body = hl.Sphere(2e-3, hl.Material(200e9, 0.25, 8000.0))
    fast, slow = pressure_speed(body.material), shear_speed(body.material)
    exact = brentq(lambda x: tan(x) * (1.0 - (0.5 * fast / slow * x) ** 2) - x, 2.0, 3.0)
    errors = []
    for cells in (1, 2, 4):
        found, _ = frequencies(body, cells)
        errors.append(np.abs(found * body.radius / fast / exact - 1.0).min())
    assert errors[-1] < 5e-5
    assert log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.2)
    assert log2(errors[1] / errors[2]) == pytest.approx(4.0, abs=0.2)
    assert found[0] < 1e-4 * found[1]
    assert found[1] * body.radius / slow == pytest.approx(0.840 * pi, rel=1e-3)


@pytest.mark.parametrize("body", [BEAD, SHELL, EGG])
def test_masses(body: hl.Sphere | hl.HollowSphere | hl.Ellipsoid) -> None:
    """All positive, the bead's own together, and half of it on either side; facing nodes at equal steps of r."""
    bead = explicit_bead(body, 0.1 * body.radius, 0.05 * body.radius)
    assert bead.mass.min() > 0.0
    assert bead.mass.sum() == pytest.approx(body.mass, rel=1e-12)
    assert bead.near @ bead.mass == pytest.approx(0.5 * body.mass, rel=1e-12)
    steps = 0.025 * body.radius * np.arange(5)
    curvature = body.surface.curvature
    assert bead.drop == pytest.approx(0.5 * curvature * steps**2, rel=4e-3)
    for pole, *others in (bead.struck, bead.facing):
        assert bead.held[pole]
        assert not bead.held[others].any()
    assert bead.mass[bead.struck] == pytest.approx(bead.mass[bead.facing], rel=1e-9)


def test_a_step_beyond_the_stable_one_grows() -> None:
    """Also in contact: nodes held together raise no frequency."""
    bead = explicit_bead(BEAD, 0.2 * BEAD.radius, 0.1 * BEAD.radius)
    held = one_body(bead, 1.0, 0.99 * bead.stable_step, 20, 51, wall=True)
    assert held.kinetic.max() < 1.01 * held.kinetic[0]
    status, _ = moved(bead, 1.0, 1.02 * bead.stable_step, 400, 51, wall=False)
    assert status == kernels.NON_FINITE


@pytest.mark.thorough
def test_order_of_what_closing_nodes_lose() -> None:
    """It falls by the square of the cells' size."""
    runs = [collide(BEAD, FAST, 8e-6, spacing) for spacing in (120e-6, 60e-6)]
    coarse, fine = (float(run.closing_loss[-1]) for run in runs)
    assert log2(coarse / fine) == pytest.approx(2.0, abs=0.2)


def test_the_mesh_widens_where_bodies_touch_beyond_it(monkeypatch: pytest.MonkeyPatch) -> None:
    run = collide(BEAD, FAST, 6e-6, 120e-6)
    monkeypatch.setattr("coupling.explicit_chain.MARGIN", 0.6)
    widened = collide(BEAD, FAST, 6e-6, 120e-6)
    assert widened.reach > 0.7 * run.reach
    assert float(widened.contact_force.max()) == pytest.approx(float(run.contact_force.max()), rel=0.01)


def test_other_bodies_keep_energy_and_momentum() -> None:
    """A shell and an ellipsoid."""
    for body, speed, until in ((SHELL, 5.0, 30e-6), (EGG, 20.0, 15e-6)):
        run = collide(body, speed, until, 0.05 * body.radius)
        assert hl.energy_error(run) < 3e-5
        assert momentum(run, body) == pytest.approx(body.mass * speed, rel=1e-9)


@pytest.mark.thorough
def test_a_wave_along_a_chain() -> None:
    """The measures read it. It is 3 % faster than in a chain of point masses, and its contacts feel 5 % more: at 5 m/s
    spheres are that much stiffer than half-spaces, and a bead's near side moves on before its centre does."""
    chain = hl.Chain([BEAD] * 7, BEAD, 5.0)
    run = hl.explicit_chain(chain, 60e-6, 50e-6, rigid_wall=True)
    points = hl.CoSimulation(chain, None).run(60e-6)
    assert hl.energy_error(run) < 1e-5
    assert 1.01 < hl.wave_speed(run, 3, 5) / hl.wave_speed(points, 3, 5) < 1.04
    greatest, expected = (float(one.contact_force.sel(contact=5, time=slice(35e-6)).max()) for one in (run, points))
    assert 1.03 < greatest / expected < 1.06
    given = (run.contact_force.sel(contact=8) * run.time[1]).cumsum("time")
    last = momentum(run, BEAD)[-1] + float(given[-1])
    assert last == pytest.approx(5.0 * BEAD.mass, rel=1e-9)


def test_the_result(tmp_path: Path) -> None:
    run = hl.explicit_chain(hl.Chain([BEAD] * 2, BEAD, FAST), 1e-6, 120e-6, save_every=1e-7)
    assert run.time.values == pytest.approx(1e-7 * np.arange(11))
    assert dict(run.sizes) == {"time": 11, "bead": 3, "contact": 3}
    assert {"degrees_of_freedom", "cells", "step", "spacing", "reach", "seconds", "input", "versions"} <= set(run.attrs)
    assert run.contact_force.sel(contact=3).max() == 0.0
    assert run.section_force.dims == run.vibration_energy.dims == ("time", "bead")
    run.to_netcdf(tmp_path / "run.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as kept:
        xr.testing.assert_identical(kept.load(), run)


def test_too_coarse_a_mesh_is_warned_of() -> None:
    """The default has a quarter of the contact's radius."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = hl.explicit_chain(CHAIN, 1e-8)
    with pytest.warns(hl.HertzlinkWarning, match="fewer than 3 cells"):
        hl.explicit_chain(CHAIN, 1e-8, 1.4 * run.spacing)


@pytest.mark.parametrize("wall", [False, True])
def test_strains_that_are_not_small_are_warned_of(wall: bool) -> None:
    """Beyond a contact radius of a fifth of the relative radius of curvature; a flat wall bears twice that radius."""
    chain = hl.Chain([BEAD], BEAD, 50.0)
    with pytest.warns(hl.HertzlinkWarning, match="strains are not small") as caught:
        run = hl.explicit_chain(chain, 15e-6, 200e-6, rigid_wall=wall)
    modulus = 0.5 * BEAD.material.youngs_modulus / (1.0 - BEAD.material.poisson_ratio**2)
    radius = (0.75 * float(run.contact_force.sel(contact=1).max()) * 0.5 * BEAD.radius / modulus) ** (1.0 / 3.0)
    assert radius > 0.2 * 0.5 * BEAD.radius
    warning = f"strains: contact 1 has a radius of {1e6 * radius:.3g} µm, so wide that strains are not small"
    assert run.warnings.splitlines().count(warning) == 1
    assert [str(one.message) for one in caught].count(warning) == 1


def test_a_state_that_is_not_finite(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(kernels, "run", lambda *_: kernels.NON_FINITE)
    with pytest.raises(FloatingPointError, match="no longer finite"):
        hl.explicit_chain(CHAIN, 1e-6)


CHAIN = hl.Chain([BEAD], BEAD, SPEED)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"chain": 1}, "chain = 1"),
        ({"chain": hl.Chain([BEAD, SHELL], BEAD, SPEED)}, "beads = HollowSphere"),
        ({"chain": hl.Chain([BEAD], SHELL, SPEED)}, "striker = HollowSphere"),
        ({"chain": hl.Chain([BEAD], None, SPEED)}, "striker = None"),
        (
            {"chain": hl.Chain([hl.Cylinder(1e-3, 1e-3, hl.NYLON)], hl.Cylinder(1e-3, 1e-3, hl.NYLON), 1.0)},
            "beads = Cyl",
        ),
        ({"chain": hl.Chain([BEAD], BEAD, SPEED, gravity=9.81)}, "gravity = 9.81"),
        ({"chain": hl.Chain([BEAD], BEAD, SPEED, preload=1.0)}, "preload = 1.0"),
        ({"chain": hl.Chain([BEAD], BEAD, SPEED, dissipation=hl.LinearDashpot(1.0))}, "dissipation = LinearDashpot"),
        ({"chain": hl.Chain([BEAD], BEAD, SPEED, law=hl.laws.PowerLaw(1e9))}, "law = PowerLaw"),
        ({"chain": hl.Chain([BEAD], BEAD, SPEED, integrator="rk4")}, "integrator = 'rk4'"),
        ({"chain": hl.Chain([BEAD], BEAD, 1000.0), "spacing": 2e-4}, "impact_speed = 1000.0"),
        ({"until": -1.0}, "until = -1.0"),
        ({"until": 1e9}, "until"),
        ({"spacing": 0.0}, "spacing = 0.0"),
        ({"spacing": 1e-8}, "spacing = 1e-08"),
        ({"spacing": 1e-2}, "spacing = 0.01: contacts reach 0.01 m, too wide for"),
        ({"chain": hl.Chain([BEAD], BEAD, 1000.0), "spacing": 1e-2}, "impact_speed = 1000.0: contacts reach"),
        ({"save_every": 1.0}, "save_every = 1.0"),
        ({"save_every": 1e-13}, r"save_every = 1e-13: must be no shorter than the step, [5-9]\.\d*e-10 s"),
        ({"rigid_wall": 1}, "rigid_wall = 1"),
    ],
)
def test_bad_input(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=f"^{message}"):
        hl.explicit_chain(**({"chain": CHAIN, "until": 1e-6} | arguments))  # type: ignore[arg-type]


def test_a_run_of_many_steps_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("coupling.explicit_chain.MANY_STEPS", 10)
    with pytest.warns(hl.HertzlinkWarning, match=r"until: the run takes \d.* steps of 2 meshes"):
        hl.explicit_chain(hl.Chain([BEAD], BEAD, FAST), 4e-7, 120e-6, save_every=1e-7)
