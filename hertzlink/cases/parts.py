"""The tables of a case that are more than the call of a public function: families, materials, chain, run, sections."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Annotated, Any, NamedTuple

from coupling.black_box import Scheme
from coupling.cosimulation import CoSimulation
from coupling.plan import Adaptive
from hertzlink.cases.forms import FAMILIES, Family, Of, entry_of, form_of, hint_of, in_cases
from particles.bead import Bead, drop_speed
from particles.chain import Chain
from particles.deformable.deformable_chain import DeformableChain
from particles.dissipation import Dissipation
from particles.excitation import Excitation, SpringLoaded
from particles.laws.axisymmetric import computed_law
from particles.laws.law import ContactLaw
from particles.laws.yielding import YieldingLaw
from plates.additions import PointMass
from plates.builders import mindlin_panel
from plates.laminate import OrthotropicMaterial
from plates.plate import Plate
from plates.shapes.outline import Outline
from plates.shapes.outline import circle as circle_of
from structures.damping import StandardLinearSolid, Viscous
from structures.imported import from_matrices
from structures.material import Material
from structures.quantities import Asks, Coordinate, Count, InFile, Interval, Length, Likely, OneOf, Quantity, Several
from structures.reduction import reduce
from structures.structure import Structure

MOST_BEADS = 100_000
BEAD = 'a bead, such as { shape = "sphere", diameter = "4.76 mm", material = "steel 440C" }'

SPREAD = 'a standard uncertainty after a path in quotes, as "structure.thickness" = "0.02 mm"'

Point = tuple[Coordinate, Coordinate]
Face = Annotated[str, OneOf("front", "back")]
Bar = Annotated[int, Count(1, MOST_BEADS)]
Number = Annotated[int, Count(0)]
Struck = Annotated[
    Point | Sequence[Point], Asks('the point that is struck, such as ["60 mm", "457 mm"], or a list of points')
]


def nothing() -> None:
    """The last bead flies off."""


LOSSES = {"damping": entry_of(Sequence[Viscous], ())}
FAMILIES |= dict.fromkeys((Dissipation, Excitation, Scheme, Viscous, YieldingLaw), Family()) | {
    Bead: Family("shape", {"count": entry_of(Bar, 1)}),
    ContactLaw: Family(others={"numerical": computed_law}),
    Structure: Family(common=LOSSES, others={"nothing": nothing}),
    Plate: Family(common={**LOSSES, "at": entry_of(Struck), "face": entry_of(Face | Sequence[Face], "front")}),
}


@in_cases(Material)
def material(
    like: Annotated[Material, Asks("the name of a material whose other properties this one has")] | None = None,
    youngs_modulus: Any = None,
    poisson_ratio: Any = None,
    density: Any = None,
    name: Any = "",
    **others: Any,
) -> Material:
    """A material by its properties, or by those that differ from another one's."""
    needed = {"youngs_modulus": youngs_modulus, "poisson_ratio": poisson_ratio, "density": density}
    stated = {key: value for key, value in (needed | others).items() if value is not None}
    if like is not None:
        changed = replace(like, **stated)
        return like if changed == like and not name else replace(changed, name=name or f"like {like.name}")
    for key in needed:
        if key not in stated:
            hint = hint_of(form_of(Material).entries[key])
            raise ValueError(f"{key}: is missing; {hint}, or name another material by like")
    return Material(**stated, name=name)


@in_cases(SpringLoaded)
def spring(striker: Annotated[Bead, Asks(f"{BEAD}; by default the chain's")] | None = None, **others: Any) -> Any:
    """A spring that shoots a striker; by default `chain` supplies one of its beads."""
    return partial(SpringLoaded, **others) if striker is None else SpringLoaded(striker, **others)


@in_cases(computed_law, without=("first", "second"))
def numerical(**others: Any) -> Any:
    """A law by finite elements for two beads, which `chain` supplies."""
    return partial(computed_law, **others)


@dataclass(frozen=True)
class Seat:
    """A contact point: the numbers of its structure and of the point there, both counted from 0."""

    structure: Number = 0
    point: Number = 0


@in_cases(DeformableChain, without=("vibrations",))
def chain(
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
    behind: Annotated[Seat, Asks("what the struck side of the first bead faces, like on")] | None = None,
    modes: Any = None,
    damping: Any = None,
    **others: Any,
) -> Chain:
    """A chain from its struck end; `on` and `behind` are for the simulation."""
    row: list[Any] = [bead] * beads if isinstance(beads, int) else [*beads]
    if row[:1] == [None]:
        raise ValueError(f"bead: is missing; give {BEAD}")
    if len(row) * repeat > MOST_BEADS:
        raise ValueError(f"repeat: {repeat} makes {len(row) * repeat} beads; must make at most {MOST_BEADS}")
    if damping is not None and modes is None:
        raise ValueError("damping: acts inside beads that deform; give modes as well, such as modes = 8")
    struck_by: Any = {"bead": bead or row[0], "none": None}[striker] if isinstance(striker, str) else striker
    if isinstance(striker, partial):
        struck_by = striker(striker=bead or row[0])

    if drop_height is not None:
        if impact_speed is not None:
            raise ValueError("drop_height: gives the impact speed; leave out impact_speed")
        impact_speed = drop_speed(drop_height)
    # A chain that nothing strikes may start at rest.
    if impact_speed is None and struck_by is not None and not isinstance(struck_by, Excitation):
        raise ValueError('impact_speed: is missing; give a speed, such as "0.31 m/s", or a drop_height')

    if isinstance(law, partial):
        body = getattr(struck_by, "striker", None) if isinstance(struck_by, Excitation) else struck_by
        if any(one != row[0] for one in (row if body is None else [body, *row])):
            raise ValueError("law: computes one law, so all beads and the striker must be equal")
        law = law(row[0], row[0])
    settings = {"impact_speed": impact_speed, "law": law, **others}
    if modes is None:
        return Chain(row * repeat, struck_by, **settings)
    return DeformableChain(row * repeat, struck_by, modes=modes, damping=damping, **settings)


class InLayer(NamedTuple):
    """A loss in one layer of a structure."""

    loss: Viscous
    layer: int


@in_cases(StandardLinearSolid)
def linear_solid(
    layer: Annotated[Number, Asks("the layer, or material, of a structure, counted from 0")] | None = None,
    **others: Any,
) -> StandardLinearSolid | InLayer:
    """Zener's standard linear solid, in all of a structure or in one layer."""
    loss = StandardLinearSolid(**others)
    return loss if layer is None else InLayer(loss, layer)


@in_cases(reduce, without=("structure", "keep_field"))
def reduction(until: Any = None, **others: Any) -> dict[str, Any]:
    """The settings of `reduce`."""
    return {"until": until, **others}


@in_cases(from_matrices, without=("damping",))
def matrices(
    damping_matrix: Annotated[Any, InFile("a damping matrix", "plate.mtx")] | None = None, **others: Any
) -> Structure:
    """A body from the matrices of another program; `damping` lists losses, as for every structure."""
    return from_matrices(**others, damping=damping_matrix)


@in_cases(mindlin_panel, without=("shape",))
def panel(
    circle: Annotated[Length, Asks("the radius of a round plate, whose centre is the origin")] | None = None,
    corners: Sequence[Point] | None = None,
    holes: Sequence[Sequence[Point]] = (),
    edges: Annotated[str | Sequence[str], Asks("a name for each side, or one for all")] | None = None,
    mesh: Annotated[Any, InFile("a mesh", "panel.msh")] | None = None,
    **others: Any,
) -> Plate:
    """A plate of any outline."""
    if sum(shape is not None for shape in (circle, corners, mesh)) != 1:
        raise ValueError("corners: give one of corners, circle and mesh")
    around = circle_of(circle) if circle is not None else corners or []
    names: Any = edges if isinstance(edges, str) else tuple(edges or ())
    return mindlin_panel(mesh or Outline(tuple(around), tuple(map(tuple, holes)), names), **others)


@in_cases(PointMass, without=("x", "y"))
def point_mass(at: Point, **others: Any) -> PointMass:
    """A point mass."""
    return PointMass(*at, **others)


@in_cases(CoSimulation.__init__, without=("self", "chain", "structure", "behind"))
def run(
    until: Interval,
    save_every: Interval | None = None,
    window: Interval | None = None,
    reduce: Annotated[
        bool | Annotated[dict[str, Any], Of(reduce)], Asks("true, false, or a table such as { tolerance = 0.01 }")
    ] = True,
    adaptive: Adaptive | None = None,
    **others: Any,
) -> dict[str, Any]:
    """The record, and how finely it is computed: the settings of CoSimulation."""
    if adaptive is not None and window is not None:
        raise ValueError("adaptive: sets the windows; leave out window")
    return {"reduce": reduce is not False, "window": adaptive or window, **others}


@dataclass(frozen=True)
class Steps:
    """Evenly spaced values."""

    from_: Annotated[Any, Asks('the first value, such as "10 mm"')]
    to: Annotated[Any, Asks('the last value, such as "200 mm"')]
    step: Any = None
    count: Annotated[int, Count(2, 100_000)] | None = None


Values = Annotated[
    Sequence[Any] | Steps, Asks('a list of values, or { from = "10 mm", to = "200 mm", step = "10 mm" }')
]


@dataclass(frozen=True)
class CriticalDistance:
    """Which distance is critical, and by what measure."""

    along: Annotated[str, Asks('the path of an axis of [sweep], such as "structure.at[0]"')]
    tolerance: Annotated[float, Quantity(high=1.0)] = 0.02
    bracket: Length = 0.2e-3


@dataclass(frozen=True)
class Measure:
    """The measures that are read from runs. chain: its number among several, from 0."""

    chain: Number = 0
    sensor: Several | None = None
    sensors: Sequence[Several] | None = None
    traces: bool = False
    numerical_error: bool = False
    critical_distance: CriticalDistance | None = None


@dataclass(frozen=True)
class Sections:
    """The sections of a case."""

    chain: Annotated[DeformableChain | Sequence[DeformableChain], Asks("a section: [chain] with beads = 20 and a bead")]
    structure: Annotated[
        Structure | Plate | Sequence[Structure | Plate],
        Asks('a section: [structure] with a kind, such as kind = "rod"'),
    ]
    run: Annotated[dict[str, Any], Of(CoSimulation.__init__), Asks('a section: [run] with until = "1.5 ms"')]
    title: str | None = None
    materials: Mapping[str, Material | OrthotropicMaterial] = field(default_factory=dict)
    sweep: Mapping[str, Values] | None = None
    measure: Measure | None = None
    sensitivities: Mapping[str, Annotated[float | str, Asks(SPREAD)]] | None = None
    identify: Annotated[dict[str, Any], Of("hertzlink.cases.identification:identify")] | None = None
