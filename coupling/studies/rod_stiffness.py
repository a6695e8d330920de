"""Thesis section 6.1.1: what the reflected waves tell of the stiffness of a clamped cylinder."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.measures import WAVES, amplitude_ratio, contact_time, reflections, sensor_force, time_of_flight
from coupling.studies.table import Row
from coupling.sweep import sweep
from particles.bead import STANDARD_GRAVITY, Sphere, drop_speed
from particles.chain import Chain
from particles.dissipation import LinearDashpot
from structures.material import MATERIALS, STEEL_440C
from structures.rod import Layer, rod

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LENGTH, RADIUS = 76.2e-3, 19.1e-3
BEAD = Sphere(4.76e-3, STEEL_440C)
BEADS, SENSOR = 20, 7
DROP_HEIGHT = 0.01
UNTIL = 1.5e-3

DASHPOT = 5.0
"""N s/m, at every contact; the thesis does not give its coefficient. The table shows 4 and 6 too."""

MODULI = tuple(np.geomspace(1.0e9, 210.0e9, 61))


def run(quick: bool = False, jobs: int | None = None) -> xr.Dataset:
    """AR, TOF and the force at the sensor over Young's modulus, and for the materials of Table 2.1.

    Over the modulus, density and Poisson's ratio stay those of 440C steel. quick: every sixth modulus.
    """
    moduli = MODULI[::6] if quick else MODULI

    def stiff(youngs_modulus: float) -> CoSimulation:
        material = replace(STEEL_440C, youngs_modulus=youngs_modulus, name="")
        return CoSimulation(chain(), rod([Layer(material, LENGTH, RADIUS)]))

    def real(material: str, dashpot: float) -> CoSimulation:
        return CoSimulation(chain(dashpot), rod([Layer(MATERIALS[material], LENGTH, RADIUS)]))

    data = sweep(stiff, UNTIL, jobs, measure, youngs_modulus=moduli)
    data = data.drop_vars(["largest_displacement", "contact_time", "incident_arrival"])
    materials = sweep(real, UNTIL, jobs, measure, material=list(MATERIALS), dashpot=(4.0, DASHPOT, 6.0))
    for name, values in materials.drop_vars("sensor_force").data_vars.items():
        data[f"material_{name}"] = values
    data["material_modulus"] = ("material", [m.youngs_modulus for m in MATERIALS.values()], {"units": "Pa"})
    data["youngs_modulus"].attrs["units"] = "Pa"
    data["dashpot"].attrs["units"] = "N s/m"
    return data


def chain(dashpot: float = DASHPOT) -> Chain:
    """The thesis's vertical chain of 20 spheres, struck from 1 cm."""
    return Chain([BEAD] * BEADS, BEAD, drop_speed(DROP_HEIGHT), STANDARD_GRAVITY, LinearDashpot(dashpot))


def measure(run: xr.Dataset) -> xr.Dataset:
    """What the study keeps of a run."""
    incident = reflections(run, SENSOR).incident
    largest = run.displacement.sel(bead=BEADS).max().reset_coords(drop=True)
    return xr.Dataset(
        {
            "amplitude_ratio": xr.concat([amplitude_ratio(run, SENSOR, wave) for wave in WAVES], "wave"),
            "time_of_flight": xr.concat([time_of_flight(run, SENSOR, wave) for wave in WAVES], "wave"),
            "largest_displacement": largest.assign_attrs(units="m", long_name="largest displacement of the last bead"),
            "contact_time": ((), contact_time(run), {"units": "s", "long_name": "last bead's contact with the rod"}),
            "incident_arrival": ((), incident.arrival if incident else np.nan, {"units": "s"}),
            "sensor_force": sensor_force(run, SENSOR),
        },
        coords={"wave": list(WAVES)},
    )


def table(data: xr.Dataset) -> list[Row]:
    """The numbers that section 6.1.1 prints, beside ours."""
    steel, ptfe = (data.sel(material=name, dashpot=DASHPOT) for name in ("steel 440C", "PTFE"))

    def ratio(of: xr.Dataset, wave: str = "primary") -> float:
        return float(of.material_amplitude_ratio.sel(wave=wave).fillna(0.0))

    def flight(of: xr.Dataset, wave: str = "primary") -> float:
        return float(of.material_time_of_flight.sel(wave=wave)) * 1e6

    def others(material: str, name: str, factor: float = 1.0) -> str:
        values = data[f"material_{name}"].sel(material=material, dashpot=[4.0, 6.0])
        low, high = (values.sel(wave="primary") if "wave" in values.dims else values).values * factor
        return f"γ is not given; {low:.3g} and {high:.3g} for γ = 4 and 6 N s/m"

    critical = STEEL_440C.youngs_modulus / (2.0 * 2.0**0.5 - 1.0)
    near = float(data.amplitude_ratio.sel(wave="secondary").fillna(0.0).interp(youngs_modulus=critical))
    softest = float(data.youngs_modulus.where(data.amplitude_ratio.sel(wave="secondary") > 0.0).max())
    moves = "material_largest_displacement"
    return [
        Row("incident wave at sensor 7", 120.0, float(steel.material_incident_arrival) * 1e6, "µs",
            "the thesis rounds, and prints ms"),
        Row("AR, steel", 0.77, ratio(steel), "", "experiment; " + others("steel 440C", "amplitude_ratio")),
        Row("AR, PTFE", 0.421, ratio(ptfe), "", "experiment; " + others("PTFE", "amplitude_ratio")),
        Row("TOF, steel", 483.0, flight(steel), "µs", "the thesis's section 6.1.2 says 440 to 450 for the same rod"),
        Row("TOF, PTFE", 616.0, flight(ptfe), "µs", others("PTFE", "time_of_flight", 1e6)),
        Row("TOF, PTFE over steel", "45 %", f"{100.0 * (flight(ptfe) / flight(steel) - 1.0):.1f} %", "",
            "the thesis's own 616 and 483 µs give 27.5 %"),
        Row("SSW behind PSW, PTFE", 100.0, flight(ptfe, "secondary") - flight(ptfe), "µs", "a round number"),
        Row("largest displacement of bead 20, steel", 4.39, float(steel[moves]) * 1e6, "µm",
            others("steel 440C", "largest_displacement", 1e6)),
        Row("largest displacement of bead 20, PTFE", 16.66, float(ptfe[moves]) * 1e6, "µm",
            others("PTFE", "largest_displacement", 1e6) + "; 27.2 undamped on a half-space"),
        Row("contact with steel", 85.0, float(steel.material_contact_time) * 1e6, "µs",
            "ours from 1 % to 1 % of the greatest force; the thesis does not say how it reads the contact"),
        Row("contact with PTFE", 241.0, float(ptfe.material_contact_time) * 1e6, "µs",
            "ours until the force first falls below 1 %, after the neighbours have pressed the bead on the rod again"),
        Row("modulus below which SSW form", 100.0, critical * 1e-9, "GPa", "equation 6.22, rounded in the text"),
        Row("SSW there, over the incident wave", 0.05, near, "",
            f"ours part from the primary wave's tail below {softest * 1e-9:.0f} GPa only"),
    ]  # fmt: skip


def figures(data: xr.Dataset) -> dict[str, "Figure"]:
    """AR and TOF over Young's modulus (figures 6.4 and 6.6), and the force-intensity map (figure 6.5)."""
    from coupling import plots

    figure, axes = plots.panels(2, width=3.6, sharey=False)
    modulus = data.youngs_modulus.values * 1e-9
    real = data.sel(dashpot=DASHPOT)
    for axis, name, factor, label in (
        (axes[0], "amplitude_ratio", 1.0, "amplitude ratio AR"),
        (axes[1], "time_of_flight", 1e6, "time of flight (µs)"),
    ):
        swept = [(f"{wave} wave", data[name].sel(wave=wave).values * factor, "-") for wave in WAVES]
        plots.curves(axis, modulus, swept, "Young's modulus of the rod (GPa)", label)
        points = [("", real[f"material_{name}"].sel(wave=wave).values * factor, "o") for wave in WAVES]
        plots.curves(axis, data.material_modulus.values * 1e-9, points, "Young's modulus of the rod (GPa)", label)
    axes[0].plot([], [], "o", color="grey", markersize=4.0, label="materials of Table 2.1")
    axes[0].set_ylim(bottom=0.0)
    axes[0].legend(frameon=False, fontsize="small")
    return {
        "stiffness": figure,
        "force_intensity": plots.intensity_map(
            data.time.values, data.youngs_modulus.values, data.sensor_force.transpose("youngs_modulus", "time").values
        ),
    }
