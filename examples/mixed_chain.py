"""A chain of many kinds of beads: alternating steel and hollow aluminium, a tapered end, and an ellipsoid as an
impurity.
"""

import hertzlink as hl

steel = hl.Sphere(radius=9.525e-3, material=hl.STEEL_316)
hollow = hl.HollowSphere(radius=9.525e-3, inner_radius=8.655e-3, material=hl.ALUMINIUM_6061)
taper = [hl.Sphere(9.525e-3 * 0.9**n, hl.STEEL_316) for n in range(1, 7)]
impurity = hl.Ellipsoid(radius=4e-3, length=12e-3, material=hl.BRASS_360, axis="along")

pair: list[hl.Bead] = [steel, hollow]
beads = [*pair * 6, impurity, *taper]
chain = hl.Chain(beads, striker=steel, impact_speed=0.3, dissipation=hl.Restitution(0.95))
run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_316)).run(until=1.2e-3)

pairs = [(steel, hollow), (hollow, impurity), (taper[-2], taper[-1])]
for one, other in pairs:
    print(hl.contact_law(one, other).name)
for sensor in (3, 9, 16):
    print(f"bead {sensor}: {float(hl.sensor_force(run, sensor).max()):.2f} N")
print(f"lost {100 * float(run.dissipated_energy[-1] / run.impact_energy):.1f} % of the striker's energy")
