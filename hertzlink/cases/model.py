"""A whole case: its sections, checked; the model from which editors get their schema."""

from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import Field, create_model

from coupling.cosimulation import CoSimulation
from coupling.plan import Adaptive
from hertzlink.cases import plates as _plates  # noqa: F401  for its tables
from hertzlink.cases.bodies import Body, Nothing, Reduce, structure_tables
from hertzlink.cases.chains import ChainPart, chain_table
from hertzlink.cases.declared import Data, Declared, described_by, field_of, forget_tables, table_of, union
from hertzlink.cases.entry_paths import Path
from hertzlink.cases.faults import Fault
from hertzlink.cases.materials import OfCase
from hertzlink.cases.parts import Duration, Frequency, Length, Number, Part, World, either, made
from hertzlink.cases.units import Unit
from structures.described import registered

MOST = 100
"""Chains, and structures."""

DIALECT = "https://json-schema.org/draft/2020-12/schema"

SIMULATION = described_by(CoSimulation.__init__)


def _many(kind: Any, name: str) -> Any:
    several = Annotated[list[kind], Field(min_length=1, max_length=MOST)]
    message = f"must be a section [{name}], or sections [[{name}]]"
    return either(message, one=(dict | Part, kind), many=(list, several))


Range = Annotated[list[Any], Field(min_length=2, max_length=2)]


class RunPart(Declared):
    """The record, and how finely it is computed."""

    named_so = "RunPart"
    without = ("self", "chain", "structure", "behind")
    apart = ("reduce",)

    # Positive before any structure is built for it.
    until: Annotated[Duration, Field(gt=0.0)]
    reduce: Reduce = True
    adaptive: Declared | None = None

    if TYPE_CHECKING:
        save_every: float | None
        window: float | None

    def make(self, world: World) -> Data:
        """Return the arguments of CoSimulation."""
        arguments = self.arguments(world) | {"reduce": self.reduce is not False}
        if self.adaptive is not None:
            if self.window is not None:
                raise Fault(("adaptive",), "sets the windows; leave out window")
            arguments["window"] = made(self.adaptive, world, ("adaptive",))
        return arguments


def run_table() -> type[RunPart]:
    """Return the table of a run with all schemes that are described."""
    saved = described_by(CoSimulation.run).parameters["save_every"]
    windows: Any = table_of(described_by(Adaptive))
    base: type[RunPart] = create_model(
        "RunPart",
        __base__=RunPart,
        __doc__=RunPart.__doc__,
        save_every=field_of(saved),
        adaptive=(windows | None, None),
    )
    return table_of(SIMULATION, base=base)  # type: ignore[return-value]


class Steps(Part):
    """Evenly spaced values."""

    start: Any = Field(alias="from", description='the first value, such as "10 mm"')
    end: Any = Field(alias="to", description='the last value, such as "200 mm"')
    step: Any = None
    count: Annotated[int, Field(ge=2, le=100_000)] | None = None


Axis: Any = either(
    'must be a list of values, or { from = "10 mm", to = "200 mm", step = "10 mm" }',
    values=(list, Annotated[list[Any], Field(min_length=1)]), steps=(dict | Steps, Steps),
)  # fmt: skip


class CriticalPart(Part):
    """Which distance is critical, and by what measure."""

    along: str = Field(description='the path of an axis of [sweep], such as "structure.at[0]"')
    tolerance: Annotated[float, Unit("", "a number", "0.02")] = 0.02
    relative: bool = False
    bracket: Length = 0.2e-3


class MeasurePart(Part):
    """What is read from runs."""

    chain: Annotated[int, Field(ge=0, description="which of several chains is read, counted from 0")] = 0
    sensor: Annotated[int, Field(ge=1)] | None = None
    sensors: Annotated[list[Annotated[int, Field(ge=1)]], Field(min_length=1)] | None = None
    traces: bool = False
    numerical_error: bool = False
    critical_distance: CriticalPart | None = None


Calibration = Annotated[float, Unit("N/V", "a calibration", "25 N/V")]
ManyCalibrations: Any = either(one=(object, Calibration), many=(dict, dict[str, Calibration]))


class IdentifyPart(Part):
    """What is found from a measured signal."""

    sensors: dict[str, Annotated[int, Field(ge=0)]] = Field(
        description="a table of beads and columns, such as { 7 = 1 } for bead 7 in column 1, counted from 0"
    )
    unknowns: dict[str, Range] = Field(
        description='a table of paths and ranges, such as { "structure.thickness" = ["1 mm", "6 mm"] }'
    )
    calibration: ManyCalibrations | None = None
    nuisances: list[str] = Field(default_factory=lambda: ["gain", "time_zero"])
    until: Duration | None = None
    time_column: Annotated[int, Field(ge=0)] | None = None
    time_unit: str | None = None
    unit: str | None = None
    interval: Duration | None = None
    start: Duration | None = None
    segment: Annotated[int, Field(ge=1)] | None = None
    mains: Frequency | None = None
    condition: bool = True
    noise: Annotated[float, Unit("N", "a force", "0.2 N")] | None = None
    discrepancy: Number = 0.0
    compare: Literal["waveform", "features"] = "waveform"
    starts: Annotated[int, Field(ge=1)] = 3
    seed: Annotated[int, Field(ge=0)] = 0


class CaseModel(Part):
    """A case."""

    title: str | None = None
    materials: dict[str, OfCase] = Field(default_factory=dict)  # type: ignore[valid-type]
    chain: ChainPart | list[ChainPart] = Field(description="a section: [chain] with beads = 20 and a bead")
    structure: Body | list[Body] = Field(description='a section: [structure] with a kind, such as kind = "rod"')
    behind: Body | None = None
    run: RunPart = Field(description='a section: [run] with until = "1.5 ms"')
    sweep: Annotated[dict[str, Axis], Field(min_length=1)] | None = None
    measure: MeasurePart = Field(default_factory=MeasurePart)
    sensitivities: Annotated[dict[str, float | str], Field(min_length=1)] | None = Field(
        None, description='paths and standard uncertainties, such as "structure.thickness" = "0.02 mm" or "2 %"'
    )
    identify: IdentifyPart | None = None

    @property
    def chains(self) -> list[ChainPart]:
        """All chains."""
        return self.chain if isinstance(self.chain, list) else [self.chain]

    @property
    def measured(self) -> ChainPart:
        """The chain that is read; a Fault where there is no such chain."""
        if self.measure.chain >= len(self.chains):
            raise Fault(("measure", "chain"), f"{self.measure.chain} is no chain of {len(self.chains)}, counted from 0")
        return self.chains[self.measure.chain]

    def only_chain(self, what: str) -> ChainPart:
        """Return the only chain; a Fault where there are several, which `what` does not take."""
        if isinstance(self.chain, list):
            raise Fault(("chain",), f"has {len(self.chain)} sections; {what} takes one, [chain]")
        return self.chain


def case_model() -> type[CaseModel]:
    """Return the case with all parts that are described up to now."""
    return _case_model(registered())


def run_entries() -> dict[str, Path]:
    """Return the paths of the entries of [run], by name."""
    table: Any = case_model().model_fields["run"].annotation
    return {name: ("run", name) for name in table.model_fields}


def schema() -> dict[str, Any]:
    """Return the JSON schema of case files, by which editors complete and check entries.

    A file that extends another may lack sections, so none is required.
    """
    document = case_model().model_json_schema(by_alias=True)
    document.pop("required", None)
    document["properties"] |= {
        "extends": {"type": "string", "description": "a case file that this one changes"},
        "without": {"type": "array", "items": {"type": "string"}, "description": "entries of that file to leave out"},
    }
    return {"$schema": DIALECT, **document, "title": "hertzlink case"}


@lru_cache(maxsize=1)
def _case_model(kinds_described: object) -> type[CaseModel]:
    forget_tables()
    structure: Any = union([Nothing, *structure_tables()])
    return create_model(
        "CaseModel",
        __base__=CaseModel,
        __doc__=CaseModel.__doc__,
        chain=(_many(chain_table(), "chain"), CaseModel.model_fields["chain"]),
        structure=(_many(structure, "structure"), CaseModel.model_fields["structure"]),
        behind=(structure | None, None),
        run=(run_table(), CaseModel.model_fields["run"]),
    )
