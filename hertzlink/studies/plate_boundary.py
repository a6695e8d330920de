"""Thesis section 6.2.2: the reflected wave against the distance from a clamped edge, and the critical distance."""

from collections.abc import Iterator
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Number, bracketed
from hertzlink.studies.shared import ALUMINIUM, DIAMETERS, SENSOR, THICKNESSES
from hertzlink.studies.shared import PLATE_SPEED as SPEED
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from plates.section import flexural_wavelength, homogeneous_section
from structures.bodies.elasticity import pressure_speed, shear_speed
from structures.caution import collected

# m, the first scan. Beyond the last crossing AR oscillates by 0.007 at most, as scans with steps of 1 or 2 mm show. So
# no crossing is missed for tolerances of 0.01 and more.
DISTANCES = tuple(round(mm * 1e-3, 3) for mm in (*range(10, 201, 10), *range(240, 441, 40), 457))
QUICK_DISTANCES = (0.01, 0.02, 0.03, 0.04, 0.06, 0.1, 0.15, 0.457)
BRACKET, QUICK_BRACKET = 0.2e-3, 5.0e-3
TOLERANCE, TOLERANCES = 0.02, (0.01, 0.02, 0.05)  # Allowed differences of AR from its far value.
LINES = ("A0 Lamb", "Rayleigh")  # The waves whose path during a contact equation 6.42 gives.
# Length of the record in contact times of a bead on a half-space. The largest beads on the two thinner plates send a
# wave back only when the echo of the edge pushes them, the later the farther the edge is: records up to four times as
# long do not settle these cases (docs/numerics.md).
RECORD = 31.8


def contact_time(diameter: float) -> float:
    """Return T_c, s, of a bead on a half-space of the plate's metal."""
    return shared.contact_time(shared.sphere(diameter), ALUMINIUM, SPEED)


def record(diameter: float) -> float:
    return RECORD * contact_time(diameter)


@lru_cache(maxsize=1)
def modes() -> hl.ModalPlate:
    thinnest = shared.plate(THICKNESSES[0], highest_frequency=shared.HIGHEST_FREQUENCY)
    return hl.ModalPlate(thinnest, record(DIAMETERS[-1]))


def build(thickness: float, distance: float, diameter: float) -> hl.CoSimulation:
    """Return the chain on the centre line of the plate, at a distance from a clamped edge."""
    struck = modes().at(distance, shared.SIDE / 2.0, thickness)
    return hl.CoSimulation(shared.plate_chain(diameter), struck, accuracy="screening")


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF of every plate, bead and distance (m), and the critical distances with their brackets.

    quick: eight of the 27 distances of the first scan, and brackets of 5 mm, beside which numerical errors do not
    count.
    """
    scan, bracket = (QUICK_DISTANCES, QUICK_BRACKET) if quick else (DISTANCES, BRACKET)
    parts = [
        hl.critical_distance_search(
            build, record(diameter), SENSOR, scan, TOLERANCES, bracket,
            jobs=jobs, thickness=THICKNESSES, diameter=[diameter],
        )
        for diameter in DIAMETERS
    ]  # fmt: skip
    data = xr.concat(parts, "diameter", join="outer")
    data["sampled"] = data.sampled.fillna(False).astype(bool)
    thin = shared.plate(THICKNESSES[0])
    bounds = [hl.critical_distance_bounds(shared.sphere(diameter), thin, SPEED) for diameter in DIAMETERS]
    label = {"units": "m", "long_name": "critical distance, equation 6.42"}
    data = data.assign_coords(line=list(LINES)).assign(bound=(("diameter", "line"), bounds, label))
    far = hl.sweep(
        lambda thickness, diameter: hl.CoSimulation(
            shared.plate_chain(diameter), hl.infinite_plate(thickness, ALUMINIUM)
        ),
        record(DIAMETERS[-1]), 1, shared.returned, thickness=THICKNESSES, diameter=DIAMETERS,
    )  # fmt: skip
    data["infinite_amplitude_ratio"] = far.amplitude_ratio
    data = shared.with_units(data, thickness="m", diameter="m")
    return data if quick else with_margins(data)


def with_margins(data: xr.Dataset) -> xr.Dataset:
    """Return critical distances with the numerical errors of AR there, and with the errors of distance that follow, m.

    AR at the critical distance is compared with that of the exact half-plane, and the far value with that of the
    infinite plate; both have neither modes nor a coarse window.
    """
    data["ratio_error"] = xr.full_like(data.far_value, np.nan)
    for diameter, thickness in product(DIAMETERS, THICKNESSES):
        at = {"diameter": diameter, "thickness": thickness}
        case = data.sel(at)
        distance = float(case.critical_distance.sel(within=TOLERANCE))
        if np.isfinite(distance):
            here, far = ratio_error(diameter, thickness, distance), case.far_value - case.infinite_amplitude_ratio
            data.ratio_error.loc[at] = np.hypot(here, float(far.fillna(0.0)))
    ends = data.bracket.where(np.isfinite(data.bracket), data.bracket.sel(end="low"))
    samples = data.amplitude_ratio.sel(distance=ends, method="nearest")
    slope = samples.diff("end").isel(end=0, drop=True) / data.bracket.diff("end").isel(end=0, drop=True)
    label = {"units": "m", "long_name": "numerical error of the critical distance"}
    return data.assign(margin=(data.ratio_error / abs(slope)).drop_vars("distance").assign_attrs(label))


def ratio_error(diameter: float, thickness: float, distance: float) -> float:
    """Return how far AR at a distance is from that of the exact half-plane."""
    until = record(diameter)
    exact = hl.half_plane(thickness, ALUMINIUM, "clamped", distance, until)
    with collected():
        runs = [build(thickness, distance, diameter), hl.CoSimulation(shared.plate_chain(diameter), exact)]
        ours, true = (float(hl.amplitude_ratio(one.run(until), SENSOR)) for one in runs)
    return abs(ours - true)


def theirs(diameter: float) -> hl.Sphere:
    """Return the bead with the data of section 6.2.1: 8000 kg/m³, and 19.1 mm for the 19.05 mm of 6.2.2."""
    return hl.Sphere({19.05e-3: 19.1e-3}.get(round(float(diameter), 5), diameter) / 2.0, shared.THEIR_STEEL)


def numbers(data: xr.Dataset) -> Iterator[Number]:
    for diameter in DIAMETERS:
        printed = shared.contact_time(theirs(diameter), ALUMINIUM, shared.THEIR_STRIKER_SPEED)
        cases = {
            "7800 kg/m³ of Table 2.1": 1e6 * contact_time(diameter),
            "8000 kg/m³ and 19.1 mm, as section 6.2.1 takes": 1e6 * printed,
        }
        yield Number(f"contact time, half-space, D {1e3 * diameter:.2f}", cases)

    for diameter, thickness in product(DIAMETERS, THICKNESSES):
        case = data.sel(diameter=diameter, thickness=thickness)
        (low, high), at = case.bound.values * 1e3, case.sel(within=TOLERANCE)
        others = "; ".join(f"± {t:g}: {between(case.sel(within=t))}" for t in TOLERANCES if t != TOLERANCE)
        said = f"AR within ± {TOLERANCE:g} of its far value ({others}); the thesis's lines: {low:.1f} to {high:.1f}"
        label = f"critical distance, D {1e3 * diameter:.2f}, t {1e3 * thickness:.2f}"
        yield Number(label, between(at), said, "mm")

    # The factors of equations 6.39 and 6.42: a sphere on a half-space with unit quantities, whose compliances are one.
    with collected():
        material = hl.Material(1.0, 0.0, 1.0)
        striker = shared.contact_time(hl.Sphere(0.5, material), material, 1.0) / 2.0**0.4
    wave, collision = striker * PARTICLE_TO_STRIKER_SPEED**-0.2, float(hl.theory.hertz_contact_time(1.0, 1.0, 1.0))
    for name, by in (
        ("factor of τ_c, equation 6.39", collision), ("factor of the critical distance, equation 6.42", 2.0),
    ):  # fmt: skip
        yield Number(name, wave / by, f"the bead's speed in the wave; {striker / by:.4g} with the striker's")
    centre = data.amplitude_ratio.sel(diameter=DIAMETERS[-1], thickness=THICKNESSES[0]).fillna(0.0).isel(distance=-1)
    yield Number("AR at the centre, D 19.05, t 2.29", float(centre))

    # Waves in the plate: k, speed, and the way from the centre to an edge and back.
    bar, rayleigh, there = ALUMINIUM.bar_speed, rayleigh_speed(), 1e6 * shared.SIDE
    yield Number("k of the Rayleigh wave", rayleigh / bar)
    yield Number("speed of the Rayleigh wave", rayleigh)
    yield Number("Rayleigh wave, centre to edge and back", there / rayleigh)
    # At the frequency of an impact: one half-period in the contact of the bead with a half-space.
    speeds = np.array([[group_speed(t, 0.5 / contact_time(d)) for t in THICKNESSES] for d in DIAMETERS])
    slow, fast = float(speeds.min()), float(speeds.max())
    rows = zip(DIAMETERS, speeds / bar, strict=True)
    factors = "; ".join(f"{', '.join(f'{k:.2f}' for k in row)} for D = {1e3 * d:.2f} mm" for d, row in rows)
    yield Number("k of the A0 Lamb wave", (slow / bar, fast / bar), factors)
    yield Number("speed of the A0 Lamb wave", (slow, fast))
    yield Number("A0 Lamb wave, centre to edge and back", (there / fast, there / slow))


def between(at: xr.Dataset) -> str:
    """Return between which distances, mm, the critical one lies, numerical errors included."""
    low, high = at.bracket.values * 1e3
    if at.lower_bound:
        return f"> {low:.0f}"
    margin = 1e3 * float(at.margin.fillna(0.0)) if "margin" in at else 0.0
    return "no wave" if np.isnan(at.critical_distance) else bracketed(max(low - margin, 0.0), high + margin)


def group_speed(thickness: float, frequency: float) -> float:
    """Return the group speed of A0, m/s, at a frequency, Hz, by Mindlin's dispersion relation.

    It is within 0.5 % of Lamb's equation where a wave is longer than eight thicknesses.
    """
    wall = homogeneous_section(thickness, ALUMINIUM)
    inertia, shear = wall.rotary_inertia, float(wall.shear[0, 0])
    frequencies = frequency * np.array([1.0 - 1e-4, 1.0 + 1e-4])
    waves = [1.0 / flexural_wavelength(wall.mass, wall.bending[0, 0], one, inertia, shear) for one in frequencies]
    return float(np.diff(frequencies)[0] / np.diff(waves)[0])


def rayleigh_speed() -> float:
    """Return the speed of waves along a half-space, m/s: ξ³ − 8ξ² + (24 − 16η)ξ − 16(1 − η) = 0 with ξ = (c/c_s)² and
    η = (c_s/c_p)² (Achenbach, Wave Propagation in Elastic Solids, chapter 5)."""
    shear, eta = shear_speed(ALUMINIUM), (shear_speed(ALUMINIUM) / pressure_speed(ALUMINIUM)) ** 2
    roots = np.roots([1.0, -8.0, 24.0 - 16.0 * eta, -16.0 * (1.0 - eta)])
    between = [root.real for root in roots if abs(root.imag) < 1e-9 and 0.0 < root.real < 1.0]
    return float(shear * between[0] ** 0.5)


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR over the distance from the edge, and the critical distances over the bead diameter."""
    # A curve for each plate; bands and triangles are critical distances and lower bounds.
    over_distance, panels = draw.each(
        data.sel(within=TOLERANCE), "diameter", lambda d: f"D = {d * 1e3:.2f} mm", sharey=False, width=3.4, height=3.2,
        xlabel="distance from the clamped edge (mm)", ylabels=["amplitude ratio AR"], ylim=(0.0, 1.0),
    )  # fmt: skip
    for axis, bead in panels:
        draw.logarithmic(axis, "x")
        for colour, thickness in zip(draw.COLOURS, THICKNESSES, strict=False):
            case = bead.sel(thickness=thickness)
            curve, (low, high) = case.amplitude_ratio.isel(distance=case.sampled.values), case.bracket.values * 1e3
            axis.plot(curve.distance * 1e3, curve, markersize=2.5, label=f"t = {1e3 * thickness:.2f} mm")
            if case.lower_bound:
                floor = axis.get_xaxis_transform()
                axis.plot(low, 0.03, ">", transform=floor, color=colour, mfc="white", ms=6.0, clip_on=False, zorder=3.0)
            elif case.critical_distance.notnull():
                axis.axvspan(low, high, color=colour, alpha=0.35, linewidth=0.0)
    first = panels[0][0]
    first.fill_between([], [], color="grey", alpha=0.35, linewidth=0.0, label="critical distance")
    first.plot([], [], ">", color="grey", markersize=5.0, markerfacecolor="white", label="its lower bound")
    draw.legend_above(over_distance, first, 5)

    # Brackets, with the A0 and the Rayleigh line.
    over_diameter, (axis,) = draw.panels(height=4.6, ylabel=f"critical distance (mm), AR ± {TOLERANCE:g}")
    for line, style, speed in zip(LINES, ("--", "-"), ("0.2", "0.57"), strict=True):
        words = f"path of the {line} wave during a contact, c = {speed} √(E/ρ)"
        draw.theory_line(axis, 1e3 * data.diameter, 1e3 * data.bound.sel(line=line), words, style)
    for i, thickness in enumerate(THICKNESSES):
        at = data.sel(thickness=thickness, within=TOLERANCE)
        x, (low, high) = 1e3 * data.diameter.values + 0.25 * (i - 1), 1e3 * at.bracket.transpose("end", ...).values
        bound, middle = at.lower_bound.values, np.where(at.lower_bound, np.nan, 0.5 * (low + high))
        half = np.where(bound, 0.0, high - middle)
        look: dict[str, Any] = {"fmt": draw.MARKERS[i], "color": draw.COLOURS[i], "linewidth": 0.8}
        axis.errorbar(x, middle, half, capsize=5.0, label=f"t = {1e3 * thickness:.2f} mm", **look)
        axis.errorbar(x[bound], low[bound], 8.0, lolims=True, markerfacecolor="white", capsize=2.5, **look)
    axis.errorbar([], [], [], lolims=True, fmt="o", color="grey", markerfacecolor="white", label="lower bound")
    axis.set_xlabel("bead diameter D (mm), markers set apart")
    axis.set_ylim(bottom=0.0)
    draw.legend_above(over_diameter, axis, 1)
    return {"amplitude_ratio": over_distance, "critical_distance": over_diameter}
