"""The study of symmetry: a chain in two and in three dimensions, and beads of which a part stands for the whole."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import xarray as xr
from printed import check
from skfem import Basis, ElementTetP2, ElementVector, MeshHex, MeshTet, MeshTet2

import hertzlink as hl
from hertzlink.studies import symmetry as study
from particles.deformable.deformable_chain import DeformableChain, MovingDeformableChain
from particles.deformable.vibration import Vibration, vibration
from particles.laws.axisymmetric import contact_law_fem
from particles.laws.solid_mesh import CORNER, _placed
from structures.bodies.elasticity import body_matrices
from structures.linear_algebra.factor import factorise

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True)


@pytest.mark.thorough
def test_both_chains_show_the_same_wave(quick: xr.Dataset) -> None:
    """572.5 m/s by an independent program, as converged (errata); three dimensions agree to 0.5 %."""
    flat, solid = quick.sel(model=study.AXISYMMETRIC), quick.sel(model=study.SOLID)
    assert flat.wave_speed.item() == pytest.approx(572.5, rel=3e-3)
    assert solid.wave_speed.item() == pytest.approx(flat.wave_speed.item(), rel=5e-3)
    assert solid.amplitude.values == pytest.approx(flat.amplitude.values, rel=1e-2)
    assert (solid.arrival - flat.arrival).values == pytest.approx(0.0, abs=1e-6)
    mixed = quick.sel(model=study.MIXED)
    assert mixed.wave_speed.item() == pytest.approx(flat.wave_speed.item(), rel=1e-5)
    assert (quick.energy_error < 1e-5).all()


@pytest.mark.thorough
def test_the_wall_sends_nearly_all_back(quick: xr.Dataset) -> None:
    """It is rigid; bead 16 meets the echo first."""
    ratio = quick.amplitude.sel(wave="echo") / quick.amplitude.sel(wave="incident")
    assert ((ratio > 0.97) & (ratio < 1.0)).all()
    assert (quick.arrival.sel(wave="echo", sensor=16) < quick.arrival.sel(wave="echo", sensor=7)).all()


@pytest.mark.thorough
def test_laws_and_modes_agree(quick: xr.Dataset) -> None:
    """Within what the tetrahedra's own error leaves; modes of finite elements lie above the true ones."""
    flat, solid = quick.sel(model=study.AXISYMMETRIC), quick.sel(model=study.SOLID)
    assert (solid.law / flat.law).values == pytest.approx(1.0, abs=0.02)
    higher = (solid.frequency / flat.frequency).values
    assert np.all((higher > 1.0) & (higher < 1.02))


@pytest.mark.thorough
def test_table_and_figure(quick: xr.Dataset) -> None:
    rows = study.table(quick)
    check("symmetry", rows)
    assert all(row.reason for row in rows)
    (figure,) = study.figures(quick).values()
    assert [axis.get_title() for axis in figure.axes] == ["axisymmetric", "three-dimensional"]
    assert "at bead 16" in [entry.get_text() for entry in figure.axes[0].get_legend().get_texts()]


@pytest.mark.thorough
def test_a_rigid_wall_is_half_a_contact() -> None:
    """The law of a bead on the wall, by symmetry, and by finite elements of the bead and of the wall."""
    law = study.Model(contact_law_fem(study.BEAD, max_approach=2e-6), vibration).between(
        study.BEAD,
        study.WALL.surface,  # type: ignore[arg-type]
    )
    computed = contact_law_fem(study.BEAD, study.WALL.surface, max_approach=1e-6)
    approaches = np.geomspace(0.05e-6, 1e-6, 9)
    assert law.force(approaches) == pytest.approx(computed.force(approaches), rel=2e-3)


@pytest.mark.thorough
def test_a_chain_takes_the_modes_that_it_is_given() -> None:
    """And asks for those of each kind of bead once."""
    asked: list[Any] = []

    def stiffer(bead: hl.Sphere, modes: int) -> Vibration:
        asked.append((bead, modes))
        own = vibration(bead, modes)
        return replace(own, frequencies=2.0 * own.frequencies)

    beads = [study.BEAD, hl.Sphere(3e-3, hl.STEEL_316), study.BEAD]
    chain = DeformableChain(beads, study.BEAD, 0.5, modes=4, vibrations=stiffer)
    shapes = MovingDeformableChain(chain, None).shapes
    assert asked == [(study.BEAD, 3), (beads[1], 3)]
    assert shapes[0] is shapes[1] is shapes[3]
    assert shapes[0].frequencies == pytest.approx(2.0 * vibration(study.BEAD, 3).frequencies)  # type: ignore[union-attr]


def test_vibrations_must_be_a_function() -> None:
    with pytest.raises(ValueError, match="vibrations = 3: must be a function"):
        DeformableChain([study.BEAD], study.BEAD, 0.5, vibrations=3)  # type: ignore[arg-type]


def squeezed(part: Any, box: np.ndarray, place: np.ndarray, symmetric: bool) -> float:
    """By what a unit force on the pole of the whole bead presses it towards the mid-plane, m/N, of a part's mesh."""
    mesh = replace(part, doflocs=place)
    basis = Basis(mesh, ElementVector(ElementTetP2()), intorder=5)
    x, y, z = (np.concatenate([basis.nodal_dofs[i], basis.edge_dofs[i]]) for i in range(3))
    stiffness = body_matrices(basis, [hl.STEEL_316], np.zeros(mesh.nelements, dtype=np.int64))[1]
    pole = np.flatnonzero((abs(box[0]) < 1e-12) & (box[1] == 0.0) & (box[2] == 0.0))
    held = x[box[0] == 0.0] if symmetric else x[pole]
    held = np.concatenate([held, y[box[1] == 0.0], z[box[2] == box[2].max()]])
    kept = np.setdiff1d(np.arange(basis.N), held)
    force = np.zeros(kept.size)
    place_of_pole = np.searchsorted(kept, z[pole])
    force[place_of_pole] = 0.25 if symmetric else 0.5
    return float(factorise(stiffness[kept][:, kept])(force)[place_of_pole].item())


def test_a_quarter_stands_for_a_half() -> None:
    """A sphere cut in two planes, and in one where it is free to move across the other: the same to rounding."""
    radius = study.BEAD.radius
    side = np.linspace(0.0, radius, 4)
    quarter = MeshHex.init_tensor(CORNER * side, -CORNER * side[::-1], side).to_meshtet()
    mirrored = MeshTet(quarter.p * np.array([[-1.0], [1.0], [1.0]]), quarter.t)
    found = []
    for flat, symmetric in ((quarter, True), (quarter + mirrored, False)):
        part = MeshTet2.from_mesh(flat)
        box = part.doflocs * np.array([[1.0], [-1.0], [1.0]])
        place = _placed(study.BEAD, np.abs(box[0]), box[1], box[2])
        place[0] *= np.sign(box[0]) + (box[0] == 0.0)
        found.append(squeezed(part, box, place, symmetric))
    assert found[1] == pytest.approx(found[0], rel=1e-10)
