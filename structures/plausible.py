"""Probable ranges of the numbers of bead experiments: a number outside is perhaps in another unit."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import inf
from typing import NamedTuple

from structures.caution import caution, collected


class Likely(NamedTuple):
    """The probable range of a quantity in SI units, and the unit that a number below or above the range may have."""

    low: float
    high: float
    unit: str
    if_low: str = ""
    if_high: str = ""


LIKELY = {
    # Balls of 400 mm diameter; chains in the literature have beads of 0.1 to 100 mm.
    "bead": Likely(0.0, 0.2, "m", "", "mm"),
    # Twice the largest radius.
    "bead size": Likely(0.0, 0.4, "m", "", "mm"),
    # Mass over the cube of the size: 13 of a ball of the lightest foam, up to 4e5 of a flat disc of steel.
    "bulk": Likely(5.0, 5e5, "kg/m³", "g/cm³", "g/m³"),
    # From plates, panels and rods of the laboratory up to the walls of ships.
    "side": Likely(0.0, 20.0, "m", "", "mm"),
    # An echo from farther away comes after any record of a few ms.
    "distance": Likely(0.0, 5.0, "m", "", "mm"),
    "thickness": Likely(0.0, 1.0, "m", "", "mm"),
    "ply": Likely(0.0, 0.1, "m", "", "mm"),
    # Rubber has some 1 MPa, and the plane of a honeycomb core 10 kPa; a rigid body may have any modulus.
    "modulus": Likely(5e5, inf, "Pa", "GPa or MPa"),
    "ply modulus": Likely(1e4, inf, "Pa", "GPa or MPa"),
    # Foams yield at some 100 kPa, hard steel at 2 GPa.
    "strength": Likely(1e4, inf, "Pa", "MPa or GPa"),
    # 10 MPa in a foil of 10 µm are 100 N/m.
    "force per length": Likely(50.0, inf, "N/m", "N/mm, or a stress in MPa"),
    # A balloon has some kPa, a tennis ball 80.
    "pressure": Likely(500.0, inf, "Pa", "kPa, bar or MPa"),
    # The lightest foams that carry load have about 30 kg/m³; no solid has more than 22.6 g/cm³.
    "density": Likely(25.0, inf, "kg/m³", "g/cm³"),
    # A chain is struck at 1 m/s or less; steel yields above a few m/s.
    "speed": Likely(0.0, 30.0, "m/s", "", "mm/s"),
    "height": Likely(0.0, 3.0, "m", "", "mm"),
    # A contact of steel beads lasts 25 to 110 µs, one of soft beads a few ms.
    "frequency": Likely(500.0, inf, "Hz", "kHz"),
    # A geotechnical centrifuge reaches 2000 m/s².
    "gravity": Likely(0.0, 5e3, "m/s²", "", "mm/s²"),
    "preload": Likely(0.0, 1e6, "N", "", "mN"),
    "mass": Likely(0.0, 100.0, "kg", "", "g"),
    "mass per length": Likely(0.0, 100.0, "kg/m", "", "g/m"),
    # A toy spring has 1 N/m; no actuator compresses its spring by a metre.
    "spring": Likely(1.0, inf, "N/m", "N/mm"),
    "way": Likely(0.0, 1.0, "m", "", "mm"),
    # A steel bar 30 mm high has 2e4 N m².
    "beam": Likely(0.0, 1e6, "N m²", "", "N mm²"),
    # A standard deviation; noise as large as the force leaves nothing to see.
    "noise": Likely(0.0, 1.0, "times the greatest force", "", "%"),
    # Beads of 1 to 40 mm: 10 mN to some kN.
    "measured force": Likely(1e-3, 1e4, "N", "kN or V", "mN or mV"),
    # A solitary wave of steel beads lasts 20 to 200 µs, one of soft beads a few ms.
    "wave": Likely(1e-6, 0.01, "s", "ms or µs", "µs or ms"),
    # An arm as stiff as the bead itself relaxes half of it; polymers have arms of up to a few times their slow modulus.
    "share": Likely(0.0, 10.0, "times the modulus", "", "%"),
    # Part of the critical damping: steel has 0.001, rubber 0.1.
    "ratio": Likely(0.0, 1.0, "times the critical damping", "", "%"),
    # Oscilloscopes take 1 µs; a contact of soft beads lasts a few ms.
    "sample": Likely(0.0, 1e-3, "s", "", "µs or ms"),
    # A run lasts a few ms; a process that takes more than a second does not show in it.
    "time": Likely(0.0, 1.0, "s", "", "µs or ms"),
}
"""Wide ranges: everything in Khatri's thesis, the examples and the studies lies inside. A limit exists only where a
number beyond it may be in another common unit. Stiffnesses of edges and foundations, and losses in N s/m, have no
limit, because any size is possible.
"""


def likely(quantity: str, owner: str, name: str, value: float) -> None:
    """Warn if a number other than zero lies outside the probable range of a quantity of LIKELY; name the argument.

    Dimensionless calculations use units of one: see `units_of_one`.
    """
    low, high, unit, if_low, if_high = LIKELY[quantity]
    size = abs(value)
    if size == 0.0 or low <= size <= high:
        return
    caution(f"{owner} {name} = {value:g}: is read as {value:g} {unit}; is it in {if_low if size < low else if_high}?")


@contextmanager
def units_of_one() -> Iterator[None]:
    """No such warnings inside this context: for dimensionless calculations, as with Material(1.0, 0.0, 1.0)."""
    with collected():
        yield
