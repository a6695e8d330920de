"""A wave that decays in a chain of a user's own beads, with the thesis's law of the losses and others."""

from dataclasses import dataclass

import xarray as xr

from coupling.cosimulation import CoSimulation
from coupling.sweeps.sweep import sweep
from hertzlink.studies import draw
from hertzlink.studies.conditions import Conditions as Parameters
from hertzlink.studies.conditions import number, substance
from hertzlink.studies.table import Row
from particles.bead import Sphere
from particles.chain import Chain
from particles.dissipation import Dissipation, PowerDashpot
from particles.moving import STEPS_PER_CONTACT, MovingChain
from particles.solitary import PARTICLE_TO_STRIKER_SPEED, peak_force_from_particle_speed, wave_speed_from_particle_speed
from structures.material import STEEL_316, Material
from structures.surface import hertz_stiffness

LAWS = {"undamped": "undamped", "thesis": "thesis's law, equation 4.1", "pairwise": "the same α and γ, pairwise"}

FIRST, FROM_END = 9, 7
"""The sensors whose forces are compared: from the struck end, and from the free one."""

SLACK = 1.4
"""A damped wave is delayed by less than this factor."""


@dataclass(frozen=True)
class Conditions(Parameters):
    """What can be changed; the defaults are the thesis's chain of steel."""

    material: Material = substance(STEEL_316, "Material of the beads and the striker")
    bead: float = number(4.76e-3, "m", "Diameter of the beads and the striker", low=1e-4, high=0.5)
    beads: int = number(70, "", "Number of beads", low=20.0, high=500.0, whole=True)
    impact_speed: float = number(1.77, "m/s", "Speed of the striker", low=1e-3, high=20.0)
    exponent: float = number(1.81, "", "Exponent α of the losses", low=0.5, high=5.0)
    coefficient: float = number(5.58, "N (s/m)^α", "Coefficient |γ| of the losses", low=1e-12, high=1e9)

    @property
    def sphere(self) -> Sphere:
        """A bead."""
        return Sphere(self.bead / 2.0, self.material)

    def law(self, name: str) -> Dissipation | None:
        """A law of LAWS."""
        return None if name == "undamped" else PowerDashpot(self.coefficient, self.exponent, name)

    def wave(self) -> tuple[float, float]:
        """Speed, m/s, and peak contact force, N, of the wave without losses, for long waves."""
        bead, moved = self.sphere, PARTICLE_TO_STRIKER_SPEED * self.impact_speed
        stiffness = hertz_stiffness(bead.surface, bead.surface)
        speed = wave_speed_from_particle_speed(bead.size, bead.mass, stiffness, moved)
        return float(speed), float(peak_force_from_particle_speed(bead.mass, stiffness, moved))


def run(of: Conditions, step: float, jobs: int | None) -> xr.Dataset:
    """Peak forces and arrivals at every bead for each law. step: in units of the default one."""
    from hertzlink.studies.dissipation import peaks

    def build(law: str) -> CoSimulation:
        chain = Chain([of.sphere] * of.beads, of.sphere, of.impact_speed, dissipation=of.law(law))
        return CoSimulation(chain, None, dt=step * MovingChain(chain, None).contact_time / STEPS_PER_CONTACT)

    until = SLACK * of.beads * of.bead / of.wave()[0]
    return of.marked(sweep(build, until, jobs, peaks, law=list(LAWS)))


def rows(data: xr.Dataset, of: Conditions) -> list[Row]:
    """What is left of the wave, and the undamped one compared with theory."""
    last = of.beads - FROM_END
    speed, force = of.wave()
    undamped = data.sel(law="undamped")
    passed = float(undamped.arrival.sel(sensor=last) - undamped.arrival.sel(sensor=FIRST))
    found = [
        Row("speed of the undamped wave", "", (last - FIRST) * of.bead / passed, "m/s", "theory: long waves", speed),
        Row(f"F({FIRST}), undamped", "", float(undamped.peak.sel(sensor=FIRST)), "N",
            f"at a bead's centre; contacts between long waves' beads carry {force:.4g} N"),
    ]  # fmt: skip
    for law, label in LAWS.items():
        peak = data.peak.sel(law=law)
        first, left = float(peak.sel(sensor=FIRST)), float(peak.sel(sensor=last))
        expected: float | str = 1.0 if law == "undamped" else ""
        reason = f"{first:.4g} and {left:.4g} N" + ("; theory: a solitary wave keeps its form" if expected else "")
        found.append(Row(f"F({last})/F({FIRST}), {label}", "", left / first, "", reason, expected))
    return found


def figures(data: xr.Dataset) -> dict[str, draw.Figure]:
    """The decay over the beads."""
    figure, (axis,) = draw.panels(1, width=4.6, height=3.6)
    for i, (law, label) in enumerate(LAWS.items()):
        axis.plot(data.sensor, data.peak.sel(law=law), color=draw.COLOURS[i], linewidth=1.2, label=label)
    axis.set(xlabel="bead number n", ylabel="maximum force (N)")
    axis.set_xlim(left=0.0)
    axis.set_ylim(bottom=0.0)
    axis.legend(frameon=False, fontsize="small")
    return {"decay": figure}
