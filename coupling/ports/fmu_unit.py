"""The chain as an FMI 2.0 co-simulation unit: the script that `write_fmu` puts into an FMU, next to the chain.

It runs in the Python of the program that opens the FMU, where this version of hertzlink must be installed. pythonfmu
reports a refused step as fmi2Discard. It reports an exception that leaves the unit as fmi2Fatal, after which the
standard allows no further call; so the unit lets no foreseeable exception escape.
"""

from dataclasses import replace
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import hertzlink as hl  # the front door comes first: it names rooms that are not its own

# isort: split
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

from coupling.files import plain
from coupling.ports.fmu import CONTENT_FILE, TRUSTED_FILE
from coupling.ports.fmu_content import state_bytes, state_from, unpack
from coupling.ports.guest import GuestState, advance, guest_chain, start
from coupling.schemes.scheme import SUBSTEPS_PER_CONTACT

BASE_UNIT_EXPONENTS = {"m": {"m": "1"}, "m/s": {"m": "1", "s": "-1"}, "N": {"kg": "1", "m": "1", "s": "-2"}}
"""Exponents of the base units."""

CLOCK_TOLERANCE = 1e-3
"""The opening program sums its steps itself; its clock may differ from the unit's by this fraction of a step."""


class HertzlinkChain(Fmi2Slave):  # type: ignore[misc]
    """Input: displacement of the surface at the end of a step. Outputs: forces relative to the static ones."""

    def __init__(self, **given: Any) -> None:
        super().__init__(**given)
        folder = Path(self.resources)
        trust = (folder / TRUSTED_FILE).is_file()
        content = (folder / (TRUSTED_FILE if trust else CONTENT_FILE)).read_bytes()
        self.chain: hl.Chain
        self.chain, self.facing = unpack(content, trust)
        self.impact_speed, self.surface_displacement = self.chain.impact_speed, 0.0
        self.begin, self.fault = 0.0, ""
        self.units: dict[str, str] = {}
        self._start()
        self.description = f"hertzlink: a chain of {len(self.chain.beads)} beads and its contact with a surface"
        self.default_experiment = DefaultExperiment(0.0, step_size=self.moving.contact_time / SUBSTEPS_PER_CONTACT)
        self._register_all()

    def _register_all(self) -> None:
        free, where = Fmi2Variability.continuous, "surface_displacement"
        text = "at the end of the step, from static equilibrium, positive away from the chain; linear over the step"
        self._register(where, "m", text, Fmi2Causality.input, free)
        if self.impact_speed is not None:
            text = "of the striker at time zero"
            self._register("impact_speed", "m/s", text, Fmi2Causality.parameter, Fmi2Variability.fixed)
        beads = range(1, len(self.chain.beads) + 1)
        forces = {
            "mean_contact_force": ("mean over the step on the surface", lambda: self.state.mean_force),
            "contact_force": ("on the surface at the end of the step", lambda: self.state.contact_force[-1]),
            **{f"sensor_force[{bead}]": (f"at the centre of bead {bead}", self._sensor(bead)) for bead in beads},
        }
        for name, (text, get) in forces.items():
            self._register(name, "N", f"{text}, above the static one", Fmi2Causality.output, free, get)

    def _register(self, name: str, unit: str, text: str, causality: Any, variability: Any, get: Any = None) -> None:
        self.units[name] = unit
        # The standard foresees no initial for an input; an exact one needs no list of initial unknowns.
        initial = None if causality == Fmi2Causality.input else Fmi2Initial.exact
        kinds = {"causality": causality, "variability": variability, "initial": initial}
        self.register_variable(Real(name, description=text, getter=get, **kinds))

    def _sensor(self, bead: int) -> Any:
        return lambda: 0.5 * (self.state.contact_force[bead - 1] + self.state.contact_force[bead])

    def to_xml(self, *options: Any) -> Element:
        """The description of the model with its units, which pythonfmu omits."""
        root: Element = super().to_xml(*options)
        definitions = Element("UnitDefinitions")
        for unit, exponents in BASE_UNIT_EXPONENTS.items():
            SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", exponents)
        root.insert(1, definitions)
        for variable in root.iter("ScalarVariable"):
            variable[0].set("unit", self.units[variable.attrib["name"]])
        return root

    def setup_experiment(self, start_time: float, *_: float | None) -> None:
        """Time zero of the chain, the first contact of the striker, is the start time of the opening program."""
        self.begin = start_time

    def exit_initialization_mode(self) -> None:
        """Start with the current parameters; if they are impossible, every step is refused."""
        self.fault = ""
        try:
            self._start()
        except ValueError as error:
            self.fault = str(error)
            self.log(self.fault, Fmi2Status.error)

    def _start(self) -> None:
        self.moving = guest_chain(replace(self.chain, impact_speed=self.impact_speed), **self.facing)
        self.state = start(self.moving)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance; an impossible step is logged, refused (fmi2Discard), and changes nothing."""
        try:
            if self.fault:
                raise ValueError(self.fault)
            if abs(current_time - self.begin - self.state.chain.time) > CLOCK_TOLERANCE * abs(step_size):
                now = self.begin + self.state.chain.time
                raise ValueError(f"current_time = {current_time!r}: must be where the last step ended, {now!r} s")
            self.state = advance(self.moving, self.state, self.surface_displacement, step_size)
        except (ValueError, FloatingPointError) as error:
            self.log(str(error), Fmi2Status.error)
            return False
        return True

    def _get_fmu_state(self) -> tuple[GuestState, float]:
        return self.state, self.surface_displacement

    def _set_fmu_state(self, state: tuple[GuestState, float]) -> None:
        if not plain.fits(state[0], self.state):
            raise ValueError("state: is none of this chain")
        self.state, self.surface_displacement = state

    _fmu_state_to_bytes = staticmethod(state_bytes)
    _fmu_state_from_bytes = staticmethod(state_from)
