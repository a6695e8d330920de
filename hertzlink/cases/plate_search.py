"""The search for a plate: on its nearest edge alone, then on the whole plate around the fits."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import xarray as xr

from coupling.inference.identification import Identification, is_blind
from hertzlink.cases.plate_accuracy import Fit, frequency_of
from hertzlink.cases.plate_models import BAND, FREQUENCY, TOLERANCE, AroundGuess, one_edge, scales
from hertzlink.cases.questions import Builder, Question, identified, texts
from structures.caution import caution, collected

FOLLOWED = 3
"""Fits of the plate with one edge that are followed on the whole plate."""

WIDER = 0.25
"""Part of the distance from the edge, and of the position, that is searched where no fit explains the signal."""


DOUBLINGS = 2
"""How often the frequency that the mesh resolves is doubled, where that would move an unknown."""


def by_one_edge(question: Question, signal: xr.Dataset, common: dict[str, Any]) -> tuple[Identification, list[str]]:
    """The search on the plate with its nearest edge alone, which needs no mesh; then the whole plate from its fits."""
    with collected() as messages:
        best, remarks = _searched(question, signal, common)
    # Those of a fit are among its notes.
    for one in dict.fromkeys(messages):
        if not one.startswith(("identify:", "reduction:")) and one not in best.warnings:
            caution(one)
    return best, remarks


def _searched(question: Question, signal: xr.Dataset, common: dict[str, Any]) -> tuple[Identification, list[str]]:
    first = identified(question, signal, Builder(question, one_edge), common)
    remarks = [f"found in {first.runs} runs on a plate with its nearest edge alone, then on the whole plate"]
    runs = [first.runs]
    warn_of_blind(question, first)
    shared = scales(question.case.model, question.of_structure)
    frequency = frequency_of(question.case)
    if shared:
        frequency = max(FREQUENCY, frequency)
    best: Fit | None = None
    for mode in first.modes[:FOLLOWED]:
        near, guess = (
            question.case.changed(texts(question, mode)),
            {name: float(mode[name]) for name in question.ranges},
        )
        if shared:
            errors = {i: first[name].error for name in mode for i in (0, 1) if question.paths[name][1:] == ("at", i)}
            fit = _on_basis(
                question, signal, common, AroundGuess(near, errors, question.of_structure, frequency), guess
            )
        else:
            build = Builder(question)
            fit = Fit(question, identified(question, signal, build, common, guess), build, frequency)
        runs.append(fit.found.runs)
        if best is None or fit.found.misfit < best.found.misfit:
            best = fit
    assert best is not None
    if not best.found.explained and shared:
        remarks.append(f"no fit nearby explained the signal; all within {100.0 * WIDER:.0f} % of the best was searched")
        fit = _nearby(question, signal, common, best.values, frequency)
        runs.append(fit.found.runs)
        best = fit if fit.found.misfit < best.found.misfit else best
    for _ in range(DOUBLINGS):
        if not shared or not best.finer():
            break
        near, frequency = question.case.changed(texts(question, best.values)), 2.0 * frequency
        errors = {
            i: best.found[name].error for name in best.values for i in (0, 1) if question.paths[name][1:] == ("at", i)
        }
        around = AroundGuess(near, errors, question.of_structure, frequency, tolerance=TOLERANCE)
        best = _on_basis(question, signal, common, around, best.values)
        runs.append(best.found.runs)
    if len(first.modes) > 1:
        remarks.append(f"that plate has {len(first.modes)} different fits; the best of {FOLLOWED} was taken")
    remarks += best.remarks()
    if not best.found.explained:
        remarks.append('search = "full" in [identify] searches the whole plate, in some minutes')
    return replace(best.found, runs=sum(runs)), remarks


def warn_of_blind(question: Question, first: Identification) -> None:
    """Say that the fits of a plate with one edge do not know where the chain stands on the whole one."""
    places = [name for name in question.ranges if question.paths[name][:2] == ("structure", "at")]
    fits = [first[name] for name in places]
    if blind := [one.name for one in fits if is_blind(one.value, one.interval, question.ranges[one.name])]:
        caution(
            f"search: the nearest edge alone does not determine {' and '.join(blind)}, so the whole plate was searched "
            'only near one guess, and intervals may be too short; measure at more beads, or take search = "full"'
        )


def _on_basis(
    question: Question, signal: xr.Dataset, common: dict[str, Any], around: AroundGuess, guess: Any = None
) -> Fit:
    build = Builder(question, around.structure)
    found = identified(question, signal, build, common, guess)
    return Fit(question, found, build, around.frequency, True, tuple(around.warnings))


def _nearby(
    question: Question, signal: xr.Dataset, common: dict[str, Any], guess: Mapping[str, float], frequency: float
) -> Fit:
    """A search of all positions and thicknesses around a guess, on one basis."""
    near = question.case.changed(texts(question, guess))
    ranges = dict(question.ranges)
    for name, (low, high) in question.ranges.items():
        if question.paths[name][0] == "structure":
            part = WIDER if question.paths[name][1] == "at" else BAND - 1.0
            ranges[name] = max(low, guess[name] / (1.0 + part)), min(high, guess[name] * (1.0 + part))
    around = AroundGuess(near, {}, question.of_structure, frequency, WIDER)
    return _on_basis(replace(question, case=near, ranges=ranges), signal, common, around)
