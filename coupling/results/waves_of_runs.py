"""The waves at a sensor of one run or of thousands, from plain arrays: forces, preloads and velocities."""

from itertools import count, takewhile
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.results import wave_kernels
from coupling.results.reading import Reading, without_padding
from structures.structure import Vector

BEGINS = ("unknown", "structure", "chain")
"""Where a wave begins, by the numbers of `wave_kernels`."""


class Series(NamedTuple):
    """The forces and velocities that show the waves over a bead, of one run or of many.

    force: runs × times × contacts, N, with the preload: the bead's two contacts, then those beyond it as far as they
    are known, the structure's last. static: the preload, runs × contacts, N. velocity: of the bead, runs × times, m/s.
    Contacts that hold only NaN are left out. axes: of the sweep whose points the runs are; template: values over them.
    """

    force: Vector
    static: Vector
    velocity: Vector
    axes: tuple[str, ...] = ()
    template: xr.DataArray | None = None

    def dynamic(self, run: int) -> Vector:
        """Return the forces of a run above the preload, contacts × times, N."""
        return without_padding(np.ascontiguousarray((self.force[run] - self.static[run]).T))

    def over_axes(self, values: Vector) -> xr.DataArray:
        """Return one value of each run over the axes of the sweep; without dimension for one run."""
        if self.template is None:
            return xr.DataArray(values.reshape(()))
        return self.template.copy(data=values.reshape(self.template.shape))


class WavesOfRuns(NamedTuple):
    """The waves of each run, the incident one first: amplitude (N), arrival (s) and `begins`, a number for BEGINS, runs
    × waves, NaN and 0 where there is none; found: how many each run has."""

    amplitude: Vector
    arrival: Vector
    begins: NDArray[np.int64]
    found: NDArray[np.int64]

    @property
    def amplitude_ratio(self) -> Vector:
        """AR of the reflected waves, runs × waves."""
        return np.asarray(self.amplitude[:, 1:] / self.amplitude[:, :1])

    @property
    def time_of_flight(self) -> Vector:
        """TOF of the reflected waves, s, runs × waves."""
        return np.asarray(self.arrival[:, 1:] - self.arrival[:, :1])


def find_waves(time: Vector, series: Series, smallest: float, most: int) -> WavesOfRuns:
    """Return the waves of all runs, in one compiled loop; `most`: of each run. `reflections` says what a wave is.

    time: the same for all runs, s. smallest: in units of the incident amplitude.
    """
    runs = len(series.force)
    waves, counts = np.full((runs, most, 3), np.nan), np.zeros(runs, dtype=np.int64)
    arrays = map(wave_kernels.plain, (time, series.force, series.static, series.velocity))
    wave_kernels.waves_of_many(*arrays, smallest, waves, counts)
    amplitude, arrival, begins = np.moveaxis(waves, -1, 0)
    begins_at = np.where(np.isnan(begins), 0.0, begins).astype(np.int64)
    return WavesOfRuns(amplitude, arrival, begins_at, counts)


def series_of(reading: Reading, sensor: int, name: str = "sensor") -> Series:
    """Return what shows the waves over a bead of a run, a sweep or a batch, in plain arrays. name: the user's, of the
    bead."""
    number = reading.checked_sensor(sensor, name)
    reading.check_holds(("contact_force", "velocity"))
    variables = reading.data.variables
    contacts, beads = (variables[label].values.tolist() for label in ("contact", "bead"))
    if number not in beads:
        raise ValueError(f"{name} = {sensor!r}: must be a bead that was kept: {', '.join(map(str, beads))}")
    # From the bead's first contact on, up to one that was not kept: a wave is followed without gaps.
    rows = [contacts.index(contact) for contact in takewhile(reading.kept.__contains__, count(number))]
    axes = [str(axis) for axis in variables["contact_force"].dims if axis not in ("time", "contact")]
    series = (
        _plain(variables["contact_force"], axes, {"time": slice(None), "contact": _places(rows)}),
        _plain(variables["static_force"], axes, {"contact": _places(rows)}),
        _plain(variables["velocity"], axes, {"time": slice(None), "bead": _places([beads.index(number)])})[..., 0],
    )
    runs = len(series[0])
    # One preload for all runs of a sweep is repeated.
    force, static, velocity = (values if len(values) == runs else np.repeat(values, runs, axis=0) for values in series)
    template = reading.data.contact_force.isel(time=0, contact=0).reset_coords(drop=True) if axes else None
    return Series(force, static, velocity, tuple(axes), template)


def _places(rows: list[int]) -> Any:
    """Return the places along an axis: as a slice where they follow each other, which copies nothing."""
    return slice(rows[0], rows[-1] + 1) if rows == list(range(rows[0], rows[-1] + 1)) else rows


def _plain(values: xr.Variable, axes: list[str], selected: dict[str, Any]) -> Vector:
    """Return a variable as an array, runs × its own dimensions; one run where it has none of the axes.

    selected: its own dimensions, and which places along each to take.
    """
    dims = list(map(str, values.dims))
    order = [dims.index(axis) for axis in (*axes, *selected) if axis in dims]
    array = values.values.transpose(order)[(..., *selected.values())]
    if len(order) not in (len(selected), len(axes) + len(selected)):
        raise ValueError(f"run: has a variable over {', '.join(dims)}, must have all of {', '.join(axes)} or none")
    return np.asarray(array.reshape(-1, *array.shape[array.ndim - len(selected) :]))
