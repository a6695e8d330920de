"""The way from a file of results back to the case that it came from, and the command that repeats it."""

import json
from pathlib import Path
from typing import Any

import xarray as xr

from coupling.files.user_files import read_netcdf
from hertzlink.cases.faults import CaseError
from hertzlink.cases.rebuilt import from_input

TRACE = "trace"
"""The attribute of an identification that names the file of its signal."""


def case_again(file: Path) -> tuple[str, str]:
    """Return text of the case of a result, and the name of the signal's file where the case was identified from one.

    A ValueError that says in one line what else the file holds.
    """
    data = read_netcdf(file)
    if "case" in data.attrs:
        return str(data.attrs["case"]), str(data.attrs.get(TRACE, ""))
    inputs = _input(data)
    if "verdict" in data:
        raise CaseError(f"{file}: is an identification made in Python, which has no case; `hertzlink new identify`")
    if "study" in inputs:
        name = inputs["study"]
        raise CaseError(f"{file}: is a study, which has no case; `hertzlink study {name}` repeats it")
    try:
        return from_input(data).to_toml(), ""
    except ValueError as error:
        raise CaseError(f"{file}: {str(error).removeprefix('given: ')}") from error


def _input(data: xr.Dataset) -> dict[str, Any]:
    try:
        inputs = json.loads(str(data.attrs.get("input", "{}")))
    except ValueError:
        return {}
    return inputs if isinstance(inputs, dict) else {}
