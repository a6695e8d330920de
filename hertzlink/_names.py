"""The public names and the modules that define them, read from the files that type checkers read."""

import ast
from functools import cache
from pathlib import Path

HOME = Path(__file__).parent


def listed_in(file: Path) -> dict[str, str]:
    """Return the public names of a file, `__all__` or what it imports and assigns, with the modules they come from."""
    names = dict[str, str]()
    for line in ast.parse(file.read_text("utf-8")).body:
        if isinstance(line, ast.ImportFrom):
            names |= {str(alias.asname): str(line.module) for alias in line.names}
        elif isinstance(line, ast.Assign) and isinstance(line.targets[0], ast.Name):
            if line.targets[0].id == "__all__":
                return dict.fromkeys(ast.literal_eval(line.value), "")
            names[line.targets[0].id] = ""
    return {name: module for name, module in names.items() if not name.startswith("_")}


PUBLIC = listed_in(HOME / "__init__.pyi")


@cache
def namespaces() -> dict[str, list[str]]:
    """Return the public names of each namespace, as hertzlink.laws."""
    return {name: [*listed_in(HOME / f"{name}.py")] for name, module in PUBLIC.items() if module == "hertzlink"}
