"""Beyond section 6.2.2: other kinds of edges, and Mindlin's theory, which has shear, beside Kirchhoff's."""

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import product

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Number
from hertzlink.studies.edge_cases import SMALL, Pair, measure
from structures.structure import Vector

EDGES = {
    "clamped": hl.Supports(left="clamped", right="clamped"),
    "simple": hl.Supports(left="simple", right="simple"),
    "free": hl.Supports(),
}
DIAMETERS, DISTANCES = (4.76e-3, 9.53e-3), (0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2)
THICKNESSES, FEW_DISTANCES = (2.29e-3, 4.83e-3), (0.02, 0.06)
UNTIL, REDUCTION = 1.5e-3, 0.02  # Length of the record, s, and tolerance of the reduction.

# Plates of one λ, struck faster: the same motion on a thicker plate in units of ℓ.
PARAMETER = 0.3  # λ; near this value AR depends most strongly on it.
SPEEDS = (0.02, 0.31, 3.1)  # m/s. At the same λ a faster striker gives a shorter ℓ in units of the thickness.
PAIRS = {speed: Pair(SMALL, shared.ALUMINIUM, speed) for speed in SPEEDS}  # Beads of 4.76 mm.
PLACES = {1.0: "d = 1 ℓ from a clamped edge", 1.5: "d = 1.5 ℓ from a clamped edge", np.inf: "far from edges"}
# Side of Mindlin's square plate, and its centre, in ℓ: echoes of the other edges return after the contact.
WIDE, FAR_AWAY = 22.0, 11.0
RECORD, ROUGH = 30.0, 0.05  # Record in contact times of the slowest striker; tolerance of the reduction.
THEORIES: dict[str, Callable[..., hl.Plate]] = {"Kirchhoff": hl.kirchhoff_plate, "Mindlin": hl.mindlin_plate}
REPORTED = 0.01  # A difference of AR of this size matters.


@lru_cache(maxsize=1)
def held(theory: str, edge: str, thickness: float, distance: float) -> hl.Structure:
    """Return the thesis's plate with these edges, struck at the distance on its centre line."""
    plate = THEORIES[theory](
        shared.SIDE, shared.SIDE, thickness, shared.ALUMINIUM, EDGES[edge], highest_frequency=shared.HIGHEST_FREQUENCY
    )
    return hl.reduce(plate.at(distance, shared.SIDE / 2.0), UNTIL, REDUCTION)


@lru_cache(maxsize=1)
def thick(speed: float, place: float, until: float) -> hl.Structure:
    case, edges = PAIRS[speed], hl.Supports(left="clamped")
    length, thickness = case.length(PARAMETER), case.plate(PARAMETER).thickness
    side, highest = WIDE * length, 1.2 / case.contact_time
    plate = hl.mindlin_plate(side, side, thickness, case.wall, edges, highest_frequency=highest)
    return hl.reduce(plate.at(length * min(place, FAR_AWAY), side / 2.0), until, ROUGH)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR over edge, distance and bead; over theory, thickness, distance and bead; over theory, t/ℓ and d/ℓ.

    quick: fewer of each.
    """
    distances, beads = ((0.02, 0.15), DIAMETERS[1:]) if quick else (DISTANCES, DIAMETERS)
    few, walls = (FEW_DISTANCES[:1], THICKNESSES[:1]) if quick else (FEW_DISTANCES, THICKNESSES)
    speeds, places = (SPEEDS[1:2], [*PLACES][::2]) if quick else (SPEEDS, [*PLACES])
    until = RECORD * PAIRS[min(speeds)].contact_time

    def by_edge(edge: str, edge_distance: float, edge_bead: float) -> hl.CoSimulation:
        return hl.CoSimulation(shared.plate_chain(edge_bead), held("Kirchhoff", edge, THICKNESSES[0], edge_distance))

    def of_thesis(theory: str, wall: float, near: float, small_bead: float) -> hl.CoSimulation:
        return hl.CoSimulation(shared.plate_chain(small_bead), held(theory, "clamped", wall, near))

    def of_parameter(theory: str, shear_speed: float, place: float) -> hl.CoSimulation:
        case = PAIRS[shear_speed]
        if theory == "Mindlin":
            return case.coupled(thick(shear_speed, place, until))
        return case.coupled(case.struck("clamped", PARAMETER, place, until))

    def ratio(run: xr.Dataset) -> xr.Dataset:
        return xr.Dataset({"amplitude_ratio": hl.amplitude_ratio(run, shared.SENSOR)})

    theories = list(THEORIES)
    edges = hl.sweep(by_edge, UNTIL, jobs, ratio, edge=list(EDGES), edge_distance=distances, edge_bead=beads)
    walls_of = hl.sweep(of_thesis, UNTIL, jobs, ratio, theory=theories, wall=walls, near=few, small_bead=DIAMETERS)
    scaled = hl.sweep(of_parameter, until, jobs, measure, theory=theories, shear_speed=speeds, place=places)
    thickness = [PAIRS[v].plate(PARAMETER).thickness / PAIRS[v].length(PARAMETER) for v in speeds]
    ratios = {"edge_amplitude_ratio": edges, "theory_amplitude_ratio": walls_of, "theory_ratio": scaled}
    data = xr.Dataset({name: runs.amplitude_ratio for name, runs in ratios.items()}, attrs=edges.attrs)
    label = {"units": "1", "long_name": "t/ℓ"}
    data = data.assign_coords(relative_thickness=("shear_speed", thickness, label))
    return shared.with_units(data, edge_distance="m", edge_bead="m", wall="m", near="m", small_bead="m")


def lowered(data: xr.Dataset) -> xr.DataArray:
    difference: xr.DataArray = data.theory_ratio.sel(theory="Kirchhoff") - data.theory_ratio.sel(theory="Mindlin")
    return difference


def limit(thickness: Vector, difference: Vector) -> float:
    """Return t/ℓ at which the difference, assumed proportional to (t/ℓ)², is REPORTED; from the nearest."""
    nearest = int(np.argmin(np.abs(np.log(np.maximum(difference, 1e-9) / REPORTED))))
    return float(thickness[nearest] * (REPORTED / difference[nearest]) ** 0.5)


def numbers(data: xr.Dataset) -> Iterator[Number]:
    near, far = (1e3 * float(data.edge_distance[place]) for place in (0, -1))
    for edge in data.edge.values:
        ratios = data.edge_amplitude_ratio.sel(edge=edge, edge_bead=DIAMETERS[1]).fillna(0.0).values
        said = f"Kirchhoff, D 9.53, t 2.29; at {far:.0f} mm {ratios[-1]:.3f}"
        yield Number(f"AR, {edge}, {near:.0f} mm", float(ratios[0]) or "no wave", said)
    distance = float(data.near[-1])
    for wall, bead in product(data.wall.values, data.small_bead.values):
        thin, sheared = data.theory_amplitude_ratio.sel(wall=wall, small_bead=bead, near=distance).values.tolist()
        said = f"Kirchhoff {thin:.4f}: with shear the plate reflects {100.0 * (1.0 - sheared / thin):.1f} % less"
        yield Number(f"AR, Mindlin, {1e3 * distance:.0f} mm, D {1e3 * bead:.2f}, t {1e3 * wall:.2f}", sheared, said)
    thickness = data.relative_thickness.values
    for place in data.place.values:
        differences = lowered(data).sel(place=place).values
        samples = ", ".join(f"{d:.4f} at t/ℓ = {t:.2f}" for t, d in zip(thickness, differences, strict=True))
        name = f"t/ℓ at which shear lowers AR by {REPORTED:g}, {PLACES[place]}"
        yield Number(name, limit(thickness, differences), f"λ = {PARAMETER}; Mindlin's AR is lower by {samples}")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR against the distance for each kind of edge, and AR lost by shear against t/ℓ."""
    xlabel, ylabels = "distance from the edge (mm); ×: no wave", ["amplitude ratio AR"]
    edges, panels = draw.each(
        data, "edge_bead", lambda d: f"D = {d * 1e3:.2f} mm, t = {1e3 * THICKNESSES[0]:.2f} mm", width=3.6,
        xlabel=xlabel, ylabels=ylabels, ylim=(0.0, 1.0),
    )  # fmt: skip
    for axis, bead in panels:
        for i, edge in enumerate(data.edge.values):
            curve = bead.edge_amplitude_ratio.sel(edge=edge)
            draw.mark_missing(axis, data.edge_distance.values[curve.isnull().values] * 1e3, i)
            axis.plot(data.edge_distance * 1e3, curve, color=draw.COLOURS[i], marker=draw.MARKERS[i], label=str(edge))
    axis.legend()
    shear, (axis,) = draw.panels(1, width=4.4, height=3.4, xlabel="thickness t / ℓ", xlim=(0.0, None), ylim=(0.0, None))
    for place in data.place.values:
        axis.plot(data.relative_thickness, lowered(data).sel(place=place), label=PLACES[place])
    axis.axhline(REPORTED, color="black", linewidth=0.8, linestyle=":")
    axis.set_ylabel("AR, Kirchhoff less Mindlin")
    axis.legend()
    return {"edges": edges, "shear": shear}
