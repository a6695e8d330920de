"""What turns degrees of freedom into fields: where they lie in the body, its displacement and its stress there."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Numbers = NDArray[np.float64]
Whole = NDArray[np.int64]


class Grid(NamedTuple):
    """The points and cells that a field is drawn on.

    points: p × 3, m. Points where two materials meet are there twice, once for each, since stress jumps there.
    cells: c × corners, in VTK's order. kind: meshio's name of their type, such as "quad9".
    part: the number of the material of each cell. revolution: whether the points lie in the half-plane (r, 0, −z) of a
    body of revolution.
    """

    points: Numbers
    cells: Whole
    kind: str
    part: Whole
    revolution: bool


class Sampler(Protocol):
    """What a theory knows of its body: the grid, and displacement and stress at its points. Both are linear."""

    @property
    def grid(self) -> Grid:
        """Where displacement and stress are told."""
        ...

    def displacement(self, u: Numbers) -> Numbers:
        """p × 3, m; u: the body's degrees of freedom."""
        ...

    def stress(self, u: Numbers) -> Numbers:
        """p × 6, Pa: xx, yy, zz, xy, yz, xz."""
        ...

    def stiffness_parts(self) -> list[sparse.csr_array]:
        """What each layer, or each material, adds to the stiffness."""
        ...


@dataclass(frozen=True, eq=False)
class Field:
    """The fields of a Structure. Costs nothing until it is asked; then it keeps its Sampler.

    make: returns the Sampler. count: of the body's degrees of freedom. basis: count × vectors, of a reduced structure,
    whose u are the factors of the vectors. u may be longer than `size`: what follows is not the body's (Maxwell arms).
    """

    make: Callable[[], Sampler] = field(repr=False)
    count: int
    basis: Numbers | None = field(default=None, repr=False)

    @property
    def size(self) -> int:
        """How many of a structure's first degrees of freedom belong to the body."""
        return self.count if self.basis is None else int(self.basis.shape[1])

    @property
    def grid(self) -> Grid:
        """The points and cells that the fields belong to."""
        return self._sampler.grid

    def displacement(self, u: Numbers) -> Numbers:
        """Displacement of the points from static equilibrium, p × 3, m."""
        return self._sampler.displacement(self._full(u))

    def stress(self, u: Numbers) -> Numbers:
        """Stress above static equilibrium, p × 6, Pa: xx, yy, zz, xy, yz, xz.

        The mean of the cells of one material that meet at a point. Springs' alone, of the moduli that the structure
        was made with: without what dashpots and Maxwell arms bear.
        """
        return self._sampler.stress(self._full(u))

    def von_mises(self, u: Numbers) -> Numbers:
        """Von Mises' equivalent of `stress`, p, Pa."""
        return von_mises(self.stress(u))

    def stiffness_parts(self) -> list[sparse.csr_array]:
        """What each layer, or each material, adds to the stiffness, size × size, N/m; supports that give apart."""
        parts, basis = self._sampler.stiffness_parts(), self.basis
        return parts if basis is None else [sparse.csr_array(basis.T @ (part @ basis)) for part in parts]

    def in_basis(self, vectors: Numbers) -> "Field":
        """The fields of a structure reduced to these vectors, size × their number."""
        if vectors.shape[0] != self.size:
            raise ValueError(f"vectors: have shape {vectors.shape}, must have {self.size} rows")
        return replace(self, basis=vectors if self.basis is None else self.basis @ vectors)

    def _full(self, u: Numbers) -> Numbers:
        values = np.asarray(u, dtype=float)
        if values.ndim != 1 or values.size < self.size:
            raise ValueError(
                f"u has shape {values.shape}: must be ({self.size},), the degrees of freedom of one moment"
            )
        own = values[: self.size]
        return own if self.basis is None else np.asarray(self.basis @ own)

    @cached_property
    def _sampler(self) -> Sampler:
        return self.make()


def von_mises(stress: Numbers) -> Numbers:
    """√(3/2 s:s) of the deviator s of stresses … × 6 (xx, yy, zz, xy, yz, xz), in their unit."""
    normal, shear = stress[..., :3], stress[..., 3:]
    deviator = normal - normal.mean(axis=-1, keepdims=True)
    return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=-1) + 3.0 * (shear**2).sum(axis=-1)))
