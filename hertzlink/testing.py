"""Regression tests of your own models: their waves are compared with a file that an earlier version wrote."""

import json
import os
from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.interpolate import CubicSpline

from coupling.results.ar_and_tof import amplitude_ratio, time_of_flight
from coupling.results.findings import one_of_each, warn
from coupling.results.hdf5 import check_hdf5
from coupling.results.measures import sensor_force
from coupling.results.provenance import differences, unfolded, versions
from coupling.results.reading import Reading
from hertzlink.output import write_file
from structures.caution import collected
from structures.checks import instance, listed, not_negative, one_of, whole
from structures.structure import Vector

__all__ = ["assert_same_waves"]

FORMAT = "hertzlink reference"
UPDATE = "HERTZLINK_UPDATE_REFERENCES"  # The environment variable with which references are written.
MOST_INPUTS = 8  # So many differences of the input are listed.
UNITS = {"amplitude_ratio": (1.0, ""), "time_of_flight": (1e6, " µs"), "force": (1.0, " N rms")}
"""The kinds of quantities, each of which may have tolerances of its own, and how the message shows them."""


class Row(NamedTuple):
    """A quantity of the reference and now, their difference and how much it may be; of a force root mean squares."""

    quantity: str
    kind: str
    reference: float
    now: float
    difference: float
    tolerance: float

    @property
    def cells(self) -> tuple[str, ...]:
        """The texts of the message."""
        scale, unit = UNITS[self.kind]
        values = [f"{scale * v:.7g}{unit}" if np.isfinite(v) else "no wave" for v in (self.reference, self.now)]
        apart = f"{scale * self.difference:.2g}{unit}" if np.isfinite(self.difference) else "-"
        return self.quantity, *values, apart, f"{scale * self.tolerance:.2g}{unit}"


def assert_same_waves(
    run: xr.Dataset,
    reference: str | os.PathLike[str],
    rtol: float | Mapping[str, float] = 1e-5,
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
    rtol : float or mapping
        Relative tolerance, also by kind: "amplitude_ratio", "time_of_flight", "force"; others have 1e-5.
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
    path, reading = Path(reference).expanduser(), Reading(run)
    if isinstance(rtol, Mapping):
        for kind in rtol:
            one_of("rtol", kind, tuple(UNITS))
        tolerances = {kind: not_negative(f"rtol[{kind!r}]", rtol.get(kind, 1e-5)) for kind in UNITS}
    else:
        tolerances = dict.fromkeys(UNITS, not_negative("rtol", rtol))
    write = os.environ.get(UPDATE, "") not in ("", "0")
    if update is not None:
        write = instance("update", update, bool, "True, False or None")
    old = None if write else read(path)
    if sensors is not None:
        chosen = [whole("sensors", number) for number in listed("sensors", sensors, object, "numbers of beads")]
    elif old is not None:
        chosen = [int(number) for number in np.atleast_1d(old.attrs["sensors"])]
    elif reading.is_signal:
        chosen = [int(number) for number in np.atleast_1d(run.sensor.values)]
    else:
        chosen = [reading.whole_beads[len(reading.whole_beads) // 2]]
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
    elif said := complaint(old, now, run, tolerances):
        raise AssertionError(f"the waves differ from those in {path}:\n" + "\n".join(f"  {line}" for line in said))


def waves(run: xr.Dataset, sensors: Sequence[int]) -> xr.Dataset:
    """Return AR, TOF and force of each sensor, and the force at the last contact, by their names."""
    found = {}
    for sensor in dict.fromkeys(sensors):
        for wave in ("primary", "secondary"):
            ratio, flight = amplitude_ratio(run, sensor, wave), time_of_flight(run, sensor, wave)
            found[f"AR at bead {sensor}, {wave} wave"] = ratio.assign_attrs(kind="amplitude_ratio")
            found[f"TOF at bead {sensor}, {wave} wave"] = flight.assign_attrs(kind="time_of_flight")
        found[f"force at bead {sensor}"] = sensor_force(run, sensor).assign_attrs(kind="force")
    if not Reading(run).is_signal:
        force = run.contact_force - run.static_force
        # Of several chains each has a last contact of its own.
        last = force.isel(contact=force.notnull().any("time").sum("contact") - 1)
        found["force at the last contact"] = last.assign_attrs(kind="force")
    return xr.Dataset({name: one.transpose(..., "time", missing_dims="ignore").reset_coords(drop=True).rename(None)
                       for name, one in found.items()})  # fmt: skip


def complaint(old: xr.Dataset, now: xr.Dataset, run: xr.Dataset, tolerances: Mapping[str, float]) -> list[str]:
    """Return the lines of the message; none where all agrees."""
    lines = []
    for axis in dict.fromkeys(str(name) for data in (old, now) for name in data.dims if name != "time"):
        there, here = (data[axis].values.tolist() if axis in data.dims else "none" for data in (old, now))
        lines += [f"{axis} = {there} there and {here} here"] * (there != here)
    ends = [1e6 * float(data.time[-1]) for data in (old, now)]
    step = 1e6 * float(old.time[1] - old.time[0])
    cut = abs(ends[1] - ends[0]) > 1.5 * step
    if not lines:
        rows = list(compared(old, now, tolerances))
        fails = [row for row in rows if not row.difference <= row.tolerance]
        if not fails and not cut:
            return []
        cells = [("quantity", "reference", "now", "difference", "tolerance"), *(row.cells for row in fails)]
        widths = [max(len(row[i]) for row in cells) for i in range(5)]
        lines = [
            "  ".join([row[0].ljust(widths[0]), *(c.rjust(w) for c, w in zip(row[1:], widths[1:], strict=True))])
            for row in cells
        ]
        if len(fails) < len(rows):
            lines.append(f"{len(rows) - len(fails)} of {len(rows)} quantities agree")
    if cut:
        lines.append(f"the record ends at {ends[0]:.6g} µs there and {ends[1]:.6g} µs here")
    elif old.time.size != now.time.size:
        lines.append(f"{old.time.size} saved times there and {now.time.size} here; forces interpolated")

    # Versions and input.
    writer, ours = str(old.attrs["hertzlink"]), versions()["hertzlink"]
    version = "and is the version here" if writer == ours else f"this is {ours}"
    first = f"hertzlink {writer} wrote the reference; {version}"
    for name, words in (("versions", first), ("input", "")):
        changes = list(differences(*(plain(data.attrs.get(name, "")) for data in (old, run))))
        said = [words, *changes[:MOST_INPUTS]] if changes else ["the same", words]
        said += [f"and {len(changes) - MOST_INPUTS} more"] * (len(changes) > MOST_INPUTS)
        lines.append(f"{name}: " + "; ".join(filter(None, said)))
    return [*lines, f"If the change is meant, write the reference again: update=True, or {UPDATE}=1."]


def compared(old: xr.Dataset, now: xr.Dataset, tolerances: Mapping[str, float]) -> Iterator[Row]:
    """Yield each quantity of either; of several runs the one that differs most."""
    for name in dict.fromkeys([*map(str, old.data_vars), *map(str, now.data_vars)]):
        if name not in now or name not in old:
            yield Row(name, (now if name in now else old)[name].attrs["kind"], np.nan, np.nan, np.inf, 0.0)
            continue
        kind, there, here = old[name].attrs["kind"], old[name], now[name].transpose(*old[name].dims)
        first, second = there.values.astype(float), here.values.astype(float)
        if kind == "force":
            second = on_times(second, now.time.values, old.time.values)
            missing = (np.isnan(first) != np.isnan(second)).any(axis=-1)
            gap = np.where(missing, np.inf, rms(second - first))
            first, second = rms(first), rms(second)
        else:
            missing = np.isnan(first) & np.isnan(second)
            gap = np.where(missing, 0.0, np.nan_to_num(abs(second - first), nan=np.inf))
        allowed = tolerances[kind] * np.nan_to_num(abs(first))
        worst = np.unravel_index(int(np.argmax(gap - allowed)), gap.shape)
        axes = [axis for axis in there.dims if axis != "time"]
        words = ", ".join(f"{axis} = {there[axis].values[at]}" for axis, at in zip(axes, worst, strict=True))
        values = (float(values[worst]) for values in (first, second, gap, allowed))
        yield Row(f"{name} at {words}" if words else name, kind, *values)


def on_times(values: Vector, times: Vector, wanted: Vector) -> Vector:
    """Return the traces at other times, by cubic splines: straight lines would differ by 1e-4 between samples."""
    if times.shape == wanted.shape and np.allclose(times, wanted, rtol=0.0, atol=1e-9 * (times[-1] - times[0])):
        return values
    rough = np.isnan(values).any(axis=-1, keepdims=True)
    spline = CubicSpline(times, np.where(rough, 0.0, values), axis=-1)
    smooth: Vector = np.where(rough, np.nan, spline(np.clip(wanted, times[0], times[-1])))
    return smooth


def rms(values: Vector) -> Vector:
    """Return the root of the mean square over time, without what is not a number."""
    finite = np.isfinite(values)
    total: Vector = (np.where(finite, values, 0.0) ** 2).sum(axis=-1)
    root: Vector = np.sqrt(total / np.maximum(1, finite.sum(axis=-1)))
    return root


def plain(text: object) -> Any:
    """Return the data of an attribute of JSON; a text that is none as it stands."""
    try:
        return unfolded(json.loads(str(text))) if text else None
    except (ValueError, RecursionError):
        return str(text)


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
