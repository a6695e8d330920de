"""Thesis sections 3.3.2 and 3.4: a wave in a chain of deformable beads, of point masses and by theory; its convergence.

The thesis models its beads with finite elements. Here this is done in two ways: with a few modes for each bead, and
explicitly, which is slow. A rigid wall ends the thesis's chain; waves are read before its echo arrives.
"""

from collections.abc import Callable, Sequence
from time import process_time

import joblib
import numpy as np
import xarray as xr
from numpy.polynomial import Polynomial

import hertzlink as hl
from coupling.sweeps.progress import watched
from hertzlink.studies import draw, waves
from hertzlink.studies.expected import Rows
from hertzlink.studies.table import SIMULATED, Row
from particles.deformable.vibration import vibration
from particles.laws.axisymmetric import contact_law_fem
from particles.solitary import HERTZ
from structures.elasticity import pressure_speed
from structures.structure import Vector

row = Rows("deformable_chain")
BEAD, BEADS = hl.Sphere(2.38e-3, hl.STEEL_316), 20  # The striker is a bead of the same kind: the thesis's N = 21.
WALL = hl.half_space(hl.Material(1e20, 0.3, 8000.0, "rigid"))  # The thesis's perfectly rigid plate.
SHAPE_SPEED, MESH_SPEED = 0.63, 0.5  # m/s, of the striker, in sections 3.3.2 and 3.4.
IMPACT_SPEEDS = tuple(np.geomspace(0.1, 1.6, 9))  # m/s, of figure 3.5; the thesis does not print its own.
SENSORS = (10, 15)
# The contacts between which a speed is read; the second, between beads 15 and 16, is that of figure 3.8a.
CONTACTS = (10, 16)
UNTIL = 165e-6  # s: the wave of 0.5 m/s has passed contact 16 and has not reached the wall.
WITH_ECHO = 300e-6
INTERVALS = 660  # Number of saved intervals in UNTIL.
PASSING_TIMES = (0.4, 0.8)  # Fractions of UNTIL between which the whole wave is inside the chain.
FITTED_TOP = 0.9  # The top of a pulse, which is fitted, begins at this fraction of its peak.
MODES, MODES_TRIED = 8, (1, 2, 3, 4, 6, 8, 12, 16)
LAW_SPACINGS = (20e-6, 10e-6, 5e-6, 2.5e-6)
LAW_APPROACH = 4e-6  # m; at 3.3 µm one contact stores the whole energy of a striker of 0.5 m/s.
# m, size of the explicit elements at the contacts, whose radius is 49 µm at the peak of the wave.
SPACINGS = (80e-6, 40e-6, 20e-6, 10e-6)
# In addition to explicit elements, which are named after their size: `explicit_name`.
MODELS = ("point masses", "modes")


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return the forces at both speeds, speed over force, and convergence over meshes and modes, each with its time.

    Times are processor times, because other users of the machine influence these little. quick: only the coarsest
    explicit mesh, and fewer of everything else. jobs: processes of the explicit runs, by default one for each core.
    """
    every = 4 if quick else 1
    # Compile here, so that no time below includes it.
    hl.CoSimulation(hl.DeformableChain([BEAD], BEAD, 1.0, law=hl.contact_law, modes=2), None).run(1e-5)
    explicit = _explicit(SPACINGS[::every], jobs)
    by_law = _together(
        [by_modes(size) for size in watched(LAW_SPACINGS[::every])], "law_spacing", LAW_SPACINGS[::every]
    )
    finest = float(by_law.law_spacing[-1])
    tried = _together(
        [by_modes(finest, modes) for modes in watched(MODES_TRIED[::every])], "modes", MODES_TRIED[::every]
    )
    points = timed(lambda: hl.CoSimulation(chain("point masses", MESH_SPEED), None).run(UNTIL, UNTIL / INTERVALS))
    outer = dict.fromkeys((explicit.sizes["spacing"] - 1, 0))
    named = {explicit_name(float(explicit.spacing[i])): explicit.isel(spacing=i, drop=True) for i in outer}
    ends = [points, by_law.isel(law_spacing=-1, drop=True), *named.values()]
    models = xr.concat(ends, "model").assign_coords(model=[*MODELS, *named])
    variables = ["peak_force", "wave_speed", "seconds", "cells"]
    # The explicit chain counts the contacts' strain as vibration.
    models["vibration_share"] = models.vibration_share.sel(model="modes", drop=True)
    series = [
        waves.named(series_[variables], name)
        for series_, name in ((explicit, "explicit"), (by_law, "law"), (tried, "modes"))
    ]
    data = xr.merge([models, *series, shape(), over_speed(IMPACT_SPEEDS[::every])])
    for name, units in (("spacing", "m"), ("law_spacing", "m"), ("impact_speed", "m/s"), ("shape_time", "s")):
        data[name].attrs["units"] = units
    return data


def _explicit(spacings: Sequence[float], jobs: int | None) -> xr.Dataset:
    """Return the explicit chain at 0.5 m/s over the size, m, of its elements; the longest run starts first."""
    parallel = joblib.Parallel(jobs or -1, return_as="generator")
    finished = parallel(joblib.delayed(by_elements)(spacing) for spacing in reversed(spacings))
    runs = list(watched(finished, len(spacings)))
    return _together(runs[::-1], "spacing", spacings)


def explicit_name(spacing: float) -> str:
    """Name of the model whose elements have this size, m, where beads touch."""
    return f"explicit, {spacing * 1e6:.3g} µm"


def _together(runs: list[xr.Dataset], axis: str, values: Sequence[float]) -> xr.Dataset:
    """Runs along an axis."""
    return xr.concat(runs, axis).assign_coords({axis: list(values)})


def by_elements(spacing: float) -> xr.Dataset:
    """Return the explicit chain at 0.5 m/s, elements of this size, m."""
    # A first step compiles.
    hl.explicit_chain(chain("point masses", MESH_SPEED), 1e-8, SPACINGS[0], 1e-8)
    return timed(lambda: hl.explicit_chain(chain("point masses", MESH_SPEED), UNTIL, spacing, UNTIL / INTERVALS))


def by_modes(law_spacing: float, modes: int = MODES) -> xr.Dataset:
    """Return the chain of a few modes at 0.5 m/s, with a contact law computed on a mesh of this spacing, m."""

    def one() -> xr.Dataset:
        law = contact_law_fem(BEAD, max_approach=LAW_APPROACH, spacing=law_spacing)
        return hl.CoSimulation(chain("modes", MESH_SPEED, modes, law), None).run(UNTIL, UNTIL / INTERVALS)

    return timed(one)


def chain(model: str, impact_speed: float, modes: int = MODES, law: hl.ContactLaw | None = None) -> hl.Chain:
    """Return the thesis's chain, of point masses or of deformable beads."""
    if model == "point masses":
        return hl.Chain([BEAD] * BEADS, BEAD, impact_speed)
    return hl.DeformableChain([BEAD] * BEADS, BEAD, impact_speed, law=law, modes=modes)


def timed(computed: Callable[[], xr.Dataset]) -> xr.Dataset:
    """Return the contact forces, vibration and measures of a run, and the processor time, s, for everything that it
    needs."""
    begin = process_time()
    run = computed()
    seconds = process_time() - begin
    vibration = run.vibration_energy if "vibration_energy" in run else xr.zeros_like(run.displacement)
    share = (vibration / run.impact_energy).assign_attrs(units="1", long_name="vibration of a bead over the impact")
    data = measure(run).assign(contact_force=run.contact_force, vibration_share=share)
    data["seconds"] = ((), seconds, {"units": "s", "long_name": "time of the processor"})
    label = "kinetic over potential energy of the deformation, at most"
    data["inertia"] = ((), inertia(run), {"units": "1", "long_name": label})
    mean = hl.sensor_force(run, SENSORS[0])
    section = run.section_force.sel(bead=SENSORS[0]) if "section_force" in run else mean
    apart = float(abs(section - mean).max() / mean.max())
    data["section_apart"] = (
        (),
        apart,
        {"units": "1", "long_name": "difference of the section's force from the contacts' mean, bead 10"},
    )
    data["cells"] = ((), run.attrs.get("cells", 0), {"units": "1", "long_name": "explicit elements in all beads"})
    return data.drop_vars(["impact_energy", "static_force", "centre"], errors="ignore")


def inertia(run: xr.Dataset) -> float:
    """Return largest kinetic energy of the modes over the potential energy of modes and contacts, while a wave passes.

    NaN if beads have no modes. The motion of the beads as rigid bodies is not counted: contact laws include it.
    """
    if "vibration_amplitude" not in run:
        return float("nan")
    passing = run.sel(time=slice(*(part * UNTIL for part in PASSING_TIMES)))
    amplitude = passing.vibration_amplitude.transpose("time", "bead", ...).values
    elastic = 0.5 * ((vibration(BEAD, amplitude.shape[-1]).frequencies * amplitude) ** 2).sum(axis=(1, 2))
    kinetic = passing.vibration_energy.sum("bead").values - elastic
    return float((kinetic / (passing.contact_energy.values + elastic)).max())


def measure(run: xr.Dataset) -> xr.Dataset:
    """Return peak force at the second contact, N, and speed between the two contacts, m/s, of the only wave in a run.

    Explicit elements touch node by node, so their forces scatter. Therefore, for all models, the peak is that of a
    polynomial through the top of the pulse, and the time of a wave is that of the centroid of its force.
    """
    force = run.contact_force.sel(contact=list(CONTACTS)).reset_coords(drop=True)
    first, second = ((force * force.time).sum("time") / force.sum("time")).values
    speed = (CONTACTS[1] - CONTACTS[0]) * BEAD.size / (second - first)
    peak = top(run.time.values, force.sel(contact=CONTACTS[1]).values)
    values = {
        "peak_force": (peak, "N", "peak force between beads 15 and 16"),
        "wave_speed": (speed, "m/s", "wave speed between contacts 10 and 16"),
        "energy_error": (hl.energy_error(run), "1", "energy error"),
    }
    return xr.Dataset({name: ((), value, {"units": u, "long_name": text}) for name, (value, u, text) in values.items()})


def top(time: Vector, force: Vector) -> float:
    """Return the maximum of a polynomial of fourth order through the samples near the largest force."""
    near = force > FITTED_TOP * force.max()
    fit = Polynomial.fit(time[near], force[near], 4)
    return float(fit(np.linspace(float(fit.domain[0]), float(fit.domain[1]), 1001)).max())


def shape() -> xr.Dataset:
    """Return section 3.3.2: forces at both sensors over `shape_time`, s, with the echo of the wall; measures."""
    runs = [hl.CoSimulation(chain(model, SHAPE_SPEED), WALL).run(WITH_ECHO, UNTIL / INTERVALS) for model in MODELS[:2]]
    measured = [measure(run.sel(time=slice(None, UNTIL))) for run in runs]
    data = waves.named(xr.concat(measured, "beads"), "shape")
    sensed = [xr.concat([hl.sensor_force(run, sensor) for sensor in SENSORS], "sensor") for run in runs]
    data["sensor_force"] = xr.concat(sensed, "beads").assign_attrs(units="N", long_name="mean of a bead's contacts")
    data["section_force"] = runs[1].section_force.sel(bead=list(SENSORS)).rename(bead="sensor").reset_coords(drop=True)
    return data.assign_coords(beads=list(MODELS[:2]), sensor=list(SENSORS)).rename(time="shape_time")


def over_speed(impact_speeds: Sequence[float]) -> xr.Dataset:
    """Return figure 3.5: peak force and wave speed of both models over the striker speed, m/s, and by equation 1.10."""
    models = []
    for model in MODELS[:2]:
        # In a Hertzian chain times are proportional to the power −1/5 of the striker speed.
        lengths = [UNTIL * (MESH_SPEED / speed) ** 0.2 for speed in impact_speeds]
        runs = [
            measure(hl.CoSimulation(chain(model, speed), None).run(until, until / INTERVALS))
            for speed, until in zip(impact_speeds, lengths, strict=True)
        ]
        models.append(xr.concat(runs, "impact_speed").assign_coords(impact_speed=list(impact_speeds)))
    data = xr.concat(models, "beads").assign_coords(beads=list(MODELS[:2])).drop_vars("energy_error")
    data["theory"] = (data.peak_force.dims, by_force(data.peak_force.values))
    data["theory"].attrs = {"units": "m/s", "long_name": "wave speed, equation 1.10"}
    return waves.named(data, "speed")


def by_force(force: Vector) -> Vector:
    """Return the wave speed, m/s, at peak contact forces, N (equation 1.10)."""
    return hl.theory.UniformChain(
        BEAD.size, BEAD.mass, hl.theory.hertz_stiffness(BEAD.surface, BEAD.surface)
    ).wave_speed_from_force(force)


def theory(time: Vector, crest: float, speed: float) -> Vector:
    """Return the force, N, between particles when the crest of a wave passes at `crest`, s, from its strain (equation
    1.8)."""
    stiffness = hl.theory.hertz_stiffness(BEAD.surface, BEAD.surface)
    strain = hl.theory.UniformChain(BEAD.size, BEAD.mass, stiffness).strain(speed * (time - crest), 0.0, speed)
    force: Vector = stiffness * (BEAD.size * strain) ** HERTZ
    return force


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of sections 3.3.2 and 3.4, compared with those of hertzlink."""
    return [*_waves_shown(data), *_converged(data), *_meshes(data), *_inside(data)]


def _waves_shown(data: xr.Dataset) -> list[Row]:
    """Return figures 3.3 to 3.5."""
    rigid, soft = (float(data.shape_wave_speed.sel(beads=name)) for name in MODELS[:2])
    at = float(by_force(data.shape_peak_force.sel(beads="point masses").values))
    ahead = 100.0 * (data.speed_wave_speed / data.speed_theory - 1.0).mean("impact_speed")
    by_theory = f"equation 1.10 gives {at:.1f} at the simulated force, and the thesis's own 560 at 0.5 m/s gives "
    scaled = 560.0 * (SHAPE_SPEED / MESH_SPEED) ** 0.2
    return [
        row("wave speed at 0.63 m/s, discrete particles", rigid, by_theory, scaled),
        row("wave speed at 0.63 m/s, finite elements", soft, 552.8 * (SHAPE_SPEED / MESH_SPEED) ** 0.2),
        row("wave speed at 0.63 m/s, experiment", soft),
        row("wave speed over equation 1.10, figure 3.5", _both(ahead, "+.1f")),
    ]  # fmt: skip


def _both(values: xr.DataArray, form: str) -> str:
    """Return the values of point masses and of beads with modes."""
    return ", ".join(f"{float(values.sel(beads=name)):{form}}" for name in MODELS[:2])


def _converged(data: xr.Dataset) -> list[Row]:
    """Return the waves of section 3.4 with the smallest cells of the run."""
    models = data.model.values.tolist()
    force, speed = (dict(zip(models, data[name].values.tolist(), strict=True)) for name in ("peak_force", "wave_speed"))
    explicit = explicit_name(float(data.spacing[-1]))
    theory_speed = float(by_force(np.array(force["point masses"])))
    rigid, first = (float(data[f"modes_{name}"].sel(modes=1)) for name in ("peak_force", "wave_speed"))
    cells = f"explicit, {float(data.spacing[-1]) * 1e6:.3g} µm cells"
    return [
        row("peak force, discrete particles", force["point masses"]),
        row("peak force, finite elements", force["modes"], rigid),
        row("peak force, explicit elements", force[explicit], cells),
        row("wave speed, discrete particles", speed["point masses"], theory_speed,
            otherwise={"by equation 1.10 at this force": theory_speed}),
        row("wave speed, finite elements", speed["modes"], first),
        row("wave speed, explicit elements", speed[explicit], cells),
    ]  # fmt: skip


def _meshes(data: xr.Dataset) -> list[Row]:
    """Return figures 3.7 and 3.8, and the times that they needed."""
    rows = []
    # A quick run has only the coarsest mesh.
    for place, name in ((0, "coarsest"), (-1, "finest"))[: data.spacing.size]:
        mesh = data.isel(spacing=place)
        rows += [
            row(f"elements, {name} mesh", _spaced(int(mesh.explicit_cells)), float(mesh.spacing) * 1e6),
            row(f"time, {name} mesh", _clock(float(mesh.explicit_seconds)), UNTIL * 1e6),
        ]  # fmt: skip
    coarse, law = data.isel(spacing=0), data.isel(law_spacing=-1)
    forces = data.explicit_peak_force.values
    halved = ""
    if forces.size > 1:
        halved = f"; the last halving of the cells changes it by {100.0 * (forces[-1] / forces[-2] - 1.0):+z.1f} %"
    return [
        row("elements (thesis, section 3.3.2)", _spaced(int(data.explicit_cells[-1])), float(data.spacing[-1]) * 1e6,
            MODES),
        *rows,
        row("time with modes", _clock(float(law.law_seconds))),
        row("peak force, coarsest mesh", float(coarse.explicit_peak_force), halved,
            holds=_deviates(data.explicit_peak_force)),
        row("wave speed, coarsest mesh", float(coarse.explicit_wave_speed), holds=_deviates(data.explicit_wave_speed)),
    ]  # fmt: skip


def _deviates(values: xr.DataArray) -> bool | None:
    """Return whether the coarsest mesh differs from the finest one; not known with one mesh."""
    return abs(float(values[0] / values[-1]) - 1.0) > SIMULATED if values.size > 1 else None


def _spaced(number: int) -> str:
    return f"{number:,}".replace(",", " ")


def _clock(seconds: float) -> str:
    """Return minutes or seconds as text."""
    return f"{seconds / 60.0:.1f} min" if seconds >= 60.0 else f"{seconds:.2g} s"


def _inside(data: xr.Dataset) -> list[Row]:
    """Return the quantities that point masses lack: the section of figure 3.3, and the energy of vibrations."""
    mean, section, expected, centre = (curve.values for curve in at_first_sensor(data))
    shaken = 100.0 * float(data.section_apart.sel(model=explicit_name(float(data.spacing[-1]))))
    apart = 100.0 * float(np.abs(section - mean).max() / mean.max())
    share = data.vibration_share.sum("bead")
    passing = share.sel(time=slice(*(part * UNTIL for part in PASSING_TIMES)))
    behind = float(data.vibration_share.isel(time=-1).sel(bead=slice(1, 8)).sum())
    return [
        row("fastest motion over dilatational speed", 100.0 * MESH_SPEED / pressure_speed(hl.STEEL_316),
            MESH_SPEED),
        row("kinetic over potential energy", 100.0 * float(data.inertia.sel(model="modes")),
            holds=float(data.inertia.sel(model="modes")) < 0.01),
        row("force at the central section over contacts' mean", float(section.max() / mean.max()), apart,
            float(data.spacing[-1]) * 1e6, shaken),
        row("theory over contacts' mean", float(expected.max() / mean.max()), centre.max() / mean.max()),
        row("energy in vibrations while the wave passes", 100.0 * float(passing.mean())),
        row("energy that beads 1 to 8 keep", 100.0 * behind),
    ]  # fmt: skip


def at_first_sensor(data: xr.Dataset) -> tuple[xr.DataArray, ...]:
    """Return forces at bead 10, N: mean of its contacts, at its section; theory, averaged over contacts, and at the
    centre."""
    near = data.sel(sensor=SENSORS[0], shape_time=slice(None, 0.8 * UNTIL))
    mean, section = near.sensor_force.sel(beads="modes"), near.section_force
    time, speed = near.shape_time.values, float(near.shape_wave_speed.sel(beads="modes"))
    crest = float((mean * near.shape_time).sum() / mean.sum())
    half = 0.5 * BEAD.size / speed
    averaged = 0.5 * (theory(time, crest - half, speed) + theory(time, crest + half, speed))
    return mean, section, mean.copy(data=averaged), mean.copy(data=theory(time, crest, speed))


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return figures 3.3 (section), 3.4 (sensors), 3.5 (speed_force), 3.7 (contacts), 3.8 (meshes), and over modes."""
    from hertzlink.studies import deformable_figures as drawn

    return {
        "section": drawn.section(at_first_sensor(data)),
        "sensors": drawn.sensors(data),
        "speed_force": drawn.speed_force(data, by_force),
        "contacts": drawn.contacts(data, CONTACTS[1]),
        "meshes": drawn.meshes(data),
        "modes": drawn.modes(data),
    }
