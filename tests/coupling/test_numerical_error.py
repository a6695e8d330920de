"""Estimates of numerical errors, compared with solutions in closed form and by scipy, and what they say of sources."""

import json
from collections.abc import Callable
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import hertzlink as hl
from coupling.inference.numerical_error import MEASURES, MESH, REDUCTION
from hertzlink.cases import Fault
from hertzlink.cases.case import Case
from hertzlink.cases.tables import report
from hertzlink.cases.tasks import run_task, task_of
from structures.fineness import finer

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
CHAIN = hl.Chain([BEAD] * 12, BEAD, 0.3)
UNTIL, SENSOR = 0.7e-3, 6
STEEL = hl.Layer(hl.STEEL_440C, 0.02, 9e-3)
CLAMPED = hl.Supports("clamped", "free", "free", "free")
PLATE = hl.kirchhoff_plate(0.1, 0.1, 3e-3, hl.ALUMINIUM_6061, CLAMPED)
AT = 0.05, 0.05


def on(structure: Any, **settings: Any) -> hl.CoSimulation:
    return hl.CoSimulation(CHAIN, structure, **settings)


@cache
def exact_ar() -> float:
    """AR of the chain on PTFE: the equations of motion, and Hertz's law, by scipy."""
    between = 2.0 / 3.0 * hl.STEEL_440C.contact_modulus * (BEAD.radius / 2.0) ** 0.5
    flat = 4.0 / 3.0 / (1.0 / hl.STEEL_440C.contact_modulus + 1.0 / hl.PTFE.contact_modulus) * BEAD.radius**0.5
    law = np.array([between] * 12 + [flat])

    def forces(x: np.ndarray) -> np.ndarray:
        return law * np.maximum(x - np.append(x[1:], 0.0), 0.0) ** 1.5

    def slope(_: float, y: np.ndarray) -> np.ndarray:
        push = forces(y[:13])
        return np.concatenate([y[13:], (np.append(0.0, push[:-1]) - push) / BEAD.mass])

    start = np.zeros(26)
    start[13] = 0.3
    path = solve_ivp(slope, (0.0, UNTIL), start, "DOP853", rtol=1e-11, atol=1e-16, dense_output=True, max_step=1e-6).sol

    def mean(time: float) -> float:
        return -float(forces(path(time)[:13])[[SENSOR - 1, SENSOR]].mean())

    waves = hl.reflections(on(hl.half_space(hl.PTFE)).run(UNTIL), SENSOR)
    back, there = (
        minimize_scalar(mean, bounds=(wave.arrival - 2e-6, wave.arrival + 2e-6), options={"xatol": 1e-12}).fun
        for wave in (waves.primary, waves.incident)
    )
    return float(back / there)


@pytest.mark.parametrize("settings", [{}, {"accuracy": "screening"}, {"window": 0.5e-6}], ids=str)
def test_windows_and_steps_are_as_wrong_as_estimated(settings: dict[str, Any]) -> None:
    """At order 2, a quarter of the error is left where a half is assumed: (1 − 1/4)/(1 − 1/2) = 1.5."""
    estimate = hl.numerical_error(lambda: on(hl.half_space(hl.PTFE), **settings), UNTIL, SENSOR)
    true = estimate.values["amplitude_ratio"] - exact_ar()
    assert estimate.parts["time"]["amplitude_ratio"] == pytest.approx(1.5 * true, rel=0.05)
    assert estimate.margins["amplitude_ratio"] == abs(estimate.parts["time"]["amplitude_ratio"])
    assert estimate.parts[MESH]["amplitude_ratio"] == estimate.parts[REDUCTION]["amplitude_ratio"] == 0.0
    assert estimate.notes[MESH] == estimate.notes[REDUCTION] == "none"


def test_adaptive_windows_are_as_wrong_as_estimated() -> None:
    plate = on(hl.infinite_plate(3e-3, hl.ALUMINIUM_6061))
    estimate = hl.numerical_error(lambda: plate.replace(window=hl.Adaptive(1e-4)), UNTIL, SENSOR)
    fine = hl.amplitude_ratio(plate.replace(accuracy="reference").run(UNTIL, 1e-8), SENSOR)
    true = estimate.values["amplitude_ratio"] - float(fine)
    assert estimate.parts["time"]["amplitude_ratio"] == pytest.approx(1.5 * true, rel=0.1)


@pytest.mark.parametrize("loss", [hl.LinearDashpot(3.0), hl.Restitution(0.9)])
def test_errors_with_losses_are_below_their_margins(loss: Any) -> None:
    """A loss that begins with a contact makes an error of the order 1."""
    lossy = hl.CoSimulation(hl.Chain([BEAD] * 12, BEAD, 0.3, dissipation=loss), hl.half_space(hl.BRASS_360))
    estimate = hl.numerical_error(lambda: lossy.replace(accuracy="screening"), UNTIL, SENSOR)
    fine = lossy.replace(accuracy="reference").run(UNTIL, 1e-8)
    for name in ("amplitude_ratio", "time_of_flight", "contact_time"):
        true = estimate.values[name] - float(MEASURES[name][2](fine, SENSOR))
        assert 0.3 * estimate.margins[name] < abs(true) < estimate.margins[name], name


def test_a_mesh_is_as_wrong_as_estimated() -> None:
    """An infinite plate is a dashpot, 8 √(D ρ t); echoes from the edges come after the contact."""
    plate = hl.kirchhoff_plate(0.3, 0.3, 3e-3, hl.ALUMINIUM_6061, hl.Supports(), highest_frequency=25e3)
    estimate = hl.numerical_error(lambda: on(hl.reduce(plate.at(0.15, 0.15), UNTIL)), UNTIL, SENSOR)
    infinite = on(hl.infinite_plate(3e-3, hl.ALUMINIUM_6061)).run(UNTIL)
    for read in (hl.amplitude_ratio, hl.time_of_flight):
        true = estimate.values[read.__name__] - float(read(infinite, SENSOR))
        assert estimate.parts[MESH][read.__name__] == pytest.approx(true, rel=0.2)
        assert estimate.margins[read.__name__] == sum(abs(part[read.__name__]) for part in estimate.parts.values())


class Spring:
    """A user's participant: a massless spring."""

    surface = hl.Surface(hl.PTFE)

    def start(self) -> float:
        return 0.0

    def advance(self, state: float, force: float, window: float) -> tuple[float, float]:
        return 1e-7 * force, 1e-7 * force


ROD = hl.rod([STEEL])
OWN = hl.Structure([[BEAD.mass]], [[1e6]], None, [1.0], 0.0, hl.Surface(hl.STEEL_440C))  # type: ignore[arg-type]
SMALL_PLATE = hl.reduce(PLATE.at(*AT), UNTIL)


@pytest.mark.parametrize(
    ("build", "sources"),
    [
        (lambda: on(None), {}),
        (lambda: on(hl.infinite_plate(3e-3, hl.PTFE)), {}),
        (lambda: on(ROD), {MESH: "rod"}),
        (lambda: on(hl.reduce(ROD, UNTIL, 0.1, largest=8)), {MESH: "rod"}),
        (lambda: on(OWN), {MESH: "structure of a user"}),
        (lambda: on(Spring(), scheme=hl.Explicit(), window=4e-6), {MESH: "solver"}),
        (lambda: on(SMALL_PLATE), {MESH: "Kirchhoff plate", REDUCTION: "Kirchhoff plate"}),
    ],
    ids=["nothing", "infinite plate", "rod", "reduced rod", "matrices", "solver", "reduced plate"],
)
def test_what_cannot_be_refined_is_named(build: Callable[[], hl.CoSimulation], sources: dict[str, str]) -> None:
    with pytest.warns(hl.HertzlinkWarning, match="not estimated") if sources else nullcontext():
        estimate = hl.numerical_error(build, UNTIL, SENSOR)
    for source in (MESH, REDUCTION):
        unknown = [np.isnan(error) for error in estimate.parts[source].values()]
        assert set(unknown) <= {source in sources}
        assert sources.get(source, "") in estimate.notes[source]
        assert any(line.startswith(f"{source}: not estimated") for line in estimate.warnings) == (source in sources)
    assert all(np.isfinite(error) for error in estimate.margins.values())
    assert max(map(len, str(estimate).splitlines())) <= 80
    # A margin that lacks a source is a lower bound, so reports do not show it.
    assert ("≥" in str(estimate)) == bool(sources)
    noted = json.loads(estimate.noted_in(xr.Dataset()).attrs["numerical_error"])[str(SENSOR)]
    assert noted["margins"] == ({} if sources else estimate.margins)


def test_a_build_that_depends_on_chance_is_refused() -> None:
    chance = np.random.default_rng(3)

    def build() -> hl.CoSimulation:
        return on(hl.rod([hl.Layer(hl.STEEL_440C, 0.02 + 0.01 * chance.random(), 9e-3)], elements=6))

    with pytest.raises(
        ValueError, match=r"build\(\.\.\.\): depends on chance; AR = 0\.\d+ of one call and 0\.\d+ of the"
    ):
        hl.numerical_error(build, UNTIL, SENSOR)


def test_reflections_and_reports_show_the_margins_that_a_run_holds(tmp_path: Path) -> None:
    estimate = hl.numerical_error(lambda: on(hl.half_space(hl.PTFE), accuracy="screening"), UNTIL, SENSOR)
    run = on(hl.half_space(hl.PTFE), accuracy="screening").run(UNTIL)
    noted, other = (hl.reflections(estimate.noted_in(run), sensor) for sensor in (SENSOR, SENSOR + 1))
    margin = f"{estimate.margins['amplitude_ratio']:.1g}"
    assert f"AR = {noted.primary.amplitude_ratio:.4f} ± {margin}, TOF" in repr(noted.primary)
    assert "±" not in repr(hl.reflections(run, SENSOR)) + repr(other)
    page = hl.plots.report(estimate.noted_in(run), tmp_path / "run.html", sensors=SENSOR)
    assert f"± {margin}<" in page.read_text("utf-8")


BALL = {"shape": "sphere", "radius": "4.76 mm", "material": "steel 440C"}
CASE = {
    "chain": {"beads": 12, "bead": BALL, "impact_speed": "0.3 m/s"},
    "structure": {"kind": "rod", "layers": [{"material": "PTFE", "length": "50 mm", "radius": "9 mm"}], "elements": 6},
    "run": {"until": "0.8 ms"},
    "measure": {"sensor": SENSOR, "numerical_error": True},
}


def test_cases_estimate_the_error_of_a_run() -> None:
    task = task_of(Case(CASE))
    text = report(task, run_task(task)).text
    assert f"bead {SENSOR} " in text
    assert "mesh: cells halved" in text
    assert "±" not in report(task, run_task(task_of(Case({**CASE, "measure": {"sensor": SENSOR}})))).text
    with pytest.raises(Fault, match="a single run"):
        task_of(Case({**CASE, "sweep": {"chain.beads": [12, 14]}}))


FINER: dict[str, Callable[[], hl.Structure]] = {
    "rod": lambda: hl.rod([STEEL]),
    "rod with damping": lambda: hl.damping.damped(hl.rod([STEEL], elements=3), hl.damping.Rayleigh(10.0, 1e-7)),
    "beam": lambda: hl.beam(0.5, 100.0, 1.0, hl.STEEL_316, at=0.2),
    "half-plane": lambda: hl.half_plane(3e-3, hl.ALUMINIUM_6061, "clamped", 0.02, UNTIL),
    "cylinder": lambda: hl.layered_cylinder([hl.Layer(hl.STEEL_440C, 0.02, 9e-3)], cells=2),
    "plate": lambda: PLATE.at(*AT),
    "plate of equal cells": lambda: hl.kirchhoff_plate(0.1, 0.1, 3e-3, hl.PTFE, CLAMPED, cells=(4, 5)).at(*AT),
    "Mindlin plate": lambda: hl.mindlin_plate(0.1, 0.1, 6e-3, hl.PTFE, CLAMPED, cells=(4, 5)).at(*AT),
    "panel": lambda: hl.mindlin_panel(hl.Outline([(0, 0), (0.2, 0), (0, 0.2)]), 9e-3, hl.STEEL_316).at(0.05, 0.05),
}


@pytest.mark.parametrize("kind", FINER)
def test_all_kinds_of_meshes_can_be_made_finer(kind: str) -> None:
    usual = FINER[kind]()
    with finer(cells=2):
        fine = FINER[kind]()
    times = 1.9 if kind in ("rod", "rod with damping", "beam", "half-plane") else 3.0
    assert fine.size > times * usual.size
    assert FINER[kind]().size == usual.size


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((3, UNTIL, SENSOR), "build = 3: must be a function"),
        ((lambda: 3, UNTIL, SENSOR), r"build\(...\) = 3: must be a CoSimulation"),
        ((lambda: on(ROD), -1.0, SENSOR), "until = -1.0"),
        ((lambda: on(ROD), UNTIL, 0), "sensor = 0"),
        ((lambda: on(ROD), UNTIL, 99), "must be beads from 1 to 12"),
        ((lambda length: on(ROD), UNTIL, SENSOR), "length"),
        ((lambda: hl.CoSimulation([CHAIN, CHAIN], [ROD, None]), UNTIL, SENSOR), "one chain"),
    ],
)
def test_bad_input_is_named(arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.numerical_error(*arguments)
