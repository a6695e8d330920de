"""The wave that leaves the contact on a plate, is reflected at a clamped edge and returns: a picture and an
animation.
"""

import numpy as np

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 10, bead, impact_speed=0.31)
plate = hl.kirchhoff_plate(0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped", right="clamped"))
struck = hl.reduce(plate.at(x=0.06, y=0.1), until=0.6e-3, keep_field=True)
run = hl.CoSimulation(chain, struck).run(until=0.6e-3)

motion = hl.plots.motion(run, struck, times=np.arange(180e-6, 400e-6, 10e-6))
print("written:", hl.plots.picture(motion, "plate.png", time=260e-6, show="deflection"))
print("written:", hl.plots.picture(motion, "plate.gif", show="deflection"))
print(f"deepest {1e6 * -float(motion.displacement.min()):.2f} um at {1e6 * float(motion.time[-1]):.0f} us or before")
