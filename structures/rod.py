"""Rods of one or more bonded layers, in the one-dimensional theory of longitudinal waves."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import ceil, pi
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import Basis, BilinearForm, ElementLineP2, MeshLine

from structures.checks import instance, listed, one_of, positive, whole
from structures.material import Material
from structures.plausible import likely
from structures.structure import Structure
from structures.surface import Surface

ELEMENT_TRAVEL_TIME = 1.0e-6
"""Time, s, in which a wave crosses one quadratic element by default: a thirtieth of the contact of 9.5 mm beads."""

FEWEST_ELEMENTS = 8

LARGEST_RADIUS = 5.0
"""m. Beads do not feel the sides of larger bodies; radii in millimetres are mostly above it."""

MOST_ELEMENTS = 1_000_000
"""Of the whole rod."""

BASES = ("fixed", "free", "absorbing", "contact")


@dataclass(frozen=True)
class Layer:
    """A cylinder of one material; length along the axis and radius in m."""

    material: Material
    length: float
    radius: float

    def __post_init__(self) -> None:
        instance("material", self.material, Material, "a Material; MATERIALS[name] gives one by name")
        object.__setattr__(self, "length", positive("length", self.length, "m"))
        object.__setattr__(self, "radius", positive("radius", self.radius, "m"))
        if self.radius > LARGEST_RADIUS:
            raise ValueError(f"radius = {self.radius!r}: must be at most {LARGEST_RADIUS:g} m; is it in millimetres?")
        likely("side", "Layer", "length", self.length)
        likely("thickness", "Layer", "radius", self.radius)

    @property
    def area(self) -> float:
        """Cross-section π R², m²."""
        return pi * self.radius**2


def rod(layers: Sequence[Layer], base: str = "fixed", elements: int | None = None) -> Structure:
    """A rod of bonded layers, struck on the free face of the first.

    E A u″ = ρ A ü in each layer, with quadratic line elements; u and the axial force are continuous.
    base: "fixed"; "free", where the rod may fly off (under gravity it is held up until the wave comes); or
    "absorbing", a dashpot ρ c A of the last layer, which lets a wave out as a very long rod would; or "contact", a free
    rod with two contacts, 0 on the first layer's face and 1 on the last one's, which another chain strikes.
    elements: the number in each layer; by default a wave takes ELEMENT_TRAVEL_TIME to cross one.
    Hertz's contact is that of a half-space, though it sees the side of a soft or slender rod: there the amplitude ratio
    differs from that of `cylinder` (steel of 9.5 mm radius 0.03 %, PTFE 1 %; of 5 mm 0.1 and 5 %).
    """
    layers = listed("layers", layers, Layer, "one Layer or more, the struck one first")
    _check_base(base)
    counts, basis, owner = _mesh(layers, elements)
    per_point = np.ones_like(basis.dx)
    axial = np.array([layer.material.youngs_modulus * layer.area for layer in layers])[owner, None] * per_point
    inertia = np.array([layer.material.density * layer.area for layer in layers])[owner, None] * per_point

    stiffness = sparse.csr_array(_stretching.assemble(basis, coefficient=axial))
    mass = sparse.csr_array(_inertia.assemble(basis, coefficient=inertia))
    top, bottom = basis.nodal_dofs[0, [0, -1]]
    contact = np.zeros(basis.N)
    contact[top] = 1.0
    damping: sparse.csr_array | None = None
    surface: Any = Surface(layers[0].material)
    if base == "absorbing":
        last = layers[-1]
        impedance = last.material.density * last.material.bar_speed * last.area
        damping = sparse.csr_array(([impedance], ([bottom], [bottom])), shape=mass.shape)
    if base == "contact":
        # Away from its chain, which stands beyond the end, the last face moves back into the rod.
        last_face = np.zeros(basis.N)
        last_face[bottom] = -1.0
        contact, surface = np.column_stack([contact, last_face]), (surface, Surface(layers[-1].material))
    if base == "fixed":
        kept = np.setdiff1d(np.arange(basis.N), [bottom])
        mass, stiffness, contact = mass[kept][:, kept], stiffness[kept][:, kept], contact[kept]
    origin = {"kind": "rod", "base": base, "elements": counts, "layers": [asdict(layer) for layer in layers]}
    return Structure(mass, stiffness, damping, contact, 0.0, surface, origin)


def rod_parts(layers: Sequence[Layer], base: str = "fixed", elements: int | None = None) -> list[sparse.csr_array]:
    """What each layer adds to the stiffness of rod(layers, base, elements); the sum is its stiffness, N/m.

    With it a layer gets damping of its own: standard_linear_solid(rod(layers), share, time, part=rod_parts(layers)[1]).
    """
    layers = listed("layers", layers, Layer, "one Layer or more, the struck one first")
    _check_base(base)
    _, basis, owner = _mesh(layers, elements)
    kept = np.arange(basis.N)
    if base == "fixed":
        kept = np.setdiff1d(kept, basis.nodal_dofs[0, -1])
    parts = []
    for i, layer in enumerate(layers):
        axial = layer.material.youngs_modulus * layer.area * (owner == i)[:, None] * np.ones_like(basis.dx)
        parts.append(sparse.csr_array(_stretching.assemble(basis, coefficient=axial))[kept][:, kept])
        parts[-1].eliminate_zeros()
    return parts


def _check_base(base: object) -> None:
    if isinstance(base, str):
        one_of("base", base, BASES)
    else:
        raise ValueError(f"base = {base!r}: must be one of {', '.join(map(repr, BASES))}; cylinder takes a Foundation")


def _mesh(layers: list[Layer], elements: int | None) -> tuple[list[int], Basis, NDArray[np.intp]]:
    """The number of elements in each layer, their basis, and the layer that owns each."""
    counts = [_count(layer) if elements is None else whole("elements", elements) for layer in layers]
    if sum(counts) > MOST_ELEMENTS:
        raise ValueError(f"elements: {sum(counts)} are too many; at most {MOST_ELEMENTS} fit, or take shorter layers")
    faces = np.concatenate([[0.0], np.cumsum([layer.length for layer in layers])])
    nodes = [np.linspace(faces[i], faces[i + 1], count + 1)[:-1] for i, count in enumerate(counts)]
    basis = Basis(MeshLine(np.append(np.concatenate(nodes), faces[-1])), ElementLineP2())
    owner = np.searchsorted(faces, basis.mesh.p[0, basis.mesh.t].mean(axis=0)) - 1
    return counts, basis, owner


def _count(layer: Layer) -> int:
    return max(FEWEST_ELEMENTS, ceil(layer.length / (layer.material.bar_speed * ELEMENT_TRAVEL_TIME)))


@BilinearForm
def _stretching(u: Any, v: Any, w: Any) -> Any:
    return w.coefficient * u.grad[0] * v.grad[0]


@BilinearForm
def _inertia(u: Any, v: Any, w: Any) -> Any:
    return w.coefficient * u * v
