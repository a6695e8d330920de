"""Axisymmetric cylinders: bars and half-spaces in statics, published frequencies, rods, patches, bad input."""

from itertools import pairwise
from math import pi

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.sparse.linalg import eigsh
from scipy.special import jnp_zeros
from skfem import Basis, BilinearForm, ElementTriP4, ElementVector, FacetBasis, LinearForm, MeshTri, condense, solve
from skfem.helpers import ddot, sym_grad, trace

import hertzlink as hl
from structures.bodies.cylinder import layered_cylinder as cylinder
from structures.bodies.elasticity import patch_compliance, shear_modulus, shear_speed
from structures.linear_algebra.factor import factorise

STEEL = hl.Layer(hl.STEEL_440C, length=76.2e-3, radius=19.1e-3)
PTFE = hl.Layer(hl.PTFE, length=76.2e-3, radius=19.1e-3)
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)


def compliance(structure: hl.Structure) -> float:
    """Static displacement of the contact per newton, without `flexibility`, m/N."""
    return float(structure.contact @ factorise(structure.stiffness)(structure.contact))


def frequencies(structure: hl.Structure, about: float, count: int) -> NDArray[np.float64]:
    """The `count` natural frequencies nearest to `about`, Hz, ascending."""
    shift = (2.0 * pi * about) ** 2
    square = eigsh(structure.stiffness, count, structure.mass, sigma=shift, return_eigenvectors=False)
    return np.sort(np.sqrt(np.abs(square))) / (2.0 * pi)


def test_free_cylinder_moves_along_its_axis_without_cost() -> None:
    """One mode of no energy, and its generalised mass 1/(bᵀφ)² is ρ π R² L."""
    layers = [hl.Layer(hl.STEEL_440C, 0.03, 0.02), hl.Layer(hl.MATERIALS["nylon"], 0.02, 0.02)]
    free = cylinder(layers, base="free", cells=2)
    square, modes = eigsh(free.stiffness, 2, free.mass, sigma=-1e6)
    order = np.argsort(square)
    mass = sum(layer.material.density * layer.area * layer.length for layer in layers)
    assert abs(square[order[0]]) < 1e-9 * square[order[1]]
    assert (free.contact @ modes[:, order[0]]) ** -2 == pytest.approx(mass, rel=1e-9)


@pytest.mark.parametrize(("poisson_ratio", "tolerance"), [(0.28, 5e-4), (0.46, 1e-3)])
def test_patch_indents_a_large_cylinder_as_it_does_a_half_space(poisson_ratio: float, tolerance: float) -> None:
    """Beyond 16 (1 − ν²)/(3 π² E a) there is only a part by the cylinder's size, whatever the patch is."""
    large = hl.Layer(hl.Material(200e9, poisson_ratio, 7800.0), 0.1, 0.1)
    beyond = []
    for patch in (0.25e-3, 0.5e-3, 1e-3):
        structure = cylinder([large], patch_radius=patch)
        assert -structure.flexibility == patch_compliance(large.material, patch)
        beyond.append((compliance(structure) + structure.flexibility) / patch_compliance(large.material, 0.25e-3))
    assert beyond == pytest.approx([beyond[-1]] * 3, abs=tolerance)
    assert abs(beyond[-1]) < 3e-3


def test_patch_compliance_converges_with_the_mesh() -> None:
    """The order is at least two, though the pressure ends abruptly at the patch's edge."""
    found = [compliance(cylinder([STEEL], patch_radius=1e-3, cells=cells)) for cells in (2, 4, 8)]
    steps = np.abs(np.diff(found))
    assert np.log2(steps[0] / steps[1]) > 2.0
    assert steps[1] < 5e-4 * found[-1]


@BilinearForm
def elastic_energy(u, v, w):  # type: ignore[no-untyped-def]
    """The energy of a body of revolution with Lamé's parameters w.lame and w.shear."""
    r = w.x[0]
    strain, virtual, hoop = sym_grad(u), sym_grad(v), u[0] * v[0] / r**2
    sums = (trace(strain) + u[0] / r) * (trace(virtual) + v[0] / r)
    return 2.0 * pi * r * (2.0 * w.shear * (ddot(strain, virtual) + hoop) + w.lame * sums)


@LinearForm
def pushed(v, w):  # type: ignore[no-untyped-def]
    return 2.0 * pi * w.x[0] * v[1]


def compliance_of_triangles(layers: list[hl.Layer], patch: float) -> float:
    """Compliance with a fixed base, m/N: elements of degree 4, halved eight times about each singular point."""
    radius, faces = layers[0].radius, np.cumsum([0.0, *(layer.length for layer in layers)])
    across = [*np.linspace(0.0, patch, 5), *np.geomspace(patch, radius, 12)[1:]]
    down = np.unique(np.concatenate([np.linspace(*ends, 7) for ends in pairwise(faces)]))
    mesh = MeshTri.init_tensor(np.array(across), down)
    for _ in range(8):
        corners = [
            np.hypot(mesh.p[0] - r, mesh.p[1] - z) < 1e-9 for r, z in [(patch, 0.0), *((radius, z) for z in faces)]
        ]
        mesh = mesh.refined(np.flatnonzero(np.any(corners, axis=0)[mesh.t].any(axis=0)))
    element = ElementVector(ElementTriP4())
    basis = Basis(mesh, element, intorder=7)
    owner = np.searchsorted(faces[1:-1], mesh.p[1, mesh.t].mean(axis=0))
    shear = np.array([shear_modulus(layer.material) for layer in layers])[owner][:, None] + 0.0 * basis.dx
    ratio = np.array([layer.material.poisson_ratio for layer in layers])[owner][:, None]
    stiffness = elastic_energy.assemble(basis, shear=shear, lame=2.0 * shear * ratio / (1.0 - 2.0 * ratio))
    struck = mesh.facets_satisfying(lambda x: (x[1] < 1e-9) & (x[0] < patch))
    force = pushed.assemble(FacetBasis(mesh, element, facets=struck, intorder=7)) / (pi * patch**2)
    axis, base = basis.get_dofs(lambda x: x[0] < 1e-9), basis.get_dofs(lambda x: x[1] > faces[-1] - 1e-9)
    return float(force @ solve(*condense(stiffness, force, D=np.union1d(axis.all(["u^1"]), base.all()))))


@pytest.mark.parametrize("length", [4e-3, 10e-3])
def test_a_short_soft_layer_against_other_elements(length: float) -> None:
    """Steel on PTFE: without finer cells at the bonded corners the default is 3.6 and 2.2 % too stiff."""
    layers = [hl.Layer(hl.STEEL_440C, 6e-3, 9e-3), hl.Layer(hl.PTFE, length, 9e-3)]
    default = cylinder(layers)
    exact = compliance_of_triangles(layers, default.origin["patch_radius"])
    assert compliance(default) + default.flexibility == pytest.approx(exact + default.flexibility, rel=2.5e-3)


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.28, 0.46])
def test_free_cylinder_has_its_exact_equivoluminal_mode(poisson_ratio: float) -> None:
    """u_r = J₁(kr) cos kz, u_z = −J₀(kr) sin kz with kR = 1.8412 and L = π/k leaves all faces free: ω = √2 c_s k.

    By hand: there is no shear stress anywhere, σ_zz ∝ cos kz vanishes at z = ±L/2, and σ_rr ∝ J₁′(kR) on the side.
    (Lamé's mode; it solves Pochhammer's equation at the phase velocity √2 c_s.) Its error falls with h⁴.
    """
    material = hl.Material(200e9, poisson_ratio, 7800.0)
    number = jnp_zeros(1, 1)[0] / 0.02
    exact = 2.0**0.5 * shear_speed(material) * number / (2.0 * pi)
    layer, errors = hl.Layer(material, pi / number, 0.02), []
    for cells in (4, 8):
        free = cylinder([layer], base="free", highest_frequency=exact, cells=cells)
        errors.append(frequencies(free, exact, 1)[0] / exact - 1.0)
    assert 0.0 < errors[1] < 2e-5
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


def test_slender_cylinder_is_a_rod() -> None:
    """Free ends: f = n c/2L · [1 − (nπνR/2L)²], Rayleigh's correction for lateral inertia, as R/L vanishes."""
    material, length = hl.STEEL_440C, 0.2
    for slenderness in (0.1, 0.05, 0.025):
        layer = hl.Layer(material, length, slenderness * length)
        unit = material.bar_speed / (2.0 * length)
        found = frequencies(cylinder([layer], base="free"), unit, 1)[0] / unit
        correction = (pi * material.poisson_ratio * slenderness / 2.0) ** 2
        assert 1.0 - found == pytest.approx(correction, rel=0.05)


def chain() -> hl.Chain:
    return hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=hl.drop_speed(0.01), gravity=9.81)


def ratios(structure: hl.Structure, until: float = 1.5e-3) -> list[float]:
    """Amplitude ratios at bead 7 of the primary wave, and of the secondary one; the run keeps its energy."""
    run = hl.CoSimulation(chain(), structure).run(until)
    assert float(hl.energy_error(run)) < 1e-5
    waves = hl.reflections(run, sensor=7)
    assert waves.primary
    assert waves.secondary
    return [waves.primary.amplitude_ratio, waves.secondary.amplitude_ratio]


def reduced(layer: hl.Layer, **keywords: object) -> hl.Structure:
    return hl.reduce(cylinder([layer], **keywords), until=1.5e-3)  # type: ignore[arg-type]


@pytest.mark.thorough
@pytest.mark.parametrize("layer", [STEEL, PTFE], ids=["steel", "PTFE"])
def test_amplitude_ratio_does_not_know_patch_nor_mesh(layer: hl.Layer) -> None:
    """Patch and cells halved and doubled: within 0.1 % for the primary wave, 0.3 % for the secondary."""
    patch = cylinder([layer]).origin["patch_radius"]
    found = ratios(reduced(layer))
    for keywords in ({"patch_radius": patch / 2.0}, {"patch_radius": patch * 2.0}, {"cells": 2}, {"cells": 8}):
        other = ratios(reduced(layer, **keywords))
        assert other[0] == pytest.approx(found[0], rel=1e-3)
        assert other[1] == pytest.approx(found[1], rel=3e-3)


def test_patch_smaller_than_the_contact_is_refused() -> None:
    small = reduced(PTFE, patch_radius=2e-4)
    with pytest.raises(ValueError, match=r"give the structure a patch_radius at least \d\.\d+ times as large") as error:
        hl.CoSimulation(chain(), small)
    factor = float(str(error.value).split("at least ")[1].split()[0])
    hl.CoSimulation(chain(), reduced(PTFE, patch_radius=factor * 2e-4))  # the cure is not rounded down
