"""The chain of a case: beads, what strikes them, losses and contact laws."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from hertzlink.cases.faults import Fault
from hertzlink.cases.laws import NumericalLaw, OneLaw
from hertzlink.cases.losses import OneLoss, OneLossInBeads
from hertzlink.cases.parts import (
    Acceleration,
    Angle,
    AnyMaterial,
    Duration,
    Force,
    Length,
    Part,
    Round,
    Speed,
    World,
    forms,
    made,
    material_of,
)
from hertzlink.cases.paths import Path
from hertzlink.cases.units import Unit
from particles.bead import Bead, Cylinder, Ellipsoid, HollowSphere, Sphere, drop_speed
from particles.chain import Chain
from particles.deformable.chain import DeformableChain
from particles.excitation import Excitation, Piston, PushedBead, SpringLoaded
from particles.laws.law import ContactLaw
from particles.laws.yielding import YieldingLaw
from structures.surface import Surface

MOST_BEADS = 100_000


class AnyBead(Round):
    """A bead; `count` of them in a list of beads."""

    material: AnyMaterial
    count: Annotated[int, Field(ge=1, le=MOST_BEADS)] = 1


class SphereBead(AnyBead):
    """A solid sphere."""

    shape: Literal["sphere"]

    def make(self, world: World) -> Sphere:
        return Sphere(self.its_radius(), material_of(self.material, world, "material"))


class HollowSphereBead(AnyBead):
    """A spherical shell."""

    shape: Literal["hollow_sphere"]
    inner_radius: Length

    def make(self, world: World) -> HollowSphere:
        return HollowSphere(self.its_radius(), self.inner_radius, material_of(self.material, world, "material"))


class EllipsoidBead(AnyBead):
    """An ellipsoid of revolution."""

    shape: Literal["ellipsoid"]
    length: Length
    axis: Literal["across", "along"] = "across"
    angle: Angle = 0.0

    def make(self, world: World) -> Ellipsoid:
        material = material_of(self.material, world, "material")
        return Ellipsoid(self.its_radius(), self.length, material, self.axis, self.angle)


class CylinderBead(AnyBead):
    """A cylinder across the chain."""

    shape: Literal["cylinder"]
    length: Length
    angle: Angle = 0.0

    def make(self, world: World) -> Cylinder:
        return Cylinder(self.its_radius(), self.length, material_of(self.material, world, "material"), self.angle)


OneBead = Annotated[SphereBead | HollowSphereBead | EllipsoidBead | CylinderBead, Discriminator("shape")]
BEAD = 'a bead, such as { shape = "sphere", diameter = "4.76 mm", material = "steel 440C" }'


class Spring(Part):
    """A striker that a compressed spring throws."""

    kind: Literal["spring_loaded"]
    striker: OneBead | None = Field(None, description=f"{BEAD}; by default the chain's")
    stiffness: Annotated[float, Unit("N/m", "a stiffness", "200 N/m")]
    compression: Length
    travel: Length | None = None


class Push(Part):
    """A force history on the first bead."""

    kind: Literal["pushed_bead"]
    time: list[Duration]
    force: list[Force]

    def make(self, world: World) -> PushedBead:
        return PushedBead(tuple(self.time), tuple(self.force))


class SurfacePart(Part):
    """What touches a bead: a material and its curvatures."""

    material: AnyMaterial
    curvature: Annotated[float, Unit("1/m", "a curvature", "50 1/m")] = 0.0
    second_curvature: Annotated[float, Unit("1/m", "a curvature", "50 1/m")] | None = None
    direction: Angle = 0.0

    def make(self, world: World) -> Surface:
        return Surface(material_of(self.material, world, "material"), **self.given("material"))


class MovedPiston(Part):
    """A rigid piston that holds or pushes the first bead."""

    kind: Literal["piston"]
    time: list[Duration] = Field(default_factory=lambda: [0.0, 1.0])
    displacement: list[Length] = Field(default_factory=lambda: [0.0, 0.0])
    surface: SurfacePart | None = None

    def make(self, world: World) -> Piston:
        surface = None if self.surface is None else made(self.surface, world, ("surface",))
        return Piston(tuple(self.time), tuple(self.displacement), surface)


Moved = Annotated[Spring | Push | MovedPiston, Discriminator("kind")]


def _what_strikes(given: Any) -> str | None:
    if isinstance(given, str):
        return "word"
    if isinstance(given, dict | Part):
        has_kind = "kind" in given if isinstance(given, dict) else hasattr(given, "kind")
        return "moved" if has_kind else "body"
    return None


Striker = Annotated[
    Annotated[Literal["bead", "none"], Tag("word")] | Annotated[OneBead, Tag("body")] | Annotated[Moved, Tag("moved")],
    forms(_what_strikes, f'must be "bead", "none", {BEAD}, or a table with a kind, such as "spring_loaded"'),
]


def _how_many(given: Any) -> str | None:
    if isinstance(given, int) and not isinstance(given, bool):
        return "count"
    return "list" if isinstance(given, list) else None


Beads = Annotated[
    Annotated[int, Field(ge=1, le=MOST_BEADS), Tag("count")]
    | Annotated[list[OneBead], Field(min_length=1), Tag("list")],
    forms(_how_many, "must be a whole number of beads, such as 20, or a list of beads"),
]


class Seat(Part):
    """A contact point: of which structure, and which of its points; both are counted from 0."""

    structure: Annotated[int, Field(ge=0)] = 0
    point: Annotated[int, Field(ge=0)] = 0


class ChainPart(Part):
    """The chain, from its struck end."""

    beads: Beads = Field(description="a number of beads, such as 20, or a list of beads")
    bead: OneBead | None = Field(None, description=BEAD)
    repeat: Annotated[int, Field(ge=1, le=MOST_BEADS)] = 1
    striker: Striker = "bead"
    impact_speed: Speed | None = None
    drop_height: Length | None = None
    gravity: Acceleration = 0.0
    inclination: Angle | None = None
    preload: Force = 0.0
    dissipation: OneLoss | None = None
    law: OneLaw | None = None
    integrator: Literal["verlet", "rk4"] = "verlet"
    modes: Annotated[int, Field(ge=1)] | None = Field(None, description="the motions of a bead that deforms, such as 8")
    damping: OneLossInBeads | None = Field(None, description="a loss inside beads that deform")
    on: Seat | None = Field(None, description="what the last bead faces, such as { structure = 0, point = 1 }")
    behind: Seat | None = Field(None, description="what the first bead faces with its struck side, as on")

    named: ClassVar[Mapping[str, Path]] = {
        "height": ("drop_height",), "stiffness": ("striker", "stiffness"), "compression": ("striker", "compression"),
        "travel": ("striker", "travel"),
    }  # fmt: skip

    def make(self, world: World) -> Chain:
        own = {} if self.bead is None else {"bead": made(self.bead, world, ("bead",))}
        beads = self._row(world, own.get("bead"))
        optional = {name: getattr(self, name) for name in ("inclination",) if getattr(self, name) is not None}
        if self.dissipation is not None:
            optional["dissipation"] = made(self.dissipation, world, ("dissipation",))
        if self.modes is not None:
            optional["modes"] = self.modes
        if self.damping is not None:
            if self.modes is None:
                raise Fault(("damping",), "acts inside beads that deform; give modes as well, such as modes = 8")
            optional["damping"] = made(self.damping, world, ("damping",))
        striker = self._striker(world, own.get("bead", beads[0]))
        kind = Chain if self.modes is None else DeformableChain
        return kind(
            beads,
            striker,
            self._speed(),
            gravity=self.gravity,
            preload=self.preload,
            integrator=self.integrator,
            law=self._law(world, beads, striker),
            **optional,
        )

    @property
    def count(self) -> int:
        """The number of beads."""
        beads = self.beads if isinstance(self.beads, int) else sum(one.count for one in self.beads)
        return beads * self.repeat

    def _law(self, world: World, beads: list[Bead], striker: Bead | Excitation | None) -> Any:
        if self.law is None:
            return None
        if isinstance(self.law, NumericalLaw):
            body = getattr(striker, "striker", None) if isinstance(striker, Excitation) else striker
            return self.law.of_beads(beads if body is None else [body, *beads])
        law: ContactLaw | YieldingLaw = made(self.law, world, ("law",))
        return law

    def _row(self, world: World, bead: Bead | None) -> list[Bead]:
        if isinstance(self.beads, int):
            if bead is None:
                raise Fault(("bead",), f"is missing; give {BEAD}")
            row = [bead] * self.beads
        else:
            row = []
            known: dict[OneBead, Bead] = {}
            for i, one in enumerate(self.beads):
                alike = one.model_copy(update={"count": 1})
                if alike not in known:
                    known[alike] = bead if alike == self.bead and bead else made(one, world, ("beads", i))
                row += [known[alike]] * one.count
        if len(row) * self.repeat > MOST_BEADS:
            raise Fault(("repeat",), f"{self.repeat} makes {len(row) * self.repeat} beads; at most {MOST_BEADS}")
        return row * self.repeat

    def _striker(self, world: World, bead: Bead) -> Bead | Excitation | None:
        if isinstance(self.striker, str):
            return bead if self.striker == "bead" else None
        if isinstance(self.striker, Spring):
            inner = self.striker.striker
            thrown = bead if inner is None else made(inner, world, ("striker", "striker"))
            return SpringLoaded(thrown, self.striker.stiffness, self.striker.compression, self.striker.travel)
        found: Bead | Excitation = made(self.striker, world, ("striker",))
        return found

    def _speed(self) -> float | None:
        if self.drop_height is not None:
            if self.impact_speed is not None:
                raise Fault(("drop_height",), "gives the impact speed; leave out impact_speed")
            return drop_speed(self.drop_height)
        # A chain that nothing strikes may start at rest.
        needs = self.striker != "none" and not isinstance(self.striker, Spring | Push | MovedPiston)
        if self.impact_speed is None and needs:
            raise Fault(("impact_speed",), 'is missing; give a speed, such as "0.31 m/s", or a drop_height')
        return self.impact_speed
