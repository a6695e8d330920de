"""Thesis figures 3.2, 5.3, 5.7 and 5.12 and Table 5.1: contact laws computed with finite and boundary elements."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import degrees, log2, pi, sqrt
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import cylinders, draw, ellipsoids, hollow_spheres
from hertzlink.studies.cut_cylinders import angle_of_ends, approach_of_ends, cut_law
from hertzlink.studies.results import over, scalars
from hertzlink.studies.table import SIMILAR, SIMULATED, Row, Rows
from particles.laws.computed import ComputedLaw
from particles.laws.power_fit import PowerFit
from particles.solitary import HERTZ
from structures.surface import relative_curvatures

row = Rows("contact_law")
LARGEST_APPROACH = 25e-6  # Largest approach of the laws, m; under 100 N the thinnest shells approach by 23 µm.
APPROACHES = np.array([0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0]) * 1e-6
# Index of the first approach at which forces of meshes are compared, 5 µm: the coarsest mesh has no force below it.
FIRST_COMPARED = 8
# Number of cells over the radius or half-width of the widest contact, or along each side of a half-space's grid.
CELLS = {"axisymmetric": 30.0, "plane strain": 40.0, "plane stress": 40.0, "three-dimensional": 20.0}
GRID_CELLS = 64.0
SPHERES = "spheres"
MINOR, MAJOR, EQUIVALENT = "ellipsoids, minor axes", "ellipsoids, major axes", "equivalent spheres"
STRAIN, STRESS = "parallel cylinders, plane strain", "parallel cylinders, plane stress"
SOLID = "parallel cylinders, three-dimensional"
ELLIPSOIDS = {MINOR: "minor axes", MAJOR: "major axes", EQUIVALENT: "equivalent spheres"}
ANGLES = (1.0, 3.0, 5.0, 10.0, 30.0, 90.0)  # Degrees between cylinders that cross.
# Degrees. Contacts at this angle or more are short enough for the correction of the mid-planes; others reach the ends.
SHORT_CONTACT_ANGLE = 30.0


@dataclass(frozen=True)
class Contact:
    """Two beads of one material in contact, and the method that computes their law."""

    first: Any
    second: Any
    method: str = "axisymmetric"

    @cached_property
    def theory(self) -> hl.ContactLaw:
        """The law by formulas."""
        return cylinders.Tacit()(self.first, self.second)

    def law(self, coarser: float = 1.0) -> ComputedLaw:
        """Return the law, with cells of CELLS times `coarser`."""
        cells = CELLS.get(self.method, GRID_CELLS) / coarser
        if self.method == "cut half-space":
            return cut_law(degrees(self.second.angle), LARGEST_APPROACH, int(cells))
        options: dict[str, Any] = {"method": self.method, "spacing": self.widest / cells}
        if self.method == "half-space":
            midplane = isinstance(self.first, hl.Cylinder)
            options = {"method": "half-spaces", "midplane": midplane, "cells": int(cells)}
        return hl.laws.computed_law(self.first, self.second, max_approach=LARGEST_APPROACH, **options)

    @property
    def widest(self) -> float:
        """Theoretical radius, or half-width, of the widest contact, m (Johnson's equations 4.22 and 4.43)."""
        sharp = relative_curvatures(self.first.surface, self.second.surface)[1]
        softness = 2.0 / self.first.material.contact_modulus
        force = float(self.theory.force(np.array(LARGEST_APPROACH)))
        if self.method == "axisymmetric":
            return float((0.75 * force * softness / sharp) ** (1.0 / 3.0))
        return sqrt(4.0 * force * softness / (pi * cylinders.LENGTH * sharp))


def crossed(angle: float) -> str:
    """Return the name of the contact of cylinders crossed at an angle, degrees."""
    return f"cylinders at {angle:g}°"


def hollow(ratio: float) -> str:
    """Return the name of the contact of hollow spheres with this ratio of inner to outer radius."""
    return f"hollow spheres, Ri/Ro {ratio:g}"


def contacts() -> dict[str, Contact]:
    """Return the thesis's contacts by name."""
    minor, major, sphere = (ellipsoids.particle(shape) for shape in ellipsoids.SHAPES)
    flat, steel = cylinders.cylinder(0.0), hl.Sphere(2.38e-3, hl.STEEL_316)
    methods = {angle: "half-space" if angle >= SHORT_CONTACT_ANGLE else "cut half-space" for angle in ANGLES}
    shells = {ratio: hollow_spheres.particle(ratio) for ratio in hollow_spheres.TABLE_5_1}
    return {
        SPHERES: Contact(steel, steel),
        MINOR: Contact(minor, minor, "half-space"),
        MAJOR: Contact(major, major),
        EQUIVALENT: Contact(sphere, sphere),
        STRAIN: Contact(flat, flat, "plane strain"),
        STRESS: Contact(flat, flat, "plane stress"),
        SOLID: Contact(flat, flat, "three-dimensional"),
        **{crossed(angle): Contact(flat, cylinders.cylinder(angle), method) for angle, method in methods.items()},
        **{hollow(ratio): Contact(shell, shell) for ratio, shell in shells.items()},
    }


@dataclass(frozen=True)
class Fitted:
    """The range of a power-law fit: from lowest to highest, m or N, with a weighting of `fit_power_law`."""

    lowest: float
    highest: float
    unit: str
    weighting: str

    def of(self, law: ComputedLaw) -> PowerFit:
        """Return the fit of a law."""
        ends = np.array([self.lowest, self.highest])
        lowest, highest = (ends if self.unit == "m" else law.approach(ends)).tolist()
        return hl.laws.fit_power_law(law, lowest, highest, self.weighting)


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
# If an exponent differs from Hertz's by less than this, the ends do not influence the fitted range.
HERTZ_EXPONENT_DIFFERENCE = 1e-3
REFINED = (SPHERES, hollow(hollow_spheres.THIN), STRAIN)
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
    return [*_spheres(data), *_cylinders(data), *_hollow_spheres(data), *_meshes(data)]


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


def _cylinders(data: xr.Dataset) -> list[Row]:
    """Return figure 5.7."""
    ratios = {name: _over_theory(data, name)[0] for name in (SOLID, STRAIN, STRESS)}
    exponents = {name: _exponent(data, name, BY_FORCE) for name in ratios}
    others = {name: _exponents(data, name, LIKE_TABLE_5_1, WIDE) for name in ratios}
    ranges = {f"over {fit}": _exponent(data, STRAIN, fit) for fit in FITS}
    differs = abs(ratios[SOLID] - 1.0) > SIMULATED
    small, large = (angle_of_ends(approach) for approach in (10e-6, 20e-6))  # from the length of the cylinders
    return [
        row(f"exponent n, {STRAIN}", exponents[STRAIN], BY_FORCE, others[STRAIN], otherwise=ranges),
        row(f"exponent n, {STRESS}", exponents[STRESS], BY_FORCE),
        row(f"exponent n, {SOLID}", exponents[SOLID], BY_FORCE, others[SOLID]),
        row(f"F over equation 5.8 at 5 µm, {SOLID}", *ratios.values(), holds=differs),
        *(_crossed(data, angle) for angle in ANGLES),
        row("angle above which Hertz's law holds", f"{small:.1f} to {large:.1f}", 1e6 * approach_of_ends(30.0)),
    ]


def _crossed(data: xr.Dataset, angle: float) -> Row:
    """Return the exponent of cylinders crossed at an angle, degrees, figure 5.7e; the theory is Hertz's."""
    name = crossed(angle)
    exponent, narrow = _exponent(data, name, WIDE), _exponents(data, name, LIKE_TABLE_5_1)
    shares = f"F over Hertz's: {_over_theory(data, name)[1]}"
    if angle >= SHORT_CONTACT_ANGLE:
        close = abs(exponent - HERTZ) < SIMILAR * HERTZ
        return row("wide angle", exponent, WIDE, narrow, shares, theory=HERTZ, holds=close, angle=name)
    ends = approach_of_ends(angle)
    if ends > FITS[WIDE].highest:
        exponents = _exponents(data, name, WIDE, LIKE_TABLE_5_1)
        return row("angle without answer", "no answer", 1e6 * ends, exponents, theory=HERTZ, angle=name)
    said = WIDE, narrow, 1e6 * ends, shares
    return row("small angle", exponent, *said, theory=HERTZ, holds=exponent < HERTZ, angle=name)


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
    """Return figures 3.2, 5.3b, 5.7c and d, 5.7e and 5.12b of the thesis, and the convergence with finer meshes."""
    laws = {ratio: _line(data, hollow(ratio), f"Ri/Ro = {ratio:g}") for ratio in hollow_spheres.TABLE_5_1}
    printed = [(*line[:3], data.printed.sel(ratio=ratio).values) for ratio, line in laws.items()]
    return {
        "spheres": _figure_of_spheres(data),
        "ellipsoids": draw.compared(
            [_line(data, name, label) for name, label in ELLIPSOIDS.items()], draw.FORCE_OVER_APPROACH,
            theory="Hertz", simulation="finite and boundary elements",
        ),
        "cylinders": _figure_of_cylinders(data),
        "exponents": _figure_of_exponents(data),
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


def _figure_of_cylinders(data: xr.Dataset) -> draw.Figure:
    """Draw the laws of cylinders with the parallel ones, and without."""
    figure, axes = draw.panels(2, width=3.7, height=3.6, sharey=False)
    crossing = [_line(data, crossed(angle), f"{angle:g}°") for angle in (90.0, 30.0, 10.0, 5.0)]
    parallel = _line(data, SOLID, "0°, finite elements")
    draw.beside_theory(axes[0], [*crossing, parallel], *draw.FORCE_OVER_APPROACH, "theory", "boundary elements")
    draw.beside_theory(axes[1], crossing, *draw.FORCE_OVER_APPROACH, "Hertz", "boundary elements")
    return figure


def _figure_of_exponents(data: xr.Dataset) -> draw.Figure:
    """Return the exponents over the angle, by fitted range; hollow markers where half-spaces only repeat Hertz."""
    figure, (axis,) = draw.panels(1, width=4.6, height=3.6)
    names = [SOLID, *(crossed(angle) for angle in ANGLES)]
    angles = np.array([0.0, *ANGLES])
    for i, fit in enumerate(("1 to 100 N, relative", LIKE_TABLE_5_1, "0.2 to 20 µm, absolute")):
        exponents = data.exponent.sel(contact=names, fit=fit).values
        repeated = (angles < SHORT_CONTACT_ANGLE) & (abs(exponents - HERTZ) < HERTZ_EXPONENT_DIFFERENCE)
        draw.points(axis, angles[~repeated], exponents[~repeated], i, fit)
        draw.points(axis, angles[repeated], exponents[repeated], i, hollow=True)
    axis.plot([], [], "o", color="grey", markerfacecolor="white", label="half-spaces, not cut")
    draw.theory_line(axis, np.array([0.0, 90.0]), np.array([1.5, 1.5]), "Hertz", "--")
    draw.theory_line(axis, np.array([0.0, 90.0]), np.array([1.15, 1.15]), "thesis, parallel", ":")
    axis.set(xlabel="angle between the cylinders (°)", ylabel="exponent n", xscale="symlog", ylim=(1.0, 1.6))
    axis.set_xticks([0.0, *ANGLES], ["0", *(f"{angle:g}" for angle in ANGLES)])
    axis.set_xlim(-0.3, 130.0)
    axis.legend(loc="center right")
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
