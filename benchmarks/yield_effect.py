"""The table of what yielding would change of an elastic run, coupling/yield_effect.csv, by Jackson and Green's law.

    python benchmarks/yield_effect.py --output coupling/yield_effect.csv

It takes half a minute. 20 beads strike an infinite plate. Columns are the peak force of a contact over the force at
which it begins to yield, rows the elastic AR at bead 10. They hold the AR with yielding over the elastic AR; the delay
of the wave beyond that of its slower way back, over the incident wave's time for a bead; and, of chains whose beads
yield, the incident force at bead 10 over the elastic one.
"""

import argparse
import csv
import sys
from dataclasses import replace
from math import log

import numpy as np
from scipy.optimize import brentq

from coupling.cosimulation import CoSimulation
from coupling.results.ar_and_tof import reflections
from coupling.results.waves import Reflections
from particles.bead import Sphere
from particles.chain import Chain
from particles.laws.yielding import JacksonGreen
from plates.infinite import infinite_plate
from structures.caution import collected
from structures.material import Material
from structures.structure import Structure, half_space

FORCES = (1.0, 1.5, 2.0, 3.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
RATIOS = (0.1, 0.2, 0.35, 0.5, 0.7, 0.9, 0.97)
BEADS, SENSOR, SPEED, UNTIL = 20, 10, 0.31, 6e-3
BEAD = Sphere(4.76e-3, Material(200e9, 0.28, 7800.0, "steel"))
WALL = Material(70e9, 0.33, 2700.0, "wall")


def waves(bead: Sphere, structure: Structure, law: JacksonGreen | None) -> tuple[Reflections, float, float]:
    """The waves at the sensor, and the peak forces of the sensor's first contact and of the last one, N."""
    run = CoSimulation(Chain([bead] * BEADS, bead, SPEED, law=law), structure).run(UNTIL)
    peaks = run.contact_force.max("time").values
    return reflections(run, SENSOR, 1e-3), float(peaks[SENSOR - 1]), float(peaks[-1])


def strength_for(force: float, bead: Sphere, wall: Material | None) -> float:
    """The yield strength, Pa, at which a contact begins to yield at this force, N."""

    def beyond(exponent: float) -> float:
        other = bead if wall is None else half_space(wall).surface
        contact = JacksonGreen(float(np.exp(exponent))).contact(bead, other)
        assert contact is not None
        return log(contact.yield_force / force)

    return float(np.exp(brentq(beyond, log(1e5), log(1e11))))


def thickness_for(ratio: float) -> float:
    """The thickness of the infinite plate, m, whose elastic AR is this."""

    def beyond(thickness: float) -> float:
        primary = waves(BEAD, infinite_plate(thickness, WALL), None)[0].primary
        return (primary.amplitude_ratio if primary else 0.0) - ratio

    return float(brentq(beyond, 1e-3, 0.1, xtol=1e-6))


def of_wall(ratio: float) -> tuple[list[float], list[float]]:
    """AR over the elastic one, and the delay at the wall, over the forces."""
    thickness = thickness_for(ratio)
    elastic, _, force = waves(BEAD, infinite_plate(thickness, WALL), None)
    hop, way = elastic.incident.arrival / SENSOR, BEADS - SENSOR
    found, delays = [], []
    for beyond in FORCES:
        soft = replace(WALL, yield_strength=strength_for(force / beyond, BEAD, WALL))
        back = waves(BEAD, infinite_plate(thickness, soft), JacksonGreen())[0].primary
        found.append(back.amplitude_ratio / elastic.primary.amplitude_ratio)
        slower = way * (back.amplitude_ratio ** (-1 / 6) - elastic.primary.amplitude_ratio ** (-1 / 6))
        delays.append((back.time_of_flight - elastic.primary.time_of_flight) / hop - slower)
    return found, delays


def of_beads() -> list[float]:
    """The incident force over the elastic one, over the forces."""
    elastic, force, _ = waves(BEAD, half_space(WALL), None)
    found = []
    for beyond in FORCES:
        material = replace(BEAD.material, yield_strength=strength_for(force / beyond, BEAD, None))
        wave = waves(replace(BEAD, material=material), half_space(WALL), JacksonGreen())[0].incident
        found.append(wave.amplitude / elastic.incident.amplitude)
    return found


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", required=True)
    given = parser.parse_args()
    with collected():
        walls = [of_wall(ratio) for ratio in RATIOS]
        lines = [["AR", f"{ratio:g}", *one[0]] for ratio, one in zip(RATIOS, walls, strict=True)]
        lines += [["delay", f"{ratio:g}", *one[1]] for ratio, one in zip(RATIOS, walls, strict=True)]
        lines += [["force", "1", *of_beads()]]
    with open(given.output, "w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["what", "elastic AR", *(f"{one:g}" for one in FORCES)])
        writer.writerows([*line[:2], *(f"{float(one):.4f}" for one in line[2:])] for line in lines)


if __name__ == "__main__":
    sys.exit(main())
