"""Runs small families with numba-cuda's simulator of a GPU, and prints how far they are from those of a processor."""

import sys
import warnings
from dataclasses import dataclass
from math import sqrt
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

import hertzlink as hl
from coupling.sweeps import family

BEAD = hl.Sphere(radius=4.765e-3, material=hl.STEEL_440C)
PLATE = hl.kirchhoff_plate(0.05, 0.05, 2e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
SMALL = hl.reduce(PLATE.at(0.02, 0.02), until=4e-4, tolerance=0.05)


class RoundPiece(NamedTuple):
    """Hertz's force."""

    stiffness: Any

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        """Return the force, N."""
        closed = max(overlap, 0.0)
        return law.stiffness[i] * closed * sqrt(closed)

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        """Return the slope, N/m."""
        return 1.5 * law.stiffness[i] * sqrt(max(overlap, 0.0))

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        """Return the energy, J."""
        closed = max(overlap, 0.0)
        return 0.4 * law.stiffness[i] * closed * closed * sqrt(closed)


@dataclass(frozen=True)
class Round(hl.ContactLaw):
    """A law of a user's own."""

    stiffness: float
    piece = RoundPiece

    def force(self, approach: Any) -> Any:
        """Return the force, N."""
        return self.stiffness * approach**1.5


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
    name: str, keep: str, quantities: dict[str, Any], structure: Any = SMALL, until: float = 7e-5, **built_in: Any
) -> None:
    """Print the largest relative difference between both devices; on the GPU parts of a user's own, if any."""
    cpu, gpu = (
        hl.vary(
            hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.3, **parts), structure, window=5e-7, substeps=1, dt=5e-7),
            until, quantities, sensors=[2], keep=keep, device=device, save_every=5e-7,
        )
        for device, parts in (("cpu", built_in), ("gpu", {part: OWN[part] for part in built_in}))
    )  # fmt: skip
    found = []
    for variable in ("contact_force", "velocity") if keep == "forces" else ("amplitude_ratio", "time_of_flight"):
        expected, values = cpu[variable].values, gpu[variable].values
        assert np.isfinite(expected).any()
        np.testing.assert_array_equal(np.isfinite(expected), np.isfinite(values))
        found.append(np.nanmax(abs(values - expected)) / np.nanmax(abs(expected)))
    sys.stdout.write(f"{name} {max(found)}\n")


OWN = {"law": Round(1e10), "dissipation": OwnLoss()}

if __name__ == "__main__":
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    # Runs at the corners of a family warn; their loops for parts of a user's own would be compiled for this alone.
    family.batch = lambda *_, **__: xr.Dataset(attrs={"warnings": ""})
    SPEEDS = {"chain.impact_speed": [0.2, 0.3]}
    difference("forces", "forces", SPEEDS | {"structure.thickness": [2e-3, 2.2e-3]})
    difference("waves", "waves", SPEEDS, hl.half_space(hl.STEEL_316), 1.6e-4)
    difference("own", "forces", SPEEDS, law=hl.laws.PowerLaw(1e10), dissipation=hl.LinearDashpot(3.0))
