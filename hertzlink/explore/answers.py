"""The answers of the page for the values of its sliders: one run of the case, its waves and its force."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from decimal import Decimal
from functools import partial
from threading import Lock
from time import perf_counter
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from coupling.cosimulation import CoSimulation
from coupling.inference.plates import OnModes, modes_of
from coupling.plots.setup import setup
from coupling.results.ar_and_tof import reflections
from coupling.results.findings import one_of_each
from coupling.results.measures import sensor_force
from hertzlink.cases.case import Case, of_case
from hertzlink.cases.tasks import sensors_of
from hertzlink.explore.sliders import Slider
from hertzlink.reports import drawn, svg
from structures.caution import collected

MOST_POINTS = 1000  # Of a trace: about as many as the pixels of the page.
MEASURES = ("amplitude", "arrival", "amplitude_ratio", "time_of_flight")  # The incident wave has the first two.


@dataclass
class Explorer:
    """The case at the first values of its sliders, and its runs at other values."""

    case: Case
    sliders: Sequence[Slider]
    modes: OnModes | None = None
    # Structures are kept between runs, so two runs at once would disturb each other.
    one_at_a_time: Lock = field(default_factory=Lock)

    def changed(self, values: Mapping[str, str]) -> Case:
        """Return the case at values, which are texts by slider name; sliders without a value stay."""
        sliders, changes = {slider.name: slider for slider in self.sliders}, {}
        for name, text in values.items():
            if name not in sliders:
                raise ValueError(f"{name[:40]!r}: there is no such slider; reload the page")
            slider = sliders[name]
            value = slider.read(text)
            if (text if slider.choices else Decimal(text)) != slider.start:
                changes[slider.path] = value
        return self.case.changed(changes)

    def answer(self, values: Mapping[str, str]) -> dict[str, Any]:
        """Return what the page shows; raise a ValueError for wrong values, and errors of runs that fail."""
        with self.one_at_a_time, collected() as findings:
            case = self.changed(values)
            sensor = case.data["measure"]["sensor"]
            sensors_of(case, case)
            began = perf_counter()
            run = case.run(self.simulation(case))
            waves, force = reflections(run, sensor), sensor_force(run, sensor)
            took = perf_counter() - began
        shown = dict[str, dict[str, Any]]()
        for kind, wave in waves._asdict().items():
            measures = {name: float(getattr(wave, name)) for name in MEASURES if hasattr(wave, name)}
            shown[kind] = measures if wave else {"reason": wave.reason}
        times, forces = thinned(force)
        return {
            "sensor": sensor, "waves": shown, "time": times.tolist(), "force": forces.tolist(), "until": case.until,
            "took": took, "warnings": one_of_each([of_case(finding) for finding in findings]),
        }  # fmt: skip

    def sketch(self, values: Mapping[str, str]) -> dict[str, str]:
        """Return the set-up at values, as SVG."""
        with self.one_at_a_time, collected():
            simulation = self.simulation(self.changed(values))
            return {"svg": svg(drawn("setup", "", partial(setup, simulation)).figure)}

    def simulation(self, case: Case) -> CoSimulation:
        return case.simulation() if self.modes is None else self.modes(case.simulation)


def modes_for(case: Case, sliders: Sequence[Slider]) -> OnModes | None:
    """Return the modes of the plates at all values of the sliders; None where modes do not serve them all."""
    moved = [slider for slider in sliders if slider.path[0] in ("structure", "materials")]
    reduced = case.tree.entries["run"].entries.get("reduce", True)
    if not moved or reduced is not True or any(slider.choices for slider in moved):
        return None
    changes: list[dict[str, float]] = [{}]
    for slider in moved:
        changes += [{slider.name: float(end * slider.size)} for end in (slider.low, slider.high)]
    return modes_of([case.changed(change).simulation for change in changes], case.until)


def thinned(force: xr.DataArray) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times and forces for a curve of few points: samples at even steps, and the extreme forces."""
    values = force.values
    even = np.linspace(0, values.size - 1, min(values.size, MOST_POINTS - 2)).astype(int)
    rows = np.unique([*even, values.argmin(), values.argmax()])
    return force.time.values[rows], values[rows]
