"""The parts of a run's input as sections of a case."""

from collections.abc import Mapping
from itertools import groupby
from math import prod
from typing import Any

from structures.checks import short
from structures.material import MATERIALS, Material

SHAPES = {"Sphere": "sphere", "HollowSphere": "hollow_sphere", "Ellipsoid": "ellipsoid", "Cylinder": "cylinder"}

LOSSES = {
    "LinearDashpot": "linear_dashpot", "PowerDashpot": "power_dashpot", "MassProportional": "mass_proportional",
    "KuwabaraKono": "kuwabara_kono", "Tsuji": "tsuji", "Restitution": "restitution",
}  # fmt: skip

MOTIONS = {"SpringLoaded": "spring_loaded", "PushedBead": "pushed_bead", "Piston": "piston"}

LAWS = {
    "PowerLaw": "power_law", "TabulatedLaw": "tabulated_law", "ComputedLaw": "computed_law", "Thornton": "thornton",
    "JacksonGreen": "jackson_green",
}  # fmt: skip

IN_BEADS = {"Modal": "modal", "Rayleigh": "rayleigh", "StandardLinearSolid": "standard_linear_solid"}

KINDS = {
    "half-space": "half_space", "rod": "rod", "beam": "beam", "cylinder": "layered_cylinder", "solid": "solid",
    "spherical shell": "spherical_shell",
    "Kirchhoff plate": "kirchhoff_plate", "Mindlin plate": "mindlin_plate", "Kirchhoff panel": "kirchhoff_panel",
    "Mindlin panel": "mindlin_panel", "half-plane": "half_plane", "infinite plate": "infinite_plate",
}  # fmt: skip

STEPPERS = {
    "newmark": "newmark", "generalised-alpha": "generalised_alpha", "central-difference": "central_difference",
}  # fmt: skip

DAMPINGS = {"Rayleigh": "rayleigh", "modal": "modal", "standard linear solid": "standard_linear_solid"}

CHAIN = ("gravity", "inclination", "preload", "integrator")

Data = dict[str, Any]


def refused(path: str, what: str) -> ValueError:
    """The error for what no case can hold."""
    return ValueError(f"{path}: cannot be rebuilt: {what}")


def chain_data(given: Mapping[str, Any]) -> Data:
    """The section [chain]."""
    known = {"beads", "striker", "impact_speed", "dissipation", "law", "modes", "vibrations", "damping", *CHAIN}
    if unknown := sorted(set(given) - known):
        raise refused(f"chain.{unknown[0]}", "an entry that no chain of a case has")
    beads = [_bead(one, f"chain.beads[{i}]") for i, one in enumerate(given["beads"])]
    rows = [{**one, "count": len(list(many))} for one, many in groupby(beads)]
    if len(rows) == 1:
        count = rows[0].pop("count")
        data: Data = {"beads": count, "bead": rows[0]}
    else:
        data = {"beads": [{name: v for name, v in one.items() if (name, v) != ("count", 1)} for one in rows]}
    data["striker"] = _striker(given["striker"])
    if data["striker"] == data.get("bead"):
        data["striker"] = "bead"
    data |= {name: given[name] for name in ("impact_speed", *CHAIN) if given[name] is not None}
    if given["dissipation"] is not None:
        data["dissipation"] = _classed(given["dissipation"], LOSSES, "kind", "chain.dissipation")
    if given["law"] is not None:
        data["law"] = _law(given["law"])
    if "modes" in given:
        if "vibration" not in str(given["vibrations"]):
            raise refused("chain.vibrations", "vibrations of your own")
        data["modes"] = given["modes"]
        if given.get("damping") is not None:
            data["damping"] = _classed(given["damping"], IN_BEADS, "kind", "chain.damping")
    return data


def _classed(given: Any, names: Mapping[str, str], entry: str, path: str) -> Data:
    """An object of one of hertzlink's classes by its fields."""
    if not isinstance(given, Mapping) or given.get("class") not in names:
        what = given.get("class", given) if isinstance(given, Mapping) else given
        raise refused(path, f"{short(what)}, which is no part of a case")
    rest = {name: value for name, value in given.items() if name != "class" and value is not None}
    return {entry: names[given["class"]], **rest}


def _bead(given: Any, path: str) -> Data:
    data = _classed(given, SHAPES, "shape", path)
    data["material"] = _material(data["material"], f"{path}.material")
    return data


def _striker(given: Any) -> Any:
    if given is None:
        return "none"
    if isinstance(given, Mapping) and given.get("class") in MOTIONS:
        data = _classed(given, MOTIONS, "kind", "chain.striker")
        if data.get("surface") is not None:
            surface = {name: value for name, value in data["surface"].items() if value is not None}
            data["surface"] = surface | {"material": _material(surface["material"], "chain.striker.surface.material")}
        if "striker" in data:
            data["striker"] = _bead(data["striker"], "chain.striker.striker")
        return data
    return _bead(given, "chain.striker")


def _law(given: Any) -> Data:
    data = _classed(given, LAWS, "kind", "chain.law")
    if not data.get("caution"):
        data.pop("caution", None)
    if data.get("largest") == "Infinity" or data["kind"] == "tabulated_law":
        data.pop("largest", None)
    for name in ("error", "order"):
        if isinstance(data.get(name), str):  # JSON holds "NaN" as a text
            del data[name]
    return data


def _material(given: Any, path: str) -> str | Data:
    names = {"youngs_modulus", "poisson_ratio", "density", "name", "yield_strength"}
    if not isinstance(given, Mapping) or set(given) != names:
        raise refused(path, "a wall that is not of one isotropic material, such as a laminate")
    material = Material(**given)
    if material.name in MATERIALS and MATERIALS[material.name] == material:
        return material.name
    return {name: value for name, value in given.items() if value not in (None, "")}


def structure_data(given: Any) -> tuple[Data, bool | Data]:
    """The section [structure], and the entry `reduce` of [run]."""
    if given is None:
        return {"kind": "nothing"}, False
    if not isinstance(given, Mapping) or given.get("kind") not in KINDS:
        what = given.get("kind", "a structure of your own") if isinstance(given, Mapping) else given
        raise refused("structure", f"{short(what)}, which no builder of structures made")
    data: Data = {name: value for name, value in given.items() if value is not None}
    if "scaled_from" in data:
        raise refused("structure.scaled_from", "a scaled plate; build the plate with its own thickness and material")
    stepper = _stepper(data.pop("stepper", None))
    data["kind"] = KINDS[data["kind"]]
    reduction = _reduction(data.pop("reduction", None))
    damping = [_damping(one, f"structure.damping[{i}]") for i, one in enumerate(data.pop("damping", []))]
    if "layers" in data:
        data["layers"] = [
            {**one, "material": _material(one["material"], f"structure.layers[{i}].material")}
            for i, one in enumerate(data["layers"])
        ]
    if "material" in data or "thickness" in data:
        _wall(data)
    _OF_KIND.get(data["kind"], _plate)(data)
    if "opening" in data:
        raise refused("structure.opening", "gaps that are neither cracks of a rod nor delaminations of a plate")
    return data | stepper | ({"damping": damping} if damping else {}), reduction


def _wall(data: Data) -> None:
    """The material of a plate, or its laminate or section, in the place of thickness and material."""
    given = data.get("material", data.get("section"))
    if isinstance(given, Mapping) and "plies" in given:
        plies = [{**one, "material": _sheet(one["material"])} for one in given["plies"]]
        surface = given.get("surface")
        data["wall"] = {"plies": plies} | ({} if surface is None else {"surface": _material(surface, "structure.wall")})
    elif isinstance(given, Mapping) and "bending" in given:
        rest = {name: value for name, value in given.items() if name != "class"}
        data["wall"] = {**rest, "struck": _material(given["struck"], "structure.wall.struck")}
    else:
        data["material"] = _material(given, "structure.material")
        return
    for name in ("material", "thickness"):
        data.pop(name, None)


def _sheet(given: Any) -> str | Data:
    """The material of a ply."""
    if "youngs_modulus_along" in given:
        return {name: value for name, value in given.items() if value != ""}
    return _material(given, "structure.wall.plies")


def _stepper(given: Any) -> Data:
    """The entry `stepper`; none for the usual one."""
    if given is None:
        return {}
    own = {"name": given} if isinstance(given, str) else given
    if not isinstance(own, Mapping) or own.get("name") not in STEPPERS:
        raise refused("structure.stepper", "a stepper of your own")
    rest = {name: value for name, value in own.items() if name != "name"}
    return {"stepper": {"kind": STEPPERS[own["name"]], **rest}}


def _reduction(given: Any) -> bool | Data:
    if given is None:
        return False
    if "shared" in given:
        raise refused("structure.reduction.shared", "a ReducedPlate")
    return {name: given[name] for name in ("tolerance", "pulse", "until", "largest") if name in given}


def _damping(given: Mapping[str, Any], path: str) -> Data:
    if given.get("kind") not in DAMPINGS or given.get("part"):
        raise refused(path, f"{short(dict(given))}, which is neither of the whole structure nor of a layer")
    return {**given, "kind": DAMPINGS[given["kind"]]}


def _rod(data: Data) -> None:
    data.pop("highest_frequency", None)
    counts = set(data.pop("elements"))
    if len(counts) == 1:
        data["elements"] = counts.pop()
    if "cracks" in data:
        if "opening" not in data:
            raise refused("structure.cracks", "cracks that nothing closes")
        gaps = zip(data.pop("cracks"), data.pop("opening"), data.pop("preload"), strict=True)
        data["cracks"] = [{"after": i, "opening": opening, "preload": load} for i, opening, load in gaps]


def _cylinder(data: Data) -> None:
    if isinstance(data["base"], Mapping):
        data["foundation"] = data.pop("base")["stiffness"]


def _solid(data: Data) -> None:
    materials = data.pop("materials")
    if data["mesh"] == "meshio.Mesh" or len(materials) != 1:
        raise refused("structure.mesh", "a mesh in memory, or of several materials")
    for name in ("cells", "fixed_facets", "fixed_area", "highest_frequency"):
        data.pop(name, None)
    data["material"] = _material(materials[0], "structure.materials[0]")


def _plate(data: Data) -> None:
    data.pop("section", None)
    data.pop("degree", None)
    at = data.get("at")
    if not isinstance(at, list):
        raise refused("structure.at", f"{short(at)}, which is no point")
    if isinstance(at[0], list):
        data["at"] = [list(place) for place in zip(*at, strict=True)]
    if data["kind"].startswith("kirchhoff"):
        data.pop("patch_radius", None)
    if data["kind"].endswith("panel"):
        data.pop("length", None)
        if data.get("mesh") == "meshio.Mesh":
            raise refused("structure.mesh", "a mesh in memory")
        if "mesh" in data:
            data.pop("cells")
            data.pop("edges")
    data["additions"] = [_addition(one, data) for one in data.get("additions", [])]
    if data.get("opening") == []:
        del data["opening"], data["preload"]
    if not data["additions"]:
        del data["additions"]


def _addition(given: Mapping[str, Any], plate: Data) -> Data:
    if "depth" in given:
        if "opening" not in plate:
            raise refused("structure.additions", "a delamination that nothing closes")
        count, gap = prod(given["points"]), {}
        for name in ("opening", "preload"):
            own, plate[name] = plate[name][:count], plate[name][count:]
            if len(set(own)) != 1:
                raise refused(f"structure.{name}", "a delamination whose points are not all alike")
            gap[name] = own[0]
        return {"kind": "delamination", **given, **gap}
    if "factor" in given:
        return {"kind": "weakened", **given}
    if "start" in given:
        return {"kind": "stiffener", **given}
    if "xx" in given:
        return {"kind": "prestress", **given}
    return {"kind": "point_mass", "at": [given["x"], given["y"]], "mass": given["mass"]}


def _as_it_is(data: Data) -> None:
    data.pop("impedance", None)


_OF_KIND = {
    "rod": _rod, "layered_cylinder": _cylinder, "solid": _solid, "half_space": _as_it_is, "half_plane": _as_it_is,
    "infinite_plate": _as_it_is, "beam": _as_it_is, "spherical_shell": _as_it_is,
}  # fmt: skip
