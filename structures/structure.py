"""A structure is data: M, K, C, the contact vector, and the surface that Hertz's law needs."""

import dataclasses
from collections.abc import Callable, Mapping
from functools import cached_property, partial
from math import inf
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from structures.checks import count_of, each, finite, instance, listed, positive
from structures.described import described_as
from structures.field import Field
from structures.fineness import fineness, finer
from structures.linear_algebra.factor import Matrices, symmetric
from structures.material import Material
from structures.surface import Surface

Vector = NDArray[np.float64]

LARGEST_REMADE = 100_000  # The most unknowns of a structure that is made again with a finer mesh: 15 s of reduction


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Structure:
    """A linear elastic body M ü + C u̇ + K u = b F, loaded by a contact force F at one point or at several.

    The degrees of freedom u and the contact displacement w are measured from static equilibrium.

    Parameters
    ----------
    mass : sparse or dense matrix
        M, n × n, symmetric, kg. Rows of zeros are allowed: a degree of freedom may be massless.
    stiffness : sparse or dense matrix
        K, n × n, symmetric, N/m.
    damping : sparse or dense matrix, optional
        C, n × n, symmetric, N s/m; None for an undamped body.
    contact : numpy.ndarray
        b, n numbers, or n × p for p contacts. It spreads a unit contact force over the degrees of freedom and reads the
        displacement of the contact point, w = bᵀu + flexibility · F, positive away from the chain that pushes.
    flexibility : float or sequence of float
        Local indentation that the degrees of freedom lack, m/N, for all contacts or for each: a massless spring in
        series with Hertz's contact. It is negative if a mesh already contains part of Hertz's indentation.
    surface : Surface or sequence of Surface
        Material and curvature at the contact: one surface for all contacts, or one for each.
    origin : mapping
        How the structure was made, as plain data; it becomes an attribute of results.
    valid_until : float
        The longest run, s, for which the structure is valid; a reduced structure has a finite limit.
    field : Field, optional
        Converts degrees of freedom to displacement and stress of the body.
    matrices : Matrices, optional
        M and K with their factorisations, which structures on the same mesh share; by default made here.

    Examples
    --------
    >>> block = hl.Structure([[0.05]], [[2e6]], None, [1.0], 0.0, hl.Surface(hl.STEEL_316))  # mass on a spring
    >>> block.size, block.contacts
    (1, 1)
    """

    mass: sparse.csr_array
    stiffness: sparse.csr_array
    damping: sparse.csr_array | None
    contact: Vector
    flexibility: Any
    surface: Any
    origin: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    valid_until: float = inf
    field: Field | None = None
    matrices: Matrices = dataclasses.field(default=None, repr=False)  # type: ignore[assignment]

    again: ClassVar[Any] = None
    """A function that makes the structure again. It is not a field, so that a changed copy does not have it."""

    def __post_init__(self) -> None:
        contact = each(finite, "contact", self.contact)
        moves = contact.shape[:1] == (0,) or (contact != 0.0).any(axis=0).all()
        if contact.ndim not in (1, 2) or contact.shape[1:] == (0,) or not moves:
            raise ValueError(
                f"contact has shape {contact.shape}: must be (n,), or (n, p) for p contacts, and not be zero for any"
            )
        contact = contact if contact.shape[1:] > (1,) else contact.ravel()
        n, count = len(contact), contact.shape[1] if contact.ndim > 1 else 1

        matrices = self.matrices
        if matrices is None or matrices.mass is not self.mass or matrices.stiffness is not self.stiffness:
            matrices = Matrices(self.mass, self.stiffness)
        mass, stiffness = matrices.mass, matrices.stiffness
        damping = None if self.damping is None else symmetric("damping", self.damping)
        for name, matrix in (("mass", mass), ("stiffness", stiffness), ("damping", damping)):
            if matrix is not None and matrix.shape != (n, n):
                raise ValueError(f"{name} has shape {matrix.shape}: must be ({n}, {n}), as contact has {n} entries")
        held = stiffness.diagonal() + (0.0 if damping is None else damping.diagonal())
        if (loose := np.flatnonzero((mass.diagonal() == 0.0) & (held == 0.0))).size:
            raise ValueError(f"mass, stiffness: degree of freedom {loose[0]} must have one of them")

        flexibility, surface = self.flexibility, self.surface
        if count == 1:
            finite("flexibility", flexibility, "m/N")
            instance("surface", surface, Surface, "a Surface")
        else:
            flexibilities = each(finite, "flexibility", flexibility, "m/N")
            surface = [surface] * count if isinstance(surface, Surface) else surface
            surface = tuple(listed("surface", surface, Surface, "Surfaces, or one Surface"))
            if flexibilities.shape not in ((), (count,)) or len(surface) != count:
                raise ValueError(f"flexibility, surface: must be one for all contacts, or {count}, one for each")
            flexibility = np.broadcast_to(flexibilities, count).copy()
        until = self.valid_until if self.valid_until == inf else positive("valid_until", self.valid_until, "s")
        made = {"contact": contact, "matrices": matrices, "mass": mass, "stiffness": stiffness, "damping": damping}
        for name, value in {**made, "flexibility": flexibility, "surface": surface, "valid_until": until}.items():
            object.__setattr__(self, name, value)

    @cached_property
    def is_modal(self) -> bool:
        """True if the degrees of freedom are modes: M = I, K and C diagonal."""
        matrices = [self.mass, self.stiffness] + ([] if self.damping is None else [self.damping])
        return all(map(is_diagonal, matrices)) and bool((self.mass.diagonal() == 1.0).all())

    def made_by(self, again: Callable[[], "Structure"]) -> "Structure":
        """Return this structure and note that `again` makes it anew."""
        object.__setattr__(self, "again", again)
        object.__setattr__(self, "_made", {})
        return self

    def made_from(self, before: "Structure", change: Callable[..., "Structure"], *arguments: Any) -> "Structure":
        """Return this structure, which is `change(before, *arguments)`, and note how to make it anew."""
        return self if before.again is None else self.made_by(partial(_remade, before.again, change, arguments))

    def for_contacts(self, times: int) -> "Structure":
        """Return the structure with defaults for contacts shorter by this factor, or by as much as is possible."""
        size, made = self.origin.get("reduction", {}).get("full_size", self.size), vars(self).get("_made")
        while times > 1 and times * size > LARGEST_REMADE:
            times //= 2
        if self.again is None or made is None or times == fineness().shorter:
            return self
        if (key := (times, fineness())) not in made:
            try:
                with finer(shorter=times):
                    made[key] = self.again()
                object.__setattr__(made[key], "_made", made)
            except ValueError:  # too large, or too thick for its theory: a run warns
                made[key] = self
        return made[key]  # type: ignore[no-any-return]

    @property
    def size(self) -> int:
        """The number of degrees of freedom."""
        return int(self.contact.shape[0])

    @property
    def contacts(self) -> int:
        """The number of contact points."""
        return int(self.contact_vectors.shape[1])

    @property
    def contact_vectors(self) -> Vector:
        """The contact vectors of all K contacts, n × K, also of a single one."""
        return self.contact.reshape(self.size, self.contact.shape[1] if self.contact.ndim > 1 else 1)

    @property
    def flexibilities(self) -> Vector:
        """The flexibilities of all K contacts, m/N."""
        return np.ravel(np.asarray(self.flexibility, dtype=float))

    @property
    def surfaces(self) -> tuple[Surface, ...]:
        """The surfaces of all K contacts."""
        return surfaces_of(self)

    def __repr__(self) -> str:
        origin = self.origin
        facts = [
            str(origin.get("kind", "user's structure")),
            f"unknowns: {self.size}",
            f"contacts: {self.contacts}",
            f"damping: {'none' if self.damping is None else 'viscous'}",
        ]
        if "fixed_facets" in origin:
            facets = count_of(origin["fixed_facets"], "facet")
            facts.append(f"fixed: {origin['fixed']!r}, {facets}, {origin['fixed_area']:.4g} m²")
        if self.valid_until < inf:
            facts.append(f"reduced for: {self.valid_until:.4g} s")
        return f"Structure({', '.join(facts)})"


def _remade(again: Callable[[], Structure], change: Callable[..., Structure], arguments: tuple[Any, ...]) -> Structure:
    return change(again(), *arguments)


def oscillators(square: Vector, damping: Vector | None, contact: Vector, *others: Any) -> Structure:
    """Return a structure with M = I, K = diag(ω²), C from rates or a matrix. others: arguments after `contact`."""
    places = np.arange(square.size + 1)

    def diagonal(entries: Vector) -> sparse.csr_array:
        return sparse.csr_array((entries, places[:-1], places), shape=(square.size, square.size))

    if damping is not None:
        damping = diagonal(damping) if damping.ndim == 1 else sparse.csr_array(damping)  # type: ignore[assignment]
    return Structure(diagonal(np.ones(square.size)), diagonal(square), damping, contact, *others)  # type: ignore[arg-type]


def is_diagonal(matrix: sparse.csr_array) -> bool:
    """Return whether a matrix is diagonal, without sums of sparse matrices: they take longer than a short run."""
    rows = np.repeat(np.arange(matrix.shape[0]), np.diff(matrix.indptr))
    return bool(((matrix.indices == rows) | (matrix.data == 0.0)).all())


def known_field(structure: Structure, name: str = "structure") -> Field:
    """Return the field of a structure; raise a ValueError that says which structures have one if it has none."""
    instance(name, structure, Structure, "a Structure")
    if structure.field is not None:
        return structure.field
    lost = "lost its field in the reduction; use reduce(..., keep_field=True)"
    why = lost if "reduction" in structure.origin else "has no field; cylinders, solids and plates have one"
    raise ValueError(f"{name}: this {structure.origin.get('kind', 'structure')} {why}")


def surfaces_of(structure: Any) -> tuple[Surface, ...]:
    """Return the surfaces of all contacts of a structure or participant, also if it has a single one."""
    surface = structure.surface
    return surface if isinstance(surface, tuple) else (surface,)


@described_as(called="half-space", also=("wall",))
def half_space(material: Material) -> Structure:
    """An elastic half-space: Hertz's law contains its quasi-static indentation, and no wave returns from it.

    Parameters
    ----------
    material : Material
        The material at the contact.

    Returns
    -------
    Structure
        A structure without degrees of freedom, with one contact.

    Examples
    --------
    >>> hl.half_space(hl.STEEL_316).size
    0
    """
    none = sparse.csr_array((0, 0))
    return Structure(none, none, None, np.zeros(0), 0.0, Surface(material))
