"""Thesis sections 3.3.2 and 3.4: a wave in a chain of deformable beads, of point masses and by theory; its convergence.

The thesis models its beads with finite elements, here each has a few modes. A rigid wall ends the thesis's chain; waves
are read before its echo arrives.
"""

from collections.abc import Callable, Sequence
from functools import partial
from time import process_time

import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies.results import named, over, scalars, with_units
from hertzlink.studies.table import Row, Rows
from particles.deformable.vibration import vibration
from particles.laws.axisymmetric import computed_law
from particles.solitary import HERTZ
from structures.bodies.elasticity import pressure_speed
from structures.structure import Vector

row = Rows("deformable_chain")
# The striker is a bead of the same kind: the thesis's N = 21.
BEAD, BEADS = hl.Sphere(2.38e-3, hl.STEEL_316), 20
WALL = hl.half_space(hl.Material(1e20, 0.3, 8000.0, "rigid"))  # The thesis's perfectly rigid plate.
SHAPE_SPEED, MESH_SPEED = 0.63, 0.5  # m/s, of the striker, in sections 3.3.2 and 3.4.
IMPACT_SPEEDS = tuple(np.geomspace(0.1, 1.6, 9))  # m/s, of figure 3.5; the thesis does not print its own.
SENSORS = (10, 15)
# The contacts between which a speed is read; the second, between beads 15 and 16, is that of figure 3.8a.
CONTACTS = (10, 16)
UNTIL = 165e-6  # s: the wave of 0.5 m/s has passed contact 16 and has not reached the wall.
WITH_ECHO = 300e-6
INTERVALS = 660  # Number of saved intervals in UNTIL.
PASSING = slice(0.4 * UNTIL, 0.8 * UNTIL)  # Times at which the whole wave is inside the chain.
FITTED_TOP = 0.9  # The top of a pulse, which is fitted, begins at this fraction of its peak.
MODES, MODES_TRIED = 8, (1, 2, 3, 4, 6, 8, 12, 16)
LAW_SPACINGS = (20e-6, 10e-6, 5e-6, 2.5e-6)
LAW_APPROACH = 4e-6  # m; at 3.3 µm one contact stores the whole energy of a striker of 0.5 m/s.
MODELS, NAMES = ("point masses", "modes"), ("point masses", "deformable beads")
LABELS = ("peak force at contact 16 (N)", "wave speed (m/s)")


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return the forces at both speeds, speed over force, and convergence over meshes and modes, each with its time.

    Times are processor times, because other users of the machine influence these little. quick: fewer of everything.
    jobs: always one process, because all runs take seconds.
    """
    every = 4 if quick else 1
    # Compile here, so that no time below includes it.
    hl.CoSimulation(hl.DeformableChain([BEAD], BEAD, 1.0, law=hl.contact_law, modes=2), None).run(1e-5)
    spacings, modes = LAW_SPACINGS[::every], MODES_TRIED[::every]
    by_law = over(by_modes, law_spacing=spacings)
    tried = over(partial(by_modes, spacings[-1]), modes=modes)
    points = timed(lambda: hl.CoSimulation(chain("point masses", MESH_SPEED), None).run(UNTIL, UNTIL / INTERVALS))
    ends = [points, by_law.isel(law_spacing=-1, drop=True)]
    models = xr.concat(ends, "model").assign_coords(model=list(MODELS))
    models["vibration_share"] = models.vibration_share.sel(model="modes", drop=True)
    kept = ["peak_force", "wave_speed", "seconds"]
    series = [named(s[kept], name) for s, name in ((by_law, "law"), (tried, "modes"))]
    data = xr.merge([models, *series, shape(), over_speed(IMPACT_SPEEDS[::every])])
    return with_units(data, law_spacing="m", impact_speed="m/s", shape_time="s")


def by_modes(law_spacing: float, modes: int = MODES) -> xr.Dataset:
    """Return the chain of a few modes at 0.5 m/s, with a contact law computed on a mesh of this spacing, m."""

    def computed() -> xr.Dataset:
        law = computed_law(BEAD, max_approach=LAW_APPROACH, spacing=law_spacing)
        return hl.CoSimulation(chain("modes", MESH_SPEED, modes, law), None).run(UNTIL, UNTIL / INTERVALS)

    return timed(computed)


def chain(model: str, impact_speed: float, modes: int = MODES, law: hl.ContactLaw | None = None) -> hl.Chain:
    """Return the thesis's chain, of point masses or of deformable beads."""
    if model == "point masses":
        return hl.Chain([BEAD] * BEADS, BEAD, impact_speed)
    return hl.DeformableChain([BEAD] * BEADS, BEAD, impact_speed, law=law, modes=modes)


def timed(computed: Callable[[], xr.Dataset]) -> xr.Dataset:
    """Return contact forces, vibration and measures of a run, and the processor time, s, for everything it needs."""
    begin = process_time()
    run = computed()
    seconds = process_time() - begin
    vibration = run.vibration_energy if "vibration_energy" in run else xr.zeros_like(run.displacement)
    share = (vibration / run.impact_energy).assign_attrs(units="1", long_name="vibration of a bead over the impact")
    mean = hl.sensor_force(run, SENSORS[0])
    section = run.section_force.sel(bead=SENSORS[0]) if "section_force" in run else mean
    apart = float(abs(section - mean).max() / mean.max())
    data = measure(run).assign(contact_force=run.contact_force, vibration_share=share).assign(scalars(
        seconds=(seconds, "s", "time of the processor"),
        inertia=(inertia(run), "1", "kinetic over potential energy of the deformation, at most"),
        section_apart=(apart, "1", "difference of the section's force from the contacts' mean, bead 10"),
    ))  # fmt: skip
    return data.drop_vars(["impact_energy", "static_force", "centre"], errors="ignore")


def inertia(run: xr.Dataset) -> float:
    """Return largest kinetic energy of the modes over the potential energy of modes and contacts, while a wave passes.

    NaN if beads have no modes. The motion of the beads as rigid bodies is not counted: contact laws include it.
    """
    if "vibration_amplitude" not in run:
        return float("nan")
    passing = run.sel(time=PASSING)
    amplitude = passing.vibration_amplitude.transpose("time", "bead", ...).values
    elastic = 0.5 * ((vibration(BEAD, amplitude.shape[-1]).frequencies * amplitude) ** 2).sum(axis=(1, 2))
    kinetic = passing.vibration_energy.sum("bead").values - elastic
    return float((kinetic / (passing.contact_energy.values + elastic)).max())


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
    return scalars(
        peak_force=(peak, "N", "peak force between beads 15 and 16"),
        wave_speed=(speed, "m/s", "wave speed between contacts 10 and 16"),
        energy_error=(hl.energy_error(run), "1", "energy error"),
    )


def shape() -> xr.Dataset:
    """Return section 3.3.2: forces at both sensors over `shape_time`, s, with the echo of the wall; measures."""

    def struck(beads: str) -> xr.Dataset:
        run = hl.CoSimulation(chain(beads, SHAPE_SPEED), WALL).run(WITH_ECHO, UNTIL / INTERVALS)
        data = named(measure(run.sel(time=slice(None, UNTIL))), "shape")
        data["sensor_force"] = waves.sensor_forces(run, SENSORS)
        if "section_force" in run:
            data["section_force"] = run.section_force.sel(bead=list(SENSORS)).rename(bead="sensor")
        return data.reset_coords(drop=True).rename(time="shape_time")

    data = over(struck, beads=MODELS)
    return data.assign(section_force=data.section_force.sel(beads="modes", drop=True))


def over_speed(impact_speeds: Sequence[float]) -> xr.Dataset:
    """Return figure 3.5: peak force and wave speed of both models over the striker speed, m/s, and by equation 1.10."""

    def measured(beads: str, impact_speed: float) -> xr.Dataset:
        # Times in a Hertzian chain go as the striker speed to the −1/5.
        until = UNTIL * (MESH_SPEED / impact_speed) ** 0.2
        return measure(hl.CoSimulation(chain(beads, impact_speed), None).run(until, until / INTERVALS))

    data = over(measured, beads=MODELS, impact_speed=impact_speeds).drop_vars("energy_error")
    label = {"units": "m/s", "long_name": "wave speed, equation 1.10"}
    data["theory"] = (data.peak_force.dims, by_force(data.peak_force.values), label)
    return named(data, "speed")


def by_force(force: Vector) -> Vector:
    """Return the wave speed, m/s, at peak contact forces, N (equation 1.10)."""
    return waves.long_waves(BEAD).wave_speed_from_force(force)


def theory(time: Vector, crest: float, speed: float) -> Vector:
    """Return the force, N, of a wave whose crest passes at `crest`, s, from its strain (equation 1.8)."""
    chain = waves.long_waves(BEAD)
    force: Vector = chain.stiffness * (BEAD.size * chain.strain(speed * (time - crest), 0.0, speed)) ** HERTZ
    return force


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of sections 3.3.2 and 3.4, compared with those of hertzlink."""
    return [*_waves_shown(data), *_converged(data), *_inside(data)]


def _waves_shown(data: xr.Dataset) -> list[Row]:
    """Return figures 3.3 to 3.5."""
    rigid, soft = data.shape_wave_speed.sel(beads=list(MODELS)).values.tolist()
    at = float(by_force(data.shape_peak_force.sel(beads="point masses").values))
    ahead = 100.0 * (data.speed_wave_speed / data.speed_theory - 1.0).mean("impact_speed").sel(beads=list(MODELS))
    by_theory = f"equation 1.10 gives {at:.1f} at the simulated force, and the thesis's own 560 at 0.5 m/s gives "
    faster = (SHAPE_SPEED / MESH_SPEED) ** 0.2
    reached = SHAPE_SPEED * (635.0 / rigid) ** 5
    return [
        row("wave speed at 0.63 m/s, discrete particles", rigid, by_theory, 560.0 * faster, reached),
        row("wave speed at 0.63 m/s, finite elements", soft, 552.8 * faster),
        row("wave speed at 0.63 m/s, experiment", soft),
        row("wave speed over equation 1.10, figure 3.5", "{:+.1f}, {:+.1f}".format(*ahead.values)),
    ]


def _converged(data: xr.Dataset) -> list[Row]:
    """Return the waves of section 3.4, and the time that they need."""
    (rigid, soft), (slow, slower) = (data[name].values.tolist() for name in ("peak_force", "wave_speed"))
    expected = float(by_force(np.array(rigid)))
    one_mode, slow_mode = (float(data[f"modes_{name}"].sel(modes=1)) for name in ("peak_force", "wave_speed"))
    otherwise = {"by equation 1.10 at this force": expected}
    return [
        row("peak force, discrete particles", rigid),
        row("peak force, finite elements", soft, one_mode),
        row("wave speed, discrete particles", slow, expected, otherwise=otherwise),
        row("wave speed, finite elements", slower, slow_mode),
        row("time with modes", _clock(float(data.law_seconds[-1]))),
    ]


def _clock(seconds: float) -> str:
    """Return minutes or seconds as text."""
    return f"{seconds / 60.0:.1f} min" if seconds >= 60.0 else f"{seconds:.2g} s"


def _inside(data: xr.Dataset) -> list[Row]:
    """Return the quantities that point masses lack: the section of figure 3.3, and the energy of vibrations."""
    mean, section, expected, centre = (curve.values for curve in at_first_sensor(data))
    apart, inertia = float(np.abs(section - mean).max() / mean.max()), float(data.inertia.sel(model="modes"))
    passing = data.vibration_share.sum("bead").sel(time=PASSING)
    behind = float(data.vibration_share.isel(time=-1).sel(bead=slice(1, 8)).sum())
    fastest = 100.0 * MESH_SPEED / pressure_speed(hl.STEEL_316)
    return [
        row("fastest motion over dilatational speed", fastest, MESH_SPEED),
        row("kinetic over potential energy", 100.0 * inertia, holds=inertia < 0.01),
        row("force at the central section over contacts' mean", float(section.max() / mean.max()), 100.0 * apart),
        row("theory over contacts' mean", float(expected.max() / mean.max()), centre.max() / mean.max()),
        row("energy in vibrations while the wave passes", 100.0 * float(passing.mean())),
        row("energy that beads 1 to 8 keep", 100.0 * behind),
    ]


def at_first_sensor(data: xr.Dataset) -> tuple[xr.DataArray, ...]:
    """Return forces at bead 10, N: of contacts, of its section; theory, averaged over contacts, and at the centre."""
    near = data.sel(sensor=SENSORS[0], shape_time=slice(None, 0.8 * UNTIL))
    mean, section = near.sensor_force.sel(beads="modes"), near.section_force
    time, speed = near.shape_time.values, float(near.shape_wave_speed.sel(beads="modes"))
    crest = float((mean * near.shape_time).sum() / mean.sum())
    half = 0.5 * BEAD.size / speed
    averaged = 0.5 * (theory(time, crest - half, speed) + theory(time, crest + half, speed))
    return mean, section, mean.copy(data=averaged), mean.copy(data=theory(time, crest, speed))


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return figures 3.3 (section), 3.4 (sensors), 3.5 (speed_force), 3.7 (contacts), 3.8 (meshes), and over modes."""
    return {
        "section": _figure_of_section(*at_first_sensor(data)),
        "sensors": _figure_of_sensors(data),
        "speed_force": _figure_of_speeds(data),
        "contacts": _figure_of_contacts(data),
        "meshes": _figure_of_meshes(data),
        "modes": _figure_of_modes(data),
    }


def _figure_of_section(
    mean: xr.DataArray, section: xr.DataArray, averaged: xr.DataArray, centre: xr.DataArray
) -> draw.Figure:
    labels = ("force at bead 10 (N)", "central section minus mean (N)")
    figure, axes = draw.panels(2, width=3.8, height=3.8, sharey=False, xlabel="time (µs)", ylabels=labels)
    time = mean.shape_time.values * 1e6
    axes[0].plot(time, section, "-", color=draw.COLOURS[1], label="central section")
    axes[0].plot(time, mean, "--", color=draw.COLOURS[0], label="mean of the contacts")
    axes[0].plot(time, averaged, "*-k", markevery=8, linewidth=0.8, label="theory of long waves, mean of the contacts")
    draw.theory_line(axes[0], time, centre, "theory of long waves, at the centre", ":")
    axes[1].plot(time, section - mean, "-", color=draw.COLOURS[1])
    middle = float(time[int(mean.values.argmax())])
    for axis in axes:
        axis.set_xlim(middle - 30.0, middle + 30.0)
    draw.legend_above(figure, axes[0], 2)
    return figure


def _figure_of_sensors(data: xr.Dataset) -> draw.Figure:
    labels = draw.Look(xlabel="time (µs)", ylabels=["mean of the contacts (N)"])
    figure, panels = draw.each(data, "beads", dict(zip(MODELS, NAMES, strict=True)).__getitem__, **labels)
    for axis, model in panels:
        draw.lines(axis, model.sensor_force, "shape_time", "sensor", "bead {}", 1e6, ("-", "--"))
    draw.legend_above(figure, panels[0][0], 2)
    return figure


def _figure_of_speeds(data: xr.Dataset) -> draw.Figure:
    """Return the wave speed over peak force, and relative to theory."""
    labels = draw.Look(xlabel="peak contact force (N)", ylabels=("wave speed (m/s)", "wave speed over theory"))
    figure, axes = draw.panels(2, width=3.6, sharey=False, **labels)
    force = data.speed_peak_force
    fine = np.geomspace(float(force.min()), float(force.max()), 200)
    speeds = (data.speed_wave_speed, by_force(fine))
    ratios = (data.speed_wave_speed / data.speed_theory, np.ones(fine.size))
    for axis, (values, theory) in zip(axes, (speeds, ratios), strict=True):
        draw.theory_line(axis, fine, theory, "theory of long waves")
        for i, model in enumerate(MODELS):
            draw.points(axis, force.sel(beads=model).values, values.sel(beads=model).values, i, NAMES[i])
        axis.set_xlim(left=0.0)
    axes[0].set_ylim(bottom=0.0)
    draw.legend_above(figure, axes[0], 3)
    return figure


def _figure_of_contacts(data: xr.Dataset) -> draw.Figure:
    """Return the forces of all contacts, one of them marked."""
    marked = CONTACTS[1]
    label = f"contact {marked}, between beads {marked - 1} and {marked}"
    labels = draw.Look(xlabel="time (µs)", ylabels=["contact force (N)"])
    figure, axes = draw.panels(len(MODELS), width=2.9, titles=NAMES, **labels)
    time, look = data.time * 1e6, draw.Look(linestyle="-", marker="")
    for axis, model in zip(axes, MODELS, strict=True):
        forces = data.contact_force.sel(model=model).transpose("time", "contact")
        axis.plot(time, forces, color=draw.COLOURS[0], linewidth=0.6, **look)
        axis.plot(time, forces.sel(contact=marked), color=draw.COLOURS[1], linewidth=1.2, label=label, **look)
        axis.set_xlim(0.0, float(time[-1]))
    axes[0].lines[0].set_label("each contact")
    draw.legend_above(figure, axes[0], 2)
    return figure


def _figure_of_meshes(data: xr.Dataset) -> draw.Figure:
    """Return the peak force and wave speed over the size of the cells from which the contact's law is computed."""
    figure, axes = draw.panels(2, width=3.4, xlabel="cells where beads touch (µm)", ylabels=LABELS, sharey=False)
    for axis, what in zip(axes, ("peak_force", "wave_speed"), strict=True):
        _level(axis, data[what].sel(model="point masses"), "-", "black", "point masses")
        axis.plot(data.law_spacing.values * 1e6, data[f"law_{what}"].values, label="deformable beads")
        draw.log_x(axis)
        axis.invert_xaxis()
    draw.legend_above(figure, axes[0], 2)
    return figure


def _level(axis: draw.Axes, value: xr.DataArray, style: str, colour: str, label: str) -> None:
    axis.axhline(float(value), color=colour, linestyle=style, linewidth=0.9, label=label)


def _figure_of_modes(data: xr.Dataset) -> draw.Figure:
    """Return the peak force and wave speed over the number of modes."""
    xlabel = "modes of a bead, with the rigid one"
    figure, axes = draw.panels(2, width=3.4, sharey=False, xlabel=xlabel, ylabels=LABELS)
    for axis, what in zip(axes, ("peak_force", "wave_speed"), strict=True):
        _level(axis, data[what].sel(model="point masses"), "-", "black", "point masses")
        axis.plot(data.modes, data[f"modes_{what}"], "s-", color=draw.COLOURS[1], label="deformable beads")
        axis.set_xticks([1, 2, 4, 6, 8, 12, 16])
    draw.legend_above(figure, axes[0], 2)
    return figure
