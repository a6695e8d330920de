"""The checks that runs make: each finding is in the attribute `warnings`, and a warning at the user's line."""

import re
import warnings
from dataclasses import replace
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
import skfem
import skfem.io.meshio
import xarray as xr

import hertzlink as hl
from coupling.kernels import loop
from coupling.results.findings import findings_of
from coupling.run_checks import check_before
from particles.deformable.deformable_chain import moving_chain
from particles.moving import MovingChain
from structures.units import readable

HARD = hl.Material(200e9, 0.28, 7800.0)
"""Without a yield strength."""
BEAD = hl.Sphere(4.76e-3, HARD)
CHAIN = hl.Chain([BEAD] * 20, BEAD, 0.4)
CLAMPED = hl.Supports(left="clamped", right="clamped", bottom="clamped", top="clamped")
WALL = hl.half_space(HARD)


def found(run: xr.Dataset, kind: str) -> list[str]:
    return [line for line in findings_of(run) if line.startswith(f"{kind}: ")]


def plate(thickness: float, frequency: float = 40e3, supports: hl.Supports = CLAMPED) -> hl.Structure:
    made = hl.kirchhoff_plate(0.05, 0.04, thickness, hl.ALUMINIUM_6061, supports, highest_frequency=frequency)
    return made.at(0.015, 0.0175)


@pytest.fixture(scope="module")
def good() -> xr.Dataset:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return hl.CoSimulation(CHAIN, WALL).run(1.2e-3)


def test_a_run_without_findings_warns_of_nothing(good: xr.Dataset) -> None:
    assert good.attrs["warnings"] == ""


def test_energy_that_the_steps_make_or_lose() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="energy: ") as caught:
        run = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.4), WALL, dt=4e-6, window=4e-6).run(3e-4)
    error = hl.energy_error(run)
    assert error > 1e-3
    (finding,) = found(run, "energy")
    assert f"the run created or lost {100.0 * error:.2g} % of the impact energy" in finding
    assert finding.endswith("the chain's steps; take a shorter dt")
    assert finding in [str(one.message) for one in caught]
    assert {one.filename for one in caught} == {__file__}


@pytest.mark.parametrize(("coefficient", "ratio"), [(5e3, 98), (1e5, 1958)])
def test_a_loss_in_another_unit(coefficient: float, ratio: int) -> None:
    """5 N s/m is 5000 g/s: the rate of the loss is the coefficient over the reduced mass of two beads, m/2."""
    chain = hl.Chain([BEAD] * 20, BEAD, 0.44, dissipation=hl.LinearDashpot(coefficient))
    moving = MovingChain(chain, None)
    (finding,) = check_before([moving], 1e-4)
    assert finding.startswith(
        f"dissipation = LinearDashpot(coefficient={coefficient}): would stop a contact in 1/{ratio} "
    )
    assert moving.contact_time * coefficient / (BEAD.mass / 2.0) == pytest.approx(ratio, rel=0.01)
    usual = hl.Chain([BEAD] * 20, BEAD, 0.44, dissipation=hl.Restitution(0.05))
    assert check_before([MovingChain(usual, None)], 1e-4) == []


def test_a_loss_inside_beads_in_another_unit() -> None:
    """1 µs is not 1 s: C = b K has the rate b ω² of the fastest mode; the warning names the given argument."""
    loss = hl.damping.Rayleigh(stiffness_time=1e-2)
    chain = hl.DeformableChain([BEAD] * 3, BEAD, 0.44, damping=loss, dissipation=hl.LinearDashpot(5.0))
    moving = moving_chain(chain, None)
    assert not moving.strongest_loss[1]  # asked for before the times, which it must not change
    (finding,) = check_before([moving], 1e-5)
    fastest = max(moving.shapes[1].frequencies)
    ratio = moving.contact_time * 1e-2 * fastest**2
    assert finding.startswith(f"damping = {loss}: would stop a vibration in 1/{ratio:.0f} of a contact's time")
    polymer = hl.Sphere(2.38e-3, hl.PTFE)
    for fine in (hl.damping.Rayleigh(stiffness_time=1e-6), hl.damping.Modal(0.4)):
        usual = hl.DeformableChain([polymer] * 3, polymer, 0.44, damping=fine)
        assert check_before([moving_chain(usual, None)], 1e-3) == []


@pytest.mark.parametrize(
    ("until", "meant"), [(1.5, "0.0015 (1.5 ms)"), (1500.0, "0.0015 (1.5 ms)"), (0.4, "0.0004 (400 µs)")]
)
def test_a_run_that_is_far_too_long_is_warned_of_before_it_begins(
    until: float, meant: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("coupling.kernels.loop.run_windows", None)
    with pytest.warns(hl.HertzlinkWarning) as caught, pytest.raises((TypeError, ValueError)):
        hl.CoSimulation(CHAIN, WALL).run(until)
    message, *_ = [str(one.message) for one in caught]  # a second one names the memory
    assert message.startswith(f"until = {until:g} s: is ")
    assert message.endswith(f"; did you mean until = {meant}?")


@pytest.mark.parametrize(("count", "preload", "speed"), [(10, 100.0, 5e-7), (10, 1.0, 1e-8), (100, 1000.0, 1e-6)])
def test_rounding_of_a_preload_is_not_blamed_on_the_step(count: int, preload: float, speed: float) -> None:
    """A faint wave holds 1e-12 of the energy that the preload stores, which has 16 digits: no shorter step helps."""
    chain = hl.Chain([BEAD] * count, None, speed, preload=preload)
    run = hl.CoSimulation(chain, WALL).run(1e-3)
    assert hl.energy_error(run) > 1e-3
    (line,) = found(run, "energy")
    assert line.startswith("energy: cannot be checked; rounding of the energy that the preload stores is up to")


MANY = (
    r"until = 1.5: takes 1\.\de\+09 steps of beads; give most_steps = 1\.\de\+09 if it is meant; did you mean .*1.5 ms"
)


@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
def test_a_run_of_too_many_steps_is_refused_unless_asked_for() -> None:
    """One rule for runs, batches and sweeps; a step that is too short is named instead of the time."""
    chain = hl.Chain([BEAD] * 20, BEAD, 0.3)
    simulation = hl.CoSimulation(chain, None)
    for run in (
        lambda: simulation.run(1.5),
        lambda: simulation.plan(1.5),
        lambda: hl.batch(lambda n: simulation, 1.5, save_every=1e-3, n=[1]),
        lambda: hl.sweep(lambda n: simulation, 1.5, jobs=1, n=[1]),
    ):
        with pytest.raises(ValueError, match=MANY):
            run()
    with pytest.raises(ValueError, match=r"dt = 1e-13: takes 2\.1e\+11 steps of beads; give most_steps = 2\.3e\+11 if"):
        hl.CoSimulation(chain, None, dt=1e-13).run(1e-3)
    for loss in (hl.PowerDashpot(1e9), hl.PowerDashpot(1e12)):
        lossy = hl.Chain([BEAD] * 20, BEAD, 0.3, dissipation=loss)
        with pytest.raises(ValueError, match=r"^dissipation = PowerDashpot\(.*: takes .* steps"):
            hl.CoSimulation(lossy, None).plan(6e-4)
    with pytest.raises(ValueError, match=r"most_steps = 0: must be a positive number"):
        simulation.replace(most_steps=0)
    asked = simulation.replace(most_steps=1e4)
    with pytest.raises(ValueError, match="give most_steps = "):
        asked.run(1e-3)
    assert simulation.replace(most_steps=2e9).plan(1.5).rows > 1e6


def test_batches_warn_of_their_length_too(monkeypatch: pytest.MonkeyPatch) -> None:
    def stop(*_: Any) -> None:
        raise RuntimeError("stopped")

    monkeypatch.setattr("coupling.sweeps.batch.fill", stop)
    with (
        pytest.warns(hl.HertzlinkWarning, match="you mean until = 0.0015") as caught,
        pytest.raises(RuntimeError, match="stopped"),
    ):
        hl.batch(lambda n: hl.CoSimulation(hl.Chain([BEAD] * n, BEAD, 0.4), None), 1.5, save_every=1e-3, n=[2])
    assert len(caught) == 1


def test_a_long_record_is_no_mistake() -> None:
    """Thirty times down and back; and a piston that moves for half a second."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        one = hl.Chain([BEAD], BEAD, 0.4)
        hl.CoSimulation(one, None).run(3e-3)
    piston = hl.Chain([BEAD] * 2, hl.Piston([0.0, 0.5], [0.0, 1e-6]))
    assert check_before(hl.CoSimulation(piston, WALL).interface.chains, 1.5) == []


@pytest.mark.parametrize("until", [1e-4, 3e-4, 4.5e-4])
def test_a_record_that_ends_too_early(good: xr.Dataset, until: float) -> None:
    """The `until` that is named holds the reflected wave at the first sensor that is far enough from an end."""
    with pytest.warns(hl.HertzlinkWarning, match="record: ends at"):
        run = hl.CoSimulation(CHAIN, WALL).run(until)
    (finding,) = found(run, "record")
    needed = float(finding.split("until = ")[1].split()[0])
    arrival = hl.reflections(good, 6).primary.arrival
    assert arrival < needed < 2.5 * arrival


def test_a_record_that_holds_the_wave_in_mid_chain(good: xr.Dataset) -> None:
    """It causes no warning, even if a dashpot keeps the bead from being silent between the waves."""
    beads = [hl.Sphere(4.29e-3, material) for material in 6 * (HARD, hl.PTFE)]
    dashpots = hl.Chain(beads, beads[0], 0.4, dissipation=hl.LinearDashpot(5.66))
    lossy = hl.CoSimulation(dashpots, hl.infinite_plate(2e-3, HARD))
    arrival = float(hl.reflections(good, 9).primary.arrival)
    for simulation, until in ((hl.CoSimulation(CHAIN, WALL), arrival), (lossy, 1.5e-3)):
        assert not found(simulation.run(until), "record")


def test_chains_whose_record_cannot_be_too_short() -> None:
    pushed = hl.PushedBead([0.0, 1e-5, 2e-5], [0.0, 10.0, 0.0])
    for chain, wall in ((CHAIN, None), (hl.Chain([BEAD] * 5, pushed), WALL)):
        assert not found(hl.CoSimulation(chain, wall).run(5e-5), "record")


def test_contacts_beyond_yield() -> None:
    """Hertz's pressure of the peak force, against 1.61 times the yield strength of the softer side."""
    chain = hl.Chain([BEAD] * 10, BEAD, 0.4)
    with pytest.warns(hl.HertzlinkWarning, match="yield: "):
        run = hl.CoSimulation(chain, hl.half_space(hl.ALUMINIUM_6061)).run(6e-4)
    pressure = hl.theory.hertz_pressure(
        BEAD.surface, hl.Surface(hl.ALUMINIUM_6061), float(run.contact_force[:, -1].max())
    )
    (finding,) = found(run, "yield")
    ratio = pressure / hl.theory.yield_pressure(hl.ALUMINIUM_6061)
    assert finding == (
        f"yield: contact 11 presses aluminium 6061 to {ratio:.3g} times the pressure at which it yields; its dent is "
        "left out; law=hl.laws.JacksonGreen() in Chain computes it"
    )


def test_no_contact_yields_below_the_speed_that_is_named() -> None:
    """A law of the user's own has no law of yielding, so a speed is named: there Hertz's pressure is that of yield."""
    law = hl.laws.PowerLaw(hl.theory.hertz_stiffness(BEAD.surface, BEAD.surface))
    wall = hl.half_space(hl.ALUMINIUM_6061)
    chain = hl.Chain([BEAD] * 10, BEAD, 0.4, law=law)
    words = found(hl.CoSimulation(chain, wall).run(6e-4), "yield")[0]
    slower = replace(chain, impact_speed=float(words.split("about ")[1].split()[0]))
    slow = hl.CoSimulation(slower, wall).run(2e-3)
    pressure = hl.theory.hertz_pressure(BEAD.surface, wall.surface, float(slow.contact_force[:, -1].max()))
    assert pressure == pytest.approx(hl.theory.yield_pressure(hl.ALUMINIUM_6061), rel=0.03)


@pytest.mark.parametrize(("beyond", "says"), [(1.35, False), (1.5, True)])
def test_a_contact_just_beyond_yield_warns_of_nothing(beyond: float, says: bool) -> None:
    """The wall's contact bears this multiple of the force of first yield: AR changes by a little more than 0.01."""
    unyielding = hl.CoSimulation(CHAIN, hl.half_space(replace(hl.ALUMINIUM_6061, yield_strength=None))).run(8e-4)
    weak = hl.laws.JacksonGreen(1e8).contact(BEAD, hl.Surface(hl.ALUMINIUM_6061))
    # The force of the first yield grows with the cube of the strength.
    strength = 1e8 * (float(unyielding.contact_force[:, -1].max()) / beyond / weak.yield_force) ** (1.0 / 3.0)
    wall = hl.half_space(replace(hl.ALUMINIUM_6061, yield_strength=strength))
    runs = [hl.CoSimulation(replace(CHAIN, law=law), wall).run(8e-4) for law in (None, hl.laws.JacksonGreen())]
    assert [bool(found(run, "yield")) for run in runs] == [says, False]
    elastic, yielded = (float(hl.amplitude_ratio(run, 6)) for run in runs)
    assert (elastic - yielded > 0.012) == says


@pytest.mark.parametrize(
    ("wall", "strength", "says"), [(hl.PTFE, None, True), (hl.ALUMINIUM_6061, None, False), (hl.PTFE, 3e7, False)]
)
def test_a_law_of_yielding_says_whose_strength_it_takes(wall: hl.Material, strength: float | None, says: bool) -> None:
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    chain = hl.Chain([bead] * 4, bead, 0.3, law=hl.laws.JacksonGreen(strength))
    said = found(hl.CoSimulation(chain, hl.half_space(wall)).run(1e-3), "strength")
    assert len(said) == says
    assert all("the yield strength of PTFE is not known; that of steel 440C, 1900 MPa, is used" in one for one in said)


@pytest.mark.thorough
def test_line_contacts_beyond_yield() -> None:
    """p₀ = √(F E*/(π R L)), Johnson 1985, equation 4.45."""
    weak = hl.Material(200e9, 0.3, 7800.0, "weak", 1e6)
    rod = hl.Cylinder(2e-3, 4e-3, weak)
    run = hl.CoSimulation(hl.Chain([rod] * 3, rod, 0.1), None).run(1e-4)
    force = float(run.contact_force.isel(contact=slice(0, 3)).max())
    pressure = sqrt(force * 0.5 * weak.contact_modulus / (pi * 1e-3 * 4e-3))
    ratio = pressure / hl.theory.yield_pressure(weak)
    assert f"presses weak to {ratio:.3g} times the pressure at which it yields" in found(run, "yield")[0]


def test_a_plate_that_moves_by_more_than_half_its_thickness() -> None:
    striker = hl.Chain([hl.Sphere(5e-3, HARD)] * 3, hl.Sphere(5e-3, HARD), 3.0)
    free = hl.Supports(left="free", right="free", bottom="free", top="free")
    runs = [hl.CoSimulation(striker, hl.reduce(plate(5e-4, 40e3, s), 1e-3, 0.1)).run(1e-3) for s in (CLAMPED, free)]
    moved = [float(abs(run.surface_displacement).max()) for run in runs]
    assert min(moved) > 2.5e-4
    assert f"deflection: the plate moves by {readable(moved[0], 'm', 2)} at" in found(runs[0], "deflection")[0]
    assert not found(runs[1], "deflection")


STEEL, PTFE = hl.STEEL_440C, hl.PTFE


@pytest.mark.parametrize(
    ("made", "kind", "words"),
    [
        (lambda: hl.rod([hl.Layer(PTFE, 1e-4, 9.5e-3), hl.Layer(STEEL, 0.05, 9.5e-3)]), "contact", "100 µm thick"),
        (lambda: hl.rod([hl.Layer(PTFE, 0.02, 5e-4)]), "contact", "500 µm in radius"),
        (lambda: hl.rod([hl.Layer(STEEL, 2e-3, 9.5e-3), hl.Layer(PTFE, 0.025, 9.5e-3)]), "layer", "layered_cylinder"),
        (lambda: hl.half_plane(0.03, PTFE, "clamped", 0.03, until=1e-3), "shear", "mindlin_plate"),
        (lambda: hl.infinite_plate(0.03, PTFE), "shear", "mindlin_plate"),
    ],
)
def test_a_structure_beyond_its_theory(made: Any, kind: str, words: str) -> None:
    with pytest.warns(hl.HertzlinkWarning, match=f"^{kind}: "):
        run = hl.CoSimulation(CHAIN, made()).run(1e-3)
    (finding,) = found(run, kind)
    assert words in finding


def test_a_rod_of_the_thesis_is_within_its_theory() -> None:
    layers = [hl.Layer(STEEL, 6.35e-3, 9.5e-3), hl.Layer(PTFE, 0.0254, 9.5e-3)]
    run = hl.CoSimulation(CHAIN, hl.rod(layers)).run(1.5e-3)
    assert not found(run, "layer") + found(run, "contact")


def test_a_reflected_wave_above_the_incident_one() -> None:
    heavy = hl.Sphere(10e-3, HARD)
    run = hl.CoSimulation(hl.Chain([hl.Sphere(1e-3, HARD)] + [heavy] * 15, heavy, 0.05), WALL).run(2e-3)
    for measure in (hl.amplitude_ratio, hl.reflections):
        with pytest.warns(hl.HertzlinkWarning, match=r"AR at bead 8: 1\.0\d+ is above 1"):
            measure(run, 8)


@pytest.mark.thorough
def test_a_push_that_is_too_short_for_the_reduction() -> None:
    """Beads of 2 mm on a thin plate: reduced for 25 µs, the secondary wave is off by 2 %, for the push it is right."""
    bead = hl.Sphere(1e-3, HARD)
    chain, full = hl.Chain([bead] * 14, bead, 0.4), plate(1e-3, 160e3)
    with pytest.warns(hl.HertzlinkWarning, match="reduction: "):
        coarse = hl.CoSimulation(chain, hl.reduce(full, 3e-4, pulse=25e-6)).run(3e-4)
    (finding,) = found(coarse, "reduction")
    pulse = float(finding.split("pulse=")[1].split(")")[0])
    assert pulse == pytest.approx(hl.contact_time(coarse), rel=0.2)
    fine = hl.CoSimulation(chain, hl.reduce(full, 3e-4, pulse=pulse)).run(3e-4)
    exact = hl.CoSimulation(chain, hl.reduce(full, 3e-4, 1e-6)).run(3e-4)
    assert not found(fine, "reduction")
    second = [hl.amplitude_ratio(run, 7, "secondary").item() for run in (coarse, fine, exact)]
    assert second[0] != pytest.approx(second[2], rel=0.01)
    assert second[1] == pytest.approx(second[2], rel=0.002)


def half_plane(frequency: float) -> hl.Structure:
    return hl.half_plane(1e-3, hl.ALUMINIUM_6061, "clamped", 0.015, 1e-4, highest_frequency=frequency)


def strip(frequency: float) -> hl.Structure:
    """A strip of aluminium, 5 mm × 1 mm."""
    return hl.beam(0.1, 0.029, 0.0135, hl.ALUMINIUM_6061, at=0.04, highest_frequency=frequency)


def cube_of_cells(count: int) -> hl.Structure:
    line = np.linspace(0.0, 20e-3, count + 1)
    mesh = skfem.io.meshio.to_meshio(skfem.MeshHex.init_tensor(line, line, line))
    return hl.solid(mesh, hl.PTFE, contact=(10e-3, 10e-3, 20e-3), patch_radius=9.9e-3)


@pytest.mark.parametrize(
    ("make", "coarse", "cure", "enough"),
    [
        (lambda frequency: plate(1e-3, frequency), 4e4, r"highest_frequency=(\S+) suits this push", None),
        (lambda frequency: half_plane(frequency), 4e4, r"highest_frequency=(\S+) suits this", None),
        (lambda frequency: strip(frequency), 4e4, r"highest_frequency=(\S+) suits this", None),
        (lambda count: hl.rod([hl.Layer(HARD, 0.3, 9e-3)], elements=int(count)), 4, r"elements=(\d+) suits this", None),
        (lambda count: cube_of_cells(int(count)), 4, r"a mesh (\S+) times as fine suits this", 6),
    ],
    ids=["plate", "half-plane", "beam", "rod", "solid"],
)
def test_a_push_that_is_too_short_for_the_mesh(make: Any, coarse: float, cure: str, enough: float | None) -> None:
    """A push that is too short for a mesh causes a warning; with the value that it names, or less, there is none."""
    bead = hl.Sphere(0.5e-3, HARD)
    chain = hl.Chain([bead] * 14, bead, 0.4)

    def warned(knob: float) -> list[str]:
        return found(hl.CoSimulation(chain, hl.reduce(make(knob), 1e-4, pulse=7e-6)).run(1e-4), "mesh")

    (finding,) = warned(coarse)
    value = re.search(cure, finding)
    assert value
    assert not warned(enough or float(value[1]))


def test_a_compiled_run_in_many_calls_has_the_same_bits(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C can end a run between the calls."""
    whole = hl.CoSimulation(CHAIN, WALL).run(2e-4)
    calls, real = [], loop.run_windows
    monkeypatch.setattr("coupling.engine.UNBROKEN", 1e4)
    monkeypatch.setattr(loop, "run_windows", lambda *given: calls.append(given) or real(*given))
    assert hl.CoSimulation(CHAIN, WALL).run(2e-4).identical(whole)
    assert len(calls) > 5
