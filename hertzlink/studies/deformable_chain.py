"""Thesis sections 3.3.2 and 3.4: a wave in a chain of deformable beads, of point masses and by theory.

The thesis models its beads with finite elements; here each has a few modes. A rigid wall ends the thesis's chain; waves
are read before its echo arrives.
"""

from collections.abc import Iterator
from time import process_time

import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Number
from structures.structure import Vector

# The striker is a bead of the same kind: the thesis's N = 21.
BEAD, BEADS = hl.Sphere(2.38e-3, hl.STEEL_316), 20
SHAPE_SPEED, MESH_SPEED = 0.63, 0.5  # m/s, of the striker, in sections 3.3.2 and 3.4.
IMPACT_SPEEDS = tuple(np.geomspace(0.1, 1.6, 9))  # m/s, of figure 3.5; the thesis does not print its own.
SENSOR = 10
# The contacts between which a speed is read; the second, between beads 15 and 16, is that of figure 3.8a.
CONTACTS = (10, 16)
# s: the wave of 0.5 m/s has passed contact 16 and has not reached the end; saved times.
UNTIL, SAVE_EVERY = 165e-6, 0.25e-6
FITTED_TOP = 0.9  # The top of a pulse, which is fitted, begins at this fraction of its peak.
SPACING, QUICK_SPACING = 2.5e-6, 20e-6  # m, of the mesh of the contact law.
LAW_APPROACH = 4e-6  # m; at 3.3 µm one contact stores the whole energy of a striker of 0.5 m/s.
MODELS, NAMES = ("point masses", "modes"), {"point masses": "point masses", "modes": "deformable beads"}


def chain(beads: str, impact_speed: float, law: hl.laws.ContactLaw | None = None) -> hl.Chain:
    kind = hl.Chain if beads == "point masses" else hl.DeformableChain
    return kind([BEAD] * BEADS, BEAD, impact_speed, law=law)


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return the forces at both speeds, speed over force, and the processor time of a run with its law.

    quick: three striker speeds, and a coarser mesh of the law. jobs: always one process, because all runs take seconds.
    """
    # Compile here, so that the time does not include it.
    hl.CoSimulation(hl.DeformableChain([BEAD], BEAD, 1.0, law=hl.contact_law, modes=2), None).run(1e-5)
    begin = process_time()  # which other users of the machine influence little
    law = hl.laws.computed_law(BEAD, max_approach=LAW_APPROACH, spacing=QUICK_SPACING if quick else SPACING)
    run = hl.CoSimulation(chain("modes", MESH_SPEED, law), None).run(UNTIL, SAVE_EVERY)
    time = shared.scalars(seconds=(process_time() - begin, "s", "time of the processor"))

    points = hl.CoSimulation(chain("point masses", MESH_SPEED), None).run(UNTIL, SAVE_EVERY)
    models = xr.concat([measure(points), measure(run)], "beads").assign_coords(beads=list(MODELS))
    few = IMPACT_SPEEDS[:: 4 if quick else 1]
    speeds = shared.along(
        "beads", MODELS, lambda beads: shared.along("impact_speed", few, lambda speed: of_speed(beads, speed))
    )
    label = {"units": "m/s", "long_name": "wave speed, equation 1.10"}
    speeds["theory"] = (speeds.peak_force.dims, by_force(speeds.peak_force.values), label)
    found = [models, time, shared.along("beads", MODELS, shape)]
    return shared.with_units(xr.merge([*found, shared.named(speeds, "speed")]), impact_speed="m/s")


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return peak force at the second contact, N, and speed between the two contacts, m/s, of the only wave in a run.

    The peak is that of a polynomial of fourth order through the top of the pulse, and the time of a wave that of the
    centroid of its force: so they do not depend on the saved times.
    """
    force = run.contact_force.sel(contact=list(CONTACTS)).reset_coords(drop=True)
    first, second = ((force * force.time).sum("time") / force.sum("time")).values
    time, last = run.time.values, force.sel(contact=CONTACTS[1]).values
    near = last > FITTED_TOP * last.max()
    fit = Polynomial.fit(time[near], last[near], 4)
    peak = float(fit(np.linspace(float(fit.domain[0]), float(fit.domain[1]), 1001)).max())
    speed = (CONTACTS[1] - CONTACTS[0]) * BEAD.size / (second - first)
    return shared.scalars(
        peak_force=(peak, "N", "peak force between beads 15 and 16"),
        wave_speed=(speed, "m/s", "wave speed between contacts 10 and 16"),
    )


def shape(beads: str) -> xr.Dataset:
    """Return section 3.3.2: measures, and forces at bead 10 over time, of its contacts and through its section."""
    run = hl.CoSimulation(chain(beads, SHAPE_SPEED), None).run(UNTIL, SAVE_EVERY)
    mean = hl.sensor_force(run, SENSOR)
    section = run.section_force.sel(bead=SENSOR) if "section_force" in run else mean
    data = shared.named(measure(run), "shape").assign(sensor_force=mean, section_force=section)
    return data.reset_coords(drop=True)


def of_speed(beads: str, impact_speed: float) -> xr.Dataset:
    """Return figure 3.5: peak force and wave speed. Times in a Hertzian chain scale as (striker speed)^(−1/5)."""
    scale = (MESH_SPEED / impact_speed) ** 0.2
    return measure(hl.CoSimulation(chain(beads, impact_speed), None).run(UNTIL * scale, SAVE_EVERY * scale))


def by_force(force: Vector | float) -> Vector:
    """Return the wave speed, m/s, at peak contact forces, N (equation 1.10)."""
    return shared.long_waves(BEAD).wave_speed_from_force(np.asarray(force))


def at_sensor(data: xr.Dataset) -> tuple[xr.DataArray, ...]:
    """Return forces at bead 10, N: of contacts, of its section; theory, averaged over contacts, and at the centre."""
    near = data.sel(beads="modes", time=slice(None, 0.8 * UNTIL))
    mean, time, speed = near.sensor_force, near.time.values, float(near.shape_wave_speed)
    crest, half = float((mean * near.time).sum() / mean.sum()), 0.5 * BEAD.size / speed
    waves = shared.long_waves(BEAD)

    def theory(crest: float) -> Vector:
        """The force of a wave whose crest passes at a time, from its strain (equation 1.8)."""
        force: Vector = waves.stiffness * (BEAD.size * waves.strain(speed * (time - crest), 0.0, speed)) ** 1.5
        return force

    averaged = 0.5 * (theory(crest - half) + theory(crest + half))
    return mean, near.section_force, mean.copy(data=averaged), mean.copy(data=theory(crest))


def numbers(data: xr.Dataset) -> Iterator[Number]:
    # Section 3.3.2.
    rigid, soft = data.shape_wave_speed.sel(beads=list(MODELS)).values.tolist()
    faster = (SHAPE_SPEED / MESH_SPEED) ** 0.2
    reached = SHAPE_SPEED * (635.0 / rigid) ** 5
    said = f"the thesis's own 560 at 0.5 m/s gives {560.0 * faster:.0f}; 635 would need a striker of {reached:.2f} m/s"
    yield Number("wave speed at 0.63 m/s, discrete particles", rigid, said)
    said = f"the thesis's own 552.8 at 0.5 m/s gives {552.8 * faster:.0f}"
    yield Number("wave speed at 0.63 m/s, finite elements", soft, said)
    yield Number("wave speed at 0.63 m/s, experiment", soft)

    # Section 3.4.
    (rigid, soft), (slow, slower) = (data[name].values.tolist() for name in ("peak_force", "wave_speed"))
    yield Number("peak force, discrete particles", rigid)
    yield Number("peak force, finite elements", soft)
    yield Number("wave speed, discrete particles", {"": slow, "equation 1.10 at this force": float(by_force(rigid))})
    yield Number("wave speed, finite elements", slower)
    yield Number("time with modes", f"{float(data.seconds):.2g} s")
    yield Number("fastest motion over dilatational speed", "")
    yield Number("kinetic over potential energy", "")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return figure 3.3, with the difference between the two forces, and figure 3.5, with ratios to theory."""
    mean, section, averaged, centre = at_sensor(data)
    labels = ("force at bead 10 (N)", "central section minus mean (N)")
    at_bead, axes = draw.panels(2, width=3.8, height=3.8, xlabel="time (µs)", ylabels=labels)
    time = mean.time.values * 1e6
    axes[0].plot(time, section, "-", color=draw.COLOURS[1], label="central section")
    axes[0].plot(time, mean, "--", color=draw.COLOURS[0], label="mean of the contacts")
    axes[0].plot(time, averaged, "*-k", markevery=8, linewidth=0.8, label="theory of long waves, mean of the contacts")
    draw.theory_line(axes[0], time, centre, "theory of long waves, at the centre", ":")
    axes[1].plot(time, section - mean, "-", color=draw.COLOURS[1])
    middle = float(time[int(mean.values.argmax())])
    for axis in axes:
        axis.set_xlim(middle - 30.0, middle + 30.0)
    draw.legend_above(at_bead, axes[0], 2)

    labels = ("wave speed (m/s)", "wave speed over theory")
    speed_force, axes = draw.panels(2, width=3.6, xlabel="peak contact force (N)", ylabels=labels)
    force = data.speed_peak_force
    fine = np.geomspace(float(force.min()), float(force.max()), 200)
    speeds = (data.speed_wave_speed, by_force(fine))
    ratios = (data.speed_wave_speed / data.speed_theory, np.ones(fine.size))
    for axis, (values, theory) in zip(axes, (speeds, ratios), strict=True):
        draw.theory_line(axis, fine, theory, "theory of long waves")
        for i, model in enumerate(MODELS):
            draw.points(axis, force.sel(beads=model).values, values.sel(beads=model).values, i, NAMES[model])
        axis.set_xlim(left=0.0)
    axes[0].set_ylim(bottom=0.0)
    draw.legend_above(speed_force, axes[0], 3)
    return {"section": at_bead, "speed_force": speed_force}
