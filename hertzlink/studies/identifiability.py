"""Beyond the thesis: what a trace of a chain determines, and what it is blind to, before anything is measured.

Cramér–Rao bounds (`hl.identifiability`) of a plate's distance to its edge and thickness, and of the bond and the upper
layer of a rod, over the ways to measure. All half-widths are those of 95 % intervals, as parts of the values.
"""

from collections.abc import Sequence
from itertools import product
from typing import Any

import joblib
import numpy as np
import xarray as xr

from coupling.sweeps.progress import watched
from hertzlink.studies import draw
from hertzlink.studies import identifiable_cases as cases
from hertzlink.studies.expected import Named, Rows
from hertzlink.studies.identifiable_cases import CHECKED, DISTANCES
from hertzlink.studies.table import Row
from structures.checks import whole
from structures.structure import Vector

row = Rows("identifiability")
THICKNESSES = (2.29e-3, 3.0e-3, 4.83e-3)
DIAMETERS = (4.76e-3, 9.53e-3)
TESTED_EVERY = 5  # Distances at which derivatives are taken with other steps, as well as at those of the table.
NEAR = (0.01, 0.0125, 0.015, 0.02, 0.03, 0.06)  # m, distances at which the plate's modulus is not known either.
NEAR_STATICS = 0.016  # m, up to which the echo is back so soon that the contact feels a spring.
MAIN_DIAMETER, MAIN_THICKNESS = 9.53e-3, 4.83e-3
UPPER_THICKNESSES = tuple(float(f"{d:.3g}") for d in np.geomspace(3e-3, 50e-3, 5))
# N/m³. Epoxy of 3 GPa and 0.1 mm has 3e13.
BOND_STIFFNESSES = tuple(float(f"{k:.1g}") for k in np.geomspace(3e10, 1e14, 8))
EPOXY = 3e13
QUICK_DISTANCES, QUICK_THICKNESSES, QUICK_NEAR = (0.01, 0.03, *CHECKED), (4.83e-3,), (0.0125, 0.06)
QUICK_UPPERS, QUICK_BONDS = (6.1e-3, 24.7e-3), (3e10, 3e11, 3e13)
BLIND = 0.5  # A half-width above this part of the value.
# What an earlier estimate found; its record and what was known are not given.
EARLIER = {
    (cases.FEATURES, 0.06): "96 %", ("bead 7", 0.06): "0.5 %", ("beads 7 and 13", 0.06): "0.2 %",
    ("bead 7", 0.16): "blind", ("bead 13", 0.16): "1.4 %", ("bead 16", 0.16): "0.4 %",
}  # fmt: skip
Conditions = cases.Conditions


def run(quick: bool = False, jobs: int | None = None, **parameters: Any) -> xr.Dataset:
    """Return 95 % half-widths of what is not known: plates near an edge (`edge_error`), with the modulus not known
    either (`combination`), and rods with a bond (`bond_error`).

    quick: four distances, one plate, six bonds.
    """
    distances, thicknesses = (QUICK_DISTANCES, QUICK_THICKNESSES) if quick else (DISTANCES, THICKNESSES)
    near, bonds = (QUICK_NEAR, (QUICK_UPPERS, QUICK_BONDS)) if quick else (NEAR, (UPPER_THICKNESSES, BOND_STIFFNESSES))
    count = joblib.cpu_count() if jobs is None else whole("jobs", jobs)
    parallel = joblib.Parallel(1 if quick and jobs is None else count, return_as="generator")
    of = Conditions.of(parameters)
    if of.own:
        data = edges(parallel, of.few("distance", distances), of.thickness, of.bead, of)
        return of.marked(data.drop_vars(["edge_error_of_steps", "step"]))
    data = edges(parallel, distances, thicknesses)
    return data.merge(near_edge(parallel, near)).merge(bonded(parallel, *bonds))


def edges(
    parallel: joblib.Parallel, distances: Sequence[float], thicknesses: Sequence[float],
    diameters: Sequence[float] = DIAMETERS, of: Conditions = cases.THESIS,
) -> xr.Dataset:  # fmt: skip
    """Return the half-widths over the distance, the thickness, the beads and what is measured."""
    tested = set() if of.own else {*distances[::TESTED_EVERY], *CHECKED}
    grid = list(product(diameters, distances, thicknesses))
    runs = parallel(
        joblib.delayed(cases.edge_errors)(*case, cases.STEPS if case[1] in tested else cases.STEPS[:1], of)
        for case in grid
    )
    runs_done = list(watched(runs, len(grid)))
    values = np.array(runs_done).reshape(len(diameters), len(distances), len(thicknesses), *runs_done[0].shape)
    dims = ("diameter", "distance", "thickness", "step", "record", "measured", "free", "unknown")
    errors = cases.relative(dims, values, "half of the 95 % interval")
    data = xr.Dataset({"edge_error": errors.isel(step=0), "edge_error_of_steps": errors.isel(unknown=0, free=0)})
    return data.assign_coords(
        cases.coordinates(
            diameter=diameters, distance=distances, thickness=thicknesses, step=cases.STEPS, record=of.record,
            measured=cases.MEASURED, free=cases.EDGE_FREE, unknown=cases.EDGE_UNKNOWNS,
        )
    )  # fmt: skip


def near_edge(parallel: joblib.Parallel, distances: Sequence[float]) -> xr.Dataset:
    """Return the combinations of distance, thickness and modulus, the best one first, where the contact is known or is
    not."""
    contacts = (cases.KNOWN, cases.OF_PLATE)
    grid = list(product(contacts, distances))
    runs = parallel(
        joblib.delayed(cases.combinations_near_edge)(MAIN_DIAMETER, distance, MAIN_THICKNESS, contact)
        for contact, distance in grid
    )
    results = list(watched(runs, len(grid)))
    shape = (len(contacts), len(distances))
    errors, vectors, matrices = (np.array(part).reshape(*shape, *part[0].shape) for part in zip(*results, strict=True))
    over = ("contact", "near")
    data = xr.Dataset(
        {
            "combination_error": cases.relative((*over, "combination"), errors, "half of the 95 % interval"),
            "combination_of": cases.relative((*over, "combination", "of"), vectors, "part in the combination"),
            "correlation": cases.relative((*over, "of", "other"), matrices, "correlation of the estimates"),
        }
    )
    names = cases.MATERIAL_UNKNOWNS
    combination = ("best", "middle", "worst")
    places = cases.coordinates(contact=contacts, near=distances, combination=combination, of=names, other=names)
    return data.assign_coords(places)


def bonded(parallel: joblib.Parallel, uppers: Sequence[float], stiffnesses: Sequence[float]) -> xr.Dataset:
    """Return the half-widths of the bond and the upper layer."""
    grid = list(product(cases.UPPERS, uppers, stiffnesses))
    errors = list(watched(parallel(joblib.delayed(cases.bond_errors)(*case) for case in grid), len(grid)))
    values = np.array(errors).reshape(len(cases.UPPERS), len(uppers), len(stiffnesses), *errors[0].shape)
    dims = ("upper", "upper_thickness", "bond_stiffness", "bond_measured", "bond_free", "bond_unknown")
    data = xr.Dataset({"bond_error": cases.relative(dims, values, "half of the 95 % interval")})
    return data.assign_coords(
        cases.coordinates(
            upper=cases.UPPERS, upper_thickness=uppers, bond_stiffness=stiffnesses,
            bond_measured=cases.BOND_MEASURED, bond_free=cases.BOND_FREE, bond_unknown=cases.BOND_UNKNOWNS,
        )
    )  # fmt: skip


def table(data: xr.Dataset) -> list[Row]:
    """Return the half-widths, and where an earlier estimate exists its numbers; `blind` where they exceed half of the
    value."""
    if Conditions.read(data).own:
        return _own_rows(data)
    rows = [
        _distance_row(data.sel(diameter=diameter, thickness=MAIN_THICKNESS), what, distance)
        for diameter in (MAIN_DIAMETER, DIAMETERS[0])
        for distance in CHECKED
        for what in cases.MEASURED
    ]
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
    short, long = at.sel(free="all").values
    alone = at.sel(free="distance").values
    if what == cases.FEATURES:
        return row("AR and TOF", printed(short), said, printed(alone[0]), **named)
    steps = case.edge_error_of_steps.sel(distance=distance, measured=what)
    doubt = [_changed(steps.isel(record=k)) for k in (0, 1)]
    return row("distance", printed(short) + doubt[0], said, printed(long) + doubt[1], printed(alone[0]), **named)


def _changed(steps: xr.DataArray) -> str:
    """Return a mark where signals are not linear within the half-width, or within ± 0.4 % of the distance if that is
    less."""
    first, half, wide = steps.values
    other = wide if first > cases.STEPS[2] else half
    return " (~)" if first <= BLIND and abs(other / first - 1.0) > 0.1 else ""


def _reach_row(case: xr.Dataset) -> Row:
    reaches = []
    for what in cases.MEASURED:
        for record in cases.RECORDS if what != cases.FEATURES else cases.RECORDS[:1]:
            free = "distance" if what == cases.FEATURES else "all"
            errors = case.edge_error.sel(measured=what, record=record, free=free, unknown="distance")
            reaches.append((what, record, _farthest(errors)))
    main = next(text for what, record, text in reaches if (what, record) == ("beads 7 and 13", cases.RECORDS[0]))
    others = [
        f"{what}{' (the distance alone)' if what == cases.FEATURES else ''} {text}"
        + (f" ({record * 1e3:g} ms)" if record != cases.RECORDS[0] else "")
        for what, record, text in reaches
        if text is not main
    ]
    named = Named(diameter=float(case.diameter) * 1e3, thickness=float(case.thickness) * 1e3)
    return row("farthest", main, "; ".join(others), **named)


def _farthest(errors: xr.DataArray) -> str:
    """Return the last distance of the grid that is identified, mm."""
    good = errors.distance.values[errors.values <= BLIND]
    return f"{good[-1] * 1e3:.3g}" if good.size else "none"


def _derivatives_row(data: xr.Dataset) -> Row:
    steps = data.edge_error_of_steps.drop_sel(measured=cases.FEATURES).sel(record=cases.RECORDS[0])
    first = steps.isel(step=0)
    away = abs(steps / first - 1.0).where(first <= BLIND)
    count = int(away.isel(step=1).notnull().sum())
    half, wide = (
        [float(change.median()), int((change > 0.1).sum())] for change in (away.isel(step=1), away.isel(step=2))
    )
    return row("derivatives", f"{100.0 * half[0]:.2g} %", half[1], count, 100.0 * wide[0], wide[1])


# Relative changes of d, t and E that statics near the edge weighs, w = const. d²F/D with D ∝ E t³; and those that leave
# the plate's impedance, E t⁴, and the time of its echo, d⁴/E t², as they are.
STATICS, UNSEEN = np.array([2.0, -3.0, -1.0]), np.array([0.125, -0.25, 1.0])


def _combination_rows(data: xr.Dataset) -> list[Row]:
    rows = []
    for contact, distance in product(data.contact.values, data.near.values):
        at = data.sel(contact=contact, near=distance)
        vectors, errors = at.combination_of.values, at.combination_error.values
        parts = [f"{_vector(vector)} {_pm(error)}" for vector, error in zip(vectors, errors, strict=True)]
        matrix = at.correlation.values
        pairs = [f"dt {matrix[0, 1]:+.2f}", f"dE {matrix[0, 2]:+.2f}", f"tE {matrix[1, 2]:+.2f}"]
        is_known = contact == cases.KNOWN
        expected = 1.0 if is_known and distance <= NEAR_STATICS else ""
        said, named = (*parts, ", ".join(pairs)), Named(distance=distance * 1e3, contact=contact)
        rows.append(row("statics", _cosine(vectors[0], STATICS), *said, theory=expected, **named))
    worst = [
        _cosine(vector, UNSEEN) for vector in data.combination_of.sel(contact=cases.KNOWN, combination="worst").values
    ]
    return [*rows, row("unseen", min(worst), theory=1.0)]


def _cosine(vector: Vector, pattern: Vector) -> float:
    return float(abs(np.dot(vector, pattern)) / np.linalg.norm(vector) / np.linalg.norm(pattern))


def _pm(error: float) -> str:
    return "blind" if error > BLIND else f"± {printed(error)}"


def _vector(parts: Vector) -> str:
    return "(" + ", ".join(f"{part:+.2f}" for part in parts) + ")"


def _bond_rows(data: xr.Dataset) -> list[Row]:
    rows = []
    for upper, thickness in product(data.upper.values, data.upper_thickness.values):
        at = data.bond_error.sel(upper=upper, upper_thickness=thickness, bond_measured="beads 7 and 13")
        bond = at.sel(bond_unknown="bond_stiffness")
        epoxy = bond.sel(bond_stiffness=EPOXY)
        upper_stiffness = cases.UPPERS[str(upper)].youngs_modulus / thickness
        contact = cases.contact_stiffness(str(upper))
        weakest = bond.sel(bond_free="all")
        good = [k for k in data.bond_stiffness.values if float(weakest.sel(bond_stiffness=k)) <= BLIND]
        least, alone = (printed(float(epoxy.sel(bond_free=free))) for free in ("all", "bond_stiffness"))
        reach = f"{max(good):.0e} N/m³" if good else "none of the map"
        said, named = (EPOXY, upper_stiffness, contact, alone, reach), Named(thickness=thickness * 1e3, upper=upper)
        rows.append(row("bond", least, *said, **named))
    return rows


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the maps of the half-widths: of the distance for each record, and of the bond."""
    from hertzlink.studies import identifiable_figures as drawn

    if Conditions.read(data).own:
        return _own_figures(data)
    named = {
        f"distance_{1e3 * record:.1f}_ms": drawn.distances(data.sel(record=record)) for record in data.record.values
    }
    return named | Named(bond=drawn.bonds(data))


def _own_rows(data: xr.Dataset) -> list[Row]:
    """Return the half-width of the distance for each bead, plate, distance and way to measure."""
    rows = []
    for diameter, thickness, distance in product(
        *(data[name].values for name in ("diameter", "thickness", "distance"))
    ):
        ratios = data.edge_error.sel(diameter=diameter, thickness=thickness, distance=distance)
        named = Named(distance=distance * 1e3, diameter=diameter * 1e3, thickness=thickness * 1e3)
        for what in data.measured.values:
            at = ratios.sel(measured=what)
            first = at.isel(record=0)
            longer = [f"; record of {r * 1e3:g} ms: {_width(at.sel(record=r))}" for r in data.record.values[1:]]
            said = [_width(first, free="distance")]
            if what != cases.FEATURES:
                said += [_width(first, "thickness"), _width(first, "impact_speed"), "".join(longer)]
            kind = "own AR and TOF" if what == cases.FEATURES else "own trace"
            rows.append(row(kind, _width(first), *said, what=what, **named))
    return rows


def _width(at: xr.DataArray, unknown: str = "distance", free: str = "all") -> str:
    return printed(float(at.sel(unknown=unknown, free=free)))


def _own_figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the half-widths of the distance over the distance: a panel for each plate and each bead."""
    figures = {}
    for diameter in data.diameter.values:
        figure, axes = draw.panels(data.sizes["thickness"], width=3.4, height=3.6)
        for axis, thickness in zip(axes, data.thickness.values, strict=True):
            at = data.edge_error.sel(diameter=diameter, thickness=thickness, unknown="distance", free="all")
            for what in (name for name in data.measured.values if name != cases.FEATURES):
                axis.plot(data.distance * 1e3, 100.0 * at.isel(record=0).sel(measured=what), label=str(what))
            axis.axhline(100.0 * BLIND, color="black", linestyle=":", linewidth=0.9)
            axis.set(title=f"D = {diameter * 1e3:.2f} mm, t = {thickness * 1e3:.2f} mm", xscale="log", yscale="log")
            axis.set_xlabel("distance to the edge (mm)")
        axes[0].set_ylabel(f"half-width of the distance (%), {1e3 * float(data.record[0]):g} ms")
        axes[0].legend()
        figures[f"distance_{diameter * 1e3:.2f}_mm"] = figure
    return figures
