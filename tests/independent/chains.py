"""Chains drawn at random, on structures drawn at random, on which the wave finder is judged (`waves`)."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import xarray as xr

import hertzlink as hl
from independent.waves import arrives, dynamic

COUNT = 200
FAMILIES = ("two kinds", "three kinds", "tapered", "decorated", "hollow", "preloaded", "with losses")
METALS = (hl.STEEL_440C, hl.STEEL_316, hl.BRASS_360, hl.ALUMINIUM_6061, hl.MATERIALS["copper"])
POLYMERS = (hl.PTFE, hl.MATERIALS["nylon"], hl.MATERIALS["polycarbonate"], hl.ACRYLIC)


def chain_of(rng: np.random.Generator, family: str, scale: float = 1.0) -> hl.Chain:
    """Return a chain of a family; scale: of the radius of its first kind of bead."""
    count, speed, special = int(rng.integers(14, 31)), float(rng.uniform(0.15, 0.6)), {}

    def sphere() -> hl.Sphere:
        return hl.Sphere(float(rng.uniform(2e-3, 5e-3)), rng.choice([*METALS, *POLYMERS]))

    if family == "preloaded":
        special["preload"] = float(10.0 ** rng.uniform(-1.0, 1.0))
    elif family == "with losses":
        dashpot, tsuji = hl.LinearDashpot(rng.uniform(0.5, 5.0)), hl.Tsuji(rng.uniform(0.01, 0.06))
        losses = (dashpot, tsuji, hl.Restitution(rng.uniform(0.9, 0.98)))
        special["dissipation"] = losses[rng.integers(3)]
    if special:
        family = ("one kind", "two kinds", "tapered")[rng.integers(3)]
    first = hl.Sphere(float(rng.uniform(3e-3, 5e-3)), METALS[rng.integers(len(METALS))])
    big = replace(first, radius=first.radius * scale)
    if family == "one kind":
        beads = [big] * count
    elif family == "two kinds":
        beads = [big, sphere()] * 15 if rng.uniform() < 0.7 else [big, big, sphere()] * 10
    elif family == "three kinds":
        beads = [big, sphere(), sphere()] * 10
    elif family == "tapered":
        step = float(rng.uniform(-0.03, 0.03))
        beads = [replace(big, radius=big.radius * (1.0 + step) ** n) for n in range(count)]
    elif family == "decorated":
        small, step = float(rng.uniform(0.35, 0.75)), float(rng.uniform(-0.02, 0.02))
        sizes = [first.radius * (small if n % 2 else scale) * (1.0 + step) ** n for n in range(count)]
        beads = [replace(first, radius=size) for size in sizes]
    else:
        shell = hl.HollowSphere(big.radius, first.radius * float(rng.uniform(0.4, 0.85)), first.material)
        beads = ([shell] if rng.uniform() < 0.5 else [first, shell]) * 30
    return hl.Chain(beads[:count], beads[0], speed, **special)


def structure_of(rng: np.random.Generator) -> tuple[str, Callable[[float], hl.Structure]]:
    """Return a kind of structure, and a function that builds it for records of a length, s."""
    material, metal = rng.choice([*METALS, *POLYMERS]), METALS[rng.integers(len(METALS))]
    thickness, distance = float(rng.uniform(2e-3, 8e-3)), float(rng.uniform(0.01, 0.08))
    share, length, radius = rng.uniform(0.1, 0.9, 2), rng.uniform(5e-3, 0.1, 2), float(rng.uniform(6e-3, 12e-3))
    edge, base = str(rng.choice(["clamped", "simple", "free"])), str(rng.choice(["fixed", "free"]))
    plate = hl.kirchhoff_plate(0.3, 0.2, thickness, metal, hl.Supports(edge, "clamped"))
    layers = [hl.Layer(metal, float(length[0]), radius), hl.Layer(material, float(length[1]), radius)]
    builders = {
        "half-space": lambda until: hl.half_space(material),
        "rod": lambda until: hl.rod(layers[1:], base=base),
        "layered rod": lambda until: hl.rod(layers, base=base),
        "plate": lambda until: hl.reduce(plate.at(0.3 * share[0], 0.2 * share[1]), until=until),
        "infinite plate": lambda until: hl.infinite_plate(thickness, metal),
        "half-plane": lambda until: hl.half_plane(thickness, metal, edge, distance, until=until),
    }
    kind = list(builders)[rng.integers(len(builders))]
    return kind, builders[kind]


def run_of(number: int, scale: float = 1.0) -> tuple[str, xr.Dataset]:
    """Return a description of a chain and its run, which lasts until a weak reflection has passed bead 6."""
    rng, family, until = np.random.default_rng([52, number]), FAMILIES[number % len(FAMILIES)], 1e-3
    chain, (kind, build) = chain_of(rng, family, scale), structure_of(rng)
    while True:
        run = hl.CoSimulation(chain, build(until)).run(until)
        force, time = dynamic(run), run.time.values
        sensor, there = time[arrives(force[5])], time[arrives(force[-1])]
        pushed, top = force[-1], force[-1].max()
        after = (np.arange(time.size) > pushed.argmax()) & (pushed < 0.02 * top)
        released = time[after.argmax()] if after.any() else np.inf
        needed = min(released + 2.5 * (there - sensor), 12.0 * there)
        if top > 0.02 * force[5].max() and needed <= until:
            return f"{number} {family}, {len(chain.beads)} beads on {kind}", run
        until = max(1.1 * needed, 1.5 * until) if until > there else 2.0 * until
