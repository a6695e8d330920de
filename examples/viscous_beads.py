"""How a wave decays in PTFE that loses energy in the vibrations of its beads, in their contacts, or as in the thesis.

The thesis's law for PTFE, fitted to experiments, takes 46 % of the peak force between beads 8 and 32. A tenth of
critical damping in the vibrations takes 1 %: the wave is so slow that the beads follow it almost without vibrating. A
loss in proportion to the stiffness takes 3 % in the vibrations, and 38 % where it acts in the contacts as well.
"""

from typing import Any

import hertzlink as hl

bead = hl.Sphere(radius=2.38e-3, material=hl.PTFE)
losses: dict[str, dict[str, Any]] = {
    "none": {},
    "vibrations, 10 % of critical damping": {"damping": hl.damping.Modal(0.1)},
    "stiffness-proportional, 1 µs, in vibrations": {"damping": hl.damping.Rayleigh(stiffness_time=1e-6)},
    "the same in contacts as well": {
        "damping": hl.damping.Rayleigh(stiffness_time=1e-6), "dissipation": hl.KuwabaraKono(1e-6)
    },
}  # fmt: skip
sensors = [8, 16, 24, 32]
decay = {}
for name, loss in losses.items():
    chain = hl.DeformableChain([bead] * 40, striker=bead, impact_speed=0.5, modes=4, **loss)
    run = hl.CoSimulation(chain, None).run(until=2.2e-3)
    decay[name] = [float(hl.sensor_force(run, n).max()) for n in sensors]

thesis = hl.PowerDashpot(0.582, 1.78, form="thesis")
run = hl.CoSimulation(hl.Chain([bead] * 40, bead, impact_speed=0.5, dissipation=thesis), None).run(until=2.2e-3)
decay["the thesis's law, point masses"] = [float(hl.sensor_force(run, n).max()) for n in sensors]
for name, force in decay.items():
    print(f"{name}: {force[-1] / force[0]:.3f} of the peak force at bead 8 arrives at bead 32")
