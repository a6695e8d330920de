"""Thesis figures 3.2, 5.3, 5.7 and 5.12 and Table 5.1: contact laws computed with finite and boundary elements."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from math import degrees, log2, pi, sqrt
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from coupling.sweeps.progress import watched
from hertzlink.studies import cylinders, draw, ellipsoids, hollow_spheres
from hertzlink.studies.cut_cylinders import angle_of_ends, approach_of_ends, cut_law
from hertzlink.studies.expected import Rows
from hertzlink.studies.table import MEASURED, SIMULATED, Row
from particles.laws.computed import ComputedLaw
from particles.laws.power_fit import PowerFit
from particles.solitary import HERTZ
from structures.surface import relative_curvatures

row = Rows("contact_law")
LARGEST_APPROACH = 25e-6  # Largest approach of the laws, m; under 100 N the thinnest shells approach by 23 µm.
APPROACHES = tuple(np.array([0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 5.0, 7.0, 10.0, 15.0, 20.0]) * 1e-6)
# Index of the first approach at which forces of meshes are compared, 5 µm: the coarsest mesh has no force below it.
FIRST_COMPARED = 8
# By method: number of cells over the radius or half-width of the widest contact, or along each side of a half-space's
# grid.
CELLS = {
    "axisymmetric": 30.0,
    "plane strain": 40.0,
    "plane stress": 40.0,
    "three-dimensional": 20.0,
    "half-space": 64.0,
    "cut half-space": 64.0,
}
# What "similar" and "good agreement" allow: curves that differ by less lie on one another in a printed figure.
SIMILAR = 0.02


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
        cells = CELLS[self.method] / coarser
        if self.method == "cut half-space":
            return cut_law(degrees(self.second.angle), LARGEST_APPROACH, int(cells))
        if self.method == "half-space":
            midplane = isinstance(self.first, hl.Cylinder)
            options: dict[str, Any] = {"method": "half-spaces", "midplane": midplane, "cells": int(cells)}
        else:
            options = {"method": self.method, "spacing": self.widest / cells}
        return hl.laws.computed_law(self.first, self.second, max_approach=LARGEST_APPROACH, **options)

    @property
    def widest(self) -> float:
        """Theoretical radius, or half-width, of the contact at LARGEST_APPROACH, m (Johnson's equations 4.22 and
        4.43).
        """
        sharp = relative_curvatures(self.first.surface, self.second.surface)[1]
        softness = 2.0 / self.first.material.contact_modulus
        force = float(self.theory.force(np.array(LARGEST_APPROACH)))
        if self.method == "axisymmetric":
            return float((0.75 * force * softness / sharp) ** (1.0 / 3.0))
        return sqrt(4.0 * force * softness / (pi * cylinders.LENGTH * sharp))


SPHERES = "spheres"
MINOR, MAJOR, EQUIVALENT = "ellipsoids, minor axes", "ellipsoids, major axes", "equivalent spheres"
STRAIN, STRESS = "parallel cylinders, plane strain", "parallel cylinders, plane stress"
SOLID = "parallel cylinders, three-dimensional"
ELLIPSOIDS = {MINOR: "minor axes", MAJOR: "major axes", EQUIVALENT: "equivalent spheres"}
ANGLES = (1.0, 3.0, 5.0, 10.0, 30.0, 90.0)  # Degrees between cylinders that cross.
# Degrees. From this angle on, contacts are short enough for the correction of the mid-planes; below it they extend to
# the ends of the cylinders.
SHORT_CONTACT_ANGLE = 30.0


def crossed(angle: float) -> str:
    """Name of the contact of cylinders crossed at an angle, degrees."""
    return f"cylinders at {angle:g}°"


def hollow(ratio: float) -> str:
    """Name of the contact of hollow spheres with this ratio of inner to outer radius."""
    return f"hollow spheres, Ri/Ro {ratio:g}"


def half_space(angle: float) -> str:
    """Return the method for cylinders at an angle, degrees."""
    return "half-space" if angle >= SHORT_CONTACT_ANGLE else "cut half-space"


def contacts() -> dict[str, Contact]:
    """Return the thesis's contacts by name."""
    minor, major, sphere = (ellipsoids.particle(shape) for shape in ellipsoids.SHAPES)
    flat, steel = cylinders.cylinder(0.0), hl.Sphere(2.38e-3, hl.STEEL_316)
    shells = {ratio: hollow_spheres.particle(ratio) for ratio in hollow_spheres.TABLE_5_1}
    return {
        SPHERES: Contact(steel, steel),
        MINOR: Contact(minor, minor, "half-space"),
        MAJOR: Contact(major, major),
        EQUIVALENT: Contact(sphere, sphere),
        STRAIN: Contact(flat, flat, "plane strain"),
        STRESS: Contact(flat, flat, "plane stress"),
        SOLID: Contact(flat, flat, "three-dimensional"),
        **{crossed(angle): Contact(flat, cylinders.cylinder(angle), half_space(angle)) for angle in ANGLES},
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


LIKE_TABLE_5_1 = "0.2 to 10 µm, absolute"
FITS = {
    LIKE_TABLE_5_1: Fitted(0.2e-6, 10e-6, "m", "absolute"),
    "0.2 to 10 µm, relative": Fitted(0.2e-6, 10e-6, "m", "relative"),
    "0.2 to 20 µm, absolute": Fitted(0.2e-6, 20e-6, "m", "absolute"),
    "1 to 10 N, relative": Fitted(1.0, 10.0, "N", "relative"),
    "10 to 100 N, relative": Fitted(10.0, 100.0, "N", "relative"),
    "1 to 100 N, relative": Fitted(1.0, 100.0, "N", "relative"),
}
# If an exponent differs from Hertz's by less than this, the ends do not influence the fitted range.
HERTZ_EXPONENT_DIFFERENCE = 1e-3
REFINED = (SPHERES, hollow(hollow_spheres.THIN), STRAIN)
MESHES = (4.0, 2.0, 1.0, 0.5)  # Cell sizes of the meshes of figure "convergence", in units of those of CELLS.


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return the force over approach for each contact, with theory and Table 5.1; fits; changes of the force on finer
    meshes.

    quick: cells twice as large. jobs: always one process, because each law takes a second.
    """
    chosen, approach = contacts(), np.array(APPROACHES)
    laws = {name: contact.law(2.0 if quick else 1.0) for name, contact in watched(chosen.items())}
    fits = [[fitted.of(law) for fitted in FITS.values()] for law in laws.values()]
    meshes = MESHES[:-1] if quick else MESHES
    changes = [refinement(chosen[name], meshes) for name in watched(REFINED)]
    printed = [law.force(approach) for law in hollow_spheres.TABLE_5_1.values()]
    theory = [contact.theory.force(approach) for contact in chosen.values()]
    over = ("contact", "approach")
    data = xr.Dataset(
        {
            "force": (over, [law.force(approach) for law in laws.values()], {"units": "N"}),
            "theory": (over, theory, {"units": "N", "long_name": "contact law by formulas"}),
            "printed": (("ratio", "approach"), printed, {"units": "N", "long_name": "contact law of Table 5.1"}),
            "error": ("contact", [law.error for law in laws.values()], {"long_name": "largest error of the force"}),
            "order": ("contact", [law.order for law in laws.values()], {"long_name": "observed order"}),
            "exponent": (("contact", "fit"), [[fit.exponent for fit in row] for row in fits]),
            "stiffness": (("contact", "fit"), [[fit.stiffness for fit in row] for row in fits]),
            "misfit": (("contact", "fit"), [[fit.misfit for fit in row] for row in fits]),
            "change": (
                ("refined", "coarser"),
                changes,
                {"long_name": "mean change of the force by cells half as large"},
            ),
        },
        coords={
            "contact": list(laws),
            "approach": ("approach", approach, {"units": "m"}),
            "ratio": list(hollow_spheres.TABLE_5_1),
            "fit": list(FITS),
            "refined": list(REFINED),
            "coarser": list(meshes[:-1]),
        },
    )
    for name in ("error", "order", "exponent", "misfit", "change"):
        data[name].attrs["units"] = "1"
    data["stiffness"].attrs["units"] = "N/m^n"
    return data


def refinement(contact: Contact, meshes: tuple[float, ...]) -> list[float]:
    """Return the mean relative change of the force from each mesh to the next."""
    forces = [contact.law(coarser).force(np.array(APPROACHES[FIRST_COMPARED:])) for coarser in meshes]
    return [float(np.abs(force / finer - 1.0).mean()) for force, finer in pairwise(forces)]


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of sections 3.3.1, 5.3.1, 5.3.2 and 5.3.3, compared with those of hertzlink."""
    return [*_spheres(data), *_ellipsoids(data), *_cylinders(data), *_hollow_spheres(data), *_meshes(data)]


def _exponent(data: xr.Dataset, name: str, fit: str = LIKE_TABLE_5_1) -> float:
    return float(data.exponent.sel(contact=name, fit=fit))


def _exponents(data: xr.Dataset, name: str, *fits: str) -> str:
    """Return the exponents of several fits, each with its range."""
    return "; ".join(f"{_exponent(data, name, fit):.3f} over {fit}" for fit in fits)


def _over_theory(data: xr.Dataset, name: str) -> str:
    """Return the force in units of the theoretical force, as a difference in per cent, at three approaches."""
    above = 100.0 * (data.force / data.theory - 1.0).sel(contact=name)
    return ", ".join(f"{float(_at(above, micron)):+z.1f} % at {micron:g} µm" for micron in (1.0, 5.0, 20.0))


def _at(values: xr.DataArray, micron: float) -> xr.DataArray:
    """Return the value at one of APPROACHES, µm."""
    return values.sel(approach=micron * 1e-6, method="nearest", tolerance=1e-12)


def _ratio(data: xr.Dataset, name: str) -> float:
    """Return the force over the theoretical force at 5 µm."""
    return float(_at((data.force / data.theory).sel(contact=name), 5.0))


def _spheres(data: xr.Dataset) -> list[Row]:
    """Return figure 3.2."""
    relative = "0.2 to 10 µm, relative"
    others = _exponents(data, SPHERES, LIKE_TABLE_5_1, "1 to 100 N, relative")
    return [
        row("exponent n, steel spheres", _exponent(data, SPHERES, relative), relative, others),
        row("F over Hertz's at 5 µm, steel spheres", _ratio(data, SPHERES), _over_theory(data, SPHERES),
            holds=abs(_ratio(data, SPHERES) - 1.0) < SIMILAR),
    ]  # fmt: skip


def _ellipsoids(data: xr.Dataset) -> list[Row]:
    """Return figure 5.3."""
    stiffness = float(_at(data.force.sel(contact=MAJOR), 1.0)) / 1e-6**1.5 * 1e-9
    return [
        row("k, major axes", stiffness),
        *(
            row(f"F over Hertz's at 5 µm, {name}", _ratio(data, name), _over_theory(data, name),
                holds=abs(_ratio(data, name) - 1.0) < SIMILAR)
            for name in ELLIPSOIDS
        ),
    ]  # fmt: skip


def _cylinders(data: xr.Dataset) -> list[Row]:
    """Return figure 5.7."""
    force = "1 to 100 N, relative"
    ranges = _exponents(data, STRAIN, LIKE_TABLE_5_1, "0.2 to 20 µm, absolute")
    rows = [
        row(f"exponent n, {STRAIN}", _exponent(data, STRAIN, force), force, ranges),
        row(f"exponent n, {STRESS}", _exponent(data, STRESS, force), force),
        row(f"exponent n, {SOLID}", _exponent(data, SOLID, force), force,
            _exponents(data, SOLID, LIKE_TABLE_5_1, "0.2 to 20 µm, absolute")),
        row(f"F over equation 5.8 at 5 µm, {SOLID}", _ratio(data, SOLID), _ratio(data, STRAIN), _ratio(data, STRESS),
            holds=abs(_ratio(data, SOLID) - 1.0) > SIMULATED),
    ]  # fmt: skip
    return [*rows, *(_crossed(data, angle) for angle in ANGLES), _limit()]


def _crossed(data: xr.Dataset, angle: float) -> Row:
    """Return the exponent of cylinders crossed at an angle, degrees, figure 5.7e; the theory is Hertz's."""
    name, fit = crossed(angle), "0.2 to 20 µm, absolute"
    exponent, narrow = _exponent(data, name, fit), _exponents(data, name, LIKE_TABLE_5_1)
    shares = f"F over Hertz's: {_over_theory(data, name)}"
    if angle >= SHORT_CONTACT_ANGLE:
        close = abs(exponent - HERTZ) < SIMILAR * HERTZ
        return row("wide angle", exponent, fit, narrow, shares, theory=HERTZ, holds=close, angle=name)
    ends = approach_of_ends(angle)
    if ends > FITS[fit].highest:
        exponents = _exponents(data, name, fit, LIKE_TABLE_5_1)
        return row("angle without answer", "no answer", 1e6 * ends, exponents, theory=HERTZ, angle=name)
    said = fit, narrow, 1e6 * ends, shares
    return row("small angle", exponent, *said, theory=HERTZ, holds=exponent < HERTZ, angle=name)


def _limit() -> Row:
    """Return the angle down to which Hertz's law holds, from the finite length of the cylinders."""
    small, large = (angle_of_ends(approach) for approach in (10e-6, 20e-6))
    at = 1e6 * approach_of_ends(30.0)
    return row("angle above which Hertz's law holds", f"{small:.1f} to {large:.1f}", at)


def _hollow_spheres(data: xr.Dataset) -> list[Row]:
    """Return figure 5.12 and Table 5.1."""
    rows = []
    for ratio, law in hollow_spheres.TABLE_5_1.items():
        name = hollow(ratio)
        share = (data.force.sel(contact=name) / data.printed.sel(ratio=ratio) - 1.0).where(data.approach > 0.9e-6)
        k = float(data.stiffness.sel(contact=name, fit=LIKE_TABLE_5_1))
        rows += [
            row("F of hollow spheres", float(_at(data.force.sel(contact=name), 5.0)), 100.0 * float(share.min()),
                100.0 * float(share.max()), theory=float(law.force(np.array(5e-6))), ratio=ratio),
            Row(f"exponent n, Ri/Ro {ratio:g}", law.exponent, _exponent(data, name), "",
                f"over {LIKE_TABLE_5_1}; {_exponents(data, name, '1 to 10 N, relative', '10 to 100 N, relative')}",
                within=SIMULATED),
            Row(f"k, Ri/Ro {ratio:g}", law.stiffness, k, "N/mⁿ", f"over {LIKE_TABLE_5_1}; meaningless without its n",
            within=MEASURED),
        ]  # fmt: skip
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
    return {
        "spheres": _figure_of_spheres(data),
        "ellipsoids": draw.compared(
            [_line(data, name, label) for name, label in ELLIPSOIDS.items()], draw.FORCE_OVER_APPROACH,
            theory="Hertz", simulation="finite and boundary elements",
        ),
        "cylinders": _figure_of_cylinders(data),
        "exponents": _figure_of_exponents(data),
        "hollow_spheres": draw.compared(
            [_printed_line(data, ratio) for ratio in hollow_spheres.TABLE_5_1], draw.FORCE_OVER_APPROACH, log=True,
            theory="the thesis's finite elements", simulation="finite elements",
        ),
        "convergence": _figure_of_convergence(data),
    }  # fmt: skip


def _line(data: xr.Dataset, name: str, label: str) -> tuple[str, np.ndarray, np.ndarray, np.ndarray]:
    """Return a curve of `draw.beside_theory`."""
    at = data.sel(contact=name)
    return label, data.approach.values * 1e6, at.force.values, at.theory.values


def _printed_line(data: xr.Dataset, ratio: float) -> tuple[str, np.ndarray, np.ndarray, np.ndarray]:
    """Return the same with the law of Table 5.1 as the theory."""
    label, approach, force, _ = _line(data, hollow(ratio), f"Ri/Ro = {ratio:g}")
    return label, approach, force, data.printed.sel(ratio=ratio).values


def _figure_of_spheres(data: xr.Dataset) -> draw.Figure:
    """Return the force over approach of two hemispheres, with the line fitted in logarithms, and the ratio to Hertz's
    force."""
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
    """Return the exponents over the angle between cylinders, for each fitted range; hollow markers where half-spaces
    only repeat Hertz."""
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
