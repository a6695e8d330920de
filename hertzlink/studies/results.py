"""Datasets of studies: what is computed over some axes; names and units of variables."""

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any

import joblib
import xarray as xr

from coupling.sweeps.progress import watched
from structures.checks import whole


def each(compute: Callable[..., Any], cases: Sequence[Mapping[str, Any]], jobs: int | None = 1) -> list[Any]:
    """Return what is computed for each case, its arguments. jobs: processes, None for one on each core."""
    count = joblib.cpu_count() if jobs is None else whole("jobs", jobs)
    parallel = joblib.Parallel(max(1, min(count, len(cases))), return_as="generator")
    return list(watched(parallel(joblib.delayed(compute)(**case) for case in cases), len(cases)))


def over(compute: Callable[..., xr.Dataset], jobs: int | None = 1, **axes: Sequence[Any]) -> xr.Dataset:
    """Return what is computed at each combination of the values of some axes, with these as dimensions.

    As `hl.sweep`, for functions that return more than one run gives. Where a part lacks a place of another one, it is
    NaN there. jobs: as of `each`.
    """
    cases = [dict(zip(axes, values, strict=True)) for values in product(*axes.values())]
    parts: list[xr.Dataset] = each(compute, cases, jobs)
    for name, values in reversed(axes.items()):
        rows = [parts[i : i + len(values)] for i in range(0, len(parts), len(values))]
        parts = [xr.concat(row, name, join="outer").assign_coords({name: list(values)}) for row in rows]
    return parts[0]


def scalars(**values: tuple[float | xr.DataArray, str, str]) -> xr.Dataset:
    """Return single numbers as variables. values: number, unit and long name of each."""
    return xr.Dataset(
        {name: ((), float(value), {"units": unit, "long_name": words}) for name, (value, unit, words) in values.items()}
    )


def named(data: xr.Dataset, prefix: str) -> xr.Dataset:
    """Return the variables under names with a prefix."""
    return data.rename({name: f"{prefix}_{name}" for name in data.data_vars})


def with_units(data: xr.Dataset, **units: str) -> xr.Dataset:
    """Return the Dataset after giving units to its axes."""
    for name, unit in units.items():
        data[name].attrs["units"] = unit
    return data
