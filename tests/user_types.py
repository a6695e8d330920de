"""What a type checker knows of hertzlink in a user's script; `.ci/run` gives it to mypy and to pyright.

It is never run: assert_type fails in the checker where a type is Any, as it is where types do not reach users.
"""

from typing import assert_type

import xarray as xr

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead, hl.HollowSphere(9e-3, 8e-3, hl.BRASS_360)], striker=bead, impact_speed=hl.drop_speed(0.01))
rod = hl.rod([hl.Layer(hl.PTFE, length=0.05, radius=0.01)], base="fixed")
plate = hl.kirchhoff_plate(0.3, 0.2, 2e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
run = hl.CoSimulation(chain, hl.reduce(rod, until=1e-3), scheme=hl.Aitken()).run(until=1e-3)

assert_type(bead, hl.Sphere)
assert_type(hl.drop_speed(0.01), float)
assert_type(chain, hl.Chain)
assert_type(rod, hl.Structure)
assert_type(plate, hl.Plate)
assert_type(plate.at(0.1, 0.1), hl.Structure)
assert_type(run, xr.Dataset)
assert_type(hl.amplitude_ratio(run, sensor=7), xr.DataArray)
assert_type(hl.theory.UniformChain(bead.size, bead.mass, 1e10).sound_speed(2.0), float)


def build(thickness: float) -> hl.CoSimulation:
    """A builder of co-simulations, as sweeps take it."""
    one = hl.kirchhoff_plate(0.3, 0.2, thickness, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    return hl.CoSimulation(chain, one.at(0.1, 0.1))


assert_type(hl.sweep(build, until=1e-3, thickness=[1e-3, 2e-3]), xr.Dataset)
