"""The wave inside a layered cylinder: pictures, an animation, and files for ParaView, in the current folder."""

import numpy as np

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, bead, hl.drop_speed(0.01), gravity=9.81)
layers = [hl.Layer(hl.STEEL_440C, 12.7e-3, 19.05e-3), hl.Layer(hl.PTFE, 12.7e-3, 19.05e-3)]
body = hl.reduce(hl.layered_cylinder(layers), until=0.6e-3, keep_field=True)
run = hl.CoSimulation(chain, body).run(until=0.6e-3)

motion = hl.plots.motion(run, body, times=np.arange(300e-6, 500e-6, 10e-6))
# The stress below the contact is a hundred times that of the wave: the colours end where the wave can still be seen.
for show, highest in (("von_mises", 3e6), ("displacement", None)):
    print("written:", hl.plots.picture(motion, f"{show}.png", time=360e-6, show=show, highest=highest))
print("written:", hl.plots.picture(motion, "wave.gif"), "and", hl.plots.write_vtu(motion, "paraview"))

deepest = 1e6 * float(abs(motion.displacement).max())
x, y, z = (1e3 * motion.position.sel(component=name) for name in "xyz")
# At the rim, where PTFE is bonded to the base, the stress has no bound: a finer mesh shows a greater one.
lower = 1e-3 * float(motion.von_mises.where((np.hypot(x, y) < 1e-6) & (z < -12.7)).max())
print(f"greatest displacement {deepest:.3f} um; greatest von Mises stress on the axis below the steel {lower:.1f} kPa")
