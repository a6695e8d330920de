"""Compiled kernels need a folder of their own where the user has none."""

import atexit
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import numba
import pytest

from particles import kernel_cache


def test_without_a_folder_kernels_get_a_private_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """As in a read-only installation without a home folder."""

    def nowhere(function: Any) -> None:
        raise RuntimeError("cannot cache function: no locator available")

    ends: list[tuple[Any, ...]] = []
    monkeypatch.setattr(kernel_cache, "FunctionCache", nowhere)
    monkeypatch.setattr(atexit, "register", lambda *call, **keywords: ends.append(call))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    kernel_cache.provide()
    folder = Path(numba.config.CACHE_DIR)
    assert folder.is_dir()
    assert folder.stat().st_mode & 0o077 == 0
    assert ends == [(shutil.rmtree, str(folder))]
    folder.rmdir()


def test_a_folder_that_works_stays(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))
    kernel_cache.provide()
    assert str(tmp_path) == numba.config.CACHE_DIR


COMPILES = """
import hertzlink as hl
from particles import kernels
bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
simulation = hl.CoSimulation(hl.Chain([bead] * 2, bead, 0.3), hl.half_space(hl.STEEL_440C))
for _ in range(2):
    simulation.run(2e-5, save_every=1e-6)
names = "_verlet _driven_verlet _viscous_verlet _lossy_verlet _rk4 _accelerate_vibrating _agree".split()
print([name for name in names if getattr(kernels, name).signatures])
"""


@pytest.fixture(scope="module")
def processes(tmp_path_factory: pytest.TempPathFactory) -> list[subprocess.CompletedProcess[str]]:
    """Two, one after the other, with a folder for kernels that is empty at first."""
    settings = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path_factory.mktemp("kernels"))}
    command = [sys.executable, "-W", "ignore", "-c", COMPILES]
    return [subprocess.run(command, env=settings, capture_output=True, text=True, check=True) for _ in range(2)]


@pytest.mark.thorough
def test_the_first_run_says_that_it_compiles(processes: list[subprocess.CompletedProcess[str]]) -> None:
    """One line, however many kernels; a second process finds them and says nothing."""
    assert [one.stderr for one in processes] == [f"{kernel_cache.COMPILING}\n", ""]


@pytest.mark.thorough
def test_a_plain_run_compiles_no_other_integrator(processes: list[subprocess.CompletedProcess[str]]) -> None:
    """Nor anything for beads that vibrate, or for several contacts."""
    assert processes[0].stdout.splitlines() == ["['_verlet']"]
