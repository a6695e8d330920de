"""Deformable beads compared with point masses, on a rod and on a plate: one line of the script changes."""

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
clamped = hl.Supports("clamped", "clamped", "clamped", "clamped")
plate = hl.kirchhoff_plate(0.3, 0.2, 4.83e-3, hl.ALUMINIUM_6061, clamped).at(0.15, 0.1)
cylinder = hl.layered_cylinder([hl.Layer(hl.PTFE, length=25.4e-3, radius=19.1e-3)])
structures = {
    "steel rod": hl.rod([hl.Layer(hl.STEEL_440C, length=76.2e-3, radius=19.1e-3)]),
    "PTFE cylinder": hl.reduce(cylinder, until=1e-3),
    "aluminium plate": hl.reduce(plate, until=1e-3),
}

speed = hl.drop_speed(0.01)
rigid = hl.Chain([bead] * 20, striker=bead, impact_speed=speed, gravity=9.81)
deformable = hl.DeformableChain([bead] * 20, striker=bead, impact_speed=speed, gravity=9.81)

runs = {}
for name, structure in structures.items():
    for chain in (rigid, deformable):
        run = hl.CoSimulation(chain, structure).run(until=1e-3)
        runs[name, type(chain).__name__] = run
        wave = hl.reflections(run, sensor=7).primary
        print(
            f"{name}, {type(chain).__name__}: AR {wave.amplitude_ratio:.4f}, TOF {wave.time_of_flight * 1e6:.1f} µs, "
            f"energy error {hl.energy_error(run):.0e}"
        )

run = runs["aluminium plate", "DeformableChain"]
section, mean = float(run.section_force.sel(bead=7).max()), float(hl.sensor_force(run, 7).max())
print(f"largest force at bead 7: {section:.2f} N through its central section, {mean:.2f} N as its contacts' mean")
