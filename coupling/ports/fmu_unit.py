"""The chain as an FMI 2.0 co-simulation unit: the script that `write_fmu` puts into an FMU, next to the chain.

It runs in the Python of the program that opens the FMU, where this version of hertzlink must be installed. pythonfmu
reports a refused step as fmi2Discard. It reports an exception that leaves the unit as fmi2Fatal, after which the
standard allows no further call; so the unit lets no foreseeable exception escape. What it must refuse in another
function it logs as an error, and then it refuses every step: pythonfmu cannot return fmi2Error.
"""

from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, SubElement

import hertzlink as hl  # the front door comes first: it names rooms that are not its own

# isort: split
from pythonfmu import DefaultExperiment, Fmi2Causality, Fmi2Initial, Fmi2Slave, Fmi2Variability, Real
from pythonfmu.enums import Fmi2Status

from coupling.files import plain
from coupling.ports.fmu import CONTENT_FILE, TRUSTED_FILE
from coupling.ports.fmu_content import UnitState, state_bytes, state_from, unpack
from coupling.ports.guest import advance, guest_chain, start
from coupling.schemes.scheme import SUBSTEPS_PER_CONTACT
from particles.moving import MovingChain

BASE_UNIT_EXPONENTS = {"m": {"m": "1"}, "m/s": {"m": "1", "s": "-1"}, "N": {"kg": "1", "m": "1", "s": "-2"}}
"""Exponents of the base units."""

CLOCK_TOLERANCE = 1e-3
"""The opening program sums its steps itself; its clock may differ from the unit's by this fraction of a step, or of the
chain's own."""

REST = 1e-9
"""A step shorter than this part of the chain's own is a rest of rounding in the opening program's clock."""

TOLERANCE = 1e-4
"""The relative accuracy of an amplitude ratio with the default step."""

RECORD = 4.0
"""The default stop time, in times that a wave takes through the chain: there, back, and as long in the structure."""


class HertzlinkChain(Fmi2Slave):  # type: ignore[misc]
    """Input: displacement of the surface at the end of a step. Outputs: forces relative to the static ones."""

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        folder = Path(self.resources)
        trust = (folder / TRUSTED_FILE).is_file()
        content = (folder / (TRUSTED_FILE if trust else CONTENT_FILE)).read_bytes()
        self.chain: hl.Chain
        self.chain, self.facing = unpack(content, trust)
        self.impact_speed, self.surface_displacement = self.chain.impact_speed, 0.0
        self.begin, self.initialised = 0.0, False
        self.faults: dict[str, str] = {}
        self.units: dict[str, str] = {}
        self.get_integer, self.set_integer = self._no_kind("Integer", 0)
        self.get_boolean, self.set_boolean = self._no_kind("Boolean", False)
        self.get_string, self.set_string = self._no_kind("String", "")
        self._start()
        self.description = f"hertzlink: a chain of {len(self.chain.beads)} beads and its contact with a surface"
        step, stop = self.moving.contact_time / SUBSTEPS_PER_CONTACT, RECORD * self.moving.transit_time
        self.default_experiment = DefaultExperiment(0.0, float(f"{stop:.2g}"), step, TOLERANCE)
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
        initial = {Fmi2Causality.parameter: Fmi2Initial.exact, Fmi2Causality.output: Fmi2Initial.calculated}
        kinds = {"causality": causality, "variability": variability, "initial": initial.get(causality)}
        self.register_variable(Real(name, description=text, getter=get, **kinds))

    def _sensor(self, bead: int) -> Any:
        return lambda: 0.5 * (self.state.contact_force[bead - 1] + self.state.contact_force[bead])

    def to_xml(self, *options: Any) -> Element:
        """Return the description of the model, with its units and initial unknowns, which pythonfmu omits."""
        root: Element = super().to_xml(*options)
        definitions = Element("UnitDefinitions")
        for unit, exponents in BASE_UNIT_EXPONENTS.items():
            SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", exponents)
        root.insert(1, definitions)
        for variable in root.iter("ScalarVariable"):
            variable[0].set("unit", self.units[variable.attrib["name"]])
        structure = root.find("ModelStructure")
        assert structure is not None
        unknowns = SubElement(structure, "InitialUnknowns")
        unknowns.extend(Element("Unknown", unknown.attrib) for unknown in structure.findall("Outputs/Unknown"))
        return root

    def setup_experiment(self, start_time: float, *_: float | None) -> None:
        """Take the start time of the opening program as time zero of the chain, the first contact of the striker."""
        self.begin = start_time

    def exit_initialization_mode(self) -> None:
        """Fix the parameter from now on."""
        self.initialised = True

    def set_real(self, references: list[int], values: list[float]) -> None:
        """Set the input, or, before the end of the initialisation, the parameter; refuse anything else."""
        for reference, value in zip(references, values, strict=True):
            variable = self.vars.get(reference)
            name = f"variable {reference}" if variable is None else variable.name
            if name == "surface_displacement":
                self.surface_displacement = value
            elif name == "impact_speed" and not self.initialised:
                self._set_impact_speed(value)
            elif name == "impact_speed":
                self._refuse(name, f"{name} = {value!r}: is fixed once the unit is initialised; reset it first")
            else:
                self._refuse(name, f"{name} = {value!r}: cannot be set; the input is surface_displacement")

    def get_real(self, references: list[int]) -> list[float]:
        """Return the values; NaN for a reference that the unit does not have."""
        for reference in set(references) - self.vars.keys():
            self._refuse(f"variable {reference}", f"variable {reference}: is none of this unit")
        return [float(self.vars[reference].getter()) if reference in self.vars else nan for reference in references]

    def _no_kind(self, kind: str, none: Any) -> tuple[Any, Any]:
        """Return the functions that get and set variables of a kind that the unit does not have."""

        def get(references: list[int]) -> list[Any]:
            for reference in references:
                self._refuse(f"variable {reference}", f"variable {reference}: is no fmi2{kind}")
            return [none] * len(references)

        return get, lambda references, _: (get(references), None)[1]

    def _set_impact_speed(self, value: float) -> None:
        """Start anew with it; if it is impossible, every step is refused until it is set again."""
        self.impact_speed = value
        self.faults.pop("impact_speed", None)
        try:
            self._start()
        except ValueError as error:
            self._refuse("impact_speed", str(error))

    def _refuse(self, name: str, fault: str) -> None:
        self.faults[name] = fault
        self.log(fault, Fmi2Status.error)

    def _start(self) -> None:
        self.moving = self._with(self.impact_speed)
        self.state = start(self.moving)

    def _with(self, impact_speed: float | None) -> MovingChain:
        return guest_chain(replace(self.chain, impact_speed=impact_speed), **self.facing)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance; an impossible step is logged, refused (fmi2Discard), and changes nothing."""
        try:
            for fault in self.faults.values():
                raise ValueError(fault)
            now = self.begin + self.state.chain.time
            if abs(current_time - now) > CLOCK_TOLERANCE * max(abs(step_size), self.moving.longest_step):
                raise ValueError(f"current_time = {current_time!r}: must be where the last step ended, {now!r} s")
            if 0.0 < step_size < REST * self.moving.longest_step:
                return True
            self.state = advance(self.moving, self.state, self.surface_displacement, step_size)
        except (ValueError, FloatingPointError) as error:
            self.log(str(error), Fmi2Status.error)
            return False
        return True

    def _get_fmu_state(self) -> UnitState:
        return UnitState(self.state, self.surface_displacement, self.impact_speed, self.begin, self.initialised)

    def _set_fmu_state(self, state: UnitState | str) -> None:
        """Go back to a state. If it is none of this chain, or the reason why its bytes are none, nothing changes."""
        try:
            if isinstance(state, str):
                raise ValueError(state)
            moving = self.moving if state.impact_speed == self.impact_speed else self._with(state.impact_speed)
            if not plain.fits(state.guest, self.state if moving is self.moving else start(moving)):
                raise ValueError("state: is none of this chain")
        except ValueError as error:
            self._refuse("state", str(error))
            return
        self.moving = moving
        self.state, self.surface_displacement, self.impact_speed, self.begin, self.initialised = state
        self.faults.clear()

    _fmu_state_to_bytes = staticmethod(state_bytes)

    @staticmethod
    def _fmu_state_from_bytes(data: bytes) -> UnitState | str:
        try:
            return state_from(data)
        except ValueError as error:
            return f"state: {error}"
