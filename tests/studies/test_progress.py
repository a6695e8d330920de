"""The number of runs that a study announces, from which its bar estimates the remaining time."""

import pytest

from coupling.sweeps.progress import Progress
from hertzlink.studies import STUDIES, study


def test_every_study_announces_its_runs() -> None:
    assert all(0 < entry.runs[0] <= entry.runs[1] for entry in STUDIES.values())


@pytest.mark.parametrize("name", ["ellipsoids", "hollow-spheres"])
def test_a_study_has_as_many_runs_as_it_announces(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    counts = list[int]()
    monkeypatch.setattr(Progress, "advance", lambda self, failed=False: counts.append(1))
    study(name).run(quick=True, jobs=1)
    assert len(counts) == STUDIES[name].runs[0]
