"""Spherical shells under pressure, such as balls: axisymmetric linear elasticity of a stressed wall."""

from dataclasses import replace
from functools import partial
from itertools import pairwise
from math import inf, pi, sqrt
from typing import Annotated, Any

import numpy as np
from scipy import sparse
from skfem import Basis, ElementQuad0, ElementQuad2, ElementVector, FacetBasis, MeshQuad, MeshQuad2

from structures.bodies.elastic_field import elastic_field
from structures.bodies.elasticity import HIGHEST_FREQUENCY, body_matrices, patch_compliance, patch_vector, shear_speed
from structures.bodies.patch_mesh import CELL_GROWTH, DEFAULT_CELLS, PATCH_DIVISOR, about_patch, check_size, graded
from structures.bodies.pressure import AIR, ATMOSPHERE, following_stiffness, ring_openings, stress_stiffness, with_gas
from structures.bodies.thin_sphere import sizes
from structures.caution import caution
from structures.checks import positive
from structures.described import described_as
from structures.linear_algebra.buckling import buckling_factor, check_buckling
from structures.material import Material, check_stress
from structures.quantities import Asks, Count, Frequency, Length, Likely, OneOf, Pressure, Quantity
from structures.structure import Structure, Vector
from structures.surface import Surface
from structures.units import readable

BASES = ("fixed", "free", "contact")

PATCH_IN_WALL = 4.0
"""The default radius of the patch is at most the thickness, divided by this number. Under half of this patch the shell
is 0.2 to 0.7 % softer; beads touch thin or soft walls over a circle of about this size."""

SEAT = pi / 6.0
"""rad: the default half-angle of the seat."""

WIDEST_CELL = pi / 15.0
"""rad: the largest angle between nodes, so that quadratic cells follow the arc."""

INTEGRATION_ORDER = 6
"""Cells that follow the arc are no polynomials; two orders more change frequencies by less than 1e-9."""

NEWTON = 1e-9
"""Where scikit-fem stops to look for a point of a cell, in units of the cell. Its own 1e-12 is below the rounding of
points on thin walls; the iteration is quadratic, so that the point is as good."""

SeatAngle = Annotated[float, Quantity("rad", "an angle", "45 deg", -inf)]

AmbientPressure = Annotated[float, replace(Likely.PRESSURE, low=0.0, or_zero=True, high=1e9)]
"""At most ten times the pressure at the bottom of the sea. No gas has a ratio of its heat capacities above 5/3."""

LARGE_STRETCH = 0.1
"""Hoop strain above which geometry and modulus under pressure differ clearly from those without."""


@described_as(called="spherical shell")
def spherical_shell(
    radius: Length,
    thickness: Length,
    material: Material,
    pressure: Pressure = 0.0,
    base: Annotated[str, OneOf(*BASES)] = "fixed",
    seat: Annotated[SeatAngle, Asks("half-angle of the part that is held, seen from the centre")] = SEAT,
    ambient: Annotated[AmbientPressure, Asks("pressure outside; by default that of the atmosphere")] = ATMOSPHERE,
    heat_capacity_ratio: Annotated[float, Quantity(or_zero=True, high=5.0)] = AIR,
    patch_radius: Length | None = None,
    highest_frequency: Frequency = HIGHEST_FREQUENCY,
    cells: Annotated[int, Count()] = DEFAULT_CELLS,
) -> Structure:
    """A hollow sphere filled with gas, struck at a pole, such as a tennis ball or a pressure vessel.

    Axisymmetric linear elasticity of the wall, quadratic elements graded towards the contact. The pressure stresses the
    wall before the tap. This stress stiffens the wall, the pressure follows the wall as it moves, and the gas resists
    changes of the volume inside.

    Parameters
    ----------
    radius : float
        Outer radius under pressure, m, at most 5 m.
    thickness : float
        Thickness of the wall under pressure, m, from 0.001 to 0.9 of the radius.
    material : Material
        The material of the wall.
    pressure : float
        Pressure difference, inside minus outside, Pa. A negative one compresses the wall. It may not be so low that
        the wall buckles or that the pressure inside is negative.
    base : {"fixed", "free", "contact"}
        "fixed": a seat holds the outer surface around the far pole. "free": the ball can fly off. "contact": a free
        ball with two contacts, 0 at the struck pole and 1 at the far one, which another chain strikes.
    seat : float
        Half-angle of the seat, seen from the centre, rad; from 0.02 to π/2.
    ambient : float
        Pressure outside, Pa, at most 1e9.
    heat_capacity_ratio : float
        Ratio κ of the heat capacities of the gas, 1.4 for air, at most 5. A change dV of the volume V inside changes
        the pressure by −κ (ambient + pressure) dV/V. With 0 the pressure stays constant.
    patch_radius : float, optional
        Radius of the circle over which the force is spread evenly, m; see `layered_cylinder`. By default a
        quarter of the thickness, at most an eighth of the shear wavelength. It must be wider than the contact.
    highest_frequency : float
        Hz. The mesh resolves shear and flexural waves up to this frequency.
    cells : int
        Number of elements across the radius of the patch, and in the shortest wavelength.

    Returns
    -------
    Structure
        The shell, with a field for displacements and stresses.

    Raises
    ------
    ValueError
        If an argument is out of its range, if the mesh is too large, or if the wall buckles.

    Notes
    -----
    Displacements are small compared with the thickness. The gas has one pressure everywhere, so its own resonances are
    missing; the lowest is at 0.33 times the speed of sound over the inner radius. docs/shells.md.

    References
    ----------
    Lamé's stress: Timoshenko, Goodier, Theory of Elasticity, 3rd ed. (1970), section 136. Closed forms and experiments:
    Vella et al., J. R. Soc. Interface 9 (2012) 448. Chains on tennis balls: Nasrollahi, Rizzo, Orak, J. Appl. Mech. 85
    (2018) 031007.

    Examples
    --------
    >>> import hertzlink as hl
    >>> rubber = hl.Material(youngs_modulus=4e6, poisson_ratio=0.49, density=1100.0, name="rubber")
    >>> ball = hl.spherical_shell(33e-3, 3.5e-3, rubber, pressure=80e3, highest_frequency=5e3)
    >>> ball.contacts, ball.damping is None
    (1, True)
    """
    wall = _Wall(radius, thickness, material, base, seat, patch_radius, highest_frequency, cells)
    outside, ratio = ambient, heat_capacity_ratio
    if pressure < -outside:
        raise ValueError(f"pressure = {pressure!r}: must be at least -{outside:g} Pa, as ambient is {outside:g} Pa")
    wall.check_stretch(pressure)
    mass, elastic = wall.matrices()
    stiffness = elastic
    if pressure != 0.0:
        stressed = wall.stress(pressure)
        if pressure < 0.0:
            wall.check_buckling(pressure, mass, elastic, stressed)
        stiffness = sparse.csr_array(elastic + stressed)
    origin = {"seat": wall.seat if base == "fixed" else None, "patch_radius": wall.patch}
    free = wall.kept
    mass, stiffness, contact = mass[free][:, free], stiffness[free][:, free], wall.contact()[free]
    if ratio > 0.0 and outside + pressure > 0.0:
        opening = wall.openings()[:, free]
        stiffness = with_gas(stiffness, opening, ratio * (outside + pressure), wall.volume)
        mass.resize(stiffness.shape)
        contact = np.vstack([contact, np.zeros((opening.shape[0], contact.shape[1]))])
    several = contact.shape[1]
    flexibility: Any = -patch_compliance(material, wall.patch)
    surface = Surface(material, 1.0 / wall.radius)
    return Structure(
        mass, stiffness, None, contact, flexibility if several == 1 else [flexibility] * several,
        surface if several == 1 else [surface] * several, origin,
        field=elastic_field(wall.mesh, ElementQuad2, INTEGRATION_ORDER, free, [material], wall.owner),
    )  # fmt: skip


class _Wall:
    """The half-plane (r, z) of the wall: r from the axis, z from the struck pole towards the far one."""

    def __init__(
        self, radius: float, thickness: float, material: Material, base: str, seat: float,
        patch: float | None, frequency: float, cells: int,
    ) -> None:  # fmt: skip
        self.material, self.base, self.seat, self.frequency, self.cells = material, base, seat, frequency, cells
        self.radius, self.thickness = sizes(radius, thickness)
        if not 0.02 <= self.seat <= pi / 2.0:
            raise ValueError(f"seat = {seat!r}: must lie between 0.02 and π/2, in rad; for 30° write math.radians(30)")
        self.patch = self._patch_radius(patch)
        along, depth = self._nodes_along(), self._nodes_deep()
        check_size(float(along.size * depth.size))
        flat = MeshQuad2.from_mesh(MeshQuad.init_tensor(along, depth))
        steps, below = flat.doflocs
        angle, distance = steps / self.radius, self.radius - below
        place = np.stack([distance * np.sin(angle), self.radius - distance * np.cos(angle)])
        place[0, np.isin(steps, (along[0], along[-1]))] = 0.0
        self.mesh = MeshQuad2(place, flat.t)
        self.mapping = self.mesh.mapping()
        self.mapping.invF = partial(self.mapping.invF, newton_tol=NEWTON)
        self.element = ElementVector(ElementQuad2())
        self.basis = Basis(self.mesh, self.element, intorder=INTEGRATION_ORDER)
        self.owner = np.zeros(self.mesh.t.shape[1], dtype=np.int64)
        middle = flat.p[:, flat.facets].mean(axis=1)
        ends, outer = np.isin(middle[0], (along[0], along[-1])), middle[1] == 0.0
        inner = np.flatnonzero(middle[1] == depth[-1])
        self.inner = inner[np.argsort(middle[0, inner])]
        self.struck = np.flatnonzero(outer & (middle[0] < self.patch))
        self.far = np.flatnonzero(outer & (middle[0] > pi * self.radius - self.patch))
        held = self.basis.get_dofs(np.flatnonzero(ends)).all(["u^1"])
        if base == "fixed":
            on_seat = np.flatnonzero(outer & (middle[0] > (pi - self.seat) * self.radius))
            held = np.union1d(held, self.basis.get_dofs(on_seat).all())
        self.kept = np.setdiff1d(np.arange(self.basis.N), held)

    def _patch_radius(self, radius: float | None) -> float:
        if radius is None:
            return min(self.thickness / PATCH_IN_WALL, shear_speed(self.material) / self.frequency / PATCH_DIVISOR)
        patch = positive("patch_radius", radius, "m")
        if patch > 0.5 * self.radius:
            raise ValueError(f"patch_radius = {radius!r}: must not exceed half the radius, {0.5 * self.radius:g} m")
        return patch

    def _longest_cell(self) -> float:
        """Return length, m, of a cell of which `cells` lie in the shortest wave: shear, flexural, or the wall's own."""
        m = self.material
        flexural = 2.0 * pi * _plate_speed(m, self.thickness) / sqrt(2.0 * pi * self.frequency)
        decay_length = 2.0 * pi * sqrt(self.radius * self.thickness) / (12.0 * (1.0 - m.poisson_ratio**2)) ** 0.25
        waves = min(shear_speed(m) / self.frequency, flexural, decay_length) / self.cells
        return float(min(waves, WIDEST_CELL * self.radius))

    def _nodes_along(self) -> Vector:
        """Return the nodes along the outer meridian from the struck pole, m, finest at the edges of patches."""
        longest, end = self._longest_cell(), pi * self.radius

        def size(s: Vector) -> Vector:
            small = np.minimum(about_patch(s - self.patch, self.patch, self.cells), longest)
            if self.base == "contact":
                small = np.minimum(small, about_patch(end - s - self.patch, self.patch, self.cells))
            if self.base == "fixed":
                edge = (pi - self.seat) * self.radius
                # The stress is singular at the edge of the seat.
                small = np.minimum(small, 0.25 * self.thickness + CELL_GROWTH / self.cells * np.abs(s - edge))
            return small

        stops = [0.0, self.patch, end]
        if self.base == "fixed":
            stops.insert(2, (pi - self.seat) * self.radius)
        if self.base == "contact":
            stops.insert(2, end - self.patch)
        parts = [graded(a, b, size) for a, b in pairwise(stops)]
        return np.concatenate([*(part[:-1] for part in parts), [end]])

    def _nodes_deep(self) -> Vector:
        """Return the nodes through the wall, m below the outer surface; at least two cells."""
        longest = min(shear_speed(self.material) / self.frequency / self.cells, 0.5 * self.thickness)

        def size(depth: Vector) -> Vector:
            return np.minimum(about_patch(depth, self.patch, self.cells), longest)

        return graded(0.0, self.thickness, size)

    def matrices(self) -> tuple[sparse.csr_array, sparse.csr_array]:
        """Return the mass and stiffness without stress, n × n."""
        return body_matrices(self.basis, [self.material], self.owner)

    def _on(self, facets: Any) -> Any:
        return FacetBasis(self.mesh, self.element, self.mapping, facets=facets, intorder=INTEGRATION_ORDER)

    def contact(self) -> Vector:
        """Return the contact vectors, n × 1 or n × 2."""
        patches = [self.struck, self.far] if self.base == "contact" else [self.struck]
        columns: Vector = np.column_stack([self._pole(facets) for facets in patches])
        return columns

    def _pole(self, facets: Any) -> Vector:
        """Return a unit force along the axis, into the ball, spread over the facets of a patch."""
        vector = patch_vector(self._on(facets))
        # Pressure on a patch that is not flat: what it carries along the axis is a little less than one.
        along = np.zeros(self.basis.N)
        along[self.basis.get_dofs(facets=np.arange(self.mesh.facets.shape[1])).all(["u^2"])] = 1.0
        return np.asarray(vector / abs(vector @ along))

    def stress(self, pressure: float) -> sparse.csr_array:
        """Return the stiffness of the stress that the pressure causes, and of the pressure, which follows the wall."""
        radii = (self.radius - self.thickness, self.radius)
        inside = stress_stiffness(self.basis, radii, self.radius, pressure)
        return sparse.csr_array(inside + following_stiffness(self._on(self.inner), pressure))

    @property
    def volume(self) -> float:
        """The volume of the gas, m³."""
        return float(4.0 / 3.0 * pi * (self.radius - self.thickness) ** 3)

    def openings(self) -> sparse.csr_array:
        """Return the volume that each ring of the inner surface opens, m², rings × n."""
        faces = self._on(self.inner)
        rings = FacetBasis(self.mesh, ElementQuad0(), self.mapping, facets=self.inner, intorder=INTEGRATION_ORDER)
        return ring_openings(faces, rings, self.mesh.f2t[0, self.inner])

    def check_stretch(self, pressure: float) -> None:
        """Refuse a pressure that no wall bears; warn of one that stretches it much, or beyond its yield strength."""
        m, middle = self.material, self.radius - 0.5 * self.thickness
        stress = 0.5 * pressure * middle / self.thickness
        strain = (1.0 - m.poisson_ratio) * stress / m.youngs_modulus
        if strain > 1.0:
            raise ValueError(
                f"pressure = {pressure!r}: must be at most {pressure / strain:.4g} Pa, which would stretch the wall to "
                "twice its size"
            )
        if abs(strain) > LARGE_STRETCH:
            caution(
                f"spherical_shell pressure = {readable(pressure, 'Pa', 6)}: stretches the wall by "
                f"{100.0 * strain:.2g} %; give radius, thickness and "
                "modulus at this stretch, and check the unit"
            )
        if m.yield_strength is not None:
            check_stress(
                f"spherical_shell pressure = {readable(pressure, 'Pa', 6)}", stress, m, "check the unit, and the wall"
            )

    def check_buckling(self, pressure: float, mass: Any, elastic: Any, stressed: Any) -> None:
        """Raise a ValueError if the wall buckles under less than this pressure."""
        free = self.kept
        if self.base != "fixed":
            # One point of the axis is held, without a force: a motion of the whole ball changes no energy.
            free = np.setdiff1d(free, self.basis.get_dofs(self.inner).all(["u^2"])[:1])
        mass, elastic, stressed = (matrix[free][:, free] for matrix in (mass, elastic, stressed))
        factor = buckling_factor(mass, elastic, stressed, 0.0)
        refused = f"pressure = {pressure!r}: must be above {factor * pressure:.4g} Pa, at which the wall buckles"
        check_buckling(factor, f"spherical_shell pressure = {readable(pressure, 'Pa', 6)}", refused)


def _plate_speed(material: Material, thickness: float) -> float:
    """Return (D/m)^¼, m/√s: flexural waves of a flat wall have the wavelength 2π (D/m)^¼/√ω."""
    bending = material.youngs_modulus * thickness**2 / (12.0 * (1.0 - material.poisson_ratio**2))
    return float((bending / material.density) ** 0.25)
