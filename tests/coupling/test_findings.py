"""The findings of runs: one line each, and those of many runs together."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import hertzlink as hl
from coupling.results.findings import findings_of, gathered, kind, one_of_each
from hertzlink.output import format_warning
from structures.caution import caution

BEAD = hl.Sphere(4e-3, hl.STEEL_316)
SHALLOW = 1e-6
"""m, up to which the law below is trusted; only the fast strikers exceed it."""


def struck(impact_speed: float) -> hl.CoSimulation:
    return hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, impact_speed, law=hl.laws.PowerLaw(1e9, largest=SHALLOW)), None)


def doubtful(run: xr.Dataset) -> xr.Dataset:
    caution("measure: doubtful")
    return xr.Dataset({"force": run.contact_force.max()})


def test_numbers_make_no_new_kind() -> None:
    assert kind("radius = 4.76: is it in mm?") == kind("radius = 1e-3: is it in mm?") != kind("length = 1e-3: long")
    found = {"x = 1": ["a: 1", "a: 2", "b: 1"], "x = 3": ["a: 3"]}
    assert gathered(found, 5) == [
        "a: 1 (at x = 1; reported at 2 of 5 points)",
        "b: 1 (at x = 1; reported at 1 of 5 points)",
    ]
    assert one_of_each(["a: 1", "a: 1", "b: 1", "a: 2", "a: 3"]) == ["a: 1 (and 2 more of this kind)", "b: 1"]


@pytest.mark.thorough
@pytest.mark.parametrize("how", ["here", "processes", "store", "resumed"])
def test_a_sweep_reports_the_warnings_of_all_its_runs_once(how: str, tmp_path: Path) -> None:
    """Wherever points run: two of four exceed the law, and the measure warns at all four."""
    given = {"jobs": 1 if how == "here" else 2, "store": tmp_path / "store" if how in ("store", "resumed") else None}
    speeds = np.array([1e-3, 0.3, 0.4, 2e-3])
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if how == "resumed":
            hl.sweep(struck, 2e-4, measure=doubtful, impact_speed=speeds[1:3], **given)  # type: ignore[arg-type]
    with pytest.warns(hl.HertzlinkWarning) as caught:
        runs = hl.sweep(struck, 2e-4, measure=doubtful, impact_speed=speeds, **given)  # type: ignore[arg-type]
    assert {one.filename for one in caught} == {__file__}
    assert [str(one.message) for one in caught] == findings_of(runs)
    (law,) = [line for line in findings_of(runs) if line.startswith("contact law: ")]
    assert law.endswith(" (at impact_speed = 0.3; reported at 2 of 4 points)")
    assert "measure: doubtful (at impact_speed = 0.001; reported at 4 of 4 points)" in findings_of(runs)


def test_an_error_in_a_sweep_brings_the_warnings_before_it() -> None:
    def fails(run: xr.Dataset) -> xr.Dataset:
        caution("measure: doubtful")
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError) as caught:
        hl.sweep(struck, 2e-4, 1, fails, impact_speed=[1e-3])
    assert "warning before it: measure: doubtful" in caught.value.__notes__


def test_the_command_line_warns_on_one_line() -> None:
    assert format_warning("a:\n b", hl.HertzlinkWarning, "file.py", 3) == "hertzlink: warning: a: b\n"
    assert "file.py:3: UserWarning: a" in format_warning("a", UserWarning, "file.py", 3)
