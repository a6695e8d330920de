"""One tap on a body under a stress or a pressure: what this level changes, and how well one trace gives it."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any, ClassVar

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.results import over
from structures.caution import collected

NOISE = 0.01  # Part of a trace's peak.
# Of reductions: with the usual one the basis changes with the level by so much that bounds change by 50 %.
TOLERANCE = 1e-4
MEASURES = (hl.amplitude_ratio, hl.time_of_flight)


@dataclass(frozen=True)
class Body:
    """A body that a chain of steel beads taps.

    diameter: of the beads, m. until: length of the record, s. levels: Pa. near: the level whose error is estimated, Pa.
    """

    name: str
    diameter: float
    until: float
    levels: tuple[float, ...]
    near: float

    beads: ClassVar[int] = 20
    sensor: ClassVar[int] = 10
    speed: ClassVar[float] = 0.31

    def built(self, level: float, factor: float) -> hl.Structure:
        """Return the reduced body, with a factor of its stiffness."""
        raise NotImplementedError

    def scales(self, levels: np.ndarray) -> dict[str, Any]:
        """Return the levels, Pa, and what they are compared with, as variables."""
        raise NotImplementedError

    @cached_property
    def _built(self) -> Callable[[float, float], hl.Structure]:
        return cache(self.built)  # half the runs are of a body that another one had

    def tap(self, level: float, stiffness: float, impact_speed: float) -> hl.CoSimulation:
        """Return the chain on the body; stiffness: a factor of its own."""
        bead = hl.Sphere(0.5 * self.diameter, hl.STEEL_440C)
        return hl.CoSimulation(hl.Chain([bead] * self.beads, bead, impact_speed), self._built(level, stiffness))

    def bound(self, part: float) -> float:
        """Return the Cramér–Rao bound of the level, Pa, from one trace, by a part of the usual step."""

        def build(level: float, stiffness: float, impact_speed: float) -> hl.CoSimulation:
            return self.tap(self.near * (1.0 + part * (level - 1.0)), stiffness, impact_speed)

        with collected():  # that elastic contacts are beyond yield, or wide, is said elsewhere
            estimate = hl.identifiability(
                build, NOISE, sensors=[self.sensor], until=self.until,
                level=1.0, stiffness=1.0, impact_speed=self.speed,
            )  # fmt: skip
        return float(estimate.bounds["level"] * self.near * part)

    def measured(self, quick: bool, steps: Sequence[float]) -> xr.Dataset:
        """Return AR and TOF over the levels, and the bounds by parts of the usual step, NaN for a part of 0."""
        levels = np.array(self.levels[::2] if quick else self.levels)
        runs = [self.tap(level, 1.0, self.speed).run(self.until) for level in levels.tolist()]
        ratios, flights = ([float(read(run, self.sensor)) for run in runs] for read in MEASURES)
        least, other = (self.bound(part) if part else np.nan for part in steps)
        return xr.Dataset(
            {
                **self.scales(levels),
                "amplitude_ratio": ("case", ratios, {"units": "1"}),
                "time_of_flight": ("case", flights, {"units": "s"}),
                "deviation": ((), least, {"units": "Pa", "long_name": "least standard deviation"}),
                "deviation_by_twice_the_step": ((), other, {"units": "Pa"}),
            },
            {"case": range(levels.size)},
        )


def over_bodies(axis: str, bodies: Sequence[Body], quick: bool, steps: Sequence[float]) -> xr.Dataset:
    """Return what is measured on each body, along an axis; NaN where one has fewer levels than others.

    quick: every second level. steps: as of `measured`.
    """
    by_name = {body.name: body for body in bodies}
    with collected():  # that contacts yield, or are wide, is said elsewhere
        data = over(lambda body: by_name[body].measured(quick, steps), body=list(by_name))
    return data.drop_vars("case").rename({"body": axis})


def figure(
    lines: Iterable[tuple[str, Any, Any, Any]], xlabel: str, ylabels: tuple[str, str]
) -> tuple[draw.Figure, list[draw.Axes]]:
    """Draw changes of AR and TOF over the level. lines: name, level and both changes of each body."""
    drawn, axes = draw.panels(2, width=3.7, height=3.4, sharey=False, xlabel=xlabel, ylabels=ylabels)
    for name, level, *changes in lines:
        for axis, change in zip(axes, changes, strict=True):
            axis.plot(level, change, label=name)
    axes[1].legend(loc="lower left")
    return drawn, axes
