"""Regression tests of your own models: their waves are compared with a file that an earlier version wrote."""

import os
from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import xarray as xr

from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import one_of_each, warn
from coupling.results.hdf5 import check_hdf5
from coupling.results.measures import sensor_force
from coupling.results.provenance import differences, stored, versions
from coupling.results.reading import Reading
from hertzlink.output import write_file
from structures.caution import collected
from structures.checks import instance, listed, not_negative, whole
from structures.units import handy

__all__ = ["assert_same_waves"]

FORMAT = "hertzlink reference"
UPDATE = "HERTZLINK_UPDATE_REFERENCES"  # The environment variable with which references are written.
MOST_INPUTS = 8  # The most differences of the input that are listed.


def assert_same_waves(
    run: xr.Dataset,
    reference: str | os.PathLike[str],
    rtol: float = 1e-5,
    sensors: Sequence[int] | None = None,
    update: bool | None = None,
) -> None:
    """Compare the waves of a result with a saved reference, for a regression test.

    The amplitude ratio (AR) and the time of flight (TOF) of the primary and the secondary wave at each sensor are
    compared, and the forces over time at the sensors and at the last contact of the chain. A wave that only the result
    or only the reference has is a difference. In a sweep or a batch the worst run counts.

    Parameters
    ----------
    run : Dataset
        A run, a sweep, a batch or a measured signal.
    reference : path
        The netCDF file of the reference.
    rtol : float
        Relative tolerance; for a force, of its root mean square.
    sensors : list of int, optional
        Beads whose waves count; by default those of the reference, or the bead in the middle of the chain.
    update : bool, optional
        True writes the reference and compares nothing; by default HERTZLINK_UPDATE_REFERENCES decides.

    Returns
    -------
    None
        Where all quantities agree.

    Raises
    ------
    AssertionError
        If a quantity differs by more than rtol · |reference|. The message lists what differs, and whether
        input or versions differ.
    ValueError
        If the reference is missing or is another file, or an argument is wrong.

    Examples
    --------
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> hl.testing.assert_same_waves(run, "wall.nc", update=True)
    >>> hl.testing.assert_same_waves(run, "wall.nc", rtol=1e-6)
    """
    __tracebackhide__ = True  # pytest shows the differences, not this code.
    path, reading, rtol = Path(reference).expanduser(), Reading(run), not_negative("rtol", rtol)
    if update is None:
        update = os.environ.get(UPDATE, "") not in ("", "0")
    old = None
    if not instance("update", update, bool, "True, False or None"):
        if not path.is_file():
            raise ValueError(f"reference: {path} does not exist; write it with update=True, or with {UPDATE}=1")
        content = BytesIO(path.read_bytes())
        check_hdf5(content, f"reference: {path}")
        with xr.open_dataset(content, engine="h5netcdf", decode_times=False, mask_and_scale=False) as file:
            old = file.load().drop_encoding()
        if old.attrs.get("format") != FORMAT:
            cure = "give another file, or write it again"
            raise ValueError(f"reference: {path} was not written by assert_same_waves; {cure}")
    if sensors is not None:
        chosen = [whole("sensors", number) for number in listed("sensors", sensors, object, "numbers of beads")]
    elif old is not None:
        chosen = [int(number) for number in np.atleast_1d(old.attrs["sensors"])]
    elif reading.is_signal:
        chosen = reading.data.sensor.values.tolist()
    else:
        chosen = [reading.whole_beads[len(reading.whole_beads) // 2]]
    with collected() as findings:
        now = waves(run, chosen)
    warn(one_of_each(findings))
    if old is None:
        inputs = {name: str(run.attrs[name]) for name in ("input", "versions") if name in run.attrs}
        now = now.assign_attrs(format=FORMAT, hertzlink=versions()["hertzlink"], sensors=chosen, **inputs)
        packed, plain = {"zlib": True, "shuffle": True, "_FillValue": None}, {"_FillValue": None}
        coding = {name: packed if variable.ndim else plain for name, variable in now.variables.items()}
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, bytes(now.to_netcdf(engine="h5netcdf", encoding=coding)))
    elif lines := [*complaints(old, now, rtol)]:
        # What else differs may be the reason.
        writer, ours = str(old.attrs["hertzlink"]), versions()["hertzlink"]
        wrote = f"hertzlink {writer} wrote the reference; {'as here' if writer == ours else f'this is {ours}'}"
        for name, words in (("versions", [wrote]), ("input", [])):
            there, here = (stored(data.attrs.get(name)) for data in (old, run))
            changes = [*differences(there, here)]
            told = [*words, *changes[:MOST_INPUTS]] if changes else ["the same", *words]
            if len(changes) > MOST_INPUTS:
                told.append(f"and {len(changes) - MOST_INPUTS} more")
            lines.append(f"{name}: {'; '.join(told)}")
        lines.append(f"If the change is intended, write the reference again: update=True, or {UPDATE}=1.")
        raise AssertionError("\n  ".join([f"the waves differ from those in {path}:", *lines]))


def waves(run: xr.Dataset, sensors: Sequence[int]) -> xr.Dataset:
    """Return AR, TOF and force of each sensor, and the force at the last contact, by their names."""
    found = dict[str, xr.DataArray]()
    for sensor in dict.fromkeys(sensors):
        for wave in ("primary", "secondary"):
            found[f"AR at bead {sensor}, {wave} wave"] = amplitude_ratio(run, sensor, wave)
            found[f"TOF at bead {sensor}, {wave} wave"] = time_of_flight(run, sensor, wave)
        found[f"force at bead {sensor}"] = sensor_force(run, sensor)
    if not Reading(run).is_signal:
        force = run.contact_force - run.static_force
        # Of several chains each has a last contact of its own.
        last = force.isel(contact=force.notnull().any("time").sum("contact") - 1)
        found["force at the last contact"] = last.assign_attrs(units="N")
    return xr.Dataset({name: one.transpose(..., "time", missing_dims="ignore").reset_coords(drop=True).rename(None)
                       for name, one in found.items()})  # fmt: skip


def complaints(old: xr.Dataset, now: xr.Dataset, rtol: float) -> Iterator[str]:
    """Yield what differs, in lines; none where all agrees."""
    for axis in {*old.dims, *now.dims} - {"time"}:
        there, here = (data[axis].values.tolist() if axis in data.dims else "none" for data in (old, now))
        if there != here:
            yield f"{axis} = {there} there and {here} here"
            return
    ends = [1e6 * float(data.time[-1]) for data in (old, now)]
    cut = abs(ends[1] - ends[0]) > 1.5e6 * float(old.time[1] - old.time[0])
    interpolated = now.time.size != old.time.size or not np.allclose(now.time, old.time, rtol=1e-9, atol=0.0)
    if interpolated:  # by cubic splines: straight lines would differ by 1e-4 between samples
        now = now.interp(time=old.time.values.clip(now.time.values[0], now.time.values[-1]), method="cubic")
    now = now.assign_coords(time=old.time)
    names = dict.fromkeys([*old.data_vars, *now.data_vars])
    wrong = [line for name in names if (line := difference(str(name), old, now, rtol))]
    if wrong:
        yield from [*wrong, f"{len(names) - len(wrong)} of {len(names)} quantities agree"]
    if cut:
        yield f"the record ends at {ends[0]:.6g} µs there and {ends[1]:.6g} µs here"
    elif wrong and interpolated:
        yield "the saved times differ; forces are interpolated"


def difference(name: str, old: xr.Dataset, now: xr.Dataset, rtol: float) -> str:
    """Return how a quantity differs; of several runs the one that differs most. Empty where it agrees."""
    if name not in now or name not in old:
        return f"{name}: missing {'there' if name in now else 'here'}"
    there, here, units = old[name], now[name], old[name].attrs.get("units", "N")
    missing, gap = there.isnull() != here.isnull(), here - there
    if "time" in there.dims:
        missing = missing.any("time")
        gap, there, here = (((one.fillna(0.0) ** 2).mean("time") ** 0.5) for one in (gap, there, here))
    gap = abs(gap).fillna(0.0).where(~missing, np.inf)
    allowed = rtol * abs(there).fillna(0.0)
    worst = np.unravel_index(int((gap - allowed).values.argmax()), gap.shape)
    first, second, off, most = (float(one.transpose(*gap.dims).values[worst]) for one in (there, here, gap, allowed))
    if off <= most:
        return ""
    at = ", ".join(f"{axis} = {gap[axis].values[place]}" for axis, place in zip(gap.dims, worst, strict=True))
    size, unit = handy([first, second], units)
    values = [f"{size * value:.7g} {unit}".rstrip() if np.isfinite(value) else "no wave" for value in (first, second)]
    apart = f"; off by {size * off:.2g}, allowed is {size * most:.2g}" if np.isfinite(off) else ""
    return f"{name}{' at ' if at else ''}{at}: {values[0]} there and {values[1]} here{apart}"
