"""How the edges of a plate are held."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from structures.checks import not_negative, one_of

KINDS = ("clamped", "simple", "soft simple", "free", "symmetry")
"""Ways to hold an edge, besides springs."""

SHOWN = 6
"""Edges that the text of a plate shows."""


@dataclass(frozen=True)
class ElasticEdge:
    """An edge on springs: per length of it, translation in N/m² resists deflection, rotation in N resists the slope
    across it.

    Both are 0 or more; translation without end is "simple", both without end "clamped".
    """

    translation: float = 0.0
    rotation: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("translation", "N/m²"), ("rotation", "N")):
            object.__setattr__(self, name, not_negative(name, getattr(self, name), unit))


Support = str | ElasticEdge


@dataclass(frozen=True)
class Supports:
    """Edges of a rectangle: x runs from left to right, y from bottom to top, origin at the left bottom corner.

    Each edge is "clamped" (no deflection, no slope), "simple" (no deflection; in Mindlin's theory no rotation along the
    edge either), "soft simple" (no deflection only; the same as "simple" in Kirchhoff's theory), "free", "symmetry"
    (no slope across it: the plate goes on as its mirror image) or an ElasticEdge.
    """

    left: Support = "free"
    right: Support = "free"
    bottom: Support = "free"
    top: Support = "free"

    def __post_init__(self) -> None:
        for one in fields(self):
            check_support(one.name, getattr(self, one.name))


def check_support(name: str, support: object) -> None:
    """A ValueError where this is no way to hold an edge."""
    if not isinstance(support, ElasticEdge):
        one_of(name, support, KINDS)  # type: ignore[arg-type]


def summary(supports: Mapping[Any, Support]) -> str:
    """The supports in a few words: "left clamped, right on springs"."""
    texts = [f"{name} {'on springs' if isinstance(one, ElasticEdge) else one}" for name, one in supports.items()]
    return ", ".join(texts[:SHOWN]) + (f" and {len(texts) - SHOWN} more" if len(texts) > SHOWN else "")
