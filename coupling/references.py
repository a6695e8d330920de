"""Regression tests of users: a result is compared with a file that an earlier version wrote."""

import json
import os
from collections.abc import Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from coupling.file_paths import path_of
from coupling.files.writing import write_whole
from coupling.results import same_waves
from coupling.results.findings import one_of_each, warn
from coupling.results.provenance import differences, unfolded, version_of, versions
from coupling.results.reading import Reading
from structures.caution import collected
from structures.checks import instance, not_negative, one_of, short, whole
from structures.hdf5 import check_hdf5

FORMAT, VERSION = "hertzlink reference", 1

UPDATE = "HERTZLINK_UPDATE_REFERENCES"
"""The environment variable that `pytest --update-references` sets."""

MOST_INPUTS = 8
"""So many differences of the input are listed."""

Tolerance = float | Mapping[str, float]


def assert_same_waves(
    run: xr.Dataset,
    reference: str | os.PathLike[str],
    rtol: float | Mapping[str, float] = 1e-5,
    atol: float | Mapping[str, float] = 0.0,
    sensors: Sequence[int] | None = None,
    update: bool | None = None,
) -> None:
    """Compare the waves of a result with a reference that was saved, for a regression test.

    Parameters
    ----------
    run : Dataset
        A run, a sweep, a batch or a measured signal.
    reference : path
        The netCDF file of the reference.
    rtol : float or mapping
        Relative tolerance. A mapping gives it by kind: "amplitude_ratio", "time_of_flight", "force"; kinds that it
        does not name have 1e-5.
    atol : float or mapping
        Absolute tolerance, which is added: for AR a number, for TOF in s, for a force in N. By kind as `rtol`; kinds
        that it does not name have 0.
    sensors : list of int, optional
        Numbers of the beads whose waves count. By default those of the reference; where it is written, the bead in the
        middle of the chain, or all sensors of a signal.
    update : bool, optional
        True writes the reference, whole or not at all, and compares nothing. By default the environment variable
        HERTZLINK_UPDATE_REFERENCES decides, which `pytest --update-references` sets.

    Returns
    -------
    None
        Where all quantities agree.

    Raises
    ------
    AssertionError
        If a quantity differs by more than atol + rtol · |reference|. The message lists the quantities that differ, and
        whether input or versions differ.
    ValueError
        If the reference is missing or is none, or an argument is wrong.

    Notes
    -----
    What is compared: AR and TOF of the primary and the secondary wave at each sensor, and the forces over time at the
    sensors and at the last contact of the chain. Of forces the root mean square of the difference is compared with that
    of the reference. If the saved times differ, forces are interpolated. A wave that only one of them has is a
    difference. In a sweep or a batch the worst run counts.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> hl.testing.assert_same_waves(run, "wall.nc", update=True)
    >>> hl.testing.assert_same_waves(run, "wall.nc", rtol=1e-6)
    """
    # pytest shows the table of differences, not this code.
    __tracebackhide__ = True
    path = path_of("reference", reference, "path of a netCDF file")
    relative, absolute = _by_kind("rtol", rtol, 1e-5), _by_kind("atol", atol, 0.0)
    write = os.environ.get(UPDATE, "") not in ("", "0") if update is None else _switch(update)
    _check(run)
    old = None if write else _read(path)
    listed_sensors = None if old is None else [int(number) for number in np.atleast_1d(old.attrs["sensors"])]
    chosen = _sensors(sensors) or listed_sensors or same_waves.default_sensors(run)
    with collected() as findings:
        now = same_waves.kept_waves(run, chosen)
    warn(one_of_each(findings))
    if old is None:
        _write(path, _described(now, run, chosen))
        return
    complaint = _complaint(old, now, run, (relative, absolute))
    if complaint:
        raise AssertionError(f"the waves differ from those in {path}:\n" + "\n".join(complaint))


def _check(run: object) -> None:
    """Raise a ValueError for what has no forces over increasing times."""
    data = Reading(run).data
    times = data["time"].values if "time" in data.coords else np.empty(0)
    if times.dtype.kind not in "iuf" or times.size < 2 or not (np.diff(times) > 0.0).all():
        raise ValueError("run: must have two or more saved times, in increasing order")
    for name in ("contact_force", "sensor_force"):
        if name in data and data[name].dtype.kind not in "iuf":
            raise ValueError(f"run: {name} must be real numbers")


def _complaint(old: xr.Dataset, now: xr.Dataset, run: xr.Dataset, tolerances: Any) -> list[str]:
    """Return the lines of the message; none where all agrees."""
    lines, record = same_waves.shapes(old, now), same_waves.records(old, now)
    if not lines:
        rows = list(same_waves.rows(old, now, *tolerances))
        fails = [row for row in rows if row.fails]
        ends = [line for line in record if "ends" in line]
        if not fails and not ends:
            return []
        if fails:
            lines = same_waves.table(fails)
        if len(fails) < len(rows):
            lines.append(f"{len(rows) - len(fails)} of {len(rows)} quantities agree")
    return [f"  {line}" for line in [*lines, *record]] + [
        _who_wrote(old, run),
        _input(old, run),
        "If the change is meant, write the reference again: update=True, or pytest --update-references.",
    ]


def _who_wrote(old: xr.Dataset, run: xr.Dataset) -> str:
    """Return whether another version wrote the reference, or ran."""
    writer, here = str(old.attrs["hertzlink"]), version_of("hertzlink")
    if writer != here:
        first = f"hertzlink {writer} wrote the reference; this is {here}"
    else:
        first = f"hertzlink {here} wrote the reference, and is the version here"
    there, now = (_json(data.attrs.get("versions", "")) for data in (old, run))
    if there == now:
        return f"versions: the same; {first}"
    return f"versions: {first}; " + "; ".join(differences(there, now))


def _input(old: xr.Dataset, run: xr.Dataset) -> str:
    there, now = (_json(data.attrs.get("input", "")) for data in (old, run))
    changes = list(differences(there, now))
    if not changes:
        return "input: the same"
    more = [f"and {len(changes) - MOST_INPUTS} more"] if len(changes) > MOST_INPUTS else []
    return "input: " + "; ".join([*changes[:MOST_INPUTS], *more])


def _json(text: object) -> Any:
    try:
        return unfolded(json.loads(str(text))) if text else None
    except (ValueError, RecursionError):
        return str(text)


def _described(waves: xr.Dataset, run: xr.Dataset, sensors: list[int]) -> xr.Dataset:
    attributes = {name: str(run.attrs[name]) for name in ("input", "versions") if name in run.attrs}
    origin = {"format": FORMAT, "format_version": VERSION, "hertzlink": versions()["hertzlink"], "sensors": sensors}
    return waves.assign_attrs(**origin, **attributes)


def _write(path: Path, waves: xr.Dataset) -> None:
    packed = {
        name: {"zlib": True, "shuffle": True, "_FillValue": None} if variable.ndim else {"_FillValue": None}
        for name, variable in waves.variables.items()
    }
    content = bytes(waves.to_netcdf(engine="h5netcdf", encoding=packed))
    path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, content)


def _read(path: Path) -> xr.Dataset:
    if not path.is_file():
        raise ValueError(
            f"reference: {path} does not exist; write it with update=True, or with pytest --update-references"
        )
    content = BytesIO(path.read_bytes())
    check_hdf5(content, f"reference: {path}")
    try:
        with xr.open_dataset(content, engine="h5netcdf", decode_times=False, mask_and_scale=False) as file:
            data = file.load().drop_encoding()
    except (OSError, KeyError, TypeError, ValueError, RuntimeError) as error:
        raise ValueError(f"reference: {path} cannot be read ({error}); write it again") from error
    whole_one = {"sensors", "hertzlink"} <= set(data.attrs) and "time" in data.coords
    kinds = {variable.attrs.get("kind") for variable in data.data_vars.values()}
    if data.attrs.get("format") != FORMAT or not whole_one or not kinds <= set(same_waves.KINDS):
        raise ValueError(
            f"reference: {path} was not written by assert_same_waves; give another file, or write it again"
        )
    if int(data.attrs.get("format_version", 0)) > VERSION:
        raise ValueError(
            f"reference: {path} was written by hertzlink {data.attrs['hertzlink']}, in a form that this version does "
            "not know; update hertzlink, or write it again"
        )
    return data


def _by_kind(name: str, tolerance: Tolerance, default: float) -> dict[str, float]:
    if isinstance(tolerance, Mapping):
        for kind in tolerance:
            one_of(name, kind, same_waves.KINDS)
        return {kind: not_negative(f"{name}[{kind!r}]", tolerance.get(kind, default)) for kind in same_waves.KINDS}
    return dict.fromkeys(same_waves.KINDS, not_negative(name, tolerance))


def _sensors(sensors: Sequence[int] | None) -> list[int]:
    if sensors is None:
        return []
    try:
        numbers = [whole("sensors", number) for number in sensors]
    except TypeError:
        numbers = []
    if not numbers:
        raise ValueError(f"sensors = {short(sensors)}: must be a list of numbers of beads")
    return list(dict.fromkeys(numbers))


def _switch(update: object) -> bool:
    return instance("update", update, bool, "True, False or None")
