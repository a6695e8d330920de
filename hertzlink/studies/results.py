"""Datasets of studies: what is computed over some axes; names and units of variables."""

from collections.abc import Callable, Sequence
from itertools import product
from typing import Any

import joblib
import xarray as xr

from coupling.sweeps.progress import watched


def over(compute: Callable[..., xr.Dataset], jobs: int = 1, **axes: Sequence[Any]) -> xr.Dataset:
    """Return what is computed at each combination of the values of some axes, with these as dimensions.

    As `hl.sweep`, for functions that return more than one run gives. Where a part lacks a place of another one, it is
    NaN there. jobs: processes.
    """
    points = [dict(zip(axes, values, strict=True)) for values in product(*axes.values())]
    parallel = joblib.Parallel(min(jobs, len(points)), return_as="generator")
    parts: list[xr.Dataset] = list(watched(parallel(joblib.delayed(compute)(**point) for point in points), len(points)))
    for name, values in reversed(axes.items()):
        rows = [parts[i : i + len(values)] for i in range(0, len(parts), len(values))]
        parts = [xr.concat(row, name, join="outer").assign_coords({name: list(values)}) for row in rows]
    return parts[0]


def scalars(**values: tuple[float, str, str]) -> xr.Dataset:
    """Return single numbers as variables. values: number, unit and long name of each."""
    return xr.Dataset(
        {name: ((), value, {"units": unit, "long_name": words}) for name, (value, unit, words) in values.items()}
    )


def named(data: xr.Dataset, prefix: str) -> xr.Dataset:
    """Return the variables under names with a prefix."""
    return data.rename({name: f"{prefix}_{name}" for name in data.data_vars})


def with_units(data: xr.Dataset, **units: str) -> xr.Dataset:
    """Return the Dataset after giving units to its axes."""
    for name, unit in units.items():
        data[name].attrs["units"] = unit
    return data
