"""Laminated walls: orthotropic plies, and their Section in classical lamination theory."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import pi, sqrt
from typing import Annotated

import numpy as np

from plates.section import SHEAR_CORRECTION, Section, homogeneous_section
from structures.bodies.anisotropy import VOIGT_INDEX, indentation_modulus, orthotropic_stiffness
from structures.bodies.elasticity import shear_modulus
from structures.checks import count_of, instance, listed, within
from structures.described import described
from structures.material import Material
from structures.quantities import Angle, Asks, Component, Density, Likely
from structures.structure import Vector

PlyModulus = Annotated[float, Likely.PLY_MODULUS]
PLIES = Asks('a list such as [{ material = "carbon", thickness = "0.25 mm", angle = "45 deg" }]')
# Points and weights in a ply, exact for squares of the warping, which is cubic
GAUSS = np.polynomial.legendre.leggauss(4)
DIRECTIONS = 48  # Number of directions of waves over half a turn, for a mean that is exact to rounding
# The plies' own part of the bending stiffness is neglected if this part, times the ratio of their shear stiffness to
# that of the laminate, is smaller. It is 0.012 for a single material, and 0.18 for aluminium on PTFE on aluminium.
LEAST_OWN = 0.1
SAME_THICKNESS = 1e-6  # Relative tolerance, for rounding, of a given thickness of a laminate


@described
class OrthotropicMaterial:
    """A sheet with different elasticity along and across its fibres.

    Parameters
    ----------
    youngs_modulus_along, youngs_modulus_across : float
        E₁ along and E₂ across the fibres, Pa.
    poisson_ratio : float
        ν₁₂: ratio of contraction across to extension along the fibres, under tension along them; ν₁₂² < E₁/E₂.
    shear_modulus : float
        G₁₂ in the plane, Pa.
    shear_modulus_along, shear_modulus_across : float
        Transverse shear moduli G₁₃ along and G₂₃ across the fibres, Pa.
    density, name : float, str
        Density, kg/m³, and a name for results.

    Examples
    --------
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
        within("poisson_ratio", self.poisson_ratio, -largest, largest, ends=False)


@described
class Ply:
    """One layer of a laminate.

    Parameters
    ----------
    material, thickness : Material or OrthotropicMaterial, float
        Material, and thickness, m.
    angle : float
        Angle from x, towards y, to the fibres, rad.

    Examples
    --------
    >>> hl.Ply(hl.PTFE, 1e-3).thickness
    0.001
    """

    material: Material | OrthotropicMaterial
    thickness: Annotated[float, Likely.PLY]
    angle: Angle = 0.0

    def __post_init__(self) -> None:
        instance("material", self.material, (Material, OrthotropicMaterial), "a Material or an OrthotropicMaterial")

    @cached_property
    def elasticity(self) -> tuple[Vector, Vector]:
        """Stiffnesses in the plate's axes, Pa: Q̄ of plane stress, 3 × 3, and transverse shear moduli xz, yz, 2 × 2."""
        c, plane, across = turned(constants(self.material), self.angle), [0, 1, 5], [4, 3]
        return c[np.ix_(plane, plane)] - np.outer(c[plane, 2], c[2, plane]) / c[2, 2], c[np.ix_(across, across)]


@described
class Laminate:
    """Plies bonded into one wall.

    Parameters
    ----------
    plies : sequence of Ply
        The plies; the struck one comes first.
    surface : Material, optional
        The isotropic material for Hertz's contact law; by default that of the struck ply. An orthotropic ply is
        replaced by an isotropic material with the modulus of a half-space of evenly distributed fibres
        (`indentation_modulus` with E₃ = E₂, ν₁₃ = ν₁₂ and ν₂₃ = E₂/2G₂₃ − 1).

    Examples
    --------
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
        plies, wall = count_of(len(self.plies), "ply"), f"{1e3 * self.thickness:.4g} mm"
        return f"<Laminate: {plies}, {wall}, {self.struck.name or 'a material'} is struck>"

    @property
    def name(self) -> str:
        """A short name of the laminate for messages."""
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
    def stiffnesses(self) -> Vector:
        """A (N/m), B (N) and D (N m) of classical lamination theory, 3 × 3 × 3: (N, M) from (ε, κ) of the middle."""
        sums = np.zeros((3, 3, 3))
        for ply, low, high in self._places():
            sums += [ply.elasticity[0] * ((high**n - low**n) / n) for n in (1, 2, 3)]
        return sums

    def stresses(self, forces: Vector) -> list[tuple[Material, Vector]]:
        """Return the stresses (xx, yy, xy), Pa, in each isotropic ply of a flat plate under forces per length, N/m."""
        strain = np.linalg.solve(self.stiffnesses[0], forces)
        return [(ply.material, ply.elasticity[0] @ strain) for ply in self.plies if isinstance(ply.material, Material)]

    def section(self, face: str = "front") -> "LayeredSection":
        """Return the section for a plate's theory, struck on a face.

        If bending and stretching are coupled (B ≠ 0), the bending stiffness is the reduced one, D − B A⁻¹ B, for a
        plate whose edges can slide in its plane (Ashton, J. Compos. Mater. 3 (1969) 188). The shear stiffness follows
        from the equilibrium of the layers (Whitney, J. Appl. Mech. 40 (1973) 302); see docs/theory.md.
        """
        extension, coupling, bending = self.stiffnesses
        neutral: Vector = np.asarray(np.linalg.solve(extension, coupling))
        unequal = bending - coupling @ neutral
        reduced: Vector = np.asarray((unequal + unequal.T) / 2.0)
        mass = sum(ply.material.density * ply.thickness for ply in self.plies)
        inertia = sum(ply.material.density * (high**3 - low**3) / 3.0 for ply, low, high in self._places())
        plies = tuple(self.plies) if face == "front" else tuple(self.plies[::-1])
        struck = self.surface or _isotropic(plies[0].material)
        own_shear = sum((SHEAR_CORRECTION * ply.thickness * ply.elasticity[1] for ply in plies), np.zeros((2, 2)))
        compliance, own = self._sheared(neutral, np.asarray(np.linalg.inv(reduced)))
        shear: Vector = np.asarray(np.linalg.inv(compliance))
        if own * np.trace(own_shear) < LEAST_OWN * np.trace(shear):
            own = 0.0
        # The error of the reduced bending stiffness for plane waves: the mean of 1/D(φ) − 1/D over all directions, 1/N
        # m. D − B A⁻¹ B allows strains across the direction of a wave, but a wave does not cause them.
        softer = 0.0
        for angle in np.arange(DIRECTIONS) * pi / DIRECTIONS:
            c, s = np.cos(angle), np.sin(angle)
            along, twist = np.array([c * c, s * s, 2.0 * c * s]), np.array([-c * s, c * s, c * c - s * s])
            strains = np.stack([along, twist], axis=1)
            pull = strains.T @ coupling @ along
            wave = along @ bending @ along - pull @ np.linalg.solve(strains.T @ extension @ strains, pull)
            softer += float(1.0 / wave - 1.0 / (along @ reduced @ along)) / DIRECTIONS
        return LayeredSection(reduced, shear, mass, inertia, self.thickness, struck, own, own_shear, plies, softer)

    def _sheared(self, neutral: Vector, flexibility: Vector) -> tuple[Vector, float]:
        """Return S⁻¹, 2 × 2, m/N, and the plies' own part of the bending stiffness.

        The shear strains of a unit force Q warp the section by φ(z), φ′ = G⁻¹ τ. Waves short enough to shear the plate
        freely bend it with the part of the stiffness that φ cannot relax: 1 − (∫ Q̄ z φ)²/(∫ Q̄ z² ∫ Q̄ φ²).
        """

        def stress(z: Vector, low: float, stiff: Vector, below: Vector) -> Vector:
            """Return τ(z) for unit forces Q, … × 2 × 2; below: ∫ σ,x dz from the struck face to z = low."""
            moved = (z**2 - low**2)[..., None, None] / 2.0 * np.eye(3) - (z - low)[..., None, None] * neutral
            total = below + stiff @ moved @ flexibility
            return -np.stack([total[..., [0, 2], [0, 1]], total[..., [2, 1], [0, 1]]], axis=-2)

        compliance, force, warping = np.zeros((2, 2)), np.zeros((3, 3)), np.zeros(2)
        sums = np.zeros((5, 2))  # ∫ Q̄ times 1, φ, φ², zφ, z², with z from the line without strain
        place, weight = GAUSS
        for ply, low, high in self._places():
            stiff, soft = ply.elasticity[0], np.linalg.inv(ply.elasticity[1])
            half, start = (high - low) / 2.0, (low, stiff, force)
            z = low + half * (1.0 + place)
            tau = stress(z, *start)
            compliance += half * np.einsum("q,qji,jk,qkl->il", weight, tau, soft, tau)
            # φ at the Gauss points and at the other face, each by the same rule from the ply's face to the point.
            reach = np.append(z, high) - low
            inner = soft @ stress(low + reach[:, None] / 2.0 * (1.0 + place), *start)
            phi = warping + reach[:, None] / 2.0 * np.einsum("q,pqii->pi", weight, inner)
            above = z[:, None] - np.diag(neutral)[:2]
            terms = np.stack([np.ones_like(above), phi[:-1], phi[:-1] ** 2, above * phi[:-1], above**2])
            sums += half * np.diag(stiff)[:2] * np.einsum("q,tqi->ti", weight, terms)
            warping = phi[-1]
            force = force + stiff @ ((high**2 - low**2) / 2.0 * np.eye(3) - (high - low) * neutral) @ flexibility
        one, mean, square, mixed, bent = sums
        return compliance, float(np.min(1.0 - mixed**2 / (bent * (square - mean**2 / one))))

    def _places(self) -> list[tuple[Ply, float, float]]:
        """Return each ply with the distances of its faces behind the middle surface, m, as seen from the striker."""
        faces = np.cumsum([0.0] + [ply.thickness for ply in self.plies]) - self.thickness / 2.0
        return list(zip(self.plies, faces[:-1].tolist(), faces[1:].tolist(), strict=True))


@dataclass(frozen=True, eq=False, repr=False)
class LayeredSection(Section):
    """The wall of a laminate, with its plies from the struck face and their own part of the bending stiffness.

    In Mindlin's theory the wall is two walls with the same deflection. One has the part 1 − `own` of the bending
    stiffness and shears like the laminate; the other has the rest and shears like the plies: `own_shear`, 2 × 2, N/m.
    """

    own: float
    own_shear: Vector
    plies: tuple[Ply, ...]
    softer: float

    @property
    def walls(self) -> list[tuple[Vector, Vector, float]]:
        """Bending stiffness, shear stiffness, and part of the rotary inertia of each wall."""
        if self.own == 0.0:
            return super().walls
        # For long waves the energies add up: D²/S = (1 − own)² D²/S₁ + own² D²/S₂.
        rest = np.linalg.inv(np.linalg.inv(self.shear) - self.own**2 * np.linalg.inv(self.own_shear))
        part = 1.0 - self.own
        return [(part * self.bending, part**2 * rest, part), (self.own * self.bending, self.own_shear, self.own)]


def section_of(
    thickness: float | None, material: Material | Laminate, shear_correction: float = SHEAR_CORRECTION
) -> Section:
    """Return the section of a plate of one material or of a laminate."""
    if isinstance(material, Laminate):
        total = material.thickness
        if thickness is not None and abs(thickness - total) > SAME_THICKNESS * total:
            raise ValueError(f"thickness = {thickness!r}: must be None or that of the laminate, {total:.9g} m")
        if shear_correction != SHEAR_CORRECTION:
            raise ValueError(f"shear_correction = {shear_correction!r}: must be omitted for a laminate")
        return material.section()
    instance("material", material, Material, "a Material or a Laminate; MATERIALS[name] gives a material by name")
    if thickness is None:
        raise ValueError("thickness = None: must be a positive number of m, unless material is a Laminate")
    return homogeneous_section(thickness, material, shear_correction)


@lru_cache(maxsize=256)
def _isotropic(ply: Material | OrthotropicMaterial) -> Material:
    """Return the isotropic material with the indentation modulus of a ply."""
    if isinstance(ply, Material):
        return ply
    around, limit = _around_fibres(ply)
    if not -1.0 < around < limit:
        raise ValueError(f"shear_modulus_across = {ply.shear_modulus_across!r}: gives ν = {around:.3g}; give surface=")
    return Material(indentation_modulus(constants(ply)), 0.0, ply.density, ply.name)


def _around_fibres(ply: OrthotropicMaterial) -> tuple[float, float]:
    """Return ν₂₃ for evenly distributed fibres, and the upper limit of ν₂₃ for a solid."""
    around = ply.youngs_modulus_across / (2.0 * ply.shear_modulus_across) - 1.0
    return around, 1.0 - 2.0 * ply.poisson_ratio**2 * ply.youngs_modulus_across / ply.youngs_modulus_along


def constants(ply: Material | OrthotropicMaterial) -> Vector:
    """Return the elastic constants C of a ply in the axes of its fibres, 6 × 6, Pa; E₃ = E₂ and ν₁₃ = ν₁₂."""
    if isinstance(ply, Material):
        return orthotropic_stiffness([ply.youngs_modulus] * 3, [ply.poisson_ratio] * 3, [shear_modulus(ply)] * 3)
    along, across, ratio = ply.youngs_modulus_along, ply.youngs_modulus_across, ply.poisson_ratio
    around, limit = _around_fibres(ply)
    if not -1.0 < around < limit:
        around = 0.9 * max(min(around, limit), -1.0)  # the nearest possible value, for plies with a given surface
    shear = (ply.shear_modulus_across, ply.shear_modulus_along, ply.shear_modulus)
    return orthotropic_stiffness((along, across, across), (around, ratio, ratio), shear)


def turned(stiffness: Vector, angle: float) -> Vector:
    """Return elastic constants, 6 × 6, of a material whose axes are turned about z by an angle, rad."""
    c, s = np.cos(angle), np.sin(angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    full = stiffness[VOIGT_INDEX[:, :, None, None], VOIGT_INDEX]
    full = np.einsum("ai,bj,ck,dl,ijkl->abcd", turn, turn, turn, turn, full)
    rows, columns = [0, 1, 2, 1, 0, 0], [0, 1, 2, 2, 2, 1]
    return np.asarray(full[rows, columns][:, rows, columns])
