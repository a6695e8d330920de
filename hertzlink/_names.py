"""The public names and the modules that define them, read from the files that type checkers read."""

import ast
from functools import cache
from pathlib import Path

HOME = Path(__file__).parent


def listed_in(file: Path) -> dict[str, str]:
    """Return the names that a file imports or assigns, each with the module from which it is imported."""
    names = dict[str, str]()
    for line in ast.parse(file.read_text("utf-8")).body:
        if isinstance(line, ast.ImportFrom):
            names |= {str(alias.asname): str(line.module) for alias in line.names}
        elif isinstance(line, ast.Assign):
            names |= {target.id: "" for target in line.targets if isinstance(target, ast.Name)}
    return {name: module for name, module in names.items() if not name.startswith("_")}


PUBLIC = listed_in(HOME / "__init__.pyi")


@cache
def namespaces() -> dict[str, list[str]]:
    """Return the public names of each namespace, as hertzlink.laws."""
    return {name: [*listed_in(HOME / f"{name}.py")] for name, module in PUBLIC.items() if module == "hertzlink"}
