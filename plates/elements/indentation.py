"""The contact force on a small disc of Mindlin's plate, and the indentation that neither the plate nor Hertz contains.

Hertz's law contains the indentation of a half-space. Under a pressure p cos kx on its face, a plate in three dimensions
deflects by p (1 − ν²)/Ek · B(kt) more than the half-space, with B = (ch + 1)/(sh − x) + (ch − 1)/(sh + x) − 2, x = kt
(Timoshenko and Goodier, Theory of Elasticity, section 24). This is 1/Dk⁴ + t²/5Dk² + … for long waves and zero for
short ones. Mindlin's plate deflects by 1/Dk⁴ + 1/Sk² with D/S = t²/5(1 − ν). Its second term is too large, and for
short waves it causes the logarithmic singularity under a point force. Two corrections make the result independent of
the disc's radius a. First, the transverse stress under the force bends the plate by Poisson's effect, e p̂ with
e = νt²/10(1 − ν) (Reissner, J. Appl. Mech. 12 (1945) 69); a²/8 is subtracted, because the mean over the disc has the
same effect. Second, the difference that remains is a constant, which is given as a flexibility.

For a laminate the same two corrections follow from the static deflection of its layers under p cos kx, which finite
elements through the thickness give without a plate theory.
"""

from functools import lru_cache, partial
from math import log, pi

import numpy as np
from scipy.special import j1

from plates.laminate import LayeredSection, Ply, constants, turned
from plates.section import Section, stiffness_towards
from structures.material import Material
from structures.structure import Vector

LAYER = -2.252968  # ∫ B(x) − 12/x³ − 2.4/x [x < 1] dx from 0 on
MEAN_OF_LOGARITHM = 0.3659315  # ∫ (4 J₁²(x)/x² − [x < 1]) dx/x = ln 2 − γ + 1/4
MEAN_OF_BENDING = -0.2373162  # ∫ (4 J₁²(x)/x² − 1 + x²/4 [x < 1]) dx/x³ = −(ln 2 − γ)/4 − 5/24
# Degree of the elements through the thickness, and number of halvings of the elements towards the struck face.
DEGREE, HALVED = 4, 5
DIRECTIONS = 12  # Number of directions of the waves over half a turn, if a ply is anisotropic
# The least kt, which is lower if shear is soft, and the greatest k times the thickness of the struck ply. For longer
# waves Mindlin's theory holds, for shorter ones that of a half-space.
LONGEST, SHORTEST = 0.2, 20.0
PANELS = np.polynomial.legendre.leggauss(6)


def bending_by_poisson(section: Section) -> float:
    """Return e, m²: the displacement of the contact is the mean of w + (e − a²/8) ∇·s over a disc of radius a."""
    if isinstance(section, LayeredSection):
        # For long waves the deflection of the layers is 1/Dk⁴ + 1/Sk² − 2e/Dk² + O(k⁰).
        wavenumber, layers = deflections(section)
        excess = (layers - plate_deflections(section, wavenumber))[:2] * wavenumber[:2] ** 2
        ratio = (wavenumber[1] / wavenumber[0]) ** 2
        return float(-(ratio * excess[0] - excess[1]) / (ratio - 1.0) * _rigidity(section) / 2.0)
    nu = section.struck.poisson_ratio
    return nu * section.thickness**2 / (10.0 * (1.0 - nu))


def remaining_flexibility(section: Section, radius: float) -> float:
    """Return the compliance of the layer in three dimensions, m/N, minus those of the half-space and of Mindlin's plate
    under a disc of this radius, m. It is 1/2π ∫ (layer − half-space − plate · disc²) k dk.

    The disc's mean is 2J₁(ka)/ka. The stiffness of anisotropic walls is averaged over all directions.
    """
    if not isinstance(section, LayeredSection):
        rigidity, shear = _rigidity(section), float(np.sqrt(np.linalg.det(section.shear)))
        bend, thickness = bending_by_poisson(section) - radius**2 / 8.0, section.thickness
        ratio = log(thickness / radius)
        plate = radius**2 / rigidity * (MEAN_OF_BENDING - ratio / 4.0)
        plate += (1.0 / shear - 2.0 * bend / rigidity) * (ratio + MEAN_OF_LOGARITHM)
        plate += 2.0 * bend**2 / (rigidity * radius**2)
        return (LAYER * thickness**2 / (12.0 * rigidity) - plate) / (2.0 * pi)

    of_plate = partial(plate_deflections, section, bend=bending_by_poisson(section), radius=radius)
    wavenumber, layers = deflections(section)
    edges = np.geomspace(wavenumber[1], wavenumber[-1], 1 + (wavenumber.size - 3) // PANELS[0].size)
    weights, modulus = (np.diff(edges)[:, None] / 2.0 * PANELS[1]).ravel(), section.struck.contact_modulus
    solid = float(((layers[2:-1] * wavenumber[2:-1] - 2.0 / modulus) * weights).sum())
    # The mean over the disc oscillates and needs more points; its functions are cheap.
    ends = edges[0], edges[-1]
    fine = np.unique(np.concatenate([np.geomspace(*ends, 2001), np.linspace(*ends, 4001)]))
    disc = (2.0 * j1(fine * radius) / (fine * radius)) ** 2
    plate = float(np.trapezoid(of_plate(fine) * disc * fine, fine))
    plate += 4.0 / pi * float(of_plate(edges[-1:])[0]) / (radius**3 * edges[-1])
    # For longer waves the difference between the plate and the layers is constant.
    long = float(layers[1] - of_plate(edges[:1])[0] * disc[0]) * edges[0] ** 2 / 2.0
    return float(solid - plate + long - 2.0 * float(edges[0]) / modulus) / (2.0 * pi)


def _rigidity(section: Section) -> float:
    """Return the harmonic mean of D over all directions, N m, which determines the deflection under a point force."""
    return float(1.0 / (1.0 / stiffness_towards(section)).mean())


def plate_deflections(section: Section, wavenumber: Vector, bend: float = 0.0, radius: float = 0.0) -> Vector:
    """Return the deflection of Mindlin's plate under 1 Pa · cos kx, m, averaged over all directions of the wave.

    With s = i σ, each wall has the energy ½ k² σᵀ Eᵀ B E σ + ½ (k n w − σ)ᵀ S (k n w − σ), where n is the unit vector
    along the wave. The pressure acts on w − k n·(bend σ − a²/8 σ′), where σ′ belongs to the last wall.
    """
    size, mean = 1 + 2 * len(section.walls), np.zeros(wavenumber.size)
    angles = np.arange(2 * DIRECTIONS) * pi / (2 * DIRECTIONS)
    for c, s in zip(np.cos(angles), np.sin(angles), strict=True):
        n, curved = np.array([c, s]), np.array([[c, 0.0], [0.0, s], [s, c]])
        matrix, load = np.zeros((wavenumber.size, size, size)), np.zeros((wavenumber.size, size, 1))
        load[:, 0, 0] = 1.0
        load[:, 1:3, 0] -= bend * wavenumber[:, None] * n
        load[:, -2:, 0] += radius**2 / 8.0 * wavenumber[:, None] * n
        for i, (bending, shear, _) in enumerate(section.walls):
            own = slice(1 + 2 * i, 3 + 2 * i)
            matrix[:, 0, 0] += wavenumber**2 * (n @ shear @ n)
            matrix[:, own, own] += wavenumber[:, None, None] ** 2 * (curved.T @ bending @ curved) + shear
            matrix[:, 0, own] = matrix[:, own, 0] = -wavenumber[:, None] * (shear @ n)
        mean += (load * np.linalg.solve(matrix, load)).sum(axis=(1, 2)) / angles.size
    return mean


def deflections(section: LayeredSection) -> tuple[Vector, Vector]:
    """Return wavenumbers k, 1/m, and the deflections of the face under 1 Pa · cos kx, m: for two long waves, for Gauss
    points of panels, and for the shortest wave."""
    soft = float(np.linalg.eigvalsh(section.shear)[0]) * section.thickness**2 / (3.0 * section.bending[0, 0])
    longest = LONGEST / section.thickness * min(1.0, soft**0.5)
    wavenumber, layers = _deflections(section.plies, round(longest, 9))
    return wavenumber, layers - section.softer / wavenumber**4


@lru_cache(maxsize=64)
def _deflections(plies: tuple[Ply, ...], longest: float) -> tuple[Vector, Vector]:
    """Return wavenumbers and mean deflections over the directions, by elements through the thickness.

    The displacement is (iU, iV, w) e^{ikx}. So the strains 11, 33, 12 are −kU, w′, −kV, and 23, 13 are iV′, i(U′ + kw).
    """
    edges = np.geomspace(2.0 * longest, SHORTEST / plies[0].thickness, 26)
    points = (edges[1:] + edges[:-1])[:, None] / 2.0 + np.diff(edges)[:, None] / 2.0 * PANELS[0]
    wavenumber = np.concatenate([[longest, 2.0 * longest], points.ravel(), edges[-1:]])
    across, along = np.zeros((6, 3)), np.zeros((6, 3))
    along[0, 0] = along[5, 1] = -1.0
    along[4, 2] = across[2, 2] = across[3, 1] = across[4, 0] = 1.0
    nodes = np.linspace(0.0, 1.0, DEGREE + 1)
    place, weight = np.polynomial.legendre.leggauss(DEGREE + 1)
    place, weight = (place + 1.0) / 2.0, weight / 2.0
    shapes = np.linalg.inv(np.vander(nodes, increasing=True))
    value = np.vander(place, DEGREE + 1, increasing=True) @ shapes
    slope = np.vander(place, DEGREE, increasing=True) * np.arange(1, DEGREE + 1) @ shapes[1:]
    masses, mixes, slopes = (
        np.einsum("q,qa,qb->ab", weight, *pair) for pair in ((value, value), (value, slope), (slope, slope))
    )
    cells = [(plies[0], plies[0].thickness * 2.0**-i) for i in (HALVED, *range(HALVED, 0, -1))]
    cells += [(ply, ply.thickness / 2.0) for ply in plies[1:] for _ in (0, 1)]
    size = 3 * (DEGREE * len(cells) + 1)
    force, mean = np.eye(1, size, 2)[0], np.zeros(wavenumber.size)
    count = 1 if all(isinstance(ply.material, Material) for ply in plies) else DIRECTIONS
    for direction in range(count):
        parts = np.zeros((3, size, size))  # coefficients of k⁰, k¹, k²
        for i, (ply, thickness) in enumerate(cells):
            own = slice(3 * DEGREE * i, 3 * DEGREE * (i + 1) + 3)
            stiff = turned(constants(ply.material), ply.angle - direction * pi / count)
            mixed = np.kron(mixes, along.T @ stiff @ across)
            parts[0, own, own] += np.kron(slopes / thickness, across.T @ stiff @ across)
            parts[1, own, own] += mixed + mixed.T
            parts[2, own, own] += np.kron(masses * thickness, along.T @ stiff @ along)
        mean += [np.linalg.solve(parts[0] + k * parts[1] + k**2 * parts[2], force)[2] for k in wavenumber]
    return wavenumber, mean / count
