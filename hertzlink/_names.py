"""The public names and the modules that define them, read from the files that type checkers read."""

import ast
from functools import cache
from pathlib import Path
from typing import NamedTuple

HOME = Path(__file__).parent


class Place(NamedTuple):
    """Where a public name is defined, and what it is called there."""

    module: str
    name: str


def imported_by(file: Path) -> dict[str, Place]:
    """The names that a file imports, and from where."""
    lines = [line for line in ast.parse(file.read_text("utf-8")).body if isinstance(line, ast.ImportFrom)]
    return {one.asname or one.name: Place(str(line.module), one.name) for line in lines for one in line.names}


PUBLIC = imported_by(HOME / "__init__.pyi")


@cache
def namespaces() -> dict[str, dict[str, Place]]:
    """The public names of each namespace, as hertzlink.laws."""
    return {name: imported_by(HOME / f"{name}.py") for name, place in PUBLIC.items() if place.module == "hertzlink"}
