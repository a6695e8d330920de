"""How the four edges of a rectangular plate are held."""

from dataclasses import asdict, dataclass

from structures.checks import one_of

KINDS = ("clamped", "simple", "free")


@dataclass(frozen=True)
class Supports:
    """Edges of a rectangle: x runs from left to right, y from bottom to top, origin at the left bottom corner.

    Each edge is "clamped" (no deflection, no slope), "simple" (no deflection) or "free".
    """

    left: str = "free"
    right: str = "free"
    bottom: str = "free"
    top: str = "free"

    def __post_init__(self) -> None:
        for edge, kind in asdict(self).items():
            one_of(edge, kind, KINDS)
