"""Viscoelastic PTFE under steel weakens the secondary wave; modelled as a rod, and as a cylinder with its lateral
strain.
"""

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, bead, hl.drop_speed(0.01), gravity=9.81, dissipation=hl.LinearDashpot(5.0))
layers = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
rod, cylinder = hl.rod(layers), hl.layered_cylinder(layers)

# A Maxwell arm in parallel to the PTFE: half its modulus, with a relaxation time of 20 microseconds.
solid = hl.damping.StandardLinearSolid(0.5, 2e-5)
bodies = {
    "rod, elastic": rod,
    "rod, viscous": hl.damped(rod, solid, part=1),
    "cylinder, elastic": cylinder,
    "cylinder, viscous": hl.damped(cylinder, solid, part=1),
}
for name, body in bodies.items():
    waves = hl.reflections(hl.CoSimulation(chain, hl.reduce(body, until=1.5e-3)).run(until=1.5e-3), sensor=7)
    print(f"{name}: AR {waves.primary.amplitude_ratio:.4f}, then {waves.secondary.amplitude_ratio:.4f}")
