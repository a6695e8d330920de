"""Numbers beyond those of any quantity, and kinds of numbers: an error that names the argument, or the usual result."""

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

import hertzlink as hl

STEEL = hl.STEEL_440C
PLATE = hl.kirchhoff_plate(0.1, 0.1, 2e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"), cells=(8, 8))
TIME = np.linspace(0.0, 4e-4, 801)
TAP = hl.as_signal(TIME, {7: np.exp(-(((TIME - 1e-4) / 1e-5) ** 2))})


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: hl.Layer(STEEL, 1e308, 1e-2), r"length = 1e\+308: must be at most 1e\+100"),
        (lambda: hl.Layer(STEEL, 1e101, 1e-2), r"length = 1e\+101: must be at most 1e\+100"),
        (lambda: hl.Aitken(largest_count=10**400), r"largest_count = .*: must be"),
        (
            lambda: hl.OrthotropicMaterial(135e9, 9e9, 0.3, 5e-324, 5e9, 3.2e9, 1560.0),
            r"shear_modulus = 5e-324: must be a positive number of Pa, at least 1e-100",
        ),
        (lambda: hl.average_taps([TAP, TAP], sensor=7.5), r"sensor = 7\.5: must be a whole number"),
    ],
)
def test_numbers_beyond_any_quantity(call: Callable[[], Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        call()


def test_kinds_of_numbers() -> None:
    """A fraction, and an array without dimensions, are numbers."""
    assert hl.average_taps([TAP, TAP], sensor=Fraction(7)).sensor.item() == 7
    plate = hl.kirchhoff_plate(0.1, 0.1, 2e-3, hl.ALUMINIUM_6061, hl.Supports("clamped"))
    assert hl.ModalPlate(plate, 1e-4).at(x=0.03, y=np.array(0.05)).origin["at"] == [0.03, 0.05]


def test_deep_input_and_what_is_not_there(tmp_path: Any) -> None:
    """A result whose input is no input of ours is reported without it; measures name the variable that they lack."""
    bead = hl.Sphere(4.76e-3, STEEL)
    run = hl.CoSimulation(hl.Chain([bead] * 12, bead, 0.3), hl.half_space(STEEL)).run(5e-4)
    deep = run.assign_attrs(input="[" * 100_000 + "]" * 100_000)
    assert hl.plots.report(deep, tmp_path / "deep.html").exists()
    with pytest.raises(ValueError, match="run: holds no velocity"):
        hl.reflections(run.drop_vars("velocity"), 6)
