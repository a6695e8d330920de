"""The study of the thesis compared with independent numbers (tests/independent/thesis, its `values.json`)."""

import csv
from functools import cache
from math import inf
from pathlib import Path

import pytest
from independent.thesis.values import differences, load
from quick import found

import hertzlink as hl
from hertzlink.studies.compare import Case, as_cases
from hertzlink.studies.equations import closed_forms

RELATIVE = 2e-6
"""The steps of hertzlink's runs."""
BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
LOSSES = {
    "undamped, g = 0": (0.0, None),
    "undamped, g = 9.81": (9.81, None),
    "gamma = 5, no pull, g = 9.81": (9.81, hl.LinearDashpot(5.0)),
}


def chains_on_walls() -> dict[str, dict[str, float]]:
    """AR and TOF of section 6.1.1, by the front door."""
    values: dict[str, dict[str, float]] = {}
    for name, wall in (("steel", hl.STEEL_440C), ("ptfe", hl.PTFE)):
        for loss, (gravity, dashpot) in LOSSES.items():
            options = {} if dashpot is None else {"dissipation": dashpot}
            chain = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=hl.drop_speed(0.01), gravity=gravity, **options)
            run = hl.CoSimulation(chain, hl.half_space(wall)).run(until=0.9e-3)
            primary = hl.reflections(run, sensor=7).primary
            values.setdefault(f"rods_set1_modulus/AR_psw_{name}_exp", {})[loss] = primary.amplitude_ratio
            values.setdefault(f"rods_set1_modulus/TOF_psw_{name}", {})[loss] = primary.time_of_flight * 1e3
    return values


def test_chains_on_walls_agree() -> None:
    assert list(differences(chains_on_walls(), RELATIVE)) == []


with Path(__file__).with_name("independent.csv").open(encoding="utf-8", newline="") as file:
    SAME = [*csv.DictReader(file)]
"""Numbers of studies, under a condition or as the study has them, and the independent values that they must have.

place: in a list of values. unit: that of the row in units of the value. within: relative difference; most rows are runs
that are saved every 0.25 µs.
"""


@cache
def ours(part: str) -> dict[str, dict[str, Case]]:
    if part == "closed-forms":
        return {number.name: as_cases(number.ours) for number in closed_forms()}
    return found(part)


@pytest.mark.parametrize(
    "part",
    [
        pytest.param(part, marks=[] if part == "closed-forms" else pytest.mark.thorough)
        for part in dict.fromkeys(line["part"] for line in SAME)
    ],
)
def test_the_study_agrees(part: str) -> None:
    wrong = {}
    for line in (line for line in SAME if line["part"] == part):
        cases = ours(part)[line["quantity"]]
        value = cases[line["condition"]] if line["condition"] else next(iter(cases.values()))
        expected = load()[line["entry"]]["values"][line["variant"]]["value"]
        expected = expected[int(line["place"])] if line["place"] else expected
        if value * float(line["unit"]) != pytest.approx(expected, rel=float(line["within"])):  # type: ignore[operator]
            wrong[line["quantity"]] = value, expected
    assert wrong == {}


def test_a_difference_is_found() -> None:
    """In a value, in a count, in a name; and NaN never agrees."""
    name, variant = "theory_constants/coeff_6_13", "closed form"
    value = load()[name]["values"][variant]["value"]
    assert list(differences({name: {variant: value * (1.0 + 9e-7)}}, 1e-6)) == []
    for wrong in (value * (1.0 + 2e-6), [value, value], float("nan"), inf):
        assert len(list(differences({name: {variant: wrong}}, 1e-6))) == 1
    assert len(list(differences({name: {"other": value}, "no/entry": {variant: value}}, 1e-6))) == 2
