"""One chain on a steel half-space: the incident wave, and the reflected wave."""

import hertzlink as hl

bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=hl.drop_speed(0.01))
run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=1e-3)

waves = hl.reflections(run, sensor=7)
print(f"incident {waves.incident.amplitude:.4f} N at {waves.incident.arrival * 1e6:.3f} us")
print(f"primary {waves.primary.amplitude:.4f} N at {waves.primary.arrival * 1e6:.3f} us")
print(f"speed {hl.wave_speed(run, 7, 16):.1f} m/s, energy error {hl.energy_error(run):.0e}")
