"""A whole case: its sections, checked; the model from which editors get their schema."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Discriminator, Field, Tag

from coupling.schemes.condensed import Condensed
from coupling.schemes.explicit import Explicit
from coupling.schemes.iterated import IQN_ILS, Aitken, FixedPoint
from coupling.schemes.windows import Adaptive
from hertzlink.cases.bodies import BeamBody, HalfSpace, LayeredCylinder, Nothing, Rod, Solid
from hertzlink.cases.chains import ChainPart
from hertzlink.cases.parts import Duration, Frequency, Length, Number, OwnMaterial, Part, World, forms
from hertzlink.cases.plates import (
    HalfPlane,
    InfinitePlate,
    KirchhoffPanel,
    KirchhoffPlate,
    MindlinPanel,
    MindlinPlate,
)
from hertzlink.cases.units import Unit

SCHEMES: dict[str, Any] = {
    "condensed": Condensed, "explicit": Explicit, "aitken": Aitken, "iqn_ils": IQN_ILS, "fixed_point": FixedPoint,
}  # fmt: skip

AnyStructure = Annotated[
    Nothing
    | HalfSpace
    | Rod
    | LayeredCylinder
    | BeamBody
    | Solid
    | KirchhoffPlate
    | MindlinPlate
    | KirchhoffPanel
    | MindlinPanel
    | HalfPlane
    | InfinitePlate,
    Discriminator("kind"),
]

Range = Annotated[list[Any], Field(min_length=2, max_length=2)]


def _plain_micro(unit: Any) -> Any:
    """µs as us."""
    return unit.replace("µ", "u").replace("μ", "u") if isinstance(unit, str) else unit


class Reduction(Part):
    """How large structures are replaced by oscillators."""

    tolerance: Number | None = None
    pulse: Duration | None = None
    largest: Annotated[int, Field(ge=1)] | None = None
    until: Duration | None = None


def _reduced(given: Any) -> str | None:
    if isinstance(given, bool):
        return "yes or no"
    return "settings" if isinstance(given, dict | Reduction) else None


class SchemePart(Part):
    """How chain and structure agree on the force of a window."""

    kind: Literal["condensed", "explicit", "aitken", "iqn_ils", "fixed_point"]
    tolerance: Number | None = None
    relaxation: Number | None = None
    largest_count: int | None = None
    reuse: int | None = None
    filtering: Number | None = None
    predictor: int | None = None
    parallel: bool | None = None

    def make(self, world: World) -> Any:
        made = SCHEMES[self.kind]
        names = made.__dataclass_fields__
        for name in self.given("kind"):
            if name not in names:
                raise ValueError(f"{name}: is no entry of {self.kind}; it has {', '.join(names)}")
        return made(**self.given("kind"))


class AdaptivePart(Part):
    """Windows whose length follows an error estimate."""

    tolerance: Number

    def make(self, world: World) -> Adaptive:
        return Adaptive(self.tolerance)


class RunPart(Part):
    """The record, and how finely it is computed."""

    until: Duration
    save_every: Duration | None = None
    accuracy: Literal["default", "screening", "reference"] = "default"
    reduce: Annotated[
        Annotated[bool, Tag("yes or no")] | Annotated[Reduction, Tag("settings")],
        forms(_reduced, "must be true, false, or a table such as { tolerance = 0.01 }"),
    ] = True
    scheme: SchemePart | None = None
    window: Duration | None = None
    adaptive: AdaptivePart | None = None
    substeps: Annotated[int, Field(ge=1)] | None = None
    waveform: Literal["linear", "quadratic"] = "linear"


class Steps(Part):
    """Evenly spaced values."""

    start: Any = Field(alias="from", description='the first value, such as "10 mm"')
    end: Any = Field(alias="to", description='the last value, such as "200 mm"')
    step: Any = None
    count: Annotated[int, Field(ge=2, le=100_000)] | None = None


def _axis(given: Any) -> str | None:
    if isinstance(given, list):
        return "values"
    return "steps" if isinstance(given, dict | Steps) else None


Axis = Annotated[
    Annotated[list[Any], Field(min_length=1), Tag("values")] | Annotated[Steps, Tag("steps")],
    forms(_axis, 'must be a list of values, or { from = "10 mm", to = "200 mm", step = "10 mm" }'),
]


class CriticalPart(Part):
    """Which distance is critical, and by what measure."""

    along: str = Field(description='the path of an axis of [sweep], such as "structure.at[0]"')
    tolerance: Annotated[float, Unit("", "a number", "0.02")] = 0.02
    relative: bool = False
    bracket: Length = 0.2e-3


class MeasurePart(Part):
    """What is read from runs."""

    sensor: Annotated[int, Field(ge=1)] | None = None
    sensors: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=1)] | None = None
    traces: bool = False
    critical_distance: CriticalPart | None = None


def _calibration(given: Any) -> str:
    return "many" if isinstance(given, dict) else "one"


Calibration = Annotated[float, Unit("N/V", "a calibration", "25 N/V")]
ManyCalibrations = Annotated[
    Annotated[Calibration, Tag("one")] | Annotated[dict[str, Calibration], Tag("many")], Discriminator(_calibration)
]


class IdentifyPart(Part):
    """What is found from a measured signal."""

    sensors: dict[str, Annotated[int, Field(ge=0)]] = Field(
        description="a table of beads and columns, such as { 7 = 1 } for bead 7 in column 1 (the time is column 0)"
    )
    unknowns: dict[str, Range] = Field(
        description='a table of paths and ranges, such as { "structure.thickness" = ["1 mm", "6 mm"] }'
    )
    calibration: ManyCalibrations | None = None
    nuisances: list[str] = Field(default_factory=lambda: ["gain", "time_zero"])
    until: Duration | None = None
    time_column: Annotated[int, Field(ge=0)] = 0
    time_unit: Annotated[Literal["s", "ms", "us", "ns"], BeforeValidator(_plain_micro)] | None = None
    unit: Literal["V", "mV", "N"] | None = None
    mains: Frequency | None = None
    condition: bool = True
    noise: Annotated[float, Unit("N", "a force", "0.2 N")] | None = None
    discrepancy: Number = 0.0
    compare: Literal["waveform", "features"] = "waveform"
    search: Literal["quick", "full"] = "quick"
    starts: Annotated[int, Field(ge=1)] = 3
    seed: Annotated[int, Field(ge=0)] = 0


class CaseModel(Part):
    """A case."""

    title: str | None = None
    materials: dict[str, OwnMaterial] = Field(default_factory=dict)
    chain: ChainPart = Field(description="a section: [chain] with beads = 20 and a bead")
    structure: AnyStructure = Field(description='a section: [structure] with a kind, such as kind = "rod"')
    behind: AnyStructure | None = None
    run: RunPart = Field(description='a section: [run] with until = "1.5 ms"')
    sweep: Annotated[dict[str, Axis], Field(min_length=1)] | None = None
    measure: MeasurePart = Field(default_factory=MeasurePart)
    identify: IdentifyPart | None = None
