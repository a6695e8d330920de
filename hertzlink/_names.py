"""The public names: where they are defined, by the imports in `__init__.pyi` and in the namespaces.

What is public gets the module and name that a user types as soon as its module is loaded: in signatures, messages and
pickles.
"""

import ast
import sys
from functools import cache, partial
from importlib import import_module
from importlib.util import LazyLoader, find_spec, module_from_spec
from pathlib import Path
from typing import NamedTuple

PACKAGE = "hertzlink"
"""The package of all public names, whichever room defines them."""

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
    return {name: imported_by(HOME / f"{name}.py") for name, place in PUBLIC.items() if place.module == PACKAGE}


@cache
def _unnamed() -> dict[tuple[str, str], Place]:
    """What still has the name of the place where it is defined, by the package and the name that users type."""
    inner = {(f"{PACKAGE}.{space}", name): place for space, own in namespaces().items() for name, place in own.items()}
    return inner | {(PACKAGE, name): place for name, place in PUBLIC.items() if place.module != PACKAGE}


def load(name: str) -> object:
    """What a public name means, with hints for its users, and names for users for all that was loaded with it."""
    from hertzlink._help import for_users

    place = PUBLIC[name]
    value: object = import_module(f"{place.module}.{name}" if place.module == PACKAGE else place.module)
    name_loaded()
    if place.module != PACKAGE:
        return for_users(getattr(value, place.name), PACKAGE, name)
    names = vars(value)
    names.update({inner: for_users(names[inner], f"{PACKAGE}.{name}", inner) for inner in namespaces()[name]})
    names["__getattr__"] = partial(_no_such_name, space=name)
    return value


def _no_such_name(name: str, space: str) -> object:
    from hertzlink._moved import missing

    raise missing(name, space)


def name_loaded() -> None:
    """Give each public class that is loaded the module and name that a user types, and readable signatures."""
    from hertzlink._help import name_class

    for public, place in list(_unnamed().items()):
        loaded = vars(sys.modules[place.module]) if place.module in sys.modules else {}
        if place.name in loaded:
            name_class(loaded[place.name], *public)
            _unnamed().pop(public, None)
            _stand_in(public[0])


def _stand_in(module: str) -> None:
    """A module that is loaded when one of its names is used: pickles look up what is named after it there."""
    if module in sys.modules:
        return
    spec = find_spec(module)
    assert spec is not None
    assert spec.loader is not None
    spec.loader = LazyLoader(spec.loader)
    sys.modules[module] = module_from_spec(spec)
    spec.loader.exec_module(sys.modules[module])
