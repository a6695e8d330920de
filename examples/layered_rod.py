"""Steel on PTFE: the primary wave depends on the steel, the secondary wave on the layer below it."""

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, bead, hl.drop_speed(0.01), gravity=9.81, dissipation=hl.LinearDashpot(5.0))

for lower in (25.4e-3, 50.8e-3):
    layers = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, lower, 9.525e-3)]
    waves = hl.reflections(hl.CoSimulation(chain, hl.rod(layers)).run(until=1.5e-3), sensor=7)
    primary, secondary = waves.primary.time_of_flight * 1e6, waves.secondary.time_of_flight * 1e6
    print(f"PTFE {lower * 1e3:.1f} mm: primary after {primary:.1f} us, secondary after {secondary:.1f} us")
