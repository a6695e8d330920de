"""The tables of a case that are more than the call of a public function: materials, chain, plates, run, sections."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import partial
from typing import Annotated, Any

from coupling.black_box import Scheme
from coupling.cosimulation import CoSimulation
from coupling.plan import Adaptive
from hertzlink.cases.forms import COMMON, EXTRA, TAGS, Of, hint_of, in_cases
from hertzlink.cases.paths import Fault
from hertzlink.cases.reader import Call
from particles.bead import Bead, drop_speed
from particles.chain import Chain
from particles.deformable.deformable_chain import DeformableChain
from particles.dissipation import Dissipation
from particles.excitation import Excitation, SpringLoaded
from particles.laws.axisymmetric import computed_law
from particles.laws.law import ContactLaw
from particles.laws.yielding import YieldingLaw
from plates.additions import PointMass
from plates.builders import kirchhoff_plate, mindlin_panel, mindlin_plate
from plates.half_plane import infinite_plate
from plates.laminate import Laminate, OrthotropicMaterial
from plates.plate import Plate
from plates.section import Section
from plates.shapes.outline import Outline
from plates.shapes.outline import circle as circle_of
from structures.damping import StandardLinearSolid, Viscous
from structures.imported import from_matrices, from_modes
from structures.material import Material
from structures.quantities import (
    Asks,
    Coordinate,
    Count,
    InFile,
    Interval,
    Length,
    Likely,
    OneOf,
    Quantity,
    RelaxationTime,
    Time,
    WallThickness,
)
from structures.reduction import reduce as reduced
from structures.structure import Structure

MOST_BEADS = 100_000

MOST = 100
"""Chains, and structures."""

BEAD = 'a bead, such as { shape = "sphere", diameter = "4.76 mm", material = "steel 440C" }'

Point = tuple[Coordinate, Coordinate]
Face = Annotated[str, OneOf("front", "back")]
Reduce = Annotated[
    bool | Annotated[dict[str, Any], Of(reduced)], Asks("true, false, or a table such as { tolerance = 0.01 }")
]
Bar = Annotated[int, Count(1, MOST_BEADS)]
Number = Annotated[int, Count(0)]
Sensor = Annotated[int, Count()]

TAGS |= dict.fromkeys((Structure, ContactLaw, Dissipation, Excitation, Scheme, Viscous, YieldingLaw), "kind")


def _own_name(call: Call, name: str = "") -> dict[str, str]:
    """Return the name of a material: that under which the user knows it."""
    name = str(call.path[-1]) if call.path[0] == "materials" else name
    return {"name": name} if name else {}


@in_cases(Material)
def material(
    call: Call,
    like: Annotated[Material, Asks("the name of a material whose other properties this one has")] | None = None,
    youngs_modulus: Any = None,
    poisson_ratio: Any = None,
    density: Any = None,
    **others: Any,
) -> Material:
    """A material by its properties, or by those that differ from another one's."""
    properties = {"youngs_modulus": youngs_modulus, "poisson_ratio": poisson_ratio, "density": density}
    stated = {name: value for name, value in properties.items() if value is not None} | others
    if like is None:
        for name in properties:
            if name not in stated:
                hint = hint_of(call.form.entries[name])
                raise call.refused(name, f"is missing; {hint}, or name another material by like")
        return Material(**_own_name(call) | stated)
    before = {one.name: getattr(like, one.name) for one in fields(Material)}
    of_case = isinstance(call.entries["like"], Call)
    if call.path[0] != "materials" and {**before, **stated} == before:
        return like
    return Material(**before | _own_name(call, like.name if of_case else f"like {like.name}") | stated)


@in_cases(OrthotropicMaterial)
def sheet(call: Call, **others: Any) -> OrthotropicMaterial:
    """An orthotropic sheet."""
    return OrthotropicMaterial(**_own_name(call) | others)


def many_of_one(count: Bar = 1) -> None:
    """The entry of a bead: how many of it stand in a row."""


COMMON[Bead] = many_of_one


@in_cases(SpringLoaded)
def spring(
    call: Call, striker: Annotated[Bead, Asks(f"{BEAD}; by default the chain's")] | None = None, **others: Any
) -> Any:
    """A spring that throws a striker, by default a bead like the chain's, which `chain` knows."""
    return partial(SpringLoaded, **others) if striker is None else SpringLoaded(striker, **others)


@in_cases(computed_law, without=("first", "second"))
def numerical(call: Call, **others: Any) -> Any:
    """A law by finite elements, for two of the beads, which `chain` knows."""
    return partial(computed_law, **others)


EXTRA[ContactLaw] = {"numerical": computed_law}


@dataclass(frozen=True)
class Seat:
    """A contact point: of which structure, and which of its points; both are counted from 0."""

    structure: Number = 0
    point: Number = 0


@in_cases(
    DeformableChain,
    without=("vibrations",),
    named={"height": ("drop_height",), "stiffness": ("striker", "stiffness"), "ratio": ("damping", "ratio")},
)
def chain(
    call: Call,
    beads: Annotated[Bar | Sequence[Bead], Asks("a whole number of beads, such as 20, or a list of beads")],
    bead: Annotated[Bead, Asks(BEAD)] | None = None,
    repeat: Bar = 1,
    striker: Annotated[
        Annotated[str, OneOf("bead", "none")] | Bead | Excitation,
        Asks(f'"bead", "none", {BEAD}, or a table with a kind, such as "spring_loaded"'),
    ] = "bead",
    impact_speed: Any = None,
    drop_height: Annotated[float, Likely.HEIGHT] | None = None,
    law: ContactLaw | YieldingLaw | None = None,
    on: Annotated[Seat, Asks("what the last bead faces, such as { structure = 0, point = 1 }")] | None = None,
    behind: Annotated[Seat, Asks("what the first bead faces with its struck side, as on")] | None = None,
    modes: Any = None,
    damping: Any = None,
    **others: Any,
) -> Chain:
    """A chain from its struck end; `on` and `behind` are for the simulation."""
    row: list[Any] = [bead] * beads if isinstance(beads, int) else _row(call.entries["beads"])
    if row[:1] == [None]:
        raise call.refused("bead", f"is missing; give {BEAD}")
    if len(row) * repeat > MOST_BEADS:
        raise call.refused("repeat", f"{repeat} makes {len(row) * repeat} beads; at most {MOST_BEADS}")
    if damping is not None and modes is None:
        raise call.refused("damping", "acts inside beads that deform; give modes as well, such as modes = 8")
    struck_by: Any = {"bead": bead or row[0], "none": None}[striker] if isinstance(striker, str) else striker
    if isinstance(striker, partial):
        with call.entries["striker"].located():
            struck_by = striker(striker=bead or row[0])

    if drop_height is not None:
        if impact_speed is not None:
            raise call.refused("drop_height", "gives the impact speed; leave out impact_speed")
        impact_speed = drop_speed(drop_height)
    # A chain that nothing strikes may start at rest.
    if impact_speed is None and struck_by is not None and not isinstance(struck_by, Excitation):
        raise call.refused("impact_speed", 'is missing; give a speed, such as "0.31 m/s", or a drop_height')

    if isinstance(law, partial):
        body = getattr(struck_by, "striker", None) if isinstance(struck_by, Excitation) else struck_by
        alike = row if body is None else [body, *row]
        if any(one != alike[0] for one in alike):
            place = (*call.path, "law", "kind")
            raise Fault(place, "computes one law, so all beads and the striker must be equal")
        with call.entries["law"].located():
            law = law(alike[0], alike[0])
    settings = {"impact_speed": impact_speed, "law": law, **others}
    if modes is None:
        return Chain(row * repeat, struck_by, **settings)
    return DeformableChain(row * repeat, struck_by, modes=modes, damping=damping, **settings)


def _row(calls: list[Call]) -> list[Any]:
    """Return the beads of a list; those whose tables say the same are one object."""
    beads: dict[str, Any] = {}
    row = []
    for one in calls:
        key = repr((one.kind, {name: value for name, value in one.entries.items() if name != "count"}))
        if key not in beads:
            beads[key] = one.made
        row += [beads[key]] * one.entries.get("count", 1)
    return row


def nothing() -> None:
    """The last bead flies off."""


def any_structure(
    damping: Sequence[Viscous] = (),
    reduce: Annotated[Reduce, Asks("true, false, or a table such as { tolerance = 0.01 }")] | None = None,
) -> None:
    """The entries of every structure: losses, and how it is reduced, as in [run]."""


EXTRA[Structure] = {"nothing": nothing}
COMMON[Structure] = any_structure


@in_cases(StandardLinearSolid)
def linear_solid(
    call: Call,
    layer: Annotated[Number, Asks("the layer, or material, of a structure, counted from 0")] | None = None,
    **others: Any,
) -> StandardLinearSolid:
    """Zener's standard linear solid, in all of a structure or in one layer, or in beads."""
    if layer is not None and call.path[0] == "chain":
        raise call.refused("layer", "is for structures; a bead has no layers")
    return StandardLinearSolid(**others)


@in_cases(reduced, without=("structure", "keep_field"))
def reduction(call: Call, until: RelaxationTime | None = None, **others: Any) -> dict[str, Any]:
    """The settings of `reduce`."""
    return {"until": until, **others}


@in_cases(from_matrices, without=("damping",))
def matrices(
    call: Call, damping_matrix: Annotated[Any, InFile("a damping matrix", "plate.mtx")] | None = None, **others: Any
) -> Structure:
    """A body from the matrices of another program."""
    return from_matrices(**others, damping=damping_matrix)


@in_cases(from_modes, without=("shapes",))
def modes_of_test(call: Call, **others: Any) -> Structure:
    """A body from the modes of another program or of a test."""
    return from_modes(**others)


def walled(call: Call, thickness: float | None, material: Any, wall: Any) -> dict[str, Any]:
    """Return the thickness and material of a plate of one material, or of a wall with a thickness of its own."""
    one = {"thickness": 'a length, such as "2.29 mm"', "material": 'a material, such as "aluminium 6061"'}
    for name, what in one.items():
        if wall is None and name not in call.entries:
            raise call.refused(name, f"is missing; give {what}, or a wall")
        if wall is not None and name in call.entries:
            raise call.refused(name, "belongs to a wall of one material; leave it out, or leave out wall")
    return {"thickness": thickness, "material": material if wall is None else wall}


Wall = Annotated[
    Laminate | Section,
    Asks("a table with plies, or with bending, shear, mass, rotary_inertia, thickness and struck"),
]
Places = Annotated[
    Point | Sequence[Point], Asks('the point that is struck, such as ["60 mm", "457 mm"], or a list of points')
]
OF_PLACES = {"x": ("at", 0), "y": ("at", 1), "x, y": ("at",), "x, y, face": ("face",)}


@in_cases(kirchhoff_plate, mindlin_plate, named=OF_PLACES)
def plate(
    call: Call,
    at: Places,
    face: Face | Sequence[Face] = "front",
    thickness: WallThickness | None = None,
    material: Material | None = None,
    wall: Wall | None = None,
    **others: Any,
) -> Structure:
    """A plate that is struck at one point or at several."""
    body: Plate = call.target(**walled(call, thickness, material, wall), **others)
    x: Any
    y: Any
    x, y = ([*coordinates] for coordinates in zip(*at, strict=True)) if isinstance(at, list) else at
    return body.at(x, y, face)


@in_cases(mindlin_panel, without=("shape",), named=OF_PLACES)
def panel(
    call: Call,
    at: Places,
    circle: Annotated[Length, Asks("the radius of a round plate, whose centre is the origin")] | None = None,
    corners: Sequence[Point] | None = None,
    holes: Sequence[Sequence[Point]] = (),
    edges: Annotated[str | Sequence[str], Asks("a name for each side, or one for all")] | None = None,
    mesh: Annotated[Any, InFile("a mesh", "panel.msh")] | None = None,
    face: Face | Sequence[Face] = "front",
    thickness: WallThickness | None = None,
    material: Material | None = None,
    wall: Wall | None = None,
    **others: Any,
) -> Structure:
    """A plate of any outline."""
    shapes = [name for name in ("circle", "corners", "mesh") if name in call.entries]
    if len(shapes) != 1:
        what = f"give {' or '.join(shapes)} alone" if shapes else "is missing; give corners, circle or mesh"
        raise call.refused((shapes or ["corners"])[-1], what)
    shape = mesh
    if mesh is None:
        around = circle_of(circle) if circle is not None else corners or []
        names: Any = edges if isinstance(edges, str) else tuple(edges or ())
        shape = Outline(tuple(around), tuple(map(tuple, holes)), names)
    struck: Structure = plate(call, at, face, thickness, material, wall, shape=shape, **others)
    return struck


@in_cases(infinite_plate)
def endless(
    call: Call,
    thickness: WallThickness | None = None,
    material: Material | None = None,
    wall: Laminate | None = None,
    **others: Any,
) -> Structure:
    """An infinite plate."""
    return infinite_plate(**walled(call, thickness, material, wall), **others)


@in_cases(PointMass, without=("x", "y"), named=OF_PLACES)
def point_mass(call: Call, at: Point, **others: Any) -> PointMass:
    """A point mass."""
    return PointMass(*at, **others)


@in_cases(CoSimulation.__init__, without=("self", "chain", "structure", "behind"))
def run(
    call: Call,
    until: Interval,
    save_every: Interval | None = None,
    window: Interval | None = None,
    reduce: Reduce = True,
    adaptive: Adaptive | None = None,
    **others: Any,
) -> dict[str, Any]:
    """The record, and how finely it is computed: the settings of CoSimulation."""
    if adaptive is not None and window is not None:
        raise call.refused("adaptive", "sets the windows; leave out window")
    return {"reduce": reduce is not False, "window": adaptive or window, **others}


@dataclass(frozen=True)
class Steps:
    """Evenly spaced values."""

    from_: Annotated[Any, Asks('the first value, such as "10 mm"')]
    to: Annotated[Any, Asks('the last value, such as "200 mm"')]
    step: Any = None
    count: Annotated[int, Count(2, 100_000)] | None = None


@dataclass(frozen=True)
class CriticalDistance:
    """Which distance is critical, and by what measure."""

    along: Annotated[str, Asks('the path of an axis of [sweep], such as "structure.at[0]"')]
    tolerance: Annotated[float, Quantity()] = 0.02
    relative: bool = False
    bracket: Length = 0.2e-3


@dataclass(frozen=True)
class Measure:
    """What is read from runs. chain: which of several, counted from 0."""

    chain: Number = 0
    sensor: Sensor | None = None
    sensors: Sequence[Sensor] | None = None
    traces: bool = False
    numerical_error: bool = False
    critical_distance: CriticalDistance | None = None


Calibration = Annotated[float, Quantity("N/V", "a calibration", "25 N/V", low=-float("inf"))]


@dataclass(frozen=True)
class Identify:
    """What is found from a measured signal."""

    sensors: Annotated[
        Mapping[str, Number],
        Asks("a table of beads and columns, such as { 7 = 1 } for bead 7 in column 1, counted from 0"),
    ]
    unknowns: Annotated[
        Mapping[str, tuple[Any, Any]],
        Asks('a table of paths and ranges, such as { "structure.thickness" = ["1 mm", "6 mm"] }'),
    ]
    calibration: Calibration | Mapping[str, Calibration] | None = None
    nuisances: Sequence[str] = ("gain", "time_zero")
    until: Interval | None = None
    time_column: Number | None = None
    time_unit: str | None = None
    unit: str | None = None
    interval: Interval | None = None
    start: Time | None = None
    segment: Sensor | None = None
    mains: Annotated[float, Quantity("Hz", "a frequency", "50 Hz")] | None = None
    condition: bool = True
    noise: Annotated[float, Quantity("N", "a force", "0.2 N")] | None = None
    discrepancy: Annotated[float, Quantity(or_zero=True)] = 0.0
    starts: Sensor = 3
    seed: Number = 0


@dataclass(frozen=True)
class Sections:
    """The sections of a case."""

    chain: Annotated[DeformableChain | Sequence[DeformableChain], Asks("a section: [chain] with beads = 20 and a bead")]
    structure: Annotated[
        Structure | Sequence[Structure], Asks('a section: [structure] with a kind, such as kind = "rod"')
    ]
    run: Annotated[dict[str, Any], Of(CoSimulation.__init__), Asks('a section: [run] with until = "1.5 ms"')]
    title: str | None = None
    materials: Mapping[str, Material | OrthotropicMaterial] = field(default_factory=dict)
    behind: Structure | None = None
    sweep: (
        Mapping[
            str,
            Annotated[
                Sequence[Any] | Steps,
                Asks('a list of values, or { from = "10 mm", to = "200 mm", step = "10 mm" }'),
            ],
        ]
        | None
    ) = None
    measure: Measure | None = None
    sensitivities: Mapping[str, float | str] | None = None
    identify: Identify | None = None
