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
MOST_INPUTS = 8  # So many differences of the input are listed.


def assert_same_waves(
    run: xr.Dataset,
    reference: str | os.PathLike[str],
    rtol: float = 1e-5,
    sensors: Sequence[int] | None = None,
    update: bool | None = None,
) -> None:
    """Compare the waves of a result with a reference that was saved, for a regression test.

    AR and TOF of the primary and the secondary wave at each sensor are compared, and the forces over time at the
    sensors and at the last contact of the chain. A wave that only one of them has is a difference. In a sweep or a
    batch the worst run counts.

    Parameters
    ----------
    run : Dataset
        A run, a sweep, a batch or a measured signal.
    reference : path
        The netCDF file of the reference.
    rtol : float
        Relative tolerance; of a force of its root mean square.
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
        If the reference is missing or is none, or an argument is wrong.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> run = hl.CoSimulation(hl.Chain([bead] * 16, bead, 0.44), hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> hl.testing.assert_same_waves(run, "wall.nc", update=True)
    >>> hl.testing.assert_same_waves(run, "wall.nc", rtol=1e-6)
    """
    __tracebackhide__ = True  # pytest shows the table of differences, not this code.
    path, reading, rtol = Path(reference).expanduser(), Reading(run), not_negative("rtol", rtol)
    if update is None:
        update = os.environ.get(UPDATE, "") not in ("", "0")
    old = None if instance("update", update, bool, "True, False or None") else read(path)
    if sensors is not None:
        chosen = [whole("sensors", number) for number in listed("sensors", sensors, object, "numbers of beads")]
    elif old is not None:
        chosen = [int(number) for number in np.atleast_1d(old.attrs["sensors"])]
    else:
        beads = reading.data.sensor.values.tolist() if reading.is_signal else reading.whole_beads
        chosen = beads if reading.is_signal else [beads[len(beads) // 2]]
    with collected() as findings:
        now = waves(run, chosen)
    warn(one_of_each(findings))
    if old is None:
        inputs = {name: str(run.attrs[name]) for name in ("input", "versions") if name in run.attrs}
        now = now.assign_attrs(format=FORMAT, hertzlink=versions()["hertzlink"], sensors=chosen, **inputs)
        coding = {
            name: {"zlib": True, "shuffle": True, "_FillValue": None} if variable.ndim else {"_FillValue": None}
            for name, variable in now.variables.items()
        }
        path.parent.mkdir(parents=True, exist_ok=True)
        write_file(path, bytes(now.to_netcdf(engine="h5netcdf", encoding=coding)))
    elif lines := complaint(old, now, rtol):
        lines += [*origins(old, run), f"If the change is meant, write the reference again: update=True, or {UPDATE}=1."]
        raise AssertionError(f"the waves differ from those in {path}:\n" + "\n".join(f"  {line}" for line in lines))


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


def complaint(old: xr.Dataset, now: xr.Dataset, rtol: float) -> list[str]:
    """Return what differs, in lines; none where all agrees."""
    lines = []
    for axis in dict.fromkeys(str(name) for data in (old, now) for name in data.dims if name != "time"):
        there, here = (data[axis].values.tolist() if axis in data.dims else "none" for data in (old, now))
        lines += [f"{axis} = {there} there and {here} here"] * (there != here)
    (there, here), step = (1e6 * float(data.time[-1]) for data in (old, now)), 1e6 * float(old.time[1] - old.time[0])
    cut = abs(here - there) > 1.5 * step
    if not lines:
        every = dict.fromkeys([*map(str, old.data_vars), *map(str, now.data_vars)])
        rows = [row for name in every if (row := difference(name, old, now, rtol))]
        if not rows and not cut:
            return []
        table = [("quantity", "reference", "now", "difference", "tolerance"), *rows]
        widths = [max(map(len, column)) for column in zip(*table, strict=True)]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table]
        lines.append(f"{len(every) - len(rows)} of {len(every)} quantities agree")
    if cut:
        lines.append(f"the record ends at {there:.6g} µs there and {here:.6g} µs here")
    elif old.time.size != now.time.size:
        lines.append(f"{old.time.size} saved times there and {now.time.size} here; forces interpolated")
    return lines


def difference(name: str, old: xr.Dataset, now: xr.Dataset, rtol: float) -> tuple[str, ...]:
    """Return the texts of a quantity that differs: its name, the reference, now, difference and tolerance; of several
    runs those of the one that differs most. Empty where it agrees."""
    if name not in now or name not in old:
        return name, *("there" if name in data else "missing" for data in (old, now)), "-", "-"
    there, here = old[name], now[name].transpose(*old[name].dims)
    first, second = there.values.astype(float), here.values.astype(float)
    if "time" in there.dims:
        if not (now.time.size == old.time.size and np.allclose(now.time, old.time, rtol=1e-9, atol=0.0)):
            # Straight lines would differ by 1e-4 between samples.
            within = old.time.values.clip(now.time.values[0], now.time.values[-1])
            second = here.interp(time=within, method="cubic").values
        missing = (np.isnan(first) != np.isnan(second)).any(axis=-1)
        gap, first, second = (
            np.sqrt(np.mean(np.nan_to_num(values) ** 2, axis=-1)) for values in (second - first, first, second)
        )
        gap = np.where(missing, np.inf, gap)
    else:
        gap = np.where(np.isnan(first) & np.isnan(second), 0.0, np.nan_to_num(abs(second - first), nan=np.inf))
    allowed = rtol * np.nan_to_num(abs(first))
    worst = np.unravel_index(int(np.argmax(gap - allowed)), gap.shape)
    if gap[worst] <= allowed[worst]:
        return ()
    axes = [axis for axis in there.dims if axis != "time"]
    at = ", ".join(f"{axis} = {there[axis].values[place]}" for axis, place in zip(axes, worst, strict=True))
    size, unit = handy([first[worst], second[worst]], there.attrs.get("units", "N"))
    texts = [
        f"{size * values[worst]:.{digits}g} {unit}".rstrip() if np.isfinite(values[worst]) else nothing
        for values, digits, nothing in ((first, 7, "no wave"), (second, 7, "no wave"), (gap, 2, "-"), (allowed, 2, "-"))
    ]
    return f"{name} at {at}" if at else name, *texts


def origins(old: xr.Dataset, run: xr.Dataset) -> Iterator[str]:
    """Yield a line on the versions and one on the input, and what differs in them."""
    writer, ours = str(old.attrs["hertzlink"]), versions()["hertzlink"]
    first = f"hertzlink {writer} wrote the reference; " + (
        "and is the version here" if writer == ours else f"this is {ours}"
    )
    for name, words in (("versions", [first]), ("input", [])):
        there, here = (stored(data.attrs.get(name)) for data in (old, run))
        changes = list(differences(there, here))
        more = [f"and {len(changes) - MOST_INPUTS} more"] * (len(changes) > MOST_INPUTS)
        yield f"{name}: " + "; ".join([*words, *changes[:MOST_INPUTS], *more] if changes else ["the same", *words])


def read(path: Path) -> xr.Dataset:
    if not path.is_file():
        raise ValueError(f"reference: {path} does not exist; write it with update=True, or with {UPDATE}=1")
    content = BytesIO(path.read_bytes())
    check_hdf5(content, f"reference: {path}")
    with xr.open_dataset(content, engine="h5netcdf", decode_times=False, mask_and_scale=False) as file:
        data = file.load().drop_encoding()
    if data.attrs.get("format") != FORMAT:
        reason = "was not written by assert_same_waves; give another file, or write it again"
        raise ValueError(f"reference: {path} {reason}")
    return data
