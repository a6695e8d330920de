"""Beams struck from the side: bending, with an axial force and elastic ground."""

from functools import partial
from math import ceil, pi
from typing import Annotated

import numpy as np
from scipy import sparse

from plates.elements.hermite import Beam, Hermite
from plates.shapes.shape import graded
from structures.checks import within
from structures.described import described
from structures.fineness import default_frequency
from structures.linear_algebra.factor import is_definite
from structures.material import Material, check_stress
from structures.quantities import Asks, BendingStiffness, Force, Frequency, MassPerLength, OneOf, Place, Quantity, Side
from structures.structure import Structure
from structures.surface import Surface

ENDS = ("clamped", "simple", "free", "symmetry")
End = Annotated[str, OneOf(*ENDS)]
GroundStiffness = Annotated[float, Quantity("N/m²", "a stiffness per length", "1e7 N/m^2", or_zero=True)]
FEWEST_WAVES = 4.0  # The mesh resolves at least this number of waves along the beam
MOST_NODES = 50_000  # A wrong unit is a more likely reason for more nodes than a real need


@described
def beam(
    length: Side,
    bending_stiffness: BendingStiffness,
    mass_per_length: MassPerLength,
    material: Material,
    at: Annotated[Place, Asks("the point that is struck, from the first end")],
    supports: tuple[End, End] = ("simple", "simple"),
    axial_force: Force = 0.0,
    foundation: GroundStiffness = 0.0,
    highest_frequency: Frequency | None = None,
) -> Structure:
    """A beam in the theory of Euler and Bernoulli, struck from the side: EI w⁗ − N w″ + k w + m ẅ = F.

    Parameters
    ----------
    length, bending_stiffness, mass_per_length : float
        Length L, m; EI for bending in the direction of the impact, N m²; mass per length m, kg/m.
    material : Material
        The material at the contact, for Hertz's law.
    at : float
        Distance of the contact from the first end, m.
    supports : (str, str)
        The supports of the two ends: "clamped", "simple", "free" or "symmetry".
    axial_force : float
        Axial force N, N; tension is positive. A beam whose length is held and whose temperature rises by ΔT has
        N = −E A α ΔT. A force that buckles the beam is refused.
    foundation : float
        Stiffness k of elastic ground: force per deflection and length, N/m².
    highest_frequency : float, optional
        As in `mindlin_plate`.

    Returns
    -------
    Structure
        The beam, with cubic elements and two degrees of freedom for each node; the mesh is finest at the contact.

    References
    ----------
    Timoshenko, Gere, Theory of Elastic Stability, 2nd ed. (1961), sections 2.1, 2.10 and 2.17.

    Examples
    --------
    >>> strip = hl.beam(0.5, 34.0, 1.6, hl.STEEL_316, at=0.2, axial_force=5e3)
    >>> strip.contacts
    1
    """
    EI, m, N, k = bending_stiffness, mass_per_length, axial_force, foundation
    within("at", at, 0.0, length, "m", or_zero=True)
    if not isinstance(supports, tuple | list) or len(supports) != 2 or not all(one in ENDS for one in supports):
        raise ValueError(f"supports = {supports!r}: must be two words, each one of {ENDS}")
    check_stress(
        f"axial_force = {N:g} N", N * material.density / m, material,
        "axial_force is in N, and the area is assumed to be mass_per_length over density",
    )  # fmt: skip
    frequency = default_frequency() if highest_frequency is None else highest_frequency
    wavelength = (EI / m) ** 0.25 * (2.0 * pi / frequency) ** 0.5
    cells = Hermite().cells(min(wavelength, length / FEWEST_WAVES), ()).finer()
    if length / cells.coarsest > MOST_NODES:
        raise ValueError(
            f"highest_frequency = {frequency!r}: must be lower, as it requires more than {MOST_NODES} nodes"
        )

    def matrices(shapes: Beam) -> tuple[sparse.csr_array, sparse.csr_array]:
        P = shapes.integrals()
        return shapes.matrix(m * P[0, 0]), shapes.matrix(EI * P[2, 2] + k * P[0, 0] + N * P[1, 1])

    if N < 0.0:
        # A mesh that is much finer than the first mode would hide a negative eigenvalue by rounding.
        count = ceil(8.0 * max(FEWEST_WAVES, length * (k / EI) ** 0.25 / (2.0 * pi)))
        _, pressed = matrices(Beam(np.linspace(0.0, length, count + 1), *supports))
        if not is_definite("stiffness", pressed):
            raise ValueError(f"axial_force = {axial_force!r}: must be less compressive, as it buckles the beam")
    shapes = Beam(graded(length, [at], cells), *supports)
    mass, stiffness = matrices(shapes)
    made = Structure(mass, stiffness, None, shapes.at(at), 0.0, Surface(material), {"highest_frequency": frequency})
    same = length, bending_stiffness, mass_per_length, material, at, supports, axial_force, foundation
    return made.made_by(partial(beam, *same, highest_frequency))
