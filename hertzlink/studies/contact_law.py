"""Thesis figures 3.2, 5.3, 5.12 and Table 5.1: contact laws by axisymmetric finite elements; figure 5.7 by formulas."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import log2, pi, sqrt
from typing import Any

import numpy as np
import xarray as xr
from scipy.optimize import brentq
from scipy.special import ellipkm1

import hertzlink as hl
from hertzlink.studies import cylinders, draw, ellipsoids, hollow_spheres
from hertzlink.studies.results import over, scalars
from hertzlink.studies.table import SIMILAR, Row, Rows
from hertzlink.studies.waves import PowerFit, power_fit
from particles.laws.axisymmetric import ComputedLaw
from particles.solitary import HERTZ
from structures.caution import collected
from structures.surface import relative_curvatures

row = Rows("contact_law")
LARGEST_APPROACH = 25e-6  # Largest approach of the laws, m; under 100 N the thinnest shells approach by 23 µm.
APPROACHES = np.array([0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0]) * 1e-6
# Index of the first approach at which forces of meshes are compared, 5 µm: the coarsest mesh has no force below it.
FIRST_COMPARED = 8
CELLS = 30.0  # Over the radius of the widest contact.
SPHERES = "spheres"
MAJOR, EQUIVALENT = "ellipsoids, major axes", "equivalent spheres"
ELLIPSOIDS = {MAJOR: "major axes", EQUIVALENT: "equivalent spheres"}
SMALL_ANGLES = (1.0, 3.0)  # Degrees between cylinders at which Hertz's contact would soon be longer than they are.


@dataclass(frozen=True)
class Contact:
    """Two equal bodies of revolution in contact."""

    body: Any

    @cached_property
    def theory(self) -> hl.ContactLaw:
        """The law by formulas."""
        return hl.contact_law(self.body, self.body)

    def law(self, coarser: float = 1.0) -> ComputedLaw:
        """Return the law, with cells that are `coarser` times as large as usual."""
        cells = CELLS / coarser
        return hl.laws.computed_law(self.body, max_approach=LARGEST_APPROACH, spacing=self.widest / cells)

    @property
    def widest(self) -> float:
        """Theoretical radius of the widest contact, m (Johnson's equation 4.22)."""
        sharp = relative_curvatures(self.body.surface, self.body.surface)[1]
        softness = 2.0 / self.body.material.contact_modulus
        force = float(self.theory.force(np.array(LARGEST_APPROACH)))
        return float((0.75 * force * softness / sharp) ** (1.0 / 3.0))


def hollow(ratio: float) -> str:
    """Return the name of the contact of hollow spheres with this ratio of inner to outer radius."""
    return f"hollow spheres, Ri/Ro {ratio:g}"


def contacts() -> dict[str, Contact]:
    """Return the thesis's contacts of bodies of revolution by name."""
    bodies = {
        SPHERES: hl.Sphere(2.38e-3, hl.STEEL_316),
        MAJOR: ellipsoids.particle("major axis"),
        EQUIVALENT: ellipsoids.particle("equivalent sphere"),
        **{hollow(ratio): hollow_spheres.particle(ratio) for ratio in hollow_spheres.TABLE_5_1},
    }
    return {name: Contact(body) for name, body in bodies.items()}


@dataclass(frozen=True)
class Fitted:
    """The range of a power-law fit: from lowest to highest, m or N, with a weighting of `power_fit`."""

    lowest: float
    highest: float
    unit: str
    weighting: str

    def of(self, law: hl.ContactLaw) -> PowerFit:
        """Return the fit of a law."""
        ends = np.array([self.lowest, self.highest])
        lowest, highest = (ends if self.unit == "m" else law.approach(ends)).tolist()
        return power_fit(law, lowest, highest, self.weighting)


LIKE_TABLE_5_1, RELATIVE, WIDE = "0.2 to 10 µm, absolute", "0.2 to 10 µm, relative", "0.2 to 20 µm, absolute"
BY_FORCE = "1 to 100 N, relative"
FITS = {
    LIKE_TABLE_5_1: Fitted(0.2e-6, 10e-6, "m", "absolute"),
    RELATIVE: Fitted(0.2e-6, 10e-6, "m", "relative"),
    WIDE: Fitted(0.2e-6, 20e-6, "m", "absolute"),
    "1 to 10 N, relative": Fitted(1.0, 10.0, "N", "relative"),
    "10 to 100 N, relative": Fitted(10.0, 100.0, "N", "relative"),
    BY_FORCE: Fitted(1.0, 100.0, "N", "relative"),
}
REFINED = (SPHERES, hollow(hollow_spheres.THIN))
MESHES = (4.0, 2.0, 1.0, 0.5)  # Cell sizes of the meshes of figure "convergence", in units of those of CELLS.


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return the force over approach by contact, with theory and Table 5.1; fits; changes of the force on finer meshes.

    quick: cells twice as large. jobs: always one process, because each law takes a second.
    """
    chosen, meshes = contacts(), MESHES[:-1] if quick else MESHES
    newton = {"units": "N"}

    def of_contact(contact: str) -> xr.Dataset:
        law = chosen[contact].law(2.0 if quick else 1.0)
        fits = [fitted.of(law) for fitted in FITS.values()]
        estimates = scalars(
            error=(law.error, "1", "largest error of the force"), order=(law.order, "1", "observed order")
        )
        return estimates.assign(
            force=("approach", law.force(APPROACHES), newton),
            theory=("approach", chosen[contact].theory.force(APPROACHES), newton | {"long_name": "law by formulas"}),
            exponent=("fit", [fit.exponent for fit in fits], {"units": "1"}),
            stiffness=("fit", [fit.stiffness for fit in fits], {"units": "N/m^n"}),
            misfit=("fit", [fit.misfit for fit in fits], {"units": "1"}),
        )

    def refinement(refined: str) -> xr.Dataset:
        forces = [chosen[refined].law(coarser).force(APPROACHES[FIRST_COMPARED:]) for coarser in meshes]
        changes = [float(np.abs(force / finer - 1.0).mean()) for force, finer in pairwise(forces)]
        label = {"units": "1", "long_name": "mean change of the force by cells half as large"}
        return xr.Dataset({"change": ("coarser", changes, label)}, {"coarser": list(meshes[:-1])})

    printed = [law.force(APPROACHES) for law in hollow_spheres.TABLE_5_1.values()]
    data = over(of_contact, contact=list(chosen)).merge(over(refinement, refined=REFINED))
    data["printed"] = (("ratio", "approach"), printed, newton | {"long_name": "contact law of Table 5.1"})
    approaches = ("approach", APPROACHES, {"units": "m"})
    return data.assign_coords(approach=approaches, fit=list(FITS), ratio=list(hollow_spheres.TABLE_5_1))


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of sections 3.3.1, 5.3.1, 5.3.2 and 5.3.3, compared with those of hertzlink."""
    return [*_spheres(data), *_cylinders(), *_hollow_spheres(data), *_meshes(data)]


def _exponent(data: xr.Dataset, name: str, fit: str = LIKE_TABLE_5_1) -> float:
    return float(data.exponent.sel(contact=name, fit=fit))


def _exponents(data: xr.Dataset, name: str, *fits: str) -> str:
    """Return the exponents of several fits, each with its range."""
    return "; ".join(f"{_exponent(data, name, fit):.3f} over {fit}" for fit in fits)


def _at(values: xr.DataArray, micron: float) -> float:
    """Return the value at one of APPROACHES, µm."""
    return float(values.sel(approach=micron * 1e-6, method="nearest", tolerance=1e-12))


def _over_theory(data: xr.Dataset, name: str) -> tuple[float, str]:
    """Return the force over the theoretical one at 5 µm, and the differences in per cent at three approaches."""
    ratio = (data.force / data.theory).sel(contact=name)
    differences = {micron: 100.0 * (_at(ratio, micron) - 1.0) for micron in (1.0, 5.0, 20.0)}
    return _at(ratio, 5.0), ", ".join(f"{value:+z.1f} % at {micron:g} µm" for micron, value in differences.items())


def _compared(data: xr.Dataset, name: str, label: str) -> Row:
    ratio, said = _over_theory(data, name)
    return row(f"F over Hertz's at 5 µm, {label}", ratio, said, holds=abs(ratio - 1.0) < SIMILAR)


def _spheres(data: xr.Dataset) -> list[Row]:
    """Return figures 3.2 and 5.3."""
    others, stiffness = _exponents(data, SPHERES, LIKE_TABLE_5_1, BY_FORCE), _at(data.force.sel(contact=MAJOR), 1.0)
    return [
        row("exponent n, steel spheres", _exponent(data, SPHERES, RELATIVE), RELATIVE, others),
        _compared(data, SPHERES, "steel spheres"),
        row("k, major axes", stiffness / 1e-6**1.5 * 1e-9),
        *(_compared(data, name, name) for name in ELLIPSOIDS),
    ]


def _cylinders() -> list[Row]:
    """Return figure 5.7, by formulas."""
    small, large = (angle_of_ends(approach) for approach in (10e-6, 20e-6))
    rows = [row("angle above which Hertz's law holds", f"{small:.1f} to {large:.1f}", 1e6 * approach_of_ends(30.0))]
    for angle in SMALL_ANGLES:
        with collected():  # `contact_law` warns of small angles; so does the row
            law = hl.contact_law(cylinders.cylinder(0.0), cylinders.cylinder(angle))
        wide, narrow = (FITS[name].of(law).exponent for name in (WIDE, LIKE_TABLE_5_1))
        said = WIDE, f"{narrow:.3f} over {LIKE_TABLE_5_1}", 1e6 * approach_of_ends(angle)
        rows.append(row("small angle", wide, *said, holds=wide < HERTZ, angle=f"cylinders at {angle:g}°"))
    return rows


def contact_length(angle: float, approach: float) -> float:
    """Return the length, m, of Hertz's contact of cylinders crossed at an angle, degrees, at an approach, m (Johnson,
    section 4.2): a b = 3F/(2π p₀) and δ = 3F K(e)/(2π a E*), with e² = 1 − (b/a)²."""
    first, second = cylinders.cylinder(0.0).surface, cylinders.cylinder(angle).surface
    force = hl.theory.hertz_stiffness(first, second) * approach**HERTZ
    product = 1.5 * force / (pi * hl.theory.hertz_pressure(first, second, force))
    if angle == 90.0:
        return 2.0 * sqrt(product)  # a circle

    def longer(square: float) -> float:
        return float(3.0 * force * ellipkm1(square) / (pi * first.material.contact_modulus * approach))

    square = brentq(lambda square: longer(square) ** 2 * sqrt(square) / product - 1.0, 1e-12, 1.0, xtol=1e-15)
    return 2.0 * longer(square)


def approach_of_ends(angle: float) -> float:
    """Return the approach, m, at which Hertz's contact is as long as the cylinders; its length goes as the root."""
    return 1e-6 * (cylinders.LENGTH / contact_length(angle, 1e-6)) ** 2


def angle_of_ends(approach: float) -> float:
    """Return the angle, degrees, above which Hertz's contact is shorter than the cylinders at an approach, m."""
    return float(brentq(lambda angle: contact_length(angle, approach) - cylinders.LENGTH, 1.0, 89.0, xtol=1e-2))


def _hollow_spheres(data: xr.Dataset) -> list[Row]:
    """Return figure 5.12 and Table 5.1."""
    rows = []
    for ratio, law in hollow_spheres.TABLE_5_1.items():
        name = hollow(ratio)
        force, over = data.force.sel(contact=name), f"over {LIKE_TABLE_5_1}"
        share = 100.0 * (force / data.printed.sel(ratio=ratio) - 1.0).where(data.approach > 0.9e-6)
        k, exponent = float(data.stiffness.sel(contact=name, fit=LIKE_TABLE_5_1)), _exponent(data, name)
        said, expected = (float(share.min()), float(share.max())), float(law.force(np.array(5e-6)))
        reason = f"{over}; {_exponents(data, name, '1 to 10 N, relative', '10 to 100 N, relative')}"
        meaning = f"{over}; meaningless without its n"
        rows += [
            row("F of hollow spheres", _at(force, 5.0), *said, theory=expected, ratio=ratio),
            hollow_spheres.of_table_5_1("exponent n, Ri/Ro", ratio, law.exponent, exponent, reason),
            hollow_spheres.of_table_5_1("k, Ri/Ro", ratio, law.stiffness, k, meaning, "N/mⁿ"),
        ]
    return rows


def _meshes(data: xr.Dataset) -> list[Row]:
    """Return the remaining errors of the meshes."""
    halvings = data.sizes["coarser"] - 1
    orders = [f"{log2(row[0] / row[-1]) / halvings:.1f}" for row in data.change.values]
    worst = str(data.contact[int(np.argmax(data.error.values))].item())
    return [
        row("order of convergence", ", ".join(orders), ", ".join(REFINED)),
        row("largest error of F", 100.0 * float(data.error.max()), worst),
    ]


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return figures 3.2, 5.3b and 5.12b of the thesis, and the convergence with finer meshes."""
    laws = {ratio: _line(data, hollow(ratio), f"Ri/Ro = {ratio:g}") for ratio in hollow_spheres.TABLE_5_1}
    printed = [(*line[:3], data.printed.sel(ratio=ratio).values) for ratio, line in laws.items()]
    return {
        "spheres": _figure_of_spheres(data),
        "ellipsoids": draw.compared(
            [_line(data, name, label) for name, label in ELLIPSOIDS.items()], draw.FORCE_OVER_APPROACH,
            theory="Hertz", simulation="finite elements",
        ),
        "hollow_spheres": draw.compared(
            printed, draw.FORCE_OVER_APPROACH, log=True,
            theory="the thesis's finite elements", simulation="finite elements",
        ),
        "convergence": _figure_of_convergence(data),
    }  # fmt: skip


def _line(data: xr.Dataset, name: str, label: str) -> draw.Line:
    """Return a curve of `draw.beside_theory`."""
    at = data.sel(contact=name)
    return label, data.approach.values * 1e6, at.force.values, at.theory.values


def _figure_of_spheres(data: xr.Dataset) -> draw.Figure:
    """Return the force over approach of two hemispheres, with the fitted line, and its ratio to Hertz's force."""
    figure, (laws, shares) = draw.panels(2, width=3.7, height=3.4, sharey=False)
    fit = data.sel(contact=SPHERES, fit="0.2 to 10 µm, relative")
    approach, force = data.approach.values, data.force.sel(contact=SPHERES).values
    draw.logarithmic(laws)
    fitted = float(fit.stiffness) * approach ** float(fit.exponent)
    draw.theory_line(laws, approach * 1e6, fitted, f"fit over 0.2 to 10 µm, n = {float(fit.exponent):.3f}")
    draw.points(laws, approach * 1e6, force, 0, "finite elements")
    laws.set(xlabel="approach (µm)", ylabel="contact force (N)")
    laws.legend()
    draw.log_x(shares)
    draw.points(shares, approach * 1e6, force / data.theory.sel(contact=SPHERES).values, 0, "finite elements")
    draw.theory_line(shares, approach * 1e6, np.ones(approach.size), "Hertz", "--")
    shares.set(xlabel="approach (µm)", ylabel="force over Hertz's", ylim=(0.98, 1.06))
    shares.legend()
    return figure


def _figure_of_convergence(data: xr.Dataset) -> draw.Figure:
    """Return the mean change of the force by halving the cells, compared with second order."""
    figure, (axis,) = draw.panels(1, width=4.6, height=3.6)
    for i, name in enumerate(data.refined.values):
        draw.points(axis, data.coarser.values, 100.0 * data.change.sel(refined=name).values, i, str(name))
    sizes = data.coarser.values
    draw.theory_line(axis, sizes, 100.0 * float(data.change[0, 0]) * (sizes / sizes[0]) ** 2, "second order")
    axis.set(xlabel="size of the cells, over the usual one", ylabel="change of the force by halving it (%)")
    draw.logarithmic(axis)
    axis.set_xticks(sizes, [f"{size:g}" for size in sizes])
    axis.legend()
    return figure
