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
bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
simulation = hl.CoSimulation(hl.Chain([bead] * 2, bead, 0.3), None)
for _ in range(2):
    simulation.run(2e-5, save_every=1e-6)
"""


@pytest.mark.thorough
def test_the_first_run_says_that_it_compiles(tmp_path: Path) -> None:
    """One line, however many kernels; a second process finds them and says nothing."""
    said = []
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-W", "ignore", "-c", COMPILES], env={**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)},
            capture_output=True, text=True, check=True,
        )  # fmt: skip
        said.append(done.stderr)
    assert said == [f"{kernel_cache.COMPILING}\n", ""]


@pytest.mark.thorough
def test_a_plain_run_compiles_no_other_integrator(tmp_path: Path) -> None:
    """Nor anything for beads that vibrate, or for several contacts."""
    code = """
import hertzlink as hl
from particles import kernels
bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
hl.CoSimulation(hl.Chain([bead] * 2, bead, 0.3), hl.half_space(hl.STEEL_440C)).run(until=1e-5)
names = "_verlet _driven_verlet _viscous_verlet _lossy_verlet _rk4 _accelerate_vibrating _agree".split()
print([name for name in names if getattr(kernels, name).signatures])
"""
    settings = {**os.environ, "NUMBA_CACHE_DIR": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=settings, capture_output=True, text=True)
    assert done.stdout.splitlines() == ["['_verlet']"], done.stderr
