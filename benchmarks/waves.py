"""Waves and critical distances in set-ups drawn at random, beside rules that share no code with hertzlink's.

    python benchmarks/waves.py [chains]

It prints at how many beads AR and TOF are those of `tests/independent/waves.py`; how long a single reflected wave lasts
in chains of equal beads, in units of the incident wave's length times a^(−1/6), a its AR; how far AR and TOF of chains
on a mass and a spring are from those of one system of equations (`tests/monolithic.py`); and how many random scans of
distances from an edge bracket the critical distance that a fine scan finds, or are warned of.
"""

import sys
import warnings
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import xarray as xr

import hertzlink as hl

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from independent.chains import COUNT, FAMILIES, METALS, chain_of, run_of
from independent.waves import compare
from monolithic import Contact, monolithic

SEED, SCANS, BEADS = 57, 60, 20
UNTIL, SENSOR, TOLERANCE = 0.9e-3, 7, 0.02  # of the scans


def agreement(count: int) -> str:
    def found(run: xr.Dataset, sensor: int) -> tuple[float, float] | None:
        wave = hl.reflections(run, sensor).primary
        return (wave.amplitude_ratio, wave.time_of_flight) if wave else None

    agree, beads, differ = compare(found, map(run_of, range(count)))
    clear = sum(not one.doubt for one in differ)
    return (
        f"{count} chains: AR within 1 % and TOF at {agree} of {beads} beads; {clear} of the others are one clear pulse"
    )


def lengths() -> Iterator[float]:
    """Yield the relative lengths of waves from walls that give back one wave: half-spaces, plates without edges, and
    rods whose far end answers later."""
    random = np.random.default_rng(SEED)
    for number in range(60):
        bead = hl.Sphere(random.uniform(2e-3, 6e-3), METALS[random.integers(len(METALS))])
        wall = (*METALS, hl.PTFE, hl.ACRYLIC)[random.integers(len(METALS) + 2)]
        layer = hl.Layer(wall, 1.5, bead.radius * random.uniform(1.5, 3.0))
        plate = hl.infinite_plate(bead.radius * random.uniform(1.0, 3.0), wall)
        structure = (hl.half_space(wall), plate, hl.rod([layer]))[number % 3]
        chain = hl.Chain([bead] * BEADS, bead, random.uniform(0.1, 1.0))
        run = hl.CoSimulation(chain, structure).run(2e-3)
        time, force = run.time.values, hl.sensor_force(run, SENSOR).values
        power, waves = force * run.velocity.sel(bead=SENSOR).values, hl.reflections(run, SENSOR)
        if waves.primary is None or waves.primary.amplitude_ratio < 0.1:
            continue
        incident, primary = (int(np.searchsorted(time, wave.arrival)) for wave in (waves.incident, waves.primary))
        there, back = duration(time, power, incident), duration(time, -power, primary)
        yield back / there * waves.primary.amplitude_ratio ** (1.0 / 6.0)


def duration(time: np.ndarray, power: np.ndarray, peak: int) -> float:
    """Return the time in which 5 to 95 % of the energy of the pulse around a peak of force passes, s."""
    low = np.flatnonzero(power < 0.02 * power[peak])
    begin, end = low[low < peak].max(initial=0), low[low > peak].min(initial=time.size - 1)
    passed = np.cumsum(power[begin:end]) / power[begin:end].sum()
    return float(np.subtract(*np.interp([0.95, 0.05], passed, time[begin:end])))


def on_a_spring(count: int = 70, interval: float = 1e-7) -> str:
    random, worst = np.random.default_rng(SEED), []
    while len(worst) < count:
        chain = chain_of(random, FAMILIES[random.integers(4)])
        mass, stiffness = 10.0 ** random.uniform(-3.0, -1.0), 10.0 ** random.uniform(6.0, 8.0)
        spring = hl.from_matrices([[mass]], [[stiffness]], hl.STEEL_440C, [1.0])
        run = hl.CoSimulation(chain, spring).run(1.5e-3)
        reference = monolithic([chain], [spring], [Contact(0, "last", 0)], np.arange(0.0, 1.5e-3, interval))[0]
        ours, theirs = (hl.reflections(one, SENSOR).primary for one in (run, reference))
        if ours and theirs and ours.amplitude_ratio > 0.1:
            worst.append(
                (abs(ours.amplitude_ratio - theirs.amplitude_ratio), abs(ours.time_of_flight - theirs.time_of_flight))
            )
    ratio, flight = np.array(worst).T
    beyond = np.count_nonzero((ratio > 1.1e-5) | (flight > 4e-9))
    return (
        f"{count} on a spring: AR within {ratio.max():.1e}, TOF within {1e6 * flight.max():.3f} µs; "
        f"{beyond} beyond 1.1e-5, 0.004 µs"
    )


def scans() -> str:
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * BEADS, bead, 0.31)

    def at(distance: float) -> hl.CoSimulation:
        return hl.CoSimulation(chain, hl.half_plane(2e-3, hl.BRASS_360, "free", distance, UNTIL))

    search = partial(hl.critical_distance_search, at, UNTIL, SENSOR, tolerance=TOLERANCE)
    truth = search(distances=np.geomspace(2e-3, 0.2, 120)).critical_distance.item()
    random, right, warned = np.random.default_rng(SEED), 0, 0
    for _ in range(SCANS):
        first, last, count = random.uniform(3e-3, 15e-3), random.uniform(0.1, 0.2), int(random.integers(4, 13))
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = search(distances=np.linspace(first, last, count))
        low, high = found.bracket.values
        inside = low - 5e-5 <= truth <= high + 5e-5
        right, warned = right + inside, warned + (not inside and any("critical" in str(c.message) for c in caught))
    return f"{SCANS} scans: {right} bracket {1e3 * truth:.2f} mm, {warned} of the others are warned of"


if __name__ == "__main__":
    warnings.simplefilter("ignore", hl.HertzlinkWarning)
    print(agreement(int(sys.argv[1]) if len(sys.argv) > 1 else COUNT), flush=True)
    last = list(lengths())
    print(f"{len(last)} single waves last {min(last):.2f} to {max(last):.2f}", flush=True)
    print(on_a_spring(), flush=True)
    print(scans())
