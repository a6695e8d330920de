"""Good calls of the public API except plots, as cheap as possible; tests/fuzz.py spoils their arguments."""

from collections.abc import Callable, Mapping
from functools import cache, wraps
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import xarray as xr
from fuzz import Target

import hertzlink as hl
from hertzlink import damping, laws, stepping, theory

STEEL, BRASS = hl.STEEL_440C, hl.BRASS_360
BEAD = hl.Sphere(4.76e-3, STEEL)
LYING = hl.Cylinder(2.38e-3, 4.76e-3, hl.STEEL_316)
SHELL = hl.HollowSphere(9.525e-3, 8.655e-3, STEEL)
FLAT = hl.Surface(hl.PTFE)
CHAIN = hl.Chain([BEAD] * 3, BEAD, 0.3)
DEFORMABLE = hl.DeformableChain([BEAD] * 2, BEAD, 0.3, modes=2)
LAYERS = [hl.Layer(STEEL, 6e-3, 9.5e-3), hl.Layer(hl.PTFE, 25e-3, 9.5e-3)]
ROD = hl.rod(LAYERS, elements=6)
WALL = hl.half_space(STEEL)
CLAMPED = hl.Supports(left="clamped")
PLATE = hl.kirchhoff_plate(0.1, 0.1, 2e-3, hl.ALUMINIUM_6061, CLAMPED, cells=(4, 4))
THICK = hl.mindlin_plate(0.1, 0.1, 4e-3, hl.ALUMINIUM_6061, CLAMPED, cells=(4, 4))
TRIANGLE = hl.Outline([(0, 0), (0.1, 0), (0, 0.08)], edges=["base", "slope", "wall"])
STIFFNESS = theory.hertz_stiffness(BEAD.surface, BEAD.surface)
UNTIL = 2e-5  # s
HUGE = (10**6, 10**9)
LONG = {"until": (1e-3, 1e12)}  # a warning says how often a wave could run through the chain
TIMES = np.linspace(0.0, 4e-4, 801)


def pulse(peak: float, at: float) -> np.ndarray:
    return peak * np.exp(-(((TIMES - at) / 1e-5) ** 2))


@cache
def folder() -> Path:
    made = Path(mkdtemp(prefix="fuzz"))
    np.savetxt(made / "scope.csv", np.column_stack([TIMES, pulse(0.5, 1e-4) + pulse(0.3, 3e-4)]), delimiter=",")
    return made


def tap(path: Path) -> xr.Dataset:
    return hl.as_signal(TIMES, {7: pulse(50.0, 1e-4) + pulse(30.0, 3e-4)})


@cache
def record() -> xr.Dataset:
    """A run long enough for a reflected wave at bead 3."""
    return hl.CoSimulation(hl.Chain([BEAD] * 8, BEAD, 0.3), WALL).run(until=2.5e-4)


def simulation(**given: Any) -> hl.CoSimulation:
    return hl.CoSimulation(**{"chain": CHAIN, "structure": ROD, **given})


def run(chain: Any) -> xr.Dataset:
    return hl.CoSimulation(chain, WALL).run(until=UNTIL)


def push(structure: hl.Structure) -> Any:
    moving = stepping.MovingStructure(structure)
    force = 1.0 if np.ndim(moving.structure.flexibility) == 0 else np.ones(structure.contacts)
    state, where = moving.advance(moving.start(), force, 1e-7)
    return [state.displacement, where]


def strike(structure: Any) -> xr.Dataset:
    return hl.CoSimulation(CHAIN, structure).run(until=UNTIL)


def with_loss(loss: Any) -> xr.Dataset:
    return run(hl.Chain([BEAD] * 3, BEAD, 0.3, dissipation=loss))


def in_beads(loss: Any) -> xr.Dataset:
    return run(hl.DeformableChain([BEAD] * 2, BEAD, 0.3, modes=2, damping=loss))


def of_law(law: Any) -> Any:
    x = np.array([0.0, 1e-7, 1e-6])
    return [law.force(x), law.energy(x), law.tangent(x), run(hl.Chain([BEAD] * 2, BEAD, 0.01, law=law))]


def of_yielding(law: Any) -> Any:
    found = law.contact(BEAD, BEAD)
    x = np.array([0.0, 1e-7, 1e-6])
    return [found.force(x), found.dent(x), run(hl.Chain([BEAD] * 2, BEAD, 0.05, law=law))]


def between(law: Any) -> Any:
    return [law.force(np.array([0.0, 1e-7])), law.energy(np.array([0.0, 1e-7]))]


def with_scheme(scheme: Any) -> xr.Dataset:
    return hl.CoSimulation(CHAIN, ROD, scheme=scheme).run(until=UNTIL)


def at_middle(plate: Any) -> Any:
    return push(plate.at(0.05, 0.02))


def against(speed: Any = 0.3) -> hl.CoSimulation:
    return hl.CoSimulation(hl.Chain([BEAD] * 3, BEAD, speed), WALL)


@cache
def tapped() -> xr.Dataset:
    """A signal of bead 2."""
    run = against(0.3).run(until=1e-4, save_every=1e-6)
    return hl.as_signal(run.time, {2: hl.sensor_force(run, 2)})


def mesh() -> Any:
    import skfem.io.meshio

    line = np.linspace(0.0, 20e-3, 4)
    return skfem.io.meshio.to_meshio(skfem.MeshHex.init_tensor(line, line, line))


@cache
def things() -> list[Any]:
    """Objects of hertzlink, for places where they do not belong."""
    return [
        *(STEEL, BEAD, LYING, SHELL, FLAT, CHAIN, DEFORMABLE, LAYERS[0], LAYERS, ROD, WALL, CLAMPED, PLATE, TRIANGLE),
        *(record(), hl.LinearDashpot(5.0), laws.PowerLaw(1e10), hl.Aitken(), hl.Sphere, hl.Chain, hl, [BEAD], [CHAIN]),
        *(hl.Piston(), hl.ElasticEdge(1e6), simulation, simulation()),
        *(hl.Ellipsoid(2e-3, 6e-3, STEEL, "across"), hl.Sphere(1e-6, STEEL), hl.Sphere(100.0, hl.PTFE)),
        hl.Material(1e-3, 0.3, 1e4),
    ]


@cache
def targets() -> dict[str, Target]:
    return {**_bodies(), **_chains(), **_structures(), **_plates(), **_runs(), **_measures(), **_formulas(), **_laws()}


def _bodies() -> dict[str, Target]:
    round_ = {"radius": 4.76e-3, "material": STEEL}
    moduli = {"youngs_modulus": 70e9, "poisson_ratio": 0.22, "density": 2500.0}

    def facts(bead: Any) -> Any:
        return [bead.mass, bead.size, hl.contact_law(bead, bead).force(1e-6)]

    return {
        "Sphere": Target(hl.Sphere, round_, facts),
        "HollowSphere": Target(hl.HollowSphere, {**round_, "inner_radius": 3e-3}, facts),
        "Cylinder": Target(hl.Cylinder, {**round_, "length": 5e-3, "angle": 0.1}, facts),
        "Ellipsoid": Target(hl.Ellipsoid, {**round_, "length": 5e-3, "axis": "along", "angle": 0.0}, facts),
        "Material": Target(hl.Material, {**moduli, "name": "glass"}, lambda one: facts(hl.Sphere(4.76e-3, one))),
        "MATERIALS": Target(lambda material: hl.MATERIALS[material], {"material": "PTFE"}),
        "Surface": Target(
            hl.Surface,
            {"material": STEEL, "curvature": 10.0, "second_curvature": 5.0, "direction": 0.1},
            lambda one: theory.hertz_stiffness(one, FLAT),
        ),
        "drop_speed": Target(hl.drop_speed, {"height": 0.01}),
        "Layer": Target(hl.Layer, {"material": STEEL, "length": 1e-2, "radius": 1e-2}, lambda one: hl.rod([one]).mass),
        "ElasticEdge": Target(hl.ElasticEdge, {"translation": 1e7, "rotation": 1e3}),
        "Supports": Target(
            hl.Supports, {"left": "free", "right": "clamped", "bottom": hl.ElasticEdge(), "top": "free"}
        ),
        "PointMass": Target(hl.PointMass, {"x": 0.05, "y": 0.05, "mass": 1e-3}, with_addition),
        "Stiffener": Target(
            hl.Stiffener,
            {
                **{"start": (0.0, 0.05), "end": (0.1, 0.05), "bending_stiffness": 100.0},
                **{"torsion_stiffness": 1.0, "mass_per_length": 0.1},
            },
            with_addition,
        ),
        "Weakened": Target(hl.Weakened, {"region": (0.02, 0.05, 0.02, 0.05), "factor": 0.25}, with_addition),
        "circle": Target(
            hl.circle, {"radius": 0.1, "centre": (0.0, 0.0), "corners": 12}, more={"corners": (10**6, 10**9, 2, 3)}
        ),
        "Outline": Target(
            hl.Outline,
            {"corners": ((0, 0), (0.1, 0), (0.0, 0.08)), "holes": (((0.02, 0.02), (0.03, 0.02), (0.02, 0.03)),)},
            lambda one: [one.area, one.contains(0.01, 0.01), one.distance(0.01, 0.01)],
        ),
    }


def with_addition(one: Any) -> Any:
    plate = hl.kirchhoff_plate(0.1, 0.1, 2e-3, hl.ALUMINIUM_6061, CLAMPED, cells=(4, 4), additions=[one])
    return at_middle(plate)


def _chains() -> dict[str, Target]:
    chain = {"beads": [BEAD] * 3, "striker": BEAD, "impact_speed": 0.3, "gravity": 9.81, "dissipation": None}
    chain |= {"preload": 1.0, "inclination": 0.3, "law": None}
    bad_beads = ([BEAD] * 10**7, iter([BEAD] * 3), [BEAD, hl.Sphere(1e-6, STEEL)], [BEAD, hl.Sphere(50.0, STEEL)])
    speeds = (5e3, 1e-9, 1e5)
    return {
        "Chain": Target(hl.Chain, chain, run, {"beads": bad_beads, "impact_speed": speeds}),
        "DeformableChain": Target(
            hl.DeformableChain,
            # Without a preload its run is one of the kernels of the losses below.
            {**chain, "preload": 0.0, "modes": 2, "damping": damping.Modal(0.02)},
            run,
            {"modes": HUGE, "impact_speed": speeds, "damping": (damping.Modal, lambda bead: 0.02)},
        ),
        "damping.Modal": Target(damping.Modal, {"ratio": 0.02}, in_beads),
        "damping.Rayleigh": Target(damping.Rayleigh, {"mass_rate": 1e3, "stiffness_time": 1e-7}, in_beads),
        "damping.StandardLinearSolid": Target(
            damping.StandardLinearSolid,
            {"share": 0.2, "time": 1e-6, "modulus": "relaxed"},
            lambda one: damping.damped(hl.rod([hl.Layer(STEEL, 0.05, 0.01)], elements=4), one),
        ),
        "Piston": Target(
            hl.Piston,
            {"time": [0.0, 1e-5], "displacement": [0.0, 1e-6], "surface": FLAT},
            lambda one: run(hl.Chain([BEAD] * 3, one)),
        ),
        "PushedBead": Target(
            hl.PushedBead, {"time": [0.0, 1e-5], "force": [0.0, 10.0]}, lambda one: run(hl.Chain([BEAD] * 3, one))
        ),
        "SpringLoaded": Target(
            hl.SpringLoaded,
            {"striker": BEAD, "stiffness": 200.0, "compression": 2e-3, "travel": 1e-3},
            lambda one: run(hl.Chain([BEAD] * 3, one)),
        ),
        "LinearDashpot": Target(hl.LinearDashpot, {"coefficient": 5.0}, with_loss),
        "PowerDashpot": Target(hl.PowerDashpot, {"coefficient": 5.0, "exponent": 1.5, "form": "pairwise"}, with_loss),
        "MassProportional": Target(hl.MassProportional, {"rate": 6900.0}, with_loss),
        "KuwabaraKono": Target(hl.KuwabaraKono, {"time": 1e-6}, with_loss),
        "Tsuji": Target(hl.Tsuji, {"coefficient": 0.07}, with_loss),
        "Restitution": Target(hl.Restitution, {"coefficient": 0.9}, with_loss),
        "contact_law": Target(hl.contact_law, {"first": BEAD, "second": FLAT}, between),
    }


def _structures() -> dict[str, Target]:
    cylinder = {"layers": [hl.Layer(STEEL, 20e-3, 9.5e-3)], "base": "fixed", "patch_radius": 3e-3}
    matrices = {"mass": np.diag([0.01, 0.02]), "stiffness": np.array([[2e7, -1e7], [-1e7, 1e7]])}
    damping_matrix = {"damping": None, "contact": np.array([0.0, 1.0])}
    long = {"length": (1e-9, 1e3, 1e6), "elements": HUGE, "window": (1e-15, 1.0)}
    return {
        "rod": Target(
            hl.rod,
            {"layers": LAYERS, "base": "fixed", "elements": 6},
            push,
            {**long, "layers": ([hl.Layer(STEEL, 1e6, 1e-3)], [hl.Layer(STEEL, 1e-8, 1.0)], [LAYERS[0]] * 10**5)},
        ),
        "layered_cylinder": Target(
            hl.layered_cylinder, {**cylinder, "highest_frequency": 4e4, "cells": 1}, push, {"cells": HUGE}
        ),
        "half_space": Target(hl.half_space, {"material": STEEL}),
        "solid": Target(
            hl.solid,
            {
                **{"mesh": mesh(), "material": STEEL, "contact": (10e-3, 10e-3, 20e-3), "normal": (0.0, 0.0, 1.0)},
                **{"patch_radius": 8e-3, "scale": 1.0, "curvature": 0.0},
            },
            push,
        ),
        "Structure": Target(
            hl.Structure,
            {**matrices, **damping_matrix, "flexibility": 1e-9, "surface": FLAT, "valid_until": 1e-3},
            push,
        ),
        "reduce": Target(
            hl.reduce,
            {"structure": ROD, "until": 1e-4, "tolerance": 0.01, "largest": 600, "keep_field": False, "pulse": 2.5e-5},
            push,
        ),
        "ModalPlate": Target(
            hl.ModalPlate,
            {"plate": hl.kirchhoff_plate(0.1, 0.1, 2e-3, hl.ALUMINIUM_6061, CLAMPED), "until": 1e-4},
            lambda modal: push(modal.at(0.045, 0.05, 3e-3)),
        ),
        "ContactPoint": Target(hl.ContactPoint, {"structure": PLATE.at([0.05, 0.07], [0.02, 0.03]), "number": 1}),
        "damping.damped": Target(
            hl.damping.damped,
            {"structure": ROD, "damping": damping.StandardLinearSolid(0.1, 5e-6), "part": 1},
            push,
            {"part": (0, 2, -1, 10**9), "damping": (damping.Rayleigh(1.0), damping.Modal(0.1), 0.1)},
        ),
        "stepping.MovingStructure": Target(
            stepping.MovingStructure, {"structure": ROD}, lambda moving: moving.advance(moving.start(), 10.0, 1e-6)
        ),
        "stepping.MovingChain": Target(
            stepping.MovingChain,
            {"chain": CHAIN, "surface": FLAT, "flexibility": 1e-9, "dt": 1e-7, "behind": None, "impact_energy": 1e-3},
            lambda side: side.advance(side.start(), (0.0, 0.0), 1e-6),
            {"dt": (1e-15, 1e-300)},
        ),
    }


def _plates() -> dict[str, Target]:
    size = {"length": 0.1, "width": 0.1, "thickness": 4e-3, "material": hl.ALUMINIUM_6061, "supports": CLAMPED}
    frequency = {"highest_frequency": 2e4}
    cells = {"cells": ((10**6, 10**6), (10**4, 10**4), (0, 1), (1, 1), (2, 3, 4), (2.5, 2))}
    sizes = {"thickness": (1e-6, 1e-9, 1.0), "length": (1e-3, 10.0, 1e3), "highest_frequency": (1e7, 1e9, 1.0)}
    shape = {"shape": TRIANGLE, "thickness": 4e-3, "material": hl.ALUMINIUM_6061, "supports": {"base": "clamped"}}
    ply = hl.Ply(STEEL, 1e-3)
    carbon = {"youngs_modulus_along": 135e9, "youngs_modulus_across": 9e9, "poisson_ratio": 0.3}
    carbon |= {"shear_modulus": 5e9, "shear_modulus_along": 5e9, "shear_modulus_across": 3.2e9, "density": 1560.0}
    struck = {"bead": BEAD, "plate": PLATE, "impact_speed": 0.3}
    return {
        "kirchhoff_plate": Target(hl.kirchhoff_plate, {**size, "cells": (4, 4)}, at_middle, {**cells, **sizes}),
        "mindlin_plate": Target(
            hl.mindlin_plate,
            {**size, "cells": (4, 4), "shear_correction": 0.8, "patch_radius": 5e-3, "additions": ()},
            at_middle,
            {**cells, **sizes, "patch_radius": (1e-9, 1.0)},
        ),
        "mindlin_panel": Target(
            hl.mindlin_panel,
            {**shape, **frequency, "shear_correction": 0.8, "patch_radius": 5e-3, "scale": None},
            lambda panel: push(panel.at(0.03, 0.02)),
            sizes,
        ),
        "Plate": Target(
            hl.Plate,
            {
                **{name: getattr(PLATE, name) for name in ("shape", "section", "supports", "element")},
                **{"highest_frequency": 4e4, "additions": (), "material": hl.ALUMINIUM_6061},
            },
            at_middle,
        ),
        "Plate.at": Target(PLATE.at, {"x": 0.05, "y": 0.02, "face": "front"}, push),
        "half_plane": Target(
            hl.half_plane,
            {
                **{"thickness": 2.29e-3, "material": hl.ALUMINIUM_6061, "edge": "clamped", "distance": 0.02},
                **{"until": 5e-5, "highest_frequency": 2e4},
            },
            push,
            {"until": (1.0, 1e3), "distance": (1e-9, 10.0), **sizes},
        ),
        "infinite_plate": Target(hl.infinite_plate, {"thickness": 2e-3, "material": hl.ALUMINIUM_6061}, strike),
        "theory.indentation_modulus": Target(
            theory.indentation_modulus,
            {"stiffness": theory.orthotropic_stiffness((138e9, 9e9, 9e9), (0.4, 0.3, 0.3), (3.2e9, 6.9e9, 6.9e9))},
        ),
        "Laminate": Target(
            hl.Laminate, {"plies": [ply, ply], "surface": STEEL}, lambda one: strike(hl.infinite_plate(None, one))
        ),
        "Prestress": Target(hl.Prestress, {"xx": 1e3, "yy": -1e3, "xy": 10.0}, with_addition),
        "beam": Target(
            hl.beam,
            {
                **{"length": 0.06, "bending_stiffness": 1.5, "mass_per_length": 0.08, "material": STEEL, "at": 0.02},
                **{"supports": ("clamped", "simple"), "axial_force": -10.0, "foundation": 1e5},
                **{"highest_frequency": 4e4},
            },
            push,
            {"length": (1e-9, 1e6), "foundation": (1e-300, 1e300)},
        ),
        "Ply": Target(
            hl.Ply,
            {"material": STEEL, "thickness": 1e-3, "angle": 0.1},
            lambda one: strike(hl.infinite_plate(None, hl.Laminate([one, ply]))),
        ),
        "OrthotropicMaterial": Target(
            hl.OrthotropicMaterial,
            carbon,
            lambda one: strike(hl.infinite_plate(None, hl.Laminate([hl.Ply(one, 1e-3)], STEEL))),
        ),
        "theory.orthotropic_stiffness": Target(
            theory.orthotropic_stiffness,
            {"moduli": (138e9, 9e9, 9e9), "poisson_ratios": (0.4, 0.3, 0.3), "shear_moduli": (3.2e9, 6.9e9, 6.9e9)},
        ),
        "critical_distance_bounds": Target(hl.critical_distance_bounds, struck),
        "critical_distance_law": Target(hl.critical_distance_law, {**struck, "edge": "clamped", "tolerance": 0.02}),
        "theory.PlateImpact": Target(
            theory.PlateImpact,
            {**struck, "inelasticity": 1.28},
            lambda one: (one.amplitude_ratio, one.contact_time, one.time_of_flight(13, 0.44)),
        ),
    }


def _runs() -> dict[str, Target]:
    schemes = (hl.Condensed(), hl.Aitken(), hl.Explicit(), hl.IQN_ILS())
    iterated = {"tolerance": 1e-9, "relaxation": 0.5, "largest_count": 50}
    found = {"build": _at_distance, "until": 3e-4, "sensor": 3, "distances": [0.01, 0.03], "tolerance": 0.02}
    return {
        "CoSimulation": Target(
            hl.CoSimulation,
            {
                **{"chain": CHAIN, "structure": ROD, "scheme": None, "window": 1e-6, "dt": None},
                **{"behind": None, "accuracy": "default"},
            },
            lambda one: one.run(until=UNTIL),
            {"scheme": schemes, "window": (hl.Adaptive(), 1e-12, 1e-300, 1.0), "dt": (1e-7, 1e-15)},
        ),
        "CoSimulation.run": Target(
            simulation().run, {"until": UNTIL, "save_every": 1e-6}, None, {"save_every": (1e-18, 1e-12, 1.0)}, LONG
        ),
        "Adaptive": Target(
            hl.Adaptive, {"tolerance": 1e-4}, lambda one: hl.CoSimulation(CHAIN, ROD, window=one).run(until=UNTIL)
        ),
        "Aitken": Target(hl.Aitken, iterated, with_scheme),
        "IQN_ILS": Target(hl.IQN_ILS, {**iterated, "reuse": 2, "filtering": 1e-3}, with_scheme),
        "Condensed": Target(hl.Condensed, {"tolerance": 1e-11}, with_scheme),
        "Explicit": Target(hl.Explicit, {"predictor": 1, "tolerance": 0.5}, with_scheme),
        "batch": Target(
            hl.batch,
            {
                **{"build": against, "until": UNTIL, "save_every": 1e-6, "sensors": [1], "measure": None},
                **{"threads": 1, "speed": [0.2, 0.3]},
            },
            lambda one: one,  # an error may name an argument of what the function calls
            {"save_every": (1e-18, 1e-12), "threads": HUGE},
            LONG,
        ),
        "sweep": Target(
            hl.sweep,
            {"build": against, "until": UNTIL, "jobs": 1, "measure": None, "store": None, "speed": [0.2, 0.3]},
            lambda one: one,  # an error may name an argument of what `build` calls
            {"speed": ([0.3, -1.0], [0.3, 0.3], "ab", [object()]), "jobs": (0, -5, 2.5, "x")},
            LONG,
        ),
        "critical_distance_search": Target(
            hl.critical_distance_search, {**found, "bracket": 2e-3, "jobs": 1}, None, {"bracket": (1e-15,)}, LONG,
            infinite=True,
        ),
        "from_matrices": Target(
            hl.from_matrices,
            {
                **{"mass": [[2.0, 1.0], [1.0, 2.0]], "stiffness": [[2e6, -1e6], [-1e6, 2e6]], "material": STEEL},
                **{"contact": [1.0, 0.0], "damping": None, "residual_flexibility": 0.0, "curvature": 0.0, "scale": 1.0},
            },
        ),
        "from_modes": Target(
            hl.from_modes,
            {
                **{"frequencies": [900.0, 2_500.0], "material": STEEL, "shapes": [1.5, -2.0]},
                **{"damping_ratios": 0.01, "residual_flexibility": 1e-9, "curvature": 0.0, "scale": 1.0},
            },
        ),
        "run_in_precice": Target(
            hl.run_in_precice,
            {
                **{"body": CHAIN, "surface": FLAT, "configuration": "none.xml", "names": {}, "direction": (1.0, 0.0)},
                **{"positions": [(0.0, 0.0)], "window": 1e-6, "flexibility": 0.0, "dt": None},
            },
        ),
    }  # fmt: skip


def _at_distance(distance: Any) -> hl.CoSimulation:
    """A stand-in for a plate of that distance to its edge: cheap, and with a ratio that varies."""
    material = hl.Material(STEEL.youngs_modulus * min(1.0, 20.0 * float(distance)), 0.3, STEEL.density)
    return hl.CoSimulation(hl.Chain([BEAD] * 8, BEAD, 0.3), hl.half_space(material))


@wraps(hl.testing.assert_same_waves)
def _same_waves(*given: Any, **named: Any) -> str:
    """A difference is not a fault."""
    try:
        hl.testing.assert_same_waves(*given, **named)
    except AssertionError as difference:
        return str(difference)
    return ""


def _reference() -> str:
    path = str(folder() / "reference.nc")
    hl.testing.assert_same_waves(record(), path, sensors=[3], update=True)
    return path


def _measures() -> dict[str, Target]:
    run, at = record(), {"run": record(), "sensor": 3}
    signal = {"time": TIMES, "forces": {7: pulse(50.0, 1e-4) + pulse(30.0, 3e-4)}, "positions": {7: 0.05}}
    ratio = xr.DataArray([0.9, 0.6, 0.5, 0.5], dims="distance", coords={"distance": [0.01, 0.02, 0.03, 0.1]})
    ratios = (ratio * np.nan, ratio.rename(distance="x"), ratio[:1], ratio[::-1], ratio.drop_vars("distance"))
    shaken = run.assign(section_force=run.velocity, vibration_energy=run.kinetic_energy)
    datasets = (
        *(run.isel(time=slice(0, 1)), run.isel(time=slice(0, 0)), run.isel(time=slice(None, None, -1)), run * np.nan),
        *(run.drop_vars("contact_force"), run.drop_vars("time"), run.isel(contact=[0]), run * 0.0, run * 1e300, shaken),
        *(run.assign_attrs(x=1).drop_attrs(), run.contact_force, run.astype(complex), run.expand_dims(case=[0, 1])),
    )
    of_run = {"run": datasets, "sensor": (0, 1, 8, 9, 99, -1, 3.5), "signals": datasets}
    return {
        "amplitude_ratio": Target(hl.amplitude_ratio, {**at, "wave": "primary"}, None, of_run, infinite=True),
        "time_of_flight": Target(hl.time_of_flight, {**at, "wave": "primary"}, None, of_run, infinite=True),
        "reflections": Target(hl.reflections, {**at, "smallest": 0.01}, None, of_run),
        "wave_speed": Target(hl.wave_speed, {"run": run, "first": 2, "second": 5}, None, of_run, infinite=True),
        "contact_time": Target(hl.contact_time, {"run": run}, None, of_run, infinite=True),
        "energy_error": Target(hl.energy_error, {"run": run}, None, of_run, infinite=True),
        "sensor_force": Target(hl.sensor_force, at, None, of_run, infinite=True),
        "testing.assert_same_waves": Target(
            _same_waves,
            {"run": run, "reference": _reference(), "rtol": 1e-5, "sensors": [3], "update": False},
            None,
            of_run,
        ),
        "as_signal": Target(
            hl.as_signal,
            {**signal, "baseline": 0.0},
            lambda one: hl.reflections(one, sensor=7),
            {"forces": ({7: TIMES[:3]}, {7: pulse(1e300, 1e-4)}, {"7": TIMES}, {7.5: TIMES}, TIMES)},
        ),
        "read_signal": Target(
            hl.read_signal,
            {
                **{"path": folder() / "scope.csv", "sensors": {7: 1}, "time_column": 0, "time_unit": "s", "unit": "V"},
                **{"calibration": 100.0, "baseline": "lead", "positions": {7: 0.05}},
            },
        ),
        "clean_signal": Target(
            hl.clean_signal, {"signal": hl.as_signal(**signal), "mains": 50.0}, None, None, infinite=True
        ),
        "average_taps": Target(
            hl.average_taps, {"signals": [hl.as_signal(**signal), hl.as_signal(**signal)], "sensor": 7}
        ),
        "map_taps": Target(
            hl.map_taps,
            {
                **{"points": [{"x": 0.0, "y": 0.0, "files": [folder() / "scope.csv"]}], "read": tap, "answer": None},
                **{"jobs": 1, "store": None},
            },
            None,
            {"points": ([], [{}], [{"x": 0.0}], [{"x": "a", "y": 0.0, "files": ["none.csv"]}], "none.csv", {"x": 0.0})},
            {"jobs": (2, 1e12)},
            infinite=True,
        ),
        "SensorModel": Target(
            hl.SensorModel, {"time_constant": 1e-3, "bandwidth": 1e5, "stiffness": 1e8, "mass": 1e-3, "damping": 0.02}
        ),
        "critical_distance": Target(
            hl.critical_distance, {"ratio": ratio, "tolerance": 0.05}, None, {"ratio": ratios}, infinite=True
        ),
        "identify": Target(
            hl.identify,
            {
                **{"signal": tapped(), "build": against, "nuisances": ["gain"], "sensors": [2], "until": 1e-4},
                **{"noise": 1.0, "seed": 0, "guess": {"speed": 0.3}, "discrepancy": 0.0},
                "speed": (0.2, 0.5),
            },
            lambda one: one,  # an error may name an argument of what `build` calls
            {
                **{"signal": datasets, "speed": (0.3, (0.3, 0.3), (0.5, 0.2), (-1.0, 1.0), (0.2, np.inf), "ab")},
                **{"guess": ({"speed": 9.0}, {"x": 0.3}, 0.3), "sensors": ([1], [99], [4, 4], [0])},
                **{"until": (1e-12, 1.0)},
            },
            LONG,
            infinite=True,
        ),
        "identifiability": Target(
            hl.identifiability,
            {
                **{"build": against, "noise": 0.01, "sensors": [2], "until": 1e-4, "nuisances": ["gain"]},
                **{"sample_every": 1e-6, "compare": "waveform", "speed": 0.3},
            },
            lambda one: one,
            {"speed": (0.0, -0.3, np.nan, "x"), "sensors": ([1], [99], [0]), "sample_every": (1e-15, 1.0)},
            LONG,
            infinite=True,
        ),
        "numerical_error": Target(
            hl.numerical_error,
            {"build": against, "until": 1e-4, "sensor": 2, "speed": 0.3},
            lambda one: one,
            {"speed": (0.0, -0.3, np.nan, "x"), "sensor": (0, 99, *HUGE), "until": (1e-12, 1.0)},
            LONG,
            infinite=True,
        ),
        "sensitivities": Target(
            hl.sensitivities,
            {"build": against, "until": 1e-4, "sensors": [2], "measure": None, "save_every": 1e-6, "speed": 0.3},
            lambda run: run,
            {"speed": (0.0, -0.3, np.nan, "x"), "sensors": ([1], [99], [0]), "until": (1e-12, 1.0)},
            LONG,
            infinite=True,
        ),
        "uncertainty": Target(
            hl.uncertainty,
            {"build": against, "until": 1e-4, "sensor": 2, "measure": None, "draws": 0, "seed": 0, "speed": "1 %"},
            lambda budget: budget,
            {"speed": (0.0, "-1 %", np.nan, "x", "1 N"), "sensor": HUGE[0], "draws": (-1, 2)},
            LONG,
            infinite=True,
        ),
    }


def _formulas() -> dict[str, Target]:
    d, m, k = {"size": BEAD.size}, {"mass": BEAD.mass}, {"stiffness": STIFFNESS}
    chain, load = theory.UniformChain(BEAD.size, BEAD.mass, STIFFNESS), {"preload": 10.0}
    surfaces = {"first": BEAD.surface, "second": FLAT}
    table: dict[str, tuple[Callable[..., Any], Mapping[str, Any]]] = {
        "theory.UniformChain": (theory.UniformChain, {**d, **m, **k, "exponent": 1.5}),
        "UniformChain.angular_frequency": (chain.angular_frequency, {"wave_number": 100.0, **load}),
        "UniformChain.sound_speed": (chain.sound_speed, load),
        "UniformChain.tangent_stiffness": (chain.tangent_stiffness, load),
        "UniformChain.strain": (chain.strain, {"position": 0.0, "time": 0.0, "speed": 500.0}),
        "UniformChain.transit_time": (chain.transit_time, {"beads": 13, "striker_speed": 0.44, "restitution": 0.9}),
        "UniformChain.wave_speed_from_force": (chain.wave_speed_from_force, {"force": 20.0, "preload": 1.0}),
        "UniformChain.wave_speed_from_particle_speed": (chain.wave_speed_from_particle_speed, {"particle_speed": 0.3}),
        "theory.zener_restitution": (theory.zener_restitution, {"inelasticity": 1.28}),
        "theory.hertz_pressure": (theory.hertz_pressure, {**surfaces, "force": 50.0}),
        "theory.hertz_stiffness": (theory.hertz_stiffness, {**surfaces, "axis_ratio": "exact"}),
        "theory.yield_pressure": (theory.yield_pressure, {"material": hl.STEEL_316}),
        "theory.hertz_contact_time": (theory.hertz_contact_time, {**m, **k, "speed": 0.4}),
        "theory.layer_restitution": (theory.layer_restitution, {"mass": 0.01, "upper_mass": 0.04}),
        "theory.secondary_delay": (
            theory.secondary_delay,
            {"upper_mass": 14e-3, "lower_mass": 16e-3, "lower_stiffness": 17e6},
        ),
        "theory.primary_time_of_flight": (
            theory.primary_time_of_flight,
            {
                **{"beads": 13, **m, "chain_stiffness": STIFFNESS, "wall_stiffness": STIFFNESS},
                **{"striker_speed": 0.44, "restitution": 0.9},
            },
        ),
    }
    unbounded = "theory.yield_pressure"  # infinite without a yield strength
    return {name: Target(call, good, infinite=name == unbounded) for name, (call, good) in table.items()}


def _laws() -> dict[str, Target]:
    points = {"approaches": [1e-6, 1e-5, 2e-5], "forces": [10.0, 316.2, 894.0], "name": "measured", "caution": ""}
    force = {"first": BEAD, "second": BEAD, "max_force": 50.0, "max_approach": None}
    spacings = {"spacing": (1e-12, 1e-9, 1.0, 1e-3), "max_force": (1e6, 1e-9)}
    other = {"first": (LYING, SHELL), "second": (LYING, SHELL, FLAT)}
    return {
        "laws.PowerLaw": Target(
            laws.PowerLaw, {"stiffness": 1e10, "exponent": 1.5, "largest": 1.0, "name": "x", "caution": ""}, of_law
        ),
        "laws.TabulatedLaw": Target(laws.TabulatedLaw, {**points, "largest": 3e-5}, of_law),
        **{
            f"laws.{kind.__name__}": Target(kind, {"yield_strength": 3e8}, of_yielding)
            for kind in (laws.Thornton, laws.JacksonGreen)
        },
        "laws.computed_law": Target(laws.computed_law, {**force, "spacing": 100e-6}, between, {**spacings, **other}),
    }
