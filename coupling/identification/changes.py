"""How signals change with unknowns, and what a part of them determines: some sensors, a shorter record, known ones."""

from collections.abc import Callable, Iterable, Sequence
from math import inf
from typing import TYPE_CHECKING

import numpy as np

from coupling.identification.prediction import Curves, Prediction
from coupling.identification.search import inverse
from structures.structure import Vector

if TYPE_CHECKING:
    from coupling.identification.information import Design

STEP = 1e-3
"""Half the distance of runs for a derivative, as a part of the value."""

DRAWS, SEED = 64, 0
"""Noisy traces from which the errors of AR and TOF are taken: exact to 9 %."""


class Changes:
    """How the signals of a design change with the unknowns, from one batch of runs, of which any part can be taken.

    Bounds that it gives are parts of the values. step: half the distance of runs for a derivative, as such a part.
    """

    def __init__(self, design: "Design", step: float = STEP) -> None:
        self.design = design
        steps = np.full(design.places.size, step)
        self.slopes = design.prediction.slopes(design.places, design.here, steps)
        if not np.isfinite(self.slopes).all():
            raise FloatingPointError("a run beside the values failed")
        point = design.misfit.point(design.misfit.start_at(design.places), design.here, self.slopes)
        names = design.misfit.names
        self.columns = point.columns.reshape(len(design.prediction.sensors), -1, len(names))

    def part(self, sensors: Sequence[int], until: float = inf, unknowns: Iterable[str] | None = None) -> Vector:
        """Columns of the unknowns that are not known otherwise, and of the nuisances of these sensors."""
        names, own = self.design.misfit.names, {str(n) for n in sensors}
        free = self._free(unknowns)
        used = [
            k for k, name in enumerate(names)
            if name in free or (name not in self.design.values and (" " not in name or name.split(" ")[1] in own))
        ]  # fmt: skip
        rows = [self.design.prediction.sensors.index(n) for n in sensors]
        inside = self.design.measured.time <= until
        return self.columns[rows][:, inside].reshape(-1, len(names))[:, used]

    def waveform(
        self, sensors: Sequence[int], until: float = inf, unknowns: Iterable[str] | None = None
    ) -> dict[str, float]:
        """Bounds from all samples up to a time, s; `unknowns`: the others are known."""
        return self._bounds(self.part(sensors, until, unknowns), self._free(unknowns))

    def features(
        self, sensors: Sequence[int], until: float = inf, draws: int = DRAWS
    ) -> Callable[[Iterable[str] | None], dict[str, float]]:
        """A function of the unknowns that gives bounds from AR and TOF, whose errors come from noisy draws."""
        design = self.design
        rows = [design.prediction.sensors.index(n) for n in sensors]
        moments = design.prediction.interval * np.arange(design.here.shape[-1])
        early, time = moments <= until, design.measured.time
        grid = time[time <= until]
        here = design.here[rows]
        spread = spread_of_features(design.prediction, grid, Curves(here, design.prediction.interval).at(grid), sensors,
                                    design.measured.noise[rows], draws)  # fmt: skip
        columns = np.zeros((spread.size, design.places.size))
        # Traces that change in proportion are exact enough for derivatives, and need no runs.
        for k, slope in enumerate(self.slopes[:, rows]):
            ends = [
                design.prediction.primaries(moments[early], (here + step * slope)[:, early], sensors)
                for step in (STEP, -STEP)
            ]
            columns[:, k] = (ends[0] - ends[1]) / (2.0 * STEP) / spread
        columns = columns[np.isfinite(columns).all(axis=1)]
        names = list(design.values)

        def bounds(unknowns: Iterable[str] | None = None) -> dict[str, float]:
            free = self._free(unknowns)
            return self._bounds(columns[:, [names.index(name) for name in free]], free)

        return bounds

    def _free(self, unknowns: Iterable[str] | None) -> list[str]:
        wanted = set(self.design.values if unknowns is None else unknowns)
        return [name for name in self.design.values if name in wanted]

    @staticmethod
    def _bounds(columns: Vector, free: Sequence[str]) -> dict[str, float]:
        """Infinite where there is less to compare than to find, or where a wave is missing."""
        if columns.shape[0] < columns.shape[1]:
            return dict.fromkeys(free, inf)
        covariance = inverse(columns)
        unseen = [not column.any() for column in columns.T]
        return {name: inf if unseen[k] else float(np.sqrt(covariance[k, k])) for k, name in enumerate(free)}


def spread_of_features(
    prediction: Prediction, time: Vector, clean: Vector, sensors: Sequence[int], noise: Vector, draws: int
) -> Vector:
    """Standard deviations of AR and TOF at each sensor; NaN where no wave, or not in every draw one, is found."""
    random = np.random.default_rng(SEED)
    sized = clean.shape
    noisy = [
        prediction.primaries(time, clean + random.normal(size=sized) * noise[:, None], sensors) for _ in range(draws)
    ]
    found = np.array(noisy)
    with np.errstate(invalid="ignore"):
        spread = found.std(axis=0)
    return np.where(spread > 0.0, spread, np.nan)
