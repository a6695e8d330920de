"""Waves that meet an intruder or another granular medium: limits of light and heavy beads, collisions of waves."""

from dataclasses import replace

import pytest
import xarray as xr

import hertzlink as hl

SPEED, UNTIL, SAVED = 0.3, 3e-4, 1e-6
STIFFNESS = float(hl.contact_law(hl.Sphere(4e-3, hl.STEEL_440C), hl.Sphere(4e-3, hl.STEEL_440C)).force(1.0))


def bead(mass: float = 1.0, modulus: float = 1.0) -> hl.Sphere:
    """One of the same size, density and modulus in units of those of steel."""
    steel = hl.STEEL_440C
    return hl.Sphere(
        4e-3, replace(steel, density=mass * steel.density, youngs_modulus=modulus * steel.youngs_modulus, name="")
    )


def equal(first: hl.Bead, second: hl.Bead | hl.Surface) -> hl.laws.ContactLaw:
    return hl.laws.PowerLaw(STIFFNESS)


def velocities(beads: list[hl.Sphere], law: object = equal, wall: hl.Structure | None = None) -> xr.DataArray:
    run = hl.CoSimulation(hl.Chain(beads, bead(), SPEED, law=law), wall).run(UNTIL, SAVED)  # type: ignore[arg-type]
    return run.velocity / SPEED


def test_a_heavy_intruder_is_a_wall() -> None:
    """The difference is of first order in the masses' ratio."""
    wall = velocities([bead()] * 10, wall=hl.half_space(hl.STEEL_440C))
    apart = [
        float(abs(velocities([bead()] * 10 + [bead(mass)] * 3).sel(bead=wall.bead) - wall).max()) for mass in (1e4, 1e6)
    ]
    assert apart[1] < 2e-5
    assert apart[0] / apart[1] == pytest.approx(100.0, rel=0.05)


@pytest.mark.parametrize("modulus", [0.5, 1.0, 4.0])
@pytest.mark.parametrize("mass", [1.5, 2.0])
def test_waves_at_an_interface_collide_as_particles(mass: float, modulus: float) -> None:
    """Into heavier beads, of any stiffness, a wave of mass ratio μ goes on at 2/(1 + μ) of its speed.

    A wave is as many beads long whatever they are made of, so energy and momentum of the waves are those of two
    particles (Nesterenko; Vergara, Phys. Rev. Lett. 95 (2005) 108002). The small waves that follow are left out, so
    energy is kept to 1 % only, and the speed is that within 3 %.
    """
    chain = hl.Chain([bead()] * 30 + [bead(mass, modulus)] * 30, bead(), SPEED)
    run = hl.CoSimulation(chain, None).run(1.4e-3, SAVED)
    near, far = (run.velocity.sel(bead=n).values / SPEED for n in (15, 45))
    incident = int(near.argmax())
    reflected = near[incident + 150 :].min() / near.max()
    transmitted = far.max() / near.max()
    assert transmitted == pytest.approx(2.0 / (1.0 + mass), rel=0.03)
    assert reflected == pytest.approx((1.0 - mass) / (1.0 + mass), abs=0.09)
    assert 0.985 < mass * transmitted**2 + reflected**2 < 1.0
