"""The gallery: each script runs as it stands, in a folder of its own, and prints the numbers that it should."""

import re
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from command import ended

GALLERY = Path(__file__).parent.parent / "examples"

NUMBERS = {
    "wall.py": ([49.9881, 128.525, 48.9536, 587.462], 1e-5),
    "resumed_sweep.py": ([0.911, 0.924, 0.829, 0.922], 5e-3),
    "layered_rod.py": ([25.4, 478.8, 584.0, 50.8, 478.8, 645.0], 3e-3),
    "plate_edge.py": ([0.928, 0.730, 0.573, 0.553, 0.554, 0.554], 5e-3),
    "own_structure.py": ([0.8483], 2e-3),
    "own_law.py": ([452.6, 1.587, 264.7, 1.587, 1.587], 2e-3),
    "uncertainty_budget.py": ([0.524, 0.0056], 2e-2),
    "tap_map.py": ([2.98, 14.93, 3.0], 2e-2),
    "two_chains.py": ([20.0, 0.239, 0.062, 0.062, 40.0, 0.239, 0.266, 0.266, 80.0, 0.238, 0.237, 0.237], 1e-2),
    "mixed_chain.py": ([47.54, 43.79, 86.53, 11.7], 1e-3),
    "bead_stress.py": ([14.62, 2.24, 1.749], 5e-3),
    "plate_wave.py": ([8.52], 2e-2),
    "prestress.py": ([0.0509, 0.0941, 0.128, 0.1422, 0.1439, 0.1362], 5e-3),
    "viscous_beads.py": ([1.0, 0.991, 0.971, 0.624, 0.542], 3e-3),
    "body_from_mesh.py": ([0.9445, 0.379, 0.9445], 5e-3),
    "deformable_beads.py": ([0.9754, 450.4, 0.9754, 448.3, 0.869, 607.2, 0.873, 604.6, 0.534, 490.2, 0.536], 2e-3),
    "yielding.py": ([0.980, 506.6, 0.0, 0.0, 0.543, 548.9, 3.88, 60.8, 0.747, 519.8, 1.95, 35.5, 3.41, 50.7], 5e-3),
    "signal_from_file.py": ([45.4, 0.753, 460.6], 1e-2),
    "edge_from_a_tap.py": ([60.0, 4.83], 1e-2),
    "what_a_trace_shows.py": (
        [1.4, 0.24, 1.4, 0.34, 1.45, 1.4, 0.16, 1.45, 2.8, 0.17, 0.78, 2.8, 0.33, 0.29, 2.8, 0.13, 0.27],
        5e-2,
    ),
}
"""The first numbers that each prints. Those of wall.py are LAMMPS's, the layered rod's are an independent prototype's,
the signal's come from the run behind it, the others are regressions."""

QUICK = ("wall.py", "layered_rod.py", "own_structure.py", "signal_from_file.py")
"""Those that take a second or two; the others are thorough tests."""

SCRIPTS = [pytest.param(name, marks=() if name in QUICK else pytest.mark.thorough) for name in NUMBERS]


def blocks(page: str, language: str = "python") -> list[str]:
    text = (GALLERY.parent / page).read_text(encoding="utf-8")
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def test_every_example_is_listed() -> None:
    scripts = {path.name for path in GALLERY.glob("*.py")}
    assert scripts == set(NUMBERS)
    assert all(name in (GALLERY / "README.md").read_text() for name in scripts)


@pytest.mark.parametrize("name", SCRIPTS)
def test_example(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It runs with the lines that the site adds for a picture."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [name, *["1"] * (name == "tap_map.py")])  # a map of one tap
    monkeypatch.syspath_prepend(str(GALLERY.parent / "docs" / "site"))
    import gallery_pages

    script, lines = GALLERY / name, gallery_pages.RUN | gallery_pages.SLOW
    picture = lines[name.removesuffix(".py")]
    code = compile(f"{script.read_text(encoding='utf-8')}\n{picture}", str(script), "exec")
    exec(code, {"__name__": "__main__", "__file__": str(script)})
    # The site shows what pyplot holds.
    assert plt.get_fignums() or not picture
    plt.close("all")
    expected, tolerance = NUMBERS[name]
    found = [float(number) for number in re.findall(r"(?<![\w.])\d+\.\d+", capsys.readouterr().out)]
    assert found[: len(expected)] == pytest.approx(expected, rel=tolerance)


@pytest.mark.thorough
def test_an_example_is_a_script_of_its_own(tmp_path: Path) -> None:
    command = [sys.executable, str(GALLERY / "wall.py")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "incident 49.98" in done.stdout


def test_the_ten_lines_of_the_readme(capsys: pytest.CaptureFixture[str]) -> None:
    """Steel on PTFE of 25.4 mm with γ = 5: the secondary wave after 584 µs (an independent prototype)."""
    exec(blocks("README.md")[0], {})
    _, flight, error = map(float, capsys.readouterr().out.split())
    assert flight == pytest.approx(584e-6, abs=2e-6)
    assert error < 1e-6


def test_the_lines_on_mixed_chains(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """The signal's AR is that of the run behind it, 0.747, and noise."""
    monkeypatch.chdir(GALLERY.parent)
    exec(blocks("docs/python.md")[0], {})
    name, ratio = capsys.readouterr().out.splitlines()
    assert name.startswith("Hertz, elliptic contact")
    assert float(ratio) == pytest.approx(0.747, abs=0.01)


@pytest.mark.thorough
def test_the_lines_on_a_critical_distance(capsys: pytest.CaptureFixture[str]) -> None:
    """The critical distance is 14.7 mm by an independent solution of the half-plane."""
    exec(blocks("docs/python.md")[1], {})
    printed = capsys.readouterr().out
    distance = float(printed.split()[0])
    value, low, high = map(float, re.findall(r"=(0\.\d+)", printed))
    assert distance == pytest.approx(14.7e-3, abs=0.15e-3)
    assert low <= value <= high
    assert value == pytest.approx(distance, abs=0.3e-3)


@pytest.mark.thorough
def test_the_case_of_the_readme(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The same plate without Python, by the command that the page names; its numbers are those that it prints."""
    monkeypatch.chdir(tmp_path)
    Path("edge.toml").write_text(blocks("README.md", "toml")[0], encoding="utf-8")
    assert ended("run", "edge.toml") == 0
    table = Path("edge/table.txt").read_text(encoding="utf-8").splitlines()
    rows = (next(line for line in table if line.endswith(contacts)) for contacts in ("  elastic", "  fresh spot"))
    (value, low, high, _), (yielding, *_) = (map(float, re.findall(r"\d+\.\d+", row)) for row in rows)
    assert value == pytest.approx(14.7, abs=0.15)
    page = (GALLERY.parent / "README.md").read_text(encoding="utf-8")
    assert f"{value} mm, between {low} and {high}; on a fresh spot, where the metal yields, {yielding} mm" in page
