"""The reader of results: the content of a Dataset by the schema, without the padding of shorter chains.

All measures, checks and pictures read a Dataset through `Reading`. It does not need the simulation.
"""

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.results.schema import END_NAMES, LAST, SIGNAL, Contact, axes_of, kind_of
from structures.caution import caution
from structures.checks import instance, whole
from structures.structure import Vector

# The way to a Dataset with more than sensors.
ALL_KEPT = "by CoSimulation.run without sensors, which keeps everything"


class Reading:
    """A run, sweep, batch or signal: its kind, chains, contacts, forces and sensors. what: the wanted Dataset, in the
    words of an error. Raises ValueError for other objects."""

    def __init__(self, run: object, what: str = "the Dataset of a run, a sweep or a signal") -> None:
        self.data: xr.Dataset = instance("run", run, xr.Dataset, what)
        self.is_signal = kind_of(self.data) == SIGNAL
        """Whether the Dataset holds measured forces of sensors, and no contacts."""
        self.at_sensors = "beads" in self.data.attrs
        """Whether the Dataset holds only sensors of runs, like a batch."""
        self.time: Vector = np.asarray(self.data.variables["time"].values if self.data.sizes.get("time") else [])
        """The saved times, s."""
        if not self.time.size or not (np.diff(self.time) > 0.0).all():
            raise ValueError('run: must hold saved times that increase; sort them with run.sortby("time")')

    @cached_property
    def _there(self) -> NDArray[np.bool_]:
        """Whether a chain has a contact, chains × contacts; one row for one chain."""
        static = self.data.variables["static_force"]
        axes = [axis for axis in ("chain", "contact") if axis in static.dims]
        values = static.transpose(..., *axes).values
        there: NDArray[np.bool_] = np.atleast_2d(~np.isnan(values).all(axis=tuple(range(values.ndim - len(axes)))))
        return there

    @cached_property
    def beads(self) -> list[int]:
        """The number of beads of each chain."""
        if self.at_sensors:
            return [int(count) for count in np.atleast_1d(self.data.attrs["beads"])]
        return [int(count) - 1 for count in self._there.sum(axis=1)]

    @cached_property
    def kept(self) -> set[int]:
        """The numbers of the contacts in the Dataset, for the longest chain if there are several."""
        return set(self.data.variables["contact"].values[self._there.any(axis=0)].tolist())

    @property
    def whole_beads(self) -> list[int]:
        """The beads with both contacts in the Dataset."""
        return [n for n in sorted(self.kept) if n > 0 and n + 1 in self.kept]

    @cached_property
    def contacts(self) -> list[Contact]:
        """The contacts between chains and structures, in the order of the dimension "interface"."""
        if "interface_chain" not in self.data.coords:
            return [Contact(0, LAST, 0, 0)]
        columns = [np.atleast_1d(self.data[f"interface_{name}"].values) for name in Contact._fields]
        return [
            Contact(int(chain), END_NAMES.index(end), int(structure), int(point))
            for chain, end, structure, point in zip(*columns, strict=True)
        ]

    def dynamic_force(self) -> xr.DataArray:
        """Return the contact forces above the preload, N; shorter chains are padded. A ValueError for a signal."""
        self.check_holds(("contact_force",), "a run or a sweep")
        force, static = self.data.contact_force, self.data.static_force
        # On variables, because xarray's comparison of the equal coordinates takes longer than a measure.
        values = (force.variable - static.variable).transpose(*force.dims).values
        above: xr.DataArray = force.copy(data=values)
        above.attrs = {}
        return above

    def checked_sensor(self, sensor: int, name: str = "sensor") -> int:
        """Return the number of a bead with both contacts, or raise a ValueError; warn if a chain is too short."""
        self.check_holds(("contact_force",), "a run or a sweep")
        number, whole_beads = whole(name, sensor), self.whole_beads
        if not whole_beads:
            raise ValueError("run: must hold the forces of both contacts of a sensor's bead")
        if number not in whole_beads:
            beads = max(self.beads) if self.at_sensors else max(self.kept) - 1
            must = f"must be a bead from 1 to {beads}, counted from the struck end"
            if len(whole_beads) < beads:
                must = f"was not kept; must be one of {', '.join(map(str, whole_beads))}"
            raise ValueError(f"{name} = {sensor!r}: {must}")
        there = self._there[:, self.data.variables["contact"].values == number + 1].any(axis=1)
        if not there.all():
            shorter = ", ".join(map(str, np.atleast_1d(self.data.chain.values)[~there]))
            caution(f"sensor = {number}: lies beyond the end of chain {shorter} of the run, whose measures are NaN")
        return number

    def measured(self, sensor: int, name: str = "sensor") -> xr.DataArray:
        """Return the force at a sensor of a signal, N; raise a ValueError for one that was not measured."""
        number, sensors = whole(name, sensor), self.data.sensor.values.tolist()
        if number not in sensors:
            raise ValueError(f"{name} = {sensor!r}: must be one that was measured: {', '.join(map(str, sensors))}")
        force: xr.DataArray = self.data.sensor_force.sel(sensor=number).reset_coords(drop=True)
        return force

    def position(self, sensor: int) -> float:
        """Return the position of a sensor bead along the chain, m; raise a ValueError if a signal does not hold it."""
        if "centre" not in self.data.coords:
            raise ValueError(
                "run: holds no positions of its sensors; give positions={sensor: m} where the signal is read"
            )
        return float(self.data.centre.sel({"sensor" if self.is_signal else "bead": sensor}))

    def check_holds(self, names: Sequence[str], source: str = "a run") -> None:
        """Raise a ValueError if a variable is missing. source: the origin of a Dataset with these variables."""
        if missing := " and ".join(name for name in names if name not in self.data.data_vars):
            what = "is a measured signal and " if self.is_signal else ""
            fault = f"{what}holds no {missing}; must be the Dataset of {source}"
            if self.at_sensors:
                fault = f"keeps sensors only, and holds no {missing}; run it {ALL_KEPT}"
            raise ValueError(f"run: {fault}")

    def check_one(self, what: str, *names: str) -> None:
        """Raise a ValueError if variables have the axes of a sweep, or for what="chain" those of several chains."""
        for name in names:
            axes = axes_of(self.data[name]) or [what] * (what == "chain" in self.data[name].dims)
            if axes:
                one = "chain" if axes == ["chain"] else "run"
                raise ValueError(f"run: has the axes {', '.join(axes)}; choose one {one} with run.isel({axes[0]}=0)")

    def check_whole(self, *names: str) -> None:
        """Raise a ValueError if some chains or structures were removed. names: "chain", "structure" or both."""
        for name in names:
            column = f"interface_{name}"
            count = 1 + int(self.data[column].max()) if column in self.data.coords else 1
            if name in self.data.coords and self.data[name].size < count:
                raise ValueError(
                    f"run: holds {self.data[name].size} of its {count} {name}s; give the whole run, with all of them"
                )


def at_end(force: Vector, end: int = LAST) -> Vector:
    """Return the row of a chain's last contact, or of its first, from contacts × times; NaN for a failed run."""
    # Rows of NaN pad a shorter chain.
    recorded = force[~np.isnan(force.reshape(len(force), -1)).all(axis=1)]
    return np.asarray((recorded if len(recorded) else force)[-1 if end == LAST else 0])


def number_or_array(values: xr.DataArray, units: str, label: str) -> float | xr.DataArray:
    """Return a float for one run, a DataArray with unit and label over the axes of a sweep."""
    if values.ndim == 0:
        return float(values)
    values.attrs = {"units": units, "long_name": label}
    return values


def contact_forces(run: object) -> tuple[list[Contact], Vector, Vector]:
    """Return the K contacts of one run; their forces on the structures (N, time × K), preload included, and their
    preloads (N, K). Raises ValueError for signals, sweeps, and for one chain of several."""
    reading, names = Reading(run, "the Dataset of a run"), ("contact_force", "surface_displacement")
    reading.check_holds(names)
    reading.check_one("run", *names)
    reading.check_whole("chain")

    def of_contacts(values: xr.DataArray) -> Vector:
        chains = [values.isel(chain=one.chain) if "chain" in values.dims else values for one in reading.contacts]
        ends = zip(chains, reading.contacts, strict=True)
        return np.stack([at_end(own.transpose("contact", ...).values, one.end) for own, one in ends], axis=-1)

    return reading.contacts, of_contacts(reading.data.contact_force), of_contacts(reading.data.static_force)
