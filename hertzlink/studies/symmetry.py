"""Thesis section 3.5: a wave in a chain of axisymmetric beads, and in one of three-dimensional beads.

The forces and supports of the thesis's full, half and quarter spheres are symmetric about both cutting planes. Their
motions are therefore symmetric as well, because the solution is unique. For symmetric motions the three have the same
matrices, except for factors of one, two and four, by which the thesis divides their forces. So one model represents all
three: here an eighth, because the modes of a bead are also symmetric or antisymmetric about its mid-plane.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw
from hertzlink.studies.deformable_chain import WALL
from hertzlink.studies.results import over
from hertzlink.studies.table import SIMULATED, Row, Rows
from particles.deformable.solid_vibration import vibration_of_solid
from particles.deformable.vibration import Vibration, vibration
from particles.laws.axisymmetric import contact_law_fem
from particles.laws.solid import contact_law_solid

row = Rows("symmetry")
BEAD, BEADS, SENSORS = hl.Sphere(2.38e-3, hl.STEEL_316), 20, (7, 16)
IMPACT_SPEED = 0.5  # m/s, of section 3.4; section 3.5 does not print its own.
UNTIL, SAVED = 350e-6, 700  # s, until the echo has passed bead 7; and intervals.
LARGEST_APPROACH = 5e-6  # Largest approach of the laws, m: the wall presses half a contact by 2.3 µm.
APPROACHES = np.geomspace(0.5e-6, 5e-6, 11)
MODES = 8
# Size of the cells in three dimensions for the quick study, m: for modes, and at the pole for the law.
COARSE, COARSE_AT_POLE = 0.25 * BEAD.radius, 20e-6
AXISYMMETRIC, SOLID, MIXED = "axisymmetric", "three-dimensional", "axisymmetric law, three-dimensional modes"


@dataclass(frozen=True)
class Model:
    """The law of two equal beads, and the function that computes their modes."""

    law: hl.ContactLaw
    vibrations: Callable[[hl.Bead, int], Vibration]

    def between(self, first: hl.Bead, second: hl.Bead | hl.Surface) -> hl.ContactLaw:
        """Return the law of two beads; a bead against the rigid wall is one half of them, by symmetry."""
        if not isinstance(second, hl.Surface):
            return self.law
        approaches = np.append(np.geomspace(1e-4, 1.0, 400, endpoint=False), 1.0) * self.law.largest
        return hl.laws.TabulatedLaw(0.5 * approaches, self.law.force(approaches), self.law.name)  # type: ignore[arg-type]

    def run(self) -> xr.Dataset:
        """Return the wave."""
        beads, modes = [BEAD] * BEADS, {"modes": MODES, "vibrations": self.vibrations}
        chain = hl.DeformableChain(beads, BEAD, IMPACT_SPEED, law=self.between, **modes)  # type: ignore[arg-type]
        return hl.CoSimulation(chain, WALL).run(UNTIL, UNTIL / SAVED)


def models(quick: bool) -> dict[str, Model]:
    """Return both models by name, and a third one that separates the effects of laws and modes."""
    solid: Any = partial(vibration_of_solid, spacing=COARSE) if quick else vibration_of_solid
    law = contact_law_solid(BEAD, max_approach=LARGEST_APPROACH, spacing=COARSE_AT_POLE if quick else None)
    flat = contact_law_fem(BEAD, max_approach=LARGEST_APPROACH)
    return {AXISYMMETRIC: Model(flat, vibration), SOLID: Model(law, solid), MIXED: Model(flat, solid)}


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return the forces through the central sections of beads 7 and 16 in both chains, their speeds; laws and modes.

    quick: larger cells in three dimensions. jobs: always one process, because there are only three runs.
    """
    chosen = models(quick)

    def of_model(model: str) -> xr.Dataset:
        frequencies = chosen[model].vibrations(BEAD, MODES - 1).frequencies / (2.0 * np.pi)
        return measure(chosen[model].run()).assign(
            law=("approach", chosen[model].law.force(APPROACHES), {"units": "N", "long_name": "contact law"}),
            frequency=("mode", frequencies, {"units": "Hz", "long_name": "frequency of a free bead"}),
        )

    data = over(of_model, model=list(chosen))
    return data.assign_coords(approach=("approach", APPROACHES, {"units": "m"}), mode=np.arange(1, MODES))


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return the part of a run that the study keeps."""
    force = run.section_force.sel(bead=list(SENSORS)).rename(bead="sensor")
    waves = [hl.reflections(run, sensor) for sensor in SENSORS]
    amplitudes = [(wave.incident.amplitude, wave.primary.amplitude) for wave in waves]  # type: ignore[union-attr]
    arrivals = [(wave.incident.arrival, wave.primary.arrival) for wave in waves]  # type: ignore[union-attr]
    over = ("sensor", "wave")
    return xr.Dataset(
        {
            "force": force.transpose("sensor", "time"),
            "amplitude": (over, amplitudes, {"units": "N", "long_name": "peak force of a sensor"}),
            "arrival": (over, arrivals, {"units": "s", "long_name": "time of the peak"}),
            "wave_speed": ((), hl.wave_speed(run, *SENSORS), {"units": "m/s"}),
            "energy_error": ((), float(hl.energy_error(run)), {"units": "1"}),
        },
        coords={"wave": ["incident", "echo"]},
    )


def table(data: xr.Dataset) -> list[Row]:
    """Compare one model with the other; figure 3.10 prints no numbers."""
    flat, solid, mixed = (data.sel(model=name) for name in (AXISYMMETRIC, SOLID, MIXED))
    law, apart = (100.0 * (solid[name] / flat[name] - 1.0) for name in ("law", "frequency"))
    speeds = [float(model.wave_speed) for model in (solid, flat)]
    wide, modes = (float(model.wave_speed / flat.wave_speed) for model in (solid, mixed))
    rows = [
        row("full, half and quarter sphere", "the same", holds=True),
        row("wave speed, three dimensions over two", wide, *speeds, holds=abs(wide - 1.0) < SIMULATED),
        row("wave speed, modes alone in three dimensions", modes, holds=abs(modes - 1.0) < SIMULATED),
    ]
    for sensor, wave in ((7, "incident"), (16, "incident"), (16, "echo"), (7, "echo")):
        both = [model.sel(sensor=sensor, wave=wave) for model in (solid, flat)]
        first, second = (float(model.amplitude) for model in both)
        said = first, second, *(float(model.arrival) * 1e6 for model in both)
        holds = abs(first / second - 1.0) < SIMULATED
        rows.append(row("peak force", first / second, *said, holds=holds, sensor=sensor, wave=wave))
    highest = 1.0 + 0.01 * float(apart.max())
    return [
        *rows,
        row("contact law, three dimensions over two", float((solid.law / flat.law).mean()), *ends(law)),
        row("frequencies, three dimensions over two", highest, *ends(apart), MODES - 1),
    ]


def ends(values: xr.DataArray) -> tuple[float, float]:
    """Return the smallest and the largest value."""
    return float(values.min()), float(values.max())


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return figure 3.10: force at the centres of beads 7 and 16 over time, in both chains."""
    labels = draw.Look(width=3.7, ylabels=["force at the centre (N)"])
    figure, panels = draw.each(data.sel(model=[AXISYMMETRIC, SOLID]), "model", str, **labels)
    for axis, model in panels:
        draw.histories(axis, model.force)
        axis.set_xlim(0.0, UNTIL * 1e6)
    panels[0][0].set_ylim(0.0, 19.0)
    panels[0][0].legend(loc="upper left", ncols=2)
    return {"waves": figure}
