"""What the summary of a run reports."""

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import hertzlink as hl
from structures.damping import Rayleigh

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 4, BEAD, 0.31, dissipation=hl.LinearDashpot(5.0))
ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], elements=8)
DAMPED = hl.damped(ROD, Rayleigh(5e2, 1e-7))
UNTIL = 1.6e-4


@dataclass(frozen=True)
class SpringMass:
    """A black box: one mass (kg) on one spring (N/m), exact under a constant force."""

    mass: float = 0.0141
    stiffness: float = 1.7e7
    surface = hl.Surface(hl.PTFE)

    def start(self) -> tuple[float, float]:
        return 0.0, 0.0

    def advance(self, state: tuple[float, float], force: float, window: float) -> tuple[Any, float]:
        omega, rest = math.sqrt(self.stiffness / self.mass), force / self.stiffness
        (x, v), c, s = state, math.cos(omega * window), math.sin(omega * window)
        x, v = rest + (x - rest) * c + v * s / omega, v * c - (x - rest) * s * omega
        return (x, v), x


class Windowed(hl.stepping.MovingStructure):
    """Goes window by window, as large structures do."""

    compact = False


STEPPED = Windowed(ROD)

RUNS: dict[str, Callable[[], hl.CoSimulation]] = {
    "windows": lambda: hl.CoSimulation(CHAIN, STEPPED),
    "black box": lambda: hl.CoSimulation(CHAIN, SpringMass(), hl.Aitken(), 2e-6),
    "behind": lambda: hl.CoSimulation(hl.Chain([CHAIN.beads[0]] * 3, None, 0.3), STEPPED, behind=DAMPED),
    "compiled": lambda: hl.CoSimulation(CHAIN, hl.reduce(ROD, until=UNTIL)),
}


@pytest.mark.parametrize("name", RUNS)
def test_the_summary_is_that_of_the_run(name: str, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "hertzlink"):
        run = RUNS[name]().run(UNTIL)
    (report,) = [record.getMessage() for record in caplog.records if record.levelno == logging.INFO]
    windows, energy = int(run.windows.sum()), float(run.impact_energy)
    assert report.startswith(
        f"0.00016 s in {windows} windows, each tried {float(run.evaluations.sum()) / windows:.3g} times"
    )
    into, lost = (float(run[what][-1].sum()) / energy for what in ("interface_work", "dissipated_energy"))
    assert report.endswith(f"into structures {into:.3g}, lost in chains {lost:.3g}")
    assert f"residual {np.max(run.residual.values):.2g} N at most" in report
