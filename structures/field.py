"""Fields of a body: displacement and stress at the points of a grid, from degrees of freedom."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Numbers = NDArray[np.float64]
Whole = NDArray[np.int64]


class Grid(NamedTuple):
    """Points and cells of a field. A point where materials meet appears once for each, because stress jumps there."""

    points: Numbers  # p × 3, m
    cells: Whole  # c × corners, in VTK's order
    kind: str  # meshio's name of their type, such as "quad9"
    part: Whole  # the number of the material of each cell
    revolution: bool  # whether the points lie in the half-plane (r, 0, −z) of a body of revolution


class Sampler(Protocol):
    """The evaluation of fields that a theory provides for a Field; displacement and stress are linear in u."""

    @property
    def grid(self) -> Grid: ...

    def displacement(self, u: Numbers) -> Numbers: ...

    def stress(self, u: Numbers) -> Numbers: ...

    def stiffness_parts(self) -> list[sparse.csr_array]: ...


@dataclass(frozen=True, eq=False)
class Field:
    """The fields of a Structure. The Sampler is built at the first evaluation and kept.

    u may have more than `size` entries: those beyond belong to Maxwell arms, not to the body.
    """

    make: Callable[[], Sampler] = field(repr=False)
    count: int  # degrees of freedom of the body
    basis: Numbers | None = field(default=None, repr=False)  # count × vectors; u holds their coefficients

    @cached_property
    def sampler(self) -> Sampler:
        """The sampler that evaluates the fields."""
        return self.make()

    @property
    def size(self) -> int:
        """The number of a structure's leading degrees of freedom that belong to the body."""
        return self.count if self.basis is None else int(self.basis.shape[1])

    @property
    def grid(self) -> Grid:
        """The points and cells of the fields."""
        return self.sampler.grid

    def displacement(self, u: Numbers) -> Numbers:
        """Return the displacement of the points from static equilibrium, p × 3, m."""
        return self.sampler.displacement(self._of_body(u))

    def stress(self, u: Numbers) -> Numbers:
        """Return the elastic stress relative to static equilibrium, p × 6, Pa: xx, yy, zz, xy, yz, xz."""
        return self.sampler.stress(self._of_body(u))

    def stiffness_parts(self) -> list[sparse.csr_array]:
        """Return the contribution of each material to the stiffness, size × size, N/m, without elastic supports."""
        parts, basis = self.sampler.stiffness_parts(), self.basis
        return parts if basis is None else [sparse.csr_array(basis.T @ (part @ basis)) for part in parts]

    def _of_body(self, u: Numbers) -> Numbers:
        values = np.asarray(u, dtype=float)
        if values.ndim != 1 or values.size < self.size:
            raise ValueError(f"u has shape {values.shape}: must be ({self.size},), the degrees of freedom at one time")
        moving = values[: self.size]
        return moving if self.basis is None else np.asarray(self.basis @ moving)


def von_mises(stress: Numbers) -> Numbers:
    """Return √(3/2 s:s) of the deviator s of stresses … × 6 (xx, yy, zz, xy, yz, xz), in their unit."""
    normal, shear = stress[..., :3], stress[..., 3:]
    deviator = normal - normal.mean(axis=-1, keepdims=True)
    return np.asarray(np.sqrt(1.5 * (deviator**2).sum(axis=-1) + 3.0 * (shear**2).sum(axis=-1)))
