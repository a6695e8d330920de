"""The cost of contact laws, losses and yielding in a struck chain of 20 beads, over that of Hertz's law without losses.

    python benchmarks/chains.py [--quick]

Rates are particle-steps/s of wall time; ratios are medians over rounds in which the cases take turns.
"""

import sys
from collections.abc import Callable
from dataclasses import dataclass
from math import sqrt
from statistics import median
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

import hertzlink as hl

BEAD, BEADS = hl.Sphere(4.76e-3, hl.STEEL_440C), 20
STEP, STEPS = 1e-7, 10_000
HERTZ = hl.contact_law(BEAD, BEAD)
POINTS = np.geomspace(1e-9, 1e-3, 60)


class OwnPiece(NamedTuple):
    """Hertz's law as a user's piece, which is compiled into the loop."""

    stiffness: Any

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        return float(law.stiffness[i] * overlap * sqrt(overlap)) if overlap > 1e-60 else 0.0

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        return float(1.5 * law.stiffness[i] * sqrt(overlap)) if overlap > 1e-60 else 0.0

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        return float(0.4 * law.stiffness[i] * overlap**2 * sqrt(overlap)) if overlap > 1e-60 else 0.0


@dataclass(frozen=True)
class OwnLaw(hl.laws.ContactLaw):
    stiffness: float
    piece = OwnPiece

    def force(self, approach: Any) -> Any:
        return self.stiffness * np.maximum(approach, 0.0) ** 1.5


LAWS: dict[str, Any] = {
    "Hertz": None,
    "a user's piece": OwnLaw(float(HERTZ.force(np.array(1.0)))),
    "power law": hl.laws.PowerLaw(1e9, 1.4),
    "table": hl.laws.TabulatedLaw(POINTS, HERTZ.force(POINTS)),
    "Thornton": hl.laws.Thornton(3e8),
    "Jackson and Green": hl.laws.JacksonGreen(3e8),
}
LOSSES: dict[str, Any] = {
    "LinearDashpot": hl.LinearDashpot(5.0),
    "PowerDashpot": hl.PowerDashpot(5.0, 1.8),
    "the thesis's form": hl.PowerDashpot(5.0, 1.8, "thesis"),
    "MassProportional": hl.MassProportional(6900.0),
    "KuwabaraKono": hl.KuwabaraKono(1e-6),
    "Restitution": hl.Restitution(0.9),
}


def impact(**given: Any) -> Callable[[], Any]:
    """All steps of one chain in one window."""
    moving = hl.stepping.MovingChain(hl.Chain([BEAD] * BEADS, BEAD, 0.44, **given), None, dt=STEP)
    start = moving.start()
    moving.advance(start, (0.0, 0.0), STEP)  # Compiles the kernels, or loads compiled ones.
    return lambda: moving.advance(start, (0.0, 0.0), STEPS * STEP)


def main() -> None:
    rounds = 3 if "--quick" in sys.argv else 9
    runs = {name: impact(law=law) for name, law in LAWS.items()}
    runs |= {name: impact(dissipation=loss) for name, loss in LOSSES.items()}
    times: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            begin, count = perf_counter(), 0
            while perf_counter() - begin < 0.05:
                run()
                count += 1
            times[name].append((perf_counter() - begin) / count)
    for name, spent in times.items():
        ratio = median(one / hertz for one, hertz in zip(spent, times["Hertz"], strict=True))
        print(f"{name:18s} {(BEADS + 1) * STEPS / median(spent):8.2e}   {ratio:5.2f} times the time of Hertz's law")


if __name__ == "__main__":
    main()
