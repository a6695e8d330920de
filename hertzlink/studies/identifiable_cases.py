"""The cases of the study of identifiability: chains against plates near an edge, and against rods with a bond."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from itertools import product
from math import ceil, pi
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from coupling.inference.information import REACH, STEP, Design, Sensitivities
from coupling.inference.misfit import GAIN, TIME_ZERO, inverse
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from structures.caution import collected
from structures.structure import Vector

BEADS, IMPACT_SPEED = 20, 0.31
NOISE, SAMPLE_EVERY = 0.01, 1e-6  # White, a part of the greatest force at each sensor; s.
RECORDS = (1.4e-3, 2.8e-3)  # s after the impact.
HIGHEST_FREQUENCY = 60e3  # Hz, resolved by the oscillators of plates; 60 to 200 kHz change AR by 1e-5.
FEATURES = "AR and TOF, bead 7"
# What is measured: the whole trace, but for the first.
MEASURED: dict[str, tuple[int, ...]] = {
    FEATURES: (7,), "bead 7": (7,), "bead 13": (13,), "bead 16": (16,), "beads 7 and 13": (7, 13),
}  # fmt: skip
DRAWS = 16  # Noisy traces from which the errors of AR and TOF are taken: exact to 18 %.
EDGE_UNKNOWNS = ("distance", "thickness", "impact_speed")
# What is not known: the others are known exactly.
EDGE_FREE: dict[str, tuple[str, ...]] = {
    "all": EDGE_UNKNOWNS, "distance and thickness": EDGE_UNKNOWNS[:2], "distance": EDGE_UNKNOWNS[:1],
}  # fmt: skip
# Half the distances of runs for derivatives, as parts of values: half of the first shows the error of its derivatives,
# four times how linear the signal is.
STEPS = (STEP, 0.5 * STEP, 4.0 * STEP)
MATERIAL_UNKNOWNS = ("distance", "thickness", "youngs_modulus")
# The contact's stiffness: known, or from the modulus of the plate, as a half-space's.
KNOWN, OF_PLATE = "known", "of the plate"
BOND_UNKNOWNS = ("bond_stiffness", "thickness", "impact_speed")
BOND_FREE: dict[str, tuple[str, ...]] = {"all": BOND_UNKNOWNS, "bond_stiffness": BOND_UNKNOWNS[:1]}
BOND_MEASURED = {"bead 7": (7,), "beads 7 and 13": (7, 13)}
BOND_RECORD = RECORDS[0]
# m: the layers' radius and the length of the lower one, of steel on a fixed base.
ROD_RADIUS, LOWER, ROD_BEAD = 9.525e-3, 50.8e-3, hl.Sphere(4.765e-3, hl.STEEL_440C)
# Thickness of the bond, m, and epoxy's density and Poisson's ratio, which do not matter.
GLUE, GLUE_DENSITY, GLUE_POISSON = 0.1e-3, 1200.0, 0.35
UPPERS = {"steel": hl.STEEL_440C, "PTFE": hl.PTFE}
CROSSING = 1e-6  # s in which a wave crosses an element of the upper layer, at most; and the fewest elements.
FEWEST = 12
CHECKED = (0.06, 0.16)  # m, the distances of the table.
DISTANCES = tuple(sorted({*(float(f"{d:.3g}") for d in np.geomspace(5e-3, 0.3, 14)), *CHECKED}))
BLIND = 0.5  # A half-width above this part of the value.
UNITS = {
    "distance": "m", "near": "m", "thickness": "m", "diameter": "m", "record": "s", "step": "1",
    "upper_thickness": "m", "bond_stiffness": "N/m3",
}  # fmt: skip
Places = dict[str, Iterable[Any]]  # Places by the name of the axis.


def edge_case(
    diameter: float, distance: float, thickness: float, impact_speed: float, youngs_modulus: float | None = None,
    contact: str = KNOWN,
) -> hl.CoSimulation:  # fmt: skip
    """Return a chain of beads against a plate, at a distance from its clamped edge."""
    bead, wall = hl.Sphere(0.5 * diameter, hl.STEEL_440C), hl.ALUMINIUM_6061
    if youngs_modulus is not None:
        wall = replace(wall, youngs_modulus=youngs_modulus)
    plate = hl.half_plane(thickness, wall, "clamped", distance, max(RECORDS), HIGHEST_FREQUENCY)
    if contact == KNOWN:
        plate = replace(plate, surface=hl.Surface(hl.ALUMINIUM_6061))
    return hl.CoSimulation(hl.Chain([bead] * BEADS, bead, impact_speed), plate)


def edge_design(
    diameter: float, values: Mapping[str, float], noise: float = NOISE, sample_every: float = SAMPLE_EVERY,
    contact: str = KNOWN,
) -> Design:  # fmt: skip
    """Return the design of one plate, for all sensors and the longest record. contact: where the modulus is not
    known."""

    def build(**unknowns: float) -> hl.CoSimulation:
        return edge_case(diameter, **unknowns, contact=contact)

    sensors = {n for group in MEASURED.values() for n in group}
    with collected():  # Points of the contact may yield: a model of elastic contacts is what is studied.
        return Design(build, values, sensors, max(RECORDS), (GAIN, TIME_ZERO), noise, sample_every)


def edge_errors(diameter: float, distance: float, thickness: float, steps: Sequence[float] = STEPS[:1]) -> xr.Dataset:
    """Return half-widths as parts of values, over steps, records, measured, free, unknowns; NaN for what is known."""
    values = dict(zip(EDGE_UNKNOWNS, (distance, thickness, IMPACT_SPEED), strict=True))
    design = edge_design(diameter, values)
    errors = np.full((len(STEPS), len(RECORDS), len(MEASURED), len(EDGE_FREE), len(EDGE_UNKNOWNS)), np.nan)
    for i, step in enumerate(steps):
        changes = Sensitivities(design, step)
        for (j, record), (k, sensors) in product(enumerate(RECORDS), enumerate(MEASURED.values())):
            if k > 0:
                errors[i, j, k] = _errors(partial(changes.waveform, sensors, record), EDGE_FREE)
        if i == 0:
            errors[i, :, 0] = _errors(changes.features(MEASURED[FEATURES], RECORDS[0], DRAWS), EDGE_FREE)
    axes: Places = {"step": STEPS, "record": RECORDS, "measured": MEASURED}
    axes |= {"free": EDGE_FREE, "unknown": EDGE_UNKNOWNS}
    return half_widths("half_width", errors, axes)


def _errors(bounds: Callable[[tuple[str, ...]], Mapping[str, float]], free: Mapping[str, tuple[str, ...]]) -> Vector:
    """Return 95 % half-widths: what is free × unknowns; NaN for what is known. bounds: standard deviations of names."""
    of_free = [bounds(names) for names in free.values()]
    return np.array([[REACH * bound.get(name, np.nan) for name in free["all"]] for bound in of_free])


def combinations_near_edge(diameter: float, near: float, thickness: float, contact: str) -> xr.Dataset:
    """Return the 95 % half-widths of the eigenvectors of the information, best first, these in rows, and the
    correlations: of relative changes of distance, thickness and modulus, by the trace of bead 7 in the shorter record.

    The impact speed, the gain and time zero are not known either.
    """
    values = (near, thickness, hl.ALUMINIUM_6061.youngs_modulus, IMPACT_SPEED)
    names = (*MATERIAL_UNKNOWNS, "impact_speed")
    changes = Sensitivities(edge_design(diameter, dict(zip(names, values, strict=True)), contact=contact))
    covariance = inverse(changes.part((7,), RECORDS[0]))[:3, :3]
    size, vectors = np.linalg.eigh(covariance)
    root = np.sqrt(np.diag(covariance))
    combined, correlated = (vectors * np.sign(vectors[0])).T, covariance / np.outer(root, root)
    over, words = ("combination", "of"), ("part in the combination", "correlation of the estimates")
    return half_widths("combination_error", REACH * np.sqrt(size), {"combination": ("best", "middle", "worst")}).assign(
        combination_of=(over, combined, {"units": "1", "long_name": words[0]}),
        correlation=(("of", "other"), correlated, {"units": "1", "long_name": words[1]}),
    ).assign_coords(of=list(MATERIAL_UNKNOWNS), other=list(MATERIAL_UNKNOWNS))  # fmt: skip


def bond_errors(upper: str, upper_thickness: float, bond_stiffness: float) -> xr.Dataset:
    """Return 95 % half-widths as parts of the values: measured × free × unknowns; NaN for what is known.

    The mesh is the same for all runs, so that derivatives are those of the rod alone. bond_stiffness: N/m³.
    """
    top = UPPERS[upper]
    elements = max(FEWEST, ceil(upper_thickness / top.bar_speed / CROSSING))

    def build(bond_stiffness: float, thickness: float, impact_speed: float) -> hl.CoSimulation:
        glue = hl.Material(bond_stiffness * GLUE, GLUE_POISSON, GLUE_DENSITY, "glue")
        stack = ((top, thickness), (glue, GLUE), (hl.STEEL_440C, LOWER))
        layers = [hl.Layer(material, length, ROD_RADIUS) for material, length in stack]
        chain = hl.Chain([ROD_BEAD] * BEADS, ROD_BEAD, impact_speed)
        return hl.CoSimulation(chain, hl.rod(layers, "fixed", elements))

    values = dict(zip(BOND_UNKNOWNS, (bond_stiffness, upper_thickness, IMPACT_SPEED), strict=True))
    with collected():
        changes = Sensitivities(Design(build, values, (7, 13), BOND_RECORD, (GAIN, TIME_ZERO), NOISE, SAMPLE_EVERY))
    each = [_errors(partial(changes.waveform, sensors, BOND_RECORD), BOND_FREE) for sensors in BOND_MEASURED.values()]
    axes: Places = {"bond_measured": BOND_MEASURED, "bond_free": BOND_FREE, "bond_unknown": BOND_UNKNOWNS}
    return half_widths("bond_error", np.array(each), axes)


def half_widths(name: str, values: Vector, axes: Places) -> xr.Dataset:
    """Return half-widths under a name, over their axes."""
    label = {"units": "1", "long_name": "half of the 95 % interval"}
    return xr.Dataset({name: (tuple(axes), values, label)}, {axis: list(places) for axis, places in axes.items()})


def contact_stiffness(upper: str) -> float:
    """Return the contact's tangent stiffness over the rod's area, N/m³, at the peak of a bead's collision."""
    stiffness = hl.theory.hertz_stiffness(ROD_BEAD.surface, hl.Surface(UPPERS[upper]))
    speed = PARTICLE_TO_STRIKER_SPEED * IMPACT_SPEED
    approach = (1.25 * ROD_BEAD.mass * speed**2 / stiffness) ** 0.4
    return float(1.5 * stiffness * approach**0.5 / (pi * ROD_RADIUS**2))
