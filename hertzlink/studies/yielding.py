"""Beads that yield (thesis, chapter 7): which impacts of the thesis are beyond it, and what that changes."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import xarray as xr

import hertzlink as hl
from hertzlink.studies import draw, rod_stiffness, shared, upper_layer
from hertzlink.studies.compare import Number
from structures.caution import collected

LAWS: dict[str, hl.laws.YieldingLaw | None] = {
    "elastic": None, "Thornton": hl.laws.Thornton(), "Jackson–Green": hl.laws.JacksonGreen(),
}  # fmt: skip
SAVED = 1e-6  # s.
SPEEDS = tuple(np.geomspace(0.01, 1.0, 17))
# Beads and half-spaces of the sweep over impact speeds: hard and soft beads, and soft walls under hard beads.
PAIRS = {
    "steel 440C": (hl.STEEL_440C, hl.STEEL_440C),
    "steel 316": (hl.STEEL_316, hl.STEEL_316),
    "aluminium 6061": (hl.STEEL_440C, hl.ALUMINIUM_6061),
    "brass 360": (hl.STEEL_440C, hl.BRASS_360),
}
LONG = 3e-3  # s, records of the sweep: at the lowest speeds waves need 2 ms to come back.

# Impacts of the thesis: an elastic chain, on a structure or on nothing, and the length of its record, s.
Impact = tuple[hl.Chain, hl.Structure | None, float]


def spheres(radius: float, material: hl.Material, beads: int, speed: float) -> hl.Chain:
    bead = hl.Sphere(radius, material)
    return hl.Chain([bead] * beads, bead, speed)


def impacts() -> dict[str, Impact]:
    """Return spheres, rods with gravity and dashpot, and plates away from edges."""
    steel, plate = hl.STEEL_316, hl.infinite_plate(shared.THICKNESSES[-1], hl.ALUMINIUM_6061)
    found: dict[str, Impact] = {
        "spheres of steel 316 (3.4)": (spheres(2.38e-3, steel, 20, 0.5), hl.half_space(steel), 1e-3),
        "70 spheres of steel 316 (4)": (spheres(2.38e-3, steel, 70, 1.77), None, 1e-3),
    }
    for wall in (hl.STEEL_440C, hl.ALUMINIUM_6061, hl.PTFE):
        rod = shared.rod(rod_stiffness.layers(wall))
        found[f"rod of {wall.name} (6.1.1)"] = shared.chain(), rod, shared.RECORD
    layered = shared.rod(upper_layer.layers(6.35e-3, 25.4e-3))
    found["steel on PTFE (6.1.3)"] = shared.chain(), layered, shared.RECORD
    for diameter, record in zip(shared.DIAMETERS, (1e-3, 2e-3, 4e-3), strict=True):
        found[f"plate 4.83 mm, beads {1e3 * diameter:.2f} mm (6.2)"] = shared.plate_chain(diameter), plate, record
    return found


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """Return AR, TOF and forces of the thesis's impacts by each law, and of pairs of metals over the impact speed.

    quick: every fourth speed. jobs: always one process, because runs take some 20 ms.
    """
    of_thesis = impacts()

    def of_impact(impact: str, law: str) -> xr.Dataset:
        return measured(of_thesis[impact], LAWS[law])

    def struck_by(pair: str, impact_speed: float, law: str) -> xr.Dataset:
        beads, wall = PAIRS[pair]
        chain = spheres(shared.BEAD.radius, beads, shared.BEADS, impact_speed)
        return measured((chain, hl.half_space(wall), LONG), LAWS[law])

    with collected():  # that elastic contacts are beyond yield is what the table says
        data = shared.over(of_impact, impact=list(of_thesis), law=list(LAWS))
        pairs = shared.over(struck_by, pair=list(PAIRS), impact_speed=SPEEDS[::4] if quick else SPEEDS, law=list(LAWS))
    return data.merge(shared.named(shared.with_units(pairs, impact_speed="m/s"), "swept"))


def measured(impact: Impact, law: hl.laws.YieldingLaw | None) -> xr.Dataset:
    """Return what is kept of a run. first_yield: speed, m/s, by Hertz's forces, which grow with its power 6/5."""
    elastic, structure, until = impact
    chain = replace(elastic, law=law)
    simulation = hl.CoSimulation(chain, structure)
    result = simulation.run(until, SAVED)
    seen, peaks = hl.reflections(result, shared.SENSOR), result.contact_force.max("time").values
    limits = [
        np.inf if pair is None or (contact := hl.laws.Thornton().contact(*pair)) is None else contact.yield_force
        for pair in simulation.chain.pairs
    ]
    first, back = seen.incident, seen.primary
    return shared.scalars(
        amplitude_ratio=(back.amplitude_ratio if back else np.nan, "1", "amplitude ratio"),
        time_of_flight=(back.time_of_flight if back else np.nan, "s", "time of flight"),
        incident=(first.amplitude if first else np.nan, "N", "incident force"),
        first_yield=(chain.speed * float((peaks / limits).max()) ** (-5.0 / 6.0), "m/s", "speed of first yield"),
        speed=(chain.speed, "m/s", "impact speed"),
        dent=(float(result.dent.max()) if "dent" in result else 0.0, "m", "greatest dent"),
        lost=(float(result.dissipated_energy[-1] / result.impact_energy), "1", "part of the energy that is lost"),
    )


def numbers(data: xr.Dataset) -> Iterator[Number]:
    """Yield what yielding changes: the thesis names it as future work (chapter 7), and prints no numbers for it."""
    for section in data.impact.values:
        of_laws = data.sel(impact=section)
        elastic, thornton, fitted = (of_laws.sel(law=law) for law in LAWS)
        first, speed = float(elastic.first_yield), float(elastic.speed)
        weaker = [float(law.incident / elastic.incident) for law in (thornton, fitted)]
        said = f"yields: struck {speed / first:.2g} times as fast" if speed > first else "does not yield"
        said += (
            f" ({speed:.3g} m/s); {', '.join(LAWS)}: incident force over elastic 1, {weaker[0]:.2f}, {weaker[1]:.2f}"
        )
        said += f"; dents 0, {1e6 * float(thornton.dent):.2g}, {1e6 * float(fitted.dent):.2g} µm"
        if np.isfinite(elastic.amplitude_ratio):
            ratios = ", ".join(f"{ratio:.2f}" for ratio in of_laws.amplitude_ratio.values)
            flights = ", ".join(f"{1e6 * time:.0f}" for time in of_laws.time_of_flight.values)
            said += f"; AR {ratios}; TOF {flights} µs".replace("nan", "none")
        yield Number(f"first yield, {section}", first, said, "m/s")


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    styles, xlabel = dict(zip(LAWS, ("-", "--", ":"), strict=True)), "impact speed (m/s)"
    labels = "incident force at bead 7 / elastic", "AR at bead 7"
    figure, panels = draw.panels(2, width=3.7, height=4.0, ylabels=labels, xlabel=xlabel, ylim=(0.0, 1.05))
    weaker = data.swept_incident / data.swept_incident.sel(law="elastic")
    speeds, names = data.impact_speed.values, list(PAIRS)
    for axis, values, pairs, title in (
        (panels[0], weaker, names[:2], "beads and wall"),
        (panels[1], data.swept_amplitude_ratio, names[2:], "wall under beads of steel 440C"),
    ):
        draw.logarithmic(axis, "x")
        axis.plot(speeds, values.sel(pair=pairs[0], law="elastic"), "-", color="black", label="elastic")
        for colour, pair in zip(draw.COLOURS, pairs, strict=False):
            for law in [*LAWS][1:]:
                shown = values.sel(pair=pair, law=law)
                axis.plot(speeds, shown, styles[law], color=colour, label=f"{pair}, {law}")
        for speed, place in ((shared.PLATE_SPEED, "plates"), (shared.SPEED, "rods")):
            axis.axvline(speed, color="grey", linewidth=0.6)
            axis.text(speed, 0.82, place, color="grey", fontsize="x-small", rotation=90, va="bottom", ha="right")
        axis.set_xlim(speeds[0], speeds[-1])
        look = draw.Look(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
        axis.legend(title=title, title_fontsize="small", fontsize="x-small", **look)
    return {"speed": figure}
