"""A thin plate and a strip of aluminium under stress: AR and TOF, and how exactly one trace gives the temperature."""

from typing import Any

import matplotlib.pyplot as plt
import numpy as np

import hertzlink as hl

bead = hl.Sphere(radius=2.38e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=0.31)
alloy, expansion, until = hl.ALUMINIUM_6061, 23.6e-6, 1.2e-3


def plate(stress: float, thickness: float = 1e-3) -> hl.Structure:
    held = hl.Supports("clamped", "clamped", "clamped", "clamped")
    inside = hl.Prestress(xx=stress * thickness, yy=stress * thickness)
    whole = hl.kirchhoff_plate(0.08, 0.08, thickness, alloy, held, additions=[inside], highest_frequency=5e4)
    # A basis so exact does not change with the stress: the bound below compares neighbouring stresses.
    return hl.reduce(whole.at(0.04, 0.04), until=until, tolerance=1e-4)


def strip(stress: float, thickness: float = 3e-3) -> hl.Structure:
    breadth, height = 10e-3, thickness
    stiffness = alloy.youngs_modulus * breadth * height**3 / 12.0
    heavy, area = alloy.density * breadth * height, breadth * height
    whole = hl.beam(0.06, stiffness, heavy, alloy, 0.03, ("clamped", "clamped"), stress * area)
    return hl.reduce(whole, until=until, tolerance=1e-4)


def tap(structure: hl.Structure) -> Any:
    return hl.CoSimulation(chain, structure).run(until=until)


stresses = np.array([-30e6, -20e6, -10e6, 0.0, 10e6, 20e6])
figure, (left, right) = plt.subplots(1, 2, figsize=(8.0, 3.2), layout="constrained")
for name, make, size in (("plate", plate, 1e-3), ("strip", strip, 3e-3)):
    runs = [tap(make(stress)) for stress in stresses]
    ratio = np.array([float(hl.amplitude_ratio(run, sensor=10)) for run in runs])
    flight = np.array([float(hl.time_of_flight(run, sensor=10)) for run in runs])
    print(name, "AR", ratio.round(4), "TOF µs", (1e6 * flight).round(2))
    left.plot(stresses / 1e6, ratio, "o-", label=name)
    right.plot(stresses / 1e6, 1e6 * flight, "o-", label=name)

    def build(stress: float, thickness: float, impact_speed: float, make: Any = make) -> hl.CoSimulation:
        return hl.CoSimulation(hl.Chain([bead] * 20, bead, impact_speed), make(stress, thickness))

    held = 1.0 if name == "strip" else 1.0 / (1.0 - alloy.poisson_ratio)
    kelvin = alloy.youngs_modulus * expansion * held
    known = hl.identifiability(build, sensors=[10], until=until, stress=10e6, thickness=size, impact_speed=0.31)
    sigma = 10e6 * known.relative["stress"]
    print(f"{name}: 1 sigma {sigma / 1e6:.3g} MPa or {sigma / kelvin:.3g} K; 1 K is {kelvin / 1e6:.2f} MPa")
left.set(xlabel="stress, tension positive (MPa)", ylabel="AR")
right.set(xlabel="stress, tension positive (MPa)", ylabel="TOF (µs)")
left.legend()
plt.show()
