"""Thesis section 6.2.2: the reflected wave against the distance from a clamped edge, and the critical distance."""

from functools import lru_cache, partial
from typing import TYPE_CHECKING

import joblib
import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import amplitude_ratio
from coupling.results.measures import contact_time
from coupling.sweeps.critical_search import find_critical_distance
from coupling.sweeps.progress import watched
from coupling.sweeps.sweep import sweep
from hertzlink.studies import plate_edges, plate_waves
from hertzlink.studies.table import Row
from particles.bead import Sphere
from particles.chain import Chain
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from plates.builders import kirchhoff_plate
from plates.infinite import infinite_plate
from plates.plate import Plate
from plates.reduced import ReducedPlate
from plates.section import point_rigidity
from plates.support import Supports
from plates.theory.impact import critical_distance_bounds
from structures.checks import whole
from structures.layers import HERTZ_COLLISION
from structures.layers import contact_time as contact_time_half_space
from structures.material import ALUMINIUM_6061, STEEL_440C, Material
from structures.plausible import units_of_one
from structures.reduction import reduce
from structures.structure import Structure
from structures.surface import Surface, hertz_stiffness

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SIDE = 0.914
SUPPORTS = Supports(left="clamped", right="clamped", bottom="free", top="free")
THICKNESSES = (2.29e-3, 3.18e-3, 4.83e-3)
DIAMETERS = (4.76e-3, 9.53e-3, 19.05e-3)
DISTANCES = tuple(round(mm * 1e-3, 3) for mm in (*range(10, 201, 10), *range(240, 441, 40), 457))
"""m, the first scan. Beyond the last crossing AR oscillates by 0.007 at most, as scans with steps of 1 or 2 mm show. So
no crossing is missed for tolerances of 0.01 and more.
"""

QUICK_DISTANCES = (0.01, 0.02, 0.03, 0.04, 0.06, 0.1, 0.15, 0.457)
BRACKET, QUICK_BRACKET = 0.2e-3, 5.0e-3
IMPACT_SPEED = 0.31
BEADS, SENSOR = 20, 7

UNTIL = 3.5e-3
"""Length of the record, s. Chains of the largest beads on the two thinner plates send a wave back only when the echo of
the edge pushes them; the larger the distance of the edge, the later this is. Records of up to 15 ms do not settle these
cases (docs/numerics.md).
"""

REDUCTION = 0.05
"""Tolerance of the reduction. Up to 0.2 AR keeps its first five digits, but spurious waves appear late in
the record.
"""

NEAR, NEAR_REDUCTION = 0.045, 0.1
"""m: up to this distance one basis serves all samples of a plate; and its tolerance. All but two critical distances are
shorter.
"""

HIGHEST_FREQUENCY = 30.0e3
"""Hz, resolved by the mesh. Where AR above 0.03 was sampled, it is within 0.3 % of AR on a mesh for 100 kHz. The
default of 40 kHz is equally close and takes 50 % longer (benchmarks/plate_meshes.py).
"""

TOLERANCE = 0.02
TOLERANCES = (0.01, TOLERANCE, 0.05)
"""Allowed differences of AR from its far value beyond the critical distance; the dimension "within" of the results."""

RELATIVE_TOLERANCE = 0.05
"""The tolerance in units of the far value, for comparison."""

HALF_ECHO = 0.4613
"""t a/d² at which a clamped edge has cancelled half of the displacement after an impulse, g = −1/2 (docs/plate_edge.md;
Fourier transform along the edge, Laplace transform in time).
"""


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """AR and TOF of every plate, bead and distance (m), and the critical distances with their brackets.

    Also AR and the contact time on the infinite plate, AR at other kinds of edges, and in Mindlin's theory. quick:
    eight of the 27 distances of the first scan, and brackets of 5 mm.
    """

    count = joblib.cpu_count() if jobs is None else whole("jobs", jobs)
    parallel = joblib.Parallel(min(count, len(THICKNESSES)), return_as="generator")
    plates = watched(parallel(joblib.delayed(near_edge)(one) for one in THICKNESSES), len(THICKNESSES))
    reduced = dict(zip(THICKNESSES, plates, strict=True))

    def build(thickness: float, distance: float, diameter: float) -> CoSimulation:
        return CoSimulation(chain(diameter), struck(reduced[thickness], distance))

    find = partial(
        find_critical_distance, build, UNTIL, SENSOR, QUICK_DISTANCES if quick else DISTANCES,
        bracket=QUICK_BRACKET if quick else BRACKET, jobs=jobs, thickness=THICKNESSES, diameter=DIAMETERS,
    )  # fmt: skip
    first = find(tolerance=TOLERANCES)
    relative = find(tolerance=RELATIVE_TOLERANCE, relative=True, known=first)
    # The samples of both tolerances, and the crossings of each.
    own = ("critical_distance", "bracket", "lower_bound")
    data = relative.drop_vars([*own, "within"]).merge(first[[*own]])
    data = data.assign({f"relative_{name}": relative[name].drop_vars("within") for name in own})
    bounds = [critical_distance_bounds(bead(d), plate(THICKNESSES[0]), IMPACT_SPEED) for d in DIAMETERS]
    data = data.assign_coords(line=["A0 Lamb", "Rayleigh"])
    data["bound"] = (
        ("diameter", "line"), bounds, {"units": "m", "long_name": "critical distance, equation 6.42"}
    )  # fmt: skip
    for name in ("thickness", "diameter"):
        data[name].attrs["units"] = "m"
    return data.merge(without_edges()).merge(plate_edges.run(quick, jobs))


def without_edges() -> xr.Dataset:
    """AR and contact time on the infinite plate, and the distance from which half of the echo is back at the contact's
    end.
    """

    def build(thickness: float, diameter: float) -> CoSimulation:
        return CoSimulation(chain(diameter), infinite_plate(thickness, ALUMINIUM_6061))

    found = sweep(build, UNTIL, 1, of_infinite_plate, thickness=THICKNESSES, diameter=DIAMETERS)
    speed = [(point_rigidity(p.section) / p.mass_per_area) ** 0.5 for p in map(plate, THICKNESSES)]
    diffusion = xr.DataArray(speed, coords={"thickness": list(THICKNESSES)}, dims="thickness")
    found["half_echo_distance"] = ((found.contact_time * diffusion / HALF_ECHO) ** 0.5).assign_attrs(
        units="m", long_name="distance whose half echo is back as the contact with the infinite plate ends"
    )
    return found.drop_attrs(deep=False)


def of_infinite_plate(run: xr.Dataset) -> xr.Dataset:
    """The part of a run on the infinite plate that is kept."""
    return xr.Dataset(
        {
            "infinite_amplitude_ratio": amplitude_ratio(run, SENSOR).rename(None),
            "contact_time": ((), contact_time(run), {"units": "s", "long_name": "contact with the infinite plate"}),
        }
    )


def bead(diameter: float) -> Sphere:
    """A sphere of 440C steel."""
    return Sphere(diameter / 2.0, STEEL_440C)


def chain(diameter: float) -> Chain:
    """The thesis's chain of 20 spheres and its striker, undamped and without gravity."""
    return Chain([bead(diameter)] * BEADS, striker=bead(diameter), impact_speed=IMPACT_SPEED)


def plate(thickness: float) -> Plate:
    """The thesis's square plate, two opposite edges clamped and two free."""
    return kirchhoff_plate(SIDE, SIDE, thickness, ALUMINIUM_6061, SUPPORTS, highest_frequency=HIGHEST_FREQUENCY)


def near_edge(thickness: float) -> ReducedPlate:
    """The plate for all distances up to NEAR on its centre line, where most samples of the refinement lie."""
    return ReducedPlate(plate(thickness), UNTIL, (DISTANCES[0], NEAR), SIDE / 2.0, tolerance=NEAR_REDUCTION)


@lru_cache(maxsize=1)
def struck(near: ReducedPlate, distance: float) -> Structure:
    """The reduced plate, struck on its centre line; cached for the next bead diameter."""
    if distance <= NEAR:
        return near.at(distance, SIDE / 2.0)
    return reduce(near.plate.at(distance, SIDE / 2.0), until=UNTIL, tolerance=REDUCTION)


def table(data: xr.Dataset) -> list[Row]:
    """The critical distances compared with the thesis's two lines and its statements about them."""
    rows = []
    for diameter in data.diameter.values:
        contact = Surface(ALUMINIUM_6061)
        stiffness = hertz_stiffness(bead(diameter).surface, contact)
        time = contact_time_half_space(bead(diameter).mass, stiffness, IMPACT_SPEED) * 1e6
        printed = {4.76e-3: 27.7, 9.53e-3: 55.6, 19.05e-3: 111.44}[round(float(diameter), 5)]
        reason = "the thesis takes 8000 kg/m³ (316) for its 440C beads, and 19.1 for 19.05 mm; Table 2.1 says 7800"
        rows.append(Row(f"contact time, half-space, D {diameter * 1e3:.2f}", printed, time, "µs", reason))
    rows += [_critical_row(data.sel(diameter=d, thickness=t)) for d in data.diameter for t in data.thickness]
    rows += [row for d in data.diameter for t in data.thickness for row in _criteria(data.sel(diameter=d, thickness=t))]
    rows.extend(_coefficients())
    ratio = data.amplitude_ratio.sel(diameter=19.05e-3, thickness=2.29e-3).fillna(0.0)
    rows.append(
        Row(
            "AR at the centre, D 19.05, t 2.29", "about 0", float(ratio.isel(distance=-1)), "",
            "section 6.2.1: negligible above D/t = 5, here 8.3; no wave above 0.01 within the record",
        )
    )  # fmt: skip
    return [*rows, *plate_waves.table(), *plate_edges.table(data)]


def _coefficients() -> list[Row]:
    """The printed factors of equations 6.39 and 6.42, for a sphere on a half-space with all other quantities equal to
    one.
    """
    with units_of_one():
        material = Material(1.0, 0.0, 1.0)
        sphere = Sphere(0.5, material)
    stiffness = hertz_stiffness(sphere.surface, Surface(material))
    # Both bodies have equal compliances of one, so their sum is two.
    striker = contact_time_half_space(sphere.mass, stiffness, 1.0) / 2.0**0.4
    wave = striker * PARTICLE_TO_STRIKER_SPEED**-0.2
    reason = (
        "holds with the wave's 0.682 times the striker's speed; {:.4g} with the striker's, which is what is printed"
    )
    return [
        Row(
            "factor of τ_c, equation 6.39", 0.853, wave / HERTZ_COLLISION, "", reason.format(striker / HERTZ_COLLISION)
        ),
        Row("factor of the critical distance, equation 6.42", 1.37, wave / 2.0, "", reason.format(striker / 2.0)),
    ]


def _critical_row(one: xr.Dataset) -> Row:
    """The critical distance of one plate and bead, compared with the thesis's two lines."""
    low, high = one.bound.values * 1e3
    at = one.sel(within=TOLERANCE)
    others = [_printed(one.sel(within=other)) for other in (TOLERANCES[0], TOLERANCES[-1])]
    reason = f"{_verdict(at, low, high)}; tolerances of 0.01 and 0.05 give {others[0]} and {others[1]}"
    return Row(f"critical distance, {_named(one)}", "", _printed(at), "mm", reason, f"{low:.1f} to {high:.1f}")


def _criteria(one: xr.Dataset) -> list[Row]:
    """The critical distance by other criteria: relative to the far value, and by the echo, without a tolerance."""
    relative = one[[name for name in one if str(name).startswith("relative_")]]
    relative = relative.rename({name: str(name).removeprefix("relative_") for name in relative})
    far, inside = float(one.far_value.fillna(0.0)), float(one.infinite_amplitude_ratio.fillna(0.0))
    return [
        Row(
            f"to 5 % of the far value, {_named(one)}", "", _printed(relative), "mm",
            f"AR at the centre {far:.4f}, on the infinite plate {inside:.4f}" if far > 0.0 else "no wave at the centre",
        ),
        Row(
            f"by the echo alone, {_named(one)}", "", _printed(one.sel(within=TOLERANCE)), "mm",
            f"theory: half of the echo is back as the contact ends, {float(one.contact_time) * 1e6:.0f} µs on the "
            "infinite plate", float(one.half_echo_distance) * 1e3,
        ),
    ]  # fmt: skip


def _named(one: xr.Dataset) -> str:
    return f"D {float(one.diameter) * 1e3:.2f}, t {float(one.thickness) * 1e3:.2f}"


def _printed(at: xr.Dataset) -> str:
    """A critical distance in mm, with the digits that its bracket supports."""
    low, high = at.bracket.values * 1e3
    if at.lower_bound:
        return f"> {low:.0f}"
    if np.isnan(at.critical_distance):
        return "no wave"
    half = 0.5 * (high - low)
    digits = max(0, -int(np.floor(np.log10(half))))
    return f"{float(at.critical_distance) * 1e3:.{digits}f} ± {half:.{digits}f}"


def _verdict(at: xr.Dataset, low: float, high: float) -> str:
    """The critical distance at one tolerance in relation to the two lines, mm."""
    if at.lower_bound:
        return (
            f"a lower bound: from farther away no wave is back within {UNTIL * 1e3:.1f} ms, and longer records do not "
            "settle it"
        )
    value = float(at.critical_distance) * 1e3
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


def figures(data: xr.Dataset) -> dict[str, "Figure"]:
    """AR and TOF against the distance, the critical distances and the two theory lines, and how they were refined."""
    from coupling.views import plots

    return {
        "amplitude_ratio": plots.against_distance(data, "amplitude_ratio", "amplitude ratio AR", TOLERANCE),
        "time_of_flight": plots.against_distance(data, "time_of_flight", "time of flight (µs)", TOLERANCE, 1e6),
        "critical_distance": plots.critical_distances(data, TOLERANCE),
        "refinement": plots.refinement(data, TOLERANCE),
        "edges": plate_edges.figure(data),
    }
