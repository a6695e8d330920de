"""Thin plates without a mesh: the infinite plate, and the plate with one straight edge, as exact oscillators."""

from dataclasses import replace
from functools import lru_cache, partial
from itertools import pairwise
from math import inf, pi
from typing import Annotated, NamedTuple

import numpy as np
from numpy.polynomial import chebyshev
from scipy import sparse
from scipy.special import j0

from plates.laminate import Laminate, section_of
from plates.section import homogeneous_section, point_impedance, point_rigidity
from structures.checks import within
from structures.described import described_as
from structures.fineness import fineness
from structures.material import Material
from structures.quantities import Asks, Likely, OneOf, WallThickness
from structures.structure import Structure, Vector, oscillators
from structures.surface import Surface

EDGES = ("clamped", "simple", "free")
LENGTHS, TIMES = (1e-9, 1e6), (1e-12, 1e3)  # m and s. Within these ranges no number leaves floating point.
Until = Annotated[float, replace(Likely.TIME, low=TIMES[0], high=TIMES[1])]
# Hz, the highest frequency that is resolved in time. Amplitude ratios of chains of 4.76 and 9.53 mm steel beads change
# by 1e-5 between 60 and 200 kHz (tests/plates/test_half_plane.py).
HIGHEST_FREQUENCY = 100.0e3
UNTIL = 4.0e-3  # s. Chains of 19 mm steel beads on thin plates need records of 3.5 ms; smaller beads need shorter ones.
# Oscillators extend to this multiple of the highest frequency; those above it follow the force without delay.
QUASI_STATIC = 5.0
GAUSS = np.polynomial.legendre.leggauss(16)  # Points and weights on (−1, 1), for intervals of at most PHASE
# Radians of the fastest oscillation of an integrand in an interval of 16 Gauss points, which integrate it to 1e-9.
PHASE = 24.0
MOST_PHASE = 2.0e5  # Radians, or about 130 000 oscillators; with more, a plate with a mesh is faster
PANELS = 2  # Intervals in 1/ω of the oscillators above the highest frequency
SETTLED = 30.0  # kd above which waves that are not resolved in time have the infinite plate's compliance
# Intervals towards grazing waves, each half as long as the one before: the waves of a free edge change within an angle
# of about ν²/4 from the edge.
HALVINGS = 10
FADED = 40.0  # kd above which e^{−kd} is below rounding
CHUNK = 128  # Number of distances that are computed together, to limit memory
# Length, in kd, of the intervals on which Re Y is a Chebyshev series, and its number of terms: exact to 1e-13. All
# plates with the same kind of edge and the same ν share them, so that a second plate costs a fifth of the first.
PANEL, TERMS = 8.0, 48
# The most series of one plate, beyond which each distance has its own quadrature; and the most series that are kept, of
# 0.4 kB each.
MOST_PANELS, SERIES_IN_MEMORY = 64, 1024


@described_as(called="infinite plate")
def infinite_plate(thickness: WallThickness | None, material: Material | Laminate) -> Structure:
    """A thin plate without edges: a massless degree of freedom on a dashpot 8 √(D ρ t), N s/m.

    Parameters
    ----------
    thickness, material
        As in `mindlin_plate`. For a Laminate, 1/√D is the mean of 1/√D(φ) over all directions φ.

    Returns
    -------
    Structure
        The plate. An impulse I moves the point by I / (8 √(D ρ t)), and it stays there (Cremer, Heckl, Petersson,
        Structure-Borne Sound, 3rd ed., table 5.1).

    Examples
    --------
    >>> print(f"{hl.infinite_plate(2.29e-3, hl.ALUMINIUM_6061).damping[0, 0]:.0f} N s/m")
    175 N s/m
    """
    section = section_of(thickness, material)
    impedance = point_impedance(point_rigidity(section), section.mass)
    none = sparse.csr_array((1, 1))
    origin = {"thickness": section.thickness, "impedance": impedance, "section": section.data}
    damping = sparse.csr_array([[impedance]])
    return Structure(none, none, damping, np.ones(1), 0.0, Surface(section.struck), origin)


@described_as(called="half-plane")
def half_plane(
    thickness: Annotated[float, replace(Likely.THICKNESS, low=LENGTHS[0], high=LENGTHS[1])],
    material: Material,
    edge: Annotated[str, OneOf(*EDGES)],
    distance: Annotated[float, replace(Likely.DISTANCE, or_zero=True)],
    until: Annotated[Until, Asks("the longest run; by default that of the case")] = UNTIL,
    highest_frequency: Annotated[float, replace(Likely.FREQUENCY, low=1.0 / TIMES[1], high=1.0 / TIMES[0])]
    | None = None,
) -> Structure:
    """A thin plate that fills the half-plane x ≥ 0, struck at a distance from its straight edge x = 0.

    It is exact in Kirchhoff's theory except for a quadrature, whose points are undamped oscillators; see
    docs/plate_edge.md.

    Parameters
    ----------
    thickness, material : float, Material
        Thickness, m, and the isotropic material.
    edge : str
        "clamped" (no deflection, no slope), "simple" (no deflection, no moment) or "free".
    distance : float
        Distance from the contact to the edge, m. Zero, a contact on the edge, requires a free edge.
    until : float
        Length of the longest run, s. The number of oscillators is proportional to it.
    highest_frequency : float, optional
        Highest frequency that is resolved in time, Hz; faster waves follow the force without delay. By default 100 kHz,
        and more for contacts below 10 µs.

    Returns
    -------
    Structure
        M = I, K diagonal, no damping. `valid_until` is `until`.

    Examples
    --------
    >>> hl.half_plane(2.29e-3, hl.ALUMINIUM_6061, "clamped", 0.02, until=0.8e-3).valid_until
    0.0008
    """
    # Y is the velocity at the contact divided by the force. The displacement after a unit impulse is
    # (2/π) ∫ Re Y(ω) sin(ωt)/ω dω. Gauss points ω_j with weights h_j give oscillators with stiffness ω_j² and contact
    # entry b_j = √(2 h_j Re Y(ω_j)/π). The flexibility (2/π) ∫ Re Y/ω² dω represents frequencies above all oscillators.
    section = homogeneous_section(thickness, material)
    if distance == 0.0 and edge != "free":
        raise ValueError("distance = 0.0: must be a positive number of m, unless the edge is free")
    away = distance and within("distance", distance, *LENGTHS, "m")
    plate = HalfPlane(float(section.bending[0, 0]), section.mass, edge, away, material.poisson_ratio)
    # Waves of half the length have four times the frequency.
    highest = HIGHEST_FREQUENCY * fineness().shorter if highest_frequency is None else highest_frequency
    circular = 2.0 * pi * fineness().cells ** 2 * highest
    bands = [plate.resolved(circular, until), plate.following(circular, QUASI_STATIC * circular)]
    frequency, weight = (np.concatenate(both) for both in zip(*bands, strict=True))
    above = plate.compliance_above(QUASI_STATIC * circular)
    origin = {"highest_frequency": highest, "section": section.data}
    made = oscillators(frequency**2, None, np.sqrt(weight), above, Surface(material), origin, until)
    return made.made_by(partial(half_plane, thickness, material, edge, distance, until, highest_frequency))


class HalfPlane(NamedTuple):
    """A plate with one straight edge: rigidity D, N m; mass per area m, kg/m²; distance of the edge, m.

    Bands of oscillators are pairs: angular frequencies ω, rad/s, and squares of the contact's entries, 1/kg.
    """

    rigidity: float
    mass: float
    edge: str
    distance: float
    poisson_ratio: float

    @property
    def diffusion(self) -> float:
        """a = √(D/m), m²/s."""
        return float((self.rigidity / self.mass) ** 0.5)

    @property
    def impedance(self) -> float:
        """That of the infinite plate, 8 √(D m), N s/m."""
        return point_impedance(self.rigidity, self.mass)

    def resolved(self, highest: float, until: float, lowest: float = 0.0) -> tuple[Vector, Vector]:
        """Return the band up to an angular frequency, with the density that motion up to `until` s and echoes require.

        Waves that cannot return by then are omitted: Re Y is that of the infinite plate.
        """
        a = self.diffusion
        there = self.distance if self.distance < until * (a * highest) ** 0.5 else inf
        path = 0.0 if there == inf else there
        # The phase of sin(ωt) times an echo, a k² t + 2kd, is the same in all intervals.
        first, total = (until * end + 2.0 * path * (end / a) ** 0.5 for end in (lowest, highest))
        if total > MOST_PHASE:
            raise ValueError(f"until = {until!r}: must be about {0.95 * until * MOST_PHASE / total:.2g} s or less")
        phases = np.linspace(first, total, int(np.ceil((total - first) / PHASE)) + 1)
        wavenumber, width = _gauss((np.sqrt(path**2 + a * until * phases) - path) / (a * until))
        frequency = a * wavenumber**2
        return frequency, self._weights(frequency, 2.0 * a * wavenumber * width, there)

    def following(self, low: float, high: float) -> tuple[Vector, Vector]:
        """Return the band between two angular frequencies, for forces that are slower than all of its oscillators."""
        period, width = _gauss(np.linspace(1.0 / high, 1.0 / low, PANELS + 1))
        distance = self.distance if self.distance * (low / self.diffusion) ** 0.5 < SETTLED else inf
        return 1.0 / period, self._weights(1.0 / period, width / period**2, distance)

    def compliance_above(self, lowest: float) -> float:
        """Return (2/π) ∫ Re Y/ω² dω above an angular frequency, m/N."""
        settled = max(lowest, self.diffusion * (SETTLED / self.distance) ** 2) if self.distance > 0.0 else lowest
        # Above `settled` the effect of the edge averages out: Re Y is the infinite plate's, and ∫ dω/ω² is closed.
        beyond = 2.0 / (pi * self.impedance * settled)
        if self.distance == 0.0:
            return beyond * float(conductance(np.zeros(1), self.edge, self.poisson_ratio)[0])
        if settled == lowest:
            return beyond
        frequency, width = _gauss(np.geomspace(lowest, settled, 2 + int(4.0 * np.log2(settled / lowest))))
        return beyond + float((self._weights(frequency, width, self.distance) / frequency**2).sum())

    def _weights(self, frequency: Vector, width: Vector, distance: float) -> Vector:
        """Return (2/π) Re Y dω."""
        infinite: Vector = 2.0 / (pi * self.impedance) * width
        if distance == inf:
            return infinite
        return infinite * conductance(np.sqrt(frequency / self.diffusion) * distance, self.edge, self.poisson_ratio)


def conductance(distance: Vector, edge: str, poisson_ratio: float) -> Vector:
    """Return Re Y, relative to 1/8√(Dm) of the infinite plate, at distances kd from the edge (in inverse wavenumbers).

    A plane wave arrives at an angle θ to the edge's normal and is reflected; near the edge there is also an evanescent
    wave. In units of 1/k their sum is ψ(x) = A cos(ηx) + B sin(ηx) + C e^{−γx} with ξ = sin θ along the edge,
    η = cos θ, γ = √(1 + ξ²) and A² + B² = 1. Re Y is (4/π) ∫ ψ² dθ from 0 to π/2. A free edge also guides an edge wave
    (`_edge_wave`). For a simple edge ψ = sin(ηx), and the integral is 1 − J₀(2kd).
    """
    if edge == "simple":
        return np.asarray(1.0 - j0(2.0 * distance))
    nu = 0.0 if edge == "clamped" else poisson_ratio
    if distance.max(initial=0.0) > MOST_PANELS * PANEL:
        return exact_conductance(distance, edge, nu)
    place, number = np.modf(distance / PANEL)
    panels, row = np.unique(number, return_inverse=True)
    series = np.array([_series(edge, nu, int(panel)) for panel in panels])
    values: Vector = chebyshev.chebval(2.0 * place - 1.0, series.T[:, row], tensor=False)
    # A series has a constant absolute error. Close to a clamped edge Re Y is smaller than this error.
    close = distance < 0.5
    values[close] = exact_conductance(distance[close], edge, nu)
    return values


@lru_cache(SERIES_IN_MEMORY)
def _series(edge: str, poisson_ratio: float, panel: int) -> Vector:
    """Return the Chebyshev series of Re Y on an interval of kd."""
    series = chebyshev.chebinterpolate(  # type: ignore[type-var]
        lambda place: exact_conductance(PANEL * (panel + 0.5 * (1.0 + place)), edge, poisson_ratio), TERMS - 1
    )
    return np.asarray(series)


def exact_conductance(distance: Vector, edge: str, poisson_ratio: float) -> Vector:
    """Return `conductance` by quadrature at each distance."""
    values, order = np.empty(distance.size), np.argsort(distance)
    ends = pi / 2.0 * (1.0 - np.append(2.0 ** -np.arange(HALVINGS + 1.0), 0.0))
    # Distances are sorted, so that small ones use fewer directions than large ones.
    for start in range(0, order.size, CHUNK):
        part = order[start : start + CHUNK]
        counts = np.ceil(np.diff(ends) * 2.0 * distance[part[-1]] / PHASE).astype(int) + 1
        pieces = [np.linspace(*two, n, endpoint=False) for two, n in zip(pairwise(ends), counts, strict=True)]
        angle, width = _gauss(np.append(np.concatenate(pieces), pi / 2.0))
        along, across = np.sin(angle), np.cos(angle)
        decay = np.sqrt(1.0 + along**2)
        if edge == "clamped":
            # ψ = ψ′ = 0 at x = 0.
            cosine, sine, evanescent = across, -decay, -across
        else:
            # No moment, ψ″ − νξ²ψ = 0, and no shear force, ψ‴ − (2 − ν)ξ²ψ′ = 0, at x = 0.
            wave, near = across**2 + poisson_ratio * along**2, decay**2 - poisson_ratio * along**2
            cosine, sine, evanescent = near**2 * across, -decay * wave**2, wave * near * across
        x = distance[part, None]
        shape = np.cos(x * across - np.arctan2(sine, cosine))
        if x.min() < FADED:
            shape += evanescent / np.hypot(cosine, sine) * np.exp(-x * decay)
        values[part] = 4.0 / pi * shape**2 @ width
    return values + (_edge_wave(distance, poisson_ratio) if edge == "free" else 0.0)


def _edge_wave(distance: Vector, poisson_ratio: float) -> Vector:
    """Return the contribution of the wave along a free edge to Re Y (Konenkov, Sov. Phys. Acoust. 6 (1960) 122).

    In units of k its wavenumber is q > 1, q⁻⁴ = (1 − ν)(3ν − 1 + 2 √(1 − 2ν + 2ν²)). It decays away from the edge as
    φ = e^{−γ₁x} + C e^{−γ₂x} with γ₁,₂² = q² ∓ 1. For a guided wave with group speed c, in both directions together,
    Re Y = φ²/(2 c m ∫φ² dx).
    """
    nu = poisson_ratio
    fourth = 1.0 / ((1.0 - nu) * (3.0 * nu - 1.0 + 2.0 * np.sqrt(1.0 - 2.0 * nu + 2.0 * nu**2)))
    square = np.sqrt(max(fourth, 1.0))
    slow, fast = np.sqrt(square - 1.0), np.sqrt(square + 1.0)
    second = -(slow**2 - nu * square) / (fast**2 - nu * square)
    # 2 γ₁ ∫φ² dx. It is finite for ν = 0, when the edge wave becomes a plane wave and adds nothing.
    norm = 1.0 + 4.0 * slow * second / (slow + fast) + slow * second**2 / fast
    shape = np.exp(-slow * distance) + second * np.exp(-fast * distance)
    return np.asarray(4.0 * slow * np.sqrt(square) * shape**2 / norm)


def _gauss(ends: Vector) -> tuple[Vector, Vector]:
    """Return Gauss points and weights of the intervals between these ends."""
    place, weight = GAUSS
    half, middle = np.diff(ends)[:, None] / 2.0, (ends[1:] + ends[:-1])[:, None] / 2.0
    return (middle + half * place).ravel(), (half * weight).ravel()
