"""The public names and where they are defined, read from the files of type checkers; and the packages of hertzlink.

Their names are common: another project may use them too. So an import of hertzlink first checks that it finds its own.
"""

import ast
from functools import cache
from importlib.util import find_spec
from pathlib import Path

HOME = Path(__file__).parent

ROOMS = ("structures", "particles", "plates", "coupling")
"""The packages that hertzlink consists of, apart from its front door."""


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


for room in ROOMS:
    spec = find_spec(room)
    places = [] if spec is None else [Path(place).resolve() for place in spec.submodule_search_locations or []]
    if HOME.resolve().parent / room not in places:
        location = "nothing" if spec is None else str(places[0] if places else spec.origin)
        raise ImportError(
            f"hertzlink needs its own package {room!r} from {HOME.resolve().parent}, but Python finds {location}; "
            "rename that package, or remove its folder from sys.path"
        )

PUBLIC = listed_in(HOME / "__init__.pyi")


@cache
def namespaces() -> dict[str, list[str]]:
    """Return the public names of each namespace, as hertzlink.laws."""
    return {name: [*listed_in(HOME / f"{name}.py")] for name, module in PUBLIC.items() if module == "hertzlink"}
