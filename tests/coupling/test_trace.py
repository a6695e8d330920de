"""Where the time of a run goes, and what its summary reports."""

import json
import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.recording import trace
from structures.damping import Rayleigh

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 4, BEAD, 0.31, dissipation=hl.LinearDashpot(5.0))
ROD = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], elements=8)
DAMPED = hl.damped(ROD, Rayleigh(5e2, 1e-7))
UNTIL = 1.6e-4


@dataclass(frozen=True)
class SpringMass:
    """A black box: one mass (kg) on one spring (N/m), exact under a constant force."""

    mass: float = 0.0141
    stiffness: float = 1.7e7
    surface = hl.Surface(hl.PTFE)

    def start(self) -> tuple[float, float]:
        return 0.0, 0.0

    def advance(self, state: tuple[float, float], force: float, window: float) -> tuple[Any, float]:
        omega, rest = math.sqrt(self.stiffness / self.mass), force / self.stiffness
        (x, v), c, s = state, math.cos(omega * window), math.sin(omega * window)
        x, v = rest + (x - rest) * c + v * s / omega, v * c - (x - rest) * s * omega
        return (x, v), x


class Windowed(hl.stepping.MovingStructure):
    """Goes window by window, as large structures do."""

    compact = False


STEPPED = Windowed(ROD)

RUNS: dict[str, tuple[Callable[[], hl.CoSimulation], set[str]]] = {
    "windows": (lambda: hl.CoSimulation(CHAIN, STEPPED), {"chains", "structures", "saving"}),
    "black box": (lambda: hl.CoSimulation(CHAIN, SpringMass(), hl.Aitken(), 2e-6), {"chains", "structures", "saving"}),
    "behind": (
        lambda: hl.CoSimulation(hl.Chain([CHAIN.beads[0]] * 3, None, 0.3), STEPPED, behind=DAMPED),
        {"chains", "structures", "saving"},
    ),
    "compiled": (
        lambda: hl.CoSimulation(CHAIN, hl.reduce(ROD, until=UNTIL)),
        {"compiled loop", "structures"},
    ),
}


def traced(name: str) -> tuple[xr.Dataset, dict[str, float], dict[str, int]]:
    run = RUNS[name][0]().run(UNTIL, trace=True)
    report = json.loads(run.attrs.pop("trace"))
    return run, report["seconds"], report["calls"]


@pytest.mark.parametrize("name", RUNS)
def test_parts_make_the_total(name: str) -> None:
    """Parts that held one another would make more than the total, and the rest negative; no number changes."""
    run, seconds, calls = traced(name)
    parts = RUNS[name][1]
    assert set(calls) == parts
    assert set(seconds) == parts | {"rest", "total"}
    assert min(seconds.values()) > 0.0
    assert sum(seconds[part] for part in parts | {"rest"}) == pytest.approx(seconds["total"])
    assert run.identical(RUNS[name][0]().run(UNTIL))


def test_calls_are_those_of_the_run() -> None:
    """An evaluation is a window of the chain; each substep has one free and one forced motion of a Structure."""
    run, _, calls = traced("windows")
    substeps = int(run.substeps.sum())
    assert calls == {"chains": run.evaluations.sum(), "structures": 2 * substeps, "saving": run.sizes["time"]}
    run, _, calls = traced("black box")
    assert calls["chains"] > substeps
    assert calls["structures"] == calls["chains"]
    # The loop saves in compiled code, the start too.
    assert traced("compiled")[2] == {"compiled loop": 1, "structures": 1}


def test_parts_are_timed_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """With a clock that only the chains move on, by 1 s a window, they take all the time."""
    now = 0.0

    def advance(*given: object) -> object:
        nonlocal now
        now += 1.0
        return real(*given)

    real = hl.stepping.MovingChain.advance
    monkeypatch.setattr(hl.stepping.MovingChain, "advance", advance)
    monkeypatch.setattr(trace, "perf_counter", lambda: now)
    _, seconds, calls = traced("behind")
    assert seconds["chains"] == seconds["total"] == calls["chains"] > 100
    assert seconds["structures"] == seconds["saving"] == seconds["rest"] == 0.0


def test_no_trace_unless_asked() -> None:
    simulation = RUNS["windows"][0]()
    assert "trace" not in simulation.run(UNTIL).attrs
    with pytest.raises(ValueError, match="trace = 'yes': must be True or False"):
        simulation.run(UNTIL, trace="yes")  # type: ignore[arg-type]


@pytest.mark.parametrize("name", RUNS)
def test_the_summary_is_that_of_the_run(name: str, caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.INFO, "hertzlink"):
        run = RUNS[name][0]().run(UNTIL)
    (report,) = [record.getMessage() for record in caplog.records if record.levelno == logging.INFO]
    substeps, energy = int(run.substeps.sum()), float(run.impact_energy)
    assert report.startswith(
        f"0.00016 s in {substeps} substeps, {float(run.evaluations.sum()) / substeps:.3g} chain windows"
    )
    into, lost = (float(run[what][-1].sum()) / energy for what in ("interface_work", "dissipated_energy"))
    assert report.endswith(f"into structures {into:.3g}, lost in chains {lost:.3g}")
    assert f"residual {np.max(run.residual.values):.2g} N at most" in report
