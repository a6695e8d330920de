"""The materials of a case: by name, by their properties, or like another one with some changed."""

from collections.abc import Mapping
from dataclasses import fields
from typing import Annotated, Any

from pydantic import AfterValidator, Field, Tag, ValidationInfo

from hertzlink.cases.declared import FORMS, Declared, Form, described_by, table_of
from hertzlink.cases.entry_paths import Path
from hertzlink.cases.faults import Fault
from hertzlink.cases.parts import Part, World, forms, hint_of, made
from hertzlink.cases.units import fault
from plates.laminate import OrthotropicMaterial
from structures.checks import nearest
from structures.material import MATERIALS, Material, name_key

REQUIRED = [name for name, parameter in described_by(Material).parameters.items() if parameter.required]


class Isotropic(Declared):
    """The properties of a material, all of them or those that differ from another one's."""

    optional = dict.fromkeys(REQUIRED, "")
    like: str | None = Field(None, description="the name of a material whose other properties this one has")

    def make(self, world: World) -> Material:
        stated = {name: value for name, value in self.given("like").items() if name in self.model_fields_set}
        if self.like is not None:
            base = material_named(self.like, world.materials)
            if base is None:
                raise Fault(("like",), unknown(self.like, world.materials))
            before = {field.name: getattr(base, field.name) for field in fields(base)}
            name = base.name if base in world.materials.values() else f"like {base.name}"
            return base if {**before, **stated} == before else Material(**{**before, "name": name, **stated})
        for name in REQUIRED:
            if name not in stated:
                raise Fault((name,), f"is missing; {hint_of(type(self), name)}, or name another material by like")
        return Material(**stated)


def material_named(name: str, materials: Mapping[str, Material]) -> Material | None:
    """Return the material of a name, those of the case first; None for an unknown one."""
    for key, material in materials.items():
        if name_key(key) == name_key(name):
            return material
    return MATERIALS.get(name)


def unknown(name: str, materials: Mapping[str, Any]) -> str:
    """Return the message for an unknown material."""
    return f'"{name}" is no material; {nearest(name, [*materials, *MATERIALS])}'


def _checked(name: str, info: ValidationInfo) -> str:
    materials = (info.context or {}).get("materials", {})
    if name not in MATERIALS and not any(name_key(key) == name_key(name) for key in materials):
        raise fault(unknown(name, materials))
    return name


def _form(value: Any) -> str | None:
    if isinstance(value, str):
        return "name"
    if isinstance(value, Part):
        return "own" if isinstance(value, Isotropic) else "sheet"
    return ("sheet" if "youngs_modulus_along" in value else "own") if isinstance(value, dict) else None


def _form_of_isotropic(value: Any) -> str | None:
    return "own" if isinstance(value, dict | Isotropic) else _form(value)


Stated: Any = Annotated[table_of(described_by(Material), base=Isotropic), Tag("own")]
Sheet: Any = Annotated[table_of(described_by(OrthotropicMaterial)), Tag("sheet")]

AnyMaterial: Any = Annotated[
    Annotated[str, AfterValidator(_checked), Tag("name")] | Stated,
    forms(_form_of_isotropic, 'must be the name of a material, such as "PTFE", or a table of its properties'),
    Field(description='a material, such as "aluminium 6061"'),
]
"""A material by name, or by its properties."""

AnySheet: Any = Annotated[
    Annotated[str, Tag("name")] | Stated | Sheet,
    forms(_form, "must be the name of a material, or a table of its properties"),
    Field(description='a material, such as "aluminium 6061", or one of [materials] with youngs_modulus_along'),
]
"""A material of a ply: isotropic or orthotropic."""

OfCase: Any = Annotated[Stated | Sheet, forms(_form, "must be a table of the properties of a material")]
"""A material of [materials]."""


def material_of(value: str | Part, world: World, *path: str | int) -> Material:
    """Return the material that an entry at a path means."""
    if isinstance(value, Part):
        material: Material = made(value, world, path)
        return material
    material_found = material_named(value, world.materials)
    if material_found is None:
        orthotropic = _sheet_named(value, world) is not None
        raise Fault(
            path, f'"{value}" is orthotropic; only plies take it' if orthotropic else unknown(value, world.materials)
        )
    return material_found


def _sheet_of(value: str | Part, world: World, path: Path) -> Material | OrthotropicMaterial:
    """Return the material of a ply that an entry at a path means."""
    sheet = _sheet_named(value, world) if isinstance(value, str) else None
    if sheet is None and isinstance(value, str) and material_named(value, world.materials) is None:
        raise Fault(path, unknown(value, {**world.sheets, **world.materials}))
    return material_of(value, world, *path) if sheet is None else sheet


def _sheet_named(name: str, world: World) -> OrthotropicMaterial | None:
    return next((sheet for key, sheet in world.sheets.items() if name_key(key) == name_key(name)), None)


FORMS[Material] = Form(AnyMaterial, lambda value, world, path: material_of(value, world, *path))
FORMS[Material | OrthotropicMaterial] = Form(AnySheet, _sheet_of)
