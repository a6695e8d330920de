"""One plate from another: at equal ν, thickness, modulus and density only scale the frequencies and the motion."""

from collections.abc import Mapping
from dataclasses import asdict, fields, replace
from functools import partial
from math import inf
from typing import Any

from plates.elements.field import PlateSampler
from plates.section import Section, check_thickness, homogeneous_section, section_data
from structures.checks import instance, short
from structures.described import registered
from structures.field import Field, Sampler
from structures.material import Material
from structures.structure import Structure
from structures.surface import Surface

SAME_RATIO = 1e-12
"""Poisson's ratios that differ by less than this are equal."""

SHAPE = "shape", "length", "width", "cells", "scale", "merge", "tags"
SCALES = {*SHAPE, "thickness", "material", "supports", "additions", "highest_frequency"}
"""Parameters of the builders that the scaling understands; it refuses all others by name."""


def scaled(structure: Structure, thickness: float | None = None, material: Material | None = None) -> Structure:
    """Return the same Kirchhoff plate with another thickness or material, from a structure that is already reduced.

    The plate must be homogeneous and isotropic, without additions, springs at its edges or damping, and ν must stay.
    Then stiffness is proportional to E t³ and mass to ρ t. With r² = E t²/ρ of the new plate over that of the old one,
    each frequency is multiplied by r. In oscillators (M = I) the contact vectors are multiplied by √(ρt/ρ′t′). The
    scaling is exact. It keeps mesh and basis, so results are smooth functions of t, E and ρ.

    Parameters
    ----------
    structure : Structure
        What `plate.at` returns, usually after `reduce`; with one contact or with several.
    thickness : float, optional
        The new thickness t′, m; None keeps the old one.
    material : Material, optional
        The new material, with the same Poisson's ratio; None keeps the old one.

    Returns
    -------
    Structure
        Of the same size. All times are divided by r: `valid_until`, and the pulse lengths of the error estimate. The
        frequency that the mesh resolves is multiplied by r. So reduce the plate with the slowest waves (the thinnest)
        for the frequency that all need, and for r times the longest run.

    Raises
    ------
    ValueError
        Where the scaling is not exact: in Mindlin's theory, for laminates, with additions, elastic edges or damping, or
        for another Poisson's ratio.

    Examples
    --------
    >>> import hertzlink as hl
    >>> plate = hl.kirchhoff_plate(0.2, 0.2, 2e-3, hl.ALUMINIUM_6061, hl.Supports(left="clamped"))
    >>> thin = hl.reduce(plate.at(0.1, 0.1), until=1e-3)
    >>> thick = hl.scaled(thin, thickness=4e-3)
    >>> float(round(thick.stiffness[0, 0] / thin.stiffness[0, 0], 9)), thick.valid_until
    (4.0, 0.0005)
    """
    instance("structure", structure, Structure, "a Structure, such as plate.at(x, y) returns")
    old = scalable("structure", structure.origin, structure.damping is not None)
    new = homogeneous_section(
        old.thickness if thickness is None else thickness,
        old.struck if material is None else instance("material", material, Material, "a Material, or None"),
    )
    if abs(new.struck.poisson_ratio - old.struck.poisson_ratio) > SAME_RATIO:
        raise ValueError(
            f"material = {new.struck.name or short(new.struck)}: has ν = {new.struck.poisson_ratio}, must have the "
            f"plate's {old.struck.poisson_ratio}; a plate of another ν has other modes, build and reduce it"
        )
    # The sides of an outline are not in its data.
    check_thickness(new.thickness, min(structure.origin.get(side, inf) for side in ("length", "width")))
    heavier, stiffer = factors(old, new.thickness, new.struck.youngs_modulus, new.struck.density)
    faster = wave_speed(old, new)
    field, mass = structure.field, structure.mass
    oscillators = mass.nnz == mass.shape[0] and bool((mass.diagonal() == 1.0).all())
    # Modes keep M = I, so their shapes scale with 1/√mass and their ω² with the square of the wave speed; a plate on
    # a mesh keeps its shapes, and M and K scale.
    if oscillators:
        smaller = heavier**-0.5
        stiffness = faster**2 * structure.stiffness
    else:
        smaller = 1.0
        mass, stiffness = heavier * structure.mass, stiffer * structure.stiffness
    if field is not None:
        basis = None if field.basis is None else smaller * field.basis
        field = Field(partial(_sampler, field.make, new, stiffer), field.count, basis)
    return Structure(
        mass,
        stiffness,
        None,
        smaller * structure.contact,
        structure.flexibilities / stiffer if structure.contacts > 1 else structure.flexibility / stiffer,
        Surface(new.struck) if structure.contacts == 1 else [Surface(new.struck)] * structure.contacts,
        _origin(structure.origin, new, faster),
        structure.valid_until / faster,
        field,
    )


def factors(old: Section, thickness: float, youngs_modulus: float, density: float) -> tuple[float, float]:
    """Return the factors of mass and of stiffness of a plate with another thickness (m), modulus (Pa) and density."""
    heavier = density * thickness / (old.struck.density * old.thickness)
    stiffer = youngs_modulus * thickness**3 / (old.struck.youngs_modulus * old.thickness**3)
    return heavier, stiffer


def wave_speed(old: Section, new: Section) -> float:
    """Return the ratio of all frequencies of a plate with the new wall to those with the old one."""
    heavier, stiffer = factors(old, new.thickness, new.struck.youngs_modulus, new.struck.density)
    return float((stiffer / heavier) ** 0.5)


def scalable(name: str, origin: Mapping[str, Any], damped: bool) -> Section:
    """Return wall of a homogeneous Kirchhoff plate, or raise a ValueError that says why the plate does not scale."""
    kind = str(origin.get("kind", "user's structure"))
    material = origin.get("material")
    names = {field.name for field in fields(Material)}
    supports = origin.get("supports")
    held = supports.values() if isinstance(supports, Mapping) else ()
    more = [of for entry in registered() if entry.called == kind for of in entry.parameters.values()]
    if not kind.startswith("Kirchhoff "):
        why = "only plates in Kirchhoff's theory do; in others shear, rotary inertia or the contact scale differently"
    elif not isinstance(material, Mapping) or set(material) != names:
        why = "its wall is not of one isotropic material"
    elif origin.get("additions"):
        why = "its additions keep their own mass and stiffness"
    elif any(isinstance(value, Mapping) for value in held):
        why = "its elastic edges keep their stiffness"
    elif damped or origin.get("damping"):
        why = "its damping does not scale; scale first, then add damping"
    elif others := [of.name for of in more if not (of.name in SCALES or origin.get(of.name) in (None, of.default))]:
        why = f"its {others[0]} = {short(origin[others[0]])} may change in another way"
    else:
        wall = homogeneous_section(origin["thickness"], Material(**material))
        if section_data(wall) == origin["section"]:
            return wall
        why = "its section is not that of its thickness and material"
    raise ValueError(f"{name}: this {kind} does not scale with thickness and material, as {why}")


def _origin(origin: Mapping[str, Any], section: Section, faster: float) -> dict[str, Any]:
    """Return how the new plate was made: as the old one, with times divided by `faster`."""
    changed = {
        **origin,
        "thickness": section.thickness,
        "material": asdict(section.struck),
        "section": section_data(section),
        "highest_frequency": origin["highest_frequency"] and faster * origin["highest_frequency"],
        "scaled_from": {"thickness": origin["thickness"], "material": origin["material"]},
    }
    if "reduction" in origin:
        report = dict(origin["reduction"])
        report["pulse"] /= faster
        if "until" in report:
            report["until"] /= faster
        if "shorter_pulses" in report:
            report["shorter_pulses"] = [(pulse / faster, error) for pulse, error in report["shorter_pulses"]]
        changed["reduction"] = report
    return changed


def _sampler(make: Any, section: Section, stiffer: float) -> Sampler:
    sampler: PlateSampler = make()
    return replace(sampler, section=section, stiffness=stiffer * sampler.stiffness)
