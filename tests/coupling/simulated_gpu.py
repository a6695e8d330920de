"""Runs small families with numba-cuda's simulator of a GPU, and prints how far they are from those of a processor."""

import sys
import warnings
from dataclasses import dataclass
from math import sqrt
from typing import Any, NamedTuple

import numpy as np

import hertzlink as hl

BEAD = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C)
PLATE = hl.kirchhoff_plate(0.05, 0.05, 2e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
SMALL = hl.reduce(PLATE.at(0.02, 0.02), until=4e-4, tolerance=0.05)


class CubicPiece(NamedTuple):
    """Hertz's force and a cubic one."""

    hertz: Any
    cubic: Any

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        """Return the force, N."""
        closed = max(overlap, 0.0)
        return law.hertz[i] * closed * sqrt(closed) + law.cubic[i] * closed * closed * closed

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        """Return the slope, N/m."""
        closed = max(overlap, 0.0)
        return 1.5 * law.hertz[i] * sqrt(closed) + 3.0 * law.cubic[i] * closed * closed

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        """Return the energy, J."""
        closed = max(overlap, 0.0)
        return 0.4 * law.hertz[i] * closed * closed * sqrt(closed) + 0.25 * law.cubic[i] * closed**4


@dataclass(frozen=True)
class Cubic(hl.ContactLaw):
    """A law of a user's own."""

    hertz: float
    cubic: float
    piece = CubicPiece

    def force(self, approach: Any) -> Any:
        """Return the force, N."""
        return self.hertz * approach**1.5 + self.cubic * approach**3


class OwnPiece(NamedTuple):
    """A dashpot."""

    coefficient: Any

    @staticmethod
    def force_with_loss(loss: Any, i: int, elastic: float, slope: float, overlap: float, rate: float) -> float:
        """Return the force, N."""
        return max(elastic + loss.coefficient[i] * rate, 0.0)


@dataclass(frozen=True)
class OwnLoss(hl.Dissipation):
    """A loss of a user's own."""

    piece = OwnPiece

    def coefficients(self, mass: Any) -> Any:
        """Return one number for each mass."""
        return np.full_like(mass, 3.0)


def difference(
    name: str, keep: str, quantities: dict[str, Any], structure: Any = SMALL, until: float = 1e-4, **chain: Any
) -> None:
    """Print the largest relative difference between both devices."""
    simulation = hl.CoSimulation(hl.Chain([BEAD] * 4, BEAD, 0.3, **chain), structure, accuracy="screening")
    cpu, gpu = (
        hl.vary(simulation, until, quantities, sensors=[2], keep=keep, device=device) for device in ("cpu", "gpu")
    )
    found = 0.0
    for variable in ("contact_force", "velocity") if keep == "forces" else ("amplitude_ratio", "time_of_flight"):
        assert np.isfinite(cpu[variable]).any()
        np.testing.assert_array_equal(np.isfinite(cpu[variable]), np.isfinite(gpu[variable]))
        found = max(found, float(abs(gpu[variable] - cpu[variable]).max() / abs(cpu[variable]).max()))
    sys.stdout.write(f"{name} {found}\n")


if __name__ == "__main__":
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    SPEEDS = {"chain.impact_speed": [0.2, 0.3]}
    difference("forces", "forces", SPEEDS)
    difference("waves", "waves", SPEEDS, hl.half_space(hl.STEEL_316), 2e-4)
    difference("thickness", "forces", {"structure.thickness": [2e-3, 2.2e-3]})
    difference("own", "forces", SPEEDS, law=Cubic(1e10, 1e17))
    difference("loss", "forces", SPEEDS, dissipation=OwnLoss())
