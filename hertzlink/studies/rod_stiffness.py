"""Thesis section 6.1.1: dependence of the reflected waves on the stiffness of a clamped cylinder."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr
from scipy.signal import lfilter

import hertzlink as hl
from hertzlink.studies import draw, shared
from hertzlink.studies.compare import Case, Number
from hertzlink.studies.shared import BEAD, BEADS, DASHPOT, RECORD, SENSOR
from particles.solitary import PARTICLE_TO_STRIKER_SPEED

STEEL, LENGTH, RADIUS = hl.STEEL_440C, 76.2e-3, 19.1e-3
MODULI = np.geomspace(1.0e9, 210.0e9, 61)
CRITICAL = STEEL.youngs_modulus / (2.0 * 2.0**0.5 - 1.0)
"""Pa, of a wall whose contact with a bead is as stiff as that of two beads (equations 6.21 and 6.22)."""
WALLS = {"steel": STEEL, "PTFE": hl.PTFE}  # The two extremes of figures 6.2 and 6.3.
TIME_CONSTANT = 1e-3  # s, RC of the piezoelectric discs (section 2.2).
DISPLACED = "the bead displaced by more than 1 % of its greatest displacement"
FAR_SENSOR = 12  # Incident and reflected wave are timed between this sensor and sensor 7, both away from the ends.


def layers(material: hl.Material) -> list[hl.Layer]:
    return [hl.Layer(material, LENGTH, RADIUS)]


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR and TOF over Young's modulus, and for the materials of Table 2.1.

    Over the modulus, density and Poisson's ratio stay those of 440C steel. material_…: rods; solid_…: axisymmetric
    cylinders; wall_…: the two rods whose chains are shown bead by bead. quick: every sixth modulus, steel 440C and PTFE
    only.
    """
    materials = {m.name: m for m in (WALLS if quick else hl.MATERIALS).values()}
    moduli = MODULI[::6] if quick else MODULI
    steels = {modulus: replace(STEEL, youngs_modulus=modulus, name="") for modulus in moduli}

    data = hl.sweep(
        lambda youngs_modulus: hl.CoSimulation(shared.chain(), shared.rod(layers(steels[youngs_modulus]))),
        RECORD, jobs, shared.measure, youngs_modulus=moduli,
    )  # fmt: skip

    def with_contact(run: xr.Dataset) -> xr.Dataset:
        incident, moved = hl.reflections(run, SENSOR).incident, run.displacement.sel(bead=BEADS).max()
        last = shared.scalars(
            largest_displacement=(moved, "m", "largest displacement of the last bead"),
            contact_time=(hl.contact_time(run), "s", "last bead's contact with the rod"),
            incident_arrival=(incident.arrival if incident else np.nan, "s", "arrival of the incident wave"),
        )
        return shared.measure(run).merge(last)

    real_rods = hl.sweep(
        lambda material, dashpot: hl.CoSimulation(shared.chain(dashpot), shared.rod(layers(materials[material]))),
        RECORD, jobs, with_contact, material=list(materials), dashpot=shared.DASHPOTS,
    )  # fmt: skip
    solids = hl.sweep(
        lambda material: hl.CoSimulation(shared.chain(), shared.cylinder(layers(materials[material]))),
        RECORD, jobs, shared.measure, material=list(materials),
    )  # fmt: skip
    data = data.assign(shared.named(real_rods, "material").data_vars).assign(shared.named(solids, "solid").data_vars)
    data["material_modulus"] = ("material", [m.youngs_modulus for m in materials.values()], {"units": "Pa"})
    walls = shared.named(shared.along("wall", WALLS, against), "wall")
    return shared.with_units(data.merge(walls, combine_attrs="override"), youngs_modulus="Pa", dashpot="N s/m")


def against(wall: str) -> xr.Dataset:
    """Return the motion of beads on the stiffest or the softest rod, and measures of the last bead and the sensor."""
    run = hl.CoSimulation(shared.chain(), shared.rod(layers(WALLS[wall]))).run(RECORD)
    moved, time = run.displacement.sel(bead=BEADS), run.time.values

    # The energy of the last contact, as a part of the energy left in the chain and the rod.
    stiffness = shared.wall_stiffness(BEAD, WALLS[wall])
    resting = (float(run.static_force.max()) / stiffness) ** (2.0 / 3.0)
    stored = 0.4 * stiffness * (moved - run.surface_displacement + resting).clip(min=0.0) ** 2.5
    share = stored / (run.kinetic_energy + run.contact_energy + run.structure_energy)

    # The signal of sensor 7 whose disc loses its charge: y′ + y/RC = x′, exact for a force that is straight in a step.
    decay = np.exp(-time[1] / TIME_CONSTANT)
    gain = (1.0 - decay) * TIME_CONSTANT / time[1]
    filtered = lfilter([gain, -gain], [1.0, -decay], hl.sensor_force(run, SENSOR).values)
    signal = hl.as_signal(time, {SENSOR: filtered})

    # The speed of the reflected wave over that of the incident one between two sensors away from both ends.
    passing = (FAR_SENSOR - SENSOR) * BEAD.size / hl.wave_speed(run, SENSOR, FAR_SENSOR)
    returning = hl.time_of_flight(run, SENSOR) - hl.time_of_flight(run, FAR_SENSOR) - passing

    # How long the last bead stays displaced by more than 1 % of its greatest displacement.
    deepest, low = int(moved.values.argmax()), moved.values <= 0.01 * float(moved.max())
    after = np.flatnonzero(low[deepest:])
    displaced = time[deepest + after[0]] - time[np.flatnonzero(low[:deepest])[-1]]

    last = run.contact_force.sel(contact=BEADS, drop=True)
    return shared.scalars(
        energy_share=(float(share[stored.argmax("time")]), "1", "energy of the last contact / energy left"),
        speed_ratio=(passing / returning, "1", "speed of the primary wave / that of the incident one"),
        filtered_ratio=(hl.amplitude_ratio(signal, SENSOR), "1", "AR behind the sensor's high-pass"),
        displaced=(displaced, "s", DISPLACED),
    ).assign(
        displacement=run.displacement, last_force=last.assign_attrs(long_name="force between the last two beads")
    ).reset_coords(drop=True)  # fmt: skip


def collisions(data: xr.Dataset) -> tuple[float, ...]:
    """Return when, s, bead 20 is deepest in the softest rod, and when it then hits bead 19, at most twice."""
    soft = data.isel(wall=-1)
    force, deepest = soft.wall_last_force.values, int(soft.wall_displacement.sel(bead=BEADS).values.argmax())
    hits = np.flatnonzero((force[deepest + 1 :] > 0.0) & (force[deepest:-1] <= 0.0))[:2] + deepest + 1
    return tuple(float(data.time[i]) for i in (deepest, *hits))


def numbers(data: xr.Dataset) -> Iterator[Number]:
    yield Number("definition of AR", True)
    yield Number("definition of TOF", True)
    middle = {wall: data.sel(material=material.name, dashpot=DASHPOT) for wall, material in WALLS.items()}
    yield Number("incident wave at sensor 7", 1e6 * float(middle["steel"].material_incident_arrival))

    for wall, material in WALLS.items():
        primary, at = data.sel(material=material.name, wave="primary"), data.sel(wall=wall)
        readings: dict[str, Case] = {
            "behind the sensor's RC": float(at.wall_filtered_ratio),
            "axisymmetric": float(primary.solid_amplitude_ratio),
        }
        yield Number(f"AR, {wall}", shared.over_dashpots(primary.material_amplitude_ratio) | readings)
        stiffness = shared.wall_stiffness(BEAD, material)
        theory, wide = 1e6 * float(shared.time_of_flight(stiffness)), 1e6 * float(primary.solid_time_of_flight)
        flight = shared.over_dashpots(primary.material_time_of_flight, 1e6)
        yield Number(f"TOF, {wall}", flight, f"equation 6.20: {theory:.4g}; axisymmetric: {wide:.4g}")

        # The last bead: equation 6.6, and its contact, also as it is read from the bead's displacement.
        energy = 0.5 * BEAD.mass * (PARTICLE_TO_STRIKER_SPEED * shared.SPEED) ** 2
        deepest = 1e6 * (2.5 * energy / stiffness) ** 0.4
        largest = shared.over_dashpots(primary.material_largest_displacement, 1e6)
        yield Number(f"largest displacement of bead 20, {wall}", largest, f"equation 6.6: {deepest:.4g}")
        displaced: dict[str, Case] = {DISPLACED: 1e6 * float(at.wall_displaced)}
        yield Number(f"contact with {wall}", shared.over_dashpots(primary.material_contact_time, 1e6) | displaced)
        yield Number(f"energy that becomes potential, {wall}", float(at.wall_energy_share))

    steel, ptfe = (1e6 * middle[wall].material_time_of_flight for wall in WALLS)
    yield Number("TOF, PTFE over steel", 100.0 * float(ptfe.sel(wave="primary") / steel.sel(wave="primary") - 1.0))
    yield Number("SSW after PSW, PTFE", float(ptfe.sel(wave="secondary") - ptfe.sel(wave="primary")))
    hard, soft = (100.0 * (1.0 - data.wall_speed_ratio.values)).tolist()
    yield Number("reflected wave slower than incident, steel", hard, f"PTFE: {soft:.1f} %")
    deepest, first, second = (1e6 * time for time in collisions(data))
    yield Number("bead 20 deepest in PTFE", deepest)
    yield Number("first collision of beads 20 and 19, PTFE", first)
    yield Number("second collision, PTFE", second, f"{second - first:.0f} µs after the first")

    yield Number("E below which SSW form, over the bead's", CRITICAL / STEEL.youngs_modulus)
    yield Number("modulus below which SSW form", CRITICAL * 1e-9)
    secondary = data.amplitude_ratio.sel(wave="secondary").fillna(0.0)
    gap = 1e-9 * float(data.youngs_modulus.where(secondary == 0.0).min())
    said = f"below {gap:.0f} GPa the SSW separates from the tail of the primary wave"
    yield Number("SSW there, over the incident wave", float(secondary.interp(youngs_modulus=CRITICAL)), said)
    yield Number("steel stiffer than PTFE", STEEL.youngs_modulus / hl.PTFE.youngs_modulus, "times")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return TOF and AR over the modulus (figures 6.4, 6.6), and the displacements of striker and beads (6.3)."""
    label, labels = "Young's modulus of the cylinder (GPa)", ("time of flight (µs)", "amplitude ratio AR")
    stiffness, axes = draw.panels(2, width=3.9, height=3.4, xlabel=label, ylabels=labels)
    modulus, real_modulus = data.youngs_modulus * 1e-9, data.material_modulus * 1e-9
    for axis, name, factor in zip(axes, (shared.FLIGHT, shared.RATIO), (1e6, 1.0), strict=True):
        for colour, wave in zip(draw.COLOURS, shared.WAVES, strict=False):
            at = data.sel(wave=wave)
            axis.plot(modulus, factor * at[name], "-", color=colour, label=f"{wave} wave")
            axis.plot(real_modulus, factor * at[f"material_{name}"].sel(dashpot=DASHPOT), "o", color=colour)
            axis.plot(real_modulus, factor * at[f"solid_{name}"], "x", color=colour)
        axis.set_xscale("log")
        axis.xaxis.set_major_formatter("{x:g}")
    steels = [replace(STEEL, youngs_modulus=value, name="") for value in data.youngs_modulus.values]
    walls = np.array([shared.wall_stiffness(BEAD, steel) for steel in steels])
    draw.theory_line(axes[0], modulus, shared.time_of_flight(walls) * 1e6, "theory of contact times")
    axes[1].plot([], [], "o", color="grey", label="rods of real materials")
    axes[1].plot([], [], "x", color="grey", label="axisymmetric cylinders")
    axes[1].axvline(1e-9 * CRITICAL, color="grey", linestyle=":", label="theory: secondary\nwaves left of this")
    axes[1].set_ylim(0.0, 1.25)
    axes[0].legend()
    axes[1].legend(frameon=True, framealpha=1.0, edgecolor="none", loc="upper left")

    # Bead 7 is thick, and the last one red, with its collisions.
    displacements, panels = draw.each(data, "wall", "against {}".format, width=3.9, height=3.4, xlabel="time (µs)")
    time = 1e6 * data.time
    for axis, wall in panels:
        places = 1e6 * wall.wall_displacement.transpose("time", "bead")
        axis.plot(time, places, "-", color="grey", linewidth=0.5)
        for bead, colour in ((SENSOR, draw.COLOURS[0]), (BEADS, draw.COLOURS[1])):
            axis.plot(time, places.sel(bead=bead), "-", color=colour, linewidth=1.8, label=f"bead {bead}")
        axis.set_xlim(0.0, 1000.0)
    last = places.sel(bead=BEADS)
    for hit, marker, which in zip(collisions(data)[1:], "os", ("first", "second"), strict=False):
        place = float(last.sel(time=hit))
        axis.plot(1e6 * hit, place, marker, color="black", mfc="none", ms=6.0, label=f"{which} collision")
    top = float(data.wall_displacement.max()) * 1e6
    panels[0][0].set(ylabel="displacement (µm)", ylim=(-0.4 * top, 1.1 * top))
    axis.legend()
    return {"stiffness": stiffness, "displacements": displacements}
