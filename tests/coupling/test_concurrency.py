"""Threads that run one simulation, and processes that receive a simulation, give the same bits."""

import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial

import numpy as np
import pytest

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
UNTIL = 1.5e-4


class Windowed(hl.stepping.MovingStructure):
    """Goes window by window, as large structures do."""

    compact = False


def simulation(reduced: bool, scheme: object) -> hl.CoSimulation:
    """A short chain on a rod, which a wave reaches and leaves."""
    rod = hl.rod([hl.Layer(hl.PTFE, 0.05, 9.525e-3)], base="fixed", elements=8)
    chain = hl.Chain([BEAD] * 4, striker=BEAD, impact_speed=0.31, dissipation=hl.LinearDashpot(5.0))
    body = hl.reduce(rod, until=UNTIL) if reduced else Windowed(rod)
    return hl.CoSimulation(chain, body, scheme)


def forces(shared: hl.CoSimulation, save_every: float = 1e-6) -> np.ndarray:
    """Contact forces of one run, N."""
    return np.asarray(shared.run(UNTIL, save_every=save_every).contact_force)


CASES = {
    "compiled": (True, hl.Condensed()), "windows": (False, hl.Condensed()), "iterated": (False, hl.IQN_ILS()),
}  # fmt: skip


@pytest.mark.parametrize(
    "name", ["compiled", *(pytest.param(name, marks=pytest.mark.thorough) for name in ("windows", "iterated"))]
)
def test_threads_share_a_simulation(name: str) -> None:
    """Eight runs in four threads, with two lengths of window between saved times; none was run before."""
    lengths, (reduced, scheme) = [1e-6, 1.5e-6] * 4, CASES[name]
    expected = {length: forces(simulation(reduced, scheme), length) for length in set(lengths)}
    shared = simulation(reduced, scheme)
    with ThreadPoolExecutor(4) as threads:
        found = list(threads.map(partial(forces, shared), lengths))
    for length, force in zip(lengths, found, strict=True):
        assert np.array_equal(force, expected[length])


@pytest.mark.thorough
@pytest.mark.filterwarnings("ignore:.*multi-threaded, use of fork:DeprecationWarning")
@pytest.mark.parametrize("method", ["spawn", "fork"])
def test_processes_take_simulations_along(method: str) -> None:
    """Before and after a run in this process."""
    with ProcessPoolExecutor(1, multiprocessing.get_context(method)) as processes:
        for reduced, scheme in CASES.values():
            shared = simulation(reduced, scheme)
            before = processes.submit(forces, shared).result()
            expected = forces(shared)
            after = processes.submit(forces, shared).result()
            assert np.array_equal(before, expected)
            assert np.array_equal(after, expected)
