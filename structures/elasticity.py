"""Linear elasticity of solids: mass and stiffness, absorbing faces, foundations, and the patch that is pushed.

Everything works on a scikit-fem basis of a vector element in three dimensions, or in the half-plane (r, z) of a body
of revolution. There every integral carries the weight 2π r, and the hoop strain u_r/r joins the others.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import pi, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import BilinearForm, LinearForm
from skfem.helpers import ddot, div, dot, sym_grad

from structures.checks import positive
from structures.material import Material
from structures.structure import Vector

Owner = NDArray[np.int64]


@dataclass(frozen=True)
class Foundation:
    """Elastic ground under a base: its pressure is stiffness times the sinking (Winkler); it does not hold sideways.

    stiffness per area, N/m³.
    """

    stiffness: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", positive("stiffness", self.stiffness, "N/m³"))


def shear_modulus(material: Material) -> float:
    """μ = E / 2(1 + ν), Pa."""
    return material.youngs_modulus / (2.0 * (1.0 + material.poisson_ratio))


def first_lame_parameter(material: Material) -> float:
    """λ = 2 μ ν / (1 − 2ν), Pa."""
    return 2.0 * shear_modulus(material) * material.poisson_ratio / (1.0 - 2.0 * material.poisson_ratio)


def pressure_speed(material: Material) -> float:
    """Speed c_p = √((λ + 2μ)/ρ) of pressure waves in a large body, m/s."""
    return sqrt((first_lame_parameter(material) + 2.0 * shear_modulus(material)) / material.density)


def shear_speed(material: Material) -> float:
    """Speed c_s = √(μ/ρ) of shear waves, m/s."""
    return sqrt(shear_modulus(material) / material.density)


def patch_compliance(material: Material, radius: float) -> float:
    """Mean displacement, m/N, of a circle (radius in m) of a half-space under an even pressure of 1 N in all.

    16 (1 − ν²)/(3 π² E a): the mean of Love's solution (Johnson, Contact Mechanics, section 3.4).
    """
    return 16.0 / (3.0 * pi**2 * material.contact_modulus * radius)


def body_matrices(basis: Any, materials: Sequence[Material], owner: Owner) -> tuple[sparse.csr_array, sparse.csr_array]:
    """Consistent mass and stiffness, n × n each; owner: for each cell, which of the materials it is made of.

    A mesh in the plane is that of a body of revolution, whose axis is x₀ = 0.
    """
    density = _spread(basis, owner, [material.density for material in materials])
    return sparse.csr_array(_product.assemble(basis, factor=density)), _stiffness(basis, materials, owner)


def part_stiffnesses(basis: Any, materials: Sequence[Material], owner: Owner) -> list[sparse.csr_array]:
    """What the cells of each material add to the stiffness, n × n each; see `body_matrices`."""
    return [_stiffness(basis, materials, owner, owner == number) for number in range(len(materials))]


def _stiffness(basis: Any, materials: Sequence[Material], owner: Owner, counted: Any = True) -> sparse.csr_array:
    """Stiffness of the cells that are counted."""
    lame = _spread(basis, owner, [first_lame_parameter(material) for material in materials])
    shear = _spread(basis, owner, [shear_modulus(material) for material in materials])
    there = np.broadcast_to(counted, owner.shape)[:, None]
    form = _ring_strain if basis.mesh.dim() == 2 else _strain
    matrix = sparse.csr_array(form.assemble(basis, lame=lame * there, shear=shear * there))
    matrix.eliminate_zeros()
    return matrix


def absorbing_faces(
    faces: Any,
    materials: Sequence[Material],
    owner: Owner,
    normal_speed: Callable[[Material], float] = pressure_speed,
) -> sparse.csr_array:
    """Damping of Lysmer's dashpots, n × n: tractions of ρ c_p times the rate along the normal, ρ c_s times that across.

    faces: a facet basis; owner: for each facet, which material lies behind it; normal_speed: what stands for c_p.
    Waves that meet the face squarely leave without an echo, slanting ones leave a little (Lysmer and Kuhlemeyer,
    J. Eng. Mech. Div. 95 (1969) 859).
    """
    normal = _spread(faces, owner, [material.density * normal_speed(material) for material in materials])
    across = _spread(faces, owner, [material.density * shear_speed(material) for material in materials])
    damping = _product.assemble(faces, factor=across) + _normal_product.assemble(faces, factor=normal - across)
    return sparse.csr_array(damping)


def foundation_springs(faces: Any, foundation: Foundation) -> sparse.csr_array:
    """Stiffness of an elastic foundation under the facets, n × n."""
    return sparse.csr_array(_normal_product.assemble(faces, factor=foundation.stiffness * np.ones_like(faces.dx)))


def patch_vector(faces: Any) -> Vector:
    """n numbers that spread a unit force evenly over the facets, into the body, and read their mean displacement."""
    area = float((faces.dx * _circumference(faces.global_coordinates())).sum())
    return np.asarray(_inward.assemble(faces)) / area


def _spread(basis: Any, owner: Owner, values: Sequence[float]) -> Vector:
    """The value of each cell's or facet's material at all its integration points."""
    spread: Vector = np.asarray(values, dtype=float)[owner, None] * np.ones_like(basis.dx)
    return spread


def _circumference(x: Any) -> Any:
    """What an integral over the mesh lacks of one over the body: 2π r in the half-plane of a body of revolution."""
    return 2.0 * pi * x[0] if x.shape[0] == 2 else np.ones_like(x[0])


@BilinearForm
def _product(u: Any, v: Any, w: Any) -> Any:
    return w.factor * dot(u, v) * _circumference(w.x)


@BilinearForm
def _normal_product(u: Any, v: Any, w: Any) -> Any:
    return w.factor * dot(u, w.n) * dot(v, w.n) * _circumference(w.x)


@LinearForm
def _inward(v: Any, w: Any) -> Any:
    return -dot(v, w.n) * _circumference(w.x)


@BilinearForm
def _strain(u: Any, v: Any, w: Any) -> Any:
    return w.lame * div(u) * div(v) + 2.0 * w.shear * ddot(sym_grad(u), sym_grad(v))


@BilinearForm
def _ring_strain(u: Any, v: Any, w: Any) -> Any:
    hoop_u, hoop_v = u[0] / w.x[0], v[0] / w.x[0]
    volumes = w.lame * (div(u) + hoop_u) * (div(v) + hoop_v)
    shapes = 2.0 * w.shear * (ddot(sym_grad(u), sym_grad(v)) + hoop_u * hoop_v)
    return (volumes + shapes) * _circumference(w.x)
