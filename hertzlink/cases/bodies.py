"""The structures of a case that are no plates, and how structures are damped."""

from functools import partial
from pathlib import Path as File
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from hertzlink.cases.parts import (
    Angle,
    AnyMaterial,
    Duration,
    Force,
    Frequency,
    Length,
    Number,
    Part,
    Pressure,
    Round,
    World,
    forms,
    made,
    material_of,
)
from hertzlink.cases.units import Unit
from plates.beam import beam
from structures import damping
from structures.closing import Closing, check_gap
from structures.cylinder import layered_cylinder
from structures.elasticity import Foundation
from structures.rod import Layer, rod
from structures.solid import solid
from structures.spherical_shell import spherical_shell
from structures.stepping import CentralDifference, GeneralisedAlpha, Newmark
from structures.structure import Structure, half_space

OF_ALL = ("damping", "reduce", "stepper")
"""Entries that all structures have, and no builder takes."""

LAYER = '{ material = "PTFE", length = "25.4 mm", radius = "9.5 mm" }'

Coordinates = Annotated[list[Length], Field(min_length=3, max_length=3)]


class Damping(Part):
    """A damping of the structure."""

    early: ClassVar[bool] = False
    """Whether it acts on the structure before that is reduced."""

    @property
    def is_early(self) -> bool:
        """Whether it acts on the structure before that is reduced."""
        return self.early

    def damped(self, structure: Structure) -> Structure:
        """The structure with this damping."""
        raise NotImplementedError


class Rayleigh(Damping):
    """α M + β K."""

    early = True
    kind: Literal["rayleigh"]
    mass_rate: Annotated[float, Unit("1/s", "a rate", "100 1/s")] = 0.0
    stiffness_time: Duration = 0.0

    def damped(self, structure: Structure) -> Structure:
        return damping.damped(structure, damping.Rayleigh(self.mass_rate, self.stiffness_time))


class Modal(Damping):
    """A damping ratio for all modes of the reduced structure, or one for each."""

    kind: Literal["modal"]
    ratio: Annotated[
        Annotated[Number, Tag("one")] | Annotated[list[Number], Tag("many")],
        forms(lambda given: "many" if isinstance(given, list) else "one", "must be a number, or a list of numbers"),
    ]

    def damped(self, structure: Structure) -> Structure:
        return damping.damped(structure, damping.Modal(self.ratio))


class LossFactor(Damping):
    """A structural loss factor."""

    kind: Literal["loss_factor"]
    factor: Number

    def damped(self, structure: Structure) -> Structure:
        if not 0.0 <= self.factor <= 1.0:
            raise ValueError(f"factor = {self.factor!r}: must lie between 0 and 1; it is η = 2ζ, not a percentage")
        return damping.damped(structure, damping.Modal(self.factor / 2.0))


class LinearSolid(Damping):
    """Zener's standard linear solid, of the whole structure or of one layer."""

    kind: Literal["standard_linear_solid"]
    share: Number
    time: Duration
    modulus: Literal["relaxed", "instantaneous"] = "relaxed"
    layer: Annotated[int, Field(ge=0)] | None = Field(None, description="the layer, or material, counted from 0")

    @property
    def is_early(self) -> bool:
        """That of a layer: a reduced structure has none."""
        return self.layer is not None

    def damped(self, structure: Structure) -> Structure:
        solid = damping.StandardLinearSolid(self.share, self.time, self.modulus)
        part = None if self.layer is None else damping.part_of_layer(structure, self.layer)
        return damping.damped(structure, solid, part)


OneDamping = Annotated[Rayleigh | Modal | LossFactor | LinearSolid, Discriminator("kind")]


class Stepping(Part):
    """How a structure is moved in time. Such a structure is not reduced."""

    makes: ClassVar[Any]

    def make(self, world: World) -> Any:
        """The name of a stepper, or a function of a structure and a window."""
        given = self.given("kind")
        return partial(self.makes, **given) if given else str(getattr(self, "kind")).replace("_", "-")  # noqa: B009


class NewmarkPart(Stepping):
    """Newmark's method."""

    makes = Newmark
    kind: Literal["newmark"]
    beta: Annotated[Number, Field(ge=0.0)] | None = None
    gamma: Annotated[Number, Field(ge=0.5)] | None = None


class GeneralisedAlphaPart(Stepping):
    """The generalised-α method."""

    makes = GeneralisedAlpha
    kind: Literal["generalised_alpha"]
    spectral_radius: Annotated[Number, Field(ge=0.0, le=1.0)] | None = None


class CentralDifferencePart(Stepping):
    """Explicit central differences with a lumped mass."""

    makes = CentralDifference
    kind: Literal["central_difference"]


OneStepper = Annotated[NewmarkPart | GeneralisedAlphaPart | CentralDifferencePart, Discriminator("kind")]


class Reduction(Part):
    """How large structures are replaced by oscillators."""

    tolerance: Number | None = None
    pulse: Duration | None = None
    largest: Annotated[int, Field(ge=1)] | None = None
    until: Duration | None = None


def _reduced(given: Any) -> str | None:
    if isinstance(given, bool):
        return "yes or no"
    return "settings" if isinstance(given, dict | Reduction) else None


Reduce = Annotated[
    Annotated[bool, Tag("yes or no")] | Annotated[Reduction, Tag("settings")],
    forms(_reduced, "must be true, false, or a table such as { tolerance = 0.01 }"),
]


class Body(Part):
    """What a chain faces."""

    damping: list[OneDamping] = Field(default_factory=list)
    reduce: Reduce | None = Field(None, description="as in [run], for this structure alone")
    stepper: OneStepper | None = Field(None, description='how it is moved in time, such as { kind = "newmark" }')

    @property
    def contacts(self) -> int:
        """The number of points that chains face."""
        return 1

    def make(self, world: World) -> Structure | None:
        raise NotImplementedError

    def in_time(self, structure: Structure) -> Any:
        """What moves in a run: the structure, or the participant that its gaps or its stepper make of it."""
        return structure


class Nothing(Body):
    """Nothing: the last bead flies off."""

    kind: Literal["nothing"]

    def make(self, world: World) -> None:
        return None


class HalfSpace(Body):
    """An elastic half-space."""

    kind: Literal["half_space", "wall"]
    material: AnyMaterial

    def make(self, world: World) -> Structure:
        return half_space(material_of(self.material, world, "material"))


class LayerPart(Round):
    """A layer of a rod or a cylinder."""

    material: AnyMaterial
    length: Length

    def make(self, world: World) -> Layer:
        return Layer(material_of(self.material, world, "material"), self.length, self.its_radius())


Layers = Annotated[list[LayerPart], Field(min_length=1, description=f"a list of layers, such as [{LAYER}]")]


def layers_of(layers: list[LayerPart], world: World) -> list[Layer]:
    """The layers, each with its own place in messages."""
    return [made(one, world, ("layers", i)) for i, one in enumerate(layers)]


class Crack(Part):
    """A crack between two layers of a rod. It closes."""

    after: Annotated[int, Field(ge=0, description="the layer before the crack, counted from 0")]
    opening: Length = 0.0
    preload: Force = 0.0

    def make(self, world: World) -> int:
        check_gap(self.opening, self.preload)
        return self.after


class Rod(Body):
    """A rod of layers, in the theory of longitudinal waves."""

    kind: Literal["rod"]
    layers: Layers
    base: Literal["fixed", "free", "absorbing", "contact"] = "fixed"
    elements: Annotated[int, Field(ge=1)] | None = None
    cracks: list[Crack] = Field(default_factory=list)

    @property
    def contacts(self) -> int:
        return 2 if self.base == "contact" else 1  # its cracks face no chain

    def make(self, world: World) -> Structure:
        cracks = [made(one, world, ("cracks", i)) for i, one in enumerate(self.cracks)]
        return rod(layers_of(self.layers, world), self.base, self.elements, cracks)

    def in_time(self, structure: Structure) -> Any:
        cracks = sorted(self.cracks, key=lambda one: one.after)
        if not cracks:
            return structure
        return Closing(structure, [one.opening for one in cracks], [one.preload for one in cracks])


class LayeredCylinder(Body):
    """A cylinder of layers, in axisymmetric elasticity."""

    kind: Literal["layered_cylinder"]
    layers: Layers
    base: Literal["fixed", "free", "absorbing"] = "fixed"
    foundation: Annotated[float, Unit("N/m^3", "a stiffness", "1e12 N/m^3")] | None = Field(
        None, description="stiffness of elastic ground in place of a base"
    )
    side: Literal["free", "absorbing"] = "free"
    patch_radius: Length | None = None
    highest_frequency: Frequency | None = None
    cells: Annotated[int, Field(ge=1)] | None = None

    def make(self, world: World) -> Structure:
        base = self.base if self.foundation is None else Foundation(self.foundation)
        rest = self.given("kind", "layers", "base", "foundation", *OF_ALL)
        return layered_cylinder(layers_of(self.layers, world), base, **rest)


class SphericalShell(Body, Round):
    """A hollow sphere under pressure, struck at a pole."""

    kind: Literal["spherical_shell"]
    thickness: Length
    material: AnyMaterial
    pressure: Pressure = 0.0
    base: Literal["fixed", "free", "contact"] = "fixed"
    seat: Angle | None = Field(None, description="half-angle of the part that is held, seen from the centre")
    ambient: Pressure | None = Field(None, description="pressure outside; by default that of the atmosphere")
    heat_capacity_ratio: Annotated[Number, Field(ge=0.0)] | None = None
    patch_radius: Length | None = None
    highest_frequency: Frequency | None = None
    cells: Annotated[int, Field(ge=1)] | None = None

    @property
    def contacts(self) -> int:
        return 2 if self.base == "contact" else 1

    def make(self, world: World) -> Structure:
        rest = self.given("kind", "radius", "diameter", "material", *OF_ALL)
        return spherical_shell(self.its_radius(), material=material_of(self.material, world, "material"), **rest)


End = Literal["clamped", "simple", "free", "symmetry"]


class BeamBody(Body):
    """A beam struck from the side, with an axial force."""

    kind: Literal["beam"]
    length: Length
    bending_stiffness: Annotated[float, Unit("N m^2", "a stiffness", "20 N m^2")]
    mass_per_length: Annotated[float, Unit("kg/m", "a mass per length", "0.2 kg/m")]
    material: AnyMaterial
    at: Length = Field(description="the point that is struck, from the first end")
    supports: Annotated[list[End], Field(min_length=2, max_length=2)] | None = None
    axial_force: Force = 0.0
    foundation: Annotated[float, Unit("N/m^2", "a stiffness per length", "1e7 N/m^2")] = 0.0
    highest_frequency: Frequency | None = None

    def make(self, world: World) -> Structure:
        rest: dict[str, Any] = self.given("kind", "material", "supports", *OF_ALL)
        if self.supports is not None:
            rest["supports"] = (self.supports[0], self.supports[1])
        return beam(material=material_of(self.material, world, "material"), **rest)


class Solid(Body):
    """A body from a mesh file."""

    kind: Literal["solid"]
    mesh: str = Field(description='the file of a mesh, such as "body.msh"')
    material: AnyMaterial
    contact: Coordinates = Field(description='the point that is struck, such as ["0 mm", "0 mm", "25 mm"]')
    normal: Annotated[list[Number], Field(min_length=3, max_length=3)] | None = None
    fixed: str | int | None = None
    patch_radius: Length | None = None
    scale: Number | None = None
    curvature: Annotated[float, Unit("1/m", "a curvature", "50 1/m")] | None = None
    merge: Length | None = Field(None, description="points of the mesh that lie closer become one")
    tags: str | None = Field(None, description="the data of the mesh that number its cells")

    def make(self, world: World) -> Structure:
        rest: dict[str, Any] = self.given("kind", "mesh", "material", "contact", "normal", *OF_ALL)
        if self.normal is not None:
            rest["normal"] = tuple(self.normal)
        material = material_of(self.material, world, "material")
        x, y, z = self.contact
        return solid(file_of(self.mesh, world), material, (x, y, z), **rest)


def file_of(name: str, world: World) -> str:
    """The path of a file that a case names, relative to the case; a ValueError if it does not exist."""
    path = world.folder / File(name)
    if not path.is_file():
        raise ValueError(f'mesh: there is no file "{path}"')
    return str(path)
