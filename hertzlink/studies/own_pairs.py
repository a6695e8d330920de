"""The critical distance over ℓ for a pair of bead and plate of a user's own, by runs and by the law."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from hertzlink.studies import draw
from hertzlink.studies.conditions import Conditions as Parameters
from hertzlink.studies.conditions import WrongValue, choice, number, substance
from hertzlink.studies.edge_cases import Pair
from hertzlink.studies.table import Row
from particles.bead import Sphere
from plates.critical_distance import scaled_critical_distance
from plates.half_plane import EDGES
from structures.material import ALUMINIUM_6061, STEEL_440C, Material

PARAMETERS = (0.06, 0.12, 0.17, 0.24, 0.34, 0.48, 0.63, 0.75, 0.95, 1.2, 1.6, 1.95)
"""λ; none of these values is a node of the law's table."""


@dataclass(frozen=True)
class Conditions(Parameters):
    """What can be changed. Other pairs, shear and corners are then left out."""

    material: Material = substance(ALUMINIUM_6061, "Material of the plate")
    bead: float = number(9.53e-3, "m", "Diameter of the beads and the striker", low=1e-4, high=0.2)
    bead_material: Material = substance(STEEL_440C, "Material of the beads and the striker")
    impact_speed: float = number(0.31, "m/s", "Speed of the striker", low=1e-3, high=20.0)
    edge: tuple[str, ...] = choice(tuple(EDGES), EDGES, "Supports of the edge")
    inelasticity: tuple[float, ...] = number(
        PARAMETERS, "", "Zener's inelasticity parameter λ, from which the plate's thickness follows", low=0.05, high=2.0
    )

    def check(self) -> None:
        """A pair that the law holds, so that AR at equal λ can be compared."""
        if not self.own:
            return
        try:
            scaled_critical_distance("clamped", self.pair.stiffness_ratio, self.inelasticity[0], 0.02)
        except ValueError as error:
            raise WrongValue("material", self.material.name, f"with these beads: {error}") from None

    @cached_property
    def pair(self) -> Pair:
        """Bead, plate and speed."""
        return Pair(Sphere(self.bead / 2.0, self.bead_material), self.material, self.impact_speed)


def rows(data: xr.Dataset, of: Conditions) -> list[Row]:
    """The critical distance over ℓ by runs, compared with the law, for each edge and λ."""
    found = []
    for edge in data.edge.values:
        for one in data.inelasticity.values:
            length, thickness = of.pair.length(float(one)), of.pair.plate(float(one)).thickness
            at = data.sel(edge=edge, inelasticity=one)
            for within in data.within.values:
                value = float(at.simulated.sel(within=within))
                law = scaled_critical_distance(str(edge), of.pair.stiffness_ratio, float(one), float(within))
                reason = (
                    f"theory: the law, {law[1]:.3g} to {law[2]:.3g}; {1e3 * length * value:.4g} mm for a plate of "
                    f"{1e3 * thickness:.4g} mm, ℓ = {1e3 * length:.4g} mm; AR far away {float(at.far_ratio):.4f}"
                )
                shown: float | str = value if np.isfinite(value) else "not settled"
                found.append(Row(f"c, {edge} edge, λ {one:.3g}, AR ± {within:g}", "", shown, "", reason, law[0]))
    return found


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """AR over the distance for each edge and λ."""
    from matplotlib import colormaps

    figure, axes = draw.panels(data.sizes["edge"], width=3.6, height=3.4)
    for axis, edge in zip(axes, data.edge.values, strict=True):
        for i, one in enumerate(data.inelasticity.values):
            colour = colormaps["viridis"](0.95 * i / max(1, data.sizes["inelasticity"] - 1))
            curve = data.amplitude_ratio.sel(edge=edge, inelasticity=one)
            axis.plot(data.scaled_distance, curve, ".-", color=colour, linewidth=1.2, label=f"λ = {one:g}")
        axis.set(title=f"{edge} edge", xlabel="distance from the edge, d / ℓ", xlim=(0.0, 3.5), ylim=(0.0, 1.0))
    axes[0].set_ylabel("amplitude ratio AR")
    axes[0].legend(frameon=False, fontsize="small")
    return {"collapse": figure}
