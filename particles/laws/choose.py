"""`computed_law` picks the numerical method for the contact of two bodies."""

from collections.abc import Callable
from functools import partial
from inspect import signature
from typing import Annotated, Any

from particles.bead import Bead, Cylinder, Ellipsoid, HollowSphere, Sphere, check_bead, check_body
from particles.laws.axisymmetric import contact_law_fem
from particles.laws.computed import ComputedLaw
from particles.laws.formulas import LINE
from particles.laws.half_spaces import contact_law_bem
from particles.laws.plane import contact_law_plane
from particles.laws.solid import contact_law_solid
from structures.described import checked_call
from structures.quantities import Length, OneOf, Quantity
from structures.surface import Surface, relative_curvatures

METHODS: dict[str, Callable[..., ComputedLaw]] = {
    "axisymmetric": contact_law_fem,
    "half-spaces": contact_law_bem,
    "plane strain": partial(contact_law_plane, state="strain"),
    "plane stress": partial(contact_law_plane, state="stress"),
    "three-dimensional": contact_law_solid,
}
"""A new method is one more line here."""

SLENDER = 10.0
"""Length over radius of parallel cylinders, from which plane strain replaces tetrahedra. An end changes the contact
over about one radius, so here a fifth of the length lies near the two ends."""


@checked_call
def computed_law(
    first: Bead,
    second: Bead | Surface | None = None,
    max_force: Annotated[float, Quantity("N", "a force", "2 N")] | None = None,
    max_approach: Length | None = None,
    method: Annotated[str, OneOf(*METHODS)] | None = None,
    **options: Any,
) -> ComputedLaw:
    """Return the law of two bodies by the numerical method that suits them.

    Bodies of revolution that touch at their poles: axisymmetric finite elements. Parallel cylinders: tetrahedra if they
    are equal and shorter than ten radii, else plane strain. All others: boundary elements on half-spaces, with the
    approach of the mid-planes between Spheres and Cylinders.

    Parameters
    ----------
    first : Bead
        One body.
    second : Bead or Surface, optional
        The other one, or a surface; by default like the first.
    max_force : float, optional
        Force up to which the law is computed, N. Give this or max_approach.
    max_approach : float, optional
        Approach up to which the law is computed, m.
    method : str, optional
        "axisymmetric", "half-spaces", "plane strain", as in the middle of long cylinders, "plane stress", as in thin
        discs, or "three-dimensional".
    **options
        Further arguments of the method. `spacing`, m: the size of the finite elements at the contact. `midplane`:
        "roller", whose mid-planes slide sideways as in the thesis, or "clamped", of "axisymmetric"; of "half-spaces"
        True where the approach is that of the mid-planes, as between Spheres and Cylinders. `cells` of "half-spaces",
        32 to 512 along each side of the grid; grids of half and a quarter as many show the error. `correction` of
        "half-spaces", m/N of both bodies or of each: the displacement of a half-space under a unit force between the
        mid-plane and infinity, less what the body adds above its mid-plane.

    Returns
    -------
    ComputedLaw
        Its name states the method; it holds its error, and for finite elements the observed order of convergence.

    Raises
    ------
    ValueError
        For another method, for bodies and options that the method does not take, and for a contact of few elements.
    RuntimeError
        Where the nodes in contact, or the pressures, were not found.

    References
    ----------
    Khatri's thesis, sections 3.2 and 5.3; Johnson, Contact Mechanics (1985), section 5.6; Polonsky and Keer, Wear 231
    (1999) 206.

    Examples
    --------
    >>> import hertzlink as hl
    >>> bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    >>> hl.laws.computed_law(bead, max_force=50.0, spacing=20e-6).name
    'finite elements'
    >>> crossed = hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316, angle=1.5)
    >>> hl.laws.computed_law(bead, crossed, max_force=20.0, cells=32, midplane=False).name
    'boundary elements'
    """
    check_bead("first", first, "a body")
    other = first if second is None else check_body("second", second)
    name = method_for(first, other) if method is None else method
    if name == "half-spaces":
        has_midplane = all(isinstance(body, Sphere | Cylinder | Surface) for body in (first, other))
        options = {"midplane": has_midplane and "correction" not in options} | options
    takes = [*signature(METHODS[name]).parameters][2:]
    for option in options:
        if option not in takes:
            raise ValueError(f"{option}: is no option of the method {name!r}; its options are {', '.join(takes)}")
    return METHODS[name](first, other, max_force=max_force, max_approach=max_approach, **options)


def method_for(first: Bead, second: Bead | Surface) -> str:
    """Return the name of the method that suits two bodies."""
    if _is_round(first) and _is_round(second):
        return "axisymmetric"
    if isinstance(first, Cylinder) and isinstance(second, Cylinder):
        flat, sharp = relative_curvatures(first.surface, second.surface)
        if flat <= LINE * sharp:
            short = first == second and first.length < SLENDER * first.radius
            return "three-dimensional" if short else "plane strain"
    return "half-spaces"


def _is_round(body: Bead | Surface) -> bool:
    """Return whether a body is one of revolution about the chain's axis."""
    if isinstance(body, Surface):
        return body.second_curvature == body.curvature
    return isinstance(body, Sphere | HollowSphere) or (isinstance(body, Ellipsoid) and body.axis == "along")
