"""Thesis figures 3.2, 5.3, 5.12 and Table 5.1: contact laws by axisymmetric finite elements; figure 5.7 by formulas."""

from collections.abc import Iterator
from math import pi, sqrt
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import brentq
from scipy.special import ellipkm1

import hertzlink as hl
from hertzlink.studies import cylinders, draw, ellipsoids, hollow_spheres
from hertzlink.studies.compare import Number
from hertzlink.studies.shared import along, scalars
from hertzlink.studies.waves import PowerFit, power_fit
from structures.caution import collected
from structures.surface import relative_curvatures

LARGEST_APPROACH = 25e-6  # Largest approach of the laws, m; under 100 N the thinnest shells approach by 23 µm.
APPROACHES = np.array([0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0]) * 1e-6
CELLS = 30.0  # Over the radius of the widest contact.
SMALL_ANGLES = (1.0, 3.0)  # Degrees between cylinders at which Hertz's contact would soon be longer than they are.
HOLLOW = {f"hollow spheres, Ri/Ro {ratio:g}": ratio for ratio in hollow_spheres.TABLE_5_1}
SHELL = "Hertz's law in series with Reissner's shell"
SPHERES, MAJOR, EQUIVALENT = "steel spheres", "ellipsoids, major axes", "equivalent spheres"
BODIES: dict[str, Any] = {
    SPHERES: hl.Sphere(2.38e-3, hl.STEEL_316),
    MAJOR: ellipsoids.particle("major axis"),
    EQUIVALENT: ellipsoids.particle("equivalent sphere"),
    **{name: hollow_spheres.particle(ratio) for name, ratio in HOLLOW.items()},
}

# Ranges over which power laws are fitted: their ends, m, or N where the name says so; the kind of least squares.
LIKE_TABLE_5_1, RELATIVE, WIDE = "0.2 to 10 µm, absolute", "0.2 to 10 µm, relative", "0.2 to 20 µm, absolute"
WEAK, STRONG = "1 to 10 N, relative", "10 to 100 N, relative"
FITS = {
    LIKE_TABLE_5_1: (0.2e-6, 10e-6), RELATIVE: (0.2e-6, 10e-6), WIDE: (0.2e-6, 20e-6),
    WEAK: (1.0, 10.0), STRONG: (10.0, 100.0),
}  # fmt: skip


def fitted(law: hl.laws.ContactLaw, fit: str) -> PowerFit:
    """Return the power law nearest to a law in a range of FITS."""
    ends = np.array(FITS[fit])
    lowest, highest = (law.approach(ends) if " N, " in fit else ends).tolist()
    return power_fit(law, lowest, highest, fit.endswith("relative"))


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return the force over approach by contact, with theory and Table 5.1; fits.

    quick: cells twice as large. jobs: always one process, because each law takes a second.
    """
    newton = {"units": "N"}

    def of_contact(contact: str) -> xr.Dataset:
        body = BODIES[contact]
        theory = hl.contact_law(body, body)
        # Theoretical radius of the widest contact, m (Johnson's equation 4.22).
        sharp = relative_curvatures(body.surface, body.surface)[1]
        force = float(theory.force(np.array(LARGEST_APPROACH)))
        widest = float((1.5 * force / (body.material.contact_modulus * sharp)) ** (1.0 / 3.0))
        spacing = widest / CELLS * (2.0 if quick else 1.0)
        law = hl.laws.computed_law(body, max_approach=LARGEST_APPROACH, spacing=spacing)
        fits = [fitted(law, fit) for fit in FITS]
        return scalars(error=(law.error, "1", "largest error of the force, estimated from larger cells")).assign(
            force=("approach", law.force(APPROACHES), newton),
            theory=("approach", theory.force(APPROACHES), newton | {"long_name": "law by formulas"}),
            exponent=("fit", [fit.exponent for fit in fits], {"units": "1"}),
            stiffness=("fit", [fit.stiffness for fit in fits], {"units": "N/m^n"}),
        )

    data = along("contact", BODIES, of_contact)
    printed = [law.force(APPROACHES) for law in hollow_spheres.TABLE_5_1.values()]
    data["printed"] = (("ratio", "approach"), printed, newton | {"long_name": "contact law of Table 5.1"})
    approaches = ("approach", APPROACHES, {"units": "m"})
    return data.assign_coords(approach=approaches, fit=list(FITS), ratio=list(hollow_spheres.TABLE_5_1))


def numbers(data: xr.Dataset) -> Iterator[Number]:
    # Figures 3.2 and 5.3.
    of_spheres, ratio = data.exponent.sel(contact=SPHERES), data.force / data.theory
    said = f"over {RELATIVE}; {float(of_spheres.sel(fit=LIKE_TABLE_5_1)):.3f} over {LIKE_TABLE_5_1}"
    yield Number("exponent n, steel spheres", float(of_spheres.sel(fit=RELATIVE)), said)
    for name in (SPHERES, MAJOR, EQUIVALENT):
        at = ratio.sel(contact=name).sel(approach=[1e-6, 5e-6, 20e-6], method="nearest").values.tolist()
        said = "{:+.1f} % at 1 µm, {:+.1f} % at 5 µm, {:+.1f} % at 20 µm".format(*(100.0 * (r - 1.0) for r in at))
        yield Number(f"F over Hertz's at 5 µm, {name}", at[1], said)
    lying = float(data.force.sel(contact=MAJOR).sel(approach=1e-6, method="nearest"))
    by_hertz = hl.theory.hertz_stiffness(BODIES[MAJOR].surface, BODIES[MAJOR].surface)
    yield Number("k, major axes", {"": lying / 1e-6**1.5 * 1e-9, "Hertz's k": by_hertz * 1e-9})

    # Figure 5.7, by formulas.
    reached = 1e6 * approach_of_ends(30.0)
    said = f"where Hertz's contact is as long as the cylinders, at 10 to 20 µm; at 30° that is so at {reached:.0f} µm"
    yield Number("angle above which Hertz's law holds", (angle_of_ends(10e-6), angle_of_ends(20e-6)), said)
    for angle in SMALL_ANGLES:
        with collected():  # `contact_law` warns of small angles; so does the row
            law = hl.contact_law(cylinders.cylinder(0.0), cylinders.cylinder(angle))
        wide, narrow = (fitted(law, fit).exponent for fit in (WIDE, LIKE_TABLE_5_1))
        reached = 1e6 * approach_of_ends(angle)
        said = f"over {WIDE}; {narrow:.3f} over {LIKE_TABLE_5_1}; the ends matter from {reached:.2g} µm on"
        yield Number(f"exponent n, cylinders at {angle:g}°", wide, said)

    # Figure 5.12 and Table 5.1: by finite elements, and by Hertz in series with Reissner's shell.
    for name, wall in HOLLOW.items():
        at, shell = data.sel(contact=name), fitted(hollow_spheres.law_of(wall), LIKE_TABLE_5_1)
        weak, strong = (float(at.exponent.sel(fit=fit)) for fit in (WEAK, STRONG))
        exponent, stiffness = (float(at[what].sel(fit=LIKE_TABLE_5_1)) for what in ("exponent", "stiffness"))
        said = f"over {LIKE_TABLE_5_1}; {weak:.3f} over {WEAK}; {strong:.3f} over {STRONG}"
        yield Number(f"exponent n, Ri/Ro {wall:g}", {"": exponent, SHELL: shell.exponent}, said)
        yield Number(f"k, Ri/Ro {wall:g}", {"": stiffness, SHELL: shell.stiffness}, f"over {LIKE_TABLE_5_1}")
    yield Number("largest error of F", 100.0 * float(data.error.max()), "estimated from larger cells", "%")


def contact_length(angle: float, approach: float) -> float:
    """Return the length, m, of Hertz's contact of cylinders crossed at an angle, degrees, at an approach, m (Johnson,
    section 4.2): a b = 3F/(2π p₀) and δ = 3F K(e)/(2π a E*), with e² = 1 − (b/a)²."""
    first, second = cylinders.cylinder(0.0).surface, cylinders.cylinder(angle).surface
    force = hl.theory.hertz_stiffness(first, second) * approach**1.5
    product = 1.5 * force / (pi * hl.theory.hertz_pressure(first, second, force))
    if angle == 90.0:
        return 2.0 * sqrt(product)  # a circle

    def longer(square: float) -> float:
        return float(3.0 * force * ellipkm1(square) / (pi * first.material.contact_modulus * approach))

    square = brentq(lambda square: longer(square) ** 2 * sqrt(square) / product - 1.0, 1e-12, 1.0, xtol=1e-15)
    return 2.0 * longer(square)


def approach_of_ends(angle: float) -> float:
    """Return the approach, m, at which Hertz's contact is as long as the cylinders; its length is ∝ √approach."""
    return 1e-6 * (cylinders.LENGTH / contact_length(angle, 1e-6)) ** 2


def angle_of_ends(approach: float) -> float:
    """Return the angle, degrees, above which Hertz's contact is shorter than the cylinders at an approach, m."""
    return float(brentq(lambda angle: contact_length(angle, approach) - cylinders.LENGTH, 1.0, 89.0, xtol=1e-2))


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return figures 5.3b and 5.12b of the thesis."""
    microns = data.approach.values * 1e6

    def line(name: str, label: str, expected: xr.DataArray) -> draw.Line:
        return label, microns, data.force.sel(contact=name).values, expected.values

    hertz = [line(name, label, data.theory.sel(contact=name))
             for name, label in ((MAJOR, "major axes"), (EQUIVALENT, "equivalent spheres"))]  # fmt: skip
    printed = [line(name, f"Ri/Ro = {ratio:g}", data.printed.sel(ratio=ratio)) for name, ratio in HOLLOW.items()]
    labels, computed, theirs = draw.FORCE_OVER_APPROACH, "finite elements", "the thesis's finite elements"

    return {
        "ellipsoids": draw.compared(hertz, labels, theory="Hertz", simulation=computed),
        "hollow_spheres": draw.compared(printed, labels, log=True, theory=theirs, simulation=computed),
    }
