"""Checks that `import hertzlink` finds its own packages. Their names are common: another project may use them too."""

from importlib.util import find_spec
from pathlib import Path

ROOMS = ("structures", "particles", "plates", "coupling")
"""The packages that hertzlink consists of, apart from its front door."""


def check() -> None:
    """Raise an ImportError if a package is missing, or if Python finds another package of the same name first."""
    home = Path(__file__).resolve().parent.parent
    for room in ROOMS:
        spec = find_spec(room)
        places = [] if spec is None else [Path(place).resolve() for place in spec.submodule_search_locations or []]
        if home / room not in places:
            location = "nothing" if spec is None else str(places[0] if places else spec.origin)
            raise ImportError(
                f"hertzlink needs its own package {room!r} from {home}, but Python finds {location}; "
                "rename that package, or remove its folder from sys.path"
            )


check()
