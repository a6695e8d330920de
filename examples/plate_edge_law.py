"""At what distance from an edge does a chain no longer detect it? The law of the critical distance, and the exact
half-plane.
"""

import hertzlink as hl

bead = hl.Sphere(radius=9.53e-3 / 2, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=0.31)
plate = hl.kirchhoff_plate(0.9, 0.9, 4.83e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))


def ratio(structure: hl.Structure) -> float:
    run = hl.CoSimulation(chain, structure).run(until=1e-3)
    return float(hl.amplitude_ratio(run, sensor=7))


far = ratio(hl.infinite_plate(4.83e-3, hl.ALUMINIUM_6061))
print(f"AR far from edges {far:.4f}")
for edge in ("clamped", "simple", "free"):
    found = hl.critical_distance_law(bead, plate, impact_speed=0.31, edge=edge, tolerance=0.02)
    there = ratio(hl.half_plane(4.83e-3, hl.ALUMINIUM_6061, edge, found.value, until=1e-3))
    low, value, high = (1e3 * one for one in (found.low, found.value, found.high))
    print(f"{edge}: critical distance {value:.1f} mm ({low:.1f} to {high:.1f}), AR there {there:.4f}")
