"""Fast models of plates for identification: one basis around a guess, and one straight edge to find the guess."""

from dataclasses import dataclass, field
from typing import Any

from hertzlink.cases.building import structure_of, world_of
from hertzlink.cases.case import Case
from hertzlink.cases.model import CaseModel
from hertzlink.cases.parts import World, material_of
from hertzlink.cases.plates import KirchhoffPlate, RectanglePlate
from plates.half_plane import half_plane
from plates.plate import Plate
from plates.reduced import ReducedPlate, covers
from structures.caution import collected
from structures.material import Material
from structures.structure import Structure

FREQUENCY = 60e3
"""Hz, that these models resolve at least. On a mesh for 40 kHz traces of a large plate are off by 0.2 % of their peak,
those of a small thin one, which holds more echoes, by 0.6 %: `plate_accuracy` finds what a signal needs."""

BAND = 1.15
"""The basis serves plates whose waves are up to this factor slower or faster than at the guess."""

TOLERANCE, ROUGH = 1e-3, 1e-2
"""Of the basis, for the last fit and for those before it: 1e-2 moves an unknown by up to a standard deviation."""

AROUND = 0.05
"""Half of the range of positions of the basis, as a part of the distance from the nearest edge; and more:"""

ERRORS, CELLS, WIDEST = 3.0, 2.0, 0.3
"""so many half intervals of the guess, and so many cells."""

VARIED = {("thickness",), ("at", 0), ("at", 1), ("material", "youngs_modulus"), ("material", "density")}
"""Entries of a plate for which waves only scale, or the contact moves."""

EDGES = {"clamped": "clamped", "simple": "simple", "soft simple": "simple", "free": "free"}


def edge_of(model: CaseModel) -> tuple[str, float] | None:
    """The nearest edge of a rectangular plate and its distance, m; None where no plate with one edge stands for it."""
    body = model.structure
    if not isinstance(body, RectanglePlate) or body.additions or body.damping or body.stepper or not body.is_plain:
        return None
    x, y = body.place
    distances = {"left": x, "right": body.length - x, "bottom": y, "top": body.width - y}
    nearest = min(distances, key=lambda name: distances[name])
    held = getattr(body.supports, nearest)
    if not isinstance(held, str) or held not in EDGES or distances[nearest] < 0.0:
        return None
    return EDGES[held], distances[nearest]


def one_edge(model: CaseModel, world: World) -> Structure:
    """The plate with its nearest edge alone."""
    body, edge = model.structure, edge_of(model)
    assert isinstance(body, RectanglePlate)
    assert edge is not None
    material = material_of(body.substance, world, "structure", "material")
    kind, distance = edge
    # On a held edge the plate does not move; nearer than a thickness no plate theory holds.
    away = distance if kind == "free" else max(distance, 0.1 * body.depth)
    return half_plane(body.depth, material, kind, away, world.until, FREQUENCY)


@dataclass
class AroundGuess:
    """Kirchhoff plates near a guess from one basis; others by a mesh and a reduction of their own.

    errors: half intervals of the coordinates at the guess, m, by the place in `at`; frequency: Hz, that the meshes
    resolve; around: half of the range of positions, as a part of the distance from the nearest edge; tolerance,
    warnings: of the basis.
    """

    guess: Case
    errors: dict[int, float]
    paths: set[tuple[Any, ...]]
    frequency: float = FREQUENCY
    around: float = AROUND
    tolerance: float = ROUGH
    warnings: list[str] = field(init=False)
    _basis: ReducedPlate = field(init=False)
    _slowest: float = field(init=False)

    def __post_init__(self) -> None:
        model, body = self.guess.model, self.guess.model.structure
        assert isinstance(body, KirchhoffPlate)
        world = world_of(model, self.guess.folder)
        scales = bool(self.paths & {("thickness",), ("material", "youngs_modulus"), ("material", "density")})
        thickness = body.depth / (BAND if scales else 1.0)
        thinner = body.model_copy(update={"thickness": thickness, "highest_frequency": self.frequency})
        plate: Plate = thinner.plate(world)
        ranges = [self._range(body, plate, i) for i in (0, 1)]
        with collected() as self.warnings:
            self._basis = ReducedPlate(
                plate, world.until * (BAND**2 if scales else 1.0), ranges[0], ranges[1], self.tolerance
            )
        self._slowest = _speed(thinner.depth, material_of(body.substance, world))

    def _range(self, body: KirchhoffPlate, plate: Plate, i: int) -> float | tuple[float, float]:
        place, side = body.place[i], (body.length, body.width)[i]
        if ("at", i) not in self.paths:
            return place
        away = min(place, side - place)
        wanted = max(self.around * away, ERRORS * self.errors.get(i, 0.0), CELLS * plate.finest_cell)
        # Where a guess hardly knows the place, a basis for the whole plate would take minutes and not be accurate.
        half = min(wanted, max(WIDEST * away, CELLS * plate.finest_cell))
        return max(place - half, 0.5 * plate.finest_cell), min(place + half, side - 0.5 * plate.finest_cell)

    def structure(self, model: CaseModel, world: World) -> Structure | None:
        """The structure of a case."""
        body = model.structure
        assert isinstance(body, KirchhoffPlate)
        material = material_of(body.substance, world, "structure", "material")
        faster = _speed(body.depth, material) / self._slowest
        inside = all(map(covers, (self._basis.x, self._basis.y), body.place))
        if inside and 1.0 - 1e-9 <= faster <= BAND**2 * (1.0 + 1e-9):
            return self._basis.at(body.place[0], body.place[1], thickness=body.depth, material=material)
        own = body.model_copy(update={"highest_frequency": self.frequency})
        structure: Structure | None = structure_of(own, model.run, world, ("structure",))
        return structure


def _speed(thickness: float, material: Material) -> float:
    """What the frequencies of a plate are proportional to."""
    return thickness * float((material.youngs_modulus / material.density) ** 0.5)


def scales(model: CaseModel, paths: set[tuple[Any, ...]]) -> bool:
    """Whether one basis serves all plates near a guess."""
    body = model.structure
    if not isinstance(body, KirchhoffPlate) or body.additions or body.damping or body.cells is not None:
        return False
    if not body.is_plain or body.stepper is not None:
        return False
    held = [getattr(body.supports, name) for name in type(body.supports).model_fields]
    return all(isinstance(one, str) for one in held) and body.face == "front" and paths <= VARIED
