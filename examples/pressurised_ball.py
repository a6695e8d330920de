"""A rubber ball and a thin steel tank under pressure: the wave comes back earlier, and a thick vessel shows nothing."""

import matplotlib.pyplot as plt
import numpy as np

import hertzlink as hl

rubber = hl.Material(youngs_modulus=4e6, poisson_ratio=0.49, density=1100.0, name="rubber")
flights = {}
for name, radius, thickness, material, diameter, until, highest in (
    ("rubber ball", 33e-3, 3.5e-3, rubber, 19.05e-3, 20e-3, 80e3),
    ("steel tank", 0.1, 0.25e-3, hl.STEEL_440C, 4.76e-3, 1.2e-3, 1e6),
    ("steel vessel", 50e-3, 1e-3, hl.STEEL_440C, 4.76e-3, 1.2e-3, 6e6),
):
    bead = hl.Sphere(radius=0.5 * diameter, material=hl.STEEL_440C)
    chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.1)
    soft = name == "rubber ball"  # the contact is as wide as a patch of 2 mm, and lasts about a millisecond
    patch, frequency = (2e-3, 2e3) if soft else (None, 40e3)
    pressures, found = np.linspace(0.0, highest, 4), []
    for pressure in pressures:
        shell = hl.spherical_shell(
            radius, thickness, material, float(pressure), patch_radius=patch, highest_frequency=frequency
        )
        small = hl.reduce(shell, until, pulse=2e-3 if soft else 25e-6)
        found.append(float(hl.time_of_flight(hl.CoSimulation(chain, small).run(until=until), sensor=8)))
    relative = pressures / hl.theory.ThinSphere(radius, thickness, material).buckling_pressure
    flights[name] = relative, np.array(found)
    print(f"{name}: to {highest / 1e3:.0f} kPa TOF falls from {1e6 * found[0]:.1f} to {1e6 * found[-1]:.1f} µs")

figure, axes = plt.subplots(figsize=(5.0, 3.2), layout="constrained")
for (name, (relative, flight)), marker in zip(flights.items(), "os^", strict=True):
    axes.plot(relative, 100.0 * (flight / flight[0] - 1.0), marker=marker, label=name)
axes.set(xlabel="pressure / buckling pressure", ylabel="change of TOF (%)")
axes.legend(frameon=False)
plt.show()
