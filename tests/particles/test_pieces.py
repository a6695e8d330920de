"""Pieces of the compiled loops, called from Python: closed formulas, and laws and losses of a user's own."""

from dataclasses import dataclass
from math import fsum, sqrt
from platform import machine
from typing import Any, NamedTuple

import numpy as np
import pytest
from numba import njit, typeof
from scipy.integrate import quad
from test_losses import PASS_LOSSES

import hertzlink as hl
from particles.joined import pace_of
from particles.kernels import laws
from particles.kernels.motion import MOVED, TRIED, Verlet, advance
from particles.laws.law import kernel_table
from structures.structure import Vector

STEEL = hl.Sphere(4.76e-3, hl.STEEL_440C)
WALL = hl.half_space(hl.STEEL_316)
STIFFNESS = np.array([1e10, 3e9])
CURVE = hl.laws.PowerLaw(2e8, 1.3)
TABLE = kernel_table(CURVE)
TABULATED = laws.Mixed(
    laws.Tabulated(np.array([0.5, 3e9]), np.array([0, -1]), TABLE), laws.Hertz(STIFFNESS), np.array([True, False])
)
MIXED = laws.Mixed(laws.Hertz(STIFFNESS), TABULATED, np.array([False, True]))
OVERLAPS = (1e-9, 3e-7, 2e-5)


def yielding() -> laws.Yielding:
    """A steel contact that yields, and remembers nothing yet."""
    chain = hl.Chain([STEEL] * 2, STEEL, 1.0, law=hl.laws.Thornton(yield_strength=6e8))
    moving = hl.stepping.MovingChain(chain, hl.Surface(hl.STEEL_316))
    return laws.with_memory(moving.model.law, moving.start().position)  # type: ignore[no-any-return]


LAWS: dict[str, tuple[Any, int, Any]] = {
    "Hertz": (laws.Hertz(STIFFNESS), 1, lambda d: 3e9 * d**1.5),
    "a table": (TABULATED, 0, lambda d: 0.5 * 2e8 * d**1.3),
    "Hertz among tables": (TABULATED, 1, lambda d: 3e9 * d**1.5),
    "a law of a user's own": (MIXED, 1, lambda d: 3e9 * d**1.5),
    "the law next to it": (MIXED, 0, lambda d: 0.5 * 2e8 * d**1.3),
}  # fmt: skip


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("overlap", OVERLAPS)
def test_force_slope_and_energy_of_a_law(name: str, overlap: float) -> None:
    piece, i, formula = LAWS[name]
    assert laws.force(piece, i, overlap) == pytest.approx(formula(overlap), rel=3e-9)
    slope = (formula(1.00001 * overlap) - formula(0.99999 * overlap)) / (2e-5 * overlap)
    assert laws.slope(piece, i, overlap) == pytest.approx(slope, rel=1e-6)
    assert laws.energy(piece, i, overlap) == pytest.approx(
        quad(formula, 0.0, overlap, epsabs=0.0, epsrel=1e-11)[0], rel=1e-8
    )
    assert laws.force_of_step(piece, i, overlap) == laws.force(piece, i, overlap)
    assert laws.elastic_overlap(piece, i, overlap) == overlap
    for apart in (0.0, -overlap):
        assert laws.force(piece, i, apart) == laws.slope(piece, i, apart) == laws.energy(piece, i, apart) == 0.0


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("flexibility", [3e-8, 1e-5, -1e-10])
def test_a_law_on_a_spring(name: str, flexibility: float) -> None:
    """δ = δ_h + f F(δ_h)."""
    piece, i, formula = LAWS[name]
    own = laws.overlap_on_spring(piece, i, 1e-6, flexibility)
    assert own + flexibility * formula(own) == pytest.approx(1e-6, rel=1e-8)
    assert laws.overlap_on_spring(piece, i, -1e-6, flexibility) == -1e-6


def test_a_contact_that_yields() -> None:
    """Hertz's law at first; then unloaded it follows Hertz's law from its dent on, and has lost the area between."""
    piece, before = yielding(), yielding()
    begin, after = float(piece.begin[1]), 4.0 * float(piece.begin[1])
    assert laws.force(piece, 1, 0.5 * begin) == pytest.approx(piece.stiffness[1] * (0.5 * begin) ** 1.5, rel=1e-12)
    loading = quad(lambda d: laws.force(piece, 1, d), 0.0, after, points=[begin], epsabs=0.0, epsrel=1e-10)[0]
    peak = laws.force_of_step(piece, 1, after)
    assert (piece.limit[1], laws.force(piece, 1, after)) == (after, pytest.approx(peak, rel=1e-12))
    dent, hard = float(piece.dent[1]), float(piece.hard[1])
    assert 0.0 < dent < after
    for overlap in (0.5 * (dent + after), 0.9 * after):
        elastic = overlap - dent
        assert laws.force(piece, 1, overlap) == pytest.approx(hard * elastic**1.5, rel=1e-12)
        assert laws.slope(piece, 1, overlap) == pytest.approx(1.5 * hard * sqrt(elastic), rel=1e-12)
        assert laws.energy(piece, 1, overlap) == pytest.approx(0.4 * hard * elastic**2.5, rel=1e-12)
        assert laws.elastic_overlap(piece, 1, overlap) == pytest.approx(elastic, rel=1e-12)
    assert laws.force(piece, 1, dent) == 0.0
    given_back = laws.energy(piece, 1, after)
    assert laws.lost_to_yielding(piece, before, 0, 2) == pytest.approx(loading - given_back, rel=1e-6)
    assert laws.force(piece, 0, begin) == pytest.approx(piece.yield_force[0], rel=1e-9)
    own = laws.overlap_on_spring(piece, 1, 2.0 * after, 1e-8)
    assert own + 1e-8 * laws.force(piece, 1, own) == pytest.approx(2.0 * after, rel=1e-12)


class Cone(NamedTuple):
    """A user's piece: F = k δ²."""

    stiffness: Any

    @staticmethod
    def force(law, i, overlap):  # type: ignore[no-untyped-def]
        return law.stiffness[i] * overlap**2 if overlap > laws.NEGLIGIBLE else 0.0

    @staticmethod
    def slope(law, i, overlap):  # type: ignore[no-untyped-def]
        return 2.0 * law.stiffness[i] * overlap if overlap > laws.NEGLIGIBLE else 0.0

    @staticmethod
    def energy(law, i, overlap):  # type: ignore[no-untyped-def]
        return law.stiffness[i] * overlap**3 / 3.0 if overlap > laws.NEGLIGIBLE else 0.0


@dataclass(frozen=True)
class Conical(hl.ContactLaw):
    stiffness: float
    piece = Cone

    def force(self, approach: Vector) -> Vector:
        return self.stiffness * np.maximum(approach, 0.0) ** 2


class Soft(NamedTuple):
    """A user's piece: a dashpot whose force saturates. One of its numbers has the name of a function of the kernels."""

    coefficient: Any
    drag: float

    @staticmethod
    def with_loss(loss, i, elastic, slope, overlap, rate):  # type: ignore[no-untyped-def]
        return max(elastic + loss.coefficient[i] * rate / (1.0 + abs(rate) / loss.drag), 0.0)


@dataclass(frozen=True)
class Saturating(hl.Dissipation):
    viscosity: float
    drag: float
    piece = Soft

    def coefficients(self, mass: Vector) -> Vector:
        return np.full_like(mass, self.viscosity)


def test_a_users_pieces_run_as_those_built_in() -> None:
    """In one run: a cone's law between beads, a table at one contact, Hertz's law at the wall; a saturating loss."""
    small, table = hl.Sphere(3e-3, hl.BRASS_360), hl.laws.PowerLaw(2e8, 1.3)

    def run(cone: hl.ContactLaw, loss: hl.Dissipation) -> Any:
        def law(one: Any, other: Any) -> hl.ContactLaw:
            if isinstance(other, hl.Surface):
                return hl.contact_law(one, other)
            return table if one is small else cone

        chain = hl.Chain([STEEL] * 3 + [small] + [STEEL] * 4, STEEL, 0.1, law=law, dissipation=loss)
        simulation = hl.CoSimulation(chain, WALL)
        return simulation, simulation.run(2e-4)

    own, found = run(Conical(2e14), Saturating(5.0, 1e12))
    _, expected = run(hl.laws.PowerLaw(2e14, 2.0), hl.LinearDashpot(5.0))
    assert isinstance(own.chain.model.law, laws.Mixed)
    assert isinstance(own.chain.model.law.own, Cone)
    assert own.chain.model.law.is_own.tolist() == [True] * 4 + [False] + [True] * 3 + [False]
    assert isinstance(own.chain.model.loss, Soft)
    assert found.contact_force.values == pytest.approx(
        expected.contact_force.values, abs=1e-6 * float(expected.contact_force.max())
    )
    assert hl.energy_error(found) < 1e-5
    assert float(found.dissipated_energy[-1]) == pytest.approx(float(expected.dissipated_energy[-1]), rel=1e-6)
    assert not any("table" in one for one in found.warnings.splitlines())


def wrong_law(**members: Any) -> hl.ContactLaw:
    """Conical with other functions in its piece, or another piece."""
    if not {"force", "slope", "energy"} & set(members):
        return type("Own", (Conical,), members)(2e14)  # type: ignore[no-any-return]
    piece = type("Cut", (Cone,), {name: one and staticmethod(one) for name, one in members.items()})
    return type("Own", (Conical,), {"piece": piece})(2e14)  # type: ignore[no-any-return]


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (
            wrong_law(force=lambda law, i, d: law.stiffness[i] * d**2),
            r"law: Cut\.force = 200 at an overlap of -1e-06 m: must be 0, as Own says",
        ),
        (
            wrong_law(energy=lambda law, i, d: law.stiffness[i] * d**3 / 2.0 if d > 0.0 else 0.0),
            r"law: Cut\.energy = 1e-07 at an overlap of 1e-07 m: must be 6\.66\d*e-08",
        ),
    ],
)
def test_a_piece_that_contradicts_its_law_is_named(law: hl.ContactLaw, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        hl.Chain([STEEL] * 3, STEEL, 0.3, law=law)


def test_a_piece_that_numba_cannot_compile_is_named() -> None:
    law = wrong_law(force=lambda law, i, d: fsum([law.stiffness[i] * d**2]) if d > 0.0 else 0.0)
    with pytest.raises(ValueError, match=r"^Cut\.force: Numba cannot compile it: \S.*$"):
        hl.CoSimulation(hl.Chain([STEEL] * 3, STEEL, 0.3, law=law), None).run(1e-5)


@pytest.mark.skipif(machine() not in ("x86_64", "AMD64"), reason="the name of the instruction")
def test_the_pass_over_the_beads_has_vector_instructions() -> None:
    chain = hl.stepping.MovingChain(hl.Chain([STEEL] * 8, STEEL, 0.4), WALL.surface)
    state, work = chain.start(), chain.work_space()
    types = [typeof(one) for one in (0, state.position, state.velocity, work, 0.0, 1e-6, 3, 0.0, 0.0, 0, False)]
    kernel = njit(Verlet.move)
    kernel.compile((typeof(Verlet()), typeof(chain.model), *types))
    assert "sqrtpd" in "".join(kernel.inspect_asm().values())


@pytest.mark.parametrize("loss", PASS_LOSSES)
@pytest.mark.parametrize(("gap", "slowest"), [(-4e-6, -0.1), (2e-7, -0.1), (2e-7, 0.3)])
@pytest.mark.parametrize("steps", [1, 2, 3])
def test_a_repeated_trial_moves_all_bodies_that_the_surface_reaches(
    steps: int, gap: float, slowest: float, loss: str
) -> None:
    """The last bodies, moved again against another surface, are where all bodies moved against it would be."""
    bead = hl.Sphere(4.76e-3, hl.STEEL_440C)
    row = hl.Chain([bead] * 8, bead, 0.4, dissipation=PASS_LOSSES[loss])
    chain = hl.stepping.MovingChain(row, hl.Surface(hl.STEEL_316))
    chain.__dict__["model"] = chain.model._replace(ends=chain.model.ends.view(np.recarray))
    places, speeds, window = gap * np.arange(9.0) - 8.0 * min(gap, 0.0), np.linspace(0.3, slowest, 9), 4e-6
    speeds = -speeds if slowest > 0.0 else speeds
    places[6:] = places[6] - 4e-6 * np.arange(3.0)

    pace = pace_of(chain.model, [steps], 9)
    assert pace["reached"] == 9 - steps - (loss != "none")

    def moved(wall: float, again: bool, y: Vector, v: Vector, work: Vector) -> tuple[Any, ...]:
        contact, found = np.zeros(1, TRIED).view(np.recarray), np.zeros(1, MOVED).view(np.recarray)
        contact.start, contact.surface = -1e-6, wall
        advance(chain.model, places, speeds, y, v, work, 0.0, window, contact, pace.view(np.recarray), found, again)
        return y, v, contact.answer, found.lost

    trial = np.zeros(9), np.zeros(9), chain.work_space()
    moved(-4e-5, False, *trial)
    again = moved(1e-5, True, *trial)
    whole = moved(1e-5, False, np.zeros(9), np.zeros(9), chain.work_space())
    assert all(np.array_equal(part, other) for part, other in zip(again, whole, strict=True))


LOADS: dict[str, dict[str, Any]] = {
    "preload": {"preload": 5.0},
    "preload, power law": {"preload": 5.0, "law": hl.laws.PowerLaw(5e9, 1.4)},
    "push": {"striker": hl.PushedBead([0.0, 2e-5], [0.0, 50.0]), "impact_speed": None},
}
