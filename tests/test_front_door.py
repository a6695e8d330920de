"""The front door: light to import, complete, and never fooled by a package of the same name."""

import pickle
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

import pytest

import hertzlink as hl
from hertzlink._moved import MOVED


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
    done = python("from hertzlink.cli import main; main()", tmp_path)
    assert "ImportError: hertzlink needs its own package 'structures'" in done.stderr
    assert str(tmp_path / "structures.py") in done.stderr


@pytest.mark.thorough
def test_a_folder_without_code_is_an_impostor_only_where_python_finds_it_first(tmp_path: Path) -> None:
    (tmp_path / "plates").mkdir()
    done = python("import hertzlink; print('fine')", tmp_path)
    assert done.stdout.strip() == "fine", done.stderr


def test_only_public_names_are_listed() -> None:
    assert dir(hl) == sorted(hl.__all__)
    assert hl.__version__ == version("hertzlink")
    assert len(hl.__all__) <= 100


def test_public_names_belong_to_hertzlink() -> None:
    """In what a user reads, and in pickles, which then survive another layout of the rooms."""
    assert str(hl.CoSimulation) == "<class 'hertzlink.CoSimulation'>"
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    text = pickle.dumps(bead, protocol=0)
    assert pickle.loads(text) == bead
    assert b"chertzlink\nSphere" in text
    for name in ("reduce", "sweep", "amplitude_ratio"):
        assert getattr(hl, name).__module__ == "hertzlink"
    assert hl.lamb.group_speed.__module__ == "hertzlink.lamb"
    assert pickle.loads(pickle.dumps(hl.lamb.group_speed)) is hl.lamb.group_speed


@pytest.mark.parametrize("name", MOVED)
def test_a_name_that_moved_is_named_with_its_new_place(name: str) -> None:
    with pytest.raises(AttributeError, match=re.escape(f"'{name}'; it is now hertzlink.{MOVED[name]}")):
        getattr(hl, name)
    value: object = hl
    for part in MOVED[name].split("."):
        value = getattr(value, part)
    assert not isinstance(value, ModuleType)


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("Spear", "; did you mean hertzlink.Sphere?"),
        ("chain", "; did you mean hertzlink.Chain?"),
        ("Cosimulation", "; did you mean hertzlink.CoSimulation?"),
        ("axisymmetric", "; did you mean hertzlink.laws.axisymmetric?"),
        ("powerlaw", "; did you mean hertzlink.laws.PowerLaw?"),
        ("hertz_presure", "; did you mean hertzlink.hertz.pressure?"),
        ("Zzyzx", ""),
    ],
)
def test_a_name_that_never_was_gets_the_nearest_one(name: str, hint: str) -> None:
    with pytest.raises(AttributeError, match=re.escape(f"module 'hertzlink' has no attribute {name!r}{hint}") + "$"):
        getattr(hl, name)
    assert not hasattr(hl, name)
    with pytest.raises(ImportError, match=re.escape(f"cannot import name {name!r} from 'hertzlink'{hint}") + "$"):
        exec(f"from hertzlink import {name}")


def test_python_adds_no_other_name(tmp_path: Path) -> None:
    """Python suggests a name of the module itself, as `plates` for `Plates`, beside ours."""
    done = python("import hertzlink as hl; hl.Plates", tmp_path)
    assert done.stderr.count("id you mean") == 1, done.stderr


@pytest.mark.parametrize("name", MOVED)
def test_an_import_of_a_name_that_moved_is_named_with_its_new_place(name: str) -> None:
    message = f"cannot import name '{name}' from 'hertzlink'; it is now hertzlink.{MOVED[name]}"
    with pytest.raises(ImportError, match=re.escape(message) + "$"):
        exec(f"from hertzlink import {name}")


@pytest.mark.thorough
def test_modules_are_still_imported_by_name(tmp_path: Path) -> None:
    done = python("from hertzlink import cli, studies, Sphere, laws; import hertzlink._moved", tmp_path)
    assert done.returncode == 0, done.stderr


def test_the_module_is_the_command(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-m", "hertzlink", "info"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "hertzlink" in done.stdout
