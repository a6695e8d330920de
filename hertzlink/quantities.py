"""Physical quantities for the annotations of parts of your own, each with its unit and its range."""

from structures.quantities import Angle as Angle
from structures.quantities import Count as Count
from structures.quantities import Force as Force
from structures.quantities import Frequency as Frequency
from structures.quantities import Length as Length
from structures.quantities import OneOf as OneOf
from structures.quantities import Quantity as Quantity
from structures.quantities import Time as Time
