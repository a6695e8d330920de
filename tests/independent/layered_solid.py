"""A free rectangular plate of plies as a solid in three dimensions: quadratic hexahedra and the elasticity of each ply.

It shares with plates/ only the data of a Laminate.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import eigsh
from skfem import Basis, ElementHex2, ElementVector, FacetBasis, LinearForm, MeshHex

import hertzlink as hl

VOIGT = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)]
Array = NDArray[np.float64]


def elasticity(ply: hl.Ply) -> Array:
    """Strain energy constants of a ply in the plate's axes, 6 × 6: the inverse of Hooke's law, rotated as a tensor."""
    one = ply.material
    if isinstance(one, hl.Material):
        along = across = one.youngs_modulus
        ratio = around = one.poisson_ratio
        shears = [along / 2.0 / (1.0 + ratio)] * 3
    else:
        along, across, ratio = one.youngs_modulus_along, one.youngs_modulus_across, one.poisson_ratio
        shears = [one.shear_modulus_across, one.shear_modulus_along, one.shear_modulus]
        around = across / 2.0 / shears[0] - 1.0
    compliance = np.diag([1.0 / along, 1.0 / across, 1.0 / across, *(1.0 / np.array(shears))])
    compliance[0, 1:3] = compliance[1:3, 0] = -ratio / along
    compliance[1, 2] = compliance[2, 1] = -around / across
    c, s = np.cos(ply.angle), np.sin(ply.angle)
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    tensor, stiff = np.zeros((3, 3, 3, 3)), np.linalg.inv(compliance)
    for p, (i, j) in enumerate(VOIGT):
        for q, (k, m) in enumerate(VOIGT):
            tensor[i, j, k, m] = tensor[j, i, k, m] = tensor[i, j, m, k] = tensor[j, i, m, k] = stiff[p, q]
    tensor = np.einsum("ai,bj,ck,dl,ijkl->abcd", turn, turn, turn, turn, tensor)
    return np.array([[tensor[i, j, k, m] for k, m in VOIGT] for i, j in VOIGT])


def matrices(x: Array, y: Array, plies: Any, parts: list[int]) -> tuple[Any, Any, Any]:
    """Basis, M and K; z points away from the striker, and ply i has parts[i] cells through its thickness."""
    owner = np.repeat(np.arange(len(plies)), parts)
    z = np.concatenate([[0.0], np.cumsum([plies[i].thickness / parts[i] for i in owner])])
    mesh = MeshHex.init_tensor(x, y, z)
    basis = Basis(mesh, ElementVector(ElementHex2()), intorder=4)
    layer = owner[np.searchsorted(z, mesh.p[2][mesh.t].mean(axis=0)) - 1]
    functions = [function[0] for function in basis.basis[::3]]
    values = np.stack([np.asarray(one)[0] for one in functions], axis=1)
    slopes = np.stack([one.grad[0] for one in functions]).transpose(2, 0, 1, 3)  # cells × functions × along × points
    strains = np.zeros((mesh.nelements, 6, 3 * values.shape[1], values.shape[2]))
    for p, (i, j) in enumerate(VOIGT):
        strains[:, p, i::3] = slopes[:, :, j]
        strains[:, p, j::3] = slopes[:, :, i]
    stiff = np.array([elasticity(ply) for ply in plies])[layer]
    heavy = basis.dx * np.array([ply.material.density for ply in plies])[layer][:, None]
    stiffness = np.einsum("cpaq,cpr,crbq,cq->cab", strains, stiff, strains, basis.dx, optimize=True)
    mass = np.zeros_like(stiffness)
    for i in range(3):
        mass[:, i::3, i::3] = np.einsum("caq,cbq,cq->cab", values, values, heavy, optimize=True)
    rows = np.broadcast_to(basis.element_dofs.T[:, :, None], stiffness.shape).ravel()
    columns = np.broadcast_to(basis.element_dofs.T[:, None], stiffness.shape).ravel()
    return basis, *(sparse.csr_array((e.ravel(), (rows, columns)), shape=(basis.N,) * 2) for e in (mass, stiffness))


def frequencies(length: float, width: float, plies: Any, parts: list[int], count: int = 3) -> Array:
    """The lowest frequencies of the free plate, Hz."""
    _, mass, stiffness = matrices(np.linspace(0.0, length, 15), np.linspace(0.0, width, 13), plies, parts)
    square = eigsh(
        sparse.csc_matrix(stiffness), count + 6, sparse.csc_matrix(mass), sigma=-1e6, return_eigenvectors=False
    )
    return np.asarray(np.sqrt(np.sort(np.abs(square))[6:]) / 2.0 / np.pi)


def struck(length: float, width: float, laminate: hl.Laminate, parts: list[int], radius: float) -> hl.Structure:
    """The plate struck in its middle, on a quarter of it, with the pressure 2 (1 − r²/a²)/πa² on a patch."""

    def graded(half: float) -> Array:
        ends, size = [0.0], radius / 2.0
        while ends[-1] < half:
            ends.append(ends[-1] + min(size, 10e-3))
            size *= 1.4 if ends[-1] > 1.5 * radius else 1.0
        return np.array(ends) * half / ends[-1]

    basis, mass, stiffness = matrices(graded(length / 2.0), graded(width / 2.0), laminate.plies, parts)
    top = basis.mesh.facets_satisfying(lambda x: np.isclose(x[2], 0.0), boundaries_only=True)

    @LinearForm
    def pressure(v: Any, w: Any) -> Any:
        return v[2] * np.maximum(0.0, 1.0 - (w.x[0] ** 2 + w.x[1] ** 2) / radius**2)

    load = pressure.assemble(FacetBasis(basis.mesh, ElementVector(ElementHex2()), facets=top, intorder=12))
    component = np.zeros(basis.N, dtype=int)
    for k in range(3):
        component[np.unique(basis.element_dofs[k::3])] = k
    places = basis.doflocs
    free = ~((np.isclose(places[0], 0.0) & (component == 0)) | (np.isclose(places[1], 0.0) & (component == 1)))
    load = load[free] / load.sum()
    surface = laminate.struck
    half_space = 2048.0 / (315.0 * np.pi**2 * surface.contact_modulus * radius)
    whole = [sparse.csr_array(4.0 * one[free][:, free]) for one in (mass, stiffness)]
    return hl.Structure(*whole, None, load, -half_space, hl.Surface(surface))
