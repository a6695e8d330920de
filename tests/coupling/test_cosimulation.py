"""The coupled run: energy, momentum, convergence, one answer by every path, bad input."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.interface import check_finite
from coupling.kernels import loop
from structures.damping import StandardLinearSolid

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=0.31)
SUPPORTS = hl.Supports("clamped", "clamped", "free", "free")
PLATE = hl.kirchhoff_plate(0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, SUPPORTS, cells=(12, 12)).at(0.05, 0.1)
LAYERS = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
STRUCTURES = {
    "rod": hl.rod([hl.Layer(hl.ACRYLIC, 0.0762, 0.0191)]),
    "layered rod": hl.rod(LAYERS),
    "plate": PLATE,
    "half-space": hl.half_space(hl.BRASS_360),
}


@pytest.mark.thorough
@pytest.mark.parametrize("reduced", [False, True], ids=["full", "reduced"])
@pytest.mark.parametrize("name", STRUCTURES)
def test_energy_is_conserved_at_the_default_step(name: str, reduced: bool) -> None:
    structure = hl.reduce(STRUCTURES[name], until=1.2e-3) if reduced else STRUCTURES[name]
    run = hl.CoSimulation(CHAIN, structure, reduce=False).run(until=1.2e-3)
    assert hl.energy_error(run) < 1e-6
    mismatch = abs(run.interface_work - run.structure_energy).max() / float(run.impact_energy)
    assert mismatch < 1e-10


@pytest.mark.parametrize("reduced", [False, True], ids=["full", "reduced"])
def test_momentum_passes_into_a_free_rod(reduced: bool) -> None:
    """The rod has the momentum that the beads have lost, to 1e-9 of the striker's, after every window."""
    rod = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01), hl.Layer(hl.STEEL_440C, 0.02, 0.01)], base="free", elements=8)
    everywhere = np.ones(rod.size)
    if reduced:
        rod = hl.reduce(rod, until=1e-3, tolerance=1e-8)
        rigid = int(rod.stiffness.diagonal().argmin())
        everywhere = np.zeros(rod.size)
        everywhere[rigid] = 1.0 / rod.contact[rigid]
    window = 5e-7
    simulation = hl.CoSimulation(CHAIN, rod, window=window)
    run = simulation.run(1500 * window, save_every=window)
    beads = (run.velocity.values * simulation.chain.mass).sum(axis=1)
    impulse = run.interface_impulse.values
    assert beads + impulse == pytest.approx(BEAD.mass * 0.31, rel=1e-9)
    moving = hl.stepping.MovingStructure(rod)
    state = moving.start()
    for row, force in enumerate(np.diff(impulse) / window, 1):
        state, place = moving.advance(state, float(force), window)
        assert place == pytest.approx(float(run.surface_displacement[row]), abs=1e-12)
        assert everywhere @ (rod.mass @ state.velocity) == pytest.approx(impulse[row], abs=1e-9 * BEAD.mass * 0.31)
    assert impulse[-1] > 0.1 * BEAD.mass * 0.31


def check_same(one: xr.Dataset, other: xr.Dataset, tolerance: float) -> None:
    for name in ("velocity", "contact_force", "surface_displacement"):
        scale = float(abs(one[name]).max())
        assert other[name].values == pytest.approx(one[name].values, abs=tolerance * scale, nan_ok=True)


def test_compiled_loop_equals_the_loop_in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same reduced plate, once through the compiled loop and once window by window."""
    simulation = hl.CoSimulation(CHAIN, hl.reduce(PLATE, until=6e-4))
    compiled = simulation.run(until=6e-4)
    monkeypatch.setattr("coupling.engine.is_compiled", lambda *_: False)
    other = simulation.run(until=6e-4)
    check_same(compiled, other, 1e-9)
    # Both predict the forces of a window in the same way.
    assert compiled.evaluations.sum().item() == pytest.approx(other.evaluations.sum().item(), rel=0.02)


WALL = hl.half_space(hl.STEEL_440C)
SHORT = [hl.Chain([BEAD] * 4, BEAD, 0.44), hl.Chain([BEAD] * 6, BEAD, 0.2, 9.81, hl.LinearDashpot(5.0))]
LAYERED = STRUCTURES["layered rod"]


@pytest.mark.parametrize("save_every", [None, 1e-6])
def test_a_window_that_fails_in_the_compiled_loop_is_halved(
    save_every: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The halves are of the same order, so the results stay, and one saved time counts one window more."""

    def failing(*given: Any) -> tuple[int, int, float]:
        *before, (first, last, stride, row) = given
        if not (stride and first <= 100 <= last):
            return real(*given)
        if first < 100:
            real(*before, (first, 99, stride, row))
        return loop.NOT_CONVERGED, 100, 1.0

    real = loop.run_windows
    simulation = hl.CoSimulation(SHORT, [LAYERED, WALL])
    whole = simulation.run(2e-4, save_every)
    monkeypatch.setattr(loop, "run_windows", failing)
    halved = simulation.run(2e-4, save_every)
    assert (halved.windows - whole.windows).values.nonzero()[0].tolist() == [100 // int(whole.windows[1])]
    assert halved.windows.sum() == whole.windows.sum() + 1
    check_same(whole, halved, 1e-5)
    assert hl.energy_error(halved) == pytest.approx(hl.energy_error(whole), rel=0.1)
    monkeypatch.setattr(loop, "run_windows", lambda *given: (loop.NOT_CONVERGED, given[-1][0], 1.0))
    with pytest.raises(hl.NotConverged, match=r"t = 0 s, .* s long: residual 1 N"):
        simulation.run(2e-4, save_every)


COUPLED = {
    "an arm for each oscillator": hl.damping.damped(hl.reduce(PLATE, until=6e-4), StandardLinearSolid(0.3, 2e-5)),
    "arms on a layer": hl.reduce(
        hl.damping.damped(STRUCTURES["layered rod"], StandardLinearSolid(0.3, 2e-5), 1), until=6e-4
    ),
    "absorbing base": hl.reduce(hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing"), until=6e-4),
    "not reduced": hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing", elements=12),
    "less damping of faster modes": hl.Structure(
        np.diag([0.01, 0.02]), np.diag([1e6, 8e5]), np.diag([10.0, 44.0]), np.ones(2), 0.0, hl.Surface(hl.PTFE)
    ),
}


@pytest.mark.parametrize(
    "name", ["absorbing base", *(pytest.param(n, marks=pytest.mark.thorough) for n in COUPLED if n != "absorbing base")]
)
def test_what_damping_couples_goes_through_the_compiled_loop_too(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its dense propagator gives what the implicit midpoint gives window by window, work and losses included."""
    simulation = hl.CoSimulation(CHAIN, COUPLED[name])
    assert simulation.structure.compact
    assert not simulation.structure.structure.is_modal
    compiled = simulation.run(until=6e-4)
    monkeypatch.setattr("coupling.engine.is_compiled", lambda *_: False)
    other = simulation.run(until=6e-4)
    check_same(compiled, other, 1e-10)
    scale = float(compiled.impact_energy)
    assert compiled.interface_work.values == pytest.approx(other.interface_work.values, abs=1e-10 * scale)
    for name in ("structure_kinetic_energy", "structure_elastic_energy", "structure_dissipated_energy"):
        assert compiled[name].values == pytest.approx(other[name].values, abs=1e-10 * scale)
    assert compiled.structure_dissipated_energy[-1] > 1e-3 * scale
    assert hl.energy_error(compiled) < 1e-6


def test_window_converges_with_order_two() -> None:
    """The reference has tiny windows; the step of the chain is fixed and small."""

    def displacement(window: float) -> float:
        simulation = hl.CoSimulation(CHAIN, STRUCTURES["layered rod"], window=window, dt=1e-8)
        return float(simulation.run(until=4.8e-4).surface_displacement[-1])

    exact = displacement(1e-7)
    errors = [abs(displacement(window) - exact) for window in (6.4e-6, 3.2e-6, 1.6e-6)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.2)


def test_a_spring_behind_the_contact_softens_it() -> None:
    """Flexibility acts once, and the energy of its spring is counted."""
    soft = hl.Structure(*(getattr(PLATE, f) for f in ("mass", "stiffness", "damping", "contact")), 1e-7, PLATE.surface)
    runs = [hl.CoSimulation(CHAIN, hl.reduce(s, until=9e-4)).run(until=9e-4) for s in (PLATE, soft)]
    assert hl.contact_time(runs[1]) > 1.02 * hl.contact_time(runs[0])
    assert hl.energy_error(runs[1]) < 1e-6


def test_the_same_input_gives_the_same_bits() -> None:
    runs = [hl.CoSimulation(CHAIN, hl.reduce(PLATE, until=5e-4)).run(until=5e-4) for _ in range(2)]
    assert runs[0].identical(runs[1])


def test_results_carry_their_input_and_go_to_netcdf(tmp_path) -> None:  # type: ignore[no-untyped-def]
    run = hl.CoSimulation(CHAIN, STRUCTURES["layered rod"]).run(until=2e-4)
    assert '"impact_speed": 0.31' in run.attrs["input"]
    assert '"name": "PTFE"' in run.attrs["input"]
    assert "numba" in run.attrs["versions"]
    assert all("units" in run[name].attrs for name in run.data_vars)
    run.to_netcdf(tmp_path / "run.nc")
    with xr.open_dataset(tmp_path / "run.nc") as read:
        assert read.load().equals(run)


def test_coarse_windows_are_warned_of() -> None:
    with pytest.warns(hl.HertzlinkWarning, match="window = 20 µs: is coarse compared with a contact"):
        run = hl.CoSimulation(CHAIN, None, window=2e-5).run(until=1e-4)
    assert "window = 20 µs: is coarse" in run.attrs["warnings"]


def test_a_run_ends_with_the_last_whole_window() -> None:
    run = hl.CoSimulation(CHAIN, None, window=3e-6).run(until=1e-5)
    assert run.time.values == pytest.approx([0.0, 3e-6, 6e-6, 9e-6])


def test_save_every() -> None:
    run = hl.CoSimulation(CHAIN, None).run(until=1e-4, save_every=5e-6)
    assert run.time.values == pytest.approx(np.arange(21) * 5e-6)


class Spring:
    """A black box that may break down in every way."""

    surface = hl.Surface(hl.PTFE)

    def __init__(self, fault: float = 0.0) -> None:
        self.fault = fault

    def start(self) -> float:
        return 0.0

    def advance(self, state: float, force: float, window: float) -> tuple[float, float]:
        return state + window, force / 1e7 + (self.fault if state > 2e-4 else 0.0)


class Steel(Spring):
    surface = "steel"  # type: ignore[assignment]


def test_non_finite_states_stop_the_run_with_time_and_particle() -> None:
    with pytest.raises(FloatingPointError, match=r"from t = 0\.0002\d* s: Spring.advance returned .* nan m"):
        hl.CoSimulation(CHAIN, Spring(np.nan), scheme=hl.Aitken(), window=1e-6).run(until=4e-4)
    broken = hl.reduce(PLATE, until=5e-4)
    broken.contact[:] *= 1e200
    with pytest.raises(FloatingPointError, match=r"the structure's surface is no longer finite at t ="):
        hl.CoSimulation(CHAIN, broken).run(until=5e-4)


@pytest.mark.parametrize(("bead", "name"), [(0, "the striker"), (3, "bead 3"), (20, "bead 20"), (21, "the structure")])
def test_the_particle_that_broke_is_named(bead: int, name: str) -> None:
    y, v = np.zeros(21), np.zeros(21)
    y[bead : bead + 1] = np.nan
    surface, interface = np.array([np.nan if bead == 21 else 0.0]), hl.CoSimulation(CHAIN, None).interface
    with pytest.raises(FloatingPointError, match=f"^{name}"):
        check_finite(interface, [(y, v)], surface, 1e-4)
    check_finite(interface, [(v, v)], np.zeros(1), 1e-4)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"chain": "chain"}, "chain = 'chain'"),
        ({"chain": 3}, "^chain = 3: must be a Chain, or a list of them$"),
        ({"chain": PLATE, "structure": CHAIN}, r"^chain = Structure\(Kirchhoff.{1,100}: must be a Chain, or a list"),
        (
            {"chain": [PLATE], "structure": CHAIN},
            r"^chain = \[Structure\(Kirchhoff.{1,100}: must be a list of one Chain",
        ),
        ({"scheme": PLATE}, r"^scheme = Structure\(Kirchhoff.{1,100}: must be a scheme such as"),
        ({"structure": 3.0}, r"structure = float: must be a Structure \(for a plate: plate\.at"),
        ({"structure": Spring()}, r"scheme = Condensed.*needs a Structure; use Aitken"),
        ({"scheme": hl.Aitken}, "scheme = .*must be a scheme such as"),
        ({"scheme": "aitken"}, "scheme = 'aitken'"),
        ({"structure": Steel(), "scheme": hl.Aitken()}, r"\.surface = 'steel': must be a Surface"),
        ({"window": -1e-6}, "window = -1e-06"),
        ({"dt": 0.0}, r"dt = 0\.0"),
        ({"dt": 1e-3}, r"dt = 0\.001"),
        ({"dt": 2e-6, "window": 1e-6}, "dt = 2e-06: must not be longer than the window"),
    ],
)
def test_bad_simulations(keywords: dict[str, object], message: str) -> None:
    good: dict[str, object] = {"chain": CHAIN, "structure": None}
    with pytest.raises(ValueError, match=message):
        hl.CoSimulation(**{**good, **keywords})  # type: ignore[arg-type]


def test_bad_runs() -> None:
    simulation = hl.CoSimulation(CHAIN, None, window=1e-6)
    for until in (0.0, -1.0, float("nan")):
        with pytest.raises(ValueError, match="until = "):
            simulation.run(until)
    with pytest.raises(ValueError, match=r"window = 1e-06: must not be longer than the run, until = 5e-07 s"):
        simulation.run(5e-7)
    with pytest.raises(ValueError, match="save_every = 5e-07: must not be shorter than the window, 1e-06 s"):
        simulation.run(1e-3, save_every=5e-7)
    with pytest.raises(ValueError, match=r"save_every = 0\.002: must not be longer than the run"):
        simulation.run(1e-3, save_every=2e-3)
    with pytest.raises(ValueError, match=r"until: .* saved times of 21 bodies are too many; give save_every"):
        hl.CoSimulation(CHAIN, None, most_steps=1e13).run(until=1e3)
    with pytest.raises(ValueError, match=r"save_every = 1e-12: 1e\+08 saved times .* too many; take a longer one"):
        hl.CoSimulation(CHAIN, None).run(1e-4, save_every=1e-12)
    with pytest.raises(ValueError, match="tolerance = 0"):
        hl.Aitken(tolerance=0.0)
    with pytest.raises(ValueError, match="tolerance = 1e-30: must lie between 1e-14 and 1"):
        hl.Explicit(tolerance=1e-30)


INTERRUPTED = """
import signal
import hertzlink as hl

def stop(*_):
    raise KeyboardInterrupt

bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
simulation = hl.CoSimulation(hl.Chain([bead] * 200, bead, 0.3), hl.half_space(hl.PTFE))
whole = simulation.run(5e-4)
signal.signal(signal.SIGALRM, stop)
caught = 0
for wait in range(1, 21):
    signal.setitimer(signal.ITIMER_REAL, 0.002 * wait)
    try:
        simulation.run(5e-4)
        signal.setitimer(signal.ITIMER_REAL, 0.0)  # in here, as the signal may come just before it
    except KeyboardInterrupt:
        caught += 1
print(caught > 0, simulation.run(5e-4).identical(whole))
"""


@pytest.mark.thorough
def test_a_signal_during_compiled_code_is_an_exception(tmp_path: Path) -> None:
    """It does not end the process, even if it waits while Numba makes a named tuple; the next run is right."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", INTERRUPTED], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "True True\n"


def test_results_of_equal_shape_share_no_numbers() -> None:
    """A change of one result appears in no other; each has the centres and the preload of its own chain."""
    small, large = hl.Sphere(3e-3, hl.STEEL_440C), hl.Sphere(5e-3, hl.STEEL_440C)
    first, second = (
        hl.CoSimulation(hl.Chain([*beads], small, 0.2, gravity=9.81), hl.half_space(hl.PTFE))
        for beads in ((small, large, small), (large, small, small))
    )
    run, untouched = first.run(2e-4, 1e-6), first.run(2e-4, 1e-6)
    xr.testing.assert_identical(run, untouched)
    run.centre.values[:] = 0.0
    run.static_force.values[:] = 0.0
    run.velocity.values[:] = 0.0
    run.velocity.attrs["units"] = "mm/s"
    run.attrs["input"] = ""
    xr.testing.assert_identical(first.run(2e-4, 1e-6), untouched)
    other = second.run(2e-4, 1e-6)
    assert other.centre.values.tolist() == second.chain.chain.centres.tolist() != untouched.centre.values.tolist()
    assert other.static_force.values.tolist() == second.chain.static_force.tolist()
