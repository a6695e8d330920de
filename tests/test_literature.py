"""Numbers of other authors and programs: the table of docs/literature.md has their numbers and hertzlink's."""

import re
import warnings
from functools import cache
from math import acos, sqrt
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from scipy import sparse
from scipy.integrate import solve_ivp
from scipy.sparse.linalg import eigsh

import hertzlink as hl
from hertzlink.studies.compare import agrees, as_range, rounded

pytestmark = pytest.mark.thorough

PAGE = (Path(__file__).parent.parent / "docs" / "literature.md").read_text(encoding="utf-8")
LINES = [line.strip("|").split("|") for line in PAGE.splitlines() if line.startswith("| ") and line.count("|") == 6]
TABLE = [[cell.strip() for cell in cells] for cells in LINES[1:]]
ROWS = {row[1]: row[2:] for row in TABLE}
"""The printed number, hertzlink's number and the verdict, by name."""

FIRST, LAST = 30, 50  # Beads between which MOOSE reads its settled wave.
KUWABARA_KONO = 5e-5  # Of MOOSE's viscoelastic spheres, s.
STEEL = hl.Material(200e9, 0.3, 8000.0)  # Of NAFEMS' plates.
SPREAD = 0.001  # Of mass ratios of dimers, through which a parabola goes.


@cache
def ours() -> dict[str, float | tuple[float, float]]:
    """hertzlink's value of each number, and that under a condition: a value, or a range, by the name and " if"."""
    return {**moose_chain(), **collisions(), **overlaps(), **dimers(), **plates()}


def chain_of(beads: int) -> xr.Dataset:
    bead = hl.Sphere(5e-3, hl.Material(203e9, 0.3, 7780.0))
    chain = hl.Chain([bead] * (beads - 1), bead, 1.0)
    return hl.CoSimulation(chain, None, dt=5e-8).run(2e-3, save_every=1e-7)


def peak(time: np.ndarray, values: np.ndarray) -> tuple[float, float]:
    """The time and the height of a signal's peak, by a parabola through three samples."""
    top = int(values.argmax())
    before, middle, after = values[top - 1 : top + 2]
    shift = 0.5 * (before - after) / (before - 2.0 * middle + after)
    return float(time[top] + shift * (time[1] - time[0])), float(middle - 0.25 * (before - after) * shift)


def duration(time: np.ndarray, values: np.ndarray, level: float) -> float:
    """How long a pulse exceeds a part of its peak, s."""
    least, top = level * peak(time, values)[1], int(values.argmax())
    rise = top - int(np.argmax(values[top::-1] < least))
    fall = top + int(np.argmax(values[top:] < least))
    ends = [np.interp(least, values[[a, b]], time[[a, b]]) for a, b in ((rise, rise + 1), (fall, fall - 1))]
    return float(ends[1] - ends[0])


def moose_chain() -> dict[str, float | tuple[float, float]]:
    """60 steel beads of 10 mm, of which the first starts at 1 m/s; it is also the line of Hinch and Saint-Jean."""
    run = chain_of(60)
    time, velocity, size = run.time.values, run.velocity, 0.01
    arrivals, peaks = zip(*(peak(time, velocity.sel(bead=n).values) for n in (FIRST, LAST)), strict=True)
    speed = (LAST - FIRST) * size / (arrivals[1] - arrivals[0])
    plane = 203e9 / (1.0 - 0.3**2)
    nesterenko = (6.0 / (5.0 * np.pi * 7780.0 * 0.75 / plane)) ** 0.4 * peaks[1] ** 0.2
    every = round(2e-6 / (time[1] - time[0]))
    sampled = [
        duration(time[start::every], velocity.sel(bead=n).values[start::every], 0.01) * speed / size
        for n in (FIRST, LAST)
        for start in range(0, every, every // 5)
    ]
    foot, half = (duration(time, velocity.sel(bead=LAST).values, level) * speed / size for level in (0.01, 0.5))
    after = velocity.isel(time=-1)
    return {
        "settled speed of a bead, m/s": peaks[1],
        "wave speed less than Nesterenko's, %": 100.0 * (1.0 - speed / nesterenko),
        "width of the pulse at 1 %, D": foot,
        "width of the pulse at 1 %, D if": (min(sampled), max(sampled)),
        "width at half of the peak less than that of cos⁴, %": 100.0 * (1.0 - half / (sqrt(10.0) * acos(0.5**0.25))),
        "speed of the last ball": float(after[-1]),
        "speed of the second last ball": float(after[-2]),
        "speed of the ball that hit": float(after[0]),
    }


def collision(
    sphere: hl.Sphere, speed: float, loss: hl.Dissipation | None = None, wall: hl.Surface | None = None
) -> tuple[float, float, float]:
    """Restitution, largest force (N) and duration (s) of a collision with an equal sphere, or with a wall: one that is
    too heavy to move."""
    other = sphere if wall is None else hl.Sphere(0.1, hl.Material(1e11, 0.3, 1e12))
    mass = sphere.mass * other.mass / (sphere.mass + other.mass)
    stiffness = hl.theory.hertz_stiffness(sphere.surface, wall or sphere.surface)
    lasts = float(hl.theory.hertz_contact_time(mass, stiffness, speed))
    chain = hl.Chain([other], sphere, speed, dissipation=loss, law=hl.contact_law(sphere, wall or sphere))
    step = lasts / 1600
    with warnings.catch_warnings():  # The sources themselves take Hertz's law farther than its limit.
        warnings.filterwarnings("ignore", "contact law: the approach .* is beyond 200 µm")
        run = hl.CoSimulation(chain, None, dt=step).run(2.0 * lasts, save_every=step)
    force, after = run.contact_force.values[:, 0], run.velocity.isel(time=-1).values
    return float(after[1] - after[0]) / speed, float(force.max()), np.count_nonzero(force > 0.0) * step


def collisions() -> dict[str, float]:
    sphere = hl.Sphere(0.01, hl.Material(100e6, 0.3, 2500.0))
    lasts = 1e3 * collision(sphere, 1.0)[2]
    numbers = {"duration of an impact, ms": lasts, "duration of an impact, by the page's formula, ms": lasts}
    for speed in (0.1, 3.0):
        name = f"restitution at {speed:g} m/s"
        numbers[name] = collision(sphere, speed, hl.KuwabaraKono(KUWABARA_KONO))[0]
        numbers[f"{name} if"] = parted(sphere, speed)
    return numbers


def parted(sphere: hl.Sphere, speed: float) -> float:
    """Restitution of two viscoelastic spheres whose force may pull until they part."""
    law, mass = hl.contact_law(sphere, sphere), 0.5 * sphere.mass

    def rate(_: float, state: np.ndarray) -> list[float]:
        overlap = np.array(max(state[0], 0.0))
        return [state[1], -float(law.force(overlap) + KUWABARA_KONO * law.tangent(overlap) * state[1]) / mass]

    def apart(_: float, state: np.ndarray) -> float:
        return float(state[0])

    apart.terminal, apart.direction = True, -1.0  # type: ignore[attr-defined]
    end = solve_ivp(rate, (0.0, 0.1), [1e-12, speed], events=apart, rtol=1e-9, atol=1e-14, max_step=1e-4)
    return -float(end.y[1, -1]) / speed


def overlaps() -> dict[str, float]:
    glass, iron = hl.Sphere(0.01, hl.Material(48e9, 0.2, 2800.0)), hl.Sphere(2.5e-3, hl.Material(1e11, 0.25, 7000.0))
    wall, rigid = hl.Surface(iron.material), hl.Surface(hl.Material(1e20, 0.0, 1e3))
    between, against = collision(glass, 20.0)[1], collision(iron, 3.9, wall=wall)[1]
    overlap, largest = (
        float(hl.contact_law(*of).approach(np.array([force]))[0])
        for of, force in (((glass, glass), between), ((iron, wall), against))
    )
    pressed = hl.contact_law(hl.Sphere(8e-3, hl.Material(1e9, 0.3, 1e3)), rigid).approach(np.array([60.0 * np.pi]))
    return {
        "largest overlap of two spheres, µm": 1e6 * overlap,
        "largest force between two spheres, kN": 1e-3 * between,
        "largest overlap of a sphere and a wall, µm": 1e6 * largest,
        "contact radius of a sphere on a rigid plane, mm": 1e3 * sqrt(8e-3 * float(pressed[0])),
    }


def dimers() -> dict[str, float]:
    """The mass ratios, light over heavy, at which a wave crosses a chain of two kinds of beads without loss."""
    numbers = {}
    for name, middle in (("first", 0.343), ("second", 0.155)):
        losses = [attenuation(middle + part) for part in (-SPREAD, 0.0, SPREAD)]
        bend = losses[0] - 2.0 * losses[1] + losses[2]
        numbers[f"{name} anti-resonance of dimers"] = middle + 0.5 * SPREAD * (losses[0] - losses[2]) / bend
    return numbers


def attenuation(ratio: float) -> float:
    """The part of its speed that the wave loses between two heavy beads; light ones are of equal stiffness."""
    heavy, light = (hl.Sphere(5e-3, hl.Material(200e9, 0.3, 8000.0 * part)) for part in (1.0, ratio))
    chain = hl.Chain([light, heavy] * 70, heavy, 1.0, law=hl.contact_law(heavy, heavy))
    run = hl.CoSimulation(chain, None, dt=5e-8).run(2.4e-3, save_every=1e-7)
    first, last = (peak(run.time.values, run.velocity.sel(bead=n).values)[1] for n in (60, 120))
    return 1.0 - last / first


def frequencies(side: float, thickness: float, material: hl.Material, *edges: str) -> tuple[np.ndarray, float]:
    """The ten lowest angular frequencies of a square plate, rad/s, rigid motions first, and 1/s in a unit of λ²."""
    plate = hl.kirchhoff_plate(side, side, thickness, material, hl.Supports(*edges), cells=(24, 24))
    structure = plate.at(0.4871 * side, 0.4632 * side)
    unit = sqrt(plate.rigidity / plate.mass_per_area) / side**2
    scale = sparse.diags_array(1.0 / np.sqrt(structure.stiffness.diagonal() + unit**2 * structure.mass.diagonal()))
    stiffness, mass = (sparse.csc_array(scale @ part @ scale) for part in (structure.stiffness, structure.mass))
    squares = np.sort(eigsh(stiffness, 10, M=mass, sigma=-(unit**2), return_eigenvectors=False))
    return np.sqrt(np.maximum(squares, 0.0)), unit


def plates() -> dict[str, float]:
    free, unit = frequencies(10.0, 0.05, STEEL, *["free"] * 4)
    simple, _ = frequencies(10.0, 0.05, STEEL, *["simple"] * 4)
    cantilever, _ = frequencies(10.0, 0.05, STEEL, "clamped", "free", "free", "free")
    clamped, _ = frequencies(1.0, 0.01, hl.Material(210e9, 0.3, 7800.0), *["clamped"] * 4)
    small, _ = frequencies(1.0, 0.02, hl.Material(200e9, 0.3, 7850.0), *["simple"] * 4)
    found = {
        "free plate, mode {}, Hz": (("4", "5", "6", "7", "9"), free[[3, 4, 5, 6, 8]] / (2.0 * np.pi)),
        "plate on simple edges, mode {}, Hz": (("1", "2", "4", "5", "7"), simple[[0, 1, 3, 4, 6]] / (2.0 * np.pi)),
        "cantilever plate, λ² of mode {}": (("1", "2", "3", "4", "5"), cantilever[:5] / unit),
        "free plate, λ² of mode {}": (("1", "2", "3", "4"), free[3:7] / unit),
        "clamped plate, mode {}, rad/s": (("1", "2", "4"), clamped[[0, 1, 3]]),
        "plate on simple edges, 1 m, mode {}, Hz": (("1",), small[:1] / (2.0 * np.pi)),
    }
    return {
        name.format(mode): float(value)
        for name, (modes, values) in found.items()
        for mode, value in zip(modes, values, strict=True)
    }


def printed(text: str) -> tuple[float, float]:
    """What the digits of a number, of a range or of a number with its scatter stand for."""
    middle, _, scatter = text.replace("−", "-").partition(" ± ")
    low, _, high = middle.partition(" to ")
    ends = rounded(low, high or low)
    return (ends[0] - float(scatter), ends[1] + float(scatter)) if scatter else ends


def lies(value: float | tuple[float, float], expected: tuple[float, float]) -> bool:
    """Whether all of a value lies in an expected range."""
    low, high = as_range(value)
    return expected[0] <= low and high <= expected[1]


def test_each_number_of_the_page_is_computed() -> None:
    undefined = {name for name, (_, shown, _) in ROWS.items() if not shown}
    assert set(ROWS) - undefined == {name for name in ours() if not name.endswith(" if")}
    assert len(ROWS) == len(TABLE) == 42


@pytest.mark.parametrize("name", ROWS)
def test_a_row_of_the_page(name: str) -> None:
    """hertzlink's number has the digits that the page shows, and the verdict follows from them."""
    said, shown, verdict = ROWS[name]
    expected = printed(said)
    if not shown:
        assert verdict == "not defined"
        return
    value = ours()[name]
    assert isinstance(value, float)
    assert lies(value, printed(shown)), value
    if match := re.fullmatch(r"agrees(?: within its error, (\S+))?", verdict):
        spare = float(match[1] or 0.0)
        assert lies(value, (expected[0] - spare, expected[1] + spare))
        return
    assert not lies(value, expected)
    if match := re.fullmatch(r"differs by ([-+−].*) %", verdict):
        assert lies(100.0 * (value / float(said) - 1.0), printed(match[1]))
    elif match := re.fullmatch(r"misprint of (.*)", verdict):
        assert lies(value, printed(match[1]))
    else:
        match = re.fullmatch(r"agrees if .*: (.*)", verdict)
        assert match
        other = ours()[f"{name} if"]
        assert lies(other, printed(match[1]))
        assert agrees(expected, other, whole=False)
