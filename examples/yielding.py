"""Hardened steel beads dent an aluminium wall: the reflected wave and the dent, elastic and by two laws of yielding."""

import numpy as np

import hertzlink as hl

bead, wall = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C), hl.half_space(hl.ALUMINIUM_6061)
laws = {"elastic": None, "Thornton": hl.laws.Thornton(), "Jackson and Green": hl.laws.JacksonGreen()}

for name, law in laws.items():
    chain = hl.Chain([bead] * 20, bead, impact_speed=0.31, law=law)
    run = hl.CoSimulation(chain, wall).run(until=8e-4)
    back = hl.reflections(run, sensor=7).primary
    dent = float(run.dent[-1, -1]) if law else 0.0
    print(
        f"{name}: AR {back.amplitude_ratio:.3f}, TOF {1e6 * back.time_of_flight:.1f} µs, dent {1e6 * dent:.2f} µm, "
        f"lost {100.0 * float(run.dissipated_energy[-1] / run.impact_energy):.1f} %"
    )

# The contact by itself: the force as it is loaded to 5 µm, and back at 4 µm.
contact = hl.laws.JacksonGreen().contact(bead, hl.Surface(hl.ALUMINIUM_6061))
assert contact is not None  # it is None for materials without a yield strength
deepest = np.array(5e-6)
pressed, unloaded = float(contact.force(deepest)), float(contact.force(np.array(4e-6), deepest))
print(f"yields from {contact.yield_force:.2f} N on; {pressed:.1f} N at 5 µm, {unloaded:.1f} N back at 4 µm")
