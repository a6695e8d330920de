"""hertzlink's numbers of the thesis compared with independent ones (tests/independent/thesis, its `values.json`).

A program that is compared returns a mapping from entry to a mapping from variant to value: entries, variants and units
as independent/thesis/values.py documents and `python -m tests.independent.thesis --table` lists them. It may leave out
what it does not compute.
"""

from math import inf

import pytest
from independent.thesis.values import Variants, differences, load

import hertzlink as hl

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
    found: dict[str, dict[str, float]] = {}
    for name, wall in (("steel", hl.STEEL_440C), ("ptfe", hl.PTFE)):
        for loss, (gravity, dashpot) in LOSSES.items():
            options = {} if dashpot is None else {"dissipation": dashpot}
            chain = hl.Chain([BEAD] * 20, striker=BEAD, impact_speed=hl.drop_speed(0.01), gravity=gravity, **options)
            run = hl.CoSimulation(chain, hl.half_space(wall)).run(until=0.9e-3)
            primary = hl.reflections(run, sensor=7).primary
            found.setdefault(f"rods_set1_modulus/AR_psw_{name}_exp", {})[loss] = primary.amplitude_ratio
            found.setdefault(f"rods_set1_modulus/TOF_psw_{name}", {})[loss] = primary.time_of_flight * 1e3
    return found


def test_chains_on_walls_agree() -> None:
    assert list(differences(chains_on_walls(), RELATIVE)) == []


def test_the_study_agrees() -> None:
    """`hertzlink study thesis`; connected where the study offers its values in this form."""
    study = pytest.importorskip("hertzlink.studies.thesis")
    found: dict[str, Variants] = study.independent_values()
    assert found
    assert list(differences(found, RELATIVE)) == []


def test_a_difference_is_found() -> None:
    """In a value, in a count, in a name; and a value that is no number never agrees."""
    name, variant = "theory_constants/coeff_6_13", "closed form"
    value = load()[name]["values"][variant]["value"]
    assert list(differences({name: {variant: value * (1.0 + 9e-7)}}, 1e-6)) == []
    for wrong in (value * (1.0 + 2e-6), [value, value], float("nan"), inf):
        assert len(list(differences({name: {variant: wrong}}, 1e-6))) == 1
    assert len(list(differences({name: {"other": value}, "no/entry": {variant: value}}, 1e-6))) == 2
