"""Linear algebra takes one thread in a reduction, and as many as before afterwards."""

from collections.abc import Iterator

import pytest
import scipy.linalg
from threadpoolctl import threadpool_info, threadpool_limits

import hertzlink as hl


def threads() -> set[int]:
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@pytest.fixture(autouse=True)
def two() -> Iterator[None]:
    """Two threads, as on a machine with two cores, whatever this machine and its environment have."""
    with threadpool_limits(2, "blas"):
        if threads() != {2}:
            pytest.skip(f"this BLAS takes {threads()} threads where two are asked for")
        yield


def test_a_reduction_and_what_runs_within_it(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[set[int]] = []

    def counted(*args: object, **kwargs: object) -> object:
        seen.append(threads())
        return scipy.linalg.eigh(*args, **kwargs)

    monkeypatch.setattr("structures.krylov.eigh", counted)
    hl.reduce(hl.rod([hl.Layer(hl.PTFE, 0.05, 9.525e-3)]), until=1e-4)
    assert seen
    assert all(found == {1} for found in seen)
    assert threads() == {2}
