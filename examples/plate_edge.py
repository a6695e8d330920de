"""A chain at increasing distances from the clamped edge of an aluminium plate, until the edge no longer matters."""

import hertzlink as hl

bead = hl.Sphere(radius=9.53e-3 / 2, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=0.31)
plate = hl.kirchhoff_plate(
    length=0.914,
    width=0.914,
    thickness=4.83e-3,
    material=hl.ALUMINIUM_6061,
    supports=hl.Supports(left="clamped", right="clamped", bottom="free", top="free"),
)


def at(distance: float) -> hl.CoSimulation:
    return hl.CoSimulation(chain, hl.reduce(plate.at(distance, 0.457), until=1e-3))


runs = hl.sweep(at, until=1e-3, distance=[0.01, 0.02, 0.03, 0.04, 0.06, 0.457])
ratio = hl.amplitude_ratio(runs, sensor=7)
print("AR", ratio.values.round(3))
print(f"critical distance {hl.critical_distance(ratio) * 1e3:.1f} mm")
law = hl.critical_distance_law(bead, plate, impact_speed=0.31, edge="clamped", tolerance=0.02)
print(f"by the law, without a run: {law.value * 1e3:.1f} mm ({law.low * 1e3:.1f} to {law.high * 1e3:.1f})")
