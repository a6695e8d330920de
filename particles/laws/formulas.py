"""Contact laws: the force between two bodies against their approach, and `contact_law`, which picks the right one.

Every law reaches the kernel as a stiffness times a shape: Hertz's δ√δ, or a table of cubics in δ (see `kernel_table`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from math import atan2, cos, e, inf, log, pi, sin, sqrt

import numpy as np
from scipy.interpolate import PchipInterpolator
from scipy.special import lambertw

from particles import kernels
from particles.bead import Bead, Cylinder, HollowSphere
from structures.caution import caution
from structures.checks import finite, instance, one_of, positive, within
from structures.structure import Vector
from structures.surface import AXIS_RATIOS, Surface, hertz_stiffness, relative_curvatures

SMALL_CONTACT = 0.2
"""Half-width of a contact, up to which the half-space theories are trusted, over the relative radius of curvature, or
over a body's own where that is smaller."""

MOST_ELONGATED = 130.65
"""R′/R″ of cylinders that cross at 10°; more elongated contacts reach beyond what a half-space stands for."""

SAMPLES = 600
"""Points of a law that is tabulated from a formula, over NARROWEST to WIDEST."""

NARROWEST, WIDEST = 2.0**-50, 2.0**-5


class ContactLaw:
    """Force (N) against approach (m), increasing, zero where bodies do not touch.

    name tells what the law is; it is trusted up to the approach `largest`; caution: text, where it needs one.
    """

    name: str
    largest: float
    caution: str

    def force(self, approach: Vector) -> Vector:
        """F(δ), N."""
        raise NotImplementedError

    def tangent(self, approach: Vector) -> Vector:
        """dF/dδ, N/m."""
        raise NotImplementedError

    @property
    def kernel(self) -> tuple[float, Vector | None]:
        """Stiffness and table for the kernel; None for Hertz's shape δ√δ."""
        return 1.0, self._table

    def energy(self, approach: Vector) -> Vector:
        """∫F dδ, J."""
        work: Vector = kernels.table_energies(self._table, np.asarray(approach, float))
        return work

    def approach(self, force: Vector) -> Vector:
        """δ(F), m, the inverse of the law."""
        return _inverse(self.force, np.asarray(force, float))

    def overlap(self, energy: Vector) -> Vector:
        """The approach, m, at which the contact holds this energy (J)."""
        return _inverse(self.energy, np.asarray(energy, float))

    @cached_property
    def _table(self) -> Vector:
        return kernel_table(self)


@dataclass(frozen=True)
class PowerLaw(ContactLaw):
    """F = k δⁿ (thesis, equation 5.9); n = 3/2 is Hertz's law.

    stiffness k in N/mⁿ, exponent n from 1 to 10. largest: the approach (m) up to which the law is trusted; beyond it a
    run goes on and warns.
    """

    stiffness: float
    exponent: float = 1.5
    largest: float = inf
    name: str = "power law"
    caution: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "stiffness", positive("stiffness", self.stiffness, "N/m^n"))
        object.__setattr__(self, "exponent", within("exponent", self.exponent, 1.0, 10.0))
        object.__setattr__(self, "largest", _largest(self.largest))

    def force(self, approach: Vector) -> Vector:
        """F(δ), N."""
        return self.stiffness * np.maximum(approach, 0.0) ** self.exponent

    def tangent(self, approach: Vector) -> Vector:
        """dF/dδ, N/m."""
        return self.stiffness * self.exponent * np.maximum(approach, 0.0) ** (self.exponent - 1.0)

    @property
    def kernel(self) -> tuple[float, Vector | None]:
        """k, and the table of δⁿ; None for Hertz's shape δ√δ."""
        return self.stiffness, None if self.exponent == 1.5 else _shape_table(self.exponent)

    def energy(self, approach: Vector) -> Vector:
        """∫F dδ, J."""
        return self.force(approach) * np.maximum(approach, 0.0) / (self.exponent + 1.0)

    def approach(self, force: Vector) -> Vector:
        """δ(F), m."""
        return (np.maximum(force, 0.0) / self.stiffness) ** (1.0 / self.exponent)

    def overlap(self, energy: Vector) -> Vector:
        """The approach, m, at which the contact holds this energy (J)."""
        n = self.exponent
        return ((n + 1.0) * np.asarray(energy) / self.stiffness) ** (1.0 / (n + 1.0))


@dataclass(frozen=True)
class TabulatedLaw(ContactLaw):
    """A law through points (approach in m, force in N), both increasing.

    Monotone cubics (Fritsch–Carlson) run through ln F over ln δ, so power laws are kept exactly. Outside the points it
    goes on as power laws: below the first one to zero, at least linearly; beyond the last one as steeply as there and
    as the last two points, and a run warns.
    Raises ValueError where points do not increase or are fewer than two. A first point (0, 0) is left out.
    """

    approaches: Sequence[float]
    forces: Sequence[float]
    name: str = "tabulated law"
    caution: str = ""
    largest: float = field(default=inf)

    def __post_init__(self) -> None:
        rows = [(finite("approaches", d, "m"), finite("forces", f, "N")) for d, f in _pairs(self)]
        if rows and rows[0] == (0.0, 0.0):
            rows = rows[1:]
        if len(rows) < 2:
            raise ValueError(f"approaches: must hold two points or more beside (0, 0), not {len(rows)}")
        for before, after in zip([(0.0, 0.0), *rows], rows, strict=False):
            if not (after[0] > before[0] and after[1] > before[1]):
                raise ValueError(f"forces: must increase with the approaches from zero; {after} follows {before}")
        object.__setattr__(self, "approaches", tuple(row[0] for row in rows))
        object.__setattr__(self, "forces", tuple(row[1] for row in rows))
        object.__setattr__(self, "largest", min(_largest(self.largest), rows[-1][0]))

    def force(self, approach: Vector) -> Vector:
        """F(δ), N."""
        return self._force_and_slope(approach)[0]

    def tangent(self, approach: Vector) -> Vector:
        """dF/dδ, N/m."""
        force, slope = self._force_and_slope(approach)
        return force * slope / np.maximum(approach, 1e-300)

    def _force_and_slope(self, approach: Vector) -> tuple[Vector, Vector]:
        """Force, and d ln F / d ln δ."""
        curve, (first, last), (below, above) = self._curve
        asked = np.log(np.maximum(approach, 1e-300))
        inside = np.clip(asked, first, last)
        slope = np.where(asked < first, below, np.where(asked > last, above, curve(inside, 1)))
        force = np.exp(curve(inside) + slope * (asked - inside))
        return np.where(np.asarray(approach) <= 0.0, 0.0, force), slope

    @cached_property
    def _curve(self) -> tuple[PchipInterpolator, tuple[float, float], tuple[float, float]]:
        """ln F over ln δ, its ends, and its slopes beyond them."""
        x, y = np.log(self.approaches), np.log(self.forces)
        curve = PchipInterpolator(x, y)
        beyond = (
            max(float(curve(x[0], 1)), 1.0),
            max(float(curve(x[-1], 1)), float((y[-1] - y[-2]) / (x[-1] - x[-2]))),
        )
        return curve, (x[0], x[-1]), beyond


def contact_law(first: Bead, second: Bead | Surface, axis_ratio: str = "exact") -> ContactLaw:
    """The law between two bodies, or a body and the surface of a structure; its `name` says what was picked.

    Spheres, ellipsoids, crossed cylinders, any two of them: Hertz, with b/a solved exactly or as the thesis
    approximates it (axis_ratio, see `hertz_stiffness`). Parallel cylinders: `line_force`, over the shorter length.
    A cylinder that lies on a flat surface touches it along its whole length, whatever the angles of its neighbours; the
    law is that of a line on a half-space, and carries a caution, as the structure is pushed at one point.
    Hollow spheres: Hertz in series with Reissner's shell (`shell_flexibility`).
    Contacts more elongated than those of cylinders that cross at 10° get a caution: there half-space theory ends.
    Cylinders then bear no more than side by side, over the shorter length.
    Raises ValueError for bodies whose surfaces conform.
    """
    for name, body in (("first", first), ("second", second)):
        kinds = Bead if name == "first" else Bead | Surface
        instance(name, body, kinds, "a body" if name == "first" else "a body or a Surface")  # type: ignore[arg-type]
    one_of("axis_ratio", axis_ratio, AXIS_RATIOS)
    law = _contact_law(first, second, axis_ratio)
    if law.caution:
        caution(f"contact law: {law.caution}")
    return law


@lru_cache(maxsize=4096)
def _contact_law(first: Bead, second: Bead | Surface, axis_ratio: str) -> ContactLaw:
    one, other = (body if isinstance(body, Surface) else body.surface for body in (first, second))
    flat, sharp = relative_curvatures(one, other)
    if flat <= 1e-12 * sharp:
        return _line_contact(first, second)
    stiffness = hertz_stiffness(one, other, axis_ratio)
    # Along a relative curvature c a contact is √(δ/c) wide to either side: as round ones are, and long ones to √2.
    directions = zip((flat, sharp), sharpest_curvatures(one, other), strict=True)
    largest = SMALL_CONTACT**2 / max(sharpest * (sharpest / relative) for relative, sharpest in directions)
    shells = sum(shell_flexibility(body) for body in (first, second) if isinstance(body, HollowSphere))
    if any(isinstance(body, HollowSphere) for body in (first, second)):
        return _in_series(PowerLaw(stiffness, largest=largest), shells)
    if sharp < 1.0001 * flat:
        return PowerLaw(stiffness, 1.5, largest, "Hertz, round contact")
    name, doubts = f"Hertz, elliptic contact, R'/R'' = {sharp / flat:.4g}, b/a {axis_ratio}", ""
    if sharp / flat > MOST_ELONGATED:
        doubts = f"{name}, is as long as between cylinders that cross below 10°, where half-space theory ends"
        if isinstance(first, Cylinder) and isinstance(second, Cylinder):
            return _bounded(PowerLaw(stiffness, 1.5, largest, name, doubts), _line_contact(first, second))
    return PowerLaw(stiffness, 1.5, largest, name, doubts)


def sharpest_curvatures(first: Surface, second: Surface) -> tuple[float, float]:
    """The largest curvatures, 1/m, along the flattest direction of two surfaces that touch, and across it.

    They are the relative ones, or that of a body itself where it is more, as it is where the other is hollow.
    Raises ValueError as `relative_curvatures` does.
    """
    flattest, across = ([relative] for relative in relative_curvatures(first, second))
    parts = [
        (0.5 * (surface.curvature + other), 0.5 * (surface.curvature - other), 2.0 * surface.direction)
        for surface in (first, second)
        for other in [float(surface.second_curvature or 0.0)]
    ]
    sharpest = atan2(sum(d * sin(angle) for _, d, angle in parts), sum(d * cos(angle) for _, d, angle in parts))
    for mean, difference, angle in parts:
        turned = difference * cos(angle - sharpest)
        flattest.append(abs(mean - turned))
        across.append(abs(mean + turned))
    return max(flattest), max(across)


def shell_flexibility(body: HollowSphere) -> float:
    """What the wall of a hollow sphere gives way under a point force, m/N, beside the contact's own approach.

    √(3(1 − ν²)) R/(4 E h²) with the wall h and its mean radius R (Reissner, J. Math. Phys. 25 (1946) 279, for thin
    shells), less what it gives without a cavity, so that a solid sphere is left. With it F(δ) agrees with the thesis's
    Table 5.1 to 5 % from 1 to 20 µm, for all four walls.
    """
    wall = body.radius - body.inner_radius
    material = body.material
    mean = 0.5 * (body.radius + body.inner_radius)
    shape = mean / wall**2 - 0.5 / body.radius
    return sqrt(3.0 * (1.0 - material.poisson_ratio**2)) / (4.0 * material.youngs_modulus) * shape


def line_force(approach: Vector, compliance: float, offset: float) -> Vector:
    """Force per length F*, N/m, of parallel cylinders: δ = C F* (B − ln F*), by the Lambert function's branch −1.

    F* = −(δ/C) / W₋₁(−(δ/C) e^{−B}); its limit is δ = C e^{B−1}, where the contact would be as wide as the bodies.
    For two equal cylinders C = 2(1 − ν²)/(πE) and B = ln(4πER/(1 − ν²)) − 1, and this is the thesis's equation 5.8 with
    the sign and branch that it lacks, F* = −(πE/(1 − ν²)) (δ/2)/W₋₁(−eδ/(8R)) up to 8R/e² (Johnson, section 5.6).
    """
    scaled = np.asarray(approach, float) / compliance
    if np.any(scaled > np.exp(offset - 1.0)):
        raise ValueError(f"approach = {approach!r}: must be at most {compliance * np.exp(offset - 1.0):.4g} m")
    argument = np.maximum(scaled * np.exp(-offset), 1e-300)
    return np.where(scaled > 0.0, -scaled / lambertw(-argument, -1).real, 0.0)


def _line_contact(first: Bead, second: Bead | Surface) -> TabulatedLaw:
    """Cylinders side by side, or one on a flat.

    A cylinder's part is F*c [2 ln(4R/w) − 1] with c = (1 − ν²)/(πE), from its contact to its middle (Johnson, equation
    5.57); a flat has no middle, and gives way by F*c [2 ln(2L/w) + 1] under a line of length L. w² = 4F*RC with the
    relative radius R and the sum C of both c, so that both parts are of the form F*(constant − c ln F*).
    """
    cylinders = [body for body in (first, second) if isinstance(body, Cylinder)]
    if not cylinders:
        raise ValueError(f"second = {second!r}: touches the first along a line; only cylinders may")
    length = min(body.length for body in cylinders)
    surfaces = [body if isinstance(body, Surface) else body.surface for body in (first, second)]
    curvatures = [max(surface.curvature, float(surface.second_curvature or 0.0), key=abs) for surface in surfaces]
    relative = sum(curvatures)
    sharpest = max(relative, *map(abs, curvatures))
    shares = []
    for body in (first, second):
        c = 1.0 / (pi * body.material.contact_modulus)
        shares.append(
            (c, 2.0 * log(4.0 * body.radius) - 1.0 if isinstance(body, Cylinder) else 2.0 * log(2.0 * length) + 1.0)
        )
    compliance = sum(c for c, _ in shares)
    half_width_square = 4.0 * compliance / relative
    offset = sum(c * part for c, part in shares) / compliance - log(half_width_square)
    limit = compliance * e ** (offset - 1.0)
    approaches = np.geomspace(NARROWEST, 0.9 * limit, SAMPLES)
    forces = length * line_force(approaches, compliance, offset)
    # The contact's half-width w grows as √F*; the law is trusted while w is small beside the radii.
    trusted = (SMALL_CONTACT / sharpest) ** 2 / half_width_square * length
    largest = float(np.interp(trusted, forces, approaches))
    name, doubt = "line contact of parallel cylinders", ""
    if isinstance(second, Surface):
        name = f"line contact of a cylinder on a flat, {1e3 * length:.3g} mm long"
        doubt = (
            f"{name}: the cylinder lies on the surface along its whole length, as on a half-space deeper than that, "
            "while the structure is pushed at one point; end the chain with a rounded body for a contact at a point, "
            "or give a function law="
        )
    return TabulatedLaw(approaches, forces, name, doubt, largest)  # type: ignore[arg-type]


def _in_series(law: PowerLaw, flexibility: float) -> TabulatedLaw:
    """A law whose bodies also give way by flexibility · F."""
    overlaps = np.geomspace(NARROWEST, WIDEST, SAMPLES)
    forces = law.force(overlaps)
    approaches = overlaps + flexibility * forces
    largest = law.largest + flexibility * float(law.force(np.array(law.largest)))
    return TabulatedLaw(approaches, forces, "hollow spheres: Hertz and Reissner's shell", largest=largest)  # type: ignore[arg-type]


def _bounded(law: PowerLaw, bound: TabulatedLaw) -> TabulatedLaw:
    """The lesser force of two laws: cylinders that cross at a small angle touch on no more than their whole length."""
    approaches = np.geomspace(NARROWEST, bound.approaches[-1], SAMPLES)
    forces = np.minimum(law.force(approaches), bound.force(approaches))
    return TabulatedLaw(approaches, forces, law.name, law.caution, min(law.largest, bound.largest))  # type: ignore[arg-type]


def kernel_table(law: ContactLaw) -> Vector:
    """A law as rows (δ₀, F, F′, c₂, c₃, ∫F dδ) of cubics in δ − δ₀, Hermite's between kernels.BUCKETS in each octave.

    F is continuous with its slope, and a power law is met to 2e-9. The first row is a straight line through zero.
    """
    edges = kernels.table_edges()
    force, slope = law.force(edges), law.tangent(edges)
    step = np.diff(edges)
    rise = np.diff(force) / step
    if not isinstance(law, PowerLaw | TabulatedLaw):
        _check_law(law, force, slope, rise)
    rows = np.empty((step.size, 6))
    rows[:, 0], rows[:, 1], rows[:, 2] = edges[:-1], force[:-1], slope[:-1]
    rows[:, 3] = (3.0 * rise - 2.0 * slope[:-1] - slope[1:]) / step
    rows[:, 4] = (slope[:-1] + slope[1:] - 2.0 * rise) / step**2
    rows[0] = [0.0, 0.0, force[1] / edges[1], 0.0, 0.0, 0.0]
    rows[-1, 3:5] = 0.0
    work = step * (rows[:, 1] + step * (rows[:, 2] / 2.0 + step * (rows[:, 3] / 3.0 + step * rows[:, 4] / 4.0)))
    work[0] = 0.5 * force[1] * edges[1]
    rows[:, 5] = np.concatenate([[0.0], np.cumsum(work[:-1])])
    return rows


def _check_law(law: ContactLaw, force: Vector, slope: Vector, rise: Vector) -> None:
    """A law of one's own must be one: finite, rising from zero, with the slope that it says."""
    faults = {
        "force is not finite": not np.isfinite(force).all(),
        "force is not zero at zero": force[0] > 1e-6 * force.max(),
        "force does not rise with the approach": not np.all(rise > 0.0),
        "tangent is not the slope of its force": not np.allclose(0.5 * (slope[1:] + slope[:-1]), rise, rtol=0.5),
    }
    for fault, found in faults.items():
        if found:
            raise ValueError(f"law = {law.name}: its {fault}, from {kernels.table_edges()[0]:.1g} m on")


def _largest(value: float) -> float:
    """An approach, or infinity."""
    return value if value == inf else positive("largest", value, "m")


@lru_cache(maxsize=256)
def _shape_table(exponent: float) -> Vector:
    return kernel_table(PowerLaw(1.0, exponent))


def _inverse(increasing: "np.ufunc | object", wanted: Vector) -> Vector:
    """Where an increasing function of the approach has these values, by halving an interval of ln δ."""
    low, high = np.full(wanted.shape, log(1e-30)), np.full(wanted.shape, 0.0)
    for _ in range(100):
        middle = 0.5 * (low + high)
        below = increasing(np.exp(middle)) < wanted  # type: ignore[operator]
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    # What is not a number stays so.
    return np.where(wanted > 0.0, np.exp(0.5 * (low + high)), np.maximum(wanted, 0.0))


def _pairs(law: TabulatedLaw) -> list[tuple[float, float]]:
    columns = []
    for name in ("approaches", "forces"):
        values = np.atleast_1d(np.asarray(getattr(law, name), dtype=object))
        if values.ndim != 1:
            raise ValueError(f"{name}: must be a list of numbers")
        columns.append(list(values))
    if len(columns[0]) != len(columns[1]):
        raise ValueError(f"forces: {len(columns[1])} of them for {len(columns[0])} approaches; must be as many")
    return list(zip(*columns, strict=True))
