"""What the packages import is declared: an installation does not depend on what other packages happen to need."""

import ast
import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import pytest

HOME = Path(__file__).parent.parent

ROOMS = ("hertzlink", "coupling", "particles", "plates", "structures")

DECLARED_AS = {"precice": "pyprecice"}
"""Packages that need not be installed here, by the modules that they bring."""

PARTS_OF = {"vtkmodules": "pyvista"}
"""Modules whose package and version another one determines, of which they are a part."""


def imported() -> set[str]:
    """The first parts of all modules that the packages import, also where they are needed first."""
    found = set[str]()
    for room in ROOMS:
        for file in (HOME / room).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text("utf-8"))):
                if isinstance(node, ast.Import):
                    found |= {one.name.partition(".")[0] for one in node.names}
                elif isinstance(node, ast.ImportFrom) and not node.level:
                    found.add(str(node.module).partition(".")[0])
    return found - set(sys.stdlib_module_names) - {*ROOMS}


def test_what_is_imported_is_declared() -> None:
    project = tomllib.loads((HOME / "pyproject.toml").read_text("utf-8"))["project"]
    groups = [project["dependencies"], *project["optional-dependencies"].values()]
    declared = {re.split(r"[\[<>=!~ ;]", one)[0].lower() for group in groups for one in group}
    distributions, others = packages_distributions(), DECLARED_AS | PARTS_OF
    names = {one: {*map(str.lower, distributions.get(one, [])), others.get(one, one)} for one in imported()}
    assert {one: known for one, known in names.items() if not known & declared} == {}


def test_the_conda_recipe_is_of_this_version_and_asks_for_the_same_packages() -> None:
    project = tomllib.loads((HOME / "pyproject.toml").read_text("utf-8"))["project"]
    recipe = (HOME / "docs/packaging/conda/recipe.yaml").read_text("utf-8")
    assert f'\n  version: "{project["version"]}"\n' in recipe
    assert f'\n  python_min: "{project["requires-python"].removeprefix(">=")}"\n' in recipe
    run = re.findall("- (.+)", recipe.partition("\n  run:\n")[2].partition("\n\n")[0])
    names = {"matplotlib": "matplotlib-base"}  # without Qt
    wanted = [one.partition(">=") for one in project["dependencies"]]
    assert run[1:] == [f"{names.get(name, name)} >={version}" for name, _, version in wanted]


def test_nothing_else_lies_at_the_top() -> None:
    """Caches and results of trials have been committed before."""
    listed = subprocess.run(["git", "ls-files"], cwd=HOME, capture_output=True, text=True, check=False)
    if listed.returncode:
        pytest.skip("this is not a clone")
    top = {name.partition("/")[0] for name in listed.stdout.splitlines()}
    files = {"pyproject.toml", "README.md", "CHANGELOG.md", "LICENSE", "CITATION.cff", ".gitignore"}
    assert top <= {*ROOMS, *files, "tests", "benchmarks", "docs", "examples", ".ci", ".github"}
