"""The study of beads that yield: speeds of first yield, and what yielding takes over the impact speed."""

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from hertzlink.studies import yielding as study

THOROUGH_FIXTURES = ("quick",)


@pytest.fixture(scope="module")
def quick() -> xr.Dataset:
    return study.run(quick=True)


@pytest.mark.thorough
def test_the_speed_of_first_yield_divides_runs_with_a_dent_from_those_without(quick: xr.Dataset) -> None:
    """It follows from Hertz's forces and their power 6/5 of the speed, so it does not depend on the speed."""
    bead = hl.Sphere(study.RADIUS, hl.STEEL_440C)
    for pair, wall in (("aluminium 6061", hl.ALUMINIUM_6061), ("brass 360", hl.BRASS_360)):
        found = quick.swept_first_yield.sel(pair=pair, law="elastic").values
        assert found == pytest.approx(found[0], rel=1e-3)
        for factor in (0.98, 1.02):
            chain = hl.Chain([bead] * study.BEADS, bead, factor * float(found[0]), law=hl.laws.Thornton())
            run = hl.CoSimulation(chain, hl.half_space(wall)).run(1.5e-3)
            assert (float(run.dent.max()) > 0.0) == (factor > 1.0)


@pytest.mark.thorough
def test_what_yielding_takes(quick: xr.Dataset) -> None:
    back = quick.swept_amplitude_ratio.sel(pair=["aluminium 6061", "brass 360"])
    elastic, thornton, fitted = (back.sel(law=law) for law in study.LAWS)
    assert elastic.values == pytest.approx(float(elastic[0, 0]), abs=1e-3)
    for law in (thornton, fitted):
        assert np.all(np.diff(law.values, axis=-1) < 0.0)
        assert np.all(law.values < elastic.values + 1e-3)
    assert np.all(thornton.values <= fitted.values + 1e-3)
    hard = quick.swept_incident.sel(pair="steel 440C", impact_speed=slice(None, 0.32))
    assert hard.sel(law="Thornton").values == pytest.approx(hard.sel(law="elastic").values, rel=1e-3)


@pytest.mark.thorough
def test_table_and_figures(quick: xr.Dataset) -> None:
    rows = study.table(quick)
    assert len(rows) == 2 * quick.sizes["impact"]
    assert {row.thesis for row in rows} == {""}
    assert all("yields: struck" in row.reason for row in rows[::2])
    assert set(study.figures(quick)) == {"speed", "waves"}
