"""Thesis section 6.2.2: the reflected wave against the distance from a clamped edge, and the critical distance."""

from dataclasses import dataclass
from functools import lru_cache, partial
from typing import Any, ClassVar

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, plate_edges
from hertzlink.studies.on_plates import BEADS, DIAMETERS, SENSOR, SIDE, THICKNESSES, UNTIL, OnPlate, theirs
from hertzlink.studies.results import each, scalars, with_units
from hertzlink.studies.table import WORDS, Named, Row, Rows, bracketed
from hertzlink.studies.waves import contact_time
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from plates.elements.theory import thick_wavelength
from plates.reduced import Range, covers
from plates.section import point_rigidity
from plates.theory.impact import THESIS_IMPACT
from structures.bodies.elasticity import pressure_speed, shear_speed
from structures.bodies.layers import HERTZ_COLLISION
from structures.caution import collected

row, row_of_waves = Rows("plate_boundary"), Rows("plate_waves")
# m, the first scan. Beyond the last crossing AR oscillates by 0.007 at most, as scans with steps of 1 or 2 mm show. So
# no crossing is missed for tolerances of 0.01 and more.
DISTANCES = tuple(round(mm * 1e-3, 3) for mm in (*range(10, 201, 10), *range(240, 441, 40), 457))
QUICK_DISTANCES = (0.01, 0.02, 0.03, 0.04, 0.06, 0.1, 0.15, 0.457)
BRACKET, QUICK_BRACKET = 0.2e-3, 5.0e-3
# Tolerance of the reduction. Up to 0.2 AR keeps its first five digits, but spurious waves appear late in the record.
REDUCTION = 0.05
# m: up to this distance one basis serves all samples; and its tolerance. All but two critical distances are less.
NEAR, NEAR_REDUCTION = 0.045, 0.1
TOLERANCE = 0.02
# Allowed differences of AR from its far value beyond the critical distance; the dimension "within" of the results.
TOLERANCES = (0.01, TOLERANCE, 0.05)
RELATIVE_TOLERANCE = 0.05  # The tolerance in units of the far value, for comparison.
# t a/d² at which a clamped edge has cancelled half of the displacement after an impulse, g = −1/2 (docs/plate_edge.md;
# Fourier transform along the edge, Laplace transform in time).
HALF_ECHO = 0.4613
# Thicknesses up to this ratio share a basis. For 1 and 4 mm it takes half as long as one for each, for 1 and 10 mm
# twice as long.
SIMILAR = 4.0
# NEAR, in units of the greatest ℓ, and brackets, in units of the least one, for plates of a user's own.
OWN_NEAR, OWN_BRACKET, OWN_QUICK_BRACKET = 2.5, 0.02, 0.4


@dataclass(frozen=True)
class Conditions(OnPlate):
    """Parameters that can be changed."""

    shortest_side: ClassVar[float] = 8.0

    def distances(self, quick: bool) -> tuple[float, ...]:
        """Return the first scan, m."""
        if self.own:
            return tuple(self.scan(quick))
        return QUICK_DISTANCES if quick else DISTANCES

    def bracket(self, quick: bool) -> float:
        """Return the greatest length of a bracket, m."""
        if self.own:
            return float(self.lengths().min()) * (OWN_QUICK_BRACKET if quick else OWN_BRACKET)
        return QUICK_BRACKET if quick else BRACKET

    def bases(self, quick: bool) -> list[tuple[Range, Range]]:
        """Return the distances and thicknesses, m, that share a basis.

        All short distances do, and each farther one of the first scan has its own; so do similar thicknesses.
        """
        near = min(OWN_NEAR * float(self.lengths().max()), self.side / 2.0) if self.own else NEAR
        scan, walls = self.distances(quick), list[list[float]]()
        for thickness in sorted(self.thickness):
            if not walls or thickness > SIMILAR * walls[-1][0]:
                walls.append([])
            walls[-1].append(thickness)
        places: list[Range] = [(scan[0], near), *(distance for distance in scan if distance > near)]
        return [(place, (wall[0], wall[-1])) for place in places for wall in walls]


THESIS = Conditions()


def run(quick: bool = False, jobs: int | None = None, **parameters: Any) -> xr.Dataset:
    """Return AR and TOF of every plate, bead and distance (m), and the critical distances with their brackets.

    Also AR and the contact time on the infinite plate, AR at other kinds of edges, and in Mindlin's theory. quick:
    eight of the 27 distances of the first scan, and brackets of 5 mm, beside which numerical errors do not count.
    """
    of = Conditions.of(parameters)
    plates = tuple(
        each(reduced, [{"place": place, "walls": walls, "of": of} for place, walls in of.bases(quick)], jobs)
    )

    def build(thickness: float, distance: float, diameter: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(diameter), struck(plates, thickness, distance, of))

    find = partial(
        hl.critical_distance_search, build, of.until, of.sensor, of.distances(quick),
        bracket=of.bracket(quick), jobs=jobs, thickness=of.thickness, diameter=of.bead,
    )  # fmt: skip
    first = find(tolerance=TOLERANCES)
    relative = find(tolerance=RELATIVE_TOLERANCE, relative=True, known=first)
    # The samples of both tolerances, and the crossings of each.
    variables = ("critical_distance", "bracket", "lower_bound")
    data = relative.drop_vars([*variables, "within"]).merge(first[[*variables]])
    data = data.assign({f"relative_{name}": relative[name].drop_vars("within") for name in variables})
    wall = of.plate(of.thickness[0])
    bounds = [hl.critical_distance_bounds(of.sphere(d), wall, of.impact_speed) for d in of.bead]
    label = {"units": "m", "long_name": "critical distance, equation 6.42"}
    data = data.assign_coords(line=["A0 Lamb", "Rayleigh"]).assign(bound=(("diameter", "line"), bounds, label))
    data = with_units(data, thickness="m", diameter="m").merge(without_edges(of))
    if not quick:
        data = with_margins(data, of, jobs)
    return of.marked(data) if of.own else data.merge(plate_edges.run(data.amplitude_ratio, quick, jobs))


def without_edges(of: Conditions) -> xr.Dataset:
    """Return AR and contact time on the infinite plate, and the distance of an edge whose half echo is back by then."""

    def build(thickness: float, diameter: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(diameter), hl.infinite_plate(thickness, of.material))

    def measure(run: xr.Dataset) -> xr.Dataset:
        contact = scalars(contact_time=(hl.contact_time(run), "s", "contact with the infinite plate"))
        return contact.assign(infinite_amplitude_ratio=hl.amplitude_ratio(run, of.sensor))

    runs = hl.sweep(build, of.until, 1, measure, thickness=of.thickness, diameter=of.bead)
    speed = [(point_rigidity(p.section) / p.mass_per_area) ** 0.5 for p in map(of.plate, of.thickness)]
    diffusion = xr.DataArray(speed, coords={"thickness": list(of.thickness)}, dims="thickness")
    runs["half_echo_distance"] = ((runs.contact_time * diffusion / HALF_ECHO) ** 0.5).assign_attrs(
        units="m", long_name="distance whose half echo is back as the contact with the infinite plate ends"
    )
    return runs.drop_attrs(deep=False)


def with_margins(data: xr.Dataset, of: Conditions, jobs: int | None) -> xr.Dataset:
    """Return critical distances with the numerical errors of AR there, and with the errors of distance that follow, m.

    The far value is as wrong as it differs from AR on the infinite plate, which has neither mesh nor reduction.
    """
    pairs = data.critical_distance.sel(within=TOLERANCE).stack(pair=["diameter", "thickness"]).dropna("pair")
    cases = [
        {"diameter": diameter, "thickness": thickness, "distance": float(pair), "of": of}
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


def ratio_error(diameter: float, thickness: float, distance: float, of: Conditions = THESIS) -> float:
    """Return how wrong AR is at a distance because of windows, mesh and reduction."""

    def build() -> hl.CoSimulation:
        plate = of.plate(thickness).at(distance, of.side / 2.0)
        return hl.CoSimulation(of.chain(diameter), hl.reduce(plate, of.until, NEAR_REDUCTION, pulse=of.pulse))

    with collected():
        return hl.numerical_error(build, of.until, of.sensor).margins["amplitude_ratio"]


def reduced(place: Range, walls: Range, of: Conditions = THESIS) -> hl.ReducedPlate:
    """Return the plates of some thicknesses for some distances on their centre line."""
    tolerance = NEAR_REDUCTION if isinstance(place, tuple) else REDUCTION
    plate = of.plate(min(of.thickness))
    return hl.ReducedPlate(plate, of.until, place, of.side / 2.0, tolerance, of.pulse, thickness=walls)


@lru_cache(maxsize=1)  # for the next bead diameter
def struck(plates: tuple[hl.ReducedPlate, ...], thickness: float, distance: float, of: Conditions) -> hl.Structure:
    """Return the reduced plate, struck on its centre line."""
    for plate in plates:
        if covers(plate.x, distance) and covers(plate.thickness, thickness):
            return plate.at(distance, of.side / 2.0, thickness=thickness)
    # Few samples of the refinement lie so far away.
    return hl.reduce(of.plate(thickness).at(distance, of.side / 2.0), of.until, REDUCTION, pulse=of.pulse)


def table(data: xr.Dataset) -> list[Row]:
    """Return the critical distances compared with the thesis's lines and statements; of other plates, with the law."""
    of = Conditions.read(data)
    pairs = [data.sel(diameter=d, thickness=t) for d in data.diameter for t in data.thickness]
    if of.own:
        return [row for case in pairs for row in (_critical(case, of), *_echo(case, of), _far(case, of))]
    centre = float(data.amplitude_ratio.sel(diameter=19.05e-3, thickness=2.29e-3).fillna(0.0).isel(distance=-1))
    return [
        *(_contact(diameter) for diameter in of.bead), *(_critical(case, of) for case in pairs),
        *(row for case in pairs for row in (_relative(case), *_echo(case, of))), *_coefficients(),
        row("AR at the centre, D 19.05, t 2.29", centre, holds=centre < WORDS["about 0"]), *of_waves(),
        *plate_edges.table(data),
    ]  # fmt: skip


def _contact(diameter: float) -> Row:
    """Return T_c on a half-space, µs, and with the data of section 6.2.1."""
    printed = contact_time(theirs(diameter), hl.ALUMINIUM_6061, THESIS_IMPACT.striker_speed) * 1e6
    otherwise = {"8000 kg/m³ and 19.1 mm, as section 6.2.1 takes": printed}
    ours = THESIS.contact_time(diameter) * 1e6
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
    return 0.5 / OnPlate().contact_time(diameter)


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


def _critical(case: xr.Dataset, of: Conditions) -> Row:
    """Return the critical distance, compared with the thesis's two lines; of a user's own plate, with the law."""
    (low, high), at = case.bound.values * 1e3, case.sel(within=TOLERANCE)
    others = (f"± {other:g}: {_between(case.sel(within=other))}" for other in (TOLERANCES[0], TOLERANCES[-1]))
    said = TOLERANCE, *others
    if not of.own:
        lines, verdict = f"{low:.1f} to {high:.1f}", _verdict(at, low, high)
        return row("critical distance", _between(at), *said, verdict, theory=lines, **_named(case))
    value, law = _law(case, of)
    if at.lower_bound:
        law += f"a lower bound: from farther away no wave is back within {of.until * 1e3:.3g} ms; "
    return row("critical distance by law", _between(at), law, *said, low, high, theory=value, **_named(case))


def _law(case: xr.Dataset, of: Conditions) -> tuple[float | str, str]:
    """Return the critical distance, mm, by the law, which is for 13 beads between sensor and plate, and its bounds."""
    if of.beads - of.sensor != BEADS - SENSOR:
        return "", f"the law of the study critical-distance is for {BEADS - SENSOR} beads behind the sensor; "
    bead, plate = of.sphere(float(case.diameter)), of.plate(float(case.thickness))
    try:
        law = hl.critical_distance_law(bead, plate, of.impact_speed, of.support, TOLERANCE)
    except ValueError:
        parameter = hl.theory.PlateImpact(bead, plate, of.impact_speed).inelasticity
        return "", f"outside the law of the study critical-distance (λ = {parameter:.3g}); "
    value, low, high = (1e3 * part for part in law)
    return value, f"theory: the law of the study critical-distance, {low:.1f} to {high:.1f}; "


def _echo(case: xr.Dataset, of: Conditions) -> list[Row]:
    """Return the criterion without a tolerance, which is for clamped edges."""
    if of.support != "clamped":
        return []
    half, contact = float(case.half_echo_distance) * 1e3, float(case.contact_time) * 1e6
    return [row("echo", _between(case.sel(within=TOLERANCE)), TOLERANCE, contact, theory=half, **_named(case))]


def _far(case: xr.Dataset, of: Conditions) -> Row:
    bead, plate = of.sphere(float(case.diameter)), of.plate(float(case.thickness))
    impact = hl.theory.PlateImpact(bead, plate, of.impact_speed)
    parameter = float(impact.inelasticity)
    far, inside = float(case.far_value.fillna(0.0)), float(case.infinite_amplitude_ratio.fillna(0.0))
    said = parameter, inside, of.contact_time(float(case.diameter)) * 1e6
    expected = impact.amplitude_ratio
    return row("centre", far if far > 0.0 else "no wave", *said, theory=expected, **_named(case))


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return AR and TOF over the distance, the critical distances with two theory lines, and their refinement."""
    of = Conditions.read(data)
    ratio, flight = "amplitude ratio AR", "time of flight (µs)"
    return {
        "amplitude_ratio": draw.against_distance(data, "amplitude_ratio", ratio, TOLERANCE, edge=of.support),
        "time_of_flight": draw.against_distance(data, "time_of_flight", flight, TOLERANCE, 1e6, edge=of.support),
        "critical_distance": draw.critical_distances(data, TOLERANCE),
        "refinement": draw.refinement(data, TOLERANCE, edge=of.support),
        **({} if of.own else {"edges": plate_edges.figure(data)}),
    }
