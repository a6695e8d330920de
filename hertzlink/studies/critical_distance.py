"""Beyond section 6.2.2: AR near an edge depends on λ and d/ℓ only; and the law that follows."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.interpolate import PchipInterpolator

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Number
from plates.critical_distance import DECAYING, edge_difference, edge_length, last_crossing, scaled_critical_distance
from plates.half_plane import EDGES
from structures.structure import Vector

# Length of records in contact times of aluminium plates, after 30 of which the slowest reflected wave returns; and the
# ratio of contact stiffnesses of steel beads on aluminium, up to which it is enough.
RECORD, ALUMINIUM_STIFFNESS_RATIO = 45.0, 0.743
STEPS_PER_CONTACT = 450  # Steps of the chain in a contact time. The default of 1800 changes AR by 1e-6.
HIGHEST_PHASE = 3.3  # Highest frequency of the half-plane times the contact time. Twice this value changes AR by 2e-5.
# A wave below this fraction of the incident one counts as none, with AR = 0; the law's error is larger.
SMALLEST_WAVE = 2e-3

# λ, none of them a node of the law's table, and d/ℓ; fewer of both for other beads and speeds.
PARAMETERS = (0.06, 0.12, 0.17, 0.24, 0.34, 0.48, 0.63, 0.75, 0.95, 1.2, 1.6, 1.95)
DISTANCES = (*(round(0.1 * i, 1) for i in range(1, 36)), *(0.5 * i for i in range(8, 19)))
OTHER_PARAMETERS, OTHER_DISTANCES = (0.12, 0.34, 0.75), (0.6, 1.0, 1.4, 1.8, 2.4)
QUICK_PARAMETERS, QUICK_DISTANCES = OTHER_PARAMETERS, (0.2, 0.6, 1.0, 1.4, 1.8, 2.2, 2.6, 3.4)
# Allowed differences of AR from its far value beyond the critical distance; the one in the figures.
TOLERANCES, SHOWN = (0.01, 0.02, 0.05), 0.02
SHOWN_PARAMETERS = (0.06, 0.12, 0.24, 0.34, 0.48, 0.75, 1.2)  # λ in the figure of the collapse, if it was simulated.


@dataclass(frozen=True)
class Pair:
    """A chain of equal beads on a plate of a material, struck at a speed, m/s; λ determines the plate's thickness."""

    bead: hl.Sphere
    wall: hl.Material
    speed: float = 0.31

    @cached_property
    def contact_time(self) -> float:
        """T_c, s: Hertz's contact time of a bead on a half-space at the striker speed."""
        return shared.contact_time(self.bead, self.wall, self.speed)

    @property
    def stiffness_ratio(self) -> float:
        """Stiffness of the contact between bead and plate over that between two beads."""
        return shared.wall_stiffness(self.bead, self.wall) / shared.long_waves(self.bead).stiffness

    @property
    def record(self) -> float:
        """Length of the record, s. Stiff walls shorten T_c, but not the travel time of the wave in the chain."""
        return float(RECORD * self.contact_time * max(1.0, (self.stiffness_ratio / ALUMINIUM_STIFFNESS_RATIO) ** 0.4))

    def plate(self, inelasticity: float) -> hl.Plate:
        """Return a plate of the thickness t that gives λ, which is proportional to t⁻²."""
        thin = hl.kirchhoff_plate(1.0, 1.0, 1e-3, self.wall, hl.Supports())
        parameter = hl.theory.PlateImpact(self.bead, thin, self.speed).inelasticity
        return hl.kirchhoff_plate(1.0, 1.0, float(1e-3 * (parameter / inelasticity) ** 0.5), self.wall, hl.Supports())

    def length(self, inelasticity: float) -> float:
        return edge_length(self.bead, self.plate(inelasticity), self.speed)

    def on(self, structure: hl.Structure) -> hl.CoSimulation:
        chain = hl.Chain([self.bead] * shared.BEADS, self.bead, self.speed)
        return hl.CoSimulation(chain, structure, dt=self.contact_time / STEPS_PER_CONTACT)

    def near(self, edge: str, inelasticity: float, scaled: float) -> hl.CoSimulation:
        """Return the chain at d/ℓ from an edge: at a supported edge a half-space, far away the infinite plate."""
        thickness = self.plate(inelasticity).thickness
        if np.isinf(scaled):
            return self.on(hl.infinite_plate(thickness, self.wall))
        if scaled == 0.0 and edge != "free":
            return self.on(hl.half_space(self.wall))
        distance, highest = scaled * self.length(inelasticity), HIGHEST_PHASE / self.contact_time
        return self.on(hl.half_plane(thickness, self.wall, edge, distance, self.record, highest))

    def ratios(self, edge: str, inelasticity: float, distances: Iterable[float]) -> list[float]:
        """Return AR at distances over ℓ; infinity is the plate without an edge."""
        return [ratio(self.near(edge, inelasticity, scaled).run(self.record)) for scaled in distances]


# The thesis's middle bead on aluminium, and another bead and another speed at the same λ and d/ℓ.
LARGE, SMALL = hl.Sphere(4.765e-3, hl.STEEL_440C), hl.Sphere(2.38e-3, hl.STEEL_440C)
MAIN = Pair(LARGE, hl.ALUMINIUM_6061)
PAIRS = {"4.76 mm beads": Pair(SMALL, hl.ALUMINIUM_6061), "1.2 m/s": Pair(LARGE, hl.ALUMINIUM_6061, 1.2)}


def ratio(run: xr.Dataset) -> float:
    """Return AR of the primary wave; 0 if there is none."""
    primary = hl.reflections(run, shared.SENSOR, SMALLEST_WAVE).primary
    return primary.amplitude_ratio if primary else 0.0


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR over edge, λ and d/ℓ, critical distances, and AR of other pairs. quick: fewer."""
    parameters, distances = (QUICK_PARAMETERS, QUICK_DISTANCES) if quick else (PARAMETERS, DISTANCES)
    data = sampled({"": MAIN}, parameters, distances, jobs).isel(pair=0, drop=True)
    data["simulated"] = xr.apply_ufunc(
        crossing, data.difference, xr.DataArray(list(TOLERANCES), dims="within"),
        input_core_dims=[["scaled_distance"], []], kwargs={"distances": data.scaled_distance.values}, vectorize=True,
    )  # fmt: skip
    others = sampled(PAIRS, OTHER_PARAMETERS[1:2] if quick else OTHER_PARAMETERS, OTHER_DISTANCES, jobs)
    others = shared.named(others.drop_vars(["amplitude_ratio", "far_ratio"]), "other")
    others = others.rename(inelasticity="other_inelasticity", scaled_distance="other_distance")
    return data.assign_coords(within=list(TOLERANCES)).merge(others)


def sampled(
    pairs: dict[str, Pair], parameters: Sequence[float], distances: Sequence[float], jobs: int | None
) -> xr.Dataset:
    """Return AR over edge, λ and d/ℓ, its value far away, the difference, and the error of the table's difference."""
    runs = hl.sweep(
        lambda pair, edge, inelasticity, scaled_distance: pairs[pair].near(edge, inelasticity, scaled_distance),
        min(pair.record for pair in pairs.values()), jobs, lambda run: xr.Dataset({"ratio": ratio(run)}),
        pair=list(pairs), edge=EDGES, inelasticity=parameters, scaled_distance=(*distances, np.inf),
    ).ratio  # fmt: skip
    ratios, far = runs.isel(scaled_distance=slice(None, -1)), runs.isel(edge=0, scaled_distance=-1, drop=True)
    table: xr.DataArray = xr.apply_ufunc(
        lambda edge, parameter: np.interp(distances, *edge_difference(str(edge), MAIN.stiffness_ratio, parameter)),
        runs.edge, runs.inelasticity, output_core_dims=[["scaled_distance"]], vectorize=True,
    )  # fmt: skip
    data = xr.Dataset({"amplitude_ratio": ratios, "far_ratio": far, "difference": ratios - far})
    return data.assign(table_error=table - data.difference)


def crossing(difference: Vector, tolerance: float, distances: Vector) -> float:
    """Return the last crossing of samples, interpolated with PCHIP; NaN if AR has not settled at the last sample."""
    if abs(difference[-1]) >= tolerance:
        return float("nan")
    fine = np.linspace(distances[0], distances[-1], 4000)
    return last_crossing(fine, PchipInterpolator(distances, difference)(fine), tolerance)


def by_law(edge: str, parameters: Vector) -> Vector:
    """Return the critical distances over ℓ by the law for MAIN, over λ and tolerance: value, lower and upper bound."""
    ratio = MAIN.stiffness_ratio
    return np.array([[scaled_critical_distance(edge, ratio, p, t) for t in TOLERANCES] for p in parameters])


def numbers(data: xr.Dataset) -> Iterator[Number]:
    for name in data.pair.values:
        moved = float(abs(data.other_table_error.sel(pair=name)).max())
        yield Number(f"AR at equal λ, d/ℓ: largest deviation, {name}", moved)

    for edge, (low, high) in product(EDGES, ((0.05, DECAYING), (DECAYING, 2.0))):
        part = data.sel(edge=edge, inelasticity=slice(low, high))
        if part.inelasticity.size == 0:
            continue
        simulated = part.simulated.transpose("inelasticity", "within").values
        value, least, most = np.moveaxis(by_law(edge, part.inelasticity.values), -1, 0)
        # Both are 0 if AR is within the tolerance at all distances.
        errors = 100.0 * np.abs(value - simulated) / np.maximum(simulated, 1e-9)
        held = (simulated >= least - 0.005) & (simulated <= most + 0.005) & np.isfinite(simulated)
        said = f"of d_c at {np.isfinite(simulated).sum()} pairs of λ and tolerance; median {np.nanmedian(errors):.2f} %"
        said += f"; {held.sum()} lie within the law's bounds"
        yield Number(f"law's largest error, {edge} edge, λ {low:g} to {high:g}", float(np.nanmax(errors)), said, "%")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR against d/ℓ for each edge, and the critical distance against λ with the thesis's two lines (6.41)."""
    from matplotlib import colormaps

    # Lines of constant λ, and markers for another bead and another speed.
    collapse, panels = draw.each(
        data, "edge", "{} edge".format, width=3.3, ylabels=["amplitude ratio AR"],
        xlabel="distance from the edge, d / ℓ", xlim=(0.0, 3.5), ylim=(0.0, 1.0),
    )  # fmt: skip
    parameters = [p for p in data.inelasticity.values if p in SHOWN_PARAMETERS]
    hollow: dict[str, Any] = {"markersize": 4.5, "markerfacecolor": "none"}
    for axis, edge in panels:
        for i, parameter in enumerate(parameters):
            colour, case = colormaps["viridis"](0.85 * i / len(parameters)), edge.sel(inelasticity=parameter)
            axis.plot(data.scaled_distance, case.amplitude_ratio, "-", color=colour, label=f"λ = {parameter:g}")
            if parameter in data.other_inelasticity:
                others = case.far_ratio + case.other_difference.sel(other_inelasticity=parameter)
                for marker, name in zip(draw.MARKERS, data.pair.values, strict=False):
                    axis.plot(data.other_distance, others.sel(pair=name), marker, color=colour, **hollow)
    for marker, name in zip(draw.MARKERS, data.pair.values, strict=False):
        panels[0][0].plot([], [], marker, color="black", label=str(name), **hollow)
    draw.legend_above(collapse, panels[0][0], 5)

    by_parameter, panels = draw.each(
        data.sel(within=SHOWN), "edge", "{} edge".format, width=3.3, xlabel="inelasticity parameter λ",
        ylim=(0.0, 6.0), ylabels=[f"critical distance c = $d_c$ / ℓ (AR ± {SHOWN})"],
    )  # fmt: skip
    x = np.geomspace(0.05, 2.0, 200)
    paths = [np.array(hl.critical_distance_bounds(MAIN.bead, MAIN.plate(p), MAIN.speed)) / MAIN.length(p) for p in x]
    for axis, edge in panels:
        value, low, high = by_law(edge.edge.item(), x)[:, TOLERANCES.index(SHOWN)].T
        axis.fill_between(x, low, high, color=draw.COLOURS[5], alpha=0.35, linewidth=0.0, label="bounds of the law")
        axis.plot(x, value, "-", label="law")
        axis.plot(data.inelasticity, edge.simulated, "o", color="black", markerfacecolor="none", label="simulated")
        for line, path, style in zip(("A0 Lamb", "Rayleigh"), np.transpose(paths), ("--", "-."), strict=True):
            draw.theory_line(axis, x, path, f"path of the {line} wave during a contact", style)
        draw.logarithmic(axis, "x")
    draw.legend_above(by_parameter, panels[0][0], 5)
    return {"collapse": collapse, "critical_distance": by_parameter}
