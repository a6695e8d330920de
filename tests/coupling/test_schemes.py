"""All schemes: hard cases, orders, the ledger, what a window costs, and windows that fail."""

import re
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hard_cases import BEAD, CASES, REFERENCE, RETURNED, SENSOR, chain, light, oscillator
from hypothesis import given, settings
from hypothesis import strategies as st
from smooth_cases import INTERVAL, STRUCTURES, UNTIL, reference

import hertzlink as hl
from coupling.black_box import Trial, by_least_squares
from structures.damping import Rayleigh

FREE_ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], base="free", elements=8)
DAMPED_ROD = hl.damping.damped(STRUCTURES["rod"], Rayleigh(5e2, 1e-7))

STRONG = {"condensed": hl.Condensed(), "Aitken": hl.Aitken(), "IQN-ILS": hl.IQN_ILS()}
EXPLICIT = {f"explicit, {predictor}": hl.Explicit(predictor) for predictor in (0, 1, 2)}
SCHEMES = {**STRONG, **EXPLICIT}
GOOD = {name: scheme for name, scheme in SCHEMES.items() if getattr(scheme, "predictor", 1) > 0}
each = pytest.mark.parametrize("name", SCHEMES)


def couple(case: Any, scheme: Any, until: float = 1e-3, **keywords: Any) -> xr.Dataset:
    """The run of a hard case."""
    chains = list(case.chains) if len(case.chains) > 1 else case.chains[0]
    return hl.CoSimulation(chains, case.structures[0], scheme, **keywords).run(min(until, case.until))


def ratios(run: xr.Dataset) -> Any:
    return np.atleast_1d(hl.amplitude_ratio(run, SENSOR).values)


def changes(run: xr.Dataset) -> tuple[Any, Any]:
    """Changes of the total energy over a run, and the mismatch, both in units of the impact energy."""
    parts = run.kinetic_energy + run.contact_energy + run.dissipated_energy
    bodies = run.structure_energy + run.structure_dissipated_energy
    total = sum(one.sum(set(one.dims) - {"time"}) for one in (parts, bodies))
    mismatch = run.interface_mismatch.sum(set(run.interface_mismatch.dims) - {"time"})
    energy = float(run.impact_energy.sum())
    return (total - total[0]).values / energy, mismatch.values / energy


def slow(rows: dict[str, Any], *quick: str) -> list[Any]:
    return [name if name in quick else pytest.param(name, marks=pytest.mark.thorough) for name in rows]


DEFAULTS = [(name, case) for name in GOOD for case in CASES if not name.endswith("2") or case == "chattering"]


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "case"), DEFAULTS)
def test_hard_cases_at_default_settings(name: str, case: str) -> None:
    assert ratios(couple(CASES[case](), GOOD[name], RETURNED[case])) == pytest.approx(REFERENCE[case], abs=1e-4)


ORDERS = [
    (name, structure, 1.0 if name.endswith("0") else 2.0, {"0": 1.0, "1": 2.0}.get(name[-1]))
    for name in SCHEMES
    for structure in STRUCTURES
    if name == "condensed" or structure == "layered rod"
]
"""All schemes see a structure in the same way, by its answers to forces."""


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "structure", "motion", "energy"), ORDERS)
def test_orders_in_the_window(name: str, structure: str, motion: float, energy: float | None) -> None:
    """The orders of the surface's motion, root mean square against the monolithic reference; of AR in strong schemes,
    where its error has no other terms; and of the energy that explicit schemes create."""
    exact, scheme = reference(structure), SCHEMES[name]
    if name in EXPLICIT:
        scheme = hl.Explicit(scheme.predictor, tolerance=None)  # type: ignore[attr-defined]
    errors = []
    for window in (1e-6, 5e-7, 2.5e-7):
        simulation = hl.CoSimulation(chain(), STRUCTURES[structure], scheme, window, 5e-9)
        run = simulation.run(UNTIL, save_every=INTERVAL)
        away = run.surface_displacement - exact.surface_displacement.values
        ratio = hl.amplitude_ratio(run, SENSOR).item() - hl.amplitude_ratio(exact, SENSOR).item()
        errors.append([np.sqrt((away**2).mean().item()), abs(ratio), hl.energy_error(run)])
    observed = np.log2(np.divide(errors[:-1], errors[1:]))
    assert observed[:, 0] == pytest.approx(motion, abs=0.2)
    if name in STRONG:
        assert observed[:, 1] == pytest.approx(motion, abs=0.2)
    if energy is not None:
        assert observed[-1, 2] == pytest.approx(energy, abs=0.2)


@pytest.mark.parametrize("case", slow(CASES, "light", "lighter", "soft", "stiff", "chattering"))
def test_the_condensed_interface_makes_no_energy_on_hard_cases(case: str) -> None:
    total, mismatch = changes(couple(CASES[case](), hl.Condensed()))
    assert abs(mismatch).max() < 5e-11
    assert abs(total).max() < 1e-6


def lossy(gravity: float) -> hl.Chain:
    """The chain with dashpots."""
    return hl.Chain([BEAD] * 14, BEAD, 0.31, gravity=gravity, dissipation=hl.LinearDashpot(5.0))


@pytest.mark.thorough
@each
@pytest.mark.parametrize("losses", [False, True])
def test_the_ledger_closes(name: str, losses: bool) -> None:
    """The total energy loses the mismatch, up to the chain's own drift; a structure keeps or damps all work."""
    struck, structure = chain(), STRUCTURES["layered rod"]
    if losses:
        struck, structure = lossy(9.81), DAMPED_ROD
    run = hl.CoSimulation(struck, structure, SCHEMES[name], window=2.5e-7).run(4e-4)
    total, mismatch = changes(run)
    assert (run.interface_work_of_chain - run.interface_work).values == pytest.approx(run.interface_mismatch.values)
    assert abs(total + mismatch).max() < 1e-6
    energy = float(run.impact_energy)
    assert abs(run.structure_numerical_loss).max() < 1e-10 * energy
    assert abs(mismatch).max() < (1e-8 if name in STRONG else 3e-2)
    if losses:
        assert run.structure_dissipated_energy[-1] > 1e-4 * energy


@pytest.mark.thorough
@each
def test_impulse_is_the_momentum_of_a_free_rod(name: str) -> None:
    """The motion of the rod's tip is that of a rod whose momentum is the impulse."""
    simulation, window = hl.CoSimulation(chain(), FREE_ROD, SCHEMES[name]), 5e-7
    run = simulation.replace(window=window).run(1500 * window, save_every=window)
    impulse, everywhere = run.interface_impulse.values, np.ones(FREE_ROD.size)
    moving = hl.stepping.MovingStructure(FREE_ROD)
    state, scale = moving.start(), float(abs(run.surface_displacement).max())
    for row, force in enumerate(np.diff(impulse) / window, 1):
        state, place = moving.advance(state, float(force), window)
        assert place == pytest.approx(float(run.surface_displacement[row]), abs=1e-9 * scale)
        moved = float(everywhere @ (FREE_ROD.mass @ state.velocity))
        assert moved == pytest.approx(impulse[row], abs=1e-10 * BEAD.mass)
    beads = float((run.velocity[-1] * simulation.chain.mass).sum())
    assert moved > 0.1 * BEAD.mass * 0.31
    strong = name in STRONG
    assert beads + moved == pytest.approx(BEAD.mass * 0.31, rel=1e-8 if strong else 2e-2)


class Counted(hl.stepping.MovingStructure):
    """Counts its solves."""

    solves = 0

    def free(self, state: Any, window: float) -> Any:
        self.solves += 1
        return super().free(state, window)


@pytest.fixture
def chain_windows(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """How often a chain is advanced."""
    count, advance = [0], hl.stepping.MovingChain.advance

    def counted(self: hl.stepping.MovingChain, *given: Any) -> Any:
        count[0] += 1
        return advance(self, *given)

    monkeypatch.setattr(hl.stepping.MovingChain, "advance", counted)
    return count


def test_condensed_takes_one_structural_solve_a_window(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("coupling.engine.is_compiled", lambda *_: False)
    one, two = Counted(STRUCTURES["rod"]), Counted(CASES["two chains"]().structures[0])
    run = hl.CoSimulation(chain(), one).run(4e-4)
    assert one.solves == run.windows.sum() == 2 * (run.sizes["time"] - 1)
    assert run.evaluations.sum() < 1.8 * one.solves  # a parabola predicts the forces of a window
    both = [hl.ContactPoint(two, 0), hl.ContactPoint(two, 1)]
    run = hl.CoSimulation([chain(0.31), chain(0.2)], both).run(4e-4)
    assert two.solves == run.windows.sum() >= run.sizes["time"] - 1
    assert run.evaluations.sum() > 1.2 * two.solves


@pytest.mark.thorough
@each
def test_nothing_divides_by_a_residual_of_zero(name: str) -> None:
    """A chain whose wave has not come yet, and one that hangs off a gap that opens."""
    scheme = SCHEMES[name]
    with np.errstate(all="raise", under="ignore"):
        run = hl.CoSimulation(chain(), STRUCTURES["rod"], scheme).run(4e-5)
        assert run.residual.max() == run.interface_work.max() == 0.0
        assert abs(run.surface_displacement).max() < 1e-15
        thrown = hl.Chain([BEAD], BEAD, 0.31)
        run = hl.CoSimulation(thrown, oscillator(3.0, 1e6), scheme).run(2e-4)
    apart = run.contact_force[:, -1] == 0.0
    assert 0.5 < float(apart.mean()) < 0.99
    assert np.isfinite(run.velocity).all()
    assert run.evaluations.min() >= 0


@pytest.mark.thorough
@pytest.mark.parametrize(
    "scheme", [hl.Aitken(largest_count=1), hl.IQN_ILS(largest_count=1), hl.Explicit(predictor=0, tolerance=1e-13)]
)
def test_no_agreement_names_window_time_and_residual(scheme: Any) -> None:
    """The wave comes after 130 µs."""
    what = r"window \d+, t = .* s, .* s long: residual .* N after 1 trial, tolerance"
    with pytest.raises(hl.NotConverged, match=what) as caught:
        hl.CoSimulation(chain(), STRUCTURES["rod"], scheme, window=1e-6).run(4e-4)
    window, time, length = re.match(r"window (\d+), t = (\S+) s, (\S+) s long", str(caught.value)).groups()  # type: ignore[union-attr]
    assert float(length) == pytest.approx(1e-6 / 2**12, rel=1e-2)
    assert (int(window) - 1) * 1e-6 - 1e-9 <= float(time) <= int(window) * 1e-6 + 1e-9
    assert float(time) > 1e-4


@pytest.mark.thorough
def test_halving_rescues_a_repetition_that_diverges() -> None:
    """Added mass: at 8 µs the light body moves ten times as far as the contact's own approach."""
    case = light()
    given = {"window": 8e-6}
    run = couple(case, hl.Aitken(largest_count=7), **given)
    steps = run.sizes["time"] - 1
    assert run.windows.sum() > 1.3 * steps
    assert set(run.windows.values[1:]) >= {1.0, 2.0}
    assert ratios(run) == pytest.approx(REFERENCE["light"], abs=1e-3)
    assert couple(case, hl.Condensed(), **given).windows.sum() == steps


@pytest.mark.parametrize("count", [1, 2, 3, 6])
@given(seed=st.integers(0, 2**32 - 1))
@settings(max_examples=15)
def test_quasi_newton_ends_on_a_linear_problem_after_a_repetition_for_each_unknown(count: int, seed: int) -> None:
    """x = G x + g, also where plain repetition diverges: n differences determine G completely."""
    random = np.random.default_rng(seed)
    slope = 3.0 * random.normal(size=(count, count)) - 8.0 * np.eye(count)
    right, x = random.normal(size=count), np.zeros(count)
    trials = list[Trial]()
    for _ in range(count + 1):
        answer = slope @ x + right
        trials.append(Trial(answer - x, answer, x))
        x = x + by_least_squares(trials, [], hl.IQN_ILS(filtering=1e-12))
    exact = np.linalg.solve(np.eye(count) - slope, right)
    assert x == pytest.approx(exact, abs=1e-7 * abs(exact).max())


def test_an_explicit_scheme_that_grows_unstable_stops() -> None:
    """A thousandth of a bead at 1 µs: the lagged force adds energy; unchecked, the run reports it."""
    case = CASES["lighter"]()
    with pytest.raises(hl.NotConverged, match=r"t = 0\.000\d+ s, .*exchange has created or lost 0\.05 of the impact"):
        hl.CoSimulation(case.chains[0], case.structures[0], hl.Explicit(), window=1e-6).run(1e-3)
