"""Chains of deformable beads: the limit of rigid ones, conservation, orders, statics, convergence, bad input."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hertzlink as hl
from particles.deformable.deformable_chain import MovingDeformableChain, moving_chain
from particles.laws.axisymmetric import computed_law

STEEL, BEAD = hl.STEEL_316, hl.Sphere(2.38e-3, hl.STEEL_316)
SURFACE = hl.Surface(STEEL)


def deformable(modes: int = 8, count: int = 5, speed: float = 0.5, **more: Any) -> hl.DeformableChain:
    return hl.DeformableChain([BEAD] * count, BEAD, speed, modes=modes, **more)


def thorough(loss: Any) -> Any:
    return pytest.param(loss, marks=pytest.mark.thorough)


@pytest.fixture(scope="module")
def law() -> Any:
    return computed_law(BEAD, max_force=60.0)


STRUCTURES = {
    "nothing": lambda: None,
    "rod": lambda: hl.rod([hl.Layer(STEEL, 50e-3, 5e-3)]),
    "solid": lambda: hl.layered_cylinder([hl.Layer(STEEL, 10e-3, 8e-3)]),
}


PLAIN: dict[str, Any] = {}
LOSSY = {"gravity": 9.81, "dissipation": hl.LinearDashpot(1.0)}
PRESSED = {"preload": 2.0, "striker": "spring"}


# Chains of both classes run in the same kernels, and each kind of chain is compiled anew: a few kinds. A solid moves
# window by window.
@pytest.mark.thorough
@pytest.mark.parametrize(("structure", "more"), [
    ("nothing", PLAIN), ("nothing", LOSSY), ("nothing", PRESSED), ("rod", PRESSED), ("solid", LOSSY),
])  # fmt: skip
def test_with_one_mode_it_is_a_chain_with_that_law(law: Any, structure: str, more: dict[str, Any]) -> None:
    more = dict(more)
    striker: Any = BEAD
    if more.pop("striker", None):
        striker = hl.SpringLoaded(BEAD, 100.0, 2e-3)
    if structure == "nothing":
        more = {name: value for name, value in more.items() if name not in ("gravity", "preload")}
    speed = 0.5 if striker is BEAD else None
    rigid = hl.Chain([BEAD] * 5, striker, speed, law=law, **more)
    soft = hl.DeformableChain([BEAD] * 5, striker, speed, law=law, modes=1, **more)
    runs = [hl.CoSimulation(chain, STRUCTURES[structure]()).run(until=6e-5) for chain in (rigid, soft)]
    known = set(runs[0].data_vars)
    assert set(runs[1].data_vars) - known == {"section_force", "vibration_energy", "vibration_amplitude"}
    # A structure's contact is Hertz's in one and computed in the other.
    if structure == "nothing":
        for name in known:
            assert np.array_equal(runs[0][name], runs[1][name], equal_nan=True), name
    else:
        peak = [run.contact_force.max("time") for run in runs]
        assert peak[1].values == pytest.approx(peak[0].values, rel=0.03)


beads = st.one_of(
    st.builds(hl.Sphere, st.sampled_from([2e-3, 3e-3, 4.76e-3]), st.sampled_from([STEEL, hl.ALUMINIUM_6061, hl.PTFE])),
    st.sampled_from([hl.HollowSphere(4e-3, 2e-3, STEEL), hl.HollowSphere(5e-3, 4e-3, hl.ALUMINIUM_6061)]),
    st.just(hl.Ellipsoid(2e-3, 6e-3, STEEL, "along")),
)


@pytest.mark.thorough
@settings(max_examples=12)
@given(st.lists(beads, min_size=2, max_size=4), st.sampled_from([1, 2, 5, 9]), st.floats(0.05, 1.0))
def test_momentum_and_energy_stay(row: list[Any], modes: int, speed: float) -> None:
    chain = hl.DeformableChain(row[1:], row[0], speed, modes=modes, law=hl.contact_law)
    run = hl.CoSimulation(chain, None).run(until=2e-4)
    momentum = (run.velocity * [body.mass for body in row]).sum("bead")
    assert momentum.values == pytest.approx(float(momentum[0]), rel=1e-11)
    assert hl.energy_error(run) < 1e-5
    if modes == 1:
        assert float(abs(run.vibration_energy).max()) == 0.0


@pytest.mark.thorough
@pytest.mark.parametrize("loss", [None, hl.LinearDashpot(2.0), hl.Tsuji(0.05)])
def test_losses_take_what_is_missing(loss: Any) -> None:
    run = hl.CoSimulation(deformable(dissipation=loss), None).run(until=2e-4)
    assert hl.energy_error(run) < 2e-5
    lost = float(run.dissipated_energy[-1] / run.impact_energy)
    assert lost > 0.05 if loss else lost == 0.0
    assert np.all(np.diff(run.dissipated_energy) >= -1e-12 * float(run.impact_energy))


def advanced(chain: hl.DeformableChain, dt: float, until: float) -> Any:
    moving = moving_chain(chain, SURFACE, dt=dt)
    state, _ = moving.advance(moving.start(), (0.0, 0.0), until)
    return state.position[: moving.mass.size] - moving.rest[: moving.mass.size]


@pytest.mark.parametrize("loss", [None, thorough(hl.LinearDashpot(1.0))])
def test_verlet_has_order_two(loss: Any) -> None:
    chain = deformable(5, 3, dissipation=loss)
    finest = advanced(chain, 5e-10, 3e-5)
    errors = [abs(advanced(chain, dt, 3e-5) - finest).max() for dt in (4e-8, 2e-8, 1e-8)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.2)


@pytest.mark.thorough
@pytest.mark.parametrize("modes", [1, 2, 4, 9])
def test_even_compression_is_that_of_the_law(law: Any, modes: int) -> None:
    """For any number of modes, the mid-planes of beads pressed equally on both sides approach by the law of both."""
    chain = hl.DeformableChain([BEAD] * 4, None, preload=5.0, modes=modes, law=law)
    moving = moving_chain(chain, SURFACE)
    assert -np.diff(moving.rest[2:5]) == pytest.approx(np.full(2, law.approach(5.0)), rel=1e-9)


@pytest.mark.thorough
def test_a_chain_turned_around_moves_as_its_mirror_image() -> None:
    bodies = [BEAD, hl.Sphere(3e-3, hl.ALUMINIUM_6061), hl.HollowSphere(4e-3, 3e-3, STEEL)]
    more: dict[str, Any] = {"modes": 4, "law": hl.contact_law}
    moving = moving_chain(hl.DeformableChain(bodies[1:], bodies[0], 0.5, **more), None, dt=2e-9, impact_energy=1e-4)
    turned = moving_chain(hl.DeformableChain(bodies[1::-1], bodies[2], 0.5, **more), None, dt=2e-9, impact_energy=1e-4)
    assert isinstance(turned, MovingDeformableChain)
    there, back = moving.start(), turned.start()
    there.velocity[:3], back.velocity[:3] = [0.5, 0.0, -0.2], [0.2, 0.0, -0.5]
    for _ in range(20):
        there, _ = moving.advance(there, (0.0, 0.0), 2e-6)
        back, _ = turned.advance(back, (0.0, 0.0), 2e-6)
    assert abs(there.velocity[1]) > 0.05
    assert back.velocity[2::-1] == pytest.approx(-there.velocity[:3], abs=1e-11)
    forces = [one.poles(state.position[None])[0] for one, state in ((moving, there), (turned, back))]
    assert forces[0].shape == forces[1].shape == (1, 3)


@pytest.mark.thorough
def test_more_modes_settle() -> None:
    found = {}
    for modes in (1, 2, 4, 8, 14):
        run = hl.CoSimulation(deformable(modes, 12), None).run(until=1e-4)
        found[modes] = float(run.contact_force.sel(contact=8).max())
    assert found[8] == pytest.approx(found[14], rel=1e-3)
    assert found[4] == pytest.approx(found[14], rel=3e-3)


@pytest.mark.thorough
def test_the_central_section_carries_the_momentum_of_half_a_bead() -> None:
    """In slow motion its force is the mean of the contacts'; at any time its impulse is what half a bead gets."""
    run = hl.CoSimulation(deformable(8, 8), None).run(until=1e-4)
    mean = hl.sensor_force(run, 4)
    section = run.section_force.sel(bead=4)
    assert float(section.max()) == pytest.approx(float(mean.max()), rel=0.02)
    assert float(abs(section - mean).max()) > 1e-3 * float(mean.max())
    assert section.integrate("time").item() == pytest.approx(mean.integrate("time").item(), rel=2e-3)
    slow = hl.CoSimulation(deformable(8, 8, speed=1e-4), None).run(until=6e-4)
    difference = abs(slow.section_force.sel(bead=4) - hl.sensor_force(slow, 4)).max()
    assert float(difference / slow.section_force.sel(bead=4).max()) < 0.1 * float(
        abs(section - mean).max() / section.max()
    )


@pytest.mark.thorough
def test_chains_of_both_kinds_share_a_run(monkeypatch: pytest.MonkeyPatch) -> None:
    """Window by window; tests/coupling/test_cosimulation.py compares the compiled loop with that, which takes 20 s to
    compile for such chains."""
    monkeypatch.setattr("coupling.engine.is_compiled", lambda *_: False)
    plate = hl.kirchhoff_plate(0.1, 0.1, 5e-3, STEEL, hl.Supports("clamped", "clamped", "clamped", "clamped"))
    chains = [hl.Chain([BEAD] * 4, BEAD, 0.5), deformable(5, 3)]
    run = hl.CoSimulation(chains, plate.at([0.03, 0.07], [0.05, 0.05])).run(until=1e-5)
    assert run.vibration_amplitude.dims == ("time", "chain", "bead", "mode")
    assert np.isnan(run.section_force.isel(chain=0)).all()
    assert np.isnan(run.section_force.isel(chain=1, bead=4)).all()
    assert not np.isnan(run.section_force.isel(chain=1, bead=slice(0, 4))).any()


def test_too_fast_a_striker_is_named_and_not_its_law() -> None:
    with pytest.raises(
        ValueError, match=r"^impact_speed = 1000\.0: gives 226 J, too much for finite elements; add law="
    ) as caught:
        hl.CoSimulation(hl.DeformableChain([BEAD] * 2, BEAD, 1e3), None)
    assert "max_approach = " in str(caught.value.__cause__)
    spring = hl.SpringLoaded(BEAD, 1e9, 7e-4)
    with pytest.raises(ValueError, match=r"^chain: gives .* J, too much for finite elements"):
        hl.CoSimulation(hl.DeformableChain([BEAD] * 2, spring), None)


def test_a_law_that_is_stiffer_than_the_beads_is_named() -> None:
    stiff = hl.laws.PowerLaw(1e13)
    for law in (stiff, lambda one, other: stiff):
        with pytest.raises(ValueError, match=r"^modes = 8: must be fewer for a contact of power law"):
            hl.CoSimulation(hl.DeformableChain([BEAD] * 2, BEAD, 0.5, law=law), None).run(1e-6)


def test_too_long_a_step_is_named() -> None:
    with pytest.raises(ValueError, match=r"dt = 2e-07: must be below .* for a stable step"):
        hl.CoSimulation(deformable(10), None, dt=2e-7)
