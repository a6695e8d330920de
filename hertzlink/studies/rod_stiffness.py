"""Thesis section 6.1.1: dependence of the reflected waves on the stiffness of a clamped cylinder."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, waves
from hertzlink.studies import struck_cylinders as struck
from hertzlink.studies.results import named, over, scalars, with_units
from hertzlink.studies.struck_cylinders import BEADS, DASHPOT, DASHPOTS, SENSOR, THESIS, UNTIL, WAVES
from hertzlink.studies.table import Row, Rows
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from structures.structure import Vector

row = Rows("rod_stiffness")
LENGTH, RADIUS = 76.2e-3, 19.1e-3
MODULI = tuple(np.geomspace(1.0e9, 210.0e9, 61))
# Compared with the rod: the axisymmetric cylinder, and the half-space of the thesis's theory.
BODIES = ("cylinder", "half-space")
WALLS = {"steel 440C": hl.STEEL_440C, "PTFE": hl.PTFE}  # The two extremes of figures 6.2 and 6.3.
TIME_CONSTANT = 1e-3  # s, RC of the piezoelectric discs (section 2.2).
DISPLACED = "while the bead is displaced by more than 1 % of its greatest displacement"
FAR_SENSOR = 12  # Incident and reflected wave are timed between this sensor and sensor 7, both away from the ends.


def layers(material: hl.Material) -> list[hl.Layer]:
    """Return the cylinder of a material."""
    return [hl.Layer(material, LENGTH, RADIUS)]


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR, TOF and the force at the sensors over Young's modulus, and for the materials of Table 2.1.

    Over the modulus, density and Poisson's ratio stay those of 440C steel. Names with "material" belong to rods, with
    "solid" to axisymmetric cylinders and half-spaces, with "wall" to the two rods whose chains are shown bead by bead.
    quick: every sixth modulus, steel 440C and PTFE only.
    """
    jobs = 1 if quick and jobs is None else jobs  # Starting processes takes longer.
    materials = WALLS if quick else {m.name: m for m in hl.MATERIALS.values()}

    def stiff(youngs_modulus: float) -> hl.CoSimulation:
        material = replace(hl.STEEL_440C, youngs_modulus=youngs_modulus, name="")
        return hl.CoSimulation(THESIS.chain(), THESIS.slender(layers(material)))

    def real(material: str, dashpot: float) -> hl.CoSimulation:
        return hl.CoSimulation(THESIS.chain(dashpot), THESIS.slender(layers(materials[material])))

    def wide(material: str, body: str) -> hl.CoSimulation:
        wall = materials[material]
        cylinder = hl.half_space(wall) if body == "half-space" else THESIS.solid(layers(wall))
        return hl.CoSimulation(THESIS.chain(), cylinder)

    moduli = MODULI[::6] if quick else MODULI
    data = hl.sweep(stiff, UNTIL, jobs, struck.with_forces, youngs_modulus=moduli)
    rods = hl.sweep(real, UNTIL, jobs, struck.measure, material=list(materials), dashpot=DASHPOTS)
    solids = hl.sweep(wide, UNTIL, jobs, struck.measure, material=list(materials), body=BODIES)
    data = data.assign(named(rods, "material").data_vars).assign(named(solids, "solid").data_vars)
    data["material_modulus"] = ("material", [m.youngs_modulus for m in materials.values()], {"units": "Pa"})
    with_units(data, youngs_modulus="Pa", dashpot="N s/m")
    return data.merge(walls(), combine_attrs="override")


def walls() -> xr.Dataset:
    """Return the motion of beads on the stiffest and the softest rod, the force at the sensors, and the energies."""

    def against(wall: str) -> xr.Dataset:
        run = hl.CoSimulation(THESIS.chain(), THESIS.slender(layers(WALLS[wall]))).run(UNTIL)
        behind = hl.reflections(struck.high_pass(run, TIME_CONSTANT), SENSOR).primary
        stiffness = THESIS.wall(WALLS[wall])
        resting = (float(run.static_force.max()) / stiffness) ** (2.0 / 3.0)
        overlap = run.displacement.sel(bead=BEADS) - run.surface_displacement + resting
        stored = 0.4 * stiffness * overlap.clip(min=0.0) ** 2.5
        share = stored / (run.kinetic_energy + run.contact_energy + run.structure_energy)
        last = run.contact_force.sel(contact=BEADS, drop=True).assign_attrs(
            long_name="force between the last two beads"
        )
        data = scalars(
            energy_share=(float(share[stored.argmax("time")]), "1", "energy of the last contact / energy left"),
            speed_ratio=(_speed_ratio(run), "1", "speed of the primary wave / that of the incident one"),
            filtered_ratio=(behind.amplitude_ratio if behind else np.nan, "1", "AR behind the sensor's high-pass"),
            displaced=(_displaced_for(run.time.values, run.displacement.sel(bead=BEADS).values), "s", DISPLACED),
        )
        force = waves.sensor_forces(run, struck.SENSORS)
        return data.assign(displacement=run.displacement, sensor_force=force, last_force=last).reset_coords(drop=True)

    return named(over(against, wall=list(WALLS)), "wall")


def _displaced_for(time: Vector, moved: Vector) -> float:
    """Return how long, s, a bead stays displaced by more than 1 % of its greatest displacement, around that."""
    deepest, low = int(moved.argmax()), moved <= 0.01 * moved.max()
    after = np.flatnonzero(low[deepest:])
    start = float(time[np.flatnonzero(low[:deepest])[-1]])
    return float(time[deepest + after[0]]) - start if after.size else float("nan")


def _speed_ratio(run: xr.Dataset) -> float:
    """Return the speed of the primary wave over that of the incident one, between two sensors away from both ends."""
    near, far = (hl.reflections(run, sensor) for sensor in (SENSOR, FAR_SENSOR))
    if not (near.incident and far.incident and near.primary and far.primary):
        return float("nan")
    return (far.incident.arrival - near.incident.arrival) / (near.primary.arrival - far.primary.arrival)


def collisions(data: xr.Dataset) -> tuple[float, ...]:
    """Return when, s, bead 20 is deepest in the softest rod, and when it then hits bead 19, at most twice."""
    soft = data.isel(wall=-1)
    force, deepest = soft.wall_last_force.values, int(soft.wall_displacement.sel(bead=BEADS).values.argmax())
    hits = np.flatnonzero((force[deepest + 1 :] > 0.0) & (force[deepest:-1] <= 0.0))[:2] + deepest + 1
    return tuple(float(data.time[i]) for i in (deepest, *hits))


def table(data: xr.Dataset) -> list[Row]:
    """Return the numbers of section 6.1.1 and Table 2.1, compared with ours."""
    return [*_waves(data), *_sensor(data), *_last_bead(data), *_critical(data), *_solid(data), *table_2_1()]


def table_2_1() -> list[Row]:
    """Return the 27 numbers of Table 2.1, densities and elastic constants, and those of hertzlink."""
    rows, of_table = [], Rows("table_2_1")
    for name in of_table.entries:
        constant, _, material = name.partition(", ")
        constants = hl.MATERIALS[material]
        ours = {"density": constants.density, "Young's modulus": 1e-9 * constants.youngs_modulus}
        rows.append(of_table(name, ours.get(constant, constants.poisson_ratio)))
    return rows


def _both(
    data: xr.Dataset, label: str, name: str, factor: float = 1.0, first: Sequence[float] = (),
    theory: Sequence[float | str] = ("", ""), displaced: Sequence[float] = (),
) -> Iterable[Row]:  # fmt: skip
    """Return the rows of steel and of PTFE. first, theory, displaced: a value for each."""
    for i, (short, material) in enumerate(zip(("steel", "PTFE"), WALLS, strict=True)):
        values = data[f"material_{name}"].sel(material=material)
        values = values.sel(wave="primary") if "wave" in values.dims else values
        ours = float(values.sel(dashpot=DASHPOT).fillna(0.0)) * factor
        others = struck.over_dashpots(values, factor) | ({DISPLACED: displaced[i]} if displaced else {})
        said = *first[i : i + 1], struck.sensitivity(values, factor)
        yield row(f"{label} {short}", ours, *said, theory=theory[i], otherwise=others)


def _waves(data: xr.Dataset) -> list[Row]:
    steel, ptfe = (data.sel(material=name, dashpot=DASHPOT) for name in WALLS)
    flights = [struck.flight(of.material_time_of_flight) for of in (steel, ptfe)]
    theory = [float(THESIS.time_of_flight(THESIS.wall(m))) * 1e6 for m in WALLS.values()]
    slower = [100.0 * (1.0 - float(data.wall_speed_ratio.sel(wall=name))) for name in WALLS]
    return [
        row("definition of AR", "F_ref/F_in", holds=True),
        row("definition of TOF", "peak to peak", holds=True),
        row("incident wave at sensor 7", float(steel.material_incident_arrival) * 1e6),
        *_both(data, "AR,", "amplitude_ratio"),
        *_both(data, "TOF,", "time_of_flight", 1e6, theory),
        row("TOF, PTFE over steel", f"{100.0 * (flights[1] / flights[0] - 1.0):.1f} %"),
        row("SSW after PSW, PTFE", struck.delay(ptfe.material_time_of_flight)),
        row("reflected wave slower than incident, steel", f"{slower[0]:.1f} %", slower[1]),
    ]


def _contacts(data: xr.Dataset) -> Iterable[Row]:
    """Return the rows of the last bead's contact, with its duration where it is read from the bead's displacement."""
    return _both(data, "contact with", "contact_time", 1e6, displaced=(1e6 * data.wall_displaced).values.tolist())


def _displaced(data: xr.Dataset) -> Iterable[Row]:
    """Return the rows of the last bead's displacement, with equation 6.6."""
    energy = 0.5 * THESIS.sphere.mass * (PARTICLE_TO_STRIKER_SPEED * THESIS.speed) ** 2
    deepest = [1e6 * (2.5 * energy / THESIS.wall(wall)) ** 0.4 for wall in WALLS.values()]
    return _both(data, "largest displacement of bead 20,", "largest_displacement", 1e6, theory=deepest)


def _sensor(data: xr.Dataset) -> Iterable[Row]:
    """Return the effect on AR of the time constant of the sensors, which section 2.2 gives."""
    for name in WALLS:
        plain = struck.ratio(data.material_amplitude_ratio.sel(material=name, dashpot=DASHPOT))
        seen = float(data.wall_filtered_ratio.sel(wall=name))
        yield row(f"AR, {name}, behind the sensor's RC", seen, plain, 1e3 * TIME_CONSTANT)


def _last_bead(data: xr.Dataset) -> list[Row]:
    """Return its motion, and the energy that its contact stores."""
    deepest, first, second = (time * 1e6 for time in collisions(data))
    hard, soft = (float(data.wall_energy_share.sel(wall=wall)) for wall in WALLS)
    return [
        *_displaced(data),
        *_contacts(data),
        row("bead 20 deepest in PTFE", deepest),
        row("first collision of beads 20 and 19, PTFE", first),
        row("second collision, PTFE", second, second - first),
        row("energy that becomes potential, steel", hard),
        row("energy that becomes potential, PTFE", soft),
    ]


def _critical(data: xr.Dataset) -> list[Row]:
    critical, steel = hl.theory.critical_modulus(hl.STEEL_440C), hl.STEEL_440C.youngs_modulus
    secondary = data.amplitude_ratio.sel(wave="secondary").fillna(0.0)
    gap = data.youngs_modulus.where(secondary == 0.0)
    tail = f"SSW here part from the primary wave's tail below {float(gap.min()) * 1e-9:.0f} GPa only"
    if float(data.youngs_modulus.max()) > float(gap.max()):
        tail += f", and what is above {float(gap.max()) * 1e-9:.0f} GPa are the last beads' small collisions"
    return [
        row("E below which SSW form, over the bead's", critical / steel),
        row("modulus below which SSW form", critical * 1e-9),
        row("SSW there, over the incident wave", float(secondary.interp(youngs_modulus=critical)), tail),
        row("steel stiffer than PTFE", f"{steel / hl.PTFE.youngs_modulus:.0f} times"),
    ]


def _solid(data: xr.Dataset) -> Iterable[Row]:
    for name in WALLS:
        rod, *wide = data.sel(material=name, dashpot=DASHPOT), *(data.sel(material=name, body=b) for b in BODIES)
        (ratio, flight), space = (
            (struck.ratio(body.solid_amplitude_ratio), struck.flight(body.solid_time_of_flight)) for body in wide
        )
        apart = ratio - struck.ratio(rod.material_amplitude_ratio)
        later = flight - struck.flight(rod.material_time_of_flight)
        yield row(f"AR, {name}, axisymmetric", ratio, apart, later, *space)


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return the forces (figure 6.2), displacements (6.3), TOF and AR over the modulus (6.4, 6.6), force map (6.5)."""
    force = data.sensor_force.sel(sensor=SENSOR).transpose("youngs_modulus", "time").values
    return {
        "stiffness": _over_modulus(data),
        "force_intensity": draw.intensity_map(data.time.values, data.youngs_modulus.values, force),
        "force_histories": _histories(data),
        "displacements": _displacements(data),
    }


def _over_modulus(data: xr.Dataset) -> draw.Figure:
    figure, axes = draw.panels(2, width=3.9, height=3.4, sharey=False)
    modulus, label = data.youngs_modulus.values, "Young's modulus of the cylinder (GPa)"
    real_modulus = data.material_modulus * 1e-9
    for axis, name, factor, what in (
        (axes[0], "time_of_flight", 1e6, "time of flight (µs)"),
        (axes[1], "amplitude_ratio", 1.0, "amplitude ratio AR"),
    ):
        rods = data[f"material_{name}"].sel(dashpot=DASHPOT)
        cylinders = data[f"solid_{name}"].sel(body="cylinder")
        for colour, wave in zip(draw.COLOURS, WAVES, strict=False):
            axis.plot(modulus * 1e-9, factor * data[name].sel(wave=wave), "-", color=colour, label=f"{wave} wave")
            axis.plot(real_modulus, factor * rods.sel(wave=wave), "o", color=colour)
            axis.plot(real_modulus, factor * cylinders.sel(wave=wave), "x", color=colour)
        axis.set(xscale="log", xlabel=label, ylabel=what)
        axis.xaxis.set_major_formatter("{x:g}")
    walls = [THESIS.wall(replace(hl.STEEL_440C, youngs_modulus=value, name="")) for value in modulus]
    draw.theory_line(axes[0], modulus * 1e-9, THESIS.time_of_flight(np.array(walls)) * 1e6, "theory of contact times")
    axes[1].plot([], [], "o", color="grey", label="rods of real materials")
    axes[1].plot([], [], "x", color="grey", label="axisymmetric cylinders")
    draw.marked(
        axes[1], hl.theory.critical_modulus(hl.STEEL_440C) * 1e-9, "theory: secondary\nwaves left of this", left=True
    )
    axes[1].set_ylim(0.0, 1.25)
    axes[0].legend()
    axes[1].legend(frameon=True, framealpha=1.0, edgecolor="none", loc="upper left")
    return figure


def _histories(data: xr.Dataset) -> draw.Figure:
    figure, panels = draw.each(
        data, "wall", "against {}".format, width=3.9, height=3.0, ylabels=["force above the preload (N)"]
    )
    for axis, wall in panels:
        draw.histories(axis, wall.wall_sensor_force)
    panels[0][0].legend()
    return figure


def _displacements(data: xr.Dataset) -> draw.Figure:
    figure, panels = draw.each(data, "wall", "against {}".format, width=3.9, height=3.4)
    for axis, wall in panels:
        draw.displacements(axis, wall.wall_displacement, SENSOR)
    last, look = data.wall_displacement.isel(wall=-1).sel(bead=BEADS) * 1e6, draw.Look(markerfacecolor="none")
    for time, marker, which in zip(collisions(data)[1:], ("o", "s"), ("first", "second"), strict=False):
        at, label = float(last.sel(time=time)), f"{which} collision"
        axis.plot(time * 1e6, at, marker, color="black", markersize=6.0, label=label, **look)
    top = float(data.wall_displacement.max()) * 1e6
    panels[0][0].set(ylabel="displacement (µm)", ylim=(-0.4 * top, 1.1 * top))
    axis.legend()
    return figure
