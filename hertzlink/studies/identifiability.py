"""Beyond the thesis: what a trace of a chain determines, and what it is blind to, before anything is measured.

Cramér–Rao bounds of a plate's distance to its edge and thickness, and of the bond and the upper layer of a rod, over
the ways to measure. All half-widths are those of 95 % intervals, as parts of the values.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from math import ceil, pi

import numpy as np
import xarray as xr

import hertzlink as hl
from coupling.inference.identification import DEVIATIONS
from coupling.inference.information import Design, bounds_of
from coupling.inference.misfit import GAIN, TIME_ZERO
from hertzlink.studies import draw
from hertzlink.studies.compare import Number
from hertzlink.studies.shared import over, wall_stiffness, with_units
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from structures.caution import collected
from structures.structure import Vector

BEADS, IMPACT_SPEED = 20, 0.31
NUISANCES = (GAIN, TIME_ZERO)  # A gain for each sensor, and a time zero.
NOISE, SAMPLE_EVERY = 0.01, 1e-6  # White, a part of the greatest force at each sensor; s.
RECORDS = (1.4e-3, 2.8e-3)  # s after the impact.
HIGHEST_FREQUENCY = 60e3  # Hz, resolved by the oscillators of plates; 60 to 200 kHz change AR by 1e-5.
BLIND = 0.5  # A half-width above this part of the value.
FEATURES = "AR and TOF, bead 7"
# What is measured: the whole trace, but for the first.
MEASURED: dict[str, tuple[int, ...]] = {
    FEATURES: (7,), "bead 7": (7,), "bead 13": (13,), "bead 16": (16,), "beads 7 and 13": (7, 13),
}  # fmt: skip
DRAWS = 16  # Noisy traces from which the errors of AR and TOF are taken: exact to 18 %.
# What is not known, here of a clamped edge: all of it, or the first alone.
EDGE_UNKNOWNS, FREE = ("distance", "thickness", "impact_speed"), ("all", "alone")
CHECKED = (0.06, 0.16)  # m, the distances of the table.
DISTANCES = tuple(sorted({*(float(f"{d:.3g}") for d in np.geomspace(5e-3, 0.3, 14)), *CHECKED}))
THICKNESSES, DIAMETERS = (2.29e-3, 3.0e-3, 4.83e-3), (4.76e-3, 9.53e-3)
MAIN_DIAMETER, MAIN_THICKNESS = 9.53e-3, 4.83e-3

# The modulus of the plate is not known either. The contact's stiffness is known, or follows from it, as a half-space's.
NEAR = (0.01, 0.0125, 0.015, 0.02, 0.03, 0.06)  # m.
KNOWN, OF_PLATE = "known", "of the plate"
# Relative changes of d, t and E that statics near the edge weighs, w = const. d²F/D with D ∝ E t³; and those that
# leave the plate's impedance, E t⁴, and the time of its echo, d⁴/E t², as they are.
STATICS, UNSEEN = np.array([2.0, -3.0, -1.0]), np.array([0.125, -0.25, 1.0])

# A bond below a layer, on steel with a fixed base.
BOND_SENSORS = (7, 13)
ROD_RADIUS, LOWER, ROD_BEAD = 9.525e-3, 50.8e-3, hl.Sphere(4.765e-3, hl.STEEL_440C)
# Thickness of the bond, m, and epoxy's density and Poisson's ratio, which do not matter.
GLUE, GLUE_DENSITY, GLUE_POISSON = 0.1e-3, 1200.0, 0.35
UPPERS = {"steel": hl.STEEL_440C, "PTFE": hl.PTFE}
UPPER_THICKNESSES = tuple(float(f"{d:.3g}") for d in np.geomspace(3e-3, 50e-3, 5))
# N/m³. Epoxy of 3 GPa and 0.1 mm has 3e13.
BOND_STIFFNESSES, EPOXY = tuple(float(f"{k:.1g}") for k in np.geomspace(3e10, 1e14, 8)), 3e13
CROSSING, FEWEST = 1e-6, 12  # s in which a wave crosses an element of the upper layer, at most; the fewest elements.


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return 95 % half-widths of what is not known: plates near an edge (`edge_error`), with the modulus not known
    either (`combination`), and rods with a bond (`bond_error`). quick: four distances, one plate, six bonds."""
    distances, thicknesses = ((0.01, 0.03, *CHECKED), THICKNESSES[-1:]) if quick else (DISTANCES, THICKNESSES)
    near, uppers = ((0.0125, 0.06), (6.1e-3, 24.7e-3)) if quick else (NEAR, UPPER_THICKNESSES)
    bonds = (3e10, 3e11, 3e13) if quick else BOND_STIFFNESSES
    data = over(edge_errors, jobs, diameter=DIAMETERS, distance=distances, thickness=thicknesses)
    data = data.merge(over(combinations, jobs, contact=(KNOWN, OF_PLATE), near=near))
    data = data.merge(over(bond_errors, jobs, upper=list(UPPERS), upper_thickness=uppers, bond_stiffness=bonds))
    return with_units(
        data, distance="m", near="m", thickness="m", diameter="m", record="s",
        upper_thickness="m", bond_stiffness="N/m3",
    )  # fmt: skip


def half_widths(derivatives: xr.DataArray, unknowns: Sequence[str]) -> list[float]:
    """Return the half-widths of the first unknown: the others are not known either, or are known (FREE)."""
    return [DEVIATIONS * bounds_of(derivatives, known)[0][unknowns[0]] for known in ((), unknowns[1:])]


def edge_case(
    diameter: float, distance: float, thickness: float, impact_speed: float, youngs_modulus: float | None = None,
    contact: str = KNOWN,
) -> hl.CoSimulation:  # fmt: skip
    bead, wall = hl.Sphere(0.5 * diameter, hl.STEEL_440C), hl.ALUMINIUM_6061
    if youngs_modulus is not None:
        wall = replace(wall, youngs_modulus=youngs_modulus)
    plate = hl.half_plane(thickness, wall, "clamped", distance, max(RECORDS), HIGHEST_FREQUENCY)
    if contact == KNOWN:
        plate = replace(plate, surface=hl.Surface(hl.ALUMINIUM_6061))
    return hl.CoSimulation(hl.Chain([bead] * BEADS, bead, impact_speed), plate)


def edge_design(
    diameter: float, values: Mapping[str, float], contact: str = KNOWN, noise: float = NOISE,
    sample_every: float = SAMPLE_EVERY,
) -> Design:  # fmt: skip
    """Return the traces of one plate and their derivatives, with gains and a time zero that are not known."""

    def build(**unknowns: float) -> hl.CoSimulation:
        return edge_case(diameter, **unknowns, contact=contact)

    sensors = {n for group in MEASURED.values() for n in group}
    with collected():  # Points of the contact may yield: a model of elastic contacts is what is studied.
        return Design(build, values, sensors, max(RECORDS), NUISANCES, noise, sample_every)


def edge_errors(diameter: float, distance: float, thickness: float) -> xr.Dataset:
    """Return the half-widths of the distance over the record, what is measured, and what is not known."""
    design = edge_design(diameter, dict(zip(EDGE_UNKNOWNS, (distance, thickness, IMPACT_SPEED), strict=True)))
    waveform = design.waveform()
    features = design.features(sensors=MEASURED[FEATURES], until=RECORDS[0], draws=DRAWS)
    widths = [
        [
            half_widths(
                features if what == FEATURES else waveform.sel(sensor=list(sensors), time=slice(None, record)),
                EDGE_UNKNOWNS,
            )
            for what, sensors in MEASURED.items()
        ]
        for record in RECORDS
    ]
    return labelled("edge_error", widths, record=RECORDS, measured=list(MEASURED), free=FREE)


def combinations(contact: str, near: float) -> xr.Dataset:
    """Return the half-widths of the eigenvectors of the information, best first, and these in rows: of relative changes
    of distance, thickness and modulus, by the trace of bead 7 in the shorter record.

    The impact speed, the gain and time zero are not known either.
    """
    values = {"distance": near, "thickness": MAIN_THICKNESS, "youngs_modulus": hl.ALUMINIUM_6061.youngs_modulus}
    design = edge_design(MAIN_DIAMETER, values | {"impact_speed": IMPACT_SPEED}, contact)
    bounds, correlation = bounds_of(design.waveform().sel(sensor=[7], time=slice(None, RECORDS[0])))
    root, correlated = np.array([*bounds.values()])[:3], correlation.values[:3, :3]
    size, vectors = np.linalg.eigh(correlated * np.outer(root, root))
    which = ["best", "middle", "worst"]
    data = labelled("combination_error", DEVIATIONS * np.sqrt(size), combination=which)
    label = {"units": "1", "long_name": "part in the combination"}
    of = (("combination", "of"), (vectors * np.sign(vectors[0])).T, label)
    return data.assign(combination_of=of).assign_coords(of=list(values))


def bond_errors(upper: str, upper_thickness: float, bond_stiffness: float) -> xr.Dataset:
    """Return the half-widths of the bond's stiffness over what is not known, too.

    The mesh is the same for all runs, so that derivatives are those of the rod alone. bond_stiffness: N/m³.
    """
    top = UPPERS[upper]
    elements = max(FEWEST, ceil(upper_thickness / top.bar_speed / CROSSING))

    def build(bond_stiffness: float, thickness: float, impact_speed: float) -> hl.CoSimulation:
        glue = hl.Material(bond_stiffness * GLUE, GLUE_POISSON, GLUE_DENSITY, "glue")
        stack = ((top, thickness), (glue, GLUE), (hl.STEEL_440C, LOWER))
        layers = [hl.Layer(material, length, ROD_RADIUS) for material, length in stack]
        chain = hl.Chain([ROD_BEAD] * BEADS, ROD_BEAD, impact_speed)
        return hl.CoSimulation(chain, hl.rod(layers, "fixed", elements))

    values = {"bond_stiffness": bond_stiffness, "thickness": upper_thickness, "impact_speed": IMPACT_SPEED}
    with collected():
        design = Design(build, values, BOND_SENSORS, RECORDS[0], NUISANCES, NOISE, SAMPLE_EVERY)
    return labelled("bond_error", half_widths(design.waveform(), list(values)), bond_free=FREE)


def labelled(name: str, values: Vector | Sequence[object], **axes: Sequence[object]) -> xr.Dataset:
    label = {"units": "1", "long_name": "half of the 95 % interval"}
    return xr.Dataset({name: (tuple(axes), values, label)}, {axis: list(places) for axis, places in axes.items()})


def numbers(data: xr.Dataset) -> Iterator[Number]:
    """Yield the half-widths of distances, combinations and bonds; `blind` where they exceed half of the value."""
    for diameter, distance, what in product((MAIN_DIAMETER, DIAMETERS[0]), CHECKED, MEASURED):
        case = data.edge_error.sel(diameter=diameter, thickness=MAIN_THICKNESS, distance=distance, measured=what)
        (short, long), alone = (case.sel(free=free).values for free in FREE)
        name = f"distance {1e3 * distance:.0f} mm, D {1e3 * diameter:.2f}, {what}"
        why = "two numbers cannot give three unknowns" if what == FEATURES else f"record of 2.8 ms: {percent(long)}"
        yield Number(name, percent(short), f"{why}; the distance alone: {percent(alone[0])}")

    for contact, distance in product(data.contact.values, data.near.values):
        at = data.sel(contact=contact, near=distance)
        vectors = [", ".join(f"{part:+.2f}" for part in vector) for vector in at.combination_of.values]
        rows = zip(at.combination.values, vectors, at.combination_error.values, strict=True)
        said = "; ".join(f"{which} ({vector}) ± {percent(error)}" for which, vector, error in rows)
        name = f"(d, t, E) at {1e3 * distance:g} mm, contact's stiffness {contact}: cosine of best and statics"
        yield Number(name, cosine(at.combination_of.values[0], STATICS), said)
    worst = data.combination_of.sel(contact=KNOWN, combination="worst").values
    said = "the least; a thin plate's motion depends on E t⁴ and d⁴/(E t²) alone"
    yield Number("known: cosine of worst and what no motion shows", min(cosine(v, UNSEEN) for v in worst), said)

    for upper, thickness in product(data.upper.values.tolist(), data.upper_thickness.values):
        bond = data.bond_error.sel(upper=upper, upper_thickness=thickness)
        good = bond.bond_stiffness.values[bond.sel(bond_free="all").values <= BLIND]
        reach = f"{max(good):.0e} N/m³" if good.size else "none of the map"
        least, alone = map(percent, bond.sel(bond_stiffness=EPOXY, bond_free=list(FREE)).values)
        # The contact's tangent stiffness over the rod's area, at the peak of a bead's collision.
        layer, stiffness = UPPERS[upper].youngs_modulus / thickness, wall_stiffness(ROD_BEAD, UPPERS[upper])
        approach = (1.25 * ROD_BEAD.mass * (PARTICLE_TO_STRIKER_SPEED * IMPACT_SPEED) ** 2 / stiffness) ** 0.4
        contact = 1.5 * stiffness * approach**0.5 / (pi * ROD_RADIUS**2)
        said = f"stiffnesses: bond {EPOXY:.0e}, layer {layer:.0e}, contact {contact:.0e} N/m³; "
        said += f"alone unknown: {alone}; bonds are identified up to {reach}"
        yield Number(f"epoxy bond below {1e3 * thickness:.3g} mm of {upper}, beads 7 and 13", least, said)


def percent(error: float) -> str:
    """Return a half-width in per cent, or `blind`."""
    return f"{100.0 * error:.2g} %" if error <= BLIND else "blind"


def cosine(vector: Vector, pattern: Vector) -> float:
    return float(abs(np.dot(vector, pattern)) / np.linalg.norm(vector) / np.linalg.norm(pattern))


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the maps of the half-widths: of the distance for each record, and of the bond; blind regions hatched."""
    drawn = {f"distance_{1e3 * record:.1f}_ms": distance_map(data.sel(record=record)) for record in data.record.values}
    figure, axes = draw.panels(data.upper.size, 4.4, 3.1, sharey=True, ylabels=["upper layer (mm)"])
    for axis, upper in zip(axes, data.upper.values, strict=True):
        errors = data.bond_error.sel(upper=upper, bond_free="all")
        half_width_map(axis, errors.assign_coords(bond_stiffness=1e-12 * errors.bond_stiffness), "upper_thickness")
        layer = 1e-12 * UPPERS[str(upper)].youngs_modulus / data.upper_thickness.values
        limits, label = axis.get_xlim(), "stiffness of the layer, E/L"
        axis.plot(layer, range(layer.size), "-", color="firebrick", linewidth=1.8, label=label)
        axis.set(title=f"{upper} on steel, beads 7 and 13", xlim=limits, xlabel="stiffness of the bond (N/µm/mm²)")
    legend(figure, axes, "95 % half-width\nof the bond's stiffness")
    return {**drawn, "bond": figure}


def distance_map(data: xr.Dataset) -> draw.Figure:
    figure, axes = draw.panels(
        len(MEASURED), 2.2, 2.3, sharey=True, rows=data.diameter.size, ylabels=["plate (mm)"], xlabel="distance (mm)"
    )
    for axis, (diameter, what) in zip(axes, product(data.diameter.values, MEASURED), strict=True):
        errors = data.edge_error.sel(diameter=diameter, measured=what, free=FREE[what == FEATURES])
        half_width_map(axis, errors.assign_coords(distance=1e3 * errors.distance), "thickness")
        title = f"{what}\n(distance alone unknown)" if what == FEATURES else what
        axis.set_title(f"{title}, D {1e3 * diameter:.2f}", fontsize="small")
    legend(figure, axes, "95 % half-width\nof the distance")
    record = f"record of {1e3 * float(data.record):.1f} ms, white noise of 1 %"
    figure.suptitle(f"Clamped edge of an aluminium plate; {record}", fontsize=11)
    return figure


def half_width_map(axis: draw.Axes, errors: xr.DataArray, rows: str) -> None:
    """Draw cells over a logarithmic axis, in rows of equal height; hatched grey where blind."""
    from matplotlib.colors import LogNorm
    from matplotlib.ticker import LogLocator

    (across,) = (str(name) for name in errors.dims if name != rows)
    shown = errors.transpose(rows, across)
    draw.logarithmic(axis, "x")
    axis.set_facecolor("0.85")
    axis.patch.set(hatch="////", edgecolor="0.55")
    axis.grid(visible=False)
    logs, places = np.log(shown[across].values), np.arange(shown.sizes[rows])
    middle = 0.5 * (logs[1:] + logs[:-1])
    ends = np.exp(np.concatenate([[2.0 * logs[0] - middle[0]], middle, [2.0 * logs[-1] - middle[-1]]]))
    edges = np.arange(places.size + 1) - 0.5
    look = draw.Look(cmap="viridis", norm=LogNorm(1e-3, BLIND), zorder=1.5)
    axis.pcolormesh(ends, edges, shown.where(shown <= BLIND), **look)
    if ends[-1] > 1e3 * ends[0]:
        axis.xaxis.set_major_locator(LogLocator())
    axis.set_yticks(places, [f"{1e3 * row:.3g}" for row in shown[rows].values])


def legend(figure: draw.Figure, axes: list[draw.Axes], label: str) -> None:
    """Add the bar of the colours, and what hatched cells and lines mean."""
    from matplotlib.patches import Patch

    ticks = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5)
    bar = figure.colorbar(axes[0].collections[0], ax=axes, extend="min", ticks=ticks, pad=0.01)
    bar.ax.minorticks_off()
    bar.ax.set_yticklabels([f"{100.0 * tick:g} %" for tick in ticks])
    bar.set_label(label)
    blind = Patch(facecolor="0.85", hatch="////", edgecolor="0.55", label="blind: more than ± 50 %")
    figure.legend(handles=[blind, *axes[0].get_legend_handles_labels()[0]], loc="outside lower left", ncols=2)
