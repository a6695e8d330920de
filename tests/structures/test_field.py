"""Fields of solids: uniform stress, patch tests, interfaces, VTK's order, reduced ones, 3-D compared with
axisymmetric.
"""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import simpson
from scipy.interpolate import LinearNDInterpolator
from skfem import Basis, ElementHex2, ElementQuad2, ElementTetP2, ElementVector, MeshHex, MeshQuad, MeshTet

import hertzlink as hl
from structures.bodies.elastic_field import ElasticSampler
from structures.bodies.elasticity import first_lame_parameter, shear_modulus
from structures.field import Field, von_mises
from structures.linear_algebra.factor import factorise
from structures.structure import known_field

MESH = Path(__file__).parent / "data" / "cylinder.msh"
LAYER = hl.Layer(hl.STEEL_440C, 50.8e-3, 9.53e-3)
STRUCK = (0.0, 0.0, LAYER.length)
FORCE = 100.0
SIDE = 0.02
STEPS = np.linspace(0.0, SIDE, 4)
MESHES: dict[str, tuple[Any, Any, Any, tuple[int, ...]]] = {
    "quad9": (lambda: MeshQuad.init_tensor(STEPS, STEPS), ElementQuad2, "vtkBiQuadraticQuad", (1, 3)),
    "tetra10": (lambda: MeshTet.init_tensor(STEPS, STEPS, STEPS), ElementTetP2, "vtkQuadraticTetra", (1, 2, 3)),
    "hexahedron27": (
        lambda: MeshHex.init_tensor(STEPS, STEPS, STEPS), ElementHex2, "vtkTriQuadraticHexahedron", (1, 3, 4),
    ),
}  # fmt: skip
"""By meshio's type: a mesh, its element, VTK's cell, and the corners next to the first."""

Array = NDArray[np.float64]


def pressed(structure: hl.Structure) -> Array:
    """The degrees of freedom at rest under FORCE on the contact."""
    return FORCE * factorise(structure.stiffness)(structure.contact)


def block(kind: str, bent: float = 0.0) -> tuple[Field, Basis]:
    """A free cube, or square of a body of revolution, of acrylic, with inner points moved; its field and basis."""
    make, element, *_ = MESHES[kind]
    mesh = make()
    places = mesh.p.copy()
    inner = ((places > 1e-9) & (places < SIDE - 1e-9)).all(axis=0)
    places[:, inner] += bent * STEPS[1] * np.random.default_rng(0).uniform(-1.0, 1.0, places[:, inner].shape)
    mesh = type(mesh)(places, mesh.t)
    basis = Basis(mesh, ElementVector(element()))
    owner = np.zeros(mesh.nelements, dtype=np.int64)
    make_sampler = partial(ElasticSampler, mesh, element, 5, np.arange(basis.N), [hl.ACRYLIC], owner)
    return Field(make_sampler, int(basis.N)), basis


def grid_of(field: Field) -> Any:
    import pyvista  # with VTK, here, as each process that collects tests would take half a second

    kinds = {"quad9": 28, "tetra10": 24, "hexahedron27": 29}
    grid = field.grid
    return pyvista.UnstructuredGrid({kinds[grid.kind]: grid.cells}, grid.points)


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron27"])
def test_even_strain_has_its_stress_everywhere(kind: str) -> None:
    """Patch test: σ = λ tr ε + 2μ ε to rounding, in VTK's order; a rotation, the gradient's other half, has none."""
    field, basis = block(kind, bent=0.15)
    gradient = 1e-4 * np.array([[1.0, 0.3, -0.2], [0.1, -0.5, 0.4], [0.6, 0.2, 0.7]])
    u = (gradient @ basis.doflocs)[np.arange(basis.N) % 3, np.arange(basis.N)]
    strain = (gradient + gradient.T) / 2.0
    stress = first_lame_parameter(hl.ACRYLIC) * np.trace(strain) * np.eye(3) + 2.0 * shear_modulus(hl.ACRYLIC) * strain
    expected = stress[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    assert abs(field.stress(u) - expected).max() < 1e-10 * abs(expected).max()
    assert field.displacement(u) == pytest.approx(field.grid.points @ gradient.T, abs=1e-15)
    spin = (gradient - gradient.T) / 2.0
    turned = (spin @ basis.doflocs)[np.arange(basis.N) % 3, np.arange(basis.N)]
    assert abs(field.stress(turned)).max() < 1e-9 * abs(expected).max()


def test_even_strain_of_a_body_of_revolution() -> None:
    """u = (a r, b z + c r): the hoop strain is a as the radial one, and z points out of the body in space."""
    field, basis = block("quad9", bent=0.2)
    r, z = basis.doflocs
    wide, long, shear = 2e-4, -3e-4, 1e-4
    u = np.where(np.arange(basis.N) % 2 == 0, wide * r, long * z + shear * r)
    lame, stiff = first_lame_parameter(hl.ACRYLIC), shear_modulus(hl.ACRYLIC)
    volume = lame * (2.0 * wide + long)
    expected = [volume + 2.0 * stiff * wide] * 2 + [volume + 2.0 * stiff * long, 0.0, 0.0, -stiff * shear]
    assert abs(field.stress(u) - expected).max() < 1e-10 * max(map(abs, expected))
    x, y, height = field.grid.points.T
    assert (y == 0.0).all()
    assert field.displacement(u) == pytest.approx(np.column_stack([wide * x, y, long * height - shear * x]), abs=1e-15)


def test_field_and_contact_tell_the_same() -> None:
    """The mean of the displacement over the patch is bᵀu, exactly: Simpson's rule on the nodes of quadratic cells."""
    body = hl.layered_cylinder([LAYER])
    field, u, patch = known_field(body), pressed(body), body.origin["patch_radius"]
    r, _, z = field.grid.points.T
    on_patch = np.flatnonzero((z == 0.0) & (r <= patch * (1.0 + 1e-9)))
    on_patch = on_patch[np.argsort(r[on_patch])]
    sinking = -field.displacement(u)[on_patch, 2]
    mean = simpson(2.0 * r[on_patch] * sinking, x=r[on_patch]) / patch**2
    assert mean == pytest.approx(body.contact @ u, rel=1e-9)


def test_stress_jumps_where_materials_meet() -> None:
    """Points at an interface appear twice: with one displacement, one axial stress, and two hoop stresses."""
    half = LAYER.length / 2.0
    body = hl.layered_cylinder([hl.Layer(hl.STEEL_440C, half, LAYER.radius), hl.Layer(hl.PTFE, half, LAYER.radius)])
    field, u = known_field(body), pressed(body)
    number = np.flatnonzero(np.isclose(field.grid.points[:, 2], -half) & (field.grid.points[:, 0] < 0.7 * LAYER.radius))
    order = number[np.argsort(field.grid.points[number, 0], kind="stable")].reshape(-1, 2)
    moved, stress = field.displacement(u)[order], field.stress(u)[order]
    assert (moved[:, 0] == moved[:, 1]).all()
    assert stress[:, 0, 2] == pytest.approx(stress[:, 1, 2], rel=0.1)
    assert (abs(stress[:, 0, 1] - stress[:, 1, 1]) > 0.3 * abs(stress[:, 0, 2])).all()
    assert set(field.grid.part) == {0, 1}


@pytest.mark.parametrize("kind", MESHES)
def test_points_of_cells_stand_in_vtks_order(kind: str) -> None:
    """Each stands where VTK has it in its reference cell, and the cells fill the body."""
    import vtk

    field, _ = block(kind)
    grid, cell = field.grid, getattr(vtk, MESHES[kind][2])()
    assert grid.kind == kind
    reference = np.reshape(cell.GetParametricCoords(), (-1, 3))[:, : len(MESHES[kind][3])]
    at = grid.points[grid.cells]
    edges = at[:, list(MESHES[kind][3])] - at[:, :1]
    assert at == pytest.approx(at[:, :1] + np.einsum("nk,cki->cni", reference, edges), abs=1e-12)
    sizes = grid_of(field).compute_cell_sizes()["Area" if kind == "quad9" else "Volume"]
    assert (sizes > 0.0).all()
    assert sizes.sum() == pytest.approx(SIDE ** (2 if kind == "quad9" else 3))


@pytest.mark.thorough
def test_solid_has_the_fields_of_the_axisymmetric_cylinder() -> None:
    """Away from the patches, which differ: displacement to 1 % of the greatest there, stress to 6 %, mostly to 1 %."""
    bodies = hl.solid(MESH, hl.STEEL_440C, STRUCK, fixed="base"), hl.layered_cylinder([LAYER])
    fields, moved = [known_field(body) for body in bodies], [pressed(body) for body in bodies]
    x, y, z = fields[0].grid.points.T
    place = np.column_stack([np.hypot(x, y), z - LAYER.length])
    chosen = (place[:, 1] < -12e-3) & (place[:, 1] > -45e-3) & (place[:, 0] < 0.99 * LAYER.radius)
    assert chosen.sum() > 300
    sinking = [field.displacement(u)[..., 2] for field, u in zip(fields, moved, strict=True)]
    stress = [von_mises(field.stress(u)) for field, u in zip(fields, moved, strict=True)]
    for (found, known), tolerance in ((sinking, 0.01), (stress, 0.06)):
        expected = LinearNDInterpolator(fields[1].grid.points[:, ::2], known)(place[chosen])
        error = abs(found[chosen] - expected) / abs(expected).max()
        assert error.max() < tolerance
        assert np.median(error) < 0.01


def test_reduced_fields_are_those_of_the_full_structure() -> None:
    """Static ones; reducing again, Maxwell arms and keeping the field change nothing."""
    full = hl.layered_cylinder([LAYER])
    once = hl.reduce(full, until=5e-4, tolerance=1e-4, keep_field=True)
    plain = hl.reduce(full, until=5e-4, tolerance=1e-4)
    assert plain.field is None
    assert (plain.contact == once.contact).all()
    assert abs(plain.stiffness - once.stiffness).max() == 0.0
    twice = hl.reduce(once, until=4e-4, largest=once.size, tolerance=1e-9, keep_field=True)
    expected = von_mises(known_field(full).stress(pressed(full)))
    for reduced in (once, twice):
        assert abs(von_mises(known_field(reduced).stress(pressed(reduced))) - expected).max() < 1e-3 * expected.max()
    armed = hl.damping.damped(once, hl.damping.StandardLinearSolid(0.2, 1e-5))
    assert armed.size > once.size
    assert abs(von_mises(known_field(armed).stress(pressed(armed))) - expected).max() < 1e-3 * expected.max()
    again = hl.reduce(
        hl.damping.damped(full, hl.damping.StandardLinearSolid(0.2, 1e-5)), until=5e-4, tolerance=1e-4, keep_field=True
    )
    assert known_field(again).size < again.size
    assert abs(von_mises(known_field(again).stress(pressed(again))) - expected).max() < 1e-3 * expected.max()


def test_where_there_is_no_field() -> None:
    for structure, message in (
        (hl.rod([LAYER]), "this rod has no field; cylinders, solids and plates"),
        (hl.half_space(hl.PTFE), "this half-space has no field"),
        (hl.infinite_plate(2e-3, hl.PTFE), "this infinite plate has no field"),
    ):
        with pytest.raises(ValueError, match=message):
            known_field(structure)
        with pytest.raises(ValueError, match=message):
            hl.reduce(structure, until=1e-4, keep_field=True)
    with pytest.raises(ValueError, match=r"this cylinder lost its field in the reduction; .*keep_field=True"):
        known_field(hl.reduce(hl.layered_cylinder([LAYER]), until=1e-4))
    with pytest.raises(ValueError, match=r"structure = 'rod': must be a Structure"):
        known_field("rod")  # type: ignore[arg-type]


def test_degrees_of_freedom_that_do_not_fit() -> None:
    body = hl.layered_cylinder([LAYER])
    with pytest.raises(ValueError, match=rf"u has shape \(3,\): must be \({body.size},\)"):
        known_field(body).displacement(np.zeros(3))
