"""Compiled kernels need a folder of their own where the user has none."""

import atexit
import shutil
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
