"""What a trace determines of a user's own plate near a clamped edge: 95 % half-widths, as parts of the values."""

from dataclasses import dataclass
from itertools import product

import joblib
import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.inference.information import REACH, Design, Sensitivities
from coupling.inference.misfit import GAIN, TIME_ZERO
from coupling.sweeps.progress import watched
from hertzlink.studies import draw
from hertzlink.studies import identifiable_cases as cases
from hertzlink.studies.conditions import Conditions as Parameters
from hertzlink.studies.conditions import WrongValue, number, substance
from hertzlink.studies.table import Row
from particles.bead import Sphere
from particles.chain import Chain
from plates.half_plane import half_plane
from structures.caution import collected
from structures.material import ALUMINIUM_6061, STEEL_440C, Material
from structures.structure import Vector

CHECKED = (0.06, 0.16)
"""m, the distances of the table."""

DISTANCES = tuple(sorted({*(float(f"{d:.3g}") for d in np.geomspace(5e-3, 0.3, 14)), *CHECKED}))

MOST_PLATES = 6
"""Of panels and of colours in a figure."""

BLIND = 0.5
"""A half-width above this part of the value."""


@dataclass(frozen=True)
class Conditions(Parameters):
    """What can be changed. The plate's modulus stays known, and rods with a bond are left out."""

    material: Material = substance(ALUMINIUM_6061, "Material of the plate")
    thickness: tuple[float, ...] = number((2.29e-3, 3.0e-3, 4.83e-3), "m", "Thickness of the plate", low=1e-5, high=0.1)
    bead: tuple[float, ...] = number((4.76e-3, 9.53e-3), "m", "Diameter of the beads", low=1e-4, high=0.2)
    bead_material: Material = substance(STEEL_440C, "Material of the beads and the striker")
    impact_speed: float = number(cases.IMPACT_SPEED, "m/s", "Speed of the striker", low=1e-3, high=20.0)
    distance: tuple[float, ...] = number(DISTANCES, "m", "Distance to the clamped edge", low=1e-4, high=10.0)
    noise: float = number(
        cases.NOISE, "", "White noise, as a part of the greatest force at each sensor", low=1e-9, high=1.0
    )
    record: tuple[float, ...] = number(cases.RECORDS, "s", "Lengths of the records", low=1e-5, high=0.1)

    def check(self) -> None:
        """No more plates than panels."""
        for name in ("thickness", "bead"):
            if len(getattr(self, name)) > MOST_PLATES:
                raise WrongValue(name, getattr(self, name), f"give at most {MOST_PLATES} values")

    def errors(self, diameter: float, distance: float, thickness: float) -> Vector:
        """Half-widths: records × measured × free × unknowns; NaN for what is known."""
        bead = Sphere(0.5 * diameter, self.bead_material)
        highest = cases.HIGHEST_FREQUENCY * max(1.0, 4.76e-3 / diameter)

        def build(distance: float, thickness: float, impact_speed: float) -> CoSimulation:
            plate = half_plane(thickness, self.material, "clamped", distance, max(self.record), highest)
            return CoSimulation(Chain([bead] * cases.BEADS, bead, impact_speed), plate)

        values = dict(zip(cases.EDGE_UNKNOWNS, (distance, thickness, self.impact_speed), strict=True))
        sensors = {n for group in cases.MEASURED.values() for n in group}
        with collected():  # Points of the contact may yield: a model of elastic contacts is what is studied.
            nuisances = (GAIN, TIME_ZERO)
            design = Design(build, values, sensors, max(self.record), nuisances, self.noise, cases.SAMPLE_EVERY)
            changes = Sensitivities(design)
        found = np.full((len(self.record), len(cases.MEASURED), len(cases.EDGE_FREE), len(values)), np.nan)
        for k, (what, group) in enumerate(cases.MEASURED.items()):
            features = changes.features(group, self.record[0], cases.DRAWS) if what == cases.FEATURES else None
            for (j, record), (m, free) in product(enumerate(self.record), enumerate(cases.EDGE_FREE.values())):
                bounds = features(free) if features else changes.waveform(group, record, free)
                found[j, k, m, : len(free)] = [REACH * bounds[name] for name in free]
        return found


def run(of: Conditions, distances: tuple[float, ...], parallel: joblib.Parallel) -> xr.Dataset:
    """Half-widths over the beads, the distances and the thicknesses."""
    grid = list(product(of.bead, distances, of.thickness))
    found = list(watched(parallel(joblib.delayed(of.errors)(*one) for one in grid), len(grid)))
    values = np.array(found).reshape(len(of.bead), len(distances), len(of.thickness), *found[0].shape)
    dims = ("diameter", "distance", "thickness", "record", "measured", "free", "unknown")
    data = xr.Dataset({"edge_error": cases.relative(dims, values, "half of the 95 % interval")})
    places = cases.coordinates(
        diameter=of.bead, distance=distances, thickness=of.thickness, record=of.record, measured=cases.MEASURED,
        free=cases.EDGE_FREE, unknown=cases.EDGE_UNKNOWNS,
    )  # fmt: skip
    return of.marked(data.assign_coords(places))


def rows(data: xr.Dataset) -> list[Row]:
    """The half-width of the distance for each bead, plate, distance and way to measure."""
    found = []
    for diameter, thickness, distance in product(
        *(data[name].values for name in ("diameter", "thickness", "distance"))
    ):
        one = data.edge_error.sel(diameter=diameter, thickness=thickness, distance=distance)
        label = f"distance {distance * 1e3:.4g} mm, D {diameter * 1e3:.2f}, t {thickness * 1e3:.2f}"
        for what in data.measured.values:
            at = one.sel(measured=what)
            first = at.isel(record=0)
            longer = [f"record of {r * 1e3:g} ms: {_of(at.sel(record=r))}" for r in data.record.values[1:]]
            alone = _of(first, free="distance")
            plate, speed = _of(first, "thickness"), _of(first, "impact_speed")
            reason = f"the distance alone: {alone}; thickness {plate}, impact speed {speed}"
            if what == cases.FEATURES:
                reason, longer = f"two numbers cannot give three unknowns; the distance alone: {alone}", []
            found.append(Row(f"{label}, {what}", "", _of(first), "", "; ".join([reason, *longer])))
    return found


def _of(at: xr.DataArray, unknown: str = "distance", free: str = "all") -> str:
    error = float(at.sel(unknown=unknown, free=free))
    return f"{100.0 * error:.2g} %" if error <= BLIND else "blind"


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Half-widths of the distance over the distance: a panel for each plate and each bead."""
    found = {}
    for diameter in data.diameter.values:
        figure, axes = draw.panels(data.sizes["thickness"], width=3.4, height=3.6)
        for axis, thickness in zip(axes, data.thickness.values, strict=True):
            at = data.edge_error.sel(diameter=diameter, thickness=thickness, unknown="distance", free="all")
            for i, what in enumerate(name for name in data.measured.values if name != cases.FEATURES):
                curve = 100.0 * at.isel(record=0).sel(measured=what)
                axis.plot(
                    data.distance * 1e3, curve, draw.MARKERS[i], color=draw.COLOURS[i], linestyle="-", markersize=4.0,
                    linewidth=1.0, label=str(what),
                )  # fmt: skip
            axis.axhline(100.0 * BLIND, color="black", linestyle=":", linewidth=0.9)
            axis.set(title=f"D = {diameter * 1e3:.2f} mm, t = {thickness * 1e3:.2f} mm", xscale="log", yscale="log")
            axis.set_xlabel("distance to the edge (mm)")
        axes[0].set_ylabel(f"half-width of the distance (%), {1e3 * float(data.record[0]):g} ms")
        axes[0].legend(frameon=False, fontsize="small")
        found[f"distance_{diameter * 1e3:.2f}_mm"] = figure
    return found
