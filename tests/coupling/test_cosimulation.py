"""The coupled run: energy, momentum, convergence, one answer by every path, bad input."""

import copy
import pickle
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy import sparse

import hertzlink as hl
from coupling.interface import check_finite
from coupling.kernels import loop
from coupling.kernels.newton import predict
from coupling.kernels.records import NODE, WINDOW, Run
from particles.kernels.motion import TRIED
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
    """What the beads lose the rod has, to 1e-9 of the striker's momentum, at every window."""
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
    check_same(compiled, simulation.run(until=6e-4), 1e-9)


WALL = hl.half_space(hl.STEEL_440C)
BACKED = hl.kirchhoff_plate(0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, SUPPORTS)
PAIR = hl.reduce(BACKED.at([0.08, 0.12], [0.07, 0.07], face=["front", "back"]), until=6e-4)
SHORT = [hl.Chain([BEAD] * 4, BEAD, 0.44), hl.Chain([BEAD] * 6, BEAD, 0.2, 9.81, hl.LinearDashpot(5.0))]
PRESSED = [hl.Chain([BEAD] * 4, BEAD, 0.44, preload=0.2, dissipation=hl.LinearDashpot(5.0)), SHORT[1]]
LAYERED = STRUCTURES["layered rod"]

IN_MODES: dict[str, tuple[Any, ...]] = {
    "a rod, not reduced": (SHORT[0], LAYERED),
    "a rod, free": (SHORT[0], hl.rod(LAYERS, base="free")),
    "Rayleigh damping": (SHORT[0], hl.damped(LAYERED, hl.damping.Rayleigh(100.0, 1e-7))),
    "two chains, two structures": (PRESSED, [LAYERED, WALL]),
    "two chains, one plate": (PRESSED, PAIR),
    "a chain between two structures": (hl.Chain([BEAD] * 4, None, 0.3), LAYERED, WALL),
    "an unused contact": (SHORT[0], hl.ContactPoint(PAIR, 1)),
    # Of each kind of law, loss, striker and bead that the chains above lack.
    "chains of three kinds": (
        [
            hl.Chain(
                [BEAD] * 5,
                BEAD,
                0.3,
                gravity=9.81,
                dissipation=hl.Tsuji(0.1),
                law=hl.laws.PowerLaw(2e8, 1.3),
            ),
            hl.Chain([BEAD] * 4, hl.PushedBead((0.0, 2e-5, 4e-5), (0.0, 20.0, 0.0)), law=hl.laws.Thornton(6e8)),
            hl.DeformableChain([BEAD] * 3, BEAD, 0.3),
        ],
        [LAYERED, WALL, hl.rod(LAYERS, base="free")],
    ),
}


LONG_TO_COMPILE = ("chains of three kinds",)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.thorough] * (name in LONG_TO_COMPILE)) for name in IN_MODES]
)
def test_any_number_of_chains_goes_through_the_compiled_loop(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Structures move by their modes, chains by Newton's method in compiled code; window by window nothing differs.

    The sums of both loops round differently, which a chain magnifies; nothing differs by more than 1e-8.
    """
    chain, structure, *behind = IN_MODES[name]
    simulation = hl.CoSimulation(chain, structure, behind=behind[0] if behind else None)
    compiled = simulation.run(until=2e-4)
    monkeypatch.setattr("coupling.engine.is_compiled", lambda *_: False)
    monkeypatch.setattr(loop, "run_windows", None)
    other = simulation.run(until=2e-4)
    assert set(compiled.data_vars) == set(other.data_vars)
    scale = float(compiled.impact_energy.max())
    for one in compiled.data_vars:
        if one in ("evaluations", "residual"):
            continue
        size = scale if compiled[one].attrs["units"] == "J" else float(abs(other[one]).max())
        assert compiled[one].values == pytest.approx(other[one].values, rel=0.0, abs=1e-8 * size, nan_ok=True), one
    assert compiled.windows.equals(other.windows)


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
    simulation = hl.CoSimulation(PRESSED, [LAYERED, WALL])
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


@pytest.mark.parametrize("remembered", [0, 1, 2, 3])
@pytest.mark.parametrize("lengths", [(2e-6, 4e-6, 3e-6), (2e-6, 2e-6, 3e-6), (2e-6, 2e-6, 2e-6)])
def test_a_trial_begins_with_the_polynomial_through_the_last_mean_forces(
    remembered: int, lengths: tuple[float, ...]
) -> None:
    """At the middles of windows, newest first; zero before there is any."""
    powers = np.array([3.0, -2e6, 5e12]) * (np.arange(3) < remembered)
    ends = 9e-6 - np.cumsum([0.0, *lengths[:2]])
    middles = ends - np.array(lengths) / 2.0
    records = [np.zeros(size, kind).view(np.recarray) for size, kind in ((3, WINDOW), ((3, 1), NODE), (1, TRIED))]
    window, node, tried = records
    window.middle, window.length = middles, lengths
    node.force[:, 0] = np.polynomial.Polynomial(powers)(middles)
    predict(node, window, remembered, 1e-5, 2e-6, tried)
    assert tried.force[0] == pytest.approx(np.polynomial.Polynomial(powers)(1e-5), rel=1e-12)


def test_a_window_that_fails_leaves_the_run_as_it_began(monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the trials, which are counted: its halves go on from there."""

    def watched(run: Any, *given: Any) -> tuple[int, int, float]:
        *more, (first, last, stride, row) = given
        end = loop.OK, last, 0.0
        for window in range(first, max(first, last) + 1):
            before = [part.copy() for part in run]
            end = real(run, *more, (window, min(window, last), stride, row if window == first else -1))
            if end[0] == loop.NOT_CONVERGED:
                failed.append(window)
                for name, part, old in zip(Run._fields, run, before, strict=True):
                    assert np.array_equal(part, old) or name == "totals", name
                break
        return end

    real, failed = loop.run_windows, list[int]()
    simulation = hl.CoSimulation(SHORT[0], LAYERED)
    expected = simulation.run(1e-4)
    monkeypatch.setattr("coupling.engine.MOST_TRIALS", 2)
    monkeypatch.setattr(loop, "run_windows", watched)
    check_same(expected, simulation.run(1e-4), 1e-5)
    assert failed


COUPLED = {
    "an arm for each oscillator": hl.damped(hl.reduce(PLATE, until=6e-4), StandardLinearSolid(0.3, 2e-5)),
    "arms on a layer": hl.reduce(hl.damped(STRUCTURES["layered rod"], StandardLinearSolid(0.3, 2e-5), 1), until=6e-4),
    "absorbing base": hl.reduce(hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing"), until=6e-4),
    "not reduced": hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing", elements=12),
    "less damping of faster modes": hl.Structure(
        np.diag([0.01, 0.02]), np.diag([1e6, 8e5]), np.diag([10.0, 44.0]), np.ones(2), 0.0, hl.Surface(hl.PTFE)
    ),
}


@pytest.mark.parametrize("name", COUPLED)
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


def test_large_structures_go_window_by_window() -> None:
    large = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="absorbing", elements=150)
    assert not hl.stepping.MovingStructure(large).compact


@pytest.mark.thorough
def test_aitken_agrees_with_condensed() -> None:
    one, other = (
        hl.CoSimulation(CHAIN, STRUCTURES["rod"], scheme=scheme).run(until=8e-4)
        for scheme in (hl.Condensed(), hl.Aitken(tolerance=1e-11))
    )
    check_same(one, other, 1e-6)


@pytest.mark.thorough
def test_a_very_light_plate_converges_by_aitken_too() -> None:
    """Added mass: a body of a hundredth of a bead, where plain repetition diverges."""
    light = hl.Structure(
        sparse.csr_array([[0.01 * BEAD.mass]]), sparse.csr_array([[1e4]]), None, np.ones(1), 0.0, hl.Surface(hl.PTFE)
    )
    one, other = (
        hl.CoSimulation(CHAIN, light, scheme=scheme, window=1e-6).run(until=8e-4)
        for scheme in (hl.Condensed(), hl.Aitken())
    )
    check_same(one, other, 1e-4)


def test_window_converges_with_order_two() -> None:
    """Against tiny windows, at a fixed and small step of the chain."""

    def displacement(window: float) -> float:
        simulation = hl.CoSimulation(CHAIN, STRUCTURES["layered rod"], window=window, dt=1e-8)
        return float(simulation.run(until=4.8e-4).surface_displacement[-1])

    exact = displacement(1e-7)
    errors = [abs(displacement(window) - exact) for window in (6.4e-6, 3.2e-6, 1.6e-6)]
    assert np.log2(np.divide(errors[:-1], errors[1:])) == pytest.approx([2.0, 2.0], abs=0.2)


def test_amplitude_ratio_settles_with_the_window() -> None:
    reduced = hl.reduce(PLATE, until=1.2e-3)
    ratios = [
        hl.amplitude_ratio(hl.CoSimulation(CHAIN, reduced, window=window).run(1.2e-3), sensor=7).item()
        for window in (4e-6, 2e-6, 5e-7)
    ]
    assert ratios[0] == pytest.approx(ratios[2], rel=5e-3)
    assert ratios[1] == pytest.approx(ratios[2], rel=2e-3)


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


class Silent(Spring):
    def advance(self, state: float, force: float, window: float) -> tuple[float, float]:
        return None  # type: ignore[return-value]


def test_a_black_box_that_answers_nonsense_is_told_so() -> None:
    with pytest.raises(ValueError, match=r"Silent\.advance returned None: must be \(state, displacement in m\)"):
        hl.CoSimulation(CHAIN, Silent(), scheme=hl.Aitken()).run(until=1e-4)


@pytest.mark.thorough
def test_a_black_box_takes_part() -> None:
    """A massless spring of 1e7 N/m is the same as that flexibility behind a half-space."""
    run = hl.CoSimulation(CHAIN, Spring(), scheme=hl.Aitken(), window=4e-7).run(until=1.5e-3)
    none = sparse.csr_array((0, 0))
    series = hl.Structure(none, none, None, np.zeros(0), 1e-7, hl.Surface(hl.PTFE))
    other = hl.CoSimulation(CHAIN, series, window=4e-7).run(until=1.5e-3)
    assert hl.amplitude_ratio(run, 7).item() == pytest.approx(hl.amplitude_ratio(other, 7).item(), rel=2e-3)


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


def test_no_agreement_names_window_time_and_residual() -> None:
    with pytest.raises(hl.NotConverged, match=r"window \d+, t = .* s long: residual .* N after 1 trial"):
        hl.CoSimulation(CHAIN, Spring(), scheme=hl.Aitken(largest_count=1), window=1e-6).run(until=4e-4)


@pytest.mark.parametrize(
    ("keywords", "message"),
    [
        ({"chain": "chain"}, "chain = 'chain'"),
        ({"chain": 3}, "^chain = 3: must be a Chain, or a list of them$"),
        (
            {"chain": PLATE, "structure": CHAIN},
            r"^chain = Structure\(Kirchhoff.{1,100}: must be a Chain, or a list",
        ),
        (
            {"chain": [PLATE], "structure": CHAIN},
            r"^chain = \[Structure\(Kirchhoff.{1,100}: must be a list of one Chain",
        ),
        ({"scheme": PLATE}, r"^scheme = Structure\(Kirchhoff.{1,100}: must be a scheme such as"),
        ({"structure": 3.0}, r"structure = float: must be a Structure \(of a plate plate\.at"),
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


@pytest.mark.parametrize("scheme", [hl.Aitken, hl.IQN_ILS])
def test_relaxation_from_2_on(scheme: type) -> None:
    """Of a rigid structure a repetition leaves 1 − relaxation of the residual."""
    for value in (2.0, 2.5):
        with pytest.raises(ValueError, match=f"relaxation = {value}: must lie between 0 and 2"):
            scheme(relaxation=value)
    assert scheme(relaxation=1.99).relaxation == 1.99


def test_a_simulation_can_be_pickled_after_a_run() -> None:
    """It leaves its factorisations behind, and runs again with the same bits; so does a copy."""
    moving = hl.stepping.MovingStructure(hl.rod(LAYERS, elements=4))
    simulation = hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, 0.31), moving)
    before = simulation.run(until=2e-5)
    for same in (pickle.loads(pickle.dumps(simulation)), copy.deepcopy(simulation)):
        xr.testing.assert_identical(same.run(until=2e-5), before)


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


def test_a_signal_during_compiled_code_is_an_exception(tmp_path: Path) -> None:
    """Not the end of the process, as where Numba makes a named tuple while a signal waits; the next run is right."""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", INTERRUPTED], cwd=tmp_path, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout == "True True\n"


def test_results_of_equal_shape_share_no_numbers() -> None:
    """What a user changes in one result appears in no other; centres and preload are those of the own chain."""
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
