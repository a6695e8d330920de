"""A chain between two plates: how much of an impact on the first plate passes through the chain into the second."""

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
striking = hl.Chain([bead] * 10, striker=bead, impact_speed=0.31)
between = hl.Chain([bead] * 8, striker=None)
supports = hl.Supports("clamped", "clamped", "free", "free")
far = hl.kirchhoff_plate(0.1, 0.1, 2e-3, hl.ALUMINIUM_6061, supports).at(0.05, 0.05)
second = hl.reduce(far, until=8e-4)

for thickness in (1e-3, 2e-3, 4e-3):
    near = hl.kirchhoff_plate(0.1, 0.1, thickness, hl.ALUMINIUM_6061, supports)
    first = hl.reduce(near.at([0.05, 0.05], [0.05, 0.05], face=["front", "back"]), until=8e-4)
    front, back = hl.ContactPoint(first, 0), hl.ContactPoint(first, 1)
    run = hl.CoSimulation([striking, between], [front, second], behind=[None, back]).run(until=8e-4)
    taken = run.structure_work.max("time") / run.impact_energy.isel(chain=0)
    events = hl.contact_events(run)
    left = events.time[(events.structure == 1) & (events.kind == "opens")][0].item()
    print(
        f"{thickness * 1e3:.1f} mm: the first plate holds up to {taken[0].item():.3f} of the energy, "
        f"the second {taken[1].item():.3f}; it is left after {left * 1e6:.1f} µs"
    )
print(f"energy error {hl.energy_error(run):.0e}, AR {hl.amplitude_ratio(run, sensor=5)[0]:.3f}")
