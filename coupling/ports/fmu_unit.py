"""The chain as a co-simulation unit of FMI 2.0 or 3.0, in the Python of the program that opens the FMU.

pythonfmu, or pythonfmu3 for FMI 3.0, reports a refused step as Discard. It reports an exception that leaves the unit as
Fatal, after which the standard allows no further call; so the unit lets no foreseeable exception escape. What it must
refuse in another function it logs as an error, and then it refuses every step: pythonfmu cannot return Error.
"""

from collections.abc import Callable
from ctypes import c_uint64
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any, ClassVar
from xml.etree.ElementTree import Element, SubElement

from coupling.files import plain
from coupling.ports.fmu import CONTENT_FILE, TRUSTED_FILE, UnitState, state_bytes, state_from, unpack
from coupling.ports.guest import advance, guest_chain, start
from coupling.schemes.scheme import SUBSTEPS_PER_CONTACT
from particles.chain import Chain
from particles.moving import MovingChain
from structures.checks import count_of

BASE_UNIT_EXPONENTS = {
    "s": {"s": "1"},
    "m": {"m": "1"},
    "m/s": {"m": "1", "s": "-1"},
    "N": {"kg": "1", "m": "1", "s": "-2"},
}
"""Exponents of the base units."""

CLOCK_TOLERANCE = 1e-3
"""The opening program sums its steps itself; its clock may differ from the unit's by this fraction of a step, or of the
chain's own."""

NO_KINDS: dict[int, dict[str, Any]] = {
    2: {"integer": 0, "boolean": False, "string": ""},
    3: {"int32": 0, "int64": 0, "uint64": c_uint64(0), "boolean": False, "string": ""},
}
"""The kinds that no variable of the unit has, by the version of FMI, and the values that a request for one gets."""

REST = 1e-9
"""A step shorter than this part of the chain's own is a rest of rounding in the opening program's clock."""

INITIAL = {"parameter": "exact", "output": "calculated"}
"""How the initial value of a variable is defined, by its causality."""

TOLERANCE = 1e-4
"""The relative accuracy of an amplitude ratio with the default step."""

RECORD = 4.0
"""The default stop time, in times that a wave takes through the chain: there, back, and as long in the structure."""


class ChainUnit:
    """Input: displacement of the surface at the end of a step. Outputs: forces relative to the static ones.

    The script in the FMU derives its class from this one and from that of the package `kit`, for version `fmi` of FMI.
    """

    kit: ClassVar[Any]
    fmi: ClassVar[int]
    resources: str
    vars: dict[int, Any]
    log: Callable[..., None]
    register_variable: Callable[[Any], None]

    def __init__(self, **arguments: Any) -> None:
        super().__init__(**arguments)
        folder = Path(self.resources)
        trust = (folder / TRUSTED_FILE).is_file()
        content = (folder / (TRUSTED_FILE if trust else CONTENT_FILE)).read_bytes()
        self.chain: Chain
        self.chain, self.facing = unpack(content, trust)
        self.impact_speed, self.surface_displacement = self.chain.impact_speed, 0.0
        self.begin, self.initialised = 0.0, False
        self.faults: dict[str, str] = {}
        self.unit_names: dict[str, str] = {}
        for kind, value in NO_KINDS[self.fmi].items():
            self._refuse_kind(kind, value)
        self._start()
        self.description = (
            f"hertzlink: a chain of {count_of(len(self.chain.beads), 'bead')} and its contact with a surface"
        )
        step, stop = self.moving.contact_time / SUBSTEPS_PER_CONTACT, RECORD * self.moving.transit_time
        self.default_experiment = self.kit.DefaultExperiment(0.0, float(f"{stop:.2g}"), step, TOLERANCE)
        self._register_all()

    def _register_all(self) -> None:
        if self.fmi == 3:
            self._register(
                "time",
                "s",
                "of the opening program",
                "independent",
                "continuous",
                lambda: self.begin + self.state.chain.time,
            )
        text = "at the end of the step, from static equilibrium, positive away from the chain; linear over the step"
        self._register("surface_displacement", "m", text, "input", "continuous")
        if self.impact_speed is not None:
            self._register("impact_speed", "m/s", "of the striker at time zero", "parameter", "fixed")
        beads = range(1, len(self.chain.beads) + 1)
        forces = {
            "mean_contact_force": ("mean over the step on the surface", lambda: self.state.mean_force),
            "contact_force": ("on the surface at the end of the step", lambda: self.state.contact_force[-1]),
            **{f"sensor_force[{bead}]": (f"at the centre of bead {bead}", self._sensor(bead)) for bead in beads},
        }
        for name, (text, get) in forces.items():
            self._register(name, "N", f"{text}, above the static one", "output", "continuous", get)

    def _register(self, name: str, unit: str, text: str, causality: str, variability: str, get: Any = None) -> None:
        self.unit_names[name] = unit
        kinds = {"causality": causality, "variability": variability}
        if causality in INITIAL:
            kinds["initial"] = INITIAL[causality]
        of_kit = {key: getattr(self.kit, f"Fmi{self.fmi}{key.title()}")[value] for key, value in kinds.items()}
        number = self.kit.Real if self.fmi == 2 else self.kit.Float64
        self.register_variable(number(name, description=text, getter=get, **of_kit))

    def _sensor(self, bead: int) -> Any:
        return lambda: 0.5 * (self.state.contact_force[bead - 1] + self.state.contact_force[bead])

    def to_xml(self, *options: Any) -> Element:
        """Return the description of the model, with its units, and with the initial unknowns that pythonfmu omits."""
        root: Element = super().to_xml(*options)  # type: ignore[misc]
        definitions = Element("UnitDefinitions")
        for unit, exponents in BASE_UNIT_EXPONENTS.items():
            SubElement(SubElement(definitions, "Unit", name=unit), "BaseUnit", exponents)
        root.insert(1, definitions)
        for variable in root.iterfind("ModelVariables/*"):
            (variable[0] if self.fmi == 2 else variable).set("unit", self.unit_names[variable.attrib["name"]])
        if self.fmi == 2:
            structure = next(root.iter("ModelStructure"))
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

    get_float64, set_float64 = get_real, set_real
    """The names that FMI 3.0 gives them."""

    def _refuse_kind(self, kind: str, value: Any) -> None:
        """Set the functions that get and set variables of a kind that the unit does not have."""

        def get(references: list[int]) -> list[Any]:
            for reference in references:
                self._refuse(f"variable {reference}", f"variable {reference}: is no {kind}")
            return [value] * len(references)

        setattr(self, f"get_{kind}", get)
        setattr(self, f"set_{kind}", lambda references, _: (get(references), None)[1])

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
        self._log_error(fault)

    def _log_error(self, text: str) -> None:
        self.log(text, getattr(self.kit.enums, f"Fmi{self.fmi}Status").error)

    def _start(self) -> None:
        self.moving = self._with(self.impact_speed)
        self.state = start(self.moving)

    def _with(self, impact_speed: float | None) -> MovingChain:
        return guest_chain(replace(self.chain, impact_speed=impact_speed), **self.facing)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance; an impossible step is logged, refused (Discard), and changes nothing."""
        if self.fmi == 3 and self.state.chain.time == 0.0:
            self.begin = current_time  # pythonfmu3 does not pass on the start time
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
            self._log_error(str(error))
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
