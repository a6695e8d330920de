"""Rods of one or more bonded layers, in the one-dimensional theory of longitudinal waves."""

from collections.abc import Sequence
from functools import partial
from math import ceil, pi
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from structures.checks import listed
from structures.described import described
from structures.fineness import fineness
from structures.material import Material
from structures.quantities import Asks, Count, OneOf, Side, Thickness
from structures.structure import Structure, Vector
from structures.surface import Surface

ELEMENT_TRAVEL_TIME = 1.0e-6
"""Time, s, that a wave needs to cross one quadratic element by default: 1/30 of the contact time of 9.5 mm steel beads.
"""

ELEMENTS_PER_WAVE = 4.0
"""Elements in the shortest wave that a mesh resolves."""

FEWEST_ELEMENTS = 8
"""In each layer, so that short layers still deform."""

LARGEST_RADIUS = 5.0
"""m. The sides of a larger body do not influence beads, and a radius given in millimetres is mostly above this value.
"""

MOST_ELEMENTS = 1_000_000
"""Upper limit for the whole rod: beyond it a wrong unit is more likely than a real need."""

STRETCHING = np.array([[7.0, 1.0, -8.0], [1.0, 7.0, -8.0], [-8.0, -8.0, 16.0]]) / 3.0
INERTIA = np.array([[4.0, -1.0, 2.0], [-1.0, 4.0, 2.0], [2.0, 2.0, 16.0]]) / 30.0
"""Of a quadratic element of unit length, axial stiffness and mass, at its ends and its middle."""

BASES = ("fixed", "free", "absorbing", "contact")


Base = Annotated[str, OneOf(*BASES, others="; cylinder takes a Foundation")]


@described
class Layer:
    """A cylinder of one material.

    Parameters
    ----------
    material : Material
        The material of the layer.
    length : float
        Length along the axis, m.
    radius : float
        Radius, m, at most 5 m.

    Raises
    ------
    ValueError
        If a length is not positive, or the radius exceeds 5 m.

    Examples
    --------
    >>> import hertzlink as hl
    >>> layer = hl.Layer(hl.PTFE, length=25.4e-3, radius=9.525e-3)
    >>> round(layer.area * 1e6, 1)  # mm²
    285.0
    """

    material: Material
    length: Side
    radius: Thickness

    def __post_init__(self) -> None:
        if self.radius > LARGEST_RADIUS:
            raise ValueError(f"radius = {self.radius!r}: must be at most {LARGEST_RADIUS:g} m; is it in millimetres?")

    @property
    def area(self) -> float:
        """Cross-sectional area π R², m²."""
        return pi * self.radius**2


Layers = Annotated[
    Sequence[Layer],
    Asks('a list of layers, such as [{ material = "PTFE", length = "25.4 mm", radius = "9.5 mm" }]'),
]


@described
def rod(
    layers: Layers,
    base: Base = "fixed",
    elements: Annotated[int, Count()] | None = None,
) -> Structure:
    """A rod of bonded layers, struck on the free face of the first layer.

    Each layer obeys E A u″ = ρ A ü; the displacement u and the axial force are continuous at the interfaces. The rod is
    discretised with quadratic line elements.

    Parameters
    ----------
    layers : sequence of Layer
        The layers; the struck one comes first.
    base : {"fixed", "free", "absorbing", "contact"}
        The condition at the far end. "free": the rod can fly off; under gravity it is held until the wave arrives.
        "absorbing": a dashpot ρ c A of the last layer lets waves leave, as in a very long rod. "contact": a free rod
        with two contacts, 0 on the face of the first layer and 1 on the face of the last one, which another chain
        strikes.
    elements : int, optional
        Number of elements in each layer. By default a wave needs 1 µs to cross an element, less for contacts below
        10 µs.

    Returns
    -------
    Structure
        The rod, one degree of freedom for each node.

    Raises
    ------
    ValueError
        If `layers` or `base` is wrong, or if more than a million elements are needed.

    Notes
    -----
    Hertz's contact law is that of a half-space. Near a soft or slender rod the contact also deforms the sides, which
    `layered_cylinder` models. The amplitude ratios of the two differ by 0.03 % for steel and 1 % for PTFE at a radius
    of 9.5 mm, and by 0.1 % and 5 % at 5 mm.

    Examples
    --------
    >>> import hertzlink as hl
    >>> steel = hl.Layer(hl.STEEL_440C, length=25.4e-3, radius=9.525e-3)
    >>> body = hl.rod([steel], base="fixed")
    >>> body.size, body.contacts
    (16, 1)
    """
    layers = listed("layers", layers, Layer, "one Layer or more, the struck one first")
    counts, owner, width = _mesh(layers, elements and fineness().cells * elements)
    nodes = _nodes(owner.size)
    size = int(nodes.max()) + 1
    axial = np.array([layer.material.youngs_modulus * layer.area for layer in layers])[owner]
    inertia = np.array([layer.material.density * layer.area for layer in layers])[owner]
    stiffness = _assembled(STRETCHING, axial / width, nodes, size)
    mass = _assembled(INERTIA, inertia * width, nodes, size)
    top, bottom = 0, owner.size
    contact = np.zeros((size, 1))
    contact[top] = 1.0
    damping: sparse.csr_array | None = None
    surfaces = [Surface(layers[0].material)]
    if base == "absorbing":
        last = layers[-1]
        impedance = last.material.density * last.material.bar_speed * last.area
        damping = sparse.csr_array(([impedance], ([bottom], [bottom])), shape=mass.shape)
    if base == "contact":
        # The second chain stands beyond the far end: away from that chain, the last face moves back into the rod.
        last_face = np.zeros(size)
        last_face[bottom] = -1.0
        contact = np.column_stack([contact, last_face])
        surfaces.append(Surface(layers[-1].material))
    if base == "fixed":
        free = np.setdiff1d(np.arange(size), [bottom])
        mass, stiffness, contact = mass[free][:, free], stiffness[free][:, free], contact[free]
    crossing = max(layer.length / layer.material.bar_speed / count for layer, count in zip(layers, counts, strict=True))
    origin = {"elements": counts, "highest_frequency": 1.0 / (ELEMENTS_PER_WAVE * crossing)}
    struck = surfaces[0] if len(surfaces) == 1 else surfaces
    made = Structure(mass, stiffness, damping, contact, 0.0, struck, origin)
    return made.made_by(partial(rod, layers, base, elements))


@described
def rod_parts(
    layers: Layers, base: Base = "fixed", elements: Annotated[int, Count()] | None = None
) -> list[sparse.csr_array]:
    """The contribution of each layer to the stiffness matrix of `rod`.

    One matrix of n × n for each layer, N/m; their sum is the stiffness of the rod. The arguments are those of `rod`.
    """
    layers = listed("layers", layers, Layer, "one Layer or more, the struck one first")
    _, owner, width = _mesh(layers, elements)
    nodes = _nodes(owner.size)
    size = int(nodes.max()) + 1
    free = np.setdiff1d(np.arange(size), [owner.size] if base == "fixed" else [])
    return [
        _assembled(STRETCHING, layer.material.youngs_modulus * layer.area / width[own], nodes[own], size)[free][:, free]
        for layer, own in ((layer, owner == i) for i, layer in enumerate(layers))
    ]


def _assembled(element: Vector, factor: Vector, nodes: NDArray[np.intp], size: int) -> sparse.csr_array:
    """Return the matrix of elements at their nodes: that of one of unit length, times the factor of each."""
    rows, columns = np.repeat(nodes, 3, axis=1), np.tile(nodes, 3)
    entries = factor[:, None] * element.ravel()
    return sparse.csr_array((entries.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size))


def _nodes(count: int) -> NDArray[np.intp]:
    """Return the nodes of each element: its ends, numbered along the rod, and its middle, numbered after all ends."""
    first = np.arange(count)
    return np.column_stack([first, first + 1, count + 1 + first])


def _mesh(layers: list[Layer], elements: int | None) -> tuple[list[int], NDArray[np.intp], Vector]:
    """Return the number of elements in each layer, the layer of each element, and its length, m."""
    travel_time = ELEMENT_TRAVEL_TIME / fineness().shorter
    travels = [ceil(layer.length / (layer.material.bar_speed * travel_time)) for layer in layers]
    usual = [fineness().cells * max(FEWEST_ELEMENTS, travel) for travel in travels]
    counts = usual if elements is None else [elements] * len(layers)
    if sum(counts) > MOST_ELEMENTS:
        raise ValueError(
            f"elements: {float(sum(counts)):.10g} are too many; use at most {MOST_ELEMENTS}, or shorter layers"
        )
    widths = [layer.length / count for layer, count in zip(layers, counts, strict=True)]
    return counts, np.repeat(np.arange(len(layers)), counts), np.repeat(widths, counts)
