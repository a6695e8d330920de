"""Linear elasticity of solids: moduli, speeds of waves, mass and stiffness.

The last two take a scikit-fem basis of a vector element in space, or in the half-plane (r, z) of a body of revolution.
In the half-plane every integral has the weight 2π r, and the hoop strain u_r/r is added.
"""

from collections.abc import Sequence
from math import pi, sqrt
from operator import attrgetter
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from structures.linear_algebra.factor import sum_of_cells
from structures.material import Material
from structures.structure import Vector

Owner = NDArray[np.int64]


def shear_modulus(material: Material) -> float:
    """Return μ = E / 2(1 + ν), Pa."""
    return material.youngs_modulus / (2.0 * (1.0 + material.poisson_ratio))


def first_lame_parameter(material: Material) -> float:
    """Return λ = 2 μ ν / (1 − 2ν), Pa."""
    return 2.0 * shear_modulus(material) * material.poisson_ratio / (1.0 - 2.0 * material.poisson_ratio)


def pressure_speed(material: Material) -> float:
    """Return the speed c_p = √((λ + 2μ)/ρ) of pressure waves in a large body, m/s."""
    return sqrt((first_lame_parameter(material) + 2.0 * shear_modulus(material)) / material.density)


def shear_speed(material: Material) -> float:
    """Return the speed c_s = √(μ/ρ) of shear waves, m/s."""
    return sqrt(shear_modulus(material) / material.density)


def patch_compliance(material: Material, radius: float) -> float:
    """Return the mean displacement of a circle (radius a, m) on a half-space under a uniform pressure, m/N.

    16 (1 − ν²)/(3 π² E a): the mean of Love's solution (Johnson, Contact Mechanics, section 3.4).
    """
    return 16.0 / (3.0 * pi**2 * material.contact_modulus * radius)


def body_matrices(basis: Any, materials: Sequence[Material], owner: Owner) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Return the consistent mass, kg, and stiffness, N/m; owner: the index of the material of each cell."""
    density, lame, shear = (
        np.array([of(material) for material in materials])[owner]
        for of in (attrgetter("density"), first_lame_parameter, shear_modulus)
    )
    cells = _Cells(basis)
    return cells.mass(density), cells.stiffness(lame, shear)


def part_stiffnesses(basis: Any, materials: Sequence[Material], owner: Owner) -> list[sparse.csr_array]:
    """Return the contribution of the cells of each material to the stiffness, n × n each; see `body_matrices`."""
    cells = _Cells(basis)
    return [
        cells.stiffness(first_lame_parameter(material) * (owner == part), shear_modulus(material) * (owner == part))
        for part, material in enumerate(materials)
    ]


class _Cells:
    """Integrals over all cells at once: two to five times as fast as scikit-fem's loop over pairs of functions."""

    def __init__(self, basis: Any) -> None:
        self.basis, self.dim = basis, basis.mesh.dim()
        # A cell's degrees of freedom: all components of its first shape function, then all of its second, ...
        functions = [function[0] for function in basis.basis[:: self.dim]]
        # Cells × functions × integration points; the gradients have `dim` rows for each function.
        self.values = np.stack([np.asarray(function)[0] for function in functions], axis=1)
        slopes = np.stack([function.grad[0] for function in functions]).transpose(2, 0, 1, 3)
        self.slopes = slopes.reshape(len(slopes), -1, slopes.shape[-1])
        x = np.asarray(basis.global_coordinates())
        self.weight = (basis.dx * (2.0 * pi * x[0] if self.dim == 2 else 1.0))[:, None]
        self.hoops = self.values / x[0][:, None] if self.dim == 2 else None

    def mass(self, density: Vector) -> sparse.csr_array:
        """Return ∫ ρ u · v, kg; density: ρ of each cell, kg/m³."""
        overlaps = density[:, None, None] * self._integrals(self.values)
        return self._assembled(overlaps[:, :, None, :, None] * np.eye(self.dim)[:, None, :])

    def stiffness(self, lame: Vector, shear: Vector) -> sparse.csr_array:
        """Return ∫ λ div u div v + 2μ ε(u) : ε(v), N/m; lame, shear: λ and μ of each cell, Pa."""
        count = self.values.shape[1]
        shape = len(lame), count, self.dim, count, self.dim
        products = dilations = self._integrals(self.slopes).reshape(shape)
        traces = np.trace(products, axis1=2, axis2=4)[:, :, None, :, None]
        # 2 ε(u) : ε(v) for u = φ along i and v = ψ along j is ∂ⱼφ ∂ᵢψ, plus ∇φ · ∇ψ if i = j.
        strains = products.transpose(0, 1, 4, 3, 2) + traces * np.eye(self.dim)[:, None, :]
        if self.hoops is not None:
            widened = self.slopes.copy()
            widened[:, :: self.dim] += self.hoops
            dilations = self._integrals(widened).reshape(shape)
            strains[:, :, 0, :, 0] += 2.0 * self._integrals(self.hoops)
        each = (slice(None), *4 * (None,))
        return self._assembled(lame[each] * dilations + shear[each] * strains)

    def _integrals(self, functions: Vector) -> Vector:
        """Return the integrals of the products of all pairs of functions, cells × functions × functions."""
        return np.asarray((self.weight * functions) @ functions.transpose(0, 2, 1))

    def _assembled(self, blocks: Vector) -> sparse.csr_array:
        matrix = sum_of_cells(self.basis.element_dofs.T, blocks, self.basis.N)
        matrix.eliminate_zeros()
        return matrix
