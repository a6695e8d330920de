"""The number of runs that a study announces, from which its bar estimates the remaining time."""

import pytest

from coupling.sweeps.progress import Progress
from hertzlink.studies import RUNS, STUDIES, study


def test_every_study_announces_its_runs() -> None:
    assert list(RUNS) == list(STUDIES)
    assert all(0 < quick <= whole for quick, whole in RUNS.values())


@pytest.mark.parametrize("name", ["ellipsoids", "hollow-spheres"])
def test_a_study_has_as_many_runs_as_it_announces(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    counts = list[int]()
    monkeypatch.setattr(Progress, "advance", lambda self, failed=False: counts.append(1))
    study(name).run(quick=True, jobs=1)
    assert len(counts) == RUNS[name][0]
