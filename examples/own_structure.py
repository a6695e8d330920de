"""A structure of your own: any object with a surface, start() and advance() can face the chain."""

import math

import hertzlink as hl

State = tuple[float, float]  # displacement, velocity


class SpringMass:
    """One mass on one spring, advanced exactly under a constant force."""

    surface = hl.Surface(hl.PTFE)

    def __init__(self, mass: float, stiffness: float) -> None:
        self.stiffness, self.omega = stiffness, math.sqrt(stiffness / mass)

    def start(self) -> State:
        return 0.0, 0.0

    def advance(self, state: State, force: float, window: float) -> tuple[State, float]:
        rest = force / self.stiffness
        x, v = state[0] - rest, state[1]
        c, s = math.cos(self.omega * window), math.sin(self.omega * window)
        state = rest + x * c + v * s / self.omega, v * c - x * s * self.omega
        return state, state[0]


bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
chain = hl.Chain([bead] * 20, striker=bead, impact_speed=0.44)
run = hl.CoSimulation(chain, SpringMass(mass=0.0141, stiffness=1.7e7), scheme=hl.Aitken()).run(until=1.5e-3)
print(f"AR {hl.amplitude_ratio(run, sensor=7).item():.4f}, energy error {hl.energy_error(run):.0e}")
