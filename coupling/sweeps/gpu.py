"""Runs of a family on a GPU of NVIDIA, one in each thread: the pieces of a processor, compiled by numba-cuda."""

from typing import Any

import numpy as np
from numba import cuda

from coupling.kernels.families import Family, do_run
from coupling.results.wave_kernels import SPLINE_ROWS, WIDTH, waves_over_bead
from structures.kernels.families import Columns
from structures.structure import Vector

THREADS = 32
"""Threads of a block. They share nothing, so that larger blocks are no faster."""

MOST_AT_ONCE = 131_072
"""Runs at a time; more are no faster."""

PART_OF_MEMORY = 0.8
"""Of the free memory of the GPU, what runs may take."""


@cuda.jit
def do(family: Any, runs: int, moving: int, begin: Vector, window: float, windows: Any, ended: Vector) -> None:
    """Do one run of a family."""
    number = cuda.grid(1)  # type: ignore[attr-defined]
    if number < runs:
        do_run(family, number, moving, begin, window, windows, ended)


@cuda.jit
def measure(
    time: Vector, force: Vector, static: Vector, velocity: Vector, seats: Vector, smallest: float, out: Vector,
    counts: Vector, work: Any,
) -> None:  # fmt: skip
    """Measure the waves of one run, see `waves`."""
    number = cuda.grid(1)  # type: ignore[attr-defined]
    if number < counts.shape[1]:
        for contact in range(static.size):
            for i in range(time.size):
                force[i, contact, number] -= static[contact]
        for sensor in range(seats.shape[0]):
            counts[sensor, number] = waves_over_bead(
                time, force[:, seats[sensor, 0], number], force[:, seats[sensor, 1], number],
                velocity[:, seats[sensor, 2], number], smallest, out[sensor, :, :, number],
                work[0][:, :, number], work[1][:, :, number], work[2][:, :, number],
            )  # fmt: skip


def free_memory() -> float:
    """Return the memory that runs may take, B."""
    return PART_OF_MEMORY * float(cuda.current_context().get_memory_info()[0])  # type: ignore[no-untyped-call]


def column(values: Vector) -> Any:
    """Return numbers whose last axis is that of the runs, on the GPU; those of all runs as they are."""
    if values.shape[-1] == 1:
        return np.ascontiguousarray(values[..., 0]) if values.ndim > 1 else float(values[0])
    return Columns(cuda.to_device(np.ascontiguousarray(values)))


def columns(part: Any, runs: int) -> Any:
    """Return a piece whose arrays have a column for each run, on the GPU, without values."""
    if isinstance(part, np.ndarray):
        # In the simulator, only elements of the type np.record have fields as attributes.
        kind = np.dtype((np.record, part.dtype)) if part.dtype.names else part.dtype
        return Columns(cuda.device_array((*part.shape, runs), kind))
    return type(part)(*(columns(field, runs) for field in part))


def on_device(part: Any) -> Any:
    """Return a piece whose arrays lie on the GPU."""
    if isinstance(part, np.ndarray):
        return cuda.to_device(part)
    if isinstance(part, tuple) and not isinstance(part, Columns):
        parts = [on_device(field) for field in part]
        return type(part)(*parts) if hasattr(part, "_fields") else tuple(parts)
    return part


def do_runs(family: Family, runs: int, rest: tuple[Any, ...]) -> Vector:
    """Do the runs of a family, whose arrays lie on the GPU; return how each ended.

    rest: the other arguments of `do_run`.
    """
    ended = cuda.to_device(np.zeros(runs, np.int64))
    do[(runs + THREADS - 1) // THREADS, THREADS](family, runs, *on_device(rest), ended)
    return np.asarray(ended.copy_to_host())


def waves(
    force: Columns, velocity: Columns, time: Vector, static: Vector, seats: Vector, smallest: float, most: int
) -> Vector:
    """Return amplitude (N), arrival (s) and origin of the waves at sensors, runs × sensors × waves × 3; NaN for none.

    force, velocity: saved times × contacts or bodies; the forces lose their static part. seats: of each sensor the
    places of its two contacts and of its body.
    """
    runs, peaks, sensors = force.values.shape[2], time.size // 2 + 1, len(seats)
    out, counts = cuda.device_array((sensors, most, 3, runs)), cuda.device_array((sensors, runs), np.int64)
    work = [
        cuda.device_array((*shape, runs), kind)
        for shape, kind in (((peaks, 4), np.int64), ((2, peaks), np.int64), ((SPLINE_ROWS, WIDTH), float))
    ]
    arrays = on_device((time, force.values, static, velocity.values, seats))
    measure[(runs + THREADS - 1) // THREADS, THREADS](*arrays, smallest, out, counts, tuple(work))
    values = np.moveaxis(out.copy_to_host(), -1, 0)
    return np.where((np.arange(most) < counts.copy_to_host().T[..., None])[..., None], values, np.nan)


def bytes_of(part: Any) -> float:
    """Return the size of the arrays of a piece, B."""
    return float(part.nbytes) if isinstance(part, np.ndarray) else float(sum(map(bytes_of, part)))
