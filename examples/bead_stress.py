"""The stress inside three beads of a struck chain as the wave passes: pictures, an animation and files for ParaView."""

import numpy as np

import hertzlink as hl

bead = hl.Sphere(radius=2.38e-3, material=hl.STEEL_316)
chain = hl.DeformableChain([bead] * 12, bead, impact_speed=0.5)
run = hl.CoSimulation(chain, None).run(until=120e-6)

section = run.section_force.sel(bead=7)
peak = float(run.time[int(section.values.argmax())])
motion = hl.plots.motion(run, chain, times=peak + np.arange(-15e-6, 16e-6, 3e-6), beads=[6, 7, 8])
for name, moment in (("before", peak - 9e-6), ("peak", peak)):
    print("written:", hl.plots.picture(motion, f"{name}.png", time=moment, factor=0.0, highest=20e6))
print(
    "written:",
    hl.plots.picture(motion, "wave.gif", factor=0.0, highest=20e6),
    "and",
    hl.plots.write_vtu(motion, "paraview"),
)

at_peak = motion.sel(time=peak, method="nearest")
contact = 1e-9 * float(at_peak.von_mises.max())
centre = abs(at_peak.position - [0.0, 0.0, -chain.centres[7]]).max("component") < 1e-9
pressure = -1e-6 * float(at_peak.stress.sel(stress_component="axial")[centre].mean())
print(f"force through the middle bead {float(section.max()):.2f} N")
print(f"axial pressure at its centre {pressure:.2f} MPa; greatest von Mises stress {contact:.3f} GPa, at the contacts")
