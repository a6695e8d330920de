"""One basis for a thin rectangular plate at all values of its sliders, so that no run needs a mesh of its own."""

from collections.abc import Sequence
from typing import Any

from hertzlink.cases.building import structure_of, world_of
from hertzlink.cases.case import Case
from hertzlink.cases.model import CaseModel
from hertzlink.cases.parts import World, material_of
from hertzlink.cases.plate_models import scales
from hertzlink.cases.plates import KirchhoffPlate
from hertzlink.explore.sliders import Slider
from plates.reduced import ReducedPlate
from structures.caution import collected
from structures.structure import Structure

TOLERANCE, MOST_ERROR = 0.03, 0.1
"""Error of the displacement after a pulse that a basis is made for, and the largest with which it is used: with 0.3
late waves are wrong, with 0.07 AR is off by some 1e-4."""

SLACK = 1e-9
"""Rounding of values at the ends of sliders."""


class PlateBasis:
    """The basis, and the plates that it gives.

    case: at the first values. It is prepared for the slowest waves and the longest record that the sliders allow.
    """

    def __init__(self, case: Case, sliders: Sequence[Slider]) -> None:
        world = world_of(case.model, case.folder)
        body = case.model.structure
        assert isinstance(body, KirchhoffPlate)
        ranges = {one.path[1:]: (one.si(one.low), one.si(one.high)) for one in of_structure(sliders)}
        material = material_of(body.substance, world)
        slowest, fastest = (
            speed(
                ranges.get(("thickness",), (body.depth,) * 2)[end],
                ranges.get(("material", "youngs_modulus"), (material.youngs_modulus,) * 2)[end],
                ranges.get(("material", "density"), (material.density,) * 2)[1 - end],
            )
            for end in (0, 1)
        )
        self.slowest, self.fastest = slowest, fastest
        thickness = body.depth * slowest / speed(body.depth, material.youngs_modulus, material.density)
        plate = body.model_copy(update={"thickness": thickness}).plate(world)
        places = []
        for i, (place, side) in enumerate(zip(body.place, (body.length, body.width), strict=True)):
            margin = 0.5 * plate.finest_cell
            low, high = ranges.get(("at", i), (place, place))
            places.append(place if low == high else (max(low, margin), min(high, side - margin)))
        with collected():
            # Where it does not reach the tolerance, `error` says so.
            self.basis = ReducedPlate(plate, world.until * fastest / slowest, places[0], places[1], TOLERANCE)

    @property
    def error(self) -> float:
        """The estimated error."""
        return float(self.basis.basis.errors[0][1])

    def structure(self, model: CaseModel, world: World) -> Structure | None:
        """The plate of a case; one on a mesh of its own where the basis does not serve it."""
        body = model.structure
        assert isinstance(body, KirchhoffPlate)
        material = material_of(body.substance, world, "structure", "material")
        waves = speed(body.depth, material.youngs_modulus, material.density)
        inside = all(_within(*pair) for pair in zip(body.place, (self.basis.x, self.basis.y), strict=True))
        if inside and self.slowest * (1.0 - SLACK) <= waves <= self.fastest * (1.0 + SLACK):
            return self.basis.at(body.place[0], body.place[1], thickness=body.depth, material=material)
        own: Structure | None = structure_of(body, model.run, world, ("structure",))
        return own


def of_structure(sliders: Sequence[Slider]) -> list[Slider]:
    """The sliders that change the structure."""
    return [one for one in sliders if one.path[0] == "structure"]


def has_basis(case: Case, sliders: Sequence[Slider]) -> bool:
    """Whether a plate has one basis for all values."""
    moved = of_structure(sliders)
    if not moved or case.model.run.reduce is not True or any(one.choices for one in moved):
        return False
    return not any(one.path[0] == "materials" for one in sliders) and scales(
        case.model, {one.path[1:] for one in moved}
    )


def speed(thickness: float, modulus: float, density: float) -> float:
    """What the frequencies of a plate are proportional to."""
    return thickness * float((modulus / density) ** 0.5)


def _within(place: float, range_: Any) -> bool:
    low, high = range_ if isinstance(range_, tuple) else (range_, range_)
    return bool(low * (1.0 - SLACK) <= place <= high * (1.0 + SLACK))
