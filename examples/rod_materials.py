"""Rods of different materials under a vertical, damped chain: stiff rods reflect earlier and stronger waves."""

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain(
    [bead] * 20,
    striker=bead,
    impact_speed=hl.drop_speed(0.01),
    gravity=9.81,
    dissipation=hl.LinearDashpot(5.0),
)


def against(material: hl.Material) -> hl.CoSimulation:
    return hl.CoSimulation(chain, hl.rod([hl.Layer(material, length=76.2e-3, radius=19.1e-3)], base="fixed"))


materials = [hl.MATERIALS[name] for name in ("PTFE", "acrylic", "brass 360", "steel 440C")]
runs = hl.sweep(against, until=1.5e-3, material=materials)
print("AR ", hl.amplitude_ratio(runs, sensor=7).values.round(3))
print("TOF", (hl.time_of_flight(runs, sensor=7) * 1e6).values.round(1), "us")
