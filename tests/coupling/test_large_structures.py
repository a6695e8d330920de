"""Structures that nobody reduced and that the compiled engine cannot take are reduced for the run."""

import json
from typing import Any

import numpy as np
import pytest
import xarray as xr
from hard_cases import BEAD

import hertzlink as hl
from coupling import cosimulation

UNTIL = 6e-4
CHAIN = hl.Chain([BEAD] * 6, BEAD, 0.31)
EDGES = hl.Supports("clamped", "clamped", "free", "free")
PLATE = hl.kirchhoff_plate(0.1, 0.1, 2.29e-3, hl.ALUMINIUM_6061, EDGES, cells=(14, 14)).at(0.05, 0.06)


def input_of(run: xr.Dataset) -> dict[str, Any]:
    return dict(json.loads(run.attrs["input"]))


def test_a_large_plate_is_reduced_and_the_result_says_so() -> None:
    """It moves like the unreduced plate, within the estimated error."""
    assert PLATE.size > 600
    simulation = hl.CoSimulation(CHAIN, PLATE)
    run, whole = simulation.run(UNTIL), simulation.replace(reduce=False).run(UNTIL)
    report = input_of(run)["structure"]["reduction"]
    assert report["error_estimate"] <= report["tolerance"]
    assert report["full_size"] == PLATE.size
    assert "reduction" not in input_of(whole)["structure"]
    assert input_of(whole)["reduce"] is False
    for name in ("surface_displacement", "contact_force"):
        away, size = run[name].values - whole[name].values, whole[name].values
        assert 1e-8 < np.sqrt((away**2).mean() / (size**2).mean()) < report["error_estimate"]


def test_a_run_that_is_not_longer_takes_the_same_reduction(monkeypatch: pytest.MonkeyPatch) -> None:
    simulation = hl.CoSimulation(CHAIN, PLATE)
    whole = simulation.run(UNTIL)

    def refuse(*_: Any) -> None:
        raise LookupError("reduced anew")

    monkeypatch.setattr(cosimulation, "reduce_structure", refuse)
    xr.testing.assert_identical(simulation.run(UNTIL), whole)
    assert simulation.run(0.5 * UNTIL).sizes["time"] > 1
    with pytest.raises(LookupError, match="reduced anew"):
        simulation.run(1.01 * UNTIL)


def test_structures_are_reduced_wherever_they_stand() -> None:
    """One for both ends of a chain, also as a contact point; in a batch too. Small structures stay."""
    pair = hl.kirchhoff_plate(0.1, 0.1, 2.29e-3, hl.ALUMINIUM_6061, EDGES, cells=(14, 14)).at(
        [0.04, 0.06], [0.05, 0.05]
    )
    rod = hl.rod([hl.Layer(hl.ACRYLIC, 0.05, 0.01)], elements=8)
    chains = [hl.Chain([BEAD] * 3, BEAD, 0.31), hl.Chain([BEAD] * 4, striker=None, preload=1.0)]
    facing = [hl.ContactPoint(pair, 0), rod]
    simulation = hl.CoSimulation(chains, facing, behind=[None, hl.ContactPoint(pair, 1)])
    given, made = input_of(simulation.run(1e-4)), simulation.for_run(1e-4)
    assert ["reduction" in structure for structure in given["structures"]] == [True, False]
    assert len(made.interface.structures) == 2
    assert made.interface.structures[1] is simulation.interface.structures[1]
    runs = hl.batch(lambda reduce: hl.CoSimulation(CHAIN, PLATE, reduce=reduce), UNTIL, sensors=[3], reduce=[True])
    alone = hl.CoSimulation(CHAIN, PLATE).run(UNTIL, save_every=float(runs.time[1]), sensors=[3])
    assert runs.velocity[0].values == pytest.approx(alone.velocity.values, abs=1e-12)
    with pytest.raises(ValueError, match="cannot run in the compiled loop"):
        hl.batch(lambda reduce: hl.CoSimulation(CHAIN, PLATE, reduce=reduce), UNTIL, sensors=[3], reduce=[False])


def test_a_reduction_suits_the_push_of_the_run() -> None:
    bead = hl.Sphere(0.4e-3, hl.STEEL_440C)
    run = hl.CoSimulation(hl.Chain([bead] * 4, bead, 0.31), PLATE).run(1e-4)
    assert input_of(run)["structure"]["reduction"]["pulse"] == 25e-6 / 16.0
    assert "reduction: " not in run.attrs["warnings"]
