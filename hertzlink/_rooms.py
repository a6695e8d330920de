"""The rooms have common names: an import of hertzlink must find its own, not another project's package."""

from collections.abc import Iterable, Mapping
from importlib.util import find_spec
from inspect import isclass, isfunction
from pathlib import Path
from types import ModuleType

ROOMS = ("structures", "particles", "plates", "coupling")

PACKAGE = "hertzlink"


def check() -> None:
    """An ImportError where a room is missing, or where Python finds another package of its name first."""
    home = Path(__file__).resolve().parent.parent
    for room in ROOMS:
        spec = find_spec(room)
        places = [] if spec is None else [Path(place).resolve() for place in spec.submodule_search_locations or []]
        if home / room not in places:
            found = "nothing" if spec is None else str(places[0] if places else spec.origin)
            raise ImportError(
                f"hertzlink needs its own package {room!r} from {home}, but Python finds {found}; "
                "rename that one, or take its folder off the path"
            )


def rename(front: Mapping[str, object], names: Iterable[str]) -> None:
    """Let public classes and functions say that they belong to hertzlink: in pickles, tracebacks and help."""
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
