"""Two chains struck at the same time on one plate: the distance at which they no longer disturb each other."""

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 14, striker=bead, impact_speed=0.31)
plate = hl.kirchhoff_plate(0.3, 0.2, 3e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped", "clamped", "clamped"))

for distance in (0.02, 0.04, 0.08, 0.16):
    body = hl.reduce(plate.at([0.15 - distance / 2, 0.15 + distance / 2], [0.1, 0.1]), until=8e-4)
    alone = hl.CoSimulation(chain, hl.ContactPoint(body, 0)).run(until=8e-4)
    run = hl.CoSimulation([chain, chain], body).run(until=8e-4)
    ratios = [hl.amplitude_ratio(one, sensor=7) for one in (alone, run.isel(chain=0), run.isel(chain=1))]
    print(f"{distance * 1e3:.1f} mm apart: alone AR {ratios[0]:.3f}, together {ratios[1]:.3f} and {ratios[2]:.3f}")

first = float(run.time[(run.gap > 0.0).any("interface")][0])
print(f"the first contact opens after {first * 1e6:.1f} µs; energy error {hl.energy_error(run):.0e}")
