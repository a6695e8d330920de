"""The accessor `hertz` of Datasets: measures and plots of a run, a sweep or a signal, by `run.hertz`."""

from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, Concatenate, ParamSpec, TypeVar

import xarray as xr

from coupling.plots.swept import swept, varied
from coupling.plots.traces import sensors_of, traces
from coupling.results.ar_and_tof import amplitude_ratio, reflections, time_of_flight
from coupling.results.reading import Reading
from coupling.results.schema import RUN, SIGNAL
from structures.checks import html_table

if TYPE_CHECKING:
    from matplotlib.axes import Axes


P = ParamSpec("P")
Found = TypeVar("Found")


def _of_the_data(function: Callable[Concatenate[xr.Dataset, P], Found]) -> Callable[Concatenate["Hertz", P], Found]:
    """Return a method that calls a function with the Dataset; help and editors show the function's own text."""

    @wraps(function)
    def method(self: "Hertz", /, *args: P.args, **options: P.kwargs) -> Found:
        return function(self._data, *args, **options)

    return method


@xr.register_dataset_accessor("hertz")  # type: ignore[no-untyped-call]
class Hertz:
    """Measures and plots of a Dataset of hertzlink's, with its first argument left out.

    Parameters
    ----------
    data : Dataset
        A run, a sweep, a batch or a signal.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(radius=4.76e-3, material=hl.STEEL_440C)
    >>> chain = hl.Chain([bead] * 16, striker=bead, impact_speed=0.44)
    >>> run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=6e-4)
    >>> print(f"{run.hertz.reflections(8).primary.amplitude_ratio:.2f}")
    0.99
    """

    def __init__(self, data: xr.Dataset) -> None:
        self._data = data

    @property
    def _single(self) -> bool:
        return Reading(self._data).kind in (RUN, SIGNAL)

    reflections = _of_the_data(reflections)
    amplitude_ratio = _of_the_data(amplitude_ratio)
    time_of_flight = _of_the_data(time_of_flight)

    def plot(self, sensor: int | None = None, **options: Any) -> "Axes":
        """Draw the force at a sensor, as `hl.plots.traces` does, or AR over a sweep, as `hl.plots.swept` does."""
        return (traces if self._single else swept)(self._data, sensor, **options)

    def _repr_html_(self) -> str:
        if not self._single:
            return html_table("Sweep", [*varied(self._data).items()])
        tables = [
            self.reflections(sensor)._repr_html_().replace("Reflections", f"Waves at bead {sensor}")
            for sensor in sensors_of(Reading(self._data), None)
        ]
        return "".join(tables)
