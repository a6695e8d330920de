"""What numbers are likely in experiments with beads: a number outside is perhaps in another unit."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from typing import NamedTuple

from structures.caution import caution, collected


class Likely(NamedTuple):
    """The range of a quantity in SI units, and the unit that a number below it, or above it, may be in."""

    low: float
    high: float
    unit: str
    if_low: str = ""
    if_high: str = ""


LIKELY = {
    # Balls of 400 mm diameter; chains in the literature have beads of 0.1 to 100 mm.
    "bead": Likely(0.0, 0.2, "m", "", "mm"),
    # Plates, panels and rods that fit into a laboratory, up to the walls of ships.
    "side": Likely(0.0, 20.0, "m", "", "mm"),
    "thickness": Likely(0.0, 1.0, "m", "", "mm"),
    "ply": Likely(0.0, 0.1, "m", "", "mm"),
    # Rubber has some 1 MPa, and the plane of a honeycomb core 10 kPa; a rigid body may have any modulus.
    "modulus": Likely(5e5, inf, "Pa", "GPa or MPa"),
    "ply modulus": Likely(1e4, inf, "Pa", "GPa or MPa"),
    # Foams yield at some 100 kPa, hard steel at 2 GPa.
    "strength": Likely(1e4, inf, "Pa", "MPa or GPa"),
    # The lightest foams that bear anything have some 30 kg/m³; no solid has more than 22.6 g/cm³.
    "density": Likely(25.0, inf, "kg/m³", "g/cm³"),
    # A chain is struck at 1 m/s or less; above some m/s steel yields.
    "speed": Likely(0.0, 30.0, "m/s", "", "mm/s"),
    "height": Likely(0.0, 3.0, "m", "", "mm"),
    # A contact of steel beads lasts 25 to 110 µs, one of soft beads some ms.
    "frequency": Likely(500.0, inf, "Hz", "kHz"),
    # A centrifuge for soil reaches 2000 m/s².
    "gravity": Likely(0.0, 5e3, "m/s²", "", "mm/s²"),
    "preload": Likely(0.0, 1e6, "N", "", "mN"),
    "mass": Likely(0.0, 100.0, "kg", "", "g"),
    "mass per length": Likely(0.0, 100.0, "kg/m", "", "g/m"),
    # The spring of a toy has 1 N/m; no actuator's is compressed by a metre.
    "spring": Likely(1.0, inf, "N/m", "N/mm"),
    "way": Likely(0.0, 1.0, "m", "", "mm"),
    # A steel bar 30 mm high has 2e4 N m².
    "beam": Likely(0.0, 1e6, "N m²", "", "N mm²"),
    # A run lasts some ms; what lasts longer than a second does not show in it.
    "time": Likely(0.0, 1.0, "s", "", "µs or ms"),
}
"""Wide ranges: nothing in Khatri's thesis lies outside, nor do the structures of the examples and studies. There is a
limit only where another unit is in use that a number beyond it may be in. Stiffnesses of edges and foundations, and
losses in N s/m, have none: they may have any size."""


def likely(quantity: str, owner: str, name: str, value: float) -> None:
    """A warning where a number, zero apart, is outside what is likely for a quantity of LIKELY; it names the argument.

    Calculations without dimensions use units of one: see `units_of_one`.
    """
    low, high, unit, if_low, if_high = LIKELY[quantity]
    size = abs(value)
    if size == 0.0 or low <= size <= high:
        return
    caution(f"{owner} {name} = {value:g}: is taken as {value:g} {unit}; is it in {if_low if size < low else if_high}?")


@contextmanager
def units_of_one() -> Iterator[None]:
    """Within it no warning is given: for calculations without dimensions, as with Material(1.0, 0.0, 1.0)."""
    with collected():
        yield
