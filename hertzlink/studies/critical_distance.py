"""Beyond section 6.2.2: AR near an edge depends on λ and d/ℓ only; the law that follows, and where shear ends it."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

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

DISTANCES = (*(round(0.1 * i, 1) for i in range(1, 36)), *(0.5 * i for i in range(8, 19)))  # d/ℓ.
QUICK_PARAMETERS, QUICK_DISTANCES = (0.12, 0.34, 0.75), (0.2, 0.6, 1.0, 1.4, 1.8, 2.2, 2.6, 3.4)
OTHER_PARAMETERS, OTHER_DISTANCES = (0.12, 0.34, 0.75), (0.6, 1.0, 1.4, 1.8, 2.4)
# λ; none of these values is a node of the law's table.
PARAMETERS = (0.06, 0.12, 0.17, 0.24, 0.34, 0.48, 0.63, 0.75, 0.95, 1.2, 1.6, 1.95)
LAW_PARAMETERS = np.geomspace(0.05, 2.0, 200)
# Allowed differences of AR from its far value beyond the critical distance; the one in the figures.
TOLERANCES, SHOWN = (0.01, 0.02, 0.05), 0.02
SHOWN_PARAMETERS = (0.06, 0.12, 0.24, 0.34, 0.48, 0.75, 1.2)  # λ in the figure of the collapse, if it was simulated.

# Mindlin's plate, which has shear: of one λ, near which AR depends most strongly on it. At the same λ a faster striker,
# m/s, gives a shorter ℓ in units of the thickness.
SHEARED, SPEEDS = 0.3, (0.02, 0.31, 3.1)
PLACES = {1.0: "d = 1 ℓ from a clamped edge", 1.5: "d = 1.5 ℓ from a clamped edge", np.inf: "far from edges"}
# Side of the square plate, and its centre, in ℓ: echoes of the other edges return after the contact.
WIDE, FAR_AWAY = 22.0, 11.0
SHEARED_RECORD, ROUGH = 30.0, 0.05  # Record in contact times of the slowest striker; tolerance of the reduction.
THEORIES, MATTERS = ["Kirchhoff", "Mindlin"], 0.01  # A difference of AR of this size matters.


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
        """Return a plate of the thickness that gives λ, which goes as its power −2."""
        thin = hl.kirchhoff_plate(1.0, 1.0, 1e-3, self.wall, hl.Supports())
        parameter = hl.theory.PlateImpact(self.bead, thin, self.speed).inelasticity
        return hl.kirchhoff_plate(1.0, 1.0, float(1e-3 * (parameter / inelasticity) ** 0.5), self.wall, hl.Supports())

    def length(self, inelasticity: float) -> float:
        return edge_length(self.bead, self.plate(inelasticity), self.speed)

    def on(self, structure: hl.Structure) -> hl.CoSimulation:
        chain = hl.Chain([self.bead] * shared.BEADS, self.bead, self.speed)
        return hl.CoSimulation(chain, structure, dt=self.contact_time / STEPS_PER_CONTACT)

    def near(self, edge: str, inelasticity: float, scaled: float, until: float | None = None) -> hl.CoSimulation:
        """Return the chain at d/ℓ from an edge: at a supported edge a half-space, far away the infinite plate.

        until: the longest run, s; by default the `record`.
        """
        thickness = self.plate(inelasticity).thickness
        if np.isinf(scaled):
            return self.on(hl.infinite_plate(thickness, self.wall))
        if scaled == 0.0 and edge != "free":
            return self.on(hl.half_space(self.wall))
        distance, highest = scaled * self.length(inelasticity), HIGHEST_PHASE / self.contact_time
        return self.on(hl.half_plane(thickness, self.wall, edge, distance, until or self.record, highest))

    def ratios(self, edge: str, inelasticity: float, distances: Iterable[float]) -> list[float]:
        """Return AR at distances over ℓ; infinity is the plate without an edge."""
        return [ratio(self.near(edge, inelasticity, scaled).run(self.record)) for scaled in distances]


# The thesis's middle bead on aluminium, and other beads, speeds and materials at the same λ and d/ℓ.
LARGE, SMALL = hl.Sphere(4.765e-3, hl.STEEL_440C), hl.Sphere(2.38e-3, hl.STEEL_440C)
MAIN, REFERENCE = Pair(LARGE, hl.ALUMINIUM_6061), "9.53 mm beads"
OTHER_PAIRS = {
    "4.76 mm beads": Pair(SMALL, hl.ALUMINIUM_6061),
    "1.2 m/s": Pair(LARGE, hl.ALUMINIUM_6061, 1.2),
    "steel 316 beads": Pair(hl.Sphere(LARGE.radius, hl.STEEL_316), hl.ALUMINIUM_6061),
    "brass beads": Pair(hl.Sphere(LARGE.radius, hl.BRASS_360), hl.ALUMINIUM_6061),
    "glass plate": Pair(LARGE, hl.Material(70e9, 0.22, 2500.0, "glass")),
    "copper plate": Pair(LARGE, hl.MATERIALS["copper"]),
    "steel plate": Pair(LARGE, hl.STEEL_440C),
}
SAME_MATERIALS = ("4.76 mm beads", "1.2 m/s")  # The pairs with the materials of MAIN.
PAIRS = {REFERENCE: MAIN, **OTHER_PAIRS}
STRUCK = {speed: Pair(SMALL, hl.ALUMINIUM_6061, speed) for speed in SPEEDS}  # On Mindlin's plate.


def ratio(run: xr.Dataset) -> float:
    """Return AR of the primary wave; 0 if there is none."""
    primary = hl.reflections(run, shared.SENSOR, SMALLEST_WAVE).primary
    return primary.amplitude_ratio if primary else 0.0


def measure(run: xr.Dataset) -> xr.Dataset:
    return xr.Dataset({"amplitude_ratio": ratio(run)})


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR over edge, λ and d/ℓ; of other pairs; the law compared with both; what shear changes. quick: fewer."""
    parameters, distances = (QUICK_PARAMETERS, QUICK_DISTANCES) if quick else (PARAMETERS, DISTANCES)
    data = sampled([REFERENCE], parameters, distances, jobs).sel(pair=REFERENCE, drop=True)
    data = data.assign_coords(within=list(TOLERANCES))
    data["simulated"] = xr.apply_ufunc(
        crossing, data.difference, data.within, input_core_dims=[["scaled_distance"], []],
        kwargs={"distances": data.scaled_distance.values}, vectorize=True,
    )  # fmt: skip

    names, few = (list(OTHER_PAIRS)[::3], OTHER_PARAMETERS[1:2]) if quick else (list(OTHER_PAIRS), OTHER_PARAMETERS)
    others = sampled(names, few, OTHER_DISTANCES, jobs)[["difference", "table_error"]]
    others["material_deviation"] = others.difference - tabulated(others.difference, MAIN.stiffness_ratio)
    data = data.merge(shared.named(others, "other").rename(
        edge="other_edge", inelasticity="other_inelasticity", scaled_distance="other_distance"
    ))  # fmt: skip
    return data.merge(law()).merge(sheared(quick, jobs))


def sampled(names: list[str], parameters: Sequence[float], distances: Sequence[float], jobs: int | None) -> xr.Dataset:
    """Return AR of pairs over edge, λ and d/ℓ, its value far away, the difference, and by how much the table errs."""

    def near(pair: str, edge: str, inelasticity: float, scaled_distance: float) -> hl.CoSimulation:
        return PAIRS[pair].near(edge, inelasticity, scaled_distance)

    runs = hl.sweep(
        near, min(PAIRS[name].record for name in names), jobs, measure, pair=names, edge=EDGES,
        inelasticity=parameters, scaled_distance=(*distances, np.inf),
    ).amplitude_ratio  # fmt: skip
    ratios, far = runs.isel(scaled_distance=slice(None, -1)), runs.isel(edge=0, scaled_distance=-1, drop=True)
    stiffness = xr.DataArray([PAIRS[name].stiffness_ratio for name in names], dims="pair", coords={"pair": names})
    data = xr.Dataset({"amplitude_ratio": ratios, "far_ratio": far, "difference": ratios - far})
    return data.assign(table_error=tabulated(data.difference, stiffness) - data.difference)


def crossing(difference: Vector, tolerance: float, distances: Vector) -> float:
    """Return the last crossing of samples, interpolated with PCHIP; NaN if AR has not settled at the last sample."""
    if abs(difference[-1]) >= tolerance:
        return float("nan")
    fine = np.linspace(distances[0], distances[-1], 4000)
    return last_crossing(fine, PchipInterpolator(distances, difference)(fine), tolerance)


def tabulated(difference: xr.DataArray, stiffness_ratio: float | xr.DataArray) -> xr.DataArray:
    """Return the values of the law's table for simulated differences over edge, λ and d/ℓ."""
    distances = difference.scaled_distance.values
    differences: xr.DataArray = xr.apply_ufunc(
        lambda edge, ratio, parameter: np.interp(distances, *edge_difference(str(edge), ratio, parameter)),
        difference.edge, stiffness_ratio, difference.inelasticity,
        output_core_dims=[["scaled_distance"]], vectorize=True,
    )  # fmt: skip
    return differences


def law() -> xr.Dataset:
    """Return c(λ) and its bounds for the materials of MAIN, and the thesis's two lines."""
    bounds = [hl.critical_distance_bounds(MAIN.bead, MAIN.plate(p), MAIN.speed) for p in LAW_PARAMETERS]
    lines = np.array(bounds) / np.array([MAIN.length(p) for p in LAW_PARAMETERS])[:, None]
    axes = {"edge": list(EDGES), "law_inelasticity": LAW_PARAMETERS, "within": list(TOLERANCES)}
    estimates = [by_law(edge, LAW_PARAMETERS) for edge in EDGES]
    return xr.Dataset(
        {
            "law": ((*axes, "estimate"), estimates, {"units": "1", "long_name": "critical distance / ℓ"}),
            "scaled_line": (("law_inelasticity", "line"), lines, {"units": "1", "long_name": "equation 6.41, L / ℓ"}),
        },
        {**axes, "estimate": ["value", "low", "high"], "line": ["A0 Lamb", "Rayleigh"]},
    )


def by_law(edge: str, parameters: Vector) -> Vector:
    """Return the critical distances over ℓ by the law for MAIN, over λ and tolerance: value, lower and upper bound."""
    ratio = MAIN.stiffness_ratio
    return np.array([[scaled_critical_distance(edge, ratio, p, t) for t in TOLERANCES] for p in parameters])


def sheared(quick: bool, jobs: int | None) -> xr.Dataset:
    """Return AR by Kirchhoff's theory and by Mindlin's over d/ℓ and t/ℓ, which the striker's speed sets."""
    speeds, places = (SPEEDS[1:2], [*PLACES][::2]) if quick else (SPEEDS, [*PLACES])
    until = SHEARED_RECORD * STRUCK[min(speeds)].contact_time

    def build(theory: str, shear_speed: float, place: float) -> hl.CoSimulation:
        pair = STRUCK[shear_speed]
        if theory == "Kirchhoff":
            return pair.near("clamped", SHEARED, place, until)
        length, thickness = pair.length(SHEARED), pair.plate(SHEARED).thickness
        side, highest, edges = WIDE * length, 1.2 / pair.contact_time, hl.Supports(left="clamped")
        plate = hl.mindlin_plate(side, side, thickness, pair.wall, edges, highest_frequency=highest)
        return pair.on(hl.reduce(plate.at(length * min(place, FAR_AWAY), side / 2.0), until, ROUGH))

    runs = hl.sweep(build, until, jobs, measure, theory=THEORIES, shear_speed=speeds, place=places).amplitude_ratio
    thickness = [STRUCK[v].plate(SHEARED).thickness / STRUCK[v].length(SHEARED) for v in speeds]
    lowered = runs.sel(theory="Kirchhoff", drop=True) - runs.sel(theory="Mindlin", drop=True)
    label = {"units": "1", "long_name": "t/ℓ"}
    return xr.Dataset({"lowered": lowered}).assign_coords(relative_thickness=("shear_speed", thickness, label))


def numbers(data: xr.Dataset) -> Iterator[Number]:
    for name in data.pair.values:
        case = data.sel(pair=name)
        moved, error = (float(abs(case[what]).max()) for what in ("other_material_deviation", "other_table_error"))
        said = f"ratio of the contacts' stiffnesses {PAIRS[name].stiffness_ratio:.3f}, of steel on aluminium "
        said += f"{MAIN.stiffness_ratio:.3f}; from the table for its own ratio at most {error:.4f}"
        yield Number(f"AR at equal λ, d/ℓ: largest deviation, {name}", moved, said)

    for edge, (low, high) in product(EDGES, ((0.05, DECAYING), (DECAYING, 2.0))):
        part = data.sel(edge=edge, inelasticity=(data.inelasticity > low) & (data.inelasticity <= high))
        if part.inelasticity.size == 0:
            continue
        simulated = part.simulated.transpose("inelasticity", "within").values
        value, least, most = np.moveaxis(by_law(edge, part.inelasticity.values), -1, 0)
        # Both are 0 if AR is within the tolerance at all distances.
        errors = 100.0 * np.abs(value - simulated) / np.maximum(simulated, 1e-9)
        held = (simulated >= least - 0.005) & (simulated <= most + 0.005) & np.isfinite(simulated)
        said = f"of d_c at {np.isfinite(simulated).sum()} pairs of λ and tolerance; median {np.nanmedian(errors):.2f} %"
        said += f"; {held.sum()} lie within the law's bounds. AR: at most {float(abs(part.table_error).max()):.4f}"
        yield Number(f"law's largest error, {edge} edge, λ {low:g} to {high:g}", float(np.nanmax(errors)), said, "%")

    # t/ℓ from which shear matters, by the nearest difference, which is assumed proportional to (t/ℓ)².
    thickness = data.relative_thickness.values
    for place in data.place.values:
        lowered = data.lowered.sel(place=place).values
        nearest = int(np.argmin(np.abs(np.log(np.maximum(lowered, 1e-9) / MATTERS))))
        limit = float(thickness[nearest] * (MATTERS / lowered[nearest]) ** 0.5)
        samples = ", ".join(f"{d:.4f} at t/ℓ = {t:.2f}" for t, d in zip(thickness, lowered, strict=True))
        name = f"t/ℓ at which shear lowers AR by {MATTERS:g}, {PLACES[place]}"
        yield Number(name, limit, f"λ = {SHEARED}; Mindlin's AR is lower by {samples}")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    labels = draw.Look(xlabel="thickness t / ℓ", ylabel="AR, Kirchhoff minus Mindlin")
    shear, (axis,) = draw.panels(1, width=4.4, height=3.4, **labels)
    for place in data.place.values:
        axis.plot(data.relative_thickness, data.lowered.sel(place=place), label=PLACES[place])
    axis.axhline(MATTERS, color="black", linewidth=0.8, linestyle=":")
    axis.set_xlim(left=0.0)
    axis.set_ylim(bottom=0.0)
    axis.legend()
    return {"collapse": collapse(data), "critical_distance": by_parameter(data), "shear": shear}


def collapse(data: xr.Dataset) -> draw.Figure:
    """Return AR against d/ℓ for each edge: lines of constant λ, and markers for other beads and speeds, if any."""
    from matplotlib import colormaps

    look = draw.Look(xlabel="distance from the edge, d / ℓ", xlim=(0.0, 3.5), ylim=(0.0, 1.0), width=3.3, height=3.5)
    figure, panels = draw.each(data, "edge", "{} edge".format, ylabels=["amplitude ratio AR"], **look)
    parameters = [p for p in data.inelasticity.values if p in SHOWN_PARAMETERS]
    same = [name for name in SAME_MATERIALS if name in data.pair]
    look, first = draw.Look(markersize=4.5, markerfacecolor="none"), panels[0][0]
    for axis, edge in panels:
        for i, parameter in enumerate(parameters):
            colour, case = colormaps["viridis"](0.85 * i / len(parameters)), edge.sel(inelasticity=parameter)
            axis.plot(data.scaled_distance, case.amplitude_ratio, "-", color=colour, label=f"λ = {parameter:g}")
            for marker, name in zip(draw.MARKERS, same, strict=False):
                if parameter in data.other_inelasticity.values:
                    other = case.other_difference.sel(pair=name, other_edge=case.edge, other_inelasticity=parameter)
                    axis.plot(data.other_distance, other + case.far_ratio, marker, color=colour, **look)
    for marker, name in zip(draw.MARKERS, same, strict=False):
        first.plot([], [], marker, color="black", label=str(name), **look)
    draw.legend_above(figure, first, 5)
    return figure


def by_parameter(data: xr.Dataset) -> draw.Figure:
    """Return c against λ by the law, with its bounds, simulated values, and the thesis's two lines."""
    look = draw.Look(xlabel="inelasticity parameter λ", xscale="log", ylim=(0.0, 6.0), width=3.3, height=3.5)
    label = f"critical distance c = $d_c$ / ℓ (AR ± {SHOWN})"
    figure, panels = draw.each(data, "edge", "{} edge".format, ylabels=[label], **look)
    x = data.law_inelasticity
    for axis, edge in panels:
        at = edge.sel(within=SHOWN)
        ends = at.law.sel(estimate="low"), at.law.sel(estimate="high")
        axis.fill_between(x, *ends, color=draw.COLOURS[5], alpha=0.35, linewidth=0.0, label="bounds of the law")
        axis.plot(x, at.law.sel(estimate="value"), "-", label="law")
        axis.plot(data.inelasticity, at.simulated, "o", color="black", markerfacecolor="none", label="simulated")
        for line, style in zip(data.line.values, ("--", "-."), strict=True):
            words = f"path of the {line} wave during a contact"
            draw.theory_line(axis, x, data.scaled_line.sel(line=line), words, style)
        draw.logarithmic(axis, "x")
    draw.legend_above(figure, panels[0][0], 5)
    return figure
