"""Beyond the thesis: what a trace of a chain determines, and what it is blind to, before anything is measured.

Cramér–Rao bounds (`hl.identifiability`) of a plate's distance to its edge and thickness, and of the bond and the upper
layer of a rod, over the ways to measure. All half-widths are those of 95 % intervals, as parts of the values.
"""

from collections.abc import Iterator, Sequence
from functools import partial
from itertools import product

import numpy as np
import xarray as xr

from hertzlink.studies import draw
from hertzlink.studies import identifiable_cases as cases
from hertzlink.studies.identifiable_cases import BLIND, CHECKED, DISTANCES, FEATURES
from hertzlink.studies.results import over, with_units
from hertzlink.studies.table import Named, Row, Rows
from structures.structure import Vector

row = Rows("identifiability")
THICKNESSES = (2.29e-3, 3.0e-3, 4.83e-3)
DIAMETERS = (4.76e-3, 9.53e-3)
# Distances at which derivatives are taken with other steps, as well as at those of the table.
TESTED_EVERY = 5
NEAR = (0.01, 0.0125, 0.015, 0.02, 0.03, 0.06)  # m, distances at which the plate's modulus is not known either.
NEAR_STATICS = 0.016  # m, up to which the echo is back so soon that the contact feels a spring.
MAIN_DIAMETER, MAIN_THICKNESS = 9.53e-3, 4.83e-3
UPPER_THICKNESSES = tuple(float(f"{d:.3g}") for d in np.geomspace(3e-3, 50e-3, 5))
# N/m³. Epoxy of 3 GPa and 0.1 mm has 3e13.
BOND_STIFFNESSES, EPOXY = tuple(float(f"{k:.1g}") for k in np.geomspace(3e10, 1e14, 8)), 3e13
QUICK_DISTANCES, QUICK_THICKNESSES, QUICK_NEAR = (0.01, 0.03, *CHECKED), (4.83e-3,), (0.0125, 0.06)
QUICK_UPPERS, QUICK_BONDS = (6.1e-3, 24.7e-3), (3e10, 3e11, 3e13)
# What an earlier estimate found; its record and what was known are not given.
EARLIER = {
    (FEATURES, 0.06): "96 %", ("bead 7", 0.06): "0.5 %", ("beads 7 and 13", 0.06): "0.2 %",
    ("bead 7", 0.16): "blind", ("bead 13", 0.16): "1.4 %", ("bead 16", 0.16): "0.4 %",
}  # fmt: skip
# Relative changes of d, t and E that statics near the edge weighs, w = const. d²F/D with D ∝ E t³; and those that
# leave the plate's impedance, E t⁴, and the time of its echo, d⁴/E t², as they are.
STATICS, UNSEEN = np.array([2.0, -3.0, -1.0]), np.array([0.125, -0.25, 1.0])


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return 95 % half-widths of what is not known: plates near an edge (`edge_error`), with the modulus not known
    either (`combination`), and rods with a bond (`bond_error`).

    quick: four distances, one plate, six bonds.
    """
    distances, thicknesses = (QUICK_DISTANCES, QUICK_THICKNESSES) if quick else (DISTANCES, THICKNESSES)
    near, bonds = (QUICK_NEAR, (QUICK_UPPERS, QUICK_BONDS)) if quick else (NEAR, (UPPER_THICKNESSES, BOND_STIFFNESSES))
    jobs = 1 if quick and jobs is None else jobs
    data = edges(jobs, distances, thicknesses)
    of_contact = partial(cases.combinations_near_edge, MAIN_DIAMETER, thickness=MAIN_THICKNESS)
    data = data.merge(over(of_contact, jobs, contact=(cases.KNOWN, cases.OF_PLATE), near=near))
    uppers, stiffnesses = bonds
    upper = list(cases.UPPERS)
    data = data.merge(over(cases.bond_errors, jobs, upper=upper, upper_thickness=uppers, bond_stiffness=stiffnesses))
    return with_units(data, **cases.UNITS)


def edges(jobs: int | None, distances: Sequence[float], thicknesses: Sequence[float]) -> xr.Dataset:
    """Return the half-widths over the distance, the thickness, the beads and what is measured."""
    tested = {*distances[::TESTED_EVERY], *CHECKED}

    def errors(diameter: float, distance: float, thickness: float) -> xr.Dataset:
        steps = cases.STEPS if distance in tested else cases.STEPS[:1]
        return cases.edge_errors(diameter, distance, thickness, steps)

    widths = over(errors, jobs, diameter=DIAMETERS, distance=distances, thickness=thicknesses).half_width
    return xr.Dataset({"edge_error": widths.isel(step=0), "edge_error_of_steps": widths.isel(unknown=0, free=0)})


def table(data: xr.Dataset) -> list[Row]:
    """Return the half-widths, and earlier estimates if there are any; `blind` where they exceed half of the value."""
    grid = product((MAIN_DIAMETER, DIAMETERS[0]), CHECKED, cases.MEASURED)
    rows = [_distance_row(data.sel(diameter=d, thickness=MAIN_THICKNESS), what, x) for d, x, what in grid]
    rows += [_reach_row(data.sel(diameter=d, thickness=t)) for d in data.diameter for t in data.thickness]
    return [*rows, _derivatives_row(data), *_combination_rows(data), *_bond_rows(data)]


def printed(error: float) -> str:
    """Return a half-width in per cent, or `blind`."""
    return f"{100.0 * error:.2g} %" if error <= BLIND else "blind"


def _distance_row(case: xr.Dataset, what: str, distance: float) -> Row:
    at = case.edge_error.sel(distance=distance, measured=what, unknown="distance")
    named = Named(distance=distance * 1e3, diameter=float(case.diameter) * 1e3, what=what)
    earlier = EARLIER.get((what, distance)) if float(case.diameter) == MAIN_DIAMETER else None
    said = f"earlier estimate: {earlier}; " if earlier else ""
    (short, long), alone = at.sel(free="all").values, at.sel(free="distance").values
    if what == FEATURES:
        return row("AR and TOF", printed(short), said, printed(alone[0]), **named)
    steps = case.edge_error_of_steps.sel(distance=distance, measured=what)
    first, second = (printed(width) + _changed(steps.isel(record=k)) for k, width in enumerate((short, long)))
    return row("distance", first, said, second, printed(alone[0]), **named)


def _changed(steps: xr.DataArray) -> str:
    """Return a mark where signals are not linear within the half-width, or ± 0.4 % of the distance if that is less."""
    first, half, wide = steps.values
    other = wide if first > cases.STEPS[2] else half
    return " (~)" if first <= BLIND and abs(other / first - 1.0) > 0.1 else ""


def _reach_row(case: xr.Dataset) -> Row:
    """Return the last distances of the grid, mm, that are identified, by the ways to measure."""
    shortest, reaches = cases.RECORDS[0], {}
    for what, record in product(cases.MEASURED, cases.RECORDS):
        if what != FEATURES or record == shortest:
            free = "distance" if what == FEATURES else "all"
            errors = case.edge_error.sel(measured=what, record=record, free=free, unknown="distance")
            good = errors.distance.values[errors.values <= BLIND]
            reaches[what, record] = f"{good[-1] * 1e3:.3g}" if good.size else "none"
    main = reaches.pop(("beads 7 and 13", shortest))
    others = [
        f"{what}{' (the distance alone)' if what == FEATURES else ''} {text}"
        + (f" ({record * 1e3:g} ms)" if record != shortest else "")
        for (what, record), text in reaches.items()
    ]
    named = Named(diameter=float(case.diameter) * 1e3, thickness=float(case.thickness) * 1e3)
    return row("farthest", main, "; ".join(others), **named)


def _derivatives_row(data: xr.Dataset) -> Row:
    steps = data.edge_error_of_steps.drop_sel(measured=FEATURES).sel(record=cases.RECORDS[0])
    first = steps.isel(step=0)
    _, half, wide = abs(steps / first - 1.0).where(first <= BLIND).transpose("step", ...)
    few, many = (int((change > 0.1).sum()) for change in (half, wide))
    said = few, int(half.notnull().sum()), 100.0 * float(wide.median()), many
    return row("derivatives", f"{100.0 * float(half.median()):.2g} %", *said)


def _combination_rows(data: xr.Dataset) -> Iterator[Row]:
    for contact, distance in product(data.contact.values, data.near.values):
        at = data.sel(contact=contact, near=distance)
        vectors, errors, matrix = at.combination_of.values, at.combination_error.values, at.correlation.values
        half_widths = ["blind" if error > BLIND else f"± {printed(error)}" for error in errors]
        parts = [f"{_vector(vector)} {half}" for vector, half in zip(vectors, half_widths, strict=True)]
        pairs = f"dt {matrix[0, 1]:+.2f}, dE {matrix[0, 2]:+.2f}, tE {matrix[1, 2]:+.2f}"
        expected = 1.0 if contact == cases.KNOWN and distance <= NEAR_STATICS else ""
        named = Named(distance=distance * 1e3, contact=contact)
        yield row("statics", _cosine(vectors[0], STATICS), *parts, pairs, theory=expected, **named)
    worst = data.combination_of.sel(contact=cases.KNOWN, combination="worst").values
    yield row("unseen", min(_cosine(vector, UNSEEN) for vector in worst), theory=1.0)


def _cosine(vector: Vector, pattern: Vector) -> float:
    return float(abs(np.dot(vector, pattern)) / np.linalg.norm(vector) / np.linalg.norm(pattern))


def _vector(parts: Vector) -> str:
    return "(" + ", ".join(f"{part:+.2f}" for part in parts) + ")"


def _bond_rows(data: xr.Dataset) -> Iterator[Row]:
    for upper, thickness in product(data.upper.values, data.upper_thickness.values):
        bond = data.bond_error.sel(
            upper=upper, upper_thickness=thickness, bond_measured="beads 7 and 13", bond_unknown="bond_stiffness"
        )
        weakest = bond.sel(bond_free="all")
        good = [k for k in data.bond_stiffness.values if float(weakest.sel(bond_stiffness=k)) <= BLIND]
        epoxy = bond.sel(bond_stiffness=EPOXY, bond_free=["all", "bond_stiffness"]).values.tolist()
        least, alone = map(printed, epoxy)
        reach = f"{max(good):.0e} N/m³" if good else "none of the map"
        stiffnesses = cases.UPPERS[str(upper)].youngs_modulus / thickness, cases.contact_stiffness(str(upper))
        yield row("bond", least, EPOXY, *stiffnesses, alone, reach, thickness=thickness * 1e3, upper=upper)


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the maps of the half-widths: of the distance for each record, and of the bond."""
    from hertzlink.studies import identifiable_figures as drawn

    maps = {f"distance_{1e3 * r:.1f}_ms": drawn.distances(data.sel(record=r)) for r in data.record.values}
    return {**maps, "bond": drawn.bonds(data)}
