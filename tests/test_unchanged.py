"""Results stay as they were recorded; tests/unchanged.py compares two states of the code to the last digits."""

import json
import warnings
from pathlib import Path

import pytest
import unchanged

REFERENCE = json.loads((Path(__file__).parent / "reference" / "unchanged.json").read_text())

ELSEWHERE = 1e-6
"""The largest difference on another processor, in units of the largest number; iterations stop at 1e-9."""


@pytest.mark.thorough
@pytest.mark.parametrize("name", unchanged.cases())
def test_results_stay_as_recorded(name: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        found = unchanged.differences(REFERENCE[name], unchanged.numbers(unchanged.cases()[name]()))
    assert {quantity: worst for quantity, worst in found.items() if worst > ELSEWHERE} == {}


def test_every_case_is_recorded_and_a_difference_is_seen() -> None:
    assert set(REFERENCE) == set(unchanged.cases())
    old = {"force": [2.0, -1.0], "AR": [0.5], "TOF": [float("nan")]}
    new = {"force": [2.0, -1.0 + 4e-9], "AR": [], "TOF": [float("nan")]}
    assert unchanged.differences(old, new) == {"force": pytest.approx(2e-9), "AR": float("inf"), "TOF": 0.0}
