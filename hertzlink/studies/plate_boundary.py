"""Thesis section 6.2.2: the reflected wave against the distance from a clamped edge, and the critical distance."""

from functools import lru_cache, partial

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, on_plates, plate_edges
from hertzlink.studies.on_plates import (
    DIAMETERS,
    IMPACT_SPEED,
    MATERIAL,
    SENSOR,
    SIDE,
    THICKNESSES,
    UNTIL,
    chain,
    plate,
    sphere,
    theirs,
)  # fmt: skip
from hertzlink.studies.results import each, scalars, with_units
from hertzlink.studies.table import WORDS, Named, Row, Rows, bracketed
from hertzlink.studies.waves import contact_time
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from plates.impact import THESIS_IMPACT
from plates.section import point_rigidity, thick_wavelength
from structures.bodies.elasticity import pressure_speed, shear_speed
from structures.bodies.layers import HERTZ_COLLISION
from structures.caution import collected

row, row_of_waves = Rows("plate_boundary"), Rows("plate_waves")
# m, the first scan. Beyond the last crossing AR oscillates by 0.007 at most, as scans with steps of 1 or 2 mm show. So
# no crossing is missed for tolerances of 0.01 and more.
DISTANCES = tuple(round(mm * 1e-3, 3) for mm in (*range(10, 201, 10), *range(240, 441, 40), 457))
QUICK_DISTANCES = (0.01, 0.02, 0.03, 0.04, 0.06, 0.1, 0.15, 0.457)
BRACKET, QUICK_BRACKET = 0.2e-3, 5.0e-3
TOLERANCE = 0.02
# Allowed differences of AR from its far value beyond the critical distance; the dimension "within" of the results.
TOLERANCES = (0.01, TOLERANCE, 0.05)
RELATIVE_TOLERANCE = 0.05  # The tolerance in units of the far value, for comparison.
# t a/d² at which a clamped edge has cancelled half of the displacement after an impulse, g = −1/2 (docs/plate_edge.md;
# Fourier transform along the edge, Laplace transform in time).
HALF_ECHO = 0.4613


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF of every plate, bead and distance (m), and the critical distances with their brackets.

    Also AR and the contact time on the infinite plate, AR at other kinds of edges, and in Mindlin's theory. quick:
    eight of the 27 distances of the first scan, and brackets of 5 mm, beside which numerical errors do not count.
    """

    def build(thickness: float, distance: float, diameter: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain(diameter), struck(thickness, distance))

    scan, bracket = (QUICK_DISTANCES, QUICK_BRACKET) if quick else (DISTANCES, BRACKET)
    find = partial(
        hl.critical_distance_search, build, UNTIL, SENSOR, scan,
        bracket=bracket, jobs=jobs, thickness=THICKNESSES, diameter=DIAMETERS,
    )  # fmt: skip
    first = find(tolerance=TOLERANCES)
    relative = find(tolerance=RELATIVE_TOLERANCE, relative=True, known=first)
    # The samples of both tolerances, and the crossings of each.
    variables = ("critical_distance", "bracket", "lower_bound")
    data = relative.drop_vars([*variables, "within"]).merge(first[[*variables]])
    data = data.assign({f"relative_{name}": relative[name].drop_vars("within") for name in variables})
    wall = plate(THICKNESSES[0])
    bounds = [hl.critical_distance_bounds(sphere(d), wall, IMPACT_SPEED) for d in DIAMETERS]
    label = {"units": "m", "long_name": "critical distance, equation 6.42"}
    data = data.assign_coords(line=["A0 Lamb", "Rayleigh"]).assign(bound=(("diameter", "line"), bounds, label))
    data = with_units(data, thickness="m", diameter="m").merge(without_edges())
    if not quick:
        data = with_margins(data, jobs)
    return data.merge(plate_edges.run(data.amplitude_ratio, quick, jobs))


@lru_cache(maxsize=1)
def modes() -> hl.ModalPlate:
    """Return the modes of the plates of all thicknesses."""
    return hl.ModalPlate(plate(THICKNESSES[0]), UNTIL)


@lru_cache(maxsize=1)  # for the next bead diameter
def struck(thickness: float, distance: float) -> hl.Structure:
    """Return the plate, struck on its centre line."""
    return modes().at(distance, SIDE / 2.0, thickness)


def without_edges() -> xr.Dataset:
    """Return AR and contact time on the infinite plate, and the distance of an edge whose half echo is back by then."""

    def build(thickness: float, diameter: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain(diameter), hl.infinite_plate(thickness, MATERIAL))

    def measure(run: xr.Dataset) -> xr.Dataset:
        contact = scalars(contact_time=(hl.contact_time(run), "s", "contact with the infinite plate"))
        return contact.assign(infinite_amplitude_ratio=hl.amplitude_ratio(run, SENSOR))

    runs = hl.sweep(build, UNTIL, 1, measure, thickness=THICKNESSES, diameter=DIAMETERS)
    speed = [(point_rigidity(p.section) / p.mass_per_area) ** 0.5 for p in map(plate, THICKNESSES)]
    diffusion = xr.DataArray(speed, coords={"thickness": list(THICKNESSES)}, dims="thickness")
    runs["half_echo_distance"] = ((runs.contact_time * diffusion / HALF_ECHO) ** 0.5).assign_attrs(
        units="m", long_name="distance whose half echo is back as the contact with the infinite plate ends"
    )
    return runs.drop_attrs(deep=False)


def with_margins(data: xr.Dataset, jobs: int | None) -> xr.Dataset:
    """Return critical distances with the numerical errors of AR there, and with the errors of distance that follow, m.

    The far value is as wrong as it differs from AR on the infinite plate, which has neither mesh nor reduction.
    """
    pairs = data.critical_distance.sel(within=TOLERANCE).stack(pair=["diameter", "thickness"]).dropna("pair")
    cases = [
        {"diameter": diameter, "thickness": thickness, "distance": float(pair)}
        for pair in pairs for diameter, thickness in [pair.pair.item()]
    ]  # fmt: skip
    here = xr.DataArray(each(ratio_error, cases, jobs), coords=pairs.coords, dims="pair").unstack("pair")
    far = data.far_value.fillna(0.0) - data.infinite_amplitude_ratio.fillna(0.0)
    data["ratio_error"] = (here**2 + far**2) ** 0.5
    for name in ("", "relative_"):
        ends = data[f"{name}bracket"]
        sampled = ends.where(np.isfinite(ends), ends.sel(end="low"))
        samples = data.amplitude_ratio.sel(distance=sampled, method="nearest")
        slope = samples.diff("end").isel(end=0, drop=True) / ends.diff("end").isel(end=0, drop=True)
        label = {"units": "m", "long_name": "numerical error of the critical distance"}
        data[f"{name}margin"] = (data.ratio_error / abs(slope)).drop_vars("distance").assign_attrs(label)
    return data


def ratio_error(diameter: float, thickness: float, distance: float) -> float:
    """Return how wrong AR is at a distance because of windows, mesh and reduction."""

    def build() -> hl.CoSimulation:
        return hl.CoSimulation(chain(diameter), modes().at(distance, SIDE / 2.0, thickness))

    with collected():
        return hl.numerical_error(build, UNTIL, SENSOR).margins["amplitude_ratio"]


def table(data: xr.Dataset) -> list[Row]:
    """Return the critical distances compared with the thesis's lines and statements."""
    pairs = [data.sel(diameter=d, thickness=t) for d in data.diameter for t in data.thickness]
    centre = float(data.amplitude_ratio.sel(diameter=19.05e-3, thickness=2.29e-3).fillna(0.0).isel(distance=-1))
    return [
        *map(_contact, DIAMETERS), *map(_critical, pairs),
        *(row for case in pairs for row in (_relative(case), _echo(case))), *_coefficients(),
        row("AR at the centre, D 19.05, t 2.29", centre, holds=centre < WORDS["about 0"]), *of_waves(),
        *plate_edges.table(data),
    ]  # fmt: skip


def _contact(diameter: float) -> Row:
    """Return T_c on a half-space, µs, and with the data of section 6.2.1."""
    printed = contact_time(theirs(diameter), hl.ALUMINIUM_6061, THESIS_IMPACT.striker_speed) * 1e6
    otherwise = {"8000 kg/m³ and 19.1 mm, as section 6.2.1 takes": printed}
    ours = on_plates.contact_time(diameter) * 1e6
    return row(f"contact time, half-space, D {diameter * 1e3:.2f}", ours, otherwise=otherwise)


def _coefficients() -> list[Row]:
    """Return the printed factors of equations 6.39 and 6.42, by a sphere on a half-space with unit quantities."""
    with collected():
        material = hl.Material(1.0, 0.0, 1.0)
        # Both bodies have equal compliances of one, so their sum is two.
        striker = contact_time(hl.Sphere(0.5, material), material, 1.0) / 2.0**0.4
    wave = striker * PARTICLE_TO_STRIKER_SPEED**-0.2
    names = {"factor of τ_c, equation 6.39": HERTZ_COLLISION, "factor of the critical distance, equation 6.42": 2.0}
    said = "speed of the bead in the wave, 0.682 of the striker's"
    return [row(name, wave / by, striker / by, otherwise={said: wave / by}) for name, by in names.items()]


def impact_frequency(diameter: float) -> float:
    """Return the frequency, Hz, of a bead's impact: one half-period in its contact with a half-space, 1/(2T_c)."""
    return 0.5 / on_plates.contact_time(diameter)


def group_speed(material: hl.Material, thickness: float, frequency: float) -> float:
    """Return the group speed of A0, m/s, at a frequency, Hz, by Mindlin's dispersion relation.

    It is within 0.5 % of Lamb's equation where a wave is longer than eight thicknesses.
    """
    wall = hl.homogeneous_section(thickness, material)
    inertia, shear = wall.rotary_inertia, float(wall.shear[0, 0])
    frequencies = frequency * np.array([1.0 - 1e-4, 1.0 + 1e-4])
    waves = [1.0 / thick_wavelength(wall.mass, wall.bending[0, 0], one, inertia, shear) for one in frequencies]
    return float(np.diff(frequencies)[0] / np.diff(waves)[0])


def rayleigh_speed(material: hl.Material) -> float:
    """Return the speed of waves along a half-space, m/s: ξ³ − 8ξ² + (24 − 16η)ξ − 16(1 − η) = 0 with ξ = (c/c_s)² and
    η = (c_s/c_p)² (Achenbach, Wave Propagation in Elastic Solids, chapter 5).
    """
    eta = (shear_speed(material) / pressure_speed(material)) ** 2
    roots = np.roots([1.0, -8.0, 24.0 - 16.0 * eta, -16.0 * (1.0 - eta)])
    between = [root.real for root in roots if abs(root.imag) < 1e-9 and 0.0 < root.real < 1.0]
    return float(shear_speed(material) * between[0] ** 0.5)


def group_speeds() -> dict[float, list[float]]:
    """Return group speeds of A0, m/s, at the frequency of the impact: by diameter, m, one for each of THICKNESSES."""
    return {
        diameter: [group_speed(hl.ALUMINIUM_6061, thickness, impact_frequency(diameter)) for thickness in THICKNESSES]
        for diameter in DIAMETERS
    }


def of_waves() -> list[Row]:
    """Return k, c and round trip that section 6.2.2 prints for both waves, compared with the exact equations."""
    bar, rayleigh = hl.ALUMINIUM_6061.bar_speed, rayleigh_speed(hl.ALUMINIUM_6061)
    by_bead = group_speeds()
    factors = "; ".join(
        f"{', '.join(f'{speed / bar:.2f}' for speed in speeds)} for D = {1e3 * diameter:.2f} mm"
        for diameter, speeds in by_bead.items()
    )
    slow, fast = (find(speed for speeds in by_bead.values() for speed in speeds) for find in (min, max))
    there = 1e6 * SIDE
    return [
        row_of_waves("k of the Rayleigh wave", rayleigh / bar),
        row_of_waves("speed of the Rayleigh wave", rayleigh),
        row_of_waves("Rayleigh wave, centre to edge and back", there / rayleigh),
        row_of_waves("k of the A0 Lamb wave", f"{slow / bar:.2f} to {fast / bar:.2f}", factors),
        row_of_waves("speed of the A0 Lamb wave", f"{slow:.0f} to {fast:.0f}"),
        row_of_waves("A0 Lamb wave, centre to edge and back", f"{there / fast:.0f} to {there / slow:.0f}"),
    ]


def _relative(case: xr.Dataset) -> Row:
    """Return the critical distance relative to the far value."""
    names = {f"relative_{name}": name for name in ("critical_distance", "bracket", "lower_bound", "margin")}
    names = {name: short for name, short in names.items() if name in case}
    relative = _between(case[list(names)].rename(names))
    far, inside = float(case.far_value.fillna(0.0)), float(case.infinite_amplitude_ratio.fillna(0.0))
    if far > 0.0:
        return row("relative", relative, far, inside, **_named(case))
    return row("relative, no wave", relative, **_named(case))


def _verdict(at: xr.Dataset, low: float, high: float) -> str:
    """Return the critical distance at one tolerance in relation to the two lines, mm."""
    value, record = float(at.critical_distance) * 1e3, f"{UNTIL * 1e3:.1f} ms"
    if at.lower_bound:
        return f"a lower bound: from farther away no wave is back within {record}, and longer records do not settle it"
    if np.isnan(value):
        return "no wave at all within the record"
    if low <= value <= high:
        return "between the lines"
    if value < low:
        return f"{low - value:.1f} mm below the A0 line: the contact is over before a slower echo returns"
    return (
        f"{value - high:.1f} mm above the Rayleigh line: on this plate the contact lasts much longer than on the "
        "half-space that the lines assume, so later echoes still count"
    )


def _between(at: xr.Dataset) -> str:
    """Return between which distances, mm, the critical one lies, numerical errors included."""
    low, high = at.bracket.values * 1e3
    if at.lower_bound:
        return f"> {low:.0f}"
    margin = 1e3 * float(at.margin.fillna(0.0)) if "margin" in at else 0.0
    return "no wave" if np.isnan(at.critical_distance) else bracketed(max(low - margin, 0.0), high + margin)


def _named(case: xr.Dataset) -> Named:
    """Return the bead and the plate, for the name of a row, mm."""
    return {name: 1e3 * float(case[name]) for name in ("diameter", "thickness")}


def _critical(case: xr.Dataset) -> Row:
    """Return the critical distance, compared with the thesis's two lines."""
    (low, high), at = case.bound.values * 1e3, case.sel(within=TOLERANCE)
    others = (f"± {other:g}: {_between(case.sel(within=other))}" for other in (TOLERANCES[0], TOLERANCES[-1]))
    said = TOLERANCE, *others
    lines, verdict = f"{low:.1f} to {high:.1f}", _verdict(at, low, high)
    return row("critical distance", _between(at), *said, verdict, theory=lines, **_named(case))


def _echo(case: xr.Dataset) -> Row:
    """Return the criterion without a tolerance."""
    half, contact = float(case.half_echo_distance) * 1e3, float(case.contact_time) * 1e6
    return row("echo", _between(case.sel(within=TOLERANCE)), TOLERANCE, contact, theory=half, **_named(case))


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR and TOF over the distance, the critical distances with two theory lines, and their refinement."""
    ratio, flight = "amplitude ratio AR", "time of flight (µs)"
    return {
        "amplitude_ratio": draw.against_distance(data, "amplitude_ratio", ratio, TOLERANCE),
        "time_of_flight": draw.against_distance(data, "time_of_flight", flight, TOLERANCE, 1e6),
        "critical_distance": draw.critical_distances(data, TOLERANCE),
        "refinement": draw.refinement(data, TOLERANCE),
        "edges": plate_edges.figure(data),
    }
