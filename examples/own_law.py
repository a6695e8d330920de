"""A contact law of your own: cones between beads of steel, whose force grows as the square of the approach."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

import hertzlink as hl


@dataclass(frozen=True)
class Conical(hl.laws.ContactLaw):
    """A cone on a flat: F = k δ² (Sneddon, Int. J. Eng. Sci. 3 (1965) 47)."""

    stiffness: float  # N/m²
    name = "cone"
    largest = 50e-6  # m; a run warns beyond it

    def force(self, approach: NDArray[np.float64]) -> NDArray[np.float64]:
        return self.stiffness * approach**2


bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
for law in (Conical(1e13), Conical(2e12)):
    runs = []
    for speed in (0.1, 0.4):
        chain = hl.Chain([bead] * 20, striker=bead, impact_speed=speed, law=law)
        runs.append(hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=4e-3))
    slow, fast = (hl.wave_speed(run, 6, 14) for run in runs)
    print(f"k = {law.stiffness:.0e} N/m²: {slow:.1f} m/s, at four times the impact speed {fast / slow:.3f} times that")
print(f"a power law with the exponent 2 predicts {4.0 ** (1.0 / 3.0):.3f} times")
