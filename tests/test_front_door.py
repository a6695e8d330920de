"""The front door: light to import, complete, and never fooled by a package of the same name."""

import subprocess
import sys
from pathlib import Path

import hertzlink as hl


def python(code: str, cwd: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, *options, "-c", code], cwd=cwd, capture_output=True, text=True)


def test_heavy_imports_are_lazy(tmp_path: Path) -> None:
    done = python("import hertzlink", tmp_path, "-X", "importtime")
    assert done.returncode == 0, done.stderr
    assert "numba" in done.stderr
    assert "pyvista" not in done.stderr
    assert "matplotlib" not in done.stderr


def test_everything_public_is_there_and_documented() -> None:
    for name in hl.__all__:
        thing = getattr(hl, name)
        assert not callable(thing) or thing.__doc__, name


def test_an_impostor_is_named(tmp_path: Path) -> None:
    (tmp_path / "plates").mkdir()
    (tmp_path / "plates" / "__init__.py").write_text("raise SystemExit('the impostor was imported')")
    done = python("import hertzlink", tmp_path)
    assert done.returncode == 1
    assert "ImportError: hertzlink needs its own package 'plates'" in done.stderr
    assert str(tmp_path / "plates") in done.stderr


def test_the_command_names_an_impostor_too(tmp_path: Path) -> None:
    (tmp_path / "structures.py").write_text("")
    done = python("from hertzlink import main; main()", tmp_path)
    assert "ImportError: hertzlink needs its own package 'structures'" in done.stderr
    assert str(tmp_path / "structures.py") in done.stderr


def test_a_folder_without_code_is_an_impostor_only_where_python_finds_it_first(tmp_path: Path) -> None:
    (tmp_path / "plates").mkdir()
    done = python("import hertzlink; print('fine')", tmp_path)
    assert done.stdout.strip() == "fine", done.stderr
