"""Thesis section 6.1.1: dependence of the reflected waves on the stiffness of a clamped cylinder."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import candidates, conditions, draw, waves
from hertzlink.studies import struck_cylinders as struck
from hertzlink.studies.results import named, over, scalars, with_units
from hertzlink.studies.struck_cylinders import BEADS, DASHPOT, SENSOR, THESIS, WAVES
from hertzlink.studies.table import Row, Rows
from particles.solitary import PARTICLE_TO_STRIKER_SPEED
from structures.quantities import Likely

row = Rows("rod_stiffness")
LENGTH, RADIUS = 76.2e-3, 19.1e-3
MODULI = tuple(np.geomspace(1.0e9, 210.0e9, 61))
MODULUS = replace(Likely.MODULUS, low=1e5, high=1e13)
SWEPT = "Young's moduli of the sweep; density and Poisson's ratio stay those of 440C steel"
# Compared with the rod: the axisymmetric cylinder, and the half-space of the thesis's theory.
BODIES = ("cylinder", "half-space")
WALLS = {"steel 440C": hl.STEEL_440C, "PTFE": hl.PTFE}  # The two extremes of figures 6.2 and 6.3.
TIME_CONSTANT = 1e-3  # s, RC of the piezoelectric discs (section 2.2).
DISPLACED = "while the bead is displaced by more than 1 % of its greatest displacement"
FAR_SENSOR = 12  # Incident and reflected wave are timed between this sensor and sensor 7, both away from the ends.


@dataclass(frozen=True)
class Conditions(struck.Striking):
    """Parameters that can be changed."""

    material: Annotated[tuple[hl.Material, ...], "Materials of rods and cylinders"] = tuple(hl.MATERIALS.values())
    modulus: Annotated[tuple[float, ...], MODULUS, SWEPT] = MODULI
    length: Annotated[float, conditions.LENGTH, "Length of the cylinder"] = LENGTH
    radius: Annotated[float, conditions.LENGTH, "Radius of the cylinder"] = RADIUS

    def layers(self, material: hl.Material) -> list[hl.Layer]:
        """Return the cylinder of a material."""
        return [hl.Layer(material, self.length, self.radius)]

    def stacks(self) -> Iterable[Sequence[hl.Layer]]:
        """Return all cylinders."""
        softest = replace(hl.STEEL_440C, youngs_modulus=min(self.modulus), name="")
        return [self.layers(material) for material in (*self.material, softest)]

    def materials(self) -> dict[str, hl.Material]:
        """Return the materials by name, or by modulus where they have none."""
        return {m.name or f"{m.youngs_modulus * 1e-9:.4g} GPa": m for m in self.material}

    def walls(self) -> dict[str, hl.Material]:
        """Return the two extremes, whose chains are shown bead by bead; one if there is only one material."""
        if self.material == self.thesis("material"):
            return WALLS
        ends = [extreme(self.material, key=lambda material: material.youngs_modulus) for extreme in (max, min)]
        return replace(self, material=tuple(ends)).materials()


def run(quick: bool = False, jobs: int | None = None, **parameters: Any) -> xr.Dataset:
    """Return AR, TOF and the force at the sensors over Young's modulus, and for the materials of Table 2.1.

    Over the modulus, density and Poisson's ratio stay those of 440C steel. Names with "material" belong to rods, with
    "solid" to axisymmetric cylinders and half-spaces, with "wall" to the two rods whose chains are shown bead by bead.
    quick: every sixth modulus, steel 440C and PTFE only.
    """
    of, jobs = Conditions.of(parameters), 1 if quick and jobs is None else jobs  # Starting processes takes longer.
    of.check_meshes()
    materials = WALLS if quick and of.material == of.thesis("material") else of.materials()

    def stiff(youngs_modulus: float) -> hl.CoSimulation:
        material = replace(hl.STEEL_440C, youngs_modulus=youngs_modulus, name="")
        return hl.CoSimulation(of.chain(), of.slender(of.layers(material)))

    def real(material: str, dashpot: float) -> hl.CoSimulation:
        return hl.CoSimulation(of.chain(dashpot), of.slender(of.layers(materials[material])))

    def wide(material: str, body: str) -> hl.CoSimulation:
        wall = materials[material]
        return hl.CoSimulation(of.chain(), hl.half_space(wall) if body == "half-space" else of.solid(of.layers(wall)))

    moduli = of.few("modulus", MODULI[::6] if quick else MODULI)
    data = hl.sweep(stiff, of.until, jobs, struck.with_forces, youngs_modulus=moduli)
    rods = hl.sweep(real, of.until, jobs, struck.measure, material=list(materials), dashpot=of.dashpot)
    solids = hl.sweep(wide, of.until, jobs, struck.measure, material=list(materials), body=BODIES)
    data = data.assign(named(rods, "material").data_vars).assign(named(solids, "solid").data_vars)
    data["material_modulus"] = ("material", [m.youngs_modulus for m in materials.values()], {"units": "Pa"})
    with_units(data, youngs_modulus="Pa", dashpot="N s/m")
    return of.marked(data.merge(walls(of), combine_attrs="override"))


def walls(of: Conditions) -> xr.Dataset:
    """Return the motion of beads on the stiffest and the softest rod, the force at the sensors, and the energies."""
    shown = of.walls()

    def against(wall: str) -> xr.Dataset:
        run = hl.CoSimulation(of.chain(), of.slender(of.layers(shown[wall]))).run(of.until)
        behind = hl.reflections(struck.high_pass(run, TIME_CONSTANT), SENSOR).primary
        stiffness = of.wall(shown[wall])
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
        )
        if not of.own:
            data = data.assign(durations=candidates.durations(run), displacements=candidates.displacements(run))
        force = waves.sensor_forces(run, struck.SENSORS)
        return data.assign(displacement=run.displacement, sensor_force=force, last_force=last).reset_coords(drop=True)

    data = named(over(against, wall=list(shown)), "wall")
    return data if of.own else data.merge(candidates.on_ptfe(of.layers))


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
    """Return the numbers of section 6.1.1 and Table 2.1, compared with ours; of other rods, with theory."""
    of = Conditions.read(data)
    if of.own:
        return [row for name, m in of.materials().items() if name in data.material for row in _own(data, of, name, m)]
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


def _own(data: xr.Dataset, of: Conditions, name: str, material: hl.Material) -> list[Row]:
    """Return AR and TOF of another rod, the last bead's motion, and the modulus below which secondary waves form."""
    rods = data.sel(material=name)
    at, cylinder, space = rods.sel(dashpot=of.middle), *(rods.sel(body=body) for body in BODIES)
    wide = [struck.ratio(case.solid_amplitude_ratio) for case in (cylinder, space)]
    later = [struck.flight(case.solid_time_of_flight) for case in (cylinder, space)]
    spread = [
        struck.band(rods[f"material_{variable}"].sel(wave="primary"), factor)
        for variable, factor in (("amplitude_ratio", 1.0), ("time_of_flight", 1e6))
    ]
    ratio, flight = struck.ratio(at.material_amplitude_ratio), struck.flight(at.material_time_of_flight)
    expected, hertz = float(of.time_of_flight(of.wall(material))) * 1e6, of.contact_time(material) * 1e6
    moved, contact = float(at.material_largest_displacement) * 1e6, float(at.material_contact_time) * 1e6
    second, limit = struck.ratio(at.material_amplitude_ratio, "secondary"), _critical_modulus(of)
    return [
        row("own AR", ratio or "no wave", *wide, spread[0], rod=name),
        row("own TOF", struck.known(flight), *later, spread[1], theory=expected, rod=name),
        row("own secondary AR", second, limit * 1e-9, rod=name),
        row("own displacement", moved, contact, hertz, rod=name),
    ]


def _critical_modulus(of: struck.Striking) -> float:
    return hl.theory.critical_modulus(of.bead_material)


def _both(
    data: xr.Dataset, label: str, name: str, factor: float = 1.0, tried: str = "", first: Sequence[float] = (),
    theory: Sequence[float | str] = ("", ""), displaced: Sequence[float] = (),
) -> Iterable[Row]:  # fmt: skip
    """Return the rows of steel and of PTFE. tried: what the candidates do on PTFE; the others: a value for each."""
    for i, (short, material) in enumerate(zip(("steel", "PTFE"), WALLS, strict=True)):
        values = data[f"material_{name}"].sel(material=material)
        values = values.sel(wave="primary") if "wave" in values.dims else values
        ours = float(values.sel(dashpot=DASHPOT).fillna(0.0)) * factor
        others = struck.over_dashpots(values, factor) | ({DISPLACED: displaced[i]} if displaced else {})
        said = *first[i : i + 1], struck.sensitivity(values, factor)
        of_wall = row(f"{label} {short}", ours, *said, theory=theory[i], otherwise=others)
        more = tried if short == "PTFE" else ""
        yield of_wall._replace(reason=". ".join(filter(None, (of_wall.reason, more))))


def _waves(data: xr.Dataset) -> list[Row]:
    steel, ptfe = (data.sel(material=name, dashpot=DASHPOT) for name in WALLS)
    flights = [struck.flight(of.material_time_of_flight) for of in (steel, ptfe)]
    theory = [float(THESIS.time_of_flight(THESIS.wall(m))) * 1e6 for m in WALLS.values()]
    tried, ratios = (data[f"tried_{name}"].sel(wave="primary") for name in ("time_of_flight", "amplitude_ratio"))
    stiffer = candidates.of_stiffer_contact(1e6 * float(data.tried_on_steel))
    said = f"{candidates.listed(tried, 1e6, ratio=ratios)}. {stiffer}"
    slower = [100.0 * (1.0 - float(data.wall_speed_ratio.sel(wall=name))) for name in WALLS]
    return [
        row("definition of AR", "F_ref/F_in", holds=True),
        row("definition of TOF", "peak to peak", holds=True),
        row("incident wave at sensor 7", float(steel.material_incident_arrival) * 1e6),
        *_both(data, "AR,", "amplitude_ratio"),
        *_both(data, "TOF,", "time_of_flight", 1e6, said, theory),
        row("TOF, PTFE over steel", f"{100.0 * (flights[1] / flights[0] - 1.0):.1f} %"),
        row("SSW after PSW, PTFE", struck.delay(ptfe.material_time_of_flight)),
        row("reflected wave slower than incident, steel", f"{slower[0]:.1f} %", slower[1]),
    ]


def _contacts(data: xr.Dataset) -> Iterable[Row]:
    """Return the rows of the last bead's contact, with its duration where it is read from the bead's displacement."""
    tried = f"{candidates.spoken(data.wall_durations)}. {candidates.listed(data.tried_contact_time, 1e6)}"
    durations = 1e6 * data.wall_durations.sel(reading=candidates.DISPLACED)
    return _both(data, "contact with", "contact_time", 1e6, tried, displaced=durations.values.tolist())


def _displaced(data: xr.Dataset) -> Iterable[Row]:
    """Return the rows of the last bead's displacement, with equation 6.6 and what the candidates do on PTFE."""
    said = candidates.spoken(data.wall_displacements, ".1f")
    tried = f"{said}. {candidates.listed(data.tried_largest_displacement, 1e6, '.1f')}"
    energy = 0.5 * THESIS.sphere.mass * (PARTICLE_TO_STRIKER_SPEED * THESIS.speed) ** 2
    deepest = [1e6 * (2.5 * energy / THESIS.wall(wall)) ** 0.4 for wall in WALLS.values()]
    return _both(data, "largest displacement of bead 20,", "largest_displacement", 1e6, tried, theory=deepest)


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
    critical, steel = _critical_modulus(THESIS), hl.STEEL_440C.youngs_modulus
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
    of, real_modulus = Conditions.read(data), data.material_modulus * 1e-9
    for axis, name, factor, what in (
        (axes[0], "time_of_flight", 1e6, "time of flight (µs)"),
        (axes[1], "amplitude_ratio", 1.0, "amplitude ratio AR"),
    ):
        rods = data[f"material_{name}"].sel(dashpot=of.middle)
        cylinders = data[f"solid_{name}"].sel(body="cylinder")
        for colour, wave in zip(draw.COLOURS, WAVES, strict=False):
            axis.plot(modulus * 1e-9, factor * data[name].sel(wave=wave), "-", color=colour, label=f"{wave} wave")
            axis.plot(real_modulus, factor * rods.sel(wave=wave), "o", color=colour)
            axis.plot(real_modulus, factor * cylinders.sel(wave=wave), "x", color=colour)
        axis.set(xscale="log", xlabel=label, ylabel=what)
        axis.xaxis.set_major_formatter("{x:g}")
    walls = [of.wall(replace(hl.STEEL_440C, youngs_modulus=value, name="")) for value in modulus]
    draw.theory_line(axes[0], modulus * 1e-9, of.time_of_flight(np.array(walls)) * 1e6, "theory of contact times")
    axes[1].plot([], [], "o", color="grey", label=f"rods of {'the given' if of.own else 'real'} materials")
    axes[1].plot([], [], "x", color="grey", label="axisymmetric cylinders")
    draw.marked(axes[1], _critical_modulus(of) * 1e-9, "theory: secondary\nwaves left of this", left=True)
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
