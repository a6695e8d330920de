"""Checks that `import hertzlink` finds its own packages. Their names are common: another project may use them too."""

from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from inspect import isclass, isfunction
from pathlib import Path
from types import ModuleType

ROOMS = ("structures", "particles", "plates", "coupling")
"""The packages that hertzlink consists of, apart from its front door."""

PACKAGE = "hertzlink"
"""The front door, whose namespaces already carry its name."""


def check() -> None:
    """Raise an ImportError if a package is missing, or if Python finds another package of the same name first."""
    home = Path(__file__).resolve().parent.parent
    for room in ROOMS:
        spec = find_spec(room)
        places = [] if spec is None else [Path(place).resolve() for place in spec.submodule_search_locations or []]
        if home / room not in places:
            found = "nothing" if spec is None else str(places[0] if places else spec.origin)
            raise ImportError(
                f"hertzlink needs its own package {room!r} from {home}, but Python finds {found}; "
                "rename that package, or remove its folder from sys.path"
            )


def rename(front: Mapping[str, object], names: Iterable[str]) -> None:
    """Set the module of public classes and functions to hertzlink, for pickles, tracebacks and help."""
    for name in names:
        value = front[name]
        if isinstance(value, ModuleType):
            rename(vars(value), vars(value)["__all__"])
        elif (
            (isclass(value) or isfunction(value))
            and value.__name__ == name
            and not value.__module__.startswith(PACKAGE)
        ):
            value.__module__ = str(front["__name__"])


check()
