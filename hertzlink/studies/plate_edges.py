"""Beyond section 6.2.2: other kinds of edges, and Mindlin's theory, compared with the clamped thin plates."""

from functools import lru_cache
from itertools import product
from math import isnan

import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.on_plates import HIGHEST_FREQUENCY, SIDE, chain, measure
from hertzlink.studies.results import with_units
from hertzlink.studies.table import Named, Row, Rows

row = Rows("plate_edges")
# The support of the edge at the distance, besides clamped; at the corner a clamped and a free edge have this distance.
CORNER = "clamped and free, at their corner"
EDGES = {
    "simple": hl.Supports(left="simple", right="simple"),
    "free": hl.Supports(),
    CORNER: hl.Supports(left="clamped", right="clamped"),
}
THICKNESS, MATERIAL = 2.29e-3, hl.ALUMINIUM_6061
DIAMETERS = (4.76e-3, 9.53e-3)
DISTANCES = (0.01, 0.02, 0.03, 0.04, 0.06, 0.08, 0.1, 0.15, 0.2)
THEORIES = ("Kirchhoff", "Mindlin")
THICKNESSES = (2.29e-3, 4.83e-3)
FEW_DISTANCES = (0.02, 0.06)
UNTIL, REDUCTION = 1.5e-3, 0.02  # Length of the record (s), and tolerance of the reduction.


def run(clamped: xr.DataArray, quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR over edge, distance and bead; and over theory, thickness, distance and bead. quick: fewer of each.

    clamped: AR of Kirchhoff's plates with clamped edges, over thickness, distance and diameter, which is not run again.
    """
    distances, beads = ((0.02, 0.15), DIAMETERS[1:]) if quick else (DISTANCES, DIAMETERS)
    few, thick = (FEW_DISTANCES[:1], THICKNESSES[:1]) if quick else (FEW_DISTANCES, THICKNESSES)

    def by_edge(edge: str, edge_distance: float, edge_bead: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain(edge_bead), held(edge, edge_distance))

    def with_shear(wall: float, near: float, small_bead: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain(small_bead), mindlin(wall, near))

    edges = hl.sweep(by_edge, UNTIL, jobs, measure, edge=list(EDGES), edge_distance=distances, edge_bead=beads)
    sheared = hl.sweep(with_shear, UNTIL, jobs, measure, wall=thick, near=few, small_bead=DIAMETERS)
    at_edge = clamped.sel(thickness=THICKNESS, distance=list(distances), diameter=list(beads), drop=True)
    at_edge = at_edge.rename(distance="edge_distance", diameter="edge_bead").expand_dims(edge=["clamped"])
    thin = clamped.sel(thickness=list(thick), distance=list(few), diameter=list(DIAMETERS))
    thin = thin.rename(thickness="wall", distance="near", diameter="small_bead")
    theory = xr.DataArray(list(THEORIES), dims="theory", name="theory")
    data = xr.Dataset(
        {
            "edge_amplitude_ratio": xr.concat([at_edge, edges.amplitude_ratio], "edge"),
            "theory_amplitude_ratio": xr.concat([thin, sheared.amplitude_ratio], theory),
        }
    )
    return with_units(data, edge_distance="m", edge_bead="m", wall="m", near="m", small_bead="m")


@lru_cache(maxsize=1)
def held(edge: str, distance: float) -> hl.Structure:
    """Return the thinnest plate with these edges, struck at the distance on its centre line, or from the corner."""
    plate = hl.kirchhoff_plate(SIDE, SIDE, THICKNESS, MATERIAL, EDGES[edge], highest_frequency=HIGHEST_FREQUENCY)
    return hl.reduce(plate.at(distance, distance if edge == CORNER else SIDE / 2.0), UNTIL, REDUCTION)


@lru_cache(maxsize=1)
def mindlin(thickness: float, distance: float) -> hl.Structure:
    """Return a clamped plate in Mindlin's theory."""
    plate = hl.mindlin_plate(SIDE, SIDE, thickness, MATERIAL, EDGES[CORNER], highest_frequency=HIGHEST_FREQUENCY)
    return hl.reduce(plate.at(distance, SIDE / 2.0), UNTIL, REDUCTION)


def table(data: xr.Dataset) -> list[Row]:
    """Return AR at other edges and in Mindlin's theory; the thesis has neither."""
    rows = []
    nearest, farthest = (1e3 * float(data.edge_distance[place]) for place in (0, -1))
    for edge in data.edge.values:
        near, far = data.edge_amplitude_ratio.sel(edge=edge, edge_bead=DIAMETERS[1]).values[[0, -1]].tolist()
        shown = "no wave" if isnan(far) else f"{far:.3f}"
        rows.append(row("edge", "no wave" if isnan(near) else near, farthest, shown, edge=edge, distance=nearest))
    distance = float(data.near[-1])
    for thickness, bead in product(data.wall.values, data.small_bead.values):
        at = data.theory_amplitude_ratio.sel(wall=thickness, small_bead=bead, near=distance)
        thin, thick = (float(at.sel(theory=theory)) for theory in THEORIES)
        named = Named(distance=1e3 * distance, diameter=1e3 * bead, thickness=1e3 * thickness)
        rows.append(row("Mindlin", thick, thin, 100.0 * (1.0 - thick / thin), **named))
    return rows


def figure(data: xr.Dataset) -> draw.Figure:
    """Return AR against the distance for each kind of edge, one panel for each bead."""
    thick = f"t = {THICKNESS * 1e3:.2f} mm"
    labels = draw.Look(xlabel="distance from the edge (mm); ×: no wave", ylabels=["amplitude ratio AR"])
    drawn, beads = draw.each(data, "edge_bead", lambda d: f"D = {d * 1e3:.2f} mm, {thick}", width=3.6, **labels)
    for axis, bead in beads:
        for i, edge in enumerate(data.edge.values):
            curve = bead.edge_amplitude_ratio.sel(edge=edge)
            draw.mark_missing(axis, data.edge_distance.values[curve.isnull().values] * 1e3, i)
            axis.plot(data.edge_distance * 1e3, curve, color=draw.COLOURS[i], marker=draw.MARKERS[i], label=str(edge))
        axis.set_ylim(0.0, 1.0)
    axis.legend()
    return drawn
