"""Physical quantities, each declared once: unit, valid range, probable range, and an example for case files.

The annotation of a parameter, such as `length: Length`, declares its check, its warning, its unit, and how a case file
writes it.
"""

import re
from dataclasses import dataclass, replace
from math import inf, isnan, pi
from typing import Annotated

from structures.caution import caution
from structures.checks import MOST, one_of, positive, whole, within
from structures.units import factor, spread_of

PLAIN = str.maketrans({"²": "^2", "³": "^3"})


@dataclass(frozen=True)
class Quantity:
    """The meaning of a number. Use it in an annotation: `Annotated[float, Quantity("N/m", "a stiffness", "200 N/m")]`.

    Parameters
    ----------
    unit, noun, example : str
        The SI unit; the name of the quantity, with an article; and an example from a case file.
    low, high, or_zero, ends : float and bool
        The valid range in `unit`; whether zero is valid too, and whether the ends are, if they are not zero.
    likely : (float, float)
        The probable size, if it is not zero. Outside it a warning asks whether the number is in another unit.
    below, above, counted_in : str
        For the warning: likely units of numbers below and above, and the meaning of a pure number: "times the modulus".
    largest : float
        The largest size that exists; a unit in which the number would be larger is not suggested.
    written : str, optional
        The unit in case files, if it differs from `unit`.

    Examples
    --------
    >>> hl.quantities.Quantity("m", "a length", "2 mm").check("length", 3)
    3.0
    """

    unit: str = ""
    noun: str = "a number"
    example: str = "0.02"
    low: float = 0.0
    high: float = inf
    or_zero: bool = False
    ends: bool = True
    likely: tuple[float, float] = (0.0, inf)
    below: str = ""
    above: str = ""
    counted_in: str = ""
    largest: float = inf
    written: str | None = None

    def __post_init__(self) -> None:
        # With mm as the unit, "2 mm" in a case would become 2.0, and the structure would be a thousand times too large.
        if re.search(r"\b([µmckMG](m|N|Pa|Hz|s|J)|m?g)\b", self.unit):
            raise ValueError(f"unit = {self.unit!r}: must be an SI unit without a prefix, such as m, N/m or Pa")

    def __repr__(self) -> str:
        return self.unit or "a number"  # short, because signatures in help show it

    @property
    def unit_in_files(self) -> str:
        """The unit as it is written in case files."""
        return self.unit.translate(PLAIN) if self.written is None else self.written

    def check(self, name: str, value: float) -> float:
        """Return `value` as a float; raise a ValueError that names the argument if it is not valid."""
        return within(name, value, self.low, self.high, self.unit, self.or_zero, self.ends)

    def warn(self, owner: str, name: str, value: float) -> None:
        """Warn if a number that is not zero lies outside the probable range."""
        size, (low, high) = abs(value), self.likely
        if size == 0.0 or low <= size <= high:
            return
        units, fitting = (self.below if size < low else self.above).split(" or "), []
        for unit in units:
            try:
                converted = size * float(factor(unit, self.unit.translate(PLAIN)))
            except ValueError:  # a unit of another quantity, which may be meant
                converted = low
            fitting += [unit] * (low <= converted <= min(high, self.largest))
        other = " or ".join(fitting or units)
        read = f"{value:g} {self.counted_in or self.unit}, which is improbable"
        caution(f"{owner} {name} = {value:g}: is read as {read}; did you mean {value:g} {other}?")


def standard_uncertainty(name: str, text: float | str, value: float) -> float:
    """Return a standard uncertainty in SI units."""
    if not isinstance(text, str):
        return positive(name, text)
    if isnan(number := spread_of(text, value)):
        part = ' or "2 %"' if value else ", but not in %, as the value is 0"
        raise ValueError(f'{name} = {text!r}: must be a standard uncertainty, such as 1e-5, "0.01 mm"{part}')
    return number


class OneOf:
    """The words that a text argument may be, for an annotation.

    Parameters
    ----------
    *words : str
        The allowed words.

    Examples
    --------
    >>> hl.quantities.OneOf("fixed", "free").check("base", "free")
    'free'
    """

    def __init__(self, *words: str) -> None:
        self.words = words

    def __repr__(self) -> str:
        return " | ".join(map(repr, self.words))

    def check(self, name: str, value: str) -> str:
        """Return `value`; raise a ValueError with the words if it is not one of them."""
        return one_of(name, value, self.words)


@dataclass(frozen=True)
class Count:
    """A whole number that counts something, for an annotation.

    Parameters
    ----------
    least, most : int
        The least and the greatest number allowed.

    Examples
    --------
    >>> hl.quantities.Count(1, 30).check("modes", 7)
    7
    """

    least: int = 1
    most: int = MOST

    def __repr__(self) -> str:
        return f"≥ {self.least}" if self.most == MOST else f"{self.least} to {self.most}"

    def check(self, name: str, value: int) -> int:
        """Return `value` as an int; raise a ValueError if it is not a whole number in the range."""
        return whole(name, value, self.least, self.most)


@dataclass(frozen=True)
class Asks:
    """The words with which a message asks for a missing entry of a case."""

    text: str

    def __repr__(self) -> str:
        return self.text


class InFile(Asks):
    """An argument that is read from a file; a case gives the name of the file."""

    def __init__(self, what: str, example: str) -> None:
        super().__init__(f'the file of {what}, such as "{example}"')


class Likely:
    """Quantities with a probable range. All values in Khatri's thesis, the examples and the studies lie inside.

    A limit exists only if a number beyond it may be in another common unit. Stiffnesses of edges and foundations, and
    losses in N s/m, have no limits, because any size is possible.
    """

    # Beads in the literature have radii of 0.1 to 100 mm. Outside the valid range products of lengths lose digits.
    BEAD = Quantity("m", "a length", "2.29 mm", 1e-9, 1e6, likely=(0.0, 0.2), above="mm")
    # Twice the largest radius.
    BEAD_SIZE = Quantity("m", "a length", "9.5 mm", likely=(0.0, 0.4), above="mm")
    # Mass divided by the cube of the size: from 13 for a ball of the lightest foam to 4e5 for a flat disc of steel.
    BULK = Quantity("kg/m³", "a density", "2700 kg/m^3", likely=(5.0, 5e5), below="g/cm³", above="g/m³")
    # From plates and rods in a laboratory up to the walls of ships.
    SIDE = Quantity("m", "a length", "2.29 mm", likely=(0.0, 20.0), above="mm")
    # An echo from farther away arrives after the end of a record of a few ms.
    DISTANCE = Quantity("m", "a length", "2.29 mm", likely=(0.0, 5.0), above="mm")
    THICKNESS = Quantity("m", "a length", "2.29 mm", likely=(0.0, 1.0), above="mm")
    # Outside the valid range the cube of a thickness, times a modulus, leaves the range of floating point.
    PLY = replace(THICKNESS, low=1e-12, high=1e4, likely=(0.0, 0.1))
    # Rubber has about 1 MPa, a honeycomb core 10 kPa in its plane, diamond 1.2e12 Pa; a rigid body may have any value.
    MODULUS = Quantity("Pa", "a modulus", "70 GPa", likely=(5e5, inf), below="GPa or MPa", largest=2e12)
    PLY_MODULUS = replace(MODULUS, likely=(1e4, inf))
    # Foams yield at about 100 kPa, hard steel at 2 GPa.
    STRENGTH = Quantity("Pa", "a strength", "170 MPa", likely=(1e4, inf), below="MPa or GPa", largest=2e12)
    # 10 MPa in a foil of 10 µm is 100 N/m.
    FORCE_PER_LENGTH = Quantity(
        "N/m", "a force per length", "20 kN/m", -inf, likely=(50.0, inf), below="N/mm, or a stress in MPa"
    )
    # The lightest foams that carry load have about 30 kg/m³; no solid has more than 22.6 g/cm³.
    DENSITY = Quantity("kg/m³", "a density", "2700 kg/m^3", likely=(25.0, inf), below="g/cm³")
    # A chain is struck at 1 m/s or less. Below the valid range nothing happens, above it no solid survives.
    SPEED = Quantity("m/s", "a speed", "0.31 m/s", 1e-12, 1e5, likely=(0.0, 30.0), above="mm/s")
    HEIGHT = Quantity("m", "a length", "2.29 mm", likely=(0.0, 3.0), above="mm")
    # A contact of steel beads lasts 25 to 110 µs, one of soft beads a few ms.
    FREQUENCY = Quantity("Hz", "a frequency", "40 kHz", likely=(500.0, inf), below="kHz")
    # A geotechnical centrifuge reaches 2000 m/s².
    GRAVITY = Quantity("m/s²", "an acceleration", "9.81 m/s^2", or_zero=True, likely=(0.0, 5e3), above="mm/s²")
    PRELOAD = Quantity("N", "a force", "2 N", or_zero=True, likely=(0.0, 1e6), above="mN")
    MASS = Quantity("kg", "a mass", "2 g", likely=(0.0, 100.0), above="g")
    MASS_PER_LENGTH = Quantity("kg/m", "a mass per length", "0.2 kg/m", likely=(0.0, 100.0), above="g/m")
    # A toy spring has 1 N/m; no actuator compresses its spring by a metre.
    SPRING = Quantity("N/m", "a stiffness", "200 N/m", likely=(1.0, inf), below="N/mm")
    WAY = Quantity("m", "a length", "2.29 mm", likely=(0.0, 1.0), above="mm")
    # A steel bar 30 mm high has 2e4 N m².
    BENDING = Quantity("N m²", "a stiffness", "20 N m^2", likely=(0.0, 1e6), above="N mm²")
    # A standard deviation. Noise as large as the force hides the signal.
    NOISE = Quantity(likely=(0.0, 1.0), above="%", counted_in="times the greatest force")
    # For beads of 1 to 40 mm: 10 mN to a few kN.
    MEASURED_FORCE = Quantity("N", "a force", "2 N", likely=(1e-3, 1e4), below="kN or V", above="mN or mV")
    # A solitary wave of steel beads lasts 20 to 200 µs, one of soft beads a few ms.
    WAVE = Quantity("s", "a time", "100 us", likely=(1e-6, 0.01), below="ms or µs", above="µs or ms")
    # An arm as stiff as the body relaxes half of it. Polymers have arms of up to a few times their slow modulus.
    SHARE = Quantity(likely=(0.0, 10.0), above="%", counted_in="times the modulus")
    # Fraction of critical damping: steel has 0.001, rubber 0.1.
    RATIO = Quantity(or_zero=True, likely=(0.0, 1.0), above="%", counted_in="times the critical damping")
    # Oscilloscopes sample at 1 µs; a contact of soft beads lasts a few ms.
    SAMPLE = Quantity("s", "a time", "1 us", likely=(0.0, 1e-3), above="µs or ms")
    # A run lasts a few ms; a process that takes more than a second has no effect in it.
    TIME = Quantity("s", "a time", "1.5 ms", likely=(0.0, 1.0), above="µs or ms")


Several = Annotated[int, Count()]
Length = Annotated[float, Quantity("m", "a length", "2.29 mm")]
Coordinate = Annotated[float, Quantity("m", "a length", "2.29 mm", -inf)]
Component = Annotated[float, Quantity(low=-inf)]
Curvature = Annotated[float, Quantity("1/m", "a curvature", "50 1/m", -inf)]
Scale = Annotated[float, Quantity("m per unit of the mesh", written="")]
Place = Annotated[float, Quantity("m", "a length", "2.29 mm", or_zero=True)]
Side = Annotated[float, Likely.SIDE]
WallThickness = Annotated[float, replace(Likely.PLY, likely=Likely.THICKNESS.likely)]
Angle = Annotated[float, Quantity("rad", "an angle", "45 deg", -2.0 * pi, 2.0 * pi)]
Direction = Annotated[float, Quantity("rad", "an angle", "45 deg", -inf)]
Time = Annotated[float, replace(Likely.TIME, or_zero=True)]
Interval = Annotated[float, Quantity("s", "a time", "1.5 ms")]
Moment = Annotated[float, replace(Likely.TIME, low=-inf)]
RelaxationTime = Annotated[float, Likely.TIME]
Rate = Annotated[float, Quantity("1/s", "a rate", "100 1/s", or_zero=True)]
Frequency = Annotated[float, Likely.FREQUENCY]
Force = Annotated[float, Quantity("N", "a force", "2 N", -inf)]
ContactForce = Annotated[float, Quantity("N", "a force", "2 N", or_zero=True)]
Modulus = Annotated[float, Likely.MODULUS]
PoissonRatio = Annotated[float, Quantity(low=-1.0, high=0.5, ends=False)]
Density = Annotated[float, Likely.DENSITY]
Strength = Annotated[float, Likely.STRENGTH]
BendingStiffness = Annotated[float, Likely.BENDING]
MassPerLength = Annotated[float, Likely.MASS_PER_LENGTH]
Share = Annotated[float, Likely.SHARE]
WhichModulus = Annotated[str, OneOf("relaxed", "instantaneous")]
