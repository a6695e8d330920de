"""Identification of a small thin plate, whose many echoes need a finer mesh than a single run."""

import tomllib
import warnings
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.inference.identification import Identification, Unknown
from coupling.yield_check import CURE
from hertzlink.cases.building import world_of
from hertzlink.cases.case import Case
from hertzlink.cases.faults import YIELDING
from hertzlink.cases.identifying import answer, tables
from hertzlink.cases.plate_accuracy import Fit
from hertzlink.cases.plate_models import BAND, WIDEST, AroundGuess
from hertzlink.cases.plate_search import warn_of_blind
from hertzlink.cases.questions import Builder, Question, question_of
from hertzlink.cases.templates import template

ASKED = """
[identify]
sensors = { 7 = 1, 13 = 2 }
unit = "N"
unknowns = { "structure.at[0]" = ["10 mm", "100 mm"] }
nuisances = ["chain.impact_speed", "gain", "time_zero"]
"""

PLACE = "structure.at[0]"


def asked(until: str, place: float = 0.06) -> Question:
    case = Case(tomllib.loads(template("plate") + ASKED))
    return question_of(case.changed({"run.until": until, PLACE: place}))


def measured(case: Case, noise: float, seed: int) -> xr.Dataset:
    """A signal with gains and a time zero."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        run = case.run()
    time, random = np.arange(0.0, float(run.time[-1]), 0.5e-6), np.random.default_rng(seed)
    rows = []
    for sensor, gain in ((7, 0.9), (13, 1.1)):
        force = gain * np.interp(time - 60e-6, run.time, hl.sensor_force(run, sensor), left=0.0)
        rows.append(force + random.normal(0.0, noise * force.max(), time.size))
    return hl.as_signal(time, dict(zip((7, 13), rows, strict=True)))


def fit_of(question: Question, around: AroundGuess) -> Fit:
    """A fit at the guess, with noise of 0.1 N."""
    values = {PLACE: question.case.model.structure.at[0], "chain.impact_speed": 0.31}
    found = Identification(
        {name: Unknown(name, value, (value, value), "identified") for name, value in values.items()},
        xr.DataArray(),
        xr.Dataset({"noise": ("sensor", [0.1, 0.1])}, {"sensor": [7, 13], "time": [0.0, 1e-6]}),
        1.0, True, [], True, 1,
    )  # fmt: skip
    return Fit(question, found, Builder(question, around.structure), around.frequency, True)


def test_a_difference_is_told_in_standard_deviations() -> None:
    """A plate struck elsewhere moves the place, by as much as it is away; the gain and the time do not hide it."""
    question = asked("1 ms", 0.037)
    around = AroundGuess(question.case, {}, question.of_structure)
    fit = fit_of(question, around)
    world = world_of(question.case.model, question.case.folder)
    shifts = []
    for away in (0.0, 1e-5, 3e-5):
        structure = around.structure(question.case.changed({"structure.at": [0.037 + away, 0.1]}).model, world)
        assert structure is not None
        shifts.append(fit.difference(structure).shifts[PLACE])
    assert shifts[0] == pytest.approx(0.0, abs=1e-6)
    assert shifts[1] > 0.0
    assert shifts[2] == pytest.approx(3.0 * shifts[1], rel=0.05)
    quiet = replace(fit, found=replace(fit.found, data=fit.found.data.assign(noise=0.1 * fit.found.data.noise)))
    assert quiet.difference(structure).worst == pytest.approx(10.0 * shifts[2], rel=1e-6)


def test_a_plate_beyond_the_basis_has_a_mesh_as_fine() -> None:
    question = asked("0.2 ms")
    around = AroundGuess(question.case, {}, {("at", 0)}, 80e3)
    world = world_of(question.case.model, question.case.folder)
    for change in ({}, {"structure.at": [0.09, 0.1]}, {"structure.thickness": 1e-3 * BAND**3}):
        structure = around.structure(question.case.changed(change).model, world)
        assert structure is not None
        assert structure.origin["highest_frequency"] == 80e3


@pytest.mark.thorough
def test_identify_finds_an_edge_of_a_small_thin_plate() -> None:
    """The signal comes from a mesh that is four times as fine as the default and not reduced by a shared basis."""
    question = asked("1.5 ms")
    true = question.case.changed({PLACE: "37 mm", "structure.highest_frequency": "240 kHz"})
    found, remarks = answer(question, measured(true, 0.01, 11))
    assert found.explained
    place = found[PLACE]
    assert abs(place.value - 0.037) < 3.3 / 1.96 * place.error
    assert place.error < 0.01 * 0.037
    model = next(one for one in remarks if "whole plate" in one and "kHz" in one)
    assert model.startswith("whole plate: one basis (ReducedPlate)")
    assert any("simulate traces with structure.highest_frequency" in one for one in remarks)
    assert "standard deviations" in " ".join(tables(question, found, remarks)[0].split())


@pytest.mark.parametrize(("low", "verdict", "count"), [
    (0.0, "blind", 1), (0.055, "identified", 0), (0.0, "not trusted: the model does not fit", 1),
    (0.055, "not trusted: the model does not fit", 0),
])  # fmt: skip
def test_a_place_that_one_edge_does_not_determine_is_named(low: float, verdict: str, count: int) -> None:
    """Whether or not one edge explains a signal that has echoes of others."""
    unknown = Unknown(PLACE, 0.06, (low, 0.07), verdict)
    first = Identification(
        {PLACE: unknown}, xr.DataArray(), xr.Dataset(), 1.0, True, [], True, 1,
    )  # fmt: skip
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        warn_of_blind(asked("0.2 ms"), first)
    assert [str(one.message)[:45] for one in caught] == ["search: the nearest edge alone does not deter"] * count


def test_a_basis_spans_a_part_of_the_distance_at_most() -> None:
    """However little the guess knows of the place."""
    question = asked("0.1 ms")
    around = AroundGuess(question.case, {0: 1.0}, question.of_structure)
    assert isinstance(around._basis.x, tuple)
    low, high = around._basis.x
    assert low == pytest.approx((1.0 - WIDEST) * 0.06)
    assert high == pytest.approx((1.0 + WIDEST) * 0.06)


def test_a_note_names_the_entry_of_a_case_within_the_width_of_a_terminal() -> None:
    """What Python calls Chain's argument is a longer line of a case."""
    question = asked("0.1 ms")
    note = "yield: contact 21 presses steel to 4.5 times the pressure at which it yields; " + CURE
    trace = ("sensor", "time"), np.zeros((1, 2))
    data = xr.Dataset({"measured": trace, "fitted": trace}, {"sensor": [7], "time": [0.0, 1e-6]})
    unknown = Unknown(PLACE, 0.06, (0.055, 0.07), "identified")
    unknowns = {PLACE: unknown, "chain.impact_speed": replace(unknown, name="chain.impact_speed")}
    found = Identification(unknowns, xr.DataArray(), data, 1.0, True, [], True, 1, [note])
    text = tables(question, found, [])[0]
    assert YIELDING in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 80
