"""Speed of the chain's kernels: laws compared with Hertz's, losses compared with none, batches on one and on two cores.

    python benchmarks/chains.py [--quick]

All chains are 20 spheres of 440C. Either they are struck at 0.44 m/s, or they are pressed together by 10 µm at each
contact between two end beads that are too heavy to move, and vibrate at random. Rates are particle-steps/s of wall
time; ratios are medians over rounds in which the cases alternate.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import sqrt
from statistics import median
from time import perf_counter
from typing import Any, NamedTuple

import joblib
import numpy as np

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
STEP, STEPS, BEADS = 1e-7, 10_000, 20
CHAINS = 2_000
OVERLAP, TREMOR = 1e-5, 0.05
POINTS = np.geomspace(1e-9, 1e-3, 60)
HERTZ = hl.contact_law(BEAD, BEAD)

LAWS: dict[str, hl.ContactLaw] = {
    "power": hl.laws.PowerLaw(1e9, 1.4),
    "table": hl.laws.TabulatedLaw(POINTS, HERTZ.force(POINTS)),
}  # type: ignore[arg-type]
LOSSES = {
    "LinearDashpot": hl.LinearDashpot(5.0),
    "PowerDashpot": hl.PowerDashpot(5.0, 1.8),
    "thesis's form": hl.PowerDashpot(5.0, 1.8, "thesis"),
    "MassProportional": hl.MassProportional(6900.0),
    "KuwabaraKono": hl.KuwabaraKono(1e-6),
    "Restitution": hl.Restitution(0.9),
}


class OwnHertz(NamedTuple):
    """Hertz's law as a user's piece."""

    stiffness: Any

    @staticmethod
    def force(law: Any, i: int, overlap: float) -> float:
        return float(law.stiffness[i] * overlap * sqrt(overlap)) if overlap > 1e-60 else 0.0

    @staticmethod
    def slope(law: Any, i: int, overlap: float) -> float:
        return float(1.5 * law.stiffness[i] * sqrt(overlap)) if overlap > 1e-60 else 0.0

    @staticmethod
    def energy(law: Any, i: int, overlap: float) -> float:
        return float(0.4 * law.stiffness[i] * overlap**2 * sqrt(overlap)) if overlap > 1e-60 else 0.0


@dataclass(frozen=True)
class OwnLaw(hl.ContactLaw):
    stiffness: float
    piece = OwnHertz

    def force(self, approach: Any) -> Any:
        return self.stiffness * np.maximum(approach, 0.0) ** 1.5


class OwnForm(NamedTuple):
    """A dashpot as a user's piece."""

    coefficient: Any

    @staticmethod
    def with_loss(loss: Any, i: int, elastic: float, slope: float, overlap: float, rate: float) -> float:
        return max(elastic + loss.coefficient[i] * rate, 0.0)


@dataclass(frozen=True)
class OwnLoss(hl.Dissipation):
    viscosity: float
    piece = OwnForm

    def coefficients(self, mass: Any) -> Any:
        return np.full_like(mass, self.viscosity)


LAWS["own"] = OwnLaw(float(HERTZ.force(np.array(1.0))))
OWN_LOSSES = {"LinearDashpot": hl.LinearDashpot(5.0), "own": OwnLoss(5.0)}
YIELDING = {"Thornton": hl.laws.Thornton(3e8), "Jackson and Green": hl.laws.JacksonGreen(3e8)}
TARGETS = {"own": 1.2, "power": 4.0, "table": 3.0, "Thornton": 3.0, "Jackson and Green": 3.0}

Run = Callable[[], None]


def advanced(chain: hl.Chain, position: np.ndarray | None = None, velocity: np.ndarray | None = None) -> Run:
    """All steps of one chain in one window."""
    moving = hl.stepping.MovingChain(chain, None, dt=STEP)
    start = moving.start()
    if position is not None and velocity is not None:
        start = start._replace(position=position, velocity=velocity)
    moving.advance(start, (0.0, 0.0), STEP)  # Compiles the kernels, or loads compiled ones.
    return lambda: moving.advance(start, (0.0, 0.0), STEPS * STEP) and None


def impact(law: hl.ContactLaw | hl.laws.YieldingLaw | None = None, loss: object = None) -> Run:
    """Most contacts open."""
    return advanced(hl.Chain([BEAD] * BEADS, BEAD, 0.44, law=law, dissipation=loss))  # type: ignore[arg-type]


def closed(law: hl.ContactLaw | None = None) -> Run:
    """All contacts closed."""
    heavy = hl.Sphere(BEAD.radius, replace(BEAD.material, density=1e12 * BEAD.material.density))
    chain = hl.Chain([*[BEAD] * (BEADS - 1), heavy], heavy, 1e-9, law=law)
    velocity = np.random.default_rng(1).uniform(-TREMOR, TREMOR, BEADS + 1)
    velocity[[0, -1]] = 0.0
    return advanced(chain, -OVERLAP * np.arange(BEADS + 1.0), velocity)


def seconds(runs: dict[str, Run], rounds: int, least: float = 0.05) -> dict[str, list[float]]:
    """Times of each run, one value for each round; within a round a run is repeated for at least this long."""
    spent: dict[str, list[float]] = {name: [] for name in runs}
    for _ in range(rounds):
        for name, run in runs.items():
            begin, count = perf_counter(), 0
            while perf_counter() - begin < least:
                run()
                count += 1
            spent[name].append((perf_counter() - begin) / count)
    return spent


def compare(title: str, runs: dict[str, Run], rounds: int) -> None:
    """Print rates, and the time of each run relative to the first."""
    spent = seconds(runs, rounds)
    first = spent[next(iter(runs))]
    print(title)
    for name, times in spent.items():
        ratio = median(one / other for one, other in zip(times, first, strict=True))
        target = f"(≤ {TARGETS[name]:g}, {'met' if ratio <= TARGETS[name] else 'MISSED'})" if name in TARGETS else ""
        print(f"    {name:18s} {(BEADS + 1) * STEPS / median(times):8.2e}   {ratio:5.2f} times the first  {target}")


def batches(rounds: int) -> None:
    """A batch of different chains, set-up included, on one core and on two."""
    sizes = np.random.default_rng(0).uniform(0.9, 1.1, CHAINS)
    beads = [hl.Sphere(4.76e-3 * size, hl.STEEL_440C) for size in sizes]

    def alone(bead: hl.Sphere) -> hl.CoSimulation:
        return hl.CoSimulation(hl.Chain([bead] * BEADS, bead, 0.44), None, dt=STEP / 4)

    def run(threads: int) -> Run:
        return lambda: hl.batch(alone, STEPS * STEP, save_every=1e-5, sensors=[7], threads=threads, bead=beads) and None

    hl.batch(alone, 1e-5, save_every=1e-5, sensors=[7], bead=beads[:2])
    spent = seconds({"one": run(1), "two": run(2)}, rounds)
    rate = CHAINS * (BEADS + 1) * STEPS * 4 / median(spent["one"])
    ratio = median(one / two for one, two in zip(spent["one"], spent["two"], strict=True))
    verdicts = ["met" if good else "MISSED" for good in (rate >= 5e8, ratio >= 1.8)]
    print(f"batch of {CHAINS} chains of {BEADS} beads, {STEPS * 4} steps, set-up included")
    print(
        f"    one core {rate:8.2e} (≥ 5e8, {verdicts[0]});  two cores {ratio:.2f} times faster (≥ 1.8, {verdicts[1]})"
    )


def main() -> None:
    """Print everything."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    rounds = 3 if parser.parse_args().quick else 9
    print(f"particle-steps/s, {joblib.cpu_count()} cores; medians of {rounds} interleaved rounds\n")
    compare("20 beads, impact", {"Hertz": impact(), **{name: impact(law) for name, law in LAWS.items()}}, rounds)
    compare(
        "20 beads that yield, impact", {"Hertz": impact(), **{n: impact(law) for n, law in YIELDING.items()}}, rounds
    )
    compare("20 beads, all contacts closed", {"Hertz": closed(), **{n: closed(law) for n, law in LAWS.items()}}, rounds)
    compare("losses, impact", {"none": impact(), **{n: impact(loss=loss) for n, loss in LOSSES.items()}}, rounds)
    compare("a user's loss as a piece, impact", {n: impact(loss=loss) for n, loss in OWN_LOSSES.items()}, rounds)
    batches(3 if rounds == 3 else 5)


if __name__ == "__main__":
    main()
