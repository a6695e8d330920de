"""The manual of extensions: each example is one file, and runs as it stands."""

import pickle
import re
import runpy
from hashlib import sha256
from pathlib import Path

import matplotlib
import numpy as np
import pytest
import xarray as xr
from command import ended

from coupling.results.provenance import stored
from hertzlink.cases import case as cases
from hertzlink.cases.case import read
from hertzlink.cases.tasks import task_of
from hertzlink.explore.sliders import sliders_of, start_of
from structures import described

PAGE = (Path(__file__).parent.parent / "docs" / "extending.md").read_text(encoding="utf-8")
SLOW = pytest.mark.thorough
EXAMPLES = dict(re.findall(r"^## (.+?)\n.*?^```python\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE))


@pytest.mark.parametrize("name", [pytest.param(n, marks=[SLOW] * ("compiled" in n)) for n in EXAMPLES])
def test_an_extension_is_one_file(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    matplotlib.use("Agg")
    script = tmp_path / "extension.py"
    script.write_text(EXAMPLES[name], encoding="utf-8")
    monkeypatch.setattr(described, "_ALL", dict(described._ALL))
    runpy.run_path(str(script), run_name="__main__")


def test_every_kind_has_an_example() -> None:
    kinds = re.findall(r"^\| (an? .+?) \|", PAGE, re.MULTILINE)
    assert kinds
    assert {kind[0].upper() + kind[1:] for kind in kinds} == set(EXAMPLES)


@pytest.fixture
def cantilever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with the page's case and the file that describes its structure; the chain is short."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(described, "_ALL", dict(described._ALL))
    monkeypatch.setattr(cases, "_LOADED", {})
    (tmp_path / "mine.py").write_text(EXAMPLES["A structure"], encoding="utf-8")
    case = re.search(r"^```toml\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE)
    assert case is not None
    text = case[1].replace("beads = 16", "beads = 6").replace("2 ms", "0.4 ms")
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    return tmp_path


def test_a_part_of_ones_own_runs_in_a_case(cantilever: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert ended("run", "case.toml", "--with", "mine.py") == 0
    data = xr.open_dataset(cantilever / "case" / "results.nc")
    assert stored(data.attrs["input"])["structure"]["length"] == 0.05
    report = (cantilever / "case" / "report.html").read_text("utf-8")
    assert "length = &#34;50 mm&#34;" in report
    assert "side = &#34;20 mm&#34;" in report
    assert ended("schema", "--with", "mine.py") == 0
    assert '"const": "cantilever"' in capsys.readouterr().out


@pytest.mark.thorough
def test_it_has_sliders_and_is_swept_in_other_processes(cantilever: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    case, _ = read("case.toml", (), (Path("mine.py"),))
    task = task_of(case)
    sliders = {one.label: (one.low, one.high, one.unit) for one in sliders_of(task, start_of(task))}
    assert sliders["length"] == (13, 150, "mm")
    assert sliders["side"] == (5, 60, "mm")
    assert sliders["Young's modulus"][2] == "GPa"
    text = (cantilever / "case.toml").read_text("utf-8") + '[sweep]\n"structure.length" = ["40 mm", "60 mm"]\n'
    (cantilever / "swept.toml").write_text(text, encoding="utf-8")
    assert ended("run", "swept.toml", "--with", "mine.py", "--jobs", "2") == 0
    # A process that works in another folder finds the file, too.
    there = pickle.dumps(case)
    monkeypatch.chdir("/")
    assert pickle.loads(there).simulation().structure.size > 0
    monkeypatch.chdir(cantilever)
    table = (cantilever / "swept" / "table.txt").read_text("utf-8")
    assert "length, mm" in table


@pytest.mark.thorough
def test_a_number_of_it_is_identified(cantilever: Path) -> None:
    text = (cantilever / "case.toml").read_text("utf-8")
    assert ended("run", "case.toml", "--with", "mine.py") == 0
    traces = np.loadtxt(cantilever / "case" / "traces.csv", delimiter=",", skiprows=1)
    np.savetxt("trace.csv", traces, delimiter=",", header="time (s),force (N)", comments="")
    question = '[identify]\nsensors = { 3 = 1 }\nunknowns = { "structure.side" = ["15 mm", "26 mm"] }\nnuisances = []\n'
    (cantilever / "asked.toml").write_text(text + question + 'unit = "N"\nnoise = "1 mN"\n', encoding="utf-8")
    assert ended("identify", "asked.toml", "trace.csv", "--with", "mine.py") == 0
    row = (cantilever / "asked-found" / "unknowns.csv").read_text("utf-8").splitlines()[1].split(",")
    assert float(row[1]) == pytest.approx(0.02, rel=1e-3)


def test_results_name_the_file_of_its_code(cantilever: Path) -> None:
    assert ended("run", "case.toml", "--with", "mine.py") == 0
    first, *_ = (cantilever / "case" / "case.toml").read_text("utf-8").splitlines()
    assert first == f"# --with mine.py, SHA-256 {sha256((cantilever / 'mine.py').read_bytes()).hexdigest()}"


@pytest.mark.parametrize(
    ("old", "new", "words", "said"),
    [
        ("", "", (), 'case.toml:7: structure.kind: "cantilever" is not a kind; must be one of nothing, beam'),
        ("", "", ("--with", "none.py"), "--with none.py: cannot be read (No such file or directory)"),
        ("@hl.described", "", ("--with", "mine.py"), "--with mine.py: describes no part; write @hl.described above"),
        ("hl.Structure:", "hl.Structure", ("--with", "mine.py"), "--with mine.py:8: expected ':'"),
        ("def cantilever", "def half_space", ("--with", "mine.py"), "mine.py: hertzlink has this kind; give it"),
        ("def cantilever", "def kirchhoff_plate", ("--with", "mine.py"), "kirchhoff_plate: hertzlink has this kind"),
    ],
)
def test_what_is_wrong_with_it_is_one_line(
    cantilever: Path, old: str, new: str, words: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    mine = cantilever / "mine.py"
    mine.write_text(mine.read_text("utf-8").replace(old, new, 1) if old else mine.read_text("utf-8"), encoding="utf-8")
    assert ended("run", "case.toml", *words) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        (
            'length = "50 kg"',
            'case.toml:8: structure.length: "50 kg": "kg" is not a unit of this quantity; must be a length',
        ),
        ('length = "-50 mm"', 'case.toml:8: structure.length: "-50 mm" must be a positive number of m'),
        ('lenght = "50 mm"', "case.toml:8: structure.lenght: is not an entry here; did you mean length?"),
        ("", "case.toml:6: structure.length: is missing; give a length"),
    ],
)
def test_its_entries_are_checked_as_those_of_others(
    cantilever: Path, entry: str, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    case = cantilever / "case.toml"
    case.write_text(case.read_text("utf-8").replace('length = "50 mm"', entry), encoding="utf-8")
    assert ended("run", "case.toml", "--with", "mine.py") == 2
    assert said in capsys.readouterr().err
