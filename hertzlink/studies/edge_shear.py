"""The limit of Kirchhoff's theory near an edge: Mindlin's plate at the same λ and d/ℓ, over thickness over ℓ."""

from functools import lru_cache

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.edge_cases import Pair, measure
from hertzlink.studies.table import Row, Rows
from structures.structure import Vector

row = Rows("edge_shear")
PARAMETER = 0.3  # λ; near this value AR depends most strongly on it.
SPEEDS = (0.02, 0.31, 3.1)  # m/s. At the same λ a faster striker gives a shorter ℓ in units of the thickness.
PLACES = (1.0, 1.5, np.inf)  # d/ℓ.
# Side of Mindlin's square plate, and its centre, in ℓ: echoes of the other edges return after the contact.
SIDE, FAR_AWAY = 22.0, 11.0
RECORD, REDUCTION = 30.0, 0.05  # Record in contact times of the slowest striker; tolerance of the reduction.
THEORIES = ("Kirchhoff", "Mindlin")
REPORTED_DIFFERENCE = 0.01  # A difference of AR of this size matters.


def pair(speed: float) -> Pair:
    """Return the beads of 4.76 mm on aluminium."""
    return Pair(hl.Sphere(2.38e-3, hl.STEEL_440C), hl.ALUMINIUM_6061, speed)


@lru_cache(maxsize=1)
def thick(speed: float, place: float, until: float) -> hl.Structure:
    """Return Mindlin's plate, clamped at the left."""
    case, edges = pair(speed), hl.Supports(left="clamped")
    length, thickness = case.length(PARAMETER), case.plate(PARAMETER).thickness
    side, highest = SIDE * length, 1.2 / case.contact_time
    plate = hl.mindlin_plate(side, side, thickness, case.wall, edges, highest_frequency=highest)
    return hl.reduce(plate.at(length * min(place, FAR_AWAY), side / 2.0), until, REDUCTION)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR by Kirchhoff's and Mindlin's theory over striker speed and d/ℓ. quick: one speed, two places."""
    speeds, places = (SPEEDS[1:2], PLACES[::2]) if quick else (SPEEDS, PLACES)
    until = RECORD * pair(min(speeds)).contact_time

    def build(theory: str, shear_speed: float, place: float) -> hl.CoSimulation:
        case = pair(shear_speed)
        if theory == "Mindlin":
            return case.coupled(thick(shear_speed, place, until))
        return case.coupled(case.struck("clamped", PARAMETER, place, until))

    runs = hl.sweep(build, until, jobs, measure, theory=THEORIES, shear_speed=speeds, place=places)
    thickness = [pair(v).plate(PARAMETER).thickness / pair(v).length(PARAMETER) for v in speeds]
    data = xr.Dataset({"theory_ratio": runs.amplitude_ratio})
    return data.assign_coords(relative_thickness=("shear_speed", thickness, {"units": "1", "long_name": "t/ℓ"}))


def lowered(data: xr.Dataset) -> xr.DataArray:
    """Return the amount by which Mindlin's AR is lower."""
    thin, thick_walled = (data.theory_ratio.sel(theory=theory, drop=True) for theory in THEORIES)
    difference: xr.DataArray = thin - thick_walled
    return difference


def limit(thickness: Vector, difference: Vector) -> float:
    """Return t/ℓ at which the difference, assumed proportional to (t/ℓ)², is REPORTED_DIFFERENCE; from the nearest."""
    nearest = int(np.argmin(np.abs(np.log(np.maximum(difference, 1e-9) / REPORTED_DIFFERENCE))))
    return float(thickness[nearest] * (REPORTED_DIFFERENCE / difference[nearest]) ** 0.5)


def table(data: xr.Dataset) -> list[Row]:
    """Return t/ℓ from which shear changes AR by 0.01."""
    rows, thickness = [], data.relative_thickness.values
    for place in data.place.values:
        differences = lowered(data).sel(place=place).values
        samples = ", ".join(f"{d:.4f} at t/ℓ = {t:.2f}" for t, d in zip(thickness, differences, strict=True))
        rows.append(row("limit", limit(thickness, differences), PARAMETER, samples, place=_place(place)))
    return rows


def _place(place: float) -> str:
    return "far from edges" if np.isinf(place) else f"d = {place:g} ℓ from a clamped edge"


def figure(data: xr.Dataset) -> draw.Figure:
    """Return AR lost by shear against t/ℓ."""
    drawn, (axis,) = draw.panels(1, width=4.4, height=3.4)
    draw.lines(axis, lowered(data), "relative_thickness", "place", _place)
    axis.axhline(REPORTED_DIFFERENCE, color="black", linewidth=0.8, linestyle=":")
    axis.set(xlabel="thickness t / ℓ", ylabel="AR, Kirchhoff less Mindlin", xlim=(0.0, None), ylim=(0.0, None))
    axis.legend()
    return drawn
