"""Runs that keep sensors only: the same numbers as runs that keep everything, and what they do not hold, by name."""

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray as xr
from unchanged import SpringMass

import hertzlink as hl

BEAD = hl.Sphere(4.76e-3, hl.STEEL_440C)
LAYERS = [hl.Layer(hl.STEEL_440C, 6.35e-3, 9.525e-3), hl.Layer(hl.PTFE, 25.4e-3, 9.525e-3)]
ROD = hl.reduce(hl.rod(LAYERS), until=5e-4)
UNTIL = 5e-4


def chain(count: int = 14, **given: Any) -> hl.Chain:
    return hl.Chain([BEAD] * count, **{"striker": BEAD, "impact_speed": 0.44} | given)


RUNS: dict[str, Callable[[], hl.CoSimulation]] = {
    "a reduced rod": lambda: hl.CoSimulation(chain(), ROD),
    "screening": lambda: hl.CoSimulation(chain(), ROD, accuracy="screening"),
    "adaptive windows": lambda: hl.CoSimulation(chain(), ROD, window=hl.Adaptive(1e-6)),
    "a dashpot": lambda: hl.CoSimulation(chain(dissipation=hl.LinearDashpot(2.0)), ROD),
    "contacts that yield": lambda: hl.CoSimulation(chain(law=hl.laws.JacksonGreen()), hl.half_space(hl.STEEL_316)),
    "beads that vibrate": lambda: hl.CoSimulation(
        hl.DeformableChain([BEAD] * 8, BEAD, 0.44, modes=2), hl.half_space(hl.STEEL_316)
    ),
    "a push": lambda: hl.CoSimulation(
        hl.Chain([BEAD] * 10, hl.PushedBead([0.0, 4e-5, 8e-5], [0.0, 30.0, 0.0])), hl.half_space(hl.PTFE)
    ),
    "gravity": lambda: hl.CoSimulation(chain(gravity=9.81, preload=2.0), ROD),
    "a participant": lambda: hl.CoSimulation(chain(8), SpringMass(), hl.Aitken(), window=2e-6),
    "two chains": lambda: hl.CoSimulation([chain(), chain(9, impact_speed=0.2)], [ROD, hl.half_space(hl.PTFE)]),
    "structures at both ends": lambda: hl.CoSimulation(
        chain(8, striker=hl.PushedBead([0.0, 4e-5, 8e-5], [0.0, 30.0, 0.0]), impact_speed=None),
        hl.half_space(hl.PTFE),
        behind=ROD,
    ),
}


LONG_TO_COMPILE = (
    *("contacts that yield", "beads that vibrate", "structures at both ends", "a dashpot"),
    *("adaptive windows", "a participant", "a push"),
)


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[pytest.mark.thorough] * (one in LONG_TO_COMPILE)) for one in RUNS]
)
@pytest.mark.filterwarnings("ignore::hertzlink.HertzlinkWarning")
def test_sensors_hold_the_bits_of_a_run_that_keeps_everything(name: str) -> None:
    every, some = RUNS[name]().run(UNTIL), RUNS[name]().run(UNTIL, sensors=[7, 5])
    assert some.bead.values.tolist() == [5, 7]
    last = min(RUNS[name]().interface.chains, key=lambda one: one.mass.size).mass.size
    assert some.contact.values.tolist() == [5, 6, 7, 8, last]
    for variable in ("contact_force", "velocity", "static_force", "centre", "impact_energy", "time"):
        at = {axis: some[axis].values for axis in ("bead", "contact") if axis in every[variable].dims}
        xr.testing.assert_identical(some[variable], every[variable].sel(at))
    assert some.attrs["input"] == every.attrs["input"]
    assert some.attrs["warnings"] == every.attrs["warnings"]
    for measure in (hl.amplitude_ratio, hl.time_of_flight):
        np.testing.assert_array_equal(measure(some, 5), measure(every, 5))


@cache
def run(*sensors: int, chains: int = 1) -> xr.Dataset:
    """A run that keeps these sensors."""
    one = hl.CoSimulation(chain(), ROD) if chains == 1 else RUNS["two chains"]()
    return one.run(UNTIL, sensors=sensors)


KEPT = "run: keeps sensors only, and holds no {}; run it by CoSimulation.run without sensors, which keeps everything"


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: hl.energy_error(run(7)), KEPT.format("kinetic_energy and structure_work")),
        (lambda: hl.plots.contact_map(run(7)), "run: keeps sensors only, and not the forces of all contacts;"),
        (lambda: hl.amplitude_ratio(run(7), 3), "sensor = 3: was not kept; must be one of 7$"),
        (lambda: hl.amplitude_ratio(run(7, 9), 8), "sensor = 8: must be a bead that was kept: 7, 9$"),
        (lambda: hl.amplitude_ratio(run(5, chains=2), 7), "sensor = 7: was not kept; must be one of 5$"),
        (lambda: run(15), r"sensors = \[15\]: must be beads from 1 to 14, counted from the struck end"),
        (lambda: run(0), "sensors = 0: must be a whole number, 1 or more"),
        (lambda: run(), r"sensors = \(\): must be a list of one bead number or more"),
    ],
)  # fmt: skip
def test_what_sensors_do_not_hold_is_named(call: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        call()


def test_the_contact_of_the_last_bead_is_measured_at_it() -> None:
    every = hl.CoSimulation(chain(), ROD).run(UNTIL)
    assert hl.contact_time(run(7, 14)) == hl.contact_time(every)
