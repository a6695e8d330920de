"""A carbon laminate with a hidden delamination: the chain above it, next to it, and on a sound laminate."""

from math import pi

import hertzlink as hl

carbon = hl.OrthotropicMaterial(
    youngs_modulus_along=135e9, youngs_modulus_across=9e9, poisson_ratio=0.3, shear_modulus=5e9,
    shear_modulus_along=5e9, shear_modulus_across=3.2e9, density=1560.0,
)  # fmt: skip
quarter = [hl.Ply(carbon, 0.25e-3, angle) for angle in (0.0, pi / 4.0, -pi / 4.0, pi / 2.0)]
wall = hl.Laminate(quarter + quarter[::-1])

bead = hl.Sphere(radius=2.38e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, bead, impact_speed=0.4)
edges = hl.Supports(left="clamped", right="clamped", bottom="clamped", top="clamped")
# Between the two halves of the laminate, which then slide on each other: a quarter of the bending stiffness remains.
delamination = hl.Weakened((0.14, 0.16, 0.09, 0.11), factor=0.25)

for name, additions, x in (
    ("sound", [], 0.15),
    ("over it", [delamination], 0.15),
    ("60 mm away from it", [delamination], 0.09),
):
    plate = hl.kirchhoff_plate(0.3, 0.2, None, wall, edges, additions=additions)
    run = hl.CoSimulation(chain, hl.reduce(plate.at(x, 0.1), until=0.6e-3)).run(until=0.6e-3)
    print(f"{name}: AR {float(hl.amplitude_ratio(run, sensor=10)):.4f}")
run = hl.CoSimulation(chain, hl.infinite_plate(None, wall)).run(until=0.6e-3)
print(f"infinite plate: AR {float(hl.amplitude_ratio(run, sensor=10)):.4f}")
