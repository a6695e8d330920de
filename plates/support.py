"""How the edges of a plate are held."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from structures.checks import not_negative, one_of

KINDS = ("clamped", "simple", "soft simple", "free", "symmetry")
"""Ways to hold an edge other than springs."""

SHOWN = 6
"""Edges that the text of a plate shows."""


@dataclass(frozen=True)
class ElasticEdge:
    """An edge on springs. With an infinite translation stiffness it is "simple", with both infinite "clamped".

    Parameters
    ----------
    translation : float
        Force per deflection and length of the edge, N/m²; 0 or more.
    rotation : float
        Moment per slope across the edge and length of the edge, N; 0 or more.

    Raises
    ------
    ValueError
        Where a stiffness is negative or not finite.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Supports(left=hl.ElasticEdge(translation=1e7), right="clamped").left
    ElasticEdge(translation=10000000.0, rotation=0.0)
    """

    translation: float = 0.0
    rotation: float = 0.0

    def __post_init__(self) -> None:
        for name, unit in (("translation", "N/m²"), ("rotation", "N")):
            object.__setattr__(self, name, not_negative(name, getattr(self, name), unit))


Support = str | ElasticEdge


@dataclass(frozen=True)
class Supports:
    """How the edges of a rectangle are held. x runs from left to right, y from bottom to top.

    Parameters
    ----------
    left, right, bottom, top : str or ElasticEdge
        "clamped": no deflection and no slope. "simple": no deflection; in Mindlin's theory no rotation along the edge
        either. "soft simple": no deflection only; the same as "simple" in Kirchhoff's theory. "free". "symmetry": no
        slope across the edge, beyond which the plate continues as its mirror image. Or springs, an ElasticEdge.

    Raises
    ------
    ValueError
        For other kinds of edges.

    Examples
    --------
    >>> import hertzlink as hl
    >>> hl.Supports("clamped", "clamped")
    Supports(left='clamped', right='clamped', bottom='free', top='free')
    """

    left: Support = "free"
    right: Support = "free"
    bottom: Support = "free"
    top: Support = "free"

    def __post_init__(self) -> None:
        for one in fields(self):
            check_support(one.name, getattr(self, one.name))


def check_support(name: str, support: object) -> None:
    """A ValueError for an unknown way to hold an edge."""
    if not isinstance(support, ElasticEdge):
        one_of(name, support, KINDS)  # type: ignore[arg-type]


def summary(supports: Mapping[Any, Support]) -> str:
    """The supports in a few words: "left clamped, right on springs"."""
    texts = [f"{name} {'on springs' if isinstance(one, ElasticEdge) else one}" for name, one in supports.items()]
    return ", ".join(texts[:SHOWN]) + (f" and {len(texts) - SHOWN} more" if len(texts) > SHOWN else "")
