"""Numbers of other authors and programs: the source, their value, ours with its numerical error, and a verdict."""

import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import acos, isnan, nan, sqrt
from types import MappingProxyType
from typing import Any

import numpy as np
import xarray as xr
from numpy.lib.stride_tricks import sliding_window_view
from scipy import sparse
from scipy.integrate import solve_ivp
from scipy.sparse.linalg import eigsh

import hertzlink as hl
from coupling.interface import points, takes_part
from coupling.participant import CheckedParticipant
from coupling.sweeps.progress import watched
from hertzlink.studies import draw, verdicts, waves
from hertzlink.studies.conditions import Conditions
from hertzlink.studies.table import Row, Rows
from particles.chain import LawOfPair

__all__ = ["Conditions", "figures", "run", "table"]
row = Rows("literature", ("literature.toml",))
Numbers = dict[str, float]
BEADS, FIRST, LAST = 60, 30, 50  # Of MOOSE's chain, and the beads between which its settled wave is read.
TIME = 5e-5  # Of Kuwabara and Kono's loss, s.
STEPS = 400  # Of the coarser run, in each duration of a collision.
# Mass ratios of dimers near which a wave loses least; a parabola goes through them and those SPREAD away.
SPREAD = 0.004
ANTI_RESONANCES = {
    "Jayaprakash et al.: first anti-resonance of dimers": 0.343,
    "Jayaprakash et al.: second anti-resonance of dimers": 0.155,
}
CELLS = 12  # Along each side of the coarser mesh of a plate.
PLACE = (0.4871, 0.4632)  # Of the contact, over the sides: on no line where a mode is at rest.
FOLD, NEAR = 4, 0.2  # Windows in a sample of a ringing plate; relative distance in which a frequency is looked for.
STEEL = hl.Material(200e9, 0.3, 8000.0)  # Of NAFEMS' plates.
ON_SIMPLE_EDGES = (
    ("NAFEMS, simple edges", 10.0, 0.05, STEEL), ("femorph-solver", 1.0, 0.02, hl.Material(200e9, 0.3, 7850.0)),
)  # fmt: skip
EDGES = {"free": ("free",) * 4, "simple": ("simple",) * 4, "clamped": ("clamped",) * 4,
         "cantilever": ("clamped", "free", "free", "free")}  # fmt: skip
MEMORY, ABSTRACT = "from memory", "the abstract alone"
WITHIN = "within our numerical error"
PARTED, COARSE = "the force pulls until the spheres part", "the wave is sampled every 2 µs"
WIDTH = "MOOSE: width of the pulse at 1 % of its peak"
SHADES = dict(zip(verdicts.VERDICTS, (draw.COLOURS[i] for i in (0, 2, 1, 3)), strict=False))
OTHERWISE = " | "  # Between the name of a number and the condition under which it is another one.


def run(quick: bool = False, jobs: int | None = None, **parameters: Any) -> xr.Dataset:
    """Return our value of each number, and its change where steps are halved and meshes refined twofold.

    quick: chains are coarser by a factor of two. Plates are not, as a coarser one cannot tell 2.3595 from 2.360 Hz.
    jobs: always one process, because all of it takes seconds.
    """
    Conditions.of(parameters)
    both = zip(refined(CHAINS, 1 if quick else 2), refined([_plates], 2), strict=True)
    values, errors = (of_chains | of_plates for of_chains, of_plates in both)
    names = list(values)
    return xr.Dataset(
        {
            "value": ("number", [values[name] for name in names], {"long_name": "ours, in the unit of the source"}),
            "error": ("number", [errors[name] for name in names], {"long_name": "its change by the last refinement"}),
            "speed": waveform(),
        },
        {"number": names},
    )


def of_chains(law: LawOfPair = hl.contact_law) -> tuple[Numbers, Numbers]:
    """Return our values of all numbers of chains and collisions with a contact law, and their numerical errors."""
    return refined([partial(compute, law=law) for compute in CHAINS], 1)


def refined(groups: Sequence[Callable[[int], Numbers]], finer: int) -> tuple[Numbers, Numbers]:
    """Return the values of the finer of two runs of each group, and their changes from the other. finer: a factor."""
    values: Numbers = {}
    errors: Numbers = {}
    for compute in watched(groups):
        coarse, fine = (compute(finer * factor) for factor in (1, 2))
        values |= fine
        errors |= {name: abs(fine[name] - coarse[name]) for name in fine}
    return values, errors


def rows_of(found: Numbers, errors: Mapping[str, float] = MappingProxyType({})) -> dict[str, Row]:
    """Return the numbers of the literature compared with ours, by name; one that our runs cannot give has no value."""
    others: dict[str, dict[str, list[float]]] = {}
    for full, value in found.items():
        name, *conditions = full.split(OTHERWISE)
        if conditions:
            others.setdefault(name, {}).setdefault(conditions[0], []).append(value)
        elif name in errors:
            others[name] = {WITHIN: [value - errors[name], value + errors[name]]}
    said = {
        name: {condition: f"{min(values)} to {max(values)}" for condition, values in of.items()}
        for name, of in others.items()
    }
    return {name: row(name, found.get(name, ""), otherwise=said.get(name, {})) for name in row.entries}


def _moose_chain(finer: int, law: LawOfPair = hl.contact_law) -> Numbers:
    bead = hl.Sphere(5e-3, hl.Material(203e9, 0.3, 7780.0))
    saved = 2e-7 / finer
    found = _chain(bead, law, saved)
    time, velocity = found.time.values, found.velocity
    arrivals, peaks = zip(*(_peak(time, velocity.sel(bead=n).values) for n in (FIRST, LAST)), strict=True)
    speed = (LAST - FIRST) * bead.size / (arrivals[1] - arrivals[0])
    plane = bead.material.youngs_modulus / (1.0 - bead.material.poisson_ratio**2)
    theory = (6.0 / (5.0 * np.pi * bead.material.density * 0.75 / plane)) ** 0.4 * peaks[1] ** 0.2
    every = round(2e-6 / saved)
    late = [
        _duration(time[start::every], velocity.sel(bead=n).values[start::every], 0.01) * speed / bead.size
        for n in (FIRST, LAST)
        for start in range(0, every, every // 5)
    ]
    foot, half = (_duration(time, velocity.sel(bead=LAST).values, level) * speed / bead.size for level in (0.01, 0.5))
    cosine = sqrt(10.0) * acos(0.5**0.25)  # diameters between the halves of cos⁴(x/(R √10))
    after = velocity.isel(time=-1)
    return {
        "MOOSE: settled speed of a bead": peaks[1],
        "MOOSE: wave speed, away from Nesterenko's": 100.0 * abs(speed / theory - 1.0),
        WIDTH: foot,
        f"{WIDTH}{OTHERWISE}{COARSE}{OTHERWISE}least": min(late),
        f"{WIDTH}{OTHERWISE}{COARSE}{OTHERWISE}most": max(late),
        "MOOSE: half-maximum width, less than that of cos⁴": 100.0 * (1.0 - half / cosine),
        "Hinch and Saint-Jean: speed of the last ball": float(after[-1]),
        "Hinch and Saint-Jean: speed of the second last ball": float(after[-2]),
        "Hinch and Saint-Jean: speed of the ball that hit": float(after[0]),
    }


def _chain(bead: hl.Sphere, law: LawOfPair, saved: float) -> xr.Dataset:
    chain = hl.Chain([bead] * (BEADS - 1), bead, 1.0, law=law)
    return hl.CoSimulation(chain, None, dt=saved / 2.0).run(2e-3, save_every=saved)


def waveform() -> xr.DataArray:
    """Return the speed of a bead far from the struck end, over its peak, over the distance from the wave's centre."""
    bead = hl.Sphere(5e-3, hl.Material(203e9, 0.3, 7780.0))
    found = _chain(bead, hl.contact_law, 4e-7)
    arrivals = [_peak(found.time.values, found.velocity.sel(bead=n).values)[0] for n in (FIRST, LAST)]
    force = found.velocity.sel(bead=LAST).values
    distance = (found.time.values - arrivals[1]) * (LAST - FIRST) / (arrivals[1] - arrivals[0])
    near = abs(distance) < 3.0
    shape = xr.DataArray(force[near] / force.max(), {"distance": distance[near]}, "distance")
    shape.distance.attrs["units"] = "1"
    return shape


def _moose_spheres(finer: int, law: LawOfPair = hl.contact_law) -> Numbers:
    sphere = hl.Sphere(0.01, hl.Material(100e6, 0.3, 2500.0))
    lasts = 1e3 * _collision(sphere, 1.0, finer, law)[2]
    numbers = {"MOOSE: duration of a Hertzian impact": lasts, "MOOSE: the same duration, by its formula": lasts}
    for speed in (0.1, 3.0):
        name = f"MOOSE: restitution at {speed:g} m/s"
        numbers[name] = _collision(sphere, speed, finer, law, hl.KuwabaraKono(TIME))[0]
        numbers[f"{name}{OTHERWISE}{PARTED}"] = _parted(sphere, speed, law, 1e-8 / finer**2)
    return numbers


def _parted(sphere: hl.Sphere, speed: float, law: LawOfPair, tolerance: float) -> float:
    """Return the restitution of two viscoelastic spheres whose force may pull until they part."""
    pair, mass = law(sphere, sphere), 0.5 * sphere.mass

    def rate(_: float, state: np.ndarray) -> list[float]:
        overlap = np.array(max(state[0], 0.0))
        return [state[1], -float(pair.force(overlap) + TIME * pair.tangent(overlap) * state[1]) / mass]

    def apart(_: float, state: np.ndarray) -> float:
        return float(state[0])

    apart.terminal, apart.direction = True, -1.0  # type: ignore[attr-defined]
    start = [1e-12, speed]
    found = solve_ivp(rate, (0.0, 0.1), start, events=apart, rtol=tolerance, atol=1e-14, max_step=1e-4)
    return -float(found.y[1, -1]) / speed


def _benchmarks(finer: int, law: LawOfPair = hl.contact_law) -> Numbers:
    glass, iron = hl.Sphere(0.01, hl.Material(48e9, 0.2, 2800.0)), hl.Sphere(2.5e-3, hl.Material(1e11, 0.25, 7000.0))
    wall = hl.Surface(iron.material)
    two, one = _collision(glass, 20.0, finer, law), _collision(iron, 3.9, finer, law, wall=wall)
    overlaps = [
        law(*of).approach(np.array([force])) for of, force in (((glass, glass), two[1]), ((iron, wall), one[1]))
    ]
    on_plane = hl.Surface(hl.Material(1e20, 0.0, 1e3))
    pressed = law(hl.Sphere(8e-3, hl.Material(1e9, 0.3, 1e3)), on_plane).approach(np.array([60.0 * np.pi]))
    return {
        "LAMMPS: largest overlap of two spheres": 1e6 * float(overlaps[0][0]),
        "Chung and Ooi: largest force between two spheres": 1e-3 * two[1],
        "LAMMPS: largest overlap of a sphere and a wall": 1e6 * float(overlaps[1][0]),
        "ANSYS: contact radius of a sphere on a rigid plane": 1e3 * sqrt(8e-3 * float(pressed[0])),
    }


def _dimers(finer: int, law: LawOfPair = hl.contact_law) -> Numbers:
    """Return the mass ratios at which a wave crosses a chain of two kinds of beads without loss."""
    numbers = {}
    for name, middle in ANTI_RESONANCES.items():
        away = np.array([-1.0, 0.0, 1.0]) * SPREAD / finer
        losses = [_attenuation(middle + part, finer, law) for part in away.tolist()]
        bend = losses[0] - 2.0 * losses[1] + losses[2]
        numbers[name] = middle + 0.5 * float(away[2]) * (losses[0] - losses[2]) / bend
    return numbers


def _attenuation(ratio: float, finer: int, law: LawOfPair) -> float:
    """Return which part of its speed the wave loses between two heavy beads; light ones are of equal stiffness."""
    heavy, light = (hl.Sphere(5e-3, hl.Material(200e9, 0.3, 8000.0 * part)) for part in (1.0, ratio))
    chain = hl.Chain([light, heavy] * 70, heavy, 1.0, law=law(heavy, heavy))
    saved = 2e-7 / finer
    found = hl.CoSimulation(chain, None, dt=saved / 2.0).run(2.4e-3, save_every=saved)
    first, last = (_peak(found.time.values, found.velocity.sel(bead=n).values)[1] for n in (60, 120))
    return 1.0 - last / first


def _collision(
    sphere: hl.Sphere, speed: float, finer: int, law: LawOfPair,
    loss: hl.Dissipation | None = None, wall: hl.Surface | None = None,
) -> tuple[float, float, float]:  # fmt: skip
    """Return restitution, largest force (N) and duration (s) of a collision with an equal sphere, or with a wall.

    The wall is a sphere that is too heavy to move.
    """
    other = sphere if wall is None else hl.Sphere(0.1, hl.Material(1e11, 0.3, 1e12))
    pair = law(sphere, wall or sphere)
    mass = sphere.mass * other.mass / (sphere.mass + other.mass)
    lasts = float(
        hl.theory.hertz_contact_time(mass, hl.theory.hertz_stiffness(sphere.surface, wall or sphere.surface), speed)
    )
    chain = hl.Chain([other], sphere, speed, dissipation=loss, law=pair)
    step = lasts / (STEPS * finer)
    with warnings.catch_warnings():
        # The sources themselves take Hertz's law farther than its limit.
        warnings.filterwarnings("ignore", "contact law: the approach .* is beyond 200 µm")
        found = hl.CoSimulation(chain, None, dt=step).run(2.0 * lasts, save_every=step)
    force, after = found.contact_force.values[:, 0], found.velocity.isel(time=-1).values
    touching = np.count_nonzero(force > 0.0)
    return float(after[1] - after[0]) / speed, float(force.max()), touching * step


def _plates(finer: int) -> Numbers:
    large = {edges: _frequencies(10.0, 0.05, STEEL, edges, finer) for edges in ("free", "simple", "cantilever")}
    hertz = {edges: values / (2.0 * np.pi) for edges, values in large.items()}
    clamped = _frequencies(1.0, 0.01, hl.Material(210e9, 0.3, 7800.0), "clamped", finer)
    small = _frequencies(*ON_SIMPLE_EDGES[1][1:], "simple", finer) / (2.0 * np.pi)
    plate = _plate(10.0, 0.05, STEEL, "free", 4)
    unit = 100.0 * sqrt(plate.mass_per_area / plate.rigidity)
    free, simple, squares = hertz["free"][3:], hertz["simple"], large["free"][3:] * unit
    numbers = {
        "NAFEMS FV12: mode": dict(zip(("4", "5", "6", "s 7 and 8", "9"), free[[0, 1, 2, 3, 5]], strict=True)),
        "NAFEMS, simple edges: mode": dict(
            zip(("1", "s 2 and 3", "4", "s 5 and 6", "s 7 and 8"), simple[[0, 1, 3, 4, 6]], strict=True)
        ),
        "Barton, cantilever plate: λ² of mode": dict(zip("12345", large["cantilever"] * unit, strict=False)),
        "Barton, free plate: λ² of mode": dict(zip(("1", "2", "3", "s 4 and 5"), squares, strict=False)),
        "Birger, clamped plate: mode": dict(zip(("1", "s 2 and 3", "4"), clamped[[0, 1, 3]], strict=True)),
        "femorph-solver: mode": {"1 of a plate on simple edges": small[0]},
    }
    return {
        f"{name}{'' if mode[0] == 's' else ' '}{mode}": float(value)
        for name, modes in numbers.items()
        for mode, value in modes.items()
    }


def _plate(side: float, thickness: float, material: hl.Material, edges: str, cells: int) -> hl.Plate:
    return hl.kirchhoff_plate(side, side, thickness, material, hl.Supports(*EDGES[edges]), cells=(cells, cells))


def _frequencies(side: float, thickness: float, material: hl.Material, edges: str, finer: int) -> np.ndarray:
    """Return the ten lowest angular frequencies of a square plate, rad/s, rigid motions first."""
    plate = _plate(side, thickness, material, edges, CELLS * finer)
    structure = plate.at(PLACE[0] * side, PLACE[1] * side)
    return _lowest(structure, plate.rigidity / (plate.mass_per_area * side**4))[0]


def _lowest(structure: hl.Structure, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the ten lowest angular frequencies of a structure, rad/s, and their speeds after a unit impulse, 1/kg.

    Both speed and impulse are those at the contact. shift: of the order of the lowest square.
    """
    scale = sparse.diags_array(1.0 / np.sqrt(structure.stiffness.diagonal() + shift * structure.mass.diagonal()))
    stiffness, mass = (sparse.csc_array(scale @ part @ scale) for part in (structure.stiffness, structure.mass))
    squares, modes = eigsh(stiffness, 10, M=mass, sigma=-shift)
    order = np.argsort(squares)
    moved = (np.ravel(structure.contact) @ (scale @ modes[:, order])) ** 2
    return np.sqrt(np.maximum(squares[order], 0.0)), moved


def of_plate(plate: Callable[[float, float, hl.Material, float, float], Any]) -> tuple[Numbers, Numbers]:
    """Return the frequencies, Hz, of a user's plates on simple edges that are in the literature; NaN for none near.

    Second, how far each of these modes moves the contact, over Navier's closed form. plate: returns the Structure or
    participant from side, thickness, material, and the place of the contact.
    """
    numbers, motions = {}, {}
    for name, side, thickness, material in ON_SIMPLE_EDGES:
        body = plate(side, thickness, material, *(place * side for place in PLACE))
        takes_part("plate", body)
        if points(body) != 1:
            raise ValueError(f"plate: has {points(body)} contact points, must have one, at (x, y)")
        sought = {full: float(one.corrected or one.value) for full, one in row.entries.items() if full.startswith(name)}
        if isinstance(body, hl.Structure):
            angular, moved = _lowest(body, (2.0 * np.pi * min(sought.values())) ** 2)
            found = angular / (2.0 * np.pi)
        else:
            found, moved = ringing(body, min(sought.values()), max(sought.values()))
        m, n = np.meshgrid(range(1, 6), range(1, 6))
        shape = np.sin(m * np.pi * PLACE[0]) * np.sin(n * np.pi * PLACE[1])
        navier = 4.0 * shape**2 / (material.density * thickness * side**2)
        squares = (m**2 + n**2) / 2.0  # Over the lowest mode's.
        for full, value in sought.items():
            near = found[abs(found / value - 1.0) < NEAR]
            numbers[full] = float(near[abs(near - value).argmin()]) if near.size else nan
            modes = abs(squares * min(sought.values()) / value - 1.0) < 0.01
            motions[full] = float(abs(moved[abs(found / value - 1.0) < 0.5 * NEAR].sum()) / navier[modes].sum())
    return numbers, motions


def ringing(body: Any, lowest: float, highest: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the natural frequencies, Hz, at which a participant rings after a smooth pulse, near a range of them.

    Second, the speed at the contact that a unit impulse gives each mode, 1/kg, with its phase.
    The pulse hardly holds what a sample of the record would fold back. The frequencies are those of the matrix pencil
    of Hua and Sarkar (IEEE Trans. Acoust. Speech Signal Process. 38 (1990) 814), exact for a sum of few modes.
    """
    checked = CheckedParticipant(body)
    # Not a whole number of windows in a period: modes that the steps of the force excite would fold onto the lowest.
    window, width = 1.0 / (24.7 * highest), 0.3 / highest
    pulse = np.exp(-0.5 * ((np.arange(0.0, 10.0 * width, window) - 5.0 * width) / width) ** 2)
    forces = np.concatenate([pulse, np.zeros(int(30.0 / (lowest * window)))])
    state, moved = checked.start(), []
    for force in forces:
        try:
            state, answer = checked.move(state, np.array([force]), window)
        except (FloatingPointError, ValueError) as error:
            raise ValueError(f"plate: {error}") from error
        moved.append(float(answer[0]))
    rings = np.array(moved[pulse.size :: FOLD])
    if not rings.any():
        raise ValueError(f"plate: {checked.name}.advance returned no displacement after a pulse of force; must ring")
    shifted = sliding_window_view(rings, rings.size // 3)
    _, sizes, modes = np.linalg.svd(shifted / abs(rings).max(), full_matrices=False)
    modes = modes[sizes > 1e-8 * sizes[0]].T
    poles = np.linalg.eigvals(np.linalg.lstsq(modes[:-1], modes[1:], rcond=None)[0])
    poles = poles[np.angle(poles) > 0.0]
    # Each mode, and its conjugate, over the part of the record that fixes the poles.
    tones = poles ** np.arange(rings.size // 3)[:, None]
    sizes_of = np.linalg.lstsq(np.hstack([tones.real, -tones.imag]), rings[: tones.shape[0]], rcond=None)[0]
    angular = np.angle(poles) / (FOLD * window)
    # The force is constant in each window.
    middles = (np.arange(pulse.size) + 0.5) * window
    held = window * np.sinc(0.5 * angular * window / np.pi) * (np.exp(-1j * np.outer(angular, middles)) @ pulse)
    moved_by = (sizes_of[: poles.size] + 1j * sizes_of[poles.size :]) * angular / held
    return angular / (2.0 * np.pi), moved_by


def _peak(time: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """Return when a signal is largest, and its peak, by a parabola through three samples; NaN for a peak at an end."""
    top = int(values.argmax())
    if not 0 < top < values.size - 1:
        return nan, nan
    before, peak, after = values[top - 1 : top + 2]
    shift = 0.5 * (before - after) / (before - 2.0 * peak + after)
    return float(time[top] + shift * (time[1] - time[0])), float(peak - 0.25 * (before - after) * shift)


def _duration(time: np.ndarray, values: np.ndarray, level: float) -> float:
    """Return how long a pulse exceeds a part of its peak; NaN for a pulse that does not rise and fall."""
    return waves.duration(time, values, int(values.argmax()), level * _peak(time, values)[1])


CHAINS: tuple[Callable[..., Numbers], ...] = (_moose_chain, _moose_spheres, _benchmarks, _dimers)


def judged(data: xr.Dataset) -> list[tuple[str, Row, str, str]]:
    """Return name, row, verdict and condition of each number."""
    found, errors = (data[name].to_series().to_dict() for name in ("value", "error"))
    return [(name, one, *_verdict(one)) for name, one in rows_of(found, errors).items()]


def problems(found: Numbers, errors: Numbers) -> list[str]:
    """Return a line for each number that differs, apart from misprints, with each value that was compared."""
    rows = [(name, one) for name, one in rows_of(found, errors).items() if name in found]
    differ = [(name, one) for name, one in rows if _verdict(one)[0] == verdicts.DIFFERS]
    return [f"  {name}: {_readable(one)}; printed {one.corrected or one.thesis}" for name, one in differ]


def too_far(motions: Numbers, allowed: float) -> list[str]:
    """Return a line for each plate whose modes do not move as far as Navier's closed form, within a part of it."""
    lines = []
    for name, *_ in ON_SIMPLE_EDGES:
        of = [motion for full, motion in motions.items() if full.startswith(name)]
        if any(abs(motion - 1.0) > allowed for motion in of):
            span = " to ".join(dict.fromkeys(f"{end:.4g}" for end in (min(of), max(of))))
            lines.append(f"  {name}: modes move the contact {span} times as far as Navier's; check the mass")
    return lines


def _readable(one: Row) -> str:
    """Return what a law gives, with its unit."""
    value = float(one.computed)
    others = [f"{_span(said, one)} if {name}" for name, said in one.otherwise.items() if name != WITHIN]
    return "; ".join(["no such wave" if isnan(value) else f"{value:.6g} {one.unit}".strip(), *others])


def _span(said: float | str, one: Row) -> str:
    """Return a range of ours, with one digit more than is printed, and its unit."""
    ends = verdicts.exact(said)
    if ends is None:
        return "no such wave"
    low, high = (_digits(end, one) for end in ends)
    return f"{low if low == high else f'{low} to {high}'} {one.unit}".strip()


def _digits(value: float, one: Row) -> str:
    """Return a value with one digit more than is printed, and four at least."""
    plain = re.search(r"[\d.]+", str(one.thesis))
    return f"{value:.{max(4, len(re.sub('^0+', '', plain[0].replace('.', ''))) + 1)}g}" if plain else f"{value:.4g}"


def _verdict(one: Row) -> tuple[str, str]:
    """Return the verdict on a row in words, and its condition."""
    said = verdicts.verdict(one)
    if said.detail in one.otherwise and said.detail != WITHIN:
        return said.word, f"{said.detail}: {_span(one.otherwise[said.detail], one)}"
    return (verdicts.REPRODUCED, "") if said.detail == WITHIN else (said.word, said.detail)


def table(data: xr.Dataset) -> list[Row]:
    """Return the counts, then each number; a reason has verdict, numerical error, set-up and source."""
    entries = judged(data)
    source = sources()
    abstract, unread = (sum(word in text for text in source.values()) for word in (ABSTRACT, MEMORY))
    read = len(entries) - abstract - unread
    said = verdicts.in_words(verdicts.counted(verdicts.Verdict(word) for _, _, word, _ in entries))
    words = f"{said}; the text of {read} was read, of {abstract} the abstract. {RULE}"
    head, errors = Row(f"{len(entries)} numbers", "", "", reason=words), data.error.to_series().to_dict()
    rows = []
    for name, one, word, condition in entries:
        error = f"numerical error {f'{errors[name]:.1g} {one.unit}'.strip()}; " if name in errors else ""
        under = f" ({condition})" if condition else ""
        said = f"{word.upper()}{under}: {error}{one.reason}. Source: {source[name]}"
        shown = one.computed if isinstance(one.computed, str) else _digits(one.computed, one)
        rows.append(one._replace(computed=shown, reason=said))
    return [head, *rows]


RULE = (
    "Ours agrees if it gives the printed digits when rounded, or lies within the printed scatter, up to its "
    "numerical error, which is the change by the last halving of steps and cells."
)


def sources() -> dict[str, str]:
    """Return where each number stands; "the same" is the source of the entry before."""
    each, last = dict[str, str](), ""
    for name, entry in row.entries.items():
        last = last if entry.source == "the same" else entry.source
        each[name] = last
    return each


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return ours over theirs for each number, and the shape of the solitary wave."""
    entries = [entry for entry in judged(data) if isinstance(entry[1].computed, float)]
    drawn, (axis,) = draw.panels(1, width=7.0, height=0.2 * len(entries) + 1.0)
    for word, shade in SHADES.items():
        points = [
            (100.0 * (float(one.computed) / _middle(one.thesis) - 1.0), place)
            for place, (_, one, said, _) in enumerate(entries)
            if said == word
        ]
        if points:
            axis.plot(*zip(*points, strict=True), "o", color=shade, label=word)
    axis.axvline(0.0, color="0.4", linewidth=0.8)
    axis.set_xscale("symlog", linthresh=0.1)
    ticks = (-100.0, -10.0, -1.0, -0.1, 0.0, 0.1, 1.0)
    axis.set_xticks(ticks, [f"{tick:g}" for tick in ticks])
    axis.set(xlabel="hertzlink − literature (% of literature)")
    axis.set_yticks(range(len(entries)), [name for name, *_ in entries], fontsize="x-small")
    axis.set_ylim(len(entries) - 0.5, -0.5)
    draw.legend_above(drawn, axis, 4)
    shape, (wave,) = draw.panels(1, width=4.5, height=3.0)
    wave.plot(data.distance, data.speed, "-", label="hertzlink")
    cosine = np.cos(np.clip(2.0 * data.distance / sqrt(10.0), -np.pi / 2, np.pi / 2)) ** 4
    wave.plot(data.distance, cosine, "--", label="Nesterenko, cos⁴", marker="")
    wave.set(xlabel="distance from the centre of the wave (diameters)", ylabel="speed of a bead / its peak")
    wave.legend()
    return {"differences": drawn, "wave": shape}


def _middle(said: float | str) -> float:
    """Return the middle of a printed number."""
    ends = verdicts.printed(said)
    assert ends is not None
    return 0.5 * (ends.low + ends.high)
