"""Runs that are killed or broken off and go on from their checkpoints: the cases, and a victim's process."""

import math
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import xarray as xr

import hertzlink as hl
from coupling import run_loop
from coupling.recording import checkpoint
from structures.damping import Rayleigh

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 4, BEAD, 0.31, dissipation=hl.LinearDashpot(5.0))
PUSHED = hl.Chain([BEAD] * 4, hl.PushedBead([0.0, 1e-5, 2e-5], [0.0, 50.0, 0.0]), preload=1.0)
ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], elements=8)
DAMPED = hl.damped(ROD, Rayleigh(5e2, 1e-7))
ABSORBED = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing", elements=8)
UNTIL = 1.6e-4


@dataclass(frozen=True)
class SpringMass:
    """A black box: one mass (kg) on one spring (N/m), exact under a constant force."""

    mass: float = 0.0141
    stiffness: float = 1.7e7
    surface = hl.Surface(hl.PTFE)

    def start(self) -> tuple[float, float]:
        return 0.0, 0.0

    def advance(self, state: tuple[float, float], force: float, window: float) -> tuple[Any, float]:
        omega, rest = math.sqrt(self.stiffness / self.mass), force / self.stiffness
        (x, v), c, s = state, math.cos(omega * window), math.sin(omega * window)
        x, v = rest + (x - rest) * c + v * s / omega, v * c - (x - rest) * s * omega
        return (x, v), x


def _two_on_a_plate() -> hl.CoSimulation:
    supports = hl.Supports("clamped", "clamped", "free", "free")
    plate = hl.kirchhoff_plate(0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, supports, cells=(4, 4))
    other = hl.Chain([BEAD] * 3, BEAD, 0.2)
    return hl.CoSimulation([CHAIN, other], plate.at([0.05, 0.15], [0.1, 0.1]), window=2e-6)


def _pushed_between_two() -> hl.CoSimulation:
    return hl.CoSimulation(PUSHED, ROD, behind=DAMPED, waveform="quadratic")


CASES: dict[str, tuple[Callable[[], hl.CoSimulation], dict[str, float]]] = {
    "full order": (lambda: hl.CoSimulation(CHAIN, ROD, window=1.2e-6), {}),
    "saved now and then": (lambda: hl.CoSimulation(CHAIN, ROD), {"save_every": 4e-6}),
    "reduced": (lambda: hl.CoSimulation(CHAIN, hl.reduce(DAMPED, until=UNTIL)), {"save_every": 1e-6}),
    "coupled by damping": (lambda: hl.CoSimulation(PUSHED, ABSORBED, window=1.2e-6), {}),
    "Aitken": (lambda: hl.CoSimulation(CHAIN, SpringMass(), hl.Aitken(), 1e-6), {}),
    "IQN-ILS": (lambda: hl.CoSimulation(CHAIN, SpringMass(), hl.IQN_ILS(reuse=4), 2e-6, substeps=2), {}),
    "windows in pieces": (
        lambda: hl.CoSimulation(CHAIN, SpringMass(mass=1e-3), hl.IQN_ILS(largest_count=3), 4e-6, substeps=8),
        {"save_every": 3e-6},
    ),
    "windows between saved times": (
        lambda: hl.CoSimulation(CHAIN, SpringMass(), hl.IQN_ILS(), 2e-6, substeps=4),
        {"save_every": 3.5e-6},
    ),
    "explicit": (
        lambda: hl.CoSimulation(CHAIN, SpringMass(), hl.Explicit(2, True, 0.05), 6e-7, substeps=1),
        {},
    ),
    "two chains on a plate": (_two_on_a_plate, {}),
    "between two structures": (_pushed_between_two, {}),
    "adaptive": (lambda: hl.CoSimulation(CHAIN, DAMPED, window=hl.Adaptive(1e-5)), {"save_every": 2e-6}),
    "generalised alpha": (
        lambda: hl.CoSimulation(CHAIN, hl.stepping.MovingStructure(ROD, "generalised-alpha"), window=1.2e-6),
        {},
    ),
}


def run(name: str, path: Path | None = None) -> xr.Dataset:
    """A case, with a checkpoint wherever there can be one, or without."""
    make, keywords = CASES[name]
    with often():
        return make().run(UNTIL, checkpoint=path, **keywords)  # type: ignore[arg-type]


@contextmanager
def often() -> Iterator[None]:
    """Checkpoints as often as can be, and not waited for: what a process wrote outlives it, if not a loss of power."""
    with (
        patch.object(checkpoint, "INTERVAL", 0.0),
        patch.object(checkpoint, "PAUSE", 0.0),
        patch.object(run_loop, "CHUNK", 1),
        patch.object(os, "fsync", lambda _: None),
    ):
        yield


def counted(work: Callable[[], Any], most: float = np.inf) -> int:
    """The calls and returns of all functions in `work`; after `most` of them the process kills itself."""
    count = 0

    def note(*_: object) -> None:
        nonlocal count
        count += 1
        if count > most:
            os.kill(os.getpid(), signal.SIGKILL)

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def fine(path: Path | None) -> xr.Dataset:
    """A run with so many saved times that its checkpoint takes megabytes."""
    return hl.CoSimulation(CHAIN, hl.reduce(DAMPED, until=UNTIL)).run(UNTIL, 5e-9, checkpoint=path)


def fine_and_often(path: Path) -> None:
    """It, with far too many checkpoints."""
    with often():
        run_loop.CHUNK = 100
        fine(path)


def victim(name: str, path: Path, most: int) -> None:
    """Run a case until it is killed; what is compiled and cached is so before."""
    run(name)
    counted(lambda: run(name, path), most)
