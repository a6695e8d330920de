"""Supports of the edges of a plate."""

from typing import Annotated

from structures.described import described, described_as
from structures.quantities import Asks, OneOf, Quantity

KINDS = ("clamped", "simple", "soft simple", "free", "symmetry")  # Supports of an edge that are not springs


@described
class ElasticEdge:
    """An edge on springs. An infinite translation stiffness makes it "simple"; if both are infinite it is "clamped".

    Parameters
    ----------
    translation : float
        Force per deflection and length of the edge, N/m²; zero or more.
    rotation : float
        Moment per slope across the edge and length of the edge, N; zero or more.

    Examples
    --------
    >>> hl.Supports(left=hl.ElasticEdge(translation=1e7), right="clamped").left
    ElasticEdge(translation=10000000.0, rotation=0.0)
    """

    translation: Annotated[float, Quantity("N/m²", "a stiffness of an edge", "1e7 N/m^2", or_zero=True)] = 0.0
    rotation: Annotated[float, Quantity("N", "a force", "2 N", or_zero=True)] = 0.0


Support = Annotated[str, OneOf(*KINDS)] | ElasticEdge
Edge = Annotated[Support, Asks('"clamped", "simple", "free", "symmetry", or { translation = "1e7 N/m^2" }')]


@described_as("Supports(left=, right=, bottom=, top=)")
class Supports:
    """The supports of the edges of a rectangle. x runs from left to right, y from bottom to top.

    Parameters
    ----------
    left, right, bottom, top : str or ElasticEdge
        "clamped": no deflection and no slope. "simple": no deflection; in Mindlin's theory also no rotation along the
        edge. "soft simple": only no deflection. "free": no support. "symmetry": no slope across the edge, beyond which
        the plate continues as its mirror image. An ElasticEdge: springs.

    Examples
    --------
    >>> hl.Supports("clamped", "clamped")
    Supports(left='clamped', right='clamped', bottom='free', top='free')
    """

    left: Edge = "free"
    right: Edge = "free"
    bottom: Edge = "free"
    top: Edge = "free"
