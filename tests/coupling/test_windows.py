"""Windows: substeps, and those whose length follows their error."""

from typing import Any

import numpy as np
import pytest
import xarray as xr
from hard_cases import CASES, REFERENCE, SENSOR, chain, oscillator
from smooth_cases import STRUCTURES, UNTIL, reference

import hertzlink as hl
from coupling.plan import ADAPTIVE_PER_CONTACT
from coupling.schemes.halving import FINEST, Windows
from coupling.schemes.scheme import Scheme
from coupling.state import Counts, CoupledState, Ledger, Node

FULL_PLATE = hl.kirchhoff_plate(
    0.2, 0.2, 2.29e-3, hl.ALUMINIUM_6061, hl.Supports("clamped", "clamped", "free", "free"), cells=(12, 12)
).at(0.05, 0.1)


class Counted(hl.stepping.MovingStructure):
    """Counts its solves, and goes window by window."""

    solves, compact = 0, False

    def free(self, state: Any, window: float) -> Any:
        self.solves += 1
        return super().free(state, window)


def ratio(run: xr.Dataset) -> float:
    return float(hl.amplitude_ratio(run, SENSOR))


def test_condensed_takes_substeps_as_windows() -> None:
    """Of 4 µs in four, as four windows of 1 µs."""
    runs = [
        hl.CoSimulation(chain(), STRUCTURES["layered rod"], window=window, substeps=substeps).run(UNTIL)
        for window, substeps in ((4e-6, 4), (1e-6, 1))
    ]
    assert runs[0].time.values == pytest.approx(runs[1].time.values)
    assert runs[0].velocity.values == pytest.approx(runs[1].velocity.values, abs=1e-13)


@pytest.mark.thorough
@pytest.mark.parametrize("scheme", [hl.Aitken(), hl.IQN_ILS()])
def test_a_waveform_is_what_its_substeps_are_one_by_one(scheme: Any) -> None:
    """All substeps of a window agree; only the way there differs."""
    runs = [
        hl.CoSimulation(chain(), STRUCTURES["layered rod"], scheme, window, substeps=substeps).run(UNTIL)
        for window, substeps in ((8e-6, 16), (5e-7, 1))
    ]
    assert runs[0].velocity.values == pytest.approx(runs[1].velocity.values, abs=1e-7 * 0.31)
    assert runs[0].evaluations.sum() > runs[1].evaluations.sum()


def test_windows_have_as_many_substeps_as_the_scheme_needs() -> None:
    contact = hl.CoSimulation(chain(), None).chain.contact_time
    for scheme in (hl.Condensed(), hl.Aitken(), hl.Explicit()):
        run = hl.CoSimulation(chain(), oscillator(1.0, 1e6), scheme, window=5e-5).run(1e-4)
        count = (run.sizes["time"] - 1) // 2
        assert np.log2(count) == int(np.log2(count))
        assert 5e-5 / count <= contact / scheme.substeps_per_contact < 1e-4 / count


@pytest.mark.thorough
@pytest.mark.parametrize("case", ["rod", "layered rod", "plate", "chattering", "light"])
def test_amplitude_ratios_are_within_three_tolerances(case: str) -> None:
    """From 1e-3 to 1e-6, over three decades; then the chain's own steps decide, by 2e-6."""
    if case in CASES:
        struck, body, until, exact = *(one[0] for one in CASES[case]()[:2]), CASES[case]().until, REFERENCE[case][0]
    else:
        struck, body, until, exact = chain(), STRUCTURES[case], UNTIL, ratio(reference(case))
    for tolerance in (1e-3, 1e-4, 1e-5, 1e-6):
        error = ratio(hl.CoSimulation(struck, body, window=hl.Adaptive(tolerance)).run(until)) - exact
        assert abs(error) < 3.0 * tolerance + 2e-6


@pytest.mark.thorough
@pytest.mark.parametrize("case", ["layered rod", "full plate"])
def test_adaptive_windows_take_fewer_solves_for_the_same_error(case: str) -> None:
    """Compared with as many windows of one length; errors of these fall with the square of it."""
    body = FULL_PLATE if case == "full plate" else STRUCTURES[case]
    given = {"until": UNTIL, "save_every": 1e-6}
    exact = ratio(hl.CoSimulation(chain(), body, window=6.25e-8, substeps=1).run(**given))
    adaptive, fixed = Counted(body), Counted(body)
    run = hl.CoSimulation(chain(), adaptive, window=hl.Adaptive(1e-5)).run(UNTIL)
    error = abs(ratio(run) - exact)
    other = hl.CoSimulation(chain(), fixed, window=5e-7, substeps=1).run(**given)
    needed = fixed.solves * np.sqrt(abs(ratio(other) - exact) / error)
    assert adaptive.solves < 0.65 * needed
    assert adaptive.solves >= run.substeps.sum()


def test_adaptive_windows_are_parts_of_the_saved_interval(monkeypatch: pytest.MonkeyPatch) -> None:
    lengths: list[tuple[float, float]] = []
    advance = Windows.advance

    def watched(self: Windows, state: Any, length: float, substeps: int) -> Any:
        ends = advance(self, state, length, substeps)
        lengths.extend((node.time, node.length) for end in ends for node in end.past)
        return ends

    monkeypatch.setattr(Windows, "advance", watched)
    simulation = hl.CoSimulation(chain(), Counted(STRUCTURES["layered rod"]), window=hl.Adaptive(1e-5))
    run = simulation.run(UNTIL)
    interval = float(run.time[1])
    parts = np.log2(interval / np.array([length for _, length in lengths]))
    assert parts == pytest.approx(np.round(parts), abs=1e-9)
    assert len(set(np.round(parts))) >= 4
    ends = np.array([time for time, _ in lengths]) / interval * 2.0 ** np.round(parts)
    assert ends == pytest.approx(np.round(ends), abs=1e-6)
    assert interval <= simulation.chain.contact_time / ADAPTIVE_PER_CONTACT < 2.0 * interval
    assert run.substeps.sum() > 1.3 * (run.sizes["time"] - 1)
    assert min(length for _, length in lengths) >= simulation.chain.contact_time / FINEST / 2.0


def test_the_compiled_loop_chooses_the_windows_of_the_loop_in_python() -> None:
    """Windows that are rejected leave no trace but their trials."""
    body = STRUCTURES["layered rod"]
    compiled, plain = (
        hl.CoSimulation(chain(), structure, window=hl.Adaptive(1e-5)).run(UNTIL) for structure in (body, Counted(body))
    )
    assert compiled.substeps.values.max() >= 4
    assert (compiled.substeps.values == plain.substeps.values).all()
    # Newton's first slopes differ, which costs a trial here and there; those of rejected windows are 29.
    assert abs(compiled.evaluations.values - plain.evaluations.values).sum() <= 8
    scale = float(abs(plain.surface_displacement).max())
    assert compiled.surface_displacement.values == pytest.approx(plain.surface_displacement.values, abs=1e-8 * scale)


def test_adaptive_windows_follow_saved_times() -> None:
    run = hl.CoSimulation(chain(), STRUCTURES["rod"], window=hl.Adaptive()).run(3e-4, save_every=1e-6)
    assert run.time.values == pytest.approx(1e-6 * np.arange(301))


@pytest.mark.thorough
@pytest.mark.parametrize("scheme", [hl.Condensed(), hl.Aitken(), hl.Explicit()])
def test_adaptive_windows_keep_the_energy(scheme: Any) -> None:
    run = hl.CoSimulation(chain(), STRUCTURES["layered rod"], scheme, hl.Adaptive(1e-6)).run(UNTIL)
    loose = isinstance(scheme, hl.Explicit)
    assert hl.energy_error(run) < (1e-3 if loose else 1e-6)
    assert abs(run.interface_mismatch).max() < (1e-3 if loose else 1e-8) * float(run.impact_energy)


@pytest.mark.parametrize("tolerance", [0.0, -1e-5, float("nan"), "small"])
def test_bad_tolerances(tolerance: Any) -> None:
    with pytest.raises(ValueError, match="tolerance = "):
        hl.Adaptive(tolerance)


class Limited:
    """A scheme that converges in at most so many substeps together, none longer than `longest` s."""

    def __init__(self, longest: float, together: int) -> None:
        self.longest, self.together = longest, together

    def step(self, interface: Any, state: CoupledState, length: float, many: int) -> list[CoupledState]:
        if length > self.longest or many > self.together:
            raise hl.NotConverged("too long", 1)
        ends = [state._replace(time=state.time + (i + 1) * length, piece=0) for i in range(many)]
        return [end._replace(counts=Counts(1, 1, length)) for end in ends]


AT_REST = CoupledState(0.0, (), (), np.zeros(1), np.zeros(1), Ledger(*np.zeros((4, 1))), Counts(), past=(), memory=None)


def test_a_substep_that_does_not_converge_comes_in_equal_halves() -> None:
    """Three attempts fail, four quarters converge; together they end where the substep ends."""
    windows: Any = Windows(None, Limited(0.3e-6, 8))  # type: ignore[arg-type]
    (end,) = windows.advance(AT_REST, 1e-6, 1)
    assert end.time == pytest.approx(1e-6, rel=1e-12)
    assert end.counts[:2] == (7, 4)
    assert end.counts.residual == pytest.approx(0.25e-6, rel=1e-12)


def test_a_window_comes_in_pieces_that_converge() -> None:
    """Eight and four substeps fail, pairs converge; the next window begins with pieces of four."""
    windows: Any = Windows(None, Limited(1.0, 2))  # type: ignore[arg-type]
    ends = windows.advance(AT_REST, 1e-6, 8)
    assert [end.time for end in ends] == pytest.approx([1e-6 * (i + 1) for i in range(8)], rel=1e-12)
    assert sum(end.counts.evaluations for end in ends) == 8 + 2
    assert ends[-1].piece == 2
    assert sum(end.counts.evaluations for end in windows.advance(ends[-1], 1e-6, 8)) == 8 + 1


class Never(Scheme):
    """A scheme that never converges."""

    def __init__(self) -> None:
        self.tried: list[float] = []

    def step(self, interface: Any, state: Any, length: float, substeps: int) -> Any:
        self.tried.append(length)
        raise hl.NotConverged("residual 1 N", evaluations=1)


def test_a_window_is_halved_twelve_times() -> None:
    scheme = Never()
    with pytest.raises(hl.NotConverged, match=r"window 1, t = 0 s, .* s long: residual 1 N"):
        hl.CoSimulation(chain(), None, scheme).run(2e-5)
    assert scheme.tried == pytest.approx([scheme.tried[0] / 2.0**i for i in range(13)])


def test_the_error_of_a_window_is_the_distance_of_a_parabola_from_its_chord() -> None:
    """a h²/4 of the parabola a t², with windows of unequal lengths before; a tenth of it where nothing touches."""
    simulation, a, window = hl.CoSimulation(chain(), None), 2e5, 1.5e-6
    windows, scale = Windows(simulation.interface, simulation.scheme), simulation.interface.indentation_scale
    for force, part in ((1.0, 1.0), (0.0, 0.1)):
        ends = ((1e-6, 1e-6), (3e-6, 2e-6), (3e-6 + window, window))
        past = tuple(Node(t, length, np.array([a * t * t]), np.array([force])) for t, length in ends)
        found = windows.error(simulation.interface.start(None)._replace(past=past))
        assert found == pytest.approx(part * a * window**2 / 4.0 / scale, rel=1e-9)
