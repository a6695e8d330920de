"""The accuracy of a run in time, by name: windows and steps in the shortest contact."""

from typing import Annotated, NamedTuple

from structures.quantities import OneOf


class Accuracy(NamedTuple):
    """The accuracy of a run in units of the default; errors fall with the square of these numbers."""

    windows: float
    steps: float


ACCURACIES = {
    "default": Accuracy(1.0, 1.0),
    "screening": Accuracy(windows=40.0 / 112.0, steps=160.0 / 1800.0),
    "reference": Accuracy(4.0, 4.0),
}
"""Screening has 40 windows and 160 steps in the shortest contact, for Condensed; the default 112 and 1800. On rods,
plates and half-spaces screening changed AR by 1e-4 or less, by 5e-4 where a light tip chatters (tests)."""

HowFine = Annotated[str, OneOf(*ACCURACIES)]
