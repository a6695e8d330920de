"""Laminated walls: orthotropic plies, and the Section that classical lamination theory makes of them."""

from collections.abc import Sequence
from functools import lru_cache
from math import sqrt
from typing import Annotated, NamedTuple

import numpy as np

from plates.section import SHEAR_CORRECTION, Section, homogeneous_section
from structures.bodies.anisotropy import indentation_modulus, orthotropic_stiffness
from structures.bodies.elasticity import shear_modulus
from structures.checks import count_of, listed, positive
from structures.described import described
from structures.material import Material
from structures.quantities import Angle, Asks, Component, Density, Likely
from structures.structure import Vector

PlyModulus = Annotated[float, Likely.PLY_MODULUS]

PLIES = Asks('a list such as [{ material = "carbon", thickness = "0.25 mm", angle = "45 deg" }]')

SAME_THICKNESS = 1e-6
"""Part of a thickness by which one that is given may differ from the laminate's own: rounding."""


@described
class OrthotropicMaterial:
    """A sheet whose elasticity differs along and across its fibres.

    Parameters
    ----------
    youngs_modulus_along, youngs_modulus_across : float
        E₁ along and E₂ across the fibres, Pa.
    poisson_ratio : float
        ν₁₂: contraction across over extension along the fibres under tension along them; ν₁₂² < E₁/E₂.
    shear_modulus : float
        G₁₂ in the plane, Pa.
    shear_modulus_along, shear_modulus_across : float
        G₁₃ and G₂₃, transverse, along and across the fibres, Pa.
    density : float
        Density, kg/m³.
    name : str
        For results.

    Raises
    ------
    ValueError
        Where a number cannot belong to a solid.

    Examples
    --------
    >>> import hertzlink as hl
    >>> carbon = hl.OrthotropicMaterial(135e9, 9e9, 0.3, 5e9, 5e9, 3.2e9, 1560.0, "carbon fibre")
    >>> carbon.density
    1560.0
    """

    youngs_modulus_along: PlyModulus
    youngs_modulus_across: PlyModulus
    poisson_ratio: Component
    shear_modulus: PlyModulus
    shear_modulus_along: PlyModulus
    shear_modulus_across: PlyModulus
    density: Density
    name: Annotated[str, Asks("a name for tables")] = ""

    def __post_init__(self) -> None:
        largest = sqrt(self.youngs_modulus_along / self.youngs_modulus_across)
        if abs(self.poisson_ratio) >= largest:
            raise ValueError(
                f"poisson_ratio = {self.poisson_ratio!r}: must lie between ±√(E along / E across) = ±{largest:.4g}"
            )


@described
class Ply:
    """One layer of a laminate.

    Parameters
    ----------
    material : Material or OrthotropicMaterial
        Its material.
    thickness : float
        Thickness, m.
    angle : float
        From x towards y to its fibres, rad.

    Raises
    ------
    ValueError
        Where an argument is of the wrong kind or out of its range.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Ply(hl.PTFE, 1e-3).thickness
    0.001
    """

    material: Material | OrthotropicMaterial
    thickness: Annotated[float, Likely.PLY]
    angle: Angle = 0.0

    def __post_init__(self) -> None:
        if not isinstance(self.material, Material | OrthotropicMaterial):
            raise ValueError(f"material = {self.material!r}: must be a Material or an OrthotropicMaterial")


class Stiffnesses(NamedTuple):
    """A, B, D of classical lamination theory, 3 × 3 each, in N/m, N and N m: (N, M) over (ε, κ)."""

    extension: Vector
    coupling: Vector
    bending: Vector


@described
class Laminate:
    """Plies bonded into one wall.

    Parameters
    ----------
    plies : sequence of Ply
        The struck ply first.
    surface : Material, optional
        The isotropic material whose E and ν enter Hertz's contact law; by default that of the struck ply, if it is
        isotropic. An orthotropic ply is replaced by a material with the modulus E/(1 − ν²) that a half-space of the ply
        has in Hertz's law (`indentation_modulus`). The constants that a sheet leaves open are those of evenly
        distributed fibres: E₃ = E₂, ν₁₃ = ν₁₂ and ν₂₃ = E₂/2G₂₃ − 1. Plies below the first count as equal to it.

    Raises
    ------
    ValueError
        For other things than plies, and where G₂₃ leads to a ν₂₃ that no solid has: then give `surface`.

    Examples
    --------
    >>> import hertzlink as hl
    >>> wall = hl.Laminate([hl.Ply(hl.STEEL_316, 1e-3), hl.Ply(hl.PTFE, 2e-3)])
    >>> wall
    <Laminate: 2 plies, 3 mm, steel 316 is struck>
    """

    plies: Annotated[Sequence[Ply], PLIES]
    surface: Annotated[Material, Asks("the isotropic material that the bead feels")] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "plies", tuple(listed("plies", self.plies, Ply, "one Ply or more, the struck first")))
        if self.surface is None:
            _isotropic(self.plies[0].material)

    def __repr__(self) -> str:
        plies = f"{len(self.plies)} {'plies' if len(self.plies) > 1 else 'ply'}"
        return f"<Laminate: {plies}, {1e3 * self.thickness:.4g} mm, {self.struck.name or 'a material'} is struck>"

    @property
    def name(self) -> str:
        """The section in a few words."""
        return f"a laminate of {count_of(len(self.plies), 'ply')}"

    @property
    def thickness(self) -> float:
        """The thickness of all plies, m."""
        return sum(ply.thickness for ply in self.plies)

    @property
    def struck(self) -> Material:
        """The isotropic material that replaces the struck ply in Hertz's law."""
        return _isotropic(self.plies[0].material) if self.surface is None else self.surface

    @property
    def back(self) -> Material:
        """The one that replaces the last ply, which a chain on the back strikes."""
        return _isotropic(self.plies[-1].material) if self.surface is None else self.surface

    @property
    def stiffnesses(self) -> Stiffnesses:
        """A, B and D about the middle surface: Σ Q̄ (z₂ⁿ − z₁ⁿ)/n for n = 1, 2, 3 over the plies.

        (Reddy, Mechanics of Laminated Composite Plates and Shells, 2nd ed., section 3.3.)
        """
        sums = np.zeros((3, 3, 3))
        for ply, low, high in self._places():
            stiffness = _plane_stiffness(ply)
            sums += [stiffness * ((high**n - low**n) / n) for n in (1, 2, 3)]
        return Stiffnesses(*sums)

    def stresses(self, forces: Vector) -> list[tuple[Material, Vector]]:
        """Return the stresses (xx, yy, xy), Pa, in each ply of an isotropic material under forces per length, N/m.

        The plies share the forces by their moduli, and the plate stays flat.
        """
        strain = np.linalg.solve(self.stiffnesses.extension, forces)
        return [
            (ply.material, _plane_stiffness(ply) @ strain) for ply in self.plies if isinstance(ply.material, Material)
        ]

    def section(self, shear_correction: float = SHEAR_CORRECTION) -> Section:
        """Return the bending and shear stiffness and the mass that a plate's theory uses.

        Where bending and stretching are coupled (B ≠ 0) the bending stiffness is the reduced one, D − B A⁻¹ B: exact
        where no in-plane force arises, as in a plate whose edges may slide in its plane; held edges make it stiffer
        (Ashton, J. Compos. Mater. 3 (1969) 188; Whitney, Structural Analysis of Laminated Anisotropic Plates).
        The shear stiffness is Σ G t of the plies times one correction, 5/6 by default; laminates of
        very different plies require a smaller one.
        """
        positive("shear_correction", shear_correction)
        extension, coupling, bending = self.stiffnesses
        reduced = bending - coupling @ np.linalg.solve(extension, coupling)
        shear, mass, inertia = np.zeros((2, 2)), 0.0, 0.0
        for ply, low, high in self._places():
            shear += shear_correction * ply.thickness * _shear_stiffness(ply)
            mass += ply.material.density * ply.thickness
            inertia += ply.material.density * (high**3 - low**3) / 3.0
        return Section((reduced + reduced.T) / 2.0, shear, mass, inertia, self.thickness, self.struck)

    def _places(self) -> list[tuple[Ply, float, float]]:
        """Return each ply with its two faces' distances from the middle surface, m, away from the striker."""
        faces = np.cumsum([0.0] + [ply.thickness for ply in self.plies]) - self.thickness / 2.0
        return list(zip(self.plies, faces[:-1].tolist(), faces[1:].tolist(), strict=True))


def section_of(
    thickness: float | None, material: Material | Laminate | Section, shear_correction: float = SHEAR_CORRECTION
) -> Section:
    """Return the section of a plate of one material or of a laminate, or the section that is given.

    Laminates and sections have a thickness of their own: give that, or None. A ValueError for another thickness, and
    for None with a material.
    """
    if isinstance(material, Laminate | Section):
        total, what = material.thickness, "laminate" if isinstance(material, Laminate) else "section"
        if thickness is not None and abs(thickness - total) > SAME_THICKNESS * total:
            raise ValueError(f"thickness = {thickness!r}: must be None or the {what}'s own, {total:.9g} m")
        return material if isinstance(material, Section) else material.section(shear_correction)
    if not isinstance(material, Material):
        raise ValueError(
            f"material = {material!r}: must be a Material, a Laminate or a Section; MATERIALS[name] gives a material "
            "by name"
        )
    if thickness is None:
        raise ValueError("thickness = None: must be a positive number of m; only a Laminate or a Section has its own")
    return homogeneous_section(thickness, material, shear_correction)


def struck(section: Section, material: object, face: str) -> Material:
    """Return the material at a face, which a contact meets; only a Laminate has two."""
    return material.back if face == "back" and isinstance(material, Laminate) else section.struck


@lru_cache(maxsize=256)
def _isotropic(ply: Material | OrthotropicMaterial) -> Material:
    """Return the isotropic material with the indentation modulus of a ply."""
    if isinstance(ply, Material):
        return ply
    along, across, ratio = ply.youngs_modulus_along, ply.youngs_modulus_across, ply.poisson_ratio
    around = across / (2.0 * ply.shear_modulus_across) - 1.0
    if not -1.0 < around < 1.0 - 2.0 * ratio**2 * across / along:
        raise ValueError(
            f"shear_modulus_across = {ply.shear_modulus_across!r}: gives ν = {around:.3g} around the fibres, which no "
            "solid has; give surface=, the Material of the contact"
        )
    shear = (ply.shear_modulus_across, ply.shear_modulus_along, ply.shear_modulus)
    constants = orthotropic_stiffness((along, across, across), (around, ratio, ratio), shear)
    return Material(indentation_modulus(constants), 0.0, ply.density, ply.name)


def _plane_stiffness(ply: Ply) -> Vector:
    """Return Q̄ of plane stress in the plate's axes, 3 × 3, Pa: (σ_xx, σ_yy, σ_xy) over (ε_xx, ε_yy, 2 ε_xy)."""
    material = ply.material
    if isinstance(material, Material):
        along = across = material.youngs_modulus
        ratio, shear = material.poisson_ratio, shear_modulus(material)
    else:
        along, across = material.youngs_modulus_along, material.youngs_modulus_across
        ratio, shear = material.poisson_ratio, material.shear_modulus
    tension, contraction = 1.0 / along, -ratio / along
    compliance = np.array([[tension, contraction, 0.0], [contraction, 1.0 / across, 0.0], [0.0, 0.0, 1.0 / shear]])
    c, s = np.cos(ply.angle), np.sin(ply.angle)
    # Strains in the fibres' axes from those in the plate's. By virtual work its transpose rotates the stresses back.
    turn = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2.0 * c * s, 2.0 * c * s, c * c - s * s]])
    stiffness: Vector = turn.T @ np.linalg.inv(compliance) @ turn
    return stiffness


def _shear_stiffness(ply: Ply) -> Vector:
    """Return the transverse shear moduli in the plate's axes, 2 × 2, Pa."""
    material = ply.material
    if isinstance(material, Material):
        return shear_modulus(material) * np.eye(2)
    c, s = np.cos(ply.angle), np.sin(ply.angle)
    turn = np.array([[c, s], [-s, c]])
    return np.asarray(turn.T @ np.diag([material.shear_modulus_along, material.shear_modulus_across]) @ turn)
