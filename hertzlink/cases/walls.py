"""The walls of plates: a thickness of one material, a laminate of plies, or a section by its stiffnesses."""

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field, Tag

from hertzlink.cases.declared import Data, material_data
from hertzlink.cases.faults import Fault
from hertzlink.cases.parts import (
    AnyMaterial,
    Length,
    OrthotropicPart,
    OwnMaterial,
    Part,
    World,
    forms,
    made,
    material_of,
    sheet_of,
)
from hertzlink.cases.units import Unit
from plates.laminate import Laminate, Ply
from plates.section import Section
from structures.quantities import Angle

AnySheet = Annotated[
    Annotated[str, Tag("name")] | Annotated[OwnMaterial, Tag("own")] | Annotated[OrthotropicPart, Tag("sheet")],
    forms(
        lambda given: (
            "name"
            if isinstance(given, str)
            else "sheet"
            if isinstance(given, OrthotropicPart) or (isinstance(given, dict) and "youngs_modulus_along" in given)
            else "own"
            if isinstance(given, dict | OwnMaterial)
            else None
        ),
        "must be the name of a material, or a table of its properties",
    ),
    Field(description='a material, such as "aluminium 6061", or one of [materials] with youngs_modulus_along'),
]
"""A material of a ply: isotropic or orthotropic."""


class PlyPart(Part):
    """One layer of a laminate."""

    material: AnySheet
    thickness: Length
    angle: Annotated[float, Unit.noted(Angle)] = 0.0

    def make(self, world: World) -> Ply:
        return Ply(sheet_of(self.material, world, "material"), self.thickness, self.angle)


class LaminateWall(Part):
    """A laminate; its first ply is struck."""

    plies: Annotated[list[PlyPart], Field(min_length=1)] = Field(
        description='a list such as [{ material = "carbon", thickness = "0.25 mm", angle = "45 deg" }]'
    )
    surface: AnyMaterial | None = Field(None, description="the isotropic material that the bead feels")

    def make(self, world: World) -> Laminate:
        surface = None if self.surface is None else material_of(self.surface, world, "surface")
        return Laminate([made(one, world, ("plies", i)) for i, one in enumerate(self.plies)], surface)


Row = Annotated[list[float], Field(min_length=2, max_length=3)]


class SectionWall(Part):
    """A wall by its stiffnesses, per unit of its middle surface."""

    bending: list[Row] = Field(description="three rows of three numbers, N m")
    shear: list[Row] = Field(description="two rows of two numbers, N/m")
    mass: Annotated[float, Unit("kg/m^2", "a mass per area", "5.4 kg/m^2")]
    rotary_inertia: Annotated[float, Unit("kg", "a mass", "2e-6 kg")]
    thickness: Length
    struck: AnyMaterial

    def make(self, world: World) -> Section:
        return Section(**self.given("struck"), struck=material_of(self.struck, world, "struck"))


def _which(given: Any) -> str | None:
    if isinstance(given, dict):
        return "section" if "bending" in given else "laminate"
    return "section" if isinstance(given, SectionWall) else "laminate" if isinstance(given, LaminateWall) else None


Wall = Annotated[
    Annotated[LaminateWall, Tag("laminate")] | Annotated[SectionWall, Tag("section")],
    forms(_which, "must be a table with plies, or with bending, shear, mass, rotary_inertia, thickness and struck"),
]


def wall_of(thickness: float | None, material: Any, wall: Any, world: World) -> dict[str, Any]:
    """The arguments thickness and material of a builder; a Fault unless one wall is given."""
    if wall is not None:
        for name, given in (("thickness", thickness), ("material", material)):
            if given is not None:
                raise Fault((name,), "belongs to a wall of one material; leave it out, or leave out wall")
        return {"thickness": None, "material": made(wall, world, ("wall",))}
    if thickness is None:
        raise Fault(("thickness",), 'is missing; give a length, such as "2.29 mm", or a wall')
    if material is None:
        raise Fault(("material",), 'is missing; give a material, such as "aluminium 6061", or a wall')
    return {"thickness": thickness, "material": material_of(material, world, "material")}


def wall_data(given: Mapping[str, Any]) -> Data:
    """The entries thickness and material, or wall, from the origin of a plate."""
    made_of = given.get("material", given.get("section"))
    if isinstance(made_of, Mapping) and "plies" in made_of:
        wall: Data = {"plies": [{**one, "material": _sheet(one["material"])} for one in made_of["plies"]]}
        if made_of.get("surface") is not None:
            wall["surface"] = material_data(made_of["surface"], "structure.wall")
        return {"wall": wall}
    if isinstance(made_of, Mapping) and "bending" in made_of:
        rest = {name: value for name, value in made_of.items() if name != "class"}
        return {"wall": {**rest, "struck": material_data(made_of["struck"], "structure.wall.struck")}}
    return {"thickness": given["thickness"], "material": material_data(made_of, "structure.material")}


def _sheet(given: Mapping[str, Any]) -> str | Data:
    """The material of a ply."""
    if "youngs_modulus_along" in given:
        return {name: value for name, value in given.items() if value != ""}
    return material_data(given, "structure.wall.plies")
