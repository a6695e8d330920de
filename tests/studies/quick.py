"""Quick runs of the studies, each made once for all tests, and what they find."""

from functools import cache

import xarray as xr

from hertzlink.studies import study
from hertzlink.studies.compare import Case, as_cases


@cache
def quick(name: str) -> xr.Dataset:
    """The data of a quick run."""
    return study(name).run(quick=True, jobs=1)


@cache
def found(name: str) -> dict[str, dict[str, Case]]:
    """The numbers of a quick run by their names and conditions."""
    return {number.name: as_cases(number.ours) for number in study(name).numbers(quick(name))}
