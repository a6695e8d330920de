"""The front door: light to import, complete, and never fooled by a package of the same name."""

import ast
import os
import pickle
import re
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import pytest

import hertzlink as hl
from hertzlink._names import namespaces


def python(code: str, cwd: Path, *options: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, *options, "-c", code], cwd=cwd, capture_output=True, text=True)


HEAVY = [
    "distributed", "h5py", "joblib", "matplotlib", "meshio", "pyvista", "scipy.integrate", "scipy.interpolate",
    "scipy.optimize", "scipy.signal", "scipy.spatial", "scipy.stats", "tqdm",
]  # fmt: skip
"""Modules that take long to import and serve only some users; pandas is missing because xarray imports it."""


def loaded_by(code: str, names: list[str], cwd: Path) -> list[str]:
    """The modules of this list that a new process has imported once the code has run."""
    done = python(f"import sys\n{code}\nprint([name for name in {names} if name in sys.modules])", cwd, "-W", "ignore")
    assert done.returncode == 0, done.stderr
    return list(ast.literal_eval(done.stdout.splitlines()[-1]))


def test_the_import_alone_loads_nothing_heavy(tmp_path: Path) -> None:
    more = ["numpy", "skfem", "scipy", "numba", "xarray", "pandas", "coupling.cosimulation", "particles.kernels"]
    assert loaded_by("import hertzlink; dir(hertzlink)", [*HEAVY, *more], tmp_path) == []


def test_a_run_on_a_half_space_loads_only_what_it_uses(tmp_path: Path) -> None:
    code = """
import hertzlink as hl
bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
chain = hl.Chain([bead] * 12, striker=bead, impact_speed=0.1)
run = hl.CoSimulation(chain, hl.half_space(hl.STEEL_440C)).run(until=8e-4)
print(hl.sensor_force(run, sensor=6).max().item())
"""
    assert loaded_by(code, HEAVY, tmp_path) == []


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


def test_only_public_names_are_listed() -> None:
    assert dir(hl) == sorted(hl.__all__)
    assert hl.__version__ == version("hertzlink")
    assert len(hl.__all__) - len(namespaces()) + sum(map(len, namespaces().values())) <= 183


def test_public_objects_survive_pickling() -> None:
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    for thing in (bead, hl.Sphere, hl.sweep, hl.theory.hertz_pressure, hl.damping.Modal(0.02)):
        assert pickle.loads(pickle.dumps(thing)) == thing


@pytest.mark.parametrize(
    ("name", "hint"),
    [
        ("Spear", "; did you mean hertzlink.Sphere?"),
        ("chain", "; did you mean hertzlink.Chain?"),
        ("Cosimulation", "; did you mean hertzlink.CoSimulation?"),
        ("thornton", "; did you mean hertzlink.laws.Thornton?"),
        ("powerlaw", "; did you mean hertzlink.laws.PowerLaw?"),
        ("hertz_presure", "; did you mean hertzlink.theory.hertz_pressure?"),
        ("Zzyzx", ""),
    ],
)
def test_a_name_that_never_was_gets_the_nearest_one(name: str, hint: str) -> None:
    with pytest.raises(AttributeError, match=re.escape(f"module 'hertzlink' has no attribute {name!r}{hint}") + "$"):
        getattr(hl, name)
    assert not hasattr(hl, name)
    with pytest.raises(ImportError, match=f"cannot import name {name!r} from 'hertzlink'"):
        exec(f"from hertzlink import {name}")


def test_python_adds_no_other_name(tmp_path: Path) -> None:
    """Otherwise Python would suggest a name of the module itself, such as `plates` for `Plates`."""
    done = python("import hertzlink as hl; hl.Plates", tmp_path)
    assert done.stderr.count("id you mean") == 1, done.stderr


@pytest.mark.thorough
def test_the_module_is_the_command(tmp_path: Path) -> None:
    done = subprocess.run([sys.executable, "-m", "hertzlink", "info"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "hertzlink" in done.stdout


THREADS = """
import os
from hertzlink import __main__, cli
cli.main = lambda arguments: print(os.environ["OPENBLAS_NUM_THREADS"])
__main__.main()
"""


@pytest.mark.parametrize(("given", "found"), [(None, "1"), pytest.param("3", "3", marks=pytest.mark.thorough)])
def test_the_command_takes_one_thread_of_linear_algebra(given: str | None, found: str, tmp_path: Path) -> None:
    """It takes more if the user says so."""
    environment = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    environment |= {} if given is None else {"OPENBLAS_NUM_THREADS": given}
    done = subprocess.run(
        [sys.executable, "-c", THREADS], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == [found]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs a device that is always full")
def test_a_full_disk_under_what_is_printed_is_said_in_words() -> None:
    with open("/dev/full", "w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "hertzlink", "info"], stdout=full, stderr=subprocess.PIPE, text=True, check=False
        )
    assert (done.returncode, done.stderr) == (2, "hertzlink: standard output: No space left on device\n")
