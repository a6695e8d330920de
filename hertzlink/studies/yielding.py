"""Beads that yield (thesis, chapter 7): which impacts of the thesis are beyond it, and what that changes."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import dissipation, draw, on_plates, rod_stiffness
from hertzlink.studies import struck_cylinders as struck
from hertzlink.studies.results import named, over, scalars, with_units
from hertzlink.studies.table import Row, Rows
from structures.caution import collected

row = Rows("yielding")
LAWS: dict[str, hl.laws.YieldingLaw | None] = {
    "elastic": None, "Thornton": hl.laws.Thornton(), "Jackson–Green": hl.laws.JacksonGreen(),
}  # fmt: skip
SENSOR, RADIUS, BEADS = struck.SENSOR, 4.76e-3, 20
SAVED = 1e-6  # s.
SPEEDS = tuple(np.geomspace(0.01, 1.0, 17))
# Beads and half-spaces of the sweep over impact speeds: hard and soft beads, and soft walls under hard beads.
PAIRS = {
    "steel 440C": (hl.STEEL_440C, hl.STEEL_440C),
    "steel 316": (hl.STEEL_316, hl.STEEL_316),
    "aluminium 6061": (hl.STEEL_440C, hl.ALUMINIUM_6061),
    "brass 360": (hl.STEEL_440C, hl.BRASS_360),
}
LONG, LONGEST = 3e-3, 4e-3  # s, records of the sweep: at the lowest speeds waves need 2 ms to come back; and of all.


class Impact(NamedTuple):
    """A chain of the thesis, as it is elastic; on a structure, or on nothing; the length of its record, s."""

    section: str
    chain: hl.Chain
    structure: hl.Structure | None
    until: float


def spheres(radius: float, material: hl.Material, beads: int, speed: float) -> hl.Chain:
    """Return a chain of equal beads."""
    bead = hl.Sphere(radius, material)
    return hl.Chain([bead] * beads, bead, speed)


def impacts() -> list[Impact]:
    """Return the impacts of the thesis by section: spheres, rods with gravity and dashpot, plates away from edges."""
    steel, thin, thick = hl.STEEL_316, spheres(2.38e-3, hl.STEEL_316, 20, 0.5), hl.half_space(hl.STEEL_316)
    long = spheres(dissipation.RADIUS, steel, dissipation.BEADS, dissipation.IMPACT_SPEED)
    chain, until, metals = struck.THESIS.chain(), struck.UNTIL, (hl.STEEL_440C, hl.ALUMINIUM_6061, hl.PTFE)
    rods = {f"rod of {m.name} (6.1.1)": rod_stiffness.layers(m) for m in metals}
    rods["steel on PTFE (6.1.3)"] = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.55e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.55e-3)]
    plate = hl.infinite_plate(4.83e-3, hl.ALUMINIUM_6061)
    on_plate = ((4.76e-3, 1e-3), (9.53e-3, 2e-3), (19.05e-3, LONGEST))
    return [
        Impact("spheres of steel 316 (3.4)", thin, thick, 1e-3),
        Impact("70 spheres of steel 316 (4)", long, None, 1e-3),
        *(Impact(name, chain, hl.reduce(hl.rod(layers), until), until) for name, layers in rods.items()),
        *(
            Impact(
                f"plate 4.83 mm, beads {1e3 * diameter:.2f} mm (6.2)",
                spheres(0.5 * diameter, hl.STEEL_440C, on_plates.BEADS, on_plates.IMPACT_SPEED), plate, record,
            )
            for diameter, record in on_plate
        ),
    ]  # fmt: skip


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR, TOF and forces of the thesis's impacts by each law, and of pairs of metals over the impact speed.

    quick: every fourth speed. jobs: always one process, because runs take some 20 ms.
    """
    speeds, of_thesis = SPEEDS[::4] if quick else SPEEDS, {impact.section: impact for impact in impacts()}

    def struck_by(pair: str, impact_speed: float, law: str) -> xr.Dataset:
        beads, wall = PAIRS[pair]
        impact = Impact(pair, spheres(RADIUS, beads, BEADS, impact_speed), hl.half_space(wall), LONG)
        return _measured(impact, LAWS[law]).drop_vars("force")

    with collected():  # that elastic contacts are beyond yield is what the table says
        data = over(lambda impact, law: _measured(of_thesis[impact], LAWS[law]), impact=list(of_thesis), law=list(LAWS))
        pairs = over(struck_by, pair=list(PAIRS), impact_speed=speeds, law=list(LAWS))
    return data.merge(named(with_units(pairs, impact_speed="m/s"), "swept"))


def _measured(impact: Impact, law: hl.laws.YieldingLaw | None) -> xr.Dataset:
    """Return what is kept of a run. first_yield: speed, m/s, by Hertz's forces, which grow with its power 6/5."""
    chain = replace(impact.chain, law=law)
    simulation = hl.CoSimulation(chain, impact.structure)
    result = simulation.run(impact.until, SAVED)
    seen, peaks = hl.reflections(result, SENSOR), result.contact_force.max("time").values
    limits = [
        np.inf if pair is None or (contact := hl.laws.Thornton().contact(*pair)) is None else contact.yield_force
        for pair in simulation.chain.pairs
    ]
    times = np.arange(0.0, LONGEST + 0.5 * SAVED, SAVED)
    force = np.interp(times, result.time.values, hl.sensor_force(result, SENSOR).values, right=np.nan)
    first, back = seen.incident, seen.primary
    measures = scalars(
        amplitude_ratio=(back.amplitude_ratio if back else np.nan, "1", "amplitude ratio"),
        time_of_flight=(back.time_of_flight if back else np.nan, "s", "time of flight"),
        incident=(first.amplitude if first else np.nan, "N", "incident force"),
        first_yield=(chain.speed * float((peaks / limits).max()) ** (-5.0 / 6.0), "m/s", "speed of first yield"),
        speed=(chain.speed, "m/s", "impact speed"),
        dent=(float(result.dent.max()) if "dent" in result else 0.0, "m", "greatest dent"),
        lost=(float(result.dissipated_energy[-1] / result.impact_energy), "1", "part of the energy that is lost"),
    )
    measures["force"] = ("time", force, {"units": "N", "long_name": "force at bead 7"})
    return measures.assign_coords(time=("time", times, {"units": "s"}))


def table(data: xr.Dataset) -> list[Row]:
    """Compare the laws: the thesis names plasticity as future work (chapter 7), and prints no numbers for it."""
    rows = []
    for section in data.impact.values:
        of_impact = data.sel(impact=section)
        elastic, thornton, fitted = (of_impact.sel(law=law) for law in LAWS)
        first, speed = float(elastic.first_yield), float(elastic.speed)
        verdict = f"yields: struck {speed / first:.2g} times as fast" if speed > first else "does not yield"
        ratios = [float(law.incident / elastic.incident) for law in (thornton, fitted)]
        said = [verdict, speed, 1e6 * float(thornton.dent), 1e6 * float(fitted.dent)]
        returned = np.isfinite(float(elastic.amplitude_ratio))
        back = ", ".join(f"{ratio:.2f}" for ratio in of_impact.amplitude_ratio.values.tolist())
        flight = ", ".join(f"{1e6 * time:.0f}" for time in of_impact.time_of_flight.values.tolist())
        waves = [part.replace("nan", "none") for part in (back, flight)] if returned else []
        rows += [
            row("first yield" if returned else "first yield, no wave back", first, *said, *waves, impact=section),
            row("incident force", ratios[0], ratios[1], impact=section),
        ]
    return rows


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """Return what yielding takes over the impact speed, and the force at bead 7 under three laws."""
    styles = dict(zip(LAWS, ("-", "--", ":"), strict=True))
    speeds, (over, panels) = data.impact_speed.values, draw.panels(2, width=3.7, height=4.0, sharey=False)
    names, shown = list(PAIRS), (data.swept_incident, data.swept_amplitude_ratio)
    for axis, values, pairs in zip(panels, shown, (names[:2], names[2:]), strict=True):
        for i, pair in enumerate(pairs):
            part = values.sel(pair=pair)
            elastic = part.sel(law="elastic") if values is shown[0] else 1.0
            for law, style in styles.items():
                plain = law == "elastic"
                if not plain or i == 0:
                    colour, label = ("black", law) if plain else (draw.COLOURS[i], f"{pair}, {law}")
                    axis.plot(speeds, part.sel(law=law) / elastic, style, color=colour, label=label)
    words = {"incident force at bead 7 / elastic": "beads and wall", "AR at bead 7": "wall under beads of steel 440C"}
    for axis, (says, title) in zip(panels, words.items(), strict=True):
        draw.log_x(axis)
        for speed, place in ((on_plates.IMPACT_SPEED, "plates"), (struck.THESIS.speed, "rods")):
            axis.axvline(speed, color="grey", linewidth=0.6)
            axis.text(speed, 0.82, place, color="grey", fontsize="x-small", rotation=90, va="bottom", ha="right")
        axis.set(xlabel="impact speed (m/s)", ylabel=says, ylim=(0.0, 1.05), xlim=(speeds[0], speeds[-1]))
        above = draw.Look(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        axis.legend(title=title, title_fontsize="small", fontsize="x-small", **above)
    labels = draw.Look(width=3.7, sharey=False, xlabel="time (µs)", ylabels=["force at bead 7 (N)"])
    figure, shown_impacts = draw.each(data.isel(impact=[2, 7]), "impact", lambda s: s.rpartition(" (")[0], **labels)
    for axis, impact in shown_impacts:
        for width, (law, style) in zip((2.0, 1.6, 1.2), styles.items(), strict=True):  # curves lie on one another
            axis.plot(1e6 * data.time, impact.force.sel(law=law), style, linewidth=width, label=law)
        axis.set_xlim(0.0, 900.0)
    shown_impacts[0][0].legend()
    return {"speed": over, "waves": figure}
